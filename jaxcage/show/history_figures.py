"""One trajectory: displacements and forces over time, the path in the clearance circle, the strobe section."""

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from ..quantities import component_names, quantity
from ..solve import Trajectory
from .style import (
    BLACK,
    BLUE,
    FORCE_COLOURS,
    GREEN,
    GREY,
    OWN_COLOURS,
    PURPLE,
    SKY,
    VERMILION,
    axes_or_new,
    dots,
    entitled,
    legend_above,
    legend_beside,
    new_figure,
    padded_limits,
)


Forces = Mapping[str, Float[np.ndarray, "samples 2"]]
START_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY)


def time_history(trajectory: Trajectory, ax: Axes | None = None) -> Axes:
    """Horizontal and vertical displacement of the cage over time."""
    place = [(quantity(name), i) for i, name in enumerate(("x_C", "y_C"))]
    lines = {q.symbol: (q.factor * trajectory.state[:, i], (VERMILION, BLUE)[i], "-") for q, i in place}
    return _over_time(trajectory, lines, f"Displacement [{quantity('x_C').shown_unit}]", ax)


def force_history(trajectory: Trajectory, forces: Forces, axis: int = 1, ax: Axes | None = None) -> Axes:
    """Each force on the cage over time, its horizontal (`axis` 0) or vertical (1) component."""
    own = cycle(OWN_COLOURS)
    lines: dict[str, tuple[np.ndarray, str, str]] = {}
    for name, force in forces.items():
        colour, dash = (FORCE_COLOURS[name], "-") if name in FORCE_COLOURS else (next(own), "--")
        lines[name] = force[:, axis], colour, dash
    return _over_time(trajectory, lines, f"{('Horizontal', 'Vertical')[axis]} force [N]", ax)


def _over_time(
    trajectory: Trajectory, lines: Mapping[str, tuple[np.ndarray, str, str]], ylabel: str, ax: Axes | None
) -> Axes:
    ax = axes_or_new(ax, height=3.0)
    time = trajectory.time * quantity("time").factor
    for label, (values, colour, dash) in lines.items():
        ax.plot(time, values, color=colour, linestyle=dash, linewidth=0.9, label=label)
    ends = (float(time[0]), float(time[-1]) if time.size > 1 else float(time[0]) + 1.0)
    ax.set(xlabel=quantity("time").label, ylabel=ylabel, xlim=ends)
    legend_beside(ax)
    return ax


def orbit(trajectory: Trajectory, clearance: Float[np.ndarray, ""] | float, ax: Axes | None = None) -> Axes:
    """Path of the cage centre relative to the rib in the clearance circle, with a dot at each revolution.

    **Arguments:** trajectory; radial clearance [m]; axes.
    """
    ax = axes_or_new(ax, 5.0, 5.0)
    path = trajectory.state[:, :2]
    if trajectory.state.shape[1] == 8:
        path = path - trajectory.state[:, 2:4]
    times = quantity("x_C").factor
    path_in_circle(ax, times * path, times * float(clearance), trajectory.samples)
    ax.set(xlabel=quantity("x_C").label, ylabel=quantity("y_C").label)
    return ax


def path_in_circle(ax: Axes, path: Float[np.ndarray, "n 2"], radius: float, samples: int) -> None:
    """A path in the clearance circle, with a dot at each revolution of so many samples."""
    ax.add_patch(Circle((0, 0), radius, fill=False, color=GREY, linewidth=1.0, linestyle="--"))
    ax.plot(*path.T, color=BLUE, linewidth=0.7, alpha=0.8)
    ax.plot(*path[::samples].T, ".", color=BLACK, markersize=4)
    limits = (-1.08 * radius, 1.08 * radius)
    ax.set(xlim=limits, ylim=limits, aspect="equal")


def simulation_figure(
    trajectory: Trajectory, forces: Forces, clearance: Float[np.ndarray, ""] | float, title: str = ""
) -> Figure:
    """Path, time history and each force of a trajectory."""
    figure = new_figure(11.5, 6.4)
    grid = figure.add_gridspec(3, 2, width_ratios=(1, 1.7))
    history = figure.add_subplot(grid[0, 1])
    across, upward = (figure.add_subplot(grid[i, 1], sharex=history) for i in (1, 2))
    orbit(trajectory, clearance, figure.add_subplot(grid[:, 0]))
    time_history(trajectory, history).set_xlabel("")
    force_history(trajectory, forces, 0, across).set_xlabel("")
    force_history(trajectory, forces, 1, upward)
    if (legend := across.get_legend()) is not None:
        legend.remove()
    return entitled(figure, title)


def strobe_section(
    states: Float[np.ndarray, "starts revolutions dim"], ax: Axes | None = None, names: Sequence[str] = ()
) -> Axes:
    """Strobe states in the plane of vertical displacement and velocity, one colour for each initial state.

    **Arguments:** states at tau = 2 pi n [SI], coordinates before velocities; axes; names of the initial states.
    """
    ax = axes_or_new(ax, 6.5, 5.0)
    along = (1, 1 + states.shape[-1] // 2)
    place, velocity = (quantity(component_names(states.shape[-1])[i]) for i in along)
    x, y = (states[..., i] * named.factor for i, named in zip(along, (place, velocity), strict=True))
    for i, (across, up) in enumerate(zip(x, y, strict=True)):
        # Closed orbits of several initial states may coincide: the later ones are drawn smaller, on top.
        closed = _spread(across) < 1e-3 * _spread(x)
        size = 14.0 - 4 * min(i, 2) if closed else 7.0 if across.size <= 100 else 2.5
        style = dots(START_COLOURS[i % len(START_COLOURS)], size) | {"rasterized": across.size > 5000}
        ax.plot(across, up, **style, alpha=0.7, label=names[i] if names else f"start {i + 1}")
    ax.set(xlabel=place.label, ylabel=velocity.label, xlim=_wide_limits(x), ylim=_wide_limits(y))
    legend_above(ax, ncols=len(x))
    return ax


def _spread(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _wide_limits(values: np.ndarray) -> tuple[float, float]:
    """Limits so wide that the rounding of a periodic orbit is not enlarged to a cloud."""
    low, high = padded_limits(values)
    centre, least = (low + high) / 2, 0.02 * max(abs(low), abs(high))
    return min(low, centre - least), max(high, centre + least)
