"""Sphinx: run the examples of every page when it is read, show what they print, and the pictures that they draw."""

import tempfile
from html import escape
from pathlib import Path
from shutil import copyfile

from blocks import EXECUTED, ExampleError, Page
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

_log = logging.getLogger(__name__)
_DRAWN = "drawn-by-an-example"  # attribute of a node: the name of the picture
_PICTURES = "pictures"  # folder of the finished site


class Picture(SphinxDirective):
    """A picture that an example above it has drawn; the argument is its file, the body says what it shows."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """Leave its place, for when the examples have run."""
        place = nodes.raw("", " ".join(self.content), format="html")
        place[_DRAWN] = self.arguments[0]
        self.set_source_info(place)
        return [place]


def _run(app: Sphinx, doctree: nodes.document) -> None:
    with tempfile.TemporaryDirectory(prefix="page-") as folder:
        page = Page(Path(folder))
        for block in [*doctree.findall(nodes.literal_block), *doctree.findall(_is_picture)]:
            try:
                if _is_picture(block):
                    _show(app, page, block)
                # What is included from a file of the project has tests of its own there.
                elif block.get("language") in EXECUTED and "source" not in block:
                    _run_block(page, block)
            except ExampleError as error:
                _log.warning("example: %s", error, location=block, type="example")


def _run_block(page: Page, block: nodes.literal_block) -> None:
    text = page.run(block["language"], block.astext() + "\n", _caption(block)).rstrip("\n")
    if text != block.astext():
        block.rawsource = text
        block.children = [nodes.Text(text)]


def _is_picture(node: nodes.Node) -> bool:
    return isinstance(node, nodes.raw) and _DRAWN in node


def _show(app: Sphinx, page: Page, place: nodes.raw) -> None:
    """Keep a picture with the site, and show it in its place."""
    name, shown = place[_DRAWN], app.env.docname
    if not (page.folder / name).is_file():
        raise ExampleError(f"no example has drawn {name}")
    file = Path(_PICTURES, shown, name)
    kept = Path(app.outdir, file)
    kept.parent.mkdir(parents=True, exist_ok=True)
    copyfile(page.folder / name, kept)
    link = "../" * shown.count("/") + file.as_posix()
    place.children = [nodes.Text(f'<p><img src="{escape(link)}" alt="{escape(place.astext())}"></p>')]


def _caption(block: nodes.literal_block) -> str:
    """The name of the file that a block is, which stands over it."""
    parent = block.parent
    captions = parent.findall(nodes.caption) if parent.get("literal_block") else ()
    return next((caption.astext() for caption in captions), "")


def setup(app: Sphinx) -> dict[str, bool]:
    """Run examples after a page is parsed."""
    app.add_directive("picture", Picture)
    app.connect("doctree-read", _run)
    return {"parallel_read_safe": True}
