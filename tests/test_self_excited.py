"""Self-excited orbits, which have no phase of their own: branches, curves and cascades see the orbit and not the plane
on which it is met."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but
from scipy.integrate import solve_ivp
from test_branches import Circling, numbers

import jaxcage as jc


class Moving(eqx.Module):
    """The unit circle, at speed 1, about a centre that moves with p: no orbit has a place in common with all others."""

    p: jnp.ndarray

    def __call__(self, tau, y, speed):
        x, z = y[0], y[1] - self.p
        r2 = x * x + z * z
        return x * (1 - r2) - z, z * (1 - r2) + x


class Brusselator(eqx.Module):
    """Stable cycles for all b > 2, where they shrink to (1, b)."""

    b: jnp.ndarray

    def __call__(self, tau, y, speed):
        x, z = y
        return 1 + x * x * z - (self.b + 1) * x, self.b * x - x * x * z


class Roessler(eqx.Module):
    c: jnp.ndarray

    def __call__(self, tau, y, speed):
        x, z, w = y
        return -z - w, x + 0.2 * z, 0.2 + w * (x - self.c)


class Bautin(eqx.Module):
    """r' = r (p + b r^2 - r^4): cycles fold at p = -b^2/4."""

    p: jnp.ndarray
    b: jnp.ndarray

    def __call__(self, tau, y, speed):
        x, z = y
        r2 = x * x + z * z
        grows = self.p + self.b * r2 - r2 * r2
        return grows * x - z, grows * z + x


class Lorenz(eqx.Module):
    r: jnp.ndarray

    def __call__(self, tau, y, speed):
        x, z, w = y
        return 10 * (z - x), self.r * x - z - x * w, x * z - 8 / 3 * w


class BogdanovTakens(eqx.Module):
    """Cycles that grow from a focus until they meet the saddle at x = 1, whose trace b - 1 keeps them all stable."""

    b: jnp.ndarray

    def __call__(self, tau, y, speed):
        x, v = y
        return v, -1 + self.b * v + x * x - x * v


class FitzHughNagumo(eqx.Module):
    current: jnp.ndarray

    def __call__(self, tau, y, speed):
        v, w = y
        return v - v**3 / 3 - w + self.current, 0.2 * (v + 0.7 - 0.8 * w)


def settled_on(law, start, long=300.0):
    return solve_ivp(lambda t, y: law(0.0, y, 1.0), (0, long), start, "DOP853", rtol=1e-9, atol=1e-9).y[:, -1]


def test_a_branch_towards_a_homoclinic_orbit_ends_where_it_is_not_known_any_more():
    """It went on within rounding: hundreds of points, half of them called unstable."""
    start = settled_on(BogdanovTakens(-0.97), [-1.4, 0.0])
    system = jc.ForcedSystem(BogdanovTakens(jnp.asarray(-0.97)), dimension=2)
    orbit = jc.periodic_orbit(system, 1.4, guess=tuple(start), period="free")
    branch = jc.branch(system, orbit, "b", lower=-1.2, upper=-0.3, period="free")
    assert branch.special == () and np.all(branch.stable)
    assert set(branch.ended) == {"equilibrium", "inaccurate"} and branch.value.size < 100
    assert 2 * np.pi / branch.speed.min() > 23 and branch.error.max() < 1e-3


@pytest.mark.wide
def test_multipliers_of_a_branch_are_those_at_its_orbits():
    """Where a canard grows the map's derivative changes by itself within the last step of Newton's method."""
    start = settled_on(FitzHughNagumo(0.7), [1.0, 0.0])
    system = jc.ForcedSystem(FitzHughNagumo(jnp.asarray(0.7)), dimension=2)
    orbit = jc.periodic_orbit(system, 2 * np.pi / 20, guess=tuple(start), revolutions=30, period="free")
    branch = jc.branch(system, orbit, "current", lower=0.2, upper=1.6, period="free")
    assert np.max(np.min(np.abs(branch.multipliers - 1), axis=1)) < 1e-3


