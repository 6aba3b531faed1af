"""Mission and settings files as nobody should write them: what `docs/prove_hostile.py` feeds the tool.

    python -m tests.fuzz 17 > hostile.yaml      # the same bytes each time, to reproduce a case

A case starts from a mission that comes with the tool, or from a random one, and is changed in its structure or in its
bytes. It is drawn from `random.Random` by its seed.
"""

import json
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from random import Random
from typing import Any, NamedTuple

import yaml

from bisar_budget.mission.model import mission_schema
from tests.conftest import ROOT
from tests.families import FAMILIES, mission_text
from tests.yaml_text import yaml_text

# What does something to a terminal, and what a runner takes for a command.
RAW = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2066-\u2069]")
RUN = re.compile(r"(?m)^\s*::|##\[|##vso\[")

TEXTS = (
    "",
    " ",
    "~",
    "null",
    "true",
    "no",
    "0x10",
    "010",
    "1_000",
    "1e400 m",
    "-1e-400",
    "NaN",
    ".Inf",
    "-INF km",
    "9" * 400,
    "1" + "0" * 5000,
    "1 parsec",
    "3 dBi",
    "9**9**9 m",
    "1,5 m",
    "１２ m",
    "½ m",
    "1 µm",
    "45°",
    "- 5 m",
    "\x1b[2J",
    "\x9b31m",
    "\u202e evil",
    "\u2066x\u2069",
    "\u200b",
    "\u200f",
    "\ufeff",
    "\x00",
    "\ud800",
    "a\nb",
    "\r\n",
    "::error::x",
    "##[group]x",
    "##vso[task.complete]",
    "=1+1",
    "@SUM(A1)",
    "<script>alert(1)</script>",
    "]]>",
    "&amp;",
    "{{7*7}}",
    "{% raw %}",
    "$\\frac$",
    "`x`",
    "| a | b |",
    "[x](javascript:1)",
    ".. raw:: html",
    "[[copy('id')]]",
    "%0A",
    "../../etc/passwd",
    "-",
    "--strict",
    "*",
    "receiver.*",
    "other.[",
    "2030-01-01",
    "2019-13-45",
    "9999-12-31",
    "🛰️",
    "e\u0301" * 50,
    "x" * 499,
    "x" * 501,
    "\U000e0041",
    "\u2028",
)
UNITS = (
    "m",
    "km",
    "m/s",
    "mm/s",
    "m/s^2",
    "s",
    "ns",
    "Hz",
    "GHz",
    "MHz",
    "deg",
    "rad",
    "dB",
    "%",
    "1/s",
    "1/s^2",
    "B",
    "",
)
_WORDS = (
    "scene",
    "track",
    "look",
    "each",
    "sum",
    "rss",
    "published",
    "full",
    "strictest",
    "balanced",
    "equal",
    "normal",
    "uniform",
    "bound",
    "pga",
    "map_drift",
    "uniform",
    "taylor",
)
_LOADER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_BYTES = (
    b"\x00",
    b"\xff",
    b"\xef\xbb\xbf",
    b"\r",
    b"\t",
    b"\n",
    b"\xc2\x85",
    b"\xe2\x80\xae",
    b"\xed\xa0\x80",
    b"&a ",
    b"*a",
    b"!!int ",
    b"---\n",
    b"...\n",
    b"%YAML 9\n",
    b"#",
    b"'",
    b'"',
    b"|\n",
    b">\n",
    b"? ",
    b": ",
    b"- ",
    b"[",
    b"]",
    b"{",
    b"}",
    b",",
    b"[" * 60,
    b"{a: " * 30,
    b"<<: ",
    b"\\",
    b"\x1b[31m",
    b"::error::",
    b"e308",
    b"0",
    b"-",
)


class Case(NamedTuple):
    """A file, and whether a key of it was misspelt, which no reader may pass over."""

    data: bytes
    is_misspelt: bool = False


