"""Missions of one shape as one mission that has arrays where their numbers differ, one element a case."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields, is_dataclass
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from bisar_budget.mission.model import Document, Mission
from bisar_budget.mission.platforms import FlownPath


def picked(mission: Mission, places: NDArray[np.intp]) -> Mission:
    """The mission with some of the cases of its arrays."""

    def of_cases(leaf: Any) -> Any:
        return leaf[places] if isinstance(leaf, np.ndarray) and leaf.ndim else leaf

    return cast(Mission, _with_leaves(mission, of_cases))


def stacked(missions: Iterable[Mission]) -> Iterator[tuple[Mission, NDArray[np.intp]]]:
    """Put missions of one shape into one that has arrays where their numbers differ; with it the places of each.

    Missions have one shape where all else in them is the same: the keys that are stated, words, lengths of lists.
    What arrays never read is left out.
    """
    shapes: dict[Any, tuple[Mission, list[int], list[list[float]]]] = {}
    for place, mission in enumerate(map(_bare, missions)):
        numbers: list[float] = []
        _, places, rows = shapes.setdefault(_shape(mission, numbers), (mission, [], []))
        places.append(place)
        rows.append(numbers)
    for mission, places, rows in shapes.values():
        columns = [column if np.ptp(column) else column.item(0) for column in np.array(rows).T]
        yield _with_leaves(mission, partial(_next_of, iter(columns))), np.array(places)


def _next_of(numbers: Iterator[Any], leaf: Any) -> Any:
    """The next number in the place of one, and a word as it is."""
    return next(numbers) if isinstance(leaf, float) else leaf


def _bare(mission: Mission) -> Mission:
    """The mission without what says where it and its paths come from."""
    for name, platform in mission.platforms._asdict().items():
        if platform.path is not None:
            path = platform.path
            path = FlownPath(
                state=path.state,
                samples=path.samples and 1,
                doubts=path.doubts and ("",),
                doubt_m=path.doubt_m,
                is_doubted=path.is_doubted,
                stated=tuple(one._replace(words="") for one in path.stated),
                log_noise=path.log_noise,
            )
            platforms = mission.platforms._replace(**{name: platform._replace(path=path)})
            mission = mission._replace(platforms=platforms)
    whence: dict[str, Any] = {"file": "", "places": {}, "data": b"", "changes": (), "parts": (), "taken": ()}
    return mission._replace(name="", document=Document(), requirement_ids={}, **whence)


def _parts(value: Any) -> Any:
    """Parts that a value is made of; None for a number, an array or a word."""
    if isinstance(value, tuple):
        return value
    if isinstance(value, dict):
        return tuple(value.values())
    return tuple(getattr(value, one.name) for one in fields(value)) if is_dataclass(value) else None


def _shape(value: Any, numbers: list[float]) -> Any:
    """All of a value but its numbers, which are put into a list."""
    if isinstance(value, float):
        numbers.append(value)
        return float
    parts = _parts(value)
    if parts is None:
        return value
    names = tuple(value) if isinstance(value, dict) else type(value)
    return (names, *[_shape(part, numbers) for part in parts])


def _with_leaves(value: Any, put: Callable[[Any], Any]) -> Any:
    """The same with something else in the place of each number, array or word."""
    parts = _parts(value)
    if parts is None:
        return put(value)
    found = [_with_leaves(part, put) for part in parts]
    if isinstance(value, dict):
        return dict(zip(value, found, strict=True))
    if isinstance(value, tuple):
        return value._make(found) if hasattr(value, "_make") else tuple(found)
    return type(value)(**{one.name: part for one, part in zip(fields(value), found, strict=True)})
