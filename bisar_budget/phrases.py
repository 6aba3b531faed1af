"""Every sentence that a row may carry, in one place: a note is data, and its words are written here.

Those of verdicts stand in `verifier.reasons`, those of a mission file's warnings in `budget.file_warnings`.

A function writes one sentence. Its name is the note's code, its arguments are what the note is made of: numbers in SI
and radians, ids of rows, names.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from functools import wraps
from typing import ParamSpec

from bisar_budget.units import format_in, format_limit, format_quantity

P = ParamSpec("P")


class Note(str):
    """A sentence as data: `code` names it, `values` are the numbers, ids and names that it is made of."""

    __slots__ = ("code", "values")
    code: str
    values: tuple[object, ...]

    def __new__(cls, text: str, code: str = "", values: tuple[object, ...] = ()) -> "Note":
        """Attach what a sentence is made of to its words."""
        note = super().__new__(cls, text)
        note.code, note.values = code, values
        return note

    def then(self, *more: str) -> "Note":
        """Add what else there is to say, after semicolons; nothing of what is empty, and nothing to nothing."""
        if not self:
            return self
        return Note("; ".join(filter(None, (self, *more))), self.code, (*self.values, *filter(None, more)))

    def includes(self, other: "Note") -> bool:
        """Whether it is another note, by its code and its values, or has it among what it adds."""
        is_same = self.code == other.code and self.values[: len(other.values)] == other.values
        return is_same or any(isinstance(value, Note) and value.includes(other) for value in self.values)


NOTHING = Note("")
CODES: dict[str, str] = {}  # of every sentence, with what it is said of
_SCENE_AXES = {"x": "east", "y": "north", "z": "up"}
_NO_GAIN = "autofocus gain does not apply"


def phrase(sentence: Callable[P, str]) -> Callable[P, Note]:
    """Make what a function writes a note, and its name the code."""
    code = sentence.__name__.replace("_", "-")
    CODES[code] = sentence.__doc__ or ""

    @wraps(sentence)
    def written(*args: P.args, **kwargs: P.kwargs) -> Note:
        return Note(sentence(*args, **kwargs), code, (*args, *kwargs.values()))

    return written


def _size(size: float, unit: str) -> str:
    """Metres with a prefix, as everywhere; phases in radians, to be compared with π/4."""
    if not math.isfinite(size):
        return "without a value (no ground point has this range history)"
    return format_quantity(size, unit) if unit == "m" else f"{abs(size):.3g} {unit}"


def _against(size: float, limit: float, unit: str) -> str:
    return f"{_size(size, unit)}, {format_limit(limit, unit)} allowed"


def _by(text: str, equation: str) -> str:
    """A text with where it comes from, if that is said."""
    return f"{text} ({equation})" if equation else text


def _level(db: float, rounding: str = "nearest") -> str:
    return format_quantity(db, "dB", 3, rounding)


# ---------------------------------------------------------------------- how a mission stands
@phrase
def confidence(coverage_factor: float, *, has_sigma: bool, has_bounds: bool) -> str:
    """Said of a mission whose requirements are met, behind `met`."""
    covered = f"with coverage factor {coverage_factor:g}"
    if not has_sigma:
        if not has_bounds:
            return "for the stated values"
        return "for the stated bounds" if coverage_factor == 1 else f"for the stated bounds {covered}"
    sigma = "at 1 sigma" if coverage_factor == 1 else covered
    return f"{sigma} and for the stated bounds" if has_bounds else sigma


# ---------------------------------------------------------------------- how a row stands
@phrase
def over_the_limit_without_autofocus(times: float) -> str:
    """Said of a row that passes with autofocus."""
    return f"{times:.3g} times the limit without autofocus"


@phrase
def near_the_limit_with_autofocus(utilization: float) -> str:
    """Said of a row that passes with autofocus."""
    return f"uses {100 * utilization:.3g} % of the limit with autofocus"


@phrase
def above_warn_above(warn_above: float) -> str:
    """Said of a row that passes."""
    return f"above {100 * warn_above:g} % of the limit"


@phrase
def aggregate_decides(combine: str) -> str:
    """Said of a single error under a sum."""
    return f"combine is {combine}: the aggregate decides"


@phrase
def stated_along_other_axes(axes: Sequence[str]) -> str:
    """Said of rows along the scene's axes."""
    return f"the file states this error along other axes ({', '.join(axes)}): those rows decide"


@phrase
def no_specifications(why: str) -> str:
    """Said of a file that names the errors to specify, where there is no sheet of them."""
    return f"no specifications: {why}"


@phrase
def more_than_specified() -> str:
    """Said of an error that is larger than its specification."""
    return "the file declares more than is specified"


@phrase
def specified_and_not_declared(key: str) -> str:
    """Said of an error that has a specification and no size."""
    return f"{key} is specified, and the file does not declare it"


@phrase
def no_requirement() -> str:
    """Said of an aggregate that nothing is asked of."""
    return "no requirement in the file: computed, not judged"


@phrase
def no_requirement_of(metric: str) -> str:
    """Said of a vibration, or a tone."""
    return f"no requirements.{metric} in the file: computed, not judged"


_SHOWN_EFFECTS = {
    "cubic": "cubic phase of {} rad at the aperture edge",
    "spread": "phase of {} rad rms that adds to the ISLR",
    "tone": "tone of {} rad",
}
_NEEDED_DECLARATIONS = {
    "quadratic_phase_error": "has a quadratic phase (velocity, acceleration, imu, random, oscillator, timing)",
    "cubic_phase_error": "has a cubic phase (velocity, acceleration, imu, random, oscillator, timing)",
    "location_error": "displaces the image (position, velocity, time_tag, lever_arm, random, timing, propagation)",
    "pslr": "makes paired echoes (vibration.sinusoidal, oscillator.spurs, oscillator.acceleration_sensitivity)",
    "islr": "adds to the ISLR (vibration, random, oscillator, synchronization, propagation with a correlation_time)",
}


