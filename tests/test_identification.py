"""Constants found from edges: planted ones come back with honest intervals, and what cannot be known is called so.

A double-well oscillator m x'' + d x' - k x + b x^3 = s g cos(w t) loses its small orbit by period doubling, at a speed
that depends on the forcing g, which differs from case to case. Its five constants have two symmetries: the equation
multiplied by a number, and x in another unit. Edges can therefore fix three combinations of them, not five constants.
"""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import raw_sweep

import jaxcage as jc
from jaxcage.analysis import Edge, Zone
from jaxcage.design import determined, inside_zones, matched
from jaxcage.forces import parameter


METHOD = jc.method("rk4", steps=64)
TRUTH = {"mass": 1.0, "damping": 0.3, "stiffness": 1.0, "cubic": 1.0, "gain": 1.0}
FORCING = (0.24, 0.25, 0.262, 0.275, 0.29, 0.305)
BOUNDS = [jc.design.Unknown(name, value / 4, value * 4) for name, value in TRUTH.items()]


class DoubleWell(eqx.Module):
    mass: float = parameter("kg", 0.0, 1e3, "m")
    damping: float = parameter("N s/m", 0.0, 1e3, "d")
    stiffness: float = parameter("N/m", 0.0, 1e3, "k")
    cubic: float = parameter("N/m^3", 0.0, 1e3, "b")
    gain: float = parameter("1", 0.0, 1e3, "s")
    forcing: float = parameter("N", 0.0, 1e3, "g")

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        push = self.gain * self.forcing * jnp.cos(tau)
        return ((push - self.damping * u + self.stiffness * x - self.cubic * x**3) / self.mass,)


def cases():
    made = {f"g={g}": jc.ForcedOscillator(DoubleWell(**TRUTH, forcing=g), coordinates=1) for g in FORCING}
    return made


FOLD = {0.24: (1.0433, (-0.632, 0.116)), 0.25: (1.0298, (-0.627, 0.109)), 0.262: (1.0139, (-0.622, 0.103))}
FOLD |= {0.275: (0.9973, (-0.617, 0.097)), 0.29: (0.9787, (-0.613, 0.091)), 0.305: (0.9606, (-0.609, 0.086))}
DOUBLING = {0.24: (1.128, (0.402, 0.35)), 0.25: (1.1588, (0.404, 0.338)), 0.262: (1.1911, (0.407, 0.326))}
DOUBLING |= {0.275: (1.2222, (0.41, 0.314)), 0.29: (1.2548, (0.415, 0.302)), 0.305: (1.2849, (0.42, 0.291))}
"""Speed and state near the two edges of each case, at the true constants."""


@pytest.fixture(scope="module")
def located():
    """The two edges of every case at the true constants, by Newton's method from rounded numbers."""
    found = []
    for g in FORCING:
        for name, kind, table in (("onset", "fold", FOLD), ("exit", "period-doubling", DOUBLING)):
            speed, state = table[g]
            point = jc.orbits.Point(kind, speed, np.array(state), 1)
            exact = jc.sensitivity(cases()[f"g={g}"], point, method=METHOD)
            assert exact.trusted
            there = dataclasses.replace(point, speed=exact.value_rpm * np.pi / 30)
            found.append((f"g={g}", f"zone 1 {name}", there, exact))
    return found


def measured_edges(located, noise):
    """Edges with a standard deviation of 1 %, off by `noise` of these."""
    made = []
    for (case, name, _, exact), n in zip(located, noise, strict=True):
        sigma = 0.01 * exact.value_rpm
        made.append(jc.design.MeasuredEdge(case, name, exact.value_rpm + n * sigma, sigma))
    return made


def fitted(located, noise, start=TRUTH, unknowns=BOUNDS):
    points = [point for _, _, point, _ in located]
    return jc.fit_edges(cases(), unknowns, measured_edges(located, noise), points, start=start, method=METHOD)


def logarithm(combination, values):
    return sum(w * np.log(values[n]) for n, w in combination.weights.items())


@pytest.mark.wide
def test_exact_edges_give_back_the_planted_constants(located):
    """From constants that are off, to the combinations that the edges can know."""
    start = {"mass": 1.0, "damping": 0.3, "stiffness": 1.0, "cubic": 1.03, "gain": 0.99}
    fit = fitted(located, np.zeros(12), start)
    assert fit.status == "converged"
    assert max(abs(e.residual) for e in fit.edges) < 1e-2
    known = fit.combinations[:3]
    assert fit.identified == known[: len(fit.identified)] and len(fit.identified) >= 2
    assert known[2].half_width < 0.5
    for c in known:
        assert logarithm(c, fit.values) == pytest.approx(logarithm(c, TRUTH), abs=0.02 * c.half_width + 1e-4)


