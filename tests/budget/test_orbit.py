"""Satellites on straight paths: the warning, and the acceleration that it offers."""

import re

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.findings.status import exit_code
from bisar_budget.paths.earth import free_fall
from bisar_budget.report import FORMATS, Style, render
from tests.conftest import ROOT, findings

SATELLITE = {"position": ["353.9 km", 0, "505.4 km"], "velocity": [0, "7.6 km/s", 0]}
POLAR = {
    "slant_range": "854 km",
    "azimuth": "120 deg",
    "elevation": "52 deg",
    "speed": "7.5 km/s",
    "motion_azimuth": "10 deg",
}
DECLARED = {"platforms__receiver__motion_error__position": "1 cm"}


def warned(**changes) -> list[str]:
    return [warning.message for warning in findings(**changes).warnings if "satellite" in warning.message]


def test_the_acceleration_points_to_the_centre_and_holds_a_circular_orbit() -> None:
    """Tables have 7.6126 km/s for a height of 500 km over the equator's radius, 6378.137 km; a = v²/r."""
    a = free_fall((0.0, 0.0, 6878.137e3 - 6371e3), (0.0, 7.6e3, 0.0), None)
    assert a[:2] == (0.0, 0.0)
    assert a[2] == pytest.approx(-(7612.6**2) / 6878.137e3, rel=1e-4)
    position = (353.9e3, -120e3, 505.4e3)
    a = free_fall(position, (0.0, 7.6e3, 0.0), None)
    ratios = [part / (here - centre) for part, here, centre in zip(a, position, (0, 0, -6371e3), strict=True)]
    assert ratios == pytest.approx([ratios[0]] * 3)
    assert ratios[0] < 0


@pytest.mark.parametrize("satellite", [SATELLITE, POLAR], ids=["cartesian", "polar"])
def test_what_the_warning_offers_can_be_pasted(satellite: dict) -> None:
    found = findings(platforms__transmitter=satellite, **DECLARED)
    (text,) = [warning.message for warning in found.warnings if "satellite" in warning.message]
    assert found.status == "warn"
    assert exit_code({found.status}, strict=True) == 1
    assert exit_code({found.status}, strict=False) == 0
    pasted = re.search(r"acceleration: \[([^]]*)\]", text)[1].split(", ")
    curved = findings(platforms__transmitter={**satellite, "acceleration": pasted}, **DECLARED)
    assert not any("satellite" in warning.message for warning in curved.warnings)
    assert curved.status == "pass"
    state = curved.geometry.transmitter
    assert state.acceleration == pytest.approx(
        free_fall(state.position, state.velocity, None), abs=6e-4
    )  # three decimals
    assert "needs the latitude" in text


@pytest.mark.parametrize(("speed", "count"), [("2999 m/s", 0), ("3001 m/s", 1)])
def test_both_sides_of_the_speed(speed: str, count: int) -> None:
    """Below 100 km the speed alone says that a straight path is a satellite's."""
    low = {"position": ["35.4 km", 0, "50.5 km"], "velocity": [0, speed, 0]}
    assert len(warned(platforms__transmitter=low)) == count


def test_each_platform_is_warned_of_at_its_velocity() -> None:
    receiver = {**SATELLITE, "position": ["354.2 km", "50 m", "505.4 km"]}
    found = findings(platforms__transmitter=SATELLITE, platforms__receiver=receiver)
    lines = [w.line for w in found.warnings if "satellite" in w.message]
    assert len(set(lines)) == 2


def test_an_acceleration_in_the_file_is_a_decision() -> None:
    assert warned(platforms__transmitter={**SATELLITE, "acceleration": [0, 0, 0]}) == []


@pytest.mark.parametrize("format_name", sorted(set(FORMATS) - {"csv", "needs"}))  # formats of rows alone
def test_every_format_offers_it(format_name: str) -> None:
    found = findings(platforms__transmitter=SATELLITE, **DECLARED)
    text = render(format_name, Report(version="0", missions=(found,)), Style())
    plain = re.sub(r"\s+", " ", text.replace("\\", "").replace("%2C", ",").replace("&#x27;", "'"))
    assert "acceleration: [-0.432 m/s^2, 0.000 m/s^2, -8.396 m/s^2]" in plain


def test_no_example_flies_a_straight_orbit(run) -> None:
    for path in sorted((ROOT / "specs/missions").glob("*.yaml")):
        assert "speed of a satellite" not in run("check", path).stdout
