"""SBET trajectories and their accuracy files."""

import math
import re
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bisar_budget.paths import sbet as reader
from bisar_budget.paths.flight import PathFileError, slow_times
from bisar_budget.paths.flight_log import read_csv
from bisar_budget.paths.instant import Instant, parse_instant
from bisar_budget.paths.log_places import NO_KEYS, LogKeys, utc_of
from bisar_budget.paths.path_formats import LOG_FORMATS
from bisar_budget.paths.sbet import WEEK_S, of_gps, read_accuracy, read_sbet
from tests.conftest import examples
from tests.paths.flown import SECOND, START, Flight, flight, geodetic_csv, sbet, smrmsg, stamp
from tests.paths.flown import WEEK as GPS_WEEK

FLOWN = flight()
SHORT = flight(6)


def instant(text: str) -> Instant:
    found = parse_instant(text)
    assert found is not None
    return found


@pytest.mark.parametrize("wander", [-3.0, -0.3, 0.0, 0.3, 2.0])
def test_a_level_flight_is_where_it_was(wander: float) -> None:
    """Doubles of radians are exact; rounding of an Earth-fixed place is 1e-9 m."""
    log = read_sbet(sbet(FLOWN, wander), "a.out", LogKeys(GPS_WEEK))
    assert log.is_earth_fixed
    assert np.abs(log.places - FLOWN.places).max() < 5e-9
    assert log.times == pytest.approx(FLOWN.times, abs=2e-11)  # rounding of 1e5 s
    assert log.start == instant(START.strftime("%Y-%m-%dT%H:%M:%S.%fZ"))
    assert log.words == "SBET, 501 fixes over 10 s, UTC is GPS less 18 s"
    by_csv = read_csv(geodetic_csv(FLOWN), "b.csv")
    assert by_csv.start == log.start
    assert np.abs(log.places - by_csv.places).max() < 5e-9


def test_without_a_week_times_are_seconds_of_it() -> None:
    log = read_sbet(sbet(FLOWN), "a.out", NO_KEYS)
    assert log.start is None
    assert log.times == pytest.approx(SECOND + FLOWN.times, abs=1e-10)
    assert log.words == "SBET, 501 fixes over 10 s"


REAL = """
1.516310028360710e+05 5.680211852972264e-01 -2.041654392303940e+00 1.077152953296560e+02
-2.332420866600025e+00 -3.335067504871401e-01 -3.093961631767838e-02
-2.813407149321339e-02 -2.429905393889139e-02 3.046773230278662e+00 -2.198414736922658e-02
7.859639737752390e-01 7.849084719295495e-01 -2.978807916450262e-01
6.226807982589819e-05 9.312162756440178e-03 7.217812320996525e-02

1.516310078318641e+05 5.680211834722869e-01 -2.041654392034053e+00 1.077151424357507e+02
-2.336228229691271e+00 -3.324663118952635e-01 -3.022948961008987e-02
-2.813856631423094e-02 -2.425215669392169e-02 3.047131105236811e+00 -2.198416007932108e-02
8.397590491636475e-01 3.252165276637165e-01 -1.558883225990844e-01
8.379685112283802e-04 7.372886784718076e-03 7.179027672314571e-02
"""


def test_a_real_flight_has_the_wander_frame() -> None:
    """Two records that PDAL tests its reader with (`test/data/sbet/2-points.sbet`), 5 ms apart.

    From latitude, longitude and height it moves by 2.32 m/s to the south, 0.29 m/s to the east and 0.031 m/s down.
    The velocities say the same to 0.03 m/s as x north, y west, z up, turned to the west by the wander angle. Turned
    to the east they would be 0.09 m/s off, and with y to the east 0.6 m/s.
    """
    records = [[float(word) for word in text.split()] for text in REAL.strip().split("\n\n")]
    data = b"".join(struct.pack("<17d", *record) for record in records)
    log = read_sbet(data, "2-points.sbet", NO_KEYS)
    step = (log.places[1] - log.places[0]) / (log.times[1] - log.times[0])
    latitude, longitude = records[0][1:3]
    east = np.array([-math.sin(longitude), math.cos(longitude), 0])
    up = np.array(
        [math.cos(latitude) * math.cos(longitude), math.cos(latitude) * math.sin(longitude), math.sin(latitude)]
    )
    north = np.cross(up, east)
    x, y, z = np.mean([record[4:7] for record in records], axis=0)
    wander = records[0][10]

    def apart(turn: float, west: int) -> float:
        along = x * math.cos(turn) - y * math.sin(turn)
        aside = x * math.sin(turn) + y * math.cos(turn)
        return float(np.linalg.norm(step - (along * north - west * aside * east + z * up)))

    assert apart(wander, 1) < 0.03
    assert apart(-wander, 1) > 0.09
    assert apart(wander, -1) > 0.5
    assert apart(-wander, -1) > 0.5


