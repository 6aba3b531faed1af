"""A gate refuses an error that does less to the image than before, unless its part or its source changed by name."""

import copy
import math
import re
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.budget.check import check_mission
from bisar_budget.effects.effect import MOTION
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.report.change.comparison import Gate, compare
from bisar_budget.report.change.names import plain, plain_file
from tests.conftest import TODAY, examples, findings
from tests.conftest import mission_text as base_text
from tests.families import FAMILIES, mission_text
from tests.fuzz import _with_instruments, places, tree_of
from tests.yaml_text import yaml_text

TX, RX = "platforms__transmitter", "platforms__receiver"
MASK = {"1 Hz": "-80 dBc/Hz", "10 Hz": "-110 dBc/Hz", "1 kHz": "-140 dBc/Hz"}
BAND = {"50 Hz": "1e-5 g^2/Hz", "1 kHz": "1e-5 g^2/Hz"}
QUARTZ = {"frequency": "10 MHz", "phase_noise": MASK, "source": "sheet, rev. C"}
DESIGN: dict[str, Any] = {
    f"{TX}__motion_error": {"position": "1 cm", "velocity": "1 mm/s", "source": "sheet, rev. C"},
    f"{RX}__motion_error": {
        "position": "1 cm",
        "velocity": ["1 mm/s", "2 mm/s", "1 mm/s"],
        "imu": {"attitude": "0.05 deg", "accelerometer_bias": "30 ug", "source": "sheet of the unit"},
        "lever_arm": {"arm": ["2 m", 0, "-0.5 m"], "uncertainty": "2 mm", "source": "survey"},
        "random": [{"name": "GNSS", "sigma": "1 mm", "correlation_time": "3 s", "source": "sheet of the receiver"}],
        "vibration": {
            "sinusoidal": [
                {"amplitude": "10 um", "frequency": "20 Hz"},
                {"amplitude": "20 um", "frequency": "45 Hz"},
            ],
            "spectrum": {"20 Hz": "1e-5 g^2/Hz", "1 kHz": "1e-5 g^2/Hz"},
        },
        "source": "sheet, rev. C",
    },
    f"{TX}__oscillator": QUARTZ,
    f"{RX}__oscillator": {**QUARTZ, "spurs": {"50 Hz": "-100 dBc"}},
    "synchronization": {"interval": "0.1 s", "error": "2 deg", "source": "link budget"},
    "propagation": {"zenith_delay": "1 cm", "source": "model"},
    "scene__height_error": "10 cm",
    "timing_error": {"quadratic": "1e-15 1/s"},
    "requirements": {
        "quadratic_phase_error": "45 deg",
        "cubic_phase_error": "20 deg",
        "location_error": "10 m",
        "islr": "-15 dB",
        "pslr": "-15 dB",
    },
    "allocation": {"combine": "rss", "model": "full"},
}
ERROR = f"{RX}__motion_error"


def at(*changes: tuple[str, object]) -> dict[str, Any]:
    """The design with values at paths; None takes a key away."""
    design = copy.deepcopy(DESIGN)
    for path, value in changes:
        *above, last = path.split("/")
        inner: Any = design
        for key in above:
            inner = inner[int(key)] if isinstance(inner, list) else inner[key]
        last_key: Any = int(last) if isinstance(inner, list) else last
        if value is None:
            del inner[last_key]
        else:
            inner[last_key] = value
    return design


def refused(*changes: tuple[str, object]) -> set[str]:
    """Ids that a gate refuses which lets any erosion through."""
    return {one.id for one in compare(findings(**DESIGN), findings(**at(*changes))).refusals(Gate(1.0))}