def _effect(kind: str, size: float) -> str:
    return _SHOWN_EFFECTS[kind].format(f"{size:.3g}")


@phrase
def effect_is_not_judged(kind: str, size: float, total: float, lines: Sequence[str]) -> str:
    """Said of a row with an effect that no requirement takes."""
    alone = f", {total:.3g} rad with the others" if total > 1.005 * size else ""
    added = " or ".join(f"`{line}`" for line in lines)
    return f"{_effect(kind, size)}{alone}, which no requirement judges: add {added} to requirements"


@phrase
def effect_is_negligible(kind: str, total: float, keys: Sequence[str]) -> str:
    """Said of a mission with a small effect that no requirement takes."""
    return (
        f"negligible: {_effect(kind, total)} in all, which no requirement judges ({' or '.join(keys)} would): "
        "below a tenth of the quadratic requirement and below 0.08 rad"
    )


_AIR_MAKES = {
    "quadratic_phase_error": ("have a quadratic phase of", "rad"),
    "cubic_phase_error": ("have a cubic phase of", "rad"),
    "location_error": ("move the image by another", "m"),
    "islr": ("add an ISLR of", "dB"),
}


def _air_that_stays(aperture_time: float, correlation_time: float) -> str:
    return (
        f"without correlation_time the delays of propagation are constant over {aperture_time:.4g} s; with a "
        f"correlation time of {correlation_time / 60:g} min they would"
    )


def _add_correlation_time(keys: Sequence[str]) -> str:
    return f"add {' and '.join(keys)}, 1e9 s for a constant delay"


@phrase
def air_stays(
    aperture_time: float, correlation_time: float, key: str, size: float, use: float, keys: Sequence[str]
) -> str:
    """Said of a requirement that rests on delays of the air that stay in a long aperture. [s, s, rad or m or dB]"""
    does, unit = _AIR_MAKES[key]
    shown = _level(size) if unit == "dB" else _size(size, unit)
    return (
        f"{_air_that_stays(aperture_time, correlation_time)} {does} {shown}, {100 * use:.3g} % of what is allowed: "
        f"{_add_correlation_time(keys)}"
    )


@phrase
def air_stays_untaken(
    aperture_time: float, correlation_time: float, kind: str, size: float, keys: Sequence[str], lines: Sequence[str]
) -> str:
    """Said of a delay that stays in a long aperture, where no requirement takes what it would do. [s, s, rad]"""
    added = " or ".join(f"`{line}`" for line in lines)
    return (
        f"{_air_that_stays(aperture_time, correlation_time)} have {_effect(kind, size)}, which no requirement judges:"
        f" {_add_correlation_time(keys)}, or {added} to requirements"
    )


@phrase
def air_that_stays_is_negligible(
    aperture_time: float, correlation_time: float, use: float, keys: Sequence[str]
) -> str:
    """Said of a mission with delays of the air that stay in a long aperture, where no verdict rests on it. [s, s]"""
    return (
        f"negligible: {_air_that_stays(aperture_time, correlation_time)} use {100 * use:.2g} % of a requirement at "
        f"most ({' and '.join(keys)} states how fast they change)"
    )


@phrase
def nothing_judges(key: str) -> str:
    """Said of a requirement without a row that judges it."""
    return f"no declared error {_NEEDED_DECLARATIONS[key]}"


@phrase
def clocks_are_not_set(row_ids: Sequence[str]) -> str:
    """Said of the location, beside free oscillators."""
    return (
        f"{', '.join(row_ids)}: free-running oscillators displace the image as they drift after they were set, and "
        "the file does not state how they were set; add synchronization.method holdover with age and averaging, or "
        "timing_error.constant and timing_error.linear, the residual clock error at mid-aperture"
    )


@phrase
def drift_is_not_stated(platforms: Sequence[str]) -> str:
    """Said of what rests on clocks in holdover, of which the file does not state every oscillator."""
    keys = " and ".join(f"platforms.{name}.oscillator" for name in platforms)
    return f"in holdover a clock drifts with its oscillator, whose noise the file does not state: add {keys}"


@phrase
def noise_between_pulses_is_not_stated(platforms: Sequence[str]) -> str:
    """Said of two clocks that exchange pulses, of which the file states one oscillator."""
    keys = " and ".join(f"platforms.{name}.oscillator" for name in platforms)
    return f"between exchanged pulses both clocks run free, but the file states only one oscillator: add {keys}"


@phrase
def felt_vibration_lacks(platform: str, key: str) -> str:
    """Said of an oscillator that is said to feel half of what its airframe does."""
    own = f"platforms.{platform}.oscillator.vibration"
    return f"{own} replaces the airframe's vibration, but has no {key}, which the airframe has: add {own}.{key}"


@phrase
def not_declared_as_required(key: str, lacks: str = "") -> str:
    """Said of an error that the file should declare; `lacks` is what half of it needs to have an effect."""
    if lacks:
        return f"requirements.declare asks for {key}, which is declared in part: the file has no {lacks}"
    return f"the file has no {key}, which requirements.declare asks for"


@phrase
def declarations_are_missing(keys: Sequence[str]) -> str:
    """Said of all errors that the file should declare."""
    *others, last = keys
    said = f"{', no '.join(others)} and no {last}" if others else last
    return f"the file has no {said}, which requirements.declare asks for"


@phrase
def declared_off_its_source(key: str, level: str, off: str) -> str:
    """Said of all errors that the file should declare, where a level shifts one off what its source states."""
    return f"{key}: {level} {off}"


@phrase
def input_in_doubt(doubt: float, words: str, declared: float | None, key: str) -> str:
    """Said of a position error that is less than the doubt of the platform's path. [m]"""
    stated = "no position error is declared" if declared is None else f"{_size(declared, 'm')} is declared"
    return f"the path may be {_size(doubt, 'm')} off ({words}), but {stated}: declare the error in {key}"


