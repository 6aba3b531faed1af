"""The registry of kinds of error: ids of rows, names, and kinds that a package adds."""

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import bisar_budget as bb
from bisar_budget import units
from bisar_budget.cli import cli
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.error_kinds import registry
from bisar_budget.error_kinds.kind import SourceKind
from bisar_budget.error_kinds.random_kinds import PROPAGATION_KIND
from bisar_budget.error_kinds.registry import kind_of, kinds
from bisar_budget.faults import MotionKindError
from bisar_budget.geometry import FRAME_AXES
from bisar_budget.mission.changes import all_keys
from tests.conftest import APART, ROOT

# Ids that the contract lists, by kind, owner, axis and entry.
IDS = {
    ("velocity", "receiver", "x", None): "receiver.velocity.x",
    ("position", "mission", "along", None): "common.position.along",
    ("time_tag", "transmitter", "", None): "transmitter.time_tag",
    ("time_tag", "mission", "", None): "common.time_tag",
    ("random", "receiver", "GNSS", None): "receiver.random.GNSS",
    ("random", "mission", "GNSS", None): "common.random.GNSS",
    ("vibration", "receiver", "sinusoidal", 0): "receiver.vibration.sinusoidal.0",
    ("vibration", "mission", "wideband", None): "mission.vibration.wideband",
    ("imu", "receiver", "gyro_bias", None): "receiver.imu.gyro_bias",
    ("lever_arm", "receiver", "uncertainty", None): "receiver.lever_arm.uncertainty",
    ("oscillator", "transmitter", "", None): "transmitter.oscillator",
    ("oscillator", "transmitter", "acceleration", None): "transmitter.oscillator.acceleration",
    ("timing", "clock", "quadratic", None): "timing.quadratic",
    ("time", "clock", "", None): "timing.time",
    ("synchronization", "clock", "", None): "timing.synchronization",
    ("propagation", "receiver", "zenith_delay", None): "propagation.receiver.zenith_delay",
    ("propagation", "mission", "zenith_delay", None): "propagation.zenith_delay",
    ("dispersion", "mission", "", None): "propagation.dispersion",
    ("terrain", "mission", "", None): "mission.terrain",
    ("other", "mission", "antenna", None): "other.antenna",
    ("quadratic_phase_error", "clock", "", None): "timing.quadratic_phase_error",
    ("quadratic_phase_error", "mission", "", None): "mission.quadratic_phase_error",
    ("specification", "receiver", "receiver.velocity", None): "specification.receiver.velocity",
}


