"""Reading mission files: positions, YAML's pitfalls, limits, and a fuzz of the whole loader."""

import sys
from datetime import date

import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import MissionError
from bisar_budget.mission import tree
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import MISSION, Mission
from tests.conftest import BASE, ROOT, examples, mission_text


def faults_of(text: str | bytes):
    with pytest.raises(MissionError) as error:
        parse_mission(text, "m.yaml")
    return error.value


MISSIONS = sorted(map(str, (ROOT / "specs/missions").glob("*.yaml")))


@pytest.mark.parametrize("file", MISSIONS)
def test_a_file_read_twice_is_the_same_mission(file: str) -> None:
    mission, again = load_mission(file), load_mission(file)
    assert mission == again
    assert not mission != again  # noqa: SIM202  (a tuple answers it by itself)
    assert mission.geometry == again.geometry
    longer = mission._replace(collection=mission.collection._replace(aperture_time=1.1))
    assert mission != longer
    assert not mission == longer  # noqa: SIM201
    assert mission != tuple(mission)


@pytest.mark.parametrize("file", MISSIONS)
def test_a_mission_and_its_findings_are_shown_on_one_line(file: str) -> None:
    mission = load_mission(file)
    assert repr(mission) == f"Mission({file!r}, {mission.name!r})"
    found = check_mission(mission, date(2026, 1, 1))
    assert repr(found) == f"MissionFindings({file!r}, {mission.name!r}, {found.status!r})"


def test_a_long_name_is_shown_shortened() -> None:
    mission = parse_mission(mission_text(name="n" * 500), "a\nb.yaml")
    assert repr(mission) == f"Mission('a\\nb.yaml', '{'n' * 57}...')"


def test_values_know_their_line() -> None:
    mission = parse_mission(mission_text(platforms__receiver__motion_error={"velocity": [1, 2, 3]}))
    lines = mission_text(platforms__receiver__motion_error={"velocity": [1, 2, 3]}).splitlines()
    path = ("platforms", "receiver", "motion_error", "velocity")
    assert lines[mission.line((*path, 1)) - 1].strip() == "- 2"
    assert lines[mission.line((*path, 1)) - 3].strip() == "velocity:"


def test_line_of_a_silent_key_is_that_of_the_nearest_that_exists() -> None:
    mission = parse_mission(mission_text())
    assert mission.line(("platforms", "receiver", "motion_error", "velocity", 0)) == mission.line(
        ("platforms", "receiver")
    )
    assert mission.line(("waivers", 0)) == 1  # nothing of it is there: the file itself


def test_every_fault_at_once_in_file_order() -> None:
    text = mission_text(radar__center_frequency="-1 GHz", collection__aperture_time="0 s", requirements__pslr="3 dBi")
    error = faults_of(text)
    assert [fault.key for fault in error.faults] == [
        "radar.center_frequency",
        "collection.aperture_time",
        "requirements.pslr",
    ]
    assert error.lines()[0] == ("m.yaml:4:21: radar.center_frequency: must be greater than 0 Hz (got -1 GHz)")


@pytest.mark.parametrize(
    ("text", "value"), [("9.6e9", 9.6e9), ("1e10", 1e10), ("9600000000", 9.6e9), ("'9.6 GHz'", 9.6e9)]
)
def test_numbers_that_yaml_1_1_reads_as_text_are_numbers(text: str, value: float) -> None:
    mission = parse_mission(mission_text().replace("10 GHz", text))
    assert mission.radar.center_frequency == value


@pytest.mark.parametrize("name", ["on", "No", "1.0", "2027-03-31", "0x10", "~x", "null-space"])
def test_text_stays_text(name: str) -> None:
    assert parse_mission(mission_text().replace("name: base", f"name: {name}")).name == name


@pytest.mark.parametrize("text", ["", "# only a comment\n", "---\n", "~\n"])
def test_empty(text: str) -> None:
    error = faults_of(text)
    assert "is empty" in error.faults[0].problem or "has no value" in error.faults[0].problem


