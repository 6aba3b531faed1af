"""Keys of confidences, biases and distributions: what is accepted, and what each fault says."""

import math

import jsonschema
import pytest
import yaml

from bisar_budget.faults import MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission, mission_schema
from bisar_budget.mission.platforms import MotionError
from tests.conftest import mission_text

ERROR = "platforms__transmitter__motion_error"


def loaded(**changes: object) -> Mission:
    return parse_mission(mission_text(**changes))


def motion_error(**error: object) -> MotionError:
    return loaded(**{ERROR: error}).platforms.transmitter.motion_error


def fault_of(**changes: object) -> str:
    with pytest.raises(MissionError) as raised:
        loaded(**changes)
    return str(raised.value.faults[0])


@pytest.mark.parametrize("level", ["95 %", "0.95", "50 %", "99.9999 %"])
def test_a_requirement_has_a_limit_and_a_confidence(level: str) -> None:
    needs = loaded(requirements={"location_error": {"limit": "5 m", "confidence": level}}).requirements
    assert needs.location_error == 5.0
    assert needs.confidence_of("location_error") == pytest.approx(
        float(level.rstrip(" %")) / (100 if "%" in level else 1)
    )
    assert needs.confidence_of("cubic_phase_error") is None


def test_the_quadratic_phase_has_its_default_limit_beside_a_confidence() -> None:
    needs = loaded(requirements={"quadratic_phase_error": {"confidence": "90 %"}}).requirements
    assert (needs.quadratic_phase_error, needs.confidence_of("quadratic_phase_error")) == (math.pi / 4, 0.9)


@pytest.mark.parametrize(
    ("requirement", "fault"),
    [
        ({"limit": "5 m", "confidence": "95"}, "must be a probability from 50 % to 99.9999 %"),
        ({"limit": "5 m", "confidence": "0 %"}, "must be a probability from 50 % to 99.9999 %"),
        ({"limit": "5 m", "confidence": "100 %"}, "must be a probability from 50 % to 99.9999 %"),
        ({"limit": "5 m", "confidence": "49.9 %"}, "must be a probability from 50 % to 99.9999 %"),
        ({"limit": "5 m", "confidence": "95 m"}, "must be a probability from 50 % to 99.9999 %"),
        ({"confidence": "95 %"}, "is missing"),
        ({"limit": "5 m", "confidance": "95 %"}, "is not a known key"),
        ({"limit": "-5 m", "confidence": "95 %"}, "must be greater than 0 m"),
    ],
)
def test_a_wrong_confidence_is_refused(requirement: dict[str, str], fault: str) -> None:
    assert fault in fault_of(requirements={"location_error": requirement})


@pytest.mark.parametrize("key", ["pslr", "islr"])
def test_levels_have_no_confidence(key: str) -> None:
    fault = fault_of(requirements={key: {"limit": "-20 dB", "confidence": "95 %"}})
    assert "is an expectation over all errors, and has no confidence" in fault


@pytest.mark.parametrize("factor", [1, 2])
def test_a_coverage_factor_beside_a_confidence_is_refused(factor: int) -> None:
    needs = {"location_error": {"limit": "5 m", "confidence": "95 %"}}
    assert "stands beside a requirement with a confidence" in fault_of(
        requirements=needs, allocation={"coverage_factor": factor}
    )
    loaded(requirements={"location_error": {"limit": "5 m"}}, allocation={"coverage_factor": factor})


def test_an_error_has_a_sigma_and_a_bias() -> None:
    error = loaded(
        **{ERROR: {"position": {"sigma": "10 cm", "bias": [0, 0, "-5 cm"]}}}
    ).platforms.transmitter.motion_error
    assert error.stated("position") == (0.1, 0.1, 0.1)
    assert error.bias_of("position") == (0.0, 0.0, -0.05)
    assert error.bias_of("velocity") is None


def test_a_bias_alone_has_a_random_part_of_zero() -> None:
    error = loaded(
        **{ERROR: {"velocity": {"bias": "5 mm/s"}, "time_tag": {"bias": "1 ms"}}}
    ).platforms.transmitter.motion_error
    assert (error.stated("velocity"), error.time_tag) == ((0.0, 0.0, 0.0), 0.0)


