"""Delays of the air without a correlation time, in apertures of a minute and more: no verdict rests on that."""

import copy
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.budget.staying_air import AIR_CHANGES_IN_S, LONG_APERTURE_S
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.load import parse_mission
from bisar_budget.report.explain.explanation import explain
from tests.conftest import examples, mission_text, row
from tests.conftest import findings as found_of
from tests.questions.test_sweep import assert_as_checked, grid, swept

NEEDS = {
    "quadratic_phase_error": "360 deg",
    "cubic_phase_error": "360 deg",
    "islr": "-20 dB",
    "location_error": "1 km",
}
TEN_MINUTES = {"correlation_time": "10 min"}
STAYS = {"correlation_time": "1e9 s"}
LONG = {
    "radar": {"center_frequency": "1.3 GHz", "bandwidth": "80 MHz"},
    "collection__aperture_time": "80 s",
    "platforms__receiver": {
        "position": ["6 km", "6 km", "2 km"],
        "velocity": [0, "1 m/s", 0],
        "motion_error": {"random": [{"name": "GNSS", "sigma": "1 um", "correlation_time": "1.5 s"}]},
    },
    "requirements": NEEDS,
    "allocation": {"model": "full", "combine": "rss"},
}
GEOSYNCHRONOUS = {
    "collection__aperture_time": "1200 s",
    "platforms__transmitter": {"position": ["200 km", 0, "500 km"], "velocity": [0, "1 m/s", 0]},
    "platforms__receiver": {
        "position": ["1 km", "1 km", "8 km"],
        "velocity": [0, 0, 0],
        "motion_error": {"random": [{"name": "GNSS", "sigma": "1 um", "correlation_time": "1.5 s"}]},
    },
    "allocation": {"model": "full", "combine": "rss"},
}


def findings(air: object, **changes: object) -> MissionFindings:
    return found_of(**copy.deepcopy(LONG | changes), propagation=air)


def of_delay(size: float, **more: object) -> dict[str, object]:
    return {"zenith_delay": f"{size!r} m", **more}


def requirement(found: MissionFindings, key: str) -> JudgedRequirement:
    (judged,) = (each for each in found.requirements if each.key == key)
    return judged


def statuses(found: MissionFindings) -> dict[str, str]:
    return {each.key: each.status for each in found.requirements}


def use_if_changing(key: str, size: float = 1e-3, **changes: object) -> float:
    """Use of a requirement by a delay that changes in ten minutes, as a check judges it. [1]"""
    utilization = requirement(findings(of_delay(size, **TEN_MINUTES), **changes), key).utilization
    assert utilization is not None
    return utilization


# ---------------------------------------------------------------------- a key that decides between fail and pass
def test_the_deleted_line_of_a_mission_that_fails_does_not_let_it_pass() -> None:
    fails, open_one, passes = (findings(of_delay(5e-3, **key)) for key in (TEN_MINUTES, {}, STAYS))
    assert statuses(fails)["islr"] == fails.status == "fail"
    assert statuses(open_one) == dict.fromkeys(NEEDS, "pass") | {"islr": "not_evaluated"}
    assert open_one.status == row(open_one, "mission.islr").status == "not_evaluated"
    assert STATUS[open_one.status].fails
    assert passes.status == "pass"
    judged = requirement(open_one, "islr")
    assert (judged.utilization, judged.reached) == (None, None)


def test_the_reason_says_what_stays_what_it_would_make_and_what_to_add() -> None:
    fails, stays = (findings(of_delay(5e-3, **key)) for key in (TEN_MINUTES, {}))
    reason = requirement(stays, "islr").reason
    assert reason is not None
    assert reason.code == "air-stays"
    level, use = requirement(fails, "islr").reached, requirement(fails, "islr").utilization
    assert reason.values[:3] == (80.0, AIR_CHANGES_IN_S, "islr")
    # The row counts the small noise beside it too.
    assert reason.values[3] == pytest.approx(level, abs=1e-3)
    assert reason.values[4] == pytest.approx(use, rel=1e-3)
    assert str(reason) == (
        "without correlation_time the delays of propagation are constant over 80 s; with a correlation time of 10 "
        f"min they would add an ISLR of {level:.1f} dB, {100 * use:.3g} % of what is allowed: add "
        "propagation.correlation_time, 1e9 s for a constant delay"
    ).replace("-18.0 dB", "-18 dB")


