"""Masks of phase noise: a higher point never lowers a use, and what no point states is said where it decides."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bisar_budget.effects.random_errors import random_errors
from bisar_budget.mission.load import parse_mission
from tests.conftest import examples, findings, mission_text, row

FREQUENCIES = (0.5, 1.0, 10.0, 100.0, 1000.0)
HOLDOVER = {"method": "holdover", "age": "600 s", "averaging": "10 s", "time_error": "1 ns", "frequency_error": 1e-12}
QUIET = {"power_law": {"h0": 1.0e-30}}
ERROR = {"position": "10 cm", "velocity": "2 mm/s", "acceleration": "10 ug"}
WAVEFORM = {"radar": {"center_frequency": "1 GHz", "bandwidth": "20 MHz"}, "collection": {"aperture_time": "4 s"}}
NEEDS = {"cubic_phase_error": "45 deg", "islr": "-10 dB", "location_error": "20 m"}
RULES = {"allocation": {"model": "full", "combine": "rss"}}


def clock(levels: dict[float, float]) -> dict[str, Any]:
    return {"frequency": "10 MHz", "phase_noise": {f"{f:g} Hz": f"{level:.3f} dBc/Hz" for f, level in levels.items()}}


def with_mask(levels: dict[float, float], **changes: Any) -> dict[str, Any]:
    errors = {f"platforms__{name}__motion_error": ERROR for name in ("transmitter", "receiver")}
    clocks = {"platforms__transmitter__oscillator": QUIET, "platforms__receiver__oscillator": clock(levels)}
    return {**WAVEFORM, **errors, **clocks, "requirements": NEEDS, "synchronization": HOLDOVER, **RULES} | changes


def effects(levels: dict[float, float], sync: dict[str, Any] | None) -> np.ndarray:
    """Quadratic and cubic phase, spread and displacement of the receiver's oscillator."""
    changes = with_mask(levels) if sync is None else with_mask(levels, synchronization=sync)
    found = random_errors(parse_mission(mission_text(**changes)))
    (one,) = [error for error in found if error.id == "receiver.oscillator"]
    return np.array([*one.full[:3], one.full.displacement], dtype=float)


# Falls that an oscillator can have, in dB from point to point: a decade each, but the first.
_FALLS = st.lists(st.floats(0.0, 35.0), min_size=4, max_size=4)


@examples(40)
@given(
    falls=_FALLS,
    raised=st.integers(0, 4),
    by=st.floats(0.1, 15.0),
    sync=st.sampled_from([None, {"interval": "1 s", "error": "1 deg"}, {"method": "direct_path", "error": "1 deg"}]),
)
def test_a_higher_point_never_lowers_what_an_oscillator_does(
    falls: list[float], raised: int, by: float, sync: dict[str, Any] | None
) -> None:
    """A mask 20 dB noisier at 10 Hz passed where the quieter one failed: below its points it continued flatter."""
    levels = dict(zip(FREQUENCIES, -80 - np.concatenate(([0.0], np.cumsum([falls[0] / 4, *falls[1:]]))), strict=True))
    louder = levels | {FREQUENCIES[raised]: levels[FREQUENCIES[raised]] + by}
    steps = zip(louder.items(), list(louder.items())[1:], strict=False)
    slopes = [(high - low) / np.log10(g / f) for (f, low), (g, high) in steps]
    assume(all(-60 < slope < 20 for slope in slopes))  # no mask rises or falls faster
    before, after = effects(levels, sync), effects(louder, sync)
    is_known = np.isfinite(before)
    assert (is_known == np.isfinite(after)).all()
    assert (after[is_known] >= before[is_known] * (1 - 1e-6)).all()


def test_below_its_first_point_a_mask_continues_as_flicker_of_frequency() -> None:
    """Whatever its own slope: two masks that differ above 1 Hz alone are the same below it."""
    steep, flat = ({1.0: -84, 10.0: level, 1000.0: -145} for level in (-121, -101))
    assert effects(steep, None)[[0, 1, 3]] == pytest.approx(effects(flat, None)[[0, 1, 3]], rel=0.02)


@pytest.mark.parametrize("combine", ["each", "rss", "sum"])
@pytest.mark.parametrize("level", [-101, -121])
def test_a_verdict_that_rests_on_the_continuation_warns_and_names_a_frequency(level: int, combine: str) -> None:
    changes = with_mask({1.0: -84, 10.0: level, 1000.0: -145}, allocation={"model": "full", "combine": combine})
    found = findings(**changes)
    location = row(found, "mission.location_error")
    assert found.status == location.status == "warn"
    assert "platforms.receiver.oscillator" in str(location.reason)
    assert "0.025 Hz" in str(location.reason)  # 0.1/T
    if combine == "each":
        assert "0.025 Hz" in str(row(found, "receiver.oscillator").reason)


def test_a_mask_that_reaches_down_or_uses_little_is_none_of_that() -> None:
    levels = {0.025: -36.0, 1.0: -84.0, 10.0: -121.0, 1000.0: -145.0}  # 30 dB a decade below 1 Hz
    assert findings(**with_mask(levels)).status == "pass"
    quiet = {f: level - 30 for f, level in ((1.0, -84.0), (10.0, -121.0), (1000.0, -145.0))}
    assert findings(**with_mask(quiet)).status == "pass"


def test_other_forms_than_masks_have_no_continuation() -> None:
    law = {"power_law": {"h-1": 1e-22}}
    found = random_errors(
        parse_mission(mission_text(**with_mask({1.0: -84, 10.0: -121}, platforms__receiver__oscillator=law)))
    )
    assert all(error.continued is None for error in found)
