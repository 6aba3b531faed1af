"""Verdicts of the images on the limits: text for reading, JSON `bisar-budget/verify/1`."""

import json
from collections.abc import Sequence

from bisar_budget.errors import printable
from bisar_budget.report import Style
from bisar_budget.simulate.verify import Verdict, VerifiedMission
from bisar_budget.units import format_quantity

FORMAT = "bisar-budget/verify/1"
_ANSI = {"optimistic": "1;31", "confirmed": "32", "conservative": "33", "not_evaluated": "35"}


def as_json(version: str, missions: Sequence[VerifiedMission]) -> str:
    """Write the contract; a number that is not finite is refused."""
    document = {
        "format": FORMAT,
        "version": version,
        "missions": [
            {
                "file": mission.file,
                "name": mission.name,
                "status": mission.status,
                "rows": [row._asdict() for row in mission.rows],
            }
            for mission in missions
        ],
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def as_text(missions: Sequence[VerifiedMission], style: Style) -> str:
    """Write a table per mission: the limit, its budget, what exact ranges predict and the image shows."""
    blocks = [_mission(mission, style) for mission in missions]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _mission(mission: VerifiedMission, style: Style) -> list[str]:
    lines = [mission.name, "", _cells("row", "limit", "budget", "exact", "image", "verdict")]
    for row in mission.rows:
        verdict = f"\x1b[{_ANSI[row.verdict]}m{row.verdict}\x1b[0m" if style.color else row.verdict
        lines.append(_cells(row.id, format_quantity(row.boundary_error, row.unit), *_numbers(row), verdict))
    reasons = [f"  {row.id}: {row.reason}" for row in mission.rows if row.reason]
    lines += ["", *reasons] if reasons else []
    found = [row.verdict for row in mission.rows]
    counts = ", ".join(f"{found.count(verdict)} {verdict}" for verdict in _ANSI if verdict in found)
    return [*lines, "", f"{printable(mission.file)}: {counts or 'no row has a limit here'}"]


def _numbers(row: Verdict) -> tuple[str, str, str]:
    if row.requirement_db is not None:
        image = "-" if row.measured_db is None else f"{row.measured_db:.1f} dB"
        return f"{row.requirement_db:.3g} dB", "-", image
    phases = (row.budget_rad, row.predicted_qpe_rad, row.measured_qpe_rad)
    budget, exact, image = ("-" if phase is None else f"{phase:.3f} rad" for phase in phases)
    return budget, exact, image


def _cells(row: str, limit: str, budget: str, exact: str, image: str, verdict: str) -> str:
    return f"{row:<34} {limit:>11} {budget:>9} {exact:>9} {image:>9} {verdict}".rstrip()
