"""Sheets of specifications, beside a check of the mission, in turn; the conditions of the maximum beside each.

Each example of specs/missions; those that hold each error alone by root-sum-square. In one process and one thread.

    OMP_NUM_THREADS=1 python benchmarks/allocate.py [--runs 5]
"""

import argparse
import statistics
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import SetValue
from bisar_budget.findings.specification import SpecificationSheet
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.questions.allocate import allocate

MISSIONS = Path(__file__).parent.parent / "specs" / "missions"
DAY = date(2026, 1, 1)


def timed(task: Callable[[], object]) -> float:
    """Processor time of a task. [s]"""
    began = time.process_time()
    task()
    return time.process_time() - began


def misfit(sheet: SpecificationSheet) -> float:
    """Largest part of its weight by which Σ multiplier·share of an error is off it."""
    worth = [
        abs(sum(row.multiplier * row.shares.get(one.key, 0.0) for row in sheet.rows) / one.weight - 1)
        for one in sheet.specifications
        if one.value is not None
    ]
    return max(worth, default=0.0)


def compare(name: str, mission: Mission, runs: int) -> None:
    """Print medians of both, in turn."""
    tasks = (lambda: check_mission(mission, DAY), lambda: allocate(mission, reserve=0.0, date=DAY).found)
    each = [[timed(task) for task in tasks] for _ in range(runs + 1)][1:]
    checking, asking = (1e3 * statistics.median(seconds) for seconds in zip(*each, strict=True))
    sheet = allocate(mission, reserve=0.0, date=DAY).found
    said = "no room" if sheet.broken else f"off by {misfit(sheet):.0e}"
    print(f"  {name:38} {asking:5.0f} ms ÷ {checking:4.0f} ms = {asking / checking:5.1f}   {said}", flush=True)


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    print("allocate ÷ check, CPU (at most 500 ms); Σ multiplier·share of the weights")
    for path in sorted(MISSIONS.glob("*.yaml")):
        mission = load_mission(str(path))
        if mission.allocation.combine == "each":
            mission = load_mission(str(path), changes=[SetValue("allocation.combine", "rss")])
        compare(path.stem, mission, runs)


if __name__ == "__main__":
    main()
