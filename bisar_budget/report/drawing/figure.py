"""Convert Matplotlib figures and SVG drawings to files that do not depend on the user's settings."""

import os
import re
from collections.abc import Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.path import Path


_POINTS_PER_PIXEL, _PIXELS_PER_INCH = 0.75, 96.0  # pixels of an SVG drawing


def new_figure(**settings: Any) -> "Figure":
    """Create a Matplotlib figure that does not depend on the user's matplotlibrc and MPLBACKEND."""
    os.environ.pop("MPLBACKEND", None)  # an unknown name would make the import of Matplotlib fail
    import logging

    logging.getLogger("matplotlib").setLevel(logging.CRITICAL)  # hides messages about missing fonts and folders
    import matplotlib
    from matplotlib.figure import Figure

    matplotlib.rcdefaults()
    matplotlib.rcParams["svg.hashsalt"] = "bisar-budget"
    return Figure(**{"layout": "constrained", **settings})


def figure_file(figure: "Figure", file_type: str, dpi: int = 110) -> bytes:
    """Convert a figure to the bytes of a `png`, `svg` or `pdf` file. The same input gives the same bytes."""
    undated = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    file = BytesIO()
    figure.savefig(file, format=file_type, dpi=dpi, metadata=undated[file_type])
    return file.getvalue()


def drawing_file(svg: str, file_type: str, dpi: int = 192) -> bytes:
    """Convert an SVG drawing made with `svg.Canvas` to a `png`, `svg` or `pdf` file.

    PNG and PDF have a white background.
    """
    if file_type == "svg":
        return svg.encode()
    drawing = ElementTree.fromstring(svg)
    width, height = (float(drawing.get(side, "")) / _PIXELS_PER_INCH for side in ("width", "height"))
    page = new_figure(figsize=(width, height), layout="none")
    paint(page.add_axes((0, 0, 1, 1)), drawing)
    return figure_file(page, file_type, dpi)


def paint(panel: "Axes", drawing: ElementTree.Element) -> None:
    """Draw the elements of an SVG drawing from `svg.Canvas` on Matplotlib axes of the same size as the drawing."""
    from matplotlib.patches import Circle, PathPatch
    from matplotlib.patheffects import withStroke

    panel.set(xlim=(0, float(drawing.get("width", ""))), ylim=(float(drawing.get("height", "")), 0))
    panel.set_aspect("equal")
    panel.axis("off")
    rules = _rules(drawing.findtext("{*}style", ""))
    for order, element in enumerate(drawing):
        tag, style = element.tag.rpartition("}")[2], _style(rules, element)
        stroke, stroke_width = style.get("stroke", "none"), float(style.get("stroke-width", "1").removesuffix("px"))
        width = _POINTS_PER_PIXEL * stroke_width
        is_crisp = style.get("shape-rendering") == "crispEdges"
        if tag in ("path", "circle"):
            dashes = [float(dash) * _POINTS_PER_PIXEL / width for dash in style.get("stroke-dasharray", "").split()]
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
            rotation_numbers = re.findall(r"-?[\d.]+", element.get("transform", ""))
            x, y = (float(number) for number in rotation_numbers[:2] or (element.get("x", ""), element.get("y", "")))
            for line in element.findall("{*}tspan") or [element]:
                y += float(line.get("dy", 0))
                line_style = style | _style(rules, line)
                panel.text(
                    x,
                    y,
                    "".join(line.itertext()),
                    fontsize=_POINTS_PER_PIXEL * float(line_style.get("font-size", "12px").removesuffix("px")),
                    fontweight=line_style.get("font-weight", "400"),
                    color=line_style["fill"],
                    ha={"middle": "center", "end": "right"}.get(element.get("text-anchor", ""), "left"),
                    va="baseline",
                    rotation=90 if rotation_numbers else 0,
                    rotation_mode="anchor",
                    parse_math=False,
                    path_effects=[withStroke(linewidth=width, foreground=stroke)],
                    zorder=order,
                )


def _rules(css: str) -> list[tuple[str, Mapping[str, str]]]:
    """List the CSS rules of a drawing, each as a selector with its declarations, in order of increasing priority.

    Rules for dark screens are left out.
    """
    css = re.sub(r"@media[^{]*\{[^{}]*\{[^{}]*\}\}", "", css)
    css = re.sub(r"var\(--\w+,(#\w+)\)", r"\1", css)
    rules = []
    for selectors, body in re.findall(r"([^{}]+)\{([^{}]*)\}", css):
        declarations = dict(declaration.split(":", 1) for declaration in body.split(";"))
        rules += [(selector.removeprefix("svg.drawing").strip(), declarations) for selector in selectors.split(",")]
    return sorted(rules, key=lambda rule: rule[0].count("."))


def _style(rules: list[tuple[str, Mapping[str, str]]], element: ElementTree.Element) -> dict[str, str]:
    names = {element.tag.rpartition("}")[2], *(f".{name}" for name in element.get("class", "").split())}
    style: dict[str, str] = {}
    for selector, declarations in rules:
        if selector and names.issuperset(re.findall(r"\.?[\w-]+", selector)):
            style |= declarations
    return style


def _colour(name: str, opacity: str | None) -> tuple[str, float] | str:
    return (name, float(opacity or 1)) if name != "none" else "none"


def _path(data: str) -> "Path":
    """Convert SVG path data from `svg.Canvas`, with absolute commands M, L, H, V and Z, to a Matplotlib path."""
    from matplotlib.path import Path

    codes, points = [], [(0.0, 0.0)]
    for letter, numbers in re.findall(r"([MLHVZ])([^MLHVZ]*)", data):
        x, y = points[-1]
        coordinates = [float(number) for number in numbers.split()]
        x, y = {"H": (*coordinates, y), "V": (x, *coordinates), "Z": (x, y)}.get(letter) or coordinates
        codes.append({"M": Path.MOVETO, "Z": Path.CLOSEPOLY}.get(letter, Path.LINETO))
        points.append((x, y))
    return Path(points[1:], codes)
