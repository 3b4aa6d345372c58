"""How a search for a better whole bearing went, and what it changed."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..design import BeforeAfter, Optimised
from ._design import design_history
from ._elasticities import readable
from ._style import BLACK, BLUE, GREY, dress, new_figure


def bearing_design_figure(found: Optimised, rows: Sequence[BeforeAfter], title: str = "") -> Figure:
    """The search beside the relative change of every statistic that is not 0, with bars of two standard errors; grey
    are changes within them."""
    shown = [row for row in rows if row.before]
    figure = new_figure(11.0, 1.6 + 0.34 * len(shown))
    left, right = figure.subplots(1, 2)
    design_history(found, left)
    left.set_ylabel("Objective over that of the design before")
    dress(right)
    change, error = (
        100 * np.array([getattr(row, n) / row.before for row in shown]) for n in ("change", "change_error")
    )
    place = np.arange(len(shown))
    colours = [BLUE if row.known else GREY for row in shown]
    right.barh(place, change, height=0.7, color=colours, alpha=0.75, linewidth=0)
    right.errorbar(change, place, xerr=2 * error, fmt="none", ecolor=BLACK, elinewidth=1.1)
    right.axvline(0, color=BLACK, linewidth=0.8)
    right.grid(False, axis="y")
    right.set_yticks(place, [_without_unit(row) for row in shown], fontsize=8)
    right.set_ylim(len(shown) - 0.5, -0.5)
    right.set_xlabel("Change [%], with two standard errors", fontsize=9)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def _without_unit(row: BeforeAfter) -> str:
    """Its name but for the unit, of which a change in per cent has none."""
    unit = row.unit.replace("^", "").replace("/", "_per_").replace(" ", "_")
    return readable(row.name.removesuffix(f"_{unit}"))
