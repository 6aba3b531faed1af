"""CSV logs of flights."""

import importlib.util
import math
import re
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bisar_budget.paths import flight_log
from bisar_budget.paths.earth import Geodetic, earth_fixed
from bisar_budget.paths.flight import PathFileError, slow_times, smoothed
from bisar_budget.paths.flight_log import earth_fixed_places, read_csv
from bisar_budget.paths.instant import parse_instant
from tests.conftest import ROOT, examples
from tests.paths.flown import earth_fixed_csv, flight, geodetic_csv, stamp

GOOD = "time [s],latitude [deg],longitude [deg],height [m]\n0,48,11,3000\n1,48.001,11,3000\n2,48.002,11,3000\n"
HEADER = GOOD.split("\n")[0]


def read(text: str) -> flight_log.Log:
    return read_csv(text.encode(), "flight.csv")


@given(st.floats(-math.pi / 2, math.pi / 2), st.floats(-math.pi, 2 * math.pi), st.floats(-1e4, 1e6))
def test_arrays_of_places_are_those_of_the_earth(latitude: float, longitude: float, height: float) -> None:
    found = earth_fixed_places(*(np.array([one]) for one in (latitude, longitude, height)))
    assert found[0] == pytest.approx(earth_fixed(Geodetic(latitude, longitude, height)), abs=4e-9)  # 4 ulp of 7e6 m


def test_a_level_flight_is_where_it_was() -> None:
    """0.1 nm of a cell is less than rounding of an Earth-fixed place, 1e-9 m; a degree has 15 decimals."""
    flown = flight()
    by_degrees, by_metres = read_csv(geodetic_csv(flown), "a.csv"), read_csv(earth_fixed_csv(flown), "b.csv")
    for log in (by_degrees, by_metres):
        assert log.is_earth_fixed
        assert log.times == pytest.approx(flown.times, abs=1e-12)
        assert np.abs(log.places - flown.places).max() < 5e-9
    assert by_degrees.start == parse_instant(stamp(0))
    assert by_metres.start is None
    assert by_degrees.words == "CSV of latitude, longitude, height, 501 fixes over 10 s"
    assert by_metres.words == "CSV of x, y, z, 501 fixes over 10 s"


def test_places_of_the_scene() -> None:
    log = read("up [ft];east [m];north [m];TIME [min]\n".replace("[ft]", "[m]") + "100;1;2;0\n100;3;4;0.5\n")
    assert not log.is_earth_fixed
    assert log.places.tolist() == [[1, 2, 100], [3, 4, 100]]
    assert log.times.tolist() == [0, 30]


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        GOOD.replace(",", ";"),
        GOOD.replace(",", "\t"),
        GOOD.replace(",", ",\t"),
        GOOD.replace(",", " , "),
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.rstrip("\n"),
        "\ufeff" + GOOD,
        "# a comment, with a comma\n\n" + GOOD.replace("\n", "\n # 1,2\n\n"),
        GOOD.replace("[deg]", "[ deg ]").replace("latitude [", "Latitude["),
        GOOD.replace("[deg]", "[°]"),
        GOOD.replace(",3000", ',"3000"').replace("time [s]", '"time [s]"'),
        GOOD.replace("0,48", "+0.0,48").replace("3000", "3.e3"),
        re.sub(r"(?m),(\w+)", r",\1", GOOD)
        .replace("time [s]", "time [s]")
        .replace("height [m]", "height [km]")
        .replace("3000", "3"),
        re.sub(r"(?m)^(.)", r'"a, b",\1', GOOD).replace('"a, b",time', "note,time"),
        re.sub(r"(?m)^([0-2]),", r"2026-06-01T05:59:5\g<1>Z,", GOOD.replace("time [s]", "time [UTC]")),
        re.sub(r"(?m)^([0-2]),", r"2026-06-01 05:59:5\g<1>.000+00:00,", GOOD.replace("time [s]", "utc [UTC]")),
        re.sub(r"(?m)^([0-2]),", r" 2026-06-01T23:59:5\g<1>.000Z ,", GOOD.replace("time [s]", "UTC")),
        # As `isoformat` leaves out a fraction of zero.
        re.sub(r"(?m)^([0-2]),", r"2026-06-01T23:59:5\g<1>.00Z,", GOOD.replace("time [s]", "utc")).replace(
            "0.00Z", "0Z"
        ),
    ],
)
def test_ways_to_write_the_same(text: str) -> None:
    log, plain = read(text), read(GOOD)
    assert log.times.tolist() == [0, 1, 2]
    assert np.abs(log.places - plain.places).max() < 2e-9
    assert (log.start is not None) == ("utc" in text.lower())


