"""What the README shows is what the software does."""

import re
import shlex

import pytest

from bisar_budget.cli.check import check
from bisar_budget.report import FORMATS, format_of
from tests.conftest import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
FIGURES = (ROOT / "docs" / "section-v-figures.md").read_text(encoding="utf-8")


def blocks(language: str, page: str = README) -> list[str]:
    return re.findall(rf"(?ms)^```{language}\n(.*?)^```", page)


def shown() -> list[tuple[str, str]]:
    """Console blocks: each `$ command` with the output under it."""
    pairs = []
    for block in blocks("console") + blocks("console", FIGURES):
        for part in re.split(r"(?m)^\$ ", block)[1:]:
            command, _, output = part.partition("\n")
            pairs.append((command, output))
    return pairs


@pytest.mark.parametrize(
    ("command", "output"), shown(), ids=lambda value: value.splitlines()[0][:50] if value else "-"
)
def test_console_examples(run, monkeypatch, command: str, output: str) -> None:
    monkeypatch.chdir(ROOT)
    program, *arguments = shlex.split(command)
    assert program == "bisar-budget"
    got = run(*arguments).stdout.splitlines()
    want = output.rstrip("\n").splitlines()
    if "..." not in want:
        assert got == want
        return
    # `...` stands for lines left out.
    position = 0
    for line in want:
        if line == "...":
            continue
        position = got.index(line, position) + 1


@pytest.mark.parametrize("text", blocks("yaml"), ids=range(len(blocks("yaml"))))
def test_yaml_examples_pass_the_loader(run, text: str) -> None:
    result = run("check", "-", input=text)
    assert result.exit_code in (0, 1), result.output


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


def test_python_examples_run() -> None:
    for text in blocks("python"):
        exec(compile(text, "README.md", "exec"), {"__name__": "readme"})


def test_ci_runs_the_readmes_test_command() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    (command,) = [line for line in README.splitlines() if "pytest" in line and line.startswith("python3 -m venv")]
    assert command in script


def test_every_option_of_check_is_in_the_readme(run) -> None:
    options = re.findall(r"(?m)^\s+(?:-\w, )?(--[\w-]+)", run("check", "--help").stdout)
    assert len(options) > 8
    for option in options:
        if option != "--help":
            assert f"`{option}" in README or f"{option}`" in README, option


def test_the_commands_of_the_readme_are_those_of_the_help(run) -> None:
    listed = re.search(r"(?s)Commands:\n(.*)", run("--help").stdout)[1]
    commands = re.findall(r"(?m)^  (\w+) ", listed)
    assert commands
    assert set(re.findall(r"(?m)^\| `bisar-budget (\w+)", README)) == set(commands)


def test_the_formats_of_the_readme_are_those_of_check() -> None:
    (row,) = re.findall(r"(?m)^\| `--format text`.*?\|", README)
    assert set(re.findall(r"`(?:--format )?(\w+)`", row)) == FORMATS.keys()
    (row,) = re.findall(r"(?m)^\| `--report FILE`.*$", README)
    assert {format_of(f"a{suffix}") for suffix in re.findall(r"(?<=[( ])\.[\w.]+", row)} == FORMATS.keys() - {
        "github"
    }


def test_the_formats_of_the_command_are_those_of_the_registry() -> None:
    (choice,) = [option.type for option in check.params if option.name == "format_name"]
    assert set(choice.choices) == FORMATS.keys()


def test_links_inside_the_repository_exist() -> None:
    for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", README):
        assert (ROOT / target).exists(), target
