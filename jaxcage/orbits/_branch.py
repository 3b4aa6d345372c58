"""Branches of periodic orbits over a parameter, stable and unstable, with their bifurcations located and labelled."""

import dataclasses
import math
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from .._types import Scalar
from ..models import AbstractForcedSystem, require_speeds
from ..solve import AbstractMethod, Rodas4
from ._arclength import Corrected, Steps, Trace, follow, passes, take
from ._follower import (
    Follower,
    Start,
    by_rodas4,
    in_a_row,
    make_follower,
    require_range,
    require_within,
    seeds,
    stable_steps,
    turned,
)
from ._located import Seen, account
from ._orbit import NearOrbit, Orbit, guess_state
from ._point import FOUND, NOT_CONVERGED, NOT_EXPLAINED, UNEXPLAINED, Point, value_at
from ._problem import SPEED, Given, Parameter
from ._singularity import CRITICAL
from ._steps import SETTLED


@dataclasses.dataclass(frozen=True)
class Branch:
    """Orbits in order along a branch."""

    parameter: str
    value: Float[np.ndarray, " points"]
    """Values of the parameter [SI]."""
    speed: Float[np.ndarray, " points"]
    """Speeds [rad/s]."""
    state: Float[np.ndarray, "points dim"]
    """States at phase 0 [SI]."""
    multipliers: Complex[np.ndarray, "points dim"]
    stable: Bool[np.ndarray, " points"]
    special: tuple[Point, ...]
    """Bifurcations, in order along the branch."""
    periods: int
    ended: tuple[str, str]
    """Why the branch ends where it begins and where it ends: as for `Trace`, or `doubling`, where it forks off."""
    steps: Int[np.ndarray, " points"]
    """Steps per revolution."""
    error: Float[np.ndarray, " points"]
    """Of each orbit (see `Orbit.error`)."""

    @property
    def speed_rpm(self) -> Float[np.ndarray, " points"]:
        """Speeds in revolutions per minute."""
        return self.speed * 30 / np.pi

    def __str__(self) -> str:
        head = (
            f"Branch of period-{self.periods} orbits: {self.value.size} points, {self.parameter} from "
            f"{self.value.min():.6g} to {self.value.max():.6g}, {np.mean(self.stable):.0%} stable, "
            f"ends: {', '.join(self.ended)}"
        )
        rows = [
            f"  {p.kind:<16} {p.parameter} = {p.value:.8g} +- {p.error:.1g}, multiplier {p.critical:.4f}, {p.status}"
            for p in self.special
        ]
        return "\n".join([head, *rows])

    _repr_html_ = notebook_html


def branch(
    system: AbstractForcedSystem,
    orbit: NearOrbit,
    parameter: Parameter = SPEED,
    *,
    lower: float,
    upper: float,
    speed: Scalar | None = None,
    periods: int = 1,
    steps: Steps = Steps(),
    method: AbstractMethod | None = None,
) -> Branch:
    """Follow a branch of periodic orbits both ways from `orbit`, by pseudo-arclength continuation.

    **Arguments:**

    - `orbit`: an `Orbit`, or a pair (state, value of the parameter) near one.
    - `parameter`: `"speed"`, the name of a parameter, or a function that picks it from the system.
    - `lower`, `upper`: range of the parameter [SI], in which `orbit` lies.
    - `speed`: speed [rad/s] where it is not the parameter and `orbit` does not have it.
    - `steps`: step lengths; in units of 1/20 of the range for the parameter, and of the system's scale for the state.

    **Raises:** `ValueError` if there is no orbit to start from, or none in a finite range.
    """
    require_x64()
    require_at_least(1, periods=periods)
    require_range(parameter, lower, upper)
    if isinstance(orbit, Orbit | Point):
        speed, periods = orbit.speed, int(orbit.periods)
        state, at = orbit.state, value_at(orbit, system, speed, parameter)
    else:
        state, at = orbit
    known_speed = at if parameter == SPEED else speed
    if known_speed is None:
        raise ArgumentError("speed", said=f"must be given where the parameter is `{parameter}`, but it is not.")
    require_speeds(system, known_speed)
    require_within("orbit", float(at), lower, upper)
    given = Given(system, jnp.asarray(known_speed, dtype=float))
    follower = make_follower(given, parameter, lower, upper, method, periods)
    if method is None and isinstance(orbit, Orbit) and isinstance(orbit.solver, Rodas4):
        follower = by_rodas4(follower)
    state = guess_state(system, known_speed, state)
    (found,) = follow_both_ways(follower, [(np.asarray(state), float(at))], steps)
    if found is None:
        raise ArgumentError("orbit", said=f"must be near a periodic orbit, but none is near it at {float(at):g}.")
    return found


