"""Contract: every key of every error section, alone, through every command; no command ignores one or crashes.

Where a command cannot take an error into account, its first lines or its notes say so. A key of the model without an
entry in `error_keys` fails the first test.
"""

import io
import json
import math
import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import bisar_budget as bb
from bisar_budget.cli import cli
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from bisar_budget.questions.simulate import SimulationError
from bisar_budget.report.drawing import point_plot
from tests.conftest import APART
from tests.contract.error_keys import (
    DESCRIBING_KEYS,
    ERROR_KEYS,
    OSCILLATOR,
    RECEIVER,
    REGISTERED,
    Document,
    keys_of_the_model,
    mission_with,
    mission_with_key,
    mission_without_key,
    number_in,
    path_of,
    registered,
)

KEYS = pytest.mark.parametrize("key", ERROR_KEYS)
DRAWS = 2000
NOT_DRAWN = ("vibration-is-not-drawn", "stated-power-is-not-drawn")  # notes of Monte Carlo that list rows
# Keys whose mission has other drawn errors beside that of the row, because the key has no effect without them.
BESIDE_OTHERS = (
    *(
        f"{RECEIVER}motion_error.{key}"
        for key in ("covariance.position", "covariance.velocity", "sensor", "lever_arm.arm")
    ),
    *(
        f"{OSCILLATOR}{key}"
        for key in ("aging", "acceleration_sensitivity", "vibration.spectrum", "vibration.spectrum_level")
    ),
    *(
        f"synchronization.{key}"
        for key in ("error", "interval", "method", "age", "averaging", "time_error", "frequency_error")
    ),
)
DEVIATIONS = 5  # standard deviations by which a drawn rms may differ from its expectation
LAST_FIRST_LINE = "displacement"  # of the summary of `simulate`: what it flies is said above this line


@pytest.fixture(autouse=True, scope="module")
def own_kind() -> Iterator[None]:
    """The kind of error of the key `registered` is there during these tests."""
    with registered():
        yield


def a_few(step: int, *always: str) -> list[Any]:
    """Every `step`-th key, and some others, as parameters of a test that takes long; the rest is `thorough`."""
    return [
        pytest.param(key, marks=() if key in always or number % step == 0 else pytest.mark.thorough)
        for number, key in enumerate(ERROR_KEYS)
    ]


def loaded(document: Document) -> Mission:
    return bb.loads(json.dumps(document), "mission.yaml")


def checked(document: Document) -> bb.CheckResult:
    return _checked(json.dumps(document))


@cache  # many tests ask for the same missions, which many keys have beside them
def _checked(text: str) -> bb.CheckResult:
    return bb.check(loaded(json.loads(text)))


def findings_with(key: str) -> MissionFindings:
    return checked(mission_with_key(key)).findings


def row_of(key: str) -> Row:
    (row,) = [row for row in findings_with(key).rows if row.id == ERROR_KEYS[key].row]
    return row


def written(folder: Path, name: str, document: Document) -> str:
    file = folder / name
    file.write_text(json.dumps(document), encoding="utf-8")
    return str(file)


def command(*args: str) -> Result:
    """Run a command that has to answer: no crash, and no error of usage or of the file."""
    result = CliRunner(**APART).invoke(cli, [*args])
    assert result.exit_code in (0, 1), result.stderr
    return result


def test_every_key_of_the_model_is_tested() -> None:
    assert keys_of_the_model() == {*ERROR_KEYS, *DESCRIBING_KEYS}


@KEYS
def test_check_uses_the_error(key: str) -> None:
    row = row_of(key)
    assert row.declared is not None
    assert row.status not in ("not_declared", "not_evaluated")
    assert row.utilization is not None
    assert row.utilization > 0


@KEYS
def test_check_differs_with_the_key(key: str) -> None:
    with_key, without_key = (
        checked(document).to_dict()["missions"][0]["rows"]
        for document in (mission_with_key(key), mission_without_key(key))
    )
    assert used(with_key).get(ERROR_KEYS[key].row) != used(without_key).get(ERROR_KEYS[key].row)


def used(rows: list[Any]) -> dict[str, tuple[object, ...]]:
    return {row["id"]: (row["declared"], row["utilization"]) for row in rows}