@cache
def _known() -> tuple[str, ...]:
    folders = (ROOT / "specs" / "missions", ROOT / "examples")
    return tuple(
        path.read_text(encoding="utf-8")
        for folder in folders
        for path in sorted(folder.rglob("*.yaml"))
        if "schema_version" in path.read_text(encoding="utf-8")
    )


def tree_of(text: str) -> Any:
    """What a file says, as text."""
    return yaml.load(text, _LOADER)


def original(random: Random) -> str:
    """A mission that can be used."""
    if random.random() < 0.7:
        return random.choice(_known())
    text = mission_text(random.choice(FAMILIES), random.randrange(10_000))
    if random.random() < 0.5:
        return text
    tree = tree_of(text)
    _with_instruments(tree, random)
    return yaml_text(tree, width=1000)


def _mask(random: Random) -> dict[str, str]:
    first, level = random.choice((0.01, 1, 3)), random.uniform(-140, -100)  # at 10 Hz
    return {
        f"{first} Hz": f"{level + 30 * math.log10(10 / first):.1f} dBc/Hz",
        "10 Hz": f"{level:.1f} dBc/Hz",
        f"{random.choice((1, 20))} kHz": f"{level - 25:.1f} dBc/Hz",
    }


def _with_instruments(tree: Any, random: Random) -> None:
    """Add figures of data sheets, each of a size that a part has, to a mission that can be used."""

    def near(size: float, unit: str) -> Any:
        values = [f"{size * 10 ** random.uniform(-1, 1):.3g} {unit}" for _ in range(3)]
        return values if random.random() < 0.3 else values[0]

    figures = {
        "accelerometer_bias": (50, "ug"),
        "attitude": (0.02, "deg"),
        "gyro_bias": (0.5, "deg/h"),
        "velocity_random_walk": (0.05, "m/s/sqrt(h)"),
        "angle_random_walk": (0.1, "deg/sqrt(h)"),
    }
    oscillators: tuple[Callable[[], dict[str, Any]], ...] = (
        lambda: {"sensor": random.choice(("ettus-gpsdo-ocxo", "bva", "gps-3500", "sit5358"))},
        lambda: {"frequency": "10 MHz", "phase_noise": _mask(random)},
        lambda: {"allan_deviation": {f"{tau} s": f"{10 ** random.uniform(-13, -10):.2g}" for tau in (0.1, 1, 10)}},
        lambda: {"power_law": {f"h{n}": f"{10 ** random.uniform(-30, -20):.2g}" for n in range(-2, 3)}},
    )
    for platform in tree["platforms"].values():
        error = platform.setdefault("motion_error", {})
        if random.random() < 0.7:
            chosen = random.sample(sorted(figures), random.randint(1, len(figures)))
            error["imu"] = {name: near(*figures[name]) for name in chosen}
        is_usual = (error.get("frame", "scene"), error.get("distribution", "normal")) == ("scene", "normal")
        if random.random() < 0.3 and is_usual:
            error["sensor"] = random.choice(("stim300", "hg9900", ["imx6", "mosaic-x5-rtk"]))
        if random.random() < 0.4:
            lasts = f"{10 ** random.uniform(-2, 2):.3g} s"
            error["random"] = [{"name": "GNSS", "sigma": near(0.003, "m"), "correlation_time": lasts}]
        if random.random() < 0.6:
            platform["oscillator"] = random.choice(oscillators)()
    if random.random() < 0.5:
        interval = float(tree["collection"]["aperture_time"]) / random.choice(
            (0.5, 1, 2, 5, 50, random.uniform(1, 9))
        )
        tree["synchronization"] = (
            {"method": "direct_path", "error": "3 deg"}
            if random.random() < 0.3
            else {"interval": f"{interval:.6g} s", "error": f"{random.uniform(0, 9):.2g} deg"}
        )
    if random.random() < 0.5:
        tree["requirements"]["islr"] = f"{random.uniform(-30, -15):.3g} dB"


