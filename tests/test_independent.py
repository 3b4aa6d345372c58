"""The package against the same equations written a second time, solved by SciPy and NumPy."""

import functools

import equinox as eqx
import independent
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxcage.integrate import method, strobe_map
from jaxcage.models import case
from jaxcage.sweeps import rpm, sweep


def stacked(state):
    return jnp.stack([jnp.asarray(c) for c in state])


def random_states(speed, count, reach):
    rng = np.random.default_rng(11)
    eps, phi = rng.uniform(0.05, reach, count), rng.uniform(-np.pi, np.pi, count)
    velocities = rng.normal(scale=0.3, size=(2, count))
    relative = np.stack([eps * np.cos(phi), eps * np.sin(phi), *velocities])
    return (relative * independent.scale(speed)[:, None]).T


def test_rates_agree_inside_and_beyond_the_onset_of_contact():
    """The package regularises the half film at the centre over 2e-6 of the clearance."""
    model = case("1a", "preliminary")
    for speed in (400.0, 1500.0, 2800.0):
        field = eqx.filter_jit(model.at_speed(speed))
        for state in random_states(speed, 12, 1.1):
            found = np.asarray(stacked(field(0.7, tuple(map(jnp.asarray, state)))))
            expected = independent.rates(0.7, state, speed)
            unit = independent.scale(speed)
            np.testing.assert_allclose(found / unit, expected / unit, rtol=1e-8, atol=1e-8)


def test_one_revolution_agrees_from_every_start_of_the_model():
    model, speed = case("1a", "preliminary"), float(rpm(9500.0))
    one = eqx.filter_jit(lambda y: strobe_map(model, speed, method(tolerance=1e-10))(y))
    for start in model.starts(speed):
        end = one(start)
        expected = independent.strobe([float(c) for c in start], speed)
        unit = independent.scale(speed)
        np.testing.assert_allclose(stacked(end.y) / unit, expected / unit, atol=1e-8)


PERIODIC_RPM = 13500.0, 15000.0, 16500.0, 18000.0, 19500.0


@functools.cache
def orbits():
    """Strobe states of period-1 orbits by the package: settled, then Newton at 1024 steps."""
    model, speeds = case("1a", "preliminary"), np.array(PERIODIC_RPM) * np.pi / 30
    settled = sweep(model, speeds, starts=[model.starts(1.0)[0]], discard=300, revolutions=40)
    assert np.all(settled.label == "periodic-1")
    fine = method("rodas4", steps=1024)

    def newton(speed, y):
        unit = stacked(model.scale(speed))

        def image(z):
            return stacked(strobe_map(model, speed, fine)(tuple(z * unit)).y) / unit

        def iterate(_, z):
            return z - jnp.linalg.solve(jax.jacfwd(image)(z) - jnp.eye(4), image(z) - z)

        z = jax.lax.fori_loop(0, 3, iterate, y / unit)
        return z * unit, jnp.abs(image(z) - z).max()

    found, defect = jax.jit(jax.vmap(newton))(jnp.asarray(speeds), jnp.asarray(settled.last[:, 0]))
    assert np.max(defect) < 1e-11
    return settled.last[:, 0], np.asarray(found)


@pytest.mark.wide
@pytest.mark.parametrize("solver", ["LSODA", "Radau"])
@pytest.mark.parametrize("index", range(len(PERIODIC_RPM)))
def test_strobe_states_of_periodic_motion(index, solver):
    settled, exact = orbits()
    speed = PERIODIC_RPM[index] * np.pi / 30
    unit = independent.scale(speed)
    if solver == "LSODA":
        found, correction = independent.periodic_orbit(settled[index], speed)
        assert correction < 1e-7
        np.testing.assert_allclose(found / unit, exact[index] / unit, rtol=0, atol=1e-6)
    else:
        # A fixed point of one solver's map is one of the other's.
        image = independent.strobe(exact[index], speed, "Radau")
        np.testing.assert_allclose(image / unit, exact[index] / unit, rtol=0, atol=1e-6)


