"""Sensors and clocks in the budget: allowables on both sides of each limit, sums, shares, powers, waivers."""

import json
import math
from typing import Any

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission, check_missions
from bisar_budget.constants import MAINLOBE_ENERGY
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.effects.spectra import PowerLawPiece, synchronized_parts
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import with_number
from bisar_budget.report.explain.explanation import explain
from bisar_budget.report.words.sentences import row_size
from bisar_budget.units import format_quantity
from tests.conftest import TODAY
from tests.responses import energy_within, shown_db

WAVELENGTH = 299_792_458.0 / 10e9
K = 2 * math.pi / WAVELENGTH
T = 4.0
G = 9.80665
E = MAINLOBE_ENERGY["uniform"]

# Receiver above the y axis at 30 degrees, 30 km away: the line of sight is (0, cos 30°, sin 30°).
SIGHT = np.array([0, math.cos(math.radians(30)), math.sin(math.radians(30))])
FROM_CENTRE = 30e3 * SIGHT + np.array([0, 0, 6371e3])
# Specific force of level flight, and what a tilt turns of it into the line of sight. [m/s²]
FORCE = 3.986004418e14 * FROM_CENTRE / np.linalg.norm(FROM_CENTRE) ** 3
TURNED = float(np.linalg.norm(np.cross(SIGHT, FORCE)))
MISSION: dict[str, Any] = {
    "schema_version": 1,
    "name": "Sensors",
    "radar": {"center_frequency": "10 GHz", "bandwidth": "150 MHz"},
    "collection": {"aperture_time": f"{T} s"},
    "platforms": {
        "transmitter": {"position": ["300 km", 0, "500 km"], "velocity": [0, "1 km/s", 0]},
        "receiver": {
            "slant_range": "30 km",
            "azimuth": "90 deg",
            "elevation": "30 deg",
            "speed": "60 m/s",
            "motion_azimuth": "180 deg",
            "motion_error": {},
        },
    },
    "requirements": {"cubic_phase_error": "22.5 deg", "islr": "-20 dB"},
    "allocation": {"model": "published", "combine": "each"},
}
IMU = {
    "accelerometer_bias": "50 ug",
    "attitude": "0.003 deg",
    "gyro_bias": "0.5 deg/h",
    "velocity_random_walk": "0.06 m/s/sqrt(h)",
    "angle_random_walk": "0.01 deg/sqrt(h)",
}
MASK = {"frequency": "10 MHz", "phase_noise": {"1 Hz": "-105 dBc/Hz", "10 Hz": "-135 dBc/Hz", "1 kHz": "-155 dBc/Hz"}}


def merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in changes.items():
        out[key] = (
            merged(out.get(key, {}), value) if isinstance(value, dict) and isinstance(out.get(key), dict) else value
        )
    return out


def check(**changes: Any) -> MissionFindings:
    return check_mission(parse_mission(json.dumps(merged(MISSION, changes))), TODAY)


def with_error(error: dict[str, Any], **changes: Any) -> MissionFindings:
    return check(**merged({"platforms": {"receiver": {"motion_error": error}}}, changes))


def row(found: MissionFindings, row_id: str) -> Row:
    return next(one for one in found.rows if one.id == row_id)


