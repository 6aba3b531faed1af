"""The file of a part: its schema, its check, and that both say what a mission says of it."""

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from click.testing import Result
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.faults import MissionError
from bisar_budget.mission.instruments import OSCILLATOR_NOISE_FORMS
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.parts import (
    FIGURES,
    PART_SECTIONS,
    PartError,
    catalogue,
    folders,
    part_schema,
    read_entry,
)
from bisar_budget.mission.tree import MAX_BYTES
from tests.acceptance.test_missions import _Core
from tests.conftest import ROOT, mission_text

Run = Callable[..., Result]
VALIDATOR = jsonschema.Draft7Validator(part_schema())
BUNDLED = sorted(map(Path, catalogue(folders("")).values()))
PAGE = (ROOT / "docs" / "reference" / "part-file.md").read_text(encoding="utf-8")
EXAMPLES = dict(re.findall(r"(?ms)^```\{code-block\} yaml\n:caption: (\S+)\n\n(.*?)^```", PAGE))

IMU = "kind: imu\nname: x\nsource: y\ngyro_bias: 1 deg/h\n"
GNSS = "kind: gnss\nname: x\nsource: y\nposition: 1 m\n"
CLOCK = "kind: oscillator\nname: x\nsource: y\nallan_deviation: {1 s: 1e-11}\n"
NOISE = "random: [{name: a, sigma: 1 m, correlation_time: 1 s}, {name: %s, sigma: 0, correlation_time: 1 s}]\n"
MASK = "phase_noise: {1 Hz: -80 dBc/Hz, 10 Hz: -100 dBc/Hz}\n"
GOOD = {
    "imu": IMU,
    "three axes": IMU.replace("1 deg/h", "[1 deg/h, 0, 2 deg/h]"),
    "a zero beside a figure": IMU + "attitude: 0\n",
    "a name of digits": IMU.replace("name: x", "name: 1790"),
    "a source of each": IMU.replace("source: y", "source: {gyro_bias: y, attitude: z}"),
    "an empty list without a source": GNSS.replace("source: y", "source: {position: y}") + "random: []\n",
    "gnss": GNSS,
    "random alone": GNSS.replace("position: 1 m\n", NOISE % "b"),
    "oscillator": CLOCK,
    "a mask": CLOCK.replace("allan_deviation: {1 s: 1e-11}\n", "frequency: 10 MHz\n" + MASK),
    "a power law": CLOCK.replace("allan_deviation: {1 s: 1e-11}", "power_law: {h0: 1e-22}"),
}
# Broken files, each with what is said of it. Of those in the second table a schema can know.
BROKEN = {
    "a wrong unit": (IMU.replace("1 deg/h", "1 mg"), "f.yaml:4:12: gyro_bias: must be an angular rate, but 'mg'"),
    "no unit": (IMU + "attitude: 0.1 rd\n", "f.yaml:5:11: attitude: has the unknown unit 'rd'"),
    "negative": (GNSS.replace("1 m", "[1 m, x, 1 m]"), "f.yaml:4:17: position[1]: "),
    "zeros alone": (IMU.replace("1 deg/h", "0"), "f.yaml:1:1: states no figure; accepted: one of accelerometer_bias"),
    "random of zero": (
        "kind: gnss\nname: x\nsource: y\nrandom: [{name: a, sigma: 0, correlation_time: 1 s}]\n",
        "f.yaml:1:1: states no figure; accepted: one of position, velocity, random that is not zero",
    ),
    "two of a name": (GNSS + NOISE % "a", "f.yaml:5:63: random[1].name: is the name of an earlier error (got a)"),
    "a coefficient of zero": (
        CLOCK.replace("allan_deviation: {1 s: 1e-11}", "power_law: {h0: 0}"),
        "that is not zero",
    ),
    "a slope": (
        CLOCK.replace("allan_deviation: {1 s: 1e-11}", "frequency: 1 MHz\n" + MASK.replace("-80", "-20")),
        "dB a decade",
    ),
    "a blank name": (IMU.replace("name: x", "name: ' '"), "f.yaml:2:7: name: must not be empty"),
    "a NUL": (IMU.replace("name: x", r'name: "\0"'), "f.yaml:2:7: name: must be one line of printable text"),
    "two documents": (IMU + "---\n" + IMU, "f.yaml:5:1: has a second YAML document; accepted: one part in a file"),
    "an alias": (IMU + "says: *y\n", "f.yaml:5:7: says: is an alias (*); write the value out"),
    "a key twice": (
        IMU + "name: z\n",
        "f.yaml:5:1: name: is a duplicate key; the first is in line 2; accepted: each key once",
    ),
    "no YAML": ("kind: [imu\n", "f.yaml:2:1: is not valid YAML"),
    "nothing": ("# nothing\n", "f.yaml: is empty. A part begins with kind: imu, kind: gnss or kind: oscillator"),
    "binary": ("\x00\x01", "f.yaml:1: is not a text file"),
    "too large": (IMU + "#" * MAX_BYTES, "f.yaml: is larger than 1024 KiB, so no part file"),
}
SCHEMA_SEES = {
    "an unknown key": (
        IMU + "gyro_bais: 1 deg/h\n",
        "f.yaml:5:1: gyro_bais: is not a known key; accepted: kind, name,",
    ),
    "a key of another kind": (IMU + MASK, "f.yaml:5:1: phase_noise: is not a known key"),
    "no kind": (
        IMU.replace("kind: imu\n", ""),
        "f.yaml:1:1: kind: must be one of imu, gnss, oscillator, and is missing. Its figures are those of kind: imu",
    ),
    "another kind": (
        IMU.replace("imu", "gyro"),
        "f.yaml:1:7: kind: must be one of imu, gnss, oscillator (got gyro). ",
    ),
    "a list of kinds": (
        IMU.replace("imu", "[imu]"),
        "f.yaml:1:7: kind: must be one of imu, gnss, oscillator. Its figures",
    ),
    "a kind misspelt": (
        "kind: gns\nname: x\n",
        "kind: must be one of imu, gnss, oscillator (got gns). Did you mean 'gnss'?",
    ),
    "a mission": (mission_text(), "This seems to be a mission file, which `bisar-budget check` reads"),
    "no name": (IMU.replace("name: x\n", ""), "f.yaml:1:1: name: is missing"),
    "no source": (IMU.replace("source: y\n", ""), "f.yaml:1:1: source: is missing"),
    "a source of another": (
        IMU.replace("source: y", "source: {gyro_bais: y}"),
        "f.yaml:3:9: source: says nothing of gyro_bias; accepted: one for every figure. Did you mean 'gyro_bias'?",
    ),
    "a long name": (IMU.replace("name: x", f"name: {'x' * 501}"), "must be at most 500 characters, has 501"),
    "no figure": ("kind: imu\nname: x\nsource: y\n", "f.yaml:1:1: states no figure"),
    "no noise": (
        "kind: oscillator\nname: x\nsource: y\nfrequency: 1 MHz\n",
        "f.yaml:1:1: says nothing of its noise; accepted: one of phase_noise, allan_deviation, power_law",
    ),
    "an empty list": (GNSS.replace("position: 1 m", "random: []"), "f.yaml:1:1: states no figure"),
    "two components": (GNSS.replace("1 m", "[1 m, 1 m]"), "f.yaml:4:11: position: must be three components, 2 given"),
    "an angle without a unit": (IMU + "attitude: 0.05\n", "f.yaml:5:11: attitude: has no unit (got 0.05)"),
    "two forms": (CLOCK + "power_law: {h0: 1e-22}\n", "f.yaml:5:12: power_law: stands beside allan_deviation"),
    "a mask without a frequency": (CLOCK.replace("allan_deviation: {1 s: 1e-11}\n", MASK), "frequency: is missing"),
    "a mask of one point": (
        CLOCK.replace("allan_deviation: {1 s: 1e-11}", "phase_noise: {1 Hz: -80 dBc/Hz}"),
        "2 to 100",
    ),
    "no coefficient": (
        CLOCK.replace("allan_deviation: {1 s: 1e-11}", "power_law: {}"),
        "power_law: must be a mapping",
    ),
    "random without a time": (
        GNSS + "random: [{name: a, sigma: 1 m}]\n",
        "f.yaml:5:10: random[0].correlation_time: is",
    ),
    "no mapping": ("- kind: imu\n", "f.yaml: is not a mapping of keys to values. A part begins with kind: imu"),
}
ALL_BROKEN = BROKEN | SCHEMA_SEES


