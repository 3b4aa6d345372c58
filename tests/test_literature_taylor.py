"""J. R. Taylor, Classical Mechanics (2005), table 12.1: period doublings of the driven damped pendulum.

phi'' + 2 beta phi' + w0^2 sin(phi) = gamma w0^2 cos(w t) with w = 2 pi, w0 = 3 pi, beta = w0/4. Of four decimals that
are printed, those of the first (1.0663) are cut off rather than rounded.
"""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

import jaxcage as jc


class Pendulum(eqx.Module):
    gamma: jax.Array

    def __call__(self, tau, q, v, speed):
        (angle,), (rate,) = q, v
        w0 = 3 * math.pi
        return (-w0 / 2 * rate + w0**2 * (self.gamma * jnp.cos(tau) - jnp.sin(angle)),)


def test_cascade_of_the_driven_pendulum():
    """gamma_1 to gamma_4 = 1.0663, 1.0793, 1.0821, 1.0827; their limit is 1.0829."""
    method, found = jc.method("rodas4", steps=512), []
    for periods, inside in ((1, 1.06), (2, 1.075), (4, 1.081), (8, 1.0825)):
        system = jc.ForcedOscillator(Pendulum(jnp.asarray(inside)), coordinates=1)
        options = dict(guess=(-math.pi / 2, 0.0), revolutions=320, method=method)
        orbit = jc.periodic_orbit(system, 2 * math.pi, periods, **options)
        assert bool(orbit.stable)
        point = jc.bifurcation(
            system, "period-doubling", orbit, "gamma", speed=2 * math.pi, periods=periods, method=method
        )
        assert point.status == "converged"
        found.append(float(point.value))
    assert found == pytest.approx([1.0663, 1.0793, 1.0821, 1.0827], abs=1e-4)
    limit = found[3] + (found[3] - found[2]) / (4.669201609 - 1)
    assert limit == pytest.approx(1.0829, abs=6e-5)
    assert (found[2] - found[1]) / (found[3] - found[2]) == pytest.approx(4.669, rel=0.02)
