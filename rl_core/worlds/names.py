"""Names of environments: what an experiment calls a world, how it is opened, and what it is.

A name is a Gymnasium id, an id with arguments (`Make`), or an import path "module:attribute" of a
function or class that makes an environment, or of a compiled task. All of them travel to workers
and all of them can be told apart (`identity`).
"""

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec, registry

from rl_core import sources
from rl_core.checks import instance, require
from rl_core.identity import describe, import_path


@dataclass(frozen=True)
class Make:
    """A Gymnasium id with arguments for `gymnasium.make`.

    Attributes
    ----------
    id : str
    arguments : dict
        By name; values of JSON.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> from rl_core.worlds.names import Make, make_environment
    >>> make_environment(Make("FrozenLake-v1", {"is_slippery": False})).unwrapped.spec.kwargs
    {'map_name': '4x4', 'is_slippery': False}
    """

    id: str
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        instance("id", self.id, str, "a Gymnasium id")
        allowed = "a dict of values of JSON by name"
        instance("arguments", self.arguments, Mapping, allowed)
        try:
            text = json.dumps(dict(self.arguments), allow_nan=False)
        except (TypeError, ValueError):
            text = "null"
        require(json.loads(text) == dict(self.arguments), "arguments", self.arguments, allowed)
        object.__setattr__(self, "arguments", json.loads(text))

    def __str__(self) -> str:
        arguments = ", ".join(f"{key}={value!r}" for key, value in self.arguments.items())
        return f"{self.id}({arguments})" if arguments else self.id

    def __hash__(self) -> int:
        return hash((self.id, json.dumps(self.arguments, sort_keys=True)))


EnvironmentName = str | Make

_FIRST = frozenset(registry)  # the ids that were there before anybody's notebook registered one


def find(env: EnvironmentName) -> Any:
    """Return what stands at the import path `env`, or None if `env` is a Gymnasium id.

    Gymnasium's own "module:Name-v0" is an id: import the module, which registers the name.

    Raises
    ------
    ValueError
        The module cannot be imported, or has nothing of this name.

    Examples
    --------
    >>> from rl_core.worlds.names import find
    >>> find("rl_core.maze:Maze"), find("CartPole-v1"), find("rl_core:rl_core/Maze-v0")
    (<class 'rl_core.maze.Maze'>, None, None)
    """
    if not isinstance(env, str) or ":" not in env:
        return None
    module, _, path = env.rpartition(":")
    try:
        found = importlib.import_module(module)
    except (ImportError, ValueError) as error:
        raise ValueError(
            f"env must have a module that can be imported, got {env!r}: {error}"
        ) from (error)
    if path in registry or not all(part.isidentifier() for part in path.split(".")):
        return None
    try:
        return reduce(getattr, path.split("."), found)
    except AttributeError as error:
        if any(spec.name == path for spec in registry.values()):  # an id without version
            return None
        raise ValueError(f"env must name what its module has, got {env!r}: {error}") from error


def name_of(env: Any) -> EnvironmentName:
    """Return the name of an environment: a name itself, or where a function, class or task stands.

    Raises
    ------
    TypeError
        A worker could not find it there.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> from rl_core.worlds.names import name_of
    >>> name_of(Maze), name_of("CartPole-v1")
    ('rl_core.maze:Maze', 'CartPole-v1')
    """
    if isinstance(env, EnvironmentName):
        return env
    module, name = getattr(env, "module", ""), getattr(env, "name", "")  # of a compiled task
    if module not in ("", "__main__") and getattr(sys.modules.get(module), name, None) is env:
        return f"{module}:{name}"
    allowed = "a Gymnasium id, a Make, an import path, or a class, function or task that stands"
    return import_path("env", env, allowed)


