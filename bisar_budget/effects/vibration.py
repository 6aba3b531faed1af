"""Declared vibrations: paired echoes, components along the line of sight, phases of slow vibrations, and spectra.

If the receiver uses the direct path as its clock, the data contain ranges minus the length of the direct path. The
effect of a vibration is then its effect on this difference.

A vibration of peak phase φ and n < 1 cycles per aperture makes no echoes. Its largest Legendre parts of order 2 and 3
over the aperture are 5·j₂(πn)·φ and 7·j₃(πn)·φ. The phases at the aperture edge are 3/2 and 5/2 of these parts. Their
signs are unknown, because the phase of the vibration is unknown. Like any other error, the vibration is compared
alone with a limit, and is part of sums and root-sum-squares.

A vibration of n > 1 cycles per aperture and peak phase φ makes echoes at n resolution cells from the response. An
echo has φ/2 times the amplitude of the response and the same shape. For a uniform aperture the shape is sinc(x) =
sin(πx)/(πx), whose sidelobes reach the next echo. The phases of vibrations are unknown. In the worst case, several
echoes add in phase at a position x. Their sum is Σ φ_k/2·|sinc(x − n_k)|, and the position with the largest sum is
used. This method is derived here, not taken from a publication. From three cycles per aperture on, it agrees within
0.5 dB with transforms of the phasor for the worst phases (`tests/effects/test_echoes.py`). The echoes at −n_k are
left out. They would raise the sum by at most 0.3 dB at three cycles, and by less at more cycles.

A spectrum S_a of acceleration corresponds to the spectrum S_x = S_a/(2πf)⁴ of displacement. Its quadratic phase,
cubic phase, spread and displacement are the integrals of `spectra`. Motion slower than the aperture is therefore
included as the phase that it causes.

The numbers in a mission may be arrays (cases,). The geometry then has the same cases. Otherwise it is the mission's
own.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import phrases
from bisar_budget.arrays import Booleans, Floats, PerCase, PerCaseFlag
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.random_effect import Moves, RandomError, SensorCases
from bisar_budget.effects.spectra import Parts, PowerLawPiece, heard_parts, left_parts, tone
from bisar_budget.error_kinds.random_kinds import VIBRATION_KIND
from bisar_budget.geometry import FRAME_AXES, BistaticGeometry, Vector, Vectors, dot
from bisar_budget.image_plane import nodes, nodes_for
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.mission.vibrations import AcceleratedSinusoid, FeltVibration, Spectrum, Vibration
from bisar_budget.phrases import Note
from bisar_budget.units import format_quantity

NEAR_CYCLES = 2.5  # cycles per aperture; farther apart, two equal tones raise each other's echo by less than 1.1 dB
SLOWEST_ECHO_CYCLES = 1.0  # cycles per aperture; a slower vibration makes no echoes
ECHO_CYCLES = 3.0  # cycles per aperture; a slower vibration has echoes beside the mainlobe and a quadratic phase

_SEARCH_STEPS_CELLS = (0.1, 0.02)  # steps of the coarse and of the fine search
_REACH = np.arange(-6, 7)[:, None, None]
_SEARCH_START_COUNT = 16  # positions around which the search looks
_MAX_ECHO_COUNT = 200_000  # echoes in one array

DISPLACED = ((2 * math.pi) ** -4, 4.0)  # S_x = S_a/(2πf)⁴
_STEEP_DENSITY_EXPONENT = 20.0  # slope of a density beyond which its powers would overflow
_STEEP_PIECE_COUNT = 16  # flat pieces in place of a steep piece, which is narrow, or nearly zero at one end


# ---------------------------------------------------------------------- echoes that add
class Worst(NamedTuple):
    """Highest paired echo that several tones make together in their worst phases.

    `amplitude` is the amplitude of a single tone with an equally high echo. `cycles` is the position of the highest
    echo, in resolution cells; a tone has its own echo at its number of cycles per aperture.
    """

    amplitude: PerCase
    cycles: PerCase


def near_groups(cycles: Floats) -> NDArray[np.intp]:
    """Index of the group to which each tone belongs; neighbours in a group are at most 2.5 cycles per aperture apart.

    `cycles` are the cycles per aperture of the tones, (n, cases). The result has the same shape. A group has two or
    more tones. The groups of a case are numbered from 0 in order of frequency. A tone outside all groups, or below
    one cycle per aperture, has the index -1.
    """
    order = np.argsort(cycles, axis=0, kind="stable")
    placed = np.take_along_axis(cycles, order, axis=0)
    begins = np.ones(cycles.shape, dtype=bool)
    begins[1:] = (placed[:-1] < SLOWEST_ECHO_CYCLES) | (np.diff(placed, axis=0) > NEAR_CYCLES * (1 + 1e-9))
    has_next = np.zeros(cycles.shape, dtype=bool)
    has_next[:-1] = ~begins[1:]
    number = np.where(~begins | has_next, np.cumsum(begins & has_next, axis=0) - 1, -1)
    group = np.empty_like(number)
    np.put_along_axis(group, order, number, axis=0)
    return group


def near_lines(cycles: Sequence[float]) -> list[tuple[int, ...]]:
    """Indices of the tones in each group of neighbouring tones, for a single case.

    `cycles` are the cycles per aperture of the tones. The groups are defined as in `near_groups`, and are in order of
    frequency.
    """
    if not cycles:
        return []
    number = near_groups(np.array(cycles)[:, None])[:, 0]
    return [tuple(np.flatnonzero(number == group).tolist()) for group in range(number.max() + 1)]


def worst_phases(
    amplitudes: Sequence[PerCase] | Floats, cycles: Sequence[PerCase] | Floats, is_member: Booleans | None = None
) -> Worst:
    """Height and position of the highest paired echo that several tones make together in their worst phases.

    Parameters
    ----------
    amplitudes : (n,) or (n, cases)
        Amplitudes of the tones, 0 to peak, in any unit.
    cycles : same shape
        Cycles per aperture of the tones.
    is_member : same shape, optional
        Whether a tone is included, at least one in each case. If omitted, all tones are included.

    Returns
    -------
    Worst
        Amplitude of a single tone with an equally high echo, in the unit of `amplitudes`, and position of the echo.
        The amplitude is at least the largest amplitude. If all tones have the same frequency, it is the sum of all
        amplitudes.
    """
    sizes, frequencies = np.asarray(amplitudes, dtype=float), np.asarray(cycles, dtype=float)
    count, *shape = sizes.shape
    sizes, frequencies = sizes.reshape(count, -1), frequencies.reshape(count, -1)
    if is_member is not None:
        is_member = is_member.reshape(count, -1)
        frequencies = np.where(is_member, frequencies, math.inf)
        count = is_member.sum(axis=0).max()
    here = np.arange(frequencies.shape[1])
    order = np.argsort(frequencies, axis=0, kind="stable")[:count]
    sizes, frequencies = sizes[order, here], frequencies[order, here]
    if is_member is not None:  # a case with fewer lines gets lines without an amplitude at the last frequency
        is_line = np.isfinite(frequencies)
        sizes = np.where(is_line, sizes, 0.0)
        frequencies = np.where(is_line, frequencies, np.where(is_line, frequencies, 0.0).max(axis=0))
    begins = np.flatnonzero(np.append(True, (frequencies[1:] != frequencies[:-1]).any(axis=1)))
    sizes, frequencies = np.add.reduceat(sizes, begins, axis=0), frequencies[begins]  # lines of one frequency merge
    if len(frequencies) == 1:
        return Worst(sizes[0].reshape(shape)[()], frequencies[0].reshape(shape)[()])
    starts = np.sort(np.concatenate((frequencies, (frequencies[1:] + frequencies[:-1]) / 2)), axis=0)
    starts = starts[np.append(True, (starts[1:] != starts[:-1]).any(axis=1))]
    if len(starts) > _SEARCH_START_COUNT:
        starts = _highest(sizes, frequencies, starts)
    worst = np.empty((2, here.size))
    together = max(1, _MAX_ECHO_COUNT // (len(starts) * _REACH.size * len(frequencies)))
    for first in range(0, here.size, together):
        cases = slice(first, first + together)
        worst[:, cases] = _searched(sizes[:, cases], frequencies[:, cases], starts[:, cases])
    return Worst(*(column.reshape(shape)[()] for column in worst))


def _highest(sizes: Floats, frequencies: Floats, starts: Floats) -> Floats:
    """Select the starting points of the search at which the highest echoes are expected, without duplicates.

    The points are ranked by the sum of the amplitudes of the tones within one resolution cell of the point. `sizes`
    are the amplitudes (tones, cases), and `frequencies` the cycles per aperture of the tones. `starts` (points,
    cases) are the positions in cells.
    """
    summed = np.concatenate((np.zeros((1, sizes.shape[1])), np.cumsum(sizes, axis=0)))
    before, until = (_count(frequencies, starts, reach) for reach in (-1, 1))
    around = np.take_along_axis(summed, until, axis=0) - np.take_along_axis(summed, before, axis=0)
    around[1:][starts[1:] == starts[:-1]] = -1.0
    order = np.argsort(-around, axis=0, kind="stable")[:_SEARCH_START_COUNT]
    return np.take_along_axis(starts, order, axis=0)


def _count(frequencies: Floats, starts: Floats, reach: int) -> NDArray[np.intp]:
    """Number of tones up to a position one cell below or above each starting point, in the shape of `starts`.

    With `reach` 1, tones up to and including one cell above the starting point are counted. With `reach` -1, tones
    more than one cell below it are counted. `frequencies` (tones, cases) are the cycles per aperture of the tones,
    and `starts` (points, cases) are positions in cells. Both arrays are sorted.
    """
    ends = starts + reach
    both = (frequencies, ends) if reach > 0 else (ends, frequencies)
    order = np.argsort(np.concatenate(both), axis=0, kind="stable")
    is_frequency = order < len(frequencies) if reach > 0 else order >= len(ends)
    counted = np.empty_like(order)
    np.put_along_axis(counted, order, np.cumsum(is_frequency, axis=0), axis=0)
    return counted[len(frequencies) :] if reach > 0 else counted[: len(ends)]


def _searched(sizes: Floats, frequencies: Floats, starts: Floats) -> tuple[Floats, Floats]:
    """Height and position of the highest paired echo, (cases,) each.

    They are found by a search in steps around each starting point.
    """
    best = starts
    for step in _SEARCH_STEPS_CELLS:
        tried = best + step * _REACH
        highest = _heights(sizes, frequencies, tried).argmax(axis=0)
        best = best + step * (highest + _REACH[0, 0, 0])
    ends = np.concatenate((starts, best))
    heights = _heights(sizes, frequencies, ends)
    height = heights.max(axis=0)
    return height, np.where(heights == height, ends, -math.inf).max(axis=0)


def _heights(sizes: Floats, frequencies: Floats, x: Floats) -> Floats:
    """Sum of the heights of all paired echoes at the positions `x` (…, cases), if they are in phase.

    Positions are in resolution cells.
    """
    return np.asarray((sizes * np.abs(np.sinc(x[..., None, :] - frequencies))).sum(axis=-2))


# ---------------------------------------------------------------------- along the line of sight
class Line(NamedTuple):
    """Sinusoidal vibration: amplitude along the line of sight, 0 to peak [m], and frequency [Hz].

    `per_metre` converts an amplitude in metres to the unit of the vibration's row. It is (2πf)² if the file states
    the acceleration.
    """

    amplitude: PerCase
    frequency: Any
    per_metre: PerCase = 1.0


def sight_of(mission: Mission, name: str, geometry: BistaticGeometry | None = None) -> Vectors:
    """Reduction of the range per metre of a platform's motion along each scene axis, at mid-aperture. [m/m]

    With a direct path, it is the reduction of the difference between the range and the direct path. By default,
    `geometry` is the mission's own geometry.
    """
    sights = (geometry or mission.geometry).sights(has_direct_path=mission.has_direct_path)
    return sights[PLATFORMS.index(name)]


def seen_of_axes(
    mission: Mission, name: str, *, is_vector: bool, geometry: BistaticGeometry | None = None
) -> list[PerCase]:
    """Range error per metre of a platform's vibration along each axis, as rms over the aperture. [m/m]

    The line of sight turns over the aperture. The rms is an upper bound for the height of every paired echo, and
    gives the spread. If `is_vector` is true, the axes belong to the frame of the platform's motion error. If it is
    false, the file states a single value along the line of sight, and the result has a single item. Such a vibration
    is entirely range error; with a direct path, however, only a part of it is an error of the range minus the direct
    path.
    """
    geometry, is_heard = geometry or mission.geometry, mission.has_direct_path
    if not is_vector and not is_heard:
        return [1.0]
    T, platform_index = mission.collection.aperture_time, PLATFORMS.index(name)
    sampling = nodes(int(np.max(nodes_for(geometry, T, has_direct_path=is_heard))))
    turned = geometry.at(np.multiply.outer(sampling.places, np.atleast_1d(T) / 2))
    sight = turned.sights(has_direct_path=is_heard)[platform_index]
    error: MotionError = getattr(mission.platforms, name).motion_error
    ways = getattr(geometry, name).frame(error.frame) if is_vector else [turned.both[platform_index].look]
    mean = sampling.fit[0]
    floor = VECTOR_ROUNDING_FRACTION * np.sqrt(mean @ sum(component * component for component in sight))
    along = [np.sqrt(mean @ np.square(dot(way, sight))) for way in ways]
    seen = [np.where(component > floor, component, 0.0) for component in along]
    if np.ndim(T) or seen[0].size > 1:
        return [*seen]
    return [component.item() for component in seen]


def counted(
    mission: Mission,
    name: str,
    value: PerCase | Vectors,
    metric: str,
    geometry: BistaticGeometry | None = None,
) -> PerCase:
    """Amplitude or rms of a platform's vibration along the line of sight. [m]

    `metric` is `pslr` for an amplitude and `islr` for an rms. `value` [m] is a single value along the line of sight,
    or three values along the axes of the platform's frame. The projections follow from `seen_of_axes`. Projected
    amplitudes add, because the relative phases of the vibrations along the axes are unknown. Rms values are
    independent, so their squares add.
    """
    sizes = value if isinstance(value, tuple) else (value,)
    seen = seen_of_axes(mission, name, is_vector=isinstance(value, tuple), geometry=geometry)
    projections = [along * size for along, size in zip(seen, sizes, strict=True)]
    total: PerCase = (
        sum(map(np.abs, projections))
        if metric == "pslr"
        else np.sqrt(sum(projection * projection for projection in projections))
    )
    return total


def lines_of(mission: Mission, name: str, geometry: BistaticGeometry | None = None) -> list[Line]:
    """Sinusoidal vibrations of one platform, projected on the line of sight."""
    error: MotionError = getattr(mission.platforms, name).motion_error
    lines = error.vibration.sinusoidal
    return [
        Line(counted(mission, name, line.displacement, "pslr", geometry), line.frequency, 1 / line.scale)
        for line in lines
    ]


def unit_of_line(mission: Mission, name: str, entry: int) -> str:
    """Unit of the row of a sinusoidal vibration: `m/s^2` if the file states its acceleration, `m` otherwise.

    `entry` is the index of the vibration in the file's list.
    """
    lines = getattr(mission.platforms, name).motion_error.vibration.sinusoidal
    return "m/s^2" if entry < len(lines) and isinstance(lines[entry], AcceleratedSinusoid) else "m"


def projected(
    mission: Mission, value: float | Vector, error: MotionError, along: float, *, is_slow: bool = False
) -> tuple[Note, ...]:
    """Note on the component of a vibration along the line of sight; empty if the file states only this component.

    `value` [m] is the stated amplitude or rms, and `along` [m] is the component. With a direct path there is a note
    for every vibration, which gives the component in the range minus the direct path. For a slow vibration
    (`is_slow`) the note gives the amplitude along the line of sight that would have the same effect.
    """
    says = phrases.does_as_much_as_along_the_sight if is_slow else phrases.seen_of_vibration
    if not isinstance(value, tuple):
        stated = f"{format_quantity(value, 'm')} along the line of sight"
        return (says(stated, along, True),) if mission.has_direct_path else ()
    axes = ", ".join(
        f"{axis} {format_quantity(amplitude, 'm')}"
        for axis, amplitude in zip(FRAME_AXES[error.frame], value, strict=True)
    )
    return (says(axes, along, mission.has_direct_path),)


# ---------------------------------------------------------------------- below one cycle per aperture
def quadratic_part(cycles: PerCase) -> PerCase:
    """Ratio of a sinusoid's worst quadratic phase at the aperture edge to its peak phase, 7.5·j₂(π·cycles).

    `cycles` is the number n of cycles per aperture. The quadratic phase is the least-squares quadratic of cos(πnx)
    over the aperture. For small n the ratio is the Taylor term (πn)²/2.
    """
    phase: PerCase = np.abs(tone(math.pi * cycles)[0])
    return phase


def cubic_part(cycles: PerCase) -> PerCase:
    """Ratio of a sinusoid's worst cubic phase at the aperture edge to its peak phase, 17.5·j₃(π·cycles).

    `cycles` is the number n of cycles per aperture. The cubic phase is the least-squares cubic of sin(πnx) over the
    aperture.
    """
    phase: PerCase = np.abs(tone(math.pi * cycles)[1])
    return phase


class DeclaredPhase(NamedTuple):
    """Quadratic and cubic phase due to one declared error, as used in sums. [rad]

    `cubic_rad` is None for a pure quadratic phase. `coverage` is the coverage factor that both phases include.
    `rms_cubic_rad` is the root mean square of the cubic phase; if it is None, it is the cubic phase without the
    coverage factor.
    `is_there` marks the cases in which a vibration is slow; in all other cases its phases are 0.

    `hidden_rad` [rad] is combined with the quadratic phase as a root-sum-square. It represents the part of the range
    error that remains for any displacement of the image; this part is mainly constant and linear in time. The hidden
    phase is the quadratic phase that lowers the peak as much as this part does, see `ranges.exact_ranges`.
    """

    row_id: str
    owner: str
    qpe_rad: PerCase
    cubic_rad: Any
    coverage: PerCase = 1.0
    is_there: PerCaseFlag = True
    hidden_rad: PerCase = 0.0
    rms_cubic_rad: PerCase | None = None

    @property
    def expected_cubic_rad(self) -> PerCase:
        """Root mean square of the cubic phase, with the sign of the cubic phase. [rad]"""
        phase: PerCase = self.cubic_rad / self.coverage if self.rms_cubic_rad is None else self.rms_cubic_rad
        return phase

    def judged(self, gain: PerCase) -> PerCase:
        """Phase to compare with a limit that has been raised by the autofocus gain; see `Declared.judged`. [rad]

        `gain` is the autofocus gain.
        """
        return np.hypot(self.qpe_rad, gain * self.hidden_rad)


def slow_moves(seen: SensorCases) -> Iterator[tuple[Subject, Moves]]:
    """Yield, for each vibration below one cycle per aperture, its subject and the motion of its platform [m].

    Along each axis the motion has a cosine and a sine component. It is 0 in the cases in which the vibration has one
    cycle or more. A vibration stated along the line of sight moves its platform along the line of sight to the scene
    centre.
    """
    for name in PLATFORMS:
        for index, line in enumerate(seen.error(name).vibration.sinusoidal):
            is_slow = line.frequency * seen.aperture_time < SLOWEST_ECHO_CYCLES
            if not np.any(is_slow):
                continue
            value = line.displacement
            if isinstance(value, tuple):
                ways = seen.axes(name) * seen.vector(value)[:, None]
            else:
                ways = seen.vector(getattr(seen.geometry, name).look)[None] * value
            angle = 2 * math.pi * line.frequency * seen.exact.times
            courses = np.array((np.cos(angle), np.sin(angle))) * is_slow
            moves = Moves(PLATFORMS.index(name), ways[:, :, None], courses)
            yield subject(name, "vibration", "sinusoidal", entry=index), moves


# ---------------------------------------------------------------------- by a spectrum
def power_of(vibration: Vibration | FeltVibration) -> PerCase:
    """Factor 10^(L/10) by which the `spectrum_level` L [dB] of a vibration scales its spectrum; 1 without a level."""
    return 1.0 if vibration.spectrum_level is None else 10 ** (np.asarray(vibration.spectrum_level) / 10)


def spectrum_pieces(spectrum: Spectrum, law: tuple[float, float] = (1.0, 0.0)) -> tuple[PowerLawPiece, ...]:
    """Convert a vibration spectrum, multiplied by a power law of frequency, to power-law pieces.

    `law` is the pair (factor, slope) of the power law factor·f^(−slope), which multiplies the spectrum of
    acceleration [(m/s²)²/Hz]. A spectrum of displacement is first converted to a spectrum of acceleration, which is
    (2πf)⁴ times as large. The spectrum must consist of plain numbers.
    """
    factor, slope = law
    if not spectrum.is_accelerated:
        factor, slope = factor / DISPLACED[0], slope - DISPLACED[1]
    pieces = []
    for (f, density), (g, last) in pairwise(spectrum.points):
        if not (density and last):  # a density that underflowed to 0 has no logarithm
            continue
        own_slope = math.log(density / last) / math.log(g / f)
        if abs(own_slope) <= _STEEP_DENSITY_EXPONENT:
            pieces.append(PowerLawPiece(f, g, factor * density * f**own_slope, own_slope + slope))
            continue
        ends = np.geomspace(f, g, _STEEP_PIECE_COUNT + 1).tolist()
        for low, high in pairwise(ends):
            at_ends = (density * (low / f) ** -own_slope, density * (high / f) ** -own_slope)
            pieces.append(PowerLawPiece(low, high, factor * _mean(own_slope, low, high, *at_ends), slope))
    return tuple(pieces)


def _mean(slope: float, low: float, high: float, at_low: float, at_high: float) -> float:
    """Mean density of a power law f^(−slope) between the frequencies `low` and `high` [Hz].

    `at_low` and `at_high` are the densities at both ends.
    """
    return (at_high * high - at_low * low) / ((1 - slope) * (high - low))


def spectrum_parts(
    seen: SensorCases,
    spectrum: Spectrum,
    law: tuple[float, float],
    interval: float | None = None,
    delay: PerCase | None = None,
) -> Parts:
    """Mean squares of the Legendre parts of a motion or phase due to a vibration spectrum, (cases,) each.

    The power law `law` converts the vibration spectrum to the spectrum of the motion or phase, see `spectrum_pieces`.
    With an `interval` of exchanged pulses [s], the parts describe the phase that remains after synchronization. With
    a `delay` [s], they describe the change of the phase over this delay. Densities, intervals and delays may differ
    from case to case.
    """
    total = np.zeros((len(Parts._fields), seen.cases))
    for (of_group, exchanged), cases in seen.alike((spectrum, interval)):
        pieces, times = spectrum_pieces(of_group, law), seen.aperture_time[cases]
        if delay is None:
            of_pieces = left_parts(pieces, times, exchanged)
        else:
            of_pieces = heard_parts(pieces, times, np.broadcast_to(delay, (seen.cases,))[cases])
        total[:, cases] = of_pieces.rows
    return Parts(*total)


def vibration_spectrum(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield the random error of a vibration that the file specifies as a spectrum, or nothing if it does not.

    `name` is the name of the vibrating platform. The size of the error is a factor on the amplitude of the vibration;
    the declared size is 1. The unit is nevertheless `dB`, because the row of the error shows this factor in decibels,
    as for the noise of an oscillator.
    """
    vibration = seen.error(name).vibration
    if vibration.spectrum is None:
        return
    noise = spectrum_parts(seen, vibration.spectrum, DISPLACED)
    platform_index = PLATFORMS.index(name)
    x, y, z = (
        track / seen.exact.ranges[platform_index] for track in seen.exact.tracks[platform_index]
    )  # the line of sight, along which the platform vibrates
    published, full = seen.of_parts(noise.times(power_of(vibration)), seen.exact.along(platform_index, (x, y, z)))
    row_subject, kind = subject(name, VIBRATION_KIND.name, "spectrum"), VIBRATION_KIND
    moves: tuple[Moves, ...] = ()
    if seen.has_edge:  # along the line of sight of the centre: the file states no other motion
        way = seen.factor * seen.vector(getattr(seen.geometry, name).look)[None, :, None]
        courses = seen.courses(noise.times(power_of(vibration)).covariance)
        moves = (Moves(platform_index, way, courses),)
    yield RandomError(
        row_subject,
        kind.size(row_subject.axis).unit,
        1.0,
        (*kind.section(name), "spectrum"),
        published.times(seen.factor),
        full.times(seen.factor),
        moves=moves,
    )


def displacement_rms(spectrum: Spectrum, power: float = 1.0) -> float:
    """Rms displacement of a vibration over all frequencies of its spectrum. [m]

    `power` is a factor that multiplies the spectrum.
    """
    pieces = spectrum_pieces(spectrum, DISPLACED)
    return math.sqrt(power * math.fsum(piece.integral(piece.low, piece.high) for piece in pieces))


def pieces_of_vibration(mission: Mission, name: str) -> tuple[PowerLawPiece, ...]:
    """One-way phase spectrum of a platform's vibration along the line of sight, as power-law pieces. [rad²/Hz]

    `name` is the name of the platform. The file must state the vibration as a spectrum.
    """
    vibration = getattr(mission.platforms, name).motion_error.vibration
    k = 2 * math.pi / mission.radar.wavelength * float(counted(mission, name, 1.0, "islr"))
    factor, slope = DISPLACED
    return spectrum_pieces(vibration.spectrum, (factor * k**2 * float(power_of(vibration)), slope))
