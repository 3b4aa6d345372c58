"""Two designs beside each other on one scale."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from ..analysis import Sweep, Zones
from ..quantities import quantity
from ._marks import shade_zones
from ._orbit_diagram import exponent_strip, label_speed, legend_below, orbit_diagram
from ._shaft import add_shaft_axes
from ._style import BLUE, VERMILION, dress, new_figure, padded_limits


COLOURS = (BLUE, VERMILION)
"""Of the first design and the second."""


def sweeps_beside(
    names: Sequence[str],
    swept: Sequence[Sweep],
    zones: Sequence[Zones] | None = None,
    cage_speed_ratios: Sequence[float] = (),
) -> Figure:
    """Orbit diagrams of designs beside each other, exponents beneath, all on the scale that holds both.

    **Arguments:** names; sweeps; their zones, which are shaded; cage speed over shaft speed of each, for axes of the
    shaft's speed.
    """
    figure = new_figure(12.0, 6.4)
    cells = figure.subplots(2, len(swept), sharex="col", sharey="row", squeeze=False, height_ratios=(2.0, 1.0))
    draw_beside(cells, names, swept, zones)
    for ax, ratio in zip(cells[-1], cage_speed_ratios, strict=False):
        add_shaft_axes(figure, ratio, [ax])
    legend_below(figure, *cells.ravel())
    return figure


def draw_beside(
    cells: np.ndarray, names: Sequence[str], swept: Sequence[Sweep], zones: Sequence[Zones] | None = None
) -> None:
    """Orbit diagram and exponents of each design in a column of two axes."""
    limits = []
    for column, (name, found) in enumerate(zip(names, swept, strict=True)):
        above, below = cells[:, column]
        orbit_diagram(found, 1, above)
        exponent_strip(found, below)
        limits.append((above.get_ylim(), below.get_ylim()))
        above.set_title(name, loc="left", fontsize=10)
        above.set_xlabel("")
        below.set_ylabel("largest exponent\nper revolution " + quantity("largest_exponent").symbol)
        for ax in (above, below):
            if zones is not None:
                shade_zones(ax, zones[column])
            if column:
                ax.set_ylabel("")
    for row in (0, 1):
        ends = [pair[row] for pair in limits]
        for ax in cells[row]:
            ax.set_ylim(min(low for low, _ in ends), max(high for _, high in ends))


def over_speed(
    names: Sequence[str],
    rpm: Sequence[Float[np.ndarray, " speeds"]],
    curves: Sequence[tuple[str, Sequence[Float[np.ndarray, " speeds"]]]],
) -> Figure:
    """Quantities over the cage speed, one above the other, each with a line of every design.

    **Arguments:** names of the designs; speeds [rpm] of each; label of a quantity and its values for each design.
    """
    figure = new_figure(9.5, 1.2 + 2.2 * len(curves))
    cells = figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0]
    for ax, (label, values) in zip(cells, curves, strict=True):
        dress(ax)
        for name, x, y, colour, width in zip(names, rpm, values, COLOURS, (1.6, 1.1), strict=False):
            ax.plot(x, y, color=colour, linewidth=width, label=name)
        low, high = padded_limits(np.concatenate([np.asarray(y) for y in values]))
        ax.set(ylabel=label, ylim=(min(low, 0.0), high))
    label_speed(cells[-1]).set_xlim(float(min(map(np.min, rpm))), float(max(map(np.max, rpm))))
    cells[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(names), frameon=False, fontsize=9)
    return figure
