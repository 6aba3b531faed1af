"""Draw the collection to scale as SVG, from above and from the side.

Objects that would coincide at this scale are shown enlarged in a second panel below. Examples are a receiver on the
ground next to the scene while the transmitter is a satellite, and two satellites in close formation. The text
description of each drawing contains the same numbers.
"""

import math
import textwrap
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.geometry import BistaticGeometry, PlatformState, Vector, Vectors, norm, plain_vector
from bisar_budget.report.drawing import svg
from bisar_budget.units import format_quantity

PlanePoint = tuple[float, float]  # in the plane of the drawing: to the right, up [m]

_VIEW_WIDTH_PX = 520.0  # of a drawing
_AXIS_PX, _VIEW_EDGE_PX = (54.0, 34.0), 8.0  # margins of a panel: beside and below it for axes, and elsewhere
_SPOT_PX = 30.0  # distance below which two objects share one spot of the drawing
_ENLARGED_PX = 60.0  # distance in space below which objects on one spot get an enlargement
_COINCIDENT_PX = 1e-6  # distance below which no enlargement separates two objects
_MIN_SPREAD_RATIO = 0.15  # least half-width of an enlargement, relative to the distance that it shows
_MIN_ENLARGEMENT_RATIO = 2.0  # an enlargement by a smaller factor is not drawn
_VELOCITY_PX, _LOOK_PX, _SMEAR_PX = 44.0, 62.0, 40.0  # lengths of arrows
_END_ON_RATIO = 0.3  # in-plane component of a unit velocity below which its arrow is drawn end on
_MIN_PATH_PX = 20.0  # shorter paths are hidden by marker and arrow
_NOTE_CHARACTERS = 88
_SCENE_CENTRE: PlanePoint = (0.0, 0.0)
_PATH_STEPS, _STEPS_PER_PIECE = 32, 4
_ENLARGEMENT_HEIGHT_RATIO = 0.75  # largest height of an enlargement, relative to that of the main panel
# Smallest and largest height of a panel, and its margins around the points: left and right, above, below. [px]
_PLAN, _SIDE = ((210.0, 400.0), (74.0, 66.0, 66.0)), ((130.0, 360.0), (82.0, 52.0, 34.0))


class _Platform(NamedTuple):
    """A platform in one view.

    `heading` is the projection of the unit vector of the velocity onto the drawing plane, and `toward` is the
    component of this vector towards the viewer.
    """

    name: str
    state: PlatformState
    at: PlanePoint
    heading: PlanePoint
    toward: float
    path: tuple[PlanePoint, ...]

    @property
    def is_still(self) -> bool:
        """Whether the platform is fixed to the ground."""
        return bool(norm(self.state.velocity) == 0)

    @property
    def motion(self) -> str:
        """Text with the speed of the platform, or `fixed`."""
        return "fixed" if self.is_still else format_quantity(float(norm(self.state.velocity)), "m/s")


class _View(NamedTuple):
    """The content of one drawing, from above or from the side."""

    findings: MissionFindings
    is_plan: bool
    platforms: tuple[_Platform, _Platform]

    @property
    def radius(self) -> float:
        """Radius of the scene; 0 if the file does not state the radius. [m]"""
        return self.findings.scene_radius or 0.0


def geometry_plan(findings: MissionFindings) -> str:
    """Draw the collection from above as SVG.

    The drawing shows platforms, velocities, lines of sight, the look direction φ_b, and the smear direction. The two
    directions are given by equations (11) and (31) of Rigling & Moses.
    """
    platforms = [
        _seen(name, state, findings, lambda vector: (vector[0], vector[1]), _direction(state.velocity)[2])
        for name, state in _named(findings.geometry)
    ]
    look = float(findings.geometry.look_azimuth)
    description = (
        f"Plan view to scale, east to the right and north up, scene centre at the origin. "
        f"{' '.join(_in_words(name, state) for name, state in _named(findings.geometry))} "
        f"The bistatic look direction is {_degrees(look)} from east, counter-clockwise; motion errors smear the "
        f"image along the line at {_degrees((look + math.pi / 2) % math.pi)}, perpendicular to it."
    )
    return _drawing(_View(findings, True, (platforms[0], platforms[1])), "plan", "above", description)


