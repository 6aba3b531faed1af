"""Figures 3 to 7: what is drawn stands where it should, is as large as it should be, and is not mirrored."""

import math
import re
import tracemalloc
from functools import cache

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from bisar_budget.cli.images import simulate
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.report.drawing import point_plot
from bisar_budget.report.drawing.figure import figure_file
from bisar_budget.report.drawing.point_plot import ImagePanel, rotated_back, sheet
from bisar_budget.simulator import former, image_formation
from bisar_budget.simulator import point as point_module
from bisar_budget.simulator.former import IMAGE_FORMERS
from bisar_budget.simulator.image_formation import ground_grid
from bisar_budget.simulator.impulse_response import resampled
from bisar_budget.simulator.point import PointImages, simulate_point
from bisar_budget.simulator.targets import Target, Targets, parse_targets
from tests import reference
from tests.conftest import ROOT, mission_text
from tests.simulate.conftest import images_of

SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
# Nothing about these three is the same after a transposition, a mirror or a half turn.
THREE = Targets((Target(0, 0, 0), Target(9, 2, -3), Target(-1, 6, -6)))


@pytest.fixture
def polar():
    return images_of(SECTION_V.read_text(encoding="utf-8"), "full", image_former="polar_format")


@pytest.fixture
def moved():
    """The transmitter is measured 5 m too far along its track, besides other errors."""
    return images_of(mission_text(platforms__transmitter__motion_error={"position": [1, 5, 2]}))


def indicated(mission, time: float, step: float = 1e-3):
    """Ground point of (29) by finite differences of exact ranges: no look vector, no rate, no Q of the package."""
    geometry = mission.geometry

    def ranges(tau, point=(0.0, 0.0)):
        total, declared = 0.0, mission.platforms.transmitter.motion_error
        for state, error in ((geometry.transmitter, declared), (geometry.receiver, None)):
            p, v = np.array(state.position), np.array(state.velocity)
            at = p + v * tau
            measured = at.copy()
            if error is not None:
                for value, factor in ((error.position, 1), (error.velocity, tau), (error.acceleration, tau**2 / 2)):
                    measured = measured + factor * np.array(value or (0, 0, 0))
            total += np.array([np.linalg.norm(at), np.linalg.norm(measured - [*point, 0])])
        return total

    def remainder(tau, point):
        recorded, by_paths = ranges(tau, point)
        return recorded - by_paths

    def both(point):
        """Value and slope of what is left at a point."""
        ahead, behind = remainder(time + step, point), remainder(time - step, point)
        return np.array([remainder(time, point), (ahead - behind) / (2 * step)])

    point = np.zeros(2)
    for _ in range(3):
        q = np.stack([(both(point + e) - both(point - e)) / 2 for e in np.eye(2)], axis=1)
        point = point - np.linalg.solve(q, both(point))
    return point


class TestFigure4:
    def test_its_points_are_those_of_the_paper_s_example(self, polar) -> None:
        """Scale, sign and place, by an independent computation with the true Q, to its three decimals."""
        want = [(0.335, -0.826), (0.0, 0.0), (-0.346, 0.824)]
        assert polar.points == pytest.approx(np.array(want), abs=6e-4)
        assert sheet(polar).points == pytest.approx(np.array(want), abs=6e-4)

    @pytest.mark.parametrize("error", [{"acceleration": [5e-3, 0, 0]}, {"position": [1, 5, 2]}, {"velocity": 0.01}])
    def test_its_points_are_where_exact_ranges_have_value_and_slope(self, error) -> None:
        """First order in the way from the displaced point to them, at most a metre of 8 km: 1e-4 of it."""
        text = mission_text(platforms__transmitter__motion_error=error, allocation__model="full")
        mission, images = parse_mission(text), images_of(text, rotated_only=True)
        want = np.array([indicated(mission, tau) for tau in (-2.0, 0.0, 2.0)])
        assert images.points == pytest.approx(want, abs=1e-3)


