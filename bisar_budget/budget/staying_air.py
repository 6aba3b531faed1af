"""Doubts about atmospheric delays that are assumed to be constant over a long aperture.

During an aperture of one minute or longer, the atmosphere changes. A delay without `correlation_time` is nevertheless
treated as constant: it displaces the image, and its phase changes only with the elevation. This is only part of the
true effect. The effects are therefore computed a second time, for delays that change with a correlation time of ten
minutes. A requirement is not evaluated if the changing delays would use more than a tenth of it, or would exceed it
together with the declared errors. If the changing delays would cause an effect that no requirement covers and that is
not negligible, the rows of these delays are not evaluated.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.spread import islr_db, mainlobe_energy, spread_limit
from bisar_budget.arrays import Booleans, Floats, PerCase
from bisar_budget.budget.aggregates import untaken_effects
from bisar_budget.budget.judged_requirements import EXAMPLES, NEGLIGIBLE_FRACTION, TAKEN_BY, UntakenEffect
from bisar_budget.budget.judged_rows import LIMIT_RATIO, Judged
from bisar_budget.budget.random_rows import ISLR, RANDOM_REQUIREMENTS, judged_effect_of
from bisar_budget.effects.air_delays import changing_air
from bisar_budget.effects.combined import combined
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import Note

LONG_APERTURE_S = 60.0  # shortest aperture time for which the atmosphere changes noticeably
AIR_CHANGES_IN_S = 600.0  # correlation time of the zenith delay that remains after correction by a model or a map


class AirUse(NamedTuple):
    """Effect that changing atmospheric delays would have on one row, for an array of cases.

    `size` is the effect: a phase or rms phase [rad], or a displacement of the image [m]. `use` is the utilization,
    which is the effect divided by the limit of the row. `is_doubted` marks the cases in which the verdict must not
    rely on the assumption of constant delays.
    """

    row_id: str
    key: str  # key of the requirement that limits the row
    size: Floats
    use: Floats
    is_doubted: Booleans
    model: str


@dataclass(frozen=True, eq=False)
class StayingAir:
    """Effects of atmospheric delays that may change during a long aperture but are assumed to be constant.

    `uses` maps row ids to the effect that changing delays would have on the row. `untaken` lists the effects that no
    requirement covers, computed with changing delays. Both are empty if no case has such a delay.
    """

    errors: Sequence[RandomError] = ()
    is_long: Booleans = field(default_factory=lambda: np.zeros(1, dtype=bool))
    uses: Mapping[str, AirUse] = field(default_factory=dict)
    untaken: Sequence[UntakenEffect] = ()

    @property
    def _delays(self) -> frozenset[str]:
        """Ids of the rows that each judge a single delay.

        Under `combine: each`, the requirement on the quadratic phase limits these rows directly. A doubt about such
        a row is recorded for this requirement and not for the row. The reason is that another requirement may set the
        allowable of the row, so that its status is not the status of the requirement on the quadratic phase.
        """
        return frozenset(error.id for error in self.errors)

    def doubted_rows(self) -> dict[str, Booleans]:
        """Return, for each row of a sum, a mask of the cases in which the row cannot be evaluated, (cases,).

        A row of a sum judges several errors together. It cannot be evaluated if its verdict depends on the assumption
        of constant delays. The masks are keyed by row id.
        """
        return {row_id: use.is_doubted for row_id, use in self.uses.items() if row_id not in self._delays}

    def doubted_requirements(self) -> dict[str, Booleans]:
        """Return, for each requirement, a mask of the cases in which the requirement cannot be evaluated, (cases,).

        A requirement cannot be evaluated if its verdict depends on the assumption of constant delays. The masks are
        keyed by requirement. A doubt about a platform's share affects only the row of this share, not the
        requirement.
        """
        doubted: dict[str, Booleans] = {}
        for use in self.uses.values():
            if use.row_id in self._delays or use.row_id == subject("mission", use.key).id:
                doubted[use.key] = doubted.get(use.key, np.False_) | use.is_doubted
        return doubted

    def untaken_rows(self) -> dict[str, Booleans]:
        """Return, for each delay, a mask of the cases in which it would cause an effect that no requirement covers.

        The masks, (cases,), are keyed by the id of the delay's row. Negligible effects do not count.
        """
        return {
            error.id: np.any([effect.makers.get(error.id, False) & self.is_long for effect in self.untaken], axis=0)
            for error in self.errors
            if self.untaken
        }

    def reason(self, case: Case, row_id: str) -> Note:
        """Describe the effect that changing delays would have on a row in one case.

        The note also names the key to add to the file, which specifies how the delays change over time.
        """
        use = self.uses.get(row_id)
        if use is not None:
            return self._says(case, use)
        return self._says_of_untaken(case, row_id)

    def reason_of_requirement(self, case: Case, key: str) -> Note:
        """Describe the effect that changing delays would have on a requirement.

        The note is empty if the verdict on the requirement does not depend on whether the delays change.
        """
        doubted = [use for use in self.uses.values() if use.key == key and case.number(use.is_doubted)]
        return self._says(case, max(doubted, key=lambda use: case.number(use.use))) if doubted else phrases.NOTHING

    def note(self, case: Case) -> Iterator[Note]:
        """Yield a note that delays are assumed to be constant, if this assumption does not affect any verdict."""
        uses = [case.number(use.use) for use in self.uses.values()]
        is_open = any(case.number(use.is_doubted) for use in self.uses.values())
        is_open = is_open or any(case.number(is_made) for is_made in self.untaken_rows().values())
        if case.number(self.is_long) and not is_open and any(use > 0 for use in uses):
            yield phrases.note(
                "air-that-stays-is-negligible",
                aperture_time=case.mission.collection.aperture_time,
                correlation_time=AIR_CHANGES_IN_S,
                use=max(uses),
                keys=_keys(case.mission),
            )

    def _says(self, case: Case, use: AirUse) -> Note:
        size = case.number(use.size)
        if use.key == ISLR:
            size = float(islr_db(size**2, use.model, mainlobe_energy(case.mission)))
        return phrases.air_stays(
            case.mission.collection.aperture_time,
            AIR_CHANGES_IN_S,
            use.key,
            size,
            case.number(use.use),
            _keys(case.mission),
        )

    def _says_of_untaken(self, case: Case, row_id: str) -> Note:
        notes = [
            phrases.air_stays_untaken(
                case.mission.collection.aperture_time,
                AIR_CHANGES_IN_S,
                effect.effect,
                case.number(effect.parts[row_id]),
                _keys(case.mission),
                [f"{key}: {EXAMPLES[key]}" for key in TAKEN_BY[effect.effect]],
            )
            for effect in self.untaken
            if row_id in effect.makers and effect.makers[row_id][case.place]
        ]
        return notes[0].then(*notes[1:])


def staying_air(analysis: Analysis, rows: Sequence[Judged]) -> StayingAir:
    """Compute the effects that atmospheric delays would have on rows if they changed during a long aperture.

    Only delays that the mission assumes to be constant are considered.
    """
    mission, cases = analysis.mission, analysis.cases
    is_long = np.broadcast_to(np.asarray(mission.collection.aperture_time) >= LONG_APERTURE_S, (cases,))
    if mission.propagation is None or not is_long.any():
        return StayingAir()
    errors = changing_air(mission, analysis.geometry, cases, AIR_CHANGES_IN_S)
    if not errors:
        return StayingAir()
    utilization = {row.subject.id: row.utilization for row in rows}
    uses: dict[str, AirUse] = {}
    for model in analysis.gates:
        for use in _uses(analysis, errors, model):
            declared_use = np.nan_to_num(utilization.get(use.row_id, np.zeros(cases)), nan=0.0, posinf=0.0)
            use = use._replace(is_doubted=is_long & _rests_on(mission, use, declared_use))
            larger_use = uses.get(use.row_id)
            if larger_use is None or np.max(use.use) > np.max(larger_use.use):
                is_either = use.is_doubted if larger_use is None else use.is_doubted | larger_use.is_doubted
                uses[use.row_id] = use._replace(is_doubted=is_either)
            else:
                uses[use.row_id] = larger_use._replace(is_doubted=use.is_doubted | larger_use.is_doubted)
    return StayingAir(errors, is_long, uses, untaken_effects(analysis, errors))


def _rests_on(mission: Mission, use: AirUse, declared_use: Floats) -> Booleans:
    """Whether the verdict on a row depends on the assumption of constant delays, (cases,).

    This is so if changing delays would use more than a tenth of the row's limit, or would exceed the limit together
    with the declared errors.
    """
    rule = "rss" if use.key == ISLR else mission.allocation.combine
    together = combined((use.use, declared_use), rule)
    return np.asarray((use.use > NEGLIGIBLE_FRACTION) | ((use.use > 0) & (together > LIMIT_RATIO)))


def _uses(analysis: Analysis, errors: Sequence[RandomError], model: str) -> Iterator[AirUse]:
    """Yield, for one model, the effect that changing delays would have on each row that a requirement limits."""
    mission, allocation = analysis.mission, analysis.allocation
    rule = mission.allocation.combine
    for key in RANDOM_REQUIREMENTS:
        sizes = [(error, _size(analysis, error, model, key)) for error in errors]
        if key == QUADRATIC and rule == "each":
            for error, size in sizes:
                yield _use(analysis, error.id, key, size, allocation.qpe_allowed(error.owner), model)
        elif key in (QUADRATIC, ISLR):
            split = allocation.qpe if key == QUADRATIC else allocation.islr
            for owner in (*PLATFORMS, *(("clock",) if split.clock is not None else ()), "mission"):
                size = combined(
                    [size for error, size in sizes if split.includes(error.owner, owner)],
                    "rss" if key == ISLR else rule,
                )
                limit = allocation.qpe_allowed(owner)
                if key == ISLR:
                    limit = spread_limit(mission, allocation, owner, model)
                if limit is not None:
                    yield _use(analysis, subject(owner, key).id, key, size, limit, model)
        elif getattr(mission.requirements, key) is not None:
            size = combined([size for _, size in sizes], rule)
            yield _use(analysis, subject("mission", key).id, key, size, getattr(mission.requirements, key), model)


def _use(analysis: Analysis, row_id: str, key: str, size: PerCase, limit: PerCase, model: str) -> AirUse:
    sizes = np.broadcast_to(np.asarray(size, dtype=float), (analysis.cases,))
    return AirUse(row_id, key, sizes, sizes / limit, np.zeros(analysis.cases, dtype=bool), model)


def _size(analysis: Analysis, error: RandomError, model: str, key: str) -> PerCase:
    """Compute the effect of a changing delay that the requirement `key` limits.

    The effect is a phase [rad] or a displacement of the image [m]. The quadratic phase is the judged phase, which
    takes autofocus into account. The displacement is only the part that is added by the change of the delay. It is
    the square root of the squared displacement with the change minus the squared displacement without the change.
    """
    effect = error.judged_effect(
        model, analysis.mission.requirements.confidence_of, analysis.allocation.autofocus_gain
    )
    judged_effect = judged_effect_of(analysis.mission, error, model, analysis.allocation.autofocus_gain)
    if key == LOCATION:
        stays = next(declared_error for declared_error in analysis.random if declared_error.id == error.id).effect(
            model
        )
        added = np.square(effect.displacement) - np.square(stays.displacement)
        grown: PerCase = np.sqrt(np.maximum(added, 0.0)) * error.declared
        return grown
    size: PerCase = {QUADRATIC: judged_effect.quadratic, CUBIC: judged_effect.cubic, ISLR: judged_effect.spread}[
        key
    ] * np.asarray(error.declared)
    return size


def _keys(mission: Mission) -> list[str]:
    """List the keys to add to the file to specify how the delays change.

    The list has a single key for both legs of the path if neither has a correlation time, or if both legs have the
    same atmosphere. Otherwise it has the key of the leg that lacks a correlation time.
    """
    propagation = mission.propagation
    if propagation is None:
        return []
    legs = {name: leg for name in PLATFORMS if (leg := propagation.leg(name)) is not None}
    staying = [name for name, leg in legs.items() if leg.correlation_time is None]
    if propagation.is_one_air or len(staying) == len(legs):
        return ["propagation.correlation_time"]
    return [f"propagation.{name}.correlation_time" for name in staying]
