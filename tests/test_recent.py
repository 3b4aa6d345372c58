"""Programs that have not been used for long are dropped, with the memory maps that they hold."""

import gc
import pathlib
import threading
import weakref
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.extend as jex
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage import _recent


Recent, jitted = _recent.Recent, _recent.jitted
MAPS = pathlib.Path("/proc/self/maps")
needs_maps = pytest.mark.skipif(not MAPS.exists(), reason="only Linux says which memory maps a process has")


def maps() -> int:
    gc.collect()
    return MAPS.read_bytes().count(b"\n")


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> _recent.Recent:
    """A process that keeps four programs."""
    kept = Recent(4)
    monkeypatch.setattr(_recent, "programs", kept)
    return kept


def test_what_was_asked_for_last_stays():
    kept = Recent(2)
    made = []
    get = lambda key: kept.get(key, lambda: made.append(key) or key.upper())
    assert [get(key) for key in "ababcac"] == list("ABABCAC")
    assert made == ["a", "b", "c", "a"] and len(kept) == 2  # a went when c came, and b when a came again


def test_two_threads_have_one_thing():
    kept, started = Recent(2), threading.Barrier(2)

    def make() -> object:
        started.wait(10)  # both are making it
        return object()

    found: list[object] = []
    both = [threading.Thread(target=lambda: found.append(kept.get("a", make))) for _ in range(2)]
    for each in both:
        each.start()
    for each in both:
        each.join()
    assert found[0] is found[1] and len(kept) == 1


class Law(eqx.Module):
    f: Callable[..., Any]
    scale: Any


@jitted
def applied(law: Law, x: jax.Array, *, twice: bool = False) -> tuple[Law, jax.Array]:
    y = law.f(law.scale * x)
    return law, law.f(y) if twice else y


def sines(frequency: float) -> Law:
    return Law(lambda x: jnp.sin(frequency * x), 1.0)


def test_it_is_the_function():
    law, x = sines(2.0), np.linspace(0.0, 1.0, 3)
    same, found = applied(law, x)
    assert same.f is law.f and same.scale == 1.0 and np.allclose(found, np.sin(2 * x))
    assert np.allclose(applied(law, x, twice=True)[1], np.sin(2 * np.sin(2 * x)))
    assert applied(law, 0.5)[1].shape == () and applied(law, jnp.ones((2, 2)))[1].shape == (2, 2)
    slope = jax.grad(lambda s: applied(Law(law.f, s), jnp.asarray(0.3))[1])(1.5)
    assert np.isclose(slope, 0.6 * np.cos(0.9))
    assert np.allclose(jax.vmap(lambda s: applied(Law(law.f, s), jnp.asarray(0.3))[1])(x), np.sin(0.6 * x))


@pytest.mark.wide
def test_old_programs_are_dropped_with_their_laws(few: _recent.Recent):
    def used(frequency: float) -> weakref.ref:
        law = sines(frequency)
        assert np.allclose(applied(law, np.ones(5))[1], np.sin(frequency))
        return weakref.ref(law.f)

    laws = [used(1.0 + n) for n in range(12)]
    gc.collect()
    assert len(few) == 4 and [ref() is None for ref in laws] == [True] * 8 + [False] * 4


@pytest.mark.wide
@needs_maps
def test_memory_maps_stay_as_they_are(few: _recent.Recent):
    """Without dropping, each of them holds a few for good."""
    for n in range(4):
        applied(sines(0.5 + n), np.ones(3))
    before = maps()
    for n in range(8):
        applied(sines(0.7 + n), np.ones(3))
    assert maps() - before <= 4


@needs_maps
@pytest.mark.wide
def test_memory_stays_as_it_is_over_laws_of_ones_own(few: _recent.Recent):
    """A sweep takes several programs of some 90 maps each, and JAX keeps what it traces on the way."""

    def law(height: float) -> jc.ForcedOscillator:
        return jc.ForcedOscillator(
            lambda tau, q, v, speed: (-0.1 * v[0] - q[0] - q[0] ** 3 + height * jnp.cos(tau),), coordinates=1
        )

    at, traced = [], []
    for n in range(9):
        options: dict[str, Any] = dict(discard=4, revolutions=4, blocks=2, confirm=False, horizon=0)
        jc.sweep(law(0.3 + 0.01 * n), np.array([1.1]), method=jc.method("rk4", steps=16), **options)
        at.append(maps())
        traced.append(sum(isinstance(x, jex.core.Jaxpr) for x in gc.get_objects()))
    assert max(at[5:]) - max(at[:5]) < 60, at
    assert max(traced[5:]) <= max(traced[:5]), traced


@pytest.mark.wide
def test_runs_of_one_size_of_chunks_share_their_programs(monkeypatch: pytest.MonkeyPatch):
    """Some lanes again, in chunks with room for all of them: nothing is compiled anew, and they do the same."""
    monkeypatch.setattr(_recent, "programs", programs := Recent(16))
    hardening = jc.ForcedOscillator(
        lambda tau, q, v, speed: (-0.1 * v[0] - q[0] - q[0] ** 3 + 0.3 * jnp.cos(tau),), coordinates=1
    )
    method = jc.method("rk4", steps=128)
    speeds, plan = np.linspace(1.0, 1.4, 40), jc.analysis.Plan(8, 4, 2, 4, 1)
    states = np.tile([0.4, 0.3], (40, 1))
    run = lambda lanes: jc.sweeps.run_lanes(hardening, method, plan, speeds[lanes], states[lanes], size=48)
    every, some = run(np.arange(40)), run(np.arange(3, 30, 2))
    assert len(programs) == 2 and np.all(every.outcome == 0)
    for here, there in zip(some, every, strict=True):
        np.testing.assert_array_equal(here, there[..., 3:30:2])
