"""Vibration by its spectrum, and oscillators under acceleration: against print, dense integrals and time series."""

import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.vibration_limits import highest_echo, level_of
from bisar_budget.budget.check import check_mission
from bisar_budget.constants import SPEED_OF_LIGHT_MPS, STANDARD_GRAVITY_MPS2
from bisar_budget.effects.oscillator_acceleration import accelerated_tones, pieces_by_acceleration
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.vibration import displacement_rms
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
from tests.conftest import TODAY, row

G = STANDARD_GRAVITY_MPS2
QUALIFICATION = "{spectrum: {20 Hz: 0.04 g^2/Hz, 1 kHz: 0.04 g^2/Hz}}"
CRYSTAL = "frequency: 10 MHz, power_law: {h0: 1e-30}"


def mission(
    vibration: str = "{}",
    oscillator: str = "",
    T: float = 6.0,
    path: str = "",
    requirements: str = "",
    more: str = "",
) -> Mission:
    clock = f"    oscillator: {{{CRYSTAL}, {oscillator}}}\n" if oscillator else ""
    return parse_mission(f"""
schema_version: 1
name: Vibration
radar: {{center_frequency: 10 GHz, bandwidth: 150 MHz}}
collection: {{aperture_time: {T} s}}
platforms:
  transmitter: {{position: [30 km, 4 km, 9 km], velocity: [0 m/s, 180 m/s, 0 m/s]}}
  receiver:
    position: [820 m, 1419 m, 1147 m]
    velocity: [-33.8 m/s, 9 m/s, 0]
    {path}
    motion_error: {{vibration: {vibration}}}
{clock}
requirements: {{quadratic_phase_error: 45 deg, {requirements}}}
{more}
""")


def of(mission: Mission, row_id: str) -> RandomError:
    return next(error for error in Analysis(mission).random if error.id == row_id)


def spherical(n: int, x: np.ndarray) -> np.ndarray:
    """j₀ … j₃ as textbooks have them."""
    s, c = np.sin(x), np.cos(x)
    return (
        s / x,
        s / x**2 - c / x,
        (3 / x**3 - 1 / x) * s - 3 * c / x**2,
        (15 / x**4 - 6 / x**2) * s - (15 / x**3 - 1 / x) * c,
    )[n]


def dense(density, low: float, high: float, T: float) -> np.ndarray:
    """Mean squares by trapezoids: quadratic, cubic, left, constant, slope at the edge."""
    f = np.geomspace(low, high, 400_001)
    squares = [spherical(n, math.pi * f * T) ** 2 for n in range(4)]
    left = 1 - sum((2 * n + 1) * one for n, one in enumerate(squares))
    weights = (7.5**2 * squares[2], 17.5**2 * squares[3], left, squares[0], 9 * squares[1])
    return np.array([np.trapezoid(density(f) * one, f) for one in weights])


# ---------------------------------------------------------------------- values from print
def test_the_qualification_level_at_x_band() -> None:
    """0.04 g²/Hz from 20 Hz to 1 kHz: 0.321 mm rms, 0.0672 rad one way at 10 GHz, -23.4 dB of power."""
    found = mission(QUALIFICATION)
    spectrum = found.platforms.receiver.motion_error.vibration.spectrum
    assert displacement_rms(spectrum) * 1e3 == pytest.approx(0.321, abs=5e-4)
    spread = of(found, "receiver.vibration.spectrum").full.spread
    assert spread == pytest.approx(0.0672, abs=5e-5)
    assert 20 * math.log10(spread) == pytest.approx(-23.4, abs=0.06)


@pytest.mark.parametrize(("gamma", "variance", "level"), [(1e-9, 0.196, -6.6), (1e-10, 0.00196, -27.1)])
def test_random_vibration_of_an_oscillator(gamma: float, variance: float, level: float) -> None:
    """The same on an oscillator of Γ 1e-9/g: 0.196 rad², -6.6 dB beside the response; 1e-10/g: -27.1 dB."""
    error = of(mission(QUALIFICATION, f"acceleration_sensitivity: {gamma} /g"), "receiver.oscillator.acceleration")
    found = (error.full.spread * error.declared) ** 2
    assert found == pytest.approx(variance, rel=3e-3)  # printed to three digits
    assert 10 * math.log10(math.expm1(found)) == pytest.approx(level, abs=0.06)


