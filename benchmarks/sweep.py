"""A sweep of a million cases of the paper's example: against its formulas by hand, and a loop of check.

Then what else arrays hold: cases of other examples together ÷ the same one by one.

By hand stands what the sweep finds too: geometry, the published phase and limit, the same by the full model to first
order at six or ten nodes, exact ranges of both signs, and the verdict. All in one process and one thread.

    OMP_NUM_THREADS=1 python benchmarks/sweep.py [million] [kinds] [--cases 1000000] [--runs 3]
"""

import argparse
import math
import resource
import statistics
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np

from bisar_budget.budget.check import check_mission
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.faults import SetValue
from bisar_budget.findings.case_table import Cases
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import number_of
from bisar_budget.mission.tree import read_tree
from bisar_budget.questions.asked import Asked

MISSION = Path(__file__).parent.parent / "specs" / "missions" / "rigling_moses_section_v.yaml"
DAY = date(2026, 1, 1)
ACCELERATION, TOTAL, CARRIER, BANDWIDTH = 0.005, math.pi / 4, 10e9, 300e6


def by_hand(azimuth: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Utilization, phase by exact ranges [rad] and status of Section V for azimuths of the receiver and apertures."""
    wavelength = SPEED_OF_LIGHT_MPS / CARRIER
    k, elevation, R = 2 * np.pi / wavelength, math.radians(13.609), 8500.0
    p, v = (30414.0, 0.0, 6000.0), (0.0, 150.0, 0.0)
    q = (
        R * np.cos(azimuth) * math.cos(elevation),
        R * np.sin(azimuth) * math.cos(elevation),
        np.full_like(T, R * math.sin(elevation)),
    )
    w = (60 * math.cos(math.radians(135)), 60 * math.sin(math.radians(135)), 0.0)
    S = math.hypot(*p)
    allowable = TOTAL / 2 / np.abs(np.pi / wavelength * T**2 / 4 * p[0] / S)
    use = ACCELERATION / allowable
    t_look, r_look = [x / S for x in p], [x / R for x in q]
    gradient = [t_look[axis] + r_look[axis] for axis in (0, 1)]
    t_radial = sum(x * y for x, y in zip(t_look, v, strict=True))
    r_radial = sum(x * y for x, y in zip(r_look, w, strict=True))
    rate = [(v[axis] - t_look[axis] * t_radial) / S + (w[axis] - r_look[axis] * r_radial) / R for axis in (0, 1)]
    skew = np.arctan2(
        np.abs(gradient[0] * rate[1] - gradient[1] * rate[0]), np.abs(gradient[0] * rate[0] + gradient[1] * rate[1])
    )
    resolution = (
        SPEED_OF_LIGHT_MPS / (BANDWIDTH * np.hypot(*gradient)),
        wavelength / (T * np.hypot(*rate) * np.sin(skew)),
    )
    angle = np.arccos(sum(x * y for x, y in zip(t_look, r_look, strict=True)))
    nodes, weights = np.polynomial.legendre.leggauss(6)
    mean, quadratic = weights / 2, 3.75 * weights * np.polynomial.legendre.legval(nodes, (0.0, 0.0, 1.0))
    band, t = 1 + (BANDWIDTH / CARRIER) ** 2 / 12, nodes[:, None] * T / 2
    X, Y = [p[i] + t * v[i] for i in range(3)], [q[i] + t * w[i] for i in range(3)]
    RX, RY = (np.sqrt(Z[0] ** 2 + Z[1] ** 2 + Z[2] ** 2) for Z in (X, Y))
    g, h = X[0] / RX + Y[0] / RY, X[1] / RX + Y[1] / RY

    def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return band * (mean @ (a * b)) - (mean @ a) * (mean @ b)

    gg, gh, hh = product(g, g), product(g, h), product(h, h)

    def ground_point(ranges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        along_g, along_h = product(g, ranges), product(h, ranges)
        turn = gg * hh - gh**2
        return (hh * along_g - gh * along_h) / turn, (gg * along_h - gh * along_g) / turn

    east, north = ground_point(X[0] / RX * ACCELERATION * t**2 / 2)
    worst = np.zeros_like(T)
    for sign in (1.0, -1.0):
        x, y = sign * east, sign * north
        for _ in range(2):
            left = RX + RY
            left = left - np.sqrt((X[0] + sign * ACCELERATION * t**2 / 2 - x) ** 2 + (X[1] - y) ** 2 + X[2] ** 2)
            left = left - np.sqrt((Y[0] - x) ** 2 + (Y[1] - y) ** 2 + Y[2] ** 2)
            step = ground_point(-left)
            x, y = x + step[0], y + step[1]
        left = left + g * step[0] + h * step[1]
        worst = np.maximum(worst, k * np.abs(quadratic @ left))
    status = np.where(use > 1 + 1e-9, 3, np.where(worst > TOTAL / 2, 2, np.where(use > 0.8, 2, 1)))
    assert angle.shape == resolution[0].shape == status.shape
    return use, worst, status


def timed(task: Callable[[], object]) -> tuple[float, float]:
    """Seconds by the clock and of CPU."""
    clock, cpu = time.perf_counter(), time.process_time()
    task()
    return time.perf_counter() - clock, time.process_time() - cpu


# What a mission has, and the example that has it.
KINDS = {
    "a scene's radius": ("rigling_moses_section_v", {"scene.radius": "500 m"}),
    "the same, full model": ("rigling_moses_section_v", {"scene.radius": "500 m", "allocation.model": "full"}),
    "inertial sensor and GNSS": ("../../tests/missions/uav_free_running", {}),
    "inertial sensor aided by GNSS": ("uav_stim300", {}),
    "oscillators": ("ocxo_free_running", {}),
    "oscillators, synchronised": ("tandem_x_synchronized", {}),
    "a direct path": ("ocxo_direct_path", {}),
    "covariances and a radius": ("drones_same_gnss", {"scene.radius": "100 m"}),
}


def of_kinds(runs: int, side: int = 64, few: int = 16) -> None:
    """Measure each kind of mission over apertures and bandwidths, `few` of the cases one by one."""
    print(f"{side * side} cases of an example together, and {few} of them one by one; time of one case")
    for kind, (name, changes) in KINDS.items():
        text = MISSION.parent / f"{name}.yaml"
        mission = parse_mission(text.read_bytes(), str(text), changes=[SetValue(*one) for one in changes.items()])
        tree = read_tree(mission.data, mission.file).root
        keys = ("collection.aperture_time", "radar.bandwidth")
        numbers = tuple(number_of(tree, key) for key in keys)
        axes = tuple(np.linspace(0.5, 1.5, side) * number.value for number in numbers)
        cases = Cases(numbers, axes, is_grid=True)

        def together(mission: Mission = mission, cases: Cases = cases) -> None:
            for _ in Asked(mission, cases, today=DAY).checked().parts:
                pass

        def one_by_one(mission: Mission = mission, cases: Cases = cases) -> None:
            for place in range(0, cases.count, cases.count // few):
                values = {key: float(one[0]) for key, one in cases.values(place, place + 1).items()}
                found = [SetValue(one.key, f"{values[one.key]!r} {one.dimension.si}") for one in cases.varied]
                case = parse_mission(mission.data, mission.file, changes=(*mission.changes, *found))
                check_mission(case, DAY)

        together()
        rounds = [(timed(together)[1] / cases.count, timed(one_by_one)[1] / few) for _ in range(runs)]
        ours, loop = (statistics.median(one[task] for one in rounds) for task in (0, 1))
        ratio = statistics.median(loop / ours for ours, loop in rounds)
        print(f"  {kind:26} {loop * 1e3:6.2f} ms ÷ {ours * 1e6:5.0f} µs = {ratio:4.0f}")


def of_a_million(count: int, runs: int) -> None:
    """Measure cases of Section V against its formulas by hand, and against a loop of check."""
    mission = load_mission(str(MISSION))
    tree = read_tree(mission.data, mission.file).root
    side = math.isqrt(count)
    axes = (np.radians(np.linspace(10, 170, side)), np.linspace(1, 10, side))
    keys = ("platforms.receiver.azimuth", "collection.aperture_time")
    cases = Cases(tuple(number_of(tree, key) for key in keys), axes, is_grid=True)
    azimuth, T = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))

    def swept() -> None:
        for _ in Asked(mission, cases, today=DAY).checked().parts:
            pass

    def looped(few: int = 200) -> None:
        for place in range(few):
            values = zip(keys, (f"{float(azimuth[place])!r} rad", f"{float(T[place])!r} s"), strict=True)
            check_mission(
                parse_mission(mission.data, mission.file, changes=[SetValue(*one) for one in values]),
                DAY,
            )

    # Memory first: by hand, whole arrays take gigabytes.
    swept()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    rounds = [(timed(lambda: by_hand(azimuth, T)), timed(swept), timed(looped)) for _ in range(runs)]
    print(f"sweep of {cases.count} cases of Section V ÷ its formulas by hand over whole arrays (at most 3)")
    for label, place in (("clock", 0), ("CPU", 1)):
        hand, ours = (statistics.median(one[task][place] for one in rounds) for task in (0, 1))
        loop = statistics.median(one[2][place] for one in rounds) / 200 * cases.count
        ratio = statistics.median(one[1][place] / one[0][place] for one in rounds)
        print(
            f"  {label:5} {ours:6.2f} s ÷ {hand:6.2f} s = {ratio:.2f}    a loop of check ÷ sweep = {loop / ours:.0f}"
        )
    few = Cases(cases.varied, tuple(axis[:: side // 50] for axis in axes), is_grid=True)
    found = Asked(mission, few, today=DAY).checked()
    whole = np.concatenate([part.values["utilization"] for part in found.parts])
    use, *_ = by_hand(*(axis.ravel() for axis in np.meshgrid(*few.columns, indexing="ij")))
    print(f"  largest difference of the utilization {np.abs(whole / use - 1).max():.0e} of itself")
    print(f"  peak memory of the sweep {peak:.0f} MB (at most 1000)")


def main() -> None:
    """Measure in turn, after one round of warm-up."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", choices=["million", "kinds"], default=["million", "kinds"])
    parser.add_argument("--cases", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=3)
    chosen = parser.parse_args()
    if "million" in chosen.what:
        of_a_million(chosen.cases, chosen.runs)
    if "kinds" in chosen.what:
        of_kinds(chosen.runs)


if __name__ == "__main__":
    main()
