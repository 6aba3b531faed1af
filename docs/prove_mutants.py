"""Put a slip into a copy of the tree, one at a time, and run the tests that must fail for it.

    python docs/prove_mutants.py                    # every mutant of tests/mutants.py
    python docs/prove_mutants.py --only "(29)*"
    python docs/prove_mutants.py --write            # and record the result in docs/mutants.md

The copy is first tested as it is: the named tests must pass there. A mutant is caught if one of its tests then fails;
what that test says is printed. One that survives, or that no test could be run on, makes the exit code 1.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from fnmatch import fnmatchcase
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from tests.mutants import MUTANTS, ROOT, Mutant
from tests.recorded import record

PAGE = ROOT / "docs" / "mutants.md"
EVERY = "thorough or not thorough"  # pytest's -m: the seeds too that the default run leaves out
PASSED, FAILED = 0, 1  # pytest's exit codes; any other means that nothing was tested
_LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "build", "dist")


def tested(tree: Path, tests: Iterable[str]) -> tuple[int, str]:
    """Exit code of pytest on some tests of a tree, and the first failure in its words."""
    # Compiled files tell a change by the second it was made in: none are kept.
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "NO_COLOR": "1", "COLUMNS": "220"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", EVERY, *tests]
    done = subprocess.run(command, cwd=tree, env=environment, text=True, capture_output=True, check=False)
    failed = re.search(r"(?m)^FAILED \S*/(\S+::.*?)(?: - (.*))?$", done.stdout)
    if not failed:
        return done.returncode, done.stdout.strip().rpartition("\n")[2]
    what = (failed[2] or "").removeprefix("AssertionError: ")
    return done.returncode, f"{failed[1]}: {what}" if what else failed[1]


def verdict(tree: Path, mutant: Mutant) -> tuple[bool, str]:
    """Whether the tests catch a mutant, and what there is to say."""
    file = tree / mutant.path
    sound = file.read_text(encoding="utf-8")
    try:
        file.write_text(mutant.of(sound), encoding="utf-8")
        code, said = tested(tree, mutant.tests)
    except ValueError as error:
        return False, str(error)
    finally:
        file.write_text(sound, encoding="utf-8")
    if code == FAILED:
        return True, said
    return False, "its tests pass" if code == PASSED else f"not tested: {said}"


def main() -> int:
    """Test the copy, then every mutant; 1 if one is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="*", help="glob of names")
    parser.add_argument("--write", action="store_true", help="record the result in docs/mutants.md")
    asked = parser.parse_args()
    chosen = [mutant for mutant in MUTANTS if fnmatchcase(mutant.name, asked.only)]
    if not chosen:
        parser.error(f"no mutant is named {asked.only}")
    lines: list[str] = []

    def say(*said: str) -> None:
        lines.extend(said)
        print(*said, sep="\n", flush=True)

    missed = 0
    with tempfile.TemporaryDirectory() as directory:
        tree = Path(directory) / "tree"
        shutil.copytree(ROOT, tree, ignore=_LEFT_OUT)
        code, said = tested(tree, dict.fromkeys(test for mutant in chosen for test in mutant.tests))
        if code != PASSED:
            print(f"The tests fail without a mutant: {said}")
            return 1
        for mutant in chosen:
            is_caught, said = verdict(tree, mutant)
            missed += not is_caught
            say(f"{'caught  ' if is_caught else 'SURVIVED'} {mutant.name}", f"         {said}")
    say(f"{len(chosen)} mutants, {len(chosen) - missed} caught")
    if asked.write:
        record(PAGE, "result", lines)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
