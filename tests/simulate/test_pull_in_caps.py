"""Where autofocus gives out: the room that a smear needs, and range walk; at two bandwidths, and what check says."""

import math

import numpy as np
import pytest

from bisar_budget.analysis.allocation import ROOM, Caps, caps, needed_sentence
from bisar_budget.mission.load import parse_mission
from bisar_budget.report.explain.explanation import explain
from bisar_budget.simulator.autofocus import ALGORITHMS
from bisar_budget.simulator.phase_history import Errors
from bisar_budget.verifier.study import Study
from tests.conftest import findings, mission_text, row

F0_MHZ = 10_000


def loss_db(algorithm: str, bandwidth_mhz: float, n_pull: float, room: float) -> float:
    """Peak lost by a point that a clock error of π·n_pull smeared, refocused in a patch of `room` times the smear."""
    study = Study(parse_mission(mission_text(radar__bandwidth=f"{bandwidth_mhz} MHz")))
    clock = next(s for s in study.sources if s.id == "timing.quadratic")
    errors = study.errors(clock, math.pi * n_pull / abs(clock.effect.qpe))
    cells = 2 * math.ceil(room * 4 * n_pull / 2)
    smeared, clean = (study.collection.chip((0.0, 0.0), e, cells=cells, range_cells=12) for e in (errors, Errors()))
    focused = ALGORITHMS[algorithm](smeared.image).image
    return 20 * math.log10(np.abs(clean.image).max() / np.abs(focused).max())


@pytest.mark.parametrize(("bandwidth", "n_pull"), [(50, 8), (750, 8), (300, 20)])
@pytest.mark.parametrize("algorithm", ["pga", "map_drift"])
def test_autofocus_needs_room_whatever_the_range_walk(algorithm: str, bandwidth: float, n_pull: float) -> None:
    """Walks of 0.02 to 0.3 cells: with the room it works, with 1.25 times the smear it does not.

    What is lost with room is the walk's own: 0.25 dB at 0.3 cells.
    """
    assert loss_db(algorithm, bandwidth, n_pull, ROOM[algorithm]) < 0.35
    assert loss_db(algorithm, bandwidth, n_pull, 1.25) > 5


@pytest.mark.parametrize(("walk", "low", "high"), [(0.1, -0.1, 0.1), (0.5, 0.5, 0.75), (1.0, 1.1, 1.5)])
def test_range_walk_costs_a_loss_but_not_the_correction(walk: float, low: float, high: float) -> None:
    """1800 MHz, n_pull up to 11, with room for it: half a cell loses 0.6 dB, a whole one 1.3 dB."""
    n_pull = 2 * walk * F0_MHZ / 1800
    assert low < loss_db("pga", 1800, n_pull, 4.0) < high


def warnings(**changes) -> list[str]:
    return [w.message for w in findings(**changes).warnings if "n_pull" in w.message]


class TestWarnings:
    @pytest.mark.parametrize(("n_pull", "warns"), [(33.3, False), (33.4, True)])
    def test_range_walk(self, n_pull: float, warns: bool) -> None:
        """f₀/B of the base mission is 33.33."""
        found = warnings(autofocus={"n_pull": n_pull})
        assert bool(found) == warns
        if warns:
            assert "33.4 is limited to 33.3, f0/B" in found[0]

    @pytest.mark.parametrize(("algorithm", "room"), [("pga", 3.0), ("map_drift", 1.5)])
    def test_smear_against_the_scene(self, algorithm: str, room: float) -> None:
        cell = findings().resolution.cross_range
        autofocus = {"algorithm": algorithm, "n_pull": 4}
        fits = room * 4 * 4 * cell / 2
        assert not warnings(autofocus=autofocus, scene={"radius": 1.001 * fits})
        (warning,) = warnings(autofocus=autofocus, scene={"radius": 0.9 * fits})
        assert "holds n_pull 3.6" in warning

    def test_no_autofocus_no_warning(self) -> None:
        assert not warnings(scene={"radius": 1})


