"""Runs of lanes: from a plan and settings to one data set, with labels that are confirmed with smaller steps.

All lanes that are neither periodic nor failed, their neighbours in speed, and a tenth of the periodic ones (to miss
chaos is the dangerous error) are run again from the same initial states with steps at most half as long. A label that
changes, or an exponent that moves by more than its error, is replaced by the new one, which is confirmed in turn. A
chaotic transient may end in one run and not in the other; such a change is not an error of the steps (see `horizon` for
the life of transients).
"""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int, Shaped

from .._arguments import require_x64
from .._errors import ArgumentError, Stop
from ..analysis import label_lanes, motion_label
from ..models import INSTEAD, AbstractForcedSystem, require_known
from ..solve import FINISHED, INACCURATE, WIDTH, cores
from .dataset import dataset, exponent_error
from .grid import Grid
from .horizon import follow, run_unsettled
from .observe import Observation, Progress, observe
from .plan import SPEED, Plan, Speeds, States
from .settings import Run
from .store import Store, Study, lanes_of_chunks


PARTS = 4
"""Number of parts of a run, each run to its end before the next begins, if no store keeps finished lanes."""
CONFIRMATIONS = 2
"""Maximum number of times that steps are refined."""
SHARE = 0.1
"""Fraction of the periodic lanes, drawn at random, that are confirmed."""
SEED = 0


class Labelled(NamedTuple):
    """Labels of lanes, with the largest exponent and its standard error."""

    label: Shaped[np.ndarray, " lanes"]
    exponent: np.ndarray
    error: np.ndarray

    def at(self, lanes: np.ndarray) -> "Labelled":
        return Labelled(*(x[lanes] for x in self))


