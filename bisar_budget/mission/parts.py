"""Parts of the catalogue: inertial sensors, GNSS receivers and oscillators, with their figures and sources.

A figure is a value from a data sheet, such as a bias or a phase-noise mask. Each part has a YAML file. The file is in
`specs/sensors/`, or in a folder that is named in the settings of a project, or anywhere if the mission names its
path. A mission refers to a part by name. If the mission itself states a figure, it overrides the figure of the part.
"""

import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, NamedTuple

from bisar_budget.faults import (
    Fault,
    InvalidValueError,
    KeyPath,
    MissionError,
    Problem,
    file_fault,
    sentences,
    shown,
)
from bisar_budget.geometry import Vector
from bisar_budget.json_types import Definitions, JsonObject
from bisar_budget.mission.instruments import (
    IMU_KINDS,
    NOT_SENSITIVE,
    OSCILLATOR,
    OSCILLATOR_NOISE_FORMS,
    AccelerationSensitivity,
    AccelerometerBias,
    AccelerometerScaleFactor,
    Aging,
    AllanDeviation,
    AngleRandomWalk,
    Attitude,
    Frequency,
    GaussMarkov,
    GyroBias,
    Imu,
    Oscillator,
    Overridden,
    PhaseNoise,
    PowerLawFigures,
    TakenFigure,
    VelocityRandomWalk,
)
from bisar_budget.mission.model import DRAFT, Mission
from bisar_budget.mission.navigation import (
    AIDED_GNSS_FIGURES,
    AIDED_IMU_FIGURES,
    AidedGnss,
    AidedImu,
    Navigation,
    missing_figures,
)
from bisar_budget.mission.platforms import MotionError, Platforms
from bisar_budget.mission.readers import (
    COORDINATE,
    INVALID,
    VELOCITY,
    Choice,
    Invalid,
    Key,
    ListOf,
    Reference,
    Report,
    Section,
    SectionValue,
    SectionValues,
    Text,
    TextMap,
    Triple,
    YesNo,
    did_you_mean,
    either,
)
from bisar_budget.mission.tree import MAX_BYTES, Tree, UnusableError, read_tree
from bisar_budget.resources import DISK, Files, UnreadableError, resource, standard_input
from bisar_budget.settings import SettingsError, project_settings

Find = Callable[[str], tuple[str, bytes]]  # name of a part to the path and the content of its file

MOTION_ERROR = Section(MotionError)
AIDED_IMU, AIDED_GNSS = Section(AidedImu), Section(AidedGnss)
_TEXT = Text()
_PART_NAME_KEY = Key(_TEXT, "Maker, type, and revision or mode; reports show it.")
_SAYS = Key(
    _TEXT, "Meaning of the figures in their source: which statistic, typical or largest, in which conditions."
)
_SOURCE = either(dict, TextMap("figure"), _TEXT)
_SOURCES = Key(_SOURCE, "Document, revision and table of every figure, or of each figure by its key.")
_IN_ORBIT = Key(YesNo(), "Whether it serves a satellite. `allocate` offers a satellite only such parts of this kind.")
_KIND = "Kind of the part; it determines the figures."
_POSITION_TEXT = "1 sigma east, north, up; a single value means each axis."
_NOISE_TEXT = "Position errors that change within an aperture: the residual noise."
_GNSS_KINDS = ("position", "velocity", "random")
_SUFFIXES = (".yaml", ".yml")
_MAX_FOLDER_FILES = 1000  # parts that are read from one folder


