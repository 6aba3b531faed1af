"""Tones displace the image: by exact ranges in all phases of the tone, sampled here, from slow to fast."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY, mission_text, row
from tests.report.test_report_explanation import repeat_by_hand

Array = NDArray[np.float64]

C, G = 299_792_458.0, 9.80665
T, F_0 = 4.0, 9.6e9
NAMES = ("transmitter", "receiver")
PLACES = {"transmitter": (20e3, -6e3, 5e3), "receiver": (-3e3, 7e3, 2e3)}
VELOCITIES = {"transmitter": (20.0, 140.0, 0.0), "receiver": (-50.0, 30.0, 0.0)}
U, WEIGHTS = np.polynomial.legendre.leggauss(160)
TAU = U * T / 2
PATHS = {name: np.array(PLACES[name])[:, None] + np.outer(VELOCITIES[name], TAU) for name in NAMES}
PHASES = np.arange(24) * math.pi / 12
HEARD = {"synchronization": {"method": "direct_path", "error": "1 deg"}}


def checked(**changes: Any) -> MissionFindings:
    platforms = {name: {"position": list(PLACES[name]), "velocity": list(VELOCITIES[name])} for name in NAMES}
    for name in NAMES:
        platforms[name] |= changes.pop(name, {})
    changes.setdefault("allocation", {"model": "full", "combine": "rss"})
    radar, collection = {"center_frequency": F_0, "bandwidth": "200 MHz"}, {"aperture_time": T}
    text = mission_text(radar=radar, collection=collection, platforms=platforms, **changes)
    return check_mission(parse_mission(text), TODAY)


def shaken(amplitude: Any, cycles: float) -> dict[str, Any]:
    line = {"amplitude": amplitude, "frequency": cycles / T}
    return {"motion_error": {"vibration": {"sinusoidal": [line]}}}


def displaced(moved: Array, name: str, *, is_heard: bool = False, clock: Any = 0.0) -> Array:
    """Ground point for which the range history that is left has no mean and no slope, by Newton's method. [m]"""
    measured = {one: PATHS[one] + (moved if one == name else 0.0) for one in NAMES}

    def left(point: Array) -> Array:
        there = np.array([*point, 0.0])[:, None]
        history = sum(np.linalg.norm(PATHS[one], axis=0) for one in NAMES) + clock
        history = history - sum(np.linalg.norm(measured[one] - there, axis=0) for one in NAMES)
        if is_heard:
            history += np.linalg.norm(measured["transmitter"] - measured["receiver"], axis=0)
            history -= np.linalg.norm(PATHS["transmitter"] - PATHS["receiver"], axis=0)
        return np.array([WEIGHTS @ history, WEIGHTS @ (history * U)])

    point = np.zeros(2)
    for _ in range(6):
        steps = (left(point + one) - left(point - one) for one in np.eye(2))
        point = point - 2 * np.linalg.solve(np.array(list(steps)).T, left(point))
    return point


def of_all_phases(amplitude: Any, cycles: float, name: str, *, is_heard: bool = False) -> list[Array]:
    """Displacements in every phase, (phases, 2), of a motion along the line of sight, or of each axis of one. [m]"""
    waves = [np.cos(math.pi * cycles * U + phase) for phase in PHASES]
    sight = PATHS[name] / np.linalg.norm(PATHS[name], axis=0)
    ways = (
        [size * axis[:, None] for size, axis in zip(amplitude, np.eye(3), strict=True)] if np.ndim(amplitude) else []
    )
    return [
        np.array([displaced(way * wave, name, is_heard=is_heard) for wave in waves])
        for way in ways or [amplitude * sight]
    ]


@pytest.mark.parametrize("is_heard", [False, True])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("amplitude", [2e-4, (1e-4, 3e-4, 2e-4)])
@pytest.mark.parametrize("cycles", [0.08, 0.8, 1.6, 2.9, 12.0])
def test_it_is_the_worst_of_all_phases(cycles: float, amplitude: Any, name: str, is_heard: bool) -> None:
    """At 1.6 cycles 0.75 mm moved the image by 116 mm, and the check said 15 mm."""
    given = list(amplitude) if np.ndim(amplitude) else amplitude
    found = checked(**{name: shaken(given, cycles)}, **(HEARD if is_heard else {}))
    shown = row(found, f"{name}.vibration.sinusoidal.0").displacement_m
    assert shown is not None
    of_axes = of_all_phases(amplitude, cycles, name, is_heard=is_heard)
    of_each = sum(np.sqrt(2 * np.square(one).mean(axis=0)) for one in of_axes)
    assert np.array(shown) == pytest.approx(of_each, rel=1e-3)
    directions = np.array([np.cos(PHASES / 2), np.sin(PHASES / 2)])
    worst = sum(np.abs(one @ directions).max(axis=0) for one in of_axes).max()  # axes in any phases
    assert worst <= math.hypot(*shown) * (1 + 1e-4)
    assert math.hypot(*shown) <= worst * 1.02  # of directions 7.5 degrees apart; one order makes nearly all of it
    assert row(found, "mission.location_error").declared == pytest.approx(math.hypot(*shown))


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
@pytest.mark.parametrize(("factor", "status"), [(0.99, "warn"), (1.01, "fail")])
def test_the_location_holds_it_on_both_sides_of_the_limit(combine: str, factor: float, status: str) -> None:
    lines = [(3e-4, 0.8), (2e-4, 1.6), (5e-4, 5.2)]
    entries = [{"amplitude": size, "frequency": cycles / T} for size, cycles in lines]
    sizes = [
        float(np.sqrt(2 * np.square(of_all_phases(size, cycles, "receiver")[0]).mean(axis=0).sum()))
        for size, cycles in lines
    ]
    total = {"each": max, "sum": math.fsum, "rss": lambda parts: math.hypot(*parts)}[combine](sizes)
    found = checked(
        receiver={"motion_error": {"vibration": {"sinusoidal": entries}}},
        allocation={"model": "full", "combine": combine},
        requirements={"location_error": total / factor, "cubic_phase_error": 1.0, "pslr": -10},
    )
    location = next(one for one in found.requirements if one.key == "location_error")
    assert location.status == row(found, "mission.location_error").status == status


