"""Delays in the air against what is printed, against integrals along rays, and against sums over frequencies.

Exact ranges and direct sums are deterministic: what is computed agrees with them within half a percent.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import EARTH_RADIUS_M, SPEED_OF_LIGHT_MPS
from bisar_budget.effects.air_delays import TROPOSPHERE_HEIGHT_M, group_delay, metres_per_unit, obliquity
from bisar_budget.effects.random_effect import RandomError, SensorCases
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.load import parse_mission
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

HALF_PERCENT = 0.005
SECOND_ORDER = 1e-3  # rad, of displacements by metres
TECU = 1e16

SECTION_V = """
schema_version: 1
name: Section V
radar: {center_frequency: 10 GHz, bandwidth: 300 MHz}
collection: {aperture_time: 6 s}
platforms:
  transmitter: {position: [30.41 km, 0 m, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s]}
  receiver: {slant_range: 8.5 km, azimuth: 45 deg, elevation: 13.6 deg, speed: 60 m/s, motion_azimuth: 135 deg}
propagation: {zenith_delay: 5 cm, zenith_electron_content: 2 TECU}
"""
ORBITS = """
schema_version: 1
name: L band from orbit
radar: {center_frequency: 1.25 GHz, bandwidth: 80 MHz}
collection: {aperture_time: 30 s}
platforms:
  transmitter: {position: [500 km, 20 km, 600 km], velocity: [0, 7500, 0], acceleration: [-4, 0, -5]}
  receiver: {position: [480 km, -20 km, 620 km], velocity: [0, 7400, 0], acceleration: [-4, 0, -5]}
propagation: {zenith_delay: 5 cm, zenith_electron_content: 20 TECU}
"""


def of(text: str, row_id: str) -> tuple[Mission, RandomError]:
    analysis = Analysis(parse_mission(text))
    return analysis.mission, next(error for error in analysis.random if error.id == f"propagation.{row_id}")


def through_exact_ranges(mission: Mission, range_error: Callable[[np.ndarray], np.ndarray]) -> ImagePoints:
    """Effect of a range error over the aperture [m], to any order."""
    T = mission.collection.aperture_time
    heard = mission.has_direct_path
    exact = ExactRanges.of(mission.geometry.both, mission.radar, T, FINE_NODE_COUNT, has_direct_path=heard)
    return followed(exact, range_error(aperture_nodes(T))[:, None], (NO_SHIFTS, NO_SHIFTS), np.zeros(1, dtype=int))


def is_what_was_found(error: RandomError, size: float, found: ImagePoints) -> None:
    """Hold magnitudes, and the signs by which they go together, to exact ranges."""
    effects = np.array((found.quadratic, found.cubic, found.east, found.north))[:, 0]
    assert np.hypot(*effects[2:]) == pytest.approx(error.full.displacement * size, rel=HALF_PERCENT)
    assert np.abs(effects[:2]) == pytest.approx(np.array(error.full[:2]) * size, rel=HALF_PERCENT, abs=SECOND_ORDER)
    some = np.ix_((0, 2, 3), (0, 2, 3))  # a cubic of the second order goes with nothing
    covariance = np.outer(effects, effects)[some]
    assert error.full.covariance[some] * size**2 == pytest.approx(covariance, rel=2 * HALF_PERCENT)


# ---------------------------------------------------------------------- what is printed
@pytest.mark.parametrize(
    ("row_id", "moved", "qpe"),
    [("transmitter.zenith_delay", 0.144, 0.015), ("receiver.zenith_delay", 0.118, 0.017)],
)
def test_five_centimetres_at_section_v(row_id: str, moved: float, qpe: float) -> None:
    _, error = of(SECTION_V, row_id)
    assert error.declared == 0.05
    assert error.full.displacement * error.declared == pytest.approx(moved, abs=5e-4)  # printed digits
    assert error.full.quadratic * error.declared == pytest.approx(qpe, abs=5e-4)


def test_a_tecu_is_25_8_cm_at_1_25_ghz() -> None:
    mission = parse_mission(ORBITS)
    assert metres_per_unit(mission, "zenith_electron_content") * TECU == pytest.approx(0.258, abs=5e-4)


def uncorrected(path: PlatformState, times: np.ndarray) -> np.ndarray:
    """Delay of a leg by a refractivity of 315 that falls by e in 7 km, summed along the straight ray. [m]"""
    position = np.stack(np.broadcast_arrays(*path.place(times)))
    along, weights = np.polynomial.legendre.leggauss(40)
    heights = position[2][:, None] * (along + 1) / 2
    slant = np.linalg.norm(position, axis=0)
    return np.asarray(slant / 2 * (315e-6 * np.exp(-heights / 7e3) @ weights))


def test_uncorrected_air_at_section_v() -> None:
    """Both legs at once, along rays: 4.9 m and 0.56 rad. By rows: each zenith column times a metre's effect."""
    mission = parse_mission(SECTION_V)
    legs = mission.geometry.both
    both = through_exact_ranges(mission, lambda times: uncorrected(legs[0], times) + uncorrected(legs[1], times))
    assert math.hypot(both.east[0], both.north[0]) == pytest.approx(4.9, abs=0.05)
    assert abs(both.quadratic[0]) == pytest.approx(0.56, abs=0.005)
    for name, path in zip(("transmitter", "receiver"), legs, strict=True):
        _, error = of(SECTION_V, f"{name}.zenith_delay")
        zenith = 315e-6 * 7e3 * (1 - math.exp(-path.position[2] / 7e3))
        is_what_was_found(
            error, zenith, through_exact_ranges(mission, lambda times, leg=path: uncorrected(leg, times))
        )


# ---------------------------------------------------------------------- from the zenith to the leg
@pytest.mark.parametrize("degrees", [90, 60, 40, 20, 10])
def test_the_air_of_a_sphere_is_a_shell_at_its_scale_height(degrees: float) -> None:
    """Against the integral over heights of an atmosphere that falls by e in 7 km: below 1 % down to 10 degrees."""
    place = (math.cos(math.radians(degrees)) * 800e3, 0.0, math.sin(math.radians(degrees)) * 800e3)
    heights = np.linspace(0, 140e3, 200_001)
    level = math.cos(math.radians(degrees)) * EARTH_RADIUS_M / (EARTH_RADIUS_M + heights)
    density = np.exp(-heights / 7e3)
    want = np.sum(density / np.sqrt(1 - level**2)) / np.sum(density)
    assert obliquity(place, TROPOSPHERE_HEIGHT_M) == pytest.approx(want, rel=0.01 if degrees < 20 else 0.002)


def test_a_flat_shell_is_one_over_the_sine() -> None:
    assert obliquity((30.41e3, 0.0, 6e3), 0.0) == pytest.approx(math.hypot(30.41, 6) / 6, rel=1e-12)


@pytest.mark.parametrize("height", [79e3, 81e3])
def test_a_leg_below_the_ionosphere_has_no_electrons(height: float) -> None:
    text = SECTION_V.replace("30.41 km, 0 m, 6 km", f"100 km, 0 m, {height - 750}")  # a sphere falls off by 780 m
    mission, error = of(text, "transmitter.zenith_electron_content")
    found = error.full.displacement
    assert found == 0 if height < 80e3 else found > 0
    flat = np.linalg.norm(mission.geometry.transmitter.position) / mission.geometry.transmitter.position[2]
    of_a_sphere = obliquity(mission.geometry.transmitter.position, TROPOSPHERE_HEIGHT_M)
    want = flat if height < 80e3 else of_a_sphere
    assert group_delay(mission, mission.geometry.transmitter, "zenith_delay", 0.0) == pytest.approx(want, rel=1e-12)


# ---------------------------------------------------------------------- exact ranges and direct sums
@pytest.mark.parametrize("text", [SECTION_V, ORBITS], ids=["flat", "orbits"])
@pytest.mark.parametrize("name", ["transmitter", "receiver"])
def test_a_delay_through_exact_ranges(text: str, name: str) -> None:
    mission, error = of(text, f"{name}.zenith_delay")
    path = getattr(mission.geometry, name)
    found = through_exact_ranges(mission, lambda times: 0.2 * group_delay(mission, path, "zenith_delay", times))
    is_what_was_found(error, 0.2, found)


def test_a_delay_with_the_direct_path_as_clock() -> None:
    """The direct signal is taken for one that no air delays."""
    link = "synchronization: {method: direct_path, error: 1 deg}\n"
    mission, error = of(f"{SECTION_V.strip()}\n{link}", "receiver.zenith_delay")
    path = mission.geometry.receiver
    found = through_exact_ranges(mission, lambda times: 0.05 * group_delay(mission, path, "zenith_delay", times))
    is_what_was_found(error, 0.05, found)