def run_lanes(plan: Plan, run: Run, progress: Progress | None = None, store: Store | None = None) -> xr.Dataset:
    """Run the lanes of a plan.

    **Arguments:** plan; settings (`Run.of`); function called with the numbers of finished lanes and of all lanes, which
    may raise `Stop`; store of observations of these lanes, which are run only if they are not in it.

    **Returns:** a data set over the axes of the plan, described in `lanes.dataset`. Lanes that fail are NaN with an
    outcome and do not affect others. After a `Stop` it is the part along the first axis that is finished, with labels
    that may not be confirmed.

    **Raises:** `Stop` if no part is finished.
    """
    scale, count, several = plan.scale, len(plan.states), plan.model.samples > 1
    seen, rounds, escape, end, done = Observation.pending(plan.model, run, count), [], None, 0, 0
    finished = seen

    def onward(run: Run, some: np.ndarray, y: Any, progress: Progress | None = progress, **more: Any) -> Observation:
        begin = plan.states[some] if y is None else y
        return observe(plan.lanes.at(some), run, begin, progress, onward=y is not None, **more)

    def begun(some: np.ndarray) -> Observation:
        told = lambda part, of: progress and progress(done + part * some.size // of, count)
        told(0, 1)
        first = lambda run, few, y: onward(run, some[few], y, told)
        if run.settled:
            return run_unsettled(seen.at(some), run, scale[some], first)
        return first(run, np.arange(some.size), None)

    def again(lanes: np.ndarray, times: int) -> Labelled:
        seen.put(lanes, onward(run, lanes, None, method=run.method.finer(times)))
        return _labelled(seen.at(lanes), scale[lanes])

    try:
        size = max(-(-count // PARTS), WIDTH * cores())
        parts = np.split(np.arange(count), range(size, count, size))
        if store is not None:
            parts = [store.study.grid.lanes_of(chunk) for chunk in range(len(store.study.grid.chunks))]
        for chunk, some in enumerate(parts):
            first = functools.partial(begun, some)
            seen.put(some, first() if store is None else _stored(store, chunk, seen.at(some), first))
            done += some.size
        finished = Observation(*map(np.copy, seen))
        if not several and run.exponents and run.blocks > 1:  # without an error of the exponent nothing is chaotic
            if run.confirm:
                rounds = _confirm(_labelled(seen, scale), plan.shape, again)
                finished = Observation(*map(np.copy, seen))
            if run.horizon > run.discard + run.revolutions:
                escape, end = follow(_labelled(seen, scale).label, seen, run, scale, onward)
        finished = seen
    except Stop:
        if not (whole := done * plan.shape[0] // count):
            raise
    else:
        whole = plan.shape[0]
    label = _motions(finished, plan.model.samples) if several else _labelled(finished, scale).label
    found = dataset(plan, run, finished, scale, label, rounds, escape, end)
    return found if whole == plan.shape[0] else found.isel({next(iter(plan.axes)): slice(whole)})


def _stored(store: Store, chunk: int, pending: Observation, run: Callable[[], Observation]) -> Observation:
    """Observation of a chunk of lanes, from the store or, if it is not there, from a run that is then stored."""
    if store.pending([chunk]):
        seen = run()
        store.write(chunk, {name: x for name, x in seen._asdict().items() if x.size})
        return seen
    return pending._replace(**{n: x.astype(getattr(pending, n).dtype) for n, x in store.read(chunk).items()})


def _motions(seen: Observation, samples: int) -> Shaped[np.ndarray, " lanes"]:
    """Kinds of motion of the cage among its rollers."""
    lost = ~np.isin(seen.outcome, (FINISHED, INACCURATE))
    return np.where(lost, "failed", np.array([motion_label(x, samples) for x in seen.place]))


def _labelled(seen: Observation, scale: Float[np.ndarray, "lanes dim"]) -> Labelled:
    """Labels of lanes from their observation, with the largest exponent and its standard error."""
    exponent = error = np.full(len(scale), np.nan)
    if seen.growth.shape[2]:
        exponent, error = seen.growth.mean(axis=1)[:, 0], exponent_error(seen)[:, 0]
    return Labelled(label_lanes(seen.outcome, seen.strobe, scale, exponent, error), exponent, error)


def _confirm(
    labelled: Labelled, shape: tuple[int, ...], again: Callable[[Int[np.ndarray, " some"], int], Labelled]
) -> list[tuple[int, int, int]]:
    """Run the doubtful lanes again with smaller and smaller steps, as long as their labels or exponents change.

    **Arguments:** labels of all lanes; shape of their layout, with speeds and initial states last; `again(lanes,
    times)`, which runs some of them with steps refined `times` times, replaces their results, and returns their labels.

    **Returns:** for each round the numbers of lanes run again, of labels that changed, and of exponents that moved by
    more than their error under the same label.
    """
    rounds = []
    lanes = _doubtful(labelled.label.reshape(shape))
    before = labelled.at(lanes)
    for times in range(1, CONFIRMATIONS + 1):
        if not lanes.size:
            break
        after = again(lanes, times)
        changed = before.label != after.label
        apart = np.abs(before.exponent - after.exponent)  # NaN of a failed lane does not count as moved
        moved = ~changed & (apart > np.maximum(3 * np.hypot(before.error, after.error), 0.01))
        rounds.append((lanes.size, int(np.sum(changed)), int(np.sum(moved))))
        lanes, before = lanes[changed | moved], after.at(changed | moved)
    return rounds


def _doubtful(label: Shaped[np.ndarray, "*designs speeds initial_states"]) -> Int[np.ndarray, " lanes"]:
    """Indices into the ravelled labels of the lanes to be confirmed."""
    failed = np.isin(label, ("failed", "inaccurate"))
    near = ~np.char.startswith(label, "periodic") & ~failed
    beside = near.copy()
    beside[..., 1:, :] |= near[..., :-1, :]
    beside[..., :-1, :] |= near[..., 1:, :]
    drawn = np.random.default_rng(SEED).random(label.shape) < SHARE
    return np.flatnonzero((beside | drawn) & ~failed)


def sweep(
    model: AbstractForcedSystem | Sequence[AbstractForcedSystem],
    speeds: Speeds,
    *,
    initial_states: States = None,
    progress: Progress | None = None,
    store: str | Path | None = None,
    **settings: Any,
) -> xr.Dataset:
    """Run a model over speed from several initial states: strobe states, Lyapunov exponents and labels; for a whole
    bearing slips, forces, losses and wear.

    **Arguments:**

    - `model`: a cage, a whole bearing, any system of your own; or several designs that differ in their numbers only.
    - `speeds`: ascending speeds [rad/s], of the cage for a cage model, of the shaft for a whole bearing; `jaxcage.rpm`
        converts them from rpm.
    - `initial_states`: initial states, each a tuple of numbers; an array with states for each speed; or the number of
        the model's own initial states to use, by default all.
    - `progress`: function called with the numbers of finished lanes and of all lanes. If it raises
        `jaxcage.lanes.Stop`, the speeds that are finished are returned.
    - `store`: folder that keeps finished lanes, from which the same call goes on if this one does not come to its end;
        for one model, from its own initial states.
    - `settings`: fields of `jaxcage.lanes.Run`, such as `discard`, `revolutions`, `blocks`, `exponents`, `confirm`,
        `horizon` and `method`; or the `tolerance` of machine code, relative to state and scale.

    **Returns:** a data set over `speed` and `initial_state`, for several designs over `design` before these. Variables,
    with further dimensions in brackets: `label`, `outcome`; `exponents`, `standard_error`, `doubt` (exponent);
    `block_growth` (growth_block, exponent); `peak`, `error`, `steps`; `last`, `scale` (component); `strobe`
    (revolution, component) except for a whole bearing; `escape` with a horizon; quantities of a whole bearing, and
    `NAME_blocks` (block). `lanes.dataset` says what they are. Lanes that fail are NaN with an outcome.

    **Raises:** `ValueError` for speeds that are empty, not positive or not ascending, and for impossible counts;
    `RuntimeError` without double precision.
    """
    require_x64()
    require_known("sweep", INSTEAD, model=model, speeds=speeds)
    plan = Plan.over_speed(model, speeds, initial_states)
    run = Run.of(plan.model, **settings)
    if store is None:
        return run_lanes(plan, run, progress)
    if isinstance(model, Sequence) or not isinstance(initial_states, int | np.integer | None):
        raise ArgumentError("store", said="goes with one model from its own initial states, but others were given.")
    lanes = lanes_of_chunks(store, WIDTH * cores())  # it may have been begun with another number of cores
    grid = Grid({SPEED: plan.coordinates[SPEED][1]}, {}, 0, 0, plan.shape[1], lanes)
    return run_lanes(plan, run, progress, Store(store, Study(model, grid, run, observations=True)))
