"""Phase noise drawn from few numbers has the covariance of all its tones."""

import math

import numpy as np
import pytest
from numpy.polynomial import legendre

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.spectra import PowerLawPiece
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.phase_history import Floats
from bisar_budget.simulator.realisations import (
    _between_exchanges,
    _Tones,
    oscillator_sinusoids,
    phase_courses,
    powers_at,
    tones_at,
)
from tests.conftest import mission_text

FLICKER = (PowerLawPiece(0.0, 5000.0, 1e-3, 1.0), PowerLawPiece(0.0, 5000.0, 1e-7, 0.0))


def covariance(powers: Floats, turns: Floats) -> Floats:
    """Sum of the tones 1, 2 … of random phase: Σ P·cos(2πk·turns), one tone at a time."""
    found = np.zeros(turns.shape)
    for k, power in enumerate(powers, 1):
        found += power * np.cos(2 * math.pi * k * turns)
    return found


@pytest.mark.parametrize("tones", [3, 31, 32, 33, 64, 1000])
@pytest.mark.parametrize("count", [2, 4, 64])
def test_folded_powers_have_the_covariance_of_all_tones(tones: int, count: int) -> None:
    """Tones below, at and many times beyond half the rate of the moments."""
    powers = np.random.default_rng(tones).random(tones)
    turns = np.arange(count) / count
    folded = powers_at(powers, count)
    assert folded.shape == (count // 2 + 1,)
    assert folded[0] + covariance(folded[1:], turns) == pytest.approx(covariance(powers, turns), abs=1e-9 * tones)


@pytest.mark.parametrize("count", [4, 12, 1024])
def test_folded_tones_are_their_sum(count: int) -> None:
    rng = np.random.default_rng(count)
    cosine, sine = rng.standard_normal((2, 300))
    turns = np.multiply.outer(np.arange(count) / count, np.arange(1, 301))
    together = np.cos(2 * math.pi * turns) @ cosine + np.sin(2 * math.pi * turns) @ sine
    assert tones_at(cosine - 1j * sine, count) == pytest.approx(together, abs=1e-9)


def second_moments(drawn: Floats) -> Floats:
    return drawn.T @ drawn / len(drawn)


@pytest.mark.parametrize("later", [None, 1e-3, 0.3])
def test_draws_have_the_covariance_of_the_spectrum(later: float | None) -> None:
    """At 16 moments, of tones 80 times as fast, and of their change in a delay: S·4 sin²(πfτ).

    20 000 draws know a product of two to 0.7 % of the variance; 4.5 of those, for 256 products.
    """
    times = np.linspace(-0.5, 0.5, 17)[:-1] + 1 / 32
    tones = _Tones(FLICKER, 1.0)
    slow, fast = (np.square(one) for one in (tones.slow_size, tones.fast_size))
    frequency, power = np.concatenate((tones.slow, tones.fast)), np.concatenate((slow, fast))
    if later is not None:
        power = power * 4 * np.sin(math.pi * frequency * later) ** 2
    lags = np.subtract.outer(times, times)
    expected = np.tensordot(power, np.cos(2 * math.pi * np.multiply.outer(frequency, lags)), axes=1)
    drawn = tones.at(times, 20_000, np.random.default_rng(6), later)
    assert second_moments(drawn) == pytest.approx(expected, abs=0.032 * float(expected.max()))


@pytest.mark.parametrize("interval", [0.003, 0.13, 0.8, 3.0])
def test_exchanges_leave_what_they_leave_of_each_tone(interval: float) -> None:
    """A tone of random phase leaves its power times |1 − line|², in the mean of all places in an interval.

    1 500 draws of 64 moments; slow tones of one draw are alike at all moments, so that 3 % are known; 3 of those.
    """
    times = np.linspace(-0.5, 0.5, 65)[:-1] + 1 / 128
    pieces = (PowerLawPiece(0.2, 400.0, 1e-3, 1.0), PowerLawPiece(0.2, 400.0, 1e-5, 0.0))
    drawn = _between_exchanges(pieces, 1.0, interval, times, 1500, np.random.default_rng(7))
    frequency = np.geomspace(0.2, 400, 4001)
    density = 1e-3 / frequency + 1e-5
    place = (np.arange(64) + 0.5) / 64
    turn = 2j * math.pi * np.multiply.outer(frequency * interval, place)
    line = (1 - place) + place * np.exp(2j * math.pi * frequency * interval)[:, None]
    left = np.mean(np.abs(np.exp(turn) - line) ** 2, axis=1)
    assert float(np.mean(drawn**2)) == pytest.approx(float(np.trapezoid(density * left, frequency)), rel=0.09)


def test_a_tone_of_an_oscillator_is_flown_from_one_cycle_per_aperture_on() -> None:
    """Of 6 s: 0.1 Hz turns 0.6 times and is drawn, 2 Hz turns twelve times."""
    shake = {"sinusoidal": [{"amplitude": "1 um", "frequency": f} for f in ("0.1 Hz", "2 Hz")]}
    part = {"power_law": {"h0": 1e-26}, "acceleration_sensitivity": "1e-9 /g", "vibration": shake}
    mission = parse_mission(mission_text(platforms__receiver__oscillator=part), "m.yaml")
    (flown,) = oscillator_sinusoids(mission, "receiver")
    assert flown.frequency == 2.0
    # Δφ = Γ f₀ a/f, as a motion of λ/2π times as much; a = (2πf)² 1 µm.
    a = (2 * math.pi * 2) ** 2 * 1e-6
    assert flown.amplitude == pytest.approx(SPEED_OF_LIGHT_MPS / (2 * math.pi) * 1e-9 / 9.80665 * a / 2, rel=1e-9)


@pytest.mark.parametrize("frequency", [9.96, 50.2, 1000.205])
def test_a_narrow_piece_flies(frequency: float) -> None:
    """20 mHz within the 62 mHz between tones of a period: none of it was flown.

    2 000 draws know a sigma to 1.6 %; what is left after the cubic of 4 s is that of the tone, sampled each 100 ms.
    """
    times, power = np.linspace(-2, 2, 4097), 50.0
    piece = PowerLawPiece(frequency - 0.01, frequency + 0.01, power, 0.0)
    drawn = _between_exchanges((piece,), 4.0, 0.1, times, 2_000, np.random.default_rng(1))
    expected = np.zeros(2)
    for start in np.arange(16) / 160:
        knots = np.arange(-2.1 + start, 2.2, 0.1)
        for turn in (0.0, math.pi / 2):
            left, at_knots = (np.cos(2 * math.pi * frequency * t + turn) for t in (times, knots))
            left = left - np.interp(times, knots, at_knots)
            expected += np.array((np.mean(left**2), legendre.legfit(times / 2, left, 3)[2] ** 2)) / 16
    quadratic = legendre.legfit(times / 2, drawn.T, 3)[2]
    assert np.sqrt(np.mean(drawn**2)) == pytest.approx(math.sqrt(expected[0]), rel=0.05)
    assert np.std(quadratic) == pytest.approx(math.sqrt(expected[1]), rel=0.07)


@pytest.mark.parametrize("kind", ["oscillator", "acceleration"])
def test_what_exchanges_make_of_a_tone_flies(kind: str) -> None:
    """1.4 Hz every second is 0.4 Hz; of 2 s slow, 0.8 cycles, with the sigma of its row; at 1.4 Hz it is an echo."""
    spur, shake = {"spurs": {"1.4 Hz": "-80 dBc"}}, {"sinusoidal": [{"amplitude": "1 mg", "frequency": "1.4 Hz"}]}
    felt = {"acceleration_sensitivity": "1e-9 /g", "vibration": shake}
    part = {"frequency": "10 MHz", "power_law": {"h0": 1e-34}, **(spur if kind == "oscillator" else felt)}
    linear = {"method": "linear", "interval": "1 s", "error": 0}
    mission = parse_mission(
        mission_text(platforms__receiver__oscillator=part, synchronization=linear, collection__aperture_time="2 s"),
        "m.yaml",
    )
    row_id = "receiver.oscillator" + (".acceleration" if kind == "acceleration" else "")
    (error,) = (one for one in random_errors(mission) if one.id == row_id)
    times = np.linspace(-1, 1, 513)
    drawn = phase_courses(mission, error, times, 4_000, np.random.default_rng(2))
    quadratic, cubic = (legendre.legfit(times, drawn.T, 3)[order] for order in (2, 3))
    assert 1.5 * np.std(quadratic) == pytest.approx(error.published.quadratic * error.declared, rel=0.05)
    assert 2.5 * np.std(cubic) == pytest.approx(error.published.cubic * error.declared, rel=0.05)
    if kind == "acceleration":
        flown = oscillator_sinusoids(mission, "receiver")
        assert {round(one.frequency, 6) for one in flown} >= {0.6, 1.4}
