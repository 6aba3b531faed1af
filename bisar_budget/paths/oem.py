"""Reader of orbit ephemeris messages (OEM) of CCSDS 502.0-B, written as text with keywords or as XML."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from bisar_budget.faults import shown
from bisar_budget.paths.accuracy import (
    CovarianceError,
    EpochCovariance,
    held_to_covariance,
    local_axes,
    turns_with_orbit,
)
from bisar_budget.paths.ephemeris import (
    DEFAULT_DEGREE,
    MAX_VELOCITY_ERROR_RATIO,
    MIN_SAMPLE_STEP_S,
    Interpolation,
    Segment,
    orbit_through,
    velocity_error,
)
from bisar_budget.paths.flight import Orbit, PathFileError, Sample
from bisar_budget.paths.instant import DAY_S, FIRST_UTC_DAY, TAI_LESS, Instant, has_leap_second, tai_less_utc, utc
from bisar_budget.paths.messages import (
    LAST_ORBIT_DAY,
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

_EARTH_FIXED_FRAME = re.compile(r"ITRF[- ]?(\d\d|\d{4})?|WGS[- ]?84")
_CELESTIAL = {"GCRF": False, "ICRF": False, "EME2000": True, "J2000": True}
_EQUINOX_OF_DATE = ("TEME", "TEMEOFDATE")
_SECONDS = re.compile(r"\d\d(\.\d{1,12})?Z?", re.ASCII)
_TIME_SYSTEMS = ("UTC", *TAI_LESS)
_MAX_DEGREE = 31
_STATE_KEYWORDS = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
_TRIANGLE_KEYWORDS = [
    [f"C{row}_{column}" for column in _STATE_KEYWORDS[: index + 1]] for index, row in enumerate(_STATE_KEYWORDS)
]
_CELESTIAL_AXES = (*_EQUINOX_OF_DATE, *_CELESTIAL)


@dataclass
class CovarianceBlock:
    """A covariance as written in a message: line, epoch, frame, and the rows of its lower triangle.

    If `frame` is empty, the covariance is in the reference frame of the positions and velocities.
    """

    line: int
    epoch: str
    frame: str = ""
    rows: list[tuple[int, Sequence[str]]] = field(default_factory=list)


@dataclass(frozen=True)
class _EphemerisBlock:
    """A segment of an ephemeris as written in a message.

    Attributes
    ----------
    line : int
        Number of the first line.
    metadata : mapping
        Line number and value for each keyword in the metadata.
    rows : sequence
        Line number, epoch, and numbers (as strings) of each sample.
    covariances : sequence of CovarianceBlock
        Covariances of the segment.
    """

    line: int
    metadata: Mapping[str, tuple[int, str]]
    rows: Sequence[tuple[int, str, Sequence[str]]]
    covariances: Sequence[CovarianceBlock] = ()


def read_oem(
    data: bytes, name: str, object_name: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Read an orbit ephemeris message, and return the orbit of an object.

    The arguments and errors are the same for all readers; see `OrbitFormat.read`.

    If the orbit message (OEM) states no interpolation, Hermite's polynomial of degree 7 is used, or Lagrange's
    polynomial of degree 7 if the velocities do not agree with the positions. A Lagrange polynomial of degree n goes
    through n + 1 samples, and a Hermite polynomial of degree n through (n + 1)/2 samples.

    `object_name` is an OBJECT_NAME or an OBJECT_ID.
    """
    hold_to_size(len(data), name, "time")
    blocks = list(_from_markup(data, name) if is_markup(data) else _from_keywords(decoded(data, name), name))
    if not blocks:
        raise PathFileError(f"{name}: has no segment of an orbit ephemeris message")
    segments = [_segment(block, name, orientation) for block in blocks]
    return orbit_through(segments, name, object_name, center, orientation)


