"""An agent that one can hold: it acts on one observation or many, is saved, loaded and filmed."""

import io
import subprocess
import sys
import zipfile

import gymnasium
import numpy as np
import pytest

from rl_core.dqn import DQNConfig, dqn
from rl_core.evaluation import evaluate, greedy, load, rollout, uniform
from rl_core.exploration import EpsilonGreedy, Linear, Trials
from rl_core.policies import Gaussian, Module
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.training import Run
from rl_core.worlds.names import Make

NET = Module("toy_networks:make")
CUT = {"max_episode_steps": 40}
DEEP = {"batch_size": 8, "memory_size": 50, "learning_starts": 20, **CUT}
GRID = {"bins": 6, "max_steps": 40, "exploration": EpsilonGreedy(0.3)}
KINDS = {
    "REINFORCE": (reinforce, "CartPole-v1", ReinforceConfig(**CUT)),
    "REINFORCE, a module": (reinforce, "CartPole-v1", ReinforceConfig(network=NET, **CUT)),
    "Gaussian": (
        reinforce,
        "MountainCarContinuous-v0",
        ReinforceConfig(policy=Gaussian(constant_feature=True), **CUT),
    ),
    "Gaussian, a module": (
        reinforce,
        "Pendulum-v1",
        ReinforceConfig(network=NET, policy=Gaussian(mean="direct"), **CUT),
    ),
    "DQN": (dqn, "CartPole-v1", DQNConfig(epsilon=Linear(1.0, 0.25, steps=9), **DEEP)),
    "DQN, a module": (dqn, "CartPole-v1", DQNConfig(network=NET, epsilon=0.25, **DEEP)),
    "table": (q_learning, "FrozenLake-v1", QLearningConfig()),
    "table, arguments": (
        q_learning,
        Make("FrozenLake-v1", {"is_slippery": False}),
        QLearningConfig(),
    ),
    "grid": (q_learning, "MountainCar-v0", QLearningConfig(**GRID)),
    "grid of actions": (q_learning, "MountainCarContinuous-v0", QLearningConfig(levels=3, **GRID)),
}


@pytest.fixture(scope="module", params=KINDS)
def trained(request):
    algorithm, env, config = KINDS[request.param]
    return algorithm(env, config, episodes=3, seeds=[5, 3])


def observations(run, n):
    """What comes in the first n steps of an episode."""
    env = gymnasium.make(run.env) if isinstance(run.env, str) else gymnasium.make("FrozenLake-v1")
    env.action_space.seed(0)
    seen = [env.reset(seed=0)[0]]
    while len(seen) < n:
        observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
        seen.append(env.reset()[0] if terminated or truncated else observation)
    return np.array(seen), env.action_space


def test_one_observation_or_a_batch(trained):
    seen, actions = observations(trained, 20)
    agent = trained.agent(3)
    batch, state = agent.predict(seen, state="kept", episode_start=np.ones(20), deterministic=True)
    assert state == "kept"
    assert len(batch) == 20
    for observation, action in zip(seen, batch, strict=True):
        one, _ = agent.predict(observation, deterministic=True)
        if "Q" not in agent.weights:  # of equal values in a table, one is drawn
            np.testing.assert_array_equal(one, action)
        if isinstance(actions, gymnasium.spaces.Discrete):
            assert one in actions
        else:
            assert (one.shape, one.dtype) == (actions.shape, actions.dtype)


def test_it_comes_back_from_a_file(trained, tmp_path):
    agent, seen = trained.agent(5, rng=np.random.default_rng(7)), observations(trained, 30)[0]
    agent.save(tmp_path / "agent.npz")
    back = load(tmp_path / "agent.npz", np.random.default_rng(7))
    assert back.config == agent.config
    assert back.env == trained.env
    assert back.spaces == agent.spaces
    for deterministic in (False, True):
        found, told = (one.predict(seen, deterministic=deterministic)[0] for one in (agent, back))
        np.testing.assert_array_equal(found, told)
    rules = {"seed": 1, "episodes": 2, "max_steps": 30}
    assert evaluate(trained.env, back, **rules).equals(evaluate(trained.env, agent, **rules))


def test_one_evaluation_and_one_rollout_for_all(trained):
    agent = trained.agent(3)
    table = evaluate(trained.env, agent, seed=0, episodes=3, max_steps=25)
    assert table["steps"].between(1, 25).all()
    played = rollout(trained.env, greedy(agent), np.random.default_rng(0), 25)
    assert len(played.observations) == len(played.actions) + 1 == len(played.rewards) + 1
    if "Q" not in agent.weights:
        told, _ = agent.predict(played.observations[:-1], deterministic=True)
        np.testing.assert_array_equal(told.ravel(), played.actions.ravel())


