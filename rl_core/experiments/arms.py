"""An arm: an algorithm with its configuration and environment, to be run with many seeds."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rl_core import sources
from rl_core.checks import fields, instance, integer, integers, require
from rl_core.experiments import provenance
from rl_core.identity import describe, import_path
from rl_core.training import Run
from rl_core.worlds import names

FORMAT = 4  # of what the store keeps; part of every digest
TAKEN = {"arm", "seed", "episode", "steps", "return", "terminated", "env_steps"}  # columns

Label = str | int | float | bool


@dataclass(frozen=True)
class Arm:
    """One way of learning, to be run with many seeds.

    Attributes
    ----------
    name : str
        What the tables call it. Not part of what makes the result.
    algorithm : callable
        `algorithm(env, config, *, episodes, seeds, snapshots=()) -> Run`, a function that can be
        imported, so that a worker can find it. It is called with one seed at a time and must be a
        pure function of its arguments. If a function `check_<algorithm>(env, config)` stands beside
        it in its module, it is asked before anything runs (`check`).
    env : str or Make or callable or Task
        The environment: a Gymnasium id, `Make(id, arguments)`, or an import path
        "module:attribute" (`rl_core.worlds.names`). A class, function or compiled task is kept as
        its import path, under which a worker finds it.
    config : dataclass
        Frozen; its values in terms of JSON (`rl_core.identity.describe`).
    episodes : int
        Episodes a seed, at least 1.
    snapshots : tuple of int
        After which episodes the algorithm shall keep what it has learned so far; 0 is before the
        first.
    labels : mapping of str to (str, int, float or bool)
        What the arm stands for, for tables: each becomes a column beside `arm`. Not part of what
        makes the result.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> from rl_core.experiments import Arm
    >>> from rl_core.reinforce import ReinforceConfig, reinforce
    >>> arm = Arm("slow", reinforce, "Acrobot-v1", ReinforceConfig(), 20, labels={"rate": 0.1})
    >>> arm.algorithm_name
    'rl_core.reinforce:reinforce'
    """

    name: str
    algorithm: Callable[..., Run]
    env: Any
    config: Any
    episodes: int
    snapshots: tuple[int, ...] = ()
    labels: Mapping[str, Label] = field(default_factory=dict)

    def __post_init__(self) -> None:
        fields(
            self,
            name=(instance, str, "a text that is not empty"),
            episodes=(integer, 1),
            snapshots=(instance, tuple, "a tuple of integers"),
            labels=(instance, Mapping, "a mapping of names to values"),
        )
        import_path("algorithm", self.algorithm, "a function")
        object.__setattr__(self, "env", names.name_of(self.env))
        require(self.name, "name", self.name, "a text that is not empty")
        fields(self, snapshots=(integers, 0, self.episodes))
        parameters = getattr(type(self.config), "__dataclass_params__", None)
        if parameters is None or not parameters.frozen:
            raise TypeError(f"config must be a frozen dataclass's instance, got {self.config!r}")
        describe(self.config)
        for label, value in self.labels.items():
            allowed = f"texts other than {', '.join(sorted(TAKEN))}"
            require(isinstance(label, str) and label not in TAKEN, "labels", label, allowed)
            instance(f"labels[{label!r}]", value, Label, "a str, int, float or bool")
        object.__setattr__(self, "labels", dict(self.labels))

    @property
    def algorithm_name(self) -> str:
        """The algorithm's import path, "module:function"."""
        return import_path("algorithm", self.algorithm, "a function")

    def check(self) -> dict[str, Any]:
        """Return the arm's identity, or raise what would stop it; run nothing.

        The configuration has to be of the class that the algorithm's `config` is annotated with;
        the rest is told by `check_<algorithm>`, where there is one.

        Raises
        ------
        TypeError, ValueError
            With the arm's name in front.
        """
        module, _, name = self.algorithm_name.partition(":")
        expected = getattr(self.algorithm, "__annotations__", {}).get("config")
        check = getattr(sys.modules[module], f"check_{name}", None)
        try:
            if isinstance(expected, type):
                instance("config", self.config, expected, f"a {expected.__name__}")
            if check is not None:
                check(self.env, self.config)
            return self.identity()
        except (TypeError, ValueError) as error:
            kind = TypeError if isinstance(error, TypeError) else ValueError
            raise kind(f"arm {self.name!r}: {error}") from error

    def identity(self) -> dict[str, Any]:
        """Return all that decides the bits of this arm's results, the seed aside, as JSON.

        The code is that of the algorithm's module, of the modules of all classes and functions that
        the configuration names, and of the environment.

        Raises
        ------
        TypeError, ValueError
            The environment, or a part of it, cannot be found by import.
        """
        modules = {self.algorithm_name.partition(":")[0]}
        config = describe(self.config, modules=modules)
        environment = names.identity(self.env)
        return {
            "format": FORMAT,
            "algorithm": self.algorithm_name,
            "env": str(self.env),
            "config": config,
            "episodes": self.episodes,
            "snapshots": list(self.snapshots),
            "code": sources.code(modules) | environment.pop("code"),
            "environment": environment,
            "platform": provenance.platform_settings(),
            "versions": provenance.versions(),
        }
