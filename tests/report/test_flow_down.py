"""Specifications as requirements below those of the mission, in needs.json and for StrictDoc."""

import json
import re

import pytest

from tests.conftest import mission_text

IDS = {
    "mission.location_error": "SYS-LOC-1",
    "receiver.quadratic_phase_error": "SYS-QPE-2",
    "receiver.velocity.x": "SYS-NAV-3",
}
VELOCITY = "SPEC_SYS_12_PLATFORMS_RECEIVER_MOTION_ERROR_VELOCITY"


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(
        mission_text(
            allocation={"combine": "rss", "model": "full"},
            requirements__location_error="20 m",
            requirement_ids=IDS,
            document={"number": "SYS-12"},
        )
    )
    return path


def test_a_need_links_to_the_requirements_that_it_derives_from(run, mission) -> None:
    (version,) = json.loads(run("allocate", mission, "--format", "needs").stdout)["versions"].values()
    need = version["needs"][VELOCITY]
    assert version["needs_amount"] == 7
    assert need["type"] == "req"
    assert set(need["links"]) == set(IDS.values())
    assert "shall be at most" in need["content"].replace("\\", "")
    assert re.fullmatch("[A-Z0-9_]{5,}", need["id"])


def test_a_document_of_strictdoc_has_a_requirement_for_each_with_its_parents(run, mission) -> None:
    text = run("allocate", mission, "--format", "sdoc").stdout
    blocks = text.split("[REQUIREMENT]\n")[1:]
    assert len(blocks) == 7
    (one,) = [block for block in blocks if block.startswith(f"UID: {VELOCITY}\n")]
    fields = [line.partition(":")[0] for line in one.splitlines() if line and not line.startswith(("-", " "))]
    assert fields == ["UID", "TITLE", "STATEMENT", "RATIONALE", "RELATIONS"]
    assert set(re.findall("VALUE: (.*)", one)) == set(IDS.values())
    assert text.startswith("[DOCUMENT]\nTITLE: ")


def test_what_has_no_id_in_the_project_has_no_parent(run, mission) -> None:
    mission.write_text(mission_text(allocation={"combine": "rss", "model": "full"}))
    assert "VALUE" not in run("allocate", mission, "--format", "sdoc").stdout
    (version,) = json.loads(run("allocate", mission, "--format", "needs").stdout)["versions"].values()
    assert not any(need["links"] for need in version["needs"].values())
