"""Orbit mean-elements messages (OMM) of CCSDS 502.0-B: as text of keywords and values, as XML, JSON or CSV.

JSON and CSV have the message's keywords. CelesTrak leaves those out there that can have one value only; Space-Track
writes all of them.
"""

import csv
import io
import json
from collections.abc import Iterator, Mapping
from typing import Any

from bisar_budget.faults import shown
from bisar_budget.paths.elements import PLAIN_TYPES, Elements, angle_of, motion_of, orbit_of
from bisar_budget.paths.flight import Orbit, PathFileError
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.messages import (
    EARLIEST,
    LATEST,
    decoded,
    epoch_in,
    hold_to_size,
    is_markup,
    number_in,
    parse_markup,
)
from bisar_budget.paths.orientation import UNKNOWN, Orientation

_VERSION = "CCSDS_OMM_VERS"
_Records = Iterator[tuple[str, Mapping[str, Any]]]
_MANDATORY = {
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4"),  # the second in examples of CCSDS 502.0-B
    "REF_FRAME": ("TEME",),
    "TIME_SYSTEM": ("UTC",),
    "CENTER_NAME": ("EARTH",),
}


def read_omm(
    data: bytes, name: str, wanted: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Orbit from orbit mean-elements messages.

    Parameters
    ----------
    data, name, wanted, center, orientation
        As of every reader of `ORBIT_FORMATS`.

    Raises
    ------
    PathFileError
        The file is not what the standard asks for, or as of `elements.orbit_of`.
    """
    hold_to_size(len(data), name)
    if is_markup(data):
        records = _from_markup(data, name)
    else:
        text = decoded(data, name)
        begins = text.lstrip()
        if begins[:1] in ("[", "{"):
            records = _from_json(text, name)
        else:
            records = _from_keywords(text, name) if begins.startswith(_VERSION) else _from_csv(text, name)
    found = [_from_message(record, where) for where, record in records]
    return orbit_of(found, name, wanted, center, orientation)


def _from_markup(data: bytes, name: str) -> _Records:
    for message in parse_markup(data, name).all("omm"):
        leaves = {}
        for block in ("metadata", "meanElements", "tleParameters"):
            for found in message.all(block):
                leaves.update({one.name: one.text.strip() for one in found.children})
        yield _complete(leaves, f"{name}:{message.line}")


def _from_keywords(text: str, name: str) -> _Records:
    """Messages of a text that has a keyword and a value in each line; each begins with its version."""
    leaves: dict[str, str] = {}
    began = 0
    for at, line in enumerate(text.split("\n"), 1):
        line = line.strip()
        if not line or line.startswith("COMMENT"):
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        if not equals:
            raise PathFileError(f"{name}:{at}: must be a keyword, = and its value (got {shown(line)})")
        if key == _VERSION:
            if began:
                yield _complete(leaves, f"{name}:{began}")
            leaves, began = {}, at
        elif key in leaves:
            raise PathFileError(f"{name}:{at}: {shown(key)} is there twice in the message of line {began}")
        else:
            leaves[key] = value.partition("[")[0].strip()  # a unit, in brackets, is the standard's own
    if began:
        yield _complete(leaves, f"{name}:{began}")


def _complete(leaves: Mapping[str, Any], where: str) -> tuple[str, Mapping[str, Any]]:
    """A message of the standard, which may not leave out what it is about."""
    for key in _MANDATORY:
        _value(leaves, key, where)
    return where, leaves


def _from_json(text: str, name: str) -> _Records:
    try:
        found = json.loads(text)
    except json.JSONDecodeError as error:
        raise PathFileError(f"{name}:{error.lineno}: is not JSON: {error.msg}") from None
    except (RecursionError, ValueError):  # brackets without end, digits without end
        raise PathFileError(f"{name}: is not JSON of orbit mean-elements messages") from None
    records = found if isinstance(found, list) else [found]
    for count, record in enumerate(records, 1):
        where = f"{name}: record {count}" if records is found else name
        if not isinstance(record, dict):
            raise PathFileError(f"{where}: must have keywords and values")
        # A list or a mapping is no value of any keyword.
        yield where, {key: value for key, value in record.items() if isinstance(value, str | int | float)}


def _from_csv(text: str, name: str) -> _Records:
    lines = csv.reader(io.StringIO(text, newline=""))
    try:
        header = next(lines, [])
        if "NORAD_CAT_ID" not in header and "EPOCH" not in header:
            said = "is empty" if not text.strip() else "is no orbit mean-elements message"
            raise PathFileError(f"{name}: {said}; accepted: text of keywords, XML, JSON, CSV with a line of keywords")
        for line in lines:
            if not line:
                continue
            where = f"{name}:{lines.line_num}"
            if len(line) != len(header):
                raise PathFileError(f"{where}: has {len(line)} values, line 1 has {len(header)} keywords")
            yield where, dict(zip(header, line, strict=True))
    except csv.Error as error:
        raise PathFileError(f"{name}:{lines.line_num}: is not CSV: {error}") from None


def _value(record: Mapping[str, Any], key: str, where: str) -> Any:
    value = record.get(key)
    if value is None or value == "":
        raise PathFileError(f"{where}: has no {key}")
    return value


def _from_message(record: Mapping[str, Any], where: str) -> Elements:
    for key, accepted in _MANDATORY.items():
        value = record.get(key)
        if value not in (None, "") and str(value).strip().upper() not in accepted:
            raise PathFileError(f"{where}: {key} must be {accepted[0]} (got {shown(str(value))})")
    kind = str(record.get("EPHEMERIS_TYPE", "")).strip()
    if kind not in (*PLAIN_TYPES, "SGP4"):
        raise PathFileError(f"{where}: the elements are of type {shown(kind)}, which SGP4 does not propagate")

    def number(key: str) -> float:
        value = _value(record, key, where)
        found = number_in(value)
        if found is None:
            raise PathFileError(f"{where}: {key} must be a number (got {shown(str(value))})")
        return found

    def angle(key: str, most: float) -> float:
        return angle_of(number(key), most, key, where)

    catalogue = number("NORAD_CAT_ID")
    if not 0 <= catalogue <= 999_999_999 or catalogue != int(catalogue):
        raise PathFileError(
            f"{where}: NORAD_CAT_ID must be a whole number of up to nine digits"
            f" (got {shown(str(record['NORAD_CAT_ID']))})"
        )
    written = str(_value(record, "EPOCH", where))
    epoch = epoch_in(written)
    if epoch is None or not EARLIEST <= epoch.day < LATEST:
        raise PathFileError(
            f"{where}: EPOCH must be an instant such as 2026-05-31T10:12:13.123 (got {shown(written)})"
        )
    eccentricity = number("ECCENTRICITY")
    if not 0 <= eccentricity < 1:
        raise PathFileError(f"{where}: ECCENTRICITY must be from 0 to less than 1 (got {eccentricity:g})")
    object_name = record.get("OBJECT_NAME")
    return Elements(
        name=shown(" ".join(str(object_name).split())) if object_name is not None else "",
        number=int(catalogue),
        epoch=epoch,
        mean_motion=motion_of(number("MEAN_MOTION"), where),
        eccentricity=eccentricity,
        inclination=angle("INCLINATION", 180),
        node=angle("RA_OF_ASC_NODE", 360),
        perigee=angle("ARG_OF_PERICENTER", 360),
        anomaly=angle("MEAN_ANOMALY", 360),
        drag=number("BSTAR"),
        kind="orbit mean elements",
        where=where,
    )
