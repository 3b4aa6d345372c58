"""Pseudo-arclength continuation of curves of solutions, many at a time.

A curve R(u) = 0 with one unknown more than equations is followed by predicting along the cubic through its last two
points and their tangents, and correcting by Newton's method on the plane across it, through folds and whatever the
stability. A point of the same curve has the tangent that belongs to its place, and the orientation of the curve; a
point of another curve beside it has neither, and a step to it is refused. Every curve (lane) has its own step length;
the corrections of all lanes run in chunks of one compiled program on all cores.
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

from .._errors import ArgumentError
from .._form import compiled
from ..solve import cores
from ._implicit import TOLERANCE, AbstractEquations, solve
from ._steps import GIVEN_UP, SETTLED, Counts, by_steps


LANES = 8
"""Lanes per call, one program for any number of curves. Up to eight lanes cost what one does: they share the
processor's instructions."""
FOLLOWING, OF_A_STEP = 1e-6, 1e-5
"""Newton's last step while following, in the unknowns' units, and over the step's length where that is less: points are
then good to about its square."""
ONCE = 1e300
"""The same for a single step: infinity would be no number where an unknown is zero."""
CORRECTIONS = 8
AIM = 3e-3
"""Distance from its prediction that the next point should have, in the unknowns' units."""
VEER = 0.7
"""How far the next step should turn, of the largest angle allowed."""
GROWTH = 1.8
"""Longest step over the one before."""
LOOSE, COARSER = 10.0, 100.0
"""While following errors may be larger than allowed, by this factor; where they are smaller than that by the second,
half as many steps do."""
TURN, BEND, SWING = 0.9, 0.3, 0.5
"""Of a step: smallest cosine of the angle between its tangents; largest correction, over its length: more, and Newton's
method may have gone to another curve; largest change of the equations' derivative, over its size and one: more, and
folds may have been passed over."""
MOVED = 0.1
"""What half the steps change in a point, over the step's length: more, and what is followed may be their error."""
ASTRAY, OF_LENGTH, OF_MISSED = 1e-4, 1e-2, 0.5
"""How far a point may be from where its tangent says that it is, in the unknowns' units and over the step's length, or
over its distance from the prediction."""
CROSSED, ASIDE = 1e-4, 0.01
"""A step across which the orientation changes is halved down to this length. Where it changes all the same the curve
crosses another, and the step is taken in one from so far off: near the crossing tangents are lost to rounding."""


class Corrected(NamedTuple):
    """Points of curves, NumPy arrays with the lanes first: unknowns (n), tangent (n), Jacobian (m x n), and so on."""

    u: Any
    tangent: Any
    """Unit tangent, on the side of the normal of the plane."""
    jacobian: Any
    converged: Any
    aux: Any
    steps: Any
    """Steps per revolution."""
    error: Any
    """Distance to what half the steps give, and the same over what is allowed (see `AbstractEquations.apart`)."""
    over: Any
    moved: Any
    """The same in the unknowns' units."""


