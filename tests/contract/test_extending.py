"""The page on extending the package is executed: a kind of error of somebody's own package, through every command."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.conftest import ROOT

PAGE = (ROOT / "docs/contributing/extending.md").read_text(encoding="utf-8")
SECTION = PAGE.partition("## A kind of error")[2].partition("\n## ")[0]
KEY = "platforms.receiver.motion_error.registered.phase_centre_drift"
ROW = "receiver.phase_centre_drift"
COMMAND = "import sys; from bisar_budget.cli import main; sys.argv[0] = 'bisar-budget'; main()"


def block(language: str, beginning: str) -> str:
    """A block of the page, without the indentation of its list."""
    blocks = re.findall(rf"^ *```{re.escape(language)}\n(.*?)^ *```", SECTION, re.DOTALL | re.MULTILINE)
    (text,) = (text for text in blocks if text.lstrip().startswith(beginning))
    return (
        "\n".join(line.removeprefix("   ") if text.startswith("   ") else line for line in text.splitlines()) + "\n"
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package as it is installed, and a mission that states the error."""
    folder = tmp_path_factory.mktemp("installed")
    (folder / "phase_centre.py").write_text(block("python", "# phase_centre.py"))
    (folder / "test_phase_centre.py").write_text(block("python", "# test_phase_centre.py"))
    metadata = folder / "phase_centre-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: phase-centre\nVersion: 1.0\n")
    group, name = block("toml", "[project.entry-points").splitlines()
    entry, group_name = name.replace('"', ""), group.split('"')[1]
    (metadata / "entry_points.txt").write_text(f"[{group_name}]\n{entry}\n")
    mission = yaml.safe_load((ROOT / "specs/missions/uav_pair_l_band.yaml").read_text())
    mission["allocation"] = {"combine": "rss", "model": "full"}
    mission["requirements"]["quadratic_phase_error"] = "140 deg"  # which the other errors meet
    (folder / "without.yaml").write_text(yaml.safe_dump(mission))
    stated = yaml.safe_load(block("text", "platforms:"))["platforms"]["receiver"]["motion_error"]
    mission["platforms"]["receiver"]["motion_error"] |= stated
    (folder / "mission.yaml").write_text(yaml.safe_dump(mission))
    return folder


def run(folder: Path, *arguments: str, codes: tuple[int, ...] = (0, 1)) -> str:
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, *arguments],
        cwd=folder,
        env={"PYTHONPATH": f"{folder}:{ROOT}", "PATH": "/usr/bin:/bin", "COLUMNS": "100"},
        text=True,
        capture_output=True,
        check=False,
    )
    assert done.returncode in codes, (arguments, done.stdout, done.stderr)
    return done.stdout + done.stderr


def test_three_files_and_forty_lines_are_enough() -> None:
    files = [block("python", "# phase_centre.py"), block("python", "# test_phase_centre.py")]
    files.append(block("toml", "[project.entry-points"))
    assert sum(bool(line.strip()) for text in files for line in text.splitlines()) <= 40


def test_check_judges_it(folder: Path) -> None:
    (mission,) = json.loads(run(folder, "check", "mission.yaml", "--format", "json"))["missions"]
    (row,) = (row for row in mission["rows"] if row["id"] == ROW)
    assert row["declared"] == 0.02
    assert row["unit"] == "m/s"
    assert row["utilization"] > 0
    assert row["allowable"] > 0.02
    assert math.hypot(*row["displacement_m"]) > 0.1


def test_the_explanation_ends_at_the_allowable(folder: Path) -> None:
    text = run(folder, "check", "mission.yaml", "--explain", ROW)
    assert "Drift of the antenna's phase centre along the line of sight." in " ".join(text.split())
    assert "allowable" in text


def test_monte_carlo_draws_it(folder: Path) -> None:
    def variance(file: str) -> float:
        document = json.loads(run(folder, "check", file, "--monte-carlo", "20000", "--format", "json"))
        requirements = document["missions"][0]["monte_carlo"]["requirements"]
        return next(each["sigma"] for each in requirements if each["id"] == "mission.location_error") ** 2

    (mission,) = json.loads(run(folder, "check", "mission.yaml", "--format", "json"))["missions"]
    (row,) = (row for row in mission["rows"] if row["id"] == ROW)
    added = variance("mission.yaml") - variance("without.yaml")
    assert added == pytest.approx(math.hypot(*row["displacement_m"]) ** 2, rel=0.05)


