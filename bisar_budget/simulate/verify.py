"""Form images with each error set exactly at its published limit, and measure whether the limit is true."""

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from fnmatch import fnmatchcase
from functools import cached_property, partial
from multiprocessing import get_context
from typing import Any

import numpy as np

from bisar_budget.budget.allocation import allocate
from bisar_budget.budget.effects import ErrorSource, full_ground, image_plane
from bisar_budget.budget.images import Verdict, VerifiedMission
from bisar_budget.budget.pull_in import ROOM
from bisar_budget.budget.sources import error_sources
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.simulate import vibration
from bisar_budget.simulate.autofocus import ALGORITHMS
from bisar_budget.simulate.collection import CELLS, RANGE_CELLS, Chip, Errors, PointCollection, superposed
from bisar_budget.simulate.exact import ExactEffect
from bisar_budget.simulate.impulse_response import impulse_response, quadratic_phase_error
from bisar_budget.simulate.phase_history import MotionError
from bisar_budget.simulate.shift import measured_shift
from bisar_budget.units import format_limit, format_quantity

TOLERANCE = 0.05  # of the budget: nearer than this a limit is confirmed
INSIDE, BEYOND = 0.9, 1.1  # of the limit: the phase on both sides shows that the limit is the limit
HALF_PIXEL = 0.5  # a displacement nearer than this is the predicted one
READABLE_RAD = math.pi  # of quadratic or cubic phase; beyond, a response has no one peak whose place could be read
HALF_CELL = 0.5  # of range walk; beyond, one-dimensional autofocus leaves a loss (0.34 dB there, uniform)


def verify_mission(
    mission: Mission, only: str = "*", jobs: int = 1, progress: Callable[[str], None] = lambda row_id: None
) -> VerifiedMission:
    """Verify every limit of a mission whose row id matches a glob.

    Parameters
    ----------
    mission : Mission
        As loaded.
    only : str
        Glob of row ids.
    jobs : int
        Processes; the verdicts do not depend on it.
    progress : callable
        Told the id of each row that is done.

    Returns
    -------
    VerifiedMission
        Rows with a limit, in the order of `check`, and both platforms' vibration together.
    """
    mission = mission._replace(places={})  # the parser's marks cannot go to another process, and nobody asks here
    wanted = [row_id for row_id in Study(mission).cases if fnmatchcase(row_id, only)]
    rows: list[Verdict] = []
    if min(jobs, len(wanted)) <= 1:
        study = Study(mission)
        for row_id in wanted:
            rows.append(study.cases[row_id]())
            progress(row_id)
    else:
        # A fresh interpreter for each: a fork would copy the threads of a numerical library half way.
        with ProcessPoolExecutor(min(jobs, len(wanted)), mp_context=get_context("spawn")) as pool:
            for row in pool.map(partial(_verify_row, mission), wanted):
                rows.append(row)
                progress(row.id)
    return VerifiedMission(
        file=mission.file, name=mission.name, rows=tuple(rows), conditions=", ".join(_conditions(mission))
    )


def rows_to_verify(mission: Mission, only: str = "*") -> list[str]:
    """Ids of the rows that `verify_mission` would verify."""
    return [row_id for row_id in Study(mission).cases if fnmatchcase(row_id, only)]


def _conditions(mission: Mission) -> Iterator[str]:
    """Say of what images the verdicts are, and which keys of the file have no part in them."""
    settings = mission.simulation or Simulation()
    yield f"one point, exact ranges, {settings.window} window"
    yield "no noise" if settings.noise is None else "no noise (simulation.noise is for `simulate`)"
    given = mission.collection.pulses
    yield "pulses as needed" + (f" (the {given} of collection.pulses must not alias)" if given else "")


def _verify_row(mission: Mission, row_id: str) -> Verdict:
    return Study(mission).cases[row_id]()