# Values of each figure that are right, and those that may stand in the place of any value.
RIGHT = {
    "accelerometer_bias": ["1 mg", "[1 ug, 0, 2 ug]"],
    "accelerometer_scale_factor": ["300 ppm", "[0.1 %, 0, 1e-4]"],
    "attitude": ["0.1 deg", "[1 mrad, 1 mrad, 0]"],
    "gyro_bias": ["1 deg/h"],
    "velocity_random_walk": ["0.1 m/s/sqrt(h)", "50 ug/sqrt(Hz)"],
    "angle_random_walk": ["0.1 deg/sqrt(h)"],
    "position": ["1", "[1 cm, 1 cm, 2 cm]"],
    "velocity": ["3 cm/s"],
    "random": ["[{name: a, sigma: 1 m, correlation_time: 1 s}]"],
    "frequency": ["10 MHz", "1e7"],
    "phase_noise": ["{1 Hz: -80 dBc/Hz, 10 Hz: -100 dBc/Hz}"],
    "allan_deviation": ["{1 s: 1e-11}"],
    "power_law": ["{h0: 1e-22}", "{h-1: 1e-22, h2: 0}"],
}
ANY = [value for values in RIGHT.values() for value in values]
ANY += ["0", "-1", "0.1", "x", "' '", "~", "[]", "{}", "[1 m]", "[0, 0, 0]", "{h0: 0}", "{gyro_bias: y, position: z}"]
ANY += ["imu", "oscillator", "[{name: a, sigma: 0, correlation_time: 1 s}]", "{1 Hz: 0 dBc/Hz, 10 Hz: 60 dBc/Hz}"]