@dataclass(frozen=True)
class StatedError:
    """An error that the source of a path states, beside the declared one: sizes along `axes`, in a unit.

    `words` name the source, `key` is where the file would declare it. Without `axes` both are root-sum-squares.
    """

    words: str
    kind: str
    stated: Sequence[float]
    declared: Sequence[float]
    unit: str
    key: str
    is_declared: bool
    axes: Sequence[str] = ()

    @property
    def declared_words(self) -> str:
        """The declared error in a sentence."""
        if not self.is_declared:
            return f"no {self.kind} error is declared"
        return f"{_sizes(self.declared, self.unit)} is declared"


@phrase
def input_states_more(error: StatedError) -> str:
    """Said of a declared error that is less than the one which the source of the path states. [m], [m/s]"""
    within = f" ({_axes(error.axes)})" if error.axes else ""
    stated = f"a {error.kind} error of {_sizes(error.stated, error.unit)}{within} is stated"
    return f"{error.words}: {stated}, but {error.declared_words}: declare at least that in {error.key}"


@phrase
def log_leaves_too_much(phase: float, most: float, key: str) -> str:
    """Said of a log of which a smooth path leaves much, where the file does not say which one is flown. [rad]"""
    return (
        f"the residual of the smoothed log is {phase:.3g} rad rms along the line of sight, more than {most:g} rad:"
        f" state {key}: smoothed if the processor uses the smoothed path, raw if it uses the fixes"
    )


@phrase
def log_is_flown_as_it_is(figure: str) -> str:
    """Said of the rows of a log whose processor flies the fixes."""
    if figure == "grid":
        return "the log quantises its fixes: a uniform error, constant over the aperture at worst"
    return "the processor uses the fixes of the log: their residual from the smoothed path adds to the ISLR"


@phrase
def log_is_coarse(step: float, declared: float | None, axis: str, key: str) -> str:
    """Said of a log whose fixes are written to a step that is large beside the declared position error. [m]"""
    beside = "no position error is declared"
    if declared is not None:
        beside = f"more than a tenth of the declared {_size(declared, 'm')}"
    return (
        f"the log quantises its fixes in steps of {_size(step, 'm')} ({axis}), {beside}: state {key}: smoothed if the"
        " processor uses a smoothed path, raw if it uses the fixes"
    )


@phrase
def input_usually_has_more(error: StatedError) -> str:
    """Said of a declared error that is less than a third of the usual one of a log's quality. [m]"""
    return (
        f"{error.words} usually have an error of {_size(max(error.stated), error.unit)} on each axis,"
        f" but {error.declared_words}: declare at least a third of the usual error in {error.key}"
    )


def _sizes(sizes: Sequence[float], unit: str) -> str:
    """One size where all are alike, else each."""
    words = [_size(size, unit) for size in sizes]
    return words[0] if len(set(words)) == 1 else ", ".join(words)


def _axes(names: Sequence[str]) -> str:
    return ", ".join(_SCENE_AXES.get(name, name).replace("_", "-") for name in names)


# ---------------------------------------------------------------------- over the limit
SHOWN_PART = 0.99  # of a phase of equal loss, below which its quadratic part is shown beside it


@phrase
def quadratic_phase_over(phase: float, limit: float, equation: str = "", quadratic: float | None = None) -> str:
    """Said of one error, whose phase of equal loss may be more than its quadratic part. [rad]"""
    text = _by(f"QPE {_against(phase, limit, 'rad')}", equation)
    if quadratic is None or quadratic >= SHOWN_PART * phase:  # both are infinite where there is no image
        return text
    return f"{text}: quadratic phase of equal peak loss, with a quadratic part of {quadratic:.3g} rad"


@phrase
def no_image_of(allowable: float, unit: str, limit: float) -> str:
    """Said of one error that is larger than any with an image, whose phase reaches its limit before. [rad]"""
    reached = f"its QPE reaches {format_limit(limit, 'rad')} at {format_limit(allowable, unit)}"
    return f"no ground point has the range history of so large an error: {reached}"


@phrase
def cubic_phase_over(phase: float, limit: float, equation: str = "") -> str:
    """Said of one error. [rad]"""
    text = _by(f"cubic phase {_against(phase, limit, 'rad')}", equation)
    return f"{text}; {_NO_GAIN}"


@phrase
def no_gain() -> str:
    """Said of a cubic phase."""
    return _NO_GAIN


@phrase
def location_over(moved: float | None, limit: float, equation: str) -> str:
    """Said of one error; None: there is no image of it. [m]"""
    where = "beyond every ground point" if moved is None else f"by {format_quantity(moved, 'm')}"
    return f"moves the image {where}, {format_limit(limit, 'm')} allowed ({equation})"


@phrase
def beyond_the_image(end: float, unit: str) -> str:
    """Said of one error that is larger than any with an image."""
    return f"the image ends at {format_limit(end, unit)}: no ground point has the range history of a larger error"


@phrase
def aggregate_over(
    what: str, size: float, limit: float, unit: str, row_id: str, largest: float, extrapolated: str = ""
) -> str:
    """Said of errors together: how large, what is allowed, and which is the largest, with what that rests on."""
    text = f"{what} {_against(size, limit, unit)}; largest: {row_id}, {_size(abs(largest), unit)}"
    return _by(text, extrapolated)


@phrase
def one_total() -> str:
    """Said of a sum beyond the pull-in range."""
    return "autofocus corrects one total, not each error separately"


@phrase
def all_together_over(what: str, size: float, limit: float, unit: str) -> str:
    """Said of errors that are judged one by one."""
    return (
        f"each error is judged alone. Together the declared errors have a root-sum-square {what} of "
        f"{_against(size, limit, unit)}: combine: rss judges it"
    )


@phrase
def edge_over() -> str:
    """Said of the scene's edge."""
    return "quadratic phase at the scene's edge and at its centre differ by more than the total budget"


