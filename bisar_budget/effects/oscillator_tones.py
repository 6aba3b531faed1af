"""Tones of oscillators: spurs, and the part of any tone that the synchronization leaves, by frequency.

Exchanges every T_s sample a tone at f, and straight lines join the samples. These lines contain tones at f + m/T_s
with sinc²((f + m/T_s)·T_s) of the amplitude. Less these lines, 1 − sinc²(fT_s) of the tone stays at f (m = 0); the
lines with m ≠ 0 are the frequencies that the tone is folded to. The phases of the folded tones follow from the
unknown instant of the exchange within its interval. Derived here.
"""

import math
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Floats, PerCase
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.spectra import Parts, tone
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission

_SEEN_AMPLITUDE_FRACTION = 0.01  # of a tone's amplitude; a smaller echo counts as none
_NEIGHBOUR_RATE_COUNT = (
    3  # rates around 0 Hz beyond which a tone is folded with less than a hundredth of its amplitude
)


class LeftTone(NamedTuple):
    """The rest of a tone of amplitude 1: its own frequency first, then the frequencies that it is folded to. [Hz]

    `shares` are amplitudes, 0 for a frequency that does not occur.
    """

    frequencies: tuple[PerCase, ...]
    shares: tuple[PerCase, ...]

    @property
    def is_folded(self) -> bool:
        """Whether exchanged pulses fold the tone."""
        return len(self.shares) > 1

    def echoes(self, aperture_time: PerCase) -> list[PerCase]:
        """Amplitudes of the tones that make echoes, from one cycle per aperture on; the tone's own if not folded."""
        if not self.is_folded:
            return [self.shares[0]]
        return [
            np.where(frequency * aperture_time >= SLOWEST_ECHO_CYCLES, share, 0.0)[()]
            for frequency, share in zip(self.frequencies, self.shares, strict=True)
        ]

    def echo(self, mission: Mission) -> PerCase:
        """Amplitude of the largest echo; without a PSLR requirement for tones, the root of the summed powers."""
        echoes = self.echoes(mission.collection.aperture_time)
        if mission.requirements.pslr is None:
            together: PerCase = np.sqrt(sum(np.square(amplitude) for amplitude in echoes))
            return together
        largest: PerCase = np.max(np.broadcast_arrays(*echoes), axis=0)[()]
        return largest

    def slowest_echo(self, aperture_time: PerCase) -> PerCase:
        """Lowest frequency of an echo of at least 1 % of the amplitude; the tone's own if not folded. [Hz]"""
        if not self.is_folded:
            return self.frequencies[0]
        seen = zip(self.frequencies, self.echoes(aperture_time), strict=True)
        slowest: PerCase = np.min(
            [np.where(share > _SEEN_AMPLITUDE_FRACTION, frequency, math.inf) for frequency, share in seen], axis=0
        )[()]
        return slowest

    def place(self, aperture_time: PerCase) -> PerCase:
        """Frequency of the largest echo. [Hz]"""
        both = np.array(np.broadcast_arrays(*self.echoes(aperture_time), *self.frequencies))
        echoes, frequencies = np.split(both, 2)
        of_largest: PerCase = np.take_along_axis(frequencies, echoes.argmax(axis=0)[None], axis=0)[0]
        return of_largest

    def slow_parts(self, aperture_time: PerCase) -> Parts:
        """Parts over the aperture of the tones below one cycle per aperture, each in its worst phase. [rad²]

        The folded tones of one tone depend on each other, so their amplitudes add.
        """
        total: Floats = np.zeros((5, *np.broadcast_shapes(*map(np.shape, (aperture_time, *self.frequencies)))))
        for frequency, share in zip(self.frequencies, self.shares, strict=True):
            cycles = frequency * aperture_time
            if not np.any(cycles < SLOWEST_ECHO_CYCLES):
                continue
            quadratic, cubic, spread, constant, linear = tone(math.pi * np.minimum(cycles, SLOWEST_ECHO_CYCLES))
            tone_orders = np.array((quadratic, cubic, np.sqrt(spread), constant, linear))
            total = total + np.where(cycles < SLOWEST_ECHO_CYCLES, share, 0.0) * tone_orders
        quadratic, cubic, spread, constant, linear = total
        products = (-constant * quadratic, -linear * cubic)
        return Parts(quadratic**2, cubic**2, spread**2, constant**2, linear**2, *products)


def left_of_tone(frequency: PerCase, mission: Mission, geometry: BistaticGeometry) -> LeftTone:
    """Tone that the synchronization leaves. A direct path leaves 2|sin(πfΔt)| of the receiver's tone."""
    sync = mission.synchronization
    if mission.has_direct_path:
        return LeftTone((frequency,), (2 * np.abs(np.sin(math.pi * frequency * geometry.echo_delay)),))
    if sync is None or sync.interval is None:
        return LeftTone((frequency,), (1.0,))
    turns = frequency * np.asarray(sync.interval)
    folds = [np.rint(turns) + n for n in range(-_NEIGHBOUR_RATE_COUNT, _NEIGHBOUR_RATE_COUNT + 1)]
    folded_turns = [np.abs(turns - fold) for fold in folds]
    folded = [
        np.where(fold == 0, 0.0, np.sinc(folded_turn) ** 2)[()]
        for fold, folded_turn in zip(folds, folded_turns, strict=True)
    ]
    frequencies = (frequency, *(folded_turn / sync.interval for folded_turn in folded_turns))
    return LeftTone(frequencies, (1 - np.sinc(turns) ** 2, *folded))


class Spur(NamedTuple):
    """A tone of an oscillator: platform, entry by frequency, frequency [Hz], peak phase at centre frequency [rad].

    `free` is the phase of a free oscillator, `left` is the tone that the synchronization leaves, and `echo` is the
    share of `left` that makes echoes.
    """

    name: str
    entry: int
    frequency: float
    free: PerCase
    left: LeftTone
    echo: PerCase

    @property
    def subject(self) -> Subject:
        """Subject of the spur's row."""
        return subject(self.name, "oscillator", "spur", entry=self.entry)

    @property
    def phase(self) -> PerCase:
        """Peak phase of the spur's echo. [rad]"""
        return self.free * self.echo

    def slow_parts(self, aperture_time: PerCase) -> Parts | None:
        """Parts over the aperture of the folded tones below one cycle per aperture; None without folding. [rad²]"""
        if not self.left.is_folded:
            return None
        return self.left.slow_parts(aperture_time).times(np.square(self.free))


def spurs_of(mission: Mission, geometry: BistaticGeometry | None = None) -> list[Spur]:
    """Tones that reach the image. With a direct path as clock, only the receiver's tones do: they are heard twice.

    `geometry` holds many cases where numbers of the mission are arrays.
    """
    spurs = []
    for name in PLATFORMS[mission.has_direct_path :]:
        oscillator = getattr(mission.platforms, name).oscillator
        for index, (frequency, level) in enumerate(oscillator.spurs if oscillator is not None else ()):
            scale = mission.radar.center_frequency / oscillator.frequency
            remaining = left_of_tone(frequency, mission, geometry or mission.geometry)
            # A sideband of a phase φ has the amplitude φ/2 of the carrier.
            free = 2 * 10 ** (level / 20) * scale
            spurs.append(Spur(name, index, frequency, free, remaining, remaining.echo(mission)))
    return spurs
