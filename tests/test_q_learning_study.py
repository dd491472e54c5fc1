"""Chapter 2's predictions against simulation, its measures against hand calculations."""

import numpy as np
import pandas as pd
import pytest
import q_learning_study as study
from q_learning_world import GAMMA, World, faulty_weights

from rl_core.exploration import EpsilonGreedy
from rl_core.q_learning import QLearningConfig, q_learning


@pytest.fixture(scope="module")
def world():
    return World()


def test_the_plateau_is_what_the_unreachable_states_add_up_to(world):
    table = world.unreachable()
    assert world.plateau == pytest.approx(7.957, abs=5e-4)
    assert world.start_norm == pytest.approx(25.256, abs=5e-4)
    assert np.sqrt(table["sum of squares"].iloc[-1]) == pytest.approx(world.plateau)
    assert table["states"].tolist() == [4, 4, 4, 12]


@pytest.mark.parametrize("visited", [0.0, 0.5, 1.0])
def test_the_parts_of_the_error_add_up(world, visited):
    rng = np.random.default_rng(3)
    Q = np.where(world.visitable[:, None], rng.normal(size=(5, 112, 4)), 0.0)
    visits = rng.integers(0, 60, Q.shape) * (rng.random(Q.shape) < visited)
    visits *= world.visitable[:, None]
    parts = world.split(Q, visits, 0.2)
    whole = ((Q - world.Q_star) ** 2).sum(axis=(1, 2))
    assert sum(parts.values()) == pytest.approx(whole, rel=1e-12)
    assert parts["cannot be visited"] == pytest.approx(world.plateau**2)
    rare = (visits >= 1) & (visits <= 20)  # 0.8 ** 20 > 1% > 0.8 ** 21
    expected = ((Q - world.Q_star) ** 2 * rare).sum(axis=(1, 2))
    assert parts["rarely visited"] == pytest.approx(expected)


def test_the_predicted_noise_is_the_noise(world):
    config = QLearningConfig(step_size=0.1, exploration=EpsilonGreedy(0.9))
    run = q_learning(world.model, config, episodes=8_000, seeds=[1000, 1001], Q_star=world.Q_star)
    late = run.table[run.table["episode"] > 5_000]
    measured = np.sqrt(world.entries * (late["rmse_visitable"] ** 2).mean())
    assert world.noise(0.1, exploitation=0.1) == pytest.approx(measured, rel=0.05)
    doubled = world.noise(0.2, 0.1) / world.noise(0.1, 0.1)
    assert doubled == pytest.approx(np.sqrt((0.2 / 1.8) / (0.1 / 1.9)))


def test_the_predicted_visits_are_the_visits(world):
    # Steps this small leave the table where it is: the agent stays epsilon-greedy on zeros.
    config = QLearningConfig(step_size=1e-12, exploration=EpsilonGreedy(1.0))
    run = q_learning(world.model, config, episodes=4_000, seeds=[1000])
    expected = world.visits_an_episode(1.0)
    measured = run.arrays["visits"][0] / 4_000
    assert expected[world.visitable].sum() == pytest.approx(measured.sum(), rel=0.05)
    frequent = expected > 0.3
    assert measured[frequent] == pytest.approx(expected[frequent], rel=0.15)


def test_only_the_learned_states_count_as_right(world):
    Q = np.stack([world.Q_star, np.zeros_like(world.Q_star), -world.Q_star])
    assert world.wrong(Q).sum(axis=1).tolist() == [0, 92, 92]
    assert world.stakes().shape == (92,)
    assert world.stakes().min() > 0


def test_evenness_is_one_for_even_visits(world):
    even = np.ones((1, 112, 4), dtype=int)
    single = np.zeros_like(even)
    single[0, 0, 2] = 9
    assert study.evenness(world, even) == pytest.approx([1.0])
    assert study.evenness(world, single) == pytest.approx([1 / world.entries])


def test_earnings_are_discounted_to_the_start():
    table = pd.DataFrame({"steps": [1, 3], "return": [2.0, 1.0]})
    assert study.earned(table).tolist() == pytest.approx([2.0, GAMMA**2])


def test_the_faulty_weights_are_no_probabilities(world):
    table = faulty_weights(world)
    faulty = table[table["rule"] == "faulty"]["sum"]
    assert (faulty > 1.5).all()
    assert table[table["rule"] == "softmax"]["sum"].tolist() == pytest.approx([1, 1, 1])


def test_arms_differ_from_figure_9_in_one_setting():
    usual = study.FIGURE_9.config
    assert len({arm.name for arm in study.ARMS}) == len(study.ARMS)
    for arm in study.ARMS:
        changed = [
            name
            for name in ("gamma", "step_size", "exploration", "evaluation")
            if getattr(arm.config, name) != getattr(usual, name)
        ]
        assert len(changed) <= 1, arm.name
        assert (arm.config.max_steps is None) == (arm is not study.FAULTY_ARM)
    assert study.BY_STEP_SIZE[0.2].config == study.BY_EXPLOITATION[0.1].config == usual


def test_the_claims_are_judged_from_the_measures(world):
    names = [arm.name for arm in study.ARMS]
    measures = ["oscillation", "slowness", "error", "earned", "evenness", "norm", "unvisited"]
    rows = [
        {"arm": name, "seed": seed, "optimal_share": 1.0, "lost": 0.0}
        | dict.fromkeys(measures, 1.0)
        for name in names
        for seed in range(4)
    ]
    level = pd.DataFrame({"above_plateau": [0.02] * 4, "change": [0.0] * 4})
    found = {f.claim.id: f for f in study.findings(world, pd.DataFrame(rows), level)}
    assert list(found) == [f"2{letter}" for letter in "abcdefghi"]
    assert found["2i"].verdict == found["2h"].verdict == "holds"
    assert found["2c"].verdict == "does not hold"  # all errors are the same here
    assert found["2a"].answers == ("no", "no", "yes")


def test_a_seed_that_never_gets_close_counts_to_the_end(world):
    n = study.EPISODES
    table = pd.DataFrame(
        {
            "rmse_visitable": np.linspace(1, 0.5, n),
            "error_norm": np.full(n, 20.0),
            "steps": 10,
            "return": 1.0,
            "terminated": True,
            "env_steps": np.arange(1, n + 1) * 10,
            "visited_entries": 184,
            "optimal_states": 46.0,
            "value_lost": 0.1,
            "eval_return": 2.0,
            "eval_steps": 9.0,
        }
    )
    found = study.measures(world, table)
    assert found["slowness"] == n
    assert found["unvisited"] == found["optimal_share"] == 0.5
    assert found["earned"] == pytest.approx(GAMMA**9)
    assert found["oscillation"] == pytest.approx(0.5 / (n - 1))
    table.loc[122:, "error_norm"] = world.plateau + 0.5
    assert study.measures(world, table)["slowness"] == 123