@pytest.mark.parametrize(
    ("path", "value", "row"),
    [
        (f"{ERROR}/lever_arm", None, "receiver.lever_arm.attitude"),
        (f"{ERROR}/lever_arm/arm", [0, 0, 0], "receiver.lever_arm.attitude"),
        (f"{ERROR}/lever_arm/arm", ["1 m", 0, "-0.5 m"], "receiver.lever_arm.attitude"),
        (f"{ERROR}/lever_arm/uncertainty", "1 mm", "receiver.lever_arm.uncertainty"),
        (f"{ERROR}/imu/attitude", "0.04 deg", "receiver.imu.attitude"),
        (f"{ERROR}/velocity", ["1 mm/s", "1.9 mm/s", "1 mm/s"], "receiver.velocity.y"),
        (f"{ERROR}/random/0/correlation_time", "300 s", "receiver.random.GNSS"),
        (f"{ERROR}/random/0/sigma", "0.9 mm", "receiver.random.GNSS"),
        (f"{ERROR}/vibration/sinusoidal/1/frequency", "0.01 Hz", "receiver.vibration.sinusoidal.1"),
        (f"{ERROR}/vibration/sinusoidal/1/amplitude", "15 um", "receiver.vibration.sinusoidal.1"),
        (f"{ERROR}/vibration/sinusoidal/0", None, "receiver.vibration.sinusoidal.0"),
        (f"{ERROR}/vibration/spectrum_level", "-3 dB", "receiver.vibration.spectrum"),
        (f"{ERROR}/vibration/spectrum", BAND, "receiver.vibration.spectrum"),
        (f"{RX}__oscillator", None, "receiver.oscillator"),
        (f"{RX}__oscillator/level", "-20 dB", "receiver.oscillator"),
        (f"{RX}__oscillator/phase_noise/10 Hz", "-120 dBc/Hz", "receiver.oscillator"),
        (f"{RX}__oscillator/bandwidth", "10 Hz", "receiver.oscillator"),
        (f"{RX}__oscillator/spurs/50 Hz", "-110 dBc", "receiver.oscillator.spur.0"),
        ("synchronization/error", "1 deg", "timing.synchronization"),
        ("synchronization/interval", "0.01 s", "receiver.oscillator"),
        ("propagation/zenith_delay", "0.5 cm", "propagation.receiver.zenith_delay"),
        ("scene__height_error", "5 cm", "mission.terrain"),
        ("timing_error/quadratic", "9e-16 1/s", "timing.quadratic"),
        ("simulation", {"window": "taylor"}, "receiver.oscillator"),
        (f"{ERROR}/distribution", "uniform", "platforms.receiver.motion_error.distribution"),
    ],
)  # fmt: skip
def test_less_of_the_same_is_refused(path: str, value: object, row: str) -> None:
    assert row in refused((path, value))


@pytest.mark.parametrize("value", [None, "2 h"])
def test_air_that_changes_more_slowly_is_refused(value: str | None) -> None:
    """Or that does not change any more. One that changes faster does more, and one of another source is another."""
    air = {"zenith_delay": "1 cm", "correlation_time": "20 min", "source": "model"}
    before = findings(**at(("propagation", air)))

    def refusals(**changes: object) -> set[str]:
        after = {key: stated for key, stated in (air | changes).items() if stated is not None}
        return {one.id for one in compare(before, findings(**at(("propagation", after)))).refusals(Gate(1.0))}

    assert "propagation.zenith_delay" in refusals(correlation_time=value)
    assert "propagation.zenith_delay" not in refusals(correlation_time="10 min")
    assert "propagation.zenith_delay" not in refusals(correlation_time=value, source="another model")


@pytest.mark.parametrize(
    ("path", "value", "row"),
    [
        (f"{ERROR}/lever_arm", None, "receiver.lever_arm.attitude"),
        (f"{ERROR}/velocity", ["1 mm/s", "1.9 mm/s", "1 mm/s"], "receiver.velocity.y"),
        (f"{RX}__oscillator/level", "-20 dB", "receiver.oscillator"),
    ],
)
@pytest.mark.parametrize(
    "beside",
    [
        (f"{TX}__position", ["30.1 km", 0, "6 km"]),
        ("collection__aperture_time", "6.1 s"),
        ("radar__bandwidth", "310 MHz"),
        ("requirements/quadratic_phase_error", "40 deg"),
        ("allocation/coverage_factor", 2),
        ("allocation/split", "balanced"),
        (f"{TX}__motion_error/velocity", "2 mm/s"),
        ("name", "another"),
    ],
)
def test_another_change_hides_no_fall(path: str, value: object, row: str, beside: tuple[str, object]) -> None:
    """The later errors are held to the earlier geometry, waveform, aperture and rules."""
    assert row in refused((path, value), beside)


