"""Orbits of mean elements, against the vectors of the SGP4 project and against Skyfield."""

import json
import math
import sys

import numpy as np
import pytest
from skyfield.api import EarthSatellite, load
from skyfield.framelib import itrs

from bisar_budget.geometry import Vector
from bisar_budget.paths import elements
from bisar_budget.paths.earth import Geodetic, axes_at
from bisar_budget.paths.elements import element_sets, read_omm, read_tle
from bisar_budget.paths.flight import Orbit, PathFileError, interpolated
from bisar_budget.paths.instant import Instant
from tests.paths.orbit_files import (
    CENTER,
    CONSTANTS,
    EPOCH,
    LINE_1,
    LINE_2,
    MESSAGE,
    TLE,
    checked,
    instant,
    omm_csv,
    omm_json,
    omm_text,
    omm_xml,
)

TIMESCALE = load.timescale(builtin=True)


def skyfield_time(moment: Instant) -> object:
    return TIMESCALE.tai_jd(2400000.5 + moment.day, (moment.seconds + 37) / 86400)


def turned_by_ut1(place: Vector, dut1: float) -> np.ndarray:
    """An Earth-fixed place, had UT1 been known: the Earth is further by 1.00273781 turns a day."""
    angle = 2 * math.pi * 1.00273781191135448 * dut1 / 86400
    cosine, sine = math.cos(angle), math.sin(angle)
    x, y, z = place
    return np.array([cosine * x + sine * y, cosine * y - sine * x, z])


@pytest.mark.parametrize("hours", [0.0, 0.7, 19.1, 66.6, -40.0, 160.0])
def test_skyfield_has_the_satellite_at_the_same_place(hours: float) -> None:
    """Earth-fixed. Skyfield has UT1 of tables; without that difference, 1e-5 m: its rounding of Julian dates."""
    at = EPOCH.after(3600 * hours)
    place = read_tle(TLE.encode(), "s.tle", None, at).place(at)
    time = skyfield_time(at)
    theirs = EarthSatellite(LINE_1, LINE_2, None, TIMESCALE).at(time).frame_xyz(itrs).m
    assert np.linalg.norm(theirs - turned_by_ut1(place, time.dut1)) < 1e-5
    # ω r of an orbit 7 078 km wide, and less on the way to the poles: 0.52 m for each millisecond.
    assert np.linalg.norm(theirs - place) <= 518 * abs(time.dut1) + 1e-5


@pytest.mark.parametrize("days", [0, 6, 20, 100])
def test_an_aperture_of_a_second_is_smooth_to_a_micrometre(days: int) -> None:
    """The polynomial of a budget against places that it does not go through; old elements too."""
    center = EPOCH.after(86400 * days + 4321.123456789)
    orbit = read_tle(TLE.encode(), "s.tle", None, center)
    axes = axes_at(Geodetic(0.8, 0.2, 100.0))

    def place(tau: float) -> Vector:
        return axes.place(orbit.place(center.after(tau)))

    path = interpolated(lambda times: np.array([place(tau) for tau in times.tolist()]), 1.0)
    assert path.farthest < 1e-6
    off = np.array([np.subtract(place(tau), path.state.at(tau)[0]) for tau in np.linspace(-0.5, 0.5, 201)])
    assert np.abs(off).max() < 1e-6
    # Noise would need every power; a quarter of a minute of an orbit does not.
    assert path.order <= 6
    # Gravity at 700 km is 7.97 m/s², and the Earth's rotation takes some of it or adds some.
    assert 6 < math.hypot(*path.state.acceleration) < 9


def test_smoothing_stays_within_the_rounding_of_sgp4() -> None:
    """SGP4 solves Kepler's equation to 1e-12 rad; a seventh of that is seen."""
    exact = elements.teme(next(element_sets(TLE, "s.tle")))
    smooth = elements.smooth(exact)
    for seconds in np.linspace(-3000, 3000, 37):
        at = EPOCH.after(float(seconds) + 0.123)
        assert math.dist(exact(at), smooth(at)) < 1e-6


MESSAGES = {
    "xml": omm_xml(),
    "json": omm_json(),
    "json, one message": json.dumps(MESSAGE).encode(),
    "json of texts": json.dumps([{key: str(value) for key, value in {**MESSAGE, **CONSTANTS}.items()}]).encode(),
    "csv": omm_csv(),
    "text": omm_text(),
    "csv with a mark of its encoding": b"\xef\xbb\xbf" + omm_csv(),
}


@pytest.mark.parametrize("data", MESSAGES.values(), ids=MESSAGES)
def test_a_message_places_what_its_element_set_does(data: bytes) -> None:
    orbit = read_omm(data, "s.omm", None, CENTER)
    lines = read_tle(TLE.encode(), "s.tle", None, CENTER)
    # 1e-10 of the mean motion's last digit and its conversion: 1e-6 m after a day.
    assert math.dist(orbit.place(CENTER), lines.place(CENTER)) < 1e-5
    assert orbit.words == "orbit mean elements of SENTINEL-1A (39634), epoch 2026-05-31T10:12:13.122Z, SGP4"
    assert lines.words == "two-line elements of SENTINEL-1A (39634), epoch 2026-05-31T10:12:13.122Z, SGP4"
    assert orbit.epoch is not None
    assert lines.epoch is not None
    assert abs(orbit.epoch.since(EPOCH)) < 1e-9
    assert abs(lines.epoch.since(EPOCH)) < 1e-9


def test_a_text_gives_the_last_digit_of_xml() -> None:
    text, xml = (read_omm(data, "s.omm", None, CENTER).place(CENTER) for data in (omm_text(), omm_xml()))
    assert text == xml


