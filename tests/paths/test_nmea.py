"""Logs of NMEA 0183."""

import math
import sys
from datetime import UTC, datetime

import numpy as np
import pytest

from bisar_budget.paths.earth import Geodetic, earth_fixed
from bisar_budget.paths.flight import Log, PathFileError
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
        (nmea(FLOWN), "NMEA 0183 GGA, 501 places over 10 s"),
        (nmea(FLOWN, date=zda), "NMEA 0183 GGA, 501 places over 10 s"),
        (nmea(FLOWN, gns), "NMEA 0183 GNS, 501 places over 10 s"),
        (nmea(FLOWN).replace(b"\r\n", b"\n"), "NMEA 0183 GGA, 501 places over 10 s"),
        (
            b"\xb5\x62\x01\x07\n" + nmea(FLOWN).replace(b"$GNGGA", b"12.5 $GNGGA"),
            "NMEA 0183 GGA, 501 places over 10 s",
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


def test_talkers_of_one_receiver_are_one_log_and_those_of_two_are_not() -> None:
    """A receiver may call itself GP while it sees no other system."""
    lines = nmea(FLOWN).decode().splitlines()
    changing = [gga(*one, talker="GP" if n % 100 < 30 else "GN") for n, one in enumerate(_places())]
    assert len(read("\n".join([lines[2], *changing])).times) == 501
    far = FLOWN.longitude + 0.1
    other = [gga(t, a, b, h, talker="GP") for t, a, b, h in list(_places(far))[:400]]
    mixed = [line for pair in zip(lines[::3], other + [""] * 101, strict=True) for line in pair]
    log = read("\n".join([lines[2], *mixed]))
    assert np.abs(log.places - FLOWN.places).max() < DIGITS


def _places(longitude=None):
    degrees = np.degrees(FLOWN.longitude if longitude is None else longitude)
    return zip(FLOWN.times, np.degrees(FLOWN.latitude), degrees, FLOWN.height, strict=True)


def test_wrong_checksums_are_left_out_and_counted() -> None:
    lines = nmea(FLOWN).decode().splitlines()
    lines[300] = lines[300].replace(",N,", ",S,")
    lines[303] = lines[303].rpartition("*")[0]
    lines[306] = lines[306][:30]
    log = read("\n".join(lines))
    assert len(log.times) == 498
    assert log.words == "NMEA 0183 GGA, 3 sentences with a wrong checksum left out, 498 places over 10 s"


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
        (GOOD[0::3], "a.nmea: has no date"),
        (
            [*GOOD, GOOD[0]],
            "a.nmea:19: time 2026-06-01T05:20:01.250Z is not after 2026-06-01T05:20:01.350Z of line 16",
        ),
        (
            [sentence("GPGGA,052060.00,4805.0,N,01116.0,E,1,12,0.7,1.0,M,1.0,M,,")],
            "a.nmea:1: GGA must have a time like 052001.25 (got '052060.00')",
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

    @pytest.mark.parametrize("fields", [",,,,,,", "9.9,,,,0,0,0", "9.9,,,,0.01,,0.02", "9.9,,,,-1,1,1"])
    def test_a_gst_that_states_nothing_is_none(self, fields: str) -> None:
        lines = [rmc(0), gga(0, 48, 11, 3000), sentence(f"GNGST,052001.25,{fields}")]
        assert read("\n".join(lines)).sigmas is None

    @pytest.mark.parametrize("is_own", [True, False])
    def test_the_gst_of_the_talker_of_the_fixes_counts(self, is_own: bool) -> None:
        """Those of another receiver do not speak for it, where it has its own."""
        lines = [rmc(0), gga(0, 48, 11, 3000), gst(0, 3, 2, 5, talker="GP")]
        lines += [gst(0, 0.02, 0.01, 0.05)] if is_own else []
        log = read("\n".join(lines))
        assert log.sigmas is not None
        assert log.sigmas[0] == pytest.approx([0.02, 0.01, 0.05] if is_own else [3, 2, 5])

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
