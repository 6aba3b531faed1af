"""Names that a mission and its findings keep wherever the command runs, and words about a mission as a whole.

Names are ids of needs, fingerprints, test cases.

A mission is named by the number of its document, else by its path within its repository, else by the file's name.
The path is that of the file itself: given from the root of the repository, from a folder, absolutely or through a
symbolic link, it is one.
"""

import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.mission.model import Document
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.report import Style
from bisar_budget.report.words.requirements import RULES
from bisar_budget.report.words.sentences import phase_limit, sentence
from bisar_budget.units import format_quantity

_STANDARD_INPUT = "standard input"


class Identity(NamedTuple):
    """Name of a mission, which no other file of the run has, and the path by which reports name its file.

    `shared` are requirement ids, each with a row, that would name findings of other missions of the run too.
    """

    name: str
    path: str
    shared: frozenset[tuple[str, str]] = frozenset()

    def of(self, subject: str, requirement_id: str | None = None) -> tuple[str, ...]:
        """Parts of the name of a row or requirement: the project's own requirement id, else the mission, and it."""
        if requirement_id is None:
            return self.name, subject
        if (requirement_id, subject) in self.shared:
            return requirement_id, self.name, subject
        return requirement_id, subject


def identities(missions: Sequence[MissionFindings | UnusableMission], style: Style) -> list[Identity]:
    """Name every mission of a run; no name depends on the order in which they were given.

    Missions that share a document number have their path beside it. Files that share a path, in different
    repositories or in none, have as many folders before it as tell them apart.
    """
    places = [_place(mission.file, style) for mission in missions]
    files = [place.file for place in places]
    paths = _told_apart({place.file: place.portable_path for place in places})
    names = dict(paths)
    for mission, file in zip(missions, files, strict=True):
        if isinstance(mission, MissionFindings) and mission.document.number:
            names[file] = mission.document.number
    while alike := _alike(names):
        names |= {file: f"{names[file]}/{paths[file]}" for file in alike}
    shared = _shared_requirements(missions, files, names)
    return [Identity(names[place.file], place.portable_path, shared) for place in places]


def digest(*parts: str) -> str:
    """Digest of a name, the same on every machine, also of half a character, which the name of a file may have."""
    from hashlib import sha256  # loads OpenSSL: 5 ms, and a check to a terminal does without

    return sha256("\0".join(parts).encode(errors="surrogatepass")).hexdigest()


def distinct(spelled: Sequence[str], names: Sequence[tuple[str, ...]]) -> list[str]:
    """Spellings of names in a smaller alphabet; one that several names share has a digest of the name behind it."""
    uses = Counter(word for word, _ in set(zip(spelled, names, strict=True)))
    return [
        word if uses[word] == 1 else f"{word}_{digest(*name)[:8].upper()}"
        for word, name in zip(spelled, names, strict=True)
    ]


def stem(name: str) -> str:
    """Name of a mission without the ending of its file."""
    return name.removesuffix(".yaml").removesuffix(".yml")


def source_path(file: str, style: Style) -> str:
    """Path by which a mission file is found: within its repository, else below `style.root`, else absolute.

    With forward slashes; without a root the file is named as given.
    """
    if not style.root or file == "-":
        return file.replace(os.sep, "/")
    place = _place(file, style)
    if place.is_in_repository:
        return place.portable_path
    for name in (os.path.abspath(file), place.file):
        if path := _below(name, style.root):
            return path.replace(os.sep, "/")
    return os.path.abspath(file).replace(os.sep, "/")


class _FilePlace(NamedTuple):
    """Absolute path of a file, links followed, and the path that is the same on every machine, with forward slashes.

    That is within the repository, else the name of the file alone.
    """

    file: str
    portable_path: str
    is_in_repository: bool = False


