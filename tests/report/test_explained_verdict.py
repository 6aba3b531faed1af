"""`check --explain` of what a verdict adds: echoes, powers and cubic together, and what could not be judged.

Every number that a test uses stands in the text of the explanation.
"""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.report.explain.explanation import explain
from tests.budget.test_input_doubt import logged, noisy
from tests.conftest import TODAY, by_turns, mission_text, row
from tests.effects.test_random_errors import MISSION as SENSORS
from tests.effects.test_random_errors import OSCILLATORS
from tests.report.test_report_explanation import evaluated, repeat_by_hand, sums

QUIET = "      spurs: {2 Hz: -105 dBc, 2.2 Hz: -107 dBc, 130 Hz: -120 dBc}\n"
LOUD = QUIET.replace("-105", "-55")  # an echo above the response
TONES = {
    "sinusoidal": [{"amplitude": "20 um", "frequency": "15 Hz"}, {"amplitude": "15 um", "frequency": "15.1 Hz"}],
    "wideband": {"rms": "10 um"},
}
ISLR_CUBIC_POWER = 4 / 175


def sensors(requirements: str, spurs: str = QUIET, **rules: object) -> Mission:
    rest = ", ".join(f"{key}: {value}" for key, value in ({"model": "full", "combine": "rss"} | rules).items())
    text = f"{SENSORS.rstrip()}{OSCILLATORS}{spurs}requirements: {{{requirements}}}\nallocation: {{{rest}}}\n"
    return parse_mission(text, "m.yaml")


def vibrating(**requirements: str) -> Mission:
    changes = {f"requirements__{key}": value for key, value in requirements.items()}
    return parse_mission(
        mission_text(platforms__transmitter__motion_error={"vibration": TONES, "velocity": "1 mm/s"}, **changes)
    )


def explained(mission: Mission, row_id: str) -> str:
    return explain(mission, check_mission(mission, TODAY), row_id)


def values(text: str) -> dict[str, float]:
    return {symbol: value for symbol, _, value in sums(text)}


def listed(text: str, title: str, unit: str) -> dict[str, float]:
    """Names and numbers under a title."""
    joined = text.split(title)[1].splitlines()[1:]
    found = {}
    for line in itertools.takewhile(lambda one: one.startswith("  "), joined):
        if match := re.fullmatch(rf"    (\S+)  +(\S+) {re.escape(unit)}.*", line):
            found[match[1]] = float(match[2])
    return found


def bessel(order: int, phase: float) -> float:
    """By its integral, J_n(φ) = mean of cos(n·τ − φ·sin τ)."""
    turn = 2 * np.pi * np.arange(512) / 512
    return float(np.cos(order * turn - phase * np.sin(turn)).mean())


class TestHighestEcho:
    """Row `mission.pslr`."""

    @pytest.mark.parametrize("spurs", [QUIET, QUIET.replace("130 Hz", "9 Hz"), QUIET.replace("2.2", "2.05")])
    def test_every_number_repeats(self, spurs: str) -> None:
        mission = sensors("pslr: -30 dB, islr: -20 dB", spurs)
        text = explained(mission, "mission.pslr")
        tones = {
            name: (float(phase), float(cells))
            for name, phase, cells in re.findall(r"(?m)^    (\S+)  +(\S+) rad, (\S+) cells$", text)
        }
        assert len(tones) == 3
        (place,) = [float(x) for x in re.findall(r"at x = (\S+) cells", text)]
        title = " ".join(text.split("Highest echo")[1].split("φ =")[0].split())
        near = [tones[name] for name in tones if name in title]
        found = values(text)
        phase = sum(size * abs(np.sinc(place - cells)) for size, cells in near)
        assert found["φ"] == pytest.approx(phase, rel=1e-4)
        assert found["l"] == pytest.approx(bessel(1, phase) / bessel(0, phase), rel=1e-4)
        reached = row(check_mission(mission, TODAY), "mission.pslr")
        assert found["declared"] == pytest.approx(reached.declared, abs=1e-4)
        assert found["utilization"] == pytest.approx(10 ** ((found["declared"] + 30) / 20), rel=1e-4)

    def test_tones_near_each_other_add(self) -> None:
        text = explained(sensors("pslr: -30 dB", QUIET.replace("2.2", "2.05")), "mission.pslr")
        assert "each φ·|sinc(x − f·T)| in the worst phases" in " ".join(text.split())
        assert "spur.0, receiver.oscillator.spur.1" in " ".join(text.split())

    def test_beyond_2_rad_it_is_half_the_phase(self) -> None:
        mission = sensors("pslr: -30 dB", LOUD)
        found = values(explained(mission, "mission.pslr"))
        assert found["φ"] > 2
        assert found["l"] == pytest.approx(found["φ"] / 2, rel=1e-5)
        assert row(check_mission(mission, TODAY), "mission.pslr").declared == pytest.approx(
            found["declared"], abs=1e-4
        )

    def test_without_a_tone_it_says_so(self) -> None:
        text = explained(parse_mission(mission_text(requirements__pslr="-30 dB")), "mission.pslr")
        assert "No tone is declared" in text