def test_it_does_not_jump_at_a_cycle_nor_at_three() -> None:
    for border in (1.0, 3.0):
        below, above = (
            row(checked(receiver=shaken(1e-4, border + step)), "mission.location_error").declared
            for step in (-1e-6, 1e-6)
        )
        assert below is not None
        assert above == pytest.approx(below, rel=1e-4)


def test_the_published_model_displaces_by_equation_25() -> None:
    """By Q of (19), which holds the range constant, and parts of the tone by a fit of Legendre polynomials."""
    cycles, amplitude = 1.6, 1e-4
    found = checked(receiver=shaken(amplitude, cycles), allocation={"model": "published"})
    ranges = {name: math.hypot(*PLACES[name]) for name in NAMES}
    s, rate = (sum(np.array(of[name][:2]) / ranges[name] for name in NAMES) for of in (PLACES, VELOCITIES))
    waves = np.array([np.cos(math.pi * cycles * U + phase) for phase in PHASES])
    orders = np.array([waves @ WEIGHTS / 2, waves @ (WEIGHTS * U) * 1.5 / (T / 2)]) * amplitude
    places = np.linalg.solve(-np.array([s, rate]), orders)
    shown = row(found, "receiver.vibration.sinusoidal.0").displacement_m
    assert np.abs(np.array(shown)) == pytest.approx(np.sqrt(2 * np.square(places).mean(axis=1)), rel=1e-3)


@pytest.mark.parametrize(
    ("cycles", "row_id"), [(0.8, "receiver.oscillator.acceleration"), (1.6, "receiver.oscillator.acceleration.0")]
)
def test_a_tone_of_a_shaken_oscillator_displaces_as_its_time_error_does(cycles: float, row_id: str) -> None:
    """y = Γ·a is a range error of c·Γ·a/(2πf), slow or fast; faster than one cycle it moved nothing."""
    felt = {"sinusoidal": [{"amplitude": "0.1 g", "frequency": cycles / T}]}
    oscillator = {"power_law": {"h0": 1e-30}, "acceleration_sensitivity": "1e-9 /g", "vibration": felt}
    shown = row(checked(receiver={"oscillator": oscillator}), row_id).displacement_m
    size = C * 1e-10 / (2 * math.pi * cycles / T)
    places = [displaced(np.zeros((3, 1)), "", clock=size * np.cos(math.pi * cycles * U + one)) for one in PHASES]
    assert np.array(shown) == pytest.approx(np.sqrt(2 * np.square(places).mean(axis=0)), rel=1e-3)


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("sync", [{}, HEARD])
def test_every_row_of_a_tone_is_explained(model: str, sync: dict[str, Any]) -> None:
    lines = [
        {"amplitude": ["10 um", "5 um", "20 um"], "frequency": "0.7 Hz"},
        {"amplitude": "1 mg", "frequency": 0.2},
    ]
    oscillator = {
        "frequency": "10 MHz",
        "phase_noise": {"1 Hz": "-120 dBc/Hz", "1 kHz": "-150 dBc/Hz"},
        "spurs": {"2 Hz": "-110 dBc"},
    }
    oscillator |= {"acceleration_sensitivity": "1e-10 /g"}
    receiver = {"motion_error": {"vibration": {"sinusoidal": lines}}, "oscillator": oscillator}
    changes = {"allocation": {"model": model}, "requirements": {"location_error": 1.0, "pslr": -20}, **sync}
    platforms = {name: {"position": list(PLACES[name]), "velocity": list(VELOCITIES[name])} for name in NAMES}
    platforms["receiver"] |= receiver
    repeat_by_hand(parse_mission(mission_text(platforms=platforms, **changes)))
