"""Sentences about vibrations of platforms and of oscillators."""

from bisar_budget.phrases.notes import composed
from bisar_budget.phrases.templates import cycles_words
from bisar_budget.units import format_limit, format_quantity

VIBRATION_SENTENCES: dict[str, str] = {
    "felt-vibration-lacks": (
        "platforms.{platform}.oscillator.vibration replaces the airframe's vibration, but has no {key}, which the "
        "airframe has: add platforms.{platform}.oscillator.vibration.{key}"
    ),
    "slow-quadratic-phase-over": "QPE {phase:rad} in the worst phase, {limit:limit rad} allowed",
    "slow-cubic-phase-over": (
        "cubic phase {phase:rad} in the worst phase, {limit:limit rad} allowed; autofocus gain does not apply"
    ),
    "slower-than-a-cycle": (
        "{cycles:cycles} cycles per aperture: below one a vibration makes no echoes but, in its worst phase, a "
        "quadratic phase of {quadratic:rad} or a cubic phase of {cubic:rad}"
    ),
    "lines-together": (
        "entries {entries}, at {band}, are at most {apart:g} cycles per aperture apart: in the worst phases their "
        "echoes together are as high as that of one vibration of {amplitude:m}"
    ),
    "amplitude-of-acceleration": "an amplitude of {amplitude:m}",
    "vibration-of-the-platform": (
        "the oscillator is assumed to feel motion_error.vibration, the part that navigation does not sense; it "
        "feels the whole vibration, which oscillator.vibration states"
    ),
    "wideband-has-no-spectrum": (
        "the effect of wideband vibration on the oscillator depends on its spectrum, which an rms does not give: "
        "state platforms.{platform}.oscillator.vibration, or motion_error.vibration.spectrum in place of wideband"
    ),
    "tones-have-rows": "sinusoidal vibrations make echoes, in rows {row_id}.0 and on",
    "shakes-an-oscillator": "{acceleration:m/s^2 as g} makes a phase of {phase:rad}",
    "no-acceleration": "no random or slow vibration and no turn, or no residual of them: no phase",
}


def _in_the_worst_phase(quadratic: float, limit: float, cubic: float, cubic_limit: float | None) -> str:
    text = (
        f"in the worst phase a quadratic phase error of {quadratic:.3g} rad, {format_limit(limit, 'rad')} allowed, "
        f"or a cubic of {cubic:.3g} rad"
    )
    return text if cubic_limit is None else f"{text}, {format_limit(cubic_limit, 'rad')} allowed"


@composed
def share_of_power_over(metric: str, rule: str) -> str:
    """Sentence for a vibration whose echoes or spread power exceed the platform's share of PSLR or ISLR."""
    what = "paired echoes" if metric == "pslr" else "power spread"
    return f"{what} above the platform's share of {metric.upper()} ({rule})"


@composed
def slower_than_three_cycles(
    cycles: float, quadratic: float, limit: float, cubic: float, cubic_limit: float | None
) -> str:
    """Sentence for a vibration below three cycles per aperture: its worst-case phases and their limits, in rad."""
    return (
        f"{cycles_words(cycles)} cycles per aperture: below three there is also "
        f"{_in_the_worst_phase(quadratic, limit, cubic, cubic_limit)}; the same motion, not counted again in a sum"
    )


@composed
def both_platforms_vibrate(other: str, apart: float, level_db: float, is_more: bool, required_db: float) -> str:
    """Sentence for vibrations of both platforms at nearly the same frequency, whose paired echoes add."""
    return (
        f"the {other} vibrates at most {apart:g} cycles per aperture from this frequency too: in the worst phases "
        f"echoes of both together are {'above ' if is_more else ''}{level_db:.1f} dB, {required_db:g} dB required"
    )


@composed
def published_rule_is_off(margin_db: float) -> str:
    """Sentence for a vibration whose published limit differs from the limit from first principles.

    `margin_db` is the difference in dB, positive if the published limit is stricter.
    """
    comparison = "stricter" if margin_db >= 0 else "more lenient"
    return f"the published rule is {abs(margin_db):.2f} dB {comparison} than first principles"


@composed
def seen_of_vibration(stated: str, along: float, has_direct_path: bool) -> str:
    """Sentence for a vibration whose effect on the range is limited to its component along the line of sight.

    `stated` is the vibration as stated in the file, as text. `along` [m] is its component along the line of sight. If
    the receiver uses the direct path as its clock, `along` [m] is the change that the vibration causes in the
    difference between the range and the direct path.
    """
    where = "in the range less the direct path" if has_direct_path else "along the line of sight"
    return f"{stated}: {format_quantity(along, 'm')} of it {where}"


@composed
def does_as_much_as_along_the_sight(stated: str, along: float, has_direct_path: bool) -> str:
    """Sentence for a slow vibration along several axes, with its equivalent amplitude along the line of sight.

    `stated` is the vibration as stated in the file, as text. `along` [m] is the equivalent amplitude. If the receiver
    uses the direct path as its clock, `along` [m] is the equivalent amplitude of the difference between the range and
    the direct path.
    """
    where = "in the range less the direct path" if has_direct_path else "along the line of sight"
    return f"{stated}: in the worst phase equivalent to {format_quantity(along, 'm')} {where}"


@composed
def spectrum_shakes(rms: float, level_db: float) -> str:
    """Sentence for a vibration stated as a spectrum.

    `rms` [m] is the rms value of the vibration along the line of sight, and `level_db` [dB] is the amount by which
    the spectrum is shifted.
    """
    shift = f", shifted by {level_db:g} dB" if level_db else ""
    return f"{format_quantity(rms, 'm')} rms along the line of sight{shift}, slow parts included"


@composed
def oscillator_does_not_vibrate(turns: bool) -> str:
    """Sentence for an oscillator on a platform for which the file states no vibration, neither lines nor spectrum.

    If `turns` is true, the platform turns, and only the acceleration of its turn acts on the oscillator.
    """
    used = "counts for the turn only" if turns else "has nothing to act on"
    return f"no sinusoidal vibration and no spectrum is stated: the acceleration sensitivity {used}"
