"""Orbits from orbit ephemeris messages (OEM) of CCSDS 502.0-B, as text of keywords and values or as XML.

A place is interpolated in the axes and the time of the message, then turned to the Earth. What the axes of `ITRF` of
other years differ by, centimetres, is not seen. Those of the stars are turned with UT1 = UTC: see `turning`.
"""

import math
import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from bisar_budget.faults import shown
from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import Turn, celestial_turn, from_teme, unknown_rotation
from bisar_budget.paths.flight import Orbit, PathDoubt, PathFileError, Sample, interpolate
from bisar_budget.paths.instant import DAY, FIRST_DAY, TAI_LESS, Instant, has_leap_second, tai, tai_less_utc, utc
from bisar_budget.paths.messages import (
    LATEST,
    MessageElement,
    decoded,
    epoch_in,
    hold_to_size,
    number_in,
    parse_markup,
)

_EARTH_FIXED = re.compile(r"ITRF[- ]?(\d\d|\d{4})?|WGS[- ]?84")
_CELESTIAL = {"GCRF": False, "ICRF": False, "EME2000": True, "J2000": True}
_EQUINOX_OF_DATE = ("TEME", "TEMEOFDATE")
_SECONDS = re.compile(r"\d\d(\.\d{1,12})?Z?", re.ASCII)
_SYSTEMS = ("UTC", *TAI_LESS)
_DEGREE = 7  # where the message says none
_HIGHEST_DEGREE = 31
_APART = 0.9e-3  # s; nearer samples are one, and differences of times of two centuries are rounded to 1e-6 s
# Errors of an interpolation that are said, and that are refused whatever the slant range: the lowest satellites are
# 500 km away, and a tenth of that is lost.
_SEEN_M, _LOST_M = 1.0, 50_000.0
_MORE_OFTEN = "Write the ephemeris more often"
_EDGE = 1e-9  # s; a time at the end of a span is inside
_OWN_VELOCITY = 0.001  # of the speed; one against the stars is up to 7 % off in a low orbit
_SLOW = 100.0  # m/s; slower ones over the ground are held to a tenth of a metre a second
_BESIDE = 4  # samples on each side that velocities are compared with places by
_VECTOR = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
# Nodes and weights of Gauss and Legendre on (0, 1), of three points: Abramowitz & Stegun, table 25.4.
_GAUSS = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))


@dataclass(frozen=True)
class _EphemerisBlock:
    """Metadata of a segment: keyword to line and value; and its ephemeris: line, epoch and numbers of each sample."""

    line: int
    metadata: Mapping[str, tuple[int, str]]
    rows: Sequence[tuple[int, str, Sequence[str]]]


@dataclass(frozen=True)
class _Segment:
    """A segment, ready to interpolate; `first` and `last` are its useable times, of TAI."""

    object: str
    ids: tuple[str, ...]
    frame: str
    samples: Sequence[Sample]
    first: Instant
    last: Instant
    is_hermite: bool
    degree: int
    line: int
    words: str


def read_oem(data: bytes, name: str, wanted: str | None, center: Instant) -> Orbit:
    """Orbit from an orbit ephemeris message.

    Of several segments the one that has `center` in its useable time is taken, for all instants: between segments
    there may be a manoeuvre, over which no polynomial goes. A message that names no interpolation is interpolated
    after Hermite, degree 7, where its velocities are those of its places, and otherwise after Lagrange, degree 7.
    An interpolation of degree n goes through n + 1 places of Lagrange, or half as many of Hermite. Its error is
    estimated by one of two more degrees, and doubted from 1 m on.

    Parameters
    ----------
    data : bytes
        A whole file.
    name : str
        What messages call the file.
    wanted : str, optional
        OBJECT_NAME or OBJECT_ID.
    center : Instant
        Middle of the aperture.

    Raises
    ------
    PathFileError
        The message is not what the standard asks for, has axes, a time system or an interpolation that is not known
        here, does not say which object, or has no place at `center`. `Orbit.place` raises it outside the span.
    """
    hold_to_size(len(data), name, "time")
    is_markup = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<"
    blocks = list(_from_markup(data, name) if is_markup else _from_keywords(decoded(data, name), name))
    if not blocks:
        raise PathFileError(f"{name}: has no segment of an orbit ephemeris message")
    segments = _of_one_object([_segment(block, name) for block in blocks], name, wanted)
    segment = _at(segments, name, center)
    return _orbit(segment, f"{name}:{segment.line}", center)


