"""The text of a check for a terminal: verdict, table of requirements, geometry, and rows that matter, worst first."""

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
from bisar_budget.report import document as doc
from bisar_budget.report.answers.shared_blocks import percentile_blocks, requirement_table
from bisar_budget.report.answers.verify_answer import evidence
from bisar_budget.report.renderers.text import lines
from bisar_budget.report.words.heading import (
    document_words,
    doubtful_model,
    file_words,
    head,
    narrow_gradients,
    other_overrides,
    overrides_words,
    rule_words,
)
from bisar_budget.report.words.requirements import (
    declared_words,
    is_explained_in_table,
    probabilities,
    unjudged_effects,
    verdict,
)
from bisar_budget.report.words.sentences import (
    allowable_words,
    binding_words,
    counted,
    declared_size,
    matters,
    own_id,
    row_size,
    shown_use,
    use_words,
)
from bisar_budget.report.words.wrong_verdicts import guard_sentences
from bisar_budget.units import format_quantity

_PAGE_LINES = 45  # length of a report whose passing rows can be left out
_MIN_LISTED_ROWS = 3  # also in a report that is longer than a page
_COUNT_BREAKS = ",:;"  # a line such as `file: 1 FAIL, 2 pass` is broken after these


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write the report of one mission."""
    return "\n".join(lines(text_blocks(mission, style), style))


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write the reports of all missions, followed by the overall status if there are several missions."""
    text = ("\n" if style.verbosity < 0 else "\n\n").join(piece.text for piece in pieces)
    if len(pieces) > 1:
        statuses = [piece.status for piece in pieces]
        counts = (f"{statuses.count(status)} {STATUS[status].text}" for status in STATUS if status in statuses)
        overall = doc.Lead(worst(statuses), f"{len(pieces)} missions: {', '.join(counts)}", "")
        text += "\n\n" + "\n".join(lines([overall], style))
    return text + "\n"


def text_blocks(mission: MissionFindings | UnusableMission, style: Style) -> list[doc.Block]:
    """Text about one mission. It is at most 80 columns wide, unless the file has long names."""
    if isinstance(mission, UnusableMission):
        return [_unusable(mission, style)]
    if style.verbosity < 0:
        return [_brief(mission)]
    above: list[doc.Block] = [_opening(mission), _requirements(mission)]
    if style.verbosity > 0:
        above += percentile_blocks(mission)
    above.append(doc.Facts([*_head(mission, style)]))
    details, asides = list(_details(mission, style)), doc.Items([[text] for text in _asides(mission, style)])
    below = list(_evidence(mission))

    def blocks_with(rows: doc.Block) -> list[doc.Block]:
        if details:
            return [*above, rows, doc.Close([*details, asides]), *below]
        return [*above, doc.Close([rows, asides]), *below]

    other_lines = _line_count(blocks_with(doc.Paragraph("rows")), style) - 1
    return blocks_with(_rows(mission, style, max(_PAGE_LINES - other_lines, 0)))


def _line_count(blocks: Sequence[doc.Block], style: Style) -> int:
    return sum(1 for _ in lines(blocks, style))


def _unusable(mission: UnusableMission, style: Style) -> doc.Block:
    lead = doc.Lead(
        "error", f"{printable(mission.file)}: cannot be used, {counted(len(mission.faults), 'fault')}", _COUNT_BREAKS
    )
    faults = [f"  {fault.line or '-'}:{fault.column or '-'}  {fault}" for fault in mission.faults]
    return doc.Close([lead] if style.verbosity < 0 else [lead, doc.Items([[fault] for fault in faults])])


def _brief(mission: MissionFindings) -> doc.Block:
    count = sum(not warning.is_of_options for warning in mission.warnings)
    texts = [f"{file_words(mission)}: {verdict(mission, is_brief=True)}"]
    texts += ["each error alone"] if mission.combine == "each" else []
    texts += [f"{counted(count, 'warning')} about the file"] if count else []
    if outside := overrides_words(mission, with_changes=False):
        texts.append(f"overrides: {outside}")
    return doc.Lead(mission.status, "; ".join(texts), "")


