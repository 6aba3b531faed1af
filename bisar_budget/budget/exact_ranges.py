"""What declared errors do by exact ranges: no expansion, and no array library, so that a check can ask for it.

The range history is sampled at the nodes of Gauss-Legendre quadrature, where its projection on Legendre polynomials
is a sum. The displaced point has the recorded constant and linear term at the aperture midpoint, as the full model
has it; quadratic and cubic phase are those of the cubic fitted to what remains, over the whole aperture.
`simulate/exact.py` does the same on arrays.
"""

import math
from collections.abc import Callable, Iterable
from functools import cache, cached_property, partial
from math import sqrt
from operator import mul
from typing import NamedTuple

from bisar_budget.budget.effects import ErrorSource
from bisar_budget.geometry import BistaticGeometry, GroundVector, Vector, norm

_NODES = 10  # more change nothing (below 1e-6) where platforms travel, in half an aperture, at most
_SHORT = 0.5  # of their slant range
_LONG_NODES = 16  # and beyond; more change about 1e-3 where they travel 1.25 of it
_ORDER = 6  # of the projection, of which value and slope at the midpoint are taken
_ITERATIONS = 60
_SETTLED_M = 1e-3  # of the last step, whose effect on the phases is counted to first order

Weights = tuple[float, ...]
Track = list[Vector]  # positions at the nodes
Slopes = tuple[tuple[float, ...], tuple[float, ...]]  # by east and by north, of each term of the history


class Quadrature(NamedTuple):
    """Nodes in -1 to 1, and the weights that give, of samples there, what the fit has."""

    nodes: Weights
    constant: Weights  # value at the midpoint
    linear: Weights  # slope there, over the half aperture
    quadratic: Weights  # at the edge, of the cubic fitted to the samples
    cubic: Weights


class ExactPhases(NamedTuple):
    """Displacement east, north [m]; quadratic and cubic phase at the aperture edge, signed like β̃. [rad]"""

    displacement: GroundVector
    quadratic: float
    cubic: float


