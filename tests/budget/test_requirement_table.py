"""The table of requirements: what the file requires, what the mission reaches, and the share that decides."""

import json
import math
import re
from typing import Any

import pytest

from bisar_budget.analysis.spread import Simulation
from bisar_budget.constants import MAINLOBE_ENERGY
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.report import Style, render
from bisar_budget.report.words.requirements import requirement_lines, use_remarks
from tests.conftest import TEXT_FORMATS, findings, row

T, WAVELENGTH = 6.0, 299_792_458.0 / 10e9
TRANSMITTER = "platforms__transmitter__motion_error"
RECEIVER = "platforms__receiver__motion_error"
# Of BASE: east component of the unit vectors from the scene's centre to the platforms.
EAST = {"transmitter": 30e3 / math.hypot(30e3, 6e3), "receiver": 6e3 / math.hypot(6e3, 6e3, 2e3)}
SPLIT = {"transmitter": 0.3, "receiver": 0.7}


def qpe_rad(platform: str, acceleration_mps2: float) -> float:
    """Quadratic phase at the edge of the aperture of an acceleration error to the east, one way: πaT²u/4λ."""
    return math.pi * acceleration_mps2 * T**2 * EAST[platform] / (4 * WAVELENGTH)


def checked(combine: str, **changes: Any) -> MissionFindings:
    """BASE with accelerations of 0.1 and 0.15 mm/s² to the east, by the published tables."""
    accelerations = {
        f"{TRANSMITTER}__acceleration": ["0.1 mm/s^2", 0, 0],
        f"{RECEIVER}__acceleration": ["0.15 mm/s^2", 0, 0],
    }
    rules = {"allocation": {"combine": combine, "model": "published", "split": SPLIT}}
    return findings(**{**accelerations, **rules, **changes})


def requirement(found: MissionFindings, key: str = "quadratic_phase_error") -> JudgedRequirement:
    (match,) = [one for one in found.requirements if one.key == key]
    return match


def written(format_name: str, found: MissionFindings) -> str:
    return render(format_name, Report("1", (found,)), Style())


