"""Sensors and clocks against whole time series: drawn moment by moment, sent through exact ranges, and fitted.

20 000 draws know a sigma to 0.5 %; what is drawn and what is computed agree within 2 %.
"""

import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.navigation_errors import specific_force
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.random_errors import in_one_case, random_errors
from bisar_budget.effects.spectra import PowerLawPiece, synchronized_parts
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import with_number
from bisar_budget.ranges.exact_ranges import (
    FINE_NODE_COUNT,
    NO_SHIFTS,
    ExactRanges,
    ImagePoints,
    aperture_nodes,
    followed,
)
from tests.conftest import ROOT
from tests.image_point import Collection, flight, no_error

DRAWS = 20_000
SIGMA = 0.02

MISSION = """
schema_version: 1
name: Sensors
radar: {center_frequency: 9.65 GHz, bandwidth: 150 MHz}
collection: {aperture_time: 6 s}
platforms:
  transmitter: {position: [30 km, 4 km, 9 km], velocity: [0 m/s, 180 m/s, 0 m/s]}
  receiver:
    slant_range: 2 km
    azimuth: 60 deg
    elevation: 35 deg
    speed: 35 m/s
    motion_azimuth: 165 deg
    motion_error:
      frame: track
      imu:
        accelerometer_bias: 50 ug
        accelerometer_scale_factor: 300 ppm
        attitude: 0.02 deg
        gyro_bias: 0.5 deg/h
        velocity_random_walk: 0.06 m/s/sqrt(h)
        angle_random_walk: 0.15 deg/sqrt(h)
      random: [{name: GNSS, sigma: 1 cm, correlation_time: 1.5 s}]
"""


def analysed(text: str = MISSION) -> Analysis:
    return Analysis(parse_mission(text))


def of(analysis: Analysis, row_id: str) -> RandomError:
    return next(error for error in analysis.random if error.id == row_id)


def through_exact_ranges(mission: Mission, position_error: np.ndarray, times: np.ndarray) -> ImagePoints:
    """Effects of position errors of the receiver, (draws, nodes, 3), sampled at the nodes."""
    T = mission.collection.aperture_time
    paths = (mission.geometry.transmitter, mission.geometry.receiver)
    assert np.allclose(times, aperture_nodes(T))
    exact = ExactRanges.of(paths, mission.radar, T, FINE_NODE_COUNT)
    draws = len(position_error)
    return followed(
        exact, np.zeros((FINE_NODE_COUNT, draws)), (NO_SHIFTS, position_error.T), np.zeros(draws, dtype=int)
    )


def through_the_clock(mission: Mission, phase: np.ndarray) -> ImagePoints:
    """Effects of phases of a clock, (draws, nodes), sampled at the nodes. [rad]"""
    exact = ExactRanges.of(mission.geometry.both, mission.radar, mission.collection.aperture_time, FINE_NODE_COUNT)
    moved = phase.T * mission.radar.wavelength / (2 * math.pi)
    return followed(exact, moved, (NO_SHIFTS, NO_SHIFTS), np.zeros(len(phase), dtype=int))


def test_noise_of_a_link_displaces_by_its_slope_alone() -> None:
    """Errors of 6 degrees at exchanges, straight lines between: the constant part of a phase moves nothing."""
    analysis = analysed(f"{MISSION.rstrip()}\nsynchronization: {{interval: 0.5 s, error: 6 deg}}\n")
    error = of(analysis, "timing.synchronization")
    rng, draws, t = np.random.default_rng(11), 20_000, np.linspace(-3, 3, 301)
    knots = np.arange(-3.5, 4.01, 0.5)
    starts, errors = rng.random(draws) * 0.5, error.declared * rng.standard_normal((draws, len(knots)))
    phase = np.array([np.interp(t, knots + start, of_one) for start, of_one in zip(starts, errors, strict=True)])
    coefficients = np.polynomial.legendre.legfit(t / 3, phase.T, 3)
    coefficients[0] = 0.0
    found = through_the_clock(analysis.mission, np.polynomial.legendre.legval(aperture_nodes(6.0) / 3, coefficients))
    for drawn, computed in zip(found[1:5], (*error.full[3:5], *error.full[:2]), strict=True):
        assert np.std(drawn) == pytest.approx(computed * error.declared, rel=SIGMA)


