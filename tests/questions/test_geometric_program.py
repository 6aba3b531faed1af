"""The maximum of a geometric program: its conditions, and what no other sizes within the room are above."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bisar_budget.questions.geometric_program import Rows, largest_sizes
from tests.conftest import examples


def drawn(seed: int) -> tuple[np.ndarray, Rows]:
    """Sizes and rows with shares over many powers of ten, each size in the first row or in another one."""
    rng = np.random.default_rng(seed)
    sizes, rows = rng.integers(1, 12), rng.integers(1, 8)
    share = np.exp(rng.normal(0, 6, (rows, sizes))) * (rng.random((rows, sizes)) < 0.6)
    share[0] = np.where(share.any(axis=0), share[0], 1.0)
    return rng.uniform(0.2, 3, sizes), Rows(share, rng.choice([1.0, 2.0], rows), rng.uniform(0.05, 1, rows))


@settings(deadline=None)
@given(seed=st.integers(0, 10_000))
def test_no_size_can_grow_unless_another_shrinks(seed: int) -> None:
    """What rows are worth times what a size takes of them is its weight; a row that is worth anything is full."""
    weights, rows = drawn(seed)
    found = largest_sizes(weights, rows)
    parts = rows.at(found.log)
    assert (parts.sum(axis=1) <= 1).all()
    assert found.multipliers @ parts == pytest.approx(weights, rel=1e-4)
    assert (1 - parts.sum(axis=1)) * found.multipliers == pytest.approx(0, abs=1e-6)


@examples(30)
@given(seed=st.integers(0, 10_000))
def test_no_other_sizes_are_better(seed: int) -> None:
    """Independent of the conditions: sizes drawn around, brought within the room, have no larger Σ w·log."""
    weights, rows = drawn(seed)
    found = largest_sizes(weights, rows)
    rng = np.random.default_rng(seed)
    for spread in (0.01, 0.1, 1.0):
        for step in rng.normal(0, spread, (50, weights.size)):
            x = found.log + step
            full = np.maximum(rows.at(x).sum(axis=1), 1e-9)  # a row may have none of the sizes
            x = x - max(0.0, float((np.log(full) / rows.power).max()))
            assert weights @ x <= weights @ found.log + 1e-6


def test_shares_are_the_weights_where_one_row_limits_all() -> None:
    weights, share = np.array([1.0, 2.0, 5.0]), np.array([[3.0, 1e-4, 700.0]])
    found = largest_sizes(weights, Rows(share, np.array([2.0]), np.array([0.64])))
    assert Rows(share, np.array([2.0]), np.array([0.64])).at(found.log)[0] == pytest.approx(weights / 8, rel=1e-6)


def test_two_rows_that_limit_divide_otherwise() -> None:
    """By hand: a takes of the first, b of both, c of the second alone; x + y = 1, y' + z = 1 with y' = 4y.

    1 = λ·x, 1 = λ·y + μ·4y, 1 = μ·z: y = 1/(λ + 4μ), λ = 1/(1 − y), μ = 1/(1 − 4y), which leave 12y² − 10y + 1 = 0.
    """
    rows = Rows(np.array([[1.0, 1.0, 0.0], [0.0, 4.0, 1.0]]), np.ones(2), np.ones(2))
    found = np.exp(largest_sizes(np.ones(3), rows).log)
    y = (10 - np.sqrt(100 - 48)) / 24
    assert found == pytest.approx([1 - y, y, 1 - 4 * y], rel=1e-6)
