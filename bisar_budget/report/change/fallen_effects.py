"""Declared errors that do less to the image than before although neither part nor source changed by name.

Both versions are held to the earlier geometry, waveform, aperture and requirements: what these change is no fall.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import zip_longest
from typing import NamedTuple

from bisar_budget.budget.check import check_mission
from bisar_budget.effects.effect import MOTION, PLATFORMS
from bisar_budget.faults import KeyPath
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.row import SPECIFICATION, Row
from bisar_budget.mission.model import MetricSplits, Mission
from bisar_budget.mission.paths import with_radial
from bisar_budget.mission.platforms import FlownPath, Platform, without_image
from bisar_budget.mission.propagation import too_low
from bisar_budget.paths.earth import SceneAxes
from bisar_budget.report.change.names import plain, plain_file
from bisar_budget.report.words.sentences import dotted, percent
from bisar_budget.units import format_quantity

SUMS = (*REQUIREMENT_NAMES, "autofocus_pull_in")  # kinds of rows that are no error
_RESULTS = (*SUMS, "spatial_variance", "dispersion")  # kinds of rows that only other rows make
_SIZE_TOLERANCE_FRACTION = 1e-6  # by which the same error may use less of the same limit, as searches settle
_ANY_DAY = date(2000, 1, 1)  # waivers decide no use of a limit


@dataclass(frozen=True)
class FallenEffect:
    """A row that declares less than before, or uses less of its limit; `after` is None where it is gone."""

    before: Row
    after: Row | None

    @property
    def id(self) -> str:
        """Id of the row."""
        return self.before.id

    @property
    def words(self) -> tuple[str, str]:
        """Use before and after; where a limit tells nothing, the declared sizes."""
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
    """A key of the later errors that the earlier collection does not allow, and why: no effect can be compared."""

    id: str
    problem: str

    @property
    def words(self) -> tuple[str, str]:
        """How effects are compared, and why these cannot be."""
        return "effects compared in the earlier collection", f"not comparable, since there it {self.problem}"


def fallen_effects(before: MissionFindings, after: MissionFindings) -> Sequence[FallenEffect | NotComparable]:
    """List the rows whose declared effect fell while their part and their source kept their names.

    A sum counts only where no error fell that could explain it. Where the earlier collection does not allow the later
    errors, their keys are listed instead: a gate passes nothing that it cannot compare.
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
    # With `each` the row of a total is there only where no error fails alone.
    is_judged = before.combine != "each"
    return [fall for fall in _falls(_sums(before), _sums(rechecked)) if is_judged or fall.after is not None]


def _held_alike(before: MissionFindings, after: MissionFindings) -> Mission | None:
    """The later errors in the earlier collection; None where that is the later mission."""
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
    """The later errors of a platform on its earlier path, whichever way the two files state paths.

    Errors along `ric` axes need the Earth's centre. Where the earlier file does not say it, it is that of the later.
    """
    path = old.path or FlownPath(old.state)
    if path.state.radial is None and axes is not None:
        path = path._replace(state=with_radial(path.state, axes))
    return old._replace(motion_error=new.motion_error, oscillator=new.oscillator, path=path)


def _misfits(mission: Mission) -> dict[KeyPath, str]:
    """Keys of errors that do not go with the collection that they are held to, and why."""
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
    """Rows of declared errors; motion along other axes than before by the axes of the scene, which both have."""
    ids = {row.id for row in other.rows}
    elsewhere = {(row.owner, row.subject.kind) for row in findings.rows if row.is_independent and row.id not in ids}
    rows = []
    for row in findings.rows:
        kind = row.subject.kind
        if row.declared is None or row.metric == SPECIFICATION or kind in _RESULTS:
            continue
        is_of_platform = kind in MOTION and row.owner in PLATFORMS
        if is_of_platform and row.is_independent == ((row.owner, kind) in elsewhere):
            continue
        rows.append(row)
    return rows


def _sums(findings: MissionFindings) -> list[Row]:
    return [row for row in findings.rows if row.subject.kind in _RESULTS and row.declared is not None]


def _falls(before: Sequence[Row], after: Sequence[Row]) -> Iterator[FallenEffect]:
    """Rows that fell; numbered entries of one list are compared in the order of their effect, not of their number."""
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
    """Whether the use of a limit tells how the effect changed: neither row lacks it."""
    return bool(before.utilization) and (after is None or after.utilization is not None)


def _is_less(before: Row, after: Row | None) -> bool:
    """Whether a row is gone, uses less, or declares less where its use tells nothing."""
    if after is None:
        return before.declared != 0 or before.unit == "dB"
    sizes = (before.declared or 0.0, after.declared or 0.0)
    if _tells(before, after):
        sizes = (before.utilization or 0.0, after.utilization or 0.0)
    elif before.unit != after.unit:
        return False
    return sizes[0] - sizes[1] > _SIZE_TOLERANCE_FRACTION * abs(sizes[0])


def _family(row: Row) -> tuple[str, ...]:
    """Rows among which an error may move: entries of one list, which have a number each."""
    subject = row.subject
    if subject.entry is None or subject.kind == "other":
        return (row.id,)
    return subject.owner, subject.kind, subject.axis


def _named_anew(before: MissionFindings, after: MissionFindings) -> set[str]:
    """Ids of rows that a source or a part stands behind which the earlier file does not name for them.

    A key that is gone, or that overrides a part, names nothing: what its section names already stands behind the row.
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
    """Plain name of what a row's figures are taken from; of the fixes of a log, its file."""
    if row.subject.kind != "trajectory":
        return plain(row.evidence)
    path: FlownPath | None = getattr(mission.platforms, row.owner).path
    return plain_file(path and path.file)


def _is_named(source: str, mission: Mission, row: Row) -> bool:
    """Whether a mission names a source for a row, or for the whole of its section, or a part of that name."""
    if source in ("", _source(mission, row)):
        return True
    if row.owner not in PLATFORMS:
        return False
    platform: Platform = getattr(mission.platforms, row.owner)
    section = platform.oscillator if row.subject.kind == "oscillator" else platform.motion_error
    if section is None:
        return False
    overridden = [plain(override.part) for override in section.overridden]
    return source == plain(section.source) or any(source.startswith(name) for name in overridden if name)


def _parts(mission: Mission, row: Row) -> set[str]:
    """Plain names of the parts that a row's figures are taken from."""
    start = f"platforms.{row.owner}."
    keys = {taken.key: set(taken.key.split(".")) for taken in mission.taken if taken.key.startswith(start)}
    word = next(
        (word for word in (row.subject.axis, row.subject.kind) if any(word in key for key in keys.values())), ""
    )
    return {plain_file(taken.part) for taken in mission.taken if word in keys.get(taken.key, ())}


def _sensors(mission: Mission, row: Row) -> set[str]:
    """Plain names of the parts of a platform, whether a figure is taken from them or all are overridden."""
    if row.owner not in PLATFORMS:
        return set()
    platform: Platform = getattr(mission.platforms, row.owner)
    named = [platform.motion_error.sensor, platform.oscillator and platform.oscillator.sensor]
    listed = [name for entry in named if entry for name in ((entry,) if isinstance(entry, str) else entry)]
    return {plain_file(name) for name in listed}
