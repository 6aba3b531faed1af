"""The object of each built-in kind of error source says what is true of it: keys, units, meaning, motion, draws."""

from collections.abc import Iterator

import numpy as np
import pytest

import bisar_budget as bb
from bisar_budget import units
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.effects.sources import distribution_of
from bisar_budget.error_kinds.clock_kinds import ClockKind, ClockSize
from bisar_budget.error_kinds.kind import AS_STATED, BOUND, NORMAL, PEAK_AMPLITUDE, RELATIVE_LEVEL, SourceKind
from bisar_budget.error_kinds.path_kinds import PathKind, StateKind
from bisar_budget.error_kinds.registry import kinds
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import RAW
from bisar_budget.mission.quantities import choices_of, number_of, tree_of, value_at
from bisar_budget.simulator.phase_history import PathError
from tests.conftest import ROOT
from tests.contract.error_keys import ERROR_KEYS, mission_with_key
from tests.contract.test_every_error import loaded

SOURCES = [kind for kind in kinds() if isinstance(kind, SourceKind) and not kind.is_registered]
KINDS = pytest.mark.parametrize("kind", SOURCES, ids=lambda kind: kind.name)
SIZES = [(kind, axis) for kind in SOURCES for axis in kind.sizes if not kind.is_of_log]
OF_LOG = [kind for kind in SOURCES if kind.is_of_log]


@KINDS
def test_a_kind_says_everything(kind: SourceKind) -> None:
    assert kind.description.endswith(".")
    assert len(kind.description) > 20
    assert kind.moves in ("platform", "clock", "air", "image")
    for size in kind.sizes.values():
        assert size.equation
        assert size.distribution in (NORMAL, BOUND, AS_STATED, PEAK_AMPLITUDE, RELATIVE_LEVEL)
        assert size.unit
        assert not size.unit_text or size.dimension.si == ""  # of a plain number


@KINDS
def test_a_kind_says_how_its_errors_come_about(kind: SourceKind) -> None:
    """A random error is drawn; another moves paths, shifts a clock, or is stated by its effect."""
    assert kind.is_random == bool(kind.drawn_as)
    assert bool(kind.flown_as) == isinstance(kind, PathKind)
    if isinstance(kind, PathKind):
        assert kind.flown_as in PathError._fields
    elif not kind.is_random and isinstance(kind, ClockKind):
        assert all(isinstance(size, ClockSize) for size in kind.sizes.values())
    elif not kind.is_random:
        assert kind.moves == "image"


@pytest.mark.parametrize(("kind", "axis"), SIZES, ids=lambda value: getattr(value, "name", value))
def test_a_size_means_what_its_kind_does_with_it(kind: SourceKind, axis: str) -> None:
    """The coverage factor multiplies no bound; the file states the distribution of an error of a measured path."""
    size = kind.size(axis)
    assert (size.distribution == BOUND) == (not kind.is_covered)
    assert (size.distribution == AS_STATED) == (isinstance(kind, PathKind) and kind.is_covered)
    assert (size.distribution == RELATIVE_LEVEL) == (size.dimension in units.LEVELS and kind.moves != "image")
    assert (size.distribution == PEAK_AMPLITUDE) == (kind.is_vibration and axis == "sinusoidal")


@pytest.mark.parametrize("stated", ["normal", "uniform", "bound"])
def test_the_file_states_the_distribution_of_an_error_of_a_path(stated: str) -> None:
    mission = moving_mission("rigling_moses_section_v", "scene", "platforms.receiver.motion_error").replace(
        {"platforms.receiver.motion_error.distribution": stated}
    )
    for source in Analysis(mission).sources:
        if source.declared is not None and source.owner == "receiver":
            assert distribution_of(mission, source) == stated
        elif source.declared is not None:
            assert distribution_of(mission, source) == (NORMAL if source.kind.moves == "clock" else BOUND)


@pytest.mark.parametrize(("kind", "axis"), SIZES, ids=lambda value: getattr(value, "name", value))
def test_the_row_of_a_size_has_its_equation_and_its_unit(kind: SourceKind, axis: str) -> None:
    """By the published model; tones of an oscillator and spectra of a vibration have rules of their own."""
    for key, _ in keys_of(kind, axis):
        document = mission_with_key(key)
        document["allocation"] = {"model": "published", "combine": "each"}
        (row,) = [row for row in bb.check(loaded(document)).findings.rows if row.id == ERROR_KEYS[key].row]
        size = kind.size(axis)
        if row.subject.kind != kind.name:  # an attitude error is also that of another kind
            assert size.section_form
            continue
        assert (row.equation or "").startswith(size.equation), row.equation
        assert row.unit == size.unit.replace("dBc", "dB")  # of a spur the row has the level of the echo


def keys_of(kind: SourceKind, axis: str) -> Iterator[tuple[str, str]]:
    """Keys of the contract test that state a size, with the path of the size; one for each place of the size."""
    for key in ERROR_KEYS:
        parts = key.split(".")
        owner = {"common_motion_error": "mission", "propagation": "mission"}.get(parts[0], "receiver")
        if parts[0] == "propagation" and len(parts) > 2:
            owner = parts[1]
        path = ".".join(map(str, kind.path(owner, axis, 0)))
        if key == ".".join(step for step in path.split(".") if step != "0"):
            yield key, path


