"""Files of the flight of `flown` in formats of receivers and autopilots, written without the package.

Each writer has as many digits as such a file has.
"""

import math
import struct
from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from tests.paths.flown import SECOND, SEMI_MAJOR, START, WEEK, Flight

GPS_AHEAD = timedelta(seconds=18)
SEPARATION = 46.9  # m, of the geoid above the ellipsoid
SIGMAS = (0.008, 0.010, 0.020)  # m, east, north, up
Stamp = Callable[[float], str]


def at(seconds: float, ahead: timedelta = timedelta(0), start: datetime = START) -> datetime:
    """Date and time of a time of the flight, on a clock that is ahead of UTC."""
    return start + timedelta(seconds=float(seconds)) + ahead


def _places(flown: Flight) -> Iterable[tuple[float, float, float, float]]:
    """Time, latitude and longitude in degrees, height above the ellipsoid."""
    return zip(flown.times, np.degrees(flown.latitude), np.degrees(flown.longitude), flown.height, strict=True)


# ---------------------------------------------------------------------- RTKLIB
_QUALITIES = ",Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)"
_SPREAD = ("sdn(m)", "sde(m)", "sdu(m)", "sdne(m)", "sdeu(m)", "sdun(m)", "age(s)", "ratio")
_AHEAD = {"GPST": timedelta(seconds=18), "UTC": timedelta(0), "JST": timedelta(hours=9)}


def calendar(system: str = "GPST", start: datetime = START) -> Stamp:
    """Times as dates."""
    return lambda seconds: f"{at(seconds, _AHEAD[system], start):%Y/%m/%d %H:%M:%S.%f}"[:-3]


def week_and_second(seconds: float) -> str:
    """GPS week and its second."""
    return f"{WEEK:4d} {SECOND + seconds:10.3f}"


def sexagesimal(degrees: float) -> str:
    """Degrees, minutes and seconds, the sign before the degrees."""
    whole = round(abs(degrees) * 3600e5)
    minutes, seconds = divmod(whole, 6000000)
    return f"{math.copysign(minutes // 60, degrees):4.0f} {minutes % 60:02d} {seconds / 1e5:08.5f}"


def solution(
    flown: Flight,
    stamp: Stamp | None = None,
    *,
    system: str = "GPST",
    height: str = "ellipsoidal",
    is_in_minutes: bool = False,
    separator: str = " ",
    sigmas: tuple[float, float, float] = SIGMAS,
) -> bytes:
    """Solution of latitude, longitude and height; `height` says what heights count from."""
    stamp = stamp or calendar(system)
    unit = "d'\"" if is_in_minutes else "deg"
    names = [f"latitude({unit})", f"longitude({unit})", "height(m)", "Q", "ns", *_SPREAD]
    lines = [
        "% program   : RTKPOST ver.2.4.3",
        f"% (lat/lon/height=WGS84/{height}{_QUALITIES}",
        f"%  {system:<22}{separator}" + separator.join(f"{name:>14}" for name in names),
    ]
    east, north, up = sigmas
    below = SEPARATION if height == "geodetic" else 0.0
    for number, (time, latitude, longitude, above) in enumerate(_places(flown)):
        angles = [sexagesimal(one) if is_in_minutes else f"{one:14.9f}" for one in (latitude, longitude)]
        cells = [*angles, f"{above - below:10.4f}", "  1" if number % 50 else "  2", " 12"]
        cells += [f"{one:8.4f}" for one in (north, east, up, 0.001, -0.002, 0.003)] + ["  0.00", "   3.1"]
        lines.append(separator.join([stamp(time), *(part for cell in cells for part in cell.split())]))
    return "\n".join([*lines, ""]).encode()


