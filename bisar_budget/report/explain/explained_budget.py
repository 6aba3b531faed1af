"""From the total of the quadratic phase error to what one owner may use of it."""

import math
from collections.abc import Iterator, Sequence

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.constants import ROUNDING
from bisar_budget.faults import printable
from bisar_budget.report.explain import formulas
from bisar_budget.report.explain.formulas import Step, Sum, equation, number, step

RULES = {"each": "the largest", "sum": "the sum", "rss": "the root-sum-square"}


def limit_steps(allocation: Allocation, owner: str, limit: float) -> Iterator[Step]:
    """Budget times share times gain."""
    total, share, gain = allocation.qpe_total, allocation.qpe.of(owner), allocation.autofocus_gain
    whose = {
        "clock": "the receiver’s share" if allocation.qpe.clock is None else "the clock’s share",
        "mission": "all of it: it belongs to no platform",
    }
    yield from autofocus_gain(allocation)
    values = {"total": total, "share": share, "gain": gain}
    title = f"Budget requirements.quadratic_phase_error, {whose.get(owner, f'the {owner}’s share')}"
    yield from step(title, *equation("limit", "total*share*gain", values, limit, "rad"))


def autofocus_gain(allocation: Allocation) -> Iterator[Step]:
    """The steps to the gain, the factor by which autofocus multiplies limits."""
    if allocation.n_pull is None:
        yield from step("No autofocus (autofocus.n_pull): gain = 1")
        return
    if allocation.n_pull_stated != allocation.n_pull:
        title = f"autofocus.n_pull of {allocation.n_pull_stated:g} counts up to half a range cell of range walk, f0/B"
        yield from step(title, f"N_pull = {allocation.n_pull:.6g}")
    values = {"N_pull": allocation.n_pull, "q": allocation.qpe_total}
    raw = math.pi * allocation.n_pull / allocation.qpe_total
    lines = equation("gain", formulas.AUTOFOCUS_GAIN, values, raw, "")
    yield from step("Autofocus, Section VI" + (", never below 1" if raw < 1 else ""), *lines)


def combined(
    title: str,
    rule: str,
    parts: Sequence[tuple[str, float]],
    total: float | None,
    *,
    symbol: str = "combined",
    unit: str = "rad",
) -> Iterator[Step]:
    """The total of errors by a rule: names and sizes, and the sum written out; `total` None: it has no value."""
    title = f"{title}, {RULES[rule]}"
    # What is left of terms that cancel exactly is rounding.
    largest = max((abs(size) for _, size in parts), default=0.0)
    members = [(name, abs(size) if abs(size) > ROUNDING * largest else 0.0) for name, size in parts]
    width = max((len(name) for name, _ in members), default=0)
    listed = [f"{printable(name):<{width}}  {size:.6g} {unit}" for name, size in members if size] or ["none"]
    if total is None or not members:
        yield from step(title, *listed)
        return
    sizes = [number(size) for _, size in members if size] or ["0"]
    if rule == "sum":
        text = " + ".join(sizes)
    elif rule == "rss":
        text = "sqrt(" + " + ".join(f"{size}^2" for size in sizes) + ")"
    else:
        text = f"max(0, {', '.join(sizes)})"
    yield from step(title, *listed, Sum(f"{symbol} = {text} = {total:.6g} {unit}"))
