"""A script as a user of the package writes it, with types: mypy checks it in strict mode, and a test runs it."""

import sys
from datetime import date

import numpy as np

import bisar_budget as bb

TIME = "collection.aperture_time"


def worst(result: bb.CheckResult) -> str:
    """Name of the row that uses most of its limit."""
    used = {row_id: row.utilization or 0.0 for row_id, row in result.items()}
    return max(used, key=used.__getitem__)


def report(path: str) -> str:
    """Words of a script about a mission."""
    try:
        mission: bb.Mission = bb.load(path)
    except bb.MissionError as error:
        return "; ".join(f"{fault.line}: {fault.key}" for fault in error.faults)
    result = bb.check(mission, model="full", date=date(2026, 7, 1))
    longer = bb.check(mission.replace({TIME: "8 s"})).status
    table = bb.sweep(mission, {TIME: bb.linspace("1 s", "5 s", 5), "radar.bandwidth": np.array([1e8, 3e8])})
    ratio = bb.sweep(mission, {TIME: bb.geomspace(1.0, 5.0, 3)}).summary
    solved = bb.solve(mission, TIME, between=("0.2 s", "20 s"))
    ranked = bb.sensitivity(mission)
    drawn = bb.monte_carlo(mission, 1000, seed=1)
    try:
        sheet: bb.AllocateResult | None = bb.allocate(mission)
    except bb.QuestionError:
        sheet = None
    images = bb.verify(mission, "receiver.velocity.y")
    point = bb.simulate(mission)
    return "\n".join(
        [
            f"{result.status} {result.exit_code} {worst(result)} {longer} {result['receiver.velocity.y'].allowable}",
            f"{table.summary} {ratio} {solved!r} {ranked!r} {drawn!r} {sheet!r} {images!r} {point.image.shape}",
        ]
    )


if __name__ == "__main__":
    print(report(sys.argv[1]))