def test_orbits_are_followed_where_they_leave_the_plane_they_began_on():
    system = jc.ForcedSystem(Moving(jnp.asarray(0.0)), dimension=2)
    orbit = jc.periodic_orbit(system, 1.1, guess=(1.0, 0.1), period="free")
    branch = jc.branch(system, orbit, "p", lower=-3.0, upper=3.0, period="free")
    assert branch.special == () and branch.ended == ("range", "range")
    assert branch.value.min() < -3 and branch.value.max() > 3
    radius = np.hypot(branch.state[:, 0], branch.state[:, 1] - branch.value)
    np.testing.assert_allclose(radius, 1.0, atol=1e-9)
    np.testing.assert_allclose(branch.speed, 1.0, rtol=1e-7)


@pytest.mark.parametrize("part", wide_but(range(8), 5))
def test_a_branch_is_the_same_from_every_phase_of_its_orbit(part):
    """There is neither fold nor branch point; it ends where the cycle shrinks to the equilibrium, at b = 2."""
    law = lambda t, y: Brusselator(2.5)(0.0, y, 1.0)
    settled = solve_ivp(law, (0, 200), [1.0, 3.0], "DOP853", rtol=1e-9, atol=1e-9).y[:, -1]
    period = 2 * np.pi / 0.95522
    (start,) = solve_ivp(law, (0, period), settled, "DOP853", rtol=1e-9, atol=1e-9, t_eval=[part * period / 8]).y.T
    system = jc.ForcedSystem(Brusselator(jnp.asarray(2.5)), dimension=2)
    orbit = jc.periodic_orbit(system, 0.955, guess=tuple(start), period="free")
    branch = jc.branch(system, orbit, "b", lower=1.5, upper=4.0, period="free")
    assert branch.special == () and set(branch.ended) == {"equilibrium", "range"} and np.all(branch.stable)
    assert 2 < branch.value.min() < 2.02 and branch.value.max() > 4
    smallest = branch.state[np.argmin(branch.value)]
    np.testing.assert_allclose(smallest, [1.0, 2.0], atol=0.1)


@pytest.mark.wide
def test_a_pitchfork_of_cycles_is_found_on_their_branch():
    """Lorenz, r = 312.97: as `bifurcation` has it, of a branch that is symmetric on one side and two on the other."""
    system = jc.ForcedSystem(Lorenz(jnp.asarray(350.0)), dimension=3, scale=(50.0, 100.0, 300.0))
    orbit = jc.periodic_orbit(system, 16.17, guess=(0.0, 41.8148, 296.18), period="free")
    branch = jc.branch(system, orbit, "r", lower=280.0, upper=400.0, period="free")
    (point,) = branch.special
    assert (point.kind, point.status) == ("branch-point", "converged")
    alone = jc.bifurcation(system, "branch-point", point, "r", period="free")
    assert float(alone.value) == pytest.approx(float(point.value), abs=2e-5) == pytest.approx(312.97353, abs=2e-5)


def test_curves_of_folds_have_no_resonances_of_the_multiplier_that_is_always_1():
    system = jc.ForcedSystem(Bautin(jnp.asarray(-0.24), jnp.asarray(1.0)), dimension=2)
    fold = jc.bifurcation(system, "fold", ((0.6**0.5, 0.0), -0.24), "p", speed=1.0, period="free")
    assert float(fold.value) == pytest.approx(-0.25, abs=1e-8)
    limits = dict(lower=0.5, upper=2.0, x_lower=-1.0, x_upper=0.5)
    curve = jc.curve(system, fold, "p", "b", period="free", **limits)
    assert curve.special == () and np.all(curve.genuine)
    np.testing.assert_allclose(curve.x_value, -(curve.y_value**2) / 4, atol=1e-6)


@pytest.mark.wide
def test_a_planted_curve_of_neimark_sacker_points_has_its_resonance_and_no_other():
    system = jc.ForcedSystem(Circling(**numbers(p=0.0, d=0.0, s=-1.0, t=0.3)), dimension=4)
    point = jc.bifurcation(system, "Neimark-Sacker", ((1.0, 0.0, 0.0, 0.0), 0.018), "p", speed=1.0, period="free")
    limits = dict(lower=0.2, upper=0.45, x_lower=-0.1, x_upper=0.1)
    curve = jc.curve(system, point, "p", "t", period="free", **limits)
    (found,) = curve.special
    assert found.kind == "1:4 resonance" and found.y_value == pytest.approx(0.25, abs=1e-6)


