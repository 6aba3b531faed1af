"""A flight whose truth is known without the package, and the files that log it.

Places come from the reduced latitude β: the ellipsoid is (a cos β, b sin β), its normal is along (cos β / a,
sin β / b). Height goes along the normal, and its angle to the equator is the geodetic latitude.
"""

import math
import struct
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

import numpy as np

SEMI_MAJOR, SEMI_MINOR = 6378137.0, 6356752.314245179  # m; the second is the first less 1/298.257223563 of it
START = datetime(2026, 6, 1, 5, 20, 1, 250000, tzinfo=UTC)
WEEK, SECOND = 2421, 105619.25  # of GPS, 18 s ahead of START


class Flight(NamedTuple):
    """Times (n,) [s], Earth-fixed places (n, 3) [m], latitudes, longitudes [rad] and heights [m], each (n,).

    `velocities` (n, 3) are east, north and up. [m/s]
    """

    times: Any
    places: Any
    latitude: Any
    longitude: Any
    height: Any
    velocities: Any


def _at(times: Any) -> Any:
    """A flight of constant height, to the north east, at about 60 m/s."""
    reduced, longitude, height = 0.8384 + 7e-6 * times, 0.1968 + 9e-6 * times, 3000.0
    normal = np.array([np.cos(reduced) / SEMI_MAJOR, np.sin(reduced) / SEMI_MINOR])
    normal /= np.hypot(*normal)
    level, polar = np.array([SEMI_MAJOR * np.cos(reduced), SEMI_MINOR * np.sin(reduced)]) + height * normal
    places = np.stack([level * np.cos(longitude), level * np.sin(longitude), polar], axis=1)
    return places, np.arctan2(normal[1], normal[0]), longitude, np.full_like(times, height)


def flight(count: int = 501, rate: float = 50.0) -> Flight:
    """Fly level, from `START`."""
    times = np.arange(count) / rate
    places, latitude, longitude, height = _at(times)
    rates = (_at(times + 1e-2)[0] - _at(times - 1e-2)[0]) / 2e-2
    zero = np.zeros_like(times)
    east = np.stack([-np.sin(longitude), np.cos(longitude), zero], axis=1)
    up = np.stack(
        [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], axis=1
    )
    axes = (east, np.cross(up, east), up)
    velocities = np.stack([(rates * axis).sum(axis=1) for axis in axes], axis=1)
    return Flight(times, places, latitude, longitude, height, velocities)


def stamp(seconds: float) -> str:
    """Stamp of a time of the flight."""
    return f"{START + timedelta(seconds=seconds):%Y-%m-%dT%H:%M:%S.%f}Z"


def geodetic_csv(flown: Flight) -> bytes:
    """Log with stamps, latitude, longitude and height, to 0.1 nm."""
    rows = zip(flown.times, flown.latitude, flown.longitude, flown.height, strict=True)
    lines = [f"{stamp(t)},{math.degrees(a):.15f},{math.degrees(b):.15f},{h:.9f}" for t, a, b, h in rows]
    return "\n".join(["utc,latitude [deg],longitude [deg],height [m]", *lines, ""]).encode()


def earth_fixed_csv(flown: Flight) -> bytes:
    """Log with seconds and Earth-fixed places, in km and behind other columns."""
    rows = zip(flown.times, flown.places / 1e3, strict=True)
    lines = [f"{n};{x:.13f};{y:.13f};{t * 1e3:.3f};{z:.13f}" for n, (t, (x, y, z)) in enumerate(rows)]
    return "\r\n".join(["# made up", "number;x [km];y [km];time [ms];z [km]", *lines]).encode("utf-8-sig")


def sbet(flown: Flight, turned: float = 0.3, **changes: Any) -> bytes:
    """Trajectory; its wander frame has x to the azimuth -`turned` and y a quarter turn further to the west."""
    east, north, up = flown.velocities.T
    along, aside = (
        north * math.cos(azimuth) + east * math.sin(azimuth) for azimuth in (-turned, -turned - math.pi / 2)
    )
    fields: dict[str, Any] = {
        "time": SECOND + flown.times,
        "latitude": flown.latitude,
        "longitude": flown.longitude,
        "height": flown.height,
        "x": along,
        "y": aside,
        "z": up,
        **dict.fromkeys(("roll", "pitch", "heading"), 0.01),
        "wander": turned,
        **dict.fromkeys(("ax", "ay", "az", "p", "q", "r"), 0.1),
    } | changes
    columns = [np.broadcast_to(np.asarray(value, dtype=float), flown.times.shape) for value in fields.values()]
    return b"".join(struct.pack("<17d", *row) for row in zip(*columns, strict=True))


def smrmsg(
    times: Any, north: Any = 0.02, east: Any = 0.03, down: Any = 0.05, rates: Any = (0.004, 0.005, 0.006)
) -> bytes:
    """Accuracy of a trajectory at times of the flight."""
    columns = [SECOND + np.asarray(times, dtype=float), north, east, down, *rates, 0.5, 0.5, 1.5]
    shaped = [np.broadcast_to(np.asarray(value, dtype=float), np.shape(times)) for value in columns]
    return b"".join(struct.pack("<10d", *row) for row in zip(*shaped, strict=True))
