"""Rows of vibration spectra and of oscillators under acceleration, held to requirements from both sides."""

import math

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY

G = STANDARD_GRAVITY_MPS2
QUALIFICATION = "spectrum: {20 Hz: 0.04 g^2/Hz, 1 kHz: 0.04 g^2/Hz}"


def checked(
    vibration: str = "", oscillator: str | None = None, requirements: str = "", allocation: str = "", path: str = ""
) -> MissionFindings:
    clock = ""
    if oscillator is not None:
        clock = f"    oscillator: {{frequency: 10 MHz, power_law: {{h0: 1e-30}}, {oscillator}}}"
    return check_mission(
        parse_mission(f"""
schema_version: 1
name: Vibration
radar: {{center_frequency: 10 GHz, bandwidth: 150 MHz}}
collection: {{aperture_time: 2 s}}
platforms:
  transmitter: {{position: [30 km, 4 km, 9 km], velocity: [0 m/s, 180 m/s, 0 m/s]}}
  receiver:
    position: [820 m, 1419 m, 1147 m]
    velocity: [-33.8 m/s, 9 m/s, 0]
    {path}
    motion_error: {{velocity: 1 mm/s, vibration: {{{vibration}}}}}
{clock}
requirements: {{quadratic_phase_error: 45 deg, {requirements}}}
allocation: {{{allocation}}}
"""),
        TODAY,
    )


def row(found: MissionFindings, row_id: str) -> Row:
    return next(one for one in found.rows if one.id == row_id)


def test_the_allowable_of_a_spectrum_is_a_level_by_which_it_may_rise() -> None:
    """Half of the power of -20 dB is the platform's: an image shows it where the level is shifted by as much."""
    first = row(checked(QUALIFICATION, requirements="islr: -20 dB"), "receiver.vibration.spectrum")
    assert (first.unit, first.declared, first.binding_requirement) == ("dB", 0.0, "islr")
    for shift, is_met in ((-0.01, True), (0.01, False)):
        text = f"{QUALIFICATION}, spectrum_level: {first.allowable + shift} dB"
        found = checked(text, requirements="islr: -20 dB")
        assert (row(found, "receiver.islr").status != "fail") is is_met


def test_spectrum_and_wideband_add_their_powers() -> None:
    both = checked(f"{QUALIFICATION}, wideband: {{rms: 200 um}}", requirements="islr: -20 dB")
    k = 2 * math.pi / (299792458.0 / 10e9)
    variance = 0.0672**2 + (k * 200e-6) ** 2
    level = 10 * math.log10(math.expm1(variance) / 0.902823)  # of the first nulls
    assert row(both, "mission.islr").declared == pytest.approx(level, abs=0.02)


def test_the_sensitivity_that_is_allowed() -> None:
    """0.04 g²/Hz on 1e-9/g is 0.196 rad²; what half of -20 dB allows is Γ·√(ln(1 + E·0.01)/2/0.196)."""
    found = checked(QUALIFICATION, "acceleration_sensitivity: 1e-9 /g", "islr: -20 dB")
    one = row(found, "receiver.oscillator.acceleration")
    assert (one.unit, one.binding_requirement) == ("s^2/m", "islr")
    assert one.declared * G == pytest.approx(1e-9)
    assert one.allowable * G == pytest.approx(1e-9 * math.sqrt(math.log1p(0.902823 * 0.01) / 2 / 0.196), rel=2e-3)
    for part, status in ((0.999, "pass"), (1.001, "fail")):
        text = f"acceleration_sensitivity: {part * one.allowable * G} /g, vibration: {{{QUALIFICATION}}}"
        again = checked("", text, "islr: -20 dB", "combine: each")
        assert row(again, "receiver.oscillator.acceleration").status in (
            (status,) if status == "fail" else ("pass", "warn")
        )


@pytest.mark.parametrize("requirements", ["pslr: -30 dB", "islr: -30 dB"])
def test_a_tone_of_an_oscillator_is_held_as_a_vibration_is(requirements: str) -> None:
    """The phase of a vibration at its limit, 2πA/λ, is that of a tone: f₀Γa/f."""
    found = checked(
        "sinusoidal: [{amplitude: 0.1 g, frequency: 50 Hz}]", "acceleration_sensitivity: 1e-10 /g", requirements
    )
    motion, tone = row(found, "receiver.vibration.sinusoidal.0"), row(found, "receiver.oscillator.acceleration.0")
    metres = motion.allowable / (2 * math.pi * 50) ** 2
    assert tone.allowable == pytest.approx(2 * math.pi * metres / (299792458.0 / 10e9) / (10e9 * 0.1 * G / 50))
    assert tone.metric == requirements[:4]


