"""Designs for calm operation: edges followed from design to design, gradients of requirements, and optima.

Gradients stand beside differences of solutions by SciPy's DOP853 and Newton's method, which share only the field with
this library. "Planted" systems have edges, and so optima, that are known exactly.
"""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import jaxcage as jc
from jaxcage.forces import parameter
from jaxcage.orbits import follow, stable_range


class Window(eqx.Module):
    """The orbit (cos, sin) with the multipliers -exp(g T) and -exp((g - 1) T), in a frame that turns by half a
    revolution; g = k ((w - x)(w - x - y) - d) vanishes at the edges of a range of the speed w, where the period
    doubles: x and x + y without d."""

    x: jax.Array = parameter("1", -9.0, 9.0, "first edge")
    y: jax.Array = parameter("1", -9.0, 9.0, "distance of both edges")
    d: jax.Array = parameter("1", -9.0, 9.0, "shift of the parabola")
    k: jax.Array = parameter("1", -9.0, 9.0, "bend of the parabola")

    def __call__(self, tau, y, speed):
        growth = self.k * ((speed - self.x) * (speed - self.x - self.y) - self.d)
        cos, sin, half, side = jnp.cos(tau), jnp.sin(tau), jnp.cos(tau / 2), jnp.sin(tau / 2)
        a, b = y[0] - cos, y[1] - sin
        e, f = half * a + side * b, -side * a + half * b
        de, df = (growth - e * e - f * f) * e, (growth - 1 - e * e - f * f) * f
        turn = speed / 2
        return (half * de - side * df - turn * b - speed * sin, side * de + half * df + turn * a + speed * cos)


def window(x=1.0, y=1.5, d=0.0, k=0.5):
    return jc.ForcedSystem(Window(x=x, y=y, d=d, k=k), dimension=2)


OPERATING, LIMITS = (1.2, 2.0), (0.6, 4.0)


@pytest.fixture(scope="module")
def planted():
    found = stable_range(window(), OPERATING, LIMITS)
    assert found.lower.kind == found.upper.kind == "period-doubling"
    return found


# --- following ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_a_planted_edge_is_followed_to_its_place(planted, end):
    """Far: by six times the width of the range. Derivatives are 1 and, for the upper edge, 1."""
    found = follow(window(), getattr(planted, end), window(x=1.4, y=1.3), lower=0.6, upper=4.0, name=end)
    exact = 1.4 if end == "lower" else 2.7
    assert (found.ended, found.share, found.edge.kind, found.edge.name) == ("", 1.0, "period-doubling", end)
    assert found.edge.value_rpm * np.pi / 30 == pytest.approx(exact, rel=1e-7) and found.edge.bounds
    slopes = [found.edge.derivative[name] * np.pi / 30 for name in ("x", "y", "k")]
    assert slopes == pytest.approx([1.0, float(end == "upper"), 0.0], abs=1e-6)


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_an_edge_that_meets_the_other_turns_back(planted, end):
    """The edges are at x + y/2 +- sqrt(y^2/4 + d): they meet at d = -y^2/4, at 0.5625 of the way to -1."""
    found = follow(window(), getattr(planted, end), window(d=-1.0), lower=0.6, upper=4.0)
    assert found.edge is None and found.ended == "turned back"
    assert found.share == pytest.approx(0.5625, abs=5e-3)


def test_an_edge_that_leaves_the_range(planted):
    """The lower edge passes 0.8 at 0.4 of the way."""
    found = follow(window(), planted.lower, window(x=0.5, y=2.0), lower=0.8, upper=4.0)
    assert found.edge is None and found.ended == "left the range" and 0.4 <= found.share < 1


CASE = jc.case("1a")
GAP, RUNNING = float(jc.parameters(CASE)["guidance_gap"]), (float(jc.rpm(12500)), float(jc.rpm(18000)))
FAR = 0.5 * RUNNING[0], 2 * RUNNING[1]


@pytest.fixture(scope="module")
def given():
    return stable_range(CASE, RUNNING, FAR)


