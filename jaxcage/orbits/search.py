"""Search for synchronous (period-1) orbits over a range of speed, without an initial guess.

Newton's method starts from the final states of simulations on a coarse grid of speeds. The stable orbits found are
followed in both directions until every one of them lies on a known branch. Stable stretches of the branches are bounded
by bifurcations; between them are the unstable ranges of the synchronous orbit.
"""

import dataclasses
import functools
import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
import xarray as xr

from .._arguments import require_at_least
from .._errors import ArgumentError
from ..lanes import states_at, sweep
from ..models import AbstractForcedSystem
from ..quantities import notebook_html
from ..solve import AbstractMethod
from .branch import Branch, follow_both_ways
from .continuation import ContinuationProblem, orbit_curves
from .point import Point
from .problem import SPEED, Given, turns_of, without_turns
from .step_length import StepControl


ROUND, ROUNDS = 4, 8  # branches followed at a time, and maximum number of rounds
PATIENCE = 150  # unstable orbits in a row after which a branch is not followed further
TRIES = 3  # maximum number of branches followed by `stable_range`
PATIENCE_OUT = 3  # unstable orbits in a row after which `stable_range` does not follow a branch further
OUTWARD = StepControl(first=0.05, longest=0.5, most=400)  # steps along the orbits of a stable range
ON_BRANCH = 0.03  # largest distance of an orbit on a branch from the branch, in units of the system's scale
NEARLY = 0.1  # largest motion over the last revolution, in units of the scale, of a simulation that nears an orbit
SHORT: dict[str, Any] = {"revolutions": 8, "blocks": 1, "keep": 8, "exponents": 0}
"""Settings of the simulations, which only provide guesses."""
Progress = Callable[[str, int, int], None]
Apart = Callable[[np.ndarray, np.ndarray, float], float]
"""Distance of two states at a speed [rad/s], in units of the system's scale."""


def _distance_in(system: AbstractForcedSystem) -> Apart:
    scale = functools.cache(lambda speed: np.array([float(c) for c in system.scale(speed)]))
    turns = turns_of(system.angles, system.dimension)
    return lambda one, other, speed: float(np.max(np.abs(without_turns(one - other, turns)) / scale(speed)))


