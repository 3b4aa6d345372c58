"""Searches for better designs within bounds: by gradient, and by a Gaussian process where there is none.

By gradient: a position between the bounds is a logistic function of an unbounded number, so that no step leaves the
bounds. All searches take their steps together, and their objectives are computed in one batch. A step to where the
objective has no value is undone by half.

By a Gaussian process of the logarithm of the objective: each design of a batch is the best of one sample drawn from it
(Thompson sampling), among places in a region about the best design so far, which grows while designs become better and
shrinks while they do not (D. Eriksson et al., Scalable Global Optimization via Local Bayesian Optimization, NeurIPS
2019).
"""

import dataclasses
import json
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Float

from .._arguments import require_at_least, require_x64
from .._errors import ArgumentError, InputError
from ..lanes import sobol
from .checkpoint import Checkpoint
from .objective import AbstractObjective, Design, DesignSpace, Measured


AT_BOUND = 0.01
"""Distance from a bound within which a parameter is at the bound, as a part of the bounds' distance."""
INSIDE = 0.02
"""Distance of starts from the bounds, where a logistic function has no slope."""
SAME = 0.05
"""Largest difference of two optima that count as one, as a part of the bounds' distance in every parameter."""
CANDIDATES = 512
"""Places among which a sample has its best."""
LARGEST, FIRST, SMALLEST = 1.0, 0.6, 0.02
"""Sizes of the region, as parts of the distance between the bounds. One that has become too small begins again."""
PATIENCE = 2
"""Batches in a row after which the region grows or shrinks."""
BETTER = 1e-3
"""Part of the best value by which a new one must be lower to count as better."""
LENGTH, NOISE = 0.7, 0.05
"""Prior of the process: its correlation length in each parameter, and the variance of its noise beside its own."""
AMONG = 4
"""Number of the best designs of a search that a finer objective compares."""
OFFSET = 5e-3
"""Part of the first value that is added to all of them, so that the logarithm of a small one has no cliff."""

Places = Float[np.ndarray, "designs n"]
Values = Float[np.ndarray, "searches designs"]


@dataclasses.dataclass(frozen=True)
class Step:
    """A search after a step."""

    place: tuple[float, ...]
    value: float
    slope: tuple[float, ...] = ()
    """Empty for a search without slopes."""
    status: str = "ok"


@dataclasses.dataclass(frozen=True)
class Optimum(Generic[Design]):
    """The best design of one search."""

    values: dict[str, float]
    """[SI]."""
    objective: float
    at_bound: tuple[str, ...]
    """Parameters that ended at a bound: there the bound chose, not the objective."""
    history: tuple[Step, ...]
    status: str
    """`slope is small`, `step limit`, `batch limit`, or why the objective has no value."""
    model: Design

    @classmethod
    def at(cls, space: DesignSpace[Design], best: Step, history: Sequence[Step], status: str) -> "Optimum[Design]":
        """The optimum at a step."""
        place = np.array(best.place)
        edge = [n for n, p in zip(space.names, place, strict=True) if min(p, 1 - p) < AT_BOUND]
        return cls(space.values(place), best.value, tuple(edge), tuple(history), status, space.model(place))

    @classmethod
    def of(cls, space: DesignSpace[Design], history: Sequence[Step], status: str) -> "Optimum[Design]":
        """The best step of a search."""
        known = [s for s in history if s.status == "ok"] or [history[-1]]
        best = min(known, key=lambda s: s.value)
        return cls.at(space, best, history, status if best.status == "ok" else best.status)

    def __str__(self) -> str:
        rows = [f"Optimum after {len(self.history) - 1} steps ({self.status}): {self.objective:.6g}"]
        rows += [f"  {n:<24} {v:.6g}{' at bound' if n in self.at_bound else ''}" for n, v in self.values.items()]
        return "\n".join(rows)


@dataclasses.dataclass(frozen=True)
class Optimised(Generic[Design]):
    """Optima of the searches from all starts, the best first."""

    optima: tuple[Optimum[Design], ...]
    space: DesignSpace[Design]

    @classmethod
    def of(cls, space: DesignSpace[Design], optima: Sequence[Optimum[Design]]) -> "Optimised[Design]":
        """From optima in any order."""
        return cls(tuple(sorted(optima, key=lambda o: np.nan_to_num(o.objective, nan=np.inf))), space)

    @property
    def best(self) -> Optimum[Design]:
        """The best of all."""
        return self.optima[0]

    @property
    def distinct(self) -> tuple[tuple[Optimum[Design], int], ...]:
        """Optima that differ, with the number of starts that led to each."""
        found: list[tuple[Optimum[Design], int]] = []
        place = lambda optimum: self.space.place_of(optimum.values)
        for optimum in self.optima:
            near = (i for i, (other, _) in enumerate(found) if np.max(np.abs(place(other) - place(optimum))) < SAME)
            if (i := next(near, None)) is None:
                found.append((optimum, 1))
            else:
                found[i] = (found[i][0], found[i][1] + 1)
        return tuple(found)

    def __str__(self) -> str:
        head = f"{len(self.optima)} starts led to {len(self.distinct)} optima"
        return "\n".join([head, *(f"{optimum}\n  reached by {count}" for optimum, count in self.distinct)])