def test_a_bias_stands_beside_a_covariance() -> None:
    covariance = {"position": "1 m", "velocity": "5 cm/s"}
    error = loaded(
        **{ERROR: {"covariance": covariance, "position": {"bias": ["5 cm", 0, 0]}}}
    ).platforms.transmitter.motion_error
    assert error.stated("position") == (1.0, 1.0, 1.0)
    assert error.bias_of("position") == (0.05, 0.0, 0.0)
    fault = fault_of(**{ERROR: {"covariance": covariance, "position": {"sigma": "1 m", "bias": "5 cm"}}})
    assert "there is also a position" in fault


@pytest.mark.parametrize(
    ("error", "fault"),
    [
        ({"position": {"sigma": "-1 cm", "bias": "1 cm"}}, "must be at least 0 m"),
        ({"position": {"sigma": "1 cm", "bias": 0.05}}, "needs its unit"),
        ({"position": {"sigma": "1 cm", "bias": [0, 0, 0.05]}}, "needs its unit"),
        ({"position": {"sigma": "1 cm", "bias": "5 kg"}}, "has the unknown unit 'kg'"),
        ({"position": {"sigma": "1 cm", "offset": "5 cm"}}, "is not a known key"),
        ({"imu": {"gyro_bias": {"sigma": "1 deg/h", "bias": "1 deg/h"}}}, "takes no bias"),
        ({"velocity": "1 mm/s", "distribution": {"velocity": "triangular"}}, "is not a known choice"),
        ({"velocity": "1 mm/s", "distribution": {"vibration": "uniform"}}, "is not a known key"),
    ],
)
def test_a_wrong_bias_is_refused(error: dict[str, object], fault: str) -> None:
    assert fault in fault_of(**{ERROR: error})


def test_a_displacement_without_a_direction_has_no_bias() -> None:
    stated = [{"name": "antenna", "location_error": {"sigma": "10 cm", "bias": "5 cm"}}]
    assert "has no direction, and so no bias" in fault_of(other_errors=stated)


def test_each_kind_of_error_has_its_distribution() -> None:
    error = loaded(
        **{ERROR: {"position": "1 m", "velocity": "1 mm/s", "distribution": {"velocity": "uniform"}}}
    ).platforms.transmitter.motion_error
    kinds = ("position", "velocity", "acceleration", "time_tag")
    assert [error.distribution_of(kind) for kind in kinds] == ["normal", "uniform", "normal", "normal"]
    one = loaded(**{ERROR: {"position": "1 m", "distribution": "bound"}}).platforms.transmitter.motion_error
    assert one.distribution_of("acceleration") == "bound"


@pytest.mark.parametrize(
    "changes",
    [
        {"requirements": {"location_error": {"limit": "5 m", "confidence": "95 %"}}},
        {"requirements": {"quadratic_phase_error": {"confidence": 0.9}}},
        {ERROR: {"position": {"sigma": "10 cm", "bias": [0, 0, "5 cm"]}, "distribution": {"position": "uniform"}}},
        {"timing_error": {"constant": {"sigma": "1 ns", "bias": "-2 ns"}}},
        {"propagation": {"zenith_delay": {"sigma": "1 cm", "bias": "-2 cm"}}},
        {"other_errors": [{"name": "x", "cubic_phase_error": {"bias": "2 deg"}}]},
    ],
)
def test_the_schema_accepts_what_check_accepts(changes: dict[str, object]) -> None:
    text = mission_text(**changes)
    parse_mission(text)
    assert jsonschema.Draft7Validator(mission_schema()).is_valid(yaml.safe_load(text))


@pytest.mark.parametrize(
    "changes",
    [
        {"requirements": {"location_error": {"confidence": "95 %"}}},
        {"requirements": {"islr": {"limit": "-20 dB", "confidence": "95 %"}}},
        {ERROR: {"position": {"sigma": "10 cm", "byas": "5 cm"}}},
    ],
)
def test_the_schema_refuses_what_check_refuses(changes: dict[str, object]) -> None:
    text = mission_text(**changes)
    with pytest.raises(MissionError):
        parse_mission(text)
    assert not jsonschema.Draft7Validator(mission_schema()).is_valid(yaml.safe_load(text))
