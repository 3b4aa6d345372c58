"""How a search for a better design went, and what came of it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis import Sweep
from ..design import Optimised, TradeOff
from ._compare import draw_beside
from ._orbit_diagram import legend_below
from ._style import BLUE, GREY, VERMILION, axes_or_new, new_figure


def design_history(found: Optimised, ax: Axes | None = None) -> Axes:
    """Objective over the steps of each search, the best one in colour with its error bars."""
    ax = axes_or_new(ax, height=2.5)
    for i, optimum in reversed(list(enumerate(found.optima))):
        value = np.array([s.value if s.status == "ok" else np.nan for s in optimum.history])
        error = np.array([s.error for s in optimum.history])
        if i == 0:
            ax.errorbar(
                np.arange(value.size), value, 2 * error, color=BLUE, linewidth=1.4, elinewidth=0.8, label="best"
            )
            best = int(np.nanargmin(value))
            ax.plot(best, value[best], "o", color=VERMILION, markersize=5, label="chosen")
        else:
            ax.plot(value, color=GREY, linewidth=0.9)
    ax.set(xlabel="Step", ylabel="Objective [rpm]")
    ax.legend(loc="upper right", frameon=False)
    return ax


def trade_off_diagram(found: TradeOff, ax: Axes | None = None) -> Axes:
    """All designs by their first two objectives; those that no other beats in everything in colour, the design itself
    and its optimum, which come last, marked."""
    ax = axes_or_new(ax, height=5.0)
    x, y = found.values[:, 0], found.values[:, 1]
    good = found.efficient
    ax.plot(x[~good], y[~good], "o", color=GREY, markersize=4, label="beaten by another in everything")
    ax.plot(x[good], y[good], "o", color=BLUE, markersize=6, label="beaten by none")
    for i, name, marker in ((-2, "before", "s"), (-1, "after", "D")):
        ax.plot(x[i], y[i], marker, color=VERMILION, markersize=10, fillstyle="none", linestyle="", label=name)
    upper = lambda name: name[:1].upper() + name[1:]
    ax.set(xlabel=upper(found.names[0]), ylabel=upper(found.names[1]))
    if np.nanmin(y) > 0 and np.nanmax(y) > 30 * np.nanmin(y):
        ax.set_yscale("log")
    ax.legend(loc="best", frameon=False)
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
