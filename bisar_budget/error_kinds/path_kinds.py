"""Kinds of error of a measured path: position, velocity, acceleration, time tag and height.

Each of these kinds, and each kind that another package registers, defines the motion error of the antenna's phase
centre that an error of one unit causes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bisar_budget import units
from bisar_budget.error_kinds.kind import AS_STATED, BOUND, ErrorSize, SourceKind

if TYPE_CHECKING:
    from bisar_budget.arrays import Floats
    from bisar_budget.geometry import PlatformState, VectorArrays, Vectors

NO_DIRECTION = (0.0, 0.0, 0.0)  # of an error whose motion has a direction of its own


@dataclass(frozen=True, kw_only=True, eq=False)
class PathKind(SourceKind):
    """A kind of error of a measured path."""

    moves: str = "platform"

    def moved(self, path: "PlatformState", times: "Floats", direction: "Vectors" = NO_DIRECTION) -> "Vectors":
        """Motion error per unit: measured minus true position, east, north and up. [m/unit]

        Parameters
        ----------
        path : PlatformState
            True path of the platform.
        times : (nodes, cases)
            Slow times. [s]
        direction : Vectors
            Unit vector along which the file states the error; not used for a kind whose motion has a direction of its
            own.

        Returns
        -------
        Vectors
            Three components, (nodes, cases) or broadcastable to it.
        """
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True, eq=False)
class StateKind(PathKind):
    """A kind of error of a platform's state at mid-aperture: position, velocity or acceleration.

    Its `order` is 0, 1 or 2.

    Attributes
    ----------
    symbol : str
        Symbol of the error in formulas.
    defocusing_vectors : tuple of str
        Name, in singular and plural, of the vector along which an error must have a component to defocus the image.
        Empty for a position error, because there is no such vector.
    """

    order: int
    common_id_form: str = "common.{kind}.{axis}"
    key_form: str = "platforms.{owner}.motion_error.{kind}"
    common_key_form: str = "common_motion_error.{kind}"
    symbol: str
    defocusing_vectors: tuple[str, str] | tuple[()] = ()

    @property
    def has_covariance(self) -> bool:
        """Whether a mission file can state an error of this kind as a covariance.

        This is the case for position and velocity errors.
        """
        return self.order < 2

    def course(self, times: "Floats") -> "Floats":
        """Position error along its direction per unit: 1, τ or τ²/2, as in equation (22) of Rigling & Moses."""
        return (np.ones_like(times), times, times**2 / 2)[self.order]

    def moved(
        self,
        path: "PlatformState",
        times: "Floats",
        direction: "Vectors" = NO_DIRECTION,
        frame: str = "scene",
        motions: "Floats | None" = None,
    ) -> "VectorArrays":
        """Motion error per unit along a direction, east, north and up, (nodes, cases) each. [m/unit]

        The motion is the polynomial of equation (22) in Rigling & Moses. If the platform is in free fall, the motion
        instead follows the dynamics of the orbit.

        Parameters
        ----------
        frame : str
            Frame in which the file states the error.
        motions : (3, 3, 3, nodes, cases), optional
            Motion due to unit errors of the state of a platform in free fall at these times, if it is known.
        """
        if path.fall is None:
            course = self.course(times)
            return direction[0] * course, direction[1] * course, direction[2] * course
        if motions is None:
            half = np.abs(times).max(axis=0)
            motions = path.fall.motions(path, half, times[:, 0] / half[0])
        x, y, z = _along(motions[self.order], direction)
        if self.keeps_direction(path, frame):
            u, v, w = _along(motions[1], self.rate(path, direction, frame))
            return x + u, y + v, z + w
        return x, y, z

    def keeps_direction(self, path: "PlatformState", frame: str) -> bool:
        """Whether an error stated in a frame is a vector that keeps its direction in inertial space.

        Velocities in the frame `ric` are inertial. A position error in this frame, without a velocity error,
        therefore does not turn with the Earth, if the platform is in free fall.
        """
        return self.order == 0 and frame == "ric" and path.fall is not None

    def rate(self, path: "PlatformState", direction: "Vectors", frame: str) -> "Vectors":
        """Velocity at mid-aperture, in scene axes, of a position error that keeps its direction. [(m/s)/unit]

        It is zero for any other error.
        """
        if path.fall is None or not self.keeps_direction(path, frame):
            return NO_DIRECTION
        return path.fall.rate_against_stars(direction)


def _along(motions: "Floats", direction: "Vectors") -> "Floats":
    """Motion (3, ...) due to an error along a direction, from the motions (3, 3, ...) due to errors along x, y, z."""
    return np.asarray(sum(motions[axis] * direction[axis] for axis in range(3)))


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeTagKind(PathKind):
    """The kind of error of navigation time relative to radar time.

    With an error δt, the position measured for the time t is the true position at the time t + δt.
    """

    def moved(self, path: "PlatformState", times: "Floats", direction: "Vectors" = NO_DIRECTION) -> "Vectors":
        """Motion error per unit of a small error: the platform's velocity, three components (nodes, cases). [m/s]"""
        u, v, w = (np.broadcast_to(component, times.shape) for component in path.at(times)[1])
        return u, v, w