@dataclasses.dataclass(frozen=True, eq=False)
class StableRange:
    """A stable part of a branch of synchronous orbits: a range of speed in which a machine may run.

    `lower` and `upper` are the bifurcations at its ends, None if the range searched or the branch ends there. `states`
    are the orbits [SI] at `speeds` [rad/s], which ascend. Branches that are parts of one have the same `family`. `met`
    simulations settled on it, `met_first` of them from the first of the system's initial states, the conventional one.
    """

    lower: Point | None
    upper: Point | None
    lower_rpm: float
    upper_rpm: float
    branch: int
    family: int = 0
    met: int = 0
    met_first: int = 0
    speeds: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    states: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def width_rpm(self) -> float:
        """Width of the range of speed [rpm]."""
        return self.upper_rpm - self.lower_rpm

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest speed [rad/s]."""
        return self.lower_rpm * np.pi / 30, self.upper_rpm * np.pi / 30

    @property
    def error_rpm(self) -> float:
        """Uncertainty of the width [rpm]: the sum of the errors of its ends."""
        return sum((float(p.error_rpm) for p in (self.lower, self.upper) if p is not None), 0.0)

    @property
    def confirmed(self) -> bool:
        """True if the uncertainty of the width does not exceed the width."""
        return not self.error_rpm > self.width_rpm

    def state_at(self, speed: float) -> np.ndarray:
        """Return the state of the orbit at a speed [rad/s] within the range, by linear interpolation."""
        return np.array([np.interp(speed, self.speeds, c) for c in self.states.T])

    def holds(self, speed: float, state: np.ndarray, apart: Apart) -> bool:
        """Return True if the orbit `state` at `speed` lies on it, to the accuracy of the steps of a continuation."""
        inside = self.lower_rpm <= speed * 30 / np.pi <= self.upper_rpm
        return inside and apart(self.state_at(speed), state, speed) < ON_BRANCH

    def __str__(self) -> str:
        end = lambda p, rpm: f"{rpm:.1f} ({'range' if p is None else p.kind})"
        return f"{end(self.lower, self.lower_rpm)} to {end(self.upper, self.upper_rpm)} rpm, {self.met} settled"

    _repr_html_ = notebook_html


@dataclasses.dataclass(frozen=True)
class SynchronousOrbits:
    """All branches of synchronous orbits that were found, and their stable stretches, by the lower end.

    `sweep` holds the simulations from which the branches were found, too short for labels that identify chaos. `missed`
    stable orbits found from simulations lie on none of the branches.
    """

    branches: tuple[Branch, ...]
    stretches: tuple[StableRange, ...]
    sweep: xr.Dataset
    missed: int
    lower_rpm: float
    upper_rpm: float
    angles: tuple[int, ...] = ()

    @property
    def edges(self) -> tuple[Point, ...]:
        """Bifurcations at which a stable synchronous orbit ends, by speed."""
        return _distinct([p for s in self.stretches for p in (s.lower, s.upper) if p is not None], self.angles)

    @property
    def points(self) -> tuple[Point, ...]:
        """All bifurcations on all branches, by speed."""
        return _distinct([p for b in self.branches for p in b.special], self.angles)

    @property
    def unsettled(self) -> int:
        """Number of bifurcations whose value changes too much when the steps are halved; `points` omits them."""
        return sum(p.status == "not converged" for b in self.branches for p in b.special)

    @property
    def unexplained(self) -> tuple[Point, ...]:
        """Places where the stability changes but no bifurcation is found; `points` omits them."""
        return tuple(p for b in self.branches for p in b.special if p.status == "unexplained")

    def coexisting(self, speed: float) -> list[tuple[int, bool, np.ndarray, np.ndarray]]:
        """Return the orbits at `speed` [rad/s], to the accuracy of the continuation's steps: number of the branch, True
        if stable, state [SI], multipliers."""
        found: list[tuple[int, bool, np.ndarray, np.ndarray]] = []
        for i, b in enumerate(self.branches):
            for stable, state, multipliers in _crossings(b, speed):
                if not any(_same(state, other, self.angles, 1e-2) for _, _, other, _ in found):  # parts may overlap
                    found.append((i, stable, state, multipliers))
        return found

    def __str__(self) -> str:
        head = f"{len(self.branches)} branches of synchronous orbits, {len(self.stretches)} stable stretches"
        return "\n".join([head, *(f"  {s}" for s in self.stretches)])

    _repr_html_ = notebook_html


def _crossings(branch: Branch, speed: float) -> list[tuple[bool, np.ndarray, np.ndarray]]:
    """Interpolate stability, state and multipliers linearly where a branch passes `speed`."""
    v, found = branch.value, []
    for k in np.flatnonzero((v[:-1] - speed) * (v[1:] - speed) <= 0):
        share = 0.0 if v[k + 1] == v[k] else (speed - v[k]) / (v[k + 1] - v[k])
        state = branch.state[k] + share * (branch.state[k + 1] - branch.state[k])
        near = k + int(round(share))
        found.append((bool(branch.stable[near]), state, branch.multipliers[near]))
    return found


def _same(state: np.ndarray, other: np.ndarray, angles: Sequence[int], tolerance: float) -> bool:
    return np.allclose(other + without_turns(state - other, turns_of(angles, state.size)), other, tolerance)


def _distinct(points: Sequence[Point], angles: Sequence[int]) -> tuple[Point, ...]:
    """Return converged points by speed, without duplicates."""
    kept: list[Point] = []
    for p in sorted((p for p in points if p.status == "converged"), key=lambda p: p.value):
        apart = lambda q: max(1e-6 * p.value, float(np.nan_to_num(p.error + q.error)))
        near = [q for q in kept[-6:] if q.kind == p.kind and abs(q.value - p.value) < apart(q)]
        if not any(_same(np.asarray(q.state), np.asarray(p.state), angles, 1e-3) for q in near):
            kept.append(p)
    return tuple(kept)


def synchronous_orbits(
    system: AbstractForcedSystem,
    lower: float,
    upper: float,
    *,
    count: int = 251,
    discard: int = 250,
    settled: xr.Dataset | None = None,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> SynchronousOrbits:
    """Find and follow the synchronous orbits between two speeds [rad/s].

    **Arguments:** system; lowest and highest speed [rad/s]; number of speeds simulated from each of the system's
    initial states; revolutions discarded; an existing sweep to use instead of simulations; integration method; function
    called with the stage and the numbers done and in all. Simulations from the negatives of the initial states only
    serve to find more orbits.

    **Returns:** `SynchronousOrbits`. Simulations may miss stable orbits with a small basin of attraction.

    **Raises:** `ValueError` for speeds that do not ascend; `RuntimeError` without double precision.
    """
    require_at_least(1, count=count)
    if not lower < upper:
        raise ArgumentError("lower", "upper", said=f"must ascend, but {lower:g} and {upper:g} rad/s were given.")
    say = progress or (lambda what, done, of: None)
    apart = _distance_in(system)

    def simulate(speeds: np.ndarray, sign: float) -> xr.Dataset:
        initial_states, told = sign * states_at(system, speeds, None), lambda done, of: say("simulations", done, of)
        return sweep(
            system, speeds, initial_states=initial_states, discard=discard, **SHORT, method=method, progress=told
        )

    settled = simulate(np.linspace(lower, upper, count), 1.0) if settled is None else settled
    speeds = settled["speed"].values
    opposite = simulate(speeds[:: -(-speeds.size // count)], -1.0)
    problem = orbit_curves(Given(system, jnp.asarray((lower + upper) / 2)), SPEED, lower, upper, method)
    if met := _finished(settled):
        i, j = met[len(met) // 2]
        problem = problem.with_stable_steps((settled["last"].values[i, j], float(speeds[i])))
    orbits = _stable_orbits(problem, settled, apart)
    waiting = sorted(orbits + _stable_orbits(problem, opposite, apart), key=lambda o: o.speed)
    branches: list[Branch] = []
    for turn in range(ROUNDS):
        if not waiting:
            break
        say("branches", turn, ROUNDS)
        picked = np.unique(np.linspace(0, len(waiting) - 1, min(ROUND, len(waiting))).round().astype(int))
        guesses = [(waiting[i].state, waiting[i].speed) for i in picked]
        branches += [b for b in follow_both_ways(problem, guesses, StepControl(most=1500), PATIENCE) if b is not None]
        waiting = [w for w in waiting if not any(_covers(b, w.speed, w.state, apart) for b in branches)]
    say("branches", ROUNDS, ROUNDS)
    families, stretches, limits = _families(branches, apart), [], (lower * 30 / np.pi, upper * 30 / np.pi)
    for part in _merged([p for i, b in enumerate(branches) for p in _stable_parts(b, i, limits)], apart):
        met = [o.start for o in orbits if o.settled and part.holds(o.speed, o.state, apart)]
        known = {"family": families[part.branch], "met": len(met), "met_first": met.count(0)}
        stretches.append(dataclasses.replace(part, **known))
    return SynchronousOrbits(tuple(branches), tuple(stretches), settled, len(waiting), *limits, system.angles)


# --- orbits from simulations ---------------------------------------------------------------------------------------


class _Settled(NamedTuple):
    """A stable orbit found from a simulation; `settled` is True if the simulation itself ended near it."""

    state: np.ndarray
    speed: float
    start: int
    settled: bool


def _finished(settled: xr.Dataset) -> list[list[int]]:
    """Return the indices (speed, initial state) of the simulations that did not fail."""
    return np.argwhere(np.all(np.isfinite(settled["last"].values), axis=-1)).tolist()


def _stable_orbits(problem: ContinuationProblem, settled: xr.Dataset, apart: Apart) -> list[_Settled]:
    """Return the stable orbits to which Newton's method converges from the ends of simulations, by speed."""
    lanes = _finished(settled)
    turns = turns_of(problem.given.system.angles, problem.scale.size)
    last, speeds = without_turns(settled["last"].values, turns), settled["speed"].values
    met = [(last[i, j], float(speeds[i])) for i, j in lanes]
    if not met:
        return []
    problem = problem.around(met[0][1])
    strobe = settled["strobe"].values
    moved = strobe[..., -1, :] - strobe[..., -2, :] if strobe.shape[2] > 1 else np.zeros_like(last)
    near = np.max(np.abs(without_turns(moved, turns) / settled["scale"].values), axis=-1) < NEARLY
    points = problem.orbits_near(met, np.array([near[i, j] for i, j in lanes]))
    good = points.converged.copy()
    good[good] = problem.unstable(points.take(good)) == 0
    states = problem.states(points.u)
    near = lambda i: apart(states[i], *met[i]) < ON_BRANCH
    return [_Settled(states[i], met[i][1], lanes[i][1], near(i)) for i in np.flatnonzero(good)]


