"""A slow shaft in thick oil: implicit and explicit steps beside SciPy's on the second implementation; energy."""

import jax.numpy as jnp
import numpy as np
import pytest
from reference import WholeBearing
from scipy.integrate import solve_ivp
from test_whole_motion import energy_and_momentum

import jaxcage as jc
from jaxcage.models.whole import LEDGER, rolling_start, state_scale


SLOW, COLD = jc.rpm(1000), 273.15
"""Oil so thick that the film makes a cage at its land stiff [K]."""


def flat_of(state):
    """A state without time, in one row."""
    return jnp.concatenate([state.rollers.ravel(), state.bodies, state.clock[:1]])


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
