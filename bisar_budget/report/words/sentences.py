"""Words of every format: how much of its limit a row uses and why, sizes in units of the file, lines, escapes."""

import math
import os
import re
from collections.abc import Iterable, Iterator, Sequence

from bisar_budget.faults import KeyPath, Place, printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, SPECIFICATION, Row
from bisar_budget.units import format_in, given_unit

# What can set an allowable, in words; of a requirement the terminal has room for the first.
BINDING_WORDS = {
    "quadratic_phase_error": "quadratic phase error",
    "cubic_phase_error": "cubic phase error",
    "location_error": "location error",
    "islr": "ISLR",
    "end_of_image": "end of the image",
}


def matters(row: Row) -> bool:
    """Whether a row is declared or limits something; along other axes than the file's, only if it does not pass."""
    if row.status in ("info", "pass"):
        is_some = row.declared is not None if row.unit == "dB" else bool(row.declared)  # 0 dB is a noise as it is
        return (row.is_independent or row.metric == SPECIFICATION) and (row.status == "pass" or is_some)
    return row.status != "not_declared"


def binding_words(row: Row) -> str:
    """Say which other requirement than the one the row is about sets its allowable; nothing if it is that one."""
    return "" if row.binding_requirement == row.metric else BINDING_WORDS.get(row.binding_requirement or "", "")


def percent(ratio: float) -> str:
    """Write a ratio in percent; near 100 % with the digits that tell which side it is on."""
    value = 100 * ratio
    if value == 0:
        return "0 %"
    if value >= 99999.5:
        return ">1e5 %"
    if value < 0.01:
        return "<0.01 %"
    if value < 0.1:
        return f"{value:.2g} %"  # as wide as the column
    if value < 99:
        return f"{value:.3g} %"
    side = 0 if abs(value - 100) < 1e-7 else math.copysign(1, value - 100)
    for digits in range(max(3, len(f"{value:.0f}")), 13):
        text = f"{value:.{digits}g}"
        shown = float(text) - 100
        if (shown > 0) == (side > 0) and (shown < 0) == (side < 0):
            return f"{text} %"
    return f"{value} %"


def share_percent(part: float) -> str:
    """Write a part of a whole in percent, to three digits: it has no limit that it is on one side of."""
    return "<0.01 %" if 0 < part < 1e-4 else f"{100 * part:.3g} %"


def use_words(use: float | None) -> str:
    """A utilization in percent; a dash where there is none."""
    return "-" if use is None else percent(use)


def own_id(row: Row) -> str:
    """Requirement of the project that a row concerns, in brackets behind its id; empty where the file names none."""
    return f" [{row.requirement_id}]" if row.requirement_id else ""


def measure(row: Row, mission: MissionFindings) -> str:
    """Say what is declared, what is allowed and how much of it is used."""
    if row.metric == DECLARE:
        return "everything asked for is declared" if row.status == "pass" else "not everything asked for is declared"
    declared = "not declared" if row.declared is None else f"declared {row_size(row.declared, row, mission)}"
    if row.allowable is None:
        return declared
    text = f"{declared}, allowable {row_limit(row, mission)}"
    if binding := binding_words(row):
        text += f" (limited by the {binding})"
    return text if row.utilization is None else f"{text}, {percent(row.utilization)} of it used"


def cause(row: Row) -> str:
    """Say why the status is what it is, with the notes; may be empty."""
    return "; ".join([row.reason, *row.notes] if row.reason else row.notes)


def finding(row: Row, mission: MissionFindings) -> str:
    """Say both, and which requirement of the project it concerns."""
    why = cause(row)
    return f"{row.id}{own_id(row)}: {measure(row, mission)}{f'. {sentence(why)}' if why else ''}"


def counted(count: int, noun: str) -> str:
    """A number of things: `1 fault`, `2 faults`."""
    return f"{count} {noun}{'s' if count != 1 else ''}"


_WAIVERS = 3  # whose ids a sentence has room for


def waiver_names(ids: Sequence[str]) -> str:
    """Ids of waivers as the file writes them: `waiver receiver.*`, of many the first and how many there are more."""
    return f"waiver{'s' if len(ids) > 1 else ''} {_some(ids)}"


def waived_count(count: int, ids: Sequence[str]) -> str:
    """Number of missions that are waived, and by which waivers: `12 waived (mission.location_error)`."""
    return f"{count} waived ({_some(ids)})" if ids else f"{count} waived"


def _some(ids: Sequence[str]) -> str:
    shown = [printable(one) for one in ids[:_WAIVERS]]
    return ", ".join([*shown, f"{len(ids) - _WAIVERS} more"] if len(ids) > _WAIVERS else shown)


