"""Influences on a verdict from outside the mission file: the day on which waivers are judged, and the model."""

import datetime as dt
import os

from bisar_budget.budget.waivers import overrides
from bisar_budget.constants import GATING_MODELS
from bisar_budget.faults import printable
from bisar_budget.findings.requirement import Outside, Override
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError

DAY_OF_RUN = "the day of the run"
_CALLER = "the caller"


def day_of(date: str | dt.date | None) -> dt.date:
    """Day (UTC) for which waivers are judged: `date`, or else the day of SOURCE_DATE_EPOCH, or else today.

    Raises
    ------
    ValueError
        `date` is not a valid date, or the environment variable SOURCE_DATE_EPOCH is not a time in seconds since 1970.
    """
    if isinstance(date, dt.datetime):
        return date.date()
    if date is not None:
        try:
            return date if isinstance(date, dt.date) else dt.date.fromisoformat(date)
        except (TypeError, ValueError):
            raise ValueError(f"no day (got {printable(str(date))!r}); accepted: 2026-12-31") from None
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return dt.datetime.now(dt.UTC).date()
    try:
        if not (epoch.isascii() and epoch.isdigit()):
            raise ValueError
        return dt.datetime.fromtimestamp(int(epoch), dt.UTC).date()
    except (ValueError, OverflowError, OSError):
        raise ValueError(f"SOURCE_DATE_EPOCH must be seconds since 1970 (got {printable(epoch)!r})") from None


def day_origin(day: str | dt.date | None, giver: str) -> str:
    """Describe, for reports, the origin of the day on which waivers are judged.

    The result is `giver` if `day` is not None, or else the environment variable SOURCE_DATE_EPOCH, or else the day of
    the run.
    """
    if day is not None:
        return giver
    return "environment, SOURCE_DATE_EPOCH" if os.environ.get("SOURCE_DATE_EPOCH") else DAY_OF_RUN


def outside_of(model: str | None, day: str | dt.date | None) -> Outside:
    """Record the arguments `model` and `day` of a call as settings from outside the mission file.

    Reports list these settings, because they can change a verdict.
    """
    options = () if model is None else (Override("--model", model, _CALLER),)
    return Outside(options, day_origin(day, _CALLER), day is not None, _CALLER)


def influences_of(
    mission: Mission, model: str | None, date: str | dt.date | None, outside: Outside | None
) -> tuple[dt.date, tuple[Override, ...]]:
    """Find the day on which waivers are judged, and list influences on the verdict that are not in the file.

    Raises `QuestionError` for an unknown model.
    """
    if model not in (None, *GATING_MODELS):
        raise QuestionError(f"--model {printable(str(model))}: accepted: {', '.join(GATING_MODELS)}")
    today = day_of(date)
    return today, overrides(mission, outside or outside_of(model, date), today)