REQUIRED = (
    "islr: -20 dB", "islr: -20 dB, pslr: -30 dB", "islr: -20 dB, cubic_phase_error: 45 deg", "pslr: -30 dB",
    "quadratic_phase_error: 90 deg", "islr: -20 dB, location_error: 3 m, declare: [oscillator, velocity]",
)  # fmt: skip
RULES = (("published", "sum", 3), ("full", "rss", 2), ("full", "each", 1), ("strictest", "rss", 3))


@pytest.mark.parametrize(("requirements", "rule"), by_turns(REQUIRED, RULES, REQUIRED[2], REQUIRED[-1]))
def test_sensors_and_tones_repeat_by_hand_whatever_is_required(requirements: str, rule: tuple[str, str, int]) -> None:
    model, combine, coverage_factor = rule
    repeat_by_hand(sensors(requirements, model=model, combine=combine, coverage_factor=coverage_factor))


@pytest.mark.parametrize("requirements", [{}, {"islr": "-20 dB"}, {"pslr": "-30 dB"}])
def test_vibrations_repeat_by_hand_whatever_is_required(requirements: dict[str, str]) -> None:
    repeat_by_hand(vibrating(**requirements))


class TestPowersTogether:
    """Rows `….islr`."""

    def test_tones_and_the_cubic_phase_add_to_the_noise(self) -> None:
        text = explained(sensors("islr: -20 dB", coverage_factor=3), "mission.islr")
        powers = listed(text, "Squares of the rms phases", "rad²")
        found = values(text)
        assert found["v"] == pytest.approx(sum(powers.values()), rel=1e-5)
        tones = {name: numbers for name, numbers, _ in sums(text) if "spur" in name}
        assert len(tones) == 3
        for name, numbers in tones.items():
            assert evaluated(numbers) == pytest.approx(powers[name], rel=1e-5)
        assert powers["mission.cubic_phase_error"] == pytest.approx(ISLR_CUBIC_POWER * found["φ_3"] ** 2, rel=1e-5)

    def test_the_cubic_phase_is_that_of_one_sigma(self) -> None:
        """Powers have no coverage factor."""
        one, three = (
            values(explained(sensors("islr: -20 dB", coverage_factor=factor), "mission.islr"))["φ_3"]
            for factor in (1, 3)
        )
        assert three == pytest.approx(one, rel=1e-5)

    def test_what_has_a_requirement_of_its_own_is_not_among_them(self) -> None:
        text = explained(sensors("islr: -20 dB, pslr: -30 dB, cubic_phase_error: 45 deg"), "mission.islr")
        assert "spur" not in text
        assert "cubic" not in text

    def test_a_sensor_is_held_to_the_power_of_its_cubic_phase(self) -> None:
        mission = sensors("islr: -20 dB", model="published", coverage_factor=2)
        found = values(explained(mission, "receiver.imu.gyro_bias"))
        per_unit = found["cubic"] / row(check_mission(mission, TODAY), "receiver.imu.gyro_bias").declared
        assert found["spread/unit"] == pytest.approx(math.sqrt(ISLR_CUBIC_POWER) * per_unit, rel=1e-4)
        assert found["allowable"] == pytest.approx(2 * 0.1 * math.sqrt(0.5) / found["spread/unit"], rel=1e-4)

    @pytest.mark.parametrize("axis", ["receiver.oscillator.spur.0", "transmitter.vibration.sinusoidal.0"])
    def test_a_tone_may_have_the_root_of_two_of_what_noise_may(self, axis: str) -> None:
        mission = sensors("islr: -20 dB") if "spur" in axis else vibrating(islr="-20 dB")
        text = explained(mission, axis)
        wavelength = mission.radar.wavelength
        limit = math.sqrt(2) * math.sqrt(math.log1p(0.01 * 0.902823) * 0.5)  # by the full model
        if "spur" in axis:
            assert values(text)["φ"] == pytest.approx(limit, rel=1e-4)
        else:
            found = values(text)
            assert found["full"] == pytest.approx(limit * wavelength / (2 * math.pi), rel=1e-4)
            assert found["published"] == pytest.approx(math.sqrt(2) * found["σ_published"], rel=1e-5)


