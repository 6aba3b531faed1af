"""A mission whose stated errors are all larger by a factor."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from bisar_budget import units
from bisar_budget.design.quantities import QuestionError
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import MISSION, Mission
from bisar_budget.mission.readers import ListOf, OneOf, Quantity, Reader, Section, Triple

# What a factor does not multiply: when and how fast an error changes, and settings.
_KEPT = (units.FREQUENCY, units.TIME, units.RATIO, units.MEMORY)
_LEVELS = (units.POWER_RATIO, units.PHASE_NOISE, units.TONE)
_ERRORS = ("motion_error", "common_motion_error", "timing_error", "other_errors")
_ACCEPTED = (
    "accepted: platforms.transmitter.motion_error, platforms.receiver.motion_error, common_motion_error, "
    "timing_error, other_errors, or a key below one of them"
)


def scaled(mission: Mission, key: str, factor: Any) -> Mission:
    """Multiply every error that stands below a key: amplitudes and sigmas, those of parts of the catalogue too.

    Frequencies, correlation times and correlations stay. The factor may be an array (cases,).

    Raises
    ------
    QuestionError
        The key holds no errors, or the mission states none there.
    """
    parts = parts_of(key)
    if not any(part in _ERRORS for part in parts[:3]):
        raise QuestionError(f"{key}: holds no errors that --scale could multiply; {_ACCEPTED}")
    changed, count = _below(mission, MISSION, parts, factor, key)
    if not count:
        raise QuestionError(f"{key}: the mission states no error there that --scale could multiply")
    return cast(Mission, changed)


def _below(value: Any, reader: Reader, parts: Sequence[str], factor: Any, key: str) -> tuple[Any, int]:
    """Go down to the key, and put what is scaled in its place on the way back."""
    if not parts:
        return _scaled(value, reader, factor, is_clock=parts_of(key)[0] == "timing_error")
    part, *rest = parts
    reader = _form(reader, value)
    if isinstance(reader, Section) and part in reader.keys and value is not None:
        inner, count = _below(getattr(value, part), reader.keys[part].reader, rest, factor, key)
        return value._replace(**{part: inner}), count
    if isinstance(reader, ListOf | Triple) and part.isdigit() and value and int(part) < len(value):
        below = reader.section if isinstance(reader, ListOf) else reader.component
        inner, count = _below(value[int(part)], below, rest, factor, key)
        return (*value[: int(part)], inner, *value[int(part) + 1 :]), count
    raise QuestionError(f"{key}: the mission has no {part}; {_ACCEPTED}")


def _scaled(value: Any, reader: Reader, factor: Any, is_clock: bool) -> tuple[Any, int]:
    """Multiply what is below a value; with it the number of numbers that are not zero."""
    reader = _form(reader, value)
    if value is None:
        return value, 0
    if isinstance(reader, Section):
        count = 0
        for name, below in reader.keys.items():
            inner, found = _scaled(getattr(value, name), below.reader, factor, is_clock)
            value, count = value._replace(**{name: inner}), count + found
        return value, count
    if isinstance(reader, ListOf | Triple):
        below_reader = reader.section if isinstance(reader, ListOf) else reader.component
        pairs = [_scaled(entry, below_reader, factor, is_clock) for entry in value]
        return tuple(entry for entry, _ in pairs), sum(found for _, found in pairs)
    if isinstance(reader, Quantity):
        if reader.dimension in _LEVELS:
            return value + 20 * np.log10(factor), 1
        if reader.dimension in _KEPT and not is_clock:
            return value, 0
        return value * factor, int(np.any(value))
    if hasattr(value, "sigmas"):  # a covariance
        return value._replace(sigmas=tuple(sigma * factor for sigma in value.sigmas)), int(np.any(value.sigmas))
    return value, 0


def _form(reader: Reader, value: Any) -> Reader:
    """The form of a reader that gave a value that was read."""
    if isinstance(reader, OneOf):
        kind = Triple if isinstance(value, tuple) and not hasattr(value, "_fields") else Quantity
        matching = [form for form in reader.forms if isinstance(form, Section) and type(value) is form.kind]
        return next(iter([*matching, *(form for form in reader.forms if isinstance(form, kind))]), reader.forms[0])
    return reader
