"""Files of orbits and logs: texts, times and numbers, and XML as a tree whose elements know their lines.

XML is that of others: no reference is followed, no entity is expanded.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from sys import intern
from typing import Protocol, TypeVar
from xml.parsers import expat

from bisar_budget.faults import shown
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import Instant, day_of_year, parse_instant

LARGEST_BYTES = 32_000_000  # a day of an ephemeris at 1 Hz has 26 MB as XML
EARLIEST, LATEST = 36112, 124593  # modified Julian days of 1957-10-01 and 2200-01-01, for which there are orbits
_FARTHEST = 1e9  # of a place, in m or km, and of a velocity
_NUMBER = re.compile(r"\s*[+-]?(\d+(?:\.\d*)?|\.\d+)([eEdD][+-]?\d+)?\s*", re.ASCII)


def hold_to_size(size: int, name: str, part: str = "objects") -> None:
    """Refuse a file that is too large, and say what to keep of it."""
    if size > LARGEST_BYTES:
        raise PathFileError(f"{name}: is larger than {LARGEST_BYTES // 1_000_000} MB; keep the {part} needed")


def decoded(data: bytes, name: str) -> str:
    """The text of a file, which is UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise PathFileError(f"{name}:{line}: is not a text in UTF-8 (byte {data[error.start]:#04x})") from None


def is_markup(data: bytes) -> bool:
    """Whether a file is XML, and not text of keywords."""
    return data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<"


def epoch_in(text: str) -> Instant | None:
    """Instant from a calendar date, or a year and its day: CCSDS 301.0-B, ASCII time codes A and B."""
    text = text.strip()
    match = re.fullmatch(r"(\d{4})-(\d{3})(T.*)", text, re.ASCII)
    if match is None:
        return parse_instant(text, needs_zone=False)
    first = parse_instant(f"{match[1]}-01-01{match[3]}", needs_zone=False)
    day = None if first is None else day_of_year(int(match[1]), int(match[2]))
    return None if first is None or day is None else Instant(day, first.seconds)


def number_in(text: object) -> float | None:
    """A finite number from a text or a number; None otherwise."""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        return None
    if isinstance(text, str):
        if not _NUMBER.fullmatch(text):
            return None
        text = text.replace("D", "e").replace("d", "e")  # as Fortran writes exponents
    try:
        value = float(text)
    except OverflowError:
        return None
    return value if math.isfinite(value) else None


def coordinate_in(text: str, where: str, says: str) -> float:
    """A number of a place or a velocity from a text; refused with what is said where it is none, or beyond 1e9."""
    number = number_in(text)
    if number is None or abs(number) > _FARTHEST:
        raise PathFileError(f"{where}: {says} (got {shown(text.strip())})")
    return number


# ---------------------------------------------------------------------- objects
_LISTED = 10  # objects that an error names
_LONGEST_LIST = 400  # characters


class _Named(Protocol):
    """An object of a file: how messages call it, and the names that a mission may choose it by."""

    @property
    def object(self) -> str: ...

    @property
    def names(self) -> tuple[str, ...]: ...


_Candidate = TypeVar("_Candidate", bound=_Named)


def object_key(text: str) -> str:
    """A name or number as it is compared: neither case nor spaces, and a number without its leading zeros."""
    text = " ".join(text.split()).casefold()
    return text.lstrip("0") or "0" if text.isdecimal() and text.isascii() else text


def one_object(
    found: Sequence[_Candidate], name: str, wanted: str | None, number: str = "OBJECT_ID"
) -> Sequence[_Candidate]:
    """Blocks of a file about the object that is wanted, or about the only one.

    The last of an object's `names` is its own alone; `number` is what messages call it.
    """
    if wanted is not None:
        key = object_key(wanted)
        ours = [one for one in found if key in one.names]
        if not ours:
            raise PathFileError(f"{name}: has no object {shown(wanted)}; it has {_listed(found)}")
        found = ours
    count = len({one.names[-1] for one in found})
    if count > 1:
        said = "objects" if wanted is None else "objects of that name"
        by = number if wanted is not None else f"name or {number}"
        raise PathFileError(f"{name}: has {count} {said}: {_listed(found)}; choose one by its {by}")
    return found


def _listed(found: Sequence[_Named]) -> str:
    names = list(dict.fromkeys(one.object for one in found))
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return cut(", ".join(names[:_LISTED])) + more


def cut(text: str) -> str:
    """A list that a message can hold."""
    return text if len(text) <= _LONGEST_LIST else f"{text[:_LONGEST_LIST]}..."


# ---------------------------------------------------------------------- XML
_NONE: Mapping[str, str] = {}
_MOST = 2_000_000  # elements; a day of an ephemeris at 1 Hz has 0.7 million
_DEEPEST = 32
_LONGEST = 10_000  # characters of an element's own text


@dataclass(eq=False, slots=True)
class MessageElement:
    """An element: its name without namespace, the line where it begins, its units, text, children and attributes."""

    name: str
    line: int
    units: str = ""
    text: str = ""
    children: list["MessageElement"] = field(default_factory=list)
    attributes: Mapping[str, str] = field(default_factory=lambda: _NONE)

    def all(self, name: str) -> Iterator["MessageElement"]:
        """Elements of a name anywhere below, in the order of the file."""
        for child in self.children:
            if child.name == name:
                yield child
            else:
                yield from child.all(name)


def parse_markup(data: bytes, name: str) -> MessageElement:
    """Read XML.

    Raises
    ------
    PathFileError
        The text is not XML, declares a document type, or has too many elements.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    top = MessageElement("", 1)
    open_ones = [top]
    count = 0

    def here(problem: str) -> PathFileError:
        return PathFileError(f"{name}:{parser.CurrentLineNumber}: {problem}")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > _MOST or len(open_ones) > _DEEPEST:
            raise here(f"has more than {_MOST} elements, or {_DEEPEST} in each other")
        one = MessageElement(
            intern(tag.rpartition(":")[2]),
            parser.CurrentLineNumber,
            intern(attributes.get("units") or attributes.get("unit", "")),  # as CCSDS has it, and ESA
        )
        if attributes:
            one.attributes = attributes
        open_ones[-1].children.append(one)
        open_ones.append(one)

    def end(_: str) -> None:
        open_ones.pop()

    def text(found: str) -> None:
        one = open_ones[-1]
        if found.strip():
            one.text += found
            if len(one.text) > _LONGEST:
                raise here(f"has a text of more than {_LONGEST} characters")

    def doctype(*_: object) -> None:
        raise here("declares a document type (DOCTYPE), which is not read; take it out")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise PathFileError(f"{name}:{error.lineno}: is not XML: {expat.ErrorString(error.code)}") from None
    except (LookupError, ValueError) as error:  # an encoding that nobody has
        raise PathFileError(f"{name}:1: is not XML: {shown(str(error))}") from None
    return top
