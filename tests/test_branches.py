"""Branches of periodic orbits: through folds, closed, with period doublings, branch points and tori in their places.

"DOP853" in a comment means: computed with SciPy's DOP853 at a tolerance of 1e-12 and Newton's method, sharing nothing
with this library. "Planted" systems have orbits and multipliers that are known exactly.
"""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import slow_but, wide_but
from laws import about_an_orbit, double_well, hardening, numbers
from literature import DUFFING_DOUBLINGS, DUFFING_FOLDS

import jaxcage as jc
from jaxcage.files import read_bearing


METHOD = jc.method("rodas4", steps=256)
FINE = jc.method("rodas4", steps=1024)
DOUBLING = DUFFING_DOUBLINGS[1][1].value
"""Force at which the period doubles first."""


def kinds(branch):
    return [p.kind for p in branch.special]


@pytest.mark.wide
def test_an_orbit_for_which_runge_kutta_takes_thousands_of_steps_has_a_branch():
    """Thick oil in a narrow gap: Rodas4 follows it, and passes through the state that 8192 steps find."""
    spindle = read_bearing(Path(__file__).parents[1] / "benchmarks" / "spindle.toml").model
    values = dict(guidance_gap=154.27e-6, eccentricity=6.454e-6, temperature=303.86, land_width=1.5974e-3)
    values |= dict(cage_mass=0.21563, rib_diameter=70.34e-3, amplitude=150.58, stiffness=3.1655e9)
    model, speed = jc.replace(spindle, **values), 420.5
    orbit = jc.periodic_orbit(model, speed, guess=(-5.767e-5, -2.489e-5, 7.371e-3, -4.06e-3))
    assert bool(orbit.converged) and orbit.solver == "rk4" and int(orbit.steps) >= 4096
    found = jc.branch(model, orbit, lower=420.0, upper=421.0, steps=jc.orbits.StepControl(most=8))
    apart = np.abs(found.state - np.asarray(orbit.state)).max(axis=1) / float(model.clearance)
    assert apart[np.argmin(np.abs(found.value - speed))] < 1e-3


def test_speed_and_periods_given_beside_an_orbit_count():
    orbit = jc.periodic_orbit(hardening(), 0.8, guess=(0.5, 0.0), revolutions=200, method=METHOD)
    settings = dict(lower=0.25, upper=0.35, steps=jc.orbits.StepControl(most=2), method=METHOD)
    found = jc.branch(hardening(), orbit, "g", speed=0.9, periods=2, **settings)
    assert set(found.speed.tolist()) == {0.9} and found.periods == 2


def test_branch_passes_the_folds_of_the_hardening_duffing():
    """DOP853, all printed digits."""
    orbit = jc.periodic_orbit(hardening(), 0.8, guess=(0.5, 0.0), revolutions=200, method=METHOD)
    over_speed = jc.branch(hardening(), orbit, lower=0.5, upper=2.5, method=METHOD)
    upper, lower = over_speed.special
    assert upper.kind == lower.kind == "fold" and upper.edge and lower.edge
    assert abs(upper.value - DUFFING_FOLDS["up"].value) < 1e-7
    assert abs(lower.value - DUFFING_FOLDS["down"].value) < 1e-7
    assert upper.speed == upper.value and upper.parameter == "speed"
    assert max(abs(upper.critical - 1), abs(lower.critical - 1)) < 1e-6
    assert over_speed.ended == ("range", "range")
    assert over_speed.value[[0, -1]].tolist() == [0.5, 2.5]
    stable = np.ones(over_speed.value.size, dtype=bool)
    stable[upper.index + 1 : lower.index + 1] = False
    assert np.array_equal(over_speed.stable, stable) and lower.index - upper.index > 5


def test_a_branch_from_a_point_begins_at_the_value_where_that_was_found():
    """Whatever the system's own value is: at a tenth of the force there is no such orbit to begin with."""
    orbit = jc.periodic_orbit(double_well(), 1.2, guess=(1.0, 0.0), revolutions=100, method=FINE)
    over_force = jc.branch(double_well(), orbit, "g", lower=0.1, upper=0.35, method=FINE)
    doubling = min(over_force.special, key=lambda p: abs(p.value - DOUBLING))
    ends = dict(lower=0.9 * DOUBLING, upper=1.1 * DOUBLING)
    found = jc.branch(double_well(0.1 * DOUBLING), doubling, "g", **ends, method=FINE)
    assert min(abs(p.value - DOUBLING) for p in found.special) < 1e-7