@pytest.mark.parametrize(("kind", "axis"), SIZES, ids=lambda value: getattr(value, "name", value))
def test_the_mission_reader_accepts_a_size_at_its_path(kind: SourceKind, axis: str) -> None:
    size, found = kind.size(axis), list(keys_of(kind, axis))
    assert len(found) == 1 + bool(kind.common_key_form) + (kind.moves == "air")
    for key, path in found:
        mission = loaded(mission_with_key(key))
        if size.unit == "dBc":  # a tone has a level at each of its frequencies
            path = f"{path}.{next(iter(ERROR_KEYS[key].value))}"
        number = -30.0 if size.dimension in units.LEVELS else 1e-3
        text = f"{number} {size.dimension.si}".rstrip()
        assert np.ravel(value_at(mission.replace({path: text}), path))[0] == pytest.approx(number)
        assert number_of(tree_of(mission), path, is_for_each=True).dimension is size.dimension
        if size.has_axes and not path.endswith(".0"):
            assert np.size(value_at(mission.replace({path: [text] * 3}), path)) == 3


@pytest.mark.parametrize("kind", OF_LOG, ids=lambda kind: kind.name)
def test_a_file_states_how_a_log_is_processed(kind: SourceKind) -> None:
    """The size of such an error is that of the log; the file states that the log is not smoothed."""
    assert kind.path("receiver") == ("platforms", "receiver", "trajectory", "processed")
    path = ".".join(kind.path("receiver"))  # of words, because the file states a log and no size
    assert choices_of({}, path, RAW) is not None


FRAMES = ("scene", "track", "look", "ric")
SECTIONS = ("platforms.receiver.motion_error", "platforms.transmitter.motion_error", "common_motion_error")
STATED = (
    "position: [1 m, 2 m, -1 m], velocity: [1 cm/s, 2 cm/s, -1 cm/s], "
    "acceleration: [1 mm/s^2, 2 mm/s^2, -1 mm/s^2], time_tag: 1 us"
)
CLOCKS = "{constant: 1 ns, linear: 1e-9, quadratic: 1e-9 1/s, cubic: 1e-9 1/s^2}"
MOTIONS = [
    *(
        (name, frame, section)
        for name in ("rigling_moses_section_v", "tandem_l")
        for frame in FRAMES
        for section in SECTIONS
    )
]
SET_CLOCKS = ("synchronization.time_error", "synchronization.frequency_error", "platforms.receiver.oscillator.aging")


def moving_mission(name: str, frame: str, section: str) -> Mission:
    """Mission of aircraft or of falling satellites, with errors of a path in a frame, of height and of clocks."""
    bare = bb.load(str(ROOT / f"specs/missions/{name}.yaml")).replace(dict.fromkeys(SECTIONS))
    here = {} if bare.scene.latitude is not None else {f"scene.{key}": "0 deg" for key in ("latitude", "longitude")}
    here |= {} if bare.scene.latitude is not None else {"scene.height": "0 m"}
    errors = {section: f"{{frame: {frame}, {STATED}}}", "scene.height_error": "3 m", "timing_error": CLOCKS}
    return bare.replace({**here, **errors})


def range_error_of(analysis: Analysis, source: ErrorSource) -> tuple[np.ndarray, float]:
    """Range error at the nodes for the declared size, from the motion that the object of the kind says, (nodes,).

    The second result is the largest motion, of which a range error across the line of sight is a difference.
    """
    exact, kind, size = analysis.exact, source.kind, float(source.declared)
    if isinstance(kind, ClockKind):
        sync = analysis.mission.synchronization
        age = sync.age if sync is not None and sync.is_holdover and sync.age is not None else 0.0
        course = size * exact.clock_course(kind.clock_size(source.subject.axis).terms(age))[:, 0]
        return course, float(np.abs(course).max())
    assert isinstance(kind, PathKind)
    total, largest = np.zeros(len(exact.times)), 0.0
    for platform in source.platforms:
        path, direction = analysis.geometry.both[platform], source.direction_of(platform)
        if isinstance(kind, StateKind):
            moved = kind.moved(path, exact.times, direction, source.subject.frame)
        else:
            moved = kind.moved(path, exact.times)
        x, y, z = (size * np.broadcast_to(component, exact.times.shape) for component in moved)
        total += exact.along(platform, (x, y, z))[:, 0]
        largest = max(largest, float(np.abs((x, y, z)).max()))
    return total, largest


def disagreeing(analysis: Analysis) -> tuple[set[str], list[str]]:
    """Kinds of the declared errors that move something, and ids of those whose motion is not that of the check."""
    sources = [source for source in analysis.sources if source.declared is not None and source.is_motion]
    wrong = []
    for source in sources:
        checked = analysis.exact.range_error(analysis.errors.lanes(source))[:, 0] * float(source.declared)
        said, largest = range_error_of(analysis, source)
        if said != pytest.approx(checked, rel=1e-9, abs=1e-9 * largest):
            wrong.append(source.id)
    return {source.kind.name for source in sources}, wrong


@pytest.mark.parametrize(("name", "frame", "section"), MOTIONS)
def test_the_motion_of_a_kind_is_the_range_error_of_the_check(name: str, frame: str, section: str) -> None:
    analysis = Analysis(moving_mission(name, frame, section))
    assert [path.fall is not None for path in analysis.geometry.both] == [name == "tandem_l"] * 2
    moved, wrong = disagreeing(analysis)
    assert wrong == []
    assert moved == {"position", "velocity", "acceleration", "time_tag", "terrain", "timing"}


@pytest.mark.parametrize("key", SET_CLOCKS)
def test_the_terms_of_a_set_clock_are_the_range_error_of_the_check(key: str) -> None:
    moved, wrong = disagreeing(Analysis(loaded(mission_with_key(key))))
    assert wrong == []
    assert ERROR_KEYS[key].row.split(".")[1] in moved


def test_every_kind_that_moves_something_is_in_these_missions() -> None:
    moving = {kind.name for kind in SOURCES if isinstance(kind, PathKind | ClockKind) and not kind.is_random}
    assert moving == {"position", "velocity", "acceleration", "time_tag", "terrain", "timing", "time", "frequency"}
