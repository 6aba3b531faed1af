"""Rows of delays in the air and of effects from elsewhere: what each is held to, and in which sums it counts."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.check import check_mission
from bisar_budget.budget.declarations import declared_kinds
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import parse_mission
from bisar_budget.report.explain.explanation import explain
from bisar_budget.sampling.probability import monte_carlo
from tests.conftest import TODAY, mission_text, row
from tests.conftest import findings as found_of
from tests.questions.test_sweep import assert_as_checked, grid, swept
from tests.report.test_report_explanation import evaluated, sums

NEEDS = {"cubic_phase_error": "22.5 deg", "islr": "-20 dB", "location_error": "1 m"}
AIR = {"zenith_delay": "5 cm", "source": "weather model"}
ORBITS = {
    "radar": {"center_frequency": "1.25 GHz", "bandwidth": "80 MHz"},
    "platforms__transmitter": {
        "position": ["500 km", "20 km", "600 km"],
        "velocity": [0, "7500 m/s", 0],
        "acceleration": ["-4 m/s^2", 0, "-5 m/s^2"],
    },
    "platforms__receiver": {
        "position": ["480 km", "-20 km", "620 km"],
        "velocity": [0, "7400 m/s", 0],
        "acceleration": ["-4 m/s^2", 0, "-5 m/s^2"],
    },
}
ELSEWHERE = {
    "name": "antenna",
    "quadratic_phase_error": "5 deg",
    "cubic_phase_error": "-1 deg",
    "location_error": "10 cm",
    "islr": "-40 dB",
    "source": "range test",
}
PLATFORMS = ("transmitter", "receiver")
DELAY, CONTENT = "propagation.transmitter.zenith_delay", "propagation.transmitter.zenith_electron_content"


def findings(**changes: object) -> MissionFindings:
    """Check the base mission by the full model, by root-sum-square unless the changes say otherwise."""
    rules = {"allocation__model": "full", "allocation__combine": "rss"}
    if "allocation" in changes:
        changes["allocation"] = {"model": "full", "combine": "rss"} | changes["allocation"]
        rules = {}
    return found_of(**(rules | changes))


# ---------------------------------------------------------------------- delays in the air
def of_two(**figures: object) -> dict[str, object]:
    """The same figures for each leg: two airs, which know nothing of each other."""
    return dict.fromkeys(PLATFORMS, figures)


def test_a_delay_of_a_leg_is_held_to_its_platforms_share() -> None:
    split = {"transmitter": 0.2, "receiver": 0.8}
    found = findings(propagation=of_two(**AIR), allocation={"split": split})
    rows = [row(found, f"propagation.{name}.zenith_delay") for name in ("transmitter", "receiver")]
    for one, share in zip(rows, split.values(), strict=True):
        assert one.subject.owner in one.id
        assert one.binding_requirement == "quadratic_phase_error"
        assert one.allowable / one.declared == pytest.approx(share * math.pi / 4 / one.equal_loss_qpe_rad)
        assert (one.unit, one.evidence, one.islr_db) == ("m", "weather model", None)
    for name, one in zip(split, rows, strict=True):
        assert row(found, f"{name}.quadratic_phase_error").declared == pytest.approx(one.equal_loss_qpe_rad)


def test_the_coverage_factor_multiplies_it() -> None:
    one, two = (row(findings(propagation=AIR, allocation={"coverage_factor": k}), DELAY) for k in ("1", "2"))
    assert two.declared == pytest.approx(2 * one.declared)
    assert two.qpe_full_rad == pytest.approx(2 * one.qpe_full_rad)
    assert two.allowable == pytest.approx(one.allowable)


def test_legs_with_their_own_figures_are_independent() -> None:
    found = findings(propagation=of_two(**AIR), requirements__location_error="1 m")
    legs = [math.hypot(*row(found, f"propagation.{name}.zenith_delay").displacement_m) for name in PLATFORMS]
    assert row(found, "mission.location_error").declared == pytest.approx(math.hypot(*legs))
    summed = findings(propagation=of_two(**AIR), requirements__location_error="1 m", allocation={"combine": "sum"})
    assert row(summed, "mission.location_error").declared == pytest.approx(sum(legs))


# Two satellites behind each other at 514.8 km, which see the scene at an incidence of 35 degrees.
FORMATION = {
    "radar": {"center_frequency": "9.65 GHz", "bandwidth": "150 MHz"},
    "collection": {"aperture_time": "0.7 s"},
    **{
        f"platforms__{name}": {
            "position": [f"{514.8 * math.tan(math.radians(35))} km", north, "514.8 km"],
            "velocity": [0, "7500 m/s", 0],
            "acceleration": ["-4.6 m/s^2", 0, "-6.6 m/s^2"],
        }
        for name, north in (("transmitter", "100 m"), ("receiver", "-100 m"))
    },
}


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
@pytest.mark.parametrize("model", ["published", "full"])
def test_one_air_is_one_error_of_both_legs(model: str, combine: str) -> None:
    """Its amplitudes add: with both legs alike √2 of what two airs make. 4 cm passed a limit of 70 mm."""
    needs, rules = {"location_error": "70 mm"}, {"model": model, "combine": combine}
    found = findings(**FORMATION, propagation={"zenith_delay": "4 cm"}, requirements=needs, allocation=rules)
    # The delay along the leg, over the sine of the incidence: on the ground.
    along = 0.04 / math.sqrt(1 - (math.sin(math.radians(35)) / (1 + 7e3 / 6371e3)) ** 2)
    moved = along / math.sin(math.radians(35))
    assert row(found, "mission.location_error").declared == pytest.approx(moved, rel=2e-3)
    assert row(found, "mission.location_error").status == found.status == "fail"
    air = row(found, "propagation.zenith_delay")
    assert (air.owner, air.status) == ("mission", "fail" if combine == "each" else "info")
    for name in PLATFORMS:
        leg = row(found, f"propagation.{name}.zenith_delay")
        assert (leg.status, leg.is_independent) == ("info", False)
        assert "propagation.zenith_delay" in str(leg.reason)
        assert math.hypot(*leg.displacement_m) == pytest.approx(moved / 2, rel=2e-3)
    apart = findings(**FORMATION, propagation=of_two(zenith_delay="4 cm"), requirements=needs, allocation=rules)
    of_rule = {"each": moved / 2, "sum": moved, "rss": moved / math.sqrt(2)}[combine]
    assert row(apart, "mission.location_error").declared == pytest.approx(of_rule, rel=2e-3)
    assert (apart.status == "fail") == (combine == "sum")


def test_one_air_is_drawn_once() -> None:
    text = mission_text(**FORMATION, propagation={"zenith_delay": "4 cm"}, requirements={"location_error": "1 m"})
    analysis = Analysis(parse_mission(text))
    (drawn,) = [one for one in monte_carlo(analysis, 100_000, 3).requirements if one.unit == "m"]
    air = next(one for one in analysis.random if one.id == "propagation.zenith_delay")
    assert drawn.sigma == pytest.approx(air.full.displacement * 0.04, rel=0.01)


@pytest.mark.parametrize("combine", ["sum", "rss"])
def test_at_the_edge_of_a_scene_one_air_is_one_error_too(combine: str) -> None:
    """Two airs differ there by no more than one does: of both legs' differences one is a sum with signs."""
    changes = {"scene": {"radius": "500 m"}, "allocation": {"combine": combine}}
    one, two = (
        row(findings(**changes, propagation=air), "mission.spatial_variance").declared
        for air in ({"zenith_delay": "5 m"}, of_two(zenith_delay="5 m"))
    )
    assert one > 0
    assert one <= two * (math.sqrt(2) if combine == "rss" else 1) * (1 + 1e-6)


