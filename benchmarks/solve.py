"""Solving missions for the aperture time, and their sensitivities, beside as many checks as a range has places.

Each example of specs/missions, then two of them with a radius of the scene. In one process and one thread.

    OMP_NUM_THREADS=1 python benchmarks/solve.py [--runs 3]
"""

import argparse
import statistics
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import SetValue
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.questions.sensitivity import sensitivity
from bisar_budget.questions.solve import SOLVE_SETTINGS, solve

MISSIONS = Path(__file__).parent.parent / "specs" / "missions"
DAY = date(2026, 1, 1)
WITH_A_SCENE = ("rigling_moses_section_v", "uav_pair_l_band")


def timed(task: Callable[[], object]) -> float:
    """Processor time of a task. [s]"""
    began = time.process_time()
    task()
    return time.process_time() - began


def compare(name: str, mission: Mission, runs: int) -> None:
    """Print medians of all three, in turn."""
    tasks = (
        lambda: [check_mission(mission, DAY) for _ in range(SOLVE_SETTINGS.range_samples)],
        lambda: solve(mission, "collection.aperture_time", date=DAY),
        lambda: sensitivity(mission, date=DAY),
    )
    each = [[timed(task) for task in tasks] for _ in range(runs)]
    checks, solving, asking = (1e3 * statistics.median(seconds) for seconds in zip(*each, strict=True))
    print(f"  {name:34} {checks:7.0f} ms   {solving:6.0f} ms   {asking:6.0f} ms", flush=True)


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3)
    runs = parser.parse_args().runs
    print(f"{SOLVE_SETTINGS.range_samples} checks, solve for the aperture time, sensitivity: CPU")
    for path in sorted(MISSIONS.glob("*.yaml")):
        compare(path.stem, load_mission(str(path)), runs)
    for name in WITH_A_SCENE:
        changes = [SetValue("scene.radius", "200 m"), SetValue("allocation.model", "full")]
        mission = load_mission(str(MISSIONS / f"{name}.yaml"), changes=changes)
        compare(f"{name}, scene of 200 m", mission, 1)


if __name__ == "__main__":
    main()
