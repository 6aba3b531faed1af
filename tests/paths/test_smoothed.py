"""Slow times of a log, and the polynomial that smooths it."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.geometry import PlatformState
from bisar_budget.paths.flight import (
    LeftOut,
    Log,
    PathFileError,
    hold_to_usable_records,
    slow_times,
    smoothed,
    widest_stretch,
)
from bisar_budget.paths.instant import Instant
from tests.conftest import examples

START = Instant(61192, 19201.25)  # 2026-06-01T05:20:01.250Z
NOISE = 0.02  # m


def log(times: Any, start: Instant | None = START) -> Log:
    at = np.asarray(times, dtype=float)
    return Log(at, np.zeros((at.size, 3)), False, "", start)


TIMES = np.arange(0, 3001) / 50


def test_slow_time_is_zero_in_the_middle() -> None:
    in_utc = slow_times(log(TIMES), START.after(30), None, 10.0, "a.csv")
    assert in_utc == pytest.approx(TIMES - 30, abs=1e-9)
    assert slow_times(log(100 + TIMES, None), None, 130.0, 10.0, "a.csv") == pytest.approx(TIMES - 30, abs=1e-9)
    assert slow_times(log(TIMES - 30, None), None, None, 10.0, "a.csv") == pytest.approx(TIMES - 30, abs=1e-9)
    # A mission that has an instant for an orbit's sake: this log has another clock.
    assert slow_times(log(TIMES, None), START, 30.0, 10.0, "a.csv") == pytest.approx(TIMES - 30, abs=1e-9)


@pytest.mark.parametrize("lacking", [0, 1])
def test_an_end_may_lack_one_sample(lacking: int) -> None:
    """At the limit of what is bridged, and beyond it."""
    start, end = lacking, 501 - lacking
    assert slow_times(log(TIMES[start:501]), START.after(5), None, 10.0, "a.csv").size == 501 - start
    assert slow_times(log(TIMES[:end]), START.after(5), None, 10.0, "a.csv").size == end
    for times in (TIMES[2:501], TIMES[:499]):
        with pytest.raises(PathFileError, match="the aperture needs"):
            slow_times(log(times), START.after(5), None, 10.0, "a.csv")


def test_gaps_up_to_five_intervals_are_bridged() -> None:
    slow_times(log(np.delete(TIMES, range(1400, 1404))), START.after(30), None, 10.0, "a.csv")
    with pytest.raises(PathFileError, match=r"has a gap of 0\.12 s after 2026-06-01T05:20:29\.230Z"):
        slow_times(log(np.delete(TIMES, range(1400, 1405))), START.after(30), None, 10.0, "a.csv")
    # Outside the aperture nobody minds.
    slow_times(log(np.delete(TIMES, range(100, 1000))), START.after(30), None, 10.0, "a.csv")


@pytest.mark.parametrize(
    ("times", "start", "center", "seconds", "says"),
    [
        (TIMES, START, None, None, "is in UTC; give the middle of the aperture in UTC"),
        (TIMES, START, START, 30.0, "is in UTC, and has no time 30 s; give the middle of the aperture in UTC"),
        (
            TIMES,
            START,
            START.after(57),
            None,
            "covers 2026-06-01T05:20:01.250Z to 2026-06-01T05:21:01.250Z, "
            "the aperture needs 2026-06-01T05:20:53.250Z to 2026-06-01T05:21:03.250Z",
        ),
        (
            TIMES,
            START,
            Instant(59000, 0.0),
            None,
            "covers 2026-06-01T05:20:01.250Z to 2026-06-01T05:21:01.250Z, "
            "the aperture needs 2020-05-30T23:59:55.000Z to 2020-05-31T00:00:05.000Z",
        ),
        (
            TIMES,
            START,
            Instant(2973483, 86399.0),  # 9999-12-31T23:59:59Z
            None,
            "covers 2026-06-01T05:20:01.250Z to 2026-06-01T05:21:01.250Z, "
            "the aperture needs 9999-12-31T23:59:54.000Z to MJD 2973484.00005",
        ),
        (193831 + TIMES, None, None, None, "covers 193831 s to 193891 s, the aperture needs -5 s to 5 s"),
        ([0.0], None, None, None, "covers 0 s to 0 s, the aperture needs -5 s to 5 s"),
        (
            [*(TIMES - 10)[:100], *(TIMES + 9)[:100]],
            None,
            None,
            None,
            "has a gap of 17.02 s after -8.02 s, in the aperture; 0.02 s is usual, at most 0.1 s are bridged",
        ),
        (
            np.delete(TIMES - 30, range(1500, 1600)),
            None,
            None,
            0.0,
            "has a gap of 2.02 s after -0.02 s, in the aperture; 0.02 s is usual, at most 0.1 s are bridged",
        ),
    ],
)
def test_logs_without_the_aperture(
    times: Any, start: Instant | None, center: Instant | None, seconds: float | None, says: str
) -> None:
    with pytest.raises(PathFileError) as error:
        slow_times(log(times, start), center, seconds, 10.0, "a.csv")
    assert str(error.value) == f"a.csv: {says}"


def derivatives(state: PlatformState) -> list[Any]:
    return [np.array(one) for one in (state.position, state.velocity, state.acceleration)]


def sigmas(at: Any, order: int) -> list[float]:
    """One sigma of position, velocity and acceleration at 0, by the covariance of least squares: σ² (AᵀA)⁻¹."""
    design = np.vander(at, order + 1, increasing=True)
    scaled = np.abs(at).max() ** np.arange(order + 1)
    variance = NOISE**2 * np.linalg.inv((design / scaled).T @ (design / scaled)).diagonal() / scaled**2
    return [math.sqrt(variance[n]) * factor for n, factor in enumerate((1, 1, 2))]


@examples(60)
@given(
    st.integers(1, 7),
    st.sampled_from([2.0, 10.0, 30.0]),
    st.sampled_from([20, 50, 200]),
    st.integers(0, 2**32 - 1),
    st.floats(-3, 1),
)
def test_a_polynomial_with_noise_is_found(order: int, aperture: float, rate: int, seed: int, size: float) -> None:
    """Errors at the middle are a few of the standard deviations that the true order has.

    An order that is left out is one that the noise hides: its size is below some standard deviations too.
    """
    random = np.random.default_rng(seed)
    times = np.arange(round(aperture * rate) + 1) / rate - aperture / 2
    powers = random.normal(0, 1, (order + 1, 3)) * (10.0**size / (aperture / 2) ** np.arange(order + 1))[:, None]
    powers[0] += 4000, -3000, 3000
    powers[min(1, order)] += 60, 5, 0
    true = np.vander(times, order + 1, increasing=True) @ powers
    found = smoothed(times, true + random.normal(0, NOISE, true.shape), aperture)
    assert found.samples == len(times)
    assert found.rms == pytest.approx(math.sqrt(3) * NOISE, rel=6 / math.sqrt(6 * len(times)))
    padded = np.vstack([powers, np.zeros((3, 3))])
    expected = [padded[0], padded[1], 2 * padded[2]]
    allowed = sigmas(times, max(order, found.order))
    for one, other, sigma in zip(derivatives(found.state), expected, allowed, strict=True):
        assert np.abs(one - other).max() < 8 * sigma


@pytest.mark.parametrize(
    ("aperture", "rate"), [(2.0, 5), (2.0, 50), (10.0, 1), (10.0, 5), (10.0, 50), (30.0, 1), (30.0, 50)]
)
def test_a_straight_flight_stays_straight(aperture: float, rate: int) -> None:
    """What noise looks like in a higher order is not motion."""
    count = round(aperture * rate) + 1
    times = np.arange(count) / rate - aperture / 2
    orders = []
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(0, NOISE, (count, 3))
        orders.append(smoothed(times, times[:, None] * [60, 0, 0] + noise, aperture).order)
    assert orders.count(2) >= 38


@pytest.mark.parametrize("noise", [0.0, 1e-3, NOISE])
def test_a_turn_is_found(noise: float) -> None:
    """A coordinated turn, 60 m/s and 0.1 rad/s: 6 m/s² at the middle."""
    times = np.arange(501) / 50 - 5
    angle = 0.1 * times
    turn = 600 * np.stack([np.sin(angle), 1 - np.cos(angle), np.zeros(501)], axis=1)
    found = smoothed(times, turn + np.random.default_rng(5).normal(0, noise, turn.shape), 10.0)
    position, velocity, acceleration = derivatives(found.state)
    truncated = 600 * 0.5**9 / math.factorial(9)  # of the series, behind order 8 [m]
    position_sigma, velocity_sigma, acceleration_sigma = np.array(sigmas(times, 8)) * noise / NOISE
    assert np.abs(position).max() < 5 * position_sigma + truncated
    assert np.abs(velocity - [60, 0, 0]).max() < 5 * velocity_sigma + 1e-4
    assert np.abs(acceleration - [0, 6, 0]).max() < 5 * acceleration_sigma + 1e-4
    assert found.rms == pytest.approx(math.sqrt(3) * noise, rel=0.1, abs=truncated)


def test_turbulence_that_is_too_fast_is_left() -> None:
    """A wave of 2 s over an aperture of 10 s is no polynomial: the residual says so."""
    times = np.arange(501) / 50 - 5
    wave = 0.3 * np.sin(math.pi * times)[:, None] * [0, 0, 1]
    found = smoothed(times, times[:, None] * [60, 0, 0] + wave, 10.0)
    assert 0.1 < found.rms < 0.3
    assert 0.3 < found.farthest < 0.7
    assert np.abs(np.array(found.state.at(1.0)[0]) - [60, 0, 0]).max() < 0.5


def test_slow_noise_is_less_sure_than_white() -> None:
    """Noise that is correlated over 0.2 s: most of its wander is not taken for motion."""
    times = np.arange(501) / 50 - 5
    kept = math.exp(-0.02 / 0.2)
    orders = []
    for seed in range(20):
        drive = np.random.default_rng(seed).normal(0, NOISE * math.sqrt(1 - kept**2), (501, 3))
        noise = np.zeros((501, 3))
        for n in range(1, 501):
            noise[n] = kept * noise[n - 1] + drive[n]
        orders.append(smoothed(times, times[:, None] * [60, 0, 0] + noise, 10.0).order)
    assert np.median(orders) == 2
    assert np.mean(orders) < 3.5


@pytest.mark.parametrize("count", [0, 1, 4])
def test_too_few_samples(count: int) -> None:
    times = np.linspace(-1, 1, count)
    with pytest.raises(PathFileError) as error:
        smoothed(times, np.zeros((count, 3)), 2.0)
    said = f"has {count} fixes around the aperture of 2 s, at least 5 are needed; keep more of the log"
    assert str(error.value) == said


@pytest.mark.parametrize("count", [5, 6, 7, 9, 30])
def test_few_samples_are_smoothed(count: int) -> None:
    times = np.linspace(-1, 1, count)
    found = smoothed(times, np.stack([times, 3 * times**2, 0 * times], axis=1), 2.0)
    assert found.order == 2
    position, velocity, acceleration = derivatives(found.state)
    assert position == pytest.approx(np.zeros(3), abs=1e-12)
    assert velocity == pytest.approx(np.array([1, 0, 0]), abs=1e-12)
    assert acceleration == pytest.approx(np.array([0, 6, 0]), abs=1e-11)


# ---------------------------------------------------------------------- slow logs
RATE_OF_TURN, SPEED = math.radians(3), 60.0  # a standard-rate turn


def turning(times: np.ndarray) -> np.ndarray:
    """Places of an aircraft in a turn. [m]"""
    radius = SPEED / RATE_OF_TURN
    angle = RATE_OF_TURN * times
    return radius * np.stack([np.sin(angle), 1 - np.cos(angle), 0.02 * angle], axis=1)


@pytest.mark.parametrize(("rate", "aperture"), [(1.0, 3.0), (1.0, 6.0), (5.0, 1.0), (5.0, 3.0)])
def test_a_slow_log_gives_the_path_and_says_how_far_it_may_be_off(rate: float, aperture: float) -> None:
    """A log at 1 Hz failed over 3 s. The truth is within what is said: of 60 flights the root mean square is less."""
    random = np.random.default_rng(7)
    at = np.linspace(-aperture / 2, aperture / 2, 41)
    off, said = [], []
    for _ in range(60):
        times = np.arange(-30, 31) / rate + random.uniform(-0.5, 0.5) / rate
        found = smoothed(times, turning(times) + NOISE * random.standard_normal((times.size, 3)), aperture)
        off.append(np.mean(np.sum((np.stack(found.state.place(at), axis=1) - turning(at)) ** 2, axis=1)))
        said.append(found.missed**2)
        assert found.stretch >= aperture
        assert found.samples >= 9
    assert 0.1 * np.mean(said) < np.mean(off) < np.mean(said)


def test_what_a_platform_does_between_two_places_is_doubted() -> None:
    """Gusts of a second push it by metres; at 20 Hz a polynomial that does not follow them has it in its residual."""
    random = np.random.default_rng(3)
    fine = np.arange(-600, 601) / 20
    pushes = np.repeat(random.normal(0, 2.0, (61, 3)), 20, axis=0)[: fine.size]  # m/s²
    places = np.cumsum(np.cumsum(pushes, axis=0), axis=0) / 400 + fine[:, None] * [SPEED, 0, 0]
    slow = smoothed(fine[::20], places[::20], 3.0)
    inside = np.abs(fine) <= 1.5
    off = np.stack(slow.state.place(fine[inside]), axis=1) - places[inside]
    assert math.sqrt(np.mean(np.sum(off**2, axis=1))) < slow.missed
    assert slow.missed > 0.3


def test_in_a_gap_the_path_may_be_as_far_off_as_is_said() -> None:
    """Of 60 flights that bend, the root mean square in the gap is less."""
    random = np.random.default_rng(5)
    times = np.arange(-20, 21) / 5.0
    times = times[(times < -0.3) | (times > 0.5)]
    at = np.linspace(-0.2, 0.4, 13)
    off, said = [], []
    for _ in range(60):
        found = smoothed(times, turning(times) + NOISE * random.standard_normal((times.size, 3)), 2.0)
        off.append(np.mean(np.sum((np.stack(found.state.place(at), axis=1) - turning(at)) ** 2, axis=1)))
        said.append(found.missed**2)
    assert np.mean(off) < np.mean(said)


def test_a_gap_makes_more_of_noise() -> None:
    """Eight places on one side and one on the other: a parabola through them is less sure between than a place is."""
    times = np.array([-1.0, -0.98, -0.96, -0.94, -0.92, -0.9, -0.88, -0.86, 1.0])
    noise = NOISE * np.random.default_rng(1).standard_normal((times.size, 3))
    found = smoothed(times, turning(times) + noise, 2.0)
    between = np.stack(found.state.place(np.array([0.1])), axis=1) - turning(np.array([0.1]))
    assert found.missed > 2 * found.rms
    assert np.linalg.norm(between) < 3 * found.missed


def test_a_log_of_nine_places_in_the_aperture_needs_none_beside_it() -> None:
    times = np.arange(-40, 41) / 4.0
    assert smoothed(times, turning(times), 2.0).stretch == 2.0
    assert smoothed(times, turning(times), 1.9).stretch == pytest.approx(2.0)
    assert smoothed(times, turning(times), 2.0).samples == 9


# ---------------------------------------------------------------------- a stretch that is longer than the aperture
def straight(times: np.ndarray) -> np.ndarray:
    return times[:, None] * np.array([SPEED, 0.0, 0.0])


def acceleration_error(flown: Any, span: float, widest: float, rate: float = 5.0, noise: float = 0.12) -> float:
    """Root mean square over flights and axes of the acceleration's error at the middle of 6 s. [m/s²]"""
    times = np.arange(-round(span / 2 * rate), round(span / 2 * rate) + 1) / rate
    step = 1e-2
    true = (flown(np.array([step])) - 2 * flown(np.array([0.0])) + flown(np.array([-step])))[0] / step**2
    off = []
    for seed in range(30):
        log = flown(times) + noise * np.random.default_rng(seed).standard_normal((times.size, 3))
        off.append(np.array(smoothed(times, log, 6.0, widest).state.acceleration) - true)
    return float(np.sqrt(np.mean(np.square(off))))


