"""Biases and distributions of a mission, to a CPHD file and back, in Python and on the command line."""

import pytest
import yaml

pytest.importorskip("sarkit.cphd")

from bisar_budget.formats.collected import mission_text as imported_text
from bisar_budget.formats.exporting import export_phase_history
from bisar_budget.formats.importing import import_collection
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.targets import Targets
from tests.conftest import ROOT, mission_text

PLACE = {
    "scene": {"latitude": "48.1 deg", "longitude": "11.3 deg", "height": "560 m"},
    "collection__center_time": "2026-06-01T05:20:31.250Z",
}


def there_and_back(tmp_path, **changes):
    """Mission that is imported from the file of another one, its text, and what the export remarked."""
    path = tmp_path / "m.cphd"
    exported = export_phase_history(parse_mission(mission_text(**PLACE, **changes), "m.yaml"), Targets())
    path.write_bytes(exported.data)
    text = imported_text(import_collection(str(path)))
    return parse_mission(text, "again.yaml"), text, " ".join(exported.remarks)


def receiver(**error):
    return {"platforms__receiver__motion_error": error}


def test_the_mission_of_the_guide_comes_back_on_the_command_line(run, tmp_path) -> None:
    """Its biases and its distribution were lost, and neither command said so."""
    guide = (ROOT / "docs" / "guide" / "confidence.md").read_text()
    text = guide.partition(":caption: sure.yaml\n")[2].partition("```")[0]
    mission, output, back = tmp_path / "sure.yaml", tmp_path / "s.cphd", tmp_path / "back.yaml"
    mission.write_text(text + "timing_error: { constant: { sigma: 1 ns, bias: -2 ns } }\n")
    written = run("simulate", mission, "-o", output)
    assert written.exit_code == 0
    assert "import" not in written.stderr  # nothing is lost
    assert run("import", output, "-o", back).exit_code == 0
    tree = yaml.safe_load(back.read_text())
    error = tree["platforms"]["transmitter"]["motion_error"]
    assert error["position"] == {"sigma": ["0.5 m"] * 3, "bias": ["0 m", "0 m", "0.4 m"]}
    assert error["velocity"] == ["0.005 m/s"] * 3
    assert error["distribution"] == {"position": "normal", "velocity": "uniform", "acceleration": "normal"}
    assert tree["timing_error"] == {"constant": {"sigma": "1e-09 s", "bias": "-2e-09 s"}}
    assert run("check", back).exit_code == 0


def test_biases_of_each_kind(tmp_path) -> None:
    error = {
        "position": {"sigma": "1 m", "bias": ["1 cm", 0, "-2 cm"]},
        "velocity": {"sigma": "1 cm/s", "bias": [0, "3 mm/s", 0]},
        "acceleration": {"sigma": "1 mm/s^2", "bias": [0, 0, "-4 mm/s^2"]},
        "distribution": {"position": "bound", "velocity": "normal", "acceleration": "uniform"},
    }
    back, _, remarks = there_and_back(tmp_path, **receiver(**error))
    found = back.platforms.receiver.motion_error
    assert found.bias_of("position") == pytest.approx((0.01, 0, -0.02), abs=1e-12)
    assert found.bias_of("velocity") == pytest.approx((0, 0.003, 0), abs=1e-12)
    assert found.bias_of("acceleration") == pytest.approx((0, 0, -0.004), abs=1e-12)
    assert found.acceleration == pytest.approx((0.001,) * 3)
    assert [found.distribution_of(kind) for kind in ("position", "velocity", "acceleration")] == [
        "bound",
        "normal",
        "uniform",
    ]
    assert remarks == ""


def test_a_bias_without_a_sigma(tmp_path) -> None:
    back, _, _ = there_and_back(
        tmp_path, **receiver(velocity={"bias": ["1 mm/s", 0, 0]}), timing_error={"linear": {"bias": -1e-10}}
    )
    assert back.platforms.receiver.motion_error.velocity is None
    assert back.platforms.receiver.motion_error.bias_of("velocity") == pytest.approx((0.001, 0, 0))
    assert back.timing_error.bias["linear"] == pytest.approx(-1e-10)


