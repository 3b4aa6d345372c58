"""Zones of both kinds, published zones and operating speeds as bars over one speed axis."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from ..analysis import Zone
from ..bearing import PublishedCase
from ._marks import Span, spans_of
from ._orbit_diagram import label_speed
from ._style import BLUE, GREY, PURPLE, VERMILION, axes_or_new


def zone_strip(
    loss: Sequence[Zone],
    chaotic: Sequence[Zone],
    limits_rpm: Span,
    operating: Sequence[Span] = (),
    published: PublishedCase | None = None,
    ax: Axes | None = None,
) -> Axes:
    """One row of bars for each kind of zone, over what was swept; operating speeds on top, with lines through all rows.

    **Arguments:** synchronous-loss and chaotic zones; ends of the sweep, operating speeds and ranges [rpm]; what is
    published; axes. An open zone reaches to the end of the axis.
    """
    rows: list[tuple[str, str, list[Span]]] = []
    if operating:
        rows.append(("operating", PURPLE, list(operating)))
    rows += [
        ("synchronous loss", BLUE, spans_of(loss, limits_rpm)),
        ("chaotic", VERMILION, spans_of(chaotic, limits_rpm)),
    ]
    if published is not None:
        ends = [(published.zone_1_onset_rpm, published.zone_1_exit_rpm), (published.zone_2_onset_rpm, limits_rpm[1])]
        rows.append(("published", GREY, [(a, b) for a, b in ends if b > a]))
    ax = axes_or_new(ax, 9.5, 0.9 + 0.42 * len(rows))
    low, high = limits_rpm
    least = 0.003 * (high - low)  # a single speed must be seen
    for i, (_, colour, spans) in enumerate(rows):
        ax.barh(i, high - low, left=low, height=0.62, color=GREY, alpha=0.13, linewidth=0)
        for first, last in spans:
            width = max(last - first, least)
            ax.barh(i, width, left=(first + last - width) / 2, height=0.62, color=colour, linewidth=0)
    for first, last in operating:
        for edge in {first, last}:
            ax.axvline(edge, color=PURPLE, linewidth=1.0, linestyle=(0, (5, 2)), zorder=3)
    ax.set(xlim=limits_rpm, ylim=(len(rows) - 0.5, -0.5))
    ax.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.spines[["left"]].set_visible(False)
    return label_speed(ax)
