"""Plots of a sweep: what they show, as arrays of made-up cases, and that a file of each kind is one."""

import math
import re
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from bisar_budget.faults import SetValue
from bisar_budget.findings.case_table import Column, Part, Swept
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.mission.tree import read_tree
from bisar_budget.questions.cases import grid
from bisar_budget.report.drawing.figure import drawing_file
from bisar_budget.report.drawing.svg import KEY_FONT_RATIO, text_width
from bisar_budget.report.drawing.trade_drawing import head_of, trade_drawing
from bisar_budget.report.drawing.trades import (
    Gathered,
    Trade,
    borders,
    check_plot,
    regions,
    rows_that_matter,
    runs,
    thinned,
)
from bisar_budget.report.tables import Described
from bisar_budget.report.words.key_names import in_words, key_beside
from tests.conftest import ROOT, examples
from tests.drawing import SVG, Drawing

FILE = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
MISSION = load_mission(str(FILE))
TREE: dict[str, Any] = read_tree(FILE.read_bytes(), "m.yaml").root
TIME, AZIMUTH = "collection.aperture_time", "platforms.receiver.azimuth"


def trade(*texts: str, column: str | None = None, is_polar: bool = False) -> Trade:
    """Utilization is the first key's SI value; above 1 it fails, below 0 there is no mission."""
    cases = grid(TREE, texts)
    values: dict[str, Any] = {**cases.values(0, cases.count)}
    use = values[cases.varied[0].key]
    values["utilization"] = np.where(use < 0, np.nan, use)
    values["status"] = np.select([use < 0, use > 1], ["error", "fail"], "pass").astype(object)
    values["worst_row"] = np.select([use < 0, use > 2], ["", "second"], "first").astype(object)
    columns = (
        *(Column(one.key, one.unit and "SI", "varies", is_text=not one.unit) for one in cases.varied),
        Column("utilization", "", "use"),
        Column("status", "", "status", True),
        Column("worst_row", "", "row", True),
    )
    keys = tuple(number.key for number in cases.varied)
    swept = Swept("m", "0" * 64, keys, cases.count, columns, iter(()))
    gathered = Gathered(Described(swept, cases, MISSION, "1"), column=column)
    middle = cases.count // 2
    for start, stop in ((0, middle), (middle, cases.count)):
        gathered.add(Part(start, stop, {name: one[start:stop] for name, one in values.items()}))
    return gathered.trade(is_polar=is_polar)


def drawn(
    shown: Trade, *, is_polar: bool = False, rows: dict[str, Any] | None = None, mission: Mission = MISSION
) -> Drawing:
    """The drawing that `sweep --plot` writes."""
    seen_from_above = mission.geometry if is_polar else None
    above = head_of(shown, mission, is_polar=is_polar)
    return Drawing(trade_drawing(shown, rows or {}, "m", "t", "d", above=above, seen_from_above=seen_from_above))


# Places are written in hundredths of a pixel, of which a decade has more than a hundred.
READ = 2e-4


def uses(drawing: Drawing, style: str) -> list[float]:
    """Utilizations of a curve, by the line of the limit and the numbers of the axis, in equal ratios. [%]"""
    (_, limit), _ = drawing.line("limit")
    decade = drawing.place("10")[1] - drawing.place("100")[1]
    assert decade > 100
    return [100 * 10 ** ((limit - y) / decade) for _, y in drawing.line(style)]


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("collection.aperture_time", "aperture time"),
        ("platforms.receiver.velocity.1", "receiver velocity y"),
        ("platforms.receiver.motion_error.velocity", "receiver velocity error"),
        ("platforms.receiver.motion_error.velocity.1", "receiver velocity error 1"),
        ("platforms.receiver.motion_error.imu.velocity_random_walk", "receiver IMU velocity random walk"),
        ("requirements.quadratic_phase_error", "required quadratic phase error"),
        ("receiver.islr", "receiver ISLR"),
    ],
)
def test_keys_and_ids_are_written_in_words(path: str, words: str) -> None:
    assert in_words(path) == words
    assert key_beside(path) == path
    assert key_beside("utilization") == ""


