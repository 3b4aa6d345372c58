"""What is laid over diagrams with a speed axis: zones found, edges published."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ..analysis import Zone, Zones
from ..bearing import PublishedCase
from ._style import BLACK, PURPLE, ZONE


Span = tuple[float, float]


def shade_zones(ax: Axes, zones: Zones) -> Axes:
    """Shade the chaotic zones; an open zone reaches to the end of the axis."""
    low, high = ax.get_xlim()
    for i, (first, last) in enumerate(spans_of(zones.zones, (low, high))):
        label = "chaotic zone" if i == 0 else "_chaotic zone"
        ax.axvspan(first, last, color=ZONE, linewidth=0, zorder=0, label=label)
    ax.set_xlim(low, high)
    return ax


def spans_of(zones: Sequence[Zone], limits: Span) -> list[Span]:
    """Ends of zones; an open one reaches to the limit."""
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
    """Mark the published edges inside the axis with dotted lines, and triangles with their speed
    above the frame.

    A triangle points into the zone: right at an onset, left at an exit.
    """
    low, high = ax.get_xlim()
    inside = {name: rpm for name, rpm in published_edges(published).items() if low <= rpm <= high}
    above = ax.get_xaxis_transform()
    for i, (name, rpm) in enumerate(inside.items()):
        ax.axvline(
            rpm,
            color=BLACK,
            linewidth=0.9,
            linestyle=(0, (1, 2)),
            label="published edge" if i == 0 else None,
        )
        if text:
            marker = "<" if name.endswith("exit") else ">"
            ax.plot(rpm, 1.0, marker, color=BLACK, markersize=5, transform=above, clip_on=False)
            ax.annotate(
                f"{rpm:.0f}",
                (rpm, 1.0),
                (0, 5),
                xycoords=above,
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=8,
            )
    return ax


def mark_operating(ax: Axes, spans: Sequence[tuple[float, float]]) -> Axes:
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
        foot = ax.get_xaxis_transform()
        ends = np.clip([middle - half, middle + half], low, high)
        ax.plot(ends, [0, 0], color=PURPLE, linewidth=5, transform=foot, clip_on=False)
    ax.set_xlim(low, high)
    return ax
