"""Kinds of random error, and of errors for which a mission file states only the effect on the image.

A random error has a sigma and no sign. A simulation draws random time series of the error over the aperture
(`SourceKind.drawn_as`).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bisar_budget import units
from bisar_budget.error_kinds.kind import BOUND, PEAK_AMPLITUDE, RELATIVE_LEVEL, ErrorSize, SourceKind

if TYPE_CHECKING:
    from bisar_budget.arrays import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class InertialFigure(ErrorSize):
    """A declared error of an inertial sensor, such as the bias of its gyros.

    Attributes
    ----------
    integrals : int
        Number of integrations over time that convert the error to the position error. A constant error that is
        integrated n times becomes τⁿ/n!.
    symbol : str
        Symbol of the error in formulas.
    tilt_formula : str
        Formula, as a function of the slow time τ, of the tilt that the error causes; empty if it causes no tilt.
    spreads : bool
        Whether the error is noise, which spreads power. Otherwise it is a random constant.
    is_scale : bool
        Whether the error is a fraction of the specific force.
    """

    equation: str = "inertial sensor"
    has_axes: bool = True
    integrals: int
    symbol: str
    tilt_formula: str = ""
    spreads: bool = False
    is_scale: bool = False

    @property
    def tilts(self) -> bool:
        """Whether the error tilts the axes of the sensor. A tilt rotates the specific force, and the lever arm."""
        return bool(self.tilt_formula)

    def course(self, times: "Floats") -> "Floats":
        """Position error at slow times due to a constant error that acts as an acceleration of one unit, τⁿ/n!."""
        return times**self.integrals / math.factorial(self.integrals)

    def tilt_course(self, times: "Floats") -> "Floats":
        """Tilt at slow times due to a constant error of one unit, for an error that tilts the axes: 1 or τ."""
        return times ** (self.integrals - 2)

    @property
    def growth_power(self) -> int:
        """Exponent n of the aperture time T: the covariance of the position error grows as Tⁿ."""
        return 2 * self.integrals - self.spreads


# Figures of an inertial sensor by name, in the order of `evaluators.inertial_phases`.
INERTIAL_FIGURES: Mapping[str, InertialFigure] = {
    figure.key: figure
    for figure in (
        InertialFigure(key="accelerometer_bias", dimension=units.ACCELERATION, integrals=2, symbol="b"),
        InertialFigure(
            key="accelerometer_scale_factor",
            dimension=units.RATIO,
            unit_text="1",
            integrals=2,
            symbol="κ",
            is_scale=True,
        ),
        InertialFigure(key="attitude", dimension=units.ANGLE, integrals=2, symbol="ψ", tilt_formula="ψ"),
        InertialFigure(key="gyro_bias", dimension=units.ANGULAR_RATE, integrals=3, symbol="ε", tilt_formula="ε·τ"),
        InertialFigure(
            key="velocity_random_walk", dimension=units.VELOCITY_RANDOM_WALK, integrals=2, symbol="N", spreads=True
        ),
        InertialFigure(
            key="angle_random_walk",
            dimension=units.ANGLE_RANDOM_WALK,
            integrals=3,
            symbol="N_g",
            tilt_formula="N_g·W(τ)",
            spreads=True,
        ),
    )
}
_GAUSS_MARKOV = "Gauss-Markov"

VIBRATION_KIND = SourceKind(
    name="vibration",
    description="Vibration of the antenna: sinusoids, noise without a spectrum, or a spectrum.",
    moves="platform",
    key_form="platforms.{owner}.motion_error.{kind}",
    drawn_as="phase",
    is_random=True,
    is_vibration=True,
    spectrum_axis="spectrum",
    sizes={
        "sinusoidal": ErrorSize(
            dimension=units.LENGTH,
            key="sinusoidal.{index}.amplitude",
            distribution=PEAK_AMPLITUDE,
            equation="Section V, sinusoidal",
        ),
        "wideband": ErrorSize(dimension=units.LENGTH, key="wideband.rms", equation="Section V, wideband"),
        "spectrum": ErrorSize(
            dimension=units.POWER_RATIO,
            key="spectrum_level",
            distribution=RELATIVE_LEVEL,
            equation="spectrum of vibration",
        ),
    },
)
IMU_KIND = SourceKind(
    name="imu",
    description="Error of an inertial sensor, which grows from mid-aperture.",
    moves="platform",
    key_form="platforms.{owner}.motion_error.{kind}",
    drawn_as="motion",
    is_random=True,
    is_largest_of_axes=True,
    sizes=INERTIAL_FIGURES,
)
NAVIGATION_KIND = SourceKind(
    name="navigation",
    description="Position error that an inertial unit aided by GNSS leaves.",
    moves="platform",
    key_form="platforms.{owner}.motion_error.{kind}",
    drawn_as="motion",
    is_random=True,
    is_computed=True,
    sizes={
        "": ErrorSize(
            dimension=units.POWER_RATIO, key="level", distribution=RELATIVE_LEVEL, equation="aided navigation"
        )
    },
)
LEVER_ARM_KIND = SourceKind(
    name="lever_arm",
    description="Error of the position of the antenna relative to the reference of the navigation.",
    moves="platform",
    key_form="platforms.{owner}.motion_error.{kind}",
    drawn_as="motion",
    is_random=True,
    sizes={
        "uncertainty": ErrorSize(dimension=units.LENGTH, key="uncertainty", equation="lever arm", has_axes=True),
        "attitude": ErrorSize(
            dimension=units.ANGLE,
            key="attitude",
            section_form=IMU_KIND.key_form.replace("{kind}", IMU_KIND.name),
            equation="lever arm",
            has_axes=True,
        ),
    },
)
RANDOM_KIND = SourceKind(
    name="random",
    description="Position errors that change within the aperture.",
    moves="platform",
    key_form="platforms.{owner}.motion_error.{kind}",
    common_key_form="common_motion_error.{kind}",
    common_id_form="common.{kind}.{axis}",
    drawn_as="motion",
    is_random=True,
    is_correlated=True,
    has_names=True,
    is_largest_of_axes=True,
    sizes={"": ErrorSize(dimension=units.LENGTH, key="{index}.sigma", equation=_GAUSS_MARKOV, has_axes=True)},
)
TRAJECTORY_KIND = SourceKind(
    name="trajectory",
    description="Noise of the fixes of a log, which the processor uses without smoothing.",
    moves="platform",
    key_form="platforms.{owner}.trajectory.processed",
    drawn_as="motion",
    is_random=True,
    is_correlated=True,
    is_of_log=True,
    is_largest_of_axes=True,
    sizes={"": ErrorSize(dimension=units.LENGTH, equation=_GAUSS_MARKOV)},
)
PROPAGATION_KIND = SourceKind(
    name="propagation",
    description="Residual delay of the air after correction, at the zenith of the scene.",
    moves="air",
    id_form="{kind}.{owner}.{axis}",
    common_id_form="{kind}.{axis}",
    key_form="propagation.{owner}",
    common_key_form="propagation",
    drawn_as="delay",
    is_random=True,
    sizes={
        "zenith_delay": ErrorSize(dimension=units.LENGTH, key="{axis}", equation="delay of the air"),
        "zenith_electron_content": ErrorSize(
            dimension=units.ELECTRON_CONTENT, key="{axis}", equation="delay of the air"
        ),
    },
)


def _effect(key: str, dimension: units.Dimension) -> ErrorSize:
    return ErrorSize(dimension=dimension, key=f"{{index}}.{key}", distribution=BOUND, equation="as declared")


OTHER_KIND = SourceKind(
    name="other",
    description="Error that was determined elsewhere, for which the file states only the effect on the image.",
    moves="image",
    id_form="{kind}.{axis}",
    key_form="other_errors",
    is_covered=False,
    has_names=True,
    sizes={
        "": _effect("quadratic_phase_error", units.ANGLE),
        "cubic_phase_error": _effect("cubic_phase_error", units.ANGLE),
        "location_error": _effect("location_error", units.LENGTH),
        "islr": _effect("islr", units.POWER_RATIO),
    },
)
