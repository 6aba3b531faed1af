"""A collection as a file states it: scene, band, aperture, both paths, errors; and the mission file of it.

Slow time counts when a pulse is at the scene point. A pulse leaves the transmitter R_t/c before that and reaches the
receiver R_r/c after it; each place of a path is that of its platform at its own time. The range sum of a mission at
a slow time is then that of the pulse.

Errors are those of `ErrorParameters` of CPHD 1.1.0 and `ErrorStatistics` of SICD, volume 1: sigmas of position and
velocity, P1 to V3, with their correlations. CRSD 1.0 and the bistatic part of SICD have covariances. Frames are
those of SICD, volume 3: ECF; RIC_ECF, radial, in-track and cross-track by the velocity over the turning Earth;
RIC_ECI by that against the stars, which is `ric` of a mission.
"""

import json
import math
from dataclasses import dataclass, replace
from textwrap import wrap
from typing import Any

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.faults import printable
from bisar_budget.formats.containers import Element
from bisar_budget.geometry import FRAME_AXES, STRAIGHT, Axes, PlatformState, Vector, cross, dot, norm, unit
from bisar_budget.paths.earth import Floats, Geodetic, SceneAxes
from bisar_budget.paths.flight import Fitted, least_squares, path_of, powers_of

FEWEST = 5  # pulses in an aperture that a path is fitted to
LONGEST = 1e6  # s, of an aperture, and to its middle
FARTHEST = 1e9  # m, of a platform; a mission takes no more
_HIGHEST = 4  # order of a path that a mission states: up to the snap
_UNSEEN = 1e-3  # of a wavelength: 0.4° of phase, a hundredth of the usual budget of 45°
_ROUNDING_M = 1e-7  # a term that moves the path by less at the end of the aperture is rounding
_BETTER = 0.9  # of the residual; an order that leaves more fits noise


class NoPathError(ValueError):
    """Places that give no path."""


@dataclass(frozen=True)
class DeclaredMotionError:
    """Errors of the measured path of one platform, one sigma, along the axes of a frame of the mission.

    `sigmas` (6,) of position [m] and velocity [m/s], None where a kind is not declared; `correlation` (6, 6).
    `acceleration` [m/s²] is in the same frame. `distribution` is that of the mission file.
    """

    frame: str
    position: Vector | None
    velocity: Vector | None
    correlation: tuple[tuple[float, ...], ...] = ()
    acceleration: Vector | None = None
    distribution: str = "normal"

    @property
    def is_isotropic(self) -> bool:
        """Whether it is the same along every direction."""
        return not self.correlation and all(
            kind is None or max(kind) - min(kind) <= 1e-9 * max(kind) for kind in (self.position, self.velocity)
        )


@dataclass(frozen=True)
class ReferenceGeometry:
    """Both slant ranges [m] and the bistatic angle [rad] at the file's reference vector, at a slow time. [s]"""

    slow_time: float
    transmitter_range: float
    receiver_range: float
    bistatic_angle: float


@dataclass(frozen=True)
class FileErrors:
    """Errors of both platforms, or common to them; clock terms of a mission; and what no key of a mission says."""

    transmitter: DeclaredMotionError | None = None
    receiver: DeclaredMotionError | None = None
    common: DeclaredMotionError | None = None
    timing_constant: float | None = None
    timing_linear: float | None = None
    at: str = ""
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Imported:
    """A collection as a file has it.

    `is_monostatic`: transmitter and receiver are one platform, whose errors are the same on both ways; common errors
    are then those of both. `remarks` are for the reader of the mission file; each is one fact. `unused` is
    that of vectors that are not used, empty where there are none.
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
    """Both platforms as a mission has them, and the scene's axes."""

    transmitter: Fitted
    receiver: Fitted
    axes: SceneAxes


def reference_of(seen: Seen, slow_time: float) -> ReferenceGeometry:
    """Ranges and bistatic angle at a slow time."""
    t, r = (track.state.at(slow_time)[0] for track in (seen.transmitter, seen.receiver))
    angle = math.atan2(norm(cross(unit(t), unit(r))), dot(unit(t), unit(r)))
    return ReferenceGeometry(slow_time, norm(t), norm(r), angle)


