"""Readers of values in a mission file: one reader per kind of value, which also writes the JSON Schema of the kind.

A section of the file is a `NamedTuple` whose keys are annotated with `Key(reader, description)`; see `model`. A
reader takes a value of the file, which is a string, list or mapping, or a number in SI if a sweep sets the value. It
passes each problem to the function `report`, and then returns `INVALID`.

A validation library would do the same, but its import takes five times as long. The import time matters because users
run `check` in every commit of a repository.
"""

import math
import re
from collections.abc import Callable, Mapping, Sized
from enum import Enum
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Final, Generic, NamedTuple, TypeGuard, TypeVar

from bisar_budget import units
from bisar_budget.error_kinds.registry import MotionKind, entry_point_faults, motion_kind, motion_kinds
from bisar_budget.faults import InvalidValueError, KeyPath, Problem, sentences
from bisar_budget.json_types import Definitions, JsonObject
from bisar_budget.resources import docstring
from bisar_budget.units import Dimension, format_quantity, parse_quantity

if TYPE_CHECKING:
    from datetime import date

MISSING = "is missing"  # problem of a required key


class Invalid(Enum):
    """Type of `INVALID`.

    `INVALID` takes the place of a value that has been reported as invalid.
    """

    INVALID = "invalid"


INVALID: Final = Invalid.INVALID  # replaces a value that was reported
Report = Callable[[KeyPath, Problem], None]
SectionValue = Any
"""A valid value of a section, or a section: the type is the one that a section annotates the key with."""
SectionValues = Mapping[str, SectionValue]
T = TypeVar("T")
K = TypeVar("K")
T_co = TypeVar("T_co", covariant=True)
SizedT = TypeVar("SizedT", bound=Sized)
Form = TypeVar("Form")
OtherForm = TypeVar("OtherForm")

_POINT = "A decimal is written with a point, a comma separates"
_MAX_TEXT_CHARACTERS = 500
_MAX_ENTRY_COUNT = 1000  # of a list of sections
_MAX_POINTS = 100  # of a curve
_MAX_NAME_COUNT = 8  # of a list of names; no platform needs more parts
_MAX_OWN_ID_COUNT = 100  # requirement ids of one row or requirement
_MAX_ID_COUNT = 4000  # of a mapping by row ids; even the longest lists give fewer rows
_MAX_WILDCARD_COUNT = 20  # of a pattern; an id has four parts, and fifty wildcards take a second
# Controls, line separators, lone surrogates, byte order mark, and the marks that turn the reading direction.
_UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\u202a-\u202e\u2066-\u2069]")


_NOT_SINGLE = {"type": ["array", "object", "null"]}  # JSON Schema: lists, mappings and null are no single values


def date_schema(pattern: str) -> JsonObject:
    """JSON Schema of a date or an instant.

    It accepts a string that matches `pattern`. It also accepts the date type that YAML readers return, for which JSON
    has no type.
    """
    return {"not": {"type": ["array", "object", "null", "boolean", "number"]}, "pattern": pattern}


class WithContent(NamedTuple):
    """A value, and content that the file states beside it, such as the bias beside a sigma.

    A section keeps the value under the key, and the content under the same key in its field `field`, a mapping.
    """

    value: object
    field: str
    content: object


SIZE_FIELD, BIAS_FIELD, LIMIT_FIELD, CONFIDENCE_FIELD = "sigma", "bias", "limit", "confidence"
_WITH_BIAS = (
    "position, velocity, acceleration and time_tag of a motion error, timing_error, propagation and the phases of "
    "other_errors"
)


class Reader(Generic[T_co]):
    """Reads one kind of value; `is_word` for words and whole numbers, several of which a sweep can compare.

    The class attribute `is_word` is true if the values are words or whole numbers.
    """

    is_word = False

    def read(self, value: object, path: KeyPath, report: Report) -> T_co | Invalid:
        """Return the value converted by `leaf`; an invalid value is reported at `path`, and `INVALID` is returned."""
        try:
            return self.leaf(value)
        except InvalidValueError as error:
            report(path, error.problem)
            return INVALID

    def leaf(self, value: object) -> T_co:
        """Convert a single value, not a list or a mapping; raises `InvalidValueError` if the value is invalid."""
        raise NotImplementedError

    def below(self, step: str) -> "Reader[object] | None":
        """Reader of the value at the key or index `step` inside this value; None if there is no such key or index."""
        return None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema of the accepted values; schemas that several keys share are added to `definitions`."""
        raise NotImplementedError


class Key(NamedTuple):
    """A key of a section: how its value is read and what it means."""

    reader: Reader[object]
    description: str = ""


class Quantity(Reader[float]):
    """A number with a unit, within bounds; read as a float in SI. Decibels stay decibels.

    `dimension` is the kind of quantity and has its units. The bounds are in SI: greater than `gt`, at least `ge`,
    less than `lt`, at most `le`. The bounds ensure that squares and quotients of the numbers are finite; realistic
    values are far from the widest bounds.
    """

    def __init__(
        self,
        dimension: Dimension,
        *,
        gt: float = -math.inf,
        ge: float = -math.inf,
        lt: float = math.inf,
        le: float = math.inf,
    ) -> None:
        self.dimension = dimension
        self.bounds = (gt, ge, lt, le)

    def read(self, value: object, path: KeyPath, report: Report) -> float | Invalid:
        """Read a quantity; a section with a bias, which only some errors have, is refused with their names."""
        if isinstance(value, dict) and BIAS_FIELD in value:
            report(path, Problem("takes no bias", f"accepted: a size; {_WITH_BIAS} take one"))
            return INVALID
        return super().read(value, path, report)

    def leaf(self, value: object) -> float:
        """Read a number with its unit from a string, or accept a float in SI, and check it against the bounds."""
        if type(value) is float and math.isfinite(value):
            number = value
        else:
            number = parse_quantity(self._text(value), self.dimension)
        gt, ge, lt, le = self.bounds
        if gt < number < lt and ge <= number <= le:
            return number
        words, bound = next(
            (words, bound)
            for holds, words, bound in (
                (number > gt, "greater than", gt),
                (number < lt, "less than", lt),
                (number >= ge, "at least", ge),
                (number <= le, "at most", le),
            )
            if not holds
        )
        bound_text = format_quantity(bound, self.dimension.si)
        if self.dimension is units.ANGLE:  # in degrees, because 1.57 rad would not look like 90 deg
            bound_text = f"{math.degrees(bound):.6g} deg"
        raise InvalidValueError(f"must be {words} {bound_text}", hint=self._unit_hint(self._text(value)))

    def _text(self, value: object) -> object:
        """Format a float in SI as in a mission file; any other value is returned unchanged."""
        return f"{value!r} {self.dimension.si}".rstrip() if type(value) is float else value

    def _unit_hint(self, value: object) -> str:
        """Hint that tells how a number without a unit is interpreted, in case the unit was forgotten.

        The hint is empty if the value has a unit, or if numbers of this kind always need a unit.
        """
        text = str(value).strip()
        if not text or not text[-1].isdigit():
            return ""
        if self.dimension.usual:
            return ""  # in such a dimension, only a zero may have no unit
        if "%" in self.dimension.units:
            return f"A bare number is a ratio: {text} is {100 * float(text):.6g} %"
        return f"A bare number is in {self.dimension.si}" if self.dimension.si not in ("", "dB") else ""

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: a string with a unit, or a bare number within the bounds.

        If the quantity needs a unit, as an angle does, zero is the only accepted bare number.
        """
        name = re.sub(r"\W", "", self.dimension.name.partition(" ")[2].title()) + "Quantity"
        if name not in definitions:
            definitions[name] = _quantity_schema(self.dimension)
        accepted: JsonObject = {"$ref": f"#/definitions/{name}"}
        words = ("exclusiveMinimum", "minimum", "exclusiveMaximum", "maximum")
        bounds: JsonObject = {}
        if not self.dimension.usual:
            bounds = {word: bound for word, bound in zip(words, self.bounds, strict=True) if math.isfinite(bound)}
        bounds |= self._sides_of_zero()
        return {"allOf": [accepted], **bounds} if bounds else accepted

    def _sides_of_zero(self) -> JsonObject:
        """JSON Schema that refuses zero or numbers of a certain sign, in any unit.

        All positive numbers, all negative numbers, and zero are refused if the bounds exclude them.
        """
        gt, ge, lt, le = self.bounds
        if self.dimension.offsets:  # a unit shifts the zero
            return {}
        refused = [*(["-"] if max(gt, ge) >= 0 else []), *([r"\+?"] if min(lt, le) <= 0 else [])]
        patterns = [rf"(?!{sign}{_NOT_ZERO})" for sign in refused]
        has_zero = gt < 0 < lt and ge <= 0 <= le
        if not has_zero:
            patterns.append(rf"(?![+-]?{_ZERO})")
        bare = {"not": {"const": 0}} if not has_zero and self.dimension.usual else {}
        return {"pattern": rf"^\s*{''.join(patterns)}", **bare} if patterns else {}


