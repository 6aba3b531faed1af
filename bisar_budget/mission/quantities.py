"""Access to the numbers of a mission and their units: a number is read, or replaced, by means of its key.

A new value may be a string as in a mission file, a number in SI units, or a quantity of astropy or pint.
"""

import functools
import math
import numbers
from collections.abc import Callable, Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from bisar_budget import units
from bisar_budget.arrays import PerCase
from bisar_budget.error_kinds.kind import SourceKind
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.error_kinds.registry import kinds
from bisar_budget.faults import Fault, InvalidValueError, Problem, SetValue, fault_words, printable, shown
from bisar_budget.geometry import Vector
from bisar_budget.json_types import JsonObject
from bisar_budget.mission.changes import (
    ACCEPTED_ERRORS,
    apply_changes,
    is_error,
    nearest_keys,
    next_name,
    parts_of,
)
from bisar_budget.mission.covariance import MOTION_KINDS, Covariance, error_index
from bisar_budget.mission.instruments import POWERS, Imu, LeverArm
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import MISSION, Mission, OtherError, Requirements, Simulation, TimingError
from bisar_budget.mission.navigation import OUTAGE_KEYS
from bisar_budget.mission.platforms import CommonMotionError, MotionError
from bisar_budget.mission.propagation import LegDelay, Propagation
from bisar_budget.mission.readers import (
    BIAS_FIELD,
    CONFIDENCE_FIELD,
    DIRECTION,
    ELEVATION,
    INVALID,
    LATITUDE,
    SIZE_FIELD,
    ListOf,
    OneOf,
    Paired,
    Quantity,
    Reader,
    Section,
    SectionValue,
    TextList,
    Triple,
)
from bisar_budget.mission.tree import Content, Tree, read_tree
from bisar_budget.mission.uncertain import take_uncertainties
from bisar_budget.mission.vibrations import Spectrum
from bisar_budget.units import Dimension, parse_quantity

ANSWER_DIGITS = 8  # of values in answers; rounding up and rounding down differ by less than 1e-6 of a value
_DECADE_RATIO = 10.0
Measured = Any
"""A quantity of astropy or pint, which need not be installed, or its magnitude: a number or an array."""
FACTOR = Quantity(units.RATIO, gt=0, ge=1e-12, le=1e12)


class QuestionError(Exception):
    """A question that a mission cannot answer; the message says why, and what is accepted.

    A question is a request such as a search for a value, or a sweep over a key.
    """


class TableError(QuestionError):
    """A table of cases that cannot be read; `lines` has a line for each fault, `file:line:column: fault`."""

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = list(lines)
        super().__init__("\n".join(self.lines))

    @classmethod
    def of_faults(cls, file: str, faults: Sequence[Fault]) -> "TableError":
        """Make an error from faults, each with its line and column in the file."""
        return cls([f"{printable(file)}:{fault.line}:{fault.column}: {fault}" for fault in faults])

    @classmethod
    def of_file(cls, file: str, problem: str) -> "TableError":
        """Make an error from a problem that concerns the file as a whole."""
        return cls([f"Error: {printable(file)}: {printable(problem)}"])


