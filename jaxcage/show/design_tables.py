"""Designs before and after a search, shares of a variance, and tolerances."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .._parameters import parameter_info, parameters
from ..design import BeforeAfter, Optimum, SobolIndices, ToleranceBudget
from .tables import SHOWN, Column, Table, rows_table


MOST = 8
"""Parameters listed in a budget."""


def changed_table(title: str, model: Any, found: Optimum, vary: Mapping[str, tuple[float, float]]) -> Table:
    """Parameters that were varied, before and after."""
    info, before, rows = parameter_info(model), parameters(model), []
    for name, value in found.values.items():
        unit = info[name].unit
        numbers = Column("", [float(x) for x in (before[name], value, *vary[name])], unit).cells
        row = {"parameter": name.replace("_", " "), "unit": SHOWN.get(unit, unit), "bounds": " to ".join(numbers[2:])}
        rows.append(row | {"before": numbers[0], "after": numbers[1]})
    return rows_table(title, rows, [Column(head, ()) for head in ("parameter", "unit", "before", "after", "bounds")])


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
