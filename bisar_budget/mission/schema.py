"""JSON Schema of the mission file, in draft-07 keywords, which every editor's YAML support reads."""

from typing import Any

from bisar_budget.mission.model import Mission


def mission_schema() -> dict[str, Any]:
    """Return the schema; quantities are text with a unit or a bare number, whose unit the tool itself checks."""
    generated = Mission.model_json_schema(ref_template="#/definitions/{model}")
    definitions = generated.pop("$defs")
    schema = {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "bisar-budget mission file",
        **{key: value for key, value in generated.items() if key != "title"},
        "definitions": definitions,
    }
    adapted: dict[str, Any] = _draft_07(schema)
    return {**adapted, "title": "bisar-budget mission file"}


def _draft_07(node: Any) -> Any:
    if isinstance(node, list):
        return [_draft_07(item) for item in node]
    if not isinstance(node, dict):
        return node
    # Titles repeat the key. A default of nothing says "optional", which `required` says already.
    node = {
        key: value
        for key, value in node.items()
        if not (key == "title" and isinstance(value, str))
        and not (key == "default" and not isinstance(value, str | float | int))
    }
    alternatives = node.get("anyOf") or node.get("oneOf")
    if alternatives and {"type": "null"} in alternatives:  # an empty value is an error in a mission file
        kept = [item for item in alternatives if item != {"type": "null"}]
        node.pop("anyOf", None)
        node = {**kept[0], **node} if len(kept) == 1 else {**node, "anyOf": kept}
    if "$ref" in node and len(node) > 1:  # draft-07 ignores what stands beside a $ref
        node = {
            **{key: value for key, value in node.items() if key != "$ref"},
            "allOf": [{"$ref": node["$ref"]}],
        }
    if "oneOf" in node:  # the forms of `split` exclude each other by their keys, not by a schema keyword
        node["anyOf"] = node.pop("oneOf")
    return {key: _draft_07(value) for key, value in node.items()}