def geometry_elevation(findings: MissionFindings) -> str:
    """Draw the collection from the side as SVG, with heights, slant ranges and elevation angles.

    Each platform is drawn in the vertical plane that contains it and the scene centre, so that its slant range and
    elevation are not distorted. If these planes are more than 90° apart in azimuth, they are drawn on opposite sides.
    """
    geometry = findings.geometry
    turned = _planes_apart(geometry)
    sides = (1.0, -1.0 if _is_on_other_side(geometry, turned) else 1.0)
    platforms = [
        _in_own_plane(name, state, side, findings)
        for (name, state), side in zip(_named(geometry), sides, strict=True)
    ]
    overhead = [name for name, state in _named(geometry) if _is_overhead(state)]
    planes_words = (
        "Each platform in the vertical plane through it and the scene centre: slant ranges and elevations are true. "
        + (f"The {overhead[0]} is overhead." if overhead else f"The planes are {_degrees(turned)} apart in azimuth.")
    )
    description = (
        "Elevation view to scale, height over ground distance from the scene centre. "
        f"{planes_words} {' '.join(_side_in_words(name, state) for name, state in _named(geometry))}"
    )
    return _drawing(
        _View(findings, False, (platforms[0], platforms[1])), "elevation", "the side", description, planes_words
    )


def _named(geometry: BistaticGeometry) -> tuple[tuple[str, PlatformState], tuple[str, PlatformState]]:
    return ("transmitter", geometry.transmitter), ("receiver", geometry.receiver)


def _flown(state: PlatformState, aperture_time: float) -> tuple[Vector, ...]:
    """Positions of a platform along its path over the aperture; only the two end points if it is straight. [m]"""
    steps = 1 if state.is_straight else _PATH_STEPS
    if state.curve is not None:
        steps = max(steps, _STEPS_PER_PIECE * state.curve.count)
    times = (aperture_time * (index / steps - 0.5) for index in range(steps + 1))
    return tuple(plain_vector(state.at(time)[0]) for time in times)


def _direction(velocity: Vectors) -> Vector:
    x, y, z = plain_vector(velocity)
    speed = norm((x, y, z))
    return (x / speed, y / speed, z / speed) if speed else (x, y, z)


def _planes_apart(geometry: BistaticGeometry) -> float:
    """Angle between the vertical planes through the platforms and the scene centre, 0 to π. [rad]"""
    turn = float(geometry.receiver.azimuth - geometry.transmitter.azimuth)
    return abs((turn + math.pi) % (2 * math.pi) - math.pi)


def _is_on_other_side(geometry: BistaticGeometry, turned: float) -> bool:
    """Whether the receiver is drawn on the side opposite to the transmitter.

    This is the case if the azimuths of the platforms differ by more than 90°, or if the symbols of the platforms
    would overlap on the same side. `turned` [rad] is the difference of the azimuths.
    """
    if turned > math.pi / 2:
        return True
    pair = geometry.transmitter, geometry.receiver
    in_drawing = math.dist(*((math.hypot(*p.position[:2]), p.position[2]) for p in pair))
    in_space = math.dist(*(p.position for p in pair))
    widest = max(float(p.slant_range) for p in pair)
    return in_drawing < 0.08 * widest < in_space


def _is_overhead(state: PlatformState) -> bool:
    return bool(math.hypot(*state.position[:2]) <= 1e-9 * state.slant_range)


def _seen(
    name: str,
    state: PlatformState,
    findings: MissionFindings,
    projected: Callable[[Vector], PlanePoint],
    toward: float,
) -> _Platform:
    """Project a platform on the drawing plane; `projected` maps a vector to this plane."""
    path = tuple(map(projected, _flown(state, findings.aperture_time)))
    return _Platform(
        name, state, projected(plain_vector(state.position)), projected(_direction(state.velocity)), toward, path
    )


