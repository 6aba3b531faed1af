"""Displacement of the image by tones: vibrations of platforms, and tones of their oscillators.

Over an aperture of duration T, a tone of frequency f and amplitude A has the mean A·j₀(x), with x = πfT. Its linear
part is 3A·j₁(x) at the aperture edge. These parts of the range error displace the image. In the published model the
displacement follows from equation (25) of Rigling & Moses. In the full model the line of sight turns, and the
displacement follows from exact ranges and from the Legendre terms of order 0 to 3 of the tone. Terms 0 and 2 are
largest at the same phase of the tone, and terms 1 and 3 are largest a quarter cycle later. The image therefore moves
on an ellipse as the phase of the tone varies.

The east and the north component are each taken at the phase at which they are largest. Their root-sum-square is √2
times the rms displacement over all phases. It lies between the largest displacement and √2 times the largest
displacement. These relations are derived here, to first order in the amplitude.
`tests/analysis/test_tone_displacement.py` checks them against exact ranges for all phases.

The vibrations along the axes may have any phase relative to each other, so their displacements add. The displacement
decreases with the frequency of the tone, as 1/(fT).
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
    """Sinusoidal motion at one frequency along one direction, as a part of a tone, and the displacement it causes.

    Over the aperture, the motion is expanded in Legendre polynomials of order 0 to 3. `orders` (4, n) [m] are the
    signed amplitudes of these four terms; the amplitude of a term is its value at the aperture edge. `per_metre` (4,
    2, n) [m/m] is the displacement of the image, east and north, per metre of amplitude of each term. The last axis
    holds n cases.
    """

    orders: Floats
    per_metre: Floats

    @property
    def displacement(self) -> Floats:
        """Displacement of the image (east, north), (2, n). [m]

        Each component is given for the phase of the tone at which it is largest.
        """
        return np.asarray(np.hypot(*self.waves))

    @property
    def waves(self) -> tuple[Floats, Floats]:
        """Displacements of the image (east, north) at the phases ψ = 0 and ψ = π/2 of the tone, (2, n) each. [m]

        The motion is A·cos(2πfτ + ψ), with the middle of the aperture at τ = 0.
        """
        constant, linear, quadratic, cubic = self.orders[:, None] * self.per_metre
        return constant - quadratic, cubic - linear


class ToneDisplacement(NamedTuple):
    """Displacement of the image by a tone in both models.

    `subject` identifies the tone's row in the report. `published` and `full` are the parts of the tone in each model,
    for example one part for each axis of a vibration. The parts may have any phase relative to each other.
    """

    subject: Subject
    published: Sequence[TonePart]
    full: Sequence[TonePart]

    def parts(self, model: str) -> Sequence[TonePart]:
        """Return the parts of the tone in the model `published` or `full`."""
        return self.full if model == "full" else self.published

    def by(self, model: str) -> Floats:
        """Displacement of the image east and north in the model `published` or `full`, (2, n). [m]

        Each component is given for the phase of the tone at which it is largest. The displacements due to all parts
        of the tone are added.
        """
        return np.asarray(sum(tone_part.displacement for tone_part in self.parts(model)))


def tone_displacements(mission: Mission, geometry: BistaticGeometry, exact: ExactRanges) -> list[ToneDisplacement]:
    """List the displacements of the image due to vibrations of platforms and tones of oscillators.

    Vibrations of platforms are included at any frequency. If the exchanges of a synchronization link fold an
    oscillator's tone, the tone has a part at each resulting frequency. Two effects at frequencies below one cycle per
    aperture are not included, because separate rows contain them. The row of the oscillator's acceleration contains
    the effect of an oscillator's vibration, and the row of the oscillator contains the effect of a folded tone.
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
    """Yield the tones of the oscillators, which are their spurs and the tones that vibration causes.

    Each item has three elements: the subject of the tone's row in the report, the peak phase of the tone without
    synchronization [rad], and the tones that are left after synchronization. The phase is 0 for a vibration below one
    cycle per aperture whose tone is not folded.
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
    """Signed amplitudes of the Legendre terms of order 0 to 3 of a tone, (4, n). [m]

    The amplitude of a term is its value at the aperture edge. `cycles` is the number of cycles per aperture, and
    `size` [m] is the amplitude of the tone.
    """
    quadratic, cubic, _, constant, linear = size * tone(math.pi * np.atleast_1d(cycles))
    return np.array([constant, linear, quadratic, cubic])


def _by_plane(geometry: BistaticGeometry, exact: ExactRanges) -> Floats:
    """Displacement of the image, east and north, per metre of each Legendre term, in the published model. [m/m]

    It follows from equation (25) of Rigling & Moses. The result is (4, 2, n). It is 0 for orders 2 and 3. For orders
    0 and 1 it is NaN in each case in which the matrix Q of that equation is singular.
    """
    plane, _ = published_planes(geometry)
    displacement = np.zeros((4, *np.shape(exact.place_weights)[::2]))
    scale = 1 / np.where(plane.is_singular, math.nan, plane.determinant)
    for way, (by_value, by_slope) in enumerate(plane.adjugate):
        displacement[0, way], displacement[1, way] = by_value * scale, by_slope * scale / exact.half
    return displacement


def _by_ranges(exact: ExactRanges, along: Floats) -> Floats:
    """Displacement of the image, east and north, per metre of each Legendre term, from exact ranges. [m/m]

    The result is (4, 2, n). `along` (nodes, n) [m/m] is the range error at the aperture nodes per metre of the tone's
    motion.
    """
    seen = np.where(np.abs(along) > VECTOR_ROUNDING_FRACTION, along, 0.0)
    return np.asarray(np.einsum("wnc,nc,no->owc", exact.place_weights, seen, orders_at(exact.sampling.places)))
