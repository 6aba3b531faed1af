"""Vibration from first principles, against transforms of the phase it makes; shared frequencies, vectors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.analysis import vibration_limits as vibration
from bisar_budget.budget.check import check_mission
from bisar_budget.effects.vibration import counted, cubic_part, quadratic_part
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Shares
from bisar_budget.units import format_limit
from tests.conftest import TODAY, findings, mission_text, row
from tests.responses import energy_within

LAMBDA = 299_792_458 / 10e9
T = 6.0
SAMPLES = np.arange(4096) / 4096
ERROR = "platforms__{}__motion_error__vibration"


def echo_db(*phases: float, cycles: int = 40) -> float:
    """Largest echo of sinusoids in phase, below the response: the transform of the aperture's phasor, by FFT."""
    phase = sum(size * np.sin(2 * math.pi * cycles * SAMPLES) for size in phases)
    spectrum = np.abs(np.fft.fft(np.exp(1j * phase)))
    return 20 * math.log10(spectrum[1:].max() / spectrum[0])


def vibrating(platform: str = "transmitter", pslr="-30 dB", islr="-20 dB", **changes):
    lines = changes.pop("sinusoidal", [])
    noise = changes.pop("wideband", None)
    tree = {"sinusoidal": lines} | ({"wideband": {"rms": noise}} if noise is not None else {})
    return findings(requirements={"pslr": pslr, "islr": islr}, **{ERROR.format(platform): tree}, **changes)