def test_allowables_are_those_of_the_formulas() -> None:
    """By hand: share π/8, cubic 22.5 deg, half the power of -20 dB; along the line of sight 1, |u × f| of a tilt."""
    found = with_error({"imu": IMU})
    assert pytest.approx(G * math.cos(math.radians(30)), rel=6e-3) == TURNED
    scaled = float(np.linalg.norm(SIGHT * FORCE))
    half, cubic = math.pi / 8, math.radians(22.5)
    rms = math.sqrt(0.01 / 2)
    expected = {
        "accelerometer_bias": (half / (K * T**2 / 8), "quadratic_phase_error"),
        "accelerometer_scale_factor": (half / (K * scaled * T**2 / 8), "quadratic_phase_error"),
        "attitude": (half / (K * TURNED * T**2 / 8), "quadratic_phase_error"),
        "gyro_bias": (cubic / (K * TURNED * T**3 / 48), "cubic_phase_error"),
        "velocity_random_walk": (half / (K * math.sqrt(5 / 224) * T**1.5), "quadratic_phase_error"),
        "angle_random_walk": (half / (K * TURNED * math.sqrt(355 / 473088) * T**2.5), "quadratic_phase_error"),
    }
    for kind, (allowable, binding) in expected.items():
        one = row(found, f"receiver.imu.{kind}")
        assert one.allowable == pytest.approx(allowable, rel=1e-12), kind
        assert one.binding_requirement == binding, kind
    walk = row(found, "receiver.imu.velocity_random_walk")
    assert walk.islr_db == pytest.approx(shown_db((1e-3 * K * T**1.5) ** 2 / 6930), abs=1e-5)
    assert rms / (K * T**1.5 / math.sqrt(6930)) > walk.allowable


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize(("kind", "unit"), [
    ("accelerometer_bias", "m/s^2"), ("accelerometer_scale_factor", ""), ("attitude", "rad"), ("gyro_bias", "rad/s"),
    ("velocity_random_walk", "m/s/sqrt(s)"), ("angle_random_walk", "rad/sqrt(s)"),
])  # fmt: skip
def test_both_sides_of_a_limit(kind: str, unit: str, model: str) -> None:
    allowable = row(with_error({"imu": IMU}, allocation={"model": model}), f"receiver.imu.{kind}").allowable
    for factor, status in ((1 - 1e-6, "warn"), (1 + 1e-6, "fail")):
        found = with_error({"imu": {kind: f"{allowable * factor!r} {unit}"}}, allocation={"model": model})
        assert row(found, f"receiver.imu.{kind}").status == status


def test_a_scale_factor_is_said_in_the_unit_of_the_file_else_in_ppm() -> None:
    found = with_error({"imu": {"accelerometer_scale_factor": "0.03 %"}})
    one = row(found, "receiver.imu.accelerometer_scale_factor")
    assert (one.unit, one.declared) == ("1", pytest.approx(3e-4))
    assert format_quantity(one.declared, one.unit) == "300 ppm"
    assert row_size(one.declared, one, found) == "0.03 %"
    text = explain(found.analysed().mission, found, one.id)
    assert "= 1*|0.0003| = 0.0003\n" in text
    assert " rad per unit\n" in explain(*_by_the_full_model(found.analysed().mission), one.id)


def _by_the_full_model(mission: Mission) -> tuple[Mission, MissionFindings]:
    full = mission._replace(allocation=mission.allocation._replace(model="full"))
    return full, check_mission(full, TODAY)


def test_a_figure_that_nobody_states_still_has_its_allowable() -> None:
    one = row(with_error({"imu": {"gyro_bias": "1 deg/h"}}), "receiver.imu.attitude")
    assert (one.status, one.declared) == ("not_declared", None)
    assert one.allowable is not None


def test_three_values_follow_the_axes_of_the_frame() -> None:
    """A bias along the line of sight counts, one across it does not; a tilt about the line of sight leaks across."""

    def qpe(kind: str, values: list[str]) -> float | None:
        found = with_error({"frame": "look", "imu": {kind: values}})
        return row(found, f"receiver.imu.{kind}").qpe_published_rad

    bias = 50e-6 * G * K * T**2 / 8
    assert qpe("accelerometer_bias", ["50 ug", "0 ug", "0 ug"]) == pytest.approx(bias)
    assert qpe("accelerometer_bias", ["0 ug", "50 ug", "50 ug"]) == pytest.approx(0, abs=1e-9 * bias)
    assert qpe("accelerometer_bias", ["30 ug", "0 ug", "50 ug"]) == pytest.approx(0.6 * bias)
    leak = math.radians(0.01) * TURNED * K * T**2 / 8
    assert qpe("attitude", ["0 deg", "0.01 deg", "0 deg"]) == pytest.approx(leak)  # about the level cross axis
    assert qpe("attitude", ["0.01 deg", "0 deg", "0 deg"]) == pytest.approx(0, abs=1e-9 * leak)
    assert qpe("attitude", ["0 deg", "0 deg", "0.01 deg"]) == pytest.approx(0, abs=1e-9 * leak)


