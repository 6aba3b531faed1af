"""The cases of a sweep: which keys of a mission vary, and their values in each case."""

import math
import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bisar_budget.design.quantities import Number, QuestionError, number_of
from bisar_budget.faults import Fault, InvalidValueError, printable, shown
from bisar_budget.mission.bounds import DIRECTION
from bisar_budget.mission.changes import parts_of
from bisar_budget.units import Dimension, normal_unit, parse_quantity

Floats = NDArray[np.float64]

MAX_VALUES = 10_000_000  # of one key, and of all keys of a table: 80 MB
LARGEST_TABLE = 256 << 20  # characters: of as many values, each of seventeen digits with sign and exponent
_FAULTS = 20  # of a table that are said
_STRETCHES, _GOLDEN = 100, (math.sqrt(5) - 1) / 2  # no step of a grid meets the same values again and again
_DIGITS = 15  # decimal ones that a float always holds
_NUMBER = re.compile(r"^\s*[+-]?[\d.]*(?:[eE][+-]?\d+)?\s*", re.ASCII)
_RANGE = "accepted: KEY=FROM:TO UNIT:COUNT, such as {key}=1:10 s:91, with :log behind it for equal ratios"
_FORMS = "accepted: KEY=FROM:TO UNIT:COUNT or KEY=VALUE,VALUE,..., such as collection.aperture_time=1:10s:91"
_LATIN = "accepted: latin:COUNT:SEED, such as latin:10000:1"
_HEADER = re.compile(r"^([^\[\]\s]+(?:\[\d+\][^\[\]\s]*)*)\s*(?:\[([^\[\]]*)\])?$", re.ASCII)


