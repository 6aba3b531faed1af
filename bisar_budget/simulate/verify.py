"""Form images with each error set exactly at its published limit, and measure whether the limit is true."""

import math
from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from bisar_budget import evaluators
from bisar_budget.budget.allocation import Allocation, allocate
from bisar_budget.budget.sources import PLATFORMS, ErrorSource, error_sources
from bisar_budget.geometry import FRAME_AXES, BistaticGeometry, GroundVector
from bisar_budget.mission.model import Mission
from bisar_budget.simulate.exact import ExactEffect, exact_effect
from bisar_budget.simulate.image_formation import backprojection, ground_grid
from bisar_budget.simulate.impulse_response import impulse_response, quadratic_phase_error, upsampled
from bisar_budget.simulate.phase_history import (
    Complexes,
    Floats,
    MotionError,
    Path,
    PhaseHistory,
    Sinusoid,
    cell_centres,
    path,
    phase_history,
)

TOLERANCE = 0.05  # of the budget: nearer than this a limit is confirmed
VIBRATION_TOLERANCE_DB = 0.5
FIRST_ORDER_M = 30.0  # beyond, the second order of the range error is no longer small beside a budget
INSIDE, BEYOND = 0.9, 1.1  # of the limit: the phase on both sides shows that the limit is the limit

_CELLS = 40  # resolution cells of a cut
_OVERSAMPLING = 2.5  # samples of a cut per resolution cell
_FINE = 8  # interpolation of a cut before its peak is read
_FREQUENCIES = 64  # a cut stays within a few range cells
_PULSES_PER_CELL = 4
_WIDEBAND_RUNS = 32
_UNDECLARED_CYCLES = 10  # of a vibration per aperture, where the file gives no frequency


class Verdict(NamedTuple):
    """What the image says of one limit. None where a value does not exist; `reason` says why."""

    id: str
    model: str
    boundary_error: float
    unit: str
    budget_rad: float | None
    predicted_qpe_rad: float | None
    measured_qpe_rad: float | None
    measured_inside_rad: float | None
    measured_beyond_rad: float | None
    predicted_cubic_rad: float | None
    irw_ratio: float | None
    peak_loss_db: float | None
    pslr_db: float | None
    islr_db: float | None
    requirement_db: float | None
    measured_db: float | None
    measured_db_error: float | None
    displacement_m: GroundVector | None
    verdict: str
    reason: str | None


class VerifiedMission(NamedTuple):
    """The verdicts on one mission's limits."""

    file: str
    name: str
    rows: tuple[Verdict, ...]

    @property
    def status(self) -> str:
        """`fail` if a limit of the gating model is optimistic, else `pass`."""
        return "fail" if any(row.verdict == "optimistic" for row in self.rows) else "pass"


def verify_mission(mission: Mission, only: str = "*") -> VerifiedMission:
    """Verify every limit of a mission whose row id matches a glob.

    Parameters
    ----------
    mission : Mission
        As loaded. Autofocus is left out: each limit is the one without its gain.
    only : str
        Glob of row ids.

    Returns
    -------
    VerifiedMission
        Rows with a limit, in the order of `check`.
    """
    geometry = mission.geometry
    sources = error_sources(mission, geometry)
    allocation = allocate(mission, sources)
    scope = _Scope(mission, geometry)
    rows: list[Verdict] = []
    for source in sources:
        if source.effect.qpe and source.owner != "mission" and fnmatchcase(source.id, only):
            rows.append(_quadratic(scope, allocation, source))
    rows += _vibrations(scope, allocation, only)
    return VerifiedMission(file=mission.file, name=mission.name, rows=tuple(rows))


class _Errors(NamedTuple):
    """What is wrong in one image."""

    transmitter: MotionError = MotionError()
    receiver: MotionError = MotionError()
    clock_quadratic: float = 0.0

    def of(self, platform: str, error: MotionError) -> "_Errors":
        """Give one platform an error."""
        return self._replace(transmitter=error) if platform == "transmitter" else self._replace(receiver=error)