def _in_own_plane(name: str, state: PlatformState, side: float, findings: MissionFindings) -> _Platform:
    # A platform overhead is in every vertical plane.
    azimuth = findings.geometry.look_azimuth if _is_overhead(state) else state.azimuth
    outward = (math.cos(azimuth), math.sin(azimuth))
    x, y, _ = _direction(state.velocity)
    toward = side * (x * outward[1] - y * outward[0])  # right × up points to the viewer
    return _seen(
        name,
        state,
        findings,
        lambda vector: (side * (vector[0] * outward[0] + vector[1] * outward[1]), vector[2]),
        toward,
    )


def _in_words(name: str, state: PlatformState) -> str:
    east, north, _ = plain_vector(state.position)
    speed = float(norm(state.velocity))
    if speed == 0:
        motion = "it is fixed"
    elif math.hypot(*state.velocity[:2]) < 1e-6 * speed:
        motion = f"it moves vertically at {format_quantity(speed, 'm/s')}"
    else:
        azimuth = math.atan2(state.velocity[1], state.velocity[0])
        motion = f"it moves at {format_quantity(speed, 'm/s')} towards {_degrees(azimuth)} from east"
    return (
        f"The {name} is {_compass(east, 'east', 'west')} and {_compass(north, 'north', 'south')} of the scene "
        f"centre, slant range {format_quantity(float(state.slant_range), 'm')}; {motion}."
    )


def _side_in_words(name: str, state: PlatformState) -> str:
    return (
        f"The {name} is {format_quantity(float(state.position[2]), 'm')} high at a ground distance of "
        f"{format_quantity(math.hypot(*state.position[:2]), 'm')}: slant range "
        f"{format_quantity(float(state.slant_range), 'm')}, elevation {_degrees(float(state.elevation))}."
    )


def _compass(value: float, positive: str, negative: str) -> str:
    return f"{format_quantity(abs(value), 'm')} {positive if value >= 0 else negative}"


class _Panel(NamedTuple):
    """One panel of a drawing: its frame [px], the point `centre` [m] shown in its middle, and its scale [px/m]."""

    frame: svg.Box
    centre: PlanePoint
    scale: float

    def pixel(self, point: PlanePoint) -> svg.Point:
        x, y = self.frame.middle
        return x + (point[0] - self.centre[0]) * self.scale, y - (point[1] - self.centre[1]) * self.scale


def _drawing(view: _View, kind: str, side: str, description: str, note: str = "") -> str:
    """Draw a view as SVG, with an enlargement below if objects are too close together, and a note on the symbols."""
    canvas = svg.Canvas()
    main = _main_panel(view)
    enlarged = _enlargement(view, main)
    is_scene_enlarged = enlarged is not None and bool(_platforms_at_scene(view, main))
    _axes(canvas, main, view)
    _draw_panel(canvas, main, view, is_detail=not is_scene_enlarged, enlarged=enlarged)
    bottom = main.frame.bottom + _AXIS_PX[1]
    if enlarged:
        caption = (
            f"Around the {'scene' if is_scene_enlarged else 'platforms'}, "
            f"enlarged {_times(enlarged.scale / main.scale)} times"
        )
        canvas.text((enlarged.frame.left, enlarged.frame.top - 8), [caption], "small")
        _outline(canvas, enlarged)
        _draw_panel(canvas, enlarged, view, is_detail=is_scene_enlarged, enlarged=None)
        bottom = enlarged.frame.bottom
    symbols = _symbols(view, [main, enlarged] if enlarged else [main])
    lines = textwrap.wrap(" ".join(filter(None, [note, *symbols])), _NOTE_CHARACTERS)
    for index, line in enumerate(lines):
        canvas.text((main.frame.left, bottom + 18 + 13 * index), [line], "small")
    title, findings = f"Geometry from {side}: {view.findings.name}", view.findings
    if view.radius:
        description += f" The scene has a radius of {format_quantity(view.radius, 'm')}."
    size = (_VIEW_WIDTH_PX, bottom + 18 + 13 * len(lines))
    return canvas.document(size, f"{kind} {findings.file}", title, description)


