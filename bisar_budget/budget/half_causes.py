"""Causes of error that need two entries of the mission file, of which only one is given.

Rows that depend on such a cause are not evaluated. Otherwise, a failing mission could be made to pass by deleting the
worse of the two entries from its file. There are two kinds of such causes. The first is a pair of clocks, which needs
the oscillators of both platforms. The second is the vibration that an oscillator feels. If the airframe's vibration
has tones and noise, `oscillator.vibration` needs both too, but the file may state only one of them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from bisar_budget import phrases
from bisar_budget.effects.effect import PLATFORMS, Subject
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note

_HOLD_NOISE = ("quadratic_phase_error", "cubic_phase_error", "islr")
_HOLD_TONES = (*_HOLD_NOISE, "pslr")
_HOLD_CLOCKS = (*_HOLD_NOISE, "location_error")


@dataclass(frozen=True)
class HalfCause:
    """A cause of error that needs two entries of the mission file, of which only one is given.

    Attributes
    ----------
    platforms : tuple of str
        Affected platforms whose oscillator is stated.
    requirements : tuple of str
        Keys of the requirements that limit the effects of the cause.
    note : Note
        Message with the name of the key to add to the file.
    """

    platforms: tuple[str, ...]
    requirements: tuple[str, ...]
    note: Note

    def holds(self, subject: Subject) -> bool:
        """Whether a row depends on this cause.

        This is so for the rows of the oscillators of the affected platforms, and for the mission's rows of the
        requirements that limit the effects of the cause.
        """
        if subject.id in [f"mission.{key}" for key in self.requirements]:
            return True
        return subject.owner in self.platforms and subject.facts.moves == "clock"


def half_causes(mission: Mission) -> Iterator[HalfCause]:
    """Yield the causes of error that need two entries of the mission file, of which only one is given.

    Examples are a pair of clocks for which only one oscillator is given, and an oscillator's vibration for which the
    tones are given but not the noise.
    """
    yield from _half_clocks(mission)
    for name in PLATFORMS[mission.has_direct_path :]:
        platform = getattr(mission.platforms, name)
        oscillator = platform.oscillator
        if oscillator is None or oscillator.acceleration_sensitivity is None or oscillator.vibration is None:
            continue
        felt, airframe = oscillator.vibration, platform.motion_error.vibration
        if not felt.is_stated:
            continue
        held_by: dict[str, tuple[str, ...]] = {}
        if felt.spectrum is None and (airframe.spectrum is not None or airframe.wideband is not None):
            held_by["spectrum"] = _HOLD_NOISE
        if airframe.sinusoidal and not felt.sinusoidal:
            held_by["sinusoidal"] = _HOLD_TONES
        for key, requirements in held_by.items():
            yield HalfCause(
                (name,),
                _required(mission, requirements),
                phrases.note("felt-vibration-lacks", platform=name, key=key),
            )


def _half_clocks(mission: Mission) -> Iterator[HalfCause]:
    """Yield the pair of clocks as an incomplete cause of error if the file does not state both oscillators.

    For clocks in holdover, both oscillators must be stated. If the clocks exchange pulses, a missing oscillator
    matters only if the oscillator of the other platform is stated.
    """
    sync = mission.synchronization
    stated = tuple(name for name in PLATFORMS if getattr(mission.platforms, name).oscillator is not None)
    unstated = tuple(name for name in PLATFORMS if name not in stated)
    if sync is None or sync.is_direct_path or not unstated:
        return
    if sync.is_holdover:
        yield HalfCause(
            stated, _required(mission, _HOLD_CLOCKS), phrases.note("drift-is-not-stated", platforms=unstated)
        )
    elif stated:
        yield HalfCause(
            stated,
            _required(mission, _HOLD_NOISE),
            phrases.note("noise-between-pulses-is-not-stated", platforms=unstated),
        )


def _required(mission: Mission, keys: tuple[str, ...]) -> tuple[str, ...]:
    """Select the keys for which the mission file states a requirement."""
    return tuple(key for key in keys if getattr(mission.requirements, key) is not None)


def half_cause_of(mission: Mission, key: str) -> Note:
    """Write a note on missing entries of the mission file, if a requirement depends on an incomplete cause of error.

    An incomplete cause needs two entries of the mission file, of which only one is given, see `half_causes`. `key` is
    the key of the requirement. The note names the entries to add, and is empty if the requirement depends on no such
    cause.
    """
    notes = [half.note for half in half_causes(mission) if key in half.requirements]
    return notes[0].then(*notes[1:]) if notes else NOTHING
