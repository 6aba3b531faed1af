"""Every key that states an error, deleted alone: the check misses it, or `diff --fail-on-erosion` refuses the change.

A kind of error that is gone is missed by `requirements.declare`; so is half of a cause. A figure beside others of its
kind is not: an inertial sensor is declared by any of its figures. There the comparison with the file of before, which
a gate makes, refuses what does less. The files below state every key of every error section of the schema; a key that
comes is missed here until a file states it.
"""

import copy
import json
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest

import bisar_budget as bb
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import mission_schema
from bisar_budget.report.change.comparison import ChangeSet, Gate, compare

Document = dict[str, Any]
Key = tuple[str | int, ...]

KINDS = (
    *("position", "velocity", "acceleration", "vibration", "imu", "random", "oscillator", "time_tag", "lever_arm"),
)
OSCILLATOR = {
    "frequency": "10 MHz",
    "phase_noise": {"0.02 Hz": "-60 dBc/Hz", "1 Hz": "-95 dBc/Hz", "10 Hz": "-125 dBc/Hz", "10 kHz": "-150 dBc/Hz"},
    "bandwidth": "10 kHz",
    "spurs": {"50 Hz": "-100 dBc"},
    "aging": "1e-10 /day",
    "level": "3 dB",
    "acceleration_sensitivity": "1e-9 /g",
    "vibration": {
        "sinusoidal": [{"amplitude": "10 um", "frequency": "20 Hz"}],
        "spectrum": {"20 Hz": "1e-9 g^2/Hz", "1 kHz": "1e-9 g^2/Hz"},
    },
    "source": "data sheet",
}
MOTION = {
    "frame": "track",
    "position": ["1 m", "1 m", "2 m"],
    "velocity": "1 mm/s",
    "acceleration": "10 um/s^2",
    "distribution": "bound",
    "vibration": {
        "sinusoidal": [{"amplitude": "1 um", "frequency": "15 Hz"}],
        "spectrum": {"20 Hz": "1e-9 g^2/Hz", "1 kHz": "1e-9 g^2/Hz"},
        "spectrum_level": "3 dB",
    },
    "time_tag": "1 us",
    "lever_arm": {"arm": ["2 m", "0 m", "-0.5 m"], "uncertainty": "1 mm", "source": "drawing"},
    "imu": {
        "accelerometer_bias": "1 ug",
        "accelerometer_scale_factor": "30 ppm",
        "attitude": "0.002 deg",
        "gyro_bias": "0.05 deg/h",
        "velocity_random_walk": "0.001 m/s/sqrt(h)",
        "angle_random_walk": "0.001 deg/sqrt(h)",
        "source": "data sheet",
    },
    "random": [{"name": "GNSS", "sigma": "0.1 mm", "correlation_time": "1.5 s", "source": "test"}],
    "source": "report",
}
WIDEBAND = {"sinusoidal": [{"amplitude": "1 um", "frequency": "15 Hz"}], "wideband": {"rms": "1 um"}}
AIR = {"zenith_delay": "1 cm", "zenith_electron_content": "0.1 TECU", "correlation_time": "20 min", "source": "model"}
WHOLE: Document = {
    "schema_version": 1,
    "name": "two aircraft",
    "radar": {"center_frequency": "1.3 GHz", "bandwidth": "80 MHz"},
    "collection": {"aperture_time": "3 s"},
    "scene": {"height_error": "1 m"},
    "platforms": {
        "transmitter": {"position": ["30 km", "0 m", "6 km"], "velocity": ["0 m/s", "150 m/s", "0 m/s"]},
        "receiver": {"position": ["6 km", "6 km", "2 km"], "velocity": ["-40 m/s", "40 m/s", "0 m/s"]},
    },
    "common_motion_error": {
        "frame": "scene",
        "position": "10 cm",
        "velocity": "1 mm/s",
        "acceleration": "10 um/s^2",
        "time_tag": "1 us",
        "random": [{"name": "datum", "sigma": "0.1 mm", "correlation_time": "1.5 s"}],
        "distribution": "bound",
        "source": "survey",
    },
    "propagation": AIR,
    "other_errors": [
        {
            "name": "antenna",
            "quadratic_phase_error": "1 deg",
            "cubic_phase_error": "1 deg",
            "location_error": "10 cm",
            "islr": "-50 dB",
            "source": "test",
        }
    ],
    "requirements": {
        "quadratic_phase_error": "45 deg",
        "cubic_phase_error": "22.5 deg",
        "pslr": "-25 dB",
        "islr": "-15 dB",
        "location_error": "50 m",
        "declare": [f"{name}.{kind}" for name in ("transmitter", "receiver") for kind in KINDS]
        + ["timing", "propagation", "common", "other"],
    },
    "allocation": {"combine": "rss", "model": "full"},
}
HOLDOVER = {
    "method": "holdover",
    "age": "20 s",
    "averaging": "10 s",
    "time_error": "1 ns",
    "frequency_error": 1e-12,
    "source": "test",
}
EXCHANGED = {"method": "linear", "interval": "0.1 s", "error": "1 deg", "time_error": "1 ns", "source": "test"}
TERMS = {"constant": "1 ns", "linear": 1e-13, "quadratic": "1e-14 1/s", "cubic": "1e-16 1/s^2"}


