"""What commands do with the cases of `tests/fuzz_commands.py`, in this process: a result, or a message and 2.

Each function gives what is wrong as sentences, nothing where all is right.
"""

import contextlib
import csv
import io
import json
import re
import shutil
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from time import process_time
from unittest.mock import patch
from xml.etree import ElementTree

import numpy as np
from click.testing import CliRunner, Result

from bisar_budget.cli import cli
from bisar_budget.mission.load import parse_mission
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.path_formats import read_log
from bisar_budget.questions.asked import Asked
from tests.conftest import APART, ROOT, TODAY
from tests.fuzz import RAW, RUN
from tests.fuzz_commands import MISSION, Question, break_parts, broken_log, flown, radar_file, small_mission, targets

CODES = {name: {0, 1, 2} for name in ("solve", "sweep", "check", "allocate", "passes")}
SECTION_V = str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml")
# Three parts, which arrays hold.
SWEEP = ("sweep", SECTION_V, "--vary", "collection.aperture_time=1:2s:17000", "--date", TODAY.isoformat())
SLOWEST_LOG_S = 1.0  # of a file of some kilobytes
_COLOR = re.compile(r"\x1b\[[0-9;]*m")


def told(arguments: tuple[str, ...], folder: Path) -> Result:
    """Run a command in a folder."""
    with contextlib.chdir(folder):
        return CliRunner(**APART).invoke(cli, list(arguments))


def wrong(done: Result, arguments: tuple[str, ...]) -> Iterator[str]:
    """What is wrong with how a command ended, or with what it said."""
    said = f"{arguments} "
    if done.exit_code not in CODES.get(arguments[0], {0, 2}):
        yield f"{said}exits with {done.exit_code}: {done.stderr[-300:]!r}"
    if done.exit_code == 2 and not done.stderr:
        yield f"{said}says nothing"
    for stream in (done.stdout, done.stderr):
        if found := RAW.search(stream) or RUN.search(stream):
            yield f"{said}writes a raw {found[0]!r}"
    if any(word in done.stderr for word in ("Traceback", "Warning:", "memory ran out")):
        yield f"{said}says {done.stderr[-300:]!r}"


def answered(asked: Question, mission: bytes, folder: Path, tried: Counter[str]) -> Iterator[str]:
    """Ask a question about a mission, in a folder that has what it names."""
    kind = asked.arguments[0] if asked.arguments[0] in ("sweep", "solve") else "other questions"
    tried[kind] += 1
    given = {folder / name: data for name, data in {MISSION: mission, **asked.files}.items()}
    for path, data in given.items():
        path.write_bytes(data)
    before = set(folder.iterdir())
    done = told(asked.arguments, folder)
    tried[f"{kind} answered"] += done.exit_code != 2
    yield from wrong(done, asked.arguments)
    if any(path.read_bytes() != data for path, data in given.items()):
        yield f"{asked.arguments} changes what it read"
    written = [path for path in sorted(folder.iterdir()) if path not in before]
    if done.exit_code == 2 and written:
        yield f"{asked.arguments} leaves {[path.name for path in written]}"
    try:
        if done.exit_code != 2:
            _read(asked, done.stdout, written)
    except ValueError as error:
        yield f"{asked.arguments} writes what cannot be read: {str(error)[:200]}"


def _read(asked: Question, stdout: str, written: list[Path]) -> None:
    """Read results by other readers; `ValueError` where one refuses."""
    if "json" in asked.arguments and "o.txt" not in asked.arguments:
        json.loads(stdout, parse_constant=_not_a_number)
    if asked.arguments[0] == "sweep" and "-o" not in asked.arguments and "--plot" not in asked.arguments:
        _read_csv(stdout)
    for path in written:
        if path.suffix == ".csv":
            _read_csv(path.read_text(encoding="utf-8"))
        elif path.suffix == ".parquet":
            import pyarrow.parquet as pq

            pq.read_table(path)
        elif path.suffix == ".nc":
            import netCDF4

            netCDF4.Dataset(path).close()
        elif path.suffix == ".svg":
            try:
                ElementTree.parse(path)
            except ElementTree.ParseError as error:
                raise ValueError(error) from None
        elif path.suffix == ".yaml":
            parse_mission(path.read_text(encoding="utf-8"), str(path))
        elif path.name != "o.txt":
            raise ValueError(f"{path.name} is left")


def _not_a_number(constant: str) -> None:
    raise ValueError(f"{constant} in JSON")


def _read_csv(text: str) -> None:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    header, *rows = csv.reader(io.StringIO("\n".join(lines)), strict=True)
    if not rows or any(len(row) != len(header) for row in rows):
        raise ValueError("a table of other columns than its header, or without lines")


