"""Temporary."""

import importlib
from dataclasses import dataclass, field

import gymnasium


@dataclass(frozen=True)
class Make:
    """An id with arguments."""

    id: str
    arguments: dict = field(default_factory=dict)


def find(env):
    """Find."""
    module, _, name = env.partition(":")
    if module and name.isidentifier():
        return getattr(importlib.import_module(module), name, None)
    return None


def make_environment(env):
    """Make."""
    found = find(env) if isinstance(env, str) else None
    if found is not None:
        return found()
    try:
        if isinstance(env, Make):
            return gymnasium.make(env.id, disable_env_checker=True, **env.arguments)
        return gymnasium.make(env, disable_env_checker=True)
    except (gymnasium.error.Error, ImportError) as error:
        raise ValueError(f"env must be an id that Gymnasium knows, got {env!r}: {error}") from error
