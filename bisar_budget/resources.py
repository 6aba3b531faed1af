"""What there is to work with: files that travel with the package, `specs/` and `templates/`, and processors."""

import os
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path


def resource(*parts: str) -> "Path":
    """Path of a bundled file: inside an installed package, at the top level of a checkout."""
    from pathlib import Path  # a check does without

    package = Path(__file__).resolve().parent
    installed = package.joinpath(*parts)
    return installed if installed.exists() else package.parent.joinpath(*parts)


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def docstring(documented: Any) -> str:
    """Docstring of a class or function at the top of its module; from the source where Python dropped it (-OO)."""
    if sys.flags.optimize < 2:
        return documented.__doc__ or ""
    import ast
    from inspect import getsourcefile

    with open(getsourcefile(documented) or "", encoding="utf-8") as source:
        for node in ast.parse(source.read()).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == documented.__name__:
                return ast.get_docstring(node) or ""
    return ""
