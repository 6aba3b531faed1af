"""Hold the check to exact ranges on random missions: limits, phases, displacements, aggregates, the scene's edge.

    python docs/prove_any_size.py                       # 10 000 missions of six families, two processes
    python docs/prove_any_size.py --write               # records the result in docs/full-model.md
    python docs/prove_any_size.py --missions 60 --processes 1
    python docs/prove_any_size.py --family drones --seed 17 --missions 1 --all

The missions are those of `tests/families.py`, the exact ranges those of `tests/reference.py`, and what is compared
stands in `tests/compared.py`: every number within 1 %, or 0.005 rad, 1 cm. Every miss is counted; the exit code is 1
if there is one. `python -m tests.families FAMILY SEED` prints a mission.
"""

import argparse
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
os.environ.setdefault("OMP_NUM_THREADS", "1")  # small arrays: threads of a process would only wait for each other

from bisar_budget.mission.load import parse_mission
from tests.compared import Compared, compared
from tests.families import FAMILIES, mission_text
from tests.recorded import record

PAGE = Path(__file__).with_name("full-model.md")
Outcome = tuple[str, int, list[Compared] | str]


def outcome(family: str, seed: int, steps: int) -> Outcome:
    """Compare one mission; the text of an exception where the check or the reference ends in one."""
    try:
        return family, seed, compared(parse_mission(mission_text(family, seed)), steps)
    except Exception as error:
        return family, seed, f"{type(error).__name__}: {error}"


def outcomes(families: list[str], seeds: range, steps: int, processes: int) -> Iterator[Outcome]:
    """Compare the seeds of each family in turn, over several processes."""
    cases = [(family, seed) for family in families for seed in seeds]
    if processes == 1:
        yield from (outcome(family, seed, steps) for family, seed in cases)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(outcome, *zip(*cases, strict=True), repeat(steps), chunksize=4)


class Tally:
    """What a family's missions gave."""

    def __init__(self) -> None:
        self.missions, self.bad_missions, self.crashes = 0, 0, list[str]()
        self.compared, self.missed = Counter[str](), Counter[str]()
        self.worst: dict[str, tuple[int, Compared]] = {}

    def add(self, seed: int, result: list[Compared] | str) -> list[Compared]:
        """Count one mission; its misses."""
        self.missions += 1
        if isinstance(result, str):
            self.crashes.append(f"seed {seed}: {result}")
            return []
        misses = [one for one in result if one.is_miss]
        self.bad_missions += bool(misses)
        for one in result:
            self.compared[one.quantity] += 1
            self.missed[one.quantity] += one.is_miss
            if one.quantity not in self.worst or one.off > self.worst[one.quantity][1].off:
                self.worst[one.quantity] = (seed, one)
        return misses

    @property
    def is_clean(self) -> bool:
        """Whether everything agreed."""
        return not self.crashes and not self.missed.total()

    def lines(self, family: str) -> Iterator[str]:
        """Say it."""
        yield (
            f"{family}: {self.missions} missions, {self.compared.total()} numbers, {self.missed.total()} misses in "
            f"{self.bad_missions} missions"
        )
        for quantity, count in self.compared.items():
            seed, worst = self.worst[quantity]
            of_what = f"  {quantity:26} {self.missed[quantity]:6} of {count:7}"
            yield f"{of_what}   worst: seed {seed}, {worst}" if worst.off else of_what
        for crash in self.crashes[:20]:
            yield f"  crash: {crash}"


def main() -> int:
    """Run it; 1 if there is a miss."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=10_000, help="in all, the same number of each family")
    parser.add_argument("--family", action="append", choices=FAMILIES, help="repeatable; default: all six")
    parser.add_argument("--seed", type=int, default=0, help="first seed of each family")
    parser.add_argument("--steps", type=int, default=100, help="sizes at which each error is tried up to its limit")
    parser.add_argument("--processes", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--all", action="store_true", help="print every miss, not the worst of each quantity alone")
    parser.add_argument("--write", action="store_true", help="record the result in docs/full-model.md")
    chosen = parser.parse_args()
    families = list(dict.fromkeys(chosen.family or FAMILIES))
    each = -(-chosen.missions // len(families))
    tallies = {family: Tally() for family in families}
    start = time.perf_counter()
    seeds = range(chosen.seed, chosen.seed + each)
    for family, seed, result in outcomes(families, seeds, chosen.steps, chosen.processes):
        for miss in tallies[family].add(seed, result):
            if chosen.all:
                print(f"{family} {seed}: {miss}", flush=True)
        if tallies[family].missions == each:
            print("\n".join(tallies[family].lines(family)), flush=True)
    missions = sum(tally.missions for tally in tallies.values())
    numbers, missed = (sum(of.total() for of in column) for column in zip(*_counts(tallies), strict=True))
    crashes = sum(len(tally.crashes) for tally in tallies.values())
    in_all = f"{missions} missions, {numbers} numbers, {missed} misses, {crashes} crashes"
    print(f"{in_all} ({time.perf_counter() - start:.0f} s)")
    if chosen.write:
        record(
            PAGE, "exact ranges", [*(line for family in families for line in tallies[family].lines(family)), in_all]
        )
    return 0 if all(tally.is_clean for tally in tallies.values()) else 1


def _counts(tallies: dict[str, Tally]) -> Iterator[tuple[Counter[str], Counter[str]]]:
    return ((tally.compared, tally.missed) for tally in tallies.values())


if __name__ == "__main__":
    sys.exit(main())
