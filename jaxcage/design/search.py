"""Designs for calm operation: the lowest cost at which all requirements hold, by exact gradients.

Requirements are constraints of sequential programmes within a trust region, each solved by SciPy's SLSQP, or of an
augmented Lagrangian whose descent is optax's. A step at which an edge is lost is halved. With
tolerances each requirement is kept by the worst bearing within them: its constraint is tightened by what the worst
corner takes away, which the gradient names and a full solution at the corner measures, until both agree.
"""

import abc
import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Float
from scipy.optimize import minimize, nnls

from .._arguments import require_at_least, require_x64
from .._errors import ArgumentError
from ..lanes import sobol
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod
from .check import Checked, check_design
from .operating import DesignSpace, OperatingRange, Value, function_value
from .requirements import Cost, Requirement, Requirements, balance_grade, cost_function, listed, values_at
from .tolerance import Budget, Tolerance, budget_of, corner, widened
from .unstable_width import UnstableWidth


LOST = 10.0  # slack of every requirement, negative, at a trial that has no values
KEPT = 1e-3  # slack, negative, at which a requirement still counts as kept
ACTIVE = 5e-3  # slack below which a requirement takes part in the cost
ROUNDS = 4  # of tightening by the worst corners
ITERATIONS, ACCURACY = 30, 1e-4
FIRST_RADIUS, LARGEST_RADIUS, LEAST_RADIUS = 0.1, 0.4, 2e-3  # of the steps, over the bounds
PENALTY = 10.0  # price of a shortfall by 1, over the cost of the given design


class Trial(NamedTuple):
    """A place of the design space: cost with its derivatives, slacks of the requirements with theirs, and values."""

    place: Float[np.ndarray, " n"]
    cost: float
    cost_slope: Float[np.ndarray, " n"]
    slack: Float[np.ndarray, " m"]
    slack_slope: Float[np.ndarray, "m n"]
    values: dict[str, Value]
    lost: str = ""


@dataclasses.dataclass(frozen=True)
class Design:
    """A design for calm operation, and what is known of it.

    - `model`: the design; `values`: its changed parameters [SI]; `cost` and that of the given design, `cost_before`.
    - `before` and `after`: what each requirement concerns, at the given design and at this one.
    - `feasible`: whether every requirement holds, for every bearing within the tolerances if there are some.
    - `short`: how far each broken requirement is from holding, in its unit; `conflict`: requirements and bounds that
        together forbid a feasible design, empty if there is one.
    - `prices`: what one unit more of each requirement that binds costs (Lagrange multipliers).
    - `at_bound`: parameters at a bound; `corners`: values at the worst corner of the tolerances for each requirement.
    - `budget`: how wide each tolerance may be; `notes`: edges that ended on the way, and what bounds the range now.
    - `evaluations`: designs whose edges were solved for; `checked`: a sweep from many initial states, None without.
    """

    model: AbstractForcedSystem
    values: dict[str, float]
    cost: float
    cost_before: float
    requirements: list[Requirement]
    before: dict[str, Value]
    after: dict[str, Value]
    feasible: bool
    short: dict[str, float]
    conflict: tuple[str, ...]
    prices: dict[str, float]
    at_bound: tuple[str, ...]
    corners: dict[str, Value]
    budget: list[Budget]
    notes: tuple[str, ...]
    evaluations: int
    path: list[dict[str, float]]
    checked: Checked | None

    @property
    def verdict(self) -> str:
        """`calm`, `stable, but not from every start`, or `not feasible`."""
        if not self.feasible:
            return "not feasible"
        return "calm" if self.checked is None or self.checked.calm else "stable, but not from every start"

    def __str__(self) -> str:
        rows = [f"Design: {self.verdict}, cost {self.cost_before:.4g} -> {self.cost:.4g}"]
        rows += [f"  {name} = {value:.6g}" for name, value in self.values.items()]
        for r in self.requirements:
            was = f"{self.before[r.of].value:.4g}" if r.of in self.before else "unknown"
            rows.append(f"  {r.name}: {was} -> {self.after[r.of].value:.4g} {r.unit} (limit {r.limit:.4g})")
        return "\n".join(rows)