class TestFirstPrinciples:
    @pytest.mark.parametrize("phase", [1e-6, 0.01, 0.1, 0.5, 1.0, 1.4, 2.0])
    def test_the_echo_is_that_of_the_transform(self, phase: float) -> None:
        assert 20 * math.log10(vibration.echo_level(phase)) == pytest.approx(echo_db(phase), abs=1e-6)

    @given(st.floats(-200, -1e-3))
    def test_the_phase_of_a_level_makes_that_level(self, level_db: float) -> None:
        level = 10 ** (level_db / 20)
        assert vibration.echo_level(vibration.echo_phase(level)) == pytest.approx(level, rel=1e-12)

    @given(st.floats(-80, -1), st.floats(0.02, 0.98), st.floats(0, 0.5))
    def test_shares_met_by_both_platforms_at_one_frequency_meet_the_requirement(
        self, pslr: float, transmitter: float, reserve: float
    ) -> None:
        """And no more could be given: both at their limits reach what the shares leave of it."""
        shares = {"transmitter": transmitter * (1 - reserve), "receiver": (1 - transmitter) * (1 - reserve)}
        shares["reserve"] = 1 - shares["transmitter"] - shares["receiver"]
        mission = parse_mission(mission_text(requirements={"pslr": pslr}, allocation={"split": {"pslr": shares}}))
        found = check_mission(mission, TODAY)
        limits = [row(found, f"{p}.vibration.sinusoidal.0").allowable_full for p in ("transmitter", "receiver")]
        phases = [2 * math.pi * limit / LAMBDA for limit in limits]
        allowed = pslr + 10 * math.log10(1 - shares["reserve"])
        assert echo_db(*phases) == pytest.approx(allowed, abs=1e-6)
        # Alone, or at frequencies of their own, platforms are inside.
        assert max(echo_db(phase) for phase in phases) <= allowed + 1e-6

    @pytest.mark.parametrize("share", [0.5, 0.2, 0.9])
    def test_the_published_rule_is_three_decibels_inside_at_equal_shares_and_up_to_six_at_others(self, share) -> None:
        split = {"transmitter": share, "receiver": 1 - share}
        found = findings(requirements={"pslr": "-60 dB"}, allocation={"split": {"pslr": split}})
        line = row(found, "transmitter.vibration.sinusoidal.0")
        want = 20 * math.log10(2 / (math.sqrt(share) + math.sqrt(1 - share)))
        assert line.published_margin_db == pytest.approx(want, abs=1e-3)
        assert 3.01 <= want < 6.03
        assert any(f"{want:.2f} dB stricter than first principles" in note for note in line.notes)

    @pytest.mark.parametrize("islr", [-30.0, -20.0, -10.0, -3.0])
    def test_noise_of_both_platforms_within_their_shares_spreads_what_is_required(self, islr: float) -> None:
        """Power of the mean phasor of a Gaussian phase, by quadrature; 0.903 of it lies within the first nulls."""
        found = findings(
            requirements={"islr": islr}, allocation={"split": {"islr": {"transmitter": 0.3, "receiver": 0.7}}}
        )
        limits = [row(found, f"{p}.vibration.wideband").allowable_full for p in ("transmitter", "receiver")]
        sigma = math.hypot(*(2 * math.pi * limit / LAMBDA for limit in limits))
        nodes, weights = np.polynomial.hermite_e.hermegauss(80)
        coherent = abs(weights @ np.exp(1j * sigma * nodes) / weights.sum()) ** 2
        shown = (1 - coherent) / (coherent * energy_within("uniform"))
        assert 10 * math.log10(shown) == pytest.approx(islr, abs=1e-5)

    def test_a_printed_limit_that_first_principles_fail_is_a_warning(self) -> None:
        """σ² = ISLR spreads (exp(σ²) - 1)/0.903, at -3 dB 1.6 dB more than that."""
        limits = row(findings(requirements={"islr": -3}), "transmitter.vibration.wideband")
        between = (limits.allowable_published + limits.allowable_full) / 2
        found = row(vibrating(wideband=between, islr=-3), "transmitter.vibration.wideband")
        assert (found.status, found.utilization < 1) == ("warn", True)
        assert "fails by the full model" in found.reason
        found = row(
            vibrating(wideband=between, islr=-3, allocation__model="strictest"), "transmitter.vibration.wideband"
        )
        assert found.status == "fail"

    @pytest.mark.parametrize(("model", "factor"), [("published", 1.0), ("full", math.sqrt(2)), ("strictest", 1.0)])
    def test_the_model_gates(self, model: str, factor: float) -> None:
        printed = LAMBDA / (2 * math.pi) * math.sqrt(1e-6 / 2)
        for size, is_over in ((0.999, False), (1.001, True)):
            line = {"amplitude": size * factor * printed, "frequency": 15}
            found = vibrating(sinusoidal=[line], pslr="-60 dB", allocation__model=model)
            status = row(found, "transmitter.vibration.sinusoidal.0").status
            assert (status == "fail") == is_over
            assert status in ("fail", "warn")  # warn: above 80 %, or the published model fails it