def agrees_with_draws(error: RandomError, found: ImagePoints) -> None:
    """Hold sigmas of phases and displacement, and how they go together, to what was drawn."""
    drawn = np.array((found.quadratic, found.cubic, found.east, found.north))
    computed = np.array(error.full[:2] + error.full[3:5]) * error.declared
    sigmas = drawn.std(axis=1)
    assert sigmas[:2] == pytest.approx(computed[:2], rel=SIGMA, abs=1e-4)
    assert sigmas[2:] == pytest.approx(computed[2:], rel=SIGMA, abs=1e-6)
    away = np.abs(np.cov(drawn) - error.full.covariance[:4, :4] * error.declared**2)
    assert np.all(away <= 0.03 * np.multiply.outer(sigmas, sigmas) + 1e-9)


def integrated(steps: np.ndarray, dt: float) -> np.ndarray:
    """Integral from zero on along the last axis, by trapezoids; as long as what is integrated."""
    area = np.cumsum((steps[..., 1:] + steps[..., :-1]) / 2 * dt, axis=-1)
    return np.concatenate([np.zeros((*steps.shape[:-1], 1)), area], axis=-1)


def history(kind: str, rng: np.random.Generator, times: np.ndarray, half: float) -> np.ndarray:
    """Position error by a unit of acceleration, or of its rate or noise, along one axis, (draws, nodes)."""
    if kind in ("accelerometer_bias", "accelerometer_scale_factor", "attitude"):
        return rng.standard_normal((DRAWS, 1)) * times**2 / 2
    if kind == "gyro_bias":
        return rng.standard_normal((DRAWS, 1)) * times**3 / 6
    # A walk starts at mid-aperture, and each side has a noise of its own. It is the sum of what each step does alone.
    fine = np.linspace(0, half, 301)
    dt, count = fine[1], len(fine) - 1
    by_step = np.zeros((count, count + 1))
    np.cumsum(np.eye(count) * math.sqrt(dt), axis=1, out=by_step[:, 1:])
    for _ in range(1 if kind == "velocity_random_walk" else 2):
        by_step = integrated(by_step, dt)
    found = np.zeros((DRAWS, len(times)))
    for side in (times > 0, times < 0):
        at_nodes = np.stack([np.interp(np.abs(times[side]), fine, one) for one in by_step])
        found[:, side] = rng.standard_normal((DRAWS, count)) @ at_nodes
    return found


def falling(position: np.ndarray) -> np.ndarray:
    """Acceleration towards the centre of a sphere 6371 km below the scene. [m/s²]"""
    from_centre = position + np.array([0, 0, 6371e3])
    return -3.986004418e14 * from_centre / np.linalg.norm(from_centre) ** 3


@pytest.mark.parametrize(
    "kind",
    [
        "accelerometer_bias",
        "accelerometer_scale_factor",
        "attitude",
        "gyro_bias",
        "velocity_random_walk",
        "angle_random_walk",
    ],
)
def test_an_inertial_sensor_does_what_whole_time_series_do(kind: str) -> None:
    analysis = analysed()
    mission, error = analysis.mission, of(analysis, f"receiver.imu.{kind}")
    times = aperture_nodes(mission.collection.aperture_time)
    rng = np.random.default_rng(13)
    moved = np.stack([history(kind, rng, times, 3.0) for _ in range(3)], axis=-1) * error.declared
    # The frame is the track's: along, across to the left, up. The path is straight, so that f = -g.
    state = mission.platforms.receiver.state
    force = -falling(np.array(state.position))
    axes = np.array(state.frame("track"))
    if kind in ("attitude", "gyro_bias", "angle_random_walk"):
        moved = np.cross(moved @ axes, force)
    elif kind == "accelerometer_scale_factor":
        moved = (moved * (axes @ force)) @ axes
    else:
        moved = moved @ axes
    found = through_exact_ranges(mission, moved, times)
    agrees_with_draws(error, found)
    # A path of 35 m/s past 2 km turns little: the closed form is not far from it.
    largest = max(error.full[:2])
    assert error.published[:2] == pytest.approx(error.full[:2], rel=0.02, abs=0.07 * largest)


