"""The same mission seen otherwise: what is found of it is the same, whatever formulas found it.

Physics has no east, no left, no clock that only runs forward, no metre and no second. Random missions are turned,
mirrored, flown backwards, with their platforms exchanged, larger, slower, with other signs; then each row must be
what it was, in its new place and its new unit.
"""

import copy
import math
from collections.abc import Callable, Iterator
from functools import cache
from random import Random
from typing import Any, NamedTuple

import pytest
import yaml

import bisar_budget as bb
from bisar_budget.simulator.point import PointImages
from tests.conftest import seeds
from tests.families import FAMILIES, mission_text
from tests.simulate.conftest import only_rotated_images

KINDS = ("position", "velocity", "acceleration")
CLOCK = ("constant", "linear", "quadratic", "cubic")
SCALED = ("m", "m/s", "m/s^2", "s", "s/s", "1/s", "1/s^2")  # units of errors that grow with a mission
# Rows that are displaced by sizes without a sign.
UNSIGNED = {"imu", "random", "oscillator", "lever_arm", "synchronization", "vibration"}
# A search stops where a phase changes by less than 3e-5 rad beyond what is linear, an allowable within 1e-4.
NEAR, NEAR_RAD = 1e-4, 6e-5

Tree = dict[str, Any]
Vector = list[float]


def tree_of(family: str, seed: int) -> Tree:
    """A random mission in numbers: metres, seconds and vectors along the scene's axes."""
    text = mission_text(family, seed)
    tree, mission = yaml.safe_load(text), bb.loads(text)
    for name, platform in tree["platforms"].items():
        state = getattr(mission.platforms, name).state
        for key in ("slant_range", "azimuth", "elevation", "speed", "motion_azimuth", "climb"):
            platform.pop(key, None)
        platform |= {key: list(map(float, getattr(state, key))) for key in KINDS}
    for error in errors(tree):
        for key in KINDS:
            if key in error and not isinstance(error[key], list):
                error[key] = [error[key]] * 3
    return tree


def errors(tree: Tree) -> Iterator[Tree]:
    """Declared errors of the motion of each platform, and of both."""
    holders = [platform.get("motion_error") for platform in tree["platforms"].values()]
    yield from filter(None, [*holders, tree.get("common_motion_error")])


def with_instruments(tree: Tree, seed: str) -> Tree:
    """Add sensors, arms, clocks and vibration of sizes that parts have."""
    random = Random(f"instruments {seed}")
    mission = loaded(tree)
    aperture, wavelength = mission.collection.aperture_time, mission.radar.wavelength

    def near(size: float) -> float:
        return float(f"{size * 10 ** random.uniform(-1, 1):.3g}")

    for platform in tree["platforms"].values():
        error = platform.setdefault("motion_error", {})
        biases = [f"{near(50)} ug" for _ in range(3)]
        error["imu"] = {
            "accelerometer_bias": biases,
            "attitude": f"{near(0.02)} deg",
            "angle_random_walk": f"{near(0.1)} deg/sqrt(h)",
        }
        error["random"] = [
            {"name": "GNSS", "sigma": [near(0.003) for _ in range(3)], "correlation_time": near(aperture)}
        ]
        error["lever_arm"] = {"arm": [1.0, 0.5, -0.3], "uncertainty": [0.01, 0.02, 0.03]}
        error["vibration"] = {
            "sinusoidal": [{"amplitude": near(1e-3 * wavelength), "frequency": near(5 / aperture)}],
            "wideband": {"rms": near(1e-3 * wavelength)},
        }
        platform["oscillator"] = {
            "frequency": "10 MHz",
            "phase_noise": {"1 Hz": "-100 dBc/Hz", "10 Hz": "-130 dBc/Hz", "1 kHz": "-150 dBc/Hz"},
            "acceleration_sensitivity": "1e-9 1/g",
        }
    if random.random() < 0.5:
        tree["synchronization"] = {"interval": near(aperture / 10), "error": "3 deg"}
    tree["requirements"] |= {"pslr": "-30 dB", "islr": "-20 dB"}
    return tree


