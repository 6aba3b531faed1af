"""Trajectories of Applanix POSPac: SBET, smoothed best estimate of trajectory, and its accuracy file, smrmsg.

An SBET is records of 17 little-endian doubles, without a header: time of the GPS week [s]; latitude, longitude [rad];
height above the ellipsoid [m]; velocities along x, y, z of the wander frame [m/s]; roll, pitch, heading, wander angle
[rad]; accelerations [m/s²] and angular rates [rad/s] of the body. An smrmsg is records of 10: time; one-sigma (RMS)
errors of position north, east, down [m], of velocity [m/s], of roll, pitch, heading [arcmin].

Source: the tables of both files in Applanix' POSPac MMS user guide. The frame of the velocities follows from the
heading, which is true when the wander angle is taken off: x is the wander angle west of north, y west of x, z up.
`test_a_real_flight_has_the_wander_frame` holds this to a flight.
"""

import math
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import Floats, curvature_radii
from bisar_budget.paths.flight import Log, PathFileError, around_aperture, hold_to_bytes, slow_times
from bisar_budget.paths.instant import GPS_EPOCH, WEEK, Instant
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRows,
    geodetic_log,
    hold_to_ellipsoid,
    hold_to_scale,
    utc_of,
)

LARGEST = 1_000_000_000  # bytes; ten hours at 200 Hz
_LATEST = 2 * WEEK  # a flight over the end of a week may count on
_ROLLED = WEEK - 3600  # s back that are a new week
_RIGHT_ANGLE = math.pi / 2 * (1 + 1e-12)
_WINDOW = 1.0  # s over which positions and velocities are compared; noise of a position is less than 0.1 m/s then
_APART = 1.0  # m/s, and a hundredth of the speed: what velocities of another frame exceed
_SMALLEST = 1e-100  # of any unit
_Fields = tuple[tuple[str, int, float, float, str], ...]  # name, place in a record, lowest, highest, unit
_FIELDS = (
    ("time", 0, 0.0, _LATEST, "s"),
    ("latitude", 1, -_RIGHT_ANGLE, _RIGHT_ANGLE, "rad"),
    ("longitude", 2, -2 * _RIGHT_ANGLE, 4 * _RIGHT_ANGLE, "rad"),
    ("height", 3, -12e3, 100e3, "m"),
    ("x velocity", 4, -3e3, 3e3, "m/s"),
    ("y velocity", 5, -3e3, 3e3, "m/s"),
    ("z velocity", 6, -3e3, 3e3, "m/s"),
    ("wander angle", 10, -4 * _RIGHT_ANGLE, 4 * _RIGHT_ANGLE, "rad"),
)
_SIGMAS = (
    ("time", 0, 0.0, _LATEST, "s"),
    *((f"{axis} position RMS", 1 + n, 0.0, 1e4, "m") for n, axis in enumerate(("north", "east", "down"))),
    *((f"{axis} velocity RMS", 4 + n, 0.0, 1e3, "m/s") for n, axis in enumerate(("north", "east", "down"))),
)


@dataclass(frozen=True)
class Accuracy:
    """One-sigma errors of position [m] and velocity [m/s], east, north and up: the worst of so many records."""

    position: Vector
    velocity: Vector
    records: int


def of_gps(week: int, seconds: float) -> Instant:
    """Day and seconds of GPS time of a week, not rolled over, and a second of it."""
    return Instant(GPS_EPOCH + 7 * week, 0.0).after(seconds)


def is_sbet(data: bytes) -> bool:
    """Whether bytes are whole records, of which the first and the last are those of a flight."""
    width = 17
    if not data or len(data) % (8 * width):
        return False
    ends = np.frombuffer(data, "<f8").reshape(-1, width)[[0, -1]]
    # Digits of a text are doubles next to zero.
    return _first_wrong(ends, _FIELDS) is None and bool((np.abs(ends[:, :3]).max(axis=1) > 1e-9).all())