def _main_panel(view: _View) -> _Panel:
    """Make the main panel with the platforms and the scene; a scene much larger than the collection is clipped."""
    points = [_SCENE_CENTRE, *(p.at for p in view.platforms), *(point for p in view.platforms for point in p.path)]
    if view.radius <= 2 * max(math.hypot(*point) for point in points):
        points += _extent(view, _SCENE_CENTRE, view.radius)
    return _fitted(view, points, _VIEW_EDGE_PX)


def _platforms_at_scene(view: _View, main: _Panel) -> list[_Platform]:
    return [p for p in view.platforms if p.state.slant_range * main.scale < _ENLARGED_PX]


def _enlargement(view: _View, main: _Panel) -> _Panel | None:
    """Make a panel below the main panel for platforms close to the scene or to each other.

    Returns None if there are no such platforms, or if an enlargement would be too small to be useful or would not
    separate them.
    """
    top = main.frame.bottom + _AXIS_PX[1] + 26
    first, second = view.platforms
    separation = math.dist(first.state.position, second.state.position)
    if platforms_at_scene := _platforms_at_scene(view, main):
        reach = max(p.state.slant_range for p in platforms_at_scene)
        points = [_SCENE_CENTRE, *(place for p in platforms_at_scene for place in (p.at, *p.path))]
        points += _extent(view, _SCENE_CENTRE, view.radius if view.radius <= 2 * reach else 0.0)
    elif _COINCIDENT_PX < separation * main.scale < _ENLARGED_PX and _pixels_apart(main, first, second) < _SPOT_PX:
        reach = separation
        points = [first.at, second.at]
    else:
        return None
    east, north = ((min(values) + max(values)) / 2 for values in zip(*points, strict=True))
    middle = _SCENE_CENTRE if platforms_at_scene else (east, north)
    panel = _fitted(
        view, [*points, *_extent(view, middle, float(_MIN_SPREAD_RATIO * reach))], top, _ENLARGEMENT_HEIGHT_RATIO
    )
    is_still_one_spot = not platforms_at_scene and _pixels_apart(panel, first, second) < _SPOT_PX
    return None if is_still_one_spot or panel.scale < _MIN_ENLARGEMENT_RATIO * main.scale else panel


def _symbols(view: _View, panels: Sequence[_Panel]) -> Iterator[str]:
    """Yield sentences that explain the symbols that have no labels."""
    if any(not p.is_still and not _is_end_on(p) for p in view.platforms):
        yield "Arrows at the platforms: direction of flight, not speed."
    if any(_shows_path(panel, p) for panel in panels for p in view.platforms):
        yield f"Broad line: path in the aperture of {format_quantity(view.findings.aperture_time, 's')}."
    if any(_is_end_on(p) for p in view.platforms):
        yield "Circle with dot: flight towards the viewer; with cross: away."


def _extent(view: _View, centre: PlanePoint, reach: float) -> list[PlanePoint]:
    """Outermost points of a circle with radius `reach` [m] around `centre`, as seen in the view.

    Four points are returned for the view from above, and two for the side view.
    """
    x, y = centre
    ends = [(x - reach, y), (x + reach, y)]
    return [*ends, (x, y - reach), (x, y + reach)] if view.is_plan else ends


def _fitted(view: _View, points: Sequence[PlanePoint], top: float, height_fraction: float = 1.0) -> _Panel:
    """Make a panel with the largest scale at which all points fit, with margins for their labels."""
    (lowest, highest), (margin_side, margin_above, margin_below) = _PLAN if view.is_plan else _SIDE
    highest *= height_fraction
    xs, ys = zip(*points, strict=True)
    wide, tall = max(xs) - min(xs), max(ys) - min(ys)
    width = _VIEW_WIDTH_PX - _AXIS_PX[0] - _VIEW_EDGE_PX
    scale = min(
        (width - 2 * margin_side) / wide if wide else math.inf,
        (highest - margin_above - margin_below) / tall if tall else math.inf,
    )
    height = min(max(lowest, tall * scale + margin_above + margin_below), highest)
    slack = (height - tall * scale - margin_above - margin_below) / 2 if view.is_plan else 0.0
    # The margins are unequal, so the points are not centred. From the side, the lowest point is at the bottom margin.
    low = min(ys) - (margin_below + slack) / scale
    centre = ((max(xs) + min(xs)) / 2, low + height / 2 / scale)
    return _Panel(svg.Box(_AXIS_PX[0], top, _AXIS_PX[0] + width, top + height), centre, scale)


