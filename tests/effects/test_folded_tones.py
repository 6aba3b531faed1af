"""Tones of oscillators between exchanged pulses, against tones that are sampled and joined by straight lines."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import legendre

import bisar_budget as bb
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.vibration_limits import highest_echo
from bisar_budget.mission.load import parse_mission

T, INTERVAL, LEVEL = 4.0, 0.1, -83.7
PHASE = 2 * 10 ** (LEVEL / 20) * 960  # of a spur of 10 MHz at 9.6 GHz. [rad]


def text(oscillator: str, requirements: str, interval: float = INTERVAL) -> str:
    return f"""
schema_version: 1
name: a pair
radar: {{center_frequency: 9.6 GHz, bandwidth: 200 MHz}}
collection: {{aperture_time: {T} s}}
platforms:
  transmitter:
    position: [20 km, -6 km, 5 km]
    velocity: [20 m/s, 140 m/s, 0 m/s]
    oscillator: {{frequency: 10 MHz, power_law: {{h0: 1e-30}}}}
  receiver:
    position: [5 km, 7 km, 2 km]
    velocity: [-50 m/s, 30 m/s, 0 m/s]
    oscillator: {{frequency: 10 MHz, power_law: {{h0: 1e-30}}, {oscillator}}}
requirements: {{quadratic_phase_error: 20 deg, cubic_phase_error: 10 deg, {requirements}}}
synchronization: {{method: linear, interval: {interval} s, error: 0}}
"""


def spur(frequency: float, requirements: str = "pslr: -17 dB", level: float = LEVEL, **others: Any) -> str:
    return text(f"spurs: {{{frequency} Hz: {level!r} dBc}}", requirements, **others)


def shaken(frequency: float, phase: float) -> str:
    """A vibration of the oscillator alone that makes the phase of a spur."""
    acceleration = phase * frequency / (9.6e9 * 1e-9)  # g
    tone = f"sinusoidal: [{{amplitude: {acceleration!r} g, frequency: {frequency} Hz}}]"
    return text(f"acceleration_sensitivity: 1e-9 /g, vibration: {{{tone}}}", "pslr: -17 dB")


def sampled(frequency: float, interval: float = INTERVAL) -> tuple[float, float, float]:
    """Largest quadratic and cubic phase of a tone of peak 1 less straight lines, in any phase, and the power left."""
    t = np.linspace(-T / 2, T / 2, 40_001)
    found, powers = [], []
    for start in (np.arange(8) + 0.5) / 8 * interval:
        knots = np.arange(t[0] - interval + start, t[-1] + 2 * interval, interval)
        of_phases = []
        for turn in (0.0, -math.pi / 2):  # a tone of any phase is a sum of these two
            left = np.cos(2 * math.pi * frequency * t + turn)
            left = left - np.interp(t, knots, np.cos(2 * math.pi * frequency * knots + turn))
            c = legendre.legfit(2 * t / T, left, 3)
            of_phases.append((1.5 * c[2], 2.5 * c[3]))
            powers.append(np.mean(left**2))
        found.append(np.hypot(*of_phases))
    return (*np.max(found, axis=0), np.mean(powers))


@pytest.mark.parametrize("frequency", [49.9, 50.05, 50.2, 30.15])
@pytest.mark.parametrize("kind", ["spur", "shaken"])
def test_a_tone_that_is_folded_below_one_cycle_is_a_phase(frequency: float, kind: str) -> None:
    """50.2 Hz every 100 ms is 0.2 Hz, 0.8 cycles of the aperture: 0.245 rad that nothing judged."""
    one = spur(frequency) if kind == "spur" else shaken(frequency, PHASE)
    found = bb.check(bb.loads(one))
    quadratic, cubic, _ = sampled(frequency)
    of_itself = PHASE / (math.pi * frequency * T)  # 7.5·j₂ and 17.5·j₃ of what stays at its frequency, in its echoes
    aggregate = found["receiver.quadratic_phase_error"].declared
    assert aggregate == pytest.approx(PHASE * quadratic, rel=1e-3, abs=7.5 * of_itself)
    assert found["mission.cubic_phase_error"].declared == pytest.approx(PHASE * cubic, rel=1e-3, abs=17.5 * of_itself)


@pytest.mark.parametrize(("over", "status"), [(0.99, "pass"), (1.01, "fail")])
def test_both_sides_of_the_limit_of_its_quadratic_phase(over: float, status: str) -> None:
    """10 deg is half of what is required."""
    quadratic, *_ = sampled(50.2)
    level = 20 * math.log10(over * math.radians(10) / quadratic / 960 / 2)
    without_cubic = spur(50.2, "pslr: -10 dB, islr: -5 dB", level).replace("cubic_phase_error: 10 deg, ", "")
    found = bb.check(bb.loads(without_cubic), model="full")
    assert found["receiver.quadratic_phase_error"].status == ("warn" if status == "pass" else status)


@pytest.mark.parametrize(("level", "is_most"), [(LEVEL, True), (-130.0, False)])
def test_an_aggregate_names_the_spur_that_makes_most_of_it(level: float, is_most: bool) -> None:
    """It said of the phase of a spur that a mask was continued."""
    noise = "{1 Hz: -85 dBc/Hz, 10 Hz: -115 dBc/Hz, 100 Hz: -130 dBc/Hz}"
    of_file = spur(50.2, level=level).replace("power_law: {h0: 1e-30}", f"phase_noise: {noise}")
    of_file = of_file.replace("quadratic_phase_error: 20 deg", "quadratic_phase_error: 1e-4 deg")
    found = bb.check(bb.loads(of_file))
    reason = str(found["receiver.quadratic_phase_error"].reason)
    assert ("mostly its spur at 50.2 Hz, which exchanges fold" in reason) is is_most
    assert ("the mask begins at 1 Hz" in reason) is not is_most
    assert any("`level` does not shift them" in note for note in found["receiver.oscillator"].notes)


def test_what_is_folded_on_the_mainlobe_is_no_echo() -> None:
    """50.5 Hz is 2 cycles of the aperture; its own 202 would pass. Its phases are small."""
    found = bb.check(bb.loads(spur(50.5, level=LEVEL - 20)))["receiver.oscillator.spur.0"]
    assert found.status == "not_evaluated"
    assert "2 cycles per aperture" in found.reason
    assert bb.check(bb.loads(spur(51.0)))["receiver.oscillator.spur.0"].status != "not_evaluated"


def test_the_note_says_where_it_is_folded_to() -> None:
    found = bb.check(bb.loads(spur(50.2)))["receiver.oscillator.spur.0"]
    assert any("folds it to 0.2 Hz, 0.8 cycles per aperture" in note for note in found.notes)


@pytest.mark.parametrize("frequency", [51.0, 54.0, 33.0, 9.0])
def test_by_islr_all_power_counts_that_is_left(frequency: float) -> None:
    """A tone of 51 Hz has twice its power every 100 ms: its own, and that at 1 Hz."""
    found = bb.check(bb.loads(spur(frequency, "islr: -10 dB")))["receiver.oscillator.spur.0"]
    *_, power = sampled(frequency)
    assert found.declared == pytest.approx(20 * math.log10(PHASE / 2 * math.sqrt(2 * power)), abs=0.02)


@pytest.mark.parametrize(("frequency", "interval"), [(51.0, 0.1), (3.1, 0.4), (2.0, 0.7)])
def test_echoes_lie_where_the_transform_has_them(frequency: float, interval: float) -> None:
    """Transform of the phase that is left, for several starts of the exchanges: its highest line."""
    found = Analysis(parse_mission(spur(frequency, interval=interval), "m.yaml")).tones
    t = (np.arange(40_000) + 0.5) / 40_000 * T - T / 2
    highest = 0.0
    for start in (np.arange(16) + 0.5) / 16 * interval:
        knots = np.arange(t[0] - interval + start, t[-1] + 2 * interval, interval)
        left = np.exp(2j * math.pi * frequency * t) - np.interp(t, knots, np.exp(2j * math.pi * frequency * knots))
        cells = np.abs(np.fft.fft(left, 8 * t.size))[: 8 * 2000] / t.size
        highest = max(highest, float(cells[4:].max()))
    echo = highest_echo(found)
    assert echo is not None
    # Echoes farther apart than 2.5 cells raise each other by less than 1.1 dB, which is left out.
    assert 0.88 < float(echo.phase) / (PHASE * highest) < 1.02


@pytest.mark.parametrize(
    ("key", "values"),
    [("synchronization.interval", ["90 ms", "99 ms", "0.1 s"]), ("collection.aperture_time", ["1 s", "4 s", "8 s"])],
)
@pytest.mark.parametrize("one", [spur(50.2), spur(50.2, "islr: -10 dB"), shaken(50.2, PHASE)])
def test_cases_together_are_what_each_is_alone(one: str, key: str, values: list[str]) -> None:
    mission = bb.loads(one)
    table = bb.sweep(mission, {key: values})
    for place, value in enumerate(values):
        alone = bb.check(mission.replace({key: value}))
        assert alone.status == table["status"][place]
        worst = alone[table["worst_row"][place]]
        use = math.nan if alone.status == "not_evaluated" else worst.utilization  # a case that is not judged has none
        assert table["utilization"][place] == pytest.approx(use, rel=1e-9, nan_ok=True)


WHATEVER_HOLDS_IT = ("pslr: -17 dB", "islr: -10 dB", "pslr: -17 dB, islr: -10 dB", "location_error: 1 m")


def placed(of_file: str) -> float:
    """Displacement, judged or not: of a free clock nobody says how it was set. [m]"""
    displacement = bb.check(bb.loads(of_file))["mission.location_error"].declared
    assert displacement is not None
    return displacement


@pytest.mark.parametrize("others", WHATEVER_HOLDS_IT)
def test_a_folded_tone_displaces_whatever_requirement_holds_it(others: str) -> None:
    """Without PSLR it was taken to displace at its own frequency: a thousandth of it."""
    needs = others if "location" in others else f"{others}, location_error: 1 m"
    free = spur(0.3, needs).replace("synchronization", "x").partition("x:")[0]  # what 50.3 Hz is folded to
    assert placed(spur(50.3, needs)) == pytest.approx(placed(free), rel=0.02)
    assert placed(free) > 0.01


@pytest.mark.parametrize("frequency", [50.2, 50.3])  # folded below one cycle, and above
def test_terms_of_the_clock_do_not_stand_for_a_tone(frequency: float) -> None:
    """A stated timing error, be it zero, hid what a spur displaces that is folded below one cycle."""
    of_file = spur(frequency, "pslr: -17 dB, location_error: 1 m")
    stated = of_file + "timing_error: {constant: 0 s, linear: 0}\n"
    assert placed(stated) == pytest.approx(placed(of_file), rel=1e-3)


@pytest.mark.parametrize(("over", "is_over"), [(1.01, True), (0.99, False)])
def test_its_phases_beside_the_mainlobe_are_judged(over: float, is_over: bool) -> None:
    """A spur that is folded to 1.6 cycles had a cubic phase of any size, and passed with a warning."""
    _, cubic, _ = sampled(50.4)
    level = LEVEL + 20 * math.log10(over * math.radians(10) / (cubic * PHASE))
    for needs in ("islr: -1 dB", "pslr: -1 dB"):
        row = bb.check(bb.loads(spur(50.4, needs, level=level)))["receiver.oscillator.spur.0"]
        assert str(row.reason).startswith("cubic phase ") is is_over
        near = "not_evaluated" if needs.startswith("pslr") else "warn"  # by its echo; by 99 % of the phase
        assert row.status == ("fail" if is_over else near)


def test_without_a_requirement_all_power_counts_as_by_islr() -> None:
    """Two echoes of a spur near half of the exchanges counted as the larger one."""
    one, other = (
        bb.check(bb.loads(spur(4.95, needs)))["receiver.oscillator.spur.0"].declared
        for needs in ("islr: -1 dB", "location_error: 1 m")
    )
    assert one == pytest.approx(other)


def test_an_echo_beside_the_mainlobe_says_where_exchanges_fold_it_to() -> None:
    """It named 1.2 cycles of a spur of 50.3 Hz, and not why."""
    quiet = spur(50.3, level=LEVEL - 20), spur(0.3, level=LEVEL - 20).partition("synchronization")[0]
    reason, free = (str(bb.check(bb.loads(text))["receiver.oscillator.spur.0"].reason) for text in quiet)
    assert reason.startswith("interpolation between exchanges folds it to 0.3 Hz; 1.2 cycles per aperture: below 3 ")
    assert free.startswith("1.2 cycles per aperture: below 3 ")


def test_the_use_of_a_spur_is_explained_last(tmp_path: Path, run: Callable) -> None:
    """Its percentage stood below what the spur displaces."""
    file = tmp_path / "m.yaml"
    file.write_text(spur(51.0, "pslr: -17 dB, location_error: 1 m"), encoding="utf-8")
    said = run("check", str(file), "--explain", "receiver.oscillator.spur.0").stdout
    assert "Orders of the tone at the aperture edge" in said.partition("Utilization, of amplitudes")[0]
