"""Error-free cross-range responses by their own formulas, not by weights: the sinc, and Taylor's pattern of 1955."""

import math
from typing import Any

import numpy as np

_NBAR, _SIDELOBES_DB = 5, 35.0


def first_null(window: str) -> float:
    """Place of the first null of the error-free response. [resolution cells, λ/2 of aperture]"""
    if window == "uniform":
        return 1.0
    a = math.acosh(10 ** (_SIDELOBES_DB / 20)) / math.pi
    return _NBAR * math.sqrt((a**2 + 0.25) / (a**2 + (_NBAR - 0.5) ** 2))


def pattern(window: str, cells: Any) -> Any:
    """Amplitude of the error-free response at some cells from its peak, over the peak."""
    found = np.sinc(cells)
    if window == "uniform":
        return found
    a, null = math.acosh(10 ** (_SIDELOBES_DB / 20)) / math.pi, first_null(window)
    for n in range(1, _NBAR):  # Taylor's nulls in place of the first four of the sinc
        place = null * math.sqrt((a**2 + (n - 0.5) ** 2) / (a**2 + 0.25))
        found = found * (1 - (cells / place) ** 2) / (1 - (cells / n) ** 2)
    return found


def energy_within(window: str) -> float:
    """Share of the response's energy within its first nulls, to 1e-9: a sum over fine steps, by Parseval over cells.

    Beyond the last cell the nulls of both are those of the sinc, and its tail falls as the square of the place.
    """
    null, step = first_null(window), 1e-5
    inside = np.arange(-null + step / 2, null, step)
    last = 200_000
    cells = np.arange(-last, last) + 0.5  # any places a cell apart
    of_cells = pattern(window, cells) ** 2
    tail = 2 * of_cells[-1] * cells[-1] ** 2 / last
    return float((pattern(window, inside) ** 2).sum() * step / (of_cells.sum() + tail))


def shown_db(variance: float, window: str = "uniform") -> float:
    """ISLR that white noise of a phase variance adds to an image. [dB]"""
    return 10 * math.log10(math.expm1(variance) / energy_within(window))
