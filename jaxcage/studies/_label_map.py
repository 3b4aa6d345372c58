"""What a system does over two of its parameters: labels and exponents on a grid, refined where the label changes."""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from .._checks import require_x64
from .._parameters import parameter_info
from ..integrate import AbstractMethod, controlled
from ..models import AbstractForcedSystem
from ..sweeps import require_persist
from ._adaptive import AdaptiveGrid, Points, refine
from ._plan import LANES, Plan
from ._stored import PENDING, SPEED
from ._study import LABELS, Study, too_short


if TYPE_CHECKING:
    import xarray as xr

KINDS = ("calm", "chaotic", "failed")
"""What a point counts as: chaotic if any of its starts is, else failed if any has or is inaccurate, else calm."""
Refine = Literal["chaos", "label", "everything"]
"""Where points are spent: where chaos begins or ends, where any label changes, or everywhere."""
Stage = Callable[[str, int, int], None]
"""Called with what is under way, and how many of its points are done."""


@dataclasses.dataclass(frozen=True)
class LabelMap:
    """Labels over two parameters. What has not been computed is `PENDING`, or NaN."""

    x: str
    x_value: Float[np.ndarray, " x"]
    """[SI]."""
    y: str
    y_value: Float[np.ndarray, " y"]
    """[SI]."""
    label: Int[np.ndarray, "x y starts"]
    """Places in `jaxcage.studies.LABELS`."""
    largest_exponent: Float[np.ndarray, "x y starts"]
    """Per revolution."""
    too_short: Bool[np.ndarray, "x y starts"]
    """Labels that rest on too few revolutions for the error bars of their exponents."""
    grid: AdaptiveGrid
    """By what was refined; with `refine = "chaos"` places in `KINDS`."""

    @property
    def filled_exponent(self) -> Float[np.ndarray, "x y"]:
        """Largest exponent of the starts that finished; points that were left out take that of the nearest one."""
        lowest = np.max(self.largest_exponent, axis=2, where=np.isfinite(self.largest_exponent), initial=-np.inf)
        top = np.where(np.isfinite(lowest), lowest, np.nan)
        return top[self.grid.nearest]

    @property
    def kind(self) -> Int[np.ndarray, "x y"]:
        """What each point counts as, a place in `KINDS`; points that were left out take that of the nearest one."""
        return kinds(self.label)[self.grid.nearest]

    def dataset(self, system: AbstractForcedSystem) -> "xr.Dataset":
        """Labels and largest exponents of all starts over both parameters, for xarray."""
        import xarray as xr

        info = parameter_info(system)
        unit = lambda name: {"units": "rad/s" if name == SPEED else info[name].unit}
        codes = [PENDING, *range(len(LABELS))]
        flags: dict[str, Any] = {"flag_values": codes, "flag_meanings": " ".join(["pending", *LABELS])}
        dims = (self.x, self.y, "start")
        return xr.Dataset(
            {
                "label": (dims, self.label, {"long_name": "what each lane does", **flags}),
                "largest_exponent": (dims, self.largest_exponent, {"units": "1"}),
            },
            coords={self.x: (self.x, self.x_value, unit(self.x)), self.y: (self.y, self.y_value, unit(self.y))},
        )

    def __str__(self) -> str:
        known = self.grid.known
        counts = np.bincount(kinds(self.label)[known], minlength=len(KINDS))
        across, upward = known.shape
        short = int(np.sum(self.too_short))
        return "\n".join(
            [
                f"{across} x {upward} points over {self.x} and {self.y}: {self.grid.points} computed "
                f"({self.grid.points / known.size:.1%}), {'complete' if self.grid.complete else 'not complete'}",
                *(f"  {n:6d} {kind}" for kind, n in zip(KINDS, counts, strict=True)),
                *([f"  {short:6d} labels rest on too few revolutions"] if short else []),
            ]
        )