@examples(50)
@given(
    st.lists(st.integers(0, 10**7), min_size=1, max_size=20, unique=True).map(sorted),
    st.integers(0, 3),
    st.sampled_from(["2026-06-01T23:5", "2024-02-28T23:5", "2025-12-31T23:5"]),
)
def test_stamps_are_instants(ticks: list[int], spare: int, begins: str) -> None:
    """Arrays of stamps are read as one stamp is, across midnight too. The ticks are of 10 µs."""
    first = parse_instant(f"{begins}0:00Z")
    assert first is not None
    stamps = []
    for tick in ticks:
        at = first.after((tick // 100_000) * 1.0)
        stamps.append(f"{at.as_text()[:19]}.{tick % 100_000:05d}{'0' * spare}Z")
    log = read("utc,x [m],y [m],z [m]\n" + "".join(f"{one},7000000,0,{n}\n" for n, one in enumerate(stamps)))
    instants = [parse_instant(one) for one in stamps]
    assert log.start is not None
    for time, instant in zip(log.times, instants, strict=True):
        assert instant is not None
        assert time == pytest.approx(instant.since(log.start), abs=1e-10)
    assert log.start.since(instants[0]) == pytest.approx(0, abs=1e-10)  # type: ignore[arg-type]


def test_chunks_of_lines_are_one_log(monkeypatch: pytest.MonkeyPatch) -> None:
    data = geodetic_csv(flight())
    whole = read_csv(data, "a.csv")
    monkeypatch.setattr(flight_log, "_CHUNK_LINES", 7)
    parts = read_csv(data, "a.csv")
    assert (parts.times == whole.times).all()
    assert (parts.places == whole.places).all()


STAMPED = "utc,x [m],y [m],z [m]\n2026-06-01T05:20:31Z,7e6,0,0\n"
LATE = "time 1 s is not after 2 s of line 3; times must rise"
PLACES = "positions are latitude, longitude, height, or x, y, z, or east, north, up"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "1: is empty; its first line names columns, like 'time [s], x [m], y [m], z [m]'"),
        ("\n# a comment\n", "1: is empty; its first line names columns, like 'time [s], x [m], y [m], z [m]'"),
        (HEADER, "1: has a header and no fixes"),
        ("#\n" + HEADER + "\n# none\n", "2: has a header and no fixes"),
        (
            "0,48,11,3000\n1,48,11,3000",
            "1: names no position; the first line names columns, like 'latitude [deg]', 'x [m]' or 'east [m]'",
        ),
        (GOOD.replace("height", "x"), f"1: mixes latitude with x; {PLACES}"),
        (GOOD.replace("height [m]", "height [m],up [m]"), f"1: mixes latitude with up; {PLACES}"),
        (GOOD.replace("latitude", "lat"), "1: has no column latitude"),
        (
            GOOD.replace("height", "altitude"),
            "1: altitude counts from mean sea level, and there is no column geoid_separation; a height counts from "
            "the ellipsoid of WGS-84",
        ),
        (GOOD.replace("time [s]", "t [s]"), "1: has no column of time; write 'time [s]' or 'utc'"),
        (GOOD.replace("height [m]", "height [m],utc"), "1: has both time and utc; keep one"),
        (GOOD.replace("longitude", "latitude"), "1: has two columns latitude"),
        (GOOD.replace("latitude [deg]", "latitude"), "1: latitude has no unit; write 'latitude [deg]'"),
        (GOOD.replace("latitude [deg]", "latitude (deg)"), "1: latitude has no unit; write 'latitude [deg]'"),
        (GOOD.replace("height [m]", "height []"), "1: height has no unit; write 'height [m]'"),
        (
            GOOD.replace("time [s]", "time"),
            "1: time has no unit; write 'time [s]', 'time [UTC]' or 'time [GPST]', or say trajectory.time_scale",
        ),
        (
            GOOD.replace("time [s]", "time [gpst]"),
            "2: time must be an instant of GPST like 2026-06-01T05:20:31.250 (got '0')",
        ),
        (
            GOOD.replace("time [s]", "time [fs]"),
            "1: time has the unknown unit 'fs'; write 'time [s]', 'time [UTC]' or 'time [GPST]'. 1 fs is 1e-15 s",
        ),
        (
            GOOD.replace("latitude [deg]", "latitude [degrees]"),
            "1: latitude has the unknown unit 'degrees'; write 'latitude [deg]'. Did you mean 'deg'?",
        ),
        (
            GOOD.replace("height [m]", "height [deg]"),
            "1: height must be a length, but 'deg' makes it an angle; write 'height [m]'",
        ),
        (GOOD.replace("longitude [deg]", "longitude [rad]"), "1: mixes units: latitude [deg] and longitude [rad]"),
        ("time [s],x [m],y [m],z [km]\n0,0,0,7000\n", "1: mixes units: x [m] and z [km]"),
        (
            GOOD.replace("time [s]", "utc [s]"),
            "1: utc has the unit 's'; stamps like 2026-06-01T05:20:31.250Z need none",
        ),
        ('time [s],"x [m]\n', "1: has a quote that does not end on its line"),
        (GOOD.replace("1,48.001,11,3000", "1,48.001,11"), "3: has 3 cells, the header has 4"),
        (GOOD.replace("1,48.001,11,3000", "1"), "3: has 1 cell, the header has 4"),
        (GOOD.replace("1,48.001,11,3000", "1,48.001,11,3000,"), "3: has 5 cells, the header has 4"),
        (GOOD.replace("1,48.001,11,3000", "1,48.001,11,"), "3: height is empty"),
        (GOOD.replace("48.001", "48 001"), "3: latitude must be a number (got '48 001')"),
        (GOOD.replace("48.001", "48_001"), "3: latitude must be a number (got '48_001')"),
        (GOOD.replace("48.001", "４８"), "3: latitude must be a number (got '４８')"),
        (GOOD.replace("48.001", "0x30"), "3: latitude must be a number (got '0x30')"),
        (GOOD.replace("48.001", "\x1b[2J"), "3: latitude must be a number (got '\\\\x1b[2J')"),
        (GOOD.replace("48.001", "NaN"), "3: latitude must be a finite number (got 'NaN')"),
        (GOOD.replace("3000\n2", "-inf\n2"), "3: height must be a finite number (got '-inf')"),
        (GOOD.replace("3000\n2", "1e999\n2"), "3: height must be a finite number (got '1e999')"),
        (
            GOOD.replace(",", ";").replace("48.001", "48,001"),
            "3: latitude must be a number (got '48,001'); write a decimal point",
        ),
        (GOOD.replace("48.001", '"48.001'), "3: has a quote that does not end on its line"),
        (GOOD.replace("48.001", "x" * 200_000), "3: has a cell of more than 131072 letters"),
        (GOOD.replace("48.001", "x" * 100_000), f"3: latitude must be a number (got '{'x' * 57}...')"),
        (GOOD.replace("48.001", f'"{"x" * 200_000}"'), "3: has a cell of more than 131072 letters"),
        (GOOD.replace("48.001", "90.001"), "3: latitude 90.001 deg is beyond 90 deg"),
        (GOOD.replace(",11,", ",361,"), "2: longitude 361 deg is beyond 360 deg"),
        (GOOD.replace("3000\n2", "1e308\n2"), "3: height 1e+308 m is beyond 1e+09 m"),
        (GOOD.replace("[m]", "[km]").replace("3000\n2", "1e308\n2"), "3: height 1e+308 km is beyond 1e+09 m"),
        (GOOD.replace("2,48", "1e12,48"), "4: time 1e+12 s is beyond 1e+11 s"),
        (GOOD.replace("2,48", "1,48"), "4: time 1 s is not after 1 s of line 3; times must rise"),
        (GOOD.replace("\n2,", "\n0.5,"), "4: time 0.5 s is not after 1 s of line 3; times must rise"),
        (
            "time [s],x [m],y [m],z [m]\n0,100,200,300\n",
            "2: x, y, z are 0.3742 km from the Earth's centre; Earth-fixed coordinates are wanted, "
            "positions of the scene are named east, north, up",
        ),
        (
            STAMPED + "2026-06-01T05:20:32.5,7e6,0,0\n",
            "3: utc must be an instant of UTC like 2026-06-01T05:20:31.250Z (got '2026-06-01T05:20:32.5')",
        ),
        (
            STAMPED.replace("-06-", "-13-"),
            "2: utc must be an instant of UTC like 2026-06-01T05:20:31.250Z (got '2026-13-01T05:20:31Z')",
        ),
        (
            STAMPED + "2026-06-01T05:20:31.000Z,7e6,0,0\n",
            "3: time 2026-06-01T05:20:31.000Z is not after 2026-06-01T05:20:31.000Z of line 2; times must rise",
        ),
        (
            STAMPED.replace("2026-06-01T05:20:31Z", "9999-12-31T23:59:59.9999Z") + "2026-06-01T05:20:31Z,7e6,0,0\n",
            "3: time 2026-06-01T05:20:31.000Z is not after MJD 2973484.00000 of line 2; times must rise",
        ),
        (GOOD + "\0", "5: has a zero byte; CSV is text in UTF-8, not in UTF-16"),
    ],
)
def test_faults_have_lines(text: str, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(text)
    assert str(error.value) == f"flight.csv:{says}"


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (GOOD.encode("utf-16"), "1: is in UTF-16; save it in UTF-8"),
        (GOOD.encode("utf-16-le"), "1: has a zero byte; CSV is text in UTF-8, not in UTF-16"),
        (
            GOOD.replace("\n", "\r\n").replace("[deg]", "[°]").encode("latin-1"),
            "1: has the byte 0xb0, which is not UTF-8; save it in UTF-8",
        ),
        (b"\xef\xbb\xbf" + GOOD.encode() + b"# \xfc", "5: has the byte 0xfc, which is not UTF-8; save it in UTF-8"),
    ],
)
def test_other_encodings_are_refused(data: bytes, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_csv(data, "flight.csv")
    assert str(error.value) == f"flight.csv:{says}"


def test_a_file_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flight_log, "MAX_CSV_BYTES", 50)
    with pytest.raises(PathFileError, match=r"^flight.csv: has 0 MB, at most 0 MB are read$"):
        read(GOOD)


