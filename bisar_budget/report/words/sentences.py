"""Texts that all report formats use: utilizations, causes, values in the units of the file, tables, escaped text."""

import math
import os
import re
from collections.abc import Iterable, Iterator, Sequence

from bisar_budget.faults import KeyPath, Place, printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, SPECIFICATION, Row
from bisar_budget.units import format_in, format_quantity, given_unit

# Words for requirements that can set an allowable. The terminal writes only the first word.
BINDING_WORDS = {
    "quadratic_phase_error": "quadratic phase error",
    "cubic_phase_error": "cubic phase error",
    "location_error": "location error",
    "islr": "ISLR",
    "end_of_image": "end of the image",
}


def matters(row: Row) -> bool:
    """Whether a row is worth showing: its error is declared, or it has a limit that is checked.

    A passing row is nevertheless left out if its axes differ from the axes used in the mission file.
    """
    if row.status in ("info", "pass"):
        is_declared = (
            row.declared is not None if row.unit == "dB" else bool(row.declared)
        )  # 0 dB is the noise as declared
        return (row.is_independent or row.metric == SPECIFICATION) and (row.status == "pass" or is_declared)
    return row.status != "not_declared"


def binding_words(row: Row) -> str:
    """Name of the requirement that sets the allowable of a row.

    The name is empty if the metric of the row is the quantity that this requirement limits.
    """
    return "" if row.binding_requirement == row.metric else BINDING_WORDS.get(row.binding_requirement or "", "")


def percent(ratio: float) -> str:
    """Write a ratio in percent.

    Near 100 %, enough digits are written to show whether the ratio is above or below 100 %.
    """
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


def share_percent(fraction: float) -> str:
    """Write a fraction in percent with three digits. In contrast to `percent`, no digits are added near 100 %."""
    return "<0.01 %" if 0 < fraction < 1e-4 else f"{100 * fraction:.3g} %"


def use_words(use: float | None) -> str:
    """Write a utilization in percent. None is written as a hyphen."""
    return "-" if use is None else percent(use)


def own_id(judged: Row | JudgedRequirement) -> str:
    """Ids of the project requirements to which a row, or a requirement of the mission, refers.

    They are written in brackets and with a leading space. The text is empty if there are no ids.
    """
    return f" [{judged.requirement_id}]" if judged.requirement_ids else ""


def measure(row: Row, mission: MissionFindings) -> str:
    """Text with the declared value, allowable and utilization of a row."""
    if row.metric == DECLARE:
        return "everything asked for is declared" if row.status == "pass" else "not everything asked for is declared"
    if row.declared is None:
        declared = "not declared"
    elif is_noise_level(row):
        declared = row_size(row.declared, row, mission)
        declared = f"noise {declared}" if declared == AS_DECLARED else f"noise {declared} on the declared one"
    else:
        declared = f"declared {declared_size(row, mission)}"
    if row.allowable is None:
        return declared
    text = f"{declared}, allowable {row_limit(row, mission)}{_confidence_of(row, mission)}"
    if binding := binding_words(row):
        text += f" (limited by the {binding})"
    return text if row.utilization is None else f"{text}, {percent(row.utilization)} of it used"


def _confidence_of(row: Row, mission: MissionFindings) -> str:
    """Confidence of the requirement that sets the allowable of a row, in brackets with a leading space.

    The text is empty if the requirement has no confidence.
    """
    key = row.metric if row.binding_requirement is None else row.binding_requirement
    asked = {requirement.key: confidence_asked(requirement) for requirement in mission.requirements}.get(key, "")
    return f" ({asked})" if asked else ""


def cause(row: Row) -> str:
    """Text with the reason for the status of a row, and with the notes of the row; empty if it has neither."""
    return "; ".join([row.reason, *row.notes] if row.reason else row.notes)


def finding(row: Row, mission: MissionFindings) -> str:
    """Sentence about a row: its id, its requirement id, and the texts that `measure` and `cause` return for it."""
    reason = cause(row)
    return f"{row.id}{own_id(row)}: {measure(row, mission)}{f'. {sentence(reason)}' if reason else ''}"


def counted(count: int, noun: str) -> str:
    """Write a count and its noun, such as `1 fault` or `2 faults`."""
    return f"{count} {noun}{'s' if count != 1 else ''}"


