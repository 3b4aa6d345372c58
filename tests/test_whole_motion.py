"""The whole bearing in motion: rolling, static load, energy, angular momentum, bounces, skidding."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from energies import cage_angular_momentum, kinetic_energy, potential_energy
from helpers import beyond_range
from jax.flatten_util import ravel_pytree
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from test_whole_reference import everything

import jaxcage as jc
from jaxcage.models import LEDGER, BearingState, Bodies, Rollers, roller_history, rolling_start, state_scale


SPEED = jc.rpm(10000)
NO_LAND = {"lubricant.density": 0.0, "stiffness": 0.0}
"""No oil and no contact: nothing between cage and land."""


def bearing(**changed):
    model = jc.whole_bearing("nu2310")
    numbers = {name: changed.pop(name) for name in jc.parameters(model) if name in changed}
    return beyond_range(jc.replace(model, **changed), **numbers)


@eqx.filter_jit
def energy_and_momentum(model, state):
    at = model.at_speed(jnp.asarray(SPEED))
    return kinetic_energy(at, state) + potential_energy(at, state), cage_angular_momentum(at, state)


def moving(model, **parts):
    """A state with what is given, all else as it would roll."""
    n, omega = model.bearing.n_rollers, float(model.rolling_cage_speed(SPEED))
    pitch = float(model.outer_radius - model.bearing.roller_diameter / 2)
    given = {"lag": 0.0, "spin": float(model.rolling_spin(SPEED)), "radius": pitch, "radial": 0.0, "orbit": omega}
    rollers = [jnp.asarray(np.broadcast_to(parts.get(name, value), (n,)) * 1.0) for name, value in given.items()]
    bodies = Bodies(*(float(parts.get(name, 0.0)) for name in Bodies._fields))
    return BearingState.of(Rollers(*rollers), bodies, parts.get("angle", 0.0))


@pytest.fixture(scope="module")
def run():
    """One revolution, from a cage in the middle of its clearance to its land, by tight steps."""
    model = bearing()
    start = rolling_start(model, SPEED, cage=1)
    return model, start, jc.simulate(model, SPEED, revolutions=1, samples=32, start=start, method=jc.native(3e-7, 1e-2))


@pytest.mark.wide
def test_energy(run):
    """The energy that the shaft gives in a revolution is lost in contacts or stored."""
    model, start, ran = run
    assert ran.outcome == "successful" and ran.error < 1e-3
    gain = float(energy_and_momentum(model, ran.last)[0] - energy_and_momentum(model, start)[0])
    lost = [ran.total(name) for name in LEDGER[1:]]
    assert min(lost) >= 0 and sum(part > 0 for part in lost) >= 6
    assert abs(ran.total("input") - sum(lost) - gain) < 1e-8 * ran.total("input")


KINDS = {
    "inner": {"guidance": "inner", "eccentricity": 2e-4, "drag_coefficient": 1.0, "churning_coefficient": 0.5}
    | {"drag.rolling_law": "bath", "drag.drag_law": "cylinder"},
    "outer ring turns": {"outer_speed": -300.0, "pockets.pocket_law": "power", "rest": 0.005},
    "held": {"cage_rotation": "held", "film.model": "full", "supply_pressure": 0.0},
}


@pytest.mark.wide
@pytest.mark.parametrize("kind", KINDS)
def test_energy_of_other_kinds(kind):
    model = bearing(**KINDS[kind])
    start = rolling_start(model, SPEED, cage=2)
    ran = jc.simulate(model, SPEED, revolutions=1, samples=32, start=start, method=jc.native(3e-7, 1e-2))
    gain = float(energy_and_momentum(model, ran.last)[0] - energy_and_momentum(model, start)[0])
    lost = sum(ran.total(name) for name in LEDGER[1:])
    assert ran.outcome == "successful"
    assert abs(ran.total("input") - lost - gain) < 1e-8 * abs(lost)


@pytest.mark.wide
def test_angular_momentum_of_the_cage(run):
    """About the outer ring's centre: the integral of the moments of pockets, land and weight."""
    model, start, ran = run
    gain = float(energy_and_momentum(model, ran.last)[1] - energy_and_momentum(model, start)[1])
    size = float(model.cage_inertia * model.rolling_cage_speed(SPEED))
    assert abs(gain) > 1e-4 * size
    assert ran.total("cage_moment") == pytest.approx(gain, abs=1e-12 * size)