class TestNumbers:
    @pytest.mark.parametrize("combine", ["rss", "sum", "each"])
    def test_allowed_is_the_requirement_and_reached_the_total_of_the_mission(self, combine: str) -> None:
        """The transmitter's 5.3 deg of 13.5 deg decide; the mission reaches more, of 45 deg."""
        found = requirement(checked(combine))
        phases = qpe_rad("transmitter", 1e-4), qpe_rad("receiver", 1.5e-4)
        total = {"rss": math.hypot(*phases), "sum": sum(phases), "each": max(phases)}[combine]
        assert phases[1] > phases[0]  # with `each` the largest row is not the one that decides
        assert (found.value, found.allowed) == (pytest.approx(math.pi / 4), pytest.approx(math.pi / 4))
        assert found.reached == pytest.approx(total, rel=1e-6)
        assert found.share is not None
        assert found.share.owner == "transmitter"
        assert found.share.allowed == pytest.approx(0.3 * math.pi / 4)
        assert found.share.reached == pytest.approx(phases[0], rel=1e-6)
        assert found.share.utilization == found.utilization
        assert found.utilization == pytest.approx(phases[0] / (0.3 * math.pi / 4), rel=1e-6)

    def test_the_gain_of_autofocus_is_not_in_what_is_allowed(self) -> None:
        plain, gained = (requirement(checked("rss", **changes)) for changes in ({}, {"autofocus": {"n_pull": 2}}))
        assert (plain.autofocus_gain, gained.autofocus_gain) == (1.0, pytest.approx(8.0))
        assert plain.share is not None
        assert gained.share is not None
        assert (gained.allowed, gained.reached) == (plain.allowed, plain.reached)
        assert (gained.share.allowed, gained.share.reached) == (plain.share.allowed, plain.share.reached)
        assert gained.utilization == pytest.approx((plain.utilization or 0.0) / 8)

    def test_where_the_whole_decides_there_is_no_share(self) -> None:
        """Errors from elsewhere belong to no platform: the mission's total is held to the whole."""
        antenna = [{"name": "antenna", "quadratic_phase_error": "40 deg"}]
        found = requirement(checked("rss", other_errors=antenna))
        assert (found.row, found.share) == ("mission.quadratic_phase_error", None)
        parts = math.radians(40), qpe_rad("transmitter", 1e-4), qpe_rad("receiver", 1.5e-4)
        assert found.reached == pytest.approx(math.hypot(*parts), rel=1e-6)
        assert found.utilization == pytest.approx(math.hypot(*parts) / (math.pi / 4), rel=1e-6)

    @pytest.mark.parametrize("combine", ["rss", "each"])
    def test_requirements_that_nobody_divides_have_no_share(self, combine: str) -> None:
        needs = {"location_error": "10 m", "cubic_phase_error": "45 deg"}
        found = checked(combine, requirements=needs, **{f"{RECEIVER}__position": ["1 m", 0, 0]})
        for key in needs:
            one = requirement(found, key)
            assert (one.allowed, one.share, one.autofocus_gain) == (one.value, None, None)
            assert one.reached == row(found, f"mission.{key}").declared

    def test_levels(self) -> None:
        """Wideband vibration: an image shows (exp(σ²) - 1)/E, and variances of two platforms add."""
        sigmas = {"transmitter": 0.01, "receiver": 0.03}
        rms = {name: {"rms": f"{phase * WAVELENGTH / (2 * math.pi)} m"} for name, phase in sigmas.items()}
        found = findings(
            allocation={"combine": "rss", "model": "full", "split": SPLIT},
            requirements={"islr": "-20 dB"},
            platforms__transmitter__motion_error__vibration={"wideband": rms["transmitter"]},
            platforms__receiver__motion_error__vibration={"wideband": rms["receiver"]},
        )
        one, energy = requirement(found, "islr"), MAINLOBE_ENERGY[Simulation().window]
        variance = math.fsum(phase**2 for phase in sigmas.values())
        assert one.allowed == -20.0
        assert one.reached == pytest.approx(10 * math.log10(math.expm1(variance) / energy), abs=1e-6)
        assert one.share is not None
        assert one.share.owner == "receiver"
        # 0.7 of the variance that makes -20 dB.
        share = 0.7 * math.log1p(0.01 * energy)
        assert one.share.allowed == pytest.approx(10 * math.log10(math.expm1(share) / energy), abs=1e-6)
        assert one.share.reached == pytest.approx(10 * math.log10(math.expm1(0.03**2) / energy), abs=1e-6)

    def test_what_is_not_judged_reaches_nothing(self) -> None:
        found = checked("rss", requirements={"islr": "-20 dB", "cubic_phase_error": "45 deg"})
        one = requirement(found, "islr")
        assert (one.status, one.allowed, one.reached, one.utilization, one.share) == (
            "not_evaluated", -20.0, None, None, None,
        )  # fmt: skip

    def test_pull_in_of_autofocus_has_numbers_of_its_own(self) -> None:
        """Each error is within its share with autofocus; the sum of all is beyond π·N_pull."""
        errors = {
            f"{TRANSMITTER}__velocity": [0, "0.5 m/s", 0],
            RECEIVER: {"velocity": [0, "0.52 m/s", 0], "acceleration": ["1 mm/s^2", 0, 0]},
        }
        found = findings(autofocus={"n_pull": 3}, **errors)
        one, pull_in = requirement(found), row(found, "mission.autofocus_pull_in")
        assert (one.row, one.status) == (pull_in.id, "warn")
        assert one.share is not None
        assert (one.share.owner, one.share.allowed) == ("autofocus", pytest.approx(3 * math.pi))
        assert one.share.reached == pull_in.declared
        assert one.allowed == pytest.approx(math.pi / 4)
        # The transmitter's, at broadside: πT²/4λ · 2vV/R.
        reached = math.pi * T**2 * 2 * 0.5 * 150 / math.hypot(30e3, 6e3) / (4 * WAVELENGTH)
        assert one.reached == pytest.approx(reached, rel=1e-6)


