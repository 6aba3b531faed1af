"""Errors of sensors and clocks: what one unit of a figure does to quadratic phase, cubic phase and ISLR, 1 sigma.

Biases of an inertial sensor are one error over the aperture, noise is another at every moment; both have a sigma and
no sign. Orders 0 and 1 of their range error displace the image by Q⁻¹, from order 2 on it defocuses. Biases and walks
of an inertial sensor count from mid-aperture on: position and velocity there are what aiding leaves, and the mission
declares them. A constant phase of a link moves nothing. To the published model the line of sight is that of
mid-aperture (`theory.random_errors`), and Q that of (25). The full model lets it turn, knows a direct path, and
counts what the displacement of the image adds.

Numbers of a mission may be arrays (cases,); its geometry then is that of these cases.
"""

import math
from collections.abc import Iterator, Sequence
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators
from bisar_budget.constants import ROUNDING
from bisar_budget.effects.declared import ImagePlane, published_planes
from bisar_budget.effects.effect import PLATFORMS, Subject, plain, subject
from bisar_budget.effects.oscillators import Noise, noise_of
from bisar_budget.effects.spectra import Floats, Parts, gauss_markov, link_parts, parts, synchronized_parts
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import BistaticGeometry, PlatformState, Vector
from bisar_budget.mission.instruments import IMU_KINDS, GaussMarkov, Oscillator
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import ExactRanges

_IMU_UNITS = dict(zip(IMU_KINDS, ("m/s^2", "1", "rad", "rad/s", "m/s/sqrt(s)", "rad/sqrt(s)"), strict=True))
_TILTS = ("attitude", "gyro_bias", "angle_random_walk")
_NODES = 16  # a walk has a covariance with an edge, which fewer nodes miss by a percent
# The covariance of a position error over the aperture grows as this power of the aperture time.
_GROWS = {
    "accelerometer_bias": 4,
    "accelerometer_scale_factor": 4,
    "attitude": 4,
    "gyro_bias": 6,
    "velocity_random_walk": 3,
    "angle_random_walk": 5,
}
_CANCELS = ROUNDING * 1e-2  # of a square: below it, its root is rounding
_LEADING = (1.0, 1.0, 1.5, 2.5)  # coefficient of xⁿ in the Legendre polynomial Pₙ: the order's value at the edge


class RandomEffect(NamedTuple):
    """Effect of a unit of an error: quadratic and cubic phase at the aperture edge, rms of what spreads. [rad/unit]

    `spread` is what is left of the phase after the cubic; it is a mean power, and no coverage factor is in it. `east`
    and `north` are the sigmas of the displacement [m/unit], not a number where it is not known, as of a free
    oscillator. `covariance` (4, 4, ...) is that of quadratic and cubic phase and displacement east and north, in the
    units of their products; no matrix where the published model has only their sizes.
    """

    quadratic: Any
    cubic: Any
    spread: Any
    east: Any
    north: Any
    covariance: Any = None

    @property
    def displacement(self) -> Any:
        """Root-mean-square length of the displacement. [m/unit]"""
        return np.hypot(self.east, self.north)

    def of(self, case: int) -> "RandomEffect":
        """That of a case in plain numbers; the covariance as (4, 4)."""
        covariance = self.covariance
        if covariance is not None:
            covariance = covariance[..., case if covariance.shape[-1] > 1 else 0]
        return RandomEffect._make((*(plain(size, case) for size in self[:5]), covariance))

    def times(self, factor: Any) -> "RandomEffect":
        """The same with phases and displacement of a coverage factor."""
        return RandomEffect(
            self.quadratic * factor,
            self.cubic * factor,
            self.spread,
            self.east * factor,
            self.north * factor,
            None if self.covariance is None else self.covariance * factor**2,
        )


