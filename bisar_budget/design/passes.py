"""Passes of a satellite over the scene of a mission, and the verdict of the mission in each pass.

A pass lasts as long as the satellite is above a minimum elevation; if both platforms have orbits, both satellites
must be above it. The mid-time of a pass is the time at which the satellite sees the scene with a given squint, by
default at broadside. The mission is checked with mid-aperture at the mid-time, as if its file stated this
`collection.center_time`.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import date
from typing import NamedTuple

import numpy as np

from bisar_budget.budget.check import check_missions
from bisar_budget.constants import MAX_DAYS
from bisar_budget.design.table import Variation
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import MissionError, SetValue, changes_words, printable, shown
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.row import worst_first
from bisar_budget.findings.status import RANK, STATUS
from bisar_budget.geometry import PlatformState, cross, dot, plain_vector
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.paths import orbits_of, reader_of
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.paths.earth import Floats, SceneAxes
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import DAY_S, Instant, parse_instant
from bisar_budget.paths.visibility import Stretch, Watched, shared
from bisar_budget.workers import Progress, unseen

CENTER_TIME = "collection.center_time"
MIN_ELEVATION = math.radians(20)
_PASSES_PER_BLOCK = 64  # number of passes that are checked together
_YEARS = (1957, 2200)  # first year with orbits, and the year after the last
_TRACK_POINTS = 41  # number of points of a pass in a drawing


class SatellitePass(NamedTuple):
    """One pass of a satellite: its times, its track, and the verdict of the mission at its mid-time.

    Attributes
    ----------
    number : int
        Number of the pass, from 1.
    start, stop, culmination : Instant
        Beginning and end of the time above the minimum elevation, and the time of maximum elevation.
    rises, sets : bool
        Whether the satellite rises above and sinks below the minimum elevation within the span. `rises` is False if
        it is already above at the beginning of the span, `sets` if it is still above at the end.
    max_elevation : float
        Elevation at the culmination. [rad]
    track : (n, 2)
        Azimuth and elevation along the pass. [rad]
    center : Instant, optional
        Mid-time, to a millisecond; None if the squint is never reached.
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
        """Whether the mission meets every requirement at the mid-time; a waived mission does not."""
        return STATUS[self.status].complies

    @property
    def is_accepted(self) -> bool:
        """Whether the mission complies or is waived, so that `check` exits with 0."""
        return self.complies or self.status == "waived"

    @property
    def bearing(self) -> float | None:
        """Bearing of the satellite at the mid-time, clockwise from north; None without a mid-time. [rad]"""
        return None if self.state is None else bearing(float(self.state.azimuth))


def bearing(azimuth: float) -> float:
    """Convert an azimuth, counter-clockwise from east, to a bearing, clockwise from north, 0 to 2π. [rad]"""
    return (math.pi / 2 - azimuth) % (2 * math.pi)


class UnknownTime(NamedTuple):
    """A time interval within the span in which the orbit of a platform is unknown, with the reason."""

    platform: str
    start: Instant
    stop: Instant
    reason: str


