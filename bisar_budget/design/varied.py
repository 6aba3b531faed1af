"""A mission in which some numbers are arrays, one element a case: how they come into it."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from bisar_budget import units
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.covariance import KINDS, Covariance, error_index
from bisar_budget.mission.instruments import Imu, PowerLaw
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.platforms import CommonMotionError, FlownPath
from bisar_budget.units import Dimension, parse_quantity

# Sections that a file may leave out, and keys whose scalar stands for each of three axes.
_SECTIONS: Mapping[str, Callable[[], Any]] = {
    "imu": Imu,
    "common_motion_error": CommonMotionError,
    "simulation": Simulation,
}
_TRIPLES = ("position", "velocity", "acceleration", *Imu._fields[:-1])
# Curves of an oscillator, with the dimension of what their points are named by.
_CURVES: Mapping[str, Dimension] = {
    "phase_noise": units.FREQUENCY,
    "spurs": units.FREQUENCY,
    "allan_deviation": units.TIME,
}
POWERS = dict(zip(("h-2", "h-1", "h0", "h1", "h2"), PowerLaw._fields, strict=True))


def varied(mission: Mission, key: str, number: Any) -> Mission:
    """Put a number, or an array of numbers, into a mission in the place of a key."""
    found: Mission = _with_value(mission, parts_of(key), number)
    return found


def _with_value(value: Any, parts: Sequence[str], number: Any) -> Any:
    """The same below a value; a scalar for each axis goes into all."""
    if not parts:
        return (number, number, number) if isinstance(value, tuple) else number
    if isinstance(value, Covariance):
        return _with_element(value, parts, number)
    part, *rest = parts
    if part.isdigit():
        place = int(part)
        return (*value[:place], _with_value(value[place], rest, number), *value[place + 1 :])
    if part in _CURVES:
        return value._replace(**{part: _with_point(getattr(value, part), part, ".".join(rest), number)})
    part = POWERS.get(part, part)
    below = getattr(value, part)
    if below is None and rest:
        below = _SECTIONS[part]()
    if below is None and part in _TRIPLES:
        below = ()
    return value._replace(**{part: _with_value(below, rest, number)})


def _with_point(curve: Sequence[tuple[float, Any]], name: str, point: str, number: Any) -> Any:
    """A curve with another ordinate at one of its points."""
    here = parse_quantity(point, _CURVES[name])
    return tuple((at, number if at == here else ordinate) for at, ordinate in curve)


def _with_element(covariance: Covariance, parts: Sequence[str], number: Any) -> Covariance:
    """A covariance with another sigma, a sigma of each axis, or the correlation of a pair."""
    kind, *rest = parts
    if kind in KINDS:
        first = 3 * KINDS.index(kind)
        places = [first + int(axis) for axis in rest] or range(first, first + 3)
        sigmas = tuple(number if place in places else one for place, one in enumerate(covariance.sigmas))
        return covariance._replace(sigmas=sigmas)
    pair = {error_index(name.strip()) for name in ".".join(rest).split("-")}
    rows = [
        tuple(number if i != j and {i, j} == pair else rho for j, rho in enumerate(row))
        for i, row in enumerate(covariance.correlation)
    ]
    return covariance._replace(correlation=tuple(rows))


def picked(mission: Mission, places: NDArray[np.intp]) -> Mission:
    """The mission with some of the cases of its arrays."""
    return cast(Mission, _with_leaves(mission, lambda leaf: leaf[places] if np.ndim(leaf) else leaf))


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
        yield _with_leaves(mission, partial(_next_of, iter(columns), _is_number)), np.array(places)


def _is_number(leaf: Any) -> bool:
    return isinstance(leaf, float)


def _next_of(numbers: Iterator[Any], is_theirs: Callable[[Any], Any], leaf: Any) -> Any:
    """The next number in the place of a leaf that is one of theirs."""
    return next(numbers) if is_theirs(leaf) else leaf


def _bare(mission: Mission) -> Mission:
    """The mission without what says where it and its paths come from."""
    for name, platform in zip(mission.platforms._fields, mission.platforms, strict=True):
        if platform.path is not None:
            path = platform.path
            path = FlownPath(
                state=path.state,
                samples=path.samples and 1,
                doubts=path.doubts and ("",),
                doubt_m=path.doubt_m,
                is_doubted=path.is_doubted,
            )
            platforms = mission.platforms._replace(**{name: platform._replace(path=path)})
            mission = mission._replace(platforms=platforms)
    return mission._replace(places={}, data=b"", changes=(), parts=())


def _parts(value: Any) -> Any:
    """Parts that a value is made of; None for a number, an array or a word."""
    if isinstance(value, tuple):
        return value
    if isinstance(value, dict):
        return tuple(value.values())
    return tuple(getattr(value, one.name) for one in fields(value)) if is_dataclass(value) else None


def _shape(value: Any, numbers: list[float]) -> Any:
    """All of a value but its numbers, which are put into a list."""
    if _is_number(value):
        numbers.append(value)
        return float
    parts = _parts(value)
    if parts is None:
        return value
    names = tuple(value) if isinstance(value, dict) else type(value)
    return (names, *[_shape(part, numbers) for part in parts])


def _leaves(value: Any) -> Iterator[Any]:
    parts = _parts(value)
    if parts is None:
        yield value
        return
    for part in parts:
        yield from _leaves(part)


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