class TestFigure3:
    def test_segments_are_thirds_of_the_aperture_and_touch_the_curve(self, polar) -> None:
        drawn = sheet(polar)
        assert drawn.segments[:, :, 0] == pytest.approx(np.array([[-3, -1], [-1, 1], [1, 3]]))
        # -ã cos(φ) cos(θ) τ²/2, in mm: at ±2 s 9.811, with a slope of ±9.811 mm/s.
        by_hand = 1e3 * 0.005 / 2 * 30.414 / 31.0
        for time, (start, end) in zip((-2, 0, 2), drawn.segments, strict=True):
            middle, slope = (start[1] + end[1]) / 2, (end[1] - start[1]) / 2
            assert middle == pytest.approx(-by_hand * time**2, abs=0.01)
            assert slope == pytest.approx(-2 * by_hand * time, abs=0.01)

    def test_the_curve_is_the_quadratic_component(self, polar) -> None:
        drawn = sheet(polar)
        assert drawn.range_error_mm == pytest.approx(-2.5 * 30.414 / 31.0 * drawn.slow_time**2, abs=0.02)


def centres(picture: ImagePanel):
    return (
        picture.corners[1:, 1:] + picture.corners[:-1, 1:] + picture.corners[1:, :-1] + picture.corners[:-1, :-1]
    ) / 4


def summit(picture: ImagePanel, near) -> tuple[np.ndarray, float]:
    """Place and level of the highest pixel within 1.5 m, between pixels by a parabola each way."""
    places = centres(picture)
    away = np.hypot(*np.moveaxis(places - near, -1, 0))
    level = np.where(away < 1.5, np.nan_to_num(picture.level_db, nan=-120), -200)
    i, j = np.unravel_index(np.argmax(level), level.shape)
    place = places[i, j].copy()
    for before, after, step in (
        (picture.level_db[i - 1, j], picture.level_db[i + 1, j], places[i + 1, j] - places[i, j]),
        (picture.level_db[i, j - 1], picture.level_db[i, j + 1], places[i, j + 1] - places[i, j]),
    ):
        place += step * (before - after) / (2 * (before + after - 2 * picture.level_db[i, j]))
    return place, float(level[i, j])


