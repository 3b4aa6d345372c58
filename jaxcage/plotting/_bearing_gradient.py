"""Elasticities of the whole bearing's statistics as bars with their errors."""

import numpy as np
from matplotlib.figure import Figure

from ..design import BearingGradient
from ._elasticities import EDGE_COLOURS, readable
from ._style import BLACK, dress, new_figure


ROW = 2
"""Statistics side by side."""


def statistic_bars(found: BearingGradient, title: str = "") -> Figure:
    """A panel for each statistic that is not 0: elasticity by each direction, with bars of two standard errors."""
    shown = [each for each in found.statistics.values() if each.value]
    count = max(1, len(shown))
    names = shown[0].directions if shown else ()
    columns = min(ROW, count)
    rows = -(-count // columns)
    figure = new_figure(11.0 * columns / ROW, 1.0 + rows * (0.8 + 0.28 * len(names)))
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
    place = np.arange(len(names))
    for ax, each, colour in zip(axes.ravel(), shown, EDGE_COLOURS * 2, strict=False):
        dress(ax)
        ax.barh(place, each.elasticity, height=0.7, color=colour, alpha=0.75, linewidth=0)
        ax.errorbar(each.elasticity, place, xerr=2 * each.elasticity_error, fmt="none", ecolor=BLACK, elinewidth=1.1)
        ax.axvline(0, color=BLACK, linewidth=0.8)
        ax.grid(False, axis="y")
        drifts = "" if each.settled else ", not settled"
        ax.set_title(f"{readable(each.name)}: {each.value:.3g}{drifts}", fontsize=9, loc="left")
    for ax in axes.ravel()[len(shown) :]:
        ax.set_axis_off()
    for ax in axes[:, 0]:
        ax.set_yticks(place, [readable(name).replace("+", ",\n") for name in names], fontsize=8)
        ax.set_ylim(len(names) - 0.5, -0.5)
    for ax in axes[-1]:
        ax.set_xlabel("Elasticity, with two standard errors", fontsize=9)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure
