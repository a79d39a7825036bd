"""Types of arrays by what they hold, for type checkers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Integers = NDArray[np.int64]
Words = NDArray[np.uint32]
Bytes = NDArray[np.uint8]

Image = NDArray[np.float32]  # (height, width, channels)
Matrix = NDArray[np.float64]  # (rows, columns)
