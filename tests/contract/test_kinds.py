"""Tables by kind of error are complete: each has all the kinds that can reach it, and no other."""

from collections.abc import Iterable

from bisar_budget.budget.random_rows import RANDOM_WORDINGS, REASONS_FOR_NO_EFFECT
from bisar_budget.effects import navigation_errors
from bisar_budget.error_kinds.kind import ErrorKind, SourceKind, SumKind
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.error_kinds.random_kinds import INERTIAL_FIGURES
from bisar_budget.error_kinds.registry import kinds
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.row import SPECIFICATION
from bisar_budget.mission.instruments import IMU_KINDS
from bisar_budget.report.compliance.rows import LIMIT_FORMS
from bisar_budget.report.explain.explained_error import SOURCE_STEPS
from bisar_budget.report.explain.explained_random import RANDOM_STEPS
from bisar_budget.report.explain.explanation import ROW_STEPS
from bisar_budget.simulator import realisations
from bisar_budget.verifier import spread_cases

# Rows of errors that are no sources and no random errors: tones, a stated ISLR, and the residual of a log.
APART = {"oscillator.acceleration", "oscillator.spur", "vibration", "other", "trajectory.residual"}


def names(some_kinds: Iterable[ErrorKind]) -> set[str]:
    return {kind.name for kind in some_kinds}


SOURCES = [kind for kind in kinds() if isinstance(kind, SourceKind)]
SUMS = [kind for kind in kinds() if isinstance(kind, SumKind)]


def test_limit_forms() -> None:
    """A sum without a requirement of its own has a form for its limit."""
    assert set(LIMIT_FORMS) == names(SUMS) - set(REQUIREMENT_NAMES) - {SPECIFICATION}


def test_source_steps() -> None:
    """A kind of error that is not random has steps, and so has the aging of an oscillator."""
    assert set(SOURCE_STEPS) == names(kind for kind in SOURCES if not kind.is_random) | {"oscillator"}


def test_random_steps() -> None:
    """A random error has steps, and so has an error of which the file states only the effect."""
    expected = names(kind for kind in SOURCES if kind.is_random or kind.moves == "image")
    assert set(RANDOM_STEPS) == expected | {"oscillator.acceleration"}


def test_wordings_and_reasons_for_no_effect() -> None:
    """A random error has texts for its row, and so has an error of which the file states only the effect."""
    expected = names(kind for kind in SOURCES if kind.is_random or kind.moves == "image")
    assert set(RANDOM_WORDINGS) == expected | {"lever_arm.uncertainty", "oscillator.acceleration"}
    assert set(REASONS_FOR_NO_EFFECT) == expected


def test_row_steps() -> None:
    """A sum has steps, and so has an error that is judged by its tones, its power or its log."""
    assert set(ROW_STEPS) == names(SUMS) | APART


def test_an_entry_for_an_axis_comes_before_that_of_the_kind() -> None:
    (oscillator,) = (kind for kind in SOURCES if kind.name == "oscillator")
    table = {"oscillator": "noise", "oscillator.spur": "tone"}
    assert oscillator.find_in(table, "spur") == "tone"
    assert oscillator.find_in(table, "acceleration") == oscillator.find_in(table) == "noise"


RANDOM = [kind for kind in kinds() if isinstance(kind, SourceKind) and kind.is_random]


def drawn(drawn_as: str) -> set[str]:
    return {kind.name for kind in RANDOM if kind.drawn_as == drawn_as}


def without_axes(keys: Iterable[str]) -> set[str]:
    return {key.partition(".")[0] for key in keys}


def test_state_kinds() -> None:
    assert [kind.order for kind in STATE_KINDS] == [0, 1, 2]


def test_every_random_kind_is_drawn() -> None:
    assert {kind.drawn_as for kind in RANDOM} == {"motion", "delay", "phase"}


def test_inertial_figures() -> None:
    """In the order of the file's keys, which is that of the evaluator."""
    assert tuple(INERTIAL_FIGURES) == IMU_KINDS


def test_processes() -> None:
    assert set(navigation_errors._PROCESSES) == {kind.name for kind in RANDOM if kind.is_correlated}


def test_inertial_draws() -> None:
    assert tuple(realisations._INERTIAL_DRAWS) == IMU_KINDS


def test_motion_draws() -> None:
    assert without_axes(realisations._MOTION_DRAWS) == drawn("motion")


def test_phase_draws() -> None:
    assert without_axes(realisations._PHASE_DRAWS) == drawn("phase")


def test_shakes() -> None:
    assert without_axes(realisations._SHAKES) <= drawn("phase")


def test_additions() -> None:
    assert set(realisations._ADDITIONS) == {kind.name for kind in RANDOM}


def test_effects_of_draws() -> None:
    """The effects of drawn phases follow from their Legendre orders instead."""
    assert set(spread_cases._EFFECTS_OF_DRAWS) == {kind.drawn_as for kind in RANDOM} - {"phase"}


def test_image_errors() -> None:
    assert set(spread_cases._IMAGE_ERRORS) == {kind.drawn_as for kind in RANDOM}


def test_phases_at_moments() -> None:
    assert set(spread_cases._PHASES_AT_MOMENTS) == {kind.drawn_as for kind in RANDOM}
