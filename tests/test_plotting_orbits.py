"""Figures of branches, multipliers, elasticities and stability maps show what they should."""

import matplotlib.colors as colours
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.patches import Circle
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from jaxcage.orbits import Branch, Curve, Point, Sensitivity
from jaxcage.plotting import (
    MARKS,
    branch_diagram,
    elasticity_bars,
    multiplier_circle,
    stability_map,
)


PER_RPM = np.pi / 30
CRITICAL = {"period-doubling": -1.0, "Neimark-Sacker": np.exp(2.5j), "fold": 1.0, "branch-point": 1.0}


def special(kind: str, rpm: float, y: float, index: int, edge: bool) -> Point:
    mu = np.array(
        [CRITICAL[kind], np.conj(CRITICAL[kind]) if kind == "Neimark-Sacker" else 0.5, 0.2, 0.1], dtype=complex
    )
    state = np.array([0.0, y, 0.0, 0.0])
    known = dict(multipliers=mu, index=index, edge=edge, steps=1024, error=1e-4 * PER_RPM, outcome=0)
    return Point(kind, rpm * PER_RPM, state, **known)


def branch_of(rpm: np.ndarray, y: np.ndarray, stable: np.ndarray, points=(), periods: int = 1, mu=None) -> Branch:
    """A branch on which only the vertical displacement [m] is not zero."""
    state = np.stack([0 * y, y, 0 * y, 0 * y], axis=1)
    mu = np.full(state.shape, 0.5 + 0j) if mu is None else mu
    ended, steps = ("range", "range"), np.full(rpm.size, 512)
    speed = rpm * PER_RPM
    return Branch("speed", speed, speed, state, mu, stable, tuple(points), periods, ended, steps, 0.0 * rpm)


def s_rpm(t: np.ndarray | float) -> np.ndarray | float:
    return 9000 + 50 * (t**3 - 3 * t)


T = np.linspace(-2.0, 2.0, 40)


def s_curve(periods: int = 1) -> Branch:
    """Stable, turning at t = -1 and 9100 rpm, unstable, turning at t = 1 and 8900 rpm, stable; the vertical
    displacement is t [0.1 mm]."""
    before = lambda t: int(np.flatnonzero(t > T)[-1])
    points = [
        special(kind, s_rpm(t), t * 1e-4, before(t), edge)
        for kind, t, edge in (("fold", -1.0, True), ("period-doubling", 0.2, False), ("fold", 1.0, True))
    ]
    return branch_of(np.asarray(s_rpm(T)), T * 1e-4, np.abs(T) > 1, points, periods)


def data(ax: Axes, label: str) -> np.ndarray:
    """Points of the line with `label`, as rows (x, y), NaN between runs."""
    (line,) = [line for line in ax.get_lines() if line.get_label() == label]
    return np.asarray(line.get_xydata())


def finite(points: np.ndarray) -> np.ndarray:
    return points[np.all(np.isfinite(points), axis=1)]


def extents(ax: Axes) -> list[Bbox]:
    """Where texts are on the page, without the lines to what they name."""
    ax.figure.draw_without_rendering()  # pyright: ignore[reportAttributeAccessIssue]
    return [Text.get_window_extent(text) for text in ax.texts]


def test_branch_is_thick_where_it_is_stable_up_to_the_bifurcations():
    ax = branch_diagram([s_curve()])
    stable, unstable = data(ax, "period-1, stable"), data(ax, "period-1, unstable")
    inner, outer = T[np.abs(T) < 1], T[np.abs(T) > 1]
    np.testing.assert_allclose(finite(stable)[:, 1], 0.1 * np.sort([*outer, -1.0, 1.0]))
    np.testing.assert_allclose(finite(unstable)[:, 1], 0.1 * np.sort([*inner, -1.0, 0.2, 1.0]))
    for points in (finite(stable), finite(unstable)):
        np.testing.assert_allclose(points[:, 0], s_rpm(10 * points[:, 1]))
    assert np.sum(np.isnan(stable[:-1, 0])) == 1 and np.sum(np.isnan(unstable[:-1, 0])) == 0
    thick, thin = (
        next(li for li in ax.get_lines() if li.get_label() == f"period-1, {w}") for w in ("stable", "unstable")
    )
    assert thick.get_linewidth() > 2 * thin.get_linewidth()
    assert thick.get_linestyle() == "-" and thin.get_linestyle() == "--"
    assert np.mean(colours.to_rgb(thin.get_color())) > np.mean(colours.to_rgb(thick.get_color()))
    assert ax.get_xlabel() == "Cage speed $n$ [rpm]" and ax.get_ylabel() == "Vertical displacement $Y_C$ [mm]"


