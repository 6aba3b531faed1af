"""Passes of a satellite over the scene of a mission, and the verdict on the mission in each pass.

A pass lasts as long as the satellite is above a minimum elevation; if both platforms have orbits, both satellites
must be above it. The mid-time of a pass is the time at which the satellite sees the scene with a given squint, by
default at broadside. The mission is checked with the middle of the aperture at the mid-time, as if its file stated
this time as `collection.center_time`.
"""

import datetime as dt
import math
import os
from collections.abc import Iterator, Sequence
from datetime import date

import numpy as np

from bisar_budget.budget.check import check_missions
from bisar_budget.constants import MAX_DAYS
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import InvalidValueError, MissionError, SetValue, changes_words, closed, printable, shown
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import Outside
from bisar_budget.findings.row import worst_first
from bisar_budget.findings.satellite_passes import Passes, SatellitePass, UnknownTime
from bisar_budget.findings.status import RANK
from bisar_budget.geometry import PlatformState, cross, dot, plain_vector
from bisar_budget.mission.load import folder_of, load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.paths import orbits_of, reader_of
from bisar_budget.mission.quantities import QuestionError, text_of
from bisar_budget.mission.readers import Quantity
from bisar_budget.paths.earth import SceneAxes
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import DAY_S, Instant, parse_instant
from bisar_budget.paths.visibility import Stretch, Watched, shared
from bisar_budget.questions.outside import influences_of
from bisar_budget.questions.progress import watched
from bisar_budget.questions.results import PassesResult
from bisar_budget.questions.table import Variation
from bisar_budget.units import ANGLE
from bisar_budget.workers import Progress

CENTER_TIME = "collection.center_time"
MIN_ELEVATION = math.radians(20)
_PASSES_PER_BLOCK = 64  # number of passes that are checked together
_YEARS = (1957, 2200)  # first year with orbits, and the year after the last
_TRACK_POINTS = 41  # number of points of a pass in a drawing


def start_of(text: str) -> Instant:
    """Parse a UTC date or instant; a date means 00:00 UTC.

    Raises
    ------
    QuestionError
        The string is neither a date nor an instant, or the year is out of range.
    """
    instant = parse_instant(f"{text.strip()}T00:00:00Z") or parse_instant(text)
    if instant is None or not _YEARS[0] <= instant.as_datetime().year < _YEARS[1]:
        raise QuestionError(
            f"--from {shown(text)}: is no day and no instant of UTC from {_YEARS[0]} to {_YEARS[1] - 1}; accepted: "
            "2026-07-01, 2026-07-01T05:30:00Z"
        )
    return instant


