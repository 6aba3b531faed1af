"""Values that options put into a mission: read and checked as if a file had them, never taken for its own."""

from datetime import date

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import InvalidValueError, MissionError, SetValue, changes_words
from bisar_budget.mission.changes import all_keys, nearest_keys, read_changes
from bisar_budget.mission.edited import with_values
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from tests.conftest import ROOT

FILE = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
TEXT = FILE.read_text(encoding="utf-8")


def changed(*texts: str, data: str = TEXT) -> Mission:
    return parse_mission(data, "m.yaml", changes=read_changes(texts))


def fault(*texts: str, data: str = TEXT) -> str:
    with pytest.raises(MissionError) as error:
        changed(*texts, data=data)
    (line,) = error.value.lines()
    return line


def test_a_set_value_is_read_as_one_of_the_file() -> None:
    """The findings are those of a file that has the value, but for the line of it."""
    edited = parse_mission(TEXT.replace("aperture_time: 6 s", "aperture_time: 2 s"), "m.yaml")
    by_file = check_mission(edited, date(2026, 1, 1))
    by_option = check_mission(changed("collection.aperture_time=2 s"), date(2026, 1, 1))
    assert by_option.rows == by_file.rows
    assert changed("collection.aperture_time=2s").collection == edited.collection


def test_values_are_added_where_there_is_none() -> None:
    mission = changed(
        "timing_error.linear=1ppb",
        "platforms.receiver.motion_error.velocity=[1 mm/s, 0, 2mm/s]",
        "other_errors=[{name: drift, quadratic_phase_error: 3deg}]",
        "requirement_ids.receiver.velocity.x=REQ-7",
    )
    assert mission.timing_error.linear == 1e-9
    assert mission.platforms.receiver.motion_error.velocity == (1e-3, 0.0, 2e-3)
    assert mission.requirement_ids == {"receiver.velocity.x": ("REQ-7",)}
    assert [other.name for other in mission.other_errors] == ["drift"]


@pytest.mark.parametrize("key", ["platforms.transmitter.position[1]", "platforms.transmitter.position.1"])
def test_entries_of_lists_go_by_their_number(key: str) -> None:
    assert changed(f"{key}=1 km").platforms.transmitter.position == (30414.0, 1000.0, 6000.0)


def test_an_entry_is_added_behind_the_last() -> None:
    listed = TEXT + "other_errors:\n  - {name: a, quadratic_phase_error: 1 deg}\n"
    mission = changed("other_errors.1={name: b, quadratic_phase_error: 2 deg}", data=listed)
    assert [other.name for other in mission.other_errors] == ["a", "b"]
    assert "other_errors: has 1 entry, and none has this number (got 3); accepted: 0 to 1" in fault(
        "other_errors.3.name=c", data=listed
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "radar.bandwidth=150 m",
            "--set radar.bandwidth: must be a frequency, but 'm' makes it a length (got 150 m)",
        ),
        (
            "radar.bandwith=3 MHz",
            "--set radar.bandwith: is not a known key; accepted: center_frequency, bandwidth. Did",
        ),
        ("aperture_time=3 s", "Did you mean 'collection.aperture_time'?"),
        ("reciever.azimuth=3deg", "'platforms.receiver.azimuth' or 'platforms.transmitter.azimuth'?"),
        ("radar.bandwidth=", "--set radar.bandwidth: has no value. Give it one; null takes the key out"),
        ("radar.bandwidth=~", "--set radar.bandwidth: must not be taken out: it is required"),
        ("radar.bandwidth=null", "--set radar.bandwidth: must not be taken out: it is required"),
        ("radar.bandwith=null", "--set radar.bandwith: is not in the file, and null takes nothing out. Did you mean"),
        ("radar.bandwidth=[1", "--set radar.bandwidth: is not valid YAML: "),
        ("radar.bandwidth=*x", "--set radar.bandwidth: is an alias (*); write the value out"),
        ("radar.bandwidth=!!float 3", "--set radar.bandwidth: carries a YAML tag"),
        ("radar.bandwidth=1 MHz\n---\n2 MHz", "--set radar.bandwidth: has a second YAML document"),
        ("name=a\udcff", "--set name: is not text: its bytes are not UTF-8 (got a\\udcff)"),
        ("radar=3", "--set radar: must be a mapping of keys to values (got 3)"),
        ("radar.bandwidth.x=3", "--set radar.bandwidth.x: radar.bandwidth: has no keys (got 300 MHz)"),
        ("radar={center_frequency: 1 GHz}", "--set radar: radar.bandwidth: is missing"),
        ("platforms.receiver.position=[1 km, 0 km, 1 km]", "--set platforms.receiver.position: "),
    ],
)
def test_a_fault_names_the_option_instead_of_a_line(text: str, said: str) -> None:
    line = fault(text)
    assert line.startswith("m.yaml: --set " if "position" not in text else "m.yaml:")
    assert said in line or "mixes position with slant_range" in line


