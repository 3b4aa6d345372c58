"""Maps over two parameters: bifurcation curves over the largest exponent, quantities and labels as colours."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .._errors import ArgumentError
from ..analysis import failed
from ..orbits import Curve
from ..quantities import quantity
from .diagrams import labelled, reported
from .orbit_figures import chosen_pieces, mark_of
from .speed_axes import label_speed
from .style import (
    GREY,
    KIND_COLOURS,
    MOTION_COLOURS,
    Halo,
    axes_or_new,
    dress,
    entitled,
    legend_above,
    new_figure,
    padded_limits,
    readable,
)
from .tables import SHOWN, factor


STEEPEST = 0.3
"""Exponent at which the colours end."""
MAPPED = ("cage_slip", "friction_power_W")
"""Quantities of a whole bearing in a map."""
SPEED = "speed"


def top_exponent(found: xr.Dataset) -> Float[np.ndarray, "x y"]:
    """Largest exponent of the lanes that finished at each point of a map; NaN where all failed."""
    finished = np.where(failed(found), -np.inf, found["exponents"].values[..., 0]).max(axis=-1)
    return np.where(np.isfinite(finished), finished, np.nan)


def _shown(values: np.ndarray, name: str, unit: str) -> tuple[Float[np.ndarray, " n"], str]:
    """Values of a parameter [SI] in the unit in which they are shown, and the label of their axis."""
    if name == SPEED:
        return np.asarray(values) * factor("rad/s", "rpm"), ""
    shown = SHOWN.get(unit, unit)
    return np.asarray(values) * factor(unit, shown), readable(name).capitalize() + (f" [{shown}]" if shown else "")


def _name_axes(ax: Axes, x: str, y: str) -> Axes:
    if x:
        ax.set_xlabel(x)
    else:
        label_speed(ax)
    ax.set_ylabel(y)
    return ax


def stability_map(
    curves: Sequence[Curve], ax: Axes | None = None, *, found: xr.Dataset | None = None, unit: str = "1"
) -> Axes:
    """Curves of bifurcations over speed, coloured by kind.

    **Arguments:** curves whose `x` is the speed; axes; a map of labels, whose largest exponents are drawn beneath with
    white at zero; SI unit of the parameter.

    **Raises:** `ValueError` if a curve is not over speed, or two have different parameters.
    """
    others = {c.y for c in curves}
    if any(c.x != SPEED for c in curves) or len(others) > 1:
        given = ", ".join(f"{c.y} over {c.x}" for c in curves)
        raise ArgumentError("curves", said=f"must all be of one parameter over speed, but {given} was given.")
    ax = axes_or_new(ax, 9.0, 5.0)
    lines = [(_shown(c.x_value, c.x, "rad/s")[0], _shown(c.y_value, c.y, unit)[0]) for c in curves]
    for c, (x, y) in zip(curves, lines, strict=True):
        _draw_curve(ax, c, x, y)
    if curves:
        legend_above(ax)
    if found is None:
        across, upward = (np.concatenate([line[i] for line in lines] or [np.zeros(0)]) for i in (0, 1))
        ax.set(xlim=padded_limits(across), ylim=padded_limits(upward))
        return _name_axes(ax, "", _shown(np.zeros(1), "".join(others), unit)[1])
    names = [str(name) for name in found["label"].dims[:2]]
    (x, across), (y, upward) = (_shown(found[name].values, name, unit) for name in names)
    ax.grid(False)
    style = {"cmap": "RdBu_r", "vmin": -STEEPEST, "vmax": STEEPEST, "rasterized": True, "alpha": 0.85, "zorder": 0}
    mesh = ax.pcolormesh(borders(x), borders(y), np.ma.masked_invalid(top_exponent(found)).T, **style)
    ax.figure.colorbar(mesh, ax=ax, label=quantity("largest_exponent").label, pad=0.01, extend="both")
    ax.set(xlim=borders(x)[[0, -1]], ylim=borders(y)[[0, -1]])
    return _name_axes(ax, across, upward)


def _draw_curve(ax: Axes, curve: Curve, x: np.ndarray, y: np.ndarray) -> None:
    """Draw the curve, dotted where its points are neutral saddles and no bifurcations."""
    drawn = {line.get_label() for line in ax.get_lines()}
    genuine = np.asarray(curve.genuine[:-1] & curve.genuine[1:])
    for label, chosen, width, dash in (("neutral saddles", ~genuine, 1.6, ":"), (curve.kind, genuine, 2.0, "-")):
        if np.any(chosen):
            name = f"_{label}" if label in drawn else label
            style = {"linestyle": dash, "color": mark_of(curve.kind).colour, "path_effects": [Halo(3.6)], "zorder": 3}
            ax.plot(*chosen_pieces(x, y, chosen), linewidth=width, **style, label=name)


def borders(x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n+1"]:
    """Borders of cells around ascending numbers, half way between them, of numbers in equal ratios in ratio."""
    if x.size > 2 and x[0] > 0 and np.allclose(np.diff(np.log(x)), np.log(x[1] / x[0])):
        return np.exp(_middles(np.log(x)))
    return _middles(x)


def _middles(x: np.ndarray) -> np.ndarray:
    middle = (x[1:] + x[:-1]) / 2
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])


def map_figure(found: xr.Dataset, title: str = "", unit: str = "1") -> Figure:
    """Quantities that the model reports, largest exponent and label over two parameters: means over initial states.

    **Arguments:** a map of labels; title; SI unit of the second parameter, whose axis is logarithmic if its values are
    in equal ratios.
    """
    names = [str(name) for name in found["label"].dims[:2]]
    (x, across), (y, upward) = (_shown(found[name].values, name, unit) for name in names)
    mean = lambda name: found[name].mean("start", skipna=True).values
    panels = [
        (label, times * mean(name)) for name in reported(found, MAPPED) for label, times in [labelled(found[name])]
    ]
    panels.append((quantity("largest_exponent").label, mean("exponents")[..., 0]))
    figure = new_figure(11.5, 1.0 + 3.5 * ((len(panels) + 2) // 2))
    cells = figure.subplots((len(panels) + 2) // 2, 2, sharex=True, sharey=True, squeeze=False)
    for ax in cells.ravel():
        dress(ax).grid(False)
    for ax, (label, z) in zip(cells.ravel(), panels, strict=False):
        ratio = np.nanmin(z) > 0 and np.nanmax(z) > 20 * np.nanmin(z)
        drawn = ax.pcolormesh(borders(x), borders(y), z.T, cmap="viridis", norm=LogNorm() if ratio else None)
        figure.colorbar(drawn, ax=ax)
        ax.set_title(label, fontsize=10, loc="left")
    _colour_labels(cells.ravel()[len(panels)], borders(x), borders(y), found["label"].values.astype(str))
    for ax in cells.ravel()[len(panels) + 1 :]:
        ax.set_axis_off()
    for ax in cells[-1]:
        _name_axes(ax, across, "")
    for ax in cells[:, 0]:
        ax.set_ylabel(upward)
    if not np.allclose(np.diff(borders(y), 2), 0.0, atol=1e-9 * float(np.ptp(y))):
        cells[0, 0].set_yscale("log")
    return entitled(figure, title)


def _colour_labels(ax: Axes, x: np.ndarray, y: np.ndarray, labels: np.ndarray) -> None:
    """Colours of the labels, grey where initial states differ or lanes failed."""
    kinds = np.where(np.char.startswith(labels, "periodic"), "periodic", labels)
    known = {**KIND_COLOURS, **MOTION_COLOURS}
    colour = lambda lanes: known.get(lanes[0], GREY) if len(set(lanes)) == 1 else GREY
    ax.pcolormesh(x, y, np.array([[_pale(colour(lanes.tolist())) for lanes in row] for row in kinds.swapaxes(0, 1)]))
    ax.set_title("Label (grey: the start decides, or failed)", fontsize=10, loc="left")
    met = [name for name in known if np.any(kinds == name)]
    patches: list[Any] = [Patch(color=_pale(known[name]), label=name.replace("_", " ")) for name in met]
    ax.legend(handles=patches, fontsize=8, loc="upper right")


def _pale(colour: str) -> tuple[float, float, float]:
    r, g, b = (0.45 + 0.55 * x for x in to_rgb(colour))
    return r, g, b