class Seen(NamedTuple):
    """A mission seen otherwise: its file, what an id is there, and what becomes of displacements and sizes."""

    tree: Tree
    id: Callable[[str], str] = lambda row_id: row_id
    displacement: Callable[[Vector], Vector] | None = lambda moved: moved
    scale: float | None = 1.0  # of errors; None: each unit has another one


def seen(tree: Tree, way: Callable[[Vector, int], Vector], error: Callable[[Vector, int, str], Vector]) -> Tree:
    """A file with other vectors, by their order in time, and other errors, by their frame too."""
    other = copy.deepcopy(tree)
    for platform in other["platforms"].values():
        for order, key in enumerate(KINDS):
            platform[key] = way(platform[key], order)
    for one in errors(other):
        for order, key in enumerate(KINDS):
            if key in one:
                one[key] = error(one[key], order, one.get("frame", "scene"))
    return other


def of_arms(tree: Tree, arm: Callable[[Vector], Vector], still: Callable[[Vector], Vector]) -> None:
    """Other lever arms: along a platform's own axes, of one that stands along those of the scene."""
    for platform in tree["platforms"].values():
        lever = platform.get("motion_error", {}).get("lever_arm")
        if lever is not None:
            moves = any(platform.get("velocity", [platform.get("speed")]))
            lever["arm"] = (arm if moves else still)(lever["arm"])


def turned(tree: Tree) -> Seen:
    def quarter(v: Vector) -> Vector:
        return [-v[1], v[0], v[2]]

    def sizes(v: Any) -> Any:
        return [v[1], v[0], v[2]] if isinstance(v, list) else v

    other = seen(tree, lambda v, _: quarter(v), lambda v, _, frame: quarter(v) if frame == "scene" else v)
    of_arms(other, lambda v: v, quarter)
    for platform in other["platforms"].values():
        error = platform.get("motion_error", {})
        if error.get("frame", "scene") == "scene":
            error |= {"imu": {key: sizes(v) for key, v in error["imu"].items()}} if "imu" in error else {}
            for one in error.get("random", []):
                one["sigma"] = sizes(one["sigma"])
        if "lever_arm" in error and not any(platform["velocity"]):
            error["lever_arm"]["uncertainty"] = sizes(error["lever_arm"]["uncertainty"])
    ends = {".x": ".y", ".y": ".x"}
    return Seen(other, lambda row_id: row_id[:-2] + ends.get(row_id[-2:], row_id[-2:]), lambda d: [-d[1], d[0]])


def mirrored(tree: Tree) -> Seen:
    """East stays; north is south, and what is across to the left is across to the right."""

    def flipped(v: Vector) -> Vector:
        return [v[0], -v[1], v[2]]

    other = seen(tree, lambda v, _: flipped(v), lambda v, _, frame: flipped(v))
    of_arms(other, flipped, flipped)
    return Seen(other, displacement=lambda d: [d[0], -d[1]])


def backwards(tree: Tree) -> Seen:
    """Flown from the end to the beginning: a platform's own axes turn with it."""

    def error(v: Vector, order: int, frame: str) -> Vector:
        sign = (-1) ** order
        return [-sign * v[0], -sign * v[1], sign * v[2]] if frame == "track" else [sign * x for x in v]

    other = seen(tree, lambda v, order: [(-1) ** order * x for x in v], error)
    of_arms(other, lambda v: [-v[0], -v[1], v[2]], lambda v: v)
    clock = other.get("timing_error", {})
    for key in ("linear", "cubic"):
        if key in clock:
            clock[key] *= -1
    return Seen(other)


