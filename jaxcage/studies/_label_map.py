"""What a system does over two of its parameters: labels and exponents on a grid."""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int

from .._checks import require_x64
from .._errors import ArgumentError
from .._parameters import parameter_info
from ..models import AbstractForcedSystem, require_speeds
from ..solve import AbstractMethod, native
from ..sweeps import require_persist
from ._plan import LANES, Plan
from ._stored import SPEED
from ._study import LABELS, Study, too_short


if TYPE_CHECKING:
    import xarray as xr

KINDS = ("calm", "chaotic", "failed")
"""What a point counts as: chaotic if any of its starts is, else failed if any has or is inaccurate, else calm."""
Stage = Callable[[str, int, int], None]
"""Called with what is under way, and how many of its lanes are done."""


@dataclasses.dataclass(frozen=True)
class LabelMap:
    """Labels over two parameters."""

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

    @property
    def top_exponent(self) -> Float[np.ndarray, "x y"]:
        """Largest exponent of the starts that finished, NaN where none did."""
        top = np.max(self.largest_exponent, axis=2, where=np.isfinite(self.largest_exponent), initial=-np.inf)
        return np.where(np.isfinite(top), top, np.nan)

    @property
    def kind(self) -> Int[np.ndarray, "x y"]:
        """What each point counts as, a place in `KINDS`."""
        return kinds(self.label)

    def dataset(self, system: AbstractForcedSystem) -> "xr.Dataset":
        """Labels and largest exponents of all starts over both parameters, for xarray."""
        import xarray as xr

        info = parameter_info(system)
        unit = lambda name: {"units": "rad/s" if name == SPEED else info[name].unit}
        flags: dict[str, Any] = {"flag_values": list(range(len(LABELS))), "flag_meanings": " ".join(LABELS)}
        dims = (self.x, self.y, "start")
        return xr.Dataset(
            {
                "label": (dims, self.label, {"long_name": "what each lane does", **flags}),
                "largest_exponent": (dims, self.largest_exponent, {"units": "1"}),
            },
            coords={self.x: (self.x, self.x_value, unit(self.x)), self.y: (self.y, self.y_value, unit(self.y))},
        )

    def __str__(self) -> str:
        counts = np.bincount(self.kind.ravel(), minlength=len(KINDS))
        across, upward = self.kind.shape
        short = int(np.sum(self.too_short))
        return "\n".join(
            [
                f"{across} x {upward} points over {self.x} and {self.y}",
                *(f"  {n:6d} {kind}" for kind, n in zip(KINDS, counts, strict=True)),
                *([f"  {short:6d} lanes have no certain label"] if short else []),
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
    starts: int = 1,
    discard: int = 300,
    revolutions: int = 300,
    persist: int = 0,
    blocks: int = 20,
    method: AbstractMethod | None = None,
    stage: Stage | None = None,
) -> LabelMap:
    """Labels over two parameters.

    **Arguments:**

    - `system`: any `AbstractForcedSystem`.
    - `x`, `y`: name and ascending values [SI] of a parameter each; `"speed"` is one.
    - `speed`: the speed [rad/s], if it is neither of them.
    - `starts`: how many of the system's own initial states are run at each point.
    - `discard`, `revolutions`, `blocks`, `method`: as for `sweep`.
    - `persist`: revolutions that chaos must outlast to count: starts found chaotic are run again with so many
        discarded, and what has died out by then was a transient. 0 turns this off.
    - `stage`: called as lanes are done.

    **Returns:** `LabelMap`.

    **Raises:** `ValueError` for arguments that do not fit together.
    """
    require_x64()
    (x_name, x_value), (y_name, y_value) = (*x.items(), *y.items())
    if speed is not None:
        require_speeds(system, speed)
    shape = (len(x_value), len(y_value), starts)
    if min(shape[:2]) < 2:
        raise ArgumentError("x", "y", said=f"must have at least 2 values each, but have {shape[0]} and {shape[1]}.")
    fixed = {} if speed is None else {SPEED: np.array([speed])}
    plan = Plan({**fixed, x_name: x_value, y_name: y_value}, {}, 0, 0, starts, LANES)
    chosen = native() if method is None else method
    about = Study(system, plan, chosen, discard, revolutions, blocks, 1, 0)
    require_persist(persist, discard, 1, blocks)
    say = lambda what: None if stage is None else functools.partial(stage, what)
    every = np.arange(plan.size)
    found = about.at(*plan.at(every), progress=say(f"{plan.size} lanes"))
    again = every[found["label"] == LABELS.index("chaotic")] if persist else every[:0]
    if again.size:
        longer = dataclasses.replace(about, discard=persist)
        for name, value in longer.at(*plan.at(again), progress=say(f"{again.size} chaotic lanes again")).items():
            found[name][again] = value
    label, exponent = found["label"].reshape(shape), found["largest_exponent"].reshape(shape)
    short = too_short(found, revolutions).reshape(shape)
    return LabelMap(x_name, x_value, y_name, y_value, label, exponent, short)
