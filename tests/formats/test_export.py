"""CPHD files of simulated collections: nothing to object to, and what an independent program sees in them.

The program here is sarkit's reader and a matched filter: it knows the signal, the vectors and the standard's signal
model, and nothing of this package.
"""

import math
import os
import warnings

import numpy as np
import pytest
import yaml

pytest.importorskip("sarkit.cphd")
pytest.importorskip("shapely")

import sarkit.cphd as skcphd
import sarkit.verification as skver

from bisar_budget.formats.collected import mission_text as imported_text
from bisar_budget.formats.exporting import export_phase_history
from bisar_budget.formats.importing import import_collection
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.targets import Target, Targets, parse_targets
from tests.conftest import ROOT, findings, mission_text, row

C = 299792458.0
PLACE = {"latitude": "48.1 deg", "longitude": "11.3 deg", "height": "560 m"}


def exported(tmp_path, text, targets=None):
    path = tmp_path / "out.cphd"
    path.write_bytes(export_phase_history(parse_mission(text, "mission.yaml"), targets or Targets()).data)
    return path


def objections(path) -> dict:
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's, of a platform that has no direction of motion
        checker = skver.CphdConsistency.from_file(file, thorough=True)
        checker.check()
    assert len(checker.passes()) > 50
    return checker.failures()


class Program:
    """An image former that knows nothing but the file."""

    def __init__(self, path) -> None:
        with path.open("rb") as file, skcphd.Reader(file) as reader:
            self.xml = reader.metadata.xmltree
            self.signal, self.vectors = reader.read_channel("1")
        self.signal = self.signal.astype(np.complex128)
        plane = "{*}SceneCoordinates/{*}ReferenceSurface/{*}Planar"
        self.axes = [self._xyz(f"{plane}/{{*}}uIA{axis}") for axis in "XY"]
        self.origin = self._xyz("{*}SceneCoordinates/{*}IARP/{*}ECF")
        samples = np.arange(self.signal.shape[1])
        self.frequency = self.vectors["SC0"][:, None] + samples * self.vectors["SCSS"][:, None]
        self.sgn = float(self.xml.findtext("{*}Global/{*}SGN"))

    def _xyz(self, path):
        node = self.xml.find(path)
        return np.array([float(node.findtext(f"{{*}}{axis}")) for axis in "XYZ"])

    def late(self, point):
        """ΔTOA of a point in the image plane, by the vectors. [s]"""
        place = self.origin + point[0] * self.axes[0] + point[1] * self.axes[1]
        v = self.vectors
        far = np.linalg.norm(v["TxPos"] - place, axis=1) + np.linalg.norm(v["RcvPos"] - place, axis=1)
        near = np.linalg.norm(v["TxPos"] - v["SRPPos"], axis=1) + np.linalg.norm(v["RcvPos"] - v["SRPPos"], axis=1)
        return (far - near) / C

    def pulses(self, point):
        """What each pulse has of a point."""
        turn = np.exp(-self.sgn * 2j * math.pi * self.frequency * self.late(point)[:, None])
        return (self.signal * turn).mean(axis=1)

    def pixel(self, point) -> float:
        return abs(self.pulses(point).mean())

    def peak(self, near, step, levels=7):
        """Brightest point about another one, by ever finer grids of 5 by 5."""
        best = np.array(near, dtype=float)
        for _ in range(levels):
            offsets = [step * np.array([i, j]) for i in range(-2, 3) for j in range(-2, 3)]
            best = max((best + offset for offset in offsets), key=self.pixel)
            step /= 2
        return best

    def bend(self, point):
        """Linear and quadratic phase at the end of the aperture of what the pulses have of a point. [rad]"""
        phase = np.unwrap(np.angle(self.pulses(point)))
        tau = np.linspace(-1, 1, phase.size)
        fit = np.polynomial.legendre.legfit(tau, phase, 12)
        return fit[1], 1.5 * fit[2]