def test_a_bias_beside_a_covariance(tmp_path) -> None:
    """Unlike sigmas along the track are a covariance along the scene's axes; the bias stands beside it."""
    error = {"frame": "track", "position": {"sigma": [1, 2, 3], "bias": ["1 m", 0, 0]}, "acceleration": [0.001, 0, 0]}
    _, without_velocity, _ = there_and_back(tmp_path, **receiver(**error))
    assert "correlations of the errors of the receiver are left out" in without_velocity.replace("\n# ", " ")
    back, _, remarks = there_and_back(tmp_path, **receiver(**error, velocity=[0.01, 0.02, 0.03]))
    assert "receiver.acceleration: its sizes along the scene's axes are stated as uncorrelated" in remarks
    found = back.platforms.receiver.motion_error
    along = parse_mission(mission_text(), "m.yaml").geometry.receiver.frame("track")[0]
    assert found.covariance is not None
    assert found.bias_of("position") == pytest.approx(along, abs=1e-9)
    assert found.acceleration == pytest.approx([abs(0.001 * x) for x in along], abs=1e-12)  # sizes, not a vector


def test_every_term_of_the_clock(tmp_path) -> None:
    timing = {
        "constant": {"sigma": "1 ns", "bias": "-2 ns"},
        "linear": {"sigma": 1e-10, "bias": 2e-10},
        "quadratic": {"sigma": "1e-12 1/s", "bias": "-3e-12 1/s"},
        "cubic": "1e-13 1/s^2",
    }
    back, _, remarks = there_and_back(tmp_path, timing_error=timing)
    stated = parse_mission(mission_text(timing_error=timing), "m.yaml").timing_error
    assert back.timing_error[:4] == pytest.approx(stated[:4])
    assert {k: v for k, v in back.timing_error.bias.items() if v is not None} == pytest.approx(
        {k: v for k, v in stated.bias.items() if v is not None}
    )
    assert remarks == ""


def test_a_common_bias_becomes_one_of_each_platform(tmp_path) -> None:
    """Constants add: the bias of each platform holds the common one, and the export says what is not kept."""
    back, _, remarks = there_and_back(
        tmp_path,
        **receiver(position={"sigma": "1 m", "bias": ["1 m", 0, 0]}),
        common_motion_error={"position": {"sigma": "1 m", "bias": ["2 m", 0, "1 m"]}},
    )
    assert back.platforms.receiver.motion_error.bias_of("position") == pytest.approx((3, 0, 1))
    assert back.platforms.transmitter.motion_error.bias_of("position") == pytest.approx((2, 0, 1))
    assert "import takes them for errors of its own" in remarks


def test_a_distribution_along_other_axes_is_said_to_be_lost(tmp_path) -> None:
    """A covariance is that of a normal distribution: the import made no mission of this file."""
    error = {"frame": "track", "position": [1, 2, 3], "distribution": "uniform"}
    back, _, remarks = there_and_back(tmp_path, **receiver(**error))
    assert back.platforms.receiver.motion_error.is_measured
    assert "receiver.position: the file has" in remarks


def test_what_has_no_carrier_is_said_by_both_commands(run, tmp_path) -> None:
    """A bias of a time tag, and one of an error from elsewhere, are comments of the imported mission."""
    mission, output = tmp_path / "m.yaml", tmp_path / "m.cphd"
    mission.write_text(
        mission_text(
            **PLACE,
            **receiver(time_tag={"sigma": "1 us", "bias": "2 us"}),
            other_errors=[{"name": "rest", "quadratic_phase_error": {"sigma": "1 deg", "bias": "3 deg"}}],
        )
    )
    written = run("simulate", mission, "-o", output)
    assert written.exit_code == 0
    assert "receiver.time_tag, receiver.time_tag.bias, other.rest, other.rest.bias" in written.stderr
    comments = run("import", output).stdout.partition("schema_version")[0]
    assert "receiver.time_tag.bias: 2e-06 s" in comments
    assert "other.rest.bias: 0.0523598775598 rad" in comments


def test_parameters_that_state_nothing_are_comments(tmp_path) -> None:
    """A file with the name of this program in it may come from anywhere."""
    path = tmp_path / "m.cphd"
    text = mission_text(**PLACE, **receiver(position={"sigma": "1 m", "bias": ["1 m", 0, 0]}, distribution="bound"))
    data = export_phase_history(parse_mission(text, "m.yaml"), Targets()).data
    assert data.count(b">1 0 0 m<") == data.count(b">bound<") == 1
    path.write_bytes(data.replace(b">1 0 0 m<", b">1 0 x m<").replace(b">bound<", b">round<"))
    back = imported_text(import_collection(str(path)))
    assert "# receiver.position.bias: 1 0 x m" in back
    assert "# receiver.distribution: round" in back
    parse_mission(back, "again.yaml")