class TestSpecificForce:
    """Attitude errors and scale factors act on what accelerometers measure, f = a - g."""

    TURN = """
schema_version: 1
name: a turn
radar: {center_frequency: 10 GHz, bandwidth: 300 MHz}
collection: {aperture_time: 4 s}
platforms:
  transmitter: {position: [-5 km, 8 km, 1.5 km], velocity: [60 m/s, 80 m/s, 0 m/s]}
  receiver:
    position: [5 km, 0 km, 1.5 km]
    velocity: [60 m/s, 80 m/s, 0 m/s]
    acceleration: [-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]
    motion_error: {imu: {IMU}}
"""

    @pytest.mark.parametrize(
        ("figures", "expected"),
        [
            # |k·T²/8·u·(ψ × f)|, u = [5, 0, 1.5]/5.22, f = [-3.2, 2.4, 9.81], worked out by hand
            ("attitude: [0.26 mrad, 0 rad, 0 rad]", 0.0751),
            ("attitude: [0 rad, 0.26 mrad, 0 rad]", 1.124),
            ("attitude: [0 rad, 0 rad, 5 mrad]", 4.820),
            ("attitude: [0.26 mrad, 0.26 mrad, 5 mrad]", 4.950),
            (
                "accelerometer_scale_factor: [300 ppm, 0, 0]",
                209.58 * 2 * 300e-6 * (3.2 - 9.8156 * 5 / 6372.5) * 5 / 5.2202,
            ),
            ("accelerometer_scale_factor: [0, 0, 300 ppm]", 209.58 * 2 * 300e-6 * 9.81 * 1.5 / 5.2202),
        ],
    )
    def test_a_turn(self, figures: str, expected: float) -> None:
        analysis = analysed(self.TURN.replace("{IMU}", f"{{{figures}}}"))
        error = of(analysis, f"receiver.imu.{figures.partition(':')[0]}")
        assert error.published.quadratic * error.declared == pytest.approx(expected, rel=2e-3)

    @pytest.mark.parametrize("bandwidth", ["300 MHz", "10 GHz"])
    @pytest.mark.parametrize(
        ("figures", "scale", "by_hand"),
        [
            ("attitude: [0.26 mrad, 0 rad, 0 rad]", 0.26e-3, 0.0751),
            ("attitude: [0 rad, 0.26 mrad, 0 rad]", 0.26e-3, 1.124),
            ("attitude: [0 rad, 0 rad, 5 mrad]", 5e-3, 4.820),
            ("accelerometer_scale_factor: [300 ppm, 0, 0]", 300e-6, None),
            ("accelerometer_scale_factor: [0, 0, 300 ppm]", 300e-6, None),
        ],
    )
    def test_where_the_image_of_a_turn_peaks(
        self, bandwidth: str, figures: str, scale: float, by_hand: float | None
    ) -> None:
        """The line of sight turns by 77 mrad, which a band of 300 MHz, b = 9 mrad, resolves no better than the turn.

        So what the error displaces is not what it displaces in a wide band, and defocuses otherwise: -0.986 and 4.20
        rad for -1.124 and 4.82. The reference takes exact ranges, of an error so small that it acts in proportion.
        In 10 GHz, b² = 1/12 above the turn squared, the phase is that by hand but for the turn.
        """
        kind, _, axes = figures.partition(":")
        axis = np.array([not part.startswith("0 ") and part != "0" for part in axes.strip(" []").split(", ")])
        position, velocity, acceleration = (5e3, 0.0, 1.5e3), (60.0, 80.0, 0.0), (-3.2, 2.4, 0.0)
        force = np.array(acceleration) - falling(np.array(position))
        false = np.cross(axis, force) if kind == "attitude" else axis * force
        size = 1e-3
        reference = Collection(
            center_frequency=10e9,
            bandwidth=300e6 if bandwidth == "300 MHz" else 10e9,
            aperture_time=4.0,
            paths=(flight((-5e3, 8e3, 1.5e3), velocity), flight(position, velocity, acceleration)),
            errors=(no_error, flight((0, 0, 0), (0, 0, 0), tuple(false * scale * size))),
        ).least_variance_point(steps=1)
        text = self.TURN.replace("{IMU}", f"{{{figures}}}").replace("300 MHz", bandwidth)
        error = of(analysed(text), f"receiver.imu.{kind}")
        found = error.full.times(error.declared)
        assert found.quadratic == pytest.approx(abs(reference.quadratic_rad) / size, rel=1e-4, abs=1e-6)
        assert found.cubic == pytest.approx(abs(reference.cubic_rad) / size, rel=2e-3, abs=1e-5)
        assert math.hypot(found.quadratic, found.hidden) == pytest.approx(reference.equal_loss_rad / size, rel=1e-3)
        assert (found.east, found.north) == pytest.approx(np.abs(reference.point) / size, rel=1e-4, abs=1e-6)
        if bandwidth == "10 GHz" and by_hand is not None:
            assert found.quadratic == pytest.approx(by_hand, rel=2e-2, abs=6e-3)

    def test_attitudes_about_three_axes_are_independent(self) -> None:
        """Their squares add, at the point where the image peaks too."""
        each = ("[0.26 mrad, 0 rad, 0 rad]", "[0 rad, 0.26 mrad, 0 rad]", "[0 rad, 0 rad, 5 mrad]")
        *alone, together = (
            of(analysed(self.TURN.replace("{IMU}", f"{{attitude: {axes}}}")), "receiver.imu.attitude")
            for axes in (*each, "[0.26 mrad, 0.26 mrad, 5 mrad]")
        )
        phases = [error.full.quadratic * error.declared for error in alone]
        assert together.full.quadratic * together.declared == pytest.approx(math.hypot(*phases), rel=1e-9)

    def test_heading_counts_where_a_platform_turns_only(self) -> None:
        heading = "attitude: [0 rad, 0 rad, 5 mrad]"
        text = self.TURN.replace("{IMU}", f"{{{heading}}}")
        level = text.replace("[-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]", "[0 m/s^2, 0 m/s^2, 0 m/s^2]")
        turning, straight = (of(analysed(one), "receiver.imu.attitude").full.quadratic for one in (text, level))
        assert straight < 1e-3 * turning  # what is left: the plumb line there is not that of the scene

    def test_a_satellite_in_free_fall_has_none(self) -> None:
        position = np.array([300e3, -200e3, 510e3])
        falls = ", ".join(f"{part:.9f} m/s^2" for part in falling(position))
        text = self.TURN.replace("[5 km, 0 km, 1.5 km]", "[300 km, -200 km, 510 km]")
        text = text.replace("[60 m/s, 80 m/s, 0 m/s]\n    acceleration: [-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]",
                            f"[5 km/s, 5.6 km/s, 0 m/s]\n    acceleration: [{falls}]")  # fmt: skip
        satellite = analysed(text.replace("{IMU}", "{attitude: 1 mrad, accelerometer_bias: 1 mg}"))
        assert of(satellite, "receiver.imu.attitude").full.quadratic < 1e-6
        assert of(satellite, "receiver.imu.accelerometer_bias").full.quadratic > 100

    def test_on_the_earth_it_is_normal_gravity_where_a_platform_stands(self) -> None:
        """Somigliana's closed formula on the ellipsoid, less 3.086e-6 /s² times the height; straight up there."""
        text = """
schema_version: 1
name: stands
radar: {center_frequency: 10 GHz, bandwidth: 300 MHz}
collection: {aperture_time: 4 s}
scene: {latitude: 47.2 deg, longitude: 6 deg, height: 0 m}
platforms:
  transmitter: {position: [-5 km, 8 km, 1.5 km], velocity: [60 m/s, 80 m/s, 0 m/s]}
  receiver:
    position: [0 m, 1 m, 1.5 km]
    velocity: [0 m/s, 0 m/s, 0 m/s]
    motion_error: {imu: {attitude: 1 mrad}}
"""
        mission = parse_mission(text)
        sine = math.sin(math.radians(47.2)) ** 2
        normal = 9.7803253359 * (1 + 0.00193185265241 * sine) / math.sqrt(1 - 0.00669437999013 * sine)
        force = specific_force(mission, mission.platforms.receiver.state)
        assert force[2] == pytest.approx(normal - 3.086e-6 * 1500, rel=3e-5)
        assert math.hypot(*force[:2]) < 3e-5 * force[2]

    def test_an_orbit_by_its_elements_falls_freely(self) -> None:
        """The flattening is in the orbit: without it 0.01 m/s² would be left."""
        mission = load_mission(str(ROOT / "specs" / "missions" / "sentinel1_elements_besancon.yaml"))
        assert math.hypot(*specific_force(mission, mission.platforms.transmitter.state)) < 2e-4

    def test_cases_together_are_what_each_is_alone(self) -> None:
        mission = parse_mission(self.TURN.replace("{IMU}", "{attitude: 1 mrad, accelerometer_scale_factor: 0.1 %}"))
        sides = np.array([-4.0, 0.0, 2.5])
        together = with_number(mission, "platforms.receiver.acceleration.0", sides)
        both = random_errors(together, together.geometry, sides.size)
        for place, side in enumerate(sides.tolist()):
            alone = random_errors(with_number(mission, "platforms.receiver.acceleration.0", side))
            for one, other in zip(both, alone, strict=True):
                found = in_one_case(mission, one, place).full
                assert found[:5] == pytest.approx(other.full[:5], rel=1e-9)
                assert found.covariance == pytest.approx(other.full.covariance, rel=1e-9)


