"""Platforms as fast as satellites whose path the file leaves straight: orbits curve.

Over an aperture T the missing acceleration a moves the true path by aT²/8 against the straight one: 25 m in 5 s.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from bisar_budget import file_warnings
from bisar_budget.constants import EARTH_GRAVITATIONAL_PARAMETER, EARTH_RADIUS
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import KeyPath
from bisar_budget.findings.mission import FileWarning
from bisar_budget.geometry import PlatformState, Vector, norm
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform

if TYPE_CHECKING:
    from bisar_budget.paths.earth import SceneAxes

FASTEST_FLIGHT = 3e3  # m/s; no aircraft is as fast, and no satellite in a low orbit as slow


def orbital_acceleration(position: Vector) -> Vector:
    """Acceleration of a circular orbit through a place: μ/r² towards the Earth's centre. [m/s²]

    Parameters
    ----------
    position : (3,)
        East, north, up of the scene centre, which lies on a sphere of the Earth's mean radius. [m]

    Notes
    -----
    Derived here, for axes that do not turn. In the scene's axes, which turn with the Earth at ω = 7.3e-5 rad/s, the
    acceleration is less by 2ω×v + ω×(ω×r): up to 1.1 m/s² at 7.6 km/s, by the latitude and the orbit's inclination.
    """
    x, y, up = position
    from_centre = (x, y, up + EARTH_RADIUS)
    factor = -EARTH_GRAVITATIONAL_PARAMETER / norm(from_centre) ** 3
    return (factor * x, factor * y, factor * from_centre[2])


def free_fall(axes: "SceneAxes", state: PlatformState) -> Vector:
    """Acceleration of a satellite in the axes of a scene on the Earth: −μr/r³ − 2ω×v − ω×(ω×r). [m/s²]

    Derived here: r against the stars, written in axes that turn at ω.
    """
    from bisar_budget.paths.earth import ROTATION_RATE

    x, y, z = axes.earth_fixed(state.position)
    u, v, _ = axes.turned_back(state.velocity)
    factor = -EARTH_GRAVITATIONAL_PARAMETER / math.hypot(x, y, z) ** 3
    turning = ROTATION_RATE**2
    return axes.turned(
        (
            factor * x + 2 * ROTATION_RATE * v + turning * x,
            factor * y - 2 * ROTATION_RATE * u + turning * y,
            factor * z,
        )
    )


def straight_orbits(mission: Mission) -> Iterator[FileWarning]:
    """Doubt each platform that is as fast as a satellite and has no `acceleration`; say what its orbit would have.

    A file that writes an acceleration has decided, zero included.
    """
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        speed = norm(platform.state.velocity)
        if speed <= FASTEST_FLIGHT or platform.acceleration is not None or platform.is_of_the_earth:
            continue
        key: KeyPath = ("speed",) if platform.velocity is None else ("velocity",)
        axes = mission.scene.axes
        if axes is not None:
            acceleration = free_fall(axes, platform.state)
        else:
            acceleration = orbital_acceleration(platform.state.position)
        message = file_warnings.satellite_flies_straight(name, speed, acceleration, axes is not None)
        yield FileWarning(line=mission.line(("platforms", name, *key)), message=message, is_doubt=True)
