"""Orbits and edges of cages by SciPy's DOP853 and Newton's method, which share only the field with the library.

States are in units of the system's scale.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve


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
    monodromy = np.eye(4)
    for _ in range(4):
        back, monodromy = image(model, speed, z)
        z = z - np.linalg.solve(monodromy - np.eye(4), back - z)
    return z, monodromy


def edge_speed(model, kind, speed, z):
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
    return u[4] * speed


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
