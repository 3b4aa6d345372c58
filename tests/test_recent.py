"""Programs that have not been used for long are dropped, with the memory maps that they hold."""

import gc
import pathlib
from typing import Any

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
