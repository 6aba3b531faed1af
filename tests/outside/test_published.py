"""Figures in print against results of this program: `published.csv` has each figure with its source.

Tolerances are half of the last printed digit, unless the note in the file states another. For a source that prints a
formula and no number, the value is worked out by hand, without the package; the note states that too.
"""

import csv
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml

import bisar_budget as bb
from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.effects.oscillator_acceleration import accelerated_tones, pieces_by_acceleration
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.spectra import PowerLawPiece
from bisar_budget.effects.vibration import displacement_rms
from bisar_budget.units import ANGLE_RANDOM_WALK, VELOCITY_RANDOM_WALK, parse_quantity
from tests.conftest import ROOT
from tests.outside.record import compare

with Path(__file__).with_name("published.csv").open(encoding="utf-8") as _file:
    PRINTED = {row["id"]: row for row in csv.DictReader(_file)}

SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
INCH = 25.4e-3  # m
INCIDENCE = math.radians(42)


# ---------------------------------------------------------------------- missions
def together(place: str, velocity: str, errors: str = "", *, f0: str = "10 GHz", B: str = "300 MHz", T: str = "4 s",
             more: str = "") -> bb.Mission:  # fmt: skip
    """Two platforms that fly as one; `errors` are those of the transmitter."""
    path = f"position: [{place}], velocity: [{velocity}]"
    return bb.loads(f"""
schema_version: 1
name: both legs are one
radar: {{center_frequency: {f0}, bandwidth: {B}}}
collection: {{aperture_time: {T}}}
platforms:
  transmitter: {{{path}{errors}}}
  receiver: {{{path}}}
{more}""")


@cache
def section_v() -> Any:
    return bb.check(bb.load(SECTION_V))


def section_v_with(path: str, value: Any, **requirements: str) -> bb.Mission:
    """The same with a section in place of its own, and requirements more."""
    tree = yaml.safe_load(SECTION_V.read_text(encoding="utf-8"))
    *parents, last = path.split(".")
    node = tree
    for key in parents:
        node = node[key]
    node[last] = value
    tree["requirements"] |= requirements
    return bb.loads(yaml.safe_dump(tree, sort_keys=False))


def tone_of(amplitude: str) -> dict[str, Any]:
    return {"vibration": {"sinusoidal": [{"amplitude": amplitude, "frequency": "50 Hz"}]}}


@cache
def one_leg() -> Any:
    """By the rules of monostatic systems: broadside, level with the scene."""
    errors = ", motion_error: {imu: {accelerometer_bias: 100 ug, gyro_bias: 1 deg/h}}"
    rules = "allocation: {model: published, combine: each}\nrequirements: {quadratic_phase_error: 45 deg}"
    return bb.check(together("40 km, 0 m, 0 m", "0 m/s, 100 m/s, 0 m/s", errors, more=rules))


@cache
def nisar(electrons: float = 1.0) -> Any:
    """A satellite 750 km away at 42 degrees of incidence."""
    place = f"{750e3 * math.sin(INCIDENCE)} m, 0 m, {750e3 * math.cos(INCIDENCE)} m"
    more = (
        "common_motion_error: {position: [0 m, 0 m, 4 m]}\n"
        f"propagation: {{zenith_delay: 3 cm, zenith_electron_content: {electrons} TECU}}"
    )
    flies = "0 m/s, 7.5 km/s, 0 m/s"
    return bb.check(together(place, flies, f0="1.257 GHz", B="24 MHz", T="0.5 s", more=more))


def range_error(found: Any, kind: str) -> float:
    """Range error of one leg by what it moves the image: over the ground, ranges change by the sum of both legs'."""
    return 2 * math.sin(INCIDENCE) * math.hypot(*found[f"propagation.transmitter.{kind}"].displacement_m)


@cache
def oscillators(coefficients: str) -> Any:
    """Two free clocks, each with a power law that coefficients in dB of f⁻⁴ … f⁰ at 10 or 100 MHz make."""
    frequency, *levels = coefficients.split()
    law = ", ".join(
        f"h{2 - n}: {10 ** (float(level) / 10) / float(frequency) ** 2}"
        for n, level in zip((4, 3, 2, 1, 0), levels, strict=True)
        if level != "-"
    )
    clock = f"oscillator: {{frequency: {float(frequency) / 1e6} MHz, power_law: {{{law}}}}}"
    return bb.check(
        bb.loads(f"""
schema_version: 1
name: two clocks
radar: {{center_frequency: 9.65 GHz, bandwidth: 150 MHz}}
collection: {{aperture_time: 5 s}}
platforms:
  transmitter: {{position: [30 km, 4 km, 9 km], velocity: [0 m/s, 180 m/s, 0 m/s], {clock}}}
  receiver: {{position: [2 km, 3 km, 1 km], velocity: [-20 m/s, 20 m/s, 0 m/s], {clock}}}
requirements: {{quadratic_phase_error: 45 deg, cubic_phase_error: 45 deg, islr: -20 dB}}
allocation: {{combine: rss}}
simulation: {{window: taylor}}
""")
    )