@pytest.mark.parametrize(
    "changes",
    [
        [(f"{TX}__position", ["60 km", 0, "12 km"])],
        [(f"{RX}__velocity", ["-20 m/s", "20 m/s", 0])],
        [("collection__aperture_time", "4 s")],
        [("radar__center_frequency", "5 GHz")],
        [("requirements/location_error", "9 m")],
        [("requirements/quadratic_phase_error", "40 deg")],
        [("allocation/coverage_factor", 1.01)],
        [("allocation/model", "strictest")],
        [(f"{ERROR}/velocity", "3 mm/s")],
        [("propagation/zenith_delay", "2 cm")],
        [(f"{ERROR}/velocity", "0.5 mm/s"), (f"{ERROR}/source", "sheet, rev. D")],
        [(f"{ERROR}/random/0/sigma", "0.5 mm"), (f"{ERROR}/random/0/source", "sheet of another receiver")],
        [(f"{RX}__oscillator/level", "-6 dB"), (f"{RX}__oscillator/source", "measured, report 7")],
        [(f"{RX}__oscillator", {"sensor": "wenzel-5mhz", "spurs": {"50 Hz": "-100 dBc"}})],
        [("synchronization/error", "1 deg"), ("synchronization/source", "link budget, issue 2")],
        [
            (
                f"{ERROR}/vibration/sinusoidal",
                [{"amplitude": "20 um", "frequency": "45 Hz"}, {"amplitude": "10 um", "frequency": "20 Hz"}],
            )
        ],
        [(f"{ERROR}/position", "10 mm")],
        [("scene__radius", "100 m")],
        [("document", {"issue": "2"})],
    ],
)
def test_a_sound_change_is_not_refused(changes: list[tuple[str, object]]) -> None:
    assert refused(*changes) == set()


def test_a_source_that_changed_covers_its_own_errors_alone() -> None:
    changes = [(f"{ERROR}/source", "sheet, rev. D"), (f"{ERROR}/imu/attitude", "0.01 deg")]
    assert refused(*changes) >= {"receiver.imu.attitude"}


def test_a_fall_is_said_with_both_uses() -> None:
    before, after = findings(**DESIGN), findings(**at((f"{ERROR}/lever_arm/arm", [0, 0, 0])))
    words = {one.id: one.words for one in compare(before, after).refusals(Gate(1.0))}
    said = r"uses [\d.]+ % of its limit -> 0 %, with the same part and source"
    assert re.fullmatch(said, words["receiver.lever_arm.attitude"])
    slightly = findings(**at(("propagation/zenith_delay", "0.9999999 cm")))
    assert not compare(before, slightly).loosened  # what rounding makes
    slightly = findings(**at(("propagation/zenith_delay", "0.9999 cm")))
    old, new = compare(before, slightly).loosened[0].words.split(" -> ")
    assert old.split()[1] != new.split()[0]


# ---------------------------------------------------------------------- the same collection, written another way
PLACE = [("scene__latitude", "48 deg"), ("scene__longitude", "11 deg"), ("scene__height", 0)]
SLOWER: tuple[str, object] = (f"{ERROR}/velocity", ["1 mm/s", "1.9 mm/s", "1 mm/s"])


def gated(before: MissionFindings, after: MissionFindings) -> set[str]:
    return {one.id for one in compare(before, after).refusals(Gate(1.0))}


@pytest.mark.parametrize("frame", ["scene", "ric"])
def test_a_place_on_the_earth_hides_no_fall(frame: str) -> None:
    """Nor do `ric` axes, which need one. The place alone is no fall, added or taken away."""
    common = ("common_motion_error", {"frame": frame, "position": "1 mm", "source": "service"})
    added = findings(**at(*PLACE, common))
    assert gated(findings(**DESIGN), added) == set()
    assert gated(findings(**DESIGN), findings(**at(*PLACE, common, SLOWER))) == {"receiver.velocity.y"}
    assert "receiver.velocity.y" in gated(added, findings(**at(SLOWER)))
    assert gated(findings(**at(*PLACE)), findings(**DESIGN)) == set()


def test_errors_along_ric_axes_are_compared_before_there_was_a_place() -> None:
    ric = [*PLACE, (f"{TX}__motion_error/frame", "ric")]
    assert gated(findings(**DESIGN), findings(**at(*ric))) == set()  # the same sizes along every axis
    smaller = findings(**at(*ric, (f"{TX}__motion_error/velocity", "0.1 mm/s")))
    assert {"transmitter.velocity.x", "transmitter.velocity.y"} <= gated(findings(**DESIGN), smaller)


def _geodetic(**changes: str) -> MissionFindings:
    """The design with a receiver by its geodetic place, near the one of before."""
    tree = tree_of(base_text(**at(*PLACE)))
    receiver = tree["platforms"]["receiver"]
    kept = {"motion_error": receiver["motion_error"], "oscillator": receiver["oscillator"]}
    tree["platforms"]["receiver"] = {
        "latitude": "48.05 deg",
        "longitude": "11.08 deg",
        "altitude": "2 km",
        "heading": "315 deg",
        "speed": "57 m/s",
        **kept,
    }
    tree["platforms"]["transmitter"]["motion_error"] |= changes
    return check_mission(parse_mission(yaml_text(tree), "mission.yaml"), TODAY)


