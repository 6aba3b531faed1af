"""What a mission file must declare, by `requirements.declare`; the document that it names."""

import itertools
import json
import re

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.mission.model import DECLARABLE, Document
from bisar_budget.report import FORMATS, Style, render
from tests.conftest import findings, row

ALL = {"position": "1 cm", "velocity": "0.1 mm/s", "acceleration": "1 ug"}
ERROR = "platforms__{}__motion_error"
PLATFORMS = ("transmitter", "receiver")


def declared(**changes):
    """Everything declared, then changed."""
    tree = {ERROR.format(name): dict(ALL) for name in PLATFORMS} | {"timing_error": {"constant": "1 ns"}}
    return tree | changes


def not_evaluated(found) -> dict[str, str]:
    return {r.id: r.reason for r in found.rows if r.status == "not_evaluated"}


def test_a_file_that_declares_all_that_is_asked_for_is_judged() -> None:
    found = findings(requirements__declare=list(DECLARABLE), **declared())
    assert not_evaluated(found) == {}
    assert found.status == "pass"


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
@pytest.mark.parametrize(("name", "kind"), list(itertools.product(PLATFORMS, ALL)))
def test_what_is_missing_is_not_evaluated_and_named(name: str, kind: str, combine: str) -> None:
    without = {key: value for key, value in ALL.items() if key != kind}
    changes = declared(**{ERROR.format(name): without})
    reason = f"the file has no platforms.{name}.motion_error.{kind}, which requirements.declare asks for"
    found = findings(requirements__declare=[kind], allocation__combine=combine, **changes)
    assert not_evaluated(found) == {f"{name}.{kind}.{axis}": reason for axis in "xyz"}
    assert found.status == "not_evaluated"
    assert all(row(found, f"{name}.{kind}.{axis}").declared is None for axis in "xyz")
    others = [other for other in DECLARABLE if other != kind]
    assert not_evaluated(findings(requirements__declare=others, allocation__combine=combine, **changes)) == {}


def test_the_clock_is_declared_by_any_term() -> None:
    asked = {"requirements__declare": ["timing"]}
    ids = {f"timing.{term}" for term in ("constant", "linear", "quadratic", "cubic")}
    missing = not_evaluated(findings(**asked, **declared(timing_error={})))
    assert missing == dict.fromkeys(ids, "the file has no timing_error, which requirements.declare asks for")
    for term in ("constant", "linear", "quadratic", "cubic"):
        assert not_evaluated(findings(**asked, **declared(timing_error={term: 0}))) == {}


def test_an_error_in_another_frame_and_a_covariance_declare_too() -> None:
    receiver = {"frame": "track", "covariance": {"position": "1 cm", "velocity": "0.1 mm/s"}}
    found = findings(
        requirements__declare=["position", "velocity"],
        **declared(**{ERROR.format("transmitter"): {"frame": "look", **ALL}, ERROR.format("receiver"): receiver}),
    )
    assert not_evaluated(found) == {}
    found = findings(requirements__declare=["acceleration"], **declared(**{ERROR.format("receiver"): receiver}))
    assert set(not_evaluated(found)) == {f"receiver.acceleration.{axis}" for axis in "xyz"}


def test_a_common_error_says_nothing_of_the_platforms_own() -> None:
    found = findings(requirements__declare=["position"], common_motion_error={"position": "1 m"})
    assert len(not_evaluated(found)) == 6


def test_a_fixed_receiver_declares_that_it_does_not_move_by_zero() -> None:
    receiver = {"position": ["6 km", "6 km", "2 km"], "velocity": [0, 0, 0], "motion_error": ALL | {"velocity": 0}}
    found = findings(
        requirements__declare=["velocity"],
        platforms__receiver=receiver,
        platforms__transmitter__motion_error=ALL,
    )
    assert not_evaluated(found) == {}


@pytest.mark.parametrize("format_name", sorted(FORMATS))
def test_every_format_says_what_is_missing(format_name: str) -> None:
    found = findings(requirements__declare=["velocity"], **declared(**{ERROR.format("receiver"): {"position": 1}}))
    text = render(format_name, Report(version="0", missions=(found,)), Style())
    plain = re.sub(r"<wbr/?>|\\", "", text)  # marks where a line may break, and escaped points
    assert "which requirements.declare asks for" in re.sub(r"\s+", " ", plain)
    assert "receiver.velocity.x" in plain


def test_the_document_is_carried_into_findings_and_json() -> None:
    document = {"number": "DOC-7", "issue": 3, "author": "A. Nobody"}
    found = findings(document=document)
    assert found.document == Document(number="DOC-7", issue="3", author="A. Nobody")
    (mission,) = json.loads(render("json", Report(version="0", missions=(found,)), Style()))["missions"]
    assert mission["document"] == {"number": "DOC-7", "issue": "3", "author": "A. Nobody"}
    (mission,) = json.loads(render("json", Report(version="0", missions=(findings(),)), Style()))["missions"]
    assert mission["document"] == {"number": None, "issue": None, "author": None}