@st.composite
def files(draw: st.DrawFn, *, changed: bool = True) -> str:
    """Text of a part's file that is right, with one key changed, added or removed if `changed`."""
    kind = draw(st.sampled_from(list(PART_SECTIONS)))
    figures = draw(st.sets(st.sampled_from(FIGURES[kind]), min_size=1))
    if kind == "oscillator":
        figures = {"frequency", draw(st.sampled_from(OSCILLATOR_NOISE_FORMS))}
    each = f"{{{', '.join(f'{figure}: y' for figure in sorted(figures))}}}"
    file = {"kind": kind, "name": "x", "source": draw(st.sampled_from(["y", each]))}
    file |= {figure: draw(st.sampled_from(RIGHT[figure])) for figure in sorted(figures)}
    if changed:
        key = draw(st.sampled_from([*file, *RIGHT, "says", "extra"]))
        file[key] = draw(st.sampled_from(ANY))
        if draw(st.booleans()):
            del file[key]
    return "".join(f"{key}: {value}\n" for key, value in file.items())


def schema_takes(text: str) -> bool:
    return not list(VALIDATOR.iter_errors(yaml.load(text, Loader=_Core)))


def mission_says(file: Path) -> str:
    """Faults of a mission that names the part, each way that a part can be named; empty if one of them is taken."""
    mission = file.parent / "mission.yaml"
    said = []
    for place in ("motion_error", "oscillator"):
        mission.write_text(mission_text(**{f"platforms__receiver__{place}": {"sensor": file.name}}), encoding="utf-8")
        try:
            load_mission(str(mission))
            return ""
        except MissionError as error:
            said += error.lines()
    return "\n".join(said)


def written(folder: Path, text: str) -> Path:
    file = folder / "f.yaml"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    return file


