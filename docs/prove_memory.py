"""Hold the memory of images to `simulation.memory_limit` on random missions, each in a process of its own.

    python docs/prove_memory.py --missions 200            # records its result in docs/memory.md
    python docs/prove_memory.py --missions 8 --seed 500
    python docs/prove_memory.py --slow                    # times of a short, slow mission, to docs/memory.md

Missions have apertures from 1 µs to 60 s, limits from 40 MB to 1 GB, every image former, one or several targets with
and without clutter, and images at one limit of `verify`; every other one goes without compiled kernels. What a
process holds at its peak, less what it holds when everything is imported, is to be below 1.2 times the limit, whether
images are formed or refused. A mission that takes longer than `--seconds` is ended, and its peak until then counts.
"""

import argparse
import json
import math
import subprocess
import sys
import time
from pathlib import Path
from random import Random
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bisar_budget.faults import MissionError
from bisar_budget.mission.load import parse_mission
from tests.conftest import mission_text
from tests.recorded import record

PAGE = Path(__file__).with_name("memory.md")
ALLOWED = 1.2  # of the limit
FORMERS = ("backprojection", "polar_format", "matched_filter", "far_field", "verify")
_STATUS = "/proc/self/status"


def drawn(seed: int) -> tuple[str, str, str, bool]:
    """Text of a mission file, what is done with it, its targets, and whether kernels are compiled."""
    random = Random(seed)

    def between(low: float, high: float) -> float:
        return math.exp(random.uniform(math.log(low), math.log(high)))

    def platform(wavelength: float, aperture_time: float) -> dict[str, Any]:
        error = {}
        if random.random() < 0.7:  # of up to some ten radians at the aperture's edge
            error["acceleration"] = min(between(0.01, 30) * wavelength / aperture_time**2, 1.0)
            error["velocity"] = min(between(0.01, 3) * wavelength / aperture_time, 1.0)
        return {
            "slant_range": between(300, 1e5),
            "azimuth": f"{random.uniform(0, 360)} deg",
            "elevation": f"{random.uniform(3, 70)} deg",
            "speed": between(1, 300),
            "motion_azimuth": f"{random.uniform(0, 360)} deg",
            "motion_error": error,
        }

    while True:
        frequency, aperture_time = between(0.3e9, 24e9), between(1e-6, 60)
        flight = (3e8 / frequency, aperture_time)
        changes = {
            "radar__center_frequency": frequency,
            "radar__bandwidth": min(between(5e6, 1.5e9), 0.9 * frequency),
            "collection__aperture_time": aperture_time,
            "platforms": {"transmitter": platform(*flight), "receiver": platform(*flight)},
            "requirements": {"quadratic_phase_error": "45 deg", "pslr": "-30 dB"},
            "simulation": {
                "memory_limit": round(between(40e6, 1e9)),
                "window": random.choice(("uniform", "taylor")),
            },
        }
        if random.random() < 0.3:
            changes["collection__pulses"] = round(between(200, 20000))
        if random.random() < 0.2:
            changes["autofocus"] = {"algorithm": random.choice(("pga", "map_drift")), "n_pull": 4}
        text = mission_text(**changes)
        try:
            parse_mission(text)
        except MissionError:
            continue
        return (
            text,
            random.choice(FORMERS),
            random.choice(("0, 0", "0, 0; 30 m, 9 m", "0, 0; clutter -25 dB")),
            seed % 2 == 0,
        )


def held(field: str) -> float:
    """Memory of this process: VmRSS now, VmHWM at its peak. [B]"""
    with open(_STATUS, encoding="ascii") as status:
        return next(1024.0 * int(line.split()[1]) for line in status if line.startswith(f"{field}:"))


def one(seed: int) -> None:
    """Form the images of one mission and print what they took at the peak; for a process of its own."""
    text, former, targets, is_compiled = drawn(seed)
    if not is_compiled:
        sys.modules["numba"] = sys.modules["finufft"] = None  # type: ignore[assignment]
    from bisar_budget.report.drawing.point_plot import archive
    from bisar_budget.simulator.image_formation import is_compiled as has_kernels
    from bisar_budget.simulator.point import SimulationError, simulate_point
    from bisar_budget.simulator.targets import parse_targets
    from bisar_budget.verifier.limits import rows_to_verify, verify_mission

    if has_kernels():
        import finufft  # noqa: F401
    mission = parse_mission(text)
    rows = rows_to_verify(mission) if former == "verify" else []
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the peak starts here
    bare = held("VmRSS")
    print(json.dumps([bare]), flush=True)
    try:
        if former == "verify":
            found = verify_mission(mission, Random(seed).choice(rows)).rows[0]
            said = (found.verdict == "not_evaluated" and found.reason) or found.verdict
        else:
            archive(simulate_point(mission, image_former=former, targets=parse_targets(targets)))
            said = "formed"
    except (SimulationError, ValueError) as error:
        said = str(error)
    print(json.dumps([held("VmHWM") - bare, said]), flush=True)