class _Problem(abc.ABC):
    """Trials of one search, each computed once."""

    def __init__(self, space: DesignSpace, operating: tuple[float, float], wanted: list[Requirement], free: np.ndarray):
        self.space, self.operating, self.wanted, self.free = space, operating, wanted, free
        self.tightened = np.zeros(len(wanted))
        self.trials: dict[bytes, Trial] = {}
        self.notes: list[str] = []

    @abc.abstractmethod
    def compute(self, place: np.ndarray) -> Trial:
        """The trial at a place."""

    def foreseen(self, trial: Trial, place: np.ndarray) -> tuple[float, np.ndarray]:
        """The cost near a trial and its derivatives, to first order where it is dear to compute."""
        return trial.cost + float(trial.cost_slope @ (place - trial.place)), trial.cost_slope

    def at(self, place: np.ndarray) -> Trial:
        """The trial at a place."""
        place = np.asarray(place, dtype=float)
        key = place.tobytes()
        if key not in self.trials:
            self.trials[key] = self.compute(place)
        return self.trials[key]

    def nowhere(self, place: np.ndarray, cost: float, slope: np.ndarray, why: str) -> Trial:
        """A trial at which an edge is lost."""
        m, n = len(self.wanted), place.size
        return Trial(place, cost, slope, np.full(m, -LOST), np.zeros((m, n)), {}, why)

    def whole(self, x: np.ndarray, like: np.ndarray) -> np.ndarray:
        """The place of the parameters that vary, the others as they are at `like`."""
        place = like.copy()
        place[self.free] = x
        return place

    def slack(self, place: np.ndarray) -> np.ndarray:
        """Slacks, less what the tolerances take away."""
        return self.at(place).slack - self.tightened


class _CostProblem(_Problem):
    """Requirements over an operating range, and a cost that is cheap to compute."""

    def __init__(self, range_: OperatingRange, wanted: list[Requirement], cost: Callable[[Any], Any], free: np.ndarray):
        super().__init__(range_.space, range_.operating, wanted, free)
        self.range, self.cost, self.notes = range_, cost, range_.handed_over

    def foreseen(self, trial: Trial, place: np.ndarray) -> tuple[float, np.ndarray]:
        value, slope = function_value(self.cost, self.range.space, jnp.asarray(place))
        return float(value), np.asarray(slope)

    def compute(self, place: np.ndarray) -> Trial:
        value, slope = function_value(self.cost, self.range.space, jnp.asarray(place))
        before = len(self.notes)
        values = values_at(self.range, place, self.wanted)
        pairs = [] if isinstance(values, str) else [r.slack(values[r.of]) for r in self.wanted]
        if pairs and len(self.notes) > before and min(s for s, _ in pairs[:2]) < -KEPT:
            values = "; ".join(self.notes[before:])  # a jump to the wrong side, where no slope leads back
            self.range.forget(place)
        if isinstance(values, str):
            return self.nowhere(place, float(value), np.asarray(slope), values)
        slack, by = (np.array(x) for x in zip(*pairs, strict=True))
        return Trial(place, float(value), np.asarray(slope), slack, by, values)


class _WidthProblem(_Problem):
    """The width of unstable ranges, and a balance grade as the only requirement."""

    def __init__(self, width: UnstableWidth, keep: Requirements, free: np.ndarray):
        if others := [n for n in ("decay", "film", "land_force", "drag") if getattr(keep, n) is not None]:
            raise ArgumentError("keep", said=f"must have no {others[0]} where the width is the objective.")
        wanted = [r for r in listed(keep, width.space.system) if r.of == "balance"]
        super().__init__(width.space, width.operating, wanted, free)
        self.width = width

    def compute(self, place: np.ndarray) -> Trial:
        found = self.width.at(place)
        if isinstance(found, str):
            return self.nowhere(place, float("inf"), np.zeros(place.size), found)
        values = {"width": found} | {r.of: balance_grade(self.space, self.operating, place) for r in self.wanted}
        pairs = [r.slack(values[r.of]) for r in self.wanted]
        slack, by = np.array([s for s, _ in pairs]), np.array([d for _, d in pairs]).reshape(-1, place.size)
        return Trial(place, found.value, found.slope, slack, by, values)