def with_errors(vibration: Document, **beside: Any) -> Document:
    document = copy.deepcopy(WHOLE) | beside
    for name in ("transmitter", "receiver"):
        document["platforms"][name]["motion_error"] = copy.deepcopy(MOTION) | {"vibration": vibration}
        document["platforms"][name]["oscillator"] = copy.deepcopy(OSCILLATOR)
    if "synchronization" in document:
        document["requirements"]["declare"].append("synchronization")
    return document


def long_aperture(correlation_time: str, zenith_delay: str) -> Document:
    """A receiver that hardly moves for 80 s, with next to no noise: the time in which the air changes decides."""
    document = copy.deepcopy(WHOLE)
    for key in ("common_motion_error", "other_errors", "scene"):
        del document[key]
    random = [{"name": "GNSS", "sigma": "1 um", "correlation_time": "1.5 s", "source": "test"}]
    document["platforms"]["receiver"] |= {"velocity": ["0 m/s", "1 m/s", "0 m/s"], "motion_error": {"random": random}}
    document["collection"] = {"aperture_time": "80 s"}
    document["propagation"] = {"zenith_delay": zenith_delay, "correlation_time": correlation_time, "source": "model"}
    document["requirements"] = {
        "quadratic_phase_error": "360 deg",
        "islr": "-20 dB",
        "location_error": "50 m",
        "declare": ["receiver.random", "propagation"],
    }
    return document


NAVIGATION = {
    "imu": {
        "accelerometer_bias": "5 mg",
        "accelerometer_scale_factor": "1000 ppm",
        "gyro_bias": "50 deg/h",
        "velocity_random_walk": "0.03 m/s/sqrt(h)",
        "angle_random_walk": "0.3 deg/sqrt(h)",
        "source": "data sheet",
    },
    "gnss": {
        "position": "0.3 mm",
        "velocity": "2 mm/s",
        "rate": "5 Hz",
        "correlation_time": "20 s",
        "source": "data sheet",
    },
    "heading": "10 deg",
    "method": "filtered",
    "before": "10 s",
    "after": "0 s",
    "outages": [{"from": "-1 s", "to": "0.5 s"}],
    "level": "1 dB",
    "source": "test",
}


def aided() -> Document:
    """A receiver whose inertial unit GNSS aids, and nothing else that such a navigation replaces."""
    document = with_errors(WIDEBAND, timing_error=TERMS)
    error = document["platforms"]["receiver"]["motion_error"]
    document["platforms"]["receiver"]["motion_error"] = {
        key: value for key, value in error.items() if key not in ("imu", "random")
    } | {"navigation": copy.deepcopy(NAVIGATION)}
    return document


LEGS = {"propagation": {"transmitter": AIR, "receiver": AIR}}
DOCUMENTS = {
    "holdover": with_errors(MOTION["vibration"], synchronization=HOLDOVER),
    "exchanged": with_errors(WIDEBAND, synchronization=EXCHANGED, **LEGS),
    "terms": with_errors(WIDEBAND, timing_error=TERMS),
    "long": long_aperture("10 min", "2 mm"),
    "aided": aided(),
}
OMITTED_IS_WIDEST = "distribution"  # normal; bounds along other axes than the file's add, sigmas do not
SECTIONS = ("common_motion_error", "propagation", "other_errors", "synchronization", "timing_error")
# Keys beside which no other form of the same error may stand, and a part, whose figures are such keys.
OTHER_FORMS = {"MotionError.covariance", "MotionError.sensor", "Oscillator.sensor"}
OTHER_FORMS |= {"Oscillator.power_law", "Oscillator.allan_deviation"}