class Number(NamedTuple):
    """A number of the file: its reader, its value in SI (None if the file has none) and the unit of its texts.

    The unit is used when values of the number are written as text.
    """

    key: str
    reader: Quantity
    value: float | None
    unit: str

    @property
    def dimension(self) -> Dimension:
        """Kind of quantity of the number, such as a length, with its units."""
        return self.reader.dimension

    @property
    def is_level(self) -> bool:
        """Whether the number is a level in decibels."""
        return self.dimension in units.LEVELS

    @property
    def scale(self) -> tuple[float, float]:
        """Factor and divisor that convert a value from the unit of the number to SI: value · factor / divisor."""
        return self.dimension.scales.get(self.unit) or (1.0, 1.0)

    def text(self, value: float, *, is_up: bool | None = None) -> str:
        """Format a value, given in SI, in the unit of the number with `ANSWER_DIGITS` significant digits.

        The value is rounded up if `is_up` is true, down if it is false, and to the nearest if it is None.
        """
        factor, divisor = self.scale
        number = value / factor * divisor
        if is_up is not None:
            context = Context(prec=ANSWER_DIGITS, rounding=ROUND_CEILING if is_up else ROUND_FLOOR)
            number = float(context.create_decimal(repr(number)))
        return f"{number:.{ANSWER_DIGITS}g}{' ' if self.unit else ''}{self.unit}"

    def said_like(self, between: str | None) -> "Number":
        """Copy of the number whose unit is the unit of `B` in the string `between`, which has the form `A..B`.

        The number is returned unchanged if the file has a value, or if the unit of `B` belongs to another kind of
        quantity.
        """
        unit = units.unit_behind((between or "").rpartition("..")[2])
        unit = unit if unit in self.dimension.scales else units.normal_unit(unit)
        return self._replace(unit=unit) if self.value is None and unit in self.dimension.scales and unit else self

    def read(self, text: str) -> float:
        """Convert a string, as written by the method `text`, to a value in SI.

        Apart from rounding errors, the result equals the value that the reader of mission files returns for the
        string.
        """
        return parse_quantity(text, self.dimension)


class Choices(NamedTuple):
    """A key with a word instead of a number: a choice, a part of the catalogue, a file, a whole number.

    `value` is the word in the file; None if the file has no value, or has a list or a section.
    """

    key: str
    reader: Reader[object]
    value: str | None
    unit: str = ""
    scale: tuple[float, float] = (1.0, 1.0)


Varied = Number | Choices


def tree_of(mission: Mission) -> JsonObject:
    """Content of a mission file with the values set by `--set` options, as nested lists and mappings of strings.

    Uncertainties of figures are left out.
    """
    tree = read_tree(mission.data or b"", mission.file)
    apply_changes(tree, mission.changes)
    if mission.uncertainties:
        take_uncertainties(tree)
    root: JsonObject = tree.root
    return root


def number_of(tree: JsonObject, key: str, of_all: str = "", *, is_for_each: bool = False) -> Number:
    """Find the number at a key, with its unit; a single value that applies to all three axes counts as a number.

    The size of an error with a bias is its sigma, and a requirement with a confidence has its limit as the number.
    The key of the result is then that of the sigma or the limit, so that a new number leaves the other value alone.

    Parameters
    ----------
    tree : dict
        Content of the file; values are strings.
    key : str
        Path of the key.
    of_all : str
        Phrase about other accepted keys, which is added to the error message about a key with three numbers.
    is_for_each : bool
        Whether a single number is needed that applies to each axis. If the file has three values, the value with the
        largest magnitude is then used.

    Raises
    ------
    QuestionError
        The key does not exist or has no number.
    """
    reader, value = _reader_and_value(tree, key)
    if isinstance(reader, Paired) and isinstance(value, dict):
        return number_of(tree, f"{key}.{reader.name_of_number}", of_all, is_for_each=is_for_each)
    reader = form_of(reader, value)
    if isinstance(reader, Triple):
        if is_for_each and reader.or_scalar and isinstance(value, list):
            components = [as_number(key, reader.component, text) for text in value]
            return max(components, key=lambda component: abs(component.value or 0.0))
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


def choices_of(tree: JsonObject, key: str, text: str) -> Choices | None:
    """Describe a key whose values are words, and its current value; None for a key with other values.

    `text` is the new value. If a key accepts values of several forms, this value determines the form. For example,
    `allocation.split` is either the name of a rule or a set of shares, and `sensor` is either the name of one
    catalogue part or a list of such names. Raises `QuestionError` if the key does not exist, or if the file has a
    list and `text` is a single word.
    """
    reader, value = _reader_and_value(tree, key)
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


def as_number(key: str, reader: Quantity, value: object) -> Number:
    """Make the `Number` of a key from its value in the file.

    Its unit is the unit of the value, or the usual unit if the value is written without a unit. `value` is None if
    the file has no value.
    """
    dimension = reader.dimension
    number = parse_quantity(value, dimension) if isinstance(value, str) else value if type(value) is float else None
    unit = units.unit_behind(value) if isinstance(value, str) else ""
    unit = unit if unit in dimension.scales else units.normal_unit(unit)
    if unit not in dimension.scales or not unit:
        unit = "deg" if dimension is units.ANGLE else dimension.usual[0] if dimension.usual else dimension.si
    return Number(key, reader, number, unit if unit in dimension.scales else "")


