"""What commands and reports say of verdicts: exit codes, statuses that they change, words, conditions."""

import csv
import json
import math
import re

import pytest
from click.testing import CliRunner

from bisar_budget.budget.verdicts import with_verdicts
from bisar_budget.cli import cli
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.findings.status import exit_code
from bisar_budget.report import Style
from bisar_budget.report.answers import verify_answer as verification
from bisar_budget.report.answers.verify_answer import evidence, numbers
from bisar_budget.report.renderers.text import lines as text_lines
from bisar_budget.verifier.limits import verify_mission
from tests.conftest import TODAY, findings, mission_text
from tests.conftest import row as row_of
from tests.verify.test_verify import SECTION_V, verdicts

SAID = "one sigma of 4000 time series"


@pytest.fixture
def one_row_verified(monkeypatch):
    """Let `check --verify` form the images of some rows alone: what is held here is what one of them does."""

    def only(rows: str) -> None:
        monkeypatch.setattr(
            "bisar_budget.questions.verify.verify_all",
            lambda missions, *_: [verify_mission(mission, rows) for mission in missions],
        )

    return only


def _verified(*rows: Verdict) -> VerifiedMission:
    return VerifiedMission(file="mission.yaml", name="base", rows=rows)


class TestNothingVerified:
    """A gate on whose limits no image gave a verdict has verified nothing, and does not pass."""

    @pytest.fixture
    def too_few_pulses(self, tmp_path):
        path = tmp_path / "mission.yaml"
        path.write_text(mission_text(collection__pulses=20, timing_error={"constant": "1 ps"}), encoding="utf-8")
        return path

    def test_verify_exits_with_2_and_says_so(self, run, too_few_pulses) -> None:
        result = run("verify", too_few_pulses)
        assert result.exit_code == 2
        assert "mission.yaml: nothing was verified: 9 rows with a limit" in result.stderr
        assert "aliases below" in result.stdout  # the reasons
        document = json.loads(run("verify", too_few_pulses, "--format", "json").stdout)
        assert document["missions"][0]["status"] == "not_evaluated"

    def test_unverified_wins_over_optimistic(self, run, too_few_pulses) -> None:
        assert run("verify", SECTION_V, too_few_pulses, "--only", "receiver.velocity.y").exit_code == 2

    def test_check_warns_and_fails(self, run, too_few_pulses) -> None:
        plain = run("check", too_few_pulses, "--verify")
        assert plain.exit_code == 1
        assert "warning: " in plain.stdout
        assert "nothing was verified: 9 rows" in plain.stdout
        assert "NOT EVAL " in plain.stdout
        assert run("check", too_few_pulses, "--verify", "--strict").exit_code == 1
        assert run("check", too_few_pulses, "--strict").exit_code == 0  # no images were asked for

    def test_one_verdict_is_enough(self, run) -> None:
        """Other phases and root-sum-squares never have an image: they do not fail a mission that was verified."""
        verdict = Verdict(id="timing.quadratic", model="published", boundary_error=1.0, unit="1/s")
        unknown = _verified(verdict)
        assert unknown.status == "not_evaluated"
        assert with_verdicts(findings(), unknown).status == "not_evaluated"
        confirmed = _verified(verdict, verdict._replace(verdict="confirmed"))
        assert (confirmed.status, confirmed.doubt) == ("pass", "")
        declared = findings(timing_error={"constant": "1 ps"})
        assert with_verdicts(declared, confirmed).status == declared.status == "pass"


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Section V checked with images once, in every format that is read here."""
    folder = tmp_path_factory.mktemp("verified")
    names = [folder / f"r.{suffix}" for suffix in ("txt", "csv", "json")]
    options = [part for name in names for part in ("--report", str(name))]
    CliRunner().invoke(cli, ["check", str(SECTION_V), "--verify", *options])
    return [name.read_text(encoding="utf-8") for name in names]


class TestCheckWithImages:
    def test_json_carries_the_verdicts_and_a_row_says_when_its_limit_is_optimistic(self, reports) -> None:
        (mission,) = json.loads(reports[2])["missions"]
        verdict = {row["id"]: row["verdict"] for row in mission["verification"]}
        assert verdict["receiver.velocity.y"] == "optimistic"
        row = next(row for row in mission["rows"] if row["id"] == "receiver.velocity.y")
        assert row["status"] == "not_declared"
        assert any("0.417 rad at it, the budget is 0.392 rad" in note for note in row["notes"])

    @pytest.mark.parametrize(("declared", "status"), [(0.001, "pass"), (0.0390, "pass"), (0.0405, "warn")])
    def test_a_declared_row_whose_limit_its_image_refutes_fails_the_check(
        self, run, tmp_path, one_row_verified, declared, status
    ) -> None:
        """The published limit is 41.7 mm/s, the true one 6 % less: 39.3 mm/s, which the full model knows."""
        one_row_verified("receiver.velocity.y")
        error = f"    motion_azimuth: 135 deg\n    motion_error: {{velocity: [0, {declared}, 0]}}\n"
        text = SECTION_V.read_text(encoding="utf-8").replace("    motion_azimuth: 135 deg\n", error)
        text = text.replace("0.005 m/s^2", "1e-6 m/s^2")
        text = text.replace("allocation:\n", "allocation:\n  warn_above: 1\n")
        path = tmp_path / "mission.yaml"
        path.write_text(text, encoding="utf-8")
        found = []
        for more in ((), ("--verify",)):
            result = run("check", path, *more, "--format", "json")
            (mission,) = json.loads(result.stdout)["missions"]
            (row,) = [row for row in mission["rows"] if row["id"] == "receiver.velocity.y"]
            found.append((row["status"], mission["status"], result.exit_code))
        assert found == [(status, status, 0), ("fail", "fail", 1)]
        said = (
            "inside its limit of 41.7 mm/s, which images refute: the image shows 0.417 rad at it, the budget is 0.392"
        )
        assert row["reason"].startswith(said)
        (requirement,) = mission["requirements"]
        assert (requirement["status"], requirement["row"]) == ("fail", "receiver.velocity.y")

    @pytest.mark.parametrize("share", [0.02, 0.78])
    @pytest.mark.parametrize(("verdict", "status"), [("confirmed", "pass"), ("optimistic", "fail")])
    def test_a_declared_row_whose_limit_the_image_refutes_fails(
        self, verdict: str, status: str, share: float
    ) -> None:
        """However little of the limit is declared: a limit that is not true has not been held to anything."""
        vibration = {"wideband": {"rms": share * 0.03 / (2 * math.pi) * math.sqrt(0.005)}}
        found = findings(requirements__islr=-20, platforms__receiver__motion_error={"vibration": vibration})
        shown = Verdict(
            id="receiver.vibration.wideband", model="published", boundary_error=337.6e-6, unit="m",
            requirement_db=-20,
            measured_db=-19.37, measured_db_interval=(-19.4, -19.34), verdict=verdict,
        )  # fmt: skip
        after = with_verdicts(found, _verified(shown))
        judged = row_of(after, shown.id)
        assert row_of(found, shown.id).status == "pass"
        assert judged.status == status
        assert after.status == ("fail" if status == "fail" else found.status)
        if status == "fail":
            assert judged.reason == (
                "inside its limit of 337 µm, which images refute: the image shows -19.37 dB at it, -20.00 dB allowed"
            )
            (islr,) = [one for one in after.requirements if one.key == "islr"]
            assert (islr.status, islr.row, islr.reason) == ("fail", shown.id, judged.reason)

    @pytest.mark.parametrize("declared", [None, 0.0])
    def test_the_refuted_limit_of_a_row_that_uses_none_of_it_is_said(self, declared: float | None) -> None:
        error = {} if declared is None else {"platforms__receiver__motion_error": {"velocity": [1e-3, declared, 0]}}
        found = findings(**error)
        shown = Verdict(
            id="receiver.velocity.y", model="published", boundary_error=0.0417, unit="m/s", budget_rad=0.3927,
            measured_qpe_rad=0.417, verdict="optimistic",
        )  # fmt: skip
        after = with_verdicts(found, _verified(shown))
        judged = row_of(after, shown.id)
        assert (judged.status, after.status) == (row_of(found, shown.id).status, found.status)
        assert "optimistic limit: the image shows 0.417 rad at it, the budget is 0.392 rad" in judged.notes

    @pytest.mark.parametrize(("quadratic", "name"), [(0.03, " of equal loss"), (0.416, "")])
    def test_the_phase_that_is_judged_is_shown_under_its_name(self, quadratic: float, name: str) -> None:
        """Beside a budget of 0.393 rad the quadratic part alone, 0.03 rad, was shown as beyond it."""
        shown = Verdict(
            id="receiver.velocity.y", model="full", boundary_error=0.0417, unit="m/s", budget_rad=0.3927,
            predicted_qpe_rad=quadratic, measured_qpe_rad=quadratic, equal_loss_qpe_rad=0.3927,
            measured_equal_loss_qpe_rad=0.417, verdict="optimistic",
        )  # fmt: skip
        judged = row_of(with_verdicts(findings(), _verified(shown)), shown.id)
        assert f"the image shows 0.417 rad{name} at it, the budget is 0.392 rad" in str(judged.notes)
        assert verification.numbers(shown)[3:] == ("0.393", "0.417")
        remarks = " ".join(verification.geometry_remarks([shown]))
        assert ("smallest quadratic part 0.030 of 0.417 rad, receiver.velocity.y" in remarks) == bool(name)

    def test_a_row_whose_sum_gates_fails_by_its_own_image_too(self) -> None:
        """By root-sum-square a row of its own is for information; its limit is what the image speaks of."""
        found = findings(platforms__receiver__motion_error={"velocity": [0, 1e-3, 0]}, allocation={"combine": "rss"})
        shown = Verdict(
            id="receiver.velocity.y", model="published", boundary_error=0.0417, unit="m/s", budget_rad=0.3927,
            measured_qpe_rad=0.417, verdict="optimistic",
        )  # fmt: skip
        assert row_of(found, shown.id).status == "info"
        after = with_verdicts(found, _verified(shown))
        assert (row_of(after, shown.id).status, after.status) == ("fail", "fail")
        assert [one.status for one in after.requirements if one.key == "quadratic_phase_error"] == ["fail"]

    def test_along_the_axes_of_the_scene_an_error_is_only_shown_again(self) -> None:
        error = {"frame": "track", "velocity": [1e-3, 1e-3, 1e-3]}
        found = findings(platforms__receiver__motion_error=error)
        shown = Verdict(
            id="receiver.velocity.y", model="published", boundary_error=0.0417, unit="m/s", budget_rad=0.3927,
            measured_qpe_rad=0.417, verdict="optimistic",
        )  # fmt: skip
        assert row_of(found, shown.id).status == "info"
        assert with_verdicts(found, _verified(shown)).status == found.status

    @pytest.mark.parametrize(("until", "status"), [("2026-11-21", "waived"), ("2026-11-20", "fail")])
    def test_a_waiver_covers_what_fails_by_its_image(self, until: str, status: str) -> None:
        """It was not used, as long as no image spoke."""
        found = findings(
            platforms__receiver__motion_error={"velocity": [0, 1e-3, 0]},
            waivers=[{"id": "receiver.velocity.y", "until": until, "reason": "ECR-17"}],
        )
        shown = Verdict(
            id="receiver.velocity.y", model="published", boundary_error=0.0417, unit="m/s", budget_rad=0.3927,
            measured_qpe_rad=0.417, verdict="optimistic",
        )  # fmt: skip
        assert any("not used" in one.message for one in found.warnings)
        after = with_verdicts(found, _verified(shown), TODAY)
        judged = row_of(after, shown.id)
        assert judged.status == status
        assert "0.417 rad at it" in judged.reason
        assert any("ECR-17" in note for note in judged.notes)
        assert not any("not used" in one.message for one in after.warnings)
        assert (exit_code({after.status}, strict=False) == 1) == (status == "fail")

    def test_a_row_that_is_waived_stays_waived_with_the_note(self) -> None:
        found = findings(
            platforms__receiver__motion_error={"velocity": [0, 0.05, 0]},
            waivers=[{"id": "receiver.velocity.y", "until": "2027-01-01", "reason": "ECR-17"}],
        )
        shown = Verdict(
            id="receiver.velocity.y", model="published", boundary_error=0.0417, unit="m/s", budget_rad=0.3927,
            measured_qpe_rad=0.417, verdict="optimistic",
        )  # fmt: skip
        judged = row_of(with_verdicts(found, _verified(shown), TODAY), shown.id)
        assert (row_of(found, shown.id).status, judged.status) == ("waived", "waived")
        assert any("optimistic limit" in note for note in judged.notes)

    @pytest.mark.parametrize(
        ("verdict_autofocus", "status"), [("confirmed", "pass_with_autofocus"), ("optimistic", "fail")]
    )
    def test_a_pass_by_an_autofocus_that_the_image_refutes_fails(self, verdict_autofocus, status) -> None:
        changes = {"platforms__receiver__motion_error": {"acceleration": [2e-3, 0, 0]}, "autofocus": {"n_pull": 2}}
        found = findings(**changes)
        verdict = Verdict(
            id="receiver.acceleration.x", model="published", boundary_error=1.0, unit="m/s^2", verdict="confirmed",
            verdict_autofocus=verdict_autofocus, reason_autofocus="autofocus leaves 0.7 rad, 0.392 rad allowed",
        )  # fmt: skip
        assert row_of(found, verdict.id).status == "pass_with_autofocus"
        after = with_verdicts(found, _verified(verdict))
        judged = row_of(after, verdict.id)
        assert (judged.status, after.status) == (status, status)
        if status == "fail":
            assert judged.reason.endswith("refutes: autofocus leaves 0.7 rad, 0.392 rad allowed")

    @pytest.mark.parametrize(("verdict", "status"), [("conservative", "pass"), ("optimistic", "fail")])
    def test_a_location_that_the_image_contradicts_fails(self, verdict: str, status: str) -> None:
        error = {"platforms__receiver__motion_error": {"position": [1, 0, 0]}}
        found = findings(requirements__location_error=5, **error)
        shown = Verdict(
            id="mission.location_error",
            model="published",
            boundary_error=5,
            unit="m",
            verdict=verdict,
            reason="elsewhere",
        )
        assert row_of(found, shown.id).status == "pass"
        after = with_verdicts(found, _verified(shown))
        assert row_of(after, shown.id).status == status
        (location,) = [one for one in after.requirements if one.key == "location_error"]
        assert location.status == status
        if status == "fail":
            assert row_of(after, shown.id).reason == "inside its limit of 5 m, which images refute: elsewhere"

    def test_an_optimistic_limit_without_a_row_is_a_warning_of_the_file(self) -> None:
        verdict = Verdict(
            id="mission.vibration.wideband", model="published", boundary_error=1.0, unit="m", requirement_db=-20,
            measured_db=-17, verdict="optimistic",
        )  # fmt: skip
        (warning,) = [
            w for w in with_verdicts(findings(), _verified(verdict)).warnings if "mission.vibration" in w.message
        ]
        assert "-17.0 dB" in warning.message

    def test_text_and_csv_show_them(self, reports) -> None:
        assert "Images with each error at its limit" in reports[0]
        table = csv.DictReader(reports[1].splitlines())
        (verdict,) = [row["verdict"] for row in table if row["id"] == "receiver.velocity.y"]
        assert verdict == "optimistic"

    def test_without_it_there_are_none(self, run) -> None:
        (mission,) = json.loads(run("check", SECTION_V, "--format", "json").stdout)["missions"]
        assert mission["verification"] is None


class TestCommand:
    KEYS = {
        "id", "model", "boundary_error", "unit", "budget_rad", "predicted_qpe_rad", "measured_qpe_rad", "irw_ratio",
        "peak_loss_db", "pslr_db", "islr_db", "displacement_m", "verdict",
    }  # fmt: skip

    def test_json_contract(self, run) -> None:
        result = run("verify", SECTION_V, "--format", "json", "--only", "receiver.velocity.*")
        document = json.loads(result.stdout)
        assert document["format"] == "bisar-budget/verify/1"
        (mission,) = document["missions"]
        assert [row["id"] for row in mission["rows"]] == ["receiver.velocity.x", "receiver.velocity.y"]
        assert all(row.keys() >= self.KEYS for row in mission["rows"])

    def test_exit_1_if_a_limit_is_optimistic(self, run) -> None:
        assert run("verify", SECTION_V, "--only", "receiver.velocity.y").exit_code == 1
        assert run("verify", SECTION_V, "--only", "receiver.acceleration.*").exit_code == 0

    def test_text_names_limit_budget_image_and_verdict(self, run) -> None:
        line = next(
            line
            for line in run("verify", SECTION_V, "--only", "receiver.velocity.y").stdout.splitlines()
            if line.startswith("receiver.velocity.y")
        )
        assert line.split()[1:] == ["41.7", "mm/s", "0.392", "0.417", "0.417", "0.417", "optimistic"]

    def test_unusable_mission_is_2(self, run, tmp_path) -> None:
        result = run("verify", tmp_path / "none.yaml")
        assert result.exit_code == 2
        assert "cannot be read" in result.stderr

    def test_a_glob_without_rows_is_wrong_usage(self, run) -> None:
        result = run("verify", SECTION_V, "--only", "nothing")
        assert result.exit_code == 2
        assert "nothing was verified" in result.stderr

    def test_output_file(self, run, tmp_path) -> None:
        run("verify", SECTION_V, "--only", "timing.*", "--format", "json", "-o", tmp_path / "v.json")
        assert json.loads((tmp_path / "v.json").read_text())["missions"]


class TestConditions:
    """What changes how a verdict is to be read stands in the text, not in the JSON alone."""

    def test_window_noise_and_pulses(self, run, tmp_path, one_row_verified) -> None:
        one_row_verified("timing.*")
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(simulation={"window": "taylor", "noise": "-30 dB"}, collection__pulses=500))
        text = " ".join(run("verify", path, "--only", "timing.*").stdout.split())
        assert "Images: one point, exact ranges, taylor window, no noise (simulation.noise is for `simulate`)" in text
        assert "pulses as needed (the 500 of collection.pulses must not alias)" in text
        assert "images: one point, exact ranges, taylor window" in " ".join(
            run("check", path, "--verify", "-v").stdout.split()
        )

    def test_a_frequency_that_the_file_does_not_give_is_said_to_be_assumed(self) -> None:
        row = verdicts("receiver.vibration.sinusoidal.0", requirements__pslr=-30)["receiver.vibration.sinusoidal.0"]
        assert "10 cells from the peak" in row.reason
        assert "assumed: the file declares no vibration" in row.reason


@pytest.mark.parametrize(("model", "rule"), [("published", "(25)"), ("full", "the full model")])
def test_displacement_is_compared_with_the_gating_models(run, tmp_path, model: str, rule: str) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(mission_text(allocation={"model": model}), encoding="utf-8")
    text = " ".join(run("verify", path, "--only", "receiver.velocity.y").stdout.split())
    assert re.search(rf"displacement of the images: within [\d.]+ \w+ of {re.escape(rule)}, farthest", text)


@pytest.mark.parametrize(("model", "header"), [("published", "full"), ("full", "II"), ("strictest", "other")])
def test_beside_the_budget_stands_what_the_other_model_says(run, tmp_path, model: str, header: str) -> None:
    """Table II row 2 by hand, of the receiver of the base mission: 2π/λ·v_y·ṽ_y/R·(T/2)²."""
    path, row_id = tmp_path / "m.yaml", "receiver.velocity.y"
    path.write_text(mission_text(allocation={"model": model}), encoding="utf-8")
    found = verdicts(row_id, allocation={"model": model})[row_id]
    by_hand = 2 * math.pi / 0.0299792458 * 40 * found.boundary_error / math.sqrt(76e6) * 9
    assert found.published_qpe_rad == pytest.approx(by_hand, rel=1e-9)
    assert found.published_qpe_rad < 0.97 * found.full_qpe_rad
    assert found.budget_rad == pytest.approx(by_hand if model == "published" else found.equal_loss_qpe_rad)
    assert found.measured_qpe_rad == pytest.approx(found.full_qpe_rad, rel=0.05)
    lines = [line.split() for line in run("verify", path, "--only", row_id).stdout.splitlines() if line]
    other = found.full_qpe_rad if model == "published" else found.published_qpe_rad
    assert next(line for line in lines if line[0] == "row")[2:4] == ["budget", header]
    assert next(line for line in lines if line[0] == row_id)[3:5] == ["0.392", f"{other:.3f}"]


def test_a_reason_of_the_refocused_image_says_that_it_is_about_it(run, tmp_path) -> None:
    """A limit whose smear takes more than the largest patch has no verdict with autofocus, and one without."""
    path = tmp_path / "m.yaml"
    text = mission_text(autofocus={"n_pull": 200}, radar__bandwidth="40 MHz")  # f0/B is 250
    path.write_text(text, encoding="utf-8")
    text = " ".join(run("verify", path, "--only", "receiver.acceleration.x").stdout.split())
    assert re.search(r"receiver\.acceleration\.x \S+ \S+ [\d. ]+ confirmed", text)
    assert "receiver.acceleration.x, with autofocus: autofocus needs a patch of" in text


def test_a_remark_of_many_rows_is_said_once() -> None:
    """`one sigma of 4000 time series` stood in two lines for each of eight rows."""
    rows = [
        Verdict(
            id=f"receiver.imu.{name}", model="full", boundary_error=1.0, unit="m", verdict="confirmed", reason=said
        )
        for name, said in (("attitude", SAID), ("gyro_bias", SAID), ("accelerometer_bias", "another"))
    ]
    lines = " ".join("\n".join(text_lines(evidence(rows), Style())).split())
    assert lines.count(SAID) == 1
    assert f"receiver.imu.attitude, receiver.imu.gyro_bias: {SAID}" in lines
    assert "receiver.imu.accelerometer_bias: another" in lines


def test_phases_beside_a_budget_are_those_that_it_bounds() -> None:
    """The report of a narrow band printed the quadratic part, a third of the budget, and called it confirmed."""
    narrow = Verdict(
        "receiver.velocity.y", "full", 0.0205, "m/s", budget_rad=0.3927, published_qpe_rad=0.242, full_qpe_rad=0.1157,
        predicted_qpe_rad=0.1157, measured_qpe_rad=0.117, equal_loss_qpe_rad=0.3927,
        measured_equal_loss_qpe_rad=0.3931, verdict="confirmed",
    )  # fmt: skip
    assert numbers(narrow) == ("0.392", "0.242", "0.393", "0.393", "0.393")
    assert narrow.judged_phases_rad == (0.3927, 0.3931)
    cubic = narrow._replace(predicted_cubic_rad=0.78, measured_cubic_rad=0.79)
    assert cubic.judged_phases_rad == (0.78, 0.79)