_LISTED_COUNT = 3  # waivers whose ids a sentence lists


def waiver_names(ids: Sequence[str]) -> str:
    """Text that names waivers, such as `waiver receiver.*`.

    It contains up to three waiver ids, spelled as in the file, and the number of further waivers.
    """
    return f"waiver{'s' if len(ids) > 1 else ''} {_listed_ids(ids)}"


def waived_count(count: int, ids: Sequence[str]) -> str:
    """Text with the number of waived items and the ids of their waivers: `12 waived (mission.location_error)`."""
    return f"{count} waived ({_listed_ids(ids)})" if ids else f"{count} waived"


def _listed_ids(ids: Sequence[str]) -> str:
    shown = [printable(waiver_id) for waiver_id in ids[:_LISTED_COUNT]]
    return ", ".join([*shown, f"{len(ids) - _LISTED_COUNT} more"] if len(ids) > _LISTED_COUNT else shown)


def dotted(path: KeyPath) -> str:
    """Write the path of a key in the syntax of the option `--set`."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).lstrip(".")


def sentence(text: str) -> str:
    """Capitalize the first letter of a sentence, unless the sentence begins with a row id or a file name."""
    first = text.partition(" ")[0].rstrip(",:;")
    return text[:1].upper() + text[1:] if first.replace("-", "").isalpha() else text


def dashed(text: str) -> str:
    """Return an en dash if the text is a hyphen, and the unchanged text otherwise.

    In pages, an en dash marks a missing value.
    """
    return "–" if text == "-" else text


_PHASE_UNIT = "deg"  # unit of a phase requirement that the file does not state
AS_DECLARED = "as declared"  # a level of 0 dB relative to the declared noise
_LEVEL_REQUIREMENTS = ("pslr", "islr")  # requirements in dB of the image


def is_noise_level(row: Row) -> bool:
    """Whether the values of a row are levels of a noise spectrum in dB relative to the declared spectrum."""
    return row.unit == "dB" and row.subject.axis == row.subject.facts.spectrum_axis


def row_size(value: float | None, row: Row, mission: MissionFindings, rounding: str = "nearest") -> str:
    """Write a value of a row in the unit that the file uses for this row. None is written as a hyphen.

    A value that is a sum of phases has the unit of its requirement. If the file gives no unit, an SI prefix that
    makes the value readable is chosen. Levels relative to the declared noise are written with a sign; 0 dB is written
    as `as declared`.
    """
    if value is None:
        return "-"
    if is_noise_level(row):
        level = _level(value, row.unit)
        sign = "+" if level > 0 else ""
        return f"{sign}{format_quantity(level, 'dB', 3, rounding)}" if level else AS_DECLARED
    unit = _file_unit(row.line, row.unit)
    kind = row.subject.facts
    if not unit and row.unit == "rad" and kind.is_phase:
        unit = phase_unit(mission)
    return format_in(_level(value, row.unit), row.unit, unit, 3, rounding)


def declared_size(row: Row, mission: MissionFindings) -> str:
    """Write the declared size of a row, and its bias with its sign if it has one: `5 mm/s, bias -2 mm/s`."""
    declared = row_size(row.declared, row, mission)
    return declared if row.bias is None else f"{declared}, bias {row_size(row.bias, row, mission)}"


def row_limit(row: Row, mission: MissionFindings) -> str:
    """Write the allowable of a row, rounded down so that the row passes if the written value is copied into a file.

    Image levels (rows of PSLR and ISLR) are rounded to nearest, because they are never copied into a file.
    """
    return row_size(row.allowable, row, mission, "nearest" if row.subject.facts.is_level else "down")


def allowable_words(row: Row, mission: MissionFindings) -> str:
    """Write the allowable of a row, or a placeholder for a row without an allowable.

    The placeholder is a hyphen for a row that is not judged, and for rows of PSLR, ISLR and required declarations.
    For all other rows it is `no limit`.
    """
    if row.allowable is not None:
        return row_limit(row, mission)
    is_open = row.status in ("not_evaluated", "info") or row.metric in ("pslr", "islr", DECLARE)
    return "-" if is_open else "no limit"


def shown_use(row: Row) -> float | None:
    """Utilization of a row for display.

    It is None if the row has no limit or cannot be judged. A waived row keeps its utilization.
    """
    return None if row.allowable is None or row.is_unjudged else row.utilization


def phase_unit(mission: MissionFindings) -> str:
    """Unit in which the file states the quadratic phase requirement; degrees if the file does not state it."""
    lines = (requirement.line for requirement in mission.requirements if requirement.key == "quadratic_phase_error")
    return _file_unit(next(lines, None), "rad") or _PHASE_UNIT


def phase_limit(value: float, mission: MissionFindings) -> str:
    """Write an allowed phase [rad] in the unit of the quadratic phase requirement, rounded down."""
    return format_in(value, "rad", phase_unit(mission), 3, "down")


def confidence_asked(requirement: JudgedRequirement) -> str:
    """Confidence with which the file asks for a limit, such as `95 %`; empty without one."""
    return "" if requirement.confidence is None else f"{100 * requirement.confidence:.8g} %"


def requirement_limit(value: float | None, requirement: JudgedRequirement) -> str:
    """Write the limit of a requirement, or of a share of it.

    Levels in dB are rounded to nearest; all further limits are rounded down.
    """
    return requirement_size(value, requirement, "nearest" if requirement.key in _LEVEL_REQUIREMENTS else "down")


def requirement_size(value: float | None, requirement: JudgedRequirement, rounding: str = "nearest") -> str:
    """Write a value of a requirement in the unit that the file uses for it. None is written as a hyphen."""
    if value is None:
        return "-"
    unit = _file_unit(requirement.line, requirement.unit) or (_PHASE_UNIT if requirement.unit == "rad" else "")
    return format_in(_level(value, requirement.unit), requirement.unit, unit, 3, rounding)


_LEAST_LEVEL_DB = 5e-4  # the level of an echo as strong as its point differs from 0 dB by rounding only


def _level(value: float, unit: str) -> float:
    """Replace a level in dB by 0 if it differs from 0 dB only by rounding. Any other value is returned unchanged."""
    return 0.0 if unit == "dB" and abs(value) < _LEAST_LEVEL_DB else value


def _file_unit(line: int | None, unit: str) -> str:
    return given_unit(line.text, unit) if isinstance(line, Place) else ""


TEXT_WIDTH = 80


def wrapped(text: str, indent: str) -> list[str]:
    """Wrap text at spaces to 80 columns. Words that do not fit are not broken, so that paths can be copied."""
    lines = []
    while len(text) > TEXT_WIDTH:
        margin = len(text) - len(text.lstrip(" "))
        space = text.rfind(" ", margin, TEXT_WIDTH + 1)
        if space < 0:
            space = text.find(" ", max(margin, TEXT_WIDTH + 1))
        if space < 0:
            break
        lines.append(text[:space])
        text = indent + text[space + 1 :]
    return [*lines, text]


def wrapped_counts(text: str) -> list[str]:
    """Wrap a line such as `file: 1 FAIL, 2 pass` to 80 columns. Lines end only after a colon, comma or semicolon."""
    joined = text.replace(" ", "\u00a0").replace(",\u00a0", ", ").replace(":\u00a0", ": ").replace(";\u00a0", "; ")
    first, *continuation = (line.replace("\u00a0", " ") for line in wrapped(joined, "  "))
    return [
        first,
        *(wrapped_line for line in continuation for wrapped_line in wrapped(line, "    ")),
    ]  # the first line has the file, to be copied


def spaced(cells: Sequence[str], widths: Sequence[int], sides: str) -> str:
    """Write cells as one line of columns.

    `sides` has a character for each column: `<` aligns it left, and `>` aligns it right.
    """
    return " ".join(f"{cell:{side}{width}}" for cell, width, side in zip(cells, widths, sides, strict=True))


def table(rows: Sequence[Sequence[str]], width: int = TEXT_WIDTH) -> list[str]:
    """Write rows of cells as an aligned table at most `width` characters wide. The first row is the header."""
    return [line for lines in aligned(rows, width) for line in lines]


def aligned(rows: Sequence[Sequence[str]], width: int = TEXT_WIDTH) -> Iterator[list[str]]:
    """Yield the lines of each row of a table.

    The first and the last column are aligned left, all further columns right. A name that would make its line longer
    than `width` characters is written on a line above its values.
    """
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    room = width - sum(widths[1:]) - len(widths) + 1
    first = max(len(row[0]) for row in rows if len(row[0]) <= max(room, len(rows[0][0])))  # the header is not broken
    for name, *cells in rows:
        numbers = f"{spaced(cells[:-1], widths[1:-1], '>' * (len(cells) - 1))} {cells[-1]}".rstrip()
        yield [f"{name:<{first}} {numbers}"] if len(name) <= first else [name, f"{'':<{first}} {numbers}"]


_XML = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&apos;"}
_XML_SPECIAL = re.compile("[&<>\"']")
# Characters with a meaning in GitHub's Markdown or in HTML within it, only at positions with that meaning, because a
# report is also read as plain text. An underscore within a word means itself. Since brackets are escaped, the ( and !
# beside them need no escape.
_MARKDOWN_SPECIAL = re.compile(
    r"[\\`*\[\]<>|$~]"
    r"|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])"
    r"|&(?=#|\w+;)|@(?=\w)|#(?=\w)|:(?=//|(?:[\w+-]*[A-Z+-][\w+-]*|100|1234):)|(?<=www)\."
    r"|^[-+#=](?=[-+#= ]|$)|^ ",
    re.IGNORECASE | re.ASCII,
)
_MARKDOWN_NUMBER = re.compile(r"^(\d{1,9})([.)])(?=\s|$)", re.ASCII)  # of a list


def xml_text(text: str) -> str:
    """Escape text for XML elements and attributes. Characters that XML forbids are made printable."""
    text = printable(text)
    return _XML_SPECIAL.sub(lambda match: _XML[match[0]], text) if _XML_SPECIAL.search(text) else text


def _markdown_escape(match: re.Match[str]) -> str:
    """Escape the matched special character with a backslash, which is easy to read, or with a character reference."""
    special = match[0]
    return f"\\{special}" if special in r"\*_[]~" else f"&#{ord(special)};"


def markdown_text(text: str) -> str:
    """Escape text for Markdown, so that it is also safe in a table or at the start of a line."""
    escaped = _MARKDOWN_SPECIAL.sub(_markdown_escape, printable(text))
    return _MARKDOWN_NUMBER.sub(lambda match: f"{match[1]}&#{ord(match[2])};", escaped)


def markdown_row(cells: Iterable[str]) -> str:
    """Write cells as a line of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def command_text(text: str) -> str:
    """Escape the message of a GitHub workflow command."""
    return printable(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def command_property(text: str) -> str:
    """Escape a property of a GitHub workflow command.

    Colons and commas are also escaped, because they would end the property; in a message they are not escaped.
    """
    return command_text(text).replace(":", "%3A").replace(",", "%2C")


def rst_text(text: str) -> str:
    """Escape all punctuation in a line of text for reStructuredText."""
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", printable(text))


def need_text(text: str) -> str:
    """Escape the text of a field for Sphinx-Needs.

    Otherwise Sphinx-Needs would run `[[function()]]` and look up `<<variant>>`.
    """
    return printable(text).replace("[[", "[ [").replace("<<", "< <")


def uri(path: str) -> str:
    """Percent-encode a path that has forward slashes. An absolute path becomes a `file` URI."""
    from urllib.parse import quote  # takes 2 ms to load; a check to a terminal does not need it

    encoded = quote(os.fsencode(path), safe="/")
    return f"file:///{encoded.lstrip('/')}" if os.path.isabs(path) else encoded


# Signs that begin a formula, and their full-width forms, which some programs take for them.
_FORMULA_SIGNS = "=+-@\uff1d\uff0b\uff0d\uff20"
_SIZE_PATTERN = re.compile(
    r"-|[+-]?\d+(\.\d+)?(e[+-]?\d+)?( [A-Za-z\u00b5\u00b0%/\u00b2\u00b3\u221a]+)?"
)  # never a formula


def spreadsheet_text(value: str | None) -> str | None:
    """Put an apostrophe before text that a spreadsheet would run as a formula.

    This includes formulas that follow leading blanks.
    """
    value = printable(value) if value else value
    is_formula = (
        bool(value)
        and (value or "").lstrip()[:1] in tuple(_FORMULA_SIGNS)
        and not _SIZE_PATTERN.fullmatch(value or "")
    )
    return f"'{value}" if is_formula else value
