"""Trajectories of Applanix POSPac: SBET, smoothed best estimate of trajectory, and its accuracy file, smrmsg.

An SBET has no header, and consists of records of 17 little-endian doubles: time of the GPS week [s]; latitude,
longitude [rad]; height above the ellipsoid [m]; velocities along x, y, z of the wander frame [m/s]; roll, pitch,
heading, wander angle [rad]; accelerations [m/s²] and angular rates [rad/s] of the body. An smrmsg consists of records
of 10 doubles: time; one-sigma (RMS) errors of position north, east, down [m], of velocity [m/s], of roll, pitch,
heading [arcmin].

Source: the tables of both files in Applanix' POSPac MMS user guide. The wander frame follows from the heading in the
file: the true heading is this heading minus the wander angle. So x points west of north by the wander angle, y is 90°
west of x, and z points up. `test_a_real_flight_has_the_wander_frame` checks this against a flight.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import Floats, curvature_radii
from bisar_budget.paths.flight import (
    Log,
    PathFileError,
    around_aperture,
    hold_to_bytes,
    hold_to_usable_records,
    slow_times,
)
from bisar_budget.paths.instant import GPS_EPOCH_DAY, WEEK_S, Instant
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRecords,
    geodetic_log,
    hold_to_ellipsoid,
    hold_to_scale,
    usable_log,
)

MAX_SBET_BYTES = 1_000_000_000  # ten hours at 200 Hz
_MAX_TIME_S = 2 * WEEK_S  # in a flight over the end of a week, times may exceed one week
_MIN_WEEK_STEP_S = WEEK_S - 3600  # a longer step back in time is a new week
_RIGHT_ANGLE_RAD = math.pi / 2 * (1 + 1e-12)
_WINDOW_S = 1.0  # over which velocities are compared with positions, whose noise is then less than 0.1 m/s
_MAX_SPEED_ERROR_MPS = 1.0  # plus a hundredth of the speed; velocities in a wrong frame differ by more
_MIN_MAGNITUDE_SI = 1e-100  # doubles of the other byte order are often smaller
_Fields = tuple[tuple[str, int, float, float, str], ...]  # name, index in a record, smallest, largest, unit
_SBET_FIELDS = (
    ("time", 0, 0.0, _MAX_TIME_S, "s"),
    ("latitude", 1, -_RIGHT_ANGLE_RAD, _RIGHT_ANGLE_RAD, "rad"),
    ("longitude", 2, -2 * _RIGHT_ANGLE_RAD, 4 * _RIGHT_ANGLE_RAD, "rad"),
    ("height", 3, -12e3, 100e3, "m"),
    ("x velocity", 4, -3e3, 3e3, "m/s"),
    ("y velocity", 5, -3e3, 3e3, "m/s"),
    ("z velocity", 6, -3e3, 3e3, "m/s"),
    ("wander angle", 10, -4 * _RIGHT_ANGLE_RAD, 4 * _RIGHT_ANGLE_RAD, "rad"),
)
_SMRMSG_FIELDS = (
    ("time", 0, 0.0, _MAX_TIME_S, "s"),
    *((f"{axis} position RMS", 1 + n, 0.0, 1e4, "m") for n, axis in enumerate(("north", "east", "down"))),
    *((f"{axis} velocity RMS", 4 + n, 0.0, 1e3, "m/s") for n, axis in enumerate(("north", "east", "down"))),
)
_ACCEPTED_ACCURACY_FILE = "accepted: an accuracy file (smrmsg), records of ten doubles, 80 bytes"


class _Kind(NamedTuple):
    """A kind of file that consists of records of doubles: an SBET, or the accuracy file of an SBET.

    Attributes
    ----------
    words : str
        Name of the kind for messages.
    width : int
        Number of doubles in a record.
    fields : tuple
        Fields of a record that are checked. Each entry has the name of a field, its index in the record, its smallest
        and largest value, and its unit.
    nonzero_fields : int
        Number of fields at the beginning of a record that are not all zero in a usable record.
    """

    words: str
    width: int
    fields: _Fields
    nonzero_fields: int

    @property
    def size(self) -> int:
        """Size of a record. [bytes]"""
        return 8 * self.width


_SBET = _Kind("an SBET", 17, _SBET_FIELDS, 3)
_SMRMSG = _Kind("an accuracy file of an SBET (smrmsg)", 10, _SMRMSG_FIELDS, 4)


@dataclass(frozen=True)
class Accuracy:
    """One-sigma errors of position [m] and velocity [m/s], east, north and up.

    Each error is the maximum over several records; `records` is their number.
    """

    position: Vector
    velocity: Vector
    records: int


def of_gps(week: int, seconds: float) -> Instant:
    """Instant in GPS time, from the GPS week (counted from 1980 without rollover) and the seconds of the week."""
    return Instant(GPS_EPOCH_DAY + 7 * week, 0.0).after(seconds)


def is_sbet(data: bytes) -> bool:
    """Whether a file is an SBET.

    The records of 17 doubles at its beginning and end must be plausible for a flight.
    """
    return _looks_like(data, _SBET)


def is_accuracy(data: bytes) -> bool:
    """Whether a file is the accuracy file of an SBET.

    The records of 10 doubles at its beginning and end must be plausible and have different times.
    """
    return _looks_like(data, _SMRMSG)


def _looks_like(data: bytes, kind: _Kind) -> bool:
    """Whether a file appears to consist of records of the given kind.

    Most of the first three and the last three records must be usable. The first and the last usable record among
    these six must have different times.
    """
    count = len(data) // kind.size
    if not count or (b"\n" in data[: kind.size] and data[: kind.size].isascii()):
        return False
    records = np.frombuffer(data[: count * kind.size], "<f8").reshape(-1, kind.width)
    ends = records[sorted({*range(min(3, count)), *range(max(count - 3, 0), count)})]
    # Digits of a text, read as doubles, are almost zero.
    is_sound = ~_wrong(ends, kind.fields).any(axis=0) & (np.abs(ends[:, : kind.nonzero_fields]).max(axis=1) > 1e-9)
    sound = ends[is_sound]
    return bool(2 * len(sound) > len(ends) and (len(sound) < 2 or sound[0, 0] != sound[-1, 0]))


def read_sbet(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read the fixes of an SBET trajectory of at most `MAX_SBET_BYTES` bytes.

    Arguments and errors are the same for all readers, see `LogFormat.read`.

    Positions come from latitude, longitude and height. Velocities are converted from the wander frame, and have to
    agree with the positions. Without the key `week` the log has no start, and its times are seconds of the GPS week.
    Times continue to increase past the end of a week. A leap second within the file is ignored.
    """
    hold_to_scale("gps", keys, name)
    hold_to_ellipsoid(keys, name)
    table, records = _records(data, name, _SBET)
    times = _over_weeks(table[:, 0], records)
    usable = records.is_usable
    records.keep_what_rises(times, None)
    _hold_to_velocities(times[usable], table[usable], name)
    start = None if keys.week is None else of_gps(keys.week, float(times[0]))
    if start is not None:
        times = times - times[0]
    _, latitude, longitude, height = table[:, :4].T
    log = geodetic_log(records, "SBET", times, start, "gps", (latitude, longitude, height))
    return log if start is not None else replace(log, clock="week")


