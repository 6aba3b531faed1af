"""The report for a terminal: verdict, table of requirements, geometry, the rows that matter with the worst first."""

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from functools import cache

from bisar_budget.effects.declared import END_OF_IMAGE
from bisar_budget.faults import printable
from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.findings.row import Row, worst_first
from bisar_budget.findings.status import STATUS, worst
from bisar_budget.report import Piece, Style
from bisar_budget.report.formats.verification import evidence
from bisar_budget.report.words.heading import (
    document_words,
    doubtful_model,
    file_words,
    head,
    narrow_gradients,
    overrides_lines,
    overrides_words,
    rule_words,
)
from bisar_budget.report.words.requirements import (
    COLUMNS,
    RequirementLine,
    declared_words,
    is_said_with_the_table,
    probabilities,
    requirement_lines,
    unjudged_effects,
    verdict,
)
from bisar_budget.report.words.sentences import (
    WIDTH,
    aligned,
    allowable_words,
    binding_words,
    counted,
    matters,
    own_id,
    row_size,
    shown_use,
    spaced,
    use_words,
    wrapped,
    wrapped_counts,
)
from bisar_budget.units import format_quantity

LINES = 45  # of a report, where its rows can be fewer
_FEWEST = 3  # rows, however long the rest is


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write the part of one mission, at most 80 columns where the file's own names allow it."""
    return "\n".join(_unusable(mission, style) if isinstance(mission, UnusableMission) else _mission(mission, style))


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write the report for reading."""
    text = ("\n" if style.verbosity < 0 else "\n\n").join(piece.text for piece in pieces)
    if len(pieces) > 1:
        text += "\n\n" + _overall([piece.status for piece in pieces], style)
    return text + "\n"


def _unusable(mission: UnusableMission, style: Style) -> list[str]:
    faults = counted(len(mission.faults), "fault")
    summary = f"{STATUS['error'].text} {printable(mission.file)}: cannot be used, {faults}"
    if style.verbosity < 0:
        return [_lead(summary, "error", style)]
    places = [f"  {fault.line or '-'}:{fault.column or '-'}  {fault}" for fault in mission.faults]
    first, *rest = wrapped_counts(summary)
    return [_lead(first, "error", style), *rest, *(line for place in places for line in wrapped(place, "       "))]


def _mission(mission: MissionFindings, style: Style) -> list[str]:
    if style.verbosity < 0:
        count = sum(not warning.is_of_options for warning in mission.warnings)
        said = [_summary(mission, is_brief=True), *_alone(mission)]
        said += [f"{counted(count, 'warning')} about the file"] if count else []
        if outside := overrides_words(mission, with_changes=False):
            said.append(f"overrides: {outside}")
        return [_lead("; ".join(said), mission.status, style)]
    lines = _verdict(mission, style)
    lines += ["", *_requirements(mission, style)]
    lines += [
        "",
        *(line for key, text in _head(mission, style) for line in wrapped(f"{key:<12} {text}", " " * 13)),
        "",
    ]
    after = list(_after(mission, style))
    room = max(LINES - len(lines) - len(after), 0)
    return [*lines, *_table(mission, style, room), *after]


def _alone(mission: MissionFindings) -> list[str]:
    return ["each error alone"] if mission.combine == "each" else []


def _verdict(mission: MissionFindings, style: Style) -> list[str]:
    """Whether it is met and was looked at, what was judged, and what from outside the file bears on it."""
    said = _summary(mission)
    first, *rest = wrapped(said, "  ") if mission.changes else wrapped_counts(said)
    document = ", ".join(filter(None, (document_words(mission.document), mission.document.author)))
    name = f"{mission.name} ({document})" if document else mission.name
    lines = [_lead(first, mission.status, style), *rest, *wrapped(f"{name}; {rule_words(mission)}", "  ")]
    lines += overrides_lines(mission)
    if sentence := doubtful_model(mission):
        lines += wrapped(sentence, "  ")
    if sentence := narrow_gradients(mission.geometry):
        lines += wrapped(sentence, "  ")
    return lines


def requirement_table(mission: MissionFindings, style: Style) -> Iterator[str]:
    """The table of requirements."""
    found = list(requirement_lines(mission))
    cells = [COLUMNS[:4], *((one.name, one.allowed, one.reached, one.use) for one in found)]
    widths = [max(len(line[column]) for line in cells) for column in range(4)]
    yield spaced(COLUMNS, [*widths, _STATUS, 0], "<>>><<")
    for one in found:
        yield from _requirement(one, widths, style)


def _requirements(mission: MissionFindings, style: Style) -> Iterator[str]:
    """The table of requirements, effects that none takes, and how much is declared."""
    yield from requirement_table(mission, style)
    for effect in unjudged_effects(mission):
        rows = ", ".join(row.id if row.line is None else f"{row.id} of line {row.line}" for row in effect.rows)
        yield from wrapped(f"Not judged: {effect.text} ({rows}).", "  ")
    yield from wrapped(declared_words(mission.kinds), "  ")


def _requirement(one: RequirementLine, widths: Sequence[int], style: Style) -> Iterator[str]:
    """One line; what decides stands below it where it is too long."""
    start = spaced((one.name, one.allowed, one.reached, one.use), widths, "<>>>")
    decided = ", ".join(filter(None, (one.decided_by, one.remark)))
    if len(start) + 10 + len(decided) <= WIDTH:
        yield f"{start} {_word(one.status, style, _STATUS)} {decided}"
    else:
        yield f"{start} {_word(one.status, style)}"
        yield from wrapped(f"    {decided}", "    ")


def _head(mission: MissionFindings, style: Style) -> Iterator[tuple[str, str]]:
    """The collection, and with -v how many rows stand how; the model is said with the name."""
    yield from ((key, text) for key, text in head(mission) if key != "Model")
    if style.verbosity > 0:
        yield "Rows", ", ".join(f"{count} {STATUS[status].text}" for status, count in mission.summary.items())


def _after(mission: MissionFindings, style: Style) -> Iterator[str]:
    """Lines below the rows: what decides them, warnings, draws and images."""
    if details := list(_details(mission, style)):
        yield from ("", *details)
    yield from (line for text in _asides(mission, style) for line in wrapped(text, "  "))
    if mission.monte_carlo is not None:
        yield from ("", *probabilities(mission.monte_carlo))
    if mission.verdicts is not None:
        yield from ("", "Images with each error at its limit", "", *evidence(mission.verdicts, style))


_STATUS = 8  # columns of a status, the same in every table: the eye and scripts look there
_HEADER = (f"{'status':<{_STATUS}} row", "declared", "allowable", "use", "by")


def _table(mission: MissionFindings, style: Style, room: int) -> Iterator[str]:
    """Rows that are declared or limit something, the worst first, and how many others there are.

    Of those that pass, no more than there is room for on a screen.
    """
    rows, hidden = worst_first(mission.rows), list[Row]()
    # Where nothing is declared the allowables are the answer.
    is_short = not style.all_rows and style.verbosity <= 0
    if is_short and not mission.is_empty:
        hidden = [row for row in rows if not matters(row)]
        rows = [row for row in rows if matters(row)]
    passing = [row for row in rows if STATUS[row.status].is_met or row.status == "info"]
    passing.sort(key=lambda row: -(row.utilization or 0.0))
    cells = {row.id: _row(row, mission) for row in rows}

    @cache
    def lines_without(count: int) -> list[str]:
        """The table without so many of the rows that pass, those that use least."""
        left_out = passing[len(passing) - count :]
        ids = {row.id for row in left_out}
        shown = [row for row in rows if row.id not in ids]
        key = wrapped(_table_key(shown, [*left_out, *hidden]), "  ")
        return [*_lines(shown, [cells[row.id] for row in shown], style), *key]

    most = min(len(passing), max(len(rows) - _FEWEST, 0)) if is_short and not mission.is_empty else 0
    fewest = bisect_left(range(most), True, key=lambda count: len(lines_without(count)) <= room)
    yield from lines_without(fewest)


def _lines(rows: Sequence[Row], cells: Sequence[Sequence[str]], style: Style) -> Iterator[str]:
    head, *found = aligned([_HEADER, *cells])
    yield from head
    for row, (first, *rest) in zip(rows, found, strict=True):
        yield _word(row.status, style, _STATUS) + first[_STATUS:]
        yield from rest
        if row.requirement_id and (not STATUS[row.status].is_explained and style.verbosity < 1):
            yield f"{'':<{_STATUS}} [{row.requirement_id}]"  # the others have it with their reason


def _table_key(rows: Sequence[Row], hidden: Sequence[Row]) -> str:
    """Say what the columns are, and what is not in the table."""
    key = "use: declared / allowable"
    if any(row.binding_requirement not in (None, "quadratic_phase_error") for row in rows):
        key += "; by: what sets the allowable; a table, an equation or a model stands for QPE"
    left = [row for row in hidden if row.status != "not_declared"]
    counts = [
        (len(hidden) - len(left), "not declared", "not declared"),
        (sum(not matters(row) for row in left), "that limits nothing", "that limit nothing"),
        (sum(matters(row) for row in left), "that uses less", "that use less"),
    ]
    others = ", ".join(f"{count} {one if count == 1 else many}" for count, one, many in counts if count)
    return f"{key}. Not shown (--all): {others}." if others else f"{key}."


def _row(row: Row, mission: MissionFindings) -> tuple[str, ...]:
    name, size = f"{STATUS[row.status].text:<{_STATUS}} {row.id}", row_size(row.declared, row, mission)
    return name, size, allowable_words(row, mission), use_words(shown_use(row)), _limited_by(row)


def _limited_by(row: Row) -> str:
    """The source of the allowable: another requirement than the row's own, else the place of its equation."""
    binding = binding_words(row)
    if binding:
        return binding if row.binding_requirement == END_OF_IMAGE else binding.split()[0]
    return _short_reference(row.equation)


