"""Sums over errors."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.effects.combine import combine_displacements, combine_phases, largest_signed_sum


@pytest.mark.parametrize(("rule", "value"), [("each", 4), ("sum", 7), ("rss", 5)])
def test_phases(rule: str, value: float) -> None:
    assert combine_phases([3, -4], rule) == pytest.approx(value)
    assert combine_phases([], rule) == 0


@pytest.mark.parametrize(("rule", "value"), [("each", 4), ("sum", 5), ("rss", 5)])
def test_displacements_at_right_angles(rule: str, value: float) -> None:
    assert combine_displacements([(3, 0), (0, -4)], rule) == pytest.approx(value)
    assert combine_displacements([], rule) == 0


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
    assert largest_signed_sum(vectors) == pytest.approx(best)


def test_the_tiniest_displacement_keeps_its_length() -> None:
    """Squares of it are zero."""
    assert largest_signed_sum([(3e-200, 4e-200)]) == pytest.approx(5e-200)
