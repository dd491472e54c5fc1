"""Chapter 7: a room of one's own: the arms, a claim about them, and what is measured.

The settings were chosen on seeds from 1000 on, and the claim's criteria before any other seed was
run.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from examples.actor_critic import ActorCriticConfig, actor_critic
from examples.room import COMFORT, DAY, Room
from examples.room_task import FastRoom
from report.claims import Claim, Criterion, Evidence, Finding
from report.seeds import SEEDS
from rl_core.dqn import DQNConfig, dqn
from rl_core.evaluation import evaluate, greedy
from rl_core.experiments import Arm, Results, run
from rl_core.exploration import Linear
from rl_core.kernels.compiled import compiled
from rl_core.policies import MLP, Module
from rl_core.statistics import bootstrap_interval, probability_of_improvement

DAYS, FEW_DAYS = 200, 60
CONFIG = DQNConfig(
    gamma=0.9,
    network=MLP((32, 32)),
    batch_size=32,
    learning_rate=2e-3,
    learning_starts=500,
    copy_every=200,
    epsilon=Linear(1.0, 0.05, steps=5_000),
)
CRITIC = ActorCriticConfig(
    gamma=0.9, policy=MLP((32,)), value=MLP((32,)), policy_rate=0.05, value_rate=0.05
)
FAR, NEAR = "looks ahead (gamma 0.9)", "lives for the moment (gamma 0.3)"

CLAIM = Claim(
    "own",
    "7",
    "Who looks ahead heats a room better than a thermostat, and than who does not.",
    (
        Criterion("median over seeds of a day's return, minus the thermostat's, above 0", above=0),
        Criterion("probability that a seed that looks ahead earns more, above 0.5", above=0.5),
    ),
    "Figure S7.6",
)


def arms() -> list[Arm]:
    """DQN on the compiled room, with a discount that looks some hours ahead and one that does not.

    A quarter of an hour is a step: at 0.9 what comes in two hours counts half, at 0.3 nothing.
    """
    return [
        Arm(FAR, dqn, FastRoom, CONFIG, DAYS, labels={"gamma": 0.9}),
        Arm(NEAR, dqn, FastRoom, replace(CONFIG, gamma=0.3), DAYS, labels={"gamma": 0.3}),
    ]


def small_arms() -> list[Arm]:
    """What runs in torch, or in Gymnasium's loop: fewer days, and updates less often."""
    few = replace(CONFIG, update_every=4, epsilon=Linear(1.0, 0.05, steps=3_000))
    clock = replace(few, network=Module("examples.networks:clock"), engine=None)
    return [
        Arm("perceptron, Gymnasium's room", dqn, Room, few, FEW_DAYS),
        Arm("clock", dqn, FastRoom, clock, FEW_DAYS),
        Arm("actor-critic", actor_critic, FastRoom, CRITIC, FEW_DAYS),
    ]


def learn(store: Path) -> tuple[Results, Results]:
    """Run what the store does not have; the rest is read."""
    return run(arms(), seeds=SEEDS, store=store), run(small_arms(), seeds=SEEDS[:2], store=store)


def thermostat(observation: np.ndarray) -> int:
    """Heat below what is comfortable, by day and by night."""
    return int(observation[0] < 1.0)


def day(act: Callable[[np.ndarray], int], seed: int) -> pd.DataFrame:
    """A day in Gymnasium's room: its temperature and heating by the hour, and what it earned."""
    room = Room()
    seen, _ = room.reset(seed=seed)
    rows, over = [], False
    while not over:
        action = act(seen)
        seen, reward, over, _, _ = room.step(action)
        rows.append((seen[1] * 24, seen[0] * COMFORT, action, reward))
    return pd.DataFrame(rows, columns=["hour", "temperature", "heating", "reward"])


def earned(results: Results, arm: str, days: int = 20) -> np.ndarray:
    """Mean return of a day with each seed's greedy policy, on days that training never saw."""
    trained = results.arm(arm)
    means = []
    for seed in trained.table["seed"].unique():
        agent = greedy(trained.agent(int(seed)))
        played = evaluate(FastRoom, agent, seed=int(seed), episodes=days, max_steps=DAY)
        means.append(played["return"].mean())
    return np.array(means)


def judge(far: np.ndarray, near: np.ndarray, by_rule: float) -> Finding:
    """Judge the claim."""
    rng = np.random.default_rng(np.random.SeedSequence(2018))
    better = bootstrap_interval(far - by_rule, rng=rng)
    oftener = probability_of_improvement(-far, -near, rng=rng)  # the lower, the better
    return CLAIM.judge(*(Evidence(*interval, seeds=len(far)) for interval in (better, oftener)))


@compiled
def _heat_at_random(kernel, rng, seen, days):
    """The usual loop, compiled: reset, step, observe."""
    action = np.empty(1, np.float32)
    for _ in range(days):
        kernel.start(rng, kernel.state, seen)
        over = False
        while not over:
            action[0] = rng.integers(0, 2)
            _, over = kernel.step(kernel.state, action)
            kernel.observe(kernel.state, seen)


def speed(days: int = 30) -> pd.DataFrame:
    """Steps a second with actions drawn at random: Gymnasium's usual loop, and ours on the task."""
    room, rng, kernel = Room(), np.random.default_rng(0), FastRoom.kernel()
    _heat_at_random(kernel, rng, np.empty(2, np.float32), 1)  # compiled before it is timed
    start = time.perf_counter()
    _heat_at_random(kernel, rng, np.empty(2, np.float32), 1_000 * days)
    fast = 1_000 * days * DAY / (time.perf_counter() - start)
    start = time.perf_counter()
    for seed in range(days):
        room.reset(seed=seed)
        over = False
        while not over:
            _, _, over, _, _ = room.step(int(rng.integers(2)))
    usual = days * DAY / (time.perf_counter() - start)
    return pd.DataFrame({"loop": ["Gymnasium's", "compiled task"], "steps a second": [usual, fast]})
