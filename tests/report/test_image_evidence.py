"""Cuts and chips as they are shown: curves where the levels are, a PNG any reader reads, words for both."""

import io
import re
import zlib
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.findings.images import ImageEvidence, PointImage, Verdict
from bisar_budget.report.drawing.evidence_drawings import chip_caption, chip_png, chip_size, impulse_response_cuts

SVG = "{http://www.w3.org/2000/svg}"


def point_image(peak_db: float = 0.0, columns: int = 3, rows: int = 4) -> PointImage:
    """Three columns, four rows, and triangles of 41 levels: 2 dB a sample, over ±2 m."""
    levels = tuple(peak_db - 2.0 * abs(index - 20) for index in range(41))
    chip = bytes(range(columns * rows))
    return PointImage(
        columns=columns, rows=rows, chip=chip, pixel_m=(0.5, 0.25), thinned=2, step_m=0.1, cut_db=levels,
        error_free_db=tuple(-2.0 * abs(index - 20) for index in range(41)),
    )  # fmt: skip


def evidence(**changes: Any) -> ImageEvidence:
    verdict = Verdict(
        id="receiver.velocity.y", model="published", boundary_error=0.0417, unit="m/s", budget_rad=0.3927,
        predicted_qpe_rad=0.4172, measured_qpe_rad=0.4181, irw_ratio=1.0042, peak_loss_db=0.0713, pslr_db=-12.91,
        islr_db=-9.34, verdict="optimistic", boundary_autofocus=0.667, measured_residual_qpe_rad=0.0153,
    )  # fmt: skip
    plain = ImageEvidence(file="a.yaml", verdict=verdict, look_azimuth_rad=0.39, at_limit=point_image(-1.0))
    return plain._replace(**changes)


def refocused() -> ImageEvidence:
    return evidence(before_autofocus=point_image(-8.0), after_autofocus=point_image(-0.5))


def curves(root: ElementTree.Element) -> list[tuple[str, np.ndarray]]:
    """Curves of more points than a grid line has, with their style."""
    found = []
    for element in root.iter(f"{SVG}path"):
        numbers = [float(part) for part in re.findall(r"-?[\d.]+", element.get("d", ""))]
        if len(numbers) > 8 and element.get("class") != "grid":
            found.append((element.get("class", ""), np.array(numbers).reshape(-1, 2)))
    return found


def test_curves_lie_where_the_levels_are() -> None:
    """Axes read by their ticks: y′ across, dB up, 0 dB at the peak without error."""
    root = ElementTree.fromstring(impulse_response_cuts(evidence()))
    axis = [t for t in root.iter(f"{SVG}text") if t.get("class") == "axis" and not t.get("transform")]
    value = lambda text: float("".join(text.itertext()).replace("−", "-"))  # noqa: E731
    levels = sorted((float(t.get("y", "")) - 3.5, value(t)) for t in axis if t.get("text-anchor") == "end")
    (top, zero), (bottom, lowest) = levels[0], levels[-1]
    assert (zero, lowest) == (0, -40)
    places = sorted(
        (float(t.get("x", "")), value(t))
        for t in axis
        if t.get("text-anchor") == "middle" and "[" not in "".join(t.itertext())
    )
    per_metre = (places[-1][0] - places[0][0]) / (places[-1][1] - places[0][1])
    middle = next(x for x, place in places if place == 0)
    (_, cut), (_, clean) = curves(root)
    for points, peak in ((clean, 0.0), (cut, -1.0)):
        crest = points[points[:, 1].argmin()]
        assert crest[0] == pytest.approx(middle, abs=0.02)
        assert crest[1] == pytest.approx(top + (bottom - top) * -peak / 40, abs=0.02)
        # 20 dB/m: 10 dB below the crest half a metre beside it.
        right = points[points[:, 0] > middle]
        assert np.interp(crest[1] + (bottom - top) / 4, right[:, 1], right[:, 0]) == pytest.approx(
            middle + 0.5 * per_metre, abs=0.05
        )
        assert points[:, 1].max() <= bottom + 0.01  # cut off at the floor