def _orbit(segment: _Segment, where: str, center: Instant) -> Orbit:
    turn = _turn(segment.frame, where)
    nodes = (segment.degree + 1) // 2 if segment.is_hermite else segment.degree + 1
    span = (utc(segment.first), utc(segment.last))

    def inside(instant: Instant) -> Vector:
        time = tai(instant)
        if not _holds(segment, time):
            raise PathFileError(
                f"{where}: has no place at {instant.as_text()}; its useable time is {span[0].as_text()} to"
                f" {span[1].as_text()}"
            )
        found = interpolate(segment.samples, time, nodes, segment.is_hermite)
        if not all(math.isfinite(one) for one in found):
            raise PathFileError(f"{where}: the interpolation gives no number at {instant.as_text()}")
        return found

    def place(instant: Instant) -> Vector:
        found = inside(instant)
        return turn(found, instant) if turn else found

    more = min(nodes + (1 if segment.is_hermite else 2), len(segment.samples))
    times = [one.time for one in segment.samples]

    def misses(time: Instant) -> float:
        """How far the interpolation is from one of two more degrees: about its error. [m]"""
        usual, better = (interpolate(segment.samples, time, count, segment.is_hermite) for count in (nodes, more))
        error = math.dist(usual, better)
        return error if math.isfinite(error) else math.inf

    @lru_cache(maxsize=16)
    def off(instant: Instant) -> float:
        """Error of the interpolation at an instant, or between the samples around it: at a sample it is none. [m]

        What is missed between two samples is a wrong velocity beside them.
        """
        time = tai(instant)
        behind = min(max(bisect_right(times, time), 1), len(times) - 1)
        before, after = times[behind - 1 : behind + 1]
        return max(misses(time), misses(before.after(after.since(before) / 2)))

    if not off(center) < _LOST_M:
        raise PathFileError(
            f"{where}: the ephemeris is too sparse around {center.as_text()} to interpolate",
            f"accepted: an interpolation that is less than {_LOST_M / 1e3:g} km off",
            _MORE_OFTEN,
        )

    def doubt(instant: Instant) -> PathDoubt:
        if turn is None:
            return PathDoubt(off(instant), "interpolation of the ephemeris")
        # The three are of other causes; at their worst they add.
        size = off(instant) + sum(unknown_rotation(inside(instant)))
        return PathDoubt(size, "interpolation of the ephemeris, 0.1 s of UT1 - UTC and polar motion")

    def doubts(instant: Instant) -> Sequence[str]:
        said = []
        error = off(instant)
        if not error < _SEEN_M:
            said.append(
                f"{where}: the interpolation of the ephemeris is about {error:.2g} m off; write it more often"
            )
        return (*said, *rotation(instant))

    def rotation(instant: Instant) -> Sequence[str]:
        if turn is None:
            return ()
        turned, moved = unknown_rotation(inside(instant))
        return (
            f"{where}: {segment.frame} is turned to the Earth with UT1 = UTC and without polar motion: {turned:.0f} m"
            f" off for each 0.1 s of UT1 - UTC, and up to {moved:.0f} m; an ephemeris in ITRF has neither",
        )

    return Orbit(place=place, words=segment.words, span=span, doubts=doubts, doubt=doubt, remedy=_MORE_OFTEN)


def _turn(frame: str, where: str) -> Turn | None:
    if _EARTH_FIXED.fullmatch(frame):
        return None
    if frame in _EQUINOX_OF_DATE:
        return from_teme
    try:
        return celestial_turn(_CELESTIAL[frame])
    except PathFileError as error:
        raise PathFileError(f"{where}: REF_FRAME {frame} {error}") from None


def _holds(segment: _Segment, time: Instant) -> bool:
    return time.since(segment.first) >= -_EDGE and time.since(segment.last) <= _EDGE


def _of_one_object(segments: Sequence[_Segment], name: str, wanted: str | None) -> Sequence[_Segment]:
    objects = ", ".join(dict.fromkeys(one.object for one in segments))
    if wanted is not None:
        key = _key(wanted)
        ours = [one for one in segments if key in one.ids]
        if not ours:
            raise PathFileError(f"{name}: has no object {shown(wanted)}; it has {_cut(objects)}")
        segments = ours
    count = len({one.ids for one in segments})
    if count > 1:
        said = "objects" if wanted is None else "objects of that name"
        raise PathFileError(f"{name}: has {count} {said}: {_cut(objects)}; choose one by its name or OBJECT_ID")
    return segments


def _key(text: str) -> str:
    return " ".join(text.split()).casefold()


def _cut(text: str) -> str:
    return text if len(text) <= 400 else f"{text[:400]}..."


