"""Sphinx: after a build, hold every link and picture of every page to something that is there."""

from pathlib import Path

from links import broken_links
from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)


def _check(app: Sphinx, exception: Exception | None) -> None:
    if exception is None and app.builder.name == "html":
        for link in broken_links(Path(app.outdir)):
            _log.warning("broken link: %s", link)


def setup(app: Sphinx) -> dict[str, bool]:
    """Check links when the build has finished."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True}