def held_to_its_word(data: bytes) -> None:
    """A log, or an error of one line that names the file."""
    try:
        log = read_csv(data, "flight.csv")
    except PathFileError as error:
        said = str(error)
        assert re.match(r"flight\.csv(:\d+)?: ", said)
        assert said.isprintable()
        assert len(said) < 400
    else:
        assert log.places.shape == (len(log.times), 3)
        assert np.isfinite(log.places).all()
        assert np.isfinite(log.times).all()
        assert (np.diff(log.times) > 0).all()


@given(st.binary(max_size=200))
@example(b"\xef\xbb\xbf")
@example(b"\xef\xbb\xbf\xff")
@example(b'"')
@example(b"\r")
def test_any_bytes(data: bytes) -> None:
    held_to_its_word(data)


@examples(300)
@given(
    st.sampled_from(
        [GOOD, STAMPED + "2026-06-01T05:20:32Z,7e6,0,0\n", GOOD.replace(",", ";"), GOOD.replace("1", '"1"')]
    ),
    st.lists(
        st.tuples(
            st.integers(0, 200),
            st.integers(0, 6),
            st.binary(max_size=6)
            | st.sampled_from(
                [
                    b",",
                    b";",
                    b"\t",
                    b'"',
                    b"\n",
                    b"\r",
                    b"#",
                    b"nan",
                    b"1e400",
                    b"-",
                    b"[",
                    b"]",
                    b"\xc2\xa0",
                    b"\x1c",
                    b"\xe2\x80\xa8",
                ]
            ),
        ),
        min_size=1,
        max_size=4,
    ),
)
def test_damaged_files(text: str, changes: list[tuple[int, int, bytes]]) -> None:
    data = text.encode()
    for at, length, new in changes:
        data = data[:at] + new + data[at + length :]
    held_to_its_word(data)


