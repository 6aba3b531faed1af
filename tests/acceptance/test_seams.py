"""The seams between the numbers and a user: exit codes, columns, statuses, days, intervals.

Each holds one slip that no other test found: the list of `tests/mutants.py` names it.
"""

import csv
import io
import json
import math
import os
import time
from collections.abc import Callable
from datetime import UTC, date, datetime
from statistics import NormalDist

import numpy as np
import pytest

import bisar_budget as bb
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.front.checks import day_of
from bisar_budget.simulator.realisations import drawn_errors
from bisar_budget.simulator.targets import parse_targets
from tests.conftest import ROOT, mission_text

MISSIONS = ROOT / "specs" / "missions"
SECTION_V, TANDEM_X, DRONES = (
    str(MISSIONS / f"{name}.yaml") for name in ("rigling_moses_section_v", "tandem_x", "drones_same_gnss")
)


@pytest.mark.parametrize("files", [(SECTION_V, TANDEM_X), (TANDEM_X, SECTION_V)])
def test_one_optimistic_mission_of_several_breaks_verify(run: Callable, files: tuple[str, str]) -> None:
    found = run("verify", *files, "--only", "receiver.velocity.y", "--jobs", "1", "--format", "json")
    verdicts = [mission["rows"][0]["verdict"] for mission in json.loads(found.stdout)["missions"]]
    assert sorted(verdicts) == ["confirmed", "optimistic"]
    assert found.exit_code == 1


def test_columns_of_the_csv_are_the_fields_of_the_json(run: Callable) -> None:
    """Both allowables too, which differ here: the receiver's velocity by 6 %."""
    lines = csv.DictReader(io.StringIO(run("check", SECTION_V, "--format", "csv").stdout))
    (mission,) = json.loads(run("check", SECTION_V, "--format", "json").stdout)["missions"]
    rows, apart = {row["id"]: row for row in mission["rows"]}, 0
    for line in lines:
        if line["id"].startswith("requirement."):
            continue
        row = rows[line["id"]]
        for name in ("allowable", "allowable_published", "allowable_full", "utilization"):
            given = math.nan if row[name] is None else row[name]
            assert float(line[name] or "nan") == pytest.approx(given, rel=1e-12, nan_ok=True)
        apart += row["allowable_published"] != row["allowable_full"]
    assert apart > 5


@pytest.mark.parametrize(("until", "is_suppressed"), [("2026-11-21", True), ("2026-11-20", False)])
def test_only_a_waiver_that_holds_suppresses(run: Callable, tmp_path, until: str, is_suppressed: bool) -> None:
    waiver = {"id": "receiver.velocity.y", "until": until, "reason": "ECR-17"}
    error = {"velocity": ["0 m/s", "1 m/s", "0 m/s"]}
    path = tmp_path / "mission.yaml"
    path.write_text(mission_text(platforms__receiver__motion_error=error, waivers=[waiver]), encoding="utf-8")
    log = json.loads(run("check", path, "--format", "sarif", "--date", "2026-11-21").stdout)["runs"][0]
    (result,) = [one for one in log["results"] if "receiver.velocity.y" in json.dumps(one["message"])][:1]
    assert ("suppressions" in result) == is_suppressed


def test_what_passes_by_autofocus_alone_is_a_result_of_sarif(run: Callable) -> None:
    file = str(MISSIONS / "rigling_moses_section_v_autofocus.yaml")
    (mission,) = json.loads(run("check", file, "--format", "json").stdout)["missions"]
    rows = [row["id"] for row in mission["rows"] if row["status"] == "pass_with_autofocus"]
    assert rows
    (log,) = json.loads(run("check", file, "--format", "sarif").stdout)["runs"]
    said = json.dumps(log["results"])
    assert all(row in said for row in rows)


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="no time zones here")
@pytest.mark.parametrize("zone", ["Pacific/Kiritimati", "Etc/GMT+12"])
def test_the_day_of_an_epoch_is_that_of_utc(monkeypatch: pytest.MonkeyPatch, zone: str) -> None:
    """14 hours before UTC, and 12 after: half an hour before midnight, and after."""
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    try:
        for hour, minute in ((23, 30), (0, 30)):
            instant = datetime(2026, 7, 14, hour, minute, tzinfo=UTC)
            monkeypatch.setenv("SOURCE_DATE_EPOCH", str(int(instant.timestamp())))
            assert day_of(None) == date(2026, 7, 14)
    finally:
        os.environ.pop("TZ")
        time.tzset()


def test_a_grid_has_its_columns_along_east() -> None:
    targets = parse_targets("grid:3x2:10 m")
    assert sorted({one.east for one in targets.points}) == [-10, 0, 10]
    assert sorted({one.north for one in targets.points}) == [-5, 5]


def test_an_interval_of_95_percent_is_that() -> None:
    """Wilson's score by the quantile of Python's own normal distribution."""
    found = bb.monte_carlo(bb.load(DRONES), 4000, seed=3)
    p, n, z = found.probability, found.draws, NormalDist().inv_cdf(0.975)
    middle, half = p + z**2 / (2 * n), z * (p * (1 - p) / n + z**2 / (4 * n**2)) ** 0.5
    assert 0.9 < p < 0.99
    assert (found.probability_low, found.probability_high) == pytest.approx(
        ((middle - half) / (1 + z**2 / n), (middle + half) / (1 + z**2 / n)), rel=1e-12
    )
    assert found.confidence == 0.95


@pytest.mark.parametrize("name", ["uav_stim300", "ocxo_free_running"])
def test_the_coverage_factor_is_in_the_time_series_of_sensors_and_clocks(name: str) -> None:
    mission = bb.load(MISSIONS / f"{name}.yaml")
    once, twice = (
        drawn_errors(Analysis(one)) for one in (mission, mission.replace({"allocation.coverage_factor": 2}))
    )
    pairs = [(once.receiver.course, twice.receiver.course), (once.clock_course, twice.clock_course)]
    known = [(a.values, b.values) for a, b in pairs if a is not None and b is not None]
    assert known
    for a, b in known:
        assert np.abs(a).max() > 0
        assert b == pytest.approx(2 * a, rel=1e-9)


def test_noise_is_a_power() -> None:
    """With 20 dB less of it, every pixel has a tenth of its amplitude, by one seed."""
    mission = bb.load(SECTION_V).replace({"collection.pulses": 200})
    clean, loud, soft = (
        bb.simulate(one).image
        for one in (mission, *(mission.replace({"simulation.noise": f"{level} dB"}) for level in (-20, -40)))
    )
    assert np.abs(loud - clean).max() > 1e-4
    # Images are sums in single precision.
    assert np.abs(loud - clean - 10 * (soft - clean)).max() < 1e-2 * np.abs(loud - clean).max()
