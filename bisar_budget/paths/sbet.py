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
from bisar_budget.paths.instant import GPS_EPOCH, WEEK, Instant
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRecords,
    geodetic_log,
    hold_to_ellipsoid,
    hold_to_scale,
    usable_log,
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
_RECORDS_OF_ACCURACY = "accepted: an accuracy file (smrmsg), records of ten doubles, 80 bytes"


class _Kind(NamedTuple):
    """A kind of file: what messages call it, doubles of a record, those that are looked at, and how many of them are
    not all zero.
    """

    words: str
    width: int
    fields: _Fields
    least: int

    @property
    def size(self) -> int:
        """Bytes of a record."""
        return 8 * self.width


_SBET = _Kind("an SBET", 17, _FIELDS, 3)
_SMRMSG = _Kind("an accuracy file of an SBET (smrmsg)", 10, _SIGMAS, 4)


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
    """Whether bytes are records of 17 doubles, of which those at both ends are of a flight."""
    return _looks_like(data, _SBET)


def is_accuracy(data: bytes) -> bool:
    """Whether bytes are records of 10 doubles, of which those at both ends state errors at times that rise."""
    return _looks_like(data, _SMRMSG)


def _looks_like(data: bytes, kind: _Kind) -> bool:
    """Whether most of the first and last three records are of a kind, and rise from the first to the last."""
    whole = len(data) // kind.size
    if not whole or (b"\n" in data[: kind.size] and data[: kind.size].isascii()):
        return False
    records = np.frombuffer(data[: whole * kind.size], "<f8").reshape(-1, kind.width)
    ends = records[sorted({*range(min(3, whole)), *range(max(whole - 3, 0), whole)})]
    # Digits of a text are doubles next to zero.
    is_sound = ~_wrong(ends, kind.fields).any(axis=0) & (np.abs(ends[:, : kind.least]).max(axis=1) > 1e-9)
    sound = ends[is_sound]
    return bool(2 * len(sound) > len(ends) and (len(sound) < 2 or sound[0, 0] != sound[-1, 0]))


def read_sbet(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read a trajectory of at most `LARGEST` bytes, as every reader of `LOG_FORMATS` does.

    Places come from latitude, longitude and height. Velocities, turned out of the wander frame, have to agree with
    them. Without a `week` times are seconds of the week, without a start. They rise over the end of a week; a leap
    second within the file is not counted.
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
    """Read the accuracy of a trajectory in the aperture, a file of at most `LARGEST` bytes.

    The largest of each sigma counts, in the aperture and next to it: see `around_aperture`. The week is that of the
    trajectory, what says where the aperture is are arguments of `slow_times`. A `PathFileError` names the file, and
    the record or byte of the fault; or the records do not cover the aperture, have a gap in it, or state an error of
    zero all over it.
    """
    if is_sbet(data) and not is_accuracy(data):
        raise PathFileError(f"{name}: is an SBET, a trajectory", _RECORDS_OF_ACCURACY, "trajectory.file reads it")
    table, named = _records(data, name, _SMRMSG)
    times, start = _over_weeks(table[:, 0], named), None
    if week is not None:
        start = of_gps(week, float(times[0]))
        times = times - times[0]
    log = usable_log(named, "", times, start, "gps", lambda kept: table[kept, 1:4])
    slow = slow_times(log, center, center_seconds, aperture_time_s, name)
    hold_to_usable_records(log, slow, aperture_time_s)
    records = table[named.is_usable]
    inside = records[around_aperture(slow, aperture_time_s)]
    largest = inside[:, 1:7].max(axis=0)
    if not largest.all():
        empty = ", ".join(field for (field, *_), sigma in zip(_SIGMAS[1:], largest, strict=True) if not sigma)
        raise PathFileError(f"{name}: {empty}: 0 in the whole aperture; no trajectory is without error")
    north, east, down, north_rate, east_rate, down_rate = largest.tolist()
    return Accuracy((east, north, down), (east_rate, north_rate, down_rate), len(inside))


def _records(data: bytes, name: str, kind: _Kind) -> tuple[Floats, LogRecords]:
    """Records (n, width), and which of them can be used: whose fields are where they can be.

    What is left of a record at the end, where writing broke off, counts as one that cannot be used.
    """
    hold_to_bytes(data, LARGEST, name)
    if not data:
        raise PathFileError(f"{name}: is empty")
    whole, rest = divmod(len(data), kind.size)
    cut = f"{name}: ends at byte {len(data)}, {rest} into record {whole + 1}; each has {kind.size} bytes"
    table = np.frombuffer(data[: whole * kind.size], "<f8").reshape(-1, kind.width)
    wrong = _wrong(table, kind.fields)
    is_wrong = wrong.any(axis=0)
    broken = {whole + 1: cut} if rest else {}
    try:
        records = LogRecords(name, whole, broken=broken)
        records.leave_out(is_wrong, lambda i: f"{_field_words(table, wrong, kind, i)}, which it cannot be")
    except PathFileError as error:
        if not is_wrong.any():
            raise
        raise _misread(data, name, kind, table, wrong) or error from None
    return table.astype(np.float64), records


def _field_words(table: Floats, wrong: NDArray[np.bool_], kind: _Kind, index: int) -> str:
    """The first field of a record that is wrong, and its value."""
    field, place, _, _, unit = kind.fields[int(wrong[:, index].argmax())]
    return f"{field} is {table[index, place]:.6g} {unit}"


def _misread(data: bytes, name: str, kind: _Kind, table: Floats, wrong: NDArray[np.bool_]) -> PathFileError:
    """Why so many records are wrong: the file is another one, or has other units."""
    index = int(wrong.any(axis=0).argmax())
    field, place, *_ = kind.fields[int(wrong[:, index].argmax())]
    value = float(table[index, place])
    says = f"{name}: record {index + 1}: {_field_words(table, wrong, kind, index)}"
    swapped = np.frombuffer(data[: len(table) * kind.size], ">f8").reshape(-1, kind.width)
    if not _wrong(swapped, kind.fields).any():
        return PathFileError(f"{says}; the doubles are big-endian, they should be little-endian")
    if field == "time" and value > _LATEST:
        return PathFileError(f"{says}; it should count from the start of the GPS week")
    if field in ("latitude", "longitude") and math.isfinite(value) and abs(value) <= 360:
        return PathFileError(f"{says}; is it in degrees?")
    return PathFileError(f"{says}, which it cannot be; are these records of {kind.width} doubles?")


def _wrong(records: Floats, fields: _Fields) -> NDArray[np.bool_]:
    """Which fields of records are out of their ranges, (fields, n)."""
    wrong = np.empty((len(fields), len(records)), dtype=bool)
    with np.errstate(invalid="ignore"):
        for index, (_, place, lowest, highest, _) in enumerate(fields):
            values = records[:, place]
            # Doubles of the other byte order are often next to zero.
            is_tiny = (np.abs(values) < _SMALLEST) & (values != 0)
            wrong[index] = ~((values >= lowest) & (values <= highest)) | is_tiny
    return wrong


def _over_weeks(times: Floats, records: LogRecords) -> Floats:
    """Times that go on over the end of a week; those of records that cannot be used do not count."""
    usable = np.flatnonzero(records.is_usable)
    at = times[usable]
    steps = np.diff(at)
    weeks = np.cumsum((steps <= -_ROLLED).astype(np.int64) - (steps >= _ROLLED))  # one back is that of a wrong time
    rolled = np.concatenate([[0.0], weeks * WEEK])
    found = times.copy()
    found[usable] = at + rolled
    return found


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
