"""What the figures that answer put into a page. What a browser makes of it: interactive_browser."""

import json
import re
from base64 import b64decode
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from interactive import (
    Widget,
    knob,
    learning_log,
    learning_widget,
    maze_sweeps,
    maze_widget,
    scripts,
    seed_curves,
    snapshots,
)
from interactive.page import LARGEST, STATIC, doubles
from matplotlib.figure import Figure

from rl_core.exploration import EpsilonGreedy
from rl_core.maze import Maze
from rl_core.planning import optimal_actions, q_value_iteration, value_iteration
from rl_core.q_learning import QLearningConfig, VisitDecay, q_learning
from studies.by_sweeps import backup

MAZE = Maze()
MODEL = MAZE.model()
SMALL = Maze("SFG\nOOO")
CONFIG = QLearningConfig(step_size=0.2, exploration=EpsilonGreedy(0.9))
STILL = "<p>still</p>"


@pytest.fixture(scope="module")
def best():
    return value_iteration(MODEL, gamma=0.9, tolerance=1e-10, progress=False).Q


@pytest.fixture(scope="module")
def log(best):
    return learning_log(MAZE, CONFIG, best, 60, snapshots=[100, 150])


def inline(widget):
    """The data as a script would read it from the page."""
    page = widget._repr_html_()
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', page).group(1))


def test_text_cannot_end_the_script():
    name = "</script><script>alert(1)</script>"
    page = Widget("knob", {"name": name}, 'a "label"', STILL)._repr_html_()
    assert page.count("<script") == 1
    assert 'aria-label="a &quot;label&quot;"' in page
    assert inline(Widget("knob", {"name": name}, "label", STILL)) == {"name": name}


def test_a_figure_becomes_a_described_picture():
    page = Widget("knob", {}, "A < B", Figure(figsize=(1, 1)))._repr_html_()
    assert '<img alt="A &lt; B" src="data:image/png;base64,' in page


def test_data_is_kept_as_json_knows_it():
    data = {"x": np.array([1.0, np.nan, -np.inf, 0.5]), "n": np.int64(3), "t": (True, None)}
    assert inline(Widget("knob", data, "", STILL)) == {
        "x": [1, None, None, 0.5],
        "n": 3,
        "t": [True, None],
    }


def test_too_much_data_is_refused():
    with pytest.raises(ValueError, match="data must be at most 250,000 characters of JSON, got"):
        Widget("knob", {"x": "x" * LARGEST}, "", STILL)


def test_doubles_lose_no_bit():
    values = np.random.default_rng(0).normal(size=50)
    assert np.array_equal(np.frombuffer(b64decode(doubles(values)), "<f8"), values)


def test_scripts_are_there_and_ask_for_nothing_from_elsewhere():
    names = scripts()
    assert names[:2] == ["play/core.js", "play/maze.js"]
    for name in names:
        text = (STATIC / name).read_text()
        assert not re.search(r"\bimport\b|\bfetch\(|XMLHttpRequest|\bexport\b", text), name
        assert "http" not in text.replace("http://www.w3.org/2000/svg", ""), name
    assert sum(len((STATIC / name).read_text()) for name in names) < 60_000


@pytest.mark.parametrize("gamma", [0.5, 0.9])
def test_sweeps_are_those_of_planning(gamma):
    sweeps = maze_sweeps(MAZE, gamma)
    assert not sweeps.V[0].any()
    for threshold in (10.0, 1.0, 1e-5):
        plan = q_value_iteration(MODEL, gamma=gamma, threshold=threshold)
        k = len(plan.table)
        assert np.array_equal(sweeps.V[k], plan.Q.max(axis=1))
        assert np.array_equal(sweeps.best[k], optimal_actions(plan.Q))
    last = sweeps.round_policy[-1]
    assert np.array_equal(sweeps.round_policy[-2], last)
    exact = optimal_actions(value_iteration(MODEL, gamma=gamma, tolerance=1e-12).Q)
    assert exact[np.arange(len(last)), last].all()
    for before, after in pairwise(sweeps.round_V[1:]):
        assert (after >= before - 1e-9).all()  # a better policy in every round