SLOW = {
    "radar": {"center_frequency": "1.3 GHz", "bandwidth": "1 GHz"},
    "collection": {"aperture_time": "0.1 s"},
    "platforms": {
        "transmitter": {
            "slant_range": "10 km",
            "azimuth": "0 deg",
            "elevation": "15 deg",
            "speed": "5 m/s",
            "motion_azimuth": "90 deg",
            "motion_error": {"velocity": "1 mm/s"},
        },
        "receiver": {
            "slant_range": "9 km",
            "azimuth": "45 deg",
            "elevation": "15 deg",
            "speed": "5 m/s",
            "motion_azimuth": "135 deg",
        },
    },
}


def seconds_of_slow(kind: str) -> None:
    """Print the processor time of the image of the short, slow mission [s]; for a process of its own."""
    if kind == "NumPy":
        sys.modules["numba"] = sys.modules["finufft"] = None  # type: ignore[assignment]
    from bisar_budget.simulator.point import simulate_point

    simulate_point(parse_mission(mission_text(collection__aperture_time="0.5 s")))  # imports, compiles
    began = time.process_time()
    simulate_point(parse_mission(mission_text(**SLOW)))
    print(time.process_time() - began)


def slow() -> None:
    """Compare compiled kernels with NumPy on the short, slow mission; exit with 1 if they take over twice as long."""
    times = {}
    for kind in ("compiled", "NumPy"):
        command = [sys.executable, __file__, "--seconds-of-slow", kind]
        runs = [float(subprocess.run(command, capture_output=True, text=True, check=True).stdout) for _ in range(2)]
        times[kind] = min(runs)
    ratio = times["compiled"] / times["NumPy"]
    result = f"compiled {times['compiled']:.2f} s, NumPy {times['NumPy']:.2f} s: {ratio:.2f} times, 2 allowed"
    print(result)
    record(PAGE, "slow", [result])
    sys.exit(1 if ratio > 2 else 0)


def peak_of(seed: int, seconds: float) -> tuple[float | None, str]:
    """Peak above the bare process [B], None where it was ended first, and what came of the images."""
    command = [sys.executable, __file__, "--one", str(seed)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        output, errors = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
            high = next(1024.0 * int(line.split()[1]) for line in status if line.startswith("VmHWM:"))
        process.kill()
        bare = process.communicate()[0].splitlines()[:1]
        return (high - json.loads(bare[0])[0] if bare else None), "ended"
    lines = output.splitlines()
    if process.returncode or len(lines) != 2:
        return math.inf, (errors.strip().splitlines() or ["no output"])[-1]
    peak, said = json.loads(lines[1])
    return float(peak), str(said)


def main() -> None:
    """Measure random missions and count those beyond the limit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--seconds", type=float, default=60.0, help="after which a mission is ended")
    parser.add_argument("--slow", action="store_true", help="compare times of a short, slow mission instead")
    parser.add_argument("--seconds-of-slow", metavar="KIND", help=argparse.SUPPRESS)
    parser.add_argument("--one", type=int, metavar="SEED", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one is not None:
        one(asked.one)
        return
    if asked.seconds_of_slow is not None:
        seconds_of_slow(asked.seconds_of_slow)
        return
    if asked.slow:
        slow()
    counts = {"formed": 0, "refused for memory": 0, "without image": 0, "ended": 0}
    beyond, worst = 0, 0.0
    for seed in range(asked.seed, asked.seed + asked.missions):
        text, former, _, is_compiled = drawn(seed)
        limit = (parse_mission(text).simulation or 0).memory_limit  # type: ignore[union-attr]
        peak, said = peak_of(seed, asked.seconds)
        is_formed = said in ("formed", "confirmed", "optimistic", "conservative")
        kind = (
            "ended" if said == "ended"
            else "formed" if is_formed
            else "refused for memory" if "memory_limit" in said
            else "without image"
        )  # fmt: skip
        counts[kind] += 1
        ratio = (peak or 0.0) / limit
        worst = max(worst, ratio)
        beyond += ratio > ALLOWED
        mark = "BEYOND " if ratio > ALLOWED else ""
        kernels = "compiled" if is_compiled else "NumPy"
        sizes = f"{(peak or 0.0) / 1e6:.0f} of {limit / 1e6:.0f} MB"
        print(f"{mark}{seed} {former} {kernels}: {sizes}, {kind}: {said[:110]}", flush=True)
    result = f"{asked.missions} missions: {', '.join(f'{count} {kind}' for kind, count in counts.items())}"
    result += f"; largest peak {worst:.2f} of the limit, {beyond} beyond {ALLOWED}"
    print(result)
    if not asked.seed:
        record(PAGE, "memory", [result])
    sys.exit(1 if beyond else 0)


if __name__ == "__main__":
    main()
