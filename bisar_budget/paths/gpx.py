"""Reader of GPX 1.0 and 1.1: tracks of points with time and elevation, in segments in chronological order.

    <trkpt lat="48.086600" lon="11.279700"><ele>2953.1</ele><time>2026-06-01T05:20:01.250Z</time>
    <geoidheight>46.9</geoidheight></trkpt>

An elevation is above mean sea level; `geoidheight` is the height of the geoid above the ellipsoid. Times are in UTC,
or have an offset from UTC. A point whose `fix` is `none` has no position, and a point whose `fix` is `2d` has no
height.

Source: http://www.topografix.com/GPX/1/1/, types wptType and trkType. The file is parsed by `messages.parse_markup`,
which, unlike gpxpy, refuses document types, limits sizes and keeps line numbers.
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

_ROOT_ELEMENT = re.compile(rb"<(?:[\w.-]+:)?gpx[\s>]")
_STAMP_WITH_OFFSET = re.compile(
    r"([\d-]{10}T[\d:.]{8,21})([+-])(\d\d)(?::?([0-5]\d))?", re.ASCII
)  # extended or basic form of ISO 8601
_FIXES_WITHOUT_HEIGHT = ("none", "2d")
_SHOWN_TRACK_COUNT = 10  # in an error


def is_gpx(data: bytes) -> bool:
    """Whether a file is XML with the root element of GPX."""
    head = data[:10_000]
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") and bool(_ROOT_ELEMENT.search(head))


def read_gpx(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read the track of a GPX file.

    The arguments and errors are the same for all readers; see `LogFormat.read`. If the mission file states the time
    scale `utc`, times may omit the time zone. If there are several tracks, the mission file may choose one by its
    name or number. If it does not, `Log.tracks` contains all tracks that can be read; unreadable tracks are ignored.
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


def _chosen(tracks: Sequence[MessageElement], track_name: str, name: str) -> int:
    """Index, counted from 0, of the track that the mission file chooses.

    `track_name` is the name of a track. If no track has this name, it is read as the number of a track, counted from
    1.
    """
    matches = [number for number, track in enumerate(tracks) if _name_of(track) == track_name.strip()]
    if len(matches) == 1:
        return matches[0]
    listed = ", ".join(_track_words(tracks, number) for number in range(min(len(tracks), _SHOWN_TRACK_COUNT)))
    listed += ", …" * (len(tracks) > _SHOWN_TRACK_COUNT)
    if matches:
        raise PathFileError(
            f"{name}: has {len(matches)} tracks of that name: {listed}; choose by number", key="track"
        )
    if track_name.strip().isascii() and track_name.strip().isdigit() and 0 < int(track_name[:9]) <= len(tracks):
        return int(track_name) - 1
    raise PathFileError(f"{name}: has no track of that name or number; it has {listed}", key="track")


def _name_of(track: MessageElement) -> str:
    return next((child.text.strip() for child in track.children if child.name == "name"), "")


def _track_words(tracks: Sequence[MessageElement], index: int) -> str:
    """Number and name of a track, for messages."""
    track_name = _name_of(tracks[index])
    return f"{index + 1} of {len(tracks)}" + (f" ({shown(track_name)})" if track_name else "")


def _read_track(track: MessageElement, track_words: str, name: str, keys: LogKeys) -> Log:
    """Make the log of a track; points without a three-dimensional fix and unusable points are left out.

    `track_words` identifies the track in messages.
    """
    points, lines, broken, without_fix = [], [], {}, 0
    for point in track.all("trkpt"):
        if any(
            child.name == "fix" and child.text.strip().lower() in _FIXES_WITHOUT_HEIGHT for child in point.children
        ):
            without_fix += 1
            continue
        try:
            points.append(_point(point, name, keys))
            lines.append(point.line)
        except PathFileError as fault:
            broken[point.line] = fault
    if not lines:
        raise broken[min(broken)] if broken else PathFileError(f"{name}: has no point with a fix in three dimensions")
    records = LogRecords(name, len(lines), lines, {line: str(fault) for line, fault in broken.items()})
    instants = [instant for instant, _ in points]
    start = instants[0]
    degrees_north, degrees_east, elevations, separations = np.array([numbers for _, numbers in points]).T
    lacks_separation = np.isnan(separations)
    if not lacks_separation.all():
        records.leave_out(lacks_separation, lambda _: "the point has no geoidheight, others have one")
    heights = from_sea_level(elevations, None if lacks_separation.all() else separations, keys, name)
    segments = sum(1 for segment in track.all("trkseg") if any(segment.all("trkpt")))
    words = f"GPX track{track_words}" + (f" of {segments} segments" if segments > 1 else "")
    if without_fix:
        words += f", {counted(without_fix, 'point')} without a fix in three dimensions left out"
    times = np.array([instant.since(start) for instant in instants])
    coordinates = (np.radians(degrees_north), np.radians(degrees_east), heights)
    return geodetic_log(records, words, times, start, "utc", coordinates)


def _point(point: MessageElement, name: str, keys: LogKeys) -> tuple[Instant, tuple[float, float, float, float]]:
    """Read the instant of a point, and its latitude [deg], longitude [deg], elevation [m] and geoid separation [m].

    The separation is NaN if the point does not state it.
    """
    instant = _instant(point, name, keys)
    has_separation = any(child.name == "geoidheight" for child in point.children)
    return instant, (
        _degrees(point, "lat", name),
        _degrees(point, "lon", name),
        _metres(point, "ele", name),
        _metres(point, "geoidheight", name) if has_separation else math.nan,
    )


def _degrees(point: MessageElement, key: str, name: str) -> float:
    return _number(point.attributes.get(key, ""), f"{name}:{point.line}: {key} must be a number of degrees")


def _metres(point: MessageElement, key: str, name: str) -> float:
    return _number(_text(point, key, name), f"{name}:{point.line}: {key} must be a number of metres")


def _number(text: str, problem: str) -> float:
    value = number_in(text)
    if value is None:
        raise PathFileError(f"{problem} (got {shown(text)!r})")
    return value


def _text(point: MessageElement, key: str, name: str) -> str:
    text = next((child.text.strip() for child in point.children if child.name == key), None)
    if text is None:
        raise PathFileError(f"{name}:{point.line}: the point has no {key}")
    return text


def _instant(point: MessageElement, name: str, keys: LogKeys) -> Instant:
    text = _text(point, "time", name)
    offset = _STAMP_WITH_OFFSET.fullmatch(text)
    if offset is not None:
        local = parse_stamp(offset[1], needs_zone=False)
        seconds = int(offset[3]) * 3600.0 + int(offset[4] or 0) * 60.0
        instant = None if local is None else local.after(-seconds if offset[2] == "+" else seconds)
    else:
        instant = parse_stamp(text, needs_zone=keys.time_scale is None)
    if instant is None:
        is_zone_missing = parse_stamp(text, needs_zone=False) is not None
        raise PathFileError(
            f"{name}:{point.line}: time must be an instant like 2026-06-01T05:20:01.250Z (got {shown(text)!r})",
            hint="trajectory.time_scale: utc reads times without a zone" if is_zone_missing else "",
        )
    return instant
