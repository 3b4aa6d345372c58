"""Bifurcation curves in the plane of speed and a parameter, over the largest exponent."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from .._errors import ArgumentError
from ..orbits import Curve
from ..quantities import quantity
from ._branches import mark_of, runs
from ._elasticities import readable
from ._orbit_diagram import label_speed
from ._style import Halo, axes_or_new, padded_limits


Exponents = tuple[
    Float[np.ndarray, " speeds"],
    Float[np.ndarray, " values"],
    Float[np.ndarray, "speeds values"],
]
"""Speeds [rpm], values of the parameter [SI], largest exponent per revolution at each (NaN: unknown)."""
STEEPEST = 0.3
"""The colours end at this exponent: what lies beyond looks like it."""


def stability_map(
    curves: Sequence[Curve],
    ax: Axes | None = None,
    *,
    exponents: Exponents | None = None,
    y_unit: str = "",
    y_factor: float = 1.0,
    y_label: str | None = None,
) -> Axes:
    """Curves of bifurcations over speed, coloured by kind.

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