def test_measures(run):
    """A run's measures against its samples: slip, powers, torque."""
    model, _, ran = run
    found = jc.measures(model, ran).value
    omega = 2 * np.pi / (ran.time[-1] - ran.time[0])
    assert ran.angle[-1] - ran.angle[0] == pytest.approx(2 * np.pi, abs=1e-12)
    assert found("cage_slip") == pytest.approx(1 - omega / (0.401037 * SPEED), abs=3e-6)
    assert found("friction_power_W") == pytest.approx(sum(found(f"power_{name}_W") for name in LEDGER[1:]), rel=1e-12)
    assert found("friction_torque_N_m") * SPEED == pytest.approx(found("friction_power_W"), rel=1e-12)
    eps = np.hypot(ran.bodies[:, 0], ran.bodies[:, 1]) / float(model.clearance)
    assert found("eccentricity_max") >= eps.max() - 1e-9
    assert found("eccentricity_mean") == pytest.approx(np.trapezoid(eps, ran.time) / np.ptp(ran.time), rel=1e-2)
    spin = ran.rollers[:, 1] / float(model.rolling_spin(SPEED))
    assert 1 - spin.min() - 1e-12 <= found("roller_slip_max") < 1 - spin.min() + 0.01


@pytest.mark.wide
def test_rollers_that_do_not_slip():
    """Pressed between the rings, with nothing to hold them back: psi' = omega_i (r - h_i)/(r (1 + h_i/h_o)).

    Started with orbits and spins that are off by up to 1e-3.
    """
    model = bearing(
        **NO_LAND, load=0.0, gravity=0.0, pocket_friction=0.0, radial_clearance=-10e-6, raceway_damping=10.0
    )
    half, k = float(model.bearing.roller_diameter) / 2, float(model.bearing.raceway_stiffness)
    r_o, r_i, m = float(model.outer_radius), float(model.inner_radius), float(model.bearing.roller_mass)
    omega = 0.401 * SPEED
    push = lambda r: k * ((r + half - r_o) ** (10 / 9) - (r_i + half - r) ** (10 / 9)) - m * r * omega**2
    r: Any = brentq(push, r_o - half, r_i + half, xtol=1e-16)
    h_o, h_i = half - (r + half - r_o) / 2, half - (r_i + half - r) / 2
    cage = SPEED * (r - h_i) / (r * (1 + h_i / h_o))
    off = 1e-3 * np.cos(np.arange(13))
    start = moving(model, radius=r, orbit=omega * (1 + off), spin=-cage * r / h_o * (1 - off), cage_speed=cage)
    ran = jc.simulate(model, SPEED, revolutions=1, samples=32, start=start, method=jc.native(1e-7, 1e-2))
    _, _, r, _, orbit = ran.rollers[-1]
    outer, inner = r + half - r_o, r_i + half - r
    h_o, h_i = half - outer / 2, half - inner / 2
    assert ran.outcome == "successful" and np.all(outer > 1e-6) and np.all(inner > 1e-6)
    np.testing.assert_allclose(orbit, SPEED * (r - h_i) / (r * (1 + h_i / h_o)), rtol=1e-8)


@pytest.mark.wide
def test_cage_speed_under_load_without_friction():
    """R_i omega_i/(2 (R_o - D/2)) to 1e-4, (omega_i/2)(1 - D/d_m) to 1e-3 only."""
    model = bearing(**NO_LAND, gravity=0.0, pocket_friction=0.0, eccentricity=0.0)
    start = rolling_start(model, SPEED, cage=1)
    ran = jc.simulate(model, SPEED, revolutions=1, samples=32, start=start)
    spent = ran.time[-1] - ran.time[0]
    mean = (2 * np.pi + (ran.rollers[-1, 0] - ran.rollers[0, 0]).mean()) / spent
    rolling = 32.5 * SPEED / (2 * (32.5 + 16 + 0.02 - 8))
    assert rolling == pytest.approx(0.401037 * SPEED, rel=2e-6)
    assert mean == pytest.approx(rolling, rel=1e-4)
    simple = SPEED / 2 * (1 - 16 / 81)
    assert mean == pytest.approx(simple, rel=1e-3) and mean != pytest.approx(simple, rel=2e-4)


