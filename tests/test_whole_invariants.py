"""Right side of the whole bearing: what cancels, what is symmetric, what its parts know of each other, its slopes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import in_other_units, unit_exponents
from jax.flatten_util import ravel_pytree
from reference import WholeBearing, gupta
from test_whole_reference import SPEED, everything, random_state, right_side

import jaxcage as jc
from jaxcage.bearing import vg
from jaxcage.models import BearingState, Traction
from jaxcage.models.contacts import lambert_w


def bearing(**changed):
    return jc.replace(jc.whole_bearing("nu2310"), **changed)


def some_state(model, seed=0, speed=SPEED, reach=0.985):
    return random_state(WholeBearing(model, speed), seed, reach)


def cross(a, b):
    return np.imag(np.conj(a) * b)


@pytest.mark.wide
@pytest.mark.parametrize("guidance", ["outer", "inner"])
def test_forces_and_moments_inside_cancel(guidance):
    """Rates of momentum and angular momentum of everything are what acts from outside: weight, load, mounting, the
    outer ring's bed and the torques that hold the speeds of both rings."""
    model = bearing(guidance=guidance, eccentricity=2e-4, pocket_friction=0.3)
    g = {name: float(v) for name, v in jc.parameters(model).items()}
    state = some_state(model)
    f, rates = everything(model, jnp.asarray(SPEED), state)
    (lag, _, r, vr, w), (_, spun, _, ar, aw) = np.asarray(state.rollers), np.asarray(rates.state.rollers)
    b, db, angle = np.asarray(state.bodies), np.asarray(rates.state.bodies), float(state.clock[0])
    m, half = float(model.bearing.roller_mass), g["roller_diameter"] / 2
    out = np.exp(1j * (angle + lag + 2 * np.pi * np.arange(13) / 13))
    z, a = r * out, (ar - r * w**2 + 1j * (r * aw + 2 * vr * w)) * out
    e = g["eccentricity"] * np.exp(1j * angle)
    z_g, a_g = complex(*b[0:2]) + e, complex(*db[2:4]) + (1j * db[4] - b[4] ** 2) * e
    z_i, a_i = complex(*b[5:7]), complex(*db[7:9])
    momentum = (m * a).sum() + g["cage_mass"] * a_g + g["ring_mass"] * a_i
    spinning = (m * half**2 / 2 * spun).sum() + g["cage_inertia"] * db[4]
    turning = (m * cross(z, a)).sum() + g["cage_mass"] * cross(z_g, a_g) + g["ring_mass"] * cross(z_i, a_i) + spinning

    load, pull = np.asarray(f.outer.load), np.asarray(f.outer.traction)
    bed = ((-load + 1j * pull) * out).sum()
    land = complex(float(f.land.x), float(f.land.y)) if guidance == "outer" else 0.0
    weight = -1j * g["gravity"] * (13 * m + g["cage_mass"] + g["ring_mass"])
    shaft = -1j * g["load"] - g["mounting_damping"] * complex(*b[7:9])
    outside = bed + land + weight + shaft
    size = load.sum()
    assert abs(momentum - outside) < 1e-12 * size

    weights = (
        -g["gravity"] * (m * z.real.sum() + g["cage_mass"] * z_g.real + g["ring_mass"] * z_i.real)
        + (np.conj(z_i) * shaft).imag
    )
    on_inner = -(np.asarray(f.inner.traction) * np.asarray(f.inner.race_arm)).sum()
    on_outer = -(pull * np.asarray(f.outer.race_arm)).sum()
    land_moment = float(f.land.land_moment)
    on_inner, on_outer = (
        (on_inner + land_moment, on_outer) if guidance == "inner" else (on_inner, on_outer + land_moment)
    )
    assert abs(turning - weights + on_inner + on_outer) < 1e-12 * size * 0.04
    assert float(rates.integrals[0]) == pytest.approx(-on_inner * SPEED, rel=1e-12)  # the outer ring rests


def test_renamed_rollers():
    """Each roller takes the place of the next one, and the cage turns on by a pocket."""
    model = bearing(eccentricity=0.0)
    state = some_state(model, 1)
    pocket = jnp.array([2 * np.pi / 13, 0.0])
    renamed = BearingState(jnp.roll(state.rollers, -1, axis=1), state.bodies, state.clock + pocket)
    speed = jnp.asarray(SPEED)
    before, after = right_side(model, speed, state), right_side(model, speed, renamed)
    for a, b in ((jnp.roll(before.rollers, -1, axis=1), after.rollers), (before.bodies[None], after.bodies[None])):
        size = np.abs(a).max(axis=1, keepdims=True)
        np.testing.assert_allclose(np.asarray(b) / size, np.asarray(a) / size, rtol=0, atol=1e-12)


