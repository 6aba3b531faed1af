"""The rows as CSV for a spreadsheet: SI values, one line per row and file, a header."""

import csv
import io
from collections.abc import Iterator

from bisar_budget.budget.findings import MissionFindings, Report, Row, UnusableMission
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
)

_ROW_COLUMNS = frozenset(COLUMNS) & frozenset(Row._fields)


def render(report: Report, style: Style) -> str:
    """Write every row of every mission; an unusable file gives one line per fault with the status `error`."""
    output = io.StringIO()
    writer = csv.DictWriter(output, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    for mission in report.missions:
        records = _faults(mission) if isinstance(mission, UnusableMission) else _rows(mission)
        for record in records:
            writer.writerow({key: _cell(value) for key, value in record.items()})
    return output.getvalue()


def _faults(mission: UnusableMission) -> Iterator[dict[str, object]]:
    for fault in mission.faults:
        yield {
            "file": mission.file,
            "id": fault.key,
            "status": mission.status,
            "line": fault.line,
            "reason": str(fault),
        }


def _rows(mission: MissionFindings) -> Iterator[dict[str, object]]:
    for row in mission.rows:
        record: dict[str, object] = {"file": mission.file, "mission": mission.name}
        record |= {key: value for key, value in row._asdict().items() if key in _ROW_COLUMNS}
        record["notes"] = "; ".join(row.notes)
        if row.displacement_m is not None:
            record["displacement_x_m"], record["displacement_y_m"] = row.displacement_m
        yield record


def _cell(value: object) -> object:
    # A spreadsheet runs text that starts like a formula; an apostrophe makes it text again.
    if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r"):
        return f"'{value}"
    return value
