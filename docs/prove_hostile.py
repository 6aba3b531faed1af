"""The long round of hostile use: fuzzed files through every reader, command and format, settings, signals, limits.

    python docs/prove_hostile.py                # 1 000 files, minutes
    python docs/prove_hostile.py --files 100000 --keep build/hostile.json --minutes 60  # a slice; again: the next
    python docs/prove_hostile.py --files 100000 --keep build/hostile.json --write       # the rest, to docs/hostile.md

Cases are those of `tests/fuzz.py`, by seed: `python -m tests.fuzz SEED` prints the file of one that is named here,
`python -m tests.fuzz_commands SEED` what is asked of it. In this process a file is loaded, checked by a model,
written in every format, compared with the mission before it, explained, swept and solved. Of one in eight more is
asked: `sensitivity`, values by `--set`, a trade study. Some also go through processes of their own. Any miss makes
the exit code 1; what was missed is tried again by the next slice.
"""

import argparse
import csv
import io
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
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
from bisar_budget.questions import solve
from bisar_budget.report import Style, pictures, render
from bisar_budget.report.answers import COMMON_FORMATS, written
from bisar_budget.report.answers.diff_answer import Compared
from bisar_budget.report.change.comparison import ChangeSet, Gate, compare
from bisar_budget.report.explain.explanation import explain
from bisar_budget.settings import SettingsError, project_settings
from tests.conftest import ROOT, TEXT_FORMATS, TODAY
from tests.formats.flown import SAMPLES
from tests.fuzz import RAW, RUN, case, original, strict_settings
from tests.fuzz_commands import MISSION, questions
from tests.hostile_commands import answered, imported, kept, log_read, on_paths
from tests.recorded import record

PAGE = Path(__file__).with_name("hostile.md")
PATHS = ROOT / "specs" / "missions" / "paths"  # orbits that missions name
COMMAND = [sys.executable, "-m", "bisar_budget"]
# Fewer samples of a range: the search is the same, and ends sooner.
solve.SOLVE_SETTINGS = replace(solve.SOLVE_SETTINGS, range_samples=17, circle_samples=37)
HANG_S = 300  # of processor time; the slowest that is right is a question of 200 checks of half a second
ORIGINAL, OWN_PROCESS = 16, 200  # one file in so many
LARGEST = 16 * MAX_BYTES  # of a report of one file
_WORD = re.compile(r"\w+")  # what a file says, a report may: `nan` and `inf` as Python writes them
LARGEST_PROCESS = 8 << 30  # bytes of address space; a case that is right takes some 100 MB of memory
_GATE = Gate(0.1, ("receiver.*",))
_TABLES = ("csv", "parquet", "nc")
_VARY = ("--vary", "collection.aperture_time=1:6s:300")
# Twelve parts, no array holds their column: they take a while.
_SWEEP = (
    str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"),
    *("--vary", "platforms.receiver.azimuth=40:60deg:60", "--vary", "collection.aperture_time=1:6s:40"),
    *("--column", "receiver.velocity.x.islr_db", "--jobs", "2"),
)
_TWO = str(ROOT / "specs" / "missions" / "tandem_x.yaml")
_ORBIT = str(ROOT / "specs" / "missions" / "sentinel1_elements_besancon.yaml")
_FROM = ("--from", "2026-06-30", "--days", "3", "--min-elevation", "25 deg")
Outcome = tuple[Counter[str], list[str]]  # cases by kind, and what was mishandled


class _HangError(BaseException):
    """A case took too long."""


def _hang(*_: object) -> None:
    raise _HangError


