"""Declared errors with a smaller effect on the image than before, although part and source kept their names.

Both versions are checked in the earlier geometry, waveform, aperture and requirements, whose changes are no fall.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import zip_longest

from bisar_budget.budget.check import check_mission
from bisar_budget.effects.effect import MOTION, PLATFORMS
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.row import SPECIFICATION, Row
from bisar_budget.mission.model import MetricSplits, Mission, flies_on_earth
from bisar_budget.report.words.sentences import percent
from bisar_budget.units import format_quantity

SUMS = (*NAMES, "autofocus_pull_in")  # kinds of rows that sum errors
_RESULTS = (*SUMS, "spatial_variance", "dispersion")  # kinds of rows that follow from other rows
_ROUNDING_FRACTION = 1e-6  # tolerance of the use of a limit, due to searches for limits
_ANY_DAY = date(2000, 1, 1)  # the day affects waivers only, and no use of a limit


@dataclass(frozen=True)
class FallenEffect:
    """A row that declares less than before, or uses less of its limit; `after` is None if the row is gone."""

    before: Row
    after: Row | None

    @property
    def id(self) -> str:
        """Id of the row."""
        return self.before.id

    @property
    def words(self) -> tuple[str, str]:
        """Use of the limit before and after, or the declared sizes of rows without a use."""
        if _has_uses(self.before, self.after):
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


def fallen_effects(before: MissionFindings, after: MissionFindings) -> list[FallenEffect]:
    """Rows whose declared effect fell while their part and their source kept their names.

    Sums are listed only if no error fell.
    """
    comparable = _in_earlier_collection(before, after)
    if comparable is None:
        return []
    falls = list(_falls(_errors(before, comparable), _errors(comparable, before)))
    renamed = _renamed_rows(before, after)
    if falls:
        return [fall for fall in falls if fall.id not in renamed]
    return list(_falls(_sums(before), _sums(comparable)))


def _in_earlier_collection(before: MissionFindings, after: MissionFindings) -> MissionFindings | None:
    """Findings on the later errors in the earlier collection; None if the two are not compatible."""
    old, new = (findings.analysed().mission for findings in (before, after))
    split = MetricSplits(before.allocation.qpe, before.allocation.pslr, before.allocation.islr)
    comparable = new._replace(
        radar=old.radar,
        collection=old.collection,
        requirements=old.requirements,
        specifications={},
        allocation=old.allocation._replace(split=split),
        autofocus=new.autofocus._replace(n_pull=old.autofocus.n_pull),
    )
    if before.geometry != after.geometry:
        scene = old.scene._replace(radius=new.scene.radius, height_error=new.scene.height_error)
        platforms = {
            name: getattr(old.platforms, name)._replace(
                motion_error=getattr(new.platforms, name).motion_error,
                oscillator=getattr(new.platforms, name).oscillator,
            )
            for name in PLATFORMS
        }
        comparable = comparable._replace(scene=scene, platforms=old.platforms._replace(**platforms))
    is_equal = comparable._replace(allocation=new.allocation, specifications=new.specifications) == new
    if is_equal and new.allocation == old.allocation and new.allocation.split == "equal":
        return after
    if flies_on_earth(old) != flies_on_earth(new) or any(Mission.problems(comparable._asdict())):
        return None
    return check_mission(comparable, _ANY_DAY)


def _errors(findings: MissionFindings, other_findings: MissionFindings) -> list[Row]:
    """Rows of declared errors. If the axes of a motion error changed, its rows along the axes of the scene count."""
    ids = {row.id for row in other_findings.rows}
    reframed = {(row.owner, row.subject.kind) for row in findings.rows if row.is_independent and row.id not in ids}
    rows = []
    for row in findings.rows:
        kind = row.subject.kind
        if row.declared is None or row.metric == SPECIFICATION or kind in _RESULTS:
            continue
        is_of_platform = kind in MOTION and row.owner in PLATFORMS
        if is_of_platform and row.is_independent == ((row.owner, kind) in reframed):
            continue
        rows.append(row)
    return rows


def _sums(findings: MissionFindings) -> list[Row]:
    return [row for row in findings.rows if row.subject.kind in _RESULTS and row.declared is not None]


def _falls(before: Sequence[Row], after: Sequence[Row]) -> Iterator[FallenEffect]:
    """Rows that fell. Numbered entries of one list are compared in the order of their effects, not their numbers."""
    new_rows, old_rows = defaultdict[tuple[str, ...], list[Row]](list), defaultdict[tuple[str, ...], list[Row]](list)
    for families, rows in ((old_rows, before), (new_rows, after)):
        for row in sorted(rows, key=_size, reverse=True):
            families[_family(row)].append(row)
    for family, rows in old_rows.items():
        for old, new in zip_longest(rows, new_rows[family][: len(rows)]):
            if _is_less(old, new):
                yield FallenEffect(old, new)


def _size(row: Row) -> tuple[float, float]:
    return (math.inf if row.utilization is None else row.utilization, row.declared or 0.0)


def _has_uses(before: Row, after: Row | None) -> bool:
    """Whether both rows have a use of a limit, by which their effects are compared. A missing row counts as well."""
    return bool(before.utilization) and (after is None or after.utilization is not None)


def _is_less(before: Row, after: Row | None) -> bool:
    """Whether a row is gone, uses less of its limit, or without a use declares less."""
    if after is None:
        return before.declared != 0 or before.unit == "dB"
    sizes = (before.declared or 0.0, after.declared or 0.0)
    if _has_uses(before, after):
        sizes = (before.utilization or 0.0, after.utilization or 0.0)
    elif before.unit != after.unit:
        return False
    return sizes[0] - sizes[1] > _ROUNDING_FRACTION * abs(sizes[0])


def _family(row: Row) -> tuple[str, ...]:
    """Key of the rows that are compared as one list: numbered entries share a key, other rows have their id."""
    subject = row.subject
    if subject.entry is None or subject.kind == "other":
        return (row.id,)
    return subject.owner, subject.kind, subject.axis


def _renamed_rows(before: MissionFindings, after: MissionFindings) -> set[str]:
    """Ids of rows whose source has another text, or whose part has a new name."""
    old = {row.id: row for row in before.rows}
    old_mission, mission = before.analysed().mission, after.analysed().mission
    return {
        row.id
        for row in after.rows
        if row.id in old
        and (
            (row.evidence and row.evidence != old[row.id].evidence)
            or not _part_names(mission, row) <= _part_names(old_mission, row)
        )
    }


def _part_names(mission: Mission, row: Row) -> set[str]:
    """Names of the catalogue parts that give the figures of a row."""
    start = f"platforms.{row.owner}."
    keys = {figure.key: set(figure.key.split(".")) for figure in mission.taken if figure.key.startswith(start)}
    word = next(
        (word for word in (row.subject.axis, row.subject.kind) if any(word in key for key in keys.values())), ""
    )
    return {figure.part for figure in mission.taken if word in keys.get(figure.key, ())}
