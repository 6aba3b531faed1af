"""Specifications that hold together: what a sheet says, and that it is true of whole checks."""

import math
from datetime import date

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bisar_budget as bb
from bisar_budget.budget.check import check_mission
from bisar_budget.faults import SetValue
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError, number_of, tree_of
from bisar_budget.questions.allocate import SpecificationSheet
from bisar_budget.questions.row_uses import SpecifiedMission
from bisar_budget.questions.specified import Specified, catalogue, specified_errors, suitable_parts, usual_keys
from bisar_budget.questions.table import Variation
from tests.conftest import ROOT, UAV_FREE_RUNNING, mission_text
from tests.families import mission_text as of_family

DAY = date(2026, 11, 25)
RSS = {"allocation__combine": "rss", "allocation__model": "full"}


def family(name: str, seed: int, rule: str) -> Mission:
    return parse_mission(of_family(name, seed), "m.yaml", changes=[SetValue("allocation.combine", rule)])


def mission(**changes: object) -> Mission:
    return parse_mission(mission_text(**(RSS | changes)), "m.yaml")


def checked(given: Mission, sheet: SpecificationSheet, factors: dict[str, float] | None = None) -> MissionFindings:
    """The check of a mission with the sizes as found, each times a factor, and without its waivers."""
    changes = list(sheet.ordered[: len(sheet.ordered) - sum(bool(one.text) for one in sheet.specifications)])
    for one in sheet.specifications:
        if one.value is not None:
            value = one.value * (factors or {}).get(one.key, 1.0)
            changes.append(SetValue(one.key, f"{value!r} {one.unit}".rstrip()))
    return check_mission(Variation(given, None).read(changes)._replace(waivers=()), DAY)


# Families and seeds whose other errors leave room, of both rules; an image that ends, and one at the scene's edge.
HELD = [
    ("drones", 1, "sum"),
    ("aircraft", 1, "rss"),
    ("jets", 0, "sum"),
    ("satellite_fixed", 4, "rss"),
    ("geostationary_drone", 20, "sum"),
    ("satellite_aircraft", 29, "rss"),
    ("satellite_fixed", 20, "sum"),
]


# Half a minute for a sheet of all its errors: of three errors both tests take one sheet, of all in a thorough run.
SLOW = ("geostationary_drone", 20, "sum")
APART = [pytest.param(*one, marks=pytest.mark.thorough if one == SLOW else ()) for one in HELD]


@pytest.mark.parametrize(("name", "seed", "rule"), APART)
def test_all_together_meet_every_requirement_and_none_can_grow(name: str, seed: int, rule: str) -> None:
    """Without a reserve: the check passes, each is limited by a row that is full, and 5 % more of any breaks it."""
    given = family(name, seed, rule)
    assert_full(given, bb.allocate(given, reserve=0.0, date=DAY).found)


@pytest.mark.parametrize(("name", "seed", "rule"), APART)
def test_what_rows_are_worth_divides_them_by_the_weights(name: str, seed: int, rule: str) -> None:
    """Σ multiplier·share over the rows is the weight of each, also where several rows limit it."""
    given = family(name, seed, rule)
    assert_divided(bb.allocate(given, keys=by_turns(given), reserve=0.1, date=DAY).found)


def test_a_sheet_by_weights_without_a_reserve_is_full_and_divided() -> None:
    """The end of an image limits one of the three, with a scene's edge beside it."""
    given = family(*SLOW)
    of = ("transmitter.motion_error.position", "receiver.motion_error.velocity", "timing_error.quadratic")
    weights = {key: weight for key, weight in by_turns(given).items() if key.endswith(of)}
    assert len(weights) == len(of)
    sheet = bb.allocate(given, keys=weights, reserve=0.0, date=DAY).found
    assert any(row.id.startswith("end_of_image.") and row.multiplier > 1e-3 for row in sheet.rows)
    assert_full(given, sheet)
    assert_divided(sheet)


def by_turns(given: Mission) -> dict[str, float]:
    """Weights 1, 2, 3, 1 … of the usual keys."""
    return {key: 1.0 + place % 3 for place, key in enumerate(usual_keys(given))}


def assert_full(given: Mission, sheet: SpecificationSheet) -> None:
    """The check passes, each error is limited by a row that is full, and 5 % more of any breaks a requirement."""
    assert checked(given, sheet).status not in ("fail", "not_evaluated")
    for one in sheet.specifications:
        if one.value is None:
            continue
        assert max(row.used / row.allowed for row in sheet.rows if row.shares.get(one.key, 0) > 1e-4) > 0.999
        assert checked(given, sheet, {one.key: 1.05}).status in ("fail", "not_evaluated"), one.key


