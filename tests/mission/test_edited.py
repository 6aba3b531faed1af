"""A mission file with values put in place: all else stays, comments included, and it is the mission of `--set`."""

import difflib

import pytest
import yaml

from bisar_budget.faults import SetValue
from bisar_budget.mission.edited import with_section, with_values
from bisar_budget.mission.load import parse_mission
from tests.conftest import ROOT

EXAMPLES = sorted((ROOT / "specs" / "missions").glob("*.yaml"))
CHANGES = [
    SetValue("platforms.receiver.motion_error.acceleration", "7 ug"),
    SetValue("platforms.receiver.motion_error.lever_arm.uncertainty", "2 mm"),
    SetValue("platforms.transmitter.motion_error.acceleration", "5 ug"),
    SetValue("allocation.combine", "rss"),
    SetValue("allocation.split", "equal"),
    SetValue("requirements.cubic_phase_error", "20 deg"),
]
# What reading notes beside the mission: where each thing stands, and what changed it.
WHENCE = ("data", "changes", "places", "parts")


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_it_is_the_mission_with_the_options_and_every_comment(file) -> None:
    text = file.read_text()
    edited = with_values(text, CHANGES)
    one, other = parse_mission(edited, str(file)), parse_mission(text, str(file), changes=CHANGES)
    for field in one._fields:
        if field not in WHENCE:
            assert getattr(one, field) == getattr(other, field), field
    assert comments(edited) == comments(text)
    kept = sum(line.startswith("  ") for line in difflib.ndiff(text.splitlines(), edited.splitlines()))
    assert kept >= len(text.splitlines()) - len(CHANGES)


def comments(text: str) -> list[str]:
    return [line.partition("#")[2] for line in text.splitlines() if "#" in line]


@pytest.mark.parametrize(
    ("text", "key", "edited"),
    [
        ("a: 1 m # far\nb: 2\n", "a", "a: 9 # far\nb: 2\n"),
        ("a: {b: 1, c: 2} # both\n", "a.d", "a: {b: 1, c: 2, d: 9} # both\n"),
        ("a: {}\n", "a.b", "a: {b: 9}\n"),
        ("a: [1 m, 2 m, 3 m]\nb: 1\n", "a", "a: 9\nb: 1\n"),
        ("a: [1 m, 2 m]\n", "a.1", "a: [1 m, 9]\n"),
        ("a:\n  - 1 m\n  - 2 m # of these\n# next\nb: 1\n", "a", "a: 9\n  # of these\n  # next\nb: 1\n"),
        ("a:\n  b:\n  - 1\n  - 2\n  c:\n  - 3\n", "a.b", "a:\n  b: 9\n  c:\n  - 3\n"),
        ("a: # k: 6\n  - 1 m\n  # k8\n  - 2 m # k9\nb: 1\n", "a", "a: 9 # k: 6\n  # k8\n  # k9\nb: 1\n"),
        ("a: 1 # so\r\nb:\r\n  c: 2\r\n", "b.d", "a: 1 # so\r\nb:\r\n  c: 2\r\n  d: 9\r\n"),
        ("a:\n  b: 1\n  # the end of a\nc: 1\n", "a.d", "a:\n  b: 1\n  d: 9\n  # the end of a\nc: 1\n"),
        ("a:\n  b: 1\n", "c.d.e", "a:\n  b: 1\nc: {d: {e: 9}}\n"),
        ("a:\nb: 1\n", "a.c", "a: {c: 9}\nb: 1\n"),
        ("a:\n  - name: x\n    b: 1\n", "a.0.b", "a:\n  - name: x\n    b: 9\n"),
        ("a: 'quoted' # so\n", "a", "a: 9 # so\n"),
        ("µ: ü # ä\na: 1 # ö\n", "a", "µ: ü # ä\na: 9 # ö\n"),
    ],
)
def test_one_value(text: str, key: str, edited: str) -> None:
    assert with_values(text, [SetValue(key, "9")]) == edited


@pytest.mark.parametrize(
    ("above", "below"),
    [
        ("requirements:\n  islr: 5 m # so\n", None),
        (
            "requirements:\n  location_error: 5 m # so\n",
            "requirements:\n  location_error: {limit: 5 m, confidence: 9} # so\n",
        ),
        ("requirements: {location_error: 5 m}\n", "requirements: {location_error: {limit: 5 m, confidence: 9}}\n"),
    ],
)
def test_a_confidence_beside_a_limit_alone(above: str, below: str | None) -> None:
    name = "location_error" if below else "other"
    edited = with_values(above, [SetValue(f"requirements.{name}.confidence", "9")])
    assert edited == (below or f"{above}  other: {{confidence: 9}}\n")


@pytest.mark.parametrize("size", ["[1 s, 2 s] # so\n", "\n    - 1 s\n    - 2 s # so\n"])
def test_a_bias_beside_the_sizes_of_axes(size: str) -> None:
    text = f"common_motion_error:\n  position: {size}  frame: scene\n"
    edited = with_values(text, [SetValue("common_motion_error.position.bias", "9")])
    assert yaml.safe_load(edited) == {
        "common_motion_error": {"position": {"sigma": ["1 s", "2 s"], "bias": 9}, "frame": "scene"}
    }
    assert "# so" in edited


@pytest.mark.parametrize(
    ("text", "edited"),
    [
        ("a: 1 # so\n", "a: 1 # so\ns:\n  a.b: 1 m\n  c: 2\n"),
        ("a: 1", "a: 1\ns:\n  a.b: 1 m\n  c: 2\n"),
        ("a: 1\n# the end\n", "a: 1\ns:\n  a.b: 1 m\n  c: 2\n# the end\n"),
        ("a:\n  b: 1\n\n", "a:\n  b: 1\ns:\n  a.b: 1 m\n  c: 2\n\n"),
        ("s:\n  d: 1 # old\n# next\na: 1\n", "s:\n  a.b: 1 m\n  c: 2\n# next\na: 1\n"),
        ("s: {d: 1} # of these\na: 1\n", "s: {a.b: 1 m, c: 2} # of these\na: 1\n"),
        ("a: 1\ns:\n  d: 1\n", "a: 1\ns:\n  a.b: 1 m\n  c: 2\n"),
        ("{a: 1, s: {d: 1}}\n", "{a: 1, s: {a.b: 1 m, c: 2}}\n"),
        ("{a: 1}\n", "{a: 1, s: {a.b: 1 m, c: 2}}\n"),
        ("{\n  a: 1, # so\n}\n", "{\n  a: 1, s: {a.b: 1 m, c: 2}, # so\n}\n"),
        ("a: 1\r\nb: 2\r\n", "a: 1\r\nb: 2\r\ns:\r\n  a.b: 1 m\r\n  c: 2\r\n"),
    ],
)
def test_a_section(text: str, edited: str) -> None:
    assert with_section(text, "s", {"a.b": "1 m", "c": "2"}) == edited
    assert with_section(edited, "s", {"a.b": "1 m", "c": "2"}) == edited