def test_a_fault_of_the_file_says_what_it_was_read_with() -> None:
    line = fault("radar.center_frequency=1MHz")
    assert line == (
        "m.yaml:15:14: radar.bandwidth: must be less than twice the centre frequency (got 300 MHz). "
        "Read with --set radar.center_frequency=1MHz"
    )


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["x"], "'x' is not KEY=VALUE"),
        (["=3"], "'=3' is not KEY=VALUE"),
        (["a..b=3"], "'a..b' is no path of keys"),
        (["a[0]=3", "a.0=4"], "a.0 is set twice"),
        (["a" * 600 + "=1"], "is too long"),
    ],
)
def test_what_is_no_key_and_value_is_refused(texts: list[str], said: str) -> None:
    with pytest.raises(InvalidValueError, match=r".") as error:
        read_changes(texts)
    assert said in error.value.problem.problem


def test_a_set_value_has_no_line() -> None:
    mission = changed("platforms.transmitter.motion_error.acceleration=5 mm/s^2", "scene.radius=100m")
    assert mission.line(("platforms", "transmitter", "motion_error", "acceleration", 0)) is None
    assert mission.line(("scene", "radius")) is None
    assert mission.line(("platforms", "transmitter", "motion_error", "source")) == 24
    assert mission.is_changed(("scene", "radius"))
    assert not mission.is_changed(("radar", "bandwidth"))
    assert not load_mission(str(FILE)).is_changed(("radar", "bandwidth"))


def test_options_are_written_so_that_a_shell_reads_them_again() -> None:
    changes = (SetValue("radar.bandwidth", "150MHz"), SetValue("a.b", "[0, 40, 0]"))
    assert changes_words(changes) == "--set radar.bandwidth=150MHz --set 'a.b=[0, 40, 0]'"
    assert changes_words(()) == ""


def test_every_key_is_found() -> None:
    keys = all_keys()
    assert {"collection.aperture_time", "platforms.receiver.motion_error.imu.gyro_bias", "other_errors.name"} <= set(
        keys
    )
    assert nearest_keys("colection.aperture") == "Did you mean 'collection.aperture_time'?"
    assert nearest_keys("qqqqqqqq") == ""


