"""The compliance report in a real browser: layout at two widths, dark and light, on paper, and what axe-core says.

Skipped where no Chromium or no driver for it is installed; CI installs both.
"""

import hashlib
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path

import pytest

from bisar_budget.findings.mission import Report, UnusableMission
from bisar_budget.questions.checks import with_studies
from bisar_budget.report import Style, render
from tests.conftest import ROOT, UAV_FREE_RUNNING, findings, found_in
from tests.report.test_report_compliance import EVERY_KEY, FAULT, SECTION_V, illustrated

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
if CHROMIUM is None:
    pytest.skip("no Chromium is installed", allow_module_level=True)
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")

FLAGS = [
    "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-sandbox",
]  # fmt: skip
MISSIONS = ROOT / "specs" / "missions"
WIDTHS = (1280, 390)
SCHEMES = ("light", "dark")
LONG = "a-name-that-has-no-place-to-break-" * 4
SENSOR, TIME = "platforms.receiver.motion_error.sensor.0", "collection.aperture_time"


def studied() -> Report:
    """Curves, a map, bars, curves of words and a map of words."""
    asked = [
        (SECTION_V, [f"{TIME}=1:9s:9"]),
        (SECTION_V, [f"{TIME}=1:9s:9", "platforms.receiver.azimuth=0:180deg:9"]),
        (UAV_FREE_RUNNING, [f"{SENSOR}=stim300,adis16405,mti-g,hg1700"]),
        (UAV_FREE_RUNNING, [f"{SENSOR}=stim300,mti-g", f"{TIME}=1:5s:5"]),
        (UAV_FREE_RUNNING, ["allocation.model=published,full", "allocation.combine=each,sum,rss"]),
    ]
    missions = [with_studies([found_in(file)], texts, None, date(2026, 1, 1))[0] for file, texts in asked]
    return Report("1.2.3", tuple(missions))


REPORTS: dict[str, Callable[[], Report]] = {
    "studies": studied,
    "section_v": lambda: Report("1.2.3", (found_in(SECTION_V),)),
    "images": lambda: Report("1.2.3", (illustrated(),)),
    "everything": lambda: Report(
        "1.2.3",
        (
            found_in(EVERY_KEY, "strictest"),
            UnusableMission(file=f"{LONG}.yaml", faults=(FAULT,)),
            findings(name=LONG, other_errors=[{"name": LONG, "quadratic_phase_error": 0.3}]),
            found_in(ROOT / "tests" / "acceptance" / "good" / "waived.yaml"),
        ),
    ),
}


@pytest.fixture(scope="module")
def browser() -> Iterator["playwright.Browser"]:
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("reports")
    written = {}
    for name, report in REPORTS.items():
        written[name] = folder / f"{name}.html"
        style = Style(detail="summary" if name == "studies" else "full")  # of studies, no row's formulas once more
        written[name].write_text(render("html", report(), style), encoding="utf-8")
    return written


