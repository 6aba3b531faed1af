"""Errors of satellites against orbits that SciPy propagates, with the Earth's flattening.

The reference has its own Earth, its own rotation and its own law of gravity (μ, J₂); the point of an image and the
phase left there are those of `tests.image_point`. Nothing of it comes from the package but the mission files' reader
and the rows that are judged.
"""

import math
from dataclasses import dataclass, replace
from datetime import date
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.orbit_error import orbit_error
from tests.image_point import Collection, flight, no_error
from tests.yaml_text import yaml_text

MU, J2, EQUATOR, FLAT, TURN = 3.986004418e14, 1.08263e-3, 6378137.0, 1 / 298.257223563, 7.292115e-5
SPIN = np.array((0.0, 0.0, TURN))


def gravity(r):
    """Gravity of a flattened Earth. [m/s²]"""
    x, y, z = r
    square = r @ r
    factor, polar = 1.5 * J2 * EQUATOR**2 / square, z * z / square
    level, upward = 1 + factor * (1 - 5 * polar), 1 + factor * (3 - 5 * polar)
    return -MU / square**1.5 * np.array((level * x, level * y, upward * z))


def direction(latitude_deg, longitude_deg):
    a, b = np.radians((latitude_deg, longitude_deg))
    return np.array((math.cos(a) * math.cos(b), math.cos(a) * math.sin(b), math.sin(a)))


@dataclass(frozen=True)
class Scene:
    """East, north, up (rows) and origin of a place at sea level, in Earth-fixed axes."""

    latitude: float
    longitude: float

    @property
    def origin(self):
        a = math.radians(self.latitude)
        square = FLAT * (2 - FLAT)
        normal = EQUATOR / math.sqrt(1 - square * math.sin(a) ** 2)
        x, y, z = direction(self.latitude, self.longitude)
        return normal * np.array((x, y, z * (1 - square)))

    @property
    def axes(self):
        b = math.radians(self.longitude)
        up = direction(self.latitude, self.longitude)
        east = np.array((-math.sin(b), math.cos(b), 0.0))
        return np.array((east, np.cross(up, east), up))


@dataclass(frozen=True)
class Orbit:
    """A satellite above a place, with its velocity against the stars; circular but for `factor`, its speed's."""

    radius: float
    latitude: float
    longitude: float
    heading: float  # of the velocity against the stars, from north, clockwise [deg]
    factor: float = 1.0

    @property
    def state(self):
        """Place and velocity against the stars, in axes that are Earth-fixed at mid-aperture. [m, m/s]"""
        r = self.radius * direction(self.latitude, self.longitude)
        b, h = math.radians(self.longitude), math.radians(self.heading)
        east = np.array((-math.sin(b), math.cos(b), 0.0))
        north = np.cross(r / self.radius, east)
        speed = self.factor * math.sqrt(MU / self.radius)
        return r, speed * (math.cos(h) * north + math.sin(h) * east)


def flown(r, v, times):
    """Earth-fixed places of a satellite at times about mid-aperture, (times, 3). [m]"""
    places = np.empty((len(times), 3))

    def rates(time, state):
        return np.concatenate((state[3:], gravity(state[:3])))

    for is_side in (times >= 0, times < 0):
        asked = times[is_side]
        if not asked.size:
            continue
        order = np.argsort(np.abs(asked))
        end = asked[order][-1]
        run = solve_ivp(
            rates, (0.0, end), np.concatenate((r, v)), method="DOP853", t_eval=asked[order], rtol=1e-13, atol=1e-9
        )
        placed = np.empty((asked.size, 3))
        placed[order] = run.y[:3].T
        places[is_side] = placed
    angle = TURN * times
    x = np.cos(angle) * places[:, 0] + np.sin(angle) * places[:, 1]
    y = -np.sin(angle) * places[:, 0] + np.cos(angle) * places[:, 1]
    return np.stack((x, y, places[:, 2]), axis=1)


