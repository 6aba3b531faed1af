"""Sentences for users, as they are written: what the bad missions and wrong options provoke, read for form."""

import ast
import re
from collections.abc import Iterator

import pytest

from bisar_budget.faults import closed, fault_words, sentences
from tests.acceptance.test_missions import BAD
from tests.conftest import ROOT, UAV_FREE_RUNNING, mission_text

SECTION_V = ROOT / "specs/missions/rigling_moses_section_v.yaml"

# What a sentence never has: a capital within it, a small letter at its begin, two marks at its end, a loose end.
MALFORMED = {
    "a capital within a sentence": re.compile(r"[;,:] [A-Z][a-z]* [a-z]"),
    "a small letter behind a full stop": re.compile(r"(?<!\d)\. [a-z]"),
    "two marks": re.compile(r"[?;,:]\.|\.\.(?![./\w])|;;|[?.];"),
    "a mark at the end that ends nothing": re.compile(r"[;,:]$"),
    "a blank too many": re.compile(r"\S  +\S|\s$"),
}
# Words of the file and of the command line, which are as they are.
_CITED = re.compile(r"'[^']*'|`[^`]*`|\(got [^)]*\)")


def malformed(message: str) -> list[str]:
    text = _CITED.sub("#", message)
    return [name for name, pattern in MALFORMED.items() if pattern.search(text)]


@pytest.mark.parametrize(
    ("message", "found"),
    [
        ("must be greater than 0 Hz; A bare number is in Hz", "a capital within a sentence"),
        ("is unknown. see the list", "a small letter behind a full stop"),
        ("Did you mean 'x'?. Read with y", "two marks"),
        ("is not known..", "two marks"),
        ("accepted: a, b;", "a mark at the end that ends nothing"),
        ("is  there", "a blank too many"),
    ],
)
def test_what_is_malformed_is_found(message: str, found: str) -> None:
    assert found in malformed(message)


@pytest.mark.parametrize("path", BAD, ids=lambda path: path.stem)
def test_faults_of_files_are_sentences(run, path) -> None:
    for line in run("check", path, "-q").stderr.splitlines():
        message = line.removeprefix(str(path))
        assert not malformed(message), message


