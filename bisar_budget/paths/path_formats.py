"""Formats of orbits and of logs: how each is told by its content, what messages call it, and who reads it."""

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from bisar_budget.paths.elements import read_omm, read_tle
from bisar_budget.paths.eof import read_eof
from bisar_budget.paths.flight import Log, Orbit, PathFileError
from bisar_budget.paths.flight_log import is_csv, read_csv
from bisar_budget.paths.gpx import is_gpx, read_gpx
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.log_places import LogKeys
from bisar_budget.paths.messages import is_markup
from bisar_budget.paths.nmea import is_nmea, read_nmea
from bisar_budget.paths.oem import read_oem
from bisar_budget.paths.orientation import Orientation
from bisar_budget.paths.rtklib import is_solution, read_solution
from bisar_budget.paths.sbet import is_accuracy, is_sbet, read_sbet
from bisar_budget.paths.sp3 import read_sp3
from bisar_budget.paths.ulog import is_ulog, read_ulog


class OrbitFormat(NamedTuple):
    """A format: its words, what its files show within their first lines, as text and as XML, and its reader.

    The reader takes the bytes of a whole file, what messages call it, the object that is wanted (needed where there
    are several), the middle of the aperture, and the orientation that axes of the stars are turned to the Earth with.
    A `PathFileError` of it says what in the file is not as its format asks for, that it has several objects or none
    of the name, or no place at the middle of the aperture.
    """

    words: str
    sign: re.Pattern[bytes]
    element: bytes
    read: Callable[[bytes, str, str | None, Instant, Orientation], Orbit]


# By the key of the mission file, in the order of the schema. An OMM in JSON or CSV shows its keywords.
ORBIT_FORMATS: Mapping[str, OrbitFormat] = {
    "tle": OrbitFormat(
        "two-line elements", re.compile(rb"(?m)^1 [ \w]{5}[UCS ].{61}\r?\n2 [ \w]{5} .{61}\r?$"), b"", read_tle
    ),
    "omm": OrbitFormat(
        "an orbit mean-elements message (OMM)",
        re.compile(rb"\A\s*CCSDS_OMM_VERS|\A[\[{][^\0]*\"MEAN_MOTION\"|\A[A-Z_,]*\bNORAD_CAT_ID\b"),
        b"omm",
        read_omm,
    ),
    "oem": OrbitFormat("an orbit ephemeris message (OEM)", re.compile(rb"\A\s*CCSDS_OEM_VERS"), b"oem", read_oem),
    "eof": OrbitFormat("an Earth Explorer orbit file (EOF)", re.compile(rb"(?!)"), b"Earth_Explorer_File", read_eof),
    "sp3": OrbitFormat("an orbit in SP3", re.compile(rb"\A#[abcd][PV]\d{4} "), b"", read_sp3),
}
# What is often taken for an orbit and cannot be read: its words, and what to do.
_WRITE_OEM = "Write it as an OEM of CCSDS"
_EXPORT_GPX = "Write its track as GPX, with times and heights"
_OTHERS = (
    (re.compile(rb"\A(\x1f\x8b|\x1f\x9d|PK\x03\x04|BZh|\xfd7zXZ)"), "a compressed file", "Unpack it"),
    (re.compile(rb"\A.{60}RINEX VERSION / TYPE"), "a RINEX file", "A precise orbit comes as SP3"),
    (re.compile(rb"\A\s*CCSDS_(OPM|OCM|TDM|AEM|APM|CDM)_VERS"), "another message of CCSDS", ""),
    (re.compile(rb"(?i)\A\s*<(!doctype html|html)"), "a page of a web site", "Save the file that it links to"),
    (re.compile(rb"(?i)\A\s*stk\.v\."), "an ephemeris of STK", _WRITE_OEM),
    (
        re.compile(rb"(?m)^\$\$SOE|^ *Target body name:|JPL/HORIZONS|\AAPI VERSION:"),
        "an answer of Horizons",
        _WRITE_OEM,
    ),
    (re.compile(rb"\Acreated:.*\s+ephemeris_start:"), "an ephemeris of SpaceX (MEME)", _WRITE_OEM),
    (re.compile(rb"(?m)^BEGIN Ephemeris"), "an ephemeris of STK", _WRITE_OEM),
    (re.compile(rb"(?s)\A\s*<(?:.{0,2000}<)?(?:\w+:)?kml[\s>/]"), "KML of Google Earth", _EXPORT_GPX),
    (re.compile(rb"(?s)\A[\x0c\x0e].{7}\.FIT"), "a FIT file of Garmin", _EXPORT_GPX),
    (re.compile(rb"(?m)^HFDTE|^B\d{13}[NS]\d{8}[EW][AV]"), "an IGC file of a glider", _EXPORT_GPX),
    (
        re.compile(rb"\A\xa3\x95\x80\x80\x59FMT"),
        "a dataflash log of ArduPilot in binary",
        "Write it as text, or its GPS rows as CSV, by mavlogdump.py",
    ),
)
_UBX = "messages of u-blox (UBX)"
_FROM_UBX = "Write it as a solution of RTKLIB, or as sentences of NMEA 0183"
_BEGINNING = 4096  # bytes that tell a format