def test_a_line_in_g_is_judged_in_g() -> None:
    metres = 0.5 * G / (2 * math.pi * 80) ** 2
    in_g = checked("sinusoidal: [{amplitude: 0.5 g, frequency: 80 Hz}]", requirements="pslr: -30 dB")
    in_m = checked(f"sinusoidal: [{{amplitude: {metres!r} m, frequency: 80 Hz}}]", requirements="pslr: -30 dB")
    one, other = (row(found, "receiver.vibration.sinusoidal.0") for found in (in_g, in_m))
    assert (one.unit, other.unit) == ("m/s^2", "m")
    assert one.declared == pytest.approx(0.5 * G)
    assert one.utilization == pytest.approx(other.utilization)
    assert one.allowable / one.declared == pytest.approx(other.allowable / other.declared)
    levels = [next(each for each in found.requirements if each.key == "pslr") for found in (in_g, in_m)]
    assert (levels[0].allowed, levels[0].reached) == pytest.approx((levels[1].allowed, levels[1].reached))


def test_powers_of_motion_and_oscillator_add() -> None:
    """-39.6 dB and -19.95 dB are -19.9 dB together; in phase they would be -19.05 dB."""
    text = "sinusoidal: [{amplitude: 100 um, frequency: 50 Hz}]"
    found = checked(text, "acceleration_sensitivity: 1e-9 /g", "pslr: -15 dB")
    assert row(found, "mission.pslr").declared == pytest.approx(-19.9, abs=0.06)


def codes(one: Row) -> set[str]:
    return {note.code for note in one.notes}


SENSITIVE = "acceleration_sensitivity: 2e-9 /g"


def required(found: MissionFindings, key: str) -> JudgedRequirement:
    return next(one for one in found.requirements if one.key == key)


@pytest.mark.parametrize("combine", ["rss", "each"])
@pytest.mark.parametrize(
    "beside",
    ["", ", sinusoidal: [{amplitude: 1 um, frequency: 50 Hz}]", f", {QUALIFICATION}, spectrum_level: -20 dB"],
)
def test_what_wideband_does_to_an_oscillator_is_not_evaluated(beside: str, combine: str) -> None:
    """f₀·Γ·4π²·f·σ/g of 150 um is 0.012 rad at 1 Hz and 0.72 rad at 60 Hz, on both sides of -20 dB; it passed."""
    needs = "cubic_phase_error: 90 deg, pslr: -1 dB, islr: -1 dB"
    found = checked(f"wideband: {{rms: 150 um}}{beside}", SENSITIVE, needs, f"combine: {combine}")
    one, islr = row(found, "receiver.oscillator.acceleration"), required(found, "islr")
    assert (one.status, one.allowable, one.utilization) == ("not_evaluated", None, None)
    assert found.status == islr.status == "not_evaluated"
    assert required(found, "quadratic_phase_error").status == "pass"
    assert one.reason is not None
    assert one.reason.code == "wideband-has-no-spectrum"
    assert islr.reason == one.reason
    assert "oscillator-does-not-vibrate" not in codes(one)
    assert not any("act on it" in warning.message for warning in found.warnings)


def test_beside_an_aggregate_a_row_that_cannot_be_judged_decides_no_quadratic_phase() -> None:
    """The reason for ISLR was given for the quadratic phase, and stood in the way of waivers."""
    turn = "acceleration: [-1 m/s^2, 0.5 m/s^2, 0 m/s^2]"
    sensitive = "acceleration_sensitivity: 1e-4 /g"
    found = checked("wideband: {rms: 10 um}", sensitive, "islr: -1 dB", "combine: rss", turn)
    assert row(found, "receiver.oscillator.acceleration").status == "not_evaluated"
    quadratic = required(found, "quadratic_phase_error")
    assert (quadratic.row, quadratic.status) == ("receiver.quadratic_phase_error", "fail")


