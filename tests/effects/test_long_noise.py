"""Noise of a position over long apertures, in which the line of sight turns: against draws of an AR(1) process.

Nothing here comes from the package but the row. Each draw is a range error along the line of sight as it turns; the
image is where the variance of the phase over band and aperture is least, and what it leaves is fitted by NumPy.
"""

import math

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY, mission_text, row

LIGHT, CARRIER, BAND = 299_792_458.0, 10e9, 300e6
TRANSMITTER = np.array([[30e3, -2e3, 6e3], [0.0, 120.0, 0.0]])
RECEIVER = np.array([[3e3, 0.0, 1e3], [0.0, 26.0, 0.0]])
SIGMA = {"all": np.array([4e-4, 4e-4, 6e-4]), "track": np.array([0.0, 2e-3, 0.0])}  # m
DRAWS, SAMPLES = 3000, 1201


def drawn(sigma: np.ndarray, aperture_time: float, correlation_time: float) -> dict[str, float]:
    """Root mean squares over draws: quadratic and cubic phase [rad], displacement [m], and what spreads [rad]."""
    x = np.linspace(-1, 1, SAMPLES)
    times = x * aperture_time / 2
    slopes, looks = np.zeros((SAMPLES, 2)), []
    for position, velocity in (TRANSMITTER, RECEIVER):
        place = position + np.outer(times, velocity)
        looks.append(place / np.linalg.norm(place, axis=1)[:, None])
        slopes += looks[-1][:, :2]
    rng = np.random.default_rng(11)
    keeps = math.exp(-(times[1] - times[0]) / correlation_time)
    process = np.empty((SAMPLES, 3, DRAWS))
    process[0] = rng.normal(size=(3, DRAWS))
    for step in range(1, SAMPLES):
        process[step] = keeps * process[step - 1] + math.sqrt(1 - keeps**2) * rng.normal(size=(3, DRAWS))
    errors = -np.einsum("na,a,nad->nd", looks[1], sigma, process)
    weights = np.full(SAMPLES, 1 / (SAMPLES - 1))
    weights[[0, -1]] /= 2
    band = (BAND / CARRIER) ** 2 / 12
    weighted = weights[:, None] * ((1 + band) * slopes - weights @ slopes)
    points = -np.linalg.solve(weighted.T @ slopes, weighted.T @ errors)
    left = errors + slopes @ points
    parts = np.polynomial.legendre.legfit(x, left, 3, w=np.sqrt(weights))
    rest = left - np.polynomial.legendre.legval(x, parts).T
    k = 2 * math.pi * CARRIER / LIGHT
    return {
        "quadratic": k * float(np.sqrt(np.mean((1.5 * parts[2]) ** 2))),
        "cubic": k * float(np.sqrt(np.mean((2.5 * parts[3]) ** 2))),
        "moved": float(np.sqrt(np.mean((points**2).sum(axis=0)))),
        "spread": k * float(np.sqrt(np.mean(weights @ rest**2))),
    }


@pytest.mark.parametrize("correlation_time", [2.0, 30.0, 400.0])
@pytest.mark.parametrize("aperture_time", [5.0, 82.0])
@pytest.mark.parametrize("axes", SIGMA)
def test_noise_is_that_of_draws(axes: str, aperture_time: float, correlation_time: float) -> None:
    """Roots of 3000 squares: 1.3 % by chance. Over 82 s the receiver's v⊥T/R is 0.67.

    Noise along the track spread nothing, with the line of sight held at mid-aperture.
    """
    noise = {"name": "GNSS", "sigma": SIGMA[axes].tolist(), "correlation_time": correlation_time}
    given = mission_text(
        radar={"center_frequency": CARRIER, "bandwidth": BAND},
        collection={"aperture_time": aperture_time},
        platforms__transmitter={"position": TRANSMITTER[0].tolist(), "velocity": TRANSMITTER[1].tolist()},
        platforms__receiver={
            "position": RECEIVER[0].tolist(),
            "velocity": RECEIVER[1].tolist(),
            "motion_error": {"random": [noise]},
        },
        requirements={"islr": "-20 dB", "location_error": "1 m", "cubic_phase_error": "45 deg"},
        allocation={"model": "full"},
    )
    one = row(check_mission(parse_mission(given), TODAY), "receiver.random.GNSS")
    wanted = drawn(SIGMA[axes], aperture_time, correlation_time)
    assert one.qpe_full_rad == pytest.approx(wanted["quadratic"], rel=0.05)
    assert one.cubic_rad == pytest.approx(wanted["cubic"], rel=0.05)
    assert one.displacement_m is not None
    assert one.islr_db is not None
    assert math.hypot(*one.displacement_m) == pytest.approx(wanted["moved"], rel=0.05)
    shown = 10 * math.log10(math.expm1(wanted["spread"] ** 2) / 0.9028)  # of the mainlobe's energy
    assert one.islr_db == pytest.approx(shown, abs=0.5)
