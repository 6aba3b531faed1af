"""Print the oldest version of every dependency that pyproject.toml promises, as constraints for pip."""

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).resolve().parent.parent / "pyproject.toml").read_text())["project"]
extras = project["optional-dependencies"]
for requirement in (*project["dependencies"], *extras["fast"], *extras["logs"], *extras["orbits"], *extras["test"]):
    if requirement.startswith(f"{project['name']}["):
        continue
    name, oldest = re.match(r"([\w-]+)>=([\w.]+)", requirement).groups()
    print(f"{name}=={oldest}")