def _opening(mission: MissionFindings) -> doc.Block:
    """The verdict, and below it the mission name, document, model, rule of combination, overrides and warnings."""
    document = ", ".join(filter(None, (document_words(mission.document), mission.document.author)))
    name = f"{mission.name} ({document})" if document else mission.name
    remarks = filter(None, (doubtful_model(mission), narrow_gradients(mission.geometry)))
    return doc.Close(
        [
            doc.Lead(
                mission.status,
                f"{file_words(mission)}: {verdict(mission)}",
                " " if mission.changes else _COUNT_BREAKS,
            ),
            doc.Items([[f"{name}; {rule_words(mission)}"]]),
            doc.Overrides(other_overrides(mission)),
            doc.Items([[text] for text in remarks]),
        ]
    )


def _requirements(mission: MissionFindings) -> doc.Block:
    """The table of requirements, and sentences below it.

    They give the probabilities that verdicts are wrong, the effects that no requirement judges, and the number of
    declared errors.
    """
    texts = []
    for effect in unjudged_effects(mission):
        rows = ", ".join(row.id if row.line is None else f"{row.id} of line {row.line}" for row in effect.rows)
        texts.append(f"Not judged: {effect.text} ({rows}).")
    guarded = () if mission.guard is None else guard_sentences(mission.guard)
    items = doc.Items([[text] for text in (*guarded, *texts, declared_words(mission.kinds))])
    return doc.Close([requirement_table(mission, has_texts=True), items])


def _head(mission: MissionFindings, style: Style) -> Iterator[tuple[str, str]]:
    """Yield the name and text of each line about the collection geometry.

    With the option `-v`, an additional line gives the number of rows with each status. There is no line about the
    model, because the model is written after the name of the mission.
    """
    yield from ((key, text) for key, text in head(mission) if key != "Model")
    if style.verbosity > 0:
        yield "Rows", ", ".join(f"{count} {STATUS[status].text}" for status, count in mission.summary.items())


def _evidence(mission: MissionFindings) -> Iterator[doc.Block]:
    """Yield the results of the Monte Carlo draws and of the simulated images, if there are any."""
    if mission.monte_carlo is not None:
        yield doc.Items([[line] for line in probabilities(mission.monte_carlo)])
    if mission.verdicts is not None:
        yield doc.Paragraph("Images with each error at its limit")
        yield from evidence(mission.verdicts)


