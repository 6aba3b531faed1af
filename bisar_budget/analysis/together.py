"""Combination of the phases and displacements that a mission's declared errors cause, for many cases at once.

The errors may be combined for the whole mission, or for an owner of a share of the budget: transmitter, receiver or
clock.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from bisar_budget.analysis.tone_displacement import ToneDisplacement
from bisar_budget.arrays import Floats, PerCase
from bisar_budget.effects.combined import (
    Correlated,
    Moves,
    Phases,
    combined_displacement,
    combined_phase,
    displacement_parts,
    phase_parts,
)
from bisar_budget.effects.declared import Declared, DeclaredErrors
from bisar_budget.effects.effect import ErrorSource, plain
from bisar_budget.effects.random_effect import RandomEffect, RandomError, factor
from bisar_budget.effects.vibration import DeclaredPhase
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Shares

BIAS_SUFFIX = ".bias"  # behind the row id of an error, for the part of a sum that its bias makes


class Together:
    """Single and combined effects of the declared errors in one model, for many cases.

    The errors are given along the axes in which the mission file states them.

    Parameters
    ----------
    errors : DeclaredErrors
        Errors of the cases.
    model : str
        Name of the model, `published` or `full`.
    slow : sequence of DeclaredPhase
        Phases of vibrations below one cycle per aperture.
    tones : sequence of ToneDisplacement
        Displacements by vibrations and by tones of oscillators.
    random : sequence of RandomError
        Errors of sensors, clocks and the air. Errors without a declared size have no effect.
    groups : sequence of Correlated
        Covariances that the mission declares, each for six errors of a platform.

    Attributes
    ----------
    own : list of DeclaredPhase
        Phases of slow vibrations, and of declared random errors of sensors, clocks and the air. The displacements by
        these errors have no sign, see `undirected_moves`.
    phases : list of DeclaredPhase
        Phases of all declared errors. They are errors of motion, errors of clocks, pure phase errors, and the errors
        in `own`.
    undirected_moves : list of (str, (east, north))
        Displacements of the image [m] due to random errors and tones, which have no sign. Each item is a pair of row
        id and displacement. For a random error, the components of the displacement are sigmas. For a tone, each
        component is given for the phase of the tone at which it is largest. The displacement is 0 for a clock error
        if the mission file does not determine the displacement.
    """

    def __init__(
        self,
        errors: DeclaredErrors,
        model: str,
        slow: Sequence[DeclaredPhase],
        tones: Sequence[ToneDisplacement],
        random: Sequence[RandomError],
        groups: Sequence[Correlated],
    ) -> None:
        self.errors, self.model, self.slow, self.tones, self.groups = errors, model, slow, tones, groups
        self.random = [error for error in random if not error.counted_in]
        self.rule = errors.mission.allocation.combine
        self.motion = [error for error in errors.stated if error.is_motion]
        self.own = [*self._phases_of_slow(), *self._phases_of_random()]
        self.phases = [*self._phases_of_stated(), *self.own]
        self.undirected_moves = [*self._moves_of_random(), *self._moves_of_tones()]
        self._hidden_of_groups = self._hidden_by_group()

    @property
    def rule_of_all(self) -> str:
        """Rule for combinations that must include all declared errors.

        The mission's rule is used, unless it is `each`, which combines no errors. In that case the rule is `rss`, the
        root-sum-square.
        """
        return "rss" if self.rule == "each" else self.rule

    def _phases_of_slow(self) -> Iterator[DeclaredPhase]:
        array = self.errors.array
        for vibration in self.slow:
            yield vibration._replace(
                qpe_rad=array(vibration.qpe_rad),
                cubic_rad=array(vibration.cubic_rad),
                hidden_rad=array(vibration.hidden_rad),
            )

    def _phases_of_random(self) -> Iterator[DeclaredPhase]:
        array = self.errors.array
        for error in self.random:
            if error.declared is not None:
                effect, coverage = self._effect(error), error.coverage(self.errors.mission)
                quadratic, cubic, hidden = map(array, (effect.quadratic, effect.cubic, effect.hidden))
                phase = DeclaredPhase(error.subject.id, error.subject.owner, quadratic, cubic, coverage)
                rms_cubic = array(error.effect(self.model).cubic * error.declared) / coverage
                if error.biased is not None:
                    rms_cubic = np.hypot(rms_cubic, array(error.biased.sizes(self.model, 1.0)[1]))
                yield phase._replace(hidden_rad=hidden, rms_cubic_rad=rms_cubic)

    def _effect(self, error: RandomError) -> RandomEffect:
        """Effect of a declared random error in the form in which the mission's rule combines it; see `_does`."""
        if self.rule != "rss":
            return error.judged(self.model, self.errors.mission.requirements.confidence_of, self.errors.gain)
        effect = error.effect(self.model)
        return effect._replace(
            quadratic=effect.quadratic * error.declared,
            hidden=effect.hidden * error.declared,
            cubic=effect.cubic * error.declared,
            east=effect.east * error.declared,
            north=effect.north * error.declared,
        )

    def _phases_of_stated(self) -> Iterator[DeclaredPhase]:
        factor = self.errors.mission.allocation.coverage_factor
        for error in self.errors.stated:
            does, coverage = self._does(error), factor if error.is_covered else 1.0
            cubic, at_rms = does.cubic if error.is_motion else None, self.errors.at_rms(self.model, error)
            phase = DeclaredPhase(error.subject.id, error.subject.owner, does.qpe, cubic, coverage)
            yield phase._replace(hidden_rad=does.hidden, rms_cubic_rad=at_rms and at_rms.cubic)

    def _does(self, error: ErrorSource) -> Declared:
        """Effects of a declared error in the form in which the mission's rule combines them.

        Root-sum-square combines the declared sizes, and `totals` adds biases and applies a confidence to the sum. The
        other rules combine the sizes that the requirements judge, each with its bias and confidence.
        """
        return (self.errors.does if self.rule == "rss" else self.errors.judged)(self.model, error)

    @cached_property
    def biases(self) -> list[DeclaredPhase]:
        """Phases of the biases of the declared errors, with their signs.

        The list is empty under rules other than root-sum-square. The phases of the errors include biases there.
        """
        return [phase for phase, _ in self._effects_of_biases()]

    @cached_property
    def moves_of_biases(self) -> Moves:
        """Displacements of the image due to the biases of the declared errors; see `biases`. [m]"""
        return [(phase.row_id, moved) for phase, moved in self._effects_of_biases() if moved is not None]

    def _effects_of_biases(self) -> Iterator[tuple[DeclaredPhase, tuple[PerCase, PerCase] | None]]:
        """Yield the phases of each bias and its displacement, east and north, which a pure phase does not have."""
        if self.rule != "rss":
            return
        for error in self.errors.stated:
            if np.any(error.bias):
                does = self.errors.of_bias(self.model, error)
                cubic, moved = (does.cubic, does.displacement) if error.is_motion else (None, None)
                phase = DeclaredPhase(error.subject.id + BIAS_SUFFIX, error.subject.owner, does.qpe, cubic)
                yield phase._replace(hidden_rad=does.hidden), moved
        for random in self.random:
            if random.biased is not None:
                effects = random.biased.signed(self.model)
                hidden = np.sqrt(np.square(effects[4:]).sum(axis=0))
                quadratic, cubic, east, north, hidden = map(self.errors.array, (*effects[:4], hidden))
                phase = DeclaredPhase(random.subject.id + BIAS_SUFFIX, random.subject.owner, quadratic, cubic)
                yield phase._replace(hidden_rad=hidden), (east, north)

    def owed(self, split: Shares, owner: str) -> list[DeclaredPhase]:
        """List the phases of the declared errors that count against an owner's share of the budget.

        `owner` is a platform, the clock or `mission`. For `mission`, all phases are returned. `split` decides whether
        the errors of the clock count against the receiver's share.
        """
        return [phase for phase in self.phases if split.includes(phase.owner, owner)]

    def judged_parts(self, members: Sequence[DeclaredPhase], rule: str = "", gain: PerCase | None = None) -> Phases:
        """List the judged phases that a rule combines, as pairs of id and phase. [rad]

        The judged phase is the root-sum-square of two phases: the quadratic phase, and the hidden phase times `gain`,
        the autofocus gain. The hidden phase is the quadratic phase that would lower the peak as much as the part of
        the error that autofocus does not correct. If `rule` or `gain` is not given, the mission's value is used.
        Under root-sum-square, the six correlated phases of a declared covariance are combined to a single phase.
        """
        gain, groups = self.errors.gain if gain is None else gain, self.groups
        row_ids = [member.row_id for member in members]
        phases = np.array([(member.qpe_rad, member.hidden_rad) for member in members])
        quadratic, hidden = phases.reshape(-1, 2, self.errors.cases).swapaxes(0, 1)
        judged = dict(zip(row_ids, np.hypot(quadratic, gain * hidden), strict=True))
        if (rule or self.rule) == "rss":
            signed = dict(zip(row_ids, quadratic, strict=True))
            for group in groups:
                if judged.keys() >= set(group.ids):
                    size = group.phase([signed[row_id] for row_id in group.ids])
                    for row_id in group.ids:
                        del judged[row_id]
                    judged[group.id] = np.hypot(size, gain * self._hidden_of_groups[group.id])
        return list(judged.items())

    def judged(self, members: Sequence[DeclaredPhase], rule: str = "", gain: PerCase | None = None) -> Floats:
        """Combine the judged phases of the given errors, (cases,). [rad]

        If `rule` or `gain` is not given, the mission's value is used. See `judged_parts` for the judged phase.
        """
        return self.errors.array(combined_phase(self.judged_parts(members, rule, gain), rule or self.rule))

    def _hidden_by_group(self) -> dict[str, Any]:
        """Compute the combined hidden phase of the six errors of each covariance. [rad]

        The keys are the ids of the covariances. The hidden phase is the quadratic phase that would lower the peak as
        much as the part of an error that autofocus does not correct. In the published model it is 0."""
        if self.model == "published":
            return {group.id: 0.0 for group in self.groups}
        stated = {error.subject.id for error in self.motion}
        return {group.id: self._hidden_of(group) for group in self.groups if stated >= set(group.ids)}

    def _hidden_of(self, group: Correlated) -> Floats:
        """Combined hidden phase of the six errors of a covariance, (cases,). [rad]

        The hidden phase of an error is the quadratic phase that would lower the peak as much as the part of the error
        that autofocus does not correct. The six correlated errors are replaced by six independent errors that
        together have the same covariance. The result is the root-sum-square of the hidden phases of these errors.
        """
        errors = {error.subject.id: error for error in self.motion}
        remaining = []
        for row_id in group.ids:
            block, index = self.errors.block_of(errors[row_id])
            remaining.append(block.left_per_unit([index])[0] * np.nan_to_num(block.declared[index]))
        hidden, _ = self.errors.exact.unresolved(self.independent(group, np.array(remaining)))
        return np.asarray(np.sqrt(np.square(hidden).sum(axis=0)))

    def independent(self, group: Correlated, remaining: Floats) -> Floats:
        """Range errors due to six independent errors that together have the covariance of six correlated errors. [m]

        The result is (6, nodes, cases). `remaining` [m] are the range errors at the nodes due to the six correlated
        errors, (6, nodes, cases). They are multiplied by a factor F of the correlation matrix C, where FFᵀ = C.
        """
        correlation = np.array([[self.errors.array(rho) for rho in row] for row in group.correlation])
        return np.asarray(np.einsum("cij,inc->jnc", factor(np.moveaxis(correlation, 2, 0)), remaining))

    def combined(self, phases: Phases, rule: str = "") -> Floats:
        """Combine phases by the given rule, or by the mission's rule if `rule` is empty, (cases,). [rad]

        `phases` are pairs of row id and signed phase.
        """
        return self.errors.array(combined_phase(phases, rule or self.rule, self.groups))

    def cubics_without_coverage(self, split: Shares, owner: str) -> Phases:
        """List the cubic phases of the errors that count against an owner's share, without the coverage factor. [rad]

        `owner` is a platform, the clock or `mission`, and `split` divides the budget between them. The phases are
        signed. Each item is a pair of row id and phase. Errors without a cubic phase are left out.
        """
        members = self.owed(split, owner)
        return [(phase.row_id, phase.expected_cubic_rad) for phase in members if phase.cubic_rad is not None]

    def cubic_without_coverage(self, split: Shares, owner: str) -> Floats:
        """Combined cubic phase of the errors that count against an owner's share, without the coverage factor. [rad]

        `owner` is a platform, the clock or `mission`, and `split` divides the budget between them. The phases are
        added under `combine: sum`. Under the other rules they are combined as a root-sum-square, since powers add.
        The result is (cases,).
        """
        return self.combined(self.cubics_without_coverage(split, owner), self.rule_of_all)

    def moves(self, rule: str) -> Moves:
        """List the displacements of the image due to errors of motion, in the form in which a rule combines them. [m]

        Each item is a pair of row id and (east, north). For all rules except `sum`, the displacement is given for the
        sign of the error that moves the image farther.

        The rule `sum` takes the largest sum over all combinations of signs. For this rule, the displacements for the
        two signs of an error are split into their mean and a deviation that reverses with the sign. The item
        of an error holds the deviation. The means do not depend on the signs. If their sum over all errors is
        not 0, this sum is an additional item.
        """
        if rule != "sum":
            return [(error.subject.id, self._does(error).farthest) for error in self.motion]
        does = {error.subject.id: self._does(error) for error in self.motion}
        ahead, back = (
            np.array([getattr(effect, side) for effect in does.values()]).reshape(-1, 2, self.errors.cases)
            for side in ("displacement", "opposite")
        )
        rest = ((ahead + back) / 2).sum(axis=0)
        moves = [(row_id, (east, north)) for row_id, (east, north) in zip(does, (ahead - back) / 2, strict=True)]
        return [*moves, ("whatever the signs", (rest[0], rest[1]))] if rest.any() else moves

    def _moves_of_random(self) -> Moves:
        moves = []
        for error in self.random:
            if error.declared is not None:
                effect = self._effect(error)
                is_open = self.errors.array(error.displaces_unknown) > 0
                moved = map(self.errors.array, effect[3:5])
                east, north = (np.where(is_open, 0.0, component) for component in moved)
                moves.append((error.subject.id, (east, north)))
        return moves

    def _moves_of_tones(self) -> Moves:
        moves = []
        for tone in self.tones:
            east, north = map(self.errors.array, tone.by(self.model))
            moves.append((tone.subject.id, (east, north)))
        return moves

    @property
    def is_placed(self) -> bool:
        """Whether at least one declared error can displace the image."""
        return bool(self.motion or self.undirected_moves)

    def moved(self, rule: str) -> Floats:
        """Length of the displacement of the image due to all declared errors, combined by a rule, (cases,). [m]

        The displacement due to a random error or a tone has no sign. Under `sum`, the length of such a displacement
        is added to the largest sum of the displacements due to errors of motion. The result is NaN where an error
        leaves no image.
        """
        if rule != "sum":
            moves = [*self.moves(rule), *self.undirected_moves]
            return self.errors.array(combined_displacement(moves, rule, self.groups))
        largest = combined_displacement(self.moves(rule), rule, self.groups)
        return self.errors.array(largest + sum(np.hypot(*move) for _, move in self.undirected_moves))

    # ---------------------------------------------------------------- one case
    def phase_parts(self, phases: Phases, rule: str = "", case: int = 0) -> list[tuple[str, float]]:
        """List the signed phases that a rule combines in one case, as floats. [rad]

        Each item is a pair of id and phase. If `rule` is empty, the mission's rule is used. Under root-sum-square the
        six phases of a covariance are combined to a single item.
        """
        combined_parts = phase_parts(phases, rule or self.rule, self.groups)
        return [(row_id, plain(phase, case)) for row_id, phase in combined_parts]

    def displacement_parts(self, case: int = 0) -> list[tuple[str, GroundVector]]:
        """List the displacements of the image that the mission's rule combines in one case, as floats. [m]

        Each item is a pair of id and (east, north). The list is empty if an error leaves no image. Under
        root-sum-square the six displacements of a covariance are combined to a single item.
        """
        named_moves = displacement_parts([*self.moves(self.rule), *self.undirected_moves], self.rule, self.groups)
        combined_parts = [(row_id, (plain(east, case), plain(north, case))) for row_id, (east, north) in named_moves]
        return [] if any(math.isnan(east) for _, (east, _) in combined_parts) else combined_parts

    def biases_of_case(self, case: int = 0) -> list[tuple[str, GroundVector]]:
        """List the displacements of the image due to biases in one case, as pairs of id and (east, north). [m]"""
        return [(row_id, (plain(east, case), plain(north, case))) for row_id, (east, north) in self.moves_of_biases]


def quadratics(members: Iterable[DeclaredPhase]) -> Phases:
    """List the signed quadratic phases of the given errors, as pairs of row id and phase. [rad]"""
    return [(phase.row_id, phase.qpe_rad) for phase in members]


def cubics(members: Iterable[DeclaredPhase]) -> Phases:
    """List the signed cubic phases of the given errors, as pairs of row id and phase. [rad]

    Errors without a cubic phase are left out.
    """
    return [(phase.row_id, phase.cubic_rad) for phase in members if phase.cubic_rad is not None]