def test_what_the_symmetries_hide_is_called_unknown(located):
    """Two combinations are free: the equation times a number, and x in another unit."""
    fit = fitted(located, np.zeros(12))
    hidden = fit.combinations[3:]
    assert all(not c.identified and c.half_width > 1e3 for c in hidden)
    names = list(TRUTH)
    times = np.array([1.0, 1.0, 1.0, 1.0, 1.0])  # m, d, k, b, s times a number
    unit = np.array([0.0, 0.0, 0.0, 2.0, -1.0])  # x times a number: b over its square, s by it
    space = np.array([[c.weights[n] for n in names] for c in hidden])
    for direction in (times, unit):
        inside = space.T @ (space @ direction)
        np.testing.assert_allclose(inside, direction, atol=1e-4)
    assert all(fit.interval[n][0] == pytest.approx(u.lower) for n, u in zip(names, BOUNDS, strict=True))


@pytest.mark.wide
def test_intervals_cover_the_truth(located):
    """Twenty draws of 1 % noise: each identified combination's 95 % interval holds the truth 17 times or more."""
    rng = np.random.default_rng(0)
    known = [BOUNDS[i] for i in (1, 3, 4)]  # damping, cubic and gain: mass and stiffness weighed, as on a test rig
    covered = np.zeros(3)
    half = [*located[:2], *located[4:6], *located[-2:]]
    for _ in range(20):
        fit = fitted(half, rng.normal(size=6), unknowns=known)
        assert fit.status == "converged"
        for i, c in enumerate(fit.combinations):
            off = logarithm(c, fit.values) - logarithm(c, TRUTH)
            covered[i] += abs(off) <= c.half_width
    assert np.all(covered >= 17), covered


@pytest.mark.wide
def test_an_edge_that_vanishes_stops_the_step_and_not_the_search(located):
    """A target beyond the point where the period doubling is there at all: the fit ends and says what is lost."""
    far = [
        jc.design.MeasuredEdge(e.case, e.name, 0.6 * e.rpm, e.uncertainty_rpm)
        for e in measured_edges(located, np.zeros(12))
    ]
    points = [point for _, _, point, _ in located]
    fit = jc.fit_edges(cases(), BOUNDS[1:2], far, points, start={"damping": 0.3}, method=METHOD, max_steps=12)
    assert np.all(np.isfinite([e.rpm for e in fit.edges]))
    assert fit.chi_square > 100  # no damping makes these edges: the misfit says so


@pytest.mark.wide
def test_slopes_are_those_of_differences(located):
    cases_, points = [c for c, *_ in located], [p for _, _, p, _ in located]
    place = np.array([u.place(TRUTH[u.name]) for u in BOUNDS])
    tracked = jc.design.TrackedEdges(cases(), BOUNDS, cases_, points, place, METHOD)
    here = tracked(place)
    for i in range(len(BOUNDS)):
        step = 1e-4 * np.eye(len(BOUNDS))[i]
        change = (tracked(place + step).rpm - tracked(place - step).rpm) / 2e-4
        np.testing.assert_allclose(here.slope[:, i], change, rtol=1e-5, atol=1e-5 * np.abs(here.slope).max())


def test_combinations_of_a_known_matrix():
    """Residuals 10 (a + b) and nothing else: a + b is known to 0.0707 along its unit vector, a - b not at all."""
    covariance, combinations = determined(np.array([[10.0, 10.0]]), ["a", "b"])
    best, worst = combinations
    assert best.half_width == pytest.approx(1.959963985 / np.hypot(10, 10))
    assert best.weights["a"] == pytest.approx(best.weights["b"])
    assert np.isinf(worst.half_width)
    assert np.all(np.isinf(np.diag(covariance)))


@pytest.mark.wide
def test_a_prior_fixes_what_the_edges_cannot(located):
    loose = [*BOUNDS[:4], jc.design.Unknown("gain", 0.25, 4.0, prior=(1.0, 0.02))]
    free = fitted(located, np.zeros(12))
    held = fitted(located, np.zeros(12), unknowns=loose)
    finite = lambda fit: sum(np.isfinite(c.half_width) and c.half_width < 1e3 for c in fit.combinations)
    assert finite(held) == finite(free) + 1