def _reader_and_value(tree: JsonObject, key: str) -> tuple[Reader[object], Content]:
    """Return the reader of a key, and the value of the key in the file; the value is None if it is missing.

    The reader may still be a choice between several forms; see `form_of`. Raises `QuestionError` if the key does not
    exist.
    """
    reader: Reader[object] = MISSION
    value: Content = tree
    steps = parts_of(key)
    while steps:
        if isinstance(reader, Paired) and not isinstance(value, dict) and steps[0] in reader.pair.keys:
            value = reader.as_section(value)  # a size alone is a sigma, and a limit alone has no confidence
        reader = form_of(reader, value)
        name, remaining = next_name(value, steps)
        child, steps = (steps[0], steps[1:]) if name is None else (str(name), remaining)
        inner = reader.below(child)
        if inner is None and isinstance(value, str):
            raise QuestionError(f"{shown(key)}: the file has {shown(value)!r} there, which has no {shown(child)!r}")
        if inner is None:
            accepted = f"accepted: {', '.join(reader.keys)}" if isinstance(reader, Section) else ""
            problem = fault_words(f"{shown(child)!r} is not a known key", "", accepted, nearest_keys(key))
            raise QuestionError(f"{shown(key)}: {problem}")
        if isinstance(reader, ListOf | TextList | Triple):
            entries_read = value if isinstance(value, list) else []
            if int(child) >= len(entries_read):
                entries = f"{len(entries_read)} entr{'y' if len(entries_read) == 1 else 'ies'}"
                raise QuestionError(f"{key}: the list has {entries}, and none has the number {child}")
            value = entries_read[int(child)]
        else:
            value = value.get(child) if isinstance(value, dict) else None
        reader, value = inner, None if value is INVALID else value
    return reader, value


def form_of(reader: Reader[object], value: object) -> Reader[object]:
    """Return the reader of the form in which `value` is written; `reader` itself if it accepts only one form."""
    while isinstance(reader, OneOf):
        reader = reader.pick(value)
    return reader


class Range(NamedTuple):
    """Range of a search: from `low` to `high` in SI; `is_log` with steps of equal ratio, `is_circle` once around.

    The search tries values in this range. The ratio of successive values is constant if `is_log`; otherwise their
    difference is constant. If `is_circle`, the values are directions, and the range is a full circle.
    """

    low: float
    high: float
    is_log: bool
    is_circle: bool = False

    def places(self, count: int) -> list[float]:
        """Divide the range into `count` values, including both ends.

        The values are evenly spaced, or have equal ratios if `is_log`.
        """
        fractions = [index / (count - 1) for index in range(1, count - 1)]
        if self.is_log:
            between = [self.low * (self.high / self.low) ** fraction for fraction in fractions]
        else:
            between = [self.low + (self.high - self.low) * fraction for fraction in fractions]
        return [self.low, *between, self.high]


