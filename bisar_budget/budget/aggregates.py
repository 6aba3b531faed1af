"""Budget rows that judge sums of errors.

They limit the quadratic and cubic phase, the displacement of the image, the total phase that autofocus must correct,
and the difference between the phases at the edge and at the centre of the scene.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.scene import Corrections, SceneEdge, SceneEdges
from bisar_budget.analysis.together import BIAS_SUFFIX, Together, cubics, quadratics
from bisar_budget.analysis.totals import Totals
from bisar_budget.arrays import Booleans, Floats, PerCase, PerCaseFlag
from bisar_budget.budget.continued_masks import continuation_note, part_of, rests_on_masks
from bisar_budget.budget.doubted_noise import doubted_noise_note, rests_on_doubted_noise
from bisar_budget.budget.judged_requirements import (
    MAKER_FRACTION,
    TAKEN_BY,
    UntakenEffect,
    first_highest,
    negligible_rad,
)
from bisar_budget.budget.judged_rows import CODE, LIMIT_RATIO, FamilyRow, Judging, worded
from bisar_budget.effects.combined import Phases, correlation_notes
from bisar_budget.effects.declared import CUBIC, LOCATION, MODELS, OTHER_MODEL, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.oscillator_tones import spurs_of
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.vibration import DeclaredPhase
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND
from bisar_budget.faults import KeyPath
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Shares
from bisar_budget.phrases import NOTHING, Note

PULL_IN = "autofocus_pull_in"


class Aggregates:
    """Builds the budget rows for sums of errors, for an array of cases."""

    def __init__(self, judging: Judging, analysis: Analysis, totals: Totals | None = None) -> None:
        self.judging, self.together, self.array = judging, analysis.together, judging.array
        self.totals = totals or Totals(analysis)
        self.allocation, self.errors = analysis.allocation, analysis.errors
        self.needs, self.combine = self.errors.mission.requirements, self.errors.mission.allocation.combine

    def rows(self, model: str) -> Iterator["Aggregate"]:
        """Yield all rows for sums of errors, as judged by one model, in the order of the JSON output.

        `model` is `published` or `full`. A row that passes in this model becomes a warning if it exceeds its limit in
        the other model.
        """
        mine, theirs = self.together(model), self.together(OTHER_MODEL[model])
        if self.combine == "each":
            yield self._largest_quadratic(mine, theirs)
        else:
            owners = ("transmitter", "receiver", "clock", "mission")
            has_clock = self.allocation.qpe.clock is not None  # otherwise it uses the receiver's share
            yield from (self._quadratic(mine, theirs, owner) for owner in owners if owner != "clock" or has_clock)
        yield self._cubic(mine, theirs)
        yield self._location(mine, theirs)
        if self.allocation.n_pull is not None:
            yield self._pull_in(mine, theirs)

    def _quadratic(self, mine: Together, theirs: Together, owner: str) -> "Aggregate":
        split, limit, gain = self.allocation.qpe, self.allocation.qpe_limit(owner), self.allocation.autofocus_gain
        members, their_members = mine.owed(split, owner), theirs.owed(split, owner)
        judged_phases, size_by_theirs = mine.judged_parts(members), theirs.judged(their_members)
        root_sum_square = mine.combined(judged_phases)
        size = self._reached(mine, QUADRATIC, root_sum_square, owner, gain)
        size_by_theirs = self._reached(theirs, QUADRATIC, size_by_theirs, owner, gain)
        equal_loss, of_full_model = size, size if mine.model == "full" else size_by_theirs
        if np.any(gain != 1):
            equal_loss = self._reached(mine, QUADRATIC, mine.judged(members, gain=1.0), owner)
            of_full_model = equal_loss
        published, full = (members, their_members) if mine.model == "published" else (their_members, members)
        of_full = self.together("full").combined(quadratics(full))
        aggregate = self._row(
            subject(owner, QUADRATIC),
            self._is_declared(members),
            judged_phases,
            size,
            limit * gain,
            theirs,
            size_by_theirs,
            without_autofocus=equal_loss / limit,
            continued=("quadratic", self._of_owners(split, owner)),
            qpe_published_rad=self.together("published").combined(quadratics(published)),
            qpe_full_rad=np.where(np.isfinite(of_full), of_full, math.nan),
            root_sum_square=root_sum_square,
            biases=[(bias.row_id, bias.judged(gain)) for bias in mine.biases if split.includes(bias.owner, owner)],
        )
        if mine.model != "full":
            of_full_model = self._reached(theirs, QUADRATIC, theirs.judged(full, gain=1.0), owner)
        return aggregate.of_equal_loss(equal_loss, of_full_model)

    def _reached(
        self, together: Together, requirement: str, combined: Floats, owner: str = "mission", gain: PerCase = 1.0
    ) -> Floats:
        """Size that a requirement judges for a sum of errors, (cases,): with biases, and at its confidence.

        `combined` is the sum of the errors by the mission's rule. Under root-sum-square it has neither, and under
        other rules both are in the single errors.
        """
        return self._of_all(together, requirement, combined, owner, gain) if self.combine == "rss" else combined

    def _of_all(
        self, together: Together, requirement: str, combined: Floats, owner: str = "mission", gain: PerCase = 1.0
    ) -> Floats:
        split = self.allocation.qpe
        return self.totals.reached(
            together.model, requirement, lambda name: split.includes(name, owner), combined, gain
        )

    def _largest_quadratic(self, mine: Together, theirs: Together) -> "Aggregate":
        """Build the warning row for the mission's total quadratic phase under `combine: each`.

        The rule `each` judges every error alone. The row exists only in the cases in which no single error exceeds
        the limit, but the root-sum-square of all errors does. `mine` holds the errors in the model that judges the
        row, and `theirs` the errors in the other model.
        """
        row_subject, phases = subject("mission", QUADRATIC), mine.judged_parts(mine.phases)
        gain = self.allocation.autofocus_gain
        size = mine.judged(mine.phases)
        of_all = self._of_all(mine, QUADRATIC, mine.judged(mine.phases, "rss"), gain=gain)
        limit = self.allocation.qpe_total * gain
        aggregate = self._row(row_subject, True, phases, size, limit, theirs, of_all=of_all)
        is_warning = aggregate.judged.status == CODE["warn"]  # a failing error has its own row
        is_there = aggregate.is_over_of_all & is_warning
        nothing = self.judging.row(row_subject, None, None)
        return replace(aggregate, judged=aggregate.judged.where(~is_there, nothing), is_there=is_there)

    def _cubic(self, mine: Together, theirs: Together) -> "Aggregate":
        phases, limit = cubics(mine.phases), self.needs.cubic_phase_error
        of_all: PerCase = math.nan
        root_sum_square = mine.combined(phases)
        size = self._reached(mine, CUBIC, root_sum_square)
        if self.combine == "each":
            of_all = self._of_all(mine, CUBIC, mine.combined(phases, "rss"))
        return self._row(
            subject("mission", CUBIC),
            self._is_declared(phase for phase in mine.phases if phase.cubic_rad is not None),
            phases,
            size,
            limit,
            theirs,
            self._reached(theirs, CUBIC, theirs.combined(cubics(theirs.phases))),
            of_all,
            continued=("cubic", mine.random),
            metric=CUBIC,
            cubic_rad=size,
            root_sum_square=root_sum_square,
            biases=cubics(mine.biases),
        )

    def _location(self, mine: Together, theirs: Together) -> "Aggregate":
        limit = self.needs.location_error
        of_all: PerCase = math.nan
        root_sum_square = mine.moved(self.combine)
        if self.combine == "each":
            of_all = self._of_all(mine, LOCATION, mine.moved("rss"))
        return self._row(
            subject("mission", LOCATION),
            mine.is_placed,
            (),
            self._reached(mine, LOCATION, root_sum_square),
            limit,
            theirs,
            self._reached(theirs, LOCATION, theirs.moved(self.combine)),
            of_all,
            without_value="info" if limit is None else "not_evaluated",
            continued=("displacement", mine.random),
            metric=LOCATION,
            root_sum_square=root_sum_square,
        )

    def _pull_in(self, mine: Together, theirs: Together) -> "Aggregate":
        phases, pull_in = quadratics([*mine.phases, *mine.biases]), math.pi * np.asarray(self.allocation.n_pull)
        return self._row(
            subject("mission", PULL_IN),
            self._is_declared(mine.phases),
            phases,
            mine.combined(phases, "sum"),
            pull_in,
            theirs,
            theirs.combined(quadratics([*theirs.phases, *theirs.biases]), "sum"),
            never_fails=True,
        )

    def _of_owners(self, split: Shares, owner: str) -> Sequence[RandomError]:
        """List the random errors (sensors, clocks, atmosphere) that count against the share of an owner.

        `owner` is a platform, the clock or `mission`, and `split` divides the budget between them.
        """
        return [error for error in self.together("full").random if split.includes(error.owner, owner)]

    def _is_declared(self, members: Iterable[DeclaredPhase]) -> Booleans:
        """Return a mask of the cases in which at least one of the phases `members` is declared, (cases,)."""
        is_declared = np.zeros(self.judging.cases, dtype=bool)
        for member in members:
            is_declared |= member.is_there
        return is_declared

    def _row(
        self,
        row_subject: Subject,
        is_declared: PerCaseFlag,
        phases: Phases,
        size: Floats,
        limit: PerCase | None,
        theirs: Together,
        size_by_theirs: PerCase = math.nan,
        of_all: PerCase = math.nan,
        *,
        without_value: str = "",
        without_autofocus: PerCase = 0.0,
        never_fails: bool = False,
        continued: tuple[str, Sequence[RandomError]] = ("quadratic", ()),
        root_sum_square: Floats | None = None,
        biases: Phases = (),
        **fields: Any,
    ) -> "Aggregate":
        """Judge a sum of errors against a limit, for an array of cases.

        A sum of declared errors that has no finite value gets the status `fail`, because one of the errors is so
        large that no image of the point forms. If `without_value` is given, the sum gets this status instead.
        `continued` is a pair: the kind of effect that the row sums, and the random errors in the sum. A pass becomes
        a warning if it depends on phase noise at frequencies below the first point of a phase-noise mask. A pass that
        depends on doubtful oscillator noise becomes `not_evaluated`. `root_sum_square` is the sum at one sigma, if it
        differs from `size`; the noise of the masks is a part of it. `biases` are phases that add to `phases`.
        """
        rests_on: PerCaseFlag = False
        is_in_doubt: PerCaseFlag = False
        is_over_by_other: PerCaseFlag = False
        is_over_of_all: PerCaseFlag = False
        by_model: dict[str, Any] = {}
        if limit is not None:
            limit = self.array(limit)
            models = MODELS if _wording_of(row_subject, "").is_quadratic else ("published",)
            by_model = {f"allowable_{model}": limit for model in models}
            is_over_by_other = self.errors.doubts(theirs.model, size_by_theirs > limit * LIMIT_RATIO)
            is_over_of_all = of_all > limit * LIMIT_RATIO
            at_one_sigma = size if root_sum_square is None else root_sum_square
            limit_at_one_sigma = limit * np.where(size > 0, at_one_sigma / size, 1.0)
            rests_on = rests_on_masks(continued[1], continued[0], at_one_sigma, limit_at_one_sigma)
            is_in_doubt = rests_on_doubted_noise(continued[1], continued[0], OTHER_MODEL[theirs.model], limit)
            is_in_doubt = is_in_doubt & ~(size > limit * LIMIT_RATIO) & (not never_fails)
        judged = self.judging.row(
            row_subject,
            size,
            limit,
            doubt=is_over_by_other | is_over_of_all | rests_on,
            without_autofocus=without_autofocus,
            is_info=limit is None,
            is_unknown=is_in_doubt,
            never_fails=never_fails,
        )._replace(**fields, **by_model)
        has_value = is_declared & np.isfinite(size)
        if not has_value.all():
            nothing = self.judging.row(row_subject, None, limit)._replace(**by_model)
            status = CODE[without_value or ("fail" if limit is not None else "not_declared")]
            nothing = nothing._replace(status=np.where(is_declared, status, nothing.status))
            judged = judged.where(~has_value, nothing)
        rule = "sum" if never_fails else self.combine
        doubts = (size_by_theirs, of_all, is_over_by_other, is_over_of_all)
        return Aggregate(judged, rule, phases, *doubts, without_autofocus, rests_on, continued, is_in_doubt, biases)


@dataclass(frozen=True, slots=True, eq=False)
class Aggregate(FamilyRow):
    """The budget row for one sum of errors, judged by one model, for an array of cases.

    `rule` names the rule that combines the `phases`. A row of displacements has no phases. `by_other` is the sum
    according to the model that does not judge the row. Under `combine: each` the row holds the largest error instead
    of a sum, and `of_all` is the root-sum-square of all errors; under any other rule `of_all` is NaN. A pass becomes
    a warning if `by_other` or `of_all` exceeds the limit.
    """

    rule: str
    phases: Phases
    by_other: PerCase
    of_all: PerCase = math.nan
    is_over_by_other: PerCaseFlag = False
    is_over_of_all: PerCaseFlag = False
    without_autofocus: PerCase = 0.0
    rests_on: PerCaseFlag = False  # result depends on noise below the first points of masks
    continued: tuple[str, Sequence[RandomError]] = ("quadratic", ())
    is_in_doubt: PerCaseFlag = False  # result depends on doubtful noise
    biases: Phases = ()  # of the errors in `phases`

    def of_equal_loss(self, equal_loss: Floats, of_full: Floats) -> "Aggregate":
        """Return the row with the equal-loss phase as its declared value, instead of the judged phase.

        The equal-loss phase is the quadratic phase that would lower the image peak as much as the errors do. It may
        be smaller than the judged phase, which includes the autofocus gain for the part of the errors that autofocus
        cannot correct. The allowable is scaled by the same factor as the declared value, so that the utilization does
        not change. Without a declared phase the allowable stays the same. Two equal-loss phases (cases,) [rad] are
        given: `equal_loss` from the model that judges the row, and `of_full` from the full model.
        """
        judged = self.judged
        with np.errstate(all="ignore"):
            scale = np.where(judged.declared > 0, equal_loss / judged.declared, 1.0)
        scale = np.where(np.isfinite(scale), scale, 1.0)
        judged = judged._replace(
            declared=judged.declared * scale,
            allowable=judged.allowable * scale,
            equal_loss_qpe_rad=np.where(np.isfinite(of_full), of_full, math.nan),
        )
        return replace(self, judged=judged)

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text; `model` names the model that judges the row."""
        mission, row_subject = case.mission, self.judged.subject
        groups, combine, owner = case.analysis.groups, mission.allocation.combine, row_subject.owner
        numbers = map(case.number, (self.judged.declared, self.judged.allowable))
        size, limit = (None if math.isnan(number) else number for number in numbers)
        wording, over, notes = _wording_of(row_subject, self.rule), NOTHING, tuple[Note, ...]()
        if combine != "each" and not row_subject.facts.only_warns:
            notes = correlation_notes(combine, [group for group in groups if owner in (group.platform, "mission")])
        if size is None:
            over = phrases.note("no-ground-point")
        elif limit is not None and case.number(self.judged.utilization) > LIMIT_RATIO:
            over = phrases.aggregate_over(wording.what, size, limit, wording.unit, *_largest(case, model, self))
        if wording.is_quadratic:
            if over and size is not None and combine != "each":
                over = over.then(self._passes_with(case, model))
        elif over and size is not None and wording.advice:
            over = over.then(wording.advice)
        doubt = over if row_subject.facts.only_warns else NOTHING
        doubted = NOTHING
        if case.number(self.is_in_doubt):
            owners = {error.owner for error in self.continued[1]}
            doubted = doubted_noise_note(mission, [name for name in PLATFORMS if name in owners])
        return worded(
            case,
            self.judged,
            unit=wording.unit,
            path=wording.path,
            equation=wording.equation[model != "published"],
            over=over,
            doubt=doubt or _doubt(case, OTHER_MODEL[model], self, wording, limit),
            no_limit=phrases.note("no-requirement"),
            not_evaluated=doubted or case.degeneracy(model) or phrases.note("no-image-to-place"),
            info=phrases.note("no-requirement"),
            without_autofocus=case.number(self.without_autofocus),
            remarks=notes,
        )

    def _passes_with(self, case: Case, model: str) -> Note:
        """Write a note with the smallest N_pull with which the sum would pass.

        N_pull is the pull-in range of autofocus in units of π rad. If no autofocus could make the sum pass, the note
        reports this instead.
        """
        together, owner, split = case.analysis.together(model), self.judged.subject.owner, case.allocation.qpe
        members, totals = together.owed(split, owner), Totals(case.analysis)

        def reached(size: Floats, gain: float) -> float:
            if together.rule == "rss":
                size = totals.reached(model, QUADRATIC, lambda name: split.includes(name, owner), size, gain)
            return case.number(size)

        quadratic = reached(together.combined(quadratics(members)), 0.0)
        gain = max(quadratic / case.allocation.qpe_limit(owner), 1.0)  # at this gain the hidden phase counts
        total = reached(together.judged(members, gain=gain), gain)
        hidden = math.sqrt(max(total**2 - quadratic**2, 0.0)) / gain
        return case.allocation.passes_with(quadratic, hidden, owner, case.mission)