def read_accuracy(
    data: bytes,
    name: str,
    week: int | None,
    center: Instant | None,
    center_seconds: float | None,
    aperture_time_s: float,
) -> Accuracy:
    """Read the accuracy of a trajectory during the aperture from its accuracy file.

    Each component of the result is the largest sigma of the records in the aperture and directly next to it (see
    `around_aperture`). `week` is the GPS week of the trajectory. All further arguments are the same as in
    `slow_times`. Raises `PathFileError`, with the record or byte of the fault, for a damaged file, and for records
    that do not cover the aperture, have a gap in the aperture, or state an error of zero throughout the aperture. The
    file may have at most `MAX_SBET_BYTES` bytes.
    """
    if is_sbet(data) and not is_accuracy(data):
        raise PathFileError(f"{name}: is an SBET, a trajectory", _ACCEPTED_ACCURACY_FILE, "trajectory.file reads it")
    table, log_records = _records(data, name, _SMRMSG)
    times, start = _over_weeks(table[:, 0], log_records), None
    if week is not None:
        start = of_gps(week, float(times[0]))
        times = times - times[0]
    log = usable_log(log_records, "", times, start, "gps", lambda kept: table[kept, 1:4])
    slow = slow_times(log, center, center_seconds, aperture_time_s, name)
    hold_to_usable_records(log, slow, aperture_time_s)
    records = table[log_records.is_usable]
    near_aperture = records[around_aperture(slow, aperture_time_s)]
    largest = near_aperture[:, 1:7].max(axis=0)
    if not largest.all():
        empty = ", ".join(field for (field, *_), sigma in zip(_SMRMSG_FIELDS[1:], largest, strict=True) if not sigma)
        raise PathFileError(f"{name}: {empty}: 0 in the whole aperture; no trajectory is without error")
    north, east, down, north_rate, east_rate, down_rate = largest.tolist()
    return Accuracy((east, north, down), (east_rate, north_rate, down_rate), len(near_aperture))