def exchanged(tree: Tree) -> Seen:
    """Transmitter for receiver; what is of the clock goes, since it counts against the receiver."""
    for key in ("timing_error", "other_errors", "common_motion_error", "synchronization"):
        tree.pop(key, None)
    tree.get("scene", {}).pop("height_error", None)
    other = copy.deepcopy(tree)
    names = {"transmitter": "receiver", "receiver": "transmitter"}

    def of(part: Any) -> Any:
        return {names.get(key, key): of(value) for key, value in part.items()} if isinstance(part, dict) else part

    other["platforms"], other["allocation"] = of(other["platforms"]), of(other["allocation"])
    return Seen(other, lambda row_id: ".".join(names.get(part, part) for part in row_id.split(".")))


def larger(scale: float) -> Callable[[Tree], Seen]:
    """Every length by a factor, the wavelength and the range cell too."""

    def of(tree: Tree) -> Seen:
        other = seen(tree, lambda v, _: [scale * x for x in v], lambda v, _, frame: [scale * x for x in v])
        other["radar"] = {key: value / scale for key, value in other["radar"].items()}
        for section in ("scene", "timing_error"):  # the clock's way is in metres
            other[section] = {key: scale * value for key, value in other.get(section, {}).items()}
        if "location_error" in other["requirements"]:
            other["requirements"]["location_error"] *= scale
        return Seen(other, displacement=lambda d: [scale * x for x in d], scale=scale)

    return of


def slower(factor: float) -> Callable[[Tree], Seen]:
    """Every time by a factor, but no length and no wavelength."""

    def of(tree: Tree) -> Seen:
        other = seen(
            tree,
            lambda v, order: [x / factor**order for x in v],
            lambda v, order, frame: [x / factor**order for x in v],
        )
        other["collection"]["aperture_time"] *= factor
        clock = other.get("timing_error", {})
        for order, key in enumerate(CLOCK):
            if key in clock:
                clock[key] /= factor**order
        return Seen(other, scale=None)

    return of


def of_other_sign(tree: Tree) -> Seen:
    """Errors the other way round: a limit holds for both signs. Large errors displace otherwise by their sign."""
    other = seen(tree, lambda v, _: v, lambda v, _, frame: [-x for x in v])
    for section in ("timing_error", "scene"):
        other[section] = {
            key: -v if key in (*CLOCK, "height_error") else v for key, v in other.get(section, {}).items()
        }
    return Seen(other, displacement=None)


def covered(tree: Tree) -> Seen:
    """Standard deviations, and their multiples as the file declares them; an error of terrain is none of those."""
    for error in errors(tree):
        error.pop("distribution", None)
    factor = tree["allocation"]["coverage_factor"]
    other = seen(tree, lambda v, _: v, lambda v, _, frame: [factor * x for x in v])
    other["timing_error"] = {key: factor * v for key, v in other.get("timing_error", {}).items()}
    other["allocation"]["coverage_factor"] = 1
    return Seen(other)


WAYS: dict[str, Callable[[Tree], Seen]] = {
    "turned": turned,
    "mirrored": mirrored,
    "backwards": backwards,
    "exchanged": exchanged,
    "larger": larger(3.0),
    "smaller": larger(0.3),
    "slower": slower(2.0),
    "faster": slower(0.5),
    "of the other sign": of_other_sign,
    "covered": covered,
}


def loaded(tree: Tree) -> bb.Mission:
    return bb.loads(text_of(tree))


def text_of(tree: Tree) -> str:
    return yaml.safe_dump(tree, sort_keys=False)


# Each mission is seen in many ways; it is checked and imaged once.
@cache
def checked(text: str) -> bb.CheckResult:
    return bb.check(bb.loads(text))


@cache
def imaged(text: str) -> PointImages:
    with only_rotated_images():
        return bb.simulate(bb.loads(text)).images


def is_near(one: float | None, other: float | None, absolute: float = 0.0) -> bool:
    if one is None or other is None:
        return one is other
    return abs(abs(one) - abs(other)) <= max(NEAR * max(abs(one), abs(other)), absolute)


