"""What a change of a mission does: the keys and the geometry that changed, and how much of each limit it erodes."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import Changed, KeyPath
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import Mission

SMALL = 0.01  # a row that moves by less than this part tells a reader nothing


class Moved(NamedTuple):
    """A value before and after: of a key as the files write it, or of the geometry; None where there is none."""

    name: str
    unit: str  # of a number; empty: text
    before: str | float | None
    after: str | float | None


class Change(NamedTuple):
    """One row before and after; None where the mission has no such row."""

    id: str
    before: Row | None
    after: Row | None

    @property
    def use(self) -> tuple[float, float]:
        """Part of the limit that is used before and after; what is not declared uses nothing."""
        before, after = (row.utilization or 0.0 if row else 0.0 for row in (self.before, self.after))
        return before, after

    @property
    def erosion(self) -> float:
        """Part of what was left of the limit that the change uses up, (u₂ − u₁)/(1 − u₁); negative is a gain.

        1 uses up everything. For a row that had nothing left, the relative growth of its use, u₂/u₁ − 1.
        """
        before, after = self.use
        if before == after:
            return 0.0
        left = 1 - before
        return (after - before) / left if left > UTILIZATION_TOLERANCE else after / before - 1

    @property
    def is_newly_failing(self) -> bool:
        """Whether it fails, or is not evaluated, now and was not."""
        return _is_newly_broken(_status(self.before), _status(self.after))

    @property
    def is_change(self) -> bool:
        """Whether anything that is reported differs; that it moved to another line does not count."""
        return _reported(self.before) != _reported(self.after)

    @property
    def is_small(self) -> bool:
        """Whether status and requirement stay, and declared, allowable and what is left move by less than 1 %."""
        before, after = self.before, self.after
        if before is None or after is None or before.status != after.status or abs(self.erosion) >= SMALL:
            return False
        return _is_near(before.declared, after.declared) and _is_near(before.allowable, after.allowable)

    def breaks(self, tolerated: float) -> bool:
        """Whether it newly fails, or a row that is judged loses more than the tolerated part of what was left."""
        is_judged = self.after is not None and STATUS[self.after.status].is_held
        return self.is_newly_failing or (is_judged and self.erosion > tolerated + UTILIZATION_TOLERANCE)


class RequirementMove(NamedTuple):
    """How a requirement stood and stands: its statuses; None where the mission has no such requirement."""

    key: str
    name: str
    before: str | None
    after: str | None

    @property
    def is_newly_failing(self) -> bool:
        """Whether it is not met, or not evaluated, now and was not."""
        return _is_newly_broken(self.before, self.after)


class MissionChange(NamedTuple):
    """A mission before and after; changes have the largest erosion first. `inputs` are keys of the mission file.

    `requirements` are those that stand otherwise now.
    """

    before: MissionFindings
    after: MissionFindings
    changes: tuple[Change, ...]
    unchanged: int
    inputs: tuple[Moved, ...] = ()
    geometry: tuple[Moved, ...] = ()
    requirements: tuple[RequirementMove, ...] = ()

    def is_refused(self, tolerated: float) -> bool:
        """Whether a gate refuses it: a row, or a requirement, which no row may judge any more."""
        return bool(self.broken(tolerated)) or any(one.is_newly_failing for one in self.requirements)

    def broken(self, tolerated: float) -> list[Change]:
        """List the changes that a gate refuses."""
        return [change for change in self.changes if change.breaks(tolerated)]


def compare(before: MissionFindings, after: MissionFindings) -> MissionChange:
    """Pair the rows of two findings by id."""
    old, new = _by_id(before.rows), _by_id(after.rows)
    changes = [Change(row_id, old.get(row_id), new.get(row_id)) for row_id in {**old, **new}]
    changed = [change for change in changes if change.is_change]
    changed.sort(key=lambda change: (not change.is_newly_failing, -change.erosion))
    return MissionChange(
        before,
        after,
        tuple(changed),
        len(changes) - len(changed),
        inputs=tuple(_inputs(before.mission, after.mission)),
        geometry=tuple(_geometry(before, after)),
        requirements=tuple(_requirements(before, after)),
    )


def _requirements(before: MissionFindings, after: MissionFindings) -> Iterator[RequirementMove]:
    """Requirements that stand otherwise now."""
    old, new = ({one.key: one for one in found.requirements} for found in (before, after))
    for key, one in {**old, **new}.items():
        statuses = [found[key].status if key in found else None for found in (old, new)]
        if statuses[0] != statuses[1]:
            yield RequirementMove(key, one.name, *statuses)


def _is_newly_broken(before: str | None, after: str | None) -> bool:
    """Whether what was held is so no more; what could not be judged and fails now is worse too."""
    return (after == "fail" != before) or (after == "not_evaluated" and before not in ("fail", "not_evaluated"))


def _inputs(before: Mission | None, after: Mission | None) -> Iterator[Moved]:
    """Keys that the files write differently and mean differently: `31 km` is 31000 m."""
    if before is None or after is None:
        return
    old, new = _written(before), _written(after)
    for path in {**old, **new}:
        if old.get(path) == new.get(path):
            continue
        meant = [_value(mission, path) for mission in (before, after)]
        if path in old and path in new and meant[0] is not None and meant[0] == meant[1]:
            continue
        yield Moved(_dotted(path), "", old.get(path), new.get(path))
    for name in PLATFORMS:
        files = [getattr(mission.platforms, name).path for mission in (before, after)]
        if None not in files and files[0].file == files[1].file and files[0].sha256 != files[1].sha256:
            contents = [file.sha256 and file.sha256[:12] for file in files]
            yield Moved(f"platforms.{name}: content of {files[1].file}", "", *contents)
        stated = [file.accuracy for file in files if file is not None and file.accuracy is not None]
        if len(stated) == 2 and stated[0][0] == stated[1][0] and stated[0][1] != stated[1][1]:
            contents = [digest[:12] for _, digest in stated]
            yield Moved(f"platforms.{name}: content of {stated[1][0]}", "", *contents)


def _written(mission: Mission) -> dict[KeyPath, str]:
    """Values as the file writes them, by path; a list of plain values is one."""
    texts = {path: event.value for path, event in mission.places.items() if isinstance(_text(event), str)}
    texts |= dict(_set_values(mission))
    lists: dict[KeyPath, list[str]] = {}
    elements = [path for path in texts if isinstance(path[-1], int)]
    for path in sorted(elements, key=lambda path: int(path[-1])):  # an element that was set stands last
        lists.setdefault(path[:-1], []).append(texts.pop(path))
    return texts | {path: f"[{', '.join(items)}]" for path, items in lists.items()}


def _set_values(mission: Mission) -> Iterator[tuple[KeyPath, str]]:
    """Values that options put into it, by path; below a key that is new, by the path that the option named."""
    changed = {".".join(map(str, path)): path for path, event in mission.places.items() if isinstance(event, Changed)}
    for change in mission.changes:
        parts = parts_of(change.key)
        yield changed.get(".".join(parts), parts), change.text


def _text(event: object) -> object:
    return getattr(event, "value", None)


def _value(mission: Mission, path: KeyPath) -> Any:
    """What a path means; None where the mission has no such attribute."""
    value: Any = mission
    for part in path:
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(part, int):
            value = value[part] if isinstance(value, tuple) and part < len(value) else None
        else:
            value = getattr(value, part, None)
    return value


def _dotted(path: KeyPath) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def _geometry(before: MissionFindings, after: MissionFindings) -> Iterator[Moved]:
    """Numbers of the collection that differ by more than rounding."""
    for (name, unit, old), (_, _, new) in zip(_numbers(before), _numbers(after), strict=True):
        is_same = old == new or (old is not None and new is not None and math.isclose(old, new, rel_tol=1e-9))
        if not is_same:
            yield Moved(name, unit, old, new)


def _numbers(found: MissionFindings) -> Iterator[tuple[str, str, float | None]]:
    geometry = found.geometry
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        yield f"{name} slant range", "m", state.slant_range
        yield f"{name} azimuth", "deg", math.degrees(state.azimuth)
        yield f"{name} elevation", "deg", math.degrees(state.elevation)
        yield f"{name} squint", "deg", None if state.squint is None else math.degrees(state.squint)
    yield "bistatic angle", "deg", math.degrees(geometry.bistatic_angle)
    yield "look azimuth", "deg", math.degrees(geometry.look_azimuth)
    yield "angle between range and Doppler gradients", "deg", math.degrees(geometry.gradient_angle)
    yield "range resolution", "m", found.resolution.range
    yield "cross-range resolution", "m", found.resolution.cross_range


def _is_near(before: float | None, after: float | None) -> bool:
    if before is None or after is None:
        return before is after
    return abs(after - before) < SMALL * max(abs(before), abs(after)) or before == after


def _by_id(rows: Sequence[Row]) -> dict[str, Row]:
    return {row.id: row for row in rows}


def _status(row: Row | None) -> str | None:
    return None if row is None else row.status


def _reported(row: Row | None) -> tuple[object, ...]:
    return () if row is None else (row.status, row.declared, row.allowable, row.utilization)
