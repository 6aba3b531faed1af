"""What tests of this folder compared is written as JSON, a file for each test file, for the documentation."""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.outside import record

# Environment variable: the folder of the JSON; nothing is written without it. What begins with BISAR_BUDGET_ is the
# command's, which refuses what it does not know.
FOLDER = "COMPARED_OUTSIDE"


@pytest.fixture(scope="module", autouse=True)
def _written(request: pytest.FixtureRequest) -> Iterator[None]:
    """Write the rows of a test file when its last test is done; a process of pytest-xdist has its own."""
    record.rows.clear()
    yield
    if record.rows and FOLDER in os.environ:
        name = f"{request.path.stem}.{os.environ.get('PYTEST_XDIST_WORKER', 'all')}.json"
        rows = [row._asdict() for row in record.rows]
        Path(os.environ[FOLDER], name).write_text(json.dumps(rows, indent=1, ensure_ascii=False), encoding="utf-8")
