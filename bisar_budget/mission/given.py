"""Values that a caller gives a mission, as its file has them: texts, numbers in SI, quantities of other packages."""

import numbers
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bisar_budget.faults import SetValue
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError, number_of, tree_of


def changed(mission: Mission, values: Mapping[str, Any]) -> Mission:
    """A mission with other values in place of the file's, and beside them, as `--set` puts them.

    Parameters
    ----------
    mission : Mission
        As loaded.
    values : mapping of str to str, float, sequence or quantity
        By the path of a key in the mission file, such as `collection.aperture_time`: a text as the file would have
        it, `"8 s"`; a number in SI; a list of three; a quantity of pint or astropy.

    Raises
    ------
    MissionError
        The mission cannot be used with them; a key is unknown.
    """
    tree = tree_of(mission)
    changes = [SetValue(key, text_of(_si_of(tree, key), value)) for key, value in values.items()]
    return parse_mission(mission.data, mission.file, changes=(*mission.changes, *changes))


def _si_of(tree: dict[str, Any], key: str) -> str:
    """SI unit of a key's numbers; empty where it has none, or where three numbers stand for one."""
    for one in (key, f"{key}.0"):
        try:
            return number_of(tree, one).dimension.si
        except QuestionError:
            continue
    return ""


def text_of(si: str, value: Any) -> str:
    """A text, number, quantity or list of them as a mission file has it; numbers are in the SI unit.

    Raises
    ------
    TypeError
        It is none of them.
    """
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if is_quantity(value):
        unit = si or _unit_of(value)
        return text_of(unit, magnitude(value, unit))
    if isinstance(value, numbers.Real):
        return f"{float(value)!r} {si}".rstrip() if not isinstance(value, numbers.Integral) or si else str(int(value))
    if isinstance(value, Sequence | np.ndarray):
        return f"[{', '.join(text_of(si, one) for one in value)}]"
    raise TypeError(f"{type(value).__name__} is no value of a mission; accepted: text with its unit, number, list")


# ---------------------------------------------------------------------- quantities of other packages
# They are known by what they do: no such package has to be there.
def is_quantity(value: Any) -> bool:
    """Whether a value is a quantity of astropy, which has `to_value`, or of pint, which has a magnitude."""
    return hasattr(value, "to_value") or (hasattr(value, "magnitude") and hasattr(value, "units"))


def magnitude(value: Any, unit: str) -> Any:
    """The number, or the array, of a quantity in a unit."""
    if hasattr(value, "to_value"):
        return value.to_value(unit)
    return value.to(unit.replace("^", "**") or "dimensionless").magnitude


def _unit_of(value: Any) -> str:
    """The unit that a quantity is said in, as a mission file writes it."""
    said = str(value.unit) if hasattr(value, "to_value") else f"{value.units:~}"
    return said.replace("**", "^").replace(" ", "")
