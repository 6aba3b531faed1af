"""Phase that a narrow band hides: Monte Carlo draws it, and combines it as a check does."""

import pytest

import bisar_budget as bb

TELEVISION = """\
schema_version: 1
name: passive radar by television
radar: { center_frequency: 602 MHz, bandwidth: BAND }
collection: { aperture_time: APERTURE }
platforms:
  transmitter: { position: [-18 km, 9 km, 420 m], velocity: [0, 0, 0] }
  receiver:
    position: [-2 km, -7 km, 2.5 km]
    velocity: [-65 m/s, 8 m/s, 0]
    motion_error: { imu: { accelerometer_bias: 2 ug }, velocity: [5 mm/s, 0, 0] }
"""


@pytest.mark.parametrize(("band", "aperture"), [("7.61 MHz", "60 s"), ("200 MHz", "2 s")])
def test_the_hidden_phase_of_a_sensor_is_drawn(band: str, aperture: str) -> None:
    """The rms of the draws is the phase that check judges, whether much of it is hidden or little."""
    mission = bb.loads(TELEVISION.replace("BAND", band).replace("APERTURE", aperture))
    row = bb.check(mission)["mission.quadratic_phase_error"]
    found = bb.monte_carlo(mission, 20_000)
    assert not found.is_exact
    (drawn,) = (each for each in found.requirements if each.id == row.id)
    assert drawn.sigma_rss == pytest.approx(row.declared, rel=1e-3)
    assert drawn.sigma == pytest.approx(row.declared, rel=0.02)


def test_root_sum_square_beside_the_draws_is_that_of_the_check() -> None:
    """It left out the hidden phase: 0.04 rad of 0.19 rad."""
    mission = bb.loads(TELEVISION.replace("BAND", "7.61 MHz").replace("APERTURE", "60 s"))
    row = bb.check(mission)["mission.quadratic_phase_error"]
    (drawn,) = (each for each in bb.monte_carlo(mission, 200).requirements if each.id == row.id)
    assert drawn.rss == pytest.approx(row.declared, rel=1e-9)
