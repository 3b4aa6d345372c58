"""Branches of periodic orbits over speed: stable, unstable, and where they bifurcate."""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import offset_copy
from scipy.optimize import isotonic_regression

from .._errors import ArgumentError
from ..analysis import Sweep
from ..orbits import Branch, Point
from ..quantities import component_names, quantity
from ._orbit_diagram import label_speed, orbit_diagram
from ._style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    KIND_COLOURS,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    axes_or_new,
    enlarge_dots,
    lighter,
    padded_limits,
)


@dataclasses.dataclass(frozen=True)
class Mark:
    """How a kind of bifurcation is drawn and abbreviated."""

    marker: str
    colour: str
    short: str


MARKS = {
    "period-doubling": Mark("s", VERMILION, "PD"),
    "Neimark-Sacker": Mark("D", GREEN, "NS"),
    "fold": Mark("o", BLACK, "F"),
    "branch-point": Mark("^", PURPLE, "BP"),
}
"""Every figure of bifurcations uses these."""
PERIOD_COLOURS = {1: BLUE, 2: ORANGE, 3: PURPLE, 4: SKY}
_LABEL_SIZE = 7.5
_AWAY = 2.0
"""Widths of a label by which one is moved at most."""


def mark_of(kind: str) -> Mark:
    """How `kind` is drawn; an unknown kind is a purple cross and keeps its name."""
    return MARKS.get(kind, Mark("P", PURPLE, kind))


def words(kind: str) -> str:
    """What a legend calls `kind`."""
    return f"{kind.replace('branch-p', 'branch p')} ({mark_of(kind).short})" if kind in MARKS else kind


def branch_diagram(
    branches: Sequence[Branch],
    component: int = 1,
    ax: Axes | None = None,
    *,
    label_points: bool = True,
    limits_rpm: tuple[float, float] | None = None,
) -> Axes:
    """Strobe value of periodic orbits over speed: stable parts thick, unstable parts thin and light, one colour for
    each number of periods. Bifurcations that bound a stable part are filled markers with their speed above the frame,
    others small and hollow.

    **Arguments:** branches over speed; component of the state (1: vertical displacement); axes; whether to write the
    speeds of the edges, which takes the room above the frame; range of speed for a zoomed diagram, whose vertical
    limits then fit what is in it.

    **Raises:** `ValueError` if a branch is not over speed, or there is none.
    """
    if not branches or any(b.parameter != "speed" for b in branches):
        given = ", ".join(b.parameter for b in branches) or "no branch"
        raise ArgumentError("branches", said=f"must hold branches over speed, but {given} was given.")
    ax = axes_or_new(ax, 9.0, 5.0)
    name = component_names(branches[0].state.shape[-1])[component]
    paths = [(b.periods, *polyline(b, component)) for b in branches]
    everywhere = np.concatenate([x for _, x, _, _ in paths])
    low, high = (float(everywhere.min()), float(everywhere.max())) if limits_rpm is None else limits_rpm
    inside = [y[(x >= low) & (x <= high)] for _, x, y, _ in paths]
    met = [path for path in paths if path[1].min() <= high and path[1].max() >= low]
    for periods in sorted({path[0] for path in met}):
        _draw_paths(ax, periods, [path[1:] for path in met if path[0] == periods])
    ax.set(xlim=(low, high), ylim=padded_limits(np.concatenate(inside)), ylabel=quantity(name).label)
    special = [p for b in branches for p in b.special if low <= p.speed_rpm <= high]
    _mark_points(ax, special, component, quantity(name).factor)
    if label_points:
        _write_above(ax, [p for p in special if p.edge])
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.12), "ncols": 4}
    enlarge_dots(ax.legend(**place, frameon=False, fontsize=8.5, handlelength=2.0, columnspacing=1.6))
    return label_speed(ax)


def orbit_diagram_with_branches(
    sweep: Sweep,
    branches: Sequence[Branch],
    component: int = 1,
    ax: Axes | None = None,
    *,
    label_points: bool = True,
    limits_rpm: tuple[float, float] | None = None,
) -> Axes:
    """Branches of periodic orbits over the orbit diagram, whose points are grey.

    **Arguments:** as `orbit_diagram` and `branch_diagram` take them.
    """
    ax = orbit_diagram(sweep, component, axes_or_new(ax, 9.0, 5.0), limits_rpm=limits_rpm)
    clouds = [line for line in ax.get_lines() if line.get_label() in KIND_COLOURS]
    for i, line in enumerate(clouds):
        label = "simulated" if i == 0 else "_simulated"
        line.set(color=GREY, alpha=0.5, markersize=1.4 * line.get_markersize(), zorder=1, label=label)
    limits, (low, high) = ax.get_xlim(), ax.get_ylim()
    branch_diagram(branches, component, ax, label_points=label_points, limits_rpm=limits)
    bottom, top = ax.get_ylim()
    ax.set_ylim(min(low, bottom), max(high, top))
    return ax


