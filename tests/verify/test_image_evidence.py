"""Images kept for a report: the ones that the verdicts were read from, of the rows that decide most."""

import json
import math
from functools import cache

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.budget.verdicts import rows_worth_showing
from bisar_budget.findings.images import CHIP_FLOOR_DB, ImageEvidence, Verdict
from bisar_budget.findings.mission import Report
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.questions.checks import checked
from bisar_budget.report import Style, render
from bisar_budget.simulator.collection import RANGE_CELLS
from bisar_budget.simulator.phase_history import Errors
from bisar_budget.verifier.limits import _point_image, form_image_evidence, verify_mission
from bisar_budget.verifier.study import Study
from tests.conftest import ROOT, TODAY, findings, mission_text

SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
AUTOFOCUS = {"autofocus": {"algorithm": "pga", "n_pull": 2}}
CLOCK = {"timing_error": {"quadratic": "1e-13 1/s"}}


@cache
def evidence(only: str, **changes: str) -> tuple[ImageEvidence, ...]:
    """Evidence of the base mission; changes are JSON, so that they can be remembered."""
    given = {key: json.loads(value) for key, value in changes.items()}
    mission = parse_mission(mission_text(**given), "mission.yaml")
    found = check_mission(mission, TODAY)._replace(verdicts=verify_mission(mission, only).rows)
    return form_image_evidence(mission, found)


def clock() -> ImageEvidence:
    """A clock error bends no geometry: theory says its response to the sample."""
    more = {"autofocus": json.dumps(AUTOFOCUS["autofocus"]), "timing_error": json.dumps(CLOCK["timing_error"])}
    (found,) = evidence("timing.quadratic", **more)
    return found


def resolution() -> float:
    return findings().resolution.cross_range


