"""Echoes of lines near each other, against transforms of the aperture's phasor."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.effects.vibration import near_groups, near_lines, worst_phases

TIME = (np.arange(1024) + 0.5) / 1024 - 0.5


def highest_echo(phases: list[float], cycles: list[float], rng: np.random.Generator) -> float:
    """Highest echo over the response, in the worst phases that a search finds: a direct transform, no model of it."""
    x = np.arange(min(cycles) - 2, max(cycles) + 2, 0.05)
    transform = np.exp(-2j * np.pi * np.outer(x, TIME)) / TIME.size

    def level(starts: np.ndarray) -> float:
        phase = sum(
            size * np.sin(2 * np.pi * n * TIME + start) for size, n, start in zip(phases, cycles, starts, strict=True)
        )
        phasor = np.exp(1j * phase)
        coherent = phasor.mean()
        return float(np.abs(transform @ (phasor - coherent)).max() / abs(coherent))

    tried = [rng.uniform(0, 2 * np.pi, len(phases)) for _ in range(80)]
    worst = max(tried, key=level)
    for step in (0.4, 0.2, 0.1, 0.05):
        worst = max([worst, *(worst + rng.normal(0, step, len(phases)) for _ in range(25))], key=level)
    return level(worst)


@pytest.mark.parametrize("seed", range(12))
def test_pairs_and_triples_are_within_half_a_decibel_of_the_transform(seed: int) -> None:
    """Random lines up to 2.5 cycles apart, from three cycles per aperture on, echoes of about -30 dB."""
    rng = np.random.default_rng(seed)
    count = 2 + seed % 2
    cycles = list(np.cumsum([rng.uniform(3, 12), *rng.uniform(0, 2.5, count - 1)]))
    phases = list(rng.uniform(0.2, 1, count) * 0.06)
    predicted = worst_phases(phases, cycles).amplitude / 2
    measured = highest_echo(phases, cycles, rng)
    assert 20 * math.log10(predicted / measured) == pytest.approx(0, abs=0.5)


@pytest.mark.parametrize(
    ("apart", "raised_db"),
    # |sinc| of both by hand: at half way of one cycle 2·2/π; 2.5 cycles off the sidelobe is 1/2.5π.
    [(0.0, 6.02), (1.0, 2.10), (1.5, 1.68), (2.5, 1.04)],
)
def test_two_equal_lines_raise_each_other(apart: float, raised_db: float) -> None:
    found = worst_phases([1.0, 1.0], [20.0, 20.0 + apart])
    assert 20 * math.log10(found.amplitude) == pytest.approx(raised_db, abs=0.1)


@given(
    st.lists(st.tuples(st.floats(0, 1), st.floats(0, 2.5)), min_size=1, max_size=12),
    st.floats(1, 30),
)
def test_no_place_is_worse_than_the_one_found(lines: list[tuple[float, float]], first: float) -> None:
    """Every hundredth of a cell looked at, by NumPy; steps of the search leave 2e-4, its places 1 % at the most."""
    amplitudes = np.array([size for size, _ in lines])
    cycles = first + np.cumsum([gap for _, gap in lines])
    x = np.arange(cycles.min() - 2, cycles.max() + 2, 0.01)
    everywhere = (amplitudes * np.abs(np.sinc(x[:, None] - cycles))).sum(axis=1)
    found = worst_phases(list(amplitudes), list(cycles))
    assert found.amplitude >= 0.99 * everywhere.max()
    at_it = (amplitudes * np.abs(np.sinc(found.cycles - cycles))).sum()
    assert found.amplitude == pytest.approx(at_it, abs=1e-12)
    assert found.amplitude >= amplitudes.max()


@given(st.lists(st.floats(0.1, 30), max_size=9))
def test_groups_are_chains_of_lines_within_two_and_a_half_cycles(cycles: list[float]) -> None:
    groups = near_lines(cycles)
    members = [index for group in groups for index in group]
    assert len(members) == len(set(members))
    for group in groups:
        steps = np.diff(sorted(cycles[index] for index in group))
        assert len(group) > 1
        assert (steps <= 2.5 * (1 + 1e-9)).all()
    fast = [index for index, n in enumerate(cycles) if n >= 1]
    assert set(members) <= set(fast)
    for one in fast:
        for other in fast:
            if one < other and abs(cycles[one] - cycles[other]) <= 2.5:
                assert any({one, other} <= set(group) for group in groups)


@pytest.mark.parametrize("count", [1, 2, 5, 9, 20])  # more than eight lines have more places than are searched
def test_many_cases_at_once_are_each_case_alone(count: int) -> None:
    rng = np.random.default_rng(count)
    cycles = rng.uniform(0.5, 8, (count, 40))
    cycles[:, 20:] = np.round(cycles[:, 20:])  # some have one frequency
    sizes = rng.uniform(0, 1, cycles.shape)
    groups = near_groups(cycles)
    for case in range(40):
        alone = near_lines(list(cycles[:, case]))
        assert alone == [tuple(np.flatnonzero(groups[:, case] == one)) for one in range(groups[:, case].max() + 1)]
    for members in (groups == 0, np.ones(cycles.shape, dtype=bool)):
        some = np.flatnonzero(members.any(axis=0))
        if not some.size:
            continue
        found = worst_phases(sizes[:, some], cycles[:, some], members[:, some])
        for place, case in enumerate(some):
            mine = members[:, case]
            alone = worst_phases(sizes[mine, case], cycles[mine, case])
            assert (found.amplitude[place], found.cycles[place]) == pytest.approx(alone, rel=1e-12)


def test_a_thousand_lines_take_no_time() -> None:
    """As many as a file may have; a gate is not to be held up by a list."""
    count = 1000
    found = worst_phases([1e-6] * count, [5 + 0.5 * k for k in range(count)])
    assert found.amplitude > 2e-6
