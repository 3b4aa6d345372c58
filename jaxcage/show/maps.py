"""Maps over speed and a parameter: bifurcations followed over both, exponents, quantities and labels."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .._allowed import within
from .._errors import ArgumentError
from .._parameters import parameter_info, parameters
from ..analysis import failed
from ..orbits import Curve, Point, curve
from ..quantities import quantity
from ..solve import AbstractMethod
from . import style
from .diagrams import label_speed, reported
from .orbit_figures import chosen_pieces, mark_of
from .quantity_tables import column_of
from .tables import Column, Table, table
from .verdict_tables import motion_words


SPEED = "speed"
BELOW, ABOVE = 0.8, 1.25
"""Default range of a parameter, over its value."""
STEEPEST = 0.3
"""Largest absolute exponent of the colour scale."""
MAPPED = ("cage_slip", "friction_power_W")
"""Quantities in a map, if the model reports them."""
RPM = 30 / np.pi


@dataclasses.dataclass(frozen=True)
class Axis:
    """Parameter between two values, the second direction of a map."""

    name: str
    lower: float
    """Lowest value [SI]."""
    upper: float
    unit: str
    """SI unit."""
    speed_text: str = "cage speed"
    """Name of the speed, the first direction."""

    @property
    def words(self) -> str:
        """Name of the parameter in words."""
        return style.readable(self.name)

    @property
    def column(self) -> Column:
        """Column that shows its values."""
        return Column(self.name, unit=self.unit)

    def shown(self, values: Any) -> np.ndarray:
        """Values [SI] in display units."""
        return np.asarray(values * self.column.scale)


def parameter_axis(model: Any, name: str, lower: float | None = None, upper: float | None = None) -> Axis:
    """Axis of a parameter between two values [SI], by default a fifth below to a quarter above its own.

    **Raises:** `ArgumentError` for a range that is not allowed, or does not hold the value itself.
    """
    info, value = parameter_info(model)[name], float(parameters(model)[name])
    least = max(info.lower, 1.01 * float(model.eccentricity)) if name == "guidance_gap" else info.lower
    below, above = sorted((BELOW * value, ABOVE * value))
    low, high = max(below, least) if lower is None else lower, min(above, info.upper) if upper is None else upper
    unit = "" if info.unit == "1" else f" {info.unit}"
    for argument, given in (("lower", low), ("upper", high)):
        if not within(given, info.lower, info.upper):
            allowed = f"a value of {name} from {info.lower:g} to {info.upper:g}{unit}"
            raise ArgumentError(argument, said=f"must be {allowed}, but {given:g}{unit} was given.")
    if not low < value < high:
        wanted = f"must have {name} = {value:g}{unit} between them"
        raise ArgumentError("lower", "upper", said=f"{wanted}, but the range is {low:g} to {high:g}{unit}.")
    return Axis(name, low, high, info.unit, model.speed_text)


def follow_edges(
    model: Any,
    edges: Mapping[str, Point],
    speeds: tuple[float, float],
    axis: Axis,
    method: AbstractMethod | None,
    say: Callable[[str, int, int], None],
) -> tuple[list[Curve], dict[str, str]]:
    """Curves through named edges over speeds [rad/s] and a parameter, and reasons for those without one."""
    curves, refused = [], {}
    limits: dict[str, Any] = {"lower": axis.lower, "upper": axis.upper, "x_lower": speeds[0], "x_upper": speeds[1]}
    for done, (name, point) in enumerate(edges.items()):
        say("curves", done, len(edges))
        if point.kind == "branch-point":
            refused[name] = "a branch point"
            continue
        try:
            curves.append(curve(model, point, SPEED, axis.name, **limits, name=name, method=method))
        except ValueError:
            refused[name] = "Newton's method did not find it again"
    say("curves", len(edges), len(edges))
    return curves, refused


def curves_table(title: str, curves: list[Curve], axis: Axis) -> Table:
    """Table of the ranges that curves cover, and how they end."""
    ends = lambda name, values: {f"{name}_low": float(np.min(values)), f"{name}_high": float(np.max(values))}
    rows = [
        {"edge": c.name, "kind": c.kind, "points": int(np.size(c.x_value)), "ends": " / ".join(c.ended)}
        | {"x": RPM * np.asarray(c.x_value), "y": np.asarray(c.y_value), "genuine": c.genuine}
        | {**ends("x", c.x_value), **ends("y", c.y_value)}
        for c in curves
    ]
    columns: list[Column | str] = ["edge", "kind"]
    for key, name, unit in (("x", SPEED, "rad/s"), ("y", axis.name, axis.unit)):
        columns += [Column(f"{name} from", f"{key}_low", unit), Column("to", f"{key}_high", unit)]
    return table(title, rows, [*columns, "points", "ends"], "curves")


def top_exponent(found: xr.Dataset) -> Float[np.ndarray, "x y"]:
    """Largest exponent of the lanes that finished at each point of a map; NaN where all failed."""
    finished = np.where(failed(found), -np.inf, found["exponents"].values[..., 0]).max(axis=-1)
    return np.where(np.isfinite(finished), finished, np.nan)


def stability_map(axis: Axis, curves: Sequence[Curve], found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Largest exponents of a map over speed and a parameter, white at zero, with bifurcation curves on top, coloured by
    kind.

    **Raises:** `ValueError` if a curve is over anything else.
    """
    if other := [f"{c.y} over {c.x}" for c in curves if (c.x, c.y) != (SPEED, axis.name)]:
        raise ArgumentError("curves", said=f"must be of {axis.name} over speed, but {', '.join(other)} was given.")
    ax = style.axes_or_new(ax, 9.0, 5.0)
    for c in curves:
        _draw_curve(ax, c, RPM * np.asarray(c.x_value), axis.shown(c.y_value))
    if curves:
        style.legend_above(ax)
    ax.grid(False)
    x, y = _cells(found, axis)
    look = {"cmap": "RdBu_r", "vmin": -STEEPEST, "vmax": STEEPEST, "rasterized": True, "alpha": 0.85, "zorder": 0}
    mesh = ax.pcolormesh(x, y, np.ma.masked_invalid(top_exponent(found)).T, **look)
    ax.figure.colorbar(mesh, ax=ax, label=quantity("largest_exponent").label, pad=0.01, extend="both")
    ax.set(xlim=x[[0, -1]], ylim=y[[0, -1]], ylabel=axis.column.label)
    return label_speed(ax, axis.speed_text)


