"""Logs of the PX4 autopilot (ULog, `.ulg`): fixes of the GPS topic, or the autopilot's estimate of its position.

A ULog consists of messages, each with a size, a type and a payload. A message of type F states the fields of a topic,
type A assigns a number to a topic, and type D is a record of the topic with that number. The GPS topics are
`vehicle_gps_position` and `sensor_gps`. They contain UTC, and heights above the ellipsoid. The topic
`vehicle_global_position` has only times since the start of the autopilot; its UTC is taken from a GPS topic. Both
kinds of topic state standard deviations of each fix: `eph` is horizontal, `epv` vertical. Attitude is not read.

Source: PX4 user guide, "ULog File Format"; PX4-Autopilot msg/SensorGps.msg (latitude_deg etc.; before release 1.14,
lat in 1e-7 deg and alt in mm) and msg/versioned/VehicleGlobalPosition.msg. The package pyulog is used only as a
reference in tests, because it expands every topic of a file, whatever its size, before it selects topics, and because
it prints damaged messages.
"""

import struct
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.faults import shown
from bisar_budget.paths.earth import Floats
from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRecords,
    from_sea_level,
    geodetic_log,
    hold_to_ellipsoid,
    hold_to_scale,
    level_sigmas,
    one_instance,
    unix_instant,
)

_MAGIC = b"ULog\x01\x12\x35"
_HEADER_BYTES = 16  # signature, version, and the time at which the log begins
_APPENDED_DATA_FLAG_BITS = 1  # the only supported flag of newer kinds of files
_TYPES = {
    "int8_t": "i1",
    "uint8_t": "u1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
    "bool": "u1",
    "char": "S1",
}
_MESSAGE_TYPES = frozenset(b"FADBIMPQRLCSO")
_MAX_UNKNOWN_BYTES = 10_000  # in a message of an unknown type, which is skipped
_GPS_TOPICS, _GLOBAL_TOPIC = ("vehicle_gps_position", "sensor_gps"), "vehicle_global_position"
_MAX_TIME_US = 1 << 60  # the year 38 000
_MIN_FIX_LEVEL = 3  # a fix in three dimensions
_ACCURACY_FIELDS = ("eph", "epv")  # m
_VALIDITY_FIELDS = ("lat_lon_valid", "alt_valid")  # of the global position, since release 1.16
_MAX_CLOCK_DRIFT_S = 1.0  # due to jitter of messages; a larger drift means that the clocks do not match


class _Units(NamedTuple):
    """Names of the coordinate fields of a topic, and factors that convert coordinates to degrees and metres.

    `height` is the field with the height above the ellipsoid, and `altitude` the field with the height above mean sea
    level. GPS topics exist in two versions with different names and factors.
    """

    latitude: str
    longitude: str
    height: str
    altitude: str
    degrees: float = 1.0
    metres: float = 1.0


