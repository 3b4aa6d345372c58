"""Branches of periodic orbits over speed, where they bifurcate, and Floquet multipliers in the complex plane."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from .._errors import ArgumentError
from ..orbits import Branch, Point
from ..quantities import quantity
from . import style
from .diagrams import label_speed, orbit_diagram


class Mark(NamedTuple):
    """Marker, colour and abbreviation of a kind of bifurcation."""

    marker: str
    colour: str
    short: str


MARKS = {
    "period-doubling": Mark("s", style.VERMILION, "PD"),
    "Neimark-Sacker": Mark("D", style.GREEN, "NS"),
    "fold": Mark("o", style.BLACK, "F"),
    "branch-point": Mark("^", style.PURPLE, "BP"),
}
"""Marks of bifurcations in every figure."""
PERIOD_COLOURS = {1: style.BLUE, 2: style.ORANGE, 3: style.PURPLE, 4: style.SKY}
SHOWN = quantity("y_C")
"""State component that is drawn, the second one."""
LABEL_SIZE = 7.5
REACH = 1.6
"""Largest real and imaginary part of the multipliers that are shown."""


def mark_of(kind: str) -> Mark:
    """Mark of a kind of bifurcation; an unknown kind gets a purple cross and keeps its name."""
    return MARKS.get(kind, Mark("P", style.PURPLE, kind))


def words(kind: str) -> str:
    """Name of a kind of bifurcation in a legend."""
    return f"{kind.replace('branch-p', 'branch p')} ({mark_of(kind).short})" if kind in MARKS else kind


def branch_diagram(branches: Sequence[Branch], ax: Axes | None = None) -> Axes:
    """Diagram of the vertical displacement of periodic orbits over speed: stable parts thick, unstable parts thin and
    light, one colour for each number of periods. Bifurcations that bound a stable part are filled markers with their
    speed above the frame, others are small and hollow.

    **Raises:** `ValueError` if a branch is not over speed, or there is none.
    """
    if not branches or any(b.parameter != "speed" for b in branches):
        given = ", ".join(b.parameter for b in branches) or "no branch"
        raise ArgumentError("branches", said=f"must hold branches over speed, but {given} was given.")
    ax = style.axes_or_new(ax, 9.0, 5.0)
    paths = [(b.periods, *polyline(b)) for b in branches]
    for periods in sorted({path[0] for path in paths}):
        _draw_paths(ax, periods, [path[1:] for path in paths if path[0] == periods])
    speeds, values = (np.concatenate([path[i] for path in paths]) for i in (1, 2))
    ax.set(xlim=(speeds.min(), speeds.max()), ylim=style.padded_limits(values), ylabel=SHOWN.label)
    special = [p for b in branches for p in b.special]
    _mark_points(ax, special, lambda p: [(float(p.speed_rpm), float(p.state[1]) * SHOWN.factor)])
    if any(not p.edge for p in special):
        look: dict[str, Any] = {"color": style.GREY, "markersize": 4.5, "markerfacecolor": "white"}
        ax.plot([], [], "o", **look, label="hollow: unstable on both sides")
    _write_above(ax, [p for p in special if p.edge])
    style.legend_beside(ax)
    return label_speed(ax)


def orbit_diagram_with_branches(sweep: xr.Dataset, branches: Sequence[Branch], ax: Axes | None = None) -> Axes:
    """Orbit diagram in grey with branches of periodic orbits on top."""
    ax = orbit_diagram(sweep, 1, style.axes_or_new(ax, 9.0, 5.0))
    clouds = [line for line in ax.get_lines() if line.get_label() in style.KIND_COLOURS]
    for i, line in enumerate(clouds):
        label = "simulated" if i == 0 else "_simulated"
        line.set(color=style.GREY, alpha=0.5, markersize=1.4 * line.get_markersize(), zorder=1, label=label)
    limits = np.array([ax.get_xlim(), ax.get_ylim()])
    branch_diagram(branches, ax)
    both = np.array([limits, [ax.get_xlim(), ax.get_ylim()]])
    (left, right), (low, high) = np.transpose([both[..., 0].min(axis=0), both[..., 1].max(axis=0)])
    ax.set(xlim=(left, right), ylim=(low, high))
    return ax


def polyline(branch: Branch) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Bool[np.ndarray, " n-1"]]:
    """Speeds [rpm] and vertical displacements along a branch with its special points, and True for stable pieces."""
    x, y, stable = branch.speed_rpm, branch.state[:, 1] * SHOWN.factor, branch.stable
    pieces = stable[:-1] & stable[1:]
    done = branch.value.size
    for p in sorted(branch.special, key=lambda p: (p.index, _share(branch, p)), reverse=True):
        k = p.index
        beyond = stable[k] and stable[k + 1] if k == done else stable[k + 1]
        x, y = np.insert(x, k + 1, p.speed_rpm), np.insert(y, k + 1, p.state[1] * SHOWN.factor)
        pieces = np.concatenate([pieces[:k], [stable[k], beyond], pieces[k + 1 :]])
        done = k
    return x, y, pieces


def _share(branch: Branch, point: Point) -> float:
    """Position of a special point between the branch points before it (0) and after it (1)."""
    scale = np.ptp(branch.state, axis=0) + 1e-300
    before, after = branch.state[point.index] / scale, branch.state[point.index + 1] / scale
    step = after - before
    return float(np.dot(point.state / scale - before, step) / (np.dot(step, step) + 1e-300))


def _draw_paths(ax: Axes, periods: int, paths: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    colour = PERIOD_COLOURS.get(periods, style.GREEN)  # long periods share one
    thin = {"color": style.lighter(colour), "linewidth": 0.8, "linestyle": (0, (4, 1.5)), "zorder": 2.0}
    thick = {"color": colour, "linewidth": 2.4, "solid_capstyle": "butt", "zorder": 3.0}
    for word, look in (("stable", thick), ("unstable", thin)):
        parts = [chosen_pieces(x, y, pieces if word == "stable" else ~pieces) for x, y, pieces in paths]
        x, y = np.concatenate(parts, axis=1)
        if x.size:
            ax.plot(x, y, **look, label=f"period-{periods}, {word}")


def chosen_pieces(x: np.ndarray, y: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chosen pieces of a polyline, with NaN between pieces that are not neighbours."""
    change = np.diff(np.concatenate([[0], chosen.astype(int), [0]]))
    ends = zip(np.flatnonzero(change == 1), np.flatnonzero(change == -1), strict=True)
    kept = [np.append(np.arange(a, b + 1), -1) for a, b in ends]
    index = np.concatenate(kept) if kept else np.zeros(0, dtype=int)
    return np.where(index < 0, np.nan, x[index]), np.where(index < 0, np.nan, y[index])


