"""The JSON Schema takes every file that the loader takes, and refuses the faults that a schema can see.

A schema sees what a reader of YAML makes of a file: 007 is 7, `yes` is true, a time is a date. The loader sees text.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from bisar_budget.faults import MissionError
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import mission_schema
from tests.conftest import BASE, ROOT, mission_text
from tests.fuzz import case

_Draft7: Any = jsonschema.Draft7Validator
_ACCEPTED: set[tuple[str, str]] = set()


def _as_defined(validator: Any, definition: str, value: Any, schema: Any) -> list[Any]:
    """Errors of a value by a definition of the mission's schema; random missions have most values in common."""
    key = definition, repr(value)
    if key in _ACCEPTED:
        return []
    if not (errors := list(_Draft7.VALIDATORS["$ref"](validator, definition, value, schema))):
        _ACCEPTED.add(key)
    return errors


SCHEMA = jsonschema.validators.extend(_Draft7, {"$ref": _as_defined})(mission_schema())
_Safe: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Core(_Safe):
    """YAML 1.2's numbers, as editors read them; dates and `yes` stay text."""


_Core.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in found if not tag.endswith((":timestamp", ":bool"))]
    for first, found in _Safe.yaml_implicit_resolvers.items()
}
LOADERS = {"YAML 1.1": _Safe, "YAML 1.2": _Core}
# Faults that a schema can see, as the loader says them.
VISIBLE = re.compile(
    "is not a known key$|is not a known choice$|must be a mapping of keys to values$|must be a list$|makes it an? "
)


def with_text_keys(node: Any) -> Any:
    """The same as JSON has it: keys are text."""
    if isinstance(node, dict):
        return {str(key): with_text_keys(value) for key, value in node.items()}
    return [with_text_keys(item) for item in node] if isinstance(node, list) else node


def is_accepted(text: str, loader: Any) -> bool:
    """Whether the schema takes what a reader of YAML makes of a file; True where it makes nothing of it."""
    try:
        document = yaml.load(text, Loader=loader)
    except (yaml.YAMLError, ValueError):
        return True
    return SCHEMA.is_valid(with_text_keys(document))


def hold(text: str, name: str, file: Path | None = None) -> bool:
    """Hold both to the same verdict on a file; gives whether the loader takes it."""
    try:
        load_mission(str(file)) if file is not None else parse_mission(text, name)
    except MissionError as error:
        visible = [fault for fault in error.faults if VISIBLE.search(fault.problem)]
        # The unit of a specification is that of its key, which the schema does not look up.
        visible = [fault for fault in visible if not fault.key.startswith("specifications.")]
        is_twice = any("is a duplicate key" in fault.problem for fault in error.faults)  # one hides the other
        # Names of axes are those of the frame beside them.
        if any(".correlation." not in fault.key for fault in visible) and not is_twice:
            assert not is_accepted(text, _Safe), (name, visible)
        return False
    documents = [with_text_keys(yaml.load(text, Loader=loader)) for loader in LOADERS.values()]
    for document in {repr(document): document for document in documents}.values():
        wrong = [f"{list(error.absolute_path)}: {error.message[:200]}" for error in SCHEMA.iter_errors(document)]
        assert not wrong, (name, wrong)
    return True


FILES = [
    path
    for folder in ("specs", "examples", "tests", "docs")
    for path in sorted((ROOT / folder).rglob("*.y*ml"))
    if path.suffix in (".yaml", ".yml") and "schema_version" in path.read_text(encoding="utf-8", errors="ignore")
]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_of_every_file(path: Path) -> None:
    hold(path.read_text(encoding="utf-8"), path.name, path)


def _blocks() -> Iterator[tuple[str, str]]:
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for count, block in enumerate(re.findall(r"(?ms)^```ya?ml\n(.*?)^```", page.read_text(encoding="utf-8"))):
            yield f"{page.relative_to(ROOT)}:{count}", block


@pytest.mark.parametrize(("name", "block"), [*_blocks()], ids=[name for name, _ in _blocks()])
def test_of_every_block_of_the_docs(name: str, block: str) -> None:
    """A block that shows a section stands beside the rest of a mission."""
    tree = yaml.load(block, Loader=yaml.BaseLoader)
    if not isinstance(tree, dict) or not tree.keys() <= mission_schema()["properties"].keys():
        return
    rest = {key: value for key, value in BASE.items() if key not in tree}
    hold(yaml.safe_dump(rest, sort_keys=False) + block, name)


@pytest.mark.parametrize("start", range(0, 2500, 250))
def test_of_2500_random_files(start: int) -> None:
    taken = sum(
        hold(hostile.data.decode("utf-8"), f"seed {seed}")
        for seed in range(start, start + 250)
        if (hostile := case(seed)) and _is_text(hostile.data)
    )
    assert taken > 25


def _is_text(data: bytes) -> bool:
    try:
        return bool(data.decode("utf-8"))
    except UnicodeDecodeError:
        return False


TEXTS = ("007", "39634", "1e3", "0x1F", "yes", "off", "2026-06-01", "2026-06-01T05:20:31Z", "12:30", "1_000", ".5")