def solution_in_x_y_z(flown: Flight, covariance: Any) -> bytes:
    """Solution of Earth-fixed places, whose errors have a covariance matrix along x, y, z [m²]."""
    names = ["x-ecef(m)", "y-ecef(m)", "z-ecef(m)", "Q", "ns", "sdx(m)", "sdy(m)", "sdz(m)"]
    names += ["sdxy(m)", "sdyz(m)", "sdzx(m)", "age(s)", "ratio"]
    lines = [f"% (x/y/z-ecef=WGS84{_QUALITIES}", f"%  {'GPST':<22} " + " ".join(f"{name:>14}" for name in names)]
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
    roots = [math.copysign(math.sqrt(abs(covariance[i][j])), covariance[i][j]) for i, j in pairs]
    for time, place in zip(flown.times, flown.places, strict=True):
        cells = (
            [f"{one:14.4f}" for one in place] + ["  5", "  7"] + [f"{one:12.8f}" for one in roots] + ["0.00", "0.0"]
        )
        lines.append(" ".join([calendar()(time), *cells]))
    return "\r\n".join([*lines, ""]).encode()


METRES_A_DEGREE = math.radians(SEMI_MAJOR)


# ---------------------------------------------------------------------- NMEA 0183
def sentence(body: str) -> str:
    """A sentence with its checksum, the exclusive or of its characters."""
    checksum = 0
    for character in body:
        checksum ^= ord(character)
    return f"${body}*{checksum:02X}"


def minutes(degrees: float, width: int, sides: str) -> str:
    """Degrees and minutes to 1e-7 minutes, and the side."""
    whole = round(abs(degrees) * 60e7)
    return f"{whole // (60 * 10**7):0{width}d}{whole % (60 * 10**7) / 1e7:010.7f},{sides[int(degrees < 0)]}"


def rmc(time: float, talker: str = "GN", start: datetime = START) -> str:
    """Recommended minimum: time and date."""
    moment = at(time, start=start)
    return sentence(f"{talker}RMC,{moment:%H%M%S.%f},A,4805.0,N,01116.0,E,116.6,045.0,{moment:%d%m%y},,,R")


def zda(time: float, start: datetime = START) -> str:
    """Time and date, and a local zone that changes nothing."""
    return sentence(f"GPZDA,{at(time, start=start):%H%M%S.%f,%d,%m,%Y},-05,30")


def gga(
    time: float,
    latitude: float,
    longitude: float,
    above: float,
    talker: str = "GN",
    start: datetime = START,
    separation: str = f"{SEPARATION:.4f}",
    quality: int = 4,
) -> str:
    """Fix; its height is above the sea."""
    clock, height = f"{at(time, start=start):%H%M%S.%f}", f"{above - SEPARATION:.4f}"
    place = f"{minutes(latitude, 2, 'NS')},{minutes(longitude, 3, 'EW')}"
    return sentence(f"{talker}GGA,{clock},{place},{quality},12,0.7,{height},M,{separation},M,1.0,0000")


def gns(time: float, latitude: float, longitude: float, above: float, modes: str = "RR") -> str:
    """Fix of several systems."""
    place = f"{minutes(latitude, 2, 'NS')},{minutes(longitude, 3, 'EW')}"
    clock, height = f"{at(time):%H%M%S.%f}", f"{above - SEPARATION:.4f}"
    return sentence(f"GNGNS,{clock},{place},{modes},12,0.7,{height},{SEPARATION:.4f},1.0,0000")


def gst(time: float, east: float, north: float, up: float, talker: str = "GN", start: datetime = START) -> str:
    """One-sigma errors of a fix, which the sentence has as latitude, longitude, height."""
    clock = f"{at(time, start=start):%H%M%S.%f}"
    return sentence(f"{talker}GST,{clock},9.9,,,,{north:.4f},{east:.4f},{up:.4f}")


def nmea(flown: Flight, place: Callable[..., str] = gga, date: Callable[..., str] = rmc, **more: Any) -> bytes:
    """Log of sentences, with dates behind places and with sentences that say nothing of either."""
    dated = {"start": more["start"]} if "start" in more else {}
    lines = []
    for one in _places(flown):
        lines += [place(*one, **more), sentence("GNGST,052001.25,,,,,0.01,0.01,0.02"), date(one[0], **dated)]
    return "\r\n".join([*lines, ""]).encode()


