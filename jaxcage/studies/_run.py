"""Runs a study: chunk after chunk of its lanes into a store, in this process or on a cluster, from where it stopped."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from ..models import CAGE_STARTS, AbstractForcedSystem, BearingModel
from ..solve import AbstractMethod, native
from ..sweeps import Progress
from ._plan import LANES, Plan
from ._store import Store, open_study
from ._stored import AbstractStudy
from ._study import Study
from ._vary import Spread
from ._whole_study import WHOLE_LANES, WHOLE_TOLERANCE, BearingStudy


if TYPE_CHECKING:
    import xarray as xr

Vary = Mapping[str, Float[Array, " values"] | Float[np.ndarray, " values"] | Spread]
"""Parameter, or `"speed"` or `"oil"` -> values that make an axis of the grid [SI], or how to sample it."""
Shard = tuple[int, int]
"""(i, n): the i-th of n parts, counted from 1."""


def study(
    system: AbstractForcedSystem | BearingModel,
    vary: Vary,
    *,
    store: str | Path,
    samples: int = 0,
    seed: int = 0,
    starts: int | None = None,
    discard: int = 300,
    revolutions: int = 300,
    blocks: int = 20,
    exponents: int = 1,
    strobe: int = 0,
    method: AbstractMethod | None = None,
    tolerance: float | None = None,
    lanes: int | None = None,
    shard: Shard = (1, 1),
    executor: Literal["local", "dask"] = "local",
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    name: str = "",
    version: str = "",
) -> "xr.Dataset":
    """Run a system over any grid or sample of its parameters, and keep what each lane does in a zarr folder.

    What is stored already is not computed again: after a kill the same call continues where it stopped, and the store
    ends up with the same bits as that of an unbroken run, whichever processes computed it.

    **Arguments:**

    - `system`: any `AbstractForcedSystem`, or a whole bearing, of which measures are kept as in `BearingSweep`.
    - `vary`: what is varied. Arrays are axes of a grid [SI]; `Between` and `Tolerance` are sampled together. The speed
        [rad/s] must be among them, of a whole bearing the shaft's, as an axis; `oil`, for cages, is the ISO VG grade of
        a mineral oil.
    - `store`: the folder.
    - `samples`, `seed`: number of samples (a scrambled Sobol sequence; best a power of 2) and seed.
    - `starts`: how many of the system's own starts are run at each point, by default all.
    - `discard`, `revolutions`, `blocks`, `exponents`, `method`: as for `sweep`.
    - `strobe`: strobe states stored of each lane of a cage, by default none.
    - `tolerance`: of a whole bearing, as for `sweep_bearing`, 1e-4 if left out; a cage has it in its `method`.
    - `lanes`: lanes of a chunk, at most; 2048 if left out, 48 of a whole bearing.
    - `shard`: (i, n) runs every n-th chunk from the i-th on. All shards write to the same folder.
    - `executor`: `"local"` runs on all cores of this process, `"dask"` on a dask.distributed cluster.
    - `scheduler`, `workers`: address of the scheduler of a cluster, by default one of its own with so many processes.
    - `progress`: called with lanes done and lanes in all, those that were stored before included.
    - `name`, `version`: of a function or class of your own that the system is made of. They must be given then, since
        a store cannot tell by itself whether your code is still the same: change the version whenever it changes.

    **Returns:** the store, opened by xarray: variables over the samples, the axes of the grid and `start`.

    **Raises:** `ValueError` for arguments that do not fit together, and for a store of another study; `ImportError`
    without dask.
    """
    require_x64()
    whole = isinstance(system, BearingModel)
    sampled: dict[str, Spread] = {each: how for each, how in vary.items() if isinstance(how, Spread)}
    grid = {each: np.asarray(x, dtype=float) for each, x in vary.items() if each not in sampled}
    own = len(CAGE_STARTS if whole else system.starts(1.0)) if starts is None else starts
    most = (WHOLE_LANES if whole else LANES) if lanes is None else lanes
    plan = Plan(grid, sampled, samples, seed, own, most)
    if whole:
        if strobe or method is not None:
            raise ArgumentError("strobe", "method", said="must be left out for a whole bearing.")
        error = WHOLE_TOLERANCE if tolerance is None else tolerance
        about = BearingStudy(system, plan, discard, revolutions, blocks, exponents, error, name, version)
    else:
        if tolerance is not None:
            raise ArgumentError("tolerance", said="goes with a whole bearing; of other systems the `method` has it.")
        chosen = native() if method is None else method
        about = Study(system, plan, chosen, discard, revolutions, blocks, exponents, strobe, name, version)
    run_study(about, store, shard, executor, scheduler, workers, progress)
    return open_study(store)


def run_study(
    about: AbstractStudy,
    path: str | Path,
    shard: Shard = (1, 1),
    executor: str = "local",
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Compute what the store at `path` lacks; arguments as for `study`."""
    i, n = shard
    if not 1 <= i <= n:
        raise ArgumentError("shard", said=f"must be (i, n) with i from 1 to n, but ({i}, {n}) was given.")
    if executor not in ("local", "dask"):
        raise ArgumentError("executor", said=f"must be local or dask, but {executor!r} was given.")
    if workers is not None:
        require_at_least(1, workers=workers)
    store = Store(path, about)
    part = range(about.plan.chunks)[i - 1 :: n]
    mine, pending = set(part), store.pending(part)
    size = {chunk: about.plan.lanes_of(chunk).size for chunk in mine}
    done, total = sum(size[c] for c in mine - set(pending)), sum(size.values())
    report = progress or (lambda done, total: None)
    report(done, total)
    if executor == "dask":
        from ._dask import chunks_on_dask  # needs an extra

        computed = chunks_on_dask(about, pending, scheduler, workers)
    else:
        computed = ((chunk, about.chunk(chunk)) for chunk in pending)
    for chunk, results in computed:
        store.write(chunk, results)
        done += size[chunk]
        report(done, total)
    left = set(store.pending())
    if left & mine:
        raise RuntimeError(f"{len(left & mine)} of {len(mine)} chunks did not come back.")
    if not left:
        store.tidy()