def test_the_coverage_factor_multiplies_phases_and_not_powers() -> None:
    one = {"imu": IMU, "random": [{"name": "GNSS", "sigma": "0.2 mm", "correlation_time": "1 s"}]}
    platforms = {"receiver": {"motion_error": one, "oscillator": MASK}}
    once, thrice = (check(platforms=platforms, allocation={"coverage_factor": k}) for k in (1, 3))
    for row_id in ("receiver.imu.velocity_random_walk", "receiver.random.GNSS", "receiver.oscillator"):
        a, b = row(once, row_id), row(thrice, row_id)
        assert b.qpe_published_rad == pytest.approx(3 * a.qpe_published_rad)
        assert b.cubic_rad == pytest.approx(3 * a.cubic_rad)
        assert b.islr_db == pytest.approx(a.islr_db, abs=1e-9)
    assert row(thrice, "mission.islr").declared == pytest.approx(row(once, "mission.islr").declared, abs=1e-9)


def test_an_oscillator_may_rise_by_so_many_decibels() -> None:
    """Raised by its allowable, within six digits, it stands at the limit."""
    found = check(platforms={"receiver": {"oscillator": MASK}})
    one = row(found, "receiver.oscillator")
    assert (one.unit, one.declared) == ("dB", 0.0)
    assert one.utilization == pytest.approx(10 ** (-one.allowable / 20))
    for step, status in ((-0.01, "warn"), (0.01, "fail")):
        levels = {
            f: f"{float(level.split()[0]) + one.allowable + step!r} dBc/Hz"
            for f, level in MASK["phase_noise"].items()
        }
        raised = check(platforms={"receiver": {"oscillator": {**MASK, "phase_noise": levels}}})
        assert row(raised, "receiver.oscillator").status == status


def test_a_power_law_and_its_mask_are_the_same() -> None:
    """h₋₁ of 1e-24: S_φ = f₀²·h₋₁/f³, and L(f) at 10 MHz is half of f_osc²·h₋₁/f³."""
    law = {"power_law": {"h-1": 1e-24}}
    level = 10 * math.log10(1e14 * 1e-24 / 2)
    mask = {"frequency": "10 MHz", "phase_noise": {"1 Hz": f"{level!r} dBc/Hz", "1 kHz": f"{level - 90!r} dBc/Hz"}}
    adev = {"allan_deviation": {f"{tau} s": math.sqrt(2 * math.log(2) * 1e-24) for tau in (1, 10, 100)}}
    expected = math.sqrt(1e20 * 1e-24 * 25 * math.pi**2 / 32 * T**2)
    for form in (law, mask, adev):
        one = row(check(platforms={"receiver": {"oscillator": form}}), "receiver.oscillator")
        assert one.qpe_published_rad == pytest.approx(expected, rel=1e-4)


class TestBandwidth:
    """A mask counts to its last point, or to a `bandwidth` below it, which the row says."""

    LEVELS = {"10 Hz": "-110 dBc/Hz", "100 Hz": "-140 dBc/Hz", "1 MHz": "-150 dBc/Hz"}

    def row_of(self, levels: dict[str, str] = LEVELS, **beside: str) -> Row:
        oscillator = {"frequency": "10 MHz", "phase_noise": levels, **beside}
        return row(check(platforms={"receiver": {"oscillator": oscillator}}), "receiver.oscillator")

    def power(self, low: float, high: float) -> float:
        """Mean square of the phase between two frequencies at 10 GHz, by trapezoids over logarithms. [rad²]"""
        f = np.geomspace(low, high, 20001)
        level = np.interp(np.log(f), np.log([10, 100, 1e6]), [-110, -140, -150])
        return float(np.trapezoid(2 * 1e6 * 10 ** (level / 10), f))

    @pytest.mark.parametrize(("bandwidth", "high"), [(None, 1e6), ("1 MHz", 1e6), ("2 GHz", 1e6), ("5 kHz", 5e3)])
    def test_what_spreads(self, bandwidth: str | None, high: float) -> None:
        one = self.row_of(**({} if bandwidth is None else {"bandwidth": bandwidth}))
        # Of slow noise the aperture's own frequencies are counted apart.
        slow = self.row_of({"10 Hz": "-110 dBc/Hz", "100 Hz": "-140 dBc/Hz"})
        variance, of_slow = (math.log1p(10 ** (each.islr_db / 10) * E) for each in (one, slow))
        assert variance - of_slow == pytest.approx(self.power(100, high), rel=2e-3)

    @pytest.mark.parametrize(("bandwidth", "is_cut"), [("999.9 kHz", True), ("1 MHz", False), ("1.1 MHz", False)])
    def test_both_sides_of_the_last_point(self, bandwidth: str, is_cut: bool) -> None:
        notes = [note for note in self.row_of(bandwidth=bandwidth).notes if note.code == "mask-is-cut"]
        assert len(notes) == is_cut

    def test_the_note_has_both_frequencies_and_what_is_cut_off(self) -> None:
        (note,) = (note for note in self.row_of(bandwidth="1 kHz").notes if note.code == "mask-is-cut")
        rms = math.sqrt(self.power(1e3, 1e6))
        assert (
            note
            == f"phase noise counts up to `bandwidth`, 1 kHz; the mask extends to 1 MHz, with {rms:.3g} rad rms above"
        )

    def test_a_band_that_ends_below_the_mask_has_what_continues_it(self) -> None:
        one = self.row_of(bandwidth="5 Hz")
        assert one.qpe_published_rad == pytest.approx(self.row_of(bandwidth="6 Hz").qpe_published_rad, rel=1e-3)

    def test_other_forms_count_to_1_khz(self) -> None:
        law = {"h0": 1e-20, "h2": 1e-26}
        rows = [
            row(check(platforms={"receiver": {"oscillator": {"power_law": law, **beside}}}), "receiver.oscillator")
            for beside in ({}, {"bandwidth": "1 kHz"}, {"bandwidth": "2 kHz"})
        ]
        levels = [one.islr_db for one in rows]
        assert levels[0] == levels[1] < levels[2]

    def test_a_sweep_of_what_no_file_states(self) -> None:
        changes = {"platforms": {"receiver": {"oscillator": {"frequency": "10 MHz", "phase_noise": self.LEVELS}}}}
        mission = parse_mission(json.dumps(merged(MISSION, changes)))
        key, bands = "platforms.receiver.oscillator.bandwidth", [2e3, 5e4]
        both = check_missions([with_number(mission, key, band) for band in bands], TODAY)
        alone = [row(found, "receiver.oscillator").islr_db for _, found in sorted(both, key=lambda one: one[0])]
        assert alone == pytest.approx([self.row_of(bandwidth=f"{band} Hz").islr_db for band in bands])


