"""The engine inside JAX, for methods and laws that have no machine code."""

import concurrent.futures
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._pytrees import Form, compiled, split
from ..models import AbstractForcedSystem, divide, multiply
from .method import AbstractMethod
from .outcomes import FINISHED, March
from .strobe_map import StrobeMap


if TYPE_CHECKING:
    from .engine import Lanes

UNIT, MOST = 8, 256
"""Granularity and maximum of the number of lanes per call: each size is compiled separately."""


@compiled
def _strobe(
    form: Form,
    several: bool,
    method: AbstractMethod,
    samples: int,
    own: Sequence[Array],
    shared: Sequence[Array],
    y: Float[Array, "lanes numbers"],
    tangents: Float[Array, "lanes tangents dim"],
    i: Int[Array, " lanes"],
) -> tuple[Array, Array, Array, Array]:
    """Advance lanes from the i-th to the next strobe state of a revolution, in units of their scales."""

    def lane(own: Any, y: Array, tangents: Array, i: Array) -> tuple[Array, Array, Array, Array]:
        speed, *numbers = own
        system = form.filled(numbers if several else shared)
        scale = system.scale(speed)
        state, row = lambda z: multiply(tuple(z), scale), lambda z: jnp.stack(divide(z, scale))
        strobe = StrobeMap(system.at_speed(speed), system, scale, method)
        moved = strobe.part(state(y), i, samples, [(state(t), None) for t in tangents])
        after = jnp.stack([row(t) for t in moved.tangents]) if moved.tangents else tangents
        return row(moved.y), after, jnp.asarray(moved.peak, dtype=float), moved.outcome

    return jax.vmap(lane)(list(own), y, tangents, i)


def _orthonormalised(
    tangents: Float[np.ndarray, "lanes tangents dim"],
) -> tuple[Float[np.ndarray, "lanes tangents dim"], Float[np.ndarray, "lanes tangents"]]:
    """Orthonormal tangent vectors, and the logarithms of the lengths that remain after each is projected.

    Gram-Schmidt with two projections: where a vector has nearly turned into those before it, its remaining length is
    several times more accurate than by Householder reflections. A length of zero is replaced by the rounding error.
    """
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
    """Integration loop of a model inside JAX, called like `Engine`; `samples` are strobe states per revolution."""

    def __init__(self, system: AbstractForcedSystem, tangents: int, several: bool, samples: int = 1):
        self._form, _ = split(system, eqx.is_inexact_array)
        self._several, self._tangents, self._samples = several, tangents, samples

    def numbers(self, lanes: "Lanes") -> Any:
        """Numbers of each lane, and those common to all."""
        rows = lanes.rows(np.arange(lanes.speed.size))
        return ([lanes.speed, *rows], []) if self._several else ([lanes.speed], [jnp.asarray(x) for x in rows])

    @staticmethod
    def picked(numbers: Any, lanes: Int[np.ndarray, " some"]) -> Any:
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
        tangents: Float[np.ndarray, "lanes tangents dim"] | None = None,
        step: Any = None,
        threads: int = 1,
        report: Callable[[float], None] = lambda done: None,
    ) -> March:
        """Run lanes like `Engine`, but with the first step chosen by the solver."""
        own, shared = numbers
        (lanes, dim), y, m = state.shape, state.copy(), self._tangents
        t = np.zeros((lanes, 0, dim)) if tangents is None else tangents.copy()
        strobe, growth = np.full((lanes, keep, dim), np.nan), np.full((lanes, strobes, m), np.nan)
        outcome, peaks = np.full(lanes, FINISHED), np.zeros(lanes)
        size = min(MOST, -(-lanes // (UNIT * threads)) * UNIT)
        first = np.broadcast_to(np.asarray(begin, dtype=int), lanes)

        def chunk(some: Int[np.ndarray, " some"], k: int) -> list[np.ndarray]:
            filled = np.concatenate([some, np.repeat(some[-1:], size - some.size)])
            given = [jnp.asarray(x[filled]) for x in own], shared, jnp.asarray(y[filled]), jnp.asarray(t[filled])
            i = jnp.asarray((first[filled] + k) % self._samples)
            out = _strobe(self._form, self._several, method.in_jax, self._samples, *given, i)
            return [np.asarray(x)[: some.size] for x in out]

        with concurrent.futures.ThreadPoolExecutor(threads) as pool:
            for k in range(strobes):
                alive = np.flatnonzero(outcome == FINISHED)
                if not alive.size:
                    break
                some = np.split(alive, range(size, alive.size, size))
                found = list(pool.map(lambda some, k=k: chunk(some, k), some))
                y1, t1, peak, outcome[alive] = (np.concatenate(x) for x in zip(*found, strict=True))
                peaks[alive] = np.maximum(peaks[alive], peak)
                well = outcome[alive] == FINISHED
                alive, y1, t1 = alive[well], y1[well], t1[well]
                y[alive], strobe[alive, k % keep] = y1, y1
                if m and alive.size:
                    t[alive], growth[alive, k] = _orthonormalised(t1)
                report(lanes * (k + 1) / strobes)
        latest_last, none = np.roll(strobe, -strobes % keep, axis=1), np.zeros(lanes)
        return March(y, t, none, peaks[:, None, None], none, outcome, latest_last, growth)
