"""Designs: elasticities of edges and statistics, the search for a better design, chances of chaos."""

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._errors import ArgumentError
from ..orbits import Sensitivity
from .diagrams import label_speed
from .style import (
    BAND,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    ZONE,
    axes_or_new,
    dress,
    entitled,
    legend_above,
    legend_below,
    new_figure,
    readable,
)


if TYPE_CHECKING:
    from ..design import BeforeAfter, Design, MeanGradient, Optimum


FIRST = ("guidance_gap", "eccentricity")
"""Parameters that are always on top."""
EDGE_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
RPM = 30 / np.pi
SURE = 0.05
"""Chances at most this far from 0 or 1 count as decided."""


def elasticity_bars(sensitivities: Sequence[Sensitivity], ax: Axes | None = None, most: int = 12) -> Axes:
    """Elasticities of edges, or of widths, with respect to the parameters that move any of them most.

    Guidance gap and eccentricity are on top; the others follow by their largest elasticity. Bars of a sensitivity that
    is not to be trusted are hatched.

    **Arguments:** sensitivities, one colour each; axes; number of parameters.

    **Raises:** `ValueError` if there is no sensitivity.
    """
    if not sensitivities:
        raise ArgumentError("sensitivities", said="must hold at least one sensitivity, but it is empty.")
    names, count = largest_first(sensitivities, most), len(sensitivities)
    ax = axes_or_new(ax, 9.0, 1.2 + len(names) * (0.1 + 0.125 * count))
    thick, place = 0.8 / count, np.arange(len(names))
    row = ax.get_window_extent().height * 72 / ax.figure.dpi / len(names)
    size = float(np.clip(1.05 * row * thick, 4.5, 7.5))
    for i, s in enumerate(sensitivities):
        value = np.array([s.elasticity.get(name, np.nan) for name in names])
        note, alpha, hatch = ("", 1.0, None) if s.trusted else (", not trusted", 0.45, "///")
        style = {"color": EDGE_COLOURS[i % len(EDGE_COLOURS)], "alpha": alpha, "hatch": hatch}
        label = f"{s.name} ({s.value_rpm:.0f} rpm{note})"
        at = place + (i - (count - 1) / 2) * thick
        bars = ax.barh(at, value, height=0.9 * thick, **style, edgecolor="white", linewidth=0, label=label)
        ax.bar_label(bars, fmt="{:+.2g}", padding=3, fontsize=size, color=BLACK)
    for k in range(0, len(names), 2):
        ax.axhspan(k - 0.5, k + 0.5, color=BAND, linewidth=0, zorder=0)
    _named_rows(ax, [readable(name) for name in names])
    values = np.array([s.elasticity.get(n, 0.0) for s in sensitivities for n in names] + [0.0])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = 0.12 * (high - low) or 1.0
    ax.set_xlim(low - margin if low < 0 else -0.2 * margin, high + margin if high > 0 else 0.2 * margin)
    ax.set_xlabel("Elasticity: relative change of the speed over relative change of the parameter")
    legend_above(ax, ncols=min(count, 2))
    return ax


def _named_rows(ax: Axes, names: Sequence[str], size: float | int = 9) -> None:
    """Names of horizontal bars, the first on top, and a line at zero."""
    ax.axvline(0, color=BLACK, linewidth=0.8)
    ax.set_yticks(np.arange(len(names)), names, fontsize=size)
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.set_ylim(len(names) - 0.5, -0.5)


def largest_first(sensitivities: Sequence[Sensitivity], most: int) -> list[str]:
    """Names of the parameters that move edges most, in order from the top."""
    largest: dict[str, float] = {}
    for s in sensitivities:
        for name, value in s.elasticity.items():
            largest[name] = max(largest.get(name, 0.0), abs(value) if np.isfinite(value) else 0.0)
    first = [name for name in FIRST if name in largest]
    rest = sorted((n for n in largest if n not in FIRST and largest[n] > 0), key=lambda n: -largest[n])
    return [*first, *rest][:most]