# ---------------------------------------------------------------------- totals of effects
def effect_parts(analysis: Analysis, model: str) -> dict[str, Phases]:
    """Compute the cubic, spread and tone phases of each declared error with one model. [rad]

    The result has three keys: `cubic` for cubic phases, `spread` for rms phases that spread energy over the image,
    and `tone` for the peak phases of tones. Each value is a list of pairs (row id, phase). The cubic phase of a bias
    is an item of its own.
    """
    array, together = analysis.errors.array, analysis.together(model)
    return {
        "cubic": cubics([*together.phases, *together.biases]),
        "spread": [
            (phase.row_id, np.sqrt(np.nan_to_num(array(phase.variance))))
            for phase in (*analysis.noise[model], *analysis.rests[model])
        ],
        "tone": [(tone.subject.id, array(tone.is_there * tone.phase)) for tone in analysis.tones],
    }


def untaken_effects(analysis: Analysis, instead: Sequence[RandomError] = ()) -> list[UntakenEffect]:
    """Find the effects that no requirement limits, and the rows of the errors that cause them.

    A row is included only in the cases in which its effect is not negligible. If both models judge the mission, the
    larger value of each effect is used. `instead` holds random errors that replace the errors with the same ids.
    """
    needs = analysis.mission.requirements
    level = negligible_rad(analysis.mission)
    by_model = [
        (analysis.together(model), _exchanged(effect_parts(analysis, model), instead, model))
        for model in analysis.gates
    ]
    effects = []
    for effect_name, keys in TAKEN_BY.items():
        if any(getattr(needs, key) is not None for key in keys):
            continue
        sum_of_all: PerCase = 0.0
        sizes: dict[str, Floats] = {}
        for together, parts in by_model:
            sum_of_all = np.fmax(sum_of_all, together.combined(parts[effect_name], together.rule_of_all))
            for part_id, size in parts[effect_name]:
                row_id = part_id.removesuffix(BIAS_SUFFIX)
                sizes[row_id] = np.fmax(sizes.get(row_id, 0.0), np.abs(size))
        if not sizes:
            continue
        # An error with which the point has no image is judged by its own row.
        total = np.where(np.isfinite(sum_of_all), sum_of_all, 0.0)
        sizes = {row_id: np.where(np.isfinite(size), size, 0.0) for row_id, size in sizes.items()}
        largest = np.max(list(sizes.values()), axis=0)
        is_above = (total >= level) & (largest > 0)
        count = np.sum([size > 0 for size in sizes.values()], axis=0)
        least = np.minimum(MAKER_FRACTION * largest, level / np.maximum(count, 1))
        makers = {row_id: is_above & (size >= least) & (size > 0) for row_id, size in sizes.items()}
        effects.append(UntakenEffect(effect_name, total, (total > 0) & ~is_above, makers, least, sizes))
    return effects


