"""Passive radar, forward scatter and a circle: what a check says, an independent reference, and images.

The reference of `tests/image_point.py` forms images by direct sums and takes nothing from the package.
"""

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.image_point import Collection, circle, flight, no_error

MISSIONS = ROOT / "specs" / "missions"
STILL = (0.0, 0.0, 0.0)
SHARE_RAD = math.pi / 8
DVB_T = 602e6, 7.61e6, 60.0  # Hz, Hz, s
FORWARD = (
    "platforms.transmitter={position: [-18 km, 0, 420 m], velocity: [0, 0, 0],"
    " motion_error: {position: [1 m, 0, 0]}}",
    "platforms.receiver={position: [3 km, 200 m, 2 km], velocity: [5 m/s, 25 m/s, 0]}",
    "requirements={quadratic_phase_error: 45 deg}",
)


def television(velocity_mps: float) -> Collection:
    paths = flight((-18e3, 9e3, 420.0), STILL), flight((-2e3, -7e3, 2500.0), (-65.0, 8.0, 0.0))
    return Collection(*DVB_T, paths, (no_error, flight(STILL, (0.0, velocity_mps, 0.0))))


def forward_scatter(error_m: float) -> Collection:
    paths = flight((-18e3, 0.0, 420.0), STILL), flight((3e3, 200.0, 2000.0), (5.0, 25.0, 0.0))
    return Collection(*DVB_T, paths, (flight((error_m, 0.0, 0.0), STILL), no_error))


def circling(aperture_s: float) -> Collection:
    paths = flight((600.0, 500.0, 60.0), STILL), circle(1000.0, 500.0, 0.025, 0.0)
    return Collection(435e6, 100e6, aperture_s, paths, (no_error, flight((0.1, 0.0, 0.0), STILL)))


@dataclass(frozen=True)
class Case:
    """A mission of the gallery with changes; what a row of a check says; the limit of the row that images confirm."""

    mission: str
    changes: tuple[str, ...]
    status: str
    row: str
    row_status: str
    collection: Collection
    imaged: str

    def reached(self) -> float:
        """Value of the row by the reference: a phase of equal loss [rad], or a displacement [m]."""
        response = self.collection.least_variance_point()
        return float(np.hypot(*response.point)) if "location" in self.row else response.equal_loss_rad


CASES = {
    "DVB-T with 5 cm/s": Case(
        "dvbt_aircraft", (), "fail", "receiver.quadratic_phase_error", "fail", television(0.05), "receiver.velocity.y"
    ),
    "DVB-T with 1 cm/s": Case(
        "dvbt_aircraft",
        ("platforms.receiver.motion_error.velocity=[0, 1 cm/s, 0]",),
        "pass",
        "receiver.quadratic_phase_error",
        "pass",
        television(0.01),
        "receiver.velocity.y",
    ),
    "forward scatter with 1 m": Case(
        "dvbt_aircraft",
        FORWARD,
        "pass",
        "transmitter.quadratic_phase_error",
        "pass",
        forward_scatter(1.0),
        "transmitter.position.x",
    ),
    "6 cm on a circle": Case(
        "circling_drone", (), "fail", "mission.location_error", "fail", circling(100.0), "mission.location_error"
    ),
}


def asked(run, command: str, case: Case, *more: str) -> tuple[int, dict]:
    """Exit code and JSON of a command on the mission of a case."""
    changes = [part for change in case.changes for part in ("--set", change)]
    result = run(command, MISSIONS / f"{case.mission}.yaml", *changes, *more, "--format", "json")
    return result.exit_code, json.loads(result.stdout)["missions"][0]


@pytest.mark.parametrize("name", CASES)
def test_a_check_says_what_the_image_does(run, name: str) -> None:
    """Status, and use of the limit within 0.1 % of the reference."""
    case = CASES[name]
    exit_code, mission = asked(run, "check", case)
    assert mission["status"] == case.status
    assert exit_code == (case.status == "fail")
    (row,) = (row for row in mission["rows"] if row["id"] == case.row)
    assert row["status"] == case.row_status
    allowed = 0.06 if "location" in case.row else SHARE_RAD
    assert row["utilization"] == pytest.approx(case.reached() / allowed, rel=1e-3)


def test_uses_that_the_gallery_prints(run) -> None:
    """244 % and 49 % of DVB-T, 39 % of forward scatter, 89 mm of 6 cm: from images by direct sums."""
    use = {}
    for name, case in CASES.items():
        rows = asked(run, "check", case)[1]["rows"]
        use[name] = next(row["utilization"] for row in rows if row["id"] == case.row)
    assert list(use.values()) == pytest.approx([2.44, 0.487, 0.39, 0.089 / 0.06], rel=3e-3)


@pytest.mark.parametrize("name", [name for name in CASES if "1 cm/s" not in name])
def test_verify_confirms_the_limit(run, name: str) -> None:
    """An image at the limit of the row that decides. With 1 cm/s the limit is that of 5 cm/s."""
    case = CASES[name]
    exit_code, mission = asked(run, "verify", case, "--only", case.imaged)
    assert exit_code == 0
    (row,) = mission["rows"]
    assert row["id"] == case.imaged
    assert row["verdict"] == "confirmed"
