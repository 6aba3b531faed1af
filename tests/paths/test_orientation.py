"""Turning the Earth by UT1 and the pole: against ERFA and the tables of the IERS."""

import math
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.paths.elements import read_tle
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import DAY_S, Instant, later
from bisar_budget.paths.oem import read_oem
from bisar_budget.paths.orientation import UNKNOWN, Orientation, from_teme, read_earth_rotation
from tests.paths.orbit_files import CENTER, START, TLE, checked, oem, on_circle

erfa = pytest.importorskip("erfa")

ARCSEC = math.radians(1 / 3600)
FINALS = (Path(__file__).parent / "files" / "finals2000A_excerpt.all").read_bytes()
TURNED = Orientation(-0.172, (0.2 * ARCSEC, 0.4 * ARCSEC), 0.0, 0.0)
PLACE = (5.1e6, -3.2e6, 3.7e6)


@pytest.mark.parametrize("frame", ["GCRF", "TEME"])
def test_a_place_is_turned_as_erfa_has_it(frame: str) -> None:
    """To 0.1 mm; the matrix of polar motion is ERFA's pom00, with s' of 0.1 mas left out in TEME: below 1 mm."""
    at = START.after(615)
    orbit = read_oem(oem(frame=frame).encode(), "c.oem", None, at, TURNED)
    dut1 = (2400000.5 + at.day, (at.seconds - 0.172) / DAY_S)
    wobble = erfa.pom00(*TURNED.pole, 0.0)
    if frame == "GCRF":
        tt = (2400000.5 + at.day, (at.seconds + 37 + 32.184) / DAY_S)
        matrix = wobble @ erfa.c2tcio(erfa.c2i06a(*tt), erfa.era00(*dut1), np.eye(3))
    else:
        matrix = wobble @ erfa.rz(erfa.gmst82(*dut1), np.eye(3))
    expected = matrix @ np.array(on_circle(615)[0])
    assert math.dist(orbit.place(at), expected) < (1e-3 if frame == "GCRF" else 1e-4)


def test_ut1_turns_elements_as_far_as_it_says() -> None:
    still, turned = (read_tle(TLE.encode(), "s", None, CENTER, one).place(CENTER) for one in (UNKNOWN, TURNED))
    eastward = 0.172 * 7.292115e-5 * math.hypot(*still[:2])
    level = from_teme(PLACE, CENTER, TURNED._replace(pole=(0.0, 0.0)))
    assert math.dist(level, from_teme(PLACE, CENTER)) == pytest.approx(
        0.172 * 7.292115e-5 * math.hypot(*PLACE[:2]), rel=1e-6
    )
    assert math.dist(still, turned) == pytest.approx(eastward, abs=0.45 * ARCSEC * math.hypot(*still))


def test_words_and_doubts() -> None:
    text = oem(frame="GCRF").encode()
    at = START.after(600)
    stated = read_oem(text, "c.oem", None, at, TURNED)
    assert stated.words.endswith(", UT1 - UTC -0.172 s")
    assert stated.doubts(at) == ()
    assert stated.doubt(at).words == "interpolation of the ephemeris, the Earth's orientation"
    assert stated.doubt(at).size < 1e-3
    without_pole = read_oem(text, "c.oem", None, at, Orientation(-0.172, ut1_doubt=0.0))
    (said,) = without_pole.doubts(at)
    assert said == "c.oem:4: GCRF is turned to the Earth to about 21 m: UT1 or the pole is not known better"
    assert without_pole.doubt(at).size == pytest.approx(0.6 * ARCSEC * math.hypot(*on_circle(600)[0]), rel=1e-3)
    fixed = read_oem(oem().encode(), "c.oem", None, at, TURNED)
    assert "UT1" not in fixed.words
    assert not fixed.is_turned


# UT1 - UTC and the pole by astropy.utils.iers 7, of the same table, on both sides of the leap second of 2016-12-31.
@pytest.mark.parametrize(
    ("day", "part", "ut1", "pole"),
    [
        (57753, 0.25, -0.407995625, (0.081101, 0.263011)),
        (57754, 0.5, 0.5907562, (0.0803625, 0.2633345)),
        (60179, 0.6, -0.0023712600000010235, (0.2920666, 0.428307)),
    ],
)
def test_the_table_of_the_iers(day: int, part: float, ut1: float, pole: tuple[float, float]) -> None:
    """To what the digits of the table give: 1e-7 s and 1e-6 arcsec. Astropy takes parts of a day as doubles."""
    found = read_earth_rotation(FINALS, "finals", Instant(day, part * DAY_S))
    assert found.ut1_minus_utc == pytest.approx(ut1, abs=2e-8)
    assert np.array(found.pole) / ARCSEC == pytest.approx(pole, abs=1e-7)
    assert 5e-6 < found.ut1_doubt < 2e-5
    assert found.pole_doubt < 1e-4 * ARCSEC


