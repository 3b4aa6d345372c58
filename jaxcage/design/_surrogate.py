"""Designs made better without a slope: a Gaussian process of what was found chooses the designs that are swept next.

The process is that of the logarithm of the objective. Each design of a batch is the best of one sample drawn from it
(Thompson sampling), among places in a region about the best design so far, which grows while designs become better and
shrinks while they do not (D. Eriksson et al., Scalable Global Optimization via Local Bayesian Optimization, NeurIPS
2019).
"""

import dataclasses
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._checks import require_x64
from .._errors import ArgumentError
from .._sobol import sobol
from ._kept import KeptSearch
from ._objective import AbstractObjective, Design, DesignSpace
from ._optimise import Optimised, Step, ended_at, first_places, optimum_of


CANDIDATES = 512
"""Places among which a sample has its best."""
LARGEST, FIRST, SMALLEST = 1.0, 0.6, 0.02
"""Sizes of the region, as parts of the distance between the bounds. One that has become too small begins again."""
PATIENCE = 2
"""Batches in a row after which the region grows or shrinks."""
BETTER = 1e-3
"""Part of the best value by which a new one must be lower to count as better."""
LENGTH, NOISE = 0.7, 0.05
"""What the process is taken to be unless the designs say otherwise: its correlation length in each parameter, and the
variance of its noise beside its own."""
AMONG = 4
"""The best designs of a search that a finer objective looks at."""
UNCONFIRMED = "not confirmed"
"""How a search ended whose best is no better than the design as it is."""
BESIDE = 5e-3
"""Part of the first value that is added to all of them, so that the logarithm of a small one has no cliff."""

Places = Float[np.ndarray, "designs n"]
Values = Float[np.ndarray, "searches designs"]


def surrogate_search(
    system: Design,
    vary: Mapping[str, tuple[float, float]],
    objective: AbstractObjective,
    *,
    starts: int | Float[np.ndarray, "starts n"] = 1,
    scouts: int = 0,
    batches: int = 10,
    batch: int = 12,
    seed: int = 0,
    keep: str | Path | None = None,
    report: Callable[[int, Values], None] | None = None,
) -> Optimised[Design]:
    """Minimise `objective` over some parameters of a design by a Gaussian process, its designs swept in batches.

    **Arguments:**

    - `system`, `vary`, `objective`, `starts`, `scouts`: as for `jaxcage.optimise`.
    - `batches` of `batch` designs each. The first ones, of twice as many designs as there are parameters and four,
        lie all over the bounds, and the start is among them.
    - `seed`: of all that is drawn.
    - `keep`: file in which the values are saved after each batch; if it exists, the search continues from it.
    - `report`: called with the batch and its values in each search.

    **Returns:** `Optimised`. The history of a search has the best design of each batch, without slopes. An objective
    with noise makes the best of many look better than it is: choose anew with `judged`.

    **Raises:** `ValueError` as `jaxcage.optimise`, and for batches of fewer than 2 designs or no batch.
    """
    require_x64()
    if batch < 2 or batches < 1:
        raise ArgumentError("batch", "batches", said=f"must be at least 2 and 1, but {batch} and {batches} were given.")
    space = DesignSpace.of(system, vary)
    first = first_places(space, objective, starts, scouts, seed)
    searches = [SurrogateSearch(place, batch, (seed, i)) for i, place in enumerate(first)]
    about = {"batches": batches, "batch": batch, "seed": seed, "first": first.tolist()}
    kept = None if keep is None else KeptSearch(keep, space, objective, **about)
    known = None if kept is None else kept.load()
    told = [] if known is None else list(zip(known["places"], known["values"], strict=True))
    for number in range(batches):
        if number == len(told):
            asked = np.array([search.ask() for search in searches])
            told.append((asked, objective.values(space, np.concatenate(asked)).reshape(asked.shape[:2])))
            if kept is not None:
                kept.save(places=np.array([p for p, _ in told]), values=np.array([v for _, v in told]))
            if report is not None:
                report(number, told[-1][1])
        for search, places, values in zip(searches, *told[number], strict=True):
            search.tell(places, values)
    return Optimised.of(space, [optimum_of(space, search.history, "batch limit") for search in searches])


