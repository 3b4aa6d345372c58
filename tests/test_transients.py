"""Mean lives of transients against escape rates that are known exactly or computed in another way."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from helpers import raw_sweep

import jaxcage as jc
from jaxcage.analysis import (
    Survival,
    calm_at_the_end,
    calm_threshold,
    escape_times,
    failed,
    survival,
)


SEEDS = 100
"""Seeds 0 to 99: about 95 of them should recover the mean life within two standard errors."""


# Maps with a known escape rate. Each gives the number of the first iterate outside, infinity for none.


def iterate(step, x, horizon, rng):
    times = np.full(x.shape, np.inf)
    for n in range(1, horizon + 1):
        x, outside = step(x, rng)
        times[outside & np.isinf(times)] = n
    return times


def tent(slope):
    """Steeper than 2 it throws a share 1 - 2/slope of the unit interval out in each step: kappa = log(slope/2)."""

    def step(x, rng):
        x = slope * np.minimum(x, 1 - x)
        return x, (x < 0) | (x > 1)

    return step


def logistic(mu):
    def step(x, rng):
        x = mu * x * (1 - x)
        return np.where(x < 0, -1.0, x), (x < 0) | (x > 1)

    return step


PRINTED = 0.3615096698
"""P. Cvitanovic and others, Chaos: Classical and Quantum (ChaosBook.org), escape rate of x -> 9/2 x (1 - x)."""
MAPS = {
    "tent 2.05": (tent(2.05), np.log(2.05 / 2), 0, 200, 120),
    "tent 3": (tent(3.0), np.log(3 / 2), 0, 30, 120),
    "logistic 4.5": (logistic(4.5), PRINTED, 5, 40, 800),
}
"""Step, escape rate per iterate, t0, horizon and lanes: about 100 escapes after t0 or more."""


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("block", [1, 5])
def test_mean_life_of_maps(name, block):
    """1/kappa within two standard errors for 90 of 100 seeds at least, seen at each iterate or each fifth."""
    step, rate, t0, horizon, lanes = MAPS[name]
    within = covered = 0
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        times = iterate(step, rng.random(lanes), horizon, rng)
        found = survival(np.ceil(times / block) * block, horizon, t0=t0, block=block)
        assert found.kind == "transient" and found.escapes >= 10
        within += abs(found.mean_life - 1 / rate) < 2 * found.standard_error
        low, high = found.interval
        covered += low <= 1 / rate <= high
    assert within >= 90 and covered >= 90


@pytest.mark.parametrize("block", [0, 10, 60])
def test_estimate_maximises_the_likelihood(block):
    """Against a search over the likelihood as it is written down, and its curvature."""
    rng = np.random.default_rng(3)
    times = rng.exponential(80.0, 40)
    times = np.ceil(times / block) * block if block else times
    found = survival(times, 120, block=block)
    escaped = times <= 120
    rates = np.linspace(0.5, 1.5, 20001) * found.rate
    if block:
        each = np.log(np.exp(-rates * (times[escaped, None] - block)) - np.exp(-rates * times[escaped, None]))
    else:
        each = np.log(rates) - rates * times[escaped, None]
    likelihood = np.sum(each, axis=0) - rates * 120 * np.sum(~escaped)
    assert rates[np.argmax(likelihood)] == pytest.approx(found.rate, rel=1e-4)
    middle, h = 10000, (rates[1] - rates[0]) * 100
    curvature = (likelihood[middle + 100] - 2 * likelihood[middle] + likelihood[middle - 100]) / h**2
    assert found.standard_error / found.mean_life == pytest.approx((-curvature) ** -0.5 / found.rate, rel=1e-3)


@pytest.mark.parametrize("n", [1, 4, 9, 25])
def test_interval_is_garwoods(n):
    """Quantiles of chi squared, as the paper tabulates them; blocks come to the same when they are short."""
    times = np.concatenate([np.full(n, 50.0), np.full(60, np.inf)])
    exposure = 50.0 * n + 60 * 1000
    low = 2 * exposure / scipy.stats.chi2.ppf(0.975, 2 * n + 2)
    high = 2 * exposure / scipy.stats.chi2.ppf(0.025, 2 * n)
    assert survival(times, 1000).interval == pytest.approx((low, high))
    assert survival(times, 1000, block=0.5).interval == pytest.approx((low, high), rel=2e-3)
    bound = 2 * exposure / scipy.stats.chi2.ppf(0.95, 2 * n + 2)
    assert survival(times, 1000).lower_bound == pytest.approx(bound)


# From growth in blocks to escape times.

BLOCK, BLOCKS = 25, 80


def weak_chaos(rng, times):
    """Exponent 0.15 +- 0.1 a block up to the escape, mixed with the growth on an orbit in the block of the escape."""
    start = np.arange(BLOCKS) * BLOCK
    chaotic = np.clip((times[:, None] - start) / BLOCK, 0, 1)
    return chaotic * rng.normal(0.15, 0.1, (times.size, BLOCKS)) + (1 - chaotic) * -0.3


def test_mean_life_from_weak_chaos_that_dips_below_zero():
    """One block in four of the chaotic ones looks calm; the label of the end and the confirmation decide."""
    within = 0
    lasting = weak_chaos(np.random.default_rng(0), np.full(100, np.inf))
    assert 0.2 < np.mean(lasting < calm_threshold(BLOCK)) < 0.3
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        times = rng.exponential(500.0, 100)
        growth = weak_chaos(rng, times)
        nowhere = np.cumsum(np.ones((100, 64, 2)), axis=1)  # strobe states that never return
        calm_end = calm_at_the_end(nowhere, np.ones(2), growth, BLOCK)
        found, horizon = escape_times(growth, calm_end, BLOCK)
        assert horizon == (BLOCKS - 8) * BLOCK
        # No lane that stays chaotic passes for calm, and none that is calm at the horizon passes for chaotic.
        assert np.all(np.isinf(found[times > BLOCK * BLOCKS]))
        assert np.all(np.isfinite(found[times < horizon]))
        estimate = survival(found, horizon, t0=100, block=BLOCK)
        within += abs(estimate.mean_life - 500) < 2 * estimate.standard_error
    assert within >= 90


# The crisis of Ueda's oscillator.


class Ueda(eqx.Module):
    """x'' + 0.1 x' + x^3 = force cos t."""

    force: jax.Array

    def __call__(self, tau, q, v, speed):
        del speed
        (x,), (u,) = q, v
        return (-0.1 * u - x**3 + self.force * jnp.cos(tau),)


