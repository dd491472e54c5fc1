"""A new algorithm is one file: it learns, is checked, and runs as the others do."""

import dataclasses
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces

from examples import actor_critic as algorithm
from examples.actor_critic import ActorCriticConfig, actor_critic
from rl_core import modules
from rl_core.experiments import Arm, run
from rl_core.policies import MLP, Module
from rl_core.training import spawn_streams

CORRIDOR = "toy_task:Corridor"
CONFIG = ActorCriticConfig(gamma=0.95, policy=MLP((8,)), value=MLP((8,)), policy_rate=0.05)


class Bandit(gymnasium.Env):
    """One step, two states drawn at the start: the action that is the state pays."""

    observation_space = spaces.Box(0, 1, (2,), np.float32)
    action_space = spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        """Draw a state."""
        super().reset(seed=seed)
        self.state = int(self.np_random.integers(2))
        return np.eye(2, dtype=np.float32)[self.state], {}

    def step(self, action):
        """Pay and end."""
        return np.ones(2, np.float32), float(action == self.state), True, False, {}


def test_it_is_a_file_of_little_more_than_a_hundred_lines():
    assert len(Path(algorithm.__file__).read_text().splitlines()) <= 110


@pytest.mark.parametrize("env", [CORRIDOR, lambda: gymnasium.make("CartPole-v1")])
def test_it_learns_to_leave_a_corridor_compiled_and_runs_through_gymnasium(env):
    episodes = 150 if env == CORRIDOR else 2
    table = actor_critic(env, CONFIG, episodes=episodes, seeds=[0, 1]).table
    assert table.groupby("seed").size().tolist() == [episodes] * 2
    if env == CORRIDOR:  # three to five steps from its end
        last = table[table["episode"] > 100]
        assert last["terminated"].all()
        assert last["steps"].mean() < 6
        assert table[table["episode"] <= 5]["steps"].mean() > 10


def test_it_learns_that_the_state_matters():
    table = actor_critic(lambda: Bandit(), CONFIG, episodes=600, seeds=[0]).table
    assert table["return"].tail(100).mean() > 0.9


def test_the_first_step_is_the_books_by_hand():
    """Linear networks: grad v(s) = s, and grad log pi(a|s) = (onehot(a) - pi) s^T."""
    config = ActorCriticConfig(
        policy=Module("toy_networks:linear_without_bias"),
        value=Module("toy_networks:linear_without_bias"),
        policy_rate=0.3,
        value_rate=0.2,
    )
    found = actor_critic(lambda: Bandit(), config, episodes=1, seeds=[3])
    arrays = {name: array[0] for name, array in found.arrays.items()}
    streams = spawn_streams(3)
    env = Bandit()
    state, _ = env.reset(seed=streams.environment_seed)
    theta, w = arrays["initial/policy.weight"], arrays["initial/value.weight"]
    pi = np.exp(theta @ state) / np.exp(theta @ state).sum()
    action = int(streams.policy.random() > pi[0])
    delta = found.table["return"].item() - w @ state
    assert found.table["return"].item() == float(action == env.state)
    np.testing.assert_allclose(arrays["value.weight"], w + 0.2 * delta * state, rtol=1e-5)
    step = 0.3 * delta * np.outer(np.eye(2)[action] - pi, state)
    np.testing.assert_allclose(arrays["policy.weight"], theta + step, rtol=1e-5)


def test_experiments_run_store_and_resume_it(tmp_path):
    arms = [
        Arm(
            name,
            actor_critic,
            CORRIDOR,
            dataclasses.replace(CONFIG, policy=policy, max_episode_steps=15),
            4,
            (0, 2),
        )
        for name, policy in [("corridor", MLP((8,))), ("module", Module("toy_networks:make"))]
    ]
    first = run(arms, seeds=[0, 1], store=tmp_path, workers=1, progress=False)
    resumed = run(arms, seeds=[0, 1, 2], store=tmp_path, workers=1, progress=False)
    for arm in arms:
        direct = actor_critic(
            arm.env, arm.config, episodes=4, seeds=[0, 1, 2], snapshots=arm.snapshots
        )
        rows = resumed.table[resumed.table["arm"] == arm.name].drop(columns="arm")
        assert rows.reset_index(drop=True).equals(direct.table)
        for name, array in direct.arrays.items():
            np.testing.assert_array_equal(resumed.arrays(arm.name)[name], array)
            np.testing.assert_array_equal(first.arrays(arm.name)[name], array[:2])
    made = resumed.provenance.merge(first.provenance, on=["arm", "seed"])
    assert (made["date_x"] == made["date_y"]).all()  # read, not made again
    assert len(made) == 4
    weights = {
        name.removeprefix("policy."): array[0]
        for name, array in resumed.arrays("module").items()
        if name.startswith("policy.")
    }
    module = modules.make_module(Module("toy_networks:make"), 1, 2, np.random.default_rng(0))
    modules.load_arrays(module, weights)
    assert torch.equal(module.body.weight, torch.from_numpy(weights["body.weight"]))


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"gamma": 1.5}, ValueError, "gamma must be a number from 0 to 1, got 1.5"),
        ({"policy": (8,)}, TypeError, r"policy must be MLP\(\.\.\.\) or Module.*, got \(8,\)"),
        ({"value": None}, TypeError, r"value must be MLP\(\.\.\.\) or Module.*, got None"),
        ({"value_rate": 0}, ValueError, "value_rate must be a finite number above 0, got 0"),
        ({"max_episode_steps": 0}, ValueError, "max_episode_steps must be an integer from 1 or No"),
    ],
)
def test_a_setting_out_of_range_is_refused(changes, kind, message):
    with pytest.raises(kind, match=f"^{message}"):
        ActorCriticConfig(**changes)


def test_it_is_asked_before_anything_runs(tmp_path):
    for env, config, message in [
        ("Pendulum-v1", CONFIG, "env must be an environment with discrete actions"),
        (
            CORRIDOR,
            ActorCriticConfig(value=Module("toy_networks:one_too_many")),
            "network must put",
        ),
    ]:
        arm = Arm("odd", actor_critic, env, config, 2)
        with pytest.raises(ValueError, match=f"^arm 'odd': {message}"):
            run([arm], seeds=[0], store=tmp_path, progress=False)
