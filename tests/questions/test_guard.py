"""`check --guard`: the probability that a verdict is wrong, against closed forms and own draws."""

import math
from typing import Any

import numpy as np
import pytest

import bisar_budget as bb
from bisar_budget.findings.guard import Guard, GuardedRequirement
from bisar_budget.report import Style, render
from tests.conftest import mission_text

VELOCITY = "platforms__receiver__motion_error__velocity"
FULL = {"model": "full", "combine": "rss"}


def _check(guard: bool = True, **changes: Any) -> bb.CheckResult:
    return bb.check(bb.loads(mission_text(**changes)), guard=guard)


def _guard(**changes: Any) -> Guard:
    guard = _check(**changes).findings.guard
    assert guard is not None
    return guard


def _of(guard: Guard, key: str = "location_error") -> GuardedRequirement:
    return next(requirement for requirement in guard.requirements if requirement.key == key)


def _below(value: float) -> float:
    return 0.5 * math.erfc(-value / math.sqrt(2))


@pytest.mark.parametrize("use", [0.5, 0.8, 0.95, 1.05, 1.4, 2.0])
@pytest.mark.parametrize("rules", [{}, FULL], ids=["published", "full"])
def test_one_error_that_grows_with_its_size(use: float, rules: dict[str, str]) -> None:
    """U = s·c and s is log-normal: the probability that s·c is above 1 is Φ(ln U / u)."""
    at_one = _check(guard=False, **{VELOCITY: "5 mm/s"}, requirements={"location_error": "5 m"}, allocation=rules)
    size = 5 * use / (at_one.requirements["location_error"].utilization or 0.0)
    changes: dict[str, Any] = {"requirements": {"location_error": "5 m"}, "allocation": rules}
    found = _of(_guard(**{VELOCITY: f"{size!r} mm/s ± 20 %"}, **changes))
    assert found.use == pytest.approx(use, rel=2e-3)
    assert found.use_uncertainty == pytest.approx(0.2 * found.use, rel=2e-3)
    expected = _below(-abs(math.log(found.use)) / 0.2)
    assert found.probability == pytest.approx(expected, rel=0.01)
    assert (found.false_acceptance is None) == (use > 1) == (found.false_rejection is not None)


def test_an_absolute_uncertainty_is_the_same() -> None:
    of_percent, of_unit = (
        _of(_guard(**{VELOCITY: f"50 mm/s {text}"}, requirements={"location_error": "5 m"}))
        for text in ("± 20 %", "± 10 mm/s")
    )
    assert of_percent == of_unit


def test_two_figures_by_root_sum_square() -> None:
    """With `sum` the utilization is a·s + b·r: the uncertainties add by their shares, squared."""
    changes: dict[str, Any] = {
        "other_errors": [
            {"name": "a", "quadratic_phase_error": "10 deg ± 2 %"},
            {"name": "b", "quadratic_phase_error": "30 deg ± 3 %"},
        ],
        "requirements": {"quadratic_phase_error": "41 deg"},
        "allocation": {"combine": "sum", "model": "full"},
    }
    found = _of(_guard(**changes), "quadratic_phase_error")
    relative = math.hypot(0.25 * 0.02, 0.75 * 0.03)
    assert (found.use_uncertainty or 0.0) / found.use == pytest.approx(relative, rel=2e-3)
    assert found.probability == pytest.approx(_below(math.log(found.use) / relative), rel=0.01)


def test_a_figure_of_three_axes_is_one_figure() -> None:
    scalar, axes = (
        _of(_guard(**{VELOCITY: value}, requirements={"location_error": "5 m"}, allocation=FULL))
        for value in ("50 mm/s ± 20 %", ["50 mm/s ± 20 %"] * 3)
    )
    assert scalar.use == pytest.approx(axes.use)
    assert scalar.use_uncertainty == pytest.approx(0.2 * scalar.use, rel=1e-3)
    assert (axes.use_uncertainty or 1.0) < 0.99 * (scalar.use_uncertainty or 0.0)


@pytest.mark.parametrize("limit", ["4.5 m", "3.3 m"])
def test_against_own_draws_of_the_figures(limit: str) -> None:
    """20 000 missions with figures drawn from their log-normal distributions, each checked."""
    generator = np.random.default_rng(7)
    figures = {
        "platforms.receiver.motion_error.velocity.1": (50e-3, 0.2),
        "platforms.transmitter.motion_error.velocity.1": (50e-3, 0.25),
        "platforms.receiver.motion_error.position.0": (2.0, 0.15),
        "timing_error.constant": (8e-9, 0.1),
    }
    changes: dict[str, Any] = {
        "platforms__receiver__motion_error": {"velocity": [0, "50 mm/s ± 20 %", 0], "position": ["2 m ± 15 %", 0, 0]},
        "platforms__transmitter__motion_error": {"velocity": [0, "50 mm/s ± 25 %", 0]},
        "timing_error__constant": "8 ns ± 10 %",
        "requirements": {"location_error": limit},
        "allocation": FULL,
    }
    mission = bb.loads(mission_text(**changes))
    assert {figure.key for figure in mission.uncertainties} == figures.keys()
    drawn = {key: size * np.exp(u * generator.standard_normal(20_000)) for key, (size, u) in figures.items()}
    swept = bb.sweep(mission, drawn, paired=True, columns="mission.location_error.utilization")
    uses = np.asarray(swept["mission.location_error.utilization"])
    found = _of(bb.check(mission, guard=True).findings.guard or Guard())
    wrong = np.mean((uses > 1) != (found.use > 1))
    assert 0.01 < wrong < 0.5
    assert found.probability == pytest.approx(wrong, abs=0.005)


