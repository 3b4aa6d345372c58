"""Designs of a whole bearing as tables."""

import math
from collections.abc import Mapping, Sequence

from .._parameters import parameter_info, parameters
from ..design import BeforeAfter, Optimised
from ..models import BearingModel
from ._table import Table


def changed_parameters_table(
    title: str, model: BearingModel, found: Optimised, vary: Mapping[str, tuple[float, float]]
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