def differences(tree: Tree, way: Callable[[Tree], Seen]) -> list[Any]:
    """Rows and requirements of a mission that differ from those of the same one seen otherwise."""
    other = way(tree)
    here, there = (checked(text_of(one)) for one in (tree, other.tree))
    rows = {row.id: row for row in there.findings.rows}
    found: list[Any] = []
    for row in here.findings.rows:
        if way is exchanged and row.owner == "clock":
            continue
        one = rows.pop(other.id(row.id), None)
        if one is None:
            found.append(row)
            continue
        is_same = row.status == one.status and is_near(row.utilization, one.utilization)
        for name in ("qpe_full_rad", "qpe_published_rad", "cubic_rad"):
            is_same &= is_near(getattr(row, name), getattr(one, name), NEAR_RAD)
        if other.scale is not None:
            scale = other.scale if row.unit in SCALED else 1.0
            for name in ("allowable", "allowable_published", "allowable_full"):
                size = getattr(row, name)
                is_same &= is_near(None if size is None else scale * size, getattr(one, name))
        if other.displacement is None:
            pass
        elif row.displacement_m is None or one.displacement_m is None:
            is_same &= row.displacement_m is one.displacement_m
        else:
            moved, seen_there = other.displacement(list(row.displacement_m)), list(one.displacement_m)
            if UNSIGNED.intersection(row.id.split(".")):
                moved, seen_there = list(map(abs, moved)), list(map(abs, seen_there))
            is_same &= math.dist(moved, seen_there) <= max(NEAR * math.hypot(*moved), 2e-5)
        if not is_same:
            found.append((row, one))
    found += [row for row_id, row in rows.items() if not (way is exchanged and row.owner == "clock")]
    for key, requirement in here.requirements.items():
        one = there.requirements[key]
        if (requirement.status, here.status) != (one.status, there.status) or not is_near(
            requirement.utilization, one.utilization
        ):
            found.append((key, requirement, one))
    return found


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", seeds(2, 1))
def test_a_mission_seen_otherwise_is_the_same(family: str, way: str, seed: int) -> None:
    assert differences(tree_of(family, seed), WAYS[way]) == []


@pytest.mark.parametrize("way", ["turned", "mirrored", "backwards", "exchanged"])
@pytest.mark.parametrize("family", FAMILIES)
def test_so_are_its_sensors_arms_clocks_and_vibration(family: str, way: str) -> None:
    assert differences(with_instruments(tree_of(family, 1), family), WAYS[way]) == []


EARTH = """
schema_version: 1
name: Over the Earth
radar: {center_frequency: 1.3 GHz, bandwidth: 80 MHz}
scene: {latitude: 48.0 deg, longitude: 11.0 deg, height: 500 m, radius: 200 m, height_error: 3 m}
collection: {aperture_time: 8 s, center_time: 2026-10-10T09:00:00Z}
platforms:
  transmitter:
    {latitude: 48.2 deg, longitude: 11.1 deg, altitude: 9 km, heading: 100 deg, speed: 180 m/s, climb: 2 m/s}
  receiver: {latitude: 47.9 deg, longitude: 11.2 deg, altitude: 4 km, heading: 60 deg, speed: 90 m/s}
timing_error: {constant: 1.e-8, linear: 1.e-11}
propagation: {zenith_delay: 20 mm, zenith_electron_content: 5 TECU}
requirements: {quadratic_phase_error: 45 deg, cubic_phase_error: 30 deg, location_error: 10 m, islr: -15 dB}
allocation: {model: full, combine: each, coverage_factor: 2}
"""


def elsewhere(tree: Tree) -> Seen:
    """At another longitude: the Earth is as flat, as heavy and as fast there."""
    other = copy.deepcopy(tree)
    for one in (other["scene"], *other["platforms"].values()):
        one["longitude"] = f"{float(one['longitude'].split()[0]) + 77} deg"
    return Seen(other)