def _at(segments: Sequence[_Segment], name: str, center: Instant) -> _Segment:
    """The segment that holds an instant, of several the one that holds the most around it."""
    time = tai(center)
    holding = [one for one in segments if _holds(one, time)]
    if not holding:
        spans = [(utc(one.first), utc(one.last)) for one in segments]
        said = ", ".join(f"{first.as_text()} to {last.as_text()}" for first, last in spans)
        raise PathFileError(
            f"{name}: has no place at {center.as_text()}; its useable time is {_cut(said)}", spans=spans
        )
    return max(holding, key=lambda one: min(time.since(one.first), one.last.since(time)))


def _segment(block: _EphemerisBlock, name: str) -> _Segment:
    metadata = block.metadata

    def where(key: str) -> str:
        return f"{name}:{metadata[key][0] if key in metadata else block.line}"

    def text(key: str) -> str:
        if not metadata.get(key, (0, ""))[1]:
            raise PathFileError(f"{name}:{block.line}: the metadata have no {key}")
        return metadata[key][1]

    def choice(key: str) -> str:
        return text(key).upper()

    if choice("CENTER_NAME") != "EARTH":
        raise PathFileError(f"{where('CENTER_NAME')}: CENTER_NAME must be EARTH (got {shown(text('CENTER_NAME'))})")
    system = choice("TIME_SYSTEM")
    if system not in _SYSTEMS:
        raise PathFileError(
            f"{where('TIME_SYSTEM')}: TIME_SYSTEM {shown(text('TIME_SYSTEM'))} is not known; accepted: "
            f"{', '.join(_SYSTEMS)}"
        )
    frame = choice("REF_FRAME")
    if not _EARTH_FIXED.fullmatch(frame) and frame not in (*_EQUINOX_OF_DATE, *_CELESTIAL):
        raise PathFileError(
            f"{where('REF_FRAME')}: REF_FRAME {shown(text('REF_FRAME'))} is not known; accepted: ITRF with or without"
            f" its year, WGS84, TEME, {', '.join(_CELESTIAL)}"
        )
    if frame in _EQUINOX_OF_DATE and "REF_FRAME_EPOCH" in metadata:
        raise PathFileError(f"{where('REF_FRAME_EPOCH')}: TEME is read as of date, not of one epoch")

    samples = [_sample(*row, system, name) for row in block.rows]
    for (line, epoch, _), before, one in zip(block.rows[1:], samples, samples[1:], strict=False):
        step = one.time.since(before.time)
        if step < _APART:
            said = "is there twice" if abs(step) < _APART else "is earlier than the one before it"
            raise PathFileError(f"{name}:{line}: the time {shown(epoch)} {said}; times must rise")
    if not samples:
        raise PathFileError(f"{name}:{block.line}: the segment has no ephemeris")

    is_hermite, degree = _interpolation(metadata, samples, name, block.line)
    limits = {key: _time(*metadata[key], system, name) for key in _LIMITS if key in metadata}
    for key in ("START_TIME", "STOP_TIME"):
        text(key)
    first = max(samples[0].time, limits.get("USEABLE_START_TIME", limits["START_TIME"]))
    last = min(samples[-1].time, limits.get("USEABLE_STOP_TIME", limits["STOP_TIME"]))
    for key, end, beside in (("START_TIME", samples[0], samples[1]), ("STOP_TIME", samples[-1], samples[-2])):
        # A file that was cut off between two lines has all it needs, but the time that it promises.
        step = end.time.since(beside.time)
        if limits[key].since(end.time) * math.copysign(1, step) > abs(step):
            raise PathFileError(
                f"{where(key)}: {key} is {shown(text(key))}, the ephemeris has nothing beyond"
                f" {utc(end.time).as_text()}"
            )
    if last.since(first) <= 0:
        raise PathFileError(f"{name}:{block.line}: the useable time of the segment has no ephemeris")
    object_name, object_id = (shown(" ".join(text(key).split())) for key in ("OBJECT_NAME", "OBJECT_ID"))
    return _Segment(
        object=f"{object_name} ({object_id})",
        ids=(_key(object_name), _key(object_id)),
        frame=frame,
        samples=samples,
        first=first,
        last=last,
        is_hermite=is_hermite,
        degree=degree,
        line=block.line,
        words=f"OEM of {object_name}, {frame}, {'Hermite' if is_hermite else 'Lagrange'} degree {degree}"
        + _not_stated(metadata),
    )


