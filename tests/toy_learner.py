"""A learner that costs nothing, to try the machinery around learners with."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from rl_core.training import Failure, Run


@dataclass(frozen=True)
class ToyConfig:
    """Settings of `learn`.

    Attributes
    ----------
    step_size : float
        How far an episode moves the weights.
    diverging, raising : tuple of int
        Seeds whose weights become NaN in the third episode; seeds that raise an exception.
    seconds : float
        Time an episode takes.
    """

    step_size: float = 0.1
    diverging: tuple[int, ...] = ()
    raising: tuple[int, ...] = ()
    seconds: float = 0.0


def learn(
    env: str,
    config: ToyConfig,
    *,
    episodes: int,
    seeds: Sequence[int],
    snapshots: Sequence[int] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Run:
    """Move some weights at random, each seed by its own stream."""
    for seed in seeds:
        if seed in config.raising:
            raise ValueError(f"cannot learn from {seed}")
    streams = [np.random.default_rng(np.random.SeedSequence(seed)) for seed in seeds]
    weights = np.stack([stream.normal(size=(2, 3)) for stream in streams])
    env_steps = np.zeros(len(seeds), dtype=np.int64)
    kept = np.full((len(seeds), len(snapshots), 2, 3), np.nan, dtype=np.float32)
    rows, failures, stopped = [], [], set()
    for episode in range(episodes + 1):
        kept[:, [i for i, wanted in enumerate(snapshots) if wanted == episode]] = weights[:, None]
        if episode == episodes:
            break
        for i, (seed, stream) in enumerate(zip(seeds, streams, strict=True)):
            if seed in stopped:
                continue
            steps = int(stream.integers(1, 500))
            env_steps[i] += steps
            weights[i] += config.step_size * stream.normal(size=(2, 3))
            rows.append((seed, episode + 1, steps, -float(steps), steps < 400, env_steps[i]))
            if seed in config.diverging and episode == 2:
                weights[i] = np.nan
                failures.append(Failure(seed, episode + 1, "weights are NaN"))
                stopped.add(seed)
        time.sleep(config.seconds * len(seeds))
        if progress is not None:
            progress((episode + 1) * len(seeds), int(env_steps.sum()))
    columns = ["seed", "episode", "steps", "return", "terminated", "env_steps"]
    table = pd.DataFrame(rows, columns=columns).sort_values(["seed", "episode"])
    arrays = {"weights": weights, "snapshots": kept, "env_steps": env_steps}
    return Run(table, arrays, tuple(failures))


def extra_column(env: str, config: ToyConfig, **arguments: Any) -> Run:
    """Learn as `learn` does, with one more column in the table."""
    run = learn(env, config, **arguments)
    return Run(run.table.assign(extra=0), run.arrays)


def count_threads(
    env: str,
    config: ToyConfig,
    *,
    episodes: int,
    seeds: Sequence[int],
    snapshots: Sequence[int] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Run:
    """Learn how many threads torch uses."""
    import torch

    threads = np.full(len(seeds), torch.get_num_threads())
    return Run(pd.DataFrame({"seed": list(seeds)}), {"threads": threads})


_HOARD: list[Any] = []


def hoard(env: str, config: ToyConfig, **arguments: Any) -> Run:
    """Learn as `learn` does; the second time in a process, keep 400 MB for good."""
    _HOARD.append(np.ones(50_000_000 if len(_HOARD) == 1 else 1))
    return learn(env, config, **arguments)
