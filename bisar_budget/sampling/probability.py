"""Monte Carlo: draw errors from their declared distributions and count how often each requirement is met.

The result shows whether the root-sum-square and worst-case rules are a good description of the sum of errors. All
declared errors are drawn at once, their effects according to the full model are added, and the magnitude of the sum
is compared with the requirement. For small errors the sum is linear in standardized random variables (see
`analysis.variables`); for large errors it is computed from exact ranges (see the module `draws`).

Errors are drawn from the distributions themselves, so the coverage factor, which turns sigmas into bounds, is not
applied. A sinusoidal vibration, and a tone of an oscillator, is drawn with its declared amplitude and a random phase.
A wideband vibration is not drawn, because it only spreads power.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import stated_powers
from bisar_budget.analysis.together import cubics
from bisar_budget.analysis.totals import Totals
from bisar_budget.analysis.variables import CONSTANT, CUBIC, EAST, NORTH, Variable, variables_of
from bisar_budget.constants import MAX_DRAWS
from bisar_budget.effects.declared import CUBIC as CUBIC_PHASE
from bisar_budget.effects.declared import LOCATION, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.oscillators import clocks_without_oscillator
from bisar_budget.findings.monte_carlo import MonteCarlo, Requirement
from bisar_budget.mission.model import Mission, Simulation, has_instruments
from bisar_budget.phrases import Note
from bisar_budget.random_vector import RandomVector
from bisar_budget.sampling.draws import Drawing, HeldSum, Share, drawing_of, in_turn, joined

CONFIDENCE_LEVEL = 0.95
DOMINANT_FRACTION = 0.5  # of the variance; an error with a larger share determines the distribution of the sum
_LIMITED_BY_COLUMN = {0: QUADRATIC, 1: CUBIC_PHASE, 2: LOCATION}  # requirements by their first effect
_QUANTILE_SIGMA = 1.959963984540054  # of the standard normal at 97.5 %
_SURE_QUANTILE_SIGMA = 3.2905267314919255  # at 99.95 %, so that a warning is hardly ever due to chance
_MATERIAL_FRACTION = 0.1  # of the probability of failure; a smaller difference is not worth a warning

_SIGMA_DIGITS = 9  # of sampled sigmas; further digits differ between processors


def monte_carlo(
    analysis: Analysis,
    draws: int,
    seed: int | None = None,
    share: Share | None = None,
) -> MonteCarlo:
    """Draw the declared errors of a mission, and count how often each requirement is met.

    Parameters
    ----------
    draws : int
        Number of draws, from 1 to `MAX_DRAWS`. Memory does not grow with it.
    seed : int, optional
        Seed of the random numbers. If it is None, `simulation.seed` of the mission file is used. The same seed gives
        the same result.
    share : callable, optional
        Function that computes the pieces of the draws, for example on several workers. If it is None, this process
        computes them one after the other. The result does not depend on it.

    Raises
    ------
    ValueError
        `draws` is out of range.
    """
    if not 1 <= draws <= MAX_DRAWS:
        raise ValueError(f"the number of draws must be from 1 to {MAX_DRAWS}, not {draws}")
    mission = analysis.mission
    if seed is None:
        seed = (mission.simulation or Simulation()).seed
    variables = variables_of(analysis)
    is_set = not any(error.displaces_unknown for error in analysis.random)
    is_placed = is_set and not clocks_without_oscillator(mission)
    judged = list(_requirements(mission, analysis.allocation, variables, is_placed=is_placed))
    drawing = drawing_of(analysis, variables, judged, draws, seed)
    holds, mean_squares, all_hold = joined((tally for _, tally in (share or in_turn)(drawing)), len(judged))
    predictions = _Predictions(analysis, variables)
    requirements = tuple(
        _requirement(*counted, drawing, predictions) for counted in zip(judged, holds, mean_squares, strict=True)
    )
    low, high = _wilson(all_hold, draws, _QUANTILE_SIGMA) if judged else (None, None)
    return MonteCarlo(
        draws=draws,
        seed=seed,
        model="full",
        confidence=CONFIDENCE_LEVEL,
        requirements=requirements,
        probability=all_hold / draws if judged else None,
        probability_low=low,
        probability_high=high,
        is_exact=drawing.is_exact,
        notes=tuple(_notes(mission, analysis, variables, judged, is_exact=drawing.is_exact, is_placed=is_placed)),
    )


def _requirements(
    mission: Mission, allocation: Allocation, variables: Sequence[Variable], *, is_placed: bool
) -> Iterator[HeldSum]:
    """Yield the requirements with which draws are compared.

    These are the requirements of `check` to which declared errors contribute. `is_placed` states whether the
    displacements caused by all errors are known. If any displacement is unknown, the requirement on location error is
    left out.
    """
    # Most tones only displace the image.
    present = {v.owner for v in variables if not v.is_tone or v.affects(0) or v.hides}
    every = ("transmitter", "receiver", "clock", "mission")
    owners_by_share = {
        "transmitter": ("transmitter",),
        "receiver": ("receiver",) if allocation.qpe.clock is not None else ("receiver", "clock"),
        "clock": ("clock",) if allocation.qpe.clock is not None else (),
        "mission": every,
    }
    for owner, owners in owners_by_share.items():
        if present.intersection(owners):
            limit = allocation.qpe_allowed(owner)
            requirement = HeldSum(subject(owner, QUADRATIC).id, "rad", limit, owners, (0,), allocation.autofocus_gain)
            yield requirement.with_hidden(variables)
    cubic, location = mission.requirements.cubic_phase_error, mission.requirements.location_error
    moves = any(source.is_motion for variable in variables for source, _ in variable.parts)
    displaces = moves or any(variable.affects(EAST) or variable.affects(NORTH) for variable in variables)
    if cubic is not None and (moves or any(variable.affects(CUBIC) for variable in variables)):
        yield HeldSum("mission.cubic_phase_error", "rad", cubic, every, (1,))
    if location is not None and displaces and is_placed:
        yield HeldSum("mission.location_error", "m", location, every, (2, 3))


class _Predictions:
    """Results that are computed without draws.

    They are the combined errors as in `check`, variances, and probabilities for a normal distribution.
    """

    def __init__(self, analysis: Analysis, variables: Sequence[Variable]) -> None:
        self.together, self.totals = analysis.together("full"), Totals(analysis)
        self.variables = variables

    def combined(self, judged: HeldSum, rule: str) -> float | None:
        """Combined size of the errors that contribute to a requirement, in the unit of the requirement.

        `rule` is a rule of `allocation.combine`. The coverage factor is included. The result is None if no image is
        formed with these errors.
        """
        members = [phase for phase in self.together.phases if phase.owner in judged.owners]
        if judged.columns == (0,):
            size = self.together.judged(members, rule)
        elif judged.columns == (1,):
            size = self.together.combined(cubics(members), rule)
        else:
            size = self.together.moved(rule)
        return float(size[0]) if math.isfinite(size[0]) else None

    def variances(self, judged: HeldSum) -> dict[str, float]:
        """Variances that errors and covariances contribute to the sum that a requirement limits.

        The keys are the ids of the errors and covariances. The unit of the values is the square of the unit of the
        requirement.
        """
        by_error: dict[str, float] = {}
        for variable in self.variables:
            if variable.owner in judged.owners:
                square = float(np.trace(judged.covariance([variable])))
                by_error[variable.of] = by_error.get(variable.of, 0.0) + square
        return by_error

    def is_normal(self, name: str) -> bool:
        """Whether all variables of an error or a covariance are normally distributed.

        This is always the case for a covariance. `name` is the id of the error or covariance.
        """
        return all(v.distribution in ("normal", CONSTANT) for v in self.variables if v.of == name)

    def probability(self, judged: HeldSum) -> float:
        """Probability that the sum of the errors is within the limit, computed from their distributions.

        The effects are of first order in small errors, see `totals`. The result is 0 if an error of its declared size
        leaves no image, since its effect has no distribution then.
        """
        vector = self.totals.vector(
            "full", _LIMITED_BY_COLUMN[judged.columns[0]], judged.owners.__contains__, 0, judged.gain
        )
        return vector.probability(judged.limit) if vector.is_finite else 0.0

    def probability_normal(self, judged: HeldSum) -> float:
        """Probability that the sum of the errors is within the limit, for normally distributed errors.

        Each error has the same variance as with its declared distribution.
        """
        return RandomVector.of_covariance(judged.covariance(self.variables)).probability(judged.limit)


def _wilson(successes: int, draws: int, quantile: float) -> tuple[float, float]:
    """Confidence interval of a probability, computed as a Wilson score interval.

    `quantile` is a quantile of the standard normal distribution. The formula is also valid for a small number of
    draws, even if all draws succeed or all draws fail.
    """
    p, z = successes / draws, quantile
    middle = p + z**2 / (2 * draws)
    half = z * math.sqrt(p * (1 - p) / draws + (z / (2 * draws)) ** 2)
    low, high = (middle - half) / (1 + z**2 / draws), (middle + half) / (1 + z**2 / draws)
    return (low if successes else 0.0, high if successes < draws else 1.0)


def _requirement(
    judged: HeldSum, holds: int, mean_square: float, drawing: Drawing, predictions: _Predictions
) -> Requirement:
    draws = drawing.draws
    variances = predictions.variances(judged)
    variance = math.fsum(variances.values())
    dominant = max(variances, key=lambda name: variances[name])
    low, high = _wilson(holds, draws, _QUANTILE_SIGMA)
    requirement = Requirement(
        id=judged.id,
        unit=judged.unit,
        limit=judged.limit,
        sum=predictions.combined(judged, "sum"),
        rss=predictions.combined(judged, "rss"),
        sigma_rss=math.sqrt(variance),
        sigma=float(f"{math.sqrt(mean_square):.{_SIGMA_DIGITS}g}") if math.isfinite(mean_square) else None,
        probability=holds / draws,
        probability_low=low,
        probability_high=high,
        probability_computed=predictions.probability(judged),
        probability_normal=predictions.probability_normal(judged),
        dominant=dominant,
        dominant_share=variances[dominant] / variance if variance else 0.0,
        warnings=(),
    )
    return requirement._replace(warnings=tuple(_doubts(requirement, holds, drawing, predictions)))


def _doubts(requirement: Requirement, holds: int, drawing: Drawing, predictions: _Predictions) -> Iterator[str]:
    """Yield warnings if root-sum-square or a normal distribution is a poor description of the summed errors.

    `requirement` limits the sum of these errors. There is a warning if an error that is not normally distributed
    dominates the variance, or if the probability for a normal distribution differs clearly from the result of the
    draws. There is also a warning if draws from exact ranges differ clearly from the computed distribution, in which
    effects are proportional to errors.
    """
    # A covariance, which is no single variable, is always normal.
    if requirement.dominant_share > DOMINANT_FRACTION and not predictions.is_normal(requirement.dominant):
        yield (
            f"{requirement.dominant}, which is not normal, has {100 * requirement.dominant_share:.3g} % of the "
            "variance: the sum has its shape, and no multiple of sigma is the bound it would be of a normal "
            "distribution"
        )
    low, high = _wilson(holds, drawing.draws, _SURE_QUANTILE_SIGMA)
    computed, normal, drawn = (
        requirement.probability_computed,
        requirement.probability_normal,
        requirement.probability,
    )
    if (
        drawing.is_exact
        and not low <= computed <= high
        and abs(computed - drawn) > _MATERIAL_FRACTION * max(1 - computed, 1 - drawn)
    ):
        kind = "optimistic" if computed > drawn else "pessimistic"
        yield (
            f"the computed percentiles are {kind}: they keep the limit in {100 * computed:.4g} %, the draws in "
            f"{100 * drawn:.4g} %; the errors are so large that their effects do not add"
        )
    fails = max(1 - normal, 1 - drawn)
    if not low <= normal <= high and abs(normal - drawn) > _MATERIAL_FRACTION * fails:
        kind = "optimistic" if normal > drawn else "pessimistic"
        yield (
            f"root-sum-square is {kind}: a normal distribution would fail in {100 * (1 - normal):.3g} %, the draws "
            f"fail in {100 * (1 - drawn):.3g} %"
        )


def _notes(
    mission: Mission,
    analysis: Analysis,
    variables: Sequence[Variable],
    judged: Sequence[HeldSum],
    *,
    is_exact: bool,
    is_placed: bool,
) -> Iterator[Note]:
    """Yield notes on errors that are drawn by a convention of this program, and on errors that are not drawn."""
    if is_exact:
        yield phrases.note("drawn-through-exact-ranges")
    if mission.gating_model != "full":
        yield phrases.note("drawn-by-the-full-model", model=mission.gating_model)
    if mission.allocation.combine == "each":
        yield phrases.note("drawn-all-at-once")
    bounds = [source.id for source in analysis.stated if source.owner == "mission" and not source.is_common]
    bounds += [error.id for error in analysis.random if not error.is_covered]
    if bounds:
        yield phrases.note("drawn-as-bounds", row_ids=bounds)
    drawn = {v.of for v in variables if any(requirement.is_affected_by(v) for requirement in judged)}
    noisy = [name for name in PLATFORMS if getattr(mission.platforms, name).motion_error.vibration.wideband]
    shaken = [tone.subject.id for tone in analysis.displacing_tones if tone.subject.id not in drawn]
    shaken += [subject(name, "vibration", "wideband").id for name in noisy]
    if shaken:
        yield phrases.note("vibration-is-not-drawn", row_ids=shaken)
    powers = [power.subject.id for power in stated_powers(mission)]
    if powers:
        yield phrases.note("stated-power-is-not-drawn", row_ids=powers)
    if mission.requirements.location_error is not None and not is_placed:
        undriven = clocks_without_oscillator(mission)
        yield (
            phrases.note("unknown-drift-is-not-drawn", platforms=undriven)
            if undriven
            else phrases.note("unset-clocks-are-not-drawn")
        )
    stated = any(stated_error.islr is not None for stated_error in mission.other_errors)
    if mission.requirements.islr is not None and (stated or has_instruments(mission)):
        yield phrases.note("mean-power-is-not-drawn")
    if mission.allocation.coverage_factor != 1:
        yield phrases.note("drawn-without-coverage")
