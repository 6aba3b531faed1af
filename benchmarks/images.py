"""Measure image formation against public and plain yardsticks, sides in turn, accuracy beside each figure.

    python benchmarks/images.py                 # all; needs the bench extra
    python benchmarks/images.py backprojection  # one of: backprojection, exact, memory

Errors are the largest difference to the matched filter (4) over a sample of pixels that holds the scatterers,
relative to the largest value there. Rates count pixels times pulses, or also times frequencies.
"""

import argparse
import math
import platform
import statistics
import time
import tracemalloc
from collections.abc import Callable

import numpy as np
from numba import get_num_threads, njit, prange

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.simulator.image_formation import backprojection, ground_grid, matched_filter
from bisar_budget.simulator.phase_history import PhaseHistory, cell_centres, path, phase_history

PULSES, FREQUENCIES = 512, 512
SPACING = 0.25  # m, half of the range resolution on the ground and of the cross-range resolution
GEOMETRY = BistaticGeometry(
    transmitter=PlatformState(position=(30.4e3, 0, 6e3), velocity=(0, 150, 0)),
    receiver=PlatformState(position=(5.84e3, 5.84e3, 2e3), velocity=(-42.4, 42.4, 0)),
)


def scene() -> PhaseHistory:
    """Section V of the paper at 10 GHz, 300 MHz, 6 s; forty scatterers over the smaller image, a little noise."""
    rng = np.random.default_rng(1)
    slow_time = cell_centres(6.0, PULSES)
    points = np.concatenate((rng.uniform(-28, 28, (40, 2)), np.zeros((40, 1))), axis=1)
    return phase_history(
        points,
        rng.normal(size=40) + 1j * rng.normal(size=40),
        slow_time=slow_time,
        frequency=10e9 + cell_centres(300e6, FREQUENCIES),
        transmitter=path(GEOMETRY.transmitter, slow_time),
        receiver=path(GEOMETRY.receiver, slow_time),
        noise_power=0.01,
        rng=rng,
    )


def grid(count: int) -> np.ndarray:
    return ground_grid((0.0, 0.0), GEOMETRY.look_azimuth, (count * SPACING, count * SPACING), (count, count))


def in_turn(runs: int, *tasks: Callable[[], object]) -> list[tuple[float, float]]:
    """Median seconds by the clock and of CPU over `runs` rounds, the tasks taking turns; one round of warm-up."""
    figures: list[list[tuple[float, float]]] = [[] for _ in tasks]
    for index in range(runs + 1):
        for task, kept in zip(tasks, figures, strict=True):
            start, used = time.perf_counter(), time.process_time()
            task()
            if index:
                kept.append((time.perf_counter() - start, time.process_time() - used))
    return [(statistics.median(w for w, _ in kept), statistics.median(c for _, c in kept)) for kept in figures]


def error_db(image: np.ndarray, history: PhaseHistory, points: np.ndarray) -> float:
    """Against (4), at the brightest pixels and at random ones."""
    flat, values = points.reshape(-1, 3), image.reshape(-1)
    sample = np.random.default_rng(2).choice(values.size, 400, replace=False)
    sample = np.concatenate((sample, np.argsort(np.abs(values))[-400:]))
    exact = matched_filter(history, flat[sample])
    return 20 * math.log10(np.abs(values[sample] - exact).max() / np.abs(exact).max())


def compare_backprojection(runs: int) -> None:
    import fastsar

    history = scene()
    samples = history.samples.astype(np.complex64)
    step = (history.frequency[-1] - history.frequency[0]) / (FREQUENCIES - 1)

    def public(points: np.ndarray, upsample: int) -> np.ndarray:
        return fastsar.backproject(
            samples,
            history.transmitter,
            float(history.frequency[0]),
            float(step),
            points,
            rcv=history.receiver,
            upsample=upsample,
            window=False,
            backend="cpu",
        )

    print(
        f"backprojection of {PULSES} pulses, {FREQUENCIES} frequencies; ratios to fastsar's bistatic one on the CPU"
    )
    for count in (256, 1024):
        points = grid(count)
        sides: dict[str, Callable[[], np.ndarray]] = {
            "cubic": lambda p=points: backprojection(history, p, "cubic"),
            "fastsar, upsample 8": lambda p=points: public(p, 8),
            "fastsar, upsample 16": lambda p=points: public(p, 16),
        }
        if count == 256:
            sides["numpy"] = lambda p=points: backprojection(history, p, "numpy")
        seconds = in_turn(runs, *sides.values())
        pairs = PULSES * count**2
        for (name, side), (took, used) in zip(sides.items(), seconds, strict=True):
            scale = PULSES * FREQUENCIES if "fastsar" in name else 1
            print(
                f"  {count:4}² {name:20} {took * 1e3:8.1f} ms {pairs / took / 1e6:6.0f} Mpixel·pulse/s"
                f"   {seconds[1][0] / took:5.2f} ÷ default (CPU {seconds[1][1] / used:5.2f}),"
                f" {seconds[2][0] / took:5.2f} ÷ upsample 16"
                f"   error {error_db(side() / scale, history, points):6.1f} dB"
            )


