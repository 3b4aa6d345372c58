"""Branches of periodic orbits: through folds, closed, with period doublings, branch points and tori in their places.

"DOP853" in a comment means: computed with SciPy's DOP853 at a tolerance of 1e-12 and Newton's method, sharing nothing
with this library. "Planted" systems have orbits and multipliers that are known exactly.
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import jaxcage as jc


METHOD = jc.method("rodas4", steps=256)
FINE = jc.method("rodas4", steps=1024)
DOUBLING = 0.265581786  # force at which the period doubles first (DOP853)


def numbers(**values):
    return {name: jnp.asarray(x, dtype=float) for name, x in values.items()}


def kinds(branch):
    return [p.kind for p in branch.special]


class Duffing(eqx.Module):
    """x'' + d x' - k x + x^3 = g cos(w t): double-well for k > 0, hardening for k < 0."""

    d: jax.Array
    k: jax.Array
    g: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-self.d * u + self.k * x - x**3 + self.g * jnp.cos(tau),)


def hardening(g=0.3):
    return jc.ForcedOscillator(Duffing(**numbers(d=0.1, k=-1, g=g)), coordinates=1)


def double_well(g=0.26):
    return jc.ForcedOscillator(Duffing(**numbers(d=0.3, k=1, g=g)), coordinates=1)


def image(system, speed, state, method=METHOD):
    """The state a revolution later."""
    strobe = jc.strobe_map(system, jnp.asarray(speed), method)
    return np.stack(strobe(tuple(jnp.asarray(c) for c in state)).y)


@pytest.fixture(scope="module")
def over_speed():
    orbit = jc.periodic_orbit(hardening(), 0.8, guess=(0.5, 0.0), revolutions=200, method=METHOD)
    return jc.branch(hardening(), orbit, lower=0.5, upper=2.5, method=METHOD)


@pytest.fixture(scope="module")
def over_force():
    orbit = jc.periodic_orbit(double_well(), 1.2, guess=(1.0, 0.0), revolutions=100, method=FINE)
    return jc.branch(double_well(), orbit, "g", lower=0.1, upper=0.35, method=FINE)


def test_branch_passes_the_folds_of_the_hardening_duffing(over_speed):
    """DOP853, all printed digits."""
    upper, lower = over_speed.special
    assert upper.kind == lower.kind == "fold" and upper.edge and lower.edge
    assert abs(upper.value - 1.77971952) < 1e-7 and abs(lower.value - 1.3242362) < 1e-7
    assert upper.speed == upper.value and upper.parameter == "speed"
    for fold in (upper, lower):
        assert abs(fold.critical - 1) < 1e-6
        np.testing.assert_allclose(image(hardening(), fold.speed, fold.state), fold.state, atol=1e-9)
        # Along the critical direction the map moves as the state does, to first order.
        h = 1e-4 * fold.direction / np.linalg.norm(fold.direction)
        moved = image(hardening(), fold.speed, fold.state + h) - image(hardening(), fold.speed, fold.state - h)
        np.testing.assert_allclose(moved, 2 * h, atol=1e-4 * np.linalg.norm(h))
    assert over_speed.ended == ("range", "range")
    assert over_speed.value[0] <= 0.5 and over_speed.value[-1] >= 2.5


def test_stability_changes_at_the_folds_and_nowhere_else(over_speed):
    first, second = (p.index for p in over_speed.special)
    stable = np.ones(over_speed.value.size, dtype=bool)
    stable[first + 1 : second + 1] = False
    assert np.array_equal(over_speed.stable, stable)
    assert second - first > 5
    # From fold to fold the speed goes down.
    assert np.all(np.diff(over_speed.value[first + 1 : second + 1]) < 0)
    assert np.all(np.diff(over_speed.value[: first + 1]) > 0) and np.all(np.diff(over_speed.value[second + 1 :]) > 0)
    largest = np.abs(over_speed.multipliers[:, 0])
    assert np.array_equal(largest < 1, stable)


def test_points_of_a_branch_are_orbits_with_the_right_multipliers(over_speed):
    """Damping is all that shrinks areas; the strobe map does not know of the continuation."""
    product = np.prod(over_speed.multipliers, axis=1)
    np.testing.assert_allclose(product, np.exp(-0.1 * 2 * np.pi / over_speed.speed), rtol=1e-6)
    map_of = eqx.filter_jit(jax.vmap(lambda w, y: jnp.stack(jc.strobe_map(hardening(), w, METHOD)((y[0], y[1])).y)))
    images = map_of(jnp.asarray(over_speed.speed), jnp.asarray(over_speed.state))
    np.testing.assert_allclose(images, over_speed.state, atol=1e-9)
    # Neighbours are near: no step has gone over to another branch.
    step = np.diff(np.c_[over_speed.value / 0.1, over_speed.state], axis=0)
    assert np.max(np.linalg.norm(step, axis=1)) < 0.15