CLOCKS = {
    "10mhz": "1e7 -95 -90 -200 -130 -155",
    "wenzel": "1e8 - -73 - -104 -181",
    "gps3500": "1e7 -120 -114 - -134 -166",
}


def spread_above(pieces: tuple[PowerLawPiece, ...], low: float, high: float) -> float:
    """Power of a phase between two frequencies. [rad²]"""
    inside = ((max(piece.low, low), min(piece.high, high), piece) for piece in pieces)
    return math.fsum(piece.integral(a, b) for a, b, piece in inside if a < b)


def all_above_a_cycle(name: str) -> float:
    """ISLR of two clocks by the convention of the letter: all power from 1/T to 1 kHz. [dB]"""
    mission = oscillators(CLOCKS[name]).findings.mission
    pieces = noise_of(mission.platforms.receiver.oscillator, 9.65e9, 5.0).pieces
    return 10 * math.log10(2 * spread_above(pieces, 1 / 5, 1e3))


def judged_islr(name: str) -> float:
    """ISLR of two clocks as a report has it. [dB]"""
    return oscillators(CLOCKS[name])["mission.islr"].islr_db


def stands(oscillator: str) -> bb.Mission:
    """A receiver with an oscillator, which stands beside a transmitter that flies."""
    return bb.loads(f"""
schema_version: 1
name: an oscillator
radar: {{center_frequency: 10 GHz, bandwidth: 300 MHz}}
collection: {{aperture_time: 4 s}}
platforms:
  transmitter: {{position: [30 km, 0 m, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s]}}
  receiver: {{position: [1 km, 1 km, 500 m], velocity: [0 m/s, 0 m/s, 0 m/s], oscillator: {{{oscillator}}}}}
""")


def shaken(acceleration: str, frequency: str) -> float:
    """Peak phase at 10 GHz of an oscillator of 1e-9/g that a tone shakes. [rad]"""
    tones = f"sinusoidal: [{{amplitude: {acceleration}, frequency: {frequency}}}]"
    clock = f"sensor: gps-3500, acceleration_sensitivity: 1e-9 /g, vibration: {{{tones}}}"
    (tone,) = accelerated_tones(stands(clock))
    return float(tone.phase)


def tx508(frequency: float) -> float:
    """Single-sideband noise at 10 MHz of 0.4e-9/g under 0.06 g²/Hz from 20 Hz to 2 kHz. [dBc/Hz]"""
    spectrum = "spectrum: {20 Hz: 0.06 g^2/Hz, 2 kHz: 0.06 g^2/Hz}"
    clock = f"sensor: gps-3500, acceleration_sensitivity: 0.4e-9 /g, vibration: {{{spectrum}}}"
    mission = stands(clock)
    (piece,) = pieces_by_acceleration(mission, "receiver")
    sensitivity = mission.platforms.receiver.oscillator.acceleration_sensitivity
    return 10 * math.log10(piece.at(frequency) * sensitivity**2 / 2 * (10e6 / 10e9) ** 2)


def mask(points: dict[float, float], carrier: float, low: float) -> float:
    """Root mean square phase of a mask of a data sheet, from `low` on. [rad]"""
    listed = ", ".join(f"{f:.0f} Hz: {level} dBc/Hz" for f, level in points.items())
    clock = stands(f"frequency: {carrier / 1e6} MHz, phase_noise: {{{listed}}}").platforms.receiver.oscillator
    return math.sqrt(spread_above(noise_of(clock, carrier, 1.0).pieces, low, max(points)))


@cache
def buck(carrier: float) -> float:
    """Root mean square jitter of the masks that several programs have integrated. [ps]"""
    points = {
        70e6: {1: -39, 10: -73, 1e3: -122, 1e4: -131, 1e6: -149},
        2.25e9: {1e2: -82, 1e3: -80, 1e4: -77, 1e5: -112, 1e6: -134, 1e7: -146, 4.6e9: -146},
    }[carrier]
    return 1e12 * mask(points, carrier, min(points)) / (2 * math.pi * carrier)


