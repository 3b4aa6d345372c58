"""How edges, and statistics of the whole bearing, answer to the design: elasticities as bars."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._errors import ArgumentError
from ..design import BearingGradient
from ..orbits import Sensitivity
from ._style import BAND, BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, axes_or_new, dress, new_figure


FIRST = ("guidance_gap", "eccentricity")
"""The two quantities a designer asks for are always on top."""
EDGE_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
ROW = 2
"""Statistics side by side."""


def elasticity_bars(sensitivities: Sequence[Sensitivity], ax: Axes | None = None, most: int = 12) -> Axes:
    """Elasticities of edges, or of widths, with respect to the parameters that move any of them most.

    Guidance gap and eccentricity are on top; the others follow by their largest elasticity. Bars of a sensitivity that
    is not to be trusted are hatched.

    **Arguments:** sensitivities, one colour each; axes; number of parameters.

    **Raises:** `ValueError` if there is no sensitivity.
    """
    if not sensitivities:
        raise ArgumentError("sensitivities", said="must hold at least one sensitivity, but it is empty.")
    names = largest_first(sensitivities, most)
    count = len(sensitivities)
    ax = axes_or_new(ax, 9.0, 1.2 + len(names) * (0.1 + 0.125 * count))
    thick = 0.8 / count
    row = ax.get_window_extent().height * 72 / ax.figure.dpi / len(names)
    size = float(np.clip(1.05 * row * thick, 4.5, 7.5))
    for i, s in enumerate(sensitivities):
        value = np.array([s.elasticity.get(name, np.nan) for name in names])
        place = np.arange(len(names)) + (i - (count - 1) / 2) * thick
        note = "" if s.trusted else ", not trusted"
        style = {"color": EDGE_COLOURS[i % len(EDGE_COLOURS)], "alpha": 1.0 if s.trusted else 0.45}
        label = f"{s.name} ({s.value_rpm:.0f} rpm{note})"
        hatch = None if s.trusted else "///"
        ax.barh(place, value, height=0.9 * thick, **style, hatch=hatch, edgecolor="white", linewidth=0, label=label)
        _write_values(ax, place, value, size)
    for k in range(0, len(names), 2):
        ax.axhspan(k - 0.5, k + 0.5, color=BAND, linewidth=0, zorder=0)
    ax.axvline(0, color=BLACK, linewidth=0.8)
    ax.set_yticks(np.arange(len(names)), [readable(name) for name in names])
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.set(ylim=(len(names) - 0.5, -0.5), xlim=_room_for_text(sensitivities, names))
    ax.set_xlabel("Elasticity: relative change of the speed over relative change of the parameter")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(count, 2), frameon=False, fontsize=9)
    return ax


def readable(name: str) -> str:
    """A parameter's name as words."""
    return name.replace(".", " ").replace("_", " ")


def largest_first(sensitivities: Sequence[Sensitivity], most: int) -> list[str]:
    """Names of the parameters that move edges most, in order from the top."""
    largest: dict[str, float] = {}
    for s in sensitivities:
        for name, value in s.elasticity.items():
            largest[name] = max(largest.get(name, 0.0), abs(value) if np.isfinite(value) else 0.0)
    first = [name for name in FIRST if name in largest]
    rest = sorted((n for n in largest if n not in FIRST and largest[n] > 0), key=lambda n: -largest[n])
    return [*first, *rest][:most]


def _write_values(ax: Axes, place: np.ndarray, value: np.ndarray, size: float) -> None:
    for y, v in zip(place, value, strict=True):
        if np.isfinite(v):
            side = {"ha": "left", "xytext": (3, 0)} if v >= 0 else {"ha": "right", "xytext": (-3, 0)}
            style = {"textcoords": "offset points", "va": "center", "fontsize": size, "color": BLACK}
            ax.annotate(_number(v), (v, y), **side, **style)


def _number(value: float) -> str:
    """Two digits, not more than three decimals."""
    if abs(value) < 5e-4:
        return "0" if value == 0 else "≈0"
    text = f"{value:+.2f}" if abs(value) >= 0.1 else f"{value:+.3f}"
    return text.replace("-", "−")


def _room_for_text(sensitivities: Sequence[Sensitivity], names: Sequence[str]) -> tuple[float, float]:
    values = np.array([s.elasticity.get(n, 0.0) for s in sensitivities for n in names] + [0.0])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.12 * (high - low) or 1.0
    return (low - room if low < 0 else -0.2 * room), (high + room if high > 0 else 0.2 * room)


def statistic_bars(found: BearingGradient, title: str = "") -> Figure:
    """A panel for each statistic that is not 0: elasticity by each direction, with bars of two standard errors."""
    shown = [each for each in found.statistics.values() if each.value]
    count = max(1, len(shown))
    names = shown[0].directions if shown else ()
    columns = min(ROW, count)
    rows = -(-count // columns)
    figure = new_figure(11.0 * columns / ROW, 1.0 + rows * (0.8 + 0.28 * len(names)))
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
    place = np.arange(len(names))
    for ax, each, colour in zip(axes.ravel(), shown, cycle(EDGE_COLOURS), strict=False):
        dress(ax)
        ax.barh(place, each.elasticity, height=0.7, color=colour, alpha=0.75, linewidth=0)
        ax.errorbar(each.elasticity, place, xerr=2 * each.elasticity_error, fmt="none", ecolor=BLACK, elinewidth=1.1)
        ax.axvline(0, color=BLACK, linewidth=0.8)
        ax.grid(False, axis="y")
        drifts = "" if each.settled else ", not settled"
        ax.set_title(f"{readable(each.name)}: {each.value:.3g}{drifts}", fontsize=9, loc="left")
    for ax in axes.ravel()[len(shown) :]:
        ax.set_axis_off()
    for ax in axes[:, 0]:
        ax.set_yticks(place, [readable(name).replace("+", ",\n") for name in names], fontsize=8)
        ax.set_ylim(len(names) - 0.5, -0.5)
    for ax in axes[-1]:
        ax.set_xlabel("Elasticity, with two standard errors", fontsize=9)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure
