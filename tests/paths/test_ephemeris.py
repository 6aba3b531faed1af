"""Orbit ephemeris messages: interpolation of a known circle, time systems, axes against Skyfield."""

import math
import re
import subprocess
import sys

import erfa
import numpy as np
import pytest
from skyfield.framelib import ICRS_to_J2000, itrs
from skyfield.positionlib import Geocentric

from bisar_budget.geometry import Vector
from bisar_budget.paths import elements
from bisar_budget.paths.earth import Geodetic, axes_at
from bisar_budget.paths.elements import element_sets, read_tle
from bisar_budget.paths.flight import Orbit, PathFileError, interpolated
from bisar_budget.paths.instant import Instant, has_leap_second, tai, tai_less_utc, utc
from bisar_budget.paths.oem import read_oem
from tests.conftest import ROOT
from tests.paths.orbit_files import CENTER, RADIUS, START, TLE, TURN_RATE, instant, oem, oem_xml, on_circle
from tests.paths.test_elements import skyfield_time, turned_by_ut1

AU = 149597870700.0  # m


MIDDLE = START.after(600)


def read(text: str, at: Instant = MIDDLE, wanted: str | None = None) -> Orbit:
    return read_oem(text.encode(), "c.oem", wanted, at)


def interpolation(kind: str, degree: int) -> list[str]:
    return [f"INTERPOLATION = {kind}", f"INTERPOLATION_DEGREE = {degree}"]


def remainder(offsets: list[float], step: float) -> float:
    """Error of a polynomial through a circle: r (ω h)ⁿ ∏|offset| / n!, its derivatives all being as large. [m]"""
    count = len(offsets)
    return RADIUS * (TURN_RATE * step) ** count * math.prod(map(abs, offsets)) / math.factorial(count)


@pytest.mark.parametrize("form", ["text", "xml"])
@pytest.mark.parametrize(
    ("kind", "degree", "offsets"),
    [
        ("LAGRANGE", 3, [0.5, 0.5, 1.5, 1.5]),
        ("LAGRANGE", 5, [0.5, 0.5, 1.5, 1.5, 2.5, 2.5]),
        ("LAGRANGE", 7, [0.5, 0.5, 1.5, 1.5, 2.5, 2.5, 3.5, 3.5]),
        ("HERMITE", 3, [0.5] * 4),
        ("HERMITE", 7, [0.5] * 4 + [1.5] * 4),
    ],
)
def test_interpolation_errs_by_its_remainder(kind: str, degree: int, offsets: list[float], form: str) -> None:
    """Half way between samples, where the remainder of these is known to a few per cent."""
    text = oem(step=120.0, interpolation=interpolation(kind, degree))
    data = text.encode() if form == "text" else oem_xml(text)
    orbit = read_oem(data, "c.oem", None, START.after(1200))
    assert orbit.words == f"OEM of CIRCLE, ITRF2014, {kind.capitalize()} degree {degree}"
    assert orbit.span == (START, START.after(2400))
    error = remainder(offsets, 120.0)
    doubts = orbit.doubts(START.after(1260))
    assert len(doubts) == (error > 1)
    for doubt in doubts:
        said = re.fullmatch(r"c\.oem:\d: the interpolation of the ephemeris is about (\d+\.?\d*) m off; .*", doubt)
        assert said is not None
        assert float(said[1]) == pytest.approx(error, rel=0.1)
    for n in range(5, 15):
        time = 120 * (n + 0.5)
        off = math.dist(orbit.place(START.after(time)), on_circle(time)[0])
        assert off == pytest.approx(error, rel=0.05, abs=2e-6)
        # At a sample nothing is left but the 1e-9 m of what is written.
        assert math.dist(orbit.place(START.after(120.0 * n)), on_circle(120.0 * n)[0]) < 1e-7


@pytest.mark.parametrize(
    ("kind", "degree", "words"),
    [("LAGRANGE", 8, "Lagrange degree 8"), ("HERMITE", 4, "Hermite degree 5"), ("HERMITE", 1, "Hermite degree 3")],
)
def test_the_degree_is_that_of_the_polynomial(kind: str, degree: int, words: str) -> None:
    """Places and velocities of n samples give the odd degree 2n - 1: an even one is raised."""
    orbit = read(oem(interpolation=interpolation(kind, degree)))
    assert orbit.words.endswith(words)
    assert math.dist(orbit.place(START.after(615)), on_circle(615)[0]) < 3