def noise_of_allan_deviation(slope: float, at_a_second: float) -> float:
    """Single-sideband noise 1 Hz from 10 MHz of an Allan deviation that goes as τ^slope. [dBc/Hz]"""
    points = ", ".join(f"{tau} s: {at_a_second * tau**slope:.9e}" for tau in (1, 10, 100))
    clock = stands(f"frequency: 10 MHz, allan_deviation: {{{points}}}").platforms.receiver.oscillator
    (piece,) = noise_of(clock, 10e6, 4.0).pieces
    return 10 * math.log10(piece.at(1.0) / 2)


@cache
def matterhorn() -> Any:
    return bb.check(bb.loads("""
schema_version: 1
name: the Matterhorn from Zermatt
radar: {center_frequency: 10 GHz, bandwidth: 300 MHz}
scene: {latitude: 46.017 deg, longitude: 7.750 deg, height: 1673 m}
collection: {aperture_time: 1 s}
platforms:
  transmitter: {position: [10 km, 0 m, 10 km], velocity: [0 m/s, 100 m/s, 0 m/s]}
  receiver: {latitude: 45.977 deg, longitude: 7.658 deg, altitude: 4531 m, speed: 0 m/s}
""")).findings.geometry.receiver  # fmt: skip


@cache
def at_1_g() -> float:
    """Amplitude of a tone of 1 g at 50 Hz: its allowable in m/s² is as many times 1 g as that in metres it. [m]"""
    allowable = [
        bb.check(section_v_with("platforms.receiver.motion_error", tone_of(one), pslr="-30 dB"))[
            "receiver.vibration.sinusoidal.0"
        ].allowable
        for one in ("1 g", "1 mm")
    ]
    return STANDARD_GRAVITY_MPS2 * allowable[1] / allowable[0]


def shaken_at_random() -> float:
    """Displacement of 0.04 g²/Hz from 20 Hz on; 1e5 Hz are as good as no end, to 1e-11. [mm]"""
    vibration = {"spectrum": {"20 Hz": "0.04 g^2/Hz", "100 kHz": "0.04 g^2/Hz"}}
    mission = section_v_with("platforms.receiver.motion_error", {"vibration": vibration})
    return 1e3 * displacement_rms(mission.platforms.receiver.motion_error.vibration.spectrum)


# ---------------------------------------------------------------------- figures
def vibration_allowable() -> float:
    """Of the transmitter of Section V, by the published rule. [µm]"""
    mission = section_v_with("platforms.transmitter.motion_error", tone_of("1 um"), pslr="-30 dB")
    return 1e6 * bb.check(mission)["transmitter.vibration.sinusoidal.0"].allowable_published


def azimuth_resolution(aperture: float) -> float:
    """Of 10 km, 3 cm, an aperture of so many metres, widened by 1.3. [m]"""
    f0, T = f"{299792458 / 0.03:.3f} Hz", f"{aperture / 100} s"
    found = bb.check(together("10 km, 0 m, 0 m", "0 m/s, 100 m/s, 0 m/s", f0=f0, T=T))
    return 1.3 * found.findings.resolution.cross_range


def turn_for(resolution: float) -> float:
    """Turn of the line of sight within the aperture for a resolution, widened by 1.3, at 10 GHz. [deg]"""
    mission = together("10 km, 0 m, 0 m", "0 m/s, 100 m/s, 0 m/s", T="1 s")
    once = 1.3 * bb.check(mission).findings.resolution.cross_range  # of 100 m; goes as 1/T
    return math.degrees(2 * math.atan(100 * once / resolution / 2 / 10e3))


def ground_resolution() -> float:
    """Of 2 m in slant range at 30 degrees of grazing. [m]"""
    place = f"{20e3 * math.cos(math.pi / 6)} m, 0 m, 10 km"
    mission = together(place, "0 m/s, 100 m/s, 0 m/s", B=f"{299792458 / 4:.3f} Hz")
    return bb.check(mission).findings.resolution.range


