"""Search for a better design within bounds by a Gaussian process, for noisy values without derivatives.

Each design of a batch is the best of one sample drawn from the process (Thompson sampling), within a trust region
around the best design so far, which grows when designs improve and shrinks when they do not (D. Eriksson et al.,
Scalable Global Optimization via Local Bayesian Optimization, NeurIPS 2019).
"""

import dataclasses
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from .._arguments import require_at_least, require_x64
from .._errors import InputError
from ..lanes import sobol
from ..models import AbstractForcedSystem
from .design_space import Bounds, DesignSpace, Models, Places


AT_BOUND = 0.01
"""Distance from a bound, relative to the span, within which a parameter counts as at the bound."""
CANDIDATES = 512
"""Number of candidate places at which a sample is minimised."""
FIRST, SMALLEST = 0.6, 0.02
"""First and smallest size of the trust region, relative to the spans; below the smallest it starts again."""
LENGTH, NOISE = 0.7, 0.05
"""First guess of the process: correlation length in each parameter, and variance of the noise."""
AMONG = 4
"""Number of the best designs that are compared again at the end."""
OFFSET = 5e-3
"""Offset before taking logarithms, relative to the first value, so that small values do not dominate."""

Values = Callable[[Models], Float[np.ndarray, " designs"]]
"""Function that returns the value of each design, to be minimised; NaN for a design without a value."""


@dataclasses.dataclass(frozen=True)
class Optimum:
    """Best design of a search: varied parameters `values` [SI]; those `at_bound`, where the bound decides instead of
    the objective; `history`, the best value of each batch; `changed`, False if no design was better."""

    model: AbstractForcedSystem
    values: dict[str, float]
    objective: float
    at_bound: tuple[str, ...]
    history: tuple[float, ...]
    changed: bool

    def __str__(self) -> str:
        count = len(self.history)
        rows = [f"Optimum after {count} batch{'es' * (count != 1)}: {self.objective:.6g}"]
        rows += [f"  {n:<24} {v:.6g}{' at bound' if n in self.at_bound else ''}" for n, v in self.values.items()]
        return "\n".join(rows)


def surrogate_search(
    system: AbstractForcedSystem,
    vary: Bounds,
    values: Values,
    *,
    confirm: Values | None = None,
    batches: int = 10,
    batch: int = 12,
    seed: int = 0,
    report: Callable[[int, int], None] | None = None,
) -> Optimum:
    """Minimise a noisy value of designs by changing some parameters.

    **Arguments:** design; bounds [SI] by parameter name, which contain the design; function of a list of designs that
    returns their values; `confirm`, the same with other or longer runs, by which the best few designs and the given one
    are compared again, since the least of many noisy values is biased; number and size of batches, of which the first
    cover the bounds and include the given design; seed; function called with the batches done and all.

    **Raises:** `ValueError` for unknown parameters, bounds that do not ascend or do not hold the design, no batch, and
    batches of fewer than 2 designs.
    """
    require_x64()
    require_at_least(1, batches=batches)
    require_at_least(2, batch=batch)
    require_at_least(0, seed=seed)
    space = DesignSpace.of(system, vary)
    own = space.place
    if outside := [name for name, p in zip(vary, own, strict=True) if not -1e-9 <= p <= 1 + 1e-9]:
        raise InputError(f"The design itself must lie within the bounds, but {', '.join(outside)} does not.")
    search, history = SurrogateSearch(own.clip(0, 1), batch, seed), []
    for number in range(batches):
        places = search.ask()
        search.tell(places, np.asarray(values(space.models(places))))
        history.append(float(np.min(_known(search.values)[-batch:])))
        if report is not None:
            report(number + 1, batches)
    best = np.argsort(_known(search.values), kind="stable")[:AMONG]
    places, found = search.places[best], search.values[best]
    if confirm is not None:
        places = np.vstack([search.first[0], places])
        found = np.asarray(confirm(space.models(places)))
    chosen = int(np.argmin(_known(found)))
    place = places[chosen]
    changed = not np.array_equal(place, search.first[0])
    model, place = (space.model(place), place) if changed else (system, own)
    at_bound = [name for name, p in zip(vary, place, strict=True) if min(p, 1 - p) < AT_BOUND]
    return Optimum(model, space.values(place), float(found[chosen]), tuple(at_bound), tuple(history), changed)