def fitted(times: Floats, places: Floats, aperture_time_s: float, wavelength_m: float) -> Fitted:
    """Path through places within the aperture by least squares, of the lowest order that a phase does not see.

    The order rises until no place is farther than a thousandth of the wavelength away, to the fourth at most: a
    mission states position, velocity, acceleration, jerk and snap. Where that is not reached, the lowest order is
    kept that no higher one betters clearly: what is left is noise of the places, or motion that is faster.

    Slow times (n,) are in seconds, places (n, 3) in metres of the scene's axes. A `NoPathError` says that there are
    fewer than five places within the aperture, or places or an aperture beyond what a mission takes.
    """
    if not 0 < aperture_time_s <= LONGEST:
        raise NoPathError(f"an aperture of {aperture_time_s:g} s is none; accepted: up to {LONGEST:g} s")
    half = aperture_time_s / 2
    inside = np.abs(times) <= half * (1 + 1e-9)
    count = int(inside.sum())
    if count < FEWEST:
        raise NoPathError(
            f"{count} pulses are in the aperture of {aperture_time_s:g} s, at least {FEWEST} are needed"
        )
    if not float(np.abs(places[inside]).max()) <= FARTHEST:
        raise NoPathError(f"a platform is farther than {FARTHEST:g} m from the scene point, or nowhere")
    at, wanted = times[inside] / half, places[inside]
    middle = wanted.mean(axis=0)  # what is large is taken away, so that rounding is that of what is small
    found = []
    for order in range(1, min(_HIGHEST, count - 2) + 1):
        coefficients, left = least_squares(at, wanted - middle, order)
        away = np.linalg.norm(left, axis=1)
        found.append((coefficients, float(away.max()), float(np.sqrt(np.mean(away**2)))))
        if found[-1][1] <= _UNSEEN * wavelength_m:
            break
    best = found[-1]
    if best[1] > _UNSEEN * wavelength_m:
        best = next(one for one in found if one[2] * _BETTER <= best[2])
    coefficients, farthest, rms = best
    order = len(coefficients) - 1
    powers = powers_of(coefficients, half)
    powers[1:][np.abs(powers[1:]) * half ** np.arange(1, order + 1)[:, None] < _ROUNDING_M] = 0.0
    powers[0] += middle
    powers[0][np.abs(powers[0]) < _ROUNDING_M] = 0.0
    return Fitted(path_of(powers), order, farthest, rms, count)


# ---------------------------------------------------------------------- errors that a file declares
KINDS = ("P1", "P2", "P3", "V1", "V2", "V3")
FRAMES = {"ECF": "scene", "RIC_ECF": "ric", "RIC_ECI": "ric"}
ADDED = "bisar-budget"  # what names of our own begin with
_LARGEST = (1e9, 1e6)  # sigmas of position and velocity that a mission file takes, m and m/s
_UNCORRELATED = 1e-6  # of a correlation: rounding of a turned covariance
_NEGATIVE = 2.5e-6  # of an eigenvalue of correlations that are written with six decimals


def sigmas_and_correlations(element: Element) -> Floats:
    """Covariance (6, 6) of a `PosVelErr`. [m², m²/s, m²/s²]"""
    sigmas = np.array([element.number(kind) for kind in KINDS])
    if sigmas.min() < 0:
        raise element.fault("has a negative sigma")
    _hold_to_size(sigmas, element)
    correlation = np.eye(6)
    coefficients = element.maybe("CorrCoefs")
    if coefficients is not None:
        for row in range(6):
            for column in range(row + 1, 6):
                value = coefficients.number(KINDS[row] + KINDS[column])
                if abs(value) > 1:
                    raise coefficients.fault("must be within ±1", KINDS[row] + KINDS[column])
                correlation[row, column] = correlation[column, row] = value
    covariance: Floats = np.outer(sigmas, sigmas) * correlation
    return covariance


def _hold_to_size(sigmas: Floats, element: Element) -> None:
    """Refuse sigmas (6,) that are no motion error's, before they are squared."""
    for kind, largest, written in zip((sigmas[:3], sigmas[3:]), _LARGEST, ("m", "m/s"), strict=True):
        if kind.max() > largest:
            raise element.fault(f"has a sigma of {kind.max():.3g} {written}, more than {largest:g} {written}")


