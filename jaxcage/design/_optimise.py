"""Designs made better by gradient: bounded parameters, any optax optimiser, many starts at a time.

A position between the bounds is a logistic function of an unbounded number, so that no step leaves the bounds. All
searches take their steps together, and their objectives are computed in one batch. A step to where the objective has no
value is undone by half. The search ends when the slope is small.
"""

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Float

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError, InputError
from .._sobol import sobol
from ._kept import KeptSearch
from ._objective import AbstractObjective, Design, DesignSpace, Measured


AT_BOUND = 0.01
"""A parameter within this part of the bounds' distance of one is at it."""
INSIDE = 0.02
"""Starts are kept this far from the bounds, where a logistic function has no slope."""
SAME = 0.05
"""Two optima within this part of the bounds' distance in every parameter are one."""


@dataclasses.dataclass(frozen=True)
class Step:
    """Where one search stood after a step."""

    place: tuple[float, ...]
    value: float
    slope: tuple[float, ...] = ()
    """Nothing for a search that takes no slopes."""
    status: str = "ok"


@dataclasses.dataclass(frozen=True)
class Optimum(Generic[Design]):
    """Where one search ended: its best design."""

    values: dict[str, float]
    """[SI]."""
    objective: float
    at_bound: tuple[str, ...]
    """Parameters that ended at a bound: there the bound chose, not the objective."""
    history: tuple[Step, ...]
    status: str
    """`slope is small`, `step limit`, `batch limit`, or why the objective has no value."""
    model: Design
    """The design itself, of the kind that the search began with."""

    def __str__(self) -> str:
        rows = [f"Optimum after {len(self.history) - 1} steps ({self.status}): {self.objective:.6g}"]
        rows += [f"  {n:<24} {v:.6g}{' at bound' if n in self.at_bound else ''}" for n, v in self.values.items()]
        return "\n".join(rows)


@dataclasses.dataclass(frozen=True)
class Optimised(Generic[Design]):
    """What the searches from all starts found, the best first."""

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
        """Optima that differ, with how many starts led to each."""
        found: list[tuple[Optimum[Design], int]] = []
        for optimum in self.optima:
            for i, (other, count) in enumerate(found):
                if np.max(np.abs(self.space.place_of(other.values) - self.space.place_of(optimum.values))) < SAME:
                    found[i] = (other, count + 1)
                    break
            else:
                found.append((optimum, 1))
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
    """Minimise `objective` over some parameters of a design.

    **Arguments:**

    - `system`: the design; `vary`: bounds [SI] by parameter name.
    - `objective`: a sum of objectives with slopes, such as `zone_width(edges) + 500 * cost()`.
    - `optimiser`: an optax optimiser of the unbounded variables; by default Adam with a decreasing rate.
    - `starts`: number of searches, the first from the design itself, the others from quasi-random points; or these
        points, as fractions of the way from the lower bounds to the upper ones.
    - `scouts`: number of quasi-random points evaluated beforehand, without slopes; searches start from the best.
    - `steps`: at most so many; `tolerance`: a slope below this fraction of the first value of the objective is small.
    - `seed`: of the quasi-random points.
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
    first = first_places(space, objective, starts, scouts, seed)
    z = np.log(first / (1 - first))
    with jax.numpy_dtype_promotion("standard"):  # optax mixes steps and numbers
        state = jax.vmap(chosen.init)(jnp.asarray(z))
    history: list[list[Step]] = [[] for _ in first]
    about = {"steps": steps, "tolerance": tolerance, "first": first.tolist()}
    kept = None if keep is None else KeptSearch(keep, space, objective, **about)
    if kept is not None:
        z, state, history = _loaded(kept, z, state, history)
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
        state = jax.tree.map(
            lambda new, old: jnp.where(fine.reshape(-1, *[1] * (new.ndim - 1)), new, old), moved, state
        )
        stepped = np.where(fine[:, None], z + np.asarray(update), (z + before) / 2)  # half way back
        before = np.where(fine[:, None], z, before)
        z = np.where(np.isin(np.arange(len(z)), live)[:, None], stepped, z)
        if kept is not None:
            _save(kept, z, state, history)
    status = lambda h: "slope is small" if _settled(h, tolerance) else "step limit"
    return Optimised.of(space, [optimum_of(space, h, status(h)) for h in history])


def first_places(
    space: DesignSpace, objective: AbstractObjective, starts: int | np.ndarray, scouts: int, seed: int
) -> Float[np.ndarray, "starts n"]:
    """Where searches start."""
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
    drawn = drawn[: starts - 1]
    return np.clip(np.vstack([own, drawn]), INSIDE, 1 - INSIDE)


def _settled(history: Sequence[Step], tolerance: float) -> bool:
    """Whether the slope is small."""
    if not history or history[-1].status != "ok":
        return False
    place, slope = np.array(history[-1].place), np.array(history[-1].slope)
    size = max(abs(next((s.value for s in history if s.status == "ok"), 1.0)), 1e-300)
    return bool(np.max(np.abs(slope * place * (1 - place))) < tolerance * size)


def optimum_of(space: DesignSpace[Design], history: Sequence[Step], status: str) -> Optimum[Design]:
    """The best step of a search."""
    known = [s for s in history if s.status == "ok"] or [history[-1]]
    best = min(known, key=lambda s: s.value)
    return ended_at(space, best, history, status if best.status == "ok" else best.status)


def ended_at(space: DesignSpace[Design], best: Step, history: Sequence[Step], status: str) -> Optimum[Design]:
    """The optimum at a step."""
    place = np.array(best.place)
    edge = [n for n, p in zip(space.names, place, strict=True) if min(p, 1 - p) < AT_BOUND]
    return Optimum(space.values(place), best.value, tuple(edge), tuple(history), status, space.model(place))


def _save(kept: KeptSearch, z: np.ndarray, state: Any, history: Sequence[Sequence[Step]]) -> None:
    leaves = {f"leaf_{i}": np.asarray(x) for i, x in enumerate(jax.tree.leaves(state))}
    rows = json.dumps([[dataclasses.asdict(s) for s in h] for h in history])
    kept.save(z=z, history=np.asarray(rows), **leaves)


def _loaded(
    kept: KeptSearch, z: np.ndarray, state: Any, history: list[list[Step]]
) -> tuple[np.ndarray, Any, list[list[Step]]]:
    """What was saved; what is given if nothing was."""
    found = kept.load()
    if found is None:
        return z, state, history
    leaves, tree = jax.tree.flatten(state)
    state = jax.tree.unflatten(tree, [jnp.asarray(found[f"leaf_{i}"]) for i in range(len(leaves))])
    return found["z"], state, [[_read(row) for row in h] for h in json.loads(str(found["history"]))]


def _read(row: dict[str, Any]) -> Step:
    tuples: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in row.items()}
    return Step(**tuples)