@pytest.mark.parametrize("depth", [21, 10_000, 200_000])
@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ("{a: ", "}")])
def test_depth_is_bounded_before_anything_recurses(depth: int, opening: str, closing: str) -> None:
    error = faults_of("a: " + opening * depth + closing * depth)
    assert any("nested more than" in fault.problem for fault in error.faults)


def test_block_depth_is_bounded() -> None:
    text = "".join(f"{' ' * level}a:\n" for level in range(1000))
    assert any("nested more than" in fault.problem for fault in faults_of(text).faults)


def test_a_mission_may_be_as_deep_as_the_schema() -> None:
    text = mission_text(
        platforms__transmitter__motion_error={"vibration": {"sinusoidal": [{"amplitude": 1e-5, "frequency": 9}]}}
    )
    assert isinstance(parse_mission(text), Mission)


def test_alias_bomb_is_refused_without_expanding() -> None:
    bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n"
    bomb += "".join(f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join([f'*{chr(97 + i)}'] * 9)}]\n" for i in range(20))
    error = faults_of(bomb)
    assert any("is an alias" in fault.problem for fault in error.faults)


def test_merge_keys_are_refused() -> None:
    text = mission_text() + "x: &x {a: 1}\n<<: *x\n"
    assert {"is an alias (*)", "is not a known key"} <= {fault.problem for fault in faults_of(text).faults}


def test_a_file_of_2_mib_is_refused() -> None:
    error = faults_of(b"# " + b"x" * (2 << 20))
    assert "larger than 1024 KiB" in error.faults[0].problem


@pytest.mark.parametrize(
    ("data", "line"),
    [(b"\x00\x01\x02", None), (b"\x89PNG\r\n\x1a\n\0\0", 1), (b"name: a\nradar: \xff\n", 2), (b"\xff\xfen\0", 1)],
)
def test_binary(data: bytes, line: int | None) -> None:
    fault = faults_of(data).faults[0]
    assert "text" in fault.problem
    assert line is None or fault.line == line


def test_byte_order_mark_and_windows_lines_are_fine() -> None:
    data = b"\xef\xbb\xbf" + mission_text().replace("\n", "\r\n").encode()
    assert parse_mission(data).line(("radar", "bandwidth")) == 5


def test_missing_file_directory_and_nul_in_the_name(tmp_path) -> None:
    for path, says in (
        (tmp_path / "none.yaml", "No such file"),
        (tmp_path, "directory"),
        (f"{tmp_path}/a\0b", "cannot be read"),
    ):
        with pytest.raises(MissionError) as error:
            load_mission(str(path))
        assert says in error.value.faults[0].problem


def test_unreadable_file(tmp_path, monkeypatch) -> None:
    """Permissions do not stop root, so the refusal is the operating system's words."""
    path = tmp_path / "m.yaml"
    path.write_text(mission_text())
    path.chmod(0)

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refuse)
    with pytest.raises(MissionError) as error:
        load_mission(str(path))
    assert "Permission denied" in error.value.faults[0].problem


def test_pure_python_parser_reads_the_same(monkeypatch) -> None:
    text = mission_text(waivers=[{"id": "*", "until": "2027-01-01", "reason": "x"}])
    fast = parse_mission(text)
    monkeypatch.setattr(tree, "_PARSER", yaml.SafeLoader)
    slow = parse_mission(text)
    assert slow._replace(places={}) == fast._replace(places={})
    assert {path: slow.line(path) for path in slow.places} == {path: fast.line(path) for path in fast.places}
    with pytest.raises(MissionError, match="is missing"):
        parse_mission("radar:\nname: x\n")


def test_given_values_cannot_steer_a_terminal() -> None:
    text = mission_text().replace("10 GHz", '"\\e]0;owned\\a"')
    assert "\x1b" not in "".join(faults_of(text).lines())
    text = mission_text() + '"\\e[31m": 1\n'
    assert "\x1b" not in "".join(faults_of(text).lines())