def test_sweep_solve_sensitivity_and_allocate_take_its_key(folder: Path) -> None:
    table = run(folder, "sweep", "mission.yaml", "--vary", f"{KEY}=1cm/s:100m/s:2")
    assert "fail" in table
    (solved,) = json.loads(run(folder, "solve", "mission.yaml", "--for", KEY, "--format", "json"))["missions"]
    assert solved["value"] > 0.02
    assert KEY in run(folder, "sensitivity", "mission.yaml", "--format", "json")
    allocated = json.loads(run(folder, "allocate", "mission.yaml", "--for", KEY, "--format", "json"))
    assert allocated["missions"][0]["specifications"][0]["key"] == KEY


def test_diff_names_it(folder: Path) -> None:
    assert ROW in run(folder, "diff", "without.yaml", "mission.yaml")


def test_the_image_at_its_limit_confirms_the_limit(folder: Path) -> None:
    """As the page's own test, in a process with the entry point."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_phase_centre.py"],
        cwd=folder,
        env={"PYTHONPATH": f"{folder}:{ROOT}", "PATH": "/usr/bin:/bin"},
        text=True,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_simulate_flies_it(folder: Path) -> None:
    """The highest pixel of the image is displaced as `check` says, to two pixels."""
    peaks = []
    for file in ("mission.yaml", "without.yaml"):
        larger = ("--set", f"{KEY}=10 cm/s") if file == "mission.yaml" else ()
        run(folder, "simulate", file, *larger, "-o", f"{file}.npz")
        with np.load(folder / f"{file}.npz") as archive:
            images = {name: archive[name] for name in archive.files}
        at = np.unravel_index(np.abs(images["rotated"]).argmax(), images["rotated"].shape)
        peaks.append(images["grid_m"][at][:2])
        spacing = float(np.hypot(*images["spacing_m"]))
    checked = run(folder, "check", "mission.yaml", "--set", f"{KEY}=10 cm/s", "--format", "json")
    (row,) = (row for row in json.loads(checked)["missions"][0]["rows"] if row["id"] == ROW)
    moved = peaks[0] - peaks[1]
    assert np.hypot(*(moved - row["displacement_m"])) < 2 * spacing
    assert np.hypot(*moved) > 2 * spacing


@pytest.mark.parametrize(
    ("word", "status", "codes"), [(ROW, "pass", (0,)), ("phase_centre_drift", "not_evaluated", (1,))]
)
def test_a_requirement_can_ask_for_it(folder: Path, word: str, status: str, codes: tuple[int, ...]) -> None:
    """The mission of the page declares it for the receiver alone; the word of the kind asks for both platforms."""
    change = ("--set", f"requirements.declare=[{word}]")
    assert declared(folder, "mission.yaml", *change, codes=codes)["status"] == status
    for file in ("mission.yaml", "without.yaml")[status == "pass" :]:
        row = declared(folder, file, *change, codes=(1,))
        assert row["status"] == "not_evaluated"
        assert "motion_error.registered.phase_centre_drift" in row["reason"]


def test_a_requirement_of_both_platforms_is_met_by_both(folder: Path) -> None:
    other = ("--set", f"{KEY.replace('receiver', 'transmitter')}=1 mm/s")
    change = ("--set", "requirements.declare=[phase_centre_drift]")
    assert declared(folder, "mission.yaml", *change, *other, codes=(0,))["status"] == "pass"


def declared(folder: Path, file: str, *options: str, codes: tuple[int, ...]) -> dict[str, str]:
    """Row `mission.declare` of a check."""
    (mission,) = json.loads(run(folder, "check", file, *options, "--format", "json", codes=codes))["missions"]
    (row,) = (row for row in mission["rows"] if row["id"] == "mission.declare")
    return row


def test_reports_name_it(folder: Path) -> None:
    run(folder, "check", "mission.yaml", "--report", "r.html", "--report", "r.md")
    for report in ("r.html", "r.md"):
        assert "phase_centre_drift" in (folder / report).read_text().replace("\\", "")


def test_an_unknown_kind_names_the_registered_ones(folder: Path) -> None:
    text = run(folder, "check", "mission.yaml", "--set", KEY.replace("drift", "drfit") + "=1 m/s", codes=(2,))
    assert "is no registered kind of error" in text
    assert "Did you mean 'phase_centre_drift'?" in text
    assert "accepted: phase_centre_drift" in text


def test_the_schema_knows_it(folder: Path) -> None:
    assert "Drift of the antenna's phase centre" in run(folder, "schema")
