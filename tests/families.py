"""Random missions of six families, as the text of mission files that the loader accepts.

    text = mission_text("drones", 17)           # the same text each time, on every machine
    for text in mission_texts("jets", 100):     # of the seeds 0 to 99
    python -m tests.families drones 17          # prints it, to reproduce a case

A mission is drawn from `random.Random` by family and seed, so that one seed names it without NumPy. What the loader
refuses, or what turns a line of sight by more than 0.5 rad in half an aperture, is drawn again. Every mission has:
squints to 60°, straight or curved paths, declared motion errors in one of the three frames, with signs. Sizes are
log-uniform, from harmless to some five times what a Taylor term allows, and below what no navigation would have.
Many have a clock, common, terrain or other error, a scene's radius, requirements for cubic phase and
location, autofocus, a coverage factor and every rule of combination. Most are gated by the full model.
Vibration and covariances are left out: they have tests of their own.
"""

import math
import sys
from collections.abc import Iterator
from random import Random
from typing import NamedTuple

from bisar_budget.faults import MissionError
from bisar_budget.geometry import PlatformState, Vector, cross, dot, norm, unit
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission

LARGEST_TURN = 0.5  # rad, of a line of sight from mid-aperture to its ends

_EARTH_RADIUS = 6.371e6  # m, mean
_EARTH_GM = 3.986004418e14  # m³/s², WGS 84
_SPEED_OF_LIGHT = 299_792_458.0  # m/s


class _Flight(NamedTuple):
    """Ranges that a platform is drawn from; lengths [m], speeds [m/s], acceleration [m/s²]."""

    slant_range: tuple[float, float]
    elevation_deg: tuple[float, float]
    speed: tuple[float, float]
    climb: float = 0.0  # largest, of the speed
    acceleration: float = 0.0  # largest across the path
    largest_errors: tuple[float, float, float] = (30.0, 3.0, 0.5)  # position, velocity, acceleration
    orbit_height: tuple[float, float] | None = None  # instead of a slant range: a circular orbit


class _Family(NamedTuple):
    """Carrier frequencies [Hz], apertures [s] and the two platforms."""

    frequency: tuple[float, float]
    aperture_time: tuple[float, float]
    transmitter: _Flight
    receiver: _Flight


_DRONE = _Flight((100, 900), (8, 60), (3, 20), 0.2, 2.0, (3.0, 1.0, 0.3))
_AIRCRAFT = _Flight((4e3, 60e3), (5, 50), (40, 150), 0.1, 3.0)
_JET = _Flight((15e3, 150e3), (4, 35), (150, 300), 0.1, 20.0, (100.0, 5.0, 1.0))
_LOW_ORBIT = _Flight((0, 0), (20, 70), (0, 0), 0.0, 1.0, (3e3, 5.0, 0.1), (500e3, 800e3))
_NEAR_AIRCRAFT = _Flight((3e3, 30e3), (8, 60), (40, 200), 0.1, 3.0)
_FIXED = _Flight((300, 5e3), (2, 30), (0, 0), 0.0, 0.0, (1.0, 0.05, 0.01))
_GEOSTATIONARY = _Flight((36e6, 39e6), (15, 60), (0.1, 5), 0.3, 2e-4, (3e3, 0.5, 1e-3))
_NEAR_DRONE = _Flight((200, 2e3), (10, 60), (5, 25), 0.2, 2.0, (3.0, 1.0, 0.3))

_FAMILIES = {
    "drones": _Family((1.3e9, 24e9), (1, 10), _DRONE, _DRONE),
    "aircraft": _Family((0.4e9, 17e9), (0.5, 20), _AIRCRAFT, _AIRCRAFT),
    "jets": _Family((1.2e9, 17e9), (0.5, 12), _JET, _JET),
    "satellite_aircraft": _Family((1.2e9, 10e9), (0.3, 8), _LOW_ORBIT, _NEAR_AIRCRAFT),
    "satellite_fixed": _Family((1.2e9, 10e9), (0.3, 5), _LOW_ORBIT, _FIXED),
    "geostationary_drone": _Family((1.5e9, 14e9), (1, 10), _GEOSTATIONARY, _NEAR_DRONE),
}
FAMILIES = tuple(_FAMILIES)