def test_too_many_entries() -> None:
    other = [{"name": f"n{i}", "quadratic_phase_error": 0} for i in range(1001)]
    assert "1000" in str(faults_of(mission_text(other_errors=other)).faults[0])


yaml_like = st.text(alphabet=st.sampled_from(list("abn:-[]{}#&*!|>'\"%@`, \n\t0.1e\\ée\u2028")), max_size=60)
scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=12),
    st.sampled_from(["10 GHz", "5 mm/s", "nan", "1e400", "-3 dB", "45 deg", "equal", "full", "2027-01-01"]),
)
KEYS = sorted({*MISSION.keys, "position", "velocity", "motion_error", "split", "vibration", "pslr", "id", "until"})
trees = st.recursive(
    scalars,
    lambda children: st.one_of(
        st.lists(children, max_size=4),
        st.dictionaries(st.sampled_from(KEYS) | st.text(max_size=5), children, max_size=4),
    ),
    max_leaves=12,
)


def mission_or_error(data: str | bytes) -> None:
    try:
        assert isinstance(parse_mission(data), Mission)
    except MissionError as error:
        assert error.faults
        assert all(str(fault) for fault in error.faults)
        assert all("\x1b" not in line for line in error.lines())


@given(st.one_of(st.text(max_size=200), yaml_like))
@example("a: !!float nan")
@example("? [a]\n: 1")
@example("{a: 1, a: 2}")
@example("%YAML 9.9\n---\na: 1")
@example("\ufeffa: 1")
@example("- - - - -")
@example("*a")
@example("&a a")
@example("a: |\n  b\n c")
@examples(400)
def test_any_text_gives_a_mission_or_a_mission_error(text: str) -> None:
    mission_or_error(text)


@given(st.binary(max_size=200))
@examples(200)
def test_any_bytes_give_a_mission_or_a_mission_error(data: bytes) -> None:
    mission_or_error(data)


@given(st.sampled_from(sorted(BASE)), trees)
@examples(300)
def test_any_value_at_a_known_key(key: str, value) -> None:
    mission_or_error(yaml.safe_dump({**BASE, key: value}, allow_unicode=True))


@given(st.sampled_from(KEYS), trees, st.sampled_from([(), ("radar",), ("platforms", "transmitter"), ("allocation",)]))
@examples(300)
def test_any_value_anywhere(key: str, value, place) -> None:
    tree = yaml.safe_load(mission_text())
    node = tree
    for part in place:
        node = node.setdefault(part, {})
    node[key] = value
    mission_or_error(yaml.safe_dump(tree, allow_unicode=True))


def test_recursion_limit_is_far_away() -> None:
    assert sys.getrecursionlimit() > tree.MAX_NESTING_LEVEL * 10


@pytest.mark.parametrize(
    ("value", "is_refused"),
    [
        ("[0,5 mm/s, 3 mm/s]", True),
        ("[0,5 mm/s, 3 mm/s, 1 mm/s]", True),
        ("[1 mm/s, -2,5 mm/s, 0]", True),
        ("[0,5 mm/s,3 mm/s]", False),
        ("[0, 5 mm/s, 3 mm/s]", False),
        ("[0,0, 0]", False),
        ("[0,1e-3, 0]", False),
        ("[0.5 mm/s, 5 mm/s, 3 mm/s]", False),
    ],
)
def test_a_decimal_comma_in_a_list_is_refused(value: str, is_refused: bool) -> None:
    """Three components to YAML, the first of them 0; where no comma has a blank behind it, nobody can tell."""
    text = mission_text().replace("platforms:", "platforms:", 1)
    data = yaml.safe_load(text)
    data["platforms"]["transmitter"]["motion_error"] = {"velocity": "VALUE"}
    text = yaml.safe_dump(data).replace("VALUE", value)
    if not is_refused:
        assert parse_mission(text).platforms.transmitter.motion_error.velocity is not None
        return
    with pytest.raises(MissionError) as error:
        parse_mission(text)
    assert any("decimal comma" in fault.problem and "velocity" in fault.key for fault in error.value.faults)