def correlated(covariance: Floats) -> tuple[Floats, Floats]:
    """Sigmas (n,) and correlations (n, n) of a covariance; those of an error that is zero are zero."""
    sigmas = np.sqrt(np.clip(np.diag(covariance), 0, None))
    scale = np.outer(sigmas, sigmas)
    return sigmas, np.clip(covariance / np.where(scale > 0, scale, 1.0), -1, 1)


def declared(
    covariance: Floats, frame: Element, state: PlatformState, axes: SceneAxes, whose: str
) -> tuple[DeclaredMotionError, list[str]]:
    """Turn a covariance (6, 6) of a file's frame into the frame of a mission, and say what was done.

    ECF becomes the scene's axes, RIC_ECI is `ric`, RIC_ECF is turned into it about the radial axis. The
    turned covariance is written by its sigmas alone where nothing is correlated.
    """
    name = frame.text()
    _hold_to_size(np.sqrt(np.abs(covariance).max(axis=1)), frame)
    if name not in FRAMES:
        raise frame.fault(f"must be one of {', '.join(FRAMES)} (got {name!r})")
    target = state.frame("scene") if name == "ECF" else axes.radial(state.position, state.velocity)
    source = _axes_of(name, state, axes)
    turn: Floats = np.array(target) @ np.array(source).T  # from the file's frame into that of the mission
    both = np.kron(np.eye(2), turn)
    turned = both @ covariance @ both.T
    remarks = []
    if name != "RIC_ECI" and covariance.any():
        into = "east, north, up" if name == "ECF" else "ric, whose in-track holds the velocity against the stars"
        remarks.append(f"Errors of the {whose} are stated in {name}; they are turned into {into}.")
    sigmas, correlation = correlated(turned)
    np.fill_diagonal(correlation, 1.0)
    if float(np.linalg.eigvalsh(correlation).min()) < -_NEGATIVE:
        remarks.append(
            f"Correlations of the errors of the {whose} are those of no covariance (not positive semi-definite); "
            "they are left out, the sigmas stay."
        )
        correlation = np.eye(6)
    is_correlated = bool((np.abs(correlation - np.eye(6)) > _UNCORRELATED).any())
    x, y, z, u, v, w = (float(sigma) for sigma in sigmas)
    rows = tuple(tuple(float(value) for value in row) for row in correlation) if is_correlated else ()
    return DeclaredMotionError(FRAMES[name], (x, y, z), (u, v, w), rows), remarks


def _axes_of(name: str, state: PlatformState, axes: SceneAxes) -> Axes:
    """Axes of a file's frame, in the scene's."""
    if name == "ECF":
        x, y, z = zip(*axes.axes, strict=True)
        return x, y, z
    if name == "RIC_ECI":
        return axes.radial(state.position, state.velocity)
    radial = unit(axes.turned(axes.earth_fixed(state.position)))
    across = unit(cross(radial, state.velocity))
    return radial, cross(across, radial), across


def of_sigmas(parameters: Element | None, seen: Seen, *, is_monostatic: bool) -> FileErrors:
    """Errors of CPHD's `ErrorParameters`, or of SICD's `ErrorStatistics` with components."""
    if parameters is None:
        return FileErrors(remarks=("The file declares no errors (ErrorParameters).",))
    mono = parameters.maybe("Monostatic") or (parameters.maybe("Components") if is_monostatic else None)
    if mono is not None and mono.maybe("PosVelErr") is not None:
        return _of_one(mono, seen)
    both = parameters.maybe("Bistatic")
    if both is not None:
        return _of_two(both, seen)
    return FileErrors(
        at=parameters.path, remarks=(f"{parameters.path} declares no component that a mission has a key for.",)
    )


def _of_one(mono: Element, seen: Seen) -> FileErrors:
    error = mono.one("PosVelErr")
    whole, remarks = declared(
        sigmas_and_correlations(error), error.one("Frame"), seen.transmitter.state, seen.axes, "platform"
    )
    remarks += _decorrelation(error, "position")
    constant = None
    sensor = mono.maybe("RadarSensor")
    if sensor is not None:
        remarks += _rest_of_sensor(sensor, ("ClockFreqSF", "TransmitFreqSF", "CollectionStartTime"), "RadarSensor")
        if sensor.maybe("RangeBias") is not None:
            constant = 2 * sensor.number("RangeBias") / SPEED_OF_LIGHT
            remarks.append("timing_error.constant is 2 RangeBias/c: the range of a monostatic file is half the way.")
            remarks += _decorrelation(sensor, "range bias")
    for name in ("TropoError", "IonoError"):
        if (found := mono.maybe(name)) is not None:
            values = (f"{one.tag} = {one.number():.6g}" for one in found.all("*") if not len(one.node))
            remarks.append(f"{name} has no key in a mission: {', '.join(values)}")
    return replace(_common(whole, remarks), timing_constant=constant, at=mono.path)