def test_a_path_has_no_jumps_at_its_samples() -> None:
    """Degrees even and odd: the two polynomials beside a sample share it."""
    for kind, degree in (("LAGRANGE", 4), ("LAGRANGE", 5), ("HERMITE", 3), ("HERMITE", 5)):
        orbit = read(oem(step=120.0, interpolation=interpolation(kind, degree)), START.after(1200))
        before, after = (orbit.place(START.after(1200 + off)) for off in (-1e-6, 1e-6))
        assert math.dist(before, after) == pytest.approx(2e-6 * RADIUS * TURN_RATE, rel=1e-3)


def test_without_interpolation_it_is_hermite_where_velocities_are_those_of_the_places() -> None:
    """Velocities against the stars, beside places on the Earth, are off by ω times the distance from the axis.

    That is 516 m/s at the equator, and 6.0 % of the speed at 3.5 minutes of this path.
    """

    def against_stars(time: float) -> tuple[Vector, Vector]:
        (x, y, z), (u, v, w) = on_circle(time)
        return (x, y, z), (u - 7.292115e-5 * y, v + 7.292115e-5 * x, w)

    assert read(oem()).words == "OEM of CIRCLE, ITRF2014, Hermite degree 7 (the file states no interpolation)"
    orbit = read(oem(path=against_stars))
    assert orbit.words == "OEM of CIRCLE, ITRF2014, Lagrange degree 7 (the file states no interpolation)"
    kind_alone = read(oem(interpolation=["INTERPOLATION = LAGRANGE"]))
    assert kind_alone.words == "OEM of CIRCLE, ITRF2014, Lagrange degree 7 (the file states no degree)"
    assert read(oem(interpolation=["INTERPOLATION = LINEAR"])).words.endswith("Lagrange degree 1")
    assert math.dist(orbit.place(START.after(615)), on_circle(615)[0]) < 1e-4
    with pytest.raises(PathFileError) as error:
        read(oem(path=against_stars, interpolation=interpolation("HERMITE", 7)))
    assert str(error.value) == (
        "c.oem:12: INTERPOLATION HERMITE needs the velocities of the positions; those of the segment are 6 % off"
        " the motion of its positions"
    )
    # A step of a twelfth of the orbit is long, and its velocities are still known for what they are.
    assert read(oem(step=490.0)).words.endswith("Hermite degree 7 (the file states no interpolation)")


SYSTEMS = {"UTC": 0.0, "TAI": 37.0, "TT": 69.184, "GPS": 18.0}


@pytest.mark.parametrize("system", SYSTEMS)
def test_time_systems_give_the_same_places(system: str) -> None:
    """TAI is 37 s ahead of UTC from 2017 on, TT 32.184 s of TAI, and GPS 19 s behind TAI."""

    def clock(time: float) -> Instant:
        return START.after(time + SYSTEMS[system])

    orbit = read(oem(system=system, times=clock))
    assert math.dist(orbit.place(START.after(615)), on_circle(615)[0]) < 1e-4
    assert orbit.span is not None
    assert abs(orbit.span[0].since(START)) < 1e-9


def test_a_leap_second_is_a_second() -> None:
    """Over the end of 2016: 23:59:60 is a time of the message, and what follows is where TAI has it."""
    midnight = instant("2017-01-01T00:00:00Z")

    def clock(time: float) -> Instant:
        """UTC of a path that is in the leap second at 200 s."""
        if 200 <= time < 201:
            return Instant(midnight.day - 1, 86400 + time - 200)
        return midnight.after(time - (200 if time < 200 else 201))

    text = oem(times=clock, step=10.0, count=41)
    assert "2016-12-31T23:59:60.000000000" in text
    for time in (154.5, 199.5, 201.5, 244.5):
        orbit = read(text, clock(time))
        assert math.dist(orbit.place(clock(time)), on_circle(time)[0]) < 1e-5
    assert [tai_less_utc(day) for day in (41317, 57753, 57754, 61192)] == [10, 36, 37, 37]
    for seconds in (86399.5, 86400.5):
        moment = Instant(midnight.day - 1, seconds)
        assert utc(tai(moment)) == pytest.approx(moment, abs=1e-9)


