"""How the Earth is turned below the stars, as a mission file states it: in figures or by a table of the IERS."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from bisar_budget import units
from bisar_budget.faults import Problem
from bisar_budget.mission.readers import Key, Quantity, Reference, Section
from bisar_budget.paths.orientation import FARTHEST_POLE, FARTHEST_UT1, UNKNOWN, Orientation

_ACCEPTED = "accepted: ut1_minus_utc, with or without polar_motion_x and polar_motion_y; or file"
_POLE = Quantity(units.ANGLE, ge=-FARTHEST_POLE, le=FARTHEST_POLE)


class EarthOrientation(NamedTuple):
    """UT1 - UTC and polar motion in the middle of the aperture; orbits in axes of the stars need them."""

    ut1_minus_utc: Annotated[
        float | None, Key(Quantity(units.TIME, ge=-FARTHEST_UT1, le=FARTHEST_UT1), "IERS, Bulletin A or B.")
    ] = None
    polar_motion_x: Annotated[float | None, Key(_POLE, "Of the pole, towards Greenwich.")] = None
    polar_motion_y: Annotated[float | None, Key(_POLE, "Of the pole, towards 90 deg west.")] = None
    file: Annotated[str | None, Key(Reference(), "Table of the IERS instead: finals2000A, daily or all.")] = None

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold it to figures that go together, or to a table."""
        figures = [key for key in values if key != "file" and values[key] is not None]
        if values.get("file") is not None:
            if figures:
                yield Problem(f"mixes file with {figures[0]}", _ACCEPTED, at=(figures[0],))
        elif "ut1_minus_utc" not in figures:
            yield Problem("lacks ut1_minus_utc", _ACCEPTED)
        elif len(figures) == 2:
            yield Problem("has half of the polar motion", _ACCEPTED, at=(figures[1],))

    @property
    def orientation(self) -> Orientation:
        """What the figures say; where the pole is not stated, its doubt stays."""
        x, y = self.polar_motion_x, self.polar_motion_y
        has_pole = x is not None and y is not None
        return Orientation(
            self.ut1_minus_utc or 0.0,
            (x, y) if x is not None and y is not None else UNKNOWN.pole,
            0.0,
            0.0 if has_pole else UNKNOWN.pole_doubt,
        )


EARTH_ORIENTATION = Section(EarthOrientation)
