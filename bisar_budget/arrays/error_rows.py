"""One row for each error in many cases: the arrays beside `budget.error_rows`."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from bisar_budget.budget.judged_rows import BOUND, REQUIREMENTS, Judged, Judging
from bisar_budget.effects import models
from bisar_budget.effects.declared import DeclaredErrors, ManyErrors
from bisar_budget.effects.models import CUBIC, END_OF_IMAGE, LOCATION, QUADRATIC
from bisar_budget.ranges.exact_ranges import Floats


class ErrorRows:
    """Rows of the errors that are declared, and of those whose allowable is asked.

    Parameters
    ----------
    judging : Judging
        Of the cases.
    errors : DeclaredErrors
        Of the cases.
    limits : mapping of str to (cases,)
        Quadratic phase that each owner is held to, gain of autofocus included. [rad]
    gain : (cases,)
        Of autofocus.
    is_brief : bool
        Search in an order that finds the requirement that binds early, as a brief check does.
    """

    def __init__(
        self,
        judging: Judging,
        errors: DeclaredErrors,
        limits: Mapping[str, Floats],
        gain: Floats,
        *,
        is_brief: bool,
    ) -> None:
        self.judging, self.errors, self.limits, self.gain, self.is_brief = judging, errors, limits, gain, is_brief

    def rows(self, gating: str, other: str) -> Iterator[Judged]:
        """Rows of one model, which the other may doubt; ways by an error are let go of after its last row."""
        for error in self.errors.listed:
            yield self._row(gating, other, error)
            if gating == "full" or self.errors.mission.gating_model == "published":
                self.errors.forget(error)

    def _row(self, gating: str, other: str, error: ManyErrors) -> Judged:
        limit, array = self.limits[error.subject.owner], self.judging.array
        allowable, binding = self._allowed(gating, error)
        if other == "full" and not self.is_brief and self.errors.mission.gating_model != "published":
            self._allowed(other, error)  # a whole check asks for it here, and a later search starts from it
        if error.declared is None:
            return self.judging.row(error.subject, None, allowable)._replace(binding=binding)
        mine, theirs = self.errors.does(gating, error), self.errors.does(other, error)
        published = mine if gating == "published" else theirs
        sizes = {QUADRATIC: theirs.qpe, CUBIC: theirs.cubic, LOCATION: np.hypot(*theirs.farthest)}
        is_over = np.any([np.abs(sizes[name]) / held > BOUND for name, held in self._held(error)], axis=0)
        judged = self.judging.row(
            error.subject,
            np.abs(array(error.declared)),
            allowable,
            doubt=self.errors.doubts(other, is_over),
            without_autofocus=np.where(self.gain > 1, np.abs(mine.qpe) / (limit / self.gain), 0.0),
            is_info=self.errors.mission.allocation.combine != "each" or error.is_shown_again,
        )
        cubic = (
            np.where(np.isfinite(mine.cubic), np.abs(mine.cubic), math.nan) if error.is_motion else array(math.nan)
        )
        return judged._replace(
            binding=binding,
            qpe_published_rad=np.abs(published.qpe),
            cubic_rad=cubic,
            quadratic_use=np.abs(mine.qpe) / limit,
        )

    def _held(self, error: ManyErrors) -> list[tuple[str, Floats]]:
        """What an error is held to: requirements and their limits."""
        needs = self.errors.mission.requirements
        held = [(QUADRATIC, self.limits[error.subject.owner])]
        if error.is_motion:
            others = ((CUBIC, needs.cubic_phase_error), (LOCATION, needs.location_error))
            held += [(name, self.judging.array(required)) for name, required in others if required is not None]
        return held

    def _allowed(self, model: str, error: ManyErrors) -> tuple[Floats, NDArray[np.int8]]:
        """How large an error may be by a model, and the requirement that sets it: smallest size, NaN where none."""
        held, array = self._held(error), self.judging.array
        per_unit = [array(self.errors.per_unit(model, error, name)) for name, _ in held]
        with np.errstate(all="ignore"):
            smalls = [
                np.where(of_unit > 0, limit / of_unit, math.inf)
                for of_unit, (_, limit) in zip(per_unit, held, strict=True)
            ]
        order = np.argsort(smalls, axis=0, kind="stable")  # the one that binds is likely to be found first
        if not self.is_brief:
            order = np.broadcast_to(np.arange(len(held))[:, None], order.shape)
        smallest, binding = array(math.inf), np.full(self.judging.cases, -1, dtype=np.int8)
        for turn in range(len(held)):
            for place, (name, limit) in enumerate(held):
                mine = order[turn] == place
                if not mine.any():
                    continue
                is_whole = name == QUADRATIC and not self.is_brief
                upto = array(math.inf) if is_whole else smallest
                sized = self._sized(model, error, (name, limit), smalls[place], upto, mine)
                is_less = mine & (sized < smallest)
                smallest = np.where(is_less, sized, smallest)
                binding[is_less] = REQUIREMENTS.index(name)
        smallest[~np.isfinite(smallest)] = math.nan
        if model == "full":
            binding[self.errors.ends_image(error, smallest)] = REQUIREMENTS.index(END_OF_IMAGE)
        return smallest, binding

    def _sized(
        self,
        model: str,
        error: ManyErrors,
        held: tuple[str, Floats],
        small: Floats,
        upto: Floats,
        mine: NDArray[np.bool_],
    ) -> Floats:
        """Size at which an error reaches one requirement in the cases that are `mine`; infinite: none `upto`.

        `small` is that of an error whose effects are proportional to it, as `FullModel.allowable` has it.
        """
        if model == "published" or not error.is_motion or self.errors.is_heard_out(error):
            return small
        name, limit = held
        declared = 0.0 if error.declared is None else np.abs(error.declared)
        farthest = np.minimum(upto, np.maximum(self.errors.farthest(error), declared))
        first = np.minimum(small, farthest)
        with np.errstate(invalid="ignore"):
            is_sure = self.errors.adds(error, first, name) <= models.SHARE * limit
        sized = np.where(small > farthest, math.inf, small)
        some = np.flatnonzero(mine & ~is_sure & ~self.errors.is_left_out)
        if some.size:
            sized[some] = self.errors.first_reaching(error, name, limit, first, farthest, some)
        return sized
