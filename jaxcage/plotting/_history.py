"""Time history, orbit in the clearance circle, and each force, of one trajectory."""

import itertools
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from ..quantities import quantity
from ..solve import Trajectory
from ._style import (
    BLACK,
    BLUE,
    FORCE_COLOURS,
    GREY,
    OWN_COLOURS,
    VERMILION,
    axes_or_new,
    new_figure,
    shown,
)


Forces = Mapping[str, Float[np.ndarray, "samples 2"]]


def time_history(trajectory: Trajectory, ax: Axes | None = None) -> Axes:
    """Horizontal and vertical displacement of the cage over time."""
    ax = axes_or_new(ax, height=3.0)
    time = shown("time", trajectory.time)
    for name, i, colour in (("x_C", 0, VERMILION), ("y_C", 1, BLUE)):
        ax.plot(
            time,
            shown(name, trajectory.state[:, i]),
            color=colour,
            linewidth=0.9,
            label=quantity(name).symbol,
        )
    ax.set(
        xlabel=quantity("time").label,
        ylabel=f"Displacement [{quantity('x_C').shown_unit}]",
        xlim=_ends(time),
    )
    return _legend_beside(ax)


def orbit(trajectory: Trajectory, clearance: Float[np.ndarray, ""] | float, ax: Axes | None = None) -> Axes:
    """Path of the cage centre relative to the rib, in the clearance circle; the strobe points on it
    as dots.

    **Arguments:** trajectory; radial clearance [m]; axes.
    """
    ax = axes_or_new(ax, 5.0, 5.0)
    x, y = trajectory.state[:, 0], trajectory.state[:, 1]
    if trajectory.state.shape[1] == 8:
        x, y = x - trajectory.state[:, 2], y - trajectory.state[:, 3]
    radius = float(clearance) * quantity("x_C").factor
    path_in_circle(ax, shown("x_C", x), shown("y_C", y), radius, trajectory.samples, 1.08)
    ax.set(xlabel=quantity("x_C").label, ylabel=quantity("y_C").label)
    return ax


def path_in_circle(ax: Axes, x: np.ndarray, y: np.ndarray, radius: float, samples: int, reach: float) -> None:
    """A path in the clearance circle, a dot at each revolution; the axes end at `reach` times the radius."""
    ax.add_patch(Circle((0, 0), radius, fill=False, color=GREY, linewidth=1.0, linestyle="--"))
    ax.plot(x, y, color=BLUE, linewidth=0.7, alpha=0.8)
    ax.plot(x[::samples], y[::samples], ".", color=BLACK, markersize=4)
    limits = (-reach * radius, reach * radius)
    ax.set(xlim=limits, ylim=limits, aspect="equal")


def force_history(trajectory: Trajectory, forces: Forces, axis: int = 1, ax: Axes | None = None) -> Axes:
    """Each force on the cage over time, its horizontal (`axis` 0) or vertical (1) part."""
    ax = axes_or_new(ax, height=3.0)
    time = shown("time", trajectory.time)
    own = itertools.cycle(OWN_COLOURS)
    for name, force in forces.items():
        colour, line = (FORCE_COLOURS[name], "-") if name in FORCE_COLOURS else (next(own), "--")
        ax.plot(time, force[:, axis], color=colour, linestyle=line, linewidth=0.9, label=name)
    ax.set(
        xlabel=quantity("time").label,
        ylabel=f"{('Horizontal', 'Vertical')[axis]} force [N]",
        xlim=_ends(time),
    )
    return _legend_beside(ax)


def _ends(time: np.ndarray) -> tuple[float, float]:
    return float(time[0]), float(time[-1]) if time.size > 1 else float(time[0]) + 1.0


def _legend_beside(ax: Axes) -> Axes:
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9, handlelength=1.4)
    return ax


def simulation_figure(
    trajectory: Trajectory,
    forces: Forces,
    clearance: Float[np.ndarray, ""] | float,
    title: str = "",
) -> Figure:
    """Orbit, time history and each force of a trajectory on one page."""
    figure = new_figure(11.5, 6.4)
    grid = figure.add_gridspec(3, 2, width_ratios=(1, 1.7))
    history = figure.add_subplot(grid[0, 1])
    across = figure.add_subplot(grid[1, 1], sharex=history)
    upward = figure.add_subplot(grid[2, 1], sharex=history)
    orbit(trajectory, clearance, figure.add_subplot(grid[:, 0]))
    time_history(trajectory, history).set_xlabel("")
    force_history(trajectory, forces, 0, across).set_xlabel("")
    force_history(trajectory, forces, 1, upward)
    if (legend := across.get_legend()) is not None:
        legend.remove()
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure
