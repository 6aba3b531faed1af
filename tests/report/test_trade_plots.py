"""Plots of a sweep: what they show, as arrays of made-up cases, and that a file of each kind is one."""

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bisar_budget.design.cases import grid
from bisar_budget.design.quantities import QuestionError
from bisar_budget.design.swept import Column, Part, Swept
from bisar_budget.faults import SetValue
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.tree import read_tree
from bisar_budget.report.drawing import trade_plot
from bisar_budget.report.drawing.trades import Gathered, Trade, borders, check_plot, regions, rows_that_matter, runs
from bisar_budget.report.tables.described import Described
from tests.conftest import ROOT

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
    swept = Swept("m", "0" * 64, keys, cases.shape, cases.count, columns, iter(()))
    gathered = Gathered(Described(swept, cases, MISSION, "1"), column=column)
    middle = cases.count // 2
    for start, stop in ((0, middle), (middle, cases.count)):
        gathered.add(Part(start, stop, {name: one[start:stop] for name, one in values.items()}, 0))
    return gathered.trade(is_polar=is_polar)


def drawn(shown: Trade, *, is_polar: bool = False, rows: dict[str, Any] | None = None) -> Any:
    """The panel of a figure."""
    return trade_plot.figure(shown, rows or {}, MISSION, is_polar=is_polar).axes[0]


def texts_of(panel: Any) -> str:
    legend = panel.get_legend() or panel.figure.legends[0]
    return " ".join([*(text.get_text() for text in panel.texts), *(text.get_text() for text in legend.get_texts())])


class TestWhatIsDrawn:
    """Arrays before anybody draws them."""

    def test_axes_rise_and_are_in_the_unit_asked_for(self) -> None:
        shown = trade(f"{TIME}=2500,500,1500 ms", "radar.bandwidth=150MHz", f"{AZIMUTH}=10,-10deg")
        assert [axis.values.tolist() for axis in shown.axes] == [[500, 1500, 2500], [-10, 10]]
        assert [axis.label for axis in shown.axes] == [f"{TIME} [ms]", f"{AZIMUTH} [deg]"]
        assert shown.fixed == ("radar.bandwidth 150 MHz",)
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
        assert rows[ring.place] == "ring"
        assert square.place[0] == 4
        assert square.place[1] in (5, 6)
        assert square.size == (3, 6)

    def test_parts_of_one_row_that_are_apart_have_a_name_each(self) -> None:
        rows = np.array([["a", "a", "b", "b", "a", "a", "", ""]], dtype=object)
        assert [region.row for region in regions(rows)] == ["a", "b", "a"]

    @settings(max_examples=30)
    @given(st.sampled_from([1, 2, 7, 700]), st.integers(1, 9), st.integers(0, 5))
    def test_places_are_in_their_regions(self, first: int, second: int, seed: int) -> None:
        rows = np.random.default_rng(seed).choice(["a", "b"], (first, second)).astype(object)
        for region in regions(rows):
            assert rows[region.place] == region.row
            assert 1 <= region.size[0] <= first + 2  # of 700 each third is looked at
            assert 1 <= region.size[1] <= second

    def test_borders_are_between_cells(self) -> None:
        rows = np.array([["a", "a"], ["a", "b"]], dtype=object)
        lines = borders(rows, np.array([0.0, 1, 2]), np.array([0.0, 10, 20]))
        assert sorted(lines.tolist()) == [[[1, 10], [1, 20]], [[1, 10], [2, 10]]]


