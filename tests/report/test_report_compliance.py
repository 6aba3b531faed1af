"""The compliance report: what it says, that it is the same every time, and that no name does anything to it."""

import hashlib
import math
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.faults import Fault, printable
from bisar_budget.findings.images import ImageEvidence, PointImage, Verdict
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.row import worst_first
from bisar_budget.mission.load import load_mission
from bisar_budget.report import Style, pictures, render
from bisar_budget.report.compliance.summary import compliance
from bisar_budget.report.document import (
    AnswerDocument,
    Badge,
    Facts,
    Items,
    Name,
    Paragraph,
    Stack,
    Steps,
    Styled,
    Swatch,
    Text,
    TextTable,
    Use,
    blocks_of,
)
from bisar_budget.report.words.sentences import sentence
from bisar_budget.sampling.probability import monte_carlo
from tests.conftest import COMPLIES, ROOT, by_turns, examples, findings, found_in, mission_text, name_of
from tests.page import Element, read_page

SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
WITH_AUTOFOCUS = ROOT / "specs" / "missions" / "rigling_moses_section_v_autofocus.yaml"
EVERY_KEY = ROOT / "tests" / "acceptance" / "good" / "every_key.yaml"
FAULT = Fault(line=3, column=7, key="radar.bandwidth", problem="is missing")
LANGUAGES = ("html", "markdown")
FULL = Style(detail="full")  # the summary and its annex


def report(*missions, **fields) -> Report:
    return Report(version="1.2.3", missions=missions or (found_in(SECTION_V),), **fields)


def html(*missions, **fields) -> Element:
    return read_page(render("html", report(*missions, **fields), FULL))


def markdown(*missions, style: Style | None = None, **fields) -> str:
    return render("markdown", report(*missions, **fields), style or FULL)


def as_page(text: str) -> Element:
    """Markdown as CommonMark has it, with GitHub's tables, as a page."""
    return read_page(MarkdownIt("commonmark").enable(["table", "strikethrough"]).render(text).replace(" />", ">"))


def page_of(language: str, *missions, **fields) -> Element:
    return html(*missions, **fields) if language == "html" else as_page(markdown(*missions, **fields))


def squeezed(text: str) -> str:
    return " ".join(text.split())


def table_with(page: Element, *heads: str) -> list[list[str]]:
    """Rows of the table whose head holds these words, in lower case."""
    for table in page.all("table"):
        head, *rows = list(table.all("tr"))
        named = [squeezed(cell.text).lower() for cell in head.all("th")]
        if all(word in named for word in heads):
            return [[squeezed(cell.text) for cell in row.all("th", "td")] for row in rows]
    raise AssertionError(heads)


def parts(text: Text) -> list[object]:
    """Parts of a line, one after the other."""
    if isinstance(text, tuple):
        return [part for inner in text for part in parts(inner)]
    return parts(text.text) if isinstance(text, Styled) else [text]


def plain(text: Text) -> str:
    """Words of a line, without its bars."""
    words = (
        getattr(part, "text", getattr(part, "status", part)) for part in parts(text) if not isinstance(part, Use)
    )
    return "".join(str(word) for word in words)


def lines(document: AnswerDocument, *heads: str) -> list[dict[str, Text]]:
    """Lines of all tables with these columns, by the heads of the columns."""
    found = []
    for table in blocks_of(document):
        named = [plain(head.text) for head in table.heads] if isinstance(table, TextTable) else []
        if set(heads) <= set(named):
            found += [dict(zip(named, row, strict=True)) for row in table.rows]
    return found


def matrix(document: AnswerDocument) -> dict[str, dict[str, str]]:
    """Words of the compliance matrix, with what the annex has of it, by the id of the row."""
    return {parts(line["Id"])[0].text: {head: plain(cell) for head, cell in line.items()}
            for line in lines(document, "Id", "Verified by")}  # fmt: skip


def facts(document: AnswerDocument, style: str) -> list[tuple[str, str]]:
    """Names of facts, and what they are, in all lists of a style."""
    pairs = [pair for block in blocks_of(document) if isinstance(block, Facts) and block.style == style
             for pair in block.pairs]  # fmt: skip
    return [(plain(name), plain(words)) for name, words in pairs]


def drivers(document: AnswerDocument) -> list[tuple[str, str, float]]:
    """Id, status and bar of each row that drives the verdict."""
    found = []
    for block in blocks_of(document):
        if isinstance(block, Items) and block.style == "drivers":
            for line, _ in block.items:
                (name,) = [part for part in parts(line) if isinstance(part, Name)]
                (badge,) = [part for part in parts(line) if isinstance(part, Badge)]
                (use,) = [part for part in parts(line) if isinstance(part, Use)]
                found.append((name.text, badge.status, use.fraction))
    return found


# Of a row and an image that nobody needs to form: the report shows what it is given.
VERDICT = Verdict(
    id="transmitter.acceleration.x", model="published", boundary_error=4.244e-4, unit="m/s^2", budget_rad=0.3927,
    published_qpe_rad=0.392, full_qpe_rad=0.393, predicted_qpe_rad=0.394, measured_qpe_rad=0.395, verdict="confirmed",
    boundary_autofocus=6.79e-3, measured_residual_qpe_rad=0.012, refocused_loss_db=-0.01,
    verdict_autofocus="confirmed", reason="a reason of its own",
)  # fmt: skip
IMAGE = PointImage(
    columns=2, rows=3, chip=bytes(range(6)), pixel_m=(0.5, 0.25), thinned=1, step_m=0.1,
    cut_db=(-40.0, -3.0, 0.0, -3.0, -40.0), error_free_db=(-50.0, -4.0, 0.0, -4.0, -50.0),
)  # fmt: skip


