"""Formats of orbits: how each is told by its content, what messages call it, and who reads it."""

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from bisar_budget.paths.eof import read_eof
from bisar_budget.paths.flight import Orbit, PathFileError
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.messages import is_markup
from bisar_budget.paths.oem import read_oem
from bisar_budget.paths.omm import read_omm
from bisar_budget.paths.orientation import Orientation
from bisar_budget.paths.recognised import LOG_FORMATS, log_format
from bisar_budget.paths.sp3 import read_sp3
from bisar_budget.paths.tle import read_tle


class OrbitFormat(NamedTuple):
    """A format: its words, what its files show within their first lines, as text and as XML, and its reader.

    The reader takes the bytes of a whole file, what messages call it, the object that is wanted (needed where there
    are several), the middle of the aperture, and the orientation that axes of the stars are turned to the Earth with.
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
_OTHERS = (
    (re.compile(rb"\A(\x1f\x8b|\x1f\x9d|PK\x03\x04|BZh|\xfd7zXZ)"), "a compressed file", "Unpack it"),
    (re.compile(rb"\A.{60}RINEX VERSION / TYPE"), "a RINEX file", "A precise orbit comes as SP3"),
    (re.compile(rb"\A\s*CCSDS_(OPM|OCM|TDM|AEM|APM|CDM)_VERS"), "another message of CCSDS", ""),
    (re.compile(rb"(?i)\A\s*<(!doctype html|html)"), "a page of a web site", "Save the file that it links to"),
)
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
    _refuse(data, name, orbit_format(data), "accepted: a log of a flight")


def _refuse(data: bytes, name: str, found: str | None, accepted: str) -> None:
    """Refuse a file that is an orbit of a format that was found, or something else that is known and not wanted."""
    if found is not None:
        raise PathFileError(f"{name}: is {ORBIT_FORMATS[found].words}", accepted, f"orbit.{found} reads it")
    for sign, words, remedy in _OTHERS:
        if sign.search(data[:_BEGINNING]):
            raise PathFileError(f"{name}: is {words}", accepted, remedy)
