"""Mean elements of an orbit, propagated by SGP4.

SGP4 places a satellite about 1 km off at the epoch of its elements, and 1 to 3 km more with each day from it
(documentation of the package sgp4; Vallado and others, Revisiting Spacetrack Report #3, AIAA 2006-6753). Constants
are those of WGS-72, which the elements are made with. Places in the true equator and mean equinox of date turn to the
Earth by the mean sidereal time of 1982.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from bisar_budget.geometry import Vector
from bisar_budget.paths.flight import Orbit, PathDoubt, PathFileError, Sample, interpolate
from bisar_budget.paths.instant import DAY, Instant
from bisar_budget.paths.messages import object_key, one_object
from bisar_budget.paths.orientation import INSTALL, Orientation, from_teme

PLAIN_TYPES = ("", "0", "2")  # CCSDS 502.0-B-3, EPHEMERIS_TYPE; 0 is SGP4 in all that is distributed, 4 is SGP4-XP
_DAY_OF_1950 = 33281  # modified Julian day of 1949-12-31, from which SGP4 counts days
_NODES, _STEP_S = 8, 30.0
_FRESH_DAYS = 7.0
_FARTHEST_DAYS = 36525.0  # SGP4 steps through the time to a resonant orbit
_AT_EPOCH_KM, _PER_DAY_KM = 1, (1, 3)
_USUAL_PER_DAY_KM = 2.0  # middle of what the sources say
# The error codes of Satrec.sgp4; 5 is no longer in use.
_FAILURES = {
    1: "its mean eccentricity leaves the range from 0 to 1",
    2: "its mean motion falls below zero",
    3: "its perturbed eccentricity leaves the range from 0 to 1",
    4: "its semilatus rectum falls below zero",
    6: "it has decayed",
}


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Mean elements of an object at an epoch, as SGP4 takes them: angles in rad, mean motion in rad/min."""

    name: str
    number: int
    epoch: Instant
    mean_motion: float
    eccentricity: float
    inclination: float
    node: float
    perigee: float
    anomaly: float
    drag: float  # B*, 1/Earth radii
    kind: str  # what they were read from
    where: str  # file and line or record

    @property
    def object(self) -> str:
        """Name and catalogue number."""
        return f"{self.name} ({self.number})" if self.name else str(self.number)

    @property
    def names(self) -> tuple[str, ...]:
        """Name and catalogue number, as they are compared."""
        return (object_key(self.name), str(self.number))


def teme(elements: Elements) -> Callable[[Instant], Vector]:
    """Return a function that places an object in the true equator and mean equinox of date, by SGP4. [m]

    Raises
    ------
    PathFileError
        The package sgp4 is not installed, or refuses the elements. What is returned raises it without a prefix where
        SGP4 has no place.
    """
    try:
        from sgp4.api import WGS72, Satrec
    except ImportError:
        raise PathFileError(f"{elements.where}: needs the package sgp4: {INSTALL}") from None
    satellite = Satrec()
    epoch = elements.epoch.day - _DAY_OF_1950 + elements.epoch.seconds / DAY
    # The derivatives of the mean motion are no part of SGP4, and the number is ours to keep.
    shape = (elements.eccentricity, elements.perigee, elements.inclination, elements.anomaly)
    satellite.sgp4init(WGS72, "i", 0, epoch, elements.drag, 0.0, 0.0, *shape, elements.mean_motion, elements.node)
    if satellite.error:
        raise PathFileError(f"{elements.where}: SGP4 refuses {elements.object}: {_failure(satellite.error)}")

    def place(instant: Instant) -> Vector:
        elapsed = instant.since(elements.epoch)
        if abs(elapsed) > _FARTHEST_DAYS * DAY:
            raise PathFileError(
                f"{elements.where}: the elements of {elements.object} are of {elements.epoch.as_text()}, more than a"
                " century from the aperture"
            )
        # A Julian date of two numbers would be as exact, but its epoch passes through a calendar.
        error, position, _ = satellite.sgp4_tsince(elapsed / 60)
        if error or not all(math.isfinite(one) for one in position):
            raise PathFileError(
                f"{elements.where}: SGP4 has no place of {elements.object} at {instant.as_text()}: {_failure(error)}"
            )
        x, y, z = position
        return (1000 * x, 1000 * y, 1000 * z)

    return place