_GPS_UNITS = (
    _Units("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "altitude_msl_m"),
    _Units("lat", "lon", "alt_ellipsoid", "alt", 1e-7, 1e-3),
)
_GLOBAL_UNITS = (_Units("lat", "lon", "alt_ellipsoid", "alt"),)

Records = NDArray[np.void]


class _Topic(NamedTuple):
    """A topic in a log: its name, its records, and the names and units of its coordinates.

    `instance` is the number of the receiver to which the topic belongs.
    """

    name: str
    records: Records
    units: _Units
    instance: int = 0

    def column(self, field: str) -> Floats:
        """Values (n,) of a field in all n records."""
        values: Floats = self.records[field].astype(np.float64)
        return values

    def has(self, field: str) -> bool:
        """Whether the records of the topic have a field."""
        return field in (self.records.dtype.names or ())


def is_ulog(data: bytes) -> bool:
    """Whether a file begins with the signature of a ULog."""
    return data.startswith(_MAGIC)


def read_ulog(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read the fixes of a flight from a ULog.

    Arguments and errors are the same for all readers, see `LogFormat.read`.

    The fixes come from the GPS topic or from the global position, whichever has more records. If there are several
    receivers, the mission file chooses one, and the fixes of its GPS topic are used.
    """
    hold_to_scale("utc", keys, name)
    if not is_ulog(data):
        raise PathFileError(f"{name}: is no ULog: it does not begin with 'ULog'")
    topics = [topic for topic in map(_with_fixes, _topics(data, name)) if _count(topic)]
    gps_topics = [topic for topic in topics if topic.name in _GPS_TOPICS]
    gps = max(gps_topics, key=_count, default=None)
    position = max((topic for topic in topics if topic.name == _GLOBAL_TOPIC), key=_count, default=None)
    if position is not None and (gps is None or _count(position) > _count(gps)) and keys.instance is None:
        return _of_global(position, gps, keys, name)
    if gps_topics:
        counts: dict[float, int] = {}
        for topic in gps_topics:
            counts[topic.instance] = max(counts.get(topic.instance, 0), _count(topic))
        chosen = one_instance(counts, keys, name)
        gps = max((topic for topic in gps_topics if topic.instance == chosen), key=_count)
    if gps is None:
        raise PathFileError(
            f"{name}: has no position",
            f"accepted: a ULog with the topic {', '.join(_GPS_TOPICS)} (with a fix) or {_GLOBAL_TOPIC}",
        )
    return _of_gps(gps, keys, name)


def _count(topic: _Topic) -> int:
    return len(topic.records)


def _with_fixes(topic: _Topic) -> _Topic:
    """Keep only the records of a topic that have a fix.

    Records of a GPS topic must also state UTC, which is 0 until the receiver knows the time.
    """
    records = topic.records
    if topic.name in _GPS_TOPICS:
        utc_us = records["time_utc_usec"]
        is_kept = (records["fix_type"] >= _MIN_FIX_LEVEL) & (utc_us > 0) & (utc_us < _MAX_TIME_US)
    else:
        is_kept = records["timestamp"] < _MAX_TIME_US
        for field in filter(topic.has, _VALIDITY_FIELDS):
            is_kept &= records[field] != 0
    return topic._replace(records=records[is_kept])


def _of_gps(gps: _Topic, keys: LogKeys, name: str) -> Log:
    utc_us = gps.records["time_utc_usec"].astype(np.int64)
    times = (utc_us - utc_us[0]).astype(np.float64) * 1e-6
    return _log(gps, times, unix_instant(int(utc_us[0])), "", None, keys, name)


def _of_global(position: _Topic, gps: _Topic | None, keys: LogKeys, name: str) -> Log:
    """Make a log from the positions estimated by the autopilot.

    Without a GPS topic, the log has no UTC, and its times are seconds since the start of the autopilot.
    """
    time_us = position.records["timestamp"].astype(np.int64)
    if gps is None:
        return _log(
            position, time_us.astype(np.float64) * 1e-6, None, " since the start of the autopilot", None, keys, name
        )
    utc_us, gps_time_us = gps.records["time_utc_usec"].astype(np.int64), gps.records["timestamp"].astype(np.int64)
    utc_less_time_us = utc_us - gps_time_us
    offset_us = int(np.sort(utc_less_time_us)[len(utc_less_time_us) // 2])
    # The largest 5 % are ignored, because a receiver may have a wrong number of leap seconds at first.
    spread = float(np.percentile(np.abs(utc_less_time_us - offset_us), 95)) * 1e-6
    if spread > _MAX_CLOCK_DRIFT_S:
        raise PathFileError(
            f"{name}: the clocks of the GPS topic and of the autopilot drift apart by {spread:.3g} s",
            f"accepted: {_MAX_CLOCK_DRIFT_S:g} s",
        )
    separations = None
    if gps.has(gps.units.height) and gps.has(gps.units.altitude):
        with np.errstate(over="ignore", invalid="ignore"):
            geoid_heights = (gps.column(gps.units.height) - gps.column(gps.units.altitude)) * gps.units.metres
        separations = np.full(len(time_us), float(np.median(geoid_heights)))
    start = unix_instant(int(time_us[0]) + offset_us)
    words = f", UTC of {gps.name} to {spread:.2g} s"
    times = (time_us - time_us[0]).astype(np.float64) * 1e-6
    return _log(position, times, start, words, separations, keys, name)


def _log(
    topic: _Topic,
    times: Floats,
    start: Instant | None,
    source_words: str,
    separations: Floats | None,
    keys: LogKeys,
    name: str,
) -> Log:
    """Make a log from the records of a topic."""
    units = topic.units
    latitude, longitude = (
        np.radians(topic.column(field) * units.degrees) for field in (units.latitude, units.longitude)
    )
    if topic.has(units.height):
        hold_to_ellipsoid(keys, name)
        height = topic.column(units.height) * units.metres
    else:
        height = from_sea_level(topic.column(units.altitude) * units.metres, separations, keys, name)
    records = LogRecords(name, len(times))
    source_words = source_words if keys.instance is None else f", instance {keys.instance}"
    sigmas = level_sigmas(*(topic.column(field) if topic.has(field) else None for field in _ACCURACY_FIELDS))
    coordinates = (latitude, longitude, height)
    return geodetic_log(records, f"ULog {topic.name}{source_words}", times, start, "utc", coordinates, sigmas)


# ---------------------------------------------------------------------- messages
def _topics(data: bytes, name: str) -> list[_Topic]:
    """Read the topics of a log that have positions.

    If a topic has several instances (receivers), each instance is a separate element of the list.
    """
    formats: dict[str, str] = {}
    layouts: dict[str, tuple[np.dtype[np.void], _Units]] = {}
    subscriptions: dict[int, tuple[str, np.dtype[np.void], _Units, int]] = {}
    payloads: dict[int, list[bytes]] = {}
    for kind, offset, payload in _messages(data, name):
        if kind == ord("D"):
            number = int.from_bytes(payload[:2], "little")
            if number in subscriptions:
                size = subscriptions[number][1].itemsize
                if len(payload) < 2 + size:
                    raise PathFileError(f"{name}: byte {offset}: a record of {subscriptions[number][0]} is cut off")
                payloads[number].append(payload[2 : 2 + size])
        elif kind == ord("F"):
            topic, _, fields = payload.decode("latin-1").partition(":")
            formats.setdefault(topic, fields)
        elif kind == ord("A"):
            number, topic = int.from_bytes(payload[1:3], "little"), payload[3:].decode("latin-1")
            if topic in (*_GPS_TOPICS, _GLOBAL_TOPIC) and number not in subscriptions:
                if topic not in layouts:
                    layouts[topic] = _layout(topic, formats.get(topic, ""), f"{name}: byte {offset}")
                subscriptions[number], payloads[number] = (topic, *layouts[topic], payload[0]), []
        elif kind == ord("B"):
            _hold_to_flags(payload, f"{name}: byte {offset}")
    return [
        _Topic(topic, np.frombuffer(b"".join(payloads[number]), dtype), units, instance)
        for number, (topic, dtype, units, instance) in subscriptions.items()
        if payloads[number]
    ]


def _messages(data: bytes, name: str) -> Iterator[tuple[int, int, bytes]]:
    """Yield the type, byte offset and payload of every complete message in a log.

    The last message may be incomplete because of a power loss; it is then ignored.
    """
    offset, end = _HEADER_BYTES, len(data)
    unpack = struct.Struct("<HB").unpack_from
    while offset + 3 <= end:
        size, kind = unpack(data, offset)
        if kind not in _MESSAGE_TYPES and (kind == 0 or not 0 < size <= _MAX_UNKNOWN_BYTES):
            raise PathFileError(
                f"{name}: byte {offset}: is damaged, no message of a ULog begins there",
                hint="Repair it, or write its GPS topic as CSV by ulog2csv",
            )
        if offset + 3 + size > end:
            return
        yield kind, offset, data[offset + 3 : offset + 3 + size]
        offset += 3 + size


def _hold_to_flags(payload: bytes, location: str) -> None:
    """Refuse a file whose flag message contains flags of a newer, unsupported version of ULog."""
    incompatible = payload[8:16]
    if incompatible[:1] > bytes([_APPENDED_DATA_FLAG_BITS]) or any(incompatible[1:]):
        raise PathFileError(f"{location}: has flags {incompatible.hex()} of a newer kind of ULog")


def _layout(topic: str, fields: str, location: str) -> tuple[np.dtype[np.void], _Units]:
    """Find the required fields of a topic, as a NumPy data type, and the names and units of its coordinates.

    `fields` is the text of the format message (F) of the topic.
    """
    types: dict[str, tuple[str, int]] = {}
    offset = 0
    for field in filter(None, fields.split(";")):
        kind, _, field_name = field.partition(" ")
        element, _, count = kind.rstrip("]").partition("[")
        length = int(count) if count.isascii() and count.isdigit() and len(count) < 6 else 0 if count else 1
        if element not in _TYPES or not length:
            if field_name.startswith("_padding"):
                continue
            raise PathFileError(
                f"{location}: field {shown(field_name)!r} of {topic} has no type of which the size is known"
            )
        if not count:
            types[field_name] = (_TYPES[element], offset)
        offset += length * np.dtype(_TYPES[element]).itemsize
    units = next(
        (
            candidate
            for candidate in (_GLOBAL_UNITS if topic == _GLOBAL_TOPIC else _GPS_UNITS)
            if {candidate.latitude, candidate.longitude} <= types.keys()
            and {candidate.height, candidate.altitude} & types.keys()
        ),
        None,
    )
    needed = ("timestamp",) if topic == _GLOBAL_TOPIC else ("timestamp", "time_utc_usec", "fix_type")
    missing = [field for field in needed if field not in types]
    if units is None or missing:
        raise PathFileError(
            f"{location}: {topic} has no field {missing[0] if missing else 'of a latitude and a height'}"
        )
    optional = (*_ACCURACY_FIELDS, *(_VALIDITY_FIELDS if topic == _GLOBAL_TOPIC else ()))
    names = [field for field in (*needed, *units[:4], *optional) if field in types]
    formats, offsets = zip(*(types[field] for field in names), strict=True)
    for field, kind in zip(names, formats, strict=True):
        if np.dtype(kind).kind not in ("iuf" if field in (*units[:4], *_ACCURACY_FIELDS) else "iu"):
            raise PathFileError(f"{location}: field {field} of {topic} has the type {kind}, which is no number of it")
    return np.dtype({"names": names, "formats": list(formats), "offsets": list(offsets)}), units
