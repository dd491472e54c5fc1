"""Chapter 6's arms and measures, on made-up evaluations with known answers."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from rl_core.evaluation import as_learned, evaluate, uniform
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig
from rl_core.worlds.discretise import gridded
from studies import evaluation as study
from studies import rewards
from studies.shared import of_table


def _policies(name, steps, returns):
    """Two agents, as many seeds as there are columns."""
    rows = []
    for i, agent in enumerate(("one", "other")):
        for seed in range(np.shape(steps)[1]):
            rows.append(
                {
                    **dict(zip(study.KEY, (name, agent, "no limit", "greedy"), strict=True)),
                    "seed": seed,
                    "steps": steps[i][seed],
                    "return": returns[i][seed],
                    "terminated": 1.0,
                    "shaped_return": np.nan,
                    "limited_steps": 100.0,
                    "limited_return": -100.0,
                    "limited_terminated": 0.5,
                }
            )
    return pd.DataFrame(rows)


def test_rankings_that_agree_and_that_do_not():
    steps = np.random.default_rng(0).uniform(100, 500, (2, 30))
    agree = study.agreement(_policies("MountainCar", steps, -steps), "return", "MountainCar")
    assert (agree.estimate, agree.low, agree.high) == pytest.approx((1, 1, 1))
    oppose = study.agreement(_policies("MountainCar", steps, 2 * steps), "return", "MountainCar")
    assert (oppose.estimate, oppose.high) == pytest.approx((-1, -1))
    random = np.random.default_rng(1).uniform(size=(2, 30))
    apart = study.agreement(_policies("MountainCar", steps, random), "return", "MountainCar")
    assert apart.low < 0 < apart.high
    assert apart.seeds == 30


def test_shaped_returns_are_those_that_dqn_learns_from():
    for name, shape in (
        ("Acrobot", rewards.tip_height),
        ("MountainCar", rewards.distance_from_start),
    ):
        seen = []

        def keep(observations, actions, rewards, shape=shape, seen=seen):
            seen.append(sum(shape(o, 0.0) for o in observations[1:]))
            return 0.0

        n = 6 if name == "Acrobot" else 2
        measures = {"ours": study.shaped_return(name), "theirs": keep}
        table = evaluate(
            study.ENV[name], uniform(n, 3), seed=0, episodes=3, max_steps=80, measures=measures
        )
        np.testing.assert_allclose(table["ours"], seen, rtol=1e-6)


def test_under_a_limit_the_same_episodes_are_cut(monkeypatch):
    monkeypatch.setattr(study, "EPISODES", 30)
    name = "MountainCarContinuous-v0"
    network = {"layer0.weight": np.array([[0], [50]]), "log_sigma": np.array([-3])}
    pushes = as_learned(
        ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct")),
        {name: array.astype(np.float32) for name, array in network.items()},
    )
    for agent in (of_table(gridded(name, (1, 2), levels=3), np.eye(3)[[0, 2]]), pushes):
        long = study.evaluate_both(name, agent, 106, seed=0, measures={"one": lambda *_: 1})
        assert long["terminated"].all()
        assert (long["one"] == 1).all()
        within = long["steps"] <= 106
        assert 0 < within.sum() < 30
        np.testing.assert_array_equal(long["limited_terminated"], within)
        np.testing.assert_array_equal(long["limited_steps"], np.minimum(long["steps"], 106))
        np.testing.assert_array_equal(long["limited_return"][within], long["return"][within])
        assert (long["limited_return"][~within] < 0).all()
        first = evaluate(name, agent, seed=0, episodes=1, max_steps=106).iloc[0]
        assert first["steps"] == long["limited_steps"].iloc[0]
        assert first["return"] == pytest.approx(long["limited_return"].iloc[0], abs=1e-12)


def test_the_gentler_the_driver_the_more_it_gets_and_the_longer_it_takes():
    """Down to where the wall on the left stops it: from there on it never arrives."""
    drivers = study.gentle((0.15, 1.0, 0.6, 0.3, 0.18))
    soft, lost = study.gentlest(drivers)
    assert (soft["force"], lost["force"]) == (0.18, 0.15)
    assert lost["reached"] == 0
    table = drivers.sort_values("force", ascending=False)[:-1]
    assert (table["reached"] == 1).all()
    assert table["steps"].is_monotonic_increasing
    assert table["return"].is_monotonic_increasing
    assert table["return"].iloc[-1] < 100


def test_a_ratio_to_networks_draws_these_too():
    rng = np.random.default_rng(0)
    table, network = np.full(30, 150.0), np.tile([100.0, 200.0, 9_000.0], 10)
    found = study.relative_steps(table, network, rng)
    assert found.estimate == 1.0
    assert found.low < 1.0 < found.high  # although all tables are alike
    assert study.relative_steps(table, np.full(30, 9_000.0), rng).seeds == 0
    assert study.relative_steps(table[:2], network[1:3], rng).estimate == 0.75


def test_arms_are_paired_with_and_without_the_limit():
    names = [arm.name for arm in study.arms()]
    assert len(set(names)) == len(names)
    for arm in study.reported_arms():
        name = study.environment_of(arm.name)
        under = next(one for one in study.arms() if one.name == f"{arm.name}, under the limit")
        assert under.config.max_episode_steps == study.LIMIT[name]
        assert arm.config.max_episode_steps != study.LIMIT[name]
        assert under.config.gamma == arm.config.gamma
        assert under.env == arm.env
    assert {study.environment_of(name) for name in names} == set(study.ENV)


def test_every_arm_is_tried_out_and_chance_besides():
    tried = study.tried()
    assert {one.arm for one in tried} == {arm.name for arm in study.arms()} | {None}
    assert len({(one.environment, one.agent, one.trained, one.acting) for one in tried}) == len(
        tried
    )


def test_every_timed_run_has_an_arm():
    made = {arm.name for batch in (512, 32) for arm in study.timed_arms(batch)}
    made |= {arm.name for arm in study.reported_arms() if arm.name.endswith("REINFORCE")}
    assert made == {study.timed(name, batch) for name in study.TIMES for batch in (512, 32)}
    assert {arm.episodes for arm in study.timed_arms(32)} == {20}


def test_time_is_held_against_the_report_in_both_readings():
    """As many processor seconds as the report has, or half, or twice as many; no clock is asked."""
    factors = {512: 2.0, 32: 0.5}
    times = pd.DataFrame(
        {
            "arm": study.timed(name, batch),
            "episodes": 20,
            "processor": "p",
            "seconds": 1e9,
            "processor_seconds": [seconds * (factor if name.endswith("DQN") else 0.25)] * 3,
        }
        for batch, factor in factors.items()
        for name, seconds in study.TIMES.items()
    ).explode("processor_seconds")
    times["processor_seconds"] = times["processor_seconds"].astype(float)
    found = study.judged_times(times)
    assert found.answers == ("yes", "yes", "yes", "no", "no")
    assert found.others[0].answers == ("yes",) * 5
    assert found.verdict == "depends on the reading"
    table = study.compared_times(times.drop_duplicates())
    assert table["then / now"].tolist() == [4, 4, 4, 0.5, 2, 0.5, 2]


def test_every_compared_table_has_an_arm():
    names = {arm.name for arm in study.arms()}
    for name in study.ENV:
        assert f"{name}, table, {study.chosen_bins(name)} bins" in names


def test_the_summary_of_an_environment():
    steps = np.array([[120.0, 130, 140], [200, 210, 220]])
    table = study.summary(_policies("MountainCar", steps, -steps), "MountainCar")
    assert table["steps, no limit"].tolist() == ["130 [120, 140]", "210 [200, 220]"]
    assert table["return within 200 steps"].iloc[0] == "−100 [−100, −100]"
    assert table["reached in time (%)"].tolist() == [50, 50]


def test_what_the_text_quotes_of_reinforce():
    """Shares in percent, training in millions of steps, each from its own agent."""
    agents = (("no limit", "as learned"), ("no limit", "greedy"), ("time limit", "as learned"))
    rows = [
        dict(zip(study.KEY, ("Acrobot", "REINFORCE", *agent), strict=True))
        | {"seed": seed, "terminated": 0.1 * (i + 1), "limited_terminated": 0.01 * (i + 1)}
        for i, agent in enumerate(agents)
        for seed in range(3)
    ]
    table = pd.DataFrame(
        {"arm": f"Acrobot, {arm}", "seed": seed, "env_steps": steps * (seed + 1)}
        for arm, steps in (("REINFORCE", 1e6), ("REINFORCE, under the limit", 2e6))
        for seed in range(3)
    )
    results = SimpleNamespace(table=table, provenance=table.assign(seconds=1.0))
    assert study.reached(pd.DataFrame(rows), results, "Acrobot") == pytest.approx(
        {
            "reached": 10,
            "greedy-reached": 20,
            "in-time": 1,
            "under-in-time": 3,
            "under-reached": 30,
            "free-steps": 2,
            "limited-steps": 4,
        }
    )


def test_steps_of_an_agent():
    steps = np.array([[120.0, 130, 140], [200, 210, 220]])
    policies = _policies("Acrobot", steps, -steps)
    assert study.steps_of(policies, "Acrobot", "other", "greedy").tolist() == [200, 210, 220]
    assert study.steps_of(policies, "Acrobot", "other", "as learned").size == 0


@pytest.mark.parametrize("name", study.ENV)
def test_gymnasiums_limits(name):
    import gymnasium

    assert gymnasium.spec(study.ENV[name]).max_episode_steps == study.LIMIT[name]


def test_every_arm_is_told_by_what_differs():
    told = study.settings_of_arms().set_index("arm")["differs"]
    assert list(told.index) == [arm.name for arm in study.arms()]
    assert told["MountainCarContinuous, table, 20 bins"] == told["Acrobot, DQN"] == ""
    assert told["Acrobot, table, 6 bins"] == "bins=6, levels=None"
    assert told["MountainCar, DQN, under the limit"] == "max_episode_steps=200"
