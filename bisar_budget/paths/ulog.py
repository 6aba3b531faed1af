"""Logs of PX4 (ULog, `.ulg`): places of the GPS topic, or of the global position that the autopilot estimates.

A ULog is messages of a size, a type and a payload: formats of topics (F), names of topics by a number (A), and
records of them (D). The topics `vehicle_gps_position` and `sensor_gps` have their own UTC, and heights above the
ellipsoid; `vehicle_global_position` counts from the start of the autopilot, and gets UTC from the GPS topic. Both
state standard deviations of each place, `eph` on the level and `epv` of the height. Attitude is not read.

Source: PX4 user guide, "ULog File Format"; PX4-Autopilot msg/SensorGps.msg (latitude_deg and so on, before release
1.14 lat in 1e-7 deg and alt in mm) and msg/versioned/VehicleGlobalPosition.msg. pyulog expands every topic of a file
before it looks at the names wanted, to any size, and prints what it finds damaged; it reads along in the tests alone.
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
_HEADER = 16  # bytes: the magic, the version, the time at which the log begins
_APPENDED = 1  # the one flag of a newer kind of file that readers have to know and this one does
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
_KNOWN = frozenset(b"FADBIMPQRLCSO")
_LONGEST = 10_000  # bytes of a message of an unknown type, which is skipped
_GPS, _GLOBAL = ("vehicle_gps_position", "sensor_gps"), "vehicle_global_position"
_LATEST = 1 << 60  # µs; the year 38 000
_LEAST_FIX = 3  # in three dimensions
_ACCURACY = ("eph", "epv")  # m
_VALID = ("lat_lon_valid", "alt_valid")  # of the global position, since release 1.16
_CLOCKS_APART_S = 1.0  # jitter of a message of the receiver; more, and its time is not that of the record


class _Units(NamedTuple):
    """Names of the fields of a place and their factors to degrees and metres: some topics have two sets."""

    latitude: str
    longitude: str
    height: str
    altitude: str
    degrees: float = 1.0
    metres: float = 1.0


_OF_GPS = (
    _Units("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "altitude_msl_m"),
    _Units("lat", "lon", "alt_ellipsoid", "alt", 1e-7, 1e-3),
)
_OF_GLOBAL = (_Units("lat", "lon", "alt_ellipsoid", "alt"),)

Records = NDArray[np.void]


class _Topic(NamedTuple):
    """Records of a topic, one for each message, the names of its fields, and the instance of the receiver."""

    name: str
    records: Records
    units: _Units
    instance: int = 0

    def column(self, field: str) -> Floats:
        values: Floats = self.records[field].astype(np.float64)
        return values

    def has(self, field: str) -> bool:
        return field in (self.records.dtype.names or ())


def is_ulog(data: bytes) -> bool:
    """Whether a file begins like a ULog."""
    return data.startswith(_MAGIC)


def read_ulog(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read the places of a flight, as every reader of `LOG_FORMATS` does.

    Of the GPS topic and the global position those count of which there are more. Of several receivers the mission
    file chooses one; then places are those of its GPS topic.
    """
    hold_to_scale("utc", keys, name)
    if not is_ulog(data):
        raise PathFileError(f"{name}: is no ULog: it does not begin with 'ULog'")
    topics = [one for one in map(_with_places, _topics(data, name)) if _count(one)]
    of_gps = [one for one in topics if one.name in _GPS]
    gps = max(of_gps, key=_count, default=None)
    places = max((one for one in topics if one.name == _GLOBAL), key=_count, default=None)
    if places is not None and (gps is None or _count(places) > _count(gps)) and keys.instance is None:
        return _of_global(places, gps, keys, name)
    if of_gps:
        most: dict[float, int] = {}
        for topic in of_gps:
            most[topic.instance] = max(most.get(topic.instance, 0), _count(topic))
        chosen = one_instance(most, keys, name)
        gps = max((topic for topic in of_gps if topic.instance == chosen), key=_count)
    if gps is None:
        raise PathFileError(
            f"{name}: has no place", f"accepted: a ULog with the topic {', '.join(_GPS)} (with a fix) or {_GLOBAL}"
        )
    return _of_gps(gps, keys, name)


