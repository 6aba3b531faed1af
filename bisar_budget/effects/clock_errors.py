"""Errors of clocks at random: phase noise of oscillators, and what a link that synchronises them leaves."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget.effects.effect import subject
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.random_effect import RandomEffect, RandomError, SensorCases, of_cases, sigmas
from bisar_budget.effects.spectra import (
    Floats,
    Parts,
    PowerLawPiece,
    heard_parts,
    link_parts,
    parts,
    set_parts,
    synchronized_parts,
)
from bisar_budget.mission.instruments import Oscillator


def oscillator_noise(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Phase noise of a platform's oscillator, or what exchanged pulses leave of it."""
    mission = seen.mission
    oscillator: Oscillator | None = getattr(mission.platforms, name).oscillator
    if oscillator is None:
        return
    found = _left_at_1_hz(seen, name, oscillator)
    scale = mission.radar.center_frequency**2 * 10 ** (np.asarray(oscillator.level) / 10)
    published, full = _of_clock(seen, Parts(*found * scale))
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
        covariance = of_cases(np.where(counts, found.covariance * square, 0.0), seen.cases)
        east, north = (
            np.where(counts, one, nothing)
            for one in seen.moved(found.constant * square, found.linear * square, found.constant_linear * square)
        )
    published = RandomEffect(quadratic, cubic, spread, east, north)
    whole = seen.of_orders(covariance)
    (*phases, east, north), whole = sigmas(whole, np.einsum("ffc->fc", whole))
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
    each = [np.broadcast_to(np.asarray(one), (seen.cases,)) for one in _kept_by(seen)]
    found = np.zeros((len(Parts._fields), seen.cases))
    if sync is not None and sync.is_direct_path and name == "transmitter":
        return found
    interval = None if sync is None else sync.interval
    for (alike, exchanged), places in _groups_alike((oscillator.noise_alone, interval), seen.cases):
        spectra: dict[Any, list[int]] = {}
        for place in places.tolist():  # an Allan deviation may be fitted otherwise over another aperture
            spectra.setdefault(noise_of(alike, 1.0, float(times[place])).pieces, []).append(place)
        for pieces, some in spectra.items():
            found[:, some] = _rows(_left_of(pieces, seen, exchanged, times[some], *(one[some] for one in each)))
    return found


def _kept_by(seen: SensorCases) -> tuple[Any, ...]:
    """Times that say what setting the clocks, or hearing them, leaves: age and averaging, or the echo's delay. [s]"""
    sync = seen.mission.synchronization
    if sync is None or sync.interval is not None:
        return ()
    return (sync.age, sync.averaging) if sync.is_holdover else (seen.geometry.echo_delay,)


def _left_of(
    pieces: Sequence[PowerLawPiece], seen: SensorCases, interval: float | None, aperture_time: Floats, *kept: Floats
) -> Parts:
    """Parts of what is left of a spectrum over apertures (cases,)."""
    if not kept:
        times, place = np.unique(aperture_time, return_inverse=True)
        found = parts(pieces, times) if interval is None else synchronized_parts(pieces, times, interval)
        return Parts(*_rows(found)[:, place])
    if len(kept) == 2:
        return set_parts(pieces, aperture_time, *kept)
    # The constant phase between direct path and echo moves nothing.
    return _without_constant(heard_parts(pieces, aperture_time, *kept))


def _without_constant(found: Parts) -> Parts:
    nothing = 0.0 * found.quadratic
    return found._replace(constant=nothing, constant_quadratic=nothing)


def _rows(found: Parts) -> Floats:
    """All parts as (parts, cases)."""
    return np.array(np.broadcast_arrays(*found))


def link_noise(seen: SensorCases) -> Iterator[RandomError]:
    """Each exchange is wrong by an error of its own, and straight lines join them."""
    sync = seen.mission.synchronization
    if sync is None or sync.error is None:
        return
    found = np.zeros((len(Parts._fields), seen.cases))
    if sync.interval is None:  # from pulse to pulse: all of it spreads
        found[Parts._fields.index("left")] = 1.0
    else:
        for interval, places in _groups_alike(sync.interval, seen.cases):
            times, place = np.unique(seen.aperture_time[places], return_inverse=True)
            found[:, places] = _rows(link_parts(times, interval))[:, place]
    published, full = _of_clock(seen, _without_constant(Parts(*found)))  # a constant phase moves nothing
    published, full = (one._replace(spread=one.spread / seen.factor) for one in (published, full))
    what = subject("clock", "synchronization")
    yield RandomError(what, "rad", sync.error * seen.factor, ("synchronization", "error"), published, full)


def _groups_alike(value: Any, cases: int) -> Iterator[tuple[Any, NDArray[np.intp]]]:
    """Tell apart the cases in which a value, or what is in it, differs: the value of each group, and its cases."""
    arrays = list(_arrays_in(value))
    if not arrays:
        yield value, np.arange(cases)
        return
    rows, group = np.unique(np.stack(arrays, axis=1), axis=0, return_inverse=True)
    for place, row in enumerate(rows.tolist()):
        yield _with_numbers(value, iter(row)), np.flatnonzero(group.ravel() == place)


def _arrays_in(value: Any) -> Iterator[Floats]:
    if isinstance(value, tuple):
        for part in value:
            yield from _arrays_in(part)
    elif isinstance(value, np.ndarray):
        yield value


def _with_numbers(value: Any, numbers: Iterator[float]) -> Any:
    """The same with numbers in the places of its arrays."""
    if isinstance(value, tuple):
        parts = [_with_numbers(part, numbers) for part in value]
        return value._make(parts) if hasattr(value, "_make") else tuple(parts)
    return next(numbers) if isinstance(value, np.ndarray) else value