@pytest.mark.parametrize(
    ("week", "second", "utc"),
    [
        # Leap seconds of IERS Bulletin C; weeks are whole weeks since 1980-01-06.
        (0, 0.0, "1980-01-06T00:00:00Z"),
        (77, 259200.5, "1981-07-01T00:00:00.5Z"),  # the leap second itself: no instant has its name
        (77, 259201.5, "1981-07-01T00:00:00.5Z"),
        (1930, 16.5, "2016-12-31T23:59:59.5Z"),
        (1930, 18.0, "2017-01-01T00:00:00Z"),
        (1930, 17.5, "2017-01-01T00:00:00.5Z"),
        (2421, 105619.25, "2026-06-01T05:20:01.25Z"),
        (2421, WEEK_S + 18, "2026-06-07T00:00:00Z"),
    ],
)
def test_gps_time_is_ahead_of_utc(week: int, second: float, utc: str) -> None:
    assert utc_of(of_gps(week, second), "gps").since(instant(utc)) == pytest.approx(0, abs=1e-9)


def test_leap_seconds_that_nobody_knows_are_said() -> None:
    assert read_sbet(sbet(SHORT), "a.out", LogKeys(2700)).words.endswith(
        "UTC is GPS less 18 s if there was no leap second since"
    )
    assert read_sbet(sbet(SHORT), "a.out", LogKeys(1000)).words.endswith("UTC is GPS less 13 s")  # from 1999 on


@pytest.mark.parametrize("is_counted_on", [False, True])
def test_a_week_ends_in_flight(is_counted_on: bool) -> None:
    times = WEEK_S - 5 + FLOWN.times
    data = sbet(FLOWN, time=times if is_counted_on else times % WEEK_S)
    log = read_sbet(data, "a.out", LogKeys(GPS_WEEK))
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
    assert log.start == utc_of(of_gps(GPS_WEEK, WEEK_S - 5), "gps")
    assert read_sbet(data, "a.out", NO_KEYS).times == pytest.approx(times, abs=1e-9)


def changed(record: int, field: str, value: float) -> dict[str, Any]:
    """One value of a flight of six records, replaced."""
    values = {
        "time": SECOND + SHORT.times,
        "latitude": SHORT.latitude,
        "longitude": SHORT.longitude,
        "height": SHORT.height,
        "y": np.zeros(6),
        "wander": np.full(6, 0.3),
    }[field].copy()
    values[record - 1] = value
    return {field: values}


