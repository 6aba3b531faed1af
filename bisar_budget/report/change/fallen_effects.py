"""Declared errors that do less to the image than before although neither part nor source changed by name.

Both versions are held to the earlier geometry, waveform, aperture and requirements: what these change is no fall.
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

SUMS = (*NAMES, "autofocus_pull_in")  # kinds of rows that are no error
_RESULTS = (*SUMS, "spatial_variance", "dispersion")  # kinds of rows that only other rows make
_ROUNDING = 1e-6  # part by which the same error may use less of the same limit, as searches for limits settle
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


def fallen_effects(before: MissionFindings, after: MissionFindings) -> list[FallenEffect]:
    """List the rows whose declared effect fell while their part and their source kept their names.

    A sum counts only where no error fell that could explain it.
    """
    held = _held_alike(before, after)
    if held is None:
        return []
    falls = list(_falls(_errors(before, held), _errors(held, before)))
    renamed = _named_anew(before, after)
    if falls:
        return [fall for fall in falls if fall.id not in renamed]
    return list(_falls(_sums(before), _sums(held)))


def _held_alike(before: MissionFindings, after: MissionFindings) -> MissionFindings | None:
    """Findings on the later errors in the earlier collection; None where the two do not go together."""
    old, new = (found.analysed().mission for found in (before, after))
    split = MetricSplits(before.allocation.qpe, before.allocation.pslr, before.allocation.islr)
    held = new._replace(
        radar=old.radar,
        collection=old.collection,
        requirements=old.requirements,
        specifications={},
        allocation=old.allocation._replace(split=split),
        autofocus=new.autofocus._replace(n_pull=old.autofocus.n_pull),
    )
    if before.geometry != after.geometry:
        places = old.scene._replace(radius=new.scene.radius, height_error=new.scene.height_error)
        flown = {
            name: getattr(old.platforms, name)._replace(
                motion_error=getattr(new.platforms, name).motion_error,
                oscillator=getattr(new.platforms, name).oscillator,
            )
            for name in PLATFORMS
        }
        held = held._replace(scene=places, platforms=old.platforms._replace(**flown))
    is_same = held._replace(allocation=new.allocation, specifications=new.specifications) == new
    if is_same and new.allocation == old.allocation and new.allocation.split == "equal":
        return after
    if flies_on_earth(old) != flies_on_earth(new) or any(Mission.problems(held._asdict())):
        return None
    return check_mission(held, _ANY_DAY)


def _errors(found: MissionFindings, other: MissionFindings) -> list[Row]:
    """Rows of declared errors; motion along other axes than before by the axes of the scene, which both have."""
    ids = {row.id for row in other.rows}
    elsewhere = {(row.owner, row.subject.kind) for row in found.rows if row.is_independent and row.id not in ids}
    rows = []
    for row in found.rows:
        kind = row.subject.kind
        if row.declared is None or row.metric == SPECIFICATION or kind in _RESULTS:
            continue
        is_of_platform = kind in MOTION and row.owner in PLATFORMS
        if is_of_platform and row.is_independent == ((row.owner, kind) in elsewhere):
            continue
        rows.append(row)
    return rows


def _sums(found: MissionFindings) -> list[Row]:
    return [row for row in found.rows if row.subject.kind in _RESULTS and row.declared is not None]


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
    return sizes[0] - sizes[1] > _ROUNDING * abs(sizes[0])


def _family(row: Row) -> tuple[str, ...]:
    """Rows among which an error may move: entries of one list, which have a number each."""
    subject = row.subject
    if subject.entry is None or subject.kind == "other":
        return (row.id,)
    return subject.owner, subject.kind, subject.axis


def _named_anew(before: MissionFindings, after: MissionFindings) -> set[str]:
    """Ids of rows whose source has another text than before, or whose part has a name that it had not."""
    old = {row.id: row for row in before.rows}
    old_mission, mission = before.analysed().mission, after.analysed().mission
    return {
        row.id
        for row in after.rows
        if row.id in old
        and (
            (row.evidence and row.evidence != old[row.id].evidence)
            or not _parts(mission, row) <= _parts(old_mission, row)
        )
    }


def _parts(mission: Mission, row: Row) -> set[str]:
    """Names of the parts that a row's figures are taken from."""
    start = f"platforms.{row.owner}."
    keys = {taken.key: set(taken.key.split(".")) for taken in mission.taken if taken.key.startswith(start)}
    word = next(
        (word for word in (row.subject.axis, row.subject.kind) if any(word in key for key in keys.values())), ""
    )
    return {taken.part for taken in mission.taken if word in keys.get(taken.key, ())}
