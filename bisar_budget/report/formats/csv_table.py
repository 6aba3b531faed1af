"""The table of requirements and the rows as CSV for a spreadsheet: SI values, a line for each, a header.

`kind` tells them apart. A requirement has the id `requirement.islr`, what the mission reaches under `declared`, what
the file requires under `allowable`, and the row that decides under `decided_by`. Where a share of it decides, the
utilization is that of the share, which has its own two numbers.
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
from bisar_budget.report.words.requirements import requirement_id, share_columns, use_remarks
from bisar_budget.report.words.sentences import spreadsheet_text

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
)


# Columns that are values of a row; text of the user's own is made harmless below.
_OF_ROW = tuple(
    column for column in COLUMNS if column in Row._fields and column not in ("requirement_id", "evidence")
)
_values_of = attrgetter(*_OF_ROW)


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write every requirement and row of a mission; of an unusable file a line per fault, with the status `error`."""
    return csv_text(_faults(mission) if isinstance(mission, UnusableMission) else _rows(mission))


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write them below their header."""
    return csv_text([COLUMNS]) + "".join(piece.text for piece in pieces)


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Write rows as lines of CSV; None is an empty cell, a number has all digits that it needs to be read back.

    Text that a spreadsheet would take for a formula is made harmless here, in every CSV.
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
        yield [cells.get(column) for column in COLUMNS]


def _rows(mission: MissionFindings) -> Iterator[list[object]]:
    file, name = mission.file, mission.name
    changed = changes_words(mission.changes) or None
    outside = overrides_words(mission) or None
    of_mission = {
        "file": file,
        "mission": name,
        "set": changed,
        "overrides": outside,
        "confidence": None if mission.is_empty else mission.confidence,
    }
    for one in mission.requirements:
        cells = of_mission | _requirement(one)
        yield [cells.get(column) for column in COLUMNS]
    verdicts = {verdict.id: verdict.verdict for verdict in mission.verdicts or ()}
    for row in mission.rows:
        x, y = row.displacement_m or (None, None)
        cells = dict(zip(_OF_ROW, _values_of(row), strict=True)) | {
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
        yield [cells.get(column) for column in COLUMNS]


def _requirement(one: JudgedRequirement) -> dict[str, object]:
    return {
        "id": requirement_id(one),
        "status": one.status,
        "metric": one.key,
        "unit": one.unit,
        "declared": one.reached,
        "allowable": one.allowed,
        "utilization": one.utilization,
        "line": one.line,
        "reason": one.reason,
        "notes": "; ".join([*use_remarks(one), *(waiver.words for waiver in one.waivers)]),
        "kind": "requirement",
        "decided_by": one.row,
        **share_columns(one),
        "waived_by": _waived_by(one),
    }


def _waived_by(one: Row | JudgedRequirement) -> str | None:
    """Ids of the waivers that hold, as the file writes them; None where nothing is waived."""
    return "; ".join(waiver.id for waiver in one.waived_by) or None
