"""The cases of a sweep: the varied keys of a mission, and their values in each case."""

import io
import math
import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bisar_budget.arrays import Floats
from bisar_budget.faults import Fault, InvalidValueError, shown
from bisar_budget.findings.case_table import Cases, Values, rounded_values
from bisar_budget.json_types import JsonObject
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.quantities import (
    Choices,
    Number,
    QuestionError,
    TableError,
    Varied,
    choices_of,
    number_of,
)
from bisar_budget.mission.readers import DIRECTION, TextList
from bisar_budget.resources import special_file
from bisar_budget.units import Dimension, normal_unit, parse_quantity

MAX_TABLE_VALUE_COUNT = 10_000_000  # largest number of values of one key, and of all keys of a table: 80 MB
MAX_TABLE_CHARACTERS = 256 << 20  # enough for `MAX_TABLE_VALUE_COUNT` values of 17 digits with sign and exponent
_SHOWN_FAULT_COUNT = 20  # largest number of faults of a table in a message
# A sample of cases: number of stretches, and the fraction of all cases between them, which fits no step of a grid.
_STRETCH_COUNT, _GOLDEN_FRACTION = 100, (math.sqrt(5) - 1) / 2
_NUMBER_PREFIX = re.compile(r"^\s*[+-]?[\d.]*(?:[eE][+-]?\d+)?\s*", re.ASCII)
_ACCEPTED_RANGE = "accepted: KEY=FROM:TO UNIT:COUNT, such as {key}=1:10 s:91, with :log behind it for equal ratios"
_ACCEPTED_VARIATIONS = (
    "accepted: KEY=FROM:TO UNIT:COUNT or KEY=VALUE,VALUE,..., such as collection.aperture_time=1:10s:91"
)
_WORD_SEPARATOR = re.compile(r",(?![^\[]*\])")  # between words, not within a list of parts
_LATIN = "accepted: latin:COUNT:SEED, such as latin:10000:1"
_KEY_HEADER_PATTERN = re.compile(r"^([^\[\]\s]+(?:\[\d+\][^\[\]\s]*)*)\s*(?:\[([^\[\]]*)\])?$", re.ASCII)


# ---------------------------------------------------------------- cases of arrays
def grid_of(tree: JsonObject, values: Mapping[str, ArrayLike]) -> Cases:
    """Make a case for every combination of the given values; the last key varies fastest.

    Parameters
    ----------
    tree : dict
        Content of the mission file, as strings, lists and mappings.
    values : mapping
        Array of values (n,) for each key: numbers in SI, or strings. A number that a key does not accept is detected
        only when its case is checked.

    Raises
    ------
    QuestionError
        A key is unknown, accepts neither numbers nor strings, or has no values.
    """
    varied: list[Varied] = []
    arrays: list[Values] = []
    for key, column in values.items():
        array = np.asarray(column)
        if array.ndim != 1 or not array.size:
            raise QuestionError(f"{key}: has values of the shape {array.shape}; accepted: (n,), n at least 1")
        if array.dtype.kind not in "US":
            varied.append(number_of(tree, key))
            arrays.append(array.astype(float))
            continue
        words = [str(word) for word in array.tolist()]
        choices = choices_of(tree, key, words[0])
        if choices is None:
            number_of(tree, key)  # raises an error if the key takes neither numbers nor words
            raise QuestionError(f"{key}: has words; accepted: numbers in SI")
        arrays.append(_texts(key, choices, words))
        varied.append(choices)
    if not varied:
        raise QuestionError(f"no key: nothing would vary; {_ACCEPTED_VARIATIONS}")
    return Cases(tuple(varied), tuple(arrays), is_grid=True)


def _texts(option: str, choices: Choices, words: Sequence[str]) -> Values:
    """Convert the string values of an option to an array, and raise `QuestionError` for an invalid value.

    Names of parts and files are checked only when the mission is read with them.
    """
    for word in dict.fromkeys(words):
        if problem := _wrong_word(choices, word):
            raise QuestionError(f"{option}: {problem}")
    return np.array([*words, None], object)[:-1]  # without None the array would be of type str


