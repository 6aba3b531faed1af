"""Accuracy that the source of a path states of itself: covariances of ephemerides in every frame."""

import math

import numpy as np
import pytest

from bisar_budget.paths.accuracy import (
    CovarianceError,
    StatedAccuracy,
    correlations,
    covering_sigmas,
    held_to_covariance,
    local_axes,
)
from bisar_budget.paths.earth import ROTATION_RATE_RAD_PER_S
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.oem import read_oem
from bisar_budget.paths.orientation import sidereal_time
from tests.paths.orbit_files import instant, oem, oem_xml

START = instant("2026-06-01T05:00:00Z")
MIDDLE = START.after(600.0)


def triangle(position_m: tuple[float, float, float], velocity_mps: float = 0.0) -> list[str]:
    """Rows of a diagonal covariance, in km and km/s."""
    sigmas = [*position_m, *[velocity_mps] * 3]
    return [" ".join(["0"] * row + [f"{1e-6 * sigma**2:.9e}"]) for row, sigma in enumerate(sigmas)]


def with_covariance(*blocks: tuple[float, str | None, list[str]], frame: str = "ITRF2014") -> str:
    """An ephemeris with covariances: seconds from its start, frame, and rows."""
    lines = ["COVARIANCE_START"]
    for seconds, own, rows in blocks:
        lines.append(f"EPOCH = {START.after(seconds).as_text()[:-1]}")
        lines += [] if own is None else [f"COV_REF_FRAME = {own}"]
        lines += rows
    return oem(frame=frame, times=START.after) + "\n".join([*lines, "COVARIANCE_STOP", ""])


def stated(text: str, at: Instant = MIDDLE) -> StatedAccuracy:
    found = read_oem(text.encode(), "c.oem", None, at).stated(at)
    assert found is not None
    return found


def along(text: str, direction: np.ndarray, at: Instant = MIDDLE) -> float:
    """Sigma of the position along a direction of the Earth. [m]"""
    covariance = np.array(stated(text, at).covariance)[:3, :3]
    return math.sqrt(float(direction @ covariance @ direction) / float(direction @ direction))


def state(text: str, at: Instant = MIDDLE) -> tuple[np.ndarray, np.ndarray]:
    """Place, and velocity against the stars, along the axes of the Earth."""
    orbit = read_oem(text.encode(), "c.oem", None, at)
    before, here, after = (np.array(orbit.place(at.after(time))) for time in (-0.1, 0.0, 0.1))
    return here, (after - before) / 0.2 + np.cross([0, 0, ROTATION_RATE_RAD_PER_S], here)


@pytest.mark.parametrize("frame", ["RTN", "RSW", "RIC", "QSW", "RTN_INERTIAL", "rsw_rotating"])
def test_axes_of_the_orbit_are_radial_in_track_and_cross_track(frame: str) -> None:
    text = with_covariance((600.0, frame, triangle((1.0, 20.0, 300.0))))
    place, velocity = state(text)
    assert along(text, place) == pytest.approx(1.0, rel=1e-6)
    assert along(text, np.cross(place, velocity)) == pytest.approx(300.0, rel=1e-6)
    assert along(text, np.cross(np.cross(place, velocity), place)) == pytest.approx(20.0, rel=1e-4)
    assert np.trace(np.array(stated(text).covariance)[:3, :3]) == pytest.approx(1 + 400 + 90000)


def test_tnw_begins_along_the_velocity() -> None:
    text = with_covariance((600.0, "TNW", triangle((1.0, 20.0, 300.0))))
    place, velocity = state(text)
    assert along(text, velocity) == pytest.approx(1.0, rel=1e-3)
    assert along(text, np.cross(place, velocity)) == pytest.approx(300.0, rel=1e-6)


def test_without_a_frame_of_its_own_it_is_along_the_axes_of_the_ephemeris() -> None:
    text = with_covariance((600.0, None, triangle((1.0, 20.0, 300.0))))
    assert [along(text, axis) for axis in np.eye(3)] == pytest.approx([1.0, 20.0, 300.0], rel=1e-6)


