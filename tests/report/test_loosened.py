"""What a change loosens, each refused by its name, and let through by it."""

import json
import math
from pathlib import Path

import pytest
import yaml

from bisar_budget.report.change.comparison import Gate, compare
from tests.conftest import findings, mission_text
from tests.report.test_report_diff import git

ERRORS = {
    "timing_error__quadratic": 3e-13,
    "platforms__receiver__motion_error": {
        "position": "1 cm",
        "velocity": "1 mm/s",
        "vibration": {"sinusoidal": [{"amplitude": "10 um", "frequency": "20 Hz"}]},
        "source": "measured",
    },
    "platforms__transmitter__motion_error": {"position": "1 cm", "velocity": "1 mm/s"},
    "other_errors": [{"name": "ground", "quadratic_phase_error": 0.01, "source": "model"}],
    "scene__height_error": "1 m",
    "requirements": {
        "quadratic_phase_error": "45 deg",
        "cubic_phase_error": "20 deg",
        "location_error": "100 m",
        "islr": "-15 dB",
        "pslr": "-12 dB",
        "declare": ["position", "receiver.vibration", "timing"],
    },
    "allocation": {
        "split": {"transmitter": 0.3, "receiver": 0.3, "reserve": 0.4},
        "coverage_factor": 2,
        "combine": "sum",
        "model": "strictest",
    },
    "specifications": {"platforms.receiver.motion_error.velocity": "2 mm/s"},
    "autofocus": {"n_pull": 1},
    "waivers": [{"id": "other.ground", "until": "2027-01-31", "reason": "open"}],
}


def at(path: str, value: object) -> dict:
    """The same mission with a value at a path; None takes it away."""
    changed = yaml.safe_load(yaml.safe_dump(ERRORS))
    *above, last = path.split("/")
    inner = changed
    for key in above:
        inner = inner[int(key)] if isinstance(inner, list) else inner[key]
    if value is None:
        del inner[int(last) if isinstance(inner, list) else last]
    else:
        inner[last] = value
    return changed


