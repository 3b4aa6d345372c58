"""Style of the figures: colours that colour-blind readers can distinguish, thin frames, light grids, no global state.

The colours are those of Okabe and Ito (https://jfly.uni-koeln.de/color), made for red-green blindness.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patheffects import withStroke


# Okabe and Ito's palette.
BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#222222", "#8A8A8A"
ZONE = "#F8EBC8"
"""Light amber behind chaotic zones, on which points keep their contrast."""
GRID, PAPER = "#E6E6E6", "#FFFFFF"
RASTER_DPI = 200

KIND_COLOURS = {
    "periodic": BLUE,
    "quasi-periodic": GREEN,
    "chaotic": VERMILION,
    "transient": ORANGE,
    "undecided": PURPLE,
}
"""Colour of a strobe point by the label of its lane."""
MOTION_COLOURS = {"circular": GREEN, "locally_periodic": BLUE, "disordered": VERMILION}
"""Colour of a speed range by the motion of the cage's centre; others are grey."""

FORCE_COLOURS = {
    "film": BLUE,
    "contact": VERMILION,
    "support": GREEN,
    "impact": ORANGE,
    "unbalance": PURPLE,
    "weight": BLACK,
}
OWN_COLOURS = (SKY, GREY)
"""Colours of a user's own forces, in turn, with dashed lines."""
LINE_COLOURS = (BLUE, SKY, GREEN, PURPLE, VERMILION, ORANGE)
"""Colours of lines beside each other, such as those of initial states."""


def halo(width: float) -> list[withStroke]:
    """Outline of a line in the colour of the paper, so that it can be seen on any background."""
    return [withStroke(linewidth=width, foreground=PAPER)]


def lighter(colour: str) -> tuple[float, float, float]:
    """Colour halfway between `colour` and the paper."""
    r, g, b = ((a + b) / 2 for a, b in zip(to_rgb(colour), to_rgb(PAPER), strict=True))
    return r, g, b


def new_figure(width: float = 8.0, height: float = 5.0) -> Figure:
    """New figure that is in no window and no global list, and is freed with its last use."""
    return Figure(figsize=(width, height), layout="constrained", dpi=RASTER_DPI)


def drawn(draw: Callable[[Axes], Any], width: float = 9.0, height: float = 5.0, title: str = "") -> Figure:
    """Figure of one diagram, which `draw` draws on its axes."""
    figure = new_figure(width, height)
    draw(figure.subplots())
    figure.suptitle(title, fontsize=11)
    return figure


def panels(
    draw: Sequence[Callable[[Axes], Any]], columns: int, size: tuple[float, float], title: str = "", **grid: Any
) -> Figure:
    """Figure with a panel for each of `draw`, row by row; only the lowest panels label an axis that they share."""
    figure, rows = new_figure(*size), max(1, -(-len(draw) // columns))
    cells = figure.subplots(rows, columns, squeeze=False, **grid).ravel()
    for i, (panel, ax) in enumerate(zip(draw, cells, strict=False)):
        panel(dress(ax))
        if grid.get("sharex") and i < len(draw) - columns:
            ax.set_xlabel("")
    for ax in cells[len(draw) :]:
        ax.remove()
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def axes_or_new(ax: Axes | None, width: float = 7.0, height: float = 4.5) -> Axes:
    """Return `ax` or the only axes of a new figure, in this style."""
    return dress(new_figure(width, height).subplots() if ax is None else ax)


def dress(ax: Axes) -> Axes:
    """Give axes a thin frame and a light grid behind the data."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set(color=GREY, linewidth=0.8)
    ax.tick_params(color=GREY, labelsize=9)
    ax.grid(True, color=GRID, linewidth=0.6)
    ax.set_axisbelow(True)
    return ax


def dots(colour: str, size: float | int) -> dict[str, Any]:
    """Style of a cloud of points without a line."""
    return {"marker": ".", "linestyle": "none", "markeredgewidth": 0, "color": colour, "markersize": size}


def enlarge_dots(legend: Legend) -> None:
    """Enlarge small light points in the legend, so that their colours can be distinguished."""
    for handle in legend.get_lines():
        if handle.get_marker() == ".":
            handle.set(markersize=7, alpha=1.0)


def legend_above(ax: Axes, ncols: int = 4, size: float | int = 9, **given: Any) -> None:
    """Add a legend above the frame, where it hides nothing."""
    place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0)}
    enlarge_dots(ax.legend(**place, ncols=ncols, frameon=False, fontsize=size, **given))


def legend_beside(ax: Axes, size: float | int = 9) -> None:
    place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    enlarge_dots(ax.legend(**place, frameon=False, fontsize=size, handlelength=1.4))


def legend_below(figure: Figure, ncols: int = 5) -> None:
    """Add one legend for all axes below them."""
    entries = {}
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    place = "outside lower center"
    enlarge_dots(figure.legend(entries.values(), entries.keys(), loc=place, ncols=ncols, frameon=False, fontsize=9))


def entitled(figure: Figure, title: str) -> Figure:
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def readable(name: str) -> str:
    return name.replace(".", " ").replace("_", " ")


def padded_limits(values: np.ndarray) -> tuple[float, float]:
    """Limits that include every finite value with a margin; (-1, 1) if there is none."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    pad = 0.05 * (high - low) or 0.1 * abs(high) or 1.0
    return low - pad, high + pad