@pytest.mark.wide
def test_the_screen_finds_planted_zones():
    """Chaos of the double well where the planted constants have it: the best of 64 designs beats the median by far."""
    systems = {k: v for k, v in list(cases().items())[::3]}
    grid = jc.rpm(9.0, 13.5, 24)
    edges = []
    for case, system in systems.items():
        swept = raw_sweep(system, grid, starts=[(0.4, 0.3)], discard=100, revolutions=60, blocks=5)
        chaotic = swept.exponents[:, 0, 0] > 0.02
        assert chaotic.any() and not chaotic.all()
        first, last = swept.rpm[chaotic][[0, -1]]
        edges += [
            jc.design.MeasuredEdge(case, "zone 1 onset", first, 0.1),
            jc.design.MeasuredEdge(case, "zone 1 exit", last, 0.1),
        ]
    near = [jc.design.Unknown("damping", 0.2, 0.45), jc.design.Unknown("cubic", 0.7, 1.4)]
    options = dict(starts=[(0.4, 0.3)], discard=100, revolutions=60, horizon=0)
    best = jc.design.screen(systems, near, edges, grid, designs=32, best=32, **options)
    assert [c.score for c in best] == sorted(c.score for c in best)
    assert best[0].score < 0.6 * best[16].score
    evolved = jc.design.screen(systems, near, edges, grid, designs=32, generations=3, best=1, **options)
    assert evolved[0].score <= best[0].score


@pytest.mark.wide
def test_the_screen_counts_chaos_by_how_long_it_lasts():
    """Where all speeds should be chaotic, lanes that leave chaos on the way to the horizon make the score worse."""
    model, grid = jc.case("1a"), jc.rpm(7000, 9000, 8)
    value = float(jc.parameters(model)["amplitude"])
    only = [jc.design.Unknown("amplitude", value * (1 - 1e-12), value * (1 + 1e-12), "linear")]
    edges = [jc.design.MeasuredEdge("1a", "zone 1 onset", 6000.0, 120.0)]
    score = lambda horizon: (
        jc.design.screen(
            {"1a": model}, only, edges, grid, designs=1, best=1, discard=100, revolutions=100, horizon=horizon
        )[0].score
    )
    assert score(800) > score(0) + 0.02, "some of this chaos is transient"


def test_measured_zones_over_a_grid():
    edges = [
        jc.design.MeasuredEdge("x", "zone 1 onset", 10.0, 1.0),
        jc.design.MeasuredEdge("x", "zone 1 exit", 20.0, 1.0),
    ]
    edges.append(jc.design.MeasuredEdge("x", "zone 2 onset", 30.0, 1.0))
    got = inside_zones(edges, np.array([5.0, 10.0, 15.0, 20.0, 25.0, 35.0]))
    np.testing.assert_array_equal(got, [False, True, True, True, False, True])


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: jc.design.Unknown("a", 2.0, 1.0), "must ascend"),
        (lambda: jc.design.Unknown("a", -1.0, 1.0), "must be positive"),
        (lambda: jc.design.MeasuredEdge("x", "exit of zone 1", 1.0, 1.0), "zone 1 onset"),
        (lambda: jc.design.MeasuredEdge("x", "zone 1 exit", 1.0, 1.0, "both"), "synchronous-loss or chaotic"),
        (lambda: jc.design.MeasuredEdge("x", "zone 1 exit", np.nan, 1.0), "positive numbers"),
        (lambda: jc.fit_edges(cases(), BOUNDS, [], [], start=TRUTH), "one point per edge"),
        (lambda: jc.fit_edges(cases(), [], [], [], start=TRUTH), "each unknown once"),
        (lambda: jc.fit_edges(cases(), [jc.design.Unknown("heat", 1.0, 2.0)], [], [], start={}), "must be a parameter"),
    ],
)
def test_bad_input_gets_a_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_sliver_at_the_end_of_the_range_is_not_zone_2():
    """A zone without an exit counts up to the last speed looked at: 5000 rpm shared beat 100, whatever lies beyond."""
    edge = lambda rpm: Edge(rpm, 100.0, "chaotic")
    found = [Zone("chaotic", edge(a), b and edge(b), 1.0) for a, b in ((9.0e3, 12e3), (22e3, 27e3), (27.4e3, None))]
    ends = (("zone 1 onset", 9100.0), ("zone 1 exit", 12000.0), ("zone 2 onset", 21000.0))
    measured = [jc.design.MeasuredEdge("x", name, rpm, 100.0, "chaotic") for name, rpm in ends]
    got = matched(measured, found, 27.5e3)
    assert [e and e.speed_rpm for e in got] == [9000.0, 12000.0, 22000.0]
    assert matched(measured, found[:1], 27.5e3)[2] is None
    over = [Zone("chaotic", edge(9e3), None, 1.0)]  # one zone over both answers for the first only
    assert [e and e.speed_rpm for e in matched(measured, over, 27.5e3)] == [9000.0, None, None]