class TestPictures:
    @pytest.mark.parametrize("image_former", ["backprojection", "polar_format", "far_field"])
    def test_targets_stand_where_they_are_in_every_picture(self, monkeypatch, image_former: str) -> None:
        """No error: places to a fifth of a drawn pixel, half of which the extents used to be off; levels to 0.5 dB.

        Far from the centre plane waves put a point |x|²/2R away: 5 mm at 9 m of 8 km.
        """
        # A narrow margin: the sums of (12) take a microsecond a pixel and pulse.
        monkeypatch.setattr(point_module, "_MARGIN_CELLS", 6)
        monkeypatch.setattr(point_module, "_MIN_PULSES", 128)
        images = simulate_point(parse_mission(mission_text()), image_former=image_former, targets=THREE)
        drawn = sheet(images)
        look = math.atan2(6 / math.sqrt(76), 30 / math.sqrt(936) + 6 / math.sqrt(76))  # (11) of the base mission
        assert images.look_azimuth == pytest.approx(look, abs=1e-9)
        turned = np.array([[math.cos(look), math.sin(look)], [-math.sin(look), math.cos(look)]])  # (10)
        for picture, turn in (
            (drawn.in_scene, np.eye(2)),
            (drawn.rotated, turned),
            (drawn.focused, turned),
            (drawn.rotated_back, np.eye(2)),
        ):
            pixel = np.hypot(*(picture.corners[1, 1] - picture.corners[0, 0])) / math.sqrt(2)
            for target, marked in zip(THREE.points, picture.true_places, strict=True):
                want = turn @ (target.east, target.north)
                assert marked == pytest.approx(want, abs=1e-9)
                place, level = summit(picture, want)
                slack = 0.0 if image_former == "backprojection" else 0.01
                assert np.hypot(*(place - want)) < 0.2 * pixel + slack, (picture.title, target, pixel)
                assert level == pytest.approx(target.level_db, abs=0.5)

    def test_extents_are_pixel_edges(self, polar) -> None:
        picture = sheet(polar).in_scene
        left, right, bottom, top = picture.extent
        nx, ny = picture.level_db.shape
        places = centres(picture)
        width, height = places[1, 0, 0] - places[0, 0, 0], places[0, 1, 1] - places[0, 0, 1]
        assert (right - left, top - bottom) == pytest.approx((nx * width, ny * height))
        assert (left, bottom) == pytest.approx(tuple(places[0, 0] - (width / 2, height / 2)))

    def test_a_peak_beside_25_is_marked(self, moved) -> None:
        """A narrow band or a long aperture makes the image peak elsewhere: then the circle alone marks nothing."""
        at = np.array(moved.responses[0].shown)
        assert sheet(moved).in_scene.image_points.shape == (0, 2)  # both say the same
        aside = np.array((0.0, 5.0))
        drawn = sheet(moved._replace(points=moved.points + aside))
        assert drawn.in_scene.image_points == pytest.approx(at[None])
        assert drawn.in_scene.shown_places == pytest.approx(at[None] + aside, abs=0.01)
        look = moved.look_azimuth
        turned = [math.cos(look) * at[0] + math.sin(look) * at[1], math.cos(look) * at[1] - math.sin(look) * at[0]]
        assert drawn.rotated.image_points[0] == pytest.approx(turned)
        key = next(panel for panel in point_plot.figure(drawn, "").axes if panel.get_legend())
        assert key.get_legend().get_texts()[-1].get_text() == "peak of the image"

    def test_a_displaced_response_stands_where_25_puts_it(self, moved) -> None:
        """Two metres north of its place; it was drawn at 0, 0."""
        mission = parse_mission(mission_text(platforms__transmitter__motion_error={"position": [1, 5, 2]}))
        want = indicated(mission, 0.0)
        assert np.hypot(*want) > 2
        drawn = sheet(moved)
        for picture in (drawn.in_scene, drawn.rotated_back):
            assert summit(picture, want)[0] == pytest.approx(want, abs=0.02)
            assert picture.shown_places[0] == pytest.approx(want, abs=1e-3)
            assert picture.true_places[0] == pytest.approx((0.0, 0.0))
            left, right, bottom, top = picture.limits
            assert left < 0 < right
            assert bottom < 0 < top
        look = moved.look_azimuth
        across = -math.sin(look) * want[0] + math.cos(look) * want[1]
        clean = drawn.cuts[0]
        assert clean.positions[np.argmax(clean.levels_db)] == pytest.approx(across, abs=0.02)

    def test_rotated_back_is_the_image_without_error(self) -> None:
        """Autofocus in (x′, y′), then back to (x, y): within 3 % of the image that never had the error."""
        error = {"acceleration": [5e-3, 0, 0]}
        images = images_of(mission_text(platforms__transmitter__motion_error=error))
        clean = images_of(mission_text())
        middle = clean.scene_grid[60:-60, 60:-60]
        want = np.abs(clean.in_scene[60:-60, 60:-60])
        # Autofocus keeps the place of the smear's centre of gravity, 4 mm from the true place, 1 % of a cell.
        assert np.abs(np.abs(resampled(images.focused, images.grid, middle)) - want).max() < 0.03
        assert np.abs(images.in_scene).max() < 0.6
        assert np.abs(rotated_back(images)).max() == pytest.approx(1, abs=0.02)


def test_resampling_reads_a_known_response_to_its_word() -> None:
    """A sampled sinc, three samples a cell, read on a grid turned by 0.4 rad: -60 dB."""

    def response(grid):
        return np.sinc(grid[..., 0] / 0.6) * np.sinc((grid[..., 1] - 0.3) / 0.9)

    grid = ground_grid((0.0, 0.0), 0.0, (40.0, 60.0), (200, 200))
    points = ground_grid((0.5, -0.2), 0.4, (6.0, 6.0), (31, 31))
    # The patch cuts sinc sidelobes off at 33 cells: 1/(33π), of which its repeats add some at the edge only.
    assert np.abs(resampled(response(grid).astype(complex), grid, points) - response(points)).max() < 2e-3
    far = points + 100
    assert not resampled(response(grid).astype(complex), grid, far).any()


