"""The drawings of a collection: places to scale, words for who cannot see them, the same bytes each time."""

import itertools
import math
import re
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.report.drawing.geometry_views import geometry_elevation, geometry_plan
from bisar_budget.report.drawing.svg import LINE_PX, Box, text_width
from tests.conftest import ROOT, examples, findings, found_in

SVG = "{http://www.w3.org/2000/svg}"
DRAWINGS = {"plan": geometry_plan, "elevation": geometry_elevation}
ROUNDING = 0.011  # px: two places, each written to a hundredth
SPECS = sorted((ROOT / "specs" / "missions").glob("*.yaml"))


def collection(**platforms: Any) -> MissionFindings:
    """Two platforms anywhere, on the findings of the base mission; positions [m], velocities [m/s]."""
    changes = {key: platforms.pop(key) for key in ("radius", "aperture_time", "name") if key in platforms}
    states = {name: PlatformState(**state) for name, state in platforms.items()}
    found = findings()._replace(geometry=BistaticGeometry(**states))
    if "radius" in changes:
        found = found._replace(scene_radius=changes["radius"])
    return found._replace(**{key: value for key, value in changes.items() if key != "radius"})


def pair(
    tx: tuple[float, ...], rx: tuple[float, ...], v_tx: Any = (0, 100, 0), v_rx: Any = (0, 60, 0), **more: Any
) -> Any:
    return collection(
        transmitter={"position": tx, "velocity": v_tx}, receiver={"position": rx, "velocity": v_rx}, **more
    )


# What tries a layout: one platform beside the scene, both together, overhead, above each other, apart by 150°.
ODD = {
    "overhead": pair((0, 0, 20e3), (10e3, 3e3, 2e3), (100, 0, 0)),
    "nearly overhead": pair((100, 20, 20e3), (10e3, 3e3, 2e3), radius=3e3),
    "150 degrees": pair((10e3, 0, 3e3), (-8660, 5e3, 3e3), v_rx=(-50, -80, 0), radius=1e3),
    "above each other": pair((10e3, 0, 3e3), (10e3, 0, 5e3)),
    "same from the side": pair((10e3, 0, 3e3), (5e3, 8660, 3e3)),
    "scene larger than the collection": pair((2e3, 1e3, 1e3), (-1e3, 2e3, 1e3), radius=5e3),
    "geostationary and drone": pair((20e6, 5e6, 30e6), (100, -50, 120), (0, 3e3, 0), (10, 0, 2)),
    "climbing": pair((5e3, -4e3, 1e3), (3e3, 6e3, 2e3), (0, 0, 50)),
    "south-west": pair((-30e3, -12e3, 8e3), (-5e3, -9e3, 2e3), (70, -180, 0), (50, 0, 0), radius=2e3),
    "fixed on the ground": pair((300, 0, 0), (200, 100, 2), (0, 0, 0), (0, 20, 0)),
    "hovering over the scene": pair((500e3, 0, 500e3), (1, 1, 120), (0, 7500, 0), (3, 0, 0)),
    "along the track": pair((353.9e3, 0, 505.4e3), (353.9e3, 20e3, 505.4e3), (0, 7600, 0), (0, 7600, 0)),
    "side by side": pair((353.9e3, 0, 505.4e3), (354.2e3, 50, 505.4e3), (0, 7600, 0), (0, 7600, 0)),
}


def root_of(drawing: str) -> ElementTree.Element:
    return ElementTree.fromstring(drawing)


def centroids(root: ElementTree.Element, style: str) -> list[tuple[float, float]]:
    """Middles of the markers of one style, in the order in which they are drawn: the whole first, then the part."""
    found = []
    for element in root.iter(f"{SVG}path"):
        classes = element.get("class", "").split()
        if "marker" in classes and style in classes:
            numbers = [float(part) for part in re.findall(r"-?[\d.]+", element.get("d", ""))]
            xs, ys = numbers[::2], numbers[1::2]
            found.append((sum(xs) / len(xs), sum(ys) / len(ys)))
    return found


def scene_of(root: ElementTree.Element) -> tuple[float, float]:
    crosses = [
        element
        for element in root.iter(f"{SVG}path")
        if element.get("class") == "marker line"  # the scene's cross belongs to no platform
    ]
    numbers = [float(part) for part in re.findall(r"-?[\d.]+", crosses[0].get("d", ""))]
    return (numbers[0] + numbers[2]) / 2, (numbers[1] + numbers[3]) / 2


def pixels_per_metre(root: ElementTree.Element) -> float:
    """Scale as the ticks of the horizontal axis tell it."""
    axis = [text for text in root.iter(f"{SVG}text") if text.get("class") == "axis"]
    name = next(
        "".join(text.itertext())
        for text in axis
        if text.get("text-anchor") == "middle" and "[" in "".join(text.itertext())
    )
    unit = 1e3 if "[km]" in name else 1.0
    row = next(text.get("y") for text in axis if text.get("text-anchor") == "middle")
    ticks = sorted(
        (float(t.get("x", "")), float("".join(t.itertext()).replace("−", "-"))) for t in axis if t.get("y") == row
    )
    (left, first), (right, last) = ticks[-2:]  # from the side the left half counts backwards
    return (right - left) / ((last - first) * unit)