def test_edges_are_filled_and_named_and_other_bifurcations_hollow():
    ax = branch_diagram([s_curve()])
    np.testing.assert_allclose(data(ax, "fold (F)"), [[9100, -0.1], [8900, 0.1]])
    hollow = next(line for line in ax.get_lines() if line.get_label() == "_period-doubling (PD), hollow")
    np.testing.assert_allclose(np.asarray(hollow.get_xydata()), [[s_rpm(0.2), 0.02]])
    filled = next(line for line in ax.get_lines() if line.get_label() == "fold (F)")
    assert (hollow.get_marker(), filled.get_marker()) == ("s", "o")
    assert hollow.get_markerfacecolor() == "white" and filled.get_markerfacecolor() == MARKS["fold"].colour
    assert [text.get_text() for text in ax.texts] == ["F 8900", "F 9100"]
    assert [a.xy[0] for a in ax.texts] == pytest.approx([8900, 9100])
    assert not branch_diagram([s_curve()], label_points=False).texts
    names = [text.get_text() for text in ax.get_legend().get_texts()]
    assert names == ["period-1, stable", "period-1, unstable", "fold (F)", "hollow: unstable on both sides"]


@pytest.mark.parametrize("parameter", ["guidance_gap", None])
def test_branches_must_be_over_speed(parameter: str | None):
    b = s_curve()
    other = Branch("guidance_gap", b.value, b.speed, b.state, b.multipliers, b.stable, (), 1, b.ended, b.steps, b.error)
    with pytest.raises(ValueError, match="guidance_gap was given" if parameter else "no branch was given"):
        branch_diagram([b, other] if parameter else [])


def test_multipliers_along_a_branch():
    rpm = np.linspace(8000, 9000, 11)
    angle = np.linspace(0.5, 3.0, 11)
    mu = np.stack([0.9 * np.exp(1j * angle), 0.9 * np.exp(-1j * angle), 0.1 + 0j * angle, -0.5 * np.arange(11)], axis=1)
    points = [
        special("Neimark-Sacker", 8300.0, 0.0, 2, True),
        special("period-doubling", 8700.0, 0.0, 6, True),
        special("period-doubling", 8400.0, 0.0, 3, False),
    ]
    ax = multiplier_circle(branch_of(rpm, 1e-7 * rpm, rpm < 8300, points, mu=mu))
    (circle,) = [p for p in ax.patches if isinstance(p, Circle)]
    assert circle.get_radius() == 1 and circle.center == (0, 0)
    assert ax.get_aspect() == 1.0 and ax.get_xlim() == ax.get_ylim() == (-1.6, 1.6)
    (cloud,) = [c for c in ax.collections if isinstance(c, PathCollection)]
    place, shade = np.asarray(cloud.get_offsets()), np.asarray(cloud.get_array())
    far = np.abs(mu.real) > 1.6
    assert len(place) == 44 - np.sum(far)
    np.testing.assert_allclose(place, np.stack([mu[~far].real, mu[~far].imag], axis=1))
    np.testing.assert_allclose(shade, np.repeat(rpm, 4)[~far.ravel()])
    assert cloud.get_clim() == pytest.approx((8000, 9000))
    assert [inner.get_ylabel() for inner in ax.child_axes] == ["Cage speed $n$ [rpm]"]
    pair = data(ax, "Neimark-Sacker (NS)")
    np.testing.assert_allclose(pair, [[np.cos(2.5), np.sin(2.5)], [np.cos(2.5), -np.sin(2.5)]])
    np.testing.assert_allclose(data(ax, "period-doubling (PD)"), [[-1, 0]])
    assert sorted(text.get_text() for text in ax.texts) == sorted(["◆ NS 8300", "■ PD 8700\n□ PD 8400"])


def edge(name: str, status: str = "converged", **elasticity: float) -> Sensitivity:
    return Sensitivity(name, "fold", 9100.0, dict(elasticity), dict(elasticity), {}, 1.0, status)