@pytest.mark.parametrize("name", ["rigling_moses_section_v", "drones_same_gnss"])
def test_cphdcheck_objects_to_nothing(tmp_path, name) -> None:
    path = tmp_path / "out.cphd"
    mission = ROOT / "specs" / "missions" / f"{name}.yaml"
    path.write_bytes(export_phase_history(parse_mission(mission.read_text(), str(mission)), Targets()).data)
    assert objections(path) == {}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"scene": PLACE, "collection__center_time": "2026-06-01T05:20:31.250Z"},
        {"platforms__receiver": {"position": ["3 km", "1 km", "2 km"], "velocity": [0, 0, 0]}, "scene": PLACE},
        {"platforms__receiver__motion_error": {"vibration": {"sinusoidal": [{"amplitude": 1e-4, "frequency": 9}]}}},
        {
            "synchronization": {"method": "direct_path", "error": "1 deg"},
            "platforms__transmitter__motion_error": {"position": "1 m"},
        },
        {"simulation": {"noise": -20, "seed": 4}, "collection__pulses": 4000},
    ],
    ids=["undated", "on the Earth", "a fixed receiver", "vibrating", "direct path", "noise"],
)
def test_other_collections(tmp_path, changes) -> None:
    assert objections(exported(tmp_path, mission_text(**changes), parse_targets("grid:2x2:20 m"))) == {}


class TestBack:
    """A file gives its mission back."""

    def test_the_collection(self, tmp_path) -> None:
        changes = {
            "scene": PLACE,
            "collection__center_time": "2026-06-01T05:20:31.250Z",
            "platforms__transmitter__acceleration": [0.3, -0.2, 0.1],
            "platforms__transmitter__jerk": [0.03, 0.02, 0],
            "platforms__receiver__snap": [0.0, 0.02, 0.01],
        }
        mission = parse_mission(mission_text(**changes), "m.yaml")
        found = import_collection(str(exported(tmp_path, mission_text(**changes))))
        again = parse_mission(imported_text(found), "again.yaml")
        assert again.name == mission.name
        assert again.radar == pytest.approx(mission.radar, rel=1e-12)
        assert again.collection.aperture_time == pytest.approx(6, rel=1e-12)
        assert again.collection.center_time == mission.collection.center_time
        assert again.scene[:3] == pytest.approx(mission.scene[:3], abs=2e-10)  # a millimetre on the ground
        for name in ("transmitter", "receiver"):
            for tau in (-3.0, -1.0, 0.0, 2.0, 3.0):
                there, back = (getattr(one.geometry, name).at(tau)[0] for one in (mission, again))
                assert math.dist(there, back) < 30e-6  # a thousandth of the wavelength

    @pytest.mark.parametrize("frame", ["scene", "ric", "track"])
    def test_declared_errors(self, tmp_path, frame) -> None:
        """Along the scene's and the orbit's axes as declared; along another frame's as a covariance."""
        error = {"frame": frame, "position": [0.1, 0.2, 0.3], "velocity": [0.01, 0.02, 0.03]}
        changes = {
            "scene": PLACE,
            "platforms__receiver__motion_error": error,
            "platforms__transmitter__motion_error": {"velocity": 0.01, "acceleration": [0.001, 0, 0.002]},
            "timing_error": {"constant": "2 ns", "linear": 1e-9},
        }
        found = import_collection(str(exported(tmp_path, mission_text(**changes))))
        one = found.errors.receiver
        assert one.frame == ("ric" if frame == "ric" else "scene")
        if frame == "track":  # the receiver flies north-west, its larger error is across
            assert one.correlation[0][1] == pytest.approx((0.04 - 0.01) / (0.04 + 0.01), abs=1e-6)
        else:
            assert one.correlation == ()
            assert one.position == pytest.approx((0.1, 0.2, 0.3), rel=1e-9)
            assert one.velocity == pytest.approx((0.01, 0.02, 0.03), rel=1e-9)
        assert found.errors.transmitter.position is None
        assert found.errors.transmitter.acceleration == pytest.approx((0.001, 0, 0.002))
        assert (found.errors.timing_constant, found.errors.timing_linear) == pytest.approx((2e-9, 1e-9))
        parse_mission(imported_text(found), "again.yaml")

    def test_a_covariance(self, tmp_path) -> None:
        """It states position and velocity, and how they go together: nothing of them is said to be missing."""
        stated = {"position": [0.1, 0.2, 0.3], "velocity": [0.01, 0.02, 0.03]}
        covariance = {"covariance": {**stated, "correlation": {"position.x-velocity.y": 0.4}}}
        changes = {"scene": PLACE, "platforms__receiver__motion_error": covariance}
        one = import_collection(str(exported(tmp_path, mission_text(**changes)))).errors.receiver
        assert one.position == pytest.approx(stated["position"], rel=1e-9)
        assert one.velocity == pytest.approx(stated["velocity"], rel=1e-9)
        assert one.correlation[0][4] == pytest.approx(0.4, rel=1e-9)

    def test_a_mission_without_errors_declares_none(self, tmp_path) -> None:
        found = import_collection(str(exported(tmp_path, mission_text())))
        assert found.errors.transmitter is found.errors.receiver is found.errors.timing_linear is None

    def test_the_reference_geometry_is_that_of_the_mission(self, tmp_path) -> None:
        path = exported(tmp_path, mission_text(scene=PLACE))
        xml = Program(path).xml
        geometry = parse_mission(mission_text(), "m.yaml").geometry
        found = xml.find("{*}ReferenceGeometry/{*}Bistatic")
        assert float(found.findtext("{*}BistaticAngle")) == pytest.approx(
            math.degrees(geometry.bistatic_angle), rel=1e-6
        )
        for side, state in (("Tx", geometry.transmitter), ("Rcv", geometry.receiver)):
            assert float(found.findtext(f"{{*}}{side}Platform/{{*}}SlantRange")) == pytest.approx(
                state.slant_range, rel=1e-9
            )