@phrase
def no_autofocus_helps(hidden: float, limit: float) -> str:
    """Said of an error whose loss is no quadratic phase that autofocus could correct. [rad]"""
    return f"autofocus does not help: the loss that it leaves is that of a QPE of {_against(hidden, limit, 'rad')}"


@phrase
def passes_from(n_pull: float) -> str:
    """Said of an error that autofocus could correct."""
    return f"passes with autofocus from n_pull {n_pull:g}"


@phrase
def beyond_autofocus(n_pull: str, allowed: str) -> str:
    """Said of an error that no autofocus corrects; rounded numbers, what allows so much before its own."""
    return f"no autofocus corrects this: N_pull would have to be {n_pull}, {allowed}"


# ---------------------------------------------------------------------- what the other model says
@phrase
def other_model_fails(model: str, size: float, limit: float, unit: str, what: str = "", equation: str = "") -> str:
    """Said of a row, or an aggregate, that the gating model passes."""
    text = f"fails by the {model} model: {what}".rstrip()
    return _by(f"{text} {_against(size, limit, unit)}", equation)


@phrase
def other_model_is_beyond(model: str, phase: float, limit: float, unit: str) -> str:
    """Said of the pull-in range."""
    return f"beyond it by the {model} model: QPE {_against(phase, limit, unit)}"


@phrase
def other_model_allows(model: str, limit: float, unit: str) -> str:
    """Said of a vibration, a tone, or a power."""
    return f"fails by the {model} model: {format_quantity(limit, unit, 3, 'down')} allowed"


@phrase
def other_model_spreads(model: str, level_db: float) -> str:
    """Said of noise."""
    return f"fails by the {model} model: ISLR of {_level(level_db)}"


@phrase
def published_model_does_not_hold(
    row_id: str, published: float | None, full: float | None, unit: str, others: int
) -> str:
    """Said of a mission that the published model judges. None: no limit; with how many other errors it fails for."""
    by_published, by_full = (
        "without limit" if size is None else format_limit(size, unit) for size in (published, full)
    )
    text = f"the published model does not hold here: for {row_id} it allows {by_published}, the full model {by_full}"
    if not others:
        return text
    more = "1 other declared error" if others == 1 else f"{others} other declared errors"
    return f"{text}; for {more} the models differ by more than 5 % too"


@phrase
def wrong_height_defocuses() -> str:
    """Why the full model fails the terrain."""
    return "a bistatic image defocuses on a wrong height"


@phrase
def position_defocuses() -> str:
    """Why the full model fails a position."""
    return "the line of sight turns, and the image displaced by a position error defocuses"


@phrase
def displacement_defocuses() -> str:
    """Why the full model fails a clock or another phase."""
    return "the displaced response has a quadratic phase of its own"


@phrase
def turning_defocuses() -> str:
    """Why the full model fails a velocity or an acceleration."""
    return "the line of sight turns, and the displaced response has a quadratic phase of its own"


# ---------------------------------------------------------------------- no limit, no value
@phrase
def no_quadratic_term_of_position() -> str:
    """Said of a position, by the published model."""
    return "no quadratic term: a position error moves the image (Table I)"


@phrase
def no_component(cause: str, axis: str) -> str:
    """Said of a velocity or an acceleration, by the published model."""
    return f"no quadratic term: the platform's {cause} has no component along {axis}"


@phrase
def no_common_component(cause: str, axis: str) -> str:
    """Said of an error that both platforms share, by the published model."""
    return f"no quadratic term: the platforms' {cause} have no component along {axis}, or cancel"


@phrase
def no_quadratic_term_of_time_tag() -> str:
    """Said of a time tag by Tables I and II: a straight path is moved along itself."""
    return "a straight path is displaced along itself: no quadratic term"


@phrase
def no_quadratic_term_of_clock(term: str) -> str:
    """Said of a clock, by the published model."""
    return f"no quadratic term: the clock's {term} term has another order (Table I row 1)"


@phrase
def no_quadratic_term_of_setting(kind: str) -> str:
    """Said of the time or the frequency that setting a clock left, by the published model."""
    return f"no quadratic term: a {kind} between the clocks moves the image (Table I row 1)"


@phrase
def aging_is_followed() -> str:
    """Said of the aging of an oscillator that a link or the direct path follows."""
    return "the clocks are synchronised: aging has no effect"


@phrase
def no_quadratic_term_of_height() -> str:
    """Said of the terrain, by the published model."""
    return "no quadratic term: in the published model a height error moves the image"


@phrase
def no_size_reaches_the_limit() -> str:
    """Said of a motion error, by the full model."""
    return "no error up to a tenth of the slant range reaches the limit"


@phrase
def no_quadratic_phase() -> str:
    """Said of a clock, by the full model."""
    return "no quadratic phase"


@phrase
def clock_is_heard() -> str:
    """Said of a clock under a direct path."""
    return "the direct path is the clock: a timing error has no effect"


@phrase
def oscillators_drop_out() -> str:
    """Said of an oscillator under a direct path."""
    return "the direct path is the receiver's clock: the transmitter's oscillator drops out"


@phrase
def no_phase_noise() -> str:
    """Said of an oscillator without any."""
    return "no phase noise"


@phrase
def across_the_line_of_sight() -> str:
    """Said of a sensor."""
    return "no component along the line of sight: no phase"


@phrase
def below_the_ionosphere(platform: str) -> str:
    """Said of the electron content on a leg that lies within the air."""
    if platform == "mission":
        return "both platforms fly below the ionosphere: no electrons on their legs"
    return f"the {platform} flies below the ionosphere: no electrons on its leg"


@phrase
def runs_along_the_ground(platform: str) -> str:
    """Said of the delay on a leg that is seen too low, and of which nothing may be stated."""
    if platform == "mission":
        return "both legs run along the ground: the delay at the zenith does not give theirs"
    return f"the leg of the {platform} runs along the ground: the delay at the zenith does not give its delay"