def texts_of_the_package() -> Iterator[tuple[str, str]]:
    """Every text of the source but docstrings, with # for what is put in, and where it stands."""
    for file in sorted((ROOT / "bisar_budget").rglob("*.py")):
        nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
        docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        joined = [node for node in nodes if isinstance(node, ast.JoinedStr)]
        skipped = docstrings | {id(part) for text in joined for part in text.values}
        texts = [node for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
        for node in (*joined, *(text for text in texts if id(text) not in skipped)):
            where = f"{file.relative_to(ROOT)}:{node.lineno}"
            if isinstance(node, ast.JoinedStr):
                yield where, "".join(str(p.value) if isinstance(p, ast.Constant) else "#" for p in node.values)
            else:
                yield where, str(node.value)


def test_no_text_of_the_package_has_a_capital_within_a_sentence() -> None:
    capital = MALFORMED["a capital within a sentence"]
    found = [(where, text) for where, text in texts_of_the_package() if capital.search(_CITED.sub("#", text))]
    assert found == []


LISTED = f"`bisar-budget check {SECTION_V} --all` lists them"
BARE = "'0' must be greater than 0 Hz. A bare number is in Hz\n"
USAGES = (
    (
        ("check", "-", "--explain", "foo"),
        "--explain foo: no row or requirement has this id; `bisar-budget check - --all` lists them.\n",
    ),
    (("check", "-", "--explain", "receiver.velocty.x"), "lists them. Did you mean 'receiver.velocity.x'?\n"),
    (("check", "-", "--set", "radar.bandwith=3 MHz"), "bandwidth. Did you mean 'radar.bandwidth'?\n"),
    (
        ("check", "-", "--set", "radar.x=3"),
        "--set radar.x: is not a known key; accepted: center_frequency, bandwidth\n",
    ),
    (("check", "-", "--set", "radar.bandwidth"), "accepted: KEY=VALUE, such as radar.bandwidth=150MHz.\n"),
    (("check", "-", "--set", "radar.bandwidth=010 MHz"), "write it without the zero\n"),
    (("check", "-", "--set", "radar.bandwidth=!!str 3"), "(got tag:yaml.org,2002:str); accepted: plain values\n"),
    (("check", "-", "--set", "radar.bandwidth=[3"), "while parsing a flow sequence, "),
    (("check", "-", "--set", "radar=3"), "(got 3); accepted: center_frequency, bandwidth\n"),
    (("verify", SECTION_V, "--only", "foo"), f"no row with a limit matches, nothing was verified; {LISTED}.\n"),
    (("solve", SECTION_V, "--for", "radar.bandwidth", "--between", "0..3"), BARE),
    (("solve", SECTION_V, "--for", "radar.bandwidth", "--row", "foo"), f"--row foo: no row has this id; {LISTED}\n"),
    (
        ("solve", SECTION_V, "--for", "platforms.receiver.azimuth", "--between", "0..180"),
        "only zero needs no unit. Did you mean '180 deg' or '180 rad'?\n",
    ),
    (
        ("solve", SECTION_V, "--for", "platforms.transmitter.latitude", "--between", "1deg..2deg"),
        "no value of the range makes a mission: platforms.transmitter.latitude: mixes",
    ),
    (
        ("solve", SECTION_V, "--for", "allocation.model"),
        "such as collection.aperture_time. `bisar-budget sweep --vary` compares what it can be\n",
    ),
    (("sweep", SECTION_V, "--vary", "radar.bandwidth=0:3:3"), BARE),
    (("sweep", SECTION_V, "--vary", "radar.bandwith=1:3MHz:3"), "Did you mean 'radar.bandwidth'?\n"),
    (
        ("sweep", SECTION_V, "--vary", "radar.bandwidth=1:3MHz:3", "--column", "foo.margin"),
        f"--column foo.margin: no row has this id; {LISTED}\n",
    ),
)


@pytest.mark.parametrize(("arguments", "said"), USAGES, ids=range(len(USAGES)))
def test_wrong_usage_is_a_sentence(run, arguments, said: str) -> None:
    result = run(*arguments, input=mission_text())
    assert result.exit_code == 2
    assert said in result.stderr
    for line in result.stderr.splitlines():
        if not line.startswith(("Usage:", "Try ")):
            assert not malformed(line.replace(str(SECTION_V), "m.yaml")), line


def test_a_hint_that_asks_has_no_full_stop_behind_it(run) -> None:
    """`Did you mean 'x'?. Read with …` was what a misspelt key had beside an option."""
    text = mission_text().replace("bandwidth", "bandwith")
    said = run("check", "-", "-q", "--set", "name=x", input=text).stderr
    assert "Did you mean 'bandwidth'? Read with --set name=x\n" in said


def test_an_unknown_part_has_its_hint_last(run) -> None:
    """The hint stood before the value that was given."""
    file = str(UAV_FREE_RUNNING)
    said = run("check", file, "-q", "--set", "platforms.receiver.motion_error.sensor=stim30").stderr
    assert said.endswith(
        "is no part of the catalogue (got stim30); accepted: parts of the kind imu or gnss. `bisar-budget sensors` "
        "lists them. Did you mean 'stim300'?\n"
    )


def test_an_unknown_variable_has_its_nearest(run, monkeypatch) -> None:
    monkeypatch.setenv("BISAR_BUDGET_STRIKT", "1")
    assert "BISAR_BUDGET_COLOR. Did you mean 'BISAR_BUDGET_STRICT'?" in run("check", SECTION_V).stderr


def test_a_finding_is_whole_sentences(run) -> None:
    """What decides began with a small letter behind the full stop: "165 % of it used. displacement of the image"."""
    document = run("check", *sorted((ROOT / "specs" / "missions").glob("*.yaml")), "--format", "github").stdout
    messages = [line.rpartition("::")[2] for line in document.splitlines() if line.startswith("::")]
    assert len(messages) > 10
    assert any("of it used. Displacement of the image" in message for message in messages)
    assert not [message for message in messages if re.search(r" used\. (?!\S*\.\S)[a-z]", message)]


def test_sentences_are_joined_by_one_mark() -> None:
    assert sentences("one", "", "Two?", "Three") == "one. Two? Three"
    assert fault_words("is wrong", "3", "accepted: 4", "Did you mean '4'?") == (
        "is wrong (got 3); accepted: 4. Did you mean '4'?"
    )
    assert [closed(text) for text in ("a", "a.", "a?")] == ["a.", "a.", "a?"]