def _not_stated(metadata: Mapping[str, tuple[int, str]]) -> str:
    """Words on the part of the interpolation that is our choice, since the message does not say it."""
    kind, degree = (metadata.get(key, (0, ""))[1].upper() for key in ("INTERPOLATION", "INTERPOLATION_DEGREE"))
    if not kind:
        return " (the file states no interpolation)"
    return "" if degree or kind == "LINEAR" else " (the file states no degree)"


_LIMITS = ("START_TIME", "STOP_TIME", "USEABLE_START_TIME", "USEABLE_STOP_TIME")


def _interpolation(
    metadata: Mapping[str, tuple[int, str]], samples: Sequence[Sample], name: str, line: int
) -> tuple[bool, int]:
    """Whether it is Hermite's, and its degree."""
    said_at, said = metadata.get("INTERPOLATION", (line, ""))
    if said.upper() not in ("", "HERMITE", "LAGRANGE", "LINEAR"):
        raise PathFileError(
            f"{name}:{said_at}: INTERPOLATION {shown(said)} is not known; accepted: HERMITE, LAGRANGE, LINEAR"
        )
    degree_at, written = metadata.get("INTERPOLATION_DEGREE", (said_at, ""))
    if written and not (re.fullmatch(r"\d{1,3}", written, re.ASCII) and 1 <= int(written) <= _HIGHEST_DEGREE):
        raise PathFileError(
            f"{name}:{degree_at}: INTERPOLATION_DEGREE must be a whole number from 1 to {_HIGHEST_DEGREE}"
            f" (got {shown(written)})"
        )
    degree = int(written) if written else 1 if said.upper() == "LINEAR" else _DEGREE
    if said.upper() == "LINEAR" and degree != 1:
        raise PathFileError(f"{name}:{degree_at}: INTERPOLATION_DEGREE of LINEAR must be 1 (got {degree})")
    off = _velocity_off(samples)
    if said.upper() == "HERMITE" and not off <= _OWN_VELOCITY:
        raise PathFileError(
            f"{name}:{said_at}: INTERPOLATION HERMITE needs the velocities of the places; those of the segment are"
            f" {100 * off:.2g} % off what the places do"
        )
    is_hermite = said.upper() == "HERMITE" or (not said and off <= _OWN_VELOCITY)
    if is_hermite:
        degree = max(degree | 1, 3)  # places and velocities of n samples give 2n coefficients; one would give jumps
    needed = (degree + 1) // 2 if is_hermite else degree + 1
    if len(samples) < needed:
        raise PathFileError(
            f"{name}:{line}: the segment has {len(samples)} place{'s' * (len(samples) != 1)};"
            f" {'Hermite' if is_hermite else 'Lagrange'} of degree {degree} needs {needed}"
        )
    return is_hermite, degree


