"""Distance of a design from a loss of stability, what would change it, and where its simulations end.

The best guess of a design has a stable range of speed with exact edges: the distance of an operating range from them is
its margin, with exact derivatives. A stable orbit need not attract every initial state, so that the design is also
simulated over the range from many of them.
"""

import dataclasses
import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from .._errors import InputError
from .._parameters import EXTRA, parameter_info, parameters
from ..analysis import restless, survival_at
from ..lanes import states_at, sweep
from ..models import AbstractForcedSystem
from .design_space import DesignSpace, Value
from .operating import OperatingRange
from .statistics import drawn_states


SPEEDS = 24
"""Number of speeds of the operating range at which a design is simulated."""
STEP = 0.1
"""Relative change of a parameter for which effects are given."""
KELVINS = 10.0
"""Change of a temperature for which effects are given [K]."""
SMALL = 0.02
"""Effects below this fraction of the largest one are not listed."""
TURNED = "drawing", "operating"
"""Kinds of parameters that a designer or a user of the bearing can change."""
ENDS = "lower", "upper"


@dataclasses.dataclass(frozen=True)
class Margins:
    """Distances of an operating range from the edges of the stable range, for the best guess of a design.

    `lower` and `upper` are in per cent of the speed at that end, with derivatives by relative changes of the
    parameters. `decay` is the number of revolutions in which a small disturbance falls to 1/e at the worst speed, or
    infinite.
    """

    lower: Value
    upper: Value
    decay: float
    names: tuple[str, ...]
    now: Float[np.ndarray, " n"]
    """Values of the parameters [SI]."""

    @property
    def open(self) -> tuple[str, ...]:
        """Ends of the range beyond which no edge was found."""
        return tuple(end for end in ("lower", "upper") if not np.isfinite(getattr(self, end).rpm))

    @property
    def least(self) -> tuple[str, Value]:
        """End of the range nearest to an edge, and its margin."""
        known = [end for end in ("lower", "upper") if end not in self.open] or ["upper"]
        end = min(known, key=lambda end: getattr(self, end).value)
        return end, getattr(self, end)

    @property
    def changes(self) -> list["Change"]:
        """Effects of single parameters on the margins, the most useful for the least margin first."""
        end, least = self.least
        if end in self.open:
            return []
        rows = []
        for i, name in enumerate(self.names):
            if not least.slope[i]:
                continue
            step = KELVINS / self.now[i] if name == "temperature" else STEP
            gain = float(step * abs(least.slope[i]))
            up = bool(least.slope[i] > 0)
            other = step * (1 if up else -1) * float((self.upper if end == "lower" else self.lower).slope[i])
            limit = float(self.now[i] * (1 - least.value / least.slope[i]))
            rows.append(Change(name, float(self.now[i]), up, gain, other, limit))
        rows.sort(key=lambda row: -row.gain)
        return [row for row in rows if row.gain >= SMALL * rows[0].gain]


class Change(NamedTuple):
    """First-order effect of 10 % or 10 K more (`up`) or less of a parameter: `gain` of the least margin, and `other` of
    that at the other end, per cent of speed. `limit` is the value at which the edge would reach the range [SI]."""

    name: str
    value: float
    up: bool
    gain: float
    other: float
    limit: float

    @property
    def amount(self) -> str:
        """Size of the change."""
        return f"{KELVINS:g} K" if self.name == "temperature" else f"{100 * STEP:g} %"


def margins(model: Any, operating: tuple[float, float]) -> Margins | str:
    """Margins of a design over an operating range of cage speed [rad/s], or why there are none."""
    info, known = parameter_info(model), {n: float(x) for n, x in parameters(model).items()}
    turned = [n for n in known if (info[n].kind in TURNED or n.startswith(EXTRA)) and known[n] > 0]
    space = DesignSpace.of(model, {n: (known[n] * (1 - STEP), known[n] * (1 + STEP)) for n in turned})
    try:
        range_ = OperatingRange(space, operating, 10.0)
    except InputError as error:
        return str(error)
    found = range_.margins(space.place)
    if isinstance(found, str):
        return found
    own = {end: found[f"{end} margin"]._replace(slope=found[f"{end} margin"].slope / (2 * STEP)) for end in ENDS}
    worst = range_.worst(space.place, ("multiplier",))
    largest = float("nan") if isinstance(worst, str) else worst["multiplier"].value
    with np.errstate(divide="ignore"):
        decay = float(-1 / np.log(largest)) if largest < 1 else float("inf")
    return Margins(own["lower"], own["upper"], decay, tuple(turned), np.array([known[n] for n in turned]))


# --- simulations ----------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Checked:
    """Results of simulations of a design over speeds [rpm] of its operating range: shares of the trajectories by label,
    the speeds at which some are chaotic, and the mean life of chaos there [revolutions], infinite where none ended, and
    NaN after a stop."""

    speeds_rpm: Float[np.ndarray, " speeds"]
    initial_states: int
    shares: dict[str, float]
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
        each = lambda x: " to ".join(dict.fromkeys(f"{end:.0f}" for end in (x.min(), x.max())))
        where = f"at {self.chaotic_rpm.size} of the speeds, {each(self.chaotic_rpm)} rpm of the cage"
        said, life = f"{said}; chaos coexists {where}", self.mean_life
        if np.isnan(life).any():
            return said
        if np.isinf(life).all():
            return f"{said}, and no end of it is seen"
        lasts = f"at least {life.min():.0f}" if np.isinf(life).any() else each(life)
        return f"{said}, with a mean life of {lasts} revolutions"


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
    return Checked(rpm, states.shape[1], shares, rpm[where], lives, method)
