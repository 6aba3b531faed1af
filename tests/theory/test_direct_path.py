"""The range error where the direct path is the clock: derived, emitted, and against differences of distances."""

import numpy as np
import pytest
from sympy import Matrix, simplify

from bisar_budget.image_plane import Sampling
from bisar_budget.ranges.exact_ranges import ExactRanges
from bisar_budget.theory import differential_range as dr
from bisar_budget.theory import full
from bisar_budget.theory.symbols import PLATFORM_SYMBOLS, RECEIVER, TRANSMITTER

B = Matrix(full.DIRECT_PATH)


def test_lines_of_sight_are_less_the_direct_path() -> None:
    """ΔR̃ = −(u_t − b)·r̃_t − (u_r + b)·r̃_r, b from receiver to transmitter."""
    assert full.direct_sight(TRANSMITTER) == Matrix(TRANSMITTER.look[0]) - B
    assert full.direct_sight(RECEIVER) == Matrix(RECEIVER.look[0]) + B


def test_the_parts_of_both_platforms_are_the_whole() -> None:
    """With b written out; so that nothing is lost by looking at one platform at a time."""
    apart = dict(zip(full.DIRECT_PATH, (TRANSMITTER.position - RECEIVER.position) / full.baseline, strict=True))
    parts = sum(full.direct_range_error(platform) for platform in PLATFORM_SYMBOLS).subs(apart)
    assert simplify(parts - dr.direct_path_range_error()) == 0


def test_an_error_of_both_platforms_leaves_the_direct_path_alone() -> None:
    """Both move alike: what is left are the lines of sight of (1) without a clock."""
    same = dict(zip(dr.error_track(RECEIVER), dr.error_track(TRANSMITTER), strict=True))
    found = dr.direct_path_range_error().subs(same)
    assert not found.has(full.baseline)
    lines_of_sight = sum(
        -p.position.dot(dr.error_track(TRANSMITTER)) / p.slant_range for p in (TRANSMITTER, RECEIVER)
    )
    assert simplify(found - lines_of_sight) == 0


@pytest.mark.parametrize("sign", [1, -1], ids=["transmitter", "receiver"])
def test_the_range_error_at_one_time_is_the_derivative_of_range_less_distance(sign: int) -> None:
    """−(u − b)·d of exact ranges against differences of |p| + |q| − |p − q|, for either platform.

    Distances of 2 km are rounded to 2e-13 m: over steps of 1 mm, 1e-9.
    """
    own, other = np.array([[1200.0, -900.0, 2000.0], [-400.0, 700.0, 300.0]])[::sign]
    step = 1e-3
    tracks = [tuple(place[:, None, None]) for place in (own, other)][::sign]
    middles = [tuple(place[:, None]) for place in (own, other)][::sign]
    one_time = Sampling(np.zeros(1), np.zeros((4, 1)))
    exact = ExactRanges(np.ones(1), np.ones(1), np.zeros(1), one_time, tracks, middles, has_direct_path=True)

    def recorded(place):
        return np.linalg.norm(place) - np.linalg.norm(place - other)

    for direction in np.eye(3):
        slope = (recorded(own - direction * step) - recorded(own + direction * step)) / (2 * step)
        assert exact.along(0 if sign == 1 else 1, tuple(direction)).item() == pytest.approx(slope, abs=2e-9)