class RandomError(NamedTuple):
    """One error of a sensor or a clock: what it is, how large it is declared, what one unit of it does.

    `declared` is the largest of the axes, coverage factor included, and all axes grow with it; None where the file is
    silent. The unit of an oscillator is `dB`: its noise as a factor of amplitude, declared 1. `noise` is the spectrum
    of an oscillator; not of many cases.
    """

    subject: Subject
    unit: str
    declared: Any
    path: KeyPath
    published: RandomEffect
    full: RandomEffect
    noise: Noise | None = None

    @property
    def id(self) -> str:
        """That of its row."""
        return self.subject.id

    @property
    def owner(self) -> str:
        """Whose share it counts against: transmitter, receiver or clock."""
        return self.subject.owner

    @property
    def extrapolated(self) -> Note:
        """How the noise of an oscillator goes on beyond what the file states."""
        return NOTHING if self.noise is None else self.noise.extrapolated

    def effect(self, model: str) -> RandomEffect:
        """Effect of a unit by a model."""
        return self.full if model == "full" else self.published


def random_errors(mission: Mission, geometry: BistaticGeometry | None = None, cases: int = 1) -> list[RandomError]:
    """List the errors of sensors and clocks that a mission names, in a fixed order; nothing for most.

    Of a platform with an inertial sensor every figure is listed, declared or not. `geometry` is that of many cases;
    without it all numbers are floats.
    """
    seen = _Seen(mission, geometry or mission.geometry, cases)
    found = [error for name in PLATFORMS for error in _of_imu(seen, name)]
    found += [error for name in PLATFORMS for error in _of_position(seen, name)]
    found += [error for name in PLATFORMS for error in _of_oscillator(seen, name)]
    found += _of_link(seen)
    return [in_one_case(mission, error) for error in found] if geometry is None else found


def process_of(mission: Mission, error: RandomError) -> GaussMarkov:
    """Process of an error that is correlated noise of a position."""
    motion: MotionError = getattr(mission.platforms, error.owner).motion_error
    return next(one for one in motion.random if one.name == error.subject.axis)


def displaces_unknown(error: RandomError) -> Any:
    """Whether an error displaces the image by an amount that the file leaves open, in which cases."""
    return False if error.declared is None else (error.declared > 0) & np.isnan(error.full.displacement)


def in_one_case(mission: Mission, error: RandomError, case: int = 0) -> RandomError:
    """An error in plain numbers, those of a case with its mission, and with the noise of an oscillator."""
    published, full = error.published.of(case), error.full.of(case)
    noise = None
    if error.subject.kind == "oscillator":
        oscillator: Oscillator = getattr(mission.platforms, error.owner).oscillator
        noise = noise_of(oscillator, mission.radar.center_frequency, mission.collection.aperture_time)
    declared = None if error.declared is None else plain(error.declared, case)
    return error._replace(declared=declared, published=published, full=full, noise=noise)