def _records(data: bytes, name: str, kind: _Kind) -> tuple[Floats, LogRecords]:
    """Read the records (n, width) of a file, and determine which of them are usable.

    In a usable record, every checked field is within its range. If the file ends within a record, this record counts
    as unusable.
    """
    hold_to_bytes(data, MAX_SBET_BYTES, name)
    if not data:
        raise PathFileError(f"{name}: is empty")
    count, remainder = divmod(len(data), kind.size)
    cut = f"{name}: ends at byte {len(data)}, {remainder} into record {count + 1}; each has {kind.size} bytes"
    table = np.frombuffer(data[: count * kind.size], "<f8").reshape(-1, kind.width)
    is_field_wrong = _wrong(table, kind.fields)
    is_wrong = is_field_wrong.any(axis=0)
    broken = {count + 1: cut} if remainder else {}
    try:
        records = LogRecords(name, count, broken=broken)
        records.leave_out(is_wrong, lambda i: f"{_field_words(table, is_field_wrong, kind, i)}, which it cannot be")
    except PathFileError as error:
        if not is_wrong.any():
            raise
        raise _misread(data, name, kind, table, is_field_wrong) or error from None
    return table.astype(np.float64), records


def _field_words(table: Floats, wrong: NDArray[np.bool_], kind: _Kind, index: int) -> str:
    """Name and value of the first out-of-range field in a record, as text for a message."""
    field, column, _, _, unit = kind.fields[int(wrong[:, index].argmax())]
    return f"{field} is {table[index, column]:.6g} {unit}"


def _misread(data: bytes, name: str, kind: _Kind, table: Floats, wrong: NDArray[np.bool_]) -> PathFileError:
    """Make the error for a file with too many impossible records.

    The error message names the likely cause, such as a different kind of file or different units.
    """
    index = int(wrong.any(axis=0).argmax())
    field, column, *_ = kind.fields[int(wrong[:, index].argmax())]
    value = float(table[index, column])
    message = f"{name}: record {index + 1}: {_field_words(table, wrong, kind, index)}"
    swapped = np.frombuffer(data[: len(table) * kind.size], ">f8").reshape(-1, kind.width)
    if not _wrong(swapped, kind.fields).any():
        return PathFileError(f"{message}; the doubles are big-endian, they should be little-endian")
    if field == "time" and value > _MAX_TIME_S:
        return PathFileError(f"{message}; it should count from the start of the GPS week")
    if field in ("latitude", "longitude") and math.isfinite(value) and abs(value) <= 360:
        return PathFileError(f"{message}; is it in degrees?")
    return PathFileError(f"{message}, which it cannot be; are these records of {kind.width} doubles?")


