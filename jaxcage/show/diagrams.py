"""Sweeps over speed: orbit diagram, exponents, reported quantities, one sweep or several beside each other.

Every figure reads the data set of a sweep, its units and its coordinates, whatever model was swept.
"""

import math
from collections.abc import Callable, Sequence
from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis import CHAOS_THRESHOLD, Stretch, Zones, failed, scatter
from ..bearing import PublishedCase
from ..quantities import quantity
from .quantity_tables import SHARES, head_of, mean_over_starts
from .speed_axes import Span, add_shaft_axes, label_speed, mark_published, shade_zones, speed_limits
from .style import (
    BLACK,
    BLUE,
    GREY,
    KIND_COLOURS,
    LINE_COLOURS,
    SKY,
    VERMILION,
    ZONE,
    axes_or_new,
    dots,
    dress,
    entitled,
    legend_below,
    new_figure,
    padded_limits,
)
from .tables import SHOWN, factor


SWEPT = ("cage_slip", "pocket_force_mean_sum_N", "pocket_force_max_N", "friction_power_W", "synchronous_force_x_N")
COMPARED = ("cage_slip", "friction_power_W", "pocket_impulse_N_s", "land_impulse_N_s", "pocket_wear_mm3_per_h")
"""Quantities of a whole bearing in the figure of a sweep and in that of several bearings."""
BESIDE_COLOURS = (BLUE, VERMILION, *LINE_COLOURS[1:4])
"""Colours of designs beside each other."""


def labelled(values: xr.DataArray) -> tuple[str, float]:
    """Axis label of a variable with the unit in which it is shown, and the factor from its SI unit to that."""
    unit, name = values.attrs.get("units", "1"), str(values.name)
    if name == "exponents":
        return quantity("largest_exponent").label, 1.0
    shown = "%" if name in SHARES else SHOWN.get(unit, unit)
    return f"{head_of(name, unit).capitalize()}{f' [{shown}]' if shown else ''}", factor(unit, shown)


def reported(sweep: xr.Dataset, wanted: Sequence[str]) -> list[str]:
    """The wanted quantities that the swept model reports; the first six where it reports others only."""
    every = [str(name).removesuffix("_blocks") for name in sweep.data_vars if str(name).endswith("_blocks")]
    return [name for name in wanted if name in every] or every[:6]


def orbit_diagram(
    sweep: xr.Dataset, component: int = 1, ax: Axes | None = None, *, limits_rpm: Span | None = None
) -> Axes:
    """Strobe states over speed from all initial states, coloured by label; failed lanes are crosses at the foot.

    **Arguments:** sweep; component of the state (1: vertical displacement of a cage); axes; range of speed for a zoomed
    diagram, whose vertical limits then fit the states in it.
    """
    ax = axes_or_new(ax)
    named = quantity(str(sweep["component"].values[component]))
    low, high = speed_limits(sweep) if limits_rpm is None else limits_rpm
    inside = sweep.isel(speed=(sweep["rpm"].values >= low) & (sweep["rpm"].values <= high))
    points, rpm = inside["strobe"].values[..., component] * named.factor, inside["rpm"].values
    speeds, labels = np.broadcast_to(rpm[:, None, None], points.shape), inside["label"].values.astype(str)
    kind = np.where(np.char.startswith(labels, "periodic"), "periodic", labels)  # all periods together
    size = 1.8 if rpm.size > 150 else 2.5
    for label, colour in KIND_COLOURS.items():
        lanes = kind == label
        if np.any(lanes):
            style = dots(colour, size) | {"alpha": 0.5, "rasterized": True}
            ax.plot(speeds[lanes].ravel(), points[lanes].ravel(), **style, label=label)
    lost = rpm[np.any(failed(inside), axis=1)]
    if lost.size:
        foot = {"color": BLACK, "markersize": 4, "transform": ax.get_xaxis_transform()}
        ax.plot(lost, np.full(lost.size, 0.015), "x", **foot, label="failed")
    ax.set(xlim=(low, high), ylim=padded_limits(points), ylabel=named.label)
    return label_speed(ax, sweep)


