"""The rest that a smooth path leaves of a log, and the steps of its fixes: `trajectory.processed` judges both."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

import bisar_budget as bb
from bisar_budget.budget.check import check_mission
from bisar_budget.budget.doubts import input_doubts, is_coarse, leaves_unsaid, residual_phase
from bisar_budget.budget.fit_noise import MAX_UNSAID_CHANGE_FRACTION, allowable_noise
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.paths.flight import smoothed
from bisar_budget.report.explain.explanation import explain
from tests.conftest import TODAY, examples, row
from tests.mission.test_path_files import aircraft
from tests.paths.flown import Flight, flight, geodetic_csv
from tests.questions.test_sweep import assert_as_checked, grid, swept

RESIDUAL, GRID = "receiver.trajectory.residual", "receiver.trajectory.grid"
BOTH = ("smoothed", "raw")


def noisy(sigma: float, seed: int = 0) -> Flight:
    """The flight with white noise in its heights. [m]"""
    flown = flight()
    return flown._replace(height=flown.height + np.random.default_rng(seed).normal(0, sigma, flown.height.shape))


def logged(folder: Path, log: bytes, processed: str | None = None, islr: str | None = None, **error: Any) -> Mission:
    """A mission whose receiver is a log."""
    (folder / "flight.csv").write_bytes(log)
    trajectory = {"file": "flight.csv"} | ({} if processed is None else {"processed": processed})
    receiver = {"trajectory": trajectory, "motion_error": {"position": "1 m", "velocity": "1 mm/s", **error}}
    needs = {} if islr is None else {"requirements__islr": islr}
    (folder / "m.yaml").write_text(aircraft(platforms__receiver=receiver, **needs))
    return load_mission(str(folder / "m.yaml"))


def written(decimals: int, climb: float = 0.3) -> bytes:
    """Log of the flight, climbing, with heights to some decimals and the rest to 0.1 nm."""
    flown = flight()
    return geodetic_csv(flown._replace(height=np.round(flown.height + climb * flown.times, decimals)))


class TestTheResidual:
    def test_it_is_the_phase_along_the_line_of_sight(self, tmp_path: Path) -> None:
        """White noise of σ in heights is 2πσ·u_z/λ."""
        mission = logged(tmp_path, geodetic_csv(noisy(2e-3)))
        state = mission.platforms.receiver.state
        expected = 2 * math.pi / mission.radar.wavelength * 2e-3 * abs(state.look[2])
        assert float(residual_phase(mission, "receiver")) == pytest.approx(expected, rel=0.2)

    def test_its_row_is_explained_by_its_reason(self, tmp_path: Path) -> None:
        mission = logged(tmp_path, geodetic_csv(noisy(5e-3)))
        text = explain(mission, check_mission(mission, TODAY), RESIDUAL)
        phase = float(residual_phase(mission, "receiver"))
        assert f"{phase:.3g} rad rms" in " ".join(text.split())

    @pytest.mark.parametrize("factor", [0.97, 1.03])
    def test_above_0_2_rad_nothing_is_judged_that_it_touches(self, tmp_path: Path, factor: float) -> None:
        at_1_mm = float(residual_phase(logged(tmp_path, geodetic_csv(noisy(1e-3))), "receiver"))
        log = geodetic_csv(noisy(1e-3 * factor * 0.2 / at_1_mm))
        mission = logged(tmp_path, log, vibration={"wideband": {"rms": "1 um"}}, islr="-5 dB")
        assert float(residual_phase(mission, "receiver")) == pytest.approx(0.2 * factor, rel=0.01)
        found = check_mission(mission, TODAY)
        islr = next(one for one in found.requirements if one.key == "islr")
        if factor < 1:
            assert found.status != "not_evaluated"
            assert islr.status == "pass"
            assert RESIDUAL not in {one.id for one in found.rows}
            return
        assert found.status == "not_evaluated"
        assert islr.status == "not_evaluated"
        for row_id in (RESIDUAL, "mission.islr"):
            said = row(found, row_id)
            assert said.status == "not_evaluated"
            assert said.reason is not None
            assert "platforms.receiver.trajectory.processed: smoothed" in said.reason
            assert "0.206 rad rms" in said.reason
        assert row(found, "receiver.position.x").status == "pass"
        assert row(found, "receiver.velocity.x").status != "not_evaluated"

    def test_without_a_requirement_of_islr_nothing_passes_either(self, tmp_path: Path) -> None:
        found = check_mission(logged(tmp_path, geodetic_csv(noisy(0.02))), TODAY)
        assert found.status == "not_evaluated"
        assert row(found, RESIDUAL).status == "not_evaluated"
        assert {one.status for one in found.requirements} == {"pass"}

    def test_a_smooth_path_that_is_flown_does_without(self, tmp_path: Path) -> None:
        mission = logged(tmp_path, geodetic_csv(noisy(0.02)), "smoothed")
        assert input_doubts(mission) == []
        found = check_mission(mission, TODAY)
        assert found.status == "pass"
        assert RESIDUAL not in {one.id for one in found.rows}
        assert "smoothed by the processor" in mission.platforms.receiver.path.source

    @pytest.mark.parametrize(("islr", "status"), [("-9 dB", "pass"), ("-14 dB", "fail")])
    def test_raw_fixes_spread(self, tmp_path: Path, islr: str, status: str) -> None:
        """As noise of 0.3 rad does: (exp(0.09) - 1)/0.90, -9.8 dB, of which the receiver may have half."""
        at_1_mm = float(residual_phase(logged(tmp_path, geodetic_csv(noisy(1e-3))), "receiver"))
        level = {"-9 dB": 0.15, "-14 dB": 0.3}[islr]
        mission = logged(tmp_path, geodetic_csv(noisy(1e-3 * level / at_1_mm)), "raw", islr)
        found = check_mission(mission, TODAY)
        assert next(one.status for one in found.requirements if one.key == "islr") == status
        error = next(one for one in random_errors(mission) if one.id == RESIDUAL)
        # Of the noise of 101 fixes the lowest four orders are no spread.
        assert error.full.spread * error.declared == pytest.approx(level, rel=0.05)

    def test_raw_fixes_that_nothing_requires_are_not_judged(self, tmp_path: Path) -> None:
        found = check_mission(logged(tmp_path, geodetic_csv(noisy(2e-3)), "raw"), TODAY)
        one = row(found, RESIDUAL)
        assert one.status == "not_evaluated"
        assert "islr" in (one.reason or "")

    @pytest.mark.parametrize("sigma", [1e-4, 0.02])
    @pytest.mark.parametrize("processed", [None, *BOTH])
    def test_a_sweep_says_the_same(self, tmp_path: Path, sigma: float, processed: str | None) -> None:
        mission = logged(tmp_path, geodetic_csv(noisy(sigma)), processed, "-20 dB")
        axes = {"radar__center_frequency": [1e9, 10e9], "collection__aperture_time": [1.0, 2.0]}
        cases = grid(mission, **axes)
        assert_as_checked(mission, cases, swept(mission, cases))

    def test_the_other_commands_know_the_row(self, tmp_path: Path) -> None:
        log = geodetic_csv(noisy(2e-3))
        raw, smooth = (logged(tmp_path, log, processed, "-5 dB") for processed in ("raw", "smoothed"))
        found = bb.check(raw)
        assert found[RESIDUAL].status in ("pass", "info")
        assert found.to_dict()["missions"][0]["status"] == "pass"
        spread = [bb.monte_carlo(one, 4000).to_dict() for one in (raw, smooth)]
        assert spread[0] != spread[1]
        assert bb.solve(raw, "requirements.islr", between=("-40 dB", "-1 dB")).value is not None


class TestTheGrid:
    @pytest.mark.parametrize(("declared", "is_doubted"), [("0.99 m", True), ("1.01 m", False)])
    def test_a_step_is_held_to_a_tenth_of_what_is_declared(
        self, tmp_path: Path, declared: str, is_doubted: bool
    ) -> None:
        mission = logged(tmp_path, written(1), position=declared)
        assert bool(is_coarse(mission, "receiver")) == is_doubted
        found = check_mission(mission, TODAY)
        statuses = {row(found, f"receiver.position.{axis}").status for axis in "xyz"}
        assert (statuses == {"not_evaluated"}) == is_doubted
        if is_doubted:
            reason = row(found, "receiver.position.z").reason or ""
            assert "steps of 100 mm (z)" in reason
            assert "more than a tenth of the declared 990 mm" in reason
            assert "platforms.receiver.trajectory.processed" in reason

    @pytest.mark.parametrize("processed", BOTH)
    def test_what_is_said_is_not_doubted(self, tmp_path: Path, processed: str) -> None:
        mission = logged(tmp_path, written(1), processed, position="5 cm")
        assert not is_coarse(mission, "receiver")
        rows = {one.id: one for one in check_mission(mission, TODAY).rows}
        assert rows["receiver.position.z"].status != "not_evaluated"
        assert (GRID in rows) == (processed == "raw")
        if processed == "raw":
            assert rows[GRID].declared == pytest.approx(0.1 / math.sqrt(12), rel=1e-3)

    def test_a_millimetre_is_no_story(self, tmp_path: Path) -> None:
        assert not is_coarse(logged(tmp_path, written(3), position=0), "receiver")
        assert is_coarse(logged(tmp_path, written(2), position=0), "receiver")

    def test_level_flight_has_no_step(self, tmp_path: Path) -> None:
        assert not is_coarse(logged(tmp_path, written(1, climb=0.0), position="1 cm"), "receiver")

    @pytest.mark.parametrize("frame", ["scene", "track", "look"])
    def test_a_step_counts_along_the_axes_of_any_frame(self, tmp_path: Path, frame: str) -> None:
        for size, is_doubted in ((0.5, True), (3.0, False)):
            mission = logged(tmp_path, written(1), frame=frame, position=size)
            assert bool(is_coarse(mission, "receiver")) == is_doubted

    @examples(12, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(decimals=st.integers(1, 3), sigma=st.floats(1e-3, 30.0))
    def test_whatever_is_declared_a_tenth_decides(self, tmp_path: Path, decimals: int, sigma: float) -> None:
        """For steps above a millimetre."""
        mission = logged(tmp_path, written(decimals), position=sigma)
        step = 10.0**-decimals
        if step > 1e-3 and not 0.098 * sigma < step < 0.102 * sigma:
            assert bool(is_coarse(mission, "receiver")) == (step > 0.1 * sigma)


class TestRounding:
    """A log rounded by brute force: how much of q²/12 is in the residual, and how much moves the path."""

    TIMES = np.arange(-500, 501) / 50
    STEP = 0.1

    def rounded(self, climb: float, offset: float) -> tuple[float, float]:
        """Residual's variance, and the square of the mean error over the aperture of the fit, over q²/12."""
        true = np.stack([60 * self.TIMES, 0 * self.TIMES, 3000 + offset + climb * self.TIMES], axis=1)
        log = true.copy()
        log[:, 2] = np.round(true[:, 2] / self.STEP) * self.STEP
        found = smoothed(self.TIMES, log, 4.0)
        apart = np.array(found.state.place(self.TIMES[400:601])).T - true[400:601]
        unit = self.STEP**2 / 12
        return found.residual[2][2] / unit, float(np.mean(apart[:, 2])) ** 2 / unit

    def test_many_steps_are_white_and_move_nothing(self) -> None:
        """7 m/s of climb: 1.4 steps from fix to fix."""
        found = np.array([self.rounded(7.0371, offset) for offset in np.linspace(0, self.STEP, 20)])
        assert found[:, 0].mean() == pytest.approx(1, abs=0.1)
        assert found[:, 1].mean() < 0.05

    def test_no_step_is_one_error_for_all_of_the_aperture(self) -> None:
        """The residual knows nothing of it: on average over where in a step the platform flies it is q²/12."""
        found = np.array([self.rounded(0.0, offset) for offset in np.linspace(0, self.STEP, 401)])
        assert found[:, 0].max() < 1e-9
        assert found[:, 1].mean() == pytest.approx(1, abs=0.02)

    @pytest.mark.parametrize("climb", [0.0, 0.01, 0.03, 0.3, 7.0371])
    def test_both_together_are_never_less_than_the_rounding(self, climb: float) -> None:
        """The residual, and q²/12 beside it, which `raw` counts."""
        found = np.array([self.rounded(climb, offset) for offset in np.linspace(0, self.STEP, 40)])
        assert found[:, 1].mean() < 1.1
        assert found[:, 0].mean() + 1 > 0.95