class Study:
    """One mission with what its rows share, and a case for each limit: a call that gives the verdict."""

    def __init__(self, mission: Mission) -> None:
        self.mission, self.geometry = mission, mission.geometry
        self.model = mission.allocation.model
        self.sources = error_sources(mission, self.geometry)
        self.allocation = allocate(mission, self.sources)
        self.plane = image_plane(self.geometry)
        self.ground = full_ground(mission, self.geometry)
        self.collection = PointCollection(mission, self.geometry)

    @cached_property
    def cases(self) -> dict[str, Callable[[], Verdict]]:
        """Row ids in the order of `check`, with the call that verifies each."""
        return dict(self._cases())

    def _cases(self) -> Iterator[tuple[str, Callable[[], Verdict]]]:
        for source in self.sources:
            if source.by(self.model).qpe:
                yield source.id, partial(self._quadratic if source.is_motion else self._other, source)
        yield from vibration.cases(self.mission, self.allocation, self.collection)
        requirements = self.mission.requirements
        if self.mission.allocation.combine != "each":
            yield from self._aggregates()
        if requirements.cubic_phase_error is not None:
            yield "mission.cubic_phase_error", partial(self._cubic, requirements.cubic_phase_error)
        if requirements.location_error is not None:
            yield "mission.location_error", partial(self._location, requirements.location_error)
        if self.allocation.n_pull is not None:
            yield "mission.autofocus_pull_in", partial(self._pull_in, self.allocation.n_pull)
        if self.mission.scene.radius is not None and self.model != "published":
            yield "mission.spatial_variance", self._edge

    def _aggregates(self) -> Iterator[tuple[str, Callable[[], Verdict]]]:
        owners = ["transmitter", "receiver", "mission"]
        if self.allocation.qpe.clock is not None:
            owners.insert(2, "clock")
        for owner in owners:
            row_id = f"{'timing' if owner == 'clock' else owner}.quadratic_phase_error"
            yield row_id, partial(self._sum, row_id, owner)

    # The declared errors that an image can show; `other` errors are phases without a motion.
    @property
    def _declared(self) -> list[ErrorSource]:
        return [s for s in self.sources if s.declared and s.is_independent and s.is_motion]

    def errors(self, source: ErrorSource, size: float) -> Errors:
        """Return one error of a given size and nothing else."""
        owner, *rest = source.id.split(".")
        if owner == "timing":
            order = ("constant", "linear", "quadratic", "cubic").index(rest[0])
            return Errors(clock=tuple(size if index == order else 0.0 for index in range(4)))
        if owner == "mission":  # a scene that is higher: both platforms measured too high
            up = MotionError(position=(0.0, 0.0, size))
            return Errors(transmitter=up, receiver=up)
        kind = rest[0]
        x, y, z = (size * component for component in source.direction)
        error = {
            "position": MotionError(position=(x, y, z)),
            "velocity": MotionError(velocity=(x, y, z)),
            "acceleration": MotionError(acceleration=(x, y, z)),
        }[kind]
        return Errors(transmitter=error, receiver=error) if owner == "common" else Errors().of(owner, error)

    def _edge(self) -> Verdict:
        """Difference between two places of the scene; what images and exact ranges say of it is in the tests."""
        total = self.allocation.qpe_total
        blank = Verdict(
            id="mission.spatial_variance", model=self.model, boundary_error=total, unit="rad", budget_rad=total
        )
        return blank._replace(reason="the difference of two places of the scene: images are formed of its centre")

    def _scaled(self, sizes: Sequence[tuple[ErrorSource, float]], scale: float) -> Errors:
        return superposed(self.errors(source, scale * size) for source, size in sizes)

    def _quadratic(self, source: ErrorSource) -> Verdict:
        budget = self.allocation.qpe_limit(source.owner)
        boundary = budget / abs(source.by(self.model).qpe)
        blank = Verdict(id=source.id, model=self.model, boundary_error=boundary, unit=source.unit, budget_rad=budget)
        verdict = self._judged_phase(blank, [(source, 1.0)], boundary)
        gain = self.allocation.autofocus_gain
        if gain == 1 or verdict.verdict == "not_evaluated":
            return verdict
        refocused = self._refocused(self.errors(source, gain * boundary), budget)
        return verdict._replace(boundary_autofocus=gain * boundary, **refocused)

    def _sum(self, row_id: str, owner: str) -> Verdict:
        """All declared errors of an owner at once, each with the sign that makes their phases add."""
        members = self._members(owner)
        budget = self.allocation.qpe_limit(owner)
        blank = Verdict(id=row_id, model=self.model, boundary_error=budget, unit="rad", budget_rad=budget)
        if self.mission.allocation.combine == "rss":
            return blank._replace(reason="a root-sum-square speaks of many flights, an image shows one")
        total = math.fsum(abs(s.qpe(self.model)) for s in members)
        if not total:
            return blank._replace(reason="no declared error has a quadratic phase")
        return self._judged_phase(blank, self._aligned(members), budget / total)

    def _members(self, owner: str) -> list[ErrorSource]:
        return [s for s in self._declared if owner == "mission" or self.allocation.qpe.includes(s.owner, owner)]

    def _aligned(self, members: Sequence[ErrorSource]) -> list[tuple[ErrorSource, float]]:
        """Declared errors, each with the sign that makes their phases add."""
        return [(s, math.copysign(s.declared or 0.0, s.by(self.model).qpe)) for s in members if s.by(self.model).qpe]

    def images(self, row_id: str, limit: float) -> tuple[Chip, Chip]:
        """Image at a limit of a row of quadratic phase, as its verdict reads it, and of no error at that place."""
        source = next((s for s in self.sources if s.id == row_id), None)
        if source is not None:
            errors = self.errors(source, limit)
        else:
            owner = row_id.partition(".")[0].replace("timing", "clock")
            sizes = self._aligned(self._members(owner))
            errors = self._scaled(sizes, limit / math.fsum(abs(s.by(self.model).qpe * size) for s, size in sizes))
        return self._chips(errors, self.collection.effect(errors))

    def focused(self, chip: Chip) -> Chip:
        """Refocus a chip by the mission's algorithm."""
        return Chip(ALGORITHMS[self.mission.autofocus.algorithm](chip.image).image, chip.grid)

    def _judged_phase(self, blank: Verdict, sizes: Sequence[tuple[ErrorSource, float]], scale: float) -> Verdict:
        """Form the images of errors at the limit and on both sides, and hold the phase to the budget."""
        budget = blank.budget_rad or 0.0
        by_table, by_full = (
            abs(math.fsum(s.by(of).qpe * scale * size for s, size in sizes)) for of in ("published", "full")
        )
        blank = blank._replace(published_qpe_rad=by_table, full_qpe_rad=by_full)
        try:
            errors = self._scaled(sizes, scale)
            effect = self.collection.effect(errors)
            if reason := self._beyond_first_order(errors, effect, budget):
                return blank._replace(**_predicted(effect), reason=reason)
            chip, reference = self._chips(errors, effect)
            quadratic, _ = self._phases(chip, reference)
            if abs(abs(quadratic) - abs(effect.quadratic)) > TOLERANCE * budget:
                reason = (
                    f"the image shows {abs(quadratic):.3g} rad where exact ranges give {abs(effect.quadratic):.3g}: "
                    "this geometry strains the image of a patch, and neither is taken for the truth"
                )
                return blank._replace(**_predicted(effect), reason=reason)
            inside, beyond = (self._measured_phase(self._scaled(sizes, scale * f)) for f in (INSIDE, BEYOND))
            clean = impulse_response(reference.cut, self.collection.spacing[1])
            response = impulse_response(chip.cut, self.collection.spacing[1], mask_m=clean.mask_m)
            shift = measured_shift(chip, reference)
        except (ValueError, np.linalg.LinAlgError) as error:
            return blank._replace(reason=f"no image: {error}")
        return blank._replace(
            **_predicted(effect),
            measured_qpe_rad=abs(quadratic),
            measured_inside_rad=abs(inside),
            measured_beyond_rad=abs(beyond),
            irw_ratio=response.irw_m / clean.irw_m,
            peak_loss_db=20 * math.log10(clean.peak / response.peak),
            pslr_db=response.pslr_db,
            islr_db=response.islr_db,
            displacement_published_m=self._published_displacement(sizes, scale),
            displacement_full_m=self._moves([(source, scale * size) for source, size in sizes]),
            measured_displacement_m=_moved(effect.displacement, shift.displacement),
            smear_azimuth_published_rad=(self.geometry.look_azimuth + math.pi / 2) % math.pi,
            measured_smear_azimuth_rad=shift.smear_azimuth,
            verdict=_compare(abs(quadratic) / budget - 1, TOLERANCE),
        )

    def _chips(self, errors: Errors, effect: ExactEffect) -> tuple[Chip, Chip]:
        """Image of the errors and of no error at the place they move the point to, large enough for the smear."""
        slope = 2 * abs(effect.quadratic) + 3 * abs(effect.cubic)  # at the aperture edge
        smear = 2 * math.ceil(min(slope / math.pi, 1e6))  # cells
        cells = max(CELLS + smear, math.ceil(max(ROOM.values()) * smear))  # with less, autofocus gives out
        form = partial(self.collection.chip, effect.displacement, cells=cells, range_cells=RANGE_CELLS)
        return form(errors), form(Errors(), scatterer=effect.displacement)

    def _phases(self, chip: Chip, reference: Chip) -> tuple[float, float]:
        """Quadratic and cubic phase of a response, measured."""
        history = self.collection.spatial_frequency(reference)
        return quadratic_phase_error(chip.cut, reference.cut, self.collection.spacing[1], *history)

    def _measured_phase(self, errors: Errors) -> float:
        effect = self.collection.effect(errors)
        cut = self.collection.chip(effect.displacement, errors)
        reference = self.collection.chip(effect.displacement, Errors(), scatterer=effect.displacement)
        return self._phases(cut, reference)[0]

    def _beyond_first_order(self, errors: Errors, effect: ExactEffect, budget: float) -> str:
        """Say that the next order of the range error, −Σ|P⊥(r̃_k − x̂)|²/2R_k, matters beside a budget."""
        half = self.collection.aperture_time / 2
        times = np.array([-half, 0.0, half])
        moved = np.array([*effect.displacement, 0.0])
        second = np.zeros(3)
        for one in self.collection.paths(errors, times):
            off, ranges = one.measured - one.actual - moved, np.linalg.norm(one.actual, axis=1)
            along = np.sum(off * one.actual, axis=1) / ranges
            second -= (np.sum(off**2, axis=1) - along**2) / (2 * ranges)
        curve = 2 * math.pi / self.collection.wavelength * ((second[0] + second[2]) / 2 - second[1])
        row = (float(second[1]), float(second[2] - second[0]) / (2 * half), float(curve), 0.0)
        added = self.ground.effective([row])[0]
        if abs(added.qpe) <= TOLERANCE * budget:
            return ""
        return (
            f"the error at the limit is beyond first order, where no limit holds: the second order adds "
            f"{added.qpe:.2g} rad, exact ranges give {abs(effect.quadratic):.3g} rad"
        )

    def _published_displacement(
        self, sizes: Sequence[tuple[ErrorSource, float]], scale: float
    ) -> GroundVector | None:
        moves = [self.plane.displacement(source.effect, scale * size) for source, size in sizes]
        if any(move is None for move in moves):
            return None
        return (math.fsum(m[0] for m in moves if m), math.fsum(m[1] for m in moves if m))

    def _places(self, sizes: Sequence[tuple[ErrorSource, float]]) -> GroundVector | None:
        """Displacement of errors together by the gating model; None where (25) has none."""
        return self._published_displacement(sizes, 1.0) if self.model == "published" else self._moves(sizes)

    def _moves(self, sizes: Sequence[tuple[ErrorSource, float]]) -> GroundVector:
        """Displacement of errors together by the full model."""
        moves = [self.ground.plane.displacement(source.full, size) or (0.0, 0.0) for source, size in sizes]
        return (math.fsum(move[0] for move in moves), math.fsum(move[1] for move in moves))

    def _refocused(self, errors: Errors, budget: float) -> dict[str, Any]:
        """Form the image at the limit with autofocus and refocus it; hold what is left to the plain budget."""
        try:
            effect = self.collection.effect(errors)
            if reason := self._beyond_first_order(errors, effect, self.allocation.autofocus_gain * budget):
                return {"verdict_autofocus": "not_evaluated", "reason_autofocus": reason}
            chip, reference = self._chips(errors, effect)
            focused = self.focused(chip)
            residual = abs(self._phases(focused, reference)[0])
            peaks = [impulse_response(one.cut, self.collection.spacing[1]).peak for one in (reference, focused)]
            loss = 20 * math.log10(peaks[0] / peaks[1])
        except (ValueError, np.linalg.LinAlgError) as error:
            return {"verdict_autofocus": "not_evaluated", "reason_autofocus": f"no image: {error}"}
        is_met = residual <= budget * (1 + TOLERANCE)
        return {
            "measured_residual_qpe_rad": residual,
            "refocused_loss_db": loss,
            "verdict_autofocus": "confirmed" if is_met else "optimistic",
            "reason_autofocus": None
            if is_met
            else f"autofocus leaves {residual:.3g} rad, {format_limit(budget, 'rad')} allowed",
        }

    def _pull_in(self, n_pull: float) -> Verdict:
        """A clock error of π·N_pull, which bends no geometry, refocused; range walk bounds what can work."""
        phase = math.pi * n_pull
        total = self.allocation.qpe_total
        walk = n_pull * self.mission.radar.bandwidth / self.mission.radar.center_frequency / 2  # λN/2 over c/B
        blank = Verdict(
            id="mission.autofocus_pull_in", model=self.model, boundary_error=phase, unit="rad", budget_rad=total
        )
        clock = next(s for s in self.sources if s.id == "timing.quadratic")
        refocused = self._refocused(self.errors(clock, phase / abs(clock.effect.qpe)), total)
        verdict = str(refocused["verdict_autofocus"])
        bound = self.mission.radar.center_frequency / self.mission.radar.bandwidth
        reason = f"range walk of {walk:.2g} cells; it stays within half a cell up to n_pull {bound:.3g}, f0/B"
        if verdict == "confirmed" and walk > HALF_CELL:
            verdict = "optimistic"
        return blank._replace(
            boundary_autofocus=phase,
            **{**refocused, "verdict_autofocus": verdict},
            verdict=verdict,
            reason=reason,
        )

    def _cubic(self, requirement: float) -> Verdict:
        """All declared errors scaled together until the gating model's cubic phase reaches the requirement."""
        blank = Verdict(
            id="mission.cubic_phase_error", model=self.model, boundary_error=requirement, unit="rad",
            budget_rad=requirement,
        )  # fmt: skip
        sizes = [(s, s.declared or 0.0) for s in self._declared]
        if not sizes:
            return blank._replace(reason="no error with a motion is declared")
        total = abs(math.fsum(s.cubic(self.model) for s, _ in sizes))
        if not total:
            return blank._replace(reason=f"no declared error has a cubic phase by the {self.model} model")
        try:
            errors = self._scaled(sizes, requirement / total)
            effect = self.collection.effect(errors)
            if reason := self._beyond_first_order(errors, effect, requirement):
                return blank._replace(**_predicted(effect), reason=f"declared errors scaled together: {reason}")
            cubic = abs(self._phases(*self._chips(errors, effect))[1])
        except (ValueError, np.linalg.LinAlgError) as error:
            return blank._replace(reason=f"no image: {error}")
        return blank._replace(
            **_predicted(effect),
            measured_cubic_rad=cubic,
            verdict=_compare(cubic / requirement - 1, TOLERANCE),
        )

    def _location(self, requirement: float) -> Verdict:
        """All declared errors scaled together until they move the image by the requirement.

        Confirmed if the image, and each error alone by exact ranges, is within half a pixel of where the gating
        model puts it. A displacement that only is shorter is conservative; one that goes elsewhere is not.
        """
        blank = Verdict(id="mission.location_error", model=self.model, boundary_error=requirement, unit="m")
        sizes = [(s, s.declared or 0.0) for s in self._declared]
        if not sizes:
            return blank._replace(reason="no error that moves the image is declared")
        rule = "(25)" if self.model == "published" else "the full model"
        declared = self._places(sizes)
        if declared is None:
            return blank._replace(reason=self.plane.degeneracy)
        if not math.hypot(*declared):
            return blank._replace(reason=f"the declared errors move nothing by {rule}")
        scale = requirement / math.hypot(*declared)
        predicted = (declared[0] * scale, declared[1] * scale)
        try:
            errors = self._scaled(sizes, scale)
            effect = self.collection.effect(errors)
            if max(abs(effect.quadratic), abs(effect.cubic)) > READABLE_RAD:
                reason = (
                    f"scaled to {requirement:g} m the declared errors also defocus, by "
                    f"{abs(effect.quadratic):.3g} rad: no peak whose place could be read"
                )
                return blank._replace(**_predicted(effect), reason=reason)
            shift = measured_shift(*self._chips(errors, effect))
        except (ValueError, np.linalg.LinAlgError) as error:
            return blank._replace(reason=f"no image: {error}")
        measured = _moved(effect.displacement, shift.displacement)
        # Together, errors may hide each other: the sign each is declared with is not the sign it will fly with.
        seen = [("all of them together", predicted, measured)]
        for source, size in sizes:
            alone = self._places([(source, scale * size)])
            if alone is not None:
                exact = self.collection.effect(self.errors(source, scale * size)).displacement
                seen.append((f"{source.id} alone", alone, exact))
        farthest, verdict = max(seen, key=lambda one: max(self._pixels_apart(*one[1:]))), "confirmed"
        for _, said, is_at in seen:
            if max(self._pixels_apart(said, is_at)) > HALF_PIXEL:
                verdict = (
                    "conservative" if verdict != "optimistic" and self._is_shorter(said, is_at) else "optimistic"
                )
        who, said, is_at = farthest
        along, across = self._pixels_apart(predicted, measured)
        reason = f"{rule} and the image differ by {along:.2g} and {across:.2g} pixels along x' and y'"
        if verdict != "confirmed":
            reason += (
                f"; {who}: {_placed(said)} by {rule}, {_placed(is_at)} by exact ranges and image: "
                f"{rule} does not say where the image goes"
            )
        return blank._replace(
            **_predicted(effect),
            displacement_published_m=self._published_displacement(sizes, scale),
            displacement_full_m=self._moves([(source, scale * size) for source, size in sizes]),
            measured_displacement_m=measured,
            verdict=verdict,
            reason=reason,
        )

    def _pixels_apart(self, a: GroundVector, b: GroundVector) -> GroundVector:
        """Distance of two displacements along x′ and y′. [pixels]"""
        x, y = _along(self.geometry.look_azimuth, (b[0] - a[0], b[1] - a[1]))
        return (abs(x) / self.collection.spacing[0], abs(y) / self.collection.spacing[1])

    def _is_shorter(self, said: GroundVector, is_at: GroundVector) -> bool:
        """Whether a displacement is the one said but shorter: then no sum of several, over all signs, is longer."""
        length = math.hypot(*said)
        if not length:
            return False
        part = (is_at[0] * said[0] + is_at[1] * said[1]) / length**2
        on_line = (part * said[0], part * said[1])
        return -1 <= part <= 1 and max(self._pixels_apart(on_line, is_at)) <= HALF_PIXEL

    def _other(self, source: ErrorSource) -> Verdict:
        budget = self.allocation.qpe_limit(source.owner)
        return Verdict(
            id=source.id,
            model=self.model,
            boundary_error=budget,
            unit=source.unit,
            budget_rad=budget,
            reason="stated as a phase: there is no motion to form an image of",
        )


def _predicted(effect: ExactEffect) -> dict[str, Any]:
    return {
        "predicted_qpe_rad": abs(effect.quadratic),
        "predicted_cubic_rad": abs(effect.cubic),
        "displacement_m": effect.displacement,
    }


def _placed(place: GroundVector) -> str:
    east, north = (format_quantity(part + 0.0, "m", 4) for part in place)
    return f"{east} east, {north} north"


def _along(azimuth: float, vector: GroundVector) -> GroundVector:
    """Components along and across an azimuth."""
    cosine, sine = math.cos(azimuth), math.sin(azimuth)
    return (vector[0] * cosine + vector[1] * sine, vector[1] * cosine - vector[0] * sine)


def _moved(place: GroundVector, by: GroundVector) -> GroundVector:
    return (place[0] + by[0], place[1] + by[1])


def _compare(excess: float, tolerance: float) -> str:
    """Say what an excess over the budget means for the limit."""
    if abs(excess) <= tolerance:
        return "confirmed"
    return "optimistic" if excess > 0 else "conservative"