def smooth(place: Callable[[Instant], Vector]) -> Callable[[Instant], Vector]:
    """The same places without the steps of their rounding, which grow with the age of the elements.

    SGP4 counts minutes and angles from the epoch: a week from it a place is rounded to 2e-6 m, and 100 days from it
    to 4e-5 m, which a polynomial of slow time takes for bends of the path. Lagrange's polynomial through eight places
    30 s apart leaves 1e-8 m in a low orbit, by its remainder. It also rounds off the millimetres by which SGP4 jumps
    every half day in resonant orbits.
    """

    @lru_cache(maxsize=64)
    def node(day: int, count: int) -> Sample:
        time = Instant(day, 0.0).after(count * _STEP_S)
        return Sample(time, place(time), (0.0, 0.0, 0.0))

    def between(instant: Instant) -> Vector:
        count = math.floor(instant.seconds / _STEP_S)
        try:
            near = [node(instant.day, count + n) for n in range(1 - _NODES // 2, 1 + _NODES // 2)]
        except PathFileError:  # within minutes of the end of an orbit
            return place(instant)
        return interpolate(near, instant, _NODES, False)

    return between


def orbit_of(
    found: Sequence[Elements], name: str, wanted: str | None, center: Instant, orientation: Orientation
) -> Orbit:
    """Orbit of one object, by the elements whose epoch is nearest; of two that are as near the last of the file.

    Parameters
    ----------
    found : sequence of Elements
        What the file has.
    name : str
        What messages call the file.
    wanted : str, optional
        Name or catalogue number of the object.
    center : Instant
        Middle of the aperture.
    orientation : Orientation
        What places are turned to the Earth with.

    Raises
    ------
    PathFileError
        There are no elements, or those of several objects; SGP4 is missing or refuses.
    """
    if not found:
        raise PathFileError(f"{name}: has no element set")
    elements = min(reversed(one_object(found, name, wanted, "number")), key=lambda one: abs(center.since(one.epoch)))
    inertial = smooth(teme(elements))
    inertial(elements.epoch)  # what SGP4 refuses is known before anybody asks

    def doubt(instant: Instant) -> PathDoubt:
        days = abs(instant.since(elements.epoch)) / DAY
        words = f"elements {days:.3g} days from their epoch: {_AT_EPOCH_KM} km there, {_USUAL_PER_DAY_KM:g} km a day"
        return PathDoubt(1e3 * (_AT_EPOCH_KM + _USUAL_PER_DAY_KM * days), words)

    def doubts(instant: Instant) -> Sequence[str]:
        days = instant.since(elements.epoch) / DAY
        if abs(days) <= _FRESH_DAYS:
            return ()
        least, most = (_AT_EPOCH_KM + abs(days) * one for one in _PER_DAY_KM)
        return (
            f"{name}: the elements of {elements.object} are of {elements.epoch.as_text()}, {abs(days):.1f} days"
            f" {'before' if days > 0 else 'after'} the aperture; SGP4 may place it {least:.0f} to {most:.0f} km off",
        )

    return Orbit(
        place=lambda instant: from_teme(inertial(instant), instant, orientation),
        words=f"{elements.kind} of {elements.object}, epoch {elements.epoch.as_text()}, SGP4{orientation.words}",
        epoch=elements.epoch,
        doubts=doubts,
        doubt=doubt,
        remedy="Take elements whose epoch is nearer to collection.center_time",
        is_turned=True,
    )


def _failure(error: int) -> str:
    return _FAILURES.get(error, "it gives no number")


def angle_of(degrees: float, most: float, called: str, where: str) -> float:
    """An angle of a file, in rad, which must be within its range."""
    if not 0 <= degrees <= most:
        raise PathFileError(f"{where}: {called} must be from 0 to {most:g} degrees (got {degrees:g})")
    return math.radians(degrees)


def motion_of(turns: float, where: str) -> float:
    """From revolutions a day, to rad/min."""
    if not 0 < turns < 20:
        raise PathFileError(f"{where}: mean motion must be more than 0 and less than 20 a day (got {turns:g})")
    return turns * 2 * math.pi / 1440
