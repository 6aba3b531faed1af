"""Logs of long and circling flights: as many pieces as they need, and none for noise.

The truth of each flight is a formula. What a fit to noise does is redrawn here, not taken from the package.
"""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bisar_budget.geometry import BistaticGeometry, Pieces, PlatformState
from bisar_budget.paths.flight import Fitted, slow_times, smoothed, widest_stretch
from bisar_budget.paths.splines import MIN_PIECE_S, SplineFit
from tests.paths.test_smoothed import log as log_of

RADIUS, RATE, HEIGHT = 1000.0, 0.025, 500.0  # m, rad/s, m
TURN_S = 2 * math.pi / RATE
FAR = np.array([1e6, -3e5, 2e4])  # m
Flight = Callable[[Any], Any]


def circle(times: Any) -> Any:
    """Places on a level circle. [m]"""
    angle = RATE * times
    return np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), HEIGHT + 0 * times], axis=1)


def straight(times: Any) -> Any:
    """Places of a straight flight. [m]"""
    return times[:, None] * [50.0, 3.0, -0.5] + [0.0, -2000.0, 500.0]


def race_track(
    times: Any, leg_s: float = 60.0, turn_s: float = 60.0, roll_s: float = 4.0, speed: float = 50.0
) -> Any:
    """Legs of 60 s and turns by half a circle, which begin and end within 4 s; from the middle of a leg on. [m]

    Headings are integrals of the rate of turn in closed form, places those of the velocity by Simpson's rule.
    """
    fine = np.linspace(-200.0, 200.0, 80_001)
    most = math.pi / (turn_s - roll_s)

    def heading_of(time: Any) -> Any:
        since = np.mod(time + leg_s / 2, leg_s + turn_s) - leg_s
        turns = np.floor((time + leg_s / 2) / (leg_s + turn_s))
        ramp = lambda t: np.clip(t, 0, roll_s) ** 2 / 2 + roll_s * np.maximum(t - roll_s, 0)  # noqa: E731
        return math.pi * turns + most / roll_s * (ramp(since) - ramp(since - turn_s + roll_s))

    step = fine[1] - fine[0]
    heads, between = heading_of(fine), heading_of(fine[:-1] + step / 2)
    moved = [
        np.concatenate([[0.0], np.cumsum((f(heads[:-1]) + 4 * f(between) + f(heads[1:])) * step * speed / 6)])
        for f in (np.cos, np.sin)
    ]
    east, north = (np.interp(times, fine, way - np.interp(0.0, fine, way)) for way in moved)
    return np.stack([east, north - 2000.0, HEIGHT + 0 * times], axis=1)


def fixes(aperture_s: float, rate: float) -> Any:
    """Times of a log that ends a second behind the aperture. [s]"""
    last = math.ceil((aperture_s / 2 + 1) * rate)
    return np.arange(-last, last + 1) / rate


def fitted(flown: Flight, aperture_s: float, rate: float, noise_m: float = 0.0, seed: int = 0) -> Fitted:
    """The path through a log of a flight."""
    times = fixes(aperture_s, rate)
    noise = np.random.default_rng(seed).normal(0, noise_m, (len(times), 3)) if noise_m else 0.0
    return smoothed(times, flown(times) + noise, aperture_s)


def apart(state: PlatformState, flown: Flight, aperture_s: float) -> Any:
    """How far a path is from the truth over the aperture, (4001,). [m]"""
    times = np.linspace(-aperture_s / 2, aperture_s / 2, 4001)
    return np.linalg.norm(np.stack(np.broadcast_arrays(*state.place(times)), axis=1) - flown(times), axis=1)


