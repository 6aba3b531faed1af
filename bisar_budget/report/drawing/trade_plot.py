"""Plots of a sweep: utilizations over one key, a map of statuses or of a column over two, also as seen from above."""

from collections.abc import Mapping, Sequence
from textwrap import fill, shorten
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.status import STATUS
from bisar_budget.findings.trade import Axis, Trade
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission
from bisar_budget.report.drawing.figure import figure_file, new_figure
from bisar_budget.report.drawing.status_colours import ROWS, has_no_mission, light, status_words, strengths, tone_of
from bisar_budget.report.drawing.trades import borders, per_word, regions, runs
from bisar_budget.report.words.sentences import percent

_SIZE, _SQUARE = (9.5, 5.2), (8.4, 6.6)  # inches
_HIGH = 3.0  # times the limit: above it utilizations are drawn in equal ratios
_LEAST = 1e-3  # of the limit: what is smaller is not of interest there
_DASHES = ("-", "-", "-", "--", "--", "-.", ":")
_TINTS = (0.8, 0.9, 0.65)  # part of white, of the first, second and third status of one colour
_WORST = "#b9bfc6"
_NAME, _LINE = 60, 95  # characters of a line above a drawing: a wider one would take its room
_WORD, _ROOM = 40, 70  # characters of a word at an axis, and of all side by side
_CELLS = 60  # of a map that have room for words of their own
_FEW = 3  # rows without a name on a map that a legend names
_LIMIT = {"color": "#1b1e22", "lw": 1.8}
_SUBTITLE = {"fontsize": 8.5, "color": "#555b63"}


def drawn(trade: Trade, rows: Mapping[str, NDArray[Any]], mission: Mission, kind: str, *, is_polar: bool) -> bytes:
    """Draw a sweep as a `png`, `svg` or `pdf` file.

    `rows` are the utilizations of the rows that matter, over the one key that varies.
    """
    return figure_file(figure(trade, rows, mission, is_polar=is_polar), kind)


def figure(trade: Trade, rows: Mapping[str, NDArray[Any]], mission: Mission, *, is_polar: bool) -> Any:
    """Lay a sweep on a Matplotlib figure."""
    page = new_figure(figsize=_SIZE if len(trade.axes) == 1 or per_word(trade) else _SQUARE)
    panel = page.add_subplot(projection="polar") if is_polar else page.add_subplot()
    is_gating = any(axis.key == "allocation.model" for axis in trade.axes)
    model = "" if is_gating else f"{mission.gating_model} model"
    about = ", ".join(filter(None, (*trade.fixed, changes_words(mission.changes), model)))
    about = fill(about, _LINE, max_lines=3, placeholder=" ...")
    if is_polar:
        around, radius = trade.axes
        about += f"\nangle: {around.label}, radius: {radius.label}"
    away = 30 if is_polar else 6  # points
    panel.set_title(
        fill(printable(mission.name), _NAME, max_lines=2, placeholder=" ..."),
        parse_math=False,
        fontsize=12,
        loc="left",
        pad=away + 15 + 11 * about.count("\n"),
    )
    panel.annotate(
        about,
        (0, 1),
        xytext=(0, away),
        xycoords="axes fraction",
        textcoords="offset points",
        parse_math=False,
        **_SUBTITLE,
    )
    by_word = per_word(trade)
    if len(trade.axes) == 1:
        _curves(panel, trade, rows)
    elif by_word is not None:
        _curves_of_words(panel, *by_word)
    elif is_polar:
        _polar(page, panel, trade, mission)
    else:
        x, y = trade.axes
        _legend(page, _map(page, panel, trade, x.edges, y.edges, x.values, y.values))
        panel.set(xlabel=x.label, ylabel=y.label)
        _scale(panel.xaxis, x)
        _scale(panel.yaxis, y)
    return page


def _scale(drawn: Any, axis: Axis) -> None:
    """From the first value to the last, in equal ratios where the values are; words side by side."""
    if axis.words:
        names = [shorten(printable(word), _WORD, placeholder="...") for word in axis.words]
        is_crowded = drawn.axis_name == "x" and sum(map(len, names)) > _ROOM
        upright = {"rotation": 60, "ha": "right", "rotation_mode": "anchor"} if is_crowded else {}
        drawn.set_ticks(axis.values, names, parse_math=False, **upright)
        ends = (-0.5, axis.values[-1] + 0.5)
        drawn.axes.set(**{f"{drawn.axis_name}lim": ends if drawn.axis_name == "x" else ends[::-1]})
        return
    if axis.is_log:
        _in_ratios(drawn)
    drawn.axes.set(**{f"{drawn.axis_name}lim": (axis.values[0], axis.values[-1])})