@cache
def _short_reference(equation: str) -> str:
    """Shorten `Table II row 4` to `II.4`, `Section V, …` to `V`, the full model's to `full`; others to nothing."""
    if equation in ("full model", "first principles"):
        return "full"
    match = re.match(r"Table (I+)(?: rows? ([\d-]+))?|Section (V?I*)|(\(\d+\))", equation)
    if match is None:
        return ""
    table, row, section, number = match.groups()
    return f"{table}.{row}" if row and row.isdigit() else table or section or number


def _details(mission: MissionFindings, style: Style) -> Iterator[str]:
    """Reasons of the rows that do not simply pass, once for all that share them; with -v all about every row."""
    groups: dict[tuple[str, tuple[str, ...]], list[Row]] = {}
    for row in worst_first(mission.rows):
        if style.verbosity > 0:
            yield from _detail([row], [*filter(None, [row.reason]), *row.notes, *_more(row)], mission, style)
        elif STATUS[row.status].is_explained and not is_said_with_the_table(row):
            groups.setdefault((row.status, row.decisive), []).append(row)
    for (_, texts), rows in groups.items():
        yield from _detail(rows, texts, mission, style)


def _detail(rows: Sequence[Row], texts: Sequence[str], mission: MissionFindings, style: Style) -> Iterator[str]:
    file = printable(mission.file)
    names = []
    for row in rows:
        place = f"{file}:{row.line}" if row.line is not None else file
        names.append(f"{row.id}{own_id(row)} ({place})")
    first, *rest = wrapped(f"{STATUS[rows[0].status].text} {', '.join(names)}", "  ")
    yield _lead(first, rows[0].status, style)
    yield from rest
    for text in texts:
        yield from wrapped(f"  {text}", "  ")


