"""Why a limit has the verdict that it has, or none: every sentence of a verdict, in one place, as in `phrases`."""

import math
from collections.abc import Sequence

from bisar_budget.phrases import cycles_below, phrase
from bisar_budget.units import format_limit, format_quantity


# ---------------------------------------------------------------------- no verdict
@phrase
def no_image_formed(why: str) -> str:
    """Said of a limit, that no image could be formed or read there."""
    return f"no image: {why}"


@phrase
def no_image_of_a_time_series(why: str) -> str:
    """Said of a random error's limit."""
    return f"no image of a time series: {why}"


@phrase
def no_image_at_the_limit() -> str:
    """Said of a limit of the published model that leaves the point no image."""
    return "at the limit no ground point has the recorded range history: the point has no image"


@phrase
def images_are_read_over_slow_time() -> str:
    """Said of dispersion in the air, whose phase is one over the band."""
    return "images are read along slow time, and this phase is over the band: `simulate` shows its blur in range"


@phrase
def nothing_moves_the_image() -> str:
    """Said of the location requirement."""
    return "no error that moves the image is declared"


@phrase
def displacement_degenerates(why: str) -> str:
    """Said of the location requirement, where gradients are parallel."""
    return why


@phrase
def errors_move_nothing(rule: str) -> str:
    """Said of the location requirement."""
    return f"by {rule} the declared errors do not displace the image"


@phrase
def no_motion_declared() -> str:
    """Said of the cubic phase requirement."""
    return "no error with a motion is declared"


@phrase
def no_cubic_phase_declared(model: str) -> str:
    """Said of the cubic phase requirement."""
    return f"no declared error has a cubic phase by the {model} model"


@phrase
def no_quadratic_phase_declared() -> str:
    """Said of a worst-case sum."""
    return "no declared error has a quadratic phase"


@phrase
def root_sum_square_is_of_many_flights() -> str:
    """Said of a root-sum-square."""
    return "a root-sum-square describes many flights, an image shows one"


@phrase
def phase_without_motion() -> str:
    """Said of an error that is stated as a phase."""
    return "stated as a phase: there is no motion to simulate"


@phrase
def stated_by_its_effect() -> str:
    """Said of an error from elsewhere that is stated by what it does."""
    return "stated by its effect: there is no motion to simulate"


@phrase
def images_are_of_the_centre() -> str:
    """Said of the row of the scene's edge."""
    return "a difference between two points of the scene: images are formed at its centre"


@phrase
def no_spread_declared() -> str:
    """Said of an ISLR row."""
    return "no declared error adds to the ISLR"


@phrase
def no_tone_declared() -> str:
    """Said of the requirement of PSLR."""
    return "no declared error makes paired echoes"


@phrase
def lines_without_amplitude() -> str:
    """Said of lines that share a frequency."""
    return "the lines have no amplitude"


@phrase
def echoes_on_the_peak(cycles: float) -> str:
    """Said of a vibration below three cycles per aperture."""
    return f"{cycles_below(cycles)} cycles per aperture: below three the echoes lie on the mainlobe"


@phrase
def no_image_of_a_vibration(cycles: float, why: str) -> str:
    """Said of a vibration whose image cannot be formed."""
    return f"{cycles:.3g} cycles per aperture: {why}"


# ---------------------------------------------------------------------- what a verdict rests on
@phrase
def in_its_worst_phase(axes: int) -> str:
    """Said of a vibration below one cycle per aperture, and of how many axes move."""
    each = f", each of {axes} axes alone: their phases add up" if axes > 1 else ""
    return f"in the worst phase of the vibration{each}"


@phrase
def bound_by_the_cubic_phase() -> str:
    """Said of a limit that the cubic phase sets."""
    return "bound by the cubic phase"


@phrase
def image_moves(moved: float, allowed: float) -> str:
    """Said of a limit that the location requirement sets. [m]"""
    sizes = [format_quantity(size, "m", 4) for size in (moved, allowed)]
    return f"bound by the location: the image moves by {sizes[0]}, {sizes[1]} allowed"


