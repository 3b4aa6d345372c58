"""Figures show what they should: points, limits, units, zones at the right speeds, colours that are told apart."""

import itertools

import numpy as np
import pytest
import xarray as xr
from helpers import cage_sweep, point
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, Rectangle

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.orbits import Branch, Curve, Point
from jaxcage.show import Axis, exponent_strip, multiplier_circle, orbit_diagram, stability_map
from jaxcage.show.design_figures import EDGE_COLOURS
from jaxcage.show.diagrams import shade_zones
from jaxcage.show.orbit_figures import MARKS, PERIOD_COLOURS, branch_diagram
from jaxcage.show.run_figures import STATE_COLOURS, orbit, time_history
from jaxcage.show.style import BLACK, FORCE_COLOURS, KIND_COLOURS, OWN_COLOURS, PAPER, ZONE


PER_RPM = np.pi / 30


def points(ax: Axes, label: str) -> np.ndarray:
    """Finite points of the line with `label`, as rows (x, y)."""
    (line,) = [line for line in ax.get_lines() if line.get_label() == label]
    data = np.asarray(line.get_xydata())
    return data[np.all(np.isfinite(data), axis=1)]


def spans(ax: Axes) -> list[tuple[float, float]]:
    """Horizontal extent of every shaded zone."""
    shaded = [p for p in ax.patches if isinstance(p, Rectangle)]
    return [(float(p.get_x()), float(p.get_x() + p.get_width())) for p in shaded]


# Sweeps and time histories.


def test_orbit_diagram_shows_every_strobe_point_of_every_start():
    sweep = cage_sweep()
    ax = orbit_diagram(sweep)
    chaotic = points(ax, "chaotic")
    assert len(chaotic) == 3 * 16 and len(points(ax, "periodic")) == (4 * 3 - 1) * 16
    np.testing.assert_allclose(np.unique(chaotic[:, 0]), [8100])
    np.testing.assert_allclose(np.sort(chaotic[:, 1]), np.sort(sweep["strobe"].values[1, :, :, 1].ravel()) * 1e3)
    np.testing.assert_allclose(points(ax, "failed")[:, 0], [8300])
    assert ax.get_xlabel() == "Cage speed $n$ [rpm]" and ax.get_ylabel() == "Vertical displacement $Y_C$ [mm]"


def test_exponent_strip():
    """The largest exponent with a band of two standard errors; a speed at which all initial states failed is a gap."""
    sweep = cage_sweep()
    sweep["label"].values[4], sweep["exponents"].values[4], sweep["standard_error"].values[4] = "failed", np.nan, np.nan
    ax, every = exponent_strip(sweep), sweep["exponents"].values[..., 0]
    largest = points(ax, "largest of the initial states")
    assert largest[:, 0] == pytest.approx([8000, 8100, 8200, 8300])
    np.testing.assert_allclose(largest[:, 1], np.nanmax(every[:4], axis=1))
    (band,) = ax.collections
    error = 2 * float(sweep["standard_error"][1, np.argmax(every[1]), 0])
    assert np.asarray(band.get_paths()[0].get_extents())[1, 1] == pytest.approx(np.max(every[1]) + error)


def test_zones_are_shaded_where_they_are():
    ax = orbit_diagram(cage_sweep())
    inner, open_end = (
        Zone("chaotic", Edge(8050.0, 100.0, "chaotic"), Edge(8150.0, 100.0, "chaotic"), 1.0),
        Zone("chaotic", Edge(8350.0, 100.0, "chaotic"), None, 1.0),
    )
    shade_zones(ax, Zones((inner, open_end), (), 100.0, 500.0))
    np.testing.assert_allclose(spans(ax), [(8050, 8150), (8350, 8400)])
    assert ax.get_xlim() == pytest.approx((8000, 8400))


@pytest.mark.parametrize("elastic", [False, True])
def test_time_history_and_orbit(elastic: bool):
    """A circle of 0.1 mm at 100 rad/s; that of a cage in an elastic rib is relative to the rib."""
    tau = np.arange(64) * 2 * np.pi / 32
    x, y = 1e-4 * np.cos(tau), 1e-4 * np.sin(tau)
    state, rib = np.stack([x, y, -100 * y, 100 * x], axis=1), np.full((64, 2), 5e-5)
    if elastic:
        state = np.concatenate([state[:, :2] + rib, rib, state[:, 2:], 0 * rib], axis=1)
    run = jc.Trajectory(tau / 100, tau, state, np.full(64, 100.0), 32, 0.2, "successful")
    if not elastic:
        ax = time_history(run)
        np.testing.assert_allclose(points(ax, "$Y_C$"), np.stack([run.time * 1e3, 1e3 * y], axis=1), atol=1e-15)
    ax = orbit(run, 0.45e-3)
    (circle,) = [p for p in ax.patches if isinstance(p, Circle)]
    path, strobe = ax.get_lines()
    assert circle.get_radius() == pytest.approx(0.45) and ax.get_aspect() == 1.0
    np.testing.assert_allclose(np.hypot(*np.asarray(path.get_xydata()).T), 0.1)
    assert np.asarray(strobe.get_xydata()) == pytest.approx(np.array([[0.1, 0.0]] * 2))


