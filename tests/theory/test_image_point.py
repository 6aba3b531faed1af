"""The image peaks where the phase over band and aperture has the least variance, and `check` has that point.

The point of `tests/image_point.py` is held to images formed by direct sums, in random collections of three kinds, and
`check` is held to both.
"""

import math
import re
from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest

import bisar_budget as bb
from bisar_budget.findings.row import Row
from tests.conftest import ROOT
from tests.image_point import Collection, Path, Response, circle, flight, no_error

VARIANCE_RAD = 0.2  # rms phase that errors leave: a loss of 0.17 dB, far below where an image has no one peak


def drawn_flight(random: np.random.Generator, distance: float, elevation: float, speed: float) -> Path:
    """A level flight in any direction at any azimuth."""
    azimuth, heading = random.uniform(0, 2 * math.pi, 2)
    ground = distance * math.cos(elevation)
    place = (ground * math.cos(azimuth), ground * math.sin(azimuth), distance * math.sin(elevation))
    return flight(place, (speed * math.cos(heading), speed * math.sin(heading), 0.0))


def turns_apart(paths: tuple[Path, Path], aperture_time: float) -> bool:
    """Whether range and Doppler gradients are 3 degrees from parallel: less than 1 degree is no image plane."""
    step = aperture_time * 1e-3
    gradients = [
        sum(path(times)[0, :2] / np.linalg.norm(path(times)) for path in paths)
        for times in (np.array([-step]), np.array([step]))
    ]
    mean, change = gradients[0] + gradients[1], gradients[1] - gradients[0]
    sine = abs(mean[0] * change[1] - mean[1] * change[0]) / np.linalg.norm(mean) / np.linalg.norm(change)
    return bool(sine > math.sin(math.radians(3)))


def drawn(kind: str, random: np.random.Generator) -> Collection:
    """A collection with one error, of which the image still has one clear peak."""
    uniform = random.uniform
    if kind == "ordinary":
        radar = uniform(5e9, 12e9), uniform(1e8, 5e8), uniform(1, 6)
        while True:
            paths = (
                drawn_flight(random, uniform(15e3, 50e3), uniform(0.1, 0.7), uniform(80, 200)),
                drawn_flight(random, uniform(4e3, 15e3), uniform(0.1, 0.8), uniform(40, 120)),
            )
            if turns_apart(paths, radar[-1]):
                break
    elif kind == "narrow band":
        radar = uniform(4e8, 8e8), uniform(5e6, 1e7), uniform(10, 60)
        paths = (
            drawn_flight(random, uniform(8e3, 30e3), uniform(0.01, 0.05), 0.0),
            drawn_flight(random, uniform(2e3, 10e3), uniform(0.15, 0.6), uniform(30, 80)),
        )
    else:
        radar = uniform(4e8, 1.5e9), uniform(4e7, 1.5e8), uniform(0.5, 2 * math.pi) / 0.05
        paths = (
            drawn_flight(random, uniform(500, 3000), uniform(0.05, 0.3), 0.0),
            circle(uniform(400, 1500), uniform(200, 800), 0.05, uniform(0, 2 * math.pi)),
        )
    x, y, z = random.permutation((1.0, 0.0, 0.0))
    is_velocity, is_of_receiver = random.integers(2, size=2)
    size = 1e-3
    for _ in range(6):  # to the size that leaves `VARIANCE_RAD`
        error = flight((0, 0, 0), (size * x, size * y, size * z))
        if not is_velocity:
            error = flight((size * x, size * y, size * z), (0, 0, 0))
        errors = (no_error, error) if is_of_receiver else (error, no_error)
        collection = Collection(*radar, paths, errors)
        found = collection.least_variance_point()
        rms = math.sqrt(4 / 45 * found.equal_loss_rad**2 + 4 / 175 * found.cubic_rad**2 + found.rest_rad**2)
        size = min(size * VARIANCE_RAD / rms, 30.0 if not is_velocity else 3.0)
    return collection


