"""Geometries for the image tests: the paper's ranges at any squint."""

import math
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import BistaticGeometry, PlatformState, state_from_angles
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator import point
from bisar_budget.simulator.phase_history import PathError, PhaseHistory, cell_centres, path, phase_history


@dataclass(frozen=True)
class Collection:
    """Section V at 10 GHz, both platforms turned by the same squint."""

    geometry: BistaticGeometry
    aperture_time: float = 6.0
    pulses: int = 256
    frequencies: int = 96
    center_frequency: float = 10e9
    bandwidth: float = 300e6

    @property
    def wavelength(self) -> float:
        return SPEED_OF_LIGHT_MPS / self.center_frequency

    @property
    def slow_time(self):
        return cell_centres(self.aperture_time, self.pulses)

    @property
    def cross_range_resolution(self) -> float:
        return self.geometry.cross_range_resolution(self.wavelength, self.aperture_time)

    def paths(self, **errors: PathError):
        return [
            path(getattr(self.geometry, name), self.slow_time, errors.get(name))
            for name in ("transmitter", "receiver")
        ]

    def record(self, scatterers, amplitudes=(1.0,), **errors: PathError) -> PhaseHistory:
        transmitter, receiver = self.paths(**errors)
        return phase_history(
            np.atleast_2d(np.asarray(scatterers, dtype=float)),
            np.asarray(amplitudes, dtype=complex),
            slow_time=self.slow_time,
            frequency=self.center_frequency + cell_centres(self.bandwidth, self.frequencies),
            transmitter=transmitter,
            receiver=receiver,
        )


def measured_phase(c: Collection, cut, reference, spacing: float) -> float:
    """Quadratic phase of a cut along y′ at the scene centre, its carrier taken out first."""
    look = c.geometry.look_azimuth
    across = np.array([-math.sin(look), math.cos(look), 0.0])
    flown = (one.actual for one in c.paths())
    slope = -sum(position @ across / np.linalg.norm(position, axis=1) for position in flown) / c.wavelength
    carrier = np.interp(0.0, c.slow_time, slope)
    down = np.exp(-2j * math.pi * carrier * spacing * (np.arange(cut.size) - cut.size // 2))
    place = c.slow_time / (c.aperture_time / 2)
    return _quadratic_phase(cut * down, reference * down, spacing, place, slope - carrier)


def _quadratic_phase(cut, reference, spacing: float, slow_time, spatial_frequency) -> float:
    """Quadratic phase of a response against an error-free one, by FFT: a way to read it that the package has not.

    Both cuts go back to the aperture, tapered to their ends, where a finite image cuts sidelobes off. The phase of
    their product is fitted over the inner 90 % of the aperture and the fit continued to all of it.
    """
    count = cut.size
    taper = np.cos(math.pi * (np.arange(count) - count // 2) / count) ** 2
    product = np.fft.fft(cut * taper) * np.conj(np.fft.fft(reference * taper))
    order = np.argsort(spatial_frequency)
    frequency, times = spatial_frequency[order], slow_time[order]
    place = np.interp(np.fft.fftfreq(count, spacing), frequency, times, left=np.inf, right=np.inf)
    inner = np.nonzero(np.abs(place) < 0.9)[0]
    inner = inner[np.argsort(place[inner])]
    phase = np.unwrap(np.angle(product[inner]))
    fit = np.polynomial.polynomial.polyfit(place[inner], phase, 4, w=np.sqrt(np.abs(product[inner])))
    return float(-1.5 * np.polynomial.legendre.poly2leg(fit)[2])  # the image's phase is −2π/λ times the range error


def platform(slant_range: float, height: float, azimuth: float, speed: float, squint: float) -> PlatformState:
    return state_from_angles(
        slant_range=slant_range,
        azimuth=azimuth,
        elevation=math.asin(height / slant_range),
        speed=speed,
        motion_azimuth=azimuth + math.pi / 2 + squint,
        climb=0.0,
    )


def collection(squint_deg: float = 0.0, **options) -> Collection:
    squint = math.radians(squint_deg)
    return Collection(
        BistaticGeometry(
            transmitter=platform(31e3, 6e3, 0.0, 150.0, squint),
            receiver=platform(8.5e3, 2e3, math.pi / 4, 60.0, squint),
        ),
        **options,
    )


@pytest.fixture
def broadside() -> Collection:
    return collection()


@contextmanager
def only_rotated_images() -> Iterator[None]:
    """Form a small middle of the image along (x, y), for who does not look at it.

    Forming takes pixels times pulses, most of them for that image.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(point, "_SCENE_PIXELS", 1 << 10)
        yield


@cache
def images_of(
    text: str, model: str | None = None, *, file: str = "-", rotated_only: bool = False, **how: Any
) -> point.PointImages:
    """Images of a mission file's text by `simulate_point`, formed once for all tests; nobody writes to them.

    What the text names is beside `file`. A test that looks at the rotated ones only says so.
    """
    with only_rotated_images() if rotated_only else nullcontext():
        images = point.simulate_point(parse_mission(text, file, model), **how)
    for one in images:
        if isinstance(one, np.ndarray):
            one.setflags(write=False)
    return images