class TestSlow:
    CYCLES = np.linspace(0.05, 3.5, 24)

    @staticmethod
    def worst(cycles: float, order: int) -> float:
        """Largest coefficient of the least-squares cubic over all phases of the vibration."""
        x = (np.arange(4000) + 0.5) / 2000 - 1
        phases = np.linspace(0, math.pi, 181)
        waves = np.cos(math.pi * cycles * x[:, None] + phases)
        return float(np.abs(np.polynomial.polynomial.polyfit(x, waves, 3)[order]).max())

    @pytest.mark.parametrize("cycles", CYCLES)
    def test_worst_phase_is_that_of_a_fit(self, cycles: float) -> None:
        """Phases are a degree apart: within (π/360)²/2 of the worst."""
        assert quadratic_part(cycles) == pytest.approx(self.worst(cycles, 2), rel=1e-4, abs=1e-5)
        assert cubic_part(cycles) == pytest.approx(self.worst(cycles, 3), rel=1e-4, abs=1e-5)

    @pytest.mark.parametrize(("cycles", "factor"), [(1, 2.3), (1.5, 1.4), (2, 0.6), (3, 0.25)])
    def test_known_factors(self, cycles: float, factor: float) -> None:
        assert quadratic_part(cycles) == pytest.approx(factor, rel=0.06)

    def test_the_row_carries_it_up_to_three_cycles(self) -> None:
        for cycles, has_it in ((1.0, True), (2.99, True), (3.01, False)):
            line = {"amplitude": 1e-5, "frequency": cycles / T}
            found = row(vibrating(sinusoidal=[line]), "transmitter.vibration.sinusoidal.0")
            assert (found.qpe_full_rad is not None) == has_it
            assert any("cycles per aperture" in note for note in found.notes) == has_it
            if has_it:
                want = 2 * math.pi * 1e-5 / LAMBDA * self.worst(cycles, 2)
                assert found.qpe_full_rad == pytest.approx(want, rel=2e-3)

    @pytest.mark.parametrize(("factor", "status"), [(0.99, "pass"), (1.01, "fail")])
    @pytest.mark.parametrize("combine", ["each", "rss"])
    @pytest.mark.parametrize("needs", ["pslr", "islr"])
    def test_a_quadratic_phase_over_its_limit_fails(self, needs: str, combine: str, factor: float, status) -> None:
        """Where echoes are hardly bounded: π/8 of quadratic phase at one cycle and a half. It was a warning."""
        amplitude = factor * math.pi / 8 / self.worst(1.5, 2) * LAMBDA / (2 * math.pi)
        lines = {"sinusoidal": [{"amplitude": amplitude, "frequency": 1.5 / T}]}
        found = findings(
            requirements={needs: "-1 dB"},
            allocation={"combine": combine, "warn_above": 1.0, "model": "full"},
            **{ERROR.format("transmitter"): lines},
        )
        one = row(found, "transmitter.vibration.sinusoidal.0")
        assert (one.status, one.binding_requirement) == (status, "quadratic_phase_error")
        assert one.utilization == pytest.approx(factor, rel=2e-3)
        (quadratic,) = [each for each in found.requirements if each.key == "quadratic_phase_error"]
        assert (quadratic.status, quadratic.row) == (status, "transmitter.vibration.sinusoidal.0")
        assert quadratic.utilization == one.utilization
        if status == "fail":
            assert one.reason.startswith(f"QPE {one.qpe_full_rad:.3g} rad in the worst phase, 0.392 rad allowed")

    @pytest.mark.parametrize(("n_pull", "status"), [(0.2, "fail"), (0.3, "pass_with_autofocus")])
    def test_autofocus_corrects_it(self, n_pull: float, status: str) -> None:
        """1.1 times π/8, which the gain of 4·n_pull has to reach."""
        amplitude = 1.1 * math.pi / 8 / self.worst(1.5, 2) * LAMBDA / (2 * math.pi)
        lines = {"sinusoidal": [{"amplitude": amplitude, "frequency": 1.5 / T}]}
        found = findings(
            requirements={"pslr": "-1 dB"},
            autofocus={"n_pull": n_pull},
            **{ERROR.format("transmitter"): lines},
        )
        assert row(found, "transmitter.vibration.sinusoidal.0").status == status

    def test_it_is_in_no_sum(self) -> None:
        line = {"amplitude": 1e-4, "frequency": 1.5 / T}
        velocity = {"platforms__transmitter__motion_error__velocity": 1e-4, "allocation__combine": "sum"}
        with_it, without = (vibrating(sinusoidal=lines, **velocity) for lines in ([line], []))
        names = ("mission.quadratic_phase_error", "transmitter.quadratic_phase_error")
        assert [row(with_it, n).declared for n in names] == [row(without, n).declared for n in names]