def test_filler_and_vig() -> None:
    """Vig's tutorial: 1e-9/g, 10 MHz, 0.1 g²/Hz has -53 dBc at 1 Hz and 20 dB less each decade; by Filler's formula.

    A tone of 1 g at 10 Hz is 1 rad at 10 GHz.
    """
    found = mission("{spectrum: {1 Hz: 0.1 g^2/Hz, 10 kHz: 0.1 g^2/Hz}}", "acceleration_sensitivity: 1e-9 /g")
    (piece,) = pieces_by_acceleration(found._replace(radar=found.radar._replace(center_frequency=1e7)), "receiver")
    for f, level in ((1.0, -53), (10.0, -73), (100.0, -93), (1e3, -113), (1e4, -133)):
        ssb = 10 * math.log10(piece.at(f) * (1e-9 / G) ** 2 / 2)
        assert ssb == pytest.approx(level, abs=0.5)
        assert ssb == pytest.approx(20 * math.log10(1e-9 * 1e7 * math.sqrt(2 * 0.1) / (2 * f)))
    (tone,) = accelerated_tones(
        mission("{sinusoidal: [{amplitude: 1 g, frequency: 10 Hz}]}", "acceleration_sensitivity: 1e-9 /g")
    )
    assert tone.phase == pytest.approx(1.0)


def test_a_tone_shakes_the_oscillator_more_than_the_path() -> None:
    """100 µm at 50 Hz, 1.006 g: -39.6 dB by the motion alone, -19.9 dB with an oscillator of 1e-9/g."""
    text = "{sinusoidal: [{amplitude: 100 um, frequency: 50 Hz}]}"
    alone, both = mission(text), mission(text, "acceleration_sensitivity: 1e-9 /g")
    for found, level in ((alone, -39.6), (both, -19.9)):
        echo = highest_echo(Analysis(found).tones)
        assert echo is not None
        assert 20 * math.log10(echo.level) == pytest.approx(level, abs=0.06)


def test_motion_and_oscillator_are_a_quarter_of_a_turn_apart() -> None:
    """The transform of what a receiver on a shaking mast records: displacement, and the phase that Γ·a adds up to."""
    f, T, A, gamma, f_0 = 25.0, 2.0, 1e-3, 5e-10 / G, 10e9
    t = (np.arange(8192) + 0.5) / 8192 * T
    motion = 2 * math.pi / (SPEED_OF_LIGHT_MPS / f_0) * A * np.sin(2 * math.pi * f * t)
    acceleration = -A * (2 * math.pi * f) ** 2 * np.sin(2 * math.pi * f * t)
    y = gamma * acceleration
    clock = 2 * math.pi * f_0 * (np.cumsum(y) - y / 2) * T / t.size
    lines = np.abs(np.fft.fft(np.exp(1j * (motion + clock))))
    text = f"{{sinusoidal: [{{amplitude: 1 mm, frequency: {f} Hz}}]}}"
    echo = highest_echo(Analysis(mission(text, "acceleration_sensitivity: 5e-10 /g", T)).tones)
    assert echo is not None
    assert lines[round(f * T)] / lines[0] == pytest.approx(float(echo.level), rel=2e-3)
    own = [one.phase for one in Analysis(mission(text, "acceleration_sensitivity: 5e-10 /g", T)).tones]
    assert float(echo.level) == pytest.approx(float(level_of(math.hypot(*own))))
    assert min(own) > 0.3 * max(own)  # else the sum of both would say the same


def test_a_vibration_of_its_own_has_any_phase() -> None:
    text = "{sinusoidal: [{amplitude: 100 um, frequency: 50 Hz}]}"
    own = mission(text, f"acceleration_sensitivity: 1e-10 /g, vibration: {text}")
    echo = highest_echo(Analysis(own).tones)
    assert echo is not None
    assert echo.phase == pytest.approx(sum(one.phase for one in Analysis(own).tones))