class SurrogateSearch:
    """One search, asked for places and told what was found there; what it asks for follows from what it was told."""

    def __init__(self, start: Float[np.ndarray, " n"], batch: int, seed: tuple[int, ...]):
        n = len(start)
        self.seed, self.batch = seed, batch
        spread = -(-(2 * n + 4) // batch) * batch
        self.first = sobol(n, spread, np.random.default_rng(seed))
        self.first[0] = start
        self.places, self.values = np.empty((0, n)), np.empty(0)
        self.region, self.luck = FIRST, 0
        self.history: list[Step] = []

    def ask(self) -> Places:
        """The next batch."""
        if len(self.places) < len(self.first):
            return self.first[len(self.places) :][: self.batch]
        rng = np.random.default_rng((*self.seed, len(self.places)))
        worth = _worth(self.values)
        process, noise = _fitted(self.places, worth)
        places = self._candidates(np.atleast_1d(process.kernel_.k1.length_scale), rng)
        mean, spread = process.predict(places, return_cov=True)
        spread = spread + (1e-6 - noise) * np.eye(len(places))
        samples = mean + rng.standard_normal((self.batch, len(places))) @ np.linalg.cholesky(spread).T
        chosen: list[int] = []
        for sample in samples:
            sample[chosen] = np.inf
            chosen.append(int(np.argmin(sample)))
        return places[chosen]

    def _candidates(self, lengths: Float[np.ndarray, " n"], rng: np.random.Generator) -> Places:
        """Places in the region, wide in parameters that do little; half of their parameters are as in the best design,
        which is in its middle."""
        middle = self.places[int(np.argmin(_known(self.values)))]
        half = 0.5 * self.region * np.clip(lengths / np.exp(np.mean(np.log(lengths))), 0.3, 3.0)
        low, high = np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)
        places = low + sobol(middle.size, CANDIDATES, rng) * (high - low)
        moved = rng.random(places.shape) < 0.5
        moved[np.arange(CANDIDATES), rng.integers(0, middle.size, CANDIDATES)] = True
        return np.where(moved, places, middle)

    def tell(self, places: Places, values: Float[np.ndarray, " designs"]) -> None:
        """What the designs are worth; NaN for one that has no value."""
        fine = np.isfinite(values)
        best = int(np.argmin(np.where(fine, values, np.inf)))
        value, status = (float(values[best]), "ok") if fine[best] else (np.nan, "no design has a value")
        self.history.append(Step(tuple(places[best].tolist()), value, status=status))
        if len(self.places) >= len(self.first):
            before = np.min(_known(self.values))
            won = np.nanmin(_known(values)) < before - BETTER * abs(before)
            self.luck = max(self.luck, 0) + 1 if won else min(self.luck, 0) - 1
            if abs(self.luck) >= PATIENCE:
                self.region = min(2 * self.region, LARGEST) if won else self.region / 2
                self.luck = 0
            if self.region < SMALLEST:
                self.region = FIRST
        self.places, self.values = np.vstack([self.places, places]), np.append(self.values, values)


def _known(values: np.ndarray) -> np.ndarray:
    """Designs without a value count as worse than all others."""
    fine = np.isfinite(values)
    worst = np.max(values, where=fine, initial=-np.inf)
    return np.where(fine, values, worst + abs(worst) + 1.0 if fine.any() else 0.0)


def _worth(values: np.ndarray) -> np.ndarray:
    """What the process is made of, of mean 0 and deviation 1: the logarithm, or the value if one is not positive."""
    known = _known(values)
    if np.all(known > 0):
        known = np.log(known + BESIDE * known[0])
    return (known - np.mean(known)) / (np.std(known) or 1.0)


def _fitted(places: np.ndarray, worth: np.ndarray) -> tuple[Any, float]:
    """The process with a length for each parameter, most probable after mild priors; and the variance of its noise."""
    from scipy.optimize import minimize
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels  # takes a second to load

    n = places.shape[1]
    lengths: Any = np.full(n, LENGTH)
    kernel = kernels.Matern(lengths, (0.05, 10.0), nu=2.5) + kernels.WhiteKernel(NOISE, (1e-4, 1.0))

    def most_probable(minus: Callable, begin: np.ndarray, bounds: np.ndarray) -> tuple[np.ndarray, float]:
        def with_priors(theta: np.ndarray) -> tuple[float, np.ndarray]:
            value, slope = minus(theta)
            return float(value + 0.5 * np.sum((theta - begin) ** 2)), slope + theta - begin

        found = minimize(with_priors, begin, jac=True, method="L-BFGS-B", bounds=bounds)
        return found.x, found.fun

    process: Any = GaussianProcessRegressor(kernel, alpha=1e-10, optimizer=most_probable)  # pyright: ignore[reportArgumentType]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound: the parameter does nothing
        process.fit(places, worth)
    return process, process.kernel_.k2.noise_level


def judged(found: Optimised[Design], objective: AbstractObjective) -> tuple[Optimised[Design], float]:
    """The same searches, with the best of each chosen anew by a finer objective.

    What a search saw as its best is better than it is, since of many values with noise the least is chosen. The finer
    objective looks at the best few of each search and at the design that the searches began with: where that one is the
    best, it stays.

    **Arguments:** what was found; an objective with more speeds, starts or revolutions.

    **Returns:** the searches, the best first by the finer objective; and what that says of the design itself.
    """
    space = found.space
    own = np.clip(space.place, 0.0, 1.0)
    picked = [
        sorted((s for s in o.history if s.status == "ok"), key=lambda s: s.value)[:AMONG] or [o.history[-1]]
        for o in found.optima
    ]
    values = objective.values(space, np.array([own, *(s.place for steps in picked for s in steps)]))
    itself = Step(tuple(own.tolist()), float(values[0]))
    optima, others = [], iter(values[1:].tolist())
    for o, steps in zip(found.optima, picked, strict=True):
        finer = [dataclasses.replace(s, value=x) for s, x in zip(steps, others, strict=False)]
        best = min([itself, *finer], key=lambda s: np.nan_to_num(s.value, nan=np.inf))
        optima.append(ended_at(space, best, o.history, "nothing better found" if best is itself else o.status))
    return Optimised.of(space, optima), itself.value


def unchanged(found: Optimised[Design], value: float) -> Optimised[Design]:
    """The same searches with the design as it is, and what it is worth, in front: what they found is no better."""
    place = tuple(np.clip(found.space.place, 0.0, 1.0).tolist())
    own = ended_at(found.space, Step(place, value), found.best.history, UNCONFIRMED)
    return Optimised((own, *found.optima), found.space)