# Mantissa behind a sign, with the end of the number. A power of ten with three digits may underflow to zero.
_NOT_ZERO = r"[0.]*[1-9][\d.]*(?:[eE][+-]?\d{1,2})?(?![\d.eE])"
_ZERO = r"[0.]+(?:[eE][+-]?\d+)?(?![\d.eE])"
_UNIT_ALIASES = ("dps", "mdps", "dph", "micro-g", "milli-g")  # further spellings of units that are read


def _quantity_schema(dimension: Dimension) -> JsonObject:
    """JSON Schema of a kind of quantity: a number, or a string with a number, optionally followed by a unit.

    Units of other kinds of quantities are refused. If the kind needs a unit, zero is the only accepted bare number.
    """
    number = r"[+-]?(?!0\d)(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
    all_units = {unit for dimension_of_unit in units.DIMENSIONS for unit in dimension_of_unit.units if unit}.union(
        _UNIT_ALIASES
    )
    foreign = sorted(
        unit for unit in all_units if dimension.scales.keys().isdisjoint((unit, units.normal_unit(unit)))
    )
    end = f"(?:$|{'|'.join(map(re.escape, units.UNCERTAINTY_MARKS))})"
    foreign_pattern = "|".join(re.sub(r"([\^$.*+?()|/])", r"\\\1", unit) for unit in foreign)
    text: JsonObject = {"type": "string", "pattern": rf"^\s*(?!{number}\s*(?:{foreign_pattern})\s*{end}){number}"}
    words = dimension.accepted.removeprefix("accepted: ")
    return {"description": words, "anyOf": [text, {"const": 0} if dimension.usual else {"type": "number"}]}


class Triple(Reader[tuple[float, ...]]):
    """Three components; with `or_scalar` a single value stands for each of them.

    The class reads them as a tuple of three numbers.
    """

    def __init__(self, component: Quantity, *, or_scalar: bool = False) -> None:
        self.component = component
        self.or_scalar = or_scalar

    def read(self, value: object, path: KeyPath, report: Report) -> tuple[float, ...] | Invalid:
        """Read the three components; a problem with a component is reported at the path of the component."""
        bracketed = "" if isinstance(value, list) else self._bracketed(value)
        if self.or_scalar and not isinstance(value, list) and not bracketed:
            scalar = self.component.read(value, path, report)
            return scalar if scalar is INVALID else (scalar, scalar, scalar)
        if not isinstance(value, list) or len(value) != 3:
            length_words = f", {len(value)} given" if isinstance(value, list) else ""
            hint = _POINT if isinstance(value, list) and len(value) > 3 else bracketed
            report(path, Problem(f"must be three components{length_words}", "accepted: [a, b, c]", hint))
            return INVALID
        components = tuple(
            [read_part(self.component, item, (*path, index), report) for index, item in enumerate(value)]
        )
        return components if are_valid(components) else INVALID

    def _bracketed(self, value: object) -> str:
        """Hint to put brackets around three values in a string; empty if the string does not contain three values.

        If each of the three values has a unit or is 0, the hint contains the corrected string. Otherwise, if blanks
        follow the commas, the hint only asks for brackets and units, because `1, 2, 3 km` does not have three
        lengths. Without blanks there is no hint, because `1,234,567 m` may be a single number.
        """
        if not isinstance(value, str):
            return ""
        texts = value.strip(" ()").split(",")
        if len(texts) != 3 or not any(map(units.unit_behind, texts)):
            return ""
        try:
            bare_numbers = [self.component.leaf(text.strip()) for text in texts if not units.unit_behind(text)]
            for text in texts:
                self.component.leaf(text.strip())
        except InvalidValueError:
            bare_numbers = [math.nan]
        if any(bare_numbers):
            return "Write brackets, and the unit of each" if value.count(", ") == 2 else ""
        return f"Did you mean [{', '.join(text.strip() for text in texts)}]?"

    def below(self, step: str) -> Reader[object] | None:
        """Reader of one component; None if `step` is not an index."""
        return self.component if is_index(step) else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an array of three components. If `or_scalar`, a single value is also accepted."""
        single = self.component.schema(definitions)
        triple = {"type": "array", "items": single, "minItems": 3, "maxItems": 3}
        return {"anyOf": [single, triple]} if self.or_scalar else triple


class Text(Reader[str]):
    """One line of printable text.

    The class reads such a line as a string.
    """

    name, max_characters = "Text", _MAX_TEXT_CHARACTERS

    def leaf(self, value: object) -> str:
        """Return the string; refuse a string that is empty, too long or not printable.

        Control characters could change a terminal or a report.
        """
        if not isinstance(value, str):
            raise InvalidValueError("must be text")
        if not value.strip():
            raise InvalidValueError("must not be empty")
        if len(value) > self.max_characters:
            raise InvalidValueError(f"must be at most {self.max_characters} characters, has {len(value)}")
        if _UNPRINTABLE.search(value):
            raise InvalidValueError("must be one line of printable text, without control characters")
        return value

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema that accepts any single value, because other YAML readers convert some strings to other types.

        They read 007 as a number, `yes` as true, and 2026-06-01 as a date.
        """
        pattern = r"^(?=.*\S)[^\u0000-\u001f\u007f-\u009f\u2028\u2029\ufeff\u202a-\u202e\u2066-\u2069]*$"
        words = {"description": "One line of text."}
        definitions.setdefault(
            self.name, {**words, "not": _NOT_SINGLE, "maxLength": self.max_characters, "pattern": pattern}
        )
        return {"$ref": f"#/definitions/{self.name}"}


