"""(31) as printed, and as the ground says: the line along which a range rate moves the image, with its sense."""

import math

import numpy as np
import pytest
from sympy import cos, sin

from bisar_budget.theory import differential_range as dr
from bisar_budget.theory.symbols import PLATFORM_SYMBOLS


def test_31_is_the_printed_vector() -> None:
    east = sum(sin(p.azimuth) * cos(p.elevation) for p in PLATFORM_SYMBOLS)
    north = -sum(cos(p.azimuth) * cos(p.elevation) for p in PLATFORM_SYMBOLS)
    smear = dr.smear_direction()
    assert (smear[0] - east).simplify() == 0
    assert (smear[1] - north).simplify() == 0


POSITIONS = ((30e3, -4e3, 6e3), (5e3, 6.5e3, 2e3))


@pytest.mark.parametrize(
    "velocities", [((10.0, 150.0, 0.0), (-40.0, 30.0, 2.0)), ((0.0, -150.0, 0.0), (45.0, -40.0, 0.0))]
)
def test_a_range_rate_moves_the_image_along_31(velocities) -> None:
    """Exact ranges: the ground point that has the scene centre's range, and its range rate plus 1 mm/s.

    Q⁻¹ is (30)'s matrix over |Q|, so that the way is (31) times the range rate over |Q|, in sense too.
    """

    def history(point, tau: float) -> float:
        flown = [np.add(r, np.multiply(tau, v)) for r, v in zip(POSITIONS, velocities, strict=True)]
        return sum(np.linalg.norm(place - [*point, 0.0]) for place in flown)

    def value_and_rate(point):
        return np.array([history(point, 0.0), (history(point, 0.1) - history(point, -0.1)) / 0.2])

    slopes = np.stack([(value_and_rate(e) - value_and_rate(-e)) / 2 for e in np.eye(2)], axis=1)
    moved = np.linalg.solve(slopes, [0.0, 1e-3])
    numbers = {}
    for platform, position, velocity in zip(PLATFORM_SYMBOLS, POSITIONS, velocities, strict=True):
        numbers |= dict(zip(platform.position, position, strict=True))
        numbers |= dict(zip(platform.velocity, velocity, strict=True))
        numbers[platform.slant_range] = math.dist(position, (0, 0, 0))
        numbers[platform.azimuth] = math.atan2(position[1], position[0])
        numbers[platform.elevation] = math.asin(position[2] / math.dist(position, (0, 0, 0)))
    smear = np.array([float(part.subs(numbers)) for part in dr.smear_direction()])
    determinant = float(dr.ground_inverse()[1].subs(numbers))
    along = smear / np.hypot(*smear) * math.copysign(1.0, determinant)
    assert moved / np.hypot(*moved) == pytest.approx(along, abs=1e-5)
