"""Vibrations below one cycle per aperture: judged as the quadratic and cubic phase that they are; ISLR of noise."""

import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import Report
from bisar_budget.mission.load import parse_mission
from bisar_budget.report import Style, render
from bisar_budget.report.explain.explanation import explain
from tests.conftest import TEXT_FORMATS, TODAY, findings, mission_text, row
from tests.report.test_report_explanation import evaluated, sums
from tests.responses import energy_within

LAMBDA = 299_792_458 / 10e9
T = 6.0
ERROR = "platforms__{}__motion_error__vibration"
SHARE = math.pi / 8
ROW = "transmitter.vibration.sinusoidal.0"


def worst(cycles: float, order: int) -> float:
    """Largest P₂ or P₃ part at the aperture edge over the phases of a vibration of 1 rad, by a Legendre fit.

    Where the variance of the phase over band and aperture is least: the displacement of the image defocuses too.
    """
    x = (np.arange(2000) + 0.5) / 1000 - 1
    phases = np.linspace(0, math.pi, 361)
    waves = np.cos(math.pi * cycles * x[:, None] + phases)
    mission = parse_mission(mission_text())
    band = (mission.radar.bandwidth / mission.radar.center_frequency) ** 2 / 12
    slopes = np.zeros((x.size, 2))
    for path in mission.geometry.both:
        place = np.stack(np.broadcast_arrays(*path.place(x * T / 2)), axis=1)
        slopes += place[:, :2] / np.linalg.norm(place, axis=1)[:, None]
    weighted = (1 + band) * slopes - slopes.mean(axis=0)
    waves -= slopes @ np.linalg.solve(weighted.T @ slopes, weighted.T @ waves)
    parts = np.polynomial.legendre.legfit(x, waves, 5)[order]
    return float(np.abs(parts).max()) * {2: 1.5, 3: 2.5}[order]


def swaying(*lines: tuple[float, float], platform: str = "transmitter", **changes):
    """Check with lines of an amplitude [m] and a number of cycles per aperture; their cubic phase may be large."""
    changes.setdefault("requirements", {"cubic_phase_error": 6})
    entries = [{"amplitude": size, "frequency": cycles / T} for size, cycles in lines]
    return findings(**{ERROR.format(platform): {"sinusoidal": entries}}, **changes)


def of_phase(phase: float, cycles: float, order: int) -> float:
    """Amplitude whose worst quadratic or cubic phase is so large. [m]"""
    return phase / worst(cycles, order) * LAMBDA / (2 * math.pi)


@pytest.mark.parametrize("cycles", [0.05, 0.3, 0.6, 0.9, 0.999])
@pytest.mark.parametrize("model", ["published", "full", "strictest"])
def test_the_limit_is_where_the_worst_quadratic_phase_takes_the_share(cycles: float, model: str) -> None:
    limit = of_phase(SHARE, cycles, 2)
    for factor, status in ((0.995, "warn"), (1.005, "fail")):
        found = row(swaying((factor * limit, cycles), allocation={"model": model}), ROW)
        assert found.status == status
        assert found.metric == "quadratic_phase_error"
        assert found.binding_requirement == "quadratic_phase_error"
        assert found.allowable == pytest.approx(limit, rel=1e-3)  # phases of the fit are half a degree apart
        assert found.allowable == found.allowable_published == found.allowable_full
        assert found.qpe_full_rad == pytest.approx(factor * SHARE, rel=1e-3)
        assert found.cubic_rad == pytest.approx(factor * limit * 2 * math.pi / LAMBDA * worst(cycles, 3), rel=1e-3)
    assert f"{SHARE * 1.005:.3g} rad in the worst phase" in found.reason


def test_twenty_millimetres_at_nine_tenths_of_a_cycle_are_nearly_nine_radians() -> None:
    """They were said, not judged, and needed a requirement of PSLR to be said at all."""
    found = row(swaying((20e-3, 0.9), radar={"center_frequency": "9.6 GHz", "bandwidth": "300 MHz"}), ROW)
    assert found.qpe_full_rad == pytest.approx(8.7, abs=0.05)
    assert found.status == "fail"
    assert "no autofocus corrects this" not in found.reason
    assert "n_pull 5.5" in found.reason  # 8.7 rad·(π/4)/(π/8)/π


@pytest.mark.parametrize(("factor", "status"), [(0.99, "warn"), (1.01, "fail")])
def test_the_cubic_requirement_binds_where_it_is_smaller(factor: float, status: str) -> None:
    """At 0.9 cycles the worst cubic is 0.9 times the quadratic: 0.1 rad of it is the smaller amplitude."""
    limit = of_phase(0.1, 0.9, 3)
    changes = {"requirements": {"cubic_phase_error": 0.1}, "autofocus": {"n_pull": 2}}
    found = row(swaying((factor * limit, 0.9), **changes), ROW)
    assert (found.status, found.binding_requirement) == (status, "cubic_phase_error")
    assert found.allowable == pytest.approx(limit, rel=1e-3)
    # Autofocus does not gain on what band and turn hide: 1 % of the phase, of which the square of 8 % counts.
    assert found.allowable_full == pytest.approx(of_phase(8 * SHARE, 0.9, 2), rel=5e-3)
    if status == "fail":
        assert "autofocus gain does not apply" in found.reason


