"""Evaluation: the same starts for everyone, greedy policies, and Gymnasium's own episodes."""

import gymnasium
import numpy as np
import pytest

from rl_core.evaluation import (
    Agent,
    as_learned,
    evaluate,
    evaluate_table,
    evaluation_streams,
    greedy,
    of_values,
    uniform,
)
from rl_core.policies import Gaussian, Policy
from rl_core.reinforce import ReinforceConfig
from rl_core.tabular import spawn_streams
from rl_core.worlds.discretise import Discretised, binned

PUMP = {"layer0.weight": np.array([[1e-7, 0, -1e-7], [-1, 0, 1]], np.float32)}
"""Push the way the car moves, and to the right from rest: Q(s, a) = (a - 1) (v - 1e-7 x)."""


def test_a_known_policy_gets_the_car_up_the_hill():
    table = evaluate("MountainCar-v0", of_values(PUMP), seed=0, episodes=20, max_steps=10_000)
    assert table["terminated"].all()
    assert table["steps"].between(83, 200).all()
    np.testing.assert_array_equal(table["return"], -table["steps"])


def test_gymnasium_plays_the_same_greedy_episodes():
    table = evaluate("MountainCar-v0", of_values(PUMP), seed=5, episodes=3, max_steps=10_000)
    env = gymnasium.make("MountainCar-v0", disable_env_checker=True, max_episode_steps=-1)
    seed, _ = evaluation_streams(5)
    steps = []
    for episode in range(3):
        observation, _ = env.reset(seed=seed if episode == 0 else None)
        steps.append(0)
        terminated = False
        while not terminated:
            observation, _, terminated, _, _ = env.step(
                2 if observation[1] > 1e-7 * observation[0] else 0
            )
            steps[-1] += 1
    np.testing.assert_array_equal(table["steps"], steps)


def test_starts_are_the_same_for_every_agent():
    def start(observations, actions, rewards):
        return float(observations[0, 0])

    agents = [uniform(2, 3), of_values(PUMP)]
    starts = [
        evaluate(
            "MountainCar-v0", agent, seed=1, episodes=5, max_steps=50, measures={"start": start}
        )["start"].tolist()
        for agent in agents
    ]
    assert starts[0] == starts[1]
    assert len(set(starts[0])) == 5
    other = evaluate(
        "MountainCar-v0", agents[0], seed=2, episodes=5, max_steps=50, measures={"start": start}
    )
    assert other["start"].tolist() != starts[0]


def test_a_table_is_evaluated_from_the_starts_of_the_networks():
    """A grid that tells left from right in velocity only holds the same policy as the network."""
    world = binned("MountainCar-v0", (1, 2))
    Q = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    found = evaluate_table(world, Q, seed=3, episodes=10, max_steps=10_000)
    network = evaluate("MountainCar-v0", of_values(PUMP), seed=3, episodes=10, max_steps=10_000)
    assert found["terminated"].all()
    np.testing.assert_array_equal(found["steps"], network["steps"])
    env = Discretised("MountainCar-v0", (1, 2))
    seed, _ = evaluation_streams(3)
    observation, _ = env.reset(seed=seed)
    steps, terminated = 0, False
    while not terminated:
        observation, _, terminated, _, _ = env.step(int(Q[observation].argmax()))
        steps += 1
    assert found["steps"].iloc[0] == steps


def test_evaluation_draws_from_streams_that_no_learner_uses():
    own = [
        np.random.default_rng(evaluation_streams(7)[0]).random(),
        evaluation_streams(7)[1].random(),
    ]
    learners = [stream.random() for streams in spawn_streams(7, 2) for stream in streams]
    assert not set(own) & set(learners)


def test_same_seed_same_bits_and_a_cap():
    tables = [
        evaluate("Acrobot-v1", uniform(6, 3), seed=seed, episodes=4, max_steps=150)
        for seed in (0, 0, 1)
    ]
    assert tables[0].equals(tables[1])
    long = [
        evaluate("Acrobot-v1", uniform(6, 3), seed=s, episodes=4, max_steps=9999) for s in (0, 1)
    ]
    assert long[0]["steps"].tolist() != long[1]["steps"].tolist()
    assert (tables[0].loc[~tables[0]["terminated"], "steps"] == 150).all()


def test_greedy_is_the_mode_of_the_policy():
    policy = Policy(np.array([2, 3]), False, False, False, 1)
    rng = np.random.default_rng(0)
    agent = Agent(policy, rng.normal(size=9).astype(np.float32))

    def modes(observations, actions, rewards):
        scores = observations[:-1] @ agent.parameters[:6].reshape(2, 3) + agent.parameters[6:]
        return float((scores.argmax(axis=1) == actions[:, 0]).mean())

    shares = [
        evaluate("MountainCar-v0", one, seed=0, episodes=1, max_steps=200, measures={"m": modes})
        for one in (greedy(agent), agent)
    ]
    assert shares[0]["m"].item() == 1
    assert shares[1]["m"].item() < 0.9


