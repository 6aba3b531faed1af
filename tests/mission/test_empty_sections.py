"""An empty section declares nothing and hides nothing: it is refused, or read as if the file did not have it."""

import copy
import json
import math
from collections.abc import Iterator
from typing import Any

import pytest
import yaml

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import MISSION
from bisar_budget.mission.readers import ListOf, Section
from bisar_budget.report import Style, render
from tests.conftest import TODAY, mission_text
from tests.yaml_text import yaml_text

LINES = [{"amplitude": "1 g", "frequency": "50 Hz"}]
ERROR = {"position": "10 cm", "velocity": "2 mm/s", "acceleration": "10 ug", "vibration": {"sinusoidal": LINES}}
MISSION_TEXT = mission_text(
    platforms__transmitter__motion_error=ERROR,
    platforms__receiver__motion_error=ERROR,
    platforms__transmitter__oscillator={"power_law": {"h0": 1e-27}, "acceleration_sensitivity": "1e-8 /g"},
    platforms__receiver__oscillator={"power_law": {"h0": 1e-27}, "acceleration_sensitivity": "1e-8 /g"},
    timing_error={"constant": "1 ns", "linear": 1e-12},
    requirements={"location_error": "2 m", "pslr": "-20 dB", "islr": "-20 dB", "cubic_phase_error": "45 deg"},
)
TREE = yaml.safe_load(MISSION_TEXT)
DEPTH = 6  # of keys, which no section of the file reaches


def optional_keys(section: Section, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Paths of the optional sections, lists and mappings of a section, and of those within them."""
    for name, key in section.keys.items():
        here, nested = (*path, name), key.reader
        if name in section.defaults and may_be_empty(nested.schema({})):
            yield here
        if isinstance(nested, Section) and len(here) < DEPTH:
            yield from optional_keys(nested, here)


def may_be_empty(schema: dict[str, Any]) -> bool:
    """Whether a value may be an object or an array by its schema."""
    forms = [schema, *schema.get("anyOf", ()), *schema.get("allOf", ())]
    return any("$ref" in form or form.get("type") in ("object", "array") for form in forms)


def is_free(path: tuple[str, ...]) -> bool:
    """Whether the mission has nothing at a path."""
    section = TREE
    for key in path[:-1]:
        section = section.get(key, {})
    return path[-1] not in section


def with_item(path: tuple[str, ...], item: Any) -> str:
    """The mission with an item at a path, and the sections above it."""
    tree = copy.deepcopy(TREE)
    section = tree
    for key in path[:-1]:
        section = section.setdefault(key, {})
    section[path[-1]] = copy.deepcopy(item)
    return yaml_text(tree)


def answer(found: MissionFindings) -> Any:
    """All that the JSON of a check says, but for lines and the hash of the file."""
    document = json.loads(render("json", Report(version="0", missions=(found,)), Style()))
    return without_places(document)


def without_places(item: Any) -> Any:
    if isinstance(item, dict):
        return {key: without_places(value) for key, value in item.items() if key not in ("line", "sha256")}
    return [without_places(value) for value in item] if isinstance(item, list) else item


def check(text: str) -> MissionFindings:
    return check_mission(parse_mission(text, "mission.yaml"), TODAY)


PATHS = sorted({path for path in optional_keys(MISSION) if is_free(path)})


@pytest.fixture(scope="module")
def without_any() -> Any:
    return answer(check(MISSION_TEXT))


def test_the_walk_finds_sections_and_lists() -> None:
    """Those of the contract at least."""
    known = {".".join(path) for path in PATHS}
    assert {
        "platforms.receiver.oscillator.vibration",
        "platforms.receiver.oscillator.vibration.sinusoidal",
        "platforms.receiver.oscillator.vibration.spectrum",
        "platforms.receiver.motion_error.imu",
        "platforms.receiver.motion_error.lever_arm",
        "platforms.receiver.motion_error.random",
        "common_motion_error",
        "common_motion_error.random",
        "synchronization",
        "propagation",
        "propagation.transmitter",
        "other_errors",
        "scene",
        "simulation",
        "waivers",
    } <= known
    assert isinstance(MISSION.keys["waivers"].reader, ListOf)


@pytest.mark.parametrize("path", PATHS, ids=".".join)
@pytest.mark.parametrize("item", [{}, []], ids=["section", "list"])
def test_an_empty_section_is_refused_or_as_if_absent(path: tuple[str, ...], item: Any, without_any: Any) -> None:
    try:
        found = check(with_item(path, item))
    except MissionError:
        return
    assert answer(found) == without_any


@pytest.mark.parametrize("vibration", [{}, {"sinusoidal": []}], ids=["empty", "empty list"])
def test_an_empty_vibration_of_the_oscillator_hides_none_of_its_platform(vibration: dict[str, Any]) -> None:
    """With it PSLR was 21 %: the oscillator felt nothing."""
    tree = copy.deepcopy(TREE)
    tree["platforms"]["receiver"]["oscillator"]["vibration"] = vibration
    (pslr,) = [one for one in check(yaml_text(tree)).requirements if one.key == "pslr"]
    assert pslr.status == "fail"
    # 2 rad by 1e-8/g at 50 Hz, where Section V allows √(PSLR/2).
    assert pslr.utilization == pytest.approx(2 / math.sqrt(1e-2 / 2), rel=1e-6)
