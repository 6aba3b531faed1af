"""Files of orbits that are broken: what is said of each, and that nothing else comes out of any bytes."""

import gzip
import json
import math

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from bisar_budget.paths import messages
from bisar_budget.paths.elements import read_omm, read_tle
from bisar_budget.paths.eof import read_eof
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.oem import read_oem
from bisar_budget.paths.orientation import read_earth_rotation
from bisar_budget.paths.path_formats import LOG_FORMATS, ORBIT_FORMATS, hold_to_format, hold_to_log, orbit_format
from bisar_budget.paths.sp3 import read_sp3
from tests.conftest import ROOT, examples
from tests.paths.flown import flight, geodetic_csv
from tests.paths.log_files import every_format
from tests.paths.orbit_files import (
    CENTER,
    CONSTANTS,
    LINE_1,
    LINE_2,
    MESSAGE,
    START,
    TLE,
    checked,
    instant,
    oem,
    oem_xml,
    omm_csv,
    omm_json,
    omm_text,
    omm_xml,
)
from tests.paths.test_elements import OTHER
from tests.paths.test_ephemeris import interpolation
from tests.paths.test_sp3 import FILES, low

INSIDE = START.after(600)
OEM = oem()
LAST = OEM.splitlines()[-1]


def sets(*lines: str) -> str:
    return "\n".join(lines) + "\n"


def column(line: str, start: int, text: str) -> str:
    """A line with other text from a column on, counted from 1, and its checksum."""
    return checked(line[: start - 1] + text + line[start - 1 + len(text) :])


def without(key: str) -> bytes:
    return json.dumps([{name: value for name, value in MESSAGE.items() if name != key}]).encode()


def first_rows(text: str, *changes: tuple[str, str]) -> str:
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    return text


HOSTILE = b"""<?xml version="1.0"?>
<!DOCTYPE ndm [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<ndm><omm>&b;</omm></ndm>
"""