def test_axes_of_the_stars_turn_with_the_sidereal_time() -> None:
    """TEME without polar motion is the Earth's axes turned by the sidereal time."""
    text = with_covariance((600.0, "TEME", triangle((1.0, 20.0, 300.0))))
    angle = sidereal_time(MIDDLE)
    x, y = np.array([math.cos(angle), -math.sin(angle), 0]), np.array([math.sin(angle), math.cos(angle), 0])
    assert [along(text, axis) for axis in (x, y, np.array([0, 0, 1.0]))] == pytest.approx([1, 20, 300], rel=1e-5)


def test_a_velocity_over_the_ground_takes_the_place_with_it() -> None:
    """A place that is wrong by d turns with the Earth: the velocity over the ground is wrong by ω × d more."""
    text = with_covariance((600.0, "RTN", triangle((1e4, 1e4, 1e4), 0.1)))
    covariance = np.array(stated(text).covariance)
    assert np.diag(covariance)[3:] == pytest.approx(
        [0.01 + (ROTATION_RATE_RAD_PER_S * 1e4) ** 2] * 2 + [0.01], rel=1e-6
    )
    assert covariance[3, 1] == pytest.approx(ROTATION_RATE_RAD_PER_S * 1e8, rel=1e-6)


@pytest.mark.parametrize("frame", ["RTN_ROTATING", "TNW_ROTATING"])
def test_velocities_in_axes_that_turn_with_the_orbit_become_those_against_the_stars(frame: str) -> None:
    """An error at rest in turning axes is turned by the orbit: its velocity against the stars is n × d."""
    text = with_covariance((600.0, frame, triangle((1e3, 1e3, 0.0))))
    place, velocity = state(text)
    momentum = np.cross(place, velocity)
    rate = momentum / (place @ place)
    if frame == "TNW_ROTATING":  # gravity turns the velocity
        gravity = -3.986004418e14 * place / np.linalg.norm(place) ** 3
        rate = np.cross(velocity, gravity) / (velocity @ velocity)
    across = np.eye(3) - np.outer(momentum, momentum) / (momentum @ momentum)  # the variance in the orbit's plane
    turning = np.array([np.cross(rate - (0, 0, ROTATION_RATE_RAD_PER_S), axis) for axis in np.eye(3)]).T
    want = turning @ across @ turning.T * 1e6
    got = np.array(stated(text).covariance)[3:, 3:]
    assert got == pytest.approx(want, rel=2e-3, abs=2e-3 * np.abs(want).max())


@pytest.mark.parametrize(
    ("seconds", "sigma"), [(0.0, 1.0), (300.0, math.sqrt(0.5 + 4.5)), (600.0, 3.0), (900.0, 3.0)]
)
def test_between_two_epochs_the_variance_is_linear_and_outside_that_of_the_nearest(
    seconds: float, sigma: float
) -> None:
    text = with_covariance((600.0, "RTN", triangle((3.0, 3.0, 3.0))), (0.0, "TNW", triangle((1.0, 1.0, 1.0))))
    assert along(text, np.array([1.0, 2.0, 3.0]), START.after(seconds)) == pytest.approx(sigma, rel=1e-6)


def test_in_axes_that_are_not_known_the_total_counts() -> None:
    found = stated(with_covariance((600.0, "PQW", triangle((1.0, 2.0, 2.0)))))
    assert found.covariance is None
    assert found.total == pytest.approx(3.0)
    assert found.position_m == pytest.approx(3.0)


def test_zeros_state_nothing() -> None:
    text = with_covariance((600.0, "RTN", triangle((0.0, 0.0, 0.0))))
    assert read_oem(text.encode(), "c.oem", None, MIDDLE).stated(MIDDLE) is None
    assert read_oem(oem(times=START.after).encode(), "c.oem", None, MIDDLE).stated(MIDDLE) is None