def illustrated() -> MissionFindings:
    found = found_in(WITH_AUTOFOCUS)
    evidence = ImageEvidence(found.file, VERDICT, 0.39, IMAGE, IMAGE, IMAGE)
    return found._replace(verdicts=(VERDICT,), image_evidence=(evidence,))


EXAMPLES = sorted((ROOT / "specs" / "missions").glob("*.yaml"))


class TestView:
    @pytest.mark.parametrize(("path", "model"), by_turns(EXAMPLES, ("published", "full", "strictest")), ids=name_of)
    def test_every_row_stands_once_with_its_numbers(self, path: Path, model: str) -> None:
        found = found_in(path, model)
        document = compliance(report(found), FULL)
        shown, bars = {}, {}
        for line in lines(document, "Id", "Verified by"):
            row_id = parts(line["Id"])[0].text
            assert row_id not in shown
            shown[row_id] = {head: plain(cell) for head, cell in line.items()}
            (bars[row_id],) = [part.fraction for part in parts(line["Utilization"]) if isinstance(part, Use)]
            (status,) = [part.status for part in parts(line["Status"])]
            assert status == next(row.status for row in found.rows if row.id == row_id)
        silent = {plain(line["Id"]) for line in lines(document, "Id", "Allowable", "From")}
        assert len(shown) + len(silent) == len(found.rows)
        assert {row.id for row in found.rows} == shown.keys() | silent
        for row in found.rows:
            if row.id in silent:
                assert row.status == "not_declared"
                continue
            line = shown[row.id]
            assert line["Line"] == ("–" if row.line is None else str(row.line))
            if row.allowable is not None and row.status != "not_evaluated":
                assert bars[row.id] == row.utilization
            if row.status == "not_evaluated":
                assert line["Margin"] == "–"
            elif row.unit == "dB" and row.margin is not None:
                levels = float(line["Margin"].replace("−", "-").removesuffix(" dB"))
                assert -0.1 <= levels - (row.allowable - row.declared) <= 1e-9  # rounded down
            elif row.margin is not None and 10 < row.margin < 1e6:
                times = float(line["Margin"].removeprefix("× "))
                assert (1 + row.margin) * 0.99 <= times <= (1 + row.margin) * (1 + 1e-9)
            elif row.margin is not None and abs(row.margin) <= 10:
                percent = float(line["Margin"].replace("−", "-").removesuffix(" %"))
                # Three digits, rounded down.
                size = abs(100 * row.margin)
                assert 100 * row.margin - max(0.01 * size, 1e-9) <= percent <= 100 * row.margin + 1e-9 * size
        derived = [plain(block.title) for block in blocks_of(document) if getattr(block, "style", "") == "derivation"]
        ranked = [row for row in worst_first(found.rows) if row.status != "not_declared"]
        assert derived == [f"{row.id} {row.status}" for row in ranked]

    def test_the_rows_that_drive_the_verdict_are_the_worst(self) -> None:
        errors = [
            {"name": name, "quadratic_phase_error": size} for name, size in zip("abcd", (1, 3, 4, 2), strict=True)
        ]
        found = drivers(compliance(report(findings(other_errors=errors)), Style()))
        assert [row_id for row_id, _, _ in found] == ["other.c", "other.b", "other.d"]
        assert found[0][2] > found[1][2] > found[2][2] > 1

    def test_a_row_that_uses_nothing_drives_nothing(self) -> None:
        found = drivers(compliance(report(), Style()))
        assert [row_id for row_id, _, _ in found] == ["transmitter.acceleration.x"]

    def test_contributions_are_sorted_and_counted_once(self) -> None:
        """By hand: Table II row 2 for 150 m/s at 30.594 km gives 0.02277 rad for 5 mm/s, and 5 deg are 0.0873 rad."""
        found = findings(
            platforms__transmitter__motion_error={"velocity": "5 mm/s"},
            other_errors=[{"name": "troposphere", "quadratic_phase_error": "5 deg"}],
        )
        shown = lines(compliance(report(found), Style()), "Owner", "QPE")
        assert [(line["Owner"], line["Kind"], line["Axis or term"]) for line in shown] == [
            ("mission", "other", "troposphere"),
            ("transmitter", "velocity", "y"),
        ]
        wavelength, R = 299792458 / 10e9, math.hypot(30e3, 6e3)
        qpe = math.pi * 36 * 150 * 0.005 / (2 * R * wavelength)
        assert shown[1]["Relative to the largest"].fraction == pytest.approx(qpe / math.radians(5), rel=1e-9)
        assert shown[1]["QPE"] == f"{math.degrees(qpe):.3g} deg"

    def test_an_error_in_another_frame_contributes_along_its_own_axes(self) -> None:
        found = findings(platforms__receiver__motion_error={"frame": "track", "velocity": "5 mm/s"})
        shown = lines(compliance(report(found), Style()), "Owner", "QPE")
        assert {line["Axis or term"] for line in shown} <= {"along", "cross", "up"}
        assert shown

    def test_budget_before_and_after_autofocus(self) -> None:
        """π/8 per platform; autofocus of 4π multiplies by 16."""
        document = compliance(report(found_in(WITH_AUTOFOCUS)), Style())
        transmitter, receiver, clock = lines(document, "Owner", "Share")
        assert (transmitter["Before autofocus"], transmitter["With autofocus"]) == ("22.5 deg", "360 deg")
        assert receiver["Owner"] == (Swatch("receiver", 0.5), "receiver")
        assert clock["Share"] == "limited by the receiver’s"
        before, after = [block for block in blocks_of(document) if isinstance(block, Stack)]
        for ended, started in zip(after.shares, before.shares, strict=True):
            assert ended[1] / started[1] == pytest.approx(16)

    def test_the_method_names_analysis_and_simulation(self) -> None:
        shown = matrix(compliance(report(illustrated()), Style()))
        methods = {row_id: line["Verified by"] for row_id, line in shown.items()}
        assert methods["transmitter.acceleration.x"] == "analysis: Table II row 4; simulation: confirmed"
        assert methods["transmitter.acceleration.y"] == "analysis: Table II row 5"

    def test_what_the_file_gives_and_what_is_default(self) -> None:
        given = dict(facts(compliance(report(), Style()), "inputs"))
        assert given["aperture time"] == "6 s line 17"
        assert given["coverage factor"].endswith(" default")
        assert given["PSLR"].endswith(" not in the file")

    def test_findings_without_their_analysis_are_refused(self) -> None:
        with pytest.raises(ValueError, match="carry their analysis"):
            compliance(report(found_in(SECTION_V)._replace(analysis=None)), Style())