def test_the_seed_is_that_which_was_asked_for():
    run = dqn("CartPole-v1", KINDS["DQN"][2], episodes=2, seeds=[9, 4])
    for position, seed in enumerate([9, 4]):
        agent = run.agent(seed)
        np.testing.assert_array_equal(
            agent.weights["layer0.weight"], run.arrays["layer0.weight"][position]
        )
    first = run.agent(4, "initial/").weights["layer0.weight"]
    np.testing.assert_array_equal(first, run.arrays["initial/layer0.weight"][1])
    with pytest.raises(ValueError, match=r"^seed must be one of \[9, 4\], got 0"):
        run.agent(0)


def test_noise_is_that_of_the_end_of_training():
    """A random action with the last epsilon, and half of the random actions of two are others."""
    seen = np.zeros((4000, 4), np.float32)
    for kind, share in (("DQN", 0.125), ("DQN, a module", 0.125)):
        algorithm, env, config = KINDS[kind]
        agent = algorithm(env, config, episodes=1, seeds=[0]).agent(0)
        best = agent.predict(seen + 1, deterministic=True)[0]
        assert (agent.predict(seen + 1)[0] != best).mean() == pytest.approx(share, abs=0.02)
    config = QLearningConfig(evaluation=Trials(epsilon=0.4))
    agent = q_learning("FrozenLake-v1", config, episodes=300, seeds=[0]).agent(0)
    state = int(np.flatnonzero(agent.weights["Q"].max(1))[0])
    best = agent.predict(np.full(4000, state), deterministic=True)[0]
    assert (agent.predict(np.full(4000, state))[0] != best).mean() == pytest.approx(0.3, abs=0.03)


def test_the_generator_decides():
    run = reinforce("CartPole-v1", KINDS["REINFORCE"][2], episodes=1, seeds=[0])
    seen = np.zeros((50, 4))
    drawn = [run.agent(0, rng=np.random.default_rng(s)).predict(seen)[0] for s in (1, 1, 2)]
    np.testing.assert_array_equal(drawn[0], drawn[1])
    assert (drawn[0] != drawn[2]).any()


def test_a_gridded_task_keeps_its_time_limit():
    config = QLearningConfig(bins=5, exploration=EpsilonGreedy(1.0))
    run = q_learning("toy_task:Corridor", config, episodes=2, seeds=[0])
    Q = np.zeros_like(run.arrays["Q"][0])
    Q[:, 0] = 1.0  # go back for ever
    stuck = Run(run.table, {"Q": Q[None]}, env=run.env, config=config).agent(0)
    table = evaluate("toy_task:Corridor", greedy(stuck), seed=0, episodes=2, max_steps=1_000)
    assert table["steps"].tolist() == [100, 100]


def as_array(array):
    """A file of numpy's that holds one array."""
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


