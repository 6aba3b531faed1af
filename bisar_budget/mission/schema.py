"""JSON Schema of the mission file, in draft-07 keywords, which every editor's YAML support reads."""

from typing import Any

from bisar_budget.mission.model import MISSION


def mission_schema() -> dict[str, Any]:
    """Return the schema; quantities are text with a unit or a bare number, whose unit the tool itself checks."""
    definitions: dict[str, Any] = {}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "bisar-budget mission file",
        **MISSION.definition(definitions),
        "definitions": definitions,
    }
