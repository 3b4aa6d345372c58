"""The shaft's speed beneath the cage's, on figures over speed."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter
from matplotlib.transforms import offset_copy

from ..quantities import quantity
from ._style import GREY


BELOW = 36.0
"""From the axis of the cage speed to that of the shaft speed [points]."""


def add_shaft_axes(figure: Figure, cage_speed_ratio: float, axes: Sequence[Axes] | None = None) -> Figure:
    """A second axis, of the shaft, under every axis of `figure` that is named as the cage's speed.

    **Arguments:** figure; cage speed over shaft speed; those of its axes that are meant, all if left out.

    **Returns:** the same figure.
    """
    for ax in list(figure.axes if axes is None else axes):
        if ax.get_xlabel() == quantity("speed_rpm").label:
            _add_below(ax, cage_speed_ratio)
    return figure


def _add_below(ax: Axes, ratio: float) -> None:
    move = lambda points: offset_copy(ax.transAxes, ax.figure, y=-points, units="points")  # pyright: ignore
    shaft = ax.secondary_xaxis(
        0.0, functions=(lambda x: np.asarray(x) / ratio, lambda x: np.asarray(x) * ratio), transform=move(BELOW)
    )
    shaft.set_xlabel("Shaft speed [rpm]")
    shaft.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    shaft.tick_params(color=GREY, labelsize=9)
    shaft.spines["bottom"].set(color=GREY, linewidth=0.8)
    legend = ax.get_legend()
    if legend is not None and legend.get_bbox_to_anchor().y1 < ax.get_window_extent().y0:  # it was beneath already
        legend.set_loc("upper center")
        legend.set_bbox_to_anchor((0.5, 0.0), transform=move(2 * BELOW))
