"""Figures show what they should: points, limits, units, zones at the right speeds."""

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from test_io_dataset import sweep_of

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones, zones
from jaxcage.bearing import load_distribution
from jaxcage.plotting import (
    exponent_strip,
    load_bars,
    orbit,
    orbit_diagram,
    shade_zones,
    sweep_figure,
    time_history,
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
