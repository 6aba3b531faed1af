"""Formats of logs by their content, and what is said where another one is stated, or none fits."""

import re
from typing import Any

import pytest

from bisar_budget.mission.platforms import TrajectorySource
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.log_places import LogKeys
from bisar_budget.paths.path_formats import (
    LOG_FORMATS,
    ORBIT_FORMATS,
    hold_to_format,
    hold_to_log,
    log_format,
    read_log,
)
from bisar_budget.paths.sp3 import read_sp3
from tests.paths.flown import earth_fixed_csv, flight, geodetic_csv, sbet, smrmsg
from tests.paths.log_files import every_format
from tests.paths.orbit_files import TLE, oem, oem_xml, omm_json, omm_xml

SHORT = flight(34)
FILES = every_format(SHORT) | {
    "flight.csv": ("csv", geodetic_csv(SHORT), {}),
    "earth.csv": ("csv", earth_fixed_csv(SHORT), {}),
    "sbet.out": ("sbet", sbet(SHORT), {}),
}


@pytest.mark.parametrize(("name", "kind"), [(name, kind) for name, (kind, _, _) in FILES.items()])
def test_a_log_is_known_by_its_content(name: str, kind: str) -> None:
    data = FILES[name][1]
    assert log_format(data) == kind
    others = [one for one, format in LOG_FORMATS.items() if one != kind and format.is_format(data)]
    assert others == []


@pytest.mark.parametrize("name", FILES)
def test_another_format_is_named_for_what_it_is(name: str) -> None:
    kind, data, _ = FILES[name]
    stated = "csv" if kind != "csv" else "gpx"
    with pytest.raises(PathFileError) as error:
        read_log(data, name, stated, LogKeys())
    assert str(error.value) == f"{name}: is {LOG_FORMATS[kind].words}"
    assert error.value.accepted == f"accepted: {LOG_FORMATS[stated].words}"
    assert error.value.hint == f"trajectory.format: {kind} reads it"
    assert error.value.key == "format"


@pytest.mark.parametrize(
    "data",
    [
        *(TLE.encode(), oem().encode(), oem_xml(oem()), omm_json(), omm_xml(), smrmsg(SHORT.times)),
        *(b"", b"\0" * 136, b"0" * 136, b"1234567 " * 17, b"{}", b"<kml/>", b"PK\x03\x04", b"hello, world\n"),
        b"time [s],speed [m/s]\n0,1\n",
    ],
)
def test_what_is_no_log_is_none(data: bytes) -> None:
    assert log_format(data) is None


@pytest.mark.parametrize(
    ("data", "name", "says"),
    [
        (b"PK\x03\x04\0\0", "a.zip", "a.zip: is no log that is known by its content"),
        (b"\xff" * 136, "a.out", "a.out: record 1: "),  # by the ending of its name
        (sbet(SHORT)[: 10 * 136 - 1], "b.out", "b.out: ends at byte 1359, 135 into record 10"),
        (smrmsg(SHORT.times), "b.out", "b.out: is the accuracy file of an SBET (smrmsg), records of ten doubles, 80"),
        (b"ULog", "a.ulg", "a.ulg: is no ULog"),
        (b"<tcx/>", "a.gpx", "a.gpx:1: is no GPX, its root is tcx"),
        (b"hello\n", "a.csv", "a.csv:1: names no position"),
        (b"hello\n", "a.txt", "a.txt: is no log that is known by its content"),
    ],
)
def test_what_is_not_known_is_read_by_its_name_or_refused(data: bytes, name: str, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_log(data, name, None, LogKeys())
    assert str(error.value).startswith(says)
    if "known by its content" in says:
        assert all(f"({one})" in error.value.accepted for one in LOG_FORMATS)
        assert ("trajectory.format: csv says" in error.value.hint) == (name == "a.txt")


@pytest.mark.parametrize("name", [name for name in FILES if name != "sbet.out"])
def test_a_week_is_for_an_sbet(name: str) -> None:
    kind, data, _ = FILES[name]
    with pytest.raises(PathFileError) as error:
        read_log(data, name, None, LogKeys(week=2421))
    assert str(error.value) == f"is for an SBET; {name} is {LOG_FORMATS[kind].words}"
    assert error.value.key == "week"


@pytest.mark.parametrize(("keys", "key"), [({"time_scale": "utc"}, "time_scale"), ({"geoid_separation": 1.0}, None)])
def test_an_sbet_says_its_scale_and_heights(keys: dict[str, Any], key: str | None) -> None:
    with pytest.raises(PathFileError) as error:
        read_log(FILES["sbet.out"][1], "sbet.out", None, LogKeys(**keys))
    assert error.value.key == (key or "geoid_separation")


def test_the_mission_file_knows_every_format() -> None:
    (key,) = TrajectorySource.__annotations__["format"].__metadata__
    assert key.reader.names == tuple(LOG_FORMATS)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"stk.v.12.0\nBEGIN Ephemeris\nNumberOfEphemerisPoints 3\n", "an ephemeris of STK"),
        (b"# made by us\nBEGIN Ephemeris\n", "an ephemeris of STK"),
        (b"*******\n Revised: July 31, 2013\n$$SOE\n2459293.5 = A.D. 2021-Mar-20\n", "an answer of Horizons"),
        (b"API VERSION: 1.2\nAPI SOURCE: NASA/JPL Horizons API\n", "an answer of Horizons"),
        (
            b"created:2024-01-01 00:00:00 UTC\nephemeris_start:2024-01-01 00:00:42 UTC\n",
            "an ephemeris of SpaceX (MEME)",
        ),
        (b"<!DOCTYPE html>\n<html>", "a page of a web site"),
    ],
)
@pytest.mark.parametrize("form", ["oem", "tle", "sp3"])
def test_an_orbit_of_a_format_that_is_not_read_is_named(data: bytes, words: str, form: str) -> None:
    with pytest.raises(PathFileError) as error:
        hold_to_format(data, "a.e", form)
    assert str(error.value) == f"a.e: is {words}"
    assert error.value.accepted == f"accepted: {ORBIT_FORMATS[form].words}"