def on_paths(seed: int, folder: Path, tried: Counter[str]) -> Iterator[str]:
    """Check a mission that names an orbit or a log; of ten one is also swept, and the passes of two are listed."""
    for name, data in flown(seed).items():
        folder.joinpath(name).write_bytes(data)
    arguments: tuple[str, ...] = ("check", MISSION, "--format", ("json", "html", "text")[seed % 3])
    done = told(arguments, folder)
    tried["usable paths"] += done.exit_code != 2
    yield from wrong(done, arguments)
    if seed % 10 == 0:
        arguments = ("sweep", MISSION, "--vary", "collection.aperture_time=1:2s:3", "--jobs", "1")
        yield from wrong(told(arguments, folder), arguments)
    if seed % 5 == 1:
        form = ("json", "text", "csv", "ics")[seed // 5 % 4]
        arguments = ("passes", MISSION, "--from", "2026-06-01", "--days", "0.3", "--format", form)
        yield from wrong(told(arguments, folder), arguments)


def log_read(seed: int, folder: Path, tried: Counter[str]) -> Iterator[str]:
    """Read a damaged log: places that there can be, or one line that says why not, within a second."""
    name, data, stated, keys = broken_log(seed)
    begin = process_time()
    try:
        log = read_log(data, name, stated, keys)
    except PathFileError as error:
        said = " ".join((str(error), error.accepted, error.hint))
        if found := RAW.search(said):
            yield f"says a raw {found[0]!r}"
    else:
        tried["usable logs"] += 1
        if not (np.isfinite(log.places).all() and np.isfinite(log.times).all() and (np.diff(log.times) > 0).all()):
            yield "has places or times that there cannot be"
        if RAW.search(log.words):
            yield "has raw words"
    if process_time() - begin > SLOWEST_LOG_S:
        yield f"takes {process_time() - begin:.1f} s"


def imported(seed: int, folder: Path, tried: Counter[str]) -> Iterator[str]:
    """Make a mission of a damaged radar file, which a check can use then; one in ten writes such a file instead."""
    if seed % 10 == 0:
        folder.joinpath(MISSION).write_text(small_mission())
        folder.joinpath("t.csv").write_text("east [m],north [m],amplitude\n0,0,1\n3,-2,0.5\n")
        arguments = targets(seed)
        done = told(arguments, folder)
        yield from wrong(done, arguments)
        tried["radar files written"] += done.exit_code == 0
        if done.exit_code == 0 and not folder.joinpath("o.cphd").read_bytes().startswith(b"CPHD/"):
            yield f"{arguments} writes no CPHD"
        return
    folder.joinpath("a.bin").write_bytes(radar_file(seed))
    arguments = ("import", "a.bin", "-o", MISSION)
    done = told(arguments, folder)
    yield from wrong(done, arguments)
    if done.exit_code == 2 and folder.joinpath(MISSION).exists():
        yield "import leaves a mission that it refuses"
    if done.exit_code == 0:
        tried["imported"] += 1
        found = told(("check", MISSION, "--format", "json"), folder)
        if found.exit_code not in (0, 1):
            yield f"what is imported cannot be checked: {found.exit_code} {found.stderr[-300:]!r}"


@cache
def _kept_parts() -> tuple[Path, bytes]:
    """A folder with the output's folder of parts, two of three done, and the bytes of the whole table."""
    folder = Path(mkdtemp())
    whole = told((*SWEEP, "-o", "t.csv"), folder)
    assert whole.exit_code == 0, whole.stderr
    data = (folder / "t.csv").read_bytes()
    (folder / "t.csv").unlink()
    shared_out = Asked.shared_out

    def broken(self: Asked, *arguments: object) -> Iterator[object]:
        found = shared_out(self, *arguments)  # type: ignore[arg-type]
        yield next(found)
        yield next(found)
        raise KeyboardInterrupt

    with patch.object(Asked, "shared_out", broken):
        assert told((*SWEEP, "-o", "t.csv", "--resume"), folder).exit_code == 130
    return folder / "t.csv.parts", data


def kept(seed: int, folder: Path, tried: Counter[str]) -> Iterator[str]:
    """Go on from parts of which one is damaged."""
    parts, expected = _kept_parts()
    here = folder / "t.csv.parts"
    shutil.copytree(parts, here)
    how = break_parts(here, seed)
    arguments = (*SWEEP, "-o", "t.csv", "--resume")
    done = told(arguments, folder)
    yield from (f"{how}: {what}" for what in wrong(done, arguments))
    output = folder / "t.csv"
    tried["parts gone on from"] += done.exit_code == 0
    if done.exit_code == 0 and output.read_bytes() != expected:
        yield f"{how}: the table is another"
    if done.exit_code == 2 and output.exists():
        yield f"{how}: half a table"
