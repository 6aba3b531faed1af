"""The second order of the range error: what an error does beyond the first, growing with its square.

Of two platforms at R_k it is −Σ|P⊥(r̃_k − x̂)|²/2R_k, P⊥ = I − uuᵀ being the part across the line of sight, r̃_k the
platform's error and x̂ the displacement of the image. It is taken at start, middle and end of the aperture, where
P⊥/2R is a form of six numbers for each platform. Whatever is wanted of the three (a constant, a slope, a quadratic
phase, a displacement) is a weighted sum of them, and so a form itself. Derived here.
"""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from operator import add, sub

from bisar_budget.budget.effects import Effect, ErrorSource, FullGround
from bisar_budget.geometry import BistaticGeometry, Vector, norm

Form = Sequence[float]  # xx, xy, xz, yy, yz, zz
Weights = tuple[float, float, float]  # of start, middle and end


class SecondOrder:
    """The second order of one mission's errors.

    `edge` is a unit of an error at the aperture edge [m], by its unit.
    """

    def __init__(
        self, geometry: BistaticGeometry, ground: FullGround, wavelength_m: float, aperture_time_s: float
    ) -> None:
        self.geometry, self.ground, self.inverse = geometry, ground, ground.plane.inverse
        self.wavelength, self.T = wavelength_m, aperture_time_s
        self.edge = {"m": 1.0, "m/s": self.T / 2, "m/s^2": self.T**2 / 8}
        self._phases: dict[str, float] = {}

    def phase(self, source: ErrorSource) -> float:
        """Quadratic phase that it adds, that of what it moves the image by included. [rad/unit²]"""
        phase = self._phases.get(source.id)
        if phase is None:
            phase = self._phases[source.id] = self._quadratic.of(source)
        return phase

    def drift(self, source: ErrorSource) -> float:
        """How far it moves the image. [m/unit²]"""
        return math.hypot(*(along.of(source) for along in self._displacement))

    def effect(self, source: ErrorSource, size: float) -> Effect:
        """What it adds to an error of a size: displacement and quadratic phase."""
        k = 2 * math.pi / self.wavelength
        of_terms = ((0.0, 1.0, 0.0), (-1 / self.T, 0.0, 1 / self.T), (k / 2, -k, k / 2))
        constant, linear, quadratic = (self._sum(weights).of(source) * size * size for weights in of_terms)
        return self.ground.effective([(constant, linear, quadratic, 0.0)])[0]

    @cached_property
    def _quadratic(self) -> "_WeightedSum":
        k = math.pi / self.wavelength
        by_constant, by_linear = self.ground.quadratic
        by_slope = by_linear / self.T
        return self._sum((k - by_slope, by_constant - 2 * k, k + by_slope))

    @cached_property
    def _displacement(self) -> list["_WeightedSum"]:
        """East and north."""
        return [self._sum((-b / self.T, a, b / self.T)) for a, b in self.inverse]

    def _sum(self, weights: Weights) -> "_WeightedSum":
        return _WeightedSum(self._across, weights, self.edge, self.inverse)

    @cached_property
    def _across(self) -> dict[str, list[Form]]:
        """P⊥/2R at start, middle and end, of each platform and, for what moves both, their sum."""
        states = {"transmitter": self.geometry.transmitter, "receiver": self.geometry.receiver}
        times = (-self.T / 2, 0.0, self.T / 2)
        forms: dict[str, list[Form]] = {
            name: [_across(state.at(tau)[0]) for tau in times] for name, state in states.items()
        }
        forms["mission"] = [list(map(add, *pair)) for pair in zip(*forms.values(), strict=True)]
        return forms


class _WeightedSum:
    """A weighted sum of the second order at start, middle and end.

    With an error of power p along d, wᵀ(P⊥/2R)w of w = p·d − x̂ is multiplied out: a form of x̂, one of d and x̂, one of
    d. p is 1, τ or τ²/2, so that the last two have the edges with equal or opposite signs, or no middle.
    """

    def __init__(
        self,
        across: Mapping[str, Sequence[Form]],
        weights: Weights,
        edge: Mapping[str, float],
        inverse: Sequence[Sequence[float]],
    ) -> None:
        start, middle, end = weights
        self._inverse = inverse
        self._forms: dict[tuple[str, str], tuple[float, Form, Form]] = {}
        for owner, (first, second, third) in across.items():
            before, after = [start * x for x in first], [end * x for x in third]
            ends, slope = list(map(add, before, after)), list(map(sub, after, before))
            whole = [x + middle * y for x, y in zip(ends, second, strict=True)]
            self._forms[owner, "m"] = (edge["m"], whole, whole)
            self._forms[owner, "m/s"] = (edge["m/s"], ends, slope)
            self._forms[owner, "m/s^2"] = (edge["m/s^2"], ends, ends)
        self._of_displacement = whole  # of both platforms, which come last

    def of(self, source: ErrorSource) -> float:
        """Of a unit of an error."""
        constant, linear, _, _ = source.full
        (a, b), (c, d) = self._inverse
        east, north = a * constant + b * linear, c * constant + d * linear
        xx, xy, _, yy, _, _ = self._of_displacement
        total: float = east * (xx * east + 2 * xy * north) + yy * north * north
        forms = self._forms.get((source.owner, source.unit))
        if forms is not None:
            x, y, z = source.direction
            edge, squared, (xx, xy, xz, yy, yz, _) = forms
            mixed = east * (xx * x + xy * y + xz * z) + north * (xy * x + yy * y + yz * z)
            xx, xy, xz, yy, yz, zz = squared
            own = x * (xx * x + 2 * (xy * y + xz * z)) + y * (yy * y + 2 * yz * z) + zz * z * z
            total += edge * (edge * own - 2 * mixed)
        return -total


def _across(position: Vector) -> Form:
    x, y, z = position
    R = norm(position)
    u, v, w, h = x / R, y / R, z / R, 0.5 / R
    return (h - h * u * u, -h * u * v, -h * u * w, h - h * v * v, -h * v * w, h - h * w * w)
