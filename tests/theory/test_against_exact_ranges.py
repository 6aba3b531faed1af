"""The published rows against exact ranges, without a Taylor series, where physics says they must agree."""

import math

import numpy as np
import pytest

from bisar_budget import evaluators

WAVELENGTH, T = 0.03, 6.0


def edge_phase_of_exact_error(position, velocity, error_of_time, order: int) -> float:
    """Fit |r| - |r + e| over the aperture by a polynomial; its term of that order at the edge. [rad]"""
    tau = np.linspace(-T / 2, T / 2, 401)
    r = np.array(position)[:, None] + np.array(velocity)[:, None] * tau
    measured = r + error_of_time(tau)
    range_error = np.linalg.norm(r, axis=0) - np.linalg.norm(measured, axis=0)
    fit = np.polynomial.polynomial.polyfit(tau, range_error, 6)
    return 2 * math.pi / WAVELENGTH * fit[order] * (T / 2) ** order


def published_row(position, velocity, kind: str, axis: int):
    R = math.dist(position, (0, 0, 0))
    rows = evaluators.published_motion(*position, *velocity, R, WAVELENGTH, T)
    return rows[3 * ("position", "velocity", "acceleration").index(kind) + axis]


@pytest.mark.parametrize("axis", range(3))
def test_acceleration_rows_are_exact_to_first_order(axis: int) -> None:
    position, velocity = (24e3, -9e3, 5e3), (60.0, 130.0, 4.0)  # squinted: acceleration rows do not care
    size = 1e-3
    unit = np.eye(3)[axis][:, None]
    exact = edge_phase_of_exact_error(position, velocity, lambda t: unit * size * t**2 / 2, 2)
    assert size * published_row(position, velocity, "acceleration", axis)[2] == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("turn", [1, -1])
def test_cubic_of_an_acceleration_is_that_of_exact_ranges_at_broadside(axis: int, turn: int) -> None:
    """An error's weight grows where the platform flies towards its axis: signed, for either sense of flight."""
    position = (24e3, -9e3, 5e3)
    velocity = turn * 150.0 * np.cross(position, (0.3, 0.5, 0.8)) / np.linalg.norm(position)  # at right angles to it
    size = 1e-3
    unit = np.eye(3)[axis][:, None]
    exact = edge_phase_of_exact_error(position, velocity, lambda t: unit * size * t**2 / 2, 3)
    # Left over: (vT/2R)², the curvature of a path of 430 m to either side at 26 km.
    assert size * published_row(position, velocity, "acceleration", axis)[3] == pytest.approx(
        exact, rel=3 * (430 / 26e3) ** 2
    )


def test_velocity_row_is_exact_at_broadside_along_the_track() -> None:
    position, velocity = (30e3, 0.0, 6e3), (0.0, 150.0, 0.0)
    size = 0.05
    unit = np.array([0.0, 1.0, 0.0])[:, None]
    exact = edge_phase_of_exact_error(position, velocity, lambda t: unit * size * t, 2)
    # Left over: (vT/2R)², the curvature of a path of 450 m to either side at 30 km.
    assert size * published_row(position, velocity, "velocity", 1)[2] == pytest.approx(
        exact, rel=3 * (450 / 30e3) ** 2
    )


def test_constant_and_linear_terms_of_position_and_velocity_errors() -> None:
    position, velocity = (30e3, 0.0, 6e3), (0.0, 150.0, 0.0)
    for axis in range(3):
        unit = np.eye(3)[axis][:, None]
        exact = edge_phase_of_exact_error(position, velocity, lambda t, unit=unit: 0.1 * unit + 0.0 * t, 0)
        row = published_row(position, velocity, "position", axis)
        assert 2 * math.pi / WAVELENGTH * 0.1 * row[0] == pytest.approx(exact, abs=1e-3)
        exact = edge_phase_of_exact_error(position, velocity, lambda t, unit=unit: 0.1 * unit * t, 1)
        row = published_row(position, velocity, "velocity", axis)
        assert 2 * math.pi / WAVELENGTH * 0.1 * row[1] * T / 2 == pytest.approx(exact, abs=1e-3)


def test_published_velocity_row_departs_from_exact_ranges_at_a_squint() -> None:
    """Range held constant is the paper's approximation, not geometry: at 45° the x row is off severalfold."""
    position, velocity = (30e3, 0.0, 6e3), (-106.0, 106.0, 0.0)
    unit = np.array([1.0, 0.0, 0.0])[:, None]
    exact = edge_phase_of_exact_error(position, velocity, lambda t: unit * 0.05 * t, 2)
    published = 0.05 * published_row(position, velocity, "velocity", 0)[2]
    assert abs(published) > 5 * abs(exact)
