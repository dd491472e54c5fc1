"""One wording for every argument, and values as compiled code and the store take them."""

import math
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rl_core import checks

WORDING = r"(?s)^x must be .*, got "


@given(st.integers(-(2**63), 2**63 - 1), st.integers(0, 100), st.integers(0, 100))
def test_an_integer_is_let_through_just_where_it_lies_in_the_range(value, least, more):
    if least <= value <= least + more:
        assert checks.integer("x", value, least, least + more) == value
    else:
        with pytest.raises(ValueError, match=rf"^x must be an integer from {least} to"):
            checks.integer("x", value, least, least + more)


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int16, np.int32, np.uint64, int])
def test_integers_of_every_width_become_pythons(kind):
    found = checks.integer("x", kind(100))
    assert found == 100
    assert type(found) is int


@pytest.mark.parametrize("value", [True, np.True_, 2.0, np.float64(2), "2", None, [2], 1j])
def test_what_is_no_integer_is_of_the_wrong_type(value):
    with pytest.raises(TypeError, match=WORDING):
        checks.integer("x", value)


def test_an_integer_that_no_table_holds_is_refused():
    with pytest.raises(ValueError, match=r"below 2\*\*63, got 9223372036854775808$"):
        checks.integer("x", 2**63)
    assert checks.integer("x", 2**63 - 1) == checks.LARGEST_INTEGER


@given(st.floats(allow_nan=True), st.floats(-10, 10), st.floats(0, 10))
def test_a_number_is_let_through_just_where_it_lies_in_the_range(value, low, more):
    if low <= value <= low + more:
        assert checks.number("x", value, low, low + more) == value
    else:
        with pytest.raises(ValueError, match=rf"^x must be a number from {low:g} to "):
            checks.number("x", value, low, low + more)


@pytest.mark.parametrize("value", [0.5, np.float16(0.5), np.float32(0.5), Fraction(1, 2)])
def test_numbers_of_every_kind_become_pythons(value):
    assert type(checks.number("x", value, 0, 1)) is float
    assert checks.number("x", value, 0, 1) == 0.5


@pytest.mark.parametrize("value", [True, np.False_, "high", None, [0.5], 1j, Decimal("0.5")])
def test_what_is_no_real_number_is_of_the_wrong_type(value):
    with pytest.raises(TypeError, match=WORDING):
        checks.number("x", value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 10**400])
def test_what_is_not_finite_is_no_number(value):
    with pytest.raises(ValueError, match=r"^x must be a finite number, got "):
        checks.number("x", value)


@pytest.mark.parametrize(
    ("bounds", "allowed"),
    [
        ({}, "a finite number"),
        ({"low": 0}, "a finite number from 0"),
        ({"high": 2}, "a finite number up to 2"),
        ({"low": 0, "high": 1}, "a number from 0 to 1"),
        ({"above": 0}, "a finite number above 0"),
        ({"above": 0, "high": 1}, "a number above 0 up to 1"),
        ({"low": 0, "below": 1}, "a number from 0 below 1"),
    ],
)
def test_ranges_in_words(bounds, allowed):
    with pytest.raises(ValueError, match=rf"^x must be {allowed}, got nan$"):
        checks.number("x", math.nan, **bounds)


@pytest.mark.parametrize(("edge", "value"), [("above", 0.0), ("below", 0.0)])
def test_open_ends_are_left_out(edge, value):
    with pytest.raises(ValueError, match=WORDING):
        checks.number("x", value, **{edge: 0.0})
    assert checks.positive("x", 5e-324) == 5e-324


def test_truth_is_a_bool():
    assert checks.truth("x", np.True_) is True
    for value in (1, 0, None, "yes", 0.5):
        with pytest.raises(TypeError, match=r"^x must be a bool, got "):
            checks.truth("x", value)


@pytest.mark.parametrize(
    ("value", "kind"),
    [("c", ValueError), (1, TypeError), (None, TypeError), (np.array(["a", "b"]), TypeError)],
)
def test_another_word_is_refused_with_those_allowed(value, kind):
    with pytest.raises(kind, match=r"^x must be one of 'a', 'b', got "):
        checks.one_of("x", value, ("a", "b"))


