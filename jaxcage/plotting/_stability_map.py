"""Bifurcation curves in the plane of speed and a parameter, over the largest exponent."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from .._errors import ArgumentError
from .._glossary import quantity
from ..orbits import Curve
from ._branches import mark_of, runs
from ._elasticities import readable
from ._orbit_diagram import label_speed
from ._style import BLACK, Halo, axes_or_new, padded_limits


Exponents = tuple[
    Float[np.ndarray, " speeds"],
    Float[np.ndarray, " values"],
    Float[np.ndarray, "speeds values"],
]
"""Speeds [rpm], values of the parameter [SI], largest exponent per revolution at each (NaN: unknown)."""
STEEPEST = 0.3
"""The colours end at this exponent: what lies beyond looks like it."""
_HALO = [Halo(2.6)]
_LABEL_SIZE = 8.5
_OFFSETS = [(9.0 * r * dx, 7.0 * r * dy) for r in (1, 2, 3.5) for dx, dy in ((1, 1), (-1, 1), (1, -1), (-1, -1))]
"""Where a name may begin beside its point [points], the best first."""


def stability_map(
    curves: Sequence[Curve],
    ax: Axes | None = None,
    *,
    exponents: Exponents | None = None,
    y_unit: str = "",
    y_factor: float = 1.0,
    y_label: str | None = None,
) -> Axes:
    """Curves of bifurcations over speed, coloured by kind, with the points of codimension two on them named.

    **Arguments:** curves whose `x` is the speed; axes; largest exponents, drawn beneath with white at zero; unit in
    which the parameter is shown and its factor from SI, e.g. `"mm"` and `1e3`; what to call the parameter.

    **Raises:** `ValueError` if a curve is not over speed, or two have different parameters.
    """
    others = {c.y for c in curves}
    if any(c.x != "speed" for c in curves) or len(others) > 1:
        given = ", ".join(sorted({f"{c.y} over {c.x}" for c in curves}))
        raise ArgumentError("curves", said=f"must all be of one parameter over speed, but {given} was given.")
    ax = axes_or_new(ax, 9.0, 5.0)
    if exponents is not None:
        _colour_exponents(ax, exponents, y_factor)
    rpm = quantity("speed").factor
    lines = [(np.asarray(c.x_value) * rpm, np.asarray(c.y_value) * y_factor) for c in curves]
    for c, (x, y) in zip(curves, lines, strict=True):
        _draw_curve(ax, c, x, y)
    _fit(ax, lines, exponents, y_factor)
    name = y_label if y_label is not None else readable("".join(others)).capitalize()
    ax.set_ylabel(f"{name} [{y_unit}]" if y_unit else name)
    label_speed(ax)
    if curves:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False, fontsize=9)
    _name_points(ax, [(p.x_value * rpm, p.y_value * y_factor, p.kind) for c in curves for p in c.special], lines)
    return ax


def _draw_curve(ax: Axes, curve: Curve, x: np.ndarray, y: np.ndarray) -> None:
    """The curve, dotted where its points are no bifurcations but neutral saddles."""
    drawn = {line.get_label() for line in ax.get_lines()}
    genuine = np.asarray(curve.genuine[:-1] & curve.genuine[1:])
    colour = mark_of(curve.kind).colour
    halo = [Halo(3.6)]
    for label, chosen, width, dash in (
        ("neutral saddles", ~genuine, 1.6, ":"),
        (curve.kind, genuine, 2.0, "-"),
    ):
        if np.any(chosen):
            name = f"_{label}" if label in drawn else label
            style = {"linestyle": dash, "color": colour, "path_effects": halo, "zorder": 3}
            ax.plot(*runs(x, y, chosen), linewidth=width, **style, label=name)


def _colour_exponents(ax: Axes, exponents: Exponents, factor: float) -> None:
    rpm, values, largest = exponents
    ax.grid(False)
    shown = np.ma.masked_invalid(largest).T
    style = {"cmap": "RdBu_r", "vmin": -STEEPEST, "vmax": STEEPEST, "shading": "nearest", "rasterized": True}
    mesh = ax.pcolormesh(rpm, np.asarray(values) * factor, shown, **style, alpha=0.85, zorder=0)
    label = quantity("largest_exponent").label
    ax.figure.colorbar(mesh, ax=ax, label=label, pad=0.01, extend="both")


def _fit(ax: Axes, lines: Sequence[tuple[np.ndarray, np.ndarray]], exponents: Exponents | None, factor: float) -> None:
    """The map's own limits, or those of the curves if there is no map."""
    if exponents is None:
        across, upward = (np.concatenate([line[i] for line in lines] or [np.zeros(0)]) for i in (0, 1))
        ax.set(xlim=padded_limits(across), ylim=padded_limits(upward))
        return
    for values, limit in ((exponents[0], ax.set_xlim), (np.asarray(exponents[1]) * factor, ax.set_ylim)):
        first, last = (1.5 * values[i] - 0.5 * values[j] for i, j in ((0, 1), (-1, -2)))
        limit(float(min(first, last)), float(max(first, last)))


