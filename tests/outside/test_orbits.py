"""Orbits and positions on the Earth against other programs: the SGP4 project, Skyfield, pymap3d.

The package propagates elements with `sgp4` and rotates axes with ERFA. Skyfield has its own rotation, with UT1 from
tables, while a mission takes UT1 = UTC: the tests rotate Skyfield's positions by that difference.
"""

import math
from fractions import Fraction
from importlib.metadata import version
from importlib.resources import files

import numpy as np
import pymap3d
import pytest
from skyfield.api import EarthSatellite, wgs84

import bisar_budget as bb
from bisar_budget.paths import elements
from bisar_budget.paths.elements import element_sets, read_tle
from bisar_budget.questions.results import PassesResult
from tests.conftest import ROOT, TODAY
from tests.outside.record import compare
from tests.paths.orbit_files import CENTER
from tests.paths.test_elements import TIMESCALE, skyfield_time, turned_by_ut1
from tests.paths.test_eof import krogh

BESANCON = ROOT / "specs" / "missions" / "sentinel1_elements_besancon.yaml"
SKYFIELD, PYMAP3D, SGP4 = "Skyfield", "pymap3d", "SGP4 project, verification of Vallado et al. 2006"


@pytest.fixture(scope="module")
def satellite() -> EarthSatellite:
    lines = BESANCON.parent.joinpath("paths", "sentinel1a_2021079.tle").read_text(encoding="ascii").splitlines()
    return EarthSatellite(*lines[-2:], "", TIMESCALE)


# ---------------------------------------------------------------------- elements
# Near and deep space, half-day and one-day resonance, an eccentric orbit, much drag.
VERIFIED = (5, 4632, 6251, 8195, 9880, 11801, 14128, 22674, 24208, 28129, 28626, 88888)


def published() -> dict[int, tuple[str, list[list[float]]]]:
    """Element sets of the SGP4 project's verification, and minutes and places that its program gives for them."""
    texts = [files("sgp4").joinpath(name).read_text(encoding="ascii") for name in ("SGP4-VER.TLE", "tcppver.out")]
    lines = [line for line in texts[0].splitlines() if line[:1] in ("1", "2")]
    sets = {int(a[2:7]): f"{a[:69]}\n{b[:69]}" for a, b in zip(lines[::2], lines[1::2], strict=True)}
    rows: dict[int, list[list[float]]] = {}
    number = 0
    for line in texts[1].splitlines():
        if line.rstrip().endswith("xx"):
            number = int(line.split()[0])
            rows[number] = []
        elif line.strip():
            rows[number].append([float(one) for one in line.split()[:4]])
    return {number: (sets[number], rows[number]) for number in VERIFIED}


