"""Normal draws compiled by Numba (extra `fast`): those of NumPy to the last bit, in two thirds of the time."""

import numpy as np
from numba import njit

from bisar_budget.monte_carlo.variables import Floats


@njit(cache=True, nogil=True)
def fill_normal(generator: np.random.Generator, out: Floats) -> None:
    """Draw standard normal numbers into an array (draws,), as `generator.standard_normal(out=out)`."""
    for index in range(out.size):
        out[index] = generator.standard_normal()
