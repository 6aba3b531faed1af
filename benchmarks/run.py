"""Measure what the project promises about speed, as ratios of medians taken in turn within one run.

    python benchmarks/run.py            # all
    python benchmarks/run.py cold       # one of: cold, sensors, paths, gate, formats, report, evaluators, montecarlo
    python benchmarks/run.py --against ../before    # cold, gate and examples of another checkout and of this one
    python benchmarks/run.py examples --against ../before    # each example in a running process, in turn

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
from collections.abc import Callable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Without what would keep Python from it, or would have it done before.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
MISSION = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"


Times = tuple[float, ...]


def in_turn(runs: int, *tasks: Callable[[], Times]) -> list[Times]:
    """Medians of each task's own figures over `runs` rounds, the tasks taking turns; one round of warm-up."""
    figures: list[list[Times]] = [[] for _ in tasks]
    for index in range(runs + 1):
        for task, kept in zip(tasks, figures, strict=True):
            value = task()
            if index:
                kept.append(value)
    return [tuple(statistics.median(column) for column in zip(*kept, strict=True)) for kept in figures]


def process(*command: str, cwd: Path = ROOT) -> Callable[[], Times]:
    """Seconds by the clock, and of CPU (user and system), of a fresh process, output to a pipe.

    Python may keep what it compiles, as it does for a user, in a folder of this run.
    """

    def run() -> Times:
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run(command, capture_output=True, cwd=cwd, check=False, env=ENVIRONMENT)
        wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        assert done.returncode in (0, 1), done.stderr.decode()
        return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return run


def clock(function: Callable[[], object]) -> Callable[[], Times]:
    """Seconds by the clock of a call in this process."""

    def run() -> Times:
        start = time.perf_counter()
        function()
        return (time.perf_counter() - start,)

    return run


def cold(runs: int) -> None:
    """The paper's example, and the mission whose check takes longest."""
    script = str(Path(sys.executable).with_name("bisar-budget"))
    slowest = MISSION.with_name("sentinel1_elements_besancon.yaml")
    checks = [process(script, "check", str(mission)) for mission in (MISSION, slowest)]
    found = in_turn(runs, *checks, process(sys.executable, "-c", "import click, yaml, numpy"))
    print("check of one mission, cold process, output to a pipe ÷ python -c 'import click, yaml, numpy'")
    for mission, most, times in zip((MISSION, slowest), (1.6, 2.0), found, strict=False):
        for label, a, b in zip(("clock", "CPU"), times, found[-1], strict=True):
            print(
                f"  {mission.stem:28} {label:5} {a * 1e3:6.0f} ms ÷ {b * 1e3:6.0f} ms = {a / b:.2f} (at most {most})"
            )


def sensors(runs: int) -> None:
    """A mission with everything that data sheets say, against the same without it."""
    import yaml

    source = ROOT / "tests" / "acceptance" / "good" / "sensors_and_clocks.yaml"
    mission = yaml.safe_load(source.read_text(encoding="utf-8"))
    mission.pop("synchronization", None)
    for platform in mission["platforms"].values():
        platform.pop("oscillator", None)
        for key in ("sensor", "imu", "random"):
            platform.get("motion_error", {}).pop(key, None)
    script = str(Path(sys.executable).with_name("bisar-budget"))
    with tempfile.TemporaryDirectory() as folder:
        bare = Path(folder) / "without.yaml"
        bare.write_text(yaml.safe_dump(mission, sort_keys=False), encoding="utf-8")
        found = in_turn(runs, process(script, "check", str(source)), process(script, "check", str(bare)))
    print("check of a mission with sensors, oscillators and synchronisation ÷ without them, cold (at most 1.3)")
    for label, a, b in zip(("clock", "CPU"), *found, strict=True):
        print(f"  {label:5} {a * 1e3:6.0f} ms ÷ {b * 1e3:6.0f} ms = {a / b:.2f}")


