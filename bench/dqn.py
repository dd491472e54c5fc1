"""DQN against Stable-Baselines3, a vmapped DQN in JAX, and networks stacked in torch.

All have the same network, batch, memory and rate of updates: one update of 512 transitions a step,
once the memory holds enough. The rates are taken over steps that all have an update, in
microseconds of processor time a step and seed; so a rival that uses several cores pays for each.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import joblib
import torch
from stable_baselines3 import DQN
from torch import nn

from bench import stacked
from bench.table import comparison, in_turns, processor_seconds
from rl_core.dqn import DQNConfig, dqn
from rl_core.policies import MLP

SEEDS = range(30)
STARTS = 1_000  # steps before the first update
STEPS = 1_000  # measured steps of a seed and turn, each with an update
STEPS_OF_STACKS = 300  # likewise, of the rivals that train all seeds at once
CONFIG = DQNConfig.report_2018(
    network=MLP(),
    optimiser="adam",
    memory_size=3_000,
    learning_starts=STARTS,
    epsilon=0.1,
    max_episode_steps=500,
)
JAX = Path(sys.prefix) / "jax" / "bin" / "python"  # `make bench` makes it: see bench/jax.txt
MOUNTAIN_CAR = "MountainCar-v0"
UNIT = "processor µs a step"


def ours(name: str, seeds: range) -> float:
    """Seconds for `STEPS` updates of every seed, the steps before the first one taken off."""

    def seconds(max_env_steps: int) -> float:
        config = replace(CONFIG, max_env_steps=max_env_steps)
        return processor_seconds(lambda: dqn(name, config, episodes=100_000, seeds=seeds))

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
    return processor_seconds(lambda: model.learn(STEPS, reset_num_timesteps=False))


@contextmanager
def in_jax(name: str) -> Iterator[Callable[[], tuple[float, float]]]:
    """Start the rival in JAX; give a function that has it take a turn: processor and wall time."""
    if not JAX.exists():
        raise SystemExit(f"{JAX} is missing: `make bench` installs bench/jax.txt there")
    settings = {
        "env": name,
        "seeds": len(SEEDS),
        "steps": STEPS_OF_STACKS,
        "starts": STARTS,
        "hidden": CONFIG.network.hidden,
        "learning_rate": CONFIG.learning_rate,
        "gamma": CONFIG.gamma,
        "memory_size": CONFIG.memory_size,
        "batch_size": CONFIG.batch_size,
        "copy_every": CONFIG.copy_every,
        "epsilon": CONFIG.epsilon,
    }
    command = [str(JAX), str(Path(__file__).parent / "jax_dqn.py"), json.dumps(settings)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "bufsize": 1}
    with subprocess.Popen(command, **pipes) as child:

        def turn() -> tuple[float, float]:
            child.stdin.write("\n")
            answer = child.stdout.readline()
            if not answer:
                raise SystemExit("the rival in JAX ended; what it said is above")
            return tuple(json.loads(answer))

        turn()  # compiled, and the memory filled
        yield turn
        child.stdin.close()


def rows() -> list[dict]:
    """Measure both tasks."""
    torch.set_num_threads(1)
    dqn("Acrobot-v1", replace(CONFIG, max_env_steps=2 * STARTS), episodes=1_000, seeds=[99])
    return [row for name in ("Acrobot-v1", MOUNTAIN_CAR) for row in _rows(name)]


def _rows(name: str) -> Iterator[dict]:
    benchmark = f"DQN on {name}, batch {CONFIG.batch_size}, an update every step"
    busy: list[float] = []
    stacks = len(SEEDS) * STEPS_OF_STACKS
    with in_jax(name) as turn:

        def jax() -> float:
            processor, wall = turn()
            busy.append(processor / wall)
            return processor / stacks * 1e6

        ways = {
            "ours": lambda _: ours(name, SEEDS) / STEPS / len(SEEDS) * 1e6,
            "Stable-Baselines3 DQN": lambda seed: stable_baselines(name, seed) / STEPS * 1e6,
            "rejax, a vmapped DQN in JAX": lambda _: jax(),
        }
        if name == MOUNTAIN_CAR:
            rival = stacked.DQN(len(SEEDS), CONFIG, seed=0)
            rival.run(STARTS, learning=False)
            rival.run(10)
            way = lambda _: processor_seconds(lambda: rival.run(STEPS_OF_STACKS)) / stacks * 1e6  # noqa: E731
            ways[stacked.NAME] = way
        costs = in_turns(ways, benchmark)
    notes = {
        "Stable-Baselines3 DQN": "rival: one seed; it clips gradients and has the Huber loss",
        "rejax, a vmapped DQN in JAX": (
            f"rival: 30 seeds, gymnax's environment, free to use {joblib.cpu_count()} cores, "
            f"{max(busy):.1f} of them busy at most"
        ),
        stacked.NAME: "rival: 30 seeds and cars in lockstep, baddbmm, autograd, fused Adam",
    }
    for against in list(ways)[1:]:
        note = (
            f"{notes[against]}; ours: 30 seeds, {STEPS:,} steps a seed, all with an update, one "
            "core; widths 10-20, Adam"
        )
        yield comparison(benchmark, against, costs[against], costs["ours"], UNIT, note)


if __name__ == "__main__":
    for measured in rows():
        print(measured)
