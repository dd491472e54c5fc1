"""DQN against Stable-Baselines3: microseconds an environment step with its update.

Both have the same network, batch, memory and rate of updates: one update of 512 transitions a step,
once the memory is full. The rates are taken over steps that all have an update.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from stable_baselines3 import DQN
from torch import nn

from bench.table import comparison
from rl_core.dqn import DQNConfig, dqn
from rl_core.policies import MLP

SEEDS = range(30)
STARTS = 1_000  # steps before the first update
STEPS = 2_000  # measured steps, each with an update
ROUNDS = 3
CONFIG = DQNConfig.report_2018(
    network=MLP(),
    optimiser="adam",
    memory_size=3_000,
    learning_starts=STARTS,
    epsilon=0.1,
    max_episode_steps=500,
)


def ours(name: str, seeds: range) -> float:
    """Seconds for `STEPS` updates of every seed, the steps before the first one taken off."""

    def seconds(max_env_steps: int) -> float:
        config = replace(CONFIG, max_env_steps=max_env_steps)
        start = time.perf_counter()
        dqn(name, config, episodes=100_000, seeds=seeds)
        return time.perf_counter() - start

    return seconds(STARTS + STEPS) - seconds(STARTS - 1)


def stable_baselines(name: str, seed: int) -> float:
    """Seconds for `STEPS` updates of one seed, the steps before the first one taken off."""
    model = DQN(
        "MlpPolicy",
        name,
        gamma=CONFIG.gamma,
        learning_rate=CONFIG.learning_rate,
        batch_size=CONFIG.batch_size,
        buffer_size=CONFIG.memory_size,
        learning_starts=STARTS,
        train_freq=1,
        gradient_steps=1,
        target_update_interval=CONFIG.copy_every,
        exploration_fraction=1e-6,
        exploration_final_eps=CONFIG.epsilon,
        policy_kwargs={"net_arch": list(CONFIG.network.hidden), "activation_fn": nn.ReLU},
        device="cpu",
        seed=seed,
    )
    model.learn(STARTS)
    start = time.perf_counter()
    model.learn(STEPS, reset_num_timesteps=False)
    return time.perf_counter() - start


def best_of(ways: dict[str, Callable[[int], float]]) -> dict[str, float]:
    """Compile, then let the ways take turns; the fastest round of each counts."""
    best = dict.fromkeys(ways, np.inf)
    dqn("Acrobot-v1", replace(CONFIG, max_env_steps=2 * STARTS), episodes=1_000, seeds=[99])
    for seed in range(ROUNDS):
        for name, way in ways.items():
            best[name] = min(best[name], way(seed))
    return best


def rows() -> list[dict]:
    """Measure both tasks."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        return [_row(name) for name in ("Acrobot-v1", "MountainCar-v0")]
    finally:
        torch.set_num_threads(threads)


def _row(name: str) -> dict:
    best = best_of(
        {
            "theirs": lambda seed: stable_baselines(name, seed),
            "ours": lambda _: ours(name, SEEDS),
        }
    )
    rival = best["theirs"] / STEPS * 1e6
    mine = best["ours"] / STEPS / len(SEEDS) * 1e6
    return comparison(
        f"DQN on {name}, batch {CONFIG.batch_size}, an update every step",
        "Stable-Baselines3 DQN",
        rival,
        mine,
        "microseconds a step",
        "rival: one seed; ours: 30 seeds, a seed's share; one core; "
        f"{STEPS:,} steps a seed, all with an update; widths 10-20, Adam; the rival clips "
        "gradients and has the Huber loss",
    )


if __name__ == "__main__":
    for measured in rows():
        print(measured)