def test_below_the_ionosphere_electrons_do_nothing() -> None:
    found = row(findings(propagation={"zenith_electron_content": "5 TECU"}), CONTENT)
    assert (found.declared, found.allowable, found.displacement_m) == (5e16, None, (0.0, 0.0))
    assert found.reason == "the transmitter flies below the ionosphere: no electrons on its leg"


# ---------------------------------------------------------------------- dispersion over the band
DISPERSION = "propagation.dispersion"
P_BAND = {
    "radar": {"center_frequency": "435 MHz", "bandwidth": "150 MHz"},
    "platforms__transmitter": {
        "slant_range": "800 km",
        "azimuth": 0,
        "elevation": "55 deg",
        "speed": "7.5 km/s",
        "motion_azimuth": "90 deg",
        "acceleration": ["-0.666 m/s^2", 0, "-7.851 m/s^2"],
    },
}
SHELL = 1 / math.sqrt(1 - (math.cos(math.radians(55)) / (1 + 350e3 / 6371e3)) ** 2)  # at 350 km, over a sphere


def bent_over_the_band(content: float, obliquity: float, center: float, bandwidth: float) -> float:
    """Quadratic phase at the edges of the band, fitted to the exact phase 2πK/(c·f) of one leg. [rad]"""
    f = np.linspace(center - bandwidth / 2, center + bandwidth / 2, 2001)
    phase = 2 * math.pi * 40.308 * content * obliquity / (299_792_458 * f)
    coefficients = np.polynomial.legendre.legfit(2 * (f - center) / bandwidth, phase, 6)
    return float(1.5 * coefficients[2])


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
@pytest.mark.parametrize("model", ["published", "full", "strictest"])
def test_dispersion_is_held_by_the_quadratic_requirement_alone(model: str, combine: str) -> None:
    """10 TECU at 435 MHz bend the ends of 150 MHz by 6.88 rad, and the mission passed."""
    found = findings(
        **P_BAND,
        propagation={"transmitter": {"zenith_electron_content": "10 TECU"}},
        requirements=NEEDS | {"location_error": "1 km"},
        other_errors=[ELSEWHERE],
        allocation={"model": model, "combine": combine, "split": {"transmitter": 0.2, "receiver": 0.8}},
        autofocus={"n_pull": 2},
    )
    one = row(found, DISPERSION)
    assert (one.status, one.unit, one.metric) == ("fail", "rad", "quadratic_phase_error")
    assert one.declared == pytest.approx(6.88, abs=0.005)
    assert one.allowable == pytest.approx(math.pi / 4)  # all of it, without share and gain
    # The exact phase has orders beyond: a seventh of the fourth, (B/2f₀)² of the second, is in the fit.
    assert one.declared == pytest.approx(bent_over_the_band(1e17, SHELL, 435e6, 150e6), rel=0.04)
    (quadratic,) = [each for each in found.requirements if each.key == "quadratic_phase_error"]
    assert (quadratic.status, quadratic.row) == ("fail", DISPERSION)
    assert row(found, "mission.quadratic_phase_error").declared < 1 if combine != "each" else True