@pytest.mark.parametrize(
    ("key", "value", "hint"),
    [
        ("requirements__quadratic_phase_error", "360 deg", None),
        ("requirements__quadratic_phase_error", "361 deg", ""),
        ("requirements__quadratic_phase_error", "0", ""),
        ("requirements__cubic_phase_error", "6.28 rad", None),
        ("requirements__cubic_phase_error", "6.29 rad", ""),
        ("allocation__warn_above", "1", None),
        ("allocation__warn_above", "80", "A bare number is a ratio: 80 is 8000 %"),
        ("radar__center_frequency", "9.6", "A bare number is in Hz"),
        ("radar__center_frequency", "9.6 GHz", None),
    ],
)
def test_a_number_out_of_bounds_is_asked_for_its_unit(key: str, value: str, hint: str | None) -> None:
    """A turn at the aperture edge is the most that a phase may be required to be; both sides of it."""
    text = mission_text(**{key: value})
    if hint is None:
        parse_mission(text)
        return
    (fault,) = faults_of(text).faults
    assert fault.hint == hint


@pytest.mark.parametrize("value", ["45", "0.7", "-1e-3", "+.5"])
@pytest.mark.parametrize(
    "key",
    [
        "requirements__quadratic_phase_error",
        "requirements__cubic_phase_error",
        "platforms__receiver__azimuth",
        "platforms__receiver__elevation",
        "platforms__receiver__motion_azimuth",
    ],
)
def test_a_bare_angle_is_refused_and_offered_both_units(key: str, value: str) -> None:
    """45 was 45 rad, which is 58 deg: nothing in the file said so."""
    angles = {"azimuth": "45 deg", "elevation": "13.6 deg", "motion_azimuth": "135 deg"}
    polar = {"platforms__receiver": {"slant_range": "8.5 km", "speed": "60 m/s", **angles}}
    faults = faults_of(mission_text(**polar, **{key: value})).faults
    (fault,) = [fault for fault in faults if fault.key == key.replace("__", ".")]
    assert (fault.problem, fault.given) == ("has no unit", value)
    assert fault.hint == f"Did you mean '{value} deg' or '{value} rad'?"


@pytest.mark.parametrize("zero", ["0", "0.0", "-0", "0e3"])
def test_a_zero_angle_needs_no_unit(zero: str) -> None:
    other = [{"name": "air", "quadratic_phase_error": zero}]
    assert parse_mission(mission_text(other_errors=other)).other_errors[0].quadratic_phase_error == 0


@pytest.mark.parametrize(("azimuth", "is_refused"), [("360 deg", False), ("-360 deg", False), ("361 deg", True)])
def test_a_direction_is_within_a_turn(azimuth: str, is_refused: bool) -> None:
    platform = {
        "slant_range": "9 km",
        "azimuth": azimuth,
        "elevation": "15 deg",
        "speed": "60 m/s",
        "motion_azimuth": "90 deg",
    }
    text = mission_text(platforms__receiver=platform)
    if is_refused:
        assert [fault.key for fault in faults_of(text).faults] == ["platforms.receiver.azimuth"]
    else:
        parse_mission(text)


def test_decimal_commas_are_told() -> None:
    error = faults_of(mission_text().replace("center_frequency: 10 GHz", "center_frequency: 9,6 GHz"))
    assert error.faults  # `9,6 GHz` is no number in a block; in a mapping it is a key
    text = "schema_version: 1\nname: x\nradar: {center_frequency: 9,6 GHz, bandwidth: 1 MHz}\n"
    assert any("written with a point" in fault.hint for fault in faults_of(text).faults)
