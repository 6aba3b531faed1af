"""What `simulate --plot` draws, read back from its lines and pixels, against images and ranges computed here."""

import math

import numpy as np
import pytest

from bisar_budget.mission.load import parse_mission
from bisar_budget.report.point_figures import sheet
from bisar_budget.report.point_plot import figure
from bisar_budget.simulate.point import simulate_point
from tests.conftest import mission_text
from tests.simulate.test_point_against_images import peak_of_part

ACCELERATION = 4e-3
MISSION = parse_mission(
    mission_text(
        platforms__transmitter__motion_error={"acceleration": [ACCELERATION, 0, 0]},
        platforms__receiver__motion_error={"position": [3, -1, 0.5]},
    ),
    model="full",
)
T = 6.0


@pytest.fixture(scope="module")
def images():
    return simulate_point(MISSION)


@pytest.fixture(scope="module")
def panels(images):
    page = figure(sheet(images), "test")
    found = {panel.get_title().split(":")[0].split(" to ")[0]: panel for panel in page.axes}
    yield found
    import matplotlib.pyplot as plt

    plt.close(page)


@pytest.fixture(scope="module")
def thirds(images) -> np.ndarray:
    """Where an image from each third of the aperture alone has its peak, (3, 2), searched within 1.5 m. [m]"""
    near = images.effect.displacement
    return np.array([peak_of_part(MISSION, -T / 2 + i * T / 3, -T / 2 + (i + 1) * T / 3, near) for i in range(3)])


def pixels(panel) -> tuple[np.ndarray, np.ndarray]:
    """Centres of the drawn pixels (n, 2) and their power."""
    (mesh,) = panel.collections
    corners = np.asarray(mesh.get_coordinates())
    centres = (corners[:-1, :-1] + corners[1:, :-1] + corners[:-1, 1:] + corners[1:, 1:]) / 4
    return centres.reshape(-1, 2), 10 ** (np.ma.filled(mesh.get_array(), -math.inf).ravel() / 10)


def axis_of(places, power) -> float:
    """Azimuth of the line along which what is above -6 dB lies, 0 to 180°."""
    bright = places[power > power.max() / 4]
    east, north = np.linalg.eigh(np.cov(bright.T))[1][:, -1]
    return math.degrees(math.atan2(north, east)) % 180


def middle_of(places, power):
    bright = power > power.max() / 4
    return np.average(places[bright], axis=0, weights=power[bright])


def test_figure_3_has_tangents_over_thirds_of_the_aperture(panels) -> None:
    """Half of ã_x·x/R·τ²; the receiver's position error adds 0.1 mm of its own."""
    curve, *segments = [line.get_xydata() for line in panels["Fig. 3"].lines]
    by_hand = 1e3 * ACCELERATION / 2 * 30 / math.hypot(30, 6)  # mm/s²
    assert curve[:, 1] == pytest.approx(-by_hand * curve[:, 0] ** 2, abs=0.15)
    assert len(segments) == 3
    for i, segment in enumerate(segments):
        middle, half = -T / 3 + i * T / 3, T / 6
        assert segment[:, 0] == pytest.approx([middle - half, middle + half])
        ends = [-by_hand * (middle**2 + 2 * middle * side * half) for side in (-1, 1)]
        assert segment[:, 1] == pytest.approx(ends, abs=0.2)


def test_figure_4_has_the_points_where_thirds_of_the_aperture_put_the_response(panels, thirds) -> None:
    drawn = panels["Fig. 4"].lines[0].get_xydata()
    assert drawn - drawn[1] == pytest.approx(thirds - thirds[1], abs=0.01)
    assert drawn[1] == pytest.approx(thirds[1], abs=0.05)  # (25) and (29) are of first order: 3 m of 4


def test_figure_5_lies_where_the_thirds_say(panels, thirds) -> None:
    """A transposed or mirrored image has its response elsewhere, and its smear along another line."""
    places, power = pixels(panels["Fig. 5"])
    along = thirds[2] - thirds[0]
    assert axis_of(places, power) == pytest.approx(math.degrees(math.atan2(along[1], along[0])) % 180, abs=2)
    assert middle_of(places, power) == pytest.approx(thirds[1], abs=0.1)


def test_figure_7_rotated_back_has_its_peak_there(panels, thirds) -> None:
    places, power = pixels(panels["Fig. 7 rotated back"])
    assert places[np.argmax(power)] == pytest.approx(thirds[1], abs=0.1)


def test_figures_6_and_7_are_turned_by_the_look_direction(panels, thirds) -> None:
    """(10): x′ along φ_b, y′ across it, about the scene's centre; the smear is along y′."""
    look = MISSION.geometry.look_azimuth
    turned = np.array([[math.cos(look), math.sin(look)], [-math.sin(look), math.cos(look)]]) @ thirds[1]
    places, power = pixels(panels["Fig. 6"])
    assert axis_of(places, power) == pytest.approx(90, abs=3)
    assert middle_of(places, power) == pytest.approx(turned, abs=0.1)
    places, power = pixels(panels["Fig. 7"])
    assert places[np.argmax(power)] == pytest.approx(turned, abs=0.1)
