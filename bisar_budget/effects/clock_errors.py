"""Errors of clocks at random: phase noise of oscillators, and what a link that synchronises them leaves."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bisar_budget.effects.effect import subject
from bisar_budget.effects.oscillator_tones import spurs_of
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.random_effect import RandomEffect, RandomError, SensorCases
from bisar_budget.effects.spectra import Floats, Parts, PowerLawPiece, heard_parts, left_parts, link_parts, set_parts
from bisar_budget.mission.instruments import Oscillator


def oscillator_noise(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Phase noise of a platform's oscillator, or what exchanged pulses leave of it, and spurs that they make slow."""
    mission = seen.mission
    oscillator: Oscillator | None = getattr(mission.platforms, name).oscillator
    if oscillator is None:
        return
    found = _left_at_1_hz(seen, name, oscillator)
    scale = mission.radar.center_frequency**2 * 10 ** (np.asarray(oscillator.level) / 10)
    found = found * scale
    for spur in spurs_of(mission, seen.geometry):
        slow = spur.slow_parts(seen.aperture_time)
        if spur.name == name and slow is not None:
            found += slow.rows.reshape(len(found), -1)
    published, full = _of_clock(seen, Parts(*found))
    key = ("platforms", name, "oscillator")
    path = key if oscillator.sensor is None else (*key, "sensor")
    yield RandomError(
        subject(name, "oscillator"), "dB", 1.0, path, published.times(seen.factor), full.times(seen.factor)
    )


def _of_clock(seen: SensorCases, found: Parts) -> tuple[RandomEffect, RandomEffect]:
    """Effects by both models of a phase with these parts [rad²]; those of orders 0 and 1 where they are known.

    Where the file states both terms of the clock, these stand for what a free oscillator displaces.
    """
    k, timing = 2 * math.pi / np.asarray(seen.mission.radar.wavelength), seen.mission.timing_error
    quadratic, cubic, spread = (np.sqrt(one) for one in found[:3])
    is_stated = not seen.mission.has_direct_path and timing.constant is not None and timing.linear is not None
    is_known = np.isfinite(found.constant + found.linear)
    nothing = np.where(is_stated | (quadratic + cubic == 0), 0.0, math.nan)
    counts = is_known & ~np.asarray(is_stated)
    with np.errstate(invalid="ignore"):
        square = 1 / k**2
        covariance = np.where(counts, found.covariance * square, 0.0)
        east, north = (
            np.where(counts, one, nothing)
            for one in seen.moved(found.constant * square, found.linear * square, found.constant_linear * square)
        )
    published = RandomEffect(quadratic, cubic, spread, east, north)
    (*phases, east, north), whole = seen.of_orders(covariance)
    own = np.zeros_like(whole)
    own[0, 0], own[1, 1] = quadratic**2, cubic**2
    quadratic, cubic, east, north = (
        np.where(counts, *both)
        for both in zip((*phases, east, north), (quadratic, cubic, nothing, nothing), strict=True)
    )
    return published, RandomEffect(quadratic, cubic, spread, east, north, np.where(counts, whole, own))


def _left_at_1_hz(seen: SensorCases, name: str, oscillator: Oscillator) -> Floats:
    """Parts of the phase at 1 Hz that an oscillator leaves over the aperture, (parts, cases); they grow as f₀².

    It depends on how the clocks are kept together: all of its noise, what exchanged pulses leave, what has come since
    the clocks were set, or what a receiver that hears the transmitter has between direct path and echo.
    """
    sync, times = seen.mission.synchronization, seen.aperture_time
    found = np.zeros((len(Parts._fields), seen.cases))
    if sync is not None and sync.is_direct_path and name == "transmitter":
        return found
    interval = None if sync is None else sync.interval
    for (alike, exchanged), places in seen.alike((oscillator.noise_alone, interval)):
        spectra: dict[Any, list[int]] = {}
        for place in places.tolist():  # an Allan deviation may be fitted otherwise over another aperture
            spectra.setdefault(noise_of(alike, 1.0, float(times[place])).pieces, []).append(place)
        for pieces, some in spectra.items():
            found[:, some] = _left_of(pieces, exchanged, seen, some).rows
    return found


def _left_of(
    pieces: Sequence[PowerLawPiece], interval: float | None, seen: SensorCases, some: Sequence[int]
) -> Parts:
    """Parts of what is left of a spectrum in some cases, (some,)."""
    sync, aperture_time = seen.mission.synchronization, seen.aperture_time[some]
    if sync is None or interval is not None:
        return left_parts(pieces, aperture_time, interval)

    def of_some(value: Any) -> Floats:
        return np.broadcast_to(np.asarray(value), (seen.cases,))[some]

    if sync.is_holdover:
        return set_parts(pieces, aperture_time, of_some(sync.age), of_some(sync.averaging))
    # The constant phase between direct path and echo moves nothing.
    return heard_parts(pieces, aperture_time, of_some(seen.geometry.echo_delay)).without_constant()


def link_noise(seen: SensorCases) -> Iterator[RandomError]:
    """Each exchange is wrong by an error of its own, and straight lines join them."""
    sync = seen.mission.synchronization
    if sync is None or sync.error is None:
        return
    found = np.zeros((len(Parts._fields), seen.cases))
    if sync.interval is None:  # from pulse to pulse: all of it spreads
        found[Parts._fields.index("left")] = 1.0
    else:
        for interval, places in seen.alike(sync.interval):
            times, place = np.unique(seen.aperture_time[places], return_inverse=True)
            found[:, places] = link_parts(times, interval).rows[:, place]
    published, full = _of_clock(seen, Parts(*found).without_constant())  # a constant phase moves nothing
    published, full = (one._replace(spread=one.spread / seen.factor) for one in (published, full))
    what = subject("clock", "synchronization")
    yield RandomError(what, "rad", sync.error * seen.factor, ("synchronization", "error"), published, full)