def _draw_curve(ax: Axes, curve: Curve, x: np.ndarray, y: np.ndarray) -> None:
    """Draw a curve, dotted where its points are neutral saddles and no bifurcations."""
    drawn = {line.get_label() for line in ax.get_lines()}
    genuine = np.asarray(curve.genuine[:-1] & curve.genuine[1:])
    look: Any = {"color": mark_of(curve.kind).colour, "path_effects": style.halo(3.6), "zorder": 3}
    for label, chosen, width, dash in (("neutral saddles", ~genuine, 1.6, ":"), (curve.kind, genuine, 2.0, "-")):
        if np.any(chosen):
            name = f"_{label}" if label in drawn else label
            ax.plot(*chosen_pieces(x, y, chosen), linewidth=width, linestyle=dash, **look, label=name)


def _cells(found: xr.Dataset, axis: Axis) -> tuple[np.ndarray, np.ndarray]:
    """Borders of the cells of a map over speed [rpm] and its parameter, halfway between the points."""
    sides = []
    for x in (RPM * found[SPEED].values, axis.shown(found[axis.name].values)):
        middle = (x[1:] + x[:-1]) / 2
        sides.append(np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]]))
    return sides[0], sides[1]


def map_figure(axis: Axis, curves: Sequence[Curve], found: xr.Dataset, title: str = "") -> Figure:
    """Figure of a map: largest exponents with the curves on top, labels, and means of reported quantities.

    **Arguments:** the parameter; curves; a map of labels; title.
    """
    borders = _cells(found, axis)

    def exponents(ax: Axes) -> None:
        stability_map(axis, curves, found, ax)
        ax.set_title("Largest exponent", fontsize=10, loc="left", pad=20 if curves else 6)

    def means(ax: Axes, name: str) -> None:
        column, z = column_of(found, name), found[name].mean("initial_state", skipna=True).values
        wide = np.nanmin(z) > 0 and np.nanmax(z) > 20 * np.nanmin(z)
        drawn = ax.pcolormesh(*borders, column.scale * z.T, cmap="viridis", norm=LogNorm() if wide else None)
        ax.figure.colorbar(drawn, ax=ax)
        ax.set_title(column.label, fontsize=10, loc="left")

    names = reported(found, MAPPED)
    labels = found["label"].values.astype(str)
    draw: list[Callable[[Axes], None]] = [exponents]
    if np.any(labels != labels.flat[0]):
        draw.append(lambda ax: _colour_labels(ax, *borders, labels))
    draw += [partial(means, name=name) for name in names]
    figure = style.panels(draw, 2, (11.5, 1.0 + 3.8 * ((len(draw) + 1) // 2)), title)
    for ax in figure.axes[1 : len(draw)]:
        ax.set_ylabel(axis.column.label)
        label_speed(ax, axis.speed_text).grid(False)
    return figure


def _colour_labels(ax: Axes, x: np.ndarray, y: np.ndarray, labels: np.ndarray) -> None:
    """Draw the labels as colours, grey where initial states differ or lanes failed."""
    kinds = np.where(np.char.startswith(labels, "periodic"), "periodic", labels)
    known = {**style.KIND_COLOURS, **style.MOTION_COLOURS}
    pale: Any = lambda colour: tuple(0.45 + 0.55 * part for part in to_rgb(colour))
    colour = lambda lanes: pale(known.get(lanes[0], style.GREY) if len(set(lanes)) == 1 else style.GREY)
    image = np.array([[colour(lanes.tolist()) for lanes in row] for row in kinds.swapaxes(0, 1)])
    ax.pcolormesh(x, y, image)
    ax.set_title("Label (grey: initial states differ, or failed)", fontsize=10, loc="left", pad=20)
    met = [name for name in known if np.any(kinds == name)]
    patches: list[Any] = [Patch(color=pale(known[name]), label=motion_words([name])) for name in met]
    style.legend_above(ax, handles=patches, size=8)