# ---------------------------------------------------------------------- integrals
@pytest.mark.parametrize(
    ("text", "density", "ends"),
    [
        (QUALIFICATION, lambda f: 0.04 * G**2 / (2 * math.pi * f) ** 4, (20, 1000)),
        ("{spectrum: {0.02 Hz: 1e-9 mm^2/Hz, 50 Hz: 1e-9 mm^2/Hz}}", lambda f: 1e-15 + 0 * f, (0.02, 50)),
        (
            "{spectrum: {0.05 Hz: 1e-10 g^2/Hz, 10 Hz: 4e-6 g^2/Hz}, spectrum_level: 6 dB}",
            lambda f: 10**0.6 * 1e-10 * (f / 0.05) ** 2 * G**2 / (2 * math.pi * f) ** 4,
            (0.05, 10),
        ),
    ],
)
def test_parts_of_a_spectrum(text: str, density, ends: tuple[float, float]) -> None:
    """Closed forms and panels of the program against trapezoids, 0.5 %."""
    T = 2.0
    found = mission(text, T=T)
    published = of(found, "receiver.vibration.spectrum").published
    k = 2 * math.pi / found.radar.wavelength
    quadratic, cubic, left, constant, slope = dense(density, *map(float, ends), T)
    assert published.quadratic == pytest.approx(k * math.sqrt(quadratic), rel=5e-3)
    assert published.cubic == pytest.approx(k * math.sqrt(cubic), rel=5e-3)
    assert published.spread == pytest.approx(k * math.sqrt(left), rel=5e-3)
    (a, b), (c, d) = Analysis(found).published.plane.adjugate
    determinant = Analysis(found).published.plane.determinant
    moved = [
        math.sqrt(one**2 * constant + other**2 * slope * (2 / T) ** 2) / abs(determinant)
        for one, other in ((a, b), (c, d))
    ]
    assert (published.east, published.north) == pytest.approx(moved, rel=5e-3)


def test_a_step_of_a_spectrum() -> None:
    """40 dB within 1 % of a frequency, steeper than any power that a float holds: what it spreads, 0.5 %."""
    error = of(mission("{spectrum: {30 Hz: 1e-2 g^2/Hz, 30.3 Hz: 1e-6 g^2/Hz}}"), "receiver.vibration.spectrum")
    f = np.linspace(30, 30.3, 100_001)
    steep = 1e-2 * (f / 30) ** (-4 / math.log10(1.01)) * G**2 / (2 * math.pi * f) ** 4
    rms = 2 * math.pi / (SPEED_OF_LIGHT_MPS / 10e9) * math.sqrt(np.trapezoid(steep, f))
    assert error.full.spread == pytest.approx(rms, rel=5e-3)


def test_acceleration_and_displacement_are_one_spectrum() -> None:
    """(2πf)⁴ between the two: the same level by its acceleration and by its displacement."""
    scale = {f: 0.04 * G**2 / (2 * math.pi * f) ** 4 for f in (20, 1000)}
    text = f"{{spectrum: {{20 Hz: {scale[20]!r} m^2/Hz, 1 kHz: {scale[1000]!r} m^2/Hz}}}}"
    one, other = (of(mission(each), "receiver.vibration.spectrum").full for each in (QUALIFICATION, text))
    assert other[:5] == pytest.approx(one[:5], rel=1e-9)


# ---------------------------------------------------------------------- whole time series through exact ranges
DRAWS = 40_000  # know a sigma to 0.35 %
RATES = np.linspace(0.05, 4.0, 251)  # of tones, evenly apart


def series(density, T: float, rng: np.random.Generator) -> np.ndarray:
    """Noise of a spectrum as a sum of tones, at the nodes of exact ranges, up to the order that they tell apart.

    Of each tone by itself, and then of the draws: all of it is linear.
    """
    t = np.linspace(-T / 2, T / 2, 401)
    sizes = np.sqrt(density(RATES) * (RATES[1] - RATES[0]))
    waves = np.concatenate((np.cos(2 * math.pi * np.outer(RATES, t)), np.sin(2 * math.pi * np.outer(RATES, t))))
    fit = np.polynomial.legendre.legfit(2 * t / T, (np.tile(sizes, 2)[:, None] * waves).T, 3)
    of_tones = np.polynomial.legendre.legval(2 * aperture_nodes(T) / T, fit)  # (tones, nodes)
    return rng.standard_normal((DRAWS, 2 * RATES.size)) @ of_tones