def test_mirror_and_rotation():
    """x to -x with all speeds reversed; any rotation without weight and load. Both know the film's sense."""
    model = bearing(outer_speed=60.0, eccentricity=1e-4)
    state = some_state(model, 2)
    back = -np.arange(13) % 13
    flip = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0])
    sign = np.array([[-1.0], [-1.0], [1.0], [1.0], [-1.0]])
    angle = jnp.array([np.pi - state.clock[0], 0.0])
    mirrored = BearingState(state.rollers[:, back] * sign, state.bodies * flip, angle)
    speed = jnp.asarray(SPEED)
    found = right_side(jc.replace(model, outer_speed=-60.0), -speed, mirrored)
    once = right_side(model, speed, state)
    _same(found, BearingState(once.rollers[:, back] * sign, once.bodies * flip, once.clock), 1e-10)

    free = jc.replace(model, gravity=0.0, load=0.0)
    t = 0.7
    turn = np.eye(9)
    for i in (0, 2, 5, 7):
        turn[i : i + 2, i : i + 2] = [[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]
    rotated = BearingState(state.rollers, jnp.asarray(turn @ state.bodies), state.clock + jnp.array([t, 0.0]))
    once, found = right_side(free, speed, state), right_side(free, speed, rotated)
    _same(found, BearingState(once.rollers, turn @ once.bodies, once.clock), 1e-10)


def _same(found, expected, tolerance):
    size = np.abs(expected.rollers).max(axis=1, keepdims=True)
    np.testing.assert_allclose(found.rollers / size, expected.rollers / size, rtol=0, atol=tolerance)
    for part in (slice(0, 2), slice(2, 4), slice(4, 5), slice(5, 7), slice(7, 9)):
        room = tolerance * np.abs(np.asarray(expected.bodies)[part]).max()
        np.testing.assert_allclose(found.bodies[part], np.asarray(expected.bodies)[part], rtol=0, atol=room)


@pytest.mark.wide
def test_rollers_know_of_each_other_through_cage_and_ring_only():
    """The arrow: rates of a roller do not depend on another roller, so that a linear solve costs O(Z)."""
    model = bearing()
    state = some_state(model, 3)
    of_rollers = jax.jit(lambda rollers: jax.jacfwd(lambda x: _rates(model, state._replace(rollers=x)))(rollers))
    slopes = np.asarray(of_rollers(state.rollers)).transpose(1, 3, 0, 2)  # rate's roller, roller, row, row
    others = ~np.eye(13, dtype=bool)
    assert np.all(slopes[others] == 0) and np.all(np.abs(slopes[~others]).max(axis=(1, 2)) > 0)


def _rates(model, state):
    return model.at_speed(jnp.asarray(SPEED)).rates(state).state.rollers


@pytest.mark.wide
@pytest.mark.parametrize("base", ["mass", "length", "time"])
def test_other_units_give_the_same_motion(base):
    """Every declared unit is right, and no number with a unit is hidden in the formulas."""
    model = bearing(**{"drag_coefficient": 1.0, "churning_coefficient": 1.0, "outer_speed": 30.0, "rest": 0.01})
    factor = 1.7
    state, speed = some_state(model, 4), jnp.asarray(SPEED)
    units = (["1", "rad/s", "m", "m/s", "rad/s"], ["m", "m", "m/s", "m/s", "rad/s", "m", "m", "m/s", "m/s"], ["1", "s"])
    by = [factor ** np.array([unit_exponents(u)[base] for u in row]) for row in units]
    rate = factor ** -unit_exponents("s")[base]
    scaled = BearingState(state.rollers * by[0][:, None], state.bodies * by[1], state.clock * by[2])
    once = right_side(model, speed, state)
    found = right_side(in_other_units(model, base, factor), speed * by[0][1], scaled)
    _same(found, BearingState(once.rollers * by[0][:, None] * rate, once.bodies * by[1] * rate, once.clock), 1e-9)


@pytest.mark.wide
def test_derivatives_by_every_parameter():
    """Derivatives of a sum of all rates with random weights, against differences of fourth order."""
    model = bearing(drag_coefficient=1.0, churning_coefficient=1.0, outer_speed=30.0, rest=0.01)
    model = jc.replace(model, **{"pockets.pocket_law": "power"})
    state = some_state(model, 5)
    weights = np.random.default_rng(0).normal(size=76)
    weights /= np.abs(np.asarray(ravel_pytree(right_side(model, jnp.asarray(SPEED), state))[0])) + 1.0
    names = list(jc.parameters(model))

    @jax.jit
    def value(numbers):
        changed = jc.replace(model, **dict(zip(names, numbers, strict=True)))
        return jnp.dot(ravel_pytree(changed.at_speed(jnp.asarray(SPEED)).rates(state).state)[0], jnp.asarray(weights))

    at = jnp.stack(list(jc.parameters(model).values()))
    slopes = np.asarray(jax.jit(jax.jacfwd(value))(at))
    steps = np.where(np.abs(at) > 0, 1e-4 * np.abs(at), 1e-6)
    for sharp in ("radial_clearance", "inner_raceway_diameter", "roller_diameter", "rib_diameter", "guidance_gap"):
        steps[names.index(sharp)] = 1e-9
    many = jax.jit(jax.vmap(value))
    shifted = lambda k: np.asarray(many(jnp.asarray(np.asarray(at) + k * np.diag(steps))))
    differences = (8 * (shifted(1) - shifted(-1)) - (shifted(2) - shifted(-2))) / (12 * steps)
    assert np.count_nonzero(slopes) > 40
    for name, slope, difference, size in zip(names, slopes, differences, np.asarray(at), strict=True):
        assert slope == pytest.approx(difference, rel=1e-4, abs=1e-7 / max(abs(size), 1e-9)), name


@pytest.mark.wide
@pytest.mark.parametrize("values", [(0.0, 0.05, 0.036, 1.0), (0.01, 0.10, 0.005, 0.5), (0.03, 0.04, 0.0, 2.0)])
def test_traction_curve(values):
    """Two printed solutions; coefficients of the second implementation; the peak is where and what it should be."""
    law = Traction(*values)
    found, expected = law.at(), gupta(*values)
    np.testing.assert_allclose([found.a, found.b, found.c, found.d], expected, rtol=1e-9)
    printed = {0.0: (0.101781, 1.547272), 0.01: (0.496374, 1.960504)}
    if values[0] in printed:
        np.testing.assert_allclose([found.b, found.c], printed[values[0]], atol=6e-7)
    kappa = jax.jit(lambda u: law.at()(u) - 0.0)
    sharp = jax.jit(lambda u: eqx.tree_at(lambda x: x.traction_smoothing, law, jnp.asarray(1e-9)).at()(u))
    assert float(sharp(values[3])) == pytest.approx(values[1], rel=1e-12)
    assert float(jax.grad(sharp)(values[3])) == pytest.approx(0.0, abs=1e-12)
    assert float(kappa(-0.37)) == -float(kappa(0.37))
    with pytest.raises(ValueError, match="peak"):
        Traction(rest=0.06)


def test_derivatives_of_lamberts_function():
    """W(x) = x - x^2 + 3/2 x^3 - ..., and W' = 1/(exp(W) (1 + W)) anywhere."""
    first, second = jax.grad(lambert_w), jax.grad(jax.grad(lambert_w))
    assert [float(f(0.0)) for f in (first, second, jax.grad(second))] == pytest.approx([1, -2, 9], rel=1e-12)
    w = float(lambert_w(-0.3))
    assert float(second(-0.3)) == pytest.approx(-(w + 2) / (np.exp(2 * w) * (1 + w) ** 3), rel=1e-10)


def test_traction_falls_with_the_viscosity():
    """The slope follows eta_p/h, by Roelands' law and the film thickness of Dowson and Higginson, from 20 to 80 °C
    within a tenth; in the oil of the curve itself nothing changes."""
    roelands = lambda eta, p: eta * np.exp((np.log(eta) + 9.67) * ((1 + 5.1e-9 * p) ** 0.6 - 1))
    film = lambda eta: eta**0.7 * (0.6 * 5.1e-9 * (np.log(eta) + 9.67)) ** 0.54
    for pressure, exponent in ((1.5e8, 0.6), (2.2e8, 0.8), (5e8, 1.4)):
        law = Traction(viscosity_exponent=exponent)
        slope = lambda thickness, law=law: float(jax.grad(lambda u: law.at(thickness)(u))(0.0))
        for celsius in (20.0, 80.0):
            oil = vg(56.0, 273.15 + celsius)
            cold, warm = float(oil.dynamic_viscosity), float(vg(56.0).dynamic_viscosity)
            expected = roelands(cold, pressure) / film(cold) / (roelands(warm, pressure) / film(warm))
            assert slope(cold / warm) / slope(1.0) == pytest.approx(expected, rel=0.1), (pressure, celsius)
        assert slope(1.0) == float(jax.grad(lambda u: Traction().at()(u))(0.0))