def shared(bend):
    """Shift [um] and largest load [N] of 13 rollers, two line contacts in series, at 40 um under 4450 N.

    The approach of a roller at the angle t from the load is d cos t - 20 um in statics; the distance between the
    roller's centre and the ring's is longer by (d sin t)^2/(2 r), and turned by d sin t/r, which `bend` considers.
    """
    k, t = 8.06e10 * 0.027 ** (8 / 9) / 2 ** (10 / 9), 2 * np.pi / 13 * np.arange(13)
    approach = lambda d: np.maximum(d * np.cos(t) - 20e-6 - bend * (d * np.sin(t)) ** 2 / (2 * 0.04052), 0.0)
    upward = lambda d: k * approach(d) ** (10 / 9) * np.cos(t + bend * d * np.sin(t) / 0.04052)
    shift: Any = brentq(lambda d: upward(d).sum() - 4450, 21e-6, 40e-6, xtol=1e-18)
    return 1e6 * shift, float(k * approach(shift)[0] ** (10 / 9))


def test_static_load():
    """Three rollers carry 4450 N at 40 um: 26.106 um and, but for second order, 2420.4 N; and the ring's weight too.

    Rollers are held where they are along the circumference; at rest.
    """
    angles = -np.pi / 2 + 2 * np.pi / 13 * np.arange(13)
    pressed = np.array([0, 1, 12])

    def state(model, unknown):
        radius = np.full(13, float(model.outer_radius) - 8e-3 - 1e-6)
        radius[pressed] = unknown[1:4] * 1e-6 + float(model.outer_radius) - 8e-3
        return moving(model, spin=0.0, orbit=0.0, radius=radius, angle=-np.pi / 2, ring_y=unknown[0] * 1e-6)

    assert shared(bend=False) == pytest.approx((26.106, 2420.4), rel=2e-5)
    shaft = jnp.asarray(0.0)
    for gravity in (0.0, 9.81):
        model = bearing(gravity=gravity, radial_clearance=40e-6)

        def pull(unknown):
            _, rates = everything(model, shaft, state(model, unknown))
            masses = np.array([float(model.ring.ring_mass), *(float(model.bearing.roller_mass) * np.ones(3))])
            return masses * np.array([rates.state.bodies[8], *np.asarray(rates.state.rollers)[3, pressed]])

        found = fsolve(pull, np.array([-26.0, 3.0, 1.5, 1.5]), xtol=1e-13)
        f, _ = everything(model, shaft, state(model, found))
        if gravity == 0:
            assert -found[0] == pytest.approx(26.106, rel=1e-4)
            assert float(f.inner.load.max()) == pytest.approx(shared(bend=True)[1], rel=1e-6)
            assert float(f.inner.load.max()) == pytest.approx(2420.4, rel=3e-4)
        out, across = np.asarray(f.geometry.inner_out), np.asarray(f.geometry.inner_across)
        load, sin, cos = np.asarray(f.inner.load), np.sin(angles), np.cos(angles)
        upward = -(load * (out * sin + across * cos)).sum()
        assert upward == pytest.approx(4450 + gravity * float(model.ring.ring_mass), rel=1e-9)


def over_time(model, speed, start, seconds):
    """A state so much later, by SciPy's integration of the rates over time: the engine counts the cage's angle."""
    at = model.at_speed(jnp.asarray(speed))
    first, unpack = ravel_pytree(start)
    rate = eqx.filter_jit(lambda y: ravel_pytree(at.rates(unpack(y)).state)[0])
    rates = lambda t, y: np.asarray(rate(jnp.asarray(y)))
    done = solve_ivp(rates, (0.0, seconds), np.asarray(first), "DOP853", rtol=1e-10, atol=1e-14)
    return unpack(jnp.asarray(done.y[:, -1]))


