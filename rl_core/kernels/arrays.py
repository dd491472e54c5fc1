"""Short names for the types of arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Bools = NDArray[np.bool_]
Ints = NDArray[np.signedinteger]
Arrays = dict[str, NDArray[Any]]
"""Arrays by their names."""

BYTE = np.float32(1 / 255)
"""What a byte of an observation counts."""
