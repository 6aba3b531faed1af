"""Sentences about delays in the air."""

from collections.abc import Sequence

from bisar_budget.phrases.notes import composed
from bisar_budget.phrases.requirement_sentences import effect_words
from bisar_budget.phrases.templates import level_words, size_words

AIR_SENTENCES: dict[str, str] = {
    "air-that-stays-is-negligible": (
        "negligible: without correlation_time the delays of propagation are constant over {aperture_time:.4g} s; "
        "with a correlation time of {correlation_time:min} they would use {use:percent .2g} of a requirement at "
        "most ({keys:and} states how fast they change)"
    ),
    "dispersion-over": (
        "quadratic phase at the edges of the band {phase:size rad}, {limit:limit rad} allowed; autofocus corrects "
        "phase over slow time, not over the band"
    ),
    "content-allowed": "allowed with a zenith_electron_content of {content:limit 1/m^2}",
}

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


@composed
def air_stays(
    aperture_time: float, correlation_time: float, key: str, size: float, use: float, keys: Sequence[str]
) -> str:
    """Sentence for a verdict that assumes constant atmospheric delays, although the aperture is long.

    `aperture_time` and `correlation_time` are in s. `size` is the effect that changing delays would have, in rad, m
    or dB. `key` is the requirement that limits this effect. `use` is `size` as a fraction of the allowed value.
    `keys` are the keys to add to the file.
    """
    does, unit = _AIR_MAKES[key]
    shown = level_words(size) if unit == "dB" else size_words(size, unit)
    return (
        f"{_air_that_stays(aperture_time, correlation_time)} {does} {shown}, {100 * use:.3g} % of what is allowed: "
        f"{_add_correlation_time(keys)}"
    )


@composed
def air_stays_untaken(
    aperture_time: float,
    correlation_time: float,
    effect_name: str,
    size: float,
    keys: Sequence[str],
    lines: Sequence[str],
) -> str:
    """Sentence for atmospheric delays assumed constant over a long aperture, if no requirement limits their changes.

    `aperture_time` and `correlation_time` are in s. `size` is the effect that changing delays would have, in the unit
    of the effect. The sentence proposes to add either `keys` to the file, or a requirement from `lines`.
    """
    added = " or ".join(f"`{line}`" for line in lines)
    return (
        f"{_air_that_stays(aperture_time, correlation_time)} have {effect_words(effect_name, size)}, which no "
        f"requirement judges: {_add_correlation_time(keys)}, or {added} to requirements"
    )


@composed
def below_the_ionosphere(platform: str) -> str:
    """Sentence for a platform below the ionosphere; the electron content does not delay its signal."""
    if platform == "mission":
        return "both platforms fly below the ionosphere: no electrons on their legs"
    return f"the {platform} flies below the ionosphere: no electrons on its leg"


@composed
def runs_along_the_ground(platform: str) -> str:
    """Sentence for a signal path at such a low elevation that its delay cannot be computed from the zenith delay."""
    if platform == "mission":
        return "both legs run along the ground: the delay at the zenith does not give theirs"
    return f"the leg of the {platform} runs along the ground: the delay at the zenith does not give its delay"