@pytest.mark.parametrize(("radar", "content"), [("1.25 GHz", 5e16), ("9.65 GHz", 1e16)])
def test_dispersion_is_that_of_the_exact_phase_over_a_narrow_band(radar: str, content: float) -> None:
    changes = P_BAND | {"radar": {"center_frequency": radar, "bandwidth": "50 MHz"}}
    found = findings(**changes, propagation={"transmitter": {"zenith_electron_content": f"{content / 1e16} TECU"}})
    exact = bent_over_the_band(content, SHELL, float(radar.split()[0]) * 1e9, 50e6)
    assert row(found, DISPERSION).declared == pytest.approx(exact, rel=0.001)
    assert row(found, DISPERSION).status == "pass"


def test_a_tecu_at_x_band_is_negligible() -> None:
    found = findings(
        **ORBITS | {"radar": {"center_frequency": "10 GHz", "bandwidth": "300 MHz"}},
        propagation={"zenith_electron_content": "1 TECU"},
    )
    assert row(found, DISPERSION).utilization < 0.01


def test_of_one_air_both_legs_bend_the_band_together_of_two_by_the_rule() -> None:
    content = {"zenith_electron_content": "5 TECU"}
    legs = [row(findings(**ORBITS, propagation={name: content}), DISPERSION).declared for name in PLATFORMS]
    assert row(findings(**ORBITS, propagation=content), DISPERSION).declared == pytest.approx(sum(legs))
    of_two = dict.fromkeys(PLATFORMS, content)
    for rule, combined in (("rss", math.hypot(*legs)), ("sum", sum(legs)), ("each", max(legs))):
        found = findings(**ORBITS, propagation=of_two, allocation={"combine": rule})
        assert row(found, DISPERSION).declared == pytest.approx(combined)


def test_the_content_that_is_allowed_is_said_and_is_the_limit() -> None:
    changes = P_BAND | {"allocation": {"coverage_factor": "2"}}
    found = row(findings(**changes, propagation={"zenith_electron_content": "10 TECU"}), DISPERSION)
    (note,) = [one for one in found.remarks if one.code == "content-allowed"]
    (content,) = note.values
    for factor, status in ((0.999, "warn"), (1.001, "fail")):
        at_limit = {"zenith_electron_content": f"{float(content) * factor} 1/m^2"}
        assert row(findings(**changes, propagation=at_limit), DISPERSION).status == status


def test_without_a_content_there_is_no_row_of_dispersion() -> None:
    assert DISPERSION not in {one.id for one in findings(**ORBITS, propagation=AIR).rows}


def test_dispersion_is_explained_with_its_numbers() -> None:
    mission = parse_mission(mission_text(**P_BAND, propagation={"zenith_electron_content": "10 TECU"}))
    found = check_mission(mission, TODAY)
    text = explain(mission, found, DISPERSION)
    assert "6.87861 rad" in text
    assert "without share and gain" in text


def test_a_leg_of_which_nothing_is_stated_has_no_row() -> None:
    found = findings(propagation={"receiver": {"zenith_delay": "5 cm"}})
    ids = [one.id for one in found.rows if one.subject.kind == "propagation"]
    assert ids == ["propagation.receiver.zenith_delay", "propagation.receiver.zenith_electron_content"]
    assert row(found, ids[1]).status == "not_declared"
    assert row(findings(**ORBITS, propagation={"receiver": {"zenith_delay": 0}}), ids[1]).allowable > 0