class _Seen:
    """Cases as their sensors and clocks see them: numbers are arrays (…, cases)."""

    def __init__(self, mission: Mission, geometry: BistaticGeometry, cases: int) -> None:
        self.mission, self.geometry, self.cases = mission, geometry, cases
        self.sights = geometry.sights(has_direct_path=mission.has_direct_path)
        self.factor = mission.allocation.coverage_factor
        self.aperture_time = np.broadcast_to(np.asarray(mission.collection.aperture_time), (cases,))

    def vector(self, values: Sequence[Any]) -> Floats:
        """Three numbers for each case, (3, cases)."""
        found = np.empty((3, self.cases))
        for row, value in zip(found, values, strict=True):
            row[:] = value
        return found

    def error(self, name: str) -> MotionError:
        """The motion error of a platform."""
        found: MotionError = getattr(self.mission.platforms, name).motion_error
        return found

    def axes(self, name: str) -> Floats:
        """Axes of a platform's errors, (axes, 3, cases)."""
        path: PlatformState = getattr(self.geometry, name)
        return np.array([self.vector(axis) for axis in path.frame(self.error(name).frame)])

    def along(self, name: str, directions: Floats) -> tuple[Floats, Floats]:
        """Root-sum-square of what directions (axes, 3, cases) have of the line of sight, and of what data hear."""
        look, sight = getattr(self.geometry, name).look, self.sights[PLATFORMS.index(name)]
        seen = _length_along(self.vector(look), directions)
        return seen, seen if sight is look else _length_along(self.vector(sight), directions)

    @cached_property
    def exact(self) -> ExactRanges:
        """Exact ranges at as many nodes as walks need."""
        mission = self.mission
        return ExactRanges.of(
            self.geometry.both,
            mission.radar.wavelength,
            mission.collection.aperture_time,
            _NODES,
            self.cases,
            has_direct_path=mission.has_direct_path,
        )

    @cached_property
    def weights(self) -> Floats:
        """What a metre of range error at each node does, (4, nodes, cases): two phases [rad], east and north. [m]"""
        return np.array((*self.exact.phase_weights, *self.exact.place_weights))

    @cached_property
    def plane(self) -> ImagePlane:
        """Q⁻¹ of the published model."""
        return published_planes(self.geometry)[0]

    def moved(self, constant: Any, linear: Any) -> list[Any]:
        """Sigmas of the displacement by (25), of mean squares of constant and linear part at the edge [m²]. [m]"""
        (a, b), (c, d) = self.plane.adjugate
        slope = linear / np.square(self.aperture_time / 2)
        scale = 1 / np.where(self.plane.is_singular, math.nan, self.plane.determinant)
        return [np.sqrt(one**2 * constant + other**2 * slope) * np.abs(scale) for one, other in ((a, b), (c, d))]

    def of_orders(self, covariance: Floats, along: Any = 1.0) -> Floats:
        """Covariance (4, 4, cases) of phases and displacement by orders 0 to 3 of independent range errors.

        `covariance` (4, 4, cases) is that of each at the aperture edge [m²], `along` (errors, nodes, cases) what a
        metre of it does to the range; higher orders defocus and displace in second order of a turning line of sight.
        """
        places = self.exact.sampling.places
        orders = np.polynomial.legendre.legvander(places, len(_LEADING) - 1) / _LEADING
        seen = np.broadcast_to(along, (np.shape(along)[0] if np.ndim(along) else 1, places.size, self.cases))
        effects = np.einsum("fnc,anc,no->afoc", self.weights, seen, orders)
        return np.asarray(np.einsum("afoc,opc,agpc->fgc", effects, covariance, effects))


def _length_along(sight: Floats, directions: Floats) -> Floats:
    return np.asarray(np.sqrt(np.square((directions * sight).sum(axis=1)).sum(axis=0)))


def _parts_of_largest(values: Floats) -> tuple[Floats, Floats]:
    """The largest of values (axes, cases), and each over it; 1 where there is none."""
    largest = values.max(axis=0)
    return largest, np.divide(values, largest, out=np.ones_like(values), where=largest > 0)


# ---------------------------------------------------------------------- inertial sensors
def specific_force(mission: Mission, state: PlatformState) -> Vector:
    """Specific force of a platform, f = a − g, which accelerometers measure, in the axes of the scene. [m/s²]

    Where it falls freely that is nothing. On the Earth g has what its rotation adds (`earth.free_fall`).
    """
    from bisar_budget.paths.earth import free_fall  # 8 ms, and most missions name no sensor

    x, y, z = state.acceleration
    u, v, w = free_fall(state.position, state.velocity, mission.scene.axes)
    return (x - u, y - v, z - w)


def acceleration_errors(kind: str, axes: Floats, force: Floats) -> Floats:
    """Acceleration error by a unit of a figure about, or along, each axis, (axes, 3, ...), of those axes.

    A tilt turns what accelerometers measure, the specific force (3, ...); a scale factor is a part of it. What is an
    acceleration is one. [m/s²/unit]
    """
    if kind in _TILTS:
        return np.asarray(np.cross(axes, force, axisa=1, axisb=0, axisc=1))
    if kind == "accelerometer_scale_factor":
        return np.asarray(axes * (axes * force).sum(axis=1, keepdims=True))
    return axes


