"""Solving missions for the aperture time: one by one ÷ by arrays, and whether both find the same.

Each example of specs/missions, then two of them with a radius of the scene. In one process and one thread.

    OMP_NUM_THREADS=1 python benchmarks/solve.py [--runs 3]
"""

import argparse
import statistics
import time
from datetime import date
from pathlib import Path
from unittest.mock import patch

from bisar_budget.design import solve as solving
from bisar_budget.design.solve import Solution
from bisar_budget.faults import SetValue
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission

MISSIONS = Path(__file__).parent.parent / "specs" / "missions"
DAY = date(2026, 1, 1)
WITH_A_SCENE = ("rigling_moses_section_v", "uav_pair_l_band")


def solved(mission: Mission) -> tuple[Solution, float]:
    """A solution, and the seconds of processor time that it takes."""
    began = time.process_time()
    found = solving.solve(mission, "collection.aperture_time", today=DAY)
    return found, time.process_time() - began


def apart(one: Solution, other: Solution) -> float:
    """Largest relative distance of two crossings; the searches bracket each within 1e-6."""
    pairs = zip(one.crossings, other.crossings, strict=True)
    return max((abs(a.inside.value / b.inside.value - 1) for a, b in pairs), default=0.0)


def compare(name: str, mission: Mission, runs: int) -> None:
    """Print medians of both, in turn, and their ratio."""
    together, alone = [], []
    for _ in range(runs):
        found, seconds = solved(mission)
        together.append(seconds)
        with patch.object(solving._Search, "_engine", lambda *_: None):
            other, seconds = solved(mission)
        alone.append(seconds)
    by_case, by_arrays = statistics.median(alone), statistics.median(together)
    print(
        f"  {name:34} {1e3 * by_case:7.0f} ms ÷ {1e3 * by_arrays:6.0f} ms = {by_case / by_arrays:5.1f}   "
        f"{len(found.crossings)} crossings, apart by {apart(found, other):.1e}",
        flush=True,
    )


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3)
    runs = parser.parse_args().runs
    print("solve for the aperture time: one by one ÷ by arrays, CPU")
    for path in sorted(MISSIONS.glob("*.yaml")):
        compare(path.stem, load_mission(str(path)), runs)
    for name in WITH_A_SCENE:
        changes = [SetValue("scene.radius", "200 m"), SetValue("allocation.model", "full")]
        mission = load_mission(str(MISSIONS / f"{name}.yaml"), changes=changes)
        compare(f"{name}, scene of 200 m", mission, 1)


if __name__ == "__main__":
    main()
