"""Tables by kind of error are complete: each has all the kinds that can reach it, and no other."""

from collections.abc import Iterable

from bisar_budget.error_kinds import ErrorKind, SourceKind, StateKind, SumKind, kinds
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.row import SPECIFICATION
from bisar_budget.report.compliance.rows import LIMIT_FORMS
from bisar_budget.report.explain.explained_error import CLOCK_TERMS
from bisar_budget.report.explain.explained_random import RANDOM_STEPS
from bisar_budget.report.explain.explanation import ROW_STEPS
from bisar_budget.report.explain.notation import STATE_LETTERS

# Rows of errors that are no sources and no random errors: tones, a stated ISLR, and the residual of a log.
APART = {"oscillator.acceleration", "oscillator.spur", "vibration", "other", "trajectory.residual"}


def names(some_kinds: Iterable[ErrorKind]) -> set[str]:
    return {kind.name for kind in some_kinds}


SOURCES = [kind for kind in kinds() if isinstance(kind, SourceKind)]
SUMS = [kind for kind in kinds() if isinstance(kind, SumKind)]


def test_limit_forms() -> None:
    """A sum without a requirement of its own has a form for its limit."""
    assert set(LIMIT_FORMS) == names(SUMS) - set(REQUIREMENT_NAMES) - {SPECIFICATION}


def test_clock_terms() -> None:
    """A clock error that is neither random nor a term of the clock error itself has its terms."""
    clocks = names(kind for kind in SOURCES if kind.moves == "clock" and not kind.is_random)
    assert set(CLOCK_TERMS) == clocks - {"timing"} | {"oscillator.aging"}


def test_random_steps() -> None:
    """A random error has steps, and so has an error of which the file states only the effect."""
    expected = names(kind for kind in SOURCES if kind.is_random or kind.moves == "image")
    assert set(RANDOM_STEPS) == expected | {"oscillator.acceleration"}


def test_row_steps() -> None:
    """A sum has steps, and so has an error that is judged by its tones, its power or its log."""
    assert set(ROW_STEPS) == names(SUMS) | APART


def test_state_letters() -> None:
    """An error of position, velocity or acceleration has a letter."""
    assert set(STATE_LETTERS) == names(kind for kind in SOURCES if isinstance(kind, StateKind))


def test_an_entry_for_an_axis_comes_before_that_of_the_kind() -> None:
    (oscillator,) = (kind for kind in SOURCES if kind.name == "oscillator")
    table = {"oscillator": "noise", "oscillator.spur": "tone"}
    assert oscillator.find_in(table, "spur") == "tone"
    assert oscillator.find_in(table, "acceleration") == oscillator.find_in(table) == "noise"