MOTION = "platforms__receiver__motion_error"
SPECIFIED = "platforms.receiver.motion_error.velocity"
LOOSENED = [
    (f"specifications/{SPECIFIED}", "2.1 mm/s", {f"specifications.{SPECIFIED}"}),
    (f"specifications/{SPECIFIED}", None, {f"specifications.{SPECIFIED}"}),
    ("requirements/quadratic_phase_error", "46 deg", {"requirements.quadratic_phase_error"}),
    ("requirements/quadratic_phase_error", "44 deg", set()),
    ("requirements/quadratic_phase_error", "0.25 pi rad", None),
    ("requirements/cubic_phase_error", None, {"requirements.cubic_phase_error"}),
    ("requirements/cubic_phase_error", "19 deg", set()),
    ("requirements/location_error", "101 m", {"requirements.location_error"}),
    ("requirements/location_error", "0.1 km", set()),
    ("requirements/location_error", {"limit": "101 m"}, {"requirements.location_error"}),
    ("requirements/location_error", {"limit": "100 m"}, set()),
    ("requirements/islr", "-14 dB", {"requirements.islr"}),
    ("requirements/islr", "-16 dB", set()),
    ("requirements/pslr", None, {"requirements.pslr"}),
    ("requirements/declare", ["position", "timing"], {"requirements.declare.receiver.vibration"}),
    (
        "requirements/declare",
        ["receiver.position", "receiver.vibration", "timing"],
        {"requirements.declare.position"},
    ),
    (
        "requirements/declare",
        ["transmitter.position", "receiver.position", "receiver.vibration", "timing", "receiver.velocity"],
        set(),
    ),
    ("allocation/coverage_factor", 1.9, {"allocation.coverage_factor"}),
    ("allocation/coverage_factor", 2.1, set()),
    ("allocation/coverage_factor", None, {"allocation.coverage_factor"}),
    ("allocation/warn_above", 0.9, {"allocation.warn_above"}),
    ("allocation/warn_above", 0.7, set()),
    ("allocation/combine", "rss", {"allocation.combine"}),
    ("allocation/model", "full", {"allocation.model"}),
    ("allocation/model", "published", {"allocation.model"}),
    ("autofocus/n_pull", 1.1, {"autofocus.n_pull"}),
    ("autofocus/n_pull", 0.9, set()),
    ("waivers/0/until", "2027-02-01", {"other.ground"}),
    ("waivers/0/until", "2027-01-30", set()),
    ("waivers/0/id", "transmitter.*", {"transmitter.*"}),
    ("waivers/0/reason", "still open", set()),
    (f"{MOTION}/velocity", None, {"receiver.velocity"}),
    (f"{MOTION}/velocity", "2 mm/s", set()),
    # The same sizes along other axes: each row stays, what they make at their worst signs falls.
    (
        f"{MOTION}/frame",
        "track",
        {
            "receiver.quadratic_phase_error",
            *(f"mission.{sum}" for sum in ("quadratic_phase_error", "cubic_phase_error", "location_error")),
            "mission.autofocus_pull_in",
        },
    ),
    (f"{MOTION}/vibration", None, {"receiver.vibration.sinusoidal.0"}),
    (
        f"{MOTION}/source",
        None,
        {"receiver.position.source", "receiver.velocity.source", "receiver.vibration.source"},
    ),
    ("other_errors/0", None, {"other.ground"}),
    ("other_errors/0/source", None, {"other.ground.source"}),
    ("other_errors/0/quadratic_phase_error", 0, {"other.ground"}),
    ("other_errors/0/quadratic_phase_error", 1e-3, {"other.ground"}),
    (f"{MOTION}/velocity", 0, {"receiver.velocity"}),
    (f"{MOTION}/velocity", ["1 mm/s", 0, 0], {"receiver.velocity.y", "receiver.velocity.z"}),
    (f"{MOTION}/velocity", ["0.1 cm/s"] * 3, set()),
    (f"{MOTION}/vibration/sinusoidal/0/amplitude", 0, {"receiver.vibration.sinusoidal.0"}),
    ("timing_error__quadratic", 0, {"timing.quadratic"}),
    ("scene__height_error", 0, {"mission.terrain"}),
    ("requirements/quadratic_phase_error", f"{math.pi / 4!r} rad", set()),
    ("requirements/quadratic_phase_error", None, set()),
    ("scene__height_error", None, {"mission.terrain"}),
    ("timing_error__quadratic", None, {"timing.quadratic"}),
]


@pytest.mark.parametrize(("path", "value", "ids"), [one for one in LOOSENED if one[2] is not None])
def test_what_is_loosened_has_a_name(path: str, value: object, ids: set[str]) -> None:
    result = compare(findings(**ERRORS), findings(**at(path, value)))
    assert {one.id for one in result.loosened} == ids
    refused = {one.id for one in result.refusals(Gate(1.0))}
    assert ids <= refused


@pytest.mark.parametrize(("path", "value", "ids"), [one for one in LOOSENED if one[2]])
def test_the_other_way_round_it_loosens_nothing(path: str, value: object, ids: set[str]) -> None:
    result = compare(findings(**at(path, value)), findings(**ERRORS))
    assert not ids.intersection(one.id for one in result.loosened)


def test_a_narrower_waiver_is_not_new() -> None:
    wide = {**ERRORS, "waivers": [{"id": "receiver.*", "until": "2027-01-31", "reason": "open"}]}
    for id, is_loosened in (
        ("receiver.velocity.y", False),
        ("receiver.v*", False),
        ("receiver.velocity.?", False),
        ("receiver.[v]*", True),
        ("receive*", True),
        ("transmitter.velocity.y", True),
    ):
        narrow = {**ERRORS, "waivers": [{"id": id, "until": "2027-01-31", "reason": "open"}]}
        ids = [one.id for one in compare(findings(**wide), findings(**narrow)).loosened]
        assert ids == ([id] if is_loosened else [])


