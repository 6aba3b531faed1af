"""Sums over errors."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.effects.combined import (
    Correlated,
    combined_displacement,
    combined_phase,
    displacement_parts,
    largest_signed_sum,
    phase_parts,
)

SIX = tuple("abcdef")
UNTIED = np.eye(6).tolist()


@pytest.mark.parametrize(("rule", "value"), [("each", 4), ("sum", 7), ("rss", 5)])
def test_phases(rule: str, value: float) -> None:
    assert combined_phase([("a", 3), ("b", -4)], rule) == pytest.approx(value)
    assert combined_phase([], rule) == 0


@pytest.mark.parametrize(("rule", "value"), [("each", 4), ("sum", 5), ("rss", 5)])
def test_displacements_at_right_angles(rule: str, value: float) -> None:
    assert combined_displacement([("a", (3, 0)), ("b", (0, -4))], rule) == pytest.approx(value)
    assert combined_displacement([], rule) == 0


@pytest.mark.parametrize("rule", ["each", "sum", "rss"])
def test_each_of_many_cases_is_combined_for_itself(rule: str) -> None:
    x, y = np.random.default_rng(1).normal(size=(2, 5, 8))
    phases, moves = list(zip(SIX[:5], x, strict=True)), list(zip(SIX[:5], zip(x, y, strict=True), strict=True))
    of_phases, of_moves = combined_phase(phases, rule), combined_displacement(moves, rule)
    for case in range(8):
        alone = combined_phase([(name, phase[case]) for name, phase in phases], rule)
        assert of_phases[case] == pytest.approx(alone)
        alone = combined_displacement([(name, (east[case], north[case])) for name, (east, north) in moves], rule)
        assert of_moves[case] == pytest.approx(alone)


def test_a_covariance_is_one_part_under_root_sum_square_alone() -> None:
    """Phases of 3 rad and 4 rad are 7 rad where they go together fully, and 1 rad where one undoes the other."""
    phases = [(name, phase) for name, phase in zip((*SIX, "g"), (3.0, 4.0, 0.0, 0.0, 0.0, 0.0, 24.0), strict=True)]
    for rho, size in ((1.0, 7.0), (0.0, 5.0), (-1.0, 1.0)):
        correlation = np.eye(6)
        correlation[0, 1] = correlation[1, 0] = rho
        group = Correlated("receiver", SIX, correlation.tolist())
        assert phase_parts(phases, "rss", [group]) == [("receiver.covariance", pytest.approx(size)), ("g", 24.0)]
        assert combined_phase(phases, "rss", [group]) == pytest.approx(math.hypot(size, 24))
        assert combined_phase(phases, "sum", [group]) == 31
        moves = [(name, (0.6 * phase, 0.8 * phase)) for name, phase in phases]
        assert displacement_parts(moves, "rss", [group])[0] == ("receiver.covariance", (pytest.approx(size), 0.0))
        assert combined_displacement(moves, "rss", [group]) == pytest.approx(math.hypot(size, 24))


def test_a_covariance_with_an_error_without_an_image_has_no_finite_phase() -> None:
    phases = [(name, np.array([1.0, math.inf if name == "b" else 1.0])) for name in SIX]
    group = Correlated("receiver", SIX, UNTIED)
    assert combined_phase(phases, "rss", [group]).tolist() == [pytest.approx(math.sqrt(6)), math.inf]
    assert group.of(np.array([1])).phase([phase[1:] for _, phase in phases]).tolist() == [math.inf]


whole = st.integers(-6, 6)


@given(st.lists(st.tuples(whole, whole), max_size=7))
def test_largest_signed_sum_is_the_brute_force_one(vectors) -> None:
    """Small whole numbers make parallel, opposite, equal and zero vectors likely."""
    best = max(
        math.hypot(
            sum(s * v[0] for s, v in zip(signs, vectors, strict=True)),
            sum(s * v[1] for s, v in zip(signs, vectors, strict=True)),
        )
        for signs in itertools.product((1, -1), repeat=len(vectors))
    )
    assert largest_signed_sum(np.array(vectors, dtype=float).reshape(-1, 2)) == pytest.approx(best)


def test_the_tiniest_displacement_keeps_its_length() -> None:
    """Squares of it are zero."""
    assert largest_signed_sum(np.array([(3e-200, 4e-200)])) == pytest.approx(5e-200)
