"""Pseudo-arclength continuation of curves of solutions, many at a time.

A curve R(u) = 0 with one unknown more than equations is followed by predicting along its tangent and correcting by
Newton's method on the plane across it, through folds and whatever the stability. Every curve (lane) has its own step
length; the corrections of all lanes run in chunks of one compiled program on all cores.
"""

import concurrent.futures
import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..integrate import compiled
from ..sweeps import cores
from ._implicit import TOLERANCE, AbstractEquations, solve


LANES = (8, 32)
"""Lanes per call: two programs for any number of curves, and work for every core. Up to eight lanes cost what one does:
they share the processor's instructions."""
FOLLOWING = 1e-7
"""Newton's last step while following, in the unknowns' units: points are then good to about its square."""
CORRECTIONS = 8


class OnPlane(AbstractEquations):
    """Equations of a curve, on the plane through `at` across `normal`."""

    curve: AbstractEquations
    at: Float[Array, " n"]
    normal: Float[Array, " n"]

    def prepare(self, u: Array, given: Any) -> Any:
        return self.curve.prepare(u, given)

    def residual(self, u: Array, prepared: Any) -> tuple[Array, Any]:
        r, aux = self.curve.residual(u, prepared)
        return jnp.append(r, jnp.dot(self.normal, u - self.at)), aux

    def linearised(self, u: Array, given: Any) -> tuple[Array, Array, Any]:
        r, jacobian, aux = self.curve.linearised(u, given)
        off = jnp.dot(self.normal, u - self.at)
        return jnp.append(r, off), jnp.concatenate([jacobian, self.normal[None]]), aux


class Corrected(NamedTuple):
    """Points of curves, NumPy arrays with the lanes first: unknowns (n), tangent (n), Jacobian (m x n), and so on."""

    u: Any
    tangent: Any
    """Unit tangent, on the side of the normal of the plane."""
    jacobian: Any
    converged: Any
    iterations: Any
    aux: Any


def _correct(curve: AbstractEquations, given: Any, at: Array, normal: Array, tolerance: Array) -> Corrected:
    u, found = solve(OnPlane(curve, at, normal), given, at, CORRECTIONS, tolerance)
    jacobian = found.newton.jacobian[:-1]
    whole = jnp.concatenate([jacobian, normal[None]])
    tangent = jnp.linalg.solve(whole, jnp.zeros(u.size).at[-1].set(1.0))
    tangent = tangent / jnp.linalg.norm(tangent)
    fine = found.converged & jnp.all(jnp.isfinite(u)) & jnp.all(jnp.isfinite(tangent))
    return Corrected(u, tangent, jacobian, fine, found.iterations, found.aux)


_axes = eqx.if_array(0)
_correct_shared = compiled(eqx.filter_vmap(_correct, in_axes=(_axes, None, 0, 0, None)))
_correct_own = compiled(eqx.filter_vmap(_correct, in_axes=(_axes, _axes, 0, 0, None)))


def take(tree: Any, lanes: np.ndarray) -> Any:
    """Chosen lanes of a tree whose arrays have the lanes first, by NumPy: JAX takes a millisecond for each array."""
    return jax.tree.map(lambda x: np.asarray(x)[lanes] if eqx.is_array(x) else x, tree)


def stack(tree: Any, lanes: int) -> Any:
    """`lanes` copies of a tree."""
    return jax.tree.map(lambda x: jnp.broadcast_to(x, (lanes, *x.shape)) if eqx.is_array(x) else x, tree)


def correct(
    curves: AbstractEquations,
    given: Any,
    at: np.ndarray,
    normal: np.ndarray,
    own_given: bool = False,
    tolerance: float = TOLERANCE,
) -> Corrected:
    """Points of many curves on planes across them.

    **Arguments:** curves, their arrays with the lanes first; what is given, shared or, if `own_given`, with the lanes
    first; points of the planes and their normals.
    """
    lanes = at.shape[0]
    run = _correct_own if own_given else _correct_shared
    size = LANES[lanes > LANES[0]]
    padded = lambda first: np.minimum(np.arange(first, first + size), lanes - 1)
    mine = lambda chosen: take(given, chosen) if own_given else given
    got = lambda k: run(take(curves, k), mine(k), jnp.asarray(at[k]), jnp.asarray(normal[k]), jnp.asarray(tolerance))
    part = lambda first: jax.tree.map(lambda x: np.asarray(x)[: lanes - first], got(padded(first)))
    firsts = range(0, lanes, size)
    if len(firsts) == 1:
        return part(0)
    with concurrent.futures.ThreadPoolExecutor(cores()) as pool:
        parts = list(pool.map(part, firsts))
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