class _Scope:
    """The collection of a mission, and images of a point in it along the cross-range line y′."""

    def __init__(self, mission: Mission, geometry: BistaticGeometry) -> None:
        self.mission, self.geometry = mission, geometry
        self.wavelength = mission.radar.wavelength
        self.aperture_time = mission.collection.aperture_time
        self.resolution = geometry.cross_range_resolution(self.wavelength, self.aperture_time)
        self.spacing = self.resolution / _OVERSAMPLING

    def paths(self, errors: _Errors, slow_time: Floats, rng: np.random.Generator | None = None) -> tuple[Path, Path]:
        """Fly both platforms."""
        return (
            path(self.geometry.transmitter, slow_time, errors.transmitter, rng),
            path(self.geometry.receiver, slow_time, errors.receiver, rng),
        )

    def effect(self, errors: _Errors) -> ExactEffect:
        """Displacement and phases by exact ranges."""
        slow_time = cell_centres(self.aperture_time, 256)
        clock = errors.clock_quadratic * slow_time**2
        return exact_effect(slow_time, *self.paths(errors, slow_time), clock, self.wavelength, self.aperture_time)

    def cut(
        self,
        centre: GroundVector,
        errors: _Errors,
        *,
        scatterer: GroundVector = (0.0, 0.0),
        cells: int = _CELLS,
        rng: np.random.Generator | None = None,
    ) -> Complexes:
        """Image along y′ through a ground point, `cells` resolution cells long.

        A response repeats after as many cells as there are pulses: four times the cut keeps the repeats out.
        """
        slow_time = cell_centres(self.aperture_time, _PULSES_PER_CELL * cells)
        transmitter, receiver = self.paths(errors, slow_time, rng)
        history: PhaseHistory = phase_history(
            np.array([[*scatterer, 0.0]]),
            np.ones(1, dtype=complex),
            slow_time=slow_time,
            frequency=self.mission.radar.center_frequency + cell_centres(self.mission.radar.bandwidth, _FREQUENCIES),
            transmitter=transmitter,
            receiver=receiver,
            clock_error=errors.clock_quadratic * slow_time**2,
        )
        count = round(cells * _OVERSAMPLING / 2) * 2
        line = ground_grid(centre, self.geometry.look_azimuth, (1.0, self.spacing * count), (1, count))[0]
        return backprojection(history, self._at_equal_range(line, line[count // 2]))

    def _at_equal_range(self, line: Floats, centre: Floats) -> Floats:
        """Shift points along the look direction until their range sum at the midpoint is the centre's.

        The ridge of a response follows an ellipse on the ground; near a platform a straight cut leaves it.
        """
        look = self.geometry.look_azimuth
        along = np.array([math.cos(look), math.sin(look), 0.0])
        platforms = [np.asarray(p.position) for p in (self.geometry.transmitter, self.geometry.receiver)]
        wanted = sum(float(np.linalg.norm(p - centre)) for p in platforms)
        for _ in range(8):
            sights = [line - p for p in platforms]
            lengths = [np.linalg.norm(s, axis=1) for s in sights]
            slope = sum(s @ along / d for s, d in zip(sights, lengths, strict=True))
            line = line + np.outer((wanted - lengths[0] - lengths[1]) / slope, along)
        return line


def _errors(mission: Mission, geometry: BistaticGeometry, source: ErrorSource, size: float) -> _Errors:
    """Return one error of a given size and nothing else."""
    owner, *rest = source.id.split(".")
    if owner == "timing":
        return _Errors(clock_quadratic=size)
    kind, axis = rest
    state = getattr(geometry, owner)
    frame = getattr(mission.platforms, owner).motion_error.frame if source.is_independent else "scene"
    direction = state.frame(frame)[FRAME_AXES[frame].index(axis)]
    x, y, z = (size * component for component in direction)
    error = {
        "position": MotionError(position=(x, y, z)),
        "velocity": MotionError(velocity=(x, y, z)),
        "acceleration": MotionError(acceleration=(x, y, z)),
    }[kind]
    return _Errors().of(owner, error)


def _quadratic(scope: _Scope, allocation: Allocation, source: ErrorSource) -> Verdict:
    budget = allocation.qpe_limit(source.owner)
    boundary = budget / abs(source.effect.qpe)

    def measured(size: float) -> tuple[ExactEffect, float, Complexes, Complexes]:
        errors = _errors(scope.mission, scope.geometry, source, size)
        effect = scope.effect(errors)
        cut = scope.cut(effect.displacement, errors)
        reference = scope.cut(effect.displacement, _Errors(), scatterer=effect.displacement)
        quadratic, _ = quadratic_phase_error(cut, reference, scope.spacing, 1 / scope.resolution)
        return effect, quadratic, cut, reference

    try:
        effect, quadratic, cut, reference = measured(boundary)
        inside, beyond = (measured(factor * boundary)[1] for factor in (INSIDE, BEYOND))
        clean = impulse_response(reference, scope.spacing)
        response = impulse_response(cut, scope.spacing, mask_m=clean.mask_m)
    except (ValueError, np.linalg.LinAlgError) as error:
        return _verdict(source.id, source.unit, boundary, budget_rad=budget, reason=f"no image: {error}")
    far = max(math.hypot(*effect.displacement), _reach(source, boundary, scope.aperture_time))
    if far > FIRST_ORDER_M:
        return _verdict(
            source.id,
            source.unit,
            boundary,
            budget_rad=budget,
            predicted_qpe_rad=abs(effect.quadratic),
            predicted_cubic_rad=abs(effect.cubic),
            displacement_m=effect.displacement,
            reason=(
                f"the error at the limit moves platform or image by {far:.3g} m: beyond {FIRST_ORDER_M:g} m the "
                "second order of the range error matters, which no limit accounts for"
            ),
        )
    return _verdict(
        source.id,
        source.unit,
        boundary,
        budget_rad=budget,
        predicted_qpe_rad=abs(effect.quadratic),
        measured_qpe_rad=abs(quadratic),
        measured_inside_rad=abs(inside),
        measured_beyond_rad=abs(beyond),
        predicted_cubic_rad=abs(effect.cubic),
        irw_ratio=response.irw_m / clean.irw_m,
        peak_loss_db=20 * math.log10(clean.peak / response.peak),
        pslr_db=response.pslr_db,
        islr_db=response.islr_db,
        displacement_m=effect.displacement,
        verdict=_compare(abs(quadratic) / budget - 1, TOLERANCE),
    )


def _reach(source: ErrorSource, size: float, aperture_time: float) -> float:
    """Largest position error of a platform within the aperture. [m]"""
    return size * {"m": 1.0, "m/s": aperture_time / 2, "m/s^2": aperture_time**2 / 8}.get(source.unit, 0.0)


def _compare(excess: float, tolerance: float) -> str:
    """Say what an excess over the budget means for the limit."""
    if abs(excess) <= tolerance:
        return "confirmed"
    return "optimistic" if excess > 0 else "conservative"


def _verdict(id: str, unit: str, boundary: float, **values: object) -> Verdict:
    empty = dict.fromkeys(Verdict._fields)
    defaults = {"id": id, "model": "published", "boundary_error": boundary, "unit": unit, "verdict": "not_evaluated"}
    return Verdict(**{**empty, **defaults, **values})  # type: ignore[arg-type]


def _vibrations(scope: _Scope, allocation: Allocation, only: str) -> Iterator[Verdict]:
    requirements = scope.mission.requirements
    for name in PLATFORMS:
        vibration = getattr(scope.mission.platforms, name).motion_error.vibration
        if requirements.pslr is not None:
            root = math.sqrt(10 ** (requirements.pslr / 10) * allocation.pslr.of(name))
            limit = evaluators.vibration_limit(scope.wavelength, root)
            frequencies = [line.frequency for line in vibration.sinusoidal]
            for index, frequency in enumerate(frequencies or [_UNDECLARED_CYCLES / scope.aperture_time]):
                row_id = f"{name}.vibration.sinusoidal.{index}"
                if fnmatchcase(row_id, only):
                    yield _sinusoidal(scope, row_id, name, limit, frequency, requirements.pslr)
        if requirements.islr is not None and fnmatchcase(row_id := f"{name}.vibration.wideband", only):
            root = math.sqrt(10 ** (requirements.islr / 10) * allocation.islr.of(name))
            limit = evaluators.vibration_limit(scope.wavelength, root)
            yield _wideband(scope, row_id, name, limit, requirements.islr)


def _sinusoidal(
    scope: _Scope, row_id: str, name: str, limit: float, frequency: float, requirement_db: float
) -> Verdict:
    """Measure the paired echo on the difference from the error-free image, which its sidelobes would bury."""
    cycles = frequency * scope.aperture_time
    if cycles < 3:
        reason = f"{cycles:.3g} cycles per aperture: below three the echoes lie on the mainlobe"
        return _verdict(row_id, "m", limit, requirement_db=requirement_db, reason=reason)
    if cycles > 400:
        reason = f"{cycles:.3g} cycles per aperture: the echoes lie outside the patch that is imaged"
        return _verdict(row_id, "m", limit, requirement_db=requirement_db, reason=reason)
    cells = 2 * math.ceil(cycles) + _CELLS
    sinusoid = Sinusoid(amplitude=limit, frequency=frequency)
    errors = _Errors().of(name, MotionError(sinusoids=(sinusoid,)))
    clean = scope.cut((0.0, 0.0), _Errors(), cells=cells)
    echo = scope.cut((0.0, 0.0), errors, cells=cells) - clean
    # An echo keeps its range while a scatterer at its place would walk by one wavelength per cycle.
    walk = cycles * scope.mission.radar.bandwidth / scope.mission.radar.center_frequency
    smeared = f", smeared over {walk:.2g} range cells" if walk > 0.3 else ""
    peaks = [float(np.abs(upsampled(cut, _FINE)).max()) for cut in (echo, clean)]
    level = 20 * math.log10(peaks[0] / peaks[1])
    return _verdict(
        row_id,
        "m",
        limit,
        requirement_db=requirement_db,
        measured_db=level,
        verdict=_decibel_verdict(level - requirement_db),
        reason=f"echoes of one platform alone, at {cycles:.3g} cells from the peak{smeared}",
    )


def _wideband(scope: _Scope, row_id: str, name: str, limit: float, requirement_db: float) -> Verdict:
    """Measure the power that white vibration spreads, over all of the repeat interval, on a seeded ensemble."""
    rng = np.random.default_rng(scope.mission.simulation.seed if scope.mission.simulation else 1)
    slow_time = cell_centres(scope.aperture_time, 256)
    clean = scope.paths(_Errors(), slow_time)
    error = _Errors().of(name, MotionError(wideband_rms=limit))
    platform = PLATFORMS.index(name)
    ratios = []
    for _ in range(_WIDEBAND_RUNS):
        flown = scope.paths(error, slow_time, rng)[platform]
        shift = np.linalg.norm(flown.measured, axis=1) - np.linalg.norm(clean[platform].measured, axis=1)
        # By Parseval the power beside the coherent response is the variance of the aperture's phasor.
        phasor = np.exp(2j * math.pi / scope.wavelength * shift)
        coherent = abs(phasor.mean()) ** 2
        ratios.append((1 - coherent) / coherent)
    mean, spread = float(np.mean(ratios)), float(np.std(ratios, ddof=1) / math.sqrt(_WIDEBAND_RUNS))
    level = 10 * math.log10(mean)
    return _verdict(
        row_id,
        "m",
        limit,
        requirement_db=requirement_db,
        measured_db=level,
        measured_db_error=10 / math.log(10) * spread / mean,
        verdict=_decibel_verdict(level - requirement_db),
        reason="power added by one platform alone",
    )


def _decibel_verdict(excess_db: float) -> str:
    return _compare(excess_db, VIBRATION_TOLERANCE_DB)
