"""Find declared errors whose effect on the image decreased without a new catalogue part or source to justify it.

The errors before and after a change are both checked with the earlier geometry, waveform, aperture and requirements,
so that changes of the geometry, waveform, aperture or requirements do not count as a decrease.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import zip_longest
from typing import NamedTuple

from bisar_budget.budget.check import check_mission
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.error_kinds.path_kinds import StateKind
from bisar_budget.faults import KeyPath
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import SPECIFICATION, Row
from bisar_budget.mission.model import MetricSplits, Mission
from bisar_budget.mission.paths import with_radial
from bisar_budget.mission.platforms import FlownPath, Platform, without_image
from bisar_budget.mission.propagation import too_low
from bisar_budget.paths.earth import SceneAxes
from bisar_budget.report.change.names import plain, plain_file
from bisar_budget.report.words.sentences import dotted, percent
from bisar_budget.units import format_quantity

_SIZE_TOLERANCE_FRACTION = 1e-6  # decrease of a utilization that may come from the tolerance of a search
_ANY_DAY = date(2000, 1, 1)  # waivers depend on the day, utilizations do not


@dataclass(frozen=True)
class FallenEffect:
    """A row whose declared value or utilization is smaller than before the change.

    `after` is None if the row no longer exists.
    """

    before: Row
    after: Row | None

    @property
    def id(self) -> str:
        """Id of the row."""
        return self.before.id

    @property
    def words(self) -> tuple[str, str]:
        """Texts of the value before and the value after the change.

        The value is the utilization, or the declared value if the utilizations cannot be compared.
        """
        if _tells(self.before, self.after):
            uses = [100 * (row.utilization or 0.0) if row else 0.0 for row in (self.before, self.after)]
            old, new = (percent(use / 100) for use in uses)
            if old == new:
                old, new = (f"{use:.8g} %" for use in uses)
            old = f"uses {old} of its limit"
        else:
            old, new = (
                format_quantity(row.declared or 0.0, row.unit, 6) if row else "" for row in (self.before, self.after)
            )
            old = f"declared as {old}"
        return old, "nothing declared" if self.after is None else f"{new}, with the same part and source"


class NotComparable(NamedTuple):
    """A changed error that is invalid with the earlier geometry and waveform.

    Such an error prevents the comparison of effects. `id` is the key of the error, and `problem` the reason why it is
    invalid.
    """

    id: str
    problem: str

    @property
    def words(self) -> tuple[str, str]:
        """Two texts for a message: how effects are compared, and why this error cannot be compared."""
        return "effects compared in the earlier collection", f"not comparable, since there it {self.problem}"


def fallen_effects(before: MissionFindings, after: MissionFindings) -> Sequence[FallenEffect | NotComparable]:
    """List the rows whose declared effect decreased although the names of their part and source are unchanged.

    Sums are listed only if no single error has a smaller effect. If the later errors are invalid in the earlier
    collection, the invalid keys are listed instead, because a gate must not accept a change that cannot be compared.
    """
    mission = _held_alike(before, after)
    if mission is None:
        rechecked = after
    elif misfits := [NotComparable(dotted(path), problem) for path, problem in _misfits(mission).items()]:
        return misfits
    else:
        rechecked = check_mission(mission, _ANY_DAY)
    falls = list(_falls(_errors(before, rechecked), _errors(rechecked, before)))
    renamed = _named_anew(before, after)
    if falls:
        return [fall for fall in falls if fall.id not in renamed]
    # With the rule `each`, a total has a row only if no single error fails.
    is_judged = before.combine != "each"
    return [fall for fall in _falls(_sums(before), _sums(rechecked)) if is_judged or fall.after is not None]


def _held_alike(before: MissionFindings, after: MissionFindings) -> Mission | None:
    """Return the earlier mission with the errors of the later mission, or None if this equals the later mission."""
    old, new = (findings.analysed().mission for findings in (before, after))
    split = MetricSplits(before.allocation.qpe, before.allocation.pslr, before.allocation.islr)
    mission = new._replace(
        radar=old.radar,
        collection=old.collection,
        requirements=old.requirements,
        specifications={},
        allocation=old.allocation._replace(split=split),
        autofocus=new.autofocus._replace(n_pull=old.autofocus.n_pull),
    )
    if before.geometry != after.geometry:
        scene = old.scene._replace(radius=new.scene.radius, height_error=new.scene.height_error)
        flown = {
            name: _flown_before(getattr(old.platforms, name), getattr(new.platforms, name), new.scene.axes)
            for name in PLATFORMS
        }
        mission = mission._replace(scene=scene, platforms=old.platforms._replace(**flown))
    is_unchanged = mission._replace(allocation=new.allocation, specifications=new.specifications) == new
    if is_unchanged and new.allocation == old.allocation and new.allocation.split == "equal":
        return None
    return mission


def _flown_before(old: Platform, new: Platform, axes: SceneAxes | None) -> Platform:
    """Return a platform with the path of its earlier version and the errors of its later version.

    Errors along `ric` axes need the direction from the Earth's centre. If the earlier file does not define this
    direction, it is derived from the scene `axes` of the later file.
    """
    path = old.path or FlownPath(old.state)
    if path.state.radial is None and axes is not None:
        path = path._replace(state=with_radial(path.state, axes))
    return old._replace(motion_error=new.motion_error, oscillator=new.oscillator, path=path)


def _misfits(mission: Mission) -> dict[KeyPath, str]:
    """Reasons why errors are invalid with the geometry and waveform of the mission, by the keys of the errors."""
    problems = [(problem.at, problem.problem) for problem in Mission.problems(mission._asdict())]
    for name, platform in mission.platforms._asdict().items():
        problems += [
            (("platforms", name, *problem.at), problem.problem)
            for problem in platform.without_image(platform.motion_error)
        ]
    T, common = mission.collection.aperture_time, mission.common_motion_error
    wrong = [*without_image(mission.platforms, mission.radar, T, common, has_direct_path=mission.has_direct_path)]
    if mission.propagation is not None:
        wrong += too_low(mission.propagation, mission.platforms, T)
    return dict(problems + [(problem.at, problem.problem) for problem in wrong])


def _errors(findings: MissionFindings, other: MissionFindings) -> list[Row]:
    """Return the rows of declared errors, for comparison with the rows in `other`.

    A motion error may be stated along different axes in `findings` and in `other`. In this case only its rows along
    the axes of the scene are returned, because both findings have these rows.
    """
    ids = {row.id for row in other.rows}
    elsewhere = {(row.owner, row.subject.kind) for row in findings.rows if row.is_independent and row.id not in ids}
    rows = []
    for row in findings.rows:
        subject = row.subject
        if row.declared is None or not subject.facts.is_source:
            continue
        is_of_platform = isinstance(subject.facts, StateKind) and row.owner in PLATFORMS
        if is_of_platform and row.is_independent == ((row.owner, subject.kind) in elsewhere):
            continue
        rows.append(row)
    return rows


def _sums(findings: MissionFindings) -> list[Row]:
    """Return the rows whose value is a sum over declared errors, without the rows of specifications."""
    return [
        row
        for row in findings.rows
        if not row.subject.facts.is_source and row.metric != SPECIFICATION and row.declared is not None
    ]


def _falls(before: Sequence[Row], after: Sequence[Row]) -> Iterator[FallenEffect]:
    """Yield the rows whose effect decreased.

    Rows are paired by id. Numbered entries of a list are paired by the size of their effect, not by their number.
    """
    now, then = defaultdict[tuple[str, ...], list[Row]](list), defaultdict[tuple[str, ...], list[Row]](list)
    for families, rows in ((then, before), (now, after)):
        for row in sorted(rows, key=_size, reverse=True):
            families[_family(row)].append(row)
    for family, rows in then.items():
        for old, new in zip_longest(rows, now[family][: len(rows)]):
            if _is_less(old, new):
                yield FallenEffect(old, new)


def _size(row: Row) -> tuple[float, float]:
    return (math.inf if row.utilization is None else row.utilization, row.declared or 0.0)


def _tells(before: Row, after: Row | None) -> bool:
    """Whether the utilizations of a row before and after a change can be compared.

    The earlier utilization must be positive. The later utilization must be known, unless the row no longer exists.
    """
    return bool(before.utilization) and (after is None or after.utilization is not None)


def _is_less(before: Row, after: Row | None) -> bool:
    """Whether the effect of a row decreased, or the row had an effect and no longer exists.

    The effect is the utilization, or the declared value if the utilizations cannot be compared (see `_tells`).
    """
    if after is None:
        return before.declared != 0 or before.unit == "dB"
    sizes = (before.declared or 0.0, after.declared or 0.0)
    if _tells(before, after):
        sizes = (before.utilization or 0.0, after.utilization or 0.0)
    elif before.unit != after.unit:
        return False
    return sizes[0] - sizes[1] > _SIZE_TOLERANCE_FRACTION * abs(sizes[0])


def _family(row: Row) -> tuple[str, ...]:
    """Key of the group within which rows before and after a change are paired.

    The key of a numbered list entry consists of platform (or `mission`), kind and axis. The key of any other row is
    its id.
    """
    subject = row.subject
    if subject.entry is None or not subject.facts.has_numbers:
        return (row.id,)
    return subject.owner, subject.kind, subject.axis


def _named_anew(before: MissionFindings, after: MissionFindings) -> set[str]:
    """Ids of the rows whose values have a source or part that the earlier file does not name for the row.

    If a key was removed, or overrides a value of a part, the row now has the source or part of its section. This does
    not count as new, because it already applied to the row before.
    """
    old = {row.id: row for row in before.rows}
    old_mission, mission = before.analysed().mission, after.analysed().mission
    return {
        row.id
        for row in after.rows
        if row.id in old
        and (
            not _is_named(_source(mission, row), old_mission, old[row.id])
            or not _parts(mission, row) <= _sensors(old_mission, row)
        )
    }


def _source(mission: Mission, row: Row) -> str:
    """Name of the evidence for the values of a row, normalized by `plain`; empty if there is no evidence.

    For a row about the fixes of a flight log, it is the name of the log file.
    """
    if not row.subject.facts.is_of_log:
        return plain(row.evidence)
    path: FlownPath | None = getattr(mission.platforms, row.owner).path
    return plain_file(path and path.file)


def _is_named(source: str, mission: Mission, row: Row) -> bool:
    """Whether a mission already names `source` for a row, or for the section that contains the row's value.

    The result is also True if `source` is empty, or begins with the name of a part whose values the section
    overrides.
    """
    if source in ("", _source(mission, row)):
        return True
    if row.owner not in PLATFORMS:
        return False
    platform: Platform = getattr(mission.platforms, row.owner)
    section = platform.oscillator if row.subject.facts.moves == "clock" else platform.motion_error
    if section is None:
        return False
    overridden = [plain(override.part) for override in section.overridden]
    return source == plain(section.source) or any(source.startswith(name) for name in overridden if name)


def _parts(mission: Mission, row: Row) -> set[str]:
    """Normalized names of the catalogue parts that provide a row's values."""
    start = f"platforms.{row.owner}."
    keys = {taken.key: set(taken.key.split(".")) for taken in mission.taken if taken.key.startswith(start)}
    word = next(
        (word for word in (row.subject.axis, row.subject.kind) if any(word in key for key in keys.values())), ""
    )
    return {plain_file(taken.part) for taken in mission.taken if word in keys.get(taken.key, ())}


def _sensors(mission: Mission, row: Row) -> set[str]:
    """Normalized names of the catalogue parts used for the motion errors and the oscillator of a row's platform.

    A part is included even if the file overrides all its values.
    """
    if row.owner not in PLATFORMS:
        return set()
    platform: Platform = getattr(mission.platforms, row.owner)
    return {plain_file(name) for name in platform.part_names.values()}
