"""Declared errors of a mission together."""

import math

import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.mission.load import parse_mission
from tests.conftest import mission_text
from tests.families import mission_text as family_text


@pytest.mark.parametrize("rule", ["each", "sum", "rss"])
def test_beside_an_error_without_an_image_no_displacement_is_listed(rule: str) -> None:
    """No sum has a value then, and an explanation writes none out."""
    text = family_text("aircraft", 3).replace("combine: each", f"combine: {rule}")  # its image ends at 10.8 m of 30 m
    together = Analysis(parse_mission(text)).together("full")
    assert together.rule == rule
    assert any(math.isinf(one.qpe_rad[0]) for one in together.phases)
    assert math.isnan(together.moved(rule)[0])
    assert together.displacement_parts() == []


def test_what_combines_is_listed_for_the_only_case() -> None:
    text = mission_text(timing_error__constant="1 ns", platforms__receiver__motion_error={"position": [3, 0, 0]})
    parts = dict(Analysis(parse_mission(text)).together("full").displacement_parts())
    assert math.hypot(*parts["receiver.position.x"]) > 0
    assert parts["timing.constant"] != (0.0, 0.0)


@pytest.mark.parametrize(("sizes", "share"), [((1, 3), 0.25), ((3, 1), 0.75), ((1e6, 0), 0.95), ((0, 0), 0.5)])
def test_balanced_shares_are_as_the_phases(sizes: tuple[float, float], share: float) -> None:
    """Mirror images of each other: the same velocity error has the same phase."""
    platforms = {
        name: {
            "position": [f"{side} km", "0 km", "6 km"],
            "velocity": [0, "100 m/s", 0],
            "motion_error": {"velocity": [0, f"{size} um/s", 0]},
        }
        for name, side, size in (("transmitter", 20, sizes[0]), ("receiver", 20, sizes[1]))
    }
    found = Analysis(parse_mission(mission_text(platforms=platforms, allocation__split="balanced"))).allocation.qpe
    assert found.transmitter == pytest.approx(share)
    assert found.transmitter + found.receiver == pytest.approx(1)
    assert isinstance(found.transmitter, float)
