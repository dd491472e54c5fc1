"""The compiled tasks against Gymnasium's own, bit for bit; and tasks of a user's own."""

import pickle
from functools import cache
from types import SimpleNamespace

import gymnasium
import numba
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.envs.classic_control import cartpole
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_task import LENGTH, NOWHERE, RIGHT, Corridor

from rl_core.worlds.acrobot import _in_doubt
from rl_core.worlds.tasks import Task, task
from rl_core.worlds.twins import TASKS, twin

SEEDS = range(6)
STEPS = 1000


@cache
def original(name):
    return gymnasium.make(name, disable_env_checker=True).unwrapped


def choose(name, seed, state, rng):
    """Actions of three kinds, so that walls, bounds and ends are met as well as the valley."""
    along = state[2] if name in ("Acrobot-v1", "CartPole-v1") else state[1]
    if TASKS[name].action_dimensions:
        scale, push = [(0.3, 0.0), (1.0, 1.0), (3.0, 0.5)][seed % 3]
        return np.array([rng.normal(push * np.sign(along), scale)], np.float32)
    n = TASKS[name].n_actions
    if seed % 3 == 0 or (seed % 3 == 1 and rng.random() < 0.3):
        return np.array([rng.integers(n)], np.float32)
    return np.array([n - 1 if along >= 0 else 0], np.float32)


def native(name, action):
    return action if TASKS[name].action_dimensions else int(action[0])


@pytest.mark.parametrize("name", TASKS)
def test_twin_equals_gymnasium_bit_for_bit(name):
    ends = 0
    start, kernel = TASKS[name].start, TASKS[name].kernel()
    state, observation = kernel.state, np.empty(TASKS[name].n_observations, np.float32)
    env = original(name)
    for seed in SEEDS:
        rng, actions = np.random.default_rng(seed), np.random.default_rng(1000 + seed)
        expected, _ = env.reset(seed=seed)
        start(rng, state, observation)
        np.testing.assert_array_equal(observation, expected)
        for _ in range(STEPS):
            action = choose(name, seed, state, actions)
            expected, *outcome, _, _ = env.step(native(name, action))
            assert list(kernel.step(state, action)) == outcome
            kernel.observe(state, observation)
            np.testing.assert_array_equal(observation, expected)
            np.testing.assert_array_equal(state[: len(env.state)], env.state)
            if outcome[1]:
                ends += 1
                expected, _ = env.reset()
                start(rng, state, observation)
                np.testing.assert_array_equal(observation, expected)
    assert ends > 0 or name == "Pendulum-v1"


RANGES = {
    "Acrobot-v1": [np.pi, np.pi, 4 * np.pi, 9 * np.pi],
    "CartPole-v1": [2.5, 10.0, 0.3, 10.0],
    "MountainCar-v0": [1.2, 0.07],
    "MountainCarContinuous-v0": [1.2, 0.07],
    "Pendulum-v1": [100.0, 8.0],
}


@settings(deadline=None, max_examples=500)
@given(st.sampled_from(sorted(TASKS)), st.data())
def test_one_step_from_anywhere_equals_gymnasiums(name, data):
    env, kernel = original(name), TASKS[name].kernel()
    env.reset(seed=0)
    single = name == "MountainCarContinuous-v0" and data.draw(st.booleans())
    place = [data.draw(st.floats(-x, min(x, 0.6) if "Car-" in name else x)) for x in RANGES[name]]
    env.state = np.array(place, np.float32 if single else np.float64)
    kernel.state[: len(place)] = env.state
    kernel.state[len(place) :] = float(single)
    n = TASKS[name].n_actions
    a = data.draw(st.integers(0, n - 1) if n else st.floats(-5, 5, width=32))
    action = np.array([a], np.float32)
    expected, *outcome, _, _ = env.step(native(name, action))
    assert list(kernel.step(kernel.state, action)) == outcome
    observation = np.empty(TASKS[name].n_observations, np.float32)
    kernel.observe(kernel.state, observation)
    np.testing.assert_array_equal(observation, expected)
    np.testing.assert_array_equal(kernel.state[: len(place)], env.state)