def paths(runs: int) -> None:
    """Missions with an orbit, and with an orbit and a log, against the same with their paths written down."""
    import yaml

    from bisar_budget.mission.load import load_mission

    script = str(Path(sys.executable).with_name("bisar-budget"))
    print("check of orbits and logs ÷ the same with their paths written down, cold (orbit: at most 1.5)")
    for name in ("sentinel1_elements_besancon", "sentinel1_aircraft_log"):
        source = ROOT / "specs" / "missions" / f"{name}.yaml"
        tree, mission = yaml.safe_load(source.read_text(encoding="utf-8")), load_mission(str(source))
        tree.pop("scene")
        for platform in ("transmitter", "receiver"):
            state = getattr(mission.geometry, platform)
            kept = {key: tree["platforms"][platform][key] for key in ("motion_error",)} | {
                "position": list(state.position),
                "velocity": list(state.velocity),
                "acceleration": list(state.acceleration),
            }
            if kept["motion_error"].get("frame") == "ric":
                kept["motion_error"]["frame"] = "track"
            tree["platforms"][platform] = kept
        with tempfile.TemporaryDirectory() as folder:
            written = Path(folder) / "written.yaml"
            written.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
            found = in_turn(runs, process(script, "check", str(source)), process(script, "check", str(written)))
        for label, a, b in zip(("clock", "CPU"), *found, strict=True):
            print(f"  {name:28} {label:5} {a * 1e3:6.0f} ms ÷ {b * 1e3:6.0f} ms = {a / b:.2f}")


PARSE = """import sys, yaml
for name in sys.argv[1:]:
    with open(name, "rb") as file:
        yaml.load(file, Loader=yaml.CSafeLoader)"""


def fleets(checkout: Path) -> dict[str, list[Path]]:
    """Mission files of a checkout that a thousand are made from."""
    return {
        # Those that name files are no text alone.
        "the examples of specs/missions": [
            path
            for path in sorted((checkout / "specs" / "missions").glob("*.yaml"))
            if "paths/" not in path.read_text(encoding="utf-8")
        ],
        "missions that use every key": [checkout / "tests" / "acceptance" / "good" / "every_key.yaml"],
    }


def a_thousand(folder: str, sources: list[Path]) -> list[str]:
    """Write a thousand missions of different names into a folder."""
    texts = [path.read_text(encoding="utf-8") for path in sources]
    files = []
    for index in range(1000):
        path = Path(folder) / f"mission_{index:04}.yaml"
        text = texts[index % len(texts)]
        path.write_text(re.sub(r"(?m)^name: .*", f"name: mission {index}", text), encoding="utf-8")
        files.append(str(path))
    return files


def gate(runs: int) -> None:
    print(
        "1000 missions in one call ÷ parsing the same files with PyYAML's C loader (by the clock at most 3 for the "
        "examples, 8 for missions that use every key)"
    )
    for label, sources in fleets(ROOT).items():
        with tempfile.TemporaryDirectory() as folder:
            files = a_thousand(folder, sources)
            script = str(Path(sys.executable).with_name("bisar-budget"))
            size = sum(os.path.getsize(file) for file in files) / len(files)
            print(f"  {label}, {size:.0f} bytes each")
            formats = ("text", "json", "csv")
            checks = [process(script, "check", "--format", name, *files) for name in formats]
            *found, parsed = in_turn(runs, *checks, process(sys.executable, "-c", PARSE, *files))
            for name, (wall, cpu) in zip(formats, found, strict=True):
                print(
                    f"    {name:5} {wall:6.2f} s ÷ {parsed[0]:6.2f} s = {wall / parsed[0]:.2f}"
                    f"   (CPU of all processes {cpu / parsed[1]:.2f})"
                )


CHECKS = """import sys, time
from click.testing import CliRunner
from bisar_budget.cli import cli
for line in sys.stdin:
    start = time.process_time()
    result = CliRunner().invoke(cli, ["check", line.strip()], prog_name="bisar-budget")
    seconds = time.process_time() - start
    assert result.exit_code in (0, 1), result.output
    print(seconds, flush=True)"""


def running(checkout: Path) -> Callable[[Path], float]:
    """Start a process of a checkout; the result checks a mission there and returns the seconds of CPU."""
    pipe = subprocess.PIPE
    worker = subprocess.Popen((sys.executable, "-c", CHECKS), stdin=pipe, stdout=pipe, cwd=checkout, text=True)

    def check(mission: Path) -> float:
        assert worker.stdin is not None
        assert worker.stdout is not None
        print(mission, file=worker.stdin, flush=True)
        return float(worker.stdout.readline())

    return check