class TestDrawing:
    def test_the_figure_draws_the_sheet(self, polar) -> None:
        """Every panel has the sheet's numbers: none transposed, mirrored or stretched on the way to the page."""
        drawn = sheet(polar, is_paper=True)
        page = point_plot.figure(drawn, "title")
        panels = {panel.get_title().split(":")[0]: panel for panel in page.axes}
        curve, *segments = panels["Fig. 3"].lines
        assert curve.get_xydata() == pytest.approx(np.c_[drawn.slow_time, drawn.range_error_mm])
        assert np.array([one.get_xydata() for one in segments]) == pytest.approx(drawn.segments)
        assert panels["Fig. 4"].lines[0].get_xydata() == pytest.approx(drawn.points)
        for name, picture in (
            ("Fig. 5", drawn.in_scene),
            ("Fig. 6", drawn.rotated),
            ("Fig. 7", drawn.focused),
            ("Fig. 7 rotated back to (x, y)", drawn.rotated_back),
        ):
            panel = panels[name]
            (mesh,) = panel.collections
            np.testing.assert_allclose(np.asarray(mesh.get_coordinates()), picture.corners, atol=1e-9)
            shown = np.ma.filled(mesh.get_array().astype(float), math.nan).reshape(picture.level_db.shape)
            np.testing.assert_array_equal(shown, picture.level_db)
            assert (panel.get_xlabel(), panel.get_ylabel()) == picture.axes
            assert not panel.xaxis_inverted()
            assert not panel.yaxis_inverted()
            assert panel.get_aspect() == 1
            assert panel.lines[-1].get_xydata() == pytest.approx(picture.true_places)
            assert panel.lines[-2].get_xydata() == pytest.approx(picture.shown_places)

    def test_without_the_paper_no_text_has_its_numbers(self, polar) -> None:
        """Titles, axes and legend have no figure numbers, equation numbers, x or y; the panels show the same data."""
        plain, paper = sheet(polar), sheet(polar, is_paper=True)
        texts = {
            is_paper: [text.get_text() for text in point_plot.figure(drawn, "title").findobj(Text)]
            for is_paper, drawn in ((False, plain), (True, paper))
        }
        assert not [text for text in texts[False] if re.search(r"Fig\.|\(\d\d\)|\(x|^[xy] \[", text)]
        assert {"Image with the declared errors,\nbefore autofocus", "east [m]", "north [m]"} <= set(texts[False])
        assert {"Fig. 3: range error, three segments", "position by (25)", "x [m]"} <= set(texts[True])
        np.testing.assert_array_equal(plain.in_scene.level_db, paper.in_scene.level_db)

    def test_nothing_on_the_sheet_overlaps(self, moved) -> None:
        """Titles, labels and the legend are apart, and the panels fill the sheet up to its edges."""
        page = point_plot.figure(sheet(moved), "title")
        FigureCanvasAgg(page).draw()
        boxes = [panel.get_tightbbox() for panel in page.axes if panel.axison]
        boxes += [panel.get_legend().get_window_extent() for panel in page.axes if panel.get_legend()]
        for index, box in enumerate(boxes):
            assert not [other for other in boxes[:index] if Bbox.intersection(box, other)]
        width, height = page.bbox.size
        assert min(box.x0 for box in boxes) < 0.02 * width
        assert max(box.x1 for box in boxes) > 0.98 * width
        assert min(box.y0 for box in boxes) < 0.02 * height

    def test_a_target_that_is_far_away_is_pointed_at(self) -> None:
        error = {"position": [0, 400, 0]}
        images = images_of(mission_text(platforms__transmitter__motion_error=error))
        page = point_plot.figure(sheet(images), "title")
        said = [text.get_text() for panel in page.axes for text in panel.texts]
        away = np.hypot(*images.points[1])
        assert said.count(f"the target is {away:.3g} m away") >= 4
        assert figure_file(page, "svg").decode("utf-8").endswith("</svg>\n")

    def test_the_option_paper_needs_a_plot(self, run) -> None:
        result = run("simulate", SECTION_V, "--paper")
        assert result.exit_code == 2
        assert "--paper changes the titles of --plot, which is missing." in result.stderr

    @pytest.mark.parametrize("name", point_plot.PANELS)
    def test_one_panel_by_itself(self, polar, tmp_path, name: str) -> None:
        (tmp_path / "one.png").write_bytes(point_plot.drawn_panel(name, sheet(polar)))
        assert (tmp_path / "one.png").stat().st_size > 1000


SHORT = {"collection__aperture_time": "1 s", "radar__bandwidth": "20 MHz"}