def test_no_requirement_takes_a_displacement_or_it_is_judged() -> None:
    assert row(findings(propagation=AIR), "mission.location_error").status == "info"
    judged = findings(propagation=AIR, requirements__location_error="15 cm")
    assert row(judged, DELAY).status == "info"
    assert row(judged, "mission.location_error").status == "fail"
    assert row(judged, DELAY).binding_requirement == "location_error"


def test_air_alone_is_a_mission_that_is_judged_but_spreads_nothing() -> None:
    found = findings(propagation=AIR, requirements=NEEDS)
    status = {one.key: one.status for one in found.requirements}
    assert status["quadratic_phase_error"] == status["cubic_phase_error"] == status["location_error"] == "pass"
    assert status["islr"] == "not_evaluated"


@pytest.mark.parametrize(
    ("propagation", "is_sourced"),
    [
        ({"zenith_delay": "5 cm"}, False),
        (AIR, True),
        ({"receiver": {"zenith_delay": "5 cm", "source": "a"}}, True),
        ({"receiver": {"zenith_delay": "5 cm", "source": "a"}, "transmitter": {"zenith_delay": "1 cm"}}, False),
    ],
)
def test_it_is_a_kind_of_error_with_a_source(propagation: dict[str, object], is_sourced: bool) -> None:
    kinds = declared_kinds(parse_mission(mission_text(propagation=propagation)))
    assert "propagation" in kinds.declared
    assert ("propagation" in kinds.without_source) != is_sourced
    assert "propagation" not in kinds.missing


@pytest.mark.parametrize("model", ["published", "full", "strictest"])
@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
def test_every_model_and_every_rule(model: str, combine: str) -> None:
    """To the published model the line of sight is held: a delay displaces, and bends nothing."""
    found = findings(
        propagation=AIR, requirements=NEEDS, other_errors=[ELSEWHERE], allocation={"model": model, "combine": combine}
    )
    one = row(found, DELAY)
    assert one.qpe_published_rad == 0
    assert one.qpe_full_rad > 0
    assert one.allowable_published is None
    assert found.status == "pass"


def test_with_a_direct_path() -> None:
    found = findings(propagation=AIR, synchronization={"method": "direct_path", "error": "1 deg"})
    plain = findings(propagation=AIR)
    assert row(found, DELAY).displacement_m == pytest.approx(row(plain, DELAY).displacement_m, rel=1e-3)


# ---------------------------------------------------------------------- delays that change within the aperture
CHANGING = {"zenith_delay": "0.2 mm", "correlation_time": "20 s", "source": "weather model"}


def of_two_that_change(**figures: object) -> dict[str, object]:
    return dict.fromkeys(PLATFORMS, CHANGING | figures)


def variance_of(level: float) -> float:
    """Phase variance that makes an image's ISLR under a uniform window."""
    return math.log1p(10 ** (level / 10) * 0.9028233335802807)


def test_what_changes_spreads_and_islr_judges_it() -> None:
    changes, stays = (
        findings(propagation={**air, "zenith_delay": "0.2 mm"}, requirements=NEEDS) for air in (CHANGING, AIR)
    )
    status = [{one.key: one.status for one in found.requirements}["islr"] for found in (changes, stays)]
    assert status == ["pass", "not_evaluated"]  # of a delay that stays nothing spreads
    assert row(changes, "mission.islr").islr_db == pytest.approx(row(changes, "propagation.zenith_delay").islr_db)
    assert row(stays, "propagation.zenith_delay").islr_db is None


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
def test_of_one_air_amplitudes_add_and_legs_count_once(combine: str) -> None:
    one, two = (
        findings(propagation=air, requirements=NEEDS, allocation={"combine": combine})
        for air in (CHANGING, of_two_that_change())
    )
    of_air = row(one, "propagation.zenith_delay")
    legs = [[row(found, f"propagation.{name}.zenith_delay") for name in PLATFORMS] for found in (one, two)]
    for counted, own in zip(*legs, strict=True):
        assert counted.islr_db == own.islr_db is not None
        assert (counted.status, own.status) == ("info", "pass" if combine == "each" else "info")
    roots = [math.sqrt(variance_of(leg.islr_db)) for leg in legs[0]]
    assert variance_of(of_air.islr_db) == pytest.approx(sum(roots) ** 2, rel=1e-3)
    assert of_air.qpe_full_rad == pytest.approx(sum(leg.qpe_full_rad for leg in legs[0]), rel=1e-3)
    assert variance_of(row(one, "mission.islr").islr_db) == pytest.approx(sum(roots) ** 2, rel=1e-3)
    assert variance_of(row(two, "mission.islr").islr_db) == pytest.approx(sum(root**2 for root in roots), rel=1e-6)
    assert variance_of(row(two, "transmitter.islr").islr_db) == pytest.approx(roots[0] ** 2, rel=1e-6)


