"""Keys and words that the contract of the mission file has and this version does not compute, each with a way out.

One of them in a file is an error that says so. An unknown key would be told which other key was perhaps meant.
"""

from collections.abc import Mapping

PROBLEM = "is not computed by this version yet"
_LEAVE = "accepted: leave it out"
_MOTION = f"{_LEAVE}, and state what it does as position, velocity and acceleration errors"
_OSCILLATOR = f"{_LEAVE}, and state the noise with it, as phase_noise or spurs"
_OTHER = f"{_LEAVE}; of an error from elsewhere its quadratic_phase_error counts"
_LINK = "accepted: method linear with interval and error, or direct_path with error"
_SPECTRUM = f"{_LEAVE}, and state sinusoidal lines and the rms of wideband"
_SCALE = f"{_LEAVE}, and state what it does as accelerometer_bias"

# By the name of the section, as its class has it, and the key: what is accepted instead.
KEYS: Mapping[str, Mapping[str, str]] = {
    "MotionError": {"time_tag": _MOTION, "lever_arm": _MOTION},
    "Vibration": {"spectrum": _SPECTRUM, "spectrum_level": _SPECTRUM},
    "Imu": {"accelerometer_scale_factor": _SCALE},
    "ImuPart": {"accelerometer_scale_factor": _SCALE},
    "Oscillator": dict.fromkeys(("acceleration_sensitivity", "aging", "vibration", "level"), _OSCILLATOR),
    "OscillatorPart": dict.fromkeys(("acceleration_sensitivity", "aging", "vibration", "level"), _OSCILLATOR),
    "Synchronization": dict.fromkeys(("age", "averaging", "time_error", "frequency_error"), _LINK),
    "CommonMotionError": {"random": f"{_LEAVE}, and state it in motion_error.random of each platform"},
    "OtherError": dict.fromkeys(("cubic_phase_error", "location_error", "islr"), _OTHER),
    "OrbitSource": dict.fromkeys(("eof", "sp3"), "accepted: the same orbit as tle, omm or oem"),
    "TrajectorySource": dict.fromkeys(
        ("time_scale", "geoid_separation"), f"{_LEAVE}; a log in CSV has UTC, and heights above the ellipsoid"
    ),
    "AllocationRules": {"specify": _LEAVE},
    "Mission": {
        "propagation": f"{_LEAVE}, and state what it does in other_errors",
        "earth_orientation": f"{_LEAVE}; UT1 is taken to be UTC",
    },
}
METHODS: Mapping[str, str] = {"holdover": PROBLEM}
FRAMES: Mapping[str, str] = dict.fromkeys(
    ("track", "look", "ric"), f"{PROBLEM} of both platforms at once: each has axes of its own"
)
FORMATS: Mapping[str, str] = dict.fromkeys(("pos", "nmea", "gpx", "ulog"), PROBLEM)
