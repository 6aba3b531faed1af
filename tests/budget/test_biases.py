"""Biases in the verdict: whatever a large size breaks, a bias of this size breaks too."""

from typing import Any

import pytest

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from tests.conftest import findings

SMALL = {"position": "1 cm", "velocity": "0.1 mm/s"}
RECEIVER = "platforms__receiver__motion_error"
PHASE = {"quadratic_phase_error": "90 deg", "location_error": "5 m"}


def judged(**changes: Any) -> MissionFindings:
    allocation = {"model": "full", "combine": "rss"} | changes.pop("allocation", {})
    platforms = {"platforms__transmitter__motion_error": SMALL, RECEIVER: SMALL}
    return findings(**{"requirements": PHASE, **platforms, "allocation": allocation, **changes})


def row(found: MissionFindings, row_id: str) -> Row:
    return next(each for each in found.rows if each.id == row_id)


def location_of(found: MissionFindings) -> JudgedRequirement:
    return next(each for each in found.requirements if each.key == "location_error")


def receiver(kind: str, size: str, bias: str | None = None, axis: int = 1) -> dict[str, Any]:
    """Errors of the receiver with a size, or with a bias of this size, along one axis."""
    unit = size.split()[1]
    large = [size if index == axis else f"0 {unit}" for index in range(3)]
    return {**SMALL, kind: large if bias is None else {"sigma": bias, "bias": large}}


def cubic(figure: Any) -> list[dict[str, Any]]:
    return [{"name": "a", "cubic_phase_error": figure}]


@pytest.mark.parametrize("figure", ["170 deg", {"sigma": "1 deg", "bias": "170 deg"}])
def test_a_cubic_phase_that_no_requirement_judges_is_no_pass(figure: Any) -> None:
    found = judged(other_errors=cubic(figure))
    assert found.status == "not_evaluated"
    assert row(found, "other.a.cubic_phase_error").status == "not_evaluated"


@pytest.mark.parametrize("bias", ["1e-10 1/s^2", "-1e-10 1/s^2"])
def test_a_cubic_clock_bias_that_no_requirement_judges_is_no_pass(bias: str) -> None:
    found = judged(timing_error={"cubic": {"sigma": "1e-14 1/s^2", "bias": bias}}, collection__aperture_time="2 s")
    assert row(found, "timing.cubic").status == "not_evaluated"


@pytest.mark.parametrize("requirement", ["10 m", {"limit": "10 m", "confidence": "95 %"}])
@pytest.mark.parametrize("model", ["full", "strictest"])
def test_a_bias_that_leaves_no_image_is_no_pass(requirement: Any, model: str) -> None:
    found = judged(
        requirements={"quadratic_phase_error": "170 deg", "location_error": requirement},
        autofocus={"n_pull": 20},
        allocation={"model": model},
        collection__aperture_time="0.5 s",
        **{RECEIVER: receiver("position", "1000 km", "1 m", axis=0)},
    )
    assert found.status in ("fail", "not_evaluated")
    location = location_of(found)
    assert location.status in ("fail", "not_evaluated")
    if model == "full":  # the published model displaces any point
        assert location.percentiles is None


@pytest.mark.parametrize("model", ["published", "full", "strictest"])
def test_a_bias_above_its_limit_fails_in_every_model(model: str) -> None:
    found = judged(allocation={"model": model}, **{RECEIVER: receiver("position", "300 m", "1 cm", axis=0)})
    assert found.status in ("fail", "not_evaluated")


def test_a_bias_lowers_the_peak_and_is_pulled_in_as_a_size() -> None:
    by_size, by_bias = (
        judged(autofocus={"n_pull": 2}, **{RECEIVER: receiver("velocity", "2 m/s", bias)})
        for bias in (None, "1 um/s")
    )
    assert by_size.peak_loss_db is not None
    assert by_size.peak_loss_db > 0.1
    assert by_bias.peak_loss_db == pytest.approx(by_size.peak_loss_db, rel=1e-2)
    sizes = [row(found, "mission.autofocus_pull_in").declared for found in (by_size, by_bias)]
    assert sizes[1] == pytest.approx(sizes[0], rel=1e-3)


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
def test_the_cubic_phase_of_a_bias_spreads_as_that_of_a_size(combine: str) -> None:
    by_size, by_bias = (
        row(
            judged(
                requirements={**PHASE, "islr": "-20 dB"}, allocation={"combine": combine}, other_errors=cubic(figure)
            ),
            "other.a.cubic_phase_error",
        )
        for figure in ("170 deg", {"sigma": "1e-3 deg", "bias": "170 deg"})
    )
    assert by_size.utilization is not None
    assert by_size.utilization > 4
    assert by_bias.utilization == pytest.approx(by_size.utilization, rel=1e-4)
    assert by_bias.allowable == 0.0


def test_a_small_cubic_bias_leaves_the_rest_of_the_power_to_sigma() -> None:
    changes: dict[str, Any] = {"requirements": {**PHASE, "islr": "-20 dB"}}
    limit = row(judged(other_errors=cubic("1 deg"), **changes), "other.a.cubic_phase_error").allowable
    assert limit is not None
    biased = cubic({"sigma": f"{0.8 * limit} rad", "bias": f"{0.6 * limit} rad"})
    found = row(judged(other_errors=biased, **changes), "other.a.cubic_phase_error")
    assert found.utilization == pytest.approx(1.0, rel=1e-6)  # 0.6² + 0.8² = 1
    assert found.allowable == pytest.approx(0.8 * limit, rel=1e-6)


@pytest.mark.parametrize(
    ("requirement", "figure"),
    [
        ("45 deg", receiver("velocity", "20 cm/s", "1 mm/s")),
        ({"limit": "45 deg", "confidence": "95 %"}, receiver("velocity", "20 cm/s")),
    ],
)
def test_the_named_n_pull_is_enough(requirement: Any, figure: Any) -> None:
    changes: dict[str, Any] = {"requirements": {"quadratic_phase_error": requirement}, RECEIVER: figure}
    found = row(judged(**changes), "receiver.quadratic_phase_error")
    assert found.reason is not None
    n_pull = float(str(found.reason).split("n_pull ")[1].split()[0].rstrip(".;,"))
    assert row(judged(autofocus={"n_pull": 1.02 * n_pull}, **changes), found.id).status != "fail"
    assert row(judged(autofocus={"n_pull": 0.95 * n_pull}, **changes), found.id).status == "fail"


def test_the_reason_names_the_bias_that_is_largest() -> None:
    found = row(judged(**{RECEIVER: receiver("position", "30 m", "1 cm", axis=0)}), "mission.location_error")
    assert "largest: receiver.position.x.bias" in str(found.reason)


def test_percentiles_are_those_of_the_model_that_judges() -> None:
    error = {
        "position": {"sigma": "0.5 m", "bias": ["1 m", "-1 m", "0.5 m"]},
        "velocity": {"sigma": "2 cm/s", "bias": ["1 cm/s", "0 m/s", "0 m/s"]},
    }
    limited = {"location_error": {"limit": "2 m", "confidence": "95 %"}}
    location = location_of(judged(requirements=limited, allocation={"model": "strictest"}, **{RECEIVER: error}))
    assert location.percentiles is not None
    assert location.percentiles["95"] == pytest.approx(location.reached, rel=1e-6)