def case(seed: int) -> Case:
    """The hostile file of a seed."""
    random = Random(f"hostile {seed}")
    text = original(random)
    kind = random.random()
    if kind < 0.1:
        return _misspelt(text, random)
    if kind < 0.8:
        tree = tree_of(text)
        changes = (_scale, _section, from_schema) if kind < 0.45 else _CHANGES  # many that can be used
        for _ in range(random.choice((1, 1, 1, 2, 3, 8))):
            _change(tree, random, changes)
        text = _written(tree, random)
        if kind < 0.75:
            return Case(text.encode("utf-8", "surrogatepass"))
    data = text.encode("utf-8", "surrogatepass")
    for _ in range(random.choice((1, 1, 2, 4, 16))):
        data = damaged(data, random)
    return Case(data)


def _written(tree: Any, random: Random) -> str:
    if random.random() < 0.1:
        return json.dumps(tree, ensure_ascii=random.random() < 0.5)
    style = {"default_flow_style": random.choice((None, True, False)), "allow_unicode": random.random() < 0.7}
    return yaml_text(tree, width=random.choice((40, 1000)), **style)


def places(node: Any) -> Iterator[tuple[Any, Any]]:
    """Every container with a key or index of it."""
    items = list(node.items()) if isinstance(node, dict) else list(enumerate(node)) if isinstance(node, list) else []
    for key, value in items:
        yield node, key
        yield from places(value)


_schema = cache(mission_schema)


@cache
def _keys_of_missions() -> frozenset[str]:
    """Every key that a mission file may have: `islr` is one letter from `pslr`."""

    def below(schema: Any) -> Iterator[str]:
        if isinstance(schema, dict):
            yield from schema.get("properties", ())
        for inner in schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else ():
            yield from below(inner)

    return frozenset(below(_schema()))


def _misspelt(text: str, random: Random) -> Case:
    """A key with one letter changed, in a section whose keys are known."""
    tree = tree_of(text)
    free = id(tree.get("requirement_ids"))
    keys = [
        (node, key)
        for node, key in places(tree)
        if isinstance(node, dict) and id(node) != free and not key[0].isdigit()  # 1 mHz for 1 kHz is no slip to find
    ]
    node, key = random.choice(keys)
    known = {name for _, name in keys} | _keys_of_missions()
    wrong = key
    while wrong in known:
        at = random.randrange(len(key))
        wrong = key[:at] + random.choice("abcdefghijklmnopqrstuvwxyz_-") + key[at + 1 :]
    items = [(wrong if name == key else name, value) for name, value in node.items()]
    node.clear()
    node.update(items)
    return Case(_written(tree, random).encode(), is_misspelt=True)


def _change(tree: Any, random: Random, changes: Sequence[Callable[..., None]]) -> None:
    """Change one place of the tree."""
    node, key = random.choice(list(places(tree)) or [(tree, None)])
    if key is None:
        return
    random.choice(changes)(tree, node, key, random)


def _replace(tree: Any, node: Any, key: Any, random: Random) -> None:
    node[key] = _value(random)


def _scale(tree: Any, node: Any, key: Any, random: Random) -> None:
    """A number of any size in place of one that was there, with its unit: most give a mission that can be used."""
    leaves = [
        (one, name)
        for one, name in places(tree)
        if isinstance(one[name], str) and re.match(r"-?\d", one[name]) and name != "schema_version"
    ]
    for one, name in random.sample(leaves, min(len(leaves), random.choice((1, 1, 2, 5, 20)))):
        number, unit = re.match(r"(-?[\d.]+(?:[eE][-+]?\d+)?)(.*)", one[name], re.DOTALL).groups()
        near = 10 ** random.uniform(-0.5, 0.5)
        size = random.choice((*[near] * 12, 10 ** random.uniform(-3, 3), 10 ** random.uniform(-15, 15), 0.0, -1.0))
        try:
            one[name] = f"{float(number) * size:.6g}{unit}"
        except ValueError:
            one[name] = _value(random)


