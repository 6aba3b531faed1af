"""Sentences about images of errors at their limits: verdicts, and why an image or a verdict is missing."""

import math
from collections.abc import Sequence

from bisar_budget.phrases.notes import composed
from bisar_budget.units import format_quantity

IMAGE_SENTENCES: dict[str, str] = {
    "autofocus-refuted": "passes only with autofocus, which the image at that limit refutes: {shown}",
    "limit-refuted": "inside its limit of {limit}, which images refute: {shown}",
    "optimistic-limit": "optimistic limit: {shown}",
    "optimistic-limit-with-autofocus": "optimistic limit with autofocus: {shown}",
    "images-formed": "images: {conditions}",
    "nothing-verified": "nothing was verified: {rows:count row} with a limit, and no image gave a verdict on any",
    "no-image-formed": "no image: {why}",
    "no-image-of-a-time-series": "no image of a time series: {why}",
    "no-image-at-the-limit": "at the limit no ground point has the recorded range history: the point has no image",
    "images-are-read-over-slow-time": (
        "images are read along slow time, and this phase is over the band: `simulate` shows its blur in range"
    ),
    "nothing-moves-the-image": "no error that moves the image is declared",
    "displacement-degenerates": "{why}",
    "errors-move-nothing": "by {rule} the declared errors do not displace the image",
    "no-motion-declared": "no error with a motion is declared",
    "no-cubic-phase-declared": "no declared error has a cubic phase by the {model} model",
    "no-quadratic-phase-declared": "no declared error has a quadratic phase",
    "root-sum-square-is-of-many-flights": "a root-sum-square describes many flights, an image shows one",
    "phase-without-motion": "stated as a phase: there is no motion to simulate",
    "stated-by-its-effect": "stated by its effect: there is no motion to simulate",
    "images-are-of-the-centre": "a difference between two points of the scene: images are formed at its centre",
    "no-spread-declared": "no declared error adds to the ISLR",
    "no-tone-declared": "no declared error makes paired echoes",
    "lines-without-amplitude": "the lines have no amplitude",
    "echoes-on-the-peak": "{cycles:cycles} cycles per aperture: below three the echoes lie on the mainlobe",
    "no-image-of-a-vibration": "{cycles:.3g} cycles per aperture: {why}",
    "bound-by-the-cubic-phase": "bound by the cubic phase",
    "image-moves": "bound by the location: the image moves by {moved:m 4}, {allowed:m 4} allowed",
    "places-differ": "{rule} and the image differ by {along:m 2} along x' and {across:m 2} along y'",
    "smear-leaves-the-patch": "the smear leaves the patch, which holds {part:percent .0f} of the aperture",
    "power-of-one-platform": "power added by one platform alone",
    "power-of-both-platforms": (
        "power added by both platforms, independent; the same motion of both adds {common_db:.1f} dB"
    ),
    "power-of-time-series": "ISLR that time series add to the mean of their images",
    "draws-decide": "{low:.2f} to {high:.2f} dB at 95 %, by {draws} draws",
    "draws-do-not-decide": (
        "{low:.2f} to {high:.2f} dB at 95 %, by {draws} draws: too near the border between two verdicts"
    ),
    "range-walk": "range walk of {cells:.2g} cells; it stays within half a cell up to n_pull {n_pull:.3g}, f0/B",
    "patch-too-large": "autofocus needs a patch of {cells:.0f} cells, at most {most} are formed",
    "autofocus-leaves": "autofocus leaves {phase:rad}, {allowed:limit rad} allowed",
}


def _placed(displacement: Sequence[float]) -> str:
    east, north = (format_quantity(coordinate + 0.0, "m", 4) for coordinate in displacement)
    return f"{east} east, {north} north"


@composed
def in_its_worst_phase(axes: int) -> str:
    """Sentence for a vibration below one cycle per aperture, with its worst phase assumed along each axis."""
    each = f", each of {axes} axes alone: their phases add up" if axes > 1 else ""
    return f"in the worst phase of the vibration{each}"


@composed
def rule_misplaces(who: str, rule: str, by_rule: Sequence[float], is_at: Sequence[float]) -> str:
    """Sentence for several errors whose joint displacement is predicted wrongly by a rule of combination.

    `by_rule` [m] is the displacement that the rule predicts. `is_at` [m] is the displacement that follows from exact
    ranges and is seen in the image. Both have an east and a north component.
    """
    return (
        f"{who}: {_placed(by_rule)} by {rule}, {_placed(is_at)} by exact ranges and image: "
        f"{rule} does not predict the displacement"
    )


@composed
def phase_does_not_grow(phases: Sequence[tuple[float, str]]) -> str:
    """Sentence for a limit at which the phase in the image does not grow with the size of the error.

    `phases` has pairs: a phase measured in an image [rad], and a text that states the size of the error in this
    image.
    """
    shown = ", ".join(f"{phase:.4g} rad{where}" for phase, where in phases)
    return f"the phase of the image does not grow with the error: {shown}"


@composed
def echoes_measured(who: str, cycles: float, smear_cells: float | None, is_assumed: bool) -> str:
    """Sentence for paired echoes of a vibration that were measured in an image.

    `who` names the vibrating object. `cycles` is the distance of the echoes from the peak in cross-range cells, and
    `smear_cells` is their smear in range cells, or None if the sentence is not to mention it. If `is_assumed` is
    true, the file declares no vibration, and the frequency is assumed.
    """
    smeared = "" if smear_cells is None else f", smeared over {smear_cells:.2g} range cells"
    assumed = ", a frequency assumed: the file declares no vibration" if is_assumed else ""
    return f"echoes of {who}, at {cycles:.3g} cells from the peak{smeared}{assumed}"


@composed
def sigma_of_time_series(draws: int, factor: float, images: int, bound_by: str) -> str:
    """Sentence for an image verdict on a random error that is simulated by time series.

    It states the number `draws` of simulated time series, and the uncertainty of the standard deviation that is
    computed from them. `factor` is the coverage factor, and `images` the number of time series for which images are
    formed. `bound_by` names the effect that limits the error; it may be empty.
    """
    times = "" if factor == 1 else f" times the coverage factor {factor:g}"
    bound = f", bound by the {bound_by}" if bound_by else ""
    known = 196 / math.sqrt(2 * draws)  # of a standard deviation of normal draws
    return f"one sigma of {draws} time series, ± {known:.2g} % at 95 %{times}, {images} of them in images{bound}"