@KEYS
def test_the_kind_of_the_error_is_declared(key: str) -> None:
    """As `requirements.declare` names it; what `not_declared` lists is not declared."""
    kind = kind_of(key)
    assert kind in findings_with(key).kinds.declared
    assert kind not in checked(mission_with_key(key)).to_dict()["missions"][0]["not_declared"]
    document = mission_with_key(key)
    document["requirements"]["declare"] = [kind]
    status = {row.id: row.status for row in checked(document).findings.rows}
    assert status["mission.declare"] == "pass"


def kind_of(key: str) -> str:
    """Kind of the error of a key, as `requirements.declare` names it."""
    parts = key.split(".")
    if parts[0] == "platforms":
        kind = "oscillator" if parts[2] == "oscillator" else parts[-1] if "registered" in parts else parts[3]
        if kind == "covariance":
            kind = "velocity" if parts[-1] == "velocity" else "position"
        return f"receiver.{'imu' if kind == 'sensor' else kind}"
    return {
        "scene": "terrain",
        "common_motion_error": "common",
        "timing_error": "timing",
        "other_errors": "other",
    }.get(parts[0], parts[0])


@KEYS
def test_explain_derives_the_row(key: str, tmp_path: Path) -> None:
    row = ERROR_KEYS[key].row
    result = command("check", written(tmp_path, "mission.yaml", mission_with_key(key)), "--explain", row)
    assert row in result.stdout
    assert len(result.stdout.splitlines()) > 3


@pytest.mark.parametrize("key", sorted({*ERROR_KEYS} - {"synchronization.method"}))  # each method has other keys
def test_sweep_varies_the_key(key: str) -> None:
    column = f"{ERROR_KEYS[key].row}.utilization"
    path, *values = number_in(key)
    table = bb.sweep(loaded(mission_with_key(key)), {path: [*map(str, values)]}, columns=[column], jobs=1)
    first, second = table.to_dataframe()[column]
    assert first != second


@pytest.mark.parametrize("key", a_few(4, REGISTERED))
def test_solve_takes_the_key_or_says_what_it_takes(key: str, tmp_path: Path) -> None:
    file = written(tmp_path, "mission.yaml", mission_with_key(key))
    answers_or_says_what_it_takes(CliRunner(**APART).invoke(cli, ["solve", file, "--for", path_of(key)]), key)


def answers_or_says_what_it_takes(result: Result, key: str) -> None:
    """A refusal names the key, the reason and what is accepted; an answer names the key."""
    if result.exit_code == 2:
        assert re.search(rf"{re.escape(path_of(key))}: \S.*; accepted: \S", " ".join(result.stderr.split()))
    else:
        assert result.exit_code in (0, 1), result.stderr
        assert path_of(key) in result.stdout


@KEYS
def test_sensitivity_ranks_the_number(key: str) -> None:
    effects = bb.sensitivity(loaded(mission_with_key(key))).to_dict()["missions"][0]
    assert path_of(key) in json.dumps(effects)


@pytest.mark.parametrize("key", a_few(2, REGISTERED))
def test_allocate_specifies_the_key_or_says_what_it_specifies(key: str, tmp_path: Path) -> None:
    file = written(tmp_path, "mission.yaml", mission_with_key(key))
    answers_or_says_what_it_takes(CliRunner(**APART).invoke(cli, ["allocate", file, "--for", path_of(key)]), key)


@KEYS
def test_diff_names_the_change(key: str, tmp_path: Path) -> None:
    before = written(tmp_path, "before.yaml", mission_without_key(key))
    after = written(tmp_path, "after.yaml", mission_with_key(key))
    listed = command("diff", before, after, "--all").stdout
    path = path_of(key)
    assert any(name in listed for name in (path, path.rpartition(".")[0], path.split(".")[0]))
    assert ERROR_KEYS[key].row in listed


@KEYS
def test_reports_name_the_row(key: str, tmp_path: Path) -> None:
    file = written(tmp_path, "mission.yaml", mission_with_key(key))
    reports = [tmp_path / f"report.{suffix}" for suffix in ("html", "md")]
    command("check", file, "--detail", "full", *(f"--report={report}" for report in reports))
    for report in reports:
        assert ERROR_KEYS[key].row in report.read_text(encoding="utf-8").replace("\\", "")


@cache
def exported(text: str, folder: Path) -> bytes:
    """CPHD of a mission, from `simulate -o FILE.cphd`."""
    mission, history = folder / "mission.yaml", folder / "history.cphd"
    mission.write_text(text, encoding="utf-8")
    command("simulate", str(mission), "-o", str(history))
    return history.read_bytes()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("sarkit.cphd")
    return tmp_path_factory.mktemp("histories")