class Statement(Text):
    """The text of a requirement: one line, longer than other texts.

    The class reads such a text as a string.
    """

    name, max_characters = "Statement", 4000


class Reference(Text):
    """Name of a part or of a file that values are taken from.

    The class reads such a name as a string.
    """

    is_word = True


class Glob(Text):
    """An id, or a pattern of ids with `*`, `?` and `[...]`.

    The class reads such an id or pattern as a string.
    """

    def leaf(self, value: object) -> str:
        """Return the pattern; refuse a pattern with more than `_MAX_WILDCARD_COUNT` wildcards.

        With more wildcards, matching could take too long.
        """
        pattern = super().leaf(value)
        if sum(map(pattern.count, "*?[")) > _MAX_WILDCARD_COUNT:
            raise InvalidValueError(f"must have at most {_MAX_WILDCARD_COUNT} wildcards")
        return pattern


class Choice(Reader[str]):
    """One of a few words; `accepted` lists words for messages, by default all.

    The class reads such a word as a string. The function `is_more` tells whether a word that is not in the list is
    also accepted.
    """

    is_word = True

    def __init__(self, *names: str, accepted: str = "", is_more: Callable[[str], bool] = lambda word: False) -> None:
        self.names, self.accepted, self.is_more = names, accepted or ", ".join(names), is_more

    def leaf(self, value: object) -> str:
        """Return the word; an unknown word is refused, with a hint that names the most similar known word."""
        if isinstance(value, str) and (value in self.names or self.is_more(value)):
            return value
        near = did_you_mean(value, self.names)
        raise InvalidValueError("is not a known choice", f"accepted: {self.accepted}", near)

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: one of the words in the list."""
        return {"enum": list(self.names)}


_YES_NO = {word: word.lower() == "true" for word in ("true", "True", "TRUE", "false", "False", "FALSE")}


class YesNo(Reader[bool]):
    """True or false.

    The class reads such a value as a boolean.
    """

    is_word = True
    accepted = "true or false"

    def leaf(self, value: object) -> bool:
        """Read true or false, spelt as in YAML 1.2; a boolean from an option is also accepted."""
        boolean = value if isinstance(value, bool) else _YES_NO.get(value) if isinstance(value, str) else None
        if boolean is None:
            raise InvalidValueError("must be true or false", "accepted: true, false")
        return boolean

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: a boolean, or true or false as a string."""
        return {"enum": [True, False, *_YES_NO]}


class Words(Reader[tuple[str, ...]]):
    """A list of known words, each at most once; the arguments are those of `Choice`.

    The class reads such a list as a tuple of strings.
    """

    def __init__(self, *names: str, accepted: str, is_more: Callable[[str], bool] = lambda word: False) -> None:
        self.word: Reader[str] = Choice(*names, accepted=accepted, is_more=is_more)
        self.problem = Problem("must be a list", f"accepted: some of {accepted}")
        self.fewest, self.most = 0.0, math.inf

    def read(self, value: object, path: KeyPath, report: Report) -> tuple[str, ...] | Invalid:
        """Read the words of the list; a problem with a word is reported at the path of the word."""
        if not isinstance(value, list) or not self.fewest <= len(value) <= self.most:
            report(path, self.problem)
            return INVALID
        words = tuple([read_part(self.word, word, (*path, index), report) for index, word in enumerate(value)])
        for index, word in enumerate(words):
            if word is not INVALID and word in words[:index]:
                report((*path, index), Problem("is in the list twice"))
                return INVALID
        return words if are_valid(words) else INVALID

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an array of accepted words without repetitions."""
        return {"type": "array", "items": self.word.schema(definitions), "uniqueItems": True}


class TextList(Words):
    """A list of 1 to `most` texts, each at most once; by default names of parts.

    The class reads such a list as a tuple of strings.
    """

    is_word = True

    def __init__(self, text: Reader[str] | None = None, most: int = _MAX_NAME_COUNT, noun: str = "names") -> None:
        self.word = text or Reference()
        self.problem = Problem(f"must be a list of 1 to {most} {noun}")
        self.fewest, self.most = 1, most

    def below(self, step: str) -> Reader[object] | None:
        """Reader of one name in the list; None if `step` is not an index."""
        return self.word if is_index(step) else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an array of at least one string."""
        return {"type": "array", "items": self.word.schema(definitions), "minItems": 1, "maxItems": self.most}