def _count(topic: _Topic) -> int:
    return len(topic.records)


def _with_places(topic: _Topic) -> _Topic:
    """Records of a topic that have a place; of a GPS topic a time of UTC too, which is 0 before there is one."""
    records = topic.records
    if topic.name in _GPS:
        micro = records["time_utc_usec"]
        is_kept = (records["fix_type"] >= _LEAST_FIX) & (micro > 0) & (micro < _LATEST)
    else:
        is_kept = records["timestamp"] < _LATEST
        for field in filter(topic.has, _VALID):
            is_kept &= records[field] != 0
    return topic._replace(records=records[is_kept])


def _of_gps(gps: _Topic, keys: LogKeys, name: str) -> Log:
    micro = gps.records["time_utc_usec"].astype(np.int64)
    times = (micro - micro[0]).astype(np.float64) * 1e-6
    return _log(gps, times, unix_instant(int(micro[0])), "", None, keys, name)


def _of_global(places: _Topic, gps: _Topic | None, keys: LogKeys, name: str) -> Log:
    """Log of the autopilot's own estimate; without a GPS topic it has no UTC, and counts seconds since the start."""
    micro = places.records["timestamp"].astype(np.int64)
    if gps is None:
        return _log(
            places, micro.astype(np.float64) * 1e-6, None, " since the start of the autopilot", None, keys, name
        )
    utc, own = gps.records["time_utc_usec"].astype(np.int64), gps.records["timestamp"].astype(np.int64)
    ahead = utc - own
    middle = int(np.sort(ahead)[len(ahead) // 2])
    spread = float(np.percentile(np.abs(ahead - middle), 95)) * 1e-6  # a receiver corrects its leap seconds once
    if spread > _CLOCKS_APART_S:
        raise PathFileError(
            f"{name}: the clocks of the GPS topic and of the autopilot drift apart by {spread:.3g} s",
            f"accepted: {_CLOCKS_APART_S:g} s",
        )
    separations = None
    if gps.has(gps.units.height) and gps.has(gps.units.altitude):
        with np.errstate(over="ignore", invalid="ignore"):
            above = (gps.column(gps.units.height) - gps.column(gps.units.altitude)) * gps.units.metres
        separations = np.full(len(micro), float(np.median(above)))
    start = unix_instant(int(micro[0]) + middle)
    words = f", UTC of {gps.name} to {spread:.2g} s"
    times = (micro - micro[0]).astype(np.float64) * 1e-6
    return _log(places, times, start, words, separations, keys, name)


def _log(
    topic: _Topic,
    times: Floats,
    start: Instant | None,
    said: str,
    separations: Floats | None,
    keys: LogKeys,
    name: str,
) -> Log:
    """The log of a topic."""
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
    said = said if keys.instance is None else f", instance {keys.instance}"
    sigmas = level_sigmas(*(topic.column(field) if topic.has(field) else None for field in _ACCURACY))
    places = (latitude, longitude, height)
    return geodetic_log(records, f"ULog {topic.name}{said}", times, start, "utc", places, sigmas)


# ---------------------------------------------------------------------- messages
def _topics(data: bytes, name: str) -> list[_Topic]:
    """Topics of places, each of one instance, with their records."""
    formats: dict[str, str] = {}
    layouts: dict[str, tuple[np.dtype[np.void], _Units]] = {}
    wanted: dict[int, tuple[str, np.dtype[np.void], _Units, int]] = {}
    payloads: dict[int, list[bytes]] = {}
    for kind, at, payload in _messages(data, name):
        if kind == ord("D"):
            number = int.from_bytes(payload[:2], "little")
            if number in wanted:
                size = wanted[number][1].itemsize
                if len(payload) < 2 + size:
                    raise PathFileError(f"{name}: byte {at}: a record of {wanted[number][0]} is cut off")
                payloads[number].append(payload[2 : 2 + size])
        elif kind == ord("F"):
            topic, _, fields = payload.decode("latin-1").partition(":")
            formats.setdefault(topic, fields)
        elif kind == ord("A"):
            number, topic = int.from_bytes(payload[1:3], "little"), payload[3:].decode("latin-1")
            if topic in (*_GPS, _GLOBAL) and number not in wanted:
                if topic not in layouts:
                    layouts[topic] = _layout(topic, formats.get(topic, ""), f"{name}: byte {at}")
                wanted[number], payloads[number] = (topic, *layouts[topic], payload[0]), []
        elif kind == ord("B"):
            _hold_to_flags(payload, f"{name}: byte {at}")
    return [
        _Topic(topic, np.frombuffer(b"".join(payloads[number]), dtype), units, instance)
        for number, (topic, dtype, units, instance) in wanted.items()
        if payloads[number]
    ]


def _messages(data: bytes, name: str) -> Iterator[tuple[int, int, bytes]]:
    """Type, byte and payload of every message that is whole; the last may be cut off, as when power fails."""
    at, end = _HEADER, len(data)
    unpack = struct.Struct("<HB").unpack_from
    while at + 3 <= end:
        size, kind = unpack(data, at)
        if kind not in _KNOWN and (kind == 0 or not 0 < size <= _LONGEST):
            raise PathFileError(
                f"{name}: byte {at}: is damaged, no message of a ULog begins there",
                hint="Repair it, or write its GPS topic as CSV by ulog2csv",
            )
        if at + 3 + size > end:
            return
        yield kind, at, data[at + 3 : at + 3 + size]
        at += 3 + size


def _hold_to_flags(payload: bytes, where: str) -> None:
    """Refuse a file of a newer kind."""
    incompatible = payload[8:16]
    if incompatible[:1] > bytes([_APPENDED]) or any(incompatible[1:]):
        raise PathFileError(f"{where}: has flags {incompatible.hex()} of a newer kind of ULog")


def _layout(topic: str, fields: str, where: str) -> tuple[np.dtype[np.void], _Units]:
    """Fields of a topic that are read, as NumPy has them, and the names of its places."""
    found: dict[str, tuple[str, int]] = {}
    offset = 0
    for field in filter(None, fields.split(";")):
        kind, _, own = field.partition(" ")
        element, _, count = kind.rstrip("]").partition("[")
        number = int(count) if count.isascii() and count.isdigit() and len(count) < 6 else 0 if count else 1
        if element not in _TYPES or not number:
            if own.startswith("_padding"):
                continue
            raise PathFileError(f"{where}: field {shown(own)!r} of {topic} has no type of which the size is known")
        if not count:
            found[own] = (_TYPES[element], offset)
        offset += number * np.dtype(_TYPES[element]).itemsize
    known = next(
        (
            one
            for one in (_OF_GLOBAL if topic == _GLOBAL else _OF_GPS)
            if {one.latitude, one.longitude} <= found.keys() and {one.height, one.altitude} & found.keys()
        ),
        None,
    )
    needed = ("timestamp",) if topic == _GLOBAL else ("timestamp", "time_utc_usec", "fix_type")
    missing = [field for field in needed if field not in found]
    if known is None or missing:
        raise PathFileError(
            f"{where}: {topic} has no field {missing[0] if missing else 'of a latitude and a height'}"
        )
    optional = (*_ACCURACY, *(_VALID if topic == _GLOBAL else ()))
    wanted = [field for field in (*needed, *known[:4], *optional) if field in found]
    formats, offsets = zip(*(found[field] for field in wanted), strict=True)
    for field, kind in zip(wanted, formats, strict=True):
        if np.dtype(kind).kind not in ("iuf" if field in (*known[:4], *_ACCURACY) else "iu"):
            raise PathFileError(f"{where}: field {field} of {topic} has the type {kind}, which is no number of it")
    return np.dtype({"names": wanted, "formats": list(formats), "offsets": list(offsets)}), known
