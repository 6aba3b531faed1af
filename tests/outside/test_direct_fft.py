"""Effect of a quadratic phase on a point response: a direct FFT of the aperture against the package's measures.

The FFT reads 2 048 samples of the aperture at 1 024 points per resolution cell, with the window of SciPy, and uses
nothing of the package. The package measures a cut of 256 samples, eight to a cell, and interpolates it: to 1e-4 dB at
the peak and 2e-5 of a width. The sampling of the aperture makes the rest of the tolerances.
"""

import math
from functools import cache
from importlib.metadata import version

import numpy as np
import pytest
from scipy import signal

from bisar_budget.simulator.image_formation import taylor_window
from bisar_budget.simulator.impulse_response import impulse_response
from tests.outside.record import compare

SAMPLES, FINE = 2048, 1024
SOURCE, RELEASE = "direct FFT, with the windows of SciPy", version("scipy")


@cache
def directly(qpe: float, window: str) -> tuple[float, float, float]:
    """Peak [dB], width at half power [cells] and highest sidelobe [dB] of an aperture.

    The sidelobe is the highest beyond the first null of the response without error, over the peak there is.
    """
    place = (np.arange(SAMPLES) + 0.5) / SAMPLES * 2 - 1
    weights = np.ones(SAMPLES) if window == "uniform" else signal.windows.taylor(SAMPLES, 5, 35, norm=False)
    weights = weights / weights.mean()

    def power(phase: float) -> np.ndarray:
        # A cell is 1/aperture; so many zeros behind put FINE points on it. The first 16 cells are all that is read.
        return np.abs(np.fft.fft(weights * np.exp(1j * phase * place**2), SAMPLES * FINE)[: 16 * FINE] / SAMPLES) ** 2

    clean, found = power(0.0), power(qpe)
    null = int(np.argmax((clean[1:-1] < clean[:-2]) & (clean[1:-1] < clean[2:]))) + 1
    top = found.max()
    below = np.nonzero(found >= top / 2)[0].max()
    edge = below + (found[below] - top / 2) / (found[below] - found[below + 1])
    return 10 * math.log10(top), 2 * float(edge) / FINE, 10 * math.log10(found[null:].max() / top)


def by_the_package(qpe: float, window: str) -> tuple[float, float, float]:
    count, fold = 256, 8
    place = (np.arange(count) + 0.5) / count * 2 - 1
    weights = np.ones(count) if window == "uniform" else taylor_window(count)

    def cut(phase: float) -> np.ndarray:
        aperture = np.zeros(count * fold, dtype=complex)
        aperture[:count] = weights * np.exp(1j * phase * place**2) / count
        return np.fft.fftshift(np.fft.fft(aperture))

    clean = impulse_response(cut(0.0), 1 / fold)
    found = impulse_response(cut(qpe), 1 / fold, mask_m=clean.mask_m)
    return 20 * math.log10(found.peak), found.irw_m, found.pslr_db


# At π the peak of a uniform aperture has split in two, and what the width and the highest sidelobe are is a matter of
# where one counts: tests of the impulse response have those.
@pytest.mark.parametrize("window", ["uniform", "Taylor -35 dB"])
@pytest.mark.parametrize(
    ("said", "qpe"), [("0", 0.0), ("π/8", math.pi / 8), ("π/4", math.pi / 4), ("π/2", math.pi / 2)]
)
def test_a_quadratic_phase(said: str, qpe: float, window: str) -> None:
    there, here = directly(qpe, window), by_the_package(qpe, window)
    compare(f"{window}, QPE {said}: peak", there[0], here[0], "dB", 5e-4, SOURCE, RELEASE)
    compare(f"{window}, QPE {said}: width at half power", there[1], here[1], "cells", 5e-4, SOURCE, RELEASE)
    # A tapered response has its shoulder at the null, which the FFT has to 1/1024 of a cell: 0.01 dB of its slope.
    compare(f"{window}, QPE {said}: PSLR", there[2], here[2], "dB", 0.015, SOURCE, RELEASE)
