"""What needs no motion of the cage: how the rollers share the load, and the impact of one on a bar, with the quantities
of the paper's fig. 5.
"""

import numpy as np
from matplotlib.axes import Axes

from ..bearing import LoadDistribution
from ..forces import ImpactHistory
from ..quantities import quantity
from ._style import BLUE, GREY, VERMILION, axes_or_new, shown


def load_bars(distribution: LoadDistribution, ax: Axes | None = None) -> Axes:
    """Load on the inner raceway of every roller over its angle from the load, the loaded zone
    between thin lines.
    """
    ax = axes_or_new(ax, 7.0, 3.6)
    angles = np.degrees(np.asarray(distribution.roller_angles)) + 90
    angles = (angles + 180) % 360 - 180
    half = float(np.degrees(np.asarray(distribution.half_angle)))
    ax.bar(angles, np.asarray(distribution.inner_loads), width=0.5 * 360 / angles.size, color=BLUE)
    for i, edge in enumerate((-half, half)):
        label = f"half angle {half:.1f}°" if i == 0 else None
        ax.axvline(edge, color=GREY, linewidth=1.0, linestyle="--", label=label)
    ax.set(xlim=(-190, 190), xticks=range(-180, 181, 45))
    ax.set(xlabel="Angle from the load [°]", ylabel="Roller load on the inner raceway [N]")
    ax.legend(frameon=False, fontsize=9)
    return ax


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
