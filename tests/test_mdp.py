"""The MDP: what it accepts, what it refuses and how it says so."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.planning import held_bytes
from rl_core.mdp import MDP


def two_states(**changes: Any) -> MDP:
    """State 0 stays or goes to terminal state 1; two actions."""
    arrays: dict[str, Any] = {
        "successor": np.array([[[0, 1], [1, 0]], [[1, 1], [1, 1]]], dtype=np.int32),
        "probability": np.array([[[0.5, 0.5], [1.0, 0.0]], [[1.0, 0.0], [1.0, 0.0]]]),
        "reward": np.array([[[0.0, 2.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]]]),
        "terminal": np.array([False, True]),
        "start_state": np.array([0], dtype=np.int32),
        "start_probability": np.array([1.0]),
    }
    return MDP(**(arrays | changes))


def random_arrays(seed: int, n_states: int = 6, n_actions: int = 3, k: int = 2) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    shape = (n_states, n_actions, k)
    terminal = rng.random(n_states) < 0.3
    successor = rng.integers(n_states, size=shape)
    successor[terminal] = np.flatnonzero(terminal)[:, None, None]
    return {
        "successor": successor.astype(np.int32),
        "probability": rng.dirichlet(np.ones(k), size=shape[:2]),
        "reward": np.where(terminal[:, None, None], 0.0, rng.normal(size=shape)),
        "terminal": terminal,
        "start_state": np.arange(n_states, dtype=np.int32),
        "start_probability": rng.dirichlet(np.ones(n_states)),
    }


def test_sizes_and_types() -> None:
    model = two_states()
    assert (model.n_states, model.n_actions, model.n_successors) == (2, 2, 2)
    dtypes = {name: getattr(model, name).dtype for name in model.__dataclass_fields__}
    assert dtypes == {
        "successor": np.int32,
        "probability": np.float64,
        "reward": np.float64,
        "terminal": np.bool_,
        "start_state": np.int32,
        "start_probability": np.float64,
    }
    assert held_bytes(model) == 8 * 4 + 8 * 8 + 8 * 8 + 2 + 4 + 8


def test_arrays_are_kept_without_copying_and_cannot_be_written() -> None:
    arrays = random_arrays(0)
    model = MDP(**arrays)
    for name, array in arrays.items():
        kept = getattr(model, name)
        assert np.shares_memory(kept, array)
        assert array.flags.writeable  # the caller's own array is left as it was
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = kept[0]


def test_a_broadcast_probability_is_kept_and_counted_once() -> None:
    row = np.array([0.75, 0.25])
    model = two_states(probability=np.broadcast_to(row, (2, 2, 2)))
    assert model.probability.strides == (0, 0, 8)
    assert held_bytes(model) == 8 * 4 + 2 * 8 + 8 * 8 + 2 + 4 + 8


def test_lists_and_wider_integers_are_converted() -> None:
    model = two_states(
        successor=[[[0, 1], [1, 0]], [[1, 1], [1, 1]]],
        reward=[[[0, 2], [1, 0]], [[0, 0], [0, 0]]],
    )
    assert model.successor.dtype == np.int32
    assert model.reward.dtype == np.float64


def changed(name: str, index: Any, value: Any) -> dict[str, Any]:
    array = np.array(getattr(two_states(), name))
    array[index] = value
    return {name: array}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (changed("probability", (0, 1, 0), 1.5), r"probability.*state 0, action 1, slot 0.*1\.5"),
        (changed("probability", (0, 1, 1), -0.1), r"probability.*state 0, action 1, slot 1.*-0\.1"),
        (changed("probability", (1, 0, 0), np.nan), r"probability.*state 1, action 0, slot 0.*nan"),
        (
            changed("probability", (0, 0, 1), 0.25),
            r"probability.*sum to 1.*state 0, action 0 .*0\.75",
        ),
        (changed("probability", (1, 1, 1), 1e-8), r"probability.*sum to 1.*state 1, action 1"),
        (
            changed("successor", (0, 0, 1), 2),
            r"successor.*from 0 to 1, at state 0.*it is 2",
        ),
        (changed("successor", (0, 1, 0), -1), r"successor.*state 0, action 1, slot 0.*-1"),
        (changed("successor", (1, 1, 0), 0), r"successor of a terminal.*state 1, action 1.* 0"),
        (changed("reward", (0, 1, 1), np.inf), r"reward.*finite.*state 0, action 1, slot 1.*inf"),
        (changed("reward", (0, 0, 0), np.nan), r"reward.*finite.*state 0, action 0, slot 0.*nan"),
        (
            changed("reward", (1, 0, 1), 3.0),
            r"reward of a terminal.*state 1, action 0.* 3\.0",
        ),
        ({"start_state": [2]}, r"start_state must be from 0 to 1, entry 0 is 2"),
        ({"start_state": [-1]}, r"start_state.*entry 0 is -1"),
        ({"start_probability": [0.5]}, r"start_probability must sum to 1.*0\.5"),
        ({"start_probability": [1.5]}, r"start_probability.*entry 0 is 1\.5"),
        ({"start_state": [], "start_probability": []}, r"start_state.*without an empty axis"),
        (
            {"start_state": [0, 0]},
            r"start_probability must be of the shape of start_state, \(2,\), got \(1,\)",
        ),
        ({"terminal": [False]}, r"terminal.*\(2,\).*\(1,\)"),
        ({"reward": np.zeros((2, 2, 1))}, r"reward.*\(2, 2, 2\).*\(2, 2, 1\)"),
        ({"probability": np.ones((2, 2))}, r"probability.*numbers with 3 axes"),
        ({"reward": [[["a"], []]]}, r"reward.*ragged"),
        ({"reward": None}, r"reward must be an array of numbers of shape \(any, any, any\)"),
        ({"successor": np.full((2, 2, 2), 2**40)}, r"successor.*1099511627776"),
        ({"successor": [[[0], [0, 1]]]}, r"successor.*3 axes"),
        ({"successor": np.zeros((0, 2, 2), dtype=np.int32)}, r"successor.*empty"),
    ],
)
def test_what_is_wrong_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        two_states(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"terminal": [0, 1]}, "terminal must be an array of bools with 1 axes, got int64"),
        ({"successor": np.zeros((2, 2, 2))}, "successor must be an array of integers.*float64"),
        ({"reward": np.zeros((2, 2, 2), bool)}, "reward must be an array of numbers .*, got bool"),
        ({"reward": np.full((2, 2, 2), "1")}, "reward must be an array of numbers .*, got <U1"),
    ],
)
def test_arrays_of_the_wrong_type_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        two_states(**changes)


def test_fractions_are_numbers() -> None:
    third = Fraction(1, 3)
    model = two_states(probability=[[[third, 2 * third], [1, 0]], [[1, 0], [1, 0]]])
    assert model.probability[0, 0].tolist() == [1 / 3, 2 / 3]


def test_sums_may_miss_1_by_rounding() -> None:
    two_states(**changed("probability", (0, 1, 1), 9e-10))


@given(seed=st.integers(0, 10**6), data=st.data())
@settings(max_examples=50, deadline=None)
def test_any_single_broken_entry_is_found(seed: int, data: st.DataObject) -> None:
    arrays = random_arrays(seed)
    MDP(**arrays)
    name, value = data.draw(
        st.sampled_from(
            [("successor", 6), ("successor", -1), ("probability", 1.01), ("reward", np.inf)]
        )
    )
    index = tuple(data.draw(st.integers(0, n - 1)) for n in arrays[name].shape)
    arrays[name][index] = value
    s, a, k = index
    with pytest.raises(ValueError, match=f"^{name} .*state {s}, action {a}, slot {k}"):
        MDP(**arrays)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=50, deadline=None)
def test_reachable_states_are_those_of_a_matrix_power(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arrays = random_arrays(seed, n_states=9, n_actions=1)
    keep = rng.random((9, 1)) < 0.7
    arrays["probability"][..., 0] = np.where(keep, 1.0, arrays["probability"][..., 0])
    arrays["probability"][..., 1] = np.where(keep, 0.0, arrays["probability"][..., 1])
    arrays["start_state"] = np.array([1, 4, 4], dtype=np.int32)
    arrays["start_probability"] = np.array([0.5, 0.5, 0.0])
    model = MDP(**arrays)
    link = np.eye(9)
    for s, a, k in np.ndindex(9, 1, 2):
        link[s, model.successor[s, a, k]] += model.probability[s, a, k]
    paths = np.linalg.matrix_power(link, 9)
    np.testing.assert_array_equal(model.reachable_states(), (paths[[1, 4]] > 0).any(axis=0))


def test_a_start_of_probability_0_is_not_reachable() -> None:
    model = two_states(
        successor=np.array([[[0, 0]], [[1, 1]]]),
        probability=np.full((2, 1, 2), 0.5),
        reward=np.zeros((2, 1, 2)),
        start_state=[0, 1],
        start_probability=[1.0, 0.0],
    )
    assert model.reachable_states().tolist() == [True, False]