class TestSharedFrequency:
    @pytest.mark.parametrize(("amplitude", "status"), [(53e-6, "warn"), (54e-6, "fail")])
    def test_lines_of_one_platform_at_one_frequency_add(self, amplitude: float, status: str) -> None:
        """106.7 µm is the limit of the base mission; each line is far inside it."""
        lines = [{"amplitude": amplitude, "frequency": 15} for _ in range(2)]
        found = vibrating(sinusoidal=lines)
        assert [row(found, f"transmitter.vibration.sinusoidal.{n}").status for n in (0, 1)] == ["pass", "pass"]
        together = row(found, "transmitter.vibration.sinusoidal.sum.0")
        assert together.declared == pytest.approx(2 * amplitude)
        assert together.status == status

    @pytest.mark.parametrize(("apart", "is_one"), [(2.49, True), (2.51, False)])
    def test_lines_up_to_two_and_a_half_cycles_apart_are_judged_together(self, apart: float, is_one: bool) -> None:
        lines = [{"amplitude": 1e-5, "frequency": 15}, {"amplitude": 1e-5, "frequency": 15 + apart / T}]
        ids = [r.id for r in vibrating(sinusoidal=lines).rows]
        assert ("transmitter.vibration.sinusoidal.sum.0" in ids) == is_one

    @pytest.mark.parametrize(("amplitude", "status"), [(83e-6, "warn"), (85e-6, "fail")])
    def test_lines_a_cycle_apart_fail_together_where_each_passes(self, amplitude: float, status: str) -> None:
        """Half way between them each echo is 2/π of its peak: 106.7 µm allow 83.8 µm each."""
        lines = [{"amplitude": amplitude, "frequency": f} for f in (15, 15 + 1 / T)]
        found = vibrating(sinusoidal=lines)
        assert [row(found, f"transmitter.vibration.sinusoidal.{n}").status for n in (0, 1)] == ["pass", "pass"]
        together = row(found, "transmitter.vibration.sinusoidal.sum.0")
        assert together.declared == pytest.approx(4 / math.pi * amplitude, rel=1e-3)
        assert together.status == status
        assert "15 Hz to 15.17 Hz" in together.notes[0]

    def test_a_line_that_makes_no_echoes_is_in_no_group(self) -> None:
        lines = [{"amplitude": 1e-5, "frequency": cycles / T} for cycles in (0.9, 1.1)]
        assert not any(".sum." in r.id for r in vibrating(sinusoidal=lines).rows)

    def test_platforms_at_one_frequency_say_what_both_make(self) -> None:
        both = {
            ERROR.format(p): {"sinusoidal": [{"amplitude": 4e-5, "frequency": 15}]}
            for p in ("transmitter", "receiver")
        }
        found = findings(requirements={"pslr": -30}, **both)
        level = echo_db(*[2 * math.pi * 4e-5 / LAMBDA] * 2)
        for name, other in (("transmitter", "receiver"), ("receiver", "transmitter")):
            notes = row(found, f"{name}.vibration.sinusoidal.0").notes
            assert any(
                f"{level:.1f} dB" in note
                and f"the {other} vibrates" in note
                and "the worst phases echoes of both together" in note
                for note in notes
            )

    @pytest.mark.parametrize(("apart", "is_near"), [(1.0, True), (2.4, True), (2.6, False)])
    def test_platforms_near_each_other_too(self, apart: float, is_near: bool) -> None:
        """A cycle apart both together are 2.1 dB above one of them, 5 dB below two in one place."""
        found = findings(
            requirements={"pslr": -30},
            **{ERROR.format("transmitter"): {"sinusoidal": [{"amplitude": 1.4e-4, "frequency": 15}]}},
            **{ERROR.format("receiver"): {"sinusoidal": [{"amplitude": 1.4e-4, "frequency": 15 + apart / T}]}},
            allocation={"model": "full"},
        )
        for name in ("transmitter", "receiver"):
            line = row(found, f"{name}.vibration.sinusoidal.0")
            assert any("echoes of both together" in text for text in (*line.notes, line.reason)) == is_near
        level = 20 * math.log10(4 / math.pi * math.pi * 1.4e-4 / LAMBDA)
        if apart == 1.0:
            assert f"{level:.1f} dB" in line.notes[-1]

    def test_platforms_that_together_break_the_requirement_warn(self) -> None:
        """A share of 0.5 each, but two lines of one platform at the other's frequency: each passes, all fail."""
        two = {"sinusoidal": [{"amplitude": 9e-5, "frequency": 15} for _ in range(2)]}
        one = {"sinusoidal": [{"amplitude": 1.4e-4, "frequency": 15}]}
        found = findings(
            requirements={"pslr": -30},
            allocation={"model": "full"},
            **{ERROR.format("transmitter"): two, ERROR.format("receiver"): one},
        )
        assert row(found, "receiver.vibration.sinusoidal.0").status == "warn"
        assert row(found, "transmitter.vibration.sinusoidal.sum.0").status == "fail"


