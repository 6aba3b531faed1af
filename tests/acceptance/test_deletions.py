"""Deleting what a file states never turns a mission that fails, or is not judged, into one that passes.

Random missions require that every kind of error which they state be declared (`requirements.declare`). Then each
section is deleted in turn, and so is each half of a cause: the oscillator of a clock that was set, the attitude that
swings a lever arm, the vibration that a sensitive oscillator feels. A kind that is gone is missed, and half of a
cause is not judged: nothing that stood in the way of a pass leaves without a trace.

An orbit whose file states its own accuracy is the same: neither the line that declares a position error nor the
covariance that stands in for it can be deleted to advantage.
"""

import copy
import json
from collections.abc import Iterator
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

import bisar_budget as bb
from bisar_budget.budget.check import check_mission
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY, examples
from tests.mission.test_path_files import ephemeris
from tests.paths.orbit_files import oem
from tests.paths.test_accuracy import START, triangle, with_covariance

PLATFORMS = ("transmitter", "receiver")
KINDS = ("position", "velocity", "acceleration", "vibration", "imu", "random", "time_tag", "lever_arm")
HALVES_OF_THE_MISSION = (("synchronization", "time_error"), ("synchronization", "frequency_error"))
OF_THE_MISSION = {
    "propagation": "propagation",
    "synchronization": "synchronization",
    "timing_error": "timing",
    "common_motion_error": "common",
    "other_errors": "other",
}
HALVES = (  # of a cause, below a platform: the other half is the key above it, or the synchronisation
    ("oscillator",),
    ("motion_error", "imu"),
    ("motion_error", "imu", "attitude"),
    ("motion_error", "vibration"),
    ("motion_error", "lever_arm", "arm"),
    ("oscillator", "vibration"),
)

Document = dict[str, Any]


def sizes(unit: str, low: float, high: float) -> st.SearchStrategy[str]:
    """Quantities between two sizes, as likely in each decade."""
    return st.floats(0, 1).map(lambda part: f"{low * (high / low) ** part:.4g} {unit}")