@pytest.fixture(autouse=True)
def own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kinds that a test registers are gone after it."""
    monkeypatch.setattr(registry, "_KINDS", dict(registry._KINDS))


def still(path: object, times: np.ndarray) -> np.ndarray:
    return np.zeros((3, *times.shape))


def kind(name: str) -> bb.MotionKind:
    return bb.MotionKind(name=name, dimension=units.LENGTH, description="An error that moves nothing.", motion=still)


@pytest.mark.parametrize("key", IDS, ids=str)
def test_the_ids_of_rows_are_those_of_the_contract(key: tuple[str, str, str, int | None]) -> None:
    name, *parts = key
    assert kind_of(name).row_id(*parts) == IDS[key]


def test_a_kind_has_one_name() -> None:
    assert len({each.name for each in kinds()}) == len(kinds())
    with pytest.raises(ValueError, match="'velocity' is registered already"):
        bb.register(kind("velocity"))


@pytest.mark.parametrize("name", ["", "Drift", "phase centre", "2nd", "a.b"])
def test_a_name_fits_into_a_row_id(name: str) -> None:
    with pytest.raises(ValueError, match="is no name of a kind"):
        kind(name)


@pytest.mark.parametrize(
    "name",
    [
        *PLATFORMS,
        "mission",
        "clock",
        "common",
        "covariance",
        *sorted({axis for axes in FRAME_AXES.values() for axis in axes}),
    ],
)
def test_a_name_with_another_meaning_is_refused(name: str) -> None:
    """`receiver.covariance` is the group of the errors of a covariance, beside which a kind had the same id."""
    with pytest.raises(ValueError, match="another meaning in the ids of rows"):
        kind(name)


OTHER_FACTS = sorted({each.name for each in fields(SourceKind)} - {"name", "description"})


@pytest.mark.parametrize("fact", OTHER_FACTS)
def test_the_motion_says_everything_about_a_registered_kind(fact: str) -> None:
    """A kind with other facts than those of a motion was accepted, and judged, flown or drawn as something else."""
    with pytest.raises(TypeError, match=fact):
        bb.MotionKind(name="untrue", dimension=units.LENGTH, description="Error.", motion=still, **{fact: "time_tag"})


def test_nothing_but_a_motion_is_registered() -> None:
    """A kind without a motion was accepted, and no command knew it."""
    with pytest.raises(TypeError, match="MotionKind"):
        bb.register(PROPAGATION_KIND)


def test_a_kind_that_moves_nothing_passes_without_a_limit() -> None:
    bb.register(kind("moves_nothing"))
    mission = bb.load(str(ROOT / "specs/missions/tandem_x.yaml"))
    row = bb.check(mission.replace({"platforms.receiver.motion_error.registered.moves_nothing": "1 m"}))[
        "receiver.moves_nothing"
    ]
    assert (row.declared, row.allowable) == (1.0, None)
    assert row.displacement_m == (0.0, 0.0)


@pytest.mark.parametrize("dimension", [units.ANGLE, units.RATIO, units.SPEED], ids=lambda dimension: dimension.si)
def test_a_motion_has_a_size_of_any_dimension(dimension: units.Dimension) -> None:
    """An error in rad was taken for a pure phase error, and no check of it ended."""

    def north(path: object, times: np.ndarray) -> np.ndarray:
        return np.stack([0 * times, 0 * times + 1, 0 * times])

    bb.register(bb.MotionKind(name="tilt", dimension=dimension, description="Tilt.", motion=north))
    mission = bb.load(str(ROOT / "specs/missions/tandem_x.yaml"))
    size = f"1 {dimension.si}" if dimension.si not in ("", "1") else 1.0
    tilted = mission.replace({"platforms.receiver.motion_error.registered.tilt": size})
    shifted = mission.replace({"platforms.receiver.motion_error.position": ["0 m", "1 m", "0 m"]})
    row, position = bb.check(tilted)["receiver.tilt"], bb.check(shifted)["receiver.position.y"]
    assert row.displacement_m == pytest.approx(position.displacement_m, rel=1e-4)
    assert row.utilization == pytest.approx(position.utilization, rel=1e-4)


def test_both_platforms_may_have_it_and_its_sign_counts() -> None:
    """The same rigid shift of both platforms as a registered kind and as `common_motion_error`."""

    def north(path: object, times: np.ndarray) -> np.ndarray:
        return np.stack([0 * times, 0 * times + 1, 0 * times])

    bb.register(bb.MotionKind(name="shift_north", dimension=units.LENGTH, description="Shift.", motion=north))
    mission = bb.load(str(ROOT / "specs/missions/tandem_x.yaml"))
    key = "platforms.{}.motion_error.registered.shift_north"
    shifted = bb.check(mission.replace({key.format("transmitter"): "1 m", key.format("receiver"): "-1 m"}))
    moved = [np.array(shifted[f"{name}.shift_north"].displacement_m) for name in ("transmitter", "receiver")]
    common = bb.check(mission.replace({"common_motion_error.position": ["0 m", "1 m", "0 m"]}))["common.position.y"]
    assert moved[0] - moved[1] == pytest.approx(np.array(common.displacement_m), abs=1e-6)


def test_the_coverage_factor_multiplies_what_its_kind_says() -> None:
    """Sigmas of a path have the coverage factor; the height of the scene is a bound without it."""
    bb.register(kind("covered"))
    mission = bb.load(str(ROOT / "specs/missions/tandem_x.yaml"))
    changes = {
        "allocation.coverage_factor": 2.0,
        "scene.height_error": "3 m",
        "platforms.receiver.motion_error.registered.covered": "3 m",
        "platforms.receiver.motion_error.time_tag": "3 us",
    }
    result = bb.check(mission.replace(changes))
    assert result["mission.terrain"].declared == 3.0
    assert result["receiver.covered"].declared == 6.0
    assert result["receiver.time_tag"].declared == pytest.approx(6e-6)


def test_large_draws_of_a_registered_kind_are_those_of_its_motion() -> None:
    """So large that each draw goes through exact ranges: a velocity error, and its motion as a registered kind."""

    def north(path: object, times: np.ndarray) -> np.ndarray:
        return np.stack([0 * times, times, 0 * times])

    bb.register(bb.MotionKind(name="drift_north", dimension=units.SPEED, description="Drift.", motion=north))
    bare = bb.load(str(ROOT / "specs/missions/rigling_moses_section_v.yaml")).replace(
        {
            "platforms.transmitter.motion_error": None,
            "allocation": "{model: full, combine: rss}",
            "requirements.location_error": "1 m",
        }
    )
    states = {
        "platforms.receiver.motion_error.velocity": ["0 m/s", "20 m/s", "0 m/s"],
        "platforms.receiver.motion_error.registered.drift_north": "20 m/s",
    }
    drawn = [bb.monte_carlo(bare.replace({key: value}), 4000, seed=2).to_dict() for key, value in states.items()]
    by_velocity, by_motion = ({each["id"]: each for each in one["requirements"]} for one in drawn)
    assert by_motion["mission.location_error"]["sigma"] == pytest.approx(
        by_velocity["mission.location_error"]["sigma"], rel=0.05
    )


def test_sensitivity_doubles_a_registered_kind() -> None:
    """It was missing in the list of errors that are doubled to compare the shares of the platforms."""

    def north(path: object, times: np.ndarray) -> np.ndarray:
        return np.stack([0 * times, times, 0 * times])

    bb.register(bb.MotionKind(name="drift_north", dimension=units.SPEED, description="Drift.", motion=north))
    mission = bb.load(str(ROOT / "specs/missions/rigling_moses_section_v.yaml"))
    key = "platforms.receiver.motion_error.registered.drift_north"
    balanced = mission.replace({key: "1 mm/s", "allocation.split": "balanced"})
    assert key in [relaxed.key for relaxed in bb.sensitivity(balanced).found.relaxed]


def refused(name: str, motion: Callable[..., np.ndarray]) -> pytest.ExceptionInfo[ValueError]:
    bb.register(bb.MotionKind(name=name, dimension=units.LENGTH, description="Error.", motion=motion))
    mission = bb.load(str(ROOT / "specs/missions/tandem_x.yaml"))
    with pytest.raises(MotionKindError) as refusal:
        bb.check(mission.replace({f"platforms.receiver.motion_error.registered.{name}": "1 m"}))
    return refusal


def test_a_motion_without_numbers_or_of_another_shape_is_no_pass() -> None:
    """NaN gave a row without a limit that did not fail."""
    assert "not finite" in str(refused("nothing", lambda path, times: np.full((3, *times.shape), np.nan)).value)
    assert "shape" in str(refused("turned", lambda path, times: np.zeros((*times.shape, 3))).value)


def raising(path: object, times: np.ndarray) -> np.ndarray:
    raise RuntimeError("no motion\x1b[31m today")


def writing(path: object, times: np.ndarray) -> np.ndarray:
    times *= 2
    return np.stack([times, times, times])


def without_numbers(path: object, times: np.ndarray) -> np.ndarray:
    return np.full((3, *times.shape), np.nan)


UNUSABLE = [
    (raising, "raises RuntimeError: no motion\\x1b[31m today"),
    (writing, "raises ValueError"),
    (without_numbers, "not finite"),
    (lambda path, times: [times, 0], "raises ValueError"),
    (lambda path, times: np.stack([times, times, times]) * 1j, "type complex128; accepted: real numbers"),
    (lambda path, times: np.ones((3, *times.shape), dtype=str), "type"),
]


@pytest.mark.parametrize(("motion", "words"), UNUSABLE)
def test_an_unusable_motion_is_no_fault_of_the_tool(
    motion: Callable[..., np.ndarray], words: str, tmp_path: Path
) -> None:
    """Such a motion ended the commands with "a fault of the tool itself" and 3."""
    bb.register(bb.MotionKind(name="unusable", dimension=units.LENGTH, description="Error.", motion=motion))
    result = run_with(tmp_path, "check", "unusable")
    assert result.exit_code == 2
    assert "registered kind unusable: its motion" in result.stderr
    assert words in result.stderr
    assert "fault of the tool" not in result.stderr


def run_with(folder: Path, command: str, kind: str, *options: str) -> Result:
    """Run a command on a mission with 1 m of a registered kind of error."""
    key = f"platforms.receiver.motion_error.registered.{kind}=1 m"
    mission = folder / "mission.yaml"
    mission.write_text((ROOT / "specs/missions/tandem_x.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    return CliRunner(**APART).invoke(cli, [command, str(mission), "--set", key, *options])


PACKAGES = {
    "broken": "raise RuntimeError('not today')\n",
    "wrong": "KIND = 5\n",
    "refused": "import bisar_budget as bb\nKIND = bb.MotionKind(name='A B', dimension=0, description='', motion=0)\n",
    "first": "",
    "second": "",
    "taken": "",
    "good": "",
}
KIND = """
import numpy as np
import bisar_budget as bb
from bisar_budget import units

