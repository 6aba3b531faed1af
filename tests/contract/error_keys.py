"""Every key of every error section, each with a value that has an effect, for the contract test.

The values are written as a mission file writes them. A platform's keys are those of the receiver.
"""

import copy
import re
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

import bisar_budget as bb
from bisar_budget import units
from bisar_budget.error_kinds import registry
from bisar_budget.mission.changes import all_keys
from bisar_budget.mission.model import mission_schema

Document = dict[str, Any]
RECEIVER = "platforms.receiver."
BASE: Document = {
    "schema_version": 1,
    "name": "contract",
    "radar": {"center_frequency": "1.3 GHz", "bandwidth": "80 MHz"},
    "collection": {"aperture_time": "3 s"},
    "platforms": {
        "transmitter": {"position": ["6 km", "0 m", "2 km"], "velocity": ["0 m/s", "100 m/s", "0 m/s"]},
        "receiver": {
            "position": ["3 km", "3 km", "1 km"],
            "velocity": ["-40 m/s", "30 m/s", "0 m/s"],
            "acceleration": ["1 m/s^2", "2 m/s^2", "0 m/s^2"],
        },
    },
    "requirements": {
        "quadratic_phase_error": "45 deg",
        "cubic_phase_error": "22.5 deg",
        "pslr": "-25 dB",
        "islr": "-15 dB",
        "location_error": "50 m",
    },
}


class ErrorKey(NamedTuple):
    """One key of an error section, and what a mission needs so that the key has an effect.

    Attributes
    ----------
    value, larger
        Two values of the key.
    row : str
        Row that the key states or changes.
    beside : mapping
        Values of other keys, with and without the key.
    absent : str
        Path that the mission without the key lacks; by default that of the key.
    instead
        Value of the key in the mission "without" it, for a key that cannot be omitted.
    """

    value: Any
    larger: Any
    row: str
    beside: Document = {}
    absent: str = ""
    instead: Any = None


def drift_north(path: object, times: np.ndarray) -> np.ndarray:
    """Motion of a registered kind of error: a drift to the north. [m per m/s]"""
    return np.stack([0 * times, times, 0 * times])


REGISTERED_KIND = bb.MotionKind(
    name="drift_north",
    dimension=units.SPEED,
    description="Drift of the phase centre to the north.",
    motion=drift_north,
)


@contextmanager
def registered() -> Iterator[None]:
    """Register the kind of error of the key `registered` for a while."""
    before = dict(registry._KINDS)
    bb.register(REGISTERED_KIND)
    all_keys.cache_clear()
    yield
    registry._KINDS.clear()
    registry._KINDS.update(before)
    all_keys.cache_clear()


ERROR, COMMON = f"{RECEIVER}motion_error.", "common_motion_error."
REGISTERED = f"{ERROR}registered.{REGISTERED_KIND.name}"
OSCILLATOR, VIBRATION = f"{RECEIVER}oscillator.", f"{RECEIVER}motion_error.vibration."
LIGHT = {f"{ERROR}imu.attitude": "0.1 deg"}
RANDOM = {f"{ERROR}random.0.name": "GNSS"}
DATUM = {f"{COMMON}random.0.name": "datum"}
ANTENNA = {"other_errors.0.name": "antenna"}
TONE = {f"{VIBRATION}sinusoidal.0.frequency": "15 Hz"}
SPECTRUM = {"20 Hz": "1e-5 g^2/Hz", "100 Hz": "1e-5 g^2/Hz"}
MASK = {"0.1 Hz": "-40 dBc/Hz", "10 Hz": "-90 dBc/Hz", "1 kHz": "-110 dBc/Hz"}
WORSE_MASK = {"0.1 Hz": "-30 dBc/Hz", "10 Hz": "-80 dBc/Hz", "1 kHz": "-100 dBc/Hz"}
QUARTZ = {f"{OSCILLATOR}frequency": "10 MHz", f"{OSCILLATOR}phase_noise": MASK}
NOISY = {f"{OSCILLATOR}power_law.h0": 1e-21}
SENSITIVE = {**NOISY, f"{OSCILLATOR}acceleration_sensitivity": "1e-8 /g"}
CLOCKS = {**NOISY, "platforms.transmitter.oscillator.power_law.h0": 1e-21}
HOLDOVER = {
    **CLOCKS,
    "synchronization.method": "holdover",
    "synchronization.age": "20 s",
    "synchronization.averaging": "10 s",
    "synchronization.time_error": "1 ns",
    "synchronization.frequency_error": 1e-12,
}
# A poor inertial unit, and a short flight: every figure of an aided navigation has an effect.
NAVIGATION = f"{ERROR}navigation."
UNIT = {
    f"{NAVIGATION}imu.accelerometer_bias": "30 mg",
    f"{NAVIGATION}imu.gyro_bias": "2000 deg/h",
    f"{NAVIGATION}imu.velocity_random_walk": "0.3 m/s/sqrt(h)",
    f"{NAVIGATION}imu.angle_random_walk": "3 deg/sqrt(h)",
}
FIXES = {
    f"{NAVIGATION}gnss.rate": "2 Hz",
    f"{NAVIGATION}gnss.position": "2 cm",
    f"{NAVIGATION}gnss.velocity": "10 cm/s",
    f"{NAVIGATION}before": "3 s",
    f"{NAVIGATION}after": "3 s",
}
AIDED = {**UNIT, **FIXES}
OUTAGE = {**AIDED, f"{NAVIGATION}outages.0.from": "-1.2 s", f"{NAVIGATION}outages.0.to": "1.2 s"}
LINK = {**CLOCKS, "synchronization.interval": "0.5 s"}