@given(st.lists(st.lists(st.text(max_size=8) | st.floats().map(str), min_size=4, max_size=4), max_size=4))
def test_any_cells(rows: list[list[str]]) -> None:
    held_to_its_word("\n".join([HEADER, *(",".join(row) for row in rows)]).encode(errors="surrogatepass"))


def script_of_docs(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_circle_of_the_examples_is_what_its_script_writes() -> None:
    log = ROOT / "specs" / "missions" / "paths" / "circle_made_up.csv"
    assert log.read_text(encoding="utf-8").splitlines() == list(script_of_docs("make_circle").lines())


def test_the_flight_of_the_examples_can_be_flown() -> None:
    """Smoothed over two seconds, what is left is its noise."""
    maker = script_of_docs("make_flight")
    lines = list(maker.lines())
    data = "\n".join(lines).encode()
    assert lines == list(maker.lines())
    assert len(data) < 250_000
    assert lines[0].startswith("# Made up, not flown")
    log = read_csv(data, "flight.csv")
    middle = parse_instant(maker.MIDDLE)
    fitted = smoothed(slow_times(log, middle, None, 2.0, "flight.csv"), log.places, 2.0)
    assert fitted.samples == 101
    assert fitted.rms == pytest.approx(math.sqrt(3) * maker.NOISE, rel=0.15)  # 6 % one sigma of 3 x 101
    speeds = np.linalg.norm(np.diff(log.places[::50], axis=0), axis=1)
    assert speeds == pytest.approx(np.full(60, maker.SPEED), abs=2)
    heights = [float(line.split(",")[3]) for line in lines if line.startswith("2026")]
    assert np.std(heights) == pytest.approx(maker.GUSTS[2], rel=0.4)
    assert max(abs(b - a) for a, b in pairwise(heights)) < 0.1


class TestAccuracyColumns:
    GEODETIC = "time [s],latitude [deg],longitude [deg],height [m]"
    ROW = "{},48.0,11.0,3000.0"

    def sigmas(self, columns: str, *cells: str, header: str = GEODETIC, row: str = ROW) -> Any:
        lines = [f"{header},{columns}", *(f"{row.format(n)},{one}" for n, one in enumerate(cells))]
        return read("\n".join(lines)).sigmas

    @pytest.mark.parametrize(
        "columns",
        [
            "sigma_north [m],sigma_east [m],sigma_up [m]",
            "sdn(m),sde(m),sdu(m)",
            "std_lat [m],std_lon [m],std_alt [m]",
            "north sigma [m],east sigma [m],height sigma [m]",
        ],
    )
    def test_names_of_the_same_errors(self, columns: str) -> None:
        assert self.sigmas(columns, "1,2,3", "4,5,6") == pytest.approx(np.array([[2, 1, 3], [5, 4, 6]]))

    @pytest.mark.parametrize("columns", ["hAcc [m],vAcc [m]", "horizontal accuracy [m],vertical accuracy [m]"])
    def test_figures_on_the_level(self, columns: str) -> None:
        assert self.sigmas(columns, "2,3", "4,5") == pytest.approx(np.array([[2, 2, 3], [4, 4, 5]]))

    def test_units_count(self) -> None:
        assert self.sigmas("accuracy [cm]", "200", "300") == pytest.approx(np.array([[2.0] * 3, [3.0] * 3]))

    @pytest.mark.parametrize("quote", ["", '"'])
    @pytest.mark.parametrize("cell", ["", "nan", "n/a", "0", "-1"])
    def test_a_cell_that_says_nothing_is_no_fault(self, cell: str, quote: str) -> None:
        found = self.sigmas("accuracy [m]", "2", f"{quote}{cell}{quote}")
        assert found[0] == pytest.approx([2, 2, 2])
        assert np.isnan(found[1]).all()
        assert self.sigmas("accuracy [m]", cell, cell) is None

    def test_earth_fixed_ones_are_turned(self) -> None:
        """At the equator on the meridian of Greenwich x is up, y is east, z is north."""
        found = self.sigmas(
            "sdx(m),sdy(m),sdz(m)", "1,2,3", header="time [s],x [m],y [m],z [m]", row="{},6380000,0,0"
        )
        assert found == pytest.approx(np.array([[2, 3, 1]]))

    @pytest.mark.parametrize(
        ("columns", "says"),
        [
            ("sigma_east,sigma_north,sigma_up", "sigma_east has no unit; write 'sigma_east [m]'"),
            ("sde(m),sdn(m)", "has sigma_east and no sigma_up; write all of sigma_east, sigma_north, sigma_up"),
            ("sde(m),sigma_east [m]", "has two columns of sigma_east"),
            ("std_lat [deg],std_lon [deg],std_alt [m]", "std_lat "),
            ("CEP [m]", "CEP looks like an accuracy of the positions, but is not a known one: name it as what it is"),
            ("EPE [m]", "EPE looks like"),
            ("r95 [m]", "r95 looks like"),
            ("position error [m]", "position error looks like"),
            ("2 sigma [m]", "2 sigma looks like"),
            ("sigma_foo [m]", "accepted: one sigma as sigma_east, sigma_north, sigma_up [m], or sigma_x"),
            ("cov_xx [m^2],cov_yy [m^2],cov_zz [m^2],cov_xy [m^2]", "cov_xy looks like"),
            ("cov_en [m^2]", "has a covariance of two axes and no sigmas of them"),
            ("SD-H [m]", "has an error of h, which may be the height or horizontal"),
            ("position accuracy", "position_accuracy has no unit"),
        ],
    )
    def test_columns_that_are_refused(self, columns: str, says: str) -> None:
        with pytest.raises(PathFileError) as error:
            self.sigmas(columns, ",".join("1" * (columns.count(",") + 1)))
        assert says in str(error.value)

    @pytest.mark.parametrize(
        ("columns", "cells", "wanted"),
        [
            ("sigma [m]", "3", [3, 3, 3]),
            ("Position StdDev [m]", "3", [3, 3, 3]),
            ("position accuracy [cm]", "300", [3, 3, 3]),
            ("3D accuracy (m)", "3", [3, 3, 3]),
            ("sigma_horizontal [m],sigma_vertical [m]", "2,3", [2, 2, 3]),
            ("SD-H [m],SD-V [m]", "2,3", [2, 2, 3]),
            ("SD-E [m],SD-N [m],SD-H [m]", "1,2,3", [1, 2, 3]),
            ("latitude standard deviation [m],longitude standard deviation [m],altitude standard deviation [m]",
             "1,2,3", [2, 1, 3]),
            ("SDEast(m),SDNorth(m),SDHeight(m)", "1,2,3", [1, 2, 3]),
            ("sigma_east_m,sigma_north_m,sigma_down_m", "1,2,3", [1, 2, 3]),
            ("cov_ee [m^2],cov_en [m^2],cov_nn [m^2],cov_uu [m^2]", "1,-0.5,4,9", [1, 2, 3]),
            ("latitude accuracy [m],longitude accuracy [m],altitude accuracy [m]", "1,2,3", [2, 1, 3]),
            ("pAcc [mm]", "3000", [3, 3, 3]),
        ],
    )  # fmt: skip
    def test_other_names_that_are_plain(self, columns: str, cells: str, wanted: list[float]) -> None:
        assert self.sigmas(columns, cells) == pytest.approx(np.array([wanted]))

    @pytest.mark.parametrize(
        "columns",
        [
            "hdop,vdop,pdop",
            "sdve(m/s),sdvn(m/s),sdvu(m/s)",
            "SD-VE [m/s]",
            "sigma_x [m/s],sigma_y [m/s],sigma_z [m/s]",
            "speedAccuracy",
            "velocity std [m/s],3D velocity accuracy [m/s]",
            "s_variance_m_s,c_variance_rad",
            "roll std [deg],sigma_h [deg],headingAccuracy [deg]",
            "acc_x [m/s^2],clock sigma [s],time accuracy",
            "cross track error [m],residual rms [m],magnetic variation [deg]",
        ],
    )
    def test_accuracies_of_something_else_are_not_read(self, columns: str) -> None:
        assert self.sigmas(columns, ",".join("3" * (columns.count(",") + 1))) is None

    @pytest.mark.parametrize("cells", ["3,3,", "3,3,0", "n/a,3,3", "3,-1,3", "nan,3,nan", '3,"",3'])
    def test_figures_that_are_known_count_without_the_others(self, cells: str) -> None:
        """Those of the other axes are not known, and not 0."""
        found = self.sigmas("sigma_east [m],sigma_north [m],sigma_up [m]", cells, "1,2,4")
        known = [cell == "3" for cell in cells.split(",")]
        assert found[0] == pytest.approx(np.where(known, 3, np.nan), nan_ok=True)
        assert found[1] == pytest.approx([1, 2, 4])

    def test_figures_along_x_y_z_count_without_the_third(self) -> None:
        assert self.sigmas("sdx(m),sdy(m),sdz(m)", "3,3,0") == pytest.approx(np.array([[3, 3, 3]]))

    def test_figures_that_cannot_be_used_are_counted(self) -> None:
        header = f"{self.GEODETIC},sigma_east [m],sigma_north [m],sigma_up [m]"
        rows = [f"{self.ROW.format(n)},3,{'n/a' if n else 3},{'-1' if n == 2 else ''}" for n in range(4)]
        words = read("\n".join([header, *rows])).words
        assert "4 figures of accuracy that cannot be used left out" in words
        assert "figure" not in read("\n".join([header, rows[0]])).words

    @pytest.mark.parametrize("cell", ["3 m", "3,0", "bad"])
    def test_a_cell_that_no_number_is_leaves_its_row_out(self, cell: str) -> None:
        header = f"{self.GEODETIC},accuracy [m]"
        rows = [f"{self.ROW.format(n)},2" for n in range(120)]
        rows[7] = f'{self.ROW.format(7)},"{cell}"'
        log = read("\n".join([header, *rows]))
        assert len(log.times) == 119
        assert "1 record that cannot be used left out (line 9)" in log.words
        with pytest.raises(PathFileError, match="horizontal_accuracy must be a number, or empty"):
            self.sigmas("accuracy [m]", *[f'"{cell}"'] * 20)

    def test_of_two_sets_the_larger_figure_counts(self) -> None:
        sigmas = "sigma_east [m],sigma_north [m],sigma_up [m]"
        for cells, wanted in (
            ("3,2,0.001,0.001,0.001", [3, 3, 2]),
            ("0.001,0.001,5,0.001,", [5, 0.001, 0.001]),
            (",,1,2,3", [1, 2, 3]),
        ):
            found = self.sigmas(f"horizontal accuracy [m],vertical accuracy [m],{sigmas}", cells)
            assert found == pytest.approx(np.array([wanted]))
        found = self.sigmas(f"{sigmas},sigma_x [m],sigma_y [m],sigma_z [m]", ",,,3,3,3", "4,1,1,3,3,3")
        assert found == pytest.approx(np.array([[3, 3, 3], [4, 3, 3]]))
        found = self.sigmas(f"{sigmas},cov_ee [m^2],cov_nn [m^2],cov_uu [m^2]", "1,3,,4,4,4")
        assert found == pytest.approx(np.array([[2, 3, 2]]))
        found = self.sigmas("vertical accuracy [m],position accuracy [m]", "0.001,3")
        assert found == pytest.approx(np.array([[3, 3, 3]]))

    def test_dilutions_of_precision_are_no_errors(self) -> None:
        assert self.sigmas("hdop,vdop,pdop", "1,2,3") is None