@pytest.mark.wide
def test_bounces():
    """Off a bar and off the outer raceway, both by ln[(1 + chi)/(1 - chi e)] = chi (1 + e) with chi = 1.5 alpha v0.

    A roller flies along the circumference, another outwards; cage and rings are at rest, the cage too heavy to move.
    """
    speed, alpha = 0.2, 1.0
    model = bearing(
        **NO_LAND,
        gravity=0.0,
        load=0.0,
        peak=2e-12,
        limit=0.0,
        pocket_friction=0.0,
        pocket_damping=alpha,
        raceway_damping=alpha,
        cage_mass=1e12,
        cage_inertia=1e12,
        eccentricity=0.0,
        mounting_damping=0.0,
    )
    radius = np.full(13, float(model.outer_radius) - 8e-3 - 10e-6)
    lag, radial, orbit = np.zeros(13), np.zeros(13), np.zeros(13)
    lag[2], orbit[2] = 0.149e-3 / radius[2], speed / radius[2]
    radius[5], radial[5] = radius[5] + 8e-6, speed
    start = moving(model, spin=0.0, radius=radius, lag=lag, radial=radial, orbit=orbit)
    beta, _, r, back, turning = over_time(model, 0.0, start, 1.4e-4).rollers
    along = back[2] * np.sin(beta[2]) + r[2] * turning[2] * np.cos(beta[2])
    for before, after in ((speed * np.cos(lag[2]), along), (speed, back[5])):
        chi = 1.5 * alpha * before
        e = brentq(lambda e: np.log((1 + chi) / (1 - chi * e)) - chi * (1 + e), 0.5, 0.99, xtol=1e-14)
        assert -after / before == pytest.approx(e, abs=1e-6)


def test_steps_that_are_too_long_are_said():
    """A tolerance that lets errors through, and none allowed: the run is done and called inaccurate."""
    model = bearing()
    ran = jc.simulate(model, SPEED, revolutions=1, samples=32, method=jc.native(1e-2, 1e-9))
    assert ran.outcome == "inaccurate" and ran.error > 1e-9
    unit = state_scale(model, SPEED)
    assert float(unit.bodies[0]) == pytest.approx(0.225e-3)


def test_a_cage_at_rest_is_not_followed_over_its_angle():
    model = bearing()
    start = rolling_start(model, SPEED, turning=0.01)
    assert jc.simulate(model, SPEED, revolutions=1, samples=32, start=start).outcome == "outside"
    with pytest.raises(ValueError, match="speed"):
        jc.simulate(model, 0.0, revolutions=1)
    with pytest.raises(ValueError, match="revolutions"):
        jc.simulate(model, SPEED, revolutions=0)
    against = jc.replace(model, outer_speed=-0.67 * SPEED)  # the cage hardly turns
    with pytest.raises(ValueError, match="must make the cage turn at 0.01 of the faster ring's speed"):
        jc.simulate(against, SPEED, revolutions=1)


@pytest.mark.wide
def test_a_revolution_of_a_stiff_bearing():
    """A slow shaft in oil so cold that the film makes a cage at its land stiff: stability limits the steps, not the
    error; the whole revolution is run, and its error is small."""
    model, slow = bearing(temperature=273.15), jc.rpm(1000)
    start = rolling_start(model, slow, cage=1)
    place = np.array([0.0, 0.97 * float(model.clearance)])
    run = jc.simulate(model, slow, revolutions=1, start=start._replace(bodies=start.bodies.at[:2].set(place)))
    assert run.outcome == "successful" and run.error < 1e-2 and np.all(np.isfinite(run.state))


@pytest.mark.slow
def test_preload_prevents_skidding():
    """Rollers skid in the oil's drag at 300 N and a clearance of 40 um; with preload all roll, even without load."""
    oil = {"drag.drag_law": "cylinder", "drag.rolling_law": "bath", "drag_coefficient": 1.0, "oil_share": 0.015}
    slips, loads = {}, {}
    for clearance, load in ((40e-6, 300.0), (-10e-6, 0.0)):
        model = jc.replace(jc.whole_bearing("nu2310"), load=load, radial_clearance=clearance, **oil)
        ran = jc.simulate(model, jc.rpm(6700), revolutions=10, discard=20, samples=32)
        assert ran.outcome == "successful"
        slips[clearance] = jc.measures(model, ran).value("cage_slip")
        loads[clearance] = roller_history(model, ran).inner_load.min()
    assert slips[40e-6] > 0.2 and abs(slips[-10e-6]) < 2e-3
    assert loads[40e-6] == 0 and loads[-10e-6] > 100
