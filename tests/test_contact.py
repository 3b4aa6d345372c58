"""The land contact: restitution delivered by its law, smoothness, never adhesive."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import preliminary
from literature import bounce, impact

import jaxcage as jc
from jaxcage.forces import contact_force, power_10_9, restitution_damping, smooth_plus


@pytest.mark.parametrize("restitution", [0.9, 0.7, 0.5, 0.3])
def test_damping_number(restitution):
    """The root of the exact law but 0, and its derivative."""
    chi = float(restitution_damping(restitution))
    assert chi > 1 - restitution
    defect = np.log((1 + chi) / (1 - chi * restitution)) - chi * (1 + restitution)
    assert abs(defect) < 1e-11
    # Implicit differentiation of ln(1 + chi) - ln(1 - chi e) = chi (1 + e).
    by_chi = 1 / (1 + chi) + restitution / (1 - chi * restitution) - (1 + restitution)
    by_e = chi / (1 - chi * restitution) - chi
    assert float(jax.grad(restitution_damping)(restitution)) == pytest.approx(-by_e / by_chi, rel=1e-9)


def test_damping_number_near_elastic_contact():
    """chi = (3/2)(1 - e) + O((1 - e)^2)."""
    assert abs(float(restitution_damping(1.0))) < 1e-12
    assert float(jax.grad(restitution_damping)(1.0)) == pytest.approx(-1.5, rel=1e-6)


@pytest.mark.parametrize("restitution", [0.05, 0.1, 0.2])
def test_weak_restitution_is_delivered(restitution):
    """Down to the lower limit of the parameter, where the force all but vanishes on the way out."""
    assert impact(restitution)[0] == pytest.approx(restitution, rel=0.1)


def test_land_contact_of_the_cage_delivers_restitution():
    """Through `CageModel`: the regularised onset costs of the order of its share of the depth."""
    small = {"contact.smoothing": 1e-9}
    model = jc.replace(preliminary("1a"), restitution=0.5, approach_speed=0.2, **small)
    cage = model.cage_at(1000.0)
    c, onset = float(model.clearance), float(model.contact.onset)
    normal = lambda p, v: -cage.forces(0.0, onset * c + p, 0.0 * p, v, 0.0 * v)["contact"][0]
    assert bounce(normal, float(cage.mass), 0.2, 1e-5)[0] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("rate", [-1e3, -1.0, -0.1, 0.0, 0.1, 10.0])
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.9, 1.0])
def test_contact_never_pulls(rate, restitution):
    chi = float(restitution_damping(restitution))
    depths = jnp.concatenate([jnp.zeros(1), jnp.geomspace(1e-15, 1e-3, 50)])
    forces = jax.vmap(lambda p: contact_force(p, rate, 1e8, chi / 0.1))(depths)
    assert np.all(np.asarray(forces) >= 0)
    assert float(forces[0]) == 0.0
    elastic = 1e8 * np.asarray(depths) ** (10 / 9)
    factor = 1 + chi * rate / 0.1
    # max(factor, 0) is smoothed: sqrt(factor^2 + 1e-8) in place of its absolute value.
    excess = elastic * 1e-8 / (4 * abs(factor))
    rounding = 1e-13 * (1 + abs(factor)) * elastic
    assert np.all(np.abs(forces - elastic * max(factor, 0.0)) <= 1.01 * excess + rounding)


def derivatives(f, order):
    chain = [f]
    for _ in range(order):
        chain.append(jax.grad(chain[-1]))
    return chain


WIDTH = 2e-7


@pytest.mark.wide
@pytest.mark.parametrize("joint", [-WIDTH, WIDTH])
def test_smooth_plus_joins_with_three_continuous_derivatives(joint):
    h = 1e-6
    below, above = joint - h * WIDTH, joint + h * WIDTH
    for order, f in enumerate(derivatives(lambda u: smooth_plus(u, WIDTH), 3)):
        unit = WIDTH ** (1 - order)
        # The first derivative that jumps is the fourth, of order 60 / (2 width)^3.
        assert float(f(below)) == pytest.approx(float(f(above)), abs=100 * h * unit)
        assert float(f(joint)) == pytest.approx(float(f(above)), abs=100 * h * unit)
    third = derivatives(lambda u: smooth_plus(u, WIDTH), 3)[-1]
    inside = float(third(0.5 * WIDTH))
    assert abs(inside) * WIDTH**2 > 1.0  # it is not zero everywhere


@pytest.mark.wide
def test_power_is_exact_with_finite_derivatives_at_touch():
    p = np.geomspace(1e-12, 1.0, 25)
    np.testing.assert_allclose(jax.vmap(power_10_9)(jnp.asarray(p)), p ** (10 / 9), rtol=1e-14)
    np.testing.assert_allclose(power_10_9(jnp.asarray(3, jnp.float32)), 3 ** (10 / 9), rtol=1e-14)
    for order, f in enumerate(derivatives(power_10_9, 3)):
        assert float(f(0.0)) == 0.0, order
        assert float(f(-1.0)) == 0.0, order
    slope, curvature = derivatives(power_10_9, 2)[1:]
    assert float(slope(0.3)) == pytest.approx(10 / 9 * 0.3 ** (1 / 9), rel=1e-13)
    assert float(curvature(0.3)) == pytest.approx(10 / 81 * 0.3 ** (-8 / 9), rel=1e-13)