def test_a_fit_that_is_no_fit_is_not_judged() -> None:
    points = {"1 s": 1e-12, "2 s": 6e-12, "4 s": 1e-12, "8 s": 6e-12}
    found = check(platforms={"receiver": {"oscillator": {"allan_deviation": points}}})
    oscillator = row(found, "receiver.oscillator")
    assert oscillator.status == found.status == "not_evaluated"
    assert "no power law fits the Allan deviation" in str(oscillator.reason)
    good = check(platforms={"receiver": {"oscillator": {"allan_deviation": {"1 s": 1e-12, "100 s": 1e-11}}}})
    assert not any("fit" in warning.message for warning in good.warnings)


def test_what_is_extrapolated_is_said_once() -> None:
    """Below the first point of a mask, where that is within the aperture's own frequencies, and beyond the last τ."""
    found = check(platforms={"receiver": {"oscillator": MASK}})
    assert [n for n in row(found, "receiver.oscillator").notes if "mask begins" in n] == [
        "the mask begins at 1 Hz; below, it continues as f^(\u22123)"
    ]
    early = {**MASK, "phase_noise": {"0.01 Hz": "-45 dBc/Hz", **MASK["phase_noise"]}}
    assert not row(check(platforms={"receiver": {"oscillator": early}}), "receiver.oscillator").notes
    short = check(platforms={"receiver": {"oscillator": {"allan_deviation": {"0.1 s": 1e-11, "1 s": 1e-11}}}})
    assert any("ends at 1 s" in note for note in row(short, "receiver.oscillator").notes)