class TestWhatIsDrawn:
    """Arrays before anybody draws them."""

    def test_axes_rise_and_are_in_the_unit_asked_for(self) -> None:
        shown = trade(f"{TIME}=2500,500,1500 ms", "radar.bandwidth=150MHz", f"{AZIMUTH}=10,-10deg")
        assert [axis.values.tolist() for axis in shown.axes] == [[500, 1500, 2500], [-10, 10]]
        assert [(axis.key, axis.unit) for axis in shown.axes] == [(TIME, "ms"), (AZIMUTH, "deg")]
        assert shown.fixed == ("bandwidth 150 MHz",)
        assert shown.values["utilization"].tolist() == [[0.5, 0.5], [1.5, 1.5], [2.5, 2.5]]
        assert shown.values["worst_row"][:, 0].tolist() == ["first", "first", "second"]
        assert shown.statuses == ["fail", "pass"]

    def test_an_azimuth_comes_first_in_a_polar_map(self) -> None:
        shown = trade(f"{TIME}=1,2s", f"{AZIMUTH}=0:90deg:3", is_polar=True)
        assert [axis.key for axis in shown.axes] == [AZIMUTH, TIME]
        assert shown.values["utilization"].tolist() == [[1, 2]] * 3

    @pytest.mark.parametrize(
        ("text", "is_log"), [("1:100s:9:log", True), ("1:100s:9", False), ("1:4s:9:log", False), ("1,10,100s", True)]
    )
    def test_equal_ratios_are_drawn_as_such(self, text: str, is_log: bool) -> None:
        (axis,) = trade(f"{TIME}={text}").axes
        assert axis.is_log == is_log

    def test_cells_meet_half_way(self) -> None:
        assert trade(f"{TIME}=1,2,4s").axes[0].edges == pytest.approx([0.5, 1.5, 3, 5])
        ratio = trade(f"{TIME}=1:100s:3:log").axes[0].edges
        assert ratio == pytest.approx([10**-0.5, 10**0.5, 10**1.5, 10**2.5])

    def test_stretches_of_one_status(self) -> None:
        shown = trade(f"{TIME}=0.5:2.5s:5")
        assert list(runs(shown.axes[0], shown.values["status"])) == [("pass", 0.5, 1.25), ("fail", 1.25, 2.5)]

    def test_rows_that_are_the_worst_somewhere(self) -> None:
        assert rows_that_matter(trade(f"{TIME}=0.5:2.5s:5")) == ("first", "second")

    def test_regions_have_their_names_inside(self) -> None:
        """A ring around a square: the ring's own name is not in the square."""
        rows = np.full((9, 12), "ring", dtype=object)
        rows[3:6, 3:9] = "square"
        ring, square = regions(rows)
        assert (ring.row, square.row) == ("ring", "square")
        assert rows[ring.cell] == "ring"
        assert square.cell[0] == 4
        assert square.cell[1] in (5, 6)
        assert square.size == (3, 6)

    def test_parts_of_one_row_that_are_apart_have_a_name_each(self) -> None:
        rows = np.array([["a", "a", "b", "b", "a", "a", "", ""]], dtype=object)
        assert [region.row for region in regions(rows)] == ["a", "b", "a"]

    @examples(30)
    @given(st.sampled_from([1, 2, 7, 700]), st.integers(1, 9), st.integers(0, 5))
    def test_places_are_in_their_regions(self, first: int, second: int, seed: int) -> None:
        rows = np.random.default_rng(seed).choice(["a", "b"], (first, second)).astype(object)
        for region in regions(rows):
            assert rows[region.cell] == region.row
            assert 1 <= region.size[0] <= first
            assert 1 <= region.size[1] <= second

    def test_borders_are_between_cells(self) -> None:
        rows = np.array([["a", "a"], ["a", "b"]], dtype=object)
        lines = borders(rows, np.array([0.0, 1, 2]), np.array([0.0, 10, 20]))
        assert sorted(lines.tolist()) == [[[1, 10], [1, 20]], [[1, 10], [2, 10]]]


