"""What reports say of confidences, percentiles and biases."""

import csv
import io
import json
import re

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.mission.load import parse_mission
from bisar_budget.report import Style, render
from bisar_budget.report.answers.check_answer import brief
from bisar_budget.report.renderers import html
from bisar_budget.report.words.percentiles import percentile_columns, percentile_lines
from bisar_budget.report.words.requirements import requirement_finding, verdict
from tests.conftest import TODAY, mission_text
from tests.report.test_report_explanation import BIASED, SURE
from tests.report.test_text_width import too_long

LIMITS = {"quadratic_phase_error": "45 deg", "location_error": "0.0012 km"}
ALLOCATION = {"model": "full", "combine": "rss"}


def found(text: str) -> MissionFindings:
    return check_mission(parse_mission(text, "m.yaml"), TODAY)


@pytest.fixture(scope="module")
def sure() -> MissionFindings:
    return found(mission_text(**BIASED, allocation=ALLOCATION) + SURE)


@pytest.fixture(scope="module")
def at_one_sigma() -> MissionFindings:
    return found(mission_text(**BIASED, allocation=ALLOCATION, requirements=LIMITS))


def written(name: str, findings: MissionFindings, **style) -> str:
    report = Report(version="0", missions=(findings,))
    return str(render(name, report, Style(**style)))


def of(findings: MissionFindings, key: str):
    return next(requirement for requirement in findings.requirements if requirement.key == key)


class TestText:
    def test_a_limit_shows_its_confidence(self, sure) -> None:
        text = written("text", sure)
        assert re.search(r"(?m)^location error +5 m \(95 %\)", text)
        assert re.search(r"(?m)^cubic phase error +30 deg \(99\.7 %\)", text)
        assert too_long(text) == []

    def test_percentiles_are_only_in_the_long_form(self, sure) -> None:
        assert "not exceeded in" not in written("text", sure)
        text = written("text", sure, verbosity=1)
        table = text[text.index("not exceeded in") : text.index("Transmitter ")]
        lines = [line for line in table.splitlines() if line.rstrip()[-1:] in ("g", "m")]
        assert [re.split(" {2,}| (?=[0-9])", line.strip())[0] for line in lines] == [
            "quadratic phase error", "cubic phase error", "location error (circle)", "along range", "along azimuth",
        ]  # fmt: skip
        assert "CE50 to CE99.7" in " ".join(table.split())
        assert too_long(table) == []

    def test_sizes_are_in_the_unit_of_the_file(self, at_one_sigma) -> None:
        lines = {line.name.strip(): line.sizes for line in percentile_lines(at_one_sigma)}
        assert all(size.endswith(" km") for size in lines["location error (circle)"])
        assert all(size.endswith(" deg") for size in lines["quadratic phase error"])

    def test_a_bias_is_beside_the_declared_size(self, sure) -> None:
        text = written("text", sure, verbosity=1)
        assert "  declared 5 mm/s, bias -2 mm/s\n" in text
        assert "bias" not in written("text", sure).replace("with a bias judged size / size at the limit", "")


class TestPages:
    @pytest.mark.parametrize("name", ["html", "markdown"])
    def test_how_sure(self, sure, name) -> None:
        page = re.sub(r"<[^>]+>", " ", written(name, sure))
        page = " ".join(page.replace("\u200b", "").split())
        for words in (
            "How sure: sizes that the effect of all declared errors, drawn together, does not exceed",
            "Confidence asked", "Collections within it", "displacement ≤ 5 m (95 %)", "5 mm/s, bias -2 mm/s",
            "cubic phase ≤ 30 deg (99.7 %)", "The probability that the effect of all declared errors",
            "transmitter.velocity.x -2 mm/s", "judges the quantile of all errors together", "with 95 % confidence",
        ):  # fmt: skip
            assert words in page

    def test_the_first_page_says_the_share_of_collections(self, at_one_sigma) -> None:
        share = re.search(r"at 1 sigma and for the stated bounds, (.* %) of collections", verdict(at_one_sigma))
        assert share is not None
        assert f"{share[1]} of collections" in written("markdown", at_one_sigma).split("Requirements and")[0]

    def test_a_notebook(self, sure) -> None:
        page = html.page(brief(sure))
        assert "5 m (95 %)" in page
        assert "bias -2 mm/s" in page


class TestData:
    def test_csv(self, sure) -> None:
        lines = list(csv.DictReader(io.StringIO(written("csv", sure))))
        place = next(line for line in lines if line["id"] == "requirement.location_error")
        document = json.loads(written("json", sure))["missions"][0]
        stated = next(item for item in document["requirements"] if item["key"] == "location_error")
        assert float(place["confidence_required"]) == stated["confidence"] == 0.95
        assert float(place["probability"]) == stated["probability"]
        for name, size in stated["percentiles"].items():
            assert float(place[f"percentile_{name}"]) == size
            assert float(place[f"percentile_range_{name}"]) == stated["percentiles_range"][name]
            assert float(place[f"percentile_azimuth_{name}"]) == stated["percentiles_azimuth"][name]
        biases = {line["id"]: float(line["bias"]) for line in lines if line["bias"]}
        assert biases == {row.id: row.bias for row in sure.rows if row.bias is not None}
        assert biases["transmitter.velocity.x"] == -0.002

    def test_a_level_has_no_percentiles(self) -> None:
        findings = found(mission_text(**BIASED, requirements={"islr": "-20 dB"}))
        assert set(percentile_columns(of(findings, "islr")).values()) == {None}

    def test_junit_has_properties(self, sure) -> None:
        text = written("junit", sure)
        assert '<property name="confidence_required" value="0.95"/>' in text
        assert '<property name="probability"' in text

    @pytest.mark.parametrize("name", ["sarif", "github", "junit"])
    def test_a_finding_says_the_confidence_of_its_limit(self, name) -> None:
        text = written(name, found(mission_text(**BIASED, allocation=ALLOCATION) + SURE.replace("5 m", "5 cm")))
        assert "allowable 5 cm (95 " in text

    def test_strictdoc_asks_for_the_confidence(self, sure) -> None:
        assert "shall be at most 5 m with 95 % confidence." in written("sdoc", sure)


class TestSentences:
    def test_a_requirement_with_a_confidence(self, sure) -> None:
        assert requirement_finding(of(sure, "location_error"), sure).startswith("location error of 5 m (95 %): ")

    def test_a_requirement_beside_one_says_only_its_own(self) -> None:
        limits = {"location_error": {"limit": "9 m", "confidence": "95 %"}, "quadratic_phase_error": "45 deg"}
        findings = found(mission_text(**BIASED, allocation=ALLOCATION, requirements=limits))
        sentence = requirement_finding(of(findings, "quadratic_phase_error"), findings)
        assert "at 1 sigma and for the stated bounds" in sentence
        assert "confidence" not in sentence

    def test_autofocus_counts_in_the_share_of_collections(self) -> None:
        """The share is that of the limit that autofocus raises; the percentiles are those before autofocus."""
        errors = {"platforms__transmitter__motion_error": {"acceleration": ["10 ug", 0, 0]}}
        changes = {**errors, "allocation": ALLOCATION, "requirements": {"quadratic_phase_error": "1 deg"}}
        alone, helped = found(mission_text(**changes)), found(mission_text(**changes, autofocus__n_pull=0.1))
        key = "quadratic_phase_error"
        assert of(alone, key).probability < 0.2
        assert of(helped, key).probability > 0.9
        assert of(alone, key).percentiles == pytest.approx(of(helped, key).percentiles)