def keys_below(value: Any, path: Key) -> Iterator[Key]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        if isinstance(item, dict | list) or isinstance(value, dict):
            yield (*path, key)
            yield from keys_below(item, (*path, key))


def error_keys(document: Document) -> list[Key]:
    """Keys that state an error, those of the receiver for both platforms."""
    of_platform = document["platforms"]["receiver"]
    keys: list[Key] = [("scene", "height_error")] if "scene" in document else []
    for section in ("motion_error", "oscillator"):
        if section not in of_platform:
            continue
        place = ("platforms", "receiver", section)
        keys += [place, *keys_below(of_platform[section], place)]
    for section in SECTIONS:
        if section in document:
            keys += [(section,), *keys_below(document[section], (section,))]
    return keys


def without(document: Document, key: Key) -> Document:
    left = copy.deepcopy(document)
    section: Any = left
    for step in key[:-1]:
        section = section[step]
    del section[key[-1]]
    return left


@cache
def found_in(text: str) -> MissionFindings | None:
    try:
        return bb.check(bb.loads(text), date="2026-11-21").findings
    except bb.MissionError:
        return None


def is_noticed(before: Document, after: Document) -> bool:
    """Whether a change breaks the check, or is refused by a comparison with the mission of before."""
    found, changed = (found_in(json.dumps(one)) for one in (before, after))
    assert found is not None
    if changed is None or STATUS[changed.status].fails:
        return True
    return ChangeSet((compare(found, changed),)).is_refused(Gate(1.0, ()))


def grows(document: Document, after: Document) -> bool:
    """Whether no requirement and no row is used less after a change than before it."""
    found, changed = (found_in(json.dumps(one)) for one in (document, after))
    assert found is not None
    assert changed is not None
    now = {row.id: row.utilization or 0.0 for row in changed.rows}
    return all((row.utilization or 0.0) <= now.get(row.id, 0.0) * (1 + 1e-6) for row in found.rows)


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_files_comply(name: str) -> None:
    found = found_in(json.dumps(DOCUMENTS[name]))
    assert found is not None
    assert not STATUS[found.status].fails


@pytest.mark.parametrize("name", DOCUMENTS)
def test_a_deleted_key_is_missed_refused_or_makes_no_error_smaller(name: str) -> None:
    document = DOCUMENTS[name]
    lost = []
    for key in error_keys(document):
        if key[-1] == OMITTED_IS_WIDEST:
            continue
        after = without(document, key)
        if not is_noticed(document, after) and not grows(document, after):
            lost.append(".".join(map(str, key)))
    assert lost == []


@pytest.mark.parametrize(("correlation_time", "size"), [("10 min", "5 mm"), ("1 h", "12 mm"), ("30 s", "2 mm")])
def test_a_mission_that_fails_by_air_that_changes_does_not_pass_without_its_time(
    correlation_time: str, size: str
) -> None:
    document = long_aperture(correlation_time, size)
    found, left = (
        found_in(json.dumps(each)) for each in (document, without(document, ("propagation", "correlation_time")))
    )
    assert found is not None
    assert left is not None
    assert (found.status, left.status) == ("fail", "not_evaluated")


def test_the_files_state_every_key_of_the_error_sections() -> None:
    definitions = mission_schema()["definitions"]
    stated = {str(step) for document in DOCUMENTS.values() for key in error_keys(document) for step in key}
    sections = ("MotionError", "Vibration", "Imu", "GaussMarkov", "LeverArm", "Oscillator", "CommonMotionError")
    sections += ("TimingError", "Synchronization", "Propagation", "LegDelay", "OtherError", "Wideband", "Sinusoid")
    sections += ("Navigation", "AidedImu", "AidedGnss")
    missing = {
        f"{section}.{key}" for section in sections for key in definitions[section]["properties"] if key not in stated
    }
    parts = {"AidedImu.sensor", "AidedGnss.sensor"}  # whose figures are keys beside them
    assert missing == OTHER_FORMS | parts | {"MotionError.registered"}  # a key for kinds of installed packages
