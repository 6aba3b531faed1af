"""Effects of errors of any size on an image, by exact ranges alone: the reference that the check is held against.

Nothing here comes from the package's own exact ranges, full model or theory. It takes the mission as loaded, frames
of axes and the speed of light, and has its own quadrature (24 Gauss-Legendre nodes over the aperture).

Recorded are the ranges of the true paths to the scene centre, and c·t̃(τ). Predicted are those of the measured paths,
path + error, to a point x of the ground plane. With a direct path both are less the distance of the platforms, by
the true and by the measured paths, and there is no clock error. With ρ = recorded − predicted, the response peaks at
the x of the least V = (1 + b²)⟨ρ²⟩ − ⟨ρ⟩², ⟨ ⟩ over the aperture and b² = B²/(12 f₀²). It is followed from the scene
centre while the error grows from nothing, in short steps along its tangent, so that it is the response and no other
minimum. Then QPE = (2π/λ)·3/2·(coefficient of P₂) and cubic = (2π/λ)·5/2·(that of P₃), both at the aperture edge; the
rest is the root mean square beyond P₃; and what V has beside those three is hidden: as much as a quadratic phase of
(2π/λ)·√(45/4·that) would lose. Where a line of sight turns by more than a radian, cubic and rest are hidden as well.
The image ends where the gradients of V span less than a fifth of the area that they span without error, and half a
cycle is hidden: no ground point has that range history.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import FRAME_AXES, PlatformState
from bisar_budget.mission.model import Mission

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

KINDS = ("position", "velocity", "acceleration")
CLOCK = ("constant", "linear", "quadratic", "cubic")
FAR = 0.1  # of a slant range; an error that takes a platform farther is none of navigation

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)  # over -1 … 1
_BASIS = np.array([np.polynomial.legendre.Legendre.basis(n)(_NODES) for n in range(4)])
_PROJECT = (_BASIS * _WEIGHTS * (np.arange(4)[:, None] + 0.5)).T  # (24, 4): values at the nodes to P₀ … P₃
_MEAN = _WEIGHTS / 2
_STEP_M, _STEP = 1e-5, 1e-6  # that Newton's last step may make, besides of the distance; the next is its square
_NEWTON = 40
_CORRECTION, _TRIFLE_M = 0.3, 1e-4  # of the tangent's way that Newton may add; what is no way to speak of
FOLDED = 0.2  # of the area that gradients span without error
HIDDEN_END_RAD = math.pi  # beyond which an image has ended, where gradients span little
TURN_RAD = 1.0  # of a line of sight; beyond, orders of the aperture have no meaning
_CHANGE = 0.5  # of the area that gradients span, within one step
_NEAR_FOLD = 0.3  # of that area without error; below, it may change by any factor
_FADES_AT, _FADES_WITHIN = (
    0.1,
    0.3,
)  # of that area, below which a peak may fade into another; of its displacement, where
_SMALLEST = 2.0**-16  # of the way to the next size; where no step of that is found, the solution ends


class Error(NamedTuple):
    """One error of a mission: what one unit of it does to the paths and the clock.

    `paths` (2, 3, 3) is position, velocity, acceleration of transmitter and receiver along x, y, z; `clock` (4,) the
    terms of t̃. `declared` carries sign and coverage factor. `cap` is the size at which it takes a platform farther
    than a tenth of its slant range within the aperture, of a clock that at which a range sum has no ground point any
    more: it is no less than the distance of the platforms. `is_stated` tells the axes of the file from those of the
    scene, along which the same error is shown again. A platform in free fall flies its `paths` as another orbit.
    """

    id: str
    owner: str
    paths: Array
    clock: Array
    declared: float | None
    cap: float
    is_stated: bool = True
    is_of_a_path: bool = True  # not the height of a scene, which changes no orbit


def errors_of(mission: Mission) -> Iterator[Error]:
    """Every error with a row of its own, declared or not; `other_errors` are phases and need no ranges."""
    T, factor = mission.collection.aperture_time, mission.allocation.coverage_factor
    edge = (1.0, T / 2, T**2 / 8)
    states = _states(mission)
    ranges = [math.hypot(*state.position) for state in states]
    for index, (name, state) in enumerate(zip(("transmitter", "receiver"), states, strict=True)):
        error = getattr(mission.platforms, name).motion_error
        axes = np.array(state.frame(error.frame))
        for order, kind in enumerate(KINDS):
            stated = getattr(error, kind)
            sizes = None if stated is None else factor * np.array(stated)
            cap = FAR * ranges[index] / edge[order]
            is_scene = error.frame == "scene"
            for axis, letter in enumerate("xyz"):
                on_axis = None if sizes is None else _along(sizes, axes[:, axis], is_scene, error.distribution)
                paths = _unit_path((index,), order, np.eye(3)[axis])
                yield Error(f"{name}.{kind}.{letter}", name, paths, np.zeros(4), on_axis, cap, is_scene)
            if sizes is None or is_scene:
                continue
            for letter, direction, size in zip(FRAME_AXES[error.frame], axes, sizes, strict=True):
                paths = _unit_path((index,), order, direction)
                if kind == "position" and error.frame == "ric" and state.fall is not None:
                    paths[index, 1] = -np.cross(_earth(mission)[1], direction)  # at rest against the stars
                yield Error(f"{name}.{kind}.{letter}", name, paths, np.zeros(4), float(size), cap)
    near, still = FAR * min(ranges), np.zeros((2, 3, 3))
    for order, term in enumerate(CLOCK):
        value = getattr(mission.timing_error, term)
        cap = 2 * min(ranges) / SPEED_OF_LIGHT_MPS / (T / 2) ** order
        size = None if value is None else factor * value
        clock = np.zeros(4) if _is_heard(mission) else np.eye(4)[order]
        yield Error(f"timing.{term}", "clock", still, clock, size, cap)
    both = (0, 1)
    if mission.common_motion_error is not None:
        for order, kind in enumerate(KINDS):
            stated = getattr(mission.common_motion_error, kind)
            for axis, letter in enumerate("xyz"):
                size = None if stated is None else factor * stated[axis]
                paths = _unit_path(both, order, np.eye(3)[axis])
                yield Error(f"common.{kind}.{letter}", "mission", paths, np.zeros(4), size, near / edge[order])
    if mission.scene.height_error is not None:
        # A scene that is higher than the processor takes it for: both platforms are measured too high above it.
        paths = _unit_path(both, 0, np.eye(3)[2])
        height = mission.scene.height_error
        yield Error("mission.terrain", "mission", paths, np.zeros(4), height, near, is_of_a_path=False)


def _is_heard(mission: Mission) -> bool:
    return mission.synchronization is not None and mission.synchronization.method == "direct_path"


def _states(mission: Mission) -> tuple[PlatformState, PlatformState]:
    return mission.geometry.transmitter, mission.geometry.receiver


def _earth(mission: Mission) -> tuple[Array, Array]:
    """The Earth's centre [m] and rotation [rad/s] in the scene's axes."""
    axes = mission.scene.axes
    if axes is None:
        return np.array((0.0, 0.0, -6.371e6)), np.zeros(3)
    return np.array(axes.place((0.0, 0.0, 0.0))), np.array(axes.turned((0.0, 0.0, 7.292115e-5)))


def _unit_motions(mission: Mission, state: PlatformState, tau: Array) -> Array:
    """Motion by unit errors at mid-aperture, (3 orders, 3 axes, n, 3): a polynomial, or a disturbed orbit. [m]

    δr̈ = Gδr − ω×(ω×δr) − 2ω×δṙ + a, G = μ/r³·(3r̂r̂ᵀ − 1), by the Dormand-Prince method.
    """
    if state.fall is None:
        powers = np.array([np.ones_like(tau), tau, tau**2 / 2])
        straight: Array = np.einsum("on,af->oanf", powers, np.eye(3))
        return straight
    centre, rotation = _earth(mission)
    turn = np.cross(rotation, np.eye(3)).T  # turn @ v is ω×v

    def rates(time: float, values: Array) -> Array:
        offset = np.array(state.place(time)) - centre
        square = offset @ offset
        gravity = 3.986004418e14 / square**1.5 * (3 * np.outer(offset, offset) / square - np.eye(3))
        place, velocity, push = values.reshape(3, 3, 9)
        pull = gravity @ place - turn @ (turn @ place) - 2 * turn @ velocity + push
        return np.concatenate((velocity, pull, np.zeros((3, 9)))).ravel()

    motions = np.empty((3, 3, len(tau), 3))
    for is_side in (tau >= 0, tau < 0):
        times = tau[is_side][np.argsort(np.abs(tau[is_side]))]
        run = solve_ivp(rates, (0.0, times[-1]), np.eye(9).ravel(), "DOP853", times, rtol=1e-11, atol=1e-9)
        places = run.y.reshape(3, 3, 3, 3, -1)[0]  # component, order, axis, time
        motions[:, :, np.flatnonzero(is_side)[np.argsort(np.abs(tau[is_side]))]] = places.transpose(1, 2, 3, 0)
    return motions


def _unit_path(platforms: Sequence[int], order: int, direction: Array) -> Array:
    paths = np.zeros((2, 3, 3))
    for index in platforms:
        paths[index, order] = direction
    return paths


def _along(sizes: Array, parts: Array, is_scene: bool, distribution: str) -> float:
    """Size along one axis of the scene of three independent errors: sigmas add as squares, bounds as magnitudes."""
    signed = sizes * parts
    if is_scene:
        return float(signed.sum())
    size = math.hypot(*signed) if distribution == "normal" else float(np.abs(signed).sum())
    return math.copysign(size, signed.sum())


class Responses(NamedTuple):
    """Signed QPE and cubic phase [rad] and place on the ground (…, 2) [m]; NaN where there is no ground point.

    With them the hidden phase, and the rms beyond the cubic. [rad]
    """

    qpe: Array
    cubic: Array
    place: Array
    hidden: Array
    rest: Array

    def judged(self, gain: float) -> Array:
        """Phase that is held to a limit with the gain of autofocus in it, which helps nothing hidden. [rad]"""
        judged: Array = np.hypot(self.qpe, gain * self.hidden)
        return judged

    @property
    def moved(self) -> Array:
        """Distance from where the error-free response stands. [m]"""
        moved: Array = np.hypot(self.place[..., 0], self.place[..., 1])
        return moved


class Lanes:
    """Several errors side by side, each followed from nothing to its own sizes.

    Parameters
    ----------
    mission : Mission
        As loaded.
    errors : sequence of Error
        (L,), one lane each.
    points : (L, 2) array, optional
        Points of the ground in place of the scene centre. [m]
    """

    def __init__(self, mission: Mission, errors: Sequence[Error], points: Array | None = None) -> None:
        half = mission.collection.aperture_time / 2
        tau = half * _NODES
        self.wavenumber = 2 * math.pi / mission.radar.wavelength
        powers = np.array([np.ones_like(tau), tau, tau**2 / 2])  # (3, n)
        motion = np.array([(s.position, s.velocity, s.acceleration) for s in _states(mission)])  # (2, 3, 3)
        self.true = np.einsum("kof,on->knf", motion, powers)[None]  # (1, 2, n, 3)
        for platform, state in enumerate(_states(mission)):
            for power, bend in enumerate(state.bends, 3):
                self.true[0, platform] += np.outer(tau**power, bend)
        if points is not None:
            ground = np.concatenate([points, np.zeros((len(points), 1))], axis=1)
            self.true = self.true - ground[:, None, None, :]  # (L, 2, n, 3)
        self.recorded = np.linalg.norm(self.true, axis=-1)
        units = np.array([_unit_motions(mission, state, tau) for state in _states(mission)])
        straight = np.einsum("on,af->oanf", powers, np.eye(3))
        self.error = np.array(
            [np.einsum("koa,koanf->knf", e.paths, units if e.is_of_a_path else 0 * units + straight) for e in errors]
        )
        self.is_heard = _is_heard(mission)
        self.apart, self.parted = self.true[:, 0] - self.true[:, 1], self.error[:, 0] - self.error[:, 1]
        clock = np.array([e.clock for e in errors])
        self.clock = SPEED_OF_LIGHT_MPS * clock @ np.array([tau**order for order in range(4)])  # (L, n)
        self.band = (mission.radar.bandwidth / mission.radar.center_frequency) ** 2 / 12
        looks = self.true / self.recorded[..., None]
        cosines = np.einsum("lknf,lkmf->lknm", looks, looks).min(axis=(1, 2, 3))
        self.is_turned = np.broadcast_to(cosines < math.cos(TURN_RAD), (len(errors),))
        count = len(errors)
        self.at_rest = self._tangent(np.zeros(count), np.zeros((count, 2)), slice(None))[1]  # (L,)

    def _product(self, one: Array, other: Array) -> Array:
        """(1 + b²)⟨ac⟩ − ⟨a⟩⟨c⟩ of (L, n, f) and (L, n, g), (L, f, g)."""
        means = (_MEAN @ one)[:, :, None] * (_MEAN @ other)[:, None]
        weighted: Array = (_MEAN[:, None] * one).swapaxes(1, 2)
        return (1 + self.band) * (weighted @ other) - means

    def _seen(self, size: Array, place: Array, lanes: Any) -> tuple[Array, Array, Array]:
        """ρ (L, n), unit vectors from the point to the measured platforms (L, 2, n, 3), and distances (L, 2, n)."""
        at = lanes if len(self.true) > 1 else slice(None)
        true, recorded = self.true[at], self.recorded[at]
        off = size[:, None, None, None] * self.error[lanes]
        off[..., :2] -= place[:, None, None, :]
        measured = true + off
        predicted = np.linalg.norm(measured, axis=-1)
        # |a| − |b| without the rounding of either: a satellite's range is 10⁶ m, what is left is 10⁻⁶ m.
        left = -np.einsum("lknf,lknf->lkn", off, true + measured) / (recorded + predicted)
        total = left.sum(axis=1) + size[:, None] * self.clock[lanes]
        if self.is_heard:
            apart, more = self.apart[at], size[:, None, None] * self.parted[lanes]
            lengths = np.linalg.norm(apart + more, axis=-1) + np.linalg.norm(apart, axis=-1)
            total += np.einsum("lnf,lnf->ln", more, 2 * apart + more) / lengths
        return total, measured / predicted[..., None], predicted

    def _slopes(self, left: Array, look: Array, distance: Array) -> tuple[Array, Array, Array]:
        """Half the slope of V over the ground (L, 2), half its second derivative, and that without the bend of ρ."""
        ground = look[..., :2]
        gradient = ground.sum(axis=1)
        across = (np.eye(2) - ground[..., :, None] * ground[..., None, :]) / distance[..., None, None]
        bend = -across.sum(axis=1).reshape(*left.shape, 4)
        slope, flat = self._product(gradient, left[..., None])[..., 0], self._product(gradient, gradient)
        return slope, flat + self._product(bend, left[..., None]).reshape(-1, 2, 2), flat

    def _tangent(self, size: Array, place: Array, lanes: Any) -> tuple[Array, Array]:
        """How fast the place moves with size (L, 2), and the area that the gradients span there (L,)."""
        left, look, distance = self._seen(size, place, lanes)
        error = self.error[lanes]
        towards = np.einsum("lknf,lknf->lkn", look, error)
        grown = self.clock[lanes] - towards.sum(axis=1)
        if self.is_heard:
            parted = self.parted[lanes]
            apart = self.apart[lanes if len(self.true) > 1 else slice(None)] + size[:, None, None] * parted
            grown = grown + np.einsum("lnf,lnf->ln", apart, parted) / np.linalg.norm(apart, axis=-1)
        turned = ((error - look * towards[..., None]) / distance[..., None])[..., :2].sum(axis=1)
        _, whole, flat = self._slopes(left, look, distance)
        gradient = look[..., :2].sum(axis=1)
        change = self._product(turned, left[..., None])[..., 0] + self._product(gradient, grown[..., None])[..., 0]
        return _against(whole, change), np.sqrt(np.maximum(_determinant(flat), 0.0))

    def _phases(self, size: Array, place: Array, lanes: Any) -> tuple[Array, Array, Array, Array]:
        """QPE, cubic, hidden phase and rest at places. [rad]"""
        left, _, _ = self._seen(size, place, lanes)
        parts = left @ _PROJECT
        rest = ((left - parts @ _BASIS) ** 2) @ _MEAN
        whole = self._product(left[..., None], left[..., None])[:, 0, 0]
        cubic = parts[:, 3] ** 2 / 7
        hidden = whole - parts[:, 2] ** 2 / 5 - np.where(self.is_turned[lanes], 0.0, cubic + rest)
        hidden = math.sqrt(45 / 4) * np.sqrt(np.maximum(hidden, 0.0))
        k = self.wavenumber
        return 1.5 * k * parts[:, 2], 2.5 * k * parts[:, 3], k * hidden, k * np.sqrt(rest)

    def _advanced(self, at: "_Reached", size: Array, lanes: Any) -> tuple["_Reached", Flags]:
        """Minimum of V at other sizes, by Newton's steps from along the tangent.

        The flags tell where it is one, on the same way: Newton had to correct the tangent's way by less than a third
        of it, and the area that the gradients span has kept much of its size, or is small. Where it is below a
        fiftieth of that without error the image has ended as soon as half a cycle is hidden.
        """
        start = at.place + at.tangent * (size - at.size)[:, None]
        place, done = start.copy(), np.zeros(len(start), bool)
        with np.errstate(all="ignore"):
            for _ in range(_NEWTON):
                slope, whole, flat = self._slopes(*self._seen(size, place, lanes))
                is_bowl = (_determinant(whole) > 0.05 * _determinant(flat)) & (whole[:, 0, 0] > 0)
                step = _against(np.where(is_bowl[:, None, None], whole, flat), slope)
                moves = np.hypot(step[:, 0], step[:, 1])
                sound = np.isfinite(moves) & (moves < 1e9)
                place = np.where(sound[:, None], place + step, place)
                done = sound & (moves <= _STEP_M + _STEP * np.hypot(place[:, 0], place[:, 1]))
                if done.all():
                    break
            tangent, area = self._tangent(size, place, lanes)
            corrected = np.linalg.norm(place - start, axis=1) / (_TRIFLE_M + np.linalg.norm(start - at.place, axis=1))
            change, part = area / at.area, area / self.at_rest[lanes]
            found = done & (corrected < _CORRECTION)
            found &= ((change > _CHANGE) & (change < 1 / _CHANGE)) | (part < _NEAR_FOLD)
            found &= (part > FOLDED) | (self._phases(size, place, lanes)[2] < HIDDEN_END_RAD)
        return _Reached(size, place, tangent, area), found

    def follow(self, sizes: Array, all_or_none: bool = False) -> Responses:
        """Follow each error through its sizes.

        Parameters
        ----------
        sizes : (L, S) array
            Signed; each row moves away from nothing.
        all_or_none : bool
            Give up where one of them ends: all are then NaN.

        Returns
        -------
        Responses
            (L, S) each.
        """
        lanes, steps = sizes.shape
        places, phases = np.full((lanes, steps, 2), np.nan), np.full((4, lanes, steps), np.nan)
        none, nowhere = np.zeros(lanes), np.zeros((lanes, 2))
        reached = _Reached(none, nowhere, *self._tangent(none, nowhere, slice(None)))
        alive = np.arange(lanes)
        for step in range(steps):
            size = sizes[alive, step]
            arrived, found = self._advanced(reached, size, alive)
            for index in np.flatnonzero(~found):
                one, found[index] = self._crept(int(alive[index]), reached.only(index), size[index])
                for whole, part in zip(arrived, one, strict=True):
                    whole[index] = part[0]
            if all_or_none and not found.all():
                return _responses(phases * np.nan, places * np.nan)
            alive, reached = alive[found], arrived.only(found)
            places[alive, step] = reached.place
            phases[:, alive, step] = self._phases(reached.size, reached.place, alive)
        return _responses(phases, places)

    def _crept(self, lane: int, at: "_Reached", end: float) -> tuple["_Reached", bool]:
        """Follow one lane in steps as small as it takes; False where the solution ends."""
        whole = end - float(at.size[0])
        step = whole / 2
        while at.size[0] != end:
            target = at.size + step
            if abs(end - at.size[0]) <= abs(step):
                target = np.array([end])
            there, found = self._advanced(at, target, [lane])
            if found[0]:
                at, step = there, step * 1.5
            elif abs(step) < abs(whole) * _SMALLEST:
                wider = self._faded(lane, at, end)
                if wider is None:
                    return at, False
                at, step = wider, whole / 2
            else:
                step /= 2
        return at, True

    def _faded(self, lane: int, at: "_Reached", end: float) -> "_Reached | None":
        """Peak into which the peak of a lane fades at a fold, a ten-thousandth of the size on: where V leads down."""
        if at.area[0] >= _FADES_AT * self.at_rest[lane]:
            return None
        size = at.size + np.sign(end) * min(abs(end - at.size[0]), 1e-4 * abs(at.size[0]))

        measured = self.true[lane if len(self.true) > 1 else 0] + size * self.error[lane]  # (2, n, 3)
        rest = self._seen(size, np.zeros((1, 2)), [lane])[0][0]
        distance = np.sqrt((measured**2).sum(axis=-1))

        def variance(place: Array) -> float:
            """V at a point of the ground: ρ is that at the origin, and what the point takes from both distances."""
            nearer = 2 * measured[..., 0] * place[0] + 2 * measured[..., 1] * place[1] - place @ place
            left = rest + (nearer / (distance + np.sqrt(distance**2 - nearer))).sum(axis=0)
            return float(self.wavenumber**2 * ((1 + self.band) * (_MEAN @ left**2) - (_MEAN @ left) ** 2))

        way = np.linalg.norm(at.place[0])
        corners = at.place[0] + 0.01 * way * np.array(((0, 0), (1, 0), (0, 1)))
        options = {"xatol": 1e-5, "fatol": 1e-16, "maxiter": 2000, "initial_simplex": corners}
        place = minimize(variance, at.place[0], method="Nelder-Mead", options=options).x[None]
        hidden = self._phases(size, place, [lane])[2]
        if np.linalg.norm(place - at.place) > _FADES_WITHIN * way or hidden > HIDDEN_END_RAD:
            return None
        return _Reached(size, place, *self._tangent(size, place, [lane]))


def _responses(phases: Array, places: Array) -> Responses:
    qpe, cubic, hidden, rest = phases
    return Responses(qpe, cubic, places, hidden, rest)


class _Reached(NamedTuple):
    """Where the lanes are: size (L,), place (L, 2), how that moves with size (L, 2), area of gradients (L,)."""

    size: Array
    place: Array
    tangent: Array
    area: Array

    def only(self, lanes: Any) -> "_Reached":
        """Some of them; of a number that one."""
        lanes = [lanes] if np.ndim(lanes) == 0 else lanes
        return _Reached(*(of[lanes] for of in self))


def _against(slopes: Array, residual: Array) -> Array:
    """Step (L, 2) on the ground that takes a residual (L, 2) away, to first order."""
    determinant = _determinant(slopes)
    return -np.stack(
        [
            (slopes[:, 1, 1] * residual[:, 0] - slopes[:, 0, 1] * residual[:, 1]) / determinant,
            (slopes[:, 0, 0] * residual[:, 1] - slopes[:, 1, 0] * residual[:, 0]) / determinant,
        ],
        axis=1,
    )


def _determinant(slopes: Array) -> Array:
    determinant: Array = slopes[:, 0, 0] * slopes[:, 1, 1] - slopes[:, 0, 1] * slopes[:, 1, 0]
    return determinant


def at_declared(mission: Mission, errors: Sequence[Error], points: Array | None = None) -> Responses:
    """Responses to the declared errors: (2, L) each, with the declared sign and with the other.

    `points` (L, 2) stand in place of the scene centre [m]; places are relative to them, and all is NaN where one of
    the errors has no ground point.
    """
    declared = np.array([error.declared or 0.0 for error in errors])
    grow = np.array([0.02, 0.1, 0.3, 0.6, 1.0])
    sizes = np.concatenate([declared, -declared])[:, None] * grow
    twice = None if points is None else np.concatenate([points, points])
    found = Lanes(mission, [*errors, *errors], twice).follow(sizes, all_or_none=points is not None)
    count = len(errors)
    return Responses(*(part[:, -1].reshape(2, count, *part.shape[2:]) for part in found))


def scanned(
    mission: Mission, errors: Sequence[Error], ends: Array, marks: Array, steps: int, bound: Array
) -> tuple[Array, Responses]:
    """Follow each error of both signs up to `ends`, densely enough to see each rise of a phase.

    Parameters
    ----------
    errors : sequence of Error
        (L,)
    ends : (L,) array
        Last size. [unit of each]
    marks : (L, M) array
        Sizes to stop at besides, where they are within the ends; NaN where there is none.
    steps : int
        Number of other sizes, in equal ratios.
    bound : (L,) array
        A QPE [rad] that matters: the scan starts where first and second order stay below a fiftieth of it.

    Returns
    -------
    (L, S) array
        The sizes, ascending, positive.
    Responses
        (2, L, S) each, with size positive and negative.
    """
    count = len(errors)
    lanes = Lanes(mission, [*errors, *errors])
    signs = np.repeat([1.0, -1.0], count)
    starts = _beginning(lanes, signs, ends, bound)
    ratio = np.linspace(0, 1, steps)
    grid = starts[:, None] * (ends / starts)[:, None] ** ratio
    marks = np.where(np.isfinite(marks) & (marks > 0) & (marks <= ends[:, None]), marks, ends[:, None])
    grid = np.sort(np.concatenate([grid, marks], axis=1), axis=1)
    found = lanes.follow(signs[:, None] * np.concatenate([grid, grid]))
    return grid, Responses(*(part.reshape(2, *grid.shape, *part.shape[2:]) for part in found))


def _beginning(lanes: Lanes, signs: Array, ends: Array, bound: Array) -> Array:
    """Size (L,) of either sign below which no phase comes near its bound, by the first two orders at a small size."""
    count = len(ends)
    begin = ends * 1e-3
    for _ in range(4):
        probe = signs[:, None] * np.concatenate([begin, begin])[:, None] * np.array([0.25, 0.5, 1.0])
        found = lanes.follow(probe)
        qpe = np.where(np.isfinite(found.qpe), np.hypot(found.qpe, found.hidden), np.inf)
        largest = np.abs(qpe).max(axis=1).reshape(2, count).max(axis=0)
        large = largest > 0.02 * bound
        if not large.any():
            break
        # A phase grows at least as the size does here, so that the same share less of it is small enough.
        shrink = np.where(large, 0.01 * bound / np.where(np.isfinite(largest), largest, 100 * bound), 1.0)
        begin = begin * np.where(large, np.minimum(shrink, 0.5), 1.0)
    return begin


def combined(phases: Array, rule: str) -> float:
    """Largest, sum or root-sum-square of magnitudes. [rad]"""
    sizes = np.abs(phases)
    if not len(sizes):
        return 0.0
    if rule == "each":
        return float(sizes.max())
    return float(sizes.sum() if rule == "sum" else np.linalg.norm(sizes))


def combined_places(places: Array, rule: str) -> float:
    """Largest length, largest sum over both signs of each error, or root-sum-square; (2, L, 2) both signs. [m]"""
    lengths = np.hypot(places[..., 0], places[..., 1]).max(axis=0)
    if rule != "sum":
        return combined(lengths, rule)
    angle = np.linspace(0, 2 * math.pi, 3600, endpoint=False)
    along = np.einsum("slf,fa->sla", places, np.array([np.cos(angle), np.sin(angle)]))
    return float(along.max(axis=0).sum(axis=0).max())


def at_the_edge(mission: Mission, errors: Sequence[Error], rule: str) -> tuple[float, float] | None:
    """Largest difference of QPE between the scene's rim and its centre, combined by the rule. [rad]

    Of each error the sign with the larger difference, and likewise the declared sign alone. None where a part of the
    rim has no image of an error.
    """
    radius = mission.scene.radius
    assert radius is not None
    centre = at_declared(mission, errors).qpe
    azimuths = np.linspace(0, 2 * math.pi, 72, endpoint=False)
    best = [0.0, 0.0]
    spacing = azimuths[1]
    for _ in range(3):
        rim = radius * np.stack([np.cos(azimuths), np.sin(azimuths)], axis=1)
        points = np.repeat(rim, len(errors), axis=0)
        found = at_declared(mission, list(errors) * len(rim), points)
        difference = found.qpe.reshape(2, len(rim), len(errors)) - centre[:, None, :]
        if not np.isfinite(difference).all():
            return None
        worse = [combined(row, rule) for row in np.abs(difference).max(axis=0)]
        declared = [combined(row, rule) for row in difference[0]]
        best = [max(best[0], *worse), max(best[1], *declared)]
        crest = azimuths[int(np.argmax(worse))]
        azimuths = crest + np.linspace(-spacing, spacing, 9)
        spacing /= 4
    return best[0], best[1]
