"""An arm: an algorithm with its configuration and environment, to be run with many seeds."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rl_core import provenance, sources
from rl_core.run import Run

FORMAT = 1  # of what the store keeps; part of every digest


@dataclass(frozen=True)
class Arm:
    """One way of learning, to be run with many seeds.

    Attributes
    ----------
    name : str
        What the tables call it. Not part of what makes the result.
    algorithm : callable
        `algorithm(env, config, *, episodes, seeds, snapshots=(), progress=None) -> Run`, a function
        that can be imported, so that a worker can find it. It must be pure: the same bits for a
        seed alone or among others. If a function `check_<algorithm>(env, config)` stands beside it
        in its module, it is asked before anything runs (`check`).
    env : str
        The environment's id.
    config : dataclass
        Frozen; its values in terms of JSON (`rl_core.provenance.describe`).
    episodes : int
        Episodes a seed, at least 1.
    snapshots : tuple of int
        After which episodes the algorithm shall keep what it has learned so far; 0 is before the
        first.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.
    """

    name: str
    algorithm: Callable[..., Run]
    env: str
    config: Any
    episodes: int
    snapshots: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for attribute in ("name", "env"):
            value = getattr(self, attribute)
            if not isinstance(value, str) or not value:
                raise TypeError(f"{attribute} is {value!r}; allowed is a text that is not empty")
        module, _, name = self.algorithm_name.partition(":")
        found = getattr(sys.modules.get(module), name, None)
        if module == "__main__" or found is not self.algorithm or not callable(found):
            raise TypeError(
                f"algorithm is {self.algorithm!r}; allowed is a function at the top of a module "
                "that workers can import"
            )
        parameters = getattr(type(self.config), "__dataclass_params__", None)
        if parameters is None or not parameters.frozen:
            raise TypeError(f"config is {self.config!r}; allowed is a frozen dataclass's instance")
        provenance.describe(self.config)
        check_integer("episodes", self.episodes, least=1)
        if not isinstance(self.snapshots, tuple):
            raise TypeError(f"snapshots is {self.snapshots!r}; allowed is a tuple of integers")
        for episode in self.snapshots:
            check_integer("snapshots", episode, least=0)
            if episode > self.episodes:
                raise ValueError(f"snapshots has {episode}; allowed are 0 to {self.episodes}")

    @property
    def algorithm_name(self) -> str:
        """The algorithm's import path, `module:function`."""
        module = getattr(self.algorithm, "__module__", None)
        return f"{module}:{getattr(self.algorithm, '__qualname__', None)}"

    def check(self) -> None:
        """Raise what the algorithm would raise for this environment and configuration.

        The configuration has to be of the class that the algorithm's `config` is annotated with;
        the rest is told by `check_<algorithm>`, where there is one.

        Raises
        ------
        TypeError, ValueError
            With the arm's name in front.
        """
        expected = getattr(self.algorithm, "__annotations__", {}).get("config")
        if isinstance(expected, type) and not isinstance(self.config, expected):
            raise TypeError(
                f"arm {self.name!r}: config is {self.config!r}; allowed is a {expected.__name__}"
            )
        module, _, name = self.algorithm_name.partition(":")
        check = getattr(sys.modules[module], f"check_{name}", None)
        if check is None:
            return
        try:
            check(self.env, self.config)
        except (TypeError, ValueError) as error:
            kind = TypeError if isinstance(error, TypeError) else ValueError
            raise kind(f"arm {self.name!r}: {error}") from error

    def identity(self) -> dict[str, Any]:
        """Return all that decides the bits of this arm's results, the seed aside, as JSON."""
        module, _, _ = self.algorithm_name.partition(":")
        return {
            "format": FORMAT,
            "algorithm": self.algorithm_name,
            "env": self.env,
            "config": provenance.describe(self.config),
            "episodes": int(self.episodes),
            "snapshots": [int(episode) for episode in self.snapshots],
            "code": sources.code([module, *provenance.environment_modules(self.env)]),
            "versions": provenance.versions(),
        }


def check_integer(name: str, value: object, least: int) -> None:
    """Raise unless `value`, called `name` in the message, is an integer from `least`.

    Raises
    ------
    TypeError
        If it is no integer, or a bool.
    ValueError
        If it is below `least`.

    Examples
    --------
    >>> check_integer("workers", 0, least=1)
    Traceback (most recent call last):
    ValueError: workers has 0; allowed are integers from 1
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name} has {value!r}; allowed are integers from {least}")
    if value < least:
        raise ValueError(f"{name} has {value}; allowed are integers from {least}")
