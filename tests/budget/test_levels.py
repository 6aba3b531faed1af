"""Levels that shift a part or a spectrum are said beside the verdict, with what they are off from."""

import json

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.report import Style, render
from tests.conftest import TEXT_FORMATS, findings, row

SPECTRUM = {"spectrum": {"20 Hz": "1 g^2/Hz", "1 kHz": "1 g^2/Hz"}}
SHIFTED = {
    "oscillator.level": {"platforms__receiver__oscillator": {"sensor": "sit5358", "level": "-100 dB"}},
    "motion_error.vibration.spectrum_level": {
        "platforms__receiver__motion_error": {"vibration": SPECTRUM | {"spectrum_level": "-100 dB"}}
    },
}


@pytest.mark.parametrize("key", SHIFTED)
@pytest.mark.parametrize("format_name", sorted(TEXT_FORMATS))
def test_a_level_is_among_the_overrides_in_every_format(format_name: str, key: str) -> None:
    found = findings(**SHIFTED[key], requirements__islr="-20 dB")
    (override,) = found.overrides
    assert (override.name, override.value) == (f"platforms.receiver.{key}", "-100 dB")
    assert override.origin.startswith("off ")
    assert "100 dB" in render(format_name, Report(version="0", missions=(found,)), Style())


def test_a_level_of_zero_shifts_nothing() -> None:
    level = {"platforms__receiver__oscillator": {"sensor": "sit5358", "level": "0 dB"}}
    assert findings(**level).overrides == ()
    assert findings(**level).kinds.shifted == ()


@pytest.mark.parametrize("key", SHIFTED)
def test_the_table_of_approval_names_what_a_level_shifts(key: str) -> None:
    found = findings(**SHIFTED[key])
    report = Report(version="0", missions=(found,))
    for format_name in ("html", "markdown"):
        text = render(format_name, report, Style()).replace("<wbr>", "").replace("\\", "")
        approval = text[text.rindex("Figures off their data sheets") :]
        assert f"platforms.receiver.{key}" in approval
        assert "100 dB" in approval[: approval.index("Prepared")]
    whole = Report(version="0", missions=(findings(platforms__receiver__oscillator={"sensor": "sit5358"}),))
    assert "Figures off their data sheets" not in render("html", whole, Style())


@pytest.mark.parametrize("key", SHIFTED)
def test_what_must_be_declared_says_what_a_level_shifts(key: str) -> None:
    """`declare` was met by a mask 100 dB below its data sheet, and said so."""
    kind = "oscillator" if "oscillator" in key else "vibration"
    found = findings(**SHIFTED[key], requirements={"declare": [f"receiver.{kind}"]})
    declared = row(found, "mission.declare")
    (note,) = [note for note in declared.notes if "100 dB" in note]
    assert note.startswith(f"platforms.receiver.{key}: -100 dB off ")
    text = " ".join(render("text", Report(version="0", missions=(found,)), Style()).split())
    assert f"off the data sheet: {kind} (receiver) -100 dB" in text
    (shifted,) = json.loads(render("json", Report(version="0", missions=(found,)), Style()))["missions"][0]["shifted"]
    assert (shifted["kind"], shifted["level_db"]) == (f"receiver.{kind}", -100.0)


def test_the_vibration_of_an_oscillator_is_not_that_of_its_data_sheet() -> None:
    """Its spectrum is the file's own; the source beside it is the oscillator's, whose own level is off it."""
    felt = {"vibration": SPECTRUM | {"spectrum_level": "-3 dB"}, "acceleration_sensitivity": "1e-9 /g"}
    oscillator = {"sensor": "sit5358", "level": "-2 dB", **felt}
    own, its_vibration = findings(platforms__receiver__oscillator=oscillator).overrides
    assert (own.name, own.value) == ("platforms.receiver.oscillator.level", "-2 dB")
    assert own.origin.startswith("off SiTime SiT5358")
    assert its_vibration == (
        "platforms.receiver.oscillator.vibration.spectrum_level",
        "-3 dB",
        "off the file's own spectrum",
    )