def check_elsewhere(env: EnvironmentName, modules: Iterable[str]) -> None:
    """Raise unless a new process that imports these modules knows an id that this one knows.

    What a notebook or script registers, its workers have not run.

    Raises
    ------
    ValueError
        With what to do.
    """
    name = _as_make(env).id
    spec = registry.get(name)
    top = str(getattr(spec, "entry_point", "")).partition(".")[0]
    if spec is None or (name in _FIRST and top in ("gymnasium", "rl_core")):
        return
    program = f"import gymnasium, {', '.join(modules)}\ngymnasium.spec({name!r})"
    path = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    known = subprocess.run([sys.executable, "-c", program], env=path, capture_output=True)
    allowed = (
        "known to workers, which import modules but run no notebook or script: register it in a "
        f"module and say 'module:{name}', or name its class as 'module:Class'"
    )
    require(known.returncode == 0, "env", name, allowed)


def make_environment(env: EnvironmentName) -> gymnasium.Env[Any, Any]:
    """Open an environment by its name.

    Raises
    ------
    ValueError
        It cannot be opened; the message ends with the reason.
    TypeError
        `env` is no name, or what it names makes no environment.

    Examples
    --------
    >>> from rl_core.worlds.names import make_environment
    >>> make_environment("CartPole-v1").action_space.n
    np.int64(2)
    """
    named, found = _as_make(env), find(env)
    try:
        if found is None:
            return gymnasium.make(named.id, disable_env_checker=True, **named.arguments)
        made = found() if callable(found) else found
    except gymnasium.error.UnregisteredEnv as error:
        raise ValueError(f"env must be an id that Gymnasium knows, got {env!r}: {error}") from error
    except Exception as error:  # whatever the environment's code raises
        reason = str(error) or type(error).__name__
        raise ValueError(f"env must be one that opens here, got {env!r}: {reason}") from error
    if made is found or not isinstance(made, gymnasium.Env):
        allowed = "an import path of something that makes a gymnasium.Env"
        raise TypeError(f"env must be {allowed}, got {env!r}")
    return made


def identity(env: EnvironmentName) -> dict[str, Any]:
    """Return everything that decides what an environment does, as JSON.

    For an id: how Gymnasium has registered it, arguments included, and the code behind its entry
    point and its wrappers. For an import path: the code. Gymnasium's own code is not among it, it
    has a version.

    Raises
    ------
    TypeError, ValueError
        There is no such environment, or a part of it cannot be found by import: its code could not
        be told from another.

    Examples
    --------
    >>> from rl_core.worlds.names import identity
    >>> identity("CartPole-v1")["registration"]["max_episode_steps"]
    500
    >>> "rl_core.maze" in identity("rl_core/Maze-v0")["code"]
    True
    """
    named = _as_make(env)
    if find(env) is not None:
        code = sources.code([named.id.rpartition(":")[0]])
        require(code, "env", env, "something in a Python source file")
        return {"path": env, "code": code}
    where, modules = f"env {named.id!r}", {named.id.rpartition(":")[0]}
    spec = _registered(named.id)
    registration = vars(spec) | {
        "entry_point": _entry(where, spec.entry_point, modules),
        "vector_entry_point": None,  # it is not used
        "additional_wrappers": [
            vars(wrapper) | {"entry_point": _entry(where, wrapper.entry_point, modules)}
            for wrapper in spec.additional_wrappers
        ],
    }
    described = describe(registration, where, modules)
    others = {module for module in modules if module and module.split(".")[0] != "gymnasium"}
    return {**vars(named), "registration": described, "code": sources.code(others)}


def _as_make(env: EnvironmentName) -> Make:
    instance("env", env, EnvironmentName, "a Gymnasium id, a Make or an import path")
    return env if isinstance(env, Make) else Make(env)


def _registered(name: str) -> EnvSpec:
    """Return what Gymnasium holds under an id; one without version is the latest."""
    bare = name.rpartition(":")[2]
    if bare in registry:
        return registry[bare]
    with make_environment(name) as made:
        spec = made.spec
    return registry[spec.id] if spec is not None else EnvSpec(bare)


def _entry(where: str, entry_point: object, modules: set[str]) -> str:
    """Return an entry point's import path; note its module."""
    if not isinstance(entry_point, str):
        entry_point = import_path(where, entry_point, "registered with an entry point")
    modules.add(entry_point.partition(":")[0])
    return entry_point
