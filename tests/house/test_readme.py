"""What the README shows is what the software does. Pages of `docs` are held to the same when the site is built."""

import json
import re
from pathlib import Path

import pytest

from bisar_budget.cli.check import check
from bisar_budget.report import FORMATS
from docs._ext.blocks import EXECUTED, ExampleError, Page, blocks
from docs._ext.links import broken_links
from tests.conftest import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
FIGURES = (ROOT / "docs" / "section-v-figures.md").read_text(encoding="utf-8")
PAGES = sorted((ROOT / "docs").rglob("*.md"))


@pytest.fixture
def page(tmp_path: Path) -> Page:
    return Page(tmp_path)


def test_the_examples_of_the_readme_do_what_it_says(page: Page) -> None:
    executed = [(language, text) for language, text in blocks(README) if language in EXECUTED]
    assert {"console", "yaml"} == {language for language, _ in executed}
    for language, text in executed:
        page.run(language, text)


class TestExamples:
    """What runs the examples of the README and of the site says so when one does something else."""

    def test_an_example_that_is_right_is_shown_as_it_stands(self, page: Page) -> None:
        text = "$ printf 'a\\nb\\nc\\n'\na\n...\nc\n$ false\n$ echo $?\n1\n"
        assert page.run("console", text) == text.rstrip("\n")

    def test_an_output_that_is_not_stated_is_filled_in(self, page: Page) -> None:
        assert page.run("console", "$ echo a b\n") == "$ echo a b\na b"

    @pytest.mark.parametrize(
        "stated", ["b\n", "a\n", "a\nb\nc\n", "...\na\n", "b\n...\n", "a\n...\na\n"], ids=lambda text: repr(text)
    )
    def test_another_output(self, page: Page, stated: str) -> None:
        with pytest.raises(ExampleError, match="prints something else"):
            page.run("console", f"$ printf 'a\\nb\\n'\n{stated}")

    def test_all_other_outputs_of_a_block_are_named(self, page: Page) -> None:
        """A page with two rows of another width was mended in one of them, and refused again."""
        with pytest.raises(ExampleError, match=r"(?s)`echo a` prints something else.*`echo c` prints something else"):
            page.run("console", "$ echo a\nx\n$ echo b\nb\n$ echo c\ny\n")

    @pytest.mark.parametrize(
        "stated", ["2.8002236 s", "2.800220 s", "99.9999961 %", "0.00123456789", "1.5", "12345678.9"]
    )
    def test_digits_behind_the_sixth_are_not_compared(self, page: Page, stated: str) -> None:
        """The last digits of a search are those of a processor: a page printed on another one would be refused."""
        number, _, unit = stated.partition(" ")
        printed = f"{number}7 {unit}".strip() if len(number) > 7 else stated
        page.run("console", f"$ echo '{printed}'\n{stated}\n")

    @pytest.mark.parametrize(
        ("stated", "printed"), [("2.8002236", "2.8003236"), ("1.5", "1.51"), ("12345678.9", "12345679.9")]
    )
    def test_the_first_six_digits_are_compared(self, page: Page, stated: str, printed: str) -> None:
        with pytest.raises(ExampleError, match="prints something else"):
            page.run("console", f"$ echo {printed}\n{stated}\n")

    @pytest.mark.parametrize("text", ["$ false\n", "$ false\n$ echo a\na\n"])
    def test_an_exit_code_that_is_not_stated(self, page: Page, text: str) -> None:
        with pytest.raises(ExampleError, match="exits with 1"):
            page.run("console", text)

    def test_another_exit_code(self, page: Page) -> None:
        with pytest.raises(ExampleError, match=r"-1\n\+2"):
            page.run("console", "$ bisar-budget check nothing.yaml\n...\n$ echo $?\n1\n")

    @pytest.mark.parametrize("text", ["schema_version: 1\nname: nothing else\n", "autofocus: { n_pul: 2 }\n"])
    def test_a_mission_file_that_cannot_be_used(self, page: Page, text: str) -> None:
        with pytest.raises(ExampleError, match="cannot be used"):
            page.run("yaml", text)

    def test_the_file_of_a_part(self, page: Page) -> None:
        text = "kind: imu\nname: x\nsource: y\ngyro_bias: 1 deg/h\n"
        page.run("yaml", text)
        with pytest.raises(ExampleError, match="-:4:12: gyro_bias: must be an angular rate"):
            page.run("yaml", text.replace("deg/h", "mg"))
        assert page.exit_code == 0

    def test_a_part_of_a_mission_file(self, page: Page) -> None:
        page.run("yaml", "platforms: { receiver: { motion_error: { velocity: 5 mm/s } } }\n", "part.yaml")
        assert page.run("console", "$ cat part.yaml\n").endswith("5 mm/s } } }")

    @pytest.mark.parametrize(("language", "text"), [("python", "assert 1 > 2\n"), ("pycon", ">>> 1 + 1\n3\n")])
    def test_python_that_is_wrong(self, page: Page, language: str, text: str) -> None:
        with pytest.raises(ExampleError):
            page.run(language, text)

    def test_the_blocks_of_a_page_share_names(self, page: Page) -> None:
        page.run("python", "a = 2\n")
        page.run("pycon", ">>> b = a + 1\n>>> b\n3\n")
        page.run("python", "assert b == 3\n")


