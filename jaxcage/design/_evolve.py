"""Designs made better without a slope: an evolution strategy from each start, its designs swept in one batch.

Each generation is drawn from a normal distribution, whose middle and shape follow the better half of what was found (N.
Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772). On many parameters and a rugged objective it found
better designs than slopes did, at the same number of designs: `python -m benchmarks.pay` compares them.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._checks import require_x64
from .._errors import ArgumentError
from ._kept import KeptSearch
from ._objective import AbstractObjective, DesignSpace
from ._optimise import Optimised, Step, ended_at, first_places, optimum_of
from ._unknowns import Design


Values = Float[np.ndarray, "searches designs"]


def evolve(
    system: Design,
    vary: Mapping[str, tuple[float, float]],
    objective: AbstractObjective,
    *,
    starts: int | Float[np.ndarray, "starts n"] = 1,
    scouts: int = 0,
    generations: int = 40,
    population: int = 12,
    spread: float = 0.3,
    seed: int = 0,
    keep: str | Path | None = None,
    report: Callable[[int, Values], None] | None = None,
) -> Optimised[Design]:
    """Minimise `objective` over some parameters of a design by CMA-ES.

    **Arguments:**

    - `system`, `vary`, `objective`, `starts`, `scouts`: as for `jaxcage.optimise`.
    - `generations` of `population` designs each; one of the last is the middle of the distribution.
    - `spread`: standard deviation of the first generation, as a part of the distance between the bounds.
    - `seed`: of all that is drawn.
    - `keep`: file in which the values are saved after each generation; if it exists, the search continues from it.
    - `report`: called with the generation and its values in each search.

    **Returns:** `Optimised`. The history of a search has the best design of each generation, without slopes. An
    objective with noise makes the best of many look better than it is: choose anew with `judged`.

    **Raises:** `ValueError` as `jaxcage.optimise`, and for populations below 4 or no generation.
    """
    require_x64()
    if population < 4 or generations < 1:
        raise ArgumentError(
            "population",
            "generations",
            said=f"must be at least 4 and 1, but {population} and {generations} were given.",
        )
    space = DesignSpace.of(system, vary)
    first = first_places(space, objective, starts, scouts, seed)
    searches = [_Search(place, population, spread, seed + i) for i, place in enumerate(first)]
    kept = None
    if keep is not None:
        about = dict(generations=generations, population=population, spread=spread, seed=seed, first=first.tolist())
        kept = KeptSearch(keep, space, **about)
    known = None if kept is None else kept.load()
    told: list[Values] = [] if known is None else list(known["told"])
    for generation in range(generations):
        asked = [search.ask(middle=generation == generations - 1) for search in searches]
        if generation == len(told):
            told.append(objective.values(space, np.concatenate(asked)).reshape(len(searches), population))
            if kept is not None:
                kept.save(told=np.array(told))
            if report is not None:
                report(generation, told[-1])
        for search, places, values in zip(searches, asked, told[generation], strict=True):
            search.tell(places, values)
    return Optimised.of(space, [optimum_of(space, search.history, "generation limit") for search in searches])


class _Search:
    """One evolution, with random numbers of its own: told the same values, it asks for the same designs."""

    def __init__(self, place: Float[np.ndarray, " n"], population: int, spread: float, seed: int):
        import cma  # takes a second to load

        rng = np.random.default_rng(seed)
        options = {
            "bounds": [0.0, 1.0],
            "popsize": population,
            "seed": np.nan,
            "randn": lambda *shape: rng.standard_normal(shape),
            "verbose": -9,
        }
        self.inner: Any = cma.CMAEvolutionStrategy(place, spread, options)
        self.history: list[Step] = []

    def ask(self, middle: bool) -> Float[np.ndarray, "designs n"]:
        """The next generation, one of it the middle of the distribution if so asked."""
        places = np.array(self.inner.ask())
        if middle:
            places[-1] = self.inner.result.xfavorite
        return np.clip(places, 0.0, 1.0)

    def tell(self, places: Float[np.ndarray, "designs n"], values: Float[np.ndarray, " designs"]) -> None:
        """What the designs are worth: one without a value counts as worse than all others."""
        known = np.isfinite(values)
        best = int(np.argmin(np.where(known, values, np.inf)))
        nothing = (np.nan,) * places.shape[1]
        status = "ok" if known[best] else "no design has a value"
        value = float(values[best]) if known[best] else np.nan
        self.history.append(Step(tuple(places[best].tolist()), value, np.nan, nothing, nothing, status))
        worst = np.max(values, where=known, initial=-1e300) if known.any() else 0.0
        self.inner.tell(list(places), np.where(known, values, worst + abs(worst) + 1.0).tolist())


def judged(found: Optimised[Design], objective: AbstractObjective, among: int = 4) -> tuple[Optimised[Design], float]:
    """The same searches, with the best of each chosen anew by a finer objective.

    What a search saw as its best is better than it is, since of many values with noise the least is chosen. The finer
    objective looks at the best few of each search and at the design that the searches began with: where that one is the
    best, it stays.

    **Arguments:** what was found; an objective with more speeds, starts or revolutions; how many designs of each.

    **Returns:** the searches, the best first by the finer objective; and what that says of the design itself.
    """
    space = found.space
    own = np.clip(space.place, 0.0, 1.0)
    picked = [
        sorted((s for s in o.history if s.status == "ok"), key=lambda s: s.value)[:among] or [o.history[-1]]
        for o in found.optima
    ]
    values = objective.values(space, np.array([own, *(s.place for steps in picked for s in steps)]))
    nothing = (np.nan,) * own.size
    itself = Step(tuple(own.tolist()), float(values[0]), np.nan, nothing, nothing)
    optima, first = [], 1
    for o, steps in zip(found.optima, picked, strict=True):
        of = [itself]
        for step, value in zip(steps, values[first:], strict=False):
            of.append(Step(step.place, float(value), np.nan, step.slope, step.slope_error))
        first += len(steps)
        best = min(of, key=lambda s: np.nan_to_num(s.value, nan=np.inf))
        optima.append(ended_at(space, best, o.history, "nothing better found" if best is itself else o.status))
    return Optimised.of(space, optima), float(values[0])