# ---------------------------------------------------------------------- GPX
def point(
    time: float,
    latitude: float,
    longitude: float,
    above: float,
    zone: str = "Z",
    start: datetime = START,
    has_separation: bool = True,
) -> str:
    """Point of a track; its elevation is above the sea."""
    moment = f"{at(time, start=start):%Y-%m-%dT%H:%M:%S.%f}{zone}"
    geoid = f"<geoidheight>{SEPARATION:.4f}</geoidheight>" if has_separation else ""
    place = f'lat="{latitude:.9f}" lon="{longitude:.9f}"'
    return f"<trkpt {place}><ele>{above - SEPARATION:.4f}</ele><time>{moment}</time>{geoid}</trkpt>"


def gpx(flown: Flight, segments: int = 1, prefix: str = "", **more: Any) -> bytes:
    """Track of some segments of the same length, in one namespace with or without a prefix."""
    points = [point(*one, **more) for one in _places(flown)]
    size = math.ceil(len(points) / segments)
    parts = ["\n".join(points[n : n + size]) for n in range(0, len(points), size)]
    body = "".join(f"<trkseg>\n{part}\n</trkseg>\n" for part in parts)
    name = f"xmlns{':' if prefix else ''}{prefix}"
    text = (
        f'<gpx version="1.1" {name}="http://www.topografix.com/GPX/1/1">\n<trk><name>a</name>\n{body}</trk></gpx>\n'
    )
    for tag in ("gpx", "trkseg", "trkpt", "trk", "name", "ele", "time", "geoidheight") if prefix else ():
        text = text.replace(f"<{tag}>", f"<{prefix}:{tag}>").replace(f"<{tag} ", f"<{prefix}:{tag} ")
        text = text.replace(f"</{tag}>", f"</{prefix}:{tag}>")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text.encode()


# ---------------------------------------------------------------------- ULog of PX4
_STRUCT = {
    "uint64_t": "Q",
    "int32_t": "i",
    "uint32_t": "I",
    "uint8_t": "B",
    "bool": "?",
    "float": "f",
    "double": "d",
    "char[4]": "4s",
}
GPS_OF_OLD = (
    ("uint64_t", "timestamp"),
    ("uint64_t", "time_utc_usec"),
    ("int32_t", "lat"),
    ("int32_t", "lon"),
    ("int32_t", "alt"),
    ("int32_t", "alt_ellipsoid"),
    ("float", "eph"),
    ("char[4]", "made_up"),
    ("uint8_t", "fix_type"),
    ("uint8_t", "_padding0"),
)
GPS_OF_NOW = (
    ("uint64_t", "timestamp"),
    ("uint64_t", "timestamp_sample"),
    ("double", "latitude_deg"),
    ("double", "longitude_deg"),
    ("double", "altitude_msl_m"),
    ("double", "altitude_ellipsoid_m"),
    ("uint64_t", "time_utc_usec"),
    ("uint32_t", "device_id"),
    ("uint8_t", "fix_type"),
)
GLOBAL = (
    ("uint64_t", "timestamp"),
    ("uint64_t", "timestamp_sample"),
    ("double", "lat"),
    ("double", "lon"),
    ("float", "alt"),
    ("float", "alt_ellipsoid"),
    ("float", "terrain_alt"),
    ("bool", "dead_reckoning"),
)
BOOT = 20_000_000  # µs of the autopilot's clock at `START`


def message(kind: str, payload: bytes) -> bytes:
    """Message of a ULog."""
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def topic(
    name: str,
    fields: tuple[tuple[str, str], ...],
    number: int,
    records: Iterable[dict[str, Any]],
    instance: int = 0,
) -> tuple[bytes, bytes]:
    """Format of a topic; its number and its records. Fields that a record does not name are 0, no padding follows."""
    text = f"{name}:" + "".join(f"{kind} {field};" for kind, field in fields)
    fields = tuple(one for one in fields if not one[1].startswith("_padding"))
    form = "<" + "".join(_STRUCT[kind] for kind, _ in fields)
    found = message("A", struct.pack("<BH", instance, number) + name.encode())
    for record in records:
        values = [record.get(field, b"" if kind.startswith("char") else 0) for kind, field in fields]
        found += message("D", struct.pack("<H", number) + struct.pack(form, *values))
    return message("F", text.encode()), found


