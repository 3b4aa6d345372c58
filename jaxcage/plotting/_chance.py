"""Chance of chaos over speed, of a cage of which some values are known within ranges only."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from ._orbit_diagram import label_speed
from ._style import BLUE, GREY, PURPLE, VERMILION, axes_or_new


SURE = 0.05
"""Chances at most this far from 0 or 1 decide."""


def chance_of_chaos(
    rpm: Float[np.ndarray, " speeds"],
    chance: Float[np.ndarray, " speeds"],
    interval: tuple[Float[np.ndarray, " speeds"], Float[np.ndarray, " speeds"]],
    bands: Sequence[tuple[str, tuple[float, float, float]]] = (),
    ax: Axes | None = None,
) -> Axes:
    """Chance at each speed with its 95 % bar, blue where calm, red where chaotic, purple where it is not decided; bands
    of the edges beneath the zero line.

    **Arguments:** speeds of the cage [rpm]; chances; lower and upper bounds; names of edges with 5 %, 50 % and 95 %
    quantiles [rpm]; axes.
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
            style = {"fmt": "o", "markersize": 4, "color": colour, "elinewidth": 1.1, "capsize": 0}
            ax.errorbar(rpm[which], chance[which], yerr=bars[:, which], label=label, **style)
    for level in (SURE, 1 - SURE):
        ax.axhline(level, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
    for i, (name, (low, middle, high)) in enumerate(bands):
        y = -0.09 - 0.08 * i
        ax.plot([low, high], [y, y], color=GREY, linewidth=4, solid_capstyle="butt", alpha=0.6)
        ax.plot([middle], [y], "|", color="#000000", markersize=7)
        beyond = high > rpm[0] + 0.8 * (rpm[-1] - rpm[0])
        ax.annotate(
            name,
            (low if beyond else high, y),
            (-4 if beyond else 4, 0),
            textcoords="offset points",
            ha="right" if beyond else "left",
            va="center",
            fontsize=8,
        )
    pad = 0.01 * (rpm[-1] - rpm[0]) or 50.0
    ax.set(ylim=(-0.05 - 0.09 * len(bands), 1.05), xlim=(rpm[0] - pad, rpm[-1] + pad), ylabel="Chance of chaos")
    ax.set_yticks(np.linspace(0, 1, 6))
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, frameon=False, fontsize=8.5)
    return label_speed(ax)