def _place(file: str, style: Style) -> _FilePlace:
    """Find a file and the Git work tree that holds it.

    A link is followed. Where that leads out of every work tree, to a store of large files such as git-annex has in
    `.git`, the link itself is the file of the repository. One that leads to no file is that of a pipe.
    """
    if file == "-":
        return _FilePlace(_STANDARD_INPUT, _STANDARD_INPUT)
    if not style.root or "\0" in file:  # which no file has in its name
        return _FilePlace(file, file.replace(os.sep, "/"))
    link = os.path.join(os.path.realpath(os.path.dirname(file)), os.path.basename(file))
    target = os.path.realpath(file)
    if not os.path.exists(target):
        target = link
    for path in dict.fromkeys((target, link)):
        root = _work_tree(os.path.dirname(path), style)
        below = _below(path, root) if root else ""
        if below and not below.startswith(f".git{os.sep}"):
            return _FilePlace(path, below.replace(os.sep, "/"), is_in_repository=True)
    return _FilePlace(target, os.path.basename(target))


def _work_tree(folder: str, style: Style) -> str:
    """Nearest folder from here up with a `.git` (in worktrees and submodules a file), or GitHub's checkout."""
    while not (os.path.lexists(os.path.join(folder, ".git")) or (style.is_checkout and folder == style.root)):
        above = os.path.dirname(folder)
        if above == folder:
            return ""
        folder = above
    return folder


def _below(file: str, folder: str) -> str:
    """Path of a file from a folder that it lies in, however deep; empty if it does not."""
    start = os.path.join(folder, "")
    return file[len(start) :] if file.startswith(start) else ""


def _alike(names: Mapping[str, str]) -> list[str]:
    """Files that have not a name of their own."""
    uses = Counter(names.values())
    return [file for file, name in names.items() if uses[name] > 1]


def _told_apart(paths: Mapping[str, str]) -> dict[str, str]:
    """Put folders before the paths that several files have, until no two files have one; whole paths differ."""
    names, added = dict(paths), 0
    while alike := _alike(names):
        added += 1
        names |= {file: _with_folders(file, paths[file], added) for file in alike}
    return names


def _with_folders(file: str, path: str, count: int) -> str:
    """Path of a file with so many of the folders that stand before it."""
    whole = file.replace(os.sep, "/")
    parts, length = whole.strip("/").split("/"), path.count("/") + 1 + count
    return "/".join(parts[-length:]) if length <= len(parts) else whole


def _shared_requirements(
    missions: Sequence[MissionFindings | UnusableMission], files: Sequence[str], names: Mapping[str, str]
) -> frozenset[tuple[str, str]]:
    """Requirement ids with their row that stand in several files, or that are the name of a mission too."""
    used = {
        (row.requirement_id, row.id, file)
        for mission, file in zip(missions, files, strict=True)
        if isinstance(mission, MissionFindings)
        for row in mission.rows
        if row.requirement_id is not None
    }
    uses = Counter((requirement_id, row_id) for requirement_id, row_id, _ in used)
    taken = set(names.values())
    return frozenset(pair for pair, count in uses.items() if count > 1 or pair[0] in taken)


_MODELS = {
    "published": "published (Rigling & Moses, Tables I and II)",
    "full": "full (exact ranges, displacement included)",
    "strictest": "strictest (the stricter of published and full for each row)",
}
_NARROW_DEG = 30.0  # between range and Doppler gradients; below it the verdict says what that does


def document_words(document: Document) -> str:
    """Number and issue of a document; empty where the file gives neither."""
    return ", ".join(filter(None, (document.number, document.issue and f"issue {document.issue}")))


def narrow_gradients(geometry: BistaticGeometry) -> str:
    """Say what range and Doppler gradients close to parallel do to displacements; nothing from 30 degrees on."""
    angle = geometry.gradient_angle
    if math.degrees(angle) >= _NARROW_DEG:
        return ""
    return (
        f"Range and Doppler gradients are only {_degrees(angle)} apart: displacements are {1 / math.sin(angle):.2g} "
        "times those at right angles."
    )


