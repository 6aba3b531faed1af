"""How the full model comes to its phases and allowables: exact ranges over the aperture, node by node.

What an error leaves of the range history at the displaced point is listed at the nodes of the fit, with the weights
of the fit: every phase is a sum that a reader can repeat.
"""

import math
from collections.abc import Iterator, Sequence

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import ROUNDING
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.geometry import GroundVector
from bisar_budget.ranges.exact_ranges import ExactRanges
from bisar_budget.report.explain.formulas import Step, Sum, number, step, with_unit

RATES = ("m", "m/s", "m/s²", "m/s³")  # units of the range error's coefficients
_, _, _QUADRATIC, _CUBIC = range(4)  # rows of a fit
_ALIKE = 1e-6  # of a phase: by less, rounding decides which sign leaves more


class Left:
    """The range error that an error of a signed size leaves at the point that it moves the scene centre to."""

    def __init__(self, analysis: Analysis, source: ErrorSource, size: float) -> None:
        full = analysis.full
        self.exact: ExactRanges = analysis.exact
        self.wavelength, self.size = analysis.mission.radar.wavelength, size
        self.place: GroundVector | None = full.displacement(source.full, size)
        self.is_small = not source.is_motion or full.is_small(source, abs(size))
        if self.is_small:
            self.ranges = full.left_over_small(source, size)
            return
        found = full.at(source, size)
        if found is None:
            self.place, self.ranges = None, []
            return
        whole = abs(size) * full.largest_range_error(source) + math.hypot(*found.displacement)
        east, north = _without_rounding(found.displacement, whole)
        self.place = (east, north)
        self.ranges = _without_rounding(full.left_over(source, size, found.displacement), whole)

    def phase(self, which: int) -> float:
        """Quadratic or cubic phase at the aperture edge, signed. [rad]"""
        weights = self.exact.fit[which].tolist()
        return float(self.exact.k[0]) * math.fsum(w * m for w, m in zip(weights, self.ranges, strict=True))

    def sum(self, symbol: str, which: int) -> Sum:
        """The sum that gives a phase."""
        terms = " + ".join(
            f"{number(w)}*{number(m)}" for w, m in zip(self.exact.fit[which].tolist(), self.ranges, strict=True)
        )
        return Sum(f"{symbol} = 2*π/{number(self.wavelength)}*({terms}) = {with_unit(self.phase(which), 'rad')}")


def _without_rounding(values: Sequence[float], whole: float) -> list[float]:
    """Values with 0 for what rounding leaves of differences of a size."""
    return [value if abs(value) > ROUNDING * whole else 0.0 for value in values]


def worse(analysis: Analysis, source: ErrorSource, size: float, which: int = _QUADRATIC) -> Left:
    """The range error that is left by the sign that leaves more."""
    signs = [Left(analysis, source, signed) for signed in (size, -size)]
    if signs[0].is_small or not signs[1].ranges:
        return signs[0]
    stated, other = (abs(left.phase(which)) if left.ranges else math.inf for left in signs)
    return signs[other > stated * (1 + _ALIKE)]


def full_chain(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """From a signed error to its phases by the full model.

    Parameters
    ----------
    analysis : Analysis
        Of the mission.
    source : ErrorSource
        The error.
    size : float
        With its sign; of what is not declared, one unit. [unit]
    each : str
        Said of what is not declared.
    """
    each = each.replace(" of ", ", for ")
    if analysis.errors.is_heard_out(source):
        yield from step(f"Full model{each}: {analysis.full.no_limit(source)}")
        return
    left = worse(analysis, source, size)
    if not left.ranges:
        yield from step(f"Full model{each}: no ground point has the range history that this error leaves")
        return
    sign = "" if left.is_small or left.size == size else ", with the other sign, which leaves more"
    yield from step(
        f"Full model{each}{sign}: the ground point at which nothing is left of P₀ and P₁ over the aperture",
        *_placed(left),
    )
    times = analysis.exact.times[:, 0].tolist()
    yield from step(
        f"Range error left there, {_left_of(analysis.exact)}, at the nodes of the fit",
        *(f"{time:+.6g} s: {metres:.6g} m" for time, metres in zip(times, left.ranges, strict=True)),
    )
    yield from step(
        "Quadratic phase at the aperture edge, 3/2 of P₂: weights of the fit times what is left",
        left.sum("QPE_full", _QUADRATIC),
    )
    if source.is_motion and analysis.mission.requirements.cubic_phase_error is not None:
        by_cubic = worse(analysis, source, size, _CUBIC)
        yield from step("Cubic phase there, 5/2 of P₃", by_cubic.sum("cubic_full", _CUBIC))


def _left_of(exact: ExactRanges) -> str:
    if exact.has_direct_path:  # which is the clock
        return "|r_t| + |r_r| − |r_t − r_r| − (|r̂_t − x̂| + |r̂_r − x̂| − |r̂_t − r̂_r|)"
    return "|r_t| + |r_r| + c·t̃ − |r̂_t − x̂| − |r̂_r − x̂|"


def for_comparison(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """The result of the full model for an error that the published one judges."""
    left = worse(analysis, source, size)
    if not left.ranges:
        yield from step(f"Full model{each}, for comparison: no ground point has the range history")
        return
    yield from step(
        f"Full model{each}, for comparison: weights of the fit times the range error left (--model full lists it)",
        left.sum("QPE_full", _QUADRATIC),
    )


def at_the_allowable(
    analysis: Analysis, source: ErrorSource, allowable: float, requirement: str = QUADRATIC
) -> Iterator[Step]:
    """Show that an allowable that was searched for is at its limit."""
    sizes = [Left(analysis, source, signed) for signed in (allowable, -allowable)]
    if not all(left.ranges for left in sizes):
        return
    if requirement == LOCATION:
        left = max(sizes, key=lambda one: math.hypot(*(one.place or (0.0, 0.0))))
        x, y = left.place or (0.0, 0.0)
        moved = Sum(f"moved = sqrt({number(x)}^2 + {number(y)}^2) = {with_unit(math.hypot(x, y), 'm')}")
    else:
        which, symbol = (_CUBIC, "cubic_there") if requirement == CUBIC else (_QUADRATIC, "QPE_there")
        left = max(sizes, key=lambda one: abs(one.phase(which)))
        moved = left.sum(symbol, which)
    size = f"{number(left.size)} {source.unit.replace('^2', '²')}"
    yield from step(f"At {size}, the smallest size of either sign that reaches the limit, exact ranges give", moved)


def end_of_the_image(size: float, unit: str) -> Iterator[Step]:
    """Say what it means that an image ends."""
    yield from step(
        "End of the image: no ground point has the range history of a larger error, of one sign or the other",
        "The point is followed as the error grows, to where range and Doppler gradients become parallel there",
        f"by_image = {with_unit(size, unit)}, a limit whatever phase or displacement is allowed",
    )


def _placed(left: Left) -> Sequence[str]:
    if left.place is None or left.place == (0.0, 0.0):
        return ("the scene centre itself",)
    east, north = left.place
    return (f"x̂ = {with_unit(east, 'm')} east", f"ŷ = {with_unit(north, 'm')} north")
