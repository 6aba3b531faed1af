"""The content of the JSON document `bisar-budget/check/1`.

Later versions may add keys, but never change or remove them.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from bisar_budget.faults import Fault
from bisar_budget.findings.guard import Guard
from bisar_budget.findings.images import Verdict
from bisar_budget.findings.mission import FileWarning, MissionFindings, UnusableMission
from bisar_budget.findings.monte_carlo import MonteCarlo
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import worst
from bisar_budget.findings.trade import TradeStudy
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Shares
from bisar_budget.paths.accuracy import StatedAccuracy
from bisar_budget.report import Piece, Style
from bisar_budget.report.renderers.json import indented

if TYPE_CHECKING:
    from bisar_budget.report.words.heading import AboutMission

CHECK_FORMAT = "bisar-budget/check/1"


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write the JSON item of one mission, with each row on its own line.

    A non-finite number raises an error.
    """
    item = _unusable(mission) if isinstance(mission, UnusableMission) else _mission(mission)
    return indented(item, _INDENTED_LEVELS, _MARGIN)


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write one JSON document with the items of all missions."""
    document = {"format": CHECK_FORMAT, "version": version, "status": worst(piece.status for piece in pieces)}
    head = indented(document, 1).removesuffix("\n}")
    missions = f",\n{_MARGIN}".join(piece.text for piece in pieces)
    return f'{head},\n  "missions": [\n{_MARGIN}{missions}\n  ]\n}}\n'


# Keys of a row's values in the contract, in the order of the fields of `Row` before `waivers`.
_RENAMED = {"subject": "id", "remarks": "notes", "requirement_ids": "requirement_id"}
_ROW_KEYS = tuple(_RENAMED.get(name, name) for name in Row._fields[: Row._fields.index("waivers")])
_INDENTED_LEVELS, _MARGIN = 2, "    "  # of a mission and of its rows; the content of a row stays on its line


def outside_item(mission: "AboutMission") -> dict[str, object]:
    """JSON item about changes and overrides from outside the mission file. All JSON documents use it."""
    return {
        "set": [change._asdict() for change in mission.changes],
        "overrides": [override._asdict() for override in mission.overrides],
    }


def fault_item(fault: Fault) -> dict[str, object]:
    """JSON item about a fault in a file."""
    return {
        "line": fault.line,
        "column": fault.column,
        "key": fault.key,
        "message": fault.problem,
        "given": fault.given or None,
        "accepted": fault.accepted or None,
        "hint": fault.hint or None,
        "option": fault.option or None,
    }


def _unusable(mission: UnusableMission) -> dict[str, object]:
    return {
        "file": mission.file,
        "name": None,
        "status": mission.status,
        "errors": [fault_item(fault) for fault in mission.faults],
    }


def _mission(mission: MissionFindings) -> dict[str, object]:
    allocation = mission.allocation
    return {
        "file": mission.file,
        "name": mission.name,
        "document": {key: getattr(mission.document, key) for key in ("number", "issue", "author")},
        "status": mission.status,
        "waived_by": [waiver.id for waiver in mission.waived_by],
        "set": [change._asdict() for change in mission.changes],
        "model": mission.model,
        "model_doubt": mission.model_doubt or None,
        "model_doubt_code": mission.model_doubt.code or None,
        "confidence": None if mission.is_empty else mission.confidence,
        "combine": mission.combine,
        "coverage_factor": mission.coverage_factor,
        "geometry": {
            "wavelength_m": mission.wavelength,
            "bistatic_angle_rad": mission.geometry.bistatic_angle,
            "look_azimuth_rad": mission.geometry.look_azimuth,
            "gradient_angle_rad": mission.geometry.gradient_angle,
            "range_resolution_m": mission.resolution.range,
            "cross_range_resolution_m": mission.resolution.cross_range,
            "transmitter": _platform(mission, "transmitter"),
            "receiver": _platform(mission, "receiver"),
        },
        "resolution": {
            "range_m": mission.resolution.range,
            "cross_range_m": mission.resolution.cross_range,
            "range_half_power_m": mission.resolution.range_half_power,
            "cross_range_half_power_m": mission.resolution.cross_range_half_power,
        },
        "peak_loss_db": mission.peak_loss_db,
        "budget": {
            "qpe_rad": {
                "total": allocation.qpe_total,
                "transmitter": allocation.qpe_limit("transmitter"),
                "receiver": allocation.qpe_limit("receiver"),
                "clock": allocation.qpe_limit("clock"),
                "reserve": allocation.qpe.reserve * allocation.qpe_total,
            },
            "autofocus_gain": allocation.autofocus_gain,
            "n_pull": allocation.n_pull,
            "pslr_share": _shares(allocation.pslr),
            "islr_share": _shares(allocation.islr),
        },
        "scene": None
        if mission.scene is None
        else {
            "radius_m": mission.scene.radius,
            "autofocus_radius_m": mission.scene.autofocus_radius,
            "searched_radius_m": mission.scene.searched,
        },
        "requirements": [_requirement(requirement) for requirement in mission.requirements],
        "declared_kinds": mission.kinds.declared,
        "not_declared": mission.kinds.missing,
        "without_source": mission.kinds.without_source,
        "shifted": [asdict(shifted) for shifted in mission.kinds.shifted],
        "overrides": [override._asdict() for override in mission.overrides],
        "summary": mission.summary,
        "rows": [_row(row) for row in mission.rows],
        "warnings": [_warning(warning) for warning in mission.warnings],
        "notes": mission.notes,
        "note_codes": [note.code for note in mission.notes],
        "errors": [],
        "monte_carlo": None if mission.monte_carlo is None else monte_carlo_item(mission.monte_carlo),
        "verification": None if mission.verdicts is None else [verdict_item(verdict) for verdict in mission.verdicts],
        **({} if mission.study is None else {"sweep": _study(mission.study)}),
        **({} if mission.guard is None else {"guard": _guard(mission.guard)}),
        **({"requirement_texts": dict(mission.requirement_texts)} if mission.requirement_texts else {}),
    }


def _study(study: TradeStudy) -> dict[str, object]:
    return {
        "vary": list(study.asked),
        "cases": study.cases,
        "comply": study.complying,
        "waived": study.waived,
        "waived_by": list(study.waived_by),
        "not_evaluated": study.unevaluated,
        "without_mission": study.missing,
    }


def _guard(guard: Guard) -> dict[str, object]:
    return {
        "requirements": [asdict(requirement) for requirement in guard.requirements],
        "figures": [figure._asdict() for figure in guard.figures],
    }


def _warning(warning: FileWarning) -> dict[str, object]:
    return {"line": warning.line, "message": warning.message, "code": warning.message.code}


def verdict_item(verdict: Verdict) -> dict[str, object]:
    """JSON item about a verdict on a limit, with the codes of the reasons for the verdict.

    The verdict is based on simulated images that contain an error exactly at this limit.
    """
    reasons = {"reason_code": verdict.reason, "reason_autofocus_code": verdict.reason_autofocus}
    return verdict._asdict() | {name: None if reason is None else reason.code for name, reason in reasons.items()}


def _requirement(requirement: JudgedRequirement) -> dict[str, object]:
    item: dict[str, object] = requirement._asdict()
    item["requirement_id"] = requirement.requirement_id
    item["waivers"] = [waiver.words for waiver in requirement.waivers]
    item["share"] = None if requirement.share is None else asdict(requirement.share)
    item["waived_by"] = [waiver.id for waiver in requirement.waived_by]
    return item | {"reason_code": None if requirement.reason is None else requirement.reason.code}


def _row(row: Row) -> dict[str, object]:
    item: dict[str, object] = dict(zip(_ROW_KEYS, row, strict=False))
    notes = row.notes
    item |= {
        "id": row.id,
        "notes": notes,
        "requirement_id": row.requirement_id,
        "waived_by": [waiver.id for waiver in row.waived_by],
        "reason_code": None if row.reason is None else row.reason.code,
        "note_codes": [note.code for note in notes],
        "requirement_ids": row.requirement_ids,
        "bias": row.bias,
    }
    return item if row.navigation is None else item | {"navigation": row.navigation._asdict()}


def monte_carlo_item(drawn: MonteCarlo) -> dict[str, object]:
    """JSON item about the Monte Carlo result, with the probability that each requirement is met."""
    return {**drawn._asdict(), "requirements": [requirement._asdict() for requirement in drawn.requirements]}


def _platform(mission: MissionFindings, name: str) -> dict[str, object]:
    state: PlatformState = getattr(mission.geometry, name)
    item: dict[str, object] = {
        "slant_range_m": state.slant_range,
        "azimuth_rad": state.azimuth,
        "elevation_rad": state.elevation,
        "squint_rad": state.squint,
    }
    path = dict(mission.paths).get(name)
    if path is not None:
        item["path"] = {
            "source": path.source,
            "file": path.file,
            "sha256": path.sha256,
            "age_s": path.age,
            "order": path.order,
            "pieces": path.pieces,
            "residual_max_m": path.farthest,
            "residual_rms_m": path.rms,
            "samples": path.samples,
            "stretch_s": path.stretch,
            "doubt_m": path.largest_doubt_m,
            "stated": [_stated_accuracy(stated) for stated in path.stated],
            **{
                key: None if file is None else dict(zip(("file", "sha256"), file, strict=True))
                for key, file in path.beside.items()
            },
        }
    return item


def _stated_accuracy(stated: StatedAccuracy) -> dict[str, object]:
    """JSON item about the accuracy stated by the source of a path, as standard deviations.

    The standard deviations are given for each axis of the scene, or as a single total without a direction.
    """
    variances = [row[index] for index, row in enumerate(stated.covariance or ())]
    sigmas = [math.sqrt(max(variance, 0.0)) for variance in variances]
    return {
        "source": stated.words,
        "position_m": sigmas[:3] or None,
        "velocity_mps": sigmas[3:] or None,
        "total_m": stated.total or None,
        "is_typical": stated.is_typical,
    }


def _shares(split: Shares) -> dict[str, float]:
    return {"transmitter": split.transmitter, "receiver": split.receiver}
