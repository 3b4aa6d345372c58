"""Nothing is missed: planted points are found, and a branch stays on its own side of one that runs close by."""

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but

import jaxcage as jc
from benchmarks.missed import followed, judged
from benchmarks.missed_models import comb, crossing, imperfect, planted
from jaxcage.orbits._located import dips


BENT = next(given for given in planted() if "bent" in given.name)


@pytest.mark.parametrize("apart", [1e-2, 1e-3, 1e-4])
def test_branch_does_not_jump_to_its_copies(apart):
    """Copies of one curve, every other stable, closer to each other than a prediction is to its point."""
    given = comb(apart)
    branch = followed(given, jc.orbits.Steps())
    assert branch.special == () and np.all(branch.stable) and branch.ended == ("range", "range")
    np.testing.assert_allclose(branch.state[:, 0] - 1 - np.tanh(20 * branch.value) / 2, 0.0, atol=1e-7)


NEAR = {
    "lines that cross": crossing(0.0, 1),
    "lines that pass": crossing(1e-3, 1),
    "lines that turn sharply": crossing(1e-4, -1),
    "what is left of a pitchfork, passing": imperfect(1e-4, 1),
    "what is left of a pitchfork, turning": imperfect(1e-4, -1),
    "pitchfork along the side that turns": BENT,
}


@pytest.mark.parametrize(
    "name", wide_but(NEAR, "lines that cross", "lines that pass", "pitchfork along the side that turns")
)
def test_branches_that_cross_and_branches_that_nearly_do(name):
    branch = followed(NEAR[name], jc.orbits.Steps())
    row = judged(NEAR[name], branch, branch)
    assert not row.bad, row
    assert branch.ended == ("range", "range") and branch.value.size < 100


@pytest.mark.wide
def test_search_meets_what_only_the_opposite_start_leads_to():
    """Two wells, and starts in one of them: the orbits of both are found, and the counts are those of the starts."""

    def well(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.5 * u + x - x**3 + 0.05 * jnp.cos(tau),)

    system = jc.ForcedOscillator(well, coordinates=1, starts=((1.1, 0.1),))
    found = jc.synchronous_orbits(system, 0.5, 0.6, count=3, discard=20, method=jc.method("rk4", steps=128))
    assert {float(np.sign(b.state[0, 0])) for b in found.branches} == {-1.0, 1.0} and found.missed == 0
    assert sorted(s.met for s in found.stretches) == [0, 3]


DIPS = {
    "nearly vanishes": ([0.802, 0.0327, 0.516], [0.140, 0.096], {(0, 1), (1, 2)}),
    "does not": ([0.802, 0.2, 0.516], [0.140, 0.096], set()),
    "twice in the first step": ([0.1185, 0.1414, 0.5309, 0.8128], [0.378, 0.210, 0.117], {(0, 1)}),
    "twice in a long last step": ([0.30397864, 0.09297943, 0.42741154, 0.69109067], [425.0, 242.2, 134.7], {(0, 1)}),
}
"""Products of mu + 1 along branches of 2a and 1a, where the period doubles and comes back, and lengths of the steps."""


@pytest.mark.parametrize("name", DIPS)
def test_a_test_function_that_may_vanish_twice_is_looked_at(name):
    f, length, looked_at = DIPS[name]
    for sign in (1.0, -1.0):
        found = set(dips(sign * np.array([f]), np.array(length)))
        assert found >= looked_at and bool(found) == bool(looked_at)


def test_orbits_of_many_starts_are_told_apart():
    """Three between the folds of the hardening Duffing oscillator, all of period 1: none that closes after two
    revolutions only."""
    swing = lambda tau, q, v, speed: (-0.1 * v[0] - q[0] - q[0] ** 3 + 0.3 * jnp.cos(tau),)
    hardening = jc.ForcedOscillator(swing, coordinates=1, starts=((0.1, 0.2), (2.0, 1.0), (-1.5, 2.0)))
    find = lambda *given, **more: jc.orbits.coexisting_orbits(*given, **more, method=jc.method("rk4", steps=128))
    orbits = find(hardening, 1.5, count=24, revolutions=3)
    assert [o.stable for o in orbits] == [True, True, False]
    sizes = [np.hypot(o.state[0], o.state[1] / 1.5) for o in orbits]
    assert sizes[0] != pytest.approx(sizes[1], rel=0.5) and min(sizes[:2]) < sizes[2] < max(sizes[:2])
    assert find(hardening, 1.5, 2, count=24, revolutions=3) == []