def phase_history(content: bytes) -> Any:
    """Samples of a phase history, (pulses, frequencies), beside the measured positions of its vectors."""
    from sarkit import cphd

    with cphd.Reader(io.BytesIO(content)) as reader:
        signal, vectors = reader.read_channel("1")
    return np.concatenate((signal / np.abs(signal).max(), (vectors["TxPos"] + vectors["RcvPos"]) / 1e3), axis=1)


@KEYS
def test_a_phase_history_has_the_error(key: str, folder: Path) -> None:
    """The signal differs from the signal without the key, or the first lines of `simulate` name the row as not flown.

    The signal of `simulate -o FILE.cphd` is that of the images of `simulate`.
    """
    with_key, without_key = (
        phase_history(exported(json.dumps(document), folder))
        for document in (mission_with_key(key), mission_without_key(key))
    )
    if with_key.shape == without_key.shape and np.allclose(with_key, without_key, rtol=0, atol=1e-6):
        assert is_left_out(ERROR_KEYS[key].row, point_plot.flown_words(loaded(mission_with_key(key))))


def is_left_out(row: str, words: str) -> bool:
    """Whether the words of `simulate` name a row among those that are not flown."""
    return re.search(rf"without \w+ \([^)]*\b{re.escape(row)}\b", " ".join(words.split())) is not None


@KEYS
def test_an_exported_header_states_the_error(key: str, folder: Path) -> None:
    content = exported(json.dumps(mission_with_key(key)), folder)
    header = content[: content.index(b"</CPHD>")].decode()
    errors = header[header.index("<ErrorParameters>") : header.index("</ErrorParameters>")]
    assert any(name in errors for name in header_names(key)), errors


def header_names(key: str) -> tuple[str, ...]:
    """Names in the header for the error of a key: an element of the standard, or the row as an added parameter."""
    row = ERROR_KEYS[key].row
    elements = {"timing.constant": "DelayBias", "timing.linear": "ClockFreqSF"}
    owner, _, kind = row.partition(".")
    if owner in ("receiver", "common") and kind.split(".")[0] in ("position", "velocity", "quadratic_phase_error"):
        return ("PosVelErr",)
    return elements.get(row, row), row.rpartition(".")[0] if row.split(".")[1] == "acceleration" else row


@pytest.mark.parametrize("key", a_few(24, f"{OSCILLATOR}spurs", "other_errors.islr", REGISTERED))
def test_the_image_has_the_error(key: str) -> None:
    """As the phase history; an image that cannot be formed says why."""
    try:
        with_key = bb.simulate(loaded(mission_with_key(key)))
        without_key = bb.simulate(loaded(mission_without_key(key)))
    except SimulationError as error:
        assert str(error)
        return
    images = with_key.images.rotated, without_key.images.rotated
    if images[0].shape == images[1].shape and np.allclose(*images, rtol=0, atol=1e-6):
        first_lines = point_plot.summary(with_key.images, loaded(mission_with_key(key))).partition(LAST_FIRST_LINE)[0]
        assert is_left_out(ERROR_KEYS[key].row, first_lines)


@pytest.mark.parametrize("key", a_few(24, REGISTERED))
def test_verify_forms_images_of_the_row_or_says_why_not(key: str) -> None:
    try:
        (verdict,) = bb.verify(loaded(mission_with_key(key)), ERROR_KEYS[key].row, jobs=1).rows
    except bb.QuestionError as error:
        assert ERROR_KEYS[key].row in str(error)
        return
    assert verdict.verdict != "not_evaluated" or verdict.reason