def range_of(number: Number, between: str | None) -> Range:
    """Range in which the value of a number is searched for, read from a string `A..B`.

    If `between` is None, the range extends from the value in the file by one decade, or by 20 dB for a level, to each
    side. For a direction it is then the full circle, and for an elevation or a latitude it covers all accepted
    values.

    Raises
    ------
    QuestionError
        `between` is not a range, is empty, or contains values that the key cannot have; or it is None and the file
        has no value around which a range could be chosen.
    """
    gt, ge, lt, le = number.reader.bounds
    if between is None:
        if number.reader is DIRECTION:
            return Range(0.0, 2 * math.pi, is_log=False, is_circle=True)
        if number.reader in (ELEVATION, LATITUDE):
            return Range(ge, le, is_log=False)
        is_level = number.dimension in (units.POWER_RATIO, units.TONE, units.PHASE_NOISE)
        if number.value is None or (number.value == 0 and not is_level):
            problem = "is 0" if number.value == 0 else "has no value"
            raise QuestionError(f"{number.key}: {problem} in the file; say where to look, --between A..B")
        ends = sorted((number.value / _DECADE_RATIO, number.value * _DECADE_RATIO))
        if is_level:  # its decades are 20 dB
            ends = [number.value - 20.0, number.value + 20.0]  # [dB]
        low, high = max(ends[0], ge, gt), min(ends[1], le, lt)
        low, high = (low * (1 + 1e-9) if low == gt else low), (high * (1 - 1e-9) if high == lt else high)
    else:
        option = f"--between {shown(between)}"
        first, dots, last = (end.strip() for end in between.partition(".."))
        if not dots:
            example = (1.0, 10.0) if number.value is None else (number.value / 2, number.value * 2)
            example_range = "..".join(map(number.text, example)).replace(" ", "")
            raise QuestionError(f"{option}: is no range; accepted: A..B, such as {example_range}")
        if first and not units.unit_behind(first):  # 1..10 km starts at 1 km
            first += f" {units.unit_behind(last)}".rstrip()
        ends_read = []
        for text in (first, last):
            try:
                ends_read.append(number.reader.leaf(text))
            except InvalidValueError as error:
                raise QuestionError(f"{option}: {shown(text)!r} {error.problem.words}") from None
        low, high = ends_read
    if not low < high:
        raise QuestionError(
            f"--between {shown(between or '')}: is {'empty' if low == high else 'reversed'}; accepted: A < B"
        )
    return Range(low, high, is_log=low > 0 and high / low >= 4)


# ---------------------------------------------------------------- numbers of a mission
# Sections that a file may omit, and keys whose scalar holds for each of three axes.
_OMITTED_SECTIONS: Mapping[str, Callable[[], object]] = {
    "imu": Imu,
    "lever_arm": LeverArm,
    "common_motion_error": CommonMotionError,
    "simulation": Simulation,
}
_STATE_NAMES = tuple(kind.name for kind in STATE_KINDS)
_FIELDS_BY_KEY = {**POWERS, **OUTAGE_KEYS}  # of keys that cannot be names of fields
_TRIPLES = frozenset(
    kind.path("", axis)[-1]
    for kind in kinds()
    if isinstance(kind, SourceKind)
    for axis, size in kind.sizes.items()
    if size.has_axes
)
# Curves of an oscillator, with the dimension of their abscissas, which name the points.
_CURVE_ABSCISSAS: Mapping[str, Dimension] = {
    "phase_noise": units.FREQUENCY,
    "spurs": units.FREQUENCY,
    "allan_deviation": units.TIME,
    "spectrum": units.FREQUENCY,
}


_WITH_BIASES = (MotionError, CommonMotionError, TimingError, LegDelay, Propagation, OtherError)
_PLAIN_FIELDS = (SIZE_FIELD, "limit")  # of pairs of a number and its bias or confidence


def with_number(mission: Mission, key: str, number: SectionValue) -> Mission:
    """Return a mission in which the value of a key is replaced by a number, or by an array (cases,)."""
    changed_mission: Mission = _with_value(mission, parts_of(key), number)
    return changed_mission


def _with_value(value: SectionValue, steps: Sequence[str], number: SectionValue) -> SectionValue:
    """Return a copy of a section or value in which the number at the path `steps` is replaced.

    If the value has three components, each of them is replaced.
    """
    if not steps:
        return (number, number, number) if isinstance(value, tuple) else number
    if isinstance(value, Covariance):
        return _with_element(value, steps, number)
    name, *remaining = steps
    if remaining and remaining[0] in _PLAIN_FIELDS and isinstance(value, (*_WITH_BIASES, Requirements)):
        remaining = remaining[1:]  # the section keeps the size under the key itself
    elif remaining and remaining[0] == BIAS_FIELD and isinstance(value, _WITH_BIASES):
        bias = value.bias.get(name)
        changed_bias = _with_value(() if bias is None and name in _TRIPLES else bias, remaining[1:], number)
        return value._replace(bias={**value.bias, name: changed_bias})
    if name.isdigit():
        index = int(name)
        return (*value[:index], _with_value(value[index], remaining, number), *value[index + 1 :])
    if name in _CURVE_ABSCISSAS:
        return value._replace(**{name: _with_point(getattr(value, name), name, ".".join(remaining), number)})
    name = _FIELDS_BY_KEY.get(name, name)
    below = getattr(value, name)
    if below is None and remaining:
        below = _OMITTED_SECTIONS[name]()
    if below is None and name in _TRIPLES:
        below = ()
    if name == "registered":
        return value._replace(registered={**below, remaining[0]: number})
    return value._replace(**{name: _with_value(below, remaining, number)})