class ImuPart(NamedTuple):
    """An inertial sensor, 1 sigma; a single value means each axis."""

    kind: Annotated[str, Key(Choice("imu"), _KIND)]
    name: Annotated[str, _PART_NAME_KEY]
    source: Annotated[str | Mapping[str, str], _SOURCES]
    accelerometer_bias: AccelerometerBias = None
    accelerometer_scale_factor: AccelerometerScaleFactor = None
    attitude: Attitude = None
    gyro_bias: GyroBias = None
    velocity_random_walk: VelocityRandomWalk = None
    angle_random_walk: AngleRandomWalk = None
    in_orbit: Annotated[bool | None, _IN_ORBIT] = None
    says: Annotated[str | None, _SAYS] = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require at least one figure that is not zero."""
        yield from _without_figure(values, IMU_KINDS)


class GnssPart(NamedTuple):
    """A GNSS receiver in one of its modes: errors of its position and velocity, 1 sigma, east, north, up."""

    kind: Annotated[str, Key(Choice("gnss"), _KIND)]
    name: Annotated[str, _PART_NAME_KEY]
    source: Annotated[str | Mapping[str, str], _SOURCES]
    position: Annotated[Vector | None, Key(Triple(COORDINATE, or_scalar=True), _POSITION_TEXT)] = None
    velocity: Annotated[Vector | None, Key(Triple(VELOCITY, or_scalar=True), _POSITION_TEXT)] = None
    random: Annotated[tuple[GaussMarkov, ...], Key(ListOf(GaussMarkov), _NOISE_TEXT)] = ()
    in_orbit: Annotated[bool | None, _IN_ORBIT] = None
    says: Annotated[str | None, _SAYS] = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require at least one figure that is not zero; names in `random` must be distinct."""
        yield from MotionError.problems({"random": values.get("random", ())})
        yield from _without_figure(values, _GNSS_KINDS)


class OscillatorPart(NamedTuple):
    """An oscillator, with its noise in one of three forms."""

    kind: Annotated[str, Key(Choice("oscillator"), _KIND)]
    name: Annotated[str, _PART_NAME_KEY]
    source: Annotated[str | Mapping[str, str], _SOURCES]
    frequency: Frequency = None
    phase_noise: PhaseNoise = None
    allan_deviation: AllanDeviation = None
    power_law: PowerLawFigures = None
    aging: Aging = None
    acceleration_sensitivity: AccelerationSensitivity = None
    says: Annotated[str | None, _SAYS] = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Check the figures as for an oscillator in a mission file, and require noise that is not zero."""
        yield from Oscillator.problems({**values, "sensor": None}, or_else="")
        if any(values.get(form) is not None for form in OSCILLATOR_NOISE_FORMS):
            yield from _without_figure(values, OSCILLATOR_NOISE_FORMS)


Part = ImuPart | GnssPart | OscillatorPart
PART_SECTIONS: dict[str, Section[Part]] = {
    "imu": Section(ImuPart),
    "gnss": Section(GnssPart),
    "oscillator": Section(OscillatorPart),
}
BESIDE_NOISE = ("aging", "acceleration_sensitivity")  # figures of an oscillator in addition to a form of noise
FIGURES = {"imu": IMU_KINDS, "gnss": _GNSS_KINDS, "oscillator": ("frequency", *OSCILLATOR_NOISE_FORMS, *BESIDE_NOISE)}


class PartError(Exception):
    """A part that cannot be used; each argument of the error is one reason.

    Attributes
    ----------
    faults : tuple of Fault
        Faults of the part's file with their lines and columns; empty if no file was read.
    hint : str
        Advice for the user, or empty.
    """

    def __init__(self, *reasons: str, faults: Sequence[Fault] = (), hint: str = "") -> None:
        super().__init__(*reasons)
        self.faults, self.hint = tuple(faults), hint

    @classmethod
    def of(cls, file: str, faults: Sequence[Fault]) -> "PartError":
        """Make an error from the faults of a part's file, with one reason for each fault."""
        return cls(*MissionError(file, tuple(faults)).lines(), faults=faults)

    def __str__(self) -> str:
        """All reasons on one line, joined by semicolons."""
        return "; ".join(map(str, self.args))


def evidence(part: Part, figure: str) -> str:
    """Evidence for a figure of a part as shown in reports: the name of the part, and the source of the figure."""
    source = part.source if isinstance(part.source, str) else part.source.get(figure, "")
    return f"{part.name}: {source}"


