"""The whole bearing against its second implementation: right side at random states, and a short arc."""

import shutil

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but
from reference import WholeBearing

import jaxcage as jc
from benchmarks import bearing_speed
from jaxcage.models import BearingState, state_scale


SPEED = jc.rpm(10000)
RICH = {
    "pockets.pocket_law": "power",
    "drag_coefficient": 1.2,
    "churning_coefficient": 0.6,
    "rest": 0.005,
    "viscosity_exponent": 0.8,
    "temperature": 330.0,
    "drag.drag_law": "cylinder",
    "drag.rolling_law": "bath",
    "outer_speed": 40.0,
    "eccentricity": 1e-4,
}
KINDS = {
    "plain": {},
    "inner": RICH | {"guidance": "inner", "outer_speed": 500.0, "eccentricity": 2e-4},
    "outer": RICH,
    "full": {"film.model": "full", "cage_rotation": "held", "pockets.pocket_law": "power"},
}


def random_state(theirs, seed, reach):
    """Contacts of every kind: rollers in both raceways or free, on both sides of their pockets; a cage on its land."""
    rng, n = np.random.default_rng(seed), theirs.n
    turning = 0.4 * theirs.speed
    ring = 1e-6 * rng.normal(size=2) + np.array([0.0, -25e-6])
    rollers = np.stack(
        [
            4e-3 * rng.normal(size=n),
            -2 * theirs.speed * (1 + 0.2 * rng.normal(size=n)),
            theirs.r_o - theirs.half + 3e-6 * rng.normal(size=n),
            0.1 * rng.normal(size=n),
            turning * (1 + 0.05 * rng.normal(size=n)),
        ]
    )
    phi = rng.uniform(0, 2 * np.pi)
    place = reach * theirs.c * np.array([np.cos(phi), np.sin(phi)]) + (ring if theirs.inner_guided else 0.0)
    bodies = np.array([*place, *(0.03 * rng.normal(size=2)), 1.03 * turning, *ring, *(0.05 * rng.normal(size=2))])
    return BearingState(jnp.asarray(rollers), jnp.asarray(bodies), jnp.asarray([rng.uniform(0, 6.0), 0.0]))


@eqx.filter_jit
def everything(model, speed, state):
    """All forces and all rates: one program for the tests of a right side."""
    at = model.at_speed(speed)
    return at.forces(state), at.rates(state)


def right_side(model, speed, state):
    return everything(model, speed, state)[1].state


@pytest.mark.parametrize("kind", wide_but(KINDS, "plain"))
def test_right_side_at_random_states(kind):
    """Rates of either sense of rotation; each row against the largest of its entries."""
    model = jc.replace(jc.whole_bearing("nu2310"), **KINDS[kind])
    for seed, speed in enumerate((SPEED, SPEED, -SPEED, 0.3 * SPEED)):
        reach = (1.02, 0.6, 0.985, 0.3)[seed]
        theirs = WholeBearing(model, speed)
        state = random_state(theirs, seed, reach)
        found = right_side(model, jnp.asarray(speed), state)
        rollers, bodies = theirs.rates(float(state.clock[0]), np.asarray(state.rollers), np.asarray(state.bodies))
        size = np.abs(rollers).max(axis=1, keepdims=True)
        np.testing.assert_allclose(np.asarray(found.rollers) / size, rollers / size, rtol=0, atol=1e-10)
        for part in (slice(2, 4), slice(4, 5), slice(7, 9)):
            room = 1e-10 * max(np.abs(bodies[part]).max(), 1e-3)
            np.testing.assert_allclose(np.asarray(found.bodies)[part], bodies[part], rtol=0, atol=room)


@pytest.mark.wide
def test_a_short_arc():
    """A thirtieth of a revolution from a cage near its land: integrated over time there, over the angle here."""
    model = jc.whole_bearing("nu2310")
    start = jc.models.rolling_start(model, SPEED, cage=1)
    run = jc.simulate(model, SPEED, revolutions=1, samples=32, start=start, method=jc.native(1e-9, 1e-2))
    theirs = WholeBearing(model, SPEED)
    end = theirs.arc(float(start.clock[0]), np.asarray(start.rollers), np.asarray(start.bodies), 2 * np.pi / 32)
    unit = state_scale(model, SPEED)
    np.testing.assert_allclose((run.rollers[1] - end[0]) / np.asarray(unit.rollers), 0, atol=1e-6)
    np.testing.assert_allclose((run.bodies[1] - end[1]) / np.asarray(unit.bodies), 0, atol=1e-6)


@pytest.mark.wide
@pytest.mark.skipif(not shutil.which("cc"), reason="no compiler")
def test_the_benchmark_in_c_solves_the_same_equations():
    """From a state with contacts of all kinds, the land too, by many short steps against SciPy's."""
    theirs, span = WholeBearing(jc.whole_bearing("nu2310"), float(SPEED)), 2e-3
    turned = bearing_speed.compiled()
    for reach in (0.6, 1.0):
        state = random_state(theirs, 3, reach)
        begin = bearing_speed.flat(np.asarray(state.rollers), np.asarray(state.bodies))
        angle = float(state.clock[0])
        found = turned(bearing_speed.law(theirs)[None], np.array([angle]), begin[None], span, 4000)[0]
        expected = bearing_speed.flat(*theirs.arc(angle, np.asarray(state.rollers), np.asarray(state.bodies), span))
        scale = state_scale(jc.whole_bearing("nu2310"), SPEED)
        size = bearing_speed.flat(np.asarray(scale.rollers), np.asarray(scale.bodies))
        assert np.max(np.abs(found - expected) / size) < 1e-6 < 1e-2 < np.max(np.abs(found - begin) / size)