def test_with_each_one_air_gates_where_no_leg_would() -> None:
    """Between what one air may have and what a leg may have that is alone."""
    rules = {"requirements": NEEDS, "allocation": {"combine": "each"}}
    found = findings(propagation=CHANGING, **rules)
    legs = [f"propagation.{name}.zenith_delay" for name in PLATFORMS]
    alone = findings(propagation=of_two_that_change(), **rules)
    air = row(found, "propagation.zenith_delay").allowable
    most = min(row(alone, leg).allowable for leg in legs)
    assert air < 0.8 * most
    size = f"{math.sqrt(air * most)} m"
    found = findings(propagation={**CHANGING, "zenith_delay": size}, **rules)
    alone = findings(propagation=of_two_that_change(zenith_delay=size), **rules)
    assert row(found, "propagation.zenith_delay").status == "fail"
    assert row(found, "propagation.zenith_delay").binding_requirement == "islr"
    assert not any(row(alone, leg).status == "fail" for leg in legs)


def test_each_leg_may_change_in_a_time_of_its_own() -> None:
    own = {"correlation_time": "20 s", "transmitter": {"zenith_delay": "0.2 mm"}}
    own["receiver"] = {"zenith_delay": "0.2 mm", "correlation_time": "2 h"}
    found, alike = (findings(propagation=air, requirements=NEEDS) for air in (own, of_two_that_change()))
    levels = [[row(one, f"propagation.{name}.zenith_delay").islr_db for name in PLATFORMS] for one in (found, alike)]
    assert levels[0][0] == levels[1][0]
    assert variance_of(levels[1][1]) / variance_of(levels[0][1]) == pytest.approx(7200 / 20, rel=0.15)  # 2·T/3τ_c


def test_what_spreads_without_a_requirement_is_not_judged() -> None:
    """0.1 rad rms are not negligible; 1 µm of it is."""
    for size, status in (("0.6 mm", "not_evaluated"), ("1 um", "info")):
        found = findings(propagation={**CHANGING, "zenith_delay": size}, requirements={"cubic_phase_error": "360 deg",
                         "quadratic_phase_error": "360 deg", "location_error": "1 m"})  # fmt: skip
        assert row(found, "propagation.zenith_delay").status == status
        assert found.status == ("not_evaluated" if status == "not_evaluated" else "pass")


def test_a_coverage_factor_is_not_in_what_spreads() -> None:
    once, twice = (
        row(
            findings(propagation=CHANGING, requirements=NEEDS, allocation={"coverage_factor": factor}),
            "propagation.zenith_delay",
        )
        for factor in (1, 2)
    )
    assert twice.islr_db == pytest.approx(once.islr_db)
    for name in ("qpe_full_rad", "cubic_rad"):
        assert getattr(twice, name) == pytest.approx(2 * getattr(once, name))


@pytest.mark.parametrize("model", ["published", "full", "strictest"])
def test_every_model_sees_that_it_changes(model: str) -> None:
    found = findings(propagation=CHANGING, requirements=NEEDS, allocation={"model": model})
    one = row(found, "propagation.zenith_delay")
    assert one.qpe_published_rad == pytest.approx(one.qpe_full_rad, rel=0.05)
    assert found.status == "pass"


@pytest.mark.parametrize("of_both", [True, False])
def test_sweeps_of_a_correlation_time_are_checks(of_both: bool) -> None:
    air = CHANGING if of_both else of_two_that_change()
    mission = parse_mission(mission_text(propagation=air, requirements=NEEDS, scene={"radius": "500 m"}))
    key = "propagation__correlation_time" if of_both else "propagation__receiver__correlation_time"
    cases = grid(mission, collection__aperture_time=[2.0, 6.0], **{key: [1e-6, 0.1, 10.0, 1e4, 1e9]})
    owner = "" if of_both else "receiver."
    columns = [
        f"propagation.{owner}zenith_delay.{name}" for name in ("qpe_full_rad", "islr_db", "allowable", "status")
    ]
    columns += ["mission.islr.islr_db", "mission.spatial_variance.declared"]
    assert_as_checked(mission, cases, swept(mission, cases, columns), columns)


