"""Vibrations below three cycles per aperture: phase errors from exact ranges, for the worst phase of the motion.

A vibration moves its platform by A·cos(2πfτ + ψ) along an axis, and its phase ψ is unknown. The effects are computed
for values of ψ all around the circle, and the largest effect counts. The effects of a small vibration follow from the
effects of a cosine and a sine. Where the second order matters, the effects are computed from exact ranges at the
displaced image point. Since the line of sight turns, motion along the track also has an effect. The vibration also
displaces the image, and this displacement adds phases.

As a function of ψ, the square of each resulting phase is a sum of harmonics. For a small vibration it has only a
constant and the second harmonic. A few values of ψ are therefore enough to find the largest square. The vibrations
along different axes may have any relative phase, so their largest effects add.

A vibration that the file states along the line of sight follows the turn of the line of sight, and all of it is range
error. The method is derived here, not taken from a publication. `tests/effects/test_slow_tones.py` checks it against
exact ranges for 36 values of ψ.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Booleans, Floats, Indices, PerCase
from bisar_budget.effects.declared import FLOOR_RAD, SECOND_ORDER_FRACTION
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.effects.vibration import ECHO_CYCLES, SLOWEST_ECHO_CYCLES, DeclaredPhase
from bisar_budget.geometry import BistaticGeometry, Vectors
from bisar_budget.image_plane import nodes_for
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.ranges.exact_ranges import (
    FINE_NODE_COUNT,
    NO_SHIFTS,
    ExactRanges,
    followed,
)

TONE_PHASE_COUNT = 16  # values of the phase ψ for which the effects are computed
TONE_PHASES_RAD = 2 * math.pi * np.arange(TONE_PHASE_COUNT) / TONE_PHASE_COUNT
TURNED = np.stack(
    (np.cos(TONE_PHASES_RAD), np.sin(TONE_PHASES_RAD)), axis=1
)  # weights of a cosine and a sine for each value of ψ
VALUES_PER_PHASE = 16  # factor by which the squares are interpolated between values of ψ
MAX_LANE_COUNT = 1 << 12  # pairs of case and value of ψ for which one call computes exact ranges


@dataclass(frozen=True, eq=False)
class TonePhases:
    """Phase errors due to a vibration along each axis, for values of its phase ψ all around the circle.

    Each field is an array (axes, TONE_PHASE_COUNT, cases) of phases [rad]: quadratic and cubic phase at the aperture
    edge, hidden phase (see `Declared`), and rms phase beyond the cubic.
    """

    quadratics: Floats
    cubics: Floats
    hiddens: Floats
    rests: Floats

    def axes(self) -> list["TonePhases"]:
        """Split the phase errors into one `TonePhases` for each axis."""
        phases = (self.quadratics, self.cubics, self.hiddens, self.rests)
        return [TonePhases(*(phase[[axis]] for phase in phases)) for axis in range(len(self.quadratics))]

    @cached_property
    def quadratic(self) -> Floats:
        """Sum of the quadratic phases of all axes, each at the worst phase ψ of its vibration, (cases,). [rad]"""
        return _worst(np.square(self.quadratics))

    @cached_property
    def cubic(self) -> Floats:
        """Sum of the cubic phases of all axes, each at the worst phase ψ of its vibration, (cases,). [rad]"""
        return _worst(np.square(self.cubics))

    @cached_property
    def rest(self) -> Floats:
        """Sum over all axes of the rms phase beyond the cubic order, each at its worst phase ψ, (cases,). [rad]"""
        return _worst(np.square(self.rests))

    def judged(self, gain: PerCase) -> Floats:
        """Phase to compare with a limit that has been raised by the autofocus gain `gain`, (cases,). [rad]

        It is the sum over the axes, each at the worst phase ψ of its vibration. See `Declared.judged`.
        """
        return _worst(np.square(self.quadratics) + np.square(gain * self.hiddens))

    def hidden(self, gain: PerCase) -> Floats:
        """Hidden phase that, together with the worst quadratic phase, gives the result of `judged`, (cases,). [rad]

        `gain` is the autofocus gain.
        """
        return np.asarray(np.sqrt(np.maximum(self.judged(gain) ** 2 - self.quadratic**2, 0.0)) / gain)


class SlowTone(NamedTuple):
    """A declared vibration below three cycles per aperture, and its effects.

    `per_metre` is the effect of a sinusoidal range error with an amplitude of 1 m. `declared` is the effect of the
    declared vibration. `is_there` (cases,) marks the cases in which the vibration has fewer than three cycles per
    aperture. `hears_part` is true if only a part of the motion is range error. This holds for a vibration that the
    file states along three axes, and for any vibration in a mission with a direct path.
    """

    subject: Subject
    is_there: Booleans
    per_metre: TonePhases
    declared: TonePhases
    hears_part: bool


def slow_tones(mission: Mission, geometry: BistaticGeometry, cases: int) -> dict[str, SlowTone]:
    """Compute the effects of sinusoidal vibrations with fewer than three cycles per aperture in at least one case.

    The keys of the result are the ids of the vibrations' rows.
    """
    T, is_heard, slow = mission.collection.aperture_time, mission.has_direct_path, dict[str, SlowTone]()
    exact: ExactRanges | None = None
    for platform_index, name in enumerate(PLATFORMS):
        error: MotionError = getattr(mission.platforms, name).motion_error
        for index, line in enumerate(error.vibration.sinusoidal):
            is_there = np.broadcast_to(np.asarray(line.frequency * T < ECHO_CYCLES), (cases,))
            if not is_there.any():
                continue
            if exact is None:
                count = nodes_for(geometry, T, has_direct_path=is_heard)
                exact = exact_ranges(mission, geometry, max(FINE_NODE_COUNT, int(np.max(count))), cases)
            tone = _Tone(exact, platform_index, line.frequency)
            value = line.displacement
            hears_all = not (is_heard or isinstance(value, tuple))
            if not (is_heard or isinstance(value, tuple)):  # motion along the line of sight has no second order
                of_axes = tone.of_range(value)[None]
            else:
                x, y, z = (track / exact.ranges[platform_index] for track in exact.tracks[platform_index])
                sizes: Sequence[float] = (value,) if not isinstance(value, tuple) else value
                axes = [(x, y, z)] if not isinstance(value, tuple) else getattr(geometry, name).frame(error.frame)
                of_axes = np.array([tone.of(axis, size) for axis, size in zip(axes, sizes, strict=True)])
            declared, of_metre = TonePhases(*np.moveaxis(of_axes, 1, 0)), TonePhases(*tone.of_range(1.0)[:, None])
            row_subject = subject(name, "vibration", "sinusoidal", entry=index)
            slow[row_subject.id] = SlowTone(row_subject, is_there, of_metre, declared, not hears_all)
    return slow


def slow_phases(mission: Mission, slow: Mapping[str, SlowTone], gain: PerCase) -> list[DeclaredPhase]:
    """Phase errors due to the vibrations below one cycle per aperture, for sums with the phases of other errors.

    `slow` is the result of `slow_tones`. `gain` is the autofocus gain.
    """
    T, phases = mission.collection.aperture_time, []
    for row_id, tone in slow.items():
        line = getattr(mission.platforms, tone.subject.owner).motion_error.vibration.sinusoidal[
            tone.subject.entry or 0
        ]
        is_slow = np.asarray(line.frequency * T < SLOWEST_ECHO_CYCLES)[()]
        if np.any(is_slow):
            does = tone.declared
            quadratic, cubic, hidden = (
                np.where(is_slow, phase_part, 0.0) for phase_part in (does.quadratic, does.cubic, does.hidden(gain))
            )
            phase = DeclaredPhase(row_id, tone.subject.owner, quadratic, cubic, is_there=is_slow)
            phases.append(phase._replace(hidden_rad=hidden))
    return phases


class _Tone:
    """Sinusoidal motion of a platform at one frequency, in many cases."""

    def __init__(self, exact: ExactRanges, platform_index: int, frequency: PerCase) -> None:
        self.exact, self.platform_index = exact, platform_index
        self.angle = 2 * math.pi * frequency * exact.times

    def of_range(self, size: PerCase) -> Floats:
        """First-order effects of a sinusoidal range error of amplitude `size`, (4, TONE_PHASE_COUNT, cases). [rad]

        The first axis has the order of the fields of `TonePhases`. `size` [m] is a number or (nodes, cases).
        """
        exact = self.exact
        range_error = np.array((np.cos(self.angle), -np.sin(self.angle))) * size
        effect = exact.effect(range_error)
        remaining = exact.left_of_small(range_error, (effect.east, effect.north))
        quadratic, cubic = (TURNED @ both for both in (effect.qpe, effect.cubic))
        hidden, beyond_cubic = exact.unresolved(np.tensordot(TURNED, remaining, 1))
        return np.array((quadratic, cubic, hidden, beyond_cubic))

    def of(self, way: Vectors, size: PerCase) -> Floats:
        """Effects of a sinusoidal motion of a platform along the direction `way`, (4, TONE_PHASE_COUNT, cases). [rad]

        `size` [m] is the amplitude of the motion. The first axis has the order of the fields of `TonePhases`. Each
        component of `way` is (cases,) or (nodes, cases). The effects are linear in `size`, except in cases where the
        second order matters. For these cases they are computed from exact ranges.
        """
        exact, cases = self.exact, self.exact.half.size
        small, size = (
            self.of_range(exact.along(self.platform_index, way) * size),
            np.broadcast_to(np.abs(size), (cases,)),
        )
        quadratic, cubic, hidden, moved = exact.most_per_metre
        reach = size * (1 + moved)
        grows = reach * reach / exact.nearest_node
        of_quadratic, of_cubic, of_hidden = (np.abs(phases).max(axis=0) for phases in small[:3])
        share = SECOND_ORDER_FRACTION * np.hypot(of_quadratic, of_hidden)
        is_large = np.asarray((quadratic + hidden) * grows > np.maximum(FLOOR_RAD, share))
        is_large |= cubic * grows > np.maximum(FLOOR_RAD, SECOND_ORDER_FRACTION * of_cubic)
        large_cases = np.flatnonzero(is_large & (size > 0))
        for first in range(0, large_cases.size, MAX_LANE_COUNT // TONE_PHASE_COUNT):
            here = large_cases[first : first + MAX_LANE_COUNT // TONE_PHASE_COUNT]
            small[..., here] = self._of_large(way, size, here)
        return small

    def _of_large(self, way: Vectors, size: Floats, cases: Indices) -> Floats:
        """Effects from exact ranges for the cases with the indices `cases`, (4, TONE_PHASE_COUNT, len(cases)). [rad]

        `way` and `size` are as in `of`. If no ground point has the recorded range history for a phase ψ of the
        vibration, each effect is set to the peak-to-peak phase of the motion, 2kA, where k = 2π/λ and A is the
        amplitude.
        """
        case, turned = np.repeat(cases, TONE_PHASE_COUNT), np.tile(TONE_PHASES_RAD, cases.size)
        angle = self.angle[:, case] if self.angle.shape[1] > 1 else self.angle
        course = size[case] * np.cos(angle + turned)
        moved = [_of_case(component, case) * course for component in way]
        shifts = [moved, NO_SHIFTS] if self.platform_index == 0 else [NO_SHIFTS, moved]
        point = followed(self.exact, np.zeros_like(course), shifts, case)
        phases = np.array((point.quadratic, point.cubic, point.hidden, point.rest))
        phases = np.moveaxis(phases.reshape(4, cases.size, TONE_PHASE_COUNT), 2, 1)
        return np.where(np.isnan(phases), 2 * self.exact.k[cases] * size[cases], phases)


def _of_case(component: PerCase, case: Indices) -> PerCase:
    return component[..., case] if isinstance(component, np.ndarray) and component.shape[-1] > 1 else component


def _worst(squares: Floats) -> Floats:
    """Largest effect of each axis over all values of the phase ψ, summed over the axes, (cases,).

    `squares` (axes, TONE_PHASE_COUNT, cases) are the squares of the effects, and are interpolated between the values
    of ψ. The sum is of the effects, not of their squares.
    """
    steps = TONE_PHASE_COUNT * VALUES_PER_PHASE
    around = np.fft.irfft(np.fft.rfft(squares, axis=1), steps, axis=1) * VALUES_PER_PHASE
    return np.asarray(np.sqrt(np.maximum(around.max(axis=1), 0.0)).sum(axis=0))
