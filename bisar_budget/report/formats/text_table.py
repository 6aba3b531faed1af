"""Write the report for a terminal: verdict, table of requirements, geometry, and rows that matter, worst first."""

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
from bisar_budget.report.answers.verify_answer import evidence
from bisar_budget.report.renderers.text import lines as text_lines
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
    REQUIREMENT_COLUMNS,
    RequirementLine,
    declared_words,
    is_explained_in_table,
    probabilities,
    requirement_lines,
    unjudged_effects,
    verdict,
)
from bisar_budget.report.words.sentences import (
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

_PAGE_LINES = 45  # length of a report whose passing rows can be left out
_MIN_LISTED_ROWS = 3  # also in a report that is longer than a page


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write the report of one mission in at most 80 columns, or more if the file has long names."""
    return "\n".join(_unusable(mission, style) if isinstance(mission, UnusableMission) else _mission(mission, style))


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write the reports of all missions, followed by the overall status if there are several missions."""
    text = ("\n" if style.verbosity < 0 else "\n\n").join(piece.text for piece in pieces)
    if len(pieces) > 1:
        text += "\n\n" + _overall([piece.status for piece in pieces], style)
    return text + "\n"


def _unusable(mission: UnusableMission, style: Style) -> list[str]:
    faults = counted(len(mission.faults), "fault")
    summary = f"{STATUS['error'].text} {printable(mission.file)}: cannot be used, {faults}"
    if style.verbosity < 0:
        return [_lead(summary, "error", style)]
    fault_lines = [f"  {fault.line or '-'}:{fault.column or '-'}  {fault}" for fault in mission.faults]
    first, *continuation = wrapped_counts(summary)
    return [
        _lead(first, "error", style),
        *continuation,
        *(line for fault_line in fault_lines for line in wrapped(fault_line, "       ")),
    ]


def _mission(mission: MissionFindings, style: Style) -> list[str]:
    if style.verbosity < 0:
        count = sum(not warning.is_of_options for warning in mission.warnings)
        summary = [_summary(mission, is_brief=True), *_alone(mission)]
        summary += [f"{counted(count, 'warning')} about the file"] if count else []
        if outside := overrides_words(mission, with_changes=False):
            summary.append(f"overrides: {outside}")
        return [_lead("; ".join(summary), mission.status, style)]
    lines = _verdict(mission, style)
    lines += ["", *_requirements(mission, style)]
    lines += [
        "",
        *(line for key, text in _head(mission, style) for line in wrapped(f"{key:<12} {text}", " " * 13)),
        "",
    ]
    after = list(_after(mission, style))
    room = max(_PAGE_LINES - len(lines) - len(after), 0)
    return [*lines, *_table(mission, style, room), *after]


def _alone(mission: MissionFindings) -> list[str]:
    return ["each error alone"] if mission.combine == "each" else []


def _verdict(mission: MissionFindings, style: Style) -> list[str]:
    """Lines above the tables: verdict, mission name and document, model, rule of combination, overrides, warnings."""
    summary = _summary(mission)
    first, *continuation = wrapped(summary, "  ") if mission.changes else wrapped_counts(summary)
    document = ", ".join(filter(None, (document_words(mission.document), mission.document.author)))
    name = f"{mission.name} ({document})" if document else mission.name
    lines = [_lead(first, mission.status, style), *continuation, *wrapped(f"{name}; {rule_words(mission)}", "  ")]
    lines += overrides_lines(mission)
    if sentence := doubtful_model(mission):
        lines += wrapped(sentence, "  ")
    if sentence := narrow_gradients(mission.geometry):
        lines += wrapped(sentence, "  ")
    return lines


def requirement_table(mission: MissionFindings, style: Style) -> Iterator[str]:
    """Yield the lines of the table of requirements."""
    requirement_rows = list(requirement_lines(mission))
    cells = [
        REQUIREMENT_COLUMNS[:4],
        *((line.name, line.allowed, line.reached, line.use) for line in requirement_rows),
    ]
    widths = [max(len(row_line[column]) for row_line in cells) for column in range(4)]
    yield spaced(REQUIREMENT_COLUMNS, [*widths, _STATUS_WIDTH, 0], "<>>><<")
    for line in requirement_rows:
        yield from _requirement(line, widths, style)


def _requirements(mission: MissionFindings, style: Style) -> Iterator[str]:
    """Yield the table of requirements, the effects that no requirement judges, and the number of declared errors."""
    yield from requirement_table(mission, style)
    for effect in unjudged_effects(mission):
        rows = ", ".join(row.id if row.line is None else f"{row.id} of line {row.line}" for row in effect.rows)
        yield from wrapped(f"Not judged: {effect.text} ({rows}).", "  ")
    yield from wrapped(declared_words(mission.kinds), "  ")


def _requirement(line: RequirementLine, widths: Sequence[int], style: Style) -> Iterator[str]:
    """Yield the lines for a requirement in the table, followed by its ids and texts in the project.

    A long id of the deciding row is put on the next line.
    """
    yield from _requirement_values(line, widths, style)
    for text in filter(None, (own_id(line.requirement).strip(), *line.texts)):
        yield from wrapped(f"    {text}", "    ")


def _requirement_values(line: RequirementLine, widths: Sequence[int], style: Style) -> Iterator[str]:
    start = spaced((line.name, line.allowed, line.reached, line.use), widths, "<>>>")
    decided = ", ".join(filter(None, (line.decided_by, line.remark)))
    if len(start) + 10 + len(decided) <= style.table_width:
        yield f"{start} {_word(line.status, style, _STATUS_WIDTH)} {decided}"
    else:
        yield f"{start} {_word(line.status, style)}"
        yield from wrapped(f"    {decided}", "    ")


def _head(mission: MissionFindings, style: Style) -> Iterator[tuple[str, str]]:
    """Yield the name and text of each line about the collection geometry.

    With -v, a further line gives the number of rows of each status. The line about the model is left out, because the
    model is written after the name of the mission.
    """
    yield from ((key, text) for key, text in head(mission) if key != "Model")
    if style.verbosity > 0:
        yield "Rows", ", ".join(f"{count} {STATUS[status].text}" for status, count in mission.summary.items())


def _after(mission: MissionFindings, style: Style) -> Iterator[str]:
    """Yield the lines below the rows: reasons, warnings, and the results of Monte Carlo and images."""
    if details := list(_details(mission, style)):
        yield from ("", *details)
    yield from (line for text in _asides(mission, style) for line in wrapped(text, "  "))
    if mission.monte_carlo is not None:
        yield from ("", *probabilities(mission.monte_carlo))
    if mission.verdicts is not None:
        yield from ("", "Images with each error at its limit", "", *text_lines(evidence(mission.verdicts), style))


_STATUS_WIDTH = 8  # columns of a status, the same in every table, for eyes and scripts
_TABLE_HEADER = (f"{'status':<{_STATUS_WIDTH}} row", "declared", "allowable", "use", "by")


def _table(mission: MissionFindings, style: Style, room: int) -> Iterator[str]:
    """Yield the table of rows that are declared or limit something, worst first, and the numbers of hidden rows.

    If the table has more than `room` lines, passing rows are hidden, beginning with the smallest utilization.
    """
    rows, hidden = worst_first(mission.rows), list[Row]()
    # A mission without declared errors shows all rows: the allowables are the answer.
    is_short = not style.all_rows and style.verbosity <= 0
    if is_short and not mission.is_empty:
        hidden = [row for row in rows if not matters(row)]
        rows = [row for row in rows if matters(row)]
    passing = [row for row in rows if STATUS[row.status].is_met or row.status == "info"]
    passing.sort(key=lambda row: -(row.utilization or 0.0))
    cells = {row.id: _row(row, mission) for row in rows}

    @cache
    def lines_without(count: int) -> list[str]:
        """Lines of the table without the `count` passing rows that have the smallest utilization."""
        left_out = passing[len(passing) - count :]
        ids = {row.id for row in left_out}
        shown = [row for row in rows if row.id not in ids]
        key = wrapped(_table_key(shown, [*left_out, *hidden]), "  ")
        return [*_lines(shown, [cells[row.id] for row in shown], style), *key]

    max_hidden = min(len(passing), max(len(rows) - _MIN_LISTED_ROWS, 0)) if is_short and not mission.is_empty else 0
    hidden_count = bisect_left(range(max_hidden), True, key=lambda count: len(lines_without(count)) <= room)
    yield from lines_without(hidden_count)


def _lines(rows: Sequence[Row], cells: Sequence[Sequence[str]], style: Style) -> Iterator[str]:
    head, *row_lines = aligned([_TABLE_HEADER, *cells], style.table_width)
    yield from head
    for row, (first, *continuation) in zip(rows, row_lines, strict=True):
        yield _word(row.status, style, _STATUS_WIDTH) + first[_STATUS_WIDTH:]
        yield from continuation
        if row.requirement_id and (not STATUS[row.status].is_explained and style.verbosity < 1):
            yield f"{'':<{_STATUS_WIDTH}} [{row.requirement_id}]"  # other rows show the id with their reason


def _table_key(rows: Sequence[Row], hidden: Sequence[Row]) -> str:
    """Text below the table of rows: an explanation of its columns, and the number of hidden rows."""
    key = "use: declared / allowable"
    if any(row.binding_requirement not in (None, "quadratic_phase_error") for row in rows):
        key += "; by: requirement that sets the allowable, or for QPE its table, equation or model"
    judged = [row for row in hidden if row.status != "not_declared"]
    counts = [
        (len(hidden) - len(judged), "not declared", "not declared"),
        (sum(not matters(row) for row in judged), "without effect", "without effect"),
        (sum(matters(row) for row in judged), "with less use", "with less use"),
    ]
    hidden_words = ", ".join(
        f"{count} {singular if count == 1 else plural}" for count, singular, plural in counts if count
    )
    return f"{key}. Not shown (--all): {hidden_words}." if hidden_words else f"{key}."


def _row(row: Row, mission: MissionFindings) -> tuple[str, ...]:
    name, size = f"{STATUS[row.status].text:<{_STATUS_WIDTH}} {row.id}", row_size(row.declared, row, mission)
    return name, size, allowable_words(row, mission), use_words(shown_use(row)), _limited_by(row)


def _limited_by(row: Row) -> str:
    """Short text for the table column that names the limit of each row.

    Usually this is the requirement that sets the allowable. If that requirement is on the row's own metric, it is the
    equation of the limit instead.
    """
    binding = binding_words(row)
    if binding:
        return binding if row.binding_requirement == END_OF_IMAGE else binding.split()[0]
    return _short_reference(row.equation)


@cache
def _short_reference(equation: str) -> str:
    """Short name of an equation for a table column.

    `Table II row 4` becomes `II.4`, `Section V, …` becomes `V`, and `(25)` is not changed. An equation of the full
    model becomes `full`. Other equations have an empty name.
    """
    if equation in ("full model", "first principles"):
        return "full"
    match = re.match(r"Table (I+)(?: rows? ([\d-]+))?|Section (V?I*)|(\(\d+\))", equation)
    if match is None:
        return ""
    table, row, section, number = match.groups()
    return f"{table}.{row}" if row and row.isdigit() else table or section or number


def _details(mission: MissionFindings, style: Style) -> Iterator[str]:
    """Yield paragraphs with the reasons for the status of rows. Rows with the same reasons share a paragraph.

    With -v every row has a paragraph with its reason, notes and source.
    """
    groups: dict[tuple[str, tuple[str, ...]], list[Row]] = {}
    for row in worst_first(mission.rows):
        if style.verbosity > 0:
            yield from _detail([row], [*filter(None, [row.reason]), *row.notes, *_more(row)], mission, style)
        elif STATUS[row.status].is_explained and not is_explained_in_table(row):
            groups.setdefault((row.status, row.decisive), []).append(row)
    for (_, texts), rows in groups.items():
        yield from _detail(rows, texts, mission, style)


def _detail(rows: Sequence[Row], texts: Sequence[str], mission: MissionFindings, style: Style) -> Iterator[str]:
    file = printable(mission.file)
    names = []
    for row in rows:
        location = f"{file}:{row.line}" if row.line is not None else file
        names.append(f"{row.id}{own_id(row)} ({location})")
    first, *continuation = wrapped(f"{STATUS[rows[0].status].text} {', '.join(names)}", "  ")
    yield _lead(first, rows[0].status, style)
    yield from continuation
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
            continue  # the first line of the report names options
        location = f"{printable(mission.file)}:{warning.line}: " if warning.line is not None else ""
        yield f"warning: {location}{printable(warning.message)}"
    if style.verbosity > 0:
        yield from (f"note: {note}" for note in mission.notes)


def _summary(mission: MissionFindings, *, is_brief: bool = False) -> str:
    return f"{STATUS[mission.status].text} {file_words(mission)}: {verdict(mission, is_brief=is_brief)}"


def _overall(statuses: Sequence[str], style: Style) -> str:
    counts = ", ".join(f"{statuses.count(status)} {STATUS[status].text}" for status in STATUS if status in statuses)
    return f"{_word(worst(statuses), style)} {len(statuses)} missions: {counts}"


def _lead(line: str, status: str, style: Style) -> str:
    """Colour the status at the start of a line."""
    return _word(status, style) + line.removeprefix(STATUS[status].text)


def _word(status: str, style: Style, width: int = 0) -> str:
    return style.coloured(f"{STATUS[status].text:<{width}}", STATUS[status].sgr)
