"""Whatever decides a result's bits is told apart, and nothing else."""

import dataclasses
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rl_core.identity import canonical_json, describe, digest

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
        (Config(rule=lambda: 1), r"config\.rule must be .* can be imported .*, got <function"),
        (Config(rule={"a": [1, {2}]}), r"config\.rule\['a'\]\[1\] must be made of .*, got \{2\}"),
        (Config(rule={1: 2}), r"config\.rule must be made of .*, got \{1: 2\} of type dict"),
        (b"bytes", "config must be made of .*, got b'bytes' of type bytes"),
    ],
)
def test_what_cannot_be_told_apart_is_refused(value, message):
    with pytest.raises(TypeError, match=message):
        describe(value)


def test_classes_and_functions_are_named_by_where_they_are():
    modules = set()
    assert describe([canonical_json, Greedy], modules=modules) == [
        {"import": "rl_core.identity:canonical_json"},
        {"import": f"{__name__}:Greedy"},
    ]
    assert describe(Config(), modules=modules)["rule"]["class"].startswith(f"{__name__}:")
    assert modules == {"rl_core.identity", __name__}