def _exchanged(parts: Mapping[str, Phases], errors: Sequence[RandomError], model: str) -> dict[str, Phases]:
    """Replace the cubic and spread phases of random errors in `parts` by the phases of the given errors. [rad]

    Errors are matched by their ids. For the keys of `parts` see `effect_parts`.
    """
    ids = {error.id for error in errors}
    exchanged = {name: [phase for phase in phases if phase[0] not in ids] for name, phases in parts.items()}
    for error in errors:
        for name in ("cubic", "spread"):
            exchanged[name].append((error.id, part_of(error.effect(model), name) * np.asarray(error.declared)))
    return dict(exchanged)


# ---------------------------------------------------------------------- displacements that no row holds
def unplaced(together: Together) -> dict[str, Booleans]:
    """Find the random errors that displace the image by an unknown amount, for example clocks that were never set.

    The result maps the row id of each random error to a mask of the cases in which the amount is unknown, (cases,).
    """
    return {error.subject.id: together.errors.array(error.displaces_unknown) > 0 for error in together.random}


# ---------------------------------------------------------------------- in words
class _Words(NamedTuple):
    """Wording of the row for a sum of errors.

    The fields are the name and the unit of the summed effect, the key in the mission file to which the row refers,
    and the equation of each model.
    """

    what: str
    unit: str
    path: KeyPath
    equation: tuple[str, str]  # published model, full model
    advice: Note = NOTHING  # what autofocus does for a row that exceeds its limit
    is_quadratic: bool = False
    is_displacement: bool = False