def statistic_bars(found: "MeanGradient", title: str = "") -> Figure:
    """A panel for each statistic that is not 0: elasticity by each direction, with bars of two standard errors."""
    shown = [each for each in found.statistics.values() if each.value]
    names = [readable(name).replace("+", ",\n") for name in shown[0].directions] if shown else []
    columns, rows = min(2, max(1, len(shown))), max(1, -(-len(shown) // 2))
    figure = new_figure(5.5 * columns, 1.0 + rows * (0.8 + 0.28 * len(names)))
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for ax, each, colour in zip(axes.ravel(), shown, cycle(EDGE_COLOURS), strict=False):
        _bars_with_errors(dress(ax), each.elasticity, each.elasticity_error, [colour] * len(names))
        _named_rows(ax, names, 8)
        drifts = "" if each.settled else ", not settled"
        ax.set_title(f"{readable(each.name)}: {each.value:.3g}{drifts}", fontsize=9, loc="left")
    for ax in axes.ravel()[len(shown) :]:
        ax.set_axis_off()
    for ax in axes[-1]:
        ax.set_xlabel("Elasticity, with two standard errors", fontsize=9)
    return entitled(figure, title)


def _bars_with_errors(ax: Axes, values: np.ndarray, errors: np.ndarray, colours: Sequence[str]) -> None:
    place = np.arange(len(values))
    ax.barh(place, values, height=0.7, color=colours, alpha=0.75, linewidth=0)
    ax.errorbar(values, place, xerr=2 * errors, fmt="none", ecolor=BLACK, elinewidth=1.1)


def optimum_figure(found: "Optimum", rows: Sequence["BeforeAfter"], title: str = "") -> Figure:
    """The search beside the relative change of every statistic that is not 0, with bars of two standard errors; changes
    within them are grey."""
    shown = [row for row in rows if row.before]
    figure = new_figure(11.0, 1.6 + 0.34 * len(shown))
    left, right = figure.subplots(1, 2)
    dress(left).plot(np.arange(1, len(found.history) + 1), np.minimum.accumulate(found.history), "o-", color=BLUE)
    left.set(xlabel="Step", ylabel="Best objective so far")
    change, error = (100 * np.array([getattr(r, n) / r.before for r in shown]) for n in ("change", "change_error"))
    _bars_with_errors(dress(right), change, error, [BLUE if row.known else GREY for row in shown])
    unit = lambda row: row.unit.replace("^", "").replace("/", "_per_").replace(" ", "_")
    _named_rows(right, [readable(row.name.removesuffix(f"_{unit(row)}")) for row in shown], 8)
    right.set_xlabel("Change [%], with two standard errors", fontsize=9)
    return entitled(figure, title)


def chance_of_chaos(
    rpm: Float[np.ndarray, " speeds"],
    chance: Float[np.ndarray, " speeds"],
    interval: tuple[Float[np.ndarray, " speeds"], Float[np.ndarray, " speeds"]],
    ax: Axes | None = None,
) -> Axes:
    """Chance of chaos at each speed with its 95 % bar, blue where calm, red where chaotic, purple where it is not
    decided.

    **Arguments:** speeds of the cage [rpm]; chances; lower and upper bounds; axes.
    """
    ax = axes_or_new(ax, 9.0, 4.2)
    groups = {
        "calm (chance at most 5 %)": (chance <= SURE, BLUE),
        "not decided by what is known": ((chance > SURE) & (chance < 1 - SURE), PURPLE),
        "chaotic (at least 95 %)": (chance >= 1 - SURE, VERMILION),
    }
    bars = np.clip(np.array([chance - interval[0], interval[1] - chance]), 0.0, 1.0)
    for label, (which, colour) in groups.items():
        if np.any(which):
            style = {"fmt": "o", "markersize": 4, "color": colour, "elinewidth": 1.1, "label": label}
            ax.errorbar(rpm[which], chance[which], yerr=bars[:, which], **style)
    for level in (SURE, 1 - SURE):
        ax.axhline(level, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
    pad = 0.01 * (rpm[-1] - rpm[0]) or 50.0
    ax.set(ylim=(-0.05, 1.05), xlim=(rpm[0] - pad, rpm[-1] + pad), ylabel="Chance of chaos")
    ax.set_yticks(np.linspace(0, 1, 6))
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, frameon=False, fontsize=8.5)
    return label_speed(ax)


def calm_figure(found: "Design", operating: tuple[float, float], title: str = "") -> Figure:
    """The stable range of a cage before and after, with its edges, beside the operating range; and the costs of the
    designs that were solved for.

    **Arguments:** the design; ends of the operating range of cage speed [rad/s]; title.
    """
    figure = new_figure(11.0, 3.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    dress(left).axvspan(*(w * RPM for w in operating), color=ZONE, label="operating range")
    ends = np.array(operating) * RPM
    for row, values, colour in ((1, found.before, GREY), (0, found.after, BLUE)):
        if "lower margin" not in values:
            continue
        low, high = (
            end * (1 + sign * values[f"{name} margin"].value / 100)
            for end, sign, name in zip(ends, (-1, 1), ("lower", "upper"), strict=True)
        )
        left.barh(row, high - low, left=low, height=0.5, color=colour, alpha=0.75)
        for edge in (low, high):
            left.annotate(f"{edge:.0f}", (edge, row + 0.3), ha="center", fontsize=8)
    left.set(yticks=[0, 1], yticklabels=["after", "before"], xlabel="Cage speed [rpm]", ylim=(-0.6, 1.8))
    left.margins(x=0.08)
    left.set_title("Stable range of the synchronous orbit", fontsize=9, loc="left")
    legend_below(figure, left)
    costs = [step["cost"] for step in found.path]
    dress(right).plot(np.arange(1, len(costs) + 1), costs, "o-", color=BLUE, markersize=3)
    right.set(xlabel="Design solved for", ylabel="Cost")
    right.xaxis.get_major_locator().set_params(integer=True)
    return entitled(figure, title)
