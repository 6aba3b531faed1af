"""Tracks of GPX."""

import math
import re
from datetime import UTC, datetime

import numpy as np
import pytest

from bisar_budget.paths.flight import Log, PathFileError, track_around
from bisar_budget.paths.gpx import read_gpx
from bisar_budget.paths.instant import parse_instant
from bisar_budget.paths.log_places import LogKeys
from tests.paths.flown import flight, stamp
from tests.paths.log_files import METRES_A_DEGREE, SEPARATION, gpx

FLOWN = flight()
SHORT = flight(6)
# Half of 1e-9 deg of 111 km a degree in two coordinates, of 0.1 mm of an elevation.
DIGITS = math.hypot(0.5e-9 * METRES_A_DEGREE * math.sqrt(2), 0.5e-4)


def read(data: bytes, **keys: object) -> Log:
    return read_gpx(data, "a.gpx", LogKeys(**keys))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("data", "keys", "words"),
    [
        (gpx(FLOWN), {}, "GPX track"),
        (gpx(FLOWN, 3), {}, "GPX track of 3 segments"),
        (gpx(FLOWN, prefix="g"), {}, "GPX track"),
        (gpx(FLOWN, has_separation=False), {"geoid_separation": SEPARATION}, "GPX track"),
        (gpx(FLOWN, zone=""), {"time_scale": "utc"}, "GPX track"),
        (gpx(FLOWN, zone="+00:00"), {}, "GPX track"),
        (gpx(FLOWN).decode().encode("utf-16"), {}, "GPX track"),
        (gpx(FLOWN).replace(b"<trkseg>", b"<extensions><x:time>1</x:time></extensions><trkseg>"), {}, "GPX track"),
    ],
)
def test_the_flight_is_where_it_was(data: bytes, keys: dict[str, object], words: str) -> None:
    if data[:2] == b"\xff\xfe":
        data = data.decode("utf-16").replace("UTF-8", "UTF-16").encode("utf-16")
    log = read(data.replace(b"<gpx ", b'<gpx xmlns:x="urn:x" '), **keys)
    assert np.abs(log.places - FLOWN.places).max() < DIGITS
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)  # microseconds
    begins = parse_instant(stamp(0))
    assert begins is not None
    assert log.start is not None
    assert log.start.since(begins) == pytest.approx(0, abs=1e-9)
    assert log.words == f"{words}, 501 fixes over 10 s"


def test_a_file_of_another_writer_is_the_same() -> None:
    gpxpy = pytest.importorskip("gpxpy")
    written = gpxpy.parse(gpx(SHORT).decode()).to_xml().encode()
    assert written != gpx(SHORT)
    by_other, own = read(written), read(gpx(SHORT))
    assert by_other.start == own.start
    assert by_other.times == pytest.approx(own.times, abs=1e-9)
    assert np.abs(by_other.places - own.places).max() < 1e-9


def test_an_offset_is_taken_off_across_midnight() -> None:
    start = datetime(2026, 2, 28, 23, 59, 55, tzinfo=UTC)
    for zone, begins in (
        ("+05:30", "2026-02-28T18:29:55.000Z"),
        ("+0530", "2026-02-28T18:29:55.000Z"),
        ("-01:00", "2026-03-01T00:59:55.000Z"),
        ("-0100", "2026-03-01T00:59:55.000Z"),
        ("-01", "2026-03-01T00:59:55.000Z"),
    ):
        log = read(gpx(FLOWN, start=start, zone=zone))
        assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
        assert log.start is not None
        assert log.start.as_text() == begins