@dataclasses.dataclass(frozen=True)
class Steps:
    """How far to go: lengths of steps in the unknowns' units, and their number per lane."""

    first: float = 0.02
    longest: float = 0.1
    shortest: float = 1e-5
    most: int = 400
    turn: float = 0.95
    """Smallest cosine of the angle between neighbouring tangents."""
    bend: float = 0.3
    """Largest correction, over the step's length: more, and Newton's method may have gone to another curve."""

    def __post_init__(self):
        if not 0 < self.shortest <= self.first <= self.longest:
            raise ValueError(
                "Argument `steps` must have 0 < shortest <= first <= longest, but has "
                f"{self.shortest:g}, {self.first:g} and {self.longest:g}."
            )


class Trace(NamedTuple):
    """Points of one curve in order, and why it ended."""

    points: Corrected
    ended: str
    """`range`: it left the range; `closed`: it came back to where it began; `steps`: the number of steps was reached;
    `stopped`: it was stopped by the caller; `stuck`: no further point was found with the shortest step."""


def _closed(points: list[Corrected]) -> bool:
    """Whether the last step passed the first point in the same direction."""
    if len(points) < 8:
        return False
    first, before, last = points[0], points[-2], points[-1]
    step = last.u - before.u
    share = np.dot(first.u - before.u, step) / np.dot(step, step)
    off = np.linalg.norm(before.u + share * step - first.u)
    return bool(0 < share <= 1 and off < 0.2 * np.linalg.norm(step) and np.dot(step, first.tangent) > 0)


def follow(
    curves: AbstractEquations,
    given: Any,
    start: Corrected,
    *,
    steps: Steps,
    inside: Callable[[np.ndarray], np.ndarray],
    stop: Callable[[int, list[Corrected]], bool] = lambda lane, points: False,
    update: Callable[[AbstractEquations, Corrected, np.ndarray], AbstractEquations] | None = None,
    own_given: bool = False,
) -> list[Trace]:
    """Follow many curves from their first points, each in the direction of its tangent.

    **Arguments:**

    - `curves`, `given`, `own_given`: as for `correct`.
    - `start`: first points, the lanes first.
    - `inside`: tells for unknowns, the lanes first, whether they are within the range; a curve ends with its
        first point outside.
    - `stop`: called with a lane and its points after each step.
    - `update`: new curves from the last points of the lanes given, e.g. with fresh borders.

    **Returns:** a `Trace` per lane.
    """
    lanes = start.u.shape[0]
    points = [[take(start, np.array(i))] for i in range(lanes)]
    length = np.full(lanes, steps.first)
    ended = np.where(start.converged, "", "stuck").astype(object)
    while np.any(active := ended == ""):
        index = np.flatnonzero(active)
        last = [points[i][-1] for i in index]
        u, tangent = (np.stack([getattr(p, name) for p in last]) for name in ("u", "tangent"))
        mine = take(given, index) if own_given else given
        ahead = u + length[index, None] * tangent
        got = correct(take(curves, index), mine, ahead, tangent, own_given, FOLLOWING)
        straight = np.sum(got.tangent * tangent, axis=1) > steps.turn
        near = np.linalg.norm(got.u - ahead, axis=1) < steps.bend * length[index]
        good = got.converged & straight & near
        if update is not None and np.any(good):
            curves = update(curves, take(got, good), index[good])
        for k, i in enumerate(index):
            if not good[k]:
                length[i] /= 2
                if length[i] < steps.shortest:
                    ended[i] = "stuck"
                continue
            points[i].append(take(got, np.array(k)))
            quick = got.iterations[k] <= 4
            length[i] = min(steps.longest, length[i] * (1.5 if quick else 0.8))
            if not inside(got.u[k][None])[0]:
                ended[i] = "range"
            elif stop(int(i), points[i]):
                ended[i] = "stopped"
            elif _closed(points[i]):
                ended[i] = "closed"
            elif len(points[i]) > steps.most:
                ended[i] = "steps"
    return [Trace(jax.tree.map(lambda *x: np.stack(x), *p), str(e)) for p, e in zip(points, ended, strict=True)]
