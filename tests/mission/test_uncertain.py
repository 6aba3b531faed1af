"""Figures of errors with a standard uncertainty, `5 mm ± 20 %`: how they are read, and which are refused."""

import math

import pytest

from bisar_budget.faults import MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.quantities import number_of, tree_of, value_at
from tests.conftest import mission_text
from tests.mission.test_schema_is_check import LOADERS, hold, is_accepted

RECEIVER = "platforms.receiver.motion_error"


def _stated(**changes: object) -> dict[str, float]:
    mission = parse_mission(mission_text(**changes))
    return {figure.key: figure.relative_uncertainty for figure in mission.uncertainties}


@pytest.mark.parametrize(
    ("text", "uncertainty"),
    [
        ("5 mm/s ± 20 %", 0.2),
        ("5 mm/s +/- 20 %", 0.2),
        ("5mm/s±20%", 0.2),
        ("5 mm/s ± 1 mm/s", 0.2),
        ("5 mm/s ± 0.1 cm/s", 0.2),
        ("0.005 ± 0.001", 0.2),
        ("-5 mm/s ± 1 mm/s", 0.2),
        ("5 mm/s ± 100 %", 1.0),
    ],
)
def test_a_relative_or_an_absolute_uncertainty(text: str, uncertainty: float) -> None:
    changes = {"platforms__receiver__motion_error__velocity": text}
    assert _stated(**changes) == {f"{RECEIVER}.velocity": pytest.approx(uncertainty)}
    mission = parse_mission(mission_text(**changes))
    assert (
        value_at(mission, f"{RECEIVER}.velocity") == (math.copysign(0.005, float(text.split("m")[0].split()[0])),) * 3
    )
    assert hold(mission_text(**changes), text)


def test_an_element_of_a_list_and_a_bias_are_figures_of_their_own() -> None:
    velocity = {"sigma": ["5 mm/s", "4 mm/s ± 10 %", 0], "bias": "1 mm/s ± 30 %"}
    changes = {"platforms__receiver__motion_error__velocity": velocity}
    assert _stated(**changes) == {
        f"{RECEIVER}.velocity.sigma.1": pytest.approx(0.1),
        f"{RECEIVER}.velocity.bias": pytest.approx(0.3),
    }
    assert hold(mission_text(**changes), "list")


def test_in_every_section_of_errors() -> None:
    changes = {
        "timing_error__quadratic": "1e-14 1/s ± 20 %",
        "common_motion_error__position": "1 m ± 10 cm",
        "propagation": {"zenith_delay": "1 cm ± 10 %"},
        "other_errors": [{"name": "drift", "quadratic_phase_error": "1 deg ± 0.1 deg"}],
        "platforms__receiver__oscillator": {"allan_deviation": {"1 s": "1e-11 ± 15 %"}},
        "platforms__receiver__motion_error__vibration": {
            "spectrum": {"10 Hz": "1e-3 m^2/s^3 ± 5 %", "1 kHz": "1e-3 m^2/s^3"}
        },
    }
    found = _stated(**changes)
    assert sorted(found.values()) == pytest.approx([0.05, 0.1, 0.1, 0.1, 0.15, 0.2])
    assert f"{RECEIVER}.vibration.spectrum.10 Hz" in found
    assert "other_errors.0.quadratic_phase_error" in found
    assert hold(mission_text(**changes), "sections")
    mission = parse_mission(mission_text(**changes))
    numbers = [number_of(tree_of(mission), key) for key in found]
    assert all(number.value for number in numbers)


def test_a_level_has_one_in_decibel() -> None:
    noise = {
        "frequency": "10 MHz",
        "phase_noise": {"1 Hz": "-80 dBc/Hz", "100 Hz": "-120 dBc/Hz ± 2 dB"},
        "level": "0 dB ± 1 dB",
    }
    found = _stated(platforms__receiver__oscillator=noise)
    assert found["platforms.receiver.oscillator.level"] == pytest.approx(10 ** (1 / 20) - 1, rel=0.06)
    assert found["platforms.receiver.oscillator.level"] == pytest.approx(math.log(10) / 20)
    assert found["platforms.receiver.oscillator.phase_noise.100 Hz"] == pytest.approx(math.log(10) / 10)


def test_set_takes_one_and_replaces_one() -> None:
    changed = {f"{RECEIVER}.velocity": "4 mm/s ± 5 %"}
    mission = parse_mission(mission_text(platforms__receiver__motion_error__velocity="5 mm/s ± 20 %"))
    (figure,) = mission.replace(changed).uncertainties
    assert figure.relative_uncertainty == pytest.approx(0.05)
    assert mission.replace({f"{RECEIVER}.velocity": "4 mm/s"}).uncertainties == ()
    with pytest.raises(MissionError, match=r"--set .*velocity: has an uncertainty of more than 100 %"):
        mission.replace({f"{RECEIVER}.velocity": "4 mm/s ± 5 m/s"})


