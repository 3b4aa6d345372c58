"""Properties of the statics: equilibrium, symmetry, gradients, homogeneity."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import unit_exponents

import jaxcage.bearing as jb
from jaxcage import parameter_info, parameters, replace


def distribution(clearance=40e-6, load=4450.0, centrifugal=0.0, angle=-np.pi / 2):
    bearing = replace(jb.nu2310(), radial_clearance=clearance)
    return bearing, jb.load_distribution(bearing, load, centrifugal, angle)


@pytest.mark.wide
@pytest.mark.parametrize("clearance", [0.0, 40e-6])
@pytest.mark.parametrize("load, centrifugal", [(1.0, 0.0), (4450.0, 435.9), (18.6e3, 27.2), (50.0, 435.9)])
@pytest.mark.parametrize("angle", [-np.pi / 2, -np.pi / 2 + np.pi / 13, 0.7])
def test_rollers_carry_the_load_and_fill_the_gap(clearance, load, centrifugal, angle):
    bearing, result = distribution(clearance, load, centrifugal, angle)
    cosines = -np.sin(result.roller_angles)
    assert np.sum(result.inner_loads * cosines) == pytest.approx(load, rel=1e-10)
    np.testing.assert_allclose(result.outer_loads - result.inner_loads, centrifugal, atol=1e-9)
    room = result.shaft_shift * cosines - clearance / 2
    stiffness = bearing.raceway_stiffness
    approach = jax.vmap(jb.line_contact_approach, in_axes=(None, 0))
    inner = approach(stiffness, result.inner_loads)
    outer = approach(stiffness, result.outer_loads)
    loaded = np.asarray(result.inner_loads) > 0
    np.testing.assert_allclose((inner + outer)[loaded], room[loaded], rtol=1e-9)
    assert np.all(room[~loaded] <= outer[~loaded] * (1 + 1e-12))
    assert float(result.elastic_approach) == pytest.approx(float(room.max()), rel=1e-9)


def test_centrifugal_load_leaves_unloaded_rollers_on_the_outer_ring_and_sinks_the_shaft():
    _, still = distribution()
    _, fast = distribution(centrifugal=435.9)
    free = np.asarray(fast.inner_loads) == 0
    assert free.sum() >= 10
    np.testing.assert_allclose(np.asarray(fast.outer_loads)[free], 435.9)
    assert float(fast.shaft_shift) > float(still.shaft_shift)
    assert float(fast.inner_loads.sum()) < 1.02 * float(still.inner_loads.sum())


def test_distribution_repeats_after_one_roller_pitch():
    _, here = distribution(angle=-1.3)
    _, there = distribution(angle=-1.3 + 2 * np.pi / 13)
    np.testing.assert_allclose(np.roll(there.inner_loads, 1), here.inner_loads, rtol=1e-9, atol=1e-7)


def test_series_stiffness_without_centrifugal_load():
    inner, outer, approach = 3e9, 5e9, 4e-6
    q_i, q_o = jb.raceway_loads(approach, inner, outer, 0.0)
    expected = jb.line_contact_load(jb.series_stiffness(inner, outer), approach)
    assert float(q_i) == pytest.approx(float(expected), rel=1e-12) == float(q_o)


def test_zero_clearance_half_angle_is_90_degrees_with_exact_slope():
    _, result = distribution(clearance=0.0)
    assert float(result.half_angle) == np.pi / 2
    shift = result.shaft_shift
    slope = jax.grad(jb.loaded_half_angle)(0.0, shift)
    assert float(slope) == pytest.approx(-1 / (2 * float(shift)), rel=1e-12)


@pytest.mark.parametrize("shaft_rpm", [0.0, 30000.0, 60000.0])
def test_loaded_rollers_lie_within_the_half_angle(shaft_rpm: float):
    bearing, _ = distribution()
    centrifugal = bearing.roller_centrifugal_force(shaft_rpm * np.pi / 30)
    result = jb.load_distribution(bearing, 4450.0, centrifugal)
    # At its ends the inner raceway just touches a roller that its own centrifugal force has pressed outwards.
    seat = float(jb.line_contact_approach(bearing.raceway_stiffness, centrifugal))
    ends = np.arccos((float(bearing.radial_clearance) / 2 + seat) / float(result.shaft_shift))
    assert float(result.half_angle) == pytest.approx(ends, rel=1e-9)
    off_load = np.abs(np.angle(np.exp(1j * (np.asarray(result.roller_angles) + np.pi / 2))))
    assert np.array_equal(off_load < result.half_angle, np.asarray(result.inner_loads) > 0)


def outputs(bearing, load, shaft_speed):
    force = bearing.roller_centrifugal_force(shaft_speed)
    result = jb.load_distribution(bearing, load, force)
    return jnp.stack([result.shaft_shift, result.max_load, result.half_angle])


def scaled(factors):
    """Outputs with load, speed and six parameters of the bearing multiplied by `factors`."""
    bearing = jb.nu2310()
    names = "radial_clearance", "palmgren_constant", "roller_length", "density"
    values = {n: parameters(bearing)[n] * factors[k + 2] for k, n in enumerate(names)}
    return outputs(replace(bearing, **values), 4450.0 * factors[0], 1256.6 * factors[1])


@pytest.mark.wide
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_gradients_against_central_differences(mode):
    ones, step = jnp.ones(6), 1e-4
    gradient = jax.jit(mode(scaled))(ones)
    shifts = step * jnp.eye(6)
    value = jax.jit(jax.vmap(lambda d: scaled(ones + d)))
    difference = (value(shifts) - value(-shifts)).T / (2 * step)
    np.testing.assert_allclose(gradient, difference, rtol=3e-5, atol=0)


@pytest.mark.wide
def test_second_derivative_against_difference_of_gradients():
    def shift(load):
        return jb.load_distribution(jb.nu2310(), load, 100.0).shaft_shift * 1e6

    slope = jax.jit(jax.grad(shift))
    second = jax.jit(jax.grad(jax.grad(shift)))(4450.0)
    difference = (slope(4451.0) - slope(4449.0)) / 2
    assert float(second) == pytest.approx(float(difference), rel=1e-4)


@pytest.mark.wide
def test_gradient_in_speed_is_zero_at_rest():
    *_, gradient = _slopes(One(jnp.asarray(0)), [jb.nu2310(), jnp.asarray(4450.0), jnp.asarray(0.0)])
    assert float(gradient) == 0.0


def exponents(unit):
    """Exponents of mass, length and time in a unit."""
    return np.array(list(unit_exponents(unit).values()))


@eqx.filter_jit
def _slopes(function, values):
    return eqx.filter_grad(lambda args: function(*args))(values)


def homogeneity(function, arguments):
    """sum of a_i p_i df/dp_i over modules and (value, unit) pairs, for mass, length and time."""
    values = [a[0] if isinstance(a, tuple) else a for a in arguments]
    gradients = _slopes(function, [v if isinstance(v, eqx.Module) else jnp.asarray(v) for v in values])
    total = np.zeros(3)
    for argument, gradient in zip(arguments, gradients, strict=True):
        if isinstance(argument, tuple):
            total += exponents(argument[1]) * argument[0] * float(gradient)
            continue
        infos, slopes = parameter_info(argument), parameters(gradient)
        for name, value in parameters(argument).items():
            total += exponents(infos[name].unit) * float(value) * float(slopes[name])
    return total


class One(eqx.Module):
    """One of the outputs."""

    index: jax.Array

    def __call__(self, *arguments):
        return outputs(*arguments)[self.index]


@pytest.mark.wide
@pytest.mark.parametrize("index, unit", [(0, "m"), (1, "N"), (2, "1")])
def test_homogeneity_of_the_statics(index, unit):
    arguments = [jb.nu2310(), (4450.0, "N"), (1256.6, "rad/s")]
    values = jb.nu2310(), 4450.0, 1256.6
    value = float(outputs(*values)[index])
    found = homogeneity(One(jnp.asarray(index)), arguments)
    np.testing.assert_allclose(found, exponents(unit) * value, atol=1e-8 * value)


@pytest.mark.wide
def test_homogeneity_of_cage_mass_and_viscosity():
    mass = jb.cage_mass(jb.nu2310(), 0.45e-3, jb.CageGeometry())
    found = homogeneity(jb.cage_mass, [jb.nu2310(), (0.45e-3, "m"), jb.CageGeometry()])
    np.testing.assert_allclose(found, exponents("kg") * float(mass), atol=1e-12)
    oil = jb.vg(56.0, temperature=340.0)
    found = homogeneity(lambda oil: oil.dynamic_viscosity, [oil])
    expected = exponents("Pa*s") * float(oil.dynamic_viscosity)
    np.testing.assert_allclose(found, expected, rtol=1e-10)


@pytest.mark.wide
def test_batch_over_clearances_equals_single_solves():
    clearances = jnp.array([0.0, 20e-6, 60e-6])
    batch = jax.vmap(lambda c: jb.load_distribution(replace(jb.nu2310(), radial_clearance=c)).shaft_shift)(clearances)
    single = [float(distribution(c)[1].shaft_shift) for c in clearances]
    np.testing.assert_allclose(batch, single, rtol=1e-10)
    assert np.all(np.diff(single) > 0)
