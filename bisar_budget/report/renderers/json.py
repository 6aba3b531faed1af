"""Write JSON documents."""

import json
from collections.abc import Callable, Mapping
from functools import cache

from bisar_budget import __version__


@cache
def _encoder(separator: str) -> Callable[[object], str]:
    return json.JSONEncoder(allow_nan=False, separators=(separator, ": ")).encode


def indented(value: object, levels: int, margin: str = "") -> str:
    """Write a value as JSON in which only the outermost `levels` levels of nesting are indented.

    The `indent` argument of `json.dumps` is not used, because it would switch to the slow pure-Python encoder, which
    takes as long as the check itself.
    """
    if levels == 0 or not value or not isinstance(value, dict | list | tuple):
        return _encoder(", ")(value)
    inner = margin + "  "
    between = f",\n{inner}"
    if isinstance(value, dict):
        opening, closing = "{", "}"
        if any(isinstance(item, dict | list | tuple) for item in value.values()):
            items = [f'"{key}": {indented(item, levels - 1, inner)}' for key, item in value.items()]
            content = between.join(items)
        else:
            content = _encoder(between)(value)[1:-1]
    else:
        opening, closing = "[", "]"
        if levels == 1:
            # A quote within a string follows a backslash, so the text is cut between rows only.
            content = _encoder(", ")(value)[1:-1].replace('}, {"id": ', f'}}{between}{{"id": ')
        else:
            content = between.join([indented(item, levels - 1, inner) for item in value])
    return f"{opening}\n{inner}{content}\n{margin}{closing}"


def document_text(form: str, content: Mapping[str, object]) -> str:
    """Write a JSON document in the documented format `form`. A non-finite number raises an error."""
    return json.dumps({"format": form, "version": __version__, **content}, indent=2, allow_nan=False) + "\n"
