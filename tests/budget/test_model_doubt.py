"""Where the published model decides and does not hold: the verdict says which row, and both allowables."""

import json
import math
from datetime import date

import pytest

from bisar_budget.analysis.analysis import Case
from bisar_budget.budget.check import check_mission
from bisar_budget.budget.doubts import model_doubt
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.mission.load import parse_mission
from bisar_budget.report import Style, render
from bisar_budget.units import format_limit
from tests.conftest import findings, row
from tests.families import FAMILIES
from tests.families import mission_text as of_family

DAY = date(2026, 1, 1)
ROW = "transmitter.acceleration.x"
PLAIN = {"platforms__transmitter__motion_error__acceleration": ["1 mm/s^2", 0, 0]}
# Of a position the published model knows no limit, whatever the full one says.
POSITION = {"platforms__receiver__motion_error__position": ["1 m", 0, 0]}


def squinted(degrees: float, model: str = "published", **changes) -> MissionFindings:
    """Section V with a receiver that looks forward, and a velocity error along its line of sight."""
    return findings(
        platforms__receiver={
            "slant_range": "8.5 km", "azimuth": "45 deg", "elevation": "13.6 deg", "speed": "60 m/s",
            "motion_azimuth": f"{135 - degrees!r} deg",
            "motion_error": {"velocity": ["5 mm/s", 0, 0]},
        },
        allocation__model=model,
        **changes,
    )  # fmt: skip


def ratio(degrees: float) -> float:
    found = row(squinted(degrees), "receiver.velocity.x")
    return found.allowable_published / found.allowable_full


class TestFivePercent:
    @pytest.mark.parametrize(
        ("published", "is_apart"),
        [(105.0, False), (105.000001, True), (95.0, False), (94.999999, True), (100.0, False), (None, True)],
    )
    def test_both_sides(self, published: float | None, is_apart: bool) -> None:
        """Of the full model's allowable, 100."""
        found = findings(**PLAIN)
        rows = [one._replace(allowable_published=published, allowable_full=100.0) for one in found.rows]
        assert bool(model_doubt(Case(found.analysed()), rows)) == is_apart

    @pytest.mark.parametrize(("full", "is_apart"), [(None, False), (1.0, True)])
    def test_no_limit_by_both_is_no_difference(self, full: float | None, is_apart: bool) -> None:
        found = findings(**PLAIN)
        rows = [one._replace(allowable_published=None, allowable_full=full) for one in found.rows]
        assert bool(model_doubt(Case(found.analysed()), rows)) == is_apart

    def test_both_sides_of_a_squint(self) -> None:
        """The squint at which a velocity's allowables are 5 % apart, by bisection; half a percent to either side."""
        low, high = 0.0, 40.0
        while high - low > 1e-6:
            middle = (low + high) / 2
            low, high = (middle, high) if abs(ratio(middle) - 1) <= 0.05 else (low, middle)
        assert abs(abs(ratio(low) - 1) - 0.05) < 1e-5
        assert squinted(low - 1e-3).model_doubt == ""
        assert squinted(high + 1e-3).model_doubt.code == "published-model-does-not-hold"


class TestWhoIsAsked:
    @pytest.mark.parametrize(("model", "says"), [("published", True), ("full", False)])
    def test_only_where_the_published_model_decides(self, model: str, says: bool) -> None:
        assert bool(findings(**POSITION, allocation__model=model).model_doubt) == says

    def test_strictest_only_where_a_published_row_is_the_stricter_one(self) -> None:
        """The full model alone limits a position, and its row decides; a velocity may be the published model's."""
        assert not findings(**POSITION, allocation__model="strictest").model_doubt
        stricter = next(d for d in (-60.0, -40.0, 40.0, 60.0) if ratio(d) < 0.95)
        found = squinted(stricter, "strictest")
        assert row(found, "receiver.velocity.x").model == "published"
        assert found.model_doubt
        looser = next(d for d in (-60.0, -40.0, 40.0, 60.0) if ratio(d) > 1.05)
        found = squinted(looser, "strictest")
        assert row(found, "receiver.velocity.x").model == "full"
        assert not found.model_doubt

    def test_what_is_not_declared_or_zero_does_not_count(self) -> None:
        undeclared = findings(**PLAIN)
        position = row(undeclared, "receiver.position.x")
        assert (position.allowable_published, position.allowable_full is None) == (None, False)
        assert undeclared.model_doubt == ""
        assert not findings(**PLAIN, platforms__receiver__motion_error__position=[0, 0, 0]).model_doubt

    @pytest.mark.parametrize("rule", ["each", "sum", "rss"])
    def test_every_rule_of_combination(self, rule: str) -> None:
        assert findings(**POSITION, allocation__combine=rule).model_doubt


