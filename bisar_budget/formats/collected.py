"""Data that are imported from a radar file (scene, band, aperture, paths, errors), and the resulting mission file.

Slow time is the time at which a pulse is at the scene point. The pulse leaves the transmitter R_t/c earlier and
reaches the receiver R_r/c later, where R_t and R_r are the slant ranges. At a slow time, the path of the transmitter
gives the transmitter's position at the transmission of the pulse, and the path of the receiver gives the receiver's
position at its reception. The sum of both ranges at a slow time is therefore the range sum of that pulse.

`ErrorParameters` of CPHD 1.1.0 and `ErrorStatistics` of SICD, volume 1, state sigmas of position and velocity, P1 to
V3, with their correlations. CRSD 1.0 and the bistatic part of SICD state covariance matrices. SICD, volume 3, defines
the frames of the errors. ECF is fixed to the Earth. RIC_ECF has radial, in-track and cross-track axes, which are
computed with the velocity relative to the rotating Earth. RIC_ECI has the same axes, computed with the inertial
velocity; a mission file calls it `ric`.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from textwrap import wrap

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.error_kinds.clock_kinds import TIMING_KIND
from bisar_budget.error_kinds.path_kinds import ACCELERATION_KIND, MEASURED_KINDS, STATE_KINDS
from bisar_budget.faults import printable
from bisar_budget.formats.containers import Element
from bisar_budget.geometry import (
    FRAME_AXES,
    STRAIGHT,
    Axes,
    PlatformState,
    Vector,
    cross,
    dot,
    norm,
    plain_vector,
    unit,
)
from bisar_budget.json_types import JsonDocument, JsonObject
from bisar_budget.paths.accuracy import with_rate
from bisar_budget.paths.earth import Floats, Geodetic, SceneAxes
from bisar_budget.paths.flight import Fitted, least_squares, path_of, powers_of
from bisar_budget.paths.free_fall import fall_of

MIN_FIT_PULSES = 5  # smallest number of pulses in the aperture to which a path is fitted
MAX_APERTURE_S = 1e6  # largest aperture time, and largest time from the file's start to the middle
MAX_PLATFORM_DISTANCE_M = 1e9  # a mission file accepts no larger distance
_MAX_PATH_ORDER = 4  # of a path that a mission states: up to the snap
_FIT_TOLERANCE_FRACTION = 1e-3  # of a wavelength: 0.4° of phase, a hundredth of the usual budget of 45°
_ROUNDING_M = 1e-7  # a term that moves the path by less at the end of the aperture is rounding
_BETTER_FIT_FRACTION = 0.9  # of the residual; an order with a larger residual fits noise


# Added parameters that become keys of a mission, of a platform and of the clock error.
_BIASES = tuple(f"{kind.name}.bias" for kind in STATE_KINDS)
_READ_OF_PLATFORMS = ("position", "velocity", "acceleration", "distribution", *_BIASES)
_READ_OF_TIMING = ("quadratic", "cubic", *(f"{term}.bias" for term in TIMING_KIND.sizes))


class NoPathError(ValueError):
    """The positions in a radar file are too few, or out of range, so that no path can be fitted to them."""


@dataclass(frozen=True)
class DeclaredMotionError:
    """Standard deviations of the errors in one platform's measured path, along the axes of a frame of the mission.

    `position` [m], `velocity` [m/s] and `acceleration` [m/s²] have one sigma for each axis, or are None if not
    declared. `correlation` contains the correlations (6, 6) of position and velocity; it is empty if they are
    uncorrelated. `distribution` is the name of the distribution, as written in a mission file, or the names for
    position, velocity and acceleration. `biases` are the biases by the kind of error.
    """

    frame: str
    position: Vector | None
    velocity: Vector | None
    correlation: tuple[tuple[float, ...], ...] = ()
    acceleration: Vector | None = None
    distribution: str | tuple[str, ...] = "normal"
    biases: Mapping[str, Vector] = field(default_factory=dict)

    @property
    def is_isotropic(self) -> bool:
        """Whether the error is the same in all directions and has no correlations."""
        return not self.correlation and all(
            kind is None or max(kind) - min(kind) <= 1e-9 * max(kind) for kind in (self.position, self.velocity)
        )


@dataclass(frozen=True)
class ReferenceGeometry:
    """Slow time [s], slant ranges [m] and bistatic angle [rad] at the reference pulse or time of a radar file."""

    slow_time: float
    transmitter_range: float
    receiver_range: float
    bistatic_angle: float


@dataclass(frozen=True)
class FileErrors:
    """Errors that a radar file declares: motion errors of each platform or of both in common, and clock errors.

    `timing_constant` is the standard deviation of the delay [s]. `timing_linear` is the standard deviation of the
    relative difference of the clock frequencies. `timing_added` contains the figures of the clock error that are in
    added parameters: sizes by `quadratic` and `cubic`, and biases by `constant.bias` and so on. `remarks` explain how
    the errors were converted, and what could not be expressed with the keys of a mission. `at` is the XML path of the
    errors.
    """

    transmitter: DeclaredMotionError | None = None
    receiver: DeclaredMotionError | None = None
    common: DeclaredMotionError | None = None
    timing_constant: float | None = None
    timing_linear: float | None = None
    at: str = ""
    remarks: tuple[str, ...] = ()
    timing_added: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Imported:
    """Scene, band, aperture, paths and errors that are read from a radar file.

    If `is_monostatic`, transmitter and receiver are the same platform, so that its errors are the same for
    transmission and reception. `remarks` are sentences for the reader of the mission file. `unused` is a remark on
    the vectors (records of pulses) of the file that are not used; it is empty if all vectors are used.
    """

    file: str
    format: str
    xml_sha256: str
    channel: str
    name: str
    scene: Geodetic
    center_frequency: float
    bandwidth: float
    aperture_time: float
    center_time: str | None
    transmitter: Fitted
    receiver: Fitted
    is_monostatic: bool
    reference: ReferenceGeometry | None
    errors: FileErrors
    remarks: tuple[str, ...] = ()
    unused: str = ""


@dataclass(frozen=True)
class Seen:
    """Paths of both platforms as polynomials of slow time, and the scene axes in which they are given."""

    transmitter: Fitted
    receiver: Fitted
    axes: SceneAxes


def reference_of(seen: Seen, slow_time: float) -> ReferenceGeometry:
    """Compute the slant ranges [m] and the bistatic angle [rad] at a slow time [s] from the fitted paths."""
    t, r = (track.state.at(slow_time)[0] for track in (seen.transmitter, seen.receiver))
    angle = math.atan2(norm(cross(unit(t), unit(r))), dot(unit(t), unit(r)))
    return ReferenceGeometry(slow_time, float(norm(t)), float(norm(r)), angle)


def fitted(times: Floats, positions: Floats, aperture_time_s: float, wavelength_m: float) -> Fitted:
    """Fit a polynomial path to the positions within the aperture, by least squares.

    The order of the polynomial is the lowest at which no position is farther from the path than 1/1000 of the
    wavelength, so that the phase error is negligible. The highest order is 4, because a mission states position,
    velocity, acceleration, jerk and snap. If even this order is not sufficient, the function takes the lowest order
    whose rms residual is at most 1/0.9 times the rms residual of the highest order. The residuals are then position
    noise, or motion that is faster than such a polynomial.

    `times` (n,) are slow times in seconds; `positions` (n, 3) are in metres along the axes of the scene.

    Raises
    ------
    NoPathError
        There are fewer than five positions within the aperture, a position is farther away than a mission file
        accepts, or the aperture time is not positive or too long.
    """
    if not 0 < aperture_time_s <= MAX_APERTURE_S:
        raise NoPathError(f"an aperture of {aperture_time_s:g} s is none; accepted: up to {MAX_APERTURE_S:g} s")
    half = aperture_time_s / 2
    inside = np.abs(times) <= half * (1 + 1e-9)
    count = int(inside.sum())
    if count < MIN_FIT_PULSES:
        raise NoPathError(
            f"{count} pulses are in the aperture of {aperture_time_s:g} s, at least {MIN_FIT_PULSES} are needed"
        )
    if not float(np.abs(positions[inside]).max()) <= MAX_PLATFORM_DISTANCE_M:
        raise NoPathError(
            f"a platform is farther than {MAX_PLATFORM_DISTANCE_M:g} m from the scene point, or nowhere"
        )
    scaled_times, positions_inside = times[inside] / half, positions[inside]
    mean_position = positions_inside.mean(axis=0)  # subtracted, so that rounding is relative to the small differences
    fits = []
    for order in range(1, min(_MAX_PATH_ORDER, count - 2) + 1):
        coefficients, residuals = least_squares(scaled_times, positions_inside - mean_position, order)
        distances = np.linalg.norm(residuals, axis=1)
        fits.append((coefficients, float(distances.max()), float(np.sqrt(np.mean(distances**2)))))
        if fits[-1][1] <= _FIT_TOLERANCE_FRACTION * wavelength_m:
            break
    best_fit = fits[-1]
    if best_fit[1] > _FIT_TOLERANCE_FRACTION * wavelength_m:
        best_fit = next(fit for fit in fits if fit[2] * _BETTER_FIT_FRACTION <= best_fit[2])
    coefficients, farthest, rms = best_fit
    order = len(coefficients) - 1
    powers = powers_of(coefficients, half)
    powers[1:][np.abs(powers[1:]) * half ** np.arange(1, order + 1)[:, None] < _ROUNDING_M] = 0.0
    powers[0] += mean_position
    powers[0][np.abs(powers[0]) < _ROUNDING_M] = 0.0
    return Fitted(path_of(powers), order, farthest, rms, count)


# ---------------------------------------------------------------------- errors that a file declares
SIGMA_NAMES = ("P1", "P2", "P3", "V1", "V2", "V3")
MISSION_FRAMES = {"ECF": "scene", "RIC_ECF": "ric", "RIC_ECI": "ric"}
ADDED = "bisar-budget"  # prefix of the names that this program adds
_MAX_SIGMAS = (1e9, 1e6)  # position [m] and velocity [m/s] that a mission file takes
_MIN_CORRELATION_FRACTION = 1e-6  # a smaller correlation is rounding of a turned covariance
_EIGENVALUE_TOLERANCE_FRACTION = 2.5e-6  # of an eigenvalue of correlations that are written with six decimals


def sigmas_and_correlations(element: Element) -> Floats:
    """Read the covariance (6, 6) of position and velocity from a `PosVelErr` element. [m², m²/s, m²/s²]"""
    sigmas = np.array([element.number(kind) for kind in SIGMA_NAMES])
    if sigmas.min() < 0:
        raise element.fault("has a negative sigma")
    _require_size(sigmas, element)
    correlation = np.eye(6)
    coefficients = element.maybe("CorrCoefs")
    if coefficients is not None:
        for row in range(6):
            for column in range(row + 1, 6):
                value = coefficients.number(SIGMA_NAMES[row] + SIGMA_NAMES[column])
                if abs(value) > 1:
                    raise coefficients.fault("must be within ±1", SIGMA_NAMES[row] + SIGMA_NAMES[column])
                correlation[row, column] = correlation[column, row] = value
    covariance: Floats = np.outer(sigmas, sigmas) * correlation
    return covariance


def _require_size(sigmas: Floats, element: Element) -> None:
    """Raise `FormatError` if sigmas (6,) of position or velocity are larger than a mission file accepts."""
    for kind, largest, written in zip((sigmas[:3], sigmas[3:]), _MAX_SIGMAS, ("m", "m/s"), strict=True):
        if kind.max() > largest:
            raise element.fault(f"has a sigma of {kind.max():.3g} {written}, more than {largest:g} {written}")


def correlated(covariance: Floats) -> tuple[Floats, Floats]:
    """Split a covariance (n, n) into sigmas (n,) and correlations (n, n).

    The correlations of a component whose sigma is 0 are set to 0, also on the diagonal.
    """
    sigmas = np.sqrt(np.clip(np.diag(covariance), 0, None))
    scale = np.outer(sigmas, sigmas)
    return sigmas, np.clip(covariance / np.where(scale > 0, scale, 1.0), -1, 1)


def declared(
    covariance: Floats, frame: Element, state: PlatformState, axes: SceneAxes, owner: str
) -> tuple[DeclaredMotionError, list[str]]:
    """Convert the errors of one platform from the frame of a radar file to a frame of a mission file.

    `covariance` (6, 6) is the covariance of position and velocity in the frame that the element `frame` names. Errors
    in ECF are rotated to the axes of the scene. RIC_ECI is the frame `ric` of a mission, and needs no rotation.
    Errors in RIC_ECF are rotated about the radial axis to `ric`; for a platform in free fall, their velocities are
    also converted to inertial velocities. Returns the errors, and remarks that describe the conversion. If the
    converted errors have no correlations, their `correlation` is empty.
    """
    name = frame.text()
    _require_size(np.sqrt(np.abs(covariance).max(axis=1)), frame)
    if name not in MISSION_FRAMES:
        raise frame.fault(f"must be one of {', '.join(MISSION_FRAMES)} (got {name!r})")
    target = (
        state.frame("scene")
        if name == "ECF"
        else axes.radial(plain_vector(state.position), plain_vector(state.velocity))
    )
    source = _axes_of(name, state, axes)
    turn: Floats = np.array(target) @ np.array(source).T  # from the file's frame into the mission's frame
    turn_of_both = np.kron(np.eye(2), turn)
    turned = turn_of_both @ covariance @ turn_of_both.T
    if name == "RIC_ECF" and (fall := fall_of(state, axes)) is not None:
        turned = with_rate(
            turned, np.array(target) @ np.array(fall.rotation)
        )  # `ric` has velocities against the stars
    remarks = []
    if name != "RIC_ECI" and covariance.any():
        target_axes = (
            "east, north, up" if name == "ECF" else "ric, whose in-track holds the velocity against the stars"
        )
        remarks.append(f"Errors of the {owner} are stated in {name}; they are turned into {target_axes}.")
    sigmas, correlation = correlated(turned)
    np.fill_diagonal(correlation, 1.0)
    if float(np.linalg.eigvalsh(correlation).min()) < -_EIGENVALUE_TOLERANCE_FRACTION:
        remarks.append(
            f"Correlations of the errors of the {owner} are those of no covariance (not positive semi-definite); "
            "they are left out, the sigmas stay."
        )
        correlation = np.eye(6)
    is_correlated = bool((np.abs(correlation - np.eye(6)) > _MIN_CORRELATION_FRACTION).any())
    x, y, z, u, v, w = (float(sigma) for sigma in sigmas)
    rows = tuple(tuple(float(value) for value in row) for row in correlation) if is_correlated else ()
    return DeclaredMotionError(MISSION_FRAMES[name], (x, y, z), (u, v, w), rows), remarks


def _axes_of(name: str, state: PlatformState, axes: SceneAxes) -> Axes:
    """Unit vectors of the frame `name` (ECF, RIC_ECF or RIC_ECI) of a radar file, in the axes of the scene."""
    if name == "ECF":
        x, y, z = zip(*axes.axes, strict=True)
        return x, y, z
    if name == "RIC_ECI":
        return axes.radial(plain_vector(state.position), plain_vector(state.velocity))
    radial = unit(axes.turned(axes.earth_fixed(plain_vector(state.position))))
    across = unit(cross(radial, state.velocity))
    return radial, cross(across, radial), across


def of_sigmas(parameters: Element | None, seen: Seen, *, is_monostatic: bool) -> FileErrors:
    """Read the errors that `ErrorParameters` of CPHD or `ErrorStatistics` of SICD states as sigmas.

    `parameters` is the element with this name. If it is None, or has no errors that a mission can express, the result
    contains only a remark to this effect.
    """
    if parameters is None:
        return FileErrors(remarks=("The file declares no errors (ErrorParameters).",))
    mono = parameters.maybe("Monostatic") or (parameters.maybe("Components") if is_monostatic else None)
    if mono is not None and mono.maybe("PosVelErr") is not None:
        return _of_monostatic(mono, seen)
    both = parameters.maybe("Bistatic")
    if both is not None:
        return _of_bistatic(both, seen)
    return FileErrors(
        at=parameters.path, remarks=(f"{parameters.path} declares no component that a mission has a key for.",)
    )


def _of_monostatic(mono: Element, seen: Seen) -> FileErrors:
    error = mono.one("PosVelErr")
    declared_error, remarks = declared(
        sigmas_and_correlations(error), error.one("Frame"), seen.transmitter.state, seen.axes, "platform"
    )
    remarks += _decorrelation(error, "position")
    constant = None
    sensor = mono.maybe("RadarSensor")
    if sensor is not None:
        remarks += _unused_of_sensor(sensor, ("ClockFreqSF", "TransmitFreqSF", "CollectionStartTime"), "RadarSensor")
        if sensor.maybe("RangeBias") is not None:
            constant = 2 * sensor.number("RangeBias") / SPEED_OF_LIGHT_MPS
            remarks.append("timing_error.constant is 2 RangeBias/c: the range of a monostatic file is half the way.")
            remarks += _decorrelation(sensor, "range bias")
    for name in ("TropoError", "IonoError"):
        if (delay_error := mono.maybe(name)) is not None:
            values = (f"{child.tag} = {child.number():.6g}" for child in delay_error.all("*") if not len(child.node))
            remarks.append(f"{name} has no key in a mission: {', '.join(values)}")
    return replace(_common(declared_error, remarks), timing_constant=constant, at=mono.path)


def _common(declared_error: DeclaredMotionError, remarks: list[str]) -> FileErrors:
    """Convert the errors of a monostatic file, in which one platform transmits and receives.

    Errors that are the same along all axes become errors common to transmitter and receiver. Other errors are stated
    once for the transmitter and once for the receiver, with a remark that they have to be added.
    """
    if declared_error.is_isotropic:
        remarks.append(
            "One platform transmits and receives, with the same error: it is that of common_motion_error. Its frame "
            "does not matter, since it is alike along each axis."
        )
        return FileErrors(common=replace(declared_error, frame="scene"), remarks=tuple(remarks))
    remarks.append(
        "One platform transmits and receives: the errors below are the same on both ways, and add. `combine: sum` "
        "judges them together; `rss` would take them for independent."
    )
    return FileErrors(transmitter=declared_error, receiver=declared_error, remarks=tuple(remarks))


def _of_bistatic(bistatic: Element, seen: Seen) -> FileErrors:
    declared_errors: dict[str, DeclaredMotionError | None] = {"transmitter": None, "receiver": None}
    remarks: list[str] = []
    values: dict[str, list[float]] = {"ClockFreqSF": [], "DelayBias": []}
    for owner, name in (("transmitter", "TxPlatform"), ("receiver", "RcvPlatform")):
        platform = bistatic.maybe(name)
        if platform is None:
            remarks.append(f"The file declares no errors of the {owner}.")
            continue
        error = platform.one("PosVelErr")
        declared_errors[owner], added_remarks = declared(
            sigmas_and_correlations(error), error.one("Frame"), getattr(seen, owner).state, seen.axes, owner
        )
        remarks += [*added_remarks, *_decorrelation(error, f"position of the {owner}")]
        sensor = platform.maybe("RadarSensor")
        if sensor is not None:
            remarks += _unused_of_sensor(sensor, ("CollectionStartTime",), f"{name}/RadarSensor")
            for key, sigmas in values.items():
                if sensor.maybe(key) is not None:
                    sigmas.append(sensor.number(key))
    clocks, delays = values.values()
    declared_errors, timing_added, added_remarks = _with_added(bistatic, declared_errors)
    if clocks:
        remarks.append(
            "timing_error.linear is the root sum square of ClockFreqSF of both platforms: a receiver whose clock is "
            "off by a factor counts a delay that grows with slow time."
        )
    if delays:
        remarks.append("timing_error.constant is the root sum square of DelayBias of both platforms.")
    return FileErrors(
        transmitter=declared_errors["transmitter"],
        receiver=declared_errors["receiver"],
        timing_constant=math.hypot(*delays) if delays else None,
        timing_linear=math.hypot(*clocks) if clocks else None,
        timing_added=timing_added,
        at=bistatic.path,
        remarks=tuple(remarks + added_remarks),
    )


def is_read_back(key: str) -> bool:
    """Whether an added parameter that this program writes becomes a key of the imported mission, and no comment."""
    owner, _, kind = key.partition(".")
    return kind in (_READ_OF_TIMING if owner == "timing" else _READ_OF_PLATFORMS if owner in PLATFORMS else ())


def _with_added(
    bistatic: Element, declared_errors: dict[str, DeclaredMotionError | None]
) -> tuple[dict[str, DeclaredMotionError | None], dict[str, float], list[str]]:
    """Complete the errors with the parameters that this program writes to `AddedParameters` of a CPHD file.

    The parameters state accelerations, biases, distributions, terms of the clock error, and which sigmas of the file
    are placeholders for errors that are not declared. Returns the completed errors of each platform, figures of the
    clock error, and other parameters as remarks.
    """
    remarks = []
    timing: dict[str, float] = {}
    for parameter in bistatic.all("AddedParameters/Parameter"):
        program, _, key = parameter.node.get("name", "").partition(" ")
        if program != ADDED:
            continue
        owner, _, kind = key.partition(".")
        error, statement = declared_errors.get(owner), parameter.text()
        completed = None if error is None else _completed(error, kind, statement)
        if error is not None and completed is not None:
            if error.correlation and not completed.correlation:
                remarks.append(f"{key}: {statement}; correlations of the errors of the {owner} are left out.")
            declared_errors[owner] = completed
        elif is_read_back(key) and owner == "timing" and (numbers := _leading(statement, 1)):
            timing[kind] = numbers[0]
        else:  # also errors of neither platform, such as `common.time_tag`: they were dropped without a word
            remarks.append(f"{key}: {statement}")
    for owner, error in declared_errors.items():
        if error is None:
            continue
        if error.correlation and set(_names_of(error.distribution)[: len(MEASURED_KINDS)]) != {"normal"}:
            remarks.append(
                f"{owner}.distribution: {error.distribution}; a mission has covariances of normal errors only."
            )
            declared_errors[owner] = replace(error, distribution="normal")
        if error.position is None and error.velocity is None and error.acceleration is None and not error.biases:
            declared_errors[owner] = None
    return declared_errors, timing, remarks


def _completed(error: DeclaredMotionError, kind: str, statement: str) -> DeclaredMotionError | None:
    """Errors of a platform with what an added parameter states; None if it states nothing that a mission has."""
    if kind == "position" and statement == "not declared":
        return replace(error, correlation=(), position=None)
    if kind == "velocity" and statement == "not declared":
        return replace(error, correlation=(), velocity=None)
    if kind == "distribution":
        names = tuple(statement.split())
        if len(names) not in (1, len(STATE_KINDS)) or not {"normal", "uniform", "bound"}.issuperset(names):
            return None
        return replace(error, distribution=names if len(names) > 1 else names[0])
    if kind not in ("acceleration", *_BIASES) or not (numbers := _leading(statement, 3)):
        return None
    vector = numbers[0], numbers[1], numbers[2]
    if kind == "acceleration":
        return replace(error, acceleration=vector)
    return replace(error, biases={**error.biases, kind.partition(".")[0]: vector})


def _names_of(distribution: str | tuple[str, ...]) -> tuple[str, ...]:
    return (distribution,) * len(STATE_KINDS) if isinstance(distribution, str) else distribution


def _leading(statement: str, count: int) -> list[float]:
    """First `count` numbers of an added parameter; empty if it does not begin with as many."""
    words = statement.split()[:count]
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return []
    return numbers if len(numbers) == count else []


def of_matrices(
    parameters: Element | None, seen: Seen, names: tuple[str, str], clocks: tuple[int, int]
) -> FileErrors:
    """Read the errors that `ErrorParameters/SARImage` of CRSD or a bistatic SICD states as covariance matrices.

    `parameters` is the element that contains `Monostatic` or `Bistatic`, or the bistatic element itself. `names` are
    the names of two elements: the first has the covariances of position and velocity, and the second the covariance
    of the times and clock frequencies. `clocks` are the indices of both clock frequencies in the second covariance.
    """
    if parameters is None:
        return FileErrors(remarks=("The file declares no errors (ErrorParameters).",))
    mono = parameters.maybe("Monostatic")
    if mono is not None:
        error = mono.one(names[0])
        declared_error, remarks = declared(
            error.matrix("PVCov", 6), error.one("Frame"), seen.transmitter.state, seen.axes, "platform"
        )
        remarks.append(f"{mono.path}/RadarSensor: errors of its times and clock are not taken over.")
        return replace(_common(declared_error, remarks), at=mono.path)
    bistatic = parameters.maybe("Bistatic") or parameters
    error = bistatic.one(names[0])
    remarks = []
    declared_errors = []
    for owner, side in (("transmitter", "Tx"), ("receiver", "Rcv")):
        platform_error, added_remarks = declared(
            error.matrix(f"{side}PVCov", 6), error.one(f"{side}Frame"), getattr(seen, owner).state, seen.axes, owner
        )
        declared_errors.append(platform_error)
        remarks += added_remarks
    crossed = next(
        (name for name in ("TxRcvPVCov", "TxRcvPVXCov") if error.maybe(name) is not None),
        None,
    )
    if crossed is not None and error.one(crossed).all("Entry"):
        remarks.append(f"{error.path}/{crossed}: how errors of both platforms go together is not taken over.")
    linear = None
    times = bistatic.maybe(f"RadarSensor/{names[1]}")
    if times is not None:
        matrix = bistatic.one("RadarSensor").matrix(names[1], 4)
        first, second = clocks
        variance = float(matrix[first, first] + matrix[second, second] - 2 * matrix[first, second])
        if variance > 0:
            linear = math.sqrt(variance)
            remarks.append("timing_error.linear is one sigma of the difference of both clocks' frequency scales.")
        remarks.append(f"{times.path}: errors of the times of transmission and reception are not taken over.")
    return FileErrors(declared_errors[0], declared_errors[1], None, None, linear, bistatic.path, tuple(remarks))


def _decorrelation(element: Element, quantity: str) -> list[str]:
    decorrelation = element.maybe("PositionDecorr") or element.maybe("RangeBiasDecorr")
    if decorrelation is None:
        return []
    zero, rate = decorrelation.number("CorrCoefZero"), decorrelation.number("DecorrRate")
    return [
        f"Errors of the {quantity} keep a correlation of {zero:.6g} less {rate:.6g} per second from image to image "
        f"({decorrelation.path}); within this aperture they are taken as constant."
    ]


def _unused_of_sensor(sensor: Element, names: tuple[str, ...], path: str) -> list[str]:
    return [
        f"{path}/{name} = {sensor.number(name):.6g} has no key in a mission."
        for name in names
        if sensor.maybe(name) is not None and sensor.number(name) != 0
    ]


# ---------------------------------------------------------------------- the mission file
# A tree of keys, and its text with comments.
_COMMENT_WIDTH = 110
# Higher terms of a path: key, unit, and factor from the coefficient of the Taylor series to the derivative.
_BENDS = (
    ("jerk", "m/s^3", 6.0),
    ("snap", "m/s^4", 24.0),
)


def mission_tree(imported: Imported) -> JsonObject:
    """Return the content of a mission file as nested dictionaries, with quantities as strings in customary units."""
    tree: JsonDocument = {
        "schema_version": 1,
        "name": imported.name,
        "radar": {
            "center_frequency": _quantity(imported.center_frequency / 1e9, "GHz"),
            "bandwidth": _quantity(imported.bandwidth / 1e6, "MHz"),
        },
        "collection": {"aperture_time": _quantity(imported.aperture_time, "s")},
        "scene": {
            "latitude": _quantity(math.degrees(imported.scene.latitude), "deg", 12),
            "longitude": _quantity(math.degrees(imported.scene.longitude), "deg", 12),
            "height": _quantity(round(imported.scene.height, 6) + 0.0, "m"),
        },
        "platforms": {
            "transmitter": _platform(imported, imported.transmitter, imported.errors.transmitter),
            "receiver": _platform(imported, imported.receiver, imported.errors.receiver),
        },
    }
    if imported.center_time is not None:
        tree["collection"]["center_time"] = imported.center_time
    if imported.errors.common is not None:
        tree["common_motion_error"] = _error(imported, imported.errors.common)
        del tree["common_motion_error"]["frame"]
    errors = imported.errors
    timing = {"constant": errors.timing_constant, "linear": errors.timing_linear, **errors.timing_added}
    declared: JsonObject = {}
    for term, size in TIMING_KIND.sizes.items():
        sigma, bias = timing.get(term), timing.get(f"{term}.bias")
        if bias is not None:  # a sigma beside a bias has no sign
            pair = {"bias": bias} if sigma is None else {"sigma": abs(sigma), "bias": bias}
            declared[term] = {key: _quantity(value, size.dimension.si).strip() for key, value in pair.items()}
        elif sigma is not None:
            declared[term] = _quantity(sigma, size.dimension.si).strip()
    if declared:
        tree["timing_error"] = declared
    return tree


def mission_text(imported: Imported) -> str:
    """Return the text of a mission file, with the remarks of the import as comments."""
    tree = mission_tree(imported)
    paragraphs = [wrap(printable(paragraph), _COMMENT_WIDTH - 2) or [""] for paragraph in _head(imported)]
    lines = [f"# {line}".rstrip() for paragraph in paragraphs for line in paragraph]
    notes = {
        ("scene",): "the scene's axes are east, north and up here, WGS-84",
        ("platforms", "transmitter"): _fit(imported.transmitter),
        ("platforms", "receiver"): _fit(imported.receiver),
    }
    _write(lines, tree, (), notes)
    return "\n".join(lines) + "\n"


def _head(imported: Imported) -> list[str]:
    channel = f", channel {printable(imported.channel)}" if imported.channel else ""
    paragraphs = [
        f"Imported by bisar-budget from {printable(imported.file)} ({imported.format}{channel}), whose XML has the "
        f"SHA-256 {imported.xml_sha256}.",
        "",
        "Slow time counts when a pulse is at the scene point, from the middle of the aperture there. A pulse leaves "
        "the transmitter before that by its light time, and reaches the receiver after it by its own: each path has "
        "the positions of its platform at its own time, over that slow time. Velocities differ from those over the "
        "platform's own time by about 1 part in 100 000.",
        "Lengths are in metres of the scene's axes: x east, y north, z up of the scene point.",
    ]
    if imported.reference is not None:
        reference = imported.reference
        paragraphs.append(
            f"At the file's reference vector (slow time {reference.slow_time:.6f} s) the bistatic angle is "
            f"{math.degrees(reference.bistatic_angle):.6f} deg, and the slant ranges are "
            f"{reference.transmitter_range:.1f} m (transmitter) and {reference.receiver_range:.1f} m (receiver)."
        )
    if imported.remarks:
        paragraphs += ["", *imported.remarks]
    return paragraphs


def _fit(track: Fitted) -> str:
    if not track.samples:
        return "as the file states it, a straight path"
    distance = f"{track.farthest * 1e3:.3g} mm" if track.farthest < 1 else f"{track.farthest:.4g} m"
    words = f"order {track.order} through {track.samples} positions, at most {distance} from them"
    is_faster = track.order >= 4 and track.farthest >= 1e-3
    return f"{words}: what is left is faster than a mission states" if is_faster else words


def _platform(imported: Imported, track: Fitted, error: DeclaredMotionError | None) -> JsonObject:
    state = track.state
    platform: JsonObject = {
        "position": _triple(plain_vector(state.position), "m", 6),
        "velocity": _triple(plain_vector(state.velocity), "m/s", 9),
    }
    if state.acceleration != STRAIGHT:
        platform["acceleration"] = _triple(plain_vector(state.acceleration), "m/s^2")
    for bend, (key, per, factor) in zip(state.bends, _BENDS, strict=False):
        platform[key] = _triple(plain_vector((bend[0] * factor, bend[1] * factor, bend[2] * factor)), per)
    if error is not None:
        platform["motion_error"] = _error(imported, error)
    return platform


def _error(imported: Imported, error: DeclaredMotionError) -> JsonObject:
    tree: JsonObject = {"frame": error.frame}
    sigmas = {
        kind.name: _triple(value, kind.unit)
        for kind in MEASURED_KINDS
        if (value := getattr(error, kind.name)) is not None
    }
    if error.correlation:
        axes = [f"{kind.name}.{axis}" for kind in MEASURED_KINDS for axis in FRAME_AXES[error.frame]]
        pairs = {
            f"{axes[i]}-{axes[j]}": f"{error.correlation[i][j]:.9f}".rstrip("0")
            for i in range(6)
            for j in range(i + 1, 6)
            if abs(error.correlation[i][j]) > 5e-10
        }
        tree["covariance"] = {**sigmas, "correlation": pairs}
    else:
        tree |= sigmas
    if error.acceleration is not None:
        tree["acceleration"] = _triple(error.acceleration, ACCELERATION_KIND.unit)
    for name, bias in error.biases.items():
        kind = next(kind for kind in STATE_KINDS if kind.name == name)
        pair = {"bias": _triple(bias, kind.unit)}
        if name in tree:  # a sigma beside a bias has no sign
            x, y, z = getattr(error, name)
            pair = {"sigma": _triple((abs(x), abs(y), abs(z)), kind.unit), **pair}
        tree[name] = pair
    if isinstance(error.distribution, tuple):
        tree["distribution"] = dict(zip((kind.name for kind in STATE_KINDS), error.distribution, strict=True))
    elif error.distribution != "normal":
        tree["distribution"] = error.distribution
    tree["source"] = f"{printable(imported.file)}, {imported.errors.at}, one sigma"
    return tree


def _quantity(value: float, unit: str, digits: int = 12) -> str:
    return f"{value:.{digits}g} {unit}"


def _triple(vector: Vector, unit: str, decimals: int | None = None) -> list[str]:
    if decimals is None:
        return [_quantity(value, unit) for value in vector]
    trimmed = (f"{value:.{decimals}f}".rstrip("0").rstrip(".") for value in vector)
    return [f"{'0' if text in ('', '-0') else text} {unit}" for text in trimmed]


def _write(lines: list[str], tree: JsonObject, path: tuple[str, ...], notes: dict[tuple[str, ...], str]) -> None:
    indent = "  " * len(path)
    for key, value in tree.items():
        key_path = (*path, key)
        note = f" # {notes[key_path]}" if key_path in notes else ""
        if isinstance(value, dict):
            lines.append(f"{indent}{key}:{note}")
            _write(lines, value, key_path, notes)
        elif isinstance(value, list):
            lines.append(f"{indent}{key}: [{', '.join(value)}]{note}")
        else:
            text = json.dumps(value, ensure_ascii=False) if key in ("name", "source", "center_time") else value
            lines.append(f"{indent}{key}: {text}{note}")