def test_noise_is_averaged_over_what_lies_outside_the_aperture() -> None:
    """σ√(720/(n·T⁴)) of a parabola: 15 mm/s² over the aperture of 6 s, whatever the log has; 1 mm/s² over 18 s."""
    assert acceleration_error(straight, 60, 0.0) == pytest.approx(0.0147, rel=0.25)
    assert acceleration_error(straight, 6, math.inf) == pytest.approx(0.0147, rel=0.25)
    assert acceleration_error(straight, 60, math.inf) < 0.2 * 0.0147


@pytest.mark.parametrize(
    "flown",
    [
        turning,
        lambda times: turning(7 * times) / 7,
        lambda times: straight(times) + np.maximum(times - 4, 0)[:, None] ** 2 * [0.0, 1.5, 0.0],
        lambda times: straight(times) + 0.5 * np.sin(0.6 * times + 0.7)[:, None] * [0.0, 0.3, 1.0],
    ],
    ids=["standard-rate turn", "hard turn", "roll-in after the aperture", "wave of 10 s"],
)
def test_a_turn_is_not_smeared(flown: Any) -> None:
    """A longer stretch is no worse than the aperture, where there is motion beside it."""
    assert acceleration_error(flown, 60, math.inf) < 1.1 * acceleration_error(flown, 60, 0.0)


