"""Logs of PX4."""

import io
import math
import struct
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.paths.earth import Geodetic, earth_fixed
from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import Instant, parse_instant
from bisar_budget.paths.log_places import LogKeys
from bisar_budget.paths.ulog import read_ulog
from tests.paths.flown import flight, stamp
from tests.paths.log_files import (
    GLOBAL,
    GPS_OF_NOW,
    GPS_OF_OLD,
    METRES_A_DEGREE,
    SEPARATION,
    global_records,
    gps_records,
    message,
    topic,
    ulog,
)

FLOWN = flight()
SLOW = flight(51, 5.0)
SHORT = flight(6)
# Half of 1e-7 deg of 111 km a degree in two coordinates and of 1 mm; doubles of degrees, 7e-15 deg; floats of 3000 m.
OLD = math.hypot(0.5e-7 * METRES_A_DEGREE * math.sqrt(2), 0.5e-3)
NOW = 1e-8
FLOATS = 1.3e-4


def read(data: bytes, **keys: object) -> Log:
    return read_ulog(data, "a.ulg", LogKeys(**keys))  # type: ignore[arg-type]


def since_start(log: Log) -> float:
    begins = parse_instant(stamp(0))
    assert begins is not None
    assert log.start is not None
    return log.start.since(begins)


class TestAccuracy:
    @pytest.mark.parametrize("name", ["sensor_gps", "vehicle_global_position"])
    @pytest.mark.parametrize(("eph", "epv"), [(30.0, 45.0), (0.02, 0.03)])
    def test_eph_and_epv_are_sigmas(self, name: str, eph: float, epv: float) -> None:
        """Whether they are 30 m beside a fix in three dimensions, or 2 cm."""
        fields, records = (GPS_OF_NOW, gps_records) if name == "sensor_gps" else (GLOBAL, global_records)
        stated = [{**one, "eph": eph, "epv": epv} for one in records(SHORT)]
        log = read(ulog(topic(name, (*fields, ("float", "eph"), ("float", "epv")), 7, stated)))
        assert log.sigmas == pytest.approx(np.tile([eph, eph, epv], (6, 1)))

    @pytest.mark.parametrize("fields", [GPS_OF_OLD, (("float", "epv"), *GPS_OF_OLD)])
    def test_eph_alone_counts_along_every_axis(self, fields: tuple) -> None:
        stated = [{**one, "eph": 30.0} for one in gps_records(SHORT)]
        assert read(ulog(topic("sensor_gps", fields, 7, stated))).sigmas == pytest.approx(np.full((6, 3), 30))

    @pytest.mark.parametrize("eph", [0.0, -1.0, math.nan])
    def test_what_is_not_positive_is_not_known(self, eph: float) -> None:
        stated = [{**one, "eph": eph if number else 2.0} for number, one in enumerate(gps_records(SHORT))]
        sigmas = read(ulog(topic("sensor_gps", GPS_OF_OLD, 7, stated))).sigmas
        assert sigmas is not None
        assert sigmas[0] == pytest.approx([2, 2, 2])
        assert np.isnan(sigmas[1:]).all()
        assert read(ulog(topic("sensor_gps", GPS_OF_OLD, 7, gps_records(SHORT)))).sigmas is None


@pytest.mark.parametrize(
    ("name", "fields", "digits"),
    [("vehicle_gps_position", GPS_OF_OLD, OLD), ("sensor_gps", GPS_OF_OLD, OLD), ("sensor_gps", GPS_OF_NOW, NOW)],
)
def test_the_gps_topic_is_where_the_flight_was(name: str, fields: tuple, digits: float) -> None:
    log = read(ulog(topic(name, fields, 7, gps_records(FLOWN, late=0.1))))
    assert np.abs(log.places - FLOWN.places).max() < digits
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)  # microseconds
    assert since_start(log) == pytest.approx(0, abs=1e-9)
    assert log.words == f"ULog {name}, 501 fixes over 10 s"


def test_the_global_position_has_the_utc_of_the_gps_topic() -> None:
    """The autopilot's clock is 20 s at the start, and fixes arrive 0.1 s late: as if UTC were 0.1 s behind."""
    gps = topic("vehicle_gps_position", GPS_OF_OLD, 3, gps_records(SLOW, late=0.1))
    own = topic("vehicle_global_position", GLOBAL, 4, global_records(FLOWN))
    log = read(ulog(gps, own))
    assert np.abs(log.places - FLOWN.places).max() < FLOATS
    assert since_start(log) == pytest.approx(-0.1, abs=1e-6)
    assert log.times == pytest.approx(FLOWN.times, abs=1e-9)
    assert log.words == "ULog vehicle_global_position, UTC of vehicle_gps_position to 0 s, 501 fixes over 10 s"
    by_seconds = read(ulog(own))
    assert by_seconds.start is None
    assert by_seconds.times == pytest.approx(20 + FLOWN.times, abs=1e-9)
    assert "since the start of the autopilot" in by_seconds.words