@dataclass(frozen=True)
class Entry:
    """A part with its file; `written` is the content of the file: text, lists and mappings."""

    file: str
    part: Part
    written: Mapping[str, object]

    @property
    def id(self) -> str:
        """Name by which a mission refers to the part: the name of its file without folder and suffix."""
        return os.path.splitext(os.path.basename(self.file))[0]

    @property
    def figures(self) -> Mapping[str, str]:
        """Figures of the part by key, each as written in the file, on one line."""
        return {key: figure_text(self.written[key]) for key in FIGURES[self.part.kind] if key in self.written}


def entries(places: Sequence[str]) -> Iterator[Entry]:
    """Yield all parts in the catalogue folders `places`, sorted by kind and name.

    Raises
    ------
    PartError
        A file is not a valid part.
    """
    read = [_entry(file, _content(file, DISK)) for file in catalogue(places).values()]
    yield from sorted(read, key=lambda entry: (list(PART_SECTIONS).index(entry.part.kind), entry.id))


def figure_text(value: object) -> str:
    """Write a figure of a part on one line of text; the figure may be a list or a mapping."""
    if isinstance(value, dict):
        return ", ".join(f"{key}: {figure_text(item)}" for key, item in value.items())
    if isinstance(value, list):
        return f"[{', '.join(map(figure_text, value))}]"
    return str(value)


def read_entry(file: str) -> Entry:
    """Read the file of a part, and check the content and the file name.

    The checks are the same as for a part that a mission names. If `file` is `-`, standard input is read, and there is
    no file name to check.

    Raises
    ------
    PartError
        No mission can use the part. The error contains every fault.
    """
    data = _standard_input() if file == "-" else _content(file, DISK)
    faults = () if file == "-" else tuple(_name_faults(file))
    try:
        entry = _entry(file, data)
    except PartError as error:
        raise PartError.of(file, (*faults, *error.faults)) from None
    if faults:
        raise PartError.of(file, faults)
    return entry


def _name_faults(file: str) -> Iterator[Fault]:
    """Yield a fault for each reason why no mission can refer to a part by the name of this file."""
    name = os.path.basename(file)
    if not name.endswith(_SUFFIXES):
        accepted = f"accepted: one that ends in {' or '.join(_SUFFIXES)}"
        yield file_fault("has a name by which no mission finds a part")._replace(accepted=accepted)
    try:
        Reference().leaf(name)
    except InvalidValueError as error:
        yield file_fault(f"has a name that no mission can say: it {error}")


def _content(file: str, files: Files) -> bytes:
    """Content of a part's file; raises `PartError` if the file cannot be read."""
    try:
        return files.content(file, MAX_BYTES)
    except UnreadableError as error:
        problem = str(error)
        raise PartError(problem, faults=[file_fault(problem.removeprefix(f"{file} "))]) from None


def _standard_input() -> bytes:
    """At most `MAX_BYTES + 1` bytes of standard input; raises `PartError` if it cannot be read."""
    try:
        return standard_input().read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise PartError.of("-", [file_fault(f"cannot be read: {reason}")]) from None


@lru_cache(maxsize=64)  # a thousand missions name the same parts
def _entry(file: str, data: bytes) -> Entry:
    """Read a part from the content of its file, or take it from the cache; raises `PartError` if it is invalid."""
    part: Part | Invalid = INVALID
    try:
        tree = read_tree(data, file, "part")
    except MissionError as error:
        raise PartError.of(file, error.faults) from None
    with suppress(UnusableError):
        part = _part_of(tree)
    if tree.faults or part is INVALID:
        raise PartError.of(file, tree.in_order())
    return Entry(file, part, tree.root)


def _part_of(tree: Tree) -> Part | Invalid:
    """Read the part from the tree of its file.

    If the part cannot be used, the faults are added to the tree, and the result is `INVALID`. If the file states no
    valid kind of part, the part is read as the kind to which most of its figures belong, so that all faults are
    reported at once.
    """
    root = tree.root
    kind = root.get("kind")
    if not (isinstance(kind, str) and kind in PART_SECTIONS):
        kind = max(PART_SECTIONS, key=lambda name: len(root.keys() & set(FIGURES[name])))
        is_likely = not root.keys().isdisjoint(FIGURES[kind])
        if root.get("kind") is not INVALID:  # an invalid value was reported by the tree
            tree.report(("kind",), _no_kind(root, kind if is_likely else ""))
        if not is_likely:
            return INVALID
    part = PART_SECTIONS[kind].read({**root, "kind": kind}, (), tree.report)
    for problem in _without_source(root, FIGURES[kind]):
        tree.report((), problem)
    return part