def test_other_mazes_can_be_shown_too():
    widget = maze_widget(SMALL, maze_sweeps(SMALL), still=STILL)
    world = inline(widget)["world"]
    assert world["flags"] == {"A": [0, 1]}
    assert world["flag_sets"] == ["", "A"]
    assert len(world["successor"]) == SMALL.model().successor.size


def test_the_maze_takes_little_room():
    data = maze_widget(MAZE, maze_sweeps(MAZE), still=STILL)
    assert len(data.json) < 60_000


def test_the_values_in_the_page_give_the_backups_to_the_bit():
    sweeps = maze_sweeps(MAZE)
    data = inline(maze_widget(MAZE, sweeps, still=STILL))
    V = np.frombuffer(b64decode(data["methods"][0]["V"]), "<f8").reshape(-1, 112)
    successor = np.array(data["world"]["successor"]).reshape(112, 4, 2)
    reward = np.array(data["world"]["reward"], dtype=float).reshape(112, 4, 2)
    p = data["world"]["probability"]
    for k, before in enumerate(V[:-1]):
        q = sum(p[i] * (reward[:, :, i] + 0.9 * before[successor[:, :, i]]) for i in (0, 1))
        assert np.array_equal(q, backup(MODEL, before, gamma=0.9))
        assert np.array_equal(q.max(axis=1), V[k + 1])


def test_the_log_leads_to_what_was_learned(best, log):
    """The plain loop that was logged, the compiled one, and the moves alone: the same bits."""
    run = q_learning(MODEL, CONFIG, episodes=150, seeds=[0, 1], Q_star=best, snapshots=[20, 60])
    for number, episodes in enumerate((20, 60)):
        steps = int(log.lengths[:episodes].sum())
        assert np.array_equal(log.replay(MAZE, steps), run.arrays["Q_snapshots"][0, number])
    assert np.array_equal(log.snapshots[150], run.arrays["Q"][0])
    table = run.table[run.table["seed"] == 0]
    assert log.lengths.tolist() == table["steps"].tolist()[:60]
    assert log.errors.tolist() == table["error_norm"].tolist()
    assert len(log.moves) == log.lengths.sum()


def test_another_seed_takes_other_moves(best, log):
    other = learning_log(MAZE, CONFIG, best, 5, snapshots=(), seed=1)
    assert other.seed == 1
    assert other.moves.tolist() != log.moves[: len(other.moves)].tolist()


def test_moves_survive_their_packing(best, log):
    data = inline(learning_widget(MAZE, log, best, still=STILL))
    pairs = [divmod(data["digits"].index(letter), 8) for letter in data["moves"]]
    moves = [move for pair in pairs for move in pair][: len(log.moves)]
    assert moves == log.moves.tolist()
    assert data["lengths"] == log.lengths.tolist()
    assert data["curve"]["error"][0] == pytest.approx(np.linalg.norm(best), rel=1e-5)
    assert data["curve"]["error"][-1] == pytest.approx(log.errors[-1], rel=1e-5)


def test_a_whole_log_fits_its_page(best):
    log = learning_log(MAZE, CONFIG, best)
    assert len(log.lengths) == 400
    assert len(learning_widget(MAZE, log, best, still=STILL).json) < 100_000


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"config": QLearningConfig(step_size=VisitDecay())}, "config must be a QLearningConfig"),
        ({"config": QLearningConfig(max_steps=9)}, "config must be a QLearningConfig"),
        ({"episodes": 0}, "episodes must be an integer from 1, got 0"),
        ({"snapshots": [9, 8]}, "snapshots must be in rising order"),
        ({"snapshots": [3]}, "snapshots must be an integer from 4, got 3"),
    ],
)
def test_a_log_refuses_what_it_cannot_replay(change, message):
    given = {"config": CONFIG, "episodes": 3, "snapshots": (), "Q_star": np.zeros((112, 4))}
    with pytest.raises(ValueError, match=message):
        learning_log(MAZE, **{**given, **change})