KIND = bb.MotionKind(
    name="{name}",
    dimension=units.LENGTH,
    description="Shift.",
    motion=lambda path, times: np.zeros((3, *times.shape)) / {divisor},
)
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Distributions, of which most have an entry point that gives no kind."""
    for name, text in PACKAGES.items():
        kind = {"first": "both_have_it", "second": "both_have_it", "taken": "velocity"}.get(name, name)
        (tmp_path / f"e54_{name}.py").write_text(text or KIND.format(name=kind, divisor=1))
        metadata = tmp_path / f"e54_{name}-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: e54-{name}\nVersion: 1.0\n")
        (metadata / "entry_points.txt").write_text(f"[bisar_budget.kinds]\n{name} = e54_{name}:KIND\n")
        monkeypatch.delitem(sys.modules, f"e54_{name}", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registry, "_ENTRY_POINT_FAULTS", [])
    monkeypatch.setattr(registry, "_DISTRIBUTIONS", {})
    caches = (registry._read_entry_points, all_keys)
    for cache in caches:
        cache.cache_clear()
    yield tmp_path
    for cache in caches:
        cache.cache_clear()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "broken",
            "The entry point broken of the distribution e54-broken gives no kind of error: RuntimeError: not today",
        ),
        (
            "wrong",
            "distribution e54-wrong gives no kind of error: it is no bisar_budget.MotionKind, but of the type int",
        ),
        ("refused", "'A B' is no name of a kind"),
        ("both_have_it", "e54-first and e54-second provide kinds of error named 'both_have_it'"),
        ("taken", "e54-taken provides a kind of error named 'velocity', but another has that name"),
    ],
)
def test_an_entry_point_without_a_kind_is_named_to_whoever_needs_it(installed: Path, name: str, words: str) -> None:
    result = run_with(installed, "check", name)
    assert result.exit_code == 2
    assert "is no registered kind of error" in result.stderr
    assert words in " ".join(result.stderr.split())


def test_an_entry_point_without_a_kind_hinders_nothing_else(installed: Path) -> None:
    """It ended `schema`, each mission with a registered kind, and each check with a misspelt requirement."""
    assert run_with(installed, "check", "good").exit_code == 0
    schema = CliRunner(**APART).invoke(cli, ["schema"])
    assert schema.exit_code == 0
    assert "Warning: The entry point broken of the distribution e54-broken" in schema.stderr
    assert "good" in json.loads(schema.stdout)["definitions"]["MotionError"]["properties"]["registered"]["properties"]
    misspelt = run_with(installed, "check", "good", "--set", "requirements.location_eror=1 m")
    assert misspelt.exit_code == 2
    assert "Did you mean 'requirements.location_error'?" in misspelt.stderr


def test_an_unusable_motion_names_its_distribution(installed: Path) -> None:
    (installed / "e54_good.py").write_text(KIND.format(name="good", divisor=0))
    result = run_with(installed, "check", "good")
    assert result.exit_code == 2
    assert (
        "registered kind good of the distribution e54-good: its motion has numbers that are not finite"
        in result.stderr
    )


@pytest.mark.parametrize(("turns", "is_smooth"), [(0.25, True), (0.5, True), (3.0, False), (300.0, False)])
def test_a_motion_that_the_nodes_do_not_resolve_is_refused(turns: float, is_smooth: bool) -> None:
    """A vibration of 1 m had a limit and passed: its samples at the nodes looked like another motion."""
    mission = bb.load(str(ROOT / "specs/missions/tandem_x.yaml"))
    T = mission.collection.aperture_time

    def swaying(path: object, times: np.ndarray) -> np.ndarray:
        return np.stack([0 * times, np.sin(2 * np.pi * turns * times / T), 0 * times])

    if not is_smooth:
        assert "smooth" in str(refused("swaying", swaying).value)
        return
    bb.register(bb.MotionKind(name="swaying", dimension=units.LENGTH, description="Error.", motion=swaying))
    row = bb.check(mission.replace({"platforms.receiver.motion_error.registered.swaying": "1 mm"}))[
        "receiver.swaying"
    ]
    assert row.allowable is not None