class Lines(Words):
    """A list of texts of one line, each at most once.

    The class reads such a list as a tuple of strings.
    """

    def __init__(self) -> None:
        self.word = Text()
        self.problem = Problem(f"must be a list of at most {_MAX_ENTRY_COUNT} texts")
        self.fewest, self.most = 0, _MAX_ENTRY_COUNT

    def below(self, step: str) -> Reader[object] | None:
        """Reader of one string in the list; None if `step` is not an index."""
        return self.word if is_index(step) else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an array of strings."""
        return {"type": "array", "items": self.word.schema(definitions), "maxItems": self.most}


class Whole(Reader[int]):
    """A whole number within bounds.

    The class reads the number from text that has only digits and an optional minus sign.
    """

    is_word = True

    def __init__(self, low: int, high: int) -> None:
        self.low, self.high = low, high

    def leaf(self, value: object) -> int:
        """Read a whole number from its decimal digits.

        A leading zero is refused, because YAML 1.1 reads such a number as octal.
        """
        if isinstance(value, str) and re.fullmatch(r"0|-?[1-9]\d{0,17}", value.strip(), re.ASCII):
            number = int(value)
            if self.low <= number <= self.high:
                return number
        raise InvalidValueError(f"must be a whole number from {self.low} to {self.high}")

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an integer within the bounds, or a string with an integer."""
        number = {"type": "integer", "minimum": self.low, "maximum": self.high}
        return {"anyOf": [number, {"type": "string", "pattern": r"^\s*(?:0|-?[1-9]\d{0,17})\s*$"}]}


class Version(Reader[int]):
    """The schema version.

    The class reads this number, and accepts only 1.
    """

    def leaf(self, value: object) -> int:
        """Return 1, the only schema version; refuse any other value."""
        if value != "1":
            raise InvalidValueError("is not a schema version this tool reads", "accepted: 1")
        return 1

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: the number 1, or the string "1"."""
        return {"enum": [1, "1"]}


class Day(Reader["date"]):
    """A calendar date.

    The class reads such a date as a `date` of Python.
    """

    def leaf(self, value: object) -> "date":
        """Read a calendar date such as 2027-03-31."""
        from datetime import date

        try:
            if not isinstance(value, str) or not re.fullmatch(r"\d{4}-\d\d-\d\d", value, re.ASCII):
                raise ValueError
            return date.fromisoformat(value)
        except ValueError:
            raise InvalidValueError("must be a calendar date", "accepted: 2027-03-31 and the like") from None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: a date as a string, or as the date type that YAML readers return."""
        return date_schema(r"^\d{4}-\d\d-\d\d$")


def _is_few(
    value: object, kind: type[SizedT] | tuple[type[SizedT], ...], kind_problem: str, path: KeyPath, report: Report
) -> TypeGuard[SizedT]:
    """Whether a value is of the type `kind` and has at most `_MAX_ID_COUNT` entries; if not, a problem is reported.

    `kind_problem` is the text of the problem if the value is of another type.
    """
    if not isinstance(value, kind):
        report(path, Problem(kind_problem))
        return False
    if len(value) > _MAX_ID_COUNT:
        report(path, Problem(f"must have at most {_MAX_ID_COUNT} entries, has {len(value)}"))
        return False
    return True


class TextMap(Reader[dict[str, str]]):
    """A mapping of any key to text; `of` names the kind of the keys, and `text` reads the texts.

    The class reads such a mapping as a dictionary of strings.
    """

    def __init__(self, of: str = "row id", text: Text | None = None) -> None:
        self.of, self.text = of, text or Text()

    def read(self, value: object, path: KeyPath, report: Report) -> dict[str, str] | Invalid:
        """Read the string at each key; a problem with a string is reported at the path of its key."""
        if not _is_few(value, dict, "must be a mapping of keys to values", path, report):
            return INVALID
        result = {key: read_part(self.text, text, (*path, key), report) for key, text in value.items()}
        return result if has_valid_values(result) else INVALID

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object with arbitrary keys and strings as values."""
        return {
            "type": "object",
            "additionalProperties": self.text.schema(definitions),
            "maxProperties": _MAX_ID_COUNT,
        }


class IdMap(Reader[dict[str, tuple[str, ...]]]):
    """A mapping of ids of rows and requirements to requirement ids of the project: a text, or a list of texts.

    The class reads such a mapping as a dictionary of tuples of strings.
    """

    def __init__(self) -> None:
        self.text, self.texts = Text(), TextList(Text(), _MAX_OWN_ID_COUNT, "ids")

    def read(self, value: object, path: KeyPath, report: Report) -> dict[str, tuple[str, ...]] | Invalid:
        """Read the ids at each key as a tuple; a problem with an id is reported at the path of the id."""
        if not _is_few(value, dict, "must be a mapping of keys to ids", path, report):
            return INVALID
        result = {key: self._ids(ids, (*path, key), report) for key, ids in value.items()}
        return result if has_valid_values(result) else INVALID

    def _ids(self, value: object, path: KeyPath, report: Report) -> tuple[str, ...] | Invalid:
        if isinstance(value, list):
            return self.texts.read(value, path, report)
        text = read_part(self.text, value, path, report)
        return INVALID if text is INVALID else (text,)

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object with arbitrary keys; each value is a string or an array of strings."""
        ids = {"anyOf": [self.text.schema(definitions), self.texts.schema(definitions)]}
        return {"type": "object", "additionalProperties": ids, "maxProperties": _MAX_ID_COUNT}


