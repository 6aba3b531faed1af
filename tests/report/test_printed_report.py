"""The compliance report on paper and on narrow screens: no word over another, none outside, at most four pages.

Skipped where Chromium, a driver for it or pdftotext is not installed.
"""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.findings.requirement import Override
from bisar_budget.questions.checks import with_work_trees
from bisar_budget.report import Style, render
from tests.conftest import ROOT, found_in
from tests.printed import PrintedPage, printed_pages
from tests.report.test_report_compliance import EVERY_KEY

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
if CHROMIUM is None or shutil.which("pdftotext") is None:
    pytest.skip("Chromium or pdftotext is not installed", allow_module_level=True)
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

FLAGS = ["--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--no-sandbox"]
BOARD = Path(__file__).parent / "board.yaml"
EXAMPLES = sorted((ROOT / "specs" / "missions").glob("*.yaml"))
MARGIN_MM = 14.0
MAX_PAGES = 4
MAX_PAGES_OF_SEVERAL = 2
# The text of drawings has an edge in the colour of the paper, which a reader of PDF sees as the text once more.
WITHOUT_EDGES = "svg text { stroke: none !important }"
# A command names all its options in its reports.
OPTIONS = tuple(
    Override(f"--{name}", value, "default")
    for name, value in (
        ("strict", "no"), ("exit-zero", "no"), ("model", "as in each file"), ("verify", "no"), ("detail", "summary"),
        ("date", "2026-11-21"), ("monte-carlo", "none"), ("seed", "as in each file"), ("sweep", "none"),
    )
)  # fmt: skip


def written(*paths: Path) -> str:
    report = Report("1.2.3", tuple(map(found_in, paths)), OPTIONS)
    return render("html", with_work_trees(report), Style(root=str(ROOT)))


@pytest.fixture(scope="module")
def browser() -> Iterator["playwright.Browser"]:
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture
def printed(browser, tmp_path: Path) -> Callable[[str], list[PrintedPage]]:
    """Print a page, after a look at it on narrow and wide screens; returns the printed pages."""

    def print_it(text: str) -> list[PrintedPage]:
        page = browser.new_page()
        page.set_content(text)
        for width in (360, 1280):
            page.set_viewport_size({"width": width, "height": 900})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.add_style_tag(content=WITHOUT_EDGES)
        (tmp_path / "report.pdf").write_bytes(page.pdf(prefer_css_page_size=True))
        page.close()
        return printed_pages(tmp_path / "report.pdf")

    return print_it


def check_pages(pages: list[PrintedPage]) -> None:
    for page in pages:
        assert len(page.words) > 10
        assert list(page.overprinted()) == []
        assert page.beyond(MARGIN_MM) == []


@pytest.mark.parametrize("path", [*EXAMPLES, EVERY_KEY, BOARD], ids=lambda path: path.stem)
def test_no_word_is_printed_over_another(printed, path: Path) -> None:
    """The contributions to phase and displacement were, where both tables had long words."""
    pages = printed(written(path))
    check_pages(pages)
    assert len(pages) <= MAX_PAGES


def test_several_missions_are_an_overview_and_two_pages_each(printed) -> None:
    """Fifteen missions had 62 pages."""
    paths = [*EXAMPLES[:14], BOARD]
    pages = printed(written(*paths))
    check_pages(pages)
    assert "Smallest margin of each requirement" in pages[0].text
    assert len(pages) <= 2 + MAX_PAGES_OF_SEVERAL * len(paths)


def test_a_word_over_another_is_found(printed) -> None:
    """A table over its neighbour, as it was before."""
    side_by_side = '<div style="position: absolute; top: 1cm; left: {}">transmitter velocity</div>'
    near, far = (printed(side_by_side.format("2cm") + side_by_side.format(left)) for left in ("2.4cm", "9cm"))
    assert list(near[0].overprinted())
    assert not list(far[0].overprinted())
    assert near[0].beyond(MARGIN_MM) == []
    assert near[0].beyond(40.0)
