"""Orbits found without a hint of where they are: the synchronous (period-1) ones of a system over a range of speed, and
all that many starts lead to at one speed.

Newton's method leads from the ends of simulations on a coarse grid, from the system's starts and from their opposites,
to stable orbits; each is followed both ways by arclength, until every orbit that was met lies on a branch that is
known. Stable stretches of the branches, bounded by bifurcations, are what the synchronous-loss edges are about.
"""

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._arguments import require_at_least
from .._checks import require_x64
from .._form import compiled
from .._notebook import notebook_html
from .._types import Scalar
from ..analysis import Sweep
from ..models import AbstractForcedSystem, require_speeds
from ..solve import AbstractMethod, strobe_map
from ..sweeps import initial_states, sweep
from ._arclength import Steps, take
from ._branch import Branch, follow_both_ways
from ._follower import Follower, make_follower, seeds, stable_steps
from ._orbit import Orbit, periodic_orbit
from ._point import Point
from ._problem import SPEED, Given


ROUND = 4
"""Branches followed at a time."""
ROUNDS = 8
PATIENCE = 150
"""Unstable orbits in a row after which a branch is left."""
ON_BRANCH = 0.03
"""An orbit lies on a branch if it is within this distance of it, in units of the system's scale."""
SPREAD = 0.6
"""Random starts are spread over this share of the system's scale in every direction."""
SAME = 1e-4
"""Orbits are the same within this: one that hardly attracts moves by a hundred times the error of its map."""
Progress = Callable[[str, int, int], None]
Scale = Callable[[float], np.ndarray]
"""Of the state, at a speed [rad/s]."""


@dataclasses.dataclass(frozen=True, eq=False)
class Stretch:
    """A stable part of a branch of synchronous orbits; an end is None where it leaves the range or was left."""

    lower: Point | None
    upper: Point | None
    lower_rpm: float
    upper_rpm: float
    branch: int
    family: int = 0
    """The same for all branches that are parts of one."""
    met: int = 0
    """How many simulations settled on it."""
    met_first: int = 0
    """How many of those from the system's conventional start, the first of its starts, did."""

    @property
    def width_rpm(self) -> float:
        """How much speed it covers [rpm]."""
        return self.upper_rpm - self.lower_rpm

    @property
    def error_rpm(self) -> float:
        """By how much the width is not known: what half the steps change in its ends [rpm]."""
        return sum((float(p.error_rpm) for p in (self.lower, self.upper) if p is not None), 0.0)

    @property
    def confirmed(self) -> bool:
        """Whether it is there by half the steps, too: both ends are located to less than its width."""
        return not self.error_rpm > self.width_rpm

    def __str__(self) -> str:
        end = lambda p, rpm: f"{rpm:.1f} ({'range' if p is None else p.kind})"
        return f"{end(self.lower, self.lower_rpm)} to {end(self.upper, self.upper_rpm)} rpm, {self.met} settled"

    _repr_html_ = notebook_html


@dataclasses.dataclass(frozen=True)
class SynchronousOrbits:
    """All branches of synchronous orbits that were met."""

    branches: tuple[Branch, ...]
    stretches: tuple[Stretch, ...]
    """Stable stretches, by their lower end."""
    sweep: Sweep
    """The simulations that the branches were started from; its labels do not tell chaos."""
    missed: int
    """Settled orbits that lie on no branch that was followed."""
    lower_rpm: float
    upper_rpm: float

    @property
    def edges(self) -> tuple[Point, ...]:
        """Bifurcations at which a stable synchronous orbit ends, by speed."""
        return _distinct([p for s in self.stretches for p in (s.lower, s.upper) if p is not None])

    @property
    def points(self) -> tuple[Point, ...]:
        """All bifurcations on all branches, by speed."""
        return _distinct([p for b in self.branches for p in b.special])

    @property
    def unsettled(self) -> int:
        """How many bifurcations are elsewhere, or nowhere, by half the steps: none of them is in `points`."""
        return sum(p.status == "not converged" for b in self.branches for p in b.special)

    @property
    def unexplained(self) -> tuple[Point, ...]:
        """Where the stability of an orbit changes and no bifurcation is found: none of these is in `points`."""
        return tuple(p for b in self.branches for p in b.special if p.status == "unexplained")

    def coexisting(self, speed: float) -> list[tuple[int, bool, np.ndarray, np.ndarray]]:
        """Orbits at `speed` [rad/s]: branch, whether stable, state [SI], multipliers; to the accuracy of the steps."""
        found: list[tuple[int, bool, np.ndarray, np.ndarray]] = []
        for i, b in enumerate(self.branches):
            for stable, state, multipliers in crossings(b, speed):
                if not any(np.allclose(state, other, rtol=1e-2) for _, _, other, _ in found):  # parts may overlap
                    found.append((i, stable, state, multipliers))
        return found

    def __str__(self) -> str:
        head = f"{len(self.branches)} branches of synchronous orbits, {len(self.stretches)} stable stretches"
        return "\n".join([head, *(f"  {s}" for s in self.stretches)])

    _repr_html_ = notebook_html


