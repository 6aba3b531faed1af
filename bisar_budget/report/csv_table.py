"""The rows as CSV for a spreadsheet: SI values, one line per row and file, a header."""

import csv
import io
from collections.abc import Iterator

from bisar_budget.budget.findings import MissionFindings, Report, UnusableMission
from bisar_budget.errors import printable
from bisar_budget.report import Style

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
)


def render(report: Report, style: Style) -> str:
    """Write every row of every mission; an unusable file gives one line per fault with the status `error`."""
    output = io.StringIO()
    writer = csv.writer(output, lineterminator="\n")
    writer.writerow(COLUMNS)
    for mission in report.missions:
        writer.writerows(_faults(mission) if isinstance(mission, UnusableMission) else _rows(mission))
    return output.getvalue()


def _faults(mission: UnusableMission) -> Iterator[list[object]]:
    for fault in mission.faults:
        cells: dict[str, object] = {
            "file": _text(mission.file),
            "id": _text(fault.key),
            "status": mission.status,
            "line": fault.line,
            "reason": _text(str(fault)),
        }
        yield [cells.get(column) for column in COLUMNS]


def _rows(mission: MissionFindings) -> Iterator[list[object]]:
    file, name = _text(mission.file), _text(mission.name)
    verdicts = {verdict.id: verdict.verdict for verdict in mission.verdicts or ()}
    for row in mission.rows:
        x, y = row.displacement_m or (None, None)
        yield [
            file,
            name,
            _text(row.id),
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
            _text(row.requirement_id),
            row.reason,
            "; ".join(row.notes),
            _text(row.evidence),
            verdicts.get(row.id),
            row.qpe_exact_rad,
            row.published_margin_db,
        ]


def _text(value: str | None) -> str | None:
    """Keep text of the user's own from being run: a spreadsheet takes what starts like a formula for one."""
    value = printable(value) if value else value
    return f"'{value}" if value and value != "-" and value[0] in "=+-@" else value