@pytest.mark.parametrize("language", LANGUAGES)
class TestBothLanguages:
    def test_verdict_and_driver(self, language: str) -> None:
        text = squeezed(page_of(language).text)
        assert "Does not comply" in text
        assert "1178 % of it used" in text
        assert "passes with autofocus from n_pull 2.95" in text

    def test_matrix(self, language: str) -> None:
        rows = table_with(page_of(language), "id", "requirement", "verified by", "margin", "waiver", "line")
        worst = rows[0]
        assert worst[0] == "transmitter.acceleration.x"
        assert {"QPE ≤ 22.5 deg, 0.5 of the budget", "analysis: Table II row 4"} <= set(worst)
        assert {"0.000424 m/s²", "0.005 m/s²", "fail", "23"} <= set(worst)
        assert any("1178 %" in cell for cell in worst)
        assert "−91.6 %" in worst

    def test_waiver(self, language: str) -> None:
        found = found_in(ROOT / "tests" / "acceptance" / "good" / "waived.yaml")
        rows = table_with(page_of(language, found), "id", "waiver")
        waived = next(row for row in rows if "waived" in row)
        assert "Not met; accepted by waiver; 1 row over its limit is waived" in squeezed(
            page_of(language, found).text
        )
        assert any("until 2026-11-21: last day" in cell for cell in waived)

    def test_what_is_waived_stands_before_what_passes(self, language: str) -> None:
        """In the matrix, and among the rows that the verdict rests on."""
        found = found_in(ROOT / "tests" / "acceptance" / "good" / "waived.yaml")
        document = compliance(Report("1", (found,)), Style())
        statuses = [line["Status"] for line in matrix(document).values()]
        assert next(status for status in statuses if status != "info") == "waived"
        assert drivers(document)[0][1] == "waived"
        assert found.status == "waived"
        assert [
            block.style for block in blocks_of(document) if isinstance(block, Paragraph) and "verdict" in block.style
        ] == ["verdict waived"]

    def test_no_row_that_passes_drives_a_failure(self, language: str) -> None:
        found = drivers(compliance(Report("1", (found_in(SECTION_V),)), Style()))
        assert {status for _, status, _ in found} <= {"fail", "not_evaluated", "warn", "waived"}

    def test_requirement_id_and_source(self, language: str) -> None:
        text = squeezed(page_of(language, found_in(EVERY_KEY)).text)
        assert "SYS-NAV-012" in text
        assert "INS data sheet, rev. C" in text
        assert re.search(r"The file names no source for [\w., ]*receiver\.acceleration\.line_of_sight", text)

    def test_sections(self, language: str) -> None:
        page = page_of(language, illustrated())
        heads = [squeezed(head.text).lower() for head in page.all("h2", "h3")]
        for section in (
            "verdict", "compliance matrix", "contributions to phase and displacement", "geometry", "allocation",
            "assumptions and validity", "how this report was made", "approval", "annex", "image evidence",
            "all rows", "sources", "formulas with their numbers",
        ):  # fmt: skip
            assert section in heads

    def test_image_evidence(self, language: str) -> None:
        page = page_of(language, illustrated())
        row = table_with(page, "id", "limit", "exact ranges", "image", "verdict")[0]
        numbers = ["424 µm/s²", "0.392", "0.392", "0.393", "0.394", "0.395"]
        assert row == ["transmitter.acceleration.x", *numbers, "confirmed"]
        refocused = table_with(page, "id", "limit", "residual", "peak loss")[0]
        assert refocused[1:4] == ["6.79 mm/s²", "0.392", "0.012"]
        assert "a reason of its own" in squeezed(page.text)

    def test_monte_carlo(self, language: str) -> None:
        path = ROOT / "specs" / "missions" / "drones_same_gnss.yaml"
        drawn = monte_carlo(Analysis(load_mission(str(path))), 2000, 1)
        page = page_of(language, found_in(path)._replace(monte_carlo=drawn))
        rows = {row[0]: row for row in table_with(page, "requirement", "limit", "sum", "rss", "sigma")}
        location = next(one for one in drawn.requirements if one.id == "mission.location_error")
        shown = rows["mission.location_error"]
        assert shown[1] == "2 m"
        assert float(re.search(r"holds in ([\d.]+) %", shown[-1])[1]) == pytest.approx(
            100 * location.probability, abs=0.1
        )
        assert "2,000 draws, seed 1" in squeezed(page.text)
        assert "both platforms" in [row[0] for row in table_with(page, "owner", "kind", "axis or term")]

    def test_without_verification_there_is_no_such_section(self, language: str) -> None:
        assert "image evidence" not in page_of(language).text.lower()

    def test_formulas_have_their_row_and_their_numbers(self, language: str) -> None:
        text = squeezed(page_of(language).text)
        assert "Table II row 4" in text
        assert "4.62648" in text
        assert "(11), bistatic look direction" in text

    def test_an_unusable_file_appears_with_its_faults(self, language: str) -> None:
        bad = UnusableMission(file="a.yaml", faults=(FAULT,), data=b"x")
        page = page_of(language, bad, found_in(SECTION_V))
        text = squeezed(page.text)
        assert "radar.bandwidth: is missing" in text
        assert "3:7" in text
        assert hashlib.sha256(b"x").hexdigest() in text
        summary = table_with(page, "mission", "status", "quadratic phase error")
        assert [row[1:] for row in summary] == [["unusable 1 fault", "–"], ["fail", "1178 % fail"]]

    def test_a_file_that_cannot_be_read_has_no_digest(self, language: str) -> None:
        text = page_of(language, UnusableMission(file="a.yaml", faults=(FAULT,))).text
        assert "not read" in text

    def test_nothing_declared_is_no_compliance(self, language: str) -> None:
        text = squeezed(page_of(language, findings()).text)
        assert "Nothing was judged" in text
        assert "Complies" not in text

    def test_the_same_mission_twice(self, language: str) -> None:
        page = page_of(language, found_in(SECTION_V), found_in(SECTION_V))
        ids = [e.attributes["id"] for e in page.all() if "id" in e.attributes]
        assert len(ids) == len(set(ids))

    def test_options_stand_with_their_origin(self, language: str) -> None:
        options = (Override("--model", "full", "environment, BISAR_BUDGET_MODEL"),)
        rows = table_with(page_of(language, options=options), "option", "value", "from")
        assert rows == [["--model", "full", "environment, BISAR_BUDGET_MODEL"]]


