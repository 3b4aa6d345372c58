"""Bifurcations along a branch: seen between neighbouring orbits, located, and changes of stability accounted for.

They are located by the Illinois variant of regula falsi: the functions that vanish there are evaluated at orbits of the
branch itself, on planes across the chord between two ends; many places are looked for at a time.
"""

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ._arclength import Corrected, Curves, correct, measured_as, put, take
from ._follower import Follower
from ._point import UNEXPLAINED
from ._singularity import test_functions, to_critical
from ._steps import BY_OTHERS, MOST_OF_A_POINT, POINT, other_steps


WIDER = (0, 1, 3)
"""How many orbits further out a bifurcation is looked for that is not between the two at which it was seen."""
BESIDE = 0.02
"""By other steps it is looked for first so near to where it was, of the length between the two, or twice as far as it
moved last."""
PART = 1e-3
"""It is refined until it moves by this part of that: what is left is by far less than its error."""
CLEAR = 1e-4
"""Orbits are counted by where multipliers are further than this from the unit circle: the others may be on either side
by rounding, or by what Newton's method left."""
HALVINGS, APART = 20, 1e-7
"""A step is halved so often, and not below this length in the unknowns' units."""
NEARLY = 0.1
"""A parabola through three points may be wrong about an extremum by this part of what the function changes over one of
the steps beside it, and about its place by this part of a step."""
SUNK = 0.75
"""Where it says that the function falls below this part of its lesser end, it is not believed about the rest."""
STEEP = 30.0
"""A map whose derivative is larger than this may have another one at the orbit than at the last step before it, which
is as far from it as 1e-6."""
LOOKED = 1e-4
"""Steps below this length, in the unknowns' units, are not halved for what a parabola says: where orbits cross, the
functions are their rounding there."""
MOST_TURNS = 40
LOCATED = 1e-9
"""As closely as places are refined, in the unknowns' units."""
BRACKETED = 1e-5
"""A branch point, at which the curve's equations are singular, is bracketed this closely, and interpolated."""


class Seen(NamedTuple):
    """A bifurcation between two orbits of a branch."""

    after: int
    """The orbit before it."""
    kind: str
    point: Corrected
    error: float
    """Distance to the place by half the steps [SI]."""


def account(follower: Follower, rows: Sequence[Corrected]) -> list[tuple[Corrected, list[Seen]]]:
    """The orbits of branches, and their bifurcations in order; between any two there is an orbit.

    Where the count of unstable multipliers changes otherwise than by what was seen, as when two real multipliers pass
    -1 within a step, the step is halved. Where it changes otherwise than by what was located, its orbits are solved for
    again and it is looked at once more. What is left is of the kind `unexplained`: the branch may not be one there.
    """
    rows = [_halved(follower, _at_the_root(follower, row)) for row in rows]
    seen = _located(follower, rows)
    left = lambda i: _gaps(follower, rows[i], [(s.after, s.kind) for s in seen[i]])
    doubtful = [i for i in range(len(rows)) if left(i)]
    again = [_halved(follower, _again(follower, rows[i], left(i))) for i in doubtful]
    for i, row, mine in zip(doubtful, again, _located(follower, again), strict=True):
        rows[i], seen[i] = row, mine
    found = []
    for i in range(len(rows)):
        rows[i], seen[i] = row, mine = _parted(follower, rows[i], seen[i])
        for a, b in left(i):
            k = a + int(np.argmax(np.diff(follower.unstable(row)[a : b + 1]) != 0))
            far = float(np.max(np.abs(np.diff(row.u[a : b + 1, -1])))) * follower.unit
            middle = take(row, np.array(k))._replace(u=(row.u[k] + row.u[k + 1]) / 2)
            mine.append(Seen(k, UNEXPLAINED, middle, far))
        found.append((row, _in_order(row, mine)))
    return found