def _wrong(records: Floats, fields: _Fields) -> NDArray[np.bool_]:
    """Mask (fields, n) that selects the out-of-range values in n records."""
    is_wrong = np.empty((len(fields), len(records)), dtype=bool)
    with np.errstate(invalid="ignore"):
        for index, (_, column, lowest, highest, _) in enumerate(fields):
            values = records[:, column]
            is_tiny = (np.abs(values) < _MIN_MAGNITUDE_SI) & (values != 0)
            is_wrong[index] = ~((values >= lowest) & (values <= highest)) | is_tiny
    return is_wrong


def _over_weeks(times: Floats, records: LogRecords) -> Floats:
    """Convert seconds of the GPS week (n,) to times that do not restart at the end of a week. [s]

    The times of unusable records are not changed.
    """
    usable = np.flatnonzero(records.is_usable)
    usable_times = times[usable]
    steps = np.diff(usable_times)
    # A forward step of a week compensates a backward step due to a wrong time.
    weeks = np.cumsum((steps <= -_MIN_WEEK_STEP_S).astype(np.int64) - (steps >= _MIN_WEEK_STEP_S))
    rolled = np.concatenate([[0.0], weeks * WEEK_S])
    continuous = times.copy()
    continuous[usable] = usable_times + rolled
    return continuous


def _hold_to_velocities(times: Floats, records: Floats, name: str) -> None:
    """Refuse a trajectory whose stated velocities differ from the motion of its positions."""
    if len(times) < 2 or not records[:, 4:7].any():
        return
    latitude, longitude, height, x, y, z = records[:, 1:7].T
    cosine, sine = np.cos(records[:, 10]), np.sin(records[:, 10])
    north, west = x * cosine - y * sine, x * sine + y * cosine
    velocities = np.stack([-west, north, z], axis=1)
    steps = np.diff(times)[:, None]
    travelled_by_velocity = _cumulative((velocities[1:] + velocities[:-1]) / 2 * steps)
    # Radii of curvature are taken midway between two records. Steps of longitude are less than half a turn.
    mean_latitude, mean_height = (latitude[1:] + latitude[:-1]) / 2, (height[1:] + height[:-1]) / 2
    meridian_radius, transverse_radius = curvature_radii(np.sin(mean_latitude))
    longitude_steps = np.diff(longitude)
    longitude_steps -= 2 * math.pi * np.round(longitude_steps / (2 * math.pi))
    travelled_by_position = _cumulative(
        np.stack(
            [
                longitude_steps * (transverse_radius + mean_height) * np.cos(mean_latitude),
                np.diff(latitude) * (meridian_radius + mean_height),
                np.diff(height),
            ],
            axis=1,
        )
    )
    window = min(max(1, math.ceil(_WINDOW_S / float(np.median(steps)))), len(steps))
    elapsed = (times[window:] - times[:-window])[:, None]
    velocity_of_positions = (travelled_by_position[window:] - travelled_by_position[:-window]) / elapsed
    stated_velocity = (travelled_by_velocity[window:] - travelled_by_velocity[:-window]) / elapsed
    speed = float(np.median(np.linalg.norm(velocity_of_positions, axis=1)))
    allowed = _MAX_SPEED_ERROR_MPS + speed / 100
    speed_error = float(np.median(np.linalg.norm(velocity_of_positions - stated_velocity, axis=1)))
    if speed_error <= allowed:
        return

    def refuse(problem: str) -> NoReturn:
        raise PathFileError(f"{name}: {problem}")

    stated_speed = float(np.median(np.linalg.norm(stated_velocity, axis=1)))
    if abs(stated_speed - speed) > allowed:
        refuse(
            f"moves at {speed:.4g} m/s by its positions, at {stated_speed:.4g} m/s by its velocities; "
            "units or fields are others than those of an SBET"
        )
    refuse(
        f"has velocities {speed_error:.3g} m/s off the motion of its positions, at the same speed; "
        "they are not along x, y, z of the wander frame, x north, y west, z up at a wander angle of 0. "
        "A log in CSV needs no velocities"
    )


def _cumulative(steps: Floats) -> Floats:
    """Cumulative sums (n + 1, 3) of steps (n, 3), beginning with zero."""
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
