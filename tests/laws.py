"""Oscillators that several tests of orbits share, as a user would write them."""

import equinox as eqx
import jax.numpy as jnp

import jaxcage as jc
from jaxcage.forces import parameter


def numbers(**values):
    return {name: jnp.asarray(x, dtype=float) for name, x in values.items()}


class Duffing(eqx.Module):
    """m x'' + d x' - k x + b x^3 = g cos(w t): double-well for k > 0, hardening for k < 0."""

    m: float = parameter("kg", -1e3, 1e3, "m")
    d: float = parameter("N s/m", -1e3, 1e3, "d")
    k: float = parameter("N/m", -1e3, 1e3, "k")
    b: float = parameter("N/m^3", -1e3, 1e3, "b")
    g: float = parameter("N", -1e3, 1e3, "g")

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return ((-self.d * u + self.k * x - self.b * x**3 + self.g * jnp.cos(tau)) / self.m,)


def double_well(g=0.26, d=0.3, k=1.0, b=1.0, **settings):
    return jc.ForcedOscillator(Duffing(**numbers(m=1, d=d, k=k, b=b, g=g)), coordinates=1, **settings)


def hardening(g=0.3, d=0.1, **settings):
    return double_well(g, d, -1.0, **settings)


def about_an_orbit(tau, y, speed, turn, rates):
    """Rates of a state about the orbit (cos, sin), in a frame that makes `turn` revolutions a period about it; there
    `rates` gives those of the distance from the orbit."""
    cos, sin, along, across = jnp.cos(tau), jnp.sin(tau), jnp.cos(turn * tau), jnp.sin(turn * tau)
    x, v, spin = y[0] - cos, y[1] - sin, turn * speed
    de, df = rates(along * x + across * v, -across * x + along * v)
    return along * de - across * df - spin * v - speed * sin, across * de + along * df + spin * x + speed * cos
