"""Numbers of a mission by their keys: reader, value and unit of one in the file, and its place in a mission.

A caller gives values as a file has them: texts, numbers in SI, quantities of other packages.
"""

import functools
import math
import numbers
from collections.abc import Callable, Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.faults import Fault, InvalidValueError, Problem, SetValue, fault_words, printable, shown
from bisar_budget.mission.changes import (
    ACCEPTED_ERRORS,
    apply_changes,
    is_error,
    nearest_keys,
    next_name,
    parts_of,
)
from bisar_budget.mission.covariance import KINDS, Covariance, error_index
from bisar_budget.mission.instruments import IMU_KINDS, POWERS, Imu, LeverArm
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import MISSION, Mission, Simulation
from bisar_budget.mission.platforms import CommonMotionError, MotionError
from bisar_budget.mission.readers import (
    DIRECTION,
    ELEVATION,
    INVALID,
    LATITUDE,
    ListOf,
    OneOf,
    Quantity,
    Reader,
    Section,
    TextList,
    Triple,
)
from bisar_budget.mission.tree import Tree, read_tree
from bisar_budget.mission.vibrations import Spectrum
from bisar_budget.units import Dimension, parse_quantity

DIGITS = 8  # of values that are said: both sides of a crossing stay within 1e-6
_DECADE = 10.0
FACTOR = Quantity(units.RATIO, gt=0, ge=1e-12, le=1e12)


class QuestionError(Exception):
    """A question that cannot be asked of a mission; the message says why, and what can."""


class TableError(QuestionError):
    """A table of cases that cannot be read; `lines` says each fault, `file:line:column: fault`."""

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = list(lines)
        super().__init__("\n".join(self.lines))

    @classmethod
    def of_faults(cls, file: str, faults: Sequence[Fault]) -> "TableError":
        """An error of places in a file."""
        return cls([f"{printable(file)}:{fault.line}:{fault.column}: {fault}" for fault in faults])

    @classmethod
    def of_file(cls, file: str, problem: str) -> "TableError":
        """An error of the whole file."""
        return cls([f"Error: {printable(file)}: {printable(problem)}"])


class Number(NamedTuple):
    """A number of the file: its reader, its value in SI (None: the file has none) and the unit that it is said in."""

    key: str
    reader: Quantity
    value: float | None
    unit: str

    @property
    def dimension(self) -> Dimension:
        """Kind of quantity that it is."""
        return self.reader.dimension

    @property
    def is_level(self) -> bool:
        """Whether it is a level in decibel."""
        return self.dimension in units.LEVELS

    @property
    def scale(self) -> tuple[float, float]:
        """Factor and divisor that make SI of a value in its unit."""
        return self.dimension.scales.get(self.unit) or (1.0, 1.0)

    def text(self, value: float, *, is_up: bool | None = None) -> str:
        """Write a value as the file would have it, with `DIGITS` digits, rounded up or down; None: to the nearest."""
        factor, divisor = self.scale
        number = value / factor * divisor
        if is_up is not None:
            context = Context(prec=DIGITS, rounding=ROUND_CEILING if is_up else ROUND_FLOOR)
            number = float(context.create_decimal(repr(number)))
        return f"{number:.{DIGITS}g}{' ' if self.unit else ''}{self.unit}"

    def said_like(self, between: str | None) -> "Number":
        """The number said in the unit of the range's end, where the file has no value to say it like."""
        unit = units.unit_behind((between or "").rpartition("..")[2])
        unit = unit if unit in self.dimension.scales else units.normal_unit(unit)
        return self._replace(unit=unit) if self.value is None and unit in self.dimension.scales and unit else self

    def read(self, text: str) -> float:
        """Read what `text` wrote; within a rounding of what the file's reader makes of it, which is the same."""
        return parse_quantity(text, self.dimension)


class Choices(NamedTuple):
    """A key that has a word instead of a number: a choice, a part of the catalogue, a file, a whole number.

    `value` is what the file says; None if nothing, or a list or a section.
    """

    key: str
    reader: Reader
    value: str | None
    unit: str = ""
    scale: tuple[float, float] = (1.0, 1.0)


Varied = Number | Choices


def tree_of(mission: Mission) -> dict[str, Any]:
    """Content of a mission's file with the options that changed it, as text."""
    tree = read_tree(mission.data or b"", mission.file)
    apply_changes(tree, mission.changes)
    root: dict[str, Any] = tree.root
    return root