# ---------------------------------------------------------------------- effects from elsewhere
@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
def test_effects_from_elsewhere_count_in_the_missions_sums(combine: str) -> None:
    """Two of them beside a receiver that is wrong by a velocity; no share, no coverage factor."""
    others = [ELSEWHERE, {"name": "scene", "cubic_phase_error": "2 deg", "location_error": "20 cm", "islr": "-37 dB"}]
    velocity = {"platforms__receiver__motion_error__velocity": ["1 mm/s", 0, 0]}
    allocation = {"combine": combine, "coverage_factor": "2"}
    alone = findings(**velocity, requirements=NEEDS, allocation=allocation)
    found = findings(**velocity, requirements=NEEDS, allocation=allocation, other_errors=others)
    join: Callable[..., float] = {"each": max, "sum": lambda *sizes: sum(sizes), "rss": math.hypot}[combine]
    by_velocity = row(alone, "receiver.velocity.x")
    cubic = join(abs(by_velocity.cubic_rad), math.radians(1), math.radians(2))
    assert row(found, "mission.cubic_phase_error").declared == pytest.approx(cubic)
    moved = join(math.hypot(*by_velocity.displacement_m), 0.1, 0.2)
    assert row(found, "mission.location_error").declared == pytest.approx(moved, rel=1e-6)
    energy = 0.9028233335802807  # of a uniform window's mainlobe
    variance = sum(math.log1p(10 ** (level / 10) * energy) for level in (-40, -37))
    assert row(found, "mission.islr").declared == pytest.approx(10 * math.log10(math.expm1(variance) / energy))
    assert row(found, "other.antenna").declared == pytest.approx(math.radians(5))
    if combine != "each":
        for name in PLATFORMS:
            row_id = f"{name}.quadratic_phase_error"
            assert row(found, row_id).declared == row(alone, row_id).declared


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize(
    ("effect", "unit", "declared", "allowable", "binding"),
    [
        ("cubic_phase_error", "rad", math.radians(1), math.radians(22.5), "cubic_phase_error"),
        ("location_error", "m", 0.1, 1.0, "location_error"),
        ("islr", "dB", -40.0, -20.0, "islr"),
    ],
)
def test_each_has_all_that_is_required(
    model: str, effect: str, unit: str, declared: float, allowable: float, binding: str
) -> None:
    allocation = {"combine": "each", "model": model, "coverage_factor": "3", "split": "equal"}
    found = row(
        findings(requirements=NEEDS, other_errors=[ELSEWHERE], allocation=allocation), f"other.antenna.{effect}"
    )
    assert (found.unit, found.status, found.binding_requirement) == (unit, "pass", binding)
    assert found.declared == pytest.approx(declared)
    assert found.allowable == pytest.approx(allowable)
    assert (found.evidence, found.equation, found.subject.owner) == ("range test", "as declared", "mission")
    use = 10 ** ((declared - allowable) / 20) if unit == "dB" else declared / allowable
    assert found.utilization == pytest.approx(use, rel=0.003)  # of rms phases, which an ISLR bends a little


@pytest.mark.parametrize(
    ("effect", "size", "over", "inside"),
    [
        ("cubic_phase_error", "{} deg", 22.6, 22.4),
        ("location_error", "{} m", 1.01, 0.99),
        ("islr", "{} dB", -19.9, -20.1),
    ],
)
def test_from_both_sides_of_the_limit(effect: str, size: str, over: float, inside: float) -> None:
    for value, status in ((over, "fail"), (inside, "warn")):
        other = {"name": "a", effect: size.format(value)}
        found = findings(requirements=NEEDS, other_errors=[other], allocation={"combine": "each"})
        assert row(found, f"other.a.{effect}").status == status
        assert {one.key: one.status for one in found.requirements}[effect] == status


def test_without_a_requirement_a_power_is_not_judged() -> None:
    """-30 dB are 0.03 rad, negligible; -15 dB are not. ISLR takes a cubic phase that nothing else takes."""
    small, large = (
        findings(other_errors=[{"name": "a", "islr": level, "quadratic_phase_error": 0}])
        for level in ("-30 dB", "-15 dB")
    )
    assert row(small, "other.a.islr").status == "info"
    assert row(large, "other.a.islr").status == "not_evaluated"
    cubic = [{"name": "a", "cubic_phase_error": "20 deg"}]
    found = row(findings(other_errors=cubic, requirements__islr="-20 dB"), "other.a.cubic_phase_error")
    assert found.binding_requirement == "islr"
    limit = math.sqrt(math.log1p(0.01 * 0.9028233335802807) * 175 / 4)
    assert found.allowable == pytest.approx(limit)
    assert row(findings(other_errors=cubic), "other.a.cubic_phase_error").status == "not_evaluated"


def test_without_a_quadratic_phase_there_is_no_row_of_it() -> None:
    found = findings(other_errors=[{"name": "a", "location_error": "1 cm"}], requirements__location_error="1 m")
    assert [one.id for one in found.rows if one.subject.kind == "other"] == ["other.a.location_error"]
    assert math.hypot(*row(found, "other.a.location_error").displacement_m) == pytest.approx(0.01)
    assert found.kinds.declared == ("other",)


