"""A doubt about a path that ends because an input says less of itself, or by a key, is refused by its name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import load_mission
from bisar_budget.report.change.comparison import Gate, compare
from tests.budget.test_processed import logged, noisy
from tests.budget.test_stated_accuracy import CENTER, START, orbiting
from tests.conftest import TODAY
from tests.mission.test_path_files import ephemeris, satellite
from tests.paths.flown import geodetic_csv
from tests.paths.orbit_files import EPOCH, TLE, oem

FAR = (1e4, 1e4, 1e4)
OEM = "platforms.transmitter.orbit.oem"
DOUBT = "position in doubt by 10 km"
LESS = f"{DOUBT} -> content of a.oem states less of itself"


def refused(before: MissionFindings, after: MissionFindings) -> list[tuple[str, str]]:
    return [(one.id, one.words) for one in compare(before, after).refusals(Gate(0.1))]


def without_covariance(folder: Path, **error: Any) -> MissionFindings:
    """The mission of `orbiting`, of which the file says nothing of itself."""
    orbiting(folder, FAR, **error)
    (folder / "a.oem").write_text(oem(times=START.after))
    return check_mission(load_mission(str(folder / "m.yaml")), TODAY)


def elements(folder: Path, days: float, **orbit: Any) -> MissionFindings:
    (folder / "a.tle").write_text(TLE)
    transmitter = {"orbit": {"tle": "a.tle", **orbit}, "motion_error": {"position": "1 m", "velocity": "1 mm/s"}}
    text = satellite(
        EPOCH.after(86400 * days), platforms__transmitter=transmitter, requirements={"location_error": "500 m"}
    )
    (folder / "m.yaml").write_text(text)
    return check_mission(load_mission(str(folder / "m.yaml")), TODAY)


class TestACovarianceOfAnEphemeris:
    def test_taken_out_it_is_refused_by_its_file(self, tmp_path: Path) -> None:
        before = orbiting(tmp_path, FAR, position="1 m")
        after = without_covariance(tmp_path, position="1 m")
        assert before.status == "not_evaluated"
        assert after.status != "not_evaluated"
        # The ephemeris states no velocity error: against the stars, as `ric` has it, none comes from turning axes.
        assert refused(before, after) == [(OEM, LESS)]
        assert refused(after, after) == refused(before, before) == []

    def test_a_smaller_one_is_refused_too_and_one_that_stays_in_doubt_is_not(self, tmp_path: Path) -> None:
        before = orbiting(tmp_path, FAR, position="1 m")
        assert (OEM, LESS) in refused(before, orbiting(tmp_path, (0.5, 0.5, 0.5), position="1 m"))
        assert refused(before, orbiting(tmp_path, (5e3, 5e3, 5e3), position="1 m")) == []

    @pytest.mark.parametrize(
        "error", [{"position": "20 km", "velocity": "2 m/s"}, {"position": "1 m", "source": "POD, rev. B"}]
    )
    def test_an_error_that_covers_it_or_another_source_is_no_erosion(
        self, tmp_path: Path, error: dict[str, str]
    ) -> None:
        before = orbiting(tmp_path, FAR, position="1 m")
        assert (OEM, LESS) not in refused(before, without_covariance(tmp_path, **error))

    @pytest.mark.parametrize(
        ("orbit", "is_refused"),
        [
            ({"oem": "./new/A.oem"}, True),
            ({"oem": "new/a_.xml"}, True),
            ({"oem": "a.oem", "object": "CIRCLE"}, True),
            ({"oem": "b.oem"}, False),
        ],
    )
    def test_the_same_name_elsewhere_or_with_its_only_object_is_no_other(
        self, tmp_path: Path, orbit: dict[str, str], is_refused: bool
    ) -> None:
        before = orbiting(tmp_path, FAR, position="1 m")
        file = tmp_path / orbit["oem"]
        file.parent.mkdir(exist_ok=True)
        file.write_text(oem(times=START.after))
        error = {"frame": "ric", "position": "1 m", "velocity": "1 cm/s"}
        text = ephemeris(
            CENTER, oem(times=START.after), platforms__transmitter={"orbit": orbit, "motion_error": error}
        )
        (tmp_path / "m.yaml").write_text(text)
        after = check_mission(load_mission(str(tmp_path / "m.yaml")), TODAY)
        assert (OEM in [id for id, _ in refused(before, after)]) == is_refused

    def test_a_source_that_is_spelled_otherwise_is_no_other(self, tmp_path: Path) -> None:
        before = orbiting(tmp_path, FAR, position="1 m", source="POD, rev. A")
        assert (OEM, LESS) in refused(before, without_covariance(tmp_path, position="1 m", source="POD rev A "))
        before = orbiting(tmp_path, FAR, position="1 m", source="POD, rev. A")
        assert (OEM, LESS) not in refused(before, without_covariance(tmp_path, position="1 m", source="POD, rev. B"))

    def test_where_it_was_the_error_the_error_is_gone(self, tmp_path: Path) -> None:
        before = orbiting(tmp_path, (1.0, 1.0, 1.0))
        assert "transmitter.position" in [id for id, _ in refused(before, without_covariance(tmp_path))]


class TestAPlannedOrbit:
    def test_the_key_is_refused(self, tmp_path: Path) -> None:
        before, after = elements(tmp_path, 3.0), elements(tmp_path, 3.0, planned=True)
        assert (before.status, after.status) == ("not_evaluated", "pass")
        (one,) = [one for one in refused(before, after) if one[0].endswith("planned")]
        assert one[0] == "platforms.transmitter.orbit.planned"
        assert one[1].startswith("position in doubt by ")
        assert one[1].endswith(" -> true")

    def test_newer_elements_and_a_plan_that_was_one_are_not(self, tmp_path: Path) -> None:
        before = elements(tmp_path, 3.0)
        assert not any("orbit" in id for id, _ in refused(before, elements(tmp_path, 0.0)))
        planned = elements(tmp_path, 3.0, planned=True)
        assert refused(planned, planned) == []


class TestALogThatIsCalledSmooth:
    def test_the_key_is_refused(self, tmp_path: Path) -> None:
        log = geodetic_csv(noisy(0.02))
        before, smooth, raw = (
            check_mission(logged(tmp_path, log, processed), TODAY) for processed in (None, "smoothed", "raw")
        )
        assert (before.status, smooth.status) == ("not_evaluated", "pass")
        key = "platforms.receiver.trajectory.processed"
        assert key in [id for id, _ in refused(before, smooth)]
        assert all(words.endswith(" -> smoothed") for id, words in refused(before, smooth) if id == key)
        assert key not in [id for id, _ in refused(before, raw)]
        assert "receiver.trajectory.residual" in [id for id, _ in refused(raw, smooth)]


def test_a_place_without_a_source_is_refused(tmp_path: Path) -> None:
    before = orbiting(tmp_path, FAR, position="1 m")
    mission = before.analysed().mission
    state = mission.platforms.transmitter.state
    numbers = {name: [f"{part!r} {unit}" for part in getattr(state, name)] for name, unit in UNITS.items()}
    error = {"position": "1 m", "velocity": "1 cm/s"}
    text = ephemeris(CENTER, oem(times=START.after), platforms__transmitter={**numbers, "motion_error": error})
    (tmp_path / "m.yaml").write_text(text)
    after = check_mission(load_mission(str(tmp_path / "m.yaml")), TODAY)
    assert ("platforms.transmitter.orbit", f"{DOUBT} -> path stated without a source") in refused(before, after)


UNITS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}


def test_the_command_names_the_file(tmp_path: Path, run: Callable[..., Any]) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    for folder in (old, new):
        folder.mkdir()
        orbiting(folder, FAR, position="1 m")
    (new / "a.oem").write_text(oem(times=START.after))
    ask = ("diff", old / "m.yaml", new / "m.yaml", "--fail-on-erosion", "10%")
    found = run(*ask)
    assert found.exit_code == 1
    assert f"{OEM}" in found.stdout
    assert "content of a.oem" in " ".join(found.stdout.split())
    assert run(*ask, "--allow", OEM).exit_code == 0
