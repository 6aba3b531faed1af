"""Pictures as files: Matplotlib figures that look the same whatever a user's settings say, and SVG drawings."""

import os
import re
from collections.abc import Mapping
from io import BytesIO
from typing import Any
from xml.etree import ElementTree

_POINT, _INCH = 0.75, 96.0  # points of a pixel of an SVG drawing, pixels of an inch


def new_figure(**settings: Any) -> Any:
    """Give a Matplotlib figure that looks the same whatever a user's matplotlibrc and MPLBACKEND say."""
    os.environ.pop("MPLBACKEND", None)  # a name that Matplotlib does not know would end its import
    import logging

    logging.getLogger("matplotlib").setLevel(logging.CRITICAL)  # of fonts and folders that it lacks
    import matplotlib
    from matplotlib.figure import Figure

    matplotlib.rcdefaults()
    matplotlib.rcParams["svg.hashsalt"] = "bisar-budget"
    return Figure(**{"layout": "constrained", **settings})


def figure_file(figure: Any, kind: str, dpi: int = 110) -> bytes:
    """Give the file of a figure, `png`, `svg` or `pdf`: of the same input the same bytes."""
    undated = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    file = BytesIO()
    figure.savefig(file, format=kind, dpi=dpi, metadata=undated[kind])
    return file.getvalue()


def drawing_file(svg: str, kind: str, dpi: int = 192) -> bytes:
    """Give the file of a drawing of `svg.Canvas`, `png`, `svg` or `pdf`: PNG and PDF as on white paper."""
    if kind == "svg":
        return svg.encode()
    drawing = ElementTree.fromstring(svg)
    width, height = (float(drawing.get(side, "")) / _INCH for side in ("width", "height"))
    page = new_figure(figsize=(width, height), layout="none")
    paint(page.add_axes((0, 0, 1, 1)), drawing)
    return figure_file(page, kind, dpi)


def paint(panel: Any, drawing: ElementTree.Element) -> None:
    """Paint the elements of a drawing of `svg.Canvas`, which are few, on Matplotlib axes of the drawing's shape."""
    from matplotlib.patches import Circle, PathPatch
    from matplotlib.patheffects import withStroke

    panel.set(xlim=(0, float(drawing.get("width", ""))), ylim=(float(drawing.get("height", "")), 0))
    panel.set_aspect("equal")
    panel.axis("off")
    rules = _rules(drawing.findtext("{*}style", ""))
    for order, element in enumerate(drawing):
        tag, style = element.tag.rpartition("}")[2], _style(rules, element)
        stroke, width = style.get("stroke", "none"), _POINT * float(style.get("stroke-width", "1").removesuffix("px"))
        is_crisp = style.get("shape-rendering") == "crispEdges"
        if tag in ("path", "circle"):
            dashes = [float(part) * _POINT / width for part in style.get("stroke-dasharray", "").split()]
            look = {
                "facecolor": _colour(style.get("fill", "#000"), style.get("fill-opacity")),
                "edgecolor": _colour(stroke, style.get("stroke-opacity")),
                "linewidth": width,
                "linestyle": (0, dashes) if dashes else "-",
                "capstyle": style.get("stroke-linecap", "butt"),
                "joinstyle": "miter",
                "antialiased": not is_crisp,
                "rasterized": is_crisp,
                "zorder": order,
            }
            if tag == "circle":
                x, y, radius = (float(element.get(name, "")) for name in ("cx", "cy", "r"))
                panel.add_patch(Circle((x, y), radius, **look))
            else:
                panel.add_patch(PathPatch(_path(element.get("d", "")), **look))
        elif tag == "text":
            turned = re.findall(r"-?[\d.]+", element.get("transform", ""))
            x, y = (float(part) for part in turned[:2] or (element.get("x", ""), element.get("y", "")))
            for line in element.findall("{*}tspan") or [element]:
                y += float(line.get("dy", 0))
                own = style | _style(rules, line)
                panel.text(
                    x,
                    y,
                    "".join(line.itertext()),
                    fontsize=_POINT * float(own.get("font-size", "12px").removesuffix("px")),
                    fontweight=own.get("font-weight", "400"),
                    color=own["fill"],
                    ha={"middle": "center", "end": "right"}.get(element.get("text-anchor", ""), "left"),
                    va="baseline",
                    rotation=90 if turned else 0,
                    rotation_mode="anchor",
                    parse_math=False,
                    path_effects=[withStroke(linewidth=width, foreground=stroke)],
                    zorder=order,
                )


def _rules(css: str) -> list[tuple[str, Mapping[str, str]]]:
    """Selectors within a drawing with what they say, the strongest last; those of a dark screen are left out."""
    css = re.sub(r"@media[^{]*\{[^{}]*\{[^{}]*\}\}", "", css)
    css = re.sub(r"var\(--\w+,(#\w+)\)", r"\1", css)
    rules = []
    for selectors, body in re.findall(r"([^{}]+)\{([^{}]*)\}", css):
        said = dict(one.split(":", 1) for one in body.split(";"))
        rules += [(one.removeprefix("svg.drawing").strip(), said) for one in selectors.split(",")]
    return sorted(rules, key=lambda rule: rule[0].count("."))


def _style(rules: list[tuple[str, Mapping[str, str]]], element: ElementTree.Element) -> dict[str, str]:
    names = {element.tag.rpartition("}")[2], *(f".{name}" for name in element.get("class", "").split())}
    style: dict[str, str] = {}
    for selector, said in rules:
        if selector and names.issuperset(re.findall(r"\.?[\w-]+", selector)):
            style |= said
    return style


def _colour(name: str, opacity: str | None) -> Any:
    return (name, float(opacity or 1)) if name != "none" else "none"


def _path(data: str) -> Any:
    """Path of what `svg.Canvas` writes: M, L, H, V and Z, all absolute."""
    from matplotlib.path import Path

    codes, points = [], [(0.0, 0.0)]
    for letter, numbers in re.findall(r"([MLHVZ])([^MLHVZ]*)", data):
        x, y = points[-1]
        given = [float(number) for number in numbers.split()]
        x, y = {"H": (*given, y), "V": (x, *given), "Z": (x, y)}.get(letter) or given
        codes.append({"M": Path.MOVETO, "Z": Path.CLOSEPOLY}.get(letter, Path.LINETO))
        points.append((x, y))
    return Path(points[1:], codes)