@pytest.mark.wide
@pytest.mark.parametrize("index", range(len(PERIODIC_RPM)))
def test_default_steps_reach_the_same_periodic_motion(index):
    """The library's own 128 steps a revolution, against SciPy: 1e-4 of the clearance."""
    settled, exact = orbits()
    unit = independent.scale(PERIODIC_RPM[index] * np.pi / 30)
    np.testing.assert_allclose(settled[index] / unit, exact[index] / unit, rtol=0, atol=1e-4)


CHAOTIC_RPM = 10250.0, 24500.0
LANES = 250


@functools.cache
def chaos():
    """Exponents with standard errors by the package and by NumPy, for every chaotic speed."""
    model, speeds = case("1a", "preliminary"), np.array(CHAOTIC_RPM) * np.pi / 30
    rng = np.random.default_rng(0)
    reach = np.array([0.6, 0.6, 0.3, 0.3]) * independent.scale(1500.0)
    starts = [tuple(map(float, s)) for s in rng.uniform(-1, 1, (12, 4)) * reach]
    seen = sweep(model, speeds, starts=starts, discard=150, revolutions=400, keep=400, horizon=0)
    ours, states = [], []
    for k in range(speeds.size):
        chaotic = seen.label[k] == "chaotic"
        assert np.sum(chaotic) >= 8  # at the last speed a periodic orbit takes some of the starts
        error = np.sqrt(np.sum(seen.standard_error[k, chaotic, 0] ** 2)) / np.sum(chaotic)
        ours.append((np.mean(seen.exponents[k, chaotic, 0]), error))
        # Points of the attractor, from all of the run because its memory is long; then moved by
        # 2 % of the clearance so that no two lanes are stretches of one trajectory.
        pool = seen.strobe[k, chaotic].reshape(-1, 4)
        picked = pool[rng.integers(0, len(pool), LANES)].T
        moved = 0.02 * independent.scale(speeds[k])[:, None] * rng.normal(size=(4, LANES))
        states.append(picked + moved)
    omega = np.repeat(speeds, LANES)
    found = independent.lyapunov_exponents(np.concatenate(states, axis=1), omega, 30, 20)
    lanes = found.reshape(speeds.size, LANES)
    theirs = zip(lanes.mean(1), lanes.std(1, ddof=1) / np.sqrt(LANES), strict=True)
    return list(zip(ours, theirs, strict=True))


@pytest.mark.wide
@pytest.mark.parametrize("index", range(len(CHAOTIC_RPM)))
def test_largest_exponent_of_chaotic_motion(index):
    (ours, our_error), (theirs, their_error) = chaos()[index]
    assert our_error <= 0.01 and their_error <= 0.01
    assert abs(ours - theirs) <= 3 * np.hypot(our_error, their_error)
    assert ours > 0.2  # no test of zero against zero


@pytest.mark.wide
def test_numpy_tangent_dynamics_against_the_multipliers_of_an_orbit():
    """The reference itself: on a periodic orbit its exponent is the logarithm of the multiplier."""
    _, exact = orbits()
    speed, unit = PERIODIC_RPM[1] * np.pi / 30, independent.scale(PERIODIC_RPM[1] * np.pi / 30)
    h = 1e-5
    columns = [
        (independent.strobe(exact[1] + h * e, speed) - independent.strobe(exact[1] - h * e, speed)) / (2 * h)
        for e in np.diag(unit)
    ]
    matrix = np.stack(columns, axis=1) / unit[:, None]
    largest = np.log(np.abs(np.linalg.eigvals(matrix)).max())
    state, omega = np.repeat(exact[1][:, None], 64, axis=1), np.full(64, speed)
    found = independent.lyapunov_exponents(state, omega, 20, 30)
    # A complex pair turns: over 30 revolutions and 64 directions the mean is good to a percent.
    assert found.mean() == pytest.approx(largest, abs=0.02)
