"""A receiver that hears the transmitter: which model gates, what drops out, and what a file may not have."""

import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.faults import MissionError
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.sampling.probability import monte_carlo
from tests import reference
from tests.conftest import ROOT, findings, mission_text, row

EXAMPLE = ROOT / "specs" / "missions" / "geostationary_direct_path.yaml"
HEARD = {"synchronization": {"method": "direct_path", "error": "1 deg"}}
LINEAR = {"synchronization": {"method": "linear", "interval": "0.1 s", "error": "1 deg"}}
ERRORS = {
    "platforms__transmitter__motion_error": {"position": "50 m", "velocity": "5 cm/s"},
    "platforms__receiver__motion_error": {"position": "1 m", "velocity": "5 mm/s"},
    "timing_error": {"constant": "1 us", "quadratic": "1e-9 1/s"},
}


def without_direct_path() -> Mission:
    text = EXAMPLE.read_text(encoding="utf-8")
    return parse_mission("".join(line for line in text.splitlines(True) if not line.startswith("synchronization")))


@pytest.mark.parametrize("model", ["published", "strictest"])
def test_the_full_model_gates_and_a_warning_says_so(model: str) -> None:
    found = findings(**HEARD, **ERRORS, allocation={"model": model})
    full = findings(**HEARD, **ERRORS, allocation={"model": "full"})
    assert found.model == "full"
    assert [(one.id, one.status, one.allowable) for one in found.rows] == [
        (one.id, one.status, one.allowable) for one in full.rows
    ]
    (warning,) = [one for one in found.warnings if "direct path" in one.message]
    assert f"allocation.model {model}" in warning.message
    assert not [one for one in full.warnings if "direct path" in one.message]


def test_exchanged_pulses_leave_the_model_alone() -> None:
    found = findings(**LINEAR, **ERRORS)
    assert found.model == "published"
    assert not [one for one in found.warnings if "direct path" in one.message]
    assert row(found, "timing.quadratic").status == "fail"


def test_the_published_model_doubts_nothing_that_it_does_not_know() -> None:
    """5 cm/s of the transmitter: 0.93 rad by Table II, and 0.012 rad of ranges less distances."""
    found = findings(**HEARD, **ERRORS, platforms__transmitter={
        "position": ["300 km", 0, "60 km"], "velocity": [0, "7 km/s", 0],
        "motion_error": {"velocity": [0, "5 cm/s", 0]},
    })  # fmt: skip
    one = row(found, "transmitter.velocity.y")
    assert one.qpe_published_rad > math.pi / 4
    assert (one.status, one.reason) == ("pass", None)


def test_timing_errors_have_no_effect() -> None:
    found = findings(**HEARD, **ERRORS, requirements={"location_error": "1 km", "cubic_phase_error": "1 rad"})
    for term in ("constant", "quadratic"):
        one = row(found, f"timing.{term}")
        assert (one.status, one.allowable, one.qpe_full_rad, one.utilization) == ("pass", None, 0.0, 0.0)
        assert one.reason == "the direct path is the clock: a timing error has no effect"
    assert row(found, "timing.linear").status == "not_declared"


def test_an_error_of_both_platforms_is_that_without_a_direct_path() -> None:
    """Common motion and terrain leave the distance of both platforms alone."""
    both = {"common_motion_error": {"position": "30 m", "velocity": "1 m/s"}, "scene": {"height_error": "40 m"}}
    with_it, without = (findings(**both, **more, allocation={"model": "full"}) for more in (HEARD, LINEAR))
    compared = 0
    for one in without.rows:
        if one.id.startswith("common.") or one.id == "mission.terrain":
            other = row(with_it, one.id)
            assert other.allowable == (one.allowable and pytest.approx(one.allowable, rel=1e-6))
            if one.declared is not None:
                assert other.qpe_full_rad == pytest.approx(one.qpe_full_rad, rel=1e-6, abs=1e-9)
            compared += 1
    assert compared == 10


@pytest.mark.parametrize("platform", ["transmitter", "receiver"])
@pytest.mark.parametrize("amplitude", ["80 um", ["30 um", "-10 um", "60 um"]])
def test_a_vibration_counts_as_it_changes_range_less_distance(platform: str, amplitude) -> None:
    """By distances of the moved platform, a thousand times as far; rounded and bent by 1e-6 of that."""
    sizes = [abs(float(part.split()[0])) for part in amplitude] if isinstance(amplitude, list) else None
    amplitude = [f"{size} um" for size in sizes] if sizes else amplitude
    lines = {"sinusoidal": [{"amplitude": amplitude, "frequency": "12 Hz"}]}
    path = f"platforms__{platform}__motion_error"
    found = findings(**HEARD, **{path: {"vibration": lines}}, requirements={"pslr": -30})
    places = {name: np.array(getattr(found.geometry, name).position) for name in ("transmitter", "receiver")}
    own, other = places.pop(platform), *places.values()

    def moved(way) -> float:
        ranges = [np.linalg.norm(at) - np.linalg.norm(at - other) for at in (own + 500 * way, own - 500 * way)]
        return abs(ranges[0] - ranges[1]) / 1000

    ways = np.diag(sizes) * 1e-6 if sizes else [80e-6 * own / np.linalg.norm(own)]
    one = row(found, f"{platform}.vibration.sinusoidal.0")
    # The row has the root mean square over the aperture, in which the lines of sight turn by some hundredths.
    assert one.declared == pytest.approx(sum(moved(way) for way in ways), rel=5e-3)
    assert "of it in the range less the direct path" in one.notes[0]