@pytest.mark.parametrize(("aperture_time", "status"), [(59.0, "pass"), (LONG_APERTURE_S, "not_evaluated")])
def test_from_a_minute_on(aperture_time: float, status: str) -> None:
    found = findings(of_delay(5e-3), collection__aperture_time=f"{aperture_time} s")
    assert statuses(found)["islr"] == found.status == status


@pytest.mark.parametrize("model", ["published", "full", "strictest"])
@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
@pytest.mark.parametrize(
    ("key", "needs"),
    [
        ("islr", {}),
        ("quadratic_phase_error", {"quadratic_phase_error": "10 deg", "islr": "-1 dB"}),
        ("cubic_phase_error", {"cubic_phase_error": "10 deg", "islr": "-1 dB"}),
    ],
)
def test_just_under_and_just_over_a_tenth(key: str, needs: dict[str, str], combine: str, model: str) -> None:
    changes = {"requirements": NEEDS | needs, "allocation": {"model": model, "combine": combine}}
    tenth = 1e-4 / use_if_changing(key, **changes)  # m, since a millimetre has the use
    for factor, status in ((0.97, "pass"), (1.03, "not_evaluated")):
        found = findings(of_delay(tenth * factor), **changes)
        assert statuses(found) == dict.fromkeys(NEEDS, "pass") | {key: status}, found.status
        assert found.status == status
    assert requirement(found, key).reason.code == "air-stays"


def test_a_displacement_counts_by_what_changing_adds_to_it() -> None:
    """A delay that stays moves the image too, and that is judged already."""
    moves = [
        math.hypot(*row(findings(of_delay(5e-3, **key)), "propagation.zenith_delay").displacement_m)
        for key in (TEN_MINUTES, STAYS)
    ]
    assert moves[0] > 2 * moves[1]
    added = math.sqrt(moves[0] ** 2 - moves[1] ** 2)
    for factor, status in ((10.3, "pass"), (9.7, "not_evaluated")):
        needs = NEEDS | {"islr": "-1 dB", "location_error": f"{added * factor!r} m"}
        assert statuses(findings(of_delay(5e-3), requirements=needs))["location_error"] == status


def test_below_a_tenth_it_decides_where_the_rest_is_nearly_used_up() -> None:
    """With 5 % by the air, which add as powers to 99.9 % by a declared noise, the mission would fail."""
    noise = [{"name": "GNSS", "sigma": "1 mm", "correlation_time": "1.5 s"}]
    used = row(findings(of_delay(0), platforms__receiver__motion_error={"random": noise}), "mission.islr").utilization
    size = 0.05e-3 / use_if_changing("islr")
    for share, status in ((0.998, "warn"), (0.9995, "not_evaluated")):
        noise[0]["sigma"] = f"{1e-3 * share / used!r} m"
        changes = {
            "platforms__receiver__motion_error": {"random": noise},
            "allocation": {"split": {"receiver": 0.99, "transmitter": 0.01}, "model": "full", "combine": "rss"},
        }
        assert row(findings(of_delay(size), **changes), "mission.islr").status == status
        assert row(findings(of_delay(size, **STAYS), **changes), "mission.islr").status == "warn"


@pytest.mark.parametrize(
    ("air", "is_open"),
    [
        ({"zenith_delay": "6 mm"}, True),
        ({"zenith_electron_content": "1 TECU"}, True),
        ({"transmitter": {"zenith_delay": "6 mm"}}, True),
        ({"transmitter": {"zenith_delay": "6 mm", "correlation_time": "1e9 s"}, "receiver": {"zenith_delay": "6 mm"}},
         True),
        ({"zenith_delay": "1 um"}, False),
        ({"zenith_delay": 0}, False),
        ({"receiver": {"zenith_electron_content": "1 TECU"}}, False),  # has no electrons on its way
        ({"zenith_delay": "6 mm", "correlation_time": "1e9 s"}, False),  # somebody has said that it stays
    ],
)  # fmt: skip
def test_only_legs_that_lack_it_count(air: dict[str, object], is_open: bool) -> None:
    needs = {"location_error": "1 km", "cubic_phase_error": "360 deg", "islr": "-20 dB"}
    found = found_of(**copy.deepcopy(GEOSYNCHRONOUS), requirements=needs, propagation=air)
    assert (statuses(found)["islr"] == "not_evaluated") == is_open
    assert not any(each.message.code == "air-stays" for each in found.warnings)
    if is_open:
        reason = str(requirement(found, "islr").reason)
        own = "receiver" in air and "transmitter" in air
        assert ("add propagation.receiver.correlation_time" in reason) == own
        assert "1e9 s for a constant delay" in reason