def _wrong_word(choices: Choices, word: str) -> str:
    """Describe why a key does not accept a string value.

    Returns an empty string if the key accepts the value, or if this can be decided only by reading the mission with
    the value.
    """
    if word.startswith("[") or isinstance(choices.reader, TextList):
        return ""
    try:
        choices.reader.leaf(word)
    except InvalidValueError as error:
        return f"{shown(word)!r} {error.problem.words}"
    return ""


# ---------------------------------------------------------------- cases of options
class _Asked(NamedTuple):
    """Parsed option `--vary`: the varied key and its values.

    The values are strings, numbers in SI, or the ends of a range and the number of its values.
    """

    option: str
    varied: Varied
    listed: Values | None = None
    ends: tuple[float, float] = (0.0, 0.0)
    size: str = ""
    is_log: bool = False


def grid(tree: JsonObject, texts: Sequence[str], name: str = "--vary") -> Cases:
    """Make a case for every combination of the values in the options `--vary`.

    An option has the form `KEY=FROM:TO UNIT:COUNT`, with `:log` appended for values at equal ratios, or the form
    `KEY=VALUE,VALUE,...`. For keys whose values are strings the form is `KEY=WORD,WORD,...`. A range includes both
    ends. Values are rounded in the unit of the option, so that `0:180deg:181` contains exactly 60 deg.

    Parameters
    ----------
    tree : dict
        Content of the mission file, as strings, lists and mappings.
    texts : sequence of str
        Options `--vary`. An end or a value without a unit has the unit of the last end or value in the same option.
    name : str
        Name of the option for messages.

    Raises
    ------
    QuestionError
        A key is unknown, is repeated, or accepts neither numbers nor strings; a range is empty or reversed; or a key
        does not accept a value.
    """
    every = [(asked.varied, _axis(asked)) for asked in _all_asked(tree, texts, name)]
    return Cases(tuple(varied for varied, _ in every), tuple(axis for _, axis in every), is_grid=True)


def _axis(asked: _Asked) -> Values:
    """Compute the values of a key from its option `--vary`, for a grid.

    Raises `QuestionError` if the option is a range without a valid count.
    """
    if asked.listed is not None:
        return asked.listed
    if not asked.size:
        raise QuestionError(f"{asked.option}: has no count of values; {_ACCEPTED_RANGE.format(key=asked.varied.key)}")
    count = _count(asked.size, f"{asked.option}: the count of values", 2, "; KEY=VALUE is a single value")
    if count > MAX_TABLE_VALUE_COUNT:
        raise QuestionError(
            f"{asked.option}: {count} values of one key; accepted: up to {MAX_TABLE_VALUE_COUNT}, "
            "which are as many cases for each combination of the other keys"
        )
    return _spread(asked, np.arange(count) / (count - 1))