@pytest.mark.parametrize(
    ("i", "edge"), [(0, 2.4), (2, original("CartPole-v1").theta_threshold_radians)]
)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_cartpole_ends_beyond_its_edges_not_on_them(i, edge, sign):
    env, kernel = original("CartPole-v1"), TASKS["CartPole-v1"].kernel()
    ends = []
    for place in (edge, np.nextafter(edge, np.inf)):
        env.reset(seed=0)
        env.state = kernel.state[:] = sign * place * np.eye(4)[i]
        ends.append(kernel.step(kernel.state, np.ones(1, np.float32))[1])
        assert ends[-1] == env.step(1)[2]
    assert ends == [False, True]


@pytest.mark.parametrize("name", TASKS)
def test_starts_are_those_of_gymnasium(name):
    env, kernel = original(name), TASKS[name].kernel()
    plain, compiled = np.random.default_rng(7), np.random.default_rng(7)
    env.np_random = np.random.default_rng(7)
    state = np.full(TASKS[name].n_state, np.nan)
    kernel.state[:] = np.nan
    observation, seen = np.empty((2, TASKS[name].n_observations), np.float32)
    for _ in range(2000):
        expected, _ = env.reset()
        TASKS[name].start(plain, state, observation)
        kernel.start(compiled, kernel.state, seen)
        np.testing.assert_array_equal(observation, expected)
        np.testing.assert_array_equal(kernel.state, state)
        if name == "Acrobot-v1":  # compiled code has no single precision cosine like numpy's
            np.testing.assert_array_max_ulp(seen, expected, 1)
        else:
            np.testing.assert_array_equal(seen, expected)


@pytest.mark.parametrize("name", TASKS)
def test_tasks_have_gymnasiums_spaces(name):
    env, found = original(name), TASKS[name]
    assert (found.observation_space, found.action_space) == (
        env.observation_space,
        env.action_space,
    )
    assert env.observation_space.shape == (found.n_observations,)
    if found.n_actions:
        assert (env.action_space.n, found.action_dimensions) == (found.n_actions, 0)
    else:
        assert env.action_space.shape == (found.action_dimensions,)


def step(name, state, action):
    return TASKS[name].kernel().step(state, np.array([action], np.float32))


def test_cost_is_charged_on_the_force_before_it_is_clipped():
    start = np.array([-0.5, 0.0, 1.0])
    weak, strong = start.copy(), start.copy()
    cost, _ = step("MountainCarContinuous-v0", weak, 1.5)
    higher_cost, _ = step("MountainCarContinuous-v0", strong, 3.0)
    assert (cost, higher_cost) == pytest.approx((-0.225, -0.9))
    np.testing.assert_array_equal(weak, strong)


def test_goal_pays_a_hundred_and_ends_the_episode():
    assert step("MountainCarContinuous-v0", np.array([0.44, 0.05, 1.0]), 0.0) == (100.0, True)


@pytest.mark.parametrize("scale", [0.01, 1.0, 30.0, 1000.0])
def test_a_square_that_is_not_in_doubt_is_numpys(scale):
    numbers = np.random.default_rng(0).uniform(-scale, scale, 50_000)
    certain = [x for x in numbers if not _in_doubt(x, x * x)]
    assert len(certain) > 0.96 * numbers.size
    assert [x * x for x in certain] == [x**2 for x in certain]
    assert any(x * x != x**2 for x in numbers)  # there is something to doubt
    assert all(_in_doubt(x / 1e9, (x / 1e9) ** 2) for x in numbers[:10])


def test_acrobot_conserves_energy_without_torque():
    def energy(state):
        theta1, theta2, omega1, omega2 = state
        below = -np.cos(theta1), -np.cos(theta1) - 0.5 * np.cos(theta1 + theta2)
        kinetic1 = 0.5 * (0.25 + 1.0) * omega1**2
        centre = (
            omega1**2 + 0.25 * (omega1 + omega2) ** 2 + omega1 * (omega1 + omega2) * np.cos(theta2)
        )
        kinetic2 = 0.5 * centre + 0.5 * (omega1 + omega2) ** 2
        return kinetic1 + kinetic2 + 9.8 * (0.5 * below[0] + below[1])

    def gain(torque):
        state = np.array([0.3, -0.2, 0.1, 0.2])
        before = energy(state)
        for _ in range(20):
            step("Acrobot-v1", state, 1 + torque)
        return energy(state) - before

    assert abs(gain(0)) < 0.01
    assert min(abs(gain(-1)), abs(gain(1))) > 0.1