@dataclass(frozen=True)
class Case:
    """A mission with a satellite that transmits and a receiver in the scene."""

    name: str
    orbit: Orbit
    scene: Scene
    frame: str
    center_frequency: float
    bandwidth: float
    aperture_time: float
    receiver: tuple[Any, Any] = ((3000.0, 1000.0, 500.0), (0.0, 0.0, 0.0))

    @property
    def path(self):
        """Position, velocity, acceleration, jerk and snap of the satellite in the scene's axes."""
        r, v = self.orbit.state
        step = self.aperture_time / 40
        times = step * np.arange(-8.0, 9.0)
        axes, origin = self.scene.axes, self.scene.origin
        places = (flown(r, v, times) - origin) @ axes.T
        fit = np.polynomial.polynomial.polyfit(times / times[-1], places - places[8], 8)
        powers = [fit[k] / times[-1] ** k * math.factorial(k) for k in range(5)]
        return places[8], *powers[1:]

    def document(self, **errors):
        place, velocity, acceleration, jerk, snap = (vector.tolist() for vector in self.path)
        position, speed = self.receiver
        return {
            "schema_version": 1,
            "name": self.name,
            "radar": {"center_frequency": f"{self.center_frequency} Hz", "bandwidth": f"{self.bandwidth} Hz"},
            "collection": {"aperture_time": f"{self.aperture_time} s"},
            "scene": {
                "latitude": f"{self.scene.latitude} deg",
                "longitude": f"{self.scene.longitude} deg",
                "height": "0 m",
            },
            "platforms": {
                "transmitter": {
                    "position": place,
                    "velocity": velocity,
                    "acceleration": acceleration,
                    "jerk": jerk,
                    "snap": snap,
                    "motion_error": {"frame": self.frame, "source": "this test", **errors},
                },
                "receiver": {"position": list(position), "velocity": list(speed)},
            },
            "requirements": {"quadratic_phase_error": "22.5 deg"},
        }

    @property
    def axes(self):
        """Axes of the frame of the errors, in the scene's axes."""
        if self.frame == "scene":
            return np.eye(3)
        r, v = self.orbit.state
        radial, across = r / np.linalg.norm(r), np.cross(r, v) / np.linalg.norm(np.cross(r, v))
        return np.array((radial, np.cross(across, radial), across)) @ self.scene.axes.T

    def error(self, kind, axis, size):
        """Error of the measured path: the orbit of the wrong state less that of the true one."""
        r, v = self.orbit.state
        vector = size * self.axes[axis] @ self.scene.axes  # Earth-fixed
        if kind == "position":
            wrong_v = v if self.frame == "ric" else v + np.cross(SPIN, vector)  # the Earth-fixed vector stays
            wrong = r + vector, wrong_v
        else:
            wrong = r, v + vector

        def moved(times):
            return (flown(*wrong, times) - flown(r, v, times)) @ self.scene.axes.T

        return moved

    def response(self, kind, axis, size):
        place, velocity, acceleration, jerk, snap = self.path
        straight = flight(place, velocity, acceleration)

        def true(times):
            return straight(times) + np.outer(times**3 / 6, jerk) + np.outer(times**4 / 24, snap)

        paths = (true, flight(*self.receiver))
        errors = (self.error(kind, axis, size), no_error)
        return Collection(
            self.center_frequency, self.bandwidth, self.aperture_time, paths, errors
        ).least_variance_point()