class TestSums:
    ERRORS = {
        "imu": IMU,
        "velocity": "1 mm/s",
        "random": [{"name": "GNSS", "sigma": "0.1 mm", "correlation_time": "2 s"}],
    }

    @pytest.mark.parametrize("rule", ["sum", "rss"])
    def test_phases_enter_the_aggregates(self, rule: str) -> None:
        found = with_error(self.ERRORS, allocation={"combine": rule, "model": "full"}, autofocus={"n_pull": 1})
        rows = [one for one in found.rows if one.owner == "receiver" and one.metric != "islr"
                and one.is_independent and one.declared and one.subject.kind != QUADRATIC]  # fmt: skip
        phases = [one.equal_loss_qpe_rad for one in rows]
        assert len(phases) == 9
        total = math.fsum(phases) if rule == "sum" else math.hypot(*phases)
        assert row(found, "receiver.quadratic_phase_error").declared == pytest.approx(total)
        quadratic = math.fsum(abs(one.qpe_full_rad) for one in rows)  # what autofocus corrects
        assert row(found, "mission.autofocus_pull_in").declared == pytest.approx(quadratic)
        cubics = [one.cubic_rad for one in found.rows if one.cubic_rad and one.subject.kind != "cubic_phase_error"]
        combined = math.fsum(cubics) if rule == "sum" else math.hypot(*cubics)
        assert row(found, "mission.cubic_phase_error").declared == pytest.approx(combined)
        assert row(found, "receiver.imu.attitude").status == "info"

    def test_each_warns_of_what_all_together_exceed(self) -> None:
        """Six of some 0.35 rad are held to π/8 each, and all together to π/4."""
        size = 0.35 / (K * T**2 / 8)
        imu = {"accelerometer_bias": f"{size!r} m/s^2", "attitude": f"{size / G / math.cos(math.radians(30))!r} rad"}
        noise = [{"name": str(n), "sigma": "1.8 mm", "correlation_time": "2 s"} for n in range(4)]
        found = with_error(
            {"imu": imu, "random": noise}, requirements={"islr": "-1 dB", "cubic_phase_error": "90 deg"}
        )
        alone = [
            one.qpe_published_rad for one in found.rows if one.subject.kind in ("imu", "random") and one.declared
        ]
        assert len(alone) == 6
        assert max(alone) < math.pi / 8
        assert math.hypot(*alone) > math.pi / 4
        assert row(found, "mission.quadratic_phase_error").status == "warn"

    def test_the_balanced_split_weighs_them(self) -> None:
        found = check(
            platforms={"receiver": {"motion_error": {"imu": IMU}}, "transmitter": {"oscillator": MASK}},
            allocation={"split": "balanced", "combine": "rss"},
        )
        receiver = math.hypot(*(one.qpe_published_rad or 0.0 for one in found.rows if one.subject.kind == "imu"))
        transmitter = row(found, "transmitter.oscillator").qpe_published_rad
        share = transmitter / (transmitter + receiver)
        assert found.allocation.qpe.transmitter == pytest.approx(max(0.05, share), rel=1e-9)

    def test_strictest_takes_the_stricter_model(self) -> None:
        """A platform that turns its line of sight: the full model counts it."""
        near = {"slant_range": "1 km", "speed": "90 m/s", "motion_error": {"imu": IMU}}
        found = {model: check(platforms={"receiver": near}, allocation={"model": model})
                 for model in ("published", "full", "strictest")}  # fmt: skip
        for kind in IMU:
            by = {model: row(one, f"receiver.imu.{kind}") for model, one in found.items()}
            assert by["strictest"].utilization == max(by["published"].utilization, by["full"].utilization)
            assert by["published"].utilization != by["full"].utilization

    def test_autofocus_raises_limits_of_the_quadratic_phase_alone(self) -> None:
        plain, focused = (with_error({"imu": IMU}, autofocus={"n_pull": n}) for n in (0.25, 2))
        for kind, grows in (("accelerometer_bias", 8), ("gyro_bias", 1)):
            a, b = (row(one, f"receiver.imu.{kind}").allowable for one in (plain, focused))
            assert b / a == pytest.approx(grows)

    def test_a_bias_beside_an_acceleration_warns_that_they_add(self) -> None:
        found = with_error({"imu": {"accelerometer_bias": "50 ug"}, "acceleration": "0.1 mm/s^2"})
        assert [w.message for w in found.warnings if "they add" in w.message] == [
            "platforms.receiver.motion_error: acceleration and the accelerometer bias are both stated; they add"
        ]