class TestLargestUse:
    """By the published model a warning of the full one has no use of its own, and hid what uses most."""

    CHANGES = {f"{TRANSMITTER}__position": [0, 0, "4 km"], f"{RECEIVER}__acceleration": ["0.15 mm/s^2", 0, 0]}

    def test_the_largest_use_is_shown_beside_the_warning(self) -> None:
        found = findings(**self.CHANGES)
        one, warned = requirement(found), row(found, "transmitter.position.z")
        assert (warned.status, warned.utilization) == ("warn", 0.0)
        assert (one.status, one.row, one.use_row) == ("warn", warned.id, "receiver.acceleration.x")
        assert one.utilization == pytest.approx(qpe_rad("receiver", 1.5e-4) / (math.pi / 8), rel=1e-6)
        (line,) = requirement_lines(found)
        assert line.decided_by == "transmitter.position.z"
        assert line.remark == "most used by receiver.acceleration.x, receiver's share: 5.58 of 22.5 deg"

    @pytest.mark.parametrize("model", ["published", "strictest", "full"])
    @pytest.mark.parametrize("combine", ["rss", "each"])
    def test_no_row_that_judges_it_uses_more(self, model: str, combine: str) -> None:
        errors = {f"{TRANSMITTER}__position": [0, 0, "100 m"], f"{RECEIVER}__acceleration": ["0.15 mm/s^2", 0, 0]}
        found = findings(allocation={"model": model, "combine": combine}, **errors)
        one = requirement(found)
        uses = [row(found, row_id).utilization or 0.0 for row_id in one.rows]
        assert one.status in ("pass", "warn")
        assert one.utilization == pytest.approx(max(uses))

    def test_of_a_failing_requirement_the_row_that_fails_is_shown(self) -> None:
        found = findings(**{**self.CHANGES, f"{RECEIVER}__acceleration": ["1 mm/s^2", 0, 0]})
        one = requirement(found)
        assert (one.status, one.row, one.use_row) == ("fail", "receiver.acceleration.x", "receiver.acceleration.x")


class TestWords:
    def test_limits_of_errors_down_and_levels_to_the_nearest(self) -> None:
        """-20.04 dB is `-20 dB`, its half -23.05 dB `-23.1 dB`; 45.09 deg is `45 deg`, and 12.39 m `12.3 m`."""
        needs = {"quadratic_phase_error": "45.09 deg", "location_error": "12.39 m", "islr": "-20.04 dB"}
        errors = {"velocity": "1 mm/s", "vibration": {"wideband": {"rms": "30 um"}}}
        found = findings(
            allocation={"combine": "rss", "model": "published"}, requirements=needs, **{RECEIVER: errors}
        )
        lines = {line.requirement.key: line for line in requirement_lines(found)}
        assert {key: line.allowed for key, line in lines.items()} == {
            "quadratic_phase_error": "45 deg",
            "location_error": "12.3 m",
            "islr": "-20 dB",
        }
        assert re.fullmatch(r"receiver's share: -[\d.]+ of -23\.1 dB", lines["islr"].remark)
        assert "receiver's share: " in lines["quadratic_phase_error"].remark
        assert lines["quadratic_phase_error"].remark.endswith(" of 22.5 deg")

    @pytest.mark.parametrize("format_name", TEXT_FORMATS)
    def test_every_format_has_the_share_beside_the_requirement(self, format_name: str) -> None:
        found = checked("rss", **{f"{RECEIVER}__acceleration": ["2 mm/s^2", 0, 0]})
        one = requirement(found)
        assert one.status == "fail"
        (remark,) = use_remarks(one)
        assert re.fullmatch(r"receiver's share: 74\.[34]\d* of 31\.5 deg", remark)
        text = written(format_name, found)
        plain = " ".join(
            text.replace("\\", "").replace("&apos;", "'").replace("&#x27;", "'").replace("&#39;", "'").split()
        )
        if format_name == "json":
            (stated,) = json.loads(text)["missions"][0]["requirements"]
            assert stated["share"] == {
                "owner": "receiver",
                "allowed": pytest.approx(0.7 * math.pi / 4),
                "reached": pytest.approx(qpe_rad("receiver", 2e-3), rel=1e-6),
                "utilization": stated["utilization"],
            }
        elif format_name not in ("sarif", "github"):  # there a row that fails is the finding
            assert remark in plain