@pytest.mark.parametrize("change", wide_but((0.001, 0.007, 0.02, 0.11), 0.001))
def test_the_fold_of_a_cage_is_followed(given, change):
    """At 18686 rpm, onset of the second unstable range: where a search finds it in the changed design."""
    assert given.upper.kind == "fold" and float(given.upper.speed_rpm) == pytest.approx(18686.338, abs=1e-2)
    other = jc.replace(CASE, guidance_gap=(1 + change) * GAP)
    found = follow(CASE, given.upper, other, lower=FAR[0], upper=FAR[1])
    fresh = stable_range(other, RUNNING, FAR).upper
    assert found.ended == "" and found.edge.kind == fresh.kind == "fold" and found.edge.bounds
    assert found.edge.value_rpm == pytest.approx(float(fresh.speed_rpm), rel=1e-6)
    assert found.edge.value_rpm > float(given.upper.speed_rpm) * (1 + 0.9 * change)


# --- gradients ------------------------------------------------------------------------------------------------------


@functools.partial(jax.jit, static_argnums=0)
def _rates(form, leaves, speed, tau, row):
    """Rates of the state and of its derivatives by the first state, in units of the scale."""
    model = jax.tree.unflatten(form, leaves)
    field, scale = model.at_speed(speed), jnp.stack(model.scale(speed))
    f = lambda z: jnp.stack(field(tau, tuple(z * scale))) / scale
    return jnp.concatenate([f(row[:4]), (jax.jacfwd(f)(row[:4]) @ row[4:].reshape(4, 4)).ravel()])


@functools.partial(jax.jit, static_argnums=0)
def _read(form, leaves, speed, tau, y):
    """Distance from the middle, land force and power to shear the film in some states."""
    forces = jax.vmap(jax.tree.unflatten(form, leaves).cage_at(speed).forces)(tau, *y.T)
    return jnp.hypot(y[:, 0], y[:, 1]), jnp.hypot(*forces["contact"][:2]), -speed * forces["film"][2]


def shot(model, speed, z, dense=False):
    """The first revolution from the state z by DOP853, with its derivatives."""
    leaves, form = jax.tree.flatten(model)
    rates = lambda tau, row: np.asarray(_rates(form, leaves, speed, tau, row))
    row = np.concatenate([z, np.eye(4).ravel()])
    return solve_ivp(rates, (0.0, 2 * np.pi), row, "DOP853", rtol=1e-11, atol=1e-12, dense_output=dense)


def image(model, speed, z):
    """The return map and its derivative."""
    end = shot(model, speed, z).y[:, -1]
    return end[:4], end[4:].reshape(4, 4)


def orbit(model, speed, z):
    """The orbit near z."""
    for _ in range(4):
        back, monodromy = image(model, speed, z)
        z = z - np.linalg.solve(monodromy - np.eye(4), back - z)
    return z, monodromy


def edge_rpm(model, kind, speed, z):
    """The bifurcation near an orbit."""

    def equations(u):
        back, monodromy = image(model, u[4] * speed, u[:4])
        if kind == "Neimark-Sacker":
            test = np.max(np.abs(np.linalg.eigvals(monodromy))) - 1
        else:
            test = np.linalg.det(monodromy + (1 if kind == "period-doubling" else -1) * np.eye(4))
        return np.append(back - u[:4], test)

    u, _, _, _ = fsolve(equations, np.append(z, 1.0), xtol=1e-13, full_output=True)
    assert np.max(np.abs(equations(u))) < 1e-8
    return u[4] * speed * 30 / np.pi


def readings(model, speed, z):
    """Least film [m], largest land force [N] and mean drag [W] of the orbit near z; tops by a parabola."""
    leaves, form = jax.tree.flatten(model)
    tau = np.arange(2**14) * 2 * np.pi / 2**14
    path = shot(model, speed, orbit(model, speed, z)[0], dense=True).sol(tau)[:4].T
    scale = np.array([float(s) for s in model.scale(speed)])
    away, force, power = (np.asarray(x) for x in _read(form, leaves, speed, tau, path * scale))

    def top(x):
        k = int(np.argmax(x))
        a, b, c = x[k - 1], x[k], x[(k + 1) % x.size]
        return b + (c - a) ** 2 / (8 * (2 * b - a - c)) if b > 0 else 0.0

    return {"film": float(model.clearance) - top(away), "land force": top(force), "drag": power.mean()}


def slope(f, name, step):
    """Derivative of f(design) by a parameter, differences of fourth order."""
    value = float(jc.parameters(CASE)[name])
    at = [f(jc.replace(CASE, **{name: value * (1 + i * step)})) for i in (-2, -1, 1, 2)]
    return np.dot([1, -8, 8, -1], at) / (12 * step * value)


THROUGH = ("multiplier", "film", "land force", "drag")
