"""Spectra of vibration and what oscillators feel, as a file states them: what is read, and what is refused."""

import math

import pytest

from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.faults import Fault, MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission, mission_schema
from bisar_budget.mission.quantities import number_of, tree_of
from bisar_budget.mission.vibrations import AcceleratedSinusoid, Sinusoid
from bisar_budget.questions.varied import scaled
from tests.conftest import mission_text

G = STANDARD_GRAVITY_MPS2
VIBRATION = "platforms__receiver__motion_error__vibration"
OSCILLATOR = "platforms__receiver__oscillator"
NOISE = {"frequency": "10 MHz", "power_law": {"h0": "1e-24"}}
POINTS = {"20 Hz": "0.04 g^2/Hz", "1 kHz": "0.04 g^2/Hz"}


def loaded(**changes: object) -> Mission:
    return parse_mission(mission_text(**changes), "m.yaml")


def faults(**changes: object) -> tuple[Fault, ...]:
    with pytest.raises(MissionError) as caught:
        loaded(**changes)
    return caught.value.faults


def vibration_of(value: object):
    return loaded(**{VIBRATION: value}).platforms.receiver.motion_error.vibration


@pytest.mark.parametrize(
    ("text", "accelerated", "density"),
    [
        ("0.04 g^2/Hz", True, 0.04 * G**2),
        ("0.04 g²/Hz", True, 0.04 * G**2),
        ("3 (m/s^2)^2/Hz", True, 3.0),
        ("3 m^2/s^3", True, 3.0),
        ("2 mg^2/Hz", True, 2e-6 * G**2),
        ("5 mm^2/Hz", False, 5e-6),
        ("5 um^2/Hz", False, 5e-12),
        ("5 µm²/Hz", False, 5e-12),
        ("1e-9 m^2/Hz", False, 1e-9),
    ],
)
def test_units_of_a_spectrum(text: str, accelerated: bool, density: float) -> None:
    spectrum = vibration_of({"spectrum": {"20 Hz": text, "1 kHz": text}}).spectrum
    assert spectrum.is_accelerated is accelerated
    assert [one for _, one in spectrum.points] == pytest.approx([density, density])


def test_points_are_sorted_as_those_of_a_mask() -> None:
    spectrum = vibration_of({"spectrum": {"1 kHz": "1 g^2/Hz", "20 Hz": "2 g^2/Hz", "80 Hz": "3 g^2/Hz"}}).spectrum
    assert [f for f, _ in spectrum.points] == [20.0, 80.0, 1000.0]


@pytest.mark.parametrize(
    ("value", "key", "problem"),
    [
        ({"spectrum": {"20 Hz": "0.04 g^2/Hz"}}, "spectrum", "must be 2 to 100 points, 1 given"),
        ({"spectrum": []}, "spectrum", "must be 2 to 100 points"),
        ({"spectrum": POINTS | {"50 Hz": "0.04"}}, "spectrum.50 Hz", "has no unit"),
        ({"spectrum": POINTS | {"50 Hz": "-0.04 g^2/Hz"}}, "spectrum.50 Hz", "must be greater than 0"),
        ({"spectrum": POINTS | {"50 Hz": "0 g^2/Hz"}}, "spectrum.50 Hz", "must be greater than 0"),
        ({"spectrum": POINTS | {"50 Hz": "0.04 g/Hz"}}, "spectrum.50 Hz", "has the unknown unit 'g/Hz'"),
        (
            {"spectrum": POINTS | {"50 Hz": "1 mm^2/Hz"}},
            "spectrum.50 Hz",
            "must be a spectral density of acceleration, but 'mm^2/Hz' makes it a spectral density of displacement",
        ),
        ({"spectrum": POINTS | {"-3 Hz": "1 g^2/Hz"}}, "spectrum.-3 Hz", "must be greater than 0 Hz"),
        ({"spectrum": POINTS | {"1000 Hz": "1 g^2/Hz"}}, "spectrum.1000 Hz", "is in the list twice"),
        ({"spectrum_level": "3 dB"}, "spectrum_level", "shifts a spectrum, and there is none"),
        (
            {"sinusoidal": [{"amplitude": ["1 g", "1 mm", 0], "frequency": "50 Hz"}]},
            "sinusoidal[0].amplitude[1]",
            "must be an acceleration, but 'mm' makes it a length",
        ),
        (
            {"sinusoidal": [{"amplitude": "-1 g", "frequency": "50 Hz"}]},
            "sinusoidal[0].amplitude",
            "must be at least 0 m/s²",
        ),
    ],
)  # fmt: skip
def test_a_vibration_that_cannot_be(value: object, key: str, problem: str) -> None:
    (fault,) = faults(**{VIBRATION: value})
    assert fault.key == f"platforms.receiver.motion_error.vibration.{key}"
    assert fault.problem.startswith(problem)
    assert fault.line is not None