@dataclass(frozen=True, kw_only=True, eq=False)
class HeightKind(PathKind):
    """The kind of error of the scene's height.

    A scene that is higher than the processor assumes has the same effect as platforms that are both measured too
    high.
    """

    def moved(self, path: "PlatformState", times: "Floats", direction: "Vectors" = NO_DIRECTION) -> "Vectors":
        """Motion error per unit: one metre up. [m/unit]"""
        return 0.0, 0.0, 1.0


def _of_state(dimension: units.Dimension, equation: str) -> Mapping[str, ErrorSize]:
    return {
        "": ErrorSize(dimension=dimension, key="{index}", distribution=AS_STATED, equation=equation, has_axes=True)
    }


POSITION_KIND = StateKind(
    name="position",
    description="Constant error of the measured position.",
    order=0,
    symbol="p\u0303",
    flown_as="position",
    sizes=_of_state(units.LENGTH, "Table I"),
)
VELOCITY_KIND = StateKind(
    name="velocity",
    description="Constant error of the measured velocity; its position error grows from mid-aperture.",
    order=1,
    symbol="ṽ",
    flown_as="velocity",
    defocusing_vectors=("velocity", "velocities"),
    sizes=_of_state(units.SPEED, "Table II"),
)
ACCELERATION_KIND = StateKind(
    name="acceleration",
    description="Constant error of the measured acceleration; its position error grows with the square of time.",
    order=2,
    symbol="ã",
    flown_as="acceleration",
    defocusing_vectors=("line of sight", "lines of sight"),
    sizes=_of_state(units.ACCELERATION, "Table II"),
)
STATE_KINDS = (POSITION_KIND, VELOCITY_KIND, ACCELERATION_KIND)  # by order
MEASURED_KINDS = (POSITION_KIND, VELOCITY_KIND)  # which sources of paths and covariances state
TIME_TAG_KIND = TimeTagKind(
    name="time_tag",
    description="Time error of the navigation against the radar; positive: positions belong to later times.",
    key_form="platforms.{owner}.motion_error.{kind}",
    common_key_form="common_motion_error.{kind}",
    common_id_form="common.{kind}",
    flown_as="time_tag",
    shifts_time=True,
    sizes={
        "": ErrorSize(
            dimension=units.TIME,
            distribution=AS_STATED,
            equation="Tables I and II along the velocity and its rates",
        )
    },
)
TERRAIN_KIND = HeightKind(
    name="terrain",
    description="Height of the scene above the height that the processor assumes.",
    key_form="scene.height_error",
    order=0,
    flown_as="height",
    is_covered=False,
    owes_source=False,
    direction="height",
    sizes={"": ErrorSize(dimension=units.LENGTH, distribution=BOUND, equation="full model")},
)