class TestHtml:
    def test_is_one_file_without_script(self) -> None:
        text = render("html", report(illustrated()), Style())
        assert "<script" not in text
        assert not re.search(r"(?i)@import|url\(|javascript:| on\w+=", text)
        page = read_page(text)
        for element in page.all():
            for name in ("src", "href", "data", "action", "poster", "srcset"):
                link = element.attributes.get(name, "#")
                assert link.startswith(("#", "data:image/png;base64,")), link

    def test_structure(self) -> None:
        page = html(illustrated(), UnusableMission(file="a.yaml", faults=(FAULT,)), findings())
        assert len(list(page.all("h1"))) == 1
        levels = [int(head.tag[1]) for head in page.all("h1", "h2", "h3", "h4", "h5", "h6")]
        assert all(after <= before + 1 for before, after in pairwise(levels))
        ids = [element.attributes["id"] for element in page.all() if "id" in element.attributes]
        assert len(ids) == len(set(ids))
        for element in page.all():
            for name in ("aria-labelledby", "aria-describedby"):
                assert element.attributes.get(name, ids[0]) in ids
        targets = [link.attributes["href"].removeprefix("#") for link in page.all("a")]
        assert targets
        assert set(targets) <= set(ids)
        for table in page.all("table"):
            assert list(table.all("caption"))
            assert all("scope" in head.attributes for head in table.all("th"))
        for image in page.all("img"):
            assert image.attributes["alt"]

    def test_mathml_is_that_of_the_derivation(self) -> None:
        from bisar_budget.theory import published
        from bisar_budget.theory.render import as_mathml_content

        formula = as_mathml_content(published.table_2().rows[3].cells[0])
        assert formula in render("html", report(), FULL)

    def test_bars_have_the_length_of_the_utilization(self) -> None:
        found = found_in(WITH_AUTOFOCUS)
        use = next(row for row in found.rows if row.id == "transmitter.acceleration.x").utilization
        row = next(row for row in html(found).all("tr") if "transmitter.acceleration.x" in row.text)
        fill = next(rect for rect in row.all("rect") if rect.has_class("fill"))
        limit = next(path for path in row.all("path") if path.has_class("limit"))
        at_limit = float(re.match(r"M(\d+)", limit.attributes["d"])[1])
        assert float(fill.attributes["width"]) == pytest.approx(at_limit * use, abs=0.01)

    def test_stacked_bars_say_what_they_show(self) -> None:
        bars = [e for e in html(found_in(WITH_AUTOFOCUS)).all("div") if e.has_class("stack")]
        assert [bar.attributes["aria-label"] for bar in bars] == [
            "Before autofocus: transmitter 22.5 deg, receiver 22.5 deg",
            "With autofocus: transmitter 360 deg, receiver 360 deg",
        ]
        widths = [span.attributes["style"] for bar in bars for span in bar.all("span")]
        assert widths == ["width:3.125%"] * 2 + ["width:50.000%"] * 2


class TestMarkdown:
    def test_without_a_folder_there_are_no_images(self) -> None:
        text = markdown(illustrated())
        assert "![" not in text
        assert "<img" not in text
        assert pictures("markdown", report(illustrated()), Style()) == {}

    def test_with_a_folder_every_image_is_there_and_every_file_is_shown(self) -> None:
        style = Style(assets="my report.assets", detail="full")
        named = report(illustrated(), UnusableMission(file="a.yaml", faults=(FAULT,)), found_in(SECTION_V))
        text = render("markdown", named, style)
        shown = {image.attributes["src"] for image in as_page(text).all("img")}
        shown |= set(re.findall(r'<img src="([^"]+)"', text))
        files = pictures("markdown", named, style)
        assert shown == {f"my%20report.assets/{name}" for name in files}
        assert {name for name in files if name.startswith("3-")} == {"3-plan.svg", "3-elevation.svg"}
        assert files["1-chip-1-after.png"].startswith(b"\x89PNG")
        assert all(content.startswith(b"<svg") for name, content in files.items() if name.endswith(".svg"))

    def test_formulas_are_blocks_that_github_typesets(self) -> None:
        blocks = re.findall(r"(?ms)^```math\n(.*?)\n```$", markdown())
        assert len(blocks) > 20
        for block in blocks:
            assert "```" not in block
            assert block.count(r"\begin") == block.count(r"\end")

    def test_can_be_read_as_it_is(self) -> None:
        assert not re.search(r"&#?\w+;", markdown())

    def test_tables_have_one_width(self) -> None:
        lines = markdown(found_in(EVERY_KEY)).splitlines()
        for before, line in pairwise(lines):
            if before.startswith("|") and line.startswith("|"):
                assert before.count("|") == line.count("|"), line


