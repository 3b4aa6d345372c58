"""Diagrams of one or several sweeps over speed: orbits, exponents, quantities; speed axes and marks on them.

All read units and coordinates from the data set of a sweep, whatever model was swept.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter
from matplotlib.transforms import offset_copy

from ..analysis import CHAOS_THRESHOLD, Stretch, Zones, failed
from ..bearing import PublishedCase
from ..quantities import quantity
from . import style
from .quantity_tables import column_of, mean_over_starts
from .verdict_tables import motion_words
from .zone_tables import zone_span


Span = tuple[float, float]
"""Lowest and highest speed [rpm]."""
CAGE, SHAFT = "Cage speed $n$ [rpm]", "Shaft speed [rpm]"
BELOW = 36.0
"""Distance of the second speed axis below the first [points]."""
SWEPT = ("cage_slip", "pocket_force_mean_sum_N", "pocket_force_max_N", "friction_power_W", "synchronous_force_x_N")
"""Quantities of a whole bearing in the figure of a sweep."""
BESIDE_COLOURS = (style.BLUE, style.VERMILION, *style.LINE_COLOURS[1:4])
"""Colours of designs in a comparison."""


def label_speed(ax: Axes, speed: xr.Dataset | str = "cage speed") -> Axes:
    """Label the speed axis in rpm, by the speed of a sweep or by a model's words for it."""
    text = speed if isinstance(speed, str) else speed["rpm"].attrs.get("long_name", "speed")
    names = {"cage speed": CAGE, "shaft speed": SHAFT}
    ax.set_xlabel(names.get(text, f"{text[:1].upper()}{text[1:]} [rpm]"))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    return ax


def speed_limits(sweep: xr.Dataset) -> Span:
    """First and last speed [rpm] of a sweep; ±50 rpm around a single one."""
    first, last = float(sweep["rpm"][0]), float(sweep["rpm"][-1])
    return (first, last) if last > first else (first - 50, first + 50)


def add_shaft_axes(figure: Figure, speeds: xr.Dataset | float) -> Figure:
    """Add an axis of the shaft speed below every axis of the cage speed.

    **Arguments:** figure; a sweep, whose coordinates include both speeds, or the cage speed over the shaft speed.

    **Returns:** the same figure. A sweep over another speed, and axes that have their second axis, stay as they are.
    """
    if isinstance(speeds, xr.Dataset):
        if "shaft_rpm" not in speeds.coords:
            return figure
        speeds = float(speeds["rpm"][-1] / speeds["shaft_rpm"][-1])
    for ax in figure.axes:
        if ax.get_xlabel() == CAGE and not any(child.get_xlabel() == SHAFT for child in ax.child_axes):
            _add_below(ax, speeds)
    return figure


def _add_below(ax: Axes, ratio: float) -> None:
    beneath = offset_copy(ax.transAxes, ax.figure, y=-BELOW, units="points")  # pyright: ignore
    both = (lambda x: np.asarray(x) / ratio, lambda x: np.asarray(x) * ratio)
    shaft = ax.secondary_xaxis(0.0, functions=both, transform=beneath)
    shaft.set_xlabel(SHAFT)
    shaft.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    shaft.tick_params(color=style.GREY, labelsize=9)
    shaft.spines["bottom"].set(color=style.GREY, linewidth=0.8)


def shade_zones(ax: Axes, zones: Zones | Sequence[Stretch]) -> Axes:
    """Shade chaotic zones, an open one to the end of the axis; or speed ranges by the motion of the cage."""
    low, high = ax.get_xlim()
    if isinstance(zones, Zones):
        shaded = [("chaotic zone", style.ZONE, 1.0, zone_span(zone, low, high)) for zone in zones.zones]
    else:
        colour_of = lambda labels: style.MOTION_COLOURS.get("".join(labels), style.GREY)
        shaded = [(motion_words(s.labels), colour_of(s.labels), 0.1, (s.low_rpm, s.high_rpm)) for s in zones]
    drawn: set[str] = set()
    for label, colour, alpha, (first, last) in shaded:
        name = f"_{label}" if label in drawn else label
        ax.axvspan(first, last, color=colour, alpha=alpha, linewidth=0, zorder=0, label=name)
        drawn.add(label)
    ax.set_xlim(low, high)
    return ax


def published_edges(published: PublishedCase) -> dict[str, float]:
    """Published edges of a case [rpm] by name."""
    names = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
    return {name: getattr(published, f"{name.replace(' ', '_')}_rpm") for name in names}