class TestSchema:
    def test_is_a_draft_7_schema_with_a_name(self) -> None:
        schema = part_schema()
        jsonschema.Draft7Validator.check_schema(schema)
        assert (schema["$id"], schema["title"]) == ("urn:bisar-budget:schema:part", "bisar-budget part file")
        assert len(schema["oneOf"]) == len(PART_SECTIONS)

    def test_every_key_is_described(self) -> None:
        for section in part_schema()["definitions"].values():
            assert section["description"]
        for kind, section in PART_SECTIONS.items():
            definition = part_schema()["definitions"][section.kind.__name__]
            beside = {"kind", "name", "source", "says"} | ({"in_orbit"} if kind in ("imu", "gnss") else set())
            assert definition["properties"].keys() == {*beside, *FIGURES[kind]}
            assert all(one["description"] for one in definition["properties"].values())

    @pytest.mark.parametrize("file", BUNDLED, ids=lambda file: file.stem)
    def test_takes_every_part_of_the_catalogue(self, file: Path) -> None:
        VALIDATOR.validate(yaml.load(file.read_text(encoding="utf-8"), Loader=_Core))

    @pytest.mark.parametrize("text", GOOD.values(), ids=GOOD)
    def test_takes_what_the_tool_takes(self, text: str) -> None:
        VALIDATOR.validate(yaml.load(text, Loader=_Core))

    @pytest.mark.parametrize("text", [text for text, _ in SCHEMA_SEES.values()], ids=SCHEMA_SEES)
    def test_refuses_what_a_schema_can_see(self, text: str) -> None:
        assert not schema_takes(text)

    def test_the_command_prints_it(self, run: Run, tmp_path: Path) -> None:
        done = run("schema", "--part")
        assert (done.exit_code, json.loads(done.stdout)) == (0, part_schema())
        file = tmp_path / "part.schema.json"
        assert run("schema", "--part", "-o", str(file)).exit_code == 0
        assert file.read_text(encoding="utf-8") == done.stdout
        assert json.loads(run("schema").stdout)["title"] == "bisar-budget mission file"


class TestExamples:
    """The examples of the page; its build runs them too."""

    def test_there_is_one_of_each_kind(self) -> None:
        assert {yaml.safe_load(text)["kind"] for text in EXAMPLES.values()} == PART_SECTIONS.keys()

    @pytest.mark.parametrize("name", EXAMPLES)
    def test_each_is_a_part(self, name: str, tmp_path: Path) -> None:
        file = written(tmp_path, EXAMPLES[name])
        assert read_entry(str(file)).figures
        assert mission_says(file) == ""
        assert schema_takes(EXAMPLES[name])

    def test_an_editor_is_told_the_schema(self) -> None:
        assert EXAMPLES["mti-300.yaml"].startswith("# yaml-language-server: $schema=part.schema.json\n")


