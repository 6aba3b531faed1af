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
WHERE = [
    ("drones", 36),
    ("aircraft", 3),
    ("jets", 12),
    ("satellite_aircraft", 32),
    ("satellite_fixed", 3),
    ("geostationary_drone", 4),
]


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


@pytest.fixture(scope="module")
def aircraft() -> MissionFindings:
    """A transmitter position of 30 m where no point has the range history from 10.8 m on, judged by itself."""
    return check_mission(mission_of("aircraft", 3), TODAY)


OVER = "transmitter.position.line_of_sight"


@pytest.fixture(scope="module")
def end_m(aircraft: MissionFindings) -> float:
    """The size at which the phase that is hidden beyond the fold is as large as is allowed, by the reference."""
    assert aircraft.mission is not None
    (error,) = (one for one in reference.errors_of(aircraft.mission) if one.id == OVER)
    sizes = np.append(np.linspace(0.2, 10.6, 53), np.linspace(10.9, 11.8, 46))
    hidden = reference.Lanes(aircraft.mission, [error]).follow(sizes[None]).hidden[0]
    assert hidden[sizes <= 10.6].max() < 2e-3
    limit = aircraft.allocation.qpe_limit("transmitter")
    beyond = int(np.argmax(hidden > limit))
    return float(np.interp(limit, hidden[beyond - 1 : beyond + 1], sizes[beyond - 1 : beyond + 1]))


def test_a_row_over_it_says_so(aircraft: MissionFindings, end_m: float) -> None:
    """It said `QPE without a value`, and that a phase is what binds."""
    one = row(aircraft, OVER)
    assert one.status == "fail"
    assert one.allowable == pytest.approx(end_m, rel=1e-3), "the reference is straight between sizes"
    size = f"{math.floor(10 * end_m) / 10:g} m"
    said = f"the image ends at {size}: no ground point has the range history of a larger error"
    assert one.reason == said
    assert one.reason.code == "beyond-the-image"


@pytest.mark.parametrize("name", ["text", "json", "csv", "markdown", "html", "junit", "sarif"])
def test_every_format_names_it(aircraft: MissionFindings, name: str) -> None:
    text = render(name, Report(version="", missions=(aircraft,)), Style())
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


def test_a_terminal_has_it_in_the_column_of_what_binds(aircraft: MissionFindings) -> None:
    lines = render("text", Report(version="", missions=(aircraft,)), Style()).splitlines()
    (line,) = (lines[place + 1] for place, text in enumerate(lines) if text == f"FAIL     {OVER}")
    assert line.split(" % ")[1] == "end of the image"
    assert all(len(text) <= 80 for text in lines)


def test_the_explanation_says_what_it_means(aircraft: MissionFindings, end_m: float) -> None:
    assert aircraft.mission is not None
    text = " ".join(explain(aircraft.mission, aircraft, OVER).split())
    assert "End of the image: no ground point has the range history of a larger error" in text
    (by_image,) = re.findall(r"by_image = ([\d.]+)", text)
    assert float(by_image) == pytest.approx(end_m, rel=1e-3)
    assert "Allowable: the smallest, by by_image" in text
    other = explain(aircraft.mission, aircraft, "receiver.acceleration.y")
    assert "End of the image" not in other
    assert row(aircraft, "receiver.acceleration.y").binding_requirement == QUADRATIC
