"""The long round of hostile use: fuzzed files through every reader and format, settings, processes, signals, limits.

    python docs/prove_hostile.py                        # 1 000 files, minutes
    python docs/prove_hostile.py --files 100000 --write # hours; and record the result in docs/hostile.md

Cases are those of `tests/fuzz.py`, by seed: `python -m tests.fuzz SEED` prints the file of one that is named here. In
this process a file is loaded, checked by a model, written in every format, compared with the mission before it and
explained. One file in fifty also goes through processes of its own. Any miss makes the exit code 1.
"""

import argparse
import csv
import io
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from random import Random
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
os.environ.setdefault("OMP_NUM_THREADS", "1")

from bisar_budget.budget.check import check_mission
from bisar_budget.cli.streams import harmless
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.status import exit_code
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.tree import MAX_BYTES
from bisar_budget.report import FORMATS, Style, pictures, render
from bisar_budget.report.change import difference
from bisar_budget.report.change.comparison import compare
from bisar_budget.report.explain.explanation import explain
from bisar_budget.settings import SettingsError, project_settings
from tests.conftest import ROOT, TODAY
from tests.fuzz import RAW, RUN, case, original, strict_settings
from tests.recorded import record

PAGE = Path(__file__).with_name("hostile.md")
COMMAND = [sys.executable, "-m", "bisar_budget"]
HANG_S = 60  # the slowest case that is right takes a few seconds
OWN_PROCESS = 50  # one file in so many
LARGEST = 16 * MAX_BYTES  # of a report of one file
_DIFFERENCES: dict[str, Callable[..., str]] = {
    "text": partial(difference.as_text, tolerated=0.1, all_rows=True),
    "markdown": partial(difference.as_markdown, tolerated=0.1, all_rows=True),
    "json": lambda changes: difference.as_json("", changes, 0.1),
}
Outcome = tuple[Counter[str], list[str]]  # cases by kind, and what was mishandled


class _HangError(BaseException):
    """A case took too long."""


def _hang(*_: object) -> None:
    raise _HangError


def files(seeds: range) -> Outcome:
    """Feed the files of some seeds; the mission before each is the one to compare it with."""
    warnings.simplefilter("error")  # in this process nothing a library warns of goes by
    warnings.filterwarnings("ignore", category=DeprecationWarning)
    signal.signal(signal.SIGALRM, _hang)
    tried, missed = Counter[str](), list[str]()
    before: MissionFindings | None = None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "m.yaml")
        for seed in seeds:
            stage = ["load"]
            signal.alarm(HANG_S)
            try:
                before = _file(seed, path, before, tried, stage, missed)
            except _HangError:
                missed.append(f"seed {seed}: {stage[-1]}: hangs")
            except Exception as error:
                missed.append(f"seed {seed}: {stage[-1]}: {type(error).__name__}: {str(error)[:200]!r}")
            finally:
                signal.alarm(0)
            if seed % OWN_PROCESS == 0:
                missed += [f"seed {seed}: {what}" for what in _processes(seed, path, tried)]
    return tried, missed


def _file(
    seed: int, path: Path, before: MissionFindings | None, tried: Counter[str], stage: list[str], missed: list[str]
) -> MissionFindings | None:
    """Feed one file; the findings to compare the next with."""
    random, hostile = Random(seed), case(seed)
    path.write_bytes(hostile.data)
    model = random.choice((None, None, "published", "full", "strictest"))
    tried["files"] += 1
    try:
        mission: Mission = load_mission(str(path), model)
        stage.append("check")
        found: MissionFindings | UnusableMission = check_mission(mission, TODAY)
    except MissionError as error:
        found = UnusableMission(file=str(path), faults=error.faults, data=error.data)
        missed += [f"seed {seed}: raw: {line!r}" for line in error.lines() if RAW.search(line) or "\n" in line]
    if hostile.is_misspelt:
        tried["misspelt keys"] += 1
        if isinstance(found, MissionFindings):
            missed.append(f"seed {seed}: a misspelt key was passed over")
    if isinstance(found, MissionFindings):
        tried["usable"] += 1
    color, verbosity, detail = random.random() < 0.2, random.choice((-1, 0, 1)), random.choice(("summary", "full"))
    style = Style(color=color, verbosity=verbosity, all_rows=random.random() < 0.3, detail=detail, assets="x.assets")
    report = Report(version="0", missions=(found,), day=TODAY)
    for name in FORMATS:
        stage.append(name)
        text = harmless(render(name, report, style), name)
        tried["reports"] += 1
        missed += [f"seed {seed}: {name}: {what}" for what in _wrong(text, name)]
        for content in pictures(name, report, style).values():
            if not content.startswith(b"\x89PNG"):
                ElementTree.fromstring(content)
    if not isinstance(found, MissionFindings):
        return before
    for name, write in _DIFFERENCES.items():
        stage.append(f"diff {name}")
        changes = [compare(found if before is None else before, found)]
        missed += [f"seed {seed}: diff {name}: {what}" for what in _wrong(harmless(write(changes), name), name)]
        tried["comparisons"] += 1
    for row in random.sample(found.rows, 2):
        stage.append(f"explain {row.id}")
        missed += [
            f"seed {seed}: explain: {what}" for what in _wrong(harmless(explain(mission, found, row.id)), "text")
        ]
        tried["explanations"] += 1
    return found