# Aircraft are below the free electrons of the air.
IN_ORBIT = {
    name: {
        f"platforms.{name}.position": ["300 km", "0 m", "500 km"],
        f"platforms.{name}.velocity": ["0 m/s", "7 km/s", "0 m/s"],
        f"platforms.{name}.acceleration": ["0 m/s^2", "0 m/s^2", "0 m/s^2"],
    }
    for name in ("transmitter", "receiver")
}

# Small delays of the other leg, so that no leg is missing. One air over both legs has none.
OTHER_LEG: dict[str, Document] = {
    "": {},
    "transmitter.": {"propagation.receiver.zenith_delay": "1 mm"},
    "receiver.": {"propagation.transmitter.zenith_delay": "1 mm"},
}

_LEVEL = {f"{VIBRATION}spectrum": SPECTRUM}
_FELT_TONE = {**SENSITIVE, f"{OSCILLATOR}vibration.sinusoidal.0.frequency": "15 Hz"}
_FELT_SPECTRUM = {**SENSITIVE, f"{OSCILLATOR}vibration.spectrum": SPECTRUM}

_SMALL_SIZES = {"position": "1 mm", "velocity": "0.1 mm/s", "acceleration": "0.01 mm/s^2", "time_tag": "1 us"}
_SMALL_TERMS = {"constant": "0.1 ns", "linear": 1e-12, "quadratic": "1e-13 1/s", "cubic": "1e-14 1/s^2"}