def assert_divided(sheet: SpecificationSheet) -> None:
    for one in sheet.specifications:
        if one.value is not None:
            worth = sum(row.multiplier * row.shares.get(one.key, 0.0) for row in sheet.rows)
            assert worth == pytest.approx(one.weight, rel=0.03)


def test_equal_weights_give_equal_shares_where_one_requirement_limits_all() -> None:
    sheet = bb.allocate(mission(), keys=dict.fromkeys(RECEIVER, 1.0), date=DAY).found
    shares = [one.shares["quadratic_phase_error"] for one in sheet.specifications]
    fixed = next(row.fixed for row in sheet.rows if row.id == "receiver.quadratic_phase_error")
    assert shares == pytest.approx([(1 - fixed) / 3] * 3, rel=1e-3)


RECEIVER = [f"platforms.receiver.motion_error.{kind}" for kind in ("velocity", "acceleration")] + [
    "timing_error.quadratic"
]


def test_weights_are_shares() -> None:
    sheet = bb.allocate(mission(), keys=dict(zip(RECEIVER, (1.0, 2.0, 5.0), strict=True)), date=DAY).found
    shares = [one.shares["quadratic_phase_error"] for one in sheet.specifications]
    assert np.array(shares) / shares[0] == pytest.approx([1, 2, 5], rel=1e-3)


def test_a_reserve_is_what_warnings_leave_and_a_sheet_passes_without_one() -> None:
    sheet = bb.allocate(mission(), date=DAY).found
    assert sheet.reserve == pytest.approx(0.2)
    assert sheet.status == "pass"
    assert max(one.utilization or 0.0 for one in sheet.requirements) <= 0.8


@pytest.mark.parametrize("rule", ["rss", "sum"])
@pytest.mark.parametrize("kind", ["acceleration", "imu.accelerometer_bias"])
def test_the_edge_of_the_scene_is_held_without_a_reserve_too(kind: str, rule: str) -> None:
    """With much autofocus one correction for the whole scene limits the order: 5 % more of it fails."""
    given = mission(
        allocation__combine=rule,
        autofocus={"algorithm": "pga", "n_pull": 33},
        scene={"radius": 1000},
        requirements__cubic_phase_error="90 deg",
        platforms__transmitter__motion_error={},
    )
    key = f"platforms.receiver.motion_error.{kind}"
    sheet = bb.allocate(given, keys={key: 1.0}, reserve=0.0, date=DAY).found
    assert sheet.status == "warn"
    (limit,) = (one.id for one in sheet.rows if one.multiplier > 0.5)
    assert limit == "mission.spatial_variance"
    failing = checked(given, sheet, {key: 1.05})
    assert [one.id for one in failing.rows if one.status == "fail"] == [limit]


def test_the_mission_is_checked_with_what_is_ordered() -> None:
    given = mission()
    sheet = bb.allocate(given, date=DAY).found
    found = check_mission(Variation(given, None).read(sheet.ordered), DAY)
    assert (found.status, found.requirements) == (sheet.status, sheet.requirements)


def test_an_error_that_nothing_limits_is_free() -> None:
    """By the published model a constant clock error has no phase, and nothing requires a location."""
    given = mission(allocation__model="published")
    (one,) = bb.allocate(given, keys={"timing_error.constant": 1.0}, date=DAY).found.specifications
    assert (one.value, one.ordered, one.text, dict(one.shares)) == (None, None, "", {})


def test_other_errors_that_leave_no_room_are_named_with_what_they_use() -> None:
    given = mission(other_errors=[{"name": "antenna", "quadratic_phase_error": "50 deg"}])
    sheet = bb.allocate(given, date=DAY).found
    (broken,) = sheet.broken
    assert (broken.id, broken.requirement) == ("mission.quadratic_phase_error", "quadratic_phase_error")
    assert broken.used == pytest.approx(50 / 45)
    assert not sheet.complies
    assert all(one.value is None for one in sheet.specifications)


def test_a_reserve_that_other_errors_have_used_is_no_room_either() -> None:
    given = mission(other_errors=[{"name": "antenna", "quadratic_phase_error": "40 deg"}])
    assert [one.id for one in bb.allocate(given, date=DAY).found.broken] == ["mission.quadratic_phase_error"]
    assert not bb.allocate(given, reserve=0.05, date=DAY).found.broken


