"""Motion-measurement error budgets for bistatic SAR, after Rigling & Moses.

    import bisar_budget as bb

    result = bb.check(bb.load("mission.yaml"))

Numbers are in SI units and radians. Each name of the package is imported when it is first used, so `import
bisar_budget` alone imports nothing else.
"""

from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from bisar_budget.error_kinds.registry import MotionKind as MotionKind
    from bisar_budget.error_kinds.registry import register as register
    from bisar_budget.faults import MissionError as MissionError
    from bisar_budget.front.checks import check as check
    from bisar_budget.front.imaging import simulate as simulate
    from bisar_budget.front.imaging import verify as verify
    from bisar_budget.front.missions import geomspace as geomspace
    from bisar_budget.front.missions import linspace as linspace
    from bisar_budget.front.missions import load as load
    from bisar_budget.front.missions import loads as loads
    from bisar_budget.front.questions import allocate as allocate
    from bisar_budget.front.questions import monte_carlo as monte_carlo
    from bisar_budget.front.questions import passes as passes
    from bisar_budget.front.questions import sensitivity as sensitivity
    from bisar_budget.front.questions import solve as solve
    from bisar_budget.front.questions import sweep as sweep
    from bisar_budget.front.results import AllocateResult as AllocateResult
    from bisar_budget.front.results import CheckResult as CheckResult
    from bisar_budget.front.results import MonteCarloResult as MonteCarloResult
    from bisar_budget.front.results import PassesResult as PassesResult
    from bisar_budget.front.results import Picture as Picture
    from bisar_budget.front.results import SensitivityResult as SensitivityResult
    from bisar_budget.front.results import SimulateResult as SimulateResult
    from bisar_budget.front.results import SolveResult as SolveResult
    from bisar_budget.front.results import VerifyResult as VerifyResult
    from bisar_budget.front.sweeps import SweepResult as SweepResult
    from bisar_budget.mission.model import Mission as Mission
    from bisar_budget.mission.quantities import QuestionError as QuestionError

# Public names, by the module that defines them.
_LIVES = {
    "error_kinds.registry": ("MotionKind", "register"),
    "faults": ("MissionError",),
    "mission.model": ("Mission",),
    "mission.quantities": ("QuestionError",),
    "front.missions": ("geomspace", "linspace", "load", "loads"),
    "front.checks": ("check",),
    "front.results": (
        *("AllocateResult", "CheckResult", "MonteCarloResult", "PassesResult", "Picture"),
        *("SensitivityResult", "SimulateResult", "SolveResult", "VerifyResult"),
    ),
    "front.sweeps": ("SweepResult",),
    "front.imaging": ("simulate", "verify"),
    "front.questions": ("allocate", "monte_carlo", "passes", "sensitivity", "solve", "sweep"),
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