def _no_kind(root: Mapping[str, object], likely: str) -> Problem:
    """Describe the problem of a part whose kind is missing or unknown.

    `likely` is the kind to which its figures belong; it is empty if they belong to no kind.
    """
    hint = did_you_mean(root.get("kind", ""), tuple(PART_SECTIONS))
    if likely:
        hint = f"Its figures are those of kind: {likely}"
    elif "platforms" in root:
        hint = "This seems to be a mission file, which `bisar-budget check` reads"
    missing = "" if "kind" in root else ", and is missing"
    return Problem(f"must be one of {', '.join(PART_SECTIONS)}{missing}", hint=hint)


def _without_figure(values: Mapping[str, object], figures: Sequence[str]) -> Iterator[Problem]:
    """Yield a problem if all figures of a part are missing or zero.

    `values` has no entry for an invalid figure. If there is an invalid figure, no problem is yielded here, because it
    is reported elsewhere.
    """
    if values.keys() >= set(figures) and not any(_is_not_zero(values[figure]) for figure in figures):
        yield Problem("states no figure", f"accepted: one of {', '.join(figures)} that is not zero")


def _without_source(root: Mapping[str, object], figures: Sequence[str]) -> Iterator[Problem]:
    """Yield a problem if `source` is a mapping of figures to sources, but lacks some of the stated figures.

    Invalid figures also need a source. `root` is the content of the part's file.
    """
    source = root.get("source")
    if not isinstance(source, dict):
        return
    unsourced = tuple([figure for figure in figures if root.get(figure) and figure not in source])
    if unsourced:
        near = [did_you_mean(key, unsourced) for key in source if key not in figures]
        hint = next(filter(None, near), "")
        yield Problem(
            f"says nothing of {', '.join(unsourced)}", "accepted: one for every figure", hint, at=("source",)
        )


def _is_not_zero(figure: object) -> bool:
    """Whether a figure is stated and at least one of its numbers is not zero.

    A part needs such a figure, because every sensor has errors.
    """
    if isinstance(figure, GaussMarkov):
        return _is_not_zero(figure.sigma)
    if isinstance(figure, tuple | list):
        return any(_is_not_zero(item) for item in figure)
    return isinstance(figure, float) and figure != 0


def folders(beside: str, files: Files = DISK) -> list[str]:
    """Folders in which parts are searched for: the folders in the project settings, then the package's catalogue.

    The settings belong to the project that contains the folder `beside`; an empty string means the current folder.

    Raises
    ------
    PartError
        The settings of the project cannot be read.
    """
    try:
        settings = project_settings(beside or os.getcwd(), files)
    except SettingsError as error:
        raise PartError(str(error)) from None
    except OSError:  # somebody removed the current folder
        settings = None
    project_folders = list(settings.values.get("sensors", ())) if settings else []
    return [*project_folders, str(resource("specs", "sensors"))]


def catalogue(places: Sequence[str], files: Files = DISK) -> dict[str, str]:
    """Files of all parts in the folders `places`, by the name of the part.

    If several folders have a part of the same name, the first of these folders takes precedence.
    """
    part_file_by_name: dict[str, str] = {}
    for folder in places:
        for file in part_files(folder, files)[:_MAX_FOLDER_FILES]:
            part_file_by_name.setdefault(os.path.splitext(os.path.basename(file))[0], file)
    return part_file_by_name


def part_files(folder: str, files: Files = DISK) -> list[str]:
    """Paths of the YAML files in a folder of parts; raises `PartError` if the folder cannot be listed."""
    try:
        names = files.names(folder)
    except OSError as error:
        problem = f"cannot be listed: {error.strerror}"
        raise PartError(f"{folder}: cannot be listed", faults=[file_fault(problem)]) from None
    return [os.path.join(folder, name) for name in names if os.path.splitext(name)[1] in _SUFFIXES]


