"""Faults of input, said so that they can be mended: where, what, the value given, what is accepted."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

KeyPath = tuple[str | int, ...]


def upwards(path: KeyPath) -> Iterator[KeyPath]:
    """A path and those above it, the nearest first; not the file itself."""
    return (path[:length] for length in range(len(path), 0, -1))


class Region(NamedTuple):
    """Where a value stands, counted from 1 in characters; `end_column` is the one behind its last.

    The ends are None for a mapping or a list: it is pointed at, not spanned.
    """

    line: int
    column: int
    end_line: int | None = None
    end_column: int | None = None


class Place(int):
    """Line of a value in a file, from 1, which also knows where on the line the value stands.

    A number for everybody who wants the line; reports for editors and pull requests ask for the region. `text` is
    what stands there, as the file has it; empty for a mapping or a list.
    """

    region: Region
    text: str

    @classmethod
    def of(cls, event: Any) -> "Place":
        """Place of what the YAML parser saw; one for every event, since many rows point at the same key.

        It keeps four numbers and the text, and lets the parser's marks go: they are half the memory of a mission.
        """
        fields: dict[str, Any] = vars(event)
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
    """Write text of a user's own so that it stays on its line and does nothing to a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def shown(text: str) -> str:
    """Say a value from a file so that it stays short and does nothing to a terminal."""
    text = printable(text[:61])
    return text if len(text) <= 60 else text[:57] + "..."


def fault_words(problem: str, given: str = "", accepted: str = "", hint: str = "") -> str:
    """Write `what is wrong (got value); what is accepted. Hint`, of which all but the first may be empty."""
    text = problem
    if given:
        text += f" (got {given})"
    if accepted:
        text += f"; {accepted}"
    return sentences(text, hint)


def sentences(*texts: str) -> str:
    """Join texts by full stops, but for those that end with a question mark; the last is left as it is."""
    joined = ""
    for text in filter(None, texts):
        joined = f"{closed(joined)} {text}" if joined else text
    return joined


def closed(text: str) -> str:
    """The text with a full stop at its end, if it has neither that nor a question mark."""
    return text if text.endswith((".", "?")) else f"{text}."


class SetValue(NamedTuple):
    """A value that an option puts in place of what a mission file says: `--set radar.bandwidth=150MHz`.

    `text` is the value as a file would have it.
    """

    key: str
    text: str

    @property
    def option(self) -> str:
        """The beginning of a message about the value."""
        return f"--set {printable(self.key)}"


_BY_UNIT = ("m/s^2", "(m/s^2)^2/Hz", "m^2/Hz")  # of keys whose readers tell by the unit what is meant


class SetNumber(SetValue):
    """A number in SI in the same place, as of a case of a sweep: readers take it as it is, the text is for people.

    `value` is what readers take: of a key that has several dimensions the text.
    """

    value: float | str

    @classmethod
    def of(cls, key: str, number: float, unit: str) -> "SetNumber":
        """The number for a key; `unit` is the one of SI."""
        set_number = cls(key, f"{number!r} {unit}".rstrip())
        set_number.value = set_number.text if unit in _BY_UNIT else number
        return set_number


class Changed:
    """Stands where the parser's event of a value would: the value is from an option, and has no line."""

    start_mark = None


def changes_words(changes: Sequence[SetValue]) -> str:
    """Write the options that changed a mission as they can be given again; empty if there is none."""
    if not changes:
        return ""
    from shlex import quote

    return " ".join(f"--set {quote(printable(f'{change.key}={change.text}'))}" for change in changes)


class Problem(NamedTuple):
    """Something wrong with a value, before anybody knows which file it stands in.

    `at` is the path of the culprit below the value that was checked. `names_value`: it says the value itself.
    `is_of_key`: the key is wrong, whatever its value.
    """

    problem: str
    accepted: str = ""
    hint: str = ""
    at: KeyPath = ()
    names_value: bool = False
    is_of_key: bool = False

    @property
    def words(self) -> str:
        """Words for all of it: the fault, what is accepted, and the hint."""
        return fault_words(self.problem, "", self.accepted, self.hint)


class InvalidValueError(ValueError):
    """A value that does not say what its key asks for."""

    def __init__(self, problem: str, accepted: str = "", hint: str = "") -> None:
        super().__init__(problem)
        self.problem = Problem(problem, accepted, hint)


class Fault(NamedTuple):
    """One fault of a mission file. Line and column count from 1; None where the whole file is meant.

    `option` is the option that the value comes from, instead of a line; empty if it stands in the file. `file` is
    that of the mission, known where the fault is one of a `MissionError`.
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
        """The problem, without its place, the value given and what is accepted."""
        return self.problem

    def __str__(self) -> str:
        """Write `key: what is wrong (got value); what is accepted. Hint`, with the option before the key."""
        text = f"{self.option}: " if self.option else ""
        text += f"{self.key}: " if self.key and self.option != f"--set {self.key}" else ""
        return text + fault_words(self.problem, self.given, self.accepted, self.hint)


def file_fault(problem: str, hint: str = "") -> Fault:
    """A fault of the file as a whole."""
    return Fault(line=None, column=None, key="", problem=problem, hint=hint)


class ClusterError(Exception):
    """Workers, or a folder of parts, that cannot be used; the message says why, and what can be done."""


class WorkerLostError(Exception):
    """A worker process ended before its work did."""


class MissionError(Exception):
    """A mission file that cannot be used, with every fault found in it, in file order.

    `data` is the file as read, byte for byte; None where there is none, or more of it than was read.
    """

    def __init__(self, file: str, faults: tuple[Fault, ...]) -> None:
        super().__init__(file, faults)
        self.file = file
        self.faults = tuple(fault._replace(file=file) for fault in faults)
        self.data: bytes | None = None

    def __str__(self) -> str:
        """Every fault on a line of its own."""
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """Write one `file:line:column: fault` per fault."""
        return [
            ":".join(str(part) for part in (printable(self.file), fault.line, fault.column) if part is not None)
            + f": {fault}"
            for fault in self.faults
        ]
