"""Studies: lanes over any parameters, computed chunk by chunk into a store, which an interrupted run can resume."""

import contextlib
import dataclasses
import functools
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from .._arguments import require_at_least, require_x64
from .._errors import ArgumentError, Stop
from ..analysis import LONGEST_PERIOD
from ..files import Range
from ..models import AbstractForcedSystem
from .grid import LANES, Grid
from .observe import Progress
from .run import run_lanes
from .settings import Run
from .store import Results, Store, Study, open_study, stored


CLOSING = 2 * LONGEST_PERIOD
"""Number of strobe states kept, enough to detect the longest period."""


Vary = Mapping[str, Float[Array, " values"] | Float[np.ndarray, " values"] | Range]
"""Mapping of parameter names, `"speed"` or `"oil"` to values [SI], an axis of the grid, or to a distribution."""
Shard = tuple[int, int]
"""Part (i, n): the i-th of n parts, counted from 1."""


def study(
    model: AbstractForcedSystem,
    vary: Vary,
    *,
    store: str | Path,
    samples: int = 0,
    seed: int = 0,
    initial_states: int | None = None,
    lanes: int | None = None,
    shard: Shard = (1, 1),
    progress: Progress | None = None,
    name: str = "",
    version: str = "",
    **settings: Any,
) -> xr.Dataset:
    """Run a model over any grid or sample of its parameters, and store the results of each lane in a zarr folder.

    Stored results are not computed again: after an interruption the same call resumes, and the store ends up with the
    same bits as after an uninterrupted run, whichever processes computed it.

    **Arguments:**

    - `model`: a cage, a whole bearing or a system of your own.
    - `vary`: parameters by name. Arrays are axes of a grid [SI]; all `jaxcage.files.Range` are sampled together,
        those of more than a decade by their logarithms. The speed [rad/s], of the shaft for a whole bearing, must be
        among them; `oil` is the ISO VG grade of a mineral oil.
    - `store`: the folder.
    - `samples`, `seed`: number of samples (a scrambled Sobol sequence; preferably a power of 2) and seed.
    - `initial_states`: number of the model's own initial states to run at each point, by default all.
    - `lanes`: maximum number of lanes per chunk; by default 2048, or fewer for models with expensive lanes.
    - `shard`: (i, n) runs every n-th chunk from the i-th on. All shards write to the same folder.
    - `progress`: function called with the numbers of finished and of all lanes, including those already stored. If it
        raises `jaxcage.lanes.Stop`, the results so far are returned.
    - `name`, `version`: name and version of your own code, required if the model contains a function or class of your
        own, since a store cannot detect that it has changed: change the version whenever the code changes.
    - `settings`: fields of `jaxcage.lanes.Run`; lanes are neither confirmed nor followed to a horizon.

    **Returns:** the store, opened by xarray: variables over the samples, the axes of the grid and `initial_state`.

    **Raises:** `ValueError` for arguments that do not fit together, and for a store of another study; `RuntimeError`
    without double precision.
    """
    require_x64()
    sampled: dict[str, Range] = {each: how for each, how in vary.items() if isinstance(how, Range)}
    axes = {each: np.asarray(x, dtype=float) for each, x in vary.items() if each not in sampled}
    own = len(model.initial_states(1.0)) if initial_states is None else initial_states
    most = lanes or (LANES if model.samples == 1 else LANES // 42)
    run = Run.of(model, **{"keep": CLOSING, **settings, "confirm": False, "horizon": 0})
    about = Study(model, Grid(axes, sampled, samples, seed, own, most), run, name, version)
    with contextlib.suppress(Stop):
        run_study(about, store, shard, progress)
    return open_study(store)


def _chunk(about: Study, number: int, progress: Progress) -> Results:
    """Compute the results of a chunk; a lane's bits do not depend on the chunk."""
    lanes = about.grid.lanes_of(number)
    found = run_lanes(about.grid.plan(about.model, lanes), about.run, progress)
    if found.sizes["lane"] < lanes.size:
        raise Stop
    return {str(name): x.values for name, x in stored(found, about.model).items()}


def run_study(about: Study, path: str | Path, shard: Shard = (1, 1), progress: Progress | None = None) -> None:
    """Compute the pending chunks of the store at `path`; arguments as for `study`."""
    i, n = shard
    if not 1 <= i <= n:
        raise ArgumentError("shard", said=f"must be (i, n) with i from 1 to n, but ({i}, {n}) was given.")
    store = Store(path, about)
    part = range(len(about.grid.chunks))[i - 1 :: n]
    pending, report = store.pending(part), progress or (lambda done, total: None)
    lanes = lambda chunks: sum(about.grid.lanes_of(chunk).size for chunk in chunks)
    total, left = lanes(part), lanes(pending)
    report(total - left, total)
    for chunk in pending:
        begun, done = time.monotonic(), total - left

        def ask(*_: int, begun: float = begun, done: int = done) -> None:
            if time.monotonic() > begun + 1:  # so that `progress` can stop a long chunk
                report(done, total)

        store.write(chunk, _chunk(about, chunk, ask))
        left -= lanes([chunk])
        report(total - left, total)
    if not store.pending():
        store.tidy()


Stage = Callable[[str, int, int], None]
"""Function called with the name of the present stage and the numbers of its finished lanes and of all its lanes."""


def label_map(
    model: AbstractForcedSystem,
    vary: Mapping[str, Float[np.ndarray, " values"]],
    *,
    initial_states: int = 1,
    persist: int = 0,
    stage: Stage | None = None,
    **settings: Any,
) -> xr.Dataset:
    """Compute labels and exponents over the speed and a second parameter.

    **Arguments:**

    - `model`: a cage, a whole bearing or a system of your own.
    - `vary`: names and ascending values [SI] of the two, `"speed"` and a parameter.
    - `initial_states`: number of the model's own initial states to run at each point.
    - `persist`: revolutions that chaos must outlast: lanes found chaotic are run again with this many revolutions
        discarded, so that chaotic transients that end earlier get another label. 0 turns this off.
    - `stage`: function called as lanes finish.
    - `settings`: fields of `jaxcage.lanes.Run`; lanes are neither confirmed nor followed to a horizon.

    **Returns:** a data set over both and `initial_state`, with the variables of `sweep`.

    **Raises:** `ValueError` for arguments that do not fit together; `RuntimeError` without double precision.
    """
    require_x64()
    grid = Grid(vary, {}, 0, 0, initial_states)
    grid.require_known(model)
    run = Run.of(model, **{"keep": CLOSING, **settings, "confirm": False, "horizon": 0})
    require_at_least(0, persist=persist)
    if persist and (persist <= run.discard or run.exponents < 1 or run.blocks < 2):
        allowed = f"0 or above the {run.discard} revolutions discarded, with an exponent and 2 blocks"
        raise ArgumentError("persist", said=f"must be {allowed}, but is {persist}.")

    def say(what: str) -> Progress | None:
        return None if stage is None else functools.partial(stage, what)

    found = run_lanes(grid.plan(model), run, say(f"{grid.size} lanes"))
    if persist and (again := np.flatnonzero(found["label"].values.ravel() == "chaotic")).size:
        longer = dataclasses.replace(run, discard=persist)
        later = run_lanes(grid.plan(model, again), longer, say(f"{again.size} chaotic lanes again"))
        for name, all_lanes in found.data_vars.items():
            all_lanes.values.reshape(grid.size, *all_lanes.shape[len(grid.shape) :])[again] = later[name].values
    return found