BIG = b"".join(struct.pack(">17d", *row) for row in struct.iter_unpack("<17d", sbet(SHORT)))
NOT_SO = "which it cannot be; are these records of 17 doubles?"


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is empty"),
        (sbet(SHORT)[:-1], "ends at byte 815, 135 into record 6; each has 136 bytes"),
        (sbet(SHORT) + b"\0", "ends at byte 817, 1 into record 7; each has 136 bytes"),
        (b"time [s]", "ends at byte 8, 8 into record 1; each has 136 bytes"),
        (
            BIG,
            f"record 1: time is {struct.unpack('<d', BIG[:8])[0]:.6g} s; "
            "the doubles are big-endian, they should be little-endian",
        ),
        (
            sbet(SHORT, time=1.46e9 + SHORT.times),
            "record 1: time is 1.46e+09 s; it should count from the start of the GPS week",
        ),
        (sbet(SHORT, **changed(2, "time", -1.0)), f"record 2: time is -1 s, {NOT_SO}"),
        (sbet(SHORT, **changed(4, "time", math.nan)), f"record 4: time is nan s, {NOT_SO}"),
        (sbet(SHORT, latitude=np.degrees(SHORT.latitude)), "record 1: latitude is 48.1324 rad; is it in degrees?"),
        (sbet(SHORT, longitude=np.degrees(SHORT.longitude)), "record 1: longitude is 11.2758 rad; is it in degrees?"),
        (sbet(SHORT, **changed(5, "latitude", math.inf)), f"record 5: latitude is inf rad, {NOT_SO}"),
        (sbet(SHORT, **changed(3, "height", 1e6)), f"record 3: height is 1e+06 m, {NOT_SO}"),
        (sbet(SHORT, **changed(3, "y", -1e300)), f"record 3: y velocity is -1e+300 m/s, {NOT_SO}"),
        (sbet(SHORT, **changed(6, "wander", 17.0)), f"record 6: wander angle is 17 rad, {NOT_SO}"),
        (
            sbet(SHORT, **changed(3, "time", SECOND + 0.02)),
            "record 3: time 105619.27 s is not after 105619.27 s of record 2; times must rise",
        ),
        (
            sbet(SHORT, **changed(3, "time", SECOND - 1)),
            "record 3: time 105618.25 s is not after 105619.27 s of record 2; times must rise",
        ),
        (
            sbet(FLOWN, x=30.0, y=0.0),
            "moves at 58.85 m/s by its positions, at 30 m/s by its velocities; "
            "units or fields are others than those of an SBET",
        ),
        (
            sbet(flight(501, 5.0)._replace(times=FLOWN.times)),
            "moves at 588.5 m/s by its positions, at 58.85 m/s by its velocities; "
            "units or fields are others than those of an SBET",
        ),
        (
            # East for west, of which it has 38.4 m/s.
            sbet(FLOWN._replace(velocities=FLOWN.velocities * [-1, 1, 1])),
            "has velocities 76.8 m/s off the motion of its positions, at the same speed; "
            "they are not along x, y, z of the wander frame, x north, y west, z up at a wander angle of 0. "
            "A log in CSV needs no velocities",
        ),
        (
            # The wander angle's other sign: 2 sin(0.3) of the speed.
            sbet(FLOWN, 0.3, wander=-0.3),
            "has velocities 34.8 m/s off the motion of its positions, at the same speed; "
            "they are not along x, y, z of the wander frame, x north, y west, z up at a wander angle of 0. "
            "A log in CSV needs no velocities",
        ),
    ],
)
def test_faults_have_records(data: bytes, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_sbet(data, "flight.out", NO_KEYS)
    assert str(error.value) == f"flight.out: {says}"


def test_a_small_wander_angle_is_honoured() -> None:
    """At 59 m/s, 2 degrees the wrong way are 4 m/s."""
    angle = math.radians(2)
    read_sbet(sbet(FLOWN, angle), "flight.out", NO_KEYS)
    with pytest.raises(PathFileError, match="wander frame"):
        read_sbet(
            sbet(FLOWN, angle).replace(struct.pack("<d", angle), struct.pack("<d", -angle)),
            "flight.out",
            NO_KEYS,
        )


def test_velocities_that_are_not_there_are_not_compared() -> None:
    assert len(read_sbet(sbet(FLOWN, x=0, y=0, z=0), "a.out", NO_KEYS).times) == 501
    assert len(read_sbet(sbet(flight(1)), "a.out", NO_KEYS).times) == 1


def test_noise_of_places_is_no_disagreement() -> None:
    """5 cm between samples 20 ms apart look like 3.5 m/s, over a second like 0.07 m/s."""
    noise = np.random.default_rng(3).normal(0, 0.05, (3, 501))
    noisy = FLOWN._replace(
        latitude=FLOWN.latitude + noise[0] / 6.4e6,
        longitude=FLOWN.longitude + noise[1] / 4.3e6,
        height=FLOWN.height + noise[2],
    )
    read_sbet(sbet(noisy), "a.out", NO_KEYS)


def test_longitude_jumps_by_a_turn() -> None:
    west = FLOWN._replace(longitude=FLOWN.longitude - FLOWN.longitude[250] + math.pi)
    wrapped = west._replace(
        longitude=np.where(west.longitude > math.pi, west.longitude - 2 * math.pi, west.longitude)
    )
    a, b = (read_sbet(sbet(one), "a.out", NO_KEYS).places for one in (west, wrapped))
    assert np.abs(a - b).max() < 5e-9


def test_a_file_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "MAX_SBET_BYTES", 100)
    says = r"^a.out: has 0 MB, at most 0 MB are read$"
    with pytest.raises(PathFileError, match=says):
        read_sbet(sbet(SHORT), "a.out", NO_KEYS)
    with pytest.raises(PathFileError, match=says):
        read_accuracy(smrmsg(SHORT.times), "a.out", None, None, None, 1.0)


