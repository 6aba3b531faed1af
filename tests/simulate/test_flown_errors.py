"""Errors as they are flown once: a vibration by its spectrum, and what is known by its effect alone."""

import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import mainlobe_energy
from bisar_budget.faults import SetValue
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.simulator.collection import PointCollection
from bisar_budget.simulator.phase_history import path
from bisar_budget.simulator.point import declared_errors
from tests.conftest import mission_file, mission_text


def test_errors_stated_by_their_effects_have_these_effects_in_the_images() -> None:
    """They were in no image, and nothing said so. The coverage factor does not multiply them."""
    effects = {"quadratic_phase_error": "20 deg", "cubic_phase_error": "10 deg", "location_error": "5 m"}
    others = [{"name": "feed", "islr": "-30 dB"}, {"name": "antenna", "islr": "-30 dB", **effects}]
    mission = parse_mission(mission_text(other_errors=others, allocation__coverage_factor=2))
    flown = declared_errors(mission)
    moved = PointCollection(mission, mission.geometry).effect(flown.still())
    assert math.degrees(moved.quadratic) == pytest.approx(20, abs=0.02)
    assert math.degrees(moved.cubic) == pytest.approx(10, abs=0.02)
    assert moved.displacement == pytest.approx((5.0, 0.0), abs=0.02)
    phase = 2 * math.pi * flown.receiver.wideband_rms / mission.radar.wavelength
    energy = mainlobe_energy(mission)
    assert 10 * math.log10(math.expm1(phase**2) / energy) == pytest.approx(10 * math.log10(2e-3), abs=0.01)


@pytest.mark.parametrize("beside", ["receiver.navigation", "receiver.random.GNSS"])
def test_a_spectrum_is_flown_beside_errors_that_change_slowly(beside: str) -> None:
    """A shaking airframe with an inertial sensor, aided or running free; histories of two lengths were mixed."""
    mission = load_mission(str(mission_file("uav_vibrating_ocxo")))
    if beside == "receiver.random.GNSS":
        spectrum = "{100 Hz: 0.04 g^2/Hz, 1 kHz: 0.04 g^2/Hz, 2 kHz: 0.01 g^2/Hz}"
        change = SetValue("platforms.receiver.motion_error.vibration.spectrum", spectrum)
        mission = load_mission(str(mission_file("uav_free_running")), changes=[change])
    course = declared_errors(mission).receiver.course
    assert course is not None
    assert course.times.shape == course.values.shape[:1]
    sight = np.array(mission.platforms.receiver.state.look)
    fast = course.values @ sight - course.smooth(7).values @ sight
    errors = {one.id: one for one in Analysis(mission).random}
    flown = [errors[name] for name in ("receiver.vibration.spectrum", beside)]
    phases = [one.full.spread * one.declared for one in flown]
    rms = np.hypot(*phases) * mission.radar.wavelength / (2 * np.pi)
    assert np.std(fast) == pytest.approx(rms, rel=0.25)  # one draw, and the error beside it is slow


@pytest.mark.parametrize("height", [10.0, -3.0])
def test_a_wrong_height_of_the_scene_is_flown(height: float) -> None:
    """Both platforms are measured too high by as much, once, whatever the coverage factor. It was left out."""
    platforms = {
        "transmitter": {"position": [6e3, 0, 2e3], "velocity": [0, 40, 0], "motion_error": {"position": [0, 0, 1]}},
        "receiver": {"position": [3e3, 3e3, 1e3], "velocity": [-20, 20, 0]},
    }
    flown = declared_errors(
        parse_mission(
            mission_text(platforms=platforms, scene={"height_error": height}, allocation__coverage_factor=2)
        )
    )
    assert flown.transmitter.position == (0.0, 0.0, 2.0)
    assert flown.transmitter.height == flown.receiver.height == height
    states = Analysis(parse_mission(mission_text(platforms=platforms))).geometry.both
    times = np.array([-1.0, 0.0, 1.0])
    for state, error, raised in zip(states, (flown.transmitter, flown.receiver), (2.0 + height, height), strict=True):
        flight = path(state, times, error)
        assert flight.measured - flight.actual == pytest.approx(np.outer(np.ones(3), (0.0, 0.0, raised)))