def _covers(branch: Branch, speed: float, state: np.ndarray, apart: Apart) -> bool:
    return any(apart(s, state, speed) < ON_BRANCH for _, s, _ in _crossings(branch, speed))


def _families(branches: Sequence[Branch], apart: Apart) -> list[int]:
    """Number branches so that parts of one have the same number: the end of a stopped part lies on another part."""
    family = list(range(len(branches)))
    for i, b in enumerate(branches):
        for end, why in zip((0, -1), b.ended, strict=True):
            for j, other in enumerate(branches):
                if why == "stopped" and i != j and _covers(other, float(b.speed[end]), b.state[end], apart):
                    family = [family[j] if f == family[i] else f for f in family]
    return family


# --- stable ranges --------------------------------------------------------------------------------------------------


def _stable_parts(branch: Branch, number: int, limits: tuple[float, float]) -> list[StableRange]:
    """Return the stable parts of a branch over speed, within the limits [rpm]."""
    found = []
    edges = {p.index: p for p in branch.special if p.edge and p.status == "converged"}
    bounds = [-1, *np.flatnonzero(np.diff(branch.stable.astype(int))).tolist(), branch.value.size - 1]
    for first, last in itertools.pairwise(bounds):
        if last <= first or not branch.stable[last]:
            continue
        along, points = np.arange(first + 1, last + 1), [edges.get(first), edges.get(last)]
        if branch.speed[along[0]] > branch.speed[along[-1]]:
            along, points = along[::-1], points[::-1]
        ends = zip(points, branch.speed_rpm[along[[0, -1]]], strict=True)
        low, high = (float(rpm if p is None else p.speed_rpm) for p, rpm in ends)
        part = StableRange(points[0], points[1], max(low, limits[0]), min(high, limits[1]), number)
        found.append(dataclasses.replace(part, speeds=branch.speed[along], states=branch.state[along]))
    return found