def curves_and_fates():
    episodes = np.arange(1, 501)
    rows = [
        pd.DataFrame({"seed": seed, "episode": episodes, "steps": 1000.0 / (seed + 1) + episodes})
        for seed in range(3)
    ]
    curves = pd.concat(rows)
    curves.loc[(curves["seed"] == 1) & (curves["episode"] > 300), "steps"] = np.nan
    fates = pd.DataFrame(
        {
            "seed": [0, 1, 2],
            "fate": ["learned", "out of budget", "learned"],
            "steps_at_end": [1500.0, np.nan, 833.3333],
            "env_steps": [10, 20, 30],
        }
    )
    return curves, fates


def test_seeds_stand_best_first_with_the_rows_that_are_drawn():
    curves, fates = curves_and_fates()
    data = inline(seed_curves(curves, fates, still=STILL, points=50))
    assert [it["seed"] for it in data["seeds"]] == [2, 0, 1]
    assert [it["failed"] for it in data["seeds"]] == [False, False, True]
    assert len(data["episode"]) == 50
    assert (data["episode"][0], data["episode"][-1], data["rows_in_all"]) == (1, 500, 500)
    steps = curves.pivot(index="episode", columns="seed", values="steps").loc[data["episode"]]
    for it in data["seeds"]:
        shown = np.array(it["steps"], dtype=float)
        np.testing.assert_allclose(shown, steps[it["seed"]], rtol=5e-4)
    assert data["seeds"][2]["steps_at_end"] is None
    # A seed that has stopped counts as needing for ever.
    np.testing.assert_allclose(
        np.array(data["middle"]["median"], dtype=float),
        steps.fillna(np.inf).median(axis=1).replace(np.inf, np.nan),
        rtol=5e-4,
    )


def test_the_median_may_be_of_those_that_learned_and_what_was_cut_is_marked():
    curves, fates = curves_and_fates()
    curves["stopped"] = (curves["seed"] == 0) & (curves["episode"] == 1)
    data = inline(seed_curves(curves, fates, still=STILL, points=50, median="learned"))
    steps = curves.pivot(index="episode", columns="seed", values="steps").loc[data["episode"]]
    middle = {name: np.array(each, dtype=float) for name, each in data["middle"].items()}
    np.testing.assert_allclose(middle["median"], steps[[0, 2]].median(axis=1), rtol=5e-4)
    assert (middle["low"] <= middle["median"]).all()
    assert (middle["median"] <= middle["high"]).all()
    assert data["middle_name"].startswith("median of those that learned")
    assert [it["cut"] for it in data["seeds"]] == [[], [0], []]
    none = seed_curves(curves, fates.assign(fate="lost"), still=STILL, median="learned")
    assert inline(none)["middle"] == {"median": [], "low": [], "high": []}
    with pytest.raises(ValueError, match=r"median must be one of \['all', 'learned'\], got 'some'"):
        seed_curves(curves, fates, still=STILL, median="some")


def test_thirty_seeds_fit_their_page():
    episodes = np.arange(1, 5001)
    steps = np.random.default_rng(0).uniform(50, 20_000, (30, 5000))
    curves = pd.concat(
        pd.DataFrame({"seed": i, "episode": episodes, "steps": steps[i]}) for i in range(30)
    )
    fates = pd.DataFrame({"seed": range(30), "fate": "learned", "steps_at_end": 1, "env_steps": 1})
    assert len(seed_curves(curves, fates, still=STILL).json) < 60_000


def test_films_stand_below_with_or_without_a_seed():
    curves, fates = curves_and_fates()
    films = {"best, seed 2": (2, "<b>one</b>"), "other": "<b>two</b>"}
    widget = seed_curves(curves, fates, still=STILL, films=films)
    assert inline(widget)["films"] == [
        {"name": "best, seed 2", "seed": 2},
        {"name": "other", "seed": None},
    ]
    assert widget.below.count("<details") == 2
    assert "<summary>Film: other</summary><b>two</b>" in widget.below


