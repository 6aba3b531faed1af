"""Vibrations below three cycles per aperture: their worst phases against exact ranges in 36 phases of each axis.

The reference is `tests.image_point`, which has no line of the package: the least variance of the phase over band and
aperture, of the exact ranges of true and measured paths. Of the package come only the paths and the axes.
"""

import math
from random import Random
from typing import Any

import numpy as np
import pytest
import yaml

import bisar_budget as bb
from bisar_budget.effects.slow_tones import slow_tones
from tests.conftest import row, seeds
from tests.image_point import Collection, Floats, no_error

# PLATFORMS: two aircraft; two drones beside the scene, whose lines of sight turn by a radian.
AIRCRAFT = {
    "transmitter": {"position": [30414, 0, 6000], "velocity": [0, 150, 0]},
    "receiver": {"position": [5840, 5840, 2000], "velocity": [-42, 42, 0]},
}
DRONES = {
    "transmitter": {"position": [400, -100, 120], "velocity": [3, 14, 0]},
    "receiver": {"position": [150, 260, 90], "velocity": [-12, 9, 0]},
}
RADARS = {"X": (10e9, 300e6, AIRCRAFT), "P": (435e6, 100e6, DRONES)}


def mission(
    name: str, shaken: str, amplitude: Any, frequency: float, frame: str = "scene", **keys: Any
) -> bb.Mission:
    carrier, bandwidth, platforms = RADARS[name]
    tree: dict[str, Any] = yaml.safe_load(yaml.safe_dump(platforms))
    line = {"amplitude": amplitude, "frequency": frequency}
    tree[shaken]["motion_error"] = {"frame": frame, "vibration": {"sinusoidal": [line]}}
    whole = {
        "schema_version": 1,
        "name": name,
        "radar": {"center_frequency": carrier, "bandwidth": bandwidth},
        "collection": {"aperture_time": 6.0},
        "platforms": tree,
        "requirements": {"quadratic_phase_error": "45 deg", "cubic_phase_error": "45 deg"},
        "allocation": {"model": "full", "combine": "each"},
    } | keys
    return bb.loads(yaml.safe_dump(whole))


def worst_phases(given: bb.Mission, shaken: str) -> Floats:
    """Quadratic, cubic and equal-loss phase and the rest: of each axis the largest of 36 phases, added. [rad]"""
    paths = tuple(
        lambda times, path=path: np.stack(np.broadcast_arrays(*path.place(times)), axis=1)
        for path in given.geometry.both
    )
    error = getattr(given.platforms, shaken).motion_error
    line, found = error.vibration.sinusoidal[0], np.zeros(4)
    for axis, size in zip(getattr(given.geometry, shaken).frame(error.frame), line.amplitude, strict=True):
        worst = np.zeros(4)
        for phase in np.arange(36) * math.pi / 18:

            def moved(times: Floats, axis: Any = axis, size: float = size, phase: float = phase) -> Floats:
                return np.outer(size * np.cos(2 * math.pi * line.frequency * times + phase), axis)

            errors = (moved, no_error) if shaken == "transmitter" else (no_error, moved)
            radar = given.radar
            collection = Collection(radar.center_frequency, radar.bandwidth, 6.0, paths, errors)
            seen = collection.least_variance_point()
            parts = (seen.quadratic_rad, seen.cubic_rad, seen.equal_loss_rad, seen.rest_rad)
            worst = np.maximum(worst, np.abs(parts))
        found += worst
    return found


def random_mission(seed: int) -> tuple[bb.Mission, str]:
    random = Random(f"slow tone {seed}")
    name, shaken = random.choice(("X", "P")), random.choice(("transmitter", "receiver"))
    size = 10 ** random.uniform(-3, -0.3)
    amplitude = [size * random.choice((0, 1, random.random())) for _ in range(3)]
    amplitude[random.randrange(3)] = size
    frame = random.choice(("scene", "track", "look"))
    return mission(name, shaken, amplitude, random.uniform(0.1, 2.9) / 6, frame), shaken


@pytest.mark.parametrize("seed", seeds(60, 12))
def test_worst_phases_of_random_vectors_are_those_of_exact_ranges(seed: int) -> None:
    """36 phases miss the worst by up to 1 - cos 5° = 0.4 %; the second order is left out below 0.4 % and 1 mrad."""
    given, shaken = random_mission(seed)
    (tone,) = slow_tones(given, given.geometry, 1).values()
    does, wanted = tone.declared, worst_phases(given, shaken)
    got = np.array([part.item() for part in (does.quadratic, does.cubic, does.judged(1.0), does.rest)])
    assert got == pytest.approx(wanted, rel=0.01, abs=3e-3)


@pytest.mark.parametrize(
    ("shaken", "axis", "size", "cycles"), [("transmitter", 0, 1.0, 0.6), ("receiver", 1, 0.03, 0.7)]
)
def test_motion_across_the_line_of_sight_at_mid_aperture_counts(
    shaken: str, axis: int, size: float, cycles: float
) -> None:
    """Both passed with a quadratic phase of 0 rad: the line of sight was that of mid-aperture."""
    amplitude = [0.0, 0.0, 0.0]
    amplitude[axis] = size
    given = mission("X", shaken, amplitude, cycles / 6, "track")
    found = row(bb.check(given).findings, f"{shaken}.vibration.sinusoidal.0")
    quadratic, cubic, equal_loss, _ = worst_phases(given, shaken)
    assert (found.qpe_full_rad, found.equal_loss_qpe_rad) == pytest.approx((quadratic, equal_loss), rel=0.01)
    assert found.status == "fail"
    use = max(equal_loss / (math.pi / 8), cubic / (math.pi / 4))
    assert found.utilization == pytest.approx(use, rel=0.01)


@pytest.mark.parametrize(("part", "status"), [(0.99, "warn"), (1.01, "fail")])
def test_both_sides_of_the_limit(part: float, status: str) -> None:
    """The limit by the reference: its phases are proportional to so small an amplitude."""
    size = 1e-3
    _, cubic, equal_loss, _ = worst_phases(mission("X", "transmitter", [size, 0, 0], 0.1, "track"), "transmitter")
    allowed = size / max(equal_loss / (math.pi / 8), cubic / (math.pi / 4))
    given = mission("X", "transmitter", [float(part * allowed), 0, 0], 0.1, "track")
    assert row(bb.check(given).findings, "transmitter.vibration.sinusoidal.0").status == status


def test_a_single_size_is_along_the_line_of_sight_as_it_turns() -> None:
    """Its phase is that of its range error, but for what the displacement adds: 7.5·j₂(0.6π)·2πA/λ."""
    given = mission("X", "receiver", 1e-3, 0.1)
    found = row(bb.check(given).findings, "receiver.vibration.sinusoidal.0")
    x = 0.6 * math.pi
    j2 = (3 / x**2 - 1) * math.sin(x) / x - 3 * math.cos(x) / x**2
    assert found.declared == 1e-3
    assert found.qpe_full_rad == pytest.approx(7.5 * j2 * 2 * math.pi * 1e-3 / given.radar.wavelength, rel=0.02)
    assert found.allowable == pytest.approx(1e-3 / found.utilization, rel=1e-9)
