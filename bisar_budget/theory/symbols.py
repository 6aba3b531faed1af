"""The symbols of Rigling & Moses, with names that all printers can typeset.

Names have the form `<letter>[tilde|bar|hat]_<subscript>`: `vtilde_xt` is the transmitter's velocity error along x.
Frame: scene centre at the origin, ground plane z = 0, x east, y north, z up. All quantities are in SI units, angles
in radians.
"""

from dataclasses import dataclass

from sympy import Expr, ImmutableMatrix, Matrix, Symbol, sqrt

AXES = ("x", "y", "z")


def real(name: str) -> Symbol:
    """Return a real SymPy symbol with the given name."""
    return Symbol(name, real=True)


def positive(name: str) -> Symbol:
    """Return a positive SymPy symbol with the given name."""
    return Symbol(name, positive=True)


tau = real("tau")  # slow time from the aperture midpoint [s]
T = positive("T")  # aperture time [s]
c = positive("c")  # speed of light [m/s]
wavelength = positive("lambda")  # at the centre frequency [m]
center_frequency = positive("f_0")  # [Hz]; the paper's f₀ is the band's lower edge
point = Matrix([real(axis) for axis in AXES])  # a point of the scene [m]
scatterer = Matrix([real(f"{axis}_m") for axis in AXES])  # position of the m-th scatterer [m]
clock_coefficients = tuple(real(f"ttilde_{n}") for n in range(4))  # t̃ₙ [s, 1, 1/s, 1/s²]
total_qpe = positive("q")  # total budget for the quadratic phase error [rad]
share = positive("s")  # share of one platform in a budget [-]
pslr = positive("PSLR")  # power ratio [-]
islr = positive("ISLR")  # power ratio [-]
baseline = positive("D")  # distance between the platforms [m]
n_pull = positive("N_pull")  # autofocus corrects up to π·N_pull radians


@dataclass(frozen=True)
class PlatformSymbols:
    """Symbols for the motion of one platform at mid-aperture, and for the errors of its measured motion.

    Vectors are (3,), east-north-up, in m, m/s and m/s². `look` holds the unit vector from the scene centre to the
    platform and its first four derivatives [1/sⁿ]. The model of the paper uses neither `look` nor the acceleration.
    """

    name: str
    subscript: str
    position: Matrix
    velocity: Matrix
    acceleration: Matrix
    look: tuple[Matrix, ...]
    position_error: Matrix
    velocity_error: Matrix
    acceleration_error: Matrix
    slant_range: Symbol
    azimuth: Symbol
    elevation: Symbol

    def exact_slant_range(self) -> Expr:
        """Return the slant range |r| as an expression of the components of the position. [m]"""
        # Matrix.norm() puts real components into Abs, which prevents simplification of their squares.
        return sqrt(sum(component**2 for component in self.position))


def platform(name: str, subscript: str) -> PlatformSymbols:
    """Return the symbols of one platform, with subscripts as in the paper."""

    def vector(letter: str) -> Matrix:
        return ImmutableMatrix([real(f"{letter}_{axis}{subscript}") for axis in AXES])

    return PlatformSymbols(
        name=name,
        subscript=subscript,
        position=ImmutableMatrix([real(f"{axis}_{subscript}") for axis in AXES]),
        velocity=vector("v"),
        acceleration=vector("a"),
        look=tuple(vector(name) for name in ("u", "udot", "uddot", "udddot", "uddddot")),
        position_error=vector("ptilde"),
        velocity_error=vector("vtilde"),
        acceleration_error=vector("atilde"),
        slant_range=positive(f"R_{subscript}"),
        azimuth=real(f"phibar_{subscript}"),
        elevation=real(f"thetabar_{subscript}"),
    )


TRANSMITTER = platform("transmitter", "t")
RECEIVER = platform("receiver", "r")
PLATFORM_SYMBOLS = (TRANSMITTER, RECEIVER)