def _axes(canvas: svg.Canvas, panel: _Panel, view: _View) -> None:
    """Draw the grid, ticks and names of the axes; both axes have the same tick spacing."""
    frame, scale = panel.frame, panel.scale
    step = svg.round_step(62 / scale)
    reach = max(abs(panel.centre[0]), abs(panel.centre[1])) + (frame.right - frame.left) / scale
    unit, name = (1e3, "km") if reach >= 2e3 else (1.0, "m")
    half = ((frame.right - frame.left) / 2 / scale, (frame.bottom - frame.top) / 2 / scale)
    for value in svg.ticks(panel.centre[0] - half[0], panel.centre[0] + half[0], step):
        x, _ = panel.pixel((value, 0.0))
        if frame.left + 1 < x < frame.right - 1:
            canvas.polyline(frame.upright(x), "grid", is_obstacle=False)
        shown = value if view.is_plan else abs(value)
        text = svg.axis_number(shown / unit)
        if x + svg.text_width(text) / 2 < _VIEW_WIDTH_PX:
            canvas.text((x, frame.bottom + 13), [text], "axis", "middle")
    for value in svg.ticks(panel.centre[1] - half[1], panel.centre[1] + half[1], step):
        _, y = panel.pixel((0.0, value))
        if not view.is_plan and value < 0:
            continue
        if frame.top + 1 < y < frame.bottom - 1:
            canvas.polyline(frame.level(y), "grid", is_obstacle=False)
        canvas.text((frame.left - 5, y + 3.5), [svg.axis_number(value / unit)], "axis", "end")
    across, up = ("east", "north") if view.is_plan else ("ground distance", "height")
    canvas.text((frame.middle[0], frame.bottom + 28), [f"{across} [{name}]"], "axis", "middle")
    canvas.upright_text((11, frame.middle[1]), f"{up} [{name}]", "axis")
    svg.outline(canvas, frame, "grid")


def _outline(canvas: svg.Canvas, panel: _Panel) -> None:
    """Draw the frame and the scale bar of an enlargement."""
    frame = panel.frame
    svg.outline(canvas, frame, "grid")
    length = svg.round_step(40 / panel.scale)
    right, y = frame.right - 10, frame.top + 22
    left = right - length * panel.scale
    for line in ([(left, y), (right, y)], *([(x, y - 3), (x, y + 3)] for x in (left, right))):
        canvas.polyline(line, "line")
    canvas.text(((left + right) / 2, y - 6), [format_quantity(length, "m")], "axis", "middle")
    canvas.obstacles.append(svg.Box(left - 4, frame.top, frame.right, y + 4))


