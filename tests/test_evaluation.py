"""Evaluation: the same starts for everyone, greedy policies, and Gymnasium's own episodes."""

from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np
import pytest

from rl_core.evaluation import (
    Agent,
    as_learned,
    evaluate,
    evaluation_streams,
    greedy,
    rollout,
    spaces_of,
    uniform,
)
from rl_core.kernels import networks
from rl_core.kernels.likelihood import Policy, make_actor
from rl_core.policies import MLP, Gaussian, Module
from rl_core.q_learning import QLearningConfig
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.training import spawn_streams, weights_of
from rl_core.worlds.discretise import Discretised, gridded
from studies.policy_maps import action_values, mean_actions
from studies.shared import of_table, of_values

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
    world = gridded("MountainCar-v0", (1, 2))
    Q = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    table = of_table(world, Q)
    found = evaluate("MountainCar-v0", table, seed=3, episodes=10, max_steps=10_000)
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
    learners = [stream.random() for stream in spawn_streams(7)[1:]]
    learners.append(np.random.default_rng(spawn_streams(7).environment_seed).random())
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
    agent = Agent(make_actor(policy, rng.normal(size=9).astype(np.float32)))

    def modes(observations, actions, rewards):
        parameters = agent.actor.parameters
        scores = observations[:-1] @ parameters[:6].reshape(2, 3) + parameters[6:]
        return float((scores.argmax(axis=1) == actions[:, 0]).mean())

    shares = [
        evaluate("MountainCar-v0", one, seed=0, episodes=1, max_steps=200, measures={"m": modes})
        for one in (greedy(agent), agent)
    ]
    assert shares[0]["m"].item() == 1
    assert shares[1]["m"].item() < 0.9


def test_greedy_gaussian_acts_by_its_mean():
    config = ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct"))
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


def test_bad_arguments():
    agent = uniform(2, 3)
    for bad in ({"seed": -1}, {"episodes": 0}, {"max_steps": 0.5}):
        arguments = {"seed": 0, "episodes": 1, "max_steps": 5} | bad
        with pytest.raises((TypeError, ValueError), match=f"^{next(iter(bad))} must be .*, got "):
            evaluate("MountainCar-v0", agent, **arguments)
    with pytest.raises(ValueError, match="agent must be a network of 6 inputs"):
        evaluate("Acrobot-v1", agent, seed=0, episodes=1, max_steps=5)
    with pytest.raises(TypeError, match=r"^agent must be an Agent, got None"):
        evaluate("Acrobot-v1", None, seed=0, episodes=1, max_steps=5)


GAUSSIAN = as_learned(
    ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct")),
    {"layer0.weight": np.zeros((2, 1), np.float32), "log_sigma": np.zeros(1, np.float32)},
)
SHORT = Agent(uniform(2, 3).actor._replace(parameters=np.zeros(8, np.float32)))
TABLE = of_table(gridded("MountainCar-v0", 2), np.zeros((4, 3)))
SEES_THREE = Policy(np.array([3, 3]), False, False, False, 2)


@pytest.mark.parametrize(
    ("env", "agent", "message"),
    [
        ("MountainCar-v0", uniform(2, 5), "a categorical policy of 3 actions, got .* of 5"),
        ("MountainCar-v0", GAUSSIAN, "of 3 actions, got a Gaussian policy of 1"),
        ("MountainCarContinuous-v0", uniform(2, 3), "a Gaussian policy of 1 components, got a cat"),
        ("CartPole-v1", uniform(4, 3), "of 2 actions, got a categorical policy of 3"),
        ("MountainCar-v0", SHORT, r"\(9,\)"),
        ("CartPole-v1", TABLE, "a table over 4 inputs"),
        (
            "Pendulum-v1",
            Agent(TABLE.actor._replace(policy=SEES_THREE)),
            "a Gaussian policy of 1 co",
        ),
    ],
)
def test_an_agent_that_does_not_fit_its_environment_is_refused(env, agent, message):
    with pytest.raises(ValueError, match=f"^agent must be .*{message}"):
        evaluate(env, agent, seed=0, episodes=1, max_steps=5)


