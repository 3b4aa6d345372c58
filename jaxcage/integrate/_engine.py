"""Lanes, each a design at a speed, and the engine that runs them: machine code, or JAX where there is none."""

import copy
import functools
import os
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._errors import ArgumentError
from .._form import split
from ..models import AbstractForcedSystem
from ..solve import Engine, UnknownOperation, room_for, say_once
from ._in_jax import EngineInJax
from ._method import AbstractMethod
from ._native import NativeSteps


SURE = 3.0
"""The stated error, as a multiple of the difference of two runs."""
RETRIES = 3
"""A lane whose error is too large is run again at most so many times, each with a tolerance 16 times smaller."""
CHUNK = 4096
"""Lanes that are run at a time, where a strobe state is kept of each sample."""
_engines: dict[Any, Engine | EngineInJax] = {}


def engine_of(
    system: AbstractForcedSystem, tangents: int, several: bool, method: AbstractMethod, samples: int = 1
) -> Engine | EngineInJax:
    """The engine that runs a system by a method is made once. A warning names an operation without machine code."""
    pair = method.pair if isinstance(method, NativeSteps) else None
    key = (split(system, eqx.is_inexact_array)[0], tangents, several, pair, samples)
    if key not in _engines and pair is not None:
        try:
            _engines[key] = Engine(system, tangents, several, pair, samples)
        except UnknownOperation as operation:
            say_once(str(operation))
    return _engines.setdefault(key, EngineInJax(system, tangents, several, samples))


def alike(designs: Sequence[Any], name: str, kind: str) -> list[Any]:
    """Designs with all numbers as arrays: a parameter may be a Python number in one and an array in another.

    **Raises:** `ValueError` for designs that differ in more than their numbers.
    """
    number = lambda x: jnp.asarray(x, dtype=float) if eqx.is_inexact_array_like(x) else x
    found = [jax.tree.map(number, design) for design in designs]
    rests = [eqx.filter(design, eqx.is_array, inverse=True) for design in found]
    if any(not eqx.tree_equal(rest, rests[0]) for rest in rests):
        raise ArgumentError(name, said=f"must hold {kind} that differ in their numbers only.")
    return found