class TestGain:
    """N_pull counts up to f₀/B, 33.33 in the base mission; `n_pull: 1e4` passed an error of 20 g."""

    @pytest.mark.parametrize(("n_pull", "counts"), [(33.3, 33.3), (33.4, 100 / 3), (1e4, 100 / 3)])
    def test_gain_of_what_counts(self, n_pull: float, counts: float) -> None:
        found = findings(autofocus__n_pull=n_pull)
        assert found.allocation.n_pull == pytest.approx(counts, rel=1e-12)
        assert found.allocation.autofocus_gain == pytest.approx(4 * counts, rel=1e-12)
        assert row(found, "mission.autofocus_pull_in").allowable == pytest.approx(math.pi * counts, rel=1e-12)

    def test_twenty_g_fails_whatever_the_file_claims(self) -> None:
        acceleration = {"platforms__receiver__motion_error__acceleration": ["196 m/s^2", 0, 0]}
        for rule, row_id in (("each", "receiver.acceleration.x"), ("rss", "receiver.quadratic_phase_error")):
            found = findings(autofocus__n_pull=1e4, allocation__combine=rule, **acceleration)
            failed = row(found, row_id)
            assert failed.status == found.status == "fail"
            assert "no autofocus corrects this: N_pull would have to be" in failed.reason
            what_else = "range walk allows 33.3; cubic phase"
            assert what_else in failed.reason if rule == "each" else failed.reason.endswith("range walk allows 33.3")

    @pytest.mark.parametrize("rule", ["each", "rss"])
    @pytest.mark.parametrize(("factor", "status"), [(0.999, "warn"), (1.001, "fail")])
    def test_both_sides_of_the_cap(self, rule: str, factor: float, status: str) -> None:
        """A clock's quadratic phase of half of π·f₀/B: its share of what the cap corrects.

        Half a cell of walk is b·φ of hidden phase, 1.15 of the limit here: the full model says that it fails.
        """
        size = factor * (math.pi * 100 / 3) / (math.pi * F0_MHZ * 1e6 * 6**2 / 2) / 2
        error = {"timing_error__quadratic": f"{size!r} 1/s", "allocation__combine": rule}
        row_id = "timing.quadratic" if rule == "each" else "receiver.quadratic_phase_error"
        assert row(findings(autofocus__n_pull=1e4, **error), row_id).status == status
        assert row(findings(autofocus__n_pull=33.2, **error), row_id).status == "fail"

    def test_explained(self) -> None:
        explained = self.explained(1e4)
        assert "autofocus.n_pull of 10000 counts up to half a range cell of range walk, f0/B" in explained
        assert "N_pull = 33.3333" in explained
        assert "counts up to" not in self.explained(33.3)

    @staticmethod
    def explained(n_pull: float) -> str:
        found = findings(autofocus__n_pull=n_pull)
        assert found.mission is not None
        return explain(found.mission, found, "timing.quadratic")


class TestNeeded:
    """What a row over its limit says: the N_pull from which it passes, or that none can."""

    def test_within_range_walk_it_passes(self) -> None:
        assert needed_sentence(2.95, Caps(walk=33.3)) == "passes with autofocus from n_pull 2.95"

    def test_beyond_range_walk_no_autofocus_corrects_it(self) -> None:
        sentence = needed_sentence(59952.1, Caps(walk=23.4))
        assert sentence == "no autofocus corrects this: N_pull would have to be 59 953, range walk allows 23.4"

    def test_the_smaller_cap_is_named(self) -> None:
        assert needed_sentence(10, Caps(walk=33.3, scene=3.6)).endswith(
            "would have to be 10, the scene's size allows 3.6"
        )
        assert needed_sentence(100, Caps(walk=33.3, scene=50)).endswith("range walk allows 33.3")
        assert needed_sentence(10, Caps(walk=33.3, scene=50)).startswith("passes")

    def test_digits_never_contradict_it(self) -> None:
        """What is needed is rounded up, what is allowed down: else 33.31 of 33.29 would read 33.3 of 33.3."""
        assert needed_sentence(33.31, Caps(walk=33.29)).endswith("would have to be 33.4, range walk allows 33.2")

    def test_caps_are_those_of_the_warnings(self) -> None:
        """f₀/B; and a scene that holds the smear times the room of the algorithm."""
        mission = parse_mission(mission_text(scene={"radius": 100}, autofocus={"algorithm": "map_drift"}), "m.yaml")
        cell = findings().resolution.cross_range
        assert caps(mission) == pytest.approx((100 / 3, 2 * 100 / (1.5 * 4 * cell)))
        assert caps(parse_mission(mission_text(), "m.yaml")).scene is None

    def test_rows_say_it(self) -> None:
        """An error that smears over kilometres was said to pass with enough autofocus."""
        found = findings(platforms__receiver__motion_error__acceleration=["10 m/s^2", 0, 0])
        reason = row(found, "receiver.acceleration.x").reason
        assert "no autofocus corrects this: N_pull would have to be" in reason
        assert "range walk allows 33.3; cubic phase" in reason
        found = findings(
            platforms__receiver__motion_error__acceleration=["10 m/s^2", 0, 0], allocation={"combine": "rss"}
        )
        assert "range walk allows 33.3" in row(found, "receiver.quadratic_phase_error").reason