ERROR_KEYS: dict[str, ErrorKey] = {
    "scene.height_error": ErrorKey("3 m", "6 m", "mission.terrain"),
    f"{ERROR}position": ErrorKey(["1 m", 0, 0], ["2 m", 0, 0], "receiver.position.x"),
    f"{ERROR}velocity": ErrorKey(["5 cm/s", 0, 0], ["10 cm/s", 0, 0], "receiver.velocity.x"),
    f"{ERROR}acceleration": ErrorKey(["3 mm/s^2", 0, 0], ["6 mm/s^2", 0, 0], "receiver.acceleration.x"),
    f"{ERROR}covariance.position": ErrorKey(
        "1 m", "2 m", "receiver.position.x", {f"{ERROR}covariance.velocity": "5 cm/s"}, f"{ERROR}covariance"
    ),
    f"{ERROR}covariance.velocity": ErrorKey(
        "5 cm/s", "10 cm/s", "receiver.velocity.x", {f"{ERROR}covariance.position": "1 m"}, f"{ERROR}covariance"
    ),
    f"{ERROR}covariance.correlation": ErrorKey(
        {"velocity.x-velocity.y": 0.9},
        {"velocity.x-velocity.y": 0.99},
        "receiver.quadratic_phase_error",
        {f"{ERROR}covariance.position": "1 m", f"{ERROR}covariance.velocity": "5 cm/s"},
    ),
    f"{VIBRATION}sinusoidal.amplitude": ErrorKey(
        "1 mm", "2 mm", "receiver.vibration.sinusoidal.0", TONE, f"{VIBRATION}sinusoidal"
    ),
    f"{VIBRATION}sinusoidal.frequency": ErrorKey(
        "15 Hz",
        "0.2 Hz",
        "receiver.vibration.sinusoidal.0",
        {f"{VIBRATION}sinusoidal.0.amplitude": "1 mm"},
        instead="0.2 Hz",
    ),
    f"{VIBRATION}wideband.rms": ErrorKey("1 mm", "2 mm", "receiver.vibration.wideband"),
    f"{VIBRATION}spectrum": ErrorKey(
        SPECTRUM, {"20 Hz": "1e-4 g^2/Hz", "100 Hz": "1e-4 g^2/Hz"}, "receiver.vibration.spectrum"
    ),
    f"{VIBRATION}spectrum_level": ErrorKey("3 dB", "6 dB", "receiver.vibration.spectrum", _LEVEL),
    f"{ERROR}sensor": ErrorKey("stim300", "adis16405", "receiver.imu.velocity_random_walk"),
    f"{ERROR}imu.accelerometer_bias": ErrorKey("200 ug", "400 ug", "receiver.imu.accelerometer_bias"),
    f"{ERROR}imu.accelerometer_scale_factor": ErrorKey(
        "500 ppm", "1000 ppm", "receiver.imu.accelerometer_scale_factor"
    ),
    f"{ERROR}imu.attitude": ErrorKey("0.05 deg", "0.1 deg", "receiver.imu.attitude"),
    f"{ERROR}imu.gyro_bias": ErrorKey("20 deg/h", "40 deg/h", "receiver.imu.gyro_bias"),
    f"{ERROR}imu.velocity_random_walk": ErrorKey(
        "1 m/s/sqrt(h)", "2 m/s/sqrt(h)", "receiver.imu.velocity_random_walk"
    ),
    f"{ERROR}imu.angle_random_walk": ErrorKey("10 deg/sqrt(h)", "20 deg/sqrt(h)", "receiver.imu.angle_random_walk"),
    f"{ERROR}random.sigma": ErrorKey(
        "3 mm",
        "6 mm",
        "receiver.random.GNSS",
        {**RANDOM, f"{ERROR}random.0.correlation_time": "1.5 s"},
        f"{ERROR}random",
    ),
    f"{ERROR}random.correlation_time": ErrorKey(
        "1.5 s", "3 s", "receiver.random.GNSS", {**RANDOM, f"{ERROR}random.0.sigma": "3 mm"}, instead="30 s"
    ),
    **{
        f"{NAVIGATION}{key}": ErrorKey(value, larger, "receiver.navigation", beside, instead=instead)
        for key, value, larger, beside, instead in (
            ("imu.sensor", "adis16405", "mti-g", FIXES, "stim300"),
            ("imu.accelerometer_bias", "30 mg", "60 mg", AIDED, "1 mg"),
            ("imu.gyro_bias", "2000 deg/h", "8000 deg/h", AIDED, "1 deg/h"),
            ("imu.velocity_random_walk", "0.3 m/s/sqrt(h)", "1 m/s/sqrt(h)", AIDED, "0.01 m/s/sqrt(h)"),
            ("imu.angle_random_walk", "3 deg/sqrt(h)", "10 deg/sqrt(h)", AIDED, "0.1 deg/sqrt(h)"),
            (
                "gnss.sensor",
                "mosaic-x5-standalone",
                "gps18x-5hz",
                {**UNIT, f"{NAVIGATION}gnss.rate": "1 Hz"},
                "mosaic-x5-rtk",
            ),
            ("gnss.rate", "2 Hz", "1 Hz", AIDED, "10 Hz"),
            ("gnss.position", "2 cm", "4 cm", AIDED, "5 mm"),
            ("method", "filtered", "smoothed", {**UNIT, **FIXES, f"{NAVIGATION}after": "0 s"}, "smoothed"),
            ("before", "1 s", "0 s", AIDED, "10 s"),
            ("after", "1 s", "0 s", AIDED, "10 s"),
        )
    },
    **{
        f"{NAVIGATION}{key}": ErrorKey(value, larger, "receiver.navigation", beside)
        for key, value, larger, beside in (
            ("imu.accelerometer_scale_factor", "20000 ppm", "50000 ppm", AIDED),
            ("gnss.velocity", "1 cm/s", "0.5 cm/s", AIDED),
            ("gnss.correlation_time", "10 s", "30 s", AIDED),
            ("heading", "40 deg", "80 deg", AIDED),
            ("level", "3 dB", "6 dB", AIDED),
        )
    },
    f"{NAVIGATION}outages.from": ErrorKey("-1.2 s", "-1.6 s", "receiver.navigation", OUTAGE, instead="1.1 s"),
    f"{NAVIGATION}outages.to": ErrorKey("1.2 s", "1.6 s", "receiver.navigation", OUTAGE, instead="-1.1 s"),
    f"{ERROR}time_tag": ErrorKey("1 ms", "2 ms", "receiver.time_tag"),
    f"{ERROR}lever_arm.arm": ErrorKey(["10 m", 0, "5 m"], ["20 m", 0, "5 m"], "receiver.lever_arm.attitude", LIGHT),
    f"{ERROR}lever_arm.uncertainty": ErrorKey("1 m", "2 m", "receiver.lever_arm.uncertainty"),
    f"{OSCILLATOR}phase_noise": ErrorKey(
        MASK, WORSE_MASK, "receiver.oscillator", {f"{OSCILLATOR}frequency": "10 MHz"}, f"{RECEIVER}oscillator"
    ),
    f"{OSCILLATOR}frequency": ErrorKey(
        "10 MHz", "5 MHz", "receiver.oscillator", {f"{OSCILLATOR}phase_noise": MASK}, instead="20 MHz"
    ),
    f"{OSCILLATOR}allan_deviation": ErrorKey(
        {"1 s": 1e-10, "10 s": 1e-10},
        {"1 s": 2e-10, "10 s": 2e-10},
        "receiver.oscillator",
        {},
        f"{RECEIVER}oscillator",
    ),
    f"{OSCILLATOR}power_law.h-2": ErrorKey(1e-22, 1e-21, "receiver.oscillator", {}, f"{RECEIVER}oscillator"),
    f"{OSCILLATOR}power_law.h-1": ErrorKey(1e-21, 1e-20, "receiver.oscillator", {}, f"{RECEIVER}oscillator"),
    f"{OSCILLATOR}power_law.h0": ErrorKey(1e-21, 1e-20, "receiver.oscillator", {}, f"{RECEIVER}oscillator"),
    f"{OSCILLATOR}power_law.h1": ErrorKey(1e-22, 1e-21, "receiver.oscillator", {}, f"{RECEIVER}oscillator"),
    f"{OSCILLATOR}power_law.h2": ErrorKey(1e-25, 1e-24, "receiver.oscillator", {}, f"{RECEIVER}oscillator"),
    f"{OSCILLATOR}bandwidth": ErrorKey(
        "10 Hz", "100 Hz", "receiver.oscillator", {f"{OSCILLATOR}power_law.h2": 1e-24}
    ),
    f"{OSCILLATOR}spurs": ErrorKey({"5 Hz": "-80 dBc"}, {"5 Hz": "-70 dBc"}, "receiver.oscillator.spur.0", QUARTZ),
    f"{OSCILLATOR}aging": ErrorKey("1e-5 /day", "2e-5 /day", "receiver.oscillator.aging", NOISY),
    f"{OSCILLATOR}level": ErrorKey("3 dB", "6 dB", "receiver.oscillator", NOISY),
    f"{OSCILLATOR}acceleration_sensitivity": ErrorKey(
        "1e-9 /g", "2e-9 /g", "receiver.oscillator.acceleration", NOISY
    ),
    f"{OSCILLATOR}vibration.sinusoidal.amplitude": ErrorKey(
        "1 mm", "2 mm", "receiver.oscillator.acceleration.0", _FELT_TONE, f"{OSCILLATOR}vibration"
    ),
    f"{OSCILLATOR}vibration.sinusoidal.frequency": ErrorKey(
        "15 Hz",
        "30 Hz",
        "receiver.oscillator.acceleration.0",
        {**SENSITIVE, f"{OSCILLATOR}vibration.sinusoidal.0.amplitude": "1 mm"},
        instead="5 Hz",
    ),
    f"{OSCILLATOR}vibration.spectrum": ErrorKey(
        SPECTRUM, {"20 Hz": "1e-4 g^2/Hz", "100 Hz": "1e-4 g^2/Hz"}, "receiver.oscillator.acceleration", SENSITIVE
    ),
    f"{OSCILLATOR}vibration.spectrum_level": ErrorKey(
        "3 dB", "6 dB", "receiver.oscillator.acceleration", _FELT_SPECTRUM
    ),
    f"{OSCILLATOR}sensor": ErrorKey("wenzel-5mhz", "bva", "receiver.oscillator"),
    f"{COMMON}position": ErrorKey(["1 m", 0, 0], ["2 m", 0, 0], "common.position.x"),
    f"{COMMON}velocity": ErrorKey(["5 cm/s", 0, 0], ["10 cm/s", 0, 0], "common.velocity.x"),
    f"{COMMON}acceleration": ErrorKey(["3 mm/s^2", 0, 0], ["6 mm/s^2", 0, 0], "common.acceleration.x"),
    f"{COMMON}random.sigma": ErrorKey(
        "3 mm",
        "6 mm",
        "common.random.datum",
        {**DATUM, f"{COMMON}random.0.correlation_time": "1.5 s"},
        "common_motion_error",
    ),
    f"{COMMON}random.correlation_time": ErrorKey(
        "1.5 s", "3 s", "common.random.datum", {**DATUM, f"{COMMON}random.0.sigma": "3 mm"}, instead="30 s"
    ),
    f"{COMMON}time_tag": ErrorKey("1 ms", "2 ms", "common.time_tag"),
    "timing_error.constant": ErrorKey("10 ns", "20 ns", "timing.constant"),
    "timing_error.linear": ErrorKey(1e-10, 2e-10, "timing.linear"),
    "timing_error.quadratic": ErrorKey("1e-11 1/s", "2e-11 1/s", "timing.quadratic"),
    "timing_error.cubic": ErrorKey("1e-12 1/s^2", "2e-12 1/s^2", "timing.cubic"),
    "synchronization.error": ErrorKey("5 deg", "10 deg", "timing.synchronization", LINK, "synchronization"),
    "synchronization.interval": ErrorKey(
        "0.5 s", "1 s", "timing.synchronization", {**CLOCKS, "synchronization.error": "5 deg"}, instead="0.1 s"
    ),
    "synchronization.method": ErrorKey(
        "holdover",
        "holdover",
        "receiver.oscillator",
        {key: value for key, value in HOLDOVER.items() if not key.endswith("method")},
        "synchronization",
    ),
    "synchronization.age": ErrorKey("20 s", "200 s", "receiver.oscillator", HOLDOVER, "synchronization"),
    "synchronization.averaging": ErrorKey("10 s", "20 s", "receiver.oscillator", HOLDOVER, instead="1 s"),
    "synchronization.time_error": ErrorKey("5 ns", "10 ns", "timing.time", HOLDOVER),
    "synchronization.frequency_error": ErrorKey(1e-10, 2e-10, "timing.frequency", HOLDOVER),
    **{
        f"propagation.{leg}zenith_delay": ErrorKey("5 cm", "10 cm", f"propagation.{leg}zenith_delay", OTHER_LEG[leg])
        for leg in OTHER_LEG
    },
    **{
        f"propagation.{leg}correlation_time": ErrorKey(
            "60 s",
            "30 s",
            f"propagation.{leg}zenith_delay",
            {**OTHER_LEG[leg], f"propagation.{leg}zenith_delay": "5 cm"},
        )
        for leg in OTHER_LEG
    },
    **{
        f"propagation.{leg}zenith_electron_content": ErrorKey(
            "2 TECU", "4 TECU", f"propagation.{row}.zenith_electron_content", {**IN_ORBIT[row], **OTHER_LEG[leg]}
        )
        for leg, row in (("", "transmitter"), ("transmitter.", "transmitter"), ("receiver.", "receiver"))
    },
    "other_errors.quadratic_phase_error": ErrorKey("10 deg", "20 deg", "other.antenna", ANTENNA, "other_errors"),
    "other_errors.cubic_phase_error": ErrorKey(
        "5 deg", "10 deg", "other.antenna.cubic_phase_error", ANTENNA, "other_errors"
    ),
    "other_errors.location_error": ErrorKey("5 m", "10 m", "other.antenna.location_error", ANTENNA, "other_errors"),
    "other_errors.islr": ErrorKey("-30 dB", "-20 dB", "other.antenna.islr", ANTENNA, "other_errors"),
    REGISTERED: ErrorKey("5 cm/s", "10 cm/s", f"receiver.{REGISTERED_KIND.name}"),
}
# Keys that describe an error: which of them changes nothing that is computed is said beside it.
_VELOCITY = {f"{ERROR}velocity": ["5 cm/s", 0, 0]}
_SHARED = {f"{COMMON}velocity": ["5 cm/s", 0, 0]}
_SHARED_MOVED = {f"{COMMON}position": ["1 m", 0, 0], f"{COMMON}acceleration": ["3 mm/s^2", 0, 0], **_SHARED}
_MOVED_KINDS = ("position", "velocity", "acceleration")
_MOVED = {f"{ERROR}position": ["1 m", 0, 0], f"{ERROR}acceleration": ["3 mm/s^2", 0, 0], **_VELOCITY}
DESCRIBING_KEYS: dict[str, tuple[Document, Any, Any]] = {
    f"{ERROR}frame": (_VELOCITY, "track", None),
    f"{ERROR}distribution": (_VELOCITY, "uniform", None),
    **{f"{ERROR}distribution.{kind}": (_MOVED, "uniform", None) for kind in _MOVED_KINDS},
    **{f"{COMMON}distribution.{kind}": (_SHARED_MOVED, "uniform", None) for kind in _MOVED_KINDS},
    f"{ERROR}source": (_VELOCITY, "report", None),
    f"{ERROR}random.name": ({f"{ERROR}random.0": {"sigma": "3 mm", "correlation_time": "1.5 s"}}, "GNSS", "RTK"),
    f"{ERROR}random.source": (
        {f"{ERROR}random.0": {"name": "GNSS", "sigma": "3 mm", "correlation_time": "1.5 s"}},
        "report",
        None,
    ),
    f"{ERROR}imu.source": ({f"{ERROR}imu.gyro_bias": "20 deg/h"}, "report", None),
    f"{NAVIGATION}source": (AIDED, "report", None),
    f"{NAVIGATION}imu.source": (AIDED, "report", None),
    f"{NAVIGATION}gnss.source": (AIDED, "report", None),
    f"{ERROR}lever_arm.source": ({f"{ERROR}lever_arm.uncertainty": "1 m"}, "report", None),
    f"{OSCILLATOR}source": (NOISY, "report", None),
    f"{COMMON}frame": (_SHARED, "track", None),
    f"{COMMON}distribution": (_SHARED, "uniform", None),
    f"{COMMON}source": (_SHARED, "report", None),
    f"{COMMON}random.name": ({f"{COMMON}random.0": {"sigma": "3 mm", "correlation_time": "1.5 s"}}, "datum", "RTK"),
    f"{COMMON}random.source": (
        {f"{COMMON}random.0": {"name": "datum", "sigma": "3 mm", "correlation_time": "1.5 s"}},
        "report",
        None,
    ),
    "synchronization.source": ({**LINK, "synchronization.error": "5 deg"}, "report", None),
    "propagation.source": ({"propagation.zenith_delay": "5 cm"}, "report", None),
    "propagation.transmitter.source": ({"propagation.transmitter.zenith_delay": "5 cm"}, "report", None),
    "propagation.receiver.source": ({"propagation.receiver.zenith_delay": "5 cm"}, "report", None),
    "other_errors.name": ({"other_errors.0": {"islr": "-30 dB"}}, "antenna", "feed"),
    "other_errors.source": ({"other_errors.0": {"name": "antenna", "islr": "-30 dB"}}, "report", None),
}


