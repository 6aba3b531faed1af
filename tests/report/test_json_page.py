"""The page of the JSON names every key that the examples have."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.report import Style, render
from tests.conftest import ROOT, found_in

PAGE = (ROOT / "docs" / "reference" / "json.md").read_text(encoding="utf-8")
KEYS = set(re.findall(r"(?m)^([\w\[\].]+): ", PAGE.split("```{json-keys}\n")[1].split("```")[0]))
MISSIONS = sorted((ROOT / "specs" / "missions").glob("*.yaml"))


def keys_of(value: Any, path: tuple[str, ...] = ()) -> Iterator[str]:
    """Keys down to the values; those of `summary` are statuses."""
    if isinstance(value, dict) and path[-1:] != ("summary",):
        for key, item in value.items():
            yield from keys_of(item, (*path, key))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for item in value:
            yield from keys_of(item, (*path[:-1], f"{path[-1]}[]"))
    else:
        yield ".".join(path)


def is_described(key: str) -> bool:
    """Whether a key is on the page: itself, a part of it as a whole, or what it has where it is not null."""
    levels = key.split(".")
    above = {".".join(levels[: count + 1]).removesuffix("[]") for count in range(len(levels))}
    return bool(above & KEYS) or any(one.startswith((f"{key}.", f"{key}[]")) for one in KEYS)


@pytest.mark.parametrize("mission", MISSIONS, ids=lambda path: path.stem)
def test_every_key_is_on_the_page(mission: Path) -> None:
    """`geometry.*.path` was not."""
    document = json.loads(render("json", Report(version="0", missions=(found_in(mission),)), Style()))
    assert [key for key in dict.fromkeys(keys_of(document)) if not is_described(key)] == []


def test_a_key_that_is_not_there_is_missed() -> None:
    assert not is_described("missions[].geometry.receiver.path.other")
    assert not is_described("missions[].rows[].shifted")
