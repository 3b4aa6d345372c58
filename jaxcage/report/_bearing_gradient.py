"""How statistics of the whole bearing answer to the design, with standard errors."""

from typing import Any

from ..design import BearingGradient, StatisticGradient
from ._table import Table, chosen, number


def bearing_gradient_table(title: str, found: BearingGradient) -> Table:
    """A row for each statistic: its mean, and its elasticities."""
    first = next(iter(found.statistics.values()))
    rows = [
        (each.name, f"{each.value:.4g} ± {each.value_error:.1g}", *_cells(each), f"{number(100 * each.explained)} %")
        for each in found.statistics.values()
    ]
    names = [name.replace("_", " ").replace("+", ", ") for name in first.directions]
    return Table(title, ("statistic", "mean", *names, "explained"), rows)


def _cells(each: StatisticGradient) -> list[str]:
    if not each.value:
        return ["-"] * len(each.directions)
    return [f"{x:+.3f} ± {e:.3f}" for x, e in zip(each.elasticity, each.elasticity_error, strict=True)]


def bearing_gradient_document(found: BearingGradient) -> dict[str, Any]:
    """Everything for programs: derivatives by the logarithm of each direction, elasticities, slopes of single ones."""
    rows = {}
    for name, each in found.statistics.items():
        by = {}
        for i, direction in enumerate(each.directions):
            told = chosen(each, "elasticity elasticity_error by_relative_change by_relative_change_error")
            by[direction] = {what: values[i] for what, values in told.items()}
            if "+" not in direction:
                slope, error = found.slope(name, direction)
                by[direction] |= {"slope_per_SI_unit": slope, "slope_error_per_SI_unit": error}
        rows[name] = chosen(each, "unit value value_error drift drift_error settled explained") | {"by": by}
    length = chosen(found, "pairs failed inaccurate starts discard revolutions spread")
    return length | {"parameters": found.values, "statistics": rows}
