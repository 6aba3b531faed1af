"""Where the image ends: the limit beyond which no ground point has the range history, and what every output calls it.

Exact ranges are those of `tests.reference`, which have nothing from the package's own search.
"""

import csv
import io
import json
import math
import re

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.effects.declared import END_OF_IMAGE, QUADRATIC
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.findings.row import Row
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.report import Style, render
from bisar_budget.report.explain.explanation import explain
from tests import reference
from tests.conftest import TODAY, row
from tests.families import mission_text

# The allowables are of all kinds of error, with and without autofocus.
WHERE = [("drones", 36), ("drones", 42), ("aircraft", 3), ("geostationary_drone", 4)]
# At a fold the hidden phase reaches its limit, and the way goes on: by a hundredth of the size, to twice the size.
FOLDS = [("aircraft", 3), ("jets", 12), ("satellite_aircraft", 32), ("satellite_fixed", 19), ("satellite_fixed", 23)]


def mission_of(family: str, seed: int) -> Mission:
    return parse_mission(mission_text(family, seed), "m.yaml", "full")


def ending(found: MissionFindings) -> list[Row]:
    return [one for one in found.rows if one.binding_requirement == END_OF_IMAGE]


@pytest.mark.parametrize(("family", "seed"), WHERE)
def test_a_point_is_there_just_inside_and_none_beyond(family: str, seed: int) -> None:
    """Inside the phases of both signs are below what is allowed: no requirement is what sets the size.

    Beyond, the point of least variance is gone, or it no longer has the range history: more phase is hidden there
    than is allowed. The allowable is safe where it lies at the fold, from where on phase is hidden, by up to 10 %.
    """
    mission = mission_of(family, seed)
    found = check_mission(mission, TODAY)
    rows = ending(found)
    assert rows
    errors = {error.id: error for error in reference.errors_of(mission)}
    lanes = reference.Lanes(mission, [errors[one.id] for one in rows])
    parts = np.append(np.linspace(0.02, 0.98, 49), (1.02, 1.1))
    sizes = np.outer([one.allowable for one in rows], parts)
    allocation = found.allocation
    gain = allocation.autofocus_gain
    judged = np.array([lanes.follow(sign * sizes).judged(gain) for sign in (1.0, -1.0)])
    limit = np.array([allocation.qpe_limit(one.owner) * gain for one in rows])
    assert (judged[:, :, :-2] < limit[:, None]).all(), "and not a number is not below"
    is_within = judged[:, :, -1] <= limit
    assert not is_within.all(axis=0).any(), "of one sign at least no point is left"


@pytest.mark.parametrize(("family", "seed"), FOLDS)
def test_a_fold_is_no_end(family: str, seed: int) -> None:
    """The phase that is hidden beyond a fold reaches its limit: the requirement binds, and there.

    Such a row was called the end of the image. The allowable of transmitter.velocity.y of `satellite_fixed` 23 was
    5 % too small: the peak that was followed fades at the fold into a wider one.
    """
    mission = mission_of(family, seed)
    found = check_mission(mission, TODAY)
    errors = {error.id: error for error in reference.errors_of(mission)}
    rows = [one for one in found.rows if one.id in errors and one.binding_requirement == QUADRATIC]
    lanes = reference.Lanes(mission, [errors[one.id] for one in rows])
    gain = found.allocation.autofocus_gain
    parts = np.append(np.linspace(0.02, 0.98, 49), (1.0, 1.02))
    seen = [lanes.follow(sign * np.outer([one.allowable for one in rows], parts)) for sign in (1.0, -1.0)]
    judged = np.array([one.judged(gain) for one in seen])
    limit = np.array([found.allocation.qpe_limit(one.owner) * gain for one in rows])
    at_fold = np.array([gain * one.hidden[:, -2] for one in seen]).max(axis=0) > 0.9 * limit
    assert at_fold.any()
    assert (judged[:, at_fold, :-2] < limit[at_fold, None]).all()
    assert not (judged[:, at_fold, -1] <= limit[at_fold]).all(axis=0).any()