ROWS = triangle((1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        (ROWS[:5], "a covariance must be a lower triangle of 6 rows with 1 to 6 numbers (has 1, 2, 3, 4, 5 numbers)"),
        (["-1e-6", *ROWS[1:]], "the covariance has a negative variance"),
        ([ROWS[0], "2e-6 1e-6", *ROWS[2:]], "the covariance is not positive semi-definite: no error has such a"),
        (["nan", *ROWS[1:]], "must be a number of km**2, km**2/s or km**2/s**2 (got nan)"),
    ],
    ids=["cut off", "negative", "beyond a correlation of 1", "no number"],
)
def test_numbers_that_are_no_covariance_are_refused(rows: list[str], says: str) -> None:
    with pytest.raises(PathFileError) as error:
        read_oem(with_covariance((600.0, "RTN", rows)).encode(), "c.oem", None, MIDDLE)
    assert says in str(error.value)
    assert str(error.value).startswith("c.oem:")


def test_a_covariance_begins_with_its_epoch() -> None:
    text = oem(times=START.after) + "\n".join(["COVARIANCE_START", *ROWS, "COVARIANCE_STOP", ""])
    with pytest.raises(PathFileError, match="a covariance must begin with EPOCH"):
        read_oem(text.encode(), "c.oem", None, MIDDLE)


def test_few_digits_make_no_fault() -> None:
    """Correlations of 0.99999 written with four digits leave an eigenvalue a little below zero."""
    values = np.array([[1.0, 1.00001], [1.00001, 1.0]])
    held = held_to_covariance(np.kron(np.eye(3), values))
    assert np.linalg.eigvalsh(held)[0] >= -1e-15
    with pytest.raises(CovarianceError):
        held_to_covariance(np.kron(np.eye(3), np.array([[1.0, 1.1], [1.1, 1.0]])))


def test_independent_errors_cover_correlated_ones_in_every_direction() -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        factor = random.normal(size=(3, 3)) * np.array([[1.0], [10.0], [100.0]])
        covariance = factor @ factor.T
        sigmas = np.array(covering_sigmas(covariance))
        assert np.linalg.eigvalsh(np.diag(sigmas**2) - covariance)[0] > -1e-9 * np.trace(covariance)
        assert (sigmas <= math.sqrt(3) * np.sqrt(np.diag(covariance)) * (1 + 1e-9)).all()
    assert covering_sigmas(np.diag([1.0, 4.0, 9.0])) == pytest.approx((1.0, 2.0, 3.0), rel=1e-12)
    assert correlations(np.diag([1.0, 0.0, 9.0])) == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize("name", ["ITRF2014", "PQW", "", "SEZ"])
def test_other_names_are_no_axes_of_an_orbit(name: str) -> None:
    assert local_axes(name) is None


def test_a_message_in_xml_states_the_same() -> None:
    text = with_covariance((600.0, "RTN", triangle((1.0, 20.0, 300.0), 0.1)))
    names = ["X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT"]
    cells = [row.split() for row in triangle((1.0, 20.0, 300.0), 0.1)]
    elements = "".join(
        f"<C{names[i]}_{names[j]}>{cells[i][j]}</C{names[i]}_{names[j]}>" for i in range(6) for j in range(i + 1)
    )
    matrix = (
        f"<covarianceMatrix><EPOCH>{MIDDLE.as_text()[:-1]}</EPOCH><COV_REF_FRAME>RTN</COV_REF_FRAME>"
        f"{elements}</covarianceMatrix>"
    )
    markup = oem_xml(oem(times=START.after)).replace(b"</data>", matrix.encode() + b"</data>")
    found = read_oem(markup, "c.xml", None, MIDDLE).stated(MIDDLE)
    assert found is not None
    assert np.array(found.covariance) == pytest.approx(np.array(stated(text).covariance), rel=1e-6, abs=1e-9)