# Slow against 6 s; as the receiver's filter; the fastest is half a knot of 24 nodes: its fast part would alias there.
@pytest.mark.parametrize("time", [30.0, 1.5, 0.3])
def test_gnss_noise_does_what_whole_time_series_do(time: float) -> None:
    """Three axes of its own, through exact ranges: orders 0 to 3 of each, which are all that 24 nodes can tell."""
    analysis = analysed(MISSION.replace("correlation_time: 1.5 s", f"correlation_time: {time} s"))
    mission, error = analysis.mission, of(analysis, "receiver.random.GNSS")
    rng = np.random.default_rng(5)
    fine, times = np.linspace(-3, 3, 601), aperture_nodes(6.0)
    decay = math.exp(-(fine[1] - fine[0]) / time)
    legendre = np.polynomial.legendre.legvander(fine / 3, 8)
    smooth, left = [], []
    for _ in range(3):
        noise = rng.standard_normal((len(fine), DRAWS))
        for index in range(1, len(fine)):
            noise[index] = decay * noise[index - 1] + math.sqrt(1 - decay**2) * noise[index]
        coefficients = np.linalg.pinv(legendre) @ noise
        smooth.append((np.polynomial.legendre.legvander(times / 3, 8) @ coefficients).T)
        noise -= legendre[:, :4] @ coefficients[:4]
        left.append(np.mean(np.square(noise)))
    # The frame is the track's; its axes are no matter, the three errors are alike.
    found = through_exact_ranges(mission, error.declared * np.stack(smooth, axis=-1), times)
    agrees_with_draws(error, found)
    k = 2 * math.pi / mission.radar.wavelength
    assert k * np.sqrt(np.mean(left)) == pytest.approx(error.full.spread, rel=SIGMA)
    # By (25): along a line of sight that stands still, and Q as printed has v over R where v⊥ belongs.
    assert error.published.displacement == pytest.approx(error.full.displacement, rel=0.12)


