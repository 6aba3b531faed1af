"""Missions of one shape are judged together: what is found of each is what a check of it alone finds."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import astuple
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from bisar_budget.budget.check import check_mission, check_missions
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import SetValue
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import DecidingShare
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError, with_number
from bisar_budget.mission.stacked import stacked
from bisar_budget.questions.varied import scaled
from bisar_budget.ranges.exact_ranges import POINT_SETTINGS
from bisar_budget.ranges.limit_search import LIMIT_FRACTION
from tests.conftest import ROOT, mission_text, seeds
from tests.families import FAMILIES
from tests.families import mission_text as of_family

DAY = date(2026, 1, 1)
EXAMPLES = [
    *sorted((ROOT / "specs" / "missions").glob("*.yaml")),
    ROOT / "tests" / "acceptance" / "good" / "every_key.yaml",
]


def with_errors_times(mission: Mission, factor: float) -> Mission:
    for name in PLATFORMS:
        with suppress(QuestionError):  # of one that declares none
            mission = scaled(mission, f"platforms.{name}.motion_error", factor)
    return mission


def variants(mission: Mission) -> list[Mission]:
    """The mission with other errors, and at another frequency: some pass, some fail, some leave no image."""
    errors = [with_errors_times(mission, factor) for factor in (1.0, 0.01, 30.0, 1e4)]
    frequency = mission.radar.center_frequency
    return [with_number(one, "radar.center_frequency", frequency * part) for one in errors for part in (1.0, 1.3)]


def assert_alike(one: Any, other: Any, where: str) -> None:
    """Words and statuses are the same, and numbers but for what searches leave: 1e-5 of a limit, and 3e-5 rad.

    Where an image ends at a fold the way of its point is lost, and the size at which it ends is known to 1e-3.
    """
    if one == other:
        return
    if isinstance(one, float) and isinstance(other, float):
        # A phase of 1e-10 rad is what terms cancel to.
        room = (100 if "allowable" in where else 2) * LIMIT_FRACTION
        floor = POINT_SETTINGS.last_step_rad if where.endswith("_rad") else 1e-9
        assert other == pytest.approx(one, rel=room, abs=floor, nan_ok=True), where
    elif isinstance(one, DecidingShare) and isinstance(other, DecidingShare):
        assert_alike(astuple(one), astuple(other), where)
    elif isinstance(one, dict) and isinstance(other, dict):  # percentiles
        assert one.keys() == other.keys(), where
        for key, value in one.items():
            assert_alike(value, other[key], f"{where}.{key}")
    elif isinstance(one, tuple) and isinstance(other, tuple):
        assert len(one) == len(other), where
        for place, parts in enumerate(zip(one, other, strict=True)):
            assert_alike(*parts, f"{where}.{getattr(one, '_fields', range(len(one)))[place]}")
    else:
        raise AssertionError(f"{where}: {one!r} is not {other!r}")


def assert_found_alike(missions: Sequence[Mission]) -> list[MissionFindings]:
    found = dict(check_missions(missions, DAY))
    assert sorted(found) == list(range(len(missions)))
    for place, mission in enumerate(missions):
        alone = check_mission(mission, DAY)
        assert alone.confidence == found[place].confidence
        for name in ("rows", "requirements", "warnings", "notes", "allocation", "scene", "resolution", "model_doubt"):
            assert_alike(getattr(alone, name), getattr(found[place], name), f"{place} {name}")
    return [found[place] for place in range(len(missions))]


# Of four errors at two frequencies each error at one, by turns, and in a thorough run all eight.
BY_TURNS, ALL = (0, 3, 4, 7), range(8)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
@pytest.mark.parametrize("chosen", [BY_TURNS, pytest.param(ALL, marks=pytest.mark.thorough)], ids=["four", "all"])
def test_of_each_example(path: Path, chosen: Sequence[int]) -> None:
    every = variants(load_mission(str(path)))
    missions = [every[place] for place in chosen]
    assert len(list(stacked(missions))) == 1
    found = assert_found_alike(missions)
    assert len({row.status for one in found for row in one.rows}) > 2


@pytest.mark.parametrize("seed", seeds(3, 1))
def test_of_missions_of_many_shapes_at_once(seed: int) -> None:
    missions = [
        one
        for family in FAMILIES
        for one in variants(parse_mission(of_family(family, seed).encode(), f"{family}.yaml"))[:3]
    ]
    assert 1 < len(list(stacked(missions))) < len(missions)
    assert_found_alike(missions)


def test_what_only_names_a_mission_is_no_part_of_its_shape() -> None:
    """Each keeps its own name, lines, ids of requirements and waivers of rows that it has."""
    texts = [
        mission_text(name="a", requirement_ids={"transmitter.velocity.x": "REQ-1"}),
        "# one line more\n" + mission_text(name="b", document={"number": "7"}),
    ]
    missions = [parse_mission(text.encode(), f"{place}.yaml") for place, text in enumerate(texts)]
    assert len(list(stacked(missions))) == 1
    first, second = (dict(check_missions(missions, DAY))[place] for place in (0, 1))
    assert (first.name, second.name, first.file, second.file) == ("a", "b", "0.yaml", "1.yaml")
    ids = [{row.id: row.requirement_id for row in one.rows} for one in (first, second)]
    assert (ids[0]["transmitter.velocity.x"], ids[1]["transmitter.velocity.x"]) == ("REQ-1", None)
    lines = [[row.line for row in one.rows if row.line is not None] for one in (first, second)]
    assert lines[0] != lines[1]


def test_places_of_scenes_on_the_earth_differ() -> None:
    """Axes there were those of numbers: gravity of many scenes pointed anywhere."""
    path = str(ROOT / "specs" / "missions" / "sentinel1_aircraft_log.yaml")
    places = ["48.0866", "48.0876"]
    missions = [load_mission(path, None, [SetValue("scene.latitude", f"{one} deg")]) for one in places]
    assert len(list(stacked(missions))) == 1
    assert_found_alike(missions)


def test_a_waiver_holds_for_its_own_mission_only() -> None:
    waiver = {"id": "transmitter.velocity.*", "until": "2027-01-01", "reason": "known"}
    error = {"platforms__transmitter__motion_error__velocity": ["1 m/s", "1 m/s", "1 m/s"]}
    texts = [mission_text(**error), mission_text(**error, waivers=[waiver])]
    missions = [parse_mission(text.encode(), "m.yaml") for text in texts]
    found = assert_found_alike(missions)
    waived = [{row.id for row in one.rows if row.status == "waived"} for one in found]
    assert not waived[0]
    assert waived[1]


def test_the_confidence_is_that_of_each() -> None:
    """An error of 0 has no part in it, whichever mission is judged first."""
    still, moving = (
        parse_mission(
            mission_text(
                platforms__transmitter__motion_error={"velocity": size, "distribution": "uniform"},
                platforms__receiver__motion_error={"velocity": "1 mm/s"},
            ),
            "m.yaml",
        )
        for size in ("0 m/s", "1 mm/s")
    )
    for missions in ([still, moving], [moving, still]):
        assert len(list(stacked(missions))) == 1
        found = assert_found_alike(missions)
        assert found[0].confidence != found[1].confidence
