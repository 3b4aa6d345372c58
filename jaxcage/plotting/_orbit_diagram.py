"""Orbit diagram over speed, the exponents beneath it, and both as one figure."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from ..analysis import CHAOS_THRESHOLD, Sweep, Zones
from ..bearing import PublishedCase
from ..quantities import component_names, quantity
from ._marks import mark_published, shade_zones
from ._style import (
    BLACK,
    BLUE,
    GREY,
    KIND_COLOURS,
    SKY,
    VERMILION,
    axes_or_new,
    dots,
    enlarge_dots,
    new_figure,
    padded_limits,
)


def orbit_diagram(
    sweep: Sweep,
    component: int = 1,
    ax: Axes | None = None,
    *,
    limits_rpm: tuple[float, float] | None = None,
) -> Axes:
    """Strobe points over speed from all starts, coloured by what the lane does; failed lanes are
    crosses at the foot.

    **Arguments:** sweep; component of the state (1: vertical displacement); axes; range of speed
    for a zoomed diagram, whose vertical limits then fit the points in it.
    """
    ax = axes_or_new(ax)
    name = component_names(sweep.strobe.shape[-1])[component]
    low, high = _speed_limits(sweep) if limits_rpm is None else limits_rpm
    chosen = (sweep.rpm >= low) & (sweep.rpm <= high)
    points = sweep.strobe[chosen, :, :, component] * quantity(name).factor
    speeds = np.broadcast_to(sweep.rpm[chosen, None, None], points.shape)
    labels = sweep.label[chosen]
    kind = np.where(np.char.startswith(labels, "periodic"), "periodic", labels)  # all periods together
    size = 1.8 if np.sum(chosen) > 150 else 2.5
    for label, colour in KIND_COLOURS.items():
        lanes = kind == label
        if np.any(lanes):
            style = dots(colour, size) | {"alpha": 0.5, "rasterized": True}
            ax.plot(speeds[lanes].ravel(), points[lanes].ravel(), **style, label=label)
    _cross_failed(ax, sweep.rpm[chosen], np.any(sweep.failed[chosen], axis=1))
    ax.set(xlim=(low, high), ylim=padded_limits(points), ylabel=quantity(name).label)
    return label_speed(ax)


def _cross_failed(ax: Axes, rpm: np.ndarray, failed: np.ndarray) -> None:
    if np.any(failed):
        foot = np.full(int(np.sum(failed)), 0.015)
        ax.plot(
            rpm[failed],
            foot,
            "x",
            color=BLACK,
            markersize=4,
            transform=ax.get_xaxis_transform(),
            label="failed",
        )


def _speed_limits(sweep: Sweep) -> tuple[float, float]:
    if sweep.rpm.size == 1:
        return float(sweep.rpm[0]) - 50, float(sweep.rpm[0]) + 50
    return float(sweep.rpm[0]), float(sweep.rpm[-1])


def label_speed(ax: Axes) -> Axes:
    """Name the speed axis, in revolutions per minute."""
    ax.set_xlabel(quantity("speed_rpm").label)
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    return ax


def exponent_strip(sweep: Sweep, ax: Axes | None = None) -> Axes:
    """Largest Lyapunov exponent over speed: every start as points, the largest of them as a line
    with +-2 standard errors.

    The lower limit is cut where strongly attracting orbits would hide what happens around zero.
    """
    ax = axes_or_new(ax, height=2.5)
    largest, error = sweep.exponents[..., 0], sweep.standard_error[..., 0]
    finished = np.where(sweep.failed, -np.inf, largest)
    lane = (np.arange(sweep.rpm.size), np.argmax(finished, axis=1))
    top = np.where(np.isfinite(finished[lane]), finished[lane], np.nan)
    band = 2 * error[lane]
    ax.axhline(0, color=BLACK, linewidth=0.8)
    ax.axhline(
        CHAOS_THRESHOLD,
        color=VERMILION,
        linewidth=0.8,
        linestyle="--",
        label=f"chaotic above {CHAOS_THRESHOLD}",
    )
    every = np.repeat(sweep.rpm, largest.shape[1])
    ax.plot(every, largest.ravel(), **dots(GREY, 3), label="each start")
    ax.fill_between(
        sweep.rpm,
        top - band,
        top + band,
        color=SKY,
        alpha=0.5,
        linewidth=0,
        label="±2 standard errors",
    )
    ax.plot(sweep.rpm, top, color=BLUE, linewidth=0.9, label="largest of the starts")
    ax.set(
        xlim=_speed_limits(sweep),
        ylim=_exponent_limits(largest, top, band),
        ylabel=quantity("largest_exponent").symbol,
    )
    return label_speed(ax)


def _exponent_limits(values: np.ndarray, top: np.ndarray, band: np.ndarray) -> tuple[float, float]:
    """Every exponent and bar above zero is seen; of a bearing that is calm all over, the line of its largest ones."""
    finite = values[np.isfinite(values)]
    seen = (top + band)[np.isfinite(top + band)]
    if finite.size == 0:
        return -0.05, 0.1
    high = max(0.1, 1.15 * float(finite.max()), 1.05 * float(seen.max(initial=0.0)))
    calm = float(np.nanmin(top)) if float(finite.max()) <= 0 else 0.0
    return max(min(1.15 * float(finite.min()), -0.05), min(1.15 * calm, -high)), high


def sweep_figure(
    sweep: Sweep,
    zones: Zones,
    published: PublishedCase | None = None,
    title: str = "",
    component: int = 1,
) -> Figure:
    """Orbit diagram with the exponents beneath it, zones shaded, published edges marked."""
    figure = new_figure(9.5, 6.4)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1))
    orbit_diagram(sweep, component, above)
    exponent_strip(sweep, below)
    for ax in (above, below):
        shade_zones(ax, zones)
        if published is not None:
            mark_published(ax, published, text=ax is above)
    above.set_xlabel("")
    below.set_ylabel("largest exponent\nper revolution " + quantity("largest_exponent").symbol)
    legend_below(figure, above, below)
    above.set_title(title, loc="left", fontsize=11, pad=18 if published is not None else 8)
    return figure


def legend_below(figure: Figure, *axes: Axes, ncols: int = 5) -> None:
    """One legend for all axes beneath them, where it hides no point."""
    entries = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    place = "outside lower center"
    enlarge_dots(figure.legend(entries.values(), entries.keys(), loc=place, ncols=ncols, frameon=False, fontsize=9))


def zoomed_diagram(sweep: Sweep, first_rpm: float, last_rpm: float, component: int = 1, ax: Axes | None = None) -> Axes:
    """The orbit diagram between two speeds, its vertical limits fitted to them."""
    return orbit_diagram(sweep, component, ax, limits_rpm=(first_rpm, last_rpm))
