"""The cases of a sweep: as options, tables and samples say them, and what is wrong with those that say nothing."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bisar_budget import units
from bisar_budget.findings.case_table import Cases, in_unit
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.mission.tree import read_tree
from bisar_budget.questions.cases import MAX_TABLE_VALUE_COUNT, TableError, grid, sample, sampled_cases, table
from bisar_budget.units import parse_quantity
from tests.conftest import ROOT

FILE = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
TREE: dict[str, Any] = read_tree(FILE.read_bytes(), "m.yaml").root
TIME, AZIMUTH = "collection.aperture_time", "platforms.receiver.azimuth"


def axis(text: str) -> tuple[list[float], str]:
    """Values of one option in SI, and the unit that they are said in."""
    found = grid(TREE, [text])
    assert found.count == found.columns[0].size
    return found.columns[0].tolist(), found.varied[0].unit


def test_ends_belong_to_a_range_and_one_without_unit_has_that_of_the_other() -> None:
    values, unit = axis(f"{AZIMUTH}=0:180deg:181")
    assert unit == "deg"
    assert values == [parse_quantity(f"{angle} deg", units.ANGLE) for angle in range(181)]
    assert axis(f"{TIME}=1 : 10 s : 4") == ([1, 4, 7, 10], "s")
    assert axis("platforms.receiver.slant_range=1km:10km:10")[0] == [1000.0 * step for step in range(1, 11)]
    assert axis("platforms.receiver.slant_range=500m:1km:2") == ([500, 1000], "km")


def test_values_are_those_that_a_person_would_write() -> None:
    """Steps of a tenth in binary end in 0.30000000000000004."""
    assert axis(f"{TIME}=1:2s:11")[0] == [1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2]
    assert axis(f"{TIME}=100:300ms:3") == ([0.1, 0.2, 0.3], "ms")


def test_equal_ratios() -> None:
    assert axis(f"{TIME}=1:100s:3:log")[0] == [1, 10, 100]
    values = np.array(axis("radar.bandwidth=10MHz:1GHz:7:log")[0])
    assert values[1:] / values[:-1] == pytest.approx(100 ** (1 / 6), rel=1e-13)


def test_a_list() -> None:
    assert axis(f"{TIME}=3,1,2.5 s") == ([3, 1, 2.5], "s")
    assert axis("radar.bandwidth=150MHz, 0.3GHz") == ([150e6, 300e6], "GHz")
    assert axis(f"{TIME}=4s") == ([4], "s")
    assert axis("platforms.transmitter.velocity.2=0,1e-1,2 mm/s") == ([0, 1e-4, 2e-3], "mm/s")


def test_the_last_key_is_the_fastest() -> None:
    found = grid(TREE, [f"{TIME}=1,2s", f"{AZIMUTH}=0:90deg:3"])
    assert (found.shape, found.count) == ((2, 3), 6)
    values = found.values(1, 5)
    assert values[TIME].tolist() == [1, 1, 2, 2]
    assert np.degrees(values[AZIMUTH]) == pytest.approx([45, 90, 0, 45])


def test_more_cases_than_an_array_could_count() -> None:
    time, bandwidth, slant_range = (
        f"{key}=1:2:{MAX_TABLE_VALUE_COUNT}" for key in (TIME, "radar.bandwidth", "platforms.receiver.slant_range")
    )
    with pytest.raises(QuestionError, match="must be"):
        grid(TREE, [bandwidth])  # 1 Hz
    many = grid(TREE, [time, slant_range])
    assert many.count == MAX_TABLE_VALUE_COUNT**2


def test_words() -> None:
    found = grid(TREE, ["allocation.model=full, published", f"{TIME}=1,2s"])
    assert (found.shape, [one.unit for one in found.varied]) == ((2, 2), ["", "s"])
    assert found.values(1, 3)["allocation.model"].tolist() == ["full", "published"]
    lists = grid(TREE, ["platforms.receiver.motion_error.sensor=[stim300, mosaic-x5-rtk],stim300"])
    assert lists.columns[0].tolist() == ["[stim300, mosaic-x5-rtk]", "stim300"]
    assert grid(TREE, ["collection.pulses=256,512"]).columns[0].tolist() == ["256", "512"]


def test_a_rule_stands_in_for_shares() -> None:
    """The file has shares; what is asked decides the form that is read."""
    shares = {"allocation": {"split": {"transmitter": "0.5", "receiver": "0.5"}}}
    assert grid(shares, ["allocation.split=equal,balanced"]).columns[0].tolist() == ["equal", "balanced"]
    assert grid(shares, ["allocation.split.transmitter=0.4,0.5"]).columns[0].tolist() == [0.4, 0.5]
    with pytest.raises(QuestionError, match="the file has 'equal' there, which has no 'transmitter'"):
        grid({"allocation": {"split": "equal"}}, ["allocation.split.transmitter=0.4,0.5"])


def test_a_list_of_parts_is_not_replaced_by_one() -> None:
    """The other part would be lost without a word."""
    tree = {"platforms": {"receiver": {"motion_error": {"sensor": ["stim300", "mosaic-x5-rtk"]}}}}
    key = "platforms.receiver.motion_error.sensor"
    said = r"sensor\.0=hg1700,imx5 for its first, or lists, .*=\[hg1700, mosaic-x5-rtk\]"
    with pytest.raises(QuestionError, match=said):
        grid(tree, [f"{key}=hg1700,imx5"])
    assert grid(tree, [f"{key}.0=hg1700,imx5"]).columns[0].tolist() == ["hg1700", "imx5"]
    with pytest.raises(QuestionError, match="the list has 2 entries"):
        grid(tree, [f"{key}.2=hg1700"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "allocation.model=publishd,full",
            "'publishd' is not a known choice; accepted: published, full",
        ),
        ("allocation.model=full,full", "has a value twice"),
        ("allocation.model=full,", "'' is not a known choice"),
        ("allocation.model=1:2:3", "'1:2:3' is not a known choice"),
        ("collection.pulses=1,512", "'1' must be a whole number from 2"),
        ("platforms.receiver.motion_error.sensor=,", "'' must not be empty"),
        (f"{TIME}", "does not say which values"),
        (f"{TIME}=", "does not say which values"),
        ("=1:2s:3", "does not say which values"),
        ("collection.aperture_tim=1:2s:3", "Did you mean 'collection.aperture_time'?"),
        ("collection=1:2s:3", "is a section"),
        ("name=1:2s:3", "is no number"),
        (f"{TIME}=1:2s", "has no count"),
        (f"{TIME}=1:2s:1", "the count of values is '1'; accepted: a whole number, at least 2; KEY=VALUE is a single"),
        (f"{TIME}=1:2s:-3", "is '-3'"),
        (f"{TIME}=1:2s:2.5", "is '2.5'"),
        (f"{TIME}=1:2s:١٢", "accepted: a whole number"),
        (f"{TIME}=1:2s:{'9' * 30}", "accepted: a whole number"),
        (f"{TIME}=1:2s:1000000000000", "1000000000000 values of one key; accepted: up to 10000000"),
        (f"{TIME}=1:2s:3:lin", "is no range"),
        (f"{TIME}=1:2:3:4:5", "is no range"),
        (f"{TIME}=1::3", "is no range"),
        (f"{TIME}=2:1s:3", "the range is reversed; accepted: FROM < TO"),
        (f"{AZIMUTH}=350:10deg:3", "it goes from a negative angle: -10:10deg"),
        (f"{TIME}=2:2s:3", "the range is empty; accepted: FROM < TO; KEY=VALUE is a single value"),
        (f"{AZIMUTH}=0:1deg:3:log", "equal ratios begin above 0"),
        (f"{TIME}=1:2km:3", "must be a time, but 'km' makes it a length"),
        (f"{AZIMUTH}=1:2:3", "has no unit"),
        (f"{TIME}=-1:2s:3", "'-1' must be greater than 0 s"),
        (f"{TIME}=1:1e9s:3", "'1e9s' must be at most 1e+06 s"),
        (f"{TIME}=1,,2s", "'' must be a time"),
        (f"{TIME}=1,1s", "has a value twice"),
        (f"{TIME}=nan,1s", "must be a finite number"),
        (f"{TIME}=1,nan", "unknown unit 'nan'"),
    ],
)
def test_what_says_no_values(text: str, said: str) -> None:
    with pytest.raises(QuestionError) as error:
        grid(TREE, [text])
    assert said in str(error.value)


def test_a_key_varies_once() -> None:
    with pytest.raises(QuestionError, match="varies twice"):
        grid(TREE, ["platforms.transmitter.position.1=1km", "platforms.transmitter.position[1]=2km"])
    with pytest.raises(QuestionError, match="nothing would vary"):
        grid(TREE, [])


@given(st.text(max_size=40))
def test_any_option_gives_values_or_says_why_not(text: str) -> None:
    try:
        found = grid(TREE, [f"{TIME}={text}"])
    except QuestionError as error:
        assert str(error)
    else:
        assert found.count >= 1
        assert ((found.columns[0] >= 1e-6) & (found.columns[0] <= 1e6)).all()


@given(st.integers(2, 500), st.booleans(), st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_a_range_rises_from_end_to_end(count: int, is_log: bool, one: float, other: float) -> None:
    low, high = sorted((one, other))
    assume(high > low * (1 + 1e-9))
    values, _ = axis(f"{TIME}={low!r}:{high!r} s:{count}{':log' if is_log else ''}")
    assert (values[0], values[-1], len(values)) == (low, high, count)
    assert (np.diff(values) > 0).all()


@given(st.sampled_from(["deg", "rad", "mrad", "urad"]), st.floats(-6, 6), st.integers(0, 12))
def test_values_are_said_as_they_were_written(unit: str, value: float, digits: int) -> None:
    """15 digits and fewer come back as they were; more at least as the same value."""
    text = f"{value:.{digits}e}"
    assume(abs(parse_quantity(f"{text} {unit}", units.ANGLE)) <= 2 * math.pi)
    assume(not 0 < abs(float(text)) < 1e-300)  # such have fewer digits
    found = grid(TREE, [f"{AZIMUTH}={text} {unit}"])
    assert in_unit(found.varied[0], found.columns[0])[0] == pytest.approx(float(text), rel=5e-16)
    if abs(float(text)) > 1e-9:
        said = in_unit(found.varied[0], found.columns[0])[0]
        assert parse_quantity(f"{said.item()!r} {unit}", units.ANGLE) == found.columns[0][0]


@given(st.integers(1, 300), st.integers(1, 20), st.data())
def test_some_cases_are_cases_of_all_parts(first: int, second: int, data: st.DataObject) -> None:
    cases = grid(TREE, [f"{TIME}={','.join(map(str, range(1, first + 1)))}s", f"{AZIMUTH}=0:90deg:{second + 1}"])
    count = data.draw(st.integers(1, cases.count))
    found = sampled_cases(cases, count)
    assert count <= found.count <= count + count // 100
    assert set(found.columns[0]) <= set(cases.columns[0])
    assert set(found.columns[1]) <= set(cases.columns[1])
    if count >= 100:
        assert np.ptp(found.columns[0]) >= 0.9 * (first - 1) - 1


class TestTables:
    """A CSV of cases: one line for each."""

    def test_a_table(self) -> None:
        text = f"\ufeff# of a campaign\r\n\r\n{TIME} [ms], platforms.receiver.azimuth [°],radar.bandwidth[MHz]\r\n"
        text += '1000,-45,150\r\n  # a remark\r\n 2.5e3 , 90, "300"\r\n'
        found = table(TREE, text, "c.csv")
        assert (found.count, found.is_grid) == (2, False)
        values = found.values(0, 2)
        assert values[TIME].tolist() == [1, 2.5]
        assert values[AZIMUTH].tolist() == [parse_quantity(f"{angle} deg", units.ANGLE) for angle in (-45, 90)]
        assert values["radar.bandwidth"].tolist() == [150e6, 300e6]
        assert found.values(1, 2)[TIME].tolist() == [2.5]

    def test_words(self) -> None:
        text = f'allocation.model, {TIME} [ms]\nfull, 1000\n"published",2\nfull,3\n'
        values = table(TREE, text, "c.csv").values(0, 3)
        assert values["allocation.model"].tolist() == ["full", "published", "full"]
        assert values[TIME].tolist() == [1, 0.002, 0.003]

    def test_a_value_that_the_key_cannot_have_is_a_case(self) -> None:
        assert table(TREE, f"{TIME} [s]\n-1\n", "c.csv").columns[0].tolist() == [-1]

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("", "c.csv:1:1: has no header"),
            ("# a\n", "c.csv:1:1: has no header"),
            (f"{TIME} [s]\n", "c.csv:1:1: the table has no case"),
            (f"{TIME}\n1\n", f"c.csv:1:1: {TIME}: has no unit; accepted: a time in s"),
            (f"#\n{TIME} [s], {AZIMUTH}\n1,1\n", f"c.csv:2:31: {AZIMUTH}: has no unit"),
            (f"{TIME} [km]\n1\n", "must be a time, but 'km' makes it a length"),
            (f"{TIME} [sec]\n1\n", "has the unknown unit 'sec'"),
            (f"{TIME} [s\n1\n", "is no header of a column; accepted: KEY [unit]"),
            (f"{TIME} [s]; {AZIMUTH} [deg]\n1;1\n", "Cells are separated by commas"),
            ("collection.aperture_tim [s]\n1\n", "Did you mean 'collection.aperture_time'?"),
            ("name\n1\n", "c.csv:1:1: name: is no number with a unit"),
            (f"{TIME} [s],{TIME} [ms]\n1,2\n", f"c.csv:1:30: {TIME} [ms]: is given twice"),
            (f"{TIME} [s]\n1\nx\n", f"c.csv:3:1: {TIME}: is no number (got x); accepted: a number of s"),
            (f"{TIME} [s],radar.bandwidth [Hz]\n1, 2 kHz\n", "c.csv:2:4: radar.bandwidth: is no number (got 2 kHz)"),
            (f"{TIME} [s]\n1_0\n", "is no number (got 1_0)"),
            (f"{TIME} [s]\nnan\n", "is no number (got nan)"),
            (f"{TIME} [s]\n1e999\n", "is no number (got 1e999)"),
            (f"{TIME} [s],radar.bandwidth [Hz]\n1,\n", "c.csv:2:3: radar.bandwidth: is no number (got nothing)"),
            (f"{TIME} [s]\n1,2\n", "c.csv:2:3: has 2 cells; accepted: 1, as the header has"),
            (f"{TIME} [s],radar.bandwidth [Hz]\n1\n", "c.csv:2:1: has 1 cells; accepted: 2"),
            ("allocation.model [s]\nfull\n", "c.csv:1:1: allocation.model [s]: has words, which have no unit"),
            (f"{TIME} [s],allocation.model\n1,ful\n", "c.csv:2:3: allocation.model: 'ful' is not a known choice"),
        ],
    )
    def test_what_is_no_table(self, text: str, said: str) -> None:
        with pytest.raises(TableError) as error:
            table(TREE, text, "c.csv")
        assert said in str(error.value)

    def test_every_fault_is_said_up_to_twenty(self) -> None:
        text = f"{TIME} [s]\n" + "x\n1\n" * 30
        with pytest.raises(TableError) as error:
            table(TREE, text, "c.csv")
        assert [line.split(":")[1] for line in error.value.lines] == [str(2 * line) for line in range(1, 21)]

    @given(st.text(max_size=60))
    def test_any_text_is_a_table_or_has_faults(self, text: str) -> None:
        try:
            found = table(TREE, f"{TIME} [s]\n{text}", "c.csv")
        except TableError as error:
            assert error.lines
        else:
            assert found.count >= 1
            assert np.isfinite(found.columns[0]).all()

    @given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20))
    def test_values_come_back_as_they_were(self, values: list[float]) -> None:
        text = f"{TIME} [s]\n" + "".join(f"{value!r}\n" for value in values)
        assert table(TREE, text, "c.csv").columns[0].tolist() == values


class TestSamples:
    """Latin hypercubes."""

    @staticmethod
    def drawn(how: str = "latin:50:1", log: str = "") -> Cases:
        return sample(TREE, [f"{TIME}=1:10s{log}", f"{AZIMUTH}=0:180deg:7"], how)

    def test_each_part_of_each_range_has_one_case(self) -> None:
        found = self.drawn()
        assert (found.count, found.is_grid) == (50, False)
        for column, low, high in zip(found.columns, (1, 0), (10, math.pi), strict=True):
            assert sorted(np.floor((column - low) / (high - low) * 50)) == list(range(50))
        assert abs(np.corrcoef(*found.columns)[0, 1]) < 0.5  # not the same order: 3.5 sigma of 50 cases

    def test_parts_have_equal_ratios(self) -> None:
        column = self.drawn(log=":log").columns[0]
        assert sorted(np.floor(np.log10(column) * 50)) == list(range(50))

    def test_each_word_is_drawn_as_often(self) -> None:
        found = sample(TREE, [f"{TIME}=1:10s", "allocation.model=published,full,strictest"], "latin:60:1")
        words = found.columns[1].tolist()
        assert sorted(words) == ["full"] * 20 + ["published"] * 20 + ["strictest"] * 20
        assert len(set(words[:10])) > 1  # not one after the other

    def test_the_seed_decides(self) -> None:
        first, same, other = (self.drawn(f"latin:50:{seed}").columns[0].tolist() for seed in (1, 1, 2))
        assert first == same != other

    @pytest.mark.parametrize(
        ("how", "said"),
        [
            ("latin", "is no way to draw cases; accepted: latin:COUNT:SEED"),
            ("sobol:10:1", "is no way to draw cases"),
            ("latin:0:1", "the count of cases is '0'; accepted: a whole number, at least 1"),
            ("latin:10:-1", "the seed must be a whole number"),
            ("latin:1000000000000:1", "do not fit into memory; accepted: up to 5000000 cases"),
        ],
    )
    def test_what_is_no_sample(self, how: str, said: str) -> None:
        with pytest.raises(QuestionError) as error:
            self.drawn(how)
        assert said in str(error.value)

    def test_a_list_is_no_range(self) -> None:
        with pytest.raises(QuestionError, match="draws from a range"):
            sample(TREE, [f"{TIME}=1,2s"], "latin:10:1")