def finder_of(folder: str, files: Files = DISK) -> Find:
    """Return a function that finds parts: it takes the name of a part, and returns the path and content of its file.

    `folder` is the folder of the mission file. The function raises `PartError` if there is no part with this name, or
    if its file cannot be read.
    """

    def find(name: str) -> tuple[str, bytes]:
        file = _file_of(name, folder, files)
        return file, _content(file, files)

    return find


def find_part(name: str, beside: str) -> Part:
    """Read a part by the name that a mission in the folder `beside` uses for it.

    `name` is a name in the catalogue, or the path of a file relative to that folder.

    Raises
    ------
    PartError
        There is no part with this name, or its file is not a valid part.
    """
    return _entry(*finder_of(beside)(name)).part


def is_file(name: str) -> bool:
    """Whether a mission names a part by the path of a file; otherwise `name` is a name in the catalogue."""
    return name.endswith(_SUFFIXES)


def _file_of(name: str, beside: str, files: Files) -> str:
    """Path of the file of a part that a mission names; raises `PartError` if no folder contains the part.

    `beside` is the folder of the mission.
    """
    if is_file(name):
        return os.path.join(beside, name)
    searched_folders = folders(beside, files)
    for folder in searched_folders:
        with suppress(OSError):  # `catalogue` reports the folder below if no other folder has the part
            names = files.names(folder)
            for file in (name + suffix for suffix in _SUFFIXES):
                if file in names:
                    return os.path.join(folder, file)
    near = did_you_mean(name.lower(), tuple(catalogue(searched_folders, files)))
    raise PartError("is no part of the catalogue", hint=sentences("`bisar-budget sensors` lists them", near))


def with_parts(mission: Mission, find: Find, report: Report) -> Mission | Invalid:
    """Return the mission completed with figures of the parts that it names; `INVALID` if a problem was reported.

    `find` returns the path and content of a part's file, and may raise `PartError`.
    """
    is_valid, taken = True, list[TakenFigure]()
    platforms = mission.platforms
    for name, platform in platforms._asdict().items():
        path = ("platforms", name)
        error = _with_sensors(platform.motion_error, (*path, "motion_error"), find, report, taken)
        oscillator = platform.oscillator and _with_sensor(
            platform.oscillator, (*path, "oscillator"), find, report, taken
        )
        if INVALID in (error, oscillator):
            is_valid = False
            continue
        platforms = platforms._replace(**{name: platform._replace(motion_error=error, oscillator=oscillator)})
    return mission._replace(platforms=platforms, taken=tuple(taken)) if is_valid else INVALID


def report_parts(root: Mapping[str, object], find: Find, report: Report) -> None:
    """Report problems of the parts that an otherwise invalid mission file names.

    A valid section is checked together with its parts, as in a valid mission. For an invalid section, only the names
    of its parts are checked. `root` is the content of the mission file.
    """
    platforms = root.get("platforms")
    for name in Platforms._fields:
        platform = platforms.get(name) if isinstance(platforms, dict) else None
        if not isinstance(platform, dict):
            continue
        path: KeyPath = ("platforms", name)
        motion_path = (*path, "motion_error")
        content = platform.get("motion_error")
        if motion := _stand_in(MOTION_ERROR, content):
            _with_sensors(MotionError(**motion), motion_path, find, report, [])
        if isinstance(content, dict) and "navigation" not in motion:
            _report_aiding_parts(content.get("navigation"), (*motion_path, "navigation"), find, report)
        if oscillator := _stand_in(OSCILLATOR, platform.get("oscillator")):
            _with_sensor(Oscillator(**oscillator), (*path, "oscillator"), find, report, [])


def _report_aiding_parts(navigation: object, path: KeyPath, find: Find, report: Report) -> None:
    """Report problems of the parts that a `navigation` names, within a motion error that is invalid."""
    for kind, reader in (("imu", AIDED_IMU), ("gnss", AIDED_GNSS)):
        section = reader.each(navigation.get(kind) if isinstance(navigation, dict) else None)
        if isinstance(sensor := section.get("sensor"), str):
            _parts_of(sensor, (*path, kind, "sensor"), (kind,), find, report)


