"""Curves of a mission file: points of a mask, of an Allan deviation or of a spectrum."""

from typing import Any

from bisar_budget.faults import InvalidValueError, KeyPath, Problem
from bisar_budget.mission.readers import INVALID, Quantity, Reader, Report

Points = tuple[tuple[float, float], ...]


class SortedPoints(tuple[tuple[float, float], ...]):
    """Points of a curve in rising order, which the file has in another: the rows that rest on them say so."""


class CurveReader(Reader):
    """A mapping of abscissas to ordinates, read in rising order: `SortedPoints` if the file has another."""

    def __init__(self, abscissa: Quantity, ordinate: Quantity, what: str, fewest: int, most: int = 100) -> None:
        self.abscissa, self.ordinate, self.what, self.fewest, self.most = abscissa, ordinate, what, fewest, most

    def read(self, value: Any, path: KeyPath, report: Report) -> Any:
        """Read each point at its own place."""
        if not isinstance(value, dict) or not self.fewest <= len(value) <= self.most:
            given = f", {len(value)} given" if isinstance(value, dict) else ""
            report(path, Problem(f"must be {self.fewest} to {self.most} points{given}", f"accepted: {self.what}"))
            return INVALID
        points = {}
        is_valid = True
        for key, item in value.items():
            here = (*path, key)
            try:
                at = self.abscissa.leaf(key)
            except InvalidValueError as error:
                report(here, error.problem._replace(is_of_key=True))
                is_valid = False
                continue
            if at in points:
                report(here, Problem("is in the list twice"))
                is_valid = False
            points[at] = item if item is INVALID else self.ordinate.read(item, here, report)
        if INVALID in points.values() or not is_valid:
            return INVALID
        found = sorted(points.items())
        return tuple(found) if found == list(points.items()) else SortedPoints(found)

    def below(self, part: str) -> Reader | None:
        """Give the reader of an ordinate."""
        return self.ordinate

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        """Object of points."""
        return {
            "type": "object",
            "additionalProperties": self.ordinate.schema(definitions),
            "minProperties": self.fewest,
            "maxProperties": self.most,
        }
