"""Type aliases for arrays, and for values that are plain numbers (one case) or arrays (many cases)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Booleans = NDArray[np.bool_]
Indices = NDArray[np.intp]

PerCase = float | Floats
"""A number of one case, or an array with one number per case, (cases,)."""
PerCaseFlag = bool | Booleans
"""A condition of one case, or an array with one condition per case, (cases,)."""
NumbersOrWords = NDArray[Any]
"""A column of a table: numbers in SI, or words."""
Records = NDArray[np.void]
"""Records of a file, with named fields."""


def absolute(value: PerCase) -> PerCase:
    """Absolute value of a number, or of each number of an array."""
    return np.abs(value) if isinstance(value, np.ndarray) else abs(value)