def test_an_effect_that_no_requirement_takes_stays_negligible() -> None:
    """Without a requirement of the cubic phase a velocity that passes by its quadratic phase would not be judged."""
    given = mission(collection__aperture_time="12 s")
    sheet = bb.allocate(given, keys={"timing_error.cubic": 1.0}, date=DAY).found
    (row,) = [row for row in sheet.rows if row.multiplier > 1e-3]
    assert (row.id, row.requirement) == ("negligible.cubic", None)
    assert sheet.status == "pass"


def test_each_error_alone_needs_no_sheet() -> None:
    given = mission(allocation__combine="each")
    with pytest.raises(
        QuestionError, match=r"the allowables of the single errors are the answer: .*receiver\.motion_error\.velocity"
    ):
        bb.allocate(given, date=DAY)


def test_balanced_shares_are_taken_as_equal_and_it_is_said() -> None:
    given = mission(allocation__split="balanced")
    sheet = bb.allocate(given, date=DAY).found
    equal = bb.allocate(mission(), date=DAY).found
    assert [one.value for one in sheet.specifications] == pytest.approx([one.value for one in equal.specifications])
    assert "taken as equal" in sheet.notes[0]
    assert sheet.ordered[0] == SetValue("allocation.split", "equal")


def test_waivers_do_not_count() -> None:
    waiver = {"id": "*", "until": "2030-01-01", "reason": "all"}
    given = mission(other_errors=[{"name": "a", "quadratic_phase_error": "50 deg"}], waivers=[waiver])
    sheet = bb.allocate(given, date=DAY).found
    assert sheet.broken
    assert "waivers do not count" in sheet.notes[0]


def test_a_covariance_is_fixed() -> None:
    error = {"covariance": {"position": "1 cm", "velocity": "0.1 mm/s"}}
    given = mission(platforms__receiver__motion_error=error)
    keys = list(usual_keys(given))
    assert "platforms.receiver.motion_error.velocity" not in keys
    assert "platforms.receiver.motion_error.acceleration" in keys
    with pytest.raises(QuestionError, match="has a covariance of receiver, which is fixed"):
        specified_errors(given, tree_of(given), {"platforms.receiver.motion_error.velocity": 1.0})


def test_a_still_platform_has_its_position_only() -> None:
    given = load_mission(str(ROOT / "specs" / "missions" / "holdover_roof_receiver.yaml"))
    receiver = [key for key in usual_keys(given) if "receiver.motion_error" in key]
    assert receiver == ["platforms.receiver.motion_error.position"]


@pytest.mark.parametrize(
    ("key", "why"),
    [
        ("radar.bandwidth", "is no error that can be specified"),
        ("synchronization.age", "is no error that can be specified"),
        ("platforms.receiver.motion_error", "is a section"),
        ("platforms.receiver.motion_error.velocty", "Did you mean 'platforms.receiver.motion_error.velocity'"),
    ],
)
def test_a_key_that_is_no_error_is_refused(key: str, why: str) -> None:
    with pytest.raises(QuestionError, match=why):
        bb.allocate(mission(), keys={key: 1.0}, date=DAY)


def test_a_level_and_what_it_shifts_are_not_specified_together() -> None:
    """Only their product is limited: it ordered 5e-17 of the one and -62 dB of the other."""
    given = load_mission(str(ROOT / "specs" / "missions" / "holdover_roof_receiver.yaml"))
    keys = ["platforms.receiver.oscillator.level", "platforms.receiver.oscillator.power_law.h-2"]
    with pytest.raises(QuestionError, match=r"level multiplies platforms\.receiver\.oscillator\.power_law\.h-2"):
        bb.allocate(given, keys=dict.fromkeys(keys, 1.0), date=DAY)


def test_an_error_that_is_limited_only_where_it_is_large_is_not_free() -> None:
    """A constant clock error displaces, and has no phase until it is large: it was free, and 100 us failed."""
    given = mission()
    sheet = bb.allocate(given, keys={"timing_error.constant": 1.0}, reserve=0.0, date=DAY).found
    (one,) = sheet.specifications
    assert one.value is not None
    assert checked(given, sheet, {one.key: 1.05}).status in ("fail", "not_evaluated")


def test_a_size_ends_at_what_a_mission_file_may_state() -> None:
    """6.6 km of a lever arm ended in a crash: the file takes up to 1 km."""
    error = {"lever_arm": {"arm": ["1 m", 0, 0], "uncertainty": "1 mm"}, "imu": {"attitude": "0.001 deg"}}
    given = mission(platforms__receiver__motion_error=error, collection__aperture_time="0.05 s")
    key = "platforms.receiver.motion_error.lever_arm.uncertainty"
    (one,) = bb.allocate(given, keys={key: 1.0}, date=DAY).found.specifications
    assert one.ordered is None or one.ordered <= 1000


