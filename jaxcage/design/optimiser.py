"""Search for designs with calm operation: least cost at which all requirements hold, by exact gradients.

Requirements are constraints of sequential programming in a trust region, with SciPy's SLSQP, or of an augmented
Lagrangian minimised by optax. With tolerances, each requirement must hold for the worst bearing within them: signs of
the gradient select the corner, where edges are solved for. The gradient there is that of the worst case (envelope
theorem).
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Float
from scipy.optimize import minimize, nnls

from .._allowed import allowed
from .._arguments import require_at_least, require_x64
from .._errors import ArgumentError
from .._parameters import parameter_info, replace
from ..lanes import sobol
from ..models import AbstractForcedSystem
from .design_space import DesignSpace, Value, function_value
from .operating import KEPT, OperatingRange, UnstableWidth
from .requirements import Budget, Cost, Requirement, Requirements, Tolerance, cost_function, listed, widened
from .verdict import Checked, check_design


AT_BOUND = 1e-6  # distance from a bound, relative to the span, at which a parameter counts as at the bound
WIDEST = 4.0  # largest multiple of a tolerance that is tried
LOST = 10.0  # violation of every requirement at a trial without values
ACTIVE = 5e-3  # slack below which a requirement counts as active
ITERATIONS, ACCURACY = 30, 1e-4
FIRST_RADIUS, LARGEST_RADIUS, LEAST_RADIUS = 0.1, 0.4, 2e-3  # trust region, relative to the spans
PENALTY = 10.0  # penalty of a violation by 1, relative to the cost of the given design


class Trial(NamedTuple):
    """Evaluation of a design: cost with its gradient, slacks of the requirements with theirs, for the worst bearing
    within the tolerances; nominal values, worst values by requirement, and why there are none."""

    place: Float[np.ndarray, " n"]
    cost: float
    cost_slope: Float[np.ndarray, " n"]
    slack: Float[np.ndarray, " m"]
    slack_slope: Float[np.ndarray, "m n"]
    values: dict[str, Value]
    worst: dict[str, Value]
    lost: str = ""


@dataclasses.dataclass(frozen=True)
class Design:
    """Result of a search for a design with calm operation.

    - `model`: the design; `values`: its varied parameters [SI]; `cost` and that of the given design, `cost_before`.
    - `before` and `after`: values that the requirements concern, for the given design and for this one.
    - `feasible`: True if every requirement holds, for every bearing within the tolerances if there are some.
    - `short`: violation of each broken requirement, in its unit; `conflict`: requirements and bounds that together
        prevent a feasible design, empty if there is one.
    - `prices`: cost of one unit more of each binding requirement (Lagrange multipliers).
    - `at_bound`: parameters at a bound; `worst`: value of each requirement for the worst bearing within the tolerances.
    - `notes`: edges that were replaced; `budget`: admissible width of each tolerance.
    - `evaluations`: number of designs whose edges were solved for; `checked`: simulations from many initial states.
    - `lost`: why no value of the design is known, empty if they are.
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
    worst: dict[str, Value]
    budget: list[Budget]
    notes: tuple[str, ...]
    evaluations: int
    path: list[dict[str, float]]
    checked: Checked | None
    lost: str = ""

    @property
    def verdict(self) -> str:
        """One of `calm`, `stable, but not from every initial state`, `stable, not checked` and `not feasible`."""
        if not self.feasible:
            return "not feasible"
        if self.checked is None:
            return "stable, not checked"
        return "calm" if self.checked.calm else "stable, but not from every initial state"

    def __str__(self) -> str:
        rows = [f"Design: {self.verdict}, cost {self.cost_before:.4g} -> {self.cost:.4g}"]
        rows += [f"  {name} = {value:.6g}" for name, value in self.values.items()]
        for r in self.requirements:
            unit = "" if r.unit == "1" else f" {r.unit}"
            was, now = (f"{x[r.of].value:.4g}" if r.of in x else "unknown" for x in (self.before, self.after))
            rows.append(f"  {r.name}: {was} -> {now}{unit} (limit {r.limit:.4g})")
        rows += [f"  in conflict: {' and '.join(self.conflict)}"] if self.conflict else []
        rows += [f"  {self.lost}"] if self.lost else []
        return "\n".join(rows)