def places(levels: tuple[float, ...], step_m: float) -> np.ndarray:
    return (np.arange(len(levels)) - len(levels) // 2) * step_m


def response(place: np.ndarray, quadratic: float) -> np.ndarray:
    """Power of a uniform aperture with a quadratic phase, by the integral itself. [dB]"""
    x = np.linspace(-1, 1, 4001)
    aperture = np.exp(1j * quadratic * x**2)
    values = np.exp(1j * math.pi * np.outer(place / resolution(), x)) @ aperture / x.size
    return 20 * np.log10(np.maximum(np.abs(values), 1e-6))


class TestCuts:
    def test_without_error_they_are_the_response_of_the_window(self) -> None:
        """sin(πu)/(πu), u in cells: to a tenth of a dB where it stands above −20 dB."""
        image = clock().at_limit
        u = places(image.error_free_db, image.step_m) / resolution()
        wanted = 20 * np.log10(np.maximum(np.abs(np.sinc(u)), 1e-6))
        high = wanted > -20
        assert np.count_nonzero(high) > 20
        # A chip ends at ±24 cells: its response rings by 1/(24π), 1 % of the peak or a tenth of a -20 dB level.
        assert np.max(np.abs(np.array(image.error_free_db) - wanted)[high]) < 0.8
        assert max(image.error_free_db) == pytest.approx(0, abs=0.005)

    def test_under_a_taper_they_are_that_windows(self) -> None:
        """Taylor, −35 dB, n̄ 5: the highest sidelobe at −35.2 dB."""
        taper = json.dumps({"window": "taylor"})
        (found,) = evidence("timing.quadratic", simulation=taper, timing_error=json.dumps(CLOCK["timing_error"]))
        levels = np.array(found.at_limit.error_free_db)
        beside = np.abs(places(found.at_limit.error_free_db, found.at_limit.step_m)) > 2.2 * resolution()
        assert levels[beside].max() == pytest.approx(-35.2, abs=0.6)

    @pytest.mark.parametrize("stage", ["at_limit", "before_autofocus"])
    def test_with_error_they_are_the_aperture_integral(self, stage: str) -> None:
        """π/8; with autofocus of N_pull 2 the limit is eight times that, π."""
        found = clock()
        image = getattr(found, stage)
        quadratic = math.pi / 8 * (1 if stage == "at_limit" else 8)  # π·N_pull over π/4
        wanted = response(places(image.cut_db, image.step_m), quadratic)
        high = wanted > -18
        assert np.count_nonzero(high) > 20
        # Ringing as above.
        assert np.max(np.abs(np.array(image.cut_db) - wanted)[high]) < 0.6

    def test_their_numbers_are_those_of_the_verdict(self) -> None:
        found = clock()
        image, verdict = found.at_limit, found.verdict
        cut, clean = np.array(image.cut_db), np.array(image.error_free_db)
        # The cut has ten samples to a cell: between two, a peak is at most (π/20)²/6 = 0.036 dB higher.
        assert cut.max() == pytest.approx(-verdict.peak_loss_db, abs=0.04)
        beside = np.abs(places(image.cut_db, image.step_m)) > resolution()
        assert cut[beside].max() - cut.max() == pytest.approx(verdict.pslr_db, abs=0.1)
        widths = [
            np.count_nonzero(
                np.interp(np.arange(0, level.size, 0.01), np.arange(level.size), level) > level.max() - 3.0103
            )
            for level in (cut, clean)
        ]
        assert widths[0] / widths[1] == pytest.approx(verdict.irw_ratio, abs=0.005)
        assert found.after_autofocus is not None
        assert max(found.after_autofocus.cut_db) == pytest.approx(-verdict.refocused_loss_db, abs=0.04)
        assert found.before_autofocus is not None
        assert max(found.before_autofocus.cut_db) == pytest.approx(-4.04, abs=0.1)  # π: table of the response

    def test_verdicts_are_the_same_with_and_without(self) -> None:
        assert clock().verdict.predicted_qpe_rad == pytest.approx(math.pi / 8, rel=0.01)
        given = {**AUTOFOCUS, **CLOCK}
        (verdict,) = verify_mission(parse_mission(mission_text(**given)), "timing.quadratic").rows
        assert clock().verdict == verdict

    def test_a_sum_is_shown_with_all_its_errors(self) -> None:
        more = {"allocation": json.dumps({"combine": "sum"}), "timing_error": json.dumps(CLOCK["timing_error"])}
        (found,) = evidence("receiver.quadratic_phase_error", **more)
        assert found.verdict.id == "receiver.quadratic_phase_error"
        assert max(found.at_limit.cut_db) == pytest.approx(-found.verdict.peak_loss_db, abs=0.04)


class TestChips:
    def test_they_are_small_and_centred(self) -> None:
        found = clock()
        for image in (found.at_limit, found.before_autofocus, found.after_autofocus):
            assert image is not None
            assert image.columns <= 96
            assert image.rows <= 96
            grey = np.frombuffer(image.chip, np.uint8).reshape(image.rows, image.columns)
            # 255 is the peak without error; a limit of π/8 loses 0.06 dB of 40.
            row, column = np.unravel_index(int(grey.argmax()), grey.shape)
            if image is not found.before_autofocus:
                assert abs(row - image.rows // 2) <= 1
                assert abs(column - image.columns // 2) <= 1
        assert max(found.at_limit.chip) == 255
        # -4.04 dB at π; a sample of 2.5 to a cell may lie a fifth of a cell off the peak, half a dB.
        assert max(found.before_autofocus.chip) == pytest.approx(
            255 * (1 - 4.04 / -CHIP_FLOOR_DB), abs=0.6 * 255 / 40
        )

    def test_x_is_to_the_right_and_y_up(self) -> None:
        """One bright sample, three pixels along x′ and five along y′ from the middle."""
        study = Study(parse_mission(mission_text()))
        reference = study.collection.chip((0.0, 0.0), Errors(), range_cells=RANGE_CELLS)
        look = study.geometry.look_azimuth
        steps = (reference.grid[1, 0] - reference.grid[0, 0], reference.grid[0, 61] - reference.grid[0, 60])
        assert steps[0] @ [math.cos(look), math.sin(look), 0] > 0
        assert steps[1] @ [-math.sin(look), math.cos(look), 0] > 0
        image = np.zeros_like(reference.image)
        nx, ny = image.shape
        image[nx // 2 + 3, ny // 2 + 5] = abs(reference.image).max()
        shown = _point_image(reference._replace(image=image), reference, 0.0)
        grey = np.frombuffer(shown.chip, np.uint8).reshape(shown.rows, shown.columns)
        row, column = np.unravel_index(int(grey.argmax()), grey.shape)
        assert column == nx // 2 + 3
        assert shown.rows - 1 - row == shown.rows // 2 + 5

    def test_a_long_smear_is_thinned_to_fit(self) -> None:
        """40π smear over 80 cells each way: 200 samples and more become at most 96, none of them skipped."""
        study = Study(parse_mission(mission_text()))
        reference = study.collection.chip((0.0, 0.0), Errors(), cells=220, range_cells=RANGE_CELLS)
        image = np.zeros_like(reference.image)
        image[5, image.shape[1] // 2 + 101] = abs(reference.image).max()
        shown = _point_image(reference._replace(image=image), reference, 160)
        assert shown.rows <= 96
        assert 255 in shown.chip
        stride = round(shown.pixel_m[1] / reference.spacing[1])
        assert stride == shown.thinned > 1
        assert shown.extent_m[1] == pytest.approx(shown.rows * stride * reference.spacing[1])
        assert len(shown.cut_db) == 4 * shown.rows * stride + 1


class TestRowsWorthShowing:
    """The rows of the section on the verdict: worst status first, then limits that images refute."""

    @staticmethod
    def chosen(*verdicts: Verdict, **changes: object) -> list[str]:
        found = findings(**changes)
        return [verdict.id for verdict in rows_worth_showing(found._replace(verdicts=verdicts))]

    @staticmethod
    def verdict(row_id: str, word: str = "confirmed", measured: float | None = 0.39) -> Verdict:
        return Verdict(
            id=row_id, model="published", boundary_error=1.0, unit="m", measured_qpe_rad=measured, verdict=word
        )

    DECLARED = {"platforms__transmitter__motion_error": {"acceleration": ["5 mm/s^2", 0, "0.1 mm/s^2"]}}
    FAILING, PASSING = "transmitter.acceleration.x", "transmitter.acceleration.z"

    def test_a_failing_row_comes_before_a_passing_one(self) -> None:
        given = [self.verdict(self.PASSING), self.verdict(self.FAILING)]
        assert self.chosen(*given, **self.DECLARED) == [self.FAILING, self.PASSING]

    def test_an_undeclared_row_is_shown_only_where_its_limit_is_refuted(self) -> None:
        given = [
            self.verdict("receiver.velocity.y"),
            self.verdict("receiver.velocity.x", "optimistic"),
            self.verdict(self.FAILING),
        ]
        assert self.chosen(*given, **self.DECLARED) == [self.FAILING, "receiver.velocity.x"]

    def test_where_nothing_is_declared_one_row_stands_for_all(self) -> None:
        given = [self.verdict("receiver.velocity.y"), self.verdict("receiver.velocity.x")]
        assert len(self.chosen(*given)) == 1

    def test_an_error_of_another_frame_comes_before_its_own_shadow(self) -> None:
        """Along the track, along y: the same error, and the same image."""
        error = {"frame": "track", "velocity": ["1 mm/s", "1 mm/s", "1 mm/s"]}
        given = [self.verdict("transmitter.velocity.y"), self.verdict("transmitter.velocity.along")]
        assert self.chosen(*given, platforms__transmitter__motion_error=error)[0] == "transmitter.velocity.along"

    def test_a_row_without_image_is_not(self) -> None:
        assert self.chosen(self.verdict(self.FAILING, "not_evaluated", None), **self.DECLARED) == []

    def test_at_most_four(self) -> None:
        error = {"acceleration": "1 mm/s^2", "velocity": "1 mm/s"}
        ids = [f"transmitter.{kind}.{axis}" for kind in ("velocity", "acceleration") for axis in "xyz"]
        assert len(self.chosen(*map(self.verdict, ids), platforms__transmitter__motion_error=error)) == 4

    def test_not_verified_nothing_to_show(self) -> None:
        assert rows_worth_showing(findings()) == ()
        assert form_image_evidence(load_mission(str(SECTION_V)), findings()) == ()


@pytest.mark.parametrize("illustrated", [True, False])
def test_only_a_report_that_shows_images_keeps_them(illustrated: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "bisar_budget.questions.verify.verify_all",
        lambda missions, *_: [verify_mission(m, "transmitter.acceleration.x") for m in missions],
    )
    (mission,) = checked([str(SECTION_V)], TODAY, is_verified=True, is_illustrated=illustrated)
    assert [one.verdict.id for one in mission.image_evidence] == ["transmitter.acceleration.x"] * illustrated
    # Images are no part of the JSON contract.
    document = json.loads(render("json", Report(version="", missions=(mission,)), Style()))
    assert "image_evidence" not in document["missions"][0]
