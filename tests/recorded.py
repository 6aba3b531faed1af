"""Results that a proof script writes into its page under `docs/`, with the command that gave them."""

import re
import sys
from collections.abc import Sequence
from pathlib import Path


def record(page: Path, mark: str, lines: Sequence[str]) -> None:
    """Replace what stands on a page between `<!-- mark -->` and the next `<!-- end -->`."""
    command = f"$ python docs/{' '.join([Path(sys.argv[0]).name, *sys.argv[1:]])}"
    block = "\n".join(["```text", command, *lines, "```"])
    text, found = re.subn(
        rf"(<!-- {mark} -->\n).*?(\n<!-- end -->)",
        lambda match: match[1] + block + match[2],
        page.read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )
    if found != 1:
        sys.exit(f"{page.name} has no place for the result")
    page.write_text(text, encoding="utf-8")