class TestWhatIsSaid:
    def test_both_numbers_in_the_unit_of_the_row(self) -> None:
        found = squinted(50.0)
        one = row(found, "receiver.velocity.x")
        published, full = (format_limit(size, "m/s") for size in (one.allowable_published, one.allowable_full))
        assert published != full
        assert found.model_doubt == (
            f"the published model does not hold here: for receiver.velocity.x it allows {published}, "
            f"the full model {full}"
        )
        assert found.model_doubt.values == (one.id, one.allowable_published, one.allowable_full, "m/s", 0)

    def test_the_worst_and_how_many_others(self) -> None:
        """Named is the error of whose use the models differ most: 20 m of 93 m, not 1 mm."""
        found = findings(platforms__receiver__motion_error__position=["20 m", "1 mm", 0])
        limits = [row(found, f"receiver.position.{axis}").allowable_full for axis in "xy"]
        assert None not in limits
        assert found.model_doubt.startswith("the published model does not hold here: for receiver.position.x")
        assert "without limit, the full model" in found.model_doubt
        assert found.model_doubt.endswith("; for 1 other declared error the models differ by more than 5 % too")
        found = findings(platforms__receiver__motion_error__position=["20 m", "1 mm", "1 mm"])
        assert found.model_doubt.endswith("; for 2 other declared errors the models differ by more than 5 % too")

    @pytest.mark.parametrize("family", FAMILIES)
    def test_it_is_an_independent_count(self, family: str) -> None:
        """Rows of declared errors as stated, by their allowables."""
        for seed in range(6):
            mission = parse_mission(of_family(family, seed), "m.yaml", "published")
            whole = check_mission(mission, DAY)
            count = 0
            for one in whole.rows:
                kinds = ("position", "velocity", "acceleration", "timing", "terrain", "other")
                if one.subject.kind not in kinds or not one.declared or not one.is_independent:
                    continue
                limits = [math.inf if x is None else x for x in (one.allowable_published, one.allowable_full)]
                count += limits[0] != limits[1] and not abs(limits[0] / limits[1] - 1) <= 0.05
            assert whole.model == "full" or count == (
                whole.model_doubt.values[4] + 1 if whole.model_doubt else 0
            )  # fmt: skip


class TestShown:
    SAID = "the published model does not hold here: for receiver.position.x it allows without limit, the full model"

    @staticmethod
    def text(found: MissionFindings, name: str) -> str:
        text = render(name, Report(version="", missions=(found,)), Style())
        assert isinstance(text, str)
        return text

    def test_a_terminal_says_it_before_the_geometry(self) -> None:
        text = self.text(findings(**POSITION), "text")
        first = " ".join(text.partition("\n\n")[0].split())
        assert self.SAID.removeprefix("the ") in first
        assert self.SAID.removeprefix("the ") not in " ".join(self.text(findings(**PLAIN), "text").split())

    def test_json(self) -> None:
        found = findings(**POSITION)
        (mission,) = json.loads(self.text(found, "json"))["missions"]
        assert mission["model_doubt"] == found.model_doubt
        assert mission["model_doubt_code"] == "published-model-does-not-hold"
        (mission,) = json.loads(self.text(findings(**PLAIN), "json"))["missions"]
        assert (mission["model_doubt"], mission["model_doubt_code"]) == (None, None)

    @pytest.mark.parametrize("name", ["markdown", "html"])
    def test_reports_say_it_beside_the_verdict(self, name: str) -> None:
        said = self.SAID.removeprefix("the ")
        text = self.text(findings(**POSITION), name).replace("\\", "")
        before, _, _ = text.partition("The " + said)
        heading = {"markdown": "\n#", "html": "<h3"}[name]
        assert heading not in before[before.rindex("Complies") :]
        assert said in text
        assert said not in self.text(findings(**PLAIN), name).replace("\\", "")