def _of_imu(seen: _Seen, name: str) -> Iterator[RandomError]:
    error = seen.error(name)
    if error.imu is None:
        return
    axes = seen.axes(name)
    force = seen.vector(specific_force(seen.mission, getattr(seen.geometry, name)))
    for index, (kind, unit) in enumerate(_IMU_UNITS.items()):
        values, key = getattr(error.imu, kind), error.key_of(kind)
        directions, declared = acceleration_errors(kind, axes, force), None
        if values is not None:
            declared, sizes = _parts_of_largest(seen.vector(values))
            directions = directions * sizes[:, None]
        along, along_heard = seen.along(name, directions)
        row = heard = _at_mid_aperture(seen.mission, index, along)
        if along_heard is not along:
            heard = _at_mid_aperture(seen.mission, index, along_heard)
        (quadratic, cubic, east, north), covariance = _over_aperture(seen, PLATFORMS.index(name), kind, directions)
        yield RandomError(
            subject=subject(name, "imu", kind),
            unit=unit,
            declared=None if declared is None else declared * seen.factor,
            path=("platforms", name, "motion_error", *(("imu", kind) if key == kind else (key,))),
            published=RandomEffect(row[0], row[1], row[2] / seen.factor, *_moved_by_imu(seen, kind, along)),
            full=RandomEffect(quadratic, cubic, heard[2] / seen.factor, east, north, covariance),
        )


def _at_mid_aperture(mission: Mission, index: int, along: Any) -> tuple[Any, ...]:
    """Quadratic and cubic phase of a unit, and what is left, along so much of the line of sight. [rad]"""
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    return evaluators.inertial_phases(along, along, along, wavelength, T)[index]


def _moved_by_imu(seen: _Seen, kind: str, along: Floats) -> list[Any]:
    """Sigmas of the displacement by a unit along so much of the line of sight of mid-aperture. [m]"""
    fit = seen.exact.fit[:2]
    constant, linear = np.diagonal(fit @ _covariance_at_nodes(kind) @ fit.T)
    scale = along**2 * seen.exact.half ** _GROWS[kind]
    return seen.moved(constant * scale, linear * scale)


def _over_aperture(seen: _Seen, place: int, kind: str, directions: Floats) -> tuple[Floats, Floats]:
    """Sigmas by a unit over the exact paths: of quadratic and cubic phase [rad], of displacement east and north. [m]

    And their covariance, (4, 4, cases). That over the aperture is that over an aperture of 2 s, times a power of half
    the aperture time.
    """
    x, y, z = np.moveaxis(directions, 1, 0)[:, :, None]
    moved = seen.weights[:, None] * seen.exact.along(place, (x, y, z))  # (4, axes, nodes, cases)
    of_unit, scale = _covariance_at_nodes(kind), seen.exact.half ** _GROWS[kind]
    covariance = np.einsum("fanc,ganc->fgc", moved, of_unit @ moved)
    sizes = np.square((np.abs(moved) * np.sqrt(np.diagonal(of_unit))[:, None]).sum(axis=2)).sum(axis=1)
    return _sigmas(covariance * scale, sizes * scale)


def _sigmas(covariance: Floats, sizes: Floats) -> tuple[Floats, Floats]:
    """Roots of the diagonal of a covariance (4, 4, cases), and that covariance.

    What is left of terms that cancel exactly, of squares of so large `sizes` (4, cases), is rounding, and would make
    a limit out of nothing.
    """
    squares = np.einsum("ffc->fc", covariance)
    is_real = squares > _CANCELS * sizes
    return np.sqrt(np.where(is_real, squares, 0.0)), np.where(is_real & is_real[:, None], covariance, 0.0)


@cache
def _covariance_at_nodes(kind: str) -> Floats:
    """Covariance of the position error of a unit acceleration, or its noise, at the nodes of 2 s. [m²/unit²]

    The error is zero at mid-aperture.
    """
    times = evaluators.LEGENDRE_FITS[_NODES][0]
    if not kind.endswith("random_walk"):
        order = 3 if kind == "gyro_bias" else 2
        history = np.array(times) ** order / math.factorial(order)
        return np.multiply.outer(history, history)
    walk = _velocity_walk if kind == "velocity_random_walk" else _angle_walk
    return np.array([[walk(*sorted((abs(s), abs(t)))) if s * t > 0 else 0.0 for t in times] for s in times])


