"""Tables by kind of error have every kind that they must have. Each test is named after its table."""

from collections.abc import Iterable

from bisar_budget.effects import navigation_errors, sources
from bisar_budget.error_kinds import STATE_KINDS, SourceKind, kinds
from bisar_budget.mission.instruments import IMU_KINDS
from bisar_budget.simulator import realisations
from bisar_budget.verifier import spread_cases

RANDOM = [kind for kind in kinds() if isinstance(kind, SourceKind) and kind.is_random]


def names(drawn_as: str) -> set[str]:
    return {kind.name for kind in RANDOM if kind.drawn_as == drawn_as}


def without_axes(keys: Iterable[str]) -> set[str]:
    return {key.partition(".")[0] for key in keys}


def test_state_kinds() -> None:
    assert [kind.order for kind in STATE_KINDS] == [0, 1, 2]


def test_every_random_kind_is_drawn() -> None:
    assert {kind.drawn_as for kind in RANDOM} == {"motion", "delay", "phase"}


def test_defocusing_vectors() -> None:
    assert list(sources._DEFOCUSING_VECTORS) == [kind.name for kind in STATE_KINDS if kind.order > 0]


def test_inertial_figures() -> None:
    """In the order of the file's keys, which is that of the evaluator."""
    assert tuple(navigation_errors.INERTIAL_FIGURES) == IMU_KINDS


def test_processes() -> None:
    assert set(navigation_errors._PROCESSES) == {kind.name for kind in RANDOM if kind.is_correlated}


def test_inertial_draws() -> None:
    assert tuple(realisations._INERTIAL_DRAWS) == IMU_KINDS


def test_motion_draws() -> None:
    assert without_axes(realisations._MOTION_DRAWS) == names("motion")


def test_phase_draws() -> None:
    assert without_axes(realisations._PHASE_DRAWS) == names("phase")


def test_shakes() -> None:
    assert without_axes(realisations._SHAKES) <= names("phase")


def test_additions() -> None:
    assert set(realisations._ADDITIONS) == {kind.name for kind in RANDOM}


def test_effects_of_draws() -> None:
    """The effects of drawn phases follow from their Legendre orders instead."""
    assert set(spread_cases._EFFECTS_OF_DRAWS) == {kind.drawn_as for kind in RANDOM} - {"phase"}


def test_image_errors() -> None:
    assert set(spread_cases._IMAGE_ERRORS) == {kind.drawn_as for kind in RANDOM}


def test_phases_at_moments() -> None:
    assert set(spread_cases._PHASES_AT_MOMENTS) == {kind.drawn_as for kind in RANDOM}