def dotted(path: KeyPath) -> str:
    """Write a path of keys as `--set` takes it."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def sentence(text: str) -> str:
    """Begin with a capital letter; what begins with the name of a row or a file keeps its letters."""
    first = text.partition(" ")[0].rstrip(",:;")
    return text[:1].upper() + text[1:] if first.replace("-", "").isalpha() else text


def dashed(text: str) -> str:
    """Write the dash of what has no value as a page does."""
    return "–" if text == "-" else text


_PHASE_UNIT = "deg"  # of the phase requirement that a file does not state
LEVELS = ("pslr", "islr")  # requirements in dB of the image, and the kinds of the rows that add them up
# Kinds of rows that add phases up.
_OF_PHASES = ("quadratic_phase_error", "cubic_phase_error", "spatial_variance", "dispersion")


def row_size(value: float | None, row: Row, mission: MissionFindings, rounding: str = "nearest") -> str:
    """Write a number of a row: in the unit of its value in the file, of phases together in that of their requirement.

    Without a unit there, with a prefix that keeps it readable; a dash where there is none.
    """
    if value is None:
        return "-"
    given = _given(row.line, row.unit)
    if not given and row.unit == "rad" and row.subject.kind in _OF_PHASES:
        given = phase_unit(mission)
    return format_in(_level(value, row.unit), row.unit, given, 3, rounding)


def row_limit(row: Row, mission: MissionFindings) -> str:
    """Write the allowable of a row, rounded down, so that copied from the page into a file it passes.

    Rows of PSLR and ISLR are levels of the image, which no file states as an error: to the nearest.
    """
    return row_size(row.allowable, row, mission, "nearest" if row.subject.kind in LEVELS else "down")


def allowable_words(row: Row, mission: MissionFindings) -> str:
    """The allowable of a row; a dash where it was not judged, or where its metric has no limit of its own."""
    if row.allowable is not None:
        return row_limit(row, mission)
    is_open = row.status in ("not_evaluated", "info") or row.metric in ("pslr", "islr", DECLARE)
    return "-" if is_open else "no limit"


def shown_use(row: Row) -> float | None:
    """Utilization of a row; None where it has no limit, or cannot be judged, be that waived or not."""
    return None if row.allowable is None or row.is_unjudged or row.status == "not_evaluated" else row.utilization


def phase_unit(mission: MissionFindings) -> str:
    """Unit of the quadratic phase requirement."""
    lines = (one.line for one in mission.requirements if one.key == "quadratic_phase_error")
    return _given(next(lines, None), "rad") or _PHASE_UNIT


def phase_limit(value: float, mission: MissionFindings) -> str:
    """Write a phase that is allowed, rounded down, in the unit of the quadratic phase requirement. [rad]"""
    return format_in(value, "rad", phase_unit(mission), 3, "down")


def requirement_limit(value: float | None, one: JudgedRequirement) -> str:
    """Write what a requirement or a share of it allows: a level to the nearest, any other limit rounded down."""
    return requirement_size(value, one, "nearest" if one.key in LEVELS else "down")


def requirement_size(value: float | None, one: JudgedRequirement, rounding: str = "nearest") -> str:
    """Write a number of a requirement in the unit that the file states it in; a dash where there is none."""
    if value is None:
        return "-"
    given = _given(one.line, one.unit) or (_PHASE_UNIT if one.unit == "rad" else "")
    return format_in(_level(value, one.unit), one.unit, given, 3, rounding)


LEAST_LEVEL_DB = 5e-4  # an echo as strong as its point is 0 dB, but for rounding


def _level(value: float, unit: str) -> float:
    """The number itself; 0 of a level that is 0 dB but for rounding."""
    return 0.0 if unit == "dB" and abs(value) < LEAST_LEVEL_DB else value


def _given(line: int | None, unit: str) -> str:
    return given_unit(line.text, unit) if isinstance(line, Place) else ""


WIDTH = 80


def wrapped(text: str, indent: str) -> list[str]:
    """Break at spaces before 80 columns; a word that is longer stays whole, so that a path can be copied."""
    lines = []
    while len(text) > WIDTH:
        margin = len(text) - len(text.lstrip(" "))
        space = text.rfind(" ", margin, WIDTH + 1)
        if space < 0:
            space = text.find(" ", max(margin, WIDTH + 1))
        if space < 0:
            break
        lines.append(text[:space])
        text = indent + text[space + 1 :]
    return [*lines, text]


def wrapped_counts(text: str) -> list[str]:
    """Break `file: 1 FAIL, 2 pass` before 80 columns, after a colon or comma."""
    joined = text.replace(" ", "\u00a0").replace(",\u00a0", ", ").replace(":\u00a0", ": ").replace(";\u00a0", "; ")
    first, *rest = (line.replace("\u00a0", " ") for line in wrapped(joined, "  "))
    return [first, *(part for line in rest for part in wrapped(line, "    "))]  # the first has the file, to be copied


def spaced(cells: Sequence[str], widths: Sequence[int], sides: str) -> str:
    """Cells in columns of some widths, each to the left `<` or to the right `>` of its own."""
    return " ".join(f"{cell:{side}{width}}" for cell, width, side in zip(cells, widths, sides, strict=True))


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Align rows of cells, the header first."""
    return [line for lines in aligned(rows) for line in lines]


