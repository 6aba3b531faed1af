"""Write every output of every example into a folder, to be compared before and after a change of the structure.

    python -m tests.outputs before
    …                                   # the change
    python -m tests.outputs after && diff -r before after

Each file holds the exit code, both streams and the reports of one command. The day is fixed. Missions are those of
`specs/missions` and `examples`, and some of each family of `tests.families`. `--studies` sweeps, solves and allocates
those of `specs/missions` too, and `--images` forms images of all; both take minutes.
"""

import argparse
import json
import os
import shutil
from itertools import pairwise
from pathlib import Path

from click.testing import CliRunner

from bisar_budget.cli import cli
from tests.conftest import ROOT, TEXT_FORMATS
from tests.families import FAMILIES, mission_text

RANDOM = 3  # missions of each family
DRAWS = "2000"


def missions() -> list[str]:
    """Write every mission into the current folder; return their names."""
    texts = {path.stem: path.read_text("utf-8") for path in sorted((ROOT / "specs" / "missions").glob("*.yaml"))}
    examples = sorted((ROOT / "examples").rglob("missions/*.yaml"))
    texts |= {f"example-{path.stem}": path.read_text("utf-8") for path in examples}
    texts |= {f"{family}-{seed}": mission_text(family, seed) for family in FAMILIES for seed in range(RANDOM)}
    for name, text in texts.items():
        Path(f"{name}.yaml").write_text(text, encoding="utf-8")
    shutil.copytree(ROOT / "specs" / "missions" / "paths", "paths")
    return list(texts)


def write(folder: Path, studies: bool, images: bool) -> int:
    """Write all outputs; return how many commands ran."""
    folder.mkdir(parents=True)
    os.chdir(folder)  # outputs name files as they are given
    os.environ |= {"SOURCE_DATE_EPOCH": "1767225600", "COLUMNS": "120"}
    count = 0

    def run(name: str, *arguments: str) -> str:
        nonlocal count
        count += 1
        done = CliRunner().invoke(cli, list(arguments), prog_name="bisar-budget")
        said = f"exit {done.exit_code}\n{done.stdout}\n--- stderr\n{done.stderr}"
        Path(name).write_text(said, encoding="utf-8")
        return done.stdout

    for name in (names := missions()):
        file = f"{name}.yaml"
        for format_name in TEXT_FORMATS:
            run(f"{name}.{format_name}.out", "check", file, "--format", format_name)
        for option in ("--quiet", "--all", "--verbose", "--color=always", "--strict", "--model=full",
                       "--model=published", "--model=strictest", "--detail=full --format=html"):  # fmt: skip
            run(f"{name}.{option.replace(' ', '')}.out", "check", file, *option.split())
        reports = [f"--report={name}.{suffix}" for suffix in ("md", "html")]
        run(f"{name}.monte-carlo.out", "check", file, "--monte-carlo", DRAWS, *reports)
        found = json.loads(run(f"{name}.json.out", "check", file, "--format", "json"))["missions"]
        ids = [row["id"] for mission in found for row in mission.get("rows", ())]
        explained = [run("explained", "check", file, "--explain", row_id) for row_id in ids]
        Path(f"{name}.explain.out").write_text("\n\n".join(explained), encoding="utf-8")
        if studies and (ROOT / "specs" / "missions" / file).exists():
            beside = ("--vary", "collection.aperture_time=0.5,1,2 s", "--vary", "radar.bandwidth=100:300MHz:3")
            run(f"{name}.sweep.out", "sweep", file, *beside)
            run(f"{name}.sweep-plot.out", "sweep", file, *beside, "--plot", f"{name}.map.svg")
            run(f"{name}.curve.out", "sweep", file, *beside[:2], "--plot", f"{name}.curve.svg")
            run(f"{name}.solve.out", "solve", file, "--for", "collection.aperture_time")
            run(f"{name}.sensitivity.out", "sensitivity", file, "--plot", f"{name}.tornado.svg")
            for format_name in ("text", "json", "csv", "markdown", "html", "needs", "sdoc"):
                run(f"{name}.allocate.{format_name}.out", "allocate", file, "--format", format_name)
            run(f"{name}.passes.out", "passes", file)
        if images:
            run(f"{name}.verify.out", "verify", file)
            run(f"{name}.check-verify.out", "check", file, "--verify", f"--report={name}-v.md")
            run(f"{name}.simulate.out", "simulate", file)
    files = [f"{name}.yaml" for name in names]
    for format_name in TEXT_FORMATS:
        run(f"all.{format_name}.out", "check", *files, "--format", format_name)
    for before, after in pairwise(files):
        run(f"{before}-{after}.diff.out", "diff", before, after)
    Path("explained").unlink()
    return count


def main() -> None:
    """Write the outputs into the folder of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="must not exist")
    parser.add_argument("--studies", action="store_true", help="sweep, solve, sensitivity, allocate and passes too")
    parser.add_argument("--images", action="store_true", help="verify and simulate too")
    asked = parser.parse_args()
    print(f"{write(asked.folder.absolute(), asked.studies, asked.images)} commands")


if __name__ == "__main__":
    main()