class TestBothSides:
    """What a check says of a part is what a mission says that names it."""

    @pytest.mark.parametrize("text", GOOD.values(), ids=GOOD)
    def test_what_is_fine_can_be_used(self, text: str, tmp_path: Path, run: Run) -> None:
        file = written(tmp_path, text)
        assert mission_says(file) == ""
        assert run("check", str(tmp_path / "mission.yaml")).exit_code in (0, 1)
        done = run("sensors", "--check", str(file))
        assert (done.exit_code, done.stderr) == (0, "")
        assert done.stdout.startswith(f"{file}: fine: ")

    @pytest.mark.parametrize(("text", "said"), ALL_BROKEN.values(), ids=ALL_BROKEN)
    def test_what_is_not_is_refused_by_both_with_the_same_words(
        self, text: str, said: str, tmp_path: Path, run: Run
    ) -> None:
        file = written(tmp_path, text)
        done = run("sensors", "--check", str(file))
        assert (done.exit_code, done.stdout) == (2, "")
        assert said in done.stderr
        of_mission = mission_says(file)
        for line in done.stderr.splitlines():
            assert line.startswith(f"{file}:")
            assert f"sensor: {line}\n" in of_mission + "\n"

    def test_all_that_is_wrong_is_said_at_once(self, tmp_path: Path, run: Run) -> None:
        text = "kind: gyro\nName: x\ngyro_bias: 1 m\nattitude: *a\nsource: {attitude: z}\nsource: y\n"
        text += "angle_random_walk: 0.1\n"
        done = run("sensors", "--check", str(written(tmp_path, text)))
        places = [line.removeprefix(f"{tmp_path}/f.yaml:").split(": ")[:2] for line in done.stderr.splitlines()]
        assert places == [
            ["1:1", "name"], ["1:7", "kind"], ["2:1", "Name"], ["3:12", "gyro_bias"], ["4:11", "attitude"],
            ["5:9", "source"], ["6:1", "source"], ["7:20", "angle_random_walk"],
        ]  # fmt: skip

    @given(files())
    def test_any_file(self, tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
        file = written(tmp_path_factory.mktemp("part"), text)
        try:
            read_entry(str(file))
        except PartError as error:
            assert error.faults
            said = mission_says(file)
            assert all(line in said for line in error.args)
            return
        assert mission_says(file) == ""
        assert schema_takes(text), text

    @given(files(changed=False))
    def test_any_file_that_is_right(self, tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
        file = written(tmp_path_factory.mktemp("part"), text)
        assert read_entry(str(file)).figures
        assert mission_says(file) == ""
        assert schema_takes(text), text


class TestCheck:
    def test_what_is_fine_is_said_in_a_line(self, tmp_path: Path, run: Run) -> None:
        file = written(tmp_path, IMU + "attitude: 1 deg\n")
        assert (
            run("sensors", "--check", str(file)).stdout
            == f"{file}: fine: x, inertial sensor, 2 figures, each with a source\n"
        )
        written(tmp_path, GNSS)
        assert (
            run("sensors", "--check", str(file)).stdout
            == f"{file}: fine: x, GNSS receiver, 1 figure, with a source\n"
        )

    def test_files_folders_globs_and_standard_input(self, tmp_path: Path, run: Run, monkeypatch: Any) -> None:
        monkeypatch.chdir(tmp_path)
        for name, text in {
            "p/a.yaml": IMU,
            "p/b.yml": GNSS,
            "p/c.txt": "no part",
            "p/d/e.yaml": "no",
            "one.yaml": CLOCK,
        }.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text, encoding="utf-8")
        done = run("sensors", "--check", "one.yaml", "p", "p/*.yml", "-", input=IMU)
        assert done.exit_code == 0
        assert [line.partition(":")[0] for line in done.stdout.splitlines()] == [
            "one.yaml",
            "p/a.yaml",
            "p/b.yml",
            "-",
        ]
        done = run("sensors", "--check", "-", "one.yaml", input="kind: imu\n")
        assert done.exit_code == 2
        assert done.stderr.startswith("-:1:1: name: is missing\n")
        assert done.stdout.startswith("one.yaml: fine: ")

    def test_a_folder_of_more_parts_than_are_listed_is_checked_whole(
        self, tmp_path: Path, run: Run, monkeypatch: Any
    ) -> None:
        monkeypatch.setattr("bisar_budget.mission.parts._MAX_FOLDER_FILES", 1)
        for name, text in {"a.yaml": IMU, "b.yaml": "kind: imu\n"}.items():
            (tmp_path / name).write_text(text, encoding="utf-8")
        assert catalogue([str(tmp_path)]).keys() == {"a"}
        assert "b.yaml:1:1: name: is missing" in run("sensors", "--check", str(tmp_path)).stderr

    @pytest.mark.parametrize(
        ("name", "said"),
        [
            ("nothing.yaml", "nothing.yaml: cannot be read: No such file or directory"),
            ("no*.yaml", "no*.yaml: not found, and no file matches the pattern"),
            ("empty", "empty: has no file of a part; accepted: a folder with files that end in .yaml or .yml"),
            ("in/f.yaml/x.yaml", "in/f.yaml/x.yaml: cannot be read: Not a directory"),
            ("in/p.yaml", "in/p.yaml: is no regular file"),
            ("x\0.yaml", r"x\x00.yaml: is no name of a file"),
            ("in/f.txt", "in/f.txt: has a name by which no mission finds a part; accepted: one that ends in"),
            ("in/a\u202eb.yaml", r"in/a\u202eb.yaml: has a name that no mission can say: it must be one line of"),
        ],
    )  # fmt: skip
    def test_what_is_no_file_of_a_part(
        self, name: str, said: str, tmp_path: Path, run: Run, monkeypatch: Any
    ) -> None:
        monkeypatch.chdir(tmp_path)
        os.mkdir("empty")
        os.mkdir("in")
        for good in ("in/f.yaml", "in/f.txt", "in/a\u202eb.yaml"):
            Path(good).write_text(IMU, encoding="utf-8")
        os.mkfifo("in/p.yaml")
        done = run("sensors", "--check", name, "in/f.yaml")
        assert done.exit_code == 2
        assert said in done.stderr
        assert done.stdout.startswith("in/f.yaml: fine: ")

    def test_a_file_that_cannot_be_read(self, tmp_path: Path, run: Run, monkeypatch: Any) -> None:
        file = written(tmp_path, IMU)

        def refuse(*_: object, **__: object) -> None:
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr("bisar_budget.resources.open", refuse, raising=False)
        done = run("sensors", "--check", str(file))
        assert (done.exit_code, done.stderr) == (2, f"{file}: cannot be read: Permission denied\n")

    def test_json(self, tmp_path: Path, run: Run) -> None:
        good, bad = written(tmp_path, IMU), tmp_path / "bad.yaml"
        bad.write_text("kind: imu\nname: x\nsource: y\ngyro_bias: 1 m\n", encoding="utf-8")
        done = run("sensors", "--check", str(good), str(bad), "--format", "json")
        found = json.loads(done.stdout)
        assert (done.exit_code, found["format"], found["status"]) == (2, "bisar-budget/sensors-check/1", "error")
        first, second = found["parts"]
        assert (first["status"], first["errors"], first["id"], first["kind"]) == ("pass", [], "f", "imu")
        assert first["figures"] == {"gyro_bias": {"value": "1 deg/h", "source": "y"}}
        (fault,) = second["errors"]
        assert (second["status"], fault["line"], fault["column"], fault["key"]) == ("error", 4, 12, "gyro_bias")
        assert fault["given"] == "1 m"
        # The keys of a fault are those of a check of missions.
        (mission,) = json.loads(run("check", str(bad), "--format", "json").stdout)["missions"]
        assert fault.keys() == mission["errors"][0].keys()
        found = json.loads(run("sensors", "--check", str(good), "--format", "json").stdout)
        assert found["status"] == "pass"

    @pytest.mark.parametrize(
        ("arguments", "said"),
        [
            (["--check"], "--check needs FILE"),
            (["--check", ""], "the name of a file is empty"),
            (["--check", "--kind", "imu", "f.yaml"], "--kind is for the list of parts"),
            (
                ["f.yaml"],
                "matches f.yaml; `bisar-budget sensors` lists them. It is a file: --check checks it",
            ),
            (
                ["stim300", "stim30"],
                "no part of the catalogue matches stim30; `bisar-budget sensors` lists them. Did you mean 'stim300'?",
            ),
        ],
    )
    def test_wrong_usage(self, arguments: list[str], said: str, tmp_path: Path, run: Run, monkeypatch: Any) -> None:
        monkeypatch.chdir(written(tmp_path, IMU).parent)
        done = run("sensors", *arguments)
        assert (done.exit_code, done.stdout) == (2, "")
        assert said in done.stderr

    def test_several_names_are_listed(self, run: Run) -> None:
        found = json.loads(run("sensors", "sit5358", "stim*", "stim300", "--format", "json").stdout)["parts"]
        assert [part["id"] for part in found] == ["stim300", "stim300-r9", "sit5358"]

    def test_a_broken_part_of_the_project_is_said_by_the_list_a_line_for_each_fault(
        self, tmp_path: Path, run: Run, monkeypatch: Any
    ) -> None:
        monkeypatch.chdir(tmp_path)
        (tmp_path / "pyproject.toml").write_text('[tool.bisar-budget]\nsensors = ["."]\n', encoding="utf-8")
        written(tmp_path, "kind: imu\ngyro_bias: 1 deg/h\n")
        lines = run("sensors").stderr.splitlines()
        assert [line.rpartition("f.yaml:")[2] for line in lines] == [
            "1:1: name: is missing",
            "1:1: source: is missing",
        ]


def test_a_part_whose_source_ends_in_a_colon_has_one(tmp_path: Path) -> None:
    assert read_entry(str(written(tmp_path, IMU.replace("source: y", "source: 'see: '")))).part.source == "see: "
