"""Effect of a motion error on an image, by exact ranges: paths sampled at pulses instead of nodes."""

import math
from dataclasses import dataclass

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import Vectors
from bisar_budget.ranges.exact_ranges import ExactRanges, Sampling, followed
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
    """Effect of one error, its paths sampled anywhere over the aperture: see `ranges.exact_ranges`.

    Raises
    ------
    NoGroundPointError
        No ground point has the recorded range history.
    """
    half, paths = aperture_time_s / 2, (transmitter, receiver)
    exact = ExactRanges(
        np.array([half]),
        np.array([2 * math.pi / wavelength_m]),
        _sampling(slow_time / half),
        [_columns(one.actual) for one in paths],
        [_columns(one.actual[slow_time.size // 2]) for one in paths],
    )
    clock = np.broadcast_to(SPEED_OF_LIGHT * np.asarray(clock_error, dtype=float), slow_time.shape)[:, None]
    shifts = [_columns(one.measured - one.actual) for one in paths]
    found = followed(exact, clock, shifts, np.zeros(1, dtype=int))
    if not found.is_found[0]:
        raise NoGroundPointError("no ground point has the recorded range history")
    east, north, quadratic, cubic = (float(one[0]) for one in found[1:5])
    return ExactEffect(displacement=(east, north), quadratic=quadratic, cubic=cubic)


def _columns(positions: Floats) -> Vectors:
    """Positions (..., 3) by component, each (..., 1)."""
    x, y, z = np.moveaxis(positions, -1, 0)[..., None]
    return x, y, z


def _sampling(places: Floats) -> Sampling:
    """Samples anywhere in −1 … 1, fitted by the polynomial through them."""
    legendre = np.polynomial.legendre.legvander(places, min(_ORDER, max(3, places.size // 4)))
    at_edge = np.array([1.0, 1.0, 1.5, 2.5])[:, None]  # of P₂ and P₃, see `LEGENDRE_FITS`
    return Sampling(places, at_edge * np.linalg.pinv(legendre)[:4])