def _delete(tree: Any, node: Any, key: Any, random: Random) -> None:
    del node[key]


def _swap(tree: Any, node: Any, key: Any, random: Random) -> None:
    other, its_key = random.choice(list(places(tree)))
    node[key], other[its_key] = json.loads(json.dumps([other[its_key], node[key]]))


def _insert(tree: Any, node: Any, key: Any, random: Random) -> None:
    if isinstance(node, dict):
        node[random.choice((*TEXTS, "motion_error", "source", "waivers", "position"))] = _value(random)
    else:
        node.insert(key, _value(random))


def _repeat(tree: Any, node: Any, key: Any, random: Random) -> None:
    if isinstance(node, list):
        node[key:key] = json.loads(json.dumps([node[key]] * random.choice((1, 3, 40, 1001))))
    else:
        node[key] = [node[key]] * random.choice((1, 2, 3, 6))


def _bury(tree: Any, node: Any, key: Any, random: Random) -> None:
    for _ in range(random.choice((1, 2, 12, 25))):
        node[key] = [node[key]] if random.random() < 0.5 else {"x": node[key]}


def _section(tree: Any, node: Any, key: Any, random: Random) -> None:
    """A section that the mission may lack, with values in and out of bounds."""
    if not isinstance(tree, dict):
        return
    number = abs(_number(random))
    platforms = tree.get("platforms")
    platform = random.choice(list(platforms.values())) if isinstance(platforms, dict) and platforms else {}
    platform = platform if isinstance(platform, dict) else {}
    errors = [
        {
            "name": _value(random) if random.random() < 0.2 else f"e{i}",
            "quadratic_phase_error": f"{_number(random)} deg",
        }
        for i in range(random.choice((1, 3, 30)))
    ]
    ids = ("receiver.*", "*", "other.e1", "timing.quadratic", "nobody", "mission.*", random.choice(TEXTS))
    waivers = [
        {"id": random.choice(ids), "until": random.choice(("2020-01-01", "2099-12-31")), "reason": "r"}
        for _ in range(random.choice((1, 3, 30)))
    ]
    vibration = {
        "sinusoidal": [
            {
                "amplitude": random.choice((f"{_number(random)} um", [f"{_number(random)} um"] * 3)),
                "frequency": f"{_number(random)} Hz",
            }
            for _ in range(random.choice((1, 2, 20)))
        ],
        "wideband": {"rms": f"{_number(random)} um"},
    }
    covariance = {
        "position": f"{number} m",
        "velocity": f"{_number(random)} mm/s",
        "correlation": {"position.x-velocity.x": str(random.uniform(-1.1, 1.1))},
    }
    choices: dict[str, Callable[[], Any]] = {
        "other_errors": lambda: tree.update(other_errors=errors),
        "waivers": lambda: tree.update(waivers=waivers),
        "requirement_ids": lambda: tree.update(requirement_ids={one: random.choice(TEXTS) for one in ids}),
        "requirements": lambda: tree.update(
            requirements={
                "quadratic_phase_error": f"{number} deg",
                "pslr": f"{-abs(_number(random)):.3g} dB",
                "islr": "-20 dB",
                "location_error": f"{_number(random)} m",
                "cubic_phase_error": f"{_number(random)} deg",
            }
        ),
        "allocation": lambda: tree.update(
            allocation={
                "split": random.choice(("equal", "balanced")),
                "combine": random.choice(("each", "sum", "rss")),
                "model": random.choice(("published", "full", "strictest")),
                "coverage_factor": str(number if number >= 1 else 1 + number),
            }
        ),
        "autofocus": lambda: tree.update(autofocus={"n_pull": str(number)}),
        "scene": lambda: tree.update(scene={"radius": f"{number} m", "height_error": f"{_number(random)} m"}),
        "timing": lambda: tree.update(
            timing_error={name: str(_number(random) * 1e-9) for name in ("constant", "linear", "quadratic", "cubic")}
        ),
        "common": lambda: tree.update(
            common_motion_error={"position": f"{number} m", "velocity": f"{_number(random)} m/s"}
        ),
        "name": lambda: tree.update(name=random.choice(TEXTS), document={"number": random.choice(TEXTS)}),
        "vibration": lambda: platform.update(motion_error={"vibration": vibration}),
        "covariance": lambda: platform.update(motion_error={"covariance": covariance}),
        "imu": lambda: platform.update(
            motion_error={
                "imu": {"accelerometer_bias": f"{number} ug", "attitude": f"{_number(random)} deg"},
                "random": [
                    {"name": _value(random), "sigma": f"{_number(random)} m", "correlation_time": f"{number} s"}
                ],
                "sensor": random.choice(("stim300", "bva", random.choice(TEXTS))),
            }
        ),
        "oscillator": lambda: platform.update(
            oscillator={
                "frequency": f"{_number(random)} MHz",
                "phase_noise": {f"{abs(_number(random))} Hz": f"{_number(random)} dBc/Hz" for _ in range(3)},
                "bandwidth": f"{_number(random)} Hz",
            }
        ),
        "allan deviation": lambda: platform.update(
            oscillator={
                "allan_deviation": {f"{abs(_number(random))} s": f"{_number(random) * 1e-12}" for _ in range(4)}
            }
        ),
        "synchronization": lambda: tree.update(
            synchronization={
                "interval": f"{_number(random)} s",
                "error": f"{_number(random)} deg",
                "method": random.choice(("linear", "direct_path")),
            }
        ),
        "acceleration": lambda: platform.update(acceleration=[f"{_number(random)} m/s^2"] * 3),
    }
    choices[random.choice(list(choices))]()


