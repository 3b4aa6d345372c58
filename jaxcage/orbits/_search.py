"""The synchronous (period-1) orbits of a system over a range of speed, found without a hint of where they are.

Simulations from several starts on a coarse grid settle on stable orbits here and there; each is followed both ways by
arclength, until every orbit that was met lies on a branch that is known. Stable stretches of the branches, bounded by
bifurcations, are what the synchronous-loss edges are about.
"""

import dataclasses
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np

from ..analysis import Sweep
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..sweeps import sweep
from ._arclength import Steps, take
from ._branch import (
    Branch,
    Follower,
    SpecialPoint,
    Start,
    eigenvalues,
    follow_both_ways,
    is_stable,
    make_follower,
    seeds,
)
from ._lens import SPEED


ROUND = 4
"""Branches followed at a time."""
ROUNDS = 8
ON_BRANCH = 0.03
"""An orbit lies on a branch if it is within this distance of it, in units of the system's scale."""
Progress = Callable[[str, int, int], None]


@dataclasses.dataclass(frozen=True)
class Stretch:
    """A stable part of a branch of synchronous orbits; an end is None where it leaves the range."""

    lower: SpecialPoint | None
    upper: SpecialPoint | None
    lower_rpm: float
    upper_rpm: float
    branch: int

    @property
    def width_rpm(self) -> float:
        """How much speed it covers [rpm]."""
        return self.upper_rpm - self.lower_rpm

    def __str__(self) -> str:
        end = lambda p, rpm: f"{rpm:.1f} ({'range' if p is None else p.kind})"
        return f"{end(self.lower, self.lower_rpm)} to {end(self.upper, self.upper_rpm)} rpm"


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
    def edges(self) -> tuple[SpecialPoint, ...]:
        """Bifurcations at which a stable synchronous orbit ends, by speed."""
        ends = [p for s in self.stretches for p in (s.lower, s.upper) if p is not None]
        return tuple(sorted(ends, key=lambda p: p.value))

    @property
    def points(self) -> tuple[SpecialPoint, ...]:
        """All bifurcations on all branches, by speed."""
        return tuple(sorted((p for b in self.branches for p in b.special), key=lambda p: p.value))

    def coexisting(self, speed: float) -> list[tuple[int, bool, np.ndarray, np.ndarray]]:
        """Orbits at `speed` [rad/s]: branch, whether stable, state [SI], multipliers; to the accuracy of the steps."""
        return [(i, *orbit) for i, b in enumerate(self.branches) for orbit in crossings(b, speed)]

    def __str__(self) -> str:
        head = f"{len(self.branches)} branches of synchronous orbits, {len(self.stretches)} stable stretches"
        return "\n".join([head, *(f"  {s}" for s in self.stretches)])


def crossings(branch: Branch, speed: float) -> list[tuple[bool, np.ndarray, np.ndarray]]:
    """Where a branch over speed passes `speed`: stable or not, state, multipliers, by linear interpolation."""
    v = branch.value
    found = []
    for k in np.flatnonzero((v[:-1] - speed) * (v[1:] - speed) <= 0):
        share = 0.0 if v[k + 1] == v[k] else (speed - v[k]) / (v[k + 1] - v[k])
        state = branch.state[k] + share * (branch.state[k + 1] - branch.state[k])
        near = k + int(round(share))
        found.append((bool(branch.stable[near]), state, branch.multipliers[near]))
    return found


def stable_stretches(branch: Branch, number: int) -> list[Stretch]:
    """The stable parts of a branch over speed."""
    found = []
    edges = {p.index: p for p in branch.special if p.edge}
    change = np.flatnonzero(np.diff(branch.stable.astype(int)))
    bounds = [-1, *change.tolist(), branch.value.size - 1]
    for first, last in zip(bounds[:-1], bounds[1:], strict=True):
        if last <= first or not branch.stable[last]:
            continue
        ends = [(edges.get(first), branch.speed_rpm[first + 1]), (edges.get(last), branch.speed_rpm[last])]
        placed = sorted(((rpm if p is None else p.speed_rpm, p) for p, rpm in ends), key=lambda e: float(e[0]))
        (low, p), (high, q) = placed
        found.append(Stretch(p, q, float(low), float(high), number))
    return found


def synchronous_orbits(
    system: AbstractForcedSystem,
    lower: float,
    upper: float,
    *,
    count: int = 101,
    discard: int = 250,
    steps: Steps = Steps(most=600),
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> SynchronousOrbits:
    """Find and follow the synchronous orbits between two speeds [rad/s].

    **Arguments:** system and range; number of speeds that are simulated from each of the system's starts, and
    revolutions left out; steps of the continuation, in units of 1/20 of the range.

    **Returns:** `SynchronousOrbits`. Stable orbits with a small basin can escape the simulations: `missed` counts those
    that were met but not followed; those that were not met cannot be counted.
    """
    say = progress or (lambda what, done, of: None)
    settled = sweep(
        system,
        np.linspace(lower, upper, count),
        discard=discard,
        revolutions=8,
        blocks=1,
        keep=8,
        exponents=0,
        method=method,
        progress=lambda done, of: say("simulations", done, of),
    )
    follower = make_follower(system, (lower + upper) / 2, SPEED, lower, upper, method=method)
    waiting = _stable_orbits(follower, settled)
    branches: list[Branch] = []
    for turn in range(ROUNDS):
        if not waiting:
            break
        say("branches", turn, ROUNDS)
        branches += [b for b in follow_both_ways(follower, _spread(waiting, ROUND), 1, steps) if b is not None]
        waiting = [w for w in waiting if not any(_covers(follower, b, w) for b in branches)]
    say("branches", ROUNDS, ROUNDS)
    stretches = [s for i, b in enumerate(branches) for s in stable_stretches(b, i)]
    return SynchronousOrbits(
        tuple(branches),
        tuple(sorted(stretches, key=lambda s: s.lower_rpm)),
        settled,
        len(waiting),
        lower * 30 / np.pi,
        upper * 30 / np.pi,
    )


def _stable_orbits(follower: Follower, settled: Sweep) -> list[Start]:
    """Stable orbits on which simulations settled, by speed, corrected by Newton's method."""
    lanes = zip(*np.nonzero(settled.label == "periodic-1"), strict=True)
    met = [(settled.last[i, j], float(settled.speed[i])) for i, j in lanes]
    if not met:
        return []
    frame = follower.frame(jnp.asarray(met[0][0]), met[0][1], 1)
    _, points = seeds(follower, frame, met)
    good = points.converged.copy()
    good[good] = is_stable(eigenvalues(follower.monodromy(take(points, good))), follower.problem.free_speed)
    states = points.u[:, :-1] * np.asarray(frame.scale)
    return [(states[i], met[i][1]) for i in np.flatnonzero(good)]


def _spread(starts: Sequence[Start], most: int) -> list[Start]:
    """At most `most` of the starts, spread over them."""
    picked = np.unique(np.linspace(0, len(starts) - 1, min(most, len(starts))).round().astype(int))
    return [starts[i] for i in picked]


def _covers(follower: Follower, branch: Branch, start: Start) -> bool:
    """Whether an orbit lies on a branch."""
    state, speed = start
    scale = np.array([float(c) for c in follower.given.system.scale(speed)])
    apart = (np.max(np.abs(s - state) / scale) for _, s, _ in crossings(branch, speed))
    return any(a < ON_BRANCH for a in apart)