def doubtful_model(mission: MissionFindings) -> str:
    """Say where the published model judges and does not hold, as a sentence; nothing if it does hold."""
    said = mission.model_doubt
    return f"{sentence(said)}." if said else ""


def head(mission: MissionFindings) -> Iterator[tuple[str, str]]:
    """Say in a few lines what was checked: geometry, resolution, budget, model."""
    geometry, allocation = mission.geometry, mission.allocation
    is_first = True  # the first squint says what one is
    for name, state in (("Transmitter", geometry.transmitter), ("Receiver", geometry.receiver)):
        yield name, _platform(state, is_first)
        is_first = is_first and state.squint is None
    if mission.place:
        yield "Place", mission.place
    for name, path in mission.paths:
        yield "Path", f"{name}: {path_words(path)}"
    yield (
        "Geometry",
        f"bistatic angle {_degrees(geometry.bistatic_angle)}, look azimuth {_degrees(geometry.look_azimuth)}, "
        f"range and Doppler gradients {_degrees(geometry.gradient_angle)} apart, "
        f"wavelength {format_quantity(mission.wavelength, 'm', 4)}",
    )
    yield (
        "Resolution",
        f"{format_quantity(mission.resolution.range, 'm')} range, "
        f"{format_quantity(mission.resolution.cross_range, 'm')} cross range (peak to null, on ground)",
    )
    split = allocation.qpe
    shares = f"transmitter {split.transmitter:.3g}, receiver {split.receiver:.3g}"
    shares += f", clock {split.clock:.3g}" if split.clock is not None else ""
    shares += f", reserve {split.reserve:.3g}" if split.reserve else ""
    gain = ""
    if allocation.n_pull is not None:
        gain = (
            f"; autofocus pulls in (corrects) up to {multiple_of_pi(allocation.n_pull)} rad: limits times "
            f"{allocation.autofocus_gain:.3g}"
        )
    yield "Budget", f"quadratic phase error (QPE) {phase_limit(allocation.qpe_total, mission)}: {shares}{gain}"
    yield "Model", f"{_MODELS[mission.model]}, {RULES[mission.combine]}"
    if mission.scene is not None and not mission.scene.degeneracy:
        radius = format_quantity(mission.scene.radius, "m")
        yield (
            "Scene",
            f"radius {radius}; one autofocus correction of the declared errors serves {mission.scene.served}",
        )
    if mission.coverage_factor != 1:
        yield "Coverage", f"navigation and clock: declared is {mission.coverage_factor:g} times the file's value"


def path_words(path: FlownPath) -> str:
    """Say where a path comes from, and how far the polynomial that stands for it is from what the file has."""
    said = path.source if path.file is None else f"{path.file}: {path.source}"
    if path.age is not None:
        when = "old" if path.age >= 0 else "ahead"
        said += f", {format_quantity(abs(path.age) / 86400, '')} days {when}"
    if path.order is None or path.farthest is None or path.rms is None:
        return said
    said += f"; flown as a polynomial of order {path.order}"
    if path.samples:
        rms, farthest = (format_quantity(one, "m") for one in (path.rms, path.farthest))
        within = "" if path.stretch is None else f" in {format_quantity(path.stretch, 's')}"
        return f"{said} through {path.samples} places{within}, {rms} rms and at most {farthest} from them"
    return f"{said}, at most {format_quantity(path.farthest, 'm')} from it"


def multiple_of_pi(factor: float) -> str:
    """Write 2 as 2π, 1 as π."""
    return "π" if factor == 1 else f"{factor:g}π"


def _platform(state: PlatformState, explains_squint: bool) -> str:
    squint = "still"
    if state.squint is not None:
        squint = f"squint {_degrees(state.squint)}" + (" off broadside" if explains_squint else "")
    return (
        f"{format_quantity(state.slant_range, 'm', 4)} away, azimuth {_degrees(state.azimuth)}, "
        f"elevation {_degrees(state.elevation)}, {squint}"
    )


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°".replace("-0.0°", "0.0°")