@pytest.mark.parametrize("number", VERIFIED)
def test_sgp4_gives_the_published_places(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """To 1e-5 m: the last digit that is printed is 1e-5 m, and rounding it moves a place by 0.87e-5 m at most."""
    monkeypatch.setattr(elements, "from_teme", lambda place, *_: place)
    text, rows = published()[number]
    read = next(element_sets(text, "ver.tle"))
    exact = elements.teme(read)
    smooth = read_tle(text.encode(), "ver.tle", None, CENTER).place
    assert len(rows) >= 5
    for minutes, *place_km in rows:
        place = [1000 * one for one in place_km]
        at = read.epoch.after(60 * minutes)
        assert math.dist(exact(at), place) < 1e-5
        # SGP4 integrates resonances in steps of 720 minutes, where it jumps by up to 13 mm; those are smoothed too.
        assert math.dist(smooth(at), place) < (0.02 if minutes and minutes % 720 == 0 else 2e-5)
    what = f"satellite {number}, {minutes:g} min from its epoch: distance from the Earth's centre"
    compare(what, math.hypot(*place), math.hypot(*exact(at)), "m", 1e-5, SGP4, f"of sgp4 {version('sgp4')}")


# ---------------------------------------------------------------------- what the scene sees
@pytest.mark.parametrize("tau", [-0.25, 0.0, 0.25])
def test_skyfield_sees_the_satellite_of_the_example_in_the_same_direction(
    satellite: EarthSatellite, tau: float
) -> None:
    """From the scene of the Besançon example: elevation, azimuth and distance, the axes of the scene included."""
    mission = bb.load(BESANCON)
    scene, state = mission.scene, mission.platforms.transmitter.state
    time = skyfield_time(mission.collection.center_time.after(tau))
    place = wgs84.latlon(math.degrees(scene.latitude), math.degrees(scene.longitude), scene.height)
    altitude, azimuth, distance = (satellite - place).at(time).altaz()
    turned = turned_by_ut1(scene.axes.earth_fixed(state.at(tau)[0]), time.dut1)
    east, north, up = scene.axes.place(tuple(turned))
    away = math.hypot(east, north, up)
    # Skyfield rounds Julian dates, to 1e-5 m; from there that is 1.2e-11 rad, 7e-10 deg.
    said, skyfield = f"Sentinel-1A by its elements, {tau:+g} s", version("skyfield")
    compare(f"{said}: slant range", distance.m, away, "m", 1e-5, SKYFIELD, skyfield)
    compare(
        f"{said}: elevation", altitude.degrees, math.degrees(math.asin(up / away)), "deg", 7e-10, SKYFIELD, skyfield
    )
    here = math.degrees(math.atan2(east, north)) % 360
    compare(f"{said}: azimuth", azimuth.degrees, here, "deg", 7e-10, SKYFIELD, skyfield)
    # As flown, UT1 = UTC: 0.52 m for each millisecond.
    assert state.at(tau)[0] == pytest.approx((east, north, up), abs=518 * abs(time.dut1))


@pytest.fixture(scope="module")
def three_days() -> PassesResult:
    return bb.passes(BESANCON, "2021-03-19", days=3, date=TODAY)


def test_directions_are_those_of_skyfield(three_days: PassesResult, satellite: EarthSatellite) -> None:
    """To 0.05 deg and 500 m: UT1 less UTC turns the Earth by less than 0.9 s, 0.004 deg of its turn."""
    site = wgs84.latlon(47.2512, 5.9938, 360.0)
    assert len(three_days) == 10
    for one in three_days:
        elevation, azimuth, distance = (
            (satellite - site).at(TIMESCALE.from_datetime(one.center.as_datetime())).altaz()
        )
        said, skyfield = f"pass of {one.center.as_text()[:16]}, at broadside", version("skyfield")
        here = math.degrees(one.state.elevation)
        compare(f"{said}: elevation", elevation.degrees, here, "deg", 0.05, SKYFIELD, skyfield)
        compare(f"{said}: slant range", distance.m, one.state.slant_range, "m", 500, SKYFIELD, skyfield)
        apart = math.radians(azimuth.degrees) - (one.bearing or 0.0)
        assert abs(math.sin(apart)) * math.cos(one.state.elevation) < math.radians(0.05)
        assert math.cos(apart) > 0
        assert one.max_elevation >= one.state.elevation - 1e-9


def test_at_broadside_the_range_is_least(three_days: PassesResult, satellite: EarthSatellite) -> None:
    """By Skyfield's distances 2 s apart; UT1 less UTC moves the site by less than 0.4 km, 0.06 s of the orbit."""
    site = wgs84.latlon(47.2512, 5.9938, 360.0)
    for one in three_days:
        moments = TIMESCALE.from_datetimes([one.center.after(seconds).as_datetime() for seconds in (-2, 0, 2)])
        before, there, after = (satellite - site).at(moments).distance().m
        assert abs((before - after) / (before - 2 * there + after)) < 0.1  # vertex of the parabola [s]


# ---------------------------------------------------------------------- places on the Earth
SITES = (
    ("a mast beside the scene", (47.2, 6.0, 350.0), (47.21, 6.02, 420.0)),
    ("an aircraft", (-33.9, 151.2, 20.0), (-34.1, 151.6, 9_000.0)),
    ("a satellite near a pole", (78.2, 15.6, 400.0), (81.5, -20.0, 693e3)),
    ("across the date line", (0.0, 179.9, 0.0), (1.0, -179.5, 12e3)),
)


@pytest.mark.parametrize(("said", "scene", "place"), SITES)
def test_a_place_is_where_pymap3d_has_it(said: str, scene: tuple[float, ...], place: tuple[float, ...]) -> None:
    """To a micrometre, and what that is from there: both are closed formulas in double precision."""
    keys = ("latitude", "longitude", "height"), ("latitude", "longitude", "altitude")
    (at, on) = (
        ", ".join(
            f"{key}: {value} {unit}" for key, value, unit in zip(names, values, ("deg", "deg", "m"), strict=True)
        )
        for names, values in zip(keys, (scene, place), strict=True)
    )
    found = bb.check(bb.loads(f"""
schema_version: 1
name: a place
radar: {{center_frequency: 10 GHz, bandwidth: 300 MHz}}
scene: {{{at}}}
collection: {{aperture_time: 1 s}}
platforms:
  transmitter: {{position: [-20 km, 3 km, 10 km], velocity: [20 m/s, 100 m/s, 0 m/s]}}
  receiver: {{{on}, speed: 0 m/s}}
"""))  # fmt: skip
    state = found.findings.geometry.receiver
    azimuth, elevation, away = pymap3d.geodetic2aer(*place, *scene)
    release = version("pymap3d")
    tolerance = math.degrees(1e-6 / away) + 1e-12
    compare(f"{said}: slant range", away, state.slant_range, "m", 1e-6, PYMAP3D, release)
    compare(f"{said}: elevation", elevation, math.degrees(state.elevation), "deg", tolerance, PYMAP3D, release)
    here = math.degrees(math.atan2(*state.position[:2])) % 360
    compare(f"{said}: azimuth", azimuth, here, "deg", tolerance / math.cos(state.elevation), PYMAP3D, release)


def test_slant_range_and_velocity_of_a_precise_orbit(tmp_path) -> None:
    """Sentinel-1A by an orbit file: interpolated in exact fractions by three times the degree, geodesy of pymap3d.

    The file has micrometres, and velocities to a micrometre a second: 10 µm of place, 0.1 mm/s between 10 ms.
    """
    orbit = ROOT / "tests" / "paths" / "files" / "S1A_RESORB_20230823_excerpt.EOF"
    (tmp_path / "orbit.EOF").write_bytes(orbit.read_bytes())
    text = orbit.read_text(encoding="utf-8")
    first = text.partition("<UTC>UTC=")[2].partition("</UTC>")[0]
    (tmp_path / "mission.yaml").write_text(f"""
schema_version: 1
name: a precise orbit
radar: {{center_frequency: 5.405 GHz, bandwidth: 56.5 MHz}}
scene: {{latitude: 5 deg, longitude: 50 deg, height: 100 m}}
collection: {{aperture_time: 0.5 s, center_time: "{np.datetime64(first) + np.timedelta64(115, "s")}Z"}}
platforms:
  transmitter: {{orbit: {{eof: orbit.EOF}}}}
  receiver: {{position: [1 km, 1 km, 300 m], velocity: [0 m/s, 0 m/s, 0 m/s]}}
""", encoding="utf-8")  # fmt: skip
    site = pymap3d.geodetic2ecef(5.0, 50.0, 100.0)
    before, middle, after = (math.dist(krogh(Fraction(115) + Fraction(one, 100)), site) for one in (-1, 0, 1))
    state = bb.load(tmp_path / "mission.yaml").platforms.transmitter.state
    sight = [one / state.slant_range for one in state.position]
    rate = sum(a * b for a, b in zip(sight, state.velocity, strict=True))
    source, release = "Copernicus, restituted orbit of Sentinel-1A, and pymap3d", f"2023-08-23, {version('pymap3d')}"
    compare("slant range from 5° N, 50° E", middle, state.slant_range, "m", 1e-5, source, release)
    compare("rate of the slant range", (after - before) / 0.02, rate, "m/s", 1e-4, source, release)
