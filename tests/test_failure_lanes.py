"""A lane driven to failure is NaN in its own place and leaves every other lane untouched.

Every sweep here has six lanes and one plan where it can, so that one compiled program serves them.
"""

import time

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but

from jaxcage.analysis import Plan
from jaxcage.models import ForcedOscillator, case
from jaxcage.solve import OUTCOMES, Lanes, method
from jaxcage.sweeps import run_lanes, sweep


MODEL = case("1a", "preliminary")
RPM = np.pi / 30
C = 0.45e-3
HEALTHY = (0.4 * C, 0.3 * C, 0.0, 0.0)
OTHER = (0.0, -0.5 * C, 0.0, 0.0)
THIRD = (0.1 * C, -0.2 * C, 0.0, 0.1)
METHOD = method("rk4", steps=256)
SETTINGS = dict(discard=12, revolutions=16, blocks=4, keep=8, confirm=False, horizon=0, method=METHOD)
SPEEDS = RPM * np.array([9000.0, 15000.0])
FIELDS = "strobe", "last", "block_growth", "peak", "outcome"


def assert_same_bytes(first, second, keep):
    for field in FIELDS:
        here, there = (np.ascontiguousarray(getattr(r, field)[keep]) for r in (first, second))
        assert here.tobytes() == there.tobytes(), field


def assert_failed(result, lane):
    assert 0 < result.outcome[lane] < len(OUTCOMES)
    assert result.label[lane] == "failed"
    assert np.all(np.isnan(result.last[lane])) and np.all(np.isnan(result.strobe[lane]))
    assert np.all(np.isnan(result.exponents[lane]))


BAD_STARTS = {
    "outside": ((1.5 * C, 0.0, 0.0, 0.0), "outside"),
    "far outside": ((0.0, -400.0 * C, 0.0, 0.0), "outside"),
    "not a number": ((float("nan"), 0.0, 0.0, 0.0), "not_finite"),
    "no velocity": ((0.0, 0.0, float("nan"), 0.0), "not_finite"),
    "infinite": ((0.0, 0.0, float("inf"), 0.0), "not_finite"),
    "absurdly fast": ((0.0, 0.0, 1e200, 0.0), None),
}


@pytest.mark.parametrize("confirm", wide_but([False, True], False))
@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("bad", BAD_STARTS)
def test_bad_start_fails_alone(bad, place, confirm):
    start, outcome = BAD_STARTS[bad]
    states = [HEALTHY, OTHER, THIRD]
    settings = SETTINGS | (dict(confirm=True, horizon=3000) if confirm else {})
    healthy = sweep(MODEL, SPEEDS, starts=states, **settings)
    assert not np.any(healthy.failed)
    states[place] = start
    mixed = sweep(MODEL, SPEEDS, starts=states, **settings)
    others = np.s_[:, [i for i in range(3) if i != place]]
    assert_same_bytes(mixed, healthy, others)
    np.testing.assert_array_equal(mixed.label[others], healthy.label[others])
    for k in range(SPEEDS.size):
        assert_failed(mixed, (k, place))
        if outcome is not None:
            assert OUTCOMES[mixed.outcome[k, place]] == outcome
    # Shares are of the starts that finished.
    share = np.sum(healthy.label[others] == "chaotic", axis=1) / 2
    np.testing.assert_array_equal(mixed.chaotic_share, share)


@pytest.mark.parametrize("place", [0, 3])
def test_absurd_speed_fails_alone(place):
    """1e9 rpm anywhere among speeds of the paper, at the engine, which takes lanes in any order."""
    plan = Plan(discard=12, block=4, blocks=4, keep=8, exponents=1)
    speeds = RPM * np.array([9000.0, 12000.0, 15000.0, 18000.0, 20000.0, 24000.0])
    states = np.broadcast_to(OTHER, (6, 4)).copy()
    healthy = run_lanes(Lanes.of([MODEL], speeds), METHOD, plan, states)
    absurd = speeds.copy()
    absurd[place] = 1e9 * RPM
    mixed = run_lanes(Lanes.of([MODEL], absurd), METHOD, plan, states)
    others = [i for i in range(6) if i != place]
    for now, then in zip(mixed, healthy, strict=True):
        kept = np.ascontiguousarray(now[..., others]), np.ascontiguousarray(then[..., others])
        assert kept[0].tobytes() == kept[1].tobytes()
    assert np.all(healthy.outcome == 0)
    assert mixed.outcome[place] != 0
    assert np.all(np.isnan(mixed.last[:, place])) and np.all(np.isnan(mixed.growth[..., place]))


