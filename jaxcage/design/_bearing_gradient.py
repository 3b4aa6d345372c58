"""How statistics of the whole bearing answer to the design: slip, impulses, wear, power, with standard errors.

Its motion is chaotic, so that nothing is differentiated along it. Designs are scattered around the given one and run
from the same starts. They come in pairs that mirror each other: half the difference of a pair holds no curvature, and
least squares over all pairs gives the slopes, with errors that need no law of the scatter: J. G. MacKinnon and
H. White, J. Econometrics 29 (1985) 305, HC3.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from .._arguments import require_above_zero, require_at_least
from .._errors import ArgumentError
from .._notebook import notebook_html
from .._parameters import parameters, replace
from ..analysis import AVERAGED, STATISTIC_UNITS
from ..models import BearingModel, BearingState
from ..sweeps import Progress, sweep_bearings


DIRECTIONS = (
    "guidance_gap",
    "pocket_clearance",
    "radial_clearance",
    "eccentricity",
    "cage_mass+cage_inertia",
    "land_width",
    "viscosity_1+viscosity_2",
)
"""What a designer turns; parameters joined by + change together, by the same factor."""
STATISTICS = (
    "cage_slip",
    "pocket_impulse_N_s",
    "land_impulse_N_s",
    "pocket_wear_mm3_per_h",
    "land_wear_mm3_per_h",
    "friction_power_W",
)
DESIGNS, SPREAD = 64, 0.05


@dataclasses.dataclass(frozen=True)
class StatisticGradient:
    """A mean over time of the whole bearing, and what relative changes of parameters do to it."""

    name: str
    unit: str
    value: float
    """Mean over all designs and starts."""
    value_error: float
    """Its standard error, from the scatter of the pairs."""
    drift: float
    """Mean of the second half of the run less that of the first: a value that drifts has not settled."""
    drift_error: float
    directions: tuple[str, ...]
    by_relative_change: Float[np.ndarray, " n"]
    """Derivative of the value by the logarithm of each parameter [unit]."""
    covariance: Float[np.ndarray, "n n"]
    """Of those derivatives."""
    explained: float
    """Share of the scatter of the pairs that the slopes explain, 0 to 1."""

    @property
    def by_relative_change_error(self) -> Float[np.ndarray, " n"]:
        """Standard error of each derivative."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def elasticity(self) -> Float[np.ndarray, " n"]:
        """Relative change of the value by that of each parameter; NaN of a value that is 0."""
        return self.by_relative_change / self.value if self.value else np.full(len(self.directions), np.nan)

    @property
    def elasticity_error(self) -> Float[np.ndarray, " n"]:
        """Standard error of each elasticity."""
        if not self.value:
            return np.full(len(self.directions), np.nan)
        return np.hypot(self.by_relative_change_error, self.elasticity * self.value_error) / abs(self.value)

    @property
    def settled(self) -> bool:
        """Whether the halves of the run differ by no more than twice their error, or by less than a hundredth."""
        return abs(self.drift) <= max(2 * self.drift_error, 0.01 * abs(self.value))


@dataclasses.dataclass(frozen=True)
class BearingGradient:
    """Gradients of statistics of the whole bearing at one shaft speed."""

    speed: float
    """Of the shaft [rad/s]."""
    statistics: dict[str, StatisticGradient]
    values: dict[str, float]
    """Of the parameters, SI."""
    pairs: int
    """Pairs of designs that came to their ends."""
    failed: int
    """Designs that did not, and are left out with their partners."""
    inaccurate: int
    """Lanes that are `inaccurate`, counted in."""
    starts: int
    discard: int
    revolutions: int
    spread: float

    def slope(self, statistic: str, parameter: str) -> tuple[float, float]:
        """Derivative by one parameter that changes alone [unit of the statistic per SI unit], with its standard error.

        **Raises:** `ValueError` for a statistic or parameter that is not there.
        """
        found = self.statistics.get(statistic)
        if found is None:
            raise ArgumentError(
                "statistic", said=f"must be one of {', '.join(self.statistics)}, but '{statistic}' was given."
            )
        alone = [name for name in found.directions if "+" not in name]
        if parameter not in alone:
            raise ArgumentError("parameter", said=f"must be one of {', '.join(alone)}, but '{parameter}' was given.")
        i, value = found.directions.index(parameter), self.values[parameter]
        return float(found.by_relative_change[i] / value), float(found.by_relative_change_error[i] / abs(value))

    def __str__(self) -> str:
        head = f"{self.speed * 30 / math.pi:.0f} rpm of the shaft, elasticities from {self.pairs} pairs of designs"
        lines = []
        for each in self.statistics.values():
            lines.append(f"{each.name} {each.value:.4g} +- {each.value_error:.2g} {each.unit}")
            rows = zip(each.directions, each.elasticity, each.elasticity_error, strict=True)
            lines += [f"  {name:<28} {value:+.3f} +- {error:.3f}" for name, value, error in rows]
        return "\n".join([head, *lines])

    _repr_html_ = notebook_html