def test_an_error_and_an_axis_of_it_are_one() -> None:
    error = {"velocity": ["1 mm/s", "1 mm/s", "1 mm/s"]}
    keys = ["platforms.receiver.motion_error.velocity", "platforms.receiver.motion_error.velocity.1"]
    with pytest.raises(QuestionError, match="is specified twice"):
        bb.allocate(mission(platforms__receiver__motion_error=error), keys=dict.fromkeys(keys, 1.0), date=DAY)


def test_a_part_keeps_to_an_order_by_its_largest_figure() -> None:
    given = load_mission(str(UAV_FREE_RUNNING))
    key = "platforms.receiver.motion_error.imu.gyro_bias"
    (one,) = bb.allocate(given, keys={key: 1.0}, reserve=0.0, date=DAY).found.specifications
    assert one.ordered is not None
    assert ("stim300" in one.parts) == (one.ordered >= math.radians(0.3) / 3600)


def test_a_satellite_is_offered_no_receiver_of_a_drone() -> None:
    """Boards for drones keep to the metres of the order on the ground alone; products of orbits keep to them."""
    satellite = load_mission(str(ROOT / "specs" / "missions" / "holdover_roof_receiver.yaml"))
    key = "platforms.transmitter.motion_error.position"
    (one,) = bb.allocate(satellite, keys={key: 1.0}, date=DAY).found.specifications
    assert "sentinel-1-poeorb" in one.parts
    assert not {"um980-rtk", "zed-x20p-rtk", "mosaic-x5-rtk"} & set(one.parts)


def test_an_aircraft_is_offered_receivers_of_the_air() -> None:
    aircraft = mission(platforms__receiver__motion_error={"position": "1 m"}, requirements={"location_error": "10 m"})
    key = "platforms.receiver.motion_error.position"
    (one,) = bb.allocate(aircraft, keys={key: 1.0}, date=DAY).found.specifications
    assert {"um980-rtk", "zed-x20p-rtk", "mosaic-x5-rtk"} <= set(one.parts)


def test_an_oscillator_keeps_to_a_level_where_its_noise_is_nowhere_above_the_spectrum() -> None:
    """The BVA oscillator has a flicker floor of 8e-14: h₋₁ = σ²/(2·ln 2)."""
    file = mission(platforms__receiver__oscillator={"power_law": {"h-1": 1e-25}})
    of = SpecifiedMission(file, {"platforms.receiver.oscillator.level": 1.0}, 0.0, None, DAY)
    floor = 10 * math.log10((8e-14) ** 2 / (2 * math.log(2)) / 1e-25)
    (one,), among = of.specified, catalogue(of.stated)
    assert "bva" in suitable_parts(of.stated, one, floor + 0.01, among)
    assert "bva" not in suitable_parts(of.stated, one, floor - 0.01, among)


def test_an_oscillator_that_says_nothing_of_some_offsets_keeps_to_none() -> None:
    """Its Allan deviation tells noise up to 1 kHz; the mask goes on."""
    for last, is_told in (("900 Hz", True), ("10 kHz", False)):
        mask = {"frequency": "10 MHz", "phase_noise": {"1 Hz": "-60 dBc/Hz", last: "-60 dBc/Hz"}}
        file = mission(platforms__receiver__oscillator=mask)
        of = SpecifiedMission(file, {"platforms.receiver.oscillator.level": 1.0}, 0.0, None, DAY)
        (one,) = of.specified
        assert ("bva" in suitable_parts(of.stated, one, 0.0, catalogue(of.stated))) == is_told


@given(
    value=st.floats(1e-9, 1e6),
    key=st.sampled_from(["position", "velocity", "acceleration", "imu.gyro_bias", "imu.attitude", "time_tag"]),
)
@settings(deadline=None)
def test_what_is_ordered_is_rounded_down_to_two_digits_and_is_read_again(value: float, key: str) -> None:
    given = mission()
    number = number_of(tree_of(given), f"platforms.transmitter.motion_error.{key}", is_for_each=True)
    ordered, text = Specified(number, 1.0).ordered(value)
    assert 0.9 * value < ordered <= value * (1 + 1e-9)
    assert len(text.split()[0].replace(".", "").strip("0").partition("e")[0]) <= 2
    assert number.read(text) == ordered