def sometimes(strategy: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.none() | strategy


TONES = st.lists(
    st.fixed_dictionaries({"amplitude": sizes("um", 0.1, 3e4), "frequency": sizes("Hz", 0.05, 300)}),
    min_size=1,
    max_size=2,
)
VIBRATION = st.fixed_dictionaries(
    {}, optional={"sinusoidal": TONES, "wideband": st.fixed_dictionaries({"rms": sizes("um", 0.1, 1e3)})}
).filter(bool)
MASK = st.tuples(st.integers(-120, -40), st.integers(-150, -80)).map(
    lambda levels: {"1 Hz": f"{levels[0]} dBc/Hz", "10 kHz": f"{min(levels) - 10} dBc/Hz"}
)
OSCILLATOR = st.fixed_dictionaries(
    {"frequency": st.just("10 MHz"), "phase_noise": MASK},
    optional={
        "acceleration_sensitivity": sizes("/g", 1e-12, 1e-7),
        "vibration": st.fixed_dictionaries({"sinusoidal": TONES}),
    },
)
MOTION = {
    "position": sizes("m", 1e-3, 30),
    "velocity": sizes("m/s", 1e-5, 0.3),
    "acceleration": sizes("m/s^2", 1e-6, 1e-1),
    "vibration": VIBRATION,
    "imu": st.fixed_dictionaries(
        {},
        optional={
            "accelerometer_bias": sizes("ug", 1, 1e4),
            "attitude": sizes("deg", 1e-4, 1),
            "gyro_bias": sizes("deg/h", 1e-2, 1e3),
        },
    ).filter(bool),
    "random": st.fixed_dictionaries(
        {"name": st.just("GNSS"), "sigma": sizes("m", 1e-4, 0.3), "correlation_time": sizes("s", 0.1, 100)}
    ).map(lambda one: [one]),
    "time_tag": sizes("s", 1e-7, 1e-2),
    "lever_arm": st.just({"arm": ["2 m", "0 m", "-0.5 m"]}),
}

BESIDE = {
    "propagation": st.fixed_dictionaries(
        {"zenith_delay": sizes("m", 1e-3, 1), "zenith_electron_content": sizes("TECU", 0.01, 10)},
        optional={"correlation_time": sizes("s", 1, 1e5)},
    ),
    "other_errors": sizes("deg", 0.1, 90).map(lambda size: [{"name": "antenna", "quadratic_phase_error": size}]),
    "common_motion_error": st.fixed_dictionaries({"position": sizes("m", 1e-3, 30)}),
}


@st.composite
def missions(draw: st.DrawFn) -> Document:
    """A mission of two aircraft that requires what it states."""
    platforms: Document = {
        "transmitter": {"position": ["30 km", "0 m", "6 km"], "velocity": ["0 m/s", "150 m/s", "0 m/s"]},
        "receiver": {"position": ["6 km", "6 km", "2 km"], "velocity": ["-40 m/s", "40 m/s", "0 m/s"]},
    }
    stated = draw(
        st.sets(st.tuples(st.sampled_from(PLATFORMS), st.sampled_from([*MOTION, "oscillator"])), max_size=3)
    )
    for name, kind in sorted(stated):
        if kind == "oscillator":
            platforms[name][kind] = draw(OSCILLATOR)
        else:
            platforms[name].setdefault("motion_error", {})[kind] = draw(MOTION[kind])
    document: Document = {
        "schema_version": 1,
        "name": "two aircraft",
        "radar": {"center_frequency": draw(st.sampled_from(["1.3 GHz", "10 GHz"])), "bandwidth": "80 MHz"},
        "collection": {"aperture_time": draw(st.sampled_from(["2 s", "6 s"]))},
        "platforms": platforms,
        "requirements": {"quadratic_phase_error": draw(sizes("deg", 5, 100))},
        "allocation": {"combine": draw(st.sampled_from(["each", "rss", "sum"]))},
    }
    for key, strategy in (
        ("cubic_phase_error", sizes("deg", 5, 100)),
        ("location_error", sizes("m", 0.1, 100)),
        ("pslr", st.just("-30 dB")),
        ("islr", st.just("-20 dB")),
    ):
        if (limit := draw(sometimes(strategy))) is not None:
            document["requirements"][key] = limit
    for key in sorted(draw(st.sets(st.sampled_from(list(BESIDE)), max_size=1))):
        document[key] = draw(BESIDE[key])
    clock = draw(st.sampled_from(["none", "terms", "holdover", "linear"]))
    if clock == "terms":
        document["timing_error"] = {
            "constant": draw(sizes("ns", 0.1, 300)),
            "linear": 1e-12,
            "quadratic": "1e-13 1/s",
        }
    elif clock == "holdover":
        document["synchronization"] = {
            "method": "holdover",
            "age": draw(sizes("s", 20, 1e4)),
            "averaging": "10 s",
            "time_error": "1 ns",
            "frequency_error": 1e-12,
        }
    elif clock == "linear":
        document["synchronization"] = {
            "method": "linear",
            "interval": "0.1 s",
            "error": draw(sizes("deg", 0.01, 30)),
            "time_error": "1 ns",
        }
    declared = [
        f"{name}.{kind}" for name in PLATFORMS for kind in KINDS if kind in platforms[name].get("motion_error", {})
    ]
    declared += [f"{name}.oscillator" for name in PLATFORMS if "oscillator" in platforms[name]]
    declared += [kind for section, kind in OF_THE_MISSION.items() if section in document]
    if declared:
        document["requirements"]["declare"] = declared
    return document


def without(document: Document, path: tuple[str, ...]) -> Document | None:
    """The document without a key; None where it has none."""
    left = copy.deepcopy(document)
    section: Any = left
    for key in path[:-1]:
        section = section.get(key)
        if not isinstance(section, dict):
            return None
    if path[-1] not in section:
        return None
    del section[path[-1]]
    return left


def deletions(document: Document) -> Iterator[tuple[str, Document]]:
    paths = [("platforms", name, "motion_error", kind) for name in PLATFORMS for kind in KINDS]
    paths += [("platforms", name, *half) for name in PLATFORMS for half in (("motion_error",), *HALVES)]
    paths += [(section,) for section in OF_THE_MISSION]
    if document.get("synchronization", {}).get("method") == "holdover":
        paths += HALVES_OF_THE_MISSION
    for path in paths:
        if (left := without(document, path)) is not None:
            yield ".".join(path), left


def breaks(document: Document) -> bool:
    """Whether a mission breaks a gate: it fails, is not judged, or cannot be used."""
    try:
        status = bb.check(bb.loads(json.dumps(document))).status
    except bb.MissionError:
        return True
    return STATUS[status].fails


@examples(40)  # some five checks each
@given(missions())
def test_no_deletion_makes_a_mission_pass(document: Document) -> None:
    try:
        bb.loads(json.dumps(document))
    except bb.MissionError:  # an unusable file is no mission: what is wrong in it may be deleted
        return
    if not breaks(document):
        return
    kept = {path for path, left in deletions(document) if not breaks(left)}
    # An attitude is half of a cause beside a lever arm; alone it is a figure of a kind that stays declared.
    platforms = document["platforms"]
    alone = {name for name in PLATFORMS if "lever_arm" not in platforms[name].get("motion_error", {})}
    kept -= {f"platforms.{name}.motion_error.imu.attitude" for name in alone}
    assert not kept


def orbit_breaks(covariance_m: float | None, limit_m: float, position: str | None) -> bool:
    """Whether a mission breaks a gate whose transmitter is an ephemeris, with a covariance or without."""
    blocks = [] if covariance_m is None else [(1170.0, "RTN", triangle((covariance_m,) * 3))]
    text = with_covariance(*blocks) if blocks else oem(times=START.after)
    error = {"frame": "ric", "velocity": "1 mm/s"} | ({} if position is None else {"position": position})
    requirements = {"location_error": f"{limit_m:.4g} m", "declare": ["transmitter.position", "receiver.position"]}
    mission = ephemeris(
        "2026-06-01T05:19:30Z",
        text,
        platforms__transmitter={"orbit": {"oem": "a.oem"}, "motion_error": error},
        requirements=requirements,
    )
    found = check_mission(parse_mission(mission, read_path={"a.oem": text.encode()}.__getitem__), TODAY)
    return STATUS[found.status].fails


@examples(20)
@given(st.floats(0, 4), st.floats(0, 3), st.none() | sizes("m", 0.1, 1e4))
def test_no_deletion_about_an_orbit_makes_a_mission_pass(
    covariance_decade: float, limit_decade: float, position: str | None
) -> None:
    covariance_m, limit_m = 10**covariance_decade, 10**limit_decade
    if orbit_breaks(covariance_m, limit_m, position):
        assert orbit_breaks(covariance_m, limit_m, None)
        assert orbit_breaks(None, limit_m, None)
