"""Verdict on an operating range: whether a cage stays calm, how certain that is, and what would change it.

Two independent results are combined. The best guess of the design has a stable range of speed with exact edges: the
distance of the operating range from them is its margin, with exact derivatives. Unknown values are drawn from their
ranges, and each draw is simulated over the operating range: the share of draws that are chaotic somewhere in it is a
joint probability, with a binomial error bar.
"""

import dataclasses
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from .._errors import InputError
from .._parameters import EXTRA, parameter_info, parameters
from .design_space import DesignSpace, Value
from .operating import OperatingRange
from .unknowns import Ensemble, binomial_interval, verdict_of


RANGE_SPEEDS = 32
"""Number of speeds of the operating range at which draws are simulated."""
STEP = 0.1
"""Relative change of a parameter for which effects are given."""
KELVINS = 10.0
"""Change of a temperature for which effects are given [K]."""
SMALL = 0.02
"""Effects below this fraction of the largest one are not listed."""
TURNED = "drawing", "operating"
"""Kinds of parameters that a designer or a user of the bearing can change."""
ENDS = "lower", "upper"

State = Literal["calm", "rattles", "not decided"]


class RangeChance(NamedTuple):
    """Numbers of draws that are chaotic at one or more speeds of a range, of those for which this is known, and of
    all."""

    chaotic: int
    known: int
    draws: int

    @property
    def share(self) -> float:
        """Share of the known draws that are calm over the whole range; NaN if none is known."""
        return 1 - self.chaotic / self.known if self.known else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the calm share, whatever the failed draws would do."""
        unknown = self.draws - self.known
        high = 1 - float(binomial_interval(self.chaotic, self.draws)[0])
        return 1 - float(binomial_interval(self.chaotic + unknown, self.draws)[1]), high

    @property
    def state(self) -> State:
        """`calm` or `rattles` if at least 95 % of the draws agree, whatever the failed ones would do, else `not
        decided`."""
        words: dict[str, State] = {"calm": "calm", "chaotic": "rattles"}
        return words.get(verdict_of(self.chaotic, self.known, self.draws), "not decided")


Draws = Bool[np.ndarray, " draws"]


def range_chance(found: Ensemble, low_rpm: float, high_rpm: float) -> tuple[RangeChance, Draws, Draws]:
    """Chance that a draw is calm at all speeds of a range [rpm]; True for draws that are chaotic in it, and for those
    of which this is known."""
    which = found.between(low_rpm, high_rpm)
    chaotic = np.any(found.chaotic[:, which] & ~found.failed[:, which], axis=1)
    known = chaotic | ~np.any(found.failed[:, which], axis=1)
    return RangeChance(int(chaotic.sum()), int(known.sum()), len(chaotic)), chaotic, known


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