def _at_the_root(follower: Follower, row: Corrected) -> Corrected:
    """The orbits with derivatives at them, where those of the last step before them are not the same."""
    steep = np.flatnonzero(np.max(np.abs(row.jacobian), axis=(1, 2)) > STEEP)
    if not steep.size:
        return row
    got = correct(follower.curves(steep.size), row.u[steep], row.tangent[steep], row.steps[steep])
    good = got.converged
    return put(row, steep[good], measured_as(take(got, good), take(row, steep[good])))


def _in_order(row: Corrected, seen: Sequence[Seen]) -> list[Seen]:
    """Bifurcations as they come along a branch."""
    along = lambda s: float(np.dot(s.point.u - row.u[s.after], row.u[s.after + 1] - row.u[s.after]))
    return sorted(seen, key=lambda s: (s.after, along(s)))


def _parted(follower: Follower, row: Corrected, seen: Sequence[Seen]) -> tuple[Corrected, list[Seen]]:
    """The orbits with one more between bifurcations that are in the same step, and the bifurcations after theirs."""
    seen = _in_order(row, seen)
    far = lambda a, b: bool(np.linalg.norm(b.point.u - a.point.u) > APART)
    pairs = np.flatnonzero([a.after == b.after and far(a, b) for a, b in itertools.pairwise(seen)])
    if not pairs.size:
        return row, seen
    places: Corrected = jax.tree.map(lambda *x: np.stack(x), *(s.point for s in seen))
    after = np.array([seen[k].after for k in pairs])
    row, good = _with_middles(follower, row, after, take(places, pairs), take(places, pairs + 1))
    return row, [s._replace(after=s.after + int(np.sum(pairs[good] < k))) for k, s in enumerate(seen)]


def _with_middles(
    follower: Follower, row: Corrected, after: np.ndarray, one: Corrected, other: Corrected
) -> tuple[Corrected, np.ndarray]:
    """The orbits with further ones `after` these, halfway from one to another; and which of them were found."""
    chord = other.u - one.u
    length = np.linalg.norm(chord, axis=1)
    middle, normal = one.u + chord / 2, chord / length[:, None]
    got = correct(follower.curves(len(after)), middle, normal, np.maximum(one.steps, other.steps))
    good = got.converged & (np.linalg.norm(got.u - middle, axis=1) < length / 2)
    new = measured_as(take(got, good), take(row, after[good]))
    return jax.tree.map(lambda x, y: np.insert(x, after[good] + 1, y, axis=0), row, new), good


def _gaps(follower: Follower, row: Corrected, seen: Sequence[tuple[int, str]]) -> list[tuple[int, int]]:
    """Pairs of orbits between which the count of unstable multipliers changes by what was seen does not explain."""
    count = follower.unstable(row)
    clear = np.flatnonzero(follower.unstable(row, 1 + CLEAR) == follower.unstable(row, 1 - CLEAR))
    found = []
    for a, b in zip(clear[:-1].tolist(), clear[1:].tolist(), strict=True):
        crossing = sum(2 if kind == "Neimark-Sacker" else 1 for k, kind in seen if a <= k < b)
        change = abs(int(count[b] - count[a]))
        if change > crossing or (crossing - change) % 2:
            found.append((a, b))
    return found


def _likely(follower: Follower, row: Corrected) -> list[tuple[int, str]]:
    """What was seen, without products of two multipliers that pass 1 while no complex pair leaves the circle."""
    mu = follower.multipliers(row)
    pairs = np.sum((np.abs(mu) >= 1) & (np.abs(np.imag(mu)) > 1e-9), axis=-1)
    return [(k, kind) for k, kind in brackets(follower, row) if kind != "Neimark-Sacker" or pairs[k] != pairs[k + 1]]


def _dips(follower: Follower, row: Corrected) -> list[tuple[int, int]]:
    """Steps over which a test function may vanish twice: two special points of a kind, whose effects on the count may
    cancel."""
    tests = test_functions(follower.multipliers(row))
    length = np.linalg.norm(np.diff(row.u, axis=0), axis=1)
    found = dips(np.stack([*tests.values(), row.tangent[:, -1]]), length)
    return [(a, b) for a, b in found if length[a] > LOOKED]