TLES = {
    "empty": ("", "x: has no element set"),
    "a page of the web": (
        "<!DOCTYPE html>\n<html>\n",
        "x:2: must be line 1 of the set that line 1 names (got <html>)",
    ),
    "no line 2": (sets(LINE_1), "x:1: line 1 of an element set has no line 2 after it"),
    "cut off": (TLE[:-20], "x:3: has 50 columns, a line of an element set has 69"),
    "checksum": (sets(LINE_1, LINE_2[:-1] + "7"), "x:2: the checksum is 7, its digits give 1"),
    "two satellites": (sets(LINE_1, OTHER.splitlines()[1]), "x:2: is of object 270001, line 1 above it of 39634"),
    "wrong order": (sets(LINE_2, LINE_1), "x:1: is line 2 of an element set; its line 1 must come before it"),
    "line 1 twice": (
        sets(LINE_1, LINE_1),
        "x:2: must be line 2 of the set that begins in line 1 (got 1 39634U 14016A   26151.42515188 "
        " .00000355  00000+0  849...)",
    ),
    "two names": (sets("A", "B", LINE_1, LINE_2), "x:2: must be line 1 of the set that line 1 names (got B)"),
    "name at the end": (
        TLE + "SENTINEL-1B\n",
        "x:4: must be line 1 of an element set, or a name above one (got SENTINEL-1B)",
    ),
    "letters in a number": (
        sets(LINE_1, column(LINE_2, 9, " 9B.1813")),
        "x:2: inclination must be a number in columns 9 to 16 (got 9B.1813)",
    ),
    "letters in an epoch": (
        sets(column(LINE_1, 19, "26l51.4"), LINE_2),
        "x:1: epoch day must be a number in columns 21 to 32 (got l51.42515188)",
    ),
    "day 400": (sets(column(LINE_1, 21, "400"), LINE_2), "x:1: epoch day must be from 1 to 365 (got 400.42515188)"),
    "inclination": (
        sets(LINE_1, column(LINE_2, 9, "198.1813")),
        "x:2: inclination must be from 0 to 180 degrees (got 198.181)",
    ),
    "mean motion": (
        sets(LINE_1, column(LINE_2, 53, " 0.00000000")),
        "x:2: mean motion must be more than 0 and less than 20 a day (got 0)",
    ),
    "drag": (
        sets(column(LINE_1, 54, " 8497x-4"), LINE_2),
        "x:1: B* must be a number in columns 54 to 61 (got 8497x-4)",
    ),
    "catalogue number": (
        sets(column(LINE_1, 3, "I9634"), LINE_2),
        "x:1: the catalogue number must be in columns 3 to 7 (got I9634)",
    ),
    "SGP4-XP": (
        sets(column(LINE_1, 63, "4"), LINE_2),
        "x:1: the elements are of type 4, which SGP4 does not propagate",
    ),
    "non-ASCII": (sets("SÉNTINEL", LINE_1, LINE_2), "x:1: has a character that element sets do not have (got É)"),
    "full-width digit": (
        sets(LINE_1, LINE_2.replace("98", "9８")),
        "x:2: has a character that element sets do not have (got ８)",
    ),
    "refused by SGP4": (
        sets(LINE_1, column(LINE_2, 27, "9999999")),
        "x:1: SGP4 refuses 39634: its semilatus rectum falls below zero",
    ),
    "two objects": (sets(LINE_1, LINE_2, OTHER), "x: has 2 objects: 39634, 270001; choose one by its name or number"),
}
OMMS = {
    "empty": (b"", "x: is empty; accepted: text of keywords, XML, JSON, CSV with a line of keywords"),
    "text": (
        b"No GP data found",
        "x: is no orbit mean-elements message; accepted: text of keywords, XML, JSON, CSV with a line of keywords",
    ),
    "without NORAD_CAT_ID": (without("NORAD_CAT_ID"), "x: record 1: has no NORAD_CAT_ID"),
    "without EPOCH": (without("EPOCH"), "x: record 1: has no EPOCH"),
    "other theory": (
        omm_json(MEAN_ELEMENT_THEORY="SGP4-XP"),
        "x: record 1: MEAN_ELEMENT_THEORY must be SGP4 (got SGP4-XP)",
    ),
    "other axes": (omm_json(REF_FRAME="GCRF"), "x: record 1: REF_FRAME must be TEME (got GCRF)"),
    "other time": (omm_json(TIME_SYSTEM="TAI"), "x: record 1: TIME_SYSTEM must be UTC (got TAI)"),
    "other centre": (omm_json(CENTER_NAME="MOON"), "x: record 1: CENTER_NAME must be EARTH (got MOON)"),
    "type 4": (omm_json(EPHEMERIS_TYPE=4), "x: record 1: the elements are of type 4, which SGP4 does not propagate"),
    "letters": (omm_json(INCLINATION="98.l8"), "x: record 1: INCLINATION must be a number (got 98.l8)"),
    "NaN": (omm_json(BSTAR=math.nan), "x: record 1: BSTAR must be a number (got nan)"),
    "list": (omm_json(MEAN_MOTION=[14.6]), "x: record 1: has no MEAN_MOTION"),
    "boolean": (omm_json(ECCENTRICITY=True), "x: record 1: ECCENTRICITY must be a number (got True)"),
    "hyperbola": (omm_json(ECCENTRICITY=1.2), "x: record 1: ECCENTRICITY must be from 0 to less than 1 (got 1.2)"),
    "epoch": (
        omm_json(EPOCH="31 May 2026"),
        "x: record 1: EPOCH must be an instant such as 2026-05-31T10:12:13.123 (got 31 May 2026)",
    ),
    "number of ten digits": (
        omm_json(NORAD_CAT_ID=1234567890),
        "x: record 1: NORAD_CAT_ID must be a whole number of up to nine digits (got 1234567890)",
    ),
    "a text": (b'["', "x:1: is not JSON: Unterminated string starting at"),
    "one message short of a value": (json.dumps({"NORAD_CAT_ID": 39634}).encode(), "x: has no EPOCH"),
    "empty object": (b"{}", "x: has no NORAD_CAT_ID"),
    "list of numbers": (b"[1]", "x: record 1: must have keywords and values"),
    "empty list": (b"[]", "x: has no element set"),
    "cut off JSON": (omm_json()[:-40], "x:1: is not JSON: Unterminated string starting at"),
    "brackets without end": (b"[" * 100_000, "x: is not JSON of orbit mean-elements messages"),
    "digits without end": (b"[" + b"1" * 10_000 + b"]", "x: is not JSON of orbit mean-elements messages"),
    "entity": (HOSTILE, "x:2: declares a document type (DOCTYPE), which is not read; take it out"),
    "cut off XML": (omm_xml()[:-100], "x:28: is not XML: unclosed token"),
    "XML without frame": (omm_xml().replace(b"<REF_FRAME>TEME</REF_FRAME>\n", b""), "x:3: has no REF_FRAME"),
    "XML of something else": (b"<html/>", "x: has no element set"),
    "unknown encoding": (
        b"<?xml version='1.0' encoding='klingon'?><omm/>",
        "x:1: is not XML: unknown encoding: klingon",
    ),
    "not UTF-8": (omm_csv().replace(b"SENTINEL", b"SENTIN\xcbL"), "x:2: is not a text in UTF-8 (byte 0xcb)"),
    "CSV short of a value": (omm_csv().replace(b",39634", b""), "x:2: has 16 values, line 1 has 17 keywords"),
}
OEMS = {
    "empty": (b"", "x: has no segment of an orbit ephemeris message"),
    "something else": (b"EPOCH,X,Y,Z\n", "x:1: must begin with CCSDS_OEM_VERS (got EPOCH,X,Y,Z)"),
    "no segment": (b"CCSDS_OEM_VERS = 2.0\nORIGINATOR = TESTS\n", "x: has no segment of an orbit ephemeris message"),
    "without frame": (first_rows(OEM, ("REF_FRAME = ITRF2014\n", "")), "x:4: the metadata have no REF_FRAME"),
    "unknown frame": (
        oem(frame="TOD"),
        "x:8: REF_FRAME TOD is not known; accepted: ITRF with or without its year, WGS84, TEME, GCRF,"
        " ICRF, EME2000, J2000",
    ),
    "unknown time system": (oem(system="SCLK"), "x:9: TIME_SYSTEM SCLK is not known; accepted: UTC, TAI, GPS, TT"),
    "other centre": (OEM.replace("= EARTH", "= MARS"), "x:7: CENTER_NAME must be EARTH (got MARS)"),
    "TEME of an epoch": (
        oem(frame="TEME", extra=["REF_FRAME_EPOCH = 2026-06-01T00:00:00"]),
        "x:12: TEME is read as of date, not of one epoch",
    ),
    "unknown interpolation": (
        oem(interpolation=interpolation("SPLINE", 3)),
        "x:12: INTERPOLATION SPLINE is not known; accepted: HERMITE, LAGRANGE, LINEAR",
    ),
    "degree": (
        oem(interpolation=interpolation("LAGRANGE", 0)),
        "x:13: INTERPOLATION_DEGREE must be a whole number from 1 to 31 (got 0)",
    ),
    "too few for Lagrange": (
        oem(count=7, interpolation=interpolation("LAGRANGE", 7)),
        "x:4: the segment has 7 positions; Lagrange of degree 7 needs 8",
    ),
    "too few for Hermite": (
        oem(count=3, interpolation=interpolation("HERMITE", 7)),
        "x:4: the segment has 3 positions; Hermite of degree 7 needs 4",
    ),
    "one place": (oem(count=1), "x:4: the segment has 1 position; Hermite of degree 7 needs 4"),
    "no ephemeris": (OEM.partition("META_STOP")[0] + "META_STOP\n", "x:4: the segment has no ephemeris"),
    "out of order": (
        OEM.replace("T05:03:00.000000000 ", "T05:01:30.000000000 "),
        "x:18: the time 2026-06-01T05:01:30.000000000 is earlier than the one before it; times must rise",
    ),
    "there twice": (
        OEM.replace("T05:03:00.000000000 ", "T05:02:00.000000000 "),
        "x:18: the time 2026-06-01T05:02:00.000000000 is there twice; times must rise",
    ),
    "cut off in a line": (
        OEM[:-60],
        "x:35: must be a time with 6 numbers, or 9 with accelerations (has 3:"
        " 2026-06-01T05:20:00.000000000 -22.935973013419 -984.08781...)",
    ),
    "cut off between lines": (
        "\n".join(OEM.splitlines()[:-4]),
        "x:11: STOP_TIME is 2026-06-01T05:20:00.000000000, the ephemeris has nothing beyond 2026-06-01T05:16:00.000Z",
    ),
    "cut off in the metadata": (OEM.partition("STOP_TIME")[0], "x:10: ends within metadata"),
    "cut off in a covariance": (OEM + "COVARIANCE_START\n", "x:36: ends within a covariance"),
    "NaN": (OEM.replace(LAST.split()[2], "NaN"), "x:35: must be a number of km or km/s (got NaN)"),
    "infinite": (OEM.replace(LAST.split()[5], "1e999"), "x:35: must be a number of km or km/s (got 1e999)"),
    "time": (
        OEM.replace("T05:03:00.000000000 ", "T05:63:00.000000000 "),
        "x:18: must be a time such as 2026-05-31T10:12:13.123 (got 2026-06-01T05:63:00.000000000)",
    ),
    "leap second of no day": (
        OEM.replace("T05:03:00.000000000 ", "T23:59:60.000000000 "),
        "x:18: must be a time such as 2026-05-31T10:12:13.123 (got 2026-06-01T23:59:60.000000000)",
    ),
    "before 1972": (
        OEM.replace("2026-06-01T05:00:00.000000000 ", "1969-06-01T05:00:00.0 "),
        "x:15: times must be after 1972-01-01 and before 2200 (got 1969-06-01T05:00:00.0)",
    ),
    "keyword twice": (oem(extra=["REF_FRAME = TEME"]), "x:12: REF_FRAME is there twice; before in line 8"),
    "no keyword": (oem(extra=["REF_FRAME"]), "x:12: must be a keyword, = and its value (got REF_FRAME)"),
    "XML in metres": (oem_xml(OEM).replace(b'<X units="km">', b'<X units="m">'), "x:15: X must be in km (got m)"),
    "XML without Z": (
        oem_xml(OEM).replace(b"<Z ", b"<W ").replace(b"</Z>", b"</W>"),
        "x:15: the state vector has no Z",
    ),
    "entity": (HOSTILE, "x:2: declares a document type (DOCTYPE), which is not read; take it out"),
    "not UTF-8": (b"CCSDS_OEM_VERS = 2.0\n\xff", "x:2: is not a text in UTF-8 (byte 0xff)"),
}


