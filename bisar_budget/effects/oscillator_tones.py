"""Tones in the phase of oscillators: spurs, and the residual tones into which synchronization turns a tone.

The exchanges of pulses, at intervals T_s, sample a tone at frequency f. Between the samples, the phase is
interpolated linearly. The interpolated phase contains tones at f + m/T_s. Their amplitudes are sinc²((f + m/T_s)·T_s)
times the amplitude of the original tone. When the interpolated phase is subtracted, the fraction 1 − sinc²(fT_s) of
the amplitude remains at f (m = 0). The tones with m ≠ 0 are at the frequencies to which the tone is folded. The
phases of the folded tones depend on the unknown instant of the exchange within its interval. These relations are
derived here, not taken from a publication.
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

_SEEN_AMPLITUDE_FRACTION = 0.01  # fraction of a tone's amplitude; smaller echoes are ignored
_NEIGHBOUR_RATE_COUNT = (
    3  # sampling rates on either side of 0 Hz; a tone folded farther away has less than 1 % of its amplitude
)


class LeftTone(NamedTuple):
    """Residual tones after synchronization, for an original tone of amplitude 1.

    `frequencies` [Hz] has the frequency of the original tone first, and then the frequencies to which it is folded.
    `shares` are the amplitudes of the residual tones; 0 for a frequency that does not occur.
    """

    frequencies: tuple[PerCase, ...]
    shares: tuple[PerCase, ...]

    @property
    def is_folded(self) -> bool:
        """Whether the synchronization exchanges pulses, which fold the tone to further frequencies."""
        return len(self.shares) > 1

    def echoes(self, aperture_time: PerCase) -> list[PerCase]:
        """Amplitudes of the residual tones that cause paired echoes in the image.

        A folded tone below one cycle per aperture causes no paired echoes, so its amplitude is returned as 0. A tone
        that is not folded keeps its amplitude at any frequency.
        """
        if not self.is_folded:
            return [self.shares[0]]
        return [
            np.where(frequency * aperture_time >= SLOWEST_ECHO_CYCLES, share, 0.0)[()]
            for frequency, share in zip(self.frequencies, self.shares, strict=True)
        ]

    def echo(self, mission: Mission) -> PerCase:
        """Combined amplitude of the residual tones that cause paired echoes in the image.

        With a PSLR requirement it is the amplitude of the tone that makes the largest echo. Without this requirement
        it is the root-sum-square of the amplitudes of all tones that make echoes.
        """
        echoes = self.echoes(mission.collection.aperture_time)
        if mission.requirements.pslr is None:
            together: PerCase = np.sqrt(sum(np.square(amplitude) for amplitude in echoes))
            return together
        largest: PerCase = np.max(np.broadcast_arrays(*echoes), axis=0)[()]
        return largest

    def slowest_echo(self, aperture_time: PerCase) -> PerCase:
        """Lowest frequency of the residual tones that make paired echoes. [Hz]

        Tones with less than 1 % of the original amplitude are ignored. For a tone that is not folded, the result is
        the tone's own frequency. It is infinite if no tone makes such an echo.
        """
        if not self.is_folded:
            return self.frequencies[0]
        seen = zip(self.frequencies, self.echoes(aperture_time), strict=True)
        slowest: PerCase = np.min(
            [np.where(share > _SEEN_AMPLITUDE_FRACTION, frequency, math.inf) for frequency, share in seen], axis=0
        )[()]
        return slowest

    def place(self, aperture_time: PerCase) -> PerCase:
        """Frequency of the residual tone that makes the largest paired echo in the image. [Hz]"""
        both = np.array(np.broadcast_arrays(*self.echoes(aperture_time), *self.frequencies))
        echoes, frequencies = np.split(both, 2)
        of_largest: PerCase = np.take_along_axis(frequencies, echoes.argmax(axis=0)[None], axis=0)[0]
        return of_largest

    def slow_parts(self, aperture_time: PerCase) -> Parts:
        """Squared Legendre parts, over the aperture, of the sum of the slow residual tones. [rad²]

        Slow tones have less than one cycle per aperture. Each tone is taken in its worst phase. The residual tones
        are not independent of each other, so the amplitudes of their parts add.
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
    """Residual tones after synchronization, for an original tone of amplitude 1 at the given frequency [Hz].

    If a direct path synchronizes the clocks, the receiver's tone remains with the amplitude 2|sin(πfΔt)|, where Δt is
    the delay of the radar echo after the direct signal. If there is neither a direct path nor an exchange of pulses,
    the tone remains unchanged.
    """
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
    """Spur of an oscillator: name of the platform, index of the spur in the file, and frequency [Hz].

    `free` [rad] is the peak phase before synchronization, at the radar's centre frequency. `left` are the residual
    tones after synchronization, for a tone of amplitude 1. `echo` is the amplitude of the residual tones that cause
    paired echoes in the image.
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
        """Peak phase of the residual tones that cause paired echoes, at the radar's centre frequency. [rad]"""
        return self.free * self.echo

    def slow_parts(self, aperture_time: PerCase) -> Parts | None:
        """Squared Legendre parts, over the aperture, of the spur's tones below one cycle per aperture. [rad²]

        The result is None if the synchronization does not fold the spur.
        """
        if not self.left.is_folded:
            return None
        return self.left.slow_parts(aperture_time).times(np.square(self.free))


def spurs_of(mission: Mission, geometry: BistaticGeometry | None = None) -> list[Spur]:
    """List the spurs of oscillators that reach the image.

    If a direct path synchronizes the clocks, only the receiver's spurs are listed. They are in the direct signal and
    in the radar echo. If numbers of the mission are arrays over cases, `geometry` is the geometry of all cases. By
    default it is the mission's own geometry.
    """
    spurs = []
    for name in PLATFORMS[mission.has_direct_path :]:
        oscillator = getattr(mission.platforms, name).oscillator
        for index, (frequency, level) in enumerate(oscillator.spurs if oscillator is not None else ()):
            scale = mission.radar.center_frequency / oscillator.frequency
            remaining = left_of_tone(frequency, mission, geometry or mission.geometry)
            # A phase tone of peak phase φ makes sidebands of φ/2 times the carrier's amplitude.
            free = 2 * 10 ** (level / 20) * scale
            spurs.append(Spur(name, index, frequency, free, remaining, remaining.echo(mission)))
    return spurs