_ROW_SUM_WORDS = {"sum": "sum of the rows", "rss": "root-sum-square of the rows", "each": "largest of the rows"}
_PATHS: dict[str, KeyPath] = {"mission": ("platforms",), "clock": ("timing_error",)}
_WORDINGS = {
    CUBIC: _Words(
        "cubic phase",
        "rad",
        ("requirements", CUBIC),
        ("Table I, cubic column", "full model"),
        advice=phrases.note("no-gain"),
    ),
    LOCATION: _Words(
        "displacement of the image", "m", ("requirements", LOCATION), ("(25)", "full model"), is_displacement=True
    ),
    PULL_IN: _Words(
        "QPE", "rad", ("autofocus", "n_pull"), ("Section VI", "Section VI"), advice=phrases.note("one-total")
    ),
}


def _wording_of(row_subject: Subject, rule: str) -> _Words:
    path = _PATHS.get(row_subject.owner, ("platforms", row_subject.owner, "motion_error"))
    of_rows = _ROW_SUM_WORDS.get(rule, "")
    return _WORDINGS.get(row_subject.kind, _Words("QPE", "rad", path, (of_rows, of_rows), is_quadratic=True))


def _largest(case: Case, model: str, aggregate: Aggregate) -> tuple[str, float, Note]:
    """Return the row id and the size of the largest error in a sum, with a note on that size.

    The size is a phase [rad] or a displacement [m]. There is a note if the size depends on extrapolated phase noise,
    or on a spur that synchronisation folds to a low frequency. Otherwise the note is empty.
    """
    together, row_subject = case.analysis.together(model), aggregate.judged.subject
    wording = _wording_of(row_subject, aggregate.rule)
    if wording.is_displacement:
        moves = [*together.displacement_parts(case.place), *together.biases_of_case(case.place)]
        sizes = [(row_id, math.hypot(*move)) for row_id, move in moves]
    else:
        sizes = together.phase_parts([*aggregate.phases, *aggregate.biases], aggregate.rule, case.place)
    row_id, largest = sizes[int(first_highest(np.abs([size for _, size in sizes])))]
    if wording.is_displacement or row_subject.facts.only_warns:
        return row_id, largest, NOTHING
    extrapolated = {error.id: error.extrapolated for error in case.random}
    return (
        row_id,
        largest,
        _folded_spur(case, row_id, largest, is_cubic=not wording.is_quadratic) or extrapolated.get(row_id, NOTHING),
    )