class TestPlots:
    """Drawings, by what stands where."""

    def test_curves_with_their_limit(self) -> None:
        shown = trade(f"{TIME}=0.5:2.5s:5")
        drawing = drawn(shown, rows={"receiver.velocity.x": np.linspace(0.1, 0.5, 5)})
        assert {"aperture time [s]", TIME, "utilization [%]", "worst row"} <= set(drawing.texts)
        assert {"receiver velocity x", "receiver.velocity.x"} <= set(drawing.texts)
        assert uses(drawing, "worst") == pytest.approx([50, 100, 150, 200, 250], rel=READ)
        assert uses(drawing, "row0") == pytest.approx([10, 20, 30, 40, 50], rel=READ)
        assert drawing.texts[0] == "Rigling & Moses, Section V"
        assert {"fail", "pass", "limit"} <= set(drawing.texts)
        assert [drawing.within(dot)[0] for dot in drawing.circles("dot0")] == pytest.approx([0, 0.25, 0.5, 0.75, 1])

    @pytest.mark.parametrize("longest", ["0.2", "0.9", "2.5", "7"])
    def test_utilizations_are_drawn_in_equal_ratios_with_the_limit(self, longest: str) -> None:
        """Far below it, near to it, above it: the limit and a decade below it are always there."""
        drawing = drawn(trade(f"{TIME}=0.15:{longest}s:5"))
        _, top, _, bottom = drawing.frame
        assert top < drawing.line("limit")[0][1] < bottom
        assert "0" not in drawing.texts
        assert uses(drawing, "worst") == pytest.approx(np.linspace(15, 100 * float(longest), 5), rel=READ)

    def test_the_numbers_of_equal_ratios_stand_where_they_are(self) -> None:
        drawing = drawn(trade(f"{TIME}=0.5:25s:5"))
        heights = [drawing.place(number)[1] for number in ("100", "200", "500", "1000")]
        steps = [math.log(2), math.log(2.5), math.log(2)]
        assert -np.diff(heights) / steps == pytest.approx([-np.diff(heights)[0] / steps[0]] * 3, rel=1e-3)

    def test_a_column_over_one_key(self) -> None:
        drawing = drawn(trade(f"{TIME}=0.5:2.5s:5", column="utilization"))
        assert {"utilization", "0.5", "1", "1.5", "2", "2.5"} <= set(drawing.texts)
        assert "limit" not in drawing.texts
        parts = [drawing.within(point)[1] for point in drawing.line("row0")]
        assert np.diff(parts) == pytest.approx([parts[1] - parts[0]] * 4, abs=1e-3)
        assert parts[0] < 0.1 < 0.9 < parts[-1]

    def test_a_curve_of_many_values_keeps_what_is_seen(self) -> None:
        """One value among 100 000 stands out: the curve goes there, and has no more points than a drawing shows."""
        shown = trade(f"{TIME}=0.5:0.6s:100000")
        shown.values["utilization"][77_777] = 0.9
        drawing = drawn(shown)
        assert max(uses(drawing, "worst")) == pytest.approx(90, rel=READ)
        assert len(drawing.line("worst")) < 5000
        assert drawing.circles("dot0") == []

    def test_a_map_of_statuses_names_what_binds(self) -> None:
        drawing = drawn(trade(f"{TIME}=0.1:3s:30", f"{AZIMUTH}=0:90deg:10"))
        assert {"aperture time [s]", TIME, "receiver azimuth [deg]", AZIMUTH} <= set(drawing.texts)
        assert {"first", "second", "fail", "pass", "utilization 100 %"} <= set(drawing.texts)
        assert 2.05 < 0.1 + 2.9 * drawing.within(drawing.place("second"))[0] < 3
        lowest, highest = drawing.place("0"), drawing.place("80")
        assert drawing.within(lowest)[1] == pytest.approx(0, abs=0.02)
        assert drawing.within(highest)[1] == pytest.approx(8 / 9, abs=0.02)

    def test_the_line_of_100_percent_is_where_it_is(self) -> None:
        """Utilization is the time in seconds: the line is at 1 s."""
        drawing = drawn(trade(f"{TIME}=0.55:3.05s:26", f"{AZIMUTH}=0:90deg:10"))
        places = [0.55 + 2.5 * drawing.within(point)[0] for point in drawing.lines("border")[0]]
        assert places == pytest.approx([1] * 18, rel=2e-3)  # a step of 10 %, in logarithms

    def test_the_line_leaves_out_what_is_not_evaluated(self) -> None:
        """In the midst of what fails, one case has a low utilization because the row above its limit has none."""
        shown = trade(f"{TIME}=2.0:2.8s:9", f"{AZIMUTH}=0:90deg:10")
        shown.values["utilization"][4, 5] = 0.02
        shown.values["status"][4, 5] = "fail"
        assert "utilization 100 %" in drawn(shown).texts
        shown.values["status"][4, 5] = "not_evaluated"
        assert "utilization 100 %" not in drawn(shown).texts

    @pytest.mark.parametrize("is_polar", [False, True])
    def test_words_above_a_map_leave_its_room(self, is_polar: bool) -> None:
        """However long the name of the mission is, and what was set: the map keeps half of the page."""
        words = "speed: 30 m/s, motion_azimuth: 90 deg, " * 20
        mission = MISSION._replace(name=words, changes=(SetValue("platforms.receiver", words),))
        shown = trade(f"{AZIMUTH}=0:360deg:37", f"{TIME}=1:5s:5", is_polar=is_polar)
        drawing = drawn(shown, is_polar=is_polar, mission=mission)
        _, top, _, bottom = drawing.frame
        width, height = (float(drawing.root.get(side, "")) for side in ("width", "height"))
        assert bottom - top > 0.5 * height
        for line in drawing.texts[:5]:
            x, y = drawing.place(line)
            assert x + text_width(line) < width
            assert y < top

    def test_a_map_without_a_limit_says_none(self) -> None:
        assert "utilization 100 %" not in drawn(trade(f"{TIME}=0.1:0.9s:9", f"{AZIMUTH}=0:90deg:10")).texts

    def test_a_heat_map(self) -> None:
        drawing = drawn(trade(f"{TIME}=0.1:3s:30", f"{AZIMUTH}=0:90deg:10", column="utilization"))
        assert {"utilization", "0.5", "1", "1.5", "2", "2.5", "3"} <= set(drawing.texts)
        # The lowest is in the first colour at the left, the highest in the last at the right.
        left, _, right, _ = drawing.frame
        assert drawing.boxes("heat0")[0][0] == left
        assert drawing.boxes("heat47")[0][2] == right
        assert "first" not in drawing.texts

    def test_a_heat_map_in_equal_ratios(self) -> None:
        drawing = drawn(trade(f"{TIME}=0.1:30s:30:log", f"{AZIMUTH}=0:90deg:10", column="utilization"))
        _, top, right, bottom = drawing.frame
        places = {text.findtext("{*}tspan"): text for text in drawing.root if float(text.get("x", 0)) > right}
        low, high = (float(places[number].get("y", "")) for number in ("0.2", "20"))
        assert low - high == pytest.approx((bottom - top) * math.log(100) / math.log(300), abs=0.1)

    def test_a_map_of_more_cases_than_pixels(self) -> None:
        """It has the first and the last of each key, and no more cells than are seen."""
        shown = thinned(trade(f"{TIME}=0.1:3s:1001", f"{AZIMUTH}=0:90deg:10"))
        assert shown.values["status"].shape == (500, 10)
        assert (shown.axes[0].values[0], shown.axes[0].values[-1]) == (0.1, 3)
        assert shown.values["utilization"][:, 3] == pytest.approx(shown.axes[0].values)

    def test_words_side_by_side(self) -> None:
        """Nothing is between two words: a bar for each in the colour of its status, on it the rows."""
        shown = trade(f"{TIME}=0.5,1.5s")
        axis = shown.axes[0]._replace(words=("one", "[two, three]"), values=np.arange(2.0), unit="", key="a.b")
        shown = shown._replace(axes=(axis,))
        drawing = drawn(shown, rows={"receiver.velocity.x": np.array([0.1, 0.2])})
        assert {"one", "[two, three]", "a.b", "receiver.velocity.x", "50 %", "150 %"} <= set(drawing.texts)
        limit, left = drawing.lines("limit")[0][0][0], drawing.frame[0]
        ends = [drawing.boxes(f"bar is-{name}")[0][2] for name in ("pass", "fail")]
        decade = drawing.place("100")[0] - drawing.place("10")[0]
        assert decade > 100
        assert left == pytest.approx(limit - decade * math.log10(13), abs=0.02)  # 10 % over 1.3
        assert [10 ** ((end - limit) / decade) for end in ends] == pytest.approx([0.5, 1.5], rel=READ)
        dots = [10 ** ((x - limit) / decade) for x, _ in drawing.circles("dot0")][:2]
        assert dots == pytest.approx([0.1, 0.2], rel=READ)
        assert [(low, high) for _, low, high in runs(axis, shown.values["status"])] == [(-0.5, 0.5), (0.5, 1.5)]

    def test_a_column_of_words(self) -> None:
        """Bars from 0, to both sides."""
        shown = trade(f"{TIME}=0.5,1.5s", column="utilization")
        axis = shown.axes[0]._replace(words=("a", "b"), values=np.arange(2.0))
        shown = shown._replace(axes=(axis,))
        shown.values["utilization"][1] = -0.25
        drawing = drawn(shown)
        ((zero, _, right, _),) = drawing.boxes("bar is-pass")
        ((left, _, end, _),) = drawing.boxes("bar is-fail")
        assert zero == end
        assert (right - zero) / (zero - left) == pytest.approx(2, abs=0.01)
        assert {"0.5", "−0.25"} <= set(drawing.texts)
        assert "limit" not in drawing.texts

    @pytest.mark.parametrize("column", [None, "utilization"])
    def test_a_curve_for_each_word(self, column: str | None) -> None:
        shown = trade(f"{TIME}=0.5:2.5s:5", "allocation.model=published,full", column=column)
        shown.values["utilization"][:, 1] *= 0.5
        drawing = drawn(shown)
        assert {"published", "full", "aperture time [s]", "allocation model:", "allocation.model"} <= set(
            drawing.texts
        )
        assert not any("published model" in text for text in drawing.texts)  # none decides for all
        if column is None:
            assert uses(drawing, "row0") == pytest.approx([50, 100, 150, 200, 250], rel=READ)
            assert uses(drawing, "row1") == pytest.approx([25, 50, 75, 100, 125], rel=READ)
        else:
            assert "utilization" in drawing.texts
            assert "limit" not in drawing.texts

    def test_many_words_are_an_axis_of_a_map(self) -> None:
        words = ",".join(str(number) for number in range(2, 11))
        drawing = drawn(trade(f"{TIME}=0.5:2.5s:5", f"collection.pulses={words}"))
        names = [drawing.place(word)[1] for word in words.split(",") if drawing.texts.count(word) == 1]
        assert len(names) == 8  # 2 is a time too
        assert names == sorted(names)  # the first above
        assert "utilization 100 %" not in drawing.texts  # no line can go between words

    def test_words_by_words_have_their_utilization_in_each_cell(self) -> None:
        shown = trade(f"{TIME}=0.5,1.5s", "allocation.model=published,full")
        axis = shown.axes[0]._replace(words=("a", "b"), values=np.arange(2.0))
        texts = drawn(shown._replace(axes=(axis, shown.axes[1]))).texts
        assert [text for text in texts if text.endswith(" %") or text == "first"] == ["50 %", "first"] * 2 + [
            "150 %",
            "first",
        ] * 2

    def test_a_polar_map_counts_azimuths_from_east(self) -> None:
        shown = trade(f"{AZIMUTH}=0:360deg:37", "platforms.receiver.slant_range=1:5km:5", is_polar=True)
        drawing = drawn(shown, is_polar=True)
        left, top, right, bottom = drawing.frame
        x, y = (left + right) / 2, (top + bottom) / 2
        assert drawing.place("east")[0] > right
        assert drawing.place("north")[1] < top
        assert drawing.place("west")[0] < left
        assert drawing.place("south")[1] > bottom
        radii = [math.hypot(u - x, v - y) for u, v in drawing.line("is-fail curved")]
        # Cells from the first range, 1 of 5 km, to the last, all round.
        assert (min(radii), max(radii)) == pytest.approx(((right - left) / 10, (right - left) / 2), rel=1e-3)
        assert "direction of the transmitter" in drawing.texts
        mark = drawing.lines("solid transmitter")[0]
        assert np.mean(mark, axis=0)[0] == pytest.approx(right, abs=4)  # Section V: due east
        assert np.mean(mark, axis=0)[1] == pytest.approx(y, abs=0.1)

    def test_a_quarter_of_a_polar_map_is_where_it_is(self) -> None:
        """From 90 to 180 deg: between north and west, and the radius is the time."""
        shown = trade(f"{AZIMUTH}=90:180deg:10", f"{TIME}=0.5:4s:8", is_polar=True)
        shown.values["status"][:] = "pass"
        shown.values["status"][0, -1] = "fail"  # north, at the rim
        drawing = drawn(shown, is_polar=True)
        left, top, right, bottom = drawing.frame
        x, y = (left + right) / 2, (top + bottom) / 2
        assert all(u <= x + 0.1 and v <= y + 0.1 for u, v in drawing.line("is-pass curved"))
        directions = [math.degrees(math.atan2(y - v, u - x)) for u, v in drawing.line("is-fail curved")]
        assert (min(directions), max(directions)) == pytest.approx((90, 95), abs=0.1)
        radii = [math.hypot(u - x, v - y) / (right - x) for u, v in drawing.line("is-fail curved")]
        assert (min(radii), max(radii)) == pytest.approx((3.75 / 4, 1), abs=1e-3)

    def test_what_stands_over_the_scene_is_in_the_middle_of_a_polar_map(self) -> None:
        """Seen from above, a high elevation is near the scene, a low one far out."""
        shown = trade(f"{AZIMUTH}=0:360deg:37", "platforms.receiver.elevation=10:80deg:8", is_polar=True)
        drawing = drawn(shown, is_polar=True)
        left, _, right, _ = drawing.frame
        middle = (left + right) / 2
        along = [abs(drawing.place(number)[0] - middle) for number in ("80", "60", "40", "20")]
        assert along == sorted(along)
        assert along[3] / along[0] == pytest.approx(7, rel=1e-3)
        assert np.mean(drawing.lines("solid transmitter")[0], axis=0)[0] == pytest.approx(right, abs=4)

    def test_the_regions_of_a_polar_map_have_letters(self) -> None:
        """A name would run across other regions; the legend has it in words and by its id."""
        shown = trade(f"{AZIMUTH}=0:360deg:37", f"{TIME}=1:3s:9", is_polar=True)
        shown.values["worst_row"][:] = "mission.location_error"
        texts = drawn(shown, is_polar=True).texts
        assert texts.count("mission location error") == texts.count("mission.location_error") == 1
        assert texts.count("A") >= 2
        assert {"angle: receiver azimuth [deg], radius: aperture time [s]", f"({AZIMUTH}, {TIME})"} <= set(texts)

    def test_the_legend_keeps_words_and_keys_apart(self) -> None:
        shown = trade(f"{TIME}=0.5:2.5s:5")
        names = ["receiver.quadratic_phase_error", "transmitter.islr", "receiver.vibration.sinusoidal.0"]
        drawing = drawn(shown, rows={name: np.linspace(0.1, 0.5, 5) for name in names})
        for name in names:
            words, key = drawing.place(in_words(name)), drawing.place(name)
            assert key[1] == words[1]
            assert key[0] > words[0] + 0.9 * text_width(in_words(name))
            assert key[0] + KEY_FONT_RATIO * text_width(name) < float(drawing.root.get("width", ""))

    def test_cases_without_a_mission(self) -> None:
        shown = trade(f"{AZIMUTH}=-90:90deg:19", f"{TIME}=1:2s:3")
        assert shown.statuses == ["error", "fail", "pass"]
        assert "no such mission" in drawn(shown).texts

    def test_every_status_has_its_colour(self) -> None:
        shown = trade(f"{TIME}=0.5:2.5s:9", f"{AZIMUTH}=0:90deg:2")
        shown.values["status"].ravel()[: len(STATUS)] = list(STATUS)
        style = drawn(shown).root.findtext(f"{SVG}style") or ""
        fills = re.findall(r" \.is-[a-z_]+\{(fill:[^}]+)\}", style)
        assert len(set(fills)) == len(fills) == len(STATUS)

    @pytest.mark.parametrize(("kind", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<svg")])
    def test_a_file_of_each_kind(self, kind: str, start: bytes) -> None:
        shown = trade(f"{TIME}=0.1:3s:30", f"{AZIMUTH}=0:90deg:10")
        drawing = trade_drawing(shown, {}, "m", "t", "d", above=head_of(shown, MISSION, is_polar=False))
        file = drawing_file(drawing, kind)
        assert file.startswith(start)
        assert file == drawing_file(drawing, kind)

    def test_a_picture_has_what_the_drawing_has(self) -> None:
        """Pixels of a PNG: a status where the SVG has its rectangle, in the same colour, and the line of 100 %."""
        shown = trade(f"{TIME}=0.1:3s:30", f"{AZIMUTH}=0:90deg:10")
        document = trade_drawing(shown, {}, "m", "t", "d")
        drawing = Drawing(document)
        picture = imread(BytesIO(drawing_file(document, "png")))
        assert picture.shape[:2] == tuple(2 * float(drawing.root.get(side, "")) for side in ("height", "width"))
        style = drawing.root.findtext(f"{SVG}style") or ""
        for name in ("fail", "pass"):
            (colour, opacity), *_ = re.findall(
                rf"\.is-{name}\{{fill:var\(--\w+,(#\w+)\);fill-opacity:([\d.]+)", style
            )
            expected = 1 + float(opacity) * (np.array(to_rgb(colour)) - 1)
            left, top, right, bottom = drawing.boxes(f"is-{name}")[0]
            pixel = picture[int(top + bottom), int(left + right) - (40 if name == "pass" else -40), :3]
            assert pixel == pytest.approx(expected, abs=2 / 255)
        (x, y), (_, v), *_ = drawing.lines("border")[0]
        assert picture[round(y + v), round(2 * x), :3].max() < 0.4


@pytest.mark.parametrize(
    ("texts", "is_polar", "said"),
    [
        ((f"{TIME}=1s",), False, "0 keys vary"),
        ((f"{TIME}=1,2s", f"{AZIMUTH}=1,2deg", "radar.bandwidth=1,2MHz"), False, "3 keys vary"),
        ((f"{TIME}=1:2s:10000", f"{AZIMUTH}=0:9deg:10000"), False, "draws up to 4000000 cases"),
        ((f"{TIME}=1,2s", "radar.bandwidth=1,2MHz"), True, "--polar draws a key over an azimuth"),
        ((f"{AZIMUTH}=1,2deg",), True, "--polar draws a key over an azimuth"),
        (
            (f"{AZIMUTH}=1,2deg", "platforms.transmitter.position.1=-1,1km"),
            True,
            "as a radius; accepted: values from 0",
        ),
        ((f"{AZIMUTH}=1,2deg", "allocation.model=published,full"), True, "as a radius; accepted: a number"),
    ],
)
def test_what_cannot_be_drawn(texts: tuple[str, ...], is_polar: bool, said: str) -> None:
    with pytest.raises(QuestionError) as error:
        check_plot(grid(TREE, texts), is_polar=is_polar)
    assert said in str(error.value)


def test_the_command_draws_a_file(run, tmp_path: Path) -> None:
    """Over one key its rows too; nothing goes to standard output then."""
    plot = tmp_path / "t.svg"
    found = run("sweep", str(FILE), "--vary", f"{TIME}=0.5:3s:6", "--plot", str(plot))
    assert (found.exit_code, found.stdout) == (0, "")
    assert "transmitter.acceleration.x" in plot.read_text(encoding="utf-8")
