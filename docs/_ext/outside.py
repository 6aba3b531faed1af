"""Sphinx: what the tests of `tests/outside` compared, as tables; the pages show what the tests have just found.

The rows are those that the tests leave in the folder of COMPARED_OUTSIDE. Where that is not set, the tests run.
"""

import ast
import json
import math
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from blocks import ROOT
from generated import Generated, joined, table
from sphinx.application import Sphinx

TESTS = ROOT / "tests" / "outside"
FOLDER = "COMPARED_OUTSIDE"
_PICTURE = "pictures/side-by-side.png"

Row = dict[str, Any]


@cache
def _compared() -> dict[str, list[Row]]:
    """Rows by the name of the test file that made them.

    Raises
    ------
    ValueError
        A comparison fails, or there is none.
    """
    if FOLDER in os.environ:
        return _read(Path(os.environ[FOLDER]))
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", str(TESTS)]
        done = subprocess.run(command, cwd=ROOT, env=os.environ | {FOLDER: folder}, capture_output=True, text=True)
        if done.returncode:
            raise ValueError(done.stdout + done.stderr)
        return _read(Path(folder))


def _read(folder: Path) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = defaultdict(list)
    for file in sorted(folder.glob("*.json")):
        found[file.name.partition(".")[0]] += json.loads(file.read_text(encoding="utf-8"))
    if not found:
        raise ValueError(f"{folder}: no comparisons; run pytest with {FOLDER} set to this folder")
    return found


def _digits(value: float, tolerance: float) -> str:
    """A number to the digit in which its tolerance is."""
    if not value:
        return "0"
    count = math.floor(math.log10(abs(value))) - math.floor(math.log10(tolerance)) + 1
    return f"{value:#.{min(max(count, 2), 15)}g}".rstrip(".").replace("-", "−")


def _against(row: Row) -> str:
    """Ratio of the two; of levels the difference."""
    there, here = row["there"], row["here"]
    if row["unit"].startswith("dB"):
        decimals = max(0, -math.floor(math.log10(row["tolerance"])))
        return f"{here - there:+.{decimals}f} dB".replace("-", "−")
    return f"{here / there:.6g}" if there else ""


def _cells(row: Row, name: str) -> Iterable[str]:
    values = (_digits(row[side], row["tolerance"]) for side in ("there", "here"))
    return (name, *(f"{value} {row['unit']}" for value in values), _against(row), f"{row['tolerance']:.2g}")


def _by_source(rows: list[Row]) -> Iterable[str]:
    sources: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        sources[", ".join(filter(None, (row["source"], row["version"])))].append(row)
    for source, of_it in sources.items():
        yield f"**{source}**"
        cells = (_cells(row, row["what"] + (" [differs](#disagreements)" if row["reason"] else "")) for row in of_it)
        yield table(("value", "there", "here", "ratio", "tolerance"), cells)


def comparisons(directive: Generated) -> str:
    """Every comparison: a section for each test file, with the body's title and the words of its own docstring."""
    found, titles = _compared(), directive.words()
    joined(found, titles, "test files that compare")
    parts = []
    for name, title in titles.items():
        file = TESTS / f"{name}.py"
        directive.env.note_dependency(str(file))
        says = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
        parts += [f"## {title}", says, *_by_source(found[name])]
    return "\n\n".join(parts)


def _rows() -> list[Row]:
    return [row for of_file in _compared().values() for row in of_file]


def disagreements(_: Generated) -> str:
    """How many values are compared, and how many differ."""
    rows = _rows()
    differ, sources = sum(bool(row["reason"]) for row in rows), len({row["source"] for row in rows})
    agree = len(rows) - differ
    return f"{agree} of {len(rows)} values from {sources} sources agree. {differ} differ, each with a reason."


def differing(_: Generated) -> str:
    """Values that differ, with the reason."""
    heads = ("value", "there", "here", "ratio", "because")
    rows = [row for row in _rows() if row["reason"]]
    return table(heads, ((*list(_cells(row, f"{row['what']}; {row['source']}"))[:4], row["reason"]) for row in rows))


def side_by_side(directive: Generated) -> str:
    """Images of an independent processor beside those of the package, drawn by the tests' own script."""
    directive.env.note_dependency(str(TESTS / "side_by_side.py"))
    file = Path(Generated.folder, _PICTURE)
    file.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "tests.outside.side_by_side", str(file)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(done.stderr)
    words = " ".join(directive.content)
    up = "../" * directive.env.docname.count("/")
    return f"```{{raw}} html\n<p><img src='{up}{_PICTURE}' alt='{words}'></p>\n```"


DIRECTIVES = {
    "comparisons": comparisons,
    "disagreements": disagreements,
    "differing": differing,
    "side-by-side": side_by_side,
}


def setup(app: Sphinx) -> dict[str, bool]:
    """Register a directive for each function."""
    for name, write in DIRECTIVES.items():
        app.add_directive(name, type(f"{write.__name__.title()}Directive", (Generated,), {"write": write}))
    return {"parallel_read_safe": True}
