"""Words of a specification sheet in which other errors leave no room: what it advises is what it then takes."""

import re

import pytest

import bisar_budget as bb
from bisar_budget.findings.specification import Broken
from bisar_budget.mission.load import parse_mission
from bisar_budget.report import Style
from bisar_budget.report.answers import written
from tests.conftest import TODAY, mission_text

KEYS = {"platforms.receiver.motion_error.velocity": 1.0}
MISSION = mission_text(
    platforms__transmitter__motion_error={"velocity": "40 mm/s"},
    platforms__receiver__motion_error={"velocity": "1 mm/s"},
    allocation={"model": "full", "combine": "rss"},
)


def text_of(found) -> str:
    return " ".join(str(written("allocate", "text", [(found, None)], Style())).split())


def sheet(reserve: float):
    return bb.allocate(parse_mission(MISSION), keys=KEYS, reserve=reserve, date=TODAY).found


@pytest.mark.parametrize("used", [0.4, 0.5, 0.87654, 0.95, 0.9989, 0.99951, 0.999995, 0.9999985])
def test_a_reserve_that_is_advised_leaves_room(used: float) -> None:
    """`--reserve 0% or less` was advised where other errors use all of a limit but a millionth."""
    broken = sheet(0.0)._replace(broken=(Broken("mission.islr", "islr", used, 0.3),))
    found = re.search(r"--reserve ([\d.]+)% or less", text_of(broken))
    assert found is not None
    assert used < (1 - float(found[1]) / 100) * (1 - 1e-6)


@pytest.mark.parametrize("used", [0.9999991, 0.99999999, 1.0, 1.5])
def test_no_reserve_is_advised_where_there_is_no_room(used: float) -> None:
    broken = sheet(0.0)._replace(broken=(Broken("mission.islr", "islr", used, 1.0),))
    text = text_of(broken)
    assert "--reserve" not in text
    assert "99.99" not in text


def test_the_advice_of_a_mission_is_taken() -> None:
    refused = sheet(0.9)
    assert refused.broken
    advised = re.search(r"--reserve ([\d.]+)% or less", text_of(refused))
    assert advised is not None
    assert not sheet(float(advised[1]) / 100).broken
