"""A figure of Matplotlib that depends on nothing but what is drawn, and its file."""

import os
from io import BytesIO
from typing import Any


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


def file_of(page: Any, kind: str, dpi: int = 110) -> bytes:
    """Give the file of a figure: of the same input the same bytes."""
    undated = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    file = BytesIO()
    page.savefig(file, format=kind, dpi=dpi, metadata=undated[kind])
    return file.getvalue()
