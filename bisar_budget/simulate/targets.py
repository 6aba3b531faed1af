"""What stands in a simulated scene: point targets and clutter, as the command line gives them."""

from typing import NamedTuple

from bisar_budget import units
from bisar_budget.faults import InvalidValueError
from bisar_budget.units import parse_quantity

_MOST_POINTS = 100
_FARTHEST = 1e5  # m
_LEVELS = (-200.0, 200.0)  # dB
_FORM = "EAST, NORTH or EAST, NORTH, LEVEL or clutter LEVEL, separated by semicolons"


class Target(NamedTuple):
    """A point on the ground: east, north of the scene centre [m], and its power over that of amplitude 1. [dB]"""

    east: float = 0.0
    north: float = 0.0
    level_db: float = 0.0


class Targets(NamedTuple):
    """Points of a scene, and the mean power of its clutter over that of a point of 0 dB in a pixel; None is none."""

    points: tuple[Target, ...] = (Target(),)
    clutter_db: float | None = None


def parse_targets(text: str) -> Targets:
    """Read `0, 0; 30 m, -20 m, -6 dB; clutter -25 dB`.

    Parameters
    ----------
    text : str
        Points and at most one clutter, in the units of a mission file; bare numbers are metres and decibels.

    Returns
    -------
    Targets

    Raises
    ------
    ValueError
        What is wrong with the first entry that cannot be read, no point, or more than a hundred.
    """
    points: list[Target] = []
    clutter = None
    for entry in (part.strip() for part in text.split(";")):
        if not entry:
            continue
        if entry.startswith("clutter"):
            if clutter is not None:
                raise ValueError("clutter is given twice; one level holds for the scene")
            clutter = _number(entry, entry.removeprefix("clutter").strip(), units.POWER_RATIO)
            continue
        parts = [part.strip() for part in entry.split(",")]
        if len(parts) not in (2, 3):
            raise ValueError(f"{entry!r} has {len(parts)} parts; accepted: {_FORM}")
        east, north = (_number(entry, part, units.LENGTH) for part in parts[:2])
        points.append(Target(east, north, _number(entry, parts[2], units.POWER_RATIO) if parts[2:] else 0.0))
    if not points:
        raise ValueError(f"there is no point; accepted: {_FORM}")
    if len(points) > _MOST_POINTS:
        raise ValueError(f"there are {len(points)} points, at most {_MOST_POINTS} are simulated")
    return Targets(tuple(points), clutter)


def _number(entry: str, part: str, dimension: units.Dimension) -> float:
    try:
        number = parse_quantity(part, dimension)
    except InvalidValueError as error:
        raise ValueError(f"{entry!r}: {part!r} {error.problem.problem}; accepted: {_FORM}") from None
    low, high = (-_FARTHEST, _FARTHEST) if dimension is units.LENGTH else _LEVELS
    if not low <= number <= high:
        raise ValueError(f"{entry!r}: {part!r} is beyond {low:g} to {high:g} {dimension.si}")
    return number
