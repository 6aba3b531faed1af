"""Logs of NMEA 0183."""

import math
import sys
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from bisar_budget.paths.earth import Geodetic, earth_fixed
from bisar_budget.paths.flight import Log, PathFileError, dated, slow_times
from bisar_budget.paths.instant import parse_instant
from bisar_budget.paths.log_places import LogKeys
from bisar_budget.paths.nmea import read_nmea
from tests.paths.flown import flight, stamp
from tests.paths.log_files import METRES_A_DEGREE, SEPARATION, gga, gns, gst, nmea, rmc, sentence, zda

pynmea2 = pytest.importorskip("pynmea2")

FLOWN = flight()
SHORT = flight(6)
# Half of 1e-7 minutes of 111 km a degree in two coordinates, of 0.1 mm of a height and of its separation.
DIGITS = math.hypot(0.5e-7 / 60 * METRES_A_DEGREE * math.sqrt(2), 1e-4)


def read(data: bytes | str, **keys: object) -> Log:
    return read_nmea(data if isinstance(data, bytes) else data.encode("latin-1"), "a.nmea", LogKeys(**keys))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (nmea(FLOWN), "NMEA 0183 GGA, 501 fixes over 10 s"),
        (nmea(FLOWN, date=zda), "NMEA 0183 GGA, 501 fixes over 10 s"),
        (nmea(FLOWN, gns), "NMEA 0183 GNS, 501 fixes over 10 s"),
        (nmea(FLOWN).replace(b"\r\n", b"\n"), "NMEA 0183 GGA, 501 fixes over 10 s"),
        (
            b"\xb5\x62\x01\x07\n" + nmea(FLOWN).replace(b"$GNGGA", b"12.5 $GNGGA"),
            "NMEA 0183 GGA, 501 fixes over 10 s",
        ),
    ],
)
def test_the_flight_is_where_it_was(data: bytes, words: str) -> None:
    log = read(data)
    assert np.abs(log.places - FLOWN.places).max() < DIGITS
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)  # microseconds
    begins = parse_instant(stamp(0))
    assert begins is not None
    assert log.start is not None
    assert log.start.since(begins) == pytest.approx(0, abs=1e-9)
    assert log.words == words


def test_sentences_are_those_of_another_reader() -> None:
    """pynmea2 reads the same degrees of the writer of these tests."""
    for line in nmea(SHORT).decode().splitlines()[::3]:
        found = pynmea2.parse(line, check=True)
        at = int(found.timestamp.second == 1)
        assert found.latitude == pytest.approx(math.degrees(SHORT.latitude[0]), abs=1e-4)
        assert found.altitude + float(found.geo_sep) == pytest.approx(3000)
        assert at == 1


REAL = """gnss_cnav  2014-12-11T00:00:01.0020Z  $GNZDA,000001.00,11,12,2014,00,00*7D
gnss_cnav  2014-12-11T00:00:01.0811Z  $GNRMC,000001.00,A,2304.167961,N,16553.836924,W,7.87,100.6,111214,0,E,D*17
gnss_cnav  2014-12-11T00:00:01.1630Z  $PNCTR,NAVQ,000001.00,3D,SBAS,DUAL*38
gnss_cnav  2014-12-11T00:00:01.2517Z  $GNGGA,000001.00,2304.167961,N,16553.836924,W,2,11,1.0,44.542,M,0.000,M,2.0,0103*43
"""  # noqa: E501


def test_sentences_of_a_real_receiver() -> None:
    """A C-Nav3050 aboard a ship, as the read-me of its data shows them, behind a stamp of the logger."""
    log = read(REAL)
    place = Geodetic(math.radians(23 + 4.167961 / 60), -math.radians(165 + 53.836924 / 60), 44.542)
    assert log.places[0] == pytest.approx(earth_fixed(place), abs=1e-8)
    assert log.start is not None
    assert log.start.as_text() == "2014-12-11T00:00:01.000Z"