LANES = 32


@njit(parallel=True, fastmath={"contract"}, error_model="numpy")
def horner(samples, first, step, transmitter, receiver, points, image):
    """Exact matched filter: a polynomial in exp(2πj Δf ΔR/c), many pixels side by side."""
    for block in prange(points.shape[0] // LANES):
        turn_re, turn_im = np.empty(LANES), np.empty(LANES)
        real, imag, carrier = np.empty(LANES), np.empty(LANES), np.empty(LANES)
        for pulse in range(samples.shape[0]):
            for j in range(LANES):
                far = 0.0
                for leg in range(2):
                    p = transmitter[pulse] if leg == 0 else receiver[pulse]
                    x, y, z = points[block * LANES + j, 0], points[block * LANES + j, 1], points[block * LANES + j, 2]
                    far += math.sqrt((x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2)
                    far -= math.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2)
                carrier[j] = 2 * math.pi * first * far / SPEED_OF_LIGHT_MPS
                turn_re[j] = math.cos(2 * math.pi * step * far / SPEED_OF_LIGHT_MPS)
                turn_im[j] = math.sin(2 * math.pi * step * far / SPEED_OF_LIGHT_MPS)
            real[:] = 0
            imag[:] = 0
            for k in range(samples.shape[1] - 1, -1, -1):
                re, im = samples[pulse, k].real, samples[pulse, k].imag
                for j in range(LANES):
                    a = real[j] * turn_re[j] - imag[j] * turn_im[j] + re
                    imag[j] = real[j] * turn_im[j] + imag[j] * turn_re[j] + im
                    real[j] = a
            for j in range(LANES):
                image[block * LANES + j] += complex(real[j], imag[j]) * complex(
                    math.cos(carrier[j]), math.sin(carrier[j])
                )


def compare_exact(runs: int) -> None:
    history, points = scene(), grid(128)
    step = (history.frequency[-1] - history.frequency[0]) / (FREQUENCIES - 1)

    def by_horner() -> np.ndarray:
        image = np.zeros(points.size // 3, complex)
        flat = points.reshape(-1, 3)
        horner(history.samples, history.frequency[0], step, history.transmitter, history.receiver, flat, image)
        return image.reshape(points.shape[:-1]) / history.samples.size

    sides = {"Horner in Numba": by_horner, "cubic": lambda: backprojection(history, points, "cubic")}
    seconds = in_turn(runs, *sides.values())
    print("exact filter, 128² pixels: cubic backprojection ÷ a matched filter by Horner's rule in Numba (at least 4)")
    for (name, side), (took, _) in zip(sides.items(), seconds, strict=True):
        rate = PULSES * FREQUENCIES * 128**2 / took / 1e9
        error = error_db(side(), history, points)
        ratio = seconds[0][0] / took
        print(f"  {name:16} {took * 1e3:7.1f} ms {rate:6.1f} Gsample/s   {ratio:5.1f}   error {error:.1f} dB")


def measure_memory(runs: int) -> None:
    print("peak memory of forming an image of 1024² pixels, its own 17 MB included (below 500 MB)")
    history, points = scene(), grid(1024)
    few = slice(0, 16)  # enough for NumPy, whose memory does not depend on the number of pulses
    short = PhaseHistory(
        samples=history.samples[few],
        slow_time=history.slow_time[few],
        frequency=history.frequency,
        transmitter=history.transmitter[few],
        receiver=history.receiver[few],
    )
    for kernel in ("cubic", "numpy"):
        backprojection(history, points[:64, :64], kernel)
        tracemalloc.start()
        backprojection(short if kernel == "numpy" else history, points, kernel)
        print(f"  {kernel:7} {tracemalloc.get_traced_memory()[1] / 1e6:5.0f} MB")
        tracemalloc.stop()


TASKS = {"backprojection": (compare_backprojection, 5), "exact": (compare_exact, 5), "memory": (measure_memory, 1)}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", nargs="?", choices=[*TASKS, "all"], default="all")
    parser.add_argument("--runs", type=int, help="rounds, after one of warm-up")
    chosen = parser.parse_args()
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, {get_num_threads()} threads")
    for name, (task, default) in TASKS.items():
        if chosen.task in (name, "all"):
            task(chosen.runs or default)
