"""What a mission names travels with it: a worker elsewhere reads the same mission without any of its files."""

import shutil
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.faults import SetValue
from bisar_budget.mission.load import load_mission, named_by
from bisar_budget.mission.quantities import tree_of
from bisar_budget.questions.asked import Asked, part_of
from bisar_budget.questions.cases import grid, words_of
from tests.conftest import ROOT, UAV_FREE_RUNNING

MISSIONS = ROOT / "specs" / "missions"


@pytest.fixture
def missions(tmp_path: Path) -> Path:
    shutil.copytree(MISSIONS, tmp_path / "missions")
    shutil.copy(UAV_FREE_RUNNING, tmp_path / "missions")
    return tmp_path / "missions"


@pytest.mark.parametrize(
    ("name", "paths", "parts"),
    [
        ("sentinel1_aircraft_log", 2, 0),
        ("uav_free_running", 0, 2),
        ("uav_stim300", 0, 2),
        ("rigling_moses_section_v", 0, 0),
    ],
)
def test_cases_are_checked_without_the_files(missions: Path, name: str, paths: int, parts: int) -> None:
    text = (missions / f"{name}.yaml").read_text(encoding="utf-8")
    if parts:  # a part of the project's own
        shutil.copy(ROOT / "specs" / "sensors" / "stim300.yaml", missions / "own.yaml")
        text = text.replace("sensor: [stim300,", "sensor: [own.yaml,").replace("sensor: stim300", "sensor: own.yaml")
        assert "own.yaml" in text
        (missions / f"{name}.yaml").write_text(text, encoding="utf-8")
    mission = load_mission(str(missions / f"{name}.yaml"))
    named = named_by(mission)
    assert (len(named.paths), len({of for of, _, _ in named.parts})) == (paths, parts)
    assert bool(named.sha256) == bool(paths or parts)
    cases = grid(tree_of(mission), ["radar.bandwidth=50,100 MHz"])
    asked = Asked(mission, cases, today=date(2026, 1, 1))
    (here,) = asked.swept(asked.shared_out([0], 1)).parts
    shutil.rmtree(missions)
    there = part_of(asked.question._replace(named=named), (0, 2, cases.values(0, 2)))
    assert "error" not in here.values["status"]
    for column, values in here.values.items():
        np.testing.assert_array_equal(there.values[column], values)


def test_what_the_words_of_a_sweep_name_is_taken_along(missions: Path) -> None:
    for name in ("one", "other"):
        shutil.copy(ROOT / "specs" / "sensors" / "stim300.yaml", missions / f"{name}.yaml")
    file = missions / UAV_FREE_RUNNING.name
    loaded = load_mission(str(file))
    cases = grid(
        tree_of(loaded), ["platforms.receiver.motion_error.sensor.0=one.yaml,other.yaml", "radar.bandwidth=50MHz"]
    )
    words = [SetValue(one.key, word) for one, several in words_of(cases) for word in several]
    named = named_by(loaded, [*words, SetValue("radar.bandwidth", "1 s")])
    assert {"one.yaml", "other.yaml"} < {name for name, _, _ in named.parts}
    asked = Asked(loaded, cases, today=date(2026, 1, 1))
    assert asked.travelling.named == named
    shutil.rmtree(missions)
    there = part_of(asked.question._replace(named=named), (0, 2, cases.values(0, 2)))
    assert "error" not in there.values["status"]
    assert there.values["utilization"][0] == there.values["utilization"][1] > 0


def test_the_hash_is_of_every_name_and_content(missions: Path) -> None:
    file = missions / "sentinel1_aircraft_log.yaml"
    before = named_by(load_mission(str(file)))
    assert named_by(load_mission(str(file))).sha256 == before.sha256
    log = missions / "paths" / "oberpfaffenhofen_made_up.csv"
    log.write_bytes(log.read_bytes() + b"\n")
    assert named_by(load_mission(str(file))).sha256 != before.sha256