def _turn(frame: str, orientation: Orientation, location: str) -> Turn | None:
    if _EARTH_FIXED_FRAME.fullmatch(frame):
        return None
    if frame in _EQUINOX_OF_DATE:
        return lambda place, instant: from_teme(place, instant, orientation)
    try:
        return celestial_turn(_CELESTIAL[frame], orientation)
    except PathFileError as error:
        raise PathFileError(f"{location}: REF_FRAME {frame} {error}") from None


def _segment(block: _EphemerisBlock, name: str, orientation: Orientation) -> Segment:
    metadata = block.metadata

    def location(key: str) -> str:
        return f"{name}:{metadata[key][0] if key in metadata else block.line}"

    def text(key: str) -> str:
        if not metadata.get(key, (0, ""))[1]:
            raise PathFileError(f"{name}:{block.line}: the metadata have no {key}")
        return metadata[key][1]

    def choice(key: str) -> str:
        return text(key).upper()

    if choice("CENTER_NAME") != "EARTH":
        raise PathFileError(
            f"{location('CENTER_NAME')}: CENTER_NAME must be EARTH (got {shown(text('CENTER_NAME'))})"
        )
    system = choice("TIME_SYSTEM")
    if system not in _TIME_SYSTEMS:
        raise PathFileError(
            f"{location('TIME_SYSTEM')}: TIME_SYSTEM {shown(text('TIME_SYSTEM'))} is not known; accepted: "
            f"{', '.join(_TIME_SYSTEMS)}"
        )
    frame = choice("REF_FRAME")
    if not _EARTH_FIXED_FRAME.fullmatch(frame) and frame not in (*_EQUINOX_OF_DATE, *_CELESTIAL):
        raise PathFileError(
            f"{location('REF_FRAME')}: REF_FRAME {shown(text('REF_FRAME'))} is not known; accepted: ITRF with or"
            f" without its year, WGS84, TEME, {', '.join(_CELESTIAL)}"
        )
    if frame in _EQUINOX_OF_DATE and "REF_FRAME_EPOCH" in metadata:
        raise PathFileError(f"{location('REF_FRAME_EPOCH')}: TEME is read as of date, not of one epoch")

    samples = [_sample(*row, system, name) for row in block.rows]
    for (line, epoch, _), previous, sample in zip(block.rows[1:], samples, samples[1:], strict=False):
        step = sample.time.since(previous.time)
        if step < MIN_SAMPLE_STEP_S:
            fault = "is there twice" if abs(step) < MIN_SAMPLE_STEP_S else "is earlier than the one before it"
            raise PathFileError(f"{name}:{line}: the time {shown(epoch)} {fault}; times must rise")
    if not samples:
        raise PathFileError(f"{name}:{block.line}: the segment has no ephemeris")

    interpolation = _interpolation(metadata, samples, name, block.line)
    limits = {key: _time(*metadata[key], system, name) for key in _TIME_LIMITS if key in metadata}
    for key in ("START_TIME", "STOP_TIME"):
        text(key)
    first = max(samples[0].time, limits.get("USEABLE_START_TIME", limits["START_TIME"]))
    last = min(samples[-1].time, limits.get("USEABLE_STOP_TIME", limits["STOP_TIME"]))
    for key, end, neighbour in (("START_TIME", samples[0], samples[1]), ("STOP_TIME", samples[-1], samples[-2])):
        # A file that was truncated after a complete line can be read, but ends before the stated time.
        step = end.time.since(neighbour.time)
        if limits[key].since(end.time) * math.copysign(1, step) > abs(step):
            raise PathFileError(
                f"{location(key)}: {key} is {shown(text(key))}, the ephemeris has nothing beyond"
                f" {utc(end.time).as_text()}"
            )
    if last.since(first) <= 0:
        raise PathFileError(f"{name}:{block.line}: the useable time of the segment has no ephemeris")
    object_name, object_id = (shown(" ".join(text(key).split())) for key in ("OBJECT_NAME", "OBJECT_ID"))
    segment_location = f"{name}:{block.line}"
    return Segment(
        object=f"{object_name} ({object_id})",
        names=(object_key(object_name), object_key(object_id)),
        samples=samples,
        first=first,
        last=last,
        where=segment_location,
        words=f"OEM of {object_name}, {frame}, {interpolation.words}" + _not_stated(metadata),
        interpolation=interpolation,
        axes=frame,
        turn=_turn(frame, orientation, segment_location),
        covariances=[
            read_covariance(sample, _time(sample.line, sample.epoch, system, name), frame, orientation, name)
            for sample in block.covariances
        ],
    )


