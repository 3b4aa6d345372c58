"""Orbits, branches and bifurcations take as many steps as they need, and say how far half as many put them."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import reference
from helpers import edge_speed
from laws import double_well
from literature import DUFFING_DOUBLINGS
from reference import bifurcation as shooting

import jaxcage as jc
from jaxcage.orbits import Point, sensitivity
from jaxcage.solve import FixedSteps, strobe_map


RPM = np.pi / 30
AT_1A = (1.469298462e-04, -1.9758642656e-04, 6.4051751356e-01, 2.655842859e-01)
AT_3A = (2.2547097488e-04, -2.0012129425e-04, 5.2115206118e-01, 4.6798404478e-01)
TOUCHING = {
    "1a zone 2 onset": (jc.case("1a"), Point("fold", 18686.338 * RPM, np.array(AT_1A))),
    "3a zone 2 onset": (jc.case("3a"), Point("Neimark-Sacker", 19133.235 * RPM, np.array(AT_3A))),
}


class Stop(eqx.Module):
    """x'' = -k x - d x' + f cos(tau), and a stop that sets in over `width` at x = 1."""

    f: jax.Array
    width: jax.Array
    k: jax.Array
    d: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        over = (x - 1) / self.width
        push = 200.0 * self.width * (over + jnp.sqrt(1 + over**2)) / 2
        return (-self.k * x - self.d * u - push + self.f * jnp.cos(tau),)


def stop(f=0.3):
    numbers = {"f": f, "width": 2e-3, "k": 1.0, "d": 0.1}
    return jc.ForcedOscillator(Stop(**{n: jnp.asarray(x) for n, x in numbers.items()}), coordinates=1)


def image(model, orbit, steps):
    """A revolution on by so many steps, over the scale."""
    strobe = strobe_map(model, orbit.speed, FixedSteps(orbit.solver, steps))
    return np.array(strobe(tuple(orbit.state)).y) / np.array([float(c) for c in model.scale(orbit.speed)])


@pytest.mark.wide
def test_error_of_an_orbit_bounds_what_four_times_the_steps_change():
    stiff = jc.replace(jc.case("1a"), stiffness_x=1e7, stiffness_y=1e7)
    steps = []
    for model, rpm, guess in ((jc.case("1a"), 13000, None), (jc.case("3a"), 19133, AT_3A), (stiff, 600, None)):
        orbit = jc.periodic_orbit(model, rpm * RPM, guess=guess)
        steps.append(int(orbit.steps))
        assert orbit.status == "converged" and 0 < orbit.error < 1e-6
        assert np.max(np.abs(image(model, orbit, steps[-1]) - image(model, orbit, 4 * steps[-1]))) < orbit.error
        finer = jc.periodic_orbit(model, rpm * RPM, guess=orbit, method=FixedSteps(orbit.solver, 4 * steps[-1]))
        np.testing.assert_allclose(np.sort(abs(orbit.multipliers)), np.sort(abs(finer.multipliers)), atol=1e-3)
        assert f"{steps[-1]} steps per revolution" in str(orbit)
    assert max(steps[:2]) <= 1024 <= steps[2]  # shortened where the land is touched, many where the support is stiff


@pytest.mark.wide
def test_error_of_a_bifurcation_holds_the_true_value_and_the_gradient_belongs_to_it():
    inside, exact = DUFFING_DOUBLINGS[1]
    orbit = jc.periodic_orbit(double_well(inside), 1.2, guess=(1.0, 0.0), revolutions=200)
    find = lambda speed, **k: jc.bifurcation(double_well(inside), "period-doubling", orbit, "g", speed=speed, **k)
    point = find(1.2)
    assert point.status == "converged"
    assert 0 < point.error < 1e-7 * point.value
    assert abs(point.value - exact.value) < point.error + exact.tolerance
    steps = int(point.steps)
    fixed = jax.grad(lambda w: find(w, method=jc.method("rk4", steps=steps)).value)(1.2)
    assert jax.grad(lambda w: find(w).value)(1.2) == pytest.approx(float(fixed), rel=1e-9)


