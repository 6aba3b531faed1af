"""All sentences about rows, missions and verdicts: a table of templates, and functions for sentences with variants.

`note(code, **quantities)` fills the template that has this code. A quantity is a number (in SI units, angles in
radians), an id or a name.
"""

from bisar_budget.phrases.air_sentences import (
    AIR_SENTENCES,
    air_stays,
    air_stays_untaken,
    below_the_ionosphere,
    runs_along_the_ground,
)
from bisar_budget.phrases.draw_sentences import DRAW_SENTENCES
from bisar_budget.phrases.image_sentences import (
    IMAGE_SENTENCES,
    echoes_measured,
    in_its_worst_phase,
    phase_does_not_grow,
    rule_misplaces,
    sigma_of_time_series,
)
from bisar_budget.phrases.input_sentences import (
    INPUT_SENTENCES,
    StatedError,
    input_in_doubt,
    input_states_more,
    input_usually_has_more,
    log_is_coarse,
    log_is_flown_as_it_is,
    orbit_errors_are_independent,
)
from bisar_budget.phrases.limit_sentences import (
    LIMIT_SENTENCES,
    aggregate_over,
    cubic_phase_over,
    location_over,
    other_model_fails,
    published_model_does_not_hold,
    quadratic_phase_over,
)
from bisar_budget.phrases.navigation_sentences import NAVIGATION_SENTENCES
from bisar_budget.phrases.no_limit_sentences import NO_LIMIT_SENTENCES
from bisar_budget.phrases.notes import COMPOSED, NOTHING, Note
from bisar_budget.phrases.oscillator_sentences import OSCILLATOR_SENTENCES
from bisar_budget.phrases.requirement_sentences import (
    REQUIREMENT_SENTENCES,
    confidence,
    declarations_are_missing,
    effect_is_negligible,
    effect_is_not_judged,
    not_declared_as_required,
    nothing_judges,
    stated_confidence,
    waived,
)
from bisar_budget.phrases.scene_sentences import SCENE_SENTENCES
from bisar_budget.phrases.templates import fill
from bisar_budget.phrases.tone_sentences import TONE_SENTENCES, echoes_together_over
from bisar_budget.phrases.vibration_sentences import (
    VIBRATION_SENTENCES,
    both_platforms_vibrate,
    does_as_much_as_along_the_sight,
    oscillator_does_not_vibrate,
    published_rule_is_off,
    seen_of_vibration,
    share_of_power_over,
    slower_than_three_cycles,
    spectrum_shakes,
)
from bisar_budget.phrases.warning_sentences import (
    WARNING_SENTENCES,
    fit_changes_allowables,
    satellite_does_not_fall,
    satellite_flies_straight,
)

__all__ = (
    "NOTHING",
    "Note",
    "StatedError",
    "aggregate_over",
    "air_stays",
    "air_stays_untaken",
    "below_the_ionosphere",
    "both_platforms_vibrate",
    "confidence",
    "cubic_phase_over",
    "declarations_are_missing",
    "does_as_much_as_along_the_sight",
    "echoes_measured",
    "echoes_together_over",
    "effect_is_negligible",
    "effect_is_not_judged",
    "fit_changes_allowables",
    "in_its_worst_phase",
    "input_in_doubt",
    "input_states_more",
    "input_usually_has_more",
    "location_over",
    "log_is_coarse",
    "log_is_flown_as_it_is",
    "not_declared_as_required",
    "note",
    "nothing_judges",
    "orbit_errors_are_independent",
    "oscillator_does_not_vibrate",
    "other_model_fails",
    "phase_does_not_grow",
    "published_model_does_not_hold",
    "published_rule_is_off",
    "quadratic_phase_over",
    "rule_misplaces",
    "runs_along_the_ground",
    "satellite_does_not_fall",
    "satellite_flies_straight",
    "seen_of_vibration",
    "share_of_power_over",
    "sigma_of_time_series",
    "slower_than_three_cycles",
    "spectrum_shakes",
    "stated_confidence",
    "waived",
)

SENTENCE_TABLES = (
    AIR_SENTENCES,
    DRAW_SENTENCES,
    IMAGE_SENTENCES,
    INPUT_SENTENCES,
    LIMIT_SENTENCES,
    NAVIGATION_SENTENCES,
    NO_LIMIT_SENTENCES,
    OSCILLATOR_SENTENCES,
    REQUIREMENT_SENTENCES,
    SCENE_SENTENCES,
    TONE_SENTENCES,
    VIBRATION_SENTENCES,
    WARNING_SENTENCES,
)
TEMPLATES: dict[str, str] = {code: text for table in SENTENCE_TABLES for code, text in table.items()}
CODES: dict[str, str] = TEMPLATES | COMPOSED  # template, or docstring of the function, of every sentence


def note(code: str, /, **quantities: object) -> Note:
    """Fill the template of a code with the given quantities, and return the sentence as a note.

    Raises
    ------
    KeyError
        No template has this code, or no quantity is given for a field of the template.
    """
    return Note(fill(TEMPLATES[code], quantities), code, tuple(quantities.values()))