OSCILLATORS = """
    oscillator:
      frequency: 10 MHz
      phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz, 1 kHz: -150 dBc/Hz}
      bandwidth: 20 Hz
"""


@pytest.mark.parametrize("interval", [None, 0.5, 2.0])
def test_an_oscillator_does_what_whole_time_series_do(interval: float | None) -> None:
    """Tones of random phase and size; and what is left of them beside straight lines between a link's exchanges.

    The lines fold fast tones on slow ones: counting the power that they leave at its own frequency would make a
    sigma 9 % too small at two seconds.
    """
    text = MISSION.rstrip() + OSCILLATORS
    if interval is not None:
        text += f"synchronization: {{interval: {interval} s, error: 0}}\n"
    analysis = analysed(text)
    error = of(analysis, "receiver.oscillator")
    rng, draws = np.random.default_rng(3), 6_000
    edges = np.concatenate([np.geomspace(1e-3, 0.3, 60), np.arange(0.32, 20.001, 0.02)])
    f, df = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    density = 2 * 965.0**2 * np.where(f < 10, 10**-9.5 * f**-3.0, 10**-12.5 * (f / 10) ** -1.25)
    drawn = rng.standard_normal((draws, 2, len(f))) * np.sqrt(density * df)

    def phase_at(moments: np.ndarray, of_draws: np.ndarray) -> np.ndarray:
        turn = 2 * math.pi * np.multiply.outer(moments, f)
        return of_draws[..., 0, :] @ np.cos(turn).T + of_draws[..., 1, :] @ np.sin(turn).T

    t = np.linspace(-3, 3, 301)
    phase = phase_at(t, drawn)
    if interval is not None:
        knots = np.arange(-3 - interval, 3 + 2 * interval, interval)
        starts = rng.random(draws) * interval
        turn = 2 * math.pi * np.multiply.outer(starts, f)
        cosine, sine = np.cos(turn), np.sin(turn)
        # Tones from each start on: their phases turn, and knots are the same for all draws.
        later = np.stack(
            (drawn[:, 0] * cosine + drawn[:, 1] * sine, drawn[:, 1] * cosine - drawn[:, 0] * sine), axis=1
        )
        for one, start, at_knots in zip(range(draws), starts, phase_at(knots, later), strict=True):
            phase[one] -= np.interp(t, knots + start, at_knots)
    coefficients = np.polynomial.legendre.legfit(t / 3, phase.T, 3)
    left = phase - np.polynomial.legendre.legval(t / 3, coefficients)
    tolerance = 4 / math.sqrt(2 * draws)  # four standard errors of a sigma
    assert np.std(1.5 * coefficients[2]) == pytest.approx(error.published.quadratic, rel=tolerance)
    assert np.std(2.5 * coefficients[3]) == pytest.approx(error.published.cubic, rel=tolerance)
    assert np.sqrt(np.mean(left**2)) == pytest.approx(error.full.spread, rel=tolerance)
    if interval is None:  # nobody says when it was set
        assert math.isnan(error.full.displacement)
        assert math.isnan(error.published.displacement)
        return
    found = through_the_clock(analysis.mission, np.polynomial.legendre.legval(aperture_nodes(6.0) / 3, coefficients))
    for drawn, computed in zip(found[1:5], (*error.full[3:5], *error.full[:2]), strict=True):
        assert np.std(drawn) == pytest.approx(computed, rel=tolerance)


@pytest.mark.parametrize("interval", [5.0, 2.5, 1.25, 1.0, 0.2])
def test_an_interval_that_divides_the_aperture_is_no_singular_one(interval: float) -> None:
    """Edges of tones and exchanges fall together; a tone between the two was folded on 0 Hz: a division by 0."""
    pieces = [PowerLawPiece(0.0, 1e3, 1e-2, 4.0)]
    found = synchronized_parts(pieces, 5.0, interval)
    assert found == pytest.approx(synchronized_parts(pieces, 5.0, interval * 1.0001), rel=1e-3)