class SizeMap(Reader[dict[str, object]]):
    """A mapping from keys of errors to single sizes. The reader of each key reads the size of that key later.

    The section `specifications` of a mission file is such a mapping. The class reads it without converting the sizes.
    """

    def read(self, value: object, path: KeyPath, report: Report) -> dict[str, object] | Invalid:
        """Return the mapping without converting its sizes; refuse sizes that are lists or mappings."""
        if not _is_few(value, dict, "must be a mapping of keys of errors to sizes", path, report):
            return INVALID
        nested = [key for key, size in value.items() if isinstance(size, dict | list)]
        for key in nested:
            report((*path, key), Problem("must be one size, which holds for each axis", "accepted: such as 2 mm/s"))
        return INVALID if nested or INVALID in value.values() else value

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object with arbitrary keys; each value is the size of an error, as a string or a number."""
        size = {"type": ["string", "number"]}
        return {"type": "object", "additionalProperties": size, "maxProperties": _MAX_ID_COUNT}


class RegisteredSizes(Reader[dict[str, float]]):
    """Reader of the sizes of errors of registered kinds, as a dictionary from the name of a kind to a number in SI.

    Packages register kinds of errors with `error_kinds.register`.
    """

    def read(self, value: object, path: KeyPath, report: Report) -> dict[str, float] | Invalid:
        """Read the size of each registered kind of error; a problem is reported at the path of the kind."""
        if not isinstance(value, dict):
            report(path, Problem("must be a mapping of kinds to sizes", f"accepted: {self._accepted()}"))
            return INVALID
        sizes: dict[str, float | Invalid] = {}
        for name, size in value.items():
            reader = self.below(name)
            if reader is None:
                hint = sentences(did_you_mean(name, tuple(motion_kinds())), *entry_point_faults())
                problem = Problem(
                    "is no registered kind of error", f"accepted: {self._accepted()}", hint, is_of_key=True
                )
                report((*path, name), problem)
                sizes[name] = INVALID
            else:
                sizes[name] = read_part(reader, size, (*path, name), report)
        return sizes if has_valid_values(sizes) else INVALID

    @staticmethod
    def _accepted() -> str:
        return ", ".join(motion_kinds()) or "none; no installed package registers a kind of error"

    def below(self, step: str) -> Quantity | None:
        """Reader of the size of the kind of error `step`; None if no package has registered this kind."""
        kind = motion_kind(step)
        return None if kind is None else _size_of_kind(kind)

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object whose keys are the registered kinds of error, and whose values are sizes."""
        properties: JsonObject = {
            name: {"description": kind.description, "allOf": [_size_of_kind(kind).schema(definitions)]}
            for name, kind in motion_kinds().items()
        }
        return {"type": "object", "properties": properties, "additionalProperties": False}


@cache
def _size_of_kind(kind: MotionKind) -> Quantity:
    """Reader of the size of an error of a registered kind, in the units of the kind."""
    return Quantity(kind.dimension, ge=-1e9, le=1e9)


_WEIGHT = Quantity(units.RATIO, gt=0, ge=1e-6, le=1e6)
_WEIGHED_OR_LISTED: tuple[type[dict[str, object] | list[object]], ...] = (dict, list)


class Weights(Reader[dict[str, float]]):
    """Keys of the file with positive weights, or a list of keys with weights of 1.

    The class reads either form as a dictionary of weights by key.
    """

    def read(self, value: object, path: KeyPath, report: Report) -> dict[str, float] | Invalid:
        """Read the keys with their weights; a problem is reported at the path of the key or list entry."""
        if not _is_few(value, _WEIGHED_OR_LISTED, "must be keys with their weights, or a list of keys", path, report):
            return INVALID
        if isinstance(value, list):
            names = tuple([read_part(Text(), name, (*path, index), report) for index, name in enumerate(value)])
            repeated = [index for index, name in enumerate(names) if name in names[:index]]
            for index in repeated:
                report((*path, index), Problem("is given twice", "accepted: each key once"))
            return dict.fromkeys(names, 1.0) if are_valid(names) and not repeated else INVALID
        weights = {key: read_part(_WEIGHT, weight, (*path, key), report) for key, weight in value.items()}
        return weights if has_valid_values(weights) else INVALID

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object of weights by key, or an array of keys."""
        label, weight = Text().schema(definitions), _WEIGHT.schema(definitions)
        return {
            "anyOf": [
                {"type": "object", "additionalProperties": weight, "maxProperties": _MAX_ID_COUNT},
                {"type": "array", "items": label, "maxItems": _MAX_ID_COUNT},
            ]
        }


class Section(Reader[T_co]):
    """A mapping with known keys, read into a `NamedTuple`; an unknown key is an error.

    If the `NamedTuple` has a function `problems(values)`, this function yields contradictions between values of the
    section. It gets the valid values and the defaults, so that it finds contradictions between valid values even if
    another value is invalid. An optional section or list that is valid and empty counts as absent. If the
    `NamedTuple` has a function `any_of()`, the section must have at least one of the keys that this function returns;
    `problems` and the schema check this.
    """

    def __init__(self, kind: Callable[..., T_co]) -> None:
        self.kind = kind
        self.keys: dict[str, Key] = {
            name: annotation.__metadata__[0]
            for name, annotation in kind.__annotations__.items()
            if hasattr(annotation, "__metadata__")
        }
        self.defaults: dict[str, object] = vars(kind)["_field_defaults"]
        self.required = [name for name in self.keys if name not in self.defaults]
        self.problems = getattr(kind, "problems", None)
        self.any_of: tuple[str, ...] = getattr(kind, "any_of", tuple)()

    def read(self, value: object, path: KeyPath, report: Report) -> T_co | Invalid:
        """Read all keys of the section, and report every fault."""
        if not isinstance(value, dict):
            report(path, Problem("must be a mapping of keys to values", f"accepted: {', '.join(self.keys)}"))
            return INVALID
        is_valid = True
        values: dict[str, SectionValue] = {}
        for name, item in value.items():
            key = self.keys.get(name)
            if key is None:
                accepted = f"accepted: {', '.join(self.keys)}"
                hint = _POINT if name[:1].isdigit() else did_you_mean(name, tuple(self.keys))
                report((*path, name), Problem("is not a known key", accepted, hint, is_of_key=True))
                is_valid = False
                continue
            value_read = item if item is INVALID else key.reader.read(item, (*path, name), report)
            if isinstance(value_read, WithContent):
                contents = values.setdefault(value_read.field, {})
                contents[name] = value_read.content
                value_read = value_read.value
            if value_read is INVALID or name not in self.defaults or not is_empty(item):
                values[name] = value_read
        if INVALID in values.values():
            is_valid = False
        for name in self.required:
            if name not in value:
                report((*path, name), Problem(MISSING))
                is_valid = False
        if self.problems is not None:
            valid_values = self.defaults | values
            if not is_valid:
                valid_values = {name: item for name, item in valid_values.items() if item is not INVALID}
            for problem in self.problems(valid_values):
                report(path, problem)
                is_valid = False
        return self.kind(**values) if is_valid else INVALID

    def each(self, value: object) -> dict[str, object]:
        """Read the value of each known key separately; invalid values become `INVALID` without being reported."""
        items = value.items() if isinstance(value, dict) else ()
        return {
            name: read_part(self.keys[name].reader, item, (), _ignore_problem)
            for name, item in items
            if name in self.keys
        }

    def below(self, step: str) -> Reader[object] | None:
        """Reader of the value at the key `step`; None for an unknown key."""
        return self.keys[step].reader if step in self.keys else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: a reference to the schema of the section, which the first call adds to `definitions`."""
        name = self.kind.__name__
        if name not in definitions:
            definitions[name] = {}  # keeps the order of first use
            definitions[name] = self.definition(definitions)
        return {"$ref": f"#/definitions/{name}"}

    def definition(self, definitions: Definitions) -> JsonObject:
        """JSON Schema of the section: an object whose properties are the keys, with descriptions and defaults."""
        properties = {}
        for name, key in self.keys.items():
            accepted = key.reader.schema(definitions)
            if key.description:
                # draft-07 ignores the siblings of a $ref.
                accepted = {"allOf": [accepted]} if "$ref" in accepted else accepted
                accepted = {"description": key.description, **accepted}
            default = self.defaults.get(name)
            if isinstance(default, str | int | float):
                accepted = {**accepted, "default": default}
            properties[name] = accepted
        return {
            "description": docstring(self.kind).partition("\n")[0],
            "type": "object",
            "properties": properties,
            **({"required": self.required} if self.required else {}),
            **({"anyOf": [{"required": [name]} for name in self.any_of]} if self.any_of else {}),
            "additionalProperties": False,
        }