class Identical(eqx.Module):
    """Identical oscillators x'' = -0.3 x' + x - x^3 + g cos(tau), side by side."""

    g: jax.Array

    def __call__(self, tau, q, v, speed):
        return tuple(-0.3 * u + x - x**3 + self.g * jnp.cos(tau) for x, u in zip(q, v, strict=True))


class Bend(eqx.Module):
    """x' = p + a x - x^3."""

    p: jax.Array
    a: jax.Array

    def __call__(self, tau, y, speed):
        (x,) = y
        return (self.p + self.a * x - x**3,)


@pytest.mark.wide
@pytest.mark.parametrize("start", [-1.3, -1.1, -0.9])
def test_two_folds_within_a_step(start):
    """Two folds at x = ±sqrt(a/3), 0.04 apart with steps of 0.5, leave the number of multipliers outside the same."""
    a = 0.001
    system = jc.ForcedSystem(Bend(**numbers(p=0.0, a=a)), dimension=1)
    orbit = (start,), start**3 - a * start
    branch = jc.branch(system, orbit, "p", lower=-2.5, upper=2.5, speed=6.0, method=METHOD)
    assert kinds(branch) == ["fold", "fold"]
    place = np.sqrt(a / 3)
    np.testing.assert_allclose([p.value for p in branch.special], [2 * place**3, -2 * place**3], rtol=0, atol=1e-8)
    assert np.array_equal(branch.stable, np.abs(branch.state[:, 0]) > place)


class Ring(eqx.Module):
    """x' = (p - 2)^2 + x^2 - r^2, and beside it what the drive makes of u: orbits are the points of a circle."""

    p: jax.Array
    r: jax.Array

    def __call__(self, tau, y, speed):
        x, u = y
        return ((self.p - 2) ** 2 + x * x - self.r**2, -0.5 * u + jnp.cos(tau))


@pytest.mark.parametrize("degrees", [60, pytest.param(-90, marks=pytest.mark.wide), *slow_but((-3, -0.3, 176))])
def test_closed_branch_is_covered_once(degrees):
    """Folds at p = 2 +- r, wherever on the circle it begins; multipliers exp(2 x T) and exp(-T/2): exact."""
    radius, speed = 0.3, 1.5
    system = jc.ForcedSystem(Ring(**numbers(p=2, r=radius)), dimension=2)
    angle = np.deg2rad(degrees)
    u = 0.5 / (0.25 + speed**2)
    start = ((radius * np.sin(angle), u), 2 + radius * np.cos(angle))
    branch = jc.branch(system, start, "p", lower=1.5, upper=2.5, speed=speed, method=METHOD)
    assert branch.ended == ("closed", "closed")
    assert kinds(branch) == ["fold", "fold"]
    np.testing.assert_allclose(sorted(p.value for p in branch.special), [2 - radius, 2 + radius], rtol=0, atol=1e-9)
    np.testing.assert_allclose([p.state[0] for p in branch.special], 0.0, atol=1e-7)
    np.testing.assert_allclose(np.hypot(branch.value - 2, branch.state[:, 0]), radius, atol=1e-9)
    turned = np.diff(np.unwrap(np.arctan2(branch.state[:, 0], branch.value - 2)))
    assert np.all(turned > 0) or np.all(turned < 0)
    np.testing.assert_allclose(abs(np.sum(turned)), 2 * np.pi, atol=1e-9)  # the first point again at the end
    assert np.array_equal(branch.stable, branch.state[:, 0] < 0)
    period = 2 * np.pi / speed
    exact = np.sort([np.exp(2 * branch.state[:, 0] * period), np.full(branch.value.size, np.exp(-period / 2))], axis=0)
    # Those of Newton's last iterate but one, at a distance of up to 1e-5.
    np.testing.assert_allclose(np.sort(branch.multipliers.real, axis=1).T, exact, rtol=5e-4)


