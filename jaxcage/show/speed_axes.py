"""Axes of speed: their names, the other speed beneath, zones, published edges and operating speeds; strips of zones."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter
from matplotlib.transforms import offset_copy

from ..analysis import Stretch, Zone, Zones
from ..bearing import PublishedCase
from .style import BLACK, BLUE, GREY, MOTION_COLOURS, PURPLE, VERMILION, ZONE, axes_or_new


Span = tuple[float, float]
"""Lowest and highest speed [rpm]."""
CAGE, SHAFT = "Cage speed $n$ [rpm]", "Shaft speed [rpm]"
BELOW = 36.0
"""Distance of the axis of the other speed from that of the speed [points]."""


def label_speed(ax: Axes, sweep: xr.Dataset | None = None) -> Axes:
    """Name the speed axis in revolutions per minute: the speed of a sweep, or that of a cage."""
    text = "cage speed" if sweep is None else sweep["rpm"].attrs.get("long_name", "speed")
    names = {"cage speed": CAGE, "shaft speed": SHAFT}
    ax.set_xlabel(names.get(text, f"{text[:1].upper()}{text[1:]} [rpm]"))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    return ax


def speed_limits(sweep: xr.Dataset) -> Span:
    """First and last speed [rpm] of a sweep; 50 rpm around a single one."""
    first, last = float(sweep["rpm"][0]), float(sweep["rpm"][-1])
    return (first, last) if last > first else (first - 50, first + 50)


def add_shaft_axes(figure: Figure, speeds: xr.Dataset | float, axes: Sequence[Axes] | None = None) -> Figure:
    """Add a second axis beneath every axis of the cage speed, for the speed of the shaft.

    **Arguments:** figure; a sweep, whose coordinates include both speeds, or the cage speed over the shaft speed; axes
    of the figure, by default all.

    **Returns:** the same figure. A sweep over another speed, and axes that have their second axis, stay as they are.
    """
    if isinstance(speeds, xr.Dataset):
        if "shaft_rpm" not in speeds.coords:
            return figure
        cage, shaft = speeds["rpm"].values, speeds["shaft_rpm"].values
        ratio = float(cage[-1] / shaft[-1])
    else:
        ratio = speeds
    for ax in figure.axes if axes is None else axes:
        if ax.get_xlabel() == CAGE and not any(child.get_xlabel() == SHAFT for child in ax.child_axes):
            _add_below(ax, ratio)
    return figure


def _add_below(ax: Axes, ratio: float) -> None:
    move = lambda points: offset_copy(ax.transAxes, ax.figure, y=-points, units="points")  # pyright: ignore
    shaft = ax.secondary_xaxis(
        0.0, functions=(lambda x: np.asarray(x) / ratio, lambda x: np.asarray(x) * ratio), transform=move(BELOW)
    )
    shaft.set_xlabel(SHAFT)
    shaft.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    shaft.tick_params(color=GREY, labelsize=9)
    shaft.spines["bottom"].set(color=GREY, linewidth=0.8)
    legend = ax.get_legend()
    if legend is not None and legend.get_bbox_to_anchor().y1 < ax.get_window_extent().y0:  # it was beneath already
        legend.set_loc("upper center")
        legend.set_bbox_to_anchor((0.5, 0.0), transform=move(2 * BELOW))


def shade_zones(ax: Axes, zones: Zones | Sequence[Stretch]) -> Axes:
    """Shade the chaotic zones, an open one to the end of the axis; or stretches of speed by the motion of the cage."""
    low, high = ax.get_xlim()
    if isinstance(zones, Zones):
        shaded = [("chaotic zone", ZONE, 1.0, span) for span in spans_of(zones.zones, (low, high))]
    else:
        shaded = [
            (" or ".join(s.labels).replace("_", " "), motion_colour(s.labels), 0.1, (s.low_rpm, s.high_rpm))
            for s in zones
        ]
    drawn: set[str] = set()
    for label, colour, alpha, (first, last) in shaded:
        name = f"_{label}" if label in drawn else label
        ax.axvspan(first, last, color=colour, alpha=alpha, linewidth=0, zorder=0, label=name)
        drawn.add(label)
    ax.set_xlim(low, high)
    return ax


def motion_colour(labels: Sequence[str]) -> str:
    """Colour of a speed at which the lanes have these labels; grey where they differ."""
    return MOTION_COLOURS.get(labels[0], GREY) if len(labels) == 1 else GREY


def spans_of(zones: Sequence[Zone], limits: Span) -> list[Span]:
    """Ends of zones [rpm]; an open zone reaches to the limit."""
    return [
        (limits[0] if z.onset is None else z.onset.speed_rpm, limits[1] if z.exit is None else z.exit.speed_rpm)
        for z in zones
    ]


def published_edges(published: PublishedCase) -> dict[str, float]:
    """The published edges of a case [rpm] by name."""
    return {
        "zone 1 onset": published.zone_1_onset_rpm,
        "zone 1 exit": published.zone_1_exit_rpm,
        "zone 2 onset": published.zone_2_onset_rpm,
    }


def mark_published(ax: Axes, published: PublishedCase, text: bool = True) -> Axes:
    """Mark the published edges inside the axis with dotted lines, and triangles with their speed above the frame.

    A triangle points into the zone: right at an onset, left at an exit.
    """
    low, high = ax.get_xlim()
    inside = {name: rpm for name, rpm in published_edges(published).items() if low <= rpm <= high}
    above = ax.get_xaxis_transform()
    for i, (name, rpm) in enumerate(inside.items()):
        label = "published edge" if i == 0 else None
        ax.axvline(rpm, color=BLACK, linewidth=0.9, linestyle=(0, (1, 2)), label=label)
        if text:
            marker = "<" if name.endswith("exit") else ">"
            ax.plot(rpm, 1.0, marker, color=BLACK, markersize=5, transform=above, clip_on=False)
            style = {"textcoords": "offset points", "ha": "center", "va": "bottom", "fontsize": 8}
            ax.annotate(f"{rpm:.0f}", (rpm, 1.0), (0, 5), xycoords=above, **style)
    return ax


def mark_operating(ax: Axes, spans: Sequence[Span]) -> Axes:
    """Mark operating speeds [rpm]: a line for a speed, a light band for a range, both with a bar at the foot."""
    low, high = ax.get_xlim()
    for i, (first, last) in enumerate(span for span in spans if span[1] >= low and span[0] <= high):
        label = "operating speed" if i == 0 else "_operating speed"
        for edge in {first, last}:
            ax.axvline(edge, color=PURPLE, linewidth=1.1, linestyle=(0, (6, 2)), zorder=2, label=label)
            label = "_operating speed"
        if last > first:
            ax.axvspan(first, last, color=PURPLE, alpha=0.12, linewidth=0, zorder=0.5)
        middle, half = (first + last) / 2, max(last - first, 0.004 * (high - low)) / 2
        ends = np.clip([middle - half, middle + half], low, high)
        ax.plot(ends, [0, 0], color=PURPLE, linewidth=5, transform=ax.get_xaxis_transform(), clip_on=False)
    ax.set_xlim(low, high)
    return ax


def zone_strip(
    loss: Sequence[Zone],
    chaotic: Sequence[Zone],
    limits_rpm: Span,
    operating: Sequence[Span] = (),
    published: PublishedCase | None = None,
    ax: Axes | None = None,
) -> Axes:
    """One row of bars for each kind of zone; operating speeds in a row on top, with lines through all rows.

    **Arguments:** synchronous-loss and chaotic zones; ends of the sweep, operating speeds and ranges [rpm]; the
    published case; axes. An open zone reaches to the end of the axis.
    """
    rows: list[tuple[str, str, Sequence[Span]]] = [("operating", PURPLE, operating)] if operating else []
    rows.append(("synchronous loss", BLUE, spans_of(loss, limits_rpm)))
    rows.append(("chaotic", VERMILION, spans_of(chaotic, limits_rpm)))
    if published is not None:
        ends = [(published.zone_1_onset_rpm, published.zone_1_exit_rpm), (published.zone_2_onset_rpm, limits_rpm[1])]
        rows.append(("published", GREY, [(a, b) for a, b in ends if b > a]))
    ax = axes_or_new(ax, 9.5, 0.9 + 0.42 * len(rows))
    low, high = limits_rpm
    least = 0.003 * (high - low)  # a single speed must be visible
    for i, (_, colour, spans) in enumerate(rows):
        ax.barh(i, high - low, left=low, height=0.62, color=GREY, alpha=0.13, linewidth=0)
        for first, last in spans:
            width = max(last - first, least)
            ax.barh(i, width, left=(first + last - width) / 2, height=0.62, color=colour, linewidth=0)
    for edge in {edge for span in operating for edge in span}:
        ax.axvline(edge, color=PURPLE, linewidth=1.0, linestyle=(0, (5, 2)), zorder=3)
    ax.set(xlim=limits_rpm, ylim=(len(rows) - 0.5, -0.5))
    ax.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.spines[["left"]].set_visible(False)
    return label_speed(ax)
