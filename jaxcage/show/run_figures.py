"""Figures of one run: displacements, forces, path and strobe section of the cage; rollers, slips, spectra, loads."""

import dataclasses
from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Annulus, Circle, Polygon

from ..analysis import OrderSpectrum, RollerHistory, around, bearing_spectra, cage_forces
from ..bearing import LoadDistribution
from ..models import bearing_orders, roller_history
from ..quantities import component_names, quantity
from ..solve import Trajectory
from . import style


Forces = Mapping[str, Float[np.ndarray, "samples 2"]]
STATE_COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE, style.SKY)
MM = 1e3
LONGEST_ARROW = 0.14
"""Length of the arrow of the largest pocket force of a run, relative to the outside diameter."""
SPECTRA = {"cage_place": "Cage, vertical / clearance", "pocket_force": "Pockets, vertical [N]"}
"""Axis labels of the quantities that have a spectrum."""


@dataclasses.dataclass(frozen=True)
class Rollers:
    """Rollers of a bearing during a run."""

    history: RollerHistory
    around: xr.Dataset
    spectra: Mapping[str, OrderSpectrum]
    """Empty for a run of less than two revolutions."""
    orders: Mapping[str, float]


def rollers_of(model: Any, run: Trajectory) -> Rollers | None:
    """Rollers of a run; None for a model without rollers."""
    if model.samples == 1:
        return None
    history = roller_history(model, run)
    several = len(history.time) >= 2 * history.samples
    return Rollers(history, around(history), bearing_spectra(history) if several else {}, bearing_orders(model, run))


def time_history(trajectory: Trajectory, ax: Axes | None = None) -> Axes:
    """Horizontal and vertical displacement of the cage over time."""
    place = [(quantity(name), i) for i, name in enumerate(("x_C", "y_C"))]
    lines = {q.symbol: (q.factor * trajectory.state[:, i], (style.VERMILION, style.BLUE)[i], "-") for q, i in place}
    return _over_time(trajectory, lines, f"Displacement [{quantity('x_C').shown_unit}]", ax)


def force_history(trajectory: Trajectory, forces: Forces, axis: int = 1, ax: Axes | None = None) -> Axes:
    """Each force on the cage over time, horizontal (`axis` 0) or vertical (1)."""
    own = cycle(style.OWN_COLOURS)
    lines: dict[str, tuple[np.ndarray, str, str]] = {}
    for name, force in forces.items():
        colour, dash = (style.FORCE_COLOURS[name], "-") if name in style.FORCE_COLOURS else (next(own), "--")
        lines[name] = force[:, axis], colour, dash
    return _over_time(trajectory, lines, f"{('Horizontal', 'Vertical')[axis]} force [N]", ax)


def _over_time(
    trajectory: Trajectory, lines: Mapping[str, tuple[np.ndarray, str, str]], ylabel: str, ax: Axes | None
) -> Axes:
    ax = style.axes_or_new(ax, height=3.0)
    time = trajectory.time * quantity("time").factor
    for label, (values, colour, dash) in lines.items():
        ax.plot(time, values, color=colour, linestyle=dash, linewidth=0.9, label=label)
    ax.margins(x=0)
    ax.set(xlabel=quantity("time").label, ylabel=ylabel)
    style.legend_beside(ax)
    return ax


def orbit(trajectory: Trajectory, clearance: float, ax: Axes | None = None) -> Axes:
    """Path of the cage centre relative to the rib, in the circle of the radial clearance [m], with a dot per
    revolution."""
    ax = style.axes_or_new(ax, 5.0, 5.0)
    path = trajectory.state[:, :2]
    if trajectory.state.shape[1] == 8:  # an elastic rib
        path = path - trajectory.state[:, 2:4]
    times = quantity("x_C").factor
    _path_in_circle(ax, times * path, times * clearance, trajectory.samples)
    ax.set(xlabel=quantity("x_C").label, ylabel=quantity("y_C").label)
    return ax