@pytest.mark.parametrize("language", LANGUAGES)
class TestSummary:
    """What a report says without --detail full."""

    @staticmethod
    def page(language: str, *missions) -> Element:
        text = render(language, report(*missions), Style())
        return read_page(text) if language == "html" else as_page(text)

    def test_has_no_annex_and_says_where_one_is(self, language: str) -> None:
        page = self.page(language)
        heads = [squeezed(head.text).lower() for head in page.all("h2", "h3")]
        assert heads[-2:] == ["how this report was made", "approval"]
        assert not {"annex", "formulas with their numbers", "sources"} & set(heads)
        text = squeezed(page.text)
        assert "Not shown: 2 rows that pass or have no effect, 23 not declared (--detail full has them)." in text
        assert "receiver.velocity.x" not in text

    def test_images_and_draws_that_somebody_asked_for_are_an_annex(self, language: str) -> None:
        heads = [squeezed(head.text).lower() for head in self.page(language, illustrated()).all("h2", "h3")]
        assert heads[heads.index("approval") + 1 :] == ["annex", "image evidence"]

    def test_a_file_that_declares_nothing_shows_its_allowables(self, language: str) -> None:
        rows = table_with(self.page(language, findings()), "id", "allowable", "from")
        assert [cells[0] for cells in rows] == [row.id for row in findings().rows]

    def test_contributions_to_phase_and_location(self, language: str) -> None:
        """A position error of both platforms moves the image by its own size; a velocity error has a phase."""
        common = {"position": ["3 m", "4 mm", 0], "velocity": [0, "5 mm/s", 0]}
        found = findings(common_motion_error=common, allocation__model="full")
        page = self.page(language, found)
        moved = table_with(page, "owner", "kind", "displacement")
        assert moved[0][:4] == ["both platforms", "position", "x", "3 m"]
        assert table_with(page, "owner", "kind", "qpe")[0][1] == "velocity"

    def test_contributions_to_the_phase_are_of_equal_loss(self, language: str) -> None:
        """DVB-T: 16.2 deg, the quadratic part alone, stood below a requirement that is reached by 54.8 deg."""
        page = self.page(language, found_in(ROOT / "specs" / "missions" / "dvbt_aircraft.yaml"))
        assert table_with(page, "owner", "kind", "qpe")[0][:4] == ["receiver", "velocity", "y", "54.8 deg"]

    def test_only_the_largest_contributions(self, language: str) -> None:
        errors = [{"name": f"e{n:02}", "quadratic_phase_error": 0.001 * (n + 1)} for n in range(12)]
        page = self.page(language, findings(other_errors=errors))
        assert [cells[2] for cells in table_with(page, "owner", "kind", "qpe")] == [
            f"e{n:02}" for n in range(11, 5, -1)
        ]
        assert "the 6 largest of 12" in squeezed(page.text)

    def test_a_long_matrix_leaves_the_rows_that_use_least_to_the_annex(self, language: str) -> None:
        """And no row that does not pass, however many there are."""
        sizes = [2.0] * 30 + [0.001] * 30
        errors = [{"name": f"e{n:02}", "quadratic_phase_error": size} for n, size in enumerate(sizes)]
        page = self.page(language, findings(other_errors=errors))
        rows = table_with(page, "id", "requirement", "verified by")
        assert len(rows) == sum("fail" in cells for cells in rows) == 30
        fewer = [error | {"quadratic_phase_error": 2.0 if n < 5 else 0.001} for n, error in enumerate(errors)]
        rows = table_with(self.page(language, findings(other_errors=fewer)), "id", "requirement", "verified by")
        assert len(rows) == 16
        assert sum("fail" in cells for cells in rows) == 5
        assert "the annex" not in squeezed(page.text)

    def test_the_verdict_says_that_errors_are_judged_alone(self, language: str) -> None:
        alone = self.page(language, findings(timing_error__quadratic=1e-14))
        assert "Complies; each error alone" in squeezed(alone.text)
        together = self.page(language, findings(timing_error__quadratic=1e-14, allocation__combine="rss"))
        assert "each error alone" not in squeezed(together.text)
        both = self.page(language, found_in(SECTION_V), findings(allocation__combine="rss"))
        assert "each error alone in 1 of 2 missions" in squeezed(both.text)

    def test_the_angle_between_the_gradients(self, language: str) -> None:
        narrow = findings(platforms__receiver__velocity=[-40, -40, 0], platforms__transmitter__velocity=[-150, 5, 0])
        text = squeezed(self.page(language, narrow).text)
        assert "range and Doppler gradients 12.1° apart" in text
        assert "displacements are 4.8 times those at right angles" in text.partition("Contributions to phase and")[0]

    def test_the_requirement_is_the_one_that_binds(self, language: str) -> None:
        found = findings(timing_error__quadratic=1e-14, requirements={"location_error": 5, "cubic_phase_error": 0.2})
        bound = {"timing.quadratic": "location_error"}
        rows = tuple(row._replace(binding_requirement=bound.get(row.id)) for row in found.rows)
        cells = {c[0]: c for c in table_with(self.page(language, found._replace(rows=rows)), "id", "requirement")}
        assert "displacement ≤ 5 m" in cells["timing.quadratic"]
        free = {c[0]: c for c in table_with(self.page(language, found), "id", "requirement")}
        assert "QPE ≤ 22.5 deg, 0.5 of the budget" in free["timing.quadratic"]

    def test_many_missions_have_an_index_and_no_more_than_60_kb_each(self, language: str) -> None:
        """Five hundred missions below 30 MB: the examples, the largest of which decide."""
        paths = sorted((ROOT / "specs" / "missions").glob("*.yaml"))
        found = [found_in(path) for path in paths]
        text = render(language, report(*found), Style())
        assert len(text.encode()) < 60e3 * len(found)
        page = read_page(text) if language == "html" else as_page(text)
        index = table_with(page, "mission", "status", "quadratic phase error", "islr")
        assert len(index) == len(found)
        for cells, one in zip(index, found, strict=True):
            assert cells[0].startswith(one.name)
            assert cells[0].removesuffix(")").endswith(os.path.basename(one.file))
        if language == "html":
            linked = [a.attributes["href"] for table in page.all("table") for a in table.all("a")]
            assert linked[: len(index)] == [f"#m{number}" for number in range(1, len(index) + 1)]


