"""Images of a receiver that hears the transmitter: data hold ranges less the distance of both platforms."""

import math

import numpy as np
import pytest

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.phase_history import PathError, cell_centres, direct_path_error, path, phase_history
from bisar_budget.verifier.limits import verify_mission
from tests import reference
from tests.conftest import mission_text
from tests.simulate.conftest import images_of

HEARD = {"synchronization": {"method": "direct_path", "error": "1 deg"}, "collection__aperture_time": "3 s"}
FULL = {"allocation": {"model": "full"}}


@pytest.mark.parametrize("model", ["full", "published"])
@pytest.mark.parametrize(
    "row_id",
    ["receiver.velocity.x", "receiver.velocity.z", "transmitter.acceleration.x", "transmitter.velocity.y"],
)
def test_images_at_the_limits_confirm_the_full_model(model: str, row_id: str) -> None:
    """Whichever model the file names: the published one does not know the direct path."""
    mission = parse_mission(mission_text(**HEARD, allocation={"model": model}))
    (row,) = verify_mission(mission, row_id).rows
    assert (row.model, row.verdict) == ("full", "confirmed")
    assert row.measured_qpe_rad == pytest.approx(math.pi / 8, rel=0.01)


def test_autofocus_is_verified_with_a_phase_of_its_own() -> None:
    """Of a clock error, which the mission cannot have."""
    mission = parse_mission(mission_text(**HEARD, **FULL, autofocus={"n_pull": 2}))
    (row,) = verify_mission(mission, "mission.autofocus_pull_in").rows
    assert (row.verdict, row.verdict_autofocus) == ("confirmed", "confirmed")


def test_vibration_is_imaged_as_the_change_of_range_less_distance() -> None:
    """Echoes of both platforms in phase and noise of both fill the requirements, as without a direct path."""
    vibration = {"sinusoidal": [{"amplitude": "20 um", "frequency": "4 Hz"}], "wideband": {"rms": "10 um"}}
    lines = {f"platforms__{name}__motion_error": {"vibration": vibration} for name in ("transmitter", "receiver")}
    requirements = {"requirements": {"pslr": "-30 dB", "islr": "-20 dB"}}
    pulses = {"synchronization": {"method": "linear", "interval": "1 s", "error": "1 deg"}}
    measured = []
    for synchronization in (HEARD, {**HEARD, **pulses}):
        mission = parse_mission(mission_text(**synchronization, **FULL, **lines, **requirements))
        rows = verify_mission(mission, "mission.vibration.*").rows
        assert [row.verdict for row in rows] == ["confirmed", "confirmed"]
        measured.append([row.measured_db for row in rows])
    assert measured[0] == pytest.approx(measured[1], abs=0.05)  # dB: ways across the line of sight turn it a little


def test_a_slow_vibration_is_imaged_too() -> None:
    slow = {"vibration": {"sinusoidal": [{"amplitude": "1 mm", "frequency": "0.1 Hz"}]}}
    mission = parse_mission(mission_text(**HEARD, **FULL, platforms__receiver__motion_error=slow))
    (row,) = verify_mission(mission, "receiver.vibration.sinusoidal.0").rows
    assert row.verdict == "confirmed"


def test_a_clock_error_is_in_no_image() -> None:
    """Declared, but heard out: the location is verified with the motion errors alone."""
    changes = {"timing_error": {"quadratic": 1e-9}, "requirements": {"location_error": "5 m"}}
    mission = parse_mission(
        mission_text(**HEARD, **FULL, **changes, platforms__receiver__motion_error={"position": "1 m"})
    )
    (row,) = verify_mission(mission, "mission.location_error").rows
    assert row.verdict == "confirmed"


def test_the_history_of_a_scatterer_is_that_of_ranges_less_distances() -> None:
    """Phases written out for one pulse and one frequency, of a point beside the centre."""
    mission = parse_mission(mission_text(**HEARD))
    slow_time, frequency = cell_centres(3.0, 8), np.array([9.9e9, 10e9, 10.1e9])
    errors = (PathError(position=(3.0, -2.0, 1.0)), PathError(velocity=(0.1, 0.2, -0.1)))
    states = (mission.geometry.transmitter, mission.geometry.receiver)
    flown = tuple(path(state, slow_time, error) for state, error in zip(states, errors, strict=True))
    scatterer = np.array([20.0, -30.0, 0.0])
    history = phase_history(
        scatterer[None],
        np.ones(1, dtype=complex),
        slow_time=slow_time,
        frequency=frequency,
        transmitter=flown[0],
        receiver=flown[1],
        clock_error=direct_path_error(flown),
    )
    (t, r), (mt, mr) = ([getattr(one, which)[5] for one in flown] for which in ("actual", "measured"))
    recorded = np.linalg.norm(t - scatterer) + np.linalg.norm(r - scatterer) - np.linalg.norm(t - r)
    subtracted = np.linalg.norm(mt) + np.linalg.norm(mr) - np.linalg.norm(mt - mr)
    phase = -2 * math.pi * frequency[2] / SPEED_OF_LIGHT_MPS * (recorded - subtracted)
    assert history.samples[5, 2] == pytest.approx(np.exp(1j * phase), abs=1e-7)  # 40 km at 10 GHz, rounded


def test_simulate_puts_the_response_where_exact_ranges_do() -> None:
    """50 m of the transmitter, which a common clock would not survive, and 30 cm/s of the receiver."""
    errors = {
        "platforms__transmitter__motion_error": {"position": [0, "50 m", 0]},
        "platforms__receiver__motion_error": {"velocity": [0, 0, "30 cm/s"]},
    }
    quiet = {**HEARD, "synchronization": {"method": "direct_path", "error": 0}}
    images = images_of(mission_text(**quiet, **FULL, **errors), rotated_only=True)
    mission = parse_mission(mission_text(**quiet, **FULL, **errors))
    declared = [one for one in reference.errors_of(mission) if one.declared]
    paths = sum(one.declared * one.paths for one in declared)
    together = reference.at_declared(mission, [declared[0]._replace(paths=paths, declared=1.0)])
    assert images.effect.displacement == pytest.approx(together.place[0, 0], abs=1e-3)
    assert images.effect.quadratic == pytest.approx(together.qpe[0, 0], abs=1e-3)
    # Of so little phase the response keeps its width: the patch lies where it stands.
    assert abs(images.effect.quadratic) < math.pi / 4
    assert images.response.irw_m == pytest.approx(images.clean_response.irw_m, rel=0.02)
    assert images.response.peak == pytest.approx(images.clean_response.peak, rel=0.03)
