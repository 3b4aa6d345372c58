"""The whole bearing: drawn to scale with pocket forces, slips around it, whirl of the cage, spectra."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Annulus, Circle, FancyArrowPatch, Patch, Polygon

from ..analysis import Around, BearingHistory, BearingSweep, BearingZone, OrderSpectrum
from ..models import BearingModel
from ..solve import Trajectory
from ..sweeps import BearingUpDown
from ._history import path_in_circle
from ._style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GRID,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    ZONE,
    axes_or_new,
    dress,
    new_figure,
)


MM = 1e3
LONGEST_ARROW = 0.14
"""Of the outside diameter, for the largest pocket force of the run."""
MARK_COLOURS = (BLUE, SKY, GREEN, PURPLE, VERMILION, ORANGE)


def bearing_drawing(
    model: BearingModel, run: Trajectory, history: BearingHistory, sample: int, ax: Axes | None = None
) -> Axes:
    """Rings, rollers and cage at one sample, to scale; arrows are the forces of the rollers on the cage's bars.

    The cage's displacement and clearances are drawn as they are: a few tenths of a millimetre. The longest arrow is the
    largest pocket force at any sample of the run.
    """
    ax = axes_or_new(ax, 6.0, 6.0)
    ax.grid(False)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set(xticks=[], yticks=[], aspect="equal")
    ring: dict[str, Any] = {"facecolor": GRID, "edgecolor": GREY, "linewidth": 0.8}
    outside, raceway = MM * float(model.bearing.outside_diameter) / 2, MM * float(model.outer_radius)
    ax.add_artist(Annulus((0, 0), outside, outside - raceway, **ring))
    bore, raceway = MM * float(model.bearing.bore) / 2, MM * float(model.inner_radius)
    x, y = MM * run.bodies[sample, 5:7]
    ax.add_artist(Annulus((x, y), raceway, raceway - bore, **ring))
    parts = _rollers(model, run, history, sample) + _bars(model, run, sample) + _arrows(model, run, history, sample)
    for artist in parts:
        ax.add_artist(artist)
    half = 0.53 * MM * float(model.bearing.outside_diameter)
    ax.set(xlim=(-half, half), ylim=(-half, half))
    now = np.abs(history.pocket_force[sample])
    most = run.largest("pocket_force")
    ax.set_title(
        f"{1e3 * (history.time[sample] - history.time[0]):.2f} ms: largest pocket force {now.max():.0f} N"
        f" (of {most:.0f} N at most, between samples too)",
        fontsize=9,
    )
    return ax


def _rollers(model: BearingModel, run: Trajectory, history: BearingHistory, sample: int) -> list[Artist]:
    radius = MM * run.rollers[sample, 2]
    angle, half = history.roller_angle[sample], MM * float(model.bearing.roller_diameter) / 2
    heaviest = max(float(history.inner_load.max()), 1e-9)
    shade = lambda load: to_rgba(BLUE, 0.08 + 0.6 * load / heaviest)
    return [
        Circle((r * np.cos(psi), r * np.sin(psi)), half, facecolor=shade(load), edgecolor=BLACK, linewidth=0.7)
        for r, psi, load in zip(radius, angle, history.inner_load[sample], strict=True)
    ]


def _bars(model: BearingModel, run: Trajectory, sample: int) -> list[Artist]:
    """The bars between the pockets, in the height that the guiding surface and the rollers' centres leave them."""
    centre, theta = MM * run.bodies[sample, 0:2], run.angle[sample]
    n, free = model.bearing.n_rollers, float(model.bearing.roller_diameter + model.bearing.pocket_clearance) / 2
    pitch = float(model.outer_radius - model.bearing.roller_diameter / 2)
    inner, outer = _bar_ends(model, pitch)
    found: list[Artist] = []
    for j in range(n):
        left, right = theta + 2 * np.pi * j / n, theta + 2 * np.pi * (j + 1) / n
        corners = []
        for r, side in ((inner, 1), (outer, 1), (outer, -1), (inner, -1)):
            at = left if side > 0 else right
            t, out = np.array([-np.sin(at), np.cos(at)]), np.array([np.cos(at), np.sin(at)])
            corners.append(centre + MM * (np.sqrt(r * r - free * free) * out + side * free * t))
        found.append(Polygon(corners, facecolor=ORANGE, edgecolor=BLACK, linewidth=0.5, alpha=0.55))
    return found


