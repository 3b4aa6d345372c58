"""Figures of designs: elasticities of edges and statistics, the search for a better design, chances of chaos."""

from collections.abc import Sequence
from functools import partial
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .._errors import ArgumentError
from ..orbits import Sensitivity
from . import style
from .diagrams import label_speed
from .quantity_tables import head_of
from .slope_tables import FIRST
from .style import BLACK, BLUE, GREY, PURPLE, VERMILION, readable


if TYPE_CHECKING:
    from ..design import BeforeAfter, Design, Ensemble, MeanGradient, Optimum


EDGE_COLOURS = (BLUE, VERMILION, style.GREEN, PURPLE, style.ORANGE, style.SKY)
MOST = 12
"""Largest number of parameters in a figure."""
SURE = 0.05
"""Chances at most this far from 0 or 1 count as decided."""


def elasticity_bars(sensitivities: Sequence[Sensitivity], ax: Axes | None = None) -> Axes:
    """Bar chart of the elasticities of edges, or of widths, by the parameters that move any of them most.

    Guidance gap and eccentricity are on top; the others follow by their largest elasticity.

    **Arguments:** sensitivities, one colour each; axes.

    **Raises:** `ValueError` if there is no sensitivity.
    """
    if not sensitivities:
        raise ArgumentError("sensitivities", said="must hold at least one sensitivity, but it is empty.")
    names, count = _largest_first(sensitivities), len(sensitivities)
    ax = style.axes_or_new(ax, 9.0, 1.2 + len(names) * (0.1 + 0.125 * count))
    thick, place = 0.8 / count, np.arange(len(names))
    for i, (s, colour) in enumerate(zip(sensitivities, cycle(EDGE_COLOURS), strict=False)):
        value = np.array([s.elasticity.get(name, np.nan) for name in names])
        at = place + (i - (count - 1) / 2) * thick
        label = f"{s.name} ({s.value_rpm:.0f} rpm{'' if s.trusted else ', not trusted'})"
        bars = ax.barh(at, value, height=0.9 * thick, color=colour, linewidth=0, label=label)
        ax.bar_label(bars, fmt="{:+.2g}", padding=3, fontsize=6, color=BLACK)
    _named_rows(ax, [readable(name) for name in names])
    ax.use_sticky_edges = False  # bars would begin at the frame
    ax.margins(x=0.12)
    ax.set_xlabel("Elasticity: relative change of the speed over relative change of the parameter")
    style.legend_above(ax, ncols=min(count, 2))
    return ax


def _named_rows(ax: Axes, names: Sequence[str], size: float | int = 9) -> None:
    """Label horizontal bars, the first on top, and draw a line at zero."""
    ax.axvline(0, color=BLACK, linewidth=0.8)
    ax.set_yticks(np.arange(len(names)), names, fontsize=size)
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.set_ylim(len(names) - 0.5, -0.5)


def _largest_first(sensitivities: Sequence[Sensitivity]) -> list[str]:
    largest: dict[str, float] = {}
    for s in sensitivities:
        for name, value in s.elasticity.items():
            largest[name] = max(largest.get(name, 0.0), abs(value) if np.isfinite(value) else 0.0)
    first = [name for name in FIRST if name in largest]
    rest = sorted((n for n in largest if n not in FIRST and largest[n] > 0), key=lambda n: -largest[n])
    return [*first, *rest][:MOST]