def test_curves_without_what_they_need_are_refused():
    curves, fates = curves_and_fates()
    with pytest.raises(ValueError, match="fates must be a table with the columns"):
        seed_curves(curves, fates.drop(columns="fate"), still=STILL)
    with pytest.raises(ValueError, match=r"curves must be of the seeds \[0, 1\], got \[0, 1, 2\]"):
        seed_curves(curves, fates[:2], still=STILL)
    with pytest.raises(ValueError, match=r"films\['x'\] must be of one of \[0, 1, 2\], got 9"):
        seed_curves(curves, fates, still=STILL, films={"x": (9, "")})
    with pytest.raises(ValueError, match="fates must be a table with one row a seed"):
        seed_curves(curves, pd.concat([fates, fates]), still=STILL)


def test_a_knob_has_a_curve_and_a_row_for_each_value():
    curve = pd.DataFrame({"episode": range(1, 301), "median": 1.0, "low": 0.5, "high": 2.0})
    table = pd.DataFrame({"error at the end": [0.123456, 2.0], "share that learned": [0.5, 1]})
    data = inline(knob("σ", [0.3, 1.0], {0.3: curve, 1.0: curve}, table, still=STILL))
    assert data["measures"][0] == {"name": "error at the end", "values": [0.1235, 2]}
    assert len(data["curves"][1]["high"]) == 150
    each = {"error at the end": np.array([[0.1, 0.2, 0.3], [1, 2, 3]])}
    of_seeds = knob("σ", [0.3, 1.0], {0.3: curve, 1.0: curve}, table, still=STILL, seeds=each)
    measure, other = inline(of_seeds)["measures"]
    assert measure["seeds"] == [[0.1, 0.2, 0.3], [1, 2, 3]]
    assert (measure["low"], measure["high"]) == ([0.1, 1], [0.3, 3])
    assert "seeds" not in other
    with pytest.raises(ValueError, match=r"seeds\['error at the end'\] must be for a measure"):
        knob(*("σ", [0.3], {0.3: curve}, table[:1]), still=STILL, seeds=each)
    with pytest.raises(ValueError, match="table must be a table of 1 rows, got 2"):
        knob("σ", [0.3], {0.3: curve}, table, still=STILL)
    with pytest.raises(ValueError, match="values must be in rising order, each once"):
        knob("σ", [1.0, 0.3], {0.3: curve, 1.0: curve}, table, still=STILL)
    with pytest.raises(ValueError, match=r"curves_by_value must be a mapping from \[0.3, 1.0\]"):
        knob("σ", [0.3, 1.0], {0.3: curve}, table, still=STILL)


def test_snapshots_are_kept_as_float32():
    grid = np.random.default_rng(0).uniform(-2, 1, (3, 4))
    data = inline(snapshots({"a": grid, "b": 2 * grid}, x=range(4), y=range(3), still=STILL))
    kept = np.frombuffer(b64decode(data["grids"][0]["values"]), "<f4")
    assert np.array_equal(kept, grid.astype("<f4").ravel())
    assert data["limit"] == np.abs(2 * grid).max()
    assert [it["name"] for it in data["grids"]] == ["a", "b"]
    assert data["mark"] is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": [0, 0, 1, 2]}, "x must be two or more numbers in rising order"),
        ({"grids": {}}, "grids must be a mapping with one snapshot or more"),
        ({"grids": {"a": np.zeros((4, 3))}}, r"grids\['a'\] must be an array .*got \(4, 3\)"),
        ({"limit": 0}, "limit must be a number above 0, got 0"),
    ],
)
def test_snapshots_that_do_not_fit_are_refused(change, message):
    given = {"grids": {"a": np.zeros((3, 4))}, "x": range(4), "y": range(3)}
    with pytest.raises(ValueError, match=message):
        snapshots(**{**given, **change}, still=STILL)
