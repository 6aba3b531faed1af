"""Arguments, tables, orbits, logs, radar files and parts as nobody should write them, for `docs/prove_hostile.py`.

    python -m tests.fuzz_commands 17     # the command lines of the questions, the same each time

What is asked starts from a key and a number of a mission, and is changed in what it says or in its characters. Files
are good ones, damaged.
"""

import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from bisar_budget.paths.log_places import LogKeys
from tests.conftest import TODAY, mission_text
from tests.formats.flown import SAMPLES, sample, written
from tests.fuzz import TEXTS, UNITS, damaged, original, places, tree_of
from tests.mission.test_path_files import aircraft, satellite
from tests.paths.flown import earth_fixed_csv, flight, geodetic_csv, sbet, smrmsg
from tests.paths.log_files import every_format, sentence
from tests.paths.orbit_files import TLE, oem, oem_xml, omm_csv, omm_json, omm_text, omm_xml

MISSION = "m.yaml"  # the file that a question is about
# Keys that a file may lack.
_KEYS = (
    "platforms.receiver.motion_error.velocity",
    "platforms.receiver.motion_error.velocity.0",
    "platforms.receiver.motion_error.sensor",
    "platforms.transmitter.motion_error",
    "platforms.transmitter.motion_error.vibration.sinusoidal.0.frequency",
    "platforms.receiver.position.1",
    "platforms.receiver.oscillator.sensor",
    "platforms.transmitter.acceleration",
    "common_motion_error.position",
    "timing_error.quadratic",
    "requirements.pslr",
    "requirements.location_error",
    "scene.radius",
    "scene.height_error",
    "allocation.coverage_factor",
    "allocation.combine",
    "autofocus.n_pull",
    "collection.pulses",
    "simulation.seed",
    "simulation.memory_limit",
    "other_errors.0.quadratic_phase_error",
    "waivers.0.id",
    "document",
    "name",
)
_NUMBER = re.compile(r"(-?\d+\.?\d*(?:[eE][-+]?\d+)?)\s*([^,]*)", re.ASCII)
_NUMBERS = (b"0", b"-1", b"1e308", b"NaN", b"INF", b"", b"x", b"9" * 400, b"1e-300", b"true", b"2", b"\xff")
_BARE = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}  # units of numbers that files have without
_COUNTS = ("", "0", "1", "-3", "1e3", "2.5", "٣", "3 ", "9" * 30, "99999999999", "x", "log")
_CHARACTERS = (*':=,.- []e9\n\t\x1b\u202e\u00b5#"', "..")
_ROWS = (*("receiver.velocity.x", "transmitter.velocity.y") * 8, "timing.quadratic", "other.e1", "receiver.*", "")
_FIELDS = (*("utilization", "allowable", "declared", "margin", "status", "islr_db") * 5, "line", "id", "")


class Question(NamedTuple):
    """Arguments of a command about `MISSION`, and the files beside it."""

    arguments: tuple[str, ...]
    files: Mapping[str, bytes]


def questions(seed: int) -> Iterator[Question]:
    """What is asked about the file of a seed of `tests.fuzz.case`: a sweep, a crossing, of some something else."""
    keys = _keys_of(original(Random(f"hostile {seed}")))
    random = Random(f"question {seed}")
    for ask in (
        _sweep,
        _solve,
        *((random.choice((_sweep, _sensitivity, _set, _trade, _allocate)),) * (seed % 8 == 0)),
    ):
        arguments, files = ask(random, keys)
        if ask is not _set and random.random() < 0.2:
            arguments += ("--set", _assignment(random, keys))
        if random.random() < 0.1:
            arguments += ("--model", random.choice((*("published", "full", "strictest") * 4, random.choice(TEXTS))))
        yield Question((*arguments, "--date", TODAY.isoformat()), files)


def _keys_of(text: str) -> dict[str, str]:
    """Every text of a mission by its key, for those that are numbers or words."""
    found: dict[str, str] = {}

    def walk(node: Any, path: tuple[str, ...]) -> None:
        for owner, name in places(node):
            if owner is not node:
                continue
            below = (*path, str(name))
            if isinstance(node[name], str):
                found[".".join(below)] = node[name]
            else:
                walk(node[name], below)

    walk(tree_of(text), ())
    return found