class DirectSum:
    """A point with free electrons on one leg, as sums over frequencies and pulses: no image former, no expansion."""

    def __init__(self, mission: Mission, name: str, content: float, count: int = 96) -> None:
        cells = (np.arange(count) + 0.5) / count - 0.5
        radar, self.times = mission.radar, cells * mission.collection.aperture_time
        self.frequency = radar.center_frequency + cells * radar.bandwidth
        self.tracks = [np.stack(np.broadcast_arrays(*leg.place(self.times))) for leg in mission.geometry.both]
        path = getattr(mission.geometry, name)
        x, y, z = path.place(self.times)
        # A shell at 350 km, whose point of passage is where the ray meets the sphere: length over height difference.
        level = np.hypot(x, y) / np.sqrt(x**2 + y**2 + z**2) * EARTH_RADIUS_M / (EARTH_RADIUS_M + 350e3)
        electrons = content / np.sqrt(1 - level**2)
        self.air = 2 * math.pi * 40.308 * np.multiply.outer(electrons, 1 / self.frequency) / SPEED_OF_LIGHT_MPS
        self.half = mission.collection.aperture_time / 2

    def pulses(self, east: float, north: float) -> np.ndarray:
        """Contribution of each pulse to the image of a scene centre's echo, at a ground point."""
        away = sum(
            np.linalg.norm(track - np.array([[east], [north], [0.0]]), axis=0) - np.linalg.norm(track, axis=0)
            for track in self.tracks
        )
        phase = 2 * math.pi * np.multiply.outer(away, self.frequency) / SPEED_OF_LIGHT_MPS + self.air
        return np.exp(1j * phase).sum(axis=1)

    def peak(self, start: tuple[float, float], step: tuple[float, float]) -> tuple[float, float]:
        """The brightest point, by parabolas along both axes."""
        place, steps = np.array(start), np.array(step)
        for _ in range(60):
            for axis in (0, 1):
                way = np.eye(2)[axis] * steps[axis]
                low, here, high = (np.abs(self.pulses(*(place + sign * way)).sum()) for sign in (-1, 0, 1))
                place = place + way * np.clip((low - high) / (2 * (low - 2 * here + high)), -1, 1)
            steps = np.maximum(steps * 0.8, np.array(step) * 0.02)
        return float(place[0]), float(place[1])

    def brightness(self, place: tuple[float, float]) -> float:
        """Amplitude of the image over that of a focused point."""
        return float(np.abs(self.pulses(*place).sum()) / (self.times.size * self.frequency.size))

    def quadratic(self, place: tuple[float, float]) -> float:
        """Quadratic phase at the aperture edge, of what the pulses have there. [rad]"""
        phase = np.unwrap(np.angle(self.pulses(*place)))
        return float(1.5 * np.polynomial.legendre.legfit(self.times / self.half, phase, 6)[2])


@pytest.mark.parametrize("name", ["transmitter", "receiver"])
def test_free_electrons_as_a_direct_sum(name: str) -> None:
    """The envelope is late and the phase early: range by the group, all else by the phase, with its other sign.

    A displacement of 26 m. Dispersion over a band of 6 %, 0.9 rad at its ends, changes it by 0.1 %, and the quadratic
    phase, that of the displacement included, as little. Of a defocused response the peak lies a bit nearer.
    """
    mission, error = of(ORBITS, f"{name}.zenith_electron_content")
    content = 100 * TECU
    moved, qpe = error.full.displacement * content, error.full.quadratic * content
    assert moved > 20
    assert qpe > 1
    summed = DirectSum(mission, name, content)
    # Which way is that of the covariance: west, towards the platforms, is nearer.
    east = -error.full.east * content
    north = east * error.full.covariance[2, 3] / error.full.covariance[2, 2]
    place = summed.peak((east, north), (0.3, 0.03))
    assert place[0] == pytest.approx(east, rel=HALF_PERCENT)
    assert place[1] == pytest.approx(north, abs=0.02)  # a tenth of a cell
    assert abs(summed.quadratic((east, north))) == pytest.approx(qpe, rel=HALF_PERCENT)


