"""What an error that is relaxed costs the others, where the shares of a budget follow what is declared."""

import math
from collections.abc import Iterator, Sequence
from datetime import date
from typing import Any

from bisar_budget.budget.check import check_mission
from bisar_budget.design.quantities import QuestionError
from bisar_budget.design.scaled import scaled
from bisar_budget.design.slopes import Relaxed
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission

FACTOR = 2.0
_SAME = 1e-9  # of what is declared


def relaxed_errors(mission: Mission, found: MissionFindings, today: date) -> Iterator[Relaxed]:
    """Double one declared error after the other, and see what that leaves to the others.

    Parameters
    ----------
    mission : Mission
        Its phase is divided by `balanced`.
    found : MissionFindings
        Of a check of it.
    today : date
        Day on which waivers are judged, UTC.
    """
    for key in _declared_errors(mission):
        try:
            doubled = scaled(mission, key, FACTOR)
        except QuestionError:  # all of it is 0
            continue
        after = check_mission(doubled, today, is_brief=True, is_bare=True)
        yield Relaxed(
            key=key,
            shares_before=_shares(found),
            shares_after=_shares(after),
            transmitter=_of_others("transmitter", found.rows, after.rows),
            receiver=_of_others("receiver", found.rows, after.rows),
        )


def _declared_errors(mission: Mission) -> Iterator[str]:
    """Keys of the declared errors: of each platform by kind, with those of parts of the catalogue."""
    for name in PLATFORMS:
        error = getattr(mission.platforms, name).motion_error
        yield from _stated(error, f"platforms.{name}.motion_error", ("covariance", "position", "velocity"))
        yield from _stated(error, f"platforms.{name}.motion_error", ("acceleration", "vibration"))
        if error.imu is not None:
            figures = [figure for figure in error.imu._fields if figure != "source"]
            yield from _stated(error.imu, f"platforms.{name}.motion_error.imu", figures)
        yield from (f"platforms.{name}.motion_error.random.{index}" for index in range(len(error.random)))
    if mission.common_motion_error is not None:
        yield from _stated(
            mission.common_motion_error, "common_motion_error", ("position", "velocity", "acceleration")
        )
    yield from _stated(mission.timing_error, "timing_error", mission.timing_error._fields)
    yield from (f"other_errors.{index}" for index in range(len(mission.other_errors)))


def _stated(section: Any, key: str, names: Sequence[str]) -> Iterator[str]:
    yield from (f"{key}.{name}" for name in names if getattr(section, name) is not None)


def _shares(found: MissionFindings) -> tuple[float, float]:
    return found.allocation.qpe.transmitter, found.allocation.qpe.receiver


def _of_others(owner: str, before: Sequence[Row], after: Sequence[Row]) -> tuple[str, float, float] | None:
    """Worst utilization of a platform, before and after, of judged rows whose declared value stays as it is."""
    now = {row.id: row for row in after}
    kept = [
        (now[row.id].utilization or 0.0, row.id, row.utilization)
        for row in before
        if row.owner in (owner, "clock" if owner == "receiver" else owner)
        and row.utilization is not None
        and math.isfinite(row.utilization)
        and STATUS[row.status].is_judged
        and row.id in now
        and abs((now[row.id].declared or 0.0) - (row.declared or 0.0)) <= _SAME * abs(row.declared or 0.0)
    ]
    use, row_id, _ = max(kept, default=(math.inf, "", 0.0))
    if not math.isfinite(use):
        return None
    return row_id, max(before for _, _, before in kept), use
