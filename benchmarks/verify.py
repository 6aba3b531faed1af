"""Time and memory of `verify`, against forming the same images by the matched filter.

    python benchmarks/verify.py

Both sides form every image of every row of the mission, one process, in turn; the matched filter is (4) in plain
NumPy. The verdicts must be the same. Memory is the peak of a fresh process that verifies with two.
"""

import argparse
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

from bisar_budget.findings.images import VerifiedMission
from bisar_budget.mission.load import load_mission
from bisar_budget.simulator import collection
from bisar_budget.simulator.image_formation import matched_filter
from bisar_budget.verifier.limits import verify_mission

ROOT = Path(__file__).resolve().parent.parent
MISSION = ROOT / "specs" / "missions" / "rigling_moses_section_v_autofocus.yaml"


def timed(former: object) -> tuple[float, VerifiedMission]:
    """Verify with a way to form images; seconds and verdicts."""
    kept = collection.backprojection
    collection.backprojection = former  # type: ignore[assignment]
    try:
        start = time.perf_counter()
        verified = verify_mission(load_mission(str(MISSION)))
        return time.perf_counter() - start, verified
    finally:
        collection.backprojection = kept


def main() -> None:
    """Print medians, ratio, largest difference and memory."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="rounds, after one of warm-up")
    runs = parser.parse_args().runs
    formers = (collection.backprojection, matched_filter)
    timed(formers[0])
    times: list[list[float]] = [[], []]
    results = []
    for _ in range(runs):
        for former, kept in zip(formers, times, strict=True):
            seconds, verified = timed(former)
            kept.append(seconds)
            results.append(verified)
    ours, reference = (statistics.median(kept) for kept in times)
    pairs = zip(results[0].rows, results[1].rows, strict=True)
    apart = max(
        abs(a.measured_qpe_rad - b.measured_qpe_rad)
        for a, b in pairs
        if a.measured_qpe_rad is not None and b.measured_qpe_rad is not None
    )
    same = [row.verdict for row in results[0].rows] == [row.verdict for row in results[1].rows]
    print(
        "verify of Section V with autofocus, all rows, one process ÷ the same images by the matched filter in NumPy"
    )
    print(f"  {ours:.2f} s ÷ {reference:.2f} s = {ours / reference:.3f}")
    print(f"  verdicts {'the same' if same else 'DIFFER'}, measured phases within {apart:.1e} rad")
    command = (sys.executable, "-m", "bisar_budget", "verify", str(MISSION), "--jobs", "2")
    start = time.perf_counter()
    subprocess.run(command, capture_output=True, cwd=ROOT, check=False)
    took = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e3  # of the largest process
    print(f"  the command with two processes: {took:.1f} s, largest process {peak:.0f} MB")


if __name__ == "__main__":
    main()