class TestVector:
    @pytest.mark.parametrize("frame", ["scene", "track", "look"])
    def test_the_line_of_sight_counts_as_it_turns(self, frame: str) -> None:
        """Against the axes as the README has them, by NumPy: root mean square over the aperture of each."""
        position, velocity = np.array([6e3, 6e3, 2e3]), np.array([-40.0, 40.0, 3.0])
        times = (np.arange(4000) + 0.5) / 4000 * T - T / 2
        sight = position + np.outer(times, velocity)
        sight /= np.linalg.norm(sight, axis=1)[:, None]
        u = position / np.linalg.norm(position)
        first = {"track": velocity, "look": u, "scene": np.array([1.0, 0, 0])}[frame]
        first = first / np.linalg.norm(first)
        cross = np.cross([0, 0, 1.0], first)
        cross /= np.linalg.norm(cross)
        axes = np.array([first, cross, np.cross(first, cross)])
        value = (3e-5, 1e-5, 2e-5)
        receiver = {"position": position.tolist(), "velocity": velocity.tolist(), "motion_error": {"frame": frame}}
        mission = parse_mission(mission_text(platforms__receiver=receiver))
        sizes = np.sqrt(np.mean((sight @ axes.T) ** 2, axis=0)) * value
        assert counted(mission, "receiver", value, "pslr") == pytest.approx(sizes.sum(), rel=1e-6)
        assert counted(mission, "receiver", value, "islr") == pytest.approx(np.linalg.norm(sizes), rel=1e-6)
        assert counted(mission, "receiver", 3e-5, "pslr") == 3e-5  # a single value is along it

    def test_a_vibration_across_the_line_of_sight_counts_as_that_turns(self) -> None:
        """It was none: of a metre across the receiver's line of sight 12 mm rms lie along it, as it turns."""
        error = {"frame": "look", "vibration": {"sinusoidal": [{"amplitude": [0, "1 m", 0], "frequency": 15}]}}
        found = findings(requirements={"pslr": -30}, platforms__receiver__motion_error=error)
        line = row(found, "receiver.vibration.sinusoidal.0")
        state = found.geometry.receiver
        way = np.array(state.velocity) - np.dot(state.velocity, state.look) * np.array(state.look)
        # The line of sight turns by v⊥τ/R, of which the root mean square is that at the edge over √3.
        turned = np.dot(way, state.frame("look")[1]) / state.slant_range * (T / 2) / math.sqrt(3)
        assert (line.declared, line.status) == (pytest.approx(abs(turned), rel=2e-3), "fail")

    def test_both_sides_of_the_limit(self) -> None:
        """The transmitter of the base mission is at (30, 0, 6) km: cosine 0.98058 east, nothing north."""
        limit = row(vibrating(), "transmitter.vibration.sinusoidal.0").allowable
        for size, status in ((0.999, "warn"), (1.001, "fail")):
            line = {"amplitude": [size * limit / (30 / math.hypot(30, 6)), 0, 0], "frequency": 15}
            assert row(vibrating(sinusoidal=[line]), "transmitter.vibration.sinusoidal.0").status == status

    def test_the_three_axes_add_in_the_worst_phase(self) -> None:
        """A projection of the vector would let 1 mm east and 1 mm north cancel for a receiver in the north-west."""
        receiver = {"position": ["-6 km", "6 km", "2 km"], "velocity": [-40, -40, 0]}
        receiver["motion_error"] = {"vibration": {"sinusoidal": [{"amplitude": [1e-3, 1e-3, 0], "frequency": 15}]}}
        found = findings(requirements={"pslr": -30}, platforms__receiver=receiver)
        want = 2e-3 * 6 / math.sqrt(76)  # and 1e-4 more as the line of sight turns
        assert row(found, "receiver.vibration.sinusoidal.0").declared == pytest.approx(want, rel=5e-4)