class TestNotJudged:
    """Rows that no requirement judges, and those that cannot be judged."""

    @pytest.mark.parametrize(
        ("row_id", "title"),
        [
            ("receiver.oscillator", "Cubic phase: no requirement judges it, the root-sum-square"),
            ("receiver.random.GNSS", "Rms phase that spreads: no requirement judges it, the root-sum-square"),
        ],
    )
    def test_an_effect_that_no_requirement_takes_has_its_numbers(self, row_id: str, title: str) -> None:
        mission = sensors("quadratic_phase_error: 90 deg", coverage_factor=2)
        assert row(check_mission(mission, TODAY), row_id).status == "not_evaluated"
        text = explained(mission, row_id)
        parts = listed(text, title, "rad")
        last = text.split(title)[1]
        found = {symbol: (numbers, value) for symbol, numbers, value in reversed(sums(last))}
        assert found["total"][1] == pytest.approx(math.hypot(*parts.values()), rel=1e-5)
        assert found["negligible"][1] == 0.08  # the smaller one of 9 deg and 0.08 rad
        # All parts that are smaller are negligible together.
        assert found["least"][1] == pytest.approx(min(max(parts.values()) / 10, 0.08 / len(parts)), rel=1e-5)
        assert parts[row_id] >= found["least"][1]
        assert f"this row’s is {parts[row_id]:.6g} rad" in last

    def test_a_tone_that_no_requirement_takes(self) -> None:
        text = explained(sensors("quadratic_phase_error: 9 deg", LOUD), "receiver.oscillator.spur.0")
        assert "Peak phase of the tones: no requirement judges it" in text
        assert values(text)["negligible"] == pytest.approx(math.radians(0.9), rel=1e-5)

    def test_a_judged_row_has_no_such_steps(self) -> None:
        text = explained(sensors("islr: -20 dB, pslr: -30 dB"), "receiver.oscillator")
        assert "no requirement judges it" not in text
        assert "negligible" not in text

    def test_the_use_stands_under_its_sum(self) -> None:
        text = explained(sensors("quadratic_phase_error: 90 deg"), "receiver.oscillator")
        assert re.search(r"= 1/\S+ = \S+\n +(= \S+ %)\nCubic phase: no", text)

    def test_a_path_in_doubt_has_both_sizes(self, tmp_path: Path) -> None:
        mission = logged(tmp_path, noisy(30.0), position="5 cm")
        text = explained(mission, "receiver.position.x")
        assert "How far the receiver’s path may be off: residual of the smoothed log" in text
        ((_, numbers, stated),) = [one for one in sums(text) if one[0] == "stated"]
        assert numbers == "sqrt(0.05^2 + 0.05^2 + 0.05^2)"
        assert stated == pytest.approx(0.05 * math.sqrt(3), rel=1e-5)
        (doubt,) = [float(size) for size in re.findall(r"doubt = (\S+) m", text)]
        assert doubt == pytest.approx(mission.platforms.receiver.path.doubt_m, rel=1e-5)
        assert "Position errors" not in explained(mission, "receiver.velocity.x")

    def test_a_location_beside_free_oscillators_names_them_with_their_phases(self) -> None:
        text = explained(sensors("location_error: 3 m"), "mission.location_error")
        assert "free-running oscillators displace the image" in " ".join(text.split())
        ((qpe, _),) = re.findall(r"receiver\.oscillator: QPE (\S+) rad, cubic (\S+) rad", text)
        same = values(explained(sensors("location_error: 3 m"), "receiver.oscillator"))
        assert float(qpe) == pytest.approx(same["QPE_full"], rel=1e-5)