def test_a_pattern_is_no_part_of_one_with_other_wildcards() -> None:
    """Of `?` and `[…]` in the old waiver nothing is concluded: `receiver.velocity.??` would match its `*` as text."""
    for old, new in (("receiver.velocity.?", "receiver.velocity.*"), ("receiver.[!t]*", "receiver.*")):
        before, after = (
            findings(**{**ERRORS, "waivers": [{"id": id, "until": "2027-01-31", "reason": "open"}]})
            for id in (old, new)
        )
        assert [one.id for one in compare(before, after).loosened] == [new]


def test_an_error_without_a_source_may_be_added_and_one_that_had_it_keeps_it() -> None:
    """Of several errors of one kind, one without a source hid what another lost, and a new one was refused."""
    named = [{"name": name, "quadratic_phase_error": 0.01} for name in ("a", "b")]
    sourced = [{**one, "source": "report"} for one in named]
    noise = [{"name": name, "sigma": "1 um", "correlation_time": "1 s"} for name in ("a", "b")]
    heard = [{**one, "source": "report"} for one in noise]
    key = "platforms__receiver__motion_error__random"
    for before, after, ids in (
        ({"other_errors": [sourced[0], named[1]]}, {"other_errors": named}, ["other.a.source"]),
        ({"other_errors": sourced[:1]}, {"other_errors": [sourced[0], named[1]]}, []),
        ({key: [heard[0], noise[1]]}, {key: noise}, ["receiver.random.a.source"]),
        ({key: heard[:1]}, {key: [heard[0], noise[1]]}, []),
    ):
        assert [one.id for one in compare(findings(**before), findings(**after)).loosened] == ids


def test_an_inertial_sensor_of_the_catalogue_has_its_source() -> None:
    """A part states the source of its figures; figures of the file in its place may have none."""
    figures = {"accelerometer_bias": "10 ug", "gyro_bias": "0.1 deg/h"}
    figures |= {"velocity_random_walk": "1e-4 m/s/sqrt(h)", "angle_random_walk": "0.01 deg/sqrt(h)"}
    key = "platforms__receiver__motion_error"
    part = findings(**{key: {"sensor": "stim300"}})
    own = findings(**{key: {"imu": figures}})
    assert part.kinds.without_source == ()
    smaller = {f"receiver.imu.{one}" for one in ("velocity_random_walk", "angle_random_walk", "gyro_bias")}
    assert {one.id for one in compare(part, own).loosened} == {"receiver.imu.source", *smaller}
    assert not compare(own, part).loosened
    beside = findings(**{key: {"sensor": "stim300", "imu": {"attitude": "0.01 deg"}}})
    assert beside.kinds.without_source == ("receiver.imu",)


def test_a_waived_row_that_breaks_its_limit_by_more() -> None:
    """A waiver was granted for the row as it stood; it let any growth through."""
    waiver = {"waivers": [{"id": "timing.*", "until": "2027-01-31", "reason": "open"}]}
    limit = next(row.allowable for row in findings(**waiver).rows if row.id == "timing.quadratic")
    before, near, far, less = (
        findings(**waiver, timing_error__quadratic=use * limit) for use in (1.5, 1.64, 1.66, 1.1)
    )
    assert not compare(before, near).refusals(Gate(0.1))
    (refused,) = compare(before, less).refusals(Gate(0.1))
    assert refused[:2] == ("timing.quadratic", "uses 150 % of its limit -> 110 %, with the same part and source")
    (refused,) = compare(before, far).refusals(Gate(0.1))
    assert refused[:2] == ("timing.quadratic", "had used up its limit and uses more: 150 % -> 166 %")


def test_a_row_that_an_old_waiver_keeps_from_failing() -> None:
    waiver = {"waivers": [{"id": "timing.*", "until": "2027-01-31", "reason": "open"}]}
    before = findings(**waiver, timing_error__quadratic=3e-13)
    result = compare(before, findings(**waiver, timing_error__quadratic=1e-11))
    assert "timing.quadratic" in {one.id for one in result.loosened}
    assert not compare(before, before).loosened