def _common(whole: DeclaredMotionError, remarks: list[str]) -> FileErrors:
    """Errors of one platform that transmits and receives."""
    if whole.is_isotropic:
        remarks.append(
            "One platform transmits and receives, with the same error: it is that of common_motion_error. Its frame "
            "does not matter, since it is alike along each axis."
        )
        return FileErrors(common=replace(whole, frame="scene"), remarks=tuple(remarks))
    remarks.append(
        "One platform transmits and receives: the errors below are the same on both ways, and add. `combine: sum` "
        "judges them together; `rss` would take them for independent."
    )
    return FileErrors(transmitter=whole, receiver=whole, remarks=tuple(remarks))


def _of_two(both: Element, seen: Seen) -> FileErrors:
    found: dict[str, DeclaredMotionError | None] = {"transmitter": None, "receiver": None}
    remarks: list[str] = []
    values: dict[str, list[float]] = {"ClockFreqSF": [], "DelayBias": []}
    for whose, name in (("transmitter", "TxPlatform"), ("receiver", "RcvPlatform")):
        platform = both.maybe(name)
        if platform is None:
            remarks.append(f"The file declares no errors of the {whose}.")
            continue
        error = platform.one("PosVelErr")
        found[whose], said = declared(
            sigmas_and_correlations(error), error.one("Frame"), getattr(seen, whose).state, seen.axes, whose
        )
        remarks += [*said, *_decorrelation(error, f"position of the {whose}")]
        sensor = platform.maybe("RadarSensor")
        if sensor is not None:
            remarks += _rest_of_sensor(sensor, ("CollectionStartTime",), f"{name}/RadarSensor")
            for key, stated in values.items():
                if sensor.maybe(key) is not None:
                    stated.append(sensor.number(key))
    clocks, delays = values.values()
    found, said = _with_added(both, found)
    if clocks:
        remarks.append(
            "timing_error.linear is the root sum square of ClockFreqSF of both platforms: a receiver whose clock is "
            "off by a factor counts a delay that grows with slow time."
        )
    if delays:
        remarks.append("timing_error.constant is the root sum square of DelayBias of both platforms.")
    return FileErrors(
        transmitter=found["transmitter"],
        receiver=found["receiver"],
        timing_constant=math.hypot(*delays) if delays else None,
        timing_linear=math.hypot(*clocks) if clocks else None,
        at=both.path,
        remarks=tuple(remarks + said),
    )


def _with_added(
    both: Element, found: dict[str, DeclaredMotionError | None]
) -> tuple[dict[str, DeclaredMotionError | None], list[str]]:
    """Apply what our own file says beside the sigmas: kinds that are not declared, accelerations, distributions."""
    remarks = []
    for parameter in both.all("AddedParameters/Parameter"):
        program, _, key = parameter.node.get("name", "").partition(" ")
        whose, _, kind = key.partition(".")
        one = found.get(whose)
        if program != ADDED or one is None:
            continue
        said = parameter.text()
        if kind in ("position", "velocity") and said == "not declared":
            bare = replace(one, correlation=())
            found[whose] = replace(bare, position=None) if kind == "position" else replace(bare, velocity=None)
        elif kind == "distribution" and said in ("uniform", "bound"):
            found[whose] = replace(one, distribution=said)
        elif kind == "acceleration":
            values = [float(part) for part in said.split()[:3]]
            found[whose] = replace(one, acceleration=(values[0], values[1], values[2]))
        else:
            remarks.append(f"{key}: {said}")
    for whose, one in found.items():
        if one is not None and one.position is None and one.velocity is None and one.acceleration is None:
            found[whose] = None
    return found, remarks