def _name_points(
    ax: Axes, points: Sequence[tuple[float, float, str]], lines: Sequence[tuple[np.ndarray, np.ndarray]]
) -> None:
    """Mark points inside the axes and write their kind where it hides least; curves that meet share a point."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    near = lambda a, b: abs(a[0] - b[0]) < 5e-3 * (right - left) and abs(a[1] - b[1]) < 5e-3 * (top - bottom)
    kept: list[tuple[float, float, str]] = []
    for p in points:
        inside = left <= p[0] <= right and bottom <= p[1] <= top
        if inside and not any(p[2] == q[2] and near(p, q) for q in kept):
            kept.append(p)
    if not kept:
        return
    style = {"marker": "o", "linestyle": "none", "color": BLACK, "markerfacecolor": "white", "markersize": 6}
    ax.plot([p[0] for p in kept], [p[1] for p in kept], **style, zorder=5, label="_codimension two")
    on_paper = lambda x, y: ax.transData.transform(np.column_stack([x, y])) * 72 / ax.figure.dpi
    points_at = on_paper([p[0] for p in kept], [p[1] for p in kept])
    hidden = np.concatenate([_dense(on_paper(x, y)) for x, y in lines] + [np.repeat(points_at, 9, axis=0)])
    frame = Bbox(ax.get_window_extent().get_points() * 72 / ax.figure.dpi)
    taken: list[Bbox] = []
    for (x, y, text), at in zip(kept, points_at, strict=True):
        boxes = [_box(at, offset, text) for offset in _OFFSETS]
        best = int(np.argmin([_cost(box, taken, hidden, frame) for box in boxes]))
        taken.append(boxes[best])
        _write(ax, (x, y), _OFFSETS[best], text)


def _write(ax: Axes, point: tuple[float, float], offset: tuple[float, float], text: str) -> None:
    right, up = offset[0] > 0, offset[1] > 0
    line = {"arrowstyle": "-", "color": BLACK, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 3}
    style = {"ha": "left" if right else "right", "va": "bottom" if up else "top", "fontsize": _LABEL_SIZE}
    ax.annotate(
        text,
        point,
        offset,
        textcoords="offset points",
        **style,
        arrowprops=line | {"relpos": (0.0 if right else 1.0, 0.0 if up else 1.0)},
        path_effects=_HALO,
        zorder=6,
    )


def _box(at: np.ndarray, offset: tuple[float, float], text: str) -> Bbox:
    """Where a text would be [points], about."""
    corner = at + np.array(offset)
    far = corner + np.sign(offset) * _LABEL_SIZE * np.array([0.58 * len(text), 1.3])
    return Bbox([np.minimum(corner, far), np.maximum(corner, far)])


def _dense(points: np.ndarray) -> np.ndarray:
    """Points along a polyline, about one for every 4 points of length."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    along = np.linspace(0.0, length[-1], 2 + int(min(length[-1], 4e4) / 4))
    return np.column_stack([np.interp(along, length, points[:, i]) for i in (0, 1)])


def _cost(box: Bbox, taken: Sequence[Bbox], hidden: np.ndarray, frame: Bbox) -> float:
    """How much a text at `box` would hide: the frame, other texts, curves and points."""
    outside = box.x0 < frame.x0 or box.x1 > frame.x1 or box.y0 < frame.y0 or box.y1 > frame.y1
    return 1e4 * outside + 1e3 * box.count_overlaps(list(taken)) + box.padded(1.0).count_contains(hidden)