TIMES = np.arange(21.0)  # s; an smrmsg has a record a second


def test_the_worst_sigmas_of_the_aperture_count() -> None:
    north = np.full(21, 0.02)
    north[[3, 9, 17]] = 0.5, 0.04, 0.6  # the outer ones are outside
    rates = (np.where(TIMES == 13, 0.009, 0.004), 0.005, np.where(TIMES == 14, 0.5, 0.006))
    data = smrmsg(TIMES, north=north, rates=rates)
    by_utc = read_accuracy(data, "a.out", GPS_WEEK, instant(stamp(10.5)), None, 5.0)
    # 8 s to 13 s, and records at both ends.
    assert by_utc.position == (0.03, 0.04, 0.05)
    assert by_utc.velocity == (0.005, 0.009, 0.006)
    assert by_utc.records == 6
    assert read_accuracy(data, "a.out", None, None, SECOND + 10.5, 5.0) == by_utc
    # An aperture between two records has both.
    assert read_accuracy(data, "a.out", None, None, SECOND + 10.5, 0.2).records == 2
    assert read_accuracy(data, "a.out", None, None, SECOND + 8.5, 0.2).position[1] == 0.04


def test_an_error_of_zero_all_over_the_aperture_is_no_accuracy() -> None:
    """Zeros of a file that nobody filled in declared that the trajectory has no error at all."""
    for zeros, says in (
        ({"north": 0}, "north position RMS"),
        ({"rates": (0.1, 0, 0)}, "east velocity RMS, down velocity RMS"),
        ({"down": np.where(TIMES < 14, 0, 0.05)}, "down position RMS"),
    ):
        with pytest.raises(PathFileError) as error:
            read_accuracy(smrmsg(TIMES, **zeros), "a.out", None, None, SECOND + 10.5, 5.0)
        assert str(error.value) == f"a.out: {says}: 0 in the whole aperture; no trajectory is without error"
    one = smrmsg(TIMES, down=np.where(TIMES < 13, 0, 0.05))  # the record at the end of the aperture is not zero
    assert read_accuracy(one, "a.out", None, None, SECOND + 10.5, 5.0).position == (0.03, 0.02, 0.05)


