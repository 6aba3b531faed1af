"""Tracks of GPX 1.0 and 1.1: points with time and elevation, of one segment or of several whose times rise.

    <trkpt lat="48.086600" lon="11.279700"><ele>2953.1</ele><time>2026-06-01T05:20:01.250Z</time>
    <geoidheight>46.9</geoidheight></trkpt>

An elevation is above mean sea level; `geoidheight` is the height of the geoid above the ellipsoid. Times are in UTC,
or have an offset from it. A `fix` of none or 2d states that a point has no place or no height.

Source: http://www.topografix.com/GPX/1/1/, types wptType and trkType. The tree is that of `messages.parse_markup`: it
refuses document types, bounds sizes and knows lines, where gpxpy does not.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bisar_budget.faults import shown
from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import Instant, parse_stamp
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRecords,
    counted,
    from_sea_level,
    geodetic_log,
    hold_to_scale,
)
from bisar_budget.paths.messages import MessageElement, hold_to_size, number_in, parse_markup

_ROOT = re.compile(rb"<(?:[\w.-]+:)?gpx[\s>]")
_OFFSET = re.compile(
    r"([\d-]{10}T[\d:.]{8,21})([+-])(\d\d)(?::?([0-5]\d))?", re.ASCII
)  # extended, or basic form of ISO 8601
_WITHOUT_HEIGHT = ("none", "2d")
_LISTED = 10  # tracks that an error names


def is_gpx(data: bytes) -> bool:
    """Whether a file is XML whose root is that of GPX."""
    head = data[:10_000]
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") and bool(_ROOT.search(head))


def read_gpx(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read the track of a file, as every reader of `LOG_FORMATS` does; by the time scale utc a time needs no zone.

    Of several tracks the mission file chooses one, by its name or number. Where it does not, the log has all `tracks`
    that can be read; a track of which that is not so is no flight.
    """
    hold_to_scale("utc", keys, name)
    hold_to_size(len(data), name, "track")
    top = parse_markup(data, name)
    if not any(child.name == "gpx" for child in top.children):
        raise PathFileError(f"{name}:1: is no GPX, its root is {shown(top.children[0].name)}")
    tracks = [track for track in top.all("trk") if any(track.all("trkpt"))]
    if not tracks:
        raise PathFileError(f"{name}: has no track with points", "accepted: a track")
    if keys.track is not None:
        number = _chosen(tracks, keys.track, name)
        return _read_track(tracks[number], f" {_track_words(tracks, number)}", name, keys)
    if len(tracks) == 1:
        return _read_track(tracks[0], "", name, keys)
    logs, faults = [], []
    for number, track in enumerate(tracks):
        try:
            logs.append(_read_track(track, f" {_track_words(tracks, number)}", name, keys))
        except PathFileError as fault:
            faults.append(fault)
    if not logs:
        raise faults[0]
    return replace(logs[0], tracks=tuple(logs)) if len(logs) > 1 else logs[0]


def _chosen(tracks: Sequence[MessageElement], wanted: str, name: str) -> int:
    """Index of the track of a name, or else of a number, from 1."""
    named = [number for number, track in enumerate(tracks) if _name_of(track) == wanted.strip()]
    if len(named) == 1:
        return named[0]
    listed = ", ".join(_track_words(tracks, number) for number in range(min(len(tracks), _LISTED)))
    listed += ", …" * (len(tracks) > _LISTED)
    if named:
        raise PathFileError(f"{name}: has {len(named)} tracks of that name: {listed}; choose by number", key="track")
    if wanted.strip().isascii() and wanted.strip().isdigit() and 0 < int(wanted[:9]) <= len(tracks):
        return int(wanted) - 1
    raise PathFileError(f"{name}: has no track of that name or number; it has {listed}", key="track")


def _name_of(track: MessageElement) -> str:
    return next((child.text.strip() for child in track.children if child.name == "name"), "")


def _track_words(tracks: Sequence[MessageElement], index: int) -> str:
    """A track's number and name."""
    named = _name_of(tracks[index])
    return f"{index + 1} of {len(tracks)}" + (f" ({shown(named)})" if named else "")


def _read_track(track: MessageElement, said: str, name: str, keys: LogKeys) -> Log:
    """The log of a track; a point that cannot be used, or has no fix in three dimensions, is left out."""
    read, lines, broken, without_fix = [], [], {}, 0
    for point in track.all("trkpt"):
        if any(child.name == "fix" and child.text.strip().lower() in _WITHOUT_HEIGHT for child in point.children):
            without_fix += 1
            continue
        try:
            read.append(_point(point, name, keys))
            lines.append(point.line)
        except PathFileError as fault:
            broken[point.line] = fault
    if not lines:
        raise broken[min(broken)] if broken else PathFileError(f"{name}: has no point with a fix in three dimensions")
    records = LogRecords(name, len(lines), lines, {line: str(fault) for line, fault in broken.items()})
    instants = [instant for instant, _ in read]
    start = instants[0]
    degrees_north, degrees_east, elevations, own = np.array([numbers for _, numbers in read]).T
    has_none = np.isnan(own)
    if not has_none.all():
        records.leave_out(has_none, lambda _: "the point has no geoidheight, others have one")
    heights = from_sea_level(elevations, None if has_none.all() else own, keys, name)
    segments = sum(1 for segment in track.all("trkseg") if any(segment.all("trkpt")))
    words = f"GPX track{said}" + (f" of {segments} segments" if segments > 1 else "")
    if without_fix:
        words += f", {counted(without_fix, 'point')} without a fix in three dimensions left out"
    times = np.array([instant.since(start) for instant in instants])
    places = (np.radians(degrees_north), np.radians(degrees_east), heights)
    return geodetic_log(records, words, times, start, "utc", places)


def _point(point: MessageElement, name: str, keys: LogKeys) -> tuple[Instant, tuple[float, float, float, float]]:
    """Instant, latitude, longitude, elevation and geoid separation of a point; NaN without a separation."""
    instant = _instant(point, name, keys)
    has_own = any(child.name == "geoidheight" for child in point.children)
    return instant, (
        _degrees(point, "lat", name),
        _degrees(point, "lon", name),
        _metres(point, "ele", name),
        _metres(point, "geoidheight", name) if has_own else math.nan,
    )


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
        local = parse_stamp(offset[1], needs_zone=False)
        seconds = int(offset[3]) * 3600.0 + int(offset[4] or 0) * 60.0
        found = None if local is None else local.after(-seconds if offset[2] == "+" else seconds)
    else:
        found = parse_stamp(given, needs_zone=keys.time_scale is None)
    if found is None:
        is_zone_missing = parse_stamp(given, needs_zone=False) is not None
        raise PathFileError(
            f"{name}:{point.line}: time must be an instant like 2026-06-01T05:20:01.250Z (got {shown(given)!r})",
            hint="trajectory.time_scale: utc reads times without a zone" if is_zone_missing else "",
        )
    return found