@pytest.mark.parametrize("date", [rmc, zda])
def test_midnight_is_a_moment_like_others(date) -> None:
    """Half of the flight is on the next day, and the date of a sentence comes behind its place."""
    start = datetime(2026, 12, 31, 23, 59, 55, tzinfo=UTC)
    log = read(nmea(FLOWN, date=date, start=start))
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
    assert log.start is not None
    assert log.start.as_text() == "2026-12-31T23:59:55.000Z"
    once = nmea(FLOWN, date=date, start=start).decode().splitlines()
    log = read("\n".join(once[3:6] + [line for line in once[6:] if "GGA" in line]))  # dated once, then never again
    assert log.times == pytest.approx(FLOWN.times[1:] - FLOWN.times[1], abs=1e-9)


def _places(longitude=None):
    degrees = np.degrees(FLOWN.longitude if longitude is None else longitude)
    return zip(FLOWN.times, np.degrees(FLOWN.latitude), degrees, FLOWN.height, strict=True)


class TestTwoReceivers:
    """Of two talkers the one with more fixes may be the worse one: the mission file chooses."""

    MIXED = "\n".join(
        [rmc(0)]
        + [
            line
            for n, (time, north, east, up) in enumerate(_places())
            for line in ([gga(time, north, east, up)] if n % 2 else [])
            + [gga(time, north + 0.1, east, up, talker="GP", quality=1)]
        ]
    )

    def test_they_are_refused(self) -> None:
        with pytest.raises(PathFileError) as error:
            read(self.MIXED)
        assert str(error.value) == (
            "a.nmea: has fixes of 2 talkers: GN (250 of GGA quality 4, RTK fixed) and GP (501 of GGA quality 1, "
            "autonomous); they may be those of several receivers"
        )
        assert (error.value.accepted, error.value.hint) == (
            "accepted: one talker",
            "trajectory.talker: GN or GP chooses one",
        )

    def test_a_key_chooses(self) -> None:
        log = read(self.MIXED, talker="GN")
        assert np.abs(log.places - FLOWN.places[1::2]).max() < DIGITS
        assert log.words == "NMEA 0183 GGA of the talker GN, 250 fixes over 9.96 s"
        assert log.typical_sigmas == pytest.approx(np.full(250, 0.01))
        assert len(read(self.MIXED, talker="GP").times) == 501
        with pytest.raises(
            PathFileError, match=r"has no fix of the talker GL; it has fixes of GN .* and GP "
        ) as error:
            read(self.MIXED, talker="GL")
        assert error.value.key == "talker"

    def test_a_receiver_that_changes_its_name_is_not_known_to_be_one(self) -> None:
        changing = [gga(*one, talker="GP" if n % 100 < 30 else "GN") for n, one in enumerate(_places())]
        with pytest.raises(PathFileError, match=r"has fixes of 2 talkers"):
            read("\n".join([rmc(0), *changing]))

    def test_a_talker_without_places_is_no_second_receiver(self) -> None:
        """Satellites in view, a date, and a fix in two dimensions without a height that counts for none."""
        others = [rmc(0, talker="GP"), sentence("GPGSV,1,1,00"), sentence("GLGSA,A,3,,,,,,,,,,,,,1,1,1")]
        empty = sentence("GPGGA,,,,,,0,,,,,,,,")
        log = read("\n".join([*others, empty, *(gga(*fix) for fix in _places())]))
        assert log.words == "NMEA 0183 GGA, 501 fixes over 10 s"