@KEYS
def test_monte_carlo_draws_the_error_or_says_that_it_does_not(key: str) -> None:
    """The rms of the draws is that of the row, or of all errors if the key needs others; or a note names the row.

    The row of a tone has its worst phase, and the draws have all phases.
    """
    drawn = bb.monte_carlo(loaded(mission_with_key(key)), DRAWS)
    row = row_of(key)
    if any(note.code in NOT_DRAWN and row.id in note.values[0] for note in drawn.notes):
        return
    sigmas = {requirement.id: requirement for requirement in drawn.requirements}
    effects = {
        "mission.quadratic_phase_error": abs(row.qpe_full_rad or 0.0),
        "mission.cubic_phase_error": row.cubic_rad or 0.0,
        "mission.location_error": math.hypot(*(row.displacement_m or (0.0, 0.0))),
    }
    if f"{RECEIVER}motion_error.vibration.sinusoidal" in key:
        effects = {name: worst / math.sqrt(2) for name, worst in effects.items()}
    if key.endswith(".bias"):  # the rms of the draws is that of bias and random parts
        assert row.bias is not None
        assert row.declared
        effects["mission.quadratic_phase_error"] = abs(row.equal_loss_qpe_rad or row.qpe_full_rad or 0.0)
        of_bias = {name: abs(row.bias) / row.declared * effect for name, effect in effects.items()}
        assert any(of_bias[name] for name in of_bias.keys() & sigmas.keys())
        for name in of_bias.keys() & sigmas.keys():
            rms = math.hypot(of_bias[name], sigmas[name].sigma_rss)
            assert sigmas[name].sigma == pytest.approx(rms, rel=DEVIATIONS / math.sqrt(2 * DRAWS), abs=1e-5)
        return
    shares = {
        name: effects[name] / requirement.sigma_rss
        for name, requirement in sigmas.items()
        if name in effects and requirement.sigma_rss
    }
    assert shares, [*drawn.notes]
    assert max(shares.values()) > (0.1 if key in BESIDE_OTHERS else 0.999)
    for name, share in shares.items():
        requirement = sigmas[name]
        of_row = effects[name] if share > 0.999 else requirement.sigma_rss
        assert requirement.sigma == pytest.approx(of_row, rel=DEVIATIONS / math.sqrt(2 * DRAWS))


# What errors of a section affect, as their kinds have to say; a platform's section is that of its motion errors.
AFFECTED = {
    "scene": "platform",
    "platforms": "platform",
    "common_motion_error": "platform",
    "timing_error": "clock",
    "synchronization": "clock",
    "propagation": "air",
    "other_errors": "image",
}


# Rows about vibrations and tones, which are judged as stated. Of a vibration, only noise has the factor.
TONES = re.compile(r"receiver\.(vibration\.(sinusoidal|wideband)|oscillator\.spur\.0|oscillator\.acceleration\.0)")
STATED_KEYS = pytest.mark.parametrize(
    "key", sorted({*ERROR_KEYS} - {f"{RECEIVER}motion_error.covariance.correlation"})
)  # without the key whose row is a sum


@STATED_KEYS
def test_a_kind_says_what_its_errors_affect(key: str) -> None:
    affected = "clock" if key.startswith(OSCILLATOR) else AFFECTED[key.split(".")[0]]
    assert row_of(key).subject.source_kind.moves == affected


@STATED_KEYS
def test_a_kind_says_whether_the_coverage_factor_multiplies_its_errors(key: str) -> None:
    """The size of a row has the factor if its kind says so; drawn errors do not have it."""
    document = mission_with_key(key)
    document["allocation"] = {"coverage_factor": 2}
    (covered,) = [row for row in bb.check(loaded(document)).findings.rows if row.id == ERROR_KEYS[key].row]
    row = row_of(key)
    if row.unit != "dB" and not TONES.match(row.id):  # a level is relative to what the file states
        factor = 2 if row.subject.source_kind.is_covered else 1
        assert covered.declared == pytest.approx(factor * row.declared, rel=1e-9)
    for with_factor, without in zip(drawn_from(document), drawn_from(mission_with_key(key)), strict=True):
        assert with_factor.sigma == pytest.approx(without.sigma, rel=1e-6)


def drawn_from(document: Document) -> Sequence[Any]:
    return bb.monte_carlo(loaded(document), 200).requirements


@pytest.mark.parametrize("key", DESCRIBING_KEYS)
def test_a_key_that_describes_an_error_changes_what_is_said_of_it(key: str, tmp_path: Path) -> None:
    """Findings, draws or sources differ, and `diff` names the change."""
    beside, *values = DESCRIBING_KEYS[key]
    documents = [mission_with({**beside, **({} if value is None else {path_of(key): value})}) for value in values]
    answers = [answered(document) for document in documents]
    assert answers[0] != answers[1]
    after, before = (
        written(tmp_path, f"{name}.yaml", document)
        for name, document in zip(("after", "before"), documents, strict=True)
    )
    assert key.split(".")[-1] in command("diff", before, after, "--all").stdout
    for arguments in (["check", after, "--monte-carlo", "10"], ["sensitivity", after]):
        command(*arguments)


def answered(document: Document) -> tuple[object, ...]:
    result = checked(document)
    (mission,) = result.to_dict()["missions"]
    evidence = [row.evidence for row in result.findings.rows]
    return mission["rows"], mission["without_source"], evidence, bb.monte_carlo(loaded(document), 100).requirements