@phrase
def dispersion_over(phase: float, limit: float) -> str:
    """Said of the electrons of the air. [rad]"""
    return (
        f"quadratic phase at the edges of the band {_against(phase, limit, 'rad')}; autofocus corrects phase over "
        "slow time, not over the band"
    )


@phrase
def content_allowed(content: float) -> str:
    """Said of the same, of one air. [1/m²]"""
    return f"allowed with a zenith_electron_content of {format_limit(content, '1/m^2')}"


@phrase
def nothing_spreads() -> str:
    """Said of a clock's error that does nothing."""
    return "no quadratic phase, no cubic phase and no ISLR"


@phrase
def no_requirement_limits(effects: Sequence[str]) -> str:
    """Said of a sensor or a clock whose effects are not required."""
    return f"no requirement limits its {' and '.join(effects)}"


@phrase
def same_all_over_the_scene() -> str:
    """Said of the scene's edge, by the published model."""
    return "in the published model an error has the same effect all over the scene"


@phrase
def no_ground_point() -> str:
    """Said of an aggregate that has no value."""
    return "with a declared error no ground point has the recorded range history"


@phrase
def no_image() -> str:
    """Said of the scene's edge."""
    return "with a declared error no ground point has the recorded range history: no image"


@phrase
def no_image_to_place() -> str:
    """Said of the location."""
    return "with a declared error no ground point has the recorded range history: there is no image"


@phrase
def no_displacement(degrees: float) -> str:
    """Said of an image plane whose gradients are nearly parallel. [deg]"""
    return (
        f"(25) gives no displacement here: with the range held constant, range and Doppler gradients are "
        f"{degrees:.2g} deg from parallel"
    )


@phrase
def no_displacement_across(gradient: float) -> str:
    """Said of look vectors that all but cancel on the ground at mid-aperture. [m/m]"""
    return f"(25) gives no displacement here: the look vectors cancel to {gradient:.2g} on the ground at mid-aperture"


@phrase
def no_image_at_the_edge(azimuth_deg: float, why: str) -> str:
    """Said of a place of the scene's edge."""
    return f"no image at the scene's edge, azimuth {azimuth_deg:.0f} deg: {why}"


@phrase
def platform_at_the_edge(distance: float) -> str:
    """Said of a place of the scene's edge. [m]"""
    return f"a platform is within {distance:g} m of it"


@phrase
def gradients_become_parallel() -> str:
    """Said of a place of the scene's edge."""
    return "on the way there range and Doppler gradients become parallel"


# ---------------------------------------------------------------------- the scene
@phrase
def same_at_the_edge() -> str:
    """Said of a scene over which nothing changes."""
    return "the declared errors have the same quadratic phase at the edge and at the centre"


@phrase
def drift_is_open_at_the_edge(row_ids: Sequence[str]) -> str:
    """Said of the scene's edge, beside free oscillators."""
    return (
        f"{', '.join(row_ids)}: the drift of free-running oscillators since they were set is not counted: the file "
        "does not state how they were set"
    )


@phrase
def largest_at_the_edge(azimuth_deg: float, radius: float) -> str:
    """Where the scene's edge differs most."""
    return f"largest between the centre and azimuth {azimuth_deg:.0f} deg, {format_quantity(radius, 'm')} away"


@phrase
def one_correction_serves(how_far: str, total: float) -> str:
    """Within which radius one autofocus correction serves. [rad]"""
    return f"autofocus correction valid {how_far}, within the total of {format_limit(total, 'rad')}"


@phrase
def over_at_the_edge(row_id: str, phase: float, limit: float) -> str:
    """Said of an error that is inside its limit at the centre. [rad]"""
    return f"{row_id} is {phase:.3g} rad at the scene's edge, {format_limit(limit, 'rad')} allowed"


# ---------------------------------------------------------------------- what a value rests on
@phrase
def held_to_the_total(owners: str) -> str:
    """Said of an error of both platforms, or of none."""
    return f"limited by the total budget: it belongs to {owners}"


@phrase
def counted_in_another_row(row_id: str) -> str:
    """Said of a part of what an error does: the row of all of it judges."""
    return f"part of {row_id}, which includes every effect of the attitude: not counted again"


@phrase
def counted_as_one(group: str) -> str:
    """Said of a covariance in a root-sum-square."""
    return f"the errors of {group} count as one, the root of gᵀCg"


@phrase
def correlations_unused(group: str) -> str:
    """Said of a covariance in a sum."""
    return f"a sum uses no correlations: each error of {group} counts with its own sigma, all at their worst"


@phrase
def one_point_of_allan_deviation() -> str:
    """Said of an oscillator."""
    return "one point of an Allan deviation does not give the kind of noise: the worst for this aperture is assumed"


@phrase
def flicker_is_assumed() -> str:
    """Said of an oscillator."""
    return "an Allan deviation does not distinguish white from flicker phase noise: flicker is assumed"


@phrase
def allan_deviation_begins(time: float) -> str:
    """Said of an oscillator. [s]"""
    return f"the Allan deviation begins at {time:g} s; its power law is continued down to the aperture time"


@phrase
def allan_deviation_ends(time: float) -> str:
    """Said of an oscillator. [s]"""
    return f"the Allan deviation ends at {time:g} s; its power law is continued up to the aperture time"


@phrase
def mask_is_cut(bandwidth: float, last: float, beyond: float) -> str:
    """Said of an oscillator whose bandwidth ends below the last point of its mask. [Hz, Hz, rad]"""
    end, whole = (format_quantity(frequency, "Hz", 4) for frequency in (bandwidth, last))
    return (
        f"phase noise counts up to `bandwidth`, {end}; the mask extends to {whole}, with {beyond:.3g} rad rms above"
    )


@phrase
def mask_begins(frequency: float, slope: float) -> str:
    """Said of an oscillator. [Hz]"""
    return f"the mask begins at {frequency:g} Hz; below, it continues as f^(\u2212{slope:.3g})"


