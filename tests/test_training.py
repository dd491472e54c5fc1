"""The loop over seeds: what it counts, keeps, tells and refuses."""

import numpy as np
import pandas as pd
import pytest

from rl_core.training import Failure, Training, spawn_streams, train_seeds, weights_of

COLUMNS = {
    "seed": "int64",
    "episode": "int64",
    "steps": "int64",
    "return": "float64",
    "terminated": "bool",
    "env_steps": "int64",
}


def walk(training):
    """Episodes of random lengths; what is learned is their number and a draw."""
    rng = spawn_streams(training.seed).policy
    weights = {"w": np.zeros(2), "n": np.array(0)}
    for episode in training.course(None, lambda: weights):
        steps = int(rng.integers(1, 50))
        training.add(steps, -float(steps), steps < 25)
        weights["w"][:], weights["n"] = rng.random(2), np.array(episode)


def stopping(at, reason="tired"):
    """Fails in episode `at` of seed 1."""

    def train(training):
        for episode in training.course(None, lambda: {"w": np.array(training.seed)}):
            training.add(3, 1.0, True)
            if (training.seed, episode) == (1, at):
                training.fail(reason)
                training.fail("only the first reason counts")

    return train


# Streams


def test_streams_differ_from_each_other_and_between_seeds():
    draws = [stream.random() for seed in range(20) for stream in spawn_streams(seed)[1:]]
    environments = [spawn_streams(seed).environment_seed for seed in range(20)]
    assert len(set(draws)) == 60
    assert len(set(environments)) == 20
    assert environments == [spawn_streams(seed).environment_seed for seed in range(20)]


# Tables and arrays


def test_a_row_an_episode_with_the_columns_agreed():
    table = train_seeds(walk, episodes=3, seeds=[4, 2]).table
    assert [(name, str(dtype)) for name, dtype in table.dtypes.items()] == list(COLUMNS.items())
    assert table["seed"].tolist() == [4, 4, 4, 2, 2, 2]
    assert table["episode"].tolist() == [1, 2, 3] * 2
    np.testing.assert_array_equal(table["env_steps"], table.groupby("seed")["steps"].cumsum())


def test_a_seed_is_the_same_alone_and_among_others():
    together = train_seeds(walk, episodes=5, seeds=[3, 0, 7], snapshots=(2,))
    for position, seed in enumerate([3, 0, 7]):
        alone = train_seeds(walk, episodes=5, seeds=[seed], snapshots=(2,))
        rows = together.table[together.table["seed"] == seed].reset_index(drop=True)
        pd.testing.assert_frame_equal(rows, alone.table, check_exact=True)
        for name, array in together.arrays.items():
            np.testing.assert_array_equal(array[position], alone.arrays[name][0])


def test_arrays_are_named_by_moment_and_stacked_by_seed():
    arrays = train_seeds(walk, episodes=4, seeds=[0, 1], snapshots=(3, 0, 3)).arrays
    moments = ("", "initial/", "episode3/")
    assert set(arrays) == {moment + name for moment in moments for name in "wn"}
    assert arrays["w"].shape == (2, 2)
    assert arrays["n"].tolist() == [4, 4]
    assert arrays["episode3/n"].tolist() == [3, 3]
    assert arrays["initial/n"].tolist() == [0, 0]


def test_what_is_kept_is_a_copy():
    training, weights = Training(0, 1, (), lambda episodes, steps: None), np.zeros(2)
    for _ in training.course(None, lambda: {"w": weights}):
        weights[:] += 1
    assert training.kept["initial/"]["w"].tolist() == [0, 0]
    weights += 1
    assert training.kept[""]["w"].tolist() == [1, 1]


# Ends


def test_a_failure_ends_its_seed_and_no_other():
    run = train_seeds(stopping(3), episodes=5, seeds=[0, 1, 2])
    assert run.failures == (Failure(1, 3, "tired"),)
    assert run.table["seed"].value_counts().sort_index().tolist() == [5, 3, 5]
    assert run.arrays["w"].tolist() == [0, 1, 2]


@pytest.mark.parametrize("total", [np.nan, np.inf, -np.inf])
def test_a_return_that_is_not_finite_is_a_failure(total):
    def train(training):
        for episode in training.course(None, dict):
            training.add(1, total if episode == 2 else 0.0, True)

    run = train_seeds(train, episodes=9, seeds=[5])
    assert run.failures == (Failure(5, 2, f"the return is {total}"),)
    assert len(run.table) == 2


