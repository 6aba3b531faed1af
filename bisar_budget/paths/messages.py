"""Helpers for readers of orbit files and logs: text, times, numbers, and XML as a tree with line numbers.

XML files may come from untrusted sources, so references are not followed, and entities are not expanded.
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

MAX_MARKUP_BYTES = 32_000_000  # a day of an ephemeris at 1 Hz has 26 MB as XML
FIRST_ORBIT_DAY, LAST_ORBIT_DAY = 36112, 124593  # modified Julian days, 1957-10-01 and 2200-01-01
_MAX_COORDINATE_LEVEL = 1e9  # of a position or a velocity, in the unit of its file
_DECIMAL_PATTERN = re.compile(r"\s*[+-]?(\d+(?:\.\d*)?|\.\d+)([eEdD][+-]?\d+)?\s*", re.ASCII)


def hold_to_size(size: int, name: str, part: str = "objects") -> None:
    """Raise `PathFileError` if a file is larger than `MAX_MARKUP_BYTES`.

    The error message advises the user to keep only the part of the file that is needed. `part` names this part, such
    as "objects".
    """
    if size > MAX_MARKUP_BYTES:
        raise PathFileError(f"{name}: is larger than {MAX_MARKUP_BYTES // 1_000_000} MB; keep the {part} needed")


def decoded(data: bytes, name: str) -> str:
    """Decode the content of a file as UTF-8; raises `PathFileError` if it is not UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise PathFileError(f"{name}:{line}: is not a text in UTF-8 (byte {data[error.start]:#04x})") from None


def is_markup(data: bytes) -> bool:
    """Whether a file is XML, that is, whether its first character that is not blank is `<`."""
    return data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<"


def epoch_in(text: str) -> Instant | None:
    """Read an instant from a date and a time of day; None if the text is not an instant.

    The date is a calendar date, or a year and a day of the year. The accepted formats are the ASCII time codes A and
    B of CCSDS 301.0-B.
    """
    text = text.strip()
    match = re.fullmatch(r"(\d{4})-(\d{3})(T.*)", text, re.ASCII)
    if match is None:
        return parse_instant(text, needs_zone=False)
    first = parse_instant(f"{match[1]}-01-01{match[3]}", needs_zone=False)
    day = None if first is None else day_of_year(int(match[1]), int(match[2]))
    return None if first is None or day is None else Instant(day, first.seconds)


def number_in(text: object) -> float | None:
    """Convert a string or a number to a float; None if it is not a finite number."""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        return None
    if isinstance(text, str):
        if not _DECIMAL_PATTERN.fullmatch(text):
            return None
        text = text.replace("D", "e").replace("d", "e")  # as Fortran writes exponents
    try:
        value = float(text)
    except OverflowError:
        return None
    return value if math.isfinite(value) else None


def coordinate_in(text: str, location: str, requirement: str) -> float:
    """Read a coordinate of a position or velocity from a string.

    Raises `PathFileError` if the string is not a number, or if its magnitude exceeds 1e9. `requirement` describes
    the accepted numbers in the error message.
    """
    number = number_in(text)
    if number is None or abs(number) > _MAX_COORDINATE_LEVEL:
        raise PathFileError(f"{location}: {requirement} (got {shown(text.strip())})")
    return number


# ---------------------------------------------------------------------- objects
_NAMED_OBJECT_COUNT = 10  # in an error
_MAX_LIST_CHARACTERS = 400


class _Named(Protocol):
    """Data about an object, such as a satellite.

    `object` is its name in messages, and `names` are the names by which a mission may choose it.
    """

    @property
    def object(self) -> str: ...

    @property
    def names(self) -> tuple[str, ...]: ...


_Candidate = TypeVar("_Candidate", bound=_Named)


def object_key(text: str) -> str:
    """Normalise a name or number for comparisons: lower case, no extra spaces, no leading zeros of a number."""
    text = " ".join(text.split()).casefold()
    return text.lstrip("0") or "0" if text.isdecimal() and text.isascii() else text


