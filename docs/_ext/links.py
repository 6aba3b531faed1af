"""Links of a finished site, held to what is there."""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class _Links(HTMLParser):
    """The targets and the anchors of a page."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.targets: set[str] = set()
        self.anchors: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.anchors |= {found[name] or "" for name in ("id", "name") if name in found}
        self.targets |= {found[name] or "" for name in ("href", "src") if name in found}


def broken_links(folder: Path) -> list[str]:
    """What the pages of a folder link to and is not there; links to elsewhere are not followed."""
    pages = {page.resolve(): _Links(page) for page in folder.rglob("*.html")}
    broken = []
    for page, links in pages.items():
        for target in sorted(links.targets):
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            file = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            is_there = file.exists() and (
                not parts.fragment or file not in pages or unquote(parts.fragment) in pages[file].anchors
            )
            if not is_there:
                broken.append(f"{page.relative_to(folder.resolve())}: {target}")
    return broken