def test_a_broken_link_of_the_site_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        "<a href='b.html#there'></a><a href='#here'></a><a href='https://example.org/x'></a><h1 id='here'>"
    )
    (tmp_path / "b.html").write_text("<p id='there'></p><a href='a.html#gone'></a><img src='none.svg'>")
    assert broken_links(tmp_path) == ["b.html: a.html#gone", "b.html: none.svg"]


def test_the_page_of_figures_shows_every_picture_that_the_script_draws() -> None:
    """And no other one; each is small."""
    script = (ROOT / "docs" / "make_figures.py").read_text(encoding="utf-8")
    listed = re.search(r"(?ms)^PICTURES = \((.*?)^\)", script)
    assert listed is not None
    drawn = {f"section-v-figures/{name}.png" for name in re.findall(r'(?m)^    \("([^"]+)"', listed[1])}
    linked = re.findall(r"!\[[^]]+\]\(([^)]+)\)", FIGURES)
    assert sorted(linked) == sorted(drawn)
    folder = ROOT / "docs" / "section-v-figures"
    assert {f"section-v-figures/{file.name}" for file in folder.iterdir()} == drawn
    assert all(file.stat().st_size < 150e3 for file in folder.iterdir())


def test_ci_runs_the_readmes_commands() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    (command,) = [line for line in README.splitlines() if "pytest" in line and line.startswith("python3 -m venv")]
    assert command in script
    (command,) = [line for line in README.splitlines() if "sphinx-build" in line]
    assert command in script


def test_ci_repeats_every_test_of_the_extras() -> None:
    """It collects some folders for them, not all."""
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    folders = [ROOT / folder for named in re.findall(r"(?m)-m extras (.+)$", script) for folder in named.split()]
    marked = [file for file in (ROOT / "tests").rglob("test_*.py") if "pytest.mark.extras" in file.read_text("utf-8")]
    elsewhere = [file for file in marked if file.name != Path(__file__).name and file.parent not in folders]
    assert (len(marked) > 5, elsewhere) == (True, [])


def test_the_thorough_tests_are_run_before_a_release() -> None:
    script = (ROOT / ".ci" / "before-release").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "contributing" / "index.md").read_text(encoding="utf-8")
    assert "bash .ci/run\n" in script
    assert "pytest -n auto -m thorough\n" in script
    assert "```sh\npytest -n auto -m thorough\n```" in page


def test_the_formats_of_the_command_are_those_of_the_registry() -> None:
    (choice,) = [option.type for option in check.params if option.name == "format_name"]
    assert set(choice.choices) == FORMATS.keys()


def test_links_inside_the_repository_exist() -> None:
    for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", README):
        assert (ROOT / target).exists(), target


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) <= 150


def sentences(page: str) -> set[str]:
    """Sentences of a page that are long enough to be somebody's own; examples may be the same."""
    prose = " ".join(re.sub(r"(?ms)^(`{3,}).*?^\1", "", page).replace("|", ". ").split())
    return {sentence for sentence in re.split(r"(?<=[.:;!?]) ", prose) if len(sentence) > 40}


def test_no_sentence_stands_both_in_the_readme_and_on_a_page() -> None:
    for file in PAGES:
        assert sentences(README) & sentences(file.read_text(encoding="utf-8")) == set(), file


def test_every_page_has_a_place_in_the_site() -> None:
    listed = {
        (index.parent / entry).resolve()
        for index in PAGES
        for language, text in blocks(index.read_text(encoding="utf-8"))
        if language == "{toctree}"
        for entry in text.splitlines()
        if entry and not entry.startswith(":")
    }
    pages = [*PAGES, *(ROOT / "docs").rglob("*.ipynb")]
    assert listed == {page.with_suffix("").resolve() for page in pages} - {(ROOT / "docs" / "index").resolve()}


@pytest.mark.parametrize("path", sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_what_it_prints(path: Path) -> None:
    """The build of the docs runs it; outputs in the file would be another run's."""
    cells = [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert cells
    assert not any(cell["outputs"] or cell["execution_count"] for cell in cells)