def _velocity_off(samples: Sequence[Sample]) -> float:
    """How far velocities are from what the places do between two samples, over the speed; NaN where nobody knows.

    Sixteen pairs of neighbours are tried: near a pole the Earth's rotation hardly moves a place.
    """
    last = len(samples) - _BESIDE
    if last < _BESIDE:
        return 0.0
    found = [_off_at(samples, middle) for middle in range(_BESIDE, last + 1, max((last - _BESIDE) // 16, 1))]
    return max(found) if all(math.isfinite(one) for one in found) else math.nan


def _off_at(samples: Sequence[Sample], middle: int) -> float:
    """The same before one sample: the velocities, interpolated, are integrated after Gauss. Derived here."""
    near = [Sample(one.time, one.velocity, one.velocity) for one in samples[middle - _BESIDE : middle + _BESIDE]]
    a, b = samples[middle - 1 : middle + 1]
    step = b.time.since(a.time)
    means = [0.0, 0.0, 0.0]
    for share, weight in _GAUSS:
        velocity = interpolate(near, a.time.after(share * step), len(near), False)
        means = [mean + weight * one for mean, one in zip(means, velocity, strict=True)]
    moved = [(end - start) / step for start, end in zip(a.place, b.place, strict=True)]
    return math.dist(means, moved) / max(math.hypot(*moved), _SLOW)


def _sample(line: int, epoch: str, values: Sequence[str], system: str, name: str) -> Sample:
    numbers = []
    for value in values:
        one = number_in(value)
        if one is None or abs(one) > 1e9:  # km
            raise PathFileError(f"{name}:{line}: must be a number of km or km/s (got {shown(value)})")
        numbers.append(1000 * one)
    x, y, z, u, v, w = numbers[:6]
    return Sample(_time(line, epoch, system, name), (x, y, z), (u, v, w))


def _time(line: int, text: str, system: str, name: str) -> Instant:
    """A time of the message, as TAI."""
    head, _, seconds = text.rpartition(":")
    minute = _minute(head)
    # The second that some days of UTC have more is part of their last minute.
    longest = 60 + (minute is not None and system == "UTC" and _has_leap_second(minute))
    if minute is None or not _SECONDS.fullmatch(seconds) or (past := float(seconds.rstrip("Z"))) >= longest:
        raise PathFileError(f"{name}:{line}: must be a time such as 2026-05-31T10:12:13.123 (got {shown(text)})")
    if not FIRST_DAY < minute.day < LATEST:
        raise PathFileError(f"{name}:{line}: times must be after 1972-01-01 and before 2200 (got {shown(text)})")
    # Seconds are added once: adding twice would round twice.
    return minute.after(past + (tai_less_utc(minute.day) if system == "UTC" else TAI_LESS[system]))


@lru_cache(maxsize=4096)
def _minute(text: str) -> Instant | None:
    return epoch_in(f"{text}:00")


def _has_leap_second(minute: Instant) -> bool:
    return minute.seconds == DAY - 60 and has_leap_second(minute.day)


def _from_keywords(text: str, name: str) -> Iterator[_EphemerisBlock]:
    """Segments of a message that has a keyword and a value in each line."""
    text = text.rstrip()
    lines = ((at, line.strip()) for at, line in enumerate(text.split("\n"), 1))
    rows: list[tuple[int, str, Sequence[str]]] = []
    metadata: dict[str, tuple[int, str]] | None = None
    began = 0
    state = "nothing"
    for at, line in lines:
        if not line or line.startswith("COMMENT"):
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        where = f"{name}:{at}"
        if state == "nothing":
            if key != "CCSDS_OEM_VERS":
                raise PathFileError(f"{where}: must begin with CCSDS_OEM_VERS (got {shown(line)})")
            state = "header"
        elif line == "META_START" and state in ("header", "ephemeris"):
            if metadata is not None:
                yield _EphemerisBlock(began, metadata, rows)
            metadata, rows, began, state = {}, [], at, "metadata"
        elif line == "META_STOP" and state == "metadata":
            state = "ephemeris"
        elif line == "COVARIANCE_START" and state == "ephemeris":
            state = "covariance"
        elif line == "COVARIANCE_STOP" and state == "covariance":
            state = "ephemeris"
        elif state == "metadata" and equals and metadata is not None:
            if key in metadata:
                raise PathFileError(f"{where}: {shown(key)} is there twice; before in line {metadata[key][0]}")
            metadata[key] = (at, value)
        elif state == "ephemeris":
            epoch, *values = line.split()
            if len(values) not in (6, 9):
                raise PathFileError(
                    f"{where}: must be a time with 6 numbers, or 9 with accelerations (has {len(values)}:"
                    f" {shown(line)})"
                )
            rows.append((at, epoch, values))
        elif state == "metadata" or (state == "header" and not equals):
            raise PathFileError(f"{where}: must be a keyword, = and its value (got {shown(line)})")
    if state in ("metadata", "covariance"):
        last = text.count("\n") + 1
        raise PathFileError(f"{name}:{last}: ends within {'metadata' if state == 'metadata' else 'a covariance'}")
    if metadata is not None:
        yield _EphemerisBlock(began, metadata, rows)


def _from_markup(data: bytes, name: str) -> Iterator[_EphemerisBlock]:
    """Segments of a message in XML."""
    for message in parse_markup(data, name).all("oem"):
        for segment in message.all("segment"):
            metadata = {
                one.name: (one.line, one.text.strip())
                for block in segment.all("metadata")
                for one in block.children
                if one.name != "COMMENT"
            }
            rows = [_state(state, name) for block in segment.all("data") for state in block.all("stateVector")]
            yield _EphemerisBlock(segment.line, metadata, rows)


def _state(state: MessageElement, name: str) -> tuple[int, str, Sequence[str]]:
    where = f"{name}:{state.line}"
    parts = {one.name: one for one in state.children}
    for key in ("EPOCH", *_VECTOR):
        if key not in parts:
            raise PathFileError(f"{where}: the state vector has no {key}")
        unit = "km/s" if key.endswith("_DOT") else "km"
        if key != "EPOCH" and parts[key].units not in ("", unit):
            raise PathFileError(f"{where}: {key} must be in {unit} (got {shown(parts[key].units)})")
    return state.line, parts["EPOCH"].text.strip(), [parts[key].text.strip() for key in _VECTOR]