def polyline(branch: Branch, component: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Speeds [rpm] and values of a component in the unit it is shown in, special points among them, and whether each
    piece from one point to the next is stable.
    """
    factor = quantity(component_names(branch.state.shape[-1])[component]).factor
    x, y, stable = branch.speed_rpm, branch.state[:, component] * factor, branch.stable
    pieces = stable[:-1] & stable[1:]
    done = branch.value.size
    for p in sorted(branch.special, key=lambda p: (p.index, _share(branch, p)), reverse=True):
        k = p.index
        beyond = stable[k] and stable[k + 1] if k == done else stable[k + 1]
        x, y = np.insert(x, k + 1, p.speed_rpm), np.insert(y, k + 1, p.state[component] * factor)
        pieces = np.concatenate([pieces[:k], [stable[k], beyond], pieces[k + 1 :]])
        done = k
    return x, y, pieces


def _share(branch: Branch, point: Point) -> float:
    """How far a special point is from the branch's point before it to the one after it."""
    scale = np.ptp(branch.state, axis=0) + 1e-300
    before, after = branch.state[point.index] / scale, branch.state[point.index + 1] / scale
    step = after - before
    return float(np.dot(point.state / scale - before, step) / (np.dot(step, step) + 1e-300))


def _draw_paths(ax: Axes, periods: int, paths: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    colour = PERIOD_COLOURS.get(periods, GREEN)  # long periods share one
    light = lighter(colour)
    styles = (
        ("stable", {"color": colour, "linewidth": 2.4, "solid_capstyle": "butt", "zorder": 3.0}),
        ("unstable", {"color": light, "linewidth": 0.8, "linestyle": (0, (4, 1.5)), "zorder": 2.0}),
    )
    for word, style in styles:
        parts = [runs(x, y, pieces if word == "stable" else ~pieces) for x, y, pieces in paths]
        x, y = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        if x.size:
            ax.plot(x, y, **style, label=f"period-{periods}, {word}")


def runs(x: np.ndarray, y: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The chosen pieces of a polyline, with NaN between those that are not neighbours."""
    change = np.diff(np.concatenate([[0], chosen.astype(int), [0]]))
    ends = zip(np.flatnonzero(change == 1), np.flatnonzero(change == -1), strict=True)
    kept = [np.append(np.arange(a, b + 1), -1) for a, b in ends]
    index = np.concatenate(kept) if kept else np.zeros(0, dtype=int)
    return np.where(index < 0, np.nan, x[index]), np.where(index < 0, np.nan, y[index])


def _mark_points(ax: Axes, points: Sequence[Point], component: int, factor: float) -> None:
    for kind in [*MARKS, *sorted({p.kind for p in points} - set(MARKS))]:
        mark = mark_of(kind)
        for edge in (True, False):
            mine = [p for p in points if p.kind == kind and p.edge == edge]
            if not mine:
                continue
            x, y = [float(p.speed_rpm) for p in mine], [float(p.state[component]) * factor for p in mine]
            style: dict[str, Any] = {"marker": mark.marker, "linestyle": "none", "color": mark.colour}
            if edge:
                style |= {"markersize": 5.5, "markeredgecolor": "white", "markeredgewidth": 0.6, "zorder": 5.0}
            else:
                style |= {"markersize": 3.5, "markerfacecolor": "white", "markeredgewidth": 0.8, "zorder": 4.0}
            ax.plot(x, y, **style, label=words(kind) if edge else f"_{words(kind)}, hollow")
    if any(not p.edge for p in points):
        style: dict[str, Any] = {"color": GREY, "markersize": 4.5, "markerfacecolor": "white"}
        ax.plot([], [], "o", **style, label="hollow: unstable on both sides")


def _write_above(ax: Axes, points: Iterable[Point]) -> None:
    """Kind and speed of points in a row above the frame, moved apart, with lines to where they belong.

    Points that are written alike, as on branches that share a part, are written once; where there is no room for all
    near to where they belong, those with the nearest neighbours are left out.
    """
    texts = {f"{mark_of(p.kind).short} {p.speed_rpm:.0f}": p for p in points}
    row = sorted(texts.items(), key=lambda item: item[1].speed_rpm)
    low, high = ax.get_xlim()
    width = ax.get_window_extent().width * 72 / ax.figure.dpi
    wide, gap = 5.0 * _LABEL_SIZE / width, 1.3 * _LABEL_SIZE / width
    place = lambda: np.array([(p.speed_rpm - low) / (high - low) for _, p in row])
    moved = lambda at: float(np.max(np.abs(move_apart(at, gap, 0.0, 1.0) - at), initial=0.0))
    while (len(row) - 1) * gap > 1.0 or moved(place()) > _AWAY * gap:
        apart = np.diff(place())
        k = int(np.argmin(apart))
        row.pop(k if 0 < k and apart[k - 1] < apart[min(k + 1, apart.size - 1)] else k + 1)
    at = place()
    upright = at.size > 1 and float(np.min(np.diff(at))) < wide
    spread = move_apart(at, gap, 0.0, 1.0) if upright else at
    above = offset_copy(ax.transAxes, ax.figure, y=16, units="points")  # pyright: ignore[reportArgumentType]
    for (text, p), where in zip(row, spread, strict=True):
        ax.annotate(
            text,
            (p.speed_rpm, 1.0),
            (where, 1.0),
            xycoords=ax.get_xaxis_transform(),
            textcoords=above,
            ha="center",
            va="bottom",
            rotation=90 if upright else 0,
            fontsize=_LABEL_SIZE,
            color=mark_of(p.kind).colour,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0}
            | {"relpos": (0.5, 0.0)},
        )


def move_apart(at: np.ndarray, gap: float, low: float, high: float) -> np.ndarray:
    """Ascending places at least `gap` apart and within limits, as near (least squares) to `at` as they can be."""
    steps = gap * np.arange(at.size)
    if at.size == 0:
        return at
    return np.clip(isotonic_regression(at - steps).x, low, max(low, high - steps[-1])) + steps
