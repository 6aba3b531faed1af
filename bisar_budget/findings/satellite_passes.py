"""Findings of `passes`: the passes of a satellite over a scene, each with the verdict on the mission for it."""

import math
from collections import Counter
from datetime import date
from typing import NamedTuple

from bisar_budget.arrays import Floats
from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.status import STATUS
from bisar_budget.geometry import PlatformState
from bisar_budget.paths.instant import Instant


class SatellitePass(NamedTuple):
    """One pass of a satellite: its times, its track, and the verdict on the mission at its mid-time.

    Attributes
    ----------
    number : int
        Number of the pass, from 1.
    start, stop, culmination : Instant
        Beginning and end of the time above the minimum elevation, and time of maximum elevation.
    rises, sets : bool
        Whether the satellite rises above the minimum elevation, and sinks below it, within the span that is searched.
        `rises` is False if the satellite is already above at the beginning of the span, and `sets` is False if it is
        still above at the end.
    max_elevation : float
        Elevation at the culmination. [rad]
    track : (n, 2)
        Azimuth and elevation along the pass. [rad]
    center : Instant, optional
        Mid-time, rounded to a millisecond; None if the squint is never reached.
    state : PlatformState, optional
        State of the satellite at the mid-time, in the axes of the scene.
    side : str
        Side of the ground track on which the scene lies, `left` or `right` in the direction of flight.
    is_ascending : bool
        Whether the satellite flies north at the mid-time.
    doubt : float, optional
        Maximum possible distance between the satellite and its computed path. [m]
    status, reason : str
        Status of the check at the mid-time, and the reason for it. The status is `error` if the mission is invalid at
        the mid-time, and `not_evaluated` if there is no mid-time.
    bistatic_angle, gradient_angle : float, optional
        Bistatic angle, and angle between range and Doppler gradient, at the mid-time. [rad]
    range_resolution, cross_range_resolution : float, optional
        Resolutions at the mid-time. [m]
    row, requirement, utilization : str, str, float, optional
        Row, key and utilization of the requirement that decides the status.
    waived_by : tuple of str
        Ids of the waivers of a waived pass.
    """

    number: int
    start: Instant
    stop: Instant
    rises: bool
    sets: bool
    culmination: Instant
    max_elevation: float
    track: Floats
    center: Instant | None = None
    state: PlatformState | None = None
    side: str = ""
    is_ascending: bool = False
    doubt: float | None = None
    status: str = "not_evaluated"
    reason: str = ""
    bistatic_angle: float | None = None
    gradient_angle: float | None = None
    range_resolution: float | None = None
    cross_range_resolution: float | None = None
    row: str | None = None
    requirement: str | None = None
    utilization: float | None = None
    waived_by: tuple[str, ...] = ()

    @property
    def complies(self) -> bool:
        """Whether the mission meets every requirement at the mid-time; false for a waived mission."""
        return STATUS[self.status].complies

    @property
    def is_accepted(self) -> bool:
        """Whether the mission complies or is waived, so that `check` exits with code 0."""
        return self.complies or self.status == "waived"

    @property
    def bearing(self) -> float | None:
        """Bearing of the satellite at the mid-time, clockwise from north; None without a mid-time. [rad]"""
        return None if self.state is None else bearing(float(self.state.azimuth))


def bearing(azimuth: float) -> float:
    """Convert an azimuth, counter-clockwise from east, to a bearing from 0 to 2π, clockwise from north. [rad]"""
    return (math.pi / 2 - azimuth) % (2 * math.pi)


class UnknownTime(NamedTuple):
    """A time interval in which the orbit of a platform is unknown, and the reason.

    The interval lies within the span that is searched for passes.
    """

    platform: str
    start: Instant
    stop: Instant
    reason: str


class Passes(NamedTuple):
    """The passes of one platform over the scene of a mission, in chronological order.

    `day` is the day on which waivers were judged (UTC).
    """

    file: str
    name: str
    model: str
    platform: str
    start: Instant
    stop: Instant
    min_elevation: float
    squint: float
    found: tuple[SatellitePass, ...]
    day: date
    unknown: tuple[UnknownTime, ...] = ()
    changes: tuple[SetValue, ...] = ()
    overrides: tuple[Override, ...] = ()

    @property
    def complying(self) -> list[SatellitePass]:
        """Passes in which the mission complies."""
        return [each for each in self.found if each.complies]

    @property
    def accepted(self) -> list[SatellitePass]:
        """Passes in which the mission complies or is waived."""
        return [each for each in self.found if each.is_accepted]

    @property
    def counts(self) -> Counter[str]:
        """Number of passes with each status."""
        return Counter(each.status for each in self.found)

    @property
    def waived_by(self) -> tuple[str, ...]:
        """Ids of the waivers of all waived passes, without duplicates."""
        return tuple(dict.fromkeys(waiver for each in self.found for waiver in each.waived_by))
