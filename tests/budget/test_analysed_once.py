"""A mission is analysed once, whatever is written about it."""

from datetime import date

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.effects.sources import ErrorListing
from bisar_budget.findings.mission import Report
from bisar_budget.mission.load import parse_mission
from bisar_budget.ranges.exact_ranges import ExactRanges
from bisar_budget.report import Style, render
from bisar_budget.report.explain.explanation import explain
from bisar_budget.sampling.probability import monte_carlo
from tests.conftest import TEXT_FORMATS, mission_text


@pytest.fixture
def counted(monkeypatch) -> dict[str, int]:
    """How often errors were listed and exact ranges set up."""
    count = {"error_sources": 0, "exact ranges": 0}
    listed, set_up = ErrorListing.listed, ExactRanges.__init__

    def error_sources(errors):
        count["error_sources"] += 1
        return listed(errors)

    def init(*arguments, **named) -> None:
        count["exact ranges"] += 1
        set_up(*arguments, **named)

    monkeypatch.setattr(ErrorListing, "listed", error_sources)
    monkeypatch.setattr(ExactRanges, "__init__", init)
    return count


@pytest.mark.parametrize("detail", ["summary", "full"])
@pytest.mark.parametrize("format_name", TEXT_FORMATS)
def test_every_format_needs_one_analysis(counted, format_name: str, detail: str) -> None:
    found = check_mission(parse_mission(mission_text()), date(2026, 1, 1))
    render(format_name, Report(version="", missions=(found,)), Style(detail=detail, verbosity=1))
    assert counted == {"error_sources": 1, "exact ranges": 1}


def test_explanations_and_draws_go_on_from_it(counted) -> None:
    mission = parse_mission(mission_text(allocation__model="strictest"))
    found = check_mission(mission, date(2026, 1, 1))
    for row in found.rows:
        explain(mission, found, row.id)
    monte_carlo(found.analysed(), 100, 1)
    assert counted == {"error_sources": 1, "exact ranges": 1}