def gps_records(flown: Flight, late: float = 0.0, fix: int = 3, start: datetime = START) -> Iterable[dict[str, Any]]:
    """Records of a GPS topic with the names of both releases; they come `late` at the autopilot [s]."""
    epoch = round(start.timestamp() * 1e6)
    for time, latitude, longitude, above in _places(flown):
        micro = round(time * 1e6)
        yield {
            "timestamp": BOOT + micro + round(late * 1e6),
            "time_utc_usec": epoch + micro,
            "lat": round(latitude * 1e7),
            "lon": round(longitude * 1e7),
            "alt": round((above - SEPARATION) * 1e3),
            "alt_ellipsoid": round(above * 1e3),
            "latitude_deg": latitude,
            "longitude_deg": longitude,
            "altitude_msl_m": above - SEPARATION,
            "altitude_ellipsoid_m": above,
            "fix_type": fix,
        }


def global_records(flown: Flight) -> Iterable[dict[str, Any]]:
    """Records of the autopilot's own estimate, on its own clock."""
    for time, latitude, longitude, above in _places(flown):
        yield {
            "timestamp": BOOT + round(time * 1e6),
            "lat": latitude,
            "lon": longitude,
            "alt": above - SEPARATION,
            "alt_ellipsoid": above,
        }


def ulog(*topics: tuple[bytes, bytes]) -> bytes:
    """A ULog with flags, an information and topics among messages that are not read."""
    flags = message("B", bytes(40))
    begin = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", BOOT)
    information = message("I", bytes([len(b"char[3] sys")]) + b"char[3] sysPX4")
    text = message("L", b"6" + struct.pack("<Q", BOOT) + b"[commander] Takeoff")
    sync = message("S", bytes.fromhex("2F731320250CBB12"))
    formats = b"".join(one for one, _ in topics)
    return begin + flags + information + formats + text + sync.join(records for _, records in topics)


# ---------------------------------------------------------------------- CSV of exporters
AIRDATA = (
    "time(millisecond),datetime(utc),latitude,longitude,height_above_takeoff({0}),"
    "height_above_ground_at_drone_location({0}),ground_elevation_at_drone_location({0}),altitude_above_seaLevel({0}),"
    "height_sonar({0}),speed(m/s),satellites, xSpeed(m/s), pitch(degrees),isPhoto,flycState,message"
)


def airdata(flown: Flight, unit: str = "meters", start: datetime = START) -> bytes:
    """Export of Airdata, whose instants are cut to seconds; a message has a comma."""
    lines = [AIRDATA.format(unit), f"0,,0,0,0,0,0,0,0,0,0,0,0,0,{'Motors_Started'},"]
    size = {"meters": 1.0, "feet": 0.3048}[unit]
    for number, (time, latitude, longitude, above) in enumerate(_places(flown)):
        moment = f"{at(time, start=start):%Y-%m-%d %H:%M:%S}"
        heights = [f"{one / size:.4f}" for one in (100.0, 100.0, 2800.0, above - SEPARATION)]
        said = '"Low battery, returning"' if number == 7 else ""
        cells = [str(5000 + round(time * 1e3)), moment, f"{latitude:.13f}", f"{longitude:.13f}", *heights]
        lines.append(",".join([*cells, "0", "60.1", "18", "42.5", "-1.2", "0", "P-GPS", said]))
    return "\n".join([*lines, ""]).encode()


def px4_csv(flown: Flight, fields: tuple[tuple[str, str], ...], records: Iterable[dict[str, Any]]) -> bytes:
    """What ulog2csv writes of a topic: names of fields, the numbers as Python has them."""
    names = [field for _, field in fields if not field.startswith("_padding")]
    lines = [",".join(names)]
    for record in records:
        lines.append(",".join(str(record.get(name, 0)) for name in names))
    return "\n".join([*lines, ""]).encode()


