"""The whole bearing against its second implementation: right side at random states, and a short arc."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference import WholeBearing

import jaxcage as jc
from jaxcage.models.whole import BearingState, state_scale


SPEED = jc.rpm(10000)
RICH = {
    "pockets.pocket_law": "power",
    "drag_coefficient": 1.2,
    "churning_coefficient": 0.6,
    "rest": 0.005,
    "outer_speed": 40.0,
    "eccentricity": 1e-4,
}
KINDS = {
    "plain": {},
    "rich": RICH,
    "inner": {"guidance": "inner", "outer_speed": 500.0, "eccentricity": 2e-4},
    "full": {"film.model": "full", "cage_rotation": "held", "pockets.pocket_law": "power"},
}


def random_state(model, seed, speed=SPEED, reach=1.05):
    """Contacts of every kind: rollers in both raceways or free, on both sides of their pockets; a cage on its land."""
    rng = np.random.default_rng(seed)
    start, unit = jc.models.rolling_start(model, speed), state_scale(model, speed)
    n = model.bearing.n_rollers
    rollers, bodies = np.array(start.rollers), np.array(start.bodies)
    rollers += np.asarray(unit.rollers) * rng.normal(size=(5, n)) * np.array([[1.0], [0.2], [1.0], [0.3], [0.05]])
    phi = rng.uniform(0, 2 * np.pi)
    c = float(model.clearance)
    bodies[5:9] += np.asarray(unit.bodies)[5:9] * rng.normal(size=4)
    centre = bodies[5:7] if model.guidance == "inner" else np.zeros(2)
    bodies[0:2] = centre + reach * c * np.array([np.cos(phi), np.sin(phi)])
    bodies[2:5] += np.asarray(unit.bodies)[2:5] * rng.normal(size=3) * np.array([0.3, 0.3, 0.1])
    return BearingState(jnp.asarray(rollers), jnp.asarray(bodies), jnp.asarray([rng.uniform(0, 6.0), 0.0]))


@jax.jit
def rates(at, state):
    return at(state).state


@pytest.mark.parametrize("kind", KINDS)
def test_right_side_at_random_states(kind):
    """Of either sense of rotation; each row against the largest of its entries."""
    model = jc.replace(jc.whole_bearing("nu2310"), **KINDS[kind])
    for seed, speed in enumerate((SPEED, SPEED, -SPEED, 0.3 * SPEED)):
        reach = (1.02, 0.6, 0.985, 0.3)[seed]
        state, theirs = random_state(model, seed, speed, reach), WholeBearing(model, speed)
        found = rates(model.at_speed(jnp.asarray(speed)), state)
        rollers, bodies = theirs.rates(float(state.clock[0]), np.asarray(state.rollers), np.asarray(state.bodies))
        size = np.abs(rollers).max(axis=1, keepdims=True)
        np.testing.assert_allclose(np.asarray(found.rollers) / size, rollers / size, rtol=0, atol=1e-10)
        for part in (slice(2, 4), slice(4, 5), slice(7, 9)):
            room = 1e-10 * max(np.abs(bodies[part]).max(), 1e-3)
            np.testing.assert_allclose(np.asarray(found.bodies)[part], bodies[part], rtol=0, atol=room)


def test_a_short_arc():
    """A thirtieth of a revolution from a cage near its land: integrated over time there, over the angle here."""
    model = jc.whole_bearing("nu2310")
    start = jc.models.rolling_start(model, SPEED, cage=1)
    run = jc.simulate_bearing(model, SPEED, revolutions=1, samples=32, tolerance=1e-9, start=start)
    theirs = WholeBearing(model, SPEED)
    end = theirs.arc(float(start.clock[0]), np.asarray(start.rollers), np.asarray(start.bodies), 2 * np.pi / 32)
    unit = state_scale(model, SPEED)
    np.testing.assert_allclose((run.rollers[1] - end[0]) / np.asarray(unit.rollers), 0, atol=1e-6)
    np.testing.assert_allclose((run.bodies[1] - end[1]) / np.asarray(unit.bodies), 0, atol=1e-6)
