"""The row of the scene's edge: how far phases there may differ from those at the centre."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.scene import SceneEdge, SceneEdges
from bisar_budget.budget.judged_rows import BOUND, CODE, Judged, Judging
from bisar_budget.budget.judgement import worded
from bisar_budget.effects.subject import subject
from bisar_budget.findings.row import Row
from bisar_budget.phrases import NOTHING, Note


@dataclass(frozen=True, eq=False)
class JudgedScene:
    """The edges of scenes in many cases: differences that they add, none without a declared error."""

    analysis: Analysis
    edges: SceneEdges | None

    @cached_property
    def edge(self) -> SceneEdge | None:
        """The edge of the only case, with how far one autofocus correction serves."""
        analysis, edges = self.analysis, self.edges
        return None if edges is None else SceneEdge.of(edges, analysis.geometry, analysis.allocation.qpe_total)

    def row(self, judging: Judging, model: str) -> "SceneRow":
        """Judge the edges by a model; to the published one an error is the same all over the scene."""
        what, edges = subject("mission", "spatial_variance"), self.edges
        total = judging.array(self.analysis.allocation.qpe_total)
        allowable = None if model == "published" else total
        nothing = judging.row(what, None, allowable)._replace(allowable_full=total)
        if edges is None:
            return SceneRow(nothing, self)
        doubt = edges.has_doubt
        if model == "published":
            doubt = doubt | (edges.difference > total * BOUND)
        judged = judging.row(what, edges.difference, allowable, doubt=doubt)._replace(
            qpe_published_rad=np.zeros(judging.cases), qpe_full_rad=edges.difference, allowable_full=total
        )
        nothing.status[:] = CODE["not_evaluated"]
        return SceneRow(judged.where(np.isinf(edges.difference), nothing), self)


@dataclass(frozen=True, slots=True, eq=False)
class SceneRow:
    """The row of the scene's edge in many cases."""

    judged: Judged
    scene: JudgedScene
    is_there: bool = True

    def in_words(self, analysis: Analysis, model: str) -> Row:
        """The row of the only case, by the model that judges it."""
        edge, total = self.scene.edge, analysis.allocation.qpe_total
        doubt, degeneracy, notes = NOTHING, NOTHING, tuple[Note, ...]()
        if edge is not None:
            doubt, degeneracy = edge.doubt, edge.degeneracy
            notes = () if degeneracy else edge.notes(total)
            if model == "published" and edge.difference > total * BOUND:
                doubt = phrases.other_model_fails("full", edge.difference, total, "rad")
        return worded(
            analysis.mission,
            self.judged,
            unit="rad",
            path=("scene", "radius"),
            equation="full model",
            over=phrases.edge_over(),
            doubt=doubt,
            no_limit=phrases.same_all_over_the_scene(),
            not_evaluated=degeneracy,
            remarks=notes,
        )