def test_leap_seconds_are_those_of_erfa() -> None:
    """Its table is compiled from the same bulletins by others."""
    for year, month, ahead in erfa.leap_seconds.get().tolist():
        if year >= 1972:
            day = instant(f"{year}-{month:02d}-01T00:00:00Z").day
            assert tai_less_utc(day) == ahead
            assert has_leap_second(day - 1) == (year > 1972 or month > 1)
            assert not has_leap_second(day)


def geocentric(place: Vector, time: object) -> np.ndarray:
    """Earth-fixed coordinates by Skyfield of a place in the axes of the GCRF. [m]"""
    return Geocentric(np.array(place) / AU, t=time).frame_xyz(itrs).m


@pytest.mark.parametrize("frame", ["GCRF", "ICRF", "EME2000", "J2000"])
def test_axes_of_the_stars_turn_as_skyfield_has_them(frame: str) -> None:
    """To 2 mm: Skyfield has the nutation of 2000A and ERFA that of 2006, some 1e-5" apart. UT1 is accounted for."""
    orbit = read(oem(frame=frame))
    at = START.after(615)
    time = skyfield_time(at)
    place = np.array(on_circle(615)[0])
    theirs = geocentric(ICRS_to_J2000.T @ place if frame in ("EME2000", "J2000") else place, time)
    assert np.linalg.norm(theirs - turned_by_ut1(orbit.place(at), time.dut1)) < 2e-3
    turned = np.hypot(*orbit.place(at)[:2]) * 7.292115e-6
    assert orbit.doubts(at) == (
        f"c.oem:4: {frame} is turned to the Earth with UT1 = UTC and without polar motion: {turned:.0f} m off"
        " for each 0.1 s of UT1 - UTC, and up to 21 m; an ephemeris in ITRF has neither",
    )


def test_teme_turns_as_that_of_elements() -> None:
    exact = elements.smooth(elements.teme(next(element_sets(TLE, "s.tle"))))

    def path(time: float) -> tuple[Vector, Vector]:
        place, before, after = (exact(CENTER.after(time - 300 + off)) for off in (0.0, -0.05, 0.05))
        velocity = tuple((b - a) / 0.1 for a, b in zip(before, after, strict=True))
        return place, velocity  # type: ignore[return-value]

    text = oem(frame="TEME", path=path, step=30.0, times=lambda time: CENTER.after(time - 300))
    theirs = read_tle(TLE.encode(), "s.tle", None, CENTER).place(CENTER.after(7.0))
    # Velocities are differences of places rounded to 1e-7 m.
    assert math.dist(read(text, CENTER).place(CENTER.after(7.0)), theirs) < 1e-4


def test_a_gap_is_not_interpolated() -> None:
    """Three hours are two turns of the orbit: the polynomial over them is nobody's path."""

    def clock(time: float) -> Instant:
        return START.after(time if time < 600 else time + 3 * 3600)

    text = oem(times=clock, interpolation=interpolation("LAGRANGE", 7))
    with pytest.raises(PathFileError) as error:
        read(text, START.after(6000))
    assert str(error.value) == (
        "c.oem:4: the ephemeris is too sparse around 2026-06-01T06:40:00.000Z to interpolate: its"
        " states there are 181 min apart"
    )
    assert math.dist(read(text, START.after(300)).place(START.after(300)), on_circle(300)[0]) < 1e-6


@pytest.mark.parametrize("frame", ["ITRF", "ITRF-97", "ITRF2000", "ITRF2020", "itrf93", "WGS84", "WGS-84"])
def test_axes_of_the_earth_stay_as_they_are(frame: str) -> None:
    assert math.dist(read(oem(frame=frame)).place(START.after(600)), on_circle(600)[0]) < 1e-7


@pytest.mark.parametrize("frame", ["ITRF2014", "TEME", "GCRF"])
def test_an_aperture_of_a_second_is_smooth_to_a_micrometre(frame: str) -> None:
    center = START.after(617.123456789)
    orbit = read(oem(frame=frame, step=10.0, count=121), center)
    axes = axes_at(Geodetic(0.8, 0.2, 100.0))

    def place(tau: float) -> Vector:
        return axes.place(orbit.place(center.after(tau)))

    path = interpolated(lambda times: np.array([place(tau) for tau in times.tolist()]), 1.0)
    assert path.farthest < 1e-6
    off = np.array([np.subtract(place(tau), path.state.at(tau)[0]) for tau in np.linspace(-0.5, 0.5, 101)])
    assert np.abs(off).max() < 1e-6


