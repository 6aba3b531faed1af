"""JSON Schemas of the mission file and of a part's, in draft-07 keywords, which every editor's YAML support reads."""

from collections.abc import Sequence
from typing import Any

from bisar_budget.mission.instruments import FORMS
from bisar_budget.mission.model import MISSION
from bisar_budget.mission.parts import FIGURES, SECTIONS

_DRAFT = "http://json-schema.org/draft-07/schema#"
_SOME: dict[str, Any] = {"not": {"const": []}}  # an empty list states nothing


def mission_schema() -> dict[str, Any]:
    """Return the schema; quantities are text with a unit or a bare number, whose unit the tool itself checks."""
    definitions: dict[str, Any] = {}
    return {
        "$schema": _DRAFT,
        "title": "bisar-budget mission file",
        **MISSION.definition(definitions),
        "definitions": definitions,
    }


def part_schema() -> dict[str, Any]:
    """Return the schema of the file of a part, one alternative for each kind; quantities as in `mission_schema`."""
    definitions: dict[str, Any] = {}
    kinds = []
    for kind, section in SECTIONS.items():
        kinds.append(section.schema(definitions))
        definitions[section.kind.__name__] |= _rules(FIGURES[kind])
    return {
        "$schema": _DRAFT,
        "$id": "urn:bisar-budget:schema:part",
        "title": "bisar-budget part file",
        "description": "An inertial sensor, a GNSS receiver or an oscillator: its figures, and where they stand.",
        "type": "object",
        "required": ["kind"],
        "oneOf": kinds,
        "definitions": definitions,
    }


def _rules(figures: Sequence[str]) -> dict[str, Any]:
    """Schema rules for a part's figures together: one of them is there, and each has a source.

    Of an oscillator exactly one form is there, and a mask has its frequency. Zeros are for the tool to see.
    """
    ways = [{"required": [figure], "properties": {figure: _SOME}} for figure in figures if figure != "frequency"]
    of_each = {"required": ["source"], "properties": {"source": {"type": "object"}}}
    sourced = [
        {
            "if": {"allOf": [of_each, {"required": [figure], "properties": {figure: _SOME}}]},
            "then": {"properties": {"source": {"required": [figure]}}},
        }
        for figure in figures
    ]
    if set(FORMS) <= set(figures):
        return {"oneOf": ways, "dependencies": {"phase_noise": ["frequency"]}, "allOf": sourced}
    return {"anyOf": ways, "allOf": sourced}
