"""Vibration by its spectrum: along the line of sight, and what it does to the image.

Acceleration of a spectrum S_a is displacement of S_x = S_a/(2πf)⁴. Its quadratic and cubic phase, what spreads and
what displaces are the integrals of `spectra`, so that what is slower than the aperture counts as what it is.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from bisar_budget.effects.effect import subject
from bisar_budget.effects.random_effect import RandomEffect, RandomError, SensorCases, of_cases, sigmas
from bisar_budget.effects.spectra import Floats, Parts, PowerLawPiece, heard_parts, parts, synchronized_parts
from bisar_budget.effects.vibration import counted
from bisar_budget.mission.model import Mission
from bisar_budget.mission.vibrations import FeltVibration, Spectrum, Vibration

DISPLACED = ((2 * math.pi) ** -4, 4.0)  # S_x = S_a/(2πf)⁴
_STEEP = 20.0  # slope of a density beyond which its powers would overflow
_STEPS = 16  # by which such a piece is taken instead: it is narrow, or nearly nothing at one of its ends


def power_of(vibration: Vibration | FeltVibration) -> Any:
    """Factor of power by which `spectrum_level` shifts a spectrum."""
    return 1.0 if vibration.spectrum_level is None else 10 ** (np.asarray(vibration.spectrum_level) / 10)


def spectrum_pieces(spectrum: Spectrum, law: tuple[float, float] = (1.0, 0.0)) -> tuple[PowerLawPiece, ...]:
    """A spectrum of acceleration [(m/s²)²/Hz] as pieces of power laws, times factor·f^(−slope) of a law.

    One of displacement is that of its acceleration, (2πf)⁴ times as large. Numbers only.
    """
    factor, slope = law
    if not spectrum.is_accelerated:
        factor, slope = factor / DISPLACED[0], slope - DISPLACED[1]
    found = []
    for (f, density), (g, last) in pairwise(spectrum.points):
        if not (density and last):  # made so small that nothing is left, of which there is no logarithm
            continue
        own = math.log(density / last) / math.log(g / f)
        if abs(own) <= _STEEP:
            found.append(PowerLawPiece(f, g, factor * density * f**own, own + slope))
            continue
        ends = np.geomspace(f, g, _STEPS + 1).tolist()
        for low, high in pairwise(ends):
            at_ends = (density * (low / f) ** -own, density * (high / f) ** -own)
            found.append(PowerLawPiece(low, high, factor * _mean(own, low, high, *at_ends), slope))
    return tuple(found)


def _mean(slope: float, low: float, high: float, at_low: float, at_high: float) -> float:
    """Mean density of a steep power law between two frequencies."""
    return (at_high * high - at_low * low) / ((1 - slope) * (high - low))


def spectrum_parts(
    spectrum: Spectrum, law: tuple[float, float], aperture_time: Floats, interval: Any = None, delay: Any = None
) -> Parts:
    """Parts over the aperture of a spectrum times a law, (cases,) each, see `spectrum_pieces`.

    `interval` is that of exchanged pulses, of which then counts what they leave, `delay` that between two times of
    which only the difference counts. Densities, times, intervals and delays may differ from case to case.
    """
    cases = aperture_time.size
    of_each = [*(density for _, density in spectrum.points), 0.0 if interval is None else interval]
    columns = np.array([np.broadcast_to(np.asarray(one, dtype=float), (cases,)) for one in of_each])
    known, group = np.unique(columns.T, axis=0, return_inverse=True)
    found = np.zeros((len(Parts._fields), cases))
    for place, (*densities, step) in enumerate(known.tolist()):
        of_group = np.flatnonzero(group.ravel() == place)
        points = tuple((f, density) for (f, _), density in zip(spectrum.points, densities, strict=True))
        pieces, times = spectrum_pieces(spectrum._replace(points=points), law), aperture_time[of_group]
        if delay is not None:
            of_pieces = heard_parts(pieces, times, np.broadcast_to(delay, (cases,))[of_group])
        else:
            each, of_time = np.unique(times, return_inverse=True)
            of_pieces = synchronized_parts(pieces, each, step) if step else parts(pieces, each)
            of_pieces = Parts(*(np.broadcast_to(part, each.shape)[of_time] for part in of_pieces))
        found[:, of_group] = np.array(np.broadcast_arrays(*of_pieces))
    return Parts(*found)


def times(found: Parts, power: Any) -> Parts:
    """Parts of a spectrum that is a factor of power as large."""
    return Parts(*(part * power for part in found))


def added(of_each: Sequence[Parts]) -> Parts:
    """Parts of independent phases together."""
    return Parts(*map(sum, zip(*of_each, strict=True)))


def effects_of(seen: SensorCases, found: Parts, along: Any = 1.0) -> tuple[RandomEffect, RandomEffect]:
    """Effects by both models of a range error with these parts [m²]; `along` is what data have of a metre of it."""
    k = 2 * math.pi / np.asarray(seen.mission.radar.wavelength)
    quadratic, cubic, left = (k * np.sqrt(part) for part in found[:3])
    published = RandomEffect(quadratic, cubic, left, *seen.moved(found.constant, found.linear))
    covariance = seen.of_orders(of_cases(times(found, np.square(along)).covariance, seen.cases))
    (quadratic, cubic, east, north), covariance = sigmas(covariance, np.einsum("ffc->fc", covariance))
    return published, RandomEffect(quadratic, cubic, left * along, east, north, covariance)


def vibration_spectrum(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Vibration of a platform by its spectrum: its unit is that of noise, a factor of amplitude, declared 1."""
    vibration = seen.error(name).vibration
    if vibration.spectrum is None:
        return
    found = spectrum_parts(vibration.spectrum, DISPLACED, seen.aperture_time)
    along = counted(seen.mission, name, 1.0, "islr", seen.geometry)
    published, full = effects_of(seen, times(found, power_of(vibration)), along)
    path = ("platforms", name, "motion_error", "vibration", "spectrum")
    what = subject(name, "vibration", "spectrum")
    yield RandomError(what, "dB", 1.0, path, published.times(seen.factor), full.times(seen.factor))


def displacement_rms(spectrum: Spectrum, power: float = 1.0) -> float:
    """Root mean square of the displacement, all frequencies together. [m]"""
    pieces = spectrum_pieces(spectrum, DISPLACED)
    return math.sqrt(power * math.fsum(piece.integral(piece.low, piece.high) for piece in pieces))


def pieces_of_vibration(mission: Mission, name: str) -> tuple[PowerLawPiece, ...]:
    """Spectrum of a platform's vibration as phase along the line of sight, one way. [rad²/Hz]"""
    vibration = getattr(mission.platforms, name).motion_error.vibration
    k = 2 * math.pi / mission.radar.wavelength * float(counted(mission, name, 1.0, "islr"))
    factor, slope = DISPLACED
    return spectrum_pieces(vibration.spectrum, (factor * k**2 * float(power_of(vibration)), slope))