def test_the_separation_of_the_gps_topic_serves_the_global_position() -> None:
    above_sea = tuple(field for field in GLOBAL if field[1] != "alt_ellipsoid")
    own = topic("vehicle_global_position", above_sea, 4, global_records(FLOWN))
    gps = topic("vehicle_gps_position", GPS_OF_OLD, 3, gps_records(SLOW))
    assert np.abs(read(ulog(own, gps)).places - FLOWN.places).max() < FLOATS + 1e-3  # the separation is of 1 mm
    assert np.abs(read(ulog(own), geoid_separation=SEPARATION).places - FLOWN.places).max() < FLOATS
    with pytest.raises(PathFileError, match=r"heights above mean sea level, and no geoid separation"):
        read(ulog(own))


def test_the_topic_with_more_places_counts() -> None:
    gps = topic("sensor_gps", GPS_OF_NOW, 3, gps_records(FLOWN))
    own = topic("vehicle_global_position", GLOBAL, 4, global_records(SLOW))
    without_fix = topic("vehicle_gps_position", GPS_OF_OLD, 5, gps_records(flight(900), fix=2))
    assert read(ulog(own, without_fix, gps)).words.startswith("ULog sensor_gps")


def test_one_of_several_receivers_is_chosen() -> None:
    """Raw fixes of two; the autopilot's own estimate needs no choice."""
    far = FLOWN._replace(latitude=FLOWN.latitude + 1e-3)
    first = topic("sensor_gps", GPS_OF_NOW, 3, gps_records(FLOWN))
    second = topic("sensor_gps", GPS_OF_NOW, 4, gps_records(far), instance=1)
    both = ulog(first, second)
    with pytest.raises(PathFileError) as error:
        read(both)
    assert str(error.value) == "a.ulg: has fixes of 2 receivers: of the instances 0 with 501, 1 with 501"
    logs = [read(both, instance=instance) for instance in (0, 1)]
    assert np.abs(logs[0].places - FLOWN.places).max() < NOW
    assert np.linalg.norm(logs[1].places - FLOWN.places, axis=1) == pytest.approx(np.full(501, 6.37e3), rel=0.01)
    assert logs[1].words == "ULog sensor_gps, instance 1, 501 fixes over 10 s"
    with pytest.raises(PathFileError, match=r"has no fix of the instance 2") as error:
        read(both, instance=2)
    assert error.value.key == "instance"
    without_fix = topic("sensor_gps", GPS_OF_NOW, 4, gps_records(far, fix=2), instance=1)
    assert len(read(ulog(first, without_fix)).times) == 501
    own = topic("vehicle_global_position", GLOBAL, 5, global_records(flight(900)))
    assert read(ulog(own, first, second)).words.startswith("ULog vehicle_global_position")


def test_another_reader_finds_the_same() -> None:
    pyulog = pytest.importorskip("pyulog")
    data = ulog(topic("sensor_gps", GPS_OF_NOW, 3, gps_records(SHORT)))
    (found,) = pyulog.ULog(io.BytesIO(data)).data_list
    assert found.name == "sensor_gps"
    assert found.data["latitude_deg"] == pytest.approx(np.degrees(SHORT.latitude), abs=1e-12)
    assert found.data["time_utc_usec"][0] == round(
        datetime(2026, 6, 1, 5, 20, 1, 250000, tzinfo=UTC).timestamp() * 1e6
    )


def test_a_file_that_power_cut_off_has_what_is_whole() -> None:
    data = ulog(topic("sensor_gps", GPS_OF_NOW, 3, gps_records(SHORT)))
    assert len(read(data[:-5]).times) == 5
    assert len(read(data + message("D", bytes(60))[:20]).times) == 6


def test_records_without_a_place_are_left_out() -> None:
    valid = (*GLOBAL, ("bool", "lat_lon_valid"), ("bool", "alt_valid"))
    records = [{**one, "lat_lon_valid": n > 1, "alt_valid": n > 2} for n, one in enumerate(global_records(SHORT))]
    assert len(read(ulog(topic("vehicle_global_position", valid, 4, records))).times) == 3
    records = [{**one, "time_utc_usec": one["time_utc_usec"] * (n > 0)} for n, one in enumerate(gps_records(SHORT))]
    assert len(read(ulog(topic("sensor_gps", GPS_OF_NOW, 4, records))).times) == 5


GOOD = ulog(topic("sensor_gps", GPS_OF_NOW, 3, gps_records(SHORT)))
NAMED = GOOD.index(b"A\0\3\0sensor_gps") - 2  # where the topic gets its number
BOMB = (
    message("F", b"sensor_gps:a[60000] x;") + message("F", b"a:b[60000] x;") + message("F", b"b:sensor_gps[9999] x;")
)