def read_covariance(
    block: CovarianceBlock, time: Instant, frame: str, orientation: Orientation, name: str
) -> EpochCovariance:
    """Convert a covariance of a CCSDS message from strings in km and km/s to numbers in m and m/s.

    `time` is the epoch of the covariance in TAI. `frame` is the reference frame of the orbit message (OEM), and
    applies if the covariance does not state a frame of its own.
    """
    location = f"{name}:{block.line}" if block.line else name
    if [len(cells) for _, cells in block.rows] != list(range(1, 7)):
        counts = ", ".join(str(len(cells)) for _, cells in block.rows) or "no"
        raise PathFileError(
            f"{location}: a covariance must be a lower triangle of 6 rows with 1 to 6 numbers (has {counts} numbers)"
        )
    values = np.zeros((6, 6))
    for index, (line, cells) in enumerate(block.rows):
        for column, cell in enumerate(cells):
            number = number_in(cell)
            if number is None or not math.isfinite(number):
                cell_location = f"{name}:{line}" if line else name
                raise PathFileError(
                    f"{cell_location}: must be a number of km**2, km**2/s or km**2/s**2 (got {shown(cell)})"
                )
            values[index, column] = values[column, index] = 1e6 * number
    try:
        values = held_to_covariance(values)
    except CovarianceError as error:
        raise PathFileError(f"{location}: the covariance {error}") from None
    covariance_frame = block.frame.upper() or frame
    turn, axes = None, local_axes(covariance_frame)
    if axes is None and _EARTH_FIXED_FRAME.fullmatch(covariance_frame):
        axes = "earth"
    elif axes is None and covariance_frame in _CELESTIAL_AXES:
        axes, turn = "stars", _turn(covariance_frame, orientation, location)
    return EpochCovariance(time, values, axes, turn, turns_with_orbit(covariance_frame))


def _not_stated(metadata: Mapping[str, tuple[int, str]]) -> str:
    """Remark for reports if a message does not state the interpolation or its degree; empty if it states both."""
    kind, degree = (metadata.get(key, (0, ""))[1].upper() for key in ("INTERPOLATION", "INTERPOLATION_DEGREE"))
    if not kind:
        return " (the file states no interpolation)"
    return "" if degree or kind == "LINEAR" else " (the file states no degree)"


_TIME_LIMITS = ("START_TIME", "STOP_TIME", "USEABLE_START_TIME", "USEABLE_STOP_TIME")


def _interpolation(
    metadata: Mapping[str, tuple[int, str]], samples: Sequence[Sample], name: str, line: int
) -> Interpolation:
    kind_line, kind = metadata.get("INTERPOLATION", (line, ""))
    if kind.upper() not in ("", "HERMITE", "LAGRANGE", "LINEAR"):
        raise PathFileError(
            f"{name}:{kind_line}: INTERPOLATION {shown(kind)} is not known; accepted: HERMITE, LAGRANGE, LINEAR"
        )
    degree_line, degree_text = metadata.get("INTERPOLATION_DEGREE", (kind_line, ""))
    if degree_text and not (re.fullmatch(r"\d{1,3}", degree_text, re.ASCII) and 1 <= int(degree_text) <= _MAX_DEGREE):
        raise PathFileError(
            f"{name}:{degree_line}: INTERPOLATION_DEGREE must be a whole number from 1 to {_MAX_DEGREE}"
            f" (got {shown(degree_text)})"
        )
    degree = int(degree_text) if degree_text else 1 if kind.upper() == "LINEAR" else DEFAULT_DEGREE
    if kind.upper() == "LINEAR" and degree != 1:
        raise PathFileError(f"{name}:{degree_line}: INTERPOLATION_DEGREE of LINEAR must be 1 (got {degree})")
    error_ratio = velocity_error(samples)
    if kind.upper() == "HERMITE" and not error_ratio <= MAX_VELOCITY_ERROR_RATIO:
        raise PathFileError(
            f"{name}:{kind_line}: INTERPOLATION HERMITE needs the velocities of the positions; those of the segment "
            f"are {100 * error_ratio:.2g} % off the motion of its positions"
        )
    is_hermite = kind.upper() == "HERMITE" or (not kind and error_ratio <= MAX_VELOCITY_ERROR_RATIO)
    if is_hermite:
        degree = max(degree | 1, 3)  # n samples give 2n coefficients; with a single sample the path would jump
    interpolation = Interpolation(is_hermite, degree)
    if len(samples) < interpolation.nodes:
        raise PathFileError(
            f"{name}:{line}: the segment has {len(samples)} position{'s' * (len(samples) != 1)};"
            f" {'Hermite' if is_hermite else 'Lagrange'} of degree {degree} needs {interpolation.nodes}"
        )
    return interpolation