@pytest.mark.parametrize("name", ODD)
def test_the_plan_is_to_scale(name: str) -> None:
    """East and north of both platforms, read off the drawing by the ticks of its axes."""
    found = ODD[name]
    root = root_of(geometry_plan(found))
    x, y = scene_of(root)
    scale = pixels_per_metre(root)
    for platform, state in (("transmitter", found.geometry.transmitter), ("receiver", found.geometry.receiver)):
        px, py = centroids(root, platform)[0]
        tolerance = ROUNDING + 2e-4 * scale * state.slant_range  # ticks: over 60 px apart, to 0.01 px
        assert px - x == pytest.approx(state.position[0] * scale, abs=tolerance)
        assert y - py == pytest.approx(state.position[1] * scale, abs=tolerance)


@pytest.mark.parametrize("name", ODD)
def test_the_elevation_view_shows_true_ranges_and_angles(name: str) -> None:
    found = ODD[name]
    root = root_of(geometry_elevation(found))
    x, y = scene_of(root)
    scale = pixels_per_metre(root)
    for platform, state in (("transmitter", found.geometry.transmitter), ("receiver", found.geometry.receiver)):
        px, py = centroids(root, platform)[0]
        tolerance = ROUNDING + 2e-4 * scale * state.slant_range
        assert math.hypot(px - x, py - y) == pytest.approx(math.hypot(*state.position) * scale, abs=tolerance)
        assert y - py == pytest.approx(state.position[2] * scale, abs=tolerance)


def test_a_receiver_beside_the_scene_is_enlarged_to_scale() -> None:
    """The second panel has a scale of its own; the whole would show 1.5 km of 854 km as half a pixel."""
    found = found_in(ROOT / "specs" / "missions" / "sentinel1_fixed_receiver.yaml")
    root = root_of(geometry_plan(found))
    (small, large) = centroids(root, "receiver")
    crosses = [e for e in root.iter(f"{SVG}path") if e.get("class") == "marker line"]
    numbers = [float(part) for part in re.findall(r"-?[\d.]+", crosses[2].get("d", ""))]
    x, y = (numbers[0] + numbers[2]) / 2, (numbers[1] + numbers[3]) / 2
    assert math.dist(small, scene_of(root)) < 1
    # 1.15 km east and 0.96 km north, by the file
    assert (large[0] - x) / (y - large[1]) == pytest.approx(1.15 / 0.96, rel=1e-3)
    assert large[0] - x > 100
    assert "Around the scene, enlarged" in "".join(root.itertext())
    assert len(centroids(root, "transmitter")) == 1  # far outside of the enlargement


def test_satellites_flying_together_are_enlarged() -> None:
    root = root_of(geometry_plan(ODD["side by side"]))
    text = " ".join("".join(t.itertext()) for t in root.iter(f"{SVG}text"))
    assert "transmitter and receiver" in text
    assert "304 m apart" in text
    (_, tx), (_, rx) = centroids(root, "transmitter"), centroids(root, "receiver")
    assert (rx[0] - tx[0]) / (tx[1] - rx[1]) == pytest.approx(300 / 50, rel=2e-3)


@pytest.mark.parametrize("kind", DRAWINGS)
def test_a_still_platform_is_marked_as_fixed(kind: str) -> None:
    root = root_of(DRAWINGS[kind](ODD["fixed on the ground"]))
    assert centroids(root, "hollow")
    arrows = [e for e in root.iter(f"{SVG}path") if e.get("class") == "line transmitter"]
    assert not arrows
    if kind == "plan":
        assert "300 m, fixed" in "".join(root.itertext())


def test_look_and_smear_stand_at_their_azimuths() -> None:
    """φ_b of (11) by hand: the look vectors on the ground, (30, 0)/30.594 and (6, 6)/8.718."""
    root = root_of(geometry_plan(findings()))
    u = (30 / math.hypot(30, 6) + 6 / math.sqrt(76), 6 / math.sqrt(76))
    look = math.atan2(u[1], u[0])
    arrows = [e for e in root.iter(f"{SVG}path") if e.get("class") == "line"]
    lines = [[float(part) for part in re.findall(r"-?[\d.]+", e.get("d", ""))] for e in arrows]
    azimuths = [math.atan2(-(y2 - y1), x2 - x1) for x1, y1, x2, y2 in lines]
    assert azimuths[0] == pytest.approx(look, abs=1e-3)
    assert (azimuths[1] - look) % math.pi == pytest.approx(math.pi / 2, abs=1e-3)
    description = root.find(f"{SVG}desc")
    assert description is not None
    assert f"{math.degrees(look):.2f}°" in (description.text or "")