def mark_published(ax: Axes, published: PublishedCase, text: bool = True) -> Axes:
    """Mark published edges inside the axis with dotted lines, and triangles with their speed above the frame, which
    point into the zone: right at an onset, left at an exit."""
    low, high = ax.get_xlim()
    inside = {name: rpm for name, rpm in published_edges(published).items() if low <= rpm <= high}
    above = ax.get_xaxis_transform()
    for i, (name, rpm) in enumerate(inside.items()):
        label = "published edge" if i == 0 else None
        ax.axvline(rpm, color=style.BLACK, linewidth=0.9, linestyle=(0, (1, 2)), label=label)
        if text:
            marker = "<" if name.endswith("exit") else ">"
            ax.plot(rpm, 1.0, marker, color=style.BLACK, markersize=5, transform=above, clip_on=False)
            look = {"textcoords": "offset points", "ha": "center", "va": "bottom", "fontsize": 8}
            ax.annotate(f"{rpm:.0f}", (rpm, 1.0), (0, 5), xycoords=above, **look)
    return ax


def mark_operating(ax: Axes, first: float, last: float) -> None:
    """Mark the ends of an operating range [rpm] by dashed lines."""
    limits = ax.get_xlim()
    for edge in (first, last):
        ax.axvline(edge, color=style.BLACK, linewidth=0.9, linestyle=(0, (6, 2)), zorder=2)
    ax.set_xlim(limits)


def reported(sweep: xr.Dataset, wanted: Sequence[str]) -> list[str]:
    """Wanted quantities that the swept model reports; the first six quantities if it reports none of them."""
    every = [str(name).removesuffix("_blocks") for name in sweep.data_vars if str(name).endswith("_blocks")]
    return [name for name in wanted if name in every] or every[:6]


def orbit_diagram(sweep: xr.Dataset, component: int = 1, ax: Axes | None = None) -> Axes:
    """Orbit diagram: strobe states over speed from all initial states, coloured by label; failed lanes are crosses at
    the bottom.

    **Arguments:** sweep; component of the state (1: vertical displacement of a cage); axes.
    """
    ax = style.axes_or_new(ax)
    named = quantity(str(sweep["component"].values[component]))
    points, rpm = sweep["strobe"].values[..., component] * named.factor, sweep["rpm"].values
    speeds, labels = np.broadcast_to(rpm[:, None, None], points.shape), sweep["label"].values.astype(str)
    kind = np.where(np.char.startswith(labels, "periodic"), "periodic", labels)  # all periods together
    size = 1.8 if rpm.size > 150 else 2.5
    for label, colour in style.KIND_COLOURS.items():
        lanes = kind == label
        if np.any(lanes):
            look = style.dots(colour, size) | {"alpha": 0.5, "rasterized": True}
            ax.plot(speeds[lanes].ravel(), points[lanes].ravel(), **look, label=label)
    lost = rpm[np.any(failed(sweep), axis=1)]
    if lost.size:
        foot = {"color": style.BLACK, "markersize": 4, "transform": ax.get_xaxis_transform()}
        ax.plot(lost, np.full(lost.size, 0.015), "x", **foot, label="failed")
    ax.set(xlim=speed_limits(sweep), ylim=style.padded_limits(points), ylabel=named.label)
    return label_speed(ax, sweep)


