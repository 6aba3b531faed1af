"""What each number of a mission does to its worst utilization, as bars to both sides, the largest above.

All bars are for the same part: 1 % of a number, of a radian, of a power, of the smaller slant range.
"""

from typing import Any

from bisar_budget.design.slopes import EVEN, Sensitivity, Slope
from bisar_budget.faults import changes_words, printable
from bisar_budget.report.drawing.figure import (
    BETTER,
    GRID,
    PALE_BETTER,
    PALE_WORSE,
    WORSE,
    figure_file,
    new_figure,
)
from bisar_budget.report.words.sentences import percent

MOST = 20  # bars
_ROW = 0.28  # inch
_GREYS, _SIZES = ("#444444", "#c4c4c4"), ("larger", "smaller")


def tornado(found: Sensitivity, kind: str) -> bytes:
    """Draw the numbers with the largest effects, as a `png`, `svg` or `pdf` file."""
    return figure_file(figure(found), kind)


def figure(found: Sensitivity) -> Any:
    """Lay the bars on a Matplotlib figure.

    Dark is what a larger number does, light what a smaller one does; both are the same slope.
    """
    shown = found.shown[:MOST]
    page = new_figure(figsize=(9.5, 2.0 + _ROW * max(len(shown), 3)))
    panel = page.subplots()
    for place, slope in enumerate(shown):
        change = 100 * slope.even_effect
        dark, pale = (WORSE, PALE_BETTER) if change > 0 else (BETTER, PALE_WORSE)
        panel.barh([place, place], [change, -change], color=[dark, pale], height=0.72, lw=0, zorder=2)
    panel.set_yticks(range(len(shown)), [_label(slope) for slope in shown], fontsize=9, parse_math=False)
    panel.invert_yaxis()
    panel.axvline(0, color="black", lw=0.8, zorder=3)
    panel.grid(axis="x", color=GRID, lw=0.5, zorder=0)
    panel.set_axisbelow(True)
    panel.tick_params(axis="y", length=0)
    for side in ("top", "left", "right"):
        panel.spines[side].set_visible(False)
    panel.set_xlabel(f"change of the utilization, {percent(found.asked)} now [percentage points]")
    if not shown:
        panel.text(0.5, 0.5, "no number changes it", transform=panel.transAxes, ha="center")
    from matplotlib.patches import Patch  # after `new_figure`: it sees to the settings of a user

    named = [Patch(color=grey, label=f"the number is {size}") for grey, size in zip(_GREYS, _SIZES, strict=True)]
    panel.legend(handles=named, loc="lower right", fontsize=9, frameon=False)
    what = f"row {found.row}" if found.row else f"worst utilization: {found.worst_row}"
    name = f"{found.name} {changes_words(found.changes)}".rstrip()
    page.suptitle(f"{printable(name)}\n{printable(what)}", fontsize=11, parse_math=False)
    return page


def _label(slope: Slope) -> str:
    mark = " *" if slope.is_mixed else ""
    return f"{printable(slope.key)} = {printable(slope.given)}, {_even(slope)}{mark}"


def _even(slope: Slope) -> str:
    """Write the change that its bar is for."""
    if slope.measure == EVEN:
        return slope.per_text
    size, _, unit = slope.per_text.partition(" ")
    return f"{float(size) * EVEN / slope.measure:.2g} {unit}"