def follow_both_ways(
    follower: Follower,
    starts: Sequence[Start],
    steps: Steps,
    patience: int | float = math.inf,
    stop: Callable[[list[Corrected]], bool] = lambda points: False,
) -> list[Branch | None]:
    """A branch through each start; None where a start is not near an orbit, or on the branch of an earlier one.

    A lane that comes upon what another has followed ends there: one branch may come in two parts. It also ends after
    `patience` unstable orbits in a row, since there is no end to how such a branch can wind, or where `stop` says so.
    """
    follower = stable_steps(follower.around(starts[0][1]), starts[0])
    first = seeds(follower, starts)
    count = len(starts)
    lanes, sign = np.tile(np.arange(count), 2), np.repeat([1.0, -1.0], count)
    taken = ~first.converged
    walked: dict[int, list[Corrected]] = {}
    unstable = dict.fromkeys(range(2 * count), 0)

    def ends(lane: int, points: list[Corrected]) -> bool:
        walked[lane] = points
        own = lane % count
        step = points[-2].u, points[-1].u
        calm = follower.unstable(points[-1]) == 0
        unstable[lane] = 0 if calm else unstable[lane] + 1
        if taken[own] or unstable[lane] >= patience or stop(points):
            return True
        for other in range(own + 1, count):
            taken[other] |= passes(*step, first.u[other][None])
        others = [p.u for k, row in walked.items() if k % count != own and not taken[k % count] for p in row]
        return bool(others) and passes(*step, np.stack(others))

    both = turned(take(first, lanes), sign)
    traces = follow(follower.curves(2 * count), both, steps=steps, inside=follower.inside, stop=ends)
    kept = [i for i in range(count) if not taken[i]]
    found = describe(follower, [joined(follower, traces[i], traces[i + count]) for i in kept])
    return [found[kept.index(i)] if i in kept else None for i in range(count)]


def joined(follower: Follower, up: Trace, down: Trace) -> tuple[Corrected, tuple[str, str]]:
    """Both directions as one row of points. A closed curve, which was gone round twice, is taken once, from an unstable
    orbit on, so that no stable part is cut."""
    if "closed" in (up.ended, down.ended):
        up = up if up.ended == "closed" else down
        stable = follower.unstable(up.points) == 0
        count = stable.size - 1  # the last point is past the first
        order = (np.arange(count + 1) + int(np.argmin(stable[:-1]))) % count
        return take(up.points, order), (up.ended, up.ended)
    return in_a_row(down.points, up.points), (down.ended, up.ended)


def describe(follower: Follower, traces: Sequence[tuple[Corrected, tuple[str, str]]]) -> list[Branch]:
    """Branches from their points, with special points located, all at once."""
    rows = account(follower, [points for points, _ in traces])
    return [_branch(follower, *row, ended) for row, (_, ended) in zip(rows, traces, strict=True)]


def _branch(follower: Follower, points: Corrected, seen: Sequence[Seen], ended: tuple[str, str]) -> Branch:
    multipliers = follower.multipliers(points)
    stable = follower.unstable(points) == 0
    n = follower.problem.dimension
    scale, periods = np.asarray(follower.problem.scale), int(follower.problem.periods)
    name = follower.parameter if isinstance(follower.parameter, str) else "parameter"
    fixed = None if name == SPEED else float(follower.given.speed)
    speed = lambda u: u[..., -1] * follower.unit if fixed is None else np.full(u.shape[:-1], fixed)
    special = []
    before = [found.after for found in seen]
    for i, (k, kind, p, error) in enumerate(seen):
        mu = follower.multipliers(p)
        direction = np.zeros(n)
        if kind in CRITICAL:
            direction = np.linalg.svd(follower.monodromy(p) - CRITICAL[kind] * np.eye(n))[2][-1]
        # Of several between two points, the outer ones only are next to orbits whose stability is known.
        edge = bool((stable[k] and k not in before[:i]) or (stable[k + 1] and k not in before[i + 1 :]))
        at = float(p.u[-1] * follower.unit)
        settled = NOT_CONVERGED if error > SETTLED * max(abs(at), follower.unit) else FOUND
        outcome = NOT_EXPLAINED if kind == UNEXPLAINED else settled
        known = float("nan") if outcome == NOT_CONVERGED else 1.0
        special.append(
            Point(
                kind=kind,
                speed=float(speed(p.u)) * known,
                state=p.u[:n] * scale,
                periods=periods,
                steps=int(p.steps),
                parameter=name,
                value=at * known,
                error=error,
                multipliers=mu,
                direction=direction * scale,
                outcome=outcome,
                index=int(k),
                edge=edge,
            )
        )
    return Branch(
        parameter=name,
        value=points.u[:, -1] * follower.unit,
        speed=speed(points.u),
        state=points.u[:, :n] * scale,
        multipliers=multipliers,
        stable=stable,
        steps=points.steps,
        error=points.error,
        special=tuple(special),
        periods=periods,
        ended=ended,
    )