class Planted(eqx.Module):
    """The orbit (cos, sin, cos, sin) with the multipliers of exp(A T), A of two blocks [[g + s, -b], [b, g - s]].

    g = a + c p. A coupling from the first to the second does not change the multipliers.

    The second block turns by half a revolution a period: its multipliers have the opposite sign.
    """

    p: jax.Array
    a: jax.Array
    c: jax.Array
    s: jax.Array
    b: jax.Array

    def __call__(self, tau, y, speed):
        def block(i):
            def rates(e, f):
                growth = self.a[i] + self.c[i] * self.p - (e * e + f * f)
                return (growth + self.s[i]) * e - self.b[i] * f, (growth - self.s[i]) * f + self.b[i] * e

            return about_an_orbit(tau, y[2 * i : 2 * i + 2], speed, i / 2, rates)

        first, (x, v) = block(0), block(1)
        return (*first, x + 0.3 * (y[0] - jnp.cos(tau)), v)


def planted(a, c, s=(0.0, 0.0), b=(0.0, 0.0)):
    return jc.ForcedSystem(Planted(**numbers(p=0.0, a=a, c=c, s=s, b=b)), dimension=4)


def planted_branch(speed=1.1, lower=-0.2, upper=0.2, how=dict(method=METHOD), **settings):
    start = ((1.0, 0.0, 1.0, 0.0), lower + 0.01)
    return jc.branch(planted(**settings), start, "p", lower=lower, upper=upper, speed=speed, **how)


# What happens inside the unit circle, or outside, without anything crossing it.
QUIET = {
    "real pair and complex pair change order": dict(a=(-0.3, -0.3), c=(1.0, -1.0), s=(0.0, 0.05), b=(0.4, 0.0)),
    "neutral saddle": dict(a=(0.0, -0.3), c=(1.0, 0.0), s=(0.3, 0.1), b=(0.0, 0.0)),
    "neutral saddle of two blocks": dict(a=(-0.3, 0.2), c=(1.0, 0.5), s=(0.05, 0.05), b=(0.0, 0.0)),
}


@pytest.mark.wide
@pytest.mark.parametrize("name", QUIET)
def test_nothing_is_found_where_no_multiplier_crosses_the_circle(name):
    branch = planted_branch(**QUIET[name])
    assert branch.special == ()
    assert np.all(branch.stable != ("saddle" in name))  # where the product of some two passes 1


@pytest.mark.parametrize("first", wide_but(["period-doubling", "branch-point"], "period-doubling"))
def test_crossings_within_one_step_are_in_order(first):
    """One at p = 0.02 and one at 0.0201, with one orbit put between them: only the first is next to stable orbits."""
    places = [0.02, 0.0201] if first == "period-doubling" else [0.0201, 0.02]
    branch = planted_branch(a=(-places[1] - 0.2, -places[0] - 0.2), c=(1.0, 1.0), s=(0.2, 0.2))
    assert branch.special[0].index + 1 == branch.special[1].index
    assert all(abs(p.value - at) <= p.error < 1e-7 for p, at in zip(branch.special, [0.02, 0.0201], strict=True))
    assert branch.special[0].kind == first and sorted(kinds(branch)) == ["branch-point", "period-doubling"]
    assert [p.edge for p in branch.special] == [True, False]


@pytest.mark.wide
@pytest.mark.parametrize(
    "kind, block", [("period-doubling", dict(s=(0.1, 0.0002))), ("Neimark-Sacker", dict(b=(0.4, 0.3)))]
)
def test_two_crossings_of_one_kind_within_a_step(kind, block):
    """Both test functions have the same sign on either side of the pair: only the count of multipliers tells."""
    places = (0.0199, 0.0203) if kind == "Neimark-Sacker" else (0.0198, 0.0202)
    a = (-places[0], -places[1]) if kind == "Neimark-Sacker" else (-0.3, -0.02)
    block |= dict(a=a, c=(1.0, 1.0) if kind == "Neimark-Sacker" else (0.2, 1.0))
    branch = planted_branch(how=dict(steps=jc.orbits.StepControl(first=0.1, longest=0.4), method=METHOD), **block)
    assert kinds(branch) == [kind, kind]
    np.testing.assert_allclose([p.value for p in branch.special], places, rtol=0, atol=1e-8)
    assert np.diff(branch.value)[branch.special[0].index] < 0.003 < 0.007 < np.max(np.diff(branch.value))  # halved
    assert np.array_equal(branch.stable, branch.value < places[0])