def exponent_strip(sweep: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Largest Lyapunov exponent over speed: points for every initial state, a line for the largest of them with ±2
    standard errors. The lower limit is cut where strongly attracting orbits would hide the range around zero."""
    ax = style.axes_or_new(ax, height=2.5)
    rpm = sweep["rpm"].values
    largest, error = sweep["exponents"].values[..., 0], sweep["standard_error"].values[..., 0]
    finished = np.where(failed(sweep), -np.inf, largest)
    lane = (np.arange(rpm.size), np.argmax(finished, axis=1))
    top = np.where(np.isfinite(finished[lane]), finished[lane], np.nan)
    band = 2 * error[lane]
    ax.axhline(0, color=style.BLACK, linewidth=0.8)
    if "strobe" in sweep:
        threshold = {"color": style.VERMILION, "linewidth": 0.8, "linestyle": "--"}
        ax.axhline(CHAOS_THRESHOLD, **threshold, label=f"chaotic above {CHAOS_THRESHOLD}")
    ax.plot(np.repeat(rpm, largest.shape[1]), largest.ravel(), **style.dots(style.GREY, 3), label="each initial state")
    shade = {"color": style.SKY, "alpha": 0.5, "linewidth": 0, "label": "±2 standard errors"}
    ax.fill_between(rpm, top - band, top + band, **shade)
    ax.plot(rpm, top, color=style.BLUE, linewidth=0.9, label="largest of the initial states")
    ax.set(xlim=speed_limits(sweep), ylim=_exponent_limits(largest, top, band))
    ax.set_ylabel("Largest exponent\nper revolution " + quantity("largest_exponent").symbol)
    return label_speed(ax, sweep)


def _exponent_limits(values: np.ndarray, top: np.ndarray, band: np.ndarray) -> Span:
    """Axis limits that include every exponent above zero, or the largest exponents if all are negative."""
    if not np.any(np.isfinite(values)):
        return -0.05, 0.1
    least, most = float(np.nanmin(values)), float(np.nanmax(values))
    high = max(0.1, 1.15 * most, 1.05 * float(np.nanmax(top + band)))
    calm = float(np.nanmin(top)) if most <= 0 else 0.0
    return max(min(1.15 * least, -0.05), min(1.15 * calm, -high)), high


def _lines(ax: Axes, name: str, sweeps: dict[str, xr.Dataset]) -> Axes:
    """Draw a line over speed for each sweep: means of a variable over the initial states, with standard errors."""
    for (text, sweep), colour in zip(sweeps.items(), cycle(BESIDE_COLOURS), strict=False):
        column = column_of(sweep, name)
        mean, error = (column.scale * x for x in mean_over_starts(sweep, name))
        look: Any = dict(color=colour, linewidth=1.1, marker=".", elinewidth=0.8, label=text)
        ax.errorbar(sweep["rpm"].values, mean, np.nan_to_num(error), **look)
        ax.set_ylabel(column.label)
        label_speed(ax, sweep)
    return ax


def _over_speed(draw: Sequence[Callable[[Axes], Axes]], title: str = "", first: float = 1.0) -> Figure:
    """Figure of diagrams over one axis of speed; `first` is the relative height of the first row."""
    columns = 2 if len(draw) > 3 else 1
    rows = -(-len(draw) // columns)
    size, heights = (9.5 if columns == 1 else 11.5, 1.6 + 2.4 * rows), (first, *[1.0] * (rows - 1))
    return style.panels(draw, columns, size, title, sharex=True, height_ratios=heights)


def sweep_figure(
    sweep: xr.Dataset,
    zones: Zones | Sequence[Stretch],
    published: PublishedCase | None = None,
    title: str = "",
) -> Figure:
    """Figure of a sweep: strobe states if there are any, quantities that the model reports, exponents.

    **Arguments:** sweep; zones or stretches, which are shaded; the published case, whose edges are marked; title.
    """
    strobe, mean = "strobe" in sweep, {"mean over initial states": sweep}
    draw: list[Callable[[Axes], Axes]] = [lambda ax: orbit_diagram(sweep, 1, ax)] if strobe else []
    draw += [partial(_lines, name=name, sweeps=mean) for name in reported(sweep, SWEPT)]
    draw += [lambda ax: exponent_strip(sweep, ax)] if sweep.sizes["exponent"] else []
    figure = _over_speed(draw, title, 2.6 if strobe else 1.0)
    for ax in figure.axes:
        shade_zones(ax, zones)
        if published is not None:
            mark_published(ax, published, text=ax is figure.axes[0])
    style.legend_below(figure)
    return add_shaft_axes(figure, sweep)


def quantities_beside(
    names: Sequence[str],
    sweeps: Sequence[xr.Dataset],
    quantities: Sequence[str],
    differ: Sequence[Span] = (),
    title: str = "",
) -> Figure:
    """Figure of variables of several sweeps, or ramps, over speed; ranges [rpm] in which they differ are shaded."""
    lines = dict(zip(names, sweeps, strict=True))
    figure = _over_speed([partial(_lines, name=name, sweeps=lines) for name in quantities], title)
    rpm = sweeps[0]["rpm"].values
    half = 0.5 * float(rpm[1] - rpm[0]) if rpm.size > 1 else 0.0
    for ax in figure.axes:
        for i, (low, high) in enumerate(differ):
            label = "_differs" if i else "differs: hysteresis"
            ax.axvspan(low - half, high + half, color=style.ZONE, linewidth=0, zorder=0, label=label)
    style.legend_below(figure)
    return add_shaft_axes(figure, sweeps[0])