# ---------------------------------------------------------------------- missions with a key and without it
def path_of(key: str) -> str:
    """Path of a key in a mission file, in the first entry of each list."""
    return re.sub(r"\b(random|sinusoidal|other_errors|outages)\.(?=[a-z])", r"\1.0.", key)


# Figures whose size and bias stand in a section of their own, and a size beside which the bias has an effect.
for _key, _small in (
    *((f"{_section}{_figure}", _size) for _section in (ERROR, COMMON) for _figure, _size in _SMALL_SIZES.items()),
    *((f"timing_error.{_term}", _size) for _term, _size in _SMALL_TERMS.items()),
    *((f"propagation.{_leg}zenith_delay", "1 mm") for _leg in OTHER_LEG),
    *((f"propagation.{_leg}zenith_electron_content", "0.01 TECU") for _leg in OTHER_LEG),
    *((f"other_errors.{_phase}", "0.1 deg") for _phase in ("quadratic_phase_error", "cubic_phase_error")),
):
    _alone = ERROR_KEYS[_key]
    ERROR_KEYS[f"{_key}.sigma"] = _alone._replace(absent=_alone.absent or path_of(_key))
    ERROR_KEYS[f"{_key}.bias"] = _alone._replace(
        beside={**_alone.beside, f"{path_of(_key)}.sigma": _small}, absent=path_of(f"{_key}.bias")
    )