def _stand_in(section: Section[object], value: object) -> SectionValues:
    """Select the values of a section that are needed to check the parts that the section names.

    If all values of the section are valid, all are selected; otherwise only the names of the parts.
    """
    values = section.each(value)
    if INVALID not in values.values():
        return values
    return {key: item for key, item in values.items() if key == "sensor" and item is not INVALID}


def _parts_of(
    names: str | tuple[str, ...] | None, path: KeyPath, kinds: Sequence[str], find: Find, report: Report
) -> dict[str, Entry] | Invalid:
    """Find and read the parts that the key at `path` names, at most one of each kind in `kinds`.

    Returns a mapping of part names to entries, or `INVALID` if a problem was reported.
    """
    is_list = isinstance(names, tuple)
    entry_by_name: dict[str, Entry] = {}
    is_valid = True
    for index, name in enumerate(names if isinstance(names, tuple) else [names] if names else []):
        here = (*path, index) if is_list else path
        try:
            entry = _entry(*find(name))
            kind = entry.part.kind
            if kind not in kinds:
                raise PartError(f"is an {kind}" if kind != "gnss" else "is a GNSS receiver")
        except PartError as error:
            # If the part's file has faults, they state its name and the accepted values.
            accepted = "" if error.faults else f"accepted: parts of the kind {' or '.join(kinds)}"
            for problem in map(str, error.args):
                report(here, Problem(problem, accepted, error.hint, names_value=bool(error.faults)))
            is_valid = False
            continue
        if any(kind == earlier.part.kind for earlier in entry_by_name.values()):
            report(here, Problem(f"is a second {kind}", "accepted: one part of each kind"))
            is_valid = False
        entry_by_name[name] = entry
    return entry_by_name if is_valid else INVALID


def _with_sensors(
    error: MotionError, path: KeyPath, find: Find, report: Report, taken: list[TakenFigure]
) -> MotionError | Invalid:
    """Complete a motion error with the figures of the parts that it names; `INVALID` if a problem was reported.

    Figures that come from parts are appended to `taken`. If both the file and a part state a figure, the figure of
    the file is kept, and the figure of the part is added to `overridden` of the motion error.
    """
    if error.navigation is not None:
        navigation = _with_aiding_parts(error.navigation, (*path, "navigation"), find, report, taken)
        if navigation is INVALID:
            return INVALID
        error = error._replace(navigation=navigation)
    path = (*path, "sensor")
    entries = _parts_of(error.sensor, path, ("imu", "gnss"), find, report)
    if entries is INVALID:
        return INVALID
    of_parts = dict(error.of_parts)  # figures of an accuracy file may be there already
    overridden = list(error.overridden)
    for name, entry in entries.items():
        part = entry.part
        imu = error.imu or Imu()
        stating = imu if isinstance(part, ImuPart) else error
        figures = {}
        for figure, text in entry.figures.items():
            key = _own_key(error, stating, figure)
            if key:
                overridden.append(Overridden(figure, key, part.name, text))
            else:
                figures[figure] = getattr(part, figure)
        if isinstance(part, ImuPart):
            error = error._replace(imu=imu._replace(**figures))
        elif figures and error.frame != "scene":
            report(path, Problem(f"{shown(part.name)} is stated east, north, up", "accepted: frame: scene"))
            return INVALID
        elif any(error.distribution_of(kind) != "normal" for kind in figures.keys() & {"position", "velocity"}):
            report(path, Problem(f"{shown(part.name)} is stated as one sigma", "accepted: distribution: normal"))
            return INVALID
        else:
            error = error._replace(**figures)
        of_parts |= {figure: evidence(part, figure) for figure in figures}
        section = (*path[:-1], "imu") if isinstance(part, ImuPart) else path[:-1]
        taken += _taken(name, entry, section, figures)
    return error._replace(of_parts=tuple(of_parts.items()), overridden=tuple(overridden))