# To be put behind the text of a mission: its receiver hears the transmitter.
DIRECT_PATH = "synchronization: { method: direct_path, error: 1 deg }\n"


def mission_text(family: str, seed: int) -> str:
    """Text of a mission file of a family, always the same for a seed; the loader accepts it.

    Parameters
    ----------
    family : str
        One of `FAMILIES`.
    seed : int
        Any number; it names the mission within its family.
    """
    random = Random(f"{family}/{seed}")
    while True:
        text = _drawn(_FAMILIES[family], f"{family} {seed}", random)
        try:
            mission = parse_mission(text)
        except MissionError:
            continue
        if largest_turn(mission) <= LARGEST_TURN:
            return text


def mission_texts(family: str, count: int, first: int = 0) -> Iterator[str]:
    """Yield the texts of the seeds `first`, `first` + 1 …"""
    for seed in range(first, first + count):
        yield mission_text(family, seed)


def largest_turn(mission: Mission) -> float:
    """Largest angle by which a line of sight turns between mid-aperture and one of its ends. [rad]"""
    half = mission.collection.aperture_time / 2
    geometry = mission.geometry
    return max(
        math.atan2(norm(cross(state.position, end)), dot(state.position, end))
        for state in (geometry.transmitter, geometry.receiver)
        for end in (state.at(-half)[0], state.at(half)[0])
    )


def _drawn(family: _Family, name: str, random: Random) -> str:
    """Text of one attempt, accepted or not."""
    frequency = _log_uniform(random, *family.frequency)
    bandwidth = min(_log_uniform(random, 15e6, 800e6), frequency / 4)
    total = math.pi / 4 if random.random() < 0.6 else math.radians(random.uniform(20, 180))
    factor = 1.0 if random.random() < 0.6 else random.choice((2.0, 3.0))
    states = [_flying(family.transmitter, random), _flying(family.receiver, random)]
    shortest, longest = family.aperture_time
    aperture_time = _log_uniform(random, shortest, longest)
    if random.random() < 0.5:  # else large turns were rare
        turn = _log_uniform(random, 0.03, LARGEST_TURN)
        aperture_time = min(longest, max(shortest, 2 * turn / max(norm(state.look_rate) for state in states)))
    share = total / 2 / (2 * math.pi * frequency / _SPEED_OF_LIGHT)  # of one platform, as a way [m]
    nearest = min(state.slant_range for state in states)
    turning = max(norm(state.look_rate) for state in states)

    lines = [
        "schema_version: 1",
        f"name: {name}",
        f"radar: {{ center_frequency: {frequency:.6g}, bandwidth: {bandwidth:.4g} }}",
        f"collection: {{ aperture_time: {aperture_time:.5g} }}",
    ]
    scene = []
    if random.random() < 0.3:
        scene.append(f"radius: {nearest * _log_uniform(random, 0.005, 0.2):.4g}")
    if random.random() < 0.3:
        scene.append(f"height_error: {_signed(random, min(_log_uniform(random, 0.1, 50), 0.03 * nearest)):.4g}")
    if scene:
        lines.append(f"scene: {{ {', '.join(scene)} }}")
    lines.append("platforms:")
    for key, flight, state in zip(("transmitter", "receiver"), family[2:], states, strict=True):
        lines += [f"  {key}:", *(f"    {line}" for line in _geometry_lines(state, random))]
        if random.random() < 0.9:
            frame = random.choice(("scene", "track", "look")) if norm(state.velocity) else "scene"
            error = _error(flight, state, share / factor, factor, turning, aperture_time, random)
            if error:
                lines.append(f"    motion_error: {{ frame: {frame}, {', '.join(error)} }}")
    if random.random() < 0.25:
        nearer = min(zip(states, family[2:], strict=True), key=lambda pair: pair[0].slant_range)
        error = _error(nearer[1], nearer[0], share / factor, factor, turning, aperture_time, random)
        if error:
            lines.append(f"common_motion_error: {{ {', '.join(error)} }}")
    if random.random() < 0.5:
        clock = _clock(frequency, aperture_time, nearest, total / 2 / factor, random)
        if clock:
            lines.append(f"timing_error: {{ {', '.join(clock)} }}")
    if random.random() < 0.1:
        lines.append(
            f"other_errors: [{{ name: troposphere, quadratic_phase_error: {random.uniform(1, 30):.3g} deg }}]"
        )
    requirements = [f"quadratic_phase_error: {total:.6g} rad"]
    if random.random() < 0.5:
        requirements.append(f"cubic_phase_error: {random.uniform(5, 90):.3g} deg")
    if random.random() < 0.5:
        requirements.append(f"location_error: {_log_uniform(random, 0.3, 30):.3g}")
    lines.append(f"requirements: {{ {', '.join(requirements)} }}")
    lines.append(
        f"allocation: {{ model: {_pick(random, full=8, published=1, strictest=1)}, "
        f"combine: {_pick(random, each=4, sum=3, rss=3)}, coverage_factor: {factor:g}, split: {_split(random)} }}"
    )
    if random.random() < 0.3:
        lines.append(f"autofocus: {{ n_pull: {_log_uniform(random, 0.5, 8):.3g} }}")
    return "\n".join(lines) + "\n"