UBX = b"\xb5b\x0a\x04\x00\x00\x0e4"  # a request of MON-VER, with its sums
DATAFLASH = b"\xa3\x95\x80\x80YFMT\0BBnNZ\0" + bytes(70)
NOT_READ = {
    "flight.kml": (b'<?xml version="1.0"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"/>', "KML of Google Earth"),
    "a.ubx": (UBX, "messages of u-blox (UBX)"),
    "noise-first.ubx": (b"\0\1\xb5b\xff" + UBX, "messages of u-blox (UBX)"),
    "a.fit": (b"\x0e\x10\xd9\x07\0\0\0\0.FIT\0\0", "a FIT file of Garmin"),
    "a.igc": (b"AXCS123\r\nHFDTE010626\r\nB0520014805196N01116782EA0295303000\r\n", "an IGC file of a glider"),
    "00000017.bin": (DATAFLASH, "a dataflash log of ArduPilot in binary"),
}


@pytest.mark.parametrize("ending", ["", ".gpx", ".csv", ".nmea", ".out"])
@pytest.mark.parametrize("name", NOT_READ)
def test_a_log_of_a_format_that_is_not_read_is_named(name: str, ending: str) -> None:
    """By its content, whatever its name: KML was no GPX, and u-blox an SBET that ended early."""
    data, words = NOT_READ[name]
    with pytest.raises(PathFileError) as error:
        hold_to_log(data, name + ending)
    assert str(error.value) == f"{name}{ending}: is {words}"
    assert all(f"({one})" in error.value.accepted for one in LOG_FORMATS)
    assert error.value.hint.startswith("Write it")
    with pytest.raises(PathFileError, match=rf": is {re.escape(words)}"):
        hold_to_format(data, name, "oem")


@pytest.mark.parametrize("name", FILES)
def test_logs_that_are_read_are_none_of_those(name: str) -> None:
    hold_to_log(FILES[name][1], name)


def test_sentences_among_messages_of_u_blox_are_read() -> None:
    """A receiver that writes both: the sentences are the log."""
    hold_to_log(UBX + FILES["a.nmea"][1], "both.ubx")


def test_two_bytes_of_sync_alone_are_no_message() -> None:
    hold_to_log(b"abc \xb5b\x01\x07\x02\x00xx--", "a.txt")


def test_sp3_whose_first_line_is_blank_says_so() -> None:
    with pytest.raises(PathFileError, match=r"^a\.sp3:1: is blank; SP3 begins with a line like #cP or #dV"):
        read_sp3(b"\n#cP2021\n", "a.sp3", None, Instant(59000, 0.0))
