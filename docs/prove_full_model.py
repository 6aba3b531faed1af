"""Write the proof of the full model into docs/full-model.md: against exact ranges, and against images at squints.

    python docs/prove_full_model.py

No Taylor series is in what the model is held against: ranges are exact, images are formed from them.
"""

import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bisar_budget.budget.validity import FLOOR_M, FLOOR_RAD, SHARE, FirstOrder

from bisar_budget.budget.effects import full_ground
from bisar_budget.errors import MissionError
from bisar_budget.geometry import norm
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.simulate.verify import Study, verify_mission

PAGE = Path(__file__).with_name("full-model.md")
COUNT, SEED = 500, 11


def mission_of(transmitter: str, receiver: str, aperture_time: float) -> Mission:
    """X-band, gated by the full model."""
    return parse_mission(
        f"""schema_version: 1
name: proof
radar: {{ center_frequency: 10 GHz, bandwidth: 300 MHz }}
collection: {{ aperture_time: {aperture_time} }}
platforms:
  transmitter: {transmitter}
  receiver: {receiver}
allocation: {{ model: full }}
"""
    )


def random_collections(count: int, longest: float = 4.0, climb_ratio: float = 0.1) -> Iterator[Mission]:
    """X-band, 4 s or up to `longest`, 4 to 60 km, any azimuth, squints to 60°, gradients 10° apart or more."""
    rng = np.random.default_rng(SEED)
    while count:
        aperture_time = 4.0 if longest == 4 else rng.uniform(4, longest)
        platforms = []
        for _ in range(2):
            azimuth, speed = rng.uniform(0, 2 * math.pi), rng.uniform(30, 250)
            motion = azimuth + rng.choice([-1, 1]) * math.pi / 2 + rng.uniform(-1, 1) * math.pi / 3
            slant_range = 10 ** rng.uniform(math.log10(4e3), math.log10(6e4))
            elevation, climb = (
                rng.uniform(math.radians(5), math.radians(60)),
                rng.uniform(-climb_ratio, climb_ratio) * speed,
            )
            platforms.append(
                f"{{ slant_range: {slant_range:.6f}, azimuth: {azimuth:.9f}, elevation: {elevation:.9f}, "
                f"speed: {speed:.6f}, motion_azimuth: {motion:.9f}, climb: {climb:.6f} }}"
            )
        try:
            mission = mission_of(*platforms, aperture_time=aperture_time)
        except MissionError:  # degenerate, or it dives
            continue
        if math.degrees(mission.geometry.gradient_angle) >= 10:
            count -= 1
            yield mission


def against_exact_ranges() -> Iterator[str]:
    """Every error at its full limit, or where it moves the image by 10 m."""
    phase, shift, outside, worst = [], [], 0, (0.0, "")
    for number, mission in enumerate(random_collections(COUNT)):
        study, geometry = Study(mission), mission.geometry
        ground = full_ground(mission, geometry)
        first_order = FirstOrder(mission, geometry, ground)
        turn = max(norm(p.look_rate) * 2 for p in (geometry.transmitter, geometry.receiver))
        for source in study.sources:
            per_unit = ground.plane.displacement(source.full, 1.0) or (0.0, 0.0)
            moves = math.hypot(*per_unit)
            sizes = [math.pi / 8 / abs(source.full.qpe)] if source.full.qpe else []
            size = min([*sizes, *([9.9 / moves] if moves else [])], default=0.0)
            if not size:
                continue
            first, second = source.full.qpe * size, first_order.second.effect(source, size)
            is_outside = (
                turn > 0.3
                or math.sin(geometry.gradient_angle) < 0.2
                or abs(second.qpe) > max(FLOOR_RAD, SHARE * abs(first))
                or math.hypot(*(ground.plane.displacement(second, 1.0) or (0.0, 0.0)))
                > max(FLOOR_M, SHARE * moves * size)
            )
            if is_outside:
                outside += 1
                continue
            effect = study.collection.effect(study.errors(source, size))
            phase.append(abs(effect.quadratic - first))
            shift.append(math.dist(effect.displacement, [size * part for part in per_unit]))
            worst = max(worst, (phase[-1], f"`{source.id}` of collection {number}"))
    middle, high, top = np.percentile(phase, [50, 95, 100])
    yield f"{COUNT} collections, {len(phase)} errors inside first order, {outside} outside."
    yield ""
    yield "| difference to exact ranges | median | 95 % | largest |"
    yield "| --- | --- | --- | --- |"
    yield f"| quadratic phase [rad] | {middle:.5f} | {high:.4f} | {top:.4f} |"
    middle, high, top = np.percentile(shift, [50, 95, 100])
    yield f"| displacement [m] | {middle:.4f} | {high:.3f} | {top:.2f} |"
    yield ""
    yield f"The largest difference of phase is that of {worst[1]}."