class ListOf(Reader[tuple[T_co, ...]]):
    """A list of sections, which all have the same keys, or of which each has one of several forms.

    The class reads such a list as a tuple of sections.
    """

    def __init__(self, kind: "Callable[..., T_co] | Reader[T_co]") -> None:
        self.section: Reader[T_co] = kind if isinstance(kind, Reader) else Section(kind)

    def read(self, value: object, path: KeyPath, report: Report) -> tuple[T_co, ...] | Invalid:
        """Read the entries of the list; a problem with an entry is reported at the path of the entry."""
        if not isinstance(value, list):
            report(path, Problem("must be a list"))
            return INVALID
        if len(value) > _MAX_ENTRY_COUNT:
            report(path, Problem(f"must have at most {_MAX_ENTRY_COUNT} entries, has {len(value)}"))
            return INVALID
        entries = tuple([read_part(self.section, entry, (*path, index), report) for index, entry in enumerate(value)])
        return entries if are_valid(entries) else INVALID

    def below(self, step: str) -> Reader[object] | None:
        """Reader of one entry of the list; None if `step` is not an index."""
        return self.section if is_index(step) else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an array whose items have the schema of the section."""
        return {"type": "array", "items": self.section.schema(definitions), "maxItems": _MAX_ENTRY_COUNT}


class OneOf(Reader[T_co]):
    """One of several forms of a value; `pick` takes the value and returns the reader of its form."""

    def __init__(self, pick: Callable[[object], Reader[T_co]], forms: tuple[Reader[T_co], ...]) -> None:
        self.pick, self.forms = pick, forms

    def read(self, value: object, path: KeyPath, report: Report) -> T_co | Invalid:
        """Read the value with the reader that `pick` chooses for it."""
        return self.pick(value).read(value, path, report)

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema that accepts each of the forms."""
        return {"anyOf": [form.schema(definitions) for form in self.forms]}