def _mark_points(ax: Axes, points: Sequence[Point], places: Any) -> None:
    """Mark bifurcations at their `places`: filled with a stable orbit on one side, else small and hollow."""
    for kind in [*MARKS, *sorted({p.kind for p in points} - set(MARKS))]:
        mark = mark_of(kind)
        for edge in (True, False):
            found = [place for p in points if p.kind == kind and p.edge == edge for place in places(p)]
            if not found:
                continue
            look: dict[str, Any] = {"marker": mark.marker, "linestyle": "none", "color": mark.colour}
            if edge:
                look |= {"markersize": 5.5, "markeredgecolor": "white", "markeredgewidth": 0.6, "zorder": 5.0}
            else:
                look |= {"markersize": 3.5, "markerfacecolor": "white", "markeredgewidth": 0.8, "zorder": 4.0}
            ax.plot(*np.transpose(found), **look, label=words(kind) if edge else f"_{words(kind)}, hollow")


def _write_above(ax: Axes, points: Iterable[Point]) -> None:
    """Write kind and speed of points above the frame, except those without room."""
    low, high = ax.get_xlim()
    room = 1.3 * LABEL_SIZE / (ax.get_window_extent().width * 72 / ax.figure.dpi) * (high - low)
    last = -np.inf
    for p in sorted(points, key=lambda p: float(p.speed_rpm)):
        if p.speed_rpm - last < room:
            continue
        last, mark = p.speed_rpm, mark_of(p.kind)
        look = {"rotation": 90, "ha": "center", "va": "bottom", "fontsize": LABEL_SIZE, "color": mark.colour}
        place = {"xycoords": ax.get_xaxis_transform(), "textcoords": "offset points", "annotation_clip": False}
        ax.annotate(f"{mark.short} {p.speed_rpm:.0f}", (p.speed_rpm, 1.0), (0, 3), **place, **look)


def multiplier_circle(branch: Branch, ax: Axes | None = None) -> Axes:
    """Floquet multipliers along a branch, coloured by speed, with the unit circle; critical multipliers of its
    bifurcations are marked, filled with a stable orbit on one side. Multipliers beyond 1.6 are not shown."""
    ax = style.axes_or_new(ax, 7.0, 5.6)
    ax.add_patch(Circle((0, 0), 1.0, fill=False, color=style.BLACK, linewidth=1.0, zorder=2))
    for line in (ax.axhline, ax.axvline):
        line(0, color=style.GREY, linewidth=0.6, zorder=1)
    mu = branch.multipliers
    shown = (np.abs(np.real(mu)) <= REACH) & (np.abs(np.imag(mu)) <= REACH)
    speed = np.repeat(branch.speed_rpm, mu.shape[1]).reshape(mu.shape)
    look = {"c": speed[shown], "s": 7, "cmap": "viridis", "linewidths": 0}
    cloud = ax.scatter(np.real(mu)[shown], np.imag(mu)[shown], **look)
    cloud.set(clim=(float(speed.min()), float(speed.max())), zorder=3)
    beside = ax.inset_axes((1.03, 0.0, 0.035, 1.0))
    ax.figure.colorbar(cloud, cax=beside, label=quantity("speed_rpm").label, format="{x:.0f}")
    _mark_points(ax, branch.special, _critical)
    if branch.special:
        style.legend_above(ax, size=8)
    limits = (-REACH, REACH)
    ax.set(xlim=limits, ylim=limits, aspect="equal")
    ax.set(xlabel=r"Real part of the multiplier $\mu$", ylabel=r"Imaginary part of the multiplier $\mu$")
    return ax


def _critical(point: Point) -> list[tuple[float, float]]:
    """Critical multiplier in the complex plane, both of a pair for a Neimark-Sacker bifurcation."""
    mu = point.critical
    return [(mu.real, mu.imag), (mu.real, -mu.imag)] if point.kind == "Neimark-Sacker" else [(mu.real, 0.0)]