@pytest.mark.parametrize(("text", "said"), TLES.values(), ids=TLES)
def test_element_sets(text: str, said: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_tle(text.encode(), "x", None, CENTER)
    assert str(error.value) == said


@pytest.mark.parametrize(("data", "said"), OMMS.values(), ids=OMMS)
def test_mean_element_messages(data: bytes, said: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_omm(data, "x", None, CENTER)
    assert str(error.value) == said


@pytest.mark.parametrize(("data", "said"), OEMS.values(), ids=OEMS)
def test_ephemeris_messages(data: str | bytes, said: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_oem(data.encode() if isinstance(data, str) else data, "x", None, INSIDE)
    assert str(error.value) == said


@pytest.mark.parametrize("center", ["0001-01-01T00:00:00Z", "9999-12-31T23:59:59.9Z"])
def test_apertures_of_any_year_are_refused(center: str) -> None:
    at = instant(center)
    with pytest.raises(PathFileError, match=r"more than a century from the aperture$"):
        read_tle(TLE.encode(), "x", None, at).place(at)
    with pytest.raises(PathFileError, match=r"^x: has no position at "):
        read_oem(OEM.encode(), "x", None, at)


@pytest.mark.parametrize("kind", ["LAGRANGE", "HERMITE"])
def test_samples_of_another_century_give_no_traceback(kind: str) -> None:
    """Differences of times that are rounded, and polynomials that leave every range."""
    rows = OEM.splitlines()
    first = next(n for n, row in enumerate(rows) if row.startswith("2026"))
    rows[first:first] = [f"1972-02-01T00:00:00.{2 * n:03d} {' '.join(rows[first + n].split()[1:])}" for n in range(4)]
    text = "\n".join(rows).replace("START_TIME = 2026", "START_TIME = 1972")
    text = text.replace("META_STOP", "\n".join([*interpolation(kind, 31), "META_STOP"]))
    try:
        orbit = read_oem(text.encode(), "x", None, INSIDE)
        assert all(math.isfinite(one) for one in orbit.place(INSIDE))
    except PathFileError as error:
        assert str(error).startswith("x:")


def test_what_is_too_large_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(messages, "MAX_MARKUP_BYTES", 1_000_000)
    text = "#" * 1_000_001
    for reader in (read_tle, read_omm):
        with pytest.raises(PathFileError, match=r"^x: is larger than 1 MB; keep the objects needed$"):
            reader(text.encode(), "x", None, CENTER)
    with pytest.raises(PathFileError, match=r"^x: is larger than 1 MB; keep the time needed$"):
        read_oem(text.encode(), "x", None, INSIDE)
    monkeypatch.setattr(messages, "_MAX_ELEMENTS_COUNT", 1000)
    for data in (b"<omm>" * 100, b"<omm>" + b"<a/>" * 2000 + b"</omm>"):
        with pytest.raises(PathFileError, match=r"^x:1: has more than 1000 elements, or 32 in each other$"):
            read_omm(data, "x", None, CENTER)
    with pytest.raises(PathFileError, match=r"^x:1: has a text of more than 10000 characters$"):
        read_omm(b"<omm>" + b"a" * 20_000 + b"</omm>", "x", None, CENTER)


GOOD = {
    "tle": (TLE * 2).encode(),
    "xml": omm_xml(),
    "json": omm_json(**CONSTANTS),
    "csv": omm_csv(),
    "oem": oem(interpolation=interpolation("HERMITE", 5)).encode(),
    "oem in xml": oem_xml(oem(count=10, step=120.0, frame="GCRF")),
    "omm in text": omm_text(),
    "eof": (FILES / "S1A_RESORB_20230823_excerpt.EOF").read_bytes(),
    "sp3": (ROOT / "specs" / "missions" / "paths" / "igs15904_g05_g16.sp3").read_bytes()[:4000],
    "sp3 with velocities": low().encode(),
    "finals": (FILES / "finals2000A_excerpt.all").read_bytes(),
}
MIDDLES = {
    "eof": (read_eof, instant("2023-08-23T14:10:00Z")),
    "sp3": (read_sp3, instant("2010-07-01T02:00:00Z")),
    "sp3 with velocities": (read_sp3, INSIDE),
}
TOKENS = [
    b"", b" ", b"\n", b"\r\n", b"0", b"9", b"-", b"+", b".", b"e", b"E99", b"1e308", b"NaN", b"inf", b"=", b",", b'"',
    b"<", b">", b"</", b"&", b"&lt;", b"<!DOCTYPE a>", b"<![CDATA[", b"[", b"]", b"{", b"}", b"null", b"true", b"\0",
    b"\xff", "\u0663".encode(), b"\xef\xbb\xbf", b"META_START", b"META_STOP", b"60", b"1", b"2", b"T", b"Z", b"TEME",
]  # fmt: skip
EDITS = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 30), st.one_of(st.sampled_from(TOKENS), st.binary(max_size=4))),
    min_size=1,
    max_size=6,
)


