"""Comparisons can fail, either way, and their rows reach a file."""

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.outside import record
from tests.outside.record import compare


@pytest.fixture(autouse=True)
def _apart() -> Iterator[None]:
    """These are no comparisons with anyone: they are not kept."""
    yield
    record.rows.clear()


@pytest.mark.parametrize("here", [1.2, 0.8, math.nan, math.inf])
def test_a_value_off_by_more_than_the_tolerance_fails(here: float) -> None:
    compare("a length", 1.0, 1.1, "m", 0.11, "a test")
    with pytest.raises(AssertionError, match="a length"):
        compare("a length", 1.0, here, "m", 0.11, "a test")


def test_a_reason_for_a_disagreement_that_is_gone_fails() -> None:
    compare("a length", 1.0, 1.2, "m", 0.11, "a test", reason="another frame")
    with pytest.raises(AssertionError, match="they agree"):
        compare("a length", 1.0, 1.1, "m", 0.11, "a test", reason="another frame")
    with pytest.raises(AssertionError, match="nan"):
        compare("a length", 1.0, math.nan, "m", 0.11, "a test", reason="another frame")


def test_rows_reach_a_file(tmp_path: Path) -> None:
    test = tmp_path / "test_one.py"
    test.write_text(
        "from tests.outside.conftest import _written\n"
        "from tests.outside.record import compare\n"
        "def test_one():\n    compare('a length', 1.0, 1.1, 'm', 0.11, 'a test', '2nd edition')\n"
    )
    alone = ["-p", "no:cacheprovider", "-c", ROOT / "pyproject.toml", "--rootdir", ROOT]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}
    subprocess.run(
        [sys.executable, "-m", "pytest", *alone, test],
        cwd=ROOT,
        env=environment | {"COMPARED_OUTSIDE": str(tmp_path)},
        check=True,
        capture_output=True,
    )
    (row,) = json.loads((tmp_path / "test_one.all.json").read_text())
    assert row == {
        "what": "a length",
        "there": 1.0,
        "here": 1.1,
        "unit": "m",
        "tolerance": 0.11,
        "source": "a test",
        "version": "2nd edition",
        "reason": "",
    }