@pytest.mark.parametrize(
    ("write", "reason"),
    [
        (lambda path, whole: path.write_bytes(b""), ""),
        (lambda path, whole: path.write_bytes(b"no archive at all"), ""),
        (lambda path, whole: path.write_bytes(whole[: len(whole) // 2]), ""),
        (lambda path, whole: path.write_bytes(whole[:400] + b"\0\1\2" + whole[403:]), ""),
        (lambda path, whole: path.write_bytes(as_array(np.zeros(3))), ""),
        (lambda path, whole: np.savez(path, x=np.zeros(3)), "about"),
        (lambda path, whole: np.savez(path, about=np.array("{}")), "format"),
        (lambda path, whole: np.savez(path, about=np.array([{}], dtype=object)), "pickle"),
    ],
)
def test_a_file_that_is_damaged_or_another_is_named(tmp_path, write, reason):
    path = tmp_path / "agent.npz"
    reinforce("CartPole-v1", ReinforceConfig(**CUT), episodes=1, seeds=[0]).agent(0).save(path)
    write(path, path.read_bytes())
    with pytest.raises(ValueError, match=rf"^path must be a file that .*agent\.npz'.*{reason}"):
        load(path)


def test_a_file_holds_no_pickle_and_is_read_in_a_new_process(tmp_path):
    path = tmp_path / "agent.npz"
    run = reinforce("CartPole-v1", ReinforceConfig(**CUT), episodes=1, seeds=[0])
    run.agent(0).save(path)
    with zipfile.ZipFile(path) as archive:
        assert not any(b"pickle" in archive.read(name) for name in archive.namelist())
    program = f"""
from rl_core.evaluation import load
print(load({str(path)!r}).predict([0.0, 0.0, 0.1, 0.0], deterministic=True)[0])
"""
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert int(told.stdout) == run.agent(0).predict([0.0, 0.0, 0.1, 0.0], deterministic=True)[0]
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "none.npz")


def test_what_cannot_be_held_is_refused():
    with pytest.raises(ValueError, match=r"^agent must be one of a run, to be saved, got Agent"):
        uniform(2, 3).save("nowhere.npz")
    with pytest.raises(ValueError, match=r"^observation must be numbers of shape \(2,\), "):
        uniform(2, 3).predict(np.zeros(3))
    run = reinforce("CartPole-v1", ReinforceConfig(**CUT), episodes=1, seeds=[0])
    bare = Run(run.table, run.arrays)
    with pytest.raises(TypeError, match=r"^config must be a configuration of .*, got None"):
        bare.agent(0)


class Walk(gymnasium.Env):
    """Observes the byte that it was told, two by two of it; drawn as a picture of two colours."""

    observation_space = gymnasium.spaces.Box(0, 255, (2, 2), np.uint8)
    action_space = gymnasium.spaces.Discrete(2, start=3)
    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012

    def __init__(self, render_mode=None):
        self.render_mode, self.steps = render_mode, 0

    def reset(self, *, seed=None, options=None):
        """Begin."""
        super().reset(seed=seed)
        self.steps = 0
        return np.full((2, 2), 51, np.uint8), {}

    def step(self, action):
        """End after five."""
        assert action in self.action_space
        self.steps += 1
        return np.full((2, 2), 255, np.uint8), 1.0, self.steps == 5, False, {}

    def render(self):
        """One colour."""
        return np.full((33, 48, 3), 40 * self.steps, np.uint8)


def test_bytes_are_scaled_alike_in_training_and_use():
    run = reinforce("test_agent:Walk", ReinforceConfig(), episodes=2, seeds=[0])
    agent = run.agent(0)
    played = rollout(Walk, agent, np.random.default_rng(0), 10)
    np.testing.assert_allclose(played.observations[:2], [[0.2] * 4, [1.0] * 4], rtol=1e-6)
    action, _ = agent.predict(np.full((7, 2, 2), 51, np.uint8))
    assert set(action) <= {3, 4}


@pytest.mark.parametrize("env", ["test_agent:Walk", lambda: Walk("rgb_array"), "CartPole-v1"])
def test_a_film(env, tmp_path):
    path = (
        reinforce(env, ReinforceConfig(**CUT), episodes=1, seeds=[0])
        .agent(0)
        .film(tmp_path / "film.mp4", seed=1, max_steps=8)
    )
    assert path.read_bytes()[4:8] == b"ftyp"


def test_a_film_of_what_has_no_picture_is_refused(tmp_path):
    for env in ("toy_task:Corridor", lambda: Walk()):
        run = reinforce(env, ReinforceConfig(**CUT), episodes=1, seeds=[0])
        with pytest.raises(ValueError, match=r"^env must be an environment .*rgb_array"):
            run.agent(0).film(tmp_path / "film.mp4")


def as_stable_baselines_calls(model, env, episodes):
    """The calls of `stable_baselines3.common.evaluation.evaluate_policy`, 2.9.2."""
    n, returns, total = env.num_envs, [], np.zeros(env.num_envs)
    seen, states, starts = env.reset()[0], None, np.ones(env.num_envs, bool)
    while len(returns) < episodes:
        actions, states = model.predict(
            seen, state=states, episode_start=starts, deterministic=True
        )
        seen, rewards, terminated, truncated, _ = env.step(actions)
        total, starts = total + rewards, terminated | truncated
        for i in range(n):
            if starts[i]:
                returns.append(total[i])
                total[i] = 0.0
    return np.mean(returns)


@pytest.mark.parametrize("kind", ["REINFORCE", "DQN, a module", "Gaussian, a module", "table"])
def test_vectorised_environments_as_stable_baselines_calls_them(kind):
    algorithm, env, config = KINDS[kind]
    agent = algorithm(env, config, episodes=1, seeds=[0]).agent(0)
    vector = gymnasium.make_vec(env, num_envs=3, vectorization_mode="sync")
    assert np.isfinite(as_stable_baselines_calls(agent, vector, 4))


@pytest.mark.parametrize("kind", ["REINFORCE", "DQN", "Gaussian, a module", "table"])
def test_stable_baselines_evaluates_it(kind):
    evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
    env_util = pytest.importorskip("stable_baselines3.common.env_util")
    algorithm, env, config = KINDS[kind]
    agent = algorithm(env, config, episodes=1, seeds=[0]).agent(0)
    vector = env_util.make_vec_env(env, n_envs=2, seed=0)
    mean, _ = evaluation.evaluate_policy(agent, vector, n_eval_episodes=3)
    assert np.isfinite(mean)
