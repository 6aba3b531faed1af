"""Logs in CSV as exporters write them, and what the mission file says of a log in CSV."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.flight_log import read_csv
from bisar_budget.paths.instant import parse_instant
from bisar_budget.paths.log_places import LogKeys
from tests.paths.flown import flight, geodetic_csv, stamp
from tests.paths.log_files import (
    GLOBAL,
    GPS_OF_NOW,
    GPS_OF_OLD,
    METRES_A_DEGREE,
    SEPARATION,
    airdata,
    dataflash,
    global_records,
    gps_records,
    mavlogdump,
    px4_csv,
    topic,
    ulog,
)

FLOWN = flight()
SHORT = flight(6)
DRONE = flight(101, 10.0)
OF_SEA = {"geoid_separation": SEPARATION}
# Half of the last digit: 1e-7 deg of 111 km a degree in two coordinates; of heights 1 cm, 1 mm, 0.1 mm, 0.1 mft.
BY_ARDUPILOT = math.hypot(0.5e-7 * METRES_A_DEGREE * math.sqrt(2), 0.5e-2)
BY_PX4 = math.hypot(0.5e-7 * METRES_A_DEGREE * math.sqrt(2), 0.5e-3)
BY_AIRDATA = 0.6e-4


def read(data: bytes | str, **keys: object) -> Log:
    return read_csv(data if isinstance(data, bytes) else data.encode(), "a.csv", LogKeys(**keys))  # type: ignore[arg-type]


def since_start(log: Log) -> float:
    begins = parse_instant(stamp(0))
    assert begins is not None
    assert log.start is not None
    return log.start.since(begins)


@pytest.mark.parametrize(
    ("data", "keys", "digits", "words"),
    [
        (px4_csv(FLOWN, GPS_OF_OLD, gps_records(FLOWN)), {}, BY_PX4, "CSV of PX4's GPS topic, 501 fixes over 10 s"),
        (px4_csv(FLOWN, GPS_OF_NOW, gps_records(FLOWN)), {}, 1e-8, "CSV of PX4's GPS topic, 501 fixes over 10 s"),
        (
            px4_csv(FLOWN, tuple(one for one in GPS_OF_OLD if one[1] != "alt_ellipsoid"), gps_records(FLOWN)),
            OF_SEA,
            BY_PX4 + 1e-4,
            "CSV of PX4's GPS topic, 501 fixes over 10 s",
        ),
        (
            dataflash(FLOWN),
            OF_SEA | {"instance": 0},
            BY_ARDUPILOT,
            "GPS rows of ArduPilot, instance 0, 501 fixes over 10 s, UTC is GPS less 18 s, "
            "1 row without a fix left out",
        ),
        (
            mavlogdump(FLOWN),
            OF_SEA,
            BY_ARDUPILOT,
            "GPS rows of ArduPilot, 501 fixes over 10 s, UTC is GPS less 18 s",
        ),
    ],
)
def test_the_flight_is_where_it_was(data: bytes, keys: dict[str, object], digits: float, words: str) -> None:
    log = read(data, **keys)
    assert np.abs(log.places - FLOWN.places).max() < digits
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
    assert since_start(log) == pytest.approx(0, abs=1e-9)
    assert log.words == words


def test_one_of_several_receivers_is_chosen() -> None:
    with pytest.raises(PathFileError) as error:
        read(dataflash(FLOWN), **OF_SEA)
    assert str(error.value) == "a.csv: has fixes of 2 receivers: of the instances 0 with 501, 1 with 101"
    assert error.value.hint == "trajectory.instance: 0 chooses one"
    assert len(read(dataflash(FLOWN), **OF_SEA, instance=1).times) == 101
    with pytest.raises(PathFileError, match=r"has no fix of the instance 2; it has 0 with 501, 1 with 101") as error:
        read(dataflash(FLOWN), **OF_SEA, instance=2)
    assert error.value.key == "instance"
    with pytest.raises(PathFileError, match=r"has no column that numbers receivers") as error:
        read(geodetic_csv(FLOWN), instance=0)
    assert error.value.key == "instance"


@pytest.mark.parametrize("unit", ["meters", "feet"])
def test_airdata_counts_fractions_on_a_clock_of_its_own(unit: str) -> None:
    """At 10 Hz the first place in a second is at most 0.1 s behind its begin: the middle is 0.05 s off at most."""
    log = read(airdata(DRONE, unit), **OF_SEA)
    assert np.abs(log.places - DRONE.places).max() < BY_AIRDATA
    assert log.times == pytest.approx(DRONE.times, abs=1e-9)
    assert abs(since_start(log)) <= 0.05 + 1e-9
    assert log.words == (
        "CSV of Airdata, 101 fixes over 10 s, UTC to 0.05 s by whole seconds, 1 row without a fix left out"
    )
    with pytest.raises(PathFileError, match=r"has heights above mean sea level, and no geoid separation"):
        read(airdata(DRONE, unit))


def test_clocks_of_airdata_that_drift_are_refused() -> None:
    data = airdata(DRONE).decode().replace("2026-06-01 05:20:05", "2026-06-01 05:21:05")
    with pytest.raises(PathFileError, match=r"time\(millisecond\) and datetime\(utc\), drift apart by"):
        read(data, **OF_SEA)


def test_the_global_position_counts_on_the_autopilots_clock() -> None:
    """Floats of 3000 m are written to 0.12 mm."""
    data = px4_csv(FLOWN, GLOBAL, global_records(FLOWN))
    log = read(data)
    assert log.start is None
    assert log.times == pytest.approx(20 + FLOWN.times, abs=1e-9)
    assert np.abs(log.places - FLOWN.places).max() < 1.3e-4
    above_sea = tuple(one for one in GLOBAL if one[1] != "alt_ellipsoid")
    log = read(px4_csv(FLOWN, above_sea, global_records(FLOWN)), **OF_SEA)
    assert np.abs(log.places - FLOWN.places).max() < 1.3e-4
    with pytest.raises(PathFileError, match=r"time counts since the start of the autopilot, and is in no scale"):
        read(data, time_scale="utc")


def test_what_ulog2csv_writes_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own export of the log of another test, where it is there."""
    ulog2csv = pytest.importorskip("pyulog.ulog2csv")
    (tmp_path / "a.ulg").write_bytes(ulog(topic("sensor_gps", GPS_OF_OLD, 3, gps_records(SHORT))))
    monkeypatch.setattr(sys, "argv", ["ulog2csv", "-o", str(tmp_path), str(tmp_path / "a.ulg")])
    ulog2csv.main()
    log = read((tmp_path / "a_sensor_gps_0.csv").read_bytes())
    assert np.abs(log.places - SHORT.places).max() < BY_PX4
    assert since_start(log) == pytest.approx(0, abs=1e-9)


