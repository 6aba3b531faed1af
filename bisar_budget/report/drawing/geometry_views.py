"""The collection drawn to scale, from above and from the side, as SVG.

What would coincide at the scale of the whole is enlarged in a panel of its own below: a receiver beside the scene of
a satellite, or two satellites flying together. The description of each drawing says its numbers in words.
"""

import math
import textwrap
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.geometry import BistaticGeometry, PlatformState, Vector, norm
from bisar_budget.report.drawing import svg
from bisar_budget.units import format_quantity

Place = tuple[float, float]  # in the plane that is drawn: to the right, up [m]

_WIDTH = 520.0  # px, of a drawing
_AXIS, _EDGE = (54.0, 34.0), 8.0  # px, beside and below a panel for its axes; elsewhere
_APART = 30.0  # px; nearer than this two things are one spot of the drawing
_CLOSE = 60.0  # px; what is nearer than this in space too deserves an enlargement
_SAME = 1e-6  # px; no enlargement tells apart what is nearer
_SPREAD = 0.15  # of a distance: an enlargement shows at least this much each way, however things line up
_ENLARGED = 2.0  # times; less is not worth a panel
_VELOCITY, _LOOK, _SMEAR = 44.0, 62.0, 40.0  # px, lengths of arrows
_SHORT = 0.3  # of an arrow; less of it in the plane of the drawing is drawn as seen from its end
_SEEN_PATH = 20.0  # px; shorter paths are hidden by marker and arrow
_NOTE_COLUMNS = 88
_SCENE: Place = (0.0, 0.0)
_PATH_STEPS, _STEPS_PER_PIECE = 32, 4
_LOWER = 0.75  # of the largest height: an enlargement's
# Least and largest height of a panel, and its margins: left and right, above, below what is in it. [px]
_PLAN, _SIDE = ((210.0, 400.0), (74.0, 66.0, 66.0)), ((130.0, 360.0), (82.0, 52.0, 34.0))


class _Platform(NamedTuple):
    """One platform in one view. `heading` is the unit velocity in the plane, `toward` its part to the viewer."""

    name: str
    state: PlatformState
    at: Place
    heading: Place
    toward: float
    path: tuple[Place, ...]

    @property
    def is_still(self) -> bool:
        """Whether it is fixed to the ground."""
        return bool(norm(self.state.velocity) == 0)

    @property
    def motion(self) -> str:
        """Speed in words."""
        return "fixed" if self.is_still else format_quantity(norm(self.state.velocity), "m/s")


class _View(NamedTuple):
    """The content of one drawing, from above or from the side."""

    found: MissionFindings
    is_plan: bool
    platforms: tuple[_Platform, _Platform]

    @property
    def radius(self) -> float:
        """Radius of the scene; 0 where the file states none. [m]"""
        return self.found.scene_radius or 0.0


def geometry_plan(findings: MissionFindings) -> str:
    """The collection from above as SVG: platforms, velocities, lines of sight, φ_b of (11), smear of (31)."""
    platforms = [
        _seen(name, state, findings, lambda vector: (vector[0], vector[1]), _direction(state.velocity)[2])
        for name, state in _named(findings.geometry)
    ]
    look = findings.geometry.look_azimuth
    description = (
        f"Plan view to scale, east to the right and north up, scene centre at the origin. "
        f"{' '.join(_in_words(name, state) for name, state in _named(findings.geometry))} "
        f"The bistatic look direction is {_degrees(look)} from east, counter-clockwise; motion errors smear the "
        f"image along the line at {_degrees((look + math.pi / 2) % math.pi)}, perpendicular to it."
    )
    return _drawing(_View(findings, True, (platforms[0], platforms[1])), "plan", "above", description)


