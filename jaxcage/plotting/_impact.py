"""History of one impact of a roller on a cage bar: the quantities of the paper's fig. 5."""

import numpy as np
from matplotlib.axes import Axes

from .._glossary import quantity
from ..forces import ImpactHistory
from ._style import BLUE, GREY, VERMILION, axes_or_new, shown


def impact_forces(history: ImpactHistory, ax: Axes | None = None) -> Axes:
    """Contact force between roller and bar, never negative, and force in the bar, which swings
    back, over time.
    """
    ax = axes_or_new(ax, 7.0, 4.0)
    time = shown("time", np.asarray(history.time))
    ax.axhline(0, color=GREY, linewidth=0.8)
    for name, force, colour in (
        ("contact_force", history.contact_force, BLUE),
        ("bar_force", history.bar_force, VERMILION),
    ):
        label = f"{quantity(name).text} {quantity(name).symbol}"
        ax.plot(time, np.asarray(force), color=colour, linewidth=1.4, label=label)
    ax.set(xlabel=quantity("time").label, ylabel=quantity("force").label, xlim=(time[0], time[-1]))
    ax.legend(frameon=False, fontsize=9, loc="upper right")
    return ax