def _folded_spur(case: Case, row_id: str, size: float, *, is_cubic: bool) -> Note:
    """Write a note that names the folded spur that causes most of an oscillator's phase.

    If the platforms exchange pulses to synchronise, spurs are folded (aliased) to low frequencies. The note is empty
    if no spur causes most of the phase.
    """
    T, factor = case.mission.collection.aperture_time, case.mission.allocation.coverage_factor
    for spur in spurs_of(case.mission):
        slow = spur.slow_parts(T) if subject(spur.name, OSCILLATOR_KIND.name).id == row_id else None
        if slow is not None and 2 * factor**2 * float(slow.cubic if is_cubic else slow.quadratic) > size**2:
            return phrases.note("spur-is-folded", frequency=spur.frequency)
    return NOTHING


def _doubt(case: Case, other: str, aggregate: Aggregate, wording: _Words, limit: float | None) -> Note:
    """Explain why a pass becomes a warning; the note is empty if there is no reason for a warning.

    There are three possible reasons: all errors together exceed the limit, the sum according to the model `other`
    exceeds it, or the row depends on phase noise at frequencies below the first point of a phase-noise mask.
    """
    if limit is None:
        return NOTHING
    if case.number(aggregate.is_over_of_all):
        effect_name = "displacement" if wording.is_displacement else wording.what
        return phrases.note(
            "all-together-over", what=effect_name, size=case.number(aggregate.of_all), limit=limit, unit=wording.unit
        )
    if not case.number(aggregate.is_over_by_other):
        if not case.number(aggregate.rests_on):
            return NOTHING
        effect_kind, errors = aggregate.continued
        of_case = [error for error in case.random if error.id in {each.id for each in errors}]
        return continuation_note(case, of_case, effect_kind, case.number(aggregate.judged.declared))
    by_other = case.number(aggregate.by_other)
    if aggregate.judged.subject.facts.only_warns:
        return phrases.note("other-model-is-beyond", model=other, phase=by_other, limit=limit, unit=wording.unit)
    return phrases.other_model_fails(other, by_other, limit, wording.unit)