# Quantities of a size that missions have, and their keys; the rest have a unit at random.
_QUANTITIES = {
    key: quantity
    for quantity, keys in {
        (1, "m"): "position sigma location_error height_error geoid_separation arm",
        (0.05, "m"): "zenith_delay uncertainty",
        (10, "um"): "amplitude rms",
        (0.01, "m/s"): "velocity speed climb",
        (1e-3, "m/s^2"): "acceleration",
        (1e-3, "m/s^3"): "jerk",
        (1e-4, "m/s^4"): "snap",
        (3, "deg"): "attitude heading azimuth elevation motion_azimuth latitude longitude error",
        (30, "deg"): "quadratic_phase_error cubic_phase_error",
        (0.2, "arcsec"): "polar_motion_x polar_motion_y",
        (0.1, "s"): "ut1_minus_utc time_tag",
        (5, "s"): "interval age averaging correlation_time aperture_time center",
        (5, "ns"): "time_error constant",
        (1e-11, ""): "frequency_error linear",
        (1e-14, "1/s"): "quadratic",
        (1e-15, "1/s^2"): "cubic",
        (-20, "dB"): "pslr islr noise",
        (3, "dB"): "level spectrum_level",
        (2, "TECU"): "zenith_electron_content",
        (1e-10, "/day"): "aging",
        (1e-9, "/g"): "acceleration_sensitivity",
        (1, "kHz"): "bandwidth",
        (10, "MHz"): "frequency",
        (200, "MB"): "memory_limit",
        (100, "m"): "radius",
        (50, "ug"): "accelerometer_bias",
        (300, "ppm"): "accelerometer_scale_factor",
        (0.5, "deg/h"): "gyro_bias",
        (0.05, "m/s/sqrt(h)"): "velocity_random_walk",
        (0.1, "deg/sqrt(h)"): "angle_random_walk",
        (3, ""): "coverage_factor n_pull",
        (0.5, ""): "warn_above",
    }.items()
    for key in keys.split()
}
# Keys of sections that have them from the user, and units of what stands there.
_POINTS = {
    "spectrum": (("20 Hz", "200 Hz", "1 kHz"), ("g^2/Hz", "m^2/Hz"), (1e-6, 1e-2)),
    "phase_noise": (("1 Hz", "10 Hz", "1 kHz"), ("dBc/Hz",), (-100, -140)),
    "spurs": (("50 Hz", "100 Hz"), ("dBc",), (-40, -90)),
    "allan_deviation": (("0.1 s", "1 s", "10 s"), ("",), (1e-12, 1e-10)),
    "specifications": (("platforms.receiver.motion_error.velocity", "timing_error.linear"), ("", "m/s"), (0.1, 1)),
    "specify": (("platforms.receiver.motion_error.velocity", "timing_error.linear"), ("",), (1, 2)),
    "requirement_ids": (("receiver.velocity.x", "mission.islr", "requirement.location_error"), ("",), (1, 2)),
    "requirement_texts": (("1", "SYS-1"), ("",), (1, 2)),
    "correlation": (("position.x-velocity.x", "position.y-position.z"), ("",), (-1, 1)),
}
_PLACES = ("", "collection", "scene", "requirements", "allocation", "Platform", "MotionError", "Oscillator", "Imu")


