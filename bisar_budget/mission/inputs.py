"""Files that a mission reads, and their SHA-256 digests."""

import os
from collections.abc import Iterator
from hashlib import sha256
from typing import NamedTuple

from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import is_file
from bisar_budget.resources import resource


class InputFile(NamedTuple):
    """A file that a mission reads.

    `use` tells for which purpose the mission reads the file, and `name` is the name in the mission. `path` is the
    path on disk; it is empty for a part from the catalogue of this package. `digest` is the SHA-256 digest.
    """

    use: str
    name: str
    path: str
    digest: str


_USES_BESIDE = {"accuracy": "accuracy of the path of the {}", "earth_orientation": "orientation of the Earth"}


def input_files(mission: Mission) -> list[InputFile]:
    """List the files that a mission reads.

    These are the mission file and the files of its requirements, logs, orbits and parts. Files that belong to a log
    or an orbit, such as the file with its accuracy, are also listed.
    """
    return list(dict.fromkeys(_input_files(mission)))


def _input_files(mission: Mission) -> Iterator[InputFile]:
    folder = folder_of(mission.file)
    yield InputFile("mission", mission.file, mission.file, sha256(mission.data).hexdigest())
    if name := getattr(mission.requirements, "file", None):
        from bisar_budget.mission.paths import reader_of  # imports the readers of all paths
        from bisar_budget.paths.flight import PathFileError

        try:
            digest = sha256(reader_of(folder)(name)).hexdigest()
        except PathFileError:  # it was removed after the mission was read
            digest = ""
        yield InputFile("requirements", name, os.path.join(folder, name), digest)
    for owner, platform in mission.platforms._asdict().items():
        if platform.path is None:
            continue
        if platform.path.file is not None and platform.path.sha256 is not None:
            name, digest = platform.path.file, platform.path.sha256
            yield InputFile(f"path of the {owner}", name, os.path.join(folder, name), digest)
        for use, file in platform.path.beside.items():
            if file is not None:
                words = _USES_BESIDE[use].format(owner)
                yield InputFile(words, file[0], os.path.join(folder, file[0]), file[1])
    catalogue = os.path.join(str(resource("specs", "sensors")), "")
    for part_file in mission.parts:
        is_of_catalogue = not is_file(part_file.name) and part_file.file.startswith(catalogue)
        path = "" if is_of_catalogue else part_file.file
        name = part_file.name if is_file(part_file.name) else os.path.basename(part_file.file)
        use = "part of the catalogue" if is_of_catalogue else "part"
        yield InputFile(use, name, path, sha256(part_file.data).hexdigest())