def _velocity_walk(early: float, late: float) -> float:
    """White acceleration of density 1, twice integrated from zero: ∫(early − w)(late − w) dw."""
    return early**2 * (3 * late - early) / 6


def _angle_walk(early: float, late: float) -> float:
    """White rate of a tilt of density 1, three times integrated: ∫(early − w)²(late − w)²/4 dw."""
    lag = late - early
    return (early**5 / 5 + lag * early**4 / 2 + lag**2 * early**3 / 3) / 4


# ---------------------------------------------------------------------- position noise
def _of_position(seen: _Seen, name: str) -> Iterator[RandomError]:
    error = seen.error(name)
    if not error.random:
        return
    k, axes, key = 2 * math.pi / seen.mission.radar.wavelength, seen.axes(name), error.key_of("random")
    for index, process in enumerate(error.random):
        largest, sizes = _parts_of_largest(seen.vector(process.sigma))
        directions = axes * sizes[:, None]
        found = gauss_markov(seen.aperture_time, process.correlation_time)
        along, along_heard = seen.along(name, directions)
        seen_along = seen.exact.along(PLATFORMS.index(name), tuple(np.moveaxis(directions, 1, 0)[:, :, None]))
        covariance = seen.of_orders(_of_cases(found.covariance, seen.cases), seen_along)
        quadratic, cubic, left = (np.sqrt(one) for one in found[:3])
        (own, own_cubic, east, north), covariance = _sigmas(covariance, np.einsum("ffc->fc", covariance))
        yield RandomError(
            subject=subject(name, "random", process.name),
            unit="m",
            declared=largest * seen.factor,
            path=("platforms", name, "motion_error", *((key, index, "sigma") if key == "random" else (key,))),
            published=RandomEffect(
                k * along * quadratic,
                k * along * cubic,
                k * along * left / seen.factor,
                *seen.moved(found.constant * along**2, found.linear * along**2),
            ),
            full=RandomEffect(own, own_cubic, k * along_heard * left / seen.factor, east, north, covariance),
        )


def _of_cases(covariance: Floats, cases: int) -> Floats:
    """The same as (4, 4, cases)."""
    whole = covariance if covariance.ndim == 3 else covariance[..., None]
    return np.broadcast_to(whole, (*whole.shape[:2], cases))


# ---------------------------------------------------------------------- oscillators and their link
def _of_oscillator(seen: _Seen, name: str) -> Iterator[RandomError]:
    mission, sync = seen.mission, seen.mission.synchronization
    oscillator: Oscillator | None = getattr(mission.platforms, name).oscillator
    if oscillator is None:
        return
    found = np.zeros((len(Parts._fields), seen.cases))
    if sync is None or not sync.is_direct_path:
        interval = None if sync is None else sync.interval
        for (alike, each), places in _groups_alike((oscillator, interval), seen.cases):
            found[:, places] = _parts_at_1_hz(alike, each, seen.aperture_time[places])
    published, full = _of_clock(seen, Parts(*found * mission.radar.center_frequency**2))
    key = ("platforms", name, "oscillator")
    path = key if oscillator.sensor is None else (*key, "sensor")
    yield RandomError(
        subject(name, "oscillator"), "dB", 1.0, path, published.times(seen.factor), full.times(seen.factor)
    )


