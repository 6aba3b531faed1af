"""Satellites on straight paths: the warning, and the acceleration that it offers."""

import re

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.findings.status import exit_code
from bisar_budget.paths.earth import free_fall
from bisar_budget.report import Style, render
from tests.conftest import ROOT, TEXT_FORMATS, findings

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


@pytest.mark.parametrize(("share", "count"), [(0.0, 1), (0.949, 1), (0.951, 0), (1.049, 0), (1.051, 1)])
def test_an_acceleration_that_is_not_that_of_free_fall_is_a_doubt(share: float, count: int) -> None:
    """Beyond 5 % of gravity the errors have no dynamics of an orbit, and nothing said so."""
    fall = free_fall((353.9e3, 0.0, 505.4e3), (0.0, 7.6e3, 0.0), None)
    stated = {
        **SATELLITE,
        "acceleration": [f"{share * part:.6f} m/s^2" for part in fall],
        "motion_error": {"position": ["0 m", "500 m", "0 m"], "source": "assumed"},
    }
    found = findings(platforms__transmitter=stated)
    doubts = [warning for warning in found.warnings if "differs from that of free fall" in warning.message]
    assert len(doubts) == count
    if count:
        assert doubts[0].is_doubt
        assert doubts[0].message.code == "satellite-does-not-fall"
        assert f"by {100 * abs(1 - share):.3g} % of gravity" in doubts[0].message
        assert "add scene.latitude" in doubts[0].message


def test_an_acceleration_in_the_file_is_a_decision_if_errors_are_small() -> None:
    """The dynamics of an orbit change the effect of 1 mm by less than 1e-6 rad."""
    stated = {**SATELLITE, "acceleration": [0, 0, 0], "motion_error": {"position": "1 mm"}}
    assert warned(platforms__transmitter=stated) == []


def test_below_100_km_an_acceleration_in_the_file_is_a_decision() -> None:
    low = {"position": ["35.4 km", 0, "50.5 km"], "velocity": [0, "3001 m/s", 0]}
    assert warned(platforms__transmitter={**low, "acceleration": [0, 0, 0]}) == []


def test_a_satellite_low_over_the_horizon_falls_too() -> None:
    """It is 460 km high, but only 29 km above the plane of the scene."""
    position = (2300e3, 0.0, 29e3)
    fall = [f"{part:.4f} m/s^2" for part in free_fall(position, (0.0, 7.6e3, 0.0), None)]
    flight = {"position": list(position), "velocity": [0, "7.6 km/s", 0]}
    large = {"motion_error": {"position": "500 m"}}
    assert warned(platforms__transmitter={**flight, **large, "acceleration": fall}) == []
    assert len(warned(platforms__transmitter={**flight, **large, "acceleration": [0, 0, 0]})) == 1


@pytest.mark.parametrize(("aperture_time", "status"), [("4 s", "pass"), ("600 s", "warn")])
def test_a_geostationary_satellite_needs_the_latitude_in_long_apertures(aperture_time: str, status: str) -> None:
    """It is still in Earth-fixed axes; without a place on the Earth nothing says that it falls.

    Gravity and the rotation may give 0.9 m of position error a phase of 0.12 rad in 600 s, and 5 µrad in 4 s.
    """
    still = {"position": ["-2000 km", "-25000 km", "27000 km"], "velocity": [0, 0, 0]}
    errors = {"motion_error": {"frame": "scene", "position": "0.5 m", "source": "assumed"}}
    found = findings(
        platforms__transmitter={**still, **errors},
        platforms__receiver={"position": ["3 km", "0 m", "1 km"], "velocity": [0, "1 m/s", 0]},
        radar={"center_frequency": "10 GHz", "bandwidth": "10 MHz"},
        collection={"aperture_time": aperture_time},
        requirements={"quadratic_phase_error": "45 deg"},
    )
    assert found.status == status
    doubts = [warning for warning in found.warnings if "differs from that of free fall" in warning.message]
    assert len(doubts) == (status == "warn")


@pytest.mark.parametrize(
    "format_name", sorted(set(TEXT_FORMATS) - {"csv", "needs", "requirements", "sdoc"})
)  # of rows, of requirements
def test_every_format_offers_it(format_name: str) -> None:
    found = findings(platforms__transmitter=SATELLITE, **DECLARED)
    text = render(format_name, Report(version="0", missions=(found,)), Style())
    plain = re.sub(r"\s+", " ", text.replace("\\", "").replace("%2C", ",").replace("&#x27;", "'"))
    assert "acceleration: [-0.432 m/s^2, 0.000 m/s^2, -8.396 m/s^2]" in plain


def test_no_example_flies_a_straight_orbit(run) -> None:
    for path in sorted((ROOT / "specs/missions").glob("*.yaml")):
        assert "speed of a satellite" not in run("check", path).stdout