@settings(deadline=None, max_examples=200)
@given(
    st.sampled_from(["MountainCar-v0", "MountainCarContinuous-v0"]),
    st.floats(-1.2, 0.6),
    st.floats(-0.07, 0.07),
    st.floats(-5, 5, width=32),
)
def test_car_stays_between_its_walls(name, position, velocity, force):
    state = np.array([position, velocity, 0.0])
    step(name, state, force if TASKS[name].action_dimensions else round(force) % 3)
    assert np.float32(-1.2) <= state[0] <= np.float32(0.6)
    assert abs(state[1]) <= np.float32(0.07)
    assert state[0] > np.float32(-1.2) or state[1] >= 0


@settings(deadline=None, max_examples=200)
@given(st.lists(st.floats(-30, 30), min_size=4, max_size=4), st.integers(0, 2))
def test_acrobot_stays_within_its_bounds(start, action):
    state = np.array(start)
    step("Acrobot-v1", state, action)
    assert np.all(np.abs(state) <= np.array([1, 1, 4, 9]) * np.pi)


@numba.njit(nogil=True)
def play(kernel, rng, action, limit, observation):
    kernel.start(rng, kernel.state, observation)
    start, total = observation[0], 0.0
    for t in range(limit):
        reward, terminated = kernel.step(kernel.state, action)
        kernel.observe(kernel.state, observation)
        total += reward
        if terminated:
            return start, t + 1, total, observation[0]
    return start, limit, total, observation[0]


