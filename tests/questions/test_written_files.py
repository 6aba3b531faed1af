"""Files that answers write from Python: a named pipe or a device is refused, as by the commands."""

import os
from pathlib import Path

import pytest

import bisar_budget as bb
from tests.conftest import COMPLIES, mission_text


@pytest.fixture
def found() -> bb.CheckResult:
    return bb.check(bb.loads(mission_text(**COMPLIES)), date="2026-11-21")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("suffix", [".json", ".csv", ".html", ".md"])
def test_a_report_to_a_named_pipe_is_refused(found: bb.CheckResult, tmp_path: Path, suffix: str) -> None:
    """It waited for a reader, for ever."""
    fifo = tmp_path / f"report{suffix}"
    os.mkfifo(fifo)
    with pytest.raises(ValueError, match=r"cannot write .*: a named pipe; accepted: a regular file"):
        found.report(fifo)


def test_a_report_to_a_device_is_refused(found: bb.CheckResult, tmp_path: Path) -> None:
    link = tmp_path / "report.json"
    link.symlink_to("/dev/zero")
    with pytest.raises(ValueError, match=r"cannot write .*: a device; accepted: a regular file"):
        found.report(link)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_drawing_to_a_named_pipe_is_refused(tmp_path: Path) -> None:
    fifo = tmp_path / "plot.svg"
    os.mkfifo(fifo)
    table = bb.sweep(bb.loads(mission_text(**COMPLIES)), {"collection.aperture_time": ["1 s", "2 s"]})
    with pytest.raises(ValueError, match="a named pipe"):
        table.plot().save(fifo)


def test_a_report_to_a_file_is_written_as_it_is(found: bb.CheckResult, tmp_path: Path) -> None:
    for _ in range(2):  # and over what is there
        found.report(tmp_path / "report.json")
    assert (tmp_path / "report.json").read_text(encoding="utf-8").startswith("{")
