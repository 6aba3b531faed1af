"""The row of the scene's edge: how far phases there may differ from those at the centre.

It is judged in arrays over cases, of a sweep or of a check, which is one case; a check then puts it into words.
"""

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.scene import SceneEdge, SceneEdges, scene_edges
from bisar_budget.budget.judged_rows import BOUND, CODE, Floats, Judged, Judging
from bisar_budget.budget.judgement import number, worded
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import subject
from bisar_budget.findings.row import Row
from bisar_budget.phrases import NOTHING, Note


def judged_edge(judging: Judging, edges: SceneEdges | None, total: Floats, model: str) -> Judged:
    """Judge the scene's edges by a model; to the published one an error is the same all over the scene."""
    what, allowable = subject("mission", "spatial_variance"), None if model == "published" else total
    nothing = judging.row(what, None, allowable)
    if edges is None:
        return nothing
    doubt = edges.has_doubt
    if model == "published":
        doubt = doubt | (edges.difference > total * BOUND)
    judged = judging.row(what, edges.difference, allowable, doubt=doubt)
    nothing.status[:] = CODE["not_evaluated"]
    return judged._replace(qpe_published_rad=np.zeros(judging.cases)).where(np.isinf(edges.difference), nothing)


class CheckedScene:
    """The scene's edge of one mission with `scene.radius`; `edge` is None without a declared error."""

    def __init__(self, analysis: Analysis) -> None:
        self.mission, allocation, errors = analysis.mission, analysis.allocation, analysis.errors
        owners, gain, self.total = (*PLATFORMS, "clock", "mission"), allocation.autofocus_gain, allocation.qpe_total
        limits = {owner: errors.array(allocation.qpe_limit(owner) * gain) for owner in owners}
        self.edges = scene_edges(errors, limits, allocation.qpe)
        self.edge: SceneEdge | None = None
        if self.edges is not None:
            self.edge = SceneEdge.of(self.edges, analysis.geometry, self.total, is_searched=not analysis.is_bare)

    def row(self, model: str) -> Row:
        """Row of the edge by one of the two models, in words."""
        mission, edge, total = self.mission, self.edge, self.total
        judging = Judging(1, mission.allocation.warn_above)
        with np.errstate(all="ignore"):
            judged = judged_edge(judging, self.edges, judging.array(total), model)
        difference, doubt, degeneracy = number(judged.declared), NOTHING, NOTHING
        notes = tuple[Note, ...]()
        if edge is not None:
            doubt, degeneracy = edge.doubt, edge.degeneracy
            notes = () if degeneracy else edge.notes(total)
            if model == "published" and edge.difference > total * BOUND:
                doubt = phrases.other_model_fails("full", edge.difference, total, "rad")
        return worded(
            mission,
            judged,
            unit="rad",
            path=("scene", "radius"),
            equation="full model",
            over=phrases.edge_over(),
            doubt=doubt,
            no_limit=phrases.same_all_over_the_scene(),
            not_evaluated=degeneracy,
            limits=(None, total),
            qpe_published_rad=number(judged.qpe_published_rad),
            qpe_full_rad=difference,
            remarks=notes,
        )