def renamed(*changes: tuple[str, str]) -> bytes:
    fields = GPS_OF_NOW
    for before, after in changes:
        fields = tuple((kind if name != before else after, name) for kind, name in fields)
    return ulog(topic("sensor_gps", fields, 3, gps_records(SHORT)))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "a.ulg: is no ULog: it does not begin with 'ULog'"),
        (b"ULog\x01\x12\x35", "a.ulg: has no position"),
        (ulog(), "a.ulg: has no position"),
        (ulog(topic("sensor_gps", GPS_OF_NOW, 3, gps_records(SHORT, fix=0))), "a.ulg: has no position"),
        (
            GOOD.replace(b"time_utc_usec;", b"time_utc_used;"),
            f"a.ulg: byte {NAMED}: sensor_gps has no field time_utc_usec",
        ),
        (
            GOOD.replace(b"latitude_deg;", b"latitude_rad;"),
            f"a.ulg: byte {NAMED}: sensor_gps has no field of a latitude and",
        ),
        (
            renamed(("time_utc_usec", "double")),
            f"a.ulg: byte {NAMED - 2}: field time_utc_usec of sensor_gps has the type <f8",
        ),
        (
            GOOD[:16] + message("B", bytes(8) + b"\x03" + bytes(31)),
            "a.ulg: byte 16: has flags 0300000000000000 of a ",
        ),
        (GOOD[:200] + bytes(200) + GOOD[200:], "a.ulg: byte "),
        (
            GOOD[:16] + BOMB + message("A", b"\0\3\0sensor_gps"),
            f"a.ulg: byte {16 + len(BOMB)}: field 'x' of sensor_gps has no type of which the size is known",
        ),
        (
            GOOD[:16] + message("F", b"sensor_gps:uint8_t[99999999999] x;") + message("A", b"\0\3\0sensor_gps"),
            "a.ulg: byte 53: field 'x' of sensor_gps has no type of which the size is known",
        ),
        (
            GOOD + message("D", struct.pack("<H", 3) + bytes(9)),
            f"a.ulg: byte {len(GOOD)}: a record of sensor_gps is cut off",
        ),
        (ulog(topic("sensor_gps", GPS_OF_NOW, 3, [*gps_records(SHORT)][::-1])), "a.ulg: record 2: time 2026-06-01T"),
        (
            ulog(
                topic("sensor_gps", GPS_OF_NOW, 3, [{**one, "latitude_deg": math.nan} for one in gps_records(SHORT)])
            ),
            "a.ulg: record 1: latitude nan deg is beyond 90 deg",
        ),
    ],
)
def test_faults_have_places(data: bytes, says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(data)
    assert str(error.value).startswith(says)


def test_clocks_that_drift_apart_are_no_clock() -> None:
    records = [{**one, "timestamp": one["timestamp"] + 300_000 * n} for n, one in enumerate(gps_records(SLOW))]
    gps = topic("vehicle_gps_position", GPS_OF_OLD, 3, records)
    with pytest.raises(PathFileError, match=r"clocks of the GPS topic and of the autopilot drift apart by 7.2 s"):
        read(ulog(gps, topic("vehicle_global_position", GLOBAL, 4, global_records(FLOWN))))
    with pytest.raises(PathFileError, match=r"counts in UTC, and trajectory.time_scale says TAI"):
        read(GOOD, time_scale="tai")


def test_a_real_flight_is_where_another_reader_has_it() -> None:
    """Numbers of pyulog's own output of the file, see samples/README.md: a receiver at 5 Hz, 40 m of separation."""
    data = (Path(__file__).parent / "samples" / "px4_gps.ulg").read_bytes()
    log = read(data)
    assert len(log.times) == 32
    assert log.start is not None
    assert log.start.since(Instant(18738 + 40587, 0.0)) == pytest.approx(1618986658.600345 - 18738 * 86400, abs=1e-6)
    first, last = (earth_fixed(Geodetic(math.radians(a), math.radians(b), h)) for a, b, h in REAL)
    assert log.places[0] == pytest.approx(first, abs=1e-8)
    assert log.places[-1] == pytest.approx(last, abs=1e-8)
    assert log.times[-1] == pytest.approx(6.199996, abs=1e-9)
    pyulog = pytest.importorskip("pyulog")
    (found,) = pyulog.ULog(io.BytesIO(data)).data_list
    assert (found.data["lat"][0], found.data["lon"][0], found.data["alt_ellipsoid"][-1]) == (
        634170622,
        104082151,
        102929,
    )
    assert len(found.data["lat"]) == 32


REAL = ((63.4170622, 10.4082151, 106.766), (63.4170457, 10.4082271, 102.929))
