"""Parts that are kept: what is read is what was written, and parts of two sweeps are never mixed."""

import errno
import math
import os
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow")

from bisar_budget import __version__
from bisar_budget.cluster.parts_folder import PartsFolder, parts_folder
from bisar_budget.faults import ClusterError
from bisar_budget.findings.case_table import Chunks, Part
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.quantities import tree_of
from bisar_budget.questions.asked import Asked
from bisar_budget.questions.cases import grid
from tests.conftest import ROOT, mission_text

SECTION_V = str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml")
TIME = "collection.aperture_time"
# 8192 cases, as many again, and the rest: the arrays hold them.
ASKED = ("--vary", f"{TIME}=1:2s:17000", "--date", "2026-01-01")


QUESTION = {"a was": "1"}
CHUNKS = Chunks(60, 10, False)


def new_folder(path: Path) -> PartsFolder:
    return PartsFolder(str(path), QUESTION)


def test_a_part_is_read_as_it_was_written(tmp_path: Path) -> None:
    """NaN, infinities, the sign of zero, texts that are empty or not ASCII."""
    values: dict[str, Any] = {
        "a": np.array([math.nan, math.inf, -math.inf, -0.0, 5e-324]),
        "b": np.array(["", "µ", "", 'a "b",\n', "µ"], object),
        "c": np.array([""] * 5, object),
    }
    folder = new_folder(tmp_path)
    folder.put(Part(10, 15, values))
    (part,) = folder.parts([10])
    assert (part.start, part.stop, list(part.values)) == (10, 15, ["a", "b", "c"])
    assert np.asarray(part.values["a"], float).tobytes() == values["a"].tobytes()
    assert part.values["b"].dtype == part.values["c"].dtype == object
    assert part.values["b"].tolist() == values["b"].tolist()
    assert part.values["c"].tolist() == values["c"].tolist()


def test_words_of_cases_are_part_of_the_question() -> None:
    """Parts of other words are not mixed in."""
    mission = load_mission(SECTION_V)

    def question(text: str) -> Mapping[str, str]:
        asked = Asked(mission, grid(tree_of(mission), [text, f"{TIME}=1,2s"]), today=date(2026, 1, 1))
        return asked.inputs

    one, other = question("allocation.model=published,full"), question("allocation.model=full,published")
    assert one["the cases were"] == f"4 of allocation.model, {TIME}"
    assert one != other
    assert one == question("allocation.model=published,full")


def test_only_whole_parts_of_the_sweep_are_there(tmp_path: Path) -> None:
    def part(start: int, stop: int) -> Part:
        return Part(start, stop, {"a": np.zeros(stop - start)})

    folder = new_folder(tmp_path)
    for start in (0, 10, 20, 30, 40):
        folder.put(part(start, start + 10))
    files = sorted(tmp_path.glob("part-*"))
    files[1].write_bytes(files[1].read_bytes()[:-9])  # a machine stopped
    folder.put(part(20, 25))  # not to where it should
    other = PartsFolder(str(tmp_path / "other"), {"a was": "2"})
    os.mkdir(other.path)
    other.put(part(30, 40))
    os.replace(tmp_path / "other" / files[3].name, files[3])
    files[4].write_bytes(files[0].read_bytes())  # of other cases
    folder.put(part(60, 70))  # of no cases
    with parts_folder(str(tmp_path), QUESTION, CHUNKS, is_resumed=True) as again:
        assert again.done == {0}
        with pytest.raises(ClusterError, match=r"part-000000000010.parquet cannot be read"):
            list(again.parts([0, 10]))