@pytest.fixture(scope="module")
def show(browser, files) -> Callable[..., "playwright.Page"]:
    """Show a report; anything that it asks for beyond itself, and any complaint of the browser, fails the test.

    One page of each report serves all tests, which leave it as it is; `is_new` opens one to change.
    """
    pages: dict[str, playwright.Page] = {}

    def opened(name: str) -> "playwright.Page":
        page = browser.new_page()
        requests, complaints = [], []
        page.on("request", lambda request: requests.append(request.url))
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(files[name].as_uri())
        assert [url for url in requests if not url.startswith(("file:", "data:"))] == []
        assert len([url for url in requests if url.startswith("file:")]) == 1
        assert complaints == []
        return page

    def shown(name: str, width: int = 1280, scheme: str = "light", *, is_new: bool = False) -> "playwright.Page":
        page = opened(name) if is_new or name not in pages else pages[name]
        if not is_new:
            pages[name] = page
        page.emulate_media(media="screen", color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": 900})
        return page

    return shown


AS_TEXT = """() => {
    const own = e => { const s = getComputedStyle(e); return s.color + s.opacity + s.visibility; };
    const maths = [...document.querySelectorAll("math")];
    const others = maths.flatMap(m => [m, ...m.querySelectorAll("*")].filter(e => own(e) !== own(m.parentElement)
        || getComputedStyle(e).backgroundColor !== "rgba(0, 0, 0, 0)"));
    maths.forEach(m => m.replaceWith(m.textContent));
    return others.length;
}"""  # every formula becomes text; how many elements of them had colours of their own

# Texts that look the same are asked for once: colours, size, weight, and what lies behind them up to the page.
MARK_LOOKS = """() => {
    const seen = new Set();
    for (const e of document.querySelectorAll("body *")) {
        if (![...e.childNodes].some(n => n.nodeType === Node.TEXT_NODE && n.data.trim())) continue;
        if (!e.getClientRects().length) continue;
        const own = getComputedStyle(e);
        let look = [e.tagName, own.color, own.fill, own.fontSize, own.fontWeight, own.textShadow].join();
        for (let b = e; b; b = b.parentElement) {
            const s = getComputedStyle(b);
            look += ["", s.opacity, s.visibility, s.backgroundColor, s.backgroundImage].join();
        }
        if (!seen.has(look)) { seen.add(look); e.setAttribute("data-look", ""); }
    }
    return seen.size;
}"""
ONE_OF_EACH_LOOK = 'axe.configure({rules: [{id: "color-contrast", selector: "[data-look]"}]});'


def serious(page: "playwright.Page", **options: object) -> tuple[list[object], set[str]]:
    """What axe-core finds serious on a page, and the rules that something on it passes."""
    asked = axe.Axe(axe.Axe().axe_script + ONE_OF_EACH_LOOK)
    found = asked.run(page, options={"resultTypes": ["violations"], **options}).response
    violations = [
        (one["id"], one["impact"], [node["html"][:200] for node in one["nodes"][:3]])
        for one in found["violations"]
        if one["impact"] in ("serious", "critical")
    ]
    return violations, {one["id"] for one in found["passes"]}


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("section_v", 1280, "dark"),
        ("images", 1280, "light"),
        ("everything", 390, "dark"),
        *(("studies", width, scheme) for width, scheme in zip(WIDTHS, SCHEMES, strict=True)),
    ],
)
def test_axe_finds_nothing_serious(show, name: str, width: int, scheme: str) -> None:
    page = show(name, width, scheme, is_new=True)
    # Symbols have the colours of the text that they stand in; asked for each of ten thousand, axe takes a minute.
    assert page.evaluate(AS_TEXT) == 0
    assert page.evaluate(MARK_LOOKS) > 3
    violations, passed = serious(page)
    assert violations == []
    assert {"color-contrast", "heading-order", "document-title", "html-has-lang"} <= passed
    assert ("image-alt" in passed) == (name == "images")
    page.close()


def test_axe_finds_nothing_serious_in_formulas(show) -> None:
    violations, passed = serious(show("section_v"), rules={"color-contrast": {"enabled": False}})
    assert violations == []
    assert {"heading-order", "document-title"} <= passed


def test_axe_finds_one_text_among_many_that_is_hard_to_read(show) -> None:
    """A cell has the colour of others, but a grey of its own behind it; a symbol has a colour of its own."""
    page = show("section_v", is_new=True)
    page.evaluate("document.querySelector('mi').style.color = 'gray'")
    assert page.evaluate(AS_TEXT) == 1
    page.evaluate("[...document.querySelectorAll('td')].at(-1).style.background = 'gray'")
    page.evaluate(MARK_LOOKS)
    violations, _ = serious(page)
    assert [name for name, *_ in violations] == ["color-contrast"]
    page.close()