class TestDeclarations:
    """Row `mission.declare`, and rows of what it asks for."""

    def test_says_what_is_asked_for_and_missing(self) -> None:
        mission = parse_mission(mission_text(requirements__declare=["velocity", "transmitter.position"]), "m.yaml")
        text = explained(mission, "mission.declare")
        assert "requirements.declare: [velocity, transmitter.position]" in text
        missing = text.split("Not in the file")[1].split("NOT EVAL")[0].split()
        assert sorted(missing) == [
            "platforms.receiver.motion_error.velocity",
            "platforms.transmitter.motion_error.position",
            "platforms.transmitter.motion_error.velocity",
        ]
        assert "requirements.declare: [velocity, transmitter.position]" in explained(
            mission, "transmitter.velocity.x"
        )

    def test_says_that_nothing_is_missing(self) -> None:
        changes = {"platforms__transmitter__motion_error": {"velocity": 0}}
        mission = parse_mission(mission_text(requirements__declare=["transmitter.velocity"], **changes), "m.yaml")
        assert "all of it is declared" in explained(mission, "mission.declare")


class TestRequirements:
    """A requirement in place of a row."""

    @pytest.mark.parametrize(
        ("asked", "start"),
        [
            ("requirement.location_error", "pass requirement.location_error of base"),
            ("requirement.islr", "NOT EVAL requirement.islr of base"),
            ("mission.islr", "not decl mission.islr of base"),  # a row
        ],
    )
    def test_says_how_it_stands(self, run, asked: str, start: str) -> None:
        text = mission_text(
            requirements={"islr": "-20 dB", "location_error": "3 m"}, timing_error={"constant": "1 ns"}
        )
        result = run("check", "-", "--explain", asked, input=text)
        assert result.exit_code == 0
        assert result.stdout.startswith(f"{start}\n")

    def test_lists_the_rows_that_judge_it(self, run) -> None:
        text = mission_text(requirements__location_error="3 m", timing_error__constant="1 ns")
        shown = run("check", "-", "--explain", "requirement.location_error", input=text).stdout
        assert "requirements.location_error: 3 m" in shown
        assert re.search(r"mission\.location_error +pass, [\d.]+ %", shown)
        default = run("check", "-", "--explain", "requirement.quadratic_phase_error", input=text).stdout
        assert "The file does not state it: the default" in default

    def test_one_without_a_row_of_its_own_is_found_by_its_name_in_waivers(self, run) -> None:
        """`mission.quadratic_phase_error` has no row where each error stands alone."""
        result = run("check", "-", "--explain", "mission.quadratic_phase_error", input=mission_text())
        assert result.exit_code == 0
        assert "requirement.quadratic_phase_error of base" in result.stdout

    @pytest.mark.parametrize(
        ("asked", "hint"),
        [("requirement.pslr", "no row or requirement has this id"), ("requirement.quadratic_phase_eror", "Did you")],
    )
    def test_one_that_the_mission_does_not_have_is_2(self, run, asked: str, hint: str) -> None:
        result = run("check", "-", "--explain", asked, input=mission_text())
        assert result.exit_code == 2
        assert hint in result.stderr


class TestAcceleratedTone:
    """The tone of an oscillator that vibrates, of which a direct path leaves 2·sin(πfΔt)."""

    def test_with_a_direct_path_no_pulses_are_spoken_of(self) -> None:
        mission = parse_mission("""
schema_version: 1
name: heard
radar: {center_frequency: 10 GHz, bandwidth: 150 MHz}
collection: {aperture_time: 2 s}
platforms:
  transmitter:
    position: [30 km, 4 km, 9 km]
    velocity: [0 m/s, 180 m/s, 0 m/s]
    oscillator: {frequency: 10 MHz, power_law: {h0: 1e-30}}
  receiver:
    position: [820 m, 1419 m, 1147 m]
    velocity: [-33.8 m/s, 9 m/s, 0 m/s]
    motion_error: {vibration: {sinusoidal: [{frequency: 20 Hz, amplitude: 0.1 g}]}}
    oscillator: {frequency: 10 MHz, power_law: {h0: 1e-30}, acceleration_sensitivity: 1e-9 /g}
synchronization: {method: direct_path, error: 1 deg}
requirements: {quadratic_phase_error: 45 deg, pslr: -20 dB}
""")
        text = explained(mission, "receiver.oscillator.acceleration.0")
        assert "pulses" not in text
        path = sum(math.dist(one, (0, 0, 0)) for one in ((30e3, 4e3, 9e3), (820, 1419, 1147)))
        delay = (path - math.dist((30e3, 4e3, 9e3), (820, 1419, 1147))) / 299792458
        # 1e-9 per g, 0.1 g and 20 Hz at 10 GHz: 0.05 rad of a free oscillator.
        assert values(text)["φ"] == pytest.approx(0.05 * 2 * math.sin(math.pi * 20 * delay), rel=1e-4)