# ---------------------------------------------------------------------- the scene's edge
@dataclass(frozen=True, eq=False)
class JudgedScene:
    """Difference between the phase errors at the edge and at the centre of the scene, for an array of cases.

    `edges` holds the phase changes from the centres to the edges of the scenes. It is None if no error is declared.
    """

    analysis: Analysis
    edges: SceneEdges | None

    @cached_property  # a slow search, which sweeps do not need
    def corrections(self) -> Corrections | None:
        """Search for the distances from the scene centre up to which one autofocus correction suffices.

        The result is None if no error is declared. The search is slow, and runs only when the text of the row is
        written.
        """
        return None if self.edges is None else Corrections(self.edges, self.analysis.allocation.qpe_total)

    def edge(self, case: Case) -> SceneEdge | None:
        """Return the results for the edge of the scene in one case; None if no error is declared.

        They include the distance up to which one autofocus correction is sufficient.
        """
        return None if self.corrections is None else SceneEdge.of(self.corrections, case.mission, case.place)

    def row(self, judging: Judging, model: str) -> "SceneRow":
        """Judge the difference between the phase errors at the edge and at the centre of the scene, with one model.

        In the published model an error has the same effect everywhere in the scene. The difference is then zero.
        """
        row_subject, edges = subject("mission", "spatial_variance"), self.edges
        total = judging.array(self.analysis.allocation.qpe_total)
        allowable = None if model == "published" else total
        nothing = judging.row(row_subject, None, allowable)._replace(allowable_full=total)
        if edges is None:
            return SceneRow(nothing, self, np.zeros(judging.cases, dtype=bool))
        is_over_full = np.asarray(edges.difference > total * LIMIT_RATIO) & (model == "published")
        judged = judging.row(row_subject, edges.difference, allowable, doubt=edges.has_doubt | is_over_full)._replace(
            qpe_published_rad=np.zeros(judging.cases), qpe_full_rad=edges.difference, allowable_full=total
        )
        nothing.status[:] = CODE["not_evaluated"]
        return SceneRow(judged.where(np.isinf(edges.difference), nothing), self, is_over_full)


