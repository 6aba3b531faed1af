"""Faults of input files, with the details needed to correct them: location, problem, given and accepted values."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

KeyPath = tuple[str | int, ...]
ParserEvent = Any
"""An event of the YAML parser, or `Changed`: which attributes it has follows from its type."""


def upwards(path: KeyPath) -> Iterator[KeyPath]:
    """Yield the path of a key, then the paths of the mappings or lists that contain it, from the innermost outwards.

    The empty path, which denotes the whole file, is not included.
    """
    return (path[:length] for length in range(len(path), 0, -1))


class Region(NamedTuple):
    """Region of a value in a file. Lines, and columns of characters, are counted from 1.

    `end_column` is the column after the last character. `end_line` and `end_column` are None for a mapping or a list,
    because a message points only at its start.
    """

    line: int
    column: int
    end_line: int | None = None
    end_column: int | None = None


class Place(int):
    """Line of a value in a file, counted from 1, together with the region of the value.

    A `Place` is an integer, the line number, for code that needs only the line. Reports for editors and pull requests
    use the region. `text` is the value as written in the file; it is empty for a mapping or a list.
    """

    region: Region
    text: str

    @classmethod
    def of(cls, event: ParserEvent) -> "Place":
        """Place of an event of the YAML parser.

        Many rows refer to the same key, so all calls with the same event return the same object. The object stores
        four numbers and the text instead of the marks of the parser, which would take half the memory of a mission.
        """
        fields: dict[str, ParserEvent] = event.__dict__
        position: Place | None = fields.get("place")
        if position is None:
            start, end = fields["start_mark"], fields["end_mark"]
            line = start.line + 1
            position = fields["place"] = cls(line)
            is_scalar = fields.get("value") is not None
            ends = (end.line + 1, end.column + 1) if is_scalar else (None, None)
            position.region = Region(line, start.column + 1, *ends)
            position.text = fields["value"] if is_scalar else ""
        return position


def printable(text: str) -> str:
    """Return a user's text on one line, without control characters that affect a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def shown(text: str) -> str:
    """Format a value from a file as a short string, without control characters that affect a terminal."""
    text = printable(text[:61])
    return text if len(text) <= 60 else text[:57] + "..."


def fault_words(problem: str, given: str = "", accepted: str = "", hint: str = "") -> str:
    """Format a fault as `what is wrong (got value); what is accepted. Hint`; all but the first part may be empty."""
    text = problem
    if given:
        text += f" (got {given})"
    if accepted:
        text += f"; {accepted}"
    return sentences(text, hint)


def sentences(*texts: str) -> str:
    """Join strings as sentences: each but the last gets a full stop, unless it ends with a question mark."""
    joined = ""
    for text in filter(None, texts):
        joined = f"{closed(joined)} {text}" if joined else text
    return joined


def closed(text: str) -> str:
    """Add a full stop to a string, unless it ends with a full stop or a question mark."""
    return text if text.endswith((".", "?")) else f"{text}."


class SetValue(NamedTuple):
    """Value from an option that replaces a value of the mission file, such as `--set radar.bandwidth=150MHz`.

    `text` is the value as it would be written in a mission file.
    """

    key: str
    text: str

    @property
    def option(self) -> str:
        """Text of the option that gave the value; messages about the value begin with it."""
        return f"--set {printable(self.key)}"


_BY_UNIT = ("m/s^2", "(m/s^2)^2/Hz", "m^2/Hz")  # keys with these units have several dimensions


class SetNumber(SetValue):
    """Number in SI units, with its text, that replaces a value of the mission, for example in one case of a sweep.

    Code that reads the mission uses `value`, and messages show `text`. `value` is the number, or the text if the key
    accepts quantities of several dimensions.
    """

    value: float | str

    @classmethod
    def of(cls, key: str, number: float, unit: str) -> "SetNumber":
        """Create the replacement of the value at `key` by a number in the SI unit `unit`, which may be empty."""
        set_number = cls(key, f"{number!r} {unit}".rstrip())
        set_number.value = set_number.text if unit in _BY_UNIT else number
        return set_number


class Changed:
    """Substitute for an event of the YAML parser, used for a value from an option, which has no line in a file."""

    start_mark = None


def changes_words(changes: Sequence[SetValue]) -> str:
    """Format the options that changed a mission as they are written on the command line.

    The result is an empty string if no option changed the mission.
    """
    if not changes:
        return ""
    from shlex import quote

    return " ".join(f"--set {quote(printable(f'{change.key}={change.text}'))}" for change in changes)


class Problem(NamedTuple):
    """Problem with a value, reported by code that knows neither the file nor the key of the value.

    `at` is the path of the wrong value relative to the checked value. `names_value` is true if the text already
    contains the value. `is_of_key` is true if the key is wrong, whatever its value.
    """

    problem: str
    accepted: str = ""
    hint: str = ""
    at: KeyPath = ()
    names_value: bool = False
    is_of_key: bool = False

    @property
    def words(self) -> str:
        """Text of the full problem, with the accepted values and the hint."""
        return fault_words(self.problem, "", self.accepted, self.hint)


class InvalidValueError(ValueError):
    """The value of a key is not accepted."""

    def __init__(self, problem: str, accepted: str = "", hint: str = "") -> None:
        super().__init__(problem)
        self.problem = Problem(problem, accepted, hint)


class Fault(NamedTuple):
    """One fault of a mission file.

    `line` and `column` are counted from 1; they are None for a fault of the whole file. `option` is the option that
    gave the value; it is empty for a value in the file. `file` is the name of the mission file; it is set for the
    faults of a `MissionError`.
    """

    line: int | None
    column: int | None
    key: str
    problem: str
    given: str = ""
    accepted: str = ""
    hint: str = ""
    option: str = ""
    file: str = ""

    @property
    def message(self) -> str:
        """Description of the problem only; location, given value and accepted values are not included."""
        return self.problem

    def __str__(self) -> str:
        """Write `key: what is wrong (got value); what is accepted. Hint`, with the option before the key."""
        text = f"{self.option}: " if self.option else ""
        text += f"{self.key}: " if self.key and self.option != f"--set {self.key}" else ""
        return text + fault_words(self.problem, self.given, self.accepted, self.hint)


def file_fault(problem: str, hint: str = "") -> Fault:
    """Return a fault that concerns the file as a whole."""
    return Fault(line=None, column=None, key="", problem=problem, hint=hint)


class ClusterError(Exception):
    """Cluster workers, or a folder of partial results, cannot be used; the message gives reason and remedy."""


class WorkerLostError(Exception):
    """A worker process ended before it finished its work."""


class MotionKindError(ValueError):
    """The motion of a registered kind of error cannot be used; the message names the kind and its package."""


class MissionError(Exception):
    """A mission file cannot be used. The exception lists all faults of the file, in file order.

    `data` is the content of the file in bytes. It is None if there is no file, or if the file was not read to its
    end.
    """

    def __init__(self, file: str, faults: tuple[Fault, ...]) -> None:
        super().__init__(file, faults)
        self.file = file
        self.faults = tuple(fault._replace(file=file) for fault in faults)
        self.data: bytes | None = None

    def __str__(self) -> str:
        """Text of all faults of the file, with each fault on a line of its own."""
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """List the faults of the file as strings `file:line:column: fault`."""
        return [
            ":".join(str(part) for part in (printable(self.file), fault.line, fault.column) if part is not None)
            + f": {fault}"
            for fault in self.faults
        ]