def of_matrices(
    parameters: Element | None, seen: Seen, names: tuple[str, str], clocks: tuple[int, int]
) -> FileErrors:
    """Errors of CRSD's `ErrorParameters/SARImage`, or of SICD's `ErrorStatistics` with bistatic components.

    `parameters` has `Monostatic` or `Bistatic`, or is the bistatic part itself. `names` are those of the element with
    covariances and of that with times and frequencies, `clocks` the rows of both clocks' frequencies in its matrix.
    """
    if parameters is None:
        return FileErrors(remarks=("The file declares no errors (ErrorParameters).",))
    mono = parameters.maybe("Monostatic")
    if mono is not None:
        error = mono.one(names[0])
        whole, remarks = declared(
            error.matrix("PVCov", 6), error.one("Frame"), seen.transmitter.state, seen.axes, "platform"
        )
        remarks.append(f"{mono.path}/RadarSensor: errors of its times and clock are not taken over.")
        return replace(_common(whole, remarks), at=mono.path)
    both = parameters.maybe("Bistatic") or parameters
    error = both.one(names[0])
    remarks = []
    found = []
    for whose, side in (("transmitter", "Tx"), ("receiver", "Rcv")):
        one, said = declared(
            error.matrix(f"{side}PVCov", 6), error.one(f"{side}Frame"), getattr(seen, whose).state, seen.axes, whose
        )
        found.append(one)
        remarks += said
    crossed = next((one for one in ("TxRcvPVCov", "TxRcvPVXCov") if error.maybe(one) is not None), None)
    if crossed is not None and error.one(crossed).all("Entry"):
        remarks.append(f"{error.path}/{crossed}: how errors of both platforms go together is not taken over.")
    linear = None
    times = both.maybe(f"RadarSensor/{names[1]}")
    if times is not None:
        matrix = both.one("RadarSensor").matrix(names[1], 4)
        first, second = clocks
        variance = float(matrix[first, first] + matrix[second, second] - 2 * matrix[first, second])
        if variance > 0:
            linear = math.sqrt(variance)
            remarks.append("timing_error.linear is one sigma of the difference of both clocks' frequency scales.")
        remarks.append(f"{times.path}: errors of the times of transmission and reception are not taken over.")
    return FileErrors(found[0], found[1], None, None, linear, both.path, tuple(remarks))


def _decorrelation(element: Element, what: str) -> list[str]:
    found = element.maybe("PositionDecorr") or element.maybe("RangeBiasDecorr")
    if found is None:
        return []
    zero, rate = found.number("CorrCoefZero"), found.number("DecorrRate")
    return [
        f"Errors of the {what} keep a correlation of {zero:.6g} less {rate:.6g} per second from image to image "
        f"({found.path}); within this aperture they are taken as constant."
    ]


def _rest_of_sensor(sensor: Element, names: tuple[str, ...], where: str) -> list[str]:
    return [
        f"{where}/{name} = {sensor.number(name):.6g} has no key in a mission."
        for name in names
        if sensor.maybe(name) is not None and sensor.number(name) != 0
    ]


# ---------------------------------------------------------------------- the mission file of it
# A tree of keys, and that tree with comments.
_WIDTH = 110
_KINDS = ("position", "velocity")
_BENDS = (
    ("jerk", "m/s^3", 6.0),
    ("snap", "m/s^4", 24.0),
)  # of a path, each a term of its Taylor series times so much


