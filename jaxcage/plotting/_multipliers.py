"""Floquet multipliers in the complex plane."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Complex
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from ..orbits import Branch, Point
from ..quantities import quantity
from ._branches import mark_of, move_apart, words
from ._style import BLACK, BLUE, GREY, Halo, axes_or_new


REACH = 1.6
"""The figure ends at this real and imaginary part: what matters happens on the unit circle."""
_ROWS = 9
_GLYPHS = {"s": "■□", "D": "◆◇", "o": "●○", "^": "▲△"}
_HALO = [Halo(2.0)]
_LABEL_SIZE = 7.5


def multiplier_circle(branch: Branch | Complex[np.ndarray, "*points dim"], ax: Axes | None = None) -> Axes:
    """Multipliers along a branch, coloured by speed, with the unit circle; critical multipliers of its bifurcations are
    marked and named with their speed [rpm], filled where a stable orbit is on one side.

    **Arguments:** branch, or multipliers alone; axes. Multipliers beyond 1.6 are not shown.
    """
    ax = axes_or_new(ax, 7.0, 5.6)
    ax.add_patch(Circle((0, 0), 1.0, fill=False, color=BLACK, linewidth=1.0, zorder=2))
    for line in (ax.axhline, ax.axvline):
        line(0, color=GREY, linewidth=0.6, zorder=1)
    if isinstance(branch, Branch):
        mu = branch.multipliers
        speed = np.repeat(branch.speed_rpm, mu.shape[1])
        shown = _shown(mu)
        cloud = ax.scatter(
            np.real(mu)[shown], np.imag(mu)[shown], c=speed[shown.ravel()], s=7, cmap="viridis", linewidths=0
        )
        cloud.set(clim=(float(speed.min()), float(speed.max())), zorder=3)
        beside = ax.inset_axes((1.03, 0.0, 0.035, 1.0))
        ax.figure.colorbar(cloud, cax=beside, label=quantity("speed_rpm").label, format="{x:.0f}")
        _mark_critical(ax, branch.special)
    else:
        mu = branch[_shown(branch)]
        ax.plot(np.real(mu), np.imag(mu), "o", color=BLUE, markersize=4, zorder=3, label="multipliers")
    limits = (-REACH, REACH)
    ax.set(xlim=limits, ylim=limits, aspect="equal")
    ax.set(xlabel=r"Real part of the multiplier $\mu$", ylabel=r"Imaginary part of the multiplier $\mu$")
    return ax


def _shown(mu: np.ndarray) -> np.ndarray:
    return (np.abs(np.real(mu)) <= REACH) & (np.abs(np.imag(mu)) <= REACH)


def _mark_critical(ax: Axes, points: Sequence[Point]) -> None:
    named = {p.kind: p for p in sorted(points, key=lambda p: p.edge)}
    for p in sorted(points, key=lambda p: p.edge):
        mark, mu = mark_of(p.kind), p.critical
        label = words(p.kind) if named[p.kind] is p else None
        size, face = (6.0, mark.colour) if p.edge else (4.5, "white")
        both = (mu, mu.conjugate()) if p.kind == "Neimark-Sacker" else (complex(mu.real, 0.0),)
        style: dict[str, Any] = {
            "marker": mark.marker,
            "linestyle": "none",
            "color": mark.colour,
            "markerfacecolor": face,
        }
        ax.plot([m.real for m in both], [m.imag for m in both], **style, markersize=size, zorder=5, label=label)
    _write_column(ax, [p for p in points if p.critical.real < 0 and p.kind != "Neimark-Sacker"], -1)
    _write_column(ax, [p for p in points if p.critical.real > 0 and p.kind != "Neimark-Sacker"], 1)
    _write_around(ax, [p for p in points if p.kind == "Neimark-Sacker"])
    if named:
        place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": 4}
        ax.legend(**place, frameon=False, fontsize=8, handletextpad=0.1, columnspacing=1.0)


def _text(point: Point) -> str:
    filled, hollow = _GLYPHS.get(mark_of(point.kind).marker, "✚✛")
    return f"{filled if point.edge else hollow} {mark_of(point.kind).short} {point.speed_rpm:.0f}"


def _write_column(ax: Axes, points: Sequence[Point], side: int) -> None:
    """Points with a real multiplier, all at the same place, one beneath the other; edges are the first to be named."""
    points = sorted(points, key=lambda p: (not p.edge, p.speed_rpm))
    rows = [_text(p) for p in points[:_ROWS]] + ([f"+ {len(points) - _ROWS} more"] if len(points) > _ROWS else [])
    if rows:
        style = {
            "ha": "right" if side < 0 else "left",
            "va": "top",
            "fontsize": _LABEL_SIZE,
            "linespacing": 1.25,
            "path_effects": _HALO,
        }
        ax.text(side * 1.09, -0.06, "\n".join(rows), color=mark_of(points[0].kind).colour, **style, zorder=6)


def _write_around(ax: Axes, points: Sequence[Point]) -> None:
    """Points with complex multipliers, outside the circle beside their place, moved apart."""
    frame = ax.get_window_extent()
    gap = 1.3 * _LABEL_SIZE * ax.figure.dpi / 72 * 2 * REACH / min(frame.width, frame.height)
    for side in (-1, 1):
        mine = sorted((p for p in points if (p.critical.real >= 0) == (side > 0)), key=lambda p: p.critical.imag)
        heights = move_apart(1.1 * np.array([p.critical.imag for p in mine]), gap, 0.1, REACH - gap)
        for p, y in zip(mine, heights, strict=True):
            place = (side * max(0.05, np.sqrt(max(0.0, 1.12**2 - y**2))), y)
            style = {"ha": "right" if side < 0 else "left", "va": "center", "fontsize": _LABEL_SIZE}
            line = {"arrowstyle": "-", "color": GREY, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 2}
            style |= {"color": mark_of(p.kind).colour, "path_effects": _HALO, "zorder": 6, "arrowprops": line}
            ax.annotate(_text(p), (p.critical.real, p.critical.imag), place, **style)