def test_printed_pages_carry_mission_document_hash_and_page_number() -> None:
    """In the margins; a name is a string of the style sheet there, and cannot end it."""
    found = findings(name='A "name"; } body { color: red')
    text = render("html", report(found), Style())
    style = text[text.index("<style>") : text.index("</style>")]
    (name,) = re.findall(r'@top-left { content: "([^"]*)"', style)
    assert re.sub(r"\\([0-9a-f]+) ", lambda match: chr(int(match[1], 16)), name) == found.name
    digest = hashlib.sha256(found.mission.data).hexdigest()
    assert f'@bottom-left {{ content: "SHA\\2d 256 {digest}"' in style
    assert "counter(page)" in style
    several = render("html", report(found, found), Style())
    assert re.findall(r"@page (m\d) { @top-left", several) == ["m1", "m2"]


@pytest.mark.parametrize("language", [*LANGUAGES, "text", "junit"])
def test_number_issue_and_author_of_the_document(language: str) -> None:
    found = findings(document={"number": "SYS-12", "issue": "C", "author": "A. Writer"})
    text = squeezed(render(language, report(found), Style()))
    if language == "junit":
        assert '"document_number" value="SYS-12"' in text
        assert '"document_issue" value="C"' in text
    else:
        assert "SYS-12, issue C" in text
    assert "A. Writer" in text
    if language == "html":
        assert r'@top-right { content: "SYS\2d 12\2c issue C"; }' in text  # two blanks before they were squeezed
    silent = render(language, report(findings()), Style())
    assert not any(word in silent.lower() for word in ("issue", "author"))


# What could close a tag, end a cell, start markup, or turn the reading direction.
NASTY = st.text(
    st.sampled_from("ab1 <>&\"'`|*_[]()#~$\\{}:;@!-+=.^/%,\u202e\u2066\u200b\u00a0\t\nß") | st.characters(),
    min_size=1,
    max_size=25,
)
# The same without what no mission file may hold: controls, separators, marks that turn the reading direction.
_REFUSED = "".join(map(chr, (0x2028, 0x2029, 0xFEFF, *range(0x202A, 0x202F), *range(0x2066, 0x206A))))
ACCEPTED = st.text(
    st.sampled_from("ab1 <>&\"'`|*_[]()#~$\\{}:;@!-+=.^/%,\u200b\u00a0ß")
    | st.characters(exclude_categories=("Cc", "Cs"), exclude_characters=_REFUSED),
    min_size=1,
    max_size=25,
).filter(str.strip)


def nasty_findings(name: str, source: str) -> MissionFindings:
    """A mission with such texts wherever the file has text of its own."""
    return findings(
        name=name,
        platforms__transmitter__motion_error={"velocity": [0, "2 m/s", 0], "source": source},
        other_errors=[{"name": name, "quadratic_phase_error": 0.1, "source": source}],
        requirement_ids={"transmitter.velocity.y": source},
        waivers=[{"id": "transmitter.velocity.y", "until": "2027-01-01", "reason": source}],
    )


PLAIN_TAGS = {}


class TestNoNameDoesAnything:
    @examples(40)
    @given(ACCEPTED, ACCEPTED, NASTY)
    def test_html(self, name: str, source: str, file: str) -> None:
        found = nasty_findings(name, source)._replace(file=file)
        text = render("html", report(found), Style())
        assert not re.search("[\u202a-\u202e\u2066-\u2069\x00-\x08\x0b-\x1f]", text)
        page = read_page(text)
        tags = [element.tag for element in page.all() if element.tag != "wbr"]
        PLAIN_TAGS.setdefault("html", tags)
        assert tags == PLAIN_TAGS["html"]
        heading = next(head for head in page.all("h2") if head.attributes["id"] == "m1-h")
        assert heading.text == printable(found.name)

    @examples(40)
    @given(ACCEPTED, ACCEPTED, NASTY)
    def test_markdown(self, name: str, source: str, file: str) -> None:
        found = nasty_findings(name, source)._replace(file=file)
        text = markdown(found)
        page = as_page(text)
        tags = [element.tag for element in page.all()]
        PLAIN_TAGS.setdefault("markdown", tags)
        assert tags == PLAIN_TAGS["markdown"]
        heading = next(page.all("h2"))
        assert squeezed(heading.text) == squeezed(printable(found.name))
        cell = next(row for row in table_with(page, "id", "waiver") if row[0].startswith("transmitter.velocity.y"))
        # Markdown takes spaces at the ends of a cell and of a line.
        own_id = next(row.requirement_id for row in found.rows if row.id == "transmitter.velocity.y")
        assert "".join(cell[0].split()) == "".join(f"transmitter.velocity.y({printable(own_id)})".split())

    def test_names_that_are_markup(self) -> None:
        for name in ("<script>alert(1)</script>", "a | b", "`code`", "[x](y)", "$x$", "**b**", "__b__"):
            found = findings(name=name)
            assert f'<h2 id="m1-h">{name}' not in render("html", report(found), Style()) or "<" not in name
            head = next(as_page(markdown(found)).all("h2"))
            assert head.text == printable(name)
            assert not list(head.all())