def edited(good: bytes, edits: list[tuple[float, int, bytes]]) -> bytes:
    for at, length, text in edits:
        start = round(at * len(good))
        good = good[:start] + text + good[start + length :]
    return good


@pytest.mark.parametrize("form", GOOD)
@examples(150, suppress_health_check=[HealthCheck.too_slow])
@given(edits=EDITS, mends=st.booleans(), wanted=st.sampled_from([None, "39634", "CIRCLE"]))
def test_bytes_that_were_changed_give_an_orbit_or_an_error(
    form: str, edits: list[tuple[float, int, bytes]], mends: bool, wanted: str | None
) -> None:
    data = edited(GOOD[form], edits)
    try:
        if form == "tle":
            text = data.decode("utf-8", "replace")
            if mends:
                text = "\n".join(checked(line) if line[:1] in ("1", "2") else line for line in text.split("\n"))
            orbit = read_tle(text.encode(), "x", wanted, CENTER)
        elif form == "finals":
            assert all(math.isfinite(one) for one in read_earth_rotation(data, "x", Instant(57753, 100.0))[2:4])
            return
        elif form in MIDDLES:
            reader, at = MIDDLES[form]
            orbit = reader(data, "x", None if wanted == "39634" else "G05", at)
            assert all(math.isfinite(one) for one in orbit.place(at))
            return
        elif "oem" in form:
            orbit = read_oem(data, "x", wanted, INSIDE)
        else:
            orbit = read_omm(data, "x", wanted, CENTER)
        for at in (CENTER, INSIDE):
            assert all(math.isfinite(one) for one in orbit.place(at))
            assert orbit.words.isprintable()
            assert all(one.isprintable() for one in orbit.doubts(at))
    except PathFileError as error:
        assert str(error).startswith("x:")
        assert str(error).isprintable()