CRISIS = 13.388
BEYOND = (13.391, 13.4, 13.42, 13.45, 13.5)


def ueda(force):
    return jc.ForcedOscillator(Ueda(jnp.array(force)), coordinates=1)


def lives(forces, initial_states, steps, revolutions) -> list[Survival]:
    """A `Survival` for each force; t0 is 50 revolutions."""
    method = jc.method("rk4", steps=steps)
    length = dict(discard=0, revolutions=revolutions, blocks=revolutions // BLOCK)
    found = []
    swept = raw_sweep([ueda(f) for f in forces], 1.0, initial_states=initial_states, method=method, **length).isel(
        speed=0
    )
    for i in range(len(forces)):
        s = swept.isel(design=i)
        growth = s["block_growth"].values[..., 0]
        calm_end = calm_at_the_end(s["strobe"].values, s["scale"].values, growth, BLOCK)
        times, horizon = escape_times(growth, calm_end, BLOCK, failed=failed(s))
        found.append(survival(times, horizon, t0=50, block=BLOCK))
    return found


@pytest.fixture(scope="module")
def chaotic_starts():
    """States on the chaotic attractor before the crisis; elsewhere lanes end on a periodic orbit beside it."""
    initial_states = [tuple(map(float, s)) for s in np.random.default_rng(1).uniform((-2, -4), (4, 8), (260, 2))]
    length = dict(discard=60, revolutions=60, blocks=6, method=jc.method("rk4", steps=128))
    s = raw_sweep(ueda(13.3), 1.0, initial_states=initial_states, **length)
    # By so few steps the error of a chaotic exponent may be large: such a lane is undecided.
    label = s["label"].values[0]
    share = {name: float(np.mean(label == name)) for name in ("chaotic", "periodic-1", "undecided")}
    assert sum(share.values()) == pytest.approx(1.0) and 0.3 < share["chaotic"] < 0.6 and share["undecided"] < 0.02
    return [tuple(map(float, y)) for y in s["last"].values[0][label == "chaotic"][:80]]


@pytest.mark.wide
def test_crisis_of_uedas_oscillator(chaotic_starts):
    """The chaotic attractor ends at a force of 13.388: J. M. T. Thompson and H. B. Stewart, Nonlinear Dynamics and
    Chaos (Wiley).

    Beyond it the mean life falls as a power of the distance, with an exponent 1/2 + log |a| / |log |b|| where the
    unstable manifold of an orbit with multipliers a and b touches the basin's boundary (C. Grebogi, E. Ott,
    F. Romeiras and J. A. Yorke, Phys. Rev. A 36 (1987) 5365): 1.22 with the orbit of period 1 in the attractor. The
    mean lives lie on steps about that power, so that 550 lanes at nine forces gave 1.24 +- 0.02 by their own errors,
    but 1.08 to 1.41 by parts of the range and +- 0.0005 in the force of the crisis.
    """
    orbit = jc.periodic_orbit(ueda(CRISIS), 1.0, guess=(3.55, -0.52))
    assert orbit.status == "converged"
    grown, shrunk = np.log(np.abs(np.asarray(orbit.multipliers)))
    expected = 0.5 + grown / -shrunk
    assert expected == pytest.approx(1.22, abs=0.005)

    before, *beyond = lives((13.387, *BEYOND), chaotic_starts, 512, 1500)
    assert (before.kind, before.chaotic) == ("chaotic", 80)
    assert all(s.kind == "transient" and s.escapes >= 10 for s in beyond)
    tau = np.array([s.mean_life for s in beyond])
    assert np.all(np.diff(tau) < 0) and before.lower_bound > 3 * tau[0]
    fit = np.polyfit(np.log(np.array(BEYOND) - CRISIS), np.log(tau), 1)
    assert -fit[0] == pytest.approx(expected, abs=0.2)