@pytest.mark.parametrize(("family", "seed"), WHERE)
def test_where_a_requirement_is_reached_first_it_binds(family: str, seed: int) -> None:
    """A tenth of the phase that a point has just inside is reached before: the size is smaller, and the phase's."""
    mission = mission_of(family, seed)
    found = check_mission(mission, TODAY)
    analysis = found.analysed()
    sources = {source.id: source for source in analysis.sources}
    for one in ending(found)[:4]:
        source = sources[one.id]
        inside = [analysis.full.at(source, sign * 0.98 * one.allowable) for sign in (1.0, -1.0)]
        phase = max(abs(there.quadratic) for there in inside if there is not None)
        size = analysis.full.allowable(source, QUADRATIC, phase / 10)
        assert size is not None
        assert size < one.allowable
        assert not analysis.full.ends_image(source, size)


OVER = "common.position.z"


@pytest.fixture(scope="module")
def drones() -> MissionFindings:
    """A common height error of 25 m where no point has the range history from 19.7 m on, judged by itself."""
    text = mission_text("drones", 42)
    assert "position: [3, -3, 2.533]" in text
    return check_mission(parse_mission(text.replace("2.533]", "25]"), "m.yaml", "full"), TODAY)


@pytest.fixture(scope="module")
def end_m(drones: MissionFindings) -> float:
    """The size at which the way ends, by the reference, to a thousandth."""
    assert drones.mission is not None
    (error,) = (one for one in reference.errors_of(drones.mission) if one.id == OVER)
    sizes = np.append(np.linspace(0.2, 19.4, 97), np.linspace(19.41, 20, 60))
    judged = reference.Lanes(drones.mission, [error]).follow(-sizes[None]).judged(1.0)[0]
    assert np.nanmax(judged) < 0.5, "of 2.24 rad that are allowed"
    return float(sizes[np.isnan(judged).argmax()])


def test_a_row_over_it_says_so(drones: MissionFindings, end_m: float) -> None:
    """It said `QPE without a value`, and that a phase is what binds."""
    one = row(drones, OVER)
    assert one.status == "fail"
    assert one.allowable == pytest.approx(end_m, rel=1e-3)
    size = f"{math.floor(10 * end_m) / 10:g} m"
    said = f"the image ends at {size}: no ground point has the range history of a larger error"
    assert one.reason == said
    assert one.reason.code == "beyond-the-image"


def test_a_row_beyond_a_fold_says_what_it_reaches_first() -> None:
    """30 m is larger than any error with an image; the hidden phase reaches its limit at 11.3 m."""
    one = row(check_mission(mission_of("aircraft", 3), TODAY), "transmitter.position.line_of_sight")
    assert (one.status, one.binding_requirement) == ("fail", QUADRATIC)
    assert one.reason == (
        "no ground point has the range history of so large an error: its QPE reaches 6.28 rad at 11.3 m"
    )


@pytest.mark.parametrize("name", ["text", "json", "csv", "markdown", "html", "junit", "sarif"])
def test_every_format_names_it(drones: MissionFindings, name: str) -> None:
    text = render(name, Report(version="", missions=(drones,)), Style())
    assert isinstance(text, str)
    if name == "json":
        rows = {one["id"]: one for one in json.loads(text)["missions"][0]["rows"]}
        assert rows[OVER]["binding_requirement"] == "end_of_image"
    elif name == "csv":
        rows = {one["id"]: one for one in csv.DictReader(io.StringIO(text))}
        assert rows[OVER]["binding_requirement"] == "end_of_image"
    elif name in ("junit", "sarif"):
        assert "end_of_image" in text
    else:
        assert "end of the image" in text


def test_a_terminal_has_it_in_the_column_of_what_binds(drones: MissionFindings) -> None:
    lines = render("text", Report(version="", missions=(drones,)), Style()).splitlines()
    (line,) = (text for text in lines if text.startswith(f"FAIL     {OVER}"))
    assert line.split(" % ")[1] == "end of the image"
    assert all(len(text) <= 80 for text in lines)


def test_the_explanation_says_what_it_means(drones: MissionFindings, end_m: float) -> None:
    assert drones.mission is not None
    text = " ".join(explain(drones.mission, drones, OVER).split())
    assert "End of the image: no ground point has the range history of a larger error" in text
    (by_image,) = re.findall(r"by_image = ([\d.]+)", text)
    assert float(by_image) == pytest.approx(end_m, rel=1e-3)
    assert "Allowable: the smallest, by by_image" in text
    other = explain(drones.mission, drones, "common.acceleration.y")
    assert "End of the image" not in other
    assert row(drones, "common.acceleration.y").binding_requirement == QUADRATIC