def design_for(
    model: AbstractForcedSystem,
    operating: tuple[float, float],
    vary: Mapping[str, tuple[float, float]],
    keep: Requirements = Requirements(),
    cost: Cost | None = None,
    *,
    objective: str = "cost",
    tolerance: Mapping[str, Tolerance] | None = None,
    search: str = "slsqp",
    starts: int = 1,
    seed: int = 0,
    check: int = 16,
    method: AbstractMethod | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Design:
    """Find the cheapest design that is calm over an operating range, with margins, for every bearing within tolerances.

    **Arguments:**

    - `model`: the design to begin with; its edges are followed from there.
    - `operating`: ends of the range of cage speed [rad/s] in which the machine runs.
    - `vary`: smallest and largest value [SI] of each parameter that may change.
    - `keep`: what must hold over the range.
    - `cost`: prices by parameter name, or a function of the design that JAX differentiates; by default prices of
        turning and balancing (`COSTS`).
    - `objective`: `cost`, or `width`: the exact width of the unstable ranges within `operating`, whose margins are then
        no requirement, and of the others only `balance` may be given.
    - `tolerance`: what manufacture makes of parameters, varied or not; every requirement then holds for the worst.
    - `search`: `slsqp`, or `augmented` for optax's Adam on an augmented Lagrangian.
    - `starts`, `seed`: searches, the first from the design itself, others from quasi-random places.
    - `check`: initial states from which the result is swept over the range, with other steps; 0 leaves it out.

    **Returns:** `Design`; if no design keeps all requirements, the one that falls short least, and which conflict.

    **Raises:** `ValueError` for a range without a stable orbit, or whose stable range does not end in bifurcations.
    """
    require_x64()
    require_at_least(1, starts=starts)
    require_at_least(0, check=check)
    if objective not in ("cost", "width"):
        raise ArgumentError("objective", said=f"must be cost or width, but '{objective}' was given.")
    if search not in SEARCHES:
        raise ArgumentError("search", said=f"must be one of {', '.join(SEARCHES)}, but '{search}' was given.")
    low, high = operating
    if not 0 < low < high < float("inf"):
        raise ArgumentError("operating", said=f"must be two positive speeds, ascending, but are {low:g} and {high:g}.")
    tolerance = dict(tolerance or {})
    space = DesignSpace.of(model, widened(model, vary, tolerance))
    free = np.array([name in vary for name in space.names])
    say = progress or (lambda what, done, of: None)
    say("edges of the given design", 0, 1)
    if objective == "width":
        problem: _Problem = _WidthProblem(UnstableWidth(space, operating, method), keep, free)
    else:
        range_ = OperatingRange(space, operating, keep.margin, method)
        problem = _CostProblem(range_, listed(keep, model), cost_function(cost, model), free)
    own = np.where(free, np.clip(space.place, 0, 1), space.place)
    count, found = int(free.sum()), []
    places = [own] + [problem.whole(x, own) for x in sobol(count, max(starts, 2), seed)[: starts - 1]]
    for i, begin in enumerate(places):
        problem.tightened = np.zeros(len(problem.wanted))
        best = SEARCHES[search](problem, begin, lambda done: say(f"search {i + 1}", done, ITERATIONS))
        for _ in range(ROUNDS if tolerance else 0):
            taken = _taken_by_corners(problem, best, tolerance)
            if np.all(problem.at(best).slack - taken >= -KEPT) and np.all(np.abs(taken - problem.tightened) < 0.01):
                break
            problem.tightened = taken
            best = SEARCHES[search](problem, best, lambda done: say(f"search {i + 1}", done, ITERATIONS))
        found.append((best, problem.tightened.copy()))
    best, problem.tightened = min(found, key=lambda pair: _merit(problem, *pair))
    return _described(problem, best, tolerance, check, say)


def _merit(problem: _Problem, place: np.ndarray, tightened: np.ndarray) -> tuple[float, float]:
    """Order of designs: by what they fall short, then by cost."""
    trial = problem.at(place)
    short = float(np.max(np.maximum(tightened - trial.slack - KEPT, 0), initial=0.0))
    return short, trial.cost


# --- searches -------------------------------------------------------------------------------------------------------


def _programme(problem: _Problem, begin: np.ndarray, say: Callable[[int], None]) -> np.ndarray:
    """The best place by sequential programmes within a trust region.

    Each programme has the cost itself, where it is cheap, and the requirements linearised with their exact derivatives;
    SciPy's SLSQP solves it. Its step is one solution of the edges; a step that loses an edge, or gains less than a
    tenth of what was foreseen, is halved. What the worst requirement falls short is bought at a price that outweighs
    the cost, so that the search leads to a feasible place or, where there is none, to the least shortfall.
    """
    trial, radius, largest = problem.at(begin), FIRST_RADIUS, LARGEST_RADIUS
    size = max(abs(trial.cost), 1e-12)
    short = lambda t: max(0.0, -float(np.min(t.slack - problem.tightened, initial=np.inf)))
    merit = lambda t: t.cost / size + PENALTY * short(t)
    for turn in range(ITERATIONS):
        step, foreseen = _step(problem, trial, radius, size)
        gain = merit(trial) - foreseen
        if gain < ACCURACY or radius < LEAST_RADIUS:
            break
        new = problem.at(problem.whole(trial.place[problem.free] + step, begin))
        kept = (merit(trial) - merit(new)) / gain
        if kept < 0.25 or new.lost:
            radius = min(radius, float(np.max(np.abs(step)))) / 2
            largest = radius if new.lost else largest  # a longer step would lose the edge again
        elif kept > 0.75:
            radius = min(2 * radius, largest)
        if kept > 0.1 and not new.lost:
            trial = new
        say(turn + 1)
    return trial.place


def _step(problem: _Problem, trial: Trial, radius: float, size: float) -> tuple[np.ndarray, float]:
    """The step within a radius to where the linearised requirements hold at the least cost, and the merit there."""
    x, slack = trial.place[problem.free], trial.slack - problem.tightened
    slope, last = trial.slack_slope[:, problem.free], np.append(np.zeros(x.size), PENALTY)
    bounds = [(max(-radius, -v), min(radius, 1 - v)) for v in x]

    def cost(z: np.ndarray) -> tuple[float, np.ndarray]:
        value, by = problem.foreseen(trial, problem.whole(x + z[:-1], trial.place))
        return value / size + PENALTY * z[-1], np.append(by[problem.free] / size, 0.0) + last

    found = minimize(
        cost,
        np.append(np.zeros(x.size), max(0.0, -float(np.min(slack, initial=np.inf)))),
        jac=True,
        method="SLSQP",
        bounds=[*bounds, (0, None)],
        constraints={
            "type": "ineq",
            "fun": lambda z: slack + slope @ z[:-1] + z[-1],
            "jac": lambda z: np.column_stack([slope, np.ones(slack.size)]),
        },
        options={"ftol": 1e-9, "maxiter": 100},
    )
    step = np.clip(found.x[:-1], *np.array(bounds).T)
    short = max(0.0, -float(np.min(slack + slope @ step, initial=np.inf)))
    return step, problem.foreseen(trial, problem.whole(x + step, trial.place))[0] / size + PENALTY * short


def _augmented(problem: _Problem, begin: np.ndarray, say: Callable[[int], None]) -> np.ndarray:
    """The same by optax's Adam on an augmented Lagrangian, whose multipliers are renewed eight times."""
    place, weight, rounds, steps = begin.copy(), 10.0, 8, 12
    multiplier = np.zeros(len(problem.wanted))
    size = max(abs(problem.at(begin).cost), 1e-12)
    for turn in range(rounds):
        adam = optax.adam(0.03 / (1 + turn))
        state = adam.init(jnp.asarray(place[problem.free]))
        for _ in range(steps):
            trial = problem.at(place)
            broken = np.maximum(0.0, multiplier - weight * problem.slack(place))
            slope = (trial.cost_slope / size - broken @ trial.slack_slope)[problem.free]
            move, state = adam.update(jnp.asarray(slope), state)
            step, free = np.asarray(move), place[problem.free]
            for _ in range(6):  # a step that loses an edge is halved
                there = problem.whole(np.clip(free + step, 0, 1), begin)
                if not problem.at(there).lost:
                    place = there
                    break
                step = step / 2
        multiplier = np.maximum(0.0, multiplier - weight * problem.slack(place))
        say((turn + 1) * ITERATIONS // rounds)
    known = [t.place for t in problem.trials.values() if not t.lost]
    return min([place, *known], key=lambda x: _merit(problem, x, problem.tightened))


SEARCHES: dict[str, Any] = {"slsqp": _programme, "augmented": _augmented}


def _taken_by_corners(
    problem: _Problem, place: np.ndarray, tolerance: Mapping[str, Tolerance]
) -> Float[np.ndarray, " m"]:
    """What the worst corner of the tolerances takes away from each slack, by a full solution there."""
    trial = problem.at(place)
    taken = np.zeros(len(problem.wanted))
    for i in range(len(problem.wanted)):
        there = problem.at(corner(problem.space, place, trial.slack_slope[i], tolerance))
        taken[i] = trial.slack[i] - there.slack[i]
    return np.maximum(taken, 0.0)


# --- result ---------------------------------------------------------------------------------------------------------


def _multipliers(
    problem: _Problem, trial: Trial, objective: np.ndarray
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " n"]]:
    """Lagrange multipliers of the requirements that bind and of the bounds, for a gradient of the objective."""
    slack = problem.slack(trial.place)
    binding = np.flatnonzero(slack < ACTIVE + max(0.0, -float(np.min(slack, initial=np.inf))))
    x, free = trial.place[problem.free], trial.slack_slope[:, problem.free]
    low, high = np.flatnonzero(x < 1e-6), np.flatnonzero(x > 1 - 1e-6)
    unit = np.eye(x.size)
    columns = np.column_stack([*free[binding], *unit[low], *-unit[high], np.zeros(x.size)])
    weights, _ = nnls(columns, objective)
    of_slack, of_bound = np.zeros(len(slack)), np.zeros(x.size)
    of_slack[binding] = weights[: binding.size]
    of_bound[np.concatenate([low, high])] = weights[binding.size : -1]
    return of_slack, of_bound


def _described(
    problem: _Problem,
    best: np.ndarray,
    tolerance: Mapping[str, Tolerance],
    check: int,
    say: Callable[[str, int, int], None],
) -> Design:
    """All that is known of the best place."""
    space, wanted = problem.space, problem.wanted
    trial, own = problem.at(best), problem.at(space.place)
    names = np.array(space.names)[problem.free]
    slack = problem.slack(best)
    feasible = not trial.lost and bool(np.all(slack >= -KEPT))
    short = {r.name: float(-s * r.size) for r, s in zip(wanted, slack, strict=True) if s < -KEPT}
    conflict: tuple[str, ...] = ()
    prices: dict[str, float] = {}
    if feasible:
        of_slack, of_bound = _multipliers(problem, trial, trial.cost_slope[problem.free])
        prices = {r.name: float(w / r.size) for r, w in zip(wanted, of_slack, strict=True) if w > 0}
    elif not trial.lost:
        worst = int(np.argmin(slack))
        of_slack, of_bound = _multipliers(problem, trial, -trial.slack_slope[worst, problem.free])
        against = [r.name for r, w in zip(wanted, of_slack, strict=True) if w > 0 and r is not wanted[worst]]
        bounds = [f"the bound of {n}" for n, w in zip(names, of_bound, strict=True) if w > 0]
        conflict = (wanted[worst].name, *against, *bounds)
    x = best[problem.free]
    at_bound = tuple(n for n, v in zip(names.tolist(), x, strict=True) if v < 1e-6 or v > 1 - 1e-6)
    corners = {}
    for i, r in enumerate(wanted if tolerance and not trial.lost else []):
        there = problem.at(corner(space, best, trial.slack_slope[i], tolerance))
        corners |= {r.name: there.values[r.of]} if r.of in there.values else {}
    budget = (
        budget_of(space, tolerance, trial.slack_slope, slack, [r.name for r in wanted])
        if tolerance and not trial.lost
        else []
    )
    model = space.model(best)
    checked = check_design(model, problem.operating, check, say) if check and not trial.lost else None
    changed = {n: float(v) for n, v in space.values(best).items() if n in names}
    path = [space.values(t.place) | {"cost": t.cost} for t in problem.trials.values() if not t.lost]
    return Design(
        *(model, changed, trial.cost, own.cost, wanted, own.values, trial.values, feasible, short, conflict, prices),
        *(at_bound, corners, budget, tuple(dict.fromkeys(problem.notes)), len(problem.trials), path),
        checked,
    )
