"""Runs of lanes: from a plan and settings to one data set."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from .._arguments import require_x64
from ..analysis import label_lanes, motion_label
from ..models import INSTEAD, AbstractForcedSystem, require_known
from ..solve import FINISHED, INACCURATE
from .confirm import Labelled, confirm
from .dataset import dataset, exponent_error
from .horizon import follow, run_unsettled
from .observe import Observation, Progress, observe
from .plan import Plan, Speeds, States
from .settings import Run


def run_lanes(plan: Plan, run: Run, progress: Progress | None = None) -> xr.Dataset:
    """Run the lanes of a plan.

    **Arguments:** plan; settings (`Run.of`); function called with the numbers of finished lanes and of all lanes.

    **Returns:** a data set over the axes of the plan, described in `lanes.dataset`. Lanes that fail are NaN with an
    outcome and do not affect others.
    """
    scale = plan.scale

    def onward(run: Run, some: np.ndarray, y: Float[np.ndarray, "some dim"] | None, **more: Any) -> Observation:
        begin = plan.states[some] if y is None else y
        return observe(plan.lanes.at(some), run, begin, progress, onward=y is not None, **more)

    seen = run_unsettled(run, scale, onward) if run.settled else onward(run, np.arange(len(scale)), None)
    if plan.model.samples > 1:
        lost = ~np.isin(seen.outcome, (FINISHED, INACCURATE))
        label = np.where(lost, "failed", np.array([motion_label(x, plan.model.samples) for x in seen.place]))
        return dataset(plan, run, seen, scale, label)
    rounds, escape, end = [], None, 0
    if run.exponents and run.blocks > 1:  # without an error of the exponent no lane is labelled chaotic
        if run.confirm:

            def again(lanes: np.ndarray, times: int) -> Labelled:
                seen.put(lanes, onward(run, lanes, None, method=run.method.finer(times)))
                return _labelled(seen.at(lanes), scale[lanes])

            rounds = confirm(_labelled(seen, scale), plan.shape, again)
        if run.horizon > run.discard + run.revolutions:
            escape, end = follow(_labelled(seen, scale).label, seen, run, scale, onward)
    return dataset(plan, run, seen, scale, _labelled(seen, scale).label, rounds, escape, end)


def _labelled(seen: Observation, scale: Float[np.ndarray, "lanes dim"]) -> Labelled:
    """Labels of lanes from their observation, with the largest exponent and its standard error."""
    exponent = error = np.full(len(scale), np.nan)
    if seen.growth.shape[2]:
        exponent, error = seen.growth.mean(axis=1)[:, 0], exponent_error(seen)[:, 0]
    return Labelled(label_lanes(seen.outcome, seen.strobe, scale, exponent, error), exponent, error)


def sweep(
    model: AbstractForcedSystem | Sequence[AbstractForcedSystem],
    speeds: Speeds,
    *,
    initial_states: States = None,
    progress: Progress | None = None,
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
    - `progress`: function called with the numbers of finished lanes and of all lanes.
    - `settings`: fields of `jaxcage.lanes.Run`, such as `discard`, `revolutions`, `blocks`, `exponents`, `confirm`,
        `horizon` and `method`; or the `tolerance` of machine code, relative to state and scale.

    **Returns:** a data set over `speed` and `initial_state` (and `design` for several designs), with the labels,
    exponents and quantities of every lane. Lanes that fail are NaN with an outcome.

    **Raises:** `ValueError` for speeds that are empty, not positive or not ascending, and for impossible counts;
    `RuntimeError` without double precision.
    """
    require_x64()
    require_known("sweep", INSTEAD, model, speeds)
    plan = Plan.over_speed(model, speeds, initial_states)
    return run_lanes(plan, Run.of(plan.model, **settings), progress)