def geometry_elevation(findings: MissionFindings) -> str:
    """The collection from the side as SVG: heights, slant ranges, elevation angles.

    Each platform is drawn in the vertical plane through it and the scene centre, so that its slant range and
    elevation are true; planes more than 90° apart in azimuth go to opposite sides.
    """
    geometry = findings.geometry
    turned = _planes_apart(geometry)
    sides = (1.0, -1.0 if _is_on_other_side(geometry, turned) else 1.0)
    platforms = [
        _in_own_plane(name, state, side, findings)
        for (name, state), side in zip(_named(geometry), sides, strict=True)
    ]
    overhead = [name for name, state in _named(geometry) if _is_overhead(state)]
    how = (
        "Each platform in the vertical plane through it and the scene centre: slant ranges and elevations are true. "
        + (f"The {overhead[0]} is overhead." if overhead else f"The planes are {_degrees(turned)} apart in azimuth.")
    )
    description = (
        "Elevation view to scale, height over ground distance from the scene centre. "
        f"{how} {' '.join(_side_in_words(name, state) for name, state in _named(geometry))}"
    )
    return _drawing(_View(findings, False, (platforms[0], platforms[1])), "elevation", "the side", description, how)


def _named(geometry: BistaticGeometry) -> tuple[tuple[str, PlatformState], tuple[str, PlatformState]]:
    return ("transmitter", geometry.transmitter), ("receiver", geometry.receiver)


def _flown(state: PlatformState, aperture_time: float) -> tuple[Vector, ...]:
    """Places along the aperture; both ends say all of a straight path."""
    steps = 1 if state.is_straight else _PATH_STEPS
    if state.curve is not None:
        steps = max(steps, _STEPS_PER_PIECE * state.curve.count)
    times = (aperture_time * (index / steps - 0.5) for index in range(steps + 1))
    return tuple(state.at(time)[0] for time in times)


def _direction(velocity: Vector) -> Vector:
    speed = norm(velocity)
    return (velocity[0] / speed, velocity[1] / speed, velocity[2] / speed) if speed else velocity


def _planes_apart(geometry: BistaticGeometry) -> float:
    """Angle between the vertical planes through the platforms, 0 to π. [rad]"""
    turn: float = geometry.receiver.azimuth - geometry.transmitter.azimuth
    return abs((turn + math.pi) % (2 * math.pi) - math.pi)


def _is_on_other_side(geometry: BistaticGeometry, turned: float) -> bool:
    """Say whether the receiver goes opposite the transmitter: beyond 90°, or where one would cover the other."""
    if turned > math.pi / 2:
        return True
    pair = geometry.transmitter, geometry.receiver
    in_drawing = math.dist(*((math.hypot(*p.position[:2]), p.position[2]) for p in pair))
    in_space = math.dist(*(p.position for p in pair))
    widest: float = max(p.slant_range for p in pair)
    return in_drawing < 0.08 * widest < in_space


def _is_overhead(state: PlatformState) -> bool:
    return bool(math.hypot(*state.position[:2]) <= 1e-9 * state.slant_range)


def _seen(
    name: str, state: PlatformState, findings: MissionFindings, seen: Callable[[Vector], Place], toward: float
) -> _Platform:
    """A platform in the plane on which `seen` projects."""
    path = tuple(map(seen, _flown(state, findings.aperture_time)))
    return _Platform(name, state, seen(state.position), seen(_direction(state.velocity)), toward, path)


def _in_own_plane(name: str, state: PlatformState, side: float, findings: MissionFindings) -> _Platform:
    # Overhead any vertical plane holds it.
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
    east, north = state.position[:2]
    if norm(state.velocity) == 0:
        motion = "it is fixed"
    elif math.hypot(*state.velocity[:2]) < 1e-6 * norm(state.velocity):
        motion = f"it moves vertically at {format_quantity(norm(state.velocity), 'm/s')}"
    else:
        azimuth = math.atan2(state.velocity[1], state.velocity[0])
        motion = f"it moves at {format_quantity(norm(state.velocity), 'm/s')} towards {_degrees(azimuth)} from east"
    return (
        f"The {name} is {_compass(east, 'east', 'west')} and {_compass(north, 'north', 'south')} of the scene "
        f"centre, slant range {format_quantity(state.slant_range, 'm')}; {motion}."
    )