def on_the_other_hemisphere(tree: Tree) -> Seen:
    """South for north: the Earth turns the same way. What the air adds has no sign."""
    other = copy.deepcopy(tree)
    other.pop("propagation")
    tree.pop("propagation")
    for one in (other["scene"], *other["platforms"].values()):
        one["latitude"] = f"-{one['latitude']}"
    for platform in other["platforms"].values():
        platform["heading"] = f"{180 - float(platform['heading'].split()[0])} deg"
        error = platform["motion_error"]
        error |= {key: [error[key][0], -error[key][1], error[key][2]] for key in KINDS}
    of_arms(other, lambda v: [v[0], -v[1], v[2]], lambda v: v)
    return Seen(other, displacement=lambda d: [d[0], -d[1]])


@pytest.mark.parametrize("way", [elsewhere, on_the_other_hemisphere])
def test_so_is_one_over_the_earth(way: Callable[[Tree], Seen]) -> None:
    """Specific force, the Earth's rotation and the paths of aircraft: by latitude alone."""
    tree = yaml.safe_load(EARTH)
    for platform, frame in zip(tree["platforms"].values(), ("scene", "track"), strict=True):
        sizes = {"position": [0.5, 0.7, 0.9], "velocity": [0.01, 0.02, 0.03], "acceleration": [1e-3, 2e-3, 1e-3]}
        platform["motion_error"] = {"frame": frame, **sizes}
    assert differences(with_instruments(tree, "earth"), way) == []


@pytest.mark.parametrize("way", ["turned", "mirrored", "backwards", "slower"])
def test_so_are_the_answers_to_questions(way: str) -> None:
    """The longest aperture, what to order, and how often requirements hold, which is known to 0.004."""
    tree = tree_of("satellite_aircraft", 3)
    other, longer = loaded(WAYS[way](tree).tree), 2.0 if way == "slower" else 1.0
    mission, key = loaded(tree), "collection.aperture_time"
    here, there = (bb.solve(one, key).found for one in (mission, other))
    assert there.status == here.status
    assert here.crossings
    ends, ends_there = ([one.inside.value for one in found.crossings] for found in (here, there))
    assert ends_there == pytest.approx([longer * end for end in ends], rel=NEAR)
    ordered, ordered_there = (bb.allocate(one).found.specifications for one in (mission, other))
    in_time = {"m": 0, "m/s": 1, "m/s^2": 2, "s/s": 1, "1/s": 2}
    for one, same in zip(ordered, ordered_there, strict=True):
        assert same.value == pytest.approx(one.value / longer ** in_time[one.unit], rel=1e-3)
    odds, odds_there = (bb.monte_carlo(one, draws=20_000).found.probability for one in (mission, other))
    assert odds_there == pytest.approx(odds, abs=0.02)


@pytest.mark.parametrize("way", ["turned", "mirrored", "backwards", "exchanged", "larger", "slower"])
@pytest.mark.parametrize(("family", "seed"), [("aircraft", 1), ("geostationary_drone", 1)])
def test_so_is_its_image(family: str, seed: int, way: str) -> None:
    """Mirrored, sidelobes of aircraft 1 without errors were 0.4 dB too high, and 0.05 dB higher than here."""
    tree = tree_of(family, seed)
    other = WAYS[way](tree)
    here, there = (imaged(text_of(one)) for one in (tree, other.tree))
    for before, after in ((here.clean_response, there.clean_response), (here.response, there.response)):
        assert after.irw_m == pytest.approx((other.scale or 1.0) * before.irw_m, rel=2e-3)
        assert after.pslr_db == pytest.approx(before.pslr_db, abs=0.02)
        assert after.islr_db == pytest.approx(before.islr_db, abs=0.02)
        assert after.peak == pytest.approx(before.peak, rel=2e-3)
    assert other.displacement is not None
    moved = other.displacement(list(here.effect.displacement))
    assert there.effect.displacement == pytest.approx(moved, rel=1e-6, abs=1e-6)


# ---------------------------------------------------------------------- the same error in other words
SIZES = [1e-3, 2e-3, 3e-3]  # m, m/s², along three axes