def crossings(branch: Branch, speed: float) -> list[tuple[bool, np.ndarray, np.ndarray]]:
    """Where a branch over speed passes `speed`: stable or not, state, multipliers, by linear interpolation."""
    v = branch.value
    found = []
    for k in np.flatnonzero(((v[:-1] - speed) * (v[1:] - speed) < 0) | (v[:-1] == speed)):
        share = 0.0 if v[k + 1] == v[k] else (speed - v[k]) / (v[k + 1] - v[k])
        state = branch.state[k] + share * (branch.state[k + 1] - branch.state[k])
        near = k + int(round(share))
        found.append((bool(branch.stable[near]), state, branch.multipliers[near]))
    return found


class _Piece(NamedTuple):
    """A stable part of one branch, its points by rising speed."""

    stretch: Stretch
    rpm: np.ndarray
    state: np.ndarray

    def state_at(self, rpm: float) -> np.ndarray:
        return np.array([np.interp(rpm, self.rpm, c) for c in self.state.T])

    def holds(self, rpm: float, state: np.ndarray, scale: np.ndarray) -> bool:
        """Whether the orbit `state` at `rpm` lies on this piece."""
        inside = self.stretch.lower_rpm <= rpm <= self.stretch.upper_rpm
        return inside and bool(np.max(np.abs(self.state_at(rpm) - state) / scale) < ON_BRANCH)


def _pieces(branch: Branch, number: int, limits: tuple[float, float]) -> list[_Piece]:
    """The stable parts of a branch over speed, cut to the limits [rpm]."""
    found = []
    edges = {p.index: p for p in branch.special if p.edge and p.status == "converged"}
    change = np.flatnonzero(np.diff(branch.stable.astype(int)))
    bounds = [-1, *change.tolist(), branch.value.size - 1]
    for first, last in zip(bounds[:-1], bounds[1:], strict=True):
        if last <= first or not branch.stable[last]:
            continue
        points = [edges.get(first), edges.get(last)]
        rpm, state = branch.speed_rpm[first + 1 : last + 1], branch.state[first + 1 : last + 1]
        if rpm[0] > rpm[-1]:
            points, rpm, state = points[::-1], rpm[::-1], state[::-1]
        low, high = (float(r if p is None else p.speed_rpm) for p, r in zip(points, (rpm[0], rpm[-1]), strict=True))
        stretch = Stretch(points[0], points[1], max(low, limits[0]), min(high, limits[1]), number)
        found.append(_Piece(stretch, rpm, state))
    return found


def _merged(pieces: Sequence[_Piece], scale: Scale) -> list[_Piece]:
    """Pieces of the same orbits, met on two branches that were followed from different starts, made one."""
    whole: list[_Piece] = []
    for piece in sorted(pieces, key=lambda p: p.stretch.lower_rpm):
        for i, other in enumerate(whole):
            a, b = other.stretch, piece.stretch
            shared = min(a.upper_rpm, b.upper_rpm)
            rpm = (b.lower_rpm + shared) / 2
            if b.lower_rpm <= shared and other.holds(rpm, piece.state_at(rpm), scale(rpm * np.pi / 30)):
                beyond = piece.rpm > other.rpm[-1]
                top = b if b.upper_rpm > a.upper_rpm else a
                joined = dataclasses.replace(a, upper=top.upper, upper_rpm=top.upper_rpm)
                rpm = np.concatenate([other.rpm, piece.rpm[beyond]])
                state = np.concatenate([other.state, piece.state[beyond]])
                whole[i] = _Piece(joined, rpm, state)
                break
        else:
            whole.append(piece)
    return whole


