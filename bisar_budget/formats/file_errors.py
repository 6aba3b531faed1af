"""Errors that a file declares, along the frames that a mission has.

`ErrorParameters` of CPHD 1.1.0 and `ErrorStatistics` of SICD, volume 1: sigmas of position and velocity, P1 to V3,
with their correlations. CRSD 1.0 and the bistatic part of SICD: covariances, 6 x 6. Frames are those of SICD, volume
3: ECF; RIC_ECF, radial, in-track and cross-track by the velocity over the turning Earth; RIC_ECI by that against the
stars, which is `ric` of a mission.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.formats.collected import DeclaredMotionError, Seen
from bisar_budget.formats.containers import Element
from bisar_budget.geometry import Axes, PlatformState, cross, unit
from bisar_budget.paths.earth import SceneAxes

Floats = NDArray[np.float64]

KINDS = ("P1", "P2", "P3", "V1", "V2", "V3")
FRAMES = {"ECF": "scene", "RIC_ECF": "ric", "RIC_ECI": "ric"}
ADDED = "bisar-budget"  # what names of our own begin with
_UNCORRELATED = 1e-6  # of a correlation: rounding of a turned covariance
_NEGATIVE = 2.5e-6  # of an eigenvalue of correlations that are written with six decimals


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


def sigmas_and_correlations(element: Element) -> Floats:
    """Covariance (6, 6) of a `PosVelErr`. [m², m²/s, m²/s²]"""
    sigmas = np.array([element.number(kind) for kind in KINDS])
    if sigmas.min() < 0:
        raise element.fault("has a negative sigma")
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
    clocks: list[float] = []
    delays: list[float] = []
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
            clocks += [sensor.number("ClockFreqSF")] if sensor.maybe("ClockFreqSF") is not None else []
            delays += [sensor.number("DelayBias")] if sensor.maybe("DelayBias") is not None else []
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