def test_useable_time_is_honoured() -> None:
    useable = ["USEABLE_START_TIME = 2026-06-01T05:05:00", "USEABLE_STOP_TIME = 2026-06-01T05:15:00"]
    orbit = read(oem(extra=useable))
    assert orbit.span == (START.after(300), START.after(900))
    for time in (300.0, 900.0):
        orbit.place(START.after(time))
    for time in (299.9, 900.1):
        with pytest.raises(
            PathFileError, match=r"its useable time is 2026-06-01T05:05:00\.000Z to 2026-06-01T05:15:00"
        ):
            orbit.place(START.after(time))
    with pytest.raises(PathFileError) as error:
        read(oem(extra=useable), START.after(100))
    assert str(error.value) == (
        "c.oem: has no position at 2026-06-01T05:01:40.000Z; its useable time is 2026-06-01T05:05:00.000Z to"
        " 2026-06-01T05:15:00.000Z"
    )


def later(time: float) -> Instant:
    return START.after(1200 + time)


def test_the_segment_around_the_middle_of_the_aperture_is_taken() -> None:
    """The second has another path: none of its samples is used with those of the first."""

    def path(time: float) -> tuple[Vector, Vector]:
        return on_circle(time + 1300)

    text = oem() + oem(heading=False, path=path, times=later, interpolation=interpolation("LAGRANGE", 5))
    first, second = read(text, START.after(1150)), read(text, START.after(1250))
    assert first.span == (START, START.after(1200))
    assert second.span == (START.after(1200), START.after(2400))
    assert second.words.endswith("Lagrange degree 5")
    assert math.dist(first.place(START.after(1170)), on_circle(1170)[0]) < 1e-3
    assert math.dist(second.place(START.after(1230)), on_circle(1330)[0]) < 0.1


@pytest.mark.parametrize("wanted", ["second", "2026-001b"])
def test_an_object_is_chosen(wanted: str) -> None:
    text = oem() + oem(heading=False, name="SECOND").replace("2026-001A", "2026-001B")
    assert read(text, wanted=wanted).words.startswith("OEM of SECOND,")
    with pytest.raises(PathFileError) as error:
        read(text)
    assert str(error.value) == (
        "c.oem: has 2 objects: CIRCLE (2026-001A), SECOND (2026-001B); choose one by its name or OBJECT_ID"
    )
    with pytest.raises(PathFileError) as error:
        read(text, wanted="third")
    assert str(error.value) == "c.oem: has no object third; it has CIRCLE (2026-001A), SECOND (2026-001B)"


def test_covariances_accelerations_and_days_of_the_year_are_read_over() -> None:
    lines = oem(count=41, step=30.0).splitlines()
    rows = [f"{line.replace('2026-06-01T', '2026-152T')} 0 0 0" if line[:5] == "2026-" else line for line in lines]
    triangle = [" ".join(["0"] * line + ["1.0"]) for line in range(6)]
    text = "\r\n".join([*rows, "COVARIANCE_START", "EPOCH = 2026-06-01T05:00:00", *triangle, "COVARIANCE_STOP", ""])
    assert math.dist(read(text).place(START.after(615)), on_circle(615)[0]) < 1e-5


def test_without_pyerfa_an_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "erfa", None)
    read(oem(frame="TEME"))
    with pytest.raises(PathFileError) as error:
        read(oem(frame="GCRF"))
    assert str(error.value) == "c.oem:4: REF_FRAME GCRF needs the package pyerfa: pip install pyerfa sgp4"


@pytest.mark.parametrize(("frame", "loaded"), [("ITRF2014", "False\n"), ("TEME", "False\n"), ("GCRF", "True\n")])
def test_only_axes_of_the_stars_need_pyerfa(frame: str, loaded: str) -> None:
    code = f"""
import sys
from bisar_budget.paths.oem import read_oem
from bisar_budget.paths.instant import Instant
center = Instant({START.day}, {START.seconds + 600})
read_oem({oem(frame=frame).encode()!r}, "c.oem", None, center).place(center)
print("erfa" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout == loaded