FIGURES: dict[str, Callable[[], float]] = {
    "rm-acceleration-x": lambda: section_v()["transmitter.acceleration.x"].allowable_published,
    "rm-qpe": lambda: section_v()["transmitter.acceleration.x"].qpe_published_rad,
    "rm-velocity-y-tx": lambda: 1e3 * section_v()["transmitter.velocity.y"].allowable_published,
    "rm-velocity-y-rx": lambda: 1e3 * section_v()["receiver.velocity.y"].allowable_published,
    "rm-smear": lambda: math.degrees(section_v().findings.geometry.look_azimuth),
    "rm-vibration": vibration_allowable,
    "rm-clock": lambda: section_v()["timing.quadratic"].allowable_published,
    "cgm-bias": lambda: one_leg()["transmitter.imu.accelerometer_bias"].qpe_published_rad,
    "kennedy-gyro": lambda: 1e3 * one_leg()["transmitter.imu.gyro_bias"].cubic_rad,
    "cgm-velocity": lambda: 1e3 * one_leg()["transmitter.velocity.y"].allowable_published,
    "nisar-dem": lambda: math.hypot(*nisar()["common.position.z"].displacement_m),
    "nisar-tropo": lambda: range_error(nisar(), "zenith_delay"),
    "nisar-range": lambda: math.sin(INCIDENCE) * nisar().findings.resolution.range,
    "nisar-iono-mean": lambda: range_error(nisar(0.72), "zenith_electron_content"),
    "nisar-iono-top": lambda: range_error(nisar(6.6), "zenith_electron_content"),
    **{
        f"ky-{name}-qpe": lambda levels=levels: oscillators(levels)["mission.quadratic_phase_error"].qpe_full_rad
        for name, levels in CLOCKS.items()
    },
    **{f"ky-{name}-islr": lambda name=name: all_above_a_cycle(name) for name in CLOCKS},
    **{f"ky-{name}-islr-here": lambda name=name: judged_islr(name) for name in CLOCKS},
    "vig-tone": lambda: shaken("1 g", "10 Hz"),
    "rftools-tone": lambda: 20 * math.log10(shaken(f"{math.sqrt(2)} g", "100 Hz") / 2),
    **{f"tx508-{frequency}": lambda f=frequency: tx508(f) for frequency in (20, 100, 1000, 2000)},
    "mw-azres": lambda: azimuth_resolution(195.0),
    "mw-angle": lambda: turn_for(1.0),
    "mw-ground": ground_resolution,
    "matterhorn-azimuth": lambda: (90 - math.degrees(math.atan2(*matterhorn().position[1::-1]))) % 360,
    "matterhorn-elevation": lambda: math.degrees(matterhorn().elevation),
    "matterhorn-range": lambda: matterhorn().slant_range,
    "mw-jitter": lambda: mask({100: -125, 1e3: -150, 1e4: -174, 200e6: -174}, 100e6, 100.0),
    "buck-70mhz": lambda: buck(70e6),
    "fordahl-70mhz": lambda: buck(70e6),
    "buck-2ghz": lambda: buck(2.25e9),
    "adi-2ghz": lambda: buck(2.25e9),
    "hp-white": lambda: noise_of_allan_deviation(-0.5, 1e-11),
    "hp-flicker": lambda: noise_of_allan_deviation(0.0, 1e-11),
    "kshana-walk": lambda: noise_of_allan_deviation(0.5, 1e-12),
    "libsurvive-vrw": lambda: parse_quantity("0.06218 m/s/sqrt(h)", VELOCITY_RANDOM_WALK),
    "libsurvive-arw": lambda: math.degrees(parse_quantity("0.47574 deg/sqrt(h)", ANGLE_RANDOM_WALK)),
    "newport-sine": lambda: 1e6 * at_1_g(),
    "vw-sine": lambda: 1e6 * at_1_g(),
    "vw-random": shaken_at_random,
}  # fmt: skip


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_in_print(name: str) -> None:
    one = PRINTED[name]
    compare(
        f"{one['what']} ({one['place']})",
        float(one["value"]),
        FIGURES[name](),
        one["unit"],
        float(one["tolerance"]),
        one["source"],
        one["version"],
        one["reason"],
    )


@pytest.mark.parametrize(("electrons", "printed"), [(0.72, 0.223), (6.6, 1.739)])
def test_why_the_ionosphere_of_nisar_is_another(electrons: float, printed: float) -> None:
    """Their function bends the ray by 1 + 40.31·TEC/f², of the whole column: that gives what they print."""
    delay = 40.31 * electrons * 1e16 / 1.257e9**2
    bent = math.asin(math.sin(INCIDENCE) / (1 + delay))
    assert delay / math.cos(bent) == pytest.approx(printed, abs=5e-4)


def test_the_table_is_whole() -> None:
    """Every row is computed, and says where it is from."""
    assert PRINTED.keys() == FIGURES.keys()
    assert len(PRINTED) >= 30
    assert len({row["source"] for row in PRINTED.values()}) >= 10
    for row in PRINTED.values():
        assert row["source"], row
        assert row["place"], row
        assert row["note"], row
        assert float(row["tolerance"]) > 0