def number_of(tree: dict[str, Any], key: str, of_all: str = "", *, is_for_each: bool = False) -> Number:
    """Find the number that a key names; a scalar that stands for each axis is one.

    `tree` is what the file says, as text, `of_all` what else is accepted where a key has three numbers. Where one is
    looked for that is to stand for each axis, the largest of three in the file is its value. A `QuestionError` says
    that there is no such key, or no number.
    """
    reader, value = _found(tree, key)
    reader = form_of(reader, value)
    if isinstance(reader, Triple):
        if is_for_each and reader.or_scalar and isinstance(value, list):
            of_each = [as_number(key, reader.component, one) for one in value]
            return max(of_each, key=lambda one: abs(one.value or 0.0))
        if isinstance(value, list) or not reader.or_scalar:
            more = of_all if reader.or_scalar else ""
            raise QuestionError(f"{key}: has three components; accepted: {key}.0, .1 or .2{more}")
        reader = reader.component
    if isinstance(reader, Section):
        raise QuestionError(f"{key}: is a section; accepted: one of its keys, {', '.join(reader.keys)}")
    if not isinstance(reader, Quantity):
        accepted = "accepted: one that is, such as collection.aperture_time"
        hint = "`bisar-budget sweep --vary` compares what it can be" if reader.is_word else ""
        raise QuestionError(f"{key}: {fault_words('is no number with a unit', '', accepted, hint)}")
    return as_number(key, reader, value)


def choices_of(tree: dict[str, Any], key: str, text: str) -> Choices | None:
    """Find the key that a word can be given for; None where it has a number, or anything else.

    `text` is what is to be given: of shares of a budget the rule, of parts a list. A `QuestionError` says that there
    is no such key.
    """
    reader, value = _found(tree, key)
    reader = form_of(reader, [] if text.startswith("[") else text)
    if not reader.is_word:
        return None
    if isinstance(value, list) and not text.startswith("["):
        first = f"{key}.0={text or 'NAME'}"
        lists = f"{key}=[{', '.join([text.partition(',')[0] or 'NAME', *map(str, value[1:])])}],..."
        raise QuestionError(
            f"{key}: the file has a list of {len(value)}; accepted: {first} for its first, or lists, {lists}"
        )
    return Choices(key, reader, value if isinstance(value, str) else None)


def as_number(key: str, reader: Quantity, value: Any) -> Number:
    """Put together a number and the unit that it is said in; `value` is what the file says, None if nothing."""
    dimension = reader.dimension
    number = parse_quantity(value, dimension) if isinstance(value, str) else value if type(value) is float else None
    unit = units.unit_behind(value) if isinstance(value, str) else ""
    unit = unit if unit in dimension.scales else units.normal_unit(unit)
    if unit not in dimension.scales or not unit:
        unit = "deg" if dimension is units.ANGLE else dimension.usual[0] if dimension.usual else dimension.si
    return Number(key, reader, number, unit if unit in dimension.scales else "")


def _found(tree: dict[str, Any], key: str) -> tuple[Reader, Any]:
    """Go down to a key: its reader, of whatever form, and what the file says there, None if nothing."""
    reader: Reader = MISSION
    value: Any = tree
    parts = parts_of(key)
    while parts:
        reader = form_of(reader, value)
        name, rest = next_name(value, parts)
        part, parts = (parts[0], parts[1:]) if name is None else (str(name), rest)
        inner = reader.below(part)
        if inner is None and isinstance(value, str):
            raise QuestionError(f"{shown(key)}: the file has {shown(value)!r} there, which has no {shown(part)!r}")
        if inner is None:
            known = f"accepted: {', '.join(reader.keys)}" if isinstance(reader, Section) else ""
            problem = fault_words(f"{shown(part)!r} is not a known key", "", known, nearest_keys(key))
            raise QuestionError(f"{shown(key)}: {problem}")
        if isinstance(reader, ListOf | TextList | Triple):
            listed = value if isinstance(value, list) else []
            if int(part) >= len(listed):
                entries = f"{len(listed)} entr{'y' if len(listed) == 1 else 'ies'}"
                raise QuestionError(f"{key}: the list has {entries}, and none has the number {part}")
            value = listed[int(part)]
        else:
            value = value.get(part) if isinstance(value, dict) else None
        reader, value = inner, None if value is INVALID else value
    return reader, value


def form_of(reader: Reader, value: Any) -> Reader:
    """Find the form of a reader that reads a value."""
    while isinstance(reader, OneOf):
        reader = reader.pick(value)
    return reader


class Range(NamedTuple):
    """Where a question looks: from `low` to `high` in SI, `is_log` in steps of a ratio, `is_circle` once around."""

    low: float
    high: float
    is_log: bool
    is_circle: bool = False

    def places(self, count: int) -> list[float]:
        """Spread `count` values over the range, its ends among them."""
        parts = [index / (count - 1) for index in range(1, count - 1)]
        if self.is_log:
            between = [self.low * (self.high / self.low) ** part for part in parts]
        else:
            between = [self.low + (self.high - self.low) * part for part in parts]
        return [self.low, *between, self.high]