class TestTakingOut:
    """`KEY=null` takes a key out: the mission is that of a file without it."""

    LISTED = TEXT + "other_errors:\n  - {name: a, quadratic_phase_error: 1 deg}\n"

    def test_a_key_is_taken_out(self) -> None:
        assert changed("other_errors=null", data=self.LISTED).other_errors == ()

    def test_a_key_that_the_file_leaves_out_stays_out(self) -> None:
        assert changed("requirements.islr=null").requirements == parse_mission(TEXT).requirements

    def test_a_value_can_follow(self) -> None:
        assert changed("other_errors=null", "radar.bandwidth=100MHz", data=self.LISTED).radar.bandwidth == 100e6

    @pytest.mark.parametrize("key", ["other_errors.0", "platforms.transmitter.position.1"])
    def test_an_entry_of_a_list_is_not_taken_out(self, key: str) -> None:
        line = fault(f"{key}=null", data=self.LISTED)
        assert "is an entry of a list, which null does not take out" in line
        assert "accepted: null for a key, or the list without the entry" in line

    def test_quotes_make_it_a_text(self) -> None:
        assert changed("name='null'").name == "null"

    def test_python_takes_a_key_out_with_none(self) -> None:
        mission = parse_mission(self.LISTED, "m.yaml").replace({"other_errors": None})
        assert mission.other_errors == ()
        assert [change.text for change in mission.changes] == ["null"]

    @pytest.mark.parametrize(
        ("text", "key", "left"),
        [
            ("a: 1\nb: 2 # two\nc: 3\n", "b", "a: 1\nc: 3\n"),
            ("a: 1\n# of b\nb:\n  x: 1\n  y: 2\n# of c\nc: 3\n", "b", "a: 1\n# of b\n# of c\nc: 3\n"),
            ("a:\n  x: 1\n  y: 2\nb: 3\n", "a.y", "a:\n  x: 1\nb: 3\n"),
            ("a: {x: 1, y: 2}\n", "a.x", "a: {y: 2}\n"),
            ("a: {x: 1, y: 2}\n", "a.y", "a: {x: 1}\n"),
            ("a: {x: 1}\n", "a.x", "a: {}\n"),
            ("a:\n  - x: 1\n    y: 2\n", "a.0.x", "a:\n  - y: 2\n"),
            ("a:\n  - x: 1\n    y: 2\n", "a.0.y", "a:\n  - x: 1\n"),
            ("a: 1\nb: 2\n", "b", "a: 1\n"),
            ("a: 1\nb: 2\n", "c", "a: 1\nb: 2\n"),
        ],
    )
    def test_the_text_of_a_file_without_a_key(self, text: str, key: str, left: str) -> None:
        assert with_values(text, [SetValue(key, "null")]) == left


LIMIT_ALONE = TEXT.replace("requirements:", "requirements:\n  location_error: 5 m", 1)


def test_a_confidence_is_put_beside_a_limit_alone() -> None:
    mission = changed("requirements.location_error.confidence=99 %", data=LIMIT_ALONE)
    assert mission.requirements.location_error == 5.0
    assert mission.requirements.confidence_of("location_error") == 0.99
    same = changed("requirements.location_error={limit: 5 m, confidence: 99 %}", data=LIMIT_ALONE)
    assert mission.requirements == same.requirements


def test_a_bias_is_put_beside_a_size_alone() -> None:
    key = "platforms.receiver.motion_error.velocity"
    for size in ("2 mm/s", "[2 mm/s, 2 mm/s, 2 mm/s]"):
        error = changed(f"{key}={size}", f"{key}.bias=[0, 0, 1 mm/s]").platforms.receiver.motion_error
        assert (error.velocity, error.bias_of("velocity")) == ((2e-3,) * 3, (0.0, 0.0, 1e-3))
    assert changed(f"{key}={size}", f"{key}.sigma=3 mm/s").platforms.receiver.motion_error.velocity == (3e-3,) * 3


def test_a_wrong_value_is_that_of_its_option_and_not_of_the_number_beside_it() -> None:
    option = "--set requirements.location_error.confidence"
    assert f"{option}: must be a probability" in fault("requirements.location_error.confidence=9", data=LIMIT_ALONE)
    line = fault("requirements.location_error.confidence=99 %", data=LIMIT_ALONE.replace(" 5 m", " 5 kg", 1))
    assert "requirements.location_error.limit: has the unknown unit 'kg'" in line
    assert "--set" not in line.partition("Read with")[0]


def test_null_beside_a_number_alone_takes_out_what_it_names() -> None:
    kept = changed("requirements.location_error.confidence=null", data=LIMIT_ALONE)
    assert kept.requirements == changed(data=LIMIT_ALONE).requirements
    assert "must not be taken out" in fault("requirements.location_error.limit=null", data=LIMIT_ALONE)


def test_other_numbers_have_no_keys() -> None:
    assert "radar.bandwidth: has no keys" in fault("radar.bandwidth.bias=1 Hz")