def test_a_power_that_is_stated_is_of_no_share() -> None:
    """Rows of the platforms' shares stay away where nothing of theirs spreads."""
    ids = {one.id for one in findings(requirements=NEEDS, other_errors=[ELSEWHERE]).rows}
    assert "mission.islr" in ids
    assert not ids & {"transmitter.islr", "receiver.islr"}


# ---------------------------------------------------------------------- draws, questions, words
def test_draws_are_the_root_sum_square_of_the_rows() -> None:
    """A million draws know a sigma to 0.07 %; effects from elsewhere are bounds, of their size in every draw."""
    text = mission_text(
        propagation=AIR, requirements=NEEDS, other_errors=[ELSEWHERE], allocation__coverage_factor="2"
    )
    analysis = Analysis(parse_mission(text))
    drawn = {one.id: one for one in monte_carlo(analysis, 1_000_000, 7).requirements}
    airs = [one for one in analysis.random if one.subject.kind == "propagation" and one.declared]
    legs = [one for one in airs if not one.counted_in]
    moved = math.hypot(*(one.full.displacement * one.declared / 2 for one in legs), 0.1)
    phases = math.hypot(*(one.full.quadratic * one.declared / 2 for one in legs), math.radians(5))
    assert drawn["mission.location_error"].sigma == pytest.approx(moved, rel=2e-3)
    assert drawn["mission.quadratic_phase_error"].sigma == pytest.approx(phases, rel=2e-3)
    assert drawn["mission.cubic_phase_error"].sigma == pytest.approx(math.radians(1), rel=2e-3)


def test_a_displacement_from_elsewhere_always_has_its_length() -> None:
    text = mission_text(other_errors=[{"name": "a", "location_error": "10 cm"}], requirements__location_error="0.1 m")
    analysis = Analysis(parse_mission(text))
    (found,) = (one for one in monte_carlo(analysis, 10_000, 1).requirements if one.unit == "m")
    assert found.probability == 1.0
    text = text.replace("0.1 m", "0.0999 m")
    (found,) = (one for one in monte_carlo(Analysis(parse_mission(text)), 10_000, 1).requirements if one.unit == "m")
    assert found.probability == 0.0


ROWS = (DELAY, CONTENT, *(f"other.antenna.{one}" for one in ("cubic_phase_error", "location_error", "islr")))


@pytest.mark.parametrize(
    ("key", "values", "changes"),
    [
        ("propagation.zenith_delay", np.linspace(0.01, 0.5, 7), {}),
        ("propagation.zenith_electron_content", np.linspace(1e16, 40e16, 7), ORBITS),
        ("platforms.transmitter.position.2", np.linspace(1.2e3, 99e3, 9), {}),  # too low at first
        ("other_errors.0.location_error", np.linspace(0.0, 1.2, 7), {}),
        ("other_errors.0.islr", np.linspace(-45, -18, 7), {}),
        ("other_errors.0.cubic_phase_error", np.linspace(-0.5, 0.5, 7), {}),
    ],
)
def test_a_sweep_is_a_check_of_each(key: str, values: np.ndarray, changes: dict[str, object]) -> None:
    air = AIR | {"zenith_electron_content": "2 TECU"}
    rules = {"allocation__model": "full", "allocation__combine": "rss"}
    text = mission_text(**changes, **rules, propagation=air, requirements=NEEDS, other_errors=[ELSEWHERE])
    mission = parse_mission(text, "m.yaml")
    cases = grid(mission, **{key.replace(".", "__"): values})
    columns = [f"{row_id}.{field}" for row_id in ROWS for field in ("declared", "allowable", "utilization")]
    assert_as_checked(mission, cases, swept(mission, cases, columns), columns)