def test_a_users_task_plays_in_a_loop_that_does_not_know_it():
    assert (Corridor.name, Corridor.module) == ("Corridor", "toy_task")
    assert (Corridor.n_observations, Corridor.n_actions, Corridor.action_dimensions) == (1, 2, 0)
    for seed in range(10):
        kernel, rng = Corridor.kernel(), np.random.default_rng(seed)
        seen = np.empty(1, np.float32)
        start, steps, total, end = play(kernel, rng, RIGHT, Corridor.max_episode_steps, seen)
        place = np.random.default_rng(seed).integers(0, LENGTH // 2)
        assert start == np.float32(place / LENGTH)
        assert (steps, total, end) == (LENGTH - place, place - LENGTH, 1.0)


def test_one_loop_is_compiled_for_all_tasks():
    rng = np.random.default_rng(0)
    for played in (Corridor, TASKS["CartPole-v1"], TASKS["Pendulum-v1"]):
        play(played.kernel(), rng, RIGHT, 10, np.empty(played.n_observations, np.float32))
    assert len(play.overloads) == 1


def test_kernels_share_code_but_no_state():
    first, second = Corridor.kernel(), Corridor.kernel()
    assert first.step is second.step
    first.step(first.state, RIGHT)
    assert (first.state[0], second.state[0]) == (1.0, 0.0)


def test_what_a_task_raises_reaches_the_caller_of_the_loop():
    with pytest.raises(ValueError, match="action must be 0 or 1"):
        play(Corridor.kernel(), np.random.default_rng(0), NOWHERE, 10, np.empty(1, np.float32))


def test_a_task_travels_to_another_process_by_name():
    assert pickle.loads(pickle.dumps(Corridor)).step is Corridor.step


def nothing(state, action):
    return 0.0, False


def begin(rng, state, observation):
    observation[:] = 0.0


def look(state, observation):
    observation[:] = 0.0


def declare(functions=None, **changes):
    box = spaces.Box(-1.0, 1.0, (2,))
    arguments = {"n_state": 1, "observation_space": box, "action_space": spaces.Discrete(2)}
    described = {"start": begin, "step": nothing, "observe": look, **(functions or {})}
    functions = {name: staticmethod(f) for name, f in described.items() if f is not None}
    made = type("Described", (), functions)
    return task(**{**arguments, "max_episode_steps": 5, **changes})(made)


def beyond(state, action):
    state[len(action)] = 1.0
    return 0.0, False


def test_a_task_cannot_write_beyond_its_state():
    kernel, seen = declare({"step": beyond}).kernel(), np.empty(2, np.float32)
    with pytest.raises(IndexError):
        play(kernel, np.random.default_rng(0), RIGHT, 10, seen)


def test_what_is_declared_is_what_a_task_has():
    assert isinstance(declare(), Task)
    assert declare(max_episode_steps=None).max_episode_steps is None
    assert declare(action_space=spaces.Box(-1, 1, (2, 3))).action_dimensions == 6
    assert declare(n_state=np.int64(3)).kernel().state.shape == (3,)


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"n_state": 0}, ValueError, "n_state must be an integer from 1, got 0"),
        ({"n_state": 1.5}, TypeError, r"n_state must be an integer from 1, got 1\.5"),
        (
            {"max_episode_steps": 0},
            ValueError,
            "max_episode_steps must be an integer from 1 or None",
        ),
        ({"max_episode_steps": "5"}, TypeError, "max_episode_steps must be .* or None, got '5'"),
        (
            {"observation_space": spaces.Discrete(3)},
            TypeError,
            r"observation_space must be a gymnasium\.spaces\.Box, got Discrete\(3\)",
        ),
        (
            {"observation_space": spaces.Box(0, 1, (0,))},
            ValueError,
            "observation_space must be a space of at least one number",
        ),
        (
            {"action_space": spaces.MultiDiscrete([2, 2])},
            TypeError,
            r"action_space must be a gymnasium\.spaces\.Discrete or Box, got MultiDiscrete",
        ),
        (
            {"action_space": spaces.Discrete(2, start=1)},
            ValueError,
            "action_space must be Discrete from 0, or a Box, got Discrete",
        ),
        ({"functions": {"step": None}}, TypeError, "step must be a plain function of .*, got None"),
        (
            {"functions": {"observe": begin}},
            ValueError,
            r"observe must be a plain function of \(state, observation\), "
            r"got '\(rng, state, observation\)'",
        ),
        (
            {"functions": {"start": numba.njit(begin)}},
            TypeError,
            "start must be a plain function of .*, got CPUDispatcher",
        ),
    ],
)
def test_a_wrong_declaration_is_refused_by_name(changes, kind, message):
    with pytest.raises(kind, match=message):
        declare(**changes)


def test_only_a_class_makes_a_task():
    with pytest.raises(TypeError, match="task must be put on a class"):
        task(
            n_state=1,
            observation_space=spaces.Box(0, 1, (1,)),
            action_space=spaces.Discrete(2),
            max_episode_steps=None,
        )(begin)


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (lambda state, action: 1.0, r"No conversion from float64 to Tuple\(float64, bool\)"),
        (lambda state, action: (unknown, False), "NameError: name 'unknown' is not defined$"),  # noqa: F821
    ],
)
def test_numbas_reason_is_told_in_one_line(function, reason):
    described = declare({"step": function})
    with pytest.raises(
        ValueError, match=f"^step must be .* that numba compiles, .*{reason}"
    ) as raised:
        described.kernel()
    assert "\n" not in str(raised.value)


def test_an_id_has_the_twin_that_is_registered(monkeypatch):
    registered = vars(gymnasium.spec("CartPole-v1"))

    def register(**changes):
        spec = registered | changes
        monkeypatch.setitem(gymnasium.registry, "CartPole-v1", SimpleNamespace(**spec))
        return twin("CartPole-v1")

    assert all(twin(name) is TASKS[name] for name in TASKS)
    assert register(max_episode_steps=50).max_episode_steps == 50
    assert register(max_episode_steps=50).kernel().step is TASKS["CartPole-v1"].kernel().step
    assert register(kwargs={"sutton_barto_reward": True}) is None
    assert register(additional_wrappers=("wrapped",)) is None
    assert register(entry_point=cartpole.CartPoleEnv) is None
    monkeypatch.delitem(gymnasium.registry, "CartPole-v1")
    assert twin("CartPole-v1") is None
    assert twin("FrozenLake-v1") is None
