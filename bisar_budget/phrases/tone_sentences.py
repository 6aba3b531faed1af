"""Sentences about noise, about tones of vibrations and oscillators, and about their paired echoes."""

from bisar_budget.phrases.notes import composed
from bisar_budget.phrases.templates import level_words

TONE_SENTENCES: dict[str, str] = {
    "spreads-too-much": "ISLR of {level_db:dB}, {limit_db:dB down} allowed",
    "noise-spreads-too-much": (
        "ISLR of {level_db:dB} by noise, {limit_db:dB down} allowed; largest: {row_id}, {largest_db:dB}"
    ),
    "echoes-over": "paired echoes of {level_db:dB}, {limit_db:dB down} allowed",
    "echoes-on-the-mainlobe": "{cycles:cycles} cycles per aperture: below {least:g} its echoes lie on the mainlobe",
    "tone-lies": "at {frequency:Hz}, {cells:.3g} cells from the response",
    "echo-is-folded": "interpolation between exchanges folds it to {frequency:Hz}; {reason}",
    "tone-is-folded": (
        "interpolation between exchanges folds it to {frequency:Hz}, {cycles:.3g} cycles per aperture: QPE of at "
        "most {qpe:rad} and cubic phase of {cubic:rad}, counted in {row_id}"
    ),
    "folded-spurs-count": (
        "includes spurs that exchanges fold below one cycle per aperture; `level` does not shift them"
    ),
    "spur-is-folded": "mostly its spur at {frequency:Hz}, which exchanges fold below one cycle per aperture",
}


@composed
def echoes_together_over(level_db: float, limit_db: float, row_id: str, count: int) -> str:
    """Sentence for the paired echoes of all tones together, if they exceed the limit; it names the largest tone."""
    others = f", with {count - 1} near it" if count > 1 else ""
    return f"echoes of {level_words(level_db)}, {level_words(limit_db)} allowed; largest: {row_id}{others}"
