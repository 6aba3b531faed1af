"""XML of others as a tree whose elements know their lines. It follows no reference and expands no entity."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from sys import intern
from xml.parsers import expat

from bisar_budget.faults import shown
from bisar_budget.paths.flight import PathFileError

_MOST = 2_000_000  # elements; a day of an ephemeris at 1 Hz has 0.7 million
_DEEPEST = 32
_LONGEST = 10_000  # characters of an element's own text


@dataclass(eq=False, slots=True)
class MessageElement:
    """An element of a message: its name without namespace, the line where it begins, its units, text and children."""

    name: str
    line: int
    units: str = ""
    text: str = ""
    children: list["MessageElement"] = field(default_factory=list)

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
            intern(tag.rpartition(":")[2]), parser.CurrentLineNumber, intern(attributes.get("units", ""))
        )
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