def _bar_ends(model: BearingModel, pitch: float) -> tuple[float, float]:
    land = float(model.land_radius)
    return (pitch - abs(land - pitch) * 0.6, land) if land > pitch else (land, pitch + abs(land - pitch) * 0.6)


def _arrows(model: BearingModel, run: Trajectory, history: BearingHistory, sample: int) -> list[Artist]:
    force = history.pocket_force[sample]
    longest = LONGEST_ARROW * MM * float(model.bearing.outside_diameter)
    scale = longest / max(float(np.abs(history.pocket_force).max()), 1e-9)
    radius, half = MM * run.rollers[sample, 2], MM * float(model.bearing.roller_diameter) / 2
    found: list[Artist] = []
    for r, psi, f in zip(radius, history.roller_angle[sample], force, strict=True):
        if abs(f) * scale < 0.01 * longest:
            continue
        t, out = np.array([-np.sin(psi), np.cos(psi)]), np.array([np.cos(psi), np.sin(psi)])
        begin = r * out + np.sign(f) * half * t
        found.append(
            FancyArrowPatch(
                tuple(begin),
                tuple(begin + scale * f * t),
                arrowstyle="-|>",
                mutation_scale=8,
                shrinkA=0,
                shrinkB=0,
                color=VERMILION,
                linewidth=1.4,
                zorder=5,
            )
        )
    return found


def slip_around(found: Around, ax: Axes | None = None) -> Axes:
    """Mean slip of the rollers, and how fast they slide on the inner ring, over the circumference."""
    ax = axes_or_new(ax, 7.0, 3.2)
    degrees = np.degrees(found.angle)
    ax.step(degrees, 100 * found.roller_slip, where="mid", color=BLUE, linewidth=1.2)
    _around_axis(ax, "Slip of the rollers [%]")
    other = ax.twinx()
    other.spines[["top", "left"]].set_visible(False)
    other.step(degrees, found.inner_sliding, where="mid", color=VERMILION, linewidth=1.0)
    other.set_ylabel("Sliding on the inner ring [m/s]", color=VERMILION)
    other.tick_params(labelsize=9, colors=VERMILION)
    ax.yaxis.label.set_color(BLUE)
    ax.tick_params(axis="y", colors=BLUE)
    return ax


def pocket_force_around(found: Around, ax: Axes | None = None) -> Axes:
    """Mean pocket force at each place of the circumference: of rollers that drive the cage or hold it back."""
    ax = axes_or_new(ax, 7.0, 3.2)
    degrees, width = np.degrees(found.angle), 0.9 * 360 / len(found.angle)
    ax.bar(degrees, found.driving_force, width, color=GREEN, label="rollers drive the cage")
    ax.bar(degrees, -found.braking_force, width, color=VERMILION, label="they hold it back")
    ax.axhline(0, color=GREY, linewidth=0.8)
    _around_axis(ax, "Mean pocket force [N]")
    ax.legend(frameon=False, fontsize=8, loc="upper left")
    return ax


def _around_axis(ax: Axes, ylabel: str) -> None:
    ax.axvline(270, color=GREY, linewidth=0.8, linestyle="--")
    ax.set(
        xlim=(0, 360), xticks=range(0, 361, 90), xlabel="Place on the circumference [°], load at 270°", ylabel=ylabel
    )


def cage_orbit(history: BearingHistory, ax: Axes | None = None) -> Axes:
    """Path of the cage's centre in the clearance circle, a dot at each revolution."""
    ax = axes_or_new(ax, 5.0, 5.0)
    x, y = history.place.T
    path_in_circle(ax, x, y, 1.0, history.samples, 1.1)
    ax.set(xlabel="Cage centre, horizontal / clearance", ylabel="Cage centre, vertical / clearance")
    return ax


