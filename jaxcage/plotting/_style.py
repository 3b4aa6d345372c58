"""House style: colours that colour-blind readers can tell apart, thin frames, light grids. No
pyplot, no global state.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from .._glossary import quantity


# Okabe and Ito's palette.
BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#222222", "#8A8A8A"
ZONE = "#F8EBC8"
"""Light amber behind chaotic zones: the points on it keep their contrast."""
RASTER_DPI = 200

KIND_COLOURS = {
    "periodic": BLUE,
    "quasi-periodic": GREEN,
    "chaotic": VERMILION,
    "undecided": PURPLE,
}
"""Colour of a strobe point by what its lane does."""

FORCE_COLOURS = {
    "film": BLUE,
    "contact": VERMILION,
    "support": GREEN,
    "impact": ORANGE,
    "unbalance": PURPLE,
    "weight": GREY,
}


def new_figure(width: float = 8.0, height: float = 5.0) -> Figure:
    """A figure that belongs to no window and no global list: it can be made anywhere and is freed
    with its last use.
    """
    return Figure(figsize=(width, height), layout="constrained", dpi=RASTER_DPI)


def axes_or_new(ax: Axes | None, width: float = 7.0, height: float = 4.5) -> Axes:
    """`ax`, or the only axes of a new figure."""
    return dress(new_figure(width, height).subplots() if ax is None else ax)


def dress(ax: Axes) -> Axes:
    """Thin frame, light grid behind the data."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set(color=GREY, linewidth=0.8)
    ax.tick_params(color=GREY, labelsize=9)
    ax.grid(True, color="#E6E6E6", linewidth=0.6)
    ax.set_axisbelow(True)
    return ax


def dots(colour: str, size: float | int) -> dict[str, Any]:
    """Style of a cloud of points without a line."""
    style = {"marker": ".", "linestyle": "none", "markeredgewidth": 0}
    return style | {"color": colour, "markersize": size}


def enlarge_dots(legend: Legend) -> Legend:
    """Small light points are drawn large and full in the legend, so that their colours can be told
    apart.
    """
    for handle in legend.get_lines():
        if handle.get_marker() == ".":
            handle.set(markersize=7, alpha=1.0)
    return legend


def shown(name: str, values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """`values` [SI] of the glossary's quantity `name`, in the unit of its axis."""
    return np.asarray(values) * quantity(name).factor


def padded_limits(values: np.ndarray, margin: float = 0.05) -> tuple[float, float]:
    """Limits that hold every finite value with a margin; (-1, 1) if there is none."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    pad = margin * (high - low) or 0.1 * abs(high) or 1.0
    return low - pad, high + pad
