"""Motion-measurement error budgets for bistatic SAR, after Rigling & Moses.

    import bisar_budget as bb

    result = bb.check(bb.load("mission.yaml"))

Numbers are in SI units and radians. The names of the package are imported when they are first used, so `import
bisar_budget` alone imports nothing else.
"""

from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from bisar_budget.error_kinds.registry import MotionKind as MotionKind
    from bisar_budget.error_kinds.registry import register as register
    from bisar_budget.faults import MissionError as MissionError
    from bisar_budget.mission.model import Mission as Mission
    from bisar_budget.mission.quantities import QuestionError as QuestionError
    from bisar_budget.questions.allocate import allocate as allocate
    from bisar_budget.questions.checks import check as check
    from bisar_budget.questions.drawn_errors import monte_carlo as monte_carlo
    from bisar_budget.questions.missions import geomspace as geomspace
    from bisar_budget.questions.missions import linspace as linspace
    from bisar_budget.questions.missions import load as load
    from bisar_budget.questions.missions import loads as loads
    from bisar_budget.questions.passes import passes as passes
    from bisar_budget.questions.results import AllocateResult as AllocateResult
    from bisar_budget.questions.results import CheckResult as CheckResult
    from bisar_budget.questions.results import MonteCarloResult as MonteCarloResult
    from bisar_budget.questions.results import PassesResult as PassesResult
    from bisar_budget.questions.results import Picture as Picture
    from bisar_budget.questions.results import SensitivityResult as SensitivityResult
    from bisar_budget.questions.results import SimulateResult as SimulateResult
    from bisar_budget.questions.results import SolveResult as SolveResult
    from bisar_budget.questions.results import VerifyResult as VerifyResult
    from bisar_budget.questions.sensitivity import sensitivity as sensitivity
    from bisar_budget.questions.simulate import simulate as simulate
    from bisar_budget.questions.solve import solve as solve
    from bisar_budget.questions.sweep import SweepResult as SweepResult
    from bisar_budget.questions.sweep import sweep as sweep
    from bisar_budget.questions.verify import verify as verify

# Public names, by the module that defines them.
_LIVES = {
    "error_kinds.registry": ("MotionKind", "register"),
    "faults": ("MissionError",),
    "mission.model": ("Mission",),
    "mission.quantities": ("QuestionError",),
    "questions.missions": ("geomspace", "linspace", "load", "loads"),
    "questions.checks": ("check",),
    "questions.sweep": ("SweepResult", "sweep"),
    "questions.solve": ("solve",),
    "questions.sensitivity": ("sensitivity",),
    "questions.allocate": ("allocate",),
    "questions.passes": ("passes",),
    "questions.drawn_errors": ("monte_carlo",),
    "questions.verify": ("verify",),
    "questions.simulate": ("simulate",),
    "questions.results": (
        *("AllocateResult", "CheckResult", "MonteCarloResult", "PassesResult", "Picture"),
        *("SensitivityResult", "SimulateResult", "SolveResult", "VerifyResult"),
    ),
}
_FROM = {name: module for module, names in _LIVES.items() for name in names}
__all__ = ["__version__", *sorted(_FROM)]


def __getattr__(name: str) -> object:
    """Import a name of `__all__` from the module that defines it."""
    if name not in _FROM:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_FROM[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
