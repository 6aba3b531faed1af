"""Combination of missions that differ only in numbers into one mission whose numbers are arrays.

A number that differs between the missions becomes an array with one element per mission (case). The combined mission
is evaluated in one pass.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields, is_dataclass
from functools import partial
from typing import cast

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import PerCase
from bisar_budget.mission.model import Document, Mission
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.mission.readers import SectionValue, SectionValues


def picked(mission: Mission, cases: NDArray[np.intp]) -> Mission:
    """Select cases of a mission whose numbers are arrays; `cases` are the indices of the elements that are kept."""

    def of_cases(leaf: object) -> object:
        return leaf[cases] if isinstance(leaf, np.ndarray) and leaf.ndim else leaf

    return cast(Mission, _with_leaves(mission, of_cases))


def stacked(missions: Iterable[Mission]) -> Iterator[tuple[Mission, NDArray[np.intp]]]:
    """Combine missions of the same shape, and yield each combined mission with the indices of its original missions.

    Missions have the same shape if they differ only in numbers, not in keys, words or lengths of lists. A number that
    differs between the missions becomes an array (missions,); a number that is the same in all missions remains a
    number. The combined mission has no sources and no positions in a file, because calculations with arrays never
    use them.
    """
    shapes: dict[object, tuple[Mission, list[int], list[list[float]]]] = {}
    for index, mission in enumerate(map(_bare, missions)):
        numbers: list[float] = []
        _, indices, rows = shapes.setdefault(_shape(mission, numbers), (mission, [], []))
        indices.append(index)
        rows.append(numbers)
    for mission, indices, rows in shapes.values():
        columns = [column if np.ptp(column) else column.item(0) for column in np.array(rows).T]
        yield _with_leaves(mission, partial(_next_of, iter(columns))), np.array(indices)


def _next_of(numbers: Iterator[PerCase], leaf: object) -> object:
    """Replace a leaf that is a number by the next element of `numbers`; return any other leaf unchanged.

    A leaf is a value that contains no other values.
    """
    return next(numbers) if isinstance(leaf, float) else leaf


def _bare(mission: Mission) -> Mission:
    """Copy of a mission without its name, its file and the sources of its paths, which do not affect calculations."""
    for name, platform in mission.platforms._asdict().items():
        if platform.path is not None:
            path = platform.path
            path = FlownPath(
                state=path.state,
                samples=path.samples and 1,
                doubts=path.doubts and ("",),
                doubt_m=path.doubt_m,
                is_doubted=path.is_doubted,
                stated=tuple(statement._replace(words="") for statement in path.stated),
                log_noise=path.log_noise,
                history=path.history,
            )
            platforms = mission.platforms._replace(**{name: platform._replace(path=path)})
            mission = mission._replace(platforms=platforms)
    no_sources: SectionValues = {"file": "", "places": {}, "data": b"", "changes": (), "parts": (), "taken": ()}
    mission = mission._replace(requirement_ids={}, requirement_texts={}, uncertainties=())
    return mission._replace(name="", document=Document(), **no_sources)


def _children(value: SectionValue) -> tuple[object, ...] | None:
    """Values in a section, list or mapping; None for a leaf, that is, a number, an array or a word."""
    if isinstance(value, tuple):
        return value
    if isinstance(value, dict):
        return tuple(value.values())
    return tuple(getattr(value, field.name) for field in fields(value)) if is_dataclass(value) else None


def _shape(value: SectionValue, numbers: list[float]) -> object:
    """Shape of a value, that is, its whole content except for its numbers.

    The numbers are appended to `numbers` in the order in which they occur. Values with equal shapes differ only in
    numbers.
    """
    if isinstance(value, float):
        numbers.append(value)
        return float
    children = _children(value)
    if children is None:
        return value
    names = tuple(value) if isinstance(value, dict) else type(value)
    return (names, *[_shape(child, numbers) for child in children])


def _with_leaves(value: SectionValue, put: Callable[[object], object]) -> SectionValue:
    """Copy of a value in which each number, array or word is replaced by the result of `put` for it."""
    children = _children(value)
    if children is None:
        return put(value)
    new_children = [_with_leaves(child, put) for child in children]
    if isinstance(value, dict):
        return dict(zip(value, new_children, strict=True))
    if isinstance(value, tuple):
        return value._make(new_children) if hasattr(value, "_make") else tuple(new_children)
    return type(value)(**{field.name: child for field, child in zip(fields(value), new_children, strict=True)})