def test_absurd_speed_in_a_sweep():
    with pytest.raises(ValueError, match="`speeds` must be in rad/s, at most"):
        sweep(MODEL, np.append(SPEEDS, 1e9 * RPM), starts=[OTHER, HEALTHY], **SETTINGS)


@pytest.mark.wide
def test_lanes_without_damping_leave_the_model():
    """No damping, a coupling that pumps and a weak contact: whirl grows until it is outside."""
    where = lambda m: (
        m.support.damping,
        m.support.cross_stiffness,
        m.support.cubic_stiffness,
        m.contact.stiffness,
        m.film.land_width,
    )
    values = tuple(jnp.asarray(v) for v in (0.0, 8e5, 0.0, 1e4, 1e-4))
    model = eqx.tree_at(where, MODEL, values)
    result = sweep(model, SPEEDS, starts=[HEALTHY, OTHER, THIRD], **SETTINGS)
    assert np.all(result.failed) and np.all(result.label == "failed")
    codes = {OUTCOMES[code] for code in result.outcome.ravel()}
    assert codes <= {"outside", "not_finite"}
    assert np.all(np.isnan(result.last)) and np.all(np.isnan(result.exponents))
    assert np.all(np.isnan(result.chaotic_share))


def pendulum(tau, q, v, speed):
    return (-0.2 * v[0] - jnp.sin(q[0]) + 0.4 * jnp.cos(tau),)


@pytest.mark.wide
def test_bad_start_fails_alone_with_adaptive_steps():
    settings = dict(discard=1, revolutions=2, blocks=2, keep=2, confirm=False, horizon=0)
    settings |= dict(method=method("rodas3", tolerance=1e-5))
    system = ForcedOscillator(pendulum, coordinates=1)
    good, other, bad = (0.1, 0.2), (0.5, 0.0), (float("nan"), 0.0)

    def timed(first):
        before = time.perf_counter()
        result = sweep(system, np.array([1.1]), starts=[first, good], **settings)
        return result, time.perf_counter() - before

    timed(other)  # compiles
    (healthy, alone), (mixed, together) = timed(other), timed(bad)
    assert_same_bytes(mixed, healthy, np.s_[:, 1])
    assert_failed(mixed, (0, 0))
    # A failed lane must not go on to the largest number of steps in every revolution.
    assert together < 20 * alone + 0.5


def test_summary_counts_failures_apart():
    outside = (1.5 * C, 0.0, 0.0, 0.0)
    text = str(sweep(MODEL, SPEEDS, starts=[HEALTHY, OTHER, outside], **SETTINGS))
    assert "2 failed" in text and "2 lanes failed: outside" in text


def test_a_lane_goes_on_from_beyond_the_clearance_circle_where_none_may_start():
    """A soft land lets a cage pass eps = 1 on its way: no start, but no failure where another run has left it."""
    outside = np.array([[1.005 * C, 0.0, 0.0, 0.0]])
    lanes, plan = Lanes.of([MODEL], SPEEDS[:1]), Plan(0, 2, 1, 1, 1)
    ends = [run_lanes(lanes, METHOD, plan, outside, onward=on) for on in (False, True)]
    assert [OUTCOMES[int(end.outcome[0])] for end in ends] == ["outside", "successful"]
    assert np.all(np.isfinite(ends[1].last)) and ends[1].peak[0] >= 1.005