def dips(f: Float[np.ndarray, "functions points"], length: Float[np.ndarray, " steps"]) -> list[tuple[int, int]]:
    """Steps over which one of some functions along a curve has one sign at both ends and, by a parabola through three
    points, the other in between, or nearly.
    """
    back, ahead = length[:-1], length[1:]
    chord = np.diff(f) / length
    bend = np.diff(chord) / (back + ahead)
    slope = chord[:, 1:] - bend * ahead
    with np.errstate(divide="ignore", invalid="ignore"):
        place, extreme = -slope / (2 * bend), f[:, 1:-1] - slope**2 / (4 * bend)
    change = np.abs(np.diff(f))
    nearly = NEARLY * np.maximum(change[:, :-1], change[:, 1:])
    found = set()
    before, after = (-back < place) & (place < NEARLY * ahead), (-NEARLY * back < place) & (place < ahead)
    for first, inside in enumerate([before, after]):
        one, other = f[:, first : first + back.size], f[:, first + 1 : first + 1 + back.size]
        near = np.maximum(nearly, SUNK * np.minimum(np.abs(one), np.abs(other)))
        twice = inside & (one * other > 0) & (extreme * np.sign(one) < near)
        found |= {(int(k) + first, int(k) + first + 1) for k in np.flatnonzero(np.any(twice, axis=0))}
    return sorted(found)


def _halved(follower: Follower, row: Corrected) -> Corrected:
    """The orbits with further ones in steps over which their stability changes unseen, or may do so twice."""
    for _ in range(HALVINGS):
        gaps = sorted({*_gaps(follower, row, _likely(follower, row)), *_dips(follower, row)})
        if not gaps:
            break
        length = np.linalg.norm(np.diff(row.u, axis=0), axis=1)
        longest = sorted({a + int(np.argmax(length[a:b])) for a, b in gaps})
        after = np.array([k for k in longest if length[k] > APART], dtype=int)
        if not after.size:
            break
        row, good = _with_middles(follower, row, after, take(row, after), take(row, after + 1))
        if not np.any(good):
            break
    return row


def _again(follower: Follower, row: Corrected, gaps: Sequence[tuple[int, int]]) -> Corrected:
    """The orbits with those around the gaps solved for once more, each gap by steps of one length and twice as many."""
    for a, b in gaps:
        near = np.arange(max(a - 1, 0), min(b + 2, len(row.u)))
        steps = np.full(near.size, min(2 * int(row.steps[near].max()), int(follower.counts.last)))
        got = correct(follower.curves(near.size), row.u[near], row.tangent[near], steps)
        got = measured_as(got, take(row, near))
        good = np.flatnonzero(got.converged)
        row = put(row, near[good], take(got, good))
    return row


def _located(follower: Follower, rows: Sequence[Corrected]) -> list[list[Seen]]:
    """What was seen on each branch, as far as it is there."""
    wanted = [(i, k, kind) for i, row in enumerate(rows) for k, kind in brackets(follower, row)]
    places = locate(follower, [(rows[i], k, kind) for i, k, kind in wanted])
    seen: list[list[Seen]] = [[] for _ in rows]
    for (i, k, kind), place in zip(wanted, places, strict=True):
        near = 1e-4 if kind == "Neimark-Sacker" else 1e-3  # a double multiplier is known to the root of rounding
        if place is not None and to_critical(kind, jnp.asarray(follower.multipliers(place[0]))) < near:
            seen[i].append(Seen(k, kind, *place))
    return seen


def signals(follower: Follower, points: Corrected) -> dict[str, np.ndarray]:
    """Functions along a branch that change sign at its special points."""
    tests = test_functions(follower.multipliers(points))
    tests["branch-point"] = tests["fold"] * np.sign(points.tangent[..., -1])
    tests["fold"] = points.tangent[..., -1]
    return tests


def brackets(follower: Follower, points: Corrected) -> list[tuple[int, str]]:
    """Index and kind of each change of sign."""
    values = signals(follower, points)
    return sorted((int(k), kind) for kind, f in values.items() for k in np.flatnonzero(f[:-1] * f[1:] < 0))


