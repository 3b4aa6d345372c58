"""Figures show what they should: points, limits, units, zones at the right speeds."""

import dataclasses
import subprocess
import sys

import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from test_io_dataset import sweep_of

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones, zones
from jaxcage.bearing import load_distribution
from jaxcage.plotting import (
    exponent_strip,
    force_history,
    impact_forces,
    load_bars,
    mark_operating,
    mark_published,
    new_figure,
    orbit,
    orbit_diagram,
    shade_zones,
    simulation_figure,
    strobe_section,
    sweep_figure,
    time_history,
    zoomed_diagram,
)


def points(ax: Axes, label: str) -> np.ndarray:
    """Finite points of the line with `label`, as rows (x, y)."""
    line = next(line for line in ax.get_lines() if line.get_label() == label)
    data = np.asarray(line.get_xydata())
    return data[np.all(np.isfinite(data), axis=1)]


def spans(ax: Axes) -> list[tuple[float, float]]:
    """Horizontal extent of every shaded zone."""
    shaded = [p for p in ax.patches if isinstance(p, Rectangle)]
    return [(float(p.get_x()), float(p.get_x() + p.get_width())) for p in shaded]


def trajectory(revolutions: int = 2, samples: int = 32) -> jc.Trajectory:
    """A circle of 0.1 mm at 100 rad/s."""
    tau = np.arange(revolutions * samples) * 2 * np.pi / samples
    x, y = 1e-4 * np.cos(tau), 1e-4 * np.sin(tau)
    state, speed = np.stack([x, y, -100 * y, 100 * x], axis=1), np.full(tau.size, 100.0)
    return jc.Trajectory(tau / 100, tau, state, speed, samples, 0.2, "successful")


def test_orbit_diagram_shows_every_strobe_point_of_every_start():
    sweep = sweep_of()
    ax = orbit_diagram(sweep)
    assert len(points(ax, "chaotic")) == 3 * 16
    assert len(points(ax, "periodic")) == (4 * 3 - 1) * 16
    chaotic = points(ax, "chaotic")
    np.testing.assert_allclose(np.unique(chaotic[:, 0]), [8100])
    expected = np.sort(sweep.strobe[1, :, :, 1].ravel()) * 1e3
    np.testing.assert_allclose(np.sort(chaotic[:, 1]), expected)
    np.testing.assert_allclose(points(ax, "failed")[:, 0], [8300])
    assert ax.get_xlabel() == "Cage speed $n$ [rpm]"
    assert ax.get_ylabel() == "Vertical displacement $Y_C$ [mm]"
    assert ax.get_xlim() == pytest.approx((8000, 8400))


def test_operating_speeds_outside_the_axis_are_not_drawn():
    """Beyond its ends a bar at the foot would leave no room for the axes."""
    ax = Figure().subplots()
    ax.set_xlim(3000, 9000)
    mark_operating(ax, [(5000.0, 5000.0), (8000.0, 9500.0), (20000.0, 24000.0)])
    drawn = np.concatenate([np.asarray(line.get_xdata()) for line in ax.get_lines() if not line.get_clip_on()])
    assert drawn.min() > 3000 and drawn.max() == 9000 and ax.get_xlim() == (3000, 9000)


def test_zoomed_diagram_fits_its_limits_to_the_points_in_it():
    sweep = sweep_of()
    ax = zoomed_diagram(sweep, 8150.0, 8250.0)
    shown = sweep.strobe[2, :, :, 1] * 1e3
    assert len(points(ax, "periodic")) == shown.size
    low, high = ax.get_ylim()
    assert ax.get_xlim() == (8150, 8250)
    assert low < shown.min() and high > shown.max()
    assert high - low < 1.2 * np.ptp(shown)


def test_exponent_strip():
    sweep = sweep_of()
    ax = exponent_strip(sweep)
    every = sweep.exponents[..., 0]
    assert len(points(ax, "each start")) == np.sum(np.isfinite(every))
    largest = points(ax, "largest of the starts")
    np.testing.assert_allclose(largest[:, 1], np.nanmax(every, axis=1))
    (band,) = ax.collections
    height = np.asarray(band.get_paths()[0].get_extents())
    error = 2 * sweep.standard_error[1, np.argmax(every[1]), 0]
    assert height[1, 1] == pytest.approx(np.max(every[1]) + error)
    assert points(ax, "chaotic above 0.02")[:, 1].tolist() == [0.02, 0.02]
    low, high = ax.get_ylim()
    assert low < 0 < 0.02 < high