class TestCommand:
    @pytest.fixture
    def mission(self, tmp_path, monkeypatch) -> Path:
        (tmp_path / "m.yaml").write_text(mission_text(**COMPLIES), encoding="utf-8")
        monkeypatch.chdir(tmp_path)
        monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
        return tmp_path

    def test_all_suffixes_in_one_run(self, run, mission) -> None:
        names = ("a.html", "b.htm", "out/c.md", "d.markdown")
        assert run("check", "m.yaml", *(part for name in names for part in ("--report", name))).exit_code == 0
        assert Path("a.html").read_bytes() == Path("b.htm").read_bytes()
        assert Path("a.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
        assert sorted(os.listdir("out")) == ["c.assets", "c.md"]
        assert sorted(os.listdir("out/c.assets")) == ["1-elevation.svg", "1-plan.svg"]
        assert "](c.assets/1-plan.svg)" in Path("out/c.md").read_text(encoding="utf-8")
        assert sorted(os.listdir(".")) == ["a.html", "b.htm", "d.assets", "d.markdown", "m.yaml", "out"]

    def test_the_same_bytes_by_either_option_and_in_any_process(self, run, mission) -> None:
        run("check", "m.yaml", "--report", "a.html", "--report", "a.md")
        first = Path("a.html").read_bytes()
        for seed in ("1", "2"):
            subprocess.run(
                [sys.executable, "-m", "bisar_budget", "check", "m.yaml", "--format", "html", "-o", "b.html"],
                env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)},
                check=True,
            )
            assert Path("b.html").read_bytes() == first
        text = Path("a.md").read_bytes()
        run("check", "m.yaml", "--format", "markdown", "-o", "a.md")
        assert Path("a.md").read_bytes() == text

    @pytest.mark.parametrize("language", LANGUAGES)
    def test_markdown_and_html_to_standard_output(self, run, mission, language) -> None:
        result = run("check", "m.yaml", "--format", language)
        assert result.exit_code == 0
        assert "1-plan.svg" not in result.stdout
        assert os.listdir(".") == ["m.yaml"]

    def test_a_special_file_gets_no_folder(self, run, mission) -> None:
        result = run("check", "m.yaml", "--format", "markdown", "-o", os.devnull)
        assert result.exit_code == 0
        assert os.listdir(".") == ["m.yaml"]

    def test_a_report_that_cannot_have_its_pictures_is_not_written(self, run, mission) -> None:
        Path("r.md").write_text("before")
        Path("r.assets").write_text("in the way")
        result = run("check", "m.yaml", "--report", "r.md")
        assert result.exit_code == 2
        assert "cannot write r.assets" in result.stderr
        assert Path("r.md").read_text() == "before"

    @pytest.mark.parametrize("content", [b"\xef\xbb\xbf", b"", b"# caf\xc3\xa9\r\n"])
    def test_the_digest_is_of_the_bytes_read(self, run, mission, content) -> None:
        data = content + mission_text().encode().replace(b"\n", b"\r\n")
        Path("m.yaml").write_bytes(data)
        digest = hashlib.sha256(data).hexdigest()
        assert digest in run("check", "m.yaml", "--format", "html").stdout
        assert digest in run("check", "-", "--format", "markdown", input=data).stdout

    def test_an_unusable_file_has_its_digest_and_exits_with_2(self, run, mission) -> None:
        Path("m.yaml").write_bytes(b"nonsense: [")
        for language in LANGUAGES:
            result = run("check", "m.yaml", "--format", language)
            assert result.exit_code == 2
            assert hashlib.sha256(b"nonsense: [").hexdigest() in result.stdout

    def options(self, run, *arguments: str, **more) -> dict[str, tuple[str, str]]:
        page = read_page(run("check", "m.yaml", "--format", "html", *arguments, **more).stdout)
        return {name: (value, origin) for name, value, origin in table_with(page, "option", "value", "from")}

    def test_each_option_says_where_it_came_from(self, run, mission) -> None:
        Path("pyproject.toml").write_text("[tool.bisar-budget]\nstrict = true\nmodel = 'full'\n")
        found = self.options(run, "--exit-zero", env={"BISAR_BUDGET_MODEL": "strictest"})
        assert found["--strict"] == ("yes", "pyproject.toml")
        assert found["--exit-zero"] == ("yes", "command line")
        assert found["--model"] == ("strictest", "environment, BISAR_BUDGET_MODEL")
        assert found["--verify"] == ("no", "default")
        assert found["--date"][1] == "default"

    def test_no_date_unless_somebody_gives_it(self, run, mission) -> None:
        from datetime import UTC, datetime

        without = run("check", "m.yaml", "--format", "html").stdout
        assert str(datetime.now(UTC).year) not in without.replace("m.yaml", "")
        assert self.options(run, "--date", "2026-11-21")["--date"] == ("2026-11-21", "command line")
        epoch = self.options(run, env={"SOURCE_DATE_EPOCH": "1795219200"})["--date"]
        assert epoch == ("2026-11-21", "environment, SOURCE_DATE_EPOCH")

    def test_a_waiver_is_judged_on_a_day_that_the_report_names(self, run, mission) -> None:
        """The same input gives the same report for ever, unless a waiver ends in between."""
        from datetime import UTC, datetime

        text = SECTION_V.read_text(encoding="utf-8")
        waiver = "waivers: [{id: transmitter.acceleration.x, until: 2999-01-01, reason: flight test}]\n"
        Path("m.yaml").write_text(text + waiver, encoding="utf-8")
        day, origin = self.options(run)["--date"]
        assert (day, origin) == (datetime.now(UTC).date().isoformat(), "the day of the run")
        assert day in squeezed(read_page(run("check", "m.yaml", "--format", "html").stdout).text)