@examples(300)
@given(
    turns=st.floats(1e-6, 19.9),
    eccentricity=st.floats(0, 1, exclude_max=True),
    angles=st.tuples(*[st.floats(0, 180)] * 4),
    drag=st.floats(-1e6, 1e6),
    days=st.floats(-40000, 40000),
)
def test_elements_that_nothing_flies_on_give_an_orbit_or_an_error(
    turns: float, eccentricity: float, angles: tuple[float, ...], drag: float, days: float
) -> None:
    keys = ("INCLINATION", "RA_OF_ASC_NODE", "ARG_OF_PERICENTER", "MEAN_ANOMALY")
    changed = dict(zip(keys, angles, strict=True))
    data = omm_json(MEAN_MOTION=turns, ECCENTRICITY=eccentricity, BSTAR=drag, **changed)
    at = CENTER.after(86400 * days)
    try:
        orbit = read_omm(data, "x", None, at)
        assert all(math.isfinite(one) for one in orbit.place(at))
    except PathFileError as error:
        assert str(error).startswith("x: record 1: ")


# ---------------------------------------------------------------------- files of another format
SHOWN = {  # of each format, as a file shows it
    "tle": [TLE.encode(), f"{LINE_1}\r\n{LINE_2}\r\n".encode()],
    "omm": [omm_xml(), omm_json(), omm_csv(), omm_text(), b"\xef\xbb\xbf" + omm_csv()],
    "oem": [oem().encode(), oem_xml(oem()), b"\n\n" + oem().encode()],
    "eof": [GOOD["eof"]],
    "sp3": [GOOD["sp3"], GOOD["sp3 with velocities"]],
}


