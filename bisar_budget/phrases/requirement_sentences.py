"""Sentences about requirements, declarations, specifications and waivers."""

from collections.abc import Mapping, Sequence
from datetime import date

from bisar_budget.phrases.notes import composed

REQUIREMENT_SENTENCES: dict[str, str] = {
    "over-the-limit-without-autofocus": "{times:.3g} times the limit without autofocus",
    "near-the-limit-with-autofocus": "uses {utilization:percent} of the limit with autofocus",
    "above-warn-above": "above {warn_above:percent g} of the limit",
    "aggregate-decides": "combine is {combine}: the aggregate decides",
    "stated-along-other-axes": "the file states this error along other axes ({axes:list}): those rows decide",
    "no-specifications": "no specifications: {why}",
    "more-than-specified": "the file declares more than is specified",
    "specified-and-not-declared": "{key} is specified, and the file does not declare it",
    "no-requirement": "no requirement in the file: computed, not judged",
    "no-requirement-of": "no requirements.{metric} in the file: computed, not judged",
    "declared-off-its-source": "{key}: {level} {off}",
}

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


def effect_words(effect_name: str, size: float) -> str:
    """Text with the size of an effect that no requirement judges."""
    return _SHOWN_EFFECTS[effect_name].format(f"{size:.3g}")


@composed
def confidence(coverage_factor: float, *, has_sigma: bool, has_bounds: bool) -> str:
    """Text after `met` that states the confidence of a verdict: 1 sigma or coverage factor, and stated bounds."""
    return _of_sizes(coverage_factor, has_sigma=has_sigma, has_bounds=has_bounds)


@composed
def stated_confidence(confidences: Mapping[str, float], confidence_of_sizes: str) -> str:
    """Text after `met` that states the confidence of a verdict if requirements state confidences.

    `confidences` are the confidences by the names of the requirements. `confidence_of_sizes` is the confidence that
    the declared sizes give to other requirements on phases and the location; empty if there are none.
    """
    levels = set(confidences.values())
    if len(levels) == 1 and not confidence_of_sizes:
        return f"with {_percent(levels.pop())} confidence"
    stated = [f"with {_percent(level)} confidence ({name})" for name, level in confidences.items()]
    return ", ".join([*stated, *([f"else {confidence_of_sizes}"] if confidence_of_sizes else [])])


def _percent(probability: float) -> str:
    return f"{100 * probability:.8g} %"


def _of_sizes(coverage_factor: float, *, has_sigma: bool, has_bounds: bool) -> str:
    covered = f"with coverage factor {coverage_factor:g}"
    if not has_sigma:
        if not has_bounds:
            return "for the stated values"
        return "for the stated bounds" if coverage_factor == 1 else f"for the stated bounds {covered}"
    sigma = "at 1 sigma" if coverage_factor == 1 else covered
    return f"{sigma} and for the stated bounds" if has_bounds else sigma


@composed
def effect_is_not_judged(effect_name: str, size: float, total: float, lines: Sequence[str]) -> str:
    """Sentence for a row with an effect that no requirement limits.

    `size` is the effect of the row alone, and `total` the effect of all errors together. `lines` are requirements
    that would limit the effect; the sentence proposes to add any of them to the file.
    """
    alone = f", {total:.3g} rad with the others" if total > 1.005 * size else ""
    added = " or ".join(f"`{line}`" for line in lines)
    return f"{effect_words(effect_name, size)}{alone}, which no requirement judges: add {added} to requirements"


@composed
def effect_is_negligible(effect_name: str, total: float, keys: Sequence[str]) -> str:
    """Sentence for a mission with a negligible effect that no requirement limits.

    `total` is the size of the effect for all errors together. `keys` are the requirements that would limit the
    effect.
    """
    return (
        f"negligible: {effect_words(effect_name, total)} in all, which no requirement judges "
        f"({' or '.join(keys)} would): below a tenth of the quadratic requirement and below 0.08 rad"
    )


@composed
def nothing_judges(key: str) -> str:
    """Sentence for a requirement that no row judges, because no declared error has an effect that it limits."""
    return f"no declared error {_NEEDED_DECLARATIONS[key]}"


@composed
def not_declared_as_required(key: str, lacks: str = "") -> str:
    """Sentence for a required error that is not declared, or is declared only in part.

    `key` is the key of the error. If the error is declared only in part, `lacks` is the missing key.
    """
    if lacks:
        return f"requirements.declare asks for {key}, which is declared in part: the file has no {lacks}"
    return f"the file has no {key}, which requirements.declare asks for"


@composed
def declarations_are_missing(keys: Sequence[str]) -> str:
    """Sentence for a mission file that does not declare all required errors; it lists the missing errors."""
    *others, last = keys
    said = f"{', no '.join(others)} and no {last}" if others else last
    return f"the file has no {said}, which requirements.declare asks for"


@composed
def waived(line: int | None, until: date, reason: str, is_expired: bool, waiver_id: str) -> str:
    """Sentence for a failed row or requirement that a waiver covers: line, id, last day and reason of the waiver."""
    place = "--set" if line is None else f"line {line}"
    return f"{'expired ' if is_expired else ''}waiver of {place} ({waiver_id}), until {until}: {reason}"