def test_of_one_air_amplitudes_add() -> None:
    one, two = (
        row(findings(air), "mission.islr").reason.values[4]
        for air in (of_delay(5e-3), dict.fromkeys(("transmitter", "receiver"), of_delay(5e-3)))
    )
    legs = [
        row(findings(of_delay(5e-3, **TEN_MINUTES)), f"propagation.{name}.zenith_delay").islr_db
        for name in ("transmitter", "receiver")
    ]
    rms = [math.sqrt(math.log1p(10 ** (level / 10) * 0.9028233335802807)) for level in legs]
    assert one / two == pytest.approx(sum(rms) / math.hypot(*rms), rel=1e-3)


def test_a_leg_is_held_to_its_platforms_share() -> None:
    """A tenth of the transmitter's share is less than a tenth of all; its own row is open, and the requirement."""
    air = {"transmitter": of_delay(1e-3)}
    changes = {"allocation": {"model": "full", "combine": "rss", "split": {"transmitter": 0.01, "receiver": 0.99}}}
    used = row(findings({"transmitter": of_delay(1e-3, **TEN_MINUTES)}, **changes), "mission.islr").utilization
    air = {"transmitter": of_delay(0.5e-4 / used)}
    found = findings(air, **changes)
    assert row(found, "mission.islr").status == "pass"
    # Without noise of its own the transmitter has no row of what it spreads: then nothing holds its share.
    assert row(found, "transmitter.islr").status == "not_declared"


def test_what_fails_stays_failed() -> None:
    noise = {"random": [{"name": "GNSS", "sigma": "1 m", "correlation_time": "1.5 s"}]}
    found = findings(of_delay(5e-3), platforms__receiver__motion_error=noise)
    assert (statuses(found)["islr"], row(found, "mission.islr").status) == ("fail", "fail")


def test_without_a_requirement_on_islr_there_is_nothing_of_it() -> None:
    """Its spread follows the rule of effects that no requirement takes: negligible below 0.08 rad."""
    needs = {key: value for key, value in NEEDS.items() if key != "islr"}
    for size, status in ((0.5e-3, "pass"), (5e-3, "not_evaluated")):
        found = findings(of_delay(size), requirements=needs)
        assert found.status == row(found, "propagation.zenith_delay").status.replace("info", "pass") == status
        assert statuses(found) == dict.fromkeys(needs, "pass")
    reason = row(found, "propagation.zenith_delay").reason
    assert reason.code == "air-stays-untaken"
    assert "add propagation.correlation_time, 1e9 s for a constant delay, or `islr: -20 dB` to requ" in str(reason)
    assert findings(of_delay(5e-3, **STAYS), requirements=needs).status == "pass"


def test_a_note_says_that_little_rests_on_it() -> None:
    for size, is_said in ((1e-4, True), (5e-3, False), (0.0, False)):
        found = findings(of_delay(size))
        assert ("air-that-stays-is-negligible" in [note.code for note in found.notes]) == is_said


def test_a_waiver_of_the_requirement_covers_it() -> None:
    waiver = [{"id": "mission.islr", "until": "2099-01-01", "reason": "ECR-1"}]
    found = findings(of_delay(5e-3), waivers=waiver)
    assert statuses(found)["islr"] == found.status == "waived"