class TestPowers:
    NOISE = {"vibration": {"wideband": {"rms": "100 um"}}, "imu": {"velocity_random_walk": "0.5 m/s/sqrt(h)"}}

    def test_powers_add_up_against_each_share(self) -> None:
        """Wideband vibration, a random walk and phase noise: variances add, (exp(σ²) - 1)/0.903 is the ISLR.

        The walk spreads 1e-5 more than along the line of sight of mid-aperture: it turns.
        """
        found = check(
            platforms={
                "receiver": {"motion_error": self.NOISE, "oscillator": MASK},
                "transmitter": {"oscillator": MASK},
            },
            allocation={"model": "full"},
        )
        walk = (0.5 / 60 * K * T**1.5) ** 2 / 6930
        vibration = (K * 100e-6) ** 2
        energy = energy_within("uniform")
        clock = math.log1p(energy * 10 ** (row(found, "receiver.oscillator").islr_db / 10))
        whole = math.log1p(energy * 0.01)
        for owner, variance in (
            ("transmitter", clock),
            ("receiver", walk + vibration + clock),
            ("mission", walk + vibration + 2 * clock),
        ):
            one = row(found, f"{owner}.islr")
            assert one.declared == one.islr_db == pytest.approx(shown_db(variance), abs=1e-4)
            share = 1.0 if owner == "mission" else 0.5
            assert one.allowable == pytest.approx(shown_db(whole * share), abs=1e-5)
            assert one.utilization == pytest.approx(math.sqrt(variance / (whole * share)), rel=1e-5)
        assert one.allowable == pytest.approx(-20, abs=1e-12)

    @pytest.mark.parametrize(("factor", "status"), [(0.999, "warn"), (1.001, "fail")])
    def test_by_the_published_rule_levels_are_variances_and_the_image_shows_more(self, factor, status) -> None:
        """σ² ≤ ISLR: -20 dB of σ² is allowed, of which an image shows -19.53; the full model's limit warns."""
        sigma = factor * math.sqrt(0.01 / 2)
        walk = {"imu": {"velocity_random_walk": f"{sigma * math.sqrt(6930) / (K * T**1.5)!r} m/s/sqrt(s)"}}
        qpe = {"quadratic_phase_error": "360 deg"}
        found = with_error(walk, allocation={"model": "published"}, requirements=qpe)
        one, whole = row(found, "receiver.islr"), row(found, "mission.islr")
        assert (one.status, one.model) == (status, "published")
        assert one.declared == pytest.approx(10 * math.log10(sigma**2), abs=1e-9)
        assert one.allowable == one.allowable_published == pytest.approx(10 * math.log10(0.01 / 2), abs=1e-9)
        assert one.allowable_full == pytest.approx(10 * math.log10(math.log1p(0.01 * energy_within("uniform")) / 2))
        assert one.islr_db == pytest.approx(shown_db(sigma**2), abs=1e-5)
        assert whole.allowable == pytest.approx(-20, abs=1e-12)
        if status == "warn":
            assert "fails by the full model: -23.5 dB allowed" in one.reason
        taylor = with_error(
            walk, allocation={"model": "published"}, requirements=qpe, simulation={"window": "taylor"}
        )
        window = row(taylor, "receiver.islr")
        assert window.islr_db == pytest.approx(shown_db(sigma**2, "taylor"), abs=1e-5)
        assert (window.declared, window.allowable) == (one.declared, one.allowable)

    def test_vibration_alone_is_summed_for_the_mission_only(self) -> None:
        found = with_error({"vibration": {"wideband": {"rms": "100 um"}}})
        assert [one.id for one in found.rows if one.subject.kind == "islr"] == ["mission.islr"]

    def test_without_a_requirement_there_is_no_sum(self) -> None:
        mission = {key: value for key, value in MISSION.items() if key != "requirements"}
        mission = merged(mission, {"platforms": {"receiver": {"motion_error": self.NOISE}}})
        found = check_mission(parse_mission(json.dumps(mission)), TODAY)
        assert not [one.id for one in found.rows if one.subject.kind == "islr"]
        assert row(found, "receiver.imu.velocity_random_walk").islr_db is not None

    def test_a_limit_of_powers_on_both_sides(self) -> None:
        """The turning line of sight adds 1e-5 to the closed form of mid-aperture."""
        limit = math.sqrt(math.log1p(0.01 * energy_within("uniform")) / 2) * math.sqrt(6930) / (K * T**1.5)
        for factor, status in ((1 - 3e-5, "warn"), (1 + 1e-6, "fail")):
            walk = {"imu": {"velocity_random_walk": f"{limit * factor!r} m/s/sqrt(s)"}}
            found = with_error(walk, allocation={"model": "full"}, requirements={"quadratic_phase_error": "360 deg"})
            assert row(found, "receiver.islr").status == status