def optimise(
    system: Design,
    vary: Mapping[str, tuple[float, float]],
    objective: AbstractObjective,
    *,
    optimiser: optax.GradientTransformation | None = None,
    starts: int | Float[np.ndarray, "starts n"] = 1,
    scouts: int = 0,
    steps: int = 40,
    tolerance: float = 1e-3,
    seed: int = 0,
    keep: str | Path | None = None,
    report: Callable[[int, Sequence[Measured]], None] | None = None,
) -> Optimised[Design]:
    """Minimise `objective` over some parameters of a design, by its slope.

    **Arguments:**

    - `system`: the design; `vary`: bounds [SI] by parameter name.
    - `objective`: a sum of objectives with slopes, such as `zone_width(edges) + 500 * cost()`.
    - `optimiser`: an optax optimiser of the unbounded variables; by default Adam with a decreasing rate.
    - `starts`: number of searches, the first from the design itself, the others from quasi-random points; or these
        points, as fractions of the way from the lower bounds to the upper ones.
    - `scouts`: number of quasi-random points evaluated beforehand, without slopes; searches start from the best.
    - `steps`: largest number of steps; `tolerance`: a slope below this fraction of the first value is small.
    - `seed`: seed of the quasi-random points.
    - `keep`: file in which the state is saved after each step; if it exists, the search continues from it, with the
        same optimiser.
    - `report`: called with the step and what was measured in each search.

    **Returns:** `Optimised`.

    **Raises:** `ValueError` for unknown parameters, bounds that do not ascend, starts outside, an objective without a
    slope, or a kept file of another search.
    """
    require_x64()
    require_at_least(0, seed=seed)
    require_at_least(1, steps=steps)
    space = DesignSpace.of(system, vary)
    chosen = optax.adam(optax.cosine_decay_schedule(0.5, max(steps, 1), 0.1)) if optimiser is None else optimiser
    first = _first_places(space, objective, starts, scouts, seed)
    z = np.log(first / (1 - first))
    with jax.numpy_dtype_promotion("standard"):  # optax mixes steps and numbers
        state = jax.vmap(chosen.init)(jnp.asarray(z))
    history: list[list[Step]] = [[] for _ in first]
    about = {"steps": steps, "tolerance": tolerance, "first": first.tolist()}
    kept = None if keep is None else Checkpoint(keep, space, objective, **about)
    if kept is not None and (found := kept.load()) is not None:
        leaves, tree = jax.tree.flatten(state)
        state = jax.tree.unflatten(tree, [jnp.asarray(found[f"leaf_{i}"]) for i in range(len(leaves))])
        z, history = found["z"], [[_read(row) for row in h] for h in json.loads(str(found["history"]))]
    before = z.copy()
    while (step := max(map(len, history))) <= steps:
        places = 1 / (1 + np.exp(-z))
        live = [i for i in range(len(z)) if not _settled(history[i], tolerance)]
        if not live:
            break
        measured = dict(zip(live, objective.measure(space, places[live]), strict=True))
        gradient = np.zeros_like(z)
        for i, m in measured.items():
            history[i].append(Step(tuple(places[i].tolist()), m.value, tuple(m.slope.tolist()), m.status))
            if m.status == "ok":
                gradient[i] = m.slope * places[i] * (1 - places[i])
        if report is not None:
            report(step, list(measured.values()))
        with jax.numpy_dtype_promotion("standard"):
            update, moved = jax.vmap(chosen.update)(jnp.asarray(gradient), state, jnp.asarray(z))
        fine = np.array([i in measured and measured[i].status == "ok" for i in range(len(z))])
        pick = lambda new, old: jnp.where(fine.reshape(-1, *[1] * (new.ndim - 1)), new, old)
        state = jax.tree.map(pick, moved, state)
        stepped = np.where(fine[:, None], z + np.asarray(update), (z + before) / 2)  # half way back
        before = np.where(fine[:, None], z, before)
        z = np.where(np.isin(np.arange(len(z)), live)[:, None], stepped, z)
        if kept is not None:
            rows = json.dumps([[dataclasses.asdict(s) for s in h] for h in history])
            leaves = {f"leaf_{i}": np.asarray(x) for i, x in enumerate(jax.tree.leaves(state))}
            kept.save(z=z, history=np.asarray(rows), **leaves)
    status = lambda h: "slope is small" if _settled(h, tolerance) else "step limit"
    return Optimised.of(space, [Optimum.of(space, h, status(h)) for h in history])


def _read(row: dict[str, Any]) -> Step:
    read: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in row.items()}
    return Step(**read)


