"""Write the full model's limits beside images of them, at squints, into docs/full-model.md.

    python docs/prove_full_model.py

Images are formed from exact ranges. What exact ranges say of random missions: `prove_any_size.py`.
"""

import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.verifier.limits import verify_mission
from bisar_budget.verifier.study import Study

PAGE = Path(__file__).with_name("full-model.md")
SQUINTS = (0, 15, 30, 45, 60)  # degrees


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
allocation: {{ model: full, combine: each }}
"""
    )


def against_images() -> Iterator[str]:
    """Section V at 10 GHz, both platforms turned by a squint, each error at its full limit of π/8."""
    yield "| squint | error | limit | Table II says | full model | exact ranges | image |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for squint in SQUINTS:
        turned = math.radians(squint)
        platforms = [
            f"{{ slant_range: {slant_range}, azimuth: {azimuth} rad, "
            f"elevation: {math.asin(height / slant_range)} rad, speed: {speed}, "
            f"motion_azimuth: {azimuth + math.pi / 2 + turned} rad }}"
            for slant_range, height, azimuth, speed in ((31e3, 6e3, 0.0, 150), (8.5e3, 2e3, math.pi / 4, 60))
        ]
        mission = mission_of(*platforms, aperture_time=6)
        published = {source.id: abs(source.effect.qpe) for source in Study(mission).sources}
        for row in (*verify_mission(mission, "*.velocity.*").rows, *verify_mission(mission, "*.acceleration.*").rows):
            cells = [row.full_qpe_rad, row.predicted_qpe_rad, row.measured_qpe_rad]
            shown = ["none" if cell is None else f"{cell:.3f}" for cell in cells]
            table_2 = f"{published[row.id] * row.boundary_error:.3f}"
            limit = f"{row.boundary_error:.3g} {row.unit.replace('^2', '²')}"
            yield f"| {squint}° | `{row.id}` | {limit} | {table_2} | {' | '.join(shown)} |"


def main() -> None:
    """Replace what stands between the page's marks."""
    text = PAGE.read_text(encoding="utf-8")
    block = "\n".join(against_images())
    text, found = re.subn(
        r"(<!-- images -->\n).*?(\n<!-- end -->)", lambda match: match[1] + block + match[2], text, flags=re.DOTALL
    )
    if found != 1:
        sys.exit(f"{PAGE.name} has no place for the images")
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
