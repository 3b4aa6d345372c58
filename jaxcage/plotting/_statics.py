"""How the rollers share the load."""

import numpy as np
from matplotlib.axes import Axes

from ..bearing import LoadDistribution
from ._style import BLUE, GREY, axes_or_new


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