def number_in(key: str) -> tuple[str, Any, Any]:
    """Path of a number that a key holds, which sweeps and solutions vary, and two values of it."""
    path, error = path_of(key), ERROR_KEYS[key]
    if isinstance(error.value, list | dict):
        first = 0 if isinstance(error.value, list) else next(iter(error.value))
        return f"{path}.{first}", error.value[first], error.larger[first]
    return path, error.value, error.larger


def put(document: Document, path: str, value: Any) -> None:
    """Put a value at a path, and make the sections and lists on the way."""
    node: Any = document
    steps = [int(step) if step.isdigit() else step for step in path.split(".")]
    for step, following in pairwise(steps):
        if isinstance(step, int) and len(node) == step:
            node.append({})
        elif not isinstance(step, int) and step not in node:
            node[step] = [] if isinstance(following, int) else {}
        node = node[step]
    if isinstance(steps[-1], int):
        node.append(copy.deepcopy(value))
    else:
        node[steps[-1]] = copy.deepcopy(value)


def remove(document: Document, path: str) -> None:
    """Remove the value at a path, if it is there."""
    *parents, last = path.split(".")
    node: Any = document
    for step in parents:
        node = node[int(step)] if isinstance(node, list) else node.get(step, {})
    node.pop(last, None)


def mission_with(values: Document) -> Document:
    """The base mission with values at their paths."""
    document = copy.deepcopy(BASE)
    for path, value in values.items():
        put(document, path, value)
    return document


