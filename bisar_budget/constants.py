"""Physical constants and fixed tolerances, with their units and sources, and accepted values of some options."""

SPEED_OF_LIGHT_MPS = 299_792_458.0  # exact (SI, CGPM 1983)
STANDARD_GRAVITY_MPS2 = 9.80665  # exact (CGPM 1901); data sheets state accelerometer bias in g

# A utilization that exceeds 1 by no more than this passes, so that an error exactly at its limit passes in spite of
# rounding.
UTILIZATION_TOLERANCE_FRACTION = 1e-9

# Components below this fraction of a vector's length are rounding errors (cos 90° is 6e-17).
VECTOR_ROUNDING_FRACTION = 1e-12

# Fraction of the energy of an error-free cross-range response within its first nulls, for each `simulation.window`.
# Uniform: (2/π)·Si(2π), the integral of sinc² from -1 to 1. Taylor (-35 dB, n-bar 5): integral of the squared
# transform of the continuous weights between ±1.66955 cells, divided by the full integral. Computed here, and tested
# against direct transforms.
MAINLOBE_ENERGY = {"uniform": 0.9028233335802807, "taylor": 0.9981912855769113}

ONE_PEAK_DB = 3.0  # peak loss from which on the point of least phase variance is 4 % or more off the peak

MIN_GRADIENT_ANGLE_DEG = 1.0  # smallest angle between range and Doppler gradients on the ground
MIN_GROUND_GRADIENT_RATIO = 0.02  # [m/m] range per ground distance; with less, the published model has no image plane

MAX_LOCAL_DRAWS = 10**9  # of a Monte Carlo run on one machine: it takes minutes, and gives a probability to 3e-5
MAX_DRAWS = 10**12  # of a Monte Carlo run on many machines

EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 = 3.986004418e14  # GM of WGS-84, atmosphere included
EARTH_RADIUS_M = 6.371e6  # mean radius; depth of the Earth's centre below the scene
LEAST_FALLING_HEIGHT_M = 100e3  # [m] lowest free fall; at lower heights the air carries or brakes a platform
MAX_FLIGHT_SPEED_MPS = 3e3  # every aircraft is slower, and every satellite in a low orbit is faster
MAX_DAYS = 366.0  # longest search for passes of a satellite

# Defined here, because the command line lists them without a mission, and missions are read without the command line.
GATING_MODELS = ("published", "full", "strictest")  # each is stricter than its predecessor
TARGETS = ("fail", "warn")  # for the command `solve`: the status that must not occur
