"""What importing a library would cost a check, beside what it imports anyway.

    pip install pydantic junitparser sarif-om svgwrite
    python benchmarks/imports.py

CPU time of a fresh interpreter, the median of nine, in turn; what is not installed is left out.
"""

import resource
import statistics
import subprocess
import sys

RUNS = 9
CODE = {
    "nothing": "pass",
    "yaml and click": "import yaml, click",
    "pydantic, one model": "from pydantic import BaseModel\nclass A(BaseModel):\n x: float",
    "junitparser": "import junitparser",
    "sarif-om": "import sarif_om",
    "svgwrite": "import svgwrite",
    "NumPy": "import numpy.polynomial.legendre",
    "Matplotlib": "import matplotlib.figure",
}


def cpu_seconds(code: str) -> float | None:
    """User and system time of an interpreter that runs some code; None if it fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        return None
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print a line for each, as a ratio to what a check imports anyway."""
    times: dict[str, list[float]] = {name: [] for name in CODE}
    for _ in range(RUNS):
        for name, code in CODE.items():
            if (seconds := cpu_seconds(code)) is not None:
                times[name].append(seconds)
    empty = statistics.median(times["nothing"])
    own = statistics.median(times["yaml and click"]) - empty
    for name, seconds in times.items():
        if name != "nothing" and seconds:
            print(f"{name:20} {(statistics.median(seconds) - empty) / own:5.2f}")


if __name__ == "__main__":
    main()
