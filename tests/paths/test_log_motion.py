"""Logs that no platform can have flown, and honest ones beside them."""

import math
from typing import Any

import numpy as np
import pytest

from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.log_places import hold_to_motion

RATE, APERTURE = 50, 4.0  # Hz, s
TIMES = np.arange(-200, 201) / RATE


def flown(times: Any = TIMES, noise: float = 0.01, seed: int = 0) -> Any:
    """Places (n, 3) of a flight at 60 m/s to the east, which climbs, with white noise on each axis. [m]"""
    places = np.stack([60 * times, -4000 + 0 * times, 3000 + 2 * times], axis=1)
    return places + np.random.default_rng(seed).normal(0, noise, places.shape)


def said(places: Any, times: Any = TIMES) -> PathFileError:
    with pytest.raises(PathFileError) as error:
        hold_to_motion(times, places, APERTURE, "a.csv")
    return error.value


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [0.0, 1e-4, 0.01, 0.3, 30.0])
@pytest.mark.parametrize("rate", [2, 10, 50, 200])
def test_white_noise_is_no_fault(rate: int, noise: float, seed: int) -> None:
    times = np.arange(-4 * rate, 4 * rate + 1) / rate
    hold_to_motion(times, flown(times, noise, seed), APERTURE, "a.csv")


@pytest.mark.parametrize("seed", range(20))
def test_rough_noise_is_no_fault(seed: int) -> None:
    """Student's t of three degrees of freedom, 0.3 m, on top of noise that is correlated over a second."""
    random = np.random.default_rng(seed)
    slow = np.zeros((TIMES.size, 3))
    for n in range(1, TIMES.size):
        slow[n] = 0.98 * slow[n - 1] + random.normal(0, 0.1, 3)
    hold_to_motion(TIMES, flown() + slow + 0.3 * random.standard_t(3, slow.shape), APERTURE, "a.csv")


def test_manoeuvres_are_no_fault() -> None:
    """A turn of 5 g, a corner of a made-up flight, stamps that are 2 ms off, places rounded to 1 cm."""
    angle = 49.0 / 60 * TIMES
    turn = 60 / (49.0 / 60) * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    hold_to_motion(TIMES, turn, APERTURE, "a.csv")
    slow = np.arange(-4, 5.0)
    hold_to_motion(slow, turn[::RATE], APERTURE, "a.csv")
    corner = np.stack([60 * np.minimum(TIMES, 0), 60 * np.maximum(TIMES, 0), 0 * TIMES], axis=1)
    hold_to_motion(TIMES, corner, APERTURE, "a.csv")
    late = TIMES + np.random.default_rng(1).uniform(-2e-3, 2e-3, TIMES.size)
    hold_to_motion(late, flown(), APERTURE, "a.csv")
    hold_to_motion(TIMES, np.round(flown(), 2), APERTURE, "a.csv")


def test_a_drone_that_hovers_is_no_fault() -> None:
    """It drifts by 5 cm/s, and a log with 1 cm of resolution repeats its places."""
    drift = np.stack([0.05 * TIMES, 0 * TIMES, 100 + 0 * TIMES], axis=1)
    hold_to_motion(TIMES, np.round(drift, 2), APERTURE, "a.csv")
    hold_to_motion(TIMES, np.zeros((TIMES.size, 3)) + flown() - flown(noise=0.0), APERTURE, "a.csv")


def test_a_log_that_stands_still_is_refused() -> None:
    error = said(np.full((TIMES.size, 3), 1234.5))
    assert str(error) == "a.csv: stands still: its 201 fixes around the aperture are the same to 1 mm"
    assert error.hint == "A fixed platform needs no log: give its position, and speed 0"
    # It may move before and after: what the aperture needs is frozen.
    frozen = flown(noise=0.0)
    frozen[np.abs(TIMES) <= 2] = frozen[200]
    assert "stands still" in str(said(frozen))


@pytest.mark.parametrize(("moved", "is_still"), [(0.9e-3, True), (1.1e-3, False)])
def test_still_is_a_millimetre_over_the_aperture(moved: float, is_still: bool) -> None:
    """`moved` within the aperture of 4 s, without noise."""
    places = np.stack([moved / APERTURE * TIMES, 0 * TIMES, 0 * TIMES], axis=1)
    if is_still:
        assert "stands still" in str(said(places))
    else:
        hold_to_motion(TIMES, places, APERTURE, "a.csv")