def locate(follower: Follower, wanted: Sequence[tuple[Corrected, int, str]]) -> list[tuple[Corrected, float] | None]:
    """Where the test functions of (points, index, kind) vanish, and the distance [SI] to the place by half the steps;
    None where that could not be found. A branch point, where the curve's equations are singular, may be found by some
    steps and not by others: its error is from those that find it."""
    if not wanted:
        return []
    curves = follower.curves(len(wanted))
    kinds = [kind for *_, kind in wanted]
    chooses, most = curves.chooses, MOST_OF_A_POINT if curves.chooses else int(curves.counts.last)
    steps = np.full(len(wanted), int(curves.counts.first))
    if chooses:
        steps = np.array([points.steps[k : k + 2].max() for points, k, _ in wanted])

    def between(i: int, beyond: int | None) -> Corrected | None:
        """Points on both sides of it: of the branch, so many orbits further out, or close to where it was found."""
        points, k, _ = wanted[i]
        if beyond is not None:
            return take(points, np.array([max(k - beyond, 0), min(k + 1 + beyond, len(points.u) - 1)]))
        if (place := found[i]) is None:
            return None
        both: Corrected = jax.tree.map(lambda x: np.stack([x, x]), place)
        return both._replace(u=place.u + np.outer([-2 * moved[i], 2 * moved[i]], place.tangent))

    def at(lanes: list[int]) -> list[Corrected | None]:
        """Where those of these lanes vanish: close to where they did by fewer steps, between the two orbits or, by
        other steps than theirs, further out."""
        placed: dict[int, Corrected | None] = dict.fromkeys(lanes)
        for beyond in (None, *WIDER):
            ends = {i: e for i in lanes if placed[i] is None and (e := between(i, beyond)) is not None}
            if some := list(ends):
                closely, mine = within[some] if beyond is None else LOCATED, [kinds[i] for i in some]
                there = _zeros(follower, curves.take(some), list(ends.values()), mine, steps[some], closely)
                placed.update(zip(some, there, strict=True))
        return list(placed.values())

    moved = np.array([BESIDE / 2 * np.linalg.norm(points.u[k + 1] - points.u[k]) for points, k, _ in wanted])
    within = np.full(len(wanted), LOCATED)
    found: list[Corrected | None] = [None] * len(wanted)
    found = at(list(range(len(wanted))))
    error = np.full(len(wanted), np.inf if most > 1 else np.nan)
    size = lambda p: max(abs(p.u[-1]), 1.0)
    while True:
        sure = [p is not None and e <= POINT * size(p) * chooses for p, e in zip(found, error, strict=True)]
        again = np.flatnonzero(~np.array(sure) & (steps < most)).tolist()
        if not again:
            break
        steps[again] = np.minimum(2 * steps[again], most)
        for i, p in zip(again, at(again), strict=True):
            before, found[i] = found[i], p if p is not None else found[i]
            if p is not None or kinds[i] != "branch-point":
                error[i] = np.inf if p is None or before is None else abs(p.u[-1] - before.u[-1])
            if p is not None and before is not None:
                moved[i] = max(float(np.linalg.norm(p.u - before.u)), LOCATED)
                within[i] = max(PART * moved[i], LOCATED)
    there = [i for i, p in enumerate(found) if chooses and p is not None]
    steps[there] = [other_steps(steps[i]) for i in there]
    for i, p in zip(there, at(there), strict=True):
        before, crossing = found[i], kinds[i] == "branch-point"
        assert before is not None
        if p is not None:
            error[i] = max(error[i], BY_OTHERS * abs(p.u[-1] - before.u[-1]), LOCATED * crossing)
        elif not crossing:
            error[i] = np.inf
    return [None if p is None else (p, float(e * follower.unit)) for p, e in zip(found, error, strict=True)]