def marked_spectrum(spectrum: OrderSpectrum, orders: Mapping[str, float], ylabel: str, ax: Axes | None = None) -> Axes:
    """Amplitudes by order of the cage's speed, with the frequencies of the bearing marked."""
    ax = axes_or_new(ax, 7.0, 3.0)
    keep = (spectrum.order > 0) & (spectrum.order <= 1.15 * max(orders.values()))
    ax.semilogy(spectrum.order[keep], np.maximum(spectrum.amplitude[keep], 1e-12), color=BLACK, linewidth=0.8)
    for colour, (name, order) in zip(cycle(MARK_COLOURS), orders.items(), strict=False):
        ax.axvline(order, color=colour, linewidth=1.1, linestyle="--", label=f"{name} {order:.3g}")
    shown = spectrum.amplitude[keep]
    ax.set(
        ylim=(0.5 * max(shown.min(), 1e-6 * shown.max()), 2 * shown.max()),
        xlabel="Order of the cage's speed",
        ylabel=ylabel,
    )
    ax.legend(frameon=False, fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def bearing_figure(
    model: BearingModel,
    run: Trajectory,
    history: BearingHistory,
    circumference: Around,
    spectra: Mapping[str, OrderSpectrum],
    orders: Mapping[str, float],
    title: str = "",
) -> Figure:
    """The bearing at its largest pocket force, the cage's orbit, slips and forces around it, and spectra if there are
    any.
    """
    figure = new_figure(12.0, 11.0 if spectra else 8.0)
    grid = figure.add_gridspec(4 if spectra else 3, 2, height_ratios=(2.4, 1, 1, 1)[: 4 if spectra else 3])
    worst = int(np.abs(history.pocket_force).max(axis=1).argmax())
    bearing_drawing(model, run, history, worst, figure.add_subplot(grid[0, 0]))
    cage_orbit(history, figure.add_subplot(grid[0, 1]))
    slip_around(circumference, figure.add_subplot(grid[1, 0]))
    pocket_force_around(circumference, figure.add_subplot(grid[1, 1]))
    force_over_time(history, figure.add_subplot(grid[2, :]))
    labels = {"cage_place": "Cage, vertical / clearance", "pocket_force": "Pockets, vertical [N]"}
    for i, (name, spectrum) in enumerate(spectra.items()):
        ax = marked_spectrum(spectrum, orders, labels.get(name, name), figure.add_subplot(grid[3, i]))
        if i == 0 and (legend := ax.get_legend()) is not None:
            legend.remove()
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def force_over_time(history: BearingHistory, ax: Axes | None = None) -> Axes:
    """Largest pocket force, and the land's force on the cage, over the revolutions of the cage."""
    ax = axes_or_new(ax, 7.0, 3.0)
    turns = np.abs(history.angle - history.angle[0]) / (2 * np.pi)
    ax.plot(turns, np.abs(history.pocket_force).max(axis=1), color=VERMILION, linewidth=0.6, label="largest pocket")
    ax.plot(turns, np.hypot(*history.land_on_cage.T), color=BLUE, linewidth=0.8, label="land")
    ax.set(xlim=(0, turns[-1]), xlabel="Revolutions of the cage", ylabel="Force [N]")
    ax.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


STATE_COLOURS = {"circular": GREEN, "locally_periodic": BLUE, "disordered": VERMILION}
"""Of what the cage's centre does; grey where the start decides, or lanes failed."""


def bearing_sweep_figure(found: BearingSweep, title: str = "", zones: Sequence[BearingZone] = ()) -> Figure:
    """Slip, pocket forces, power lost, largest exponent and equivalent synchronous force over the shaft's speed, a line
    for each start, with standard errors where they are known. Zones are shaded by the state of the cage.
    """
    figure = new_figure(11.5, 8.5)
    axes = figure.subplots(3, 2, sharex=True)
    over_shaft_speed(found, 100 * found.cage_slip, "Cage slip [%]", axes[0, 0], 100 * found.standard_error("cage_slip"))
    force = found.standard_error("pocket_force_mean_sum_N")
    over_shaft_speed(found, found.pocket_force_mean_sum_N, "Sum of pocket forces, mean [N]", axes[0, 1], force)
    over_shaft_speed(found, found.pocket_force_max_N, "Largest pocket force [N]", axes[1, 0])
    lost = found.standard_error("friction_power_W")
    over_shaft_speed(found, found.friction_power_W, "Power lost [W]", axes[1, 1], lost)
    over_shaft_speed(found, found.exponent, "Largest exponent per revolution", axes[2, 0], found.exponent_error)
    synchronous, error = found.synchronous_force_x_N, found.synchronous_force_error_N
    over_shaft_speed(found, synchronous, "Equivalent synchronous force [N]", axes[2, 1], error)
    for ax in axes[2]:
        ax.set_xlabel("Shaft speed [rpm]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    for zone in zones if len(found.rpm) > 1 else ():
        for ax in axes.ravel():
            ax.axvspan(zone.low_rpm, zone.high_rpm, color=_state_colour(zone.states), alpha=0.1, linewidth=0, zorder=0)
    if zones and len(found.rpm) > 1:
        colours = {" or ".join(zone.states).replace("_", " "): _state_colour(zone.states) for zone in zones}
        patches = [Patch(color=colour, alpha=0.25, label=name) for name, colour in colours.items()]
        figure.legend(handles=patches, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def _state_colour(states: Sequence[str]) -> str:
    return STATE_COLOURS.get(states[0], GREY) if len(states) == 1 else GREY


def _pale(colour: str) -> tuple[float, float, float]:
    r, g, b = (0.45 + 0.55 * x for x in to_rgb(colour))
    return r, g, b


def bearing_map_figure(
    found: Sequence[BearingSweep],
    values: Float[np.ndarray, " rows"],
    label: str,
    title: str = "",
    logarithmic: bool = False,
) -> Figure:
    """Slip, power lost, largest exponent and state over the shaft's speed and a parameter: means over starts.

    **Arguments:** a sweep for each value, all at the same speeds; values as they are shown, ascending; the parameter's
    label; whether the axis of the values is logarithmic.
    """
    figure = new_figure(11.5, 8.0)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    speeds, mean = found[0].rpm, lambda name: np.array([np.nanmean(getattr(each, name), axis=1) for each in found])
    x, y = _borders(speeds), np.exp(_borders(np.log(values))) if logarithmic else _borders(values)
    panels = (("Cage slip [%]", 100 * mean("cage_slip")), ("Power lost [W]", mean("friction_power_W")))
    for ax, (name, z) in zip(
        axes.ravel(), (*panels, ("Largest exponent per revolution", mean("exponent"))), strict=False
    ):
        dress(ax).grid(False)
        positive = np.nanmin(z) > 0 and np.nanmax(z) > 20 * np.nanmin(z)
        drawn = ax.pcolormesh(x, y, z, cmap="viridis", norm=LogNorm() if positive else None)
        figure.colorbar(drawn, ax=ax)
        ax.set_title(name, fontsize=10, loc="left")
    ax = dress(axes[1, 1])
    ax.grid(False)
    ax.pcolormesh(
        x, y, np.array([[_pale(_state_colour(sorted(set(row.tolist())))) for row in each.state] for each in found])
    )
    ax.set_title("State of the cage (grey: the start decides, or failed)", fontsize=10, loc="left")
    patches = [Patch(color=_pale(c), label=n.replace("_", " ")) for n, c in STATE_COLOURS.items()]
    ax.legend(handles=patches, fontsize=8, loc="upper right")
    for ax in axes[1]:
        ax.set_xlabel("Shaft speed [rpm]")
    for ax in axes[:, 0]:
        ax.set_ylabel(label)
        if logarithmic:
            ax.set_yscale("log")
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def _borders(x: np.ndarray) -> np.ndarray:
    """Of cells around ascending numbers."""
    middle = (x[1:] + x[:-1]) / 2
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])


def bearing_ramp_figure(found: BearingUpDown, title: str = "") -> Figure:
    """Slip, largest eccentricity ratio and power lost over the shaft's speed, both ways; shaded where slips differ."""
    figure = new_figure(9.5, 8.0)
    axes = figure.subplots(3, 1, sharex=True)
    for way, colour, label in ((found.up, BLUE, "run-up"), (found.down, VERMILION, "run-down")):
        style: Any = dict(color=colour, marker=".", linewidth=1.1, label=label)
        axes[0].errorbar(found.rpm, 100 * way.cage_slip, 100 * np.nan_to_num(way.cage_slip_error), **style)
        axes[1].plot(found.rpm, way.eccentricity, **style)
        axes[2].plot(found.rpm, way.friction_power_W, **style)
    half = 0.5 * float(found.rpm[1] - found.rpm[0])
    for ax, name in zip(axes, ("Cage slip [%]", "Largest eccentricity ratio", "Power lost [W]"), strict=True):
        dress(ax).set_ylabel(name)
        for low, high in found.stretches:
            ax.axvspan(low - half, high + half, color=ZONE, linewidth=0, zorder=0)
    axes[0].legend(frameon=False, fontsize=9)
    axes[-1].set_xlabel("Shaft speed [rpm]")
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def bearings_beside(names: Sequence[str], found: Sequence[BearingSweep]) -> Figure:
    """Slip, impulses, wear, power and exponent of several bearings over the shaft's speed: means over starts, with
    standard errors.
    """
    figure = new_figure(11.5, 8.5)
    axes = figure.subplots(3, 2, sharex=True)
    panels = {
        "cage_slip": ("Cage slip [%]", 100.0),
        "friction_power_W": ("Power lost [W]", 1.0),
        "pocket_impulse_N_s": ("Pocket impulse [N s]", 1.0),
        "land_impulse_N_s": ("Land impulse [N s]", 1.0),
        "pocket_wear_mm3_per_h": ("Pocket wear [mm³/h]", 1.0),
        "exponent": ("Largest exponent per revolution", 1.0),
    }
    for ax, (measure, (label, factor)) in zip(axes.ravel(), panels.items(), strict=True):
        for name, each, colour in zip(names, found, cycle(MARK_COLOURS[::4] + MARK_COLOURS[1:4]), strict=False):
            blocks = each.block_means[measure].reshape(each.speed.size, -1)
            freedom = np.maximum(np.isfinite(blocks).sum(axis=1) - 1, 1)
            mean, bars = np.nanmean(blocks, axis=1), np.nan_to_num(np.nanstd(blocks, axis=1) / np.sqrt(freedom))
            style: Any = dict(color=colour, linewidth=1.0, marker=".", elinewidth=0.8, label=name)
            dress(ax).errorbar(each.rpm, factor * mean, factor * bars, **style)
        ax.set_ylabel(label)
    for ax in axes[2]:
        ax.set_xlabel("Shaft speed [rpm]")
    axes[0, 0].legend(frameon=False, fontsize=9)
    return figure


def over_shaft_speed(
    found: BearingSweep,
    values: Float[np.ndarray, "speeds starts"],
    label: str,
    ax: Axes | None = None,
    errors: Float[np.ndarray, "speeds starts"] | None = None,
) -> Axes:
    """A quantity of a sweep over the shaft's speed, a line for each start, with bars of one standard error."""
    ax = axes_or_new(ax, 6.0, 3.2)
    for i, colour in zip(range(values.shape[1]), cycle(MARK_COLOURS), strict=False):
        bars = None if errors is None else np.where(np.isfinite(errors[:, i]), errors[:, i], 0.0)
        style: Any = dict(color=colour, linewidth=0.9, marker=".", markersize=5, elinewidth=0.7, label=f"start {i + 1}")
        ax.errorbar(found.rpm, values[:, i], bars, **style)
    ax.set_ylabel(label)
    return ax
