"""Sphinx: run the examples of every page when it is read, and show what they print."""

import tempfile
from pathlib import Path

from blocks import EXECUTED, ExampleError, Page
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)


def _run(app: Sphinx, doctree: nodes.document) -> None:
    with tempfile.TemporaryDirectory(prefix="page-") as folder:
        page = Page(Path(folder))
        for block in list(doctree.findall(nodes.literal_block)):
            # What is included from a file of the project has tests of its own there.
            if block.get("language") not in EXECUTED or "source" in block:
                continue
            try:
                text = page.run(block["language"], block.astext() + "\n", _caption(block)).rstrip("\n")
            except ExampleError as error:
                _log.warning("example: %s", error, location=block, type="example")
                continue
            if text != block.astext():
                block.rawsource = text
                block.children = [nodes.Text(text)]


def _caption(block: nodes.literal_block) -> str:
    """The name of the file that a block is, which stands over it."""
    parent = block.parent
    captions = parent.findall(nodes.caption) if parent.get("literal_block") else ()
    return next((caption.astext() for caption in captions), "")


def setup(app: Sphinx) -> dict[str, bool]:
    """Run examples after a page is parsed."""
    app.connect("doctree-read", _run)
    return {"parallel_read_safe": True}