def test_a_week_that_ends_goes_on_in_the_next() -> None:
    log = read(dataflash(FLOWN, week_second=604795.0), **OF_SEA, instance=0)
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
    assert log.start is not None
    assert log.start.as_text() == "2026-06-06T23:59:37.000Z"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            mavlogdump(SHORT).decode().replace(",2421,", ",2421.5,"),
            "a.csv:2: GPS week must be a whole number from 0 to 9999 (got 2421.5)",
        ),
        (mavlogdump(SHORT).decode().replace(",6,1", ",1,1"), "a.csv: has no row with a fix"),
        (
            mavlogdump(SHORT).decode().replace(",48.", ",x48.", 1),
            "a.csv:2: latitude must be a number (got 'x48.",
        ),
        (
            airdata(SHORT).decode().replace("altitude_above_seaLevel(meters)", "ascent(meters)"),
            "a.csv:1: CSV of Airdata has no height above the sea or the ellipsoid; one above take-off is no position",
        ),
        (
            airdata(SHORT).decode().replace("2026-06-01 05", "2026-06-01 25", 1),
            "a.csv:3: utc must be an instant of UTC like 2026-06-01T05:20:31.250Z (got '2026-06-01 25:20:01')",
        ),
        ("FMT, 128, 89, FMT, BBnNZ, Type,Length\nATT, 1, 2\n", "a.csv:1: is empty; its first line names columns"),
    ],
)
def test_faults_have_lines(text: str, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(text, **OF_SEA)
    assert str(error.value).startswith(says)


# ---------------------------------------------------------------------- plain columns
def scaled(header: str, ahead: float, zone: str) -> bytes:
    """The log of the flight, on a clock that is ahead."""
    lines = geodetic_csv(FLOWN).decode().replace("utc,", f"{header},", 1).splitlines()
    stamps = [stamp(time + ahead).replace("Z", zone) for time in FLOWN.times]
    rest = [line.partition(",")[2] for line in lines[1:]]
    return "\n".join([lines[0], *(f"{one},{cells}" for one, cells in zip(stamps, rest, strict=True))]).encode()


@pytest.mark.parametrize(
    ("data", "scale", "words"),
    [
        (scaled("time [UTC]", 0, "Z"), None, ""),
        (scaled("time [UTC]", 0, "Z"), "utc", ""),
        (scaled("time", 0, "Z"), "utc", ""),
        (scaled("time", 0, ""), "utc", ""),
        (scaled("gpst", 18, ""), None, ", UTC is GPS less 18 s"),
        (scaled("time [GPST]", 18, ""), None, ", UTC is GPS less 18 s"),
        (scaled("time [GPS]", 18, ""), "gps", ", UTC is GPS less 18 s"),
        (scaled("time", 18, ""), "gps", ", UTC is GPS less 18 s"),
        (scaled("time [TAI]", 37, ""), None, ", UTC is TAI less 37 s"),
        (scaled("time", 37, ""), "tai", ", UTC is TAI less 37 s"),
    ],
)
def test_a_scale_is_said_by_the_header_or_the_mission(data: bytes, scale: str | None, words: str) -> None:
    log = read(data, time_scale=scale)
    assert since_start(log) == pytest.approx(0, abs=1e-9)
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
    assert log.words == f"CSV of latitude, longitude, height, 501 fixes over 10 s{words}"


def test_gps_time_has_no_leap_second() -> None:
    """Two seconds of GPS over the end of 2016 are 23:59:59, 23:59:60 and 00:00:00 of UTC."""
    rows = [f"2017-01-01T00:00:{16 + n}.000,{48 + n * 1e-5},11,3000" for n in range(3)]
    log = read("\n".join(["gpst,latitude [deg],longitude [deg],height [m]", *rows]))
    assert log.times.tolist() == [0, 1, 2]
    assert log.start is not None
    assert log.start.as_text() == "2016-12-31T23:59:59.000Z"


HEADER = "time [UTC],latitude [deg],longitude [deg],height [m]"
ROW = "2026-06-01T05:20:01.250Z,48,11,3000"


@pytest.mark.parametrize(
    ("text", "keys", "says"),
    [
        (f"{HEADER}\n{ROW}", {"time_scale": "gps"}, "a.csv:1: counts in UTC, and trajectory.time_scale says GPST"),
        (
            f"{HEADER.replace('UTC', 'GPST')}\n{ROW[:23]},48,11,3000",
            {"time_scale": "utc"},
            "a.csv:1: counts in GPST, and trajectory.time_scale says UTC",
        ),
        (
            f"{HEADER.replace('UTC', 'GPST')}\n{ROW}",
            {},
            "a.csv:2: time must be an instant of GPST like 2026-06-01T05:20:31.250 (got '2026-06-01T05:20:01.250Z')",
        ),
        (
            f"{HEADER.replace(' [UTC]', '')}\n{ROW}",
            {"time_scale": "tai"},
            "a.csv:2: time must be an instant of TAI like 2026-06-01T05:20:31.250 (got '2026-06-01T05:20:01.250Z')",
        ),
        (
            f"{HEADER.replace('UTC', 's')}\n0,48,11,3000",
            {"time_scale": "utc"},
            "a.csv:1: time counts in s; trajectory.time_scale says of instants in which scale they are",
        ),
        (f"{HEADER},gpst\n", {}, "a.csv:1: has both time and gpst; keep one"),
        (f"{HEADER},altitude [m]\n", {}, "a.csv:1: has both height and altitude; keep one"),
        (
            f"{HEADER}\n{ROW}",
            {"geoid_separation": 47.0},
            "a.csv: has heights above the ellipsoid, and trajectory.geoid_separation is given beside it",
        ),
        (
            "time [s],x [m],y [m],z [m]\n0,7e6,0,0\n",
            {"geoid_separation": 47.0},
            "a.csv: has x, y, z, and trajectory.geoid_separation is given beside it",
        ),
    ],
)
def test_what_the_file_and_the_mission_say_agrees(text: str, keys: dict[str, object], says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(text, **keys)
    assert str(error.value).startswith(says)


def test_an_altitude_counts_from_the_sea() -> None:
    above_sea = geodetic_csv(FLOWN._replace(height=FLOWN.height - SEPARATION)).replace(b"height", b"altitude")
    assert np.abs(read(above_sea, **OF_SEA).places - FLOWN.places).max() < 5e-9
    lines = above_sea.decode().splitlines()
    own = "\n".join([f"{lines[0]},geoid separation [cm]", *(f"{line},{SEPARATION * 100:.4f}" for line in lines[1:])])
    assert np.abs(read(own).places - FLOWN.places).max() < 5e-9
    with pytest.raises(PathFileError, match=r"altitude counts from mean sea level") as error:
        read(above_sea)
    assert error.value.accepted.startswith("accepted: trajectory.geoid_separation: 47 m")
    with pytest.raises(PathFileError, match=r"gives the geoid separation itself"):
        read(own, **OF_SEA)


class TestAccuracy:
    @pytest.mark.parametrize(
        ("fields", "records"), [(GPS_OF_NOW, gps_records), (GPS_OF_OLD, gps_records), (GLOBAL, global_records)]
    )
    def test_eph_and_epv_of_px4(self, fields: Any, records: Any) -> None:
        stated = [{**one, "eph": 30.0, "epv": 45.0 if number else "nan"} for number, one in enumerate(records(SHORT))]
        fields = tuple(one for one in fields if one[1] != "eph")
        log = read(px4_csv(SHORT, (*fields, ("float", "eph"), ("float", "epv")), stated))
        assert log.sigmas == pytest.approx(np.array([[30, 30, 30], *[[30, 30, 45]] * 5]))

    def test_rows_gpa_of_ardupilot(self) -> None:
        """Each is of the row GPS of its time and receiver; a row without one states nothing."""
        lines = []
        for line in dataflash(SHORT).decode().splitlines():
            lines.append(line)
            cells = line.split(", ")
            if cells[0] == "GPS" and not (cells[2] == "0" and len(lines) > 12):
                hacc, vacc = ("0.40", "0.80") if cells[2] == "0" else ("9.00", "9.00")
                lines.append(f"GPA, {cells[1]}, {cells[2]}, 1.10, {hacc}, {vacc}, 0.2, 0, 1, 0, 0, 0, 0, 0")
        log = read("\n".join(lines), **OF_SEA, instance=0)
        assert log.sigmas is not None
        assert log.sigmas[0] == pytest.approx([0.4, 0.4, 0.8])
        assert np.isnan(log.sigmas[-1]).all()
        assert read("\n".join(lines), **OF_SEA, instance=1).sigmas == pytest.approx(np.full((2, 3), 9.0))
        assert read(dataflash(SHORT), **OF_SEA, instance=0).sigmas is None


def test_an_accuracy_that_is_added_to_an_exporters_columns_counts() -> None:
    """As in a plain log: one that is not plain is refused."""
    fields = tuple(field for field in GPS_OF_NOW if field[1] != "eph")
    text = px4_csv(SHORT, fields, gps_records(SHORT))
    header, *rows = (text if isinstance(text, str) else text.decode()).splitlines()
    added = [f"{header},position accuracy [m]", *(f"{line},3" for line in rows)]
    assert read("\n".join(added)).sigmas == pytest.approx(np.full((6, 3), 3.0))
    with pytest.raises(PathFileError, match="CEP looks like an accuracy of the positions"):
        read("\n".join([f"{header},CEP [m]", *added[1:]]))
