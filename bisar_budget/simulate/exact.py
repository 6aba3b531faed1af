"""What a motion error does, from exact ranges and a fit over the aperture: no expansion, no image."""

import math
from dataclasses import dataclass

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.simulate.aperture_fit import edge_phases
from bisar_budget.simulate.phase_history import Floats, Path

_ORDER = 6  # of the fit in slow time
_ITERATIONS = 20
_SETTLED_M = 1e-6  # a satellite's range in double precision gives no more


@dataclass(frozen=True, kw_only=True)
class ExactEffect:
    """Displacement (east, north) [m]; phases at the aperture edge, signed like the range error [rad].

    The phases are those of the best fit over the whole aperture (`aperture_fit`), whatever its length.
    """

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
    """Find where the response of a scatterer at the scene centre goes, and what phase is left there.

    The response sits at the ground point whose range history, for the measured positions, has the recorded
    constant and linear term at the aperture midpoint; what remains of the history at that point is what defocuses.

    Raises
    ------
    ValueError
        The iteration for the displaced point does not settle.
    """
    recorded = np.linalg.norm(transmitter.actual, axis=1) + np.linalg.norm(receiver.actual, axis=1)
    recorded = recorded + SPEED_OF_LIGHT * clock_error
    place = slow_time / (aperture_time_s / 2)
    point = np.zeros(3)
    for _ in range(_ITERATIONS):
        sight = [p.measured - point for p in (transmitter, receiver)]
        distance = [np.linalg.norm(s, axis=1) for s in sight]
        left = np.polynomial.polynomial.polyfit(place, recorded - distance[0] - distance[1], _ORDER)
        gradient = sum(-s[:, :2] / d[:, None] for s, d in zip(sight, distance, strict=True))
        slope = np.polynomial.polynomial.polyfit(place, gradient, _ORDER)
        step = np.linalg.solve(slope[:2], left[:2])
        point[:2] += step
        if np.hypot(*step) < _SETTLED_M:
            phases = edge_phases(2 * math.pi / wavelength_m * left)
            return ExactEffect(
                displacement=(float(point[0]), float(point[1])), quadratic=phases.quadratic, cubic=phases.cubic
            )
    raise ValueError("no ground point has the recorded range history")