def statistic_bars(found: "MeanGradient", title: str = "") -> Figure:
    """Bar charts of each nonzero statistic: elasticity by each direction, with bars of two standard errors."""
    shown = [each for each in found.statistics.values() if each.value]
    names = [readable(name).replace("+", ",\n") for name in shown[0].directions] if shown else []

    def bars(ax: Axes, each: Any, colour: str) -> None:
        _bars_with_errors(ax, names, each.elasticity, each.elasticity_error, [colour] * len(names))
        head = f"{readable(head_of(each.name, each.unit))}: {each.value:.3g}{f' {each.unit}' * (each.unit != '1')}"
        ax.set_title(f"{head}{'' if each.settled else ', not settled'}", fontsize=9, loc="left")
        ax.set_xlabel("Elasticity, with two standard errors", fontsize=9)

    draw = [partial(bars, each=each, colour=colour) for each, colour in zip(shown, cycle(EDGE_COLOURS), strict=False)]
    rows = max(1, -(-len(shown) // 2))
    return style.panels(draw, 2, (11.0, 1.0 + rows * (0.8 + 0.28 * len(names))), title, sharey=True)


def _bars_with_errors(
    ax: Axes, names: Sequence[str], values: np.ndarray, errors: np.ndarray, colours: Sequence[str]
) -> None:
    place = np.arange(len(values))
    ax.barh(place, values, height=0.7, color=colours, alpha=0.75, linewidth=0)
    ax.errorbar(values, place, xerr=2 * errors, fmt="none", ecolor=BLACK, elinewidth=1.1)
    _named_rows(ax, names, 8)


def optimum_figure(found: "Optimum", rows: Sequence["BeforeAfter"], title: str = "") -> Figure:
    """Figure of the progress of a search, and of the relative changes of all nonzero statistics with two standard
    errors, grey if within them."""
    shown = [row for row in rows if row.before]
    unit = next((f" [{row.unit}]" for row in rows if row.name == "objective" and row.unit != "1"), "")

    def search(ax: Axes) -> None:
        ax.plot(np.arange(1, len(found.history) + 1), np.minimum.accumulate(found.history), "o-", color=BLUE)
        ax.set(xlabel="Step", ylabel=f"Best objective so far{unit}")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))

    def changes(ax: Axes) -> None:
        change, error = (100 * np.array([getattr(r, n) / r.before for r in shown]) for n in ("change", "change_error"))
        names = [f"{readable(head_of(row.name, row.unit))}: {x:+.1f} %" for row, x in zip(shown, change, strict=True)]
        _bars_with_errors(ax, names, change, error, [BLUE if row.known else GREY for row in shown])
        ax.set_xlabel("Change [%], with two standard errors", fontsize=9)

    return style.panels([search, changes], 2, (11.0, 1.6 + 0.34 * len(shown)), title)


def chance_of_chaos(found: "Ensemble", ax: Axes | None = None) -> Axes:
    """Diagram of the chance of chaos at each speed alone, with 95 % bars."""
    ax = style.axes_or_new(ax, 9.0, 4.2)
    rpm, (chance, low, high) = found.rpm, found.chance_of_chaos.T
    groups = {
        "at most 5 % of the draws are chaotic": (chance <= SURE, BLUE),
        "more": ((chance > SURE) & (chance < 1 - SURE), PURPLE),
        "at least 95 %": (chance >= 1 - SURE, VERMILION),
    }
    bars = np.clip(np.array([chance - low, high - chance]), 0.0, 1.0)
    for label, (which, colour) in groups.items():
        if np.any(which):
            look = {"fmt": "o", "markersize": 4, "color": colour, "elinewidth": 1.1, "label": label}
            ax.errorbar(rpm[which], chance[which], yerr=bars[:, which], **look)
    for level in (SURE, 1 - SURE):
        ax.axhline(level, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
    pad = 0.01 * (rpm[-1] - rpm[0]) or 50.0
    ax.set(ylim=(-0.05, 1.05), xlim=(rpm[0] - pad, rpm[-1] + pad), ylabel="Chance of chaos at this speed")
    ax.set_yticks(np.linspace(0, 1, 6))
    style.legend_above(ax, 3)
    return label_speed(ax)


def calm_figure(found: "Design", operating: tuple[float, float], title: str = "") -> Figure:
    """Figure of the stable range before and after a search, the operating range, and the costs of the designs solved
    for.

    **Arguments:** the design; ends of the operating range of cage speed [rpm]; title.
    """

    def ranges(ax: Axes) -> None:
        ax.axvspan(*operating, color=style.ZONE, label="operating range")
        for row, values, colour in ((1, found.before, GREY), (0, found.after, BLUE)):
            if "lower margin" not in values:
                continue
            low, high = (
                end * (1 + sign * values[f"{name} margin"].value / 100)
                for end, sign, name in zip(operating, (-1, 1), ("lower", "upper"), strict=True)
            )
            ax.barh(row, high - low, left=low, height=0.5, color=colour, alpha=0.75)
            for edge in (low, high):
                ax.annotate(f"{edge:.0f}", (edge, row + 0.3), ha="center", fontsize=8)
        ax.set(yticks=[0, 1], yticklabels=["after", "before"], ylim=(-0.6, 1.8))
        ax.use_sticky_edges = False  # bars would end at the frame
        ax.margins(x=0.08)
        ax.set_title("Stable range of the synchronous orbit", fontsize=9, loc="left")
        label_speed(ax)

    def costs(ax: Axes) -> None:
        values = [step["cost"] for step in found.path]
        ax.plot(np.arange(1, len(values) + 1), values, "o-", color=BLUE, markersize=3)
        ax.set(xlabel="Designs solved for", ylabel="Cost")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))

    figure = style.panels([ranges, costs], 2, (11.0, 3.6), title, width_ratios=(1.6, 1.0))
    style.legend_below(figure)
    return figure