def _key(random: Random, keys: Mapping[str, str]) -> str:
    kind = random.random()
    if kind < 0.88:
        return random.choice([key for key, value in keys.items() if _NUMBER.match(value) and key != "schema_version"])
    if kind < 0.9:
        return random.choice(list(keys))
    if kind < 0.95:
        return random.choice(_KEYS)
    return _edited(random.choice(list(keys)), random) if kind < 0.98 else random.choice(TEXTS)


def _edited(text: str, random: Random) -> str:
    """Change some characters."""
    for _ in range(random.choice((1, 1, 2, 5))):
        at = random.randrange(len(text) + 1)
        kind = random.randrange(4)
        if kind == 0:
            text = text[:at] + random.choice(_CHARACTERS) + text[at:]
        elif kind == 1:
            text = text[:at] + text[at + 1 :]
        elif kind == 2:
            text = text[:at] + random.choice(_CHARACTERS) + text[at + 1 :]
        else:
            text = text[:at] + text[max(0, at - 5) : at] * random.choice((2, 30)) + text[at:]
    return text


def _numbers(random: Random, given: str, count: int) -> tuple[list[str], str]:
    """Numbers about one of a file, in rising order if it is positive, and their unit."""
    match = _NUMBER.match(given)
    number, unit = (float(match[1]), match[2].strip()) if match else (1.0, random.choice(UNITS))
    near = random.choice((*[0.3] * 8, 0.01, 0.01, 6.0))
    numbers = sorted((number or 1.0) * 10 ** random.uniform(-near, near) for _ in range(count))
    return [f"{one:.{random.choice((3, 3, 17))}g}" for one in numbers], unit


def _varied(random: Random, keys: Mapping[str, str]) -> str:
    """`KEY=FROM:TO UNIT:COUNT`, `KEY=VALUE,VALUE`; some are wrong somewhere."""
    key = _key(random, keys)
    if random.random() < 0.3:
        numbers, unit = _numbers(random, keys.get(key, ""), random.choice((1, 2, 3, 12)))
        text = f"{key}={','.join(numbers)} {unit}"
    else:
        (low, high), unit = _numbers(random, keys.get(key, ""), 2)
        count = str(random.randint(2, 9)) if random.random() < 0.9 else random.choice(_COUNTS)
        text = f"{key}={low}:{high} {unit}:{count}{random.choice((*[''] * 6, ':log'))}"
    kind = random.random()
    return text if kind < 0.85 else _edited(text, random) if kind < 0.97 else random.choice(TEXTS)


def _assignment(random: Random, keys: Mapping[str, str]) -> str:
    """`KEY=VALUE` of `--set`."""
    key = _key(random, keys)
    kind = random.random()
    if kind < 0.7:
        (value,), unit = _numbers(random, keys.get(key, ""), 1)
        value = f"{value} {unit}"
    elif kind < 0.85:
        value = random.choice(TEXTS)
    else:
        value = random.choice(("[1, 2, 3]", "{a: 1}", "[", "{", "&a [*a]", "!!int x", "a: b: c", "- 1", "|\n x", "'"))
    text = f"{key}={value}"
    return text if random.random() < 0.93 else _edited(text, random)


def _table(random: Random, keys: Mapping[str, str]) -> bytes:
    """A table of cases; some are damaged."""
    chosen = list(dict.fromkeys(_key(random, keys) for _ in range(random.choice((1, 1, 2, 3)))))
    lines = random.randint(1, 9)
    columns = []
    for key in chosen:
        numbers, unit = _numbers(random, keys.get(key, ""), lines)
        unit = unit or next((one for name, one in _BARE.items() if name in key), "")
        columns.append([f"{key} [{unit}]", *numbers])
    text = "\n".join(",".join(cells) for cells in zip(*columns, strict=True)) + "\n"
    if random.random() < 0.3:
        text = text.replace("\n", random.choice(("\r\n", "\n\n", "\r")))
        text = random.choice(("\ufeff", "# a comment\n", "\n\n")) + text
    data = text.encode("utf-8", "surrogatepass")
    for _ in range(random.choice((0, 0, 0, 0, 1, 2, 4))):
        data = damaged(data, random)
    return data