def test_a_limit_has_one_size_on_a_page() -> None:
    """π/8 was 393 mrad as a requirement and in the allocation, and 392 mrad as the allowable."""
    changes = {
        "requirements__quadratic_phase_error": "785.4 mrad",
        "requirements__cubic_phase_error": "392.7 mrad",
        "allocation__combine": "sum",
        "platforms__transmitter__motion_error": {"velocity": "5 mm/s"},
    }
    document = compliance(report(findings(**changes)), Style())
    shown = matrix(document)
    row, cubic = shown["transmitter.quadratic_phase_error"], shown["mission.cubic_phase_error"]
    assert row["Allowable"] == cubic["Allowable"] == "392 mrad"
    assert row["Requirement"].startswith("QPE ≤ 392 mrad")
    assert cubic["Requirement"] == "cubic phase ≤ 392 mrad"
    assert lines(document, "Owner", "Share")[0]["Before autofocus"] == "392 mrad"
    requirement = lines(document, "Requirement", "Limit")[0]
    assert requirement["Limit"] == "785 mrad"  # as the file states it; the share has its own size
    assert requirement["Decided by"][-1].endswith(" of 392 mrad")
    assert not [words for _, words in facts(document, "inputs") if "393 mrad" in words]


def test_what_rows_say_alike_stands_once() -> None:
    """With a sum each single row says that the aggregate decides: forty lines of one sentence."""
    error = {"velocity": "5 mm/s", "acceleration": "1 mm/s^2"}
    found = findings(allocation__combine="sum", platforms__transmitter__motion_error=error)
    for text in (html(found).text, markdown(found)):
        assert text.lower().count("combine is sum: the aggregate decides.") == 1
    said = {(row_id, words) for ids, words in facts(compliance(report(found), FULL), "remarks")
            for row_id in ids.split(", ")}  # fmt: skip
    for row in found.rows:
        remarks = [text for text in (row.reason, *row.remarks) if text]
        assert ((row.id, f"{sentence('; '.join(remarks))}.") in said) == bool(
            remarks and row.status != "not_declared"
        )


def test_a_row_that_is_not_evaluated_has_no_margin() -> None:
    """What could not be evaluated has no use of its limit, so it has no margin to it."""
    found = findings(timing_error__quadratic=1e-14)
    rows = tuple(
        row._replace(status="not_evaluated", is_unjudged=True) if row.declared else row for row in found.rows
    )
    line = matrix(compliance(report(found._replace(rows=rows)), Style()))["timing.quadratic"]
    assert (line["Status"], line["Utilization"], line["Margin"]) == ("not_evaluated", "–", "–")
    assert line["Allowable"] != "no limit"


@pytest.mark.parametrize(
    ("model", "method"),
    [
        ("published", "analysis: Section V, wideband"),
        ("full", "analysis: first principles"),
        ("strictest", "analysis: first principles"),
    ],
)
def test_vibration_is_verified_by_the_model_that_gates(model: str, method: str) -> None:
    changes = {
        "platforms__transmitter__motion_error": {"vibration": {"wideband": {"rms": "10 um"}}},
        "requirements__islr": "-20 dB",
        "allocation__model": model,
    }
    shown = matrix(compliance(report(findings(**changes)), Style()))
    assert shown["transmitter.vibration.wideband"]["Verified by"] == method


def test_markdown_has_no_macro_that_github_refuses() -> None:
    r"""GitHub shows "macros are not allowed: operatorname" instead of the formula."""
    text = markdown(findings())
    assert r"\mathop{\mathrm{det}} Q" in text
    assert r"\operatorname" not in text


def test_the_file_has_one_name_in_every_section() -> None:
    """A path given as absolute was relative in the head and absolute in the formulas: bytes of the machine."""
    document = compliance(report(found_in(SECTION_V)), Style(root=str(ROOT), detail="full"))
    assert ("File", "specs/missions/rigling_moses_section_v.yaml") in facts(document, "facts")
    titles = [title for block in blocks_of(document) if isinstance(block, Steps) for title, _ in block.steps]
    assert any("Declared in specs/missions/rigling_moses_section_v.yaml:" in title for title in titles)
    assert not [title for title in titles if str(ROOT) in title]


def test_the_requirement_of_the_scenes_edge_is_its_allowable() -> None:
    """One autofocus correction serves the whole scene, so that its gain has no part."""
    changes = {
        "scene": {"radius": "250 m"},
        "autofocus": {"n_pull": 4},
        "allocation__model": "strictest",
        "platforms__transmitter__motion_error": {"velocity": "5 mm/s"},
    }
    line = matrix(compliance(report(findings(**changes)), Style()))["mission.spatial_variance"]
    assert line["Allowable"] in line["Requirement"]
    assert line["Verified by"] == "analysis: full model"
