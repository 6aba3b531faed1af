"""Exported CPHD files, focused by an image former that shares no code with the package: NumPy over sarkit's reader.

`simulate -o FILE.cphd` records the effect of the errors on a point, and writes the measured positions beside it. From
the file alone the image former finds the position of the point, its phase over the aperture, and its response in an
image. The tests compare them with the results of `simulate` and `verify` for the same errors. The table has the
example that uses most of its tolerance. Its displacement there is the displacement here plus the distance of both
points.
"""

import math
import warnings
from collections import defaultdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

pytest.importorskip("sarkit.cphd")

import sarkit.verification as skver
import yaml

import bisar_budget as bb
from bisar_budget.formats.exporting import export_phase_history
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.impulse_response import ImpulseResponse
from bisar_budget.simulator.targets import Targets
from tests.conftest import ROOT
from tests.outside.focus import Aperture, Collection, Response
from tests.outside.record import compare
from tests.simulate.conftest import only_rotated_images

EXAMPLES = tuple(sorted(path.stem for path in ROOT.glob("specs/missions/*.yaml")))
CHECKER, FORMER = "sarkit.verification (cphdcheck)", "image former of the tests, NumPy over sarkit"
SARKIT = version("sarkit")
LIMIT = "transmitter.velocity.y"  # has one in every example

REACH = 24.0  # cells on either side of the peak that verify's images show

PLACE, OF_CELL = 1e-3, 5e-3  # m, or a part of a cell, whichever is more
OF_PHASE, ROUNDING = 5e-3, 2e-4  # rad: what a file of single precision leaves
OF_WIDTH = 5e-3
LEVEL = 0.1  # dB
SIGMAS = 4.0  # of what the noise of pulses does to a place or a phase; `simulate` leaves it out of both


class Beside(NamedTuple):
    """One quantity of an example, by the image former there and by the package here."""

    example: str
    there: float
    here: float
    tolerance: float
    unit: str


Quantities = dict[str, list[Beside]]


# ---------------------------------------------------------------------- missions and their files
def document(name: str) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(file_of(name).read_text(encoding="utf-8"))
    return found


def file_of(name: str) -> Path:
    return ROOT / "specs" / "missions" / f"{name}.yaml"


def still(name: str) -> Mission:
    """An example without vibration, which `simulate` counts to no place and no phase."""
    found = document(name)
    for one in found["platforms"].values():
        one.get("motion_error", {}).pop("vibration", None)
    return parse_mission(yaml.safe_dump(found), str(file_of(name)))


def with_one_error(name: str, row_id: str, size: float) -> Mission:
    """An example whose only error is one component of a platform's; a direct path stays its clock."""
    platform, kind, axis = row_id.split(".")
    found = document(name)
    for key in ("common_motion_error", "timing_error"):
        found.pop(key, None)
    found.get("allocation", {}).pop("coverage_factor", None)
    found.get("scene", {}).pop("height_error", None)
    for one in found["platforms"].values():
        one.pop("motion_error", None)
        one.pop("oscillator", None)
    found["platforms"][platform]["motion_error"] = {kind: [size if axis == one else 0 for one in "xyz"]}
    if found.pop("synchronization", {}).get("method") == "direct_path":
        found["synchronization"] = {"method": "direct_path", "error": "1e-9 deg"}
    return parse_mission(yaml.safe_dump(found), str(file_of(name)))


def exported(path: Path, mission: Mission) -> Path:
    path.write_bytes(export_phase_history(mission, Targets()).data)
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("cphd")
    return {name: exported(folder / f"{name}.cphd", bb.load(file_of(name))) for name in EXAMPLES}


def test_cphdcheck_objects_to_no_example(files: dict[str, Path]) -> None:
    """All checks of the standard that sarkit knows, the signal's too."""
    objections, held = [], 0
    for name, path in files.items():
        # The checker keeps every condition in words, with the arrays that it compares: they are not read here.
        with path.open("rb") as file, warnings.catch_warnings(), np.printoptions(threshold=1, edgeitems=1):
            warnings.simplefilter("ignore")  # NumPy's, of a platform that has no direction of motion
            checker = skver.CphdConsistency.from_file(file, thorough=True)
            checker.check()
        held += len(checker.passes())
        objections += [f"{name}: {one}" for one in checker.failures()]
    assert not objections
    assert held > 50 * len(files)
    compare(f"objections of {held} checks to the files of {len(files)} missions", 0, 0, "", 0, CHECKER, SARKIT)