@pytest.mark.parametrize(
    "kind, block",
    [
        ("double period-doubling", dict(a=(-0.3, -0.02), c=(0.2, 1.0), s=(0.1, 0.0))),
        pytest.param(
            "double Neimark-Sacker", dict(a=(-0.02, -0.02), c=(1.0, 1.0), b=(0.4, 0.3)), marks=pytest.mark.wide
        ),
    ],
)
def test_multipliers_that_cross_together(kind, block):
    """Two are -exp((p - 0.02) T), or two pairs have this modulus: no product of factors has a sign there."""
    branch = planted_branch(**block)
    (point,) = branch.special
    assert (point.kind, point.status, point.edge) == (kind, "converged", True)
    assert abs(point.value - 0.02) <= point.error < 1e-6 and abs(abs(point.critical) - 1) < 1e-3
    away = np.abs(branch.value - 0.02) > 1e-6
    assert np.array_equal(branch.stable[away], branch.value[away] < 0.02)


@pytest.mark.wide
def test_crossing_that_is_not_found_is_said_to_be_unexplained():
    """Four identical oscillators double together: more than is looked for."""
    system = jc.ForcedOscillator(Identical(jnp.asarray(0.2)), coordinates=4)
    orbit = jc.periodic_orbit(system, 1.2, guess=(1.0,) * 4 + (0.0,) * 4, revolutions=100, method=FINE)
    branch = jc.branch(system, orbit, "g", lower=0.15, upper=0.28, method=FINE)
    assert sorted(kinds(branch)) == ["double period-doubling", "unexplained"] and "unexplained" in str(branch)
    for point in branch.special:
        assert abs(point.value - DOUBLING) < point.error + 2e-9 and point.error < 2e-4  # printed to nine digits


@pytest.mark.parametrize(
    "settings, sentence",
    [
        (dict(lower=1.0, upper=1.0), "`upper` must be above `lower`, but they are 1 and 1"),
        (dict(lower=0.0, upper=1.0), "`lower` must be positive where the speed is followed, but 0 was given"),
        (dict(lower=0.5, upper=np.inf), "`lower` and `upper` must be finite, but are 0.5 and inf"),
        (dict(lower=1.0, upper=2.0), "`orbit` must begin from 1 to 2, `lower` and `upper`, but is at 0.8"),
        (
            dict(orbit=((0.5,), 0.8), lower=0.5, upper=1.0),
            r"`orbit` must be a state of 2 numbers, but has shape \(1,\)",
        ),
        (dict(parameter="a", lower=0.0, upper=1.0), "`parameter` must be one of speed, m, d, k, b, g, but 'a' was"),
        (dict(parameter="g", lower=0.1, upper=1.0, speed=None), "`speed` must be given where the parameter is"),
    ],
)
def test_bad_arguments(settings, sentence):
    with pytest.raises(ValueError, match=sentence):
        jc.branch(hardening(), **(dict(orbit=((0.5, 0.0), 0.8), method=METHOD, speed=0.8) | settings))


def test_an_orbit_at_the_end_of_the_range_is_followed_and_other_starts_are_refused():
    """The first also where rounding puts it just beyond; x' = p^2 + x^2 has no orbit for p > 0."""
    steps = jc.orbits.StepControl(most=2)
    start = (0.5, 0.0), np.nextafter(0.8, 0.0)
    branch = jc.branch(hardening(), start, lower=0.8, upper=1.5, steps=steps, method=METHOD)
    assert branch.value.max() > 0.8 and branch.ended == ("range", "steps")
    system = jc.ForcedSystem(Ring(**numbers(p=2.5, r=0.0)), dimension=2)
    with pytest.raises(ValueError, match="`orbit` must be near a periodic orbit, but none is near it at 2.5"):
        jc.branch(system, ((0.1, 0.0), 2.5), "p", lower=1.5, upper=3.0, speed=1.5, method=METHOD)
    with pytest.raises(ValueError, match="`steps` must have 0 < shortest <= first <= longest, but has"):
        jc.orbits.StepControl(first=0.6)