def test_without_an_uncertain_figure_there_is_no_number() -> None:
    result = _check(**{VELOCITY: "5 mm/s"}, requirements={"location_error": "5 m"})
    assert result.findings.guard == Guard()
    assert result.to_dict()["missions"][0]["guard"] == {"requirements": [], "figures": []}
    report = " ".join(render("text", result._report, Style()).split())
    assert "Guard: no figure states an uncertainty, such as 5 mm ± 20 %." in report
    for form in ("html", "markdown"):
        assert "no figure states an uncertainty" in render(form, result._report, Style())


def test_a_requirement_that_no_uncertain_figure_changes_has_no_number() -> None:
    changes: dict[str, Any] = {
        "other_errors": [{"name": "a", "quadratic_phase_error": "10 deg ± 20 %"}],
        "requirements": {"quadratic_phase_error": "45 deg", "location_error": "5 m"},
    }
    guard = _guard(**{VELOCITY: "5 mm/s"}, **changes)
    assert _of(guard).probability is None
    assert _of(guard).use_uncertainty is None
    report = render("text", _check(**{VELOCITY: "5 mm/s"}, **changes)._report, Style())
    words = "Guard: location error is met; no probability follows from the uncertain figures."
    assert words in " ".join(report.split())


def test_levels_and_their_requirement() -> None:
    noise = {
        "frequency": "10 MHz",
        "phase_noise": {"1 Hz": "-60 dBc/Hz", "1 kHz": "-110 dBc/Hz"},
        "level": "0 dB ± 1 dB",
    }
    synchronization = {"method": "linear", "interval": "100 ms", "error": "1 deg"}
    changes: dict[str, Any] = {
        "platforms__receiver__oscillator": noise,
        "platforms__transmitter__oscillator": noise | {"level": "0 dB"},
        "synchronization": synchronization,
        "requirements": {"islr": "-20 dB"},
        "allocation": FULL,
    }
    found = _of(_guard(**changes), "islr")
    assert 0 < (found.use_uncertainty or 0.0) / found.use < math.log(10) / 20 * 1.05


def test_a_requirement_with_a_confidence() -> None:
    """The quantile of a single error grows with its size, like its sigma."""
    location = {"limit": "5 m", "confidence": "95 %"}
    found = _of(
        _guard(**{VELOCITY: ["50 mm/s ± 20 %", 0, 0]}, requirements={"location_error": location}, allocation=FULL)
    )
    assert (found.use_uncertainty or 0.0) / found.use == pytest.approx(0.2, rel=0.01)
    assert found.probability == pytest.approx(_below(-abs(math.log(found.use)) / 0.2), rel=0.02)


def test_nothing_changes_without_guard() -> None:
    """The uncertainty is in no number, no sentence and no byte, but for the digest of the file."""
    changes: dict[str, Any] = {"requirements": {"location_error": "5 m", "quadratic_phase_error": "45 deg"}}
    stated, plain = (bb.loads(mission_text(**{VELOCITY: value}, **changes)) for value in ("5 mm/s ± 20 %", "5 mm/s"))
    for form in ("text", "json", "csv"):
        reports = [render(form, bb.check(mission)._report, Style(verbosity=1)) for mission in (stated, plain)]
        assert reports[0] == reports[1]
    assert "guard" not in bb.check(stated).to_dict()["missions"][0]


def test_other_questions_take_the_figure_alone() -> None:
    changes: dict[str, Any] = {"requirements": {"location_error": "5 m"}, "allocation": FULL}
    stated, plain = (bb.loads(mission_text(**{VELOCITY: value}, **changes)) for value in ("5 mm/s ± 20 %", "5 mm/s"))
    key = "platforms.receiver.motion_error.velocity"
    assert bb.solve(stated, key).value == bb.solve(plain, key).value
    assert (
        bb.sensitivity(stated).to_dict()["missions"][0]["numbers"]
        == bb.sensitivity(plain).to_dict()["missions"][0]["numbers"]
    )
    times = {"collection.aperture_time": ["5 s", "6 s"]}
    assert [*bb.sweep(stated, times)["utilization"]] == [*bb.sweep(plain, times)["utilization"]]


def test_a_report_has_the_sentence_or_the_table() -> None:
    result = _check(**{VELOCITY: "70 mm/s ± 20 %"}, requirements={"location_error": "5 m"})
    found = _of(result.findings.guard or Guard())
    probability = f"{100 * (found.probability or 0.0):.2g} %"
    sentence = f"Guard: location error is met; the probability that this is wrong is {probability} (use "
    assert sentence in " ".join(render("text", result._report, Style()).split())
    for form in ("html", "markdown"):
        report = render(form, result._report, Style())
        assert "Probability that a verdict is wrong, from the stated uncertainties of figures" in report
        assert probability in report
    assert probability in result._repr_html_()