def test_each_split_has_its_reserve() -> None:
    split = {"quadratic_phase_error": "equal", "pslr": "equal", "islr": {"transmitter": 0.5, "receiver": 0.5}}
    loosened = compare(findings(**ERRORS), findings(**at("allocation/split", split))).loosened
    reserves = {f"allocation.split.{metric}.reserve" for metric in ("quadratic_phase_error", "pslr", "islr")}
    assert {one.id for one in loosened} == reserves


def test_a_share_may_grow_by_what_its_reserve_gave() -> None:
    """What one platform gives, the other may err by: with a quiet receiver that was free."""
    split = {"transmitter": 0.35, "receiver": 0.35, "clock": 0.1, "reserve": 0.2}
    name = "allocation.split.quadratic_phase_error"
    for change, ids in (
        ({"transmitter": 0.6, "receiver": 0.1}, {"transmitter"}),
        ({"transmitter": 0.45, "reserve": 0.1}, {"reserve"}),
        ({"transmitter": 0.46, "receiver": 0.34, "reserve": 0.1}, {"reserve", "transmitter"}),
        ({"clock": 0.2, "receiver": 0.25}, {"clock"}),
        ({"reserve": 0.3, "receiver": 0.25}, set()),
        ({}, set()),
    ):
        before, after = (
            findings(**at("allocation/split", {"quadratic_phase_error": one})) for one in (split, split | change)
        )
        assert {one.id for one in compare(before, after).loosened} == {f"{name}.{id}" for id in ids}


def test_shares_that_follow_the_errors_are_no_change_of_the_split() -> None:
    before, after = (
        findings(**{**at("timing_error__quadratic", size), "allocation": {"split": "balanced"}})
        for size in (2.5e-13, 3e-13)
    )
    assert before.allocation.qpe.transmitter > after.allocation.qpe.transmitter
    assert not compare(before, after).loosened


def test_a_default_is_said_in_degrees() -> None:
    before, after = findings(requirements={"quadratic_phase_error": "30 deg"}), findings()
    (loosened,) = compare(before, after).loosened
    assert loosened.words == "30 deg -> 45 deg (default)"


def test_allow_names_an_id_a_pattern_or_one_of_a_file() -> None:
    result = compare(findings(**ERRORS), findings(**at("requirements/islr", None)))
    file = result.after.file
    for allowed in ("requirements.islr", "requirements.*", f"{file}:requirements.islr"):
        refusals = {one.id: one.is_allowed for one in result.refusals(Gate(1.0, (allowed,)))}
        assert refusals["requirements.islr"], allowed
    for allowed in ("requirements", "islr", "other.yaml:requirements.islr", "Requirements.islr"):
        refusals = {one.id: one.is_allowed for one in result.refusals(Gate(1.0, (allowed,)))}
        assert not refusals["requirements.islr"], allowed