def _side_in_words(name: str, state: PlatformState) -> str:
    return (
        f"The {name} is {format_quantity(state.position[2], 'm')} high at a ground distance of "
        f"{format_quantity(math.hypot(*state.position[:2]), 'm')}: slant range "
        f"{format_quantity(state.slant_range, 'm')}, elevation {_degrees(state.elevation)}."
    )


def _compass(value: float, positive: str, negative: str) -> str:
    return f"{format_quantity(abs(value), 'm')} {positive if value >= 0 else negative}"


class _Panel(NamedTuple):
    """A part of the page and what it shows: `centre` lies in its middle, at `scale`. [px], [m], [px/m]"""

    frame: svg.Box
    centre: Place
    scale: float

    def pixel(self, place: Place) -> svg.Point:
        x, y = self.frame.middle
        return x + (place[0] - self.centre[0]) * self.scale, y - (place[1] - self.centre[1]) * self.scale


def _drawing(view: _View, kind: str, side: str, description: str, note: str = "") -> str:
    """A view, what is too close enlarged below; a note and what explains the symbols stand at its end."""
    canvas = svg.Canvas()
    main = _whole(view)
    enlarged = _enlargement(view, main)
    of_scene = enlarged is not None and bool(_beside_the_scene(view, main))
    _axes(canvas, main, view)
    _draw_panel(canvas, main, view, is_detail=not of_scene, enlarged=enlarged)
    bottom = main.frame.bottom + _AXIS[1]
    if enlarged:
        what = (
            f"Around the {'scene' if of_scene else 'platforms'}, enlarged {_times(enlarged.scale / main.scale)} times"
        )
        canvas.text((enlarged.frame.left, enlarged.frame.top - 8), [what], "small")
        _outline(canvas, enlarged)
        _draw_panel(canvas, enlarged, view, is_detail=of_scene, enlarged=None)
        bottom = enlarged.frame.bottom
    symbols = _symbols(view, [main, enlarged] if enlarged else [main])
    lines = textwrap.wrap(" ".join(filter(None, [note, *symbols])), _NOTE_COLUMNS)
    for index, line in enumerate(lines):
        canvas.text((main.frame.left, bottom + 18 + 13 * index), [line], "small")
    title, found = f"Geometry from {side}: {view.found.name}", view.found
    if view.radius:
        description += f" The scene has a radius of {format_quantity(view.radius, 'm')}."
    size = (_WIDTH, bottom + 18 + 13 * len(lines))
    return canvas.document(size, f"{kind} {found.file}", title, description)


def _whole(view: _View) -> _Panel:
    """Panel that shows scene and platforms; a scene far larger than the collection is cut off."""
    places = [_SCENE, *(p.at for p in view.platforms), *(place for p in view.platforms for place in p.path)]
    if view.radius <= 2 * max(math.hypot(*place) for place in places):
        places += _extent(view, _SCENE, view.radius)
    return _fitted(view, places, _EDGE)


def _beside_the_scene(view: _View, main: _Panel) -> list[_Platform]:
    return [p for p in view.platforms if p.state.slant_range * main.scale < _CLOSE]


def _enlargement(view: _View, main: _Panel) -> _Panel | None:
    """Panel below for platforms beside the scene, or beside each other; None where it would show no more."""
    top = main.frame.bottom + _AXIS[1] + 26
    first, second = view.platforms
    separation = math.dist(first.state.position, second.state.position)
    if beside := _beside_the_scene(view, main):
        reach = max(p.state.slant_range for p in beside)
        places = [_SCENE, *(place for p in beside for place in (p.at, *p.path))]
        places += _extent(view, _SCENE, view.radius if view.radius <= 2 * reach else 0.0)
    elif _SAME < separation * main.scale < _CLOSE and _pixels_apart(main, first, second) < _APART:
        reach = separation
        places = [first.at, second.at]
    else:
        return None
    east, north = ((min(values) + max(values)) / 2 for values in zip(*places, strict=True))
    middle = _SCENE if beside else (east, north)
    panel = _fitted(view, [*places, *_extent(view, middle, _SPREAD * reach)], top, _LOWER)
    is_still_one_spot = not beside and _pixels_apart(panel, first, second) < _APART
    return None if is_still_one_spot or panel.scale < _ENLARGED * main.scale else panel