def test_exponent_of_a_speed_at_which_all_starts_failed_is_a_gap():
    sweep = sweep_of(starts=3)
    sweep.outcome[4], sweep.block_growth[4], sweep.strobe[4] = 1, np.nan, np.nan
    assert points(exponent_strip(sweep), "largest of the starts")[:, 0] == pytest.approx([8000, 8100, 8200, 8300])


def test_zones_are_shaded_where_they_are():
    ax = orbit_diagram(sweep_of())
    inner, open_end = (
        Zone("chaotic", Edge(8050.0, 100.0, "chaotic"), Edge(8150.0, 100.0, "chaotic"), 1.0),
        Zone("chaotic", Edge(8350.0, 100.0, "chaotic"), None, 1.0),
    )
    shade_zones(ax, Zones((inner, open_end), (), 100.0, 500.0))
    np.testing.assert_allclose(spans(ax), [(8050, 8150), (8350, 8400)])
    assert ax.get_xlim() == pytest.approx((8000, 8400))
    labels = ax.get_legend_handles_labels()[1]
    assert labels.count("chaotic zone") == 1


def test_published_edges_are_marked_only_inside_the_axis():
    ax = new_figure().subplots()
    ax.set_xlim(2500, 20000)
    mark_published(ax, jc.bearing.published_case("1a"))
    lines = [line for line in ax.get_lines() if line.get_linestyle() != "None"]
    assert [float(np.asarray(line.get_xdata())[0]) for line in lines] == [9100, 12000]
    assert [text.get_text() for text in ax.texts] == ["9100", "12000"]
    markers = [line.get_marker() for line in ax.get_lines() if line.get_marker() in ("<", ">")]
    assert markers == [">", "<"]


def test_sweep_figure_has_both_panels_on_one_axis_and_no_clash():
    sweep = sweep_of()
    figure = sweep_figure(sweep, zones(sweep), jc.bearing.published_case("1a"), "Case 1a")
    above, below = figure.axes
    assert above.get_xlim() == below.get_xlim()
    np.testing.assert_allclose(spans(above), [(8050, 8150)])
    assert spans(above) == spans(below)
    assert above.get_title(loc="left") == "Case 1a"
    assert below.get_xlabel() == "Cage speed $n$ [rpm]" and above.get_xlabel() == ""
    figure.draw_without_rendering()
    legend = figure.legends[0].get_window_extent()
    panel = below.get_tightbbox()
    assert panel is not None and legend.y1 <= panel.y0
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(names) == len(set(names))
    assert {"periodic", "chaotic", "failed", "chaotic zone", "each start"} <= set(names)


def test_sweep_of_one_speed_can_be_drawn():
    sweep = sweep_of(speeds=5)
    parts = {f.name: getattr(sweep, f.name) for f in dataclasses.fields(sweep)}
    one = jc.Sweep(**{name: x[1:2] if isinstance(x, np.ndarray) else x for name, x in parts.items()})
    figure = sweep_figure(one, zones(one))
    np.testing.assert_allclose(spans(figure.axes[0]), [(8050, 8150)])  # open on both sides


def test_strobe_section():
    sweep = sweep_of()
    ax = strobe_section(sweep.strobe[1], names=["a", "b", "c"])
    for i, name in enumerate("abc"):
        shown = points(ax, name)
        np.testing.assert_allclose(shown, 1e3 * sweep.strobe[1, i][:, [1, 3]])
    assert ax.get_xlabel() == "Vertical displacement $Y_C$ [mm]"
    assert ax.get_ylabel() == "Vertical velocity $Y_C'$ [mm/s]"