GEO, MEO, LOW = 42_164e3, 26_560e3, 6_878e3
CASES = (
    Case("geosynchronous", Orbit(GEO, 12, 8, 75), Scene(45, 9), "ric", 5.4e9, 20e6, 1200),
    Case("geosynchronous in scene axes", Orbit(GEO, 12, 8, 75), Scene(45, 9), "scene", 5.4e9, 20e6, 1200),
    Case("geosynchronous, inclined, 600 s", Orbit(GEO, -30, 20, 40), Scene(20, 30), "ric", 1.25e9, 10e6, 600),
    Case("navigation satellite", Orbit(MEO, 30, 20, 35), Scene(47, 6), "ric", 1.5754e9, 20e6, 120),
    Case("navigation satellite in scene axes", Orbit(MEO, 30, 20, 35), Scene(47, 6), "scene", 1.5754e9, 20e6, 120),
    Case("low orbit, 10 s", Orbit(LOW, 44, 12, 348), Scene(45, 9), "ric", 9.65e9, 150e6, 10),
    Case("low orbit in scene axes", Orbit(LOW, 44, 12, 348), Scene(45, 9), "scene", 9.65e9, 150e6, 10),
    Case("low orbit, L band, 30 s", Orbit(LOW, 58, 24, 190), Scene(60, 20), "ric", 1.27e9, 60e6, 30),
    Case("fast at perigee", Orbit(7_000e3, -20, -50, 160, 1.15), Scene(-22, -46), "ric", 5.4e9, 100e6, 15),
    Case(
        "low orbit with an aircraft",
        Orbit(LOW, 3, 103, 12),
        Scene(1, 104),
        "ric",
        9.65e9,
        100e6,
        8,
        ((20e3, -5e3, 6e3), (30.0, 110.0, 0.0)),
    ),
    Case("low orbit, L band, 40 s", Orbit(LOW, 44, 12, 348), Scene(44, 16), "ric", 1.27e9, 60e6, 40),
    Case("low orbit, X band, 12 s", Orbit(LOW, 44, 12, 348), Scene(44, 16), "ric", 9.65e9, 300e6, 12),
    Case("low orbit, P band, 60 s", Orbit(LOW, 44, 12, 348), Scene(44, 16), "ric", 0.435e9, 6e6, 60),
)
LONG = CASES[-3:]
SIZES = {"position": 1.0, "velocity": 2e-4}


@cache
def rows(case):
    errors = {kind: [f"{size} {'m' if kind == 'position' else 'm/s'}"] * 3 for kind, size in SIZES.items()}
    mission = parse_mission(yaml_text(case.document(**errors)))
    return {row.id: row for row in check_mission(mission, date(2026, 1, 1)).rows}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("kind", SIZES)
@pytest.mark.parametrize("axis", range(3))
def test_an_orbit_that_is_propagated_says_the_same(case: Case, kind: str, axis: int) -> None:
    """Without the gradient of J₂, phases of the linearised dynamics differed by up to 0.2 %.

    A phase is that of the worse sign. The tolerance of 0.3 µrad is that of the propagated differences.
    """
    names = {"scene": "xyz", "ric": ("radial", "in_track", "cross_track")}[case.frame]
    row = rows(case)[f"transmitter.{kind}.{names[axis]}"]
    ahead, back = (case.response(kind, axis, sign * SIZES[kind]) for sign in (1, -1))
    phase = max(abs(ahead.quadratic_rad), abs(back.quadratic_rad))
    assert abs(row.qpe_full_rad) == pytest.approx(phase, rel=2e-4, abs=3e-7)
    assert math.hypot(*row.displacement_m) == pytest.approx(math.hypot(*ahead.point), rel=2e-3, abs=1e-4)


@pytest.mark.parametrize("case", LONG, ids=lambda case: case.name)
def test_a_large_error_in_track_has_the_phase_of_the_worse_sign(case: Case) -> None:
    """At 10 m the two signs differ by some 3 %, because the image moves along a range history that is not its own."""
    mission = parse_mission(yaml_text(case.document(position=["0 m", "10 m", "0 m"])))
    found = {row.id: row for row in check_mission(mission, date(2026, 1, 1)).rows}["transmitter.position.in_track"]
    ahead, back = (abs(case.response("position", 1, size).quadratic_rad) for size in (10.0, -10.0))
    assert abs(found.qpe_full_rad) == pytest.approx(max(ahead, back), rel=5e-4)
    assert abs(found.qpe_full_rad) / min(ahead, back) > 1.01


@pytest.mark.parametrize("case", [CASES[1], CASES[6]], ids=lambda case: case.name)
@pytest.mark.parametrize("axis", range(3))
def test_the_simulator_flies_the_orbit_that_is_propagated(case: Case, axis: int) -> None:
    """The path error beyond its constant and linear terms. Two bodies alone leave more than 0.1 % of it."""
    state = parse_mission(yaml_text(case.document())).platforms.transmitter.state
    times = np.linspace(-1, 1, 41) * case.aperture_time / 2
    moved = orbit_error(state, 100 * np.eye(3)[axis], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), times)
    want = case.error("position", axis, 100.0)(times)
    bends = [courses - np.polynomial.polynomial.polyval(times, line(courses, times)).T for courses in (moved, want)]
    assert np.abs(bends[0] - bends[1]).max() < 1e-4 * np.abs(bends[1]).max()