def test_branch_in_the_force_passes_folds_of_its_own():
    """At the speed of a fold over speed, the fold over force is at the force used there."""
    speed = 1.77971952
    orbit = jc.periodic_orbit(hardening(0.2), speed, guess=(0.0, 0.0), revolutions=200, method=METHOD)
    branch = jc.branch(hardening(0.2), orbit, "g", lower=0.05, upper=1.5, method=METHOD)
    assert kinds(branch) == ["fold", "fold"] and branch.parameter == "g"
    np.testing.assert_array_equal(branch.speed, speed)
    assert branch.special[0].value > branch.special[1].value
    assert abs(branch.special[1].value - 0.3) < 1e-7
    assert not np.any(branch.stable[branch.special[0].index + 1 : branch.special[1].index + 1])
    assert branch.stable[0] and branch.stable[-1]
    np.testing.assert_allclose(np.prod(branch.multipliers, axis=1), np.exp(-0.2 * np.pi / speed), rtol=1e-6)


def test_parameter_as_a_function(over_speed):
    orbit = jc.periodic_orbit(hardening(), 0.8, guess=(0.5, 0.0), method=METHOD)
    named = jc.branch(hardening(), orbit, "g", lower=0.2, upper=0.4, method=METHOD)
    picked = jc.branch(hardening(), orbit, lambda s: s.acceleration.g, lower=0.2, upper=0.4, method=METHOD)
    np.testing.assert_array_equal(named.value, picked.value)
    np.testing.assert_array_equal(named.state, picked.state)
    assert picked.parameter == "parameter" and np.ptp(named.value) > 0.2


def test_period_doublings_over_the_force(over_force):
    points = [p for p in over_force.special if p.kind == "period-doubling"]
    first = min(points, key=lambda p: abs(p.value - DOUBLING))
    assert abs(first.value - DOUBLING) < 1e-7
    assert first.edge and first.speed == 1.2 and abs(first.critical + 1) < 1e-8
    assert over_force.stable[first.index] != over_force.stable[first.index + 1]


@pytest.fixture(scope="module")
def doubling(over_force):
    return min(over_force.special, key=lambda p: abs(p.value - DOUBLING))


def test_doubled_branch_has_twice_the_period(doubling):
    system = double_well()
    doubled = jc.orbits.doubled_branch(
        system, doubling, "g", lower=0.1, upper=0.35, until_doubling=True, method=FINE, speed=1.2
    )
    assert doubled.periods == 2 and doubled.ended[0] == "doubling"
    np.testing.assert_allclose(np.prod(doubled.multipliers, axis=1), np.exp(-0.3 * 4 * np.pi / 1.2), rtol=1e-6)
    away = []
    for value, state in zip(doubled.value[::3], doubled.state[::3], strict=True):
        once = image(double_well(value), 1.2, state, FINE)
        np.testing.assert_allclose(image(double_well(value), 1.2, once, FINE), state, atol=1e-8)
        away.append(np.linalg.norm(once - state) / np.sqrt(value - DOUBLING))
    # Born of amplitude zero with the square root of the distance.
    assert np.all(np.array(away) > 1) and abs(away[1] / away[0] - 1) < 0.1
    second = [p for p in doubled.special if p.kind == "period-doubling"]
    assert len(second) == 1 and second[0].periods == 2
    assert abs(second[0].value - 0.286693158) < 2e-9  # DOP853


def test_cascade_of_the_double_well_duffing(doubling):
    """DOP853, all printed digits; the limit is where chaos sets in, 0.2923 on a grid of simulations."""
    found = jc.cascade(double_well(), doubling, "g", lower=0.1, upper=0.35, levels=4, method=FINE)
    np.testing.assert_allclose(found.values, [0.265581786, 0.286693158, 0.291089909, 0.292031000], rtol=0, atol=2e-9)
    assert [int(p.periods) for p in found.points] == [1, 2, 4, 8]
    np.testing.assert_allclose(found.ratios, [4.80, 4.672], atol=0.005)
    assert found.error < 1e-6
    assert abs(found.limit - 0.29228749) < found.error + 5e-9


def test_cascade_that_does_not_go_on_is_shorter(doubling):
    """The range ends before the third doubling: what was found is returned, the limit from two points."""
    found = jc.cascade(double_well(), doubling, "g", lower=0.1, upper=0.29, levels=4, method=FINE)
    assert len(found.points) == 2
    assert found.error == np.inf and abs(found.limit - 0.2924) < 2e-4