@pytest.mark.parametrize("kind", ["ordinary", "narrow band", "circling"])
def test_an_image_peaks_where_its_phase_varies_least(kind: str) -> None:
    """Within 1.5 % of the way, or 1 mm: what the fourth order of the phase moves at a loss of 0.27 dB."""
    for seed in range(12):
        collection = drawn(kind, np.random.default_rng(seed))
        found = collection.least_variance_point()
        seen, level = collection.peak(found.point, max(0.05, 0.02 * np.hypot(*found.point)))
        assert np.hypot(*(seen - found.point)) < max(1e-3, 0.015 * np.hypot(*found.point)), (kind, seed)
        assert found.peak_db == pytest.approx(level, abs=0.002), (kind, seed)


STILL = (0.0, 0.0, 0.0)
EAST_10_CM = (0.1, 0.0, 0.0)


def section_v(bandwidth: float) -> Collection:
    """The paper's example, with 41.7 mm/s of the receiver along y."""
    geometry = bb.load(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml").platforms
    states = (geometry.transmitter.state, geometry.receiver.state)
    paths = tuple(flight(state.position, state.velocity) for state in states)
    return Collection(10e9, bandwidth, 6.0, paths, (no_error, flight(STILL, (0, 0.0417, 0))))


def television() -> Collection:
    paths = flight((-18e3, 9e3, 420), STILL), flight((-2e3, -7e3, 2500), (-65, 8, 0))
    return Collection(602e6, 7.61e6, 60.0, paths, (no_error, flight(STILL, (0, 0.05, 0))))


def forward_scatter() -> Collection:
    paths = flight((-18e3, 0, 420), STILL), flight((3e3, 200, 2000), (5, 25, 0))
    return Collection(602e6, 7.61e6, 60.0, paths, (flight((1, 0, 0), STILL), no_error))


def drone(aperture_s: float) -> Collection:
    paths = flight((600, 500, 60), STILL), circle(1000, 500, 0.025, 0.0)
    return Collection(435e6, 100e6, aperture_s, paths, (no_error, flight(EAST_10_CM, STILL)))


def of_gallery(name: str, changes: dict[str, str], row_id: str) -> Row:
    """A row of a mission of the gallery, by the full model."""
    mission = bb.load(ROOT / "specs" / "missions" / f"{name}.yaml").replace(changes)
    return bb.check(mission, model="full")[row_id]


SECTION_V = {
    "platforms.transmitter.motion_error": "{}",
    "platforms.receiver.motion_error.velocity": "[0 m/s, 0.0417 m/s, 0 m/s]",
}
FORWARD = {
    "platforms.transmitter.position": "[-18 km, 0 m, 420 m]",
    "platforms.transmitter.motion_error": "{position: [1 m, 0 m, 0 m]}",
    "platforms.receiver": "{position: [3 km, 200 m, 2 km], velocity: [5 m/s, 25 m/s, 0 m/s]}",
}

# Of an independent search with exact ranges, to the digits of its print: point [m], quadratic phase, phase of equal
# loss [rad]. The reference finds them, and the check finds what the reference does.
NAMED = {
    "Section V, 10 MHz": (
        section_v(1e7), (-1.162, 2.324), 0.4050, 0.4110,
        "rigling_moses_section_v", {**SECTION_V, "radar.bandwidth": "10 MHz"}, "receiver.velocity.y",
    ),
    "Section V, 3 MHz": (
        section_v(3e6), (-2.457, 1.667), 0.3139, 0.3618,
        "rigling_moses_section_v", {**SECTION_V, "radar.bandwidth": "3 MHz"}, "receiver.velocity.y",
    ),
    "DVB-T": (television(), (5.406, -0.709), 0.282, 0.957, "dvbt_aircraft", {}, "receiver.velocity.y"),
    "forward scatter": (
        forward_scatter(), (0.0866, -0.0019), 0.019, 0.153, "dvbt_aircraft", FORWARD, "transmitter.position.x",
    ),
    "circle, 100 s": (
        drone(100.0), (0.0890, -0.0014), 0.063, 0.138, "circling_drone", {}, "receiver.position.x",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMED)
def test_named_points(name: str) -> None:
    collection, point, quadratic, equal_loss, mission, changes, row_id = NAMED[name]
    found = collection.least_variance_point()
    assert found.point == pytest.approx(point, abs=1e-3)
    assert abs(found.quadratic_rad) == pytest.approx(quadratic, abs=1e-3)
    assert found.equal_loss_rad == pytest.approx(equal_loss, abs=1e-3)
    row = of_gallery(mission, changes, row_id)
    assert row.displacement_m == pytest.approx(found.point, abs=1e-3)
    assert row.qpe_full_rad == pytest.approx(found.quadratic_rad, abs=1e-3)
    assert row.equal_loss_qpe_rad == pytest.approx(found.equal_loss_rad, abs=1e-3)


@pytest.mark.parametrize(
    ("aperture_s", "moved_mm"), [(20.0, 53.9), (40.0, 56.9), (60.0, 67.2), (100.0, 89.0)], ids=str
)
def test_more_of_a_circle_moves_the_point_farther(aperture_s: float, moved_mm: float) -> None:
    """Gradients at mid-aperture say 53.6, 52.8, 51.5 and 47.0 mm, less and less."""
    assert 1e3 * np.hypot(*drone(aperture_s).least_variance_point().point) == pytest.approx(moved_mm, abs=0.05)
    row = of_gallery("circling_drone", {"collection.aperture_time": f"{aperture_s} s"}, "receiver.position.x")
    assert 1e3 * np.hypot(*row.displacement_m) == pytest.approx(moved_mm, abs=0.05)


def test_the_quadratic_phase_of_equal_loss_loses_what_the_image_does() -> None:
    """φ loses 4φ²/45 of a peak's power. Where cells are coarse the P₂ phase alone would say much less."""
    found = television().least_variance_point()
    of_quadratic, of_all = (
        -10 * math.log10(math.exp(-4 / 45 * phase**2)) for phase in (found.quadratic_rad, found.equal_loss_rad)
    )
    assert of_all == pytest.approx(-found.peak_db, abs=0.005)
    assert of_quadratic < 0.1 * of_all


def largest_turn(collection: Collection) -> float:
    """Largest angle between two lines of sight of one platform. [rad]"""
    times = collection.aperture_time / 2 * np.linspace(-1, 1, 101)
    looks = [path(times) / np.linalg.norm(path(times), axis=1)[:, None] for path in collection.paths]
    return max(math.acos(np.clip((look @ look.T).min(), -1, 1)) for look in looks)


def mission_file(collection: Collection, folder: FilePath) -> FilePath:
    """The mission of a collection whose error is one component of a position or of a velocity, a bound.

    Paths that are not straight are logs of four fixes a second.
    """
    radar = f"{{ center_frequency: {collection.center_frequency!r}, bandwidth: {collection.bandwidth!r} }}"
    lines = ["schema_version: 1", "name: drawn", f"radar: {radar}"]
    lines += [f"collection: {{ aperture_time: {collection.aperture_time!r} }}", "platforms:"]
    for name, path, error in zip(("transmitter", "receiver"), collection.paths, collection.errors, strict=True):
        before, middle, after = path(np.array([-1.0, 0.0, 1.0]))
        lines.append(f"  {name}:")
        if np.allclose(before + after, 2 * middle, rtol=0, atol=1e-6):
            lines += [f"    position: {middle.tolist()}", f"    velocity: {(after - middle).tolist()}"]
        else:
            times = np.arange(-collection.aperture_time / 2 - 5, collection.aperture_time / 2 + 5, 0.25)
            log = np.column_stack((times, path(times)))
            header = "time [s],east [m],north [m],up [m]"
            np.savetxt(folder / f"{name}.csv", log, fmt="%.9f", delimiter=",", header=header, comments="")
            lines.append(f"    trajectory: {{ file: {name}.csv, center: 0 s }}")
        constant, later = error(np.array([0.0, 1.0]))
        if later.any():
            kind, size = ("position", constant) if constant.any() else ("velocity", later)
            lines.append(f"    motion_error: {{ {kind}: {size.tolist()}, distribution: bound }}")
    file = folder / "mission.yaml"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def equal_loss_rad(found: Response, is_turned: bool) -> float:
    """Phase that the requirement judges: all of it where a line of sight turns by more than a radian."""
    orders = 4 / 175 * found.cubic_rad**2 + found.rest_rad**2 if is_turned else 0.0
    return math.sqrt(found.equal_loss_rad**2 + 45 / 4 * orders)


@pytest.mark.parametrize("kind", ["ordinary", "narrow band", "circling"])
def test_check_has_the_point_and_the_loss_of_the_image(kind: str, tmp_path: FilePath) -> None:
    """Thirty missions: displacement to 1 % or 1 mm of the peak, phases to 1 % or 2 mrad, the loss to 0.02 dB.

    A bound holds for either sign of the error: the row has the displacement as declared, and the larger phase.
    """
    for seed in range(30):
        collection = drawn(kind, np.random.default_rng(1000 + seed))
        both = collection, replace(collection, errors=tuple(reversed_error(error) for error in collection.errors))
        found = [one.least_variance_point() for one in both]
        is_turned = largest_turn(collection) > 1.0
        equal_loss = [equal_loss_rad(one, is_turned) for one in found]
        result = bb.check(bb.load(mission_file(collection, tmp_path)), model="full")
        (row,) = (
            row for row in result.values() if row.declared and re.search(r"\.(position|velocity)\.[xyz]$", row.id)
        )
        worse = int(np.argmax(equal_loss))
        seen, _ = both[0].peak(found[0].point, max(0.05, 0.02 * np.hypot(*found[0].point)))
        assert np.hypot(*(row.displacement_m - seen)) < max(1e-3, 0.01 * np.hypot(*seen)), (kind, seed)
        quadratic = max(abs(one.quadratic_rad) for one in found)
        assert abs(row.qpe_full_rad) == pytest.approx(quadratic, rel=0.01, abs=2e-3), (kind, seed)
        assert row.equal_loss_qpe_rad == pytest.approx(equal_loss[worse], rel=0.01, abs=2e-3), (kind, seed)
        lost = 4 / 45 * row.equal_loss_qpe_rad**2
        if not is_turned:
            lost += 4 / 175 * row.cubic_rad**2 + row.rest_rad**2
        assert -10 * math.log10(math.exp(-lost)) == pytest.approx(-found[worse].peak_db, abs=0.02), (kind, seed)
        loss_db = result.to_dict()["missions"][0]["peak_loss_db"]
        assert loss_db == pytest.approx(max(-one.peak_db for one in found), rel=1e-3, abs=1e-3), (kind, seed)


def reversed_error(error: Path) -> Path:
    """The error of the other sign."""
    return lambda times: -error(times)


@pytest.mark.parametrize("velocity", [0.0417, -0.02])
def test_the_check_has_the_point_of_wide_bands(velocity: float) -> None:
    """Section V, 300 MHz: the limit of a wide band moves the point by 0.5 mm of 2.6 m."""
    text = (ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml").read_text(encoding="utf-8")
    mission = bb.loads(text).replace(
        {
            "platforms.transmitter.motion_error": "{}",
            "platforms.receiver.motion_error.velocity": f"[0 m/s, {velocity} m/s, 0 m/s]",
        }
    )
    row = bb.check(mission, model="full")["receiver.velocity.y"]
    geometry = (mission.platforms.transmitter.state, mission.platforms.receiver.state)
    paths = tuple(flight(state.position, state.velocity) for state in geometry)
    error = flight((0, 0, 0), (0, velocity, 0))
    radar = mission.radar
    found = Collection(
        radar.center_frequency, radar.bandwidth, mission.collection.aperture_time, paths, (no_error, error)
    ).least_variance_point()
    assert np.array(row.displacement_m) == pytest.approx(found.point, rel=5e-3)
    assert row.qpe_full_rad == pytest.approx(found.quadratic_rad, rel=5e-3)
