"""Designs before and after a search, shares of a variance, and tolerances."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .._parameters import parameter_info, parameters
from ..design import BeforeAfter, Design, Optimum, Requirement, SobolIndices, ToleranceBudget, Value
from .tables import SHOWN, Beside, Column, Table, rows_table, speed_columns


MOST = 8
"""Parameters listed in a budget."""
IDLE = 1.5
"""A tolerance that may be wider by more than this factor buys nothing."""


def changed_table(title: str, model: Any, found: Optimum | Design, vary: Mapping[str, tuple[float, float]]) -> Table:
    """Parameters that were varied, before and after."""
    info, before, rows = parameter_info(model), parameters(model), []
    for name, value in found.values.items():
        unit = info[name].unit
        numbers = Column("", [float(x) for x in (before[name], value, *vary[name])], unit).cells
        row = {"parameter": name.replace("_", " "), "unit": SHOWN.get(unit, unit), "bounds": " to ".join(numbers[2:])}
        rows.append(row | {"before": numbers[0], "after": numbers[1]})
    return rows_table(title, rows, [Column(head, ()) for head in ("parameter", "unit", "before", "after", "bounds")])


def requirement_table(title: str, found: Design, beside: Beside = None) -> Table:
    """What a design must keep: the limit, the given design, the new one, the worst bearing within tolerances, and the
    speed to which the new value belongs."""
    rows: list[dict[str, Any]] = []
    for r in found.requirements:
        if r.of == "peak" and found.after.get(r.of) and found.after[r.of].value == 0:
            continue
        row: dict[str, Any] = {"requirement": r.name, "unit": _SHOWN.get(r.of, SHOWN.get(r.unit, r.unit))}
        row["limit"] = f"{'at least' if r.sign > 0 else 'at most'} {_text(r, r.limit)}"
        values = {"before": found.before.get(r.of), "after": found.after.get(r.of), "worst": found.worst.get(r.name)}
        row |= {name: None if each is None else _reached(r, each) for name, each in values.items()}
        after = found.after.get(r.of)
        rows.append(row | {"rpm": None if after is None else after.rpm})
    columns = [Column(head, ()) for head in ("requirement", "unit", "limit", "before", "after")]
    columns += [Column("worst in tolerance", (), key="worst")] if found.budget else []
    return rows_table(title, rows, [*columns, *speed_columns("at cage [rpm]", "rpm", beside)], "requirements")


_SHOWN = {"multiplier": "rev."}
"""Units of what is not shown in the unit of the requirement: a multiplier is shown as the time to fall to 1/e."""


def _text(r: Requirement, value: float) -> str:
    if r.of == "multiplier":
        return f"{-1 / math.log(value):.4g}" if 0 < value < 1 else "unstable"
    return Column("", [value], r.unit).cells[0]


def _reached(r: Requirement, each: Value) -> str:
    """The value as text; a margin without an edge is that of the limit of the search."""
    return f"above {_text(r, each.value)}" if "margin" in r.of and not math.isfinite(each.rpm) else _text(r, each.value)


def stricter(found: Design) -> dict[str, float]:
    """What a limit that is 10 % stricter costs, by requirement, of those that bind."""
    limits = {r.name: r for r in found.requirements}
    by = {}
    for name, price in found.prices.items():
        r = limits[name]
        step = 0.1 * abs(r.limit)
        if r.of == "multiplier":  # of the revolutions N to fall to 1/e, exp(-1/N) is the multiplier
            step = 0.1 * -r.limit * math.log(r.limit)
        by[name] = price * step
    return by


def budget_of_tolerances_table(model: Any, found: Design) -> Table:
    """How wide each tolerance may be while the others stay."""
    info, rows = parameter_info(model), []
    for each in found.budget:
        unit = info[each.name].unit
        wide = Column("", [each.width, each.width * each.factor], unit).cells
        rows.append(
            {
                "parameter": each.name.replace("_", " "),
                "unit": SHOWN.get(unit, unit),
                "width": wide[0],
                "may be": wide[1],
            }
            | {"factor": each.factor, "limited by": each.limit or "no requirement"}
        )
    idle = max(found.budget, key=lambda each: each.factor)
    title = "Tolerances, from end to end"
    if idle.factor > IDLE:
        title += f": that of {idle.name.replace('_', ' ')} buys nothing, it may be {idle.factor:.2g} times as wide"
    return rows_table(
        title, rows, [Column(x, ()) for x in ("parameter", "unit", "width", "may be", "limited by")], "budget"
    )


def before_and_after_table(title: str, rows: Sequence[BeforeAfter]) -> Table:
    """Statistics before and after with their standard errors, and their relative changes."""
    share = lambda row, value: value / abs(row.before) if row.before and math.isfinite(value) else None
    records = [
        vars(row) | {"known": row.known, "share": share(row, row.change), "share_error": share(row, row.change_error)}
        for row in rows
    ]
    columns = [Column("measure", (), key="name"), Column("unit", ())]
    columns += [Column(when, (), errors=f"{when}_error") for when in ("before", "after")]
    columns.append(Column("change", (), "1", "%", errors="share_error", key="share"))
    return rows_table(title, records, columns, "before_and_after")


def sobol_table(title: str, shares: SobolIndices) -> Table:
    """Share of the variance that each value has, alone and with the others."""
    rows = []
    for name in sorted(shares.total, key=lambda n: -shares.total[n]):
        row: dict[str, Any] = {"value": name}
        for key, kind in (("alone", "first"), ("with the others", "total")):
            value, pair = getattr(shares, kind)[name], getattr(shares, f"{kind}_interval")[name]
            span = "not known" if any(map(math.isnan, pair)) else f"{pair[0]:+.2f} to {pair[1]:+.2f}"
            row |= {kind: value, f"{kind}_interval": pair, key: f"{value:+.2f} ({span})"}
        rows.append(row)
    over = f"shares of the variance over {shares.evaluations} designs (95 %)"
    columns = [Column(head, ()) for head in ("value", "alone", "with the others")]
    return rows_table(f"{title}: {over}", rows, columns, "sobol")


def budget_table(budget: ToleranceBudget, tolerance: float) -> Table:
    """Tolerances [%] that move an edge, or a measure, most."""
    unit = "" if budget.unit == "1" else budget.unit
    rows = [
        {"parameter": n, "deviation": budget.deviation[n], "error": budget.error[n]}
        | {"share": (budget.deviation[n] / budget.total) ** 2 if budget.total else None}
        for n in sorted(budget.deviation, key=lambda n: -budget.deviation[n])[:MOST]
    ]
    deviation = Column(f"standard deviation{unit and f' [{unit}]'}", (), key="deviation", errors="error")
    columns = [Column("parameter", ()), deviation, Column("of the variance", (), "1", "%", key="share", digits=0)]
    name = budget.name.replace("_", " ").capitalize()
    title = f"{name} of {budget.value:.5g} {unit} under +-{tolerance:g} %: standard deviation {budget.total:.3g} {unit}"
    return rows_table(title.rstrip(), rows, columns)
