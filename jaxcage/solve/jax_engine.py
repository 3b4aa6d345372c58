"""The engine inside JAX, for methods and laws that have no machine code."""

import concurrent.futures
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._pytrees import Form, compiled, split
from ..models import AbstractForcedSystem, divide, multiply
from .method import REVOLUTION, AbstractMethod, moved_by
from .outcomes import MARKS, OUTCOMES, March
from .strobe_map import StrobeMap


UNIT, MOST = 8, 256
"""Lanes of a call are a multiple of the first, up to the second: each size is compiled by itself."""


@compiled
def _strobe(
    form: Form,
    several: bool,
    method: AbstractMethod,
    own: Sequence[Array],
    shared: Sequence[Array],
    y: Float[Array, "lanes numbers"],
    tangents: Float[Array, "lanes tangents dim"],
    i: Int[Array, " lanes"],
    parts: int | Float[Array, " lanes"],
) -> tuple[Array, Array, Array, Array]:
    """Lanes over the i-th of a number of parts of a revolution, in units of their scales."""

    def lane(own: Any, y: Array, tangents: Array, i: Array, parts: Any) -> tuple[Array, Array, Array, Array]:
        speed, *numbers = own
        system = form.filled(numbers if several else shared)
        field, scale = system.at_speed(speed), system.scale(speed)
        strobe = StrobeMap(field, system, scale, method)
        state = lambda row: multiply(tuple(row), scale)
        moved: Any = moved_by(lambda z: strobe.part(z, i, parts), state(y), [state(t) for t in tangents])
        row = lambda z: jnp.stack(divide(z, scale))
        after = jnp.stack([row(t) for t in moved.tangents]) if moved.tangents else tangents
        return row(moved.y), after, moved.peak, moved.outcome

    if isinstance(parts, int):
        return jax.vmap(lambda own, y, tangents, i: lane(own, y, tangents, i, parts))(list(own), y, tangents, i)
    return jax.vmap(lane)(list(own), y, tangents, i, parts)


def _orthonormalised(
    tangents: Float[np.ndarray, "lanes tangents dim"],
) -> tuple[Float[np.ndarray, "lanes tangents dim"], Float[np.ndarray, "lanes tangents"]]:
    """Gram and Schmidt's method, each vector projected twice, and the logarithms of the lengths that are left: of a
    vector that has turned into those before it, of the rounding."""
    done, lengths = np.zeros_like(tangents), np.zeros(tangents.shape[:2])
    for i in range(tangents.shape[1]):
        u = tangents[:, i]
        least = np.finfo(float).eps * np.linalg.norm(u, axis=1) + np.finfo(float).tiny
        for j in [*range(i)] * 2:
            u = u - np.sum(u * done[:, j], axis=1, keepdims=True) * done[:, j]
        lengths[:, i] = np.linalg.norm(u, axis=1)
        lost = lengths[:, i] == 0
        u, lengths[lost, i] = np.where(lost[:, None], least[:, None], u), least[lost]
        done[:, i] = u / np.linalg.norm(u, axis=1, keepdims=True)
    return done, np.log(lengths)


class JaxEngine:
    """The revolutions of a model inside JAX, with a number of tangent vectors; called as the engine in machine code."""

    def __init__(self, system: AbstractForcedSystem, tangents: int, several: bool, samples: int = 1):
        """`samples` is the number of strobe states of a revolution."""
        self._form, _ = split(system, eqx.is_inexact_array)
        self._several, self._tangents, self._samples = several, tangents, samples

    def numbers(self, speeds: Float[np.ndarray, " lanes"], rows: Sequence[Any]) -> Any:
        """The numbers that lanes have of their own, and those that all share."""
        own = [np.asarray(speeds), *(map(np.asarray, rows) if self._several else ())]
        return own, [] if self._several else [jnp.asarray(x) for x in rows]

    @staticmethod
    def picked(numbers: Any, lanes: Int[np.ndarray, " some"]) -> Any:
        """The numbers of some lanes."""
        return [x[lanes] for x in numbers[0]], numbers[1]

    def __call__(
        self,
        numbers: Any,
        state: Float[np.ndarray, "lanes numbers"],
        strobes: int,
        keep: int,
        method: AbstractMethod,
        *,
        begin: Any = 0,
        turn: Any = None,
        tangents: Float[np.ndarray, "lanes tangents dim"] | None = None,
        step: Any = None,
        threads: int = 1,
        report: Callable[[int], None] = lambda done: None,
    ) -> March:
        """Run lanes as `Engine` does; the solver chooses its first step itself."""
        own, shared = numbers
        lanes, dim = state.shape
        chosen, y, m = method.in_jax, state.copy(), self._tangents
        t = np.zeros((lanes, 0, dim)) if tangents is None else tangents.copy()
        strobe, growth = np.full((lanes, keep, dim), np.nan), np.full((lanes, strobes, m), np.nan)
        mark, peaks, size = np.zeros(lanes), np.zeros(lanes), min(MOST, -(-lanes // (UNIT * threads)) * UNIT)
        first = np.broadcast_to(np.asarray(begin, dtype=int), lanes)
        parts = None if turn is None else np.broadcast_to(REVOLUTION / np.asarray(turn, dtype=float), lanes)

        def chunk(some: Int[np.ndarray, " some"], k: int) -> list[np.ndarray]:
            filled = np.concatenate([some, np.repeat(some[-1:], size - some.size)])
            given = [jnp.asarray(x[filled]) for x in own], shared, jnp.asarray(y[filled]), jnp.asarray(t[filled])
            i = jnp.asarray((first[filled] + k) % self._samples)
            some_parts = self._samples if parts is None else jnp.asarray(parts[filled])
            out = _strobe(self._form, self._several, chosen, *given, i, some_parts)
            return [np.asarray(x)[: some.size] for x in out]

        with concurrent.futures.ThreadPoolExecutor(threads) as pool:
            for k in range(strobes):
                alive = np.flatnonzero(mark == 0)
                if not alive.size:
                    break
                some = np.split(alive, range(size, alive.size, size))
                found = list(pool.map(lambda some, k=k: chunk(some, k), some))
                y1, t1, peak, codes = (np.concatenate(x) for x in zip(*found, strict=True))
                lost = codes != 0
                mark[alive[lost]] = [MARKS[OUTCOMES[code]] for code in codes[lost]]
                peaks[alive] = np.maximum(peaks[alive], peak)
                alive, y1, t1 = alive[~lost], y1[~lost], t1[~lost]
                y[alive], strobe[alive, k % keep] = y1, y1
                if m and alive.size:
                    t[alive], growth[alive, k] = _orthonormalised(t1)
                report(int(lanes * (k + 1) / strobes))
        mark[mark == 0] = MARKS["successful"]
        latest_last, none = np.roll(strobe, -strobes % keep, axis=1), np.zeros(lanes)
        return March(y, t, none, peaks[:, None, None], none, mark, latest_last, growth)