def test_a_draw_by_exact_ranges_has_the_direct_path() -> None:
    """One bound of either sign, too large to be linear: 1.98 and 3.15 rad, 0.55 by first order.

    The mean square over 2000 draws has a standard error of 1 %, its root one of 0.5 %.
    """
    error = {"platforms__receiver__motion_error": {"velocity": [0, 0, "6 m/s"], "distribution": "bound"}}
    mission = parse_mission(mission_text(**HEARD, **error, allocation={"model": "full", "combine": "rss"}))
    found = monte_carlo(Analysis(mission), 2000, 1)
    assert found.is_exact
    (declared,) = [one for one in reference.errors_of(mission) if one.declared]
    both = reference.at_declared(mission, [declared]).qpe[:, 0]
    (one,) = [one for one in found.requirements if one.id == "mission.quadratic_phase_error"]
    assert one.sigma == pytest.approx(math.sqrt(sum(both**2) / 2), rel=0.02)


@pytest.mark.parametrize(
    ("position", "velocity"),
    [
        (["6 km", "6 km", "2000.5 m"], ["-40 m/s", "40 m/s", 0]),  # beside each other
        (["6 km", "6.12 km", "2 km"], [0, "-40 m/s", 0]),  # through each other
    ],
)
def test_platforms_too_near_have_no_direct_path(position, velocity) -> None:
    transmitter = {"platforms__transmitter": {"position": position, "velocity": velocity}}
    parse_mission(mission_text(**transmitter, **LINEAR))
    with pytest.raises(MissionError) as refused:
        parse_mission(mission_text(**transmitter, **HEARD))
    (fault,) = refused.value.faults
    assert fault.key == "synchronization.method"
    assert "no direct path" in fault.problem


def test_an_error_that_puts_one_platform_into_the_other_ends_in_numbers() -> None:
    """50 m between them, an error of 50 m: the measured distance is zero, and has no direction."""
    transmitter = {"position": ["6 km", "6.05 km", "2 km"], "velocity": ["-40 m/s", "40 m/s", "0.1 m/s"]}
    mission = parse_mission(mission_text(platforms__transmitter=transmitter, **HEARD))
    analysis = Analysis(mission)
    source = next(one for one in analysis.sources if one.id == "transmitter.position.y")
    found = analysis.full.does(source, -50.0)
    assert math.isfinite(found.qpe)


def test_a_satellite_known_to_2_km_is_usable_by_the_direct_path_alone() -> None:
    """The example: hopeless without, met with it; its finding, number by number."""
    without, heard = Analysis(without_direct_path()), Analysis(load_mission(str(EXAMPLE)))
    north = next(one for one in without.sources if one.id == "transmitter.position.y")
    assert abs(2e3 * without.full.effect(north).qpe) == pytest.approx(92.42, abs=0.01)  # by `tests.image_point`
    assert math.isinf(Case(without).does(without.full, north).qpe)
    assert without.full.allowable(north, QUADRATIC, math.pi / 8) == pytest.approx(8.432, abs=0.001)
    declared = [
        Case(heard).does(heard.full, one) for one in heard.stated if one.id.startswith("transmitter.position")
    ]
    assert max(abs(one.qpe) for one in declared) == pytest.approx(0.0033, abs=5e-5)
    assert max(math.hypot(*one.farthest) for one in declared) == pytest.approx(0.038, abs=5e-4)
    for axis, times in (("y", 1.90), ("z", 2.36)):
        phases = [
            next(source.full.qpe for source in one.sources if source.id == f"receiver.acceleration.{axis}")
            for one in (heard, without)
        ]
        assert phases[0] / phases[1] == pytest.approx(times, abs=0.005)


def test_a_report_has_the_formulas_of_a_direct_path_where_there_is_one(run) -> None:
    for path, times in ((EXAMPLE, 3), (EXAMPLE.with_name("tandem_x.yaml"), 0)):
        text = run("check", path, "--format", "html", "--detail", "full").stdout
        assert text.count("Full model, direct path") == times