def range_of(number: Number, between: str | None) -> Range:
    """Read `A..B`; without it two decades around the file's value, angles from end to end.

    Raises
    ------
    QuestionError
        No range, an empty one, values that the key cannot have, or no value to look around.
    """
    gt, ge, lt, le = number.reader.bounds
    if between is None:
        if number.reader is DIRECTION:
            return Range(0.0, 2 * math.pi, is_log=False, is_circle=True)
        if number.reader in (ELEVATION, LATITUDE):
            return Range(ge, le, is_log=False)
        is_level = number.dimension in (units.POWER_RATIO, units.TONE, units.PHASE_NOISE)
        if number.value is None or (number.value == 0 and not is_level):
            said = "is 0" if number.value == 0 else "has no value"
            raise QuestionError(f"{number.key}: {said} in the file; say where to look, --between A..B")
        ends = sorted((number.value / _DECADE, number.value * _DECADE))
        if is_level:  # its decades are 20 dB
            ends = [number.value - 20.0, number.value + 20.0]
        low, high = max(ends[0], ge, gt), min(ends[1], le, lt)
        low, high = (low * (1 + 1e-9) if low == gt else low), (high * (1 - 1e-9) if high == lt else high)
    else:
        option = f"--between {shown(between)}"
        first, dots, last = (part.strip() for part in between.partition(".."))
        if not dots:
            example = (1.0, 10.0) if number.value is None else (number.value / 2, number.value * 2)
            said = "..".join(map(number.text, example)).replace(" ", "")
            raise QuestionError(f"{option}: is no range; accepted: A..B, such as {said}")
        if first and not units.unit_behind(first):  # 1..10 km starts at 1 km
            first += f" {units.unit_behind(last)}".rstrip()
        found = []
        for text in (first, last):
            try:
                found.append(number.reader.leaf(text))
            except InvalidValueError as error:
                raise QuestionError(f"{option}: {shown(text)!r} {error.problem.words}") from None
        low, high = found
    if not low < high:
        raise QuestionError(
            f"--between {shown(between or '')}: is {'empty' if low == high else 'reversed'}; accepted: A < B"
        )
    return Range(low, high, is_log=low > 0 and high / low >= 4)


# ---------------------------------------------------------------- a number in its place
# Sections that a file may leave out, and keys whose scalar stands for each of three axes.
_SECTIONS: Mapping[str, Callable[[], Any]] = {
    "imu": Imu,
    "lever_arm": LeverArm,
    "common_motion_error": CommonMotionError,
    "simulation": Simulation,
}
_TRIPLES = ("position", "velocity", "acceleration", *IMU_KINDS, "uncertainty")
# Curves of an oscillator, with the dimension of what their points are named by.
_CURVES: Mapping[str, Dimension] = {
    "phase_noise": units.FREQUENCY,
    "spurs": units.FREQUENCY,
    "allan_deviation": units.TIME,
    "spectrum": units.FREQUENCY,
}


def with_number(mission: Mission, key: str, number: Any) -> Mission:
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


def _with_point(curve: Any, name: str, point: str, number: Any) -> Any:
    """A curve with another ordinate at one of its points."""
    if isinstance(curve, Spectrum):
        return curve._replace(points=_with_point(curve.points, name, point, number))
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


def value_at(mission: Mission, key: str) -> Any:
    """Find what a mission has in the place of a key, in SI: a number, a tuple of one for each axis, or None.

    Of a covariance it is the sigma, of a figure of a part that figure.
    """
    return _value_below(mission, parts_of(key))


def _value_below(value: Any, parts: Sequence[str]) -> Any:
    if not parts or value is None:
        return value
    if isinstance(value, Covariance):
        return _element(value, parts)
    part, *rest = parts
    if part.isdigit():
        return _value_below(value[int(part)], rest) if int(part) < len(value) else None
    if part in _CURVES:
        return _point(getattr(value, part), part, ".".join(rest))
    if isinstance(value, MotionError) and part in ("position", "velocity", "acceleration"):
        return _value_below(value.stated(part), rest)
    return _value_below(getattr(value, POWERS.get(part, part)), rest)


def _point(curve: Any, name: str, point: str) -> Any:
    points = curve.points if isinstance(curve, Spectrum) else curve or ()
    here = parse_quantity(point, _CURVES[name])
    return next((ordinate for at, ordinate in points if at == here), None)