def _sample(line: int, epoch: str, values: Sequence[str], system: str, name: str) -> Sample:
    numbers = [1000 * coordinate_in(value, f"{name}:{line}", "must be a number of km or km/s") for value in values]
    x, y, z, u, v, w = numbers[:6]
    return Sample(_time(line, epoch, system, name), (x, y, z), (u, v, w))


def _time(line: int, text: str, system: str, name: str) -> Instant:
    """Convert a time from a string in the time system `system` to an instant in TAI."""
    head, _, seconds = text.rpartition(":")
    minute = _minute(head)
    # A leap second is part of the last minute of its day.
    is_last = minute is not None and minute.seconds == DAY_S - 60
    longest = 60 + (minute is not None and is_last and system == "UTC" and has_leap_second(minute.day))
    if minute is None or not _SECONDS.fullmatch(seconds) or (past := float(seconds.rstrip("Z"))) >= longest:
        raise PathFileError(f"{name}:{line}: must be a time such as 2026-05-31T10:12:13.123 (got {shown(text)})")
    if not FIRST_UTC_DAY < minute.day < LAST_ORBIT_DAY:
        raise PathFileError(f"{name}:{line}: times must be after 1972-01-01 and before 2200 (got {shown(text)})")
    # Seconds are added once: adding twice would round twice.
    return minute.after(past + (tai_less_utc(minute.day) if system == "UTC" else TAI_LESS[system]))


@lru_cache(maxsize=4096)
def _minute(text: str) -> Instant | None:
    return epoch_in(f"{text}:00")


def _from_keywords(text: str, name: str) -> Iterator[_EphemerisBlock]:
    """Yield the segments of a message that is written as text with keywords."""
    text = text.rstrip()
    lines = ((number, line.strip()) for number, line in enumerate(text.split("\n"), 1))
    rows: list[tuple[int, str, Sequence[str]]] = []
    metadata: dict[str, tuple[int, str]] | None = None
    covariances: list[CovarianceBlock] = []
    first_line = 0
    state = "nothing"
    for number, line in lines:
        if not line or line.startswith("COMMENT"):
            continue
        key, equals, value = (piece.strip() for piece in line.partition("="))
        location = f"{name}:{number}"
        if state == "nothing":
            if key != "CCSDS_OEM_VERS":
                raise PathFileError(f"{location}: must begin with CCSDS_OEM_VERS (got {shown(line)})")
            state = "header"
        elif line == "META_START" and state in ("header", "ephemeris"):
            if metadata is not None:
                yield _EphemerisBlock(first_line, metadata, rows, covariances)
            metadata, rows, covariances, first_line, state = {}, [], [], number, "metadata"
        elif line == "META_STOP" and state == "metadata":
            state = "ephemeris"
        elif line == "COVARIANCE_START" and state == "ephemeris":
            state = "covariance"
        elif line == "COVARIANCE_STOP" and state == "covariance":
            state = "ephemeris"
        elif state == "covariance":
            _add_to_covariances(covariances, number, line, name)
        elif state == "metadata" and equals and metadata is not None:
            if key in metadata:
                raise PathFileError(f"{location}: {shown(key)} is there twice; before in line {metadata[key][0]}")
            metadata[key] = (number, value)
        elif state == "ephemeris":
            epoch, *values = line.split()
            if len(values) not in (6, 9):
                raise PathFileError(
                    f"{location}: must be a time with 6 numbers, or 9 with accelerations (has {len(values)}:"
                    f" {shown(line)})"
                )
            rows.append((number, epoch, values))
        elif state == "metadata" or (state == "header" and not equals):
            raise PathFileError(f"{location}: must be a keyword, = and its value (got {shown(line)})")
    if state in ("metadata", "covariance"):
        last = text.count("\n") + 1
        raise PathFileError(f"{name}:{last}: ends within {'metadata' if state == 'metadata' else 'a covariance'}")
    if metadata is not None:
        yield _EphemerisBlock(first_line, metadata, rows, covariances)


