"""Matplotlib figures that look the same whatever a user's settings say, and their files."""

import os
from io import BytesIO
from typing import Any

WORSE, BETTER = "#c1502e", "#1f5fa8"  # of lines and bars: what uses more of a limit, and less
PALE_WORSE, PALE_BETTER = "#e6b9ab", "#a5bfdc"
GRID = "#dddddd"
KINDS = ("png", "svg", "pdf")


def new_figure(**settings: Any) -> Any:
    """Give a Matplotlib figure that looks the same whatever a user's matplotlibrc and MPLBACKEND say."""
    os.environ.pop("MPLBACKEND", None)  # a name that Matplotlib does not know would end its import
    import logging

    logging.getLogger("matplotlib").setLevel(logging.CRITICAL)  # of fonts and folders that it lacks
    import matplotlib
    from matplotlib.figure import Figure

    matplotlib.rcdefaults()
    matplotlib.rcParams["svg.hashsalt"] = "bisar-budget"
    return Figure(**settings, layout="constrained")


def figure_file(figure: Any, kind: str, dpi: int = 110) -> bytes:
    """Give the file of a figure, of a kind of `KINDS`: of the same input the same bytes."""
    undated = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    file = BytesIO()
    figure.savefig(file, format=kind, dpi=dpi, metadata=undated[kind])
    return file.getvalue()
