"""Types of the contents of JSON and YAML documents."""

from typing import Any

JsonObject = dict[str, object]
"""An object of a document that is written, or whose values are tested before use."""
JsonDocument = dict[str, Any]
"""A document as `json.loads` returns it, for a caller who knows its schema."""
Definitions = dict[str, JsonObject]
"""Definitions of a JSON Schema by name, to which readers add their own."""
