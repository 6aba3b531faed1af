"""ISLR that noise adds to an image: drawn phases, transformed here, against the functions that the check uses."""

import math
from functools import cache

import numpy as np
import pytest

from bisar_budget.analysis.spread import islr_db, spread_phase
from bisar_budget.constants import MAINLOBE_ENERGY
from bisar_budget.simulator.image_formation import taylor_window
from tests.responses import energy_within, first_null, pattern

WINDOWS = ("uniform", "taylor")
_CELLS, _FINE, _DRAWS, _PERIODS = 1024, 8, 1500, 8


def weights(window: str) -> np.ndarray:
    return np.ones(_CELLS) if window == "uniform" else taylor_window(_CELLS)


@cache
def left_after_the_cubic(slope: int) -> np.ndarray:
    """Phases with a spectrum f^-slope, without their orders up to 3, of a mean variance of 1, (draws, moments)."""
    rng = np.random.default_rng(slope)
    tones = np.arange(1, _CELLS * _PERIODS // 2)
    size = tones ** (-slope / 2) * rng.standard_normal((2, _DRAWS, tones.size))
    spectrum = np.concatenate([np.zeros((_DRAWS, 1)), size[0] + 1j * size[1]], axis=1)
    drawn = np.fft.irfft(spectrum, _CELLS * _PERIODS)[:, :_CELLS]
    legendre = np.polynomial.legendre.legvander((np.arange(_CELLS) + 0.5) * 2 / _CELLS - 1, 3)
    left = drawn - (legendre @ np.linalg.lstsq(legendre, drawn.T, rcond=None)[0]).T
    return left / math.sqrt(np.mean(left**2))


def added_db(phases: np.ndarray, window: str) -> float:
    """ISLR of the mean image less that of no error, by the transform within a mask of the first nulls. [dB]

    All that is transformed has the power of the signal (Parseval).
    """
    # The mask's edge is a null: what half a fine step holds there is below 1e-3 of the mainlobe.
    mask = round(first_null(window) * _FINE)
    turns = np.multiply.outer(np.arange(_CELLS), np.arange(-mask, mask + 1)) / (_CELLS * _FINE)
    transform = np.exp(-2j * math.pi * turns)

    def islr(signals: np.ndarray) -> float:
        mainlobe = np.sum(np.abs(signals @ transform) ** 2)
        return float(_CELLS * _FINE * np.sum(np.abs(signals) ** 2) / mainlobe - 1)

    clean = islr(weights(window)[None])
    return 10 * math.log10(islr(weights(window) * np.exp(1j * phases)) - clean)


@pytest.mark.parametrize("window", WINDOWS)
def test_the_energy_within_the_first_nulls(window: str) -> None:
    """By the pattern itself, and by a transform of the weights of the simulator, of 4096 cells in 64 parts each."""
    null = first_null(window)
    assert pattern(window, null + 1e-9) == pytest.approx(0, abs=1e-8)
    assert MAINLOBE_ENERGY[window] == pytest.approx(energy_within(window), rel=2e-6)
    tapered = taylor_window(4096) if window == "taylor" else np.ones(4096)
    power = np.abs(np.fft.fft(tapered, 4096 * 64)) ** 2
    within = 2 * power[: int(null * 64) + 1].sum() - power[0]
    assert MAINLOBE_ENERGY[window] == pytest.approx(within / power.sum(), rel=1e-4)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("variance", [0.001, 0.01, 0.1])
def test_white_noise_shows_what_the_function_says(window: str, variance: float) -> None:
    """White: 0.44 dB above exp(σ²) - 1 with a uniform window, 0.01 dB with Taylor's."""
    shown = added_db(math.sqrt(variance) * left_after_the_cubic(0), window)
    assert shown == pytest.approx(islr_db(variance, "full", MAINLOBE_ENERGY[window]), abs=0.03)
    excess = shown - 10 * math.log10(math.expm1(variance))
    assert excess == pytest.approx(0.44 if window == "uniform" else 0.01, abs=0.03)


@pytest.mark.parametrize("slope", [1, 2, 3, 4])
def test_noise_of_any_slope_shows_it_with_a_uniform_window_and_no_more_with_taylor(slope: int) -> None:
    """Slow noise, left after the cubic, lies at the ends of the aperture, which Taylor's weights hold down."""
    phases = math.sqrt(0.01) * left_after_the_cubic(slope)
    uniform, taylor = (added_db(phases, w) - islr_db(0.01, "full", MAINLOBE_ENERGY[w]) for w in WINDOWS)
    assert abs(uniform) < 0.25  # of 1500 draws whose powers spread by 0.9: two standard errors, 0.2 dB
    assert -2 < taylor < 0.15


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("window", WINDOWS)
def test_phase_and_level_are_inverses_of_floats_and_arrays(model: str, window: str) -> None:
    energy = MAINLOBE_ENERGY[window]
    levels = np.array([-60.0, -20.0, -3.0])
    phases = spread_phase(10 ** (levels / 10), model, energy)
    assert islr_db(phases**2, model, energy) == pytest.approx(levels, abs=1e-9)
    for level, phase in zip(levels.tolist(), phases.tolist(), strict=True):
        assert spread_phase(10 ** (level / 10), model, energy) == pytest.approx(phase, rel=1e-14)
        assert islr_db(phase**2, model, energy) == pytest.approx(level, abs=1e-9)
    assert islr_db(1e6, model, energy) == pytest.approx(
        60.0 if model == "published" else 1e7 / math.log(10), rel=1e-6
    )
