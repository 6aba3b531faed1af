"""Tracks of GPX 1.0 and 1.1: points with time and elevation, of one segment or of several whose times rise.

    <trkpt lat="48.086600" lon="11.279700"><ele>2953.1</ele><time>2026-06-01T05:20:01.250Z</time>
    <geoidheight>46.9</geoidheight></trkpt>

An elevation is above mean sea level; `geoidheight` is the height of the geoid above the ellipsoid. Times are in UTC,
or have an offset from it.

Source: http://www.topografix.com/GPX/1/1/, types wptType and trkType. The tree is that of `messages.parse_markup`: it
refuses document types, bounds sizes and knows lines, where gpxpy does not.
"""

import re

import numpy as np

from bisar_budget.faults import shown
from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import Instant, parse_instant
from bisar_budget.paths.log_places import LogKeys, LogRows, from_sea_level, geodetic_log, hold_to_scale
from bisar_budget.paths.messages import MessageElement, hold_to_size, number_in, parse_markup

_ROOT = re.compile(rb"<(?:[\w.-]+:)?gpx[\s>]")
_OFFSET = re.compile(r"([\d-]{10}T[\d:.]{8,21})([+-])(\d\d):([0-5]\d)", re.ASCII)


def is_gpx(data: bytes) -> bool:
    """Whether a file is XML whose root is that of GPX."""
    head = data[:10_000]
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") and bool(_ROOT.search(head))


def read_gpx(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read the track of a file, as every reader of `LOG_FORMATS` does; by the time scale utc a time needs no zone."""
    hold_to_scale("utc", keys, name)
    hold_to_size(len(data), name, "track")
    top = parse_markup(data, name)
    if not any(child.name == "gpx" for child in top.children):
        raise PathFileError(f"{name}:1: is no GPX, its root is {shown(top.children[0].name)}")
    tracks = [track for track in top.all("trk") if any(track.all("trkpt"))]
    if len(tracks) != 1:
        raise PathFileError(
            f"{name}: has {f'{len(tracks)} tracks' if tracks else 'no track'} with points", "accepted: one track"
        )
    points = list(tracks[0].all("trkpt"))
    segments = sum(any(segment.all("trkpt")) for segment in tracks[0].all("trkseg"))
    instants = [_instant(point, name, keys) for point in points]
    start = instants[0]
    rows = LogRows(name, np.array([point.line for point in points]))
    degrees = np.array([[_degrees(point, key, name) for key in ("lat", "lon")] for point in points])
    latitude, longitude = np.radians(degrees).T
    elevations = np.array([_metres(point, "ele", name) for point in points])
    has_own = np.array([any(child.name == "geoidheight" for child in point.children) for point in points])
    if has_own.any():
        rows.refuse(~has_own, lambda _: "the point has no geoidheight, others have one")
    separations = np.array([_metres(point, "geoidheight", name) for point in points]) if has_own.any() else None
    heights = from_sea_level(elevations, separations, keys, name)
    words = "GPX track" + (f" of {segments} segments" if segments > 1 else "")
    times = np.array([instant.since(start) for instant in instants])
    return geodetic_log(rows, words, times, start, "utc", (latitude, longitude, heights))


def _degrees(point: MessageElement, key: str, name: str) -> float:
    return _number(point.attributes.get(key, ""), f"{name}:{point.line}: {key} must be a number of degrees")


def _metres(point: MessageElement, key: str, name: str) -> float:
    return _number(_text(point, key, name), f"{name}:{point.line}: {key} must be a number of metres")


def _number(given: str, otherwise: str) -> float:
    value = number_in(given)
    if value is None:
        raise PathFileError(f"{otherwise} (got {shown(given)!r})")
    return value


def _text(point: MessageElement, key: str, name: str) -> str:
    found = next((child.text.strip() for child in point.children if child.name == key), None)
    if found is None:
        raise PathFileError(f"{name}:{point.line}: the point has no {key}")
    return found


def _instant(point: MessageElement, name: str, keys: LogKeys) -> Instant:
    given = _text(point, "time", name)
    offset = _OFFSET.fullmatch(given)
    if offset is not None:
        local = parse_instant(offset[1], needs_zone=False)
        seconds = int(offset[3]) * 3600.0 + int(offset[4]) * 60.0
        found = None if local is None else local.after(-seconds if offset[2] == "+" else seconds)
    else:
        found = parse_instant(given, needs_zone=keys.time_scale is None)
    if found is None:
        is_zone_missing = parse_instant(given, needs_zone=False) is not None
        raise PathFileError(
            f"{name}:{point.line}: time must be an instant like 2026-06-01T05:20:01.250Z (got {shown(given)!r})",
            hint="trajectory.time_scale: utc reads times without a zone" if is_zone_missing else "",
        )
    return found
