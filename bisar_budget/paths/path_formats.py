"""Formats of orbit files and flight logs: for each, its name, its reader, and the content that identifies it."""

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
    """A format of orbit files: its name, how its files are recognised, and its reader.

    Attributes
    ----------
    words : str
        Name of the format for messages.
    sign : re.Pattern
        Pattern at the beginning of a text file that identifies the format.
    element : bytes
        Name of the XML element that identifies the format; empty for a format that is not XML.
    read : callable
        Reader. Its arguments are the bytes of a file, the name of the file in messages, the name of the object
        (needed if there are several), the middle of the aperture, and the orientation of the Earth, which is used to
        convert celestial axes to Earth-fixed axes. Returns an `Orbit`. Raises `PathFileError` if the file violates
        the format, if it has several objects and no name is given, if it has no object with the given name, or if it
        has no position at the middle of the aperture.
    """

    words: str
    sign: re.Pattern[bytes]
    element: bytes
    read: Callable[[bytes, str, str | None, Instant, Orientation], Orbit]


# The keys are keys of the mission file, in the order of the schema. An OMM in JSON or CSV is identified by keywords.
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
# Formats that users often take for an orbit and that cannot be read: content, words, and a remedy.
_WRITE_OEM = "Write it as an OEM of CCSDS"
_EXPORT_GPX = "Write its track as GPX, with times and heights"
_UNREADABLE_FORMATS = (
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
_CONVERT_UBX = "Write it as a solution of RTKLIB, or as sentences of NMEA 0183"
_EXAMINED_BYTES = 4096  # at the beginning of a file, which identify its format


def orbit_format(data: bytes) -> str | None:
    """Recognise the orbit format of a file from its content; return the key in `ORBIT_FORMATS`, or None."""
    beginning = data[:_EXAMINED_BYTES].removeprefix(b"\xef\xbb\xbf")
    if is_markup(beginning):
        names = re.findall(rb"<(?:\w+:)?(\w+)[\s>]", beginning)
        return next((key for key, form in ORBIT_FORMATS.items() if form.element in names and form.element), None)
    return next((key for key, form in ORBIT_FORMATS.items() if form.sign.search(beginning)), None)


def hold_to_format(data: bytes, name: str, form: str) -> None:
    """Refuse a file that is in a known format other than the orbit format `form`.

    If the mission file has a key for files in the actual format, the error message names this key.
    """
    actual = orbit_format(data)
    if actual == form:
        return
    accepted = f"accepted: {ORBIT_FORMATS[form].words}"
    _refuse(data, name, actual, accepted)
    log = log_format(data)
    if log is not None:
        raise PathFileError(f"{name}: is {LOG_FORMATS[log].words}", accepted, "trajectory.file reads it")


def hold_to_log(data: bytes, name: str) -> None:
    """Refuse a file that contains an orbit instead of a flight log, or has a known but unsupported format.

    If the mission file has a key for files in the actual format, the error message names this key.
    """
    _refuse(data, name, orbit_format(data), f"accepted: a log of a flight, {_words_of_logs()}")


def _words_of_logs() -> str:
    """List all log formats for a message, each with its description and its name in the mission file."""
    return ", ".join(f"{format.words} ({key})" for key, format in LOG_FORMATS.items())


def _refuse(data: bytes, name: str, actual: str | None, accepted: str) -> None:
    """Refuse a file that is an orbit in the format `actual`, or that has a known but unsupported format.

    `actual` is a key of `ORBIT_FORMATS`, or None if the file is not an orbit. `accepted` describes the accepted
    files.
    """
    if actual is not None:
        key = f"orbit: {{{actual}: …}} reads it"
        raise PathFileError(f"{name}: is {ORBIT_FORMATS[actual].words}", accepted, key)
    for sign, words, remedy in _UNREADABLE_FORMATS:
        if sign.search(data[:_EXAMINED_BYTES].removeprefix(b"\xef\xbb\xbf")):
            raise PathFileError(f"{name}: is {words}", accepted, remedy)
    if _has_ubx(data[:_EXAMINED_BYTES]) and log_format(data) is None:
        raise PathFileError(f"{name}: is {_UBX}", accepted, _CONVERT_UBX)


def _has_ubx(data: bytes) -> bool:
    """Whether bytes contain a complete u-blox message: sync bytes, class, id, length, payload and checksum."""
    start = data.find(b"\xb5b")
    while start >= 0:
        end = start + 6 + int.from_bytes(data[start + 4 : start + 6], "little")
        if data[end : end + 2] == _ubx_sums(data[start + 2 : end]) or (start == 0 and end + 2 > len(data) >= 6):
            return True
        start = data.find(b"\xb5b", start + 1)
    return False


def _ubx_sums(data: bytes) -> bytes:
    """Fletcher checksum (two bytes) of a u-blox message.

    The sync bytes and the checksum of the UBX message are not part of `data`.
    """
    first = second = 0
    for byte in data:
        first = (first + byte) & 0xFF
        second = (second + first) & 0xFF
    return bytes((first, second))


# ---------------------------------------------------------------------- logs of flights
class LogFormat(NamedTuple):
    """A format of flight logs: its name, how its files are recognised, and its reader.

    Attributes
    ----------
    words : str
        Name of the format for messages.
    endings : tuple of str
        Usual extensions of file names in this format.
    is_format : callable
        Function that tests whether bytes are a file in this format.
    read : callable
        Reader. Its arguments are the bytes of a file, the name of the file in messages, and the keys of the mission
        file about the log. Returns a `Log`. Raises `PathFileError` if the file has a fault; the message states the
        line, byte or record.
    """

    words: str
    endings: tuple[str, ...]
    is_format: Callable[[bytes], bool]
    read: Callable[[bytes, str, LogKeys], Log]


# The keys are words of the mission file, in the order of the schema. Formats with more specific content come last.
LOG_FORMATS: dict[str, LogFormat] = {
    "csv": LogFormat("CSV with a header", (".csv",), is_csv, read_csv),
    "sbet": LogFormat("an SBET of records of 136 bytes", (".out", ".sbet"), is_sbet, read_sbet),
    "pos": LogFormat("a solution of RTKLIB", (".pos",), is_solution, read_solution),
    "nmea": LogFormat("sentences of NMEA 0183", (".nmea",), is_nmea, read_nmea),
    "gpx": LogFormat("a GPX track", (".gpx",), is_gpx, read_gpx),
    "ulog": LogFormat("a PX4 ULog", (".ulg",), is_ulog, read_ulog),
}
# Keys of a mission file that apply to certain formats only: these formats, and words for a log in one of them.
_KEYS_OF_FORMATS = {
    "week": (("sbet",), "an SBET"),
    "talker": (("nmea",), "an NMEA log"),
    "track": (("gpx",), "a GPX file"),
    "instance": (("ulog", "csv"), "a log of PX4 or ArduPilot"),
}


def log_format(data: bytes) -> str | None:
    """Recognise the log format of a file from its content; return the key in `LOG_FORMATS`, or None."""
    return next((name for name in reversed(LOG_FORMATS) if LOG_FORMATS[name].is_format(data)), None)


def read_log(data: bytes, name: str, stated_format: str | None, keys: LogKeys) -> Log:
    """Read a flight log in the format that the mission file states.

    If `stated_format` is None, the format is recognised from the content, or else from the extension of the name. All
    further arguments are the same as for `LogFormat.read`. Raises `PathFileError` for content of another format, for
    content that is not recognised as a log, and for faults that the reader finds.
    """
    actual = log_format(data)
    if actual is None and is_accuracy(data):
        raise PathFileError(
            f"{name}: is the accuracy file of an SBET (smrmsg), records of ten doubles, 80 bytes",
            "accepted: a log of a flight",
            "trajectory.accuracy reads it; trajectory.file names the SBET",
        )
    if stated_format is not None and actual not in (None, stated_format):
        raise PathFileError(
            f"{name}: is {LOG_FORMATS[actual].words}",
            f"accepted: {LOG_FORMATS[stated_format].words}",
            f"trajectory.format: {actual} reads it",
            key="format",
        )
    by_ending = (key for key, format in LOG_FORMATS.items() if name.lower().endswith(format.endings))
    key_of_log = stated_format or actual or next(by_ending, None)
    if key_of_log is None:
        raise PathFileError(
            f"{name}: is no log that is known by its content",
            f"accepted: {_words_of_logs()}",
            "trajectory.format: csv says what is wrong with a header" if b"\0" not in data[:10_000] else "",
        )
    for key, (formats, words) in _KEYS_OF_FORMATS.items():
        if getattr(keys, key) is not None and key_of_log not in formats:
            raise PathFileError(
                f"is for {words}; {name} is {LOG_FORMATS[key_of_log].words}",
                hint=f"Leave trajectory.{key} out",
                key=key,
            )
    return LOG_FORMATS[key_of_log].read(data, name, keys)