@dataclasses.dataclass
class Problem:
    """Trials of one search, each computed once, and the values of each design whose edges were solved for."""

    range: OperatingRange | UnstableWidth
    wanted: list[Requirement]
    cost: Callable[[Any], Any] | None
    """None for the width of the unstable ranges."""
    free: np.ndarray
    """True for parameters that vary."""
    tolerance: dict[str, Tolerance]
    trials: dict[bytes, Trial] = dataclasses.field(default_factory=dict)
    solved: dict[bytes, dict[str, Value] | str] = dataclasses.field(default_factory=dict)
    before: int = 0
    """Number of designs solved for before `solved`."""

    @property
    def evaluations(self) -> int:
        """Number of designs whose edges were solved for."""
        return self.before + len(self.solved)

    @property
    def space(self) -> DesignSpace:
        return self.range.space

    def at(self, place: np.ndarray) -> Trial:
        """Trial at a place, computed if need be."""
        place = np.asarray(place, dtype=float)
        key = place.tobytes()
        if key not in self.trials:
            self.trials[key] = self.compute(place)
        return self.trials[key]

    def begin(self, place: np.ndarray, across: bool = False) -> Trial:
        """Trial at the first place of a search: edges that jumped on the way to it are accepted, and so are, `across`
        an unstable range that has appeared, those that now bound the stable range."""
        trial = self.at(place)
        return self.again(place) if trial.lost or (across and self.born(trial) < 0) else trial

    def again(self, place: np.ndarray) -> Trial:
        """Trial at a place, and values of designs from now on, with the edges that a search finds there."""
        if isinstance(self.range, OperatingRange):
            self.range.begin(place)
            self.trials.pop(place.tobytes())
            self.before, self.solved = self.evaluations, {}
        return self.at(place)

    def born(self, trial: Trial) -> float:
        """Slack of the requirement that no unstable range appears within the operating range."""
        return min((float(s) for r, s in zip(self.wanted, trial.slack, strict=True) if r.of == "peak"), default=np.inf)

    def compute(self, place: np.ndarray) -> Trial:
        values = self._values(place)
        worst = values if isinstance(values, str) else self.worst(place, values, self.tolerance)
        cost, slope = self._costs(place, values)
        if isinstance(values, str) or isinstance(worst, str):
            why = str(worst) if worst is values else f"within the tolerances: {worst}"
            m, n = len(self.wanted), place.size
            return Trial(place, cost, slope, np.full(m, -LOST), np.zeros((m, n)), {}, {}, why)
        pairs = [r.slack(worst[r.name]) for r in self.wanted]
        slack, by = np.array([s for s, _ in pairs]), np.array([d for _, d in pairs]).reshape(-1, place.size)
        return Trial(place, cost, slope, slack, by, values, worst)

    def _costs(self, place: np.ndarray, values: dict[str, Value] | str) -> tuple[float, np.ndarray]:
        """Cost of a design with these values, and its gradient."""
        if self.cost is None:
            return (np.inf, np.zeros(place.size)) if isinstance(values, str) else values["width"][:2]
        value, slope = function_value(self.cost, self.space, jnp.asarray(place))
        return float(value), np.asarray(slope)

    def foreseen(self, trial: Trial, place: np.ndarray) -> tuple[float, np.ndarray]:
        """Cost near a trial and its gradient, to first order where it is expensive to compute."""
        if self.cost is not None:
            return self._costs(place, {})
        return trial.cost + float(trial.cost_slope @ (place - trial.place)), trial.cost_slope

    def priced(self, trial: Trial, size: float) -> float:
        """Merit to be minimised: the cost over a size, plus a penalty on the largest violation."""
        return trial.cost / size + PENALTY * max(0.0, -float(np.min(trial.slack, initial=np.inf)))

    def _values(self, place: np.ndarray) -> dict[str, Value] | str:
        key = place.tobytes()
        if key not in self.solved:
            self.solved[key] = self.range.values(place, self.wanted)
        return self.solved[key]

    def worst(self, place: np.ndarray, values: Any, tolerance: Mapping[str, Tolerance]) -> dict[str, Value] | str:
        """Value of each requirement for the worst bearing within tolerances; or why it is not known."""
        found, info = {}, parameter_info(self.space.system) if tolerance else {}
        for name, each in tolerance.items():
            for end in each.ends(self.space.values(place)[name]):
                if not info[name].lower <= end <= info[name].upper:
                    return f"{name} {allowed(info[name])}, but reaches {end:.3g}"
        for r in self.wanted:
            there, (_, slope) = place.copy(), r.slack(values[r.of])
            for i, (name, value) in enumerate(self.space.values(place).items()):
                if name in tolerance:
                    end = tolerance[name].ends(value)[0 if slope[i] > 0 else 1]
                    there[i] = (end - self.space.lower[i]) / self.space.span[i]
            made = self._values(there) if tolerance else values
            if isinstance(made, str):
                return made
            found[r.name] = made[r.of]
        return found