# Branches, multipliers, elasticities, curves.

T = np.linspace(-2.0, 2.0, 40)


def special(kind: str, rpm: float, y: float, index: int, edge: bool) -> Point:
    return point(kind, rpm, index, edge, state=(0.0, y, 0.0, 0.0))


def branch_of(rpm: np.ndarray, y: np.ndarray, stable: np.ndarray, points: list[Point], mu=None) -> Branch:
    """A branch on which only the vertical displacement [m] is not zero."""
    state, speed = np.stack([0 * y, y, 0 * y, 0 * y], axis=1), rpm * PER_RPM
    mu = np.full(state.shape, 0.5 + 0j) if mu is None else mu
    ended, steps = ("range", "range"), np.full(rpm.size, 512)
    return Branch("speed", speed, speed, state, mu, stable, tuple(points), 1, ended, steps, 0.0 * rpm)


def s_rpm(t):
    return 9000 + 50 * (t**3 - 3 * t)


def s_curve() -> Branch:
    """Stable, turning at t = -1 and 9100 rpm, unstable, turning at t = 1 and 8900 rpm, stable; the vertical
    displacement is t [0.1 mm]."""
    before = lambda t: int(np.flatnonzero(t > T)[-1])
    kinds = (("fold", -1.0, True), ("period-doubling", 0.2, False), ("fold", 1.0, True))
    found = [special(kind, s_rpm(t), t * 1e-4, before(t), edge) for kind, t, edge in kinds]
    return branch_of(s_rpm(T), T * 1e-4, np.abs(T) > 1, found)


def test_branch_is_thick_where_it_is_stable_up_to_the_bifurcations():
    ax = branch_diagram([s_curve()])
    stable, unstable = points(ax, "period-1, stable"), points(ax, "period-1, unstable")
    inner, outer = T[np.abs(T) < 1], T[np.abs(T) > 1]
    np.testing.assert_allclose(stable[:, 1], 0.1 * np.sort([*outer, -1.0, 1.0]))
    np.testing.assert_allclose(unstable[:, 1], 0.1 * np.sort([*inner, -1.0, 0.2, 1.0]))
    for part in (stable, unstable):
        np.testing.assert_allclose(part[:, 0], s_rpm(10 * part[:, 1]))
    width = {line.get_label(): line.get_linewidth() for line in ax.get_lines()}
    assert width["period-1, stable"] > 2 * width["period-1, unstable"]
    np.testing.assert_allclose(points(ax, "fold (F)"), [[9100, -0.1], [8900, 0.1]])
    assert [text.get_text() for text in ax.texts] == ["F 8900", "F 9100"]
    with pytest.raises(ValueError, match="no branch was given"):
        branch_diagram([])


def test_multipliers_along_a_branch():
    """All within the frame, coloured by speed, with those of the bifurcations on the unit circle."""
    rpm, angle = np.linspace(8000, 9000, 11), np.linspace(0.5, 3.0, 11)
    mu = np.stack([0.9 * np.exp(1j * angle), 0.9 * np.exp(-1j * angle), 0.1 + 0j * angle, -0.5 * np.arange(11)], axis=1)
    found = [special("Neimark-Sacker", 8300.0, 0.0, 2, True), special("period-doubling", 8700.0, 0.0, 6, True)]
    ax = multiplier_circle(branch_of(rpm, 1e-7 * rpm, rpm < 8300, found, mu=mu))
    (circle,) = [p for p in ax.patches if isinstance(p, Circle)]
    (cloud,) = [c for c in ax.collections if isinstance(c, PathCollection)]
    assert circle.get_radius() == 1 and ax.get_aspect() == 1.0
    far = np.abs(mu.real) > 1.6
    np.testing.assert_allclose(np.asarray(cloud.get_offsets()), np.stack([mu[~far].real, mu[~far].imag], axis=1))
    np.testing.assert_allclose(np.asarray(cloud.get_array()), np.repeat(rpm, 4)[~far.ravel()])
    pair = [[np.cos(2.5), np.sin(2.5)], [np.cos(2.5), -np.sin(2.5)]]
    np.testing.assert_allclose(points(ax, "Neimark-Sacker (NS)"), pair)
    np.testing.assert_allclose(points(ax, "period-doubling (PD)"), [[-1, 0]])


