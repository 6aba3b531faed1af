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
import yaml

import bisar_budget as bb
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.verdicts import with_verdicts
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.questions.outside import day_of
from bisar_budget.report.answers.verify_answer import geometry_remarks
from bisar_budget.simulator.realisations import drawn_errors
from bisar_budget.simulator.targets import parse_targets
from tests.conftest import ROOT, findings, mission_file, mission_text

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


@pytest.mark.parametrize("name", ["uav_stim300", "uav_free_running", "ocxo_free_running"])
def test_the_coverage_factor_is_in_the_time_series_of_sensors_and_clocks(name: str) -> None:
    mission = bb.load(mission_file(name))
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


def test_autofocus_gives_a_slow_vibration_no_larger_limit() -> None:
    """`verify` forms its image by the plain budget, whatever the gain: its phase is that of the worst moment."""
    shake = {"sinusoidal": [{"amplitude": "1 mm", "frequency": "0.1 Hz"}]}
    found = []
    for more in ({}, {"autofocus": {"n_pull": 2}}):
        mission = bb.loads(
            mission_text(
                platforms__receiver__motion_error={"vibration": shake}, allocation={"combine": "each"}, **more
            )
        )
        (row,) = bb.verify(mission, "receiver.vibration.sinusoidal.0").found.rows
        found.append(row)
    plain, helped = found
    assert plain.verdict == helped.verdict == "confirmed"
    assert helped.boundary_error == pytest.approx(plain.boundary_error, rel=1e-12)
    assert helped.measured_qpe_rad == pytest.approx(math.pi / 8, rel=0.01)  # half of π/4 is the receiver's


def test_verify_names_the_image_that_is_farthest_off() -> None:
    near, far = (
        Verdict(
            id=name, model="full", boundary_error=1.0, unit="m", displacement_full_m=(0.0, 0.0),
            measured_displacement_m=(by, 0.0), smear_azimuth_published_rad=0.0, measured_smear_azimuth_rad=by / 10,
        )
        for name, by in (("near", 0.1), ("far", 0.3))
    )  # fmt: skip
    for order in ((near, far), (far, near)):
        moved, turned = geometry_remarks(order)
        assert moved == "displacement of the images: within 300 mm of the full model, farthest far"
        assert turned == "smear of the images: within 1.7 deg of (31), farthest far"


def test_what_a_cubic_shares_with_the_quadratic_is_drawn_once() -> None:
    """A wrong attitude in a turn makes a quadratic and a cubic phase that go together, and a displacement.

    Of 40000 draws a sigma is known to 0.35 %, four of which are 1.4 %; rows of `check` have theirs by integrals.
    """
    path = MISSIONS / "standard_rate_turn.yaml"
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    for platform in document["platforms"].values():
        platform.pop("motion_error", None)
    document.pop("timing_error")
    document["platforms"]["receiver"]["motion_error"] = {"imu": {"attitude": "0.05 deg"}}
    document["requirements"] |= {"cubic_phase_error": "0.1 deg", "location_error": "1 m"}
    mission = bb.loads(yaml.safe_dump(document))
    row = bb.check(mission)["receiver.imu.attitude"]
    drawn = {one.id: one.sigma for one in bb.monte_carlo(mission, 40_000).found.requirements}
    assert drawn["receiver.quadratic_phase_error"] == pytest.approx(row.qpe_full_rad, rel=0.014)
    assert drawn["mission.cubic_phase_error"] == pytest.approx(row.cubic_rad, rel=0.014)


def test_a_clock_is_the_receivers_where_another_error_is_relaxed() -> None:
    """Its own row is what a smaller share of the receiver leaves least of."""
    mission = bb.loads(
        mission_text(
            platforms__transmitter__motion_error={"velocity": [0, "8 mm/s", 0]},
            platforms__receiver__motion_error={"velocity": ["1 mm/s", 0, 0]},
            timing_error__quadratic="2e-13 1/s",
            allocation={"split": "balanced", "combine": "each", "model": "published"},
        )
    )
    (relaxed,) = [
        one
        for one in bb.sensitivity(mission).found.relaxed
        if one.key == "platforms.transmitter.motion_error.velocity"
    ]
    assert relaxed.shares_after[1] < relaxed.shares_before[1]
    assert relaxed.receiver[0] == "timing.quadratic"


def test_a_tecu_is_a_delay_of_40_3e16_over_f_squared() -> None:
    """ITU-R P.531: an excess path of 40.3·N/f² m, N in 1/m²; at 1 GHz and overhead 0.403 m for a TECU."""
    mission = bb.loads(
        mission_text(
            radar={"center_frequency": "1 GHz", "bandwidth": "10 MHz"},
            platforms__transmitter={"position": [0, 0, "30 km"], "velocity": [0, "150 m/s", 0]},
            propagation={"transmitter": {"zenith_electron_content": "1 TECU"}},
        )
    )
    leg = mission.propagation.leg("transmitter")
    assert 40.3 * leg.zenith_electron_content / 1e9**2 == pytest.approx(0.403, rel=1e-9)


@pytest.mark.parametrize(
    ("receiver", "is_refused"), [(0.501, True), (0.499, True), (0.5, False), (0.5 + 5e-7, False)]
)
def test_shares_that_miss_1_by_a_thousandth_are_refused(receiver: float, is_refused: bool) -> None:
    text = mission_text(allocation={"split": {"transmitter": 0.5, "receiver": receiver}})
    if not is_refused:
        assert bb.loads(text)
        return
    with pytest.raises(bb.MissionError, match="shares must sum to 1"):
        bb.loads(text)


def test_a_requirement_that_an_image_refutes_keeps_its_own_unit() -> None:
    """The row that fails by its image is in m/s; the requirement is in rad, and stays what the file states."""
    found = findings(platforms__receiver__motion_error={"velocity": [0, "2 mm/s", 0], "acceleration": "50 um/s^2"})
    (before,) = found.requirements
    shown = next(row for row in found.rows if row.id == "receiver.velocity.y")
    assert before.row != shown.id
    verdict = Verdict(
        id=shown.id, model="published", boundary_error=shown.allowable or 0.0, unit="m/s", verdict="optimistic"
    )
    (after,) = with_verdicts(found, VerifiedMission(found.file, found.name, rows=(verdict,))).requirements
    assert (after.status, after.row, after.share) == ("fail", shown.id, None)
    assert (after.allowed, after.reached, after.unit) == (before.allowed, before.reached, "rad")
    assert after.utilization == shown.utilization


@pytest.mark.parametrize(("combine", "words"), [("rss", "root-sum-square"), ("sum", "worst-case sum")])
def test_the_specification_sheet_says_how_errors_add_up(run: Callable, combine: str, words: str) -> None:
    file = str(MISSIONS / "holdover_roof_receiver.yaml")
    for format_name in ("text", "markdown"):
        arguments = ("allocate", file, "--set", f"allocation.combine={combine}", "--format", format_name)
        said = " ".join(run(*arguments).stdout.split())
        other = {"root-sum-square", "worst-case sum"} - {words}
        assert words in said
        assert not any(one in said for one in other)