def _correct(
    curve: AbstractEquations, given: Any, at: Array, normal: Array, tolerance: Array, steps: Array, halved: Array
) -> Corrected:
    """The point and, if `halved`, what one step of Newton's method makes of it with half the steps: two in a row."""

    def turn(plane: tuple[Array, Array], half: Array) -> tuple[tuple[Array, Array], Corrected]:
        at, normal = plane
        by = jnp.where(half, (steps + 1) // 2, steps)
        last, skip = jnp.where(half, ONCE, tolerance), half & ~halved

        def on_plane(u: Array) -> tuple[Array, Array, Any]:
            r, jacobian, aux = by_steps(curve, by).linearised(u, given)
            return jnp.append(r, jnp.dot(normal, u - at)), jnp.concatenate([jacobian, normal[None]]), aux

        u, found = solve(on_plane, at, CORRECTIONS, last, skip=skip, near=tolerance > TOLERANCE)
        jacobian = found.newton.jacobian[:-1]
        whole = jnp.concatenate([jacobian, normal[None]])
        tangent = jnp.linalg.solve(whole, jnp.zeros(u.size).at[-1].set(1.0))
        tangent = tangent / jnp.linalg.norm(tangent)
        fine = found.converged & jnp.all(jnp.isfinite(u)) & jnp.all(jnp.isfinite(tangent))
        unknown = jnp.full(3, jnp.nan)
        return (u, tangent), Corrected(u, tangent, jacobian, fine, found.aux, by, *unknown)

    return jax.lax.scan(turn, (at, normal), jnp.array([False, True]))[1]


_correct_lanes = compiled(eqx.filter_vmap(_correct, in_axes=(eqx.if_array(0), None, 0, 0, 0, None, None)))


def take(tree: Any, lanes: Any) -> Any:
    """Chosen lanes of a tree whose arrays have the lanes first, by NumPy: JAX takes a millisecond for each array."""
    return jax.tree.map(lambda x: np.asarray(x)[lanes] if eqx.is_array(x) else x, tree)


def put(tree: Any, lanes: np.ndarray, new: Any) -> Any:
    """The tree with `new` in these lanes."""

    def placed(x: Any, y: Any) -> np.ndarray:
        whole = np.array(x)
        whole[lanes] = y
        return whole

    return jax.tree.map(placed, tree, new)


def measured_as(new: Corrected, old: Corrected) -> Corrected:
    """The first with the second's errors."""
    return new._replace(error=old.error, over=old.over, moved=old.moved)


def stack(tree: Any, lanes: int) -> Any:
    """`lanes` copies of a tree."""
    return jax.tree.map(lambda x: np.broadcast_to(x, (lanes, *x.shape)) if eqx.is_array(x) else x, tree)


class Curves(NamedTuple):
    """Many curves of one kind, and the numbers of steps that may be tried."""

    equations: AbstractEquations
    """Their arrays with the lanes first."""
    given: Any
    counts: Counts

    def take(self, lanes: Any) -> "Curves":
        """Some of them."""
        return self._replace(equations=take(self.equations, lanes))

    @property
    def chooses(self) -> bool:
        """Whether the steps follow from their error."""
        return float(self.counts.tolerance) > 0


def correct(
    curves: Curves,
    at: np.ndarray,
    normal: np.ndarray,
    steps: np.ndarray,
    tolerance: Any = TOLERANCE,
    measured: bool = False,
) -> Corrected:
    """Points of many curves on planes across them.

    **Arguments:** curves; points of the planes and their normals; steps per revolution; Newton's last step, of all or
    each; whether errors are wanted too, by one step of Newton's method with half the steps.
    """
    measured = measured and int(curves.counts.last) > 1
    tolerance = np.broadcast_to(np.asarray(tolerance, dtype=float), len(at))
    chunks = []
    for count in np.unique(steps):  # lanes by as many steps run together
        mine = np.flatnonzero(steps == count)
        size = LANES
        chunks += [mine[np.minimum(np.arange(i, i + size), mine.size - 1)] for i in range(0, mine.size, size)]

    def part(k: np.ndarray) -> Corrected:
        some = curves.take(k)
        numbers = (np.asarray(x) for x in (at[k], normal[k], tolerance[k], steps[k[0]], measured))
        return jax.tree.map(np.asarray, _correct_lanes(some.equations, some.given, *numbers))

    if len(chunks) == 1:
        parts = [part(chunks[0])]
    else:
        with concurrent.futures.ThreadPoolExecutor(cores()) as pool:
            parts = list(pool.map(part, chunks))
    _, where = np.unique(np.concatenate(chunks), return_index=True)
    both = jax.tree.map(lambda *x: np.concatenate(x)[where], *parts)
    points, half = take(both, (slice(None), 0)), take(both, (slice(None), 1))
    if not measured:
        return points
    with np.errstate(invalid="ignore"):
        moved = points.u - half.u
        apart = *curves.equations.apart(moved, half.jacobian, points.jacobian), np.linalg.norm(moved, axis=1)
    lost = ~(half.converged & points.converged)
    error, over, far = (np.where(lost, np.inf, x) for x in apart)
    return points._replace(error=error, over=over, moved=far)


def settle_on(
    curves: Curves, at: np.ndarray, normal: np.ndarray, steps: int = 0, likely: np.ndarray | None = None
) -> Corrected:
    """Points of many curves on planes across them, by as many steps as each needs, which are at least `steps`.

    Where the first number of steps finds nothing, more are tried only for points that are `likely`, by default all.
    """
    first = int(curves.counts.first if curves.chooses else curves.counts.last)
    count = np.full(at.shape[0], max(steps, first))
    likely = np.ones(len(at), dtype=bool) if likely is None else likely
    found = correct(curves, at, normal, count, measured=True)
    while curves.chooses:
        given_up = ~found.converged & ((found.steps >= GIVEN_UP) | ~likely)
        again = np.flatnonzero(~(found.over <= LOOSE) & ~given_up & (found.steps < int(curves.counts.last)))
        if not again.size:
            break
        begin = np.where(found.converged[again, None], found.u[again], at[again])
        finer = correct(curves.take(again), begin, normal[again], 2 * found.steps[again], measured=True)
        found = put(found, again, finer)
    return found


@dataclasses.dataclass(frozen=True)
class Steps:
    """How far to go: lengths of steps in the unknowns' units, and their number per lane."""

    first: float = 0.02
    longest: float = 0.5
    shortest: float = 1e-7
    most: int = 400

    def __post_init__(self):
        if not 0 < self.shortest <= self.first <= self.longest:
            given = f"{self.shortest:g}, {self.first:g} and {self.longest:g}"
            raise ArgumentError("steps", said=f"must have 0 < shortest <= first <= longest, but has {given}.")


class Trace(NamedTuple):
    """Points of one curve in order, and why it ended."""

    points: Corrected
    ended: str
    """`range`: it left the range; `closed`: it came back to where it began; `steps`: the number of steps was reached;
    `stopped`: it was stopped by the caller; `stuck`: no further point was found with the shortest step; `inaccurate`:
    by the finest steps allowed the next point is not known any more."""


def passes(u: np.ndarray, v: np.ndarray, points: Float[np.ndarray, "points n"]) -> bool:
    """Whether the step from u to v goes through one of `points`, to the accuracy of the chord."""
    step = v - u
    share = (points - u) @ step / np.dot(step, step)
    off = np.linalg.norm(u + share[:, None] * step - points, axis=1)
    return bool(np.any((share > 0) & (share <= 1) & (off < 0.2 * np.linalg.norm(step))))


def _closed(points: list[Corrected]) -> bool:
    """Whether the last step passed the first point in the same direction."""
    first, before, last = points[0], points[-2], points[-1]
    same = np.dot(last.u - before.u, first.tangent) > 0
    return len(points) >= 8 and bool(same) and passes(before.u, last.u, first.u[None])


def classified(
    last: Corrected, got: Corrected, ahead: np.ndarray, normal: np.ndarray, length: np.ndarray, apart: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Steps classified by the points that they begin and end with.

    What a prediction over `length` from two points `apart` leaves out, a s^2 (s + apart)^2, is nearly as far in the
    tangent as in the point: a point that is elsewhere than its tangent says is not of this curve. The determinant of
    the equations with the tangent keeps its sign along a curve, at folds too, but where another curve is crossed.

    **Arguments:** last points and new ones; predictions and their unit tangents; lengths of the steps and of those
    before, infinite where there was none.

    **Returns:** distance of each point from its prediction; angle between the tangents, over the largest allowed;
    whether the point is on the curve, or on one that crosses it; and whether the determinant has the same sign.
    """
    turned = np.arccos(np.clip(np.sum(got.tangent * last.tangent, axis=1), -1.0, 1.0)) / np.arccos(TURN)
    way, slope = got.u - ahead, got.tangent - normal
    missed = np.linalg.norm(way, axis=1)
    largest = lambda m: np.max(np.abs(m), axis=(1, 2))
    smooth = largest(got.jacobian - last.jacobian) < SWING * (1 + largest(last.jacobian))
    across = slope - np.sum(slope * normal, axis=1, keepdims=True) * normal
    share = 1 / (2 / length + 2 / (length + apart))
    off = np.linalg.norm(way - share[:, None] * across, axis=1)
    belongs = off < np.maximum(np.minimum(ASTRAY, OF_LENGTH * length), OF_MISSED * missed)
    sure = got.converged & (turned < 1) & (missed < BEND * length) & smooth & belongs

    def orientation(points: Corrected) -> np.ndarray:
        whole = np.concatenate([points.jacobian, points.tangent[:, None]], axis=1)
        known = np.all(np.isfinite(whole), axis=(1, 2), keepdims=True)
        return np.linalg.slogdet(np.where(known, whole, 0.0))[0]

    return missed, turned, sure, orientation(got) == orientation(last)


def predicted(last: Corrected, before: Corrected | None, length: float) -> tuple[np.ndarray, np.ndarray]:
    """The curve so far beyond its last point, and its unit tangent there: by the cubic through the last two."""
    tangent = last.tangent
    if before is None:
        return last.u + length * tangent, tangent
    chord = last.u - before.u
    apart = np.linalg.norm(chord)
    off, bent = (apart * tangent - chord) / apart, tangent - before.tangent
    share = length / apart
    square, cube = share * (3 * off - bent), share**2 * (2 * off - bent)
    slope = tangent + 2 * square + 3 * cube
    return last.u + length * (tangent + square + cube), slope / np.linalg.norm(slope)


def follow(
    curves: Curves,
    start: Corrected,
    *,
    steps: Steps,
    inside: Callable[[np.ndarray], np.ndarray],
    stop: Callable[[int, list[Corrected]], bool] = lambda lane, points: False,
    update: Callable[[AbstractEquations, Corrected, np.ndarray], AbstractEquations] | None = None,
) -> list[Trace]:
    """Follow many curves from their first points, each in the direction of its tangent.

    A step to another curve is refused (see `classified`). Where the error of a point is too large the revolutions get
    twice as many steps, the last point is solved for again by these, and the step along the curve is repeated; where it
    is small they get half as many.

    **Arguments:** curves; first points, the lanes first; lengths of steps; whether unknowns, the lanes first, are
    within the range, a curve ending with its first point outside; whether a lane is to stop, by its points; new
    equations from the last points of some lanes, e.g. with fresh borders.
    """
    lanes = start.u.shape[0]
    points = [[take(start, np.array(i))] for i in range(lanes)]
    length, count = np.full(lanes, steps.first), np.array(start.steps)
    least, most = int(curves.counts.first), int(curves.counts.last)
    ended = np.where(start.converged, "", "stuck").astype(object)
    crosses = np.zeros(lanes, dtype=bool)

    def go_over(lanes: np.ndarray) -> None:
        """Solve for the last points again, by the steps that hold now."""
        last = [points[i][-1] for i in lanes]
        u, tangent = (np.stack([getattr(p, name) for p in last]) for name in ("u", "tangent"))
        again = correct(curves.take(lanes), u, tangent, count[lanes])
        for k, i in enumerate(lanes):
            if again.converged[k]:
                points[i][-1] = measured_as(take(again, np.array(k)), points[i][-1])

    while np.any(active := ended == ""):
        index = np.flatnonzero(active)
        some = [points[i] for i in index]
        last: Corrected = jax.tree.map(lambda *x: np.stack(x), *(p[-1] for p in some))
        ways = [predicted(p[-1], p[-2] if len(p) > 1 else None, length[i]) for p, i in zip(some, index, strict=True)]
        apart = np.array([np.linalg.norm(p[-1].u - p[-2].u) if len(p) > 1 else np.inf for p in some])
        ahead, normal = (np.stack(x) for x in zip(*ways, strict=True))
        closely = np.clip(OF_A_STEP * length[index], 2 * TOLERANCE, FOLLOWING)
        got = correct(curves.take(index), ahead, normal, count[index], closely, measured=True)
        unknown = curves.chooses & got.converged & (count[index] >= most) & ~(got.error <= SETTLED)
        if np.any(unknown):  # by the steps, or by what Newton's method left
            far = np.flatnonzero(unknown)
            closer = correct(curves.take(index[far]), got.u[far], normal[far], count[index[far]], measured=True)
            got = put(got, far, closer)
        missed, turned, sure, same = classified(last, got, ahead, normal, length[index], apart)
        same |= update is not None  # new equations have an orientation of their own
        good = sure & (same | crosses[index])
        finer, coarser = np.zeros((2, lanes), dtype=bool)
        for k, i in enumerate(index):
            may = curves.chooses and count[i] < most
            excess = max(got.over[k] / LOOSE, got.moved[k] / (MOVED * length[i]))
            if may and got.converged[k] and excess > 1:
                finer[i] = True
                continue
            if unknown[k] and not got.error[k] <= SETTLED:
                ended[i] = "inaccurate"
                continue
            if sure[k] and not good[k] and length[i] < CROSSED:
                while len(points[i]) > 1 and np.linalg.norm(points[i][-1].u - got.u[k]) < ASIDE:
                    points[i].pop()
                crosses[i], length[i] = True, 2 * ASIDE
                continue
            if not good[k]:
                length[i] /= 2 if got.converged[k] else 4
                if length[i] < steps.shortest:
                    finer[i], length[i] = may, steps.first
                    ended[i] = "" if may else "stuck"
                continue
            points[i].append(take(got, np.array(k)))
            crosses[i] &= bool(same[k])
            coarser[i] = curves.chooses and count[i] > least and excess < 1 / COARSER
            # What a cubic leaves out grows with the fourth power of the step.
            growth = min((AIM / max(missed[k], 1e-12)) ** 0.25, VEER / max(turned[k], 1e-12))
            length[i] = min(steps.longest, length[i] * np.clip(growth, 0.5, GROWTH))
            if not inside(got.u[k][None])[0]:
                ended[i] = "range"
            elif stop(int(i), points[i]):
                ended[i] = "stopped"
            elif _closed(points[i]):
                ended[i] = "closed"
            elif len(points[i]) > steps.most:
                ended[i] = "steps"
        accepted = good & ~finer[index]
        if update is not None and np.any(accepted):
            curves = curves._replace(equations=update(curves.equations, take(got, accepted), index[accepted]))
        count = np.where(finer, 2 * count, np.where(coarser, count // 2, count))
        if np.any(finer | coarser):
            go_over(np.flatnonzero(finer | coarser))
    return [Trace(jax.tree.map(lambda *x: np.stack(x), *p), str(e)) for p, e in zip(points, ended, strict=True)]
