"""Designs and their tolerances as tables."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

from .._parameters import parameter_info, parameters
from ..design import BearingBudget, BeforeAfter, Optimised, SobolIndices, ToleranceBudget
from ..models import BearingModel, CageModel
from ._table import Table, chosen, speed


MOST = 8
"""Parameters listed in a budget."""


def parameters_table(name: str, model: CageModel, found: Optimised, document: Mapping[str, Any]) -> Table:
    """What was varied, what it costs and what it brings, before and after; `document` is the command's."""
    varied = changed_parameters_table(name, model, found, document["vary"])
    said = (
        ("cost", "cost", "", ".3f"),
        ("chaotic_rpm", "chaotic", "rpm", ".0f"),
        ("wear_load_N_m_per_s", "wear load of the land", "N m/s", ".4g"),
        ("peak_land_force_N", "peak land force", "N", ".4g"),
        ("least_film_um", "least film of the land", "um", ".3g"),
        ("film_drag_power_W", "film drag power", "W", ".4g"),
        ("balance_grade_mm_per_s", "balance grade G", "mm/s", ".3g"),
    )
    rows = [(what, unit, *(format(x, form) for x in document[key].values()), "") for key, what, unit, form in said]
    return dataclasses.replace(varied, rows=[*varied.rows, *rows])


def changed_parameters_table(
    title: str, model: CageModel | BearingModel, found: Optimised, vary: Mapping[str, tuple[float, float]]
) -> Table:
    """What was varied, before and after, in SI units."""
    info, before = parameter_info(model), parameters(model)
    rows = [
        (n, info[n].unit, f"{float(before[n]):.4g}", f"{value:.4g}", " to ".join(f"{b:.4g}" for b in vary[n]))
        for n, value in found.best.values.items()
    ]
    return Table(f"Design of {title}", ("parameter", "unit", "before", "after", "bounds"), rows)


def before_and_after_table(rows: Sequence[BeforeAfter], block: int) -> Table:
    """Every statistic before and after with its standard error; peaks are the largest of `block` revolutions."""
    with_error = lambda value, error: f"{value:.4g} ± {error:.1g}" if error else f"{value:.4g}"

    def change(row: BeforeAfter) -> str:
        if not row.before:
            return "-"
        share, error = 100 * row.change / row.before, 100 * row.change_error / abs(row.before)
        return f"{share:+.1f} ± {error:.1f} %" if error and math.isfinite(error) else f"{share:+.1f} %"

    columns = {
        "measure": "{0.name}",
        "unit": "{0.unit}",
        "before": lambda row: with_error(row.before, row.before_error),
        "after": lambda row: with_error(row.after, row.after_error),
        "change": change,
    }
    return Table.of(f"Before and after, from the same starts; peaks of {block} revolutions", columns, rows)


def optima_table(found: Optimised) -> Table:
    """The distinct optima, the best first."""
    columns = {
        **{name: f"{{0[0].values[{name}]:.4g}}" for name in found.best.values},
        "objective [rpm]": "{0[0].objective:.0f}",
        "starts": "{[1]}",
        "at a bound": lambda item: ", ".join(item[0].at_bound) or "none",
    }
    return Table.of("Optima", columns, found.distinct)


def before_and_after_tables(document: Mapping[str, Any]) -> list[Table]:
    """Zones of both kinds before and after."""
    tables = []
    for kind in ("chaotic", "synchronous_loss"):
        found = document[f"{kind}_zones"]
        rows = [
            (when, str(i), *map(speed, zone.values()))
            for when, listed in found.items()
            for i, zone in enumerate(listed, start=1)
        ]
        if rows:
            title = f"{kind.replace('_', '-').capitalize()} zones before and after [rpm]"
            tables.append(Table(title, ("design", "zone", "onset", "exit", "width"), rows, ("onset", "exit", "width")))
    return tables


def sobol_document(shares: SobolIndices) -> dict[str, Any]:
    """Sobol indices as JSON has them."""
    return {
        **chosen(shares, "first total first_interval total_interval samples_wanted"),
        "designs": shares.evaluations,
        "doubtful": list(shares.doubtful),
    }


def sobol_table(name: str, shares: SobolIndices, what: str = "chaotic speeds") -> Table:
    """What each parameter does to the chaotic speeds, or something else, alone and with the others."""
    cell = lambda value, pair: f"{value:+.2f} ({pair[0]:+.2f} to {pair[1]:+.2f})"
    columns = {
        "parameter": str,
        "alone": lambda n: cell(shares.first[n], shares.first_interval[n]),
        "with interactions": lambda n: cell(shares.total[n], shares.total_interval[n]),
    }
    over = f"shares of the variance over {shares.evaluations} designs (95 % interval)"
    title = f"{what[0].upper()}{what[1:]} of {name}: {over}"
    return Table.of(title, columns, sorted(shares.total, key=lambda n: -shares.total[n]))


def bearing_budget_table(budget: BearingBudget, tolerance: float) -> Table:
    """Which tolerances [%] move a measure of a whole bearing most, with standard errors."""
    unit = "" if budget.unit == "1" else f" {budget.unit}"
    share = lambda n: f"{100 * (budget.deviation[n] / budget.total) ** 2 if budget.total else 0:.0f} %"
    columns = {
        "parameter": str,
        f"standard deviation{unit and f' [{budget.unit}]'}": lambda n: (
            f"{budget.deviation[n]:.3g} ± {budget.error[n]:.1g}"
        ),
        "share of variance": share,
    }
    title = (
        f"{budget.measure.replace('_', ' ').capitalize()} of {budget.value:.4g}{unit} under +-{tolerance:g} % of "
        f"each of these: standard deviation {budget.total:.3g}{unit}"
    )
    return Table.of(title, columns, sorted(budget.deviation, key=lambda n: -budget.deviation[n]))


def budget_table(budget: ToleranceBudget, tolerance: float) -> Table:
    """Which tolerances [%] move an edge most."""
    order = sorted(budget.deviation_rpm.items(), key=lambda item: -item[1])
    share = lambda item: f"{100 * (item[1] / budget.total_rpm) ** 2:.0f} %"
    columns = {"parameter": "{[0]}", "rpm": "{[1]:.3g}", "share of variance": share}
    title = (
        f"{budget.edge.capitalize()} at {budget.speed_rpm:.1f} rpm under +-{tolerance:g} % of all but constants: "
        f"standard deviation {budget.total_rpm:.3g} rpm"
    )
    return Table.of(title, columns, order[:MOST])