def _with_point(curve: SectionValue, name: str, point: str, number: SectionValue) -> SectionValue:
    """Return a curve in which the ordinate of one point is replaced.

    `name` is the key of the curve, and `point` is the abscissa of the point as text, such as "10 Hz".
    """
    if isinstance(curve, Spectrum):
        return curve._replace(points=_with_point(curve.points, name, point, number))
    here = parse_quantity(point, _CURVE_ABSCISSAS[name])
    return tuple((at, number if at == here else ordinate) for at, ordinate in curve)


def _with_element(covariance: Covariance, steps: Sequence[str], number: SectionValue) -> Covariance:
    """Return a covariance in which sigmas or a correlation are replaced by a number.

    `steps` name a single axis, all axes of "position" or "velocity", or a pair of correlated errors.
    """
    kind, *remaining = steps
    if kind in MOTION_KINDS:
        first = 3 * MOTION_KINDS.index(kind)
        changed_indices = [first + int(axis) for axis in remaining] or range(first, first + 3)
        sigmas = tuple(number if index in changed_indices else sigma for index, sigma in enumerate(covariance.sigmas))
        return covariance._replace(sigmas=sigmas)
    pair = {error_index(name.strip()) for name in ".".join(remaining).split("-")}
    rows = [
        tuple(number if i != j and {i, j} == pair else rho for j, rho in enumerate(row))
        for i, row in enumerate(covariance.correlation)
    ]
    return covariance._replace(correlation=tuple(rows))


def value_at(mission: Mission, key: str) -> SectionValue:
    """Value of a key of a mission, in SI: a number, a tuple of three numbers, or None if there is no value.

    For a covariance, the sigma is returned. For a figure that comes from a part, the part's figure is returned.
    """
    return _value_below(mission, parts_of(key))


def _value_below(value: SectionValue, steps: Sequence[str]) -> SectionValue:
    """Value at the path `steps` inside a section or a value; None if there is no such value."""
    if not steps or value is None:
        return value
    if isinstance(value, Covariance):
        return _element(value, steps)
    name, *remaining = steps
    if isinstance(value, dict):
        return value.get(name)
    if name.isdigit():
        return _value_below(value[int(name)], remaining) if int(name) < len(value) else None
    if name in _CURVE_ABSCISSAS:
        return _point(getattr(value, name), name, ".".join(remaining))
    first, *further = remaining or ("",)
    if isinstance(value, Requirements) and first == CONFIDENCE_FIELD:
        return value.confidence_of(name)
    if isinstance(value, _WITH_BIASES) and first == BIAS_FIELD:
        return _value_below(value.bias.get(name), further)
    if isinstance(value, (*_WITH_BIASES, Requirements)) and first in _PLAIN_FIELDS:
        remaining = further
    if isinstance(value, MotionError) and name in _STATE_NAMES:
        return _value_below(value.stated(name), remaining)
    return _value_below(getattr(value, _FIELDS_BY_KEY.get(name, name)), remaining)


def _point(curve: SectionValue, name: str, point: str) -> PerCase | None:
    """Ordinate of a curve at one of its points; None if the curve has no such point.

    `name` is the key of the curve, and `point` is the abscissa of the point as text, such as "10 Hz".
    """
    points = curve.points if isinstance(curve, Spectrum) else curve or ()
    here = parse_quantity(point, _CURVE_ABSCISSAS[name])
    return next((ordinate for at, ordinate in points if at == here), None)