def _of_clock(seen: _Seen, found: Parts) -> tuple[RandomEffect, RandomEffect]:
    """Effects by both models of a phase with these parts [rad²]; those of orders 0 and 1 where they are known.

    Where the file states both terms of the clock, these stand for what displaces.
    """
    k, timing = 2 * math.pi / np.asarray(seen.mission.radar.wavelength), seen.mission.timing_error
    quadratic, cubic, spread = (np.sqrt(one) for one in found[:3])
    is_stated = timing.constant is not None and timing.linear is not None
    is_known = np.isfinite(found.constant + found.linear)
    nothing = np.where(is_stated | (quadratic + cubic == 0), 0.0, math.nan)
    counts = is_known & ~np.asarray(is_stated)
    with np.errstate(invalid="ignore"):
        square = 1 / k**2
        covariance = _of_cases(np.where(counts, found.covariance * square, 0.0), seen.cases)
        east, north = (
            np.where(counts, one, nothing) for one in seen.moved(found.constant * square, found.linear * square)
        )
    published = RandomEffect(quadratic, cubic, spread, east, north)
    whole = seen.of_orders(covariance)
    (*phases, east, north), whole = _sigmas(whole, np.einsum("ffc->fc", whole))
    own = np.zeros_like(whole)
    own[0, 0], own[1, 1] = quadratic**2, cubic**2
    quadratic, cubic, east, north = (
        np.where(counts, *both)
        for both in zip((*phases, east, north), (quadratic, cubic, nothing, nothing), strict=True)
    )
    return published, RandomEffect(quadratic, cubic, spread, east, north, np.where(counts, whole, own))


def _parts_at_1_hz(oscillator: Oscillator, interval: float | None, aperture_time: Floats) -> Floats:
    """Parts of the phase of an oscillator at 1 Hz, or of what exchanged pulses leave of it: they grow as f₀²."""
    times, place = np.unique(aperture_time, return_inverse=True)
    spectra: dict[Any, list[int]] = {}
    for index, T in enumerate(times.tolist()):  # an Allan deviation may be fitted otherwise over another aperture
        spectra.setdefault(noise_of(oscillator, 1.0, T).pieces, []).append(index)
    found = np.zeros((len(Parts._fields), times.size))
    for pieces, some in spectra.items():
        of_them = times[some]
        found[:, some] = parts(pieces, of_them) if interval is None else synchronized_parts(pieces, of_them, interval)
    return found[:, place]


def _of_link(seen: _Seen) -> Iterator[RandomError]:
    """Each exchange is wrong by an error of its own, and straight lines join them."""
    sync = seen.mission.synchronization
    if sync is None:
        return
    found = np.zeros((len(Parts._fields), seen.cases))
    if sync.interval is None:  # from pulse to pulse: all of it spreads
        found[Parts._fields.index("left")] = 1.0
    else:
        for interval, places in _groups_alike(sync.interval, seen.cases):
            times, place = np.unique(seen.aperture_time[places], return_inverse=True)
            found[:, places] = np.array(link_parts(times, interval))[:, place]
    # A constant phase moves nothing.
    published, full = _of_clock(
        seen, Parts(*found)._replace(constant=0.0 * found[0], constant_quadratic=0.0 * found[0])
    )
    published, full = (one._replace(spread=one.spread / seen.factor) for one in (published, full))
    what = subject("clock", "synchronization")
    yield RandomError(what, "rad", sync.error * seen.factor, ("synchronization", "error"), published, full)


def _groups_alike(value: Any, cases: int) -> Iterator[tuple[Any, NDArray[np.intp]]]:
    """Tell apart the cases in which a value, or what is in it, differs: the value of each group, and its cases."""
    arrays = list(_arrays_in(value))
    if not arrays:
        yield value, np.arange(cases)
        return
    rows, group = np.unique(np.stack(arrays, axis=1), axis=0, return_inverse=True)
    for place, row in enumerate(rows.tolist()):
        yield _with_numbers(value, iter(row)), np.flatnonzero(group.ravel() == place)


def _arrays_in(value: Any) -> Iterator[Floats]:
    if isinstance(value, tuple):
        for part in value:
            yield from _arrays_in(part)
    elif isinstance(value, np.ndarray):
        yield value


def _with_numbers(value: Any, numbers: Iterator[float]) -> Any:
    """The same with numbers in the places of its arrays."""
    if isinstance(value, tuple):
        parts = [_with_numbers(part, numbers) for part in value]
        return value._make(parts) if hasattr(value, "_make") else tuple(parts)
    return next(numbers) if isinstance(value, np.ndarray) else value
