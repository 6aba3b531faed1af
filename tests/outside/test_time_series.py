"""Random errors against time series: drawn moment by moment, put through exact ranges, and fitted.

The code that draws and fits uses only NumPy and allantools, and nothing of the package. A sigma of N draws is known
to 1/√(2N) of itself, 1.1 % for 4 096 draws; the tolerance is four of these standard errors. A phase of variance σ²
that spreads leaves e^−σ² of a point's energy in the response: its ISLR is e^σ² − 1. The tolerance of the ISLR is four
standard errors of a sigma, in dB: a window has many moments, which vary less.
"""

import math
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from typing import Any

import allantools
import numpy as np
import pytest
from numpy.typing import NDArray

import bisar_budget as bb
from tests.outside.record import compare

Floats = NDArray[np.float64]

DRAWS = 4096
TOLERANCE = 4 / math.sqrt(2 * DRAWS)  # of a sigma
TOLERANCE_DB = 20 * math.log10(1 + TOLERANCE)
OURS = "time series of the tests, by NumPy"

WAVELENGTH = 299792458 / 9.65e9  # m
T = 6.0  # s
TRANSMITTER = np.array([[30e3, 4e3, 9e3], [0, 180.0, 0]])  # place and velocity at mid-aperture
RECEIVER = np.array([[819.15, 1418.82, 1147.15], [-33.807, 9.0587, 0]])


