"""Slow shafts with thick oil: explicit steps in machine code beside SciPy's implicit ones; energy."""

import numpy as np
import pytest
from reference import WholeBearing
from scipy.integrate import solve_ivp
from test_whole_motion import energy_and_momentum

import jaxcage as jc
from jaxcage.models import LEDGER, rolling_start, state_scale


SLOW, COLD = jc.rpm(1000), 273.15
"""Oil so thick that the film makes a cage at its land stiff [K]."""
TIMES = np.array([0.0, 2e-4])


@pytest.fixture(scope="module")
def stiff():
    """A slow shaft in cold oil, its cage near its land."""
    model = jc.replace(jc.whole_bearing("nu2310"), temperature=COLD)
    start = rolling_start(model, SLOW, cage=1)
    place = np.array([0.0, 0.97 * float(model.clearance)])
    return model, start._replace(bodies=start.bodies.at[:2].set(place))


@pytest.mark.wide
def test_a_stiff_arc(stiff):
    """Explicit steps reach the state that LSODA reaches on the second implementation, and what the shaft
    gives is lost or stored."""
    model, start = stiff
    run = jc.bearing_over_time(model, SLOW, TIMES, start=start, method=jc.native(1e-6))
    assert run.outcome == "successful"
    theirs, n = WholeBearing(model, SLOW), model.bearing.n_rollers
    scale, angle = np.asarray(state_scale(model, SLOW).row), float(start.clock[0])
    size = np.append(scale, 1.0)

    def rate(_, y):
        rollers, bodies = y[: 5 * n].reshape(n, 5).T, y[5 * n : -1]
        a, b = theirs.rates(y[-1], rollers, bodies)
        return np.concatenate([a.T.ravel(), b, bodies[4:5]])

    begin = np.append(start.row, angle) / size
    done = solve_ivp(lambda t, y: rate(t, y * size) / size, TIMES, begin, "LSODA", rtol=1e-8, atol=1e-9)
    end = np.append(run.state[-1], run.angle[-1]) / size
    assert np.max(np.abs(end - done.y[:, -1])) < 1e-4 < 1e-2 < np.max(np.abs(end - begin))
    gain = float(energy_and_momentum(model, run.last)[0] - energy_and_momentum(model, start)[0])
    lost = sum(run.total(name) for name in LEDGER[1:])
    assert abs(run.total("input") - lost - gain) < 1e-6 * abs(lost)


@pytest.mark.wide
def test_a_revolution_of_a_stiff_bearing(stiff):
    """Stability limits the explicit steps, not the error: the whole revolution is run, and its error is small."""
    model, start = stiff
    run = jc.simulate(model, SLOW, revolutions=1, start=start)
    assert run.outcome == "successful" and run.error < 1e-2 and np.all(np.isfinite(run.state))