class TestSynchronisation:
    def test_each_exchange_counts_against_the_clock(self) -> None:
        """σ·√(11.25·T_s/T) of a fast link; ⅔σ² in all, of which four orders take σ²·T_s/T each."""
        platforms = {"receiver": {"oscillator": MASK}, "transmitter": {"oscillator": MASK}}
        free = check(platforms=platforms)
        synced = check(platforms=platforms, synchronization={"interval": "20 ms", "error": "1 deg"})
        link = row(synced, "timing.synchronization")
        assert link.owner == "clock"
        assert link.qpe_published_rad == pytest.approx(math.radians(1) * math.sqrt(11.25 * 0.02 / T), rel=0.01)
        assert link.islr_db == pytest.approx(shown_db(math.radians(1) ** 2 * (2 / 3 - 4 * 0.02 / T)), abs=0.01)
        for name in ("transmitter", "receiver"):
            before, after = (row(one, f"{name}.oscillator").qpe_published_rad for one in (free, synced))
            assert after < before / 100

    def test_an_interval_beyond_the_aperture_warns(self) -> None:
        for interval, warns in (("4.1 s", True), ("3.9 s", False)):
            found = check(
                platforms={"receiver": {"oscillator": MASK}}, synchronization={"interval": interval, "error": "1 deg"}
            )
            assert any("less than once in an aperture" in one.message for one in found.warnings) is warns

    def test_a_failure_that_rests_on_what_is_extrapolated_says_so(self) -> None:
        loud = {"frequency": "10 MHz", "phase_noise": {"1 Hz": "-75 dBc/Hz", "10 Hz": "-105 dBc/Hz"}}
        for combine, row_id in (("each", "receiver.oscillator"), ("rss", "receiver.quadratic_phase_error")):
            found = check(platforms={"receiver": {"oscillator": loud}}, allocation={"combine": combine})
            one = row(found, row_id)
            assert one.status == "fail"
            assert "the mask begins at 1 Hz; below, it continues as f^(\u22123)" in (one.reason or "")

    def test_waivers_and_requirement_ids_reach_the_rows(self) -> None:
        found = with_error(
            {"imu": {"attitude": "1 deg"}},
            requirement_ids={"receiver.imu.attitude": "SYS-1"},
            waivers=[{"id": "receiver.imu.*", "until": "2027-01-01", "reason": "a better one is ordered"}],
        )
        one = row(found, "receiver.imu.attitude")
        assert (one.status, one.requirement_id) == ("waived", "SYS-1")


class TestTones:
    """-30 dB, shared equally: by the paper's rule a phase of √(10⁻³/2), whose echoes have half of its amplitude."""

    LIMIT = 20 * math.log10(math.sqrt(1e-3 / 2) / 2)

    def tone(self, level: float, frequency: str = "50 Hz", **changes: Any) -> Row:
        oscillator = {**MASK, "spurs": {frequency: f"{level - 60!r} dBc"}}  # 10 MHz to 10 GHz: 60 dB
        found = check(platforms={"receiver": {"oscillator": oscillator}}, requirements={"pslr": "-30 dB"}, **changes)
        return row(found, "receiver.oscillator.spur.0")

    def test_both_sides_of_the_limit(self) -> None:
        below, above = self.tone(self.LIMIT - 0.001), self.tone(self.LIMIT + 0.001)
        assert (below.status, above.status) == ("warn", "fail")
        assert below.allowable == pytest.approx(self.LIMIT)
        assert below.declared == pytest.approx(self.LIMIT - 0.001)
        assert above.utilization == pytest.approx(10 ** (0.001 / 20))

    def test_below_three_cycles_its_echoes_lie_on_the_mainlobe(self) -> None:
        assert self.tone(-80, "0.7 Hz").status == "not_evaluated"
        assert self.tone(-80, "0.8 Hz").status == "pass"

    def test_a_direct_path_leaves_what_it_changes_by_until_the_echo_comes(self) -> None:
        """50 Hz, and an echo that comes some microseconds later: 2 sin(πfΔt) of the tone."""
        heard = self.tone(-80, synchronization={"method": "direct_path", "error": 0})
        delay = parse_mission(json.dumps(MISSION)).geometry.echo_delay
        level = self.tone(-80).declared + 20 * math.log10(2 * math.sin(math.pi * 50 * delay))
        assert heard.declared == pytest.approx(level, abs=1e-6)

    @pytest.mark.parametrize(("level", "status"), [("-90 dBc", "info"), ("-80 dBc", "not_evaluated")])
    def test_without_a_requirement_it_is_not_judged(self, level: str, status: str) -> None:
        """At 10 GHz a spur of 10 MHz is 60 dB higher: 0.063 and 0.2 rad."""
        oscillator = {**MASK, "spurs": {"50 Hz": level}}
        mission = {key: value for key, value in MISSION.items() if key != "requirements"}
        mission = merged(mission, {"platforms": {"receiver": {"oscillator": oscillator}}})
        found = check_mission(parse_mission(json.dumps(mission)), TODAY)
        assert row(found, "receiver.oscillator.spur.0").status == status

    def test_exchanged_pulses_take_a_slow_tone_away_and_leave_a_fast_one(self) -> None:
        """1 − sinc² of a slow one, (πfT_s)²/3; of one that is folded on itself, all of it."""
        pulses = {"interval": "10 ms", "error": 0}
        assert self.tone(-80, "2 Hz", synchronization=pulses).declared == pytest.approx(
            -80 + 20 * math.log10((math.pi * 0.02) ** 2 / 3), abs=0.01
        )
        assert self.tone(-80, "100 Hz", synchronization=pulses).declared == pytest.approx(-80)


