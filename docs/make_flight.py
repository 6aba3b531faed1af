"""Write a log of a flight that nobody flew, for the missions that come with the tool.

    python docs/make_flight.py > flight.csv

The same bytes each time. `random.Random` gives the same numbers on every machine and in every version.
"""

import math
import sys
from collections.abc import Iterator
from random import Random

from bisar_budget.paths.earth import EQUATORIAL_RADIUS_M, FLATTENING_RATIO
from bisar_budget.paths.instant import parse_instant

SEED = 20260710
MIDDLE = "2026-07-10T05:26:46Z"
DURATION, RATE = 60, 50  # s, Hz
SPEED, HEIGHT = 60.0, 3000.0  # m/s to the east, m above the ellipsoid
LATITUDE, LONGITUDE = math.radians(48.0866), math.radians(11.2797)  # Oberpfaffenhofen
SOUTH = 4000.0  # m that the middle of the flight is south of it
NOISE = 0.01  # m, one sigma, white
# One-sigma displacements east, north, up [m], as sums of waves between these frequencies [Hz]. Their amplitude falls
# as the frequency to the power of 11/6: displacement has the spectrum of air velocity, f^(-5/3), over f² (von Kármán,
# far above the corner).
GUSTS = (0.5, 1.5, 1.0)
WAVES, LOWEST, HIGHEST = 40, 0.02, 0.5

COMMENT = f"""\
# Made up, not flown: docs/make_flight.py wrote it, seed {SEED}.
# A light aircraft at {SPEED:g} m/s to the east, {HEIGHT:g} m above the ellipsoid of WGS-84.
# Its middle, at {MIDDLE}, is {SOUTH / 1e3:g} km south of Oberpfaffenhofen,
# which is at {math.degrees(LATITUDE):.4f} deg north and {math.degrees(LONGITUDE):.4f} deg east.
# Turbulence: {WAVES} waves of {LOWEST:g} Hz to {HIGHEST:g} Hz with random phases, amplitude as frequency^(-11/6),
# {", ".join(f"{sigma:g} m" for sigma in GUSTS)} one sigma east, north, up. White noise of {NOISE:g} m one sigma.
"""


def turbulence(random: Random, sigma: float) -> list[tuple[float, float, float]]:
    """Amplitude [m], angular frequency [rad/s] and phase [rad] of each wave."""
    frequencies = [LOWEST * (HIGHEST / LOWEST) ** (n / (WAVES - 1)) for n in range(WAVES)]
    # Waves stand as far apart as their frequency is high: each stands for more of the spectrum.
    shapes = [frequency ** (-11 / 6 + 0.5) for frequency in frequencies]
    scale = sigma / math.sqrt(math.fsum(shape * shape for shape in shapes) / 2)
    return [
        (scale * shape, 2 * math.pi * frequency, random.uniform(0, 2 * math.pi))
        for shape, frequency in zip(shapes, frequencies, strict=True)
    ]


def lines() -> Iterator[str]:
    """Lines of the log."""
    random = Random(SEED)
    middle = parse_instant(MIDDLE)
    assert middle is not None
    gusts = [turbulence(random, sigma) for sigma in GUSTS]
    eccentricity_squared = FLATTENING_RATIO * (2 - FLATTENING_RATIO)
    across = EQUATORIAL_RADIUS_M / math.sqrt(1 - eccentricity_squared * math.sin(LATITUDE) ** 2)
    along = across**3 * (1 - eccentricity_squared) / EQUATORIAL_RADIUS_M**2
    yield from COMMENT.splitlines()
    yield "utc,latitude [deg],longitude [deg],height [m]"
    for n in range(DURATION * RATE + 1):
        tau = n / RATE - DURATION / 2
        east, north, up = (
            math.fsum(amplitude * math.sin(rate * tau + phase) for amplitude, rate, phase in waves)
            + random.gauss(0, NOISE)
            for waves in gusts
        )
        # To first order, as nobody compares the place with any other.
        latitude = LATITUDE + (north - SOUTH) / (along + HEIGHT)
        longitude = LONGITUDE + (SPEED * tau + east) / ((across + HEIGHT) * math.cos(latitude))
        yield (
            f"{middle.after(tau).as_text()},{math.degrees(latitude):.9f},{math.degrees(longitude):.9f},"
            f"{HEIGHT + up:.3f}"
        )


if __name__ == "__main__":
    sys.stdout.write("\n".join(lines()) + "\n")