def curve_of(kind: str, rpm: np.ndarray, gap: np.ndarray, y: str = "guidance_gap") -> Curve:
    mu, genuine = np.full((rpm.size, 4), 0.5 + 0j), np.ones(rpm.size, bool)
    return Curve(kind, "speed", y, rpm * PER_RPM, gap, 0 * mu.real, mu, genuine, ("range", "range"), kind)


def two_curves() -> list[Curve]:
    """A period-doubling and a torus curve that meet at 10000 rpm and 0.5 mm."""
    gap = np.linspace(4e-4, 6e-4, 21)
    doubling = curve_of("period-doubling", 10000 + (gap - 5e-4) * 5e6, gap)
    torus = curve_of("Neimark-Sacker", 10000 + np.linspace(0, 900, 10), 5e-4 - np.linspace(0, 0.8e-4, 10))
    return [doubling, torus]


def test_curves_and_exponents_share_their_axes():
    """Curves in the parameter's unit; exponents beneath them are white at zero, red above, blue below."""
    rpm, gap = np.linspace(9000, 11000, 5), np.array([4e-4, 5e-4, 6e-4])
    largest, axes = np.outer(np.linspace(-1, 1, 5), [0.1, 0.2, 0.3]), ("speed", "guidance_gap", "initial_state")
    label = np.full((5, 3, 1), "undecided")
    label[0, 0], largest[0, 0] = "failed", np.nan
    values = {"label": (axes, label), "exponents": ((*axes, "exponent"), largest[..., None, None])}
    found = xr.Dataset(values, {"speed": rpm * PER_RPM, "guidance_gap": gap})
    axis = Axis("guidance_gap", 4e-4, 6e-4, "m")
    ax = stability_map(axis, two_curves(), found)
    np.testing.assert_allclose(points(ax, "Neimark-Sacker")[[0, -1]], [[10000, 0.5], [10900, 0.42]])
    assert ax.get_ylabel() == "Guidance gap [mm]"
    (mesh,) = [c for c in ax.collections if isinstance(c, QuadMesh)]
    shown = np.ma.asarray(mesh.get_array()).reshape(3, 5)
    np.testing.assert_allclose(shown.filled(0), np.nan_to_num(largest.T))
    assert np.ma.getmaskarray(shown)[0, 0] and np.sum(np.ma.getmaskarray(shown)) == 1
    red, blue = mesh.cmap(mesh.norm(0.3)), mesh.cmap(mesh.norm(-0.3))
    assert min(mesh.cmap(mesh.norm(0.0))[:3]) > 0.95 and red[0] > red[2] and blue[2] > blue[0]
    assert ax.get_xlim() == pytest.approx((8750, 11250)) and ax.get_ylim() == pytest.approx((0.35, 0.65))
    with pytest.raises(ValueError, match="guidance_gap over speed, but load"):
        stability_map(axis, [*two_curves(), curve_of("fold", np.ones(2), np.ones(2), "load")], found)


# Colours: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291.

SEEN_BY = {
    "everybody": np.eye(3),
    "protanopes": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopes": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}
MARKED = tuple(mark.colour for mark in MARKS.values())
CYCLES = [
    *(tuple(colours.values()) for colours in (KIND_COLOURS, FORCE_COLOURS, PERIOD_COLOURS)),
    *(tuple(colours) for colours in (OWN_COLOURS, MARKED, EDGE_COLOURS, STATE_COLOURS)),
]
CLEARLY_APART = 12.0
"""Five times the just noticeable CIE 1976 difference of 2.3."""


def linear(colour: str) -> np.ndarray:
    c = np.array(to_rgb(colour))
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def cielab(rgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b* (D65) of linear sRGB."""
    to_xyz = np.array(
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    )
    x = to_xyz @ np.clip(rgb, 0, 1) / np.array([0.95047, 1.0, 1.08883])
    f = np.where(x > (6 / 29) ** 3, np.cbrt(x), x / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(a: str, b: str) -> float:
    """Contrast ratio of WCAG 2."""
    light = sorted(float(np.array([0.2126, 0.7152, 0.0722]) @ linear(c)) for c in (a, b))
    return (light[1] + 0.05) / (light[0] + 0.05)


@pytest.mark.parametrize("reader", SEEN_BY)
def test_colours_of_a_cycle_are_told_apart(reader: str):
    for cycle in CYCLES:
        seen = [cielab(SEEN_BY[reader] @ linear(c)) for c in cycle]
        nearest = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
        assert nearest > CLEARLY_APART, cycle


def test_text_and_data_stand_out_from_the_paper():
    assert contrast(BLACK, PAPER) > 7.0 and contrast(BLACK, ZONE) > 7.0
    for colour in {c for cycle in CYCLES for c in cycle}:
        assert contrast(colour, PAPER) > 2.2, colour