def _path_in_circle(ax: Axes, path: Float[np.ndarray, "n 2"], radius: float, samples: int) -> None:
    ax.add_patch(Circle((0, 0), radius, fill=False, color=style.GREY, linewidth=1.0, linestyle="--"))
    ax.plot(*path.T, color=style.BLUE, linewidth=0.7, alpha=0.8)
    ax.plot(*path[::samples].T, ".", color=style.BLACK, markersize=4)
    limits = (-1.08 * radius, 1.08 * radius)
    ax.set(xlim=limits, ylim=limits, aspect="equal")


def run_figure(model: Any, run: Trajectory, rollers: Rollers | None, title: str = "") -> Figure:
    """Figure of one run: path, time history and each force of a cage, or a bearing with its rollers."""
    if rollers is not None:
        return _bearing_figure(model, run, rollers, title)
    forces, figure = cage_forces(model, run), style.new_figure(11.5, 6.4)
    grid = figure.add_gridspec(3, 2, width_ratios=(1, 1.7))
    history = figure.add_subplot(grid[0, 1])
    across, upward = (figure.add_subplot(grid[i, 1], sharex=history) for i in (1, 2))
    orbit(run, float(model.clearance), figure.add_subplot(grid[:, 0]))
    time_history(run, history).set_xlabel("")
    force_history(run, forces, 0, across).set_xlabel("")
    force_history(run, forces, 1, upward)
    if (legend := across.get_legend()) is not None:
        legend.remove()
    return style.entitled(figure, title)