def _add_to_covariances(covariances: list[CovarianceBlock], number: int, line: str, name: str) -> None:
    """Read a line between COVARIANCE_START and COVARIANCE_STOP, and add it to the covariances.

    A line with an epoch begins a new covariance. Any other line contains the frame of the last covariance, or a row
    of its lower triangle.
    """
    key, equals, value = (piece.strip() for piece in line.partition("="))
    if key == "EPOCH" and equals:
        covariances.append(CovarianceBlock(number, value))
    elif not covariances:
        raise PathFileError(f"{name}:{number}: a covariance must begin with EPOCH (got {shown(line)})")
    elif equals:
        if key == "COV_REF_FRAME":
            covariances[-1].frame = value
    else:
        covariances[-1].rows.append((number, line.split()))


def _from_markup(data: bytes, name: str) -> Iterator[_EphemerisBlock]:
    """Yield the segments of a message that is written in XML."""
    for message in parse_markup(data, name).all("oem"):
        for segment in message.all("segment"):
            metadata = {
                element.name: (element.line, element.text.strip())
                for block in segment.all("metadata")
                for element in block.children
                if element.name != "COMMENT"
            }
            rows = [_state(state, name) for block in segment.all("data") for state in block.all("stateVector")]
            covariances = [
                _matrix(element) for block in segment.all("data") for element in block.all("covarianceMatrix")
            ]
            yield _EphemerisBlock(segment.line, metadata, rows, covariances)


def _matrix(matrix: MessageElement) -> CovarianceBlock:
    """Read a covariance from an XML element whose children are the lower triangle: CX_X, CY_X, CY_Y, …"""
    return named_covariance({element.name: element.text.strip() for element in matrix.children}, matrix.line)


def named_covariance(leaves: Mapping[str, str], line: int) -> CovarianceBlock:
    """Make a covariance from the strings in a message, given by keyword: CX_X, CY_X, CY_Y, …

    Empty strings are treated as missing.
    """
    rows: list[tuple[int, Sequence[str]]] = [
        (line, [leaves[key] for key in keywords if leaves.get(key)]) for keywords in _TRIANGLE_KEYWORDS
    ]
    return CovarianceBlock(line, leaves.get("EPOCH", ""), leaves.get("COV_REF_FRAME", ""), rows)


def _state(state: MessageElement, name: str) -> tuple[int, str, Sequence[str]]:
    location = f"{name}:{state.line}"
    elements = {element.name: element for element in state.children}
    for key in ("EPOCH", *_STATE_KEYWORDS):
        if key not in elements:
            raise PathFileError(f"{location}: the state vector has no {key}")
        unit = "km/s" if key.endswith("_DOT") else "km"
        if key != "EPOCH" and elements[key].units not in ("", unit):
            raise PathFileError(f"{location}: {key} must be in {unit} (got {shown(elements[key].units)})")
    return state.line, elements["EPOCH"].text.strip(), [elements[key].text.strip() for key in _STATE_KEYWORDS]