def from_schema(tree: Any, node: Any, key: Any, random: Random) -> None:
    """A key that the schema has, with a value of its kind."""
    schema = _schema()
    if not isinstance(tree, dict):
        return
    platforms = tree.get("platforms")
    platform = random.choice(list(platforms.values())) if isinstance(platforms, dict) and platforms else {}
    for name in {"MotionError": ("motion_error",), "Oscillator": ("oscillator",), "Imu": ("motion_error", "imu")}.get(
        place := random.choice(_PLACES), ()
    ):
        platform = platform.setdefault(name, {}) if isinstance(platform, dict) else {}
    target = tree if not place else tree.setdefault(place, {}) if place in schema["properties"] else platform
    kind = place if place in schema["definitions"] else ""
    if place in schema["properties"]:
        kind = re.search(r"#/definitions/(\w+)", json.dumps(schema["properties"][place]))[1]  # type: ignore[index]
    properties = schema["definitions"][kind]["properties"] if kind else schema["properties"]
    chosen = random.choice(sorted(properties))
    if isinstance(target, dict):
        target[chosen] = _filled(properties[chosen], chosen, schema["definitions"], random)


def _filled(kind: Any, key: str, definitions: Any, random: Random) -> Any:
    """A value of a part of the schema."""
    if "$ref" in kind:
        return _filled(definitions[kind["$ref"].rpartition("/")[2]], key, definitions, random)
    # A quantity, or a whole number.
    if "anyOf" in kind and any({"pattern", "type"} <= form.keys() for form in kind["anyOf"]):
        return _filled(kind["anyOf"][0], key, definitions, random)
    for choices in ("allOf", "anyOf"):
        if choices in kind and "type" not in kind:  # of a section it says which keys are needed
            return _filled(random.choice(kind[choices]), key, definitions, random)
    if "not" in kind:  # any single value
        return _value(random) if random.random() < 0.3 else f"{key} {random.randint(0, 9)}"
    if "enum" in kind:
        return random.choice(kind["enum"])
    if "const" in kind:
        return kind["const"]
    if kind["type"] == "array":
        count = kind.get("maxItems") if kind.get("minItems") else random.randint(1, 3)
        of_each = kind["items"] if isinstance(kind["items"], list) else [kind["items"]] * (count or 1)
        items = [_filled(item, key, definitions, random) for item in of_each]
        return list(dict.fromkeys(items)) if kind.get("uniqueItems") else items
    if kind["type"] == "object":
        if key in _POINTS:
            names, units, (low, high) = _POINTS[key]
            unit = random.choice(units)
            return {name: f"{random.uniform(low, high):.4g} {unit}".rstrip() for name in names}
        properties = kind.get("properties", {})
        required = kind.get("required", ())
        return {
            name: _filled(part, name, definitions, random)
            for name, part in properties.items()
            if name in required or random.random() < 0.4
        }
    if kind["type"] == "integer":
        return random.randint(kind["minimum"], min(kind["maximum"], 10_000))
    if key not in _QUANTITIES:
        return _value(random) if random.random() < 0.3 else f"{key} {random.randint(0, 9)}"
    size, unit = _QUANTITIES[key]
    number = size * (random.uniform(0.2, 3) if size < 0 else 10 ** random.uniform(-2, 2))
    return f"{number:.4g} {unit if random.random() < 0.9 else random.choice(UNITS)}".rstrip()


