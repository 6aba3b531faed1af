"""The section `navigation` of a motion error: what it takes, and what it says of wrong input."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY, row

NAVIGATION = "imu: {sensor: stim300}, gnss: {sensor: mosaic-x5-rtk, rate: 5 Hz}"
TEXT = """
schema_version: 1
name: UAV
radar: {{center_frequency: 9.65 GHz, bandwidth: 300 MHz}}
collection: {{aperture_time: 2.5 s}}
platforms:
  transmitter: {{position: [30.41 km, 0 m, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s]}}
  receiver:
    position: [1.5 km, 0.5 km, 400 m]
    velocity: [0 m/s, 25 m/s, 0 m/s]
    motion_error: {{{error}}}
requirements: {{quadratic_phase_error: 45 deg, islr: -20 dB{more}}}
"""
FIGURES = "accelerometer_bias: 6 ug, gyro_bias: 0.5 deg/h, velocity_random_walk: 0.024 m/s/sqrt(h), "
FIGURES += "angle_random_walk: 0.15 deg/sqrt(h)"


def text_of(navigation: str = NAVIGATION, beside: str = "", more: str = "") -> str:
    return TEXT.format(error=f"{beside}navigation: {{{navigation}}}", more=more)


WRONG = {
    "imu beside it": (text_of(beside="imu: {gyro_bias: 1 deg/h}, "), r"motion_error\.imu: stands beside navigation"),
    "covariance beside it": (
        text_of(beside="covariance: {position: 1 cm, velocity: 1 cm/s}, "),
        r"motion_error\.covariance: stands beside navigation, which replaces it",
    ),
    "random beside it": (
        text_of(beside="random: [{name: g, sigma: 1 mm, correlation_time: 1 s}], "),
        r"motion_error\.random: stands beside navigation",
    ),
    "sensor beside it": (text_of(beside="sensor: stim300, "), r"motion_error\.sensor: stands beside navigation"),
    "no rate": (text_of(NAVIGATION.replace(", rate: 5 Hz", "")), r"navigation\.gnss\.rate: is missing"),
    "rate of zero": (text_of(NAVIGATION.replace("5 Hz", "0 Hz")), r"gnss\.rate: must be greater than 0 Hz"),
    "no receiver": (text_of("imu: {sensor: stim300}"), r"navigation\.gnss: is missing"),
    "no position": (text_of("imu: {sensor: stim300}, gnss: {rate: 5 Hz}"), r"gnss\.position: is missing; accepted"),
    "a figure missing": (
        text_of(NAVIGATION.replace("sensor: stim300", "gyro_bias: 1 deg/h")),
        r"imu\.velocity_random_walk: is missing; accepted: a figure of a data sheet, or imu\.sensor",
    ),
    "a part without a figure": (
        text_of(NAVIGATION.replace("stim300", "hg9900")),
        r"imu\.velocity_random_walk: is missing: Honeywell HG9900 states none",
    ),
    "a part of another kind": (
        text_of(NAVIGATION.replace("stim300", "mosaic-x5-rtk")),
        r"imu\.sensor: is a GNSS receiver .*accepted: parts of the kind imu",
    ),
    "no part": (text_of(NAVIGATION.replace("stim300", "stim3000")), r"is no part of the catalogue .*'stim300'\?"),
    "attitude": (text_of(NAVIGATION.replace("stim300", "stim300, attitude: 1 deg")), r"attitude: is not a known key"),
    "fixes after a filter": (
        text_of(f"{NAVIGATION}, method: filtered, after: 3 s"),
        r"after: a filter uses no fixes after the aperture",
    ),
    "an outage backwards": (text_of(f"{NAVIGATION}, outages: [{{from: 3 s, to: -2 s}}]"), r"\.to: is not after from"),
    "half an outage": (text_of(f"{NAVIGATION}, outages: [{{from: 3 s}}]"), r"outages\[0\]\.to: is missing; accepted"),
    "an outage of words": (text_of(f"{NAVIGATION}, outages: [tunnel]"), r"outages\[0\]: must be a mapping of times"),
    "a key of an outage": (
        text_of(f"{NAVIGATION}, outages: [{{from: 1 s, to: 2 s, at: 1 s}}]"),
        r"outages\[0\]\.at: is not a known key",
    ),
    "too many fixes": (
        text_of(NAVIGATION.replace("5 Hz", "10 kHz")),
        r"gnss\.rate: makes 1\.23e\+06 fixes .*accepted: at most 20000; .* a rate of 1\.6e\+02 Hz",
    ),
    "a negative sigma": (text_of(NAVIGATION.replace("5 Hz", "5 Hz, position: -1 cm")), r"must be greater than 0 m"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_input_is_named(name: str, tmp_path: Path, run: Callable[..., Result]) -> None:
    text, message = WRONG[name]
    file = tmp_path / "mission.yaml"
    file.write_text(text)
    result = run("check", str(file))
    assert result.exit_code == 2
    assert re.search(message, result.stderr)


def test_figures_of_the_file_replace_those_of_a_part() -> None:
    whole, of_part = (
        check_mission(parse_mission(text_of(navigation), "mission.yaml"), TODAY)
        for navigation in (
            NAVIGATION.replace("stim300", "stim300, gyro_bias: 5 deg/h"),
            NAVIGATION.replace("sensor: stim300", FIGURES.replace("0.5 deg/h", "5 deg/h")),
        )
    )
    first, second = (row(found, "receiver.navigation") for found in (whole, of_part))
    assert first.utilization == pytest.approx(second.utilization, rel=1e-12)
    assert [note.code for note in first.notes].count("overrides-a-part") == 1
    assert "gyro_bias" in str(next(note for note in first.notes if note.code == "overrides-a-part"))


def test_navigation_declares_sensor_and_noise_but_no_datum() -> None:
    declare = ", declare: [receiver.imu, receiver.random, receiver.navigation]"
    found = check_mission(parse_mission(text_of(more=declare), "mission.yaml"), TODAY)
    assert row(found, "mission.declare").status == "pass"
    owed = declare.replace("]", ", receiver.position]")
    found = check_mission(parse_mission(text_of(more=owed), "mission.yaml"), TODAY)
    assert row(found, "mission.declare").status == "not_evaluated"
    assert "receiver.navigation" in found.kinds.declared
    assert {"receiver.imu", "receiver.random"}.isdisjoint((*found.kinds.declared, *found.kinds.missing))


WARNED = {
    "no fix": (f"{NAVIGATION}, outages: [{{from: -100 s, to: 100 s}}]", "navigation-has-no-fix"),
    "a short flight": (
        f"{NAVIGATION.replace('5 Hz', '0.3 Hz')}, before: 0 s, after: 0 s",
        "navigation-has-not-converged",
    ),
    "a long flight": (f"{NAVIGATION}, before: 20 s, after: 20 s", ""),
    "as usual": (NAVIGATION, ""),
}


@pytest.mark.parametrize("name", WARNED)
def test_flights_that_tell_too_little_are_said(name: str) -> None:
    navigation, code = WARNED[name]
    found = check_mission(parse_mission(text_of(navigation), "mission.yaml"), TODAY)
    codes = [warning.message.code for warning in found.warnings]
    assert [each for each in codes if each.startswith("navigation")] == ([code] if code else [])


@pytest.mark.parametrize(
    ("acceleration", "scale", "is_said"),
    [("3 m/s^2", "75 ppm", False), ("3 m/s^2", "85 ppm", True), ("0 m/s^2", "10 %", False)],
)
def test_a_scale_factor_in_a_turn_is_said(acceleration: str, scale: str, *, is_said: bool) -> None:
    """s·3 m/s² over 2.5 s at 31.07 mm is 4.5°, a tenth of the requirement, from 166 ppm; 10 % passed unseen.

    QPE = 2π/λ·s·a·T²/8 = s·474 rad. Twice the sigma counts with a coverage factor of 2, so that 83 ppm are the limit.
    """
    text = text_of(NAVIGATION.replace("stim300", f"stim300, accelerometer_scale_factor: {scale}"))
    text = (
        text.replace(
            "velocity: [0 m/s, 25 m/s, 0 m/s]",
            f"velocity: [0 m/s, 25 m/s, 0 m/s]\n    acceleration: [{acceleration}, 0 m/s^2, 0 m/s^2]",
        )
        + "allocation: {coverage_factor: 2}\n"
    )
    found = check_mission(parse_mission(text, "mission.yaml"), TODAY)
    assert ("scale-factor-in-a-turn" in [warning.message.code for warning in found.warnings]) == is_said


FREE = {
    "beside a receiver of the catalogue": ("sensor: [stim300, mosaic-x5-rtk]", "sensor-runs-free-not-aided"),
    "a part that lacks figures": ("sensor: [hg9900, mosaic-x5-rtk]", "sensor-runs-free"),
    "without a receiver": ("sensor: stim300", ""),
    "without a sensor": ("sensor: mosaic-x5-rtk", ""),
}


@pytest.mark.parametrize("name", FREE)
def test_a_sensor_that_runs_free_beside_gnss_is_said(name: str) -> None:
    error, code = FREE[name]
    found = check_mission(parse_mission(TEXT.format(error=error, more=""), "mission.yaml"), TODAY)
    codes = [warning.message.code for warning in found.warnings if "runs-free" in warning.message.code]
    assert codes == ([code] if code else [])


@pytest.mark.parametrize(("velocity", "is_said"), [("14.3 mm/s", False), ("14.5 mm/s", True)])
def test_sigmas_that_contradict_each_other_are_said(velocity: str, *, is_said: bool) -> None:
    """6 mm at every moment leave room for three times that in half an aperture of 1.25 s: 14.4 mm/s."""
    text = TEXT.format(error=f"position: 6 mm, velocity: {velocity}", more="")
    found = check_mission(parse_mission(text, "mission.yaml"), TODAY)
    assert ("position-and-velocity-contradict" in [warning.message.code for warning in found.warnings]) == is_said


def test_explanation_names_what_it_rests_on(tmp_path: Path, run: Callable[..., Result]) -> None:
    file = tmp_path / "mission.yaml"
    file.write_text(text_of(f"{NAVIGATION}, outages: [{{from: -2 s, to: 3 s}}]"))
    words = " ".join(run("check", str(file), "--explain", "receiver.navigation").stdout.split())
    for part in (
        "STIM300 data sheet TS1524",
        "Smoothed: fixes after a moment count too; fixes from -61.25 s to 61.25 s, without those of -2 s to 3 s",
        "Cov = P_i·Ψ(j, i)ᵀ·(1 − Λ_j·P_j)",
        "tilt (roll and pitch) = ",
        "correlation = -",
        "their sigmas must not be added",
        "Change of the quadratic phase by each figure, the largest first imu.",
        "T = 10 s: QPE ",
    ):
        assert part in words, part