def _symbols(view: _View, panels: Sequence[_Panel]) -> Iterator[str]:
    """Explanations of the symbols that are not written beside the symbols themselves."""
    if any(not p.is_still and not _is_end_on(p) for p in view.platforms):
        yield "Arrows at the platforms: direction of flight, not speed."
    if any(_shows_path(panel, p) for panel in panels for p in view.platforms):
        yield f"Broad line: path in the aperture of {format_quantity(view.found.aperture_time, 's')}."
    if any(_is_end_on(p) for p in view.platforms):
        yield "Circle with dot: flight towards the viewer; with cross: away."


def _extent(view: _View, centre: Place, reach: float) -> list[Place]:
    """Ends of what reaches so far from a point: all round from above, along the ground from the side."""
    x, y = centre
    ends = [(x - reach, y), (x + reach, y)]
    return [*ends, (x, y - reach), (x, y + reach)] if view.is_plan else ends


def _fitted(view: _View, places: Sequence[Place], top: float, part: float = 1.0) -> _Panel:
    """Panel at the largest scale that shows all places and leaves room for what is written beside them."""
    (lowest, highest), (side, above, below) = _PLAN if view.is_plan else _SIDE
    highest *= part
    xs, ys = zip(*places, strict=True)
    wide, tall = max(xs) - min(xs), max(ys) - min(ys)
    width = _WIDTH - _AXIS[0] - _EDGE
    scale = min(
        (width - 2 * side) / wide if wide else math.inf,
        (highest - above - below) / tall if tall else math.inf,
    )
    height = min(max(lowest, tall * scale + above + below), highest)
    slack = (height - tall * scale - above - below) / 2 if view.is_plan else 0.0
    # The middle of the frame is not that of the places where the margins differ; the ground stays down.
    low = min(ys) - (below + slack) / scale
    centre = ((max(xs) + min(xs)) / 2, low + height / 2 / scale)
    return _Panel(svg.Box(_AXIS[0], top, _AXIS[0] + width, top + height), centre, scale)


def _axes(canvas: svg.Canvas, panel: _Panel, view: _View) -> None:
    """Grid, ticks and names of the axes; the same step both ways, because both are to scale."""
    frame, scale = panel.frame, panel.scale
    step = svg.round_step(62 / scale)
    far = max(abs(panel.centre[0]), abs(panel.centre[1])) + (frame.right - frame.left) / scale
    unit, name = (1e3, "km") if far >= 2e3 else (1.0, "m")
    half = ((frame.right - frame.left) / 2 / scale, (frame.bottom - frame.top) / 2 / scale)
    for value in svg.ticks(panel.centre[0] - half[0], panel.centre[0] + half[0], step):
        x, _ = panel.pixel((value, 0.0))
        if frame.left + 1 < x < frame.right - 1:
            canvas.polyline(frame.upright(x), "grid", is_obstacle=False)
        shown = value if view.is_plan else abs(value)
        text = svg.axis_number(shown / unit)
        if x + svg.text_width(text) / 2 < _WIDTH:
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
    """Frame of an enlargement, with a bar for its scale."""
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
    """Lines first, then markers, then labels, which look for what space is left."""
    frame, scene = panel.frame, panel.pixel(_SCENE)
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
            canvas.polyline([panel.pixel(place) for place in platform.path], f"{platform.name} path", frame)
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
    """Labels, with their text and where they belong; things on one spot share a label."""
    frame, scene = panel.frame, panel.pixel(_SCENE)
    # From the side, what is written of a platform stays above the ground.
    above = frame if view.is_plan else frame._replace(bottom=min(frame.bottom, scene[1]))
    at_scene = [p for p in visible if has_scene and math.dist(panel.pixel(p.at), scene) < _APART]
    free = [p for p in visible if p not in at_scene]
    if len(free) == 2 and _pixels_apart(panel, *free) < _APART:
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
        if platform not in visible and (part := frame.clipped((scene, panel.pixel(platform.at)))):
            yield svg.DrawnLabel(part[1], (f"to {platform.name}, {_range(view, platform)}",), above)
    if not has_scene and visible and (part := frame.clipped((panel.pixel(visible[0].at), scene))):
        yield svg.DrawnLabel(part[1], ("to the scene",), frame)