def test_autofocus_has_its_gain() -> None:
    """Ten times what is required, which a pull-in of 2π corrects: a tenth of that is a tenth of a larger limit."""
    needs = NEEDS | {"quadratic_phase_error": "10 deg", "islr": "-1 dB"}
    changes = {"requirements": needs, "autofocus": {"n_pull": 1}}
    size = 1.5e-4 / use_if_changing("quadratic_phase_error", requirements=needs)
    assert statuses(findings(of_delay(size), requirements=needs))["quadratic_phase_error"] == "not_evaluated"
    assert statuses(findings(of_delay(size), **changes))["quadratic_phase_error"] == "pass"


# ---------------------------------------------------------------------- every question agrees
@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
def test_sweeps_are_checks_across_a_minute(combine: str) -> None:
    text = mission_text(
        **copy.deepcopy(LONG) | {"allocation": {"model": "full", "combine": combine}},
        propagation={"zenith_delay": "5 mm"},
    )
    mission = parse_mission(text, "m.yaml")
    cases = grid(mission, collection__aperture_time=[40.0, 59.9, 60.0, 61.0, 80.0])
    columns = ["mission.islr.status", "mission.islr.utilization"]
    table = swept(mission, cases, columns)
    assert table["status"].tolist() == ["pass", "pass", *["not_evaluated"] * 3]
    assert_as_checked(mission, cases, table, columns)


def test_sweeps_of_a_delay_are_checks() -> None:
    mission = parse_mission(mission_text(**copy.deepcopy(LONG), propagation={"zenith_delay": "5 mm"}), "m.yaml")
    cases = grid(mission, propagation__zenith_delay=np.geomspace(1e-5, 1e-2, 7))
    columns = ["mission.islr.status", "mission.quadratic_phase_error.status"]
    assert_as_checked(mission, cases, swept(mission, cases, columns), columns)


def test_solve_finds_the_tenth_and_allocate_orders_below_it(run: Callable, tmp_path: Path) -> None:
    file = tmp_path / "m.yaml"
    key = "propagation.zenith_delay"
    file.write_text(
        mission_text(**copy.deepcopy(LONG), propagation={"zenith_delay": "0.2 mm"}, allocation__specify=[key])
    )
    solved = json.loads(run("solve", str(file), "--for", key, "--format", "json").stdout)
    tenth = 1e-4 / use_if_changing("islr")
    assert solved["missions"][0]["value"] == pytest.approx(tenth, rel=1e-3)
    (mission,) = json.loads(run("allocate", str(file), "--format", "json").stdout)["missions"]
    (specified,) = mission["specifications"]
    assert 0.9 * tenth < specified["ordered"] <= tenth
    ordered = findings(of_delay(specified["ordered"]))
    assert ordered.status == "pass"


def test_an_explanation_has_the_numbers() -> None:
    found = findings(of_delay(5e-3))
    text = explain(found.mission, found, "mission.islr")
    assert "if their correlation time were 600 s" in text


@examples(25)
@given(
    size=st.floats(1e-5, 1e-2),
    aperture_time=st.floats(60.0, 1200.0),
    changes_in=st.floats(1.0, 1e4),
    of_legs=st.booleans(),
    has_islr=st.booleans(),
    combine=st.sampled_from(["each", "sum", "rss"]),
)
def test_the_deleted_key_of_a_failing_mission_never_lets_it_pass(
    size: float, aperture_time: float, changes_in: float, of_legs: bool, has_islr: bool, combine: str
) -> None:
    """Air that spreads all that is allowed in five seconds uses more than a tenth in ten minutes.

    What no requirement takes is negligible at a smaller size, to which no tenth applies.
    """
    needs = {key: value for key, value in NEEDS.items() if has_islr or key != "islr"}
    changes_in *= 5.0 if has_islr else AIR_CHANGES_IN_S
    changes = {"requirements": needs, "collection__aperture_time": f"{aperture_time} s"}
    changes["allocation"] = {"model": "full", "combine": combine}
    both = []
    for key in ({"correlation_time": f"{changes_in} s"}, {}):
        air = of_delay(size, **key)
        both.append(findings(dict.fromkeys(("transmitter", "receiver"), air) if of_legs else air, **changes))
    if STATUS[both[0].status].fails:
        assert STATUS[both[1].status].fails