@pytest.mark.parametrize("form", SHOWN)
def test_a_format_is_told_by_its_content(form: str) -> None:
    assert [orbit_format(data) for data in SHOWN[form]] == [form] * len(SHOWN[form])
    assert SHOWN.keys() == ORBIT_FORMATS.keys()


def test_what_is_no_orbit_is_none() -> None:
    for data in (b"", b"time [s], x [m], y [m], z [m]\n", b"<gpx/>", b"\x00" * 5000, b"1 2 3\n2 3 4\n"):
        assert orbit_format(data) is None


@pytest.mark.parametrize("asked", SHOWN)
@pytest.mark.parametrize("form", SHOWN)
def test_a_file_of_another_format_is_named_with_the_key_that_reads_it(form: str, asked: str) -> None:
    """An EOF as an OEM was called an element that is not there."""
    data = SHOWN[form][0]
    if form == asked:
        hold_to_format(data, "x", asked)
        return
    with pytest.raises(PathFileError) as error:
        hold_to_format(data, "x", asked)
    assert str(error.value) == f"x: is {ORBIT_FORMATS[form].words}"
    assert error.value.accepted == f"accepted: {ORBIT_FORMATS[asked].words}"
    assert error.value.hint == f"orbit: {{{form}: …}} reads it"


@pytest.mark.parametrize(
    ("data", "said", "hint"),
    [
        (gzip.compress(TLE.encode()), "x: is a compressed file", "Unpack it"),
        (b"     3.05           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE\n", "x: is a RINEX file",
         "A precise orbit comes as SP3"),
        (b"CCSDS_OPM_VERS = 2.0\n", "x: is another message of CCSDS", ""),
        (b"<!DOCTYPE html><html><body>Log in</body></html>", "x: is a page of a web site",
         "Save the file that it links to"),
    ],
)  # fmt: skip
def test_what_is_often_taken_for_an_orbit_is_named(data: bytes, said: str, hint: str) -> None:
    with pytest.raises(PathFileError) as error:
        hold_to_format(data, "x", "oem")
    assert (str(error.value), error.value.hint) == (said, hint)


LOGS = [*every_format(flight()).values(), ("csv", geodetic_csv(flight()), {})]


@pytest.mark.parametrize(("form", "data", "_"), LOGS)
def test_a_log_where_an_orbit_is_asked_for_is_named(form: str, data: bytes, _: object) -> None:
    with pytest.raises(PathFileError) as error:
        hold_to_format(data, "x", "oem")
    assert str(error.value) == f"x: is {LOG_FORMATS[form].words}"
    assert error.value.hint == "trajectory.file reads it"
    hold_to_log(data, "x")


@pytest.mark.parametrize("form", SHOWN)
def test_an_orbit_where_a_log_is_asked_for_is_named(form: str) -> None:
    with pytest.raises(PathFileError) as error:
        hold_to_log(SHOWN[form][0], "x")
    assert str(error.value) == f"x: is {ORBIT_FORMATS[form].words}"
    assert error.value.accepted.startswith("accepted: a log of a flight, CSV with a header (csv), an SBET of records")
    assert error.value.hint == f"orbit: {{{form}: …}} reads it"
