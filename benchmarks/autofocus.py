"""Phase gradient autofocus against fastsar's on the same images, in turn; what phase each leaves beside its time.

    pip install fastsar
    python benchmarks/autofocus.py

Points and white clutter on 1024 x 1024 pixels, the aperture half of the sampling band, a quadratic phase of
4.6 rad at its edge. The ratio of a point is its error-free peak power over the clutter's mean power in the image.
"""

import argparse
import math

import numpy as np
from run import clock, in_turn

from bisar_budget.simulator.autofocus import phase_gradient_autofocus

SIDE, BAND = 1024, 512


def scene(points: int, ratio_db: float) -> tuple[np.ndarray, np.ndarray]:
    """Image, cross-range along the second axis, and its phase over the band, by direct sums over the aperture."""
    rng = np.random.default_rng(1)
    bins = np.arange(BAND) - BAND // 2
    phase = 4.6 * ((2 * bins + 1) / BAND) ** 2
    noise = rng.normal(size=(SIDE, BAND)) + 1j * rng.normal(size=(SIDE, BAND))
    aperture = noise * math.sqrt(10 ** (-ratio_db / 10) / (2 * BAND))
    for row, place in zip(rng.integers(0, SIDE, points), rng.uniform(0.1, 0.9, points), strict=True):
        aperture[row] += np.exp(2j * math.pi * (rng.random() - bins * place)) / BAND
    spectrum = np.zeros((SIDE, SIDE), dtype=complex)
    spectrum[:, bins % SIDE] = aperture * np.exp(1j * phase)
    return np.fft.ifft(spectrum, axis=1) * SIDE, phase


def left(estimate: np.ndarray, phase: np.ndarray) -> float:
    """Rms of true less estimated phase over the band, constant and linear part removed. [rad]"""
    bins = np.arange(BAND) - BAND // 2
    error = phase - estimate[bins % SIDE]
    return float(np.std(error - np.polyval(np.polyfit(bins, error, 1), bins)))


def main(runs: int) -> None:
    from fastsar.autofocus import pga

    print("phase gradient autofocus ÷ fastsar's pga, wall clock (at most 0.1), with the phase each leaves")
    for points, ratio_db in ((200, 30.0), (2000, 30.0), (200, 20.0), (5, 30.0)):
        image, phase = scene(points, ratio_db)
        columns = np.ascontiguousarray(image.T)  # fastsar's own layout: azimuth along the first axis
        ours = left(phase_gradient_autofocus(image).phase, phase)
        (a,), (b,), (c,) = in_turn(
            runs,
            clock(lambda image=image: phase_gradient_autofocus(image)),
            clock(lambda columns=columns: pga(columns)),
            clock(lambda image=image: pga(image.T)),
        )
        theirs = left(np.fft.ifftshift(pga(columns)[1]), phase)
        print(
            f"  {points:4} points, {ratio_db:.0f} dB   {a * 1e3:5.0f} ms ÷ {b * 1e3:5.0f} ms = {a / b:.3f}   "
            f"(÷ {c * 1e3:5.0f} ms = {a / c:.3f} where fastsar's axis is contiguous)   "
            f"{ours:.3f} and {theirs:.3f} rad"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="rounds, after one of warm-up")
    main(parser.parse_args().runs)