def test_a_snapshot_never_reached_is_the_last_moment():
    def train(training):
        count = np.zeros(1)
        for _ in training.course(25, lambda: {"n": count}):
            training.add(10, 0.0, True)
            count[:] += 1

    run = train_seeds(train, episodes=9, seeds=[0], snapshots=(2, 8))
    assert len(run.table) == 3
    assert (run.arrays["episode2/n"].item(), run.arrays["episode8/n"].item()) == (2, 3)


def test_a_weight_that_is_not_finite_ends_the_seed():
    def train(training):
        weight = np.zeros(2)
        for episode in training.course(None, lambda: {"w": weight}):
            training.add(1, 0.0, True)
            weight[1] = np.nan if episode == 3 else 0.0

    run = train_seeds(train, episodes=9, seeds=[5])
    assert run.failures == (Failure(5, 3, "a weight is not finite"),)


def test_a_learner_that_does_not_go_through_the_course_is_refused():
    with pytest.raises(ValueError, match=r"^train must be a function that goes through .*, got "):
        train_seeds(lambda training: None, episodes=9, seeds=[5])


def test_an_episode_stops_at_the_least_of_the_limits_and_of_what_is_left():
    training = Training(0, 9, (), lambda episodes, steps: None)
    for episode in training.course(25, dict):
        assert training.max_steps(None) == 25 - training.env_steps
        assert training.max_steps(7, None) == min(7, 25 - training.env_steps)
        training.add(10 if episode < 3 else training.max_steps(None), 0.0, False)
    assert training.table()["env_steps"].tolist() == [10, 20, 25]


# Progress


def test_progress_counts_everything_and_a_seed_that_ended_early_as_done():
    seen = []
    train = stopping(12)
    run = train_seeds(train, episodes=25, seeds=[0, 1], progress=lambda *at: seen.append(at))
    assert seen == [(10, 30), (20, 60), (25, 75), (35, 105), (50, 75 + 36)]
    assert seen[-1][1] == run.table.groupby("seed")["env_steps"].max().sum()


# Weights of one seed


def test_weights_of_one_seed_and_moment():
    run = train_seeds(walk, episodes=4, seeds=[5, 3], snapshots=(2,))
    found = weights_of(run.arrays, 1, "episode2/")
    assert set(found) == {"w", "n"}
    np.testing.assert_array_equal(found["w"], run.arrays["episode2/w"][1])
    assert weights_of(run.arrays, 0)["n"] == 4
    assert weights_of(run.arrays, 0, "initial")["n"] == 0


@pytest.mark.parametrize(
    ("position", "kind"), [(2, ValueError), (-1, ValueError), (None, TypeError), (0.5, TypeError)]
)
def test_a_seed_that_was_not_run_is_refused(position, kind):
    arrays = {"w": np.zeros((2, 3))}
    message = f"^position must be an integer from 0 to 1, got {position}"
    with pytest.raises(kind, match=message):
        weights_of(arrays, position)


def test_a_moment_that_was_not_kept_is_refused():
    with pytest.raises(ValueError, match=r"^moment must be .*, got 'episode7/'"):
        weights_of({"w": np.zeros((2, 3))}, 0, "episode7/")
    with pytest.raises(TypeError, match=r"^arrays must be a mapping of names to arrays, got None"):
        weights_of(None, 0)


# Bad input


@pytest.mark.parametrize(
    ("argument", "value", "kind"),
    [
        ("seeds", [], ValueError),
        ("seeds", [1, 1], ValueError),
        ("seeds", [-1], ValueError),
        ("seeds", [0.5], TypeError),
        ("seeds", [True], TypeError),
        ("seeds", 5, TypeError),
        ("seeds", None, TypeError),
        ("episodes", 0, ValueError),
        ("episodes", 2.5, TypeError),
        ("snapshots", (11,), ValueError),
        ("snapshots", (-1,), ValueError),
        ("snapshots", 5, TypeError),
        ("snapshots", (2 * n for n in range(9)), ValueError),
        ("progress", 5, TypeError),
    ],
)
def test_an_argument_out_of_range_is_refused_before_anything_runs(argument, value, kind):
    def refuse(training):
        raise AssertionError("a seed was trained")

    arguments = {"episodes": 10, "seeds": [0], argument: value}
    with pytest.raises(kind, match=rf"^{argument} must be .*, got "):
        train_seeds(refuse, **arguments)


def test_generators_of_seeds_and_snapshots_are_not_used_up():
    run = train_seeds(walk, episodes=2, seeds=(n for n in (1, 2)), snapshots=(n for n in (1, 2)))
    assert run.arrays["episode1/n"].tolist() == [1, 1]