@pytest.mark.parametrize("text", TEXTS)
def test_text_that_a_reader_takes_for_something_else(text: str) -> None:
    """The loader keeps the text as it stands; so the schema takes whatever a reader makes of it."""
    for key in ("name", "document: {issue", "requirement_ids: {receiver.velocity.x"):
        block = f"{key}: {text}{'}' if '{' in key else ''}\n"
        kept = mission_text() if key != "name" else mission_text().replace("name: base\n", "")
        assert hold(kept + block, text)
    source = mission_text(platforms__receiver__motion_error={"velocity": "1 mm/s", "source": "TEXT"})
    assert hold(source.replace("TEXT", text), text)


def test_an_orbit_of_a_number_and_times_without_quotes() -> None:
    block = "orbit:\n      omm: a.xml\n      object: 39634"
    document = yaml.safe_load(f"a:\n    {block}\nb: 2026-06-01T05:20:31.250Z\nc: 2027-03-31\n")
    definitions = mission_schema()["definitions"]
    of = {
        name: {"$ref": f"#/definitions/{name}", "definitions": definitions} for name in ("OrbitSource", "Collection")
    }
    assert jsonschema.Draft7Validator(of["OrbitSource"]).is_valid(document["a"]["orbit"])
    for instant in (document["b"], "2026-06-01T05:20:31.250Z"):
        collection = {"aperture_time": "1 s", "center_time": instant}
        assert jsonschema.Draft7Validator(of["Collection"]).is_valid(collection)
    for instant in (5, True, [1], "noon"):
        collection = {"aperture_time": "1 s", "center_time": instant}
        assert not jsonschema.Draft7Validator(of["Collection"]).is_valid(collection)
    waivers = [{"id": "receiver.*", "until": "2027-03-31", "reason": "open"}]
    quoted = mission_text(waivers=waivers)
    assert hold(quoted, "quoted")
    assert hold(quoted.replace("'2027-03-31'", "2027-03-31"), "plain")


@pytest.mark.parametrize(
    "changes",
    [
        {"nam": "x"},
        {"radar__bandwith": "1 MHz"},
        {"collection__aperture_time": "6 m"},
        {"collection__aperture_time": -1},
        {"collection__aperture_time": [6]},
        {"collection__aperture_time": True},
        {"collection__aperture_time": "six"},
        {"collection__pulses": "12.5"},
        {"radar__center_frequency": "10 GB"},
        {"platforms__receiver__position": ["6 km", "6 km"]},
        {"platforms__receiver__position": ["6 km", "6 kHz", "2 km"]},
        {"platforms__receiver__motion_error": {"imu": {"gyro_bias": "1 deg"}}},
        {"platforms__receiver__motion_error": {"imu": {"gyro_bias": 1}}},
        {"platforms__receiver__motion_error": {"frame": "body"}},
        {"platforms__receiver__oscillator": {"phase_noise": {"1 Hz": "-80 dB"}}},
        {"requirements__islr": 20},
        {"requirements__pslr": "30 dB"},
        {"requirements__pslr": "0 dB"},
        {"requirements__location_error": "0 m"},
        {"requirements__quadratic_phase_error": 0},
        {"collection__aperture_time": "-2 s"},
        {"collection__aperture_time": "0.0e3 s"},
        {"platforms__receiver__motion_error": {"position": "1 dps"}},
        {"platforms__receiver__motion_error": {"lever_arm": {}}},
        {"platforms__receiver__motion_error": {"lever_arm": {"uncertainty": "-1 mm"}}},
        {"platforms__receiver__motion_error": {"lever_arm": {"source": "drawing"}}},
        {"platforms__receiver__orbit": {"planned": True}},
        {"other_errors": [{"name": "a"}]},
        {"requirements__declare": ["position", "position"]},
        {"waivers": [{"id": "*", "until": "tomorrow", "reason": "r"}]},
        {"waivers": [{"id": "*", "until": "2027-01-01"}]},
        {"name": ["a"]},
        {"name": None},
        {"document": {"issue": {"a": 1}}},
        {"schema_version": 2},
    ],
)
def test_both_refuse(changes: dict[str, Any]) -> None:
    text = mission_text(**changes)
    assert not hold(text, "refused")
    assert not any(is_accepted(text, loader) for loader in LOADERS.values())


@pytest.mark.parametrize(
    "changes",
    [
        {"requirements__pslr": "-0.5 dB"},
        {"requirements__pslr": "-30 dB"},
        {"requirements__location_error": "0.05 m"},
        {"requirements__location_error": "5e-2 m"},
        {"collection__aperture_time": " +0.6 s"},
        {"scene__height_error": "-0 m"},
        {"scene__height_error": 0},
        {"platforms__receiver__motion_error": {"position": "-1 m", "imu": {"gyro_bias": "1 dps"}}},
        {"platforms__receiver__motion_error": {"imu": {"accelerometer_bias": "1 micro-g"}}},
        {"platforms__receiver__motion_error": {"lever_arm": {"uncertainty": "0 mm"}}},
        {"platforms__receiver__motion_error": {"time_tag": "-1 ms"}},
        {"other_errors": [{"name": "a", "islr": "-40 dB"}]},
        {"platforms__receiver__oscillator": {"power_law": {"h0": "1e-27"}, "level": "-3 dB"}},
    ],
)
def test_both_take_the_sound_neighbour(changes: dict[str, Any]) -> None:
    assert hold(mission_text(**changes), "taken")
