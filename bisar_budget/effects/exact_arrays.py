"""What errors do by exact ranges, many at once: the arrays beside `exact_ranges.py`, with the same definition.

The response of a point lies where what remains of its range history has no constant and no linear part over the
aperture, P₀ and P₁ of Legendre's polynomials. What remains then defocuses: 3/2 of the P₂ part is the quadratic phase
at its edge, 5/2 of the P₃ part the cubic one. It loads NumPy: a check without Monte Carlo does not come here.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NODES = 24  # of Gauss-Legendre quadrature; more change nothing where platforms travel less than their slant range
_ITERATIONS = 50
_FOLLOWED = 8  # steps from no error on
_HALVINGS = 6  # of a step that leads farther away
_SETTLED_M = 1e-6  # a satellite's range in double precision gives no more


class ExactEffects(NamedTuple):
    """Effects of many errors: displacement (..., 2) [m], phases (...) [rad], and whether a point was found (...)."""

    displacement: Floats
    quadratic: Floats
    cubic: Floats
    found: NDArray[np.bool_]


def aperture_nodes(aperture_time_s: float, count: int = NODES) -> Floats:
    """Slow times at which `exact_effects` takes positions, (count,). [s]"""
    nodes: Floats = _quadrature(count)[0] * (aperture_time_s / 2)
    return nodes


def direct_path_clock(
    transmitter: Floats, receiver: Floats, actual_transmitter: Floats, actual_receiver: Floats
) -> Floats:
    """What a receiver that hears the transmitter has for a clock error: measured less actual distance of both. [m]

    Positions (..., 3) as in `exact_effects`, (...).
    """
    grown: Floats = np.linalg.norm(transmitter - receiver, axis=-1) - np.linalg.norm(
        actual_transmitter - actual_receiver, axis=-1
    )
    return grown


def exact_effects(
    transmitter: Floats,
    receiver: Floats,
    actual_transmitter: Floats,
    actual_receiver: Floats,
    clock_range: Floats | float,
    wavelength_m: float,
    near: Floats | None = None,
) -> ExactEffects:
    """Find where the responses of a scatterer at the scene centre go, and what phases are left there.

    Parameters
    ----------
    transmitter, receiver : (..., nodes, 3) ndarray
        Measured positions at `aperture_nodes`; leading axes are errors and broadcast. [m]
    actual_transmitter, actual_receiver : (nodes, 3) ndarray
        Actual positions there. [m]
    clock_range : (..., nodes) ndarray or float
        Clock error times the speed of light; of a direct path `direct_path_clock`. [m]
    wavelength_m : float
        Of the centre frequency.
    near : (..., 2) ndarray, optional
        Where the search starts; the scene centre. [m]

    Returns
    -------
    ExactEffects
        NaN where no ground point has the recorded history, or only one beyond a line on which range and Doppler
        gradients are parallel.
    """
    weights = _quadrature(transmitter.shape[-2])[1]
    actual = (actual_transmitter, actual_receiver)
    return located((transmitter, receiver), actual, np.asarray(clock_range, dtype=float), weights, wavelength_m, near)


def located(
    measured: tuple[Floats, Floats],
    actual: tuple[Floats, Floats],
    clock_range: Floats,
    weights: Floats,
    wavelength_m: float,
    near: Floats | None = None,
) -> ExactEffects:
    """Displaced points; those that are not found at once are followed from no error on.

    As `exact_effects`, with tracks of both platforms sampled anywhere, and the weights (4, samples) that project such
    samples on P₀ … P₃.
    """
    history = np.linalg.norm(actual[0], axis=-1) + np.linalg.norm(actual[1], axis=-1)
    found = _displaced(*measured, history + clock_range, weights, wavelength_m, near)
    missed = ~found.found
    if not missed.any():
        return found
    lead = missed.shape
    tracks = [np.broadcast_to(one, (*lead, *one.shape[-2:]))[missed] for one in measured]
    clock = np.broadcast_to(clock_range, (*lead, weights.shape[1]))[missed]
    before = np.zeros((tracks[0].shape[0], 2))
    for step in range(1, _FOLLOWED + 1):
        part = step / _FOLLOWED
        there = [own + part * (one - own) for one, own in zip(tracks, actual, strict=True)]
        ahead = before * (step / (step - 1) if step > 1 else 1.0)
        followed = _displaced(there[0], there[1], history + part * clock, weights, wavelength_m, ahead)
        before = followed.displacement  # NaN from the first step on that finds nothing
    for whole, later in zip(found, followed, strict=True):
        whole[missed] = later
    return found


def _displaced(
    transmitter: Floats,
    receiver: Floats,
    recorded: Floats,
    weights: Floats,
    wavelength_m: float,
    near: Floats | None,
) -> ExactEffects:
    """Newton's method for P₀ = P₁ = 0, a step halved where it leads away.

    How far away is measured by the step that would come next: that does not depend on the units of P₀ and P₁.
    """
    lead = np.broadcast_shapes(transmitter.shape[:-2], receiver.shape[:-2], recorded.shape[:-1])
    count, total = weights.shape[1], math.prod(lead)
    tracks = [np.broadcast_to(one, (*lead, count, 3)).reshape(total, count, 3) for one in (transmitter, receiver)]
    history = np.broadcast_to(recorded, (*lead, count)).reshape(total, count)
    point = np.zeros((total, 2))
    if near is not None:
        point[:] = np.broadcast_to(near, (*lead, 2)).reshape(total, 2)
    parts, step, is_settled = np.full((total, 4), np.nan), np.zeros((total, 2)), np.zeros(total, dtype=bool)
    alive = np.arange(total)
    with np.errstate(all="ignore"):
        parts[:], step[:], turn = _parts_and_step(tracks, history, weights, point)
        orientation = np.sign(_parts_and_step(tracks, history, weights, np.zeros_like(point))[2])
        for _ in range(_ITERATIONS):
            length = np.hypot(*step[alive].T)
            settled = length < _SETTLED_M + 1e-12 * np.hypot(*point[alive].T)
            is_settled[alive[settled]] = True
            alive = alive[~settled & np.isfinite(length)]
            if not alive.size:
                break
            here = [one[alive] for one in tracks]
            length, scale = np.hypot(*step[alive].T), np.ones(alive.size)
            for _ in range(_HALVINGS):
                ahead = point[alive] + scale[:, None] * step[alive]
                new_parts, new_step, new_turn = _parts_and_step(here, history[alive], weights, ahead)
                farther = ~(np.hypot(*new_step.T) < length)
                if not farther.any():
                    break
                scale[farther] /= 2
            point[alive], parts[alive], step[alive], turn[alive] = ahead, new_parts, new_step, new_turn
    # Beyond a line on which range and Doppler gradients are parallel no error leads from nothing.
    is_settled &= turn * orientation > 0
    k = 2 * math.pi / wavelength_m
    parts[~is_settled] = np.nan
    point[~is_settled] = np.nan
    return ExactEffects(
        point.reshape((*lead, 2)),
        np.asarray(1.5 * k * parts[:, 2]).reshape(lead),  # P₂ = (3t² - 1)/2
        np.asarray(2.5 * k * parts[:, 3]).reshape(lead),  # P₃ = (5t³ - 3t)/2
        is_settled.reshape(lead),
    )


def _parts_and_step(
    tracks: list[Floats], history: Floats, weights: Floats, point: Floats
) -> tuple[Floats, Floats, Floats]:
    """Legendre parts of what remains at points (n, 2), Newton's step there, and the turn of the gradients.

    (n, 4) [m], (n, 2) [m], (n,) [-].
    """
    left: Floats = history
    slopes: Floats = np.zeros((*history.shape, 2))
    for track in tracks:
        ground = track[..., :2] - point[:, None, :]
        distance = np.sqrt(np.sum(ground**2, axis=-1) + track[..., 2] ** 2)
        left = left - distance
        slopes = slopes - ground / distance[..., None]
    parts = left @ weights.T
    (a, b), (c, d) = (np.moveaxis(weights[n] @ slopes, -1, 0) for n in (0, 1))
    determinant: Floats = a * d - b * c
    first, second = parts[:, 0], parts[:, 1]
    step = np.stack((d * first - b * second, a * second - c * first), axis=-1) / determinant[:, None]
    return parts, step, determinant


@cache
def _quadrature(count: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes in -1 … 1, and the weights (4, count) that project on P₀ … P₃."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    legendre = np.polynomial.legendre.legvander(nodes, 3)
    return nodes, np.ascontiguousarray((legendre * weights[:, None] * (np.arange(4) + 0.5)).T)