def one_object(
    blocks: Sequence[_Candidate], name: str, object_name: str | None, number: str = "OBJECT_ID"
) -> Sequence[_Candidate]:
    """Select the blocks of a file that describe a single object: the object with a given name, or the only object.

    A block is an element set or a segment of an ephemeris. The last of an object's `names` is unique to the object;
    `number` is the term for this name in messages. Raises `PathFileError` if there is no such object, or if there are
    several.
    """
    if object_name is not None:
        key = object_key(object_name)
        matching = [block for block in blocks if key in block.names]
        if not matching:
            raise PathFileError(f"{name}: has no object {shown(object_name)}; it has {_listed(blocks)}")
        blocks = matching
    count = len({block.names[-1] for block in blocks})
    if count > 1:
        noun = "objects" if object_name is None else "objects of that name"
        name_words = number if object_name is not None else f"name or {number}"
        raise PathFileError(f"{name}: has {count} {noun}: {_listed(blocks)}; choose one by its {name_words}")
    return blocks


def _listed(objects: Sequence[_Named]) -> str:
    names = list(dict.fromkeys(candidate.object for candidate in objects))
    more = f" and {len(names) - _NAMED_OBJECT_COUNT} more" if len(names) > _NAMED_OBJECT_COUNT else ""
    return cut(", ".join(names[:_NAMED_OBJECT_COUNT])) + more


def cut(text: str) -> str:
    """Shorten a list of names to 400 characters, so that it fits into a message."""
    return text if len(text) <= _MAX_LIST_CHARACTERS else f"{text[:_MAX_LIST_CHARACTERS]}..."


# ---------------------------------------------------------------------- XML
_NO_ATTRIBUTES: Mapping[str, str] = {}
_MAX_ELEMENTS_COUNT = 2_000_000  # a day of an ephemeris at 1 Hz has 0.7 million
_MAX_XML_LEVEL = 32
_MAX_ELEMENT_CHARACTERS = 10_000  # in the text of an element


@dataclass(eq=False, slots=True)
class MessageElement:
    """An XML element: its name without namespace, the line where it begins, units, text, children and attributes."""

    name: str
    line: int
    units: str = ""
    text: str = ""
    children: list["MessageElement"] = field(default_factory=list)
    attributes: Mapping[str, str] = field(default_factory=lambda: _NO_ATTRIBUTES)

    def all(self, name: str) -> Iterator["MessageElement"]:
        """Yield all elements with a given name inside this element, in the order of the file."""
        for child in self.children:
            if child.name == name:
                yield child
            else:
                yield from child.all(name)


def parse_markup(data: bytes, name: str) -> MessageElement:
    """Parse XML into a tree of elements, and return the root of the tree.

    Raises
    ------
    PathFileError
        The content is not XML, declares a document type, or has too many elements.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    top = MessageElement("", 1)
    open_elements = [top]
    count = 0

    def fault(problem: str) -> PathFileError:
        return PathFileError(f"{name}:{parser.CurrentLineNumber}: {problem}")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > _MAX_ELEMENTS_COUNT or len(open_elements) > _MAX_XML_LEVEL:
            raise fault(f"has more than {_MAX_ELEMENTS_COUNT} elements, or {_MAX_XML_LEVEL} in each other")
        element = MessageElement(
            intern(tag.rpartition(":")[2]),
            parser.CurrentLineNumber,
            intern(attributes.get("units") or attributes.get("unit", "")),  # in files of CCSDS, and of ESA
        )
        if attributes:
            element.attributes = attributes
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def end(_: str) -> None:
        open_elements.pop()

    def text(piece: str) -> None:
        element = open_elements[-1]
        if piece.strip():
            element.text += piece
            if len(element.text) > _MAX_ELEMENT_CHARACTERS:
                raise fault(f"has a text of more than {_MAX_ELEMENT_CHARACTERS} characters")

    def doctype(*_: object) -> None:
        raise fault("declares a document type (DOCTYPE), which is not read; take it out")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise PathFileError(f"{name}:{error.lineno}: is not XML: {expat.ErrorString(error.code)}") from None
    except (LookupError, ValueError) as error:  # an unknown encoding
        raise PathFileError(f"{name}:1: is not XML: {shown(str(error))}") from None
    return top
