"""Physical constants and fixed tolerances, each with unit and origin, and words for options of the command line."""

SPEED_OF_LIGHT_MPS = 299_792_458.0  # exact (SI, CGPM 1983)
STANDARD_GRAVITY_MPS2 = 9.80665  # exact (CGPM 1901); data sheets state accelerometer bias in g

# A utilization this far above 1 still passes: an error set exactly at its limit passes, for any rounding of the last
# bit of a division.
UTILIZATION_TOLERANCE_FRACTION = 1e-9

# Components below this fraction of a vector's length are rounding (cos 90° is 6e-17), not geometry.
VECTOR_ROUNDING_FRACTION = 1e-12

# Share of the energy of an error-free cross-range response within its first nulls, by `simulation.window`: uniform
# (2/π)·Si(2π), the integral of sinc² from -1 to 1; Taylor -35 dB, n-bar 5, the squared transform of the continuous
# weights between ±1.66955 cells, over all of it. Computed here, tested against direct transforms.
MAINLOBE_ENERGY = {"uniform": 0.9028233335802807, "taylor": 0.9981912855769113}

ONE_PEAK_DB = 3.0  # loss of the peak beyond which the point of least phase variance is 4 % or more beside the peak

MIN_GRADIENT_ANGLE_DEG = 1.0  # between range and Doppler gradients on the ground
MIN_GROUND_GRADIENT_RATIO = 0.02  # m of range per m on the ground; with less the published model has no image plane

MAX_LOCAL_DRAWS = 10**9  # of a Monte Carlo on one machine: takes minutes, and gives a probability to 3e-5
MAX_DRAWS = 10**12  # of a Monte Carlo that many machines share

EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 = 3.986004418e14  # GM of WGS-84, atmosphere included
EARTH_RADIUS_M = 6.371e6  # mean radius; depth of the Earth's centre below the scene
LEAST_FALLING_HEIGHT_M = 100e3  # m, of a path in free fall; below it the air carries or brakes
MAX_FLIGHT_SPEED_MPS = 3e3  # every aircraft is slower, and every satellite in a low orbit is faster
MAX_DAYS = 366.0  # of a search for passes of a satellite

# Defined here, since the command line lists them without a mission, and a mission is read without the command line.
GATING_MODELS = ("published", "full", "strictest")  # each is stricter than its predecessor
TARGETS = ("fail", "warn")  # of solve: the status that must not occur
