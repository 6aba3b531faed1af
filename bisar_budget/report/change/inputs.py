"""Keys of the mission file, contents of the files that it names, and geometry: what a change of a mission moves."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import Changed, KeyPath
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import figure_text, taken_figures


class Moved(NamedTuple):
    """A value before and after: of a key as the files write it, or of the geometry; None where there is none."""

    name: str
    unit: str  # of a number; empty: text
    before: str | float | None
    after: str | float | None


def moved_inputs(before: Mission, after: Mission) -> Iterator[Moved]:
    """Keys that the files write differently and mean differently: `31 km` is 31000 m."""
    old, new = written(before), written(after)
    for path in {**old, **new}:
        if old.get(path) == new.get(path):
            continue
        meant = [_value(mission, path) for mission in (before, after)]
        if path in old and path in new and meant[0] is not None and meant[0] == meant[1]:
            continue
        yield Moved(dotted(path), "", old.get(path), new.get(path))
    for name in PLATFORMS:
        files = [getattr(mission.platforms, name).path for mission in (before, after)]
        if None not in files and files[0].file == files[1].file and files[0].sha256 != files[1].sha256:
            contents = [file.sha256 and file.sha256[:12] for file in files]
            yield Moved(f"platforms.{name}: content of {files[1].file}", "", *contents)
        stated = [file.accuracy for file in files if file is not None and file.accuracy is not None]
        if len(stated) == 2 and stated[0][0] == stated[1][0] and stated[0][1] != stated[1][1]:
            contents = [digest[:12] for _, digest in stated]
            yield Moved(f"platforms.{name}: content of {stated[1][0]}", "", *contents)


def written(mission: Mission) -> dict[KeyPath, str]:
    """Values as the file writes them, or a part that it names, by path; a list of plain values is one."""
    texts = {path: event.value for path, event in mission.places.items() if isinstance(_text(event), str)}
    for taken in taken_figures(mission):
        texts[tuple(taken.key.split("."))] = f"{figure_text(taken.value)} (part {taken.part})"
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
    """The value at a path; None where the mission has no such attribute."""
    value: Any = mission
    for part in path:
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(part, int):
            value = value[part] if isinstance(value, tuple) and part < len(value) else None
        else:
            value = getattr(value, part, None)
    return value


def dotted(path: KeyPath) -> str:
    """Write a path of keys as `--set` takes it."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def moved_geometry(before: MissionFindings, after: MissionFindings) -> Iterator[Moved]:
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
