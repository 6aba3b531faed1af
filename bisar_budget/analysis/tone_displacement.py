"""Displacement of the image by tones: vibrations of platforms, and tones of their oscillators.

Over an aperture, a tone of amplitude A has the mean A·j₀(x) and, at the edge, the linear part 3A·j₁(x), with x = πfT.
They displace the image like the parts of any range error: according to (25), or, along a turning line of sight, by
orders 0 to 3 with exact ranges. Orders 0 and 2 have their maximum at the same phase of the tone, and orders 1 and 3 a
quarter cycle later. The image therefore moves on an ellipse as the phase of the tone varies.

East and north each count in their worst phase. Their root-sum-square is √2 times the rms displacement over all
phases. It lies between the largest displacement and √2 times the largest. Derived here, to first order in the
amplitude. Exact ranges in all phases check it (`tests/analysis/test_tone_displacement.py`).

The axes of a vibration may be in any phase, so their displacements add. A faster tone displaces less, as 1/(fT).
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.arrays import Floats, PerCase
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.declared import published_planes
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.oscillator_acceleration import accelerated_tones
from bisar_budget.effects.oscillator_tones import LeftTone, spurs_of
from bisar_budget.effects.random_effect import orders_at
from bisar_budget.effects.spectra import tone
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES, counted
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission, has_instruments
from bisar_budget.mission.platforms import MotionError
from bisar_budget.ranges.exact_ranges import ExactRanges


class TonePart(NamedTuple):
    """Part of a tone along one direction.

    `orders` (4, n) are the signed amplitudes of its orders 0 to 3 at the aperture edge. [m] `per_metre` (4, 2, n) is
    the displacement per metre of each order, east and north. [m/m]
    """

    orders: Floats
    per_metre: Floats

    @property
    def displacement(self) -> Floats:
        """Displacement east and north, each in its worst phase, (2, n). [m]"""
        constant, linear, quadratic, cubic = self.orders[:, None] * self.per_metre
        return np.asarray(np.hypot(constant - quadratic, linear - cubic))


class ToneDisplacement(NamedTuple):
    """Displacement of the image by a tone, as parts for each model, with the subject of the tone's row.

    The parts may be in any phase relative to each other.
    """

    subject: Subject
    published: Sequence[TonePart]
    full: Sequence[TonePart]

    def parts(self, model: str) -> Sequence[TonePart]:
        """Parts of the tone according to the model of the given name."""
        return self.full if model == "full" else self.published

    def by(self, model: str) -> Floats:
        """Displacement east and north according to a model, each component in its worst phase, (2, n). [m]"""
        return np.asarray(sum(tone_part.displacement for tone_part in self.parts(model)))


def tone_displacements(mission: Mission, geometry: BistaticGeometry, exact: ExactRanges) -> list[ToneDisplacement]:
    """Displacement by every vibration of a platform and every tone of an oscillator, with or without echoes.

    A tone that exchanges fold has a part at each frequency. Below one cycle per aperture, the vibration of an
    oscillator counts in the row of the oscillator's acceleration, and a folded tone in the row of the oscillator.
    """
    T, plane, displacements = mission.collection.aperture_time, _by_plane(geometry, exact), list[ToneDisplacement]()
    for platform_index, name in enumerate(PLATFORMS):
        error: MotionError = getattr(mission.platforms, name).motion_error
        for index, line in enumerate(error.vibration.sinusoidal):
            value, cycles = line.displacement, line.frequency * T
            sizes: Sequence[float]
            if isinstance(value, tuple):
                ways, sizes = getattr(geometry, name).frame(error.frame), value
            else:  # stated along the line of sight, which turns over the aperture
                ways, sizes = (
                    [[component / exact.ranges[platform_index] for component in exact.tracks[platform_index]]],
                    (value,),
                )
            published = TonePart(_orders(cycles, counted(mission, name, value, "pslr", geometry)), plane)
            full = [
                TonePart(_orders(cycles, size), _by_ranges(exact, exact.along(platform_index, way)))
                for way, size in zip(ways, sizes, strict=True)
            ]
            displacements.append(
                ToneDisplacement(subject(name, "vibration", "sinusoidal", entry=index), [published], full)
            )
    by_models = [plane, _by_ranges(exact, np.ones_like(exact.times))]
    if mission.has_direct_path:  # the constant phase between direct path and echo moves nothing
        by_models = [per_metre * np.array([0.0, 1.0, 1.0, 1.0])[:, None, None] for per_metre in by_models]
    for row_subject, free, remaining in _tones_of_oscillators(mission, geometry) if has_instruments(mission) else ():
        echoes = zip(remaining.frequencies, remaining.echoes(T), strict=True)
        orders = [_orders(frequency * T, free * share / exact.k) for frequency, share in echoes]
        if np.any(orders):
            both = ([TonePart(tone, per_metre) for tone in orders] for per_metre in by_models)
            displacements.append(ToneDisplacement(row_subject, *both))
    return displacements


def _tones_of_oscillators(
    mission: Mission, geometry: BistaticGeometry
) -> Iterator[tuple[Subject, PerCase, LeftTone]]:
    """Yield the tones of the oscillators: their spurs, and the tones that vibration causes.

    Each item has the subject of the tone's row, the peak phase of the tone without synchronization [rad], and the
    part of the tone that the synchronization leaves. The phase is 0 for a slow vibration whose tone is not folded.
    """
    for spur in spurs_of(mission, geometry):
        yield spur.subject, spur.free, spur.left
    for accelerated in accelerated_tones(mission, geometry):
        is_fast: Any = accelerated.left.is_folded | (
            accelerated.frequency * mission.collection.aperture_time >= SLOWEST_ECHO_CYCLES
        )
        phase: PerCase = is_fast * accelerated.free * accelerated.sensitivity
        yield accelerated.subject, phase, accelerated.left


def _orders(cycles: PerCase, size: PerCase) -> Floats:
    """Amplitudes of orders 0 to 3 of a tone at the aperture edge, (4, n). [m]

    `cycles` is the number of cycles per aperture, and `size` the amplitude of the tone. [m]
    """
    quadratic, cubic, _, constant, linear = size * tone(math.pi * np.atleast_1d(cycles))
    return np.array([constant, linear, quadratic, cubic])


def _by_plane(geometry: BistaticGeometry, exact: ExactRanges) -> Floats:
    """Displacement per metre of each order according to (25), (4, 2, n); NaN where Q has no inverse. [m/m]"""
    plane, _ = published_planes(geometry)
    displacement = np.zeros((4, *np.shape(exact.place_weights)[::2]))
    scale = 1 / np.where(plane.is_singular, math.nan, plane.determinant)
    for way, (by_value, by_slope) in enumerate(plane.adjugate):
        displacement[0, way], displacement[1, way] = by_value * scale, by_slope * scale / exact.half
    return displacement


def _by_ranges(exact: ExactRanges, along: Floats) -> Floats:
    """Displacement per metre of each order by exact ranges, (4, 2, n). [m/m]

    `along` (nodes, n) is the range error at the nodes per metre of the tone.
    """
    seen = np.where(np.abs(along) > VECTOR_ROUNDING_FRACTION, along, 0.0)
    return np.asarray(np.einsum("wnc,nc,no->owc", exact.place_weights, seen, orders_at(exact.sampling.places)))