def strobe_section(
    states: Float[np.ndarray, "initial_states revolutions dim"], ax: Axes | None = None, names: Sequence[str] = ()
) -> Axes:
    """Strobe states in the plane of vertical displacement and velocity, one colour for each initial state.

    **Arguments:** states at tau = 2 pi n [SI], coordinates before velocities; axes; names of the initial states.
    """
    ax = style.axes_or_new(ax, 6.5, 5.0)
    along = (1, 1 + states.shape[-1] // 2)
    place, velocity = (quantity(component_names(states.shape[-1])[i]) for i in along)
    x, y = (states[..., i] * named.factor for i, named in zip(along, (place, velocity), strict=True))
    for i, (across, up) in enumerate(zip(x, y, strict=True)):
        # Orbits of several initial states may coincide: the later ones are drawn smaller, on top.
        look = style.dots(STATE_COLOURS[i % len(STATE_COLOURS)], max(7.0 - 2 * i, 2.5) if across.size <= 100 else 2.5)
        label = names[i] if names else f"initial state {i + 1}"
        ax.plot(across, up, **look, rasterized=across.size > 5000, alpha=0.7, label=label)
    ax.set(xlabel=place.label, ylabel=velocity.label, xlim=_wide_limits(x), ylim=_wide_limits(y))
    style.legend_above(ax, ncols=min(len(x), 2))
    return ax


def _wide_limits(values: np.ndarray) -> tuple[float, float]:
    """Limits wide enough that rounding errors of a periodic orbit do not look like a cloud."""
    low, high = style.padded_limits(values)
    centre, least = (low + high) / 2, 0.02 * max(abs(low), abs(high))
    return min(low, centre - least), max(high, centre + least)


def _bearing_figure(model: Any, run: Trajectory, found: Rollers, title: str) -> Figure:
    """Bearing at its largest pocket force, path of the cage, slips and forces around it, spectra if any."""
    history, rows = found.history, 4 if found.spectra else 3
    figure = style.new_figure(12.0, 11.0 if found.spectra else 8.0)
    grid = figure.add_gridspec(rows, 2, height_ratios=(2.4, 1, 1, 1)[:rows])
    at = lambda row, column: style.dress(figure.add_subplot(grid[row, column]))
    _drawing(at(0, 0), model, run, history)
    path = at(0, 1)
    _path_in_circle(path, history.place, 1.0, history.samples)
    path.set(xlabel="Cage centre, horizontal / clearance", ylabel="Cage centre, vertical / clearance")
    _slip_around(at(1, 0), found.around)
    _pocket_force_around(at(1, 1), found.around)
    forces = at(2, slice(None))
    turns = np.abs(history.angle - history.angle[0]) / (2 * np.pi)
    largest, land = np.abs(history.pocket_force).max(axis=1), np.hypot(*history.land_on_cage.T)
    forces.plot(turns, largest, color=style.VERMILION, linewidth=0.6, label="largest pocket")
    forces.plot(turns, land, color=style.BLUE, linewidth=0.8, label="land")
    forces.set(xlim=(0, turns[-1]), xlabel="Revolutions of the cage", ylabel="Force [N]")
    style.legend_beside(forces, 8)
    for i, (name, spectrum) in enumerate(found.spectra.items()):
        _spectrum(at(3, i), spectrum, found.orders, SPECTRA[name])
        if i:
            style.legend_beside(figure.axes[-1], 7)
    return style.entitled(figure, title)


def _drawing(ax: Axes, model: Any, run: Trajectory, history: RollerHistory) -> None:
    """Draw rings, rollers and cage at the largest pocket force, to scale; arrows are the forces of the rollers on the
    bars. Displacement and clearances of the cage, tenths of a millimetre, are not magnified."""
    ax.grid(False)
    ax.spines[:].set_visible(False)
    sample = int(np.abs(history.pocket_force).max(axis=1).argmax())
    bearing, ring = model.bearing, {"facecolor": style.GRID, "edgecolor": style.GREY, "linewidth": 0.8}
    outside, bore = MM * float(bearing.outside_diameter) / 2, MM * float(bearing.bore) / 2
    outer, inner = MM * float(model.outer_radius), MM * float(model.inner_radius)
    ax.add_patch(Annulus((0, 0), outside, outside - outer, **ring))
    ax.add_patch(Annulus(tuple(MM * run.bodies[sample, 5:7]), inner, inner - bore, **ring))
    angle, half = history.roller_angle[sample], MM * float(bearing.roller_diameter) / 2
    out, along = np.array([np.cos(angle), np.sin(angle)]).T, np.array([-np.sin(angle), np.cos(angle)]).T
    centres = MM * run.rollers[sample, 2][:, None] * out
    share = history.inner_load[sample] / max(float(history.inner_load.max()), 1e-9)
    for centre, load in zip(centres, share, strict=True):
        face = to_rgba(style.BLUE, 0.08 + 0.6 * float(load))
        ax.add_patch(Circle(tuple(centre), half, facecolor=face, edgecolor=style.BLACK, linewidth=0.7))
    for bar in _bars(model, run, sample):
        ax.add_patch(Polygon(bar, facecolor=style.ORANGE, edgecolor=style.BLACK, linewidth=0.5, alpha=0.55))
    force, longest = history.pocket_force[sample], LONGEST_ARROW * 2 * outside
    length = longest * force / max(float(np.abs(force).max()), 1e-9)
    pushed = np.abs(length) > 0.01 * longest
    begin, arrows = centres + np.sign(force)[:, None] * half * along, length[:, None] * along
    look: Any = dict(angles="xy", scale_units="xy", scale=1, width=0.005, color=style.VERMILION, zorder=5)
    ax.quiver(*begin[pushed].T, *arrows[pushed].T, **look)
    reach = (-1.06 * outside, 1.06 * outside)
    ax.set(xticks=[], yticks=[], aspect="equal", xlim=reach, ylim=reach)
    time, most = 1e3 * (history.time[sample] - history.time[0]), run.largest("pocket_force")
    largest = f"largest pocket force {np.abs(force).max():.0f} N (of {most:.0f} N at most, between samples too)"
    ax.set_title(f"{time:.2f} ms: {largest}", fontsize=9)


def _bars(model: Any, run: Trajectory, sample: int) -> list[np.ndarray]:
    """Corners of the bars [mm], drawn from the guiding surface towards the roller centres."""
    n, free = model.bearing.n_rollers, float(model.bearing.roller_diameter + model.bearing.pocket_clearance) / 2
    pitch, land = float(model.outer_radius - model.bearing.roller_diameter / 2), float(model.land_radius)
    inner, outer = sorted((land, pitch - 0.6 * (land - pitch)))
    angles = run.angle[sample] + 2 * np.pi * np.arange(n + 1) / n
    corner = lambda at, r, side: (
        np.sqrt(r * r - free * free) * np.array([np.cos(at), np.sin(at)])
        + (side * free * np.array([-np.sin(at), np.cos(at)]))
    )
    ends = lambda left, right: ((left, inner, 1), (left, outer, 1), (right, outer, -1), (right, inner, -1))
    centre = MM * run.bodies[sample, 0:2]
    return [
        np.array([centre + MM * corner(*end) for end in ends(left, right)])
        for left, right in zip(angles[:-1], angles[1:], strict=True)
    ]


def _slip_around(ax: Axes, found: xr.Dataset) -> None:
    other = ax.twinx()
    other.spines[["top", "left"]].set_visible(False)
    _circumference(ax, "Slip of the rollers [%]")
    other.set_ylabel("Sliding on the inner ring [m/s]")
    slip, sliding = 100 * found.roller_slip, found.inner_sliding
    for axis, values, colour in ((ax, slip, style.BLUE), (other, sliding, style.VERMILION)):
        axis.step(np.degrees(found.angle), values, where="mid", color=colour, linewidth=1.1)
        axis.yaxis.label.set_color(colour)
        axis.tick_params(axis="y", labelsize=9, colors=colour)


def _pocket_force_around(ax: Axes, found: xr.Dataset) -> None:
    """Mean pocket force over the circumference, of rollers that drive and of rollers that brake the cage."""
    degrees, width = np.degrees(found.angle), 0.9 * 360 / len(found.angle)
    ax.bar(degrees, found.driving_force, width, color=style.GREEN, label="rollers drive the cage")
    ax.bar(degrees, -found.braking_force, width, color=style.VERMILION, label="rollers brake the cage")
    ax.axhline(0, color=style.GREY, linewidth=0.8)
    ax.legend(frameon=False, fontsize=8, loc="upper left")
    _circumference(ax, "Mean pocket force [N]")


def _circumference(ax: Axes, ylabel: str) -> None:
    ax.axvline(270, color=style.GREY, linewidth=0.8, linestyle="--")
    ax.set(xlim=(0, 360), xticks=range(0, 361, 90), ylabel=ylabel)
    ax.set_xlabel("Place on the circumference [°], load at 270°")


def _spectrum(ax: Axes, spectrum: OrderSpectrum, orders: Mapping[str, float], ylabel: str) -> None:
    """Amplitudes by order of the cage speed, with the frequencies of the bearing marked."""
    keep = (spectrum.order > 0) & (spectrum.order <= 1.15 * max(orders.values()))
    amplitude = spectrum.amplitude[keep]
    ax.semilogy(spectrum.order[keep], np.maximum(amplitude, 1e-12), color=style.BLACK, linewidth=0.8)
    for colour, (name, order) in zip(cycle(style.LINE_COLOURS), orders.items(), strict=False):
        ax.axvline(order, color=colour, linewidth=1.1, linestyle="--", label=f"{name} {order:.3g}")
    ax.set(ylim=(0.5 * max(amplitude.min(), 1e-6 * amplitude.max()), 2 * amplitude.max()))
    ax.set(xlabel="Order of the cage speed", ylabel=ylabel)


def load_bars(distribution: LoadDistribution, ax: Axes | None = None) -> Axes:
    """Bar chart of the inner-raceway load of every roller over its angle from the load; dashed lines bound the loaded
    zone."""
    ax = style.axes_or_new(ax, 7.0, 3.6)
    angles = (np.degrees(np.asarray(distribution.roller_angles)) + 270) % 360 - 180
    half = float(np.degrees(np.asarray(distribution.half_angle)))
    ax.bar(angles, np.asarray(distribution.inner_loads), width=0.5 * 360 / angles.size, color=style.BLUE)
    for edge, label in ((-half, f"loaded zone, half angle {half:.1f}°"), (half, None)):
        ax.axvline(edge, color=style.GREY, linewidth=1.0, linestyle="--", label=label)
    ax.set(xlim=(-190, 190), xticks=range(-180, 181, 45))
    ax.set(xlabel="Angle from the load [°]", ylabel="Roller load on the inner raceway [N]")
    ax.legend(frameon=False, fontsize=9)
    return ax
