"""Logs in CSV as exporters write them: which columns tell whose they are, and what those are in plain words.

Airdata, of DJI and other drones: `time(millisecond),datetime(utc),latitude,longitude,…,
altitude_above_seaLevel(feet or meters),…`. Source: the headers in the README of drone-comp/m30ttools and in the
reference of Aarhus University's DroneVideoMeasure, "Drone logfile input format"; the instant is to a second.

PX4, by ulog2csv: topics `vehicle_gps_position` and `sensor_gps` in 1e-7 deg and mm, from release 1.14 on in deg and
m; `vehicle_global_position` in deg and m, on the clock of the autopilot. Source: PX4-Autopilot msg/SensorGps.msg,
msg/versioned/VehicleGlobalPosition.msg; pyulog/ulog2csv.py writes the names of fields.

ArduPilot: rows GPS of a dataflash log, from `mavlogdump.py --format csv --types GPS`, or among others in the text
that Mission Planner and mavlogdump write, whose FMT rows name the columns. Alt is above mean sea level. Source:
ardupilot libraries/AP_GPS/LogStructure.h (LOG_STRUCTURE_FROM_GPS; a Status of 3 is a fix in three dimensions) and
AP_GPS.h (undulation), pymavlink/tools/mavlogdump.py.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

_DEGREE = math.pi / 180
_FEET = 0.3048


class VendorColumn(NamedTuple):
    """A column in plain words: its name, unit and the factor to SI.

    Names are those of plain logs, and `altitude` above mean sea level, `unix` since 1970 in UTC, GPS `week`, kind of
    `fix`, number of the `receiver`.
    """

    name: str
    unit: str = ""
    scale: float = 1.0


class Vendor(NamedTuple):
    """Whose columns: words for reports, names that tell it, and what columns mean; names are in small letters.

    `least_fix` is the kind of fix from which a place has a height.
    """

    words: str
    signs: frozenset[str]
    columns: Mapping[str, VendorColumn]
    least_fix: int = 0


def _vendor(words: str, signs: str, least_fix: int = 0, **columns: VendorColumn) -> Vendor:
    return Vendor(words, frozenset(signs.split()), columns, least_fix)


_LATITUDE, _LONGITUDE = VendorColumn("latitude", "deg", _DEGREE), VendorColumn("longitude", "deg", _DEGREE)
_FIX = VendorColumn("fix")
_UNIX = VendorColumn("unix", "us", 1e-6)
VENDORS = (
    Vendor(
        "CSV of Airdata",
        frozenset(("time(millisecond)", "datetime(utc)", "latitude", "longitude")),
        {
            "time(millisecond)": VendorColumn("time", "ms", 1e-3),
            "datetime(utc)": VendorColumn("utc"),
            "latitude": _LATITUDE,
            "longitude": _LONGITUDE,
            "altitude_above_sealevel(feet)": VendorColumn("altitude", "ft", _FEET),
            "altitude_above_sealevel(meters)": VendorColumn("altitude", "m"),
        },
    ),
    _vendor(
        "CSV of PX4's GPS topic",
        "time_utc_usec lat lon fix_type",
        3,
        time_utc_usec=_UNIX,
        lat=VendorColumn("latitude", "1e-7 deg", 1e-7 * _DEGREE),
        lon=VendorColumn("longitude", "1e-7 deg", 1e-7 * _DEGREE),
        alt_ellipsoid=VendorColumn("height", "mm", 1e-3),
        alt=VendorColumn("altitude", "mm", 1e-3),
        fix_type=_FIX,
    ),
    _vendor(
        "CSV of PX4's GPS topic",
        "time_utc_usec latitude_deg longitude_deg fix_type",
        3,
        time_utc_usec=_UNIX,
        latitude_deg=_LATITUDE,
        longitude_deg=_LONGITUDE,
        altitude_ellipsoid_m=VendorColumn("height", "m"),
        altitude_msl_m=VendorColumn("altitude", "m"),
        fix_type=_FIX,
    ),
    _vendor(
        "CSV of PX4's global position",
        "timestamp lat lon alt terrain_alt",
        1,
        lat_lon_valid=_FIX,
        timestamp=VendorColumn("time", "us", 1e-6),
        lat=_LATITUDE,
        lon=_LONGITUDE,
        alt_ellipsoid=VendorColumn("height", "m"),
        alt=VendorColumn("altitude", "m"),
    ),
    _vendor(
        "GPS rows of ArduPilot",
        "gwk gms lat lng alt status",
        3,
        gwk=VendorColumn("week"),
        gms=VendorColumn("time", "ms", 1e-3),
        lat=_LATITUDE,
        lng=_LONGITUDE,
        alt=VendorColumn("altitude", "m"),
        status=_FIX,
        i=VendorColumn("receiver"),
    ),
)


def vendor_of(names: Sequence[str]) -> Vendor | None:
    """Whose columns these are; None where they are nobody's. Names are in small letters."""
    return next((one for one in VENDORS if one.signs.issubset(names)), None)


def dataflash_as_csv(lines: list[str]) -> list[str]:
    """Lines of a dataflash log with its GPS rows alone, and their FMT row as the header; other lines as they are.

    Each line keeps its number.
    """
    if not any(line.startswith("FMT,") for line in lines[:100]):
        return lines
    found = []
    header = ""
    for line in lines:
        kept = ""
        if line.startswith("GPS,"):
            kept = line if header else ""
        elif line.startswith("FMT,") and not header:
            cells = [cell.strip() for cell in line.split(",")]
            if cells[3:4] == ["GPS"]:
                kept = header = ",".join(["GPS", *cells[5:]])
        found.append(kept)
    return found
