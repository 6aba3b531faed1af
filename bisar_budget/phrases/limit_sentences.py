"""Sentences about limits that are exceeded according to a model, and about the rules for limits."""

from bisar_budget.phrases.notes import composed
from bisar_budget.phrases.templates import in_brackets, over_words, size_words
from bisar_budget.units import format_limit, format_quantity

LIMIT_SENTENCES: dict[str, str] = {
    "no-image-of": (
        "no ground point has the range history of so large an error: its QPE reaches {limit:limit rad} at "
        "{allowable:limit {unit}}"
    ),
    "no-gain": "autofocus gain does not apply",
    "beyond-the-image": (
        "the image ends at {end:limit {unit}}: no ground point has the range history of a larger error"
    ),
    "one-total": "autofocus corrects one total, not each error separately",
    "all-together-over": (
        "each error is judged alone. Together the declared errors have a root-sum-square {what} of "
        "{size:size {unit}}, {limit:limit {unit}} allowed: combine: rss judges it"
    ),
    "edge-over": "quadratic phase at the scene's edge and at its centre differ by more than the total budget",
    "no-autofocus-helps": (
        "autofocus does not help: the loss that it leaves is that of a QPE of {hidden:size rad}, {limit:limit rad} "
        "allowed"
    ),
    "passes-from": "passes with autofocus from n_pull {n_pull:g}",
    "beyond-autofocus": "no autofocus corrects this: N_pull would have to be {n_pull}, {allowed}",
    "other-model-is-beyond": "beyond it by the {model} model: QPE {phase:size {unit}}, {limit:limit {unit}} allowed",
    "other-model-allows": "fails by the {model} model: {limit:limit {unit}} allowed",
    "other-model-spreads": "fails by the {model} model: ISLR of {level_db:dB}",
    "wrong-height-defocuses": "a bistatic image defocuses on a wrong height",
    "position-defocuses": "the line of sight turns, and the image displaced by a position error defocuses",
    "displacement-defocuses": "the displaced response has a quadratic phase of its own",
    "turning-defocuses": "the line of sight turns, and the displaced response has a quadratic phase of its own",
    "held-to-the-total": "limited by the total budget: it belongs to {owners}",
    "counted-in-another-row": "part of {row_id}, which includes every effect of the attitude: not counted again",
    "counted-as-one": "the errors of {group} count as one, the root of gᵀCg",
    "correlations-unused": (
        "a sum uses no correlations: each error of {group} counts with its own sigma, all at their worst"
    ),
}

_SHOWN_PART_FRACTION = 0.99  # of a phase of equal loss, below which its quadratic part is shown beside it


@composed
def quadratic_phase_over(phase: float, limit: float, equation: str = "", quadratic: float | None = None) -> str:
    """Sentence for one error whose quadratic phase exceeds its limit.

    `phase` [rad] is the quadratic phase of the error. If the error also has a hidden phase (see
    `ranges.exact_ranges`), `phase` is the quadratic phase that would cause the same peak loss as both together, and
    `quadratic` [rad] is the actual quadratic phase.
    """
    text = in_brackets(f"QPE {over_words(phase, limit, 'rad')}", equation)
    if quadratic is None or quadratic >= _SHOWN_PART_FRACTION * phase:  # both are infinite where there is no image
        return text
    return f"{text}: quadratic phase of equal peak loss, with a quadratic part of {quadratic:.3g} rad"


@composed
def cubic_phase_over(phase: float, limit: float, equation: str = "") -> str:
    """Sentence for one error whose cubic phase `phase` exceeds `limit`, both in rad."""
    text = in_brackets(f"cubic phase {over_words(phase, limit, 'rad')}", equation)
    return f"{text}; autofocus gain does not apply"


@composed
def location_over(moved: float | None, limit: float, equation: str) -> str:
    """Sentence for one error that displaces the image by more than `limit` [m].

    `moved` is the displacement [m], or None if no image point exists.
    """
    where = "beyond every ground point" if moved is None else f"by {format_quantity(moved, 'm')}"
    return f"moves the image {where}, {format_limit(limit, 'm')} allowed ({equation})"


@composed
def aggregate_over(
    what: str, size: float, limit: float, unit: str, row_id: str, largest: float, extrapolated: str = ""
) -> str:
    """Sentence for a total of several errors that exceeds its limit.

    `what` names the total, and `size` is its value in `unit`. `row_id` is the row of the largest error in the total,
    and `largest` is the size of this error. `extrapolated` is a remark that the total relies on extrapolated noise or
    on a folded spur, or is empty.
    """
    text = f"{what} {over_words(size, limit, unit)}; largest: {row_id}, {size_words(abs(largest), unit)}"
    return in_brackets(text, extrapolated)


@composed
def other_model_fails(model: str, size: float, limit: float, unit: str, what: str = "", equation: str = "") -> str:
    """Sentence for a row or a total of errors that passes in the deciding model, but fails in the other model.

    There are two models, the published and the full model. The deciding model is the model whose verdict counts.
    """
    text = f"fails by the {model} model: {what}".rstrip()
    return in_brackets(f"{text} {over_words(size, limit, unit)}", equation)


@composed
def published_model_does_not_hold(
    row_id: str, published: float | None, full: float | None, unit: str, others: int
) -> str:
    """Sentence for a mission to which the published model does not apply, with one row as an example.

    `published` and `full` are the allowables of this row according to the two models, in `unit`; None means that
    there is no limit. `others` is the number of other declared errors for which the models differ by more than 5 %.
    """
    by_published, by_full = (
        "without limit" if size is None else format_limit(size, unit) for size in (published, full)
    )
    text = f"the published model does not hold here: for {row_id} it allows {by_published}, the full model {by_full}"
    if not others:
        return text
    more = "1 other declared error" if others == 1 else f"{others} other declared errors"
    return f"{text}; for {more} the models differ by more than 5 % too"
