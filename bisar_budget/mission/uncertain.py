"""Uncertainties of declared figures: `5 mm ± 20 %` and `5 mm ± 1 mm` in place of `5 mm`.

The number after the sign is one standard uncertainty of the figure (GUM, JCGM 100:2008, 2.3.1): in percent of the
figure, or in a unit of its kind. For a level it is in dB. Only `check --guard` uses it. It is taken out of the tree
of the file before the keys are read, so that all other readers find the figure alone.
"""

import math
import re
from collections.abc import Iterator

from yaml import ScalarEvent

from bisar_budget.faults import InvalidValueError, KeyPath, ParserEvent
from bisar_budget.mission.changes import is_error
from bisar_budget.mission.model import MISSION, UncertainFigure
from bisar_budget.mission.readers import BIAS_FIELD, OneOf, Quantity, Reader, Triple
from bisar_budget.mission.tree import Content, Tree, has_uncertainty
from bisar_budget.units import DB_PER_NEPER, LEVELS, POWER_RATIO, UNCERTAINTY_MARKS, parse_quantity, unit_behind

_MARK = re.compile("|".join(map(re.escape, UNCERTAINTY_MARKS)))
_ACCEPTED = "accepted: one standard uncertainty, such as 5 mm ± 20 % or 5 mm ± 1 mm"
_ACCEPTED_LEVEL = "accepted: one standard uncertainty in dB, such as -3 dB ± 1 dB"


def take_uncertainties(tree: Tree) -> tuple[UncertainFigure, ...]:
    """Remove the uncertainties from the tree of a mission file, and return them; the tree is changed in place.

    Only sizes of errors may have an uncertainty. For any other quantity it remains in the tree, and the reader of the
    quantity refuses it. A wrong uncertainty is reported as a fault of the tree.

    Raises
    ------
    UnusableError
        The tree has too many faults.
    """
    return tuple(_taken(tree, tree.root, MISSION, ()))


def _taken(tree: Tree, value: Content, reader: Reader[object] | None, path: KeyPath) -> Iterator[UncertainFigure]:
    """Yield the figures with an uncertainty in a section or list, and replace them by the figures alone."""
    for step, child in value.items() if isinstance(value, dict) else enumerate(value):
        if not has_uncertainty(child):
            continue
        reader = _form(reader, value)
        here, child_reader = (*path, step), reader and _form(reader.below(str(step)), child)
        if isinstance(child, dict | list):
            yield from _taken(tree, child, child_reader, here)
        elif (quantity := _size_reader(child_reader, here)) is not None:
            figure, uncertainty = _read(tree, child, quantity, here)
            value[step] = figure
            event: ParserEvent = tree.values.get(here)
            if isinstance(event, ScalarEvent):
                event.value = figure  # reports write sizes in its unit
            if uncertainty is not None:
                yield UncertainFigure(".".join(map(str, here)), uncertainty)


def _form(reader: Reader[object] | None, value: Content) -> Reader[object] | None:
    """Return the reader of the form in which a value is written; units decide between some forms."""
    while isinstance(reader, OneOf):
        reader = reader.pick(_without_marks(value))
    return reader


def _without_marks(value: Content) -> Content:
    """Copy of a value in which each text ends before the sign of an uncertainty."""
    if isinstance(value, dict):
        return {key: _without_marks(child) for key, child in value.items()}
    if isinstance(value, list):
        return list(map(_without_marks, value))
    return _MARK.split(value)[0].strip() if isinstance(value, str) else value


def _size_reader(reader: Reader[object] | None, path: KeyPath) -> Quantity | None:
    """Return the reader of a number that is the size of an error; None for any other value.

    Correlations have no uncertainty, because other values than those of the file may contradict each other.
    """
    if isinstance(reader, Triple) and reader.or_scalar:
        reader = reader.component
    while path and isinstance(path[-1], int):  # a component of a vector
        path = path[:-1]
    above_bias = path[: path.index(BIAS_FIELD)] if BIAS_FIELD in path else path
    is_size = is_error(".".join(map(str, above_bias))) and "correlation" not in path
    return reader if isinstance(reader, Quantity) and is_size else None


def _read(tree: Tree, text: str, reader: Quantity, path: KeyPath) -> tuple[str, float | None]:
    """Split a text into the figure and its relative standard uncertainty.

    The uncertainty is None if the text is faulty; a fault of the uncertainty is reported, and one of the figure is
    found when the figure is read.
    """
    figure, *uncertainties = [number.strip() for number in _MARK.split(text)]
    try:
        size = reader.leaf(figure)
    except InvalidValueError:
        return figure, None
    try:
        if len(uncertainties) > 1:
            raise InvalidValueError("states an uncertainty twice", _ACCEPTED)
        return figure, _relative(uncertainties[0], figure, size, reader)
    except InvalidValueError as error:
        tree.report(path, error.problem)
        return figure, None


def _relative(text: str, figure: str, size: float, reader: Quantity) -> float:
    """Read the uncertainty of a figure and divide it by the size of the figure.

    Raises `InvalidValueError` if it is not accepted.
    """
    is_level = reader.dimension in LEVELS
    accepted = _ACCEPTED_LEVEL if is_level else _ACCEPTED
    unit = unit_behind(text)
    if is_level and unit != "dB":
        raise InvalidValueError("is a level, whose uncertainty is in dB", accepted)
    if not is_level and size == 0:
        raise InvalidValueError("is 0, and an uncertainty is relative to the figure", "accepted: 0 alone")
    if not is_level and not unit and unit_behind(figure):
        raise InvalidValueError("has an uncertainty without a unit", accepted)
    try:
        if is_level:
            relative = parse_quantity(text, POWER_RATIO) / DB_PER_NEPER
        elif unit == "%":
            relative = float(text.removesuffix("%")) / 100
        else:
            relative = parse_quantity(text, reader.dimension) / abs(size)
    except InvalidValueError as error:
        problem = f"has the uncertainty {text!r}, which {error.problem.problem}"
        raise InvalidValueError(problem, accepted, error.problem.hint) from None
    if not relative > 0:
        raise InvalidValueError("has an uncertainty that is not above 0", accepted)
    if relative > 1 or not math.isfinite(relative):
        most = f"{DB_PER_NEPER:.3g} dB" if is_level else "100 %"
        raise InvalidValueError(f"has an uncertainty of more than {most} of the figure", accepted)
    return relative