def design_for(
    model: AbstractForcedSystem,
    operating: tuple[float, float],
    vary: Mapping[str, tuple[float, float]],
    keep: Requirements = Requirements(),
    cost: Cost | None = None,
    *,
    objective: Literal["cost", "width"] = "cost",
    tolerance: Mapping[str, Tolerance] | None = None,
    search: Literal["slsqp", "augmented"] = "slsqp",
    searches: int = 1,
    seed: int = 0,
    check: int = 16,
    progress: Callable[[str, int, int], None] | None = None,
) -> Design:
    """Find the cheapest design that is stable over a range of speed, with margins, for all bearings within tolerances.

    **Arguments:**

    - `model`: the given design, from which edges are followed.
    - `operating`: lowest and highest cage speed in operation [rad/s].
    - `vary`: smallest and largest value [SI] of each parameter that may change.
    - `keep`: requirements over the range.
    - `cost`: prices by parameter name, or a differentiable function of the design; by default prices of turning and
        balancing (`COSTS`).
    - `objective`: `cost`, or `width`, the exact width of the unstable ranges within `operating`: margins are then not
        required, and only `balance` may be.
    - `tolerance`: tolerances of parameters, varied or not; every requirement then holds for the worst case.
    - `search`: `slsqp`, or `augmented` for optax's Adam on an augmented Lagrangian.
    - `searches`, `seed`: number of searches, the first from the design itself, others from quasi-random places.
    - `check`: initial states from which the result is simulated over the range, with other steps; 0 leaves it out.

    **Returns:** `Design`; if none is feasible, that with the least violation, and the requirements in conflict.

    **Raises:** `ValueError` for a range without a stable orbit, or whose stable range does not end in bifurcations;
    `RuntimeError` without double precision.
    """
    require_x64()
    require_at_least(1, searches=searches)
    require_at_least(0, check=check)
    low, high = operating
    if not 0 < low < high < float("inf"):
        raise ArgumentError("operating", said=f"must be two positive speeds, ascending, but are {low:g} and {high:g}.")
    tolerance = dict(tolerance or {})
    space = DesignSpace.of(model, widened(model, vary, tolerance))
    for name, end in ((name, end) for name, ends in vary.items() for end in ends):
        replace(model, **{name: end})  # raises for a bound outside the parameter's range
    free = np.array([name in vary for name in space.names])
    say = progress or (lambda what, done, of: None)
    say("edges of the given design", 0, 1)
    if objective == "width":
        if others := [n for n in ("decay", "film", "land_force", "drag") if getattr(keep, n) is not None]:
            raise ArgumentError("keep", said=f"must have no {others[0]} where the width is the objective.")
        wanted = [r for r in listed(keep, model) if r.of == "balance"]
        problem = Problem(UnstableWidth(space, operating), wanted, None, free, tolerance)
    else:
        range_ = OperatingRange(space, operating, keep.margin)
        problem = Problem(range_, listed(keep, model), cost_function(cost, model), free, tolerance)
    own = np.where(free, np.clip(space.place, 0, 1), space.place)
    places = [own, *np.where(free, sobol(own.size, max(searches, 2), seed), own)[: searches - 1]]
    told = lambda i: lambda done: say(f"search {i}", done, ITERATIONS)
    found = [SEARCHES[search](problem, begin, told(i)) for i, begin in enumerate(places, start=1)]
    best = min(found, key=lambda place: _merit(problem, place))
    if any(name.endswith("margin") and np.isnan(value.rpm) for name, value in problem.at(best).values.items()):
        problem.again(best)  # an edge may have come in where the range was open
    checked = check_design(space.model(best), operating, check, say) if check and not problem.at(best).lost else None
    return _described(problem, best, checked)