def kinds(label: Int[np.ndarray, "*points starts"]) -> Int[np.ndarray, "*points"]:
    """What points count as, from the labels of their starts."""
    chaotic = np.any(label == LABELS.index("chaotic"), axis=-1)
    failed = np.any(np.isin(label, [LABELS.index("failed"), LABELS.index("inaccurate")]), axis=-1)
    return np.where(chaotic, 1, np.where(failed, 2, 0))


def label_map(
    system: AbstractForcedSystem,
    x: Mapping[str, Float[np.ndarray, " x"]],
    y: Mapping[str, Float[np.ndarray, " y"]],
    *,
    speed: float | None = None,
    refine_by: Refine = "chaos",
    most: int | None = None,
    first: int | None = None,
    starts: int = 1,
    discard: int = 300,
    revolutions: int = 300,
    persist: int = 0,
    blocks: int = 20,
    method: AbstractMethod | None = None,
    report: Callable[[LabelMap], None] | None = None,
    stage: Stage | None = None,
) -> LabelMap:
    """Labels over two parameters, a coarse picture first, then more points along the edges.

    **Arguments:**

    - `system`: any `AbstractForcedSystem`.
    - `x`, `y`: name and ascending values [SI] of a parameter each; `"speed"` is one.
    - `speed`: the speed [rad/s], if it is neither of them.
    - `refine_by`: where points are spent.
    - `most`, `first`: as for `refine`: points at most, stride of the coarse picture.
    - `starts`: how many of the system's own initial states are run at each point.
    - `discard`, `revolutions`, `blocks`, `method`: as for `sweep`.
    - `persist`: revolutions that chaos must outlast to count: starts found chaotic are run again with so many
        discarded, and what has died out by then was a transient. 0 turns this off.
    - `report`: called with the coarse picture and after each refinement.
    - `stage`: called as lanes are done.

    **Returns:** `LabelMap`.

    **Raises:** `ValueError` for arguments that do not fit together.
    """
    require_x64()
    (x_name, x_value), (y_name, y_value) = (*x.items(), *y.items())
    fixed = {} if speed is None else {SPEED: np.array([speed])}
    plan = Plan({**fixed, x_name: x_value, y_name: y_value}, {}, 0, 0, starts, LANES)
    chosen = controlled() if method is None else method
    about = Study(system, plan, chosen, discard, revolutions, blocks, 1, 0)
    require_persist(persist, discard, 1, blocks)
    longer = dataclasses.replace(about, discard=persist or discard)
    shape = (len(x_value), len(y_value))
    label = np.full((*shape, starts), PENDING, dtype=np.int8)
    exponent = np.full((*shape, starts), np.nan)
    short = np.zeros((*shape, starts), dtype=bool)

    def evaluate(points: Points) -> np.ndarray:
        first_lane = np.asarray(np.ravel_multi_index(tuple(points.T), shape)) * starts
        lane = (first_lane[:, None] + np.arange(starts)).ravel()
        say = None if stage is None else functools.partial(stage, f"{len(points)} points")
        found = about.at(*plan.at(lane), progress=say)
        again = np.flatnonzero(found["label"] == LABELS.index("chaotic")) if persist else np.array([], dtype=int)
        if again.size:
            say = None if stage is None else functools.partial(stage, f"{again.size} chaotic lanes again")
            for name, x in longer.at(*plan.at(lane[again]), progress=say).items():
                found[name][again] = x
        place = points[:, 0], points[:, 1]
        new = found["label"].reshape(-1, starts)
        label[place], exponent[place] = new, found["largest_exponent"].reshape(-1, starts)
        short[place] = too_short(found, revolutions).reshape(-1, starts)
        return kinds(new) if refine_by == "chaos" else new @ len(LABELS) ** np.arange(starts)  # labels as one number

    def make(grid: AdaptiveGrid) -> LabelMap:
        return LabelMap(x_name, x_value, y_name, y_value, label.copy(), exponent.copy(), short.copy(), grid)

    def say(grid: AdaptiveGrid) -> None:
        if report is not None:
            report(make(grid))

    return make(refine(evaluate, shape, first=first, most=most, everywhere=refine_by == "everything", report=say))
