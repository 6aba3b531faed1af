"""Phase noise and tones of both oscillators, and of the link that synchronises them, over one aperture."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import file_warnings, phrases
from bisar_budget.effects.effect import PLATFORMS, override_notes
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.random_errors import RandomEffect, RandomError
from bisar_budget.effects.spectra import link_parts, parts, synchronized_parts
from bisar_budget.effects.subject import subject
from bisar_budget.effects.tones import Parts, held
from bisar_budget.mission.instruments import Oscillator, Synchronization
from bisar_budget.mission.model import Mission

_MISFIT = 0.2  # of an Allan deviation, from where a power law does not describe it


def clock_noise(mission: Mission) -> Iterator[RandomError]:
    """Errors of the oscillators that a mission names, and of its synchronisation."""
    sync = mission.synchronization
    for name in PLATFORMS:
        oscillator: Oscillator | None = getattr(mission.platforms, name).oscillator
        if oscillator is not None:
            yield _of_oscillator(mission, name, oscillator, sync)
    if sync is not None:
        yield _of_link(mission, sync)


def _of_oscillator(mission: Mission, name: str, oscillator: Oscillator, sync: Synchronization | None) -> RandomError:
    T, factor = mission.collection.aperture_time, mission.allocation.coverage_factor
    noise = noise_of(oscillator, mission.radar.center_frequency, T)
    replaced = override_notes(name, oscillator.overridden)
    notes = [note for note in (*replaced, noise.extrapolated, *noise.notes) if note]
    no_limit, warning = phrases.no_phase_noise(), phrases.NOTHING
    if sync is not None and sync.is_direct_path:
        found, no_limit, notes = Parts(0.0, 0.0, 0.0), phrases.oscillators_drop_out(), [*replaced]
    else:
        if sync is not None and sync.interval is not None:
            notes.append(phrases.left_by_exchanges(sync.interval))
            found = synchronized_parts(noise.pieces, T, sync.interval)
        else:
            found = parts(noise.pieces, T)
    key = ("platforms", name, "oscillator")
    if noise.misfit > _MISFIT:
        warning = file_warnings.no_power_law_fits(".".join(key), noise.misfit)
    elif noise.misfit > 0.005:
        notes.append(phrases.power_law_fits(noise.misfit))
    quadratic, cubic, spread = map(math.sqrt, found)
    effect = RandomEffect(quadratic * factor, cubic * factor, spread)
    return RandomError(
        subject=subject(name, "oscillator"),
        unit="dB",
        declared=1.0,
        path=key if oscillator.sensor is None else (*key, "sensor"),
        published=effect,
        full=effect,
        equation="phase noise",
        evidence=oscillator.source,
        no_limit=no_limit,
        notes=tuple(notes),
        extrapolated=noise.extrapolated,
        warning=warning,
    )


def _of_link(mission: Mission, sync: Synchronization) -> RandomError:
    """Each exchange is wrong by an error of its own, and straight lines join them."""
    T, factor = mission.collection.aperture_time, mission.allocation.coverage_factor
    if sync.interval is None:  # from pulse to pulse: all of it spreads
        found, notes = Parts(0.0, 0.0, 1.0), [phrases.another_for_each_pulse()]
    else:
        found, notes = link_parts(T, sync.interval), []
    quadratic, cubic, spread = map(math.sqrt, found)
    effect = RandomEffect(quadratic, cubic, spread / factor)
    return RandomError(
        subject=subject("clock", "synchronization"),
        unit="rad",
        declared=sync.error * factor,
        path=("synchronization", "error"),
        published=effect,
        full=effect,
        equation="synchronisation",
        evidence=sync.source,
        notes=tuple(notes),
    )


class Spur(NamedTuple):
    """A tone of an oscillator: platform, entry by frequency, frequency [Hz], peak phase at centre frequency [rad].

    `left` is the part of it that exchanged pulses leave, which the phase has.
    """

    name: str
    entry: int
    frequency: float
    phase: Any
    left: Any


def spurs_of(mission: Mission) -> list[Spur]:
    """Tones that reach the image: none where the direct path is the receiver's clock."""
    if mission.has_direct_path:
        return []
    found = []
    for name in PLATFORMS:
        oscillator = getattr(mission.platforms, name).oscillator
        for index, (frequency, level) in enumerate(oscillator.spurs if oscillator is not None else ()):
            scale = mission.radar.center_frequency / oscillator.frequency
            left = _left_of(frequency, mission)
            # A sideband of a phase φ has the amplitude φ/2 of the carrier.
            found.append(Spur(name, index, frequency, 2 * 10 ** (level / 20) * scale * left, left))
    return found


def _left_of(frequency: float, mission: Mission) -> Any:
    """Largest part of a tone that exchanged pulses leave, at its own frequency or at one that it is folded to."""
    sync = mission.synchronization
    if sync is None or sync.interval is None:
        return 1.0
    turns = frequency * np.asarray(sync.interval)
    images = [np.rint(turns) + n for n in (-1, 0, 1)]
    passed = [np.where(image != 0, np.sqrt(held(2 * math.pi * (turns - image))), 0.0) for image in images]
    return np.max([1 - np.sqrt(held(2 * math.pi * turns)), *passed], axis=0)