def read_sbet(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read a trajectory of at most `LARGEST` bytes, as every reader of `LOG_FORMATS` does.

    Places come from latitude, longitude and height. Velocities, turned out of the wander frame, have to agree with
    them. Without a `week` times are seconds of the week, without a start. They rise over the end of a week; a leap
    second within the file is not counted.
    """
    hold_to_scale("gps", keys, name)
    hold_to_ellipsoid(keys, name)
    records = _records(data, name, 17, _FIELDS)
    times, start = _risen(records[:, 0], name), None
    _hold_to_velocities(times, records, name)
    if keys.week is not None:
        start = of_gps(keys.week, float(times[0]))
        times = times - times[0]
    _, latitude, longitude, height = records[:, :4].T
    return geodetic_log(LogRows(name), "SBET", times, start, "gps", (latitude, longitude, height))


def read_accuracy(
    data: bytes,
    name: str,
    week: int | None,
    center: Instant | None,
    center_seconds: float | None,
    aperture_time_s: float,
) -> Accuracy:
    """Read the accuracy of a trajectory in the aperture, a file of at most `LARGEST` bytes.

    The largest of each sigma counts, in the aperture and next to it: see `around_aperture`. The week is that of the
    trajectory, what says where the aperture is are arguments of `slow_times`. A `PathFileError` names the file, and
    the record or byte of the fault; or the records do not cover the aperture, have a gap in it, or state an error of
    zero all over it.
    """
    records = _records(data, name, 10, _SIGMAS)
    times, start = _risen(records[:, 0], name), None
    if week is not None:
        start = utc_of(of_gps(week, float(times[0])), "gps")
        times = times - times[0]
    slow = slow_times(Log(times, records[:, 1:4], True, "", start), center, center_seconds, aperture_time_s, name)
    inside = records[around_aperture(slow, aperture_time_s)]
    largest = inside[:, 1:7].max(axis=0)
    if not largest.all():
        empty = ", ".join(field for (field, *_), sigma in zip(_SIGMAS[1:], largest, strict=True) if not sigma)
        raise PathFileError(f"{name}: {empty}: 0 in the whole aperture; no trajectory is without error")
    north, east, down, north_rate, east_rate, down_rate = largest.tolist()
    return Accuracy((east, north, down), (east_rate, north_rate, down_rate), len(inside))


def _records(data: bytes, name: str, width: int, fields: _Fields) -> Floats:
    """Records (n, width) whose fields are where they can be."""
    size = 8 * width
    hold_to_bytes(data, LARGEST, name)
    if not data:
        raise PathFileError(f"{name}: is empty")
    whole, rest = divmod(len(data), size)
    if rest:
        raise PathFileError(
            f"{name}: ends at byte {len(data)}, {rest} into record {whole + 1}; each has {size} bytes"
        )
    records = np.frombuffer(data, "<f8").reshape(-1, width)
    wrong = _first_wrong(records, fields)
    if wrong is None:
        return records.astype(np.float64)
    index, field, value, unit = wrong
    says = f"{name}: record {index + 1}: {field} is {value:.6g} {unit}"
    if _first_wrong(np.frombuffer(data, ">f8").reshape(-1, width), fields) is None:
        raise PathFileError(f"{says}; the doubles are big-endian, they should be little-endian")
    if field == "time" and value > _LATEST:
        raise PathFileError(f"{says}; it should count from the start of the GPS week")
    if field in ("latitude", "longitude") and math.isfinite(value) and abs(value) <= 360:
        raise PathFileError(f"{says}; is it in degrees?")
    raise PathFileError(f"{says}, which it cannot be; are these records of {width} doubles?")


def _first_wrong(records: Floats, fields: _Fields) -> tuple[int, str, float, str] | None:
    """Index, field, value and unit of what is out of its range first."""
    found = []
    with np.errstate(invalid="ignore"):
        for field, at, lowest, highest, unit in fields:
            values = records[:, at]
            # Doubles of the other byte order are often next to zero.
            is_tiny = (np.abs(values) < _SMALLEST) & (values != 0)
            wrong = ~((values >= lowest) & (values <= highest)) | is_tiny
            if wrong.any():
                index = int(wrong.argmax())
                found.append((index, field, float(records[index, at]), unit))
    return min(found, key=lambda one: one[0], default=None)


def _risen(times: Floats, name: str) -> Floats:
    """Times that go on over the end of a week."""
    steps = np.diff(times)
    times = times + np.concatenate([[0.0], np.cumsum(np.where(steps <= -_ROLLED, WEEK, 0.0))])
    late = np.diff(times) <= 0
    if late.any():
        index = int(late.argmax())
        raise PathFileError(
            f"{name}: record {index + 2}: time {times[index + 1]:.12g} s is not after {times[index]:.12g} s; "
            "times must rise"
        )
    return times


def _hold_to_velocities(times: Floats, records: Floats, name: str) -> None:
    """Refuse velocities that are not those of the positions."""
    if len(times) < 2 or not records[:, 4:7].any():
        return
    latitude, longitude, height, x, y, z = records[:, 1:7].T
    cosine, sine = np.cos(records[:, 10]), np.sin(records[:, 10])
    north, west = x * cosine - y * sine, x * sine + y * cosine
    velocities = np.stack([-west, north, z], axis=1)
    steps = np.diff(times)[:, None]
    flown = _summed((velocities[1:] + velocities[:-1]) / 2 * steps)
    # Radii of curvature between two records, and the shorter way around.
    at, above = (latitude[1:] + latitude[:-1]) / 2, (height[1:] + height[:-1]) / 2
    along, across = curvature_radii(np.sin(at))
    turned = np.diff(longitude)
    turned -= 2 * math.pi * np.round(turned / (2 * math.pi))
    moved = _summed(
        np.stack(
            [turned * (across + above) * np.cos(at), np.diff(latitude) * (along + above), np.diff(height)], axis=1
        )
    )
    window = min(max(1, math.ceil(_WINDOW / float(np.median(steps)))), len(steps))
    elapsed = (times[window:] - times[:-window])[:, None]
    by_places = (moved[window:] - moved[:-window]) / elapsed
    by_velocities = (flown[window:] - flown[:-window]) / elapsed
    speed = float(np.median(np.linalg.norm(by_places, axis=1)))
    allowed = _APART + speed / 100
    apart = float(np.median(np.linalg.norm(by_places - by_velocities, axis=1)))
    if apart <= allowed:
        return

    def refuse(says: str) -> NoReturn:
        raise PathFileError(f"{name}: {says}")

    other_speed = float(np.median(np.linalg.norm(by_velocities, axis=1)))
    if abs(other_speed - speed) > allowed:
        refuse(
            f"moves at {speed:.4g} m/s by its positions, at {other_speed:.4g} m/s by its velocities; "
            "units or fields are others than those of an SBET"
        )
    refuse(
        f"has velocities {apart:.3g} m/s off the motion of its positions, at the same speed; "
        "they are not along x, y, z of the wander frame, x north, y west, z up at a wander angle of 0. "
        "A log in CSV needs no velocities"
    )


def _summed(parts: Floats) -> Floats:
    return np.concatenate([np.zeros((1, 3)), np.cumsum(parts, axis=0)])