@pytest.mark.wide
@pytest.mark.parametrize("guess", [(0.0, -3.0, 0.1), (-3.0, 0.0, 0.1)])
def test_a_cascade_goes_on_from_every_phase_and_never_back_to_the_parent(guess):
    """Roessler's system, a = b = 0.2: doublings at 2.8324, 3.8374, 4.1242, 4.1870, 4.2005."""
    system = jc.ForcedSystem(Roessler(jnp.asarray(2.0)), dimension=3, scale=5.0)
    orbit = jc.periodic_orbit(system, 1.05, guess=guess, revolutions=50, period="free")
    first = jc.bifurcation(system, "period-doubling", (orbit.state, 2.8), "c", speed=orbit.speed, period="free")
    found = jc.orbits.cascade(system, first, "c", lower=1.0, upper=6.0, levels=5, period="free")
    np.testing.assert_allclose(found.values, [2.83244503, 3.83735818, 4.12421474, 4.186997, 4.20053729], rtol=1e-7)
    assert found.ended == ""
    short = jc.orbits.cascade(system, first, "c", lower=1.0, upper=4.0, levels=5, period="free")
    assert len(short.points) == 2 and "does not double again" in short.ended in str(short)
    doubled = jc.orbits.doubled_branch(system, found.points[2], "c", lower=1.0, upper=4.15, period="free")
    law = lambda t, y: Roessler(doubled.value[-1])(0.0, y, 1.0)
    turn = 2 * np.pi / doubled.speed[-1]
    ends = solve_ivp(
        law, (0, 8 * turn), doubled.state[-1], "DOP853", rtol=1e-10, atol=1e-10, t_eval=[4 * turn, 8 * turn]
    ).y.T
    half, whole = (np.linalg.norm(end - doubled.state[-1]) for end in ends)
    assert whole < 1e-4 < 1e-2 < half


class Rows(eqx.Module):
    """The same with b in a row."""

    p: jnp.ndarray
    b: jnp.ndarray

    def __call__(self, tau, y, speed):
        return Bautin(self.p, self.b[0])(tau, y, speed)


def test_what_is_no_parameter_and_no_point_is_refused():
    system = jc.ForcedSystem(Rows(jnp.asarray(-0.2), jnp.asarray([1.0])), dimension=2)
    follow = lambda parameter: jc.branch(
        system, ((0.85, 0.0), -0.2), parameter, lower=-0.3, upper=0.1, speed=1.0, period="free"
    )
    for parameter, said in (
        ("b", "must be one of speed, p, but 'b' was given"),
        (lambda s: s.rates.b[0], "must pick a number that the system holds"),
        (lambda s: 2 * s.rates.p, "must pick a number that the system holds"),
    ):
        with pytest.raises(ValueError, match=said):
            follow(parameter)
    nothing = jc.Point("period-doubling", float("nan"), np.zeros(2), parameter="p")
    with pytest.raises(ValueError, match="this period-doubling was not"):
        jc.orbits.cascade(system, nothing, "p", lower=-0.3, upper=0.1)


def test_a_point_found_under_jit_is_a_guess_for_another():
    system = jc.ForcedSystem(Bautin(jnp.asarray(-0.24), jnp.asarray(1.0)), dimension=2)
    how = dict(speed=1.0, period="free")

    @eqx.filter_jit
    def twice(system):
        first = jc.bifurcation(system, "fold", ((0.7072, 0.0), -0.25), "p", **how)
        return jc.bifurcation(system, "fold", first, "p", **how).value

    assert float(twice(system)) == pytest.approx(-0.25, abs=1e-7)
    nothing = jc.Point("fold", float("nan"), np.zeros(2), parameter="p")
    with pytest.raises(ValueError, match="`guess` must be one that was found, but this fold was not"):
        jc.bifurcation(system, "fold", nothing, "p", **how)


def test_a_law_that_depends_on_the_phase_has_no_free_period():
    def law(tau, q, v, speed):
        return (-0.3 * v[0] + q[0] - q[0] ** 3 + 0.5 * jnp.cos(tau),)

    system = jc.ForcedOscillator(law, coordinates=1)
    with pytest.raises(ValueError, match="`driven` where the law depends on the phase"):
        jc.periodic_orbit(system, 1.0, guess=(0.3, 0.3), period="free")
