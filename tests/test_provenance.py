"""Whatever decides a result's bits is told apart, and nothing else."""

import dataclasses
import json
import math
import sys

import gymnasium
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rl_core.provenance import (
    canonical_json,
    describe,
    digest,
    environment_modules,
    processor,
    versions,
)

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=10,
)


@dataclasses.dataclass(frozen=True)
class Greedy:
    """A rule with a number."""

    value: float = 0.1


@dataclasses.dataclass(frozen=True)
class Softmax:
    """Another rule with a number of the same name."""

    value: float = 0.1


@dataclasses.dataclass(frozen=True)
class Config:
    """A config with other things in it."""

    rule: object = dataclasses.field(default_factory=Greedy)
    hidden: tuple[int, ...] = (10, 20)


@given(values)
def test_descriptions_survive_json(value):
    description = describe(value)
    assert json.loads(canonical_json(description)) == description


@given(st.dictionaries(st.text(), st.integers(), min_size=2))
def test_the_order_of_keys_does_not_matter(value):
    backwards = dict(reversed(list(value.items())))
    assert digest(describe(value)) == digest(describe(backwards))


@given(st.floats(), st.floats())
def test_floats_are_told_apart_to_the_last_bit(a, b):
    same = (a == b and math.copysign(1, a) == math.copysign(1, b)) or (a != a and b != b)
    assert (digest(describe(a)) == digest(describe(b))) == same


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (Config(rule=Greedy()), Config(rule=Softmax())),
        (Config(hidden=(10,)), Config(hidden=(10, 20))),
        (1, True),
        (1, 1.0),
        ("1", 1),
        (None, "null"),
        (math.inf, "inf"),
        (Config(hidden=((1,), 2)), Config(hidden=(1, 2))),
    ],
)
def test_different_values_have_different_digests(a, b):
    assert digest(describe(a)) != digest(describe(b))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (Config(rule=print), r"config\.rule is <built-in function print>"),
        (Config(rule={"a": [1, {2}]}), r"config\.rule\['a'\]\[1\] is \{2\} of type set"),
        (Config(rule={1: 2}), r"config\.rule is \{1: 2\} of type dict"),
        (b"bytes", "config is b'bytes' of type bytes; allowed are"),
        (Config, "config is <class"),
    ],
)
def test_what_cannot_be_told_apart_is_refused(value, message):
    with pytest.raises(TypeError, match=message):
        describe(value)


def test_versions_are_those_that_run():
    import numba
    import numpy
    import pandas
    import torch

    assert versions() == {
        "python": ".".join(map(str, sys.version_info[:3])),
        "gymnasium": gymnasium.__version__,
        "numba": numba.__version__,
        "numpy": numpy.__version__,
        "pandas": pandas.__version__,
        "torch": torch.__version__,
    }


def test_the_processor_has_a_name():
    assert processor().strip()


def test_environments_name_their_modules():
    assert environment_modules("Acrobot-v1") == []
    assert environment_modules("no such environment") == []
    assert environment_modules("rl_core:rl_core/Maze-v0") == ["rl_core", "rl_core.maze"]
    gymnasium.register("TestProvenance-v0", entry_point=Greedy)
    try:
        assert environment_modules("TestProvenance-v0") == [__name__]
    finally:
        del gymnasium.registry["TestProvenance-v0"]