def test_error_by_an_odd_number_of_steps_is_also_from_half_as_many():
    odd, even = (jc.periodic_orbit(stop(), 2.5, method=jc.method("rk4", steps=steps)) for steps in (65, 64))
    assert odd.steps == 65 and odd.error == pytest.approx(float(even.error), rel=0.2)


def test_bifurcation_that_half_the_steps_move_is_not_converged():
    inside, _ = DUFFING_DOUBLINGS[1]
    orbit = jc.periodic_orbit(double_well(inside), 1.2, guess=(1.0, 0.0), revolutions=200)
    coarse = jc.method("rk4", steps=24)
    find = lambda w: jc.bifurcation(double_well(inside), "period-doubling", orbit, "g", speed=w, method=coarse)
    point = find(1.2)
    assert point.status == "not converged" and not point.converged
    assert np.isnan(point.value) and point.error > 2e-4 * inside
    assert np.isnan(jax.grad(lambda w: find(w).value)(1.2))


@pytest.mark.wide
def test_branch_takes_more_steps_where_the_stop_is_touched():
    branch = jc.branch(stop(), jc.periodic_orbit(stop(), 2.5), lower=0.5, upper=3.0)
    highest = np.array([np.max(np.abs(s)) for s in branch.state])
    assert branch.steps.min() <= 512 and branch.steps.max() >= 2048
    # Stated is three times the difference that steps are chosen by.
    assert np.all(branch.error < 3e-5) and highest.size > 20
    points = [p for p in branch.special if p.status == "converged"]
    assert points and len(points) == len(branch.special)
    for p in points:
        fixed = FixedSteps(jc.method("rk4").solver, 4 * p.steps)
        finer = jc.bifurcation(stop(), p.kind, p, method=fixed)
        assert abs(finer.value - p.value) < p.error + 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("edge", TOUCHING)
def test_edges_with_contact_by_two_solvers_and_by_shooting(edge):
    """To 20 ppm is asked for; the land sets in over 2e-7 m, and all three resolve that."""
    model, point = TOUCHING[edge]
    ours = sensitivity(model, point)
    rodas4 = edge_speed(model, point, jc.method("rodas4", steps=16384)) / RPM
    given = reference.numbers_of(model)
    make = lambda speed: reference.Field(given, speed)
    theirs = shooting(make, point.kind, point.state, ours.value_rpm * RPM) / RPM
    assert ours.status == "converged" and ours.error_rpm < 20e-6 * ours.value_rpm
    assert abs(ours.value_rpm - theirs) < ours.error_rpm
    assert abs(rodas4 - theirs) < 1e-3


class Sticking(eqx.Module):
    """x'' = -x - 10 tanh(u / width) + cos(tau): friction that holds the mass but for a creep."""

    width: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-x - 10.0 * jnp.tanh(u / self.width) + jnp.cos(tau),)


@pytest.mark.wide
def test_where_bounded_forces_are_too_stiff_for_runge_kutta_the_orbit_is_found_all_the_same():
    """Explicit steps chatter about rest, but nothing overflows: what they close on, if anything, moves with the steps.
    The mass creeps with tanh(u / width) = cos(tau) / 10, but for terms of order width squared."""
    width = 1e-4
    system = jc.ForcedOscillator(Sticking(jnp.asarray(width)), coordinates=1)
    orbit = jc.periodic_orbit(system, 1.0, guess=(0.0, 0.0))
    assert orbit.stable and orbit.error < 1e-6
    assert orbit.state[1] == pytest.approx(width * np.arctanh(0.1), rel=1e-4)
    branch = jc.branch(system, orbit, lower=0.95, upper=1.05)
    assert branch.stable.all() and branch.value.min() < 0.951 and branch.value.max() > 1.049
