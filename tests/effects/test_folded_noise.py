"""Noise that straight lines between exchanged pulses leave, against sampled tones and against sums of aliases."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.polynomial import legendre

from bisar_budget.effects.spectra import PowerLawPiece, synchronized_parts

NODES, WEIGHTS = legendre.leggauss(8)
NAMES = ("quadratic", "cubic", "left", "constant", "linear")


def sampled(frequency: float, aperture_time: float, interval: float) -> np.ndarray:
    """Mean squares of the parts of a tone of power 1 less straight lines, moment by moment.

    Lines begin at 64 places of their interval; a cosine and a sine have the mean of all phases.
    """
    t, step = np.linspace(-aperture_time / 2, aperture_time / 2, 20_001, retstep=True)
    weights = np.full(t.size, step / aperture_time)
    weights[[0, -1]] /= 2
    of_order = [legendre.legval(2 * t / aperture_time, np.eye(4)[n]) for n in range(4)]
    found = np.zeros(5)
    for start in (np.arange(64) + 0.5) / 64 * interval:
        knots = np.arange(t[0] - interval + start, t[-1] + 2 * interval, interval)
        for turn in (0.0, math.pi / 2):
            left, at_knots = (np.cos(2 * math.pi * frequency * times + turn) for times in (t, knots))
            left = left - np.interp(t, knots, at_knots)
            c = [(2 * n + 1) * (weights * left) @ of_order[n] for n in range(4)]
            rest = left - sum(one * order for one, order in zip(c, of_order, strict=True))
            found += np.array((2.25 * c[2] ** 2, 6.25 * c[3] ** 2, weights @ rest**2, c[0] ** 2, c[1] ** 2)) / 64
    return found


@pytest.mark.parametrize("frequency", [2.0, 9.0, 50.05, 50.2, 50.6, 52.0, 55.0, 84.9])
def test_a_narrow_piece_is_the_tone_that_is_sampled(frequency: float) -> None:
    """A line of 0.2 % of a hertz: at 50.2 Hz every 100 ms, 0.8 cycles of the aperture had a negative power."""
    width = 0.002
    piece = PowerLawPiece(frequency - width / 2, frequency + width / 2, 1 / width, 0.0)
    found = synchronized_parts([piece], 4.0, 0.1)
    for name, expected in zip(NAMES, sampled(frequency, 4.0, 0.1), strict=True):
        assert getattr(found, name) == pytest.approx(expected, rel=2e-3, abs=1e-5), name


def squares(angle: np.ndarray) -> np.ndarray:
    """Mean squares of the parts of a tone; below 0.1, where the recurrence cancels, the first terms of series."""
    x = np.maximum(np.abs(angle), 0.1)
    j = [np.sin(x) / x, np.sin(x) / x**2 - np.cos(x) / x]
    for n in (1, 2):
        j.append((2 * n + 1) / x * j[n] - j[n - 1])
    exact = np.array((*((7.5 * j[2]) ** 2, (17.5 * j[3]) ** 2), 1 - sum((2 * n + 1) * j[n] ** 2 for n in range(4)),
                      j[0] ** 2, (3 * j[1]) ** 2))  # fmt: skip
    x = np.minimum(np.abs(angle), 0.1)
    slow = np.array((x**4 / 4 * (1 - x**2 / 7), x**6 / 36 * (1 - x**2 / 9), x**8 / 99225, 1 - x**2 / 3 + x**4 / 22.5,
                     x**2 * (1 - x**2 / 5)))  # fmt: skip
    return np.where(np.abs(angle) < 0.1, slow, exact)


def of_aliases(piece: PowerLawPiece, aperture_time: float, interval: float) -> np.ndarray:
    """Integral over what a piece has: each tone where it is, and at every other place it is folded to, one by one."""
    low, high = max(piece.low, 1e-9 * piece.high), piece.high
    step = 1 / max(4 * aperture_time, 8 * interval)
    fall = 1 / max(1.0, abs(piece.slope) / 1.5)
    edges = np.concatenate(
        (
            np.linspace(low, high, 5),
            np.arange(low, high, step),
            np.exp(np.arange(math.log(low), math.log(high), min(fall, 0.4))),
        )
    )
    edges = np.unique(np.clip(edges, low, high))
    f = (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * NODES
    power = np.diff(edges)[:, None] / 2 * WEIGHTS * piece.density * f**-piece.slope
    found = squares(math.pi * f * aperture_time) * (1 - np.sinc(f * interval) ** 2) ** 2
    nearest, most = np.rint(f * interval), max(40, int(60 * interval / aperture_time))
    for m in range(-most, most + 1):
        image = f - (nearest + m) / interval
        folded = np.sinc(image * interval) ** 4 * squares(math.pi * image * aperture_time)
        found += np.where(nearest + m == 0, 0.0, folded)
    return (found * power).sum(axis=(1, 2))


PIECES = [  # beginning and width over it, slope and exchanges per aperture, in rates
    (5.019, 4e-4, 0.0, 40.0),  # 50.19 … 50.21 Hz, 4 s, 100 ms
    (4.97, 0.0201, 0.0, 40.0),
    (8.4, 0.001, 0.0, 40.0),
    (0.1, 9.0, 20.0, 40.0),
    (0.1, 9.0, -20.0, 40.0),
    (1e-4, 1e4, 4.0, 0.2),
    (3.5, 0.2, -3.0, 7.0),
    (1e-3, 2.0, 3.0, 0.1),
    (1.0, 1.0 + 3e-13, 0.0, 1.0),
    (1e-4, 1e4, 3.0, 12.0),
]


def agrees(one: tuple[float, float, float, float], of_power: float) -> None:
    """Hold each part to 1e-4, phases to a share of the power as well."""
    low, width, slope, exchanges = one
    piece = PowerLawPiece(low, low * (1 + width), low**slope, slope)
    found, expected = synchronized_parts([piece], exchanges, 1.0), of_aliases(piece, exchanges, 1.0)
    for name, right in zip(NAMES, expected, strict=True):
        least = 0.0 if name == "left" else of_power * expected[2]
        assert getattr(found, name) == pytest.approx(right, rel=1e-4, abs=least), name


@pytest.mark.parametrize("one", PIECES)
def test_a_piece_is_the_sum_of_its_aliases(one: tuple[float, float, float, float]) -> None:
    agrees(one, 1e-6)


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda power: float(10**power))


@given(st.tuples(powers(-2, 2), powers(-7, 1), st.floats(-24, 24), powers(-1, 1.7)))
def test_any_piece_is_the_sum_of_its_aliases(one: tuple[float, float, float, float]) -> None:
    """Phases are means of whatever turns more than 24 times within the aperture, to 3e-3 of its power."""
    low, width, _, exchanges = one
    assume(low * width * max(4 * exchanges, 8) < 2000)
    agrees(one, 3e-3)


@pytest.mark.parametrize("slope", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("high", [1e2, 1e6])
def test_noise_to_a_million_rates_is_the_sum_of_its_aliases(slope: float, high: float) -> None:
    """Over 4000 exchanges the quadratic phase is that of what is folded to 0 Hz, summed alias by alias."""
    piece = PowerLawPiece(10.0, high, 1.0, slope)
    m = np.arange(10.0, high)
    # Aliases from both sides; at the ends, where noise begins and ends on a whole rate, from one.
    folded = 2 * np.sum(m**-slope) - 10**-slope + high**-slope
    found = synchronized_parts([piece], 4000.0, 1.0)
    alone = 45 / 8 / 4000.0  # of a density of 1, see the constants of the closed form
    assert found.quadratic == pytest.approx(folded * alone, rel=2e-3)