def test_elasticities_are_in_order_with_the_designers_two_on_top():
    onset = edge("zone 1 onset", load=0.01, eccentricity=-0.02, **{"oil.density": -0.3}, guidance_gap=0.1, bore=0.0)
    exit_ = edge("zone 1 exit", "fold", load=1.25, eccentricity=0.04, **{"oil.density": 0.2}, guidance_gap=0.0004)
    ax = elasticity_bars([onset, exit_])
    assert [t.get_text() for t in ax.get_yticklabels()] == ["guidance gap", "eccentricity", "load", "oil density"]
    low, high = ax.get_ylim()
    assert low > high, "the first is on top"
    first, second = ax.containers
    assert [bar.get_width() for bar in first] == pytest.approx([0.1, -0.02, 0.01, -0.3])
    assert [bar.get_width() for bar in second] == pytest.approx([0.0004, 0.04, 1.25, 0.2])
    middle = lambda bars: [bar.get_y() + bar.get_height() / 2 for bar in bars]
    np.testing.assert_allclose((np.array(middle(first)) + middle(second)) / 2, range(4), atol=1e-12)
    assert len({bar.get_facecolor()[:3] for bar in (*first, *second)}) == 2
    assert not first[0].get_hatch() and second[0].get_hatch()
    names = [text.get_text() for text in ax.get_legend().get_texts()]
    assert names == ["zone 1 onset (9100 rpm)", "zone 1 exit (9100 rpm, not trusted)"]
    texts = {(float(t.xy[0]), round(float(t.xy[1]))): t.get_text() for t in ax.texts}
    assert texts[1.25, 2] == "+1.25" and texts[-0.3, 3] == "−0.30" and texts[0.04, 1] == "+0.040"
    assert texts[0.0004, 0] == "≈0"
    frame = ax.get_window_extent()
    assert all(frame.x0 <= box.x0 and box.x1 <= frame.x1 for box in extents(ax))


def curve_of(kind: str, rpm: np.ndarray, gap: np.ndarray, x: str = "speed", y: str = "guidance_gap"):
    mu = np.full((rpm.size, 4), 0.5 + 0j)
    genuine = np.ones(rpm.size, bool)
    return Curve(kind, x, y, rpm * PER_RPM, gap, 0 * mu.real, mu, genuine, ("range", "range"), kind)


def two_curves() -> list[Curve]:
    """A period-doubling and a torus curve that meet at 10000 rpm and 0.5 mm."""
    gap = np.linspace(4e-4, 6e-4, 21)
    doubling = curve_of("period-doubling", 10000 + (gap - 5e-4) * 5e6, gap)
    torus = curve_of("Neimark-Sacker", 10000 + np.linspace(0, 900, 10), 5e-4 - np.linspace(0, 0.8e-4, 10))
    return [doubling, torus]


def test_curves_have_the_colour_of_their_kind_and_the_unit_of_the_parameter():
    ax = stability_map(two_curves(), y_unit="mm", y_factor=1e3)
    doubling, torus = (
        next(li for li in ax.get_lines() if li.get_label() == k) for k in ("period-doubling", "Neimark-Sacker")
    )
    assert (doubling.get_color(), torus.get_color()) == (
        MARKS["period-doubling"].colour,
        MARKS["Neimark-Sacker"].colour,
    )
    np.testing.assert_allclose(finite(data(ax, "Neimark-Sacker"))[[0, -1]], [[10000, 0.5], [10900, 0.42]])
    assert ax.get_ylabel() == "Guidance gap [mm]" and ax.get_xlabel() == "Cage speed $n$ [rpm]"
    assert stability_map(two_curves(), y_label="Gap $C_r$", y_unit="m").get_ylabel() == "Gap $C_r$ [m]"
    low, high = ax.get_ylim()
    assert low < 0.4 and high > 0.6 and len(ax.figure.axes) == 1


def test_exponents_beneath_the_curves_are_white_at_zero():
    rpm, gap = np.linspace(9000, 11000, 5), np.array([4e-4, 5e-4, 6e-4])
    largest = np.outer(np.linspace(-1, 1, 5), [0.1, 0.2, 0.3])
    largest[0, 0] = np.nan
    ax = stability_map(two_curves(), exponents=(rpm, gap, largest), y_unit="mm", y_factor=1e3)
    (mesh,) = [c for c in ax.collections if isinstance(c, QuadMesh)]
    shown = np.ma.asarray(mesh.get_array()).reshape(3, 5)
    np.testing.assert_allclose(shown.filled(0), np.nan_to_num(largest.T))
    assert np.ma.getmaskarray(shown)[0, 0] and np.sum(np.ma.getmaskarray(shown)) == 1
    assert mesh.get_clim() == (-0.3, 0.3)
    assert min(mesh.cmap(mesh.norm(0.0))[:3]) > 0.95
    red, blue = mesh.cmap(mesh.norm(0.3)), mesh.cmap(mesh.norm(-0.3))
    assert red[0] > red[2] and blue[2] > blue[0]
    assert ax.figure.axes[1].get_ylabel() == "Largest exponent per revolution $\\lambda_1$"
    assert ax.get_xlim() == pytest.approx((8750, 11250)) and ax.get_ylim() == pytest.approx((0.35, 0.65))
    assert mesh.get_zorder() < min(line.get_zorder() for line in ax.get_lines())


@pytest.mark.parametrize("other", [{"y": "load"}, {"x": "load"}])
def test_curves_must_share_their_parameters(other: dict[str, str]):
    with pytest.raises(ValueError, match="one parameter over speed, but .*load"):
        stability_map([*two_curves(), curve_of("fold", np.ones(2), np.ones(2), **other)])
