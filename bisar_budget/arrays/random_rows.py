"""Rows of sensors and clocks in many cases: the arrays beside `budget.random_rows`."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.spread import (
    CUBIC_POWER,
    NOISE,
    SMALLEST_CUBIC_RAD,
    SpreadPhase,
    Tone,
    islr_db,
    mainlobe_energy,
    spread_limit,
    wideband_noise,
)
from bisar_budget.arrays.instruments import ManyRandomErrors
from bisar_budget.budget.judged_rows import BOUND, REQUIREMENTS, Judged, Judging
from bisar_budget.effects.collections import Geometries
from bisar_budget.effects.models import QUADRATIC
from bisar_budget.effects.subject import subject
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import Floats

_HELD = (QUADRATIC, "cubic_phase_error", "islr")  # requirements, in the order of what an error does


class Limits(NamedTuple):
    """What the errors of an owner are held to, each alone; as `Limits` of `budget.random_rows`. [rad]"""

    quadratic: Any
    cubic: Any
    spread: Any


class RandomRows:
    """Rows of the errors of sensors and clocks of many cases.

    Parameters
    ----------
    judging : Judging
        Of the cases.
    mission : Mission
        Some of its numbers are arrays (cases,).
    geometries : Geometries
        Of the mission.
    errors : sequence of ManyRandomErrors
        Of sensors and clocks.
    held : mapping of str to (cases,)
        Quadratic phase that each owner is held to, gain of autofocus included. [rad]
    gain : (cases,)
        Of autofocus.
    allocation : Allocation
        Shares of the budgets.
    tones : sequence of Tone
        What makes echoes.
    """

    def __init__(
        self,
        judging: Judging,
        mission: Mission,
        geometries: Geometries,
        errors: Sequence[ManyRandomErrors],
        held: Mapping[str, Floats],
        gain: Floats,
        allocation: Allocation,
        tones: Sequence[Tone],
    ) -> None:
        self.judging, self.mission, self.geometries, self.errors = judging, mission, geometries, errors
        self.held, self.gain, self.tones = held, gain, tones
        self.allocation, self.islr = allocation, allocation.islr

    def rows(self, gating: str) -> Iterator[Judged]:
        """Rows of every error of a sensor or a clock, declared or not."""
        other = "full" if gating == "published" else "published"
        for error in self.errors:
            yield self._row(error, gating, other)

    def _sizes(self, error: ManyRandomErrors, model: str) -> Floats:
        """Size at which an error reaches each requirement, (3, cases); infinite where it does not. [unit]"""
        limits = (
            self.held[error.subject.owner],
            self.mission.requirements.cubic_phase_error,
            spread_limit(self.mission, self.allocation, error.subject.owner, model),
        )
        array = self.judging.array
        quadratic, cubic, spread = error.effect(model)
        if self.mission.requirements.cubic_phase_error is None:  # ISLR holds it, at one sigma
            at_one_sigma = np.asarray(cubic) / self.mission.allocation.coverage_factor
            spread = np.sqrt(np.asarray(spread) ** 2 + CUBIC_POWER * at_one_sigma**2)
        per_unit = np.array([array(part) for part in (quadratic, cubic, spread)])
        required = np.array([array(math.inf if limit is None else limit) for limit in limits])
        return np.where(per_unit > 0, required / per_unit, math.inf)

    def _row(self, error: ManyRandomErrors, gating: str, other: str) -> Judged:
        sizes, mine, array = self._sizes(error, gating), error.effect(gating), self.judging.array
        allowable = sizes.min(axis=0)
        is_limited = np.isfinite(allowable)
        binds = np.where(is_limited, sizes.argmin(axis=0), -1)
        allowable = np.where(is_limited, allowable, math.nan)
        binding = np.array([-1, *map(REQUIREMENTS.index, _HELD)], np.int8)[binds + 1]
        if error.declared is None:
            judged = self.judging.row(error.subject, None, allowable)
        else:
            size = array(error.declared)
            qpe = array(mine.quadratic) * size
            limit = self.held[error.subject.owner] / self.gain
            within = np.where(binds == 0, size / allowable * self.gain, qpe / limit)
            judged = self.judging.row(
                error.subject,
                size,
                allowable,
                doubt=size > self._sizes(error, other).min(axis=0) * BOUND,
                without_autofocus=np.where((self.gain > 1) & (qpe > 0) & is_limited, within, 0.0),
                is_info=self.mission.allocation.combine != "each",
            )
            judged = judged._replace(
                qpe_published_rad=array(error.published.quadratic) * size,
                cubic_rad=array(mine.cubic) * size,
                quadratic_use=qpe / (limit * self.gain),
            )
        judged = judged._replace(binding=binding)
        return judged.in_decibel() if error.unit == "dB" else judged

    # ---------------------------------------------------------------- powers together
    def islr_rows(self, gating: str, cubic: Callable[[str], Floats]) -> Iterator[Judged]:
        """Rows of what spreads in sum: for the mission, and for each owner unless only wideband vibration spreads.

        `cubic` gives the cubic phase of an owner at one sigma, which ISLR holds where nothing else does. [rad]
        """
        needs = self.mission.requirements
        if needs.islr is None:
            return
        other = "full" if gating == "published" else "published"
        spreads, array = self.noise(gating), self.judging.array
        if needs.pslr is None:
            spreads += [
                SpreadPhase(
                    one.subject.id, one.subject.owner, array(np.where(one.is_there, one.phase**2 / 2, math.nan))
                )
                for one in self.tones
            ]
        is_vibration_alone = array(1.0) > 0
        for one in spreads:
            if not one.row_id.endswith("vibration.wideband"):
                is_vibration_alone &= np.isnan(one.variance)

        def counted(owner: str) -> Floats:
            """Cubic phase that ISLR holds: none too small to show, and none of an error without an image. [rad]"""
            phase = cubic(owner) if needs.cubic_phase_error is None else array(0.0)
            return np.where((phase > SMALLEST_CUBIC_RAD) & np.isfinite(phase), phase, 0.0)

        is_vibration_alone &= counted("mission") == 0
        for owner in ("transmitter", "receiver", *(["clock"] if self.islr.clock is not None else []), "mission"):
            members = [one.variance for one in spreads if self.islr.includes(one.owner, owner)]
            phase = counted(owner)
            is_declared = np.any([phase > 0, *(~np.isnan(one) for one in members)], axis=0)
            variance = array(sum(np.nan_to_num(one) for one in members)) + CUBIC_POWER * phase**2
            limit, by_other = (
                array(spread_limit(self.mission, self.allocation, owner, model)) for model in (gating, other)
            )
            rms, what = np.sqrt(variance), subject(owner, "islr")
            judged = self.judging.row(what, rms, limit, doubt=rms > by_other * BOUND)
            judged = judged.where(~is_declared, self.judging.row(what, None, limit))
            if owner != "mission":
                judged = judged.where(is_vibration_alone, Judged.of_none(what, self.judging.cases))
            yield self._as_islr(judged, gating)

    def _as_islr(self, row: Judged, model: str) -> Judged:
        """Write rms phases as the ISLR that they add, by a model."""
        energy = mainlobe_energy(self.mission)
        declared, allowable = (
            np.where(column > 0, islr_db(column**2, model, energy), math.nan)
            for column in (row.declared, row.allowable)
        )
        return row._replace(declared=declared, allowable=allowable).held_to("islr")

    def noise(self, model: str) -> list[SpreadPhase]:
        """Parts that spread beyond the cubic; as `noise` of `analysis.spread`."""
        wideband = wideband_noise(self.mission, self.geometries)
        return [
            *(one._replace(variance=self.judging.array(one.variance)) for one in wideband),
            *self._of_errors(model),
        ]

    def _of_errors(self, model: str) -> Iterator[SpreadPhase]:
        for error in self.errors:
            if error.declared is not None and (error.subject.kind != "imu" or error.subject.axis in NOISE):
                spread = self.judging.array(error.effect(model).spread * error.declared)
                yield SpreadPhase(error.subject.id, error.subject.owner, spread**2)