class _Pair(Section[SectionValue]):
    """A section that states a number by two keys. Its schema is named by the kind of number."""

    def __init__(self, name: str, meaning: str, keys: dict[str, Key], required: tuple[str, ...] = ()) -> None:
        self.name, self.meaning, self.keys, self.required = name, meaning, keys, list(required)
        self.defaults: dict[str, object] = {key: None for key in keys if key not in required}
        self.problems, self.any_of = None, tuple(keys)
        self.kind = dict

    def definition(self, definitions: Definitions) -> JsonObject:
        """JSON Schema of the section: an object with the two keys."""
        properties: JsonObject = {}
        for name, key in self.keys.items():
            accepted = key.reader.schema(definitions)
            properties[name] = {"description": key.description, "allOf": [accepted]}
        return {
            "description": self.meaning,
            "type": "object",
            "properties": properties,
            **({"required": self.required} if self.required else {"minProperties": 1}),
            "additionalProperties": False,
        }

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: a reference to the schema of the section, which the first call adds to `definitions`."""
        if self.name not in definitions:
            definitions[self.name] = self.definition(definitions)
        return {"$ref": f"#/definitions/{self.name}"}


class _SizeAndBias(_Pair):
    """The size of an error, and its bias, which is known, constant and signed.

    The class reads the size as the value of the key, and the bias as content beside it.
    """

    def __init__(self, name: str, meaning: str, keys: dict[str, Key], unstated: float | None) -> None:
        super().__init__(name, meaning, keys)
        self.unstated = unstated

    def read(self, value: object, path: KeyPath, report: Report) -> SectionValue:
        """Read both; a size that the file does not state has the value `unstated`."""
        pair = super().read(value, path, report)
        if pair is INVALID:
            return INVALID
        if not pair:
            report(path, Problem("states neither sigma nor bias", "accepted: {sigma: …, bias: …}"))
            return INVALID
        return WithContent(pair.get(SIZE_FIELD, self.unstated), BIAS_FIELD, pair.get(BIAS_FIELD))


class Paired(OneOf[SectionValue]):
    """A number, or a section with this number and a second value beside it.

    Parameters
    ----------
    plain : Quantity or Triple
        Reader of the number alone.
    pair : Section
        Reader of the section; its first key is that of the number.
    """

    def __init__(self, plain: "Quantity | Triple", pair: Section[SectionValue]) -> None:
        self.pair, self.name_of_number = pair, next(iter(pair.keys))
        super().__init__(lambda value: pair if isinstance(value, dict) else plain, (plain, pair))

    def as_section(self, value: object) -> dict[str, object]:
        """Section that means the same as a number alone; empty for None."""
        return {} if value is None else {self.name_of_number: value}


class WithBias(Paired):
    """Reader of the size of an error with an optional bias: a size, or `{sigma: …, bias: …}`.

    Parameters
    ----------
    plain : Quantity or Triple
        Reader of a size without a bias.
    name : str
        Name of the form with a bias in the JSON Schema.
    bias : Quantity, optional
        Reader of a bias; by default `plain`.
    """

    def __init__(self, plain: "Quantity | Triple", name: str, bias: "Quantity | None" = None) -> None:
        keys = {
            SIZE_FIELD: Key(_without_sign(plain), "Size of the random part, as without a bias."),
            BIAS_FIELD: Key(_with_unit(bias or plain), "The known, constant part, with its sign."),
        }
        # A position or velocity without a sigma may stand beside a covariance.
        unstated = None if isinstance(plain, Triple) else 0.0
        super().__init__(plain, _SizeAndBias(name, "Size of an error and its bias.", keys, unstated))


class _Bias(Quantity):
    """A bias, which needs its unit, because a sigma beside it may be written in another one.

    The class reads it like any quantity. A bias of zero, and a ratio, need no unit.
    """

    def leaf(self, value: object) -> float:
        """Read a bias; a number without a unit is refused."""
        number = super().leaf(value)
        is_bare = isinstance(value, str) and not units.unit_behind(value)
        if number and is_bare and self.dimension.si:
            raise InvalidValueError("needs its unit", self.dimension.accepted.partition("; ")[0])
        return number


def _with_unit(reader: "Quantity | Triple") -> "Quantity | Triple":
    """Reader of the same quantity that refuses a number without a unit."""
    if isinstance(reader, Triple):
        component = _with_unit(reader.component)
        assert isinstance(component, Quantity)
        return Triple(component, or_scalar=reader.or_scalar)
    gt, ge, lt, le = reader.bounds
    return _Bias(reader.dimension, gt=gt, ge=ge, lt=lt, le=le)


def _without_sign(reader: "Quantity | Triple") -> "Quantity | Triple":
    """Reader of the same quantity that refuses negative numbers."""
    if isinstance(reader, Triple):
        component = _without_sign(reader.component)
        assert isinstance(component, Quantity)
        return Triple(component, or_scalar=reader.or_scalar)
    _, _, lt, le = reader.bounds
    return Quantity(reader.dimension, ge=0, lt=lt, le=le)


class _Confidence(Quantity):
    """A probability with which a requirement is kept, from 50 % to 99.9999 %.

    The class reads it as a ratio.
    """

    def leaf(self, value: object) -> float:
        """Read a probability, such as `95 %` or 0.95."""
        try:
            return super().leaf(value)
        except InvalidValueError as error:
            if "unit" in error.problem.problem:
                raise
            raise InvalidValueError(
                "must be a probability from 50 % to 99.9999 %", "accepted: such as 95 % or 0.95", error.problem.hint
            ) from None


_PROBABILITY = _Confidence(units.RATIO, ge=0.5, le=0.999999)


class _LimitAndConfidence(_Pair):
    """The limit of a requirement, and the probability with which the mission has to keep it.

    The class reads the limit as the value of the key, and the confidence as content beside it.
    """

    def __init__(self, limit: "Quantity", name: str, default: float | None) -> None:
        keys = {
            LIMIT_FIELD: Key(limit, "The limit."),
            CONFIDENCE_FIELD: Key(_PROBABILITY, "Probability with which the limit is kept, 50 % to 99.9999 %."),
        }
        required = () if default is not None else (LIMIT_FIELD,)
        super().__init__(name, "A limit and the confidence with which it is kept.", keys, required)
        self.default = default

    def read(self, value: object, path: KeyPath, report: Report) -> SectionValue:
        """Read both; without a confidence, the limit is that of the errors as they are declared."""
        pair = super().read(value, path, report)
        if pair is INVALID:
            return INVALID
        if not pair:
            report(path, Problem("states no limit", "accepted: {limit: …, confidence: …}"))
            return INVALID
        confidence = pair.get(CONFIDENCE_FIELD)
        # As text it is a part of the form of a mission: cases with different confidences are not one array.
        text = None if confidence is None else repr(confidence)
        return WithContent(pair.get(LIMIT_FIELD, self.default), CONFIDENCE_FIELD, text)


class WithConfidence(Paired):
    """Reader of a requirement: a limit, or `{limit: …, confidence: …}`.

    `default` is the limit of a section that states only a confidence; None if such a section is refused.
    """

    def __init__(self, limit: "Quantity", name: str, default: float | None = None) -> None:
        self.limit = limit
        super().__init__(limit, _LimitAndConfidence(limit, name, default))


class Level(Quantity):
    """A level that a requirement limits; it is an expectation over all errors, and has no confidence.

    The class reads it like any quantity, and explains the refusal of a confidence.
    """

    def read(self, value: object, path: KeyPath, report: Report) -> float | Invalid:
        """Read the level; a mapping is refused."""
        if not isinstance(value, dict):
            return super().read(value, path, report)
        problem = "is an expectation over all errors, and has no confidence"
        report(path, Problem(problem, "accepted: a level alone, such as -20 dB"))
        return INVALID


class Undirected(Quantity):
    """Size of a displacement in any direction, which can have no bias.

    The class reads it like any quantity, and explains the refusal of a bias.
    """

    def read(self, value: object, path: KeyPath, report: Report) -> float | Invalid:
        """Read the size; a mapping is refused."""
        if not isinstance(value, dict):
            return super().read(value, path, report)
        report(path, Problem("has no direction, and so no bias", "accepted: a length alone, such as 10 cm"))
        return INVALID


Points = tuple[tuple[float, float], ...]


class SortedPoints(tuple[tuple[float, float], ...]):
    """Points of a curve in rising order that the file has in another order; rows that use them carry a note.

    The points are (abscissa, ordinate), sorted by ascending abscissa.
    """


class PointsReader(Reader[T_co]):
    """A mapping of abscissas to ordinates.

    The class reads such a mapping as the points of a curve.
    """

    def __init__(self, abscissa: Quantity, ordinate: Quantity, accepted: str, fewest: int) -> None:
        self.abscissa, self.ordinate, self.accepted, self.fewest = abscissa, ordinate, accepted, fewest

    def points(self, value: object, path: KeyPath, report: Report) -> Points | Invalid:
        """Read the points of a curve, and return them sorted by ascending abscissa.

        A problem with a point is reported at the path of its abscissa. The result is a `SortedPoints` if the points
        are not in ascending order in the file.
        """
        if not isinstance(value, dict) or not self.fewest <= len(value) <= _MAX_POINTS:
            length_words = f", {len(value)} given" if isinstance(value, dict) else ""
            report(
                path,
                Problem(f"must be {self.fewest} to {_MAX_POINTS} points{length_words}", f"accepted: {self.accepted}"),
            )
            return INVALID
        points: dict[float, float | Invalid] = {}
        is_valid = True
        for key, item in value.items():
            here = (*path, key)
            try:
                abscissa = self.abscissa.leaf(key)
            except InvalidValueError as error:
                report(here, error.problem._replace(is_of_key=True))
                is_valid = False
                continue
            if abscissa in points:
                report(here, Problem("is in the list twice"))
                is_valid = False
            points[abscissa] = read_part(self.ordinate, item, here, report)
        if not is_valid or not has_valid_values(points):
            return INVALID
        sorted_points = sorted(points.items())
        return tuple(sorted_points) if sorted_points == list(points.items()) else SortedPoints(sorted_points)

    def below(self, part: str) -> Reader[object] | None:
        """Reader of the ordinates, which is the same for all points."""
        return self.ordinate

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object with abscissas as keys and ordinates as values."""
        return {
            "type": "object",
            "additionalProperties": self.ordinate.schema(definitions),
            "minProperties": self.fewest,
            "maxProperties": _MAX_POINTS,
        }