def test_greedy_gaussian_acts_by_its_mean():
    config = ReinforceConfig(hidden=(), policy=Gaussian(mean="direct"))
    weights = {"layer0.weight": np.array([[0], [20]], np.float32), "log_sigma": np.zeros(1)}
    agent = as_learned(config, {k: v.astype(np.float32) for k, v in weights.items()})

    def off(observations, actions, rewards):
        return float(np.abs(actions[:, 0] - 20 * observations[:-1, 1]).max())

    arguments = {"seed": 0, "episodes": 1, "max_steps": 100, "measures": {"off": off}}
    name = "MountainCarContinuous-v0"
    assert evaluate(name, greedy(agent), **arguments)["off"].item() < 1e-6
    assert evaluate(name, agent, **arguments)["off"].item() > 1


def test_any_other_environment():
    weights = np.zeros((4, 2), np.float32)
    weights[2:, 1] = 1  # push the way the pole falls
    table = evaluate(
        "CartPole-v1", of_values({"layer0.weight": weights}), seed=0, episodes=3, max_steps=9_999
    )
    assert (table["return"] > 100).all()


def test_under_a_limit_the_same_episodes_are_cut():
    world = binned("MountainCarContinuous-v0", (1, 2), levels=3)
    Q = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    network = {"layer0.weight": np.array([[0], [50]]), "log_sigma": np.array([-3])}
    agent = as_learned(
        ReinforceConfig(hidden=(), policy=Gaussian(mean="direct")),
        {name: array.astype(np.float32) for name, array in network.items()},
    )
    for play in (
        lambda **cut: evaluate_table(world, Q, seed=0, episodes=30, **cut),
        lambda **cut: evaluate("MountainCarContinuous-v0", agent, seed=0, episodes=30, **cut),
    ):
        long = play(max_steps=10_000, limit=106)
        assert long["terminated"].all()
        within = long["steps"] <= 106
        assert 0 < within.sum() < 30
        np.testing.assert_array_equal(long["limited_terminated"], within)
        np.testing.assert_array_equal(long["limited_steps"], np.minimum(long["steps"], 106))
        np.testing.assert_array_equal(long["limited_return"][within], long["return"][within])
        assert (long["limited_return"][~within] < 0).all()
        first = play(max_steps=106).iloc[0]
        assert first["steps"] == long["limited_steps"].iloc[0]
        assert first["return"] == pytest.approx(long["limited_return"].iloc[0], abs=1e-12)


def test_bad_arguments():
    agent = uniform(2, 3)
    for bad in ({"seed": -1}, {"episodes": 0}, {"max_steps": 0.5}, {"limit": 6}):
        arguments = {"seed": 0, "episodes": 1, "max_steps": 5} | bad
        with pytest.raises(ValueError, match=next(iter(bad))):
            evaluate("MountainCar-v0", agent, **arguments)
        world = binned("MountainCar-v0", 5)
        with pytest.raises(ValueError, match=next(iter(bad))):
            evaluate_table(world, np.zeros(world.shape), **arguments)
    with pytest.raises(ValueError, match="agent must be a network of 6 inputs"):
        evaluate("Acrobot-v1", agent, seed=0, episodes=1, max_steps=5)
    with pytest.raises(ValueError, match="agent must be an Agent, got None"):
        evaluate("Acrobot-v1", None, seed=0, episodes=1, max_steps=5)


GAUSSIAN = as_learned(
    ReinforceConfig(hidden=(), policy=Gaussian(mean="direct")),
    {"layer0.weight": np.zeros((2, 1), np.float32), "log_sigma": np.zeros(1, np.float32)},
)


@pytest.mark.parametrize(
    ("env", "agent", "message"),
    [
        ("MountainCar-v0", uniform(2, 5), "a categorical policy of 3 actions, got .* of 5"),
        ("MountainCar-v0", GAUSSIAN, "of 3 actions, got a Gaussian policy of 1"),
        ("MountainCarContinuous-v0", uniform(2, 3), "a Gaussian policy of 1 components, got a cat"),
        ("CartPole-v1", uniform(4, 3), "of 2 actions, got a categorical policy of 3"),
        ("MountainCar-v0", uniform(2, 3)._replace(parameters=np.zeros(8, np.float32)), r"\(9,\)"),
    ],
)
def test_an_agent_that_does_not_fit_its_environment_is_refused(env, agent, message):
    with pytest.raises(ValueError, match=f"^agent must be .*{message}"):
        evaluate(env, agent, seed=0, episodes=1, max_steps=5)


@pytest.mark.parametrize(
    ("Q", "message"),
    [
        (np.zeros((24, 3)), r"of shape \(25, 3\), got \(24, 3\)"),
        ([[0.0] * 3] * 25, "an array of numbers"),
        (np.full((25, 3), "a"), "an array of numbers"),
        (np.where(np.arange(75) == 7, np.nan, 0).reshape(25, 3), "without NaN, got '1 of them'"),
    ],
)
def test_a_table_of_something_else_is_refused(Q, message):
    world = binned("MountainCar-v0", 5)
    with pytest.raises(ValueError, match=f"^Q must be {message}"):
        evaluate_table(world, Q, seed=0, episodes=1, max_steps=5)


@pytest.mark.parametrize("measures", [{"steps": max}, {"limited_return": max}, {"a": 3}, [max]])
def test_measures_do_not_take_the_place_of_a_column(measures):
    with pytest.raises(ValueError, match=r"^measures must be "):
        evaluate(
            "MountainCar-v0", uniform(2, 3), seed=0, episodes=1, max_steps=5, measures=measures
        )