class TestConfidence:
    """The verdict says what it is worth: errors of one sigma are exceeded one time in three."""

    SIGMA = {f"{RECEIVER}__velocity": "1 mm/s"}
    BOUND = {f"{TRANSMITTER}__velocity": "1 mm/s", f"{TRANSMITTER}__distribution": "bound"}
    UNIFORM = {f"{TRANSMITTER}__velocity": "1 mm/s", f"{TRANSMITTER}__distribution": "uniform"}
    TONE = {f"{RECEIVER}__vibration": {"sinusoidal": [{"amplitude": "1 um", "frequency": "20 Hz"}]}}
    TWICE = {"allocation": {"coverage_factor": 2}}
    NEEDS = {"requirements": {"pslr": "-30 dB"}}

    @pytest.mark.parametrize(
        ("changes", "confidence"),
        [
            (SIGMA, "at 1 sigma"),
            (SIGMA | TWICE, "with coverage factor 2"),
            (BOUND, "for the stated bounds"),
            (UNIFORM, "for the stated bounds"),
            (BOUND | TWICE, "for the stated bounds with coverage factor 2"),
            (SIGMA | BOUND, "at 1 sigma and for the stated bounds"),
            (SIGMA | UNIFORM | TWICE, "with coverage factor 2 and for the stated bounds"),
            ({"timing_error": {"quadratic": "1e-16 1/s"}, **BOUND}, "at 1 sigma and for the stated bounds"),
            ({"common_motion_error": {"position": "1 cm", "distribution": "bound"}}, "for the stated bounds"),
            (SIGMA | TONE | NEEDS, "at 1 sigma"),  # an amplitude has no distribution
            (BOUND | TONE | NEEDS, "for the stated bounds"),
            ({"other_errors": [{"name": "antenna", "quadratic_phase_error": "1 deg"}]}, "for the stated values"),
            ({f"{RECEIVER}__velocity": 0, **BOUND}, "for the stated bounds"),  # nor has an error of nothing
            ({f"{RECEIVER}__velocity": 0}, "at 1 sigma"),
        ],
    )
    def test_of_what_is_declared(self, changes: dict[str, Any], confidence: str) -> None:
        found = findings(**changes)
        assert (found.status, found.confidence) == ("pass", confidence)
        first = " ".join(written("text", found).partition("\nbase; ")[0].split())
        assert f"every requirement is judged and met {confidence}" in first

    @pytest.mark.parametrize("format_name", [one for one in TEXT_FORMATS if one not in ("github", "sarif")])
    def test_every_format_of_a_verdict_says_it(self, format_name: str) -> None:
        """GitHub's annotations and SARIF have findings alone, and this mission has none."""
        assert "with coverage factor 2" in written(format_name, findings(**self.SIGMA, **self.TWICE))

    def test_findings_of_code_scanning_carry_it(self) -> None:
        failing = findings(**self.TWICE, **{f"{RECEIVER}__velocity": "5 m/s"})
        (run,) = json.loads(written("sarif", failing))["runs"]
        assert {one["properties"]["confidence"] for one in run["results"]} == {"with coverage factor 2"}

    def test_a_mission_that_is_not_met_is_not_said_to_be_met_with_it(self) -> None:
        failing = findings(**{f"{RECEIVER}__velocity": "5 m/s"})
        assert failing.status == "fail"
        assert "1 sigma" not in written("text", failing)
        assert "1 sigma" not in written("markdown", failing).split("## Assumptions")[0].split("# ")[1]

    def test_json(self) -> None:
        (mission,) = json.loads(written("json", findings(**self.SIGMA)))["missions"]
        assert mission["confidence"] == "at 1 sigma"
        (mission,) = json.loads(written("json", findings()))["missions"]
        assert mission["confidence"] is None