@phrase
def places_differ(rule: str, along: float, across: float) -> str:
    """Said of a displacement by a rule and in the image. [m]"""
    sizes = [format_quantity(size, "m", 2) for size in (along, across)]
    return f"{rule} and the image differ by {sizes[0]} along x' and {sizes[1]} along y'"


@phrase
def rule_misplaces(who: str, rule: str, by_rule: Sequence[float], is_at: Sequence[float]) -> str:
    """Said of the errors that a rule places farthest from where they go. [m]"""
    return (
        f"{who}: {_placed(by_rule)} by {rule}, {_placed(is_at)} by exact ranges and image: "
        f"{rule} does not predict the displacement"
    )


def _placed(displacement: Sequence[float]) -> str:
    east, north = (format_quantity(coordinate + 0.0, "m", 4) for coordinate in displacement)
    return f"{east} east, {north} north"


@phrase
def phase_does_not_grow(phases: Sequence[tuple[float, str]]) -> str:
    """Said of a limit around which images show a phase that falls; each with its place. [rad]"""
    shown = ", ".join(f"{phase:.4g} rad{where}" for phase, where in phases)
    return f"the phase of the image does not grow with the error: {shown}"


@phrase
def smear_leaves_the_patch(part: float) -> str:
    """Said of an image that holds a part of the aperture."""
    return f"the smear leaves the patch, which holds {100 * part:.0f} % of the aperture"


@phrase
def echoes_measured(who: str, cycles: float, smear_cells: float | None, is_assumed: bool) -> str:
    """Said of a vibration: whose echoes, where, and how far they are smeared."""
    smeared = "" if smear_cells is None else f", smeared over {smear_cells:.2g} range cells"
    assumed = ", a frequency assumed: the file declares no vibration" if is_assumed else ""
    return f"echoes of {who}, at {cycles:.3g} cells from the peak{smeared}{assumed}"


@phrase
def power_of_one_platform() -> str:
    """Said of a wideband vibration."""
    return "power added by one platform alone"


@phrase
def power_of_both_platforms(common_db: float) -> str:
    """Said of wideband vibrations, with what the same motion of both adds. [dB]"""
    return f"power added by both platforms, independent; the same motion of both adds {common_db:.1f} dB"


@phrase
def sigma_of_time_series(draws: int, factor: float, images: int, bound_by: str) -> str:
    """Said of a random error's limit."""
    times = "" if factor == 1 else f" times the coverage factor {factor:g}"
    bound = f", bound by the {bound_by}" if bound_by else ""
    known = 196 / math.sqrt(2 * draws)  # of a standard deviation of normal draws
    return f"one sigma of {draws} time series, ± {known:.2g} % at 95 %{times}, {images} of them in images{bound}"


@phrase
def power_of_time_series() -> str:
    """Said of what spreads."""
    return "ISLR that time series add to the mean of their images"


@phrase
def draws_decide(draws: int, low: float, high: float) -> str:
    """Said of noise, how many draws its verdict took, and the interval of what images show. [dB]"""
    return f"{low:.2f} to {high:.2f} dB at 95 %, by {draws} draws"


@phrase
def draws_do_not_decide(draws: int, low: float, high: float) -> str:
    """Said of noise so near the border of two verdicts that as many draws as are made do not tell them apart. [dB]"""
    return f"{low:.2f} to {high:.2f} dB at 95 %, by {draws} draws: too near the border between two verdicts"


# ---------------------------------------------------------------------- autofocus
@phrase
def range_walk(cells: float, n_pull: float) -> str:
    """Said of the pull-in range: how far an error of that size walks, and up to which it stays within half a cell."""
    return f"range walk of {cells:.2g} cells; it stays within half a cell up to n_pull {n_pull:.3g}, f0/B"


@phrase
def patch_too_large(cells: float, most: int) -> str:
    """Said of an image that autofocus would need."""
    return f"autofocus needs a patch of {cells:.0f} cells, at most {most} are formed"


@phrase
def autofocus_leaves(phase: float, allowed: float) -> str:
    """Said of an image that was refocused. [rad]"""
    return f"autofocus leaves {phase:.3g} rad, {format_limit(allowed, 'rad')} allowed"