def _merit(problem: Problem, place: np.ndarray) -> tuple[float, float]:
    """Sort key of designs: violation, then cost."""
    trial = problem.at(place)
    return float(np.max(np.maximum(-trial.slack - KEPT, 0), initial=0.0)), trial.cost


# --- searches -------------------------------------------------------------------------------------------------------


def _programme(problem: Problem, begin: np.ndarray, say: Callable[[int], None]) -> np.ndarray:
    """Find the best place by sequential programming.

    Where an unstable range appears the edges jump, and no gradient leads across. A search that such a range stops is
    repeated from beyond it, one long step ahead along the other requirements.
    """
    end, stopped = _descent(problem, begin, say)
    trial = problem.at(end)
    if trial.lost or problem.cost is None or not (stopped or problem.born(trial) < ACTIVE):
        return end
    told, born = len(problem.range.handed_over), np.array([r.of == "peak" for r in problem.wanted])
    open_, size = trial._replace(slack=np.where(born, LOST, trial.slack)), max(abs(trial.cost), 1e-12)
    beyond = end + _step(problem, open_, [], LARGEST_RADIUS, size)[0]
    if not problem.begin(beyond, across=True).lost:
        beyond, _ = _descent(problem, beyond, say)
        if _merit(problem, beyond) < _merit(problem, end):
            problem.range.handed_over.append("an unstable range appeared, and the search went on beyond it")
            return beyond
    del problem.range.handed_over[told:]
    return end


def _descent(problem: Problem, begin: np.ndarray, say: Callable[[int], None]) -> tuple[np.ndarray, bool]:
    """Find a local optimum by sequential programming in a trust region; True if steps towards it lost an edge.

    Each subproblem has the cost itself, where it is cheap, and the requirements linearised with their exact gradients;
    SciPy's SLSQP solves it. A step costs one solution of the edges. A step that loses an edge is halved, and so is one
    that gains less than a tenth of the prediction, once its linearised requirements have been added. The penalty on the
    largest violation outweighs the cost, so that the search ends at a feasible place or at the least violation.
    """
    trial, radius, largest = problem.begin(begin), FIRST_RADIUS, LARGEST_RADIUS
    size, refused, stopped = max(abs(trial.cost), 1e-12), list[Trial](), False
    for turn in range(ITERATIONS):
        step, foreseen = _step(problem, trial, refused, radius, size)
        gain = problem.priced(trial, size) - foreseen
        if gain < ACCURACY or radius < LEAST_RADIUS:
            break
        new = problem.at(trial.place + step)
        kept = (problem.priced(trial, size) - problem.priced(new, size)) / gain
        reach = min(radius, float(np.max(np.abs(step))))
        if new.lost:
            stopped, radius, largest = True, reach / 2, reach / 4  # a longer step would lose the edge again
        elif kept < 0.25:
            radius = reach if kept <= 0.1 and not refused else reach / 2  # the first retry only adds a linearisation
        elif kept > 0.75:
            radius, largest = min(2 * radius, largest), min(2 * largest, LARGEST_RADIUS)
        if kept > 0.1 and not new.lost:
            trial, refused = new, []
        elif not new.lost:
            refused.append(new)
        say(turn + 1)
    return trial.place, stopped