def _wrong(text: str, name: str) -> Iterator[str]:
    """What is wrong with a report as it would leave."""
    if len(text) > LARGEST:
        yield f"{len(text)} characters"
    bare = text.replace("\x1b[0m", "").replace("\x1b[", "") if name == "text" else text
    if found := RAW.search(bare):
        yield f"raw {found[0]!r}"
    if name != "github" and (command := RUN.search(text)):
        yield f"command {command[0]!r}"
    if name in ("json", "sarif", "needs"):
        json.loads(text, parse_constant=_not_a_number)
    elif name == "junit":
        ElementTree.fromstring(text.encode())
    elif name == "csv":
        header, *rows = csv.reader(io.StringIO(text), strict=True)
        if any(len(row) != len(header) for row in rows):
            yield "a line has other columns than the header"
    elif {"nan", "inf"} & set(text.split()):  # as Python writes them; the files do otherwise
        yield "says nan or inf"


def _not_a_number(constant: str) -> None:
    raise ValueError(f"{constant} in JSON")


def _processes(seed: int, path: Path, tried: Counter[str]) -> Iterator[str]:
    """Run commands on a file; each ends in time, with the code of the file, and says nothing raw."""
    try:
        codes = {exit_code({check_mission(load_mission(str(path)), TODAY).status}, True)}
    except MissionError:
        codes = {2}
    other = path.with_name("other.yaml")
    other.write_text(original(Random(seed)), encoding="utf-8")
    name = str(path)
    format_name = Random(seed).choice(list(FORMATS))
    check = ["check", "--date", TODAY.isoformat(), "--strict"]
    for arguments, expected in (
        ([*check, "--format", format_name, name], codes),
        ([*check, "--report", str(path.with_name("r.md")), "-o", str(path.with_name("r.sarif")), name], codes),
        ([*check, "-"], codes),
        (["check", name, "--explain", "receiver.velocity.x"], {2} if codes == {2} else {0}),
        (["diff", name, str(other), "--format", "markdown"], {2} if codes == {2} else {0}),
        (["diff", str(other), name, "--fail-on-erosion", "10%"], {2} if codes == {2} else {0, 1}),
    ):
        tried["processes"] += 1
        try:
            done = subprocess.run(
                [*COMMAND, *arguments], input=path.read_bytes(), capture_output=True, cwd=ROOT, timeout=HANG_S
            )
        except subprocess.TimeoutExpired:
            yield f"{arguments} hangs"
            continue
        if done.returncode not in expected:
            yield f"{arguments} exits with {done.returncode}, not {expected}: {done.stderr[-300:]!r}"
        if b"Traceback" in done.stderr:
            yield f"{arguments}: {done.stderr[-300:]!r}"
        for stream in (done.stdout, done.stderr):
            if found := RAW.search(stream.decode("utf-8")):
                yield f"{arguments} writes a raw {found[0]!r}"


def settings(seeds: range) -> Outcome:
    """Feed settings that say `strict`: read, or refused, unless tomllib finds no such key or it names no tool."""
    tried, missed = Counter[str](), list[str]()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "pyproject.toml")
        for seed in seeds:
            tried["settings"] += 1
            data = strict_settings(seed)
            path.write_bytes(data)
            try:
                found = project_settings(folder)
                is_strict = found is not None and found.values.get("strict") is True
            except SettingsError:
                continue
            except Exception as error:
                missed.append(f"settings {seed}: {type(error).__name__}: {error}")
                continue
            try:
                table = tomllib.loads(data.decode("utf-8"))["tool"]["bisar-budget"]
                says_strict = table["strict"] is True
            except (KeyError, TypeError):
                says_strict = False
            except ValueError:
                says_strict = b"bisar-budget" in data  # what is no TOML may say it
            if says_strict and not is_strict:
                missed.append(f"settings {seed}: passed over: {data!r}")
    return tried, missed


