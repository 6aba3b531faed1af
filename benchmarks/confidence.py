"""Cost of a check with confidences, and of the distributions of sums.

    python benchmarks/confidence.py

Both sides of a ratio take turns in one process, and figures are medians of CPU times. The accuracy of a quantile is
its distance from the same quantile of 10⁶ draws, which know it to about 0.2 %.
"""

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import bisar_budget as bb
from bisar_budget.random_vector import RandomVector

EXAMPLES = sorted((Path(__file__).parents[1] / "specs" / "missions").glob("*.yaml"))
ROUNDS, DRAWS, CONFIDENCES = 7, 1_000_000, (0.5, 0.68, 0.9, 0.95, 0.997)


def seconds(call: Callable[[], object]) -> float:
    began = time.process_time()
    call()
    return time.process_time() - began


def checks() -> None:
    print("check with 95 % on quadratic phase and location ÷ the same check at 1 sigma, CPU (at most 2)")
    ratios = []
    for path in EXAMPLES:
        mission = bb.load(str(path))
        if mission.allocation.coverage_factor != 1:
            continue
        needs = mission.requirements
        asked = mission.replace(
            {
                f"requirements.{key}": f"{{limit: {limit}, confidence: 95 %}}"
                for key, limit in (
                    ("quadratic_phase_error", f"{needs.quadratic_phase_error} rad"),
                    ("location_error", f"{needs.location_error or 10.0} m"),
                )
            }
        )
        sides: tuple[list[float], list[float]] = ([], [])
        for _ in range(ROUNDS):
            for times, one in zip(sides, (mission, asked), strict=True):
                times.append(seconds(lambda one=one: bb.check(one)))
        plain, with_confidence = map(statistics.median, sides)
        ratios.append((with_confidence / plain, path.stem))
        print(f"  {path.stem:38} {1e3 * with_confidence:6.1f} ms ÷ {1e3 * plain:6.1f} ms = {ratios[-1][0]:.2f}")
    print(f"  median {statistics.median(ratio for ratio, _ in ratios):.2f}, largest {max(ratios)[0]:.2f}")


def distributions() -> None:
    print("five quantiles of a sum, CPU, and the largest difference from those of 10⁶ draws")
    generator = np.random.default_rng(1)
    for name, width, counts in (
        ("a phase, 12 normal errors", 1, (12, 0, 0)),
        ("a phase, 6 normal and 6 uniform errors", 1, (6, 6, 0)),
        ("a place, 12 normal errors", 2, (12, 0, 0)),
        ("a place, 6 normal and 6 uniform errors", 2, (6, 6, 0)),
        ("a place, 6 uniform errors, 2 bounds", 2, (0, 6, 2)),
        ("five parts, 12 normal errors", 5, (12, 0, 0)),
    ):
        normal, uniform, bound = (generator.normal(size=(count, width)) for count in counts)
        vector = RandomVector(np.zeros(width), normal, uniform, bound, np.zeros((0, 2, width)))
        cost = statistics.median(seconds(lambda v=vector: v.quantiles(CONFIDENCES)) for _ in range(ROUNDS))
        drawn = sum(
            np.asarray(values @ rows)
            for values, rows in (
                (generator.standard_normal((DRAWS, len(normal))), normal),
                (generator.uniform(-1, 1, (DRAWS, len(uniform))), uniform),
                (np.sign(generator.uniform(-1, 1, (DRAWS, len(bound)))), bound),
            )
        )
        expected = np.quantile(np.linalg.norm(drawn, axis=1), CONFIDENCES)
        differs = np.abs(np.array(vector.quantiles(CONFIDENCES)) / expected - 1).max()
        print(f"  {name:40} {1e3 * cost:7.2f} ms   {100 * differs:.2f} %")


if __name__ == "__main__":
    checks()
    distributions()
