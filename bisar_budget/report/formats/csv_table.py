"""Write requirements and rows as CSV for a spreadsheet, in SI units: a header, and a line for each item.

The column `kind` states whether a line is a requirement or a row. The line of a requirement has an id such as
`requirement.islr`. Its column `declared` has the reached value, `allowable` the required value, and `decided_by` the
id of the deciding row. If the share of a platform or of the clock decides the status, the utilization refers to this
share. The columns `share_allowed` and `share_reached` then have its allowed and its reached value.

The column `confidence_required` has the confidence that the file states for a requirement, and `probability` the
share of collections that keep the limit. `percentile_50` is the size that the effect of all errors does not exceed
with a probability of 50 %.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from operator import attrgetter

from bisar_budget.faults import changes_words
from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.report import Piece, Style
from bisar_budget.report.words.heading import overrides_words
from bisar_budget.report.words.percentiles import PERCENTILE_COLUMNS, percentile_columns
from bisar_budget.report.words.requirements import requirement_id, share_columns, use_remarks
from bisar_budget.report.words.sentences import spreadsheet_text

CSV_COLUMNS = (
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
    "kind",
    "decided_by",
    "overrides",
    "waived_by",
    "share_owner",
    "share_allowed",
    "share_reached",
    "autofocus_gain",
    "confidence",
    "equal_loss_qpe_rad",
    "rest_rad",
    "bias",
    *PERCENTILE_COLUMNS,
)


# Columns that are fields of a row. Columns with text of the user are written apart.
_ROW_COLUMNS = tuple(column for column in CSV_COLUMNS if column in Row._fields and column != "evidence")
_values_of = attrgetter(*_ROW_COLUMNS)


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write a line for each requirement and row of a mission, or for each fault of an unusable file."""
    return csv_text(lines_of(mission))


def lines_of(mission: MissionFindings | UnusableMission) -> Iterator[list[object]]:
    """Yield the cells of each line about a mission, in the order of `CSV_COLUMNS`."""
    return _faults(mission) if isinstance(mission, UnusableMission) else _rows(mission)


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Join the lines of all missions below a header."""
    return csv_text([CSV_COLUMNS]) + "".join(piece.text for piece in pieces)


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Write rows of values as lines of CSV.

    None becomes an empty cell. Numbers are written with all digits that are needed to reproduce them exactly. An
    apostrophe is put before text that a spreadsheet would execute as a formula.
    """
    output = io.StringIO()
    harmless = ([spreadsheet_text(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    csv.writer(output, lineterminator="\n").writerows(harmless)
    return output.getvalue()


def _faults(mission: UnusableMission) -> Iterator[list[object]]:
    for fault in mission.faults:
        cells: dict[str, object] = {
            "file": mission.file,
            "id": fault.key,
            "status": mission.status,
            "line": fault.line,
            "kind": "fault",
            "reason": str(fault),
        }
        yield [cells.get(column) for column in CSV_COLUMNS]


def _rows(mission: MissionFindings) -> Iterator[list[object]]:
    file, name = mission.file, mission.name
    changed = changes_words(mission.changes) or None
    outside = overrides_words(mission) or None
    mission_cells = {
        "file": file,
        "mission": name,
        "set": changed,
        "overrides": outside,
        "confidence": None if mission.is_empty else mission.confidence,
    }
    for requirement in mission.requirements:
        cells = mission_cells | _requirement(requirement)
        yield [cells.get(column) for column in CSV_COLUMNS]
    verdicts = {verdict.id: verdict.verdict for verdict in mission.verdicts or ()}
    for row in mission.rows:
        x, y = row.displacement_m or (None, None)
        cells = dict(zip(_ROW_COLUMNS, _values_of(row), strict=True)) | {
            "file": file,
            "mission": name,
            "id": row.id,
            "displacement_x_m": x,
            "displacement_y_m": y,
            "requirement_id": row.requirement_id,
            "notes": "; ".join(row.notes),
            "evidence": row.evidence,
            "verdict": verdicts.get(row.id),
            "set": changed,
            "kind": "row",
            "overrides": outside,
            "waived_by": _waived_by(row),
        }
        yield [cells.get(column) for column in CSV_COLUMNS]


def _requirement(requirement: JudgedRequirement) -> dict[str, object]:
    return {
        "id": requirement_id(requirement),
        "status": requirement.status,
        "metric": requirement.key,
        "unit": requirement.unit,
        "declared": requirement.reached,
        "allowable": requirement.allowed,
        "utilization": requirement.utilization,
        "line": requirement.line,
        "requirement_id": requirement.requirement_id,
        "reason": requirement.reason,
        "notes": "; ".join([*use_remarks(requirement), *(waiver.words for waiver in requirement.waivers)]),
        "kind": "requirement",
        "decided_by": requirement.row,
        **share_columns(requirement),
        **percentile_columns(requirement),
        "waived_by": _waived_by(requirement),
    }


def _waived_by(judged: Row | JudgedRequirement) -> str | None:
    """Ids of the waivers in force for a row or requirement, spelled as in the file; None without a waiver."""
    return "; ".join(waiver.id for waiver in judged.waived_by) or None
