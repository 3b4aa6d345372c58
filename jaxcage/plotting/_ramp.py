"""Run-up and run-down: how far the cage moves, over speed in both directions."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..sweeps import RampUpDown
from ._orbit_diagram import label_speed, legend_below
from ._style import BLUE, GREY, VERMILION, ZONE, dress, new_figure


def ramp_figure(found: RampUpDown, title: str = "") -> Figure:
    """Size of the orbit and largest eccentricity ratio over cage speed, up and down; speeds at which they differ are
    shaded.
    """
    figure = new_figure(9.5, 6.0)
    above, below = figure.subplots(2, 1, sharex=True)
    for ax, factor, name in ((above, 1e3, "size"), (below, 1.0, "eccentricity")):
        dress(ax)
        for way, colour, width, label in ((found.up, BLUE, 1.6, "run-up"), (found.down, VERMILION, 1.1, "run-down")):
            ax.plot(way.rpm, factor * getattr(way, name), color=colour, linewidth=width, label=label)
        _shade(ax, found)
        ax.set_ylim(bottom=0.0)
    above.set_ylabel("Size of the orbit [mm]")
    below.set_ylabel("Largest eccentricity ratio [-]")
    below.axhline(1.0, color=GREY, linewidth=0.8, linestyle="--", label="land touches the rib's circle")
    below.set_xlim(float(min(found.up.rpm[0], found.down.rpm[0])), float(max(found.up.rpm[-1], found.down.rpm[-1])))
    label_speed(below)
    legend_below(figure, above, below, ncols=4)
    figure.suptitle(title, fontsize=11)
    return figure


def _shade(ax: Axes, found: RampUpDown) -> None:
    half = 0.5 * float(found.up.rpm[1] - found.up.rpm[0]) if found.up.rpm.size > 1 else 0.0
    for i, (low, high) in enumerate(found.stretches):
        label = "differs: hysteresis" if i == 0 else "_differs"
        ax.axvspan(low - half, high + half, color=ZONE, linewidth=0, zorder=0, label=label)
