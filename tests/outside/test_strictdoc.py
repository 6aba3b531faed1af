"""StrictDoc reads the requirements that are written for it, and writes ReqIF that the package reqif accepts.

The commands `strictdoc` and `reqif` are looked for on the PATH, since they need an environment of their own.
"""

import json
import shutil
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

from bisar_budget.cli import cli
from bisar_budget.faults import Fault
from bisar_budget.findings.mission import Report, UnusableMission
from bisar_budget.mission.load import load_mission
from bisar_budget.report import Style, render
from tests.conftest import ROOT, findings, mission_text

if shutil.which("strictdoc") is None or shutil.which("reqif") is None:
    pytest.skip("strictdoc or reqif is not on the PATH", allow_module_level=True)

pytestmark = pytest.mark.extras

HOSTILE = "<script>|`x`]]> [[copy('id')]] <<x>> >>> .. raw:: html {{7*7}} 漢 *a* _b_ <<<"
STATED = {
    "name": HOSTILE,
    "requirements": {"location_error": "1 m", "declare": ["position"], "pslr": "-30 dB"},
    "allocation": {"combine": "rss", "model": "full"},
    "platforms__receiver__motion_error": {"position": "1 m", "velocity": "1 mm/s"},
    "requirement_ids": {
        "requirement.location_error": ["SYS-042", HOSTILE, "-1", "漢"],
        "requirement.declare": "SYS-042",
        "receiver.velocity.x": "NAV 12.3: a/b (c)",
    },
    "requirement_texts": {"SYS-042": "The image shall be located within 1 m.", HOSTILE: HOSTILE},
}


def run(folder: Path, *command: str) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    output = done.stdout + done.stderr
    assert done.returncode == 0, output
    assert "error:" not in output.lower().replace("0 errors", "")
    return output


def read(folder: Path) -> list[dict]:
    """Nodes of the documents in a folder, as StrictDoc reads them."""
    run(folder, "strictdoc", "export", ".", "--formats=json", "--output-dir", "json")
    (document,) = json.loads((folder / "json" / "json" / "index.json").read_text(encoding="utf-8"))["DOCUMENTS"]
    return document["NODES"]


def written(folder: Path, text: str) -> Path:
    (folder / "requirements.sdoc").write_text(text, encoding="utf-8")
    return folder


@pytest.fixture
def document(tmp_path: Path) -> Path:
    broken = UnusableMission(file="broken.yaml", faults=(Fault(3, 7, "radar.bandwidth", HOSTILE),))
    report = Report(version="1", missions=(findings(**STATED), broken))
    return written(tmp_path, render("sdoc", report, Style()))


def test_reads_every_requirement_and_result(document: Path) -> None:
    nodes = {node["UID"]: node for node in read(document)}
    assert nodes["SYS-042"]["STATUS"] == "not_evaluated"
    assert nodes["SYS-042"]["STATEMENT"].strip() == ("The image shall be located within 1 m.")
    assert nodes["SYS-042"]["KEY"].strip() == "location_error; declare"
    assert nodes["NAV 12.3: a/b (c)"]["_NODE_TYPE"] == "REQUIREMENT"
    results = [node for node in nodes.values() if node["_NODE_TYPE"] == "RESULT"]
    parents = {relation["VALUE"] for node in results for relation in node.get("RELATIONS", ())}
    assert parents == {uid for uid, node in nodes.items() if node["_NODE_TYPE"] == "REQUIREMENT"}
    assert any(node["STATUS"] == "error" for node in results)


def test_exports_pages_and_reqif_that_is_valid(document: Path) -> None:
    run(document, "strictdoc", "export", ".", "--formats=html,reqif-sdoc", "--output-dir", "out")
    output = run(document, "reqif", "validate", "--use-reqif-schema", "out/reqif/output.reqif")
    assert "0 errors, 0 schema issues found, 0 semantic issues found" in output


def test_the_way_from_reqif_back_to_a_requirements_file(tmp_path: Path) -> None:
    """The commands of the guide, with the program that it shows."""
    mission = findings(**{**STATED, "name": "m", "requirement_ids": {"requirement.location_error": "SYS-042"}})
    document = written(tmp_path, render("sdoc", Report(version="1", missions=(mission,)), Style()))
    run(document, "strictdoc", "export", ".", "--formats=reqif-sdoc", "--output-dir", "out")
    shutil.move(document / "out" / "reqif" / "output.reqif", document / "customer.reqif")
    (document / "requirements.sdoc").unlink()
    shutil.rmtree(document / "out")
    page = (ROOT / "docs" / "guide" / "requirements.md").read_text(encoding="utf-8")
    program = page.split("```py\n", 1)[1].split("```", 1)[0]
    (document / "to_csv.py").write_text(program, encoding="utf-8")
    run(document, "strictdoc", "convert", "customer.reqif", "customer")
    run(document, "strictdoc", "export", "customer", "--formats=json", "--output-dir", "out")
    run(document, shutil.which("python3") or "python3", "to_csv.py")
    (document / "m.yaml").write_text(mission_text(requirements={"file": "reqs.csv"}))
    read_back = load_mission(str(document / "m.yaml"))
    assert read_back.requirements.location_error == 1
    assert read_back.requirements.pslr == -30
    assert read_back.requirements.declare == ("position",)
    assert read_back.requirement_ids["requirement.location_error"] == ("SYS-042",)
    assert read_back.requirement_texts["SYS-042"] == "The image shall be located within 1 m."


def test_reads_the_specifications_below_the_requirements(tmp_path: Path) -> None:
    mission = tmp_path / "m.yaml"
    mission.write_text(
        mission_text(
            requirements__location_error="20 m",
            allocation=STATED["allocation"],
            requirement_ids={"requirement.location_error": ["SYS-042", "SYS, 043"]},
        )
    )
    (tmp_path / "docs").mkdir()
    for command in (["check", str(mission)], ["allocate", str(mission)]):
        target = str(tmp_path / "docs" / f"{command[0]}.sdoc")
        CliRunner().invoke(cli, [*command, "--format", "sdoc", "-o", target], prog_name="bisar-budget")
    run(tmp_path, "strictdoc", "export", "docs", "--formats=html,reqif-sdoc", "--output-dir", "out")
    run(tmp_path, "reqif", "validate", "--use-reqif-schema", "out/reqif/output.reqif")