@pytest.mark.parametrize(("found", "count"), [(evidence(), 2), (refocused(), 5)])
def test_curves_differ_without_colour(found: ImageEvidence, count: int) -> None:
    root = ElementTree.fromstring(impulse_response_cuts(found))
    styles = [style for style, _ in curves(root)]
    assert len(styles) == count
    for panel in (styles[:2], styles[2:]):
        dashes = [next((word for word in style.split() if word in ("dotted", "dashed")), "solid") for style in panel]
        assert len(set(dashes)) == len(panel)


def test_words_say_the_numbers_of_the_verdict() -> None:
    root = ElementTree.fromstring(impulse_response_cuts(refocused()))
    description = root.find(f"{SVG}desc")
    assert description is not None
    for words in (
        "At the limit, 41.7 mm/s: predicted 0.417 rad, measured 0.418 rad, budget 0.392 rad.",
        "peak −0.07 dB", "width 1.004 times", "PSLR −12.9 dB", "ISLR −9.3 dB",
        "At the limit with autofocus, 667 mm/s: 0.015 rad left, budget 0.392 rad.",
    ):  # fmt: skip
        assert words in (description.text or "")
    title = root.find(f"{SVG}title")
    assert title is not None
    assert title.text == "Cross-range cuts: receiver.velocity.y"


def test_ids_differ_between_rows_and_files() -> None:
    drawings = [impulse_response_cuts(evidence(file=file)) for file in ("a.yaml", "b.yaml")]
    drawings.append(impulse_response_cuts(evidence(verdict=evidence().verdict._replace(id="receiver.velocity.x"))))
    ids = [name for drawing in drawings for name in re.findall(r'\bid="([^"]+)"', drawing)]
    assert len(set(ids)) == len(ids) == 6
    assert drawings[0] == impulse_response_cuts(evidence())


@given(st.text(max_size=30))
def test_any_id_stays_text(name: str) -> None:
    """Ids of `other_errors` are the user's own words."""
    drawing = impulse_response_cuts(evidence(file=name, verdict=evidence().verdict._replace(id=f"other.{name}")))
    title = ElementTree.fromstring(drawing).find(f"{SVG}title")
    assert title is not None
    if name.isprintable():
        assert title.text == f"Cross-range cuts: other.{name}"


def test_a_chip_is_a_png_that_others_read() -> None:
    from matplotlib.image import imread

    image = point_image()
    png = chip_png(image)
    grey = imread(io.BytesIO(png), format="png")
    assert grey.shape == (4, 3)
    assert np.rint(grey * 255).astype(int).ravel().tolist() == list(range(12))
    assert png == chip_png(point_image())


def test_a_png_is_checked_and_carries_no_date() -> None:
    """Three chunks, each with its CRC; a largest chip stays below 10 kB."""
    png = chip_png(point_image()._replace(columns=96, rows=96, chip=bytes(96 * 96)))
    assert len(png) < 10_000
    kinds, at = [], 8
    while at < len(png):
        length = int.from_bytes(png[at : at + 4], "big")
        kinds.append(png[at + 4 : at + 8])
        content = png[at + 4 : at + 8 + length]
        assert zlib.crc32(content) == int.from_bytes(png[at + 8 + length : at + 12 + length], "big")
        at += 12 + length
    assert kinds == [b"IHDR", b"IDAT", b"IEND"]


def test_a_caption_says_size_and_orientation() -> None:
    assert chip_caption(point_image()) == (
        "1.5 m along x′ (look, to the right) by 1 m along y′ (cross-range, up); "
        "−40 dB (black) to 0 dB (white) of the peak without error"
    )
    assert point_image().extent_m == (1.5, 1.0)


def test_resolution_cells_are_squares_on_a_page() -> None:
    """Three samples across, four rows of two samples each."""
    assert chip_size(point_image(), 10) == (30, 80)
