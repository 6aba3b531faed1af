"""Draws of a Monte Carlo: per draw in one process, before and after a change, and shared out by a scheduler.

The paper's example has one error, the drones eighteen; both are sums of effects. Every draw of the last mission goes
through exact ranges.

    OMP_NUM_THREADS=1 python benchmarks/draws.py [--against ../before] [--runs 5] [--shared 2]

`--against` takes turns with another checkout. `--shared N` compares one process with `--scheduler local:N`, as
commands; the result has to be the same bytes.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
MISSIONS = {  # draws: about a second
    "rigling_moses_section_v": 2**22,
    "drones_same_gnss": 2**21,
    "uav_pair_l_band": 2**16,
}
SHARED = {"rigling_moses_section_v": "1e9", "drones_same_gnss": "5e7", "uav_pair_l_band": "2e6"}
MEASURED = """
import sys
from time import process_time
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.mission.load import load_mission
from bisar_budget.sampling.probability import monte_carlo

file, draws, is_compiled = sys.argv[1], int(sys.argv[2]), sys.argv[3] == "compiled"
if is_compiled:
    from bisar_budget.sampling import draws as drawing
    drawing._WORTH_COMPILING = 1
analysis = Analysis(load_mission(file))
monte_carlo(analysis, 1000, 1)
began = process_time()
found = monte_carlo(analysis, draws, 1)
print((process_time() - began) / draws * 1e9)
off = [abs(one.probability - one.probability_normal) / max((one.probability * (1 - one.probability) / draws) ** 0.5,
       1 / draws) for one in found.requirements]
print(max(off))
print([one[:-1] for one in found.requirements])
"""


def measured(checkout: Path, mission: str, kind: str = "") -> tuple[float, float, str]:
    """Processor time of a draw [ns], distance to the normal distribution in standard errors, and what was found."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1"}
    file = str(ROOT / "specs" / "missions" / f"{mission}.yaml")
    line = [sys.executable, "-c", MEASURED, file, str(MISSIONS[mission]), kind]
    done = subprocess.run(line, cwd=checkout, env=environment, check=True, capture_output=True, text=True)
    seconds, off, found = done.stdout.splitlines()
    return float(seconds), float(off), found


def in_one_process(runs: int, against: Path | None) -> None:
    """Time of a draw by NumPy alone, by compiled normal draws, and before."""
    kinds: dict[str, tuple[Path, str]] = {"NumPy": (ROOT, ""), "compiled": (ROOT, "compiled")}
    if against is not None:
        kinds = {"before": (against.resolve(), ""), **kinds}
    print("processor time of a draw [ns], median; ratio to NumPy")
    for mission in MISSIONS:
        times: dict[str, list[float]] = {kind: [] for kind in kinds}
        found: dict[str, str] = {}
        for _ in range(runs):
            for kind, (checkout, how) in kinds.items():
                seconds, off, found[kind] = measured(checkout, mission, how)
                times[kind].append(seconds)
        of_numpy = statistics.median(times["NumPy"])
        for kind, taken in times.items():
            same = "same numbers" if found[kind] == found["NumPy"] else "other numbers"
            median = statistics.median(taken)
            print(f"  {mission:24} {kind:9} {median:8.1f}  {median / of_numpy:5.2f}  {same}")
        if mission == "rigling_moses_section_v":  # its one error is normal
            print(f"  {mission:24} off the normal distribution by at most {off:.1f} standard errors")


def shared_out(workers: int) -> None:
    """Commands in one process and with workers of their own, by the clock and by processor time of all processes."""
    print(f"a command in one process ÷ with --scheduler local:{workers}")
    for mission, draws in SHARED.items():
        line = [sys.executable, "-m", "bisar_budget", "check", f"specs/missions/{mission}.yaml"]
        line += ["--format", "json", "--monte-carlo", draws]
        taken, used, output = [], [], []
        for more in ([], ["--scheduler", f"local:{workers}"]):
            began, before = time.perf_counter(), os.times()
            done = subprocess.run([*line, *more], cwd=ROOT, capture_output=True, check=False)
            after = os.times()
            taken.append(time.perf_counter() - began)
            used.append(after.children_user + after.children_system - before.children_user - before.children_system)
            output.append(done.stdout)
        same = "same bytes" if output[0] == output[1] else "OTHER BYTES"
        print(f"  {mission:24} {draws} draws, {same}")
        for what, (alone, shared) in (("clock", taken), ("processor", used)):
            print(f"    {what:9} {alone:6.1f} s ÷ {shared:6.1f} s = {alone / shared:.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--against", type=Path, metavar="PATH", help="another checkout")
    parser.add_argument("--shared", type=int, metavar="N", help="also with so many workers")
    chosen = parser.parse_args()
    in_one_process(chosen.runs, chosen.against)
    if chosen.shared:
        shared_out(chosen.shared)