def cores() -> int:
    """Processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


class Lanes:
    """Lanes by number: which design and which speed each has."""

    def __init__(
        self,
        designs: AbstractForcedSystem,
        count: int,
        which: Int[np.ndarray, " lanes"],
        speed: Float[np.ndarray, " lanes"],
    ):
        """`designs` is a system, or `count` of them with their arrays stacked."""
        number = lambda x: jnp.asarray(x, dtype=float) if eqx.is_inexact_array_like(x) else x
        self.form, rows = split(jax.tree.map(number, designs), eqx.is_inexact_array)
        self.several, self.which, self.speed = count > 1, which, speed
        self._rows = [np.asarray(x) for x in rows]
        self._every, self._place = (which, speed), np.arange(speed.size)
        self._numbers: dict[type, Any] = {}

    @classmethod
    def of(
        cls,
        systems: Sequence[AbstractForcedSystem],
        speed: Float[np.ndarray, " lanes"],
        which: Int[np.ndarray, " lanes"] | None = None,
    ) -> "Lanes":
        """**Raises:** `ValueError` for systems that differ in more than their numbers."""
        which = np.zeros(speed.size, int) if which is None else which
        if len(systems) == 1:
            return cls(systems[0], 1, which, speed)
        stacked = lambda *x: jnp.stack(x) if eqx.is_array(x[0]) else x[0]
        return cls(jax.tree.map(stacked, *alike(systems, "systems", "systems")), len(systems), which, speed)

    def at(self, some: Int[np.ndarray, " some"]) -> "Lanes":
        """Some of the lanes."""
        few = copy.copy(self)
        few.which, few.speed, few._place = self.which[some], self.speed[some], self._place[some]
        return few

    @property
    def system(self) -> AbstractForcedSystem:
        """One of the designs."""
        return self.form.filled([jnp.asarray(x[0] if self.several else x) for x in self._rows])

    def rows(self, lanes: Int[np.ndarray, " some"]) -> list[Any]:
        """Numbers of the designs of some lanes, or those that all have."""
        return [x[self.which[lanes]] for x in self._rows] if self.several else self._rows

    def numbers(self, engine: Engine | EngineInJax, some: Int[np.ndarray, " some"]) -> Any:
        """The numbers of some lanes as the engine takes them; they are worked out once for all lanes."""
        if type(engine) not in self._numbers:
            which, speed = self._every
            rows = [x[which] for x in self._rows] if self.several else self._rows
            self._numbers[type(engine)] = engine.numbers(speed, rows)
        return engine.picked(self._numbers[type(engine)], self._place[some])

    def engine(self, tangents: int, method: AbstractMethod, samples: int = 1) -> Engine | EngineInJax:
        """What runs these lanes with so many tangent vectors."""
        return engine_of(self.system, tangents, self.several, method, samples)

    def begin(
        self, some: Int[np.ndarray, " some"], y: Float[np.ndarray, "some dim"]
    ) -> tuple[Float[np.ndarray, "some dim"], Float[np.ndarray, " some"]]:
        """Scale of each of some lanes, and excursion of its state."""
        count = some.size
        room = room_for(count)
        filled = np.concatenate([some, np.broadcast_to(some[-1:], room - count)])
        states = np.concatenate([y, np.broadcast_to(y[-1:], (room - count, y.shape[1]))])
        scale, excursion = _scales(self.form, self.several)(self.speed[filled], self.rows(filled), states)
        return np.asarray(scale)[:count], np.asarray(excursion)[:count]


@functools.lru_cache(maxsize=32)
def _scales(form: Any, several: bool) -> Any:
    """Scales and excursions of lanes, by speed, numbers of the system and state."""

    def of(speed: Any, row: Any, y: Any) -> tuple[Any, Any]:
        system = form.filled(row)
        return jnp.stack([jnp.asarray(s, float) for s in system.scale(speed)]), jnp.asarray(system.excursion(tuple(y)))

    return jax.jit(jax.vmap(of, in_axes=(0, 0 if several else None, 0)))


def histories(
    lanes: Lanes,
    y0: Float[np.ndarray, "lanes dim"],
    samples: int,
    revolutions: int,
    method: AbstractMethod,
) -> tuple[Float[np.ndarray, "lanes samples dim"], Float[np.ndarray, " lanes"]]:
    """States of lanes at so many phases of each of some revolutions, the first where they begin, in SI units; and the
    largest error of a revolution [scale]. NaN where one begins nowhere, or fails. A lane whose error is larger than the
    method allows is run again with finer steps."""
    seen, error = _histories(lanes, y0, samples, revolutions, method)
    for retry in range(1, RETRIES + 1):
        todo = np.flatnonzero(error > method.allowed)
        if not todo.size:
            break
        seen[todo], error[todo] = _histories(lanes.at(todo), y0[todo], samples, revolutions, method.finer(retry))
    return seen, error


def _histories(
    lanes: Lanes, y0: Float[np.ndarray, "lanes dim"], samples: int, revolutions: int, method: AbstractMethod
) -> tuple[Float[np.ndarray, "lanes samples dim"], Float[np.ndarray, " lanes"]]:
    """The same by one method."""
    count, total = lanes.speed.size, samples * revolutions
    seen, error = np.full((count, total, y0.shape[1]), np.nan), np.full(count, np.nan)
    for first in range(0, count, CHUNK // samples + 1):
        some = np.arange(first, min(first + CHUNK // samples + 1, count))
        some = some[np.all(np.isfinite(y0[some]), axis=1)]
        if not some.size:
            continue
        scale, _ = lanes.begin(some, y0[some])
        engine = lanes.engine(0, method, samples)
        numbers = lanes.numbers(engine, some)
        ran = engine(numbers, y0[some] / scale, total, total, method, threads=cores())
        states = np.concatenate([(y0[some] / scale)[:, None], ran.strobe], axis=1)
        error[some] = sampled_error(engine, numbers, states, samples, method).max(axis=1)
        seen[some] = states[:, :-1] * scale[:, None, :]
    return seen, error


def sampled_error(
    engine: Engine | EngineInJax,
    numbers: Any,
    states: Float[np.ndarray, "lanes n dim"],
    samples: int,
    method: AbstractMethod,
) -> Float[np.ndarray, "lanes revolutions"]:
    """Error of each revolution: the sum of those of its parts, each three times the distance of its end from that by
    the method's reference, and the tolerance at least. Of states in units of the scale, the first at phase 0."""
    count, n = states.shape[0], states.shape[1] - 1
    repeated = engine.picked(numbers, np.repeat(np.arange(count), n))
    begin = np.tile(np.arange(n) % samples, count)
    starts = states[:, :-1].reshape(count * n, -1)
    sharper = engine(repeated, starts, 1, 1, method.reference, threads=cores(), begin=begin).state
    apart = SURE * np.max(np.abs(sharper.reshape(count, n, -1) - states[:, 1:]), axis=2)
    padded = np.pad(apart, ((0, 0), (0, -n % samples)))
    return np.maximum(padded.reshape(count, -1, samples).sum(axis=2), getattr(method, "tolerance", 0.0))