class TestPlots:
    """Figures, by what Matplotlib was told to draw."""

    def test_curves_with_their_limit(self) -> None:
        shown = trade(f"{TIME}=0.5:2.5s:5")
        panel = drawn(shown, rows={"receiver.velocity.x": np.linspace(0.1, 0.5, 5)})
        assert panel.get_xlabel() == f"{TIME} [s]"
        assert panel.get_ylabel() == "utilization [%]"
        lines = {line.get_label(): line.get_ydata() for line in panel.lines}
        assert lines["worst row"].tolist() == [50, 100, 150, 200, 250]
        assert lines["receiver.velocity.x"] == pytest.approx([10, 20, 30, 40, 50])
        assert list(lines["limit"]) == [100, 100]
        assert panel.get_title(loc="left") == "Rigling & Moses, Section V"
        assert {"fail", "pass", "limit"} <= set(texts_of(panel).split())

    def test_what_is_far_above_its_limit_is_drawn_in_equal_ratios(self) -> None:
        assert drawn(trade(f"{TIME}=0.5:2.5s:5")).get_yscale() == "linear"
        assert drawn(trade(f"{TIME}=0.5:25s:5")).get_yscale() == "log"

    def test_a_column_over_one_key(self) -> None:
        panel = drawn(trade(f"{TIME}=0.5:2.5s:5", column="utilization"))
        assert panel.get_ylabel() == "utilization"
        assert panel.lines[0].get_ydata().tolist() == [0.5, 1, 1.5, 2, 2.5]

    def test_a_map_of_statuses_names_what_binds(self) -> None:
        panel = drawn(trade(f"{TIME}=0.1:3s:30", f"{AZIMUTH}=0:90deg:10"))
        assert (panel.get_xlabel(), panel.get_ylabel()) == (f"{TIME} [s]", f"{AZIMUTH} [deg]")
        assert (panel.get_xlim(), panel.get_ylim()) == ((0.1, 3), (0, 90))
        shown = texts_of(panel)
        assert {"first", "second", "fail", "pass"} <= set(shown.split())
        assert "utilization 100 %" in shown
        (label,) = [text for text in panel.texts if text.get_text() == "second"]
        assert 2.05 < label.get_position()[0] < 3

    def test_the_line_of_100_percent_is_where_it_is(self) -> None:
        """Utilization is the time in seconds: the line is at 1 s."""
        panel = drawn(trade(f"{TIME}=0.55:3.05s:26", f"{AZIMUTH}=0:90deg:10"))
        (contour,) = [one for one in panel.collections if type(one).__name__ == "QuadContourSet"]
        (path,) = contour.get_paths()
        assert path.vertices[:, 0] == pytest.approx(1, rel=2e-3)  # a step of 10 %, in logarithms

    def test_the_line_leaves_out_what_is_not_evaluated(self) -> None:
        """In the midst of what fails, one case has a low utilization because the row above its limit has none."""
        shown = trade(f"{TIME}=2.0:2.8s:9", f"{AZIMUTH}=0:90deg:10")
        shown.values["utilization"][4, 5] = 0.02
        shown.values["status"][4, 5] = "fail"
        assert "100 %" in texts_of(drawn(shown))
        shown.values["status"][4, 5] = "not_evaluated"
        assert "100 %" not in texts_of(drawn(shown))

    @pytest.mark.parametrize("is_polar", [False, True])
    def test_words_above_a_map_leave_its_room(self, is_polar: bool) -> None:
        """However long the name of the mission is, and what was set: the map keeps half of the page."""
        words = "speed: 30 m/s, motion_azimuth: 90 deg, " * 20
        mission = MISSION._replace(name=words, changes=(SetValue("platforms.receiver", words),))
        shown = trade(f"{AZIMUTH}=0:360deg:37", f"{TIME}=1:5s:5", is_polar=is_polar)
        figure = trade_plot.figure(shown, {}, mission, is_polar=is_polar)
        figure.draw_without_rendering()
        panel = figure.axes[0]
        assert panel.get_window_extent().height > 0.5 * figure.bbox.height
        assert panel.title.get_window_extent().x1 < figure.bbox.x1

    def test_a_map_without_a_limit_says_none(self) -> None:
        assert "100 %" not in texts_of(drawn(trade(f"{TIME}=0.1:0.9s:9", f"{AZIMUTH}=0:90deg:10")))

    def test_a_heat_map(self) -> None:
        figure = trade_plot.figure(
            trade(f"{TIME}=0.1:3s:30", f"{AZIMUTH}=0:90deg:10", column="utilization"), {}, MISSION, is_polar=False
        )
        _, bar = figure.axes
        assert bar.get_ylabel() == "utilization"

    def test_words_side_by_side(self) -> None:
        """Nothing is between two words: bars, and the status of each on all of its room."""
        shown = trade(f"{TIME}=0.5,1.5s")
        axis = shown.axes[0]._replace(words=("one", "[two, three]"), values=np.arange(2.0), unit="", key="a.b")
        shown = shown._replace(axes=(axis,))
        panel = drawn(shown, rows={"receiver.velocity.x": np.array([0.1, 0.2])})
        assert [tick.get_text() for tick in panel.get_xticklabels()] == ["one", "[two, three]"]
        assert panel.get_xlim() == (-0.5, 1.5)
        assert [bar.get_height() for bar in panel.containers[0]] == [50, 150]
        (line,) = [line for line in panel.lines if line.get_label() == "receiver.velocity.x"]
        assert (line.get_linewidth(), line.get_marker()) == (0, "o")
        assert [(run.low, run.high) for run in runs(axis, shown.values["status"])] == [(-0.5, 0.5), (0.5, 1.5)]

    def test_a_curve_for_each_word(self) -> None:
        shown = trade(f"{TIME}=0.5:2.5s:5", "allocation.model=published,full")
        shown.values["utilization"][:, 1] *= 2
        panel = drawn(shown)
        lines = {line.get_label(): list(line.get_ydata()) for line in panel.lines}
        assert lines["published"] == [50, 100, 150, 200, 250]
        assert lines["full"] == [100, 200, 300, 400, 500]
        assert lines["limit"] == [100, 100]
        assert panel.get_xlabel() == f"{TIME} [s]"
        assert "full" in texts_of(panel)
        assert "published model" not in texts_of(panel)  # none decides for all

    def test_many_words_are_an_axis_of_a_map(self) -> None:
        words = ",".join(str(number) for number in range(2, 11))
        panel = drawn(trade(f"{TIME}=0.5:2.5s:5", f"collection.pulses={words}"))
        assert [tick.get_text() for tick in panel.get_yticklabels()] == words.split(",")
        assert panel.get_ylim() == (8.5, -0.5)  # the first above
        assert "100 %" not in texts_of(panel)  # no line can go between words

    def test_words_by_words_have_their_utilization_in_each_cell(self) -> None:
        shown = trade(f"{TIME}=0.5,1.5s", "allocation.model=published,full")
        axis = shown.axes[0]._replace(words=("a", "b"), values=np.arange(2.0))
        panel = drawn(shown._replace(axes=(axis, shown.axes[1])))
        assert [text.get_text() for text in panel.texts[1:]] == ["50 %\nfirst"] * 2 + ["150 %\nfirst"] * 2

    def test_a_polar_map_counts_azimuths_from_east(self) -> None:
        shown = trade(f"{AZIMUTH}=0:360deg:37", "platforms.receiver.slant_range=1:5km:5", is_polar=True)
        panel = drawn(shown, is_polar=True)
        assert panel.get_theta_offset() == 0
        assert panel.get_theta_direction() == 1
        assert panel.get_rmin() == 0
        assert panel.get_rmax() == 5
        (mesh,) = [one for one in panel.collections if type(one).__name__ == "QuadMesh"]
        around = mesh.get_coordinates()[0, :, 0]
        assert (around[0], around[-1]) == pytest.approx((0, 2 * math.pi))
        (mark,) = [line for line in panel.lines if line.get_label() == "direction of the transmitter"]
        assert float(mark.get_xdata()[0]) == 0  # Section V: due east

    def test_what_stands_over_the_scene_is_in_the_middle_of_a_polar_map(self) -> None:
        """Seen from above, a high elevation is near the scene, a low one far out."""
        shown = trade(f"{AZIMUTH}=0:360deg:37", "platforms.receiver.elevation=10:80deg:8", is_polar=True)
        panel = drawn(shown, is_polar=True)
        assert panel.get_ylim() == pytest.approx((90, 10))
        (mark,) = [line for line in panel.lines if line.get_label() == "direction of the transmitter"]
        assert mark.get_ydata() == pytest.approx(10)

    def test_cases_without_a_mission(self) -> None:
        shown = trade(f"{AZIMUTH}=-90:90deg:19", f"{TIME}=1:2s:3")
        assert shown.statuses == ["error", "fail", "pass"]
        assert "no such mission" in texts_of(drawn(shown))

    def test_every_status_has_its_colour(self) -> None:
        fills = trade_plot._fills(list(STATUS))
        assert len(set(fills.values())) == len(fills)

    @pytest.mark.parametrize(("kind", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
    def test_a_file_of_each_kind(self, kind: str, start: bytes) -> None:
        shown = trade(f"{TIME}=0.1:3s:30", f"{AZIMUTH}=0:90deg:10")
        file = trade_plot.drawn(shown, {}, MISSION, kind, is_polar=False)
        assert file.startswith(start)
        assert file == trade_plot.drawn(shown, {}, MISSION, kind, is_polar=False)
        if kind == "svg":
            assert ElementTree.fromstring(file).tag == "{http://www.w3.org/2000/svg}svg"


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
