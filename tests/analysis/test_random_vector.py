"""The distribution of the length of a random vector, against closed forms, dense integrals and draws."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import integrate, stats

from bisar_budget import random_vector
from bisar_budget.random_vector import RandomVector

Array = NDArray[np.float64]
PERCENTILES = (0.5, 0.68, 0.9, 0.95, 0.997)
CONFIDENCES = (*PERCENTILES, 0.9999, 0.999999)


def vector(
    mean: float | Sequence[float],
    normal: Sequence[Sequence[float]] = (),
    uniform: Sequence[Sequence[float]] = (),
    bound: Sequence[Sequence[float]] = (),
    tone: Sequence[Sequence[Sequence[float]]] = (),
) -> RandomVector:
    center = np.atleast_1d(np.asarray(mean, dtype=float))
    width = len(center)
    rows = (np.asarray(values, dtype=float).reshape(-1, width) for values in (normal, uniform, bound))
    return RandomVector(center, *rows, np.asarray(tone, dtype=float).reshape(-1, 2, width))


def mixed(width: int, counts: tuple[int, int, int, int], size_of_mean: float, seed: int) -> RandomVector:
    """A vector with given numbers of normal, uniform, bound and tone contributions of different sizes."""
    generator = np.random.default_rng(seed)
    sizes = [np.exp(0.7 * generator.normal(size=(count, 1))) for count in counts]
    normal, uniform, bound = (size * generator.normal(size=(len(size), width)) for size in sizes[:3])
    tone = sizes[3][:, :, None] * generator.normal(size=(counts[3], 2, width))
    mean = size_of_mean * generator.normal(size=width)
    return RandomVector(mean, normal, uniform, bound, tone)


def drawn(case: RandomVector, count: int, seed: int) -> Array:
    """Sorted lengths of drawn vectors."""
    generator = np.random.default_rng(seed)
    draws = np.tile(case.mean, (count, 1))
    draws += sum(np.outer(generator.normal(size=count), row) for row in case.normal)
    draws += sum(np.outer(generator.uniform(-1.0, 1.0, count), row) for row in case.uniform)
    draws += sum(np.outer(generator.choice((-1.0, 1.0), count), row) for row in case.bound)
    for first, second in case.tone:
        phases = generator.uniform(0.0, 2.0 * math.pi, count)
        draws += np.outer(np.cos(phases), first) + np.outer(np.sin(phases), second)
    return np.sort(np.linalg.norm(draws, axis=1))


def assert_quantiles(case: RandomVector, expected: Sequence[float], tolerance: float = 1e-9) -> None:
    assert case.quantiles(CONFIDENCES) == pytest.approx(list(expected), rel=tolerance)


class TestClosedForms:
    def test_zero(self) -> None:
        for width in (1, 2, 5):
            case = vector(np.zeros(width), np.zeros((2, width)), np.zeros((1, width)))
            assert case.quantiles(CONFIDENCES) == [0.0] * len(CONFIDENCES)
            assert case.probability(0.0) == 1.0

    def test_constant(self) -> None:
        case = vector((3.0, -4.0), normal=[(0.0, 0.0)])
        assert_quantiles(case, [5.0] * 7)
        assert (case.probability(4.999), case.probability(5.0), case.probability(6.0)) == (0.0, 1.0, 1.0)
        assert vector(-2.0).quantiles([0.5]) == [2.0]
        assert vector(-2.0).probability(1.99) == 0.0

    def test_normal(self) -> None:
        case = vector(0.0, normal=[(3.0,), (-4.0,)])
        assert_quantiles(case, 5.0 * stats.halfnorm.ppf(CONFIDENCES))
        assert case.probability(5.0) == pytest.approx(math.erf(math.sqrt(0.5)), rel=1e-12)

    @pytest.mark.parametrize("mean", [1e-3, 0.5, -2.0, 40.0, 1e6])
    def test_normal_with_mean(self, mean: float) -> None:
        case = vector(mean, normal=[(1.5,)])
        # scipy's quantile of the folded normal is good to 1e-8.
        for confidence, length in zip(CONFIDENCES, case.quantiles(CONFIDENCES), strict=True):
            above = stats.norm.sf(length, mean, 1.5) + stats.norm.cdf(-length, mean, 1.5)
            assert above == pytest.approx(1.0 - confidence, rel=1e-6)
            assert case.probability(length) == pytest.approx(confidence, abs=1e-9)

    def test_rayleigh(self) -> None:
        case = vector((0.0, 0.0), normal=[(2.0, 0.0), (0.0, -2.0)])
        assert_quantiles(case, 2.0 * np.sqrt(-2.0 * np.log1p(-np.array(CONFIDENCES))))
        assert case.probability(2.0) == pytest.approx(1.0 - math.exp(-0.5), abs=1e-9)

    @pytest.mark.parametrize("mean", [0.1, 1.0, 5.0, 100.0])
    def test_rice(self, mean: float) -> None:
        case = vector((0.6 * mean, 0.8 * mean), normal=[(2.0, 0.0), (0.0, 2.0)])
        for confidence, length in zip(CONFIDENCES, case.quantiles(CONFIDENCES), strict=True):
            above = stats.ncx2.sf((length / 2.0) ** 2, 2, (mean / 2.0) ** 2)
            assert above == pytest.approx(1.0 - confidence, rel=2e-3)

    @pytest.mark.parametrize("width", [3, 5, 12])
    def test_noncentral_chi(self, width: int) -> None:
        case = vector(np.full(width, 0.7), normal=2.0 * np.eye(width))
        for confidence, length in zip(CONFIDENCES, case.quantiles(CONFIDENCES), strict=True):
            above = stats.ncx2.sf((length / 2.0) ** 2, width, width * 0.35**2)
            assert above == pytest.approx(1.0 - confidence, rel=1e-4)

    @pytest.mark.parametrize(("mean", "ratio"), [((0, 0), 0.3), ((0, 0), 0.002), ((1, 2), 0.5), ((0.1, 3), 0.05)])
    def test_normal_in_the_plane(self, mean: tuple[float, float], ratio: float) -> None:
        case = vector(mean, normal=[(1.0, 0.0), (0.0, ratio)])

        def above(length: float) -> float:
            def integrand(score: float) -> float:
                reach = math.sqrt(max(length**2 - (mean[1] + ratio * score) ** 2, 0.0))
                beyond = stats.norm.sf(reach - mean[0]) + stats.norm.cdf(-reach - mean[0])
                return float(stats.norm.pdf(score) * beyond)

            edges = [(sign * length - mean[1]) / ratio for sign in (-1, 1)]
            ends = [-9.0, *(edge for edge in edges if abs(edge) < 9.0), 9.0]
            pieces = itertools.pairwise(ends)
            return sum(integrate.quad(integrand, *piece, epsabs=1e-12, limit=200)[0] for piece in pieces)

        for confidence in (0.5, 0.95, 0.999999):
            (length,) = case.quantiles([confidence])
            assert above(length) == pytest.approx(1.0 - confidence, rel=2e-3)
            assert case.probability(length) == pytest.approx(1.0 - above(length), abs=1e-7)

    def test_uniform(self) -> None:
        assert_quantiles(vector(0.0, uniform=[(-3.0,)]), [3.0 * confidence for confidence in CONFIDENCES])
        assert_quantiles(vector((0.0, 0.0), uniform=[(3.0, 4.0)]), [5.0 * confidence for confidence in CONFIDENCES])
        case = vector(10.0, uniform=[(3.0,)])
        assert_quantiles(case, [7.0 + 6.0 * confidence for confidence in CONFIDENCES])
        assert case.probability(10.0) == pytest.approx(0.5, rel=1e-12)

    def test_triangle(self) -> None:
        case = vector(0.0, uniform=[(1.0,), (1.0,)])
        assert_quantiles(case, [2.0 - 2.0 * math.sqrt(1.0 - confidence) for confidence in CONFIDENCES], 1e-5)
        assert case.probability(1.0) == pytest.approx(0.75, abs=1e-6)

    def test_square(self) -> None:
        """Two uniform contributions at right angles fill a square."""
        case = vector((0.0, 0.0), uniform=[(1.0, 0.0), (0.0, 1.0)])
        assert case.probability(1.0) == pytest.approx(0.25 * math.pi, abs=1e-5)
        assert case.probability(math.sqrt(2.0)) == pytest.approx(1.0, abs=1e-9)
        for length in (0.3, 1.1, 1.4):
            corners = math.sqrt(length**2 - 1.0) if length > 1.0 else 0.0
            area = math.pi * length**2 / 4.0
            if corners:
                area = corners + 0.5 * length**2 * (0.5 * math.pi - 2.0 * math.atan(corners))
            assert case.probability(length) == pytest.approx(area, abs=1e-5)

    def test_arcsine(self) -> None:
        expected = np.sin(0.5 * math.pi * np.array(CONFIDENCES))
        assert_quantiles(vector(0.0, tone=[[(3.0,), (4.0,)]]), 5.0 * expected)
        assert_quantiles(vector((0.0, 0.0), tone=[[(3.0, 4.0), (0.0, 0.0)]]), 5.0 * expected)

    def test_circle(self) -> None:
        case = vector((0.0, 0.0), tone=[[(2.0, 0.0), (0.0, 2.0)]])
        assert_quantiles(case, [2.0] * 7, 1e-6)
        assert case.probability(1.99) == 0.0

    def test_bounds(self) -> None:
        """Of four signs, three leave ±3 and ±1 of 2 + 1: each with half the probability."""
        case = vector(0.0, bound=[(2.0,), (1.0,)])
        assert case.quantiles((0.5, 0.500001, 0.999999)) == pytest.approx([1.0, 3.0, 3.0], rel=1e-12)
        assert case.probability(1.0 - 1e-9) == 0.0
        assert case.probability(1.0 + 1e-9) == 0.5
        case = vector((0.0, 0.0), bound=[(3.0, 0.0), (0.0, 4.0)])
        assert_quantiles(case, [5.0] * 7)

    def test_twelve_bounds(self) -> None:
        sizes = np.random.default_rng(3).normal(size=12)
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 12)).reshape(12, -1)
        lengths = np.sort(np.abs(sizes @ signs))
        expected = [lengths[math.ceil(confidence * 4096) - 1] for confidence in CONFIDENCES]
        assert_quantiles(vector(0.0, bound=sizes[:, None]), expected)

    def test_bound_and_normal(self) -> None:
        case = vector(0.0, normal=[(1.0,)], bound=[(2.0,)])
        for confidence, length in zip(CONFIDENCES, case.quantiles(CONFIDENCES), strict=True):
            above = stats.norm.sf(length - 2.0) + stats.norm.sf(length + 2.0)
            assert above == pytest.approx(1.0 - confidence, rel=1e-8)


class TestSums:
    CASES = (
        (1, (0, 10, 0, 0), 0.0),
        (1, (1, 2, 1, 1), 0.0),
        (1, (2, 1, 2, 2), 2.0),
        (1, (0, 1, 0, 1), 1.0),
        (1, (0, 0, 0, 3), 0.0),
        (2, (2, 1, 0, 0), 0.0),
        (2, (3, 6, 0, 0), 2.0),
        (2, (1, 1, 1, 1), 1.0),
        (2, (0, 4, 1, 0), 0.0),
        (2, (0, 1, 3, 0), 2.0),
        (2, (2, 2, 2, 2), 0.0),
        (3, (2, 2, 0, 0), 0.0),
        (3, (1, 3, 2, 1), 2.0),
        (3, (3, 0, 0, 0), 0.0),
        (5, (3, 6, 0, 0), 0.0),
        (5, (4, 2, 2, 1), 2.0),
        (5, (0, 6, 0, 2), 1.0),
        (8, (5, 4, 1, 1), 0.0),
    )

    @pytest.mark.parametrize(("width", "counts", "size_of_mean"), CASES)
    def test_draws_agree(self, width: int, counts: tuple[int, int, int, int], size_of_mean: float) -> None:
        """Shares of 10⁶ draws agree within 4 standard deviations (the lattice 3e-4 more), or 0.5 % of the length."""
        case = mixed(width, counts, size_of_mean, seed=sum(counts))
        count = 10**6
        lengths = drawn(case, count, seed=width)
        for confidence, length in zip(PERCENTILES, case.quantiles(PERCENTILES), strict=True):
            share = np.searchsorted(lengths, length * (1.0 + 1e-9), side="right") / count
            deviation = math.sqrt(confidence * (1.0 - confidence) / count)
            assert share == pytest.approx(confidence, abs=4.0 * deviation + (3e-4 if width > 2 else 1e-5))
            within = np.searchsorted(lengths, (0.995 * length, 1.005 * length)) / count
            assert within[0] - 4.0 * deviation <= confidence <= within[1] + 4.0 * deviation

    def test_far_tail_in_one_dimension(self) -> None:
        """A normal, a uniform and a tone contribution, by the trapezoidal rule over the last two."""
        case = vector(0.3, normal=[(1.0,)], uniform=[(2.0,)], tone=[[(1.5,), (0.0,)]])
        nodes, weights = np.polynomial.legendre.leggauss(80)
        phases = (np.arange(400) + 0.5) * math.pi / 400
        sums = 0.3 + 2.0 * nodes[:, None] + 1.5 * np.cos(phases)
        for confidence, length in zip(CONFIDENCES, case.quantiles(CONFIDENCES), strict=True):
            above = stats.norm.sf(length - sums) + stats.norm.sf(length + sums)
            assert 0.5 * weights @ above.mean(axis=1) == pytest.approx(1.0 - confidence, rel=1e-3)

    @pytest.mark.parametrize("width", [2, 3])
    def test_far_tail_in_space(self, width: int) -> None:
        """Normal contributions of equal size and two uniform ones: noncentral chi-squares of the latter's sums."""
        uniform = np.array([(2.0, 1.0, 0.5), (-1.0, 1.5, 1.0)])[:, :width]
        case = vector(np.full(width, 0.4), normal=np.eye(width), uniform=uniform)
        nodes, weights = np.polynomial.legendre.leggauss(60)
        sums = 0.4 + nodes[:, None, None] * uniform[0] + nodes[:, None] * uniform[1]
        squares = np.square(sums).sum(axis=2)
        for confidence, length in zip(CONFIDENCES, case.quantiles(CONFIDENCES), strict=True):
            above = 0.25 * weights @ stats.ncx2.sf(length**2, width, squares) @ weights
            assert above == pytest.approx(
                1.0 - confidence, rel=1e-3 if width == 2 else 6e-2
            )  # 6 % are 0.4 % of a length

    @pytest.mark.parametrize("size_of_mean", [0.0, 2.0])
    @pytest.mark.parametrize("counts", [(2, 1, 0, 0), (2, 3, 0, 0), (2, 0, 3, 0), (3, 6, 0, 0), (2, 0, 0, 2)])
    def test_lattice_agrees_with_the_series(self, counts: tuple[int, int, int, int], size_of_mean: float) -> None:
        case = mixed(2, counts, size_of_mean, seed=sum(counts))
        reduced = random_vector._reduced(case, random_vector._scale(case))
        terms = random_vector._plane_terms(reduced) or 400
        lengths = random_vector._solve(
            random_vector._plane_series(reduced, terms),
            np.array(CONFIDENCES),
            reduced.rough_quantile(np.array(CONFIDENCES)),
            1e-6,
        )
        for confidence, length in zip(CONFIDENCES, lengths, strict=True):
            (on_lattice,) = random_vector._solve(
                random_vector._lattice(reduced, confidence), np.array([confidence]), np.array([length]), 1e-6
            )
            assert on_lattice == pytest.approx(length, rel=2e-3 if confidence < 0.9999 else 6e-3)

    def test_a_line_or_a_plane_in_space_is_reduced(self) -> None:
        turn = np.linalg.qr(np.random.default_rng(1).normal(size=(5, 5)))[0]
        for width in (1, 2):
            case = mixed(width, (2, 2, 1, 1), 1.0, seed=4)
            turned = RandomVector(*(rows @ turn[:width] for rows in case))
            assert turned.quantiles(CONFIDENCES) == pytest.approx(case.quantiles(CONFIDENCES), rel=1e-5)

    def test_zero_and_short_contributions_change_nothing(self) -> None:
        case = mixed(2, (2, 2, 1, 1), 1.0, seed=4)
        longer = RandomVector(
            case.mean, *(np.concatenate((rows, 0.0 * rows, 1e-7 * rows)) for rows in case[1:])
        )  # 1e-7 of the others
        assert longer.quantiles(CONFIDENCES) == pytest.approx(case.quantiles(CONFIDENCES), rel=1e-6)

    def test_both_sides_of_quantiles(self) -> None:
        for width, counts, size_of_mean in self.CASES:
            case = mixed(width, counts, size_of_mean, seed=sum(counts))
            (length,) = case.quantiles([0.95])
            assert case.probability(0.99 * length) < 0.95 < case.probability(1.01 * length)
            assert case.probability(length) == pytest.approx(0.95, abs=1e-4 if width < 3 else 5e-4)

    def test_quantiles_do_not_depend_on_each_other(self) -> None:
        case = mixed(3, (2, 2, 1, 1), 1.0, seed=4)
        alone = [case.quantiles([confidence])[0] for confidence in CONFIDENCES]
        assert case.quantiles(CONFIDENCES) == pytest.approx(alone, rel=1e-5)

    @pytest.mark.parametrize("scale", [1e-250, 1e250])
    def test_extreme_units(self, scale: float) -> None:
        case = mixed(2, (2, 2, 1, 1), 1.0, seed=4)
        scaled = RandomVector(*(scale * rows for rows in case))
        expected = [scale * length for length in case.quantiles(CONFIDENCES)]
        assert scaled.quantiles(CONFIDENCES) == pytest.approx(expected, rel=1e-9)

    def test_contributions_that_vanish_beside_others(self) -> None:
        """No warning and no number that is not finite, although squares are 0 or infinite."""
        size = 1e-200
        for width in (1, 2, 3):
            rows = size * np.eye(width)
            tone = np.stack((rows, rows), axis=1)
            for case in (
                RandomVector(np.ones(width), rows, rows, rows, tone),
                RandomVector(np.ones(width), rows, 0.0 * rows, 0.0 * rows, 0.0 * tone),
                RandomVector(np.ones(width), 0.0 * rows, 0.0 * rows, rows, 0.0 * tone),
                RandomVector(np.zeros(width), 0.0 * rows, np.eye(width), rows, tone),
            ):
                assert all(math.isfinite(length) for length in case.quantiles(CONFIDENCES))
                assert 0.0 <= case.probability(0.5) <= case.probability(2.0) == pytest.approx(1.0)
        assert vector((1.0, 2.0), normal=[(1.0, 0.0)]).quantiles([]) == []
        assert vector((0.0, 0.0, 0.0), uniform=np.eye(3)).quantiles([]) == []

    def test_impossible_limits(self) -> None:
        case = mixed(2, (2, 2, 1, 1), 1.0, seed=4)
        assert case.probability(-1.0) == 0.0
        assert case.probability(0.0) == pytest.approx(0.0, abs=1e-9)
        assert case.probability(1e300) == case.probability(math.inf) == 1.0


