"""Designs before and after a search, shares of a variance, and tolerances, as tables."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .._parameters import parameter_info, parameters
from ..design import BeforeAfter, Optimised, SobolIndices, ToleranceBudget
from .tables import SHOWN, Column, Table, chosen, rows_table


MOST = 8
"""Parameters listed in a budget."""


def parameters_table(title: str, model: Any, found: Optimised, vary: Mapping[str, tuple[float, float]]) -> Table:
    """Parameters that were varied, before and after."""
    info, before = parameter_info(model), parameters(model)
    cell = lambda value, name: Column("", [float(value)], info[name].unit).cells[0]
    rows = [
        {"parameter": n.replace("_", " "), "unit": SHOWN.get(info[n].unit, info[n].unit), "before": cell(before[n], n)}
        | {"after": cell(value, n), "bounds": " to ".join(cell(bound, n) for bound in vary[n])}
        for n, value in found.best.values.items()
    ]
    return rows_table(title, rows, [Column(head, ()) for head in ("parameter", "unit", "before", "after", "bounds")])


def optima_table(model: Any, found: Optimised) -> Table:
    """The distinct optima, the best first."""
    info = parameter_info(model)
    rows = [
        {**best.values, "objective": best.objective, "starts": n, "bound": ", ".join(best.at_bound) or "none"}
        for best, n in found.distinct
    ]
    columns = [Column(n.replace("_", " "), (), info[n].unit, key=n) for n in found.best.values]
    rest = [Column("objective", ()), Column("starts", ()), Column("at a bound", (), key="bound")]
    return rows_table("Optima", rows, [*columns, *rest])


def before_and_after_table(title: str, rows: Sequence[BeforeAfter]) -> Table:
    """Statistics before and after with their standard errors, and their relative changes."""
    share = lambda row, value: value / abs(row.before) if row.before and math.isfinite(value) else None
    records = [
        vars(row) | {"share": share(row, row.change), "share_error": share(row, row.change_error)} for row in rows
    ]
    columns = [
        Column("measure", (), key="name"),
        Column("unit", ()),
        Column("before", (), errors="before_error"),
        Column("after", (), errors="after_error"),
        Column("change", (), "1", "%", errors="share_error", key="share"),
    ]
    return rows_table(title, records, columns)


def zones_before_and_after(title: str, zones: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[Table]:
    """Zones of one kind of the designs before and after, if there are any."""
    rows = [
        {"design": when, "zone": i, **zone} for when, found in zones.items() for i, zone in enumerate(found, start=1)
    ]
    ends = [Column(end, (), key=f"{end}_rpm", digits=0) for end in ("onset", "exit", "width")]
    return [rows_table(title, rows, [Column("design", ()), Column("zone", ()), *ends])] if rows else []


def sobol_document(shares: SobolIndices) -> dict[str, Any]:
    """Sobol indices for a document."""
    doubtful = {"designs": shares.evaluations, "doubtful": list(shares.doubtful)}
    return chosen(shares, "first total first_interval total_interval samples_wanted") | doubtful


def sobol_table(title: str, shares: SobolIndices, sources: Mapping[str, str] | None = None) -> Table:
    """Share of the variance that each value has, alone and with the others; and how to measure it."""
    span = lambda pair: "not known" if any(map(math.isnan, pair)) else f"{pair[0]:+.2f} to {pair[1]:+.2f}"
    cell = lambda value, pair: f"{value:+.2f} ({span(pair)})"
    rows = [
        {
            "value": name,
            "alone": cell(shares.first[name], shares.first_interval[name]),
            "with the others": cell(shares.total[name], shares.total_interval[name]),
            "measure": "" if sources is None else sources[name],
        }
        for name in sorted(shares.total, key=lambda n: -shares.total[n])
    ]
    heads = ["value", "alone", "with the others", *([] if sources is None else ["measure"])]
    over = f"shares of the variance over {shares.evaluations} designs (95 %)"
    return rows_table(f"{title}: {over}", rows, [Column(head, ()) for head in heads])


def budget_table(budget: ToleranceBudget, tolerance: float) -> Table:
    """Tolerances [%] that move an edge, or a measure, most."""
    order = sorted(budget.deviation, key=lambda n: -budget.deviation[n])[:MOST]
    unit = "" if budget.unit == "1" else budget.unit
    rows = [
        {"parameter": n, "deviation": budget.deviation[n], "error": budget.error[n]}
        | {"share": (budget.deviation[n] / budget.total) ** 2 if budget.total else None}
        for n in order
    ]
    columns = [
        Column("parameter", ()),
        Column(f"standard deviation{unit and f' [{unit}]'}", (), key="deviation", errors="error"),
        Column("share of variance", (), "1", "%", key="share", digits=0),
    ]
    name = budget.name.replace("_", " ").capitalize()
    title = f"{name} of {budget.value:.5g} {unit} under +-{tolerance:g} %: standard deviation {budget.total:.3g} {unit}"
    return rows_table(title.rstrip(), rows, columns)


def budget_document(budget: ToleranceBudget) -> dict[str, Any]:
    """A tolerance budget for a document."""
    return {
        **chosen(budget, "name unit value elasticity"),
        "deviation": budget.total,
        "by_parameter": budget.deviation,
        "by_parameter_error": budget.error,
    }
