"""What a motion error of an image does, by exact ranges: paths sampled at pulses instead of nodes."""

from dataclasses import dataclass

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.exact_arrays import located
from bisar_budget.simulate.phase_history import Floats, Path

_ORDER = 12  # of the fit to samples anywhere else


class NoGroundPointError(ValueError):
    """No ground point has the recorded range history: the point has no image."""


@dataclass(frozen=True, kw_only=True)
class ExactEffect:
    """Displacement (east, north) [m]; phases at the aperture edge, signed like the range error [rad]."""

    displacement: tuple[float, float]
    quadratic: float
    cubic: float


def exact_effect(
    slow_time: Floats,
    transmitter: Path,
    receiver: Path,
    clock_error: Floats | float,
    wavelength_m: float,
    aperture_time_s: float,
) -> ExactEffect:
    """Effect of one error, its paths sampled anywhere over the aperture: see `budget/exact_arrays.py`.

    Raises
    ------
    NoGroundPointError
        No ground point has the recorded range history.
    """
    weights = _projection(slow_time / (aperture_time_s / 2))
    measured, actual = (transmitter.measured, receiver.measured), (transmitter.actual, receiver.actual)
    clock_range = SPEED_OF_LIGHT * np.asarray(clock_error, dtype=float)
    found = located(measured, actual, clock_range, weights, wavelength_m)
    if not found.found:
        raise NoGroundPointError("no ground point has the recorded range history")
    east, north = (float(part) for part in found.displacement)
    return ExactEffect(displacement=(east, north), quadratic=float(found.quadratic), cubic=float(found.cubic))


def _projection(place: Floats) -> Floats:
    """Weights (4, samples) that project on P₀ … P₃ the polynomial through samples anywhere in -1 … 1."""
    legendre = np.polynomial.legendre.legvander(place, min(_ORDER, max(3, place.size // 4)))
    weights: Floats = np.asarray(np.linalg.pinv(legendre)[:4], dtype=float)
    return weights