@pytest.mark.parametrize("rate", [10.0, 50.0])
def test_a_clean_log_keeps_its_numbers(rate: float) -> None:
    """Noise of 10 µm: acceleration to 5e-3 of that of the turn."""
    times = np.arange(-round(30 * rate), round(30 * rate) + 1) / rate
    log = turning(times) + 1e-5 * np.random.default_rng(2).standard_normal((times.size, 3))
    short, wide = (smoothed(times, log, 2.0, widest) for widest in (0.0, math.inf))
    bend = SPEED * RATE_OF_TURN
    assert np.abs(np.subtract(short.state.acceleration, wide.state.acceleration)).max() < 5e-3 * bend
    assert np.abs(np.subtract(wide.state.acceleration, [0, bend, 0])).max() < 5e-3 * bend


def test_the_fit_says_its_own_noise() -> None:
    """σ²·720/(n·T⁴) on each axis, of a parabola through the aperture."""
    times = np.arange(-150, 151) / 50.0
    said = []
    for seed in range(20):
        noise = NOISE * np.random.default_rng(seed).standard_normal((times.size, 3))
        found = smoothed(times, straight(times) + noise, 6.0)
        assert found.order == 2
        said.append(np.diag(found.acceleration_noise))
    assert np.mean(said) == pytest.approx(NOISE**2 * 720 / (301 * 6.0**4), rel=0.05)


