"""Check of a design by simulations from many initial states over its operating range."""

import dataclasses
import json
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from ..analysis import failed, restless, survival_at
from ..lanes import states_at, sweep
from ..models import AbstractForcedSystem
from .statistics import drawn_states


SPEEDS = 24  # simulated over the operating range


@dataclasses.dataclass(frozen=True)
class Checked:
    """Results of simulations of a design over speeds [rpm] of its operating range: shares of the trajectories by label,
    the speeds at which some are chaotic, and the mean life of chaos there [revolutions], infinite where none ended, and
    NaN after a stop."""

    speeds_rpm: Float[np.ndarray, " speeds"]
    initial_states: int
    shares: dict[str, float]
    failed: int
    chaotic_rpm: Float[np.ndarray, " chaotic"]
    mean_life: Float[np.ndarray, " chaotic"]
    method: str

    @property
    def calm(self) -> bool:
        """True if every trajectory ended on a period-1 orbit."""
        return self.shares.get("periodic-1") == 1.0

    @property
    def state(self) -> str:
        """The verdict `calm` or `not calm`; `not decided` if some trajectories failed and all others are calm."""
        others = self.shares.keys() - {"periodic-1", "failed"}
        return "calm" if self.calm else "not calm" if others else "not decided"

    def __str__(self) -> str:
        share = 100 * self.shares.get("periodic-1", 0.0)
        said = f"{share:.1f} % of {self.initial_states} initial states at {self.speeds_rpm.size} speeds end calm"
        if not self.chaotic_rpm.size:
            return said
        low, high = f"{self.chaotic_rpm.min():.0f}", f"{self.chaotic_rpm.max():.0f} rpm of the cage"
        ends = self.mean_life.min(), self.mean_life.max()
        lasts = " to ".join(f"{x:.0f}" if np.isfinite(x) else "no end seen" for x in ends)
        where = f"at {self.chaotic_rpm.size} of the speeds, {low} to {high}"
        said = f"{said}; chaos coexists {where}"
        return said if np.isnan(ends[0]) else f"{said}, with a mean life of {lasts} revolutions"


def check_design(
    model: AbstractForcedSystem,
    operating: tuple[float, float],
    initial_states: int = 16,
    progress: Callable[[str, int, int], None] | None = None,
) -> Checked:
    """Simulate a design over its operating range [rad/s] from its own and random initial states, `initial_states` in
    all.

    Steps are adaptive, in machine code, and thus independent of those of the orbits in the search.
    """
    speeds = np.linspace(*operating, SPEEDS)
    own = np.asarray(states_at(model, speeds, None))[:, :initial_states]
    states = np.concatenate([own, drawn_states(model, speeds, initial_states - own.shape[1], 0)], axis=1)
    told = (lambda done, of: progress("check", done, of)) if progress else None
    found = sweep(model, speeds, initial_states=states, progress=told)
    labels, counts = np.unique(found["label"].values, return_counts=True)
    shares = dict(zip(labels.tolist(), (counts / counts.sum()).tolist(), strict=True))
    rpm, where = found["rpm"].values, np.flatnonzero(restless(found))
    followed = "escape" in found  # not after a stop
    lives = np.array([survival_at(found, int(i)).mean_life if followed else np.nan for i in where])
    method = json.loads(found.attrs["settings"])["method"]
    return Checked(rpm, states.shape[1], shares, int(np.sum(failed(found))), rpm[where], lives, method)