def _flying(flight: _Flight, random: Random) -> PlatformState:
    """Any azimuth, squints to 60° either way; half of what can curve does."""
    azimuth, elevation = random.uniform(-math.pi, math.pi), math.radians(random.uniform(*flight.elevation_deg))
    heading = azimuth + random.choice((-1, 1)) * math.pi / 2 + random.uniform(-1, 1) * math.pi / 3
    over_ground = (math.cos(heading), math.sin(heading), 0.0)
    acceleration = (0.0, 0.0, 0.0)
    if flight.orbit_height is None:
        slant_range, speed = _log_uniform(random, *flight.slant_range), random.uniform(*flight.speed)
        climb = random.uniform(-1, 1) * flight.climb * speed
        position = _from_angles(slant_range, azimuth, elevation)
        velocity = (speed * over_ground[0], speed * over_ground[1], climb)
        if speed and random.random() < 0.5:
            across = random.uniform(-1, 1) * flight.acceleration
            along, up = random.uniform(-0.2, 0.2) * across, random.uniform(-0.2, 0.2) * across
            c, s = over_ground[:2]
            acceleration = (along * c - across * s, along * s + across * c, up)
    else:  # a circular orbit about the Earth's centre, below the scene; seen from the turning Earth
        height, up = random.uniform(*flight.orbit_height), _EARTH_RADIUS * math.sin(elevation)
        slant_range = math.sqrt(up**2 + 2 * _EARTH_RADIUS * height + height**2) - up
        position = _from_angles(slant_range, azimuth, elevation)
        radial = unit((position[0], position[1], position[2] + _EARTH_RADIUS))
        radius = _EARTH_RADIUS + height
        outward = dot(over_ground, radial)
        x, y, z = unit(
            (over_ground[0] - outward * radial[0], over_ground[1] - outward * radial[1], -outward * radial[2])
        )
        speed = math.sqrt(_EARTH_GM / radius) + random.uniform(-400, 400)
        velocity = (speed * x, speed * y, speed * z)
        fall = _EARTH_GM / radius**2
        acceleration = (
            -fall * radial[0] + random.uniform(-1, 1) * flight.acceleration,
            -fall * radial[1] + random.uniform(-1, 1) * flight.acceleration,
            -fall * radial[2] + random.uniform(-1, 1) * flight.acceleration,
        )
    return PlatformState(position=position, velocity=velocity, acceleration=acceleration)


def _from_angles(slant_range: float, azimuth: float, elevation: float) -> Vector:
    return (
        slant_range * math.cos(azimuth) * math.cos(elevation),
        slant_range * math.sin(azimuth) * math.cos(elevation),
        slant_range * math.sin(elevation),
    )