def _in_ratios(drawn: Any) -> None:
    """Scale in equal ratios, its numbers without powers of ten."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    drawn.axes.set(**{f"{drawn.axis_name}scale": "log"})
    drawn.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    drawn.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    drawn.set_minor_formatter(NullFormatter())


def _fills(statuses: Sequence[str]) -> dict[str, str]:
    """Light colours of statuses; of those that share a colour, the worst has the strongest."""
    fills: dict[str, str] = {}
    for name, part in strengths(statuses, _TINTS).items():
        color = [int(light()[tone_of(name)][place : place + 2], 16) for place in (1, 3, 5)]
        fills[name] = "#" + "".join(f"{round(one + (255 - one) * part):02x}" for one in color)
    return fills


def _patches(statuses: Sequence[str]) -> list[Any]:
    """Of each status its colour, for a legend."""
    from matplotlib.patches import Patch

    fills = _fills(statuses)
    return [Patch(facecolor=fills[name], edgecolor="#c9ced4", label=status_words(name)) for name in statuses]


def _curves(panel: Any, trade: Trade, rows: Mapping[str, NDArray[Any]]) -> None:
    """Utilizations over one key with the limit, or one column; behind them the status."""
    (axis,) = trade.axes
    fills = _fills(trade.statuses)
    for run in runs(axis, trade.values["status"]):
        panel.axvspan(run.low, run.high, facecolor=fills[run.status], lw=0, zorder=0)
    marker = "o" if axis.words else "." if axis.values.size <= 40 else ""
    joined = {"lw": 0} if axis.words else {"lw": 1.8}  # there is nothing between two words
    lines = []
    if trade.column:
        shown = trade.values[trade.column]
        lines += panel.plot(
            axis.values, shown, color=light()["transmitter"], marker=marker, label=trade.column, **joined
        )
        panel.set_ylabel(trade.heading)
    else:
        worst = 100 * trade.values["utilization"]
        if axis.words:
            lines.append(panel.bar(axis.values, worst, color=_WORST, width=0.5, label="worst row"))
        else:
            lines += panel.plot(axis.values, worst, color=_WORST, lw=6, solid_capstyle="butt", label="worst row")
        for (row, use), tone, dashes in zip(rows.items(), ROWS, _DASHES, strict=False):
            style = {"color": light()[tone], "ls": dashes, "marker": marker, **joined}
            lines += panel.plot(axis.values, 100 * use, label=printable(row), **style)
        lines.append(panel.axhline(100, color=light()["fail"], lw=1.4, ls=(0, (6, 3)), label="limit"))
        _scale_uses(panel, np.concatenate([[1.0], trade.values["utilization"], *rows.values()]))
        panel.set_ylabel("utilization [%]")
    panel.set_xlabel(axis.label)
    _scale(panel.xaxis, axis)
    panel.grid(color="#ffffff", lw=0.8)
    panel.set_axisbelow(True)
    panel.legend(
        handles=[*lines, *_patches(trade.statuses)],
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        frameon=False,
        fontsize=9,
        borderaxespad=0,
    )


def _curves_of_words(panel: Any, words: Axis, trades: Mapping[str, Trade]) -> None:
    """Utilization, or a column, over a number: a curve for each word, with the limit."""
    first = next(iter(trades.values()))
    (axis,) = first.axes
    marker = "." if axis.values.size <= 40 else ""
    uses = []
    for (word, trade), tone, dashes in zip(trades.items(), ROWS, _DASHES, strict=False):
        shown = trade.values[trade.column] if trade.column else 100 * trade.values["utilization"]
        uses.append(trade.values["utilization"])
        name = shorten(printable(word), _WORD, placeholder="...")
        panel.plot(axis.values, shown, color=light()[tone], ls=dashes, marker=marker, lw=1.8, label=name)
    if first.column:
        panel.set_ylabel(first.heading)
    else:
        panel.axhline(100, color=light()["fail"], lw=1.4, ls=(0, (6, 3)), label="limit")
        _scale_uses(panel, np.concatenate([[1.0], *uses]))
        panel.set_ylabel("utilization [%]")
    panel.set_xlabel(axis.label)
    _scale(panel.xaxis, axis)
    panel.grid(color="#dddddd", lw=0.6)
    panel.set_axisbelow(True)
    panel.legend(
        title=fill(words.key.replace(".", ". "), 30).replace(". ", "."),
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        frameon=False,
        fontsize=9,
        borderaxespad=0,
        alignment="left",
    )


def _scale_uses(panel: Any, uses: NDArray[Any]) -> None:
    """Scale of utilizations: from 0, or in equal ratios where some are far above their limit."""
    finite = uses[np.isfinite(uses) & (uses > 0)]
    if finite.max() <= _HIGH:
        panel.set_ylim(0, 108 * finite.max())
        return
    _in_ratios(panel.yaxis)
    panel.set_ylim(100 * max(_LEAST, finite.min()) / 1.3, 130 * finite.max())


def _map(page: Any, panel: Any, trade: Trade, *grid: NDArray[Any]) -> list[Any]:
    """Draw a map between edges, with lines and names at the middles of its cells; return what a legend says."""
    first_edges, second_edges, first, second = grid
    handles = _patches(trade.statuses)
    if not trade.column:
        _statuses(panel, trade, first_edges, second_edges)
        if all(axis.words for axis in trade.axes) and trade.values["status"].size <= _CELLS:
            _in_cells(panel, trade)
        else:
            handles += _what_binds(panel, trade, grid)
    else:
        _heat(page, panel, trade, first_edges, second_edges)
        handles = [patch for patch, name in zip(handles, trade.statuses, strict=True) if has_no_mission(name)]
    if not any(axis.words for axis in trade.axes) and _limit(panel, trade, first, second):
        handles.insert(0, panel.plot([], [], label="utilization 100 %", **_LIMIT)[0])
    return handles


def _legend(page: Any, handles: Sequence[Any]) -> None:
    if handles:
        page.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=9)


def _statuses(panel: Any, trade: Trade, first: NDArray[Any], second: NDArray[Any]) -> None:
    from matplotlib.colors import ListedColormap

    names = trade.statuses
    codes = np.select([trade.values["status"] == name for name in names], range(len(names)))
    colors = ListedColormap(list(_fills(names).values()))
    limits = {"vmin": -0.5, "vmax": len(names) - 0.5}
    panel.pcolormesh(first, second, codes.T, cmap=colors, shading="flat", rasterized=True, **limits)


def _in_cells(panel: Any, trade: Trade) -> None:
    """Write the utilization and the worst row into each cell of a map of words."""
    room = int(110 / trade.values["status"].shape[0])  # characters of a cell
    for place, use in np.ndenumerate(trade.values["utilization"]):
        row = shorten(printable(str(trade.values["worst_row"][place])).replace(".", ". "), room, placeholder="...")
        said = "\n".join(filter(None, (percent(float(use)) if np.isfinite(use) else "", row.replace(". ", "."))))
        panel.text(*place, said, ha="center", va="center", fontsize=8.5, parse_math=False)


def _what_binds(panel: Any, trade: Trade, grid: Sequence[NDArray[Any]]) -> list[Any]:
    """Lines between the regions of the worst rows, and the name of each in it; the legend has rows without a name."""
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import withStroke

    first_edges, second_edges, first, second = grid
    rows = trade.values["worst_row"]
    lines = borders(rows, first_edges, second_edges)
    if len(lines):
        panel.add_collection(LineCollection(list(lines), colors="#6b7179", linewidths=0.8, linestyles=(0, (2, 1.5))))
    named = regions(rows)
    for region in named:
        i, j = region.place
        is_polar = panel.name == "polar"
        x = np.cos(first[i]) if is_polar else 0.0  # a name runs towards the middle, not over the rim
        is_tall = not is_polar and region.size[0] / rows.shape[0] < 0.3 < region.size[1] / rows.shape[1]
        panel.text(
            first[i],
            second[j],
            printable(region.row),
            ha="left" if x < -0.3 else "right" if x > 0.3 else "center",
            va="center",
            rotation=90 if is_tall else 0,
            fontsize=8.5,
            parse_math=False,
            path_effects=[withStroke(linewidth=2.5, foreground="white", alpha=0.75)],
        )
    others = sorted(set(rows.ravel().tolist()) - {"", *(region.row for region in named)})
    if not others:
        return []
    few = ", ".join(map(printable, others[:_FEW])) + (f" and {len(others) - _FEW} more" * (len(others) > _FEW))
    label = fill(f"small regions: {few}", 40)
    handles: list[Any] = panel.plot([], [], color="#6b7179", lw=0.8, ls=(0, (2, 1.5)), label=label)
    return handles


def _heat(page: Any, panel: Any, trade: Trade, first: NDArray[Any], second: NDArray[Any]) -> None:
    """A column in colour, in equal ratios where it spans more than two decades."""
    from matplotlib.colors import LogNorm

    shown = np.ma.masked_invalid(np.asarray(trade.values[trade.column], float))
    is_log = shown.count() > 0 and shown.min() > 0 and shown.max() / shown.min() > 100
    mesh = panel.pcolormesh(
        first,
        second,
        shown.T,
        cmap="viridis",
        shading="flat",
        rasterized=True,
        norm=LogNorm() if is_log else None,
    )
    if any(map(has_no_mission, trade.statuses)):
        panel.set_facecolor(_fills(["error"])["error"])
    bar = page.colorbar(mesh, ax=panel, pad=0.1 if panel.name == "polar" else 0.02)
    bar.set_label(trade.heading, parse_math=False)


def _limit(panel: Any, trade: Trade, first: NDArray[Any], second: NDArray[Any]) -> bool:
    """Line of 100 %, if there is one: through the logarithms, which turn less than utilizations themselves."""
    uses = np.asarray(trade.values["utilization"], float)
    # Where a row is not evaluated, those that are left do not say how near the limit is.
    unknown = [name for name in trade.statuses if not STATUS[name].is_held]
    uses = np.where(np.isin(trade.values["status"], unknown), np.nan, uses)
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = np.ma.masked_invalid(np.log(uses))
    if levels.count() == 0 or not levels.min() < 0 < levels.max():
        return False
    panel.contour(first, second, levels.T, levels=[0.0], colors=[_LIMIT["color"]], linewidths=[_LIMIT["lw"]])
    return True


def _polar(page: Any, panel: Any, trade: Trade, mission: Mission) -> None:
    """The map as seen from above: azimuth from east, counter-clockwise, the other key as a radius from 0.

    An elevation is 90 deg in the middle: what is seen from above there stands over the scene.
    """
    around, radius = trade.axes
    edges, middles = (values * around.scale for values in (around.edges, around.values))
    turn = middles[-1] - middles[0]
    if abs(turn - 2 * np.pi) < 1e-6:  # the first direction again: it needs no cell beyond
        edges[0], edges[-1] = middles[0], middles[-1]
    middle, rim = 0.0, radius.values[-1]
    if radius.key.endswith(".elevation"):
        middle, rim = np.pi / 2 / radius.scale, radius.values[0]
    handles = _map(page, panel, trade, edges, np.clip(radius.edges, *sorted((middle, rim))), middles, radius.values)
    panel.set_rlim(middle, rim)
    ticks = np.arange(0, 360, 45)
    names = {0: "east", 90: "north", 180: "west", 270: "south"}
    panel.set_thetagrids(ticks, [names.get(tick, f"{tick}°") for tick in ticks.tolist()])
    panel.grid(color="#ffffff", lw=0.7, alpha=0.7)
    panel.set_rlabel_position(_free(edges))
    panel.tick_params(axis="y", labelsize=8)
    panel.tick_params(axis="x", pad=8)
    _legend(page, [*handles, *_other_platform(panel, around, mission.geometry)])


def _free(edges: NDArray[Any]) -> float:
    """Direction of the numbers of the radius, beside what is drawn where that is not the whole circle. [deg]"""
    return float(np.degrees(edges[0])) - 6 if edges[-1] - edges[0] < 1.9 * np.pi else 22.5


def _other_platform(panel: Any, around: Axis, geometry: BistaticGeometry) -> list[Any]:
    """Mark at the rim where the other platform stands; for a legend."""
    names = [name for name in ("transmitter", "receiver") if f".{name}." in f".{around.key}"]
    if len(names) != 1:
        return []
    other = "receiver" if names == ["transmitter"] else "transmitter"
    x, y, _ = getattr(geometry, other).position
    angle = np.arctan2(y, x)
    style = {"marker": (3, 0, float(np.degrees(angle)) + 90), "ms": 12, "color": light()[other], "ls": "none"}
    handles: list[Any] = panel.plot(
        angle, panel.get_ylim()[1], label=f"direction of the {other}", clip_on=False, **style
    )
    return handles