def _number(random: Random) -> float:
    return float(f"{random.choice((1,) * 9 + (-1,)) * 10 ** random.uniform(-4, 4):.4g}")


def _value(random: Random) -> Any:
    kind = random.random()
    if kind < 0.4:
        return random.choice(TEXTS)
    if kind < 0.75:
        return f"{_number(random)} {random.choice(UNITS)}"
    if kind < 0.85:
        return random.choice(_WORDS)
    if kind < 0.95:
        return [_value(random) for _ in range(random.choice((0, 1, 3, 3, 6)))]
    return {random.choice(TEXTS): _value(random) for _ in range(random.choice((0, 1, 3)))}


_CHANGES = (
    _replace,
    _replace,
    _scale,
    _scale,
    _scale,
    _scale,
    _delete,
    _swap,
    _insert,
    _repeat,
    _bury,
    _section,
    _section,
    from_schema,
    from_schema,
)


def damaged(data: bytes, random: Random) -> bytes:
    """Change some bytes."""
    start = random.randrange(len(data) + 1)
    end = min(len(data), start + random.choice((1, 1, 4, 30)))
    kind = random.randrange(6)
    if kind == 0:
        return data[:start] + random.randbytes(end - start) + data[end:]
    if kind == 1:
        return data[:start] + data[end:]
    if kind == 2:
        return data[:start] + random.choice(_BYTES) + data[start:]
    if kind == 3:
        return data[:start] + data[start:end] * random.choice((2, 5, 300)) + data[end:]
    if kind == 4:
        other = original(random).encode()
        cut = random.randrange(len(other))
        return data[:start] + other[cut : cut + 200] + data[start:]
    return data[:start] if random.random() < 0.3 else data[:start] + bytes([random.randrange(256)]) + data[end:]


_STRICT = (
    "[tool.bisar-budget]\nstrict = true\n",
    "[tool . bisar-budget]\nstrict=true\n",
    '[tool."bisar-budget"]\n"strict" = true\n',
    "[tool.'bisar-budget']\n'strict' = true\n",
    "['tool'.\"bisar\\u002dbudget\"]\nstrict = true\n",
    '["\\U00000074ool"]\nbisar-budget.strict = true\n',
    "tool.bisar-budget.strict = true\n",
    "tool = {bisar-budget = {strict = true}}\n",
    'tool = { "bisar-budget" = { strict = true } }\n',
    "[tool]\nbisar-budget = {strict = true}\n",
    "[tool]\nbisar-budget.strict = true\n",
    "[tool.ruff]\nx = 1\n[tool.bisar-budget] # ours\nstrict = true # yes\n",
)


def strict_settings(seed: int) -> bytes:
    """A `pyproject.toml` that says `strict = true` in one of TOML's ways; every other one is damaged."""
    random = Random(f"settings {seed}")
    text = random.choice(_STRICT)
    if text.startswith("["):
        text = random.choice(("", '[project]\nname = "x"\n', "# a comment\n\n", "[[a]]\nb = [1,\n2]\n")) + text
    data = text.replace("\n", random.choice(("\n", "\r\n"))).encode(
        random.choice(("utf-8",) * 6 + ("utf-16", "utf-16-le"))
    )
    for _ in range(random.choice((0, 1, 2, 4)) if random.random() < 0.5 else 0):
        data = damaged(data, random)
    return data


if __name__ == "__main__":
    sys.stdout.buffer.write(case(int(sys.argv[1])).data)
