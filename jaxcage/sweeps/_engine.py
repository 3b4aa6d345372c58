"""Runs lanes in chunks on all cores.

Each chunk of lanes is one call of one compiled program; a pool of threads takes the chunks in turn, which keeps every
core busy without asking the user to split devices, and lets slow chunks overlap fast ones. A chunk is padded to the
full size, so that the arithmetic of a lane does not depend on how many neighbours it has.
"""

import concurrent.futures
import os
from collections.abc import Callable, Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._types import LaneState
from ..analysis import Observation, Plan, StrobeLanes, observe
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem


CHUNK = 128
"""Lanes per call on a CPU: large enough to hide the cost of dispatch, small enough to stay in cache (measured by
`python -m benchmarks.chunks`)."""

Progress = Callable[[int, int], None]
"""Called with lanes done and lanes in all."""


@eqx.filter_jit
def _run_chunk(
    system: AbstractForcedSystem, method: AbstractMethod, plan: Plan, speed: Float[Array, " lanes"], y0: LaneState
) -> Observation:
    return observe(StrobeLanes.of(system, method, speed), y0, plan)


def cores() -> int:
    """Processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def _chunks(lanes: int, size: int) -> Iterator[slice]:
    return (slice(i, min(i + size, lanes)) for i in range(0, lanes, size))


def _padded(x: np.ndarray, size: int) -> np.ndarray:
    """Repeat the last lane up to `size` lanes."""
    return np.concatenate([x, np.repeat(x[-1:], size - x.shape[0], axis=0)])


def run_lanes(
    system: AbstractForcedSystem,
    method: AbstractMethod,
    plan: Plan,
    speed: Float[np.ndarray, " lanes"],
    y0: Float[np.ndarray, "lanes dim"],
    progress: Progress | None = None,
) -> Observation:
    """Observe lanes given by their speeds [rad/s] and initial states.

    **Returns:** `Observation` of NumPy arrays with the lanes last.
    """
    lanes = speed.shape[0]
    on_cpu = jax.default_backend() == "cpu"
    size = min(CHUNK, lanes) if on_cpu else lanes
    static = Plan(*map(int, plan))

    def work(part: slice) -> Observation:
        s, y = _padded(speed[part], size), _padded(y0[part], size)
        got = _run_chunk(system, method, static, jnp.asarray(s), tuple(jnp.asarray(c) for c in y.T))
        count = part.stop - part.start
        return Observation(*(np.asarray(x)[..., :count] for x in got))

    parts = list(_chunks(lanes, size))
    done = 0
    with concurrent.futures.ThreadPoolExecutor(cores() if on_cpu else 1) as pool:
        futures = [pool.submit(work, part) for part in parts]
        try:
            for future, part in zip(futures, parts, strict=True):
                future.result()
                done += part.stop - part.start
                if progress is not None:
                    progress(done, lanes)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return Observation(*(np.concatenate(x, axis=-1) for x in zip(*(f.result() for f in futures), strict=True)))