@dataclass(frozen=True, slots=True, eq=False)
class SceneRow(FamilyRow):
    """The row that judges the phase error at the edge of the scene relative to the centre, for an array of cases.

    `is_over_full` marks the cases in which the published model judges the row, but the phase difference exceeds the
    budget in the full model.
    """

    scene: JudgedScene
    is_over_full: Booleans

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text; `model` names the model that judges the row."""
        edge, total = self.scene.edge(case), case.allocation.qpe_total
        doubt, degeneracy, notes = NOTHING, NOTHING, tuple[Note, ...]()
        if edge is not None:
            doubt, degeneracy = edge.doubt, edge.degeneracy
            drifting = [error.subject.id for error in case.analysis.random if case.number(error.displaces_unknown)]
            if not degeneracy:
                open_drift = (phrases.note("drift-is-open-at-the-edge", row_ids=drifting),) if drifting else ()
                notes = (*edge.notes(total), *open_drift)
            if self.is_over_full[case.place]:
                doubt = phrases.other_model_fails("full", edge.difference, total, "rad")
        return worded(
            case,
            self.judged,
            unit="rad",
            path=("scene", "radius"),
            equation="full model",
            over=phrases.note("edge-over"),
            doubt=doubt,
            no_limit=phrases.note("same-all-over-the-scene"),
            not_evaluated=degeneracy,
            remarks=notes,
        )
