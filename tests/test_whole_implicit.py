"""Implicit steps of the whole bearing: the arrow against dense matrices, order, stiff arcs beside SciPy's."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference import WholeBearing
from scipy.integrate import solve_ivp
from test_whole_motion import energy_and_momentum
from test_whole_reference import KINDS, random_state

import jaxcage as jc
from jaxcage.integrate import Parts, arrow, factors
from jaxcage.models.whole import LEDGER, MEANS, BearingState, rolling_start, state_scale


SPEED, SLOW = jc.rpm(10000), jc.rpm(1000)
COLD = 273.15
"""Oil so thick that the film makes a cage at its land stiff [K]."""
INTEGRALS = len(LEDGER) + len(MEANS)


def flat_of(state):
    """A state without time, in one row."""
    return jnp.concatenate([state.rollers.ravel(), state.bodies, state.clock[:1]])


def state_of(row, n):
    return BearingState(row[: 5 * n].reshape(5, n), row[5 * n : -1], jnp.stack([row[-1], jnp.zeros(())]))


def parts_of(row, n):
    return Parts(row[: 5 * n].reshape(5, n).T, row[5 * n :])


@pytest.mark.wide
@pytest.mark.parametrize(("kind", "over_angle"), [(k, o) for k in KINDS for o in (True, False)])
def test_arrow_is_the_dense_jacobian(kind, over_angle):
    """Its products and solutions against a matrix made of all directional derivatives, for either variable."""
    model = jc.replace(jc.whole_bearing("nu2310"), **KINDS[kind])
    n, at = model.bearing.n_rollers, model.at_speed(jnp.asarray(SPEED))
    state = random_state(WholeBearing(model, SPEED), 2, 0.985)
    scale = state_scale(model, SPEED)
    size = np.concatenate([np.broadcast_to(scale.rollers, (5, n)).ravel(), scale.bodies, [1.0]])

    def rates(row):
        found = at(state_of(row, n))
        pace = 1 / jnp.abs(found.state.clock[0]) if over_angle else 1.0
        beside = jnp.append(found.state.clock[1:], found.integrals)
        return pace * flat_of(found.state), pace * beside

    dense, beside = jax.jit(jax.jacfwd(rates))(flat_of(state))
    blocks = jax.jit(arrow, static_argnums=2)(at, parts_of(flat_of(state), n), over_angle)
    shift = 1e5
    rng = np.random.default_rng(0)
    u = jnp.asarray(rng.normal(size=size.size) * size)
    np.testing.assert_allclose(
        blocks.beside(parts_of(u, n)), beside @ u, rtol=1e-9, atol=1e-9 * np.abs(beside @ u).max()
    )
    got = factors(blocks, shift).solve(parts_of(u, n))
    got = np.concatenate([np.asarray(got.rollers).T.ravel(), got.bodies]) / size
    want = np.linalg.solve(shift * np.eye(size.size) - size[:, None] ** -1 * np.asarray(dense) * size, u / size)
    np.testing.assert_allclose(got, want, rtol=0, atol=1e-9 * np.abs(want).max())


@pytest.fixture(scope="module")
def stiff():
    """A slow shaft in cold oil, its cage near its land."""
    model = jc.replace(jc.whole_bearing("nu2310"), temperature=COLD)
    start = rolling_start(model, SLOW, cage=1)
    place = np.array([0.0, 0.97 * float(model.clearance)])
    return model, start._replace(bodies=start.bodies.at[:2].set(place))


@pytest.mark.wide
def test_a_stiff_arc(stiff):
    """Implicit steps reach what explicit ones and SciPy's LSODA on the second implementation do, in far fewer."""
    model, start = stiff
    times = np.array([0.0, 2e-4])
    runs = [jc.bearing_over_time(model, SLOW, times, start=start, implicit=i, tolerance=1e-6) for i in (True, False)]
    few, many = runs
    assert few.implicit_share == 1 and many.implicit_share == 0 and few.steps < many.steps / 2
    assert all(run.outcome == "successful" for run in runs)
    theirs = WholeBearing(model, SLOW)
    n = model.bearing.n_rollers

    def rate(_, y):
        a, b = theirs.rates(y[-1], y[: 5 * n].reshape(5, n), y[5 * n : -1])
        return np.concatenate([a.ravel(), b, y[5 * n + 4 : 5 * n + 5]])

    scale = state_scale(model, SLOW)
    size = np.concatenate([np.broadcast_to(scale.rollers, (5, n)).ravel(), scale.bodies, [1.0]])
    begin = np.asarray(flat_of(start))
    done = solve_ivp(lambda t, y: rate(t, y * size) / size, times, begin / size, "LSODA", rtol=1e-8, atol=1e-9)
    for run in runs:
        end = np.concatenate([run.rollers[-1].ravel(), run.bodies[-1], run.angle[-1:]]) / size
        assert np.max(np.abs(end - done.y[:, -1])) < 1e-4 < 1e-2 < np.max(np.abs(end - begin / size))


@pytest.mark.wide
def test_energy_of_implicit_steps(stiff):
    """What the shaft gives is lost or stored, to 1e-8 of what is lost."""
    model, start = stiff
    run = jc.bearing_over_time(model, SLOW, np.array([0.0, 2e-4]), start=start, implicit=True, tolerance=1e-8)
    gain = float(energy_and_momentum(model, run.last)[0] - energy_and_momentum(model, start)[0])
    lost = sum(run.total(name) for name in LEDGER[1:])
    assert run.outcome == "successful"
    assert abs(run.total("input") - lost - gain) < 1e-8 * abs(lost)
