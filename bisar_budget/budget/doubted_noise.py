"""Detection of doubtful oscillator noise. Rows that depend on such noise are not evaluated.

There are two reasons for doubt. First, the file may name a catalogue part and replace its phase-noise mask without
giving the carrier frequency of the new mask. The mask is then assumed to apply at the carrier frequency of the part.
If it applied at another carrier frequency, the noise would be different. Second, a power law may fit an Allan
deviation so badly that it does not describe the oscillator. If doubtful noise uses more than a tenth of a limit, the
row with this limit is not evaluated, unless it fails anyway.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bisar_budget import phrases
from bisar_budget.arrays import PerCase, PerCaseFlag
from bisar_budget.budget.continued_masks import MIN_USE_FRACTION, Part, part_of
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.oscillators import POOR_FIT_FRACTION, noise_of
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note


def rests_on_doubted_noise(
    errors: Iterable[RandomError], effect_kind: Part, model: str, limit: PerCase
) -> PerCaseFlag:
    """Decide whether doubtful noise uses more than a tenth of a limit, as a Boolean or an array (cases,).

    `effect_kind` names the kind of effect, such as `quadratic`, and `model` is `published` or `full`. The effects of
    all oscillators with doubtful noise are combined as a root-sum-square. `limit` is in the unit of the effect.
    """
    power: PerCase = 0.0
    for error in errors:
        if error.declared is not None and np.any(error.is_in_doubt):
            size = part_of(error.effect(model), effect_kind) * np.asarray(error.declared)
            power = power + np.where(error.is_in_doubt, np.nan_to_num(np.square(size)), 0.0)
    with np.errstate(all="ignore"):
        return np.sqrt(power) > MIN_USE_FRACTION * np.asarray(limit)


def has_doubted_frequency(mission: Mission, platform: str) -> bool:
    """Whether the carrier frequency to which the spurs of an oscillator refer is doubtful.

    This is so if the oscillator has spurs, and the file replaces the noise of a catalogue part by a mask without a
    carrier frequency. The spurs are then assumed to be stated at the carrier frequency of the part.
    """
    oscillator = getattr(mission.platforms, platform).oscillator
    return oscillator is not None and bool(oscillator.spurs) and oscillator.mask_at_frequency_of_part is not None


def doubted_noise_note(mission: Mission, platforms: Sequence[str] = PLATFORMS) -> Note:
    """Write a note on why the noise of oscillators is doubtful; the note is empty if no noise is doubtful.

    The note names the keys that cause the doubt, and the entries that should replace them.
    """
    notes = [note for name in platforms for _, note in noise_doubts(mission, name)]
    return notes[0].then(*notes[1:]) if notes else NOTHING


def noise_doubts(mission: Mission, platform: str) -> Iterator[tuple[str, Note]]:
    """Yield each key that makes the noise of an oscillator doubtful, with a sentence that explains the doubt."""
    oscillator = getattr(mission.platforms, platform).oscillator
    if oscillator is None:
        return
    replaced = oscillator.mask_at_frequency_of_part
    if replaced is not None:
        sentence = phrases.note(
            "mask-at-the-frequency-of-a-part", platform=platform, frequency=replaced.frequency, part=replaced.part
        )
        yield replaced.figure, sentence
    if oscillator.allan_deviation is not None:
        misfit = noise_of(oscillator, mission.radar.center_frequency, mission.collection.aperture_time).misfit
        if misfit > POOR_FIT_FRACTION:
            key = f"platforms.{platform}.oscillator"
            yield (
                ("allan_deviation" if oscillator.sensor is None else "sensor"),
                phrases.note("no-power-law-fits", key=key, misfit=misfit),
            )