def test_a_path_in_other_keys_hides_no_fall_of_the_other_platform() -> None:
    allowed = gated(findings(**DESIGN), _geodetic())
    fallen = gated(findings(**DESIGN), _geodetic(velocity="0.1 mm/s")) - allowed
    assert {"transmitter.velocity.x", "transmitter.velocity.y"} <= fallen
    assert not any(name.startswith("transmitter.velocity") for name in allowed)


def test_what_the_earlier_collection_does_not_allow_is_refused() -> None:
    """A bandwidth below one cycle of the earlier aperture: nothing could be compared, and nothing was refused."""
    key, T = "platforms.receiver.oscillator.bandwidth", findings(**DESIGN).aperture_time
    longer = ("collection__aperture_time", f"{2 * T} s")
    below, above = ((f"{RX}__oscillator/bandwidth", f"{factor / T} Hz") for factor in (0.7, 1.3))
    before = findings(**DESIGN)
    (one,) = [one for one in compare(before, findings(**at(longer, below, SLOWER))).loosened if one.id == key]
    assert one.words.startswith("effects compared in the earlier collection -> not comparable, since there it counts")
    assert key not in gated(before, findings(**at(longer, above, SLOWER)))


def test_axes_that_the_earlier_path_does_not_have_are_refused() -> None:
    still = findings(**at((f"{RX}__velocity", [0, 0, 0])))
    key = "platforms.receiver.motion_error.frame"
    assert key in gated(still, findings(**at((f"{ERROR}/frame", "track"))))
    assert key not in gated(still, findings(**DESIGN))


# ---------------------------------------------------------------------- the same source, written another way
@pytest.mark.parametrize(
    "source",
    [
        "sheet, rev. C ",
        "sheet rev C",
        "Sheet, Rev. C",
        "sheet,  rev.\u00a0C",
        "SHEET-REV-C",
        "sheet, rev. C\u200b",
        "-",
    ],
)
def test_a_source_that_is_spelled_otherwise_is_the_same(source: str) -> None:
    assert refused(SLOWER, (f"{ERROR}/source", source)) == {"receiver.velocity.y"}
    assert refused((f"{ERROR}/source", source)) == set()


def test_names_differ_by_letters_and_digits() -> None:
    assert plain("INS, rev. 1.1") == plain("ins REV 1-1") != plain("INS rev 11")
    assert plain("HG 9900") == plain("HG-9900") != plain("HG 9901")
    assert plain("report\u00e9") == plain("reporte\u0301")
    assert plain(None) == plain(" ?! ") == ""
    assert plain_file("parts/Near_1.yaml") == plain_file("./near 1.yml") != plain_file("parts/near_2.yaml")


@pytest.mark.parametrize("source", [None, "sheet, rev. C"])
def test_the_source_of_the_section_is_no_new_one(source: str | None) -> None:
    """A line that is deleted, or repeated below, names nothing."""
    assert "receiver.imu.attitude" in refused((f"{ERROR}/imu/attitude", "0.01 deg"), (f"{ERROR}/imu/source", source))
    assert refused((f"{ERROR}/imu/attitude", "0.01 deg"), (f"{ERROR}/imu/source", "calibration 7")) == set()


class TestParts:
    @pytest.fixture
    def parts(self, tmp_path: Path) -> Path:
        (tmp_path / "parts").mkdir()
        part = "kind: imu\nname: unit\naccelerometer_bias: {} ug\nsource: sheet\n"
        for file, bias in (("unit", 100), ("parts/unit", 10), ("UNIT_", 10), ("better", 10)):
            (tmp_path / f"{file}.yaml").write_text(part.format(bias))
        return tmp_path

    def found(self, folder: Path, **error: object) -> MissionFindings:
        text = base_text(platforms__receiver__motion_error={"position": "1 cm", "source": "survey", **error})
        (folder / "m.yaml").write_text(text)
        return check_mission(load_mission(str(folder / "m.yaml")), TODAY)

    @pytest.mark.parametrize(
        ("error", "is_refused"),
        [
            ({"sensor": "parts/unit.yaml"}, True),
            ({"sensor": "./UNIT_.yaml"}, True),
            ({"sensor": "better.yaml"}, False),
            ({"sensor": "unit.yaml", "imu": {"accelerometer_bias": "10 ug"}}, True),
            ({"imu": {"accelerometer_bias": "10 ug"}}, True),
            ({"imu": {"accelerometer_bias": "10 ug", "source": "Unit: Sheet"}}, True),
            ({"sensor": "unit.yaml", "imu": {"accelerometer_bias": "10 ug", "source": "report 7"}}, False),
        ],
    )
    def test_a_part_by_another_path_or_an_override_is_no_other(
        self, parts: Path, error: dict[str, object], is_refused: bool
    ) -> None:
        before = self.found(parts, sensor="unit.yaml")
        assert ("receiver.imu.accelerometer_bias" in gated(before, self.found(parts, **error))) == is_refused

    def test_an_override_that_goes_names_no_part(self, parts: Path) -> None:
        before = self.found(parts, sensor="unit.yaml", imu={"accelerometer_bias": "1 mg", "source": "report 7"})
        assert "receiver.imu.accelerometer_bias" in gated(before, self.found(parts, sensor="unit.yaml"))
        assert gated(before, self.found(parts, sensor="better.yaml")) == set()


