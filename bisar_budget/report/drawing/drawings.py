"""The collection drawn to scale, from above and from the side, as SVG.

What would coincide at the scale of the whole is enlarged in a panel of its own below: a receiver beside the scene of
a satellite, or two satellites flying together. The description of each drawing says its numbers in words.
"""

import math

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.geometry import BistaticGeometry, PlatformState, Vector, norm
from bisar_budget.report.drawing.collection_view import Place, SeenPlatform, View, degrees, draw
from bisar_budget.units import format_quantity

_PATH_STEPS = 32


def geometry_plan(findings: MissionFindings) -> str:
    """Draw the collection from above: platforms, velocities, lines of sight, φ_b of (11), smear of (31).

    Parameters
    ----------
    findings : MissionFindings
        Of one mission.

    Returns
    -------
    str
        An SVG document, to be inlined or to be a file of its own.
    """
    geometry, T = findings.geometry, findings.aperture_time
    platforms = tuple(
        SeenPlatform(
            name=name,
            state=state,
            at=state.position[:2],
            heading=_direction(state.velocity)[:2],
            toward=_direction(state.velocity)[2],
            path=tuple(position[:2] for position in _flown(state, T)),
        )
        for name, state in _named(geometry)
    )
    view = View(
        is_plan=True,
        axes=("east", "north"),
        platforms=(platforms[0], platforms[1]),
        radius=findings.scene_radius or 0.0,
        look_azimuth=geometry.look_azimuth,
        aperture_time=T,
        heights=(210.0, 400.0),
        margins=(74.0, 66.0, 66.0),
    )
    look, smear = geometry.look_azimuth, (geometry.look_azimuth + math.pi / 2) % math.pi
    description = (
        f"Plan view to scale, east to the right and north up, scene centre at the origin. "
        f"{' '.join(_in_words(name, state) for name, state in _named(geometry))} "
        f"The bistatic look direction is {degrees(look)} from east, counter-clockwise; motion errors smear the "
        f"image along the line at {degrees(smear)}, perpendicular to it.{_radius_in_words(findings)}"
    )
    title = f"Geometry from above: {findings.name}"
    return draw(view, key=f"plan {findings.file}", title=title, description=description)


def geometry_elevation(findings: MissionFindings) -> str:
    """Draw the collection from the side: heights, slant ranges, elevation angles.

    Each platform is drawn in the vertical plane through it and the scene centre, so that its slant range and
    elevation are true; planes more than 90° apart in azimuth go to opposite sides.

    Parameters
    ----------
    findings : MissionFindings
        Of one mission.

    Returns
    -------
    str
        An SVG document, to be inlined or to be a file of its own.
    """
    geometry, T = findings.geometry, findings.aperture_time
    turned = _planes_apart(geometry)
    sides = (1.0, -1.0 if _is_on_other_side(geometry, turned) else 1.0)
    platforms = tuple(
        _in_own_plane(name, state, side, geometry.look_azimuth, T)
        for (name, state), side in zip(_named(geometry), sides, strict=True)
    )
    view = View(
        is_plan=False,
        axes=("ground distance", "height"),
        platforms=(platforms[0], platforms[1]),
        radius=findings.scene_radius or 0.0,
        look_azimuth=geometry.look_azimuth,
        aperture_time=T,
        heights=(130.0, 360.0),
        margins=(82.0, 52.0, 34.0),
    )
    how = (
        "Each platform in the vertical plane through it and the scene centre: slant ranges and elevations are true. "
        f"{_planes_in_words(geometry, turned)}"
    )
    description = (
        "Elevation view to scale, height over ground distance from the scene centre. "
        f"{how} {' '.join(_side_in_words(name, state) for name, state in _named(geometry))}"
        f"{_radius_in_words(findings)}"
    )
    title = f"Geometry from the side: {findings.name}"
    return draw(view, key=f"elevation {findings.file}", title=title, description=description, notes=[how])


def _named(geometry: BistaticGeometry) -> tuple[tuple[str, PlatformState], tuple[str, PlatformState]]:
    return ("transmitter", geometry.transmitter), ("receiver", geometry.receiver)


def _flown(state: PlatformState, aperture_time: float) -> tuple[Vector, ...]:
    """Places along the aperture; both ends say all of a straight path."""
    steps = 1 if state.is_straight else _PATH_STEPS
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


def _planes_in_words(geometry: BistaticGeometry, turned: float) -> str:
    overhead = [name for name, state in _named(geometry) if _is_overhead(state)]
    if overhead:
        return f"The {overhead[0]} is overhead."
    return f"The planes are {degrees(turned)} apart in azimuth."


def _is_overhead(state: PlatformState) -> bool:
    return bool(math.hypot(*state.position[:2]) <= 1e-9 * state.slant_range)


def _in_own_plane(name: str, state: PlatformState, side: float, look_azimuth: float, T: float) -> SeenPlatform:
    azimuth = look_azimuth if _is_overhead(state) else state.azimuth  # overhead: any vertical plane holds it
    outward = (math.cos(azimuth), math.sin(azimuth))

    def seen(vector: Vector) -> Place:
        return (side * (vector[0] * outward[0] + vector[1] * outward[1]), vector[2])

    direction = _direction(state.velocity)
    return SeenPlatform(
        name=name,
        state=state,
        at=seen(state.position),
        heading=seen(direction),
        toward=side * (direction[0] * outward[1] - direction[1] * outward[0]),  # right × up points to the viewer
        path=tuple(seen(position) for position in _flown(state, T)),
    )


def _in_words(name: str, state: PlatformState) -> str:
    east, north = state.position[:2]
    if norm(state.velocity) == 0:
        motion = "it is fixed"
    elif math.hypot(*state.velocity[:2]) < 1e-6 * norm(state.velocity):
        motion = f"it moves vertically at {format_quantity(norm(state.velocity), 'm/s')}"
    else:
        azimuth = math.atan2(state.velocity[1], state.velocity[0])
        motion = f"it moves at {format_quantity(norm(state.velocity), 'm/s')} towards {degrees(azimuth)} from east"
    return (
        f"The {name} is {_compass(east, 'east', 'west')} and {_compass(north, 'north', 'south')} of the scene "
        f"centre, slant range {format_quantity(state.slant_range, 'm')}; {motion}."
    )


def _side_in_words(name: str, state: PlatformState) -> str:
    return (
        f"The {name} is {format_quantity(state.position[2], 'm')} high at a ground distance of "
        f"{format_quantity(math.hypot(*state.position[:2]), 'm')}: slant range "
        f"{format_quantity(state.slant_range, 'm')}, elevation {degrees(state.elevation)}."
    )


def _radius_in_words(findings: MissionFindings) -> str:
    radius = findings.scene_radius
    return f" The scene has a radius of {format_quantity(radius, 'm')}." if radius else ""


def _compass(value: float, positive: str, negative: str) -> str:
    return f"{format_quantity(abs(value), 'm')} {positive if value >= 0 else negative}"