def test_strobe_section_of_a_point_is_not_blown_up():
    state = np.broadcast_to(np.array([0.0, 1e-4, 0.0, 0.05]), (1, 20, 4))
    low, high = strobe_section(state * (1 + 1e-12 * np.arange(20)[:, None])).get_xlim()
    assert high - low > 1e-3


def test_time_history_and_orbit():
    run = trajectory()
    ax = time_history(run)
    np.testing.assert_allclose(points(ax, "$Y_C$")[:, 1], 0.1 * np.sin(run.tau), atol=1e-15)
    np.testing.assert_allclose(points(ax, "$Y_C$")[:, 0], run.time * 1e3)
    assert ax.get_xlabel() == "Time $t$ [ms]" and ax.get_ylabel() == "Displacement [mm]"
    ax = orbit(run, 0.45e-3)
    (circle,) = [p for p in ax.patches if isinstance(p, Circle)]
    assert circle.get_radius() == pytest.approx(0.45)
    path, strobe = ax.get_lines()
    np.testing.assert_allclose(np.hypot(*np.asarray(path.get_xydata()).T), 0.1)
    assert np.asarray(strobe.get_xydata()) == pytest.approx(np.array([[0.1, 0.0]] * 2))
    assert ax.get_aspect() == 1.0


def test_orbit_of_a_cage_in_an_elastic_rib_is_relative_to_the_rib():
    run = trajectory()
    rib = np.full((run.tau.size, 2), 5e-5)
    state = np.concatenate([run.state[:, :2] + rib, rib, run.state[:, 2:], 0 * rib], axis=1)
    moved = jc.Trajectory(run.time, run.tau, state, run.speed, run.samples, 0.2, "successful")
    path, _ = orbit(moved, 0.45e-3).get_lines()
    np.testing.assert_allclose(np.hypot(*np.asarray(path.get_xydata()).T), 0.1)


def test_each_force_is_drawn():
    run = trajectory()
    ramp = np.arange(float(run.tau.size))
    forces = {"film": np.outer(ramp, [0.0, 0.0]), "support": np.outer(ramp, [1.0, -1.0])}
    ax = force_history(run, forces, axis=1)
    np.testing.assert_allclose(points(ax, "support")[:, 1], -np.arange(run.tau.size))
    assert ax.get_ylabel() == "Vertical force [N]"
    figure = simulation_figure(run, forces, 0.45e-3, "title")
    assert len(figure.axes) == 4
    assert {ax.get_ylabel() for ax in figure.axes} >= {"Horizontal force [N]", "Vertical force [N]"}


def test_impact_history():
    time, zero = jnp.linspace(0.0, 6e-4, 64), jnp.zeros(64)
    push = 100 * jnp.sin(time * jnp.pi / 6e-4)
    history = jc.forces.ImpactHistory(time, push, -push / 2, zero, zero, zero, zero)
    ax = impact_forces(history)
    contact = points(ax, "roller-bar contact force $Q_{cw}$")
    np.testing.assert_allclose(contact[:, 1], history.contact_force)
    assert contact[-1, 0] == pytest.approx(0.6)
    assert ax.get_xlabel() == "Time $t$ [ms]" and ax.get_ylabel() == "Force $F$ [N]"
    assert ax.get_xlim() == pytest.approx((0, 0.6))


def test_load_bars():
    shared = load_distribution(jc.bearing.nu2310())
    ax = load_bars(shared)
    bars = [p for p in ax.patches if isinstance(p, Rectangle)]
    assert len(bars) == 13
    tallest = max(bars, key=lambda bar: bar.get_height())
    assert tallest.get_height() == pytest.approx(float(shared.max_load))
    assert tallest.get_x() + tallest.get_width() / 2 == pytest.approx(0, abs=1e-9)
    loaded = [bar.get_x() + bar.get_width() / 2 for bar in bars if bar.get_height() > 0]
    assert max(loaded) == pytest.approx(-min(loaded))
    assert max(loaded) < np.degrees(float(shared.half_angle))


def test_axes_that_are_given_are_used():
    ax = new_figure().subplots()
    assert time_history(trajectory(), ax) is ax


@pytest.mark.wide
def test_plotting_needs_no_window_and_keeps_no_global_state():
    code = "import sys, jaxcage.plotting; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