@phrase
def rests_on_the_continuation(platforms: Sequence[str], percent: float, least: float) -> str:
    """Said of a row that rests on noise below the first points of masks. [Hz]"""
    keys = " and ".join(f"platforms.{name}.oscillator" for name in platforms)
    return (
        f"{percent:.0f} % of its power lies below the first point of the mask of {keys}, where the noise is assumed "
        f"to continue as f^-3: a mask down to {format_quantity(least, 'Hz', 2, 'down')} would state it"
    )


@phrase
def mask_at_the_frequency_of_a_part(platform: str, frequency: str, part: str) -> str:
    """Said of phase noise that the file states without a frequency, beside a part."""
    return (
        f"platforms.{platform}.oscillator.phase_noise: states no frequency, and is assumed at {frequency}, that of "
        f"{part}: add oscillator.frequency"
    )


@phrase
def no_power_law_fits(key: str, misfit: float) -> str:
    """Said of an oscillator's Allan deviation."""
    return (
        f"{key}: no power law fits the Allan deviation; the fit is off by {100 * misfit:.3g} %: state phase_noise or "
        "power_law instead of allan_deviation"
    )


@phrase
def power_law_fits(misfit: float) -> str:
    """Said of an oscillator."""
    return f"the power law fits the Allan deviation to {100 * misfit:.2g} %"


@phrase
def noise_is_shifted(level_db: float) -> str:
    """Said of an oscillator whose noise the file shifts."""
    return f"its noise is shifted by {level_db:g} dB"


@phrase
def left_by_exchanges(interval: float) -> str:
    """Said of an oscillator. [s]"""
    return f"after synchronisation every {format_quantity(interval, 's')}"


@phrase
def points_are_sorted() -> str:
    """Said of a mask or a spectrum whose points do not rise in the file."""
    return "the points of the file are not in rising order: they are sorted"


@phrase
def setting_is_perfect(missing: Sequence[str]) -> str:
    """Said of clocks in holdover whose setting has no error in the file."""
    keys = " and ".join(f"synchronization.{one}" for one in missing)
    return f"the file has no {keys}: the clocks are assumed to be set without that error"


@phrase
def mask_ends_within_the_band(last: float, bandwidth: float) -> str:
    """Said of a mask that ends below the bandwidth beside it. [Hz]"""
    return (
        f"phase noise counts up to the mask's last point, {format_quantity(last, 'Hz')}: above it, up to the "
        f"bandwidth of {format_quantity(bandwidth, 'Hz')}, none is stated"
    )


@phrase
def left_since_setting(age: float, averaging: float) -> str:
    """Said of an oscillator in holdover. [s]"""
    return (
        f"drift since the clock was set {format_quantity(age, 's')} before mid-aperture, by a line fitted over "
        f"{format_quantity(averaging, 's')}"
    )


@phrase
def heard_twice(delay: float) -> str:
    """Said of a receiver's oscillator under a direct path. [s]"""
    return f"only its change in the {format_quantity(delay, 's')} between the direct path and the echo counts"


@phrase
def another_for_each_pulse() -> str:
    """Said of the error of a link."""
    return "the error is independent from pulse to pulse: all of it adds to the ISLR"


# ---------------------------------------------------------------------- noise and tones
@phrase
def spreads_too_much(level_db: float, limit_db: float) -> str:
    """Said of noise."""
    return f"ISLR of {_level(level_db)}, {_level(limit_db, 'down')} allowed"


@phrase
def noise_spreads_too_much(level_db: float, limit_db: float, row_id: str, largest_db: float) -> str:
    """Said of all noise together."""
    return (
        f"ISLR of {_level(level_db)} by noise, {_level(limit_db, 'down')} allowed; largest: {row_id}, "
        f"{_level(largest_db)}"
    )


@phrase
def echoes_over(level_db: float, limit_db: float) -> str:
    """Said of a tone."""
    return f"paired echoes of {_level(level_db)}, {_level(limit_db, 'down')} allowed"


@phrase
def echoes_together_over(level_db: float, limit_db: float, row_id: str, count: int) -> str:
    """Said of all tones."""
    others = f", with {count - 1} near it" if count > 1 else ""
    return f"echoes of {_level(level_db)}, {_level(limit_db)} allowed; largest: {row_id}{others}"


def cycles_below(cycles: float) -> str:
    """Number of cycles that are below a border, which three digits rounded down do not reach."""
    return format_quantity(cycles, "", 3, "down")


@phrase
def echoes_on_the_mainlobe(cycles: float, least: float) -> str:
    """Said of a slow tone."""
    return f"{cycles_below(cycles)} cycles per aperture: below {least:g} its echoes lie on the mainlobe"


@phrase
def tone_lies(frequency: float, cells: float) -> str:
    """Said of a tone. [Hz]"""
    return f"at {format_quantity(frequency, 'Hz')}, {cells:.3g} cells from the response"


@phrase
def echo_is_folded(frequency: float, reason: Note) -> str:
    """Said of an echo of a tone between exchanges, and what follows. [Hz]"""
    return f"interpolation between exchanges folds it to {format_quantity(frequency, 'Hz')}; {reason}"


@phrase
def tone_is_folded(frequency: float, cycles: float, qpe: float, cubic: float, row_id: str) -> str:
    """Said of a tone of an oscillator between exchanges. [Hz]"""
    return (
        f"interpolation between exchanges folds it to {format_quantity(frequency, 'Hz')}, {cycles:.3g} cycles per "
        f"aperture: QPE of at most {qpe:.3g} rad and cubic phase of {cubic:.3g} rad, counted in {row_id}"
    )


@phrase
def folded_spurs_count() -> str:
    """Said of the row of an oscillator."""
    return "includes spurs that exchanges fold below one cycle per aperture; `level` does not shift them"


@phrase
def spur_is_folded(frequency: float) -> str:
    """Said of the row of an oscillator, of the phases of which a spur is most. [Hz]"""
    return f"mostly its spur at {format_quantity(frequency, 'Hz')}, which exchanges fold below one cycle per aperture"