def test_the_slope_of_free_electrons_has_the_other_sign() -> None:
    """A platform that looks ahead: where the slope of the group would put the image there is none."""
    text = ORBITS.replace("[500 km, 20 km, 600 km]", "[300 km, 500 km, 600 km]").replace("30 s", "8 s")
    mission, error = of(text, "transmitter.zenith_electron_content")
    path, content = mission.geometry.transmitter, 100 * TECU

    def group(times: np.ndarray) -> np.ndarray:
        return np.asarray(content * group_delay(mission, path, "zenith_electron_content", times))

    mean = float(group(np.linspace(-4, 4, 20_001)).mean())
    summed, by_group = DirectSum(mission, "transmitter", content), through_exact_ranges(mission, group)
    found = through_exact_ranges(mission, lambda times: 2 * mean - group(times))
    place = summed.peak((found.east[0], found.north[0]), (0.3, 0.3))
    assert place == pytest.approx((found.east[0], found.north[0]), abs=0.02)  # of 39 m, and of cells of 3 m
    assert error.full.displacement * content == pytest.approx(math.hypot(*place), rel=HALF_PERCENT)
    assert summed.brightness(place) > 0.9
    assert summed.brightness((by_group.east[0], by_group.north[0])) < 0.05


# ---------------------------------------------------------------------- courses
def test_courses_are_independent_errors_of_one_course_each() -> None:
    """`of_courses` of two at once: their squares add, through exact ranges and with Q of (25)."""
    mission = parse_mission(SECTION_V)
    seen = SensorCases(mission, mission.geometry, 1)
    places = seen.exact.sampling.places[:, None]
    courses = np.stack([1 + 0.3 * places + 0.02 * places**2, 0.4 * places**3 - 0.1])
    apart = [seen.of_courses(one[None], one[None]) for one in courses]
    published, full = seen.of_courses(courses, courses)
    for model, together in enumerate((published, full)):
        for part in (0, 1, 3, 4):
            want = np.sqrt(sum(one[model][part] ** 2 for one in apart))
            assert together[part] == pytest.approx(want, rel=1e-9)
    assert full.covariance == pytest.approx(apart[0][1].covariance + apart[1][1].covariance, rel=1e-9, abs=1e-12)
    size = 0.01  # m: small enough for a first order
    for course, (by_table, alone) in zip(courses, apart, strict=True):
        fitted = np.polynomial.legendre.legfit(places[:, 0], course[:, 0], 5)
        found = through_exact_ranges(mission, lambda t, f=fitted: size * np.polynomial.legendre.legval(t / 3.0, f))
        assert abs(found.quadratic[0]) == pytest.approx(alone.quadratic[0] * size, rel=HALF_PERCENT)
        assert abs(found.cubic[0]) == pytest.approx(alone.cubic[0] * size, rel=HALF_PERCENT)
        assert abs(found.east[0]) == pytest.approx(alone.east[0] * size, rel=HALF_PERCENT)
        k = 2 * math.pi / mission.radar.wavelength
        assert by_table.quadratic[0] == pytest.approx(abs(1.5 * fitted[2]) * k, rel=1e-9, abs=1e-9)
        assert by_table.cubic[0] == pytest.approx(abs(2.5 * fitted[3]) * k, rel=1e-9, abs=1e-9)
        moved = Analysis(mission).published.plane.adjugate
        (a, b), _ = moved
        determinant = Analysis(mission).published.plane.determinant
        want = abs(a * fitted[0] + b * fitted[1] / 3.0) / abs(determinant)
        assert by_table.east[0] == pytest.approx(want, rel=1e-9)


def test_many_cases_are_those_of_each() -> None:
    """Heights from within the air to an orbit, in arrays."""
    mission, key = parse_mission(SECTION_V), "platforms.transmitter.position.2"
    heights = np.array([4e3, 30e3, 79e3, 90e3, 300e3, 500e3])
    together = with_number(mission, key, heights)
    many = random_errors(together, together.geometry, heights.size)
    for case, height in enumerate(heights):
        for one, alone in zip(many, random_errors(with_number(mission, key, float(height))), strict=True):
            assert one.id == alone.id
            assert one.full.of(case)[:5] == pytest.approx(alone.full[:5], rel=1e-9)
            assert one.published.of(case)[:5] == pytest.approx(alone.published[:5], rel=1e-9)
