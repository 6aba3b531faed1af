"""Solutions of RTKLIB."""

import math
from datetime import UTC, datetime

import numpy as np
import pytest

from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import parse_instant
from bisar_budget.paths.log_places import LogKeys
from bisar_budget.paths.rtklib import read_solution
from tests.paths.flown import flight, stamp
from tests.paths.log_files import (
    METRES_A_DEGREE,
    SEPARATION,
    SIGMAS,
    calendar,
    solution,
    solution_in_x_y_z,
    week_and_second,
)

FLOWN = flight()
SHORT = flight(6)
# Half of the last digit, in each of three coordinates: 1e-9 deg and 1e-5 " of 111 km a degree, 0.1 mm of a height.
BY_DEGREES = math.hypot(0.5e-9 * METRES_A_DEGREE * math.sqrt(2), 0.5e-4)
BY_SECONDS = math.hypot(0.5e-5 / 3600 * METRES_A_DEGREE * math.sqrt(2), 0.5e-4)
BY_METRES = 0.5e-4 * math.sqrt(3)


def read(data: bytes, **keys: object) -> Log:
    return read_solution(data, "a.pos", LogKeys(**keys))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("data", "digits"),
    [
        (solution(FLOWN), BY_DEGREES),
        (solution(FLOWN, system="UTC"), BY_DEGREES),
        (solution(FLOWN, system="JST"), BY_DEGREES),
        (solution(FLOWN, week_and_second), BY_DEGREES),
        (solution(FLOWN, is_in_minutes=True), BY_SECONDS),
        (solution(FLOWN, separator=","), BY_DEGREES),
        (solution(FLOWN, separator="\t", is_in_minutes=True), BY_SECONDS),
        (solution_in_x_y_z(FLOWN, np.diag([1e-4, 1e-4, 4e-4])), BY_METRES),
    ],
)
def test_the_flight_is_where_it_was(data: bytes, digits: float) -> None:
    log = read(data)
    assert log.is_earth_fixed
    assert np.abs(log.places - FLOWN.places).max() < digits
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)  # 20 ms are written with three decimals
    begins = parse_instant(stamp(0))
    assert begins is not None
    assert log.start is not None
    assert log.start.since(begins) == pytest.approx(0, abs=1e-9)


def test_words_say_scale_and_qualities() -> None:
    assert read(solution(FLOWN)).words == (
        "RTKLIB solution (fix 490, float 11), 501 fixes over 10 s, UTC is GPS less 18 s"
    )
    assert read(solution(FLOWN, system="JST")).words == "RTKLIB solution (fix 490, float 11), 501 fixes over 10 s"


@pytest.mark.parametrize("latitude", [-0.25, -33.6])
def test_the_sign_is_that_of_the_degrees(latitude: float) -> None:
    """-0 15' is south of the equator: `deg2dms` of RTKLIB writes the sign before a zero."""
    flown = SHORT._replace(latitude=np.full(6, math.radians(latitude)) + 1e-6 * SHORT.times)
    by_degrees, by_minutes = (read(solution(flown, is_in_minutes=one)) for one in (False, True))
    assert (by_degrees.places[:, 2] < 0).all()
    assert np.abs(by_minutes.places - by_degrees.places).max() < BY_SECONDS + BY_DEGREES


def test_sigmas_are_those_of_the_columns() -> None:
    assert read(solution(SHORT)).sigmas == pytest.approx(np.tile(SIGMAS, (6, 1)))
    assert read(solution(SHORT, sigmas=(0.0, 0.0, 0.0))).sigmas is None


def test_a_sigma_of_0_takes_nothing_from_the_others() -> None:
    assert read(solution(SHORT, sigmas=(3.0, 2.0, 0.0))).sigmas == pytest.approx(
        np.tile((3.0, 2.0, np.nan), (6, 1)), nan_ok=True
    )


def test_sigmas_along_x_y_z_are_turned_with_their_covariance() -> None:
    """The same matrix, turned by a rotation that is written down here from geocentric angles of the place itself."""
    east_north_up = np.array([[4.0, 1.0, -1.5], [1.0, 9.0, 2.0], [-1.5, 2.0, 25.0]]) * 1e-4
    latitude, longitude = float(SHORT.latitude[0]), float(SHORT.longitude[0])
    turn_z = np.array(
        [[-math.sin(longitude), math.cos(longitude), 0], [-math.cos(longitude), -math.sin(longitude), 0], [0, 0, 1]]
    )
    tilt = np.array(
        [[1, 0, 0], [0, math.sin(latitude), math.cos(latitude)], [0, -math.cos(latitude), math.sin(latitude)]]
    )
    turn = tilt @ turn_z  # from x, y, z to east, north, up
    sigmas = read(solution_in_x_y_z(SHORT, turn.T @ east_north_up @ turn)).sigmas
    assert sigmas is not None
    assert sigmas[0] == pytest.approx([0.02, 0.03, 0.05], rel=1e-4)  # roots are written to 1e-8 m