class ExactRanges:
    """The exact paths of one collection, sampled over the aperture."""

    def __init__(self, geometry: BistaticGeometry, wavelength_m: float, aperture_time_s: float) -> None:
        self.wavelength, self.half = wavelength_m, aperture_time_s / 2
        states = {"transmitter": geometry.transmitter, "receiver": geometry.receiver}
        travelled = max(state.travelled(self.half) / state.slant_range for state in states.values())
        self.quadrature = _quadrature(_NODES if travelled <= _SHORT else _LONG_NODES)
        self.times = [node * self.half for node in self.quadrature.nodes]
        # Position error at each node of a unit of an error: 1, τ or τ²/2 of (22).
        self.powers = {
            "m": [1.0] * len(self.times),
            "m/s": self.times,
            "m/s^2": [tau**2 / 2 for tau in self.times],
        }
        self.tracks = {name: [state.at(tau)[0] for tau in self.times] for name, state in states.items()}
        self.recorded = [sum(map(norm, ends)) for ends in zip(*self.tracks.values(), strict=True)]

    def phases(
        self, errors: Iterable[tuple[ErrorSource, float]], near: GroundVector = (0.0, 0.0)
    ) -> ExactPhases | None:
        """Find where errors of given sizes move a point at the scene centre, and what defocuses there.

        The search starts `near`. None where it finds no ground point with the recorded history.
        """
        measured = dict(self.tracks)
        recorded = list(self.recorded)
        for source, size in errors:
            if source.is_position:
                x, y, z = (size * part for part in source.direction)
                powers = self.powers[source.unit]
                for name, track in measured.items():
                    if source.moves(name):
                        measured[name] = [
                            (a + p * x, b + p * y, c + p * z) for (a, b, c), p in zip(track, powers, strict=True)
                        ]
            else:  # a clock, or a phase as such: its polynomial is exact
                for index, (tau, node) in enumerate(zip(self.times, self.quadrature.nodes, strict=True)):
                    term = source.effect
                    edge = term.qpe * node**2 + term.cubic * node**3
                    metres = term.constant + term.linear * tau + self.wavelength / (2 * math.pi) * edge
                    recorded[index] += size * metres
        # Slopes turn little on the way to most points; where those of the centre lead nowhere, each place's own do.
        found = self._settled(recorded, measured, near, lambda place: self._centre_slopes)
        return found or self._settled(recorded, measured, near, partial(self._slopes, measured.values()))

    @cached_property
    def _centre_slopes(self) -> Slopes:
        return self._slopes(self.tracks.values(), (0.0, 0.0))

    def _slopes(self, tracks: Iterable[Track], place: GroundVector) -> Slopes:
        """What a step of a metre east, and north, does to each term of the history."""
        rays = [[(x - place[0], y - place[1], z) for x, y, z in track] for track in tracks]
        east, north = (  # the slope of a track's range is minus its direction
            [-sum(ray[axis] / norm(ray) for ray in pair) for pair in zip(*rays, strict=True)] for axis in (0, 1)
        )
        _, *terms = self.quadrature
        return tuple(_sum(term, east) for term in terms), tuple(_sum(term, north) for term in terms)

    def _settled(
        self,
        recorded: list[float],
        measured: dict[str, Track],
        near: GroundVector,
        slopes_at: Callable[[GroundVector], Slopes],
    ) -> ExactPhases | None:
        """Newton's method for the point."""
        _, at_midpoint, per_half, quadratic, cubic = self.quadrature
        east, north = near
        for _ in range(_ITERATIONS):
            (a, c, *by_east), (b, d, *by_north) = slopes_at((east, north))
            determinant = a * d - b * c
            if not determinant:
                return None
            left = []
            for whole, (x, y, z), (u, v, w) in zip(recorded, *measured.values(), strict=True):
                x, y, u, v = x - east, y - north, u - east, v - north
                left.append(whole - sqrt(x * x + y * y + z * z) - sqrt(u * u + v * v + w * w))
            constant, linear = _sum(at_midpoint, left), _sum(per_half, left)
            step_east, step_north = (
                (d * constant - b * linear) / determinant,
                (a * linear - c * constant) / determinant,
            )
            east, north = east + step_east, north + step_north
            if abs(step_east) + abs(step_north) < _SETTLED_M:
                scale = 2 * math.pi / self.wavelength
                phases = [
                    scale * (_sum(term, left) - by_e * step_east - by_n * step_north)
                    for term, by_e, by_n in zip((quadratic, cubic), by_east, by_north, strict=True)
                ]
                return ExactPhases((east, north), *phases)
            if not math.isfinite(east + north):
                return None
        return None


def _sum(weights: Weights, samples: list[float]) -> float:
    total: float = sum(map(mul, weights, samples))
    return total


@cache
def _quadrature(count: int) -> Quadrature:
    nodes: list[float] = []
    weights: list[float] = []
    for k in range(count):
        x = math.cos(math.pi * (k + 0.75) / (count + 0.5))  # close enough for Newton's method
        for _ in range(8):
            before, at = 1.0, x
            for n in range(2, count + 1):
                before, at = at, ((2 * n - 1) * x * at - (n - 1) * before) / n
            slope = count * (x * at - before) / (x * x - 1)
            x -= at / slope
        nodes.append(x)
        weights.append(2 / ((1 - x * x) * slope * slope))
    legendre: list[Weights] = []  # the weights that project on each polynomial
    last, this = [0.0] * count, [1.0] * count
    for n in range(_ORDER + 1):
        legendre.append(tuple((2 * n + 1) / 2 * w * p for w, p in zip(weights, this, strict=True)))
        recurred = [((2 * n + 1) * x * p - n * q) / (n + 1) for x, p, q in zip(nodes, this, last, strict=True)]
        last, this = this, recurred

    def combined(*factors: float) -> Weights:
        return tuple(sum(f * w for f, w in zip(factors, row, strict=True)) for row in zip(*legendre, strict=True))

    return Quadrature(
        tuple(nodes),
        combined(1, 0, -1 / 2, 0, 3 / 8, 0, -5 / 16),  # Pₙ(0)
        combined(0, 1, 0, -3 / 2, 0, 15 / 8, 0),  # P′ₙ(0)
        combined(0, 0, 3 / 2, 0, 0, 0, 0),  # P₂ = (3x² - 1)/2
        combined(0, 0, 0, 5 / 2, 0, 0, 0),  # P₃ = (5x³ - 3x)/2
    )
