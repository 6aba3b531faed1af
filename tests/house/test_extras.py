"""Optional parts of the tool: what a message tells a user to install is what the part needs, from its own authors."""

import re
import tomllib

from bisar_budget.extras import PACKAGES_OF_EXTRA, install_command
from tests.conftest import ROOT

OF_DEVELOPERS = {"bench", "dev", "docs", "test"}
# What a shell would be given: the tool by the name that it has nowhere yet. `./bisar-budget[orbits]` is a folder.
BY_UNPUBLISHED_NAME = re.compile(r"pip install (?:-\S+ )*['\"]?bisar[-_]budget\b(?! @)")


def test_the_packages_of_an_extra_are_those_of_pyproject() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {
        extra: tuple(sorted((re.split(r"[<>=\[]", package)[0] for package in packages), key=str.lower))
        for extra, packages in project["optional-dependencies"].items()
        if extra not in OF_DEVELOPERS
    }
    assert dict(PACKAGES_OF_EXTRA) == extras


def test_the_command_of_an_extra_names_its_packages() -> None:
    assert install_command("orbits") == "pip install pyerfa sgp4"


def test_nothing_tells_a_user_to_install_the_tool_by_a_name_that_is_not_its_own_yet() -> None:
    pages = [ROOT / "README.md", ROOT / "action.yml"]
    for folder, suffix in (("bisar_budget", "*.py"), ("docs", "*.md"), ("templates", "*"), ("specs", "*.yaml")):
        pages += [page for page in (ROOT / folder).rglob(suffix) if page.is_file()]
    wrong = {page.name for page in pages if BY_UNPUBLISHED_NAME.search(page.read_text(encoding="utf-8"))}
    assert not wrong
    assert BY_UNPUBLISHED_NAME.search("pip install 'bisar-budget[orbits]'")
    assert not BY_UNPUBLISHED_NAME.search("pip install './bisar-budget[orbits]'")