# ---------------------------------------------------------------------- exact ranges
class Ranges:
    """Range histories of a pair on straight paths, and what an error of them does to the image of a point."""

    def __init__(self, aperture: float, samples: int) -> None:
        self.tau = np.linspace(-aperture / 2, aperture / 2, samples)
        basis = np.polynomial.legendre.legvander(2 * self.tau / aperture, 3)
        self.fit = np.linalg.pinv(basis)  # orders 0 … 3 by least squares
        self.basis = basis
        self.paths = [one[0] + one[1] * self.tau[:, None] for one in (TRANSMITTER, RECEIVER)]

    def to(self, point: Floats, moved: Floats | None = None) -> Floats:
        """Sum of ranges to ground points, (draws, 2), with the receiver `moved`, (draws, samples, 3)."""
        ground = np.concatenate([point, np.zeros((len(point), 1))], axis=1)[:, None]
        receiver = self.paths[1] if moved is None else self.paths[1] + moved
        return sum(np.linalg.norm(path - ground, axis=-1) for path in (self.paths[0], receiver))

    def effects(self, moved: Floats | None = None, clock: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """Quadratic and cubic phase at the aperture edge [rad], and mean square of what is left [rad²], of each draw.

        The processor takes the receiver for `moved`, and the recorded ranges are longer by `clock`. [m] The image of
        a point at the origin peaks at that ground point whose ranges differ from the recorded ones by no constant
        and no linear part.
        """
        draws = len(clock if moved is None else moved)
        recorded = self.to(np.zeros((1, 2))) + (0.0 if clock is None else clock)
        point = np.zeros((draws, 2))
        steps = [(self.to(np.array([one])) - self.to(-np.array([one])))[0] / 2 for one in ([1.0, 0], [0, 1.0])]
        slopes = np.array([(self.fit @ step)[:2] for step in steps]).T  # of orders 0 and 1 by east and north
        for _ in range(3):  # Newton's steps; the matrix changes by 1e-4 from metres
            off = (self.to(point, moved) - recorded) @ self.fit.T
            point = point - np.linalg.solve(slopes, off[:, :2].T).T
        phase = 2 * math.pi / WAVELENGTH * (self.to(point, moved) - recorded)
        orders = phase @ self.fit.T
        left = np.mean((phase - orders @ self.basis.T) ** 2, axis=1)
        return 1.5 * orders[:, 2], 2.5 * orders[:, 3], left


def checked(receiver: str = "", both: str = "", more: str = "", aperture: float = T) -> Any:
    """What the package finds of the same pair; `both` is of each platform, `receiver` of that one alone."""
    places = [
        f"position: [{', '.join(f'{x} m' for x in one[0])}], velocity: [{', '.join(f'{v} m/s' for v in one[1])}]"
        for one in (TRANSMITTER, RECEIVER)
    ]
    return bb.check(
        bb.loads(f"""
schema_version: 1
name: time series
radar: {{center_frequency: 9.65 GHz, bandwidth: 150 MHz}}
collection: {{aperture_time: {aperture} s}}
platforms:
  transmitter: {{{places[0]}{both}}}
  receiver: {{{places[1]}{both}{receiver}}}
requirements: {{quadratic_phase_error: 45 deg, cubic_phase_error: 45 deg, islr: -20 dB}}
allocation: {{combine: rss}}
simulation: {{window: taylor}} # its mainlobe holds what is no sidelobe
{more}
""")
    )


# ---------------------------------------------------------------------- inertial sensors and GNSS
def walk(rng: np.random.Generator, tau: Floats) -> Floats:
    """White noise of density 1 /√s, integrated once from mid-aperture on, each way, (draws, samples, axes)."""
    half, step = len(tau) // 2, tau[1] - tau[0]
    sides = np.cumsum(rng.standard_normal((2, DRAWS, half, 3)) * math.sqrt(step), axis=2)
    return np.concatenate([-sides[0][:, ::-1], np.zeros((DRAWS, 1, 3)), sides[1]], axis=1)


def integrated(rate: Floats, tau: Floats) -> Floats:
    """Integral over time, nothing at mid-aperture."""
    total = np.zeros_like(rate)
    total[:, 1:] = np.cumsum((rate[:, 1:] + rate[:, :-1]) / 2 * (tau[1] - tau[0]), axis=1)
    return total - total[:, len(tau) // 2 : len(tau) // 2 + 1]


UP = np.array([0.0, 0.0, 3.986004418e14 / (6371e3 + RECEIVER[0, 2]) ** 2])  # specific force in level flight [m/s²]


def velocity_random_walk(rng: np.random.Generator, tau: Floats) -> Floats:
    return 0.06 / 60 * integrated(walk(rng, tau), tau)  # 0.06 m/s/√h


def angle_random_walk(rng: np.random.Generator, tau: Floats) -> Floats:
    attitude = math.radians(0.15) / 60 * walk(rng, tau)  # 0.15 deg/√h
    return integrated(integrated(np.cross(attitude, UP), tau), tau)


def gyro_bias(rng: np.random.Generator, tau: Floats) -> Floats:
    rate = math.radians(5) / 3600 * rng.standard_normal((DRAWS, 1, 3))  # 5 deg/h
    return np.cross(rate, UP) * tau[:, None] ** 3 / 6


def accelerometer_bias(rng: np.random.Generator, tau: Floats) -> Floats:
    return 50 * 9.80665e-6 * rng.standard_normal((DRAWS, 1, 3)) * tau[:, None] ** 2 / 2  # 50 µg


def gauss_markov(rng: np.random.Generator, tau: Floats) -> Floats:
    """2 mm with a correlation time of 1.5 s, each step by its exact law."""
    decay = math.exp(-(tau[1] - tau[0]) / 1.5)
    noise = rng.standard_normal((DRAWS, len(tau), 3))
    for index in range(1, len(tau)):
        noise[:, index] = decay * noise[:, index - 1] + math.sqrt(1 - decay**2) * noise[:, index]
    return 0.002 * noise


SENSORS: dict[str, tuple[Callable[[np.random.Generator, Floats], Floats], str]] = {
    "imu.accelerometer_bias": (accelerometer_bias, "imu: {accelerometer_bias: 50 ug}"),
    "imu.gyro_bias": (gyro_bias, "imu: {gyro_bias: 5 deg/h}"),
    "imu.velocity_random_walk": (velocity_random_walk, "imu: {velocity_random_walk: 0.06 m/s/sqrt(h)}"),
    "imu.angle_random_walk": (angle_random_walk, "imu: {angle_random_walk: 0.15 deg/sqrt(h)}"),
    "random.GNSS": (gauss_markov, "random: [{name: GNSS, sigma: 2 mm, correlation_time: 1.5 s}]"),
}


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor(name: str) -> None:
    draw, stated = SENSORS[name]
    ranges = Ranges(T, 241)
    quadratic, cubic, left = ranges.effects(moved=draw(np.random.default_rng(20261125), ranges.tau))
    row = checked(receiver=f", motion_error: {{{stated}}}")[f"receiver.{name}"]
    said = stated.rpartition("{")[2].rstrip("}]").replace("_", " ").removeprefix("name: ")
    if name != "imu.gyro_bias":  # a jerk has none but by the curve of its ranges
        there = float(np.std(quadratic))
        compare(f"{said}: quadratic phase", there, row.qpe_full_rad, "rad", TOLERANCE * there, OURS)
    if name != "imu.accelerometer_bias":
        there = float(np.std(cubic))
        compare(f"{said}: cubic phase", there, row.cubic_rad, "rad", TOLERANCE * there, OURS)
    if name == "random.GNSS":  # of walks next to nothing is left after the cubic
        there = 10 * math.log10(math.expm1(np.mean(left)))
        compare(f"{said}: ISLR", there, row.islr_db, "dB", TOLERANCE_DB, OURS)


# ---------------------------------------------------------------------- oscillators
RATE, BAND = 100.0, 40.0  # samples per second, and to where noise goes [Hz]
COEFFICIENTS = (-95.0, -90.0, None, -130.0, -155.0)  # dB of f⁻⁴ … f⁰ at 10 MHz, of L: half of the one-sided spectrum
LAW = ", ".join(
    f"h{2 - n}: {2 * 10 ** (level / 10) / 1e14}"
    for n, level in zip((4, 3, 2, 1, 0), COEFFICIENTS, strict=True)
    if level is not None
)
CLOCK = f", oscillator: {{frequency: 10 MHz, power_law: {{{LAW}}}, bandwidth: {BAND} Hz}}"


def spectrum(f: Floats) -> Floats:
    """One-sided, of the phase at 9.65 GHz of two such clocks. [rad²/Hz]"""
    levels = zip((4, 3, 2, 1, 0), COEFFICIENTS, strict=True)
    one = sum(10 ** (level / 10) * f**-n for n, level in levels if level is not None)
    return np.where(f <= BAND, 2 * 2 * 965.0**2 * one, 0.0)


@cache
def phases(aperture: float) -> Floats:
    """Windows of the phase of two clocks, each with an aperture more behind it, (draws, samples).

    By their spectrum, in records of 256 apertures: slower tones than one per record have 0.5 % of the power of a
    quadratic phase, and none of another's.
    """
    rng, count = np.random.default_rng(11), round(256 * aperture * RATE)
    f = np.arange(1, count // 2 + 1) / (256 * aperture)
    sizes = np.sqrt(spectrum(f) / (256 * aperture))
    found = []
    for _ in range(DRAWS // 256):
        drawn = rng.standard_normal(len(f)) - 1j * rng.standard_normal(len(f))
        record = np.fft.irfft(np.concatenate([[0], count / 2 * sizes * drawn]), count)
        twice = np.concatenate([record, record]).reshape(2 * 256, -1)
        found.append(np.concatenate([twice[:256], twice[1:257]], axis=1))
    return np.concatenate(found)


def test_two_free_clocks() -> None:
    """By the orders of the phase itself: nobody says when these clocks were set, and they displace without end."""
    ranges = Ranges(2.0, 201)
    window = phases(2.0)[:, :201]
    orders = window @ ranges.fit.T
    left = np.mean((window - orders @ ranges.basis.T) ** 2)
    found = checked(both=CLOCK, aperture=2.0)
    there = float(np.std(1.5 * orders[:, 2]))
    here = found["mission.quadratic_phase_error"].qpe_full_rad
    compare("two 10 MHz clocks, T 2 s: quadratic phase", there, here, "rad", TOLERANCE * there, OURS)
    there = float(np.std(2.5 * orders[:, 3]))
    here = found["mission.cubic_phase_error"].cubic_rad
    compare("two 10 MHz clocks, T 2 s: cubic phase", there, here, "rad", TOLERANCE * there, OURS)
    here = found["mission.islr"].islr_db
    compare("two 10 MHz clocks, T 2 s: ISLR", 10 * math.log10(math.expm1(left)), here, "dB", TOLERANCE_DB, OURS)


def test_two_clocks_that_a_link_joins() -> None:
    """Pulses each 200 ms, each with 1 degree of its own, straight lines between; then through exact ranges."""
    rng, ranges, step = np.random.default_rng(12), Ranges(5.0, 501), 20
    series = phases(5.0)
    left = np.empty((DRAWS, 501))
    for draw, one in enumerate(series):
        start = int(rng.integers(step))  # where in the interval the aperture begins
        knots = np.arange(0, 501 + 2 * step, step)
        read = one[knots] + math.radians(1) * rng.standard_normal(len(knots))
        at = np.arange(start, start + 501)
        left[draw] = one[at] - np.interp(at, knots, read)
    quadratic, _, spread = ranges.effects(clock=WAVELENGTH / (2 * math.pi) * left)
    found = checked(both=CLOCK, more="synchronization: {interval: 200 ms, error: 1 deg}", aperture=5.0)
    there = float(np.std(quadratic))
    here = found["mission.quadratic_phase_error"].qpe_full_rad
    compare("the same with pulses each 200 ms, T 5 s: quadratic phase", there, here, "rad", TOLERANCE * there, OURS)
    there = 10 * math.log10(math.expm1(np.mean(spread)))
    here = found["mission.islr"].islr_db
    compare("the same with pulses each 200 ms, T 5 s: ISLR", there, here, "dB", TOLERANCE_DB, OURS)


@pytest.mark.parametrize(
    ("slope", "key", "said"), [(-2, "h0", "white"), (-3, "h-1", "flicker"), (-4, "h-2", "random walk of")]
)
def test_a_clock_of_allantools(slope: int, key: str, said: str) -> None:
    """Noise by Kasdin & Walter's filters, one long record, cut into apertures of 64 samples.

    Their density is that of a continuous noise up to a part of the rate of samples: of white frequency noise, whose
    quadratic phase has most of its fast tones, the edge of the band takes half a percent. The ISLR has the end of the
    band in it, which filters of samples do not have: it is not compared.
    """
    samples, aperture = 64, 2.0
    np.random.seed(13)  # from which theirs draws
    noise = allantools.Noise(nr=2**18, qd=1e-24, b=slope)
    noise.generateNoise()
    dt = aperture / samples
    phase = 2 * math.pi * 9.65e9 * np.asarray(noise.time_series)[: DRAWS * samples].reshape(DRAWS, samples)
    # A sample stands for the middle of its part of the aperture.
    basis = np.polynomial.legendre.legvander((2 * np.arange(samples) + 1) / samples - 1, 3)
    orders = phase @ np.linalg.pinv(basis).T
    h = 4 * math.pi**2 * noise.phase_psd_from_qd(dt)  # S_y = (2πf)²·S_x
    clock = f", oscillator: {{frequency: 10 MHz, power_law: {{{key}: {h}}}, bandwidth: 1 kHz}}"
    row = checked(receiver=clock, aperture=aperture)["receiver.oscillator"]
    source = "allantools, noise after Kasdin & Walter 1992"
    for what, of_samples, here in (
        ("quadratic", 1.5 * orders[:, 2], row.qpe_full_rad),
        ("cubic", 2.5 * orders[:, 3], row.cubic_rad),
    ):
        there = float(np.std(of_samples))
        compare(
            f"{said} frequency noise: {what} phase",
            there,
            here,
            "rad",
            TOLERANCE * there,
            source,
            version("allantools"),
        )