def _draw_panel(canvas: svg.Canvas, panel: _Panel, view: _View, is_detail: bool, enlarged: _Panel | None) -> None:
    """Draw the content of a panel: first lines, then markers, and finally labels in the remaining space."""
    frame, scene = panel.frame, panel.pixel(_SCENE_CENTRE)
    if view.is_plan:
        if view.radius * panel.scale >= 3:
            radius = view.radius * panel.scale
            circle = [_turned(scene, radius, 2 * math.pi * index / 96) for index in range(97)]
            canvas.polyline(circle, "thin", frame)
    else:
        canvas.polyline(frame.level(scene[1]), "line", frame)
        if view.radius * panel.scale >= 3:
            ends = [panel.pixel((sign * view.radius, 0.0)) for sign in (-1, 1)]
            canvas.polyline(ends, "line path", frame)
    for platform in view.platforms:
        dashes = "dashed" if platform.name == "transmitter" else "dotted"
        canvas.polyline([scene, panel.pixel(platform.at)], f"{platform.name} {dashes}", frame)
        if _shows_path(panel, platform):
            canvas.polyline([panel.pixel(point) for point in platform.path], f"{platform.name} path", frame)
    has_scene = frame.holds(scene)
    labels: list[svg.DrawnLabel] = []
    if is_detail and has_scene:
        if view.is_plan:
            labels += _directions(canvas, panel, view)
        else:
            for platform, radius in zip(view.platforms, (30.0, 42.0), strict=True):
                _arc(canvas, panel, platform, radius)
    visible = [p for p in view.platforms if frame.holds(panel.pixel(p.at))]
    for platform in visible:
        _velocity(canvas, panel, platform)
    for platform in visible:
        _marker(canvas, panel.pixel(platform.at), platform)
    if has_scene:
        for x, y in ((5, 0), (0, 5)):
            canvas.polyline([(scene[0] - x, scene[1] - y), (scene[0] + x, scene[1] + y)], "marker line")
        canvas.obstacles.append(svg.Box(scene[0] - 5, scene[1] - 5, scene[0] + 5, scene[1] + 5))
    canvas.labels([*_labels(panel, view, visible, has_scene, enlarged), *labels])


def _labels(
    panel: _Panel, view: _View, visible: Sequence[_Platform], has_scene: bool, enlarged: _Panel | None
) -> Iterator[svg.DrawnLabel]:
    """Yield the labels of platforms and scene. Objects at the same place in the drawing share a label."""
    frame, scene = panel.frame, panel.pixel(_SCENE_CENTRE)
    # From the side, labels of platforms are above the ground.
    above = frame if view.is_plan else frame._replace(bottom=min(frame.bottom, scene[1]))
    at_scene = [p for p in visible if has_scene and math.dist(panel.pixel(p.at), scene) < _SPOT_PX]
    free = [p for p in visible if p not in at_scene]
    if len(free) == 2 and _pixels_apart(panel, *free) < _SPOT_PX:
        distance = math.dist(*(p.state.position for p in free))
        together = f"{_range(view, free[0])}, {format_quantity(distance, 'm')} apart"
        below = ("enlarged below",) if enlarged else ()
        yield svg.DrawnLabel(panel.pixel(free[0].at), ("transmitter and receiver", together, *below), above)
    else:
        for platform in free:
            lines = platform.name, _range(view, platform) + (f", {platform.motion}" if view.is_plan else "")
            yield svg.DrawnLabel(panel.pixel(platform.at), lines, above)
    if has_scene:
        if at_scene and enlarged:
            names = " and ".join(["scene", *(p.name for p in at_scene)])
            yield svg.DrawnLabel(scene, (names, "enlarged below"), frame)
        elif at_scene:
            names = " and ".join(p.name for p in at_scene)
            ranges = ", ".join(f"{_range(view, p)}, {p.motion}" for p in at_scene)
            yield svg.DrawnLabel(scene, (f"{names} over the scene", ranges), frame)
        else:
            radius = f", radius {format_quantity(view.radius, 'm')}" if view.radius else ""
            yield svg.DrawnLabel(scene, (f"scene{radius}",), frame)
    for platform in view.platforms:
        if platform not in visible and (segment := frame.clipped((scene, panel.pixel(platform.at)))):
            yield svg.DrawnLabel(segment[1], (f"to {platform.name}, {_range(view, platform)}",), above)
    if not has_scene and visible and (segment := frame.clipped((panel.pixel(visible[0].at), scene))):
        yield svg.DrawnLabel(segment[1], ("to the scene",), frame)


def _range(view: _View, platform: _Platform) -> str:
    slant = format_quantity(float(platform.state.slant_range), "m")
    return slant if view.is_plan else f"{slant} at {_degrees(float(platform.state.elevation))}"