@pytest.mark.parametrize(
    ("data", "center", "says"),
    [
        (b"", 10.0, "is empty"),
        (smrmsg(TIMES[:19])[:-8], 10.0, "ends at byte 1512, 72 into record 19; each has 80 bytes"),
        (
            smrmsg(TIMES, north=-0.02),
            10.0,
            "record 1: north position RMS is -0.02 m, which it cannot be; are these records of 10 doubles?",
        ),
        (
            smrmsg(TIMES, rates=(0.1, 0.1, np.where(TIMES == 4, np.nan, 0.1))),
            4.5,
            "record 5: down velocity RMS is nan m/s, which it cannot be; the record lies within the 5 s around "
            "mid-aperture that are used",
        ),
        (
            smrmsg(TIMES),
            19.0,
            "covers 105619.25 s to 105639.25 s, the aperture needs 105635.75 s to 105640.75 s",
        ),
        (
            smrmsg(np.delete(TIMES, slice(8, 14))),
            10.0,
            "has a gap of 7 s after 105626.25 s, in the aperture; 1 s is usual, at most 5 s are bridged",
        ),
        (
            sbet(flight(10)),
            10.0,
            "is an SBET, a trajectory",
        ),
    ],
)
def test_faults_of_accuracy_have_records(data: bytes, center: float, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_accuracy(data, "smrmsg.out", None, None, SECOND + center, 5.0)
    assert str(error.value) == f"smrmsg.out: {says}"


def test_a_record_of_accuracy_far_away_is_left_out() -> None:
    far = smrmsg(TIMES, rates=(0.1, 0.1, np.where(TIMES == 4, np.nan, 0.1)))
    known = (None, None, SECOND + 12.0, 5.0)
    assert read_accuracy(far, "smrmsg.out", *known) == read_accuracy(
        smrmsg(TIMES, rates=0.1 * np.ones(3)), "", *known
    )
    assert read_accuracy(smrmsg(TIMES)[:-8], "smrmsg.out", *known).records == 7


def held_to_its_word(data: bytes) -> None:
    """Both readers: a result of finite numbers, or an error that names the file."""
    try:
        log = read_sbet(data, "a.out", LogKeys(GPS_WEEK))
        assert np.isfinite(log.places).all()
        assert (np.diff(log.times) > 0).all()
        slow_times(log, log.start, None, 1.0, "a.out")
    except PathFileError as error:
        assert re.match("a.out: ", str(error))
    try:
        found = read_accuracy(data, "a.out", None, None, SECOND + 3, 2.0)
        assert all(0 <= one < 1e5 for one in found.position + found.velocity)
    except PathFileError as error:
        assert re.match("a.out: ", str(error))


@given(st.binary(max_size=80) | st.binary(min_size=136, max_size=136) | st.binary(min_size=680, max_size=680))
def test_any_bytes(data: bytes) -> None:
    held_to_its_word(data)


SIGNALLING_NAN = b"\x01\0\0\0\0\0\xf0\x7f"


@examples(200)
@given(
    st.sampled_from([sbet(flight(10)), smrmsg(TIMES[:17])]),
    st.lists(
        st.tuples(
            st.integers(0, 169),
            st.floats().map(lambda value: struct.pack("<d", value))
            | st.binary(min_size=8, max_size=8)
            | st.sampled_from([SIGNALLING_NAN, b"", b"\0"]),
        ),
        min_size=1,
        max_size=4,
    ),
)
@example(sbet(flight(10)), [(0, SIGNALLING_NAN), (11, SIGNALLING_NAN)])
def test_damaged_files(data: bytes, changes: list[tuple[int, bytes]]) -> None:
    for at, new in changes:
        data = data[: 8 * at] + new + data[8 * at + 8 :]
    held_to_its_word(data)


@given(st.lists(st.lists(st.floats(-100, 100), min_size=17, max_size=17), min_size=1, max_size=4))
def test_any_plausible_records(rows: list[list[float]]) -> None:
    held_to_its_word(b"".join(struct.pack("<17d", *row) for row in rows))


def test_flights_of_this_file_fly() -> None:
    """The velocities that its files log are those of its places, by another way than the reader's."""
    steps = np.linalg.norm(np.diff(FLOWN.places, axis=0), axis=1) / 0.02
    assert np.linalg.norm(FLOWN.velocities, axis=1)[1:] == pytest.approx(steps, rel=1e-5)
    assert isinstance(FLOWN, Flight)


@pytest.mark.parametrize(("scale", "is_its_own"), [("gps", True), ("tai", False), ("utc", False)])
def test_a_mission_file_may_say_no_other_time_than_the_log_counts(scale: str, is_its_own: bool) -> None:
    keys = LogKeys(week=GPS_WEEK, time_scale=scale)
    if is_its_own:
        assert LOG_FORMATS["sbet"].read(sbet(SHORT), "a.out", keys).times.size == 6
        return
    with pytest.raises(PathFileError, match=r"^a\.out: counts in GPST, and trajectory\.time_scale says"):
        LOG_FORMATS["sbet"].read(sbet(SHORT), "a.out", keys)