def test_a_curved_path_is_drawn_curved() -> None:
    """Sagitta aT²/8 = 5 · 20²/8 = 250 m between the ends of the path and its middle."""
    found = collection(
        transmitter={"position": (2e3, 0, 1e3), "velocity": (0, 100, 0), "acceleration": (-5, 0, 0)},
        receiver={"position": (1e3, 1e3, 800), "velocity": (0, 0, 0)},
        aperture_time=20.0,
    )
    root = root_of(geometry_plan(found))
    (path,) = [e for e in root.iter(f"{SVG}path") if e.get("class") == "transmitter path"]
    numbers = [float(part) for part in re.findall(r"-?[\d.]+", path.get("d", ""))]
    xs = numbers[::2]
    scale = pixels_per_metre(root)
    assert (max(xs) - xs[0]) / scale == pytest.approx(250, rel=2e-3)
    assert "path in the aperture of 20 s" in " ".join("".join(root.itertext()).split())


@pytest.mark.parametrize("kind", DRAWINGS)
@pytest.mark.parametrize("name", [*ODD, *(path.stem for path in SPECS)])
def test_no_label_covers_another_or_leaves_the_drawing(kind: str, name: str) -> None:
    found = ODD[name] if name in ODD else found_in(ROOT / "specs" / "missions" / f"{name}.yaml")
    root = root_of(DRAWINGS[kind](found))
    width, height = float(root.get("width", "")), float(root.get("height", ""))
    boxes = []
    for text in root.iter(f"{SVG}text"):
        if text.get("transform"):
            continue
        lines = [span for span in text if span.get("x")]
        wide = max(text_width("".join(line.itertext())) for line in lines) * (0.85 if text.get("class") else 1)
        x, y = float(text.get("x", "")), float(text.get("y", ""))
        left = x - {"start": 0, "middle": wide / 2, "end": wide}[text.get("text-anchor", "start")]
        top = y - 0.75 * LINE_PX
        boxes.append(Box(left, top, left + wide, top + LINE_PX * len(lines) - 3))
    for box in boxes:
        assert box.left >= -1
        assert box.right <= width + 1
        assert box.bottom <= height + 1
    for one, other in itertools.combinations(boxes, 2):
        assert one.covered_by(other) == 0


@pytest.mark.parametrize("kind", DRAWINGS)
def test_a_drawing_has_a_name_and_words_and_ids_of_its_own(kind: str) -> None:
    found = findings()
    roots = [root_of(DRAWINGS[kind](found._replace(file=file))) for file in ("a.yaml", "b.yaml")]
    for root in roots:
        assert root.get("role") == "img"
        title, description = root.find(f"{SVG}title"), root.find(f"{SVG}desc")
        assert title is not None
        assert description is not None
        assert root.get("aria-labelledby") == title.get("id")
        assert root.get("aria-describedby") == description.get("id")
        assert "base" in (title.text or "")
        assert "30.6 km" in (description.text or "")  # √(30² + 6²)
        assert "8.72 km" in (description.text or "")  # √(6² + 6² + 2²)
    ids = [
        e.get("id")
        for root in [*roots, root_of(geometry_plan(found)), root_of(geometry_elevation(found))]
        for e in root.iter()
        if e.get("id")
    ]
    assert len(ids) == len(set(ids)) == 8


def test_platforms_less_than_an_atom_apart_are_not_enlarged() -> None:
    """The scale of the enlargement was infinite, and so were the places in it."""
    found = pair((0.0, 1.0, 0.0), (3e-301, 1.0, 0.0), (0, 0, 0), (0, 0, 0))
    for draw in DRAWINGS.values():
        assert not re.search("nan|inf", " ".join(element.get("d", "") for element in root_of(draw(found)).iter()))


kilometres = st.floats(-5e4, 5e4)
metres_per_second = st.floats(-300, 300)


@examples(60)  # a few drawings take tens of ms, more on a busy machine
@given(
    name=st.text(max_size=40),
    tx=st.tuples(kilometres, kilometres, st.floats(0, 5e4)),
    rx=st.tuples(kilometres, kilometres, st.floats(0, 5e4)),
    v_tx=st.tuples(metres_per_second, metres_per_second, metres_per_second),
    v_rx=st.tuples(metres_per_second, metres_per_second, metres_per_second),
    shrink=st.sampled_from([1.0, 1e-3, 1e3]),
    radius=st.none() | st.floats(1, 1e5),
)
def test_any_collection_of_any_name_is_drawn(
    name: str, tx: Any, rx: Any, v_tx: Any, v_rx: Any, shrink: float, radius: Any
) -> None:
    """Text of the user's stays text: the title comes back as it was, but for what cannot be printed."""
    if math.hypot(*tx) < 1 or math.hypot(*rx) * shrink < 1:  # nobody flies within 1 m of the scene centre
        return
    rx = tuple(shrink * part for part in rx)
    found = pair(tx, rx, v_tx, v_rx, name=name, radius=radius)
    for draw in DRAWINGS.values():
        drawing = draw(found)
        assert drawing == draw(found)
        root = root_of(drawing)
        title = root.find(f"{SVG}title")
        assert title is not None
        if name.isprintable():
            assert (title.text or "").endswith(f": {name}")
        for element in root.iter():
            assert not re.search("nan|inf", element.get("d", ""))
            assert element.tag.removeprefix(SVG) in {
                "svg",
                "title",
                "desc",
                "style",
                "path",
                "circle",
                "text",
                "tspan",
            }