def _step(
    problem: Problem, trial: Trial, refused: Sequence[Trial], radius: float, size: float
) -> tuple[np.ndarray, float]:
    """Step within a radius to the least cost at which the linearised requirements hold, and the merit there.

    Requirements linearised at refused trials must hold too, such as those of another corner of the tolerances, but at
    the trial itself only up to its own slack, since a requirement may curve the other way.
    """
    x, reach = trial.place, np.where(problem.free, radius, 0.0)
    below = [np.maximum(t.slack + t.slack_slope @ (trial.place - t.place), trial.slack) for t in refused]
    slack = np.concatenate([trial.slack, *below])
    slope = np.concatenate([trial.slack_slope, *(t.slack_slope for t in refused)])
    low, high = np.maximum(-reach, -x), np.minimum(reach, 1 - x)

    def cost(z: np.ndarray) -> tuple[float, np.ndarray]:
        value, by = problem.foreseen(trial, x + z[:-1])
        return value / size + PENALTY * z[-1], np.append(by / size, PENALTY)

    found = minimize(
        cost,
        np.append(np.zeros(x.size), max(0.0, -float(np.min(slack, initial=np.inf)))),
        jac=True,
        method="SLSQP",
        bounds=[*zip(low, high, strict=True), (0, None)],
        constraints={
            "type": "ineq",
            "fun": lambda z: slack + slope @ z[:-1] + z[-1],
            "jac": lambda z: np.column_stack([slope, np.ones(slack.size)]),
        },
        options={"ftol": 1e-9, "maxiter": 100},
    )
    step = np.clip(found.x[:-1], low, high)
    short = max(0.0, -float(np.min(slack + slope @ step, initial=np.inf)))
    return step, problem.foreseen(trial, x + step)[0] / size + PENALTY * short