def signals(seeds: range) -> Outcome:
    """Send a signal at any time; nothing is left behind, and the old report stays until the new one is whole."""
    tried, missed = Counter[str](), list[str]()
    missions = [str(path) for path in sorted((ROOT / "specs" / "missions").glob("*.yaml"))]
    for seed in seeds:
        random = Random(seed)
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder, "report.html")
            report.write_text("old")
            arguments = random.choice(
                (
                    ["check", *missions, "--report", str(report), "-o", str(Path(folder, "a.json"))],
                    ["verify", missions[2], "--only", "receiver.*", "--jobs", "2", "-o", str(report)],
                    ["simulate", missions[2], "--plot", str(Path(folder, "p.png"))],
                )
            )
            number = random.choice((signal.SIGTERM, signal.SIGINT, signal.SIGHUP))
            tried["signals"] += 1
            process = subprocess.Popen(
                [*COMMAND, *arguments],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                cwd=ROOT,
                start_new_session=True,
            )
            time.sleep(random.uniform(0.3, 6))  # Python itself takes the first tenths, with handlers of its own
            process.send_signal(number)
            try:
                errors = process.communicate(timeout=HANG_S)[1]  # ends when nobody holds the pipes
            except subprocess.TimeoutExpired:
                missed.append(f"signals {seed}: {arguments[0]} hangs after {number.name}")
                os.killpg(process.pid, signal.SIGKILL)
                continue
            code = process.returncode
            if code not in (0, 1, 128 + number, -number):  # before our handlers, the system's own end
                missed.append(
                    f"signals {seed}: {arguments[0]} exits with {code} after {number.name}: {errors[-300:]!r}"
                )
            if b"Traceback" in errors and code != -number:
                missed.append(f"signals {seed}: {errors[-300:]!r}")
            left = [path.name for path in Path(folder).iterdir() if path.name.startswith(".")]
            text = report.read_text(encoding="utf-8")
            if left or not (text == "old" or text.rstrip().endswith(("</html>", "}", ".")) or "verify" in arguments):
                missed.append(f"signals {seed}: leaves {left}, {len(text)} characters of a report")
    return tried, missed


def limits(seeds: range) -> Outcome:
    """Run with few descriptors, small files or full devices: 2, with a message, or the result."""
    import resource

    tried, missed = Counter[str](), list[str]()
    mission = str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml")
    for seed in seeds:
        random = Random(seed)
        kind, size = random.choice(
            (
                (resource.RLIMIT_NOFILE, random.randint(4, 24)),
                (resource.RLIMIT_FSIZE, random.randint(0, 20_000)),
            )
        )
        with tempfile.TemporaryDirectory() as folder, open("/dev/full", "wb") as full:
            report = Path(folder, "r.html")
            report.write_text("old")
            arguments = random.choice(
                (
                    ["check", mission, "--format", "html", "-o", str(report)],
                    ["check", mission, "--format", "json"],
                    ["check", mission, "--report", str(Path(folder, "r.md")), "--report", str(report)],
                    ["verify", mission, "--only", "timing.quadratic", "--jobs", random.choice("12")],
                    ["simulate", mission, "--plot", str(Path(folder, "p.svg"))],
                    ["diff", mission, mission],
                    ["schema"],
                )
            )
            output = random.choice((subprocess.PIPE, subprocess.PIPE, full))
            tried["limits"] += 1
            try:
                done = subprocess.run(
                    [*COMMAND, *arguments],
                    stdout=output,
                    stderr=subprocess.PIPE,
                    cwd=ROOT,
                    timeout=5 * HANG_S,
                    preexec_fn=partial(resource.setrlimit, kind, (size, size)),
                    env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
                )
            except subprocess.TimeoutExpired:
                missed.append(f"limits {seed}: {arguments} hangs")
                continue
            if done.returncode not in (0, 1, 2) or b"Traceback" in done.stderr:
                missed.append(f"limits {seed}: {arguments} exits with {done.returncode}: {done.stderr[-300:]!r}")
            left = [path.name for path in Path(folder).iterdir() if path.name.startswith(".")]
            text = report.read_text(encoding="utf-8")
            if left or not (text == "old" or text.rstrip().endswith("</html>")):
                missed.append(f"limits {seed}: {arguments} leaves {left}, {len(text)} characters of a report")
    return tried, missed


def main() -> int:
    """Run it; 1 if anything was mishandled."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--settings", type=int, help="default: a tenth of the files")
    parser.add_argument("--signals", type=int, help="default: a hundredth of the files")
    parser.add_argument("--limits", type=int, help="default: a hundredth of the files")
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--processes", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--write", action="store_true", help="record the result in docs/hostile.md")
    chosen = parser.parse_args()
    counts = {
        files: chosen.files,
        settings: chosen.files // 10 if chosen.settings is None else chosen.settings,
        signals: chosen.files // 100 if chosen.signals is None else chosen.signals,
        limits: chosen.files // 100 if chosen.limits is None else chosen.limits,
    }
    tried, missed = Counter[str](), list[str]()
    start = time.perf_counter()
    with ProcessPoolExecutor(chosen.processes) as pool:
        for part, count in counts.items():
            seeds = range(chosen.seed, chosen.seed + count)
            size = 100 if part in (files, settings) else 5
            chunks = [seeds[first : first + size] for first in range(0, count, size)]
            for some, wrong in pool.map(part, chunks):
                tried += some
                missed += wrong
                for what in wrong:
                    print(what, flush=True)
            print(
                f"{part.__name__}: {count}, mishandled so far {len(missed)} ({time.perf_counter() - start:.0f} s)",
                flush=True,
            )
    lines = [f"{name:16} {count:9}" for name, count in tried.items()]
    lines.append(f"{'mishandled':16} {len(missed):9}")
    print("\n".join(lines))
    if chosen.write:
        record(PAGE, "long round", lines)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