def bearing_gradient(
    model: BearingModel,
    speed: float,
    *,
    directions: Sequence[str] = DIRECTIONS,
    statistics: Sequence[str] = STATISTICS,
    designs: int = DESIGNS,
    spread: float = SPREAD,
    starts: int | Sequence[BearingState] = 2,
    discard: int = 20,
    revolutions: int = 40,
    tolerance: float = 1e-4,
    seed: int = 0,
    progress: Progress | None = None,
) -> BearingGradient:
    """Gradients of statistics of the whole bearing by its parameters, with standard errors.

    **Arguments:**

    - `model`: bearing, with an inner ring that is `dynamic`.
    - `speed`: of the shaft [rad/s].
    - `directions`: parameters that are not 0; of those joined by `+` all change by the same factor.
    - `statistics`: names of `BearingSweep.block_means`, such as `cage_slip` or `exponent`. The largest exponent need
        not depend smoothly on the design: what comes of it is its mean slope over the box of designs.
    - `designs`: how many, an even number; each parameter is moved up in half of them and down in the others, by half
        of `spread` to all of it: no two designs are the same, however few the directions. More of them make errors
        smaller by their root, and so do more revolutions and a larger spread.
    - `spread`: relative half width of the box of designs, above 0 and at most 0.3. Structure that is finer is smoothed
        away; the slope is off by at most a sixth of spread^2 times the third derivative.
    - `starts`: how many of the model's own starts, or states with which every design begins.
    - `discard`, `revolutions`: revolutions of the cage left out, and observed after that, an even number.
    - `tolerance`, `progress`: as in `sweep_bearing`.
    - `seed`: of the designs.

    **Returns:** `BearingGradient`. Standard errors are those of the designs' scatter around the fitted slopes, whatever
    its law: chaos, motions that coexist, and curvature of third order are in them.

    **Raises:** `ValueError` for parameters that are unknown or 0, a box of designs that leaves a parameter's range,
    counts that are impossible, too few designs for the directions; if too many of them fail.
    """
    require_above_zero(speed=speed)
    require_at_least(0, seed=seed, discard=discard)
    values = _values(model, directions)
    _require(directions, statistics, designs, spread, revolutions)
    moved = spread * _moves(designs // 2, len(directions), seed)
    boxed = [_design(model, values, directions, row) for row in np.concatenate([moved, -moved])]
    found = sweep_bearings(
        boxed,
        speed,
        starts=starts,
        discard=discard,
        revolutions=revolutions,
        blocks=2,
        exponents=int("exponent" in statistics),
        tolerance=tolerance,
        progress=progress,
    )
    failed = np.array([bool(each.failed.any()) for each in found])
    whole = ~failed.reshape(2, -1).any(axis=0)
    if whole.sum() <= len(directions) + 1:
        raise ArgumentError(
            "designs",
            said=f"must be more: only {whole.sum()} pairs came to their ends, for {len(directions)} slopes.",
        )
    fitted = {
        name: gradient_of_pairs(
            name,
            STATISTIC_UNITS[name],
            tuple(directions),
            moved[whole],
            np.stack([each.block_means[name][0].mean(axis=0) for each in found]).reshape(2, -1, 2)[:, whole],
        )
        for name in statistics
    }
    return BearingGradient(
        speed=float(speed),
        statistics=fitted,
        values=values,
        pairs=int(whole.sum()),
        failed=int(failed.sum()),
        inaccurate=sum(int((each.outcome == "inaccurate").sum()) for each in found),
        starts=found[0].cage_slip.shape[1],
        discard=discard,
        revolutions=revolutions,
        spread=spread,
    )


def _values(model: BearingModel, directions: Sequence[str]) -> dict[str, float]:
    """**Raises:** `ValueError` for parameters that are unknown, 0 or named twice."""
    known = parameters(model)
    names = [name for direction in directions for name in direction.split("+")]
    for name in names:
        if name not in known or not float(known[name]):
            raise ArgumentError(
                "directions", said=f"must hold parameters of the bearing that are not 0, but has '{name}'."
            )
        if names.count(name) > 1:
            raise ArgumentError("directions", said=f"must name each parameter once, but has '{name}' twice.")
    return {name: float(known[name]) for name in names}


def _require(
    directions: Sequence[str], statistics: Sequence[str], designs: int, spread: float, revolutions: int
) -> None:
    """**Raises:** `ValueError`."""
    if not directions:
        raise ArgumentError("directions", said="must hold at least one parameter, but it is empty.")
    if not statistics:
        raise ArgumentError("statistics", said="must hold at least one name, but it is empty.")
    if unknown := [name for name in statistics if name not in AVERAGED]:
        raise ArgumentError("statistics", said=f"must hold some of {', '.join(AVERAGED)}, but has '{unknown[0]}'.")
    least = 2 * (len(directions) + 2)
    if designs % 2 or designs < least:
        raise ArgumentError(
            "designs", said=f"must be an even number from {least} on, for so many directions, but {designs} was given."
        )
    if not 0 < spread <= 0.3:
        raise ArgumentError("spread", said=f"must be above 0 and at most 0.3, but {spread:g} was given.")
    if revolutions < 2 or revolutions % 2:
        raise ArgumentError("revolutions", said=f"must be an even number above 0, but {revolutions} was given.")


def _moves(pairs: int, directions: int, seed: int) -> Float[np.ndarray, "pairs directions"]:
    """Places in the box, half way out or further: as many plus as minus in each column, in no order; of full rank."""
    rng, even = np.random.default_rng(seed), np.resize([1.0, -1.0], pairs)
    while True:
        found = np.stack([rng.permutation(even) * rng.uniform(0.5, 1.0, pairs) for _ in range(directions)], axis=-1)
        if np.linalg.matrix_rank(found) == directions:
            return found


def _design(
    model: BearingModel, values: dict[str, float], directions: Sequence[str], moved: Float[np.ndarray, " n"]
) -> BearingModel:
    """The bearing with all its directions moved by relative changes."""
    changed = {
        name: values[name] * (1 + float(share))
        for direction, share in zip(directions, moved, strict=True)
        for name in direction.split("+")
    }
    return replace(model, **changed)


def gradient_of_pairs(
    name: str,
    unit: str,
    directions: tuple[str, ...],
    moved: Float[np.ndarray, "pairs n"],
    halves: Float[np.ndarray, "2 pairs halves"],
) -> StatisticGradient:
    """Slopes of a statistic by least squares, from designs in pairs that mirror each other.

    **Arguments:** name and unit of the statistic; names of the directions; relative changes of the first design of each
    pair, those of the second being the opposite; the statistic of the first designs, and of the second, in both halves
    of the run.
    """
    both = halves.mean(axis=-1)
    half, middle = (both[0] - both[1]) / 2, both.mean(axis=0)
    drift = np.diff(halves, axis=-1).mean(axis=0)[:, 0]
    pairs = len(half)
    inverse = np.linalg.inv(moved.T @ moved)
    slopes = inverse @ moved.T @ half
    left = half - moved @ slopes
    weight = left / (1 - np.einsum("ij,jk,ik->i", moved, inverse, moved))  # HC3
    bread = inverse @ moved.T
    total = float(np.sum(half * half))
    error = lambda x: float(np.std(x, ddof=1) / math.sqrt(pairs))
    return StatisticGradient(
        name=name,
        unit=unit,
        value=float(middle.mean()),
        value_error=error(middle),
        drift=float(drift.mean()),
        drift_error=error(drift),
        directions=directions,
        by_relative_change=slopes,
        covariance=(bread * weight**2) @ bread.T,
        explained=1 - float(np.sum(left * left)) / total if total > 0 else math.nan,
    )