# ---------------------------------------------------------------------- random missions
_GROWS = ["position", "velocity", "acceleration", "sigma", "amplitude", "rms", "error", "height_error"]
_GROWS += ["accelerometer_bias", "attitude", "gyro_bias", "velocity_random_walk", "angle_random_walk"]
_GROWS += ["quadratic", "cubic"]


def _mission(family: str, seed: int) -> dict[str, Any]:
    tree = tree_of(mission_text(family, seed))
    _with_instruments(tree, Random(f"fallen {family} {seed}"))
    for platform in tree["platforms"].values():
        platform.get("motion_error", {}).pop("sensor", None)  # a part stands in for the figure that goes, by its name
    return tree


def _checked(tree: dict[str, Any]) -> MissionFindings | None:
    try:
        return check_mission(parse_mission(yaml_text(tree)), TODAY)
    except MissionError:
        return None


def _figures(tree: dict[str, Any]) -> list[tuple[Any, Any]]:
    """Places of the numbers that errors are declared by."""
    sections = [tree.get(key) for key in ("timing_error", "synchronization", "common_motion_error", "other_errors")]
    for platform in tree["platforms"].values():
        sections += [platform.get("motion_error"), platform.get("oscillator")]
    found = [place for section in sections if section for place in places(section)]
    return [(node, key) for node, key in found if isinstance(node[key], str) and re.match(r"-?\d", node[key])]


def _scaled(text: str, factor: float) -> str:
    number, unit = re.fullmatch(r"(-?[\d.]+(?:[eE][-+]?\d+)?)(.*)", text, re.DOTALL).groups()
    if unit.strip().startswith("dB"):
        return f"{float(number) + 20 * math.log10(factor):.8g}{unit}"
    return f"{float(number) * factor:.8g}{unit}"


@examples(20)
@given(st.sampled_from(FAMILIES), st.integers(0, 10_000), st.randoms(use_true_random=False), st.booleans())
def test_a_random_figure_that_shrinks_or_goes_is_refused(family, seed, random, is_deleted) -> None:
    """Whichever figure it is: where a row's use falls, the gate says so."""
    tree = _mission(family, seed)
    before = _checked(tree)
    changed = copy.deepcopy(tree)
    if before is None or not (figures := _figures(changed)):
        return
    node, key = random.choice(figures)
    if is_deleted and isinstance(node, dict):
        del node[key]
    else:
        node[key] = _scaled(node[key], random.choice((0.0001, 0.3, 0.9)))
    after = _checked(changed)
    if after is None:
        return
    uses = {row.id: row.utilization for row in after.rows if row.declared is not None}
    fallen = [
        row.id
        for row in before.rows
        if row.declared is not None
        and row.utilization
        and (row.is_independent or row.subject.kind not in MOTION)
        and uses.get(row.id, 0.0) is not None
        and uses.get(row.id, 0.0) < 0.9999 * row.utilization
    ]
    is_balanced = "balanced" in str(tree.get("allocation"))
    if fallen and not is_balanced:
        assert compare(before, after).refusals(Gate(1.0)), fallen


def test_a_total_that_makes_room_for_an_error_that_fails_alone_is_no_fall() -> None:
    """With `each` its row is there only where no error fails alone."""
    each = [("allocation/combine", "each")]
    worse = findings(**at(*each, (f"{ERROR}/velocity", "1 m/s")))
    assert not compare(findings(**at(*each)), worse).loosened


@examples(20)
@given(st.sampled_from(FAMILIES), st.integers(0, 10_000), st.randoms(use_true_random=False))
def test_a_random_error_that_grows_is_no_fall(family, seed, random) -> None:
    tree = _mission(family, seed)
    before = _checked(tree)
    changed = copy.deepcopy(tree)
    grows = [(node, key) for node, key in _figures(changed) if key in _GROWS]
    if before is None or not grows:
        return
    node, key = random.choice(grows)
    node[key] = _scaled(node[key], random.choice((1.1, 3.0)))
    after = _checked(changed)
    if after is not None:
        assert not compare(before, after).loosened