class TestTwoSolutionsOfOneTalker:
    """GGA and GNS of a receiver are one solution; a log may have those of two, under the same name."""

    @staticmethod
    def both(north_m: float = 0.0, late_s: float = 0.0, quality: int = 4, modes: str = "RR") -> Log:
        lines = [rmc(0)]
        for time, latitude, longitude, above in _places():
            lines += [gga(time, latitude, longitude, above, quality=quality)]
            lines += [gns(time + late_s, latitude + north_m / METRES_A_DEGREE, longitude, above, modes=modes)]
        return read("\n".join(lines))

    @pytest.mark.parametrize("north_m", [0.0, 0.3])
    def test_the_same_places_are_read(self, north_m: float) -> None:
        log = self.both(north_m)
        assert log.words == "NMEA 0183 GGA, 501 fixes over 10 s"
        assert log.typical_sigmas == pytest.approx(np.full(501, 0.01))

    @pytest.mark.parametrize(
        ("quality", "modes", "worse"),
        [(4, "RA", "GNS mode A, autonomous"), (1, "RR", "GGA quality 1, autonomous")],
    )
    def test_the_worse_quality_counts(self, quality: int, modes: str, worse: str) -> None:
        log = self.both(quality=quality, modes=modes)
        assert log.typical_sigmas == pytest.approx(np.full(501, 3.0))
        assert log.quality_words(7) == worse

    @pytest.mark.parametrize(
        ("north_m", "late_s", "says"),
        [(11.0, 0.0, "up to 11 m apart at the same time"), (0.0, 0.01, "at times of their own")],
    )
    def test_other_places_are_refused(self, north_m: float, late_s: float, says: str) -> None:
        with pytest.raises(PathFileError, match=rf"GGA and GNS of the talker GN are {says}") as error:
            self.both(north_m, late_s, modes="AA")
        assert error.value.hint == (
            "Leave out the sentences of one solution: 501 of GGA quality 4, RTK fixed, 501 of GNS mode A, autonomous"
        )

    def test_gns_once_a_second_is_enough(self) -> None:
        """Some fixes have both sentences, most have one."""
        lines = [rmc(0)]
        for number, place in enumerate(_places()):
            lines += [gga(*place), *([gns(*place)] if number % 50 == 0 else [])]
        assert len(read("\n".join(lines)).times) == 501


def test_wrong_checksums_are_left_out_and_counted() -> None:
    lines = nmea(FLOWN).decode().splitlines()
    lines[300] = lines[300].replace(",N,", ",S,")
    lines[303] = lines[303].rpartition("*")[0]
    lines[306] = lines[306][:30]
    log = read("\n".join(lines))
    assert len(log.times) == 498
    assert log.words == "NMEA 0183 GGA, 3 sentences with a wrong checksum left out, 498 fixes over 10 s"


@pytest.mark.parametrize("quality", [0, 7, 8])
def test_without_a_fix_there_is_no_place(quality: int) -> None:
    lines = nmea(SHORT).decode().splitlines()
    lines[0] = gga(0.0, 0.0, 0.0, 0.0, quality=quality)
    assert len(read("\n".join(lines)).times) == 5
    empty = [sentence("GNGGA,,,,,,0,,,,,,,,"), sentence("GNRMC,,V,,,,,,,,,,N"), sentence("GPZDA,,,,,,")]
    assert len(read("\n".join([*empty, *lines])).times) == 5


def test_a_separation_may_be_given_where_the_log_has_none() -> None:
    data = nmea(SHORT, separation="")
    assert np.abs(read(data, geoid_separation=SEPARATION).places - SHORT.places).max() < DIGITS
    with pytest.raises(PathFileError, match=r"heights above mean sea level, and no geoid separation"):
        read(data)
    with pytest.raises(PathFileError, match=r"gives the geoid separation itself") as error:
        read(nmea(SHORT), geoid_separation=SEPARATION)
    assert error.value.key == "geoid_separation"


