"""Tables of designs before and after a search, shares of a variance, and tolerances."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .._parameters import parameter_info, parameters
from ..design import BeforeAfter, Design, Optimum, Requirement, SobolIndices, ToleranceBudget, Value
from .quantity_tables import head_of
from .tables import OWN, SHOWN, UNIT, Beside, Column, Table, speed_columns, table


MOST = 8
"""Largest number of parameters in a budget."""
IDLE = 1.5
"""A tolerance that may be wider by more than this factor is reported as needlessly tight."""


def changed_table(title: str, model: Any, found: Optimum | Design, vary: Mapping[str, tuple[float, float]]) -> Table:
    """Table of the varied parameters before and after."""
    info, before = parameter_info(model), parameters(model)
    rows = [
        {"parameter": name.replace("_", " "), "unit": info[name].unit, "before": float(before[name])}
        | {"after": float(value), "lower": float(vary[name][0]), "upper": float(vary[name][1])}
        for name, value in found.values.items()
    ]
    columns = [Column(name, unit=OWN) for name in ("before", "after")]
    columns += [Column(f"{name} bound", name, OWN) for name in ("lower", "upper")]
    return table(title, rows, ["parameter", UNIT, *columns])


def requirement_table(title: str, found: Design, beside: Beside = None) -> Table:
    """Table of requirements: limit, values before and after, the worst bearing within tolerances, and the speed of the
    new value. A multiplier is shown as the revolutions in which a disturbance falls to 1/e."""
    rows: list[dict[str, Any]] = []
    for r in found.requirements:
        after = found.after.get(r.of)
        if r.of == "peak" and after is not None and after.value == 0:
            continue
        values = {"before": found.before.get(r.of), "after": after, "worst": found.worst.get(r.name)}
        row: dict[str, Any] = {"requirement": r.name, "unit": _unit(r), "limit": _limit(r)}
        row |= {name: None if each is None else _reached(r, each) for name, each in values.items()}
        rows.append(row | {"rpm": None if after is None else after.rpm})
    columns = ["requirement", UNIT, "limit", "before", "after"]
    tolerated = any(found.worst.get(r.name) is not found.after.get(r.of) for r in found.requirements)
    columns += [Column("worst in tolerance", "worst")] if tolerated else []
    return table(title, rows, [*columns, *speed_columns("at [rpm]", "rpm", beside)], "requirements")


def broken_words(found: Design) -> str:
    """Requirements that are not kept, their values and limits: `least film, 0.02000 mm (at least 0.05000)`."""
    rows = [(r, _text(r, found.worst[r.name].value)) for r in found.requirements if r.name in found.short]
    unit = lambda r: SHOWN.get(_unit(r), _unit(r))
    return "; ".join(f"{r.name}, {value} {unit(r)}".rstrip() + f" ({_limit(r)})" for r, value in rows)


def _unit(r: Requirement) -> str:
    return "rev." if r.of == "multiplier" else r.unit


def _limit(r: Requirement) -> str:
    return f"{'at least' if r.sign > 0 else 'at most'} {_text(r, r.limit)}"


def _text(r: Requirement, value: float) -> str:
    if r.of == "multiplier":
        return f"{-1 / math.log(value):.4g}" if 0 < value < 1 else "unstable"
    return Column("value", unit=r.unit).cell({"value": value})


def _reached(r: Requirement, each: Value) -> str:
    """Text of a value; a margin without an edge is that to the limit of the search."""
    return f"above {_text(r, each.value)}" if "margin" in r.of and not math.isfinite(each.rpm) else _text(r, each.value)


def stricter(found: Design) -> dict[str, float]:
    """Cost of a limit that is 10 % stricter, for each binding requirement whose limit is not 0."""
    limits, by = {r.name: r for r in found.requirements}, {}
    for name, price in found.prices.items():
        r = limits[name]
        step = 0.1 * abs(r.limit)
        if r.of == "multiplier":  # exp(-1/N), with N revolutions to fall to 1/e
            step = 0.1 * -r.limit * math.log(r.limit)
        by |= {name: price * step} if step else {}
    return by


def budget_of_tolerances_table(model: Any, found: Design) -> Table:
    """Table of the admissible width of each tolerance with the others fixed."""
    info = parameter_info(model)
    rows = [
        {"parameter": each.name.replace("_", " "), "unit": info[each.name].unit, "width": each.width}
        | {"may be": each.width * each.factor, "factor": each.factor, "limited by": each.limit or "no requirement"}
        for each in found.budget
    ]
    idle, title = max(found.budget, key=lambda each: each.factor), "Tolerances, from end to end"
    if idle.factor > IDLE:
        times = f"{idle.factor:.2g} times" if idle.limit else f"at least {idle.factor:.2g} times"
        title += f": that of {idle.name.replace('_', ' ')} buys nothing, it may be {times} as wide"
    widths = [Column(name, unit=OWN) for name in ("width", "may be")]
    return table(title, rows, ["parameter", UNIT, *widths, "limited by"], "budget")


def before_and_after_table(title: str, rows: Sequence[BeforeAfter]) -> Table:
    """Table of statistics before and after with their standard errors, and of their relative changes."""
    share = lambda row, value: value / abs(row.before) if row.before and math.isfinite(value) else None
    records = [
        vars(row)
        | {"measure": head_of(row.name, row.unit), "known": row.known}
        | {"share": share(row, row.change), "share_error": share(row, row.change_error)}
        for row in rows
    ]
    columns = [Column(when, unit=OWN, error=f"{when}_error") for when in ("before", "after")]
    columns.append(Column("change", "share", shown="%", error="share_error"))
    return table(title, records, [Column("measure"), UNIT, *columns], "before_and_after")


def sobol_table(title: str, shares: SobolIndices) -> Table:
    """Table of the share of the variance due to each value, alone and with the others."""
    rows = []
    for name in sorted(shares.total, key=lambda n: -shares.total[n]):
        row: dict[str, Any] = {"value": name}
        for key, kind in (("alone", "first"), ("with the others", "total")):
            value, pair = getattr(shares, kind)[name], getattr(shares, f"{kind}_interval")[name]
            span = "not known" if any(map(math.isnan, pair)) else f"{pair[0]:+.2f} to {pair[1]:+.2f}"
            row |= {kind: value, f"{kind}_interval": pair, key: f"{value:+.2f} ({span})"}
        rows.append(row)
    over = f"shares of the variance over {shares.evaluations} designs (95 %)"
    return table(f"{title}: {over}", rows, ["value", "alone", "with the others"], "sobol")


def budget_table(budget: ToleranceBudget, tolerance: float) -> Table:
    """Table of the tolerances [%] that move an edge, or a measure, most."""
    unit = "" if budget.unit == "1" else budget.unit
    rows = [
        {"parameter": n, "deviation": budget.deviation[n], "error": budget.error[n]}
        | {"share": (budget.deviation[n] / budget.total) ** 2 if budget.total else None}
        for n in sorted(budget.deviation, key=lambda n: -budget.deviation[n])[:MOST]
    ]
    deviation = Column(f"standard deviation{unit and f' [{unit}]'}", "deviation", error="error")
    share = Column("of the variance", "share", shown="%", digits=0)
    name = budget.name.replace("_", " ").capitalize()
    title = f"{name} of {budget.value:.5g} {unit} under ±{tolerance:g} %: standard deviation {budget.total:.3g} {unit}"
    return table(title.rstrip(), rows, ["parameter", deviation, share])