class TestIndependentImage:
    def test_points_without_error_stand_where_they_are(self, tmp_path) -> None:
        """To a thousandth of a cell of half a metre; levels to a few percent, which their sidelobes make."""
        points = (Target(0, 0), Target(12, -7, -6.0), Target(-9, 11, -3.0))
        program = Program(exported(tmp_path, mission_text(scene=PLACE), Targets(points)))
        for one in points:
            assert program.peak((one.east, one.north), 0.2) == pytest.approx((one.east, one.north), abs=0.02)
            assert program.pixel((one.east, one.north)) == pytest.approx(10 ** (one.level_db / 20), rel=0.05)

    @pytest.mark.parametrize(
        ("error", "row_id"),
        [
            ({"acceleration": [0.002, 0, 0]}, "transmitter.acceleration.x"),
            ({"acceleration": [0, 0, -0.008]}, "transmitter.acceleration.z"),
            ({"velocity": [0, 0.5, 0]}, "transmitter.velocity.y"),
        ],
    )
    def test_the_phase_is_that_of_check(self, tmp_path, error, row_id) -> None:
        """At the displaced point no linear phase is left, and the quadratic one is that of the full model.

        The row's phase is signed like the range error, which the signal has with −k: a positive one bends it down.
        Tolerances: a percent of the phase for what is beyond first order; displacements to a centimetre.
        """
        changes = {"scene": PLACE, "platforms__transmitter__motion_error": error}
        program = Program(exported(tmp_path, mission_text(**changes)))
        found = row(findings(**changes), row_id)
        linear, quadratic = program.bend(found.displacement_m)
        expected = found.qpe_exact_rad if found.qpe_exact_rad is not None else found.qpe_full_rad
        assert abs(expected) > 1
        assert abs(quadratic) == pytest.approx(abs(expected), rel=0.01)
        assert quadratic * expected < 0
        # A cell is 2π of linear phase from end to end: π at the end of the aperture.
        assert abs(linear) < 0.02 * math.pi

    def test_the_displacement_is_that_of_check(self, tmp_path) -> None:
        """Position errors of both platforms move the point by metres, and leave it sharp."""
        changes = {"scene": PLACE, "platforms__transmitter__motion_error": {"position": [3.0, 0, 0]}}
        program = Program(exported(tmp_path, mission_text(**changes)))
        moved = row(findings(**changes), "transmitter.position.x").displacement_m
        assert math.hypot(*moved) > 1
        assert program.peak(moved, 0.2) == pytest.approx(moved, abs=0.02)  # a fiftieth of a cell
        assert program.pixel(moved) > 0.97
        assert program.pixel((0, 0)) < 0.3

    def test_clutter_has_the_level_that_was_asked_for(self, tmp_path) -> None:
        """Mean power of 400 pixels, exponentially distributed: 5 % of it, half as much again for the edges."""
        targets = parse_targets("0, 0, -60 dB; clutter -20 dB")
        program = Program(exported(tmp_path, mission_text(scene=PLACE), targets))
        rng = np.random.default_rng(1)
        power = np.mean([program.pixel(point) ** 2 for point in rng.uniform(-6, 6, (400, 2))])
        assert 10 * math.log10(power) == pytest.approx(-20, abs=1.0)