def flown(found: Mission, metres: np.ndarray, *, is_path: bool) -> ImagePoints:
    """Range errors at the nodes, (draws, nodes) [m]: of the receiver along its line of sight, or of the clock."""
    T, paths = found.collection.aperture_time, found.geometry.both
    exact = ExactRanges.of(paths, found.radar, T, FINE_NODE_COUNT)
    draws, none = len(metres), np.zeros(len(metres), dtype=int)
    if not is_path:
        return followed(exact, metres.T, (NO_SHIFTS, NO_SHIFTS), none)
    places = np.array(paths[1].place(aperture_nodes(T)))
    shift = (places / np.linalg.norm(places, axis=0))[:, :, None] * metres.T
    return followed(exact, np.zeros((FINE_NODE_COUNT, draws)), (NO_SHIFTS, shift), none)


def density(f: np.ndarray) -> np.ndarray:
    """10 µg²/Hz at 0.05 Hz, rising as f². [(m/s²)²/Hz]"""
    return 1e-11 * (f / 0.05) ** 2 * G**2


SLOW = f"{{spectrum: {{0.042 Hz: {1e-11 * (0.042 / 0.05) ** 2!r} g^2/Hz, 4 Hz: {1e-11 * 80**2!r} g^2/Hz}}}}"


def test_vibration_against_time_series() -> None:
    """Quadratic and cubic phase and both displacements, the line of sight turning, within 1 %."""
    found = mission(SLOW)
    error = of(found, "receiver.vibration.spectrum")
    # Tones evenly apart stand for bins of which the first begins at 0.042 Hz.
    drawn = flown(
        found, series(lambda f: density(f) / (2 * math.pi * f) ** 4, 6.0, np.random.default_rng(1)), is_path=True
    )
    for sizes, computed in zip(
        (drawn.quadratic, drawn.cubic, drawn.east, drawn.north), (*error.full[:2], *error.full[3:5]), strict=True
    ):
        assert np.std(sizes) == pytest.approx(computed, rel=0.01)


def test_a_vibrating_oscillator_against_time_series() -> None:
    found = mission(SLOW, "acceleration_sensitivity: 2e-9 /g")
    error = of(found, "receiver.oscillator.acceleration")
    gamma = 2e-9 / G
    metres = series(
        lambda f: density(f) * (gamma * SPEED_OF_LIGHT_MPS / (2 * math.pi * f)) ** 2, 6.0, np.random.default_rng(2)
    )
    drawn = flown(found, metres, is_path=False)
    for sizes, computed in zip(
        (drawn.quadratic, drawn.cubic, drawn.east, drawn.north), (*error.full[:2], *error.full[3:5]), strict=True
    ):
        assert np.std(sizes) == pytest.approx(computed * error.declared, rel=0.01)


# ---------------------------------------------------------------------- turns
TURN = "acceleration: [2.4 m/s^2, -3.2 m/s^2, 0]\n    jerk: [0.6 m/s^3, 0.2 m/s^3, -0.1 m/s^3]"