def test_the_second_that_a_day_has_more_is_no_jump_of_the_earth() -> None:
    before, after = (
        read_earth_rotation(FINALS, "f", Instant(57753, seconds)) for seconds in (DAY_S - 1, DAY_S + 0.5)
    )
    assert after.ut1_minus_utc - before.ut1_minus_utc == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize(
    ("data", "day", "said"),
    [
        (FINALS, 57757, "finals: has no values for 2017-01-04T00:00:00.000Z; it covers 2016-12-29 to 2023-08-25"),
        (FINALS, 61755, "finals: has no values for 2027-12-"),
        (b"", 57753, "finals: has no row of values"),
        (b"1 39634U 14016A   26151.42515188\n", 57753, "finals:1: MJD must be a number, in the columns of the IERS'"),
        (FINALS.replace(b"-0.4077600", b"-4.0776000"), 57753, "finals:3: cannot be a row of the IERS' finals2000A"),
        (
            FINALS.replace(b"57754.00", b"57752.00"),
            57753,
            "finals:4: the day 57752 is not after 57753 of a row before",
        ),
        (b"\xff\xfe\x00" * 100, 57753, "finals:1: MJD must be a number"),
    ],
)
def test_what_is_refused(data: bytes, day: int, said: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_earth_rotation(data, "finals", Instant(day, 0.0))
    assert str(error.value).startswith(said)


class TestFormsOfTheTable:
    """The same days by every form of the table: figures are those of the IERS' fixed columns."""

    DAYS = (57752, 57753, 57754)
    ROWS = tuple(line for line in FINALS.decode().splitlines() if line[7:12] in ("57752", "57753", "57754", "57755"))

    @staticmethod
    def bulletin_b(line: str) -> tuple[str, str, str, str]:
        return line[7:15].strip(), line[134:144].strip(), line[144:154].strip(), line[154:165].strip()

    def table(self, form: str, kinds: str = "OOOO") -> bytes:
        rows = [self.bulletin_b(line) for line in self.ROWS]
        if form == "celestrak":
            header = "DATE,MJD,X,Y,UT1-UTC,LOD,DPSI,DEPS,DX,DY,DAT,DATA_TYPE"
            lines = [f"x,{d[:5]},{x},{y},{u},0,0,0,0,0,37,{k}" for (d, x, y, u), k in zip(rows, kinds, strict=True)]
        elif form == "csv":
            header = (
                "MJD;Year;Month;Day;Type;x_pole;sigma_x_pole;y_pole;sigma_y_pole;Type;UT1-UTC;sigma_UT1-UTC;"
                "bulB/x_pole;bulB/y_pole;bulB/UT-UTC"
            )
            lines = [f"{d};;;;final;9;0.00005;9;0.00004;final;9;0.00001;{x};{y};{u}" for d, x, y, u in rows]
        elif form == "c04 20":
            header = '# EARTH ORIENTATION\n# YR  MM  DD  HH       MJD        x(")        y(")  UT1-UTC(s)'
            lines = [
                f"2016 12 30 0 {d} {x} {y} {u} 0 0 0 0 0.001 0.00005 0.00004 0.00001 0 0 0 0 0" for d, x, y, u in rows
            ]
        else:
            header = "   EARTH ORIENTATION PARAMETER (EOP) PRODUCT CENTER\n      Date      MJD      x          y"
            lines = [
                f"2016  12  30  {d[:5]} {x} {y} {u} 0.001 0 0 0.00005 0.00004 0.00001 0 0 0" for d, x, y, u in rows
            ]
        return "\n".join([header, *lines, ""]).encode()

    @pytest.mark.parametrize("form", ["celestrak", "csv", "c04 20", "c04 14"])
    def test_the_figures_are_those_of_the_fixed_columns(self, form: str) -> None:
        for day in self.DAYS:
            at = Instant(day, 30000.0)
            expected = read_earth_rotation(FINALS, "finals", at)
            found = read_earth_rotation(self.table(form), "table", at)
            assert found.ut1_minus_utc == pytest.approx(expected.ut1_minus_utc, abs=1e-9)
            assert found.pole == pytest.approx(expected.pole, abs=1e-12)
            assert 0 < found.ut1_doubt < 1e-3
            assert 0 < found.pole_doubt < 1e-3 * ARCSEC
            assert not found.is_predicted

    def test_predictions_are_flagged_and_doubted_more(self) -> None:
        data = self.table("celestrak", "OPPP")
        predicted = read_earth_rotation(data, "t", Instant(57754, 0.0))
        assert predicted.is_predicted
        assert predicted.words.endswith("s (predicted)")
        # Two days ahead: 0.00025·2^0.75 s (IERS Bulletin A).
        assert predicted.ut1_doubt == pytest.approx(0.00025 * 2**0.75, rel=0.1)
        assert not read_earth_rotation(self.table("celestrak"), "t", Instant(57754, 0.0)).is_predicted

    @pytest.mark.parametrize("form", ["celestrak", "csv", "c04 20", "c04 14"])
    def test_a_row_is_checked_as_in_the_fixed_columns(self, form: str) -> None:
        data = self.table(form)
        (ut1,) = {self.bulletin_b(self.ROWS[1])[3]}
        with pytest.raises(PathFileError, match=r"cannot be a row of .*UT1 - UTC -4\.0"):
            read_earth_rotation(data.replace(ut1.encode(), b"-4.07"), "t", Instant(57753, 0.0))
        with pytest.raises(PathFileError, match=r"t:\d: UT1 - UTC must be a number, in the columns of"):
            read_earth_rotation(data.replace(ut1.encode(), b"x"), "t", Instant(57753, 0.0))
        with pytest.raises(PathFileError, match=r"has no values for .*; it covers 2016-12-30 to 2017-01-02"):
            read_earth_rotation(data, "t", Instant(59000, 0.0))
        lines = data.splitlines()
        with pytest.raises(PathFileError, match="days must rise"):
            read_earth_rotation(b"\n".join([*lines[:-1], lines[-2]]), "t", Instant(57755, 0.0))

    def test_a_web_page_is_named(self) -> None:
        with pytest.raises(PathFileError) as error:
            read_earth_rotation(b"<!DOCTYPE html>\n<html></html>", "t", CENTER)
        assert str(error.value).startswith("t: is a page of a web site, not a table of the Earth's rotation")

    def test_a_header_without_a_column_is_refused(self) -> None:
        data = self.table("celestrak").replace(b",Y,", b",Z,")
        with pytest.raises(PathFileError, match="t:1: has no column Y"):
            read_earth_rotation(data, "t", CENTER)


def test_a_leap_second_does_not_turn_the_earth() -> None:
    """UT1 - UTC jumps with it, UT1 does not: between 0.25 s before and after, the Earth turns as in half a second."""
    midnight = Instant(57754, 0.0)  # 2017-01-01, after a leap second
    known = Orientation(0.5912, (0.0, 0.0), 0.0, 0.0, day=57754)
    before, after = (from_teme(PLACE, later(midnight, half_s), known) for half_s in (-0.25, 0.25))
    assert math.dist(before, after) == pytest.approx(0.5 * 7.292115e-5 * math.hypot(*PLACE[:2]), rel=1e-4)


def test_elements_fly_on_over_a_leap_second() -> None:
    """Places a quarter of a second apart: their second difference is that of gravity, 9 m/s² or less."""
    midnight = Instant(57754, 0.0)
    line_1, line_2 = TLE.splitlines()[1:]
    epoch = checked(line_1[:18] + "16366.42515188" + line_1[32:])
    for orientation in (UNKNOWN._replace(day=57754), Orientation(0.5912, day=57754)):
        orbit = read_tle(f"{epoch}\n{line_2}\n".encode(), "s", None, midnight, orientation)
        a, b, c = (np.array(orbit.place(later(midnight, part))) for part in (-0.25, 0.0, 0.25))
        assert np.linalg.norm(a - 2 * b + c) / 0.25**2 < 9.5
        assert np.linalg.norm(c - a) / 0.5 == pytest.approx(7500, rel=0.03)


def test_an_instant_within_a_leap_second() -> None:
    midnight = Instant(57754, 0.0)
    assert later(midnight, -0.25) == (57753, pytest.approx(86400.75))
    assert later(midnight, -1.25) == (57753, pytest.approx(86399.75))
    assert later(midnight, 0.25) == Instant(57754, 0.25)
