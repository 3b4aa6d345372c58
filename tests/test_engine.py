"""The integration of lanes in machine code: operations, accuracy, independence of lanes, failures, the cache."""

import threading
import time
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxcage as jc
from jaxcage.solve import FINISHED, TOO_MANY, Engine, Lanes, engine_of, histories, say_once
from jaxcage.solve.object_code import object_code


def march(system: Any, speed: np.ndarray, y: np.ndarray, revolutions: int, tolerance: float = 1e-8, **more: Any) -> Any:
    method = jc.native(tolerance, pair=more.pop("pair", "tsit5"))
    engine = engine_of(system, 0, False, method)
    assert isinstance(engine, Engine)
    return engine(Lanes.of([system], speed), y, revolutions, revolutions, method, **more)


def begin(model: jc.CageModel, speed: np.ndarray, which: int = 0) -> np.ndarray:
    """An initial state of the model at each speed, over its scale."""
    rows = lambda of: np.array([[float(c) for c in of(jnp.asarray(v))] for v in speed])
    return rows(lambda v: model.initial_states(v)[which]) / rows(model.scale)


OPERATIONS = {
    "cubes": lambda x, z: jnp.cbrt(x) + jnp.cbrt(-z) + jnp.log2(2 + x * x),
    "slopes": lambda x, z: jax.grad(lambda a: jnp.tanh(a) * jnp.tan(0.3 * a))(x + z),
    "arithmetic": lambda x, z: (x + z) * (x - 2 * z) / (1 + z * z),
    "roots": lambda x, z: jnp.sqrt(1 + x * x) + jax.lax.rsqrt(2 + z * z) + jnp.hypot(x, z),
    "powers": lambda x, z: x**3 + (1 + z * z) ** -2 + (1 + x * x) ** (10 / 9),
    "waves": lambda x, z: jnp.sin(x) + jnp.cos(3 * z) + jnp.tanh(x * z) + jnp.arctan2(x, 1 + z * z),
    "growth": lambda x, z: jnp.exp(-x * x) + jnp.log(2 + z * z) + jnp.log1p(x * x) + jnp.expm1(-z * z),
    "sides": lambda x, z: jnp.where(x > z, jnp.abs(x), -z) + jnp.maximum(x, 0.1) + jnp.minimum(z, x) + jnp.sign(x),
    "clipped": lambda x, z: jnp.clip(x, -0.3, 0.2) + jnp.floor(4 * z) + jnp.round(3 * x),
    "masks": lambda x, z: jnp.where((x > 0) & ~(z > 0) | (x * z > 0.2), jnp.sqrt(jnp.abs(x)) ** 3 / (2 + z), 0.5 * x),
}


