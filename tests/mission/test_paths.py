"""Paths that the place of the scene on the Earth decides, and what is asked of a file that needs one."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.budget.file_warnings import paths_in_doubt
from bisar_budget.faults import MissionError
from bisar_budget.mission import paths
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.paths import earth, flight
from tests.conftest import mission_text

SCENE = {"latitude": "48.0866 deg", "longitude": "11.2797 deg", "height": "590 m"}
FLIGHT = {
    "latitude": "48.20 deg",
    "longitude": "11.10 deg",
    "altitude": "3 km",
    "heading": "60 deg",
    "speed": "120 kn",
    "climb": "2 m/s",
}
OMEGA = 7.292115e-5  # rad/s, WGS-84


def mission(**changes: Any) -> Mission:
    return parse_mission(mission_text(**{"scene": SCENE, **changes}), "m.yaml")


def said(**changes: Any) -> str:
    with pytest.raises(MissionError) as error:
        mission(**changes)
    # The files that these missions name are not there, which is said beside what is wrong by itself.
    (line,) = [one for one in error.value.lines() if "cannot be read: No such file" not in one]
    return line


def ellipsoid(latitude: float, longitude: float, height: float) -> np.ndarray:
    """Point of the ellipsoid's normal at a height, from its equation x²/a² + y²/a² + z²/b² = 1 alone."""
    a, b = 6378137.0, 6378137.0 * (1 - 1 / 298.257223563)
    normal = np.array(
        [
            math.cos(latitude) * math.cos(longitude),
            math.cos(latitude) * math.sin(longitude),
            math.sin(latitude),
        ]
    )
    # The foot has the gradient of the equation along the normal.
    foot = np.array([a * a, a * a, b * b]) * normal
    return foot / math.sqrt(float(foot @ normal)) + height * normal


@given(st.floats(-1.57, 1.57), st.floats(-math.pi, math.pi), st.floats(-5e3, 4e7))
def test_geodetic_places_are_those_of_the_ellipsoid_and_come_back(latitude, longitude, height) -> None:
    place = earth.earth_fixed(earth.Geodetic(latitude, longitude, height))
    # Rounding of a coordinate of 4e7 m is 7e-9 m.
    assert np.allclose(place, ellipsoid(latitude, longitude, height), rtol=0, atol=5e-8)
    back = earth.geodetic(place)
    assert back.latitude == pytest.approx(latitude, abs=1e-13)
    assert math.remainder(back.longitude - longitude, 2 * math.pi) * math.cos(latitude) == pytest.approx(0, abs=1e-13)
    assert back.height == pytest.approx(height, abs=1e-7)


@pytest.mark.parametrize("latitude", [-math.pi / 2, math.pi / 2])
def test_a_pole_has_a_place(latitude: float) -> None:
    back = earth.geodetic((0.0, 0.0, math.copysign(6356752.314245 + 100, latitude)))
    assert back.latitude == latitude
    assert back.height == pytest.approx(100, abs=1e-6)  # the printed polar radius has so many digits