def _sweep(random: Random, keys: Mapping[str, str]) -> tuple[tuple[str, ...], dict[str, bytes]]:
    files: dict[str, bytes] = {}
    arguments: tuple[str, ...] = ("sweep", MISSION, "--jobs", "1")
    if random.random() < 0.35:
        files["cases.csv"] = _table(random, keys)
        arguments += ("--cases", "cases.csv")
    else:
        for _ in range(random.choice((1, 1, 1, 2))):
            arguments += ("--vary", _varied(random, keys))
        if random.random() < 0.15:
            how = f"latin:{random.choice((*_COUNTS[:8], *[5] * 60))}:{random.choice((*[1] * 20, '', 'x', '9' * 30))}"
            arguments += ("--sample", how if random.random() < 0.9 else random.choice(TEXTS))
    for _ in range(random.choice((0, 0, 1, 2))):
        column = f"{random.choice(_ROWS)}.{random.choice(_FIELDS)}"
        arguments += ("--column", column if random.random() < 0.95 else random.choice(TEXTS))
    output = random.choice((*(None, None, "o.csv", "o.parquet", "o.nc") * 4, "o.xlsx", "cases.csv"))
    arguments += ("-o", output) if output else ()
    if random.random() < 0.05:  # Matplotlib takes its time
        arguments += ("--plot", "p.svg", *random.choice(((), ("--polar",), ("--plot-column", "bistatic_angle"))))
    return arguments + (("--resume",) if random.random() < 0.1 else ()), files


def _solve(random: Random, keys: Mapping[str, str]) -> tuple[tuple[str, ...], dict[str, bytes]]:
    key = _key(random, keys)
    arguments: tuple[str, ...] = ("solve", MISSION, "--for", key if random.random() < 0.9 else _edited(key, random))
    if random.random() < 0.6:
        (low, high), unit = _numbers(random, keys.get(key, ""), 2)
        text = f"{low}..{high} {unit}"
        arguments += ("--between", text if random.random() < 0.85 else _edited(text, random))
    arguments += ("--scale",) if random.random() < 0.1 else ()
    arguments += ("--row", random.choice(_ROWS)) if random.random() < 0.2 else ()
    arguments += ("--target", "warn") if random.random() < 0.2 else ()
    return arguments + (("--format", "json") if random.random() < 0.5 else ()), {}


def _sensitivity(random: Random, keys: Mapping[str, str]) -> tuple[tuple[str, ...], dict[str, bytes]]:
    arguments: tuple[str, ...] = ("sensitivity", MISSION)
    arguments += ("--row", random.choice(_ROWS)) if random.random() < 0.3 else ()
    arguments += ("--plot", "p.svg") if random.random() < 0.05 else ()
    return arguments + (("--format", "json") if random.random() < 0.5 else ("-o", "o.txt")), {}


def _allocate(random: Random, keys: Mapping[str, str]) -> tuple[tuple[str, ...], dict[str, bytes]]:
    arguments: tuple[str, ...] = ("allocate", MISSION, "--set", f"allocation.combine={random.choice(('rss', 'sum'))}")
    for _ in range(random.choice((0, 0, 1, 2))):
        key = _key(random, keys) if random.random() < 0.5 else random.choice(_KEYS)
        arguments += ("--for", key if random.random() < 0.9 else _edited(key, random))
    if random.random() < 0.5:
        arguments += ("--reserve", random.choice((*("0", "5", "20", "99") * 4, *_COUNTS, "nan", "-1", "100")))
    arguments += ("--compare", MISSION) if random.random() < 0.2 else ()
    formats = ("json", "csv", "markdown", "html", "needs", "sdoc", "text")
    written = random.choice(((), ("-o", "o.yaml"), ("-o", "o.txt")))
    return (*arguments, "--format", random.choice(formats), *written), {}