def orbit_format(data: bytes) -> str | None:
    """Key of an orbit's format by its content; None where it is none of `ORBIT_FORMATS`."""
    begins = data[:_BEGINNING].removeprefix(b"\xef\xbb\xbf")
    if is_markup(begins):
        names = re.findall(rb"<(?:\w+:)?(\w+)[\s>]", begins)
        return next((key for key, one in ORBIT_FORMATS.items() if one.element in names and one.element), None)
    return next((key for key, one in ORBIT_FORMATS.items() if one.sign.search(begins)), None)


def hold_to_format(data: bytes, name: str, form: str) -> None:
    """Refuse a file that is known to be of another format than an orbit's, and say which key reads that."""
    found = orbit_format(data)
    if found == form:
        return
    accepted = f"accepted: {ORBIT_FORMATS[form].words}"
    _refuse(data, name, found, accepted)
    log = log_format(data)
    if log is not None:
        raise PathFileError(f"{name}: is {LOG_FORMATS[log].words}", accepted, "trajectory.file reads it")


def hold_to_log(data: bytes, name: str) -> None:
    """Refuse a file that is known to be no log of a flight, and say which key reads it."""
    _refuse(data, name, orbit_format(data), f"accepted: a log of a flight, {_words_of_logs()}")


def _words_of_logs() -> str:
    """Formats of logs that are read, each with its word."""
    return ", ".join(f"{format.words} ({one})" for one, format in LOG_FORMATS.items())


def _refuse(data: bytes, name: str, found: str | None, accepted: str) -> None:
    """Refuse a file that is an orbit of a format that was found, or something else that is known and not wanted."""
    if found is not None:
        key = f"orbit: {{{found}: …}} reads it"
        raise PathFileError(f"{name}: is {ORBIT_FORMATS[found].words}", accepted, key)
    for sign, words, remedy in _OTHERS:
        if sign.search(data[:_BEGINNING].removeprefix(b"\xef\xbb\xbf")):
            raise PathFileError(f"{name}: is {words}", accepted, remedy)
    if _has_ubx(data[:_BEGINNING]) and log_format(data) is None:
        raise PathFileError(f"{name}: is {_UBX}", accepted, _FROM_UBX)


def _has_ubx(data: bytes) -> bool:
    """Whether bytes have a whole message of u-blox: two bytes of sync, class, id, length, payload, two sums."""
    at = data.find(b"\xb5b")
    while at >= 0:
        end = at + 6 + int.from_bytes(data[at + 4 : at + 6], "little")
        if data[end : end + 2] == _ubx_sums(data[at + 2 : end]) or (at == 0 and end + 2 > len(data) >= 6):
            return True
        at = data.find(b"\xb5b", at + 1)
    return False