DATAFLASH = "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"


def _gps_rows(flown: Flight, week_second: float = SECOND) -> Iterable[list[str]]:
    for time, latitude, longitude, above in _places(flown):
        moment = week_second + time
        week, second = WEEK + int(moment // 604800), moment % 604800
        yield [
            *(str(BOOT + round(time * 1e6)), "0", "6", str(round(second * 1e3)), str(week), "18", "0.62"),
            *(f"{latitude:.7f}", f"{longitude:.7f}", f"{above - SEPARATION:.2f}", "60.1", "45.0", "0.1", "0", "1"),
        ]


def dataflash(flown: Flight, week_second: float = SECOND) -> bytes:
    """Text of a dataflash log: formats, then rows of several kinds, of two receivers."""
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 131, 67, GPA, QBCCCCfBIHeHH, TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,AEl,RTCMFU,RTCMFD",
        f"FMT, 130, 50, GPS, QBBIHBcLLeffffB, {DATAFLASH}",
        "PARM, 1000, GPS_TYPE, 1",
        "GPS, 19000000, 0, 1, 0, 0, 0, 99.99, 0, 0, 0, 0, 0, 0, 0, 1",
    ]
    for number, row in enumerate(_gps_rows(flown, week_second)):
        lines += [f"GPS, {', '.join(row)}", f"ATT, {row[0]}, 0, 0, 0, 0, 0, 0"]
        if number % 5 == 0:
            lines.append(f"GPS, {', '.join([row[0], '1', '3', *row[3:7], '-35.0', '149.0', '600.00', *row[10:]])}")
    return "\r\n".join([*lines, ""]).encode()


def mavlogdump(flown: Flight) -> bytes:
    """What `mavlogdump.py --format csv --types GPS` writes."""
    rows = [f"{START.timestamp():.8f},{','.join(row)}" for row in _gps_rows(flown)]
    return "\n".join([f"timestamp,{DATAFLASH}", *rows, ""]).encode()


# ---------------------------------------------------------------------- of each format one
def every_format(flown: Flight) -> dict[str, tuple[str, bytes, dict[str, Any]]]:
    """Format, file and keys of the mission that it needs, by the name of the file."""
    above_sea = {"geoid_separation": f"{SEPARATION} m"}
    gps, own = gps_records(flown), global_records(flown)
    return {
        "a.pos": ("pos", solution(flown), {}),
        "seconds.pos": ("pos", solution(flown, week_and_second, is_in_minutes=True), {}),
        "ecef.pos": ("pos", solution_in_x_y_z(flown, np.diag([1e-4, 1e-4, 4e-4])), {}),
        "a.nmea": ("nmea", nmea(flown), {}),
        "gns.log": ("nmea", nmea(flown, gns, zda), {}),
        "a.gpx": ("gpx", gpx(flown), {}),
        "a.ulg": ("ulog", ulog(topic("vehicle_gps_position", GPS_OF_OLD, 1, gps)), {}),
        "now.ulg": ("ulog", ulog(topic("sensor_gps", GPS_OF_NOW, 1, gps_records(flown))), {}),
        "own.ulg": (
            "ulog",
            ulog(
                topic("vehicle_gps_position", GPS_OF_OLD, 1, [*gps_records(flown)][::10]),
                topic("vehicle_global_position", GLOBAL, 2, own),
            ),
            {},
        ),
        "px4.csv": ("csv", px4_csv(flown, GPS_OF_OLD, gps_records(flown)), {}),
        "px4_now.csv": ("csv", px4_csv(flown, GPS_OF_NOW, gps_records(flown)), {}),
        "dataflash.log": ("csv", dataflash(flown), above_sea | {"instance": 0}),
        "mavlogdump.csv": ("csv", mavlogdump(flown), above_sea),
        "airdata.csv": ("csv", airdata(flown), above_sea),
    }