def test_a_text_of_several_messages() -> None:
    later = omm_text().replace(b"2026-05-31T10", b"2026-06-01T04").replace(b"84.7034", b"85.7034")
    both = read_omm(omm_text() + later, "s.omm", None, CENTER)
    assert both.place(CENTER) == read_omm(later, "s.omm", None, CENTER).place(CENTER)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (b"OBJECT_ID            =", b"OBJECT_ID", "s:10: must be a keyword, = and its value (got OBJECT_ID"),
        (b"OBJECT_ID  ", b"OBJECT_NAME", "s:10: OBJECT_NAME is there twice in the message of line 1"),
        (b"REF_FRAME", b"REF_FRANE", "s:1: has no REF_FRAME"),
        (b"= TEME", b"= GCRF", "s:1: REF_FRAME must be TEME (got GCRF)"),
    ],
)
def test_a_text_that_is_refused(before: bytes, after: bytes, said: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_omm(omm_text().replace(before, after), "s", None, CENTER)
    assert str(error.value).startswith(said)


def test_an_epoch_may_be_a_day_of_the_year() -> None:
    orbit = read_omm(omm_json(EPOCH="2026-151T10:12:13.122432Z"), "s.json", None, CENTER)
    assert orbit.epoch == EPOCH


def with_epoch(day: str) -> str:
    """Line 1 with another epoch: two digits of the year, then the day."""
    return checked(LINE_1[:18] + day + LINE_1[32:])


OTHER = "\n".join(checked(line[:2] + "T0001" + line[7:]) for line in (LINE_1, LINE_2))
MANY = f"0 SENTINEL-1A\r\n{LINE_1}\r\n{LINE_2}\r\n\r\n# another\r\n0 OBJECT B\r\n{OTHER}\r\n"


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ("39634", "SENTINEL-1A (39634)"),
        ("sentinel-1a", "SENTINEL-1A (39634)"),
        ("270001", "OBJECT B (270001)"),
        (" Object  B ", "OBJECT B (270001)"),
    ],
)
def test_an_object_is_chosen_by_name_or_number(wanted: str, said: str) -> None:
    """T0001 is 270001: T is the 18th letter without I and O, from A for 10 on (Space-Track, alpha-5)."""
    assert said in read_tle(MANY.encode(), "many.tle", wanted, CENTER).words


@pytest.mark.parametrize(
    ("at", "epoch"),
    [
        ("2026-05-01T00:00:00Z", "2026-05-31T10:12:13.122Z"),
        ("2026-06-01T00:00:00Z", "2026-05-31T10:12:13.122Z"),
        ("2026-06-02T00:00:00Z", "2026-06-02T00:00:00.000Z"),
        ("2026-06-20T00:00:00Z", "2026-06-03T12:00:00.000Z"),
    ],
)
def test_the_nearest_epoch_is_taken(at: str, epoch: str) -> None:
    days = ("26153.00000000", "26151.42515188", "26154.50000000")
    text = "".join(f"{with_epoch(day)}\n{LINE_2}\n" for day in days)
    orbit = read_tle(text.encode(), "s.tle", None, instant(at))
    assert orbit.words == f"two-line elements of 39634, epoch {epoch}, SGP4"


def orbit_of(text: str) -> Orbit:
    return read_tle(text.encode(), "s.tle", None, CENTER)


def test_old_elements_are_doubted() -> None:
    """1 km and 1 to 3 km a day: 12.5 days give 13.5 to 38.5 km."""
    orbit = orbit_of(TLE)
    assert orbit.doubts(EPOCH.after(6.99 * 86400)) == ()
    assert orbit.doubts(EPOCH.after(-6.99 * 86400)) == ()
    assert orbit.doubts(EPOCH.after(12.5 * 86400)) == (
        "s.tle: the elements of SENTINEL-1A (39634) are of 2026-05-31T10:12:13.122Z, 12.5 days before the aperture;"
        " its position by SGP4 may be 14 to 38 km off",
    )
    assert orbit.doubts(EPOCH.after(-8 * 86400)) == (
        "s.tle: the elements of SENTINEL-1A (39634) are of 2026-05-31T10:12:13.122Z, 8.0 days after the aperture;"
        " its position by SGP4 may be 9 to 25 km off",
    )


def test_a_satellite_that_comes_down_has_no_place_afterwards() -> None:
    """Satellite 28872 of the SGP4 project's verification decays within an hour (its note in SGP4-VER.TLE)."""
    lines = [
        "1 28872U 05037B   05333.02012661  .25992681  00000-0  24476-3 0  1534",
        "2 28872  96.4736 157.9986 0303955 244.0492 110.6523 16.46015938 10708",
    ]
    orbit = read_tle("\n".join(lines).encode(), "down.tle", None, CENTER)
    assert orbit.epoch is not None
    assert math.hypot(*orbit.place(orbit.epoch.after(600))) > 6.4e6
    with pytest.raises(PathFileError, match=r"^down\.tle:1: SGP4 has no position of 28872 at .*: it has decayed$"):
        orbit.place(orbit.epoch.after(86400))
    with pytest.raises(PathFileError, match=r"2005-11-29T00:28:58\.939Z, more than a century from"):
        orbit.place(instant("2126-06-01T00:00:00Z"))


def test_without_sgp4_an_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sgp4.api", None)
    with pytest.raises(PathFileError) as error:
        orbit_of(TLE)
    assert str(error.value) == "s.tle:2: needs the package sgp4: pip install pyerfa sgp4"