def _merged(parts: Sequence[StableRange], apart: Apart) -> list[StableRange]:
    """Join the parts that two branches from different initial states share."""
    whole: list[StableRange] = []
    for b in sorted(parts, key=lambda p: p.lower_rpm):
        for i, a in enumerate(whole):
            rpm = (b.lower_rpm + min(a.upper_rpm, b.upper_rpm)) / 2
            speed = rpm * np.pi / 30
            if b.lower_rpm <= rpm and a.holds(speed, b.state_at(speed), apart):
                beyond, top = b.speeds > a.speeds[-1], b if b.upper_rpm > a.upper_rpm else a
                speeds, states = np.append(a.speeds, b.speeds[beyond]), np.vstack([a.states, b.states[beyond]])
                ends = {"upper": top.upper, "upper_rpm": top.upper_rpm}
                whole[i] = dataclasses.replace(a, speeds=speeds, states=states, **ends)
                break
        else:
            whole.append(b)
    return whole


def stable_range(
    system: AbstractForcedSystem,
    operating: tuple[float, float],
    limits: tuple[float, float],
    near: Sequence[tuple[np.ndarray, float]] = (),
    *,
    method: AbstractMethod | None = None,
) -> StableRange | None:
    """Find the stable stretch of synchronous orbits that covers most of an operating range, by continuation.

    **Arguments:** system; operating range and limits of the search [rad/s]; states and speeds near orbits, by default
    the ends of simulations at five speeds of the operating range from each of the system's initial states.

    **Returns:** `StableRange`, or None if no stable orbit was found in the operating range. An end is also None if the
    stability changes within the limits but no bifurcation was located there.
    """
    apart = _distance_in(system)
    problem = orbit_curves(Given(system, jnp.asarray(sum(limits) / 2)), SPEED, *limits, method)
    if near:
        waiting = [_Settled(np.asarray(state), float(speed), 0, True) for state, speed in near]
    else:
        settled = sweep(system, np.linspace(*operating, 5), discard=250, **SHORT, method=method)
        waiting = _stable_orbits(problem, settled, apart)
    parts: list[StableRange] = []
    for _ in range(TRIES):
        if not waiting:
            break
        picked = waiting[len(waiting) // 2]
        (found,) = follow_both_ways(problem, [(picked.state, picked.speed)], OUTWARD, PATIENCE_OUT)
        waiting = [w for w in waiting if w is not picked and not (found and _covers(found, w.speed, w.state, apart))]
        parts += _stable_parts(found, 0, (limits[0] * 30 / np.pi, limits[1] * 30 / np.pi)) if found else []
    low, high = (end * 30 / np.pi for end in operating)
    overlap = lambda part: min(part.upper_rpm, high) - max(part.lower_rpm, low)
    best = max(_merged(parts, apart), key=overlap, default=None)
    if best is None or overlap(best) < 0:
        return None
    rise = np.argsort(best.speeds)
    return dataclasses.replace(best, speeds=best.speeds[rise], states=best.states[rise])