def _with_aiding_parts(
    navigation: Navigation, path: KeyPath, find: Find, report: Report, taken: list[TakenFigure]
) -> Navigation | Invalid:
    """Complete an aided navigation with the figures of the parts that it names; `INVALID` if a problem is reported.

    Figures that come from parts are appended to `taken`. If the file states the same figure as a part, the figure of
    the file is kept.
    """
    overridden, part_sources, is_valid = [], dict[str, str](), True
    for kind, figure_keys in (("imu", AIDED_IMU_FIGURES), ("gnss", AIDED_GNSS_FIGURES)):
        section: AidedImu | AidedGnss = getattr(navigation, kind)
        entries = _parts_of(section.sensor, (*path, kind, "sensor"), (kind,), find, report)
        if entries is INVALID:
            is_valid = False
            continue
        for name, entry in entries.items():
            stated = [figure for figure in entry.figures if figure in figure_keys]
            figures = {figure: getattr(entry.part, figure) for figure in stated if getattr(section, figure) is None}
            overridden += [
                Overridden(
                    f"{kind}.{figure}",
                    f"motion_error.navigation.{kind}.{figure}",
                    entry.part.name,
                    entry.figures[figure],
                )
                for figure in stated
                if figure not in figures
            ]
            section = section._replace(**figures)
            part_sources |= {f"{kind}.{figure}": evidence(entry.part, figure) for figure in figures}
            taken += _taken(name, entry, (*path, kind), figures)
            for figure in missing_figures(section):
                problem = f"is missing: {shown(entry.part.name)} states none"
                report((*path, kind, figure), Problem(problem, f"accepted: {figure}, or another part"))
                is_valid = False
        if isinstance(section, AidedImu):
            navigation = navigation._replace(imu=section)
        else:
            navigation = navigation._replace(gnss=section)
    if not is_valid:
        return INVALID
    return navigation._replace(part_sources=tuple(part_sources.items()), overridden=tuple(overridden))


def _taken(name: str, entry: Entry, section: KeyPath, figures: Collection[str]) -> Iterator[TakenFigure]:
    """Yield a `TakenFigure` for each figure in `figures`, in the order of the part's file.

    These are the figures that the section at the path `section` takes from the part with the name `name`.
    """
    for figure in entry.figures:
        if figure in figures:
            yield TakenFigure(".".join(map(str, (*section, figure))), entry.written[figure], name)


def _own_key(error: MotionError, stating: MotionError | Imu, figure: str) -> str:
    """Key under which the mission itself states a figure of a part; empty if only the part states the figure.

    The key is relative to the platform. `stating` is the section in which the mission could state the figure: the
    motion error itself, or its `imu`.
    """
    if figure in ("position", "velocity"):
        if error.covariance is not None:
            return "motion_error.covariance"
        if figure in dict(error.of_parts):
            return "trajectory.accuracy"
    if getattr(stating, figure) in (None, ()):
        return ""
    return f"motion_error.imu.{figure}" if isinstance(stating, Imu) else f"motion_error.{figure}"


