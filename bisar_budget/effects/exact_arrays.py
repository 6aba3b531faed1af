"""Effects of errors by exact ranges, of paths sampled anywhere: for draws, and for the simulator.

The definition is that of `ranges.exact_ranges`; what is found together here has no case and no lane.

The response of a point lies where what remains of its range history has no constant and no linear part over the
aperture, P₀ and P₁ of Legendre's polynomials. What remains then defocuses: 3/2 of the P₂ part is the quadratic phase
at its edge, 5/2 of the P₃ part the cubic one.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NODES = 24  # of Gauss-Legendre quadrature; more change nothing where platforms travel less than their slant range
_ITERATIONS = 50
_WORKED_ON = 7  # arrays of all samples
TOGETHER = 1 << 14  # positions of a platform: what is made of them stays in a cache
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
    weights = projection(transmitter.shape[-2])
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
    count = weights.shape[1]
    lead = np.broadcast_shapes(*(one.shape[:-2] for one in measured), clock_range.shape[:-1])
    total = math.prod(lead)
    whole = [np.broadcast_to(one, (*lead, count, 3)).reshape(total, count, 3) for one in measured]
    clock = np.broadcast_to(clock_range, (*lead, count)).reshape(total, count)
    starts = None if near is None else np.broadcast_to(near, (*lead, 2)).reshape(total, 2)
    found = ExactEffects(np.empty((total, 2)), np.empty(total), np.empty(total), np.empty(total, dtype=bool))
    size = max(1, TOGETHER // count)
    for start in range(0, total, size):
        some = slice(start, start + size)
        columns = [np.ascontiguousarray(np.moveaxis(one[some], 0, -1).swapaxes(0, 1)) for one in whole]
        ahead = None if starts is None else np.ascontiguousarray(starts[some].T)
        part = column_effects(
            (columns[0], columns[1]), actual, np.ascontiguousarray(clock[some].T), weights, wavelength_m, ahead
        )
        for one, value in zip(found, part, strict=True):
            one[some] = value
    return ExactEffects(
        found.displacement.reshape((*lead, 2)),
        found.quadratic.reshape(lead),
        found.cubic.reshape(lead),
        found.found.reshape(lead),
    )


def column_effects(
    measured: tuple[Floats, Floats],
    actual: tuple[Floats, Floats],
    clock_range: Floats,
    weights: Floats,
    wavelength_m: float,
    near: Floats | None = None,
    room: Floats | None = None,
) -> ExactEffects:
    """As `located`, of n errors laid out for speed: a processor takes the same sample of several of them at once.

    `measured` are (3, samples, n), `clock_range` (samples, n) and `near` (2, n); of `measured` n may be 1.
    All stay in a processor's cache if samples times n are some ten thousand. `room` is `room_for` so many, for who
    asks again and again: the system takes longer to give it than it takes to fill it.
    """
    if room is None:
        room = room_for(clock_range.size)
    history = np.linalg.norm(actual[0], axis=-1) + np.linalg.norm(actual[1], axis=-1)
    recorded = history[:, None] + clock_range
    found = _displaced(measured, recorded, weights, wavelength_m, near, room)
    missed = ~found.found
    if not missed.any():
        return found
    clock, still = recorded[:, missed] - history[:, None], [one.T[:, :, None] for one in actual]
    tracks = [np.broadcast_to(one, (3, *recorded.shape))[..., missed] for one in measured]
    before = np.zeros((2, clock.shape[-1]))
    for step in range(1, _FOLLOWED + 1):
        part = step / _FOLLOWED
        there = [own + part * (one - own) for one, own in zip(tracks, still, strict=True)]
        ahead = before * (step / (step - 1) if step > 1 else 1.0)
        recorded = history[:, None] + part * clock
        followed = _displaced((there[0], there[1]), recorded, weights, wavelength_m, ahead, room)
        before = followed.displacement.T  # NaN from the first step on that finds nothing
    for whole, later in zip(found, followed, strict=True):
        whole[missed] = later
    return found


def room_for(count: int) -> Floats:
    """Room to work on so many samples."""
    return np.empty((_WORKED_ON, count))


def _displaced(
    tracks: tuple[Floats, Floats],
    recorded: Floats,
    weights: Floats,
    wavelength_m: float,
    near: Floats | None,
    room: Floats,
) -> ExactEffects:
    """Newton's method for P₀ = P₁ = 0, a step halved where it leads away.

    Tracks are (3, samples, n), the history (samples, n). How far away is measured by the step that would come next:
    that does not depend on the units of P₀ and P₁.
    """
    total = recorded.shape[-1]
    point, is_settled = np.zeros((2, total)), np.zeros(total, dtype=bool)
    alive: slice | NDArray[np.intp] = slice(None)  # views, as long as none is settled
    with np.errstate(all="ignore"):
        parts, step, turn = _parts_and_step(tracks, recorded, weights, point, room)
        orientation = np.sign(turn)
        if near is not None:
            point[:] = near
            parts, step, turn = _parts_and_step(tracks, recorded, weights, point, room)
        here, history, length = tracks, recorded, _lengths(step)
        for _ in range(_ITERATIONS):
            settled = length < _SETTLED_M + 1e-12 * _lengths(point[:, alive])
            goes_on = ~settled & np.isfinite(length)
            if not goes_on.all():
                among = np.arange(total)[alive]
                is_settled[among[settled]] = True
                alive, length = among[goes_on], length[goes_on]
                if not alive.size:
                    break
                here = tuple(one if one.shape[-1] == 1 else one[..., alive] for one in tracks)  # type: ignore[assignment]
                history = recorded[:, alive]
            scale = np.ones_like(length)
            for _ in range(_HALVINGS):
                ahead = point[:, alive] + scale * step[:, alive]
                new_parts, new_step, new_turn = _parts_and_step(here, history, weights, ahead, room)
                new_length = _lengths(new_step)
                farther = ~(new_length < length)
                if not farther.any():
                    break
                scale[farther] /= 2
            point[:, alive], parts[:, alive], step[:, alive], turn[alive] = ahead, new_parts, new_step, new_turn
            length = new_length
    # Beyond a line on which range and Doppler gradients are parallel no error leads from nothing.
    is_settled &= turn * orientation > 0
    k = 2 * math.pi / wavelength_m
    parts[:, ~is_settled] = np.nan
    point[:, ~is_settled] = np.nan
    return ExactEffects(
        point.T,
        1.5 * k * parts[2],  # P₂ = (3t² - 1)/2
        2.5 * k * parts[3],  # P₃ = (5t³ - 3t)/2
        is_settled,
    )


def _lengths(vectors: Floats) -> Floats:
    """Of vectors (2, n), (n,)."""
    lengths: Floats = np.sqrt(vectors[0] ** 2 + vectors[1] ** 2)
    return lengths


def _parts_and_step(
    tracks: tuple[Floats, Floats], history: Floats, weights: Floats, point: Floats, room: Floats
) -> tuple[Floats, Floats, Floats]:
    """Legendre parts of what remains at points (2, n), Newton's step there, and the turn of the gradients.

    (4, n) [m], (2, n) [m], (n,) [-]. What is worked on goes into `room`.
    """
    left, east, north, x, y, distance, square = room[:, : history.size].reshape(_WORKED_ON, *history.shape)
    left[:], east[:], north[:] = history, 0.0, 0.0
    for track in tracks:
        np.subtract(track[0], point[0], out=x)
        np.subtract(track[1], point[1], out=y)
        np.multiply(x, x, out=distance)
        np.multiply(y, y, out=square)
        distance += square
        np.multiply(track[2], track[2], out=square)
        distance += square
        np.sqrt(distance, out=distance)
        left -= distance
        x /= distance
        y /= distance
        east -= x
        north -= y
    parts = weights @ left
    (a, c), (b, d) = weights[:2] @ east, weights[:2] @ north
    determinant: Floats = a * d - b * c
    first, second = parts[0], parts[1]
    step = np.stack((d * first - b * second, a * second - c * first)) / determinant
    return parts, step, determinant


def projection(count: int) -> Floats:
    """Weights (4, count) that project samples at `aperture_nodes` on P₀ … P₃."""
    return _quadrature(count)[1]


@cache
def _quadrature(count: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes in -1 … 1, and the weights (4, count) that project on P₀ … P₃."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    legendre = np.polynomial.legendre.legvander(nodes, 3)
    return nodes, np.ascontiguousarray((legendre * weights[:, None] * (np.arange(4) + 0.5)).T)
