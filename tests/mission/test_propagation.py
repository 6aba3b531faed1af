"""The section `propagation`, and effects of `other_errors`: what they may say, and what is refused."""

import pytest

from bisar_budget.faults import Fault, MissionError
from bisar_budget.mission.load import parse_mission
from tests.conftest import mission_text

LEGS = "accepted: zenith_delay and zenith_electron_content of both legs, or transmitter and receiver with their own"


def faults(**changes: object) -> tuple[Fault, ...]:
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(**changes), "m.yaml")
    return caught.value.faults


@pytest.mark.parametrize(
    ("propagation", "legs"),
    [
        ({"zenith_delay": "5 cm"}, [(0.05, None, None, None)] * 2),
        ({"zenith_delay": 0, "source": "model"}, [(0, None, None, "model")] * 2),
        ({"zenith_electron_content": "2 TECU"}, [(None, 2e16, None, None)] * 2),
        ({"zenith_electron_content": 0}, [(None, 0, None, None)] * 2),
        ({"zenith_electron_content": "3e15 1/m^2"}, [(None, 3e15, None, None)] * 2),
        (
            {"transmitter": {"zenith_delay": "1 mm", "source": "GNSS"}, "source": "model"},
            [(0.001, None, None, "GNSS"), None],
        ),
        (
            {"receiver": {"zenith_delay": "1 mm", "zenith_electron_content": "0.5 TECU"}, "source": "model"},
            [None, (0.001, 5e15, None, "model")],
        ),
        ({"zenith_delay": "5 cm", "correlation_time": "20 min"}, [(0.05, None, 1200, None)] * 2),
        (
            {"receiver": {"zenith_delay": "1 mm", "correlation_time": "90 s"}, "transmitter": {"zenith_delay": 0}},
            [(0, None, None, None), (0.001, None, 90, None)],
        ),
        (
            {
                "correlation_time": "1 h",
                "receiver": {"zenith_delay": "1 mm", "correlation_time": "90 s"},
                "transmitter": {"zenith_electron_content": "1 TECU"},
            },
            [(None, 1e16, 3600, None), (0.001, None, 90, None)],
        ),
    ],
)
def test_both_legs_alike_or_each_its_own(propagation: dict[str, object], legs: list[tuple | None]) -> None:
    found = parse_mission(mission_text(propagation=propagation)).propagation
    assert found is not None
    of_legs = map(found.leg, ("transmitter", "receiver"))
    assert [None if leg is None else leg[:4] for leg in of_legs] == legs


@pytest.mark.parametrize(
    ("propagation", "key", "said"),
    [
        ({}, "propagation", f"states no delay; {LEGS}"),
        ({"source": "model"}, "propagation", f"states no delay; {LEGS}"),
        ({"transmitter": {}}, "propagation.transmitter", "states no delay; accepted: zenith_delay or"),
        ({"zenith_delay": "-5 cm"}, "propagation.zenith_delay", "must be at least 0 m"),
        ({"zenith_delay": "5 TECU"}, "propagation.zenith_delay", "must be a length"),
        ({"zenith_electron_content": "-1 TECU"}, "propagation.zenith_electron_content", "must be at least 0 TECU"),
        ({"zenith_electron_content": 2}, "propagation.zenith_electron_content", "Did you mean '2 TECU'?"),
        ({"zenith_electron_content": "2 cm"}, "propagation.zenith_electron_content", "must be an electron content"),
        ({"zenith_electron_content": "2 TEC"}, "propagation.zenith_electron_content", "Did you mean 'TECU'?"),
        ({"zenith_electron_content": ".nan"}, "propagation.zenith_electron_content", "must be a finite number"),
        (
            {"zenith_delay": "5 cm", "receiver": {"zenith_delay": "1 cm"}},
            "propagation.receiver",
            f"mixes zenith_delay of both legs with receiver; {LEGS}",
        ),
        (
            {"correlation_time": "20 min"},
            "propagation",
            f"states a correlation_time and no delay that changes in it; {LEGS}",
        ),
        ({"correlation_time": "20 min", "source": "a"}, "propagation", "states a correlation_time and no delay that"),
        (
            {"zenith_delay": "5 cm", "receiver": {"correlation_time": "20 min"}},
            "propagation.receiver",
            "states a correlation_time and no delay of this leg that changes in it; accepted: zenith_delay or "
            "zenith_electron_content of this leg beside it. One air over both legs changes in one time, "
            "propagation.correlation_time",
        ),
        (
            {"zenith_delay": "5 cm", "receiver": {"zenith_delay": "1 cm", "correlation_time": "20 min"}},
            "propagation.receiver",
            f"mixes zenith_delay of both legs with receiver; {LEGS}",
        ),
        (
            {"correlation_time": "1 h", "receiver": {"zenith_delay": "1 mm", "correlation_time": "90 s"}},
            "propagation.correlation_time",
            "is of no leg: each that states a delay has its own; accepted: correlation_time here, or of each leg its",
        ),
        ({"zenith_delay": "5 cm", "correlation_time": 0}, "propagation.correlation_time", "must be greater than 0 s"),
        (
            {"zenith_delay": "5 cm", "correlation_time": "-1 s"},
            "propagation.correlation_time",
            "must be greater than",
        ),
        ({"zenith_delay": "5 cm", "correlation_time": "1 ns"}, "propagation.correlation_time", "must be at least 1"),
        ({"zenith_delay": "5 cm", "correlation_time": "1e10 s"}, "propagation.correlation_time", "must be at most"),
        ({"zenith_delay": "5 cm", "correlation_time": ".inf"}, "propagation.correlation_time", "must be a finite"),
        ({"zenith_delay": "5 cm", "correlation_time": "5 m"}, "propagation.correlation_time", "must be a time"),
        ({"zenith": "5 cm"}, "propagation.zenith", "is not a known key"),
        ({"transmiter": {"zenith_delay": "1 cm"}}, "propagation.transmiter", "Did you mean 'transmitter'?"),
    ],
)
def test_what_is_refused(propagation: dict[str, object], key: str, said: str) -> None:
    (fault,) = (one for one in faults(propagation=propagation) if one.key == key)  # an unknown key states nothing too
    assert said in f"{fault.problem}; {fault.accepted}. {fault.hint}"
    assert fault.line is not None


