"""Aided navigation, against an independent batch, a dense batch written here, and simulated flights.

The figures of `BATCH` were computed outside this package: one large least-squares problem for each case, by blocks of
a QR decomposition, for the whole flight at once. It equals one dense matrix of 9 615 unknowns to 4e-12, a smoother
with cross-covariances to 3e-11, and 2 000 simulated flights to 1.6 %.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.aided_navigation import navigation_errors
from bisar_budget.effects.random_effect import RandomError, SensorCases
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.stacked import stacked
from bisar_budget.navigation.error_state import Fixes, InertialUnit, step_noise, transitions
from bisar_budget.navigation.smoother import FlightSteps, StartSigmas, aided_covariance
from bisar_budget.navigation.timeline import FixSchedule, timeline_of
from bisar_budget.simulator.flown_navigation import navigation_courses
from tests.conftest import examples

WITHIN = 2e-3  # steps of 0.1 s in turns, and two nodes between fixes
TURNING_WITHIN = 5e-3
TURNING_REST_WITHIN = 0.02  # orders above 24 are taken as evenly spread over the aperture
FLIGHTS, SIGMAS = 400, 4.5  # a sigma of 400 flights is known to 3.5 %

TRANSMITTER = "{position: [30.41 km, 0 km, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s]}"
GEOMETRIES = {
    "A": ("9.65 GHz", "position: [1.5 km, 0.5 km, 400 m], velocity: [0 m/s, 25 m/s, 0 m/s]"),
    "B": ("10 GHz", "position: [5.84 km, 5.84 km, 2 km], velocity: [-42 m/s, 42 m/s, 0 m/s]"),
    "C": (
        "10 GHz",
        "position: [5 km, 0 km, 1.5 km], velocity: [30 m/s, 40 m/s, 0 m/s], "
        "acceleration: [-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]",
    ),
}
UNITS = {
    "STIM300": ("6 ug", "0.5 deg/h", 0.024, 0.15),
    "MEMS10": ("60 ug", "5 deg/h", 0.24, 1.5),
    "HG9900": ("25 ug", "0.0035 deg/h", 0.0143, 0.002),
}
RECEIVERS = {
    "RTK": "position: [6 mm, 6 mm, 10 mm], velocity: 30 mm/s",
    "QUICK": "position: 1 cm, velocity: 3 cm/s, correlation_time: 2 ms",
    "WANDER": "position: 1 cm, velocity: 3 cm/s, correlation_time: 30 s",
}
# Geometry, T, unit, receiver, options; QPE, cubic and rest [rad], location [m]; position [m], velocity [m/s], tilt
# and heading [rad] at mid-aperture.
BATCH: tuple[tuple[str, float, str, str, dict[str, str], tuple[float, ...]], ...] = (
    (
        "A",
        1,
        "STIM300",
        "RTK",
        {},
        (0.01345, 0.0087531, 0.00097848, 0.025658, 0.0022047, 0.00085372, 5.3831e-05, 0.087267),
    ),
    (
        "A",
        1,
        "STIM300",
        "RTK",
        {"method": "filtered"},
        (0.30784, 0.43631, 0.10615, 0.15582, 0.0047297, 0.0027644, 0.00011989, 0.087267),
    ),
    (
        "A",
        2.48,
        "STIM300",
        "RTK",
        {},
        (0.05517, 0.037668, 0.0039506, 0.023404, 0.0022047, 0.00085372, 5.3833e-05, 0.087267),
    ),
    (
        "A",
        2.48,
        "STIM300",
        "RTK",
        {"method": "filtered"},
        (0.47717, 0.64225, 0.16527, 0.089665, 0.0047296, 0.0027644, 0.00011989, 0.087267),
    ),
    (
        "A",
        6,
        "STIM300",
        "RTK",
        {},
        (0.18618, 0.1681, 0.017045, 0.017468, 0.0022047, 0.00085372, 5.3837e-05, 0.087267),
    ),
    (
        "A",
        6,
        "STIM300",
        "RTK",
        {"method": "filtered"},
        (0.7023, 1.0044, 0.25602, 0.042651, 0.0047293, 0.0027643, 0.0001199, 0.087267),
    ),
    (
        "A",
        15,
        "STIM300",
        "RTK",
        {},
        (0.34223, 0.51929, 0.078133, 0.0080657, 0.0022047, 0.00085372, 5.3847e-05, 0.087267),
    ),
    (
        "A",
        15,
        "STIM300",
        "RTK",
        {"method": "filtered"},
        (0.67752, 1.2658, 0.3996, 0.01382, 0.0047287, 0.0027641, 0.0001199, 0.087267),
    ),
    (
        "A",
        60,
        "STIM300",
        "RTK",
        {},
        (0.070145, 0.44048, 0.19579, 0.0091498, 0.0022047, 0.00085372, 5.3897e-05, 0.087268),
    ),
    (
        "A",
        60,
        "STIM300",
        "RTK",
        {"method": "filtered"},
        (0.10633, 0.68147, 0.53012, 0.013721, 0.0047264, 0.0027634, 0.00011993, 0.087268),
    ),
    (
        "A",
        2.48,
        "MEMS10",
        "RTK",
        {},
        (0.32102, 0.32537, 0.038719, 0.067519, 0.0036466, 0.0040354, 0.00045217, 0.087347),
    ),
    (
        "A",
        2.48,
        "MEMS10",
        "RTK",
        {"method": "filtered"},
        (1.021, 1.4488, 0.37076, 0.15288, 0.0069692, 0.009717, 0.00084608, 0.087347),
    ),
    (
        "A",
        15,
        "MEMS10",
        "RTK",
        {},
        (0.43953, 0.83083, 0.26955, 0.0092038, 0.0036466, 0.0040354, 0.00045233, 0.087357),
    ),
    (
        "A",
        15,
        "MEMS10",
        "RTK",
        {"method": "filtered"},
        (0.68668, 1.3614, 0.73977, 0.013901, 0.0069688, 0.0097165, 0.00084618, 0.087357),
    ),
    (
        "A",
        2.48,
        "HG9900",
        "RTK",
        {},
        (0.025599, 0.01976, 0.0022618, 0.012023, 0.001785, 0.00047372, 3.6881e-05, 0.087266),
    ),
    (
        "A",
        2.48,
        "HG9900",
        "RTK",
        {"method": "filtered"},
        (0.21897, 0.29212, 0.075059, 0.045713, 0.0037252, 0.0010832, 3.6913e-05, 0.087266),
    ),
    (
        "A",
        15,
        "HG9900",
        "RTK",
        {},
        (0.20168, 0.24269, 0.032551, 0.0061048, 0.001785, 0.00047372, 3.6935e-05, 0.087266),
    ),
    (
        "A",
        15,
        "HG9900",
        "RTK",
        {"method": "filtered"},
        (0.49507, 0.74318, 0.18793, 0.012313, 0.0037247, 0.001083, 3.6962e-05, 0.087266),
    ),
    (
        "B",
        6,
        "STIM300",
        "RTK",
        {"outages": "[{from: -2 s, to: 3 s}]"},
        (0.26233, 0.18604, 0.018036, 0.035223, 0.0037523, 0.00093713, 6.0334e-05, 0.087267),
    ),
    (
        "B",
        6,
        "STIM300",
        "RTK",
        {"outages": "[{from: -2 s, to: 3 s}]", "method": "filtered"},
        (0.95489, 0.41001, 0.077977, 0.32372, 0.012156, 0.0052266, 0.00015168, 0.087267),
    ),
    (
        "C",
        4,
        "STIM300",
        "RTK",
        {},
        (0.13831, 0.092419, 0.0090504, 0.032786, 0.0023421, 0.00086781, 7.7043e-05, 0.00022079),
    ),
    (
        "C",
        4,
        "STIM300",
        "RTK",
        {"method": "filtered"},
        (0.83824, 1.3065, 0.41414, 0.11168, 0.0054787, 0.0057315, 0.00013021, 0.00089168),
    ),
    (
        "C",
        4,
        "STIM300",
        "RTK",
        {"heading": "0.1 deg"},
        (0.13804, 0.092419, 0.0090502, 0.032786, 0.0023403, 0.00086781, 7.6742e-05, 0.00021918),
    ),
    (
        "C",
        4,
        "STIM300",
        "RTK",
        {"heading": "0.1 deg", "method": "filtered"},
        (0.77398, 1.1037, 0.29005, 0.10762, 0.0053401, 0.0052804, 0.0001282, 0.00079838),
    ),
    (
        "C",
        6,
        "MEMS10",
        "RTK",
        {"heading": "0.1 deg", "outages": "[{from: -1 s, to: 2 s}]"},
        (1.1562, 1.218, 0.17493, 0.061747, 0.0081864, 0.0049848, 0.0007162, 0.0013358),
    ),
    (
        "C",
        15,
        "HG9900",
        "RTK",
        {},
        (0.21231, 0.25262, 0.033779, 0.009087, 0.0018012, 0.00047447, 1.273e-05, 2.2085e-05),
    ),
    (
        "C",
        15,
        "HG9900",
        "RTK",
        {"method": "filtered"},
        (0.62357, 1.0091, 0.33066, 0.019645, 0.004152, 0.0015133, 3.5469e-05, 5.6159e-05),
    ),
    (
        "A",
        15,
        "STIM300",
        "WANDER",
        {},
        (0.80643, 0.83804, 0.092013, 0.034077, 0.016405, 0.0015265, 6.1165e-05, 0.087267),
    ),
    (
        "A",
        15,
        "STIM300",
        "WANDER",
        {"method": "filtered"},
        (1.1643, 1.713, 0.46554, 0.038205, 0.017542, 0.0033017, 0.00012414, 0.087267),
    ),
)
STATES = ("position_rms_m", "velocity_rms_mps", "tilt_rms_rad", "heading_rms_rad")


def text_of(
    geometry: str, T: float, unit: str, receiver: str, options: Mapping[str, str] | None = None, more: str = ""
) -> str:
    frequency, path = GEOMETRIES[geometry]
    accelerometer_bias, gyro_bias, velocity_walk, angle_walk = UNITS[unit]
    imu = (
        f"accelerometer_bias: {accelerometer_bias}, gyro_bias: {gyro_bias}, velocity_random_walk: {velocity_walk} "
        f"m/s/sqrt(h), angle_random_walk: {angle_walk} deg/sqrt(h)"
    )
    keys = "".join(f", {key}: {value}" for key, value in (options or {}).items())
    navigation = f"navigation: {{imu: {{{imu}}}, gnss: {{rate: 5 Hz, {RECEIVERS[receiver]}}}{keys}}}"
    return f"""
