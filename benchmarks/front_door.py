"""Cost of `import bisar_budget as bb`: its import, the imports of the first check, a check beside the core's.

    python benchmarks/front_door.py

Imports are those of fresh interpreters (`python -X importtime`), medians of nine; a check is CPU time in one process,
the front door's and the core's in turn.
"""

import datetime as dt
import statistics
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import process_time

import bisar_budget as bb
from bisar_budget.budget.check import check_mission

ROOT = Path(__file__).resolve().parent.parent
MISSIONS = sorted((ROOT / "specs" / "missions").glob("*.yaml"))
RUNS, CHECKS = 9, 15
CODE = {
    "import numpy": "import numpy",
    "import bisar_budget": "import bisar_budget",
    "bb.load": f"import bisar_budget as bb; bb.load({str(MISSIONS[0])!r})",
    "bb.check": f"import bisar_budget as bb; bb.check(bb.load({str(MISSIONS[0])!r}))",
    "bb.sweep, its table": f"import bisar_budget as bb; m = bb.load({str(MISSIONS[0])!r})\n"
    "bb.sweep(m, {'collection.aperture_time': [1.0, 2.0]}).columns",
}


def imported(code: str) -> tuple[float, int]:
    """Milliseconds that imports take beyond those of Python itself, and the number of modules."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", code], capture_output=True, text=True, check=True
    )
    own = [int(line.partition(":")[2].split("|")[0]) for line in done.stderr.splitlines() if "imported" not in line]
    start = next(place for place, line in enumerate(done.stderr.splitlines()) if line.endswith("| site")) + 1
    return sum(own[start:]) / 1e3, len(own) - start


def milliseconds(ask: Callable[[], object]) -> float:
    """CPU time of one call."""
    began = process_time()
    ask()
    return 1e3 * (process_time() - began)


def main() -> None:
    """Print imports, then the overhead of a check for each example."""
    found: dict[str, list[tuple[float, int]]] = {name: [] for name in CODE}
    for _ in range(RUNS):
        for name, code in CODE.items():
            found[name].append(imported(code))
    numpy = statistics.median(time for time, _ in found["import numpy"])
    print("imports, ms (÷ import numpy), modules")
    for name, times in found.items():
        took = statistics.median(time for time, _ in times)
        print(f"  {name:20} {took:6.1f}  {took / numpy:5.2f}  {times[0][1]:5}")
    day = dt.date(2026, 7, 1)
    more = []
    for path in MISSIONS:
        mission = bb.load(path)
        ask, core = partial(bb.check, mission, date=day), partial(check_mission, mission, day)
        pairs = [(milliseconds(ask), milliseconds(core)) for _ in range(CHECKS)]
        more.append(statistics.median(ours - theirs for ours, theirs in pairs))
    print("a check by the front door less the core's, ms, medians of each example (at most 10)")
    print(f"  median {statistics.median(more):.2f}, largest {max(more):.2f}")


if __name__ == "__main__":
    main()