@pytest.mark.parametrize(
    ("value", "key", "problem"),
    [
        ({"acceleration_sensitivity": "1e-9"}, "acceleration_sensitivity", "has no unit"),
        ({"acceleration_sensitivity": "-1e-9 /g"}, "acceleration_sensitivity", "must be at least 0"),
        ({"acceleration_sensitivity": "1e-9 g"}, "acceleration_sensitivity", "must be an acceleration sensitivity"),
        ({"vibration": {"spectrum": POINTS}}, "vibration", "does nothing to an oscillator without"),
        (
            {"acceleration_sensitivity": "1e-9 /g", "vibration": {"wideband": {"rms": "1 um"}}},
            "vibration.wideband",
            "is not a known key",
        ),
        (
            {"acceleration_sensitivity": "1e-9 /g", "vibration": {"spectrum_level": "3 dB"}},
            "vibration.spectrum_level",
            "shifts a spectrum, and there is none",
        ),
        ({"level": "high"}, "level", "must be a power ratio in decibel"),
    ],
)
def test_an_oscillator_that_cannot_be(value: dict[str, object], key: str, problem: str) -> None:
    (fault,) = faults(**{OSCILLATOR: NOISE | value})
    assert fault.key == f"platforms.receiver.oscillator.{key}"
    assert fault.problem.startswith(problem)


@pytest.mark.parametrize("text", ["1e-9 /g", "1e-9/g", "1e-9 1/g", "1 ppb/g"])
def test_units_of_a_sensitivity(text: str) -> None:
    oscillator = loaded(**{OSCILLATOR: NOISE | {"acceleration_sensitivity": text}}).platforms.receiver.oscillator
    assert oscillator is not None
    assert oscillator.acceleration_sensitivity == pytest.approx(1e-9 / G)


def test_sinusoids_in_g_stand_beside_those_in_metres() -> None:
    lines = vibration_of(
        {
            "sinusoidal": [
                {"amplitude": "20 um", "frequency": "15 Hz"},
                {"amplitude": "1 g", "frequency": "50 Hz"},
                {"amplitude": [0, "1 m/s^2", 0], "frequency": "50 Hz"},
            ]
        }
    ).sinusoidal
    assert [type(one) for one in lines] == [Sinusoid, AcceleratedSinusoid, AcceleratedSinusoid]
    assert lines[0].displacement == pytest.approx(20e-6)
    assert lines[0].acceleration == pytest.approx(20e-6 * (2 * math.pi * 15) ** 2)
    assert lines[1].displacement == pytest.approx(99.36e-6, rel=1e-4)  # a·g/(2πf)²
    assert lines[2].displacement == pytest.approx((0, 1 / (2 * math.pi * 50) ** 2, 0))


def test_a_spectrum_is_scaled_by_the_square_of_what_amplitudes_are() -> None:
    key = "platforms.receiver.motion_error"
    mission = loaded(**{VIBRATION: {"spectrum": POINTS, "sinusoidal": [{"amplitude": "1 g", "frequency": "50 Hz"}]}})
    doubled = scaled(mission, key, 2.0).platforms.receiver.motion_error.vibration
    assert [density for _, density in doubled.spectrum.points] == pytest.approx([0.16 * G**2] * 2)
    assert doubled.sinusoidal[0].amplitude == pytest.approx(2 * G)


def test_numbers_of_a_spectrum_are_asked_for() -> None:
    mission = loaded(**{VIBRATION: {"spectrum": POINTS, "spectrum_level": "3 dB"}})
    of = "platforms.receiver.motion_error.vibration."
    assert number_of(tree_of(mission), f"{of}spectrum.20 Hz").unit == "g^2/Hz"
    assert number_of(tree_of(mission), f"{of}spectrum_level").value == 3.0


def test_the_schema_has_both_forms() -> None:
    definitions = mission_schema()["definitions"]
    forms = definitions["Vibration"]["properties"]["sinusoidal"]["items"]["anyOf"]
    assert [one["$ref"].rpartition("/")[2] for one in forms] == ["Sinusoid", "AcceleratedSinusoid"]
    assert definitions["Vibration"]["properties"]["spectrum"]["anyOf"][0]["minProperties"] == 2
