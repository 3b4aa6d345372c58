"""Nothing is missed: planted points are found, and a branch stays on its own side of one that runs close by."""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but
from jaxtyping import Array

import jaxcage as jc


class Comb(eqx.Module):
    """x = X + cos(tau), X' = -sin(pi (X - h) / apart) apart / pi, h = tanh(20 p) / 2: orbits at X = h + n apart."""

    p: Array
    apart: Array

    def __call__(self, tau, y, speed):
        x = (y[0] - jnp.cos(tau) - jnp.tanh(20 * self.p) / 2) * jnp.pi / self.apart
        return (-jnp.sin(x) * self.apart / jnp.pi - speed * jnp.sin(tau),)


class Curve(eqx.Module):
    """x = X + cos(tau), X' = c0 + c1 p X + c2 p^2 + c3 X^2 + c4 X^3: orbits where the polynomial is zero."""

    p: Array
    c: Array

    def __call__(self, tau, y, speed):
        x, p = y[0] - jnp.cos(tau), self.p
        return (self.c @ jnp.stack([jnp.ones_like(p), p * x, p**2, x**2, x**3]) - speed * jnp.sin(tau),)


def followed(law, x, p):
    """The branch from X = x at p, from -1 to 1."""
    system = jc.ForcedSystem(law, dimension=1)
    return jc.branch(system, ((1 + x,), p), "p", lower=-1.0, upper=1.0, speed=1.1)


@pytest.mark.parametrize("apart", [1e-2, 1e-3, 1e-4])
def test_branch_does_not_jump_to_its_copies(apart):
    """Copies of one curve, every other stable, closer to each other than a prediction is to its point."""
    branch = followed(Comb(jnp.array(-0.9), jnp.array(apart)), -0.5, -0.9)
    assert branch.special == () and np.all(branch.stable) and branch.ended == ("range", "range")
    np.testing.assert_allclose(branch.state[:, 0] - 1 - np.tanh(20 * branch.value) / 2, 0.0, atol=1e-7)


def lines(gap, side):
    """(X - p) (X - p/5) = +-gap^2: two lines that cross, or nearly."""
    return [side * gap**2, 1.2, -0.2, -1.0, 0.0], 0.3 + math.sqrt(0.04 + side * gap**2)


def pitchfork(gap, side):
    """gap + p X - X^3, with the root next to side/sqrt(2) at p = 1/2."""
    roots = np.roots([-1.0, 0.0, 0.5, gap]).real
    return [gap, 1.0, 0.0, 0.0, -1.0], float(roots[np.argmin(abs(roots - side * math.sqrt(0.5)))])


NEAR = {
    "lines that cross": (lines(0.0, 1), [("branch-point", 0.0)]),
    "lines that pass": (lines(1e-3, 1), []),
    "lines that turn sharply": (lines(1e-4, -1), [("fold", 2.5e-4)]),
    "what is left of a pitchfork, passing": (pitchfork(1e-4, 1), []),
    "what is left of a pitchfork, turning": (pitchfork(1e-4, -1), [("fold", 3 * (1e-4 / 2) ** (2 / 3))]),
    "pitchfork along the side that turns": (pitchfork(0.0, 1), [("branch-point", 0.0), ("fold", 0.0)]),
}


@pytest.mark.parametrize(
    "name", wide_but(NEAR, "lines that cross", "lines that pass", "pitchfork along the side that turns")
)
def test_branches_that_cross_and_branches_that_nearly_do(name):
    (terms, x), points = NEAR[name]
    branch = followed(Curve(jnp.array(0.5), jnp.array(terms)), x, 0.5)
    special = sorted(branch.special, key=lambda p: p.kind)  # two at one place are met in either order
    assert [p.kind for p in special] == [kind for kind, _ in points]
    for found, (_, place) in zip(special, points, strict=True):
        assert found.status == "converged" and abs(found.value - place) <= found.error + 1e-8
    assert branch.ended == ("range", "range") and branch.value.size < 100
    if name == "lines that pass":
        assert np.all(branch.state[:, 0] - 1 > 0.6 * branch.value)
    elif name.endswith("passing"):
        assert np.all(branch.state[:, 0] > 1)


@pytest.mark.wide
def test_search_meets_what_only_the_opposite_start_leads_to():
    """Two wells, and starts in one of them: the orbits of both are found, and the counts are those of the initial
    states."""

    def well(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.5 * u + x - x**3 + 0.05 * jnp.cos(tau),)

    system = jc.ForcedOscillator(well, coordinates=1, initial_states=((1.1, 0.1),))
    found = jc.synchronous_orbits(system, 0.5, 0.6, count=3, discard=20, method=jc.method("rk4", steps=128))
    assert {float(np.sign(b.state[0, 0])) for b in found.branches} == {-1.0, 1.0} and found.missed == 0
    assert sorted(s.met for s in found.stretches) == [0, 3]