def exponent_strip(sweep: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Largest Lyapunov exponent over speed: points for every initial state, a line for the largest of them with ±2
    standard errors.

    The lower limit is cut where strongly attracting orbits would hide the range around zero.
    """
    ax = axes_or_new(ax, height=2.5)
    rpm = sweep["rpm"].values
    largest, error = sweep["exponents"].values[..., 0], sweep["standard_error"].values[..., 0]
    finished = np.where(failed(sweep), -np.inf, largest)
    lane = (np.arange(rpm.size), np.argmax(finished, axis=1))
    top = np.where(np.isfinite(finished[lane]), finished[lane], np.nan)
    band = 2 * error[lane]
    ax.axhline(0, color=BLACK, linewidth=0.8)
    if "strobe" in sweep:
        threshold = {"color": VERMILION, "linewidth": 0.8, "linestyle": "--"}
        ax.axhline(CHAOS_THRESHOLD, **threshold, label=f"chaotic above {CHAOS_THRESHOLD}")
    ax.plot(np.repeat(rpm, largest.shape[1]), largest.ravel(), **dots(GREY, 3), label="each start")
    shade = {"color": SKY, "alpha": 0.5, "linewidth": 0, "label": "±2 standard errors"}
    ax.fill_between(rpm, top - band, top + band, **shade)
    ax.plot(rpm, top, color=BLUE, linewidth=0.9, label="largest of the starts")
    ax.set(xlim=speed_limits(sweep), ylim=_exponent_limits(largest, top, band))
    ax.set_ylabel("largest exponent\nper revolution " + quantity("largest_exponent").symbol)
    return label_speed(ax, sweep)


def _exponent_limits(values: np.ndarray, top: np.ndarray, band: np.ndarray) -> Span:
    """Limits that include every exponent and bar above zero, or the line of the largest exponents where all are
    negative."""
    finite = values[np.isfinite(values)]
    seen = (top + band)[np.isfinite(top + band)]
    if finite.size == 0:
        return -0.05, 0.1
    high = max(0.1, 1.15 * float(finite.max()), 1.05 * float(seen.max(initial=0.0)))
    calm = float(np.nanmin(top)) if float(finite.max()) <= 0 else 0.0
    return max(min(1.15 * float(finite.min()), -0.05), min(1.15 * calm, -high)), high


def quantity_over_speed(sweep: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """A reported quantity over speed, a line for each initial state, with bars of one standard error."""
    ax = axes_or_new(ax, 6.0, 3.2)
    label, times = labelled(sweep[name])
    values, error = times * sweep[name].values, times * scatter(sweep[f"{name}_blocks"].values, axis=-1)
    for i, colour in zip(range(values.shape[1]), cycle(LINE_COLOURS), strict=False):
        style: Any = dict(color=colour, linewidth=0.9, marker=".", markersize=5, elinewidth=0.7, label=f"start {i + 1}")
        ax.errorbar(sweep["rpm"].values, values[:, i], np.nan_to_num(error[:, i]), **style)
    ax.set(ylabel=label, xlim=speed_limits(sweep))
    return label_speed(ax, sweep)


def sweep_figure(
    sweep: xr.Dataset,
    zones: Zones | Sequence[Stretch] | None = None,
    published: PublishedCase | None = None,
    title: str = "",
    component: int = 1,
) -> Figure:
    """All that a sweep recorded: strobe states if there are any, quantities that the model reports, exponents.

    **Arguments:** sweep; zones or stretches, which are shaded; the published case, whose edges are marked; title;
    component of the state in the orbit diagram.
    """
    draw: list[Callable[[Axes], Axes]] = []
    if "strobe" in sweep:
        draw.append(lambda ax: orbit_diagram(sweep, component, ax))
    draw += [lambda ax, name=name: quantity_over_speed(sweep, name, ax) for name in reported(sweep, SWEPT)]
    if sweep.sizes["exponent"]:
        draw.append(lambda ax: exponent_strip(sweep, ax))
    columns = 2 if len(draw) > 3 else 1
    rows = math.ceil(len(draw) / columns)
    figure = new_figure(9.5 if columns == 1 else 11.5, 1.6 + 2.4 * rows)
    heights = (2.6, *[1.0] * (rows - 1)) if "strobe" in sweep else [1.0] * rows
    cells = figure.subplots(rows, columns, sharex=True, squeeze=False, height_ratios=heights)
    axes = [panel(ax) for panel, ax in zip(draw, cells.ravel(), strict=False)]
    for ax in cells.ravel()[len(draw) :]:
        ax.set_axis_off()
    for ax in axes[:-columns]:
        ax.set_xlabel("")
    for ax in axes:
        if zones is not None:
            shade_zones(ax, zones)
        if published is not None:
            mark_published(ax, published, text=ax is axes[0])
    legend_below(figure, *axes)
    axes[0].set_title(title, loc="left", fontsize=11, pad=18 if published is not None else 8)
    return add_shaft_axes(figure, sweep)


def sweeps_beside(names: Sequence[str], sweeps: Sequence[xr.Dataset], zones: Sequence[Zones] | None = None) -> Figure:
    """Designs beside each other on one scale: orbit diagrams with exponents beneath, or what whole bearings report.

    **Arguments:** names; sweeps; zones of each sweep, which are shaded.
    """
    if any("strobe" not in sweep for sweep in sweeps):
        return quantities_beside(names, sweeps, [*reported(sweeps[0], COMPARED), "exponent"])
    figure = new_figure(12.0, 6.4)
    cells = figure.subplots(2, len(sweeps), sharex="col", sharey="row", squeeze=False, height_ratios=(2.0, 1.0))
    draw_beside(cells, names, sweeps, zones)
    return figure


def draw_beside(
    cells: np.ndarray, names: Sequence[str], sweeps: Sequence[xr.Dataset], zones: Sequence[Zones] | None = None
) -> None:
    """Draw the orbit diagram and the exponents of each design in a column of two axes, with one legend."""
    limits = []
    for column, (name, sweep) in enumerate(zip(names, sweeps, strict=True)):
        above, below = cells[:, column]
        orbit_diagram(sweep, 1, above).set(xlabel="")
        exponent_strip(sweep, below)
        limits.append((above.get_ylim(), below.get_ylim()))  # axes that share them show the last ones
        above.set_title(name, loc="left", fontsize=10)
        for ax in (above, below):
            if zones is not None:
                shade_zones(ax, zones[column])
            if column:
                ax.set_ylabel("")
    figure = cells[0, 0].figure
    for row, ends in zip(cells, zip(*limits, strict=True), strict=True):
        for ax in row:
            ax.set_ylim(min(low for low, _ in ends), max(high for _, high in ends))
    for ax, sweep in zip(cells[1], sweeps, strict=True):
        add_shaft_axes(figure, sweep, [ax])
    legend_below(figure, *cells.ravel())


def _lines(ax: Axes, name: str, sweeps: dict[str, xr.Dataset]) -> None:
    """A line for each sweep: means of a variable over the initial states, with standard errors."""
    for (text, sweep), colour in zip(sweeps.items(), cycle(BESIDE_COLOURS), strict=False):
        label, times = labelled(sweep["exponents" if name == "exponent" else name])
        mean, error = (times * x for x in mean_over_starts(sweep, name))
        style: Any = dict(color=colour, linewidth=1.1, marker=".", elinewidth=0.8, label=text)
        dress(ax).errorbar(sweep["rpm"].values, mean, np.nan_to_num(error), **style)
        ax.set_ylabel(label)


def quantities_beside(names: Sequence[str], sweeps: Sequence[xr.Dataset], quantities: Sequence[str]) -> Figure:
    """Variables of several sweeps over speed, with a line for each design."""
    columns = 2 if len(quantities) > 3 else 1
    rows = math.ceil(len(quantities) / columns)
    figure = new_figure(9.5 if columns == 1 else 11.5, 1.2 + 2.4 * rows)
    cells = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for ax, name in zip(cells.ravel(), quantities, strict=False):
        _lines(ax, name, dict(zip(names, sweeps, strict=True)))
    for ax in cells[-1]:
        label_speed(ax, sweeps[0])
    legend_below(figure, cells[0, 0])
    return add_shaft_axes(figure, sweeps[0])


def ramp_figure(
    up: xr.Dataset, down: xr.Dataset, quantities: Sequence[str], stretches: Sequence[Span] = (), title: str = ""
) -> Figure:
    """Variables over speed as it rises and as it falls; stretches of speed [rpm] in which they differ are shaded."""
    figure = new_figure(9.5, 1.4 + 2.3 * len(quantities))
    cells = figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0]
    rpm = up["rpm"].values
    half = 0.5 * float(rpm[1] - rpm[0]) if rpm.size > 1 else 0.0
    for ax, name in zip(cells, quantities, strict=True):
        _lines(ax, name, {"run-up": up, "run-down": down})
        for i, (low, high) in enumerate(stretches):
            label = "differs: hysteresis" if i == 0 else "_differs"
            ax.axvspan(low - half, high + half, color=ZONE, linewidth=0, zorder=0, label=label)
    label_speed(cells[-1], up)
    legend_below(figure, *cells, ncols=4)
    return add_shaft_axes(entitled(figure, title), up)