# ---------------------------------------------------------------------- simulate
@pytest.fixture(scope="module")
def simulated(files: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Quantities:
    found: Quantities = defaultdict(list)
    for name, path in files.items():
        mission = bb.load(file_of(name))
        with only_rotated_images():
            images = bb.simulate(mission).images
        file = Collection(path)
        seen = file.aperture()
        if any(one.motion_error.vibration.sinusoidal for one in mission.platforms):
            other = exported(tmp_path_factory.mktemp("still") / path.name, still(name))
            _aperture(found, name, Collection(other), images.effect)
        else:
            _aperture(found, name, file, images.effect, seen)
        reach = images.rotated.shape[1] / 2 * images.spacing[1] / file.resolution(seen.place)
        clean = file.without_error(seen.place).response(seen.place, reach)
        _response(found, f"{name}, without error", clean, images.clean_response)
        smeared = file.response(seen.place, reach, clean.mask)
        _response(found, name, smeared, images.response)
        loss = (-20 * math.log10(images.response.peak), -20 * math.log10(smeared.level))
        found["loss of the peak"].append(Beside(name, loss[1], loss[0], LEVEL, "dB"))
    return found


def _aperture(
    found: Quantities, name: str, file: Collection, effect: ExactEffect, seen: Aperture | None = None
) -> None:
    seen = seen or file.aperture()
    cell, pulses = file.resolution(seen.place), len(file.signal)
    # White noise of rms σ over n pulses: σ√((2k + 1)/n) in P_k of Legendre; P₁ = π moves a point by a cell.
    linear, quadratic, cubic = (SIGMAS * seen.left * math.sqrt(of / pulses) for of in (3, 5, 7))
    off = float(np.hypot(*(seen.place - effect.displacement)))
    moved = math.hypot(*effect.displacement)
    tolerance = max(PLACE, OF_CELL * cell) + linear / math.pi * cell
    # Beside the whole displacement stands what lies between both points.
    found["displacement"].append(Beside(name, moved + off, moved, tolerance, "m"))
    for of, there, here, noise in (
        ("quadratic phase", seen.quadratic, effect.quadratic, 1.5 * quadratic),
        ("cubic phase", seen.cubic, effect.cubic, 2.5 * cubic),
    ):
        found[of].append(Beside(name, there, here, OF_PHASE * abs(here) + ROUNDING + noise, "rad"))


def _response(found: Quantities, name: str, there: Response, here: ImpulseResponse) -> None:
    found["width"].append(Beside(name, there.width, here.irw_m, OF_WIDTH * here.irw_m, "m"))
    found["PSLR"].append(Beside(name, there.pslr_db, here.pslr_db, LEVEL, "dB"))
    found["ISLR"].append(Beside(name, there.islr_db, here.islr_db, LEVEL, "dB"))


@pytest.mark.parametrize(
    "quantity", ["displacement", "quadratic phase", "cubic phase", "width", "loss of the peak", "PSLR", "ISLR"]
)
def test_simulate(simulated: Quantities, quantity: str) -> None:
    """Every example with its own errors, and images without error."""
    assert len(simulated[quantity]) >= len(EXAMPLES)
    _compare_farthest("simulate", quantity, simulated[quantity])


# ---------------------------------------------------------------------- verify
@pytest.fixture(scope="module")
def verified(tmp_path_factory: pytest.TempPathFactory) -> Quantities:
    """Every example with one error alone, at its limit; its sign is the one that `verify` moves the point by."""
    folder = tmp_path_factory.mktemp("limits")
    found: Quantities = defaultdict(list)
    for name in EXAMPLES:
        (row,) = bb.verify(bb.load(file_of(name)), LIMIT).found.rows
        assert row.displacement_m is not None
        file = Collection(exported(folder / f"{name}.cphd", with_one_error(name, LIMIT, row.boundary_error)))
        seen = file.aperture()
        if seen.place @ row.displacement_m < 0:
            file = Collection(exported(folder / f"{name}.cphd", with_one_error(name, LIMIT, -row.boundary_error)))
            seen = file.aperture()
        cell = file.resolution(seen.place)
        tolerance = max(PLACE, OF_CELL * cell)
        for of, place in (("by exact ranges", row.displacement_m), ("in images", row.measured_displacement_m)):
            moved, off = math.hypot(*place), float(np.hypot(*(seen.place - place)))
            found[f"displacement {of}"].append(Beside(name, moved + off, moved, tolerance, "m"))
        for of, here in (("by exact ranges", row.predicted_qpe_rad), ("in images", row.measured_qpe_rad)):
            tolerance = OF_PHASE * here + ROUNDING
            if of == "in images":  # a hidden phase changes from the middle of the band to its end
                radar = bb.load(file_of(name)).radar
                hidden = math.sqrt(max(row.equal_loss_qpe_rad**2 - row.predicted_qpe_rad**2, 0.0))
                tolerance += hidden * radar.bandwidth / (2 * radar.center_frequency)
            found[f"quadratic phase {of}"].append(Beside(name, abs(seen.quadratic), here, tolerance, "rad"))
        here = row.predicted_cubic_rad
        found["cubic phase"].append(Beside(name, abs(seen.cubic), here, OF_PHASE * here + ROUNDING, "rad"))
        clean = file.without_error(seen.place).response(seen.place, REACH)
        smeared = file.response(seen.place, REACH, clean.mask)
        loss = 20 * math.log10(clean.level / smeared.level)
        found["width to that without error"].append(
            Beside(name, smeared.width / clean.width, row.irw_ratio, OF_WIDTH, "")
        )
        found["loss of the peak"].append(Beside(name, loss, row.peak_loss_db, LEVEL, "dB"))
        found["PSLR"].append(Beside(name, smeared.pslr_db, row.pslr_db, LEVEL, "dB"))
        found["ISLR"].append(Beside(name, smeared.islr_db, row.islr_db, LEVEL, "dB"))
    return found


@pytest.mark.parametrize(
    "quantity",
    [
        "displacement by exact ranges",
        "displacement in images",
        "quadratic phase by exact ranges",
        "quadratic phase in images",
        "cubic phase",
        "width to that without error",
        "loss of the peak",
        "PSLR",
        "ISLR",
    ],
)
def test_verify(verified: Quantities, quantity: str) -> None:
    """The limit of the transmitter's velocity along y, in every example."""
    assert len(verified[quantity]) == len(EXAMPLES)
    _compare_farthest(f"verify, {LIMIT} at its limit", quantity, verified[quantity])


def _compare_farthest(command: str, quantity: str, of: list[Beside]) -> None:
    """Compare the example whose difference takes most of its tolerance."""
    one = max(of, key=lambda row: abs(row.there - row.here) / row.tolerance)
    what = f"{command}: {quantity}, the farthest of {len(of)}: {one.example}"
    compare(what, one.there, one.here, one.unit, one.tolerance, FORMER, SARKIT)