def _with_sensor(
    oscillator: Oscillator, path: KeyPath, find: Find, report: Report, taken: list[TakenFigure]
) -> Oscillator | Invalid:
    """Complete an oscillator with the figures of the part that it names; `INVALID` if a problem was reported.

    Figures that come from the part are appended to `taken`. If both the file and the part state a figure, the figure
    of the file is kept, and the figure of the part is added to `overridden` of the oscillator. A phase-noise mask is
    valid only at the frequency at which it was measured. At another frequency, the same decibels would describe a
    better or a worse oscillator. If the noise of the part is a mask, a file that states another frequency must
    therefore also state the noise.
    """
    if oscillator.sensor is None:
        return oscillator
    entries = _parts_of(oscillator.sensor, (*path, "sensor"), ("oscillator",), find, report)
    if entries is INVALID:
        return INVALID
    entry = entries[oscillator.sensor]
    part: SectionValue = entry.part
    written, overridden, of_parts = entry.figures, [], []
    own_form = next((form for form in OSCILLATOR_NOISE_FORMS if getattr(oscillator, form) is not None), None)
    (form,) = [form for form in OSCILLATOR_NOISE_FORMS if getattr(part, form) is not None]
    figures: dict[str, SectionValue] = {}
    if own_form is None:
        figures = {form: getattr(part, form), "source": evidence(part, form)}
    else:
        # A power law describes the fractional frequency, which does not depend on the frequency.
        holds_at = "" if own_form != "phase_noise" or oscillator.frequency else written.get("frequency", "")
        overridden.append(
            Overridden(own_form, f"oscillator.{own_form}", part.name, f"{form} {written[form]}", holds_at)
        )
    if oscillator.frequency is None:
        figures["frequency"] = part.frequency
    elif part.frequency is not None and oscillator.frequency != part.frequency:
        at = written["frequency"]
        if own_form is None and form == "phase_noise":
            problem = f"the phase noise of {shown(part.name)} is stated at its own frequency, {at}"
            report(path, Problem(problem, "accepted: no frequency, or phase_noise beside it", at=("frequency",)))
            return INVALID
        if oscillator.needs_frequency:
            overridden.append(Overridden("frequency", "oscillator.frequency", part.name, at))
    for figure in BESIDE_NOISE:
        value = getattr(part, figure)
        if value is not None and getattr(oscillator, figure) is None:
            figures[figure] = value
            of_parts.append((figure, evidence(part, figure)))
        elif value is not None:
            overridden.append(Overridden(figure, f"oscillator.{figure}", part.name, written[figure]))
    completed = oscillator._replace(**figures, of_parts=tuple(of_parts), overridden=tuple(overridden))
    if completed.needs_frequency and completed.frequency is None:
        problem = f"{shown(part.name)} states no frequency, at which the mask or the tones are stated"
        report(path, Problem(problem, "accepted: oscillator.frequency", at=("frequency",)))
        return INVALID
    if completed.vibration is not None and completed.acceleration_sensitivity is None:
        report(path, NOT_SENSITIVE)
        return INVALID
    taken += _taken(oscillator.sensor, entry, path, figures)
    return completed


# ---------------------------------------------------------------------- JSON Schema of a part
_NOT_EMPTY: JsonObject = {"not": {"const": []}}  # an empty list states no figure


def part_schema() -> JsonObject:
    """JSON Schema of the file of a part, with one alternative for each kind.

    Quantities are described as in `mission_schema`.
    """
    definitions: Definitions = {}
    kinds = []
    for kind, section in PART_SECTIONS.items():
        kinds.append(section.schema(definitions))
        definitions[section.kind.__name__] |= _rules(FIGURES[kind])
    return {
        "$schema": DRAFT,
        "$id": "urn:bisar-budget:schema:part",
        "title": "bisar-budget part file",
        "description": "An inertial sensor, a GNSS receiver or an oscillator: its figures, and where they stand.",
        "type": "object",
        "required": ["kind"],
        "oneOf": kinds,
        "definitions": definitions,
    }


def _rules(figures: Sequence[str]) -> JsonObject:
    """Rules of the JSON Schema for the figures of a part.

    At least one figure is required. If `source` is a mapping of figures to sources, it contains every stated figure.
    An oscillator has exactly one form of noise, and a mask needs a frequency. The schema cannot reject figures that
    are zero, but the reader of parts rejects them.
    """
    by_itself = [figure for figure in figures if figure not in ("frequency", *BESIDE_NOISE)]
    alternatives = [{"required": [figure], "properties": {figure: _NOT_EMPTY}} for figure in by_itself]
    has_sources = {"required": ["source"], "properties": {"source": {"type": "object"}}}
    sourced = [
        {
            "if": {"allOf": [has_sources, {"required": [figure], "properties": {figure: _NOT_EMPTY}}]},
            "then": {"properties": {"source": {"required": [figure]}}},
        }
        for figure in figures
    ]
    if set(OSCILLATOR_NOISE_FORMS) <= set(figures):
        return {"oneOf": alternatives, "dependencies": {"phase_noise": ["frequency"]}, "allOf": sourced}
    return {"anyOf": alternatives, "allOf": sourced}
