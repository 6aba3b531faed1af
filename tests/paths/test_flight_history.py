"""The velocity of a logged flight beyond the aperture, which an aided navigation needs."""

import math
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.mission.load import load_mission
from bisar_budget.paths.flight_history import history_of

RATE, SPEED, RADIUS = 10.0, 25.0, 1000.0  # Hz, m/s, m


def circle(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    angle = times * SPEED / RADIUS
    places = RADIUS * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    return places, SPEED * np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=-1)


def test_velocity_on_a_circle_with_noise() -> None:
    """A parabola through 20 fixes with 1 cm of noise has a velocity error of 1 cm·√12/(2 s·√20) = 4 mm/s."""
    times = np.arange(-60, 60, 1 / RATE)
    places, _ = circle(times)
    noisy = places + 0.01 * np.random.default_rng(1).standard_normal(places.shape)
    history = history_of(times, noisy, -50.0, 50.0)
    assert history is not None
    asked = np.linspace(-49, 49, 300)
    error = history.at(asked) - circle(asked)[1].T
    assert np.sqrt(np.mean(error**2)) == pytest.approx(0.0039, rel=0.25)


def test_beyond_the_log_the_flight_is_straight() -> None:
    times = np.arange(-5, 5, 1 / RATE)
    history = history_of(times, circle(times)[0], -60.0, 60.0)
    assert history is not None
    ends = history.at(np.array([-60.0, -5.0, 4.9, 60.0]))
    assert ends[:, 0] == pytest.approx(ends[:, 1])
    assert ends[:, 3] == pytest.approx(ends[:, 2])


def test_a_gap_of_the_log_is_bridged() -> None:
    times = np.concatenate((np.arange(-20, -3, 0.1), np.arange(3, 20, 0.1)))
    history = history_of(times, circle(times)[0], -20.0, 20.0)
    assert history is not None
    assert history.at(np.array([0.0]))[:, 0] == pytest.approx([0.0, SPEED, 0.0], abs=0.1)


def test_a_few_fixes_make_no_history() -> None:
    times = np.arange(4.0)
    assert history_of(times, circle(times)[0], 0.0, 3.0) is None


AIDED = """
schema_version: 1
name: A turn
radar: {{center_frequency: 10 GHz, bandwidth: 300 MHz}}
collection: {{aperture_time: 4 s}}
platforms:
  transmitter: {{position: [30 km, 0 km, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s]}}
  receiver:
    {path}
    motion_error:
      navigation: {{imu: {{sensor: stim300}}, gnss: {{sensor: mosaic-x5-rtk, rate: 5 Hz}}}}
"""


def heading_error(file: Path) -> float:
    (error,) = [error for error in Analysis(load_mission(str(file))).random if error.navigation is not None]
    assert error.navigation is not None
    return error.navigation.at_middle[3]


def test_turns_before_the_aperture_reveal_the_heading(tmp_path: Path) -> None:
    """With a log that turns, the heading is known; with the same velocity and no log, the flight was straight."""
    times = np.arange(-65, 65, 0.2)
    angle = times * SPEED / RADIUS
    places = np.stack([RADIUS * np.sin(angle), RADIUS * (1 - np.cos(angle)), 500 + 0 * angle], axis=-1)
    start = np.array([3000.0, 0.0, 0.0])
    lines = [f"{t:.2f}, {x:.4f}, {y:.4f}, {z:.4f}" for t, (x, y, z) in zip(times, places + start, strict=True)]
    (tmp_path / "turn.csv").write_text("time [s], east [m], north [m], up [m]\n" + "\n".join(lines) + "\n")
    logged, straight = tmp_path / "logged.yaml", tmp_path / "straight.yaml"
    logged.write_text(AIDED.format(path="trajectory: {file: turn.csv, center: 0 s}"))
    straight.write_text(AIDED.format(path="position: [3 km, 0 m, 500 m]\n    velocity: [25 m/s, 0 m/s, 0 m/s]"))
    assert heading_error(straight) == pytest.approx(math.radians(5), rel=1e-3)
    assert heading_error(logged) < math.radians(0.3)