def mission_tree(imported: Imported) -> dict[str, Any]:
    """Return the keys of a mission with their values as a person writes them, and no comment."""
    tree: dict[str, Any] = {
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
    timing = {"constant": (imported.errors.timing_constant, "s"), "linear": (imported.errors.timing_linear, "")}
    declared = {key: _quantity(value, unit).strip() for key, (value, unit) in timing.items() if value is not None}
    if declared:
        tree["timing_error"] = declared
    return tree


def mission_text(imported: Imported) -> str:
    """Return a mission file, with what the reader has to know in comments."""
    tree = mission_tree(imported)
    paragraphs = [wrap(printable(paragraph), _WIDTH - 2) or [""] for paragraph in _head(imported)]
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
    head = [
        f"Imported by bisar-budget from {printable(imported.file)} ({imported.format}{channel}), whose XML has the "
        f"SHA-256 {imported.xml_sha256}.",
        "",
        "Slow time counts when a pulse is at the scene point, from the middle of the aperture there. A pulse leaves "
        "the transmitter before that by its light time, and reaches the receiver after it by its own: each path has "
        "the places of its platform at its own time, over that slow time. Velocities differ from those over the "
        "platform's own time by about 1 part in 100 000.",
        "Lengths are in metres of the scene's axes: x east, y north, z up of the scene point.",
    ]
    if imported.reference is not None:
        one = imported.reference
        head.append(
            f"At the file's reference vector (slow time {one.slow_time:.6f} s) the bistatic angle is "
            f"{math.degrees(one.bistatic_angle):.6f} deg, and the slant ranges are {one.transmitter_range:.1f} m "
            f"(transmitter) and {one.receiver_range:.1f} m (receiver)."
        )
    if imported.remarks:
        head += ["", *imported.remarks]
    return head


def _fit(track: Fitted) -> str:
    if not track.samples:
        return "as the file states it, a straight path"
    away = f"{track.farthest * 1e3:.3g} mm" if track.farthest < 1 else f"{track.farthest:.4g} m"
    words = f"order {track.order} through {track.samples} places, at most {away} from them"
    is_faster = track.order >= 4 and track.farthest >= 1e-3
    return f"{words}: what is left is faster than a mission states" if is_faster else words


def _platform(imported: Imported, track: Fitted, error: DeclaredMotionError | None) -> dict[str, Any]:
    state = track.state
    platform: dict[str, Any] = {
        "position": _triple(state.position, "m", 6),
        "velocity": _triple(state.velocity, "m/s", 9),
    }
    if state.acceleration != STRAIGHT:
        platform["acceleration"] = _triple(state.acceleration, "m/s^2")
    for bend, (key, per, factor) in zip(state.bends, _BENDS, strict=False):
        platform[key] = _triple((bend[0] * factor, bend[1] * factor, bend[2] * factor), per)
    if error is not None:
        platform["motion_error"] = _error(imported, error)
    return platform


def _error(imported: Imported, error: DeclaredMotionError) -> dict[str, Any]:
    units = {"position": "m", "velocity": "m/s"}
    stated: dict[str, Any] = {"frame": error.frame}
    sigmas = {kind: _triple(value, units[kind]) for kind in _KINDS if (value := getattr(error, kind)) is not None}
    if error.correlation:
        axes = [f"{kind}.{axis}" for kind in _KINDS for axis in FRAME_AXES[error.frame]]
        pairs = {
            f"{axes[i]}-{axes[j]}": f"{error.correlation[i][j]:.9f}".rstrip("0")
            for i in range(6)
            for j in range(i + 1, 6)
            if abs(error.correlation[i][j]) > 5e-10
        }
        stated["covariance"] = {**sigmas, "correlation": pairs}
    else:
        stated |= sigmas
    if error.acceleration is not None:
        stated["acceleration"] = _triple(error.acceleration, "m/s^2")
    if error.distribution != "normal":
        stated["distribution"] = error.distribution
    stated["source"] = f"{printable(imported.file)}, {imported.errors.at}, one sigma"
    return stated


def _quantity(value: float, unit: str, digits: int = 12) -> str:
    return f"{value:.{digits}g} {unit}"


def _triple(vector: Vector, unit: str, decimals: int | None = None) -> list[str]:
    if decimals is None:
        return [_quantity(value, unit) for value in vector]
    trimmed = (f"{value:.{decimals}f}".rstrip("0").rstrip(".") for value in vector)
    return [f"{'0' if text in ('', '-0') else text} {unit}" for text in trimmed]


def _write(lines: list[str], tree: dict[str, Any], path: tuple[str, ...], notes: dict[tuple[str, ...], str]) -> None:
    indent = "  " * len(path)
    for key, value in tree.items():
        here = (*path, key)
        note = f" # {notes[here]}" if here in notes else ""
        if isinstance(value, dict):
            lines.append(f"{indent}{key}:{note}")
            _write(lines, value, here, notes)
        elif isinstance(value, list):
            lines.append(f"{indent}{key}: [{', '.join(value)}]{note}")
        else:
            text = json.dumps(value, ensure_ascii=False) if key in ("name", "source", "center_time") else value
            lines.append(f"{indent}{key}: {text}{note}")