def sample(tree: JsonObject, texts: Sequence[str], how: str) -> Cases:
    """Draw the cases as a Latin hypercube sample: each of `COUNT` equal parts of a range contains exactly one value.

    Parameters
    ----------
    tree : dict
        Content of the mission file, as strings, lists and mappings.
    texts : sequence of str
        Options `--vary` as in `grid`. Counts of ranges are ignored, lists of numbers are refused, and all strings of
        a key are drawn equally often.
    how : str
        `latin:COUNT:SEED`; the same seed gives the same cases.

    Raises
    ------
    QuestionError
        In the same situations as in `grid`, and if the method, count or seed in `how` is invalid.
    """
    option = f"--sample {shown(how)}"
    kind, *fields = (field.strip() for field in how.split(":"))
    if kind != "latin" or len(fields) != 2:
        raise QuestionError(f"{option}: is no way to draw cases; {_LATIN}")
    count = _count(fields[0], f"{option}: the count of cases", 1)
    if not (fields[1].isascii() and fields[1].isdigit() and len(fields[1]) <= 18):
        raise QuestionError(f"{option}: the seed must be a whole number; {_LATIN}")
    rng = np.random.default_rng(int(fields[1]))
    every = list(_all_asked(tree, texts, "--vary"))
    if count * len(every) > MAX_TABLE_VALUE_COUNT:
        raise QuestionError(
            f"{option}: {count} cases of {len(every)} keys do not fit into memory; accepted: up to "
            f"{MAX_TABLE_VALUE_COUNT // len(every)} cases. Samples of other seeds go on from there"
        )
    columns: list[Values] = []
    for asked in every:
        if asked.listed is None:
            columns.append(_spread(asked, (rng.permutation(count) + rng.random(count)) / count))
        elif isinstance(asked.varied, Choices):
            columns.append(asked.listed[rng.permutation(count) * asked.listed.size // count])
        else:
            raise QuestionError(
                f"{asked.option}: --sample draws from a range; {_ACCEPTED_RANGE.format(key=asked.varied.key)}"
            )
    return Cases(tuple(asked.varied for asked in every), tuple(columns))


def _all_asked(tree: JsonObject, texts: Sequence[str], name: str) -> Iterator[_Asked]:
    """Parse all options `--vary`, and raise `QuestionError` if there are no options or if a key is repeated.

    `name` is the name of the option for messages.
    """
    if not texts:
        raise QuestionError(f"no {name}: nothing would vary; {_ACCEPTED_VARIATIONS}")
    seen: set[tuple[str, ...]] = set()
    for text in texts:
        asked = _asked(tree, text, name)
        steps = tuple(parts_of(asked.varied.key))
        if steps in seen:
            raise QuestionError(f"{name} {asked.varied.key}: varies twice; accepted: each key once")
        seen.add(steps)
        yield asked


def _asked(tree: JsonObject, text: str, name: str) -> _Asked:
    """Parse the text of one option `--vary`, and check its values against the bounds of the key.

    `name` is the name of the option for messages.
    """
    key, equals, values_text = (field.strip() for field in text.partition("="))
    option = f"{name} {shown(text)}"
    if not (key and equals and values_text):
        raise QuestionError(f"{option}: does not say which values; {_ACCEPTED_VARIATIONS}")
    varied: Varied
    if (choices := choices_of(tree, key, values_text)) is not None:
        words = [word.strip() for word in _WORD_SEPARATOR.split(values_text)]
        varied, values = choices, _texts(option, choices, words)
    else:
        number = number_of(tree, key)
        fields = [field.strip() for field in values_text.split(":")]
        if len(fields) > 1:
            return _range(option, number, fields)
        texts = values_text.split(",")
        if len(texts) > MAX_TABLE_VALUE_COUNT:
            raise QuestionError(f"{option}: {len(texts)} values; accepted: up to {MAX_TABLE_VALUE_COUNT}")
        varied, listed = _read(option, number, texts)
        values = np.array(listed)
    if len(set(values.tolist())) < values.size:
        raise QuestionError(f"{option}: has a value twice; accepted: each once")
    return _Asked(option, varied, values)


def _range(option: str, number: Number, fields: list[str]) -> _Asked:
    """Parse an option `--vary` that gives a range.

    `fields` are the fields of the range, which are separated by colons. `option` is the option as written, for
    messages.
    """
    if is_log := len(fields) > 2 and fields[-1] == "log":
        fields.pop()
    if len(fields) > 3 or "" in fields:
        raise QuestionError(f"{option}: is no range; {_ACCEPTED_RANGE.format(key=number.key)}")
    number, (low, high) = _read(option, number, fields[:2])
    if not low < high:
        kind, hint = ("empty", "; KEY=VALUE is a single value") if low == high else ("reversed", "")
        if number.reader is DIRECTION and low > high:
            hint = ". Through east, which is 0 deg, it goes from a negative angle: -10:10deg"
        raise QuestionError(f"{option}: the range is {kind}; accepted: FROM < TO{hint}")
    if is_log and low <= 0:
        raise QuestionError(f"{option}: equal ratios begin above 0; accepted: FROM > 0, or no :log")
    return _Asked(option, number, None, (low, high), fields[2] if len(fields) == 3 else "", is_log)


def _read(option: str, number: Number, texts: Sequence[str]) -> tuple[Number, tuple[float, ...]]:
    """Parse the values of an option; a value without a unit has the unit of the last value in `texts`.

    Returns two results: the varied number, with the unit of the last value, and the values in SI.
    """
    units = [normal_unit(_NUMBER_PREFIX.sub("", text).strip()) for text in texts]
    values = []
    for text, unit in zip(texts, units, strict=True):
        full_text = f"{text.strip()} {units[-1]}" if not unit and units[-1] else text.strip()
        try:
            values.append(number.reader.leaf(full_text))
        except InvalidValueError as error:
            raise QuestionError(f"{option}: {shown(text.strip())!r} {error.problem.words}") from None
    return number._replace(unit=_usable_unit(units[-1], number.dimension)), tuple(values)


def _usable_unit(unit: str, dimension: Dimension) -> str:
    """Choose the unit in which values of an option are spaced or rounded.

    The result is the SI unit if `unit` is empty, or if the zero point of `unit` differs from the zero point of the SI
    unit. Otherwise it is `unit`. The result is empty if the dimension has no suitable unit.
    """
    unit = unit if unit and unit not in dimension.offsets else dimension.si
    return unit if unit in dimension.scales else ""


def _count(text: str, subject: str, least: int, hint: str = "") -> int:
    """Parse an integer that must be at least `least`.

    If the text is invalid, `QuestionError` is raised with a message that begins with `subject` and ends with `hint`.
    """
    if not (text.isascii() and text.isdigit() and len(text) <= 18 and int(text) >= least):
        raise QuestionError(f"{subject} is {shown(text)!r}; accepted: a whole number, at least {least}{hint}")
    return int(text)


def _spread(asked: _Asked, fractions: Floats) -> Floats:
    """Compute the values at given fractions of a range, in SI.

    The fractions 0 and 1 give exactly the ends of the range.
    """
    low, high = asked.ends
    factor, divisor = asked.varied.scale
    first, last = low / factor * divisor, high / factor * divisor
    values_in_unit = first * (last / first) ** fractions if asked.is_log else first + (last - first) * fractions
    values = np.clip(rounded_values(values_in_unit) * factor / divisor, low, high)
    values[fractions == 0], values[fractions == 1] = low, high
    return values


# ---------------------------------------------------------------- values of cases
def sampled_cases(cases: Cases, count: int) -> Cases:
    """Choose `count` cases, or slightly more, as a sample of all cases.

    The sample consists of short runs of neighbouring cases that are spread over all cases.
    """
    length = max(1, count // _STRETCH_COUNT)
    starts = [
        int((number * _GOLDEN_FRACTION + 0.5) % 1 * (cases.count - length)) for number in range(-(-count // length))
    ]
    stretches = [cases.values(start, start + length) for start in starts]
    columns = (np.concatenate([values[varied.key] for values in stretches]) for varied in cases.varied)
    return Cases(cases.varied, tuple(columns))


def words_of(cases: Cases) -> Iterator[tuple[Choices, list[str]]]:
    """Yield each varied key whose values are strings, and the list of its distinct values."""
    for varied, words in zip(cases.varied, cases.columns, strict=True):
        if isinstance(varied, Choices):
            yield varied, list(dict.fromkeys(words.tolist()))


# ---------------------------------------------------------------- cases of a file
def table_file(tree: JsonObject, path: str) -> Cases:
    """Read the cases from a CSV file; the function `table` describes the format.

    Raises `TableError` in the same situations as `table`, and if the file is unreadable or too large.
    """
    if kind := special_file(path):
        raise TableError.of_file(path, f"cannot be read: {kind}; accepted: a regular file")
    try:
        with open(path, encoding="utf-8", newline="") as file:
            text = file.read(MAX_TABLE_CHARACTERS + 1)
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, a NUL in the name
        raise TableError.of_file(path, f"cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(text) > MAX_TABLE_CHARACTERS:
        most = f"{MAX_TABLE_CHARACTERS >> 20} MiB; accepted: up to {MAX_TABLE_VALUE_COUNT} values"
        raise TableError.of_file(path, f"is larger than {most}")
    return table(tree, text, path)


def table(tree: JsonObject, text: str, file: str) -> Cases:
    """Read cases from CSV: the first line has a header `KEY [unit]` for each column, and each further line is a case.

    Empty lines and lines that begin with `#` are ignored. Dimensionless numbers need no unit, and keys whose values
    are strings have no unit. An unknown string counts as a fault of the table, but a number that a key does not
    accept is detected only when its case is checked.

    Parameters
    ----------
    tree : dict
        Content of the mission file, as strings, lists and mappings.
    text : str
        The content of the file.
    file : str
        Name of the file for messages.

    Raises
    ------
    TableError
        A cell of the header is not a key with its unit, or repeats a key; a line has too few or too many cells; a
        cell is not a number or a known string; or there are no cases, or too many. The error lists at most twenty
        faults.
    """
    lines = (
        (line_number, line.rstrip("\n"))
        for line_number, line in enumerate(io.StringIO(text.removeprefix("\ufeff"), newline=None), 1)
        if line.strip() and not line.lstrip().startswith("#")
    )
    line_number, header = next(lines, (1, ""))
    varied = _headed(tree, header, line_number, file)
    words: list[dict[str, int]] = [
        {} for _ in varied
    ]  # words of each column, with the numbers that replace them in `numbers`
    numbers = array("d")
    faults: list[Fault] = []
    for line_number, line in lines:
        row = _row(line, varied, words, line_number)
        if isinstance(row, Fault):
            faults.append(row)
            if len(faults) == _SHOWN_FAULT_COUNT:
                break
            continue
        numbers.extend(row)
        if len(numbers) > MAX_TABLE_VALUE_COUNT:
            faults.append(
                Fault(
                    line_number,
                    1,
                    "",
                    f"has more than {MAX_TABLE_VALUE_COUNT} values",
                    accepted="accepted: fewer cases",
                )
            )
            break
    if not numbers and not faults:
        faults.append(Fault(line_number, 1, "", "the table has no case", accepted="accepted: lines below the header"))
    if faults:
        raise TableError.of_faults(file, faults)
    values: list[Values] = []
    columns = np.array(numbers).reshape(-1, len(varied)).T
    for key, column, column_words in zip(varied, columns, words, strict=True):
        if isinstance(key, Choices):
            values.append(np.array([*column_words, None], object)[column.astype(int)])
        else:
            factor, divisor = key.scale
            values.append(column * factor / divisor)
    return Cases(varied, tuple(values))


def _cells(line: str) -> Iterator[tuple[int, str]]:
    """Yield the position of each cell of a line, in characters counted from 1, and its content without quotes."""
    at = 1
    for cell in line.split(","):
        word = cell.strip()
        column = at + len(cell) - len(cell.lstrip())
        yield column, word[1:-1].strip() if len(word) > 1 and word[0] == word[-1] == '"' else word
        at += len(cell) + 1


def _headed(tree: JsonObject, header: str, line_number: int, file: str) -> tuple[Varied, ...]:
    """Read the keys and their units from the header of a table, and raise `TableError` if a cell is faulty."""
    if not header:
        accepted = "accepted: KEY [unit], KEY [unit], ..."
        raise TableError.of_faults(file, [Fault(line_number, 1, "", "has no header", accepted=accepted)])
    varied: dict[tuple[str, ...], Varied] = {}
    faults: list[Fault] = []
    for column, cell in _cells(header):
        try:
            key = _column(tree, cell)
            if varied.setdefault(tuple(parts_of(key.key)), key) is not key:
                raise InvalidValueError("is given twice", "accepted: each key once")
        except InvalidValueError as error:
            problem = error.problem
            faults.append(
                Fault(line_number, column, shown(cell), problem.problem, "", problem.accepted, problem.hint)
            )
        except QuestionError as error:
            faults.append(Fault(line_number, column, "", str(error)))
    if faults:
        raise TableError.of_faults(file, faults[:_SHOWN_FAULT_COUNT])
    return tuple(varied.values())


def _column(tree: JsonObject, cell: str) -> Varied:
    """Parse one cell of the header of a table: a numeric key with its unit, or a key whose values are strings."""
    match = _KEY_HEADER_PATTERN.match(cell)
    if match is None:
        hint = "Cells are separated by commas" if ";" in cell or "\t" in cell else ""
        raise InvalidValueError("is no header of a column", "accepted: KEY [unit]", hint)
    key, unit = match[1], normal_unit((match[2] or "").strip())
    if (choices := choices_of(tree, key, "")) is not None:
        if unit:
            raise InvalidValueError("has words, which have no unit", f"accepted: {key}")
        return choices
    number = number_of(tree, key)
    if not unit and "" not in number.dimension.units:
        usual = number.dimension.usual or (number.dimension.si,)
        example = " or ".join(f"'{key} [{usual_unit}]'" for usual_unit in usual)
        raise InvalidValueError(
            "has no unit", number.dimension.accepted.partition(";")[0], f"Did you mean {example}?"
        )
    parse_quantity(f"1 {unit}", number.dimension)
    if unit in number.dimension.offsets:
        raise InvalidValueError(f"cannot be in {unit} in a table", f"accepted: '{key} [{number.dimension.si}]'")
    return number._replace(unit=_usable_unit(unit, number.dimension))


def _row(
    line: str, varied: Sequence[Varied], words: Sequence[dict[str, int]], line_number: int
) -> list[float] | Fault:
    """Read the values of one line of a table, or return the first fault of the line.

    Strings are replaced by numbers. `words` contains, for each column, a mapping from strings to numbers, to which
    new strings are added.
    """
    texts = line.split(",")
    if len(texts) != len(varied):
        behind = min(len(texts), len(varied) + 1)
        column = list(_cells(line))[behind - 1][0]
        return Fault(
            line_number, column, "", f"has {len(texts)} cells", "", f"accepted: {len(varied)}, as the header has"
        )
    try:  # most lines have only numbers
        if line.isascii() and "_" not in line and not any(isinstance(key, Choices) for key in varied):
            row = [float(text) for text in texts]
            if all(map(math.isfinite, row)):
                return row
    except ValueError:
        pass
    row = []
    for varied_key, column_words, (column, cell) in zip(varied, words, _cells(line), strict=True):
        if isinstance(varied_key, Choices):
            if cell not in column_words and (problem := _wrong_word(varied_key, cell)):
                return Fault(line_number, column, varied_key.key, problem)
            row.append(float(column_words.setdefault(cell, len(column_words))))
            continue
        try:
            is_number = (
                math.isfinite(parse_quantity(f"{cell} {varied_key.unit}".rstrip(), varied_key.dimension))
                if cell
                else False
            )
        except InvalidValueError:
            is_number = False
        if not is_number:
            accepted = f"accepted: a number of {varied_key.unit}" if varied_key.unit else "accepted: a number"
            return Fault(line_number, column, varied_key.key, "is no number", shown(cell) or "nothing", accepted)
        row.append(float(cell))
    return row
