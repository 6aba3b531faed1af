"""Sentences about the inputs of a mission: platform paths, flight logs, catalogue parts, unused keys."""

from collections.abc import Sequence
from dataclasses import dataclass

from bisar_budget.phrases.notes import composed
from bisar_budget.phrases.templates import size_words
from bisar_budget.units import format_quantity

INPUT_SENTENCES: dict[str, str] = {
    "log-leaves-too-much": (
        "the residual of the smoothed log is {phase:rad} rms along the line of sight, more than {most:g} rad: state "
        "{key}: smoothed if the processor uses the smoothed path, raw if it uses the fixes"
    ),
    "overrides-a-part": "{key} replaces {text} of {part}",
    "keys-not-used": "not used by this check: {keys:list}",
}

_SCENE_AXES = {"x": "east", "y": "north", "z": "up"}


@dataclass(frozen=True)
class StatedError:
    """An error that the source of a path states, together with the error that the file declares.

    `stated` and `declared` are the sizes of the two errors in `unit`, with one size for each axis in `axes`. If there
    are no `axes`, each error has a single size, a root-sum-square. `words` names the source of the path. `key` is the
    key of the mission file for the declared error.
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
        """Text with the sizes of the declared error, or with the remark that no error is declared."""
        if not self.is_declared:
            return f"no {self.kind} error is declared"
        return f"{_sizes(self.declared, self.unit)} is declared"


def _sizes(sizes: Sequence[float], unit: str) -> str:
    """Text with the sizes of an error along its axes, in `unit`; a single size if all are equal."""
    words = [size_words(size, unit) for size in sizes]
    return words[0] if len(set(words)) == 1 else ", ".join(words)


def _axes(names: Sequence[str]) -> str:
    return ", ".join(_SCENE_AXES.get(name, name).replace("_", "-") for name in names)


@composed
def input_in_doubt(doubt: float, words: str, declared: float | None, key: str) -> str:
    """Sentence for a declared position error that is smaller than the possible error of the platform's path.

    `doubt` is the possible error of the path [m]. `declared` is the declared position error [m], or None if no error
    is declared.
    """
    stated = "no position error is declared" if declared is None else f"{size_words(declared, 'm')} is declared"
    return f"the path may be {size_words(doubt, 'm')} off ({words}), but {stated}: declare the error in {key}"


@composed
def input_states_more(error: StatedError) -> str:
    """Sentence for a declared error that is smaller than the error stated by the source of the platform path."""
    within = f" ({_axes(error.axes)})" if error.axes else ""
    stated = f"a {error.kind} error of {_sizes(error.stated, error.unit)}{within} is stated"
    return f"{error.words}: {stated}, but {error.declared_words}: declare at least that in {error.key}"


@composed
def log_is_flown_as_it_is(figure: str) -> str:
    """Sentence for a row about a flight log whose fixes the processor uses without smoothing.

    If `figure` is `grid`, the row is about the rounding of the fixes. Otherwise it is about the residual of the fixes
    from a smooth path.
    """
    if figure == "grid":
        return "the log quantises its fixes: a uniform error, constant over the aperture at worst"
    return "the processor uses the fixes of the log: their residual from the smoothed path adds to the ISLR"


@composed
def log_is_coarse(step: float, declared: float | None, axis: str, key: str) -> str:
    """Sentence for a flight log whose rounding step is large compared with the declared position error.

    `step` is the rounding step along `axis` [m], and `declared` the declared error [m], or None if no error is
    declared.
    """
    beside = "no position error is declared"
    if declared is not None:
        beside = f"more than a tenth of the declared {size_words(declared, 'm')}"
    return (
        f"the log quantises its fixes in steps of {size_words(step, 'm')} ({axis}), {beside}: state {key}: smoothed "
        "if the processor uses a smoothed path, raw if it uses the fixes"
    )


@composed
def input_usually_has_more(error: StatedError) -> str:
    """Sentence for a flight log whose declared error is less than a third of the usual error of such logs."""
    return (
        f"{error.words} usually have an error of {size_words(max(error.stated), error.unit)} on each axis,"
        f" but {error.declared_words}: declare at least a third of the usual error in {error.key}"
    )


@composed
def orbit_errors_are_independent(platform: str, position_m: float, rate: float, velocity: float) -> str:
    """Sentence for a platform in free fall whose position and velocity errors are declared as independent.

    `position_m` [m] and `velocity` [m/s] are the declared errors. `rate` is the angular rate of the orbit [rad/s].
    """
    sigma, rest = format_quantity(position_m, "m"), format_quantity(velocity, "m/s")
    return (
        f"the {platform} is in free fall: a position error of {sigma} goes with a velocity error of about "
        f"{format_quantity(rate * position_m, 'm/s')} (rate of the orbit times position error); the file declares "
        f"{rest}, independent of the position, which is pessimistic; the covariance of both says more "
        "(motion_error.covariance)"
    )