def test_optional_says_that_none_is_allowed_and_keeps_the_kind_of_error():
    assert checks.optional("x", None, checks.integer, 1) is None
    assert checks.optional("x", np.int8(3), checks.integer, 1) == 3
    with pytest.raises(ValueError, match=r"^x must be an integer from 1 or None, got 0$"):
        checks.optional("x", 0, checks.integer, 1)
    with pytest.raises(TypeError, match=r"^x must be an integer from 1 or None, got 1\.5$"):
        checks.optional("x", 1.5, checks.integer, 1)


@pytest.mark.parametrize("values", [5, None, "123", b"123"])
def test_integers_come_in_a_sequence(values):
    with pytest.raises(TypeError, match=r"^x must be a sequence of integers from 0, got "):
        checks.integers("x", values)


@given(st.lists(st.integers(-3, 5)))
def test_seeds_are_distinct_and_not_negative(seeds):
    if seeds and min(seeds) >= 0 and len(set(seeds)) == len(seeds):
        assert checks.distinct_seeds(np.array(seeds)) == tuple(seeds)
        assert checks.distinct_seeds(iter(seeds)) == tuple(seeds)
    else:
        with pytest.raises(ValueError, match=r"^seeds must be "):
            checks.distinct_seeds(seeds)


def test_a_generator_is_numpys():
    rng = np.random.default_rng(0)
    assert checks.generator("x", rng) is rng
    for value in (0, None, np.random.RandomState(0)):
        with pytest.raises(TypeError, match=r"^x must be a numpy\.random\.Generator, got "):
            checks.generator("x", value)


@pytest.mark.parametrize("given_", [[1, 2], (1.0, 2.0), np.array([1, 2], np.uint8), [True, 2]])
def test_numbers_become_a_new_float64_array(given_):
    found = checks.floats("x", given_, (2,))
    assert found.dtype == np.float64
    assert found.tolist() == [1, 2]
    assert not np.shares_memory(found, given_)


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([[1, 2], [3]], ValueError),  # ragged
        ([1, 2, 3], ValueError),
        ([[1, 2]], ValueError),
        (5, ValueError),
        (["a", "b"], TypeError),
        ([{}, 1], TypeError),
        ([1j, 2], TypeError),
        (np.array(["2020-01-01", "2020-01-02"], "datetime64[D]"), TypeError),
    ],
)
def test_an_array_of_something_else_is_refused(values, kind):
    with pytest.raises(kind, match=r"(?s)^x must be an array of numbers of shape \(2\), got "):
        checks.floats("x", values, (2,))


def test_an_entry_that_is_not_finite_is_told_with_its_place():
    with pytest.raises(ValueError, match=r"^x must be finite, at \(1, 0\) it is inf$"):
        checks.floats("x", [[0, 0], [np.inf, 0]], (None, 2))
    np.testing.assert_array_equal(checks.floats("x", [np.inf], (1,), finite=False), [np.inf])
    with pytest.raises(ValueError, match=r"^x must be without NaN, at \(0,\) it is nan$"):
        checks.floats("x", [np.nan], (1,), finite=False)


def test_fields_keep_what_the_checks_return():
    @dataclass(frozen=True)
    class Settings:
        gamma: float = 0.9
        widths: tuple[int, ...] = (3,)

        def __post_init__(self):
            checks.fields(self, gamma=(checks.number, 0, 1), widths=(checks.integers, 1))

    found = Settings(np.float32(0.5), [np.int64(2)])
    assert found == Settings(0.5, (2,))
    assert (type(found.gamma), type(found.widths), type(found.widths[0])) == (float, tuple, int)
    with pytest.raises(ValueError, match=r"^gamma must be a number from 0 to 1, got 2$"):
        Settings(2)


def test_a_long_value_is_cut_in_the_message():
    with pytest.raises(ValueError, match=r"^x must be short, got ") as caught:
        checks.require(False, "x", "a" * 10_000, "short")
    assert len(str(caught.value)) < 300


def test_an_integer_that_no_float_holds_is_refused_by_name():
    with pytest.raises(ValueError, match=r"^x must be .*, got array\(\[1000000"):
        checks.floats("x", [10**400], (1,))