def test_texts_keep_the_sign() -> None:
    error = {"velocity": "5 mm/s", "source": "data sheet, 5 mm/s ± 20 %"}
    mission = parse_mission(mission_text(name="drift ± 3", platforms__receiver__motion_error=error))
    assert mission.name == "drift ± 3"
    assert mission.platforms.receiver.motion_error.source == "data sheet, 5 mm/s ± 20 %"
    assert mission.uncertainties == ()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("5 mm/s ± 0 %", "has an uncertainty that is not above 0"),
        ("5 mm/s ± -1 mm/s", "has an uncertainty that is not above 0"),
        ("5 mm/s ± 101 %", "has an uncertainty of more than 100 % of the figure"),
        ("5 mm/s ± 1e400 %", "has an uncertainty of more than 100 % of the figure"),
        ("5 mm/s ± 6 mm/s", "has an uncertainty of more than 100 % of the figure"),
        ("5 mm/s ± 1 mrad", "has the uncertainty '1 mrad', which must be a speed, but 'mrad' makes it an angle"),
        ("5 mm/s ± 1", "has an uncertainty without a unit"),
        ("5 mm/s ±", "has an uncertainty without a unit"),
        ("5 mm/s ± nan %", "has the uncertainty 'nan %', which must be a finite number|must be a speed"),
        ("5 mm/s ± 1 mm/s ± 2 %", "states an uncertainty twice"),
        ("0 mm/s ± 20 %", "is 0, and an uncertainty is relative to the figure"),
        ("0 ± 1 mm/s", "is 0, and an uncertainty is relative to the figure"),
        ("± 20 %", "must be a speed"),
    ],
)
def test_a_wrong_uncertainty_is_a_fault_at_its_value(text: str, problem: str) -> None:
    content = mission_text(platforms__receiver__motion_error__velocity=text)
    with pytest.raises(MissionError) as caught:
        parse_mission(content)
    (fault,) = caught.value.faults
    line, text_of_line = next(entry for entry in enumerate(content.splitlines(), 1) if "±" in entry[1])
    assert (fault.line, fault.column) == (line, text_of_line.index("velocity: ") + len("velocity: ") + 1)
    assert fault.key == f"{RECEIVER}.velocity"
    assert any(words in fault.problem for words in problem.split("|"))
    assert fault.accepted.startswith("accepted: ")


@pytest.mark.parametrize(
    "changes",
    [
        {"radar__bandwidth": "100 MHz ± 5 %"},
        {"collection__aperture_time": "6 s ± 1 s"},
        {"requirements__location_error": "5 m +/- 1 m"},
        {"requirements__pslr": "-30 dB ± 1 dB"},
        {"scene__height_error": "5 m ± 1 m"},
        {"platforms__receiver__motion_error": {"lever_arm": {"arm": ["1 m ± 1 mm", 0, 0], "uncertainty": "1 mm"}}},
        {"allocation__warn_above": "0.9 ± 5 %"},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_only_sizes_of_errors_have_one(changes: dict[str, object]) -> None:
    with pytest.raises(
        MissionError, match=r"has an uncertainty .*Only the sizes of errors in a mission file have one"
    ):
        parse_mission(mission_text(**changes))


def test_a_correlation_has_none() -> None:
    covariance = {
        "position": "1 m ± 10 %",
        "velocity": "1 mm/s",
        "correlation": {"position.x-velocity.x": "0.5 ± 10 %"},
    }
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(platforms__receiver__motion_error__covariance=covariance))
    (fault,) = caught.value.faults
    assert fault.key.endswith("correlation.position.x-velocity.x")
    assert fault.problem == "has an uncertainty"


def test_a_level_in_percent_is_refused() -> None:
    noise = {"frequency": "10 MHz", "phase_noise": {"1 Hz": "-80 dBc/Hz", "100 Hz": "-120 dBc/Hz"}}
    for text, problem in (
        ("0 dB ± 20 %", "is a level, whose uncertainty is in dB"),
        ("0 dB ± 9 dB", r"has an uncertainty of more than 8.69 dB"),
    ):
        with pytest.raises(MissionError, match=problem):
            parse_mission(mission_text(platforms__receiver__oscillator=noise | {"level": text}))


def test_a_file_of_requirements_has_none(tmp_path) -> None:
    (tmp_path / "needs.csv").write_text(
        "key,limit,id,text\nlocation_error,5 m ± 1 m,A,It is near.\n", encoding="utf-8"
    )
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(requirements__file="needs.csv"), encoding="utf-8")
    with pytest.raises(MissionError, match="has an uncertainty"):
        parse_mission(file.read_bytes(), str(file))


def test_the_schema_sees_an_uncertainty_behind_a_wrong_unit() -> None:
    for mark in ("±", "+/-"):
        content = mission_text(platforms__receiver__motion_error__velocity=f"5 mrad {mark} 20 %")
        assert not is_accepted(content, LOADERS["YAML 1.2"])
        assert is_accepted(content.replace("5 mrad", "5 mm/s"), LOADERS["YAML 1.2"])