def test_questions_of_design(run: Callable, tmp_path: Path) -> None:
    """`solve` finds the allowable of a row, `sensitivity` knows the keys, `--scale` multiplies them."""
    needs = {"location_error": "0.5 m"}
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(propagation=AIR, requirements=needs))
    solved = json.loads(run("solve", str(file), "--for", "propagation.zenith_delay", "--format", "json").stdout)
    found = found_of(propagation=AIR, requirements=needs)
    least = row(found, "propagation.zenith_delay").allowable
    assert solved["missions"][0]["value"] == pytest.approx(least, rel=1e-4)
    scaled = json.loads(run("solve", str(file), "--for", "propagation", "--scale", "--format", "json").stdout)
    assert scaled["missions"][0]["value"] == pytest.approx(least / 0.05, rel=1e-4)
    assert "propagation.zenith_delay" in run("sensitivity", str(file)).stdout


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("needs", [NEEDS, {"islr": "-20 dB"}, {}])
@pytest.mark.parametrize("changes", [{}, ORBITS], ids=["flat", "orbits"])
def test_explanations_can_be_repeated(model: str, needs: dict[str, str], changes: dict[str, object]) -> None:
    """Each sum, done with the digits that stand there, gives what stands behind it; the last one what a row says."""
    air = AIR | {"zenith_electron_content": "2 TECU"}
    rules = {"model": model, "combine": "each", "coverage_factor": "2"}
    text = mission_text(**changes, propagation=air, requirements=needs, other_errors=[ELSEWHERE], allocation=rules)
    mission = parse_mission(text)
    found = check_mission(mission, TODAY)
    rows = [one for one in found.rows if one.subject.kind in ("propagation", "other") and one.declared is not None]
    assert len(rows) == 10
    for one in rows:
        lines = sums(explain(mission, found, one.id))
        for symbol, numbers, value in lines:
            if "..." not in numbers:
                assert evaluated(numbers) == pytest.approx(value, rel=2e-4, abs=1e-12), (one.id, symbol)
        said = {symbol: value for symbol, _, value in lines}
        if one.allowable is not None and one.unit != "rad":
            assert said["allowable"] == pytest.approx(one.allowable, rel=1e-5)


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("changes", [{}, ORBITS], ids=["flat", "orbits"])
def test_explanations_of_air_that_changes_can_be_repeated(model: str, changes: dict[str, object]) -> None:
    rules = {"model": model, "combine": "each", "coverage_factor": "2"}
    air = CHANGING | {"zenith_electron_content": "0.1 TECU"}
    mission = parse_mission(
        mission_text(**changes, propagation=air, requirements={"islr": "-20 dB"}, allocation=rules)
    )
    found = check_mission(mission, TODAY)
    for name in ("", "transmitter.", "receiver."):
        one = row(found, f"propagation.{name}zenith_delay")
        said = explain(mission, found, one.id)
        assert "a = T/(2*τ_c)" in said
        lines = sums(said)
        for symbol, numbers, value in lines:
            if "..." not in numbers:
                assert evaluated(numbers) == pytest.approx(value, rel=2e-4, abs=1e-12), (one.id, symbol)
        assert {symbol: value for symbol, _, value in lines}["allowable"] == pytest.approx(one.allowable, rel=1e-5)


@pytest.mark.parametrize("suffix", ["html", "md", "json", "csv", "xml", "sarif"])
def test_every_format_has_the_rows(run: Callable, tmp_path: Path, suffix: str) -> None:
    file, report = tmp_path / "m.yaml", tmp_path / f"report.{suffix}"
    rules = {"model": "full", "combine": "rss"}
    file.write_text(mission_text(propagation=AIR, requirements=NEEDS, other_errors=[ELSEWHERE], allocation=rules))
    assert run("check", str(file), "-q", "--detail", "full", "--report", str(report)).exit_code == 0
    text = report.read_text()
    if suffix != "sarif":  # of what passes there is no result
        assert DELAY in text
        assert "other.antenna.islr" in text
    if suffix == "html":
        assert "Delays in the air" in text
        assert "weather model" in text


def test_what_is_left_out_is_looser(run: Callable, tmp_path: Path) -> None:
    """Each row that a change takes away is named, those of effects from elsewhere and of the air among them."""
    changes = {"requirements": NEEDS, "platforms__receiver__motion_error__velocity": "1 mm/s"}
    files = {
        "old": {"propagation": AIR, "other_errors": [ELSEWHERE]},
        "new": {"other_errors": [{"name": "b", "islr": "-40 dB"}]},
    }
    for name, errors in files.items():
        (tmp_path / f"{name}.yaml").write_text(mission_text(**changes, **errors))
    found = run("diff", "--fail-on-erosion", "10%", *(str(tmp_path / f"{name}.yaml") for name in files))
    assert found.exit_code == 1
    refused = found.stdout.partition("Refused")[2]
    gone = ["", ".cubic_phase_error", ".location_error", ".islr"]
    for row_id in (*(f"other.antenna{one}" for one in gone), "propagation.zenith_delay"):
        assert f"{row_id}: declared -> not declared" in refused
    assert "propagation.source" not in refused  # there is nothing left to have one


def test_a_leg_along_the_ground_has_no_allowable() -> None:
    """Nothing is stated of it: neither of a receiver on the ground, nor of one that is seen at 2 degrees."""
    for height in ("0 m", "300 m"):
        receiver = {"position": ["6 km", "6 km", height], "velocity": ["-40 m/s", "40 m/s", 0]}
        found = findings(platforms__receiver=receiver, propagation={"zenith_electron_content": "1 TECU"})
        one = row(found, "propagation.receiver.zenith_delay")
        assert (one.status, one.allowable) == ("not_declared", None)
        assert (
            one.reason
            == "the leg of the receiver runs along the ground: the delay at the zenith does not give its delay"
        )