def rms(values: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("rate", [1.0, 10.0])
@pytest.mark.parametrize("turns", [0.5, 1.0, 3.0])
def test_a_clean_circle_leaves_less_than_a_millimetre(rate: float, turns: float) -> None:
    """One polynomial of order 8 leaves 0.7 m of a full one."""
    found = fitted(circle, turns * TURN_S, rate)
    assert found.pieces > 1
    assert found.farthest < 1e-3
    assert apart(found.state, circle, turns * TURN_S).max() < 1e-3


def test_a_far_circle_leaves_no_more() -> None:
    """1000 km away, double precision has 0.1 nm."""
    found = fitted(lambda times: circle(times) + FAR, TURN_S, 1.0)
    assert apart(found.state, lambda times: circle(times) + FAR, TURN_S).max() < 1e-3


@pytest.mark.parametrize(("rate", "most_m"), [(10.0, 2e-3), (1.0, 0.4)])
def test_turns_of_a_race_track_are_flown(rate: float, most_m: float) -> None:
    """One polynomial leaves hundreds of metres. At 1 Hz four fixes see a roll, and what is missed is said."""
    found = fitted(race_track, 300.0, rate)
    off = rms(apart(found.state, race_track, 300.0))
    assert off < most_m
    assert off < 1.2 * found.missed


def test_legs_get_longer_pieces_than_turns() -> None:
    found = fitted(race_track, 300.0, 10.0)
    assert isinstance(found.state.curve, Pieces)
    lengths = np.diff(np.array(found.state.curve.starts))
    assert lengths.max() >= 8 * lengths.min()
    assert lengths.min() >= MIN_PIECE_S


def test_pieces_meet_with_one_place_and_one_velocity() -> None:
    """To rounding of places 1000 km away."""
    for flown in (circle, race_track):
        found = fitted(lambda times, flown=flown: flown(times) + FAR, 250.0, 10.0)
        assert isinstance(found.state.curve, Pieces)
        assert len(found.state.curve.starts) == found.pieces - 1
        for start in found.state.curve.starts:
            (place, velocity), (before, earlier) = (found.state.at(t) for t in (start, np.nextafter(start, -1e9)))
            assert np.abs(np.subtract(place, before)).max() < 1e-9
            assert np.abs(np.subtract(velocity, earlier)).max() < 1e-9


def test_rates_at_the_midpoint_are_those_of_the_path() -> None:
    """Position, velocity and acceleration of the circle; and the polynomial beside the midpoint."""
    state = fitted(circle, TURN_S, 10.0).state
    assert state.position == pytest.approx((RADIUS, 0, HEIGHT), abs=1e-4)
    assert state.velocity == pytest.approx((0, RADIUS * RATE, 0), abs=1e-4)
    assert state.acceleration == pytest.approx((-RADIUS * RATE**2, 0, 0), abs=1e-4)
    near = 0.1
    polynomial = PlatformState(
        position=state.position, velocity=state.velocity, acceleration=state.acceleration, bends=state.bends
    )
    assert polynomial.place(near) == pytest.approx(state.place(near), abs=1e-9)


def test_how_far_it_gets_is_the_way_it_flies() -> None:
    state = fitted(circle, TURN_S, 1.0).state
    assert state.travelled(TURN_S / 2) == pytest.approx(math.pi * RADIUS, rel=1e-3)
    assert state.travelled(np.array([1.0, 10.0])) == pytest.approx(RADIUS * RATE * np.array([1, 10]), rel=1e-3)
    assert state.sinks(TURN_S / 2) == pytest.approx(0.0, abs=1e-3)
    assert not state.is_still
    assert not state.is_straight


def test_a_baseline_of_pieces_is_the_difference_of_both_paths() -> None:
    times = np.linspace(-100, 100, 41)
    receiver = fitted(circle, TURN_S, 1.0).state
    transmitter = PlatformState(position=(3000.0, 0.0, 4000.0), velocity=(0.0, 100.0, 0.0), bends=((1e-5, 0.0, 0.0),))
    between = BistaticGeometry(transmitter=transmitter, receiver=receiver).apart
    for one, other, difference in zip(transmitter.at(times), receiver.at(times), between.at(times), strict=True):
        assert np.array(np.broadcast_arrays(*difference)) == pytest.approx(
            np.array(np.broadcast_arrays(*one)) - np.array(other), abs=1e-9
        )


def test_pieces_of_many_cases_are_those_of_each() -> None:
    """As a sweep has them: numbers that differ are arrays."""
    at, edges = fixes(TURN_S, 1.0), np.linspace(-TURN_S / 2, TURN_S / 2, 17)
    first, second = (SplineFit.of(at, flown(at), edges).state().curve for flown in (circle, straight))
    assert isinstance(first, Pieces)
    assert isinstance(second, Pieces)

    def both(one: Any, other: Any) -> Any:
        return tuple(map(both, one, other)) if isinstance(one, tuple) else np.array([one, other])

    together = Pieces(first.starts, both(first.middles, second.middles), both(first.powers, second.powers))
    times = np.linspace(-120, 120, 31)[:, None]
    for kind in (0, 1):
        stacked = np.array(together.at(times)[kind])
        assert stacked == pytest.approx(
            np.stack([np.array(one.at(times[:, 0])[kind]) for one in (first, second)], axis=-1), abs=1e-9
        )


# ---------------------------------------------------------------------- what is no motion
@pytest.mark.parametrize("aperture_s", [3.0, 20.0, 250.0])
@pytest.mark.parametrize("rate", [1.0, 10.0])
def test_white_noise_gets_no_piece(aperture_s: float, rate: float) -> None:
    for seed in range(15):
        assert fitted(straight, aperture_s, rate, 0.01, seed).pieces == 1


def test_a_noisy_straight_flight_is_the_parabola_of_least_squares() -> None:
    """As before there were pieces, by NumPy's own fit."""
    times = fixes(60.0, 10.0)
    places = straight(times) + np.random.default_rng(1).normal(0, 0.01, (len(times), 3))
    found = smoothed(times, places, 60.0)
    inside = np.abs(times) <= 30.0
    assert (found.order, found.pieces, found.samples) == (2, 1, 601)
    bend, velocity, position = np.polyfit(times[inside], places[inside], 2)
    assert found.state.position == pytest.approx(position, rel=1e-9, abs=1e-9)
    assert found.state.velocity == pytest.approx(velocity, rel=1e-9, abs=1e-9)
    assert found.state.acceleration == pytest.approx(2 * bend, rel=1e-6, abs=1e-12)


def test_noise_of_a_circle_is_not_fitted() -> None:
    """1 cm on each axis: the path is nearer to the truth than a quarter of that, and the residual has all of it."""
    found = fitted(circle, TURN_S, 10.0, 0.01)
    assert 8 <= found.pieces <= 24
    assert found.rms == pytest.approx(math.sqrt(3) * 0.01, rel=0.05)
    assert rms(apart(found.state, circle, TURN_S)) < 0.25 * math.sqrt(3) * 0.01


@pytest.mark.parametrize("correlation_s", [0.2, 1.0, 100.0])
def test_a_wandering_receiver_gets_few_pieces(correlation_s: float) -> None:
    """Gauss-Markov noise of 1 cm over 250 s is no motion: its residual falls slowly with the length of pieces."""
    times = fixes(250.0, 5.0)
    kept = math.exp(-0.2 / correlation_s)
    counts = []
    for seed in range(8):
        random = np.random.default_rng(seed)
        wander = random.normal(0, 0.01, (len(times), 3))
        for n in range(1, len(times)):
            wander[n] = kept * wander[n - 1] + math.sqrt(1 - kept**2) * wander[n]
        places = straight(times) + wander + random.normal(0, 3e-3, wander.shape)
        counts.append(smoothed(times, places, 250.0).pieces)
    assert np.median(counts) == 1
    assert max(counts) <= 8


def test_a_log_with_a_gap_has_a_path_in_it() -> None:
    """Five intervals are bridged: 5 s of a circle flown at 1 Hz, clean and with 1 cm."""
    times = np.delete(fixes(TURN_S, 1.0), range(150, 154))
    log = log_of(times, None)
    assert slow_times(log, None, 0.0, TURN_S, "a.csv").size == times.size
    for noise_m, most_m in ((0.0, 1e-3), (0.01, 0.03)):
        noise = np.random.default_rng(3).normal(0, noise_m, (len(times), 3)) if noise_m else 0.0
        found = smoothed(times, circle(times) + noise, TURN_S, widest_stretch(log, times, TURN_S))
        off = apart(found.state, circle, TURN_S)
        assert off.max() < most_m
        assert rms(off) < found.missed


def test_what_the_noise_of_the_fit_does_to_the_path_is_said() -> None:
    """Paths through redrawn noise scatter about their mean by the sum of the modes, and bend by the parabola's."""
    aperture_s, noise_m = TURN_S, 0.05
    times = np.linspace(-aperture_s / 2, aperture_s / 2, 401)
    parabola = 2 * np.linalg.pinv(np.vander(times, 3, increasing=True))[2]
    orders = np.polynomial.legendre.legvander(2 * times / aperture_s, 8)
    smooth = orders @ np.linalg.pinv(orders)  # of what errs slowly, as the modes say
    paths, said, bends = [], [], []
    for seed in range(40):
        found = fitted(circle, aperture_s, 4.0, noise_m, seed)
        assert found.pieces > 1
        assert found.path_noise is not None
        paths.append(smooth @ np.stack(found.state.place(times), axis=1))
        modes = np.array(found.path_noise.modes)
        said.append(
            np.mean(np.sum(np.einsum("to,moa->mta", np.vander(times, 9, increasing=True), modes) ** 2, (0, 2)))
        )
        bends.append(np.diag(found.acceleration_noise))
    scatter = np.array(paths) - smooth @ circle(times)
    assert np.sqrt(np.mean(said)) == pytest.approx(np.sqrt(np.mean(np.sum(scatter**2, axis=2))), rel=0.1)
    bent = np.einsum("t,sta->sa", parabola, scatter)
    assert np.sqrt(np.mean(bends)) == pytest.approx(np.sqrt(np.mean(bent**2)), rel=0.2)


def test_some_cases_of_a_path_in_pieces_fly_the_same_pieces() -> None:
    """Time tags look at paths case by case: the polynomial about the midpoint was flown instead."""
    times = np.linspace(-TURN_S / 2, TURN_S / 2, 201)
    ends, powers = (TURN_S / 4) * np.arange(-2, 3), []
    for start, end in itertools.pairwise(ends):
        inside = np.linspace(start, end, 50)
        fit = np.polynomial.polynomial.polyfit(inside - (start + end) / 2, circle(inside), 8)
        powers.append(tuple(map(tuple, fit)))
    middles = tuple((ends[:-1] + ends[1:]) / 2)
    curve = Pieces(tuple(ends[1:-1]), middles, tuple(powers))
    grows = np.array([1.0, 1.5, 2.0])  # three cases, each a larger circle
    larger = Pieces(
        curve.starts, curve.middles, tuple(tuple(tuple(x * grows for x in v) for v in one) for one in powers)
    )
    path = PlatformState(position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), curve=larger)
    places = np.array(path.of(np.array([2, 0])).place(times[:, None]))
    wanted = np.array(path.place(times[:, None]))
    np.testing.assert_array_equal(places, wanted[..., [2, 0]])
    assert np.abs(places[..., 1] - circle(times).T).max() < 0.05