GOOD = gpx(SHORT).decode()
TRACK = GOOD[GOOD.index("<trk>") : GOOD.index("</gpx>")]
FIRST = GOOD.splitlines()[4]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "a.gpx:1: is not XML: no element found"),
        ("<tcx/>", "a.gpx:1: is no GPX, its root is tcx"),
        (GOOD.replace(TRACK, ""), "a.gpx: has no track with points"),
        (GOOD[:-60], "a.gpx:"),
        (
            GOOD.replace("<time>2026", "<time>x026", 1),
            "a.gpx:5: time must be an instant like 2026-06-01T05:20:01.250Z",
        ),
        (GOOD.replace("Z</time>", "</time>", 1), "a.gpx:5: time must be an instant like 2026-06-01T05:20:01.250Z"),
        (GOOD.replace("<time>", "<when>").replace("</time>", "</when>"), "a.gpx:5: the point has no time"),
        (GOOD.replace("<ele>2953.1000</ele>", "", 1), "a.gpx:5: the point has no ele"),
        (GOOD.replace("<ele>2953.1000", "<ele>1e9999", 1), "a.gpx:5: ele must be a number of metres (got '1e9999')"),
        (GOOD.replace('lat="', 'lat="x', 1), "a.gpx:5: lat must be a number of degrees (got 'x48."),
        (GOOD.replace('lat="48', 'lat="148', 1), "a.gpx:5: latitude 148."),
        (GOOD.replace(' lon="', ' lom="', 1), "a.gpx:5: lon must be a number of degrees (got '')"),
        (GOOD.replace("<geoidheight>46.9000</geoidheight>", "", 1), "a.gpx:5: the point has no geoidheight, others"),
        (
            GOOD.replace("</trkseg>", f"</trkseg><trkseg>{FIRST}</trkseg>"),
            "a.gpx:11: time 2026-06-01T05:20:01.250Z is",
        ),
        (
            '<!DOCTYPE gpx [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>\n<gpx><trk>&b;</trk></gpx>',
            "a.gpx:1: declares a document type (DOCTYPE), which is not read; take it out",
        ),
        ("<gpx>" + "<trk>" * 50, "a.gpx:1: has more than 2000000 elements, or 32 in each other"),
    ],
)
def test_faults_have_lines(text: str, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(text.encode())
    assert str(error.value).startswith(says)


class TestSeveralTracks:
    FILE = GOOD.replace(TRACK, TRACK.replace("<name>a<", "<name>Morning<") + TRACK.replace("05:20", "06:20")).encode()
    MIDDLE = parse_instant("2026-06-01T05:20:01.300Z")

    def test_the_one_that_covers_the_aperture_is_taken(self) -> None:
        log = track_around(read(self.FILE), self.MIDDLE, None, 0.05, "a.gpx")
        assert np.abs(log.places - SHORT.places).max() < DIGITS
        assert log.words == "GPX track 1 of 2 (Morning), 6 fixes over 0.1 s"
        later = parse_instant("2026-06-01T06:20:01.300Z")
        assert track_around(read(self.FILE), later, None, 0.05, "a.gpx").words.startswith("GPX track 2 of 2 (a), 6")

    def test_where_none_or_both_do_they_are_refused(self) -> None:
        neither = parse_instant("2026-06-01T05:50:00Z")
        with pytest.raises(PathFileError, match=r"^a\.gpx: has 2 tracks, and none covers the aperture; covers 2026-"):
            track_around(read(self.FILE), neither, None, 0.05, "a.gpx")
        both = read(GOOD.replace(TRACK, TRACK * 2).encode())
        with pytest.raises(
            PathFileError, match=r"^a\.gpx: has 2 tracks that cover the aperture: GPX track 1 of 2"
        ) as error:
            track_around(both, self.MIDDLE, None, 0.05, "a.gpx")
        assert error.value.accepted == "accepted: trajectory.track: the name or the number of one"

    @pytest.mark.parametrize(("track", "number"), [("Morning", 1), ("1", 1), ("a", 2), ("2", 2)])
    def test_a_key_chooses(self, track: str, number: int) -> None:
        log = read(self.FILE, track=track)
        assert log.tracks == ()
        assert log.words.startswith(f"GPX track {number} of 2")

    @pytest.mark.parametrize("track", ["b", "0", "3", "9" * 30])
    def test_another_one_is_refused(self, track: str) -> None:
        with pytest.raises(
            PathFileError, match=r"no track of that name or number; it has 1 of 2 \(Morning\), 2"
        ) as error:
            read(self.FILE, track=track)
        assert error.value.key == "track"
        with pytest.raises(PathFileError, match=r"has 2 tracks of that name: .*; choose by number"):
            read(GOOD.replace(TRACK, TRACK * 2).encode(), track="a")

    def test_a_track_without_times_is_no_flight(self) -> None:
        planned = "".join(line for line in TRACK.splitlines(keepends=True))
        planned = re.sub("<time>.*?</time>", "", planned)
        log = read(GOOD.replace(TRACK, planned + TRACK).encode())
        assert log.tracks == ()
        assert log.words.startswith("GPX track 2 of 2 (a)")


def test_stamps_without_fractions_are_said_to_be_cut() -> None:
    text = re.sub(r"\.\d+Z</time>", "Z</time>", gpx(FLOWN).decode())
    with pytest.raises(PathFileError) as error:
        read(text.encode())
    assert str(error.value).startswith(
        "a.gpx:6: time 2026-06-01T05:20:01.000Z is not after 2026-06-01T05:20:01.000Z of line 5; times must rise; "
        "all stamps are whole seconds, and 46 fixes have the same: the recorder has cut the fractions of seconds"
    )


def test_a_second_60_is_a_rounded_one() -> None:
    start = datetime(2026, 6, 1, 5, 20, 0, tzinfo=UTC)
    text = gpx(FLOWN, start=start).decode()
    rounded = text.replace("T05:20:00.000000Z", "T05:19:60.000Z")
    assert rounded != text
    assert read(rounded.encode()).start == read(text.encode()).start


def test_elevations_need_the_separation_of_the_geoid() -> None:
    with pytest.raises(PathFileError, match=r"^a\.gpx: has heights above mean sea level, and no geoid separation$"):
        read(gpx(SHORT, has_separation=False))
    with pytest.raises(PathFileError, match=r"gives the geoid separation itself"):
        read(gpx(SHORT), geoid_separation=SEPARATION)
    with pytest.raises(PathFileError) as error:
        read(gpx(SHORT, zone=""))
    assert error.value.hint == "trajectory.time_scale: utc reads times without a zone"
    with pytest.raises(PathFileError, match=r"counts in UTC, and trajectory.time_scale says GPST"):
        read(gpx(SHORT), time_scale="gps")


class TestFix:
    @staticmethod
    def of(fix: str, count: int) -> Log:
        """A track of which points state a fix."""
        text = gpx(FLOWN).decode().replace("</trkpt>", f"<fix>{fix}</fix></trkpt>", count)
        return read(text.encode())

    @pytest.mark.parametrize("fix", ["none", "2d"])
    def test_a_point_without_a_height_is_left_out(self, fix: str) -> None:
        log = self.of(fix, 100)
        assert log.words == "GPX track, 100 points without a fix in three dimensions left out, 401 fixes over 8 s"
        with pytest.raises(PathFileError, match="has no point with a fix in three dimensions"):
            self.of(fix, 501)

    @pytest.mark.parametrize("fix", ["3d", "dgps", "pps"])
    def test_others_are_flown(self, fix: str) -> None:
        assert len(self.of(fix, 501).times) == 501