def test_a_log_that_holds_its_places_is_refused() -> None:
    """A receiver of 10 Hz in a log of 50 Hz: four of five places are the one before, 4.8 m behind at 60 m/s."""
    held = np.repeat(flown()[::5], 5, axis=0)[: TIMES.size]
    error = said(held)
    assert str(error) == (
        "a.csv: repeats fixes: 160 of 201 around the aperture equal the fix before; from -2 s of mid-aperture on "
        "for 0.08 s, in which the platform moves 4.8 m"
    )
    assert error.hint == "Leave out repeated fixes, or write more digits"


def test_a_receiver_that_freezes_within_the_aperture_is_refused() -> None:
    frozen = flown()
    frozen[260:] = frozen[260]
    assert "from +1.2 s of mid-aperture on for 0.8 s" in str(said(frozen))
    # Before and behind the aperture nobody minds.
    frozen = flown()
    frozen[:80], frozen[301:] = frozen[0], frozen[301]
    hold_to_motion(TIMES, frozen, APERTURE, "a.csv")


@pytest.mark.parametrize(("speed", "is_refused"), [(4.8, False), (5.2, True)])
def test_one_repeated_place_counts_by_what_is_missed(speed: float, is_refused: bool) -> None:
    """A sample of 20 ms at 5 m/s is 0.1 m."""
    places = np.stack([speed * TIMES, 0 * TIMES, 0 * TIMES], axis=1)
    places[200] = places[199]
    if is_refused:
        assert "repeats fixes: 1 of 201" in str(said(places))
    else:
        hold_to_motion(TIMES, places, APERTURE, "a.csv")


@pytest.mark.parametrize("seed", range(3))
def test_a_log_that_jumps_is_refused(seed: int) -> None:
    """A step of all that follows, one wrong place, and a step over two samples."""
    after, once, ramp = (flown(seed=seed) for _ in range(3))
    after[220:, 1] += 50
    once[180, 2] += 6000
    ramp[240, 0] += 20
    ramp[241:, 0] += 40
    assert "jumps by 50 m within 0.02 s, +0.38 s from mid-aperture; the steps beside it allow" in str(said(after))
    assert "jumps by 6 km" in str(said(once))
    assert "jumps by 20 m" in str(said(ramp))


@pytest.mark.parametrize(("step", "is_refused"), [(0.095, False), (0.105, True)])
def test_a_step_of_a_decimetre_is_a_jump(step: float, is_refused: bool) -> None:
    """Without noise; smaller steps are in the residual."""
    places = flown(noise=0.0)
    places[200:, 1] += step
    if is_refused:
        assert "jumps by 105 mm" in str(said(places))
    else:
        hold_to_motion(TIMES, places, APERTURE, "a.csv")


@pytest.mark.parametrize(("step", "is_refused"), [(28.0, False), (32.0, True)])
def test_a_slow_log_may_step_as_3_g_do(step: float, is_refused: bool) -> None:
    """One place each second: 30 m of the next."""
    times = np.arange(-20.0, 21)
    places = flown(times, noise=0.0)
    places[20:, 2] += step
    if is_refused:
        assert f"jumps by {step:g} m" in str(said(places, times))
    else:
        hold_to_motion(times, places, APERTURE, "a.csv")


@pytest.mark.parametrize(("factor", "is_refused"), [(18, False), (22, True)])
def test_a_step_in_noise_is_a_jump_from_twenty_times_the_usual_on(factor: float, is_refused: bool) -> None:
    """Steps up and down by 0.1 m, in turn: each is 0.2 m off the median of those around it, or not off at all."""
    places = flown(noise=0.0)
    places[:, 1] += 0.05 * (np.arange(TIMES.size) % 2)
    usual = np.diff(places[:, 1])
    off = [abs(usual[n] - np.median(usual[n - 3 : n + 4])) for n in range(100, 110)]
    middle = float(np.median(off))
    places[200:, 1] += factor * middle
    assert middle > 0.04
    if is_refused:
        assert "jumps by" in str(said(places))
    else:
        hold_to_motion(TIMES, places, APERTURE, "a.csv")


def test_jumps_outside_the_aperture_are_nobodys() -> None:
    places = flown()
    places[95:, 1] += 50
    hold_to_motion(TIMES, places, APERTURE, "a.csv")
    places[100:, 1] += 50
    assert math.isclose(float(TIMES[100]), -2.0)
    assert "jumps" in str(said(places))


def test_few_places_are_left_to_the_fit() -> None:
    times = np.array([-1.0, 0.0, 1.0])
    hold_to_motion(times, np.zeros((3, 3)), APERTURE, "a.csv")
