"""Studies: lanes over any parameters, computed chunk by chunk into a store, from where an earlier run stopped."""

import dataclasses
import functools
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from .._arguments import require_at_least, require_x64
from .._errors import ArgumentError
from ..analysis import LONGEST_PERIOD, scatter
from ..models import AbstractForcedSystem, require_speeds
from ..quantities import quantity
from .dataset import CODES, coded, configuration_of, settings_of
from .grid import LANES, Between, Grid
from .observe import Progress
from .plan import SPEED
from .run import run_lanes
from .settings import Run
from .store import Results, Store, Variable, open_study


CLOSING = 2 * LONGEST_PERIOD
"""Strobe states over which orbits are seen to close."""


Vary = Mapping[str, Float[Array, " values"] | Float[np.ndarray, " values"] | Between]
"""Parameter, or `"speed"` or `"oil"` -> values that make an axis of the grid [SI], or how to sample it."""
Shard = tuple[int, int]
"""(i, n): the i-th of n parts, counted from 1."""
SCALARS = ("peak", "error", "steps")
"""Numbers that every lane has, whatever its model reports."""


@dataclasses.dataclass(frozen=True, eq=False)
class Study:
    """A model, the grid over which it is run, and the settings of its runs."""

    model: AbstractForcedSystem
    grid: Grid
    run: Run
    name: str = ""
    version: str = ""
    """Name and version of code of the user's own, which a store cannot recognise by itself."""

    def __post_init__(self):
        self.grid.require_known(self.model)

    @property
    def description(self) -> str:
        """All that a store is recognised by, as JSON."""
        run = {f.name: getattr(self.run, f.name) for f in dataclasses.fields(self.run) if f.name != "method"}
        configured = configuration_of(self.model)
        system = json.loads(configured["configuration"]) if configured else numbers_of(self.model)
        about = {"name": self.name, "version": self.version, "system": system}
        method = {"method_numbers": numbers_of(self.run.method), **settings_of(self.run.method)}
        return json.dumps({**about, "plan": self.grid.describe(), **run, **method}, sort_keys=True)

    @property
    def variables(self) -> dict[str, Variable]:
        """Variables that are stored of every lane, by name."""
        known = lambda name: (quantity(name).text, quantity(name).unit)
        found = {name: Variable(*known(name)) for name in SCALARS}
        if self.run.exponents:
            found["exponents"] = Variable(*known("exponent"), exponents=True)
            found["standard_error"] = Variable(*known("standard_error"), exponents=True)
        for each in self.model.quantities:
            found[each.name] = Variable(each.text, each.unit)
            found[f"{each.name}_standard_error"] = Variable(f"standard error, {each.text}", each.unit)
        return found | {name: Variable(*known(name), names=words) for name, words in CODES.items()}

    def chunk(self, number: int) -> Results:
        """The results of a chunk, laid out as its block of the grid; the bits of a lane are the same in any company."""
        found = coded(run_lanes(self.grid.plan(self.model, self.grid.lanes_of(number)), self.run))
        values = {name: x.values for name, x in found.data_vars.items()}
        values |= {f"{x.name}_standard_error": scatter(values[f"{x.name}_blocks"]) for x in self.model.quantities}
        shape = tuple(part.stop - part.start for part in self.grid.region(number))
        return {name: values[name].reshape(*shape, *values[name].shape[1:]) for name in self.variables}


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
    """Run a model over any grid or sample of its parameters, and keep what each lane does in a zarr folder.

    What is stored already is not computed again: after a kill the same call continues where it stopped, and the store
    ends up with the same bits as that of an unbroken run, whichever processes computed it.

    **Arguments:**

    - `model`: a cage, a whole bearing or a system of one's own.
    - `vary`: what is varied. Arrays are axes of a grid [SI]; those that are `jaxcage.lanes.Between` are sampled
        together. The speed [rad/s] must be among them, of a whole bearing the shaft's; `oil` is the ISO VG grade of a
        mineral oil.
    - `store`: the folder.
    - `samples`, `seed`: number of samples (a scrambled Sobol sequence; best a power of 2) and seed.
    - `initial_states`: how many of the model's own initial states are run at each point, by default all.
    - `lanes`: lanes of a chunk, at most; by default 2048, or fewer where a lane takes long.
    - `shard`: (i, n) runs every n-th chunk from the i-th on. All shards write to the same folder.
    - `progress`: called with lanes done and lanes in all, those that were stored before included.
    - `name`, `version`: of a function or class of your own that the model is made of. They must be given then, since a
        store cannot tell by itself whether your code is still the same: change the version whenever it changes.
    - `settings`: fields of `jaxcage.lanes.Run`; lanes are neither confirmed nor followed to a horizon.

    **Returns:** the store, opened by xarray: variables over the samples, the axes of the grid and `start`.

    **Raises:** `ValueError` for arguments that do not fit together, and for a store of another study.
    """
    require_x64()
    sampled: dict[str, Between] = {each: how for each, how in vary.items() if isinstance(how, Between)}
    axes = {each: np.asarray(x, dtype=float) for each, x in vary.items() if each not in sampled}
    own = len(model.initial_states(1.0)) if initial_states is None else initial_states
    most = lanes or (LANES if model.samples == 1 else LANES // 42)
    run = Run.of(model, **{"keep": CLOSING, **settings, "confirm": False, "horizon": 0})
    about = Study(model, Grid(axes, sampled, samples, seed, own, most), run, name, version)
    run_study(about, store, shard, progress)
    return open_study(store)


def run_study(
    about: Study,
    path: str | Path,
    shard: Shard = (1, 1),
    progress: Progress | None = None,
) -> None:
    """Compute what the store at `path` lacks; arguments as for `study`."""
    i, n = shard
    if not 1 <= i <= n:
        raise ArgumentError("shard", said=f"must be (i, n) with i from 1 to n, but ({i}, {n}) was given.")
    store = Store(path, about)
    part = range(about.grid.chunks)[i - 1 :: n]
    pending, report = store.pending(part), progress or (lambda done, total: None)
    lanes = lambda chunks: sum(about.grid.lanes_of(chunk).size for chunk in chunks)
    total, left = lanes(part), lanes(pending)
    report(total - left, total)
    for chunk in pending:
        store.write(chunk, about.chunk(chunk))
        left -= lanes([chunk])
        report(total - left, total)
    if not store.pending():
        store.tidy()


Stage = Callable[[str, int, int], None]
"""Called with what is under way, and how many of its lanes are done."""


def label_map(
    model: AbstractForcedSystem,
    x: Mapping[str, Float[np.ndarray, " x"]],
    y: Mapping[str, Float[np.ndarray, " y"]],
    *,
    speed: float | None = None,
    initial_states: int = 1,
    persist: int = 0,
    stage: Stage | None = None,
    **settings: Any,
) -> xr.Dataset:
    """Labels and exponents over two parameters.

    **Arguments:**

    - `model`: a cage, a whole bearing or a system of one's own.
    - `x`, `y`: name and ascending values [SI] of a parameter each; `"speed"` is one.
    - `speed`: the speed [rad/s], if it is neither of them.
    - `initial_states`: how many of the model's own initial states are run at each point.
    - `persist`: revolutions that chaos must outlast to count: lanes found chaotic are run again with so many discarded,
        and what has died out by then was a transient. 0 turns this off.
    - `stage`: called as lanes are done.
    - `settings`: fields of `jaxcage.lanes.Run`; lanes are neither confirmed nor followed to a horizon.

    **Returns:** a data set over x, y and `start`, with the speed as a coordinate.

    **Raises:** `ValueError` for arguments that do not fit together.
    """
    require_x64()
    (x_name, x_value), (y_name, y_value) = (*x.items(), *y.items())
    if speed is not None:
        require_speeds(model, speed)
    if min(len(x_value), len(y_value)) < 2:
        raise ArgumentError(
            "x", "y", said=f"must have at least 2 values each, but have {len(x_value)}, {len(y_value)}."
        )
    fixed = {} if speed is None else {SPEED: np.array([speed])}
    grid = Grid({x_name: x_value, y_name: y_value, **fixed}, {}, 0, 0, initial_states)
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
    return found if speed is None else found.isel({SPEED: 0})


def numbers_of(module: eqx.Module) -> dict[str, Any]:
    """All numbers of a module by the names of their places."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(module)
    named = lambda path: jax.tree_util.keystr(path).lstrip(".")
    return {named(path): np.asarray(x).tolist() for path, x in leaves if eqx.is_array_like(x)}