schema_version: 1
name: Aided
radar: {{center_frequency: {frequency}, bandwidth: 300 MHz}}
collection: {{aperture_time: {T} s}}
platforms:
  transmitter: {TRANSMITTER}
  receiver: {{{path}, motion_error: {{{navigation}{more}}}}}
requirements: {{quadratic_phase_error: 45 deg, cubic_phase_error: 45 deg, islr: -20 dB, location_error: 1 m}}
"""


def mission_of(*args: Any, **options: Any) -> Mission:
    return parse_mission(text_of(*args, **options), "mission.yaml")


def error_of(mission: Mission) -> RandomError:
    (error,) = [error for error in Analysis(mission).random if error.navigation is not None]
    return error


@pytest.mark.parametrize("case", BATCH, ids=lambda case: f"{case[0]}-{case[1]}-{case[2]}-{case[3]}-{list(case[4])}")
def test_effects_are_those_of_a_batch(case: tuple[Any, ...]) -> None:
    *asked, expected = case
    error = error_of(mission_of(*asked))
    effect = error.full
    found = (effect.quadratic, effect.cubic, effect.spread, effect.displacement)
    within, of_rest = (TURNING_WITHIN, TURNING_REST_WITHIN) if case[0] == "C" else (WITHIN, WITHIN)
    assert [float(value) for value in found] == [
        pytest.approx(value, rel=of_rest if number == 2 else within) for number, value in enumerate(expected[:4])
    ]
    assert error.navigation is not None
    assert error.navigation.at_middle[:4] == pytest.approx(expected[4:], rel=within)


# ---------------------------------------------------------------------- a dense batch, written here
def dense_batch(
    timeline: Any, flight: FlightSteps, unit: InertialUnit, fixes: Fixes, start: np.ndarray, *, is_smoothed: bool
) -> np.ndarray:
    """Joint covariance of the state at all moments, (moments, states, moments, states).

    The unknowns are the state at the start and the noise of each step, whitened. The errors of a filter at two
    moments have the covariance of the states at these moments, given the fixes up to the later one.
    """
    size = fixes.state_size
    steps = timeline.steps
    phi = transitions(steps, flight.body, flight.force, fixes.wander_time_s, size)[:, 0]
    noise = step_noise(steps, flight.body, flight.force, unit, fixes)[:, 0]
    moments, unknowns = len(steps) + 1, size * (len(steps) + 1)
    states = np.zeros((moments, size, unknowns))
    states[0, :, :size] = np.diag(start)
    for step in range(len(steps)):
        squares, ways = np.linalg.eigh(noise[step] / np.outer(*[np.sqrt(np.diagonal(noise[step])) + 1e-300] * 2))
        root = (np.sqrt(np.diagonal(noise[step])) + 1e-300)[:, None] * ways * np.sqrt(np.maximum(squares, 0))
        states[step + 1] = phi[step] @ states[step]
        states[step + 1, :, size * (step + 1) : size * (step + 2)] = root
    measured = np.zeros((6, size))
    measured[:6, :6] = np.eye(6)
    if size > 15:
        measured[:3, 15:] = np.eye(3)
    sigmas = np.concatenate((fixes.position_m[0], fixes.velocity_mps[0]))
    joint = np.zeros((moments, size, moments, size))
    for last in [moments - 1] if is_smoothed else range(moments):
        seen = [measured @ states[k] / sigmas[:, None] for k in range(last + 1) if timeline.is_fix[k, 0]]
        information = np.eye(unknowns) + sum((rows.T @ rows for rows in seen), np.zeros((unknowns, unknowns)))
        covariance = np.linalg.inv(information)
        if is_smoothed:
            return np.asarray(np.einsum("isu,uv,jtv->isjt", states, covariance, states, optimize=True))
        column = np.einsum("isu,uv,tv->ist", states[: last + 1], covariance, states[last], optimize=True)
        joint[: last + 1, :, last] = column
        joint[last, :, : last + 1] = np.transpose(column, (2, 0, 1))
    return joint


@pytest.mark.parametrize("wander_s", [math.inf, 2.0], ids=["white", "wandering"])
@pytest.mark.parametrize("is_smoothed", [True, False], ids=["smoothed", "filtered"])
def test_covariance_is_that_of_a_dense_batch(is_smoothed: bool, wander_s: float) -> None:
    schedule = FixSchedule(
        half_s=0.5,
        before_s=0.5,
        after_s=0.5 if is_smoothed else 0.0,
        rate_hz=4.0,
        outages=[(-0.3, -0.2)],
        is_smoothed=is_smoothed,
    )
    timeline, rng = timeline_of([schedule]), np.random.default_rng(1)
    count = len(timeline.steps)
    body = np.array([np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(count)])[:, None]
    force = rng.standard_normal((count, 1, 3)) + np.array([0.0, 0.0, 9.8])
    arm = rng.standard_normal((count + 1, 1, 3))
    flight = FlightSteps(body=body, force=force, arm=arm)
    unit = InertialUnit(
        accelerometer_bias_mps2=np.array([[1e-2, 2e-2, 5e-3]]),
        first_accelerometer_bias_mps2=np.array([[1e-2, 2e-2, 3e-2]]),
        gyro_bias_radps=np.array([[1e-3, 2e-3, 1e-3]]),
        velocity_random_walk=np.array([[1e-2, 5e-3, 2e-2]]),
        angle_random_walk=np.array([[1e-3, 2e-3, 1e-3]]),
    )
    wanders = math.isfinite(wander_s)
    fixes = Fixes(
        position_m=np.array([[0.01, 0.02, 0.03]]),
        velocity_mps=np.array([[0.05, 0.06, 0.07]]),
        wander_m=np.full((1, 3), 0.02 if wanders else 0.0),
        wander_time_s=np.array([wander_s]),
    )
    start = StartSigmas(heading_rad=np.array([0.02]))
    order_count = 6
    covariance = aided_covariance(
        timeline, flight, unit, fixes, start, np.array([0.5]), order_count=order_count, is_smoothed=is_smoothed
    )
    sigmas = [10, 10, 10, 1, 1, 1, start.tilt_rad, start.tilt_rad, 0.02, 1e-2, 2e-2, 3e-2, 1e-3, 2e-3, 1e-3]
    joint = dense_batch(
        timeline, flight, unit, fixes, np.array([*sigmas, *([0.02] * 3 * wanders)]), is_smoothed=is_smoothed
    )
    antenna = np.zeros((count + 1, 3, joint.shape[1]))
    antenna[:, :, :3] = np.eye(3)
    for axis, tilt in enumerate(np.eye(3)):
        antenna[:, :, 6 + axis] = np.cross(tilt, arm[:, 0])
    errors = np.einsum("ias,isjt,jbt->iajb", antenna, joint, antenna, optimize=True)
    weights, x = timeline.weights[:, 0], timeline.times[:, 0] / 0.5
    fit = (2 * np.arange(order_count) + 1)[:, None] * np.polynomial.legendre.legvander(x, order_count - 1).T * weights
    expected = np.einsum("oi,iajb,pj->oapb", fit, errors, fit, optimize=True)
    largest = np.abs(expected).max()
    assert covariance.of_orders[..., 0] == pytest.approx(expected, abs=1e-8 * largest)
    power = np.einsum("i,iaib->ab", weights, errors)
    resolved = np.einsum("oaob,o->ab", expected, 1 / (2 * np.arange(order_count) + 1))
    assert covariance.beyond[..., 0] == pytest.approx(power - resolved, abs=1e-8 * np.abs(power).max())
    middle = timeline.middle[0]
    at_middle = joint[middle, :, middle]
    sizes = np.sqrt(np.diagonal(at_middle))
    assert covariance.at_middle[..., 0] / np.outer(sizes, sizes) == pytest.approx(
        at_middle / np.outer(sizes, sizes), abs=1e-6
    )


# ---------------------------------------------------------------------- simulated flights
FLOWN = [
    ("A", 2.5, "STIM300", "RTK", {}),
    ("A", 2.5, "STIM300", "RTK", {"method": "filtered"}),
    ("A", 1, "STIM300", "QUICK", {"before": "5 s", "after": "5 s"}),  # shorter than a step: gave no number
    ("C", 4, "STIM300", "RTK", {"heading": "0.1 deg"}),
    ("B", 6, "MEMS10", "WANDER", {"outages": "[{from: -2 s, to: 3 s}]"}),
]


@pytest.mark.parametrize(
    "case", [*FLOWN[:3], *(pytest.param(case, marks=pytest.mark.thorough) for case in FLOWN[3:])], ids=str
)
def test_flights_have_the_covariance(case: tuple[Any, ...]) -> None:
    """Position errors of flights, by Legendre orders and axes, with a lever arm."""
    mission = mission_of(*case, more=", lever_arm: {arm: [2 m, 0 m, -0.5 m]}")
    T = mission.collection.aperture_time
    x, weights = np.polynomial.legendre.leggauss(32)
    courses = navigation_courses(mission, "receiver", x * T / 2, FLIGHTS, np.random.default_rng(1))
    polynomials = np.polynomial.legendre.legvander(x, 3) * (2 * np.arange(4) + 1)
    flown = np.sqrt(np.mean(np.einsum("j,jo,dja->doa", weights / 2, polynomials, courses) ** 2, axis=0))
    covariance = navigation_errors(SensorCases(mission, mission.geometry, 1), "receiver").covariance
    expected = np.sqrt(np.einsum("oaoac->oac", covariance.of_orders)[:4, :, 0])
    assert flown == pytest.approx(expected, rel=SIGMAS / math.sqrt(2 * FLIGHTS))


# ---------------------------------------------------------------------- what must hold for any navigation
RATES = st.sampled_from([1, 2, 5])
TIMES = st.floats(0.5, 8.0)


@given(rate=RATES, T=TIMES, unit=st.sampled_from(list(UNITS)))
@examples(25, 6)
def test_more_fixes_never_harm(rate: int, T: float, unit: str) -> None:
    text = text_of("A", T, unit, "RTK").replace("rate: 5 Hz", f"rate: {rate} Hz")
    fewer, more = (error_of(parse_mission(text.replace(f"rate: {rate}", f"rate: {n * rate}"))) for n in (1, 2))
    assert more.full.quadratic <= fewer.full.quadratic * (1 + 1e-9)
    assert more.full.displacement <= fewer.full.displacement * (1 + 1e-9)


@given(T=TIMES, unit=st.sampled_from(list(UNITS)))
@examples(25, 6)
def test_a_smoother_is_better_than_its_filter(T: float, unit: str) -> None:
    smoothed, filtered = (
        error_of(mission_of("A", T, unit, "RTK", {"method": method})) for method in ("smoothed", "filtered")
    )
    assert smoothed.full.quadratic < filtered.full.quadratic
    assert smoothed.navigation is not None
    assert filtered.navigation is not None
    assert smoothed.navigation.at_middle < filtered.navigation.at_middle


def test_a_level_multiplies_every_effect() -> None:
    plain, shifted = (
        error_of(mission_of("A", 2.5, "STIM300", "RTK", {"level": level})) for level in ("0 dB", "6 dB")
    )
    factor = 10 ** (6 / 20)
    for effect, louder in ((plain.full, shifted.full), (plain.published, shifted.published)):
        assert [float(value) for value in louder[:5]] == pytest.approx([float(v) * factor for v in effect[:5]])


def test_many_cases_are_those_of_single_missions() -> None:
    """Figures, fixes and apertures that vary from case to case, in one array."""
    texts = [
        text_of("A", T, unit, "RTK", {"before": f"{before} s", "heading": heading})
        for T, unit, before, heading in (
            (2.5, "STIM300", 60, "5 deg"),
            (6, "MEMS10", 20, "1 deg"),
            (1, "HG9900", 30, "0.1 deg"),
            (6, "MEMS10", 20, "1 deg"),
        )
    ]
    missions = [parse_mission(text, "mission.yaml") for text in texts]
    ((mission, indices),) = stacked(missions)
    found = [error_of(single) for single in missions]
    (many,) = random_errors(mission, mission.geometry, len(missions))
    for case, index in enumerate(indices):
        for part in ("quadratic", "cubic", "spread", "east", "north"):
            expected = float(getattr(found[index].full, part))
            assert np.broadcast_to(getattr(many.full, part), (4,))[case] == pytest.approx(expected, rel=1e-6)


# ---------------------------------------------------------------------- fixes
def test_fixes_are_multiples_of_the_interval() -> None:
    """One is at mid-aperture; both ends of the flight and of an outage count as within."""
    schedule = FixSchedule(half_s=1.0, before_s=1.0, after_s=1.0, rate_hz=2.0, outages=[(-0.5, 0.5)])
    assert schedule.fixes() == pytest.approx([-2, -1.5, -1, 1, 1.5, 2])


@pytest.mark.parametrize("rate_hz", [0.1, 1.0, 20.0])
@pytest.mark.parametrize("outages", [[], [(-1.5, 0.5)]], ids=["no outage", "outage"])
@pytest.mark.parametrize("is_smoothed", [True, False], ids=["smoothed", "filtered"])
def test_nodes_keep_orders_apart(is_smoothed: bool, outages: list[tuple[float, float]], rate_hz: float) -> None:
    """A constant error, and every other order, leaks into no other order up to 23."""
    schedule = FixSchedule(
        half_s=2.0, before_s=5.0, after_s=0.0, rate_hz=rate_hz, outages=outages, is_smoothed=is_smoothed
    )
    times, weights = schedule.nodes()
    assert np.abs(times).max() < 2.0
    orders = np.polynomial.legendre.legvander(times / 2.0, 23)
    assert (orders.T * weights) @ orders == pytest.approx(np.diag(1 / (2 * np.arange(24) + 1)), abs=1e-3)


@pytest.mark.parametrize("method", ["smoothed", "filtered"])
def test_a_large_constant_error_does_not_spread(method: str) -> None:
    """Errors of fixes that stay for hours move the image; what spreads is that of the inertial sensor alone."""
    options = {"method": method}
    text = text_of("C", 3, "STIM300", "WANDER", options).replace("rate: 5 Hz", "rate: 1 Hz")
    small, large = (
        error_of(parse_mission(text.replace("position: 1 cm", position).replace("30 s", "1e6 s")))
        for position in ("position: 1 cm", "position: 1 m")
    )
    assert large.full.displacement > 5 * small.full.displacement
    assert large.full.spread < 3 * small.full.spread
