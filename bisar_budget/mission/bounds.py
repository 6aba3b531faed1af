"""Bounds of the numbers of a mission file: nothing real comes near them, and squares stay finite."""

import math

from bisar_budget import units
from bisar_budget.mission.readers import Choice, Quantity

FREQUENCY = Quantity(units.FREQUENCY, gt=0, ge=1e3, le=1e13)
VIBRATION_FREQUENCY = Quantity(units.FREQUENCY, gt=0, le=1e9)
DURATION = Quantity(units.TIME, gt=0, ge=1e-6, le=1e6)
COORDINATE = Quantity(units.LENGTH, ge=-1e9, le=1e9)
RANGE = Quantity(units.LENGTH, gt=0, le=1e9)
SIZE = Quantity(units.LENGTH, ge=0, le=1e9)
VELOCITY = Quantity(units.SPEED, ge=-1e6, le=1e6)
SPEED = Quantity(units.SPEED, ge=0, le=1e6)
ACCELERATION = Quantity(units.ACCELERATION, ge=-1e6, le=1e6)
JERK = Quantity(units.JERK, ge=-1e6, le=1e6)
SNAP = Quantity(units.SNAP, ge=-1e6, le=1e6)
DIRECTION = Quantity(units.ANGLE, ge=-2 * math.pi, le=2 * math.pi)
LATITUDE = Quantity(units.ANGLE, ge=-math.pi / 2, le=math.pi / 2)
HEIGHT = Quantity(units.LENGTH, ge=-1e4, le=1e9)
ELEVATION = Quantity(units.ANGLE, ge=0, le=math.pi / 2)
PHASE = Quantity(units.ANGLE, ge=-1e6, le=1e6)
# With a turn at the aperture edge a response has no mainlobe; 45 without a unit would be seven.
PHASE_REQUIREMENT = Quantity(units.ANGLE, gt=0, ge=1e-6, le=2 * math.pi)
SIDELOBE_REQUIREMENT = Quantity(units.POWER_RATIO, lt=0, ge=-200)
SHARE = Quantity(units.RATIO, gt=0, ge=1e-6, le=1)
DISTRIBUTION = Choice("normal", "uniform", "bound")
DISTRIBUTIONS = "normal: the values are one sigma; uniform, bound: they are not exceeded."