def _element(covariance: Covariance, steps: Sequence[str]) -> float | Vector | None:
    """Sigma of a covariance along one axis, or the sigmas along all three axes.

    The first of `steps` is "position" or "velocity". Any other key names a correlation; the result is then None,
    because a correlation is not the size of an error.
    """
    kind, *axis = steps
    if kind not in MOTION_KINDS:
        return None
    return covariance.of(kind)[int(axis[0])] if axis else covariance.of(kind)


# ---------------------------------------------------------------- specified sizes of errors
def with_specifications(mission: Mission, tree: Tree) -> Mission:
    """Return a mission in which each specified size of an error has been converted to a `Number`.

    Each entry of `specifications` is parsed in the same way as the declared size of that error. Invalid entries are
    reported as faults in `tree`.
    """
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


def largest_at(mission: Mission, number: Number) -> PerCase | None:
    """Size, in SI, that a mission states for the error to which `number` belongs; None if no size is stated.

    If there are three components, the size is their largest absolute value. If a spectrum is stated without a level,
    the size of its level is 0 dB.
    """
    value: Vector | PerCase | None = value_at(mission, number.key)
    if value is None and parts_of(number.key)[-1] in ("level", "spectrum_level"):
        *section, _ = parts_of(number.key)
        owner = _value_below(mission, section)
        has_curve = owner is not None and (section[-1] == "oscillator" or owner.spectrum is not None)
        return 0.0 if has_curve else None
    if value is None:
        return None
    if number.is_level and not isinstance(value, tuple):
        return value
    sizes = [np.abs(size) for size in (value if isinstance(value, tuple) else (value,))]
    largest: PerCase = functools.reduce(np.maximum, sizes)
    return largest


# ---------------------------------------------------------------- values that a caller gives
def changed(mission: Mission, values: Mapping[str, object]) -> Mission:
    """Return a mission in which some values are changed or added, as with the option `--set`.

    Parameters
    ----------
    mission : Mission
        The mission as loaded.
    values : mapping of str to str, float, sequence, quantity or None
        New values by the paths of their keys in the mission file, such as `collection.aperture_time`. A value is a
        string as in a file, such as `"8 s"`; a number in SI; a list of three numbers; or a quantity of pint or
        astropy. None removes the key.

    Raises
    ------
    MissionError
        The mission cannot be used with the new values, or a key is unknown.
    """
    tree = tree_of(mission)
    changes = [SetValue(key, text_of(_si_of(tree, key), value)) for key, value in values.items()]
    return parse_mission(mission.data, mission.file, changes=(*mission.changes, *changes))


def _si_of(tree: JsonObject, key: str) -> str:
    """SI unit of the number or numbers at a key; empty if the key has no number with a unit."""
    for number_key in (key, f"{key}.0"):
        try:
            return number_of(tree, number_key).dimension.si
        except QuestionError:
            continue
    return ""


def text_of(si: str, value: object) -> str:
    """Format a value as text for a mission file: a string, number, boolean, quantity, None, or a list of such values.

    Numbers are in the SI unit `si`; if it is empty, they are written without a unit. None becomes `null`, which
    removes a key.

    Raises
    ------
    TypeError
        The value is of another type.
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
        return f"[{', '.join(text_of(si, item) for item in value)}]"
    raise TypeError(
        f"{type(value).__name__} is no value of a mission; accepted: text with its unit, number, list, None"
    )


# Quantities of other packages are recognised by their attributes, so that no such package has to be installed.
def is_quantity(value: object) -> TypeGuard[Measured]:
    """Whether a value is a quantity of astropy, which has a method `to_value`, or of pint, which has a magnitude."""
    return hasattr(value, "to_value") or (hasattr(value, "magnitude") and hasattr(value, "units"))


def magnitude(value: Measured, unit: str) -> Measured:
    """Convert a quantity of astropy or pint to a unit, and return the number or array without the unit."""
    if hasattr(value, "to_value"):
        return value.to_value(unit)
    return value.to(unit.replace("^", "**") or "dimensionless").magnitude


def _unit_of(value: Measured) -> str:
    """Unit of a quantity of astropy or pint, spelt as in a mission file, such as `m/s^2`."""
    unit = str(value.unit) if hasattr(value, "to_value") else f"{value.units:~}"
    return unit.replace("**", "^").replace(" ", "")
