"""Any environment opened and stepped through; what it returns is checked before it is used."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from toy_task import Corridor

from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.worlds import environments
from rl_core.worlds.environments import (
    GymnasiumWorld,
    TaskWorld,
    checked_reward,
    one_seed_of,
    open_world,
    step,
)
from rl_core.worlds.names import Make
from rl_core.worlds.twins import TASKS

ENDLESS = {"Acrobot-v1", "MountainCar-v0", "MountainCarContinuous-v0"}


class Recorder(gymnasium.Env):
    """Two-dimensional observations, any action space; remembers what it was told."""

    def __init__(self, action_space):
        self.observation_space = spaces.Box(-1, 1, (2, 3), np.float64)
        self.action_space = action_space
        self.seeds, self.actions, self.closed = [], [], False

    def reset(self, *, seed=None, options=None):
        """Draw the start."""
        super().reset(seed=seed)
        self.seeds.append(seed)
        return self.np_random.uniform(-1, 1, (2, 3)), {}

    def step(self, action):
        """Remember the action."""
        self.actions.append(action)
        return np.full((2, 3), len(self.actions) / 10), 1.0, False, False, {}

    def close(self):
        """Remember it."""
        self.closed = True


class Odd(gymnasium.Env):
    """Returns what it was told to, at its second step or at its reset."""

    observation_space = spaces.Box(-1, 1, (2,), np.float64)
    action_space = spaces.Discrete(2)

    def __init__(self, observation=None, reward=0.0, at=2):
        self.observation, self.reward, self.at = observation, reward, at

    def reset(self, *, seed=None, options=None):
        """Begin."""
        self.t = 0
        return self.seen(), {}

    def seen(self):
        """What is told of the state."""
        odd = self.t == self.at and self.observation is not None
        return self.observation if odd else np.zeros(2)

    def step(self, action):
        """Count."""
        self.t += 1
        reward = self.reward if self.t == self.at else 0.0
        return self.seen(), reward, False, False, {}


def steps(world, actions):
    following = world.reset()
    for action in actions:
        yield (*step(world.stepper, np.array([action], np.float32), following), following)


# Opening


@pytest.mark.parametrize("name", TASKS)
def test_compiled_steps_are_gymnasiums_bit_for_bit(name):
    compiled = open_world(name)
    plain = open_world(lambda: gymnasium.make(name, disable_env_checker=True).unwrapped)
    assert isinstance(compiled, TaskWorld)
    assert isinstance(plain, GymnasiumWorld)
    rng = np.random.default_rng(0)
    if compiled.n_actions:
        actions = rng.integers(compiled.n_actions, size=300)
    else:
        actions = rng.normal(0, 1.5, 300)
    for seed in (0, 5):
        compiled.seed(seed)
        plain.seed(seed)
        np.testing.assert_array_equal(compiled.reset(), plain.reset())
        for found, expected in zip(steps(compiled, actions), steps(plain, actions), strict=True):
            assert found[:3] == expected[:3]
            np.testing.assert_array_equal(found[3], expected[3])
            if found[1]:
                break


@pytest.mark.parametrize("name", TASKS)
def test_limits_are_those_registered_but_where_the_report_had_none(name):
    limit = gymnasium.spec(name).max_episode_steps
    assert open_world(name).max_episode_steps == (None if name in ENDLESS else limit)


def test_every_way_to_name_an_environment():
    for env in ("toy_task:Corridor", Corridor):
        assert isinstance(open_world(env), TaskWorld)
        assert open_world(env).max_episode_steps == 100
    for env in (
        "test_environments:Odd",
        Odd,
        Odd(),
        lambda: Odd(),
        Make("Pendulum-v1", {"g": 5.0}),
    ):
        assert isinstance(open_world(env), GymnasiumWorld)
    assert open_world(Make("Pendulum-v1", {"g": 5.0}))._environment.unwrapped.g == 5.0


def test_what_was_made_here_is_closed_here():
    given, made = Recorder(spaces.Discrete(2)), Recorder(spaces.Discrete(2))
    open_world(given).close()
    open_world(lambda: made).close()
    assert not given.closed
    assert made.closed


@pytest.mark.parametrize("env", ["Akrobot-v1", "Pole-v7", "a b"])
def test_an_unknown_id_is_refused(env):
    with pytest.raises(ValueError, match=f"^env must be (an id|one) that .*, got {env!r}"):
        open_world(env)


@pytest.mark.parametrize("env", ["nowhere:Foo-v0", "nowhere:make", "toy_task:Street"])
def test_an_import_path_to_nothing_is_refused(env):
    with pytest.raises(ValueError, match=f"^env must .*, got {env!r}"):
        open_world(env)


@pytest.mark.parametrize("env", [3, None, lambda: 3, object()])
def test_what_is_no_environment_is_refused(env):
    with pytest.raises(TypeError, match=r"^env must be a Gymnasium id, an import path, .*, got "):
        open_world(env)


def test_other_spaces_are_refused_and_what_was_made_is_closed():
    with pytest.raises(ValueError, match=r"^env must have a Box observation space, got Discrete"):
        open_world("FrozenLake-v1")
    made = Recorder(spaces.MultiBinary(2))
    with pytest.raises(ValueError, match=r"^env must have a Discrete or a Box .*, got MultiBinary"):
        open_world(lambda: made)
    assert made.closed


# Stepping


def test_only_the_first_reset_is_seeded():
    env = Recorder(spaces.Discrete(2))
    world = open_world(env)
    world.seed(5)
    starts = [world.reset() for _ in range(3)]
    assert env.seeds == [5, None, None]
    assert not np.array_equal(starts[0], starts[1])
    assert starts[0].dtype == np.float32
    assert starts[0].shape == (6,)


def test_discrete_actions_begin_where_the_space_begins():
    env = Recorder(spaces.Discrete(3, start=7))
    list(steps(open_world(env), [0, 1, 2, 0]))
    assert env.actions == [7, 8, 9, 7]
    assert {type(action) for action in env.actions} == {int}


def test_continuous_actions_reach_the_environment_unclipped_in_its_shape_and_type():
    env = Recorder(spaces.Box(-1, 1, (2, 2), np.float64))
    world = open_world(env)
    following = world.reset()
    step(world.stepper, np.array([1, 2, 3, -4], np.float32), following)
    (told,) = env.actions
    assert told.tolist() == [[1, 2], [3, -4]]
    assert told.dtype == np.float64
    np.testing.assert_array_equal(following, np.float32(0.1))


# What an environment returns (nothing compiled sees it before it is checked)


OBSERVATIONS = {
    "too long": np.zeros(3),
    "too short": np.zeros(1),
    "two axes": np.zeros((1, 2)),
    "a column": np.zeros((2, 1)),
    "a square": np.zeros((2, 2)),
    "times that took": np.zeros(2, "timedelta64[s]"),
    "scalar": 1.0,
    "array without axes": np.array(1.0),
    "ragged": [[1.0], [1.0, 2.0]],
    "text": "ab",
    "texts": ["a", "b"],
    "objects": np.array([None, 1.0]),
    "complex": np.array([1j, 2.0]),
    "dict": {"position": 0.0},
    "times": np.zeros(2, "datetime64[s]"),
}


@pytest.mark.parametrize("at", [0, 2])
@pytest.mark.parametrize("kind", OBSERVATIONS)
def test_an_observation_outside_its_space_is_named_with_environment_and_step(kind, at):
    with pytest.raises(
        ValueError,
        match=rf"(?s)^env must keep to its observation space Box\(.*, from <.*Odd.*>, at step {at} "
        "of an episode, came an observation of ",
    ):
        list(steps(open_world(Odd(OBSERVATIONS[kind], at=at)), [0, 1, 0]))


@pytest.mark.parametrize("kind", ["too long", "scalar", "ragged"])
def test_nothing_compiled_is_called_with_it(monkeypatch, kind):
    acted = []

    def act(actor, observation, noise, action):
        acted.append(observation.copy())
        action[:] = 0

    monkeypatch.setattr("rl_core.worlds.episodes.act", act)
    with pytest.raises(ValueError, match=r"at step 2 of an episode, came an observation"):
        reinforce(lambda: Odd(OBSERVATIONS[kind]), ReinforceConfig(), episodes=1, seeds=[0])
    assert [observation.tolist() for observation in acted] == [[0, 0], [0, 0]]


def test_an_id_is_named_by_itself():
    class Short(gymnasium.ObservationWrapper):
        def observation(self, observation):
            return observation[:3]

    world = open_world(lambda: Short(gymnasium.make("CartPole-v1")))
    with pytest.raises(ValueError, match=r"from CartPole-v1, at step 0 of an episode, came an obs"):
        world.reset()


@pytest.mark.parametrize(
    "observation",
    [[0.5, 1], (0.5, 1), np.array([0.5, 1], np.float16), np.array([0, 1], np.int8), [True, False]],
)
def test_numbers_of_every_kind_are_observations(observation):
    *_, (*_, seen) = steps(open_world(Odd(observation)), [0, 1])
    np.testing.assert_array_equal(seen, np.asarray(observation, np.float32))


@pytest.mark.parametrize(
    "reward", [np.zeros(2), np.zeros(0), "1", None, [1.0], 1j, {}, np.complex64(1), b"1"]
)
def test_a_reward_that_is_no_number_is_named_with_environment_and_step(reward):
    with pytest.raises(
        ValueError,
        match=r"(?s)^env must pay a number as reward, from <.*Odd.*>, at step 2 of an episode, "
        "came ",
    ):
        list(steps(open_world(Odd(reward=reward)), [0, 1, 0]))


@pytest.mark.parametrize(
    "kind",
    [int, float, bool, np.bool_, np.int8, np.uint64, np.float16, np.float32, np.float64,
     np.longdouble, lambda value: np.array([value]), lambda value: np.array(value, np.float32)],
)  # fmt: skip
def test_rewards_of_every_width_are_floats(kind):
    *_, (reward, _, _, _) = steps(open_world(Odd(reward=kind(1))), [0, 1])
    assert type(reward) is float
    assert reward == 1.0
    assert checked_reward("here", kind(1)) == 1.0


# Several seeds


@pytest.mark.parametrize("seeds", [[0, 1], (3, 1, 2), range(2), np.arange(2)])
def test_an_environment_ready_made_is_for_one_seed(seeds):
    with pytest.raises(ValueError, match=r"^env must be an id or a function .* several seeds.*got"):
        one_seed_of(Odd(), seeds)
    for env in ("CartPole-v1", Odd, lambda: Odd()):
        assert tuple(one_seed_of(env, seeds)) == tuple(seeds)
    assert tuple(one_seed_of(Odd(), seeds[:1])) == tuple(seeds[:1])


@pytest.mark.parametrize("seeds", [5, None, "ab"])
def test_seeds_that_are_none_are_refused_by_name_for_any_environment(seeds):
    for env in (Odd(), "CartPole-v1"):
        with pytest.raises((TypeError, ValueError), match=r"^(seeds must be|env must be an id or)"):
            reinforce(env, ReinforceConfig(), episodes=1, seeds=seeds)


class Remembering(gymnasium.Wrapper):
    """Pays the number of all steps it has seen, whatever the episode."""

    def __init__(self, env):
        super().__init__(env)
        self.seen = 0

    def step(self, action):
        """Count."""
        self.seen += 1
        observation, _, *rest = self.env.step(action)
        return observation, float(self.seen), *rest


@pytest.fixture
def remembering():
    spec = gymnasium.spec("CartPole-v1")
    wrapper = gymnasium.envs.registration.WrapperSpec(
        "Remembering", "test_environments:Remembering", {}
    )
    gymnasium.register(
        "Remembering-v0", spec.entry_point, max_episode_steps=50, additional_wrappers=(wrapper,)
    )
    yield "Remembering-v0"
    del gymnasium.registry["Remembering-v0"]


@pytest.mark.parametrize("how", ["id", "factory", "path"])
def test_seeds_share_nothing_of_what_a_wrapper_remembers(remembering, how):
    env = {
        "id": remembering,
        "factory": lambda: Remembering(gymnasium.make("CartPole-v1")),
        "path": "test_environments:make_remembering",
    }[how]
    arguments = {"episodes": 3, "snapshots": (1,)}
    together = reinforce(env, ReinforceConfig(), seeds=[0, 1], **arguments)
    alone = reinforce(env, ReinforceConfig(), seeds=[1], **arguments)
    rows = together.table[together.table["seed"] == 1].reset_index(drop=True)
    assert rows.equals(alone.table)
    n = rows["steps"].to_numpy()
    before = n.cumsum() - n
    np.testing.assert_array_equal(rows["return"], n * before + n * (n + 1) / 2)  # within a seed
    for name, array in alone.arrays.items():
        np.testing.assert_array_equal(together.arrays[name][1], array[0])


def make_remembering():
    return Remembering(gymnasium.make("CartPole-v1"))


def test_an_id_registered_anew_is_not_played_as_its_twin(monkeypatch):
    monkeypatch.setitem(
        gymnasium.registry,
        "Acrobot-v1",
        gymnasium.envs.registration.EnvSpec("Acrobot-v1", entry_point="test_environments:Odd"),
    )
    assert isinstance(environments.open_world("Acrobot-v1"), GymnasiumWorld)
