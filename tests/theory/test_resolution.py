"""Widths of the response without errors, against direct sums over band and aperture, and Bessel's J₀ of a ring."""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.special import j0

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.mission.load import parse_mission
from bisar_budget.ranges.exact_ranges import ExactRanges
from bisar_budget.ranges.resolution import Resolution, resolution
from tests.families import mission_text

C = 299_792_458.0
P_BAND = SimpleNamespace(center_frequency=435e6, bandwidth=100e6, wavelength=C / 435e6)
RATE = 0.025  # rad/s, of the drone on its circle
MAST = PlatformState(position=(600.0, 500.0, 60.0), velocity=(0.0, 0.0, 0.0))
PULSES, FREQUENCIES = 600, 80  # of a direct sum: midpoints leave (2π/80)²/24 of a null


@dataclass(frozen=True, kw_only=True)
class Circle(PlatformState):
    """A drone on a circle of 1 km about the scene at 500 m, from an azimuth at mid-aperture on."""

    azimuth_rad: float = 0.3

    def of(self, cases):
        return self

    def place(self, tau):
        angle = self.azimuth_rad + RATE * np.asarray(tau)
        return 1e3 * np.cos(angle), 1e3 * np.sin(angle), 500.0 + 0 * angle


def circle(azimuth: float = 0.3) -> BistaticGeometry:
    x, y = math.cos(azimuth), math.sin(azimuth)
    drone = Circle(position=(1e3 * x, 1e3 * y, 500.0), velocity=(-25 * y, 25 * x, 0.0), azimuth_rad=azimuth)
    return BistaticGeometry(transmitter=MAST, receiver=drone)


def of(geometry: BistaticGeometry, T: float) -> Resolution:
    exact = ExactRanges.of(geometry.both, P_BAND, T, 64)
    return plain(resolution(exact, geometry, P_BAND, T))


def plain(widths: Resolution) -> Resolution:
    return Resolution(*(float(width[0]) for width in widths))


def summed(geometry: BistaticGeometry, radar, T: float) -> Resolution:
    """First minimum and half power along the line of equal range, and along the conjugate direction."""
    tau = ((np.arange(PULSES) + 0.5) / PULSES - 0.5) * T
    g = np.zeros((PULSES, 2))
    for path in geometry.both:
        position = np.stack(np.broadcast_arrays(*path.place(tau)), axis=1)
        g += (position / np.linalg.norm(position, axis=1, keepdims=True))[:, :2]
    frequency = radar.center_frequency + ((np.arange(FREQUENCIES) + 0.5) / FREQUENCIES - 0.5) * radar.bandwidth
    support = (2 * math.pi / C * frequency[:, None, None] * g).reshape(-1, 2)
    support -= support.mean(axis=0)
    ahead = np.array((math.cos(geometry.look_azimuth), math.sin(geometry.look_azimuth)))
    across = np.array((-ahead[1], ahead[0]))
    x, y = support.T @ support @ across
    conjugate = np.array((y, -x)) / (y * ahead[0] - x * ahead[1])
    widths = []
    for along in (conjugate, across):
        phase = support @ along

        def power(step: float, phase=phase) -> float:
            return float(abs(np.exp(1j * phase * step).mean()) ** 2)

        grid = np.linspace(0, 6 / phase.std(), 80)
        levels = np.array([power(step) for step in grid])
        below = int((levels < 0.5).argmax())
        half = brentq(lambda step, power=power: power(step) - 0.5, grid[below - 1], grid[below], xtol=1e-6)
        least = below + int((np.diff(levels[below:]) > 0).argmax())
        null = minimize_scalar(power, bounds=(grid[least - 1], grid[least + 1]), method="bounded")
        widths += [null.x, 2 * half]
    return Resolution(widths[0], widths[2], widths[1], widths[3])


def near(found: Resolution, expected: tuple[float, ...], tolerance: float) -> bool:
    return all(abs(one / other - 1) < tolerance for one, other in zip(found, expected, strict=True))


def test_a_full_circle_resolves_a_quarter_of_a_metre_each_way() -> None:
    """The formulas by the gradients of mid-aperture say 1.6 x 0.13 m. A ring of wave numbers gives |J₀|² = ½."""
    geometry, T = circle(), 2 * math.pi / RATE
    found = of(geometry, T)
    ring = 2 * brentq(lambda x: j0(x) ** 2 - 0.5, 0.5, 2) * C / (2 * math.pi * 435e6) / (1e3 / math.hypot(1e3, 500))
    assert near(found[2:], (ring, ring), 0.01)
    assert found.range_half_power == pytest.approx(0.275, abs=1e-3)
    assert geometry.cross_range_resolution(P_BAND.wavelength, T) < 0.13 < found.cross_range / 2
    assert near(found, summed(geometry, P_BAND, T), 1e-3)


@pytest.mark.parametrize(("azimuth", "T"), [(0.3, 20.0), (2.5, 60.0), (3.836, 20.0), (3.836, 150.0)])
def test_any_arc_of_a_circle(azimuth: float, T: float) -> None:
    """At 3.836 rad gradients are parallel at mid-aperture: of 20 s the null lies at 1.8 widths, not at 1.1."""
    assert near(of(circle(azimuth), T), summed(circle(azimuth), P_BAND, T), 1e-3)


@pytest.mark.parametrize(
    ("family", "seed", "is_closed"),
    [("aircraft", 0, True), ("satellite_fixed", 0, True), ("jets", 0, False), ("jets", 3, False)],
)
def test_the_formulas_hold_where_the_support_is_a_parallelogram(family: str, seed: int, is_closed: bool) -> None:
    """To 1 %; jets that turn, their gradients 30 and 13 degrees apart, are 2 and 6 % off: there the sum counts."""
    mission = parse_mission(mission_text(family, seed))
    geometry, radar, T = mission.geometry, mission.radar, mission.collection.aperture_time
    found = plain(Analysis(mission).resolution)
    formulas = geometry.range_resolution(radar.bandwidth, C), geometry.cross_range_resolution(radar.wavelength, T)
    assert near(found[:2], formulas, 1e-9) == is_closed
    assert near(found, summed(geometry, radar, T), 0.01 if is_closed else 1e-3)
    if not is_closed:
        assert abs(found.cross_range / formulas[1] - 1) > 0.02