@pytest.mark.parametrize(
    ("Q", "message"),
    [
        (np.zeros((24, 3)), r"an array of numbers of shape \(25, 3\), got \(24, 3\)"),
        ([[0.0] * 3, [0.0]], r"an array of numbers of shape \(25, 3\), got "),
        (np.full((25, 3), "a"), r"an array of numbers of shape \(25, 3\), got "),
        (np.where(np.arange(75) == 7, np.nan, 0).reshape(25, 3), r"without NaN, at \(2, 1\) it is"),
    ],
)
def test_a_table_of_something_else_is_refused(Q, message):
    config, where = QLearningConfig(bins=5), spaces_of("MountainCar-v0")
    with pytest.raises((TypeError, ValueError), match=f"^Q must be {message}"):
        as_learned(config, {"Q": Q}, spaces=where)


@pytest.mark.parametrize("measures", [{"steps": max}, {"return": max}, {"a": 3}, [max]])
def test_measures_do_not_take_the_place_of_a_column(measures):
    with pytest.raises(ValueError, match=r"^measures must be .*, got "):
        evaluate(
            "MountainCar-v0", uniform(2, 3), seed=0, episodes=1, max_steps=5, measures=measures
        )


# Agents of trained weights


CONTINUOUS = ReinforceConfig(
    network=MLP(biases=False),
    policy=Gaussian(sigma=0.5, constant_feature=True),
    max_episode_steps=300,
)


@pytest.fixture(scope="module")
def acrobot():
    config = ReinforceConfig(max_episode_steps=5000)
    return config, reinforce("Acrobot-v1", config, episodes=300, seeds=[0], snapshots=(100,))


def test_trained_weights_do_better_than_the_first(acrobot):
    config, run = acrobot
    median = {}
    for moment in ("initial/", "episode100/", ""):
        agent = as_learned(config, weights_of(run.arrays, 0, moment))
        played = evaluate("Acrobot-v1", agent, seed=0, episodes=15, max_steps=3000)
        median[moment] = played["steps"].median()
    assert median[""] < median["initial/"] / 2
    assert len(set(median.values())) == 3


@pytest.mark.parametrize("epsilon", [0.0, 0.3])
def test_compiled_and_plain_episodes_of_a_q_network_are_the_same(epsilon):
    name = "MountainCar-v0"
    drawn = networks.xavier_uniform((2, 10, 3), np.random.default_rng(0))
    agent = of_values(networks.unpack((2, 10, 3), drawn), epsilon)
    seen = [
        evaluate(env, agent, seed=1, episodes=3, max_steps=400)
        for env in (name, lambda: gymnasium.make(name, disable_env_checker=True).unwrapped)
    ]
    assert seen[0].equals(seen[1])


def test_an_epsilon_greedy_agent_explores_that_share():
    agent = of_values(PUMP, 0.3)

    def explored(observations, actions, rewards):
        best = action_values(PUMP, observations[:-1]).argmax(axis=1)
        return float((best != actions[:, 0]).sum())

    table = evaluate(
        "MountainCar-v0", agent, seed=0, episodes=40, max_steps=999, measures={"n": explored}
    )
    n = table["steps"].sum()
    assert table["n"].sum() / n == pytest.approx(0.2, abs=4 * np.sqrt(0.16 / n))
    for epsilon in (1.5, np.nan, -0.1):
        with pytest.raises(ValueError, match=r"^epsilon must be a number from 0 to 1, got "):
            of_values(PUMP, epsilon)


def test_an_agent_of_a_module_needs_to_know_the_spaces():
    config = ReinforceConfig(network=Module("toy_networks:make"))
    with pytest.raises(ValueError, match=r"^spaces must be given for ReinforceConfig.*, got None"):
        as_learned(config, {"body.weight": np.zeros((8, 2))})


