"""A mission in which some numbers are arrays, one element a case: how they come into it."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from bisar_budget import units
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.covariance import KINDS, Covariance, error_index
from bisar_budget.mission.instruments import Imu, PowerLaw
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.platforms import CommonMotionError
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