class CurveReader(PointsReader[Points]):
    """A mapping of abscissas to ordinates, read in rising order; `SortedPoints` if the file has another order."""

    def read(self, value: object, path: KeyPath, report: Report) -> Points | Invalid:
        """Read all points of the curve and sort them by ascending abscissa.

        A problem is reported with the key path of the point in which it occurs.
        """
        return self.points(value, path, report)


def either(kind: type, form: Reader[Form], other: Reader[OtherForm]) -> OneOf[Form | OtherForm]:
    """Return a reader of values in two forms: `form` reads values of the type `kind`, and `other` reads all others.

    `kind` is `list` or `dict`.
    """
    return OneOf(lambda value: form if isinstance(value, kind) else other, (other, form))


def is_empty(item: object) -> bool:
    """Whether an item of a file is an empty section or list, or a section or list that contains only such items."""
    if isinstance(item, dict):
        return all(map(is_empty, item.values()))
    return isinstance(item, list) and all(map(is_empty, item))


def is_index(step: str) -> bool:
    """Whether a step of a key path consists only of digits, which makes it the index of an entry in a list."""
    return step.isascii() and step.isdigit() and len(step) < 9


def read_part(reader: Reader[T], value: object, path: KeyPath, report: Report) -> T | Invalid:
    """Read an item of a list or a mapping; an item that is `INVALID` is returned without being reported again."""
    return INVALID if value is INVALID else reader.read(value, path, report)


def are_valid(items: tuple[T | Invalid, ...]) -> TypeGuard[tuple[T, ...]]:
    """Whether no item of a tuple is `INVALID`."""
    return INVALID not in items


def has_valid_values(mapping: Mapping[K, T | Invalid]) -> TypeGuard[dict[K, T]]:
    """Whether no value of a mapping is `INVALID`."""
    return INVALID not in mapping.values()


def _ignore_problem(path: KeyPath, problem: Problem) -> None:
    """Ignore a problem, because it is reported elsewhere."""


def did_you_mean(word: object, known_words: tuple[str, ...]) -> str:
    """Hint with the known word most similar to an unknown word; empty if no known word is similar."""
    from difflib import get_close_matches

    near = get_close_matches(str(word)[:_MAX_TEXT_CHARACTERS], known_words, 1)
    return f"Did you mean {near[0]!r}?" if near else ""


# ---------------------------------------------------------------------- bounds
# Real values are far inside these bounds, and the squares of all accepted values are finite.
RADAR_FREQUENCY = Quantity(units.FREQUENCY, gt=0, ge=1e3, le=1e13)
VIBRATION_FREQUENCY = Quantity(units.FREQUENCY, gt=0, le=1e9)
DURATION = Quantity(units.TIME, gt=0, ge=1e-6, le=1e6)
COORDINATE = Quantity(units.LENGTH, ge=-1e9, le=1e9)
RANGE = Quantity(units.LENGTH, gt=0, le=1e9)
SIZE = Quantity(units.LENGTH, ge=0, le=1e9)
VELOCITY = Quantity(units.SPEED, ge=-1e6, le=1e6)
GROUND_SPEED = Quantity(units.SPEED, ge=0, le=1e6)
ACCELERATION_COMPONENT = Quantity(units.ACCELERATION, ge=-1e6, le=1e6)
JERK_COMPONENT = Quantity(units.JERK, ge=-1e6, le=1e6)
SNAP_COMPONENT = Quantity(units.SNAP, ge=-1e6, le=1e6)
DIRECTION = Quantity(units.ANGLE, ge=-2 * math.pi, le=2 * math.pi)
LATITUDE = Quantity(units.ANGLE, ge=-math.pi / 2, le=math.pi / 2)
HEIGHT = Quantity(units.LENGTH, ge=-1e4, le=1e9)
ELEVATION = Quantity(units.ANGLE, ge=0, le=math.pi / 2)
PHASE = Quantity(units.ANGLE, ge=-1e6, le=1e6)
# A phase error of a full turn at the aperture edge leaves no mainlobe. The bound also refuses 45 without a unit,
# which would be seven turns.
PHASE_REQUIREMENT = Quantity(units.ANGLE, gt=0, ge=1e-6, le=2 * math.pi)
SIDELOBE_REQUIREMENT = Level(units.POWER_RATIO, lt=0, ge=-200)
SHARE = Quantity(units.RATIO, gt=0, ge=1e-6, le=1)
_DISTRIBUTION_WORD = Choice("normal", "uniform", "bound")


class Distributions(NamedTuple):
    """Distributions of the errors of a motion, one for each kind of error."""

    position: Annotated[str, Key(_DISTRIBUTION_WORD)] = "normal"
    velocity: Annotated[str, Key(_DISTRIBUTION_WORD)] = "normal"
    acceleration: Annotated[str, Key(_DISTRIBUTION_WORD)] = "normal"


DISTRIBUTION = either(dict, Section(Distributions), _DISTRIBUTION_WORD)
DISTRIBUTION_TEXT = (
    "normal: the values are one sigma; uniform, bound: they are not exceeded. One word, or one for each of position, "
    "velocity and acceleration."
)
UNCERTAINTY_TEXT = "A size may have one standard uncertainty behind it, such as 5 mm ± 20 %, for check --guard."
Source = Annotated[str | None, Key(Text(), "Source of the values; shown as evidence.")]