class Passes(NamedTuple):
    """The passes of one platform's orbit over the scene of a mission, in order of time.

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
        """Number of passes of each status."""
        return Counter(each.status for each in self.found)

    @property
    def waived_by(self) -> tuple[str, ...]:
        """Ids of the waivers of all waived passes, each once."""
        return tuple(dict.fromkeys(waiver for each in self.found for waiver in each.waived_by))


def start_of(text: str) -> Instant:
    """Parse a UTC date or instant; a date means 00:00 UTC.

    Raises
    ------
    QuestionError
        The text is neither a date nor an instant, or the year is out of range.
    """
    instant = parse_instant(f"{text.strip()}T00:00:00Z") or parse_instant(text)
    if instant is None or not _YEARS[0] <= instant.as_datetime().year < _YEARS[1]:
        raise QuestionError(
            f"--from {shown(text)}: is no day and no instant of UTC from {_YEARS[0]} to {_YEARS[1] - 1}; accepted: "
            "2026-07-01, 2026-07-01T05:30:00Z"
        )
    return instant


def passes(
    mission: Mission,
    start: Instant,
    *,
    days: float,
    platform: str | None = None,
    min_elevation: float = MIN_ELEVATION,
    squint: float = 0.0,
    model: str | None = None,
    today: date,
    progress: Progress = unseen,
) -> Passes:
    """Find the passes of a satellite over the scene, and check the mission in each.

    Arguments are those of `bisar_budget.passes`. The minimum elevation and the squint are in radians; the squint is
    positive if the satellite looks forward. The mission may be loaded with or without the paths of its platforms. Its
    `collection.center_time` is ignored. `progress` is called with the number of checked passes and of all passes.

    Raises
    ------
    QuestionError
        No platform has an orbit, the scene has no position on the Earth, or there are too many days.
    MissionError
        The orbit cannot be used at any time of the span; the fault gives the line of its key.
    """
    if not 0 < days <= MAX_DAYS:
        raise QuestionError(f"--days {days:g}: accepted: more than 0, up to {MAX_DAYS:g}")
    axes = mission.scene.axes
    if axes is None:
        raise QuestionError("scene: passes are over a place on the Earth; accepted: latitude, longitude and height")
    chosen = _listed(mission, platform)
    variation = Variation(mission, model)
    seen = _watched(mission, axes, start, days, variation)
    stretches = seen[chosen].above(min_elevation)
    for name, other in seen.items():
        if name != chosen:
            stretches = shared(stretches, other.above(min_elevation))
    unchecked = [
        _at_mid_time(number, stretch, seen[chosen], axes, squint) for number, stretch in enumerate(stretches, 1)
    ]
    return Passes(
        file=mission.file,
        name=mission.name,
        model=model if model is not None and not mission.has_direct_path else mission.gating_model,
        day=today,
        platform=chosen,
        start=start,
        stop=start.after(days * DAY_S),
        min_elevation=min_elevation,
        squint=squint,
        found=tuple(_checked(unchecked, chosen, variation, today, progress)),
        unknown=tuple(
            UnknownTime(name, start.after(gap.start), start.after(gap.stop), gap.reason)
            for name, one in seen.items()
            for gap in one.gaps
        ),
        changes=mission.changes,
    )


def _listed(mission: Mission, platform: str | None) -> str:
    """Name of the platform whose passes are listed: the requested one, or else the first with an orbit."""
    flying = [name for name in PLATFORMS if getattr(mission.platforms, name).orbit is not None]
    if not flying:
        accepted = "accepted: platforms.transmitter.orbit or platforms.receiver.orbit"
        raise QuestionError(f"platforms: neither has an orbit, so that nothing passes; {accepted}")
    if platform is not None and platform not in flying:
        raise QuestionError(f"--platform {platform}: has no orbit; accepted: {flying[0]}")
    return platform or flying[0]


def _watched(
    mission: Mission, axes: SceneAxes, start: Instant, days: float, variation: Variation
) -> dict[str, Watched]:
    """Compute the motion of each satellite as seen from the scene, by the name of the platform.

    If the orbit of a platform is not usable at any time of the span, the function raises the error with which a check
    at the beginning of the span would fail.
    """
    read = reader_of(folder_of(mission.file))
    seen = {}
    for name in PLATFORMS:
        route = getattr(mission.platforms, name).orbit
        if route is None:
            continue
        try:
            seen[name] = Watched.over(orbits_of(mission, route, read), axes, start, days * DAY_S)
        except PathFileError as error:  # the file went away since the mission was loaded
            raise QuestionError(f"platforms.{name}.orbit: {error}") from None
        if not seen[name].pieces:
            _hold_to_an_orbit(mission, variation, start)
            raise QuestionError(f"platforms.{name}.orbit: {seen[name].gaps[0].reason}")
    return seen


def _hold_to_an_orbit(mission: Mission, variation: Variation, start: Instant) -> None:
    """Raise the error of an unusable orbit, if there is one, by reading the mission with mid-aperture at an instant.

    Nothing is raised if the mission is valid. The message does not mention the changed instant, because the user has
    not set it.
    """
    try:
        variation.read(center_time(start))
    except MissionError as error:
        options = [change for change in mission.changes if change.key != CENTER_TIME]
        read_with = f"Read with {changes_words([*options, *center_time(start)])}"
        options_hint = f"Read with {changes_words(options)}" if options else ""
        faults = [fault._replace(hint=fault.hint.replace(read_with, options_hint).strip()) for fault in error.faults]
        raise MissionError(error.file, tuple(faults)) from None


def _at_mid_time(number: int, stretch: Stretch, satellite: Watched, axes: SceneAxes, squint: float) -> SatellitePass:
    """Find the times, the track and the mid-time of a pass; its mission is checked later.

    `stretch` is the time interval of the pass. `squint` is the squint angle at the mid-time. [rad]
    """
    culmination = satellite.culmination(stretch)
    times = np.linspace(stretch.start, stretch.stop, _TRACK_POINTS)
    x, y, z = satellite.at(times)[0].T
    orbit_pass = SatellitePass(
        number=number,
        start=satellite.origin.after(stretch.start),
        stop=satellite.origin.after(stretch.stop),
        rises=stretch.rises,
        sets=stretch.sets,
        culmination=satellite.origin.after(culmination),
        max_elevation=float(satellite.state(culmination).elevation),
        track=np.stack([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))], axis=1),
    )
    time = satellite.with_squint(stretch, squint)
    if time is None:
        seen = np.degrees(satellite.squint(times))
        return orbit_pass._replace(
            reason=f"its squint is {seen.min():.1f} deg to {seen.max():.1f} deg, never {math.degrees(squint):.4g} deg"
        )
    # Rounded to a millisecond as in a mission file, so that a check of that file agrees with the pass.
    center = satellite.origin.after(time)
    center = parse_instant(center.as_text()) or center
    time = center.since(satellite.origin)
    state = satellite.state(time)
    return orbit_pass._replace(
        center=center,
        state=state,
        side=_side(state, axes),
        is_ascending=axes.turned_back(plain_vector(state.velocity))[2] > 0,
        doubt=satellite.orbit(time).largest_doubt_m(center),
    )


def _side(state: PlatformState, axes: SceneAxes) -> str:
    """Side of the ground track on which the scene lies, seen in the direction of flight: `left` or `right`.

    The right side is along v × r, with the velocity v and the position r from the centre of the Earth.
    """
    right = cross(plain_vector(state.velocity), axes.turned(axes.earth_fixed(plain_vector(state.position))))
    return "left" if dot(state.look, right) > 0 else "right"


# ---------------------------------------------------------------------- the mission in a pass
def _checked(
    found: Sequence[SatellitePass], platform: str, variation: Variation, today: date, progress: Progress
) -> Iterator[SatellitePass]:
    """Check the mission at the mid-time of each pass."""
    for first in range(0, len(found), _PASSES_PER_BLOCK):
        block = list(found[first : first + _PASSES_PER_BLOCK])
        missions, places = [], []
        for position, unjudged in enumerate(block):
            if unjudged.center is None:
                continue
            try:
                missions.append(variation.read(center_time(unjudged.center)))
                places.append(position)
            except MissionError as error:
                fault = error.faults[0]
                block[position] = unjudged._replace(status="error", reason=f"{fault.key}: {fault.problem}")
        for index, findings in check_missions(missions, today, keeps_analysis=False):
            block[places[index]] = _judged(block[places[index]], findings, missions[index], platform)
        yield from block
        progress(first + len(block), len(found))


def center_time(instant: Instant) -> list[SetValue]:
    """Make the changes to a mission file that set mid-aperture to an instant."""
    return [SetValue(CENTER_TIME, instant.as_text())]


def _judged(unjudged: SatellitePass, findings: MissionFindings, mission: Mission, platform: str) -> SatellitePass:
    """Complete a pass with the findings of the check at its mid-time, and return it."""
    path = getattr(mission.platforms, platform).path
    row, requirement, utilization, reason = _deciding(findings)
    return unjudged._replace(
        state=path.state,
        doubt=path.largest_doubt_m,
        status=findings.status,
        reason=reason,
        bistatic_angle=float(findings.geometry.bistatic_angle),
        gradient_angle=float(findings.geometry.gradient_angle),
        range_resolution=float(findings.resolution.range),
        cross_range_resolution=float(findings.resolution.cross_range),
        row=row,
        requirement=requirement,
        utilization=utilization,
        waived_by=tuple(waiver.id for waiver in findings.waived_by) if findings.status == "waived" else (),
    )


def _deciding(findings: MissionFindings) -> tuple[str | None, str | None, float | None, str]:
    """Find the row, key and utilization of the requirement that decides, and the reason for the mission's status.

    Among the requirements that have the same status as the mission, the one with the highest utilization decides. If
    no requirement has this status, the status comes from a row or from a warning about the whole mission. The
    utilization is None if nothing is judged.
    """
    worst = min(findings.requirements, key=lambda each: (RANK[each.status], -(each.utilization or 0.0)))
    if worst.status == findings.status:
        return worst.row, worst.key, worst.utilization, str(worst.reason or "")
    for row in worst_first(findings.rows):
        if row.status == findings.status:
            use = None if row.is_unjudged else row.utilization
            return row.id, row.binding_requirement or row.metric, use, str(row.reason or "")
    doubts = [str(warning.message) for warning in findings.warnings if warning.is_doubt]
    reason = doubts[0] if doubts else "nothing is declared" if findings.is_empty else ""
    use = None if findings.status == "not_evaluated" else worst.utilization
    return worst.row, worst.key, use, printable(reason)
