"""Findings about a supplier's offer: its figures beside the specifications, and the verdict of its mission."""

from typing import NamedTuple

from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.status import exit_code


class OfferedFigure(NamedTuple):
    """Figure of an offer, compared with one specification.

    Attributes
    ----------
    key : str
        Path of the error in the mission file.
    value : float, optional
        The figure in SI; None if the file of the offer states no figure.
    text : str
        The figure as written in the file of the offer.
    ordered : str
        The size that the sheet specifies, as text.
    is_inside : bool, optional
        Whether the figure meets the specification; None if the two cannot be compared, or if no size is specified.
    remark : str
        Reason why `is_inside` is None; otherwise empty.
    """

    key: str
    value: float | None
    text: str
    ordered: str
    is_inside: bool | None
    remark: str = ""


class Offer(NamedTuple):
    """Result of comparing an offer with a specification sheet.

    It contains the file of the offer, its figures, and the verdict on its mission. `notes` name the sections, apart
    from the errors, in which the mission of the offer differs from the mission of the sheet.
    """

    file: str
    status: str
    figures: tuple[OfferedFigure, ...]
    requirements: tuple[JudgedRequirement, ...]
    notes: tuple[str, ...] = ()

    @property
    def complies(self) -> bool:
        """Whether the mission of the offer meets every requirement.

        This is possible even if single figures exceed their specifications.
        """
        return exit_code({self.status}, strict=False) == 0
