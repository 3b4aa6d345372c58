"""Branches that fork: from the stem, from the side, and where an orbit of twice the period ends. And kinks in a law."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import jaxcage as jc


class Fork(eqx.Module):
    """e' = p e - c e^3 for e = x - 0.3 cos(tau): orbits e = 0, and e^2 = p / c."""

    p: jnp.ndarray
    c: jnp.ndarray

    def __call__(self, tau, y, speed):
        e = y[0] - 0.3 * jnp.cos(tau)
        return (self.p * e - self.c * e**3 - 0.3 * speed * jnp.sin(tau),)


class DoubleWell(eqx.Module):
    force: jnp.ndarray

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.3 * u + x - x**3 + self.force * jnp.cos(tau),)


RANGES = [(c, *row) for c in (1.0, 10.0, 100.0) for row in ((0.25, -0.2, 0.3), (0.05, -0.05, 0.1), (0.01, -1.0, 1.0))]


@pytest.mark.parametrize("c, p, lower, upper", wide_but(RANGES, (1.0, 0.25, -0.2, 0.3), (100.0, 0.05, -0.05, 0.1)))
def test_a_fork_followed_from_its_side_goes_round_and_not_down_the_stem(c, p, lower, upper):
    """Both are stable there: only the place of the crossing tells one from the other."""
    system = jc.ForcedSystem(Fork(jnp.asarray(p), jnp.asarray(c)), dimension=1)
    branch = jc.branch(system, ((0.3 + np.sqrt(p / c),), p), "p", lower=lower, upper=upper, speed=2.0)
    (point,) = branch.special
    assert (point.kind, point.status) == ("branch-point", "converged") and abs(float(point.value)) < 1e-8
    aside = branch.state[:, 0] - 0.3
    np.testing.assert_allclose(branch.value, c * aside**2, atol=1e-6)
    assert branch.ended == ("range", "range") and aside.min() * aside.max() < 0 and np.mean(branch.stable) > 0.97
    assert "ends: range, range" in str(branch)


@pytest.mark.parametrize("force, lower", wide_but([(0.275, 0.25), (0.275, 0.1), (0.28, 0.2)], (0.28, 0.2)))
def test_orbits_of_twice_the_period_end_where_the_period_doubles(force, lower):
    """The double well doubles at 0.26558179 and, on the doubled branch, at 0.28669316."""
    system = jc.ForcedOscillator(DoubleWell(jnp.asarray(force)), coordinates=1)
    orbit = jc.periodic_orbit(system, 1.2, 2, guess=(0.55, 0.375), revolutions=200)
    branch = jc.branch(system, orbit, "force", lower=lower, upper=0.29)
    kinds = [p.kind for p in branch.special]
    assert kinds == ["period-doubling", "branch-point", "period-doubling"] and branch.ended == ("range", "range")
    found = [float(p.value) for p in branch.special]
    np.testing.assert_allclose(found, [0.2866931578, 0.2655817858, 0.2866931578], rtol=1e-8)
    assert branch.value.min() > 0.26558


class Oval(eqx.Module):
    """Orbits e on Cassini's oval (e^2 + p^2)^2 - 2 (p^2 - e^2) + r = 0: one closed curve with a narrow waist."""

    p: jnp.ndarray
    r: jnp.ndarray

    def __call__(self, tau, y, speed):
        e, p2 = y[0] - 0.3 * jnp.cos(tau), self.p**2
        return ((e * e + p2) ** 2 - 2 * (p2 - e * e) + self.r - 0.3 * speed * jnp.sin(tau),)


@pytest.mark.parametrize("r", wide_but([-1e-5, -1e-6, -1e-7, -1e-8], -1e-6))
@pytest.mark.parametrize("p", wide_but([1.0, 0.5, 1.2, -1.0], 0.5))
def test_a_closed_branch_with_a_waist_is_gone_round_once(p, r):
    e = np.sqrt(-(p * p + 1) + np.sqrt((p * p + 1) ** 2 - (p**4 - 2 * p * p + r)))
    system = jc.ForcedSystem(Oval(jnp.asarray(p), jnp.asarray(r)), dimension=1)
    branch = jc.branch(system, ((0.3 + e,), p), "p", lower=-2.0, upper=2.0, speed=2.0)
    turns = np.unwrap(np.arctan2(3 * (branch.state[:, 0] - 0.3), branch.value))
    assert branch.ended == ("closed", "closed") and abs(abs(turns[-1] - turns[0]) / (2 * np.pi) - 1) < 0.02
    assert sorted(round(float(q.value), 4) for q in branch.special) == [-1.4142, 1.4142]


class Stop(eqx.Module):
    """An oscillator that meets a stiff spring behind a gap."""

    stiffness: jnp.ndarray
    gap: jnp.ndarray

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.1 * u - x - self.stiffness * jnp.maximum(x - self.gap, 0.0) + jnp.cos(tau),)


class Meets:
    """Event: the spring is met, or left."""

    terminal = True

    def __init__(self, leaves):
        self.direction = -1.0 if leaves else 1.0

    def __call__(self, t, y, k):
        return y[0] - 2.0


def image_by_pieces(speed, state):
    """State of `Stop`, with 20 and 2, after one revolution and its derivative, each piece integrated to its end."""

    def law(t, y, k):
        slope = np.array([[0.0, 1.0], [-1 - k, -0.1]]) @ y[2:].reshape(2, 2)
        return np.r_[y[1], -0.1 * y[1] - y[0] - k * (y[0] - 2.0) + np.cos(speed * t), slope.ravel()]

    time, end, y, inside = 0.0, 2 * np.pi / speed, np.r_[state, np.eye(2).ravel()], state[0] > 2.0
    how = dict(method="DOP853", rtol=1e-11, atol=1e-12, max_step=end / 200)
    while time < end - 1e-13:
        part = solve_ivp(law, (time, end), y, args=(20.0 * inside,), events=Meets(inside), **how)
        time, y, inside = part.t[-1], part.y[:, -1], inside ^ (part.status == 1)
    return y[:2], y[2:].reshape(2, 2)


def distance_to_doubling(speed, state):
    """det(M + 1) of the orbit of `Stop` near a state."""
    for _ in range(8):
        end, m = image_by_pieces(speed, state)
        state = state - np.linalg.solve(m - np.eye(2), end - state)
    return np.linalg.det(image_by_pieces(speed, state)[1] + np.eye(2))


@pytest.mark.wide
def test_a_point_of_a_law_with_a_kink_is_as_certain_as_it_says():
    """By 4096, 8192 and 16384 steps it stays 2.1e-5 off: the kink is near an end that their steps share."""
    system = jc.ForcedOscillator(Stop(jnp.asarray(20.0), jnp.asarray(2.0)), coordinates=1)
    place = (2.1358412, 1.05068188), 0.88843
    exact = float(brentq(distance_to_doubling, 0.8884, 0.8885, (np.array(place[0]),), xtol=1e-11))  # pyright: ignore
    assert exact == pytest.approx(0.888435056, abs=1e-9)
    alone = jc.bifurcation(system, "period-doubling", place)
    branch = jc.branch(system, place, lower=0.88, upper=0.9)
    (on_branch,) = [p for p in branch.special if p.kind == "period-doubling"]
    for point in (alone, on_branch):
        assert point.status == "converged"
        assert abs(float(point.value) - exact) < 2 * float(point.error) < 1e-4