def test_weights_that_do_not_go_with_the_configuration_are_refused():
    with pytest.raises(TypeError, match=r"^config must be a configuration of .*, got None"):
        as_learned(None, PUMP)
    with pytest.raises(TypeError, match=r"^weights must be a mapping of names to arrays, got None"):
        as_learned(CONTINUOUS, None)
    with pytest.raises(ValueError, match=r"^weights must be with 'log_sigma', .*, got \['layer0"):
        as_learned(CONTINUOUS, PUMP)
    with pytest.raises(ValueError, match=r"^weights must hold 'layer0\.weight'"):
        as_learned(ReinforceConfig(), {})


# Whole episodes


@pytest.mark.parametrize("name", ["Acrobot-v1", "MountainCarContinuous-v0"])
def test_gymnasium_plays_a_rollout_again(name):
    config = CONTINUOUS if "Continuous" in name else ReinforceConfig(max_episode_steps=50)
    run = reinforce(name, config, episodes=1, seeds=[0])
    agent = as_learned(config, weights_of(run.arrays, 0))
    played = rollout(name, agent, np.random.default_rng(0), 150)
    env = gymnasium.make(name, disable_env_checker=True).unwrapped
    observation, _ = env.reset(seed=played.environment_seed)
    np.testing.assert_array_equal(observation, played.observations[0])
    for t, action in enumerate(played.actions):
        native = int(action[0]) if name == "Acrobot-v1" else action
        observation, reward, terminated, _, _ = env.step(native)
        np.testing.assert_array_equal(observation, played.observations[t + 1])
        assert reward == played.rewards[t]
    assert terminated == played.terminated
    assert len(played.observations) == len(played.actions) + 1


def test_rollouts_are_a_function_of_the_generator():
    first, again, other = (
        rollout("Acrobot-v1", uniform(6, 3), np.random.default_rng(seed), 200) for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first.observations, again.observations)
    assert first.environment_seed != other.environment_seed
    assert not np.array_equal(first.observations[0], other.observations[0])


def test_rollouts_scatter_around_the_mean_action():
    run = reinforce("MountainCarContinuous-v0", CONTINUOUS, episodes=1, seeds=[3])
    weights = weights_of(run.arrays, 0)
    agent = as_learned(CONTINUOUS, weights)
    played = rollout("MountainCarContinuous-v0", agent, np.random.default_rng(0), 3000)
    means = mean_actions(CONTINUOUS, weights, played.observations[:-1])
    noise = (played.actions - means) / 0.5
    assert abs(noise.mean()) < 4 / np.sqrt(len(noise))
    assert noise.std() == pytest.approx(1, abs=4 / np.sqrt(2 * len(noise)))


def test_a_rollout_refuses_what_does_not_fit():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match=r"^agent must be a network of 6 inputs, got \[2, 3\]"):
        rollout("Acrobot-v1", uniform(2, 3), rng, 10)
    with pytest.raises(TypeError, match=r"^rng must be a numpy\.random\.Generator, got None"):
        rollout("MountainCar-v0", uniform(2, 3), None, 10)
    with pytest.raises(TypeError, match=r"^agent must be an Agent, got "):
        rollout("MountainCar-v0", PUMP, rng, 10)
    with pytest.raises(ValueError, match=r"^max_steps must be an integer from 1, got 0"):
        rollout("MountainCar-v0", uniform(2, 3), rng, 0)


def test_threads_may_play_with_one_agent_at_once():
    """Compiled episodes do not hold the interpreter's lock: what they scribble on is their own."""
    weights = {"layer0.weight": np.zeros((2, 1), np.float32), "log_sigma": np.zeros(1, np.float32)}
    config = ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct", sigma=1.0))
    agent = as_learned(config, weights)

    def play(seed: int) -> float:
        one = rollout("MountainCarContinuous-v0", agent, np.random.default_rng(seed), 20_000)
        return float(one.rewards.sum())

    alone = [play(seed) for seed in range(40)]
    with ThreadPoolExecutor(4) as threads:
        assert [*threads.map(play, range(40))] == alone
