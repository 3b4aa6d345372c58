"""How a search for a better design, of a cage or of a whole bearing, went, and what came of it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis import Sweep
from ..design import BeforeAfter, Optimised
from ._compare import draw_beside
from ._elasticities import readable
from ._orbit_diagram import legend_below
from ._style import BLACK, BLUE, GREY, VERMILION, axes_or_new, dress, new_figure


def design_history(found: Optimised, ax: Axes | None = None) -> Axes:
    """Objective over the steps of each search, the best one in colour."""
    ax = axes_or_new(ax, height=2.5)
    for i, optimum in reversed(list(enumerate(found.optima))):
        value = np.array([s.value if s.status == "ok" else np.nan for s in optimum.history])
        if i == 0:
            ax.plot(value, color=BLUE, linewidth=1.4, label="best")
            best = int(np.nanargmin(value))
            ax.plot(best, value[best], "o", color=VERMILION, markersize=5, label="chosen")
        else:
            ax.plot(value, color=GREY, linewidth=0.9)
    ax.set(xlabel="Step", ylabel="Objective [rpm]")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0, frameon=False)
    return ax


def design_figure(found: Optimised, before: Sweep, after: Sweep) -> Figure:
    """The search above; orbit diagrams and exponents of the first design and the chosen one below,
    both on the scale that holds both."""
    figure = new_figure(12.0, 8.0)
    grid = figure.add_gridspec(3, 2, height_ratios=(1.0, 1.6, 1.0))
    design_history(found, figure.add_subplot(grid[0, :]))
    cells = grid[1:, :].subgridspec(2, 2, height_ratios=(1.6, 1.0)).subplots(sharex="col")
    draw_beside(np.asarray(cells), ("before", "after"), (before, after))
    legend_below(figure, *np.asarray(cells).ravel())
    return figure


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