# ---------------------------------------------------------------------- rows
def _rows(mission: MissionFindings, style: Style, room: int) -> doc.Block:
    """The table of rows with a declared error or a checked limit, worst first, and the number of hidden rows.

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
    cells = {row.id: _cells(row, mission) for row in rows}

    @cache
    def without(count: int) -> doc.Block:
        """The table without the `count` passing rows that have the smallest utilization."""
        left_out = passing[len(passing) - count :]
        ids = {row.id for row in left_out}
        shown = [row for row in rows if row.id not in ids]
        key = doc.Items([[_table_key(shown, [*left_out, *hidden])]])
        return doc.Close([_row_table(shown, [cells[row.id] for row in shown], style), key])

    max_hidden = min(len(passing), max(len(rows) - _MIN_LISTED_ROWS, 0)) if is_short and not mission.is_empty else 0
    if _line_count([without(0)], style) <= room:  # usual, and a search would write the table several times
        return without(0)
    counts = range(max_hidden)
    return without(bisect_left(counts, True, key=lambda count: _line_count([without(count)], style) <= room))


def _cells(row: Row, mission: MissionFindings) -> doc.Line:
    size, use = row_size(row.declared, row, mission), use_words(shown_use(row))
    return doc.Badge(row.status), row.id, size, allowable_words(row, mission), use, _limited_by(row)


def _row_table(rows: Sequence[Row], cells: Sequence[doc.Line], style: Style) -> doc.TextTable:
    heads = doc.heads("status", "row", *doc.numbers("declared", "allowable", "use"), "by")
    # Other rows show the id of the project with their reason.
    bare = [not STATUS[row.status].is_explained and style.verbosity < 1 for row in rows]
    below = [
        [f"[{row.requirement_id}]"] if row.requirement_id and is_bare else []
        for row, is_bare in zip(rows, bare, strict=True)
    ]
    return doc.TextTable("Rows", "Rows, worst first", heads, cells, below=below)


def _table_key(rows: Sequence[Row], hidden: Sequence[Row]) -> str:
    """Text below the table of rows: an explanation of its columns, and the number of hidden rows."""
    key = "use: declared / allowable"
    if any(row.bias is not None for row in rows):
        key += ", with a bias judged size / size at the limit"
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


def _limited_by(row: Row) -> str:
    """Short text for the table column that shows how a row is limited.

    The text names the requirement that sets the allowable. If this requirement limits the metric of the row itself,
    the text names the equation of the limit instead.
    """
    binding = binding_words(row)
    if binding:
        return binding if row.binding_requirement == END_OF_IMAGE else binding.split()[0]
    return _short_reference(row.equation)


@cache
def _short_reference(equation: str) -> str:
    """Short name of an equation of Rigling & Moses for a table column.

    `Table II row 4` becomes `II.4`, `Section V, …` becomes `V`, and `(25)` is not changed. `full model` and `first
    principles` become `full`. The result is empty for any other equation.
    """
    if equation in ("full model", "first principles"):
        return "full"
    match = re.match(r"Table (I+)(?: rows? ([\d-]+))?|Section (V?I*)|(\(\d+\))", equation)
    if match is None:
        return ""
    table, row, section, number = match.groups()
    return f"{table}.{row}" if row and row.isdigit() else table or section or number


def _details(mission: MissionFindings, style: Style) -> Iterator[doc.Block]:
    """Yield paragraphs with the reasons for the status of rows. Rows with the same reasons share a paragraph.

    With the option `-v`, each row has its own paragraph with its reason, notes and source.
    """
    groups: dict[tuple[str, tuple[str, ...]], list[Row]] = {}
    for row in worst_first(mission.rows):
        if style.verbosity > 0:
            yield from _detail([row], [*filter(None, [row.reason]), *row.notes, *_more(row, mission)], mission)
        elif STATUS[row.status].is_explained and not is_explained_in_table(row):
            groups.setdefault((row.status, row.decisive), []).append(row)
    for (_, texts), rows in groups.items():
        yield from _detail(rows, texts, mission)


def _detail(rows: Sequence[Row], texts: Sequence[str], mission: MissionFindings) -> Iterator[doc.Block]:
    file = printable(mission.file)
    names = []
    for row in rows:
        location = f"{file}:{row.line}" if row.line is not None else file
        names.append(f"{row.id}{own_id(row)} ({location})")
    yield doc.Lead(rows[0].status, ", ".join(names))
    yield doc.Items([[f"  {text}"] for text in texts])


def _more(row: Row, mission: MissionFindings) -> Iterator[str]:
    yield f"from {row.equation}"
    if row.bias is not None:
        yield f"declared {declared_size(row, mission)}"
    if row.displacement_m is not None:
        x, y = row.displacement_m
        yield f"moves the image by {format_quantity(x, 'm')} east, {format_quantity(y, 'm')} north"
    if row.evidence:
        yield f"evidence: {row.evidence}"


def _asides(mission: MissionFindings, style: Style) -> Iterator[str]:
    """Yield the warnings about the file, and with -v the notes."""
    for warning in mission.warnings:
        if warning.is_of_options:
            continue  # the first line of the report names options
        location = f"{printable(mission.file)}:{warning.line}: " if warning.line is not None else ""
        yield f"warning: {location}{printable(warning.message)}"
    if style.verbosity > 0:
        yield from (f"note: {note}" for note in mission.notes)
