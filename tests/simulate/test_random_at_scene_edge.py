"""Errors at random at the scene's edge: the row against exact ranges from there, sampled here.

Nothing here is taken from the package but the row, and where on the rim it says that the difference is largest. The
recorded ranges are those of the true paths to a point of the scene; predicted are those of the measured paths to the
ground point for which nothing of P₀ and P₁ is left. Each axis, and of noise each sample, is an error by itself.
"""

import math
from typing import Any

import numpy as np
import pytest
import yaml

from bisar_budget.analysis.scene_random import _between
from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY, row

LIGHT, GRAVITY = 299_792_458.0, 9.80665
T, CARRIER = 4.0, 9.6e9
PATHS = (
    np.array([[20e3, -6e3, 5e3], [20.0, 140.0, 0.0], [0.0, 0.0, 0.0]]),
    np.array([[5e3, 7e3, 2e3], [-50.0, 30.0, 0.0], [0.0, 0.0, 0.0]]),
)
TURNING = np.array([[5e3, 7e3, 2e3], [-50.0, 30.0, 0.0], [6.0, 10.0, 0.0]])
ROW = "mission.spatial_variance"

NODES, WEIGHTS = np.polynomial.legendre.leggauss(32)
TIMES = NODES * T / 2
FIT = (np.arange(3)[:, None] + 0.5) * np.polynomial.legendre.legvander(NODES, 2).T * WEIGHTS


def mission(receiver: Any = PATHS[1], radius: float = 1000.0, **changes: Any) -> dict[str, Any]:
    """Two aircraft, and what a test has beside them; `of_receiver` are keys of the receiver."""
    platforms = {
        name: {"position": state[0].tolist(), "velocity": state[1].tolist()}
        | ({"acceleration": state[2].tolist()} if state[2].any() else {})
        for name, state in zip(("transmitter", "receiver"), (PATHS[0], receiver), strict=True)
    }
    platforms["receiver"] |= changes.pop("of_receiver", {})
    return {
        "schema_version": 1,
        "name": "pair",
        "radar": {"center_frequency": CARRIER, "bandwidth": 200e6},
        "collection": {"aperture_time": T},
        "platforms": platforms,
        "requirements": {"quadratic_phase_error": "45 deg"},
        "autofocus": {"algorithm": "pga", "n_pull": 40},
        "scene": {"radius": radius},
        "allocation": {"model": "full", "combine": "rss"},
        **changes,
    }


def checked(**changes: Any) -> MissionFindings:
    return check_mission(parse_mission(yaml.safe_dump(mission(**changes))), TODAY)


