"""The rows as CSV for a spreadsheet: SI values, one line per row and file, a header."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence

from bisar_budget.faults import changes_words
from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.report import Piece, Style
from bisar_budget.report.words.escapes import spreadsheet_text

COLUMNS = (
    "file",
    "mission",
    "id",
    "status",
    "metric",
    "unit",
    "declared",
    "allowable",
    "utilization",
    "margin",
    "allowable_published",
    "allowable_full",
    "qpe_published_rad",
    "qpe_full_rad",
    "displacement_x_m",
    "displacement_y_m",
    "line",
    "equation",
    "requirement_id",
    "reason",
    "notes",
    "evidence",
    "verdict",
    "qpe_exact_rad",
    "published_margin_db",
    "binding_requirement",
    "cubic_rad",
    "islr_db",
    "set",
)


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write every row of a mission; an unusable file gives one line per fault with the status `error`."""
    return _written(_faults(mission) if isinstance(mission, UnusableMission) else _rows(mission))


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write them below their header."""
    return _written([COLUMNS]) + "".join(piece.text for piece in pieces)


def _written(rows: Iterable[Sequence[object]]) -> str:
    output = io.StringIO()
    csv.writer(output, lineterminator="\n").writerows(rows)
    return output.getvalue()


def _faults(mission: UnusableMission) -> Iterator[list[object]]:
    for fault in mission.faults:
        cells: dict[str, object] = {
            "file": spreadsheet_text(mission.file),
            "id": spreadsheet_text(fault.key),
            "status": mission.status,
            "line": fault.line,
            "reason": spreadsheet_text(str(fault)),
        }
        yield [cells.get(column) for column in COLUMNS]


def _rows(mission: MissionFindings) -> Iterator[list[object]]:
    file, name = spreadsheet_text(mission.file), spreadsheet_text(mission.name)
    changed = spreadsheet_text(changes_words(mission.changes)) or None
    verdicts = {verdict.id: verdict.verdict for verdict in mission.verdicts or ()}
    for row in mission.rows:
        x, y = row.displacement_m or (None, None)
        yield [
            file,
            name,
            spreadsheet_text(row.id),
            row.status,
            row.metric,
            row.unit,
            row.declared,
            row.allowable,
            row.utilization,
            row.margin,
            row.allowable_published,
            row.allowable_full,
            row.qpe_published_rad,
            row.qpe_full_rad,
            x,
            y,
            row.line,
            row.equation,
            spreadsheet_text(row.requirement_id),
            row.reason,
            "; ".join(row.notes),
            spreadsheet_text(row.evidence),
            verdicts.get(row.id),
            row.qpe_exact_rad,
            row.published_margin_db,
            row.binding_requirement,
            row.cubic_rad,
            row.islr_db,
            changed,
        ]
