"""Values of unusual types, to be told by a setting's name or taken as plain ones."""

import re
from decimal import Decimal

import numpy as np
from hypothesis import strategies as st

WIDTHS = [
    *(np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64),
    *(np.float16, np.float32, np.float64, np.longdouble),
]

SCALARS = st.builds(
    lambda kind, value: kind(value), st.sampled_from(WIDTHS), st.sampled_from([0, 1, 2, 3, 60, 100])
)
NUMBERS = st.one_of(
    SCALARS,
    st.fractions(-2, 2),
    st.floats(allow_nan=True, allow_infinity=True),
    st.integers(-3, 10**30),
)
OTHERS = st.one_of(
    st.sampled_from([None, True, False, np.True_, np.False_, 1j, Decimal("0.5"), object(), int]),
    st.sampled_from([np.nan, np.float32("nan"), np.array(1), np.array([0.5]), np.zeros((2, 2))]),
    st.text(max_size=5),
    st.binary(max_size=3),
    st.lists(NUMBERS, max_size=3),
    st.tuples(NUMBERS, NUMBERS),
    st.dictionaries(st.text(max_size=2), NUMBERS, max_size=2),
)
ODD = st.one_of(NUMBERS, OTHERS)
PLAIN = (type(None), bool, int, float, str)


def try_out(make, name, value):
    """Make something with a setting; return it, or None if it was refused in the agreed words."""
    try:
        return make(**{name: value})
    except (TypeError, ValueError) as error:
        told = str(error)
        assert name in re.split("[., ]+", told.partition(" must be ")[0]), told
        assert ", got " in told, told
        return None