class TestTheNoiseOfTheFit:
    def test_a_noisy_log_says_what_it_does_to_allowables(self, tmp_path: Path) -> None:
        mission = logged(tmp_path, geodetic_csv(noisy(6.0)), "smoothed", position="60 m")
        noise = allowable_noise(mission, "receiver")
        assert noise is not None
        assert noise.change > MAX_UNSAID_CHANGE_FRACTION
        said = [str(one.message) for one in check_mission(mission, TODAY).warnings]
        assert any("noise of the log" in one and noise.row_id in one for one in said)

    def test_it_is_the_scatter_of_the_allowable_of_its_row(self, tmp_path: Path) -> None:
        """Allowables of missions whose logs have the noise drawn anew, fitted over the same stretch of 10 s.

        What 25 draws scatter by is known to 14 %, and what is said counts some smear beside the noise.
        """
        said, allowables = [], []
        for seed in range(40):
            mission = logged(tmp_path, geodetic_csv(noisy(0.3, seed)), "smoothed", position="30 m")
            noise = allowable_noise(mission, "receiver")
            assert noise is not None
            if mission.platforms.receiver.path.stretch > 9.5 and noise.row_id == "receiver.position.z":
                said.append(noise.change)
                allowables.append(row(check_mission(mission, TODAY), noise.row_id).allowable_full)
        assert len(said) >= 20
        assert 0.8 < np.median(said) / (np.std(allowables) / np.mean(allowables)) < 1.5

    def test_a_clean_log_says_nothing(self, tmp_path: Path) -> None:
        mission = logged(tmp_path, geodetic_csv(flight()))
        noise = allowable_noise(mission, "receiver")
        assert noise is None or noise.change < MAX_UNSAID_CHANGE_FRACTION
        assert not any("noise of the log" in str(one.message) for one in check_mission(mission, TODAY).warnings)


def test_the_key_takes_two_words(tmp_path: Path) -> None:
    with pytest.raises(bb.MissionError, match="smoothed, raw"):
        logged(tmp_path, geodetic_csv(flight()), "cooked")


def test_a_change_of_the_key_is_read(tmp_path: Path) -> None:
    mission = logged(tmp_path, geodetic_csv(noisy(0.02)))
    assert leaves_unsaid(mission, "receiver")
    assert not leaves_unsaid(
        bb.load(tmp_path / "m.yaml").replace({"platforms.receiver.trajectory.processed": "smoothed"}), "receiver"
    )
