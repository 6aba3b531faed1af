"""The range error where the direct path is the clock: derived, emitted, and against differences of distances."""

import numpy as np
import pytest
from sympy import Matrix, simplify

from bisar_budget import evaluators
from bisar_budget.theory import differential_range as dr
from bisar_budget.theory import full
from bisar_budget.theory.symbols import PLATFORMS, RECEIVER, TRANSMITTER

B = Matrix(full.DIRECT_PATH)


def test_lines_of_sight_are_less_the_direct_path() -> None:
    """ΔR̃ = −(u_t − b)·r̃_t − (u_r + b)·r̃_r, b from receiver to transmitter."""
    assert full.direct_sight(TRANSMITTER) == Matrix(TRANSMITTER.look[0]) - B
    assert full.direct_sight(RECEIVER) == Matrix(RECEIVER.look[0]) + B


def test_the_parts_of_both_platforms_are_the_whole() -> None:
    """With b written out; so that nothing is lost by looking at one platform at a time."""
    apart = dict(zip(full.DIRECT_PATH, (TRANSMITTER.position - RECEIVER.position) / full.baseline, strict=True))
    parts = sum(full.direct_range_error(platform) for platform in PLATFORMS).subs(apart)
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
    """The emitted function against differences of |p| + |q| − |p − q|, for either platform, b being from the other.

    Distances of 2 km are rounded to 2e-13 m: over steps of 1 mm, 1e-9.
    """
    places = np.array([[1200.0, -900.0, 2000.0], [-400.0, 700.0, 300.0]])[::sign]
    own, other = places
    tau, step = 0.7, 1e-3
    b = (own - other) / np.linalg.norm(own - other)
    kinds = evaluators.direct_motion(*own, float(np.linalg.norm(own)), *b, tau)

    def recorded(place):
        return np.linalg.norm(place) - np.linalg.norm(place - other)

    for power, of_kind in zip((1.0, tau, tau**2 / 2), kinds, strict=True):
        for axis, derived in enumerate(of_kind):
            e = np.eye(3)[axis] * step
            slope = (recorded(own - e) - recorded(own + e)) / (2 * step)
            assert derived == pytest.approx(power * slope, abs=2e-9)