def line(courses: np.ndarray, times: np.ndarray) -> np.ndarray:
    return np.polynomial.polynomial.polyfit(times, courses, 1)


def without_acceleration(**changes: Any) -> Any:
    document = CASES[0].document(position=["10 m", "0 m", "0 m"])
    platform = document["platforms"]["transmitter"]
    for key in ("acceleration", "jerk", "snap"):
        del platform[key]
    platform |= changes
    return check_mission(parse_mission(yaml_text(document)), date(2026, 1, 1))


def test_a_deleted_acceleration_is_no_silent_pass() -> None:
    """The mission fails with its orbit. Without the orbit's acceleration it passed, and nothing was said."""
    found = without_acceleration()
    assert found.status == "warn"
    assert any("but the path is straight" in str(warning) for warning in found.warnings)


@pytest.mark.parametrize(
    ("speed", "height", "words"),
    [
        (101.0, 101e3, "but the path is straight"),
        (99.0, 101e3, "differs from that of free fall"),
        (1.0, 400e3, "differs from that of free fall"),
        (101.0, 91e3, None),
    ],
)
def test_a_straight_path_above_100_km_is_a_doubt(speed: float, height: float, words: str | None) -> None:
    """The height is that above a sphere; 300 km away it is 4 km more than above the plane of the scene."""
    found = without_acceleration(position=[0.0, -300e3, height], velocity=[speed, 0.0, 0.0])
    if words is None:
        assert found.warnings == ()
    else:
        (warning,) = found.warnings
        assert words in str(warning)
        assert warning.is_doubt


@pytest.mark.parametrize("is_placed", [True, False])
def test_a_geosynchronous_mission_just_outside_free_fall_is_no_silent_pass(is_placed: bool) -> None:
    """4 m of radial error fail with the acceleration of free fall. 5.1 % beside it, or without a latitude, they are
    judged without the dynamics of the orbit, and passed in silence."""
    document = CASES[0].document(position=["4 m", "0 m", "0 m"])
    platform = document["platforms"]["transmitter"]
    assert check_mission(parse_mission(yaml_text(document)), date(2026, 1, 1)).status == "fail"
    if is_placed:
        platform["acceleration"] = [platform["acceleration"][0] + 0.051 * MU / GEO**2, *platform["acceleration"][1:]]
    else:
        document["scene"] = {}
        platform["motion_error"]["frame"] = "look"
    found = check_mission(parse_mission(yaml_text(document)), date(2026, 1, 1))
    assert found.status == "warn"
    (text,) = [str(warning) for warning in found.warnings if "differs from that of free fall" in str(warning)]
    assert ("by 5.1 % of gravity" in text) == is_placed
    assert ("add scene.latitude" in text) == (not is_placed)


@pytest.mark.parametrize(("frame", "count"), [("ric", 1), ("look", 0)])
def test_ric_of_a_high_path_that_does_not_fall_is_a_doubt(frame: str, count: int) -> None:
    """In free fall its velocities are against the stars: in geosynchronous orbit, 1 m moves the image by 110 m. In
    another path they are Earth-fixed, and it is 0.07 m. The phase is negligible in either case."""
    document = replace(CASES[0], frame=frame, aperture_time=4).document(position=["0 m", "1 m", "0 m"])
    acceleration = document["platforms"]["transmitter"]["acceleration"]
    acceleration[0] += 0.051 * MU / GEO**2
    found = check_mission(parse_mission(yaml_text(document)), date(2026, 1, 1))
    texts = [str(warning) for warning in found.warnings if "differs from that of free fall" in str(warning)]
    assert len(texts) == count
    assert all("velocity errors in ric are rates of Earth-fixed vectors" in text for text in texts)