def test_a_level_is_rounded_to_the_stricter_side() -> None:
    given = load_mission(str(ROOT / "specs" / "missions" / "holdover_roof_receiver.yaml"))
    number = number_of(tree_of(given), "platforms.receiver.oscillator.level")
    one = Specified(number, 1.0)
    assert [one.ordered(value)[1] for value in (-12.34, -5.99, 3.49, 0.0)] == ["-13 dB", "-6 dB", "3.4 dB", "0 dB"]


@pytest.mark.parametrize("file", sorted((ROOT / "specs" / "missions").glob("*.yaml")), ids=lambda file: file.stem)
def test_every_example_has_a_sheet_that_its_check_passes(file) -> None:
    """The examples of both rules, those that hold each error alone by root-sum-square."""
    given = load_mission(str(file))
    if given.allocation.combine == "each":
        given = Variation(given, None).read([SetValue("allocation.combine", "rss")])
    sheet = bb.allocate(given, reserve=0.0, date=DAY).found
    if not sheet.broken:  # elements of two days ago are further off than the position error that is allowed
        reasons = [str(one.reason) for one in sheet.requirements if one.status == "not_evaluated"]
        assert sheet.complies or all("the path may be" in reason for reason in reasons), reasons


POSITION = "platforms.transmitter.motion_error.position"
BIAS = {"bias": ["0 m", "0 m", "40 cm"]}


def biased(**sigma: str) -> Mission:
    """A mission whose transmitter has a bias of position, beside a sigma or alone."""
    return mission(requirements__location_error="20 m", platforms__transmitter__motion_error__position=sigma | BIAS)


@pytest.mark.parametrize("keys", [None, POSITION, f"{POSITION}.sigma"])
def test_beside_a_bias_the_sigma_is_specified_and_the_bias_is_kept(keys: str | None) -> None:
    sheet = bb.allocate(biased(sigma="50 cm"), keys, date=DAY).found
    first = sheet.specifications[0]
    assert (first.key, first.declared) == (f"{POSITION}.sigma", 0.5)
    assert sheet.complies
    assert sheet.findings is not None
    assert sheet.findings.mission is not None
    error = sheet.findings.mission.platforms.transmitter.motion_error
    assert (error.position, error.bias_of("position")) == ((first.ordered,) * 3, (0.0, 0.0, 0.4))


def test_a_bias_without_a_sigma_is_not_specified_by_default() -> None:
    usual = list(usual_keys(biased()))
    assert POSITION not in usual
    assert usual == [key for key in usual_keys(biased(sigma="50 cm")) if key != POSITION]
    clock = "timing_error.quadratic"
    assert clock in list(usual_keys(mission(timing_error={"quadratic": {"sigma": "1e-12 1/s", "bias": "1e-12 1/s"}})))
    assert clock not in list(usual_keys(mission(timing_error={"quadratic": {"bias": "1e-12 1/s"}})))


def test_a_bias_alone_that_is_named_gets_a_sigma_beside_it() -> None:
    (one,) = bb.allocate(biased(), POSITION, date=DAY).found.specifications
    assert (one.key, one.declared) == (f"{POSITION}.sigma", None)
    assert one.value is not None


def test_the_sigma_beside_a_bias_is_specified_once() -> None:
    with pytest.raises(QuestionError, match="is specified twice"):
        bb.allocate(biased(sigma="50 cm"), [POSITION, f"{POSITION}.sigma"], date=DAY)


def test_parts_and_single_allowables_are_found_for_a_sigma_too() -> None:
    """Both take the kind of error from the key, which ends in `sigma` beside a bias."""
    (one,) = bb.allocate(biased(sigma="50 cm"), POSITION, date=DAY).found.specifications
    (alone,) = bb.allocate(mission(requirements__location_error="20 m"), POSITION, date=DAY).found.specifications
    assert set(one.parts) & set(alone.parts)
    given = biased(sigma="50 cm")
    each = parse_mission(given.data, "m.yaml", changes=[SetValue("allocation.combine", "each")])
    with pytest.raises(QuestionError, match=rf"are the answer: {POSITION}\.sigma \d+ cm"):
        bb.allocate(each, POSITION, date=DAY)


@pytest.mark.parametrize("size", ["50 cm", {"sigma": "50 cm"} | BIAS])
def test_an_offer_may_state_the_size_in_either_form(size: object) -> None:
    offer = mission(requirements__location_error="20 m", platforms__transmitter__motion_error__position=size)
    for ordered in (biased(sigma="1 m"), mission(requirements__location_error="20 m")):
        compared = bb.allocate(ordered, POSITION, offer=offer, date=DAY).offer
        assert compared is not None
        (figure,) = compared.figures
        assert (figure.value, figure.is_inside) == (0.5, True)
