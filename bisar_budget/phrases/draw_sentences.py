"""Sentences about Monte Carlo draws."""

DRAW_SENTENCES: dict[str, str] = {
    "drawn-through-exact-ranges": (
        "every draw uses exact ranges: the declared errors are too large for sums of their effects"
    ),
    "drawn-by-the-full-model": "drawn by the full model; the rows are judged by allocation.model, {model}",
    "drawn-all-at-once": "a draw is the sum of all errors; the rows are judged one by one (allocation.combine: each)",
    "drawn-as-bounds": "{row_ids:list}: drawn as plus or minus the declared value, which has no distribution",
    "vibration-is-not-drawn": (
        "{row_ids:list}: not drawn, because paired echoes and spread power are in check alone"
    ),
    "stated-power-is-not-drawn": "{row_ids:list}: not drawn, since a stated power is in check alone",
    "unknown-drift-is-not-drawn": (
        "the file does not state {platforms:and platforms.*.oscillator}, by which the clocks drift: the location is "
        "not drawn"
    ),
    "mean-power-is-not-drawn": "the ISLR of sensors and clocks is a mean power: ISLR is not drawn",
    "unset-clocks-are-not-drawn": "the file does not state how the oscillators were set: the location is not drawn",
    "drawn-without-coverage": "the coverage factor applies to sum and rss, not to the draws",
}