def ranges(paths: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Ranges from paths (2, ..., 3, times) to ground points (..., 2), summed, (..., times)."""
    east, north, up = np.moveaxis(paths, -2, 0)
    return np.sqrt((east - point[..., 0, None]) ** 2 + (north - point[..., 1, None]) ** 2 + up**2).sum(axis=0)


def apart(paths: np.ndarray) -> np.ndarray:
    """Distance of both platforms, (..., times)."""
    return np.linalg.norm(paths[0] - paths[1], axis=-2)


def quadratics(
    moved: np.ndarray, late: np.ndarray, point: np.ndarray, receiver: np.ndarray = PATHS[1], is_heard: bool = False
) -> np.ndarray:
    """Quadratic phase at the aperture edge of errors as a point sees them, (errors,). [rad]

    Positions are wrong by (2, errors, 3, times), ranges by (errors, times) [m]; half of what both signs differ by.
    A direct path that is heard is taken off, as it is from the true ranges, as it is measured from the others.
    """
    powers = np.array([np.ones_like(TIMES), TIMES, TIMES**2 / 2])
    true = np.array([state.T @ powers for state in (PATHS[0], receiver)])[:, None]
    found = []
    for sign in (1.0, -1.0):
        own = sign * late + is_heard * (apart(true + sign * moved) - apart(true))
        place = np.broadcast_to(point, (moved.shape[1], 2)).copy()
        left = np.zeros(0)
        for _ in range(8):
            left, steps = ranges(true, np.asarray(point)) + own - ranges(true + sign * moved, place), []
            for way in np.eye(2):
                ahead, back = (ranges(true + sign * moved, place + h * way) for h in (0.5, -0.5))
                steps.append((ahead - back) @ FIT[:2].T)
            jacobian = np.stack(steps, axis=-1)
            place += np.linalg.solve(jacobian, (left @ FIT[:2].T)[..., None])[..., 0]
        left = ranges(true, np.asarray(point)) + own - ranges(true + sign * moved, place)
        found.append(2 * math.pi * CARRIER / LIGHT * 1.5 * (left @ FIT[2]))
    return (found[0] - found[1]) / 2


def difference(
    found: MissionFindings,
    moved: Any = 0.0,
    late: Any = 0.0,
    receiver: np.ndarray = PATHS[1],
    azimuth: float | None = None,
    *,
    is_heard: bool = False,
) -> np.ndarray:
    """Phase of each error at the worst place of the rim, or another one, less that at the centre. [rad]"""
    assert found.scene is not None
    azimuth = found.scene.azimuth if azimuth is None else azimuth
    place = found.scene.radius * np.array([math.cos(azimuth), math.sin(azimuth)])
    count = max(np.shape(moved)[1] if np.ndim(moved) else 1, np.shape(late)[0] if np.ndim(late) else 1)
    moved = np.broadcast_to(moved, (2, count, 3, TIMES.size))
    late = np.broadcast_to(late, (count, TIMES.size))
    there, centre = (quadratics(moved, late, point, receiver, is_heard) for point in (place, np.zeros(2)))
    return there - centre


def of_receiver(ways: Any, courses: Any) -> np.ndarray:
    """Errors of the receiver's position along ways (n, 3), by courses (n or 1, times); (2, n, 3, times)."""
    moved = np.asarray(ways)[:, :, None] * np.asarray(courses)[:, None]
    return np.array([np.zeros_like(moved), moved])


def declared(found: MissionFindings) -> float:
    value = row(found, ROW).declared
    assert value is not None
    return value


def test_a_bias_is_the_acceleration_that_it_makes() -> None:
    """The same number, the same verdict, the same radius; by exact ranges too, and nowhere on the rim is it more."""
    acceleration, bias = (
        checked(of_receiver={"motion_error": error})
        for error in ({"acceleration": 18e-3}, {"imu": {"accelerometer_bias": 18e-3}})
    )
    of_both = row(acceleration, ROW), row(bias, ROW)
    # A bias counts to first order; the second is the way of the error over the range, of the first.
    second_order = 18e-3 * T**2 / 8 / np.linalg.norm(PATHS[1][0])
    assert of_both[1].declared == pytest.approx(of_both[0].declared, rel=second_order)
    assert [one.status for one in of_both] == ["fail", "fail"]
    assert of_both[0].notes == of_both[1].notes
    moved = of_receiver(18e-3 * np.eye(3), TIMES[None] ** 2 / 2)
    assert declared(bias) == pytest.approx(np.linalg.norm(difference(bias, moved)), rel=2e-3)
    around = [np.linalg.norm(difference(bias, moved, azimuth=one)) for one in np.arange(12) * math.pi / 6]
    assert max(around) <= declared(bias) * 1.002


@pytest.mark.parametrize("tilt", [0.1, 0.102])
def test_an_attitude_error_turns_gravity_there_too(tilt: float) -> None:
    """Both sides of the limit: 0.7854 rad are left by 0.1005 degrees about two axes."""
    found = checked(of_receiver={"motion_error": {"imu": {"attitude": [f"{tilt} deg", f"{tilt} deg", 0]}}})
    ways = GRAVITY * math.radians(tilt) * np.cross(np.eye(3)[:2], (0.0, 0.0, 1.0))
    exact = float(np.linalg.norm(difference(found, of_receiver(ways, TIMES[None] ** 2 / 2))))
    assert declared(found) == pytest.approx(exact, rel=5e-3)  # the gravity of this latitude, and what the Earth turns
    assert (row(found, ROW).status == "fail") == (exact > math.pi / 4)


def test_an_attitude_error_swings_an_arm_there_too() -> None:
    """Along a turn: the arm turns with the body, and what it swings adds to what gravity does with its sign."""
    tilt, arm, state = math.radians(0.1), np.array([4.0, 2.0, 1.0]), TURNING
    error = {"imu": {"attitude": ["0.1 deg", 0, 0]}, "lever_arm": {"arm": arm.tolist()}}
    found = checked(receiver=state, of_receiver={"motion_error": error})
    u, v = (state[1] + state[2] * TIMES[:, None])[:, :2].T
    zeros, one = np.zeros_like(u), np.ones_like(u)
    along = np.array([u, v, zeros]) / np.hypot(u, v)
    body = (along, np.array([-along[1], along[0], zeros]), np.array([zeros, zeros, one]))
    swings = np.cross([1.0, 0.0, 0.0], sum(length * axis for length, axis in zip(arm, body, strict=True)), axisb=0).T
    force = np.cross([1.0, 0.0, 0.0], state[2] + [0.0, 0.0, GRAVITY])
    moved = np.zeros((2, 1, 3, TIMES.size))
    moved[1, 0] = tilt * (force[:, None] * TIMES**2 / 2 + swings)
    (exact,) = np.abs(difference(found, moved, receiver=state))
    assert declared(found) == pytest.approx(exact, rel=5e-3)


def test_the_direct_path_changes_alike_all_over_the_scene() -> None:
    """Where that is the clock: an arm of unknown length moves what is heard too, and with it each place."""
    error = {"motion_error": {"lever_arm": {"uncertainty": 3.0}}}
    found = checked(of_receiver=error, synchronization={"method": "direct_path", "error": "1 deg"})
    moved = of_receiver(3.0 * np.eye(3), np.ones((1, TIMES.size)))
    exact, unheard = (np.linalg.norm(difference(found, moved, is_heard=heard)) for heard in (True, False))
    assert declared(found) == pytest.approx(exact, rel=2e-3)
    assert abs(exact - unheard) > 0.1 * exact


def samples_of(covariance: np.ndarray) -> np.ndarray:
    """Independent courses that together have a covariance of the samples, (n, times)."""
    squares, ways = np.linalg.eigh(covariance)
    return (ways * np.sqrt(np.maximum(squares, 0.0))).T


def both_ways(courses: np.ndarray) -> np.ndarray:
    """Errors of the receiver along each axis, by each course."""
    return of_receiver(np.repeat(np.eye(3), len(courses), axis=0), np.tile(courses, (3, 1)))


@pytest.mark.parametrize("correlation_time", [2.0, 30.0, 1e5])
def test_noise_of_a_position_differs_by_its_parts(correlation_time: float) -> None:
    noise = {"name": "gnss", "sigma": 0.05, "correlation_time": correlation_time}
    found = checked(of_receiver={"motion_error": {"random": [noise]}})
    lag = np.abs(np.subtract.outer(TIMES, TIMES))
    courses = samples_of(0.05**2 * np.exp(-lag / correlation_time))
    exact = np.linalg.norm(difference(found, both_ways(courses)))
    assert declared(found) == pytest.approx(exact, rel=1e-2)  # orders beyond the cubic are left out


@pytest.mark.parametrize(("sensed", "count"), [(16, 6), (16, 64), (64, 64), (64, 128)])
def test_courses_go_to_other_nodes_by_the_orders_that_both_tell_apart(sensed: int, count: int) -> None:
    """Under a full circle a scene has 64 nodes: of 16 it took orders that these do not tell apart."""
    times, others = (np.polynomial.legendre.leggauss(number)[0] for number in (sensed, count))
    assert _between(sensed, count) @ times**2 == pytest.approx(others**2, abs=1e-9)


def test_noise_that_both_platforms_have_is_one_error() -> None:
    noise = {"name": "gnss", "sigma": [0.0, 0.0, 0.3], "correlation_time": 5.0}
    found = checked(common_motion_error={"random": [noise]})
    lag = np.abs(np.subtract.outer(TIMES, TIMES))
    courses = samples_of(0.3**2 * np.exp(-lag / 5.0))
    moved = np.zeros((2, len(courses), 3, TIMES.size))
    moved[:, :, 2] = courses
    assert declared(found) == pytest.approx(np.linalg.norm(difference(found, moved)), rel=1e-2)


def walk(early: np.ndarray, late: np.ndarray) -> np.ndarray:
    """Covariance of white acceleration of density 1, twice integrated."""
    return early**2 * (3 * late - early) / 6


def test_a_random_walk_of_velocity_differs_by_its_parts() -> None:
    found = checked(of_receiver={"motion_error": {"imu": {"velocity_random_walk": "5e-3 m/s/sqrt(s)"}}})
    size = np.abs(TIMES)
    early, late = (edge(size[:, None], size) for edge in (np.minimum, np.maximum))
    is_one_side = np.multiply.outer(TIMES, TIMES) > 0
    courses = samples_of(5e-3**2 * np.where(is_one_side, walk(early, late), 0.0))
    assert declared(found) == pytest.approx(np.linalg.norm(difference(found, both_ways(courses))), rel=1e-2)


def test_a_random_walk_of_attitude_swings_an_arm_there_too() -> None:
    """One noise: the tilt that walks turns gravity and swings the arm. By sums over small steps, each an error."""
    density, arm = 2e-4, 30.0
    error = {"imu": {"angle_random_walk": [f"{density} rad/sqrt(s)", 0, 0]}, "lever_arm": {"arm": [0.0, 0.0, arm]}}
    found = checked(of_receiver={"motion_error": error})
    steps = (np.arange(200) + 0.5) / 200 * T / 2
    length = T / 2 / 200
    tilts, places = [], []
    for side in (1.0, -1.0):
        for start in steps:
            since = np.maximum(side * TIMES - start, 0.0)
            tilts.append(density * math.sqrt(length) * (since > 0) * side)
            places.append(density * math.sqrt(length) * since**2 / 2 * side)
    # About the x axis: up becomes south. Gravity turns along, and the arm with it.
    south = np.array(places) * GRAVITY + np.array(tilts) * arm
    moved = of_receiver(np.tile([0.0, -1.0, 0.0], (len(south), 1)), south)
    assert declared(found) == pytest.approx(np.linalg.norm(difference(found, moved)), rel=1.5e-2)


@pytest.mark.parametrize("combine", ["rss", "sum", "each"])
def test_delays_of_the_air_are_those_of_each_elevation(combine: str) -> None:
    """Two legs, each through the whole air of its elevation, with a flat Earth below it."""
    found = checked(
        propagation={"transmitter": {"zenith_delay": 30.0}, "receiver": {"zenith_delay": 30.0}},
        allocation={"model": "full", "combine": combine},
    )
    assert found.scene is not None
    rim = found.scene.radius * np.array([math.cos(found.scene.azimuth), math.sin(found.scene.azimuth)])
    still, phases = np.zeros((2, 1, 3, TIMES.size)), []
    for state in PATHS:
        of_leg = []
        for point in (rim, np.zeros(2)):
            x, y, z = state.T @ [np.ones_like(TIMES), TIMES, TIMES**2 / 2]
            sine = z / np.sqrt((x - point[0]) ** 2 + (y - point[1]) ** 2 + z**2)
            of_leg.append(quadratics(still, (30.0 / sine)[None], point)[0])
        phases.append(of_leg[0] - of_leg[1])
    together = {"rss": np.linalg.norm(phases), "sum": np.abs(phases).sum(), "each": np.abs(phases).max()}
    assert declared(found) == pytest.approx(together[combine], rel=2e-2)  # 30 m moves what is matched, too


@pytest.mark.parametrize("correlation_time", [0.5, 20.0, 1e6])
@pytest.mark.parametrize("is_one_air", [True, False])
def test_a_delay_that_changes_is_a_course_for_each_order(is_one_air: bool, correlation_time: float) -> None:
    """By orders of the delay at the zenith, whose covariance is a sum over a fine grid of moments."""
    air = {"zenith_delay": 10.0, "correlation_time": correlation_time}
    legs = (0, 1) if is_one_air else (1,)
    found = checked(propagation=air if is_one_air else {"receiver": air}, allocation={"combine": "rss"})
    assert found.scene is not None
    rim = found.scene.radius * np.array([math.cos(found.scene.azimuth), math.sin(found.scene.azimuth)])
    orders = np.polynomial.legendre.legvander(NODES, 9).T
    still, phases = np.zeros((2, len(orders), 3, TIMES.size)), []
    for point in (rim, np.zeros(2)):
        along = np.zeros(TIMES.size)
        for leg in legs:
            x, y, z = PATHS[leg].T @ [np.ones_like(TIMES), TIMES, TIMES**2 / 2]
            along += np.sqrt((x - point[0]) ** 2 + (y - point[1]) ** 2 + z**2) / z
        phases.append(quadratics(still, 10.0 * along * orders, point))
    cells = 2000
    place = (np.arange(cells) + 0.5) / cells * 2 - 1
    between = np.exp(-np.abs(place[:, None] - place) * T / 2 / correlation_time)
    weights = (np.arange(len(orders)) + 0.5)[:, None] * 2 / cells * np.polynomial.legendre.legvander(place, 9).T
    covariance = weights @ between @ weights.T
    apart_rad = phases[0] - phases[1]
    assert declared(found) == pytest.approx(math.sqrt(apart_rad @ covariance @ apart_rad), rel=2e-2)


def test_a_clock_that_feels_a_turn_displaces_otherwise_there() -> None:
    """Each axis of its sensitivity: the time is Γ·(v(τ) − v(0)), and moves nothing."""
    gamma = 3e-10
    found = checked(
        receiver=TURNING,
        of_receiver={"oscillator": {"power_law": {"h0": 1e-40}, "acceleration_sensitivity": f"{gamma} s^2/m"}},
        synchronization={"method": "holdover", "age": 60, "averaging": 10, "time_error": 0, "frequency_error": 0},
    )
    late = LIGHT * gamma * TURNING[2][:, None] * TIMES
    exact = np.linalg.norm(difference(found, late=late, receiver=TURNING))
    assert exact > 1e-4
    assert declared(found) == pytest.approx(exact, rel=1e-2)


@pytest.mark.parametrize("amplitude", [[2e-3, 1e-3, 3e-3], 2e-3])
def test_a_slow_vibration_differs_in_its_worst_phase(amplitude: Any) -> None:
    """Several axes have a phase each; one along the line of sight moves along that of the centre."""
    line = {"amplitude": amplitude, "frequency": 0.2}
    found = checked(of_receiver={"motion_error": {"vibration": {"sinusoidal": [line]}}})
    look = PATHS[1][0] / np.linalg.norm(PATHS[1][0])
    ways = np.diag(amplitude) if isinstance(amplitude, list) else amplitude * look[None]
    whole = 0.0
    for way in ways:
        angles = 2 * math.pi * 0.2 * TIMES + np.linspace(0, math.pi, 180)[:, None]
        whole += np.abs(difference(found, of_receiver(np.tile(way, (180, 1)), np.cos(angles)))).max()
    assert declared(found) == pytest.approx(whole, rel=1e-2)


def test_a_spectrum_of_vibration_moves_along_the_line_of_sight() -> None:
    """Lines at random phases: of each frequency cosine and sine are errors by themselves."""
    density, low, high = 1e-3, 0.05, 0.6
    spectrum = {f"{low} Hz": f"{density} m^2/Hz", f"{high} Hz": f"{density} m^2/Hz"}
    found = checked(of_receiver={"motion_error": {"vibration": {"spectrum": spectrum}}})
    edges = np.linspace(low, high, 61)
    angles = 2 * math.pi * (edges[1:] + edges[:-1])[:, None] / 2 * TIMES
    sigma = np.sqrt(density * np.diff(edges))[:, None]
    look = PATHS[1][0] / np.linalg.norm(PATHS[1][0])
    courses = np.concatenate((sigma * np.cos(angles), sigma * np.sin(angles)))
    exact = np.linalg.norm(difference(found, of_receiver(np.tile(look, (len(courses), 1)), courses)))
    assert declared(found) == pytest.approx(exact, rel=2e-2)


def test_the_coverage_factor_counts_and_the_radius_holds_for_all() -> None:
    """A tiny declared error beside a bias changes neither the difference nor how far one correction serves."""
    bias = {"imu": {"accelerometer_bias": 9e-3}}
    twice = checked(
        of_receiver={"motion_error": bias}, allocation={"model": "full", "combine": "rss", "coverage_factor": 2}
    )
    once = checked(of_receiver={"motion_error": {"imu": {"accelerometer_bias": 18e-3}, "velocity": 1e-6}})
    assert declared(twice) == pytest.approx(declared(once), rel=1e-6)
    assert once.scene is not None
    served = once.scene.autofocus_radius
    assert served is not None
    alone = {"motion_error": {"imu": {"accelerometer_bias": 18e-3}}}
    inside, outside = (row(checked(radius=part * served, of_receiver=alone), ROW) for part in (0.995, 1.005))
    assert (inside.status, outside.status) == ("warn", "fail")


def test_what_free_oscillators_drift_is_said_not_to_count() -> None:
    free = {"oscillator": {"power_law": {"h0": 1e-24}}}
    bias = {"motion_error": {"imu": {"accelerometer_bias": 18e-3}}}
    said = "receiver.oscillator: the drift of free-running oscillators"
    (note,) = (one for one in row(checked(of_receiver=free | bias), ROW).notes if "drift" in one)
    assert note.startswith(said)
    assert declared(checked(of_receiver=free | bias)) == pytest.approx(declared(checked(of_receiver=bias)), rel=1e-9)
    timing = {"constant": 0, "linear": 0}
    assert not any("drift" in one for one in row(checked(of_receiver=free | bias, timing_error=timing), ROW).notes)


def test_an_error_over_its_limit_at_the_edge_alone_is_a_warning() -> None:
    """At random too: a bias along one axis, a little inside its share at the centre."""

    def bias(size: float) -> MissionFindings:
        return checked(of_receiver={"motion_error": {"imu": {"accelerometer_bias": [size, 0, 0]}}}, autofocus={})

    per_unit = row(bias(1e-3), "receiver.quadratic_phase_error").qpe_full_rad / 1e-3
    found = bias(0.99 * math.pi / 8 / per_unit)
    assert row(found, "receiver.quadratic_phase_error").status != "fail"
    assert row(found, ROW).status == "warn"
    assert "receiver.quadratic_phase_error is" in row(found, ROW).reason
