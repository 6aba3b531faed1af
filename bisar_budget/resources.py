"""What there is to work with: files that travel with the package, `specs/` and `templates/`, and processors."""

import os
from typing import TYPE_CHECKING

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
