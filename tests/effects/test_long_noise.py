"""Errors at random over long apertures, in which the line of sight turns: against draws, and against direct sums.

Nothing here comes from the package but the row. A range error is followed along the true paths; the image is where
the variance of the phase over band and aperture is least, and what it leaves is fitted by NumPy. A process is drawn
(AR(1)), or is the sum of all its independent parts: of the steps of a walk, of the tones of a spectrum.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from tests.conftest import TODAY, mission_text, row
from tests.image_point import Path as Flight
from tests.image_point import circle, flight
from tests.mission.test_circling_log import MAST, logged
from tests.paths.test_pieces import HEIGHT, RADIUS, RATE, TURN_S

LIGHT, CARRIER, BAND = 299_792_458.0, 10e9, 300e6
TRANSMITTER = np.array([[30e3, -2e3, 6e3], [0.0, 120.0, 0.0]])
RECEIVER = np.array([[3e3, 0.0, 1e3], [0.0, 26.0, 0.0]])
SIGMA = {"all": np.array([4e-4, 4e-4, 6e-4]), "track": np.array([0.0, 2e-3, 0.0])}  # m
DRAWS, SAMPLES = 3000, 1201
GRAVITY = 9.80665

LINE = (flight(*TRANSMITTER), flight(*RECEIVER)), CARRIER, BAND
CIRCLE = (flight(MAST, (0, 0, 0)), circle(RADIUS, HEIGHT, RATE, 0.0)), 435e6, 100e6
PASSIVE = (flight((-18e3, 9e3, 420), (0, 0, 0)), flight((-2e3, -7e3, 2500), (-65, 8, 0))), 602e6, 7.61e6
Scene = tuple[tuple[Flight, Flight], float, float]
Errors = Callable[[np.ndarray, Sequence[np.ndarray]], np.ndarray]  # at times, by lines of sight, (samples, n) [m]


def shown(scene: Scene, aperture_time: float, errors: Errors, samples: int = SAMPLES) -> dict[str, float]:
    """Roots of the sums of squares over range errors: phases and what spreads [rad], displacement [m]."""
    paths, carrier, bandwidth = scene
    x = np.linspace(-1, 1, samples)
    times = x * aperture_time / 2
    places = [path(times) for path in paths]
    looks = [place / np.linalg.norm(place, axis=1)[:, None] for place in places]
    slopes = looks[0][:, :2] + looks[1][:, :2]
    seen = errors(times, looks)
    weights = np.full(samples, 1 / (samples - 1))
    weights[[0, -1]] /= 2
    band = (bandwidth / carrier) ** 2 / 12
    weighted = weights[:, None] * ((1 + band) * slopes - weights @ slopes)
    points = -np.linalg.solve(weighted.T @ slopes, weighted.T @ seen)
    left = seen + slopes @ points
    parts = np.polynomial.legendre.legfit(x, left, 3, w=np.sqrt(weights))
    rest = left - np.polynomial.legendre.legval(x, parts).T
    k = 2 * math.pi * carrier / LIGHT
    variance = weights @ left**2 * (1 + band) - (weights @ left) ** 2
    found = {
        "quadratic": 1.5 * k * parts[2],
        "cubic": 2.5 * k * parts[3],
        "spread": k * np.sqrt(weights @ rest**2),
        "whole": k * np.sqrt(variance),
        "moved": points,
    }
    return {name: float(np.sqrt(np.square(part).sum())) for name, part in found.items()}


def judged(wanted: dict[str, float], *, is_turned: bool, spreads: bool = True) -> float:
    """Quadratic phase of equal loss: without the cubic up to a turn of 1 rad, and without what spreads. [rad]"""
    square = wanted["whole"] ** 2 - wanted["spread"] ** 2 * (spreads or not is_turned)
    return math.sqrt(45 / 4 * (square - 4 / 175 * wanted["cubic"] ** 2 * (not is_turned)))


def on_the_line(aperture_time: float, receiver: dict[str, Any], **others: Any) -> Mission:
    """A receiver that flies by at 3 km: its v⊥T/R is 0.30 over 36 s and 0.67 over 82 s."""
    return parse_mission(
        mission_text(
            radar={"center_frequency": CARRIER, "bandwidth": BAND},
            collection={"aperture_time": aperture_time},
            platforms__transmitter={"position": TRANSMITTER[0].tolist(), "velocity": TRANSMITTER[1].tolist()},
            platforms__receiver={"position": RECEIVER[0].tolist(), "velocity": RECEIVER[1].tolist()} | receiver,
            requirements={"islr": "-20 dB", "location_error": "1 m", "cubic_phase_error": "45 deg"},
            allocation={"model": "full"},
            **others,
        )
    )


def agrees(
    mission: Mission, row_id: str, wanted: dict[str, float], *, is_turned: bool, rel: float = 0.05, db: float = 0.5
) -> None:
    """A row has what is wanted; where a line of sight turns by more than 1 rad, of phases the judged one."""
    one = row(check_mission(mission, TODAY), row_id)
    assert one.equal_loss_qpe_rad == pytest.approx(judged(wanted, is_turned=is_turned), rel=rel)
    if not is_turned:
        assert one.qpe_full_rad == pytest.approx(wanted["quadratic"], rel=rel)
        assert one.cubic_rad == pytest.approx(wanted["cubic"], rel=rel)
    assert one.displacement_m is not None
    assert one.islr_db is not None
    assert math.hypot(*one.displacement_m) == pytest.approx(wanted["moved"], rel=rel)
    level = 10 * math.log10(math.expm1(wanted["spread"] ** 2) / 0.9028)  # of the mainlobe's energy
    assert one.islr_db == pytest.approx(level, abs=db)


# ---------------------------------------------------------------------- noise of a position
def autoregressive(sigma: np.ndarray, correlation_time: float) -> Errors:
    """Draws of an AR(1) process along each axis of the receiver, whose squares add up to those of one. [m]"""

    def errors(times: np.ndarray, looks: Sequence[np.ndarray]) -> np.ndarray:
        rng = np.random.default_rng(11)
        keeps = math.exp(-(times[1] - times[0]) / correlation_time)
        process = np.empty((len(times), 3, DRAWS))
        process[0] = rng.normal(size=(3, DRAWS))
        for step in range(1, len(times)):
            process[step] = keeps * process[step - 1] + math.sqrt(1 - keeps**2) * rng.normal(size=(3, DRAWS))
        return -np.einsum("na,a,nad->nd", looks[1], sigma, process) / math.sqrt(DRAWS)

    return errors


@pytest.mark.parametrize("correlation_time", [2.0, 30.0, 400.0])
@pytest.mark.parametrize("aperture_time", [5.0, 82.0])
@pytest.mark.parametrize("axes", SIGMA)
def test_noise_is_that_of_draws(axes: str, aperture_time: float, correlation_time: float) -> None:
    """Roots of 3000 squares: 1.3 % by chance.

    Noise along the track spread nothing, with the line of sight held at mid-aperture.
    """
    noise = {"name": "GNSS", "sigma": SIGMA[axes].tolist(), "correlation_time": correlation_time}
    mission = on_the_line(aperture_time, {"motion_error": {"random": [noise]}})
    wanted = shown(LINE, aperture_time, autoregressive(SIGMA[axes], correlation_time))
    agrees(mission, "receiver.random.GNSS", wanted, is_turned=False)


def test_noise_over_a_full_circle_is_that_of_draws(tmp_path: Path) -> None:
    noise = "random: [{name: GNSS, sigma: [1 mm, 1 mm, 1 mm], correlation_time: 30 s}]"
    wanted = shown(CIRCLE, TURN_S, autoregressive(np.full(3, 1e-3), 30.0))
    agrees(logged(tmp_path, TURN_S, noise), "receiver.random.GNSS", wanted, is_turned=True)


# ---------------------------------------------------------------------- inertial sensors
def walking(kind: str, steps: int = 400) -> Errors:
    """Steps of the white noise of a sensor of the receiver: from mid-aperture on, each way, about each axis. [m]"""

    def errors(times: np.ndarray, looks: Sequence[np.ndarray]) -> np.ndarray:
        width = times[-1] / steps
        ahead = np.maximum(np.abs(times)[:, None] - (np.arange(steps) + 0.5) * width, 0.0)
        grown = (ahead if kind == "velocity_random_walk" else ahead**2 / 2) * math.sqrt(width)
        is_late = (times > 0)[:, None]
        courses = np.concatenate((grown * is_late, grown * ~is_late), axis=1)
        ways = np.eye(3)
        if kind == "angle_random_walk":  # a tilt turns the specific force of level flight
            ways = np.cross(ways, (0, 0, GRAVITY))
        return -np.concatenate([(looks[1] @ way)[:, None] * courses for way in ways], axis=1)

    return errors


WALKS = {"velocity_random_walk": (1e-4, "m/s/sqrt(s)"), "angle_random_walk": (1e-7, "rad/sqrt(s)")}


@pytest.mark.parametrize("aperture_time", [36.0, 82.0])
@pytest.mark.parametrize("kind", WALKS)
def test_a_walk_is_the_sum_of_its_steps(kind: str, aperture_time: float) -> None:
    size, unit = WALKS[kind]
    mission = on_the_line(aperture_time, {"motion_error": {"imu": {kind: f"{size} {unit}"}}})
    wanted = shown(LINE, aperture_time, walking(kind))
    wanted = {name: size * part for name, part in wanted.items()}
    agrees(mission, f"receiver.imu.{kind}", wanted, is_turned=False, rel=0.01, db=0.05)


def test_the_line_of_sight_of_mid_aperture_spreads_a_walk_right_up_to_a_turn_of_a_third() -> None:
    """The published model holds it: 0.1 dB too little at v⊥T/R of 0.30, 0.8 dB at 0.67."""
    for aperture_time, short_db in ((36.0, 0.1), (82.0, 0.77)):
        imu = {"imu": {"angle_random_walk": "1e-7 rad/sqrt(s)"}}
        found = random_errors(on_the_line(aperture_time, {"motion_error": imu}))
        (walk,) = [one for one in found if one.id == "receiver.imu.angle_random_walk"]
        assert 20 * math.log10(walk.full.spread / walk.published.spread) == pytest.approx(short_db, abs=0.02)


def test_a_walk_over_a_full_circle_is_the_sum_of_its_steps(tmp_path: Path) -> None:
    """It spread 8.7 dB less by the line of sight of mid-aperture."""
    mission = logged(tmp_path, TURN_S, "imu: {velocity_random_walk: 1e-4 m/s/sqrt(s)}")
    wanted = shown(CIRCLE, TURN_S, walking("velocity_random_walk"))
    wanted = {name: 1e-4 * part for name, part in wanted.items()}
    agrees(mission, "receiver.imu.velocity_random_walk", wanted, is_turned=True, rel=0.01, db=0.05)


def biased(times: np.ndarray, looks: Sequence[np.ndarray]) -> np.ndarray:
    """An acceleration of the receiver of 1 m/s² along each axis."""
    return -looks[1] * times[:, None] ** 2 / 2


def test_a_bias_over_a_full_circle_is_held_as_a_whole(tmp_path: Path) -> None:
    """Half of the loss of a bias lies beyond the cubic phase; the phase of equal loss left that half out."""
    mission = logged(tmp_path, TURN_S, "imu: {accelerometer_bias: 1e-5 m/s^2}")
    wanted = shown(CIRCLE, TURN_S, biased)
    one = row(check_mission(mission, TODAY), "receiver.imu.accelerometer_bias")
    whole = 1e-5 * judged(wanted, is_turned=True, spreads=False)
    assert one.equal_loss_qpe_rad == pytest.approx(whole, rel=0.01)
    assert whole > 1.9e-5 * judged(wanted, is_turned=True)


def test_below_a_radian_of_turn_islr_holds_what_a_bias_leaves() -> None:
    found = check_mission(on_the_line(82.0, {"motion_error": {"imu": {"accelerometer_bias": "1e-4 m/s^2"}}}), TODAY)
    wanted = shown(LINE, 82.0, biased)
    level = 10 * math.log10(math.expm1((1e-4 * wanted["spread"]) ** 2) / 0.9028)
    assert row(found, "mission.islr").islr_db == pytest.approx(level, abs=0.05)


# ---------------------------------------------------------------------- spectra and clocks
def tones(density: Callable[[Any], Any], low: float, high: float, *, is_stated: bool = False) -> Errors:
    """Tones of a spectrum of the range error, cosine and sine [m²/Hz]; of a clock whose terms are stated the rest."""

    def errors(times: np.ndarray, looks: Sequence[np.ndarray]) -> np.ndarray:
        edges = np.unique(np.concatenate((np.geomspace(low, high, 160), np.arange(low, high, 0.05 / times[-1]))))
        f = np.sqrt(edges[1:] * edges[:-1])
        angles, sizes = 2 * math.pi * np.outer(times, f), np.sqrt(density(f) * np.diff(edges))
        found = np.concatenate((np.cos(angles) * sizes, np.sin(angles) * sizes), axis=1)
        if is_stated:
            x = times / times[-1]
            found = found - np.polynomial.legendre.legval(x, np.polynomial.legendre.legfit(x, found, 1)).T
        return found

    return errors


def vibrating(slope: float, size: float, ends: tuple[float, float]) -> dict[str, Any]:
    """A spectrum of vibration along the line of sight, so many m²/Hz at 1 Hz."""
    return {"spectrum": {f"{f} Hz": f"{size * f**-slope!r} m^2/Hz" for f in ends}}


@pytest.mark.parametrize("slope", [0, 2, 4])
@pytest.mark.parametrize("aperture_time", [36.0, 82.0])
def test_a_spectrum_is_the_sum_of_its_tones(aperture_time: float, slope: float) -> None:
    size, ends = {0: 1e-9, 2: 1e-9, 4: 1e-12}[slope], (0.002, 1.0)
    mission = on_the_line(aperture_time, {"motion_error": {"vibration": vibrating(slope, size, ends)}})
    wanted = shown(LINE, aperture_time, tones(lambda f: size * f**-slope, *ends))
    agrees(mission, "receiver.vibration.spectrum", wanted, is_turned=False)


@pytest.mark.parametrize(("slope", "rel", "db"), [(2, 0.05, 0.5), (4, 0.05, 1.0)])
def test_a_spectrum_over_a_full_circle_is_nearly_the_sum_of_its_tones(slope, rel, db, tmp_path: Path) -> None:
    """Orders beyond 3 displace there too, which rows leave out.

    Of noise as steep as f⁻⁴ what spreads is a sixth of the judged phase, and the row has more of it, not less.
    """
    size, ends = {2: 1e-9, 4: 1e-12}[slope], (0.002, 1.0)
    spectrum = ", ".join(f"{f}: {density}" for f, density in vibrating(slope, size, ends)["spectrum"].items())
    mission = logged(tmp_path, TURN_S, f"vibration: {{spectrum: {{{spectrum}}}}}")
    wanted = shown(CIRCLE, TURN_S, tones(lambda f: size * f**-slope, *ends))
    agrees(mission, "receiver.vibration.spectrum", wanted, is_turned=True, rel=rel, db=db)


@pytest.mark.parametrize("aperture_time", [36.0, 82.0])
def test_a_free_clock_is_the_sum_of_its_tones(aperture_time: float) -> None:
    """White noise of the frequency, both terms stated: 2.3 times as much quadratic phase was said over 82 s."""
    clock = {"oscillator": {"power_law": {"h0": "1e-25"}, "bandwidth": "2 Hz"}}
    mission = on_the_line(aperture_time, clock, timing_error={"constant": 0, "linear": 0})
    wanted = shown(
        LINE,
        aperture_time,
        tones(lambda f: 1e-25 * (LIGHT / 2 / math.pi / f) ** 2, 1e-4, 2.0, is_stated=True),
    )
    agrees(mission, "receiver.oscillator", wanted, is_turned=False)


def test_what_a_direct_path_leaves_of_a_vibration_changes_as_the_line_of_sight_turns() -> None:
    """Passive radar over 60 s: by its rms over the aperture the location was 16 % too small."""
    slope, size, ends = 4, 1e-10, (0.002, 1.0)

    def heard(times: np.ndarray, looks: Sequence[np.ndarray]) -> np.ndarray:
        transmitter, receiver = (path(times) for path in PASSIVE[0])
        between = receiver - transmitter
        along = (looks[1] * between).sum(axis=1) / np.linalg.norm(between, axis=1)
        return tones(lambda f: size * f**-slope, *ends)(times, looks) * (1 - along)[:, None]

    mission = parse_mission(
        mission_text(
            radar={"center_frequency": 602e6, "bandwidth": 7.61e6},
            collection={"aperture_time": 60.0},
            platforms__transmitter={"position": [-18e3, 9e3, 420], "velocity": [0, 0, 0]},
            platforms__receiver={
                "position": [-2e3, -7e3, 2500],
                "velocity": [-65, 8, 0],
                "motion_error": {"vibration": vibrating(slope, size, ends)},
            },
            synchronization={"method": "direct_path", "error": "0 deg"},
            requirements={"islr": "-20 dB", "location_error": "1 m", "cubic_phase_error": "45 deg"},
            allocation={"model": "full"},
        )
    )
    agrees(mission, "receiver.vibration.spectrum", shown(PASSIVE, 60.0, heard), is_turned=False)