LOW = {"position": ["30 km", 0, "1.5 km"], "velocity": [0, "150 m/s", 0]}


def test_a_leg_along_the_ground_is_refused_where_it_has_a_delay() -> None:
    """1.5 km up at 30 km is 2.86 degrees."""
    changes = {"platforms__transmitter": LOW, "propagation": {"zenith_delay": "5 cm"}}
    (fault,) = faults(**changes)
    assert fault.key == "propagation.zenith_delay"
    assert fault.problem.startswith("the transmitter is seen at an elevation of 2.86 deg within the aperture")
    assert fault.accepted.startswith("accepted: elevations of at least 3 deg")
    for propagation in ({"receiver": {"zenith_delay": "5 cm"}}, {"zenith_electron_content": "5 TECU"}):
        parse_mission(mission_text(platforms__transmitter=LOW, propagation=propagation))


def test_a_leg_that_sinks_within_the_aperture_is_refused() -> None:
    """At mid-aperture 3.4 degrees; 3 s later, by 100 m/s lower, 2.9."""
    path = {"position": ["30 km", 0, "1.8 km"], "velocity": [0, "150 m/s", "-100 m/s"]}
    (fault,) = faults(platforms__transmitter=path, propagation={"transmitter": {"zenith_delay": "5 cm"}})
    assert fault.key == "propagation.transmitter.zenith_delay"
    assert "2.86 deg" in fault.problem


def test_of_a_path_on_the_earth_too() -> None:
    place = {"latitude": "47 deg", "longitude": "6 deg", "height": "300 m"}
    mast = {"latitude": "47.05 deg", "longitude": "6 deg", "altitude": "350 m", "speed": 0}
    (fault,) = faults(scene=place, platforms__receiver=mast, propagation={"zenith_delay": "5 cm"})
    assert fault.key == "propagation.zenith_delay"
    assert "the receiver is seen at an elevation of" in fault.problem


# ---------------------------------------------------------------------- effects from elsewhere
@pytest.mark.parametrize(
    ("other", "key", "said"),
    [
        ({"name": "a"}, "other_errors[0]", "states no effect; accepted: any of quadratic_phase_error, cubic_phase_e"),
        ({"name": "a", "source": "b"}, "other_errors[0]", "states no effect"),
        ({"name": "a", "islr": "0 dB"}, "other_errors[0].islr", "must be less than 0 dB"),
        ({"name": "a", "islr": "3 dB"}, "other_errors[0].islr", "must be less than 0 dB"),
        ({"name": "a", "location_error": "-1 m"}, "other_errors[0].location_error", "must be at least 0 m"),
        ({"name": "a", "cubic_phase_error": "1"}, "other_errors[0].cubic_phase_error", "Did you mean '1 deg'"),
        ({"quadratic_phase_error": "1 deg"}, "other_errors[0].name", "is missing"),
    ],
)
def test_an_error_from_elsewhere_states_an_effect(other: dict[str, object], key: str, said: str) -> None:
    (fault,) = faults(other_errors=[other])
    assert fault.key == key
    assert said in f"{fault.problem}; {fault.accepted}. {fault.hint}"


def test_row_ids_are_distinct() -> None:
    """One error named like another one's effect would have its row."""
    errors = [{"name": "a", "islr": "-40 dB"}, {"name": "a.islr", "quadratic_phase_error": "1 deg"}]
    (fault,) = faults(other_errors=errors)
    assert (fault.key, fault.problem) == (
        "other_errors[1].name",
        "makes the row id other.a.islr, as an earlier error does",
    )
    errors[1] = {"name": "a.islr", "cubic_phase_error": "1 deg"}
    assert len(parse_mission(mission_text(other_errors=errors)).other_errors) == 2