@pytest.mark.parametrize(
    ("vibration", "oscillator"),
    [
        ("wideband: {rms: 0}", SENSITIVE),
        ("wideband: {rms: 150 um}", "acceleration_sensitivity: 0"),
        ("wideband: {rms: 150 um}", "level: 0 dB"),
        (
            "wideband: {rms: 150 um}",
            f"{SENSITIVE}, vibration: {{spectrum: {{20 Hz: 1e-9 g^2/Hz, 1 kHz: 1e-9 g^2/Hz}}}}",
        ),
    ],
)
def test_it_is_evaluated_where_wideband_does_nothing_to_the_oscillator(vibration: str, oscillator: str) -> None:
    found = checked(vibration, oscillator, "cubic_phase_error: 90 deg, islr: -10 dB")
    assert required(found, "islr").status == found.status == "pass"


def test_one_frequency_says_what_wideband_leaves_open() -> None:
    """As a narrow spectrum the same rms passes at 1 Hz and fails at 60 Hz."""
    for frequency, is_met in ((1.0, True), (60.0, False)):
        spectrum = ", ".join(
            f"{frequency * edge} Hz: {150e-6**2 / (0.02 * frequency)} m^2/Hz" for edge in (0.99, 1.01)
        )
        found = checked(f"spectrum: {{{spectrum}}}", SENSITIVE, "cubic_phase_error: 90 deg, islr: -16 dB")
        assert (required(found, "islr").status == "pass") is is_met


def test_whose_vibration_counts_is_said() -> None:
    of_the_platform = checked(QUALIFICATION, "acceleration_sensitivity: 1e-9 /g", "islr: -20 dB")
    its_own = checked("", f"acceleration_sensitivity: 1e-9 /g, vibration: {{{QUALIFICATION}}}", "islr: -20 dB")
    one, other = (row(found, "receiver.oscillator.acceleration") for found in (of_the_platform, its_own))
    assert "vibration-of-the-platform" in codes(one)
    assert "vibration-of-the-platform" not in codes(other)
    assert one.allowable == pytest.approx(other.allowable)


def test_a_turn_is_judged_by_its_place() -> None:
    """0.1 g of acceleration with 1e-9/g is a frequency of 1e-10: the limit of the location is reached with Γ."""
    path = f"acceleration: [{0.1 * G} m/s^2, 0, 0]"
    found = checked("", "acceleration_sensitivity: 1e-9 /g", "location_error: 1 m", path=path)
    one = row(found, "receiver.oscillator.acceleration")
    assert one.binding_requirement == "location_error"
    assert one.displacement_m is not None
    assert one.utilization == pytest.approx(math.hypot(*one.displacement_m), rel=1e-6)


def test_a_spectrum_is_a_vibration_that_is_declared() -> None:
    found = checked(QUALIFICATION, requirements="islr: -20 dB, declare: [receiver.vibration]")
    assert "receiver.vibration" in found.kinds.declared
    assert "receiver.vibration" in found.kinds.without_source
    assert next(one for one in found.requirements if one.key == "declare").status == "pass"


def test_the_coverage_factor_is_in_phases_and_not_in_a_power() -> None:
    """Twice the sigma of the quadratic phase, the same mean power."""
    slow = "spectrum: {0.3 Hz: 1e-6 g^2/Hz, 5 Hz: 1e-6 g^2/Hz}"
    one, two = (
        row(checked(slow, "acceleration_sensitivity: 1e-9 /g", "islr: -20 dB", f"coverage_factor: {k}"), name)
        for k, name in ((1, "receiver.vibration.spectrum"), (2, "receiver.vibration.spectrum"))
    )
    assert two.qpe_full_rad == pytest.approx(2 * one.qpe_full_rad)
    assert two.islr_db == pytest.approx(one.islr_db)
    shaken = [
        row(
            checked(slow, "acceleration_sensitivity: 1e-9 /g", "islr: -20 dB", f"coverage_factor: {k}"),
            "receiver.oscillator.acceleration",
        )
        for k in (1, 2)
    ]
    assert shaken[1].declared == pytest.approx(2 * shaken[0].declared)
    assert shaken[1].qpe_full_rad == pytest.approx(2 * shaken[0].qpe_full_rad)
    assert shaken[1].islr_db == pytest.approx(shaken[0].islr_db)
