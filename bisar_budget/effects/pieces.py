"""(26) to (29) of Rigling & Moses: the range error in pieces of lines, and the ground point that each indicates."""

import math
from typing import NamedTuple

from bisar_budget import evaluators
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState

PRINTED, TRUE = "v/R as printed, ranges held", "v⊥/R, lines of sight as they turn"


class LinePiece(NamedTuple):
    """A piece of the range error: centre τ_i from mid-aperture [s], value (27) [m] and slope (28) [m/s] there."""

    time: float
    value: float
    slope: float


def gradients_of(model: str) -> str:
    """Say by which gradients of range and Doppler a model has Q_i: what is printed, or what is true."""
    return PRINTED if model == "published" else TRUE


def indicated_point(
    geometry: BistaticGeometry, piece: LinePiece, model: str, seen_from: GroundVector = (0.0, 0.0)
) -> GroundVector:
    """Ground point that a piece of range error indicates, (29), relative to the scatterer. [m]

    Parameters
    ----------
    geometry : BistaticGeometry
        Of the whole aperture.
    piece : LinePiece
        Of the range error; what the scatterer itself has is no part of it.
    model : str
        `published`: Q_i of (30) as printed, platforms where they are at τ_i, speeds over ranges held constant. Any
        other: the gradients that the lines of sight have at τ_i.
    seen_from : (2,)
        Where the scatterer lies. [m]

    Returns
    -------
    (2,)
        East and north.

    Raises
    ------
    ZeroDivisionError
        Range and Doppler gradients are parallel at τ_i.
    """
    east, north = seen_from
    held, look, rate = [], [0.0, 0.0], [0.0, 0.0]
    for state in (geometry.transmitter, geometry.receiver):
        (x, y, z), velocity = state.at(piece.time)
        then = PlatformState(position=(x - east, y - north, z), velocity=velocity)
        slant_range = math.dist(state.position, (east, north, 0.0))
        held += [x - east, y - north, *velocity[:2], slant_range]
        for axis in range(2):
            look[axis] += then.look[axis]
            rate[axis] += then.look_rate[axis]
    if model == "published":
        (a, b), (c, d), (determinant,) = evaluators.published_ground_inverse(*held)
    else:
        (a, b), (c, d), (determinant,) = evaluators.full_ground_inverse(*look, *rate)
    return (
        (a * piece.value + b * piece.slope) / determinant,
        (c * piece.value + d * piece.slope) / determinant,
    )