def _ubx_sums(data: bytes) -> bytes:
    """Checksum of a message of u-blox, after Fletcher."""
    first = second = 0
    for byte in data:
        first = (first + byte) & 0xFF
        second = (second + first) & 0xFF
    return bytes((first, second))


# ---------------------------------------------------------------------- logs of flights
class LogFormat(NamedTuple):
    """A format: its words, endings of names of its files, whether bytes are one, and its reader.

    The reader takes the bytes, what messages call the file, and what the mission file says of it. A `PathFileError`
    of it names the file and the line, byte or record of the fault.
    """

    words: str
    endings: tuple[str, ...]
    is_one: Callable[[bytes], bool]
    read: Callable[[bytes, str, LogKeys], Log]


# By the word of the mission file, in the order of the schema. What is told by more stands behind.
LOG_FORMATS: dict[str, LogFormat] = {
    "csv": LogFormat("CSV with a header", (".csv",), is_csv, read_csv),
    "sbet": LogFormat("an SBET of records of 136 bytes", (".out", ".sbet"), is_sbet, read_sbet),
    "pos": LogFormat("a solution of RTKLIB", (".pos",), is_solution, read_solution),
    "nmea": LogFormat("sentences of NMEA 0183", (".nmea",), is_nmea, read_nmea),
    "gpx": LogFormat("a GPX track", (".gpx",), is_gpx, read_gpx),
    "ulog": LogFormat("a PX4 ULog", (".ulg",), is_ulog, read_ulog),
}
# Keys of a mission file that are for some formats alone: which, and what messages call a log of them.
_KEYS_OF_FORMATS = {
    "week": (("sbet",), "an SBET"),
    "talker": (("nmea",), "an NMEA log"),
    "track": (("gpx",), "a GPX file"),
    "instance": (("ulog", "csv"), "a log of PX4 or ArduPilot"),
}


def log_format(data: bytes) -> str | None:
    """Format of a log by its content; None where it is none of `LOG_FORMATS`."""
    return next((name for name in reversed(LOG_FORMATS) if LOG_FORMATS[name].is_one(data)), None)


def read_log(data: bytes, name: str, stated: str | None, keys: LogKeys) -> Log:
    """Read a log of the format that the mission file states; None: by its content, or else by the ending of its name.

    All else are arguments of its reader. A `PathFileError` says that the content is that of another format, or of
    none; or what the reader says.
    """
    found = log_format(data)
    if found is None and is_accuracy(data):
        raise PathFileError(
            f"{name}: is the accuracy file of an SBET (smrmsg), records of ten doubles, 80 bytes",
            "accepted: a log of a flight",
            "trajectory.accuracy reads it; trajectory.file names the SBET",
        )
    if stated is not None and found not in (None, stated):
        raise PathFileError(
            f"{name}: is {LOG_FORMATS[found].words}",
            f"accepted: {LOG_FORMATS[stated].words}",
            f"trajectory.format: {found} reads it",
            key="format",
        )
    by_ending = (one for one, format in LOG_FORMATS.items() if name.lower().endswith(format.endings))
    chosen = stated or found or next(by_ending, None)
    if chosen is None:
        raise PathFileError(
            f"{name}: is no log that is known by its content",
            f"accepted: {_words_of_logs()}",
            "trajectory.format: csv says what is wrong with a header" if b"\0" not in data[:10_000] else "",
        )
    for key, (formats, words) in _KEYS_OF_FORMATS.items():
        if getattr(keys, key) is not None and chosen not in formats:
            raise PathFileError(
                f"is for {words}; {name} is {LOG_FORMATS[chosen].words}",
                hint=f"Leave trajectory.{key} out",
                key=key,
            )
    return LOG_FORMATS[chosen].read(data, name, keys)