def _trade(random: Random, keys: Mapping[str, str]) -> tuple[tuple[str, ...], dict[str, bytes]]:
    """A trade study of a report."""
    sweeps = [_varied(random, keys) for _ in range(random.choice((1, 1, 2)))]
    formats = ("--format", random.choice(("html", "markdown", "json")))
    return ("check", MISSION, *(part for one in sweeps for part in ("--sweep", one)), *formats), {}


def _set(random: Random, keys: Mapping[str, str]) -> tuple[tuple[str, ...], dict[str, bytes]]:
    command = random.choice((("check", MISSION), ("check", "-q", MISSION), ("diff", MISSION)))
    sets = [_assignment(random, keys) for _ in range(random.choice((1, 1, 2, 3)))]
    formats = ("--format", random.choice(("json", "markdown", "text")))
    return (*command, *(part for one in sets for part in ("--set", one)), *formats), {}


def flown(seed: int) -> dict[str, bytes]:
    """A mission whose platform is an orbit or a log, and the files that it names, one of them damaged."""
    random = Random(f"flown {seed}")
    text, files = random.choice(_flights())()
    files = dict(files)
    broken = random.choice((*files, MISSION)) if random.random() < 0.95 else random.choice(list(files))
    data = text.encode() if broken == MISSION else files[broken]
    for _ in range(random.choice((0, 1, 1, 1, 2, 8))):
        data = damaged(data, random)
    return {MISSION: text.encode(), **files, broken: data}


@cache
def _flights() -> tuple[Callable[[], tuple[str, dict[str, bytes]]], ...]:
    """Missions with the files that they name."""
    log = flight()

    def orbit(kind: str, name: str, data: str | bytes) -> Callable[[], tuple[str, dict[str, bytes]]]:
        file = {name: data.encode() if isinstance(data, str) else data}
        return lambda: (satellite(platforms__transmitter={"orbit": {kind: name}}), file)

    def route(files: Mapping[str, bytes], **more: Any) -> Callable[[], tuple[str, dict[str, bytes]]]:
        name = next(iter(files))
        return lambda: (aircraft(platforms__receiver={"trajectory": {"file": name, **more}}), dict(files))

    return (
        orbit("tle", "a.tle", TLE),
        orbit("omm", "a.json", omm_json()),
        orbit("omm", "a.xml", omm_xml()),
        orbit("omm", "a.csv", omm_csv()),
        orbit("omm", "a.txt", omm_text()),
        orbit("oem", "a.oem", oem()),
        orbit("oem", "a.oem.xml", oem_xml(oem())),
        route({"flight.csv": geodetic_csv(log)}),
        route({"earth.csv": earth_fixed_csv(log)}),
        route({"sbet.out": sbet(log)}, week=2421),
        route({"sbet.out": sbet(log), "smrmsg.out": smrmsg(log.times)}, week=2421, accuracy="smrmsg.out"),
        *(route({name: data}, **keys) for name, (_, data, keys) in every_format(log).items()),
    )


class BrokenLog(NamedTuple):
    """A damaged log: the name of its file, its bytes, the format that a mission states and what else it says."""

    name: str
    data: bytes
    stated: str | None
    keys: LogKeys


def broken_log(seed: int) -> BrokenLog:
    """A log of a short flight, with other bytes and numbers, or cut off; some are said to be of another format."""
    random = Random(f"log {seed}")
    files = _logs()
    name = random.choice(sorted(files))
    kind, data, _ = files[name]
    for _ in range(random.choice((0, 1, 1, 2, 8))):
        data = random.choice((damaged, _cut, _flipped, _with_number, _with_number))(data or b"\n", random)
    if kind == "nmea" and random.random() < 0.7:  # so that what is wrong is looked at
        data = re.sub(rb"\$([^$*\r\n]*)\*[0-9A-F]{2}", lambda one: sentence(one[1].decode("latin-1")).encode(), data)
    stated = random.choice((None, None, kind, random.choice(("csv", "sbet", "pos", "nmea", "gpx", "ulog"))))
    scale = random.choice((*[None] * 8, "utc", "gps", "tai"))
    week = random.choice((*[None] * 8, 2421)) if kind != "sbet" else 2421
    return BrokenLog(name, data, stated, LogKeys(week, scale, random.choice((None, None, 47.0))))


