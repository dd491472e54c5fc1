"""The settings of a chapter's arms as tables: what each changes, and all there is to set."""

from collections.abc import Iterator, Sequence
from dataclasses import MISSING, fields, is_dataclass
from typing import Any

import pandas as pd

from rl_core.checks import require
from rl_core.experiments import Arm


def table(arms: Sequence[Arm], reported: Arm | str) -> pd.DataFrame:
    """One row an arm: its name, and where it differs from the reported one.

    Parameters
    ----------
    arms : sequence of Arm
    reported : Arm or str
        The arm to compare with, or its name among `arms`.

    Returns
    -------
    pandas.DataFrame
        Columns `arm, environment, episodes, differs`; `differs` is text such as "gamma=0.9".

    Raises
    ------
    ValueError
        If `reported` is a name that no arm has.

    Examples
    --------
    >>> from rl_core.reinforce import ReinforceConfig, reinforce
    >>> def arm(name, **changes):
    ...     return Arm(name, reinforce, "Acrobot-v1", ReinforceConfig(**changes), episodes=10)
    >>> table([arm("plain"), arm("short", gamma=0.9)], "plain")["differs"].tolist()
    ['', 'gamma=0.9']
    """
    if isinstance(reported, str):
        named = [arm for arm in arms if arm.name == reported]
        require(named, "reported", reported, "the name of an arm")
        reported = named[0]
    of_reported = dict(_flat(reported.config))
    rows = [
        {
            "arm": arm.name,
            "environment": str(arm.env),
            "episodes": arm.episodes,
            "differs": ", ".join(
                f"{name}={value}"
                for name, value in _flat(arm.config)
                if of_reported.get(name, MISSING) != value
            ),
        }
        for arm in arms
    ]
    return pd.DataFrame(rows)


def hyperparameters(config: Any) -> pd.DataFrame:
    """Every hyperparameter of a configuration at its value.

    Parameters
    ----------
    config : dataclass
        What is nested in it gets a row a field as well.

    Returns
    -------
    pandas.DataFrame
        Columns `hyperparameter, value`, both text.

    Raises
    ------
    TypeError
        If `config` is no instance of a dataclass.

    Examples
    --------
    >>> from rl_core.reinforce import ReinforceConfig
    >>> hyperparameters(ReinforceConfig()).head(3)
       hyperparameter     value
    0           gamma      0.99
    1         network     MLP()
    2  network.hidden  (10, 20)
    """
    if not is_dataclass(config) or isinstance(config, type):
        raise TypeError(f"config must be a dataclass's instance, got {config!r}")
    return pd.DataFrame(list(_flat(config)), columns=["hyperparameter", "value"], dtype=str)


def _flat(config: Any, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Names and values; a nested dataclass counts by its class, then field by field."""
    for field in fields(config):
        value, name = getattr(config, field.name), f"{prefix}{field.name}"
        if is_dataclass(value) and not isinstance(value, type):
            yield name, f"{type(value).__name__}()"
            yield from _flat(value, f"{name}.")
        else:
            yield name, getattr(value, "__name__", str(value))
