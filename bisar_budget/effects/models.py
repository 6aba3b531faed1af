"""The two models of one collection, for whoever asks for a single error: plain numbers, None where there is none."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.effects.declared import (
    END_OF_IMAGE,
    HELD,
    SHARE,
    Declared,
    DeclaredErrors,
    point,
)
from bisar_budget.effects.effect import ErrorSource, plain
from bisar_budget.geometry import GroundVector
from bisar_budget.phrases import Note
from bisar_budget.ranges.exact_ranges import Effect


class ExactPhases(NamedTuple):
    """Displacement east, north [m]; quadratic and cubic phase at the aperture edge, signed like β̃. [rad]

    `turn` is what range and Doppler gradients span there, over what they span at the centre.
    """

    displacement: GroundVector
    quadratic: float
    cubic: float
    turn: float


class Model:
    """One of both models, of the errors of one case."""

    def __init__(self, errors: DeclaredErrors, name: str) -> None:
        self.errors, self.exact, self.name = errors, errors.exact, name
        self.is_published = name == "published"
        self.is_blind = self.is_published and errors.has_direct_path  # to what the collection has
        self.plane, self.degeneracy = errors.planes[name], errors.degeneracy(name)

    def effect(self, source: ErrorSource) -> Effect:
        """Effect of a unit of an error; by the full model of one too small for a second order."""
        return source.effect if self.is_published else source.full

    def displacement(self, effect: Effect, size: float) -> GroundVector | None:
        """Displacement on the ground by (25) with the Q of the model; None where that has no inverse. [m]"""
        return point(self.plane.displacement(effect, size))

    def equation(self, source: ErrorSource) -> str:
        """Where it comes from."""
        return source.equation if self.is_published or not source.is_motion else "full model"

    def no_limit(self, source: ErrorSource) -> Note:
        """Say why an error has no limit from its quadratic phase."""
        if self.is_published:
            return source.no_limit
        if self.errors.is_heard_out(source):
            return phrases.clock_is_heard()
        return phrases.no_size_reaches_the_limit() if source.is_motion else phrases.no_quadratic_phase()

    def does(self, source: ErrorSource, size: float) -> Declared:
        """Effect of an error of a given size."""
        block, place = self.errors.block_of(source)
        sizes = np.full(block.declared.shape, math.nan)
        sizes[place] = size
        return block.does(self.name, sizes).of(place).in_one_case()

    def allowed(self, source: ErrorSource, limits: Sequence[float | None]) -> tuple[float | None, str | None]:
        """Smallest size, of either sign, at which an error reaches a limit, and which of `HELD` that is; or None.

        `limits` are those of quadratic and cubic phase [rad], and of the displacement. [m]
        """
        block, place = self.errors.block_of(source)
        held: list[Any] = []
        for limit in limits:
            of_all = np.full(block.declared.shape, math.nan)
            of_all[place] = math.nan if limit is None else limit
            held.append(None if limit is None else of_all)
        found = block.allowed(self.name, held, is_whole=False)
        size, binding = plain(found.smallest[place]), int(found.binding[place, 0])
        return (None, None) if math.isnan(size) else (size, (*HELD, END_OF_IMAGE)[binding])

    def allowable(self, source: ErrorSource, requirement: str, limit: float) -> float | None:
        """Smallest size, of either sign, at which an error reaches one limit; or None."""
        return self.allowed(source, [limit if name == requirement else None for name in HELD])[0]

    def small(self, source: ErrorSource, requirement: str, limit: float) -> float:
        """Size at which an error would reach a limit, were its effects those of a small one; infinite: never."""
        block, place = self.errors.block_of(source)
        per_unit = float(block.per_unit(self.name)[HELD.index(requirement), place, 0])
        return limit / per_unit if per_unit else math.inf

    def farthest(self, source: ErrorSource) -> float:
        """Size beyond which an error is none of navigation; infinite: it has no effect whatever its size. [unit]"""
        block, place = self.errors.block_of(source)
        return float(block.farthest[place, 0])

    def ends_image(self, source: ErrorSource, size: float) -> bool:
        """Whether an allowable, as found, is where the image ends; to a linear model none does."""
        block, place = self.errors.block_of(source)
        return not self.is_published and bool(block.ends_image(np.full(block.declared.shape, size))[place, 0])

    def is_linear_at(self, source: ErrorSource, requirement: str, limit: float) -> bool:
        """Whether effects of an error are proportional to its size up to a limit."""
        block, place = self.errors.block_of(source)
        which = HELD.index(requirement)
        per_unit = block.per_unit(self.name)[which]
        with np.errstate(all="ignore"):
            first = np.minimum(np.where(per_unit > 0, limit / per_unit, math.inf), block.farthest)
            adds = self.errors.per_metre[which] * block.grows(first)
        return self.is_published or not self.errors.displaces(source) or bool(adds[place, 0] <= SHARE * limit)

    # ---------------------------------------------------------------- by exact ranges
    def is_small(self, source: ErrorSource, size: float) -> bool:
        """Whether effects of an error are proportional to its size, as far as anybody can see."""
        block, place = self.errors.block_of(source)
        return not block.is_large(np.full(block.declared.shape, size))[place, 0]

    def at(self, source: ErrorSource, size: float) -> ExactPhases | None:
        """Phases and displacement of an error of a size, with its sign, by exact ranges; None: no ground point."""
        block, place = self.errors.block_of(source)
        some = np.zeros(block.declared.shape, dtype=bool)
        some[place] = True
        known = block.followed(some, np.array([abs(size)]))[0 if size > 0 else 1]
        _, east, north, quadratic, cubic, turn = known[:, 0].tolist()
        return None if math.isnan(east) else ExactPhases((east, north), quadratic, cubic, turn)

    def largest_range_error(self, source: ErrorSource) -> float:
        """Largest range error at the nodes of a small unit of an error, before it displaces anything. [m/unit]"""
        return float(np.abs(self.exact.range_error(self.errors.lanes(source))).max())

    def left_over(self, source: ErrorSource, size: float, place: GroundVector) -> Sequence[float]:
        """Range error at the nodes that an error leaves at a ground point. [m]"""
        left = self.exact.left_over(self.errors.lanes(source), np.array([size]), place)
        found: list[float] = left[:, 0].tolist()
        return found

    def left_over_small(self, source: ErrorSource, size: float) -> Sequence[float]:
        """The same at the displaced point, of an error so small that its effects are proportional to it. [m]"""
        east, north = self.displacement(source.full, size) or (0.0, 0.0)
        by_east, by_north = self.exact.slopes
        left = size * self.exact.range_error(self.errors.lanes(source)) + east * by_east + north * by_north
        found: list[float] = left[:, 0].tolist()
        return found