@cache
def _logs() -> Mapping[str, tuple[str, bytes, Any]]:
    log = flight(34)
    return {
        **every_format(log),
        "flight.csv": ("csv", geodetic_csv(log), {}),
        "earth.csv": ("csv", earth_fixed_csv(log), {}),
        "sbet.out": ("sbet", sbet(log), {}),
    }


def _cut(data: bytes, random: Random) -> bytes:
    """Leave out the end, or the begin."""
    at = random.randrange(len(data) + 1)
    return data[:at] if random.random() < 0.7 else data[at:]


def _with_number(data: bytes, random: Random) -> bytes:
    """Another number in the place of one."""
    found = list(re.finditer(rb"[-+]?\d+\.?\d*", data))
    if not found:
        return damaged(data, random)
    chosen = random.choice(found)
    return data[: chosen.start()] + random.choice(_NUMBERS) + data[chosen.end() :]


def radar_file(seed: int) -> bytes:
    """A CPHD, CRSD or SICD header, or a CPHD file with pulses, damaged."""
    random = Random(f"radar {seed}")
    data = random.choice(_radar_files())
    for _ in range(random.choice((1, 1, 1, 2, 8))):
        data = damaged(data, random) if random.random() < 0.3 else _renumbered(data, random)
    return data


@cache
def _radar_files() -> tuple[bytes, ...]:
    samples = [path.read_bytes() for path in sorted(SAMPLES.glob("*.xml"))]
    with TemporaryDirectory() as folder:
        path = Path(folder, "a.cphd")
        written(path, sample("example-cphd-1.0.1.xml"))
        return (*samples, path.read_bytes())


def _renumbered(data: bytes, random: Random) -> bytes:
    """Another number or word between two tags."""
    found = list(re.finditer(rb">([^<>\s][^<>]*)<", data))
    if not found:
        return damaged(data, random)
    chosen = random.choice(found)
    return data[: chosen.start(1)] + random.choice(_NUMBERS) + data[chosen.end(1) :]


def targets(seed: int) -> tuple[str, ...]:
    """Arguments that write the phase history of a small mission."""
    random = Random(f"targets {seed}")
    given = random.choice(("0, 0", "0, 0; 3 m, -2 m, -6 dB", "grid:3x3:2", "0, 0; clutter -20 dB", "t.csv"))
    kind = random.random()
    text = given if kind < 0.3 else _edited(given, random) if kind < 0.9 else random.choice(TEXTS)
    return ("simulate", MISSION, "-o", "o.cphd", "--targets", text)


def small_mission() -> str:
    """A mission whose phase history is small."""
    return mission_text(collection__aperture_time="0.2 s", radar__bandwidth="20 MHz")


def break_parts(folder: Path, seed: int) -> str:
    """Damage a file of a folder of parts; says which and how."""
    random = Random(f"parts {seed}")
    files = sorted(folder.iterdir())
    file = random.choice(files)
    other = random.choice(files)
    ways: Sequence[Callable[[], object]] = (
        lambda: file.write_bytes(damaged(file.read_bytes(), random)),
        lambda: file.write_bytes(_flipped(file.read_bytes(), random)),
        lambda: file.write_bytes(file.read_bytes()[: random.randrange(file.stat().st_size)]),
        lambda: file.write_bytes(other.read_bytes()),
        lambda: file.unlink(),
        lambda: (file.unlink(), file.mkdir()),
        lambda: (file.unlink(), file.symlink_to("/dev/zero" if random.random() < 0.3 else other)),
        lambda: file.chmod(0),
        lambda: (folder / ".part-000000000000.parquet.1").write_bytes(b"x"),
    )
    way = random.randrange(len(ways))
    ways[way]()
    return f"{file.name}, way {way}"


def _flipped(data: bytes, random: Random) -> bytes:
    """Change a bit."""
    at = random.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << random.randrange(8)]) + data[at + 1 :]


if __name__ == "__main__":
    for asked in questions(int(sys.argv[1])):
        print(shlex.join(["bisar-budget", *asked.arguments]))
        for name, content in asked.files.items():
            print(f"# {name}:\n{content.decode('utf-8', 'backslashreplace')}")