class SurrogateSearch:
    """Search by ask and tell: `ask` proposes places, `tell` takes the values there."""

    def __init__(self, start: Float[np.ndarray, " n"], batch: int, seed: int):
        """**Arguments:** place of the given design; places of a batch; seed."""
        n = len(start)
        self.batch, self.rng = batch, np.random.default_rng(seed)
        self.first = sobol(n, -(-(2 * n + 4) // batch) * batch, self.rng)
        self.first[0] = start
        self.places, self.values = np.empty((0, n)), np.empty(0)
        self.region = FIRST

    def ask(self) -> Places:
        """Propose the next batch of places."""
        if len(self.places) < len(self.first):
            return self.first[len(self.places) :][: self.batch]
        process, noise = _fitted(self.places, _standardised(self.values))
        places = self._candidates(np.atleast_1d(process.kernel_.k1.length_scale))
        mean, spread = process.predict(places, return_cov=True)
        spread = spread + (1e-6 - noise) * np.eye(len(places))
        samples = mean + self.rng.standard_normal((self.batch, len(places))) @ np.linalg.cholesky(spread).T
        chosen: list[int] = []
        for sample in samples:
            sample[chosen] = np.inf
            chosen.append(int(np.argmin(sample)))
        return places[chosen]

    def _candidates(self, lengths: Float[np.ndarray, " n"]) -> Places:
        """Places in the trust region, which is wider in parameters of little effect; each keeps about half of the
        parameters of the best design."""
        middle = self.places[int(np.argmin(_known(self.values)))]
        half = 0.5 * self.region * np.clip(lengths / np.exp(np.mean(np.log(lengths))), 0.3, 3.0)
        low, high = np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)
        places = low + sobol(middle.size, CANDIDATES, self.rng) * (high - low)
        moved = self.rng.random(places.shape) < 0.5
        moved[np.arange(CANDIDATES), self.rng.integers(0, middle.size, CANDIDATES)] = True
        return np.where(moved, places, middle)

    def tell(self, places: Places, values: Float[np.ndarray, " designs"]) -> None:
        """Take the values at these places; NaN for a design without a value."""
        before = np.min(_known(self.values), initial=np.inf)
        self.places, self.values = np.vstack([self.places, places]), np.append(self.values, values)
        if len(self.places) > len(self.first):
            won = np.min(_known(self.values)) < before
            self.region = min(1.4 * self.region, 1.0) if won else 0.7 * self.region
            self.region = FIRST if self.region < SMALLEST else self.region


def _known(values: np.ndarray) -> np.ndarray:
    """Values, with NaN replaced by a value worse than all others."""
    fine = np.isfinite(values)
    worst = np.max(values, where=fine, initial=-np.inf)
    return np.where(fine, values, worst + abs(worst) + 1.0 if fine.any() else 0.0)


def _standardised(values: np.ndarray) -> np.ndarray:
    """Numbers of mean 0 and deviation 1 for the process: logarithms, or the values if one is not positive."""
    known = _known(values)
    if np.all(known > 0):
        known = np.log(known + OFFSET * known[0])
    return (known - np.mean(known)) / (np.std(known) or 1.0)


def _fitted(places: np.ndarray, values: np.ndarray) -> tuple[Any, float]:
    """Process with a length for each parameter, fitted, and the variance of its noise."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels  # takes a second to load

    lengths: Any = np.full(places.shape[1], LENGTH)
    kernel = kernels.Matern(lengths, (0.1, 5.0), nu=2.5) + kernels.WhiteKernel(NOISE, (1e-4, 1.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound: the parameter does nothing
        process: Any = GaussianProcessRegressor(kernel).fit(places, values)
    return process, process.kernel_.k2.noise_level
