"""Comparisons with outside values: each is asserted, and kept for the page that shows them."""

import math
from typing import NamedTuple


class Compared(NamedTuple):
    """One outside value beside the package's own; `source` is who says it, `version` of which release or edition.

    `tolerance` is the largest difference taken for agreement, in `unit`. `reason` says why the two disagree; it is
    empty where they agree.
    """

    what: str
    there: float
    here: float
    unit: str
    tolerance: float
    source: str
    version: str
    reason: str


rows: list[Compared] = []  # of this test run, since the last test file wrote its own


def compare(
    what: str,
    there: float,
    here: float,
    unit: str,
    tolerance: float,
    source: str,
    version: str = "",
    reason: str = "",
) -> None:
    """Keep an outside value beside the package's own, and assert that they agree within `tolerance`.

    A known disagreement states its `reason`. It has to be one: where the two come to agree, the test fails, so that
    the reason does not stand longer than the disagreement.
    """
    there, here = float(there), float(here)
    rows.append(Compared(what, there, here, unit, tolerance, source, version, reason))
    assert all(map(math.isfinite, (there, here))), f"{what}: {there} there, {here} here"
    agree = abs(here - there) <= tolerance
    said = f"{what}: {there:.9g} {unit} there ({source}), {here:.9g} here, tolerance {tolerance:.3g}"
    if reason:
        assert not agree, f"{said}: they agree, but the test says why they do not: {reason}"
    else:
        assert agree, said