def over_long_apertures() -> Iterator[str]:
    """Quadratic phase of errors far inside first order, with and without the quartic term, by how far u turns."""
    found: dict[int, list[tuple[float, float]]] = {}
    for mission in random_collections(COUNT, longest=40, climb_ratio=0.02):
        study, geometry, T = Study(mission), mission.geometry, mission.collection.aperture_time
        if math.sin(geometry.gradient_angle) < 0.35:
            continue
        half = mission._replace(collection=mission.collection._replace(aperture_time=T / 2))
        halved = {source.id: source.full.qpe for source in Study(half).sources}
        first_order = FirstOrder(mission, geometry, study.ground)
        turn = max(norm(p.look_rate) * T / 2 for p in (geometry.transmitter, geometry.receiver))
        for source in study.sources:
            moves = math.hypot(*(study.ground.plane.displacement(source.full, 1.0) or (0.0, 0.0)))
            size = min(
                math.pi / 8 / abs(source.full.qpe) if source.full.qpe else 0.0, 3 / moves if moves else math.inf
            )
            full = source.full.qpe * size
            if abs(full) < 0.1 or abs(first_order.second.effect(source, size).qpe) > 0.002:
                continue
            exact = study.collection.effect(study.errors(source, size)).quadratic
            # a·T² + b·T⁴ at T and at T/2 gives a·T².
            alone = (16 * halved[source.id] - source.full.qpe) / 3 * size
            found.setdefault(min(int(turn / 0.05), 8), []).append((abs(alone / exact - 1), abs(full / exact - 1)))
    yield "| turn [rad] | errors | quadratic alone: median | 95 % | with the quartic: median | 95 % |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for index, pairs in sorted(found.items()):
        alone, full = np.percentile(np.array(pairs), [50, 95], axis=0).T * 100
        turns = f"{index * 0.05:.2f} to {index * 0.05 + 0.05:.2f}" if index < 8 else "over 0.40"
        yield f"| {turns} | {len(pairs)} | {alone[0]:.2g} % | {alone[1]:.2g} % | {full[0]:.2g} % | {full[1]:.2g} % |"


def against_images() -> Iterator[str]:
    """Section V at 10 GHz, both platforms turned by a squint, each error at its full limit of π/8."""
    yield "| squint | error | limit | Table II says | full model | exact ranges | image |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for squint in (0, 15, 30, 45, 60):
        turned = math.radians(squint)
        platforms = [
            f"{{ slant_range: {slant_range}, azimuth: {azimuth}, elevation: {math.asin(height / slant_range)}, "
            f"speed: {speed}, motion_azimuth: {azimuth + math.pi / 2 + turned} }}"
            for slant_range, height, azimuth, speed in ((31e3, 6e3, 0.0, 150), (8.5e3, 2e3, math.pi / 4, 60))
        ]
        mission = mission_of(*platforms, aperture_time=6)
        published = {source.id: abs(source.effect.qpe) for source in Study(mission).sources}
        for row in (*verify_mission(mission, "*.velocity.*").rows, *verify_mission(mission, "*.acceleration.*").rows):
            cells = [row.full_qpe_rad, row.predicted_qpe_rad, row.measured_qpe_rad]
            shown = ["beyond first order" if cell is None else f"{cell:.3f}" for cell in cells]
            table_2 = f"{published[row.id] * row.boundary_error:.3f}"
            limit = f"{row.boundary_error:.3g} {row.unit.replace('^2', '²')}"
            yield f"| {squint}° | `{row.id}` | {limit} | {table_2} | {' | '.join(shown)} |"


def main() -> None:
    """Replace what stands between the page's marks."""
    text = PAGE.read_text(encoding="utf-8")
    blocks = (
        ("exact ranges", against_exact_ranges()),
        ("long apertures", over_long_apertures()),
        ("images", against_images()),
    )
    for name, lines in blocks:
        block = "\n".join(lines)
        pattern = rf"(<!-- {name} -->\n).*?(\n<!-- end -->)"
        text, found = re.subn(pattern, lambda match, block=block: match[1] + block + match[2], text, flags=re.DOTALL)
        if found != 1:
            sys.exit(f"{PAGE.name} has no place for {name}")
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