def with_one_error(family: str, seed: int, **error: Any) -> dict[str, Any]:
    """Rows of a random mission whose receiver has one error, and nothing else has any."""
    tree = tree_of(family, seed)
    for key in ("timing_error", "other_errors", "common_motion_error", "autofocus", "scene"):
        tree.pop(key, None)
    tree["platforms"]["transmitter"].pop("motion_error", None)
    tree["platforms"]["receiver"]["motion_error"] = error
    tree["allocation"] = {"model": "full", "combine": "each"}
    tree["requirements"] |= {"cubic_phase_error": "45 deg", "location_error": 10, "islr": "-20 dB"}
    return {row.id: row for row in bb.check(loaded(tree)).findings.rows if row.declared is not None}


def effect_of(rows: dict[str, Any], kind: str) -> tuple[float, float, float]:
    """Quadratic phase [rad] and displacement [m] of the errors of a kind, together."""
    found = [row for row_id, row in rows.items() if f".{kind}" in row_id and row.is_independent]
    moved = [row.displacement_m or (0.0, 0.0) for row in found]
    phases = math.hypot(*(row.qpe_full_rad for row in found))
    return phases, math.hypot(*(east for east, _ in moved)), math.hypot(*(north for _, north in moved))


# A bias counts by first order, an acceleration by exact ranges; with ten times as much they are 0.15 % apart.
LITTLE = [0.1 * size for size in SIZES]


@pytest.mark.parametrize(
    ("stated", "kind", "error", "as_kind"),
    [
        ({"imu": {"accelerometer_bias": LITTLE}}, "imu", {"acceleration": LITTLE}, "acceleration"),
        (
            {"random": [{"name": "GNSS", "sigma": SIZES, "correlation_time": 9e8}]},
            "random",
            {"position": SIZES},
            "position",
        ),
        ({"lever_arm": {"uncertainty": SIZES}}, "lever_arm", {"frame": "track", "position": SIZES}, "position"),
    ],
    ids=["accelerometer_bias", "random of a long correlation time", "lever_arm of a straight flight"],
)
@pytest.mark.parametrize("family", ["satellite_aircraft", "geostationary_drone"])
def test_an_error_in_other_words_is_the_same(family: str, stated: Tree, kind: str, error: Tree, as_kind: str) -> None:
    seed = next(seed for seed in range(20) if not any(tree_of(family, seed)["platforms"]["receiver"]["acceleration"]))
    here = effect_of(with_one_error(family, seed, **stated), kind)
    there = effect_of(with_one_error(family, seed, **error), as_kind)
    assert here[0] == pytest.approx(there[0], rel=1e-3, abs=NEAR_RAD)
    assert here[1:] == pytest.approx(there[1:], rel=1e-3)


def test_an_error_of_both_is_that_of_each_added() -> None:
    sizes = {"position": [1e-3, 2e-3, -1e-3], "velocity": [1e-5, -2e-5, 1e-5], "acceleration": [1e-6, 2e-6, 1e-6]}
    trees = [tree_of("jets", 1) for _ in range(2)]
    for tree in trees:
        for platform in tree["platforms"].values():
            platform["motion_error"] = copy.deepcopy(sizes)
        tree["common_motion_error"] = copy.deepcopy(sizes)
    for platform in trees[0]["platforms"].values():
        del platform["motion_error"]
    both, each = ({row.id: row for row in bb.check(loaded(tree)).findings.rows} for tree in trees)
    for kind in KINDS:
        for axis in "xyz":
            one, other = (each[f"{name}.{kind}.{axis}"] for name in ("transmitter", "receiver"))
            moved = [a + b for a, b in zip(one.displacement_m, other.displacement_m, strict=True)]
            assert both[f"common.{kind}.{axis}"].displacement_m == pytest.approx(moved, rel=1e-3, abs=1e-7)
            phase = one.qpe_full_rad + other.qpe_full_rad
            assert both[f"common.{kind}.{axis}"].qpe_full_rad == pytest.approx(phase, rel=1e-3, abs=NEAR_RAD)
