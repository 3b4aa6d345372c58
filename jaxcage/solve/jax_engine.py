"""The engine inside JAX, for methods and laws that have no machine code."""

import concurrent.futures
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..models import AbstractForcedSystem, divide, multiply
from .method import AbstractMethod, StrobeMap
from .outcomes import FINISHED, March


if TYPE_CHECKING:
    from .engine import Lanes

TOGETHER = 64
"""Maximum number of lanes per call."""


class _Advance(eqx.Module):
    """Advance of a lane from the i-th to the next strobe state of a revolution, in units of its scale."""

    method: AbstractMethod
    samples: int

    def __call__(self, system: AbstractForcedSystem, speed: Array, y: Array, tangents: Array, i: Array) -> Any:
        scale = system.scale(speed)
        state, row = lambda z: multiply(tuple(z), scale), lambda z: jnp.stack(divide(z, scale))
        strobe = StrobeMap(system.at_speed(speed), system, scale, self.method)
        moved = strobe.part(state(y), i, self.samples, [(state(t), None) for t in tangents])
        after = jnp.stack([row(t) for t in moved.tangents]) if moved.tangents else tangents
        return row(moved.y), after, moved.peak, moved.outcome


class JaxEngine:
    """Integration loop inside JAX, called like `Engine` with lanes as their own numbers.

    **Arguments:** number of tangent vectors; strobe states per revolution.
    """

    def __init__(self, tangents: int, samples: int):
        self._tangents, self._samples = tangents, samples

    def numbers(self, lanes: "Lanes") -> "Lanes":
        return lanes

    @staticmethod
    def picked(lanes: Any, some: Int[np.ndarray, " some"]) -> Any:
        return lanes.at(some)

    def __call__(
        self,
        lanes: "Lanes",
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
        (count, dim), y, m = state.shape, state.copy(), self._tangents
        t = np.zeros((count, 0, dim)) if tangents is None else tangents.copy()
        strobe, growth = np.full((count, keep, dim), np.nan), np.full((count, strobes, m), np.nan)
        outcome, peaks = np.full(count, FINISHED), np.zeros(count)
        first, advance = np.broadcast_to(begin, count), _Advance(method.in_jax, self._samples)
        with concurrent.futures.ThreadPoolExecutor(threads) as pool:
            for k in range(strobes):
                alive = np.flatnonzero(outcome == FINISHED)
                if not alive.size:
                    break
                i = (first + k) % self._samples
                chunk = lambda some, i=i: lanes.each(advance, some, y[some], t[some], i[some])
                found = pool.map(chunk, np.split(alive, range(TOGETHER, alive.size, TOGETHER)))
                y1, t1, peak, outcome[alive] = (np.concatenate(x) for x in zip(*found, strict=True))
                peaks[alive] = np.maximum(peaks[alive], peak)
                well = outcome[alive] == FINISHED
                alive, y1, t1 = alive[well], y1[well], t1[well]
                y[alive], strobe[alive, k % keep] = y1, y1
                if m and alive.size:
                    q, r = np.linalg.qr(np.swapaxes(t1, 1, 2))
                    t[alive] = np.swapaxes(q, 1, 2)
                    growth[alive, k] = np.log(np.abs(np.diagonal(r, axis1=1, axis2=2)))
                report(count * (k + 1) / strobes)
        latest_last, none = np.roll(strobe, -strobes % keep, axis=1), np.zeros(count)
        return March(y, t, none, peaks[:, None, None], none, outcome, latest_last, growth)