def _more(row: Row) -> Iterator[str]:
    yield f"from {row.equation}"
    if row.displacement_m is not None:
        x, y = row.displacement_m
        yield f"moves the image by {format_quantity(x, 'm')} east, {format_quantity(y, 'm')} north"
    if row.evidence:
        yield f"evidence: {row.evidence}"


def _asides(mission: MissionFindings, style: Style) -> Iterator[str]:
    for warning in mission.warnings:
        if warning.is_of_options:
            continue  # the first line says it
        place = f"{printable(mission.file)}:{warning.line}: " if warning.line is not None else ""
        yield f"warning: {place}{printable(warning.message)}"
    if style.verbosity > 0:
        yield from (f"note: {note}" for note in mission.notes)


def _summary(mission: MissionFindings, *, is_brief: bool = False) -> str:
    return f"{STATUS[mission.status].text} {file_words(mission)}: {verdict(mission, is_brief=is_brief)}"


def _overall(statuses: Sequence[str], style: Style) -> str:
    counts = ", ".join(f"{statuses.count(status)} {STATUS[status].text}" for status in STATUS if status in statuses)
    return f"{_word(worst(statuses), style)} {len(statuses)} missions: {counts}"


def _lead(line: str, status: str, style: Style) -> str:
    """Colour the status that a line begins with."""
    return _word(status, style) + line.removeprefix(STATUS[status].text)


def _word(status: str, style: Style, width: int = 0) -> str:
    return style.coloured(f"{STATUS[status].text:<{width}}", STATUS[status].sgr)