# ---------------------------------------------------------------------- vibration
@phrase
def share_of_power_over(metric: str, rule: str) -> str:
    """Said of a vibration."""
    what = "paired echoes" if metric == "pslr" else "power spread"
    return f"{what} above the platform's share of {metric.upper()} ({rule})"


@phrase
def slow_quadratic_phase_over(phase: float, limit: float) -> str:
    """Said of a vibration below a cycle per aperture. [rad]"""
    return f"QPE {phase:.3g} rad in the worst phase, {format_limit(limit, 'rad')} allowed"


@phrase
def slow_cubic_phase_over(phase: float, limit: float) -> str:
    """Said of a vibration below a cycle per aperture. [rad]"""
    return f"cubic phase {phase:.3g} rad in the worst phase, {format_limit(limit, 'rad')} allowed; {_NO_GAIN}"


@phrase
def slower_than_a_cycle(cycles: float, quadratic: float, cubic: float) -> str:
    """Said of a vibration. [rad]"""
    return (
        f"{cycles_below(cycles)} cycles per aperture: below one a vibration makes no echoes but, in its worst phase, "
        f"a quadratic phase of {quadratic:.3g} rad or a cubic phase of {cubic:.3g} rad"
    )


def _in_the_worst_phase(quadratic: float, limit: float, cubic: float, cubic_limit: float | None) -> str:
    text = (
        f"in the worst phase a quadratic phase error of {quadratic:.3g} rad, {format_limit(limit, 'rad')} allowed, "
        f"or a cubic of {cubic:.3g} rad"
    )
    return text if cubic_limit is None else f"{text}, {format_limit(cubic_limit, 'rad')} allowed"


@phrase
def slower_than_three_cycles(
    cycles: float, quadratic: float, limit: float, cubic: float, cubic_limit: float | None
) -> str:
    """Said of a vibration. [rad]"""
    return (
        f"{cycles_below(cycles)} cycles per aperture: below three there is also "
        f"{_in_the_worst_phase(quadratic, limit, cubic, cubic_limit)}; the same motion, not counted again in a sum"
    )


@phrase
def lines_together(entries: str, band: str, apart: float, amplitude: float) -> str:
    """Said of lines of one platform whose echoes add. [m]"""
    return (
        f"entries {entries}, at {band}, are at most {apart:g} cycles per aperture apart: in the worst phases their "
        f"echoes together are as high as that of one vibration of {format_quantity(amplitude, 'm')}"
    )


@phrase
def both_platforms_vibrate(other: str, apart: float, level_db: float, is_more: bool, required_db: float) -> str:
    """Said of lines of both platforms whose echoes add."""
    return (
        f"the {other} vibrates at most {apart:g} cycles per aperture from this frequency too: in the worst phases "
        f"echoes of both together are {'above ' if is_more else ''}{level_db:.1f} dB, {required_db:g} dB required"
    )


@phrase
def published_rule_is_off(margin_db: float) -> str:
    """Said of a limit of a vibration."""
    comparison = "stricter" if margin_db >= 0 else "more lenient"
    return f"the published rule is {abs(margin_db):.2f} dB {comparison} than first principles"


@phrase
def seen_of_vibration(stated: str, along: float, has_direct_path: bool) -> str:
    """Said of a vibration that the line of sight sees a part of. [m]"""
    where = "in the range less the direct path" if has_direct_path else "along the line of sight"
    return f"{stated}: {format_quantity(along, 'm')} of it {where}"


@phrase
def does_as_much_as_along_the_sight(stated: str, along: float, has_direct_path: bool) -> str:
    """Said of a slow vibration of which the line of sight sees a part, that turns. [m]"""
    where = "in the range less the direct path" if has_direct_path else "along the line of sight"
    return f"{stated}: in the worst phase equivalent to {format_quantity(along, 'm')} {where}"


# ---------------------------------------------------------------------- vibration by its spectrum, and of oscillators
@phrase
def spectrum_shakes(rms: float, level_db: float) -> str:
    """Said of the spectrum of a vibration. [m]"""
    shift = f", shifted by {level_db:g} dB" if level_db else ""
    return f"{format_quantity(rms, 'm')} rms along the line of sight{shift}, slow parts included"


@phrase
def amplitude_of_acceleration(amplitude: float) -> str:
    """Said of a vibration that is stated in g. [m]"""
    return f"an amplitude of {format_quantity(amplitude, 'm')}"


@phrase
def vibration_of_the_platform() -> str:
    """Said of an oscillator without a vibration of its own."""
    return (
        "the oscillator is assumed to feel motion_error.vibration, the part that navigation does not sense; it feels "
        "the whole vibration, which oscillator.vibration states"
    )


@phrase
def oscillator_does_not_vibrate(turns: bool) -> str:
    """Said of an oscillator whose platform has no vibration that can be converted."""
    used = "counts for the turn only" if turns else "has nothing to act on"
    return f"no sinusoidal vibration and no spectrum is stated: the acceleration sensitivity {used}"


@phrase
def wideband_has_no_spectrum(platform: str) -> str:
    """Said of an oscillator whose platform has a wideband vibration."""
    return (
        "the effect of wideband vibration on the oscillator depends on its spectrum, which an rms does not give: "
        f"state platforms.{platform}.oscillator.vibration, or motion_error.vibration.spectrum in place of wideband"
    )


@phrase
def tones_have_rows(row_id: str) -> str:
    """Said of an oscillator with vibrations that make echoes."""
    return f"sinusoidal vibrations make echoes, in rows {row_id}.0 and on"


@phrase
def shakes_an_oscillator(acceleration: float, phase: float) -> str:
    """Said of a vibration of an oscillator. [m/s², rad]"""
    return f"{format_in(acceleration, 'm/s^2', 'g')} makes a phase of {phase:.3g} rad"