def _zeros(
    follower: Follower, curves: Curves, ends: Sequence[Corrected], kinds: Sequence[str], steps: np.ndarray, within: Any
) -> list[Corrected | None]:
    """Where the test functions vanish between two orbits each, these solved for again by so many steps: refined until
    it moves by less than `within`; None where the function does not change sign, or the curve was lost."""
    both = jax.tree.map(lambda *x: np.concatenate(x), *ends)
    lane = np.repeat(np.arange(len(ends)), 2)
    other = np.flatnonzero(both.steps != steps[lane])
    if other.size:
        redone = correct(curves.take(lane[other]), both.u[other], both.tangent[other], steps[lane[other]])
        both = put(both, other, redone)
    ends = [take(both, np.array([2 * i, 2 * i + 1])) for i in range(len(ends))]
    signal = lambda i, points: signals(follower, points)[str(kinds[i])]
    lanes = len(ends)
    within = np.broadcast_to(within, lanes)
    values = np.array([signal(i, e) if np.all(e.converged) else [np.nan, np.nan] for i, e in enumerate(ends)])
    active = np.prod(values, axis=1) < 0
    f0, f1 = np.where(active[:, None], values, np.nan).T.copy()
    u0, u1 = np.where(active[:, None], np.stack([e.u for e in ends], axis=1), np.nan)
    chord = u1 - u0
    length = np.linalg.norm(chord, axis=1)
    normal = chord / length[:, None]
    low, high, last, aside = np.zeros(lanes), np.ones(lanes), np.zeros(lanes), np.zeros(lanes)
    sides = [[take(e, np.array(j)) for j in (0, 1)] for e in ends]
    best: list[Corrected | None] = [None] * lanes
    for _ in range(MOST_TURNS):
        index = np.flatnonzero(active)
        if index.size == 0:
            break
        margin = 1e-3 * (high - low)
        aimed = np.clip((low * f1 - high * f0) / (f1 - f0), low + margin, high - margin)
        share = np.clip(aimed + aside, low, high)
        at = np.stack([_on_plane(u0[i] + share[i] * chord[i], normal[i], sides[i]) for i in index])
        got = correct(curves.take(index), at, normal[index], steps[index])
        for k, i in enumerate(index):
            if not got.converged[k]:
                near = (high[i] - low[i]) * length[i] < 4 * BRACKETED
                best[i] = _between(sides[i], (aimed[i] - low[i]) / (high[i] - low[i])) if near else None
                active[i] = not near and aside[i] == 0.0
                aside[i] = BRACKETED / length[i]
                continue
            before, best[i] = best[i], take(got, np.array(k))
            f = float(signal(int(i), take(got, np.array([k])))[0])
            sides[i][int(f * f1[i] >= 0)] = best[i]
            if aside[i] != 0.0:
                aside[i] = -aside[i] if aside[i] > 0 else 0.0
            halve = 0.5 if f * last[i] > 0 else 1.0  # the same end was kept twice
            if f * f1[i] < 0:
                low[i], f0[i], f1[i] = share[i], f, f1[i] * halve
            else:
                high[i], f1[i], f0[i] = share[i], f, f0[i] * halve
            last[i] = f
            moved = np.inf if before is None else np.linalg.norm(got.u[k] - before.u)
            active[i] = aside[i] != 0.0 or f != 0.0 and moved > within[i] and (high[i] - low[i]) * length[i] > within[i]
    return best


def _on_plane(at: np.ndarray, normal: np.ndarray, sides: list[Corrected]) -> np.ndarray:
    """The point of a plane, through `at`, where the cubic through two points of the curve passes it, nearly."""
    first, second = sides
    chord = second.u - first.u
    across = np.dot(chord, normal)
    if not across > 0:
        return at
    share = np.dot(at - first.u, normal) / across
    length = np.linalg.norm(chord)
    out, back = length * first.tangent - chord, chord - length * second.tangent
    aside = share * (1 - share) * ((1 - share) * out + share * back)
    found = first.u + share * chord + aside
    return found + np.dot(at - found, normal) * normal


def _between(sides: list[Corrected], share: float) -> Corrected:
    """Linear interpolation of two near points."""
    mix = lambda x, y: (1 - share) * x + share * y if np.issubdtype(np.asarray(x).dtype, np.floating) else x
    return jax.tree.map(mix, *sides)