def _directions(canvas: svg.Canvas, panel: _Panel, view: _View) -> Iterator[svg.DrawnLabel]:
    """Draw arrows for the look direction φ_b and the smear direction; yield their labels."""
    scene, look = panel.pixel(_SCENE_CENTRE), float(view.findings.geometry.look_azimuth)
    tip = _turned(scene, _LOOK_PX, look)
    ends = [_turned(scene, sign * _SMEAR_PX, look + math.pi / 2) for sign in (-1, 1)]
    canvas.arrow(scene, tip)
    canvas.arrow(ends[0], ends[1], both_ends=True)
    yield svg.DrawnLabel(tip, (f"look φ_b {_degrees(look)}",), panel.frame)
    yield svg.DrawnLabel(max(ends, key=lambda end: end[1]), ("smear",), panel.frame)


def _turned(origin: svg.Point, length: float, azimuth: float) -> svg.Point:
    return (origin[0] + length * math.cos(azimuth), origin[1] - length * math.sin(azimuth))


def _arc(canvas: svg.Canvas, panel: _Panel, platform: _Platform, radius: float) -> None:
    """Draw the elevation angle of a platform as an arc around the scene centre."""
    scene = panel.pixel(_SCENE_CENTRE)
    end = math.atan2(platform.at[1], platform.at[0])
    start = 0.0 if end <= math.pi / 2 else math.pi
    steps = [start + (end - start) * index / 16 for index in range(17)]
    canvas.polyline([_turned(scene, radius, angle) for angle in steps], f"{platform.name}", panel.frame)


def _velocity(canvas: svg.Canvas, panel: _Panel, platform: _Platform) -> None:
    if platform.is_still:
        return
    x, y = panel.pixel(platform.at)
    if _is_end_on(platform):
        side = (
            14 if platform.name == "transmitter" else -14
        )  # opposite sides, so that two platforms on one spot show both
        centre = (x + math.copysign(side, side * platform.at[0]), y - 13)
        canvas.circle(centre, 5.5, f"{platform.name}")
        if platform.toward > 0:
            canvas.circle(centre, 1.6, f"solid {platform.name}")
        else:
            for slope in (1, -1):
                canvas.polyline(
                    [(centre[0] - 3.9, centre[1] - 3.9 * slope), (centre[0] + 3.9, centre[1] + 3.9 * slope)],
                    platform.name,
                )
        return
    tip = (x + _VELOCITY_PX * platform.heading[0], y - _VELOCITY_PX * platform.heading[1])
    canvas.arrow((x, y), tip, platform.name)


def _is_end_on(platform: _Platform) -> bool:
    return not platform.is_still and math.hypot(*platform.heading) < _END_ON_RATIO


def _marker(canvas: svg.Canvas, at: svg.Point, platform: _Platform) -> None:
    """Draw a triangle for the transmitter or a square for the receiver; it is hollow for a fixed platform."""
    x, y = at
    style = f"marker {'hollow line' if platform.is_still else 'solid'} {platform.name}"
    if platform.name == "transmitter":
        canvas.polygon([(x, y - 7), (x + 6, y + 3.5), (x - 6, y + 3.5)], style)  # the centroid is at the platform
    else:
        canvas.polygon([(x - 5, y - 5), (x + 5, y - 5), (x + 5, y + 5), (x - 5, y + 5)], style)


def _pixels_apart(panel: _Panel, first: _Platform, second: _Platform) -> float:
    return math.dist(panel.pixel(first.at), panel.pixel(second.at))


def _shows_path(panel: _Panel, platform: _Platform) -> bool:
    length = math.fsum(math.dist(*pair) for pair in pairwise(platform.path))
    return panel.frame.holds(panel.pixel(platform.at)) and length * panel.scale >= _MIN_PATH_PX


def _degrees(angle: float) -> str:
    """Write an angle [rad] in degrees, with up to two decimals."""
    return f"{svg.axis_number(round(math.degrees(angle), 2))}°"


def _times(factor: float) -> str:
    return f"{float(f'{factor:.2g}'):,.10g}"
