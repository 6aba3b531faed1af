"""The object of a kind of error: the names of its rows, its keys in a mission file, its sizes and its effect.

The object of a kind has the properties of the kind that commands need, so that no command compares names of kinds.
Where a subpackage computes something different for each kind, such as the steps of an explanation or a random time
series, it has one table of functions by kind. A test checks that the table is complete.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from bisar_budget import units
from bisar_budget.faults import KeyPath

_Entry = TypeVar("_Entry")
_OWNER_WORDS = {"clock": "timing"}  # owners that have another name in row ids

# What a declared size means: one sigma of a normal distribution; the largest magnitude; what the key `distribution`
# beside the size says; the amplitude of a sinusoid; a level in decibels relative to the declared spectrum.
NORMAL, BOUND, AS_STATED, PEAK_AMPLITUDE, RELATIVE_LEVEL = "normal", "bound", "as stated", "amplitude", "level"


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorKind:
    """A kind of error, or of a sum of errors.

    Attributes
    ----------
    name : str
        Name of the kind in row ids, in the mission file, and in the key `requirements.declare` of this file.
    id_form : str
        Form of the row ids, with the fields `{owner}`, `{kind}`, `{axis}` and `{entry}`. Empty parts are left out.
        The owner is the part of the system that has the error, such as a platform. The owner `clock` is written
        `timing`.
    common_id_form : str
        Form of the row ids of an error that both platforms share; empty if the kind has no such error.
    is_computed : bool
        Whether the tool computes the size that a row shows as declared; a size of zero is then a computed result.
    only_warns : bool
        Whether the row warns and never fails.
    is_by_rule : bool
        Whether the row combines errors according to the rule `allocation.combine`.
    is_vibration : bool
        Whether the row judges a vibration.
    spectrum_axis : str, optional
        Axis in the id of the row for a declared spectrum. The levels in this row are in decibels relative to the
        spectrum. None if the kind has no such row.
    is_source : bool
        Whether the row is that of an error source.
    is_sum : bool
        Whether the row sums the effects of errors.
    is_phase : bool
        Whether the row of a sum has a phase in radians.
    is_level : bool
        Whether the row of a sum has the power of sidelobes in decibels.
    moves : str
        What an error source affects: the path of a `platform`, a `clock`, the delay in the `air`, or the `image`
        itself if the file states only the effect of the error. Empty for a sum.
    is_of_log : bool
        Whether the error is the noise of a flight log; the file of the log is then the source of the error.
    owes_source : bool
        Whether reports list a declared error of the kind if the file states no source for it.
    """

    name: str
    id_form: str = "{owner}.{kind}.{axis}.{entry}"
    common_id_form: str = ""
    is_computed: bool = False
    spectrum_axis: str | None = None
    only_warns: bool = False
    is_by_rule: bool = False
    is_vibration: bool = False
    is_source: bool = False
    is_sum: bool = False
    is_phase: bool = False
    is_level: bool = False
    moves: str = ""
    is_of_log: bool = False
    owes_source: bool = False

    def row_id(self, owner: str, axis: str = "", entry: int | None = None) -> str:
        """Id of the row of an error of this kind, in the form of `id_form` or `common_id_form`."""
        form = self.common_id_form if self.common_id_form and owner == "mission" else self.id_form
        names = {
            "owner": _OWNER_WORDS.get(owner, owner),
            "kind": self.name,
            "axis": axis,
            "entry": "" if entry is None else str(entry),
        }
        return ".".join(filter(None, (part.format_map(names) for part in form.split("."))))

    @property
    def has_numbers(self) -> bool:
        """Whether the row ids of the kind contain the index of the error in a list of the mission file."""
        return "{entry}" in self.id_form

    def find_in(self, table: Mapping[str, _Entry], axis: str = "") -> _Entry:
        """Look up this kind in a table: the entry `KIND.AXIS` if the table has one, otherwise the entry `KIND`.

        Raises `KeyError` if the table has neither.
        """
        name = f"{self.name}.{axis}"
        return table[name] if name in table else table[self.name]


@dataclass(frozen=True, kw_only=True, eq=False)
class SumKind(ErrorKind):
    """A kind of row that is computed from other rows: a sum of errors, or an effect of all errors on the image."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorSize:
    """A size of an error that a mission file can state.

    Attributes
    ----------
    dimension : units.Dimension
        Dimension of the size.
    key : str
        Key of the size below the key or section of its kind (`SourceKind.key_form`), with the fields `{axis}` and
        `{index}`. It is empty if the key of the kind itself states the size.
    section_form : str
        Form of the path of the section that contains the key, if this is not the section of the kind.
    distribution : str
        What the size means: `NORMAL`, `BOUND`, `AS_STATED`, `PEAK_AMPLITUDE` or `RELATIVE_LEVEL`.
    equation : str
        Source of the effect of the error, such as an equation of the paper; for reports.
    has_axes : bool
        Whether the file may state three sizes, one along each axis, in place of one.
    unit_text : str
        Unit of the size in SI, as written in rows, if it is not the unit of the dimension.
    """

    dimension: units.Dimension
    key: str = ""
    section_form: str = ""
    distribution: str = NORMAL
    equation: str
    has_axes: bool = False
    unit_text: str = ""

    @property
    def unit(self) -> str:
        """Unit of the size in SI, as written in rows."""
        return self.unit_text or self.dimension.si


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceKind(ErrorKind):
    """A kind of error source.

    Attributes
    ----------
    description : str
        What the error is, in one sentence.
    key_form : str
        Path of the key or section in the mission file that states the errors of the kind, with the fields `{owner}`
        and `{kind}`.
    common_key_form : str
        The same for an error that both platforms share; empty if the kind has no such error.
    sizes : mapping of str to ErrorSize
        The sizes that the file can state, by the axis of their rows. A size with an empty axis is the size of all
        axes that are not in the mapping.
    is_covered : bool
        Whether the coverage factor multiplies the declared size.
    order : int, optional
        Power of slow time to which the position error is proportional, along a direction that does not change; None
        for any other error.
    flown_as : str
        Field of the simulator's `PathError` that takes the size of the error; empty if the error has no such field.
    drawn_as : str
        Quantity of which a simulation draws random time series: the `motion` of platforms, or the `delay` or `phase`
        of the echoes. Empty if no time series are drawn.
    shifts_time : bool
        Whether the error shifts a path in time.
    is_registered : bool
        Whether another package registered the kind.
    is_random : bool
        Whether the error is random: it has a sigma and no sign.
    is_correlated : bool
        Whether the error is correlated noise of a position.
    has_names : bool
        Whether a file may state several errors of the kind, each with a name.
    is_largest_of_axes : bool
        Whether the declared size is described as the largest of three axes.
    direction : str
        Name of the direction of the error, if no axis in its ids gives the direction.
    """

    description: str
    is_source: bool = True
    key_form: str
    common_key_form: str = ""
    sizes: Mapping[str, ErrorSize]
    is_covered: bool = True
    order: int | None = None
    flown_as: str = ""
    drawn_as: str = ""
    shifts_time: bool = False
    is_registered: bool = False
    is_random: bool = False
    is_correlated: bool = False
    has_names: bool = False
    owes_source: bool = True
    is_largest_of_axes: bool = False
    direction: str = ""

    def size(self, axis: str = "") -> ErrorSize:
        """Size that a mission file states for the errors along an axis."""
        return self.sizes[axis if axis in self.sizes else ""]

    @property
    def unit(self) -> str:
        """Unit in SI of the size that all axes of the kind share."""
        return self.size().unit

    def section(self, owner: str, axis: str = "") -> KeyPath:
        """Path of the key or section of the mission file that states an owner's errors, for one axis or for all."""
        form = self.common_key_form if self.common_key_form and owner == "mission" else self.key_form
        if axis in self.sizes:
            form = self.sizes[axis].section_form or form
        return tuple(form.format(owner=owner, kind=self.name).split("."))

    def path(self, owner: str, axis: str = "", index: int | None = None) -> KeyPath:
        """Path of the size of an error in the mission file.

        `index` is the index of the error, or of its axis, in a list of the file. Without an index, the path ends at
        the list.
        """
        keys: list[str | int] = []
        for key in filter(None, self.size(axis).key.split(".")):
            if key == "{index}" and index is None:
                break
            keys.append(index if key == "{index}" and index is not None else key.format(axis=axis))
        return (*self.section(owner, axis), *keys)

    @property
    def is_shared(self) -> bool:
        """Whether the paths of both platforms can share an error of this kind."""
        return self.moves == "platform" and bool(self.common_id_form)

    @property
    def has_covariance(self) -> bool:
        """Whether a mission file can state an error of this kind as a covariance."""
        return False