def _range(view: _View, platform: _Platform) -> str:
    slant = format_quantity(platform.state.slant_range, "m")
    return slant if view.is_plan else f"{slant} at {_degrees(platform.state.elevation)}"


def _directions(canvas: svg.Canvas, panel: _Panel, view: _View) -> Iterator[svg.DrawnLabel]:
    """φ_b of (11), and across it the line along which errors smear, (31)."""
    scene, look = panel.pixel(_SCENE), view.found.geometry.look_azimuth
    tip = _turned(scene, _LOOK, look)
    ends = [_turned(scene, sign * _SMEAR, look + math.pi / 2) for sign in (-1, 1)]
    canvas.arrow(scene, tip)
    canvas.arrow(ends[0], ends[1], both_ends=True)
    yield svg.DrawnLabel(tip, (f"look φ_b {_degrees(look)}",), panel.frame)
    yield svg.DrawnLabel(max(ends, key=lambda end: end[1]), ("smear",), panel.frame)


def _turned(origin: svg.Point, length: float, azimuth: float) -> svg.Point:
    return (origin[0] + length * math.cos(azimuth), origin[1] - length * math.sin(azimuth))


def _arc(canvas: svg.Canvas, panel: _Panel, platform: _Platform, radius: float) -> None:
    """Elevation angle at the scene."""
    scene = panel.pixel(_SCENE)
    end = math.atan2(platform.at[1], platform.at[0])
    start = 0.0 if end <= math.pi / 2 else math.pi
    steps = [start + (end - start) * index / 16 for index in range(17)]
    canvas.polyline([_turned(scene, radius, angle) for angle in steps], f"{platform.name}", panel.frame)


def _velocity(canvas: svg.Canvas, panel: _Panel, platform: _Platform) -> None:
    if platform.is_still:
        return
    x, y = panel.pixel(platform.at)
    if _is_end_on(platform):
        side = 14 if platform.name == "transmitter" else -14  # of two on one spot both are seen
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
    tip = (x + _VELOCITY * platform.heading[0], y - _VELOCITY * platform.heading[1])
    canvas.arrow((x, y), tip, platform.name)


def _is_end_on(platform: _Platform) -> bool:
    return not platform.is_still and math.hypot(*platform.heading) < _SHORT


def _marker(canvas: svg.Canvas, at: svg.Point, platform: _Platform) -> None:
    """Triangle for the transmitter, square for the receiver; hollow if it does not move."""
    x, y = at
    style = f"marker {'hollow line' if platform.is_still else 'solid'} {platform.name}"
    if platform.name == "transmitter":
        canvas.polygon([(x, y - 7), (x + 6, y + 3.5), (x - 6, y + 3.5)], style)  # its centroid is the place
    else:
        canvas.polygon([(x - 5, y - 5), (x + 5, y - 5), (x + 5, y + 5), (x - 5, y + 5)], style)


def _pixels_apart(panel: _Panel, first: _Platform, second: _Platform) -> float:
    return math.dist(panel.pixel(first.at), panel.pixel(second.at))


def _shows_path(panel: _Panel, platform: _Platform) -> bool:
    length = math.fsum(math.dist(*pair) for pair in pairwise(platform.path))
    return panel.frame.holds(panel.pixel(platform.at)) and length * panel.scale >= _SEEN_PATH


def _degrees(angle: float) -> str:
    """Angle in degrees, to a hundredth."""
    return f"{svg.axis_number(round(math.degrees(angle), 2))}°"


def _times(factor: float) -> str:
    return f"{float(f'{factor:.2g}'):,.10g}"
