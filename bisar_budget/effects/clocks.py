"""Tones of oscillators: spurs, which reach the image as paired echoes."""

import math
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.tones import held
from bisar_budget.mission.model import Mission


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