def passes(
    mission: Mission | str | os.PathLike[str],
    start: str | dt.date | None = None,
    *,
    days: float = 3.0,
    min_elevation: object = "20 deg",
    squint: object = "0 deg",
    platform: str | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> PassesResult:
    """List the passes of a satellite over the scene, with the verdict on the mission in each pass.

    Parameters
    ----------
    mission : Mission or path
        A mission with an orbit. A file needs no `collection.center_time`.
    start : str or date, optional
        First day (UTC), or a time such as `2026-07-01T05:30:00Z`; by default the day of the check.
    days : float
        Length of the period that is searched for passes. [d]
    min_elevation, squint : str, float or quantity
        Minimum elevation of the satellite as seen from the scene, and squint angle at the mid-time of the aperture.
        Each is a string with a unit, or a number in radians.
    platform : str, optional
        Platform that is the satellite, `transmitter` or `receiver`; by default the first platform with an orbit.
    model, date, outside
        As in `check`.

    Raises
    ------
    QuestionError
        The passes cannot be found, for example because the mission has no orbit; the message says why.
    """
    if not isinstance(mission, Mission):
        mission = load_mission(os.fspath(mission), is_placed=False)
    today, influences = influences_of(mission, model, date, outside)
    least_rad, squint_rad = angle_of("--min-elevation", min_elevation, 0.0), angle_of("--squint", squint, -90.0)
    begin = start_of(str(start) if start is not None else today.isoformat())
    if not 0 < days <= MAX_DAYS:
        raise QuestionError(f"--days {days:g}: accepted: more than 0, up to {MAX_DAYS:g}")
    axes = mission.scene.axes
    if axes is None:
        raise QuestionError("scene: passes are over a place on the Earth; accepted: latitude, longitude and height")
    chosen = _listed(mission, platform)
    variation = Variation(mission, model)
    seen = _watched(mission, axes, begin, days, variation)
    stretches = seen[chosen].above(least_rad)
    for name, other in seen.items():
        if name != chosen:
            stretches = shared(stretches, other.above(least_rad))
    unchecked = [
        _at_mid_time(number, stretch, seen[chosen], axes, squint_rad) for number, stretch in enumerate(stretches, 1)
    ]
    with watched("Checking passes") as progress:
        checked_passes = tuple(_checked(unchecked, chosen, variation, today, progress))
    answer = Passes(
        file=mission.file,
        name=mission.name,
        model=model if model is not None and not mission.has_direct_path else mission.gating_model,
        day=today,
        platform=chosen,
        start=begin,
        stop=begin.after(days * DAY_S),
        min_elevation=least_rad,
        squint=squint_rad,
        found=checked_passes,
        unknown=tuple(
            UnknownTime(name, begin.after(gap.start), begin.after(gap.stop), gap.reason)
            for name, one in seen.items()
            for gap in one.gaps
        ),
        changes=mission.changes,
        overrides=influences,
    )
    return PassesResult(answer, mission, model)


def angle_of(option: str, value: object, least: float) -> float:
    """Convert the value of an angle option to radians; it must lie between `least` [deg] and 90 deg.

    Raises
    ------
    QuestionError
        The value is not an angle, or is out of range.
    """
    bounds = {"ge": 0.0} if least == 0 else {"gt": math.radians(least)}
    text = text_of("rad", value)
    try:
        return Quantity(ANGLE, lt=math.pi / 2, **bounds).leaf(text)
    except InvalidValueError as error:
        raise QuestionError(f"{option} {shown(text)}: {closed(error.problem.words)}") from None


def _listed(mission: Mission, platform: str | None) -> str:
    """Name of the platform whose passes are listed.

    It is the requested platform, or else the first platform with an orbit.
    """
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
    """Compute the motion of each satellite as seen from the scene, keyed by the name of the platform.

    If the orbit of a platform is unusable throughout the time span, the function raises the same error as a check at
    the beginning of the span.
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
    """Read the mission with mid-aperture at the instant `start`, and raise the error that an unusable orbit causes.

    Nothing is raised if the mission is valid. The error message does not mention the instant, because the user has
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
    """Find the times, the track and the mid-time of a pass; the mission is not checked.

    `stretch` is the time interval of the pass. `squint` [rad] is the squint angle at the mid-time.
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

    The right side is in the direction v × r, where v is the velocity, and r is the position relative to the centre of
    the Earth.
    """
    right = cross(plain_vector(state.velocity), axes.turned(axes.earth_fixed(plain_vector(state.position))))
    return "left" if dot(state.look, right) > 0 else "right"


# ---------------------------------------------------------------------- the mission in a pass
def _checked(
    found: Sequence[SatellitePass], platform: str, variation: Variation, today: date, progress: Progress
) -> Iterator[SatellitePass]:
    """Check the mission at the mid-time of each pass, and yield the passes with their verdicts."""
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
    """Return a list with the change to a mission file that puts the middle of the aperture at the given instant."""
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
    """Find the requirement that decides the status of a mission, and the reason for this status.

    Returns the row, the key and the utilization of the requirement, and the reason. Among the requirements that have
    the same status as the mission, the requirement with the highest utilization decides. If no requirement has this
    status, the status comes from a row or from a warning about the whole mission. The utilization is None if nothing
    is judged.
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
