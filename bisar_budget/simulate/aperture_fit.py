"""What of a phase over the aperture counts as quadratic, and as cubic: the best fit over all of it.

Over a short aperture that is the Taylor coefficient at the midpoint. Over a long one it is not: what bends at the
edges only, a fourth power, defocuses too, and the best quadratic takes up 6/7 of it.
"""

from typing import NamedTuple

import numpy as np

from bisar_budget.simulate.phase_history import Floats


class EdgePhases(NamedTuple):
    """Quadratic and cubic part of a phase at the aperture edge, signed. [rad]"""

    quadratic: float
    cubic: float


def edge_phases(coefficients: Floats) -> EdgePhases:
    """Give quadratic and cubic term of the polynomial of third order nearest to a phase over the whole aperture.

    Nearest in least squares, with constant and linear term free: those displace. By symmetry the cubic term does
    not change the quadratic one, so a fit of second order gives the same.

    Parameters
    ----------
    coefficients : (terms,) ndarray
        Phase as powers of slow time in half apertures, -1 to 1, from the constant term up. [rad]

    Returns
    -------
    EdgePhases

    Notes
    -----
    The fit is the projection on Legendre polynomials: P₂ = (3t² - 1)/2, P₃ = (5t³ - 3t)/2. A fourth power gives the
    quadratic 6/7 of itself, a sixth 5/7; a fifth gives the cubic 10/9.
    """
    legendre = np.polynomial.legendre.poly2leg(coefficients)
    second, third = (float(legendre[n]) if n < legendre.size else 0.0 for n in (2, 3))  # zeros are trimmed
    return EdgePhases(1.5 * second, 2.5 * third)