@pytest.mark.parametrize("name", OPERATIONS)
def test_operations_are_those_of_jax(name: str):
    """Two components stand still, two grow by a law of the first: after a revolution they are 2 pi times its value."""
    law = OPERATIONS[name]
    rates = lambda tau, y, speed: (0.0 * y[0], 0.0 * y[1], law(y[0], y[1]), law(y[1], y[0]))
    y = np.zeros((21, 4))
    y[:, :2] = np.random.default_rng(0).normal(size=(21, 2))
    found = march(jc.ForcedSystem(rates, 4), np.ones(21), y, 1).state[:, 2:] / (2 * np.pi)
    expected = np.stack([jax.vmap(law)(*y.T[:2]), jax.vmap(law)(y[:, 1], y[:, 0])], axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("pair", ["tsit5", "dopri5", "bosh3", "dopri8"])
def test_revolutions_are_those_of_scipy(pair: str):
    """Case 1a off and on its land, three revolutions."""
    model, speed = jc.case("1a"), np.array([4000.0, 13000.0, 24000.0]) * np.pi / 30
    y = begin(model, speed)
    found = march(model, speed, y, 3, tolerance=1e-9 if pair != "bosh3" else 1e-8, pair=pair)
    assert np.all(found.outcome == FINISHED)
    for i, v in enumerate(speed):
        field, scale = model.at_speed(jnp.asarray(v)), jnp.stack(model.scale(jnp.asarray(v)))
        rates = jax.jit(lambda tau, z, field=field, s=scale: jnp.stack(field(tau, tuple(z * s))) / s)
        exact = solve_ivp(lambda t, z: np.asarray(rates(t, z)), (0, 6 * np.pi), y[i], "DOP853", rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(found.state[i], exact.y[:, -1], rtol=0, atol=2e-5)
        np.testing.assert_array_equal(found.strobe[i, -1], found.state[i])


def test_tangents_grow_as_the_multipliers_of_a_linear_system():
    """x'' = -2 d x' - x at speed 1: both exponents are -2 pi d, and all strobe states decay so."""
    system = jc.ForcedOscillator(lambda tau, q, v, speed: (-0.2 * v[0] - q[0],), coordinates=1)
    found = jc.sweep(system, 1.0, discard=20, revolutions=100, exponents=2, confirm=False, horizon=0)
    np.testing.assert_allclose(found.exponents[0], -0.2 * np.pi, atol=1e-5)


def test_a_lane_does_not_depend_on_its_neighbours_or_threads():
    model = jc.case("1a")
    speed = jc.rpm(6000, 26000, 40)
    together, alone = (
        jc.sweep(model, v, discard=3, revolutions=20, confirm=False, horizon=0) for v in (speed, speed[17:18])
    )
    assert np.array_equal(together.last[17], alone.last[0]) and np.array_equal(
        together.block_growth[17], alone.block_growth[0]
    )
    one, two = (march(model, speed, begin(model, speed, 1), 10, threads=threads) for threads in (1, 2))
    assert np.array_equal(one.strobe, two.strobe) and np.array_equal(one.steps, two.steps)


def test_a_lane_that_fails_leaves_its_neighbours_alone():
    """NaN, a start outside, and an oscillator that blows up in finite time."""
    system = jc.ForcedOscillator(lambda tau, q, v, speed: (q[0] ** 3 - 0.1 * v[0],), coordinates=1)
    initial_states = np.array([[[0.1, 0.0]], [[np.nan, 0.0]], [[3.0, 1.0]], [[-0.1, 0.0]]])
    brief = dict(discard=0, revolutions=1, blocks=1)
    found = jc.sweep(system, np.array([1.0, 1.1, 1.2, 1.3]), initial_states=initial_states, **brief)
    names = found.outcome.values[:, 0]
    assert names[0] == names[3] == "successful" and names[1] == "not_finite" and names[2] != "successful"
    assert np.all(np.isfinite(found.last.values[[0, 3]])) and np.all(np.isnan(found.last.values[[1, 2]]))


class Polynomial(eqx.Module):
    """Stiffness by an array of coefficients."""

    c: jax.Array

    def __call__(self, tau: Any, q: Any, v: Any, speed: Any) -> Any:
        return (-v[0] - q[0] * (self.c[0] + self.c[1] * q[0] ** 2) + jnp.cos(tau),)


LAWS = {
    "bessel_i0e": lambda tau, q, v, speed: (-q[0] - v[0] + jax.scipy.special.i0e(q[0]) * jnp.cos(tau),),
    "array": Polynomial(jnp.array([1.0, 0.1])),
}


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_has_no_machine_code_is_run_by_jax_and_says_so(name: str):
    system = jc.ForcedOscillator(LAWS[name], coordinates=1)
    say_once.cache_clear()
    with pytest.warns(UserWarning, match=f"operation `{name}`, which has no machine code"):
        found = jc.sweep(system, 1.5, discard=20, revolutions=20, confirm=False, horizon=0)
    assert set(found.label.values.ravel()) == {"periodic-1"}


class Slow(jc.ForcedOscillator):
    steps = jc.ForcedOscillator.steps._replace(most=10.0)

    def slowness(self, speed: Any) -> Any:
        return jnp.where(speed < 1, 100.0, 1.0)


def test_a_slow_lane_gives_no_other_more_steps():
    system = Slow(lambda tau, q, v, speed: (jnp.cos(tau) - q[0] - 0.1 * v[0],), coordinates=1)
    outcomes = [
        march(system, np.array(speeds), np.zeros((len(speeds), 2)), 2).outcome for speeds in ([2.0], [0.5, 2.0])
    ]
    assert outcomes[0].tolist() == [TOO_MANY] and outcomes[1].tolist() == [FINISHED, TOO_MANY]


def test_equal_steps_between_samples_are_whole():
    model, speed = jc.case("1a"), jc.rpm(5000, 5000, 1)
    state = np.array([[float(c) for c in model.initial_states(speed[0])[0]]])
    found = [histories(Lanes.of([model], speed), state, 64, 1, jc.method("rk4", n))[0] for n in (1000, 1024)]
    np.testing.assert_array_equal(*found)


def test_histories_are_run_again_until_their_error_is_allowed():
    model, speeds = jc.case("1a"), jc.rpm(9000, 15000, 3)
    initial_states = np.array([[float(c) for c in model.initial_states(jnp.asarray(v))[0]] for v in speeds])
    lanes, rough = Lanes.of([model], speeds), jc.native(1e-3)
    (_, first), (states, error) = (
        histories(lanes, initial_states, 8, 2, method) for method in (rough, jc.native(1e-3, 1e-4))
    )
    assert np.any(first > 1e-4) and np.all(error <= 1e-4) and np.all(np.isfinite(states))


def test_damaged_code_is_compiled_again(tmp_path: Any, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("JAXCAGE_CACHE", str(tmp_path))
    ir = "define double @march(double %x) {\n  %y = fadd double %x, 1.0\n  ret double %y\n}\n"
    code = object_code(ir)
    (kept,) = (tmp_path / "native").iterdir()
    whole = kept.read_bytes()
    assert whole[32:] == code
    for damage in (whole[:-5], whole[:100] + b"x" + whole[101:], b""):
        kept.write_bytes(damage)
        assert object_code(ir) == code and kept.read_bytes() == whole


def test_an_interrupted_run_stops_within_a_second():
    model, speed = jc.case("1a"), jc.rpm(6000, 26000, 400)
    begun: list[float] = []

    def interrupt(done: int) -> None:
        if done > 16:
            begun.append(time.perf_counter())
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        march(model, speed, begin(model, speed), 1000, threads=2, report=interrupt)
    assert time.perf_counter() - begun[0] < 1 and threading.active_count() < 20


def test_steps_do_not_jump_over_the_land():
    """A cage thrown at its land: the steps end near the onset, so that a tolerance of 1e-4 finds the contact too."""
    model, speed = jc.case("1a"), np.full(50, jc.rpm(9000.0))
    y = np.array([[0.9 * np.cos(a), 0.9 * np.sin(a), 2 * np.cos(a), 2 * np.sin(a)] for a in np.linspace(0, 6, 50)])
    rough, fine = (march(model, speed, y, 1, tolerance) for tolerance in (1e-4, 1e-10))
    assert np.all(fine.peak > 0.97) and np.max(np.abs(rough.state - fine.state)) < 0.05