def _augmented(problem: Problem, begin: np.ndarray, say: Callable[[int], None]) -> np.ndarray:
    """Find the best place by optax's Adam on an augmented Lagrangian, whose multipliers are updated eight times."""
    place, weight, rounds = begin, 10.0, 8
    multiplier, size = np.zeros(len(problem.wanted)), max(abs(problem.begin(begin).cost), 1e-12)
    for turn in range(rounds):
        adam = optax.adam(0.03 / (1 + turn))
        state = adam.init(jnp.asarray(place))
        for _ in range(12):
            trial = problem.at(place)
            broken = np.maximum(0.0, multiplier - weight * trial.slack)
            slope = np.where(problem.free, trial.cost_slope / size - broken @ trial.slack_slope, 0.0)
            with jax.numpy_dtype_promotion("standard"):  # Adam's bias correction is a power of an integer
                move, state = adam.update(jnp.asarray(slope), state)
            steps = (np.clip(place + np.asarray(move) / 2**k, 0, 1) for k in range(6))  # halved if an edge is lost
            place = next((there for there in steps if not problem.at(there).lost), place)
        multiplier = np.maximum(0.0, multiplier - weight * problem.at(place).slack)
        say((turn + 1) * ITERATIONS // rounds)
    known = [t.place for t in problem.trials.values() if not t.lost]
    return min([place, *known], key=lambda x: _merit(problem, x))


SEARCHES: dict[str, Any] = {"slsqp": _programme, "augmented": _augmented}


# --- result ---------------------------------------------------------------------------------------------------------


def _weights(slopes: np.ndarray, x: np.ndarray, objective: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lagrange multipliers of requirements with these gradients, and of the bounds, for a gradient of the objective."""
    low, high = x < AT_BOUND, x > 1 - AT_BOUND
    found, _ = nnls(np.column_stack([*slopes, *np.diag(1.0 * low - high)]), objective)
    return found[: len(slopes)], found[len(slopes) :]


def _conflict(problem: Problem, trial: Trial, names: list[str]) -> tuple[str, ...]:
    """Requirements and bounds that together prevent a feasible design: at the least violation, a weighted sum of the
    gradients of the worst requirements vanishes, up to bounds."""
    worst = np.flatnonzero(trial.slack < trial.slack.min() + ACTIVE)
    slopes, x = trial.slack_slope[worst][:, problem.free], trial.place[problem.free]
    size = max(float(np.abs(slopes).max()), 1e-12)
    ones = np.column_stack([slopes, np.full(worst.size, 10 * size)])  # the weights add up to 1
    weights, bounds = _weights(ones, np.append(x, 0.5), np.append(np.zeros(x.size), 10 * size))
    against = [problem.wanted[k].name for k, w in zip(worst, weights, strict=True) if w > 1e-3]
    return (*against, *(f"the bound of {n}" for n, w in zip(names, bounds, strict=False) if w > 1e-3 * size))


def _budget(problem: Problem, trial: Trial) -> list[Budget]:
    """Admissible width of each tolerance with the others fixed: estimated at first order from the slacks at the worst
    corners, then solved for there, and reduced until all requirements hold."""
    rows, space, tolerance = [], problem.space, problem.tolerance
    for i, name in enumerate(space.names):
        if name not in tolerance:
            continue
        lower, upper = tolerance[name].lower, tolerance[name].upper
        slope = trial.slack_slope[:, i] / space.span[i]
        takes = np.abs(slope * (np.where(slope > 0, lower, upper) - tolerance[name].fixed))
        room = np.divide(np.maximum(trial.slack, 0.0), takes, out=np.full(takes.size, np.inf), where=takes > 0)
        k, reached = int(np.argmin(room)), 1.0
        limit = problem.wanted[k].name if np.isfinite(room[k]) else ""
        most = min(1 + float(room[k]), WIDEST)
        for factor in (most, most**0.5, most**0.25):
            made = problem.worst(trial.place, trial.values, tolerance | {name: tolerance[name].times(factor)})
            broken = [] if isinstance(made, str) else [r for r in problem.wanted if r.slack(made[r.name])[0] < -KEPT]
            if not broken and not isinstance(made, str):
                reached = factor
                break
            limit = made if isinstance(made, str) else broken[0].name
        limit = "" if reached == WIDEST else limit
        rows.append(Budget(name, upper - lower, reached, limit))
    return rows


def _described(problem: Problem, best: np.ndarray, checked: Checked | None) -> Design:
    space, wanted = problem.space, problem.wanted
    trial, own, x = problem.at(best), problem.at(space.place), best[problem.free]
    names = np.array(space.names)[problem.free].tolist()
    slack, prices, conflict = trial.slack, dict[str, float](), tuple[str, ...]()
    feasible = not trial.lost and bool(np.all(slack >= -KEPT))
    if feasible:
        binding = np.flatnonzero(slack < ACTIVE)
        slopes = trial.slack_slope[binding][:, problem.free]
        weights, _ = _weights(slopes, x, trial.cost_slope[problem.free])
        prices = {wanted[k].name: float(w / wanted[k].size) for k, w in zip(binding, weights, strict=True) if w > 0}
    elif not trial.lost:
        conflict = _conflict(problem, trial, names)
    return Design(
        model=space.model(best),
        values={n: v for n, v in space.values(best).items() if n in names},
        cost=trial.cost,
        cost_before=own.cost,
        requirements=wanted,
        before=own.values,
        after=trial.values,
        feasible=feasible,
        short={r.name: float(-s * r.size) for r, s in zip(wanted, slack, strict=True) if s < -KEPT and not trial.lost},
        conflict=conflict,
        prices=prices,
        at_bound=tuple(n for n, v in zip(names, x, strict=True) if min(v, 1 - v) < AT_BOUND),
        worst=trial.worst,
        budget=_budget(problem, trial) if wanted and feasible else [],
        notes=tuple(dict.fromkeys(problem.range.handed_over)),
        evaluations=problem.evaluations,
        path=[space.values(t.place) | {"cost": t.cost} for t in problem.trials.values() if not t.lost],
        checked=checked,
        lost=trial.lost,
    )