@pytest.mark.parametrize(
    ("factor", "status"), [(0.7, "pass"), (1.1, "pass_with_autofocus"), (7.9, "pass_with_autofocus"), (8.1, "fail")]
)
def test_autofocus_corrects_it(factor: float, status: str) -> None:
    """π·2 over π/4 is eight times the limit."""
    found = row(swaying((factor * of_phase(SHARE, 0.5, 2), 0.5), autofocus={"n_pull": 2}), ROW)
    assert found.status == status


@pytest.mark.parametrize(("cycles", "metric"), [(0.999, "quadratic_phase_error"), (1.001, "pslr")])
def test_one_cycle_is_the_border_between_phase_and_echo(cycles: float, metric: str) -> None:
    found = row(swaying((1e-5, cycles), requirements={"pslr": -30}), ROW)
    assert (found.metric, found.status) == (metric, "pass")
    assert (found.binding_requirement is None) == (metric == "pslr")


class TestTogether:
    LINES = ((1e-4, 0.5), (5e-5, 0.8), (1e-3, 1.5), (1e-4, 40.0))

    def test_sum_and_rss_count_what_is_slow_and_nothing_else(self) -> None:
        sizes = [2 * math.pi * size / LAMBDA * worst(cycles, 2) for size, cycles in self.LINES[:2]]
        cubics = [2 * math.pi * size / LAMBDA * worst(cycles, 3) for size, cycles in self.LINES[:2]]
        other = {"platforms__transmitter__motion_error__velocity": [0, 0.01, 0]}
        alone = findings(allocation={"combine": "sum"}, **other)
        base = row(alone, "transmitter.quadratic_phase_error").declared
        base_cubic = row(alone, "mission.cubic_phase_error").declared
        for combine, add in (("sum", math.fsum), ("rss", lambda parts: math.hypot(*parts))):
            found = swaying(
                *self.LINES,
                allocation={"combine": combine},
                requirements={"cubic_phase_error": 0.3, "pslr": -20},
                **other,
            )
            for name in ("transmitter", "mission"):
                total = row(found, f"{name}.quadratic_phase_error").declared
                assert total == pytest.approx(add([base, *sizes]), rel=1e-3)
            assert row(found, "receiver.quadratic_phase_error").declared is None
            cubic = row(found, "mission.cubic_phase_error").declared
            assert cubic == pytest.approx(add([base_cubic, *cubics]), rel=1e-3)
            statuses = [row(found, f"transmitter.vibration.sinusoidal.{n}").status for n in range(4)]
            assert statuses[:2] == ["info", "info"]
            assert "info" not in statuses[2:]

    @pytest.mark.parametrize(("factor", "status"), [(0.99, "warn"), (1.01, "fail")])
    @pytest.mark.parametrize("combine", ["sum", "rss"])
    def test_one_alone_reaches_the_limit_of_its_platform(self, combine: str, factor: float, status: str) -> None:
        found = swaying((factor * of_phase(SHARE, 0.5, 2), 0.5), allocation={"combine": combine})
        assert row(found, "transmitter.quadratic_phase_error").status == status
        assert row(found, ROW).status == "info"

    def test_all_together_exceed_the_total_where_each_stays_inside(self) -> None:
        lines = [(0.95 * of_phase(SHARE, cycles, 2), cycles) for cycles in (0.3, 0.4, 0.5, 0.6, 0.7)]
        found = swaying(*lines)
        assert row(found, "mission.quadratic_phase_error").status == "warn"
        assert not any(r.id == "mission.quadratic_phase_error" for r in swaying(*lines[:4]).rows)

    def test_autofocus_has_them_to_correct(self) -> None:
        found = swaying((of_phase(4.0, 0.5, 2), 0.5), (of_phase(3.0, 0.6, 2), 0.6), autofocus={"n_pull": 2})
        pull_in = row(found, "mission.autofocus_pull_in")
        assert pull_in.declared == pytest.approx(7.0, rel=1e-3)
        assert pull_in.status == "warn"

    def test_a_balanced_split_weighs_it(self) -> None:
        """0.1 rad of one platform against 0.3 rad of the other: a quarter and three quarters."""
        lines = {
            ERROR.format(name): {"sinusoidal": [{"amplitude": of_phase(phase, 0.5, 2), "frequency": 0.5 / T}]}
            for name, phase in (("transmitter", 0.1), ("receiver", 0.3))
        }
        for combine in ("each", "rss"):
            found = findings(allocation={"split": "balanced", "combine": combine}, **lines)
            assert found.allocation.qpe.transmitter == pytest.approx(0.25, abs=1e-6)

    def test_the_phases_are_those_of_the_rows(self) -> None:
        text = mission_text(**{ERROR.format("receiver"): {"sinusoidal": [{"amplitude": 1e-4, "frequency": 0.1}]}})
        (slow,) = Analysis(parse_mission(text)).slow
        found = row(check_mission(parse_mission(text), TODAY), slow.row_id)
        assert (slow.owner, slow.qpe_rad.item(), slow.cubic_rad.item()) == (
            "receiver",
            found.qpe_full_rad,
            found.cubic_rad,
        )