def _element(covariance: Covariance, parts: Sequence[str]) -> Any:
    kind, *axis = parts
    if kind not in KINDS:
        return None  # a correlation is no size
    return covariance.of(kind)[int(axis[0])] if axis else covariance.of(kind)


# ---------------------------------------------------------------- sizes that errors are held to
def with_specifications(mission: Mission, tree: Tree) -> Mission:
    """Read the sizes of `specifications`, each as the number of its key; what is wrong is a fault of the tree."""
    read = {}
    for key, text in mission.specifications.items():
        path = ("specifications", key)
        if not is_error(key):
            tree.report(path, Problem("names no error that can be specified", ACCEPTED_ERRORS, is_of_key=True))
            continue
        try:
            number = number_of(tree.root, key, is_for_each=True)
        except QuestionError as error:
            problem, _, accepted = str(error).removeprefix(f"{key}: ").partition("; ")
            tree.report(path, Problem(problem, accepted, is_of_key=True))
            continue
        size = number.reader.read(text, path, tree.report)
        if size is INVALID:
            continue
        if size <= 0 and not number.is_level:
            tree.report(path, Problem("must be greater than 0", "accepted: the largest size that the error may have"))
        read[key] = as_number(key, number.reader, text)._replace(value=size)
    return mission._replace(specifications=read)


def largest_at(mission: Mission, number: Number) -> Any:
    """Find the size that a mission states for an error: of three axes the largest; None where it states none.

    A spectrum without a level has 0 dB.
    """
    value = value_at(mission, number.key)
    if value is None and parts_of(number.key)[-1] in ("level", "spectrum_level"):
        *section, _ = parts_of(number.key)
        owner = _value_below(mission, section)
        has_curve = owner is not None and (section[-1] == "oscillator" or owner.spectrum is not None)
        return 0.0 if has_curve else None
    if number.is_level or value is None:
        return value
    each = [np.abs(one) for one in (value if isinstance(value, tuple) else (value,))]
    return functools.reduce(np.maximum, each)


# ---------------------------------------------------------------- values that a caller gives
def changed(mission: Mission, values: Mapping[str, Any]) -> Mission:
    """A mission with other values in place of the file's, and beside them, as `--set` puts them.

    Parameters
    ----------
    mission : Mission
        As loaded.
    values : mapping of str to str, float, sequence, quantity or None
        By the path of a key in the mission file, such as `collection.aperture_time`: a text as the file would have
        it, `"8 s"`; a number in SI; a list of three; a quantity of pint or astropy; None takes the key out.

    Raises
    ------
    MissionError
        The mission cannot be used with them; a key is unknown.
    """
    tree = tree_of(mission)
    changes = [SetValue(key, text_of(_si_of(tree, key), value)) for key, value in values.items()]
    return parse_mission(mission.data, mission.file, changes=(*mission.changes, *changes))


def _si_of(tree: dict[str, Any], key: str) -> str:
    """SI unit of a key's numbers; empty where it has none, or where three numbers stand for one."""
    for one in (key, f"{key}.0"):
        try:
            return number_of(tree, one).dimension.si
        except QuestionError:
            continue
    return ""


def text_of(si: str, value: Any) -> str:
    """A text, number, quantity, list of them, or None as a mission file has it; numbers are in the SI unit.

    Raises
    ------
    TypeError
        It is none of them.
    """
    if isinstance(value, str):
        return value
    if value is None:
        return "null"
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if is_quantity(value):
        unit = si or _unit_of(value)
        return text_of(unit, magnitude(value, unit))
    if isinstance(value, numbers.Real):
        return f"{float(value)!r} {si}".rstrip() if not isinstance(value, numbers.Integral) or si else str(int(value))
    if isinstance(value, Sequence | np.ndarray):
        return f"[{', '.join(text_of(si, one) for one in value)}]"
    raise TypeError(
        f"{type(value).__name__} is no value of a mission; accepted: text with its unit, number, list, None"
    )


# Quantities of other packages are known by what they do: no such package has to be there.
def is_quantity(value: Any) -> bool:
    """Whether a value is a quantity of astropy, which has `to_value`, or of pint, which has a magnitude."""
    return hasattr(value, "to_value") or (hasattr(value, "magnitude") and hasattr(value, "units"))


def magnitude(value: Any, unit: str) -> Any:
    """The number, or the array, of a quantity in a unit."""
    if hasattr(value, "to_value"):
        return value.to_value(unit)
    return value.to(unit.replace("^", "**") or "dimensionless").magnitude


def _unit_of(value: Any) -> str:
    """The unit that a quantity is said in, as a mission file writes it."""
    said = str(value.unit) if hasattr(value, "to_value") else f"{value.units:~}"
    return said.replace("**", "^").replace(" ", "")