def test_amplitude_shares_of_both_platforms_sum_to_one() -> None:
    split = Shares(transmitter=0.6, receiver=0.2, clock=0.1, reserve=0.1)
    assert sum(vibration.amplitude_share(split, p) for p in ("transmitter", "receiver")) == pytest.approx(1)


@pytest.mark.parametrize(("allowed", "status"), [(0.99, "fail"), (1.01, "warn")])
def test_a_slow_vibration_that_breaks_the_cubic_requirement_fails(allowed: float, status: str) -> None:
    """At 1.5 cycles per aperture the worst cubic is three times the worst quadratic: of sin(πnx), by a fit."""
    x = np.linspace(-1, 1, 4001)
    cubic = 2.5 * np.polynomial.legendre.legfit(x, np.sin(1.5 * math.pi * x), 9)[3]  # P₃ is 5x³/2 - …
    phase = 2 * math.pi * 1e-4 / LAMBDA * abs(float(cubic))
    lines = {"sinusoidal": [{"amplitude": 1e-4, "frequency": 1.5 / T}]}
    requirements = {"pslr": "-25 dB", "cubic_phase_error": allowed * phase}
    found = row(
        findings(requirements=requirements, **{ERROR.format("transmitter"): lines}),
        "transmitter.vibration.sinusoidal.0",
    )
    assert (found.status, found.binding_requirement) == (status, "cubic_phase_error")
    limit = format_limit(allowed * phase, "rad")
    assert f"or a cubic of {phase:.3g} rad, {limit} allowed" in found.notes[-1]
    says = f"cubic phase {phase:.3g} rad in the worst phase, {limit} allowed" if status == "fail" else "above 80 %"
    assert found.reason.startswith(says)


@pytest.mark.parametrize(("window", "beyond"), [("uniform", 0.46), ("taylor", 0.03)])
def test_how_far_the_published_rule_of_noise_is_beyond_what_an_image_shows(window: str, beyond: float) -> None:
    """At -20 dB λ√(ISLR/2)/2π is 1/0.903 beyond, 0.44 dB, under Taylor's weights 1/0.998; exp(σ²) - 1 adds 0.02."""
    found = findings(requirements={"islr": "-20 dB"}, simulation={"window": window})
    notes = row(found, "receiver.vibration.wideband").notes
    assert notes == (f"the published rule is {beyond} dB more lenient than first principles",)


@pytest.mark.parametrize(
    ("model", "sinusoidal", "wideband"),
    [
        ("published", "Section V, sinusoidal", "Section V, wideband"),
        ("full", "first principles", "first principles"),
        ("strictest", "Section V, sinusoidal", "first principles"),
    ],
)
def test_a_row_names_the_rule_that_gates(model: str, sinusoidal: str, wideband: str) -> None:
    """A limit from first principles is not the paper's: the reason of a failure says whose it is."""
    lines = [{"amplitude": "1 mm", "frequency": "10 Hz"} for _ in range(2)]
    found = vibrating(sinusoidal=lines, wideband="1 mm", allocation__model=model)
    for name, rule in (("sinusoidal.0", sinusoidal), ("sinusoidal.sum.0", sinusoidal), ("wideband", wideband)):
        judged = row(found, f"transmitter.vibration.{name}")
        assert (judged.status, judged.equation) == ("fail", rule)
        assert judged.reason.endswith(f"({rule})")