def _settled(history: Sequence[Step], tolerance: float) -> bool:
    """True if the slope is small."""
    if not history or history[-1].status != "ok":
        return False
    place, slope = np.array(history[-1].place), np.array(history[-1].slope)
    size = max(abs(next((s.value for s in history if s.status == "ok"), 1.0)), 1e-300)
    return bool(np.max(np.abs(slope * place * (1 - place))) < tolerance * size)


def _first_places(
    space: DesignSpace, objective: AbstractObjective, starts: int | np.ndarray, scouts: int, seed: int
) -> Float[np.ndarray, "starts n"]:
    """Places from which searches start."""
    if isinstance(starts, np.ndarray):
        if starts.ndim != 2 or starts.shape[1] != len(space.names) or not np.all((starts >= 0) & (starts <= 1)):
            raise ArgumentError("starts", said="must hold places between 0 and 1, one column for each parameter.")
        return np.clip(starts, INSIDE, 1 - INSIDE)
    require_at_least(1, starts=starts)
    own = space.place
    if not np.all((own >= 0) & (own <= 1)):
        outside = ", ".join(n for n, p in zip(space.names, own, strict=True) if not 0 <= p <= 1)
        raise InputError(f"The design itself must lie within the bounds, but {outside} does not.")
    if scouts and scouts < starts - 1:
        raise ArgumentError("scouts", said=f"must be 0 or at least {starts - 1}, but {scouts} was given.")
    count = max(scouts, starts - 1)
    drawn = sobol(len(own), max(count, 2), seed)[:count]
    if scouts and starts > 1:
        drawn = drawn[np.argsort(objective.values(space, drawn), kind="stable")]  # NaN comes last
    return np.clip(np.vstack([own, drawn[: starts - 1]]), INSIDE, 1 - INSIDE)


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
    """Minimise `objective` over some parameters of a design by a Gaussian process, its designs run in batches.

    **Arguments:**

    - `system`, `vary`, `objective`, `starts`, `scouts`: as for `jaxcage.optimise`.
    - `batches` of `batch` designs each. The first ones, of twice as many designs as there are parameters and four,
        lie all over the bounds, and the start is among them.
    - `seed`: seed of all that is drawn.
    - `keep`: file in which the values are saved after each batch; if it exists, the search continues from it.
    - `report`: called with the batch and its values in each search.

    **Returns:** `Optimised`. The history of a search has the best design of each batch, without slopes. An objective
    with noise makes the best of many look better than it is: choose again with `confirmed`.

    **Raises:** `ValueError` as `jaxcage.optimise`, and for batches of fewer than 2 designs or no batch.
    """
    require_x64()
    if batch < 2 or batches < 1:
        raise ArgumentError("batch", "batches", said=f"must be at least 2 and 1, but {batch} and {batches} were given.")
    space = DesignSpace.of(system, vary)
    first = _first_places(space, objective, starts, scouts, seed)
    searches = [SurrogateSearch(place, batch, (seed, i)) for i, place in enumerate(first)]
    about = {"batches": batches, "batch": batch, "seed": seed, "first": first.tolist()}
    kept = None if keep is None else Checkpoint(keep, space, objective, **about)
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
    return Optimised.of(space, [Optimum.of(space, search.history, "batch limit") for search in searches])


class SurrogateSearch:
    """One search, which is asked for places and told the values there; its places follow from the values."""

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
        process, noise = _fitted(self.places, _standardised(self.values))
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
        """Places in the region about the best design, wide in parameters that do little; half of their parameters are
        as in the best design."""
        middle = self.places[int(np.argmin(_known(self.values)))]
        half = 0.5 * self.region * np.clip(lengths / np.exp(np.mean(np.log(lengths))), 0.3, 3.0)
        low, high = np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)
        places = low + sobol(middle.size, CANDIDATES, rng) * (high - low)
        moved = rng.random(places.shape) < 0.5
        moved[np.arange(CANDIDATES), rng.integers(0, middle.size, CANDIDATES)] = True
        return np.where(moved, places, middle)

    def tell(self, places: Places, values: Float[np.ndarray, " designs"]) -> None:
        """Take the values of designs; NaN for a design without a value."""
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
    """Values, with one worse than all others for designs without a value."""
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
    """The process with a length for each parameter, most probable after mild priors; and the variance of its noise."""
    from scipy.optimize import minimize
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels  # takes a second to load

    lengths: Any = np.full(places.shape[1], LENGTH)
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
        process.fit(places, values)
    return process, process.kernel_.k2.noise_level


def confirmed(found: Optimised[Design], objective: AbstractObjective) -> tuple[Optimised[Design], float]:
    """The same searches, with the best design of each chosen again by a finer objective.

    The least of many values with noise is lower than the true value there. The finer objective compares the best few
    designs of each search and the design that the searches began with: if that is the best, it stays.

    **Arguments:** the searches; an objective with more speeds, starts or revolutions.

    **Returns:** the searches, the best first by the finer objective; and its value for the design itself.
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
        optima.append(Optimum.at(space, best, o.history, "nothing better found" if best is itself else o.status))
    return Optimised.of(space, optima), itself.value
