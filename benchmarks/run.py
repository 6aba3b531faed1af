"""Measure what the project promises about speed, as ratios of medians taken in turn within one run.

    python benchmarks/run.py            # all
    python benchmarks/run.py cold       # one of: cold, gate, formats, report, evaluators

Absolute times on a shared machine mean little; each figure is measured side by side with its yardstick,
A B A B …, and the ratio of the medians is what counts. Accuracy stands beside each figure.
"""

import argparse
import math
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MISSION = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"


def in_turn(runs: int, *tasks: Callable[[], float]) -> list[float]:
    """Median of each task's own figure over `runs` rounds, the tasks taking turns; one round of warm-up."""
    figures: list[list[float]] = [[] for _ in tasks]
    for index in range(runs + 1):
        for task, kept in zip(tasks, figures, strict=True):
            value = task()
            if index:
                kept.append(value)
    return [statistics.median(kept) for kept in figures]


def process(*command: str) -> Callable[[], float]:
    """CPU seconds (user + system) of a fresh process, output to a pipe: less noisy than the wall clock."""

    def run() -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(command, capture_output=True, cwd=ROOT, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert done.returncode in (0, 1), done.stderr.decode()
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return run


def wall(command: tuple[str, ...]) -> Callable[[], float]:
    def run() -> float:
        start = time.perf_counter()
        subprocess.run(command, capture_output=True, cwd=ROOT, check=False)
        return time.perf_counter() - start

    return run


def cold(runs: int) -> None:
    script = str(Path(sys.executable).with_name("bisar-budget"))
    check = (script, "check", str(MISSION))
    yardstick = (sys.executable, "-c", "import yaml, click")
    bare = (sys.executable, "-c", "pass")
    print("check of one mission, cold process, output to a pipe ÷ python -c 'import yaml, click' (at most 2.5)")
    for label, measure in (("CPU", lambda c: process(*c)), ("wall", wall)):
        a, b, empty = in_turn(runs, measure(check), measure(yardstick), measure(bare))
        print(
            f"  {label:5} {a * 1e3:6.0f} ms ÷ {b * 1e3:6.0f} ms = {a / b:.2f}   "
            f"(bare interpreter {empty * 1e3:.0f} ms; without it {(a - empty) / (b - empty):.2f})"
        )


def gate(runs: int) -> None:
    examples = sorted(MISSION.parent.glob("*.yaml"))
    every_key = ROOT / "tests" / "acceptance" / "good" / "every_key.yaml"
    print("1000 missions in one call ÷ parsing the same files with PyYAML's C loader, CPU (at most 3)")
    fleets = {"the examples of specs/missions": examples, "missions that use every key": [every_key]}
    for label, sources in fleets.items():
        texts = [path.read_text(encoding="utf-8") for path in sources]
        with tempfile.TemporaryDirectory() as folder:
            files = []
            for index in range(1000):
                path = Path(folder) / f"mission_{index:04}.yaml"
                text = texts[index % len(texts)]
                path.write_text(re.sub(r"(?m)^name: .*", f"name: mission {index}", text), encoding="utf-8")
                files.append(str(path))
            parse = """import sys, yaml
for name in sys.argv[1:]:
    with open(name, "rb") as file:
        yaml.load(file, Loader=yaml.CSafeLoader)"""
            script = str(Path(sys.executable).with_name("bisar-budget"))
            size = sum(os.path.getsize(file) for file in files) / len(files)
            print(f"  {label}, {size:.0f} bytes each")
            for format_name in ("text", "json", "csv"):
                a, b = in_turn(
                    runs,
                    process(script, "check", "--format", format_name, *files),
                    process(sys.executable, "-c", parse, *files),
                )
                print(f"    {format_name:5} {a:6.2f} s ÷ {b:6.2f} s = {a / b:.2f}")


def formats(runs: int) -> None:
    """What the reports of a pull request cost on top of the check itself."""
    sources = [*sorted(MISSION.parent.glob("*.yaml")), ROOT / "tests" / "acceptance" / "good" / "every_key.yaml"]
    script = str(Path(sys.executable).with_name("bisar-budget"))
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for index in range(100):
            path = Path(folder) / f"mission_{index:03}.yaml"
            path.write_text(sources[index % len(sources)].read_text(encoding="utf-8"), encoding="utf-8")
            files.append(str(path))
        junit, sarif = (str(Path(folder) / name) for name in ("budget.xml", "budget.sarif"))
        text, machine = in_turn(
            runs,
            process(script, "check", *files),
            process(script, "check", "--format", "junit", "-o", junit, "--report", sarif, *files),
        )
        print("gate over 100 missions to JUnit and SARIF ÷ the same check to text, CPU (at most 1.5)")
        print(f"  {machine * 1e3:6.0f} ms ÷ {text * 1e3:6.0f} ms = {machine / text:.2f}")
        sizes = [os.path.getsize(path) / 1e3 for path in (junit, sarif)]
        print(f"  JUnit {sizes[0]:.0f} kB, SARIF {sizes[1]:.0f} kB")


def report(runs: int) -> None:
    """What a compliance report costs, layout and drawings included; one mission without images."""
    script = str(Path(sys.executable).with_name("bisar-budget"))
    yardstick = (sys.executable, "-c", "import jinja2, matplotlib.pyplot")
    every_key = ROOT / "tests" / "acceptance" / "good" / "every_key.yaml"
    print("HTML report of one mission ÷ python -c 'import jinja2, matplotlib.pyplot', CPU (at most 2.5)")
    with tempfile.TemporaryDirectory() as folder:
        page = str(Path(folder) / "report.html")
        for label, mission in (("Section V", MISSION), ("every key", every_key)):
            a, b = in_turn(
                runs,
                process(script, "check", "--format", "html", "-o", page, str(mission)),
                process(*yardstick),
            )
            size = os.path.getsize(page) / 1e3
            print(f"  {label:10} {a * 1e3:5.0f} ms ÷ {b * 1e3:5.0f} ms = {a / b:.2f}   ({size:.0f} kB)")


def evaluators(runs: int) -> None:
    import numpy as np

    from bisar_budget.evaluators import published_motion

    rng = np.random.default_rng(1)
    n = 1_000_000
    x, y, z = rng.uniform(-3e4, 3e4, (3, n))
    vx, vy, vz = rng.uniform(-200, 200, (3, n))
    R = np.sqrt(x * x + y * y + z * z)
    wavelength, T = 0.03, 6.0

    def by_hand() -> tuple[np.ndarray, ...]:
        """Tables I and II as an engineer writes them down, row by row, nothing shared."""
        k = np.pi / wavelength
        return (
            *(-p / R for p in (x, y, z)),
            *(-v / R for v in (vx, vy, vz)),
            *(-k * v * T**2 / (2 * R) for v in (vx, vy, vz)),
            *(-k * p * T**2 / (4 * R) for p in (x, y, z)),
            *(-k * v * T**3 / (8 * R) for v in (vx, vy, vz)),
        )

    def by_hand_shared() -> tuple[np.ndarray, ...]:
        """The same by somebody who counts operations."""
        k, inverse = np.pi / wavelength, 1 / R
        u = [p * inverse for p in (x, y, z)]
        w = [v * inverse for v in (vx, vy, vz)]
        return (
            *(-a for a in u),
            *(-a for a in w),
            *((-k * T**2 / 2) * a for a in w),
            *((-k * T**2 / 4) * a for a in u),
            *((-k * T**3 / 8) * a for a in w),
        )

    def emitted() -> tuple[np.ndarray, ...]:
        rows = published_motion(x, y, z, vx, vy, vz, R, wavelength, T)
        position, velocity, acceleration = rows[:3], rows[3:6], rows[6:]
        return (
            *(r[0] for r in position),
            *(r[1] for r in position),
            *(r[2] for r in velocity),
            *(r[2] for r in acceleration),
            *(r[3] for r in acceleration),
        )

    def clock(function: Callable[[], object]) -> Callable[[], float]:
        def run() -> float:
            start = time.perf_counter()
            function()
            return time.perf_counter() - start

        return run

    a, b, s = in_turn(runs, clock(emitted), clock(by_hand), clock(by_hand_shared))
    error = max(
        float(np.max(np.abs(got - want) / np.maximum(np.abs(want), 1e-300)))
        for got, want in zip(emitted(), by_hand(), strict=True)
    )
    print("evaluators over 10⁶ samples ÷ the same formulas by hand in NumPy (at most 1.1)")
    print(f"  as written in the tables  {a * 1e3:6.1f} ms ÷ {b * 1e3:6.1f} ms = {a / b:.2f}")
    print(f"  with shared terms         {a * 1e3:6.1f} ms ÷ {s * 1e3:6.1f} ms = {a / s:.2f}")
    print(f"  largest relative difference {error:.1e} ({error / math.ulp(1.0):.1f} last places)")


TASKS = {
    "cold": (cold, 21),
    "gate": (gate, 5),
    "formats": (formats, 11),
    "report": (report, 11),
    "evaluators": (evaluators, 11),
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", nargs="?", choices=[*TASKS, "all"], default="all")
    parser.add_argument("--runs", type=int, help="rounds, after one of warm-up")
    chosen = parser.parse_args()
    for name, (task, default) in TASKS.items():
        if chosen.task in (name, "all"):
            task(chosen.runs or default)
