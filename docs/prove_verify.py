"""Hold the verdicts of `verify` to exact ranges on random missions, and time it.

    python docs/prove_verify.py                         # 102 missions of six families, one process
    python docs/prove_verify.py --missions 12 --family jets

A limit is to have its image. Its verdict is to be that of exact ranges, and its measured phase within 5 % of theirs
or 0.02 rad. No limit of the full model is to be optimistic. Every miss is printed, and then the exit code is 1.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bisar_budget.findings.images import Verdict
from bisar_budget.mission.load import parse_mission
from bisar_budget.verifier.limits import verify_mission
from tests.families import FAMILIES, mission_text

SHARE, FLOOR_RAD = 0.05, 0.02  # of the phase by exact ranges
CONFIRMED = 0.05  # of the budget
_NO_IMAGE = (
    "stated as a phase",
    "many flights",
    "two places",
    "no declared error",
)  # rows without one, by their nature


def misses(verdict: Verdict, gates_by_full: bool) -> Iterator[str]:
    """What is wrong with one verdict."""
    if verdict.verdict == "not_evaluated":
        yield f"no verdict: {verdict.reason}"
    if gates_by_full and verdict.verdict == "optimistic" and verdict.id != "mission.autofocus_pull_in":
        yield f"an optimistic limit of the full model: {verdict.reason}"
    measured, exact, budget = verdict.measured_qpe_rad, verdict.predicted_qpe_rad, verdict.budget_rad
    if measured is None or exact is None or "bound by" in (verdict.reason or ""):
        return  # of a limit set by another requirement the phase is not what is judged
    if abs(measured - exact) > max(SHARE * exact, FLOOR_RAD):
        yield f"the image shows {measured:.4g} rad, exact ranges {exact:.4g}"
    if budget is not None and verdict.verdict in ("confirmed", "optimistic", "conservative"):
        excess = exact / budget - 1
        by_exact = "confirmed" if abs(excess) <= CONFIRMED else "optimistic" if excess > 0 else "conservative"
        is_close = abs(abs(excess) - CONFIRMED) < SHARE * CONFIRMED  # on the border either is right
        if by_exact != verdict.verdict and not is_close:
            yield f"{verdict.verdict}, by exact ranges {by_exact} ({exact:.4g} of {budget:.4g} rad)"


def main() -> None:
    """Verify random missions and count what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=102, help="in all, the same number of each family")
    parser.add_argument("--family", choices=FAMILIES, action="append", help="repeatable; default: all six")
    parser.add_argument("--seed", type=int, default=0, help="first seed of each family")
    asked = parser.parse_args()
    families = asked.family or list(FAMILIES)
    rows = without = wrong = 0
    times: list[float] = []
    for family in families:
        for seed in range(asked.seed, asked.seed + asked.missions // len(families)):
            mission = parse_mission(mission_text(family, seed))
            begun = time.perf_counter()
            verified = verify_mission(mission)
            times.append(time.perf_counter() - begun)
            for verdict in verified.rows:
                if any(words in (verdict.reason or "") for words in _NO_IMAGE):
                    continue
                rows += 1
                for miss in misses(verdict, mission.allocation.model == "full"):
                    print(f"{family} {seed} {mission.allocation.model}: {verdict.id}: {miss}", flush=True)
                    without += miss.startswith("no verdict")
                    wrong += not miss.startswith("no verdict")
            print(f"{family} {seed}: {len(verified.rows)} rows, {times[-1]:.1f} s", flush=True)
    print(
        f"{len(times)} missions, {rows} limits, {without} without a verdict ({100 * without / max(rows, 1):.2f} %), "
        f"{wrong} wrong; median {statistics.median(times):.1f} s, longest {max(times):.1f} s"
    )
    sys.exit(1 if wrong or without > 0.01 * rows else 0)


if __name__ == "__main__":
    main()