def test_heights_above_the_geoid_need_its_separation() -> None:
    data = solution(FLOWN, height="geodetic")
    assert np.abs(read(data, geoid_separation=SEPARATION).places - FLOWN.places).max() < BY_DEGREES
    with pytest.raises(PathFileError, match=r"^a\.pos: has heights above mean sea level, and no geoid sep") as error:
        read(data)
    assert error.value.accepted.startswith("accepted: trajectory.geoid_separation: 47 m")


def test_midnight_and_the_end_of_a_week_are_moments_like_others() -> None:
    start = datetime(2026, 6, 6, 23, 59, 38, tzinfo=UTC)  # 4 s before GPS week 2422
    by_date = read(solution(FLOWN, calendar("GPST", start)))

    def weekly(seconds: float) -> str:
        second = 604796.0 + seconds
        return f"{2421 + int(second // 604800)} {second % 604800:.3f}"

    by_week = read(solution(FLOWN, weekly))
    for log in (by_date, by_week):
        assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
        assert log.start is not None
        assert log.start.as_text() == "2026-06-06T23:59:38.000Z"
    assert read(solution(FLOWN, calendar("JST", start), system="JST")).times == pytest.approx(FLOWN.times, abs=1e-9)


TEXT = solution(SHORT).decode()
HEAD, *ROWS = TEXT.splitlines(keepends=True)[2:]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "a.pos: has no solution"),
        (HEAD, "a.pos: has no solution"),
        (ROWS[0], "a.pos:1: no line that begins with '%  GPST', UTC or JST names the columns before it"),
        (HEAD + ROWS[0], "a.pos: has no line of % that says whether heights are above the ellipsoid or the geoid"),
        (TEXT.replace("WGS84/", "Tokyo/"), "a.pos: has positions of the datum Tokyo"),
        (TEXT.replace(" 3000.0000", ""), "a.pos:4: has 14 cells, the columns need 15"),
        (TEXT.replace("height(m)", "heigth(m)"), "a.pos:3: names no column height(m)"),
        (TEXT.replace("3000.0000", "3000.0O00", 1), "a.pos:4: must have numbers behind the time (got '3000.0O00')"),
        (TEXT.replace("3000.0000", "3_000.000", 1), "a.pos:4: must have numbers behind the time (got '3_000.000')"),
        (TEXT.replace("3000.0000", "nan", 1), "a.pos:4: height nan m is beyond -12 … 100 km"),
        (TEXT.replace("48.", "98.", 1), "a.pos:4: latitude 98."),
        (
            TEXT.replace("0.0080", "-0.008", 1),
            "a.pos:4: standard deviations must be from 0 to 100000 m (got -0.008, ",
        ),
        (
            TEXT.replace("2026/06/01", "2026/13/01", 1),
            "a.pos:4: must begin with a time like 2026/06/01 05:20:19.250 (got '2026/13/01 05:20:19.250')",
        ),
        (
            solution(SHORT, lambda t: f"-1 {t:.3f}").decode(),
            "a.pos:4: must begin with a GPS week and its second, like 2421 105619.250 (got '-1 0.000')",
        ),
        (TEXT + ROWS[2], "a.pos:10: time 2026-06-01T05:20:01.290Z is not after 2026-06-01T05:20:01.350Z of line 9"),
        (TEXT + HEAD.replace("GPST", "UTC "), "a.pos:10: names other columns than the lines before"),
        (
            "%  UTC   e-baseline(m)  n-baseline(m)  u-baseline(m)   Q  ns\n",
            "a.pos:1: has baselines from a base station, no positions",
        ),
        (TEXT.replace("d", "\x00", 1).replace("3000", "\xff"), "a.pos:4: must have numbers behind the time (got "),
    ],
)
def test_faults_have_lines(text: str, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(text.encode())
    assert str(error.value).startswith(says)


@pytest.mark.parametrize(
    ("keys", "key"), [({"time_scale": "utc"}, "time_scale"), ({"geoid_separation": 47.0}, "geoid_separation")]
)
def test_what_the_file_says_itself_is_not_said_otherwise(keys: dict[str, object], key: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(TEXT.encode(), **keys)
    assert error.value.key == key
    assert read(TEXT.encode(), time_scale="gps").start is not None


def test_places_without_a_solution_are_left_out() -> None:
    lines = TEXT.splitlines(keepends=True)
    lines[5] = lines[5].replace(" 1 12", " 0 0")
    assert len(read("".join(lines).encode()).times) == 5