class TestWhatAReviewFound:
    def test_a_part_without_a_frequency_takes_no_mask_and_no_tones(self) -> None:
        """Noise at 10 MHz was taken for noise at 10 GHz, 60 dB too little."""
        for own in ({"spurs": {"50 Hz": "-90 dBc"}}, {"phase_noise": {"1 Hz": "-95 dBc/Hz", "10 Hz": "-125 dBc/Hz"}}):
            with pytest.raises(MissionError) as caught:
                check(platforms={"receiver": {"oscillator": {"sensor": "grail-uso", **own}}})
            assert "states no frequency" in str(caught.value.faults[0])
            check(platforms={"receiver": {"oscillator": {"sensor": "grail-uso", "frequency": "10 MHz", **own}}})

    def test_a_direct_path_has_no_interval(self) -> None:
        """Its error, another one at each pulse, was taken for one at each exchange."""
        with pytest.raises(MissionError) as caught:
            check(synchronization={"method": "direct_path", "interval": "1 s", "error": "5 deg"})
        assert "a direct path is heard with every pulse" in str(caught.value.faults[0])

    def test_one_point_of_an_allan_deviation_is_the_worst_noise_for_the_aperture(self) -> None:
        """It was taken for a random walk, 31 dB less over 0.1 s than white noise."""
        one = row(check(platforms={"receiver": {"oscillator": {"allan_deviation": {"1 s": 3e-10}}}},
                        collection={"aperture_time": "0.1 s"}), "receiver.oscillator")  # fmt: skip
        white = {"power_law": {"h0": 2 * 3e-10**2}}
        two = row(check(platforms={"receiver": {"oscillator": white}}, collection={"aperture_time": "0.1 s"}),
                  "receiver.oscillator")  # fmt: skip
        assert one.qpe_published_rad >= two.qpe_published_rad
        assert any("one point" in note for note in one.notes)
        assert any("begins at 1 s" in note for note in one.notes)

    @pytest.mark.parametrize("product", [0.2, 0.5, 0.75])
    def test_images_above_the_band_of_the_noise_are_counted(self, product: float) -> None:
        """All that straight lines leave of noise in a band B, by the share of each tone; 1.6 dB were cut at 0.5."""
        interval = 0.05
        pieces = [PowerLawPiece(0.0, product / interval, 1.0, 0.0)]
        found = synchronized_parts(pieces, 20.0, interval)
        y = np.linspace(1e-6, 2 * math.pi * product, 20_001)
        shares = 5 / 3 + np.cos(y) / 3 - 4 * (1 - np.cos(y)) / y**2
        whole = np.trapezoid(shares, y) / (2 * math.pi * interval)
        assert found.left == pytest.approx(whole, rel=0.02)  # the four orders that do not spread

    def test_a_part_of_gnss_has_the_axes_of_the_scene_for_its_noise_too(self, tmp_path) -> None:
        noise = "random: [{name: N, sigma: [0, 0, 1 mm], correlation_time: 1 s}]"
        (tmp_path / "part.yaml").write_text(f"kind: gnss\nname: Ours\nsource: a test\n{noise}\n")
        with pytest.raises(MissionError) as caught:
            with_error({"frame": "look", "sensor": str(tmp_path / "part.yaml")})
        assert "stated east, north, up" in str(caught.value.faults[0])