class TestCommand:
    def test_it_says_what_it_wrote_and_what_it_assumed(self, run, tmp_path) -> None:
        mission, output = tmp_path / "m.yaml", tmp_path / "m.cphd"
        mission.write_text(mission_text())
        result = run("simulate", mission, "-o", output, "--targets", "grid:3x3:10 m")
        assert result.exit_code == 0
        assert "9 scatterers" in result.stdout
        assert "put at 0 deg N, 0 deg E" in result.stderr
        first = output.read_bytes()
        run("simulate", mission, "-o", output, "--targets", "grid:3x3:10 m")
        assert output.read_bytes() == first
        assert b"mission SHA-256" in first

    def test_a_list_of_points(self, run, tmp_path) -> None:
        mission, output, points = tmp_path / "m.yaml", tmp_path / "m.cphd", tmp_path / "points.csv"
        mission.write_text(mission_text(scene=PLACE, collection__center_time="2026-06-01T05:20:31Z"))
        points.write_text("east [m], north [m], amplitude\n0,0,1\n\n5,-4,0.5\n")
        result = run("simulate", mission, "-o", output, "--targets", points)
        assert result.exit_code == 0
        assert result.stderr == ""
        assert "2 scatterers" in result.stdout
        assert Program(output).pixel((5, -4)) == pytest.approx(0.5, rel=0.1)

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("x,y\n", ":1: the columns must be"),
            ("east [m],north [m],amplitude\n1,2\n", ":2: '1, 2' is not three numbers"),
            ("east [m],north [m],amplitude\n1,2,0\n", ":2: the amplitude must be"),
            ("east [m],north [m],amplitude\nnan,2,1\n", ":2: a point is beyond"),
            ("", ":1: the columns"),
            (f"east [m],north [m],amplitude\n{'1' * 140_000},2,1\n", " is not CSV: field larger than"),
        ],
    )
    def test_a_list_that_is_none(self, run, tmp_path, text, said) -> None:
        mission, points = tmp_path / "m.yaml", tmp_path / "points.csv"
        mission.write_text(mission_text())
        points.write_text(text)
        result = run("simulate", mission, "-o", tmp_path / "m.cphd", "--targets", points)
        assert result.exit_code == 2
        assert said in result.stderr
        assert not (tmp_path / "m.cphd").exists()

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
    def test_a_pipe_is_no_list_of_points(self, tmp_path) -> None:
        """It was waited for without end."""
        os.mkfifo(tmp_path / "points.csv")
        with pytest.raises(ValueError, match=r"points\.csv is no regular file"):
            parse_targets(str(tmp_path / "points.csv"))

    @pytest.mark.parametrize("grid", ["grid:3:5", "grid:0x3:5", "grid:100x100:5", "grid:3x3:x", "grid:3x3:1e9"])
    def test_a_grid_that_is_none(self, grid) -> None:
        with pytest.raises(ValueError, match="grid"):
            parse_targets(grid)

    def test_too_much_is_refused_before_it_is_formed(self, run, tmp_path) -> None:
        mission, output = tmp_path / "m.yaml", tmp_path / "m.cphd"
        mission.write_text(mission_text(simulation={"memory_limit": "2 MB"}))
        result = run("simulate", mission, "-o", output)
        assert result.exit_code == 2
        assert "memory_limit" in result.stderr
        assert not output.exists()

    def test_no_picture_of_what_is_not_formed(self, run, tmp_path) -> None:
        mission = tmp_path / "m.yaml"
        mission.write_text(mission_text())
        assert run("simulate", mission, "-o", tmp_path / "m.cphd", "--plot", tmp_path / "m.png").exit_code == 2

    def test_what_is_exported_can_be_imported_and_checked(self, run, tmp_path) -> None:
        mission, output, back = tmp_path / "m.yaml", tmp_path / "m.cphd", tmp_path / "back.yaml"
        mission.write_text(mission_text(scene=PLACE, platforms__receiver__motion_error={"velocity": 0.001}))
        assert run("simulate", mission, "-o", output).exit_code == 0
        assert run("import", output, "-o", back).exit_code == 0
        assert run("check", back).exit_code == 0
        assert (
            yaml.safe_load(back.read_text())["platforms"]["receiver"]["motion_error"]["velocity"] == ["0.001 m/s"] * 3
        )

    def test_without_the_extra(self, run, tmp_path, monkeypatch) -> None:
        import sys

        mission = tmp_path / "m.yaml"
        mission.write_text(mission_text())
        monkeypatch.setitem(sys.modules, "sarkit.cphd", None)
        result = run("simulate", mission, "-o", tmp_path / "m.cphd")
        assert result.exit_code == 2
        assert "pip install sarkit" in result.stderr