def test_parts_of_an_earlier_form_are_refused(tmp_path: Path) -> None:
    """They are somebody's work, and say of no question that they answer it."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({"a": [0.0] * 10}), tmp_path / "part-000000000000.parquet")
    with (
        pytest.raises(ClusterError, match="of another sweep: a was not there, and now 1"),
        parts_folder(str(tmp_path), QUESTION, CHUNKS, is_resumed=True),
    ):
        pass


def test_a_bit_that_flipped_on_a_disk_is_seen(tmp_path: Path) -> None:
    """Its value went into the table; gone on with, the part was refused again and again."""
    folder = new_folder(tmp_path)
    folder.put(Part(0, 2000, {"a": np.linspace(0, 1, 2000)}))
    (file,) = tmp_path.glob("part-*")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    with pytest.raises(ClusterError, match=r"part-000000000000.parquet cannot be read"):
        list(folder.parts([0]))
    assert not folder.done
    assert not file.exists()  # and the next run makes it again


@pytest.mark.skipif(sys.platform == "win32", reason="needs pipes and devices")
def test_pipes_and_devices_are_no_parts(tmp_path: Path) -> None:
    """What has no end took all memory, and a pipe was waited for."""
    os.mkfifo(tmp_path / "part-000000000000.parquet")
    (tmp_path / "part-000000000010.parquet").symlink_to("/dev/zero")
    (tmp_path / "part-000000000020.parquet").mkdir()
    with parts_folder(str(tmp_path), QUESTION, CHUNKS, is_resumed=True) as folder:
        assert not folder.done
        for start in (0, 10):
            folder.put(Part(start, start + 10, {"a": np.zeros(10)}))
        assert sum(part.stop - part.start for part in folder.parts([0, 10])) == 20
        with pytest.raises(ClusterError, match=r"^cannot write .*: Is a directory$"):
            folder.put(Part(20, 30, {"a": np.zeros(10)}))
    assert not list(tmp_path.glob(".part*"))


def test_what_somebody_else_put_there_stays(tmp_path: Path) -> None:
    (tmp_path / "p").mkdir()
    folder = new_folder(tmp_path / "p")
    folder.put(Part(0, 1, {"a": np.zeros(1)}))
    (tmp_path / "p" / "notes.txt").write_text("mine")
    folder.remove()
    assert [file.name for file in (tmp_path / "p").iterdir()] == ["notes.txt"]
    (tmp_path / "p" / "notes.txt").unlink()
    folder.remove()
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def ended(run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Path]]:
    """Start a sweep, with these arguments, that is interrupted after the first of three parts."""
    shared_out = Asked.shared_out

    def broken(self: Asked, *arguments: Any) -> Iterator[Part]:
        yield next(shared_out(self, *arguments))
        raise KeyboardInterrupt

    def end(*arguments: str, mission: str = SECTION_V, dated: str = "") -> Path:
        output = tmp_path / "t.csv"
        with monkeypatch.context() as patched:
            patched.setattr(Asked, "shared_out", broken)
            found = run("sweep", mission, *ASKED, *arguments, "-o", str(output), "--resume")
        assert found.exit_code == 130
        assert (
            f"{output}.parts keeps 1 of 3 parts; the same command with --resume{dated} goes on from there."
            in found.stderr
        )
        assert not output.exists()
        return output

    return end


def test_a_sweep_goes_on_with_what_is_not_done(run, ended, monkeypatch: pytest.MonkeyPatch) -> None:
    output = ended()
    shared_out = Asked.shared_out
    left: list[int] = []

    def watched(self: Asked, starts: Any, *arguments: Any) -> Iterator[Part]:
        left.extend(starts)
        return shared_out(self, starts, *arguments)

    monkeypatch.setattr(Asked, "shared_out", watched)
    found = run("sweep", SECTION_V, *ASKED, "-o", str(output), "--resume")
    assert found.exit_code == 0
    assert found.stderr.splitlines()[0] == f"{output}.parts has 1 of 3 parts."
    assert left == [8192, 2 * 8192]
    assert run("sweep", SECTION_V, *ASKED, "-o", f"{output}.plain.csv").exit_code == 0
    assert output.read_bytes() == Path(f"{output}.plain.csv").read_bytes()
    assert not os.path.exists(f"{output}.parts")


def test_a_part_that_was_just_written_when_ctrl_c_came_is_kept_and_counted(run, tmp_path, monkeypatch) -> None:
    """The folder had one part more than was said."""
    output = tmp_path / "t.csv"
    replace = os.replace

    def ended(source: str, target: str) -> None:
        replace(source, target)
        if target.endswith("8192.parquet"):
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", ended)
        found = run("sweep", SECTION_V, *ASKED, "-o", str(output), "--resume")
    assert found.exit_code == 130
    assert f"{output}.parts keeps 2 of 3 parts; " in found.stderr
    assert len(os.listdir(f"{output}.parts")) == 2


def test_two_commands_do_not_share_a_folder(run, ended) -> None:
    """Each would write the parts of the other, and the first that ends takes them away."""
    fcntl = pytest.importorskip("fcntl", reason="Windows has no such locks")
    output = ended()
    folder = os.open(f"{output}.parts", os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        found = run("sweep", SECTION_V, *ASKED, "-o", str(output), "--resume")
        assert found.exit_code == 2
        assert f"another command works on {output}.parts; accepted: wait for it" in found.stderr
        assert not output.exists()
    finally:
        os.close(folder)
    assert run("sweep", SECTION_V, *ASKED, "-o", str(output), "--resume").exit_code == 0


def test_a_file_system_without_locks_has_no_lock(run, ended, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl", reason="Windows has no such locks")
    output = ended()

    def refuses(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuses)
    assert run("sweep", SECTION_V, *ASKED, "-o", str(output), "--resume").exit_code == 0


def test_a_model_of_the_file_that_is_none_is_not_asked_for(run, tmp_path) -> None:
    """With `--model` a check passes it by; going on from parts read it again."""
    mission = tmp_path / "m.yaml"
    mission.write_text(mission_text(allocation__model="fool", timing_error__linear="1 ppb"))
    asked = ("sweep", str(mission), "--vary", f"{TIME}=1:2s:3", "--date", "2026-01-01", "--model", "full")
    plain, kept, shared = (tmp_path / f"{name}.csv" for name in ("plain", "kept", "shared"))
    assert run(*asked, "-o", str(plain)).exit_code == 0
    for output, more in ((kept, ["--resume"]), (shared, ["--scheduler", "local:1"])):
        found = run(*asked, "-o", str(output), *more)
        assert found.exit_code == 0, found.stderr
        assert output.read_bytes() == plain.read_bytes()


def test_workers_start_beside_another_scheduler_of_dask(run, tmp_path) -> None:
    """A second one on a machine ended with: Port 8787 is already in use."""
    pytest.importorskip("distributed")
    output = tmp_path / "trade.csv"
    with socket.socket() as taken:
        with suppress(OSError):  # somebody else may have it
            taken.bind(("", 8787))
            taken.listen()
        few = ("--vary", "collection.aperture_time=1:5s:3")
        assert run("sweep", SECTION_V, *few, "-o", str(output), "--scheduler", "local:1").exit_code == 0
    assert output.exists()


def test_parts_are_not_lost_by_starting_anew(run, ended) -> None:
    pytest.importorskip("distributed")
    output = ended()
    before = sorted(os.listdir(f"{output}.parts"))
    found = run("sweep", SECTION_V, *ASKED, "-o", str(output), "--scheduler", "local:1")
    assert found.exit_code == 2
    assert "has parts of a sweep that was not finished; accepted: --resume" in found.stderr
    assert sorted(os.listdir(f"{output}.parts")) == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--set", "radar.bandwidth=150MHz"), "--set was not there, and now --set radar.bandwidth=150MHz"),
        (("--model", "full"), "the model that decides was published, and now full"),
        (("--column", "receiver.velocity.x.margin"), "the columns were collection.aperture_time, range_resolution"),
        (("--vary", f"{TIME}=1:3s:17000"), "the hash of the values of the cases was "),
        (("--vary", "radar.bandwidth=100,200 MHz"), f"was 17000 of {TIME}, and now 34000 of {TIME}, radar.bandwidth"),
    ],
)
def test_parts_of_another_sweep_are_refused(run, ended, arguments: tuple[str, ...], said: str) -> None:
    output = ended()
    asked = ASKED[2:] if TIME in str(arguments) else ASKED
    found = run("sweep", SECTION_V, *asked, *arguments, "-o", str(output), "--resume")
    assert found.exit_code == 2
    assert found.stderr.startswith(f"Error: {output}.parts is of another sweep: ")
    assert said.replace("was 17000", "the cases were 17000") in found.stderr
    assert not output.exists()


def test_parts_of_another_mission_or_version_are_refused(
    run, ended, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mission = tmp_path / "m.yaml"
    text = Path(SECTION_V).read_text(encoding="utf-8")
    mission.write_text(text, encoding="utf-8")
    output = ended(mission=str(mission))
    again = ("sweep", str(mission), *ASKED, "-o", str(output), "--resume")
    mission.write_text(text.replace("300 MHz", "150 MHz"), encoding="utf-8")
    assert "another sweep: the hash of the mission file was " in run(*again).stderr
    mission.write_text(text, encoding="utf-8")
    monkeypatch.setattr("bisar_budget.questions.asked.__version__", "9.9")
    assert f"another sweep: the version of bisar-budget was {__version__}, and now 9.9\n" in run(*again).stderr
    monkeypatch.undo()
    assert run(*again).exit_code == 0


def test_the_day_matters_where_there_are_waivers(run, ended, tmp_path: Path) -> None:
    """Whoever goes on tomorrow is told which day the parts are of."""
    mission = tmp_path / "m.yaml"
    text = Path(SECTION_V).read_text(encoding="utf-8")
    waiver = "waivers:\n  - {id: 'transmitter.*', until: 2026-06-30, reason: tested}\n"
    mission.write_text(f"{text}\n{waiver}", encoding="utf-8")
    output = ended(mission=str(mission), dated=" --date 2026-01-01")
    found = run("sweep", str(mission), *ASKED[:2], "--date", "2026-01-02", "-o", str(output), "--resume")
    assert "another sweep: --date was 2026-01-01, and now 2026-01-02" in found.stderr
    assert run("sweep", str(mission), *ASKED, "-o", str(output), "--resume").exit_code == 0


def test_a_day_without_waivers_does_not_matter(run, ended) -> None:
    output = ended()
    found = run("sweep", SECTION_V, *ASKED[:2], "--date", "2026-01-02", "-o", str(output), "--resume")
    assert found.exit_code == 0