class TestCommand:
    @pytest.fixture
    def project(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        """A repository: a mission whose parts, log and settings stand beside it, with a catalogue of its own."""
        (tmp_path / "missions" / "parts").mkdir(parents=True)
        (tmp_path / "sensors").mkdir()
        part = "kind: imu\nname: unit\naccelerometer_bias: 100 ug\nsource: sheet\n"
        (tmp_path / "sensors" / "unit.yaml").write_text(part)
        (tmp_path / "missions" / "parts" / "near.yaml").write_text(part.replace("100 ug", "50 ug"))
        (tmp_path / "pyproject.toml").write_text('[tool.bisar-budget]\nsensors = ["sensors"]\nstrict = true\n')
        for name, sensor in (("m", "unit"), ("n", "parts/near.yaml")):
            text = mission_text(platforms__receiver__motion_error={"sensor": sensor}, allocation={"combine": "rss"})
            (tmp_path / "missions" / f"{name}.yaml").write_text(text)
        git(tmp_path, "init", "-q")
        commit(tmp_path)
        monkeypatch.chdir(tmp_path)
        return tmp_path

    def diff(self, run, *arguments: str) -> tuple[int, dict]:
        done = run(
            "diff", *arguments, "--base", "HEAD", "--fail-on-erosion", "10%", "--format", "json",
        )  # fmt: skip
        return done.exit_code, json.loads(done.stdout)

    @pytest.mark.parametrize(
        ("part", "mission"),
        [("sensors/unit.yaml", "missions/m.yaml"), ("missions/parts/near.yaml", "missions/n.yaml")],
    )
    def test_a_part_is_that_of_the_revision(self, run, project: Path, part: str, mission: str) -> None:
        """A part of the catalogue that went from 100 to 600 ug changed no row: both sides read the new one."""
        file = project / part
        old = "100 ug" if "unit" in part else "50 ug"
        file.write_text(file.read_text().replace(old, "600 ug"))
        code, document = self.diff(run, mission)
        assert code == 1
        (change,) = document["missions"]
        key = "platforms.receiver.motion_error.imu.accelerometer_bias"
        name = "unit" if "unit" in part else "parts/near.yaml"
        expected = {"key": key, "before": f"{old} (part {name})", "after": f"600 ug (part {name})"}
        assert change["inputs"] == [expected]
        row = next(one for one in change["rows"] if one["id"] == "receiver.imu.accelerometer_bias")
        ratio = row["after"]["declared"] / row["before"]["declared"]
        assert ratio == pytest.approx(600 / float(old.split()[0]), rel=1e-12)

    def test_a_catalogue_folder_is_that_of_the_revision(self, run, project: Path) -> None:
        """The settings of then name the folder of then."""
        (project / "louder").mkdir()
        part = (project / "sensors" / "unit.yaml").read_text().replace("100 ug", "600 ug")
        (project / "louder" / "unit.yaml").write_text(part)
        settings = project / "pyproject.toml"
        settings.write_text(settings.read_text().replace('["sensors"]', '["louder"]'))
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 1
        assert document["missions"][0]["inputs"][0]["before"] == "100 ug (part unit)"
        assert not document["settings"]

    def test_a_part_that_only_the_revision_has(self, run, project: Path) -> None:
        text = (project / "sensors" / "unit.yaml").read_text().replace("100 ug", "90 ug")
        (project / "sensors" / "other.yaml").write_text(text)
        (project / "sensors" / "unit.yaml").unlink()
        mission = project / "missions" / "m.yaml"
        mission.write_text(mission.read_text().replace("sensor: unit", "sensor: other"))
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 0
        assert document["missions"][0]["inputs"][-1]["before"] == "100 ug (part unit)"

    def test_a_catalogue_in_a_submodule_is_that_of_its_commit(self, run, project: Path, tmp_path_factory) -> None:
        other = tmp_path_factory.mktemp("catalogue")
        text = (project / "sensors" / "unit.yaml").read_text()
        (other / "unit.yaml").write_text(text)
        git(other, "init", "-q")
        commit(other)
        git(project, "rm", "-q", "-r", "sensors")
        git(project, "-c", "protocol.file.allow=always", "submodule", "add", "-q", str(other), "sensors")
        commit(project)
        inside = project / "sensors" / "unit.yaml"
        inside.write_text(text.replace("100 ug", "600 ug"))
        commit(project / "sensors")
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 1
        assert document["missions"][0]["inputs"][0]["before"] == "100 ug (part unit)"

    def test_a_link_that_came_since_is_not_followed_then(self, run, project: Path) -> None:
        (project / "sensors").rename(project / "moved")
        (project / "sensors").symlink_to("moved")
        part = project / "moved" / "unit.yaml"
        part.write_text(part.read_text().replace("100 ug", "600 ug"))
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 1
        assert document["missions"][0]["inputs"][0]["before"] == "100 ug (part unit)"

    def test_a_file_outside_of_the_repository_is_said(self, run, project: Path, tmp_path_factory) -> None:
        shared = tmp_path_factory.mktemp("shared")
        (project / "sensors" / "unit.yaml").rename(shared / "unit.yaml")
        (project / "pyproject.toml").write_text(f'[tool.bisar-budget]\nsensors = ["{shared}"]\n')
        commit(project)
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 0
        assert document["outside_repository"] == [str(shared / "unit.yaml")]
        said = run("diff", "missions/m.yaml", "--base", "HEAD").stdout
        assert "is outside of the repository; before and after it is read as it is now" in " ".join(said.split())

    @pytest.mark.parametrize("pattern", ["missions/*.yaml", "missions/m.yaml", "**/[ml].yaml"])
    def test_a_mission_file_that_is_gone(self, run, project: Path, pattern: str) -> None:
        (project / "missions" / "m.yaml").rename(project / "missions" / "l.yml")
        code, document = self.diff(run, pattern)
        assert code == 1
        assert document["gone"] == ["missions/m.yaml"]
        assert self.diff(run, pattern, "--allow", "missions/m.yaml")[0] == 0
        (project / "missions" / "l.yml").rename(project / "missions" / "l.yaml")
        assert self.diff(run, "missions/*.yaml")[1]["new"] == ["missions/l.yaml"]

    def test_gone_from_another_folder(self, run, project: Path, monkeypatch) -> None:
        (project / "missions" / "m.yaml").unlink()
        monkeypatch.chdir(project / "sensors")
        assert self.diff(run, "../missions/[mx].yaml")[1]["gone"] == ["missions/m.yaml"]
        assert self.diff(run, str(project / "missions" / "m.yaml"))[1]["gone"] == ["missions/m.yaml"]

    @pytest.mark.parametrize(
        ("line", "id"),
        [
            ("", "tool.bisar-budget.strict"),
            ("strict = false", "tool.bisar-budget.strict"),
            ("strict = true\nexit-zero = true", "tool.bisar-budget.exit-zero"),
        ],
    )
    def test_settings_of_the_gate(self, run, project: Path, line: str, id: str) -> None:
        settings = project / "pyproject.toml"
        settings.write_text(settings.read_text().replace("strict = true", line))
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 1
        assert [one["id"] for one in document["refused"]] == [id]
        assert self.diff(run, "missions/m.yaml", "--allow", id)[0] == 0

    def test_the_model_of_the_settings(self, run, project: Path) -> None:
        """What `check` takes from the settings is what the comparison judges by."""
        settings = project / "pyproject.toml"
        settings.write_text(settings.read_text() + 'model = "full"\n')
        commit(project)
        settings.write_text(settings.read_text().replace("full", "published"))
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 1
        assert {"id": "allocation.model", "before": "full", "after": "published"} in document["missions"][0][
            "loosened"
        ]

    def test_settings_with_no_such_model_are_2(self, run, project: Path) -> None:
        """A file without an `allocation` took the word as its model: a fault of the tool."""
        mission = project / "missions" / "bare.yaml"
        mission.write_text(mission_text().partition("allocation:")[0])
        settings = project / "pyproject.toml"
        settings.write_text(settings.read_text() + 'model = "foo"\n')
        done = run("diff", mission, mission)
        assert done.exit_code == 2
        assert "tool.bisar-budget.model: 'foo' is not one of 'published', 'full', 'strictest'" in done.stderr
        commit(project)
        settings.write_text(settings.read_text().replace("foo", "full"))
        assert run("diff", "missions/m.yaml", "--base", "HEAD").exit_code == 2

    def test_settings_are_those_nearest_to_the_mission(self, run, project: Path, monkeypatch) -> None:
        """From another folder too: those of the current folder were taken."""
        nearest = project / "missions" / "pyproject.toml"
        nearest.write_text('[tool.bisar-budget]\nmodel = "full"\nstrict = true\nsensors = ["../sensors"]\n')
        commit(project)
        nearest.write_text(nearest.read_text().replace("full", "published").replace("true", "false"))
        for folder in (project, project.parent):
            monkeypatch.chdir(folder)
            code, document = self.diff(run, str(project / "missions" / "m.yaml"))
            assert code == 1
            assert [one["id"] for one in document["settings"]] == ["tool.bisar-budget.strict"]
            loosened = document["missions"][0]["loosened"]
            assert {"id": "allocation.model", "before": "full", "after": "published"} in loosened

    def test_a_nearer_table_that_came_is_a_change(self, run, project: Path) -> None:
        (project / "missions" / "pyproject.toml").write_text('[tool.bisar-budget]\nsensors = ["../sensors"]\n')
        code, document = self.diff(run, "missions/m.yaml")
        assert code == 1
        assert [one["id"] for one in document["settings"]] == ["tool.bisar-budget.strict"]

    def test_two_files_of_two_projects(self, run, project: Path) -> None:
        """Each is judged by its own model, and a second project that is less strict loosens."""
        (project / "other").mkdir()
        other = project / "other" / "m.yaml"
        other.write_text((project / "missions" / "m.yaml").read_text())
        settings = project / "other" / "pyproject.toml"
        settings.write_text('[tool.bisar-budget]\nstrict = true\nsensors = ["../sensors"]\n')
        pair = ("diff", "missions/m.yaml", "other/m.yaml", "--fail-on-erosion", "10%")
        assert run(*pair).exit_code == 0
        settings.write_text(settings.read_text().replace("true", "false"))
        assert run(*pair).exit_code == 1

    def test_what_is_let_through_is_said(self, run, project: Path) -> None:
        mission = project / "missions" / "m.yaml"
        mission.write_text(mission.read_text() + "autofocus: { n_pull: 1 }\n")
        common = ("diff", "missions/m.yaml", "--base", "HEAD", "--fail-on-erosion", "100%")
        refused, allowed = run(*common), run(*common, "--allow", "autofocus.n_pull", "--allow", "nothing.such")
        assert (refused.exit_code, allowed.exit_code) == (1, 0)
        assert "Refused\n  autofocus.n_pull: none -> 1\n" in refused.stdout
        assert "Let through by --allow\n  autofocus.n_pull: none -> 1\n" in allowed.stdout
        assert "--allow nothing.such: lets nothing through" in allowed.stdout
        markdown = run(*common, "--allow", "autofocus.n_pull", "--format", "markdown").stdout
        _, _, let_through = markdown.partition("#### Let through by --allow")
        assert "- autofocus.n_pull: none → 1" in let_through.splitlines()

    def test_allow_needs_a_gate(self, run, project: Path) -> None:
        done = run("diff", "missions/m.yaml", "--base", "HEAD", "--allow", "x")
        assert done.exit_code == 2
        assert "--allow is for --fail-on-erosion" in done.stderr

    def test_standard_input_has_no_revision(self, run, project: Path) -> None:
        done = run("diff", "-", "--base", "HEAD")
        assert done.exit_code == 2
        assert "standard input is in no revision" in done.stderr

    def test_a_name_that_is_nowhere(self, run, project: Path) -> None:
        done = run("diff", "missions/none.yaml", "missions/x*.yaml", "--base", "HEAD", "--fail-on-erosion", "0")
        assert done.exit_code == 2
        assert done.stdout == ""
        assert "missions/none.yaml" in done.stderr


def commit(folder: Path) -> None:
    git(folder, "add", "-A")
    git(folder, "-c", "user.name=t", "-c", "user.email=t@example.org", "commit", "-q", "-m", "x")


SURE = {"limit": "100 m", "confidence": "95 %"}


@pytest.mark.parametrize(
    ("location", "texts"),
    [
        (SURE | {"confidence": "90 %"}, ("95 %", "90 %")),
        ("100 m", ("95 %", "none")),
        (SURE | {"confidence": "0.95"}, None),
        (SURE | {"confidence": "99 %"}, None),
    ],
)
def test_a_lower_confidence(location, texts) -> None:
    changes = {name: value for name, value in ERRORS.items() if name not in ("allocation", "requirements")}
    before, after = (findings(**changes, requirements={"location_error": limit}) for limit in (SURE, location))
    loosened = [
        entry for entry in compare(before, after).loosened if entry.id == "requirements.location_error.confidence"
    ]
    assert [(entry.before, entry.after) for entry in loosened] == ([] if texts is None else [texts])