def counts_of(most: int) -> st.SearchStrategy[tuple[int, int, int, int]]:
    return st.tuples(*[st.integers(0, most)] * 4).filter(any)


COUNTS, SEEDS = counts_of(2), st.integers(0, 2**31)


class TestSymmetries:
    @settings(max_examples=25, deadline=None)
    @given(st.integers(1, 3), COUNTS, SEEDS, st.floats(1e-6, 1e6))
    def test_scale(self, width: int, counts: tuple[int, int, int, int], seed: int, scale: float) -> None:
        case = mixed(width, counts, float(seed % 2), seed)
        scaled = RandomVector(*(scale * rows for rows in case))
        expected = [scale * length for length in case.quantiles(PERCENTILES)]
        assert scaled.quantiles(PERCENTILES) == pytest.approx(expected, rel=1e-4)

    @settings(max_examples=25, deadline=None)
    @given(counts_of(3), SEEDS, st.floats(0.0, 6.3))
    def test_rotation(self, counts: tuple[int, int, int, int], seed: int, angle: float) -> None:
        # Vectors of bounds alone have atoms, which a rotation moves by rounding.
        case = mixed(2, (counts[0] + 1, *counts[1:]), float(seed % 2), seed)
        turn = np.array([(math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))])
        turned = RandomVector(*(rows @ turn for rows in case))
        # Lattices of both are within 5e-4 of a probability, see the module.
        found = [turned.probability(length) for length in case.quantiles(PERCENTILES)]
        assert found == pytest.approx(PERCENTILES, abs=1e-3)

    @settings(max_examples=40, deadline=None)
    @given(st.integers(1, 4), COUNTS, SEEDS)
    def test_a_higher_confidence_needs_a_longer_limit(
        self, width: int, counts: tuple[int, int, int, int], seed: int
    ) -> None:
        lengths = mixed(width, counts, float(seed % 3), seed).quantiles((0.5, 0.6, 0.8, 0.9, 0.99, 0.999, 0.999999))
        assert all(math.isfinite(length) and length >= 0.0 for length in lengths)
        assert all(low <= high * (1.0 + 1e-3) for low, high in itertools.pairwise(lengths))

    @settings(max_examples=40, deadline=None)
    @given(st.integers(1, 2), st.integers(1, 3), SEEDS, st.floats(0.0, 3.0))
    def test_a_mean_never_shortens_a_normal_vector(self, width: int, count: int, seed: int, size: float) -> None:
        case = mixed(width, (count, 0, 0, 0), 0.0, seed)
        mean = size * np.random.default_rng(seed + 1).normal(size=width)
        moved = case._replace(mean=mean).quantiles(CONFIDENCES)
        assert all(high >= low * (1.0 - 1e-5) for low, high in zip(case.quantiles(CONFIDENCES), moved, strict=True))

    @settings(max_examples=40, deadline=None)
    @given(st.integers(1, 4), COUNTS, SEEDS)
    def test_probability_of_a_quantile(self, width: int, counts: tuple[int, int, int, int], seed: int) -> None:
        case = mixed(width, (counts[0] + 1, *counts[1:]), float(seed % 3), seed)
        for confidence, length in zip(PERCENTILES, case.quantiles(PERCENTILES), strict=True):
            assert case.probability(length) == pytest.approx(confidence, abs=1e-3)
