"""Missions that should not pass, and the one that they are made from: `adversary.yaml`."""

import copy
from pathlib import Path
from typing import Any

import pytest
import yaml

import bisar_budget as bb

LIST = yaml.safe_load(Path(__file__).with_name("adversary.yaml").read_text(encoding="utf-8"))
CASES = {case["name"]: case for case in LIST["cases"]}


def changed(change: dict[str, Any]) -> str:
    document = copy.deepcopy(LIST["base"])
    for key, value in change.items():
        *sections, last = key.split(".")
        place = document
        for section in sections:
            place = place.setdefault(section, {})
        if value is None:
            del place[last]
        else:
            place[last] = value
    return yaml.safe_dump(document)


def test_the_base_passes() -> None:
    assert len(CASES) == len(LIST["cases"]) > 100
    found = bb.check(bb.loads(changed({})))
    assert (found.status, found.exit_code) == ("pass", 0)


@pytest.mark.parametrize("name", CASES)
def test_a_mission_that_should_not_pass(name: str) -> None:
    case = CASES[name]
    if case["status"] == "error":
        with pytest.raises(bb.MissionError) as caught:
            bb.loads(changed(case["change"]))
        assert caught.value.faults[0].key in case["by"]
        return
    found = bb.check(bb.loads(changed(case["change"])))
    assert found.status == case["status"]
    assert found.exit_code == (0 if found.status == "warn" else 1)
    broken = [key for key, one in found.requirements.items() if one.status in ("fail", "not_evaluated", "warn")]
    assert (broken or sorted(row for row in found if found[row].status == found.status)[:1]) == case["by"]