def examples(sides: Mapping[str, Path], runs: int) -> None:
    """Each example of the other checkout in one running process per side, the sides taking turns."""
    print("check of each example in a running process, after ÷ before, CPU (geometric mean at most 1.3)")
    missions = sorted((sides["before"] / "specs" / "missions").glob("*.yaml"))
    checks = [running(checkout) for checkout in sides.values()]
    ratios, of_runs = [], [0.0] * runs
    for mission in missions:
        _, *pairs = [[check(mission) for check in checks] for _ in range(runs + 1)]  # one round of warm-up
        before, after = (statistics.median(times) for times in zip(*pairs, strict=True))
        ratios.append(math.log(after / before))
        of_runs = [sum_ + math.log(b / a) / len(missions) for sum_, (a, b) in zip(of_runs, pairs, strict=True)]
        print(f"  {mission.stem:36} {after * 1e3:6.1f} ms ÷ {before * 1e3:6.1f} ms = {after / before:.2f}")
    mean, least, most = map(math.exp, (statistics.fmean(ratios), min(of_runs), max(of_runs)))
    print(f"  geometric mean {mean:.2f}, of single runs {least:.2f} to {most:.2f}")


def against(before: Path, task: str, runs: int | None) -> None:
    """Another checkout and this one side by side, with one interpreter and on the other's mission files."""
    sides = {"before": before.resolve(), "after": ROOT}
    for checkout in sides.values():
        where = (sys.executable, "-c", "import bisar_budget; print(bisar_budget.__file__)")
        imported = subprocess.run(where, capture_output=True, cwd=checkout, check=False, text=True).stdout
        if imported.strip() != str(checkout / "bisar_budget" / "__init__.py"):
            sys.exit(f"{checkout}: no checkout of bisar-budget")
    command = (
        "import sys; from bisar_budget.cli import main; sys.exit(main())"  # as installed, of the folder it is in
    )

    def compare(runs: int, yardstick: Callable[[], Times], *arguments: str) -> None:
        checks = [
            process(sys.executable, "-c", command, "check", *arguments, cwd=checkout) for checkout in sides.values()
        ]
        *found, measure = in_turn(runs, *checks, yardstick)
        for index, label in enumerate(("clock", "CPU")):
            for side, times in zip(sides, found, strict=True):
                time, unit = times[index] * 1e3, measure[index] * 1e3
                print(f"    {label:5} {side:6} {time:7.0f} ms ÷ {unit:6.0f} ms = {time / unit:.2f}")
            print(f"    {label:5} after ÷ before = {found[1][index] / found[0][index]:.2f}")

    if task in ("cold", "all"):
        print(
            "check of one mission, cold process, output to a pipe ÷ python -c 'import click, yaml, numpy' "
            "(at most 1.6)"
        )
        mission = sides["before"] / MISSION.relative_to(ROOT)
        compare(runs or TASKS["cold"][1], process(sys.executable, "-c", "import click, yaml, numpy"), str(mission))
    if task in ("gate", "all"):
        print(
            "1000 missions in one call to text ÷ parsing the same files with PyYAML's C loader "
            "(at most 3; of every key 8)"
        )
        for label, sources in fleets(sides["before"]).items():
            print(f"  {label}")
            with tempfile.TemporaryDirectory() as folder:
                files = a_thousand(folder, sources)
                compare(runs or TASKS["gate"][1], process(sys.executable, "-c", PARSE, *files), *files)
    if task in ("examples", "all"):
        examples(sides, runs or 21)


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
        (_, text), (_, machine) = in_turn(
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
            (_, a), (_, b) = in_turn(
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

    (a,), (b,), (s,) = in_turn(runs, clock(emitted), clock(by_hand), clock(by_hand_shared))
    error = max(
        float(np.max(np.abs(got - want) / np.maximum(np.abs(want), 1e-300)))
        for got, want in zip(emitted(), by_hand(), strict=True)
    )
    print("evaluators over 10⁶ samples ÷ the same formulas by hand in NumPy (at most 1.1)")
    print(f"  as written in the tables  {a * 1e3:6.1f} ms ÷ {b * 1e3:6.1f} ms = {a / b:.2f}")
    print(f"  with shared terms         {a * 1e3:6.1f} ms ÷ {s * 1e3:6.1f} ms = {a / s:.2f}")
    print(f"  largest relative difference {error:.1e} ({error / math.ulp(1.0):.1f} last places)")


def montecarlo(runs: int) -> None:
    """Every motion and clock error of both platforms, 22 normal variables; judged are phases, cubic and location."""
    import numpy as np

    from bisar_budget.analysis.analysis import Analysis
    from bisar_budget.analysis.variables import variables_of
    from bisar_budget.mission.load import parse_mission
    from bisar_budget.sampling.draws import _Stream
    from bisar_budget.sampling.probability import monte_carlo

    motion = "{position: 1 m, velocity: 5 mm/s, acceleration: 20 ug}"
    text = f"""{{schema_version: 1, name: m, radar: {{center_frequency: 10 GHz, bandwidth: 300 MHz}},
    collection: {{aperture_time: 6 s}}, platforms: {{
    transmitter: {{position: [30 km, 0, 6 km], velocity: [50, 150, 0], motion_error: {motion}}},
    receiver: {{position: [6 km, 6 km, 2 km], velocity: [-40, 40, 0], motion_error: {motion}}}}},
    timing_error: {{constant: 5 ns, linear: 1e-11, quadratic: 1e-13, cubic: 1e-13}},
    requirements: {{cubic_phase_error: 1e-2 rad, location_error: 3 m}},
    allocation: {{model: published, combine: each}}}}"""
    mission = parse_mission(text)
    n, seed = 1_000_000, 1
    analysis = Analysis(mission)
    declared = analysis.stated
    variables = variables_of(analysis)
    sizes = [abs(s.declared) for s in declared]

    def draw() -> list[np.ndarray]:
        drawn = [np.empty(n) for _ in variables]
        for variable, size, out in zip(variables, sizes, drawn, strict=True):
            _Stream(variable, seed).fill(out)
            out *= size
        return drawn

    plane = analysis.full.plane
    of_transmitter = [s.owner == "transmitter" for s in declared]
    moves = [plane.displacement(s.full, 1.0) for s in declared]

    def total(e: list[np.ndarray], factors: list[float]) -> np.ndarray:
        return sum(factor * one for factor, one in zip(factors, e, strict=True))

    def formulas(e: list[np.ndarray]) -> list[float]:
        """The effects of small errors as docs/full-model.md has them, over whole arrays, and the probabilities."""
        qt = total(e, [s.full.qpe * mine for s, mine in zip(declared, of_transmitter, strict=True)])
        qr = total(e, [s.full.qpe * (not mine) for s, mine in zip(declared, of_transmitter, strict=True)])
        cubic = total(e, [s.full.cubic for s in declared])
        x, y = (total(e, [move[axis] for move in moves]) for axis in (0, 1))
        limit = np.pi / 8
        return [
            float(np.mean(np.abs(qt) <= limit)),
            float(np.mean(np.abs(qr) <= limit)),
            float(np.mean(np.abs(qt + qr) <= 2 * limit)),
            float(np.mean(np.abs(cubic) <= 1e-2)),
            float(np.mean(np.hypot(x, y) <= 3)),
        ]

    drawn = draw()

    (ours,), (evaluated,), (both,) = in_turn(
        runs,
        clock(lambda: monte_carlo(Analysis(mission), n, seed)),
        clock(lambda: formulas(drawn)),
        clock(lambda: formulas(draw())),
    )
    got = [one.probability for one in monte_carlo(Analysis(mission), n, seed).requirements]
    want = formulas(drawn)
    off = max(abs(a - b) for a, b in zip(got, want, strict=True))
    print(
        "Monte Carlo, 10⁶ draws of 22 errors ÷ the full model's formulas over the whole arrays in NumPy (at most 3)"
    )
    print(f"  draws already there   {ours * 1e3:6.0f} ms ÷ {evaluated * 1e3:6.0f} ms = {ours / evaluated:.2f}")
    print(f"  drawn and evaluated   {ours * 1e3:6.0f} ms ÷ {both * 1e3:6.0f} ms = {ours / both:.2f}")
    print(f"  largest difference of the five probabilities {off:.0e}, of the same draws")


TASKS = {
    "cold": (cold, 21),
    "sensors": (sensors, 21),
    "paths": (paths, 21),
    "gate": (gate, 5),
    "formats": (formats, 11),
    "report": (report, 11),
    "evaluators": (evaluators, 11),
    "montecarlo": (montecarlo, 7),
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", nargs="?", choices=[*TASKS, "examples", "all"], default="all")
    parser.add_argument("--runs", type=int, help="rounds, after one of warm-up")
    parser.add_argument(
        "--against", type=Path, metavar="PATH", help="another checkout: cold, gate and examples of both, in turn"
    )
    chosen = parser.parse_args()
    if chosen.against is not None and chosen.task not in ("cold", "gate", "examples", "all"):
        parser.error(f"--against measures cold, gate and examples, not {chosen.task}")
    if chosen.against is None and chosen.task == "examples":
        parser.error("examples needs --against")
    with tempfile.TemporaryDirectory() as folder:
        ENVIRONMENT["PYTHONPYCACHEPREFIX"] = folder
        if chosen.against is not None:
            against(chosen.against, chosen.task, chosen.runs)
            sys.exit()
        for name, (task, default) in TASKS.items():
            if chosen.task in (name, "all"):
                task(chosen.runs or default)