def _distinct(points: Sequence[Point]) -> tuple[Point, ...]:
    """Points by speed, those met twice taken once."""
    kept: list[Point] = []
    for p in sorted((p for p in points if p.status == "converged"), key=lambda p: p.value):
        apart = lambda q: max(1e-6 * p.value, p.error + q.error) if p.error + q.error >= 0 else 1e-6 * p.value
        same = lambda q: q.kind == p.kind and abs(q.value - p.value) < apart(q) and np.allclose(q.state, p.state, 1e-3)
        if not any(same(q) for q in kept[-6:]):
            kept.append(p)
    return tuple(kept)


def synchronous_orbits(
    system: AbstractForcedSystem,
    lower: float,
    upper: float,
    *,
    count: int = 251,
    discard: int = 250,
    steps: Steps = Steps(most=1500),
    settled: Sweep | None = None,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> SynchronousOrbits:
    """Find and follow the synchronous orbits between two speeds [rad/s].

    **Arguments:** system and range; number of speeds that are simulated from each of the system's starts, and
    revolutions left out; or a sweep that was made before; steps of the continuation, in units of 1/20 of the range.
    The same speeds are simulated from the opposites of the starts too, which serve only to locate orbits.

    **Returns:** `SynchronousOrbits`. Stable orbits with a small basin can escape the simulations: `missed` counts those
    that were met but not followed; those that were not met cannot be counted.
    """
    require_at_least(1, count=count)
    say = progress or (lambda what, done, of: None)
    scale = functools.cache(lambda speed: np.array([float(c) for c in system.scale(speed)]))

    def simulate(speeds: np.ndarray, sign: float) -> Sweep:
        short: dict[str, Any] = {"discard": discard, "revolutions": 8, "blocks": 1, "keep": 8, "exponents": 0}
        starts, told = sign * initial_states(system, speeds, None), lambda done, of: say("simulations", done, of)
        return sweep(system, speeds, starts=starts, **short, method=method, progress=told)

    settled = simulate(np.linspace(lower, upper, count), 1.0) if settled is None else settled
    opposite = simulate(settled.speed[:: -(-settled.speed.size // count)], -1.0)
    follower = make_follower(Given(system, jnp.asarray((lower + upper) / 2)), SPEED, lower, upper, method)
    met = _met(settled)
    if met:
        middle = met[len(met) // 2]
        follower = stable_steps(follower, (settled.last[tuple(middle)], float(settled.speed[middle[0]])))
    orbits = _stable_orbits(follower, settled, scale)
    waiting = sorted(orbits + _stable_orbits(follower, opposite, scale), key=lambda o: o.speed)
    branches: list[Branch] = []
    for turn in range(ROUNDS):
        if not waiting:
            break
        say("branches", turn, ROUNDS)
        picked = np.unique(np.linspace(0, len(waiting) - 1, min(ROUND, len(waiting))).round().astype(int))
        starts = [(waiting[i].state, waiting[i].speed) for i in picked]
        branches += [b for b in follow_both_ways(follower, starts, steps, PATIENCE) if b is not None]
        waiting = [w for w in waiting if not any(_covers(b, w, scale(w.speed)) for b in branches)]
    say("branches", ROUNDS, ROUNDS)
    limits = lower * 30 / np.pi, upper * 30 / np.pi
    pieces = _merged([p for i, b in enumerate(branches) for p in _pieces(b, i, limits)], scale)
    families = _families(branches, scale)
    there = [o for o in orbits if o.settled]
    stretches = []
    for piece in pieces:
        met = [o.start for o in there if piece.holds(o.speed * 30 / np.pi, o.state, scale(o.speed))]
        family = families[piece.stretch.branch]
        stretches.append(dataclasses.replace(piece.stretch, family=family, met=len(met), met_first=met.count(0)))
    return SynchronousOrbits(tuple(branches), tuple(stretches), settled, len(waiting), *limits)


class _Settled(NamedTuple):
    """A stable orbit that the end of a simulation led to."""

    state: np.ndarray
    speed: float
    start: int
    settled: bool = False
    """Whether the simulation had come near it, before Newton's method."""


NEARLY = 0.1
"""A simulation that moves by less in its last revolution, in units of the scale, is on its way to an orbit: another one
is chaotic, and Newton's method is not tried from it again and again."""


def _met(settled: Sweep) -> list[list[int]]:
    """Speed and start of the simulations that ran to their end, though some may be still on the way to an orbit."""
    return np.argwhere(np.all(np.isfinite(settled.last), axis=-1)).tolist()


def _stable_orbits(follower: Follower, settled: Sweep, scale: Scale) -> list[_Settled]:
    """Stable orbits to which Newton's method leads from the ends of simulations, by speed."""
    lanes = _met(settled)
    met = [(settled.last[i, j], float(settled.speed[i])) for i, j in lanes]
    if not met:
        return []
    follower = follower.around(met[0][1])
    moved = settled.strobe[..., -1, :] - settled.strobe[..., -2, :] if settled.strobe.shape[2] > 1 else 0.0
    near = np.max(np.abs(moved / settled.scale[:, None]), axis=-1) < NEARLY
    points = seeds(follower, met, np.array([near[i, j] for i, j in lanes]))
    good = points.converged.copy()
    good[good] = follower.unstable(take(points, good)) == 0
    states = points.u[:, :-1] * np.asarray(follower.problem.scale)
    apart = [np.max(np.abs(y - x) / scale(at)) for x, (y, at) in zip(states, met, strict=True)]
    return [_Settled(states[i], met[i][1], lanes[i][1], bool(apart[i] < ON_BRANCH)) for i in np.flatnonzero(good)]


def _covers(branch: Branch, orbit: _Settled, scale: np.ndarray) -> bool:
    """Whether an orbit lies on a branch."""
    apart = (np.max(np.abs(s - orbit.state) / scale) for _, s, _ in crossings(branch, orbit.speed))
    return any(a < ON_BRANCH for a in apart)


def _families(branches: Sequence[Branch], scale: Scale) -> list[int]:
    """A number for each branch, the same for parts of one: a part that was stopped on another ends there."""
    family = list(range(len(branches)))
    for i, b in enumerate(branches):
        for end, why in zip((0, -1), b.ended, strict=True):
            last = _Settled(b.state[end], float(b.speed[end]), 0)
            for j, other in enumerate(branches):
                if why == "stopped" and i != j and _covers(other, last, scale(last.speed)):
                    family = [family[j] if f == family[i] else f for f in family]
    return family


def coexisting_orbits(
    system: AbstractForcedSystem,
    speed: Scalar,
    periods: int = 1,
    *,
    count: int = 24,
    revolutions: int = 5,
    seed: int = 0,
    method: AbstractMethod | None = None,
) -> list[Orbit]:
    """Orbits that close after `periods` revolutions and not earlier, from the system's own starts and random ones.

    **Arguments:** system and speed [rad/s]; number of random starts and their seed; revolutions of simulation before
    Newton's method takes over: with few, unstable orbits are found as well.

    **Returns:** distinct orbits, the stable ones first. There is no proof that these are all.
    """
    require_x64()
    require_at_least(0, seed=seed)
    require_at_least(1, periods=periods, count=count)
    require_speeds(system, speed)
    scale = np.array([float(c) for c in system.scale(speed)])
    own = np.array([[float(c) for c in y] for y in system.starts(speed)])
    random = np.random.default_rng(seed).uniform(-SPREAD, SPREAD, (count, scale.size)) * scale
    starts = jnp.asarray(np.concatenate([own, random]))
    find = lambda y: periodic_orbit(system, speed, periods, guess=y, revolutions=revolutions, method=method)
    found = jax.vmap(find)(starts)
    strobe = lambda orbit, y: strobe_map(system, jnp.asarray(speed, dtype=float), orbit.method)(tuple(y))
    advance = compiled(jax.vmap(lambda orbit, y: jnp.stack(strobe(orbit, y).y)))
    rows = [found.state]
    for _ in range(periods - 1):
        rows.append(advance(found, rows[-1]))
    images = np.stack([np.asarray(row) / scale for row in rows], axis=1)
    near = lambda a, b: bool(np.max(np.abs(a - b)) < SAME)
    kept: list[int] = []
    for i in np.flatnonzero(np.asarray(found.converged)):
        shorter = any(near(images[i, 0], images[i, j]) for j in range(1, periods))
        if not shorter and not any(near(images[i, 0], image) for k in kept for image in images[k]):
            kept.append(int(i))
    orbits = [jax.tree.map(lambda x: x[i] if eqx.is_array(x) and x.ndim else x, found) for i in kept]
    return sorted(orbits, key=lambda o: float(jnp.max(jnp.abs(o.multipliers))))