def test_the_residual_is_that_of_the_fixes() -> None:
    """White noise of its own size on each axis, correlated over half an interval."""
    times = np.arange(-1000, 1001) / 50.0
    sizes = np.array([0.01, 0.02, 0.05])
    log = straight(times) + sizes * np.random.default_rng(6).standard_normal((times.size, 3))
    found = smoothed(times, log, 40.0)
    assert np.sqrt(np.diag(found.residual)) == pytest.approx(sizes, rel=0.1)
    assert found.correlation_time == pytest.approx(0.01, rel=0.3)


def test_the_stretch_ends_before_a_gap_and_a_record_that_is_left_out() -> None:
    times = np.arange(-200, 201) / 10.0
    whole = Log(times, straight(times), False, "test")
    assert widest_stretch(whole, times, 2.0) == math.inf
    late = np.concatenate([times[times < 5], times[times > 9]])
    gap = widest_stretch(replace(whole, times=late, places=straight(late)), late, 2.0)
    assert gap == pytest.approx(2 * 4.9, rel=1e-4)
    lost = LeftOut(np.array([int(np.searchsorted(times, -7.0))]), ("a.csv:7: height is empty",))
    broken = replace(whole, left_out=lost)
    stretch = widest_stretch(broken, times, 2.0)
    assert stretch == pytest.approx(2 * 7.0, rel=1e-4)
    hold_to_usable_records(broken, times, stretch)
    with pytest.raises(PathFileError, match="height is empty"):
        hold_to_usable_records(broken, times, 2 * 7.1)