def few_of_them(patch: pytest.MonkeyPatch) -> None:
    """As few pulses as the patch takes, and of the image in (x, y) a middle no larger than the rotated images.

    What sums over all pulses may hold is as much smaller, so that the images count as much beside it.
    """
    patch.setattr(point_module, "_MIN_PULSES", 64)
    patch.setattr(point_module, "_SCENE_PIXELS", 96 * 96)
    patch.setattr(image_formation, "_BLOCK_TERMS_COUNT", image_formation._BLOCK_TERMS_COUNT // 16)
    patch.setattr(former, "_DIRECT_BYTES", former._DIRECT_BYTES / 16)


@cache
def of_a_short_aperture(image_former: str) -> tuple[PointImages, int]:
    """Images once by each image former, and the peak of memory. [B]"""
    mission = parse_mission(mission_text(**SHORT))
    with pytest.MonkeyPatch.context() as patch:
        few_of_them(patch)
        tracemalloc.start()
        try:
            images = simulate_point(mission, image_former=image_former)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    return images, peak


class TestImageFormers:
    def test_all_of_them_show_section_v(self, polar) -> None:
        """The smear costs 5.7 dB and autofocus takes it back; polar format trims the aperture a little."""
        for name in IMAGE_FORMERS:
            if name == "matched_filter":
                continue  # below, on fewer pixels
            text = SECTION_V.read_text(encoding="utf-8")
            images = images_of(text, image_former=name, rotated_only=True) if name != "polar_format" else polar
            clean = images.clean_response.peak
            assert 20 * math.log10(images.response.peak / clean) == pytest.approx(-5.7, abs=0.1)
            assert 20 * math.log10(images.focused_response.peak / clean) == pytest.approx(0, abs=0.1)

    def test_the_matched_filter_is_backprojection(self) -> None:
        images = [of_a_short_aperture(name)[0] for name in ("matched_filter", "backprojection")]
        for name in ("in_scene", "rotated"):
            assert np.abs(getattr(images[0], name) - getattr(images[1], name)).max() < 1e-5  # -100 dB

    def test_plane_waves_put_a_far_point_elsewhere_and_it_is_there(self, monkeypatch) -> None:
        """What (5) drops, |x across the leg|²/2R, is range: it displaces along x′, and the image has it there."""
        east, north = -100.0, 200.0
        mission = parse_mission(mission_text())
        monkeypatch.setattr(point_module, "_MIN_PULSES", 64)
        images = simulate_point(mission, image_former="far_field", targets=Targets((Target(east, north),)))
        (one,) = images.responses
        legs = [np.array(p.position) for p in (mission.geometry.transmitter, mission.geometry.receiver)]
        dropped = sum(
            (east**2 + north**2 - (p[:2] @ (east, north) / np.linalg.norm(p)) ** 2) / (2 * np.linalg.norm(p))
            for p in legs
        )
        steepness = np.hypot(*mission.geometry.range_gradient)
        look = np.array([math.cos(images.look_azimuth), math.sin(images.look_azimuth)])
        off = (np.array(one.shown) - (east, north)) @ look
        assert off == pytest.approx(-dropped / steepness, rel=0.1)
        place, level = summit(sheet(images).in_scene, np.array(one.shown))
        assert np.hypot(*(place - one.shown)) < 0.1
        assert level == pytest.approx(0, abs=0.3)

    def test_what_polar_format_refuses_is_said(self, run, tmp_path) -> None:
        """Beyond 60° of squint with so little bandwidth no rectangle fits."""
        squinted = tmp_path / "squinted.yaml"
        changes = {
            "radar__bandwidth": "3 MHz",
            "collection__aperture_time": "60 s",
            "platforms__transmitter__velocity": [-130, 75, 0],
            "platforms__receiver__velocity": [-58, 15, 0],
        }
        squinted.write_text(mission_text(**changes), encoding="utf-8")
        result = run("simulate", squinted, "--image-former", "polar_format")
        assert result.exit_code == 2
        assert "polar format cannot form this image: no rectangle" in result.stderr

    @pytest.mark.parametrize("name", IMAGE_FORMERS)
    def test_their_memory_is_estimated_and_the_estimate_holds(self, run, tmp_path, monkeypatch, name: str) -> None:
        _, peak = of_a_short_aperture(name)
        few_of_them(monkeypatch)
        small = tmp_path / "small.yaml"
        small.write_text(mission_text(simulation={"memory_limit": "1 MB"}, **SHORT), encoding="utf-8")
        said = run("simulate", small, "--image-former", name).stderr
        estimate = 1e6 * float(re.search(r"need about ([\d.]+) MB", said)[1])
        assert peak < estimate

    def test_the_command_knows_all_of_them(self) -> None:
        (choice,) = [option.type for option in simulate.params if option.name == "image_former"]
        assert tuple(choice.choices) == IMAGE_FORMERS

    def test_an_unknown_one_is_refused(self, run) -> None:
        assert run("simulate", SECTION_V, "--image-former", "omega_k").exit_code == 2
        with pytest.raises(ValueError, match="omega_k"):
            simulate_point(parse_mission(mission_text()), image_former="omega_k")


class TestTargets:
    def test_a_list_is_read_with_units(self) -> None:
        read = parse_targets("0, 0; 0.03 km, -20, -6 dB ;clutter -25 dB;")
        assert read == Targets((Target(0, 0, 0), Target(30, -20, -6)), -25)

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("", "no point"),
            ("clutter -20", "no point"),
            ("1", "1 parts"),
            ("1,2,3,4", "4 parts"),
            ("1 s, 2", "'1 s'"),
            ("nan, 2", "'nan'"),
            ("0,0; clutter -20; clutter -30", "twice"),
            ("0,0; clutter loud", "'loud'"),
            ("1e9, 0", "beyond"),
            (";".join(["0,0"] * 101), "at most 100"),
        ],
    )
    def test_what_cannot_be_read_is_said(self, run, text: str, said: str) -> None:
        result = run("simulate", SECTION_V, "--targets", text)
        assert result.exit_code == 2
        assert said in result.stderr

    def test_a_scene_is_refocused_by_one_correction(self, run, tmp_path, monkeypatch) -> None:
        """Spatial invariance: the same phase and displacement at each target, and one phase takes it from all.

        What is measured is measured in (x′, y′): of the image in (x, y) a small middle is enough.
        """
        monkeypatch.setattr(point_module, "_SCENE_PIXELS", 1 << 12)
        archive = tmp_path / "scene.npz"
        targets = "0, 0; 9 m, -5 m, -6 dB; -7, 8; clutter -40 dB"
        result = run("simulate", SECTION_V, "--targets", targets, "-o", archive)
        assert result.exit_code == 0, result.output
        mission = load_mission(str(SECTION_V))
        moved = reference.at_declared(mission, list(reference.errors_of(mission))).place[0].sum(axis=0)
        table = [line.split() for line in result.stdout.splitlines()[-3:]]
        assert [row[:3] for row in table] == [["0", "0", "0"], ["9", "-5", "-6"], ["-7", "8", "0"]]
        for _, _, _, east, north, phase, before, _, after, width in (map(float, row) for row in table):
            assert (east, north) == pytest.approx(moved, abs=0.0006), "of three decimals"
            assert phase == pytest.approx(-4.626, abs=0.001)  # 11 m from the centre less than 0.1 mrad
            assert before == pytest.approx(-5.7, abs=0.3)  # clutter of -40 dB: 0.17 dB for the one of -6 dB
            assert after == pytest.approx(0, abs=0.3)
            assert width == pytest.approx(0.403, abs=0.02)
        with np.load(archive) as saved:
            assert saved["targets_m"].tolist() == [[0, 0], [9, -5], [-7, 8]]
            assert saved["rotated_back"].shape == saved["in_scene"].shape

    def test_clutter_has_the_power_it_is_given(self) -> None:
        """Mean power of pixels over some 600 cells: 4 % rms, held to four of them."""
        weak = Targets((Target(0, 0, -60),), clutter_db=-20)
        images = images_of(mission_text(), targets=weak, rotated_only=True)
        inner = np.abs(images.error_free[15:-15, 15:-15]) ** 2
        assert inner.mean() == pytest.approx(1e-2, rel=0.16)
        again = images_of.__wrapped__(mission_text(), targets=weak, rotated_only=True)
        assert np.array_equal(images.rotated, again.rotated)
        other = images_of(mission_text(simulation={"seed": 2}), targets=weak, rotated_only=True)
        assert not np.allclose(images.rotated, other.rotated)

    def test_targets_close_together_are_not_measured(self) -> None:
        """Half a cell apart they are one response; nothing is claimed that cannot be read."""
        images = images_of(mission_text(), targets=parse_targets("0,0;0.1,0.1"), rotated_only=True)
        assert len(images.responses) == 2
        text = point_plot.summary(images, parse_mission(mission_text()))
        assert all(len(line) <= 80 for line in text.splitlines())


def test_a_smear_over_most_of_the_patch_is_measured() -> None:
    """Its peak lies at one end of 34 cells; the cut wrapped around, and the command ended with an error."""
    error = {"acceleration": [5e-3, 0, 0], "velocity": [2, 5, 2]}
    images = images_of(mission_text(platforms__transmitter__motion_error=error), rotated_only=True)
    assert abs(images.effect.quadratic) > 40
    assert images.response.peak < 0.2