def test_a_vector_counts_along_the_line_of_sight() -> None:
    """The transmitter of the base mission is at (30, 0, 6) km, and what displaces the image defocuses by 1e-3."""
    line = {"amplitude": [1e-4, 0, 0], "frequency": 0.5 / T}
    found = row(findings(**{ERROR.format("transmitter"): {"sinusoidal": [line]}}), ROW)
    assert found.declared == pytest.approx(1e-4 * 30 / math.hypot(30, 6), rel=2e-3)


def test_a_metre_across_the_line_of_sight_is_no_small_error() -> None:
    """It passed with 0 rad; `tests.effects.test_slow_tones` holds the number to exact ranges."""
    line = {"amplitude": [0, 1.0, 0], "frequency": 0.5 / T}
    found = row(findings(**{ERROR.format("transmitter"): {"sinusoidal": [line]}}), ROW)
    assert (found.status, found.qpe_full_rad is not None and found.qpe_full_rad > 1) == ("fail", True)


def test_a_vibration_of_nothing_passes() -> None:
    found = row(swaying((0.0, 0.5)), ROW)
    assert (found.status, found.utilization, found.margin) == ("pass", 0.0, None)


@pytest.mark.parametrize("format_name", sorted(TEXT_FORMATS))
def test_every_format_has_it(format_name: str) -> None:
    found = swaying((1e-2, 0.5), requirements={"cubic_phase_error": 0.3})
    text = render(format_name, Report(version="0", missions=(found,)), Style()).replace("\\", "")
    assert ROW in text


@pytest.mark.parametrize("cubic", [None, 0.3])
def test_its_explanation_gives_its_numbers(cubic: float | None) -> None:
    """And that of lines near each other: each sum repeated from the six digits that stand in it."""
    requirements = {"pslr": -30} | ({} if cubic is None else {"cubic_phase_error": cubic})
    lines = ((1e-4, 0.5), (1e-5, 20.3), (2e-5, 21.4))
    mission = parse_mission(
        mission_text(
            **{ERROR.format("transmitter"): {"sinusoidal": [{"amplitude": a, "frequency": n / T} for a, n in lines]}},
            requirements=requirements,
        )
    )
    found = check_mission(mission, TODAY)
    for row_id in (ROW, "transmitter.vibration.sinusoidal.sum.0"):
        judged, results = row(found, row_id), {}
        for symbol, numbers, value in sums(explain(mission, found, row_id)):
            assert evaluated(numbers) == pytest.approx(value, rel=2e-5), symbol
            results[symbol] = value
        assert results["allowable"] == pytest.approx(judged.allowable, rel=1e-5)
        assert results["utilization"] == pytest.approx(judged.utilization, rel=1e-5)
    assert results["declared"] == pytest.approx(judged.declared, rel=1e-5)
    judged = row(found, ROW)
    results = {symbol: value for symbol, _, value in sums(explain(mission, found, ROW))}
    assert results["QPE"] == results["QPE_full"] == pytest.approx(judged.qpe_full_rad, rel=1e-5)
    assert results["cubic"] == pytest.approx(judged.cubic_rad, rel=1e-5)


class TestNoise:
    @pytest.mark.parametrize("rms", [1e-9, 1e-5, 1e-3, 5e-3])
    def test_the_row_carries_the_islr_that_it_adds(self, rms: float) -> None:
        """Of a Gaussian phase the mean phasor has exp(-σ²) of the power, by quadrature; the mask 0.903 of it."""
        noise = {ERROR.format("receiver"): {"wideband": {"rms": rms}}}
        found = row(findings(requirements={"islr": -20}, **noise), "receiver.vibration.wideband")
        sigma = 2 * math.pi * rms / LAMBDA
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        lost = (weights @ (2 * np.sin(sigma * nodes / 2) ** 2)) / weights.sum()  # 1 - mean phasor, without rounding
        coherent = (1 - lost) ** 2
        shown = lost * (2 - lost) / (coherent * energy_within("uniform"))
        assert found.islr_db == pytest.approx(10 * math.log10(shown), abs=1e-5)

    def test_without_a_requirement_too_and_at_any_size(self) -> None:
        found = findings(**{ERROR.format("receiver"): {"wideband": {"rms": "1 km"}}})
        islr = row(found, "receiver.vibration.wideband").islr_db
        assert islr == pytest.approx(10 / math.log(10) * (2 * math.pi * 1e3 / LAMBDA) ** 2)

    def test_nothing_declared_adds_nothing(self) -> None:
        assert row(findings(), "receiver.vibration.wideband").islr_db is None
        zero = findings(**{ERROR.format("receiver"): {"wideband": {"rms": 0}}})
        assert row(zero, "receiver.vibration.wideband").islr_db is None