def _geometry_lines(state: PlatformState, random: Random) -> Iterator[str]:
    """The state in one of the two ways that a file can say it."""
    (vx, vy, vz), speed = state.velocity, math.hypot(*state.velocity[:2])
    if random.random() < 0.5 or not speed:
        yield f"position: {_vector(state.position, 9)}"
        yield f"velocity: {_vector(state.velocity, 7)}"
    else:
        yield f"slant_range: {state.slant_range:.9g}"
        yield f"azimuth: {state.azimuth:.9f} rad"
        yield f"elevation: {state.elevation:.9f} rad"
        yield f"speed: {speed:.7g}"
        yield f"motion_azimuth: {math.atan2(vy, vx):.9f} rad"
        yield f"climb: {vz:.7g}"
    if norm(state.acceleration):
        yield f"acceleration: {_vector(state.acceleration, 6)}"


def _error(
    flight: _Flight,
    state: PlatformState,
    share: float,
    factor: float,
    turning: float,
    aperture_time: float,
    random: Random,
) -> list[str]:
    """Declared errors about what a Taylor term allows; each kind may be missing, or be one number for all axes.

    The faster of both lines of sight counts: it bends what the other platform's error displaces.
    """
    half = aperture_time / 2
    allowed = (share / (turning * half) ** 2, share / (turning * half**2), 2 * share / half**2)
    found = []
    kinds = zip(
        ("position", "velocity", "acceleration"), allowed, flight.largest_errors, (1, half, half**2 / 2), strict=True
    )
    for kind, size, largest, edge in kinds:
        largest = min(largest, 0.03 * state.slant_range / edge / factor)
        if random.random() < 0.2:
            continue
        sizes = [_signed(random, min(size * _log_uniform(random, 0.003, 5), largest)) for _ in range(3)]
        if random.random() < 0.3:
            found.append(f"{kind}: {abs(sizes[0]):.4g}")
        else:
            found.append(f"{kind}: {_vector(sizes, 4)}")
    if found and random.random() < 0.4:
        found.append(f"distribution: {random.choice(('uniform', 'bound'))}")
    return found


def _clock(frequency: float, aperture_time: float, nearest: float, share: float, random: Random) -> list[str]:
    """Clock errors about what they may do: a ground shift by the first two, a phase by the others."""
    half = aperture_time / 2
    way = 0.01 * nearest / _SPEED_OF_LIGHT
    phase = share / (2 * math.pi * frequency)
    allowed = {
        "constant": min(way, 1e-7),
        "linear": min(way / half, 3e-9),
        "quadratic": min(phase / half**2, way / half**2),
        "cubic": min(phase / half**3, way / half**3),
    }
    return [
        f"{term}: {_signed(random, size * _log_uniform(random, 0.01, 3)):.4g}"
        for term, size in allowed.items()
        if random.random() < 0.6
    ]


def _split(random: Random) -> str:
    """Equal, shares or balanced."""
    kind = _pick(random, equal=7, shares=2, balanced=1)
    if kind != "shares":
        return kind
    transmitter = random.choice((0.2, 0.3, 0.4))
    if random.random() < 0.5:
        return f"{{ transmitter: {transmitter}, receiver: {1 - transmitter:.1f} }}"
    return f"{{ transmitter: {transmitter}, receiver: {0.8 - transmitter:.1f}, clock: 0.1, reserve: 0.1 }}"


def _pick(random: Random, **weights: int) -> str:
    return random.choices(list(weights), list(weights.values()))[0]


def _log_uniform(random: Random, low: float, high: float) -> float:
    return math.exp(random.uniform(math.log(low), math.log(high)))


def _signed(random: Random, size: float) -> float:
    return random.choice((-1, 1)) * size


def _vector(values: Vector | list[float], digits: int) -> str:
    return f"[{', '.join(f'{value + 0.0:.{digits}g}' for value in values)}]"


if __name__ == "__main__":
    print(mission_text(sys.argv[1], int(sys.argv[2])), end="")