def aligned(rows: Sequence[Sequence[str]]) -> Iterator[list[str]]:
    """Lines of each row of a table: names to the left, numbers to the right, the last column to the left.

    A name that would take its line beyond 80 columns gets a line of its own, above its numbers.
    """
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    room = WIDTH - sum(widths[1:]) - len(widths) + 1
    first = max(len(row[0]) for row in rows if len(row[0]) <= max(room, len(rows[0][0])))  # the header stays whole
    for name, *cells in rows:
        rest = f"{spaced(cells[:-1], widths[1:-1], '>' * (len(cells) - 1))} {cells[-1]}".rstrip()
        yield [f"{name:<{first}} {rest}"] if len(name) <= first else [name, f"{'':<{first}} {rest}"]


_XML = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&apos;"}
_XML_SPECIAL = re.compile("[&<>\"']")
# What means something in GitHub's Markdown or in the HTML within it, and only where it does: a report is also read
# as it is. Within a word an underscore is one, and brackets, escaped, need nothing of the ( and ! beside them.
_MARKDOWN_SPECIAL = re.compile(
    r"[\\`*\[\]<>|$~]"
    r"|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])"
    r"|&(?=#|\w+;)|@(?=\w)|#(?=\w)|:(?=//|(?:[\w+-]*[A-Z+-][\w+-]*|100|1234):)|(?<=www)\."
    r"|^[-+#=](?=[-+#= ]|$)|^ ",
    re.IGNORECASE | re.ASCII,
)
_MARKDOWN_NUMBER = re.compile(r"^(\d{1,9})([.)])(?=\s|$)", re.ASCII)  # of a list


def xml_text(text: str) -> str:
    """Escape for XML, elements and attributes alike; characters that XML does not have cannot occur."""
    text = printable(text)
    return _XML_SPECIAL.sub(lambda match: _XML[match[0]], text) if _XML_SPECIAL.search(text) else text


def _markdown_escape(match: re.Match[str]) -> str:
    """A backslash can be read past; what it cannot tame everywhere becomes a character reference."""
    special = match[0]
    return f"\\{special}" if special in r"\*_[]~" else f"&#{ord(special)};"


def markdown_text(text: str) -> str:
    """Escape for Markdown, also in a table or at the start of a line."""
    escaped = _MARKDOWN_SPECIAL.sub(_markdown_escape, printable(text))
    return _MARKDOWN_NUMBER.sub(lambda match: f"{match[1]}&#{ord(match[2])};", escaped)


def markdown_row(cells: Iterable[str]) -> str:
    """A line of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def command_text(text: str) -> str:
    """Escape the message of a workflow command of GitHub's runner."""
    return printable(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def command_property(text: str) -> str:
    """Escape a property of a workflow command, which also ends at a colon or a comma."""
    return command_text(text).replace(":", "%3A").replace(",", "%2C")


def rst_text(text: str) -> str:
    """Escape for one line of reStructuredText: any punctuation can mean something there."""
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", printable(text))


def need_text(text: str) -> str:
    """Keep a field of a need from being run: Sphinx-Needs calls `[[function()]]` and looks up `<<variant>>`."""
    return printable(text).replace("[[", "[ [").replace("<<", "< <")


def uri(path: str) -> str:
    """Percent-encode a path with forward slashes; an absolute one becomes a `file` URI."""
    from urllib.parse import quote  # 2 ms, and a check to a terminal does without

    encoded = quote(os.fsencode(path), safe="/")
    return f"file:///{encoded.lstrip('/')}" if os.path.isabs(path) else encoded


_SIGNS = "=+-@\uff1d\uff0b\uff0d\uff20"  # of a formula, and their full-width forms, which some programs take for them
_SIZE = re.compile(r"-|[+-]?\d+(\.\d+)?(e[+-]?\d+)?( [A-Za-z\u00b5\u00b0%/\u00b2\u00b3\u221a]+)?")  # nothing to run


def spreadsheet_text(value: str | None) -> str | None:
    """Keep text from being run: a spreadsheet takes what starts like a formula, after blanks too, for one."""
    value = printable(value) if value else value
    is_formula = bool(value) and (value or "").lstrip()[:1] in tuple(_SIGNS) and not _SIZE.fullmatch(value or "")
    return f"'{value}" if is_formula else value