@contextmanager
def _watched(what: str, stage: Callable[[], str], missed: list[str]) -> Iterator[None]:
    """Note what a case raises; it may take some processor time, and ten times as long on a busy machine."""
    signal.signal(signal.SIGALRM, _hang)
    signal.signal(signal.SIGPROF, _hang)
    signal.setitimer(signal.ITIMER_PROF, HANG_S)
    signal.alarm(10 * HANG_S)
    try:
        yield
    except _HangError:
        missed.append(f"{what}: {stage()}: hangs")
    except Exception as error:
        missed.append(f"{what}: {stage()}: {type(error).__name__}: {str(error)[:200]!r}")
    finally:
        signal.alarm(0)
        signal.setitimer(signal.ITIMER_PROF, 0)


def _strictly() -> None:
    """In this process nothing that a library warns of goes by, and memory is bounded."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (LARGEST_PROCESS, LARGEST_PROCESS))
    warnings.simplefilter("error")
    for kind in (DeprecationWarning, ResourceWarning):
        warnings.filterwarnings("ignore", category=kind)


def files(seeds: range) -> Outcome:
    """Feed the files of some seeds; the mission before each is the one to compare it with."""
    _strictly()
    tried, missed = Counter[str](), list[str]()
    before: MissionFindings | None = None
    with TemporaryDirectory() as folder:
        path = Path(folder, MISSION)
        shutil.copytree(PATHS, Path(folder, "paths"))
        for seed in seeds:
            stage = ["load"]
            with _watched(f"seed {seed}", lambda stage=stage: stage[-1], missed):  # type: ignore[misc]
                before = _file(seed, path, before, tried, stage, missed)
            with _watched(f"seed {seed}", lambda: "its questions", missed):
                missed += [f"seed {seed}: {what}" for what in _answered(seed, path, tried)]
            if seed % OWN_PROCESS == 0:
                missed += [f"seed {seed}: {what}" for what in _processes(seed, path, tried)]
    return tried, missed


def _answered(seed: int, file: Path, tried: Counter[str]) -> Iterator[str]:
    """Ask about the file of a seed; at times a third question is about the mission that it was made from."""
    for number, asked in enumerate(questions(seed)):
        is_made_from = number == 2 and seed % ORIGINAL == 0
        mission = original(Random(f"hostile {seed}")).encode() if is_made_from else file.read_bytes()
        with TemporaryDirectory() as folder:
            shutil.copytree(PATHS, Path(folder, "paths"))
            yield from answered(asked, mission, Path(folder), tried)


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
    for name in TEXT_FORMATS:
        stage.append(name)
        text = harmless(render(name, report, style), name)
        tried["reports"] += 1
        missed += [f"seed {seed}: {name}: {what}" for what in _wrong(text, name, hostile.data)]
        for content in pictures(name, report, style).values():
            if not content.startswith(b"\x89PNG"):
                ElementTree.fromstring(content)
    if not isinstance(found, MissionFindings):
        return before
    earlier = found if before is None else before
    own = hostile.data + (earlier.mission.data or b"")
    for name in COMMON_FORMATS[:-1]:  # those that are text
        stage.append(f"diff {name}")
        compared = Compared(ChangeSet((compare(earlier, found),)), _GATE, all_rows=True)
        text = harmless(str(written("diff", name, [compared], Style())), name)
        missed += [f"seed {seed}: diff {name}: {what}" for what in _wrong(text, name, own)]
        tried["comparisons"] += 1
    for row in random.sample(found.rows, 2):
        stage.append(f"explain {row.id}")
        missed += [
            f"seed {seed}: explain: {what}"
            for what in _wrong(harmless(explain(mission, found, row.id)), "text", hostile.data)
        ]
        tried["explanations"] += 1
    return found


def _wrong(text: str, name: str, given: bytes = b"") -> Iterator[str]:
    """What is wrong with a report of a file, given as bytes, as it would leave."""
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
    elif {"nan", "inf"} & set(text.split()) - set(_WORD.findall(given.decode("utf-8", "replace"))):
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
    format_name = Random(seed).choice(TEXT_FORMATS)
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
                [*COMMAND, *arguments],
                input=path.read_bytes(),
                capture_output=True,
                cwd=path.parent,  # names in what comes from standard input start there
                env={**os.environ, "PYTHONPATH": str(ROOT)},
                timeout=10 * HANG_S,
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


def paths(seeds: range) -> Outcome:
    """Feed missions that name orbits and logs, one of their files damaged."""
    return _each(seeds, "paths", on_paths)


def logs(seeds: range) -> Outcome:
    """Read damaged logs of every format."""
    return _each(seeds, "logs", log_read)


def radar_files(seeds: range) -> Outcome:
    """Feed damaged CPHD, CRSD and SICD files to `import`, and targets to what writes CPHD."""
    return _each(seeds, "radar files", imported)


def parts(seeds: range) -> Outcome:
    """Go on from parts of a sweep of which one is damaged: the same table, or a message."""
    return _each(seeds, "parts", kept)


def _each(seeds: range, name: str, told: Callable[[int, Path, Counter[str]], Iterable[str]]) -> Outcome:
    _strictly()
    tried, missed = Counter[str](), list[str]()
    for seed in seeds:
        tried[name] += 1
        with TemporaryDirectory() as folder, _watched(f"{name} {seed}", lambda: "in a command", missed):
            missed += [f"{name} {seed}: {what}" for what in told(seed, Path(folder), tried)]
    return tried, missed


def settings(seeds: range) -> Outcome:
    """Feed settings that say `strict`: read, or refused, unless tomllib finds no such key or it names no tool."""
    tried, missed = Counter[str](), list[str]()
    with TemporaryDirectory() as folder:
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
        with TemporaryDirectory() as folder:
            report = Path(folder, "report.html")
            report.write_text("old")
            arguments = random.choice(
                (
                    ["check", *missions, "--report", str(report), "-o", str(Path(folder, "a.json"))],
                    ["verify", missions[2], "--only", "receiver.*", "--jobs", "2", "-o", str(report)],
                    ["simulate", missions[2], "--plot", str(Path(folder, "p.png"))],
                    ["sensitivity", missions[0], "--plot", str(Path(folder, "p.svg")), "-o", str(report)],
                    ["solve", *missions, "--for", "collection.aperture_time", "-o", str(report)],
                    ["sweep", *_SWEEP, "-o", str(Path(folder, f"t.{random.choice(_TABLES)}"))],
                    ["sweep", *_SWEEP, "-o", str(Path(folder, "t.csv")), "--resume"],
                    ["import", str(SAMPLES / "example-cphd-1.0.1.xml"), "-o", str(report), "--force"],
                    ["allocate", *missions, "--set", "allocation.combine=rss", "-o", str(report)],
                    ["allocate", _TWO, "-o", str(Path(folder, "offered.yaml"))],
                    ["passes", _ORBIT, *_FROM, "-o", str(Path(folder, "passes")) + os.sep],
                    [
                        "passes",
                        _ORBIT,
                        *_FROM,
                        "-o",
                        str(Path(folder, "p.ics")),
                        "--plot",
                        str(Path(folder, "p.svg")),
                    ],
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
            if left or not (text == "old" or text.endswith("\n") or arguments[0] != "check"):
                missed.append(f"signals {seed}: leaves {left}, {len(text)} characters of a report")
    return tried, missed


def pairs(seeds: range) -> Outcome:
    """Run a command twice at once with one output, and sometimes kill one: the output is the whole one of either."""
    tried, missed = Counter[str](), list[str]()
    for seed in seeds:
        random = Random(f"pairs {seed}")
        with TemporaryDirectory() as folder:
            at = partial(os.path.join, folder)
            arguments, output = random.choice(
                (
                    (["sweep", *_SWEEP, "-o", at("t.csv")], "t.csv"),
                    (["sweep", *_SWEEP, "-o", at("t.parquet")], "t.parquet"),
                    (["check", _TWO, "--report", at("r.html"), "-q"], "r.html"),
                    (["check", _TWO, "--report", at("r.md"), "-q"], "r.md"),
                    (["allocate", _TWO, "-o", at("m.yaml")], "m.yaml"),
                    (["passes", _ORBIT, *_FROM, "-o", at("p.ics")], "p.ics"),
                    (["sensitivity", _TWO, "-o", at("s.json"), "--format", "json"], "s.json"),
                )
            )
            dated = [*arguments, "--date", TODAY.isoformat()]
            lines = [[*COMMAND, *dated], [*COMMAND, *dated, "--set", "name=the other"]]
            whole = []
            for line in lines:
                alone = subprocess.run(line, capture_output=True, cwd=ROOT)
                whole.append(Path(folder, output).read_bytes())
                if alone.returncode not in (0, 1):
                    missed.append(f"pairs {seed}: {line[3:]} exits with {alone.returncode}: {alone.stderr[-300:]!r}")
            tried["pairs"] += 1
            both = [
                subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=ROOT) for line in lines
            ]
            is_killed = random.random() < 0.3
            if is_killed:
                time.sleep(random.uniform(0.2, 3))
                both[0].kill()
            for process in both:
                errors = process.communicate(timeout=HANG_S)[1]
                is_fine = process.returncode in (0, 1) or (is_killed and process is both[0])
                if not is_fine and not (process.returncode == 2 and errors and b"Traceback" not in errors):
                    missed.append(f"pairs {seed}: {arguments[0]} exits with {process.returncode}: {errors[-300:]!r}")
            if Path(folder, output).read_bytes() not in whole:
                missed.append(f"pairs {seed}: {output} is of neither")
            subprocess.run(lines[0], capture_output=True, cwd=ROOT)  # removes what a killed one left
            left = [name for name in os.listdir(folder) if name.startswith(".")]
            if left:
                missed.append(f"pairs {seed}: {arguments[0]} leaves {left}")
    return tried, missed


def limits(seeds: range) -> Outcome:
    """Run with few descriptors, small files, little memory or full devices: 2, with a message, or the result."""
    import resource

    tried, missed = Counter[str](), list[str]()
    mission = str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml")
    for seed in seeds:
        random = Random(seed)
        kind, size = random.choice(
            (
                (resource.RLIMIT_NOFILE, random.randint(4, 24)),
                (resource.RLIMIT_FSIZE, random.randint(0, 20_000)),
                (resource.RLIMIT_AS, random.randint(30, 400) << 20),
            )
        )
        with TemporaryDirectory() as folder, open("/dev/full", "r+b") as full:
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
                    ["solve", mission, "--for", "collection.aperture_time"],
                    ["sensitivity", mission, "--plot", str(Path(folder, "p.svg")), "--format", "json"],
                    [
                        "sweep",
                        mission,
                        *_VARY,
                        "-o",
                        str(Path(folder, random.choice(("t.csv", "t.parquet", "t.nc")))),
                    ],
                    ["sweep", mission, *_VARY, "-o", str(Path(folder, "t.csv")), "--resume", "--jobs", "2"],
                    ["import", str(SAMPLES / "example-sicd-1.4.0.xml"), "-o", str(Path(folder, "m.yaml"))],
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
                    timeout=HANG_S,
                    preexec_fn=partial(resource.setrlimit, kind, (size, size)),
                    env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
                )
            except subprocess.TimeoutExpired:
                missed.append(f"limits {seed}: {arguments} hangs")
                continue
            if b"init_import_site" in done.stderr:
                continue  # Python itself does not start with so few
            if done.returncode not in (0, 1, 2) or b"Traceback" in done.stderr:
                missed.append(f"limits {seed}: {arguments} exits with {done.returncode}: {done.stderr[-300:]!r}")
            is_unsaid = done.returncode == 2 and b"emory" not in done.stderr and output is not full
            if kind == resource.RLIMIT_AS and is_unsaid:
                missed.append(f"limits {seed}: {arguments} says nothing of memory: {done.stderr[-300:]!r}")
            left = [path.name for path in Path(folder).iterdir() if path.name.startswith(".")]
            text = report.read_text(encoding="utf-8")
            if left or not (text == "old" or text.rstrip().endswith("</html>")):
                missed.append(f"limits {seed}: {arguments} leaves {left}, {len(text)} characters of a report")
    return tried, missed


Part = Callable[[range], Outcome]
SHARES: dict[Part, int] = {
    settings: 10,
    logs: 10,
    paths: 20,
    radar_files: 50,
    parts: 200,
    signals: 500,
    limits: 500,
    pairs: 1000,
}
SIZES: dict[Part, int] = {files: 100, settings: 500, logs: 500, paths: 50, radar_files: 50}
Slices = dict[str, tuple[dict[str, int], list[str]]]  # outcomes by `part first..last`


def run(counts: Mapping[Part, int], first: int, slices: Slices, seconds: float, processes: int) -> Iterator[str]:
    """Run what is not in `slices`, or was missed there, and put it there; gives the name of each that is done.

    Parts go side by side, so that the first slices have some of everything.
    """
    waiting = sorted(
        (start / count, f"{part.__name__} {first + start}..{first + min(start + size, count) - 1}", part, start, size)
        for part, count in counts.items()
        for size in [SIZES.get(part, 5)]
        for start in range(0, count, size)
    )
    end = time.monotonic() + seconds
    left = iter([one for one in waiting if slices.get(one[1], ({}, ["not run"]))[1]])
    # Click's runner keeps what commands wrote, so that a process grows by a tenth of a megabyte with each file.
    with ProcessPoolExecutor(processes, max_tasks_per_child=40) as pool:
        running: dict[Future[Outcome], str] = {}
        while True:
            while len(running) < processes and time.monotonic() < end and (one := next(left, None)):
                _, name, part, start, size = one
                running[pool.submit(part, range(first + start, first + min(start + size, counts[part])))] = name
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                name = running.pop(future)
                tried, missed = future.result()
                slices[name] = (dict(tried), missed)
                yield name


def summary(counts: Mapping[Part, int], slices: Slices) -> list[str]:
    """Cases tried by kind, and how many were mishandled; what of a part was not run is said."""
    tried, missed = Counter[str](), 0
    for some, wrong in slices.values():
        tried.update(some)
        missed += len(wrong)
    lines = [f"{name:16} {count:9}" for name, count in tried.items()]
    for part, count in counts.items():
        done = tried[part.__name__.replace("_", " ")]
        lines += [f"{part.__name__}: {count - done} of {count} not run yet"] * (done < count)
    return [*lines, f"{'mishandled':16} {missed:9}"]


def main() -> int:
    """Run it; 1 if anything was mishandled."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=1000)
    for part, share in SHARES.items():
        parser.add_argument(f"--{part.__name__}", type=int, help=f"default: one for {share} files")
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--processes", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin nothing new after them")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="keep results in FILE, and go on from those there")
    parser.add_argument("--write", action="store_true", help="record the result in docs/hostile.md")
    chosen = parser.parse_args()
    counts: dict[Part, int] = {files: chosen.files}
    for part, share in SHARES.items():
        asked = getattr(chosen, part.__name__)
        counts[part] = chosen.files // share if asked is None else asked
    slices: Slices = json.loads(chosen.keep.read_text()) if chosen.keep and chosen.keep.exists() else {}
    for name in run(counts, chosen.seed, slices, 60 * chosen.minutes, chosen.processes):
        for what in slices[name][1]:
            print(what, flush=True)
        if chosen.keep:
            chosen.keep.parent.mkdir(parents=True, exist_ok=True)
            chosen.keep.with_suffix(".new").write_text(json.dumps(slices))
            chosen.keep.with_suffix(".new").replace(chosen.keep)
    lines = summary(counts, slices)
    print("\n".join(lines))
    if chosen.write:
        record(PAGE, "long round", lines)
    return 1 if any(missed for _, missed in slices.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
