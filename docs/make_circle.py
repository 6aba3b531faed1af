"""Write the plan of a flight on a circle, for the mission that comes with the tool.

    python docs/make_circle.py > circle.csv

The same bytes each time, on every machine: places are rounded to a millimetre.
"""

import math
import sys
from collections.abc import Iterator

RADIUS, HEIGHT = 1000.0, 500.0  # m, about the scene and above it
SPEED = 25.0  # m/s
DURATION, RATE = 120, 2  # s, Hz

COMMENT = f"""\
# Made up, not flown: docs/make_circle.py wrote it.
# A level circle of {RADIUS:g} m about the scene, {HEIGHT:g} m above it, counter-clockwise at {SPEED:g} m/s.
# In its middle, at {DURATION / 2:g} s, the drone is east of the scene.
"""


def lines() -> Iterator[str]:
    """Lines of the log."""
    yield from COMMENT.splitlines()
    yield "time [s],east [m],north [m],up [m]"
    for n in range(DURATION * RATE + 1):
        time = n / RATE
        azimuth = SPEED / RADIUS * (time - DURATION / 2)
        yield f"{time:.1f},{RADIUS * math.cos(azimuth):.3f},{RADIUS * math.sin(azimuth):.3f},{HEIGHT:.3f}"


if __name__ == "__main__":
    sys.stdout.write("\n".join(lines()) + "\n")