class Cases(Protocol):
    """Cases by their number, from 0 to `count`.

    `shape` has one entry for each key where all combinations are cases, the last key the fastest; else it is None.
    """

    @property
    def numbers(self) -> tuple[Number, ...]:
        """The keys that vary, each with the unit that its values were given in."""

    @property
    def count(self) -> int:
        """Number of cases."""

    @property
    def shape(self) -> tuple[int, ...] | None:
        """Number of values of each key of a grid."""

    def values(self, start: int, stop: int) -> Mapping[str, Floats]:
        """Value of each key, in SI, of some cases: (stop - start,) by the key."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Every combination of the values of each key; the last key is the fastest."""

    numbers: tuple[Number, ...]
    axes: tuple[Floats, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each key."""
        return tuple(axis.size for axis in self.axes)

    @property
    def count(self) -> int:
        """Number of cases; beyond what an array could hold too."""
        return math.prod(self.shape)

    def values(self, start: int, stop: int) -> Mapping[str, Floats]:
        """Value of each key, in SI, of some cases: (stop - start,) by the key."""
        places = np.unravel_index(np.arange(start, stop), self.shape)
        return {number.key: axis[place] for number, axis, place in zip(self.numbers, self.axes, places, strict=True)}


@dataclass(frozen=True, eq=False)
class Table:
    """Cases of which each has a value of its own of every key: one column, in SI, for each."""

    numbers: tuple[Number, ...]
    columns: tuple[Floats, ...]
    shape: None = None

    @property
    def count(self) -> int:
        """Number of cases."""
        return self.columns[0].size

    def values(self, start: int, stop: int) -> Mapping[str, Floats]:
        """Value of each key, in SI, of some cases: (stop - start,) by the key."""
        return {number.key: column[start:stop] for number, column in zip(self.numbers, self.columns, strict=True)}


class TableError(QuestionError):
    """A table of cases that cannot be read: one line `file:line:column: fault` for each fault."""

    def __init__(self, file: str, faults: Sequence[Fault]) -> None:
        self.lines = [f"{printable(file)}:{fault.line}:{fault.column}: {fault}" for fault in faults]
        super().__init__("\n".join(self.lines))


class _Asked(NamedTuple):
    """One `--vary`: the number, and its listed values in SI, or its ends, the text of its count and how it goes."""

    option: str
    number: Number
    listed: tuple[float, ...] = ()
    ends: tuple[float, float] = (0.0, 0.0)
    size: str = ""
    is_log: bool = False


def grid(tree: dict[str, Any], texts: Sequence[str]) -> Grid:
    """Read `KEY=FROM:TO UNIT:COUNT`, with `:log` behind it in equal ratios, or `KEY=VALUE,VALUE,...` of each option.

    Ends belong to the range. Values are those that have as few digits in the unit given: 0:180deg:181 has 60 deg.

    Parameters
    ----------
    tree : dict
        What the mission file says, as text.
    texts : sequence of str
        What stands behind each `--vary`; an end or a value without unit has that of the last.

    Raises
    ------
    QuestionError
        No such key, no number, no range, an empty or reversed one, values that the key cannot have, a key twice.
    """
    numbers, axes = [], []
    for asked in _all_asked(tree, texts):
        numbers.append(asked.number)
        if asked.listed:
            axes.append(np.array(asked.listed))
            continue
        if not asked.size:
            raise QuestionError(f"{asked.option}: has no count of values; {_RANGE.format(key=asked.number.key)}")
        count = _count(asked.size, f"{asked.option}: the count of values", 2, "; KEY=VALUE is a single value")
        if count > MAX_VALUES:
            raise QuestionError(
                f"{asked.option}: {count} values of one key; accepted: up to {MAX_VALUES}, "
                "which are as many cases for each combination of the other keys"
            )
        axes.append(_spread(asked, np.arange(count) / (count - 1)))
    return Grid(tuple(numbers), tuple(axes))


def sample(tree: dict[str, Any], texts: Sequence[str], how: str) -> Table:
    """Draw a Latin hypercube over ranges: of as many equal parts as there are cases, each has one value of each key.

    Parameters
    ----------
    tree : dict
        What the mission file says, as text.
    texts : sequence of str
        As for a grid; counts are not used, and a list of values is refused.
    how : str
        `latin:COUNT:SEED`; the same seed gives the same cases.

    Raises
    ------
    QuestionError
        As for a grid; no such way to draw; no count or seed.
    """
    kind, *parts = (part.strip() for part in how.split(":"))
    if kind != "latin" or len(parts) != 2:
        raise QuestionError(f"--sample {shown(how)}: is no way to draw cases; {_LATIN}")
    count = _count(parts[0], f"--sample {shown(how)}: the count of cases", 1)
    if not (parts[1].isascii() and parts[1].isdigit() and len(parts[1]) <= 18):
        raise QuestionError(f"--sample {shown(how)}: the seed must be a whole number; {_LATIN}")
    rng = np.random.default_rng(int(parts[1]))
    all_asked = list(_all_asked(tree, texts))
    if count * len(all_asked) > MAX_VALUES:
        most = MAX_VALUES // len(all_asked)
        raise QuestionError(
            f"--sample {shown(how)}: {count} cases of {len(all_asked)} keys do not fit into memory; accepted: up to "
            f"{most} cases. Samples of other seeds go on from there"
        )
    columns = []
    for asked in all_asked:
        if asked.listed:
            raise QuestionError(f"{asked.option}: --sample draws from a range; {_RANGE.format(key=asked.number.key)}")
        columns.append(_spread(asked, (rng.permutation(count) + rng.random(count)) / count))
    return Table(tuple(asked.number for asked in all_asked), tuple(columns))


def _all_asked(tree: dict[str, Any], texts: Sequence[str]) -> Iterator[_Asked]:
    if not texts:
        raise QuestionError(f"no --vary: nothing would vary; {_FORMS}")
    seen: dict[tuple[str, ...], str] = {}
    for text in texts:
        asked = _asked(tree, text)
        parts = parts_of(asked.number.key)
        if parts in seen:
            raise QuestionError(f"--vary {asked.number.key}: varies twice; accepted: each key once")
        seen[parts] = text
        yield asked


def _asked(tree: dict[str, Any], text: str) -> _Asked:
    """Read one option, and hold its values to the bounds of the key."""
    key, equals, given = (part.strip() for part in text.partition("="))
    option = f"--vary {shown(text)}"
    if not (key and equals and given):
        raise QuestionError(f"{option}: does not say which values; {_FORMS}")
    number = number_of(tree, key)
    parts = [part.strip() for part in given.split(":")]
    if len(parts) == 1:
        texts = given.split(",")
        if len(texts) > MAX_VALUES:
            raise QuestionError(f"{option}: {len(texts)} values; accepted: up to {MAX_VALUES}")
        number, listed = _read(option, number, texts)
        if len(set(listed)) < len(listed):
            raise QuestionError(f"{option}: has a value twice; accepted: each once")
        return _Asked(option, number, listed=listed)
    if is_log := len(parts) > 2 and parts[-1] == "log":
        parts.pop()
    if len(parts) > 3 or "" in parts:
        raise QuestionError(f"{option}: is no range; {_RANGE.format(key=number.key)}")
    number, (low, high) = _read(option, number, parts[:2])
    if not low < high:
        kind, hint = ("empty", "; KEY=VALUE is a single value") if low == high else ("reversed", "")
        if number.reader is DIRECTION and low > high:
            hint = ". Through east, which is 0 deg, it goes from a negative angle: -10:10deg"
        raise QuestionError(f"{option}: the range is {kind}; accepted: FROM < TO{hint}")
    if is_log and low <= 0:
        raise QuestionError(f"{option}: equal ratios begin above 0; accepted: FROM > 0, or no :log")
    return _Asked(option, number, (), (low, high), parts[2] if len(parts) == 3 else "", is_log)


def _read(option: str, number: Number, texts: Sequence[str]) -> tuple[Number, tuple[float, ...]]:
    """Read values, the unit of the last for those that have none; the number is then said in it."""
    units = [normal_unit(_NUMBER.sub("", text).strip()) for text in texts]
    values = []
    for text, unit in zip(texts, units, strict=True):
        whole = f"{text.strip()} {units[-1]}" if not unit and units[-1] else text.strip()
        try:
            values.append(number.reader.leaf(whole))
        except InvalidValueError as error:
            wrong = error.problem
            parts = (f"{option}: {shown(text.strip())!r} {wrong.problem}", wrong.accepted, wrong.hint)
            raise QuestionError("; ".join(filter(None, parts))) from None
    return number._replace(unit=_said_in(units[-1], number.dimension)), tuple(values)


def _said_in(unit: str, dimension: Dimension) -> str:
    unit = unit or dimension.si
    return unit if unit in dimension.scales else ""


def _count(text: str, what: str, least: int, hint: str = "") -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 18 and int(text) >= least):
        raise QuestionError(f"{what} is {shown(text)!r}; accepted: a whole number, at least {least}{hint}")
    return int(text)


def _spread(asked: _Asked, parts: Floats) -> Floats:
    """Values at parts of the way from one end to the other, both ends as they were given."""
    low, high = asked.ends
    factor, divisor = _scale(asked.number)
    first, last = low / factor * divisor, high / factor * divisor
    given = first * (last / first) ** parts if asked.is_log else first + (last - first) * parts
    values = np.clip(_rounded(given) * factor / divisor, low, high)
    values[parts == 0], values[parts == 1] = low, high
    return values


def _scale(number: Number) -> tuple[float, float]:
    return number.dimension.scales.get(number.unit) or (1.0, 1.0)


def some_of(cases: Cases, count: int) -> Table:
    """Some cases, spread over all of them in short stretches, that stand for the others."""
    length = max(1, count // _STRETCHES)
    starts = [int((place * _GOLDEN + 0.5) % 1 * (cases.count - length)) for place in range(-(-count // length))]
    found = [cases.values(start, start + length) for start in starts]
    columns = (np.concatenate([values[number.key] for values in found]) for number in cases.numbers)
    return Table(cases.numbers, tuple(columns))


def in_unit(number: Number, values: Floats) -> Floats:
    """Values in the unit that the number is said in, with the fewest digits that give the same SI value again."""
    factor, divisor = _scale(number)
    given: Floats = values / factor * divisor
    rounded = _rounded(given)
    return np.where(rounded * factor / divisor == values, rounded, given)


def _rounded(values: Floats) -> Floats:
    """Numbers as near as decimals of `_DIGITS` digits are, so that 0.30000000000000004 is 0.3."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        power = _DIGITS - 1 - np.floor(np.log10(np.abs(values)))
        scale = 10.0 ** np.abs(power)
        found = np.where(power >= 0, np.rint(values * scale) / scale, np.rint(values / scale) * scale)
    return np.where(np.isfinite(found), found, values)


def table(tree: dict[str, Any], text: str, file: str) -> Table:
    """Read a CSV of cases: a header `KEY [unit]` for each column, then one case in each line.

    Lines that are empty or start with `#` are left out. A number alone needs no unit. Whether a value is one that the
    key can have is seen when the case is checked.

    Parameters
    ----------
    tree : dict
        What the mission file says, as text.
    text : str
        The content of the file.
    file : str
        Its name, for messages.

    Raises
    ------
    TableError
        A header that is no key with a unit of it, a key twice, a line with too few or too many cells, a cell that is
        no number, no case, too many; has every fault, up to twenty.
    """
    lines = (
        (place, line)
        for place, line in enumerate(_line_ends(text.removeprefix("\ufeff")).split("\n"), 1)
        if line.strip() and not line.lstrip().startswith("#")
    )
    place, header = next(lines, (1, ""))
    numbers, scales = _headed(tree, header, place, file)
    given = array("d")
    faults: list[Fault] = []
    for place, line in lines:
        row = _row(line, numbers, place)
        if isinstance(row, Fault):
            faults.append(row)
            if len(faults) == _FAULTS:
                break
            continue
        given.extend(row)
        if len(given) > MAX_VALUES:
            faults.append(Fault(place, 1, "", f"has more than {MAX_VALUES} values", accepted="accepted: fewer cases"))
            break
    if not given and not faults:
        faults.append(Fault(place, 1, "", "the table has no case", accepted="accepted: lines below the header"))
    if faults:
        raise TableError(file, faults)
    columns = np.array(given).reshape(-1, len(numbers)).T
    return Table(
        numbers, tuple(column * factor / divisor for column, (factor, divisor) in zip(columns, scales, strict=True))
    )


def _line_ends(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _cells(line: str) -> Iterator[tuple[int, str]]:
    """Column in characters, from 1, and text of each cell, without the quotes around it."""
    at = 1
    for cell in line.split(","):
        word = cell.strip()
        column = at + len(cell) - len(cell.lstrip())
        yield column, word[1:-1].strip() if len(word) > 1 and word[0] == word[-1] == '"' else word
        at += len(cell) + 1


def _headed(
    tree: dict[str, Any], header: str, place: int, file: str
) -> tuple[tuple[Number, ...], list[tuple[float, float]]]:
    """Keys and units of the header."""
    numbers: list[Number] = []
    scales: list[tuple[float, float]] = []
    faults: list[Fault] = []
    seen: set[tuple[str, ...]] = set()
    if not header:
        raise TableError(
            file, [Fault(place, 1, "", "has no header", accepted="accepted: KEY [unit], KEY [unit], ...")]
        )
    for column, cell in _cells(header):
        try:
            number = _column(tree, cell)
            if parts_of(number.key) in seen:
                raise InvalidValueError("stands twice", "accepted: each key once")
        except InvalidValueError as error:
            wrong = error.problem
            faults.append(Fault(place, column, shown(cell), wrong.problem, "", wrong.accepted, wrong.hint))
        except QuestionError as error:
            faults.append(Fault(place, column, "", str(error)))
        else:
            seen.add(parts_of(number.key))
            numbers.append(number)
            scales.append(_scale(number))
    if faults:
        raise TableError(file, faults[:_FAULTS])
    return tuple(numbers), scales


def _column(tree: dict[str, Any], cell: str) -> Number:
    """Number and unit of one cell of the header."""
    match = _HEADER.match(cell)
    if match is None:
        hint = "Cells are separated by commas" if ";" in cell or "\t" in cell else ""
        raise InvalidValueError("is no header of a column", "accepted: KEY [unit]", hint)
    number = number_of(tree, match[1])
    unit = normal_unit((match[2] or "").strip())
    if not unit and "" not in number.dimension.units:
        usual = number.dimension.usual or (number.dimension.si,)
        example = " or ".join(f"'{match[1]} [{one}]'" for one in usual)
        raise InvalidValueError(
            "has no unit", number.dimension.accepted.partition(";")[0], f"Did you mean {example}?"
        )
    parse_quantity(f"1 {unit}", number.dimension)
    return number._replace(unit=_said_in(unit, number.dimension))


def _row(line: str, numbers: Sequence[Number], place: int) -> list[float] | Fault:
    """Numbers of a line, or what is wrong with it first."""
    texts = line.split(",")
    if len(texts) != len(numbers):
        behind = min(len(texts), len(numbers) + 1)
        column = list(_cells(line))[behind - 1][0]
        return Fault(place, column, "", f"has {len(texts)} cells", "", f"accepted: {len(numbers)}, as the header has")
    try:
        if line.isascii() and "_" not in line:
            row = [float(text) for text in texts]
            if all(map(math.isfinite, row)):
                return row
    except ValueError:
        pass
    row = []
    for number, (column, cell) in zip(numbers, _cells(line), strict=True):
        try:
            row.append(parse_quantity(f"{cell} {number.unit}".rstrip(), number.dimension) if cell else math.nan)
        except InvalidValueError:
            row.append(math.nan)
        if not math.isfinite(row[-1]):
            accepted = f"accepted: a number of {number.unit}" if number.unit else "accepted: a number"
            return Fault(place, column, number.key, "is no number", shown(cell) or "nothing", accepted)
    return [float(cell) for _, cell in _cells(line)]