def mission_with_key(key: str, value: Any = None) -> Document:
    """Mission in which a key has its value, or another one."""
    error = ERROR_KEYS[key]
    return mission_with({**error.beside, path_of(key): error.value if value is None else value})


def mission_without_key(key: str) -> Document:
    """The same mission without the key, or with the value that does instead."""
    error = ERROR_KEYS[key]
    if error.instead is not None:
        return mission_with_key(key, error.instead)
    document = mission_with(error.beside)
    remove(document, error.absent or path_of(key))
    return document


# ---------------------------------------------------------------------- keys of the model
ROOTS = ("common_motion_error", "timing_error", "synchronization", "propagation", "other_errors")


def keys_of_the_model() -> set[str]:
    """Every key of every error section of the mission's schema; those of a platform for the receiver."""
    schema = mission_schema()
    keys = {"scene.height_error"}
    for root in (*ROOTS, f"{RECEIVER}motion_error", f"{RECEIVER}oscillator"):
        node: Any = schema
        for step in root.split("."):
            (section,) = sections_in(node, schema)
            node = section["properties"][step]
        keys |= set(keys_below(node, root, schema))
    return keys


def sections_in(node: Any, schema: Document) -> Iterator[Document]:
    """Yield the sections that a schema allows for one value, through references, choices and lists."""
    if "$ref" in node:
        node = schema["definitions"][node["$ref"].rpartition("/")[2]]
    if "properties" in node:
        yield node
        return
    for choice in (*node.get("anyOf", ()), *node.get("allOf", ()), *node.get("oneOf", ())):
        yield from sections_in(choice, schema)
    if isinstance(node.get("items"), dict):
        yield from sections_in(node["items"], schema)


def keys_below(node: Any, path: str, schema: Document) -> Iterator[str]:
    """Yield the paths of all keys below a value that are no sections."""
    sections = list(sections_in(node, schema))
    if not sections:
        yield path
    for section in sections:
        if {"sigma", "bias"} <= section["properties"].keys() or path.endswith("distribution"):
            yield path  # may be a size or a word too
        for key, value in section["properties"].items():
            yield from keys_below(value, f"{path}.{key}", schema)