GOOD = nmea(SHORT).decode().splitlines()


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ([], "a.nmea: has no sentence GGA or GNS with a fix"),
        (GOOD[2::3], "a.nmea: has no sentence GGA or GNS with a fix"),
        (
            [*GOOD, GOOD[0]],
            "a.nmea:19: time 2026-06-01T05:20:01.250Z is not after 2026-06-01T05:20:01.350Z of line 16",
        ),
        (
            [sentence("GPGGA,052060.25,4805.0,N,01116.0,E,1,12,0.7,1.0,M,1.0,M,,")],
            "a.nmea:1: GGA must have a time like 052001.25 (got '052060.25')",
        ),
        (
            [sentence("GPGGA,052000.00,4865.0,N,01116.0,E,1,12,0.7,1.0,M,1.0,M,,")],
            "a.nmea:1: GGA must have degrees and minutes like 4805.196, and N or S (got '4865.0,N')",
        ),
        (
            [sentence("GPGGA,052000.00,4805.0,N,01116.0,,1,12,0.7,1.0,M,1.0,M,,")],
            "a.nmea:1: GGA must have degrees and minutes like 4805.196, and E or W (got '01116.0,')",
        ),
        (
            [sentence("GPGGA,052000.00,4805.0,N,01116.0,E,1,12,0.7,1.0,F,1.0,M,,")],
            "a.nmea:1: GGA must have a height and a geoid separation in M (got '1.0,F')",
        ),
        (
            [sentence("GPRMC,052000.00,A,4805.0,N,01116.0,E,0,0,310226,,,A")],
            "a.nmea:1: RMC must have a date that there is (got '310226')",
        ),
        (
            [sentence("GPRMC,052000.00,A,4805.0,N,01116.0,E,0,0,1626,,,A")],
            "a.nmea:1: RMC must have a date like 010626 (got '1626')",
        ),
        (
            [GOOD[2], gga(0, 48, 11, 3000), gga(1, 48, 11, 3000, separation="")],
            "a.nmea:3: GGA has no geoid separation, others have one",
        ),
        ([GOOD[2], gga(0, 48, 11, 200e3)], "a.nmea:2: height 200000 m is beyond -12 … 100 km"),
    ],
)
def test_faults_have_lines(lines: list[str], says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read("\n".join(lines))
    assert str(error.value).startswith(says)


def test_years_have_two_digits_and_the_century_of_gps() -> None:
    log = read("\n".join([sentence("GPRMC,052000.00,A,4805.0,N,01116.0,E,0,0,010680,,,A"), gga(0, 48, 11, 3000)]))
    assert log.start is not None
    assert log.start.as_text().startswith("1980-06-01")


def test_without_the_package_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pynmea2", None)
    with pytest.raises(PathFileError, match=r"^a\.nmea: needs the package pynmea2: pip install pynmea2$"):
        read(nmea(SHORT))


def test_a_void_sentence_dates_nothing() -> None:
    """A receiver that lost its fix sends RMC with V, and a date that its clock has made up."""
    lines = [rmc(0), gga(0, 48, 11, 3000), rmc(1), gga(1, 48, 11, 3000)]
    fields = lines[2].strip().strip("$").partition("*")[0].split(",")
    fields[2], fields[9] = "V", "060180"
    lines[2] = sentence(",".join(fields))
    log = read("\n".join(lines))
    assert log.times[1] - log.times[0] == pytest.approx(1, abs=1e-6)


class TestWithoutADate:
    def test_the_middle_of_the_aperture_dates_the_log(self) -> None:
        undated = read("\n".join(gga(*fix) for fix in _places()))
        center = parse_instant("2026-06-01T05:20:05Z")
        assert undated.start is None
        assert undated.clock == "day"
        log = dated(undated, center)
        assert log.start is not None
        assert log.start.as_text() == "2026-06-01T00:00:00.000Z"
        assert log.words == "NMEA 0183 GGA, 501 fixes over 10 s, date by collection.center_time: 2026-06-01"
        begins = parse_instant(stamp(0))
        assert slow_times(log, begins, None, 0.01, "a.nmea") == pytest.approx(FLOWN.times, abs=1e-6)
        assert np.abs(log.places - FLOWN.places).max() < DIGITS

    @pytest.mark.parametrize("begins", ["2026-06-01T23:59:55", "2026-06-02T00:00:00", "2026-06-01T23:59:49.5"])
    def test_it_takes_the_nearest_midnight(self, begins: str) -> None:
        """A flight over midnight, or beside it, whose middle is on either side of it."""
        start = datetime.fromisoformat(begins).replace(tzinfo=UTC)
        undated = read("\n".join(gga(*fix, start=start) for fix in _places()))
        for second in (1, 5, 9):
            center = parse_instant(f"{start + timedelta(seconds=second):%Y-%m-%dT%H:%M:%S.%f}Z")
            slow = slow_times(dated(undated, center), center, None, 1.0, "a.nmea")
            assert slow == pytest.approx(FLOWN.times - second, abs=1e-6)

    def test_without_one_it_is_refused(self) -> None:
        undated = read("\n".join(gga(*fix) for fix in _places()))
        with pytest.raises(PathFileError) as error:
            slow_times(dated(undated, None), None, None, 1.0, "a.nmea")
        assert str(error.value) == "a.nmea: has times of day and no date"
        assert error.value.accepted == (
            "accepted: collection.center_time, of which the nearest midnight dates the log"
        )

    def test_a_date_that_is_none_is_left_out_and_counted(self) -> None:
        none = [rmc(0).partition("*")[0].strip("$").replace("010626", date) for date in ("000000", "310226", "1626")]
        log = read("\n".join([*map(sentence, none), nmea(FLOWN).decode()]))
        assert log.start is not None
        assert log.start.as_text() == "2026-06-01T05:20:01.250Z"
        assert log.words == "NMEA 0183 GGA, 3 sentences without a date that there is left out, 501 fixes over 10 s"


@pytest.mark.parametrize(("clock", "seconds"), [("051960.00", 1200), ("235960", 0), ("051959.996", 1199.996)])
@pytest.mark.parametrize("kind", ["GGA", "RMC", "ZDA"])
def test_a_second_60_is_a_rounded_one(clock: str, seconds: float, kind: str) -> None:
    """59.996 s with two digits; the date is that before it is rounded."""
    by_kind = {
        "GGA": sentence(f"GNGGA,{clock},4805.0,N,01116.0,E,4,12,0.7,1.0,M,1.0,M,,"),
        "RMC": sentence(f"GNRMC,{clock},A,4805.0,N,01116.0,E,0,0,010626,,,A"),
        "ZDA": sentence(f"GNZDA,{clock},01,06,2026,00,00"),
    }
    fix = by_kind["GGA"] if kind == "GGA" else sentence("GNGGA,052001.00,4805.0,N,01116.0,E,4,12,0.7,1.0,M,1.0,M,,")
    log = read("\n".join([by_kind["RMC" if kind == "GGA" else kind], fix]))
    assert log.start is not None
    if kind == "GGA":
        assert log.start.seconds == pytest.approx((5 * 3600 + seconds) % 86400 if seconds else 86400)
    elif clock != "235960":
        assert log.start.as_text() == "2026-06-01T05:20:01.000Z"


class TestADatum:
    USER = sentence("GPDTM,999,,0.08,N,0.07,E,-47.7,W84")

    @pytest.mark.parametrize(
        "datum", ["W84,,0.0,N,0.0,E,0.0,W84", "W84,,,,,,,W84", "W84,,0,N,0,E,0,", ",,,,,,,", ",,0.0,N,0.0,E,0.0,W84"]
    )
    def test_wgs84_is_read(self, datum: str) -> None:
        assert len(read(sentence(f"GPDTM,{datum}") + "\n" + nmea(SHORT).decode()).times) == 6

    @pytest.mark.parametrize(
        ("datum", "words"),
        [
            ("999,,0.08,N,0.07,E,-47.7,W84", "a user datum (999), 0.08' N, 0.07' E and -47.7 m off W84"),
            ("W84,,0.08,N,0.0,E,0.0,W84", "WGS-84 with offsets, 0.08' N, 0.0' E and 0.0 m off W84"),
            ("P90,,0.001,S,0,W,1,W84", "the datum P90, 0.001' S, 0' W and 1 m off W84"),
            (",,0.08,N,0.07,E,-47.7,W84", "a datum without a code, 0.08' N, 0.07' E and -47.7 m off W84"),
            (",,,,,,,W72", "a datum without a code, 0', 0' and 0 m off W72"),
            ("W84,,0.0,N,0.0,E,0.0,W72", "the datum W84, 0.0' N, 0.0' E and 0.0 m off W72"),
        ],
    )
    def test_another_one_is_refused_by_its_name(self, datum: str, words: str) -> None:
        with pytest.raises(PathFileError) as error:
            read(nmea(SHORT).decode() + sentence(f"GPDTM,{datum}"))
        assert str(error.value) == f"a.nmea:19: DTM says that the positions are of {words}"

    @pytest.mark.parametrize("ending", ["*00", "", "*"])
    def test_its_checksum_excuses_no_other_datum(self, ending: str) -> None:
        """Left out like other broken sentences it would make its places those of WGS-84."""
        broken = self.USER.partition("*")[0] + ending
        fixes = nmea(SHORT).decode()
        with pytest.raises(PathFileError, match=r"a\.nmea:1: DTM with a wrong checksum or none says .*\(999\)"):
            read(broken + "\n" + fixes)
        sound = sentence("GPDTM,W84,,0.0,N,0.0,E,0.0,W84")
        for neighbour in (sound.partition("*")[0] + ending, f"{broken}\n{sound}"):
            log = read(neighbour + "\n" + fixes)
            assert len(log.times) == 6
            assert "1 sentence with a wrong checksum left out" in log.words

    def test_that_of_a_receiver_that_is_not_chosen_does_not_count(self) -> None:
        lines = "\n".join([self.USER, *TestTwoReceivers.MIXED.splitlines()])
        assert len(read(lines, talker="GN").times) == 250
        with pytest.raises(PathFileError, match=r"a\.nmea:1: DTM says"):
            read(lines, talker="GP")


class TestALogSaysItsAccuracy:
    def test_gst_states_sigmas_of_latitude_longitude_height(self) -> None:
        lines = [rmc(0)]
        for number, fix in enumerate(_places()):
            lines.append(gga(*fix))
            if number % 10 == 0:  # 5 Hz of 50 Hz
                lines.append(gst(fix[0], 0.02 + fix[0] / 1e3, 0.01, 0.05))
        log = read("\n".join(lines))
        assert log.sigmas is not None
        assert log.sigmas[0] == pytest.approx([0.02, 0.01, 0.05])
        assert log.sigmas[250] == pytest.approx([0.025, 0.01, 0.05])
        # Between two of them the larger one counts.
        assert log.sigmas[251] == pytest.approx([0.0252, 0.01, 0.05])

    def test_a_fix_without_gst_near_it_has_none(self) -> None:
        lines = [rmc(0), gst(0, 0.02, 0.01, 0.05), *(gga(*fix) for fix in _places())]
        log = read("\n".join(lines))
        assert log.sigmas is not None
        assert np.isfinite(log.sigmas[: 5 * 50 + 1]).all()
        assert np.isnan(log.sigmas[5 * 50 + 1 :]).all()

    @pytest.mark.parametrize("fields", [",,,,,,", "9.9,,,,0,0,0", "9.9,0,0,0,,,", "9.9,,,,-1,,0"])
    def test_a_gst_that_states_nothing_is_none(self, fields: str) -> None:
        lines = [rmc(0), gga(0, 48, 11, 3000), sentence(f"GNGST,052001.25,{fields}")]
        assert read("\n".join(lines)).sigmas is None

    @pytest.mark.parametrize(
        ("fields", "east", "north", "up"),
        [
            ("9.9,0.9,0.9,0,0.9,0.8,", 0.8, 0.9, math.nan),
            ("9.9,,,,0.9,,0.7", math.nan, 0.9, 0.7),
            ("9.9,,,,.900,.800,.700", 0.8, 0.9, 0.7),
            ("9.9,,,,9e-1,8e-1,7e-1", 0.8, 0.9, 0.7),
            ("9.9,,,,0.9000000000000,0.8000000000000,0.7000000000000", 0.8, 0.9, 0.7),
            ("9.9,0.9,0.5,0,,,", 0.9, 0.9, math.nan),
            ("9.9,0.9,0.5,0,0.6,,0.7", 0.9, 0.9, 0.7),
            ("9.9,3.0,0.5,0,0.6,0.5,0.7", 3.0, 3.0, 0.7),
            ("9.9,0.75,0.5,0,0.6,0.5,0.7", 0.5, 0.6, 0.7),  # as large as both together
        ],
    )
    def test_what_a_gst_states_counts_without_the_rest(
        self, fields: str, east: float, north: float, up: float
    ) -> None:
        log = read("\n".join([rmc(0), gga(0, 48, 11, 3000), sentence(f"GNGST,052001.25,{fields}")]))
        assert log.sigmas == pytest.approx(np.array([[east, north, up]]), nan_ok=True)
        assert "figure" not in log.words

    def test_figures_of_gst_that_cannot_be_used_are_counted(self) -> None:
        lines = [rmc(0), gga(0, 48, 11, 3000)]
        gsts = ["052001.25,,,,,x,-1,0.02", "052001.25,,,,,bad,,", "noon,,,,,1,1,1"]
        log = read("\n".join([*lines, *(sentence(f"GNGST,{one}") for one in gsts)]))
        assert log.sigmas == pytest.approx(np.array([[math.nan, math.nan, 0.02]]), nan_ok=True)
        assert "4 figures of accuracy that cannot be used left out" in log.words

    @pytest.mark.parametrize("is_own", [True, False])
    def test_the_gst_of_the_talker_of_the_fixes_counts(self, is_own: bool) -> None:
        """Those of another receiver do not speak for it, where it has its own."""
        lines = [rmc(0), gga(0, 48, 11, 3000), gst(0, 3, 2, 5, talker="GP")]
        lines += [gst(0, 0.02, 0.01, 0.05)] if is_own else []
        log = read("\n".join(lines))
        assert log.sigmas is not None
        assert log.sigmas[0] == pytest.approx([0.02, 0.01, 0.05] if is_own else [3, 2, 5])

    @pytest.mark.parametrize("has_fixes", [True, False])
    def test_the_gst_of_another_receiver_vouches_for_nothing(self, has_fixes: bool) -> None:
        """A talker that has fixes of its own states the errors of those; one without is another name."""
        lines = [rmc(0), gga(0, 48, 11, 3000, quality=1), gst(0, 0.01, 0.01, 0.02, talker="GP")]
        lines += [gga(0, 48, 11, 3000, talker="GP")] if has_fixes else []
        log = read("\n".join(lines), talker="GN")
        assert (log.sigmas is None) == has_fixes
        assert log.typical_sigmas == pytest.approx([3])

    @pytest.mark.parametrize(
        ("quality", "sigma_m", "words"),
        [
            (1, 3, "GGA quality 1, autonomous"),
            (2, 1, "GGA quality 2, differential"),
            (5, 0.3, "GGA quality 5, RTK float"),
            (4, 0.01, "GGA quality 4, RTK fixed"),
            (6, 3, "GGA quality 6, dead reckoning"),
        ],
    )
    def test_a_quality_of_gga_has_a_usual_error(self, quality: int, sigma_m: float, words: str) -> None:
        log = read(nmea(SHORT, quality=quality))
        assert log.typical_sigmas == pytest.approx(np.full(6, sigma_m))
        assert log.quality_words(3) == words

    @pytest.mark.parametrize(
        ("modes", "sigma_m", "words"),
        [("RR", 0.01, "mode R, RTK fixed"), ("RNN", 0.01, "mode R, RTK fixed"), ("RA", 3, "mode A, autonomous")],
    )
    def test_the_worst_mode_of_gns_counts(self, modes: str, sigma_m: float, words: str) -> None:
        log = read("\n".join([rmc(0), gns(0, 48, 11, 3000, modes=modes)]))
        assert log.typical_sigmas == pytest.approx([sigma_m])
        assert log.quality_words(0) == f"GNS {words}"