@pytest.mark.parametrize("width", [*WIDTHS, 320])
@pytest.mark.parametrize("name", REPORTS)
def test_nothing_overflows_the_page(show, name: str, width: int) -> None:
    """What is wider scrolls in a container that the keyboard reaches; no text is cut."""
    page = show(name, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    beyond = page.evaluate(
        """width => [...document.querySelectorAll("body *")]
            .filter(e => e.getBoundingClientRect().right > width + 1 && !e.closest(".scroll"))
            .map(e => e.tagName + "." + e.className)""",
        width,
    )
    assert beyond == []
    unreachable = page.evaluate(
        """[...document.querySelectorAll("body *")]
            .filter(e => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX === "auto")
            .filter(e => e.tabIndex !== 0 || !e.getAttribute("aria-label")).length"""
    )
    assert unreachable == 0


def test_dark_is_dark_and_light_is_light(show) -> None:
    brightness = {}
    for scheme in SCHEMES:
        color = show("section_v", scheme=scheme).evaluate("getComputedStyle(document.body).backgroundColor")
        brightness[scheme] = sum(map(int, re.findall(r"\d+", color)[:3])) / 3
    assert brightness["light"] > 240
    assert brightness["dark"] < 40


@pytest.mark.parametrize("name", [name for name in REPORTS if name != "studies"])
def test_mathml_has_height(show, name: str) -> None:
    sizes = show(name).evaluate(
        """[...document.querySelectorAll("math")].map(e => {
            const box = e.getBoundingClientRect(); return [box.width, box.height, e.textContent]})"""
    )
    assert len(sizes) > 20
    assert [text for width, height, text in sizes if width < 5 or height < 8] == []
    fractions = show(name).evaluate(
        """[...document.querySelectorAll("mfrac")].map(e => {
            const [top, bottom] = [...e.children].map(c => c.getBoundingClientRect());
            return bottom.top - top.bottom})"""
    )
    assert min(fractions) > -1  # the denominator stands below


@pytest.mark.parametrize("name", REPORTS)
def test_every_link_leads_to_something_that_is_seen(show, name: str) -> None:
    page = show(name)
    targets = page.evaluate(
        """[...document.querySelectorAll("a")].map(a => {
            const target = document.getElementById(decodeURIComponent(a.hash.slice(1)));
            return [a.getAttribute("href"), target ? target.getBoundingClientRect().height : -1]})"""
    )
    assert targets
    assert [href for href, height in targets if not href.startswith("#") or height <= 0] == []


def test_drawings_and_images_are_seen(show) -> None:
    sizes = show("images").evaluate(
        """[...document.querySelectorAll("figure svg, img")].map(e => {
            const box = e.getBoundingClientRect(); return [e.tagName, box.width, box.height, e.naturalWidth]})"""
    )
    assert len(sizes) == 2 + 3 + 1
    assert all(width > 50 and height > 50 for tag, width, height, _ in sizes if tag != "IMG")
    # Two by three pixels, each drawn three by three.
    assert {(width, height) for tag, width, height, _ in sizes if tag == "IMG"} == {(6, 9)}
    assert all(natural == 2 for tag, _, _, natural in sizes if tag == "IMG")


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", REPORTS)
def test_prints_to_a4_in_light_colours(show, name: str, scheme: str) -> None:
    page = show(name, scheme=scheme)
    if scheme == "light" or name != "everything":  # the longest: of a dark screen the others show the size of paper
        pdf = page.pdf(prefer_css_page_size=True)
        boxes = {tuple(map(float, box.split())) for box in re.findall(rb"/MediaBox\s*\[([^\]]*)\]", pdf)}
        (box,) = boxes
        # 210 mm × 297 mm in points, rounded by the browser to pixels of 0.75 pt.
        assert box[2] - box[0] == pytest.approx(595.28, abs=0.8)
        assert box[3] - box[1] == pytest.approx(841.89, abs=0.8)
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 688, "height": 1000})  # 182 mm between the margins
    assert page.evaluate("document.documentElement.scrollWidth") <= 690
    color = page.evaluate("getComputedStyle(document.body).color")
    assert sum(map(int, re.findall(r"\d+", color)[:3])) < 200
    assert page.evaluate("getComputedStyle(document.querySelector('thead')).display") == "table-header-group"


EXAMPLES = sorted((ROOT / "specs" / "missions").glob("*.yaml"))


def test_the_summary_of_a_mission_prints_to_four_pages(browser) -> None:
    """Of the examples by the model that prints most, the eight that are longest."""
    summaries = [render("html", Report("1.2.3", (found_in(path, "strictest"),)), Style()) for path in EXAMPLES]
    for summary in sorted(summaries, key=len)[-8:]:
        page = browser.new_page()
        page.set_content(summary)
        assert 1 <= pages_of(page.pdf(prefer_css_page_size=True)) <= 4
        page.close()


def test_pages_carry_mission_document_hash_and_number(browser, tmp_path: Path) -> None:
    if shutil.which("pdftotext") is None:
        pytest.skip("pdftotext is not installed")
    reports = [found_in(EXAMPLES[0]), found_in(SECTION_V)]
    page = browser.new_page()
    page.set_content(render("html", Report("1.2.3", tuple(reports)), Style()))
    (tmp_path / "report.pdf").write_bytes(page.pdf(prefer_css_page_size=True))
    page.close()
    command = ["pdftotext", "-layout", str(tmp_path / "report.pdf"), "-"]
    text = subprocess.run(command, capture_output=True, check=True, text=True).stdout
    printed = text.removesuffix("\f").split("\f")
    for number, one in enumerate(printed, start=1):
        assert re.search(rf"\b{number} ?/ ?{len(printed)}\b", one)
    for found in reports:
        digest = hashlib.sha256(found.mission.data).hexdigest()
        own = [one for one in printed if f"SHA-256 {digest}" in one]
        assert own
        assert all(one.strip().startswith(found.name) for one in own)


def pages_of(pdf: bytes) -> int:
    """Pages of a document as the browser writes it: one object of this type each."""
    return len(re.findall(rb"/Type\s*/Page\b", pdf))