def test_a_turn_is_a_frequency_that_changes() -> None:
    """Γ·a(τ) added up along 2000 directions of Γ: none does more than the row says, and the worst does as much."""
    found = mission(oscillator="acceleration_sensitivity: 1e-9 /g", T=4.0, path=TURN)
    error = of(found, "receiver.oscillator.acceleration")
    rng, gamma = np.random.default_rng(3), 1e-9 / G
    directions = rng.standard_normal((2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    fine = np.linspace(-2, 2, 4001)
    acceleration = np.array([[2.4], [-3.2], [0.0]]) + np.array([[0.6], [0.2], [-0.1]]) * fine
    y = gamma * directions @ acceleration
    delay = np.cumsum((y[:, 1:] + y[:, :-1]) / 2 * (fine[1] - fine[0]), axis=1)
    delay = np.concatenate((np.zeros((2000, 1)), delay), axis=1)
    delay -= delay[:, 2000:2001]
    metres = SPEED_OF_LIGHT_MPS * np.array([np.interp(aperture_nodes(4.0), fine, one) for one in delay])
    drawn = flown(found, metres, is_path=False)
    assert np.abs(drawn.quadratic).max() == pytest.approx(error.full.quadratic * error.declared, rel=5e-3)
    assert np.all(np.abs(drawn.quadratic) <= error.full.quadratic * error.declared * 1.005)
    assert np.hypot(drawn.east, drawn.north).max() <= error.full.displacement * error.declared * 1.005


def test_a_tenth_of_g_is_a_frequency_of_1e_10() -> None:
    """A steady turn of 0.1 g with 1e-9/g moves the image as a clock does that runs 1e-10 fast."""
    steady = mission(oscillator="acceleration_sensitivity: 1e-9 /g", path=f"acceleration: [{0.1 * G} m/s^2, 0, 0]")
    fast = mission(path=f"acceleration: [{0.1 * G} m/s^2, 0, 0]", more="timing_error: {linear: 1e-10}")
    error = of(steady, "receiver.oscillator.acceleration")
    analysis = Analysis(fast)
    source = next(one for one in analysis.sources if one.id == "timing.linear")
    moved = Case(analysis).does(analysis.full, source).displacement
    assert error.full.displacement * error.declared == pytest.approx(math.hypot(*moved), rel=1e-3)


def test_what_falls_freely_feels_nothing() -> None:
    text = """
schema_version: 1
name: Orbit
radar: {center_frequency: 10 GHz, bandwidth: 150 MHz}
collection: {aperture_time: 2 s}
platforms:
  transmitter:
    position: [0, -500 km, 500 km]
    velocity: [7600 m/s, 0, 0]
    acceleration: [0, 0.6 m/s^2, -8.4 m/s^2]
    oscillator: {frequency: 10 MHz, power_law: {h0: 1e-30}, acceleration_sensitivity: 1e-9 /g}
  receiver: {position: [2 km, 0, 300 m], velocity: [0, 0, 0]}
"""
    assert of(parse_mission(text), "transmitter.oscillator.acceleration").full[:5] == (0, 0, 0, 0, 0)


def test_exchanged_pulses_take_a_turn_out() -> None:
    """Straight lines over 0.2 s leave of a bend q·τ²/2 no more than arcs of q·T_s²/8, without a quadratic phase."""
    with_sync = "synchronization: {interval: 0.2 s, error: 1 deg}"
    free = of(mission(oscillator="acceleration_sensitivity: 1e-9 /g", path=TURN), "receiver.oscillator.acceleration")
    held = of(
        mission(oscillator="acceleration_sensitivity: 1e-9 /g", path=TURN, more=with_sync),
        "receiver.oscillator.acceleration",
    )
    assert held.full.quadratic < 0.01 * free.full.quadratic
    assert held.full.displacement < 0.01 * free.full.displacement


def test_exchanged_pulses_take_a_steady_turn_out_whole() -> None:
    """A constant frequency is a straight line between exchanges: rounding allowed a sensitivity of 460 s²/m."""
    found = mission(
        oscillator="acceleration_sensitivity: 1e-9 /g",
        path="acceleration: [-16.0524 m/s^2, 11.9072 m/s^2, 0.916658 m/s^2]",
        more="synchronization: {interval: 0.24 s, error: 1 deg}",
    )
    one = row(check_mission(found, TODAY), "receiver.oscillator.acceleration")
    assert (one.allowable, one.qpe_full_rad, one.displacement_m) == (None, 0.0, (0.0, 0.0))


def test_of_a_direct_path_what_a_receiver_changes_by_until_the_echo_comes_is_left() -> None:
    """S·4 sin²(πfΔt) of the vibration, summed densely; a turn leaves next to nothing, the transmitter nothing."""
    text = "{spectrum: {20 Hz: 0.04 g^2/Hz, 1 kHz: 0.04 g^2/Hz}, sinusoidal: [{amplitude: 1 g, frequency: 50 Hz}]}"
    link = "synchronization: {method: direct_path, error: 1 deg}"
    heard = mission(text, "acceleration_sensitivity: 1e-9 /g", path=TURN, more=link)
    error, delay = of(heard, "receiver.oscillator.acceleration"), heard.geometry.echo_delay
    f = np.linspace(20.0, 1e3, 400_001)
    turned = 2 * np.sin(math.pi * f * delay)
    power = np.trapezoid((10e9 * 1e-9 / f * turned) ** 2 * 0.04, f)
    assert (error.full.spread * error.declared) ** 2 == pytest.approx(power, rel=5e-3)
    tones = {one.subject.id: one.phase for one in Analysis(heard).tones}
    assert tones.keys() == {"receiver.vibration.sinusoidal.0", "receiver.oscillator.acceleration.0"}
    expected = 10e9 * 1e-9 / 50 * 2 * math.sin(math.pi * 50 * delay)
    assert tones["receiver.oscillator.acceleration.0"] == pytest.approx(expected, rel=1e-9)


def test_below_a_cycle_per_aperture_a_tone_is_a_phase() -> None:
    """0.1 Hz over 6 s: the least-squares quadratic of the phase f₀Γa/f·cos is 7.5·j₂ of it."""
    text = "{sinusoidal: [{amplitude: 0.01 g, frequency: 0.1 Hz}]}"
    found = mission(text, "acceleration_sensitivity: 1e-9 /g")
    error = of(found, "receiver.oscillator.acceleration")
    phase = 10e9 * 1e-9 * 0.01 / 0.1
    x = np.linspace(-1, 1, 20001)
    fit = np.polynomial.legendre.legfit(x, phase * np.cos(math.pi * 0.6 * x), 2)
    assert error.published.quadratic * error.declared == pytest.approx(1.5 * abs(fit[2]), rel=1e-3)
    assert not [one for one in Analysis(found).tones if one.subject.kind == "oscillator"]


# ---------------------------------------------------------------------- arrays
@pytest.mark.parametrize(
    ("key", "numbers"),
    [
        ("platforms.receiver.motion_error.vibration.spectrum_level", [-6.0, 0.0, 3.0]),
        ("platforms.receiver.motion_error.vibration.spectrum.20 Hz", [1.0, 4.0, 9.0]),
        ("platforms.receiver.oscillator.acceleration_sensitivity", [1e-12, 1e-11, 3e-10]),
        ("platforms.receiver.oscillator.level", [-3.0, 0.0, 6.0]),
        ("collection.aperture_time", [1.0, 6.0, 9.0]),
        ("radar.center_frequency", [1e9, 5e9, 1e10]),
    ],
)
def test_many_cases_are_each_case(key: str, numbers: list[float]) -> None:
    text = "{spectrum: {20 Hz: 0.04 g^2/Hz, 1 kHz: 0.01 g^2/Hz}, spectrum_level: 0 dB}"
    base = mission(text, "acceleration_sensitivity: 1e-9 /g", path=TURN)
    many = with_number(base, key, np.array(numbers))
    together = random_errors(many, many.geometry, len(numbers))
    for case, number in enumerate(numbers):
        alone = random_errors(with_number(base, key, number))
        for one, other in zip(together, alone, strict=True):
            assert one.full.of(case)[:5] == pytest.approx(other.full[:5], rel=1e-9, nan_ok=True)
            assert np.broadcast_to(one.declared, (len(numbers),))[case] == pytest.approx(other.declared)


def test_a_tone_in_g_keeps_its_g() -> None:
    """Its amplitude in metres follows the frequency, also where that is an array."""
    base = mission("{sinusoidal: [{amplitude: [1 g, 0, 0], frequency: 50 Hz}]}")
    many = with_number(
        base, "platforms.receiver.motion_error.vibration.sinusoidal.0.frequency", np.array([25.0, 50.0])
    )
    (line,) = many.platforms.receiver.motion_error.vibration.sinusoidal
    east, *_ = line.displacement
    assert east == pytest.approx(G / (2 * math.pi * np.array([25.0, 50.0])) ** 2)


def test_level_of_an_oscillator_shifts_its_noise() -> None:
    mask = "frequency: 10 MHz, phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz, 1 kHz: -150 dBc/Hz}"
    plain, louder = (of(_with(mask + level), "receiver.oscillator") for level in ("", ", level: 6 dB"))
    for one, other in zip(plain.full[:3], louder.full[:3], strict=True):
        assert 20 * math.log10(other / one) == pytest.approx(6)


def _with(oscillator: str) -> Mission:
    return parse_mission(f"""
schema_version: 1
name: Level
radar: {{center_frequency: 10 GHz, bandwidth: 150 MHz}}
collection: {{aperture_time: 2 s}}
platforms:
  transmitter: {{position: [30 km, 4 km, 9 km], velocity: [0 m/s, 180 m/s, 0 m/s]}}
  receiver: {{position: [820 m, 1419 m, 1147 m], velocity: [-33.8 m/s, 9 m/s, 0], oscillator: {{{oscillator}}}}}
""")