@phrase
def no_acceleration() -> str:
    """Said of an oscillator that feels nothing."""
    return "no random or slow vibration and no turn, or no residual of them: no phase"


# ---------------------------------------------------------------------- images
@phrase
def autofocus_refuted(shown: str) -> str:
    """Said of a row that passes with autofocus."""
    return f"passes only with autofocus, which the image at that limit refutes: {shown}"


@phrase
def limit_refuted(limit: str, shown: str) -> str:
    """Said of a declared row, or a requirement's, whose limit an image refutes."""
    return f"inside its limit of {limit}, which images refute: {shown}"


@phrase
def optimistic_limit(shown: str) -> str:
    """Said of a limit that an image refutes."""
    return f"optimistic limit: {shown}"


@phrase
def optimistic_limit_with_autofocus(shown: str) -> str:
    """Said of a limit with autofocus that an image refutes."""
    return f"optimistic limit with autofocus: {shown}"


@phrase
def images_formed(conditions: str) -> str:
    """Said of a mission with images."""
    return f"images: {conditions}"


@phrase
def overrides_a_part(key: str, text: str, part: str) -> str:
    """Said of a figure of a part that the file replaces; of its rows and of a mission."""
    return f"{key} replaces {text} of {part}"


# ---------------------------------------------------------------------- the collection
@phrase
def orbit_errors_are_independent(platform: str, position_m: float, rate: float, velocity: float) -> str:
    """Said of the position and velocity errors of a platform in free fall. [m, rad/s, m/s]"""
    sigma, rest = format_quantity(position_m, "m"), format_quantity(velocity, "m/s")
    return (
        f"the {platform} is in free fall: a position error of {sigma} goes with a velocity error of about "
        f"{format_quantity(rate * position_m, 'm/s')} (rate of the orbit times position error); the file declares "
        f"{rest}, independent of the position, which is pessimistic; the covariance of both says more "
        "(motion_error.covariance)"
    )


@phrase
def path_curves(platform: str) -> str:
    """Said of a collection."""
    return f"the {platform}'s path is curved: the published model assumes a straight path, the full model does not"


@phrase
def sight_turns(platform: str, half_turn: float) -> str:
    """Said of a collection. [rad]"""
    return (
        f"the {platform}'s line of sight turns by ±{half_turn:.2g} rad: the published model assumes a quadratic "
        "phase, the full model does not"
    )


@phrase
def image_may_have_several_peaks(loss_db: float) -> str:
    """Said of a collection whose declared errors take much of the peak. [dB]"""
    return (
        f"{loss_db:.3g} dB by the declared errors; above 3 dB an image may have several peaks, and phase and "
        "location hold for the point with the smallest phase variance"
    )


@phrase
def direct_path_is_the_clock() -> str:
    """Said of a collection."""
    return (
        "the direct path is the clock: the full model uses ranges less the distance between the platforms, and "
        "timing errors have no effect; the published model ignores the direct path"
    )


@phrase
def keys_not_used(keys: Sequence[str]) -> str:
    """Said of a mission file."""
    return f"not used by this check: {', '.join(keys)}"


# ---------------------------------------------------------------------- draws
@phrase
def drawn_through_exact_ranges() -> str:
    """Said of Monte Carlo."""
    return "every draw uses exact ranges: the declared errors are too large for sums of their effects"


@phrase
def drawn_by_the_full_model(model: str) -> str:
    """Said of Monte Carlo."""
    return f"drawn by the full model; the rows are judged by allocation.model, {model}"


@phrase
def drawn_all_at_once() -> str:
    """Said of Monte Carlo."""
    return "a draw is the sum of all errors; the rows are judged one by one (allocation.combine: each)"


@phrase
def drawn_as_bounds(row_ids: Sequence[str]) -> str:
    """Said of Monte Carlo."""
    return f"{', '.join(row_ids)}: drawn as plus or minus the declared value, which has no distribution"


@phrase
def vibration_is_not_drawn() -> str:
    """Said of Monte Carlo."""
    return "the effects of vibrations and tones are not drawn: only check has them"


@phrase
def unknown_drift_is_not_drawn(platforms: Sequence[str]) -> str:
    """Said of Monte Carlo, of a location beside clocks in holdover without an oscillator."""
    keys = " and ".join(f"platforms.{name}.oscillator" for name in platforms)
    return f"the file does not state {keys}, by which the clocks drift: the location is not drawn"


@phrase
def hidden_phase_is_not_drawn(row_ids: Sequence[str]) -> str:
    """Said of Monte Carlo, if a narrow band or a turning line of sight hides a part of the phase of random errors."""
    return (
        f"{', '.join(row_ids)}: Monte Carlo draws the quadratic phase; only check adds the phase that a narrow band "
        "or a turning line of sight hides"
    )


@phrase
def mean_power_is_not_drawn() -> str:
    """Said of Monte Carlo."""
    return "the ISLR of sensors and clocks is a mean power: ISLR is not drawn"


@phrase
def unset_clocks_are_not_drawn() -> str:
    """Said of Monte Carlo, of a location beside free oscillators."""
    return "the file does not state how the oscillators were set: the location is not drawn"


@phrase
def drawn_without_coverage() -> str:
    """Said of Monte Carlo."""
    return "the coverage factor applies to sum and rss, not to the draws"


# ---------------------------------------------------------------------- waivers
@phrase
def waived(line: int | None, until: date, reason: str, is_expired: bool, waiver_id: str) -> str:
    """Said of a row, or a requirement, that fails."""
    place = "--set" if line is None else f"line {line}"
    return f"{'expired ' if is_expired else ''}waiver of {place} ({waiver_id}), until {until}: {reason}"


@phrase
def nothing_verified(rows: int) -> str:
    """Said of a mission of whose limits no image gave a verdict."""
    return (
        f"nothing was verified: {rows} row{'s' if rows != 1 else ''} with a limit, and no image gave a verdict on any"
    )
