"""Chapter 2's predictions against simulation, its measures against hand calculations."""

import numpy as np
import pandas as pd
import pytest

from report.claims import Evidence
from rl_core.exploration import EpsilonGreedy
from rl_core.q_learning import QLearningConfig, q_learning
from studies import q_learning as study
from studies import q_learning_fresh as fresh
from studies.q_learning_world import GAMMA, World, faulty_weights


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
    assert study.BY_STEP_SIZE[0.2] is study.BY_EXPLOITATION[0.1] is study.FIGURE_9  # run once
    changed = {arm.name: arm.config for arm in study.ARMS}
    assert len({repr(config) for config in changed.values()}) == len(study.ARMS)


def test_the_claims_are_judged_from_the_measures(world):
    names = [arm.name for arm in study.ARMS]
    measures = ["oscillation", "slowness", "error", "earned", "evenness", "norm", "unvisited"]
    measures += ["optimal_share", "lost"]
    # Every arm and measure has a value of its own, so that a swapped arm or measure shows.
    table = pd.DataFrame(
        [[10 + 10 * i + j for j in range(len(measures))] for i in range(len(names))],
        index=names,
        columns=measures,
        dtype=float,
    )
    rows = table.rename_axis("arm").reset_index()
    rows = pd.concat([rows.assign(seed=seed) for seed in (3, 1, 0, 2)])
    level = pd.DataFrame({"above_plateau": [0.02] * 4, "change": [0.03] * 4})
    readings = {"2b": [Evidence.exact(x) for x in (1.0, 1.0, 1.0)]}
    readings |= {"2g": [Evidence.exact(x) for x in (0.8, 0.0, 3.0)]}
    readings |= {"2g typical": [Evidence.exact(0.95)]}
    found = {f.claim.id: f for f in study.findings(world, rows, level, readings)}
    assert list(found) == [f"2{letter}" for letter in "abcdefghi"]

    def of(measure, name):
        return table.loc[name, measure]

    low, cold = "figure 9", "softmax, temperature 0.1"
    soft, rising = "softmax, temperature 1", "exploitation rises from 0.1 to 0.9"
    fast, good = "step size 0.9", "step size 0.15"
    explored = [low, *(f"exploitation {x:g}" for x in (0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95))]
    tried = [low, *(f"step size {x:g}" for x in (0.02, 0.05, 0.1, 0.15, 0.3, 0.5, 0.9))]
    e8, e9, e2 = "exploitation 0.8", "exploitation 0.9", "exploitation 0.2"
    expected = {
        "2a": [
            of("oscillation", fast) / of("oscillation", good),
            of("slowness", "step size 0.02") / of("slowness", good),
            of("error", good) / table.loc[tried, "error"].min(),
        ],
        "2b": [
            min(of("earned", e8), of("earned", e9)) / table.loc[explored, "earned"].max(),
            min(of("evenness", low), of("evenness", e2)) / table.loc[explored, "evenness"].max(),
            max(of("error", low), of("error", e2)) / table.loc[explored, "error"].min(),
        ],
        "2c": [of("error", e9) / of("error", low), of("error", e8) / of("error", e2)],
        "2d": [of(m, arm) / of(m, low) for arm in (soft, cold) for m in ("evenness", "error")],
        "2e": [of("norm", low) - world.plateau, of("earned", low) / world.optimum],
        "2f": [of("unvisited", arm) for arm in (e9, e8, low)],
        "2g": [
            0.95,
            of("unvisited", rising),
            of("error", rising) / of("error", low),
        ],
        "2h": [0.02, 0.03],
        "2i": [of("optimal_share", low), of("lost", low)],
    }
    estimates = {name: [e.estimate for e in f.evidence] for name, f in found.items()}
    assert estimates == {name: pytest.approx(values) for name, values in expected.items()}
    assert [f.verdict for f in found["2b"].others] == ["holds"]
    assert [f.answers for f in found["2g"].others] == [("no", "yes", "no")]
    assert found["2h"].verdict == "holds"
    assert found["2i"].answers == ("yes", "no")


def test_a_curve_has_settled_once_it_stays_near_its_end():
    norms = np.full((3, study.EPISODES), 8.0)
    norms[:, :40] = 20.0
    norms[1:, 70] = 8.06
    assert study.settled(norms) == 72  # the episode after the 71st, which is away once more
    norms[1:, 70] = 8.04
    assert study.settled(norms) == 41


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


def test_a_target_of_the_policy_learns_the_values_of_the_policy(world):
    """The mean table of SARSA is near the values of acting as it does, far from the optimal."""
    mdp, n = world.model, world.model.n_states
    policy = np.full(world.Q_star.shape, 0.9 / 4)
    norms = fresh.on_policy(world, seeds=[1000], episodes=1_500)[0]
    V = np.zeros(n)
    for _ in range(500):
        Q = (mdp.probability * (mdp.reward + GAMMA * V[mdp.successor])).sum(axis=2)
        V = np.where(mdp.terminal, 0.0, (policy * Q).sum(axis=1) + 0.1 * Q.max(axis=1))
    Q[~world.reachable] = 0.0
    assert norms[-500:].mean() == pytest.approx(np.linalg.norm(Q - world.Q_star), rel=0.05)
    assert np.array_equal(norms[:50], fresh.on_policy(world, seeds=[1000], episodes=50)[0])


def test_a_wall_that_collects_raises_the_plateau(world):
    assert fresh.collected_by_bumping(world) == pytest.approx(8.369, abs=5e-4)


def test_the_ratio_of_means_is_not_the_mean_of_ratios():
    found = fresh.ratio_of_means(np.array([1.0, 9.0]), np.array([1.0, 3.0]))
    assert found.estimate == 2.5
    assert (found.low, found.high, found.seeds) == (1.0, 3.0, 2)


def test_the_worse_of_two_is_measured_against_the_arm_that_was_chosen():
    arms = {x: fresh.PROBABILITIES[x].name for x in (0.3, 0.8, 0.9)}
    rows = [
        {"arm": arms[x], "seed": seed, "earned": value, "error": value, "evenness": value}
        for x, value in ((0.3, 2.0), (0.8, 1.0), (0.9, 1.5))
        for seed in range(3)
    ]
    found = pd.DataFrame(rows)
    assert fresh.worst(found, "earned", (0.8, 0.9), arms[0.3]).estimate == 0.5
    assert fresh.worst(found, "error", (0.8, 0.9), arms[0.3]).estimate == 0.75
    best = fresh.best_of(found)
    assert best == {"earned": arms[0.3], "evenness": arms[0.3], "error": arms[0.8]}