class TestLevelFlight:
    def test_it_stays_at_its_height_on_its_heading(self) -> None:
        """Flown on by its own velocity and acceleration, the height changes by the climb alone: 2 m/s.

        What is left over 5 s, the third order and the turn of the geodesic, is v³t³/6R² = 0.1 µm and less.
        """
        state = mission(platforms__receiver=FLIGHT).platforms.receiver.state
        axes = earth.axes_at(earth.Geodetic(math.radians(48.0866), math.radians(11.2797), 590.0))
        start = earth.Geodetic(math.radians(48.2), math.radians(11.1), 3000.0)
        for tau in (-5.0, 0.0, 5.0):
            there = earth.geodetic(axes.earth_fixed(state.at(tau)[0]))
            assert there.height == pytest.approx(3000 + 2 * tau, abs=1e-3)
        ahead = earth.geodetic(axes.earth_fixed(state.at(5.0)[0]))
        north = (ahead.latitude - start.latitude) * 6.378e6
        east = (ahead.longitude - start.longitude) * 6.388e6 * math.cos(start.latitude)
        assert math.degrees(math.atan2(east, north)) == pytest.approx(60, abs=0.2)  # radii to 0.1 %
        assert math.hypot(north, east) == pytest.approx(5 * 120 * 1852 / 3600, rel=2e-3)

    @pytest.mark.parametrize(
        ("latitude", "speed", "climb"), [(48.2, 250.0, 30.0), (-89.9, 250.0, 0.0), (0.0, 1500.0, 0.0)]
    )
    def test_fast_and_climbing_it_keeps_what_a_geodesic_keeps(
        self, latitude: float, speed: float, climb: float
    ) -> None:
        """Height and level speed as stated; of level flight Clairaut's constant."""
        start, heading = earth.Geodetic(math.radians(latitude), 0.3, 9e3), 1.1
        constants = []
        for tau in np.linspace(-30, 30, 7):
            before, here, after = (
                np.array(earth.flown(start, heading, speed, climb, tau + step)) for step in (-0.05, 0.0, 0.05)
            )
            at = earth.geodetic(tuple(here))
            assert at.height == pytest.approx(9e3 + climb * tau, abs=1e-5)
            east, north, _ = earth.axes_at(at).axes
            level = np.array([np.dot(axis, after - before) / 0.1 for axis in (east, north)])
            # A difference over 0.1 s rounds places of 6e6 m to 2e-8 m/s, and leaves v³t²/6R² = 1e-8 m/s at most.
            assert math.hypot(*level) == pytest.approx(speed, abs=1e-6)
            constants.append(math.hypot(*here[:2]) * level[0] / speed)
        if not climb:
            assert np.ptp(constants) < 1e-3 * max(1.0, speed / 250)  # m, of up to 6.4e6 m: 5e-9 rad of heading

    def test_it_says_how_far_its_polynomial_is_from_it(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """It was silent of the fit, and of a doubt about it. 5000 km/h for 200 s: an arc of 278 km."""
        fast = {"platforms__receiver": {**FLIGHT, "speed": "1389 m/s"}, "collection__aperture_time": "200 s"}
        path = mission(**fast).platforms.receiver.path
        axes = earth.axes_at(earth.Geodetic(math.radians(48.0866), math.radians(11.2797), 590.0))
        start = earth.Geodetic(math.radians(48.2), math.radians(11.1), 3000.0)
        off = [
            math.dist(path.state.at(tau)[0], axes.place(earth.flown(start, math.radians(60), 1389.0, 2.0, tau)))
            for tau in np.linspace(-100, 100, 101)
        ]
        assert path.order > 2
        assert path.rms <= path.farthest
        assert max(off) == pytest.approx(path.farthest, rel=0.5, abs=2e-9)  # looked at in other places
        assert path.doubts == ()
        monkeypatch.setattr(flight, "_MAX_INTERPOLATION_ERROR_M", 0.0)
        monkeypatch.setattr(paths, "_paths", {})
        (doubt,) = mission(**fast).platforms.receiver.path.doubts
        assert doubt == f"the polynomial that is flown is up to {path.farthest:.3g} m from the path"

    def test_a_place_that_does_not_move_needs_no_heading(self) -> None:
        fixed = {key: FLIGHT[key] for key in ("latitude", "longitude", "altitude")}
        found = mission(platforms__receiver={**fixed, "speed": 0})
        assert found.platforms.receiver.state.velocity == (0, 0, 0)
        assert found.platforms.receiver.path.source == "geodetic position"


class TestRadialAxes:
    @given(
        st.tuples(*[st.floats(-5e5, 5e5)] * 2, st.floats(1e5, 8e5)),
        st.tuples(*[st.floats(-8e3, 8e3)] * 3),
    )
    def test_they_are_those_of_positions_against_the_stars(self, position, velocity) -> None:
        """By brute force: Earth-fixed places a second apart, turned with the Earth, span the plane of the orbit."""
        axes = earth.axes_at(earth.Geodetic(0.7, -1.2, 300.0))
        places = []
        for tau in (-0.5, 0.5):
            place = np.array(axes.earth_fixed(tuple(p + tau * v for p, v in zip(position, velocity, strict=True))))
            angle = OMEGA * tau
            turn = np.array(
                [[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]
            )
            places.append(turn @ place)
        radial = np.array(axes.earth_fixed(position))
        radial /= np.linalg.norm(radial)
        across = np.cross(radial, places[1] - places[0])
        if np.linalg.norm(across) < 10:
            return  # the plane is that of rounding
        across /= np.linalg.norm(across)
        want = [axes.turned(tuple(one)) for one in (radial, np.cross(across, radial), across)]
        assert np.allclose(axes.radial(position, velocity), want, rtol=0, atol=1e-5)  # a second bends 1e-6 rad

    def test_errors_along_them_are_rows(self) -> None:
        found = mission(
            platforms__receiver={**FLIGHT, "motion_error": {"frame": "ric", "position": ["5 m", "20 m", "3 m"]}}
        )
        frame = found.platforms.receiver.state.frame("ric")
        assert np.allclose(np.array(frame) @ np.array(frame).T, np.eye(3), atol=1e-14)
        # Some 20 km away, radial is nearly the scene's vertical.
        assert frame[0][2] == pytest.approx(1, abs=1e-5)

    def test_without_the_scene_on_the_earth_there_are_none(self) -> None:
        text = mission_text(platforms__receiver__motion_error={"frame": "ric", "position": "1 m"})
        with pytest.raises(MissionError) as error:
            parse_mission(text, "m.yaml")
        assert error.value.lines() == [
            "m.yaml:28:14: platforms.receiver.motion_error.frame: the ric frame needs the scene's latitude, "
            "longitude and height (got ric); accepted: scene"
        ]


class TestAPathInOneOfItsWays:
    @pytest.mark.parametrize(
        ("platform", "words"),
        [
            ({"latitude": "48 deg", "speed": 0}, "lacks longitude, altitude"),
            ({**FLIGHT, "position": [1, 2, 3]}, "mixes position with latitude"),
            ({**FLIGHT, "azimuth": "3 deg"}, "mixes latitude with azimuth"),
            ({**FLIGHT, "acceleration": [0, 0, 1]}, "mixes latitude with acceleration"),
            ({**FLIGHT, "speed": 0}, "a platform with speed 0 has none"),
            ({**FLIGHT, "latitude": "91 deg"}, "must be at most 90 deg (got 91 deg)"),
            ({"orbit": {}}, "is empty"),
            ({"orbit": {"tle": "a.tle", "oem": "b.oem"}}, "mixes tle with oem"),
            ({"orbit": {"tle": ["only one"]}}, "must be the name of a file, or the two lines of an element set"),
            ({"orbit": {"tle": "a.tle"}, "speed": "3 m/s"}, "mixes orbit with speed"),
            ({"trajectory": {"file": "a.csv", "format": "kml"}}, "is not a known choice"),
            ({"trajectory": {"file": "a.csv", "format": "txt"}}, "is not a known choice"),
            ({**FLIGHT, "altitude": "-9 km"}, "below the scene's horizon"),
        ],
    )
    def test_what_is_no_path(self, platform: dict[str, Any], words: str) -> None:
        assert words in said(platforms__receiver=platform)

    def test_what_a_path_on_the_earth_needs(self) -> None:
        need = "needs the scene's position on the Earth"
        assert need in said(scene={}, platforms__receiver=FLIGHT)
        assert need in said(scene={}, platforms__receiver={"orbit": {"tle": "a.tle"}})
        assert "needs an instant" in said(platforms__receiver={"orbit": {"tle": "a.tle"}})

    def test_a_scene_has_all_of_its_place_or_nothing(self) -> None:
        assert "lacks longitude, height" in said(scene={"latitude": "48 deg"})

    @pytest.mark.parametrize("text", ["2026-06-01", "2026-02-30T05:20:31Z", "noon", 3])
    def test_an_instant_is_utc_to_the_second_at_least(self, text: Any) -> None:
        assert "must be an instant of UTC" in said(collection__center_time=text)

    def test_an_instant_without_a_zone_is_told_so(self) -> None:
        assert "has no zone (got 2026-06-01T05:20:31)" in said(collection__center_time="2026-06-01T05:20:31")

    def test_instants_keep_their_digits(self) -> None:
        a = mission(collection__center_time="2026-06-01T05:20:31.123456789Z").collection.center_time
        b = mission(collection__center_time="2026-06-01 05:20:31,123456788+00:00").collection.center_time
        assert a.since(b) == pytest.approx(1e-9, abs=1e-11)
        assert a.as_text() == "2026-06-01T05:20:31.123Z"


def test_jerk_and_snap_are_derivatives() -> None:
    """By differences of the path a second apart, exact for a polynomial of order 4."""
    found = mission(
        scene={}, platforms__receiver__jerk=["1 m/s^3", "2 m/s^3", 0], platforms__receiver__snap=[0, 0, "3 m/s^4"]
    )
    state = found.platforms.receiver.state
    places = [np.array(state.at(float(tau))[0]) for tau in range(-2, 3)]
    third = (places[4] - 2 * places[3] + 2 * places[1] - places[0]) / 2
    fourth = places[4] - 4 * places[3] + 6 * places[2] - 4 * places[1] + places[0]
    assert third == pytest.approx([1, 2, 0], abs=1e-9)
    assert fourth == pytest.approx([0, 0, 3], abs=1e-9)
    for early, late in pairwise(np.linspace(-2, 2, 9)):
        middle = np.array(state.at((early + late) / 2)[1])
        chord = (np.array(state.at(late)[0]) - np.array(state.at(early)[0])) / (late - early)
        assert middle == pytest.approx(chord, abs=0.1)


def gravitation(place: np.ndarray) -> np.ndarray:
    """Gradient of the potential of a flattened Earth, by differences of 10 m. [m/s²]"""

    def potential(x: np.ndarray) -> float:
        r = np.linalg.norm(x)
        return 3.986004418e14 / r * (1 - 1.08263e-3 * (6378137 / r) ** 2 * (3 * (x[2] / r) ** 2 - 1) / 2)

    return np.array([(potential(place + step) - potential(place - step)) / 20 for step in 10 * np.eye(3)])


def test_a_straight_orbit_over_the_earth_is_told_the_acceleration_of_its_own() -> None:
    """Against a fall of 2 s that is integrated against the stars and turned into Earth-fixed axes."""
    position, velocity = np.array([-200e3, 100e3, 690e3]), np.array([1e3, 7.4e3, 100.0])
    found = mission(
        platforms__transmitter={"position": position.tolist(), "velocity": velocity.tolist()},
        platforms__receiver=FLIGHT,
    )
    axes = earth.axes_at(earth.Geodetic(math.radians(48.0866), math.radians(11.2797), 590.0))
    r = np.array(axes.earth_fixed(tuple(position)))
    w = np.array([0, 0, OMEGA])
    v = np.array(axes.turned_back(tuple(velocity))) + np.cross(w, r)

    def fallen(tau: float, steps: int = 2000) -> np.ndarray:
        place, speed, step = r.copy(), v.copy(), tau / steps
        for _ in range(steps):  # leapfrog; its error is of step², 1e-9 m here
            speed = speed + gravitation(place) * step / 2
            place = place + speed * step
            speed = speed + gravitation(place) * step / 2
        angle = -OMEGA * tau
        turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
        return np.array(axes.place(tuple(turn @ place)))

    want = fallen(1.0) - 2 * position + fallen(-1.0)  # per s²; the fourth order leaves ω⁴r/12, 1e-6 m/s²
    state = found.platforms.transmitter.state
    assert earth.free_fall(state.position, state.velocity, found.scene.axes) == pytest.approx(want, abs=2e-5)
    (warning,) = paths_in_doubt(found)
    assert f"acceleration: [{want[0]:.3f} m/s^2, {want[1]:.3f} m/s^2, {want[2]:.3f} m/s^2]" in warning.message
