"""Orbit ephemeris messages (OEM) of CCSDS 502.0-B, as text of keywords and values or as XML."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from bisar_budget.faults import shown
from bisar_budget.paths.accuracy import CovarianceError, EpochCovariance, held_to_covariance, local_axes
from bisar_budget.paths.ephemeris import (
    APART,
    OWN_VELOCITY,
    USUAL_DEGREE,
    Interpolation,
    Segment,
    orbit_through,
    velocity_off,
)
from bisar_budget.paths.flight import Orbit, PathFileError, Sample
from bisar_budget.paths.instant import DAY, FIRST_DAY, TAI_LESS, Instant, has_leap_second, tai_less_utc, utc
from bisar_budget.paths.messages import (
    LATEST,
    MessageElement,
    coordinate_in,
    decoded,
    epoch_in,
    hold_to_size,
    is_markup,
    number_in,
    object_key,
    parse_markup,
)
from bisar_budget.paths.orientation import UNKNOWN, Orientation, Turn, celestial_turn, from_teme

_EARTH_FIXED = re.compile(r"ITRF[- ]?(\d\d|\d{4})?|WGS[- ]?84")
_CELESTIAL = {"GCRF": False, "ICRF": False, "EME2000": True, "J2000": True}
_EQUINOX_OF_DATE = ("TEME", "TEMEOFDATE")
_SECONDS = re.compile(r"\d\d(\.\d{1,12})?Z?", re.ASCII)
_SYSTEMS = ("UTC", *TAI_LESS)
_HIGHEST_DEGREE = 31
_VECTOR = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
_TRIANGLE = [[f"C{row}_{column}" for column in _VECTOR[: index + 1]] for index, row in enumerate(_VECTOR)]
_CELESTIAL_AXES = (*_EQUINOX_OF_DATE, *_CELESTIAL)


@dataclass
class CovarianceBlock:
    """Covariance of a message: its line, epoch, reference frame (empty: the ephemeris') and rows of its triangle."""

    line: int
    epoch: str
    frame: str = ""
    rows: list[tuple[int, Sequence[str]]] = field(default_factory=list)


@dataclass(frozen=True)
class _EphemerisBlock:
    """Metadata of a segment: keyword to line and value; its ephemeris: line, epoch and numbers of each sample.

    `covariances` are those of the segment, as they are written.
    """

    line: int
    metadata: Mapping[str, tuple[int, str]]
    rows: Sequence[tuple[int, str, Sequence[str]]]
    covariances: Sequence[CovarianceBlock] = ()


def read_oem(
    data: bytes, name: str, wanted: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Orbit from an orbit ephemeris message, as every reader of `ORBIT_FORMATS` gives it.

    A message that names no interpolation is interpolated after Hermite, degree 7, where its velocities are those of
    its places, and otherwise after Lagrange, degree 7. An interpolation of degree n goes through n + 1 places of
    Lagrange, or half as many of Hermite.

    An object is named by OBJECT_NAME or OBJECT_ID.
    """
    hold_to_size(len(data), name, "time")
    blocks = list(_from_markup(data, name) if is_markup(data) else _from_keywords(decoded(data, name), name))
    if not blocks:
        raise PathFileError(f"{name}: has no segment of an orbit ephemeris message")
    segments = [_segment(block, name, orientation) for block in blocks]
    return orbit_through(segments, name, wanted, center, orientation)


def _turn(frame: str, orientation: Orientation, where: str) -> Turn | None:
    if _EARTH_FIXED.fullmatch(frame):
        return None
    if frame in _EQUINOX_OF_DATE:
        return lambda place, instant: from_teme(place, instant, orientation)
    try:
        return celestial_turn(_CELESTIAL[frame], orientation)
    except PathFileError as error:
        raise PathFileError(f"{where}: REF_FRAME {frame} {error}") from None


def _segment(block: _EphemerisBlock, name: str, orientation: Orientation) -> Segment:
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
        if step < APART:
            said = "is there twice" if abs(step) < APART else "is earlier than the one before it"
            raise PathFileError(f"{name}:{line}: the time {shown(epoch)} {said}; times must rise")
    if not samples:
        raise PathFileError(f"{name}:{block.line}: the segment has no ephemeris")

    interpolation = _interpolation(metadata, samples, name, block.line)
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
    at_line = f"{name}:{block.line}"
    return Segment(
        object=f"{object_name} ({object_id})",
        names=(object_key(object_name), object_key(object_id)),
        samples=samples,
        first=first,
        last=last,
        where=at_line,
        words=f"OEM of {object_name}, {frame}, {interpolation.words}" + _not_stated(metadata),
        interpolation=interpolation,
        axes=frame,
        turn=_turn(frame, orientation, at_line),
        covariances=[
            read_covariance(one, _time(one.line, one.epoch, system, name), frame, orientation, name)
            for one in block.covariances
        ],
    )


def read_covariance(
    block: CovarianceBlock, time: Instant, frame: str, orientation: Orientation, name: str
) -> EpochCovariance:
    """A covariance of a message of CCSDS at a time of TAI, in metres and seconds; `frame` is that of the message."""
    where = f"{name}:{block.line}" if block.line else name
    if [len(cells) for _, cells in block.rows] != list(range(1, 7)):
        said = ", ".join(str(len(cells)) for _, cells in block.rows) or "no"
        raise PathFileError(
            f"{where}: a covariance must be a lower triangle of 6 rows with 1 to 6 numbers (has {said} numbers)"
        )
    values = np.zeros((6, 6))
    for index, (line, cells) in enumerate(block.rows):
        for column, cell in enumerate(cells):
            number = number_in(cell)
            if number is None or not math.isfinite(number):
                at = f"{name}:{line}" if line else name
                raise PathFileError(f"{at}: must be a number of km**2, km**2/s or km**2/s**2 (got {shown(cell)})")
            values[index, column] = values[column, index] = 1e6 * number
    try:
        values = held_to_covariance(values)
    except CovarianceError as error:
        raise PathFileError(f"{where}: the covariance {error}") from None
    own = block.frame.upper() or frame
    turn, axes = None, local_axes(own)
    if axes is None and _EARTH_FIXED.fullmatch(own):
        axes = "earth"
    elif axes is None and own in _CELESTIAL_AXES:
        axes, turn = "stars", _turn(own, orientation, where)
    return EpochCovariance(time, values, axes, turn)


def _not_stated(metadata: Mapping[str, tuple[int, str]]) -> str:
    """Words on the part of the interpolation that is our choice, since the message does not say it."""
    kind, degree = (metadata.get(key, (0, ""))[1].upper() for key in ("INTERPOLATION", "INTERPOLATION_DEGREE"))
    if not kind:
        return " (the file states no interpolation)"
    return "" if degree or kind == "LINEAR" else " (the file states no degree)"


_LIMITS = ("START_TIME", "STOP_TIME", "USEABLE_START_TIME", "USEABLE_STOP_TIME")


def _interpolation(
    metadata: Mapping[str, tuple[int, str]], samples: Sequence[Sample], name: str, line: int
) -> Interpolation:
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
    degree = int(written) if written else 1 if said.upper() == "LINEAR" else USUAL_DEGREE
    if said.upper() == "LINEAR" and degree != 1:
        raise PathFileError(f"{name}:{degree_at}: INTERPOLATION_DEGREE of LINEAR must be 1 (got {degree})")
    off = velocity_off(samples)
    if said.upper() == "HERMITE" and not off <= OWN_VELOCITY:
        raise PathFileError(
            f"{name}:{said_at}: INTERPOLATION HERMITE needs the velocities of the places; those of the segment are"
            f" {100 * off:.2g} % off what the places do"
        )
    is_hermite = said.upper() == "HERMITE" or (not said and off <= OWN_VELOCITY)
    if is_hermite:
        degree = max(degree | 1, 3)  # places and velocities of n samples give 2n coefficients; one would give jumps
    found = Interpolation(is_hermite, degree)
    if len(samples) < found.nodes:
        raise PathFileError(
            f"{name}:{line}: the segment has {len(samples)} place{'s' * (len(samples) != 1)};"
            f" {'Hermite' if is_hermite else 'Lagrange'} of degree {degree} needs {found.nodes}"
        )
    return found


def _sample(line: int, epoch: str, values: Sequence[str], system: str, name: str) -> Sample:
    numbers = [1000 * coordinate_in(value, f"{name}:{line}", "must be a number of km or km/s") for value in values]
    x, y, z, u, v, w = numbers[:6]
    return Sample(_time(line, epoch, system, name), (x, y, z), (u, v, w))


def _time(line: int, text: str, system: str, name: str) -> Instant:
    """A time of the message, as TAI."""
    head, _, seconds = text.rpartition(":")
    minute = _minute(head)
    # The second that some days of UTC have more is part of their last minute.
    is_last = minute is not None and minute.seconds == DAY - 60
    longest = 60 + (minute is not None and is_last and system == "UTC" and has_leap_second(minute.day))
    if minute is None or not _SECONDS.fullmatch(seconds) or (past := float(seconds.rstrip("Z"))) >= longest:
        raise PathFileError(f"{name}:{line}: must be a time such as 2026-05-31T10:12:13.123 (got {shown(text)})")
    if not FIRST_DAY < minute.day < LATEST:
        raise PathFileError(f"{name}:{line}: times must be after 1972-01-01 and before 2200 (got {shown(text)})")
    # Seconds are added once: adding twice would round twice.
    return minute.after(past + (tai_less_utc(minute.day) if system == "UTC" else TAI_LESS[system]))


@lru_cache(maxsize=4096)
def _minute(text: str) -> Instant | None:
    return epoch_in(f"{text}:00")


def _from_keywords(text: str, name: str) -> Iterator[_EphemerisBlock]:
    """Segments of a message that has a keyword and a value in each line."""
    text = text.rstrip()
    lines = ((at, line.strip()) for at, line in enumerate(text.split("\n"), 1))
    rows: list[tuple[int, str, Sequence[str]]] = []
    metadata: dict[str, tuple[int, str]] | None = None
    covariances: list[CovarianceBlock] = []
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
                yield _EphemerisBlock(began, metadata, rows, covariances)
            metadata, rows, covariances, began, state = {}, [], [], at, "metadata"
        elif line == "META_STOP" and state == "metadata":
            state = "ephemeris"
        elif line == "COVARIANCE_START" and state == "ephemeris":
            state = "covariance"
        elif line == "COVARIANCE_STOP" and state == "covariance":
            state = "ephemeris"
        elif state == "covariance":
            _add_to_covariances(covariances, at, line, name)
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
        yield _EphemerisBlock(began, metadata, rows, covariances)


def _add_to_covariances(found: list[CovarianceBlock], at: int, line: str, name: str) -> None:
    """Take a line between COVARIANCE_START and COVARIANCE_STOP: an epoch, a frame or a row of a triangle."""
    key, equals, value = (part.strip() for part in line.partition("="))
    if key == "EPOCH" and equals:
        found.append(CovarianceBlock(at, value))
    elif not found:
        raise PathFileError(f"{name}:{at}: a covariance must begin with EPOCH (got {shown(line)})")
    elif equals:
        if key == "COV_REF_FRAME":
            found[-1].frame = value
    else:
        found[-1].rows.append((at, line.split()))


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
            covariances = [_matrix(one) for block in segment.all("data") for one in block.all("covarianceMatrix")]
            yield _EphemerisBlock(segment.line, metadata, rows, covariances)


def _matrix(matrix: MessageElement) -> CovarianceBlock:
    """A covariance of XML, which names each element of the lower triangle: CX_X, CY_X, CY_Y, …"""
    return named_covariance({one.name: one.text.strip() for one in matrix.children}, matrix.line)


def named_covariance(leaves: Mapping[str, str], line: int) -> CovarianceBlock:
    """A covariance whose elements have keywords of their own; an element that is empty is not there."""
    rows: list[tuple[int, Sequence[str]]] = [
        (line, [leaves[key] for key in of_row if leaves.get(key)]) for of_row in _TRIANGLE
    ]
    return CovarianceBlock(line, leaves.get("EPOCH", ""), leaves.get("COV_REF_FRAME", ""), rows)


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
