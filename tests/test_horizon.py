"""Chaos that ends by a clock: when lanes are said to leave it, against when they do."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc


RATE = 0.01
"""By which the clock decays in a revolution."""
TURN = 2.0 * np.pi * (np.sqrt(5.0) - 1.0)
"""Angle by which the second oscillator goes on in a revolution, incommensurate with it."""
LENGTH: dict[str, Any] = dict(
    starts=None, discard=30, revolutions=60, blocks=6, method=jc.method("rk4", steps=128), confirm=False
)


def ueda_until(tau, y, speed):
    """Ueda's oscillator, chaotic until its clock has come down to 1 and heavily damped from then on, beside an
    oscillator that turns by an irrational part of a revolution, or rests."""
    del speed
    x, u, clock, p, q = y
    damping = 0.05 + 3.0 * jax.nn.sigmoid((1.0 - clock) / (0.2 * RATE))
    turn = TURN / (2 * jnp.pi)
    return u, -damping * u - x**3 + 7.5 * jnp.cos(tau), -RATE / (2 * jnp.pi) * clock, -turn * q, turn * p


def lanes_that_end_after(revolutions: np.ndarray, turning: bool) -> jc.Sweep:
    """A lane for each, in which chaos ends after so many revolutions; its end never closes if the other one turns."""
    starts = [(0.1 + 0.01 * i, 0.2, float(np.exp(RATE * n)), float(turning), 0.0) for i, n in enumerate(revolutions)]
    system = jc.ForcedSystem(ueda_until, dimension=5)
    return jc.sweep(system, np.array([1.0]), **LENGTH | dict(starts=starts), horizon=1200)


@pytest.mark.parametrize("turning", [False, True], ids=["periodic", "quasi-periodic"])
def test_lanes_leave_chaos_when_its_clock_says_so(turning):
    """Within the observed part, in every part of a stage, long before they close, and not before the horizon."""
    ends = np.array([*range(100, 1000, 47), 2000, 5000])
    found = lanes_that_end_after(ends, turning)
    assert np.all(found.observed_label[0, ends > 120] == "chaotic")
    assert found.escape is not None
    escape, leaves = found.escape[0], ends < found.horizon
    assert np.array_equal(np.isfinite(escape), leaves)
    late = escape[leaves] - ends[leaves]
    assert np.all((late > -30) & (late <= 60)), late
    assert np.all(np.char.startswith(found.label[0][leaves & (ends > 120)], "transient"))


@pytest.mark.parametrize("horizon, followed", [(100, 270), (600, 750)])
def test_kept_states_are_the_last_ones_where_little_is_followed(horizon, followed):
    """A lightly damped linear oscillator that is still on its way at the end, beside a run of the same length: of the
    60 states kept the last 30 are of a stage of one block, or none is of those seen before."""
    light = jc.ForcedOscillator(lambda tau, q, v, speed: (-0.005 * v[0] - q[0] + jnp.cos(tau),), coordinates=1)
    options: dict[str, Any] = LENGTH | dict(starts=[(1e6, 0.0)], keep=60)
    found = jc.sweep(light, np.array([0.8]), **options, horizon=horizon)
    whole = jc.sweep(light, np.array([0.8]), **options | dict(discard=30 + followed), horizon=0)
    assert found.label[0, 0] == whole.label[0, 0] == "undecided"
    assert np.allclose(found.strobe, whole.strobe, rtol=1e-9)
    assert np.array_equal(found.strobe[0, 0, -1], found.last[0, 0])
