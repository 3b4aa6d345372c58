"""Bifurcations along a branch: detected between neighbouring orbits, located, and checked against stability changes.

The Illinois variant of regula falsi locates them: test functions are evaluated at orbits of the branch itself, on
planes across the chord between two orbits. All bifurcations are located at the same time.
"""

import dataclasses
import itertools
from collections.abc import Collection, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .continuation import ContinuationProblem, correct, solved_again
from .point import COMPLEX, DOUBLE, UNEXPLAINED, critical_of, test_functions, to_critical
from .problem import BY_OTHERS, MOST_OF_A_POINT, POINT, other_steps
from .step_length import Points


WIDER = (0, 1, 3)  # orbits by which the bracket is widened if the bifurcation is not where it was detected
BESIDE = 0.02  # half-width of the first bracket with other steps, over the distance between the two orbits
PART = 1e-3  # it is refined until it moves by this fraction of its last move
CLEAR = 1e-4  # orbits with a multiplier this close to the unit circle are not counted as stable or unstable
HALVINGS, APART = 20, 1e-7  # most halvings of a step, and the length below which it is not halved
SHORTER = 4  # halvings of a step in which nothing located explains a change
NEARLY = 0.1  # allowed error of a parabola: its extremum over the function's change, its position over a step
SUNK = 0.75  # an extremum below this fraction of the smaller end value is too low for the parabola to be trusted
LOOKED = 1e-4  # shorter steps are not halved because of a parabola: where orbits cross, test functions are rounding
STEEP = 30.0  # norm above which the derivative at Newton's last iterate may differ from that at the orbit
MOST_ITERATIONS = 40
LOCATED, BRACKETED = 1e-9, 1e-5  # accuracy of places; of branch points, where the curve's equations are singular


@dataclasses.dataclass
class Place:
    """A bifurcation in a row of orbits, between orbit `after` and the next; `point` is None if it was not found.

    It is located with `steps` per revolution to the accuracy `within`. `error` is the change when the steps are halved,
    and `moved` the expected change with other steps, both in the unknowns' units.
    """

    row: Points
    after: int
    kind: str
    point: Points | None = None
    error: float = float("inf")
    steps: int = 0
    moved: float = 0.0
    within: float = LOCATED

    def ends(self, beyond: int | None) -> Points | None:
        """Return points on both sides: orbits, `beyond` ones further out, or (None) points about the last location."""
        if beyond is not None:
            return self.row.take([max(self.after - beyond, 0), min(self.after + 1 + beyond, len(self.row.u) - 1)])
        if self.point is None:
            return None
        both = Points.stacked([self.point, self.point])
        return both._replace(u=self.point.u + np.outer([-2 * self.moved, 2 * self.moved], self.point.tangent))


def bifurcations_of(problem: ContinuationProblem, rows: Sequence[Points]) -> list[tuple[Points, list[Place]]]:
    """Return the orbits of branches, and their bifurcations in order; between any two there is an orbit.

    If the number of unstable multipliers changes in a way that the detected bifurcations do not explain, as when two
    real multipliers pass -1 within a step, the step is halved. If the located bifurcations do not explain it, they
    are located again from orbits with finer steps, and then from closer orbits. If a change is still not explained, two
    multipliers or pairs may cross together (`DOUBLE`). Otherwise it has the kind `unexplained`: the curve may not be a
    branch there.
    """
    steep = [np.flatnonzero(np.max(np.abs(row.jacobian), axis=(1, 2)) > STEEP) for row in rows]
    at_root = [solved_again(problem, row, k, row.steps[k]) for row, k in zip(rows, steep, strict=True)]
    rows = [_halved(problem, row) for row in at_root]
    places = _located(problem, rows)
    gaps = lambda i: _gaps(problem, rows[i], [(p.after, p.kind) for p in places[i]])
    for closer in (_with_finer_steps, *[_with_shorter_steps] * SHORTER):
        doubtful = [i for i in range(len(rows)) if gaps(i)]
        again = [_halved(problem, closer(problem, rows[i], gaps(i))) for i in doubtful]
        for i, row, mine in zip(doubtful, again, _located(problem, again), strict=True):
            rows[i], places[i] = row, mine
    found = []
    for i in range(len(rows)):
        rows[i], places[i] = row, mine = _parted(problem, rows[i], places[i])
        for k, *_ in _changes(problem, row, gaps(i)):
            double = [Place(row, k, kind) for kind in DOUBLE if _is_there(problem, Place(row, k, kind, row.take(k)))]
            _locate(problem, double)
            mine += [p for p in double if _is_there(problem, p)][:1]
        for k, a, b in _changes(problem, row, gaps(i)):
            far = float(np.max(np.abs(np.diff(row.u[a : b + 1, -1]))))
            middle = row.take(k)._replace(u=(row.u[k] + row.u[k + 1]) / 2)
            mine.append(Place(row, k, UNEXPLAINED, middle, far))
        found.append((row, _in_order(row, mine)))
    return found


def _changes(problem: ContinuationProblem, row: Points, gaps: Sequence[tuple[int, int]]) -> list[tuple[int, int, int]]:
    """Return the orbit before the first change in the number of unstable multipliers in each gap, and the gap."""
    change = np.diff(problem.unstable(row)) != 0
    return [(a + int(np.argmax(change[a:b])), a, b) for a, b in gaps]


# --- orbits of a branch --------------------------------------------------------------------------------------------


def _with_finer_steps(problem: ContinuationProblem, row: Points, gaps: Sequence[tuple[int, int]]) -> Points:
    """Return the orbits with those around each gap solved for again, with twice the largest number of steps there."""
    for a, b in gaps:
        near = np.arange(max(a - 1, 0), min(b + 2, len(row.u)))
        steps = np.full(near.size, min(2 * int(row.steps[near].max()), int(problem.counts.last)))
        row = solved_again(problem, row, near, steps)
    return row


def _with_middles(
    problem: ContinuationProblem, row: Points, after: np.ndarray, one: Points, other: Points
) -> tuple[Points, np.ndarray]:
    """Insert orbits `after` these, halfway from `one` to `other`; also return which were found."""
    chord = other.u - one.u
    length = np.linalg.norm(chord, axis=1)
    middle, normal = one.u + chord / 2, chord / length[:, None]
    got = correct(problem, middle, normal, np.maximum(one.steps, other.steps))
    good = got.converged & (np.linalg.norm(got.u - middle, axis=1) < length / 2)
    new = got.take(good).with_errors_of(row.take(after[good]))
    return jax.tree.map(lambda x, y: np.insert(x, after[good] + 1, y, axis=0), row, new), good


def _halved(problem: ContinuationProblem, row: Points) -> Points:
    """Halve steps over which the stability changes without a detected bifurcation, or may change twice."""
    for _ in range(HALVINGS):
        gaps = {*_gaps(problem, row, _likely(problem, row)), *_dips(problem, row)}
        before, row = len(row.u), _with_shorter_steps(problem, row, gaps)
        if len(row.u) == before:
            break
    return row


def _with_shorter_steps(problem: ContinuationProblem, row: Points, gaps: Collection[tuple[int, int]]) -> Points:
    """Return the orbits with one more in the longest step of each gap, where one is found."""
    length = np.linalg.norm(np.diff(row.u, axis=0), axis=1)
    longest = sorted({a + int(np.argmax(length[a:b])) for a, b in gaps})
    after = np.array([k for k in longest if length[k] > APART], dtype=int)
    return _with_middles(problem, row, after, row.take(after), row.take(after + 1))[0] if after.size else row


def _in_order(row: Points, places: Sequence[Place]) -> list[Place]:
    along = lambda p: float(np.dot(p.point.u - row.u[p.after], row.u[p.after + 1] - row.u[p.after]))
    return sorted(places, key=lambda p: (p.after, along(p)))


def _parted(problem: ContinuationProblem, row: Points, places: Sequence[Place]) -> tuple[Points, list[Place]]:
    """Insert an orbit between bifurcations of the same step; also return the bifurcations in order."""
    places = _in_order(row, places)
    far = lambda a, b: bool(np.linalg.norm(b.point.u - a.point.u) > APART)
    pairs = np.flatnonzero([a.after == b.after and far(a, b) for a, b in itertools.pairwise(places)])
    if not pairs.size:
        return row, places
    points = Points.stacked([p.point for p in places if p.point is not None])
    after = np.array([places[k].after for k in pairs])
    row, good = _with_middles(problem, row, after, points.take(pairs), points.take(pairs + 1))
    shifted = [p.after + int(np.sum(pairs[good] < k)) for k, p in enumerate(places)]
    return row, [dataclasses.replace(p, after=k) for p, k in zip(places, shifted, strict=True)]


# --- changes of stability ------------------------------------------------------------------------------------------


def _signals(problem: ContinuationProblem, points: Points) -> dict[str, np.ndarray]:
    """Return functions along a branch that change sign at its bifurcations, by kind."""
    tests = test_functions(problem.multipliers(points))
    tests["branch-point"] = tests["fold"] * np.sign(points.tangent[..., -1])
    tests["fold"] = points.tangent[..., -1]
    return tests


def _signal(problem: ContinuationProblem, points: Points, kind: str) -> Any:
    """Return the function that changes sign at a bifurcation of one kind; for those that cross together, the sum of the
    logarithms of the multipliers nearest the unit circle."""
    if kind not in DOUBLE:
        return _signals(problem, points)[kind]
    growth = np.log(np.abs(problem.multipliers(points)))
    nearest = np.argsort(np.abs(growth), axis=-1)[..., : DOUBLE[kind]]
    return np.sum(np.take_along_axis(growth, nearest, axis=-1), axis=-1)


def sign_changes(problem: ContinuationProblem, row: Points) -> list[tuple[int, str]]:
    """Return the preceding orbit and the kind for each change of sign of a test function."""
    values = _signals(problem, row)
    return sorted((int(k), kind) for kind, f in values.items() for k in np.flatnonzero(f[:-1] * f[1:] < 0))


def _gaps(problem: ContinuationProblem, row: Points, seen: Sequence[tuple[int, str]]) -> list[tuple[int, int]]:
    """Return pairs of orbits between which `seen` does not explain the change in the number of unstable multipliers."""
    count = problem.unstable(row)
    clear = np.flatnonzero(problem.unstable(row, 1 + CLEAR) == problem.unstable(row, 1 - CLEAR))
    found = []
    for a, b in itertools.pairwise(clear.tolist()):
        crossing = sum(DOUBLE.get(kind, 2 if kind == "Neimark-Sacker" else 1) for k, kind in seen if a <= k < b)
        change = abs(int(count[b] - count[a]))
        if change > crossing or (crossing - change) % 2:
            found.append((a, b))
    return found


def _likely(problem: ContinuationProblem, row: Points) -> list[tuple[int, str]]:
    """Return the changes of sign, except where a product of two multipliers passes 1 but no complex pair leaves."""
    mu = problem.multipliers(row)
    pairs = np.sum((np.abs(mu) >= 1) & (np.abs(np.imag(mu)) > COMPLEX), axis=-1)
    return [(k, kind) for k, kind in sign_changes(problem, row) if kind != "Neimark-Sacker" or pairs[k] != pairs[k + 1]]


def _dips(problem: ContinuationProblem, row: Points) -> list[tuple[int, int]]:
    """Return steps over which a test function may vanish twice, which the number of unstable multipliers may hide."""
    tests = test_functions(problem.multipliers(row))
    length = np.linalg.norm(np.diff(row.u, axis=0), axis=1)
    found = _sinking(np.stack([*tests.values(), row.tangent[:, -1]]), length)
    return [(a, b) for a, b in found if length[a] > LOOKED]


def _sinking(f: Float[np.ndarray, "functions points"], length: Float[np.ndarray, " steps"]) -> list[tuple[int, int]]:
    """Return steps in which a parabola through three points suggests that a function may change its sign twice."""
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


# --- location ------------------------------------------------------------------------------------------------------


def _located(problem: ContinuationProblem, rows: Sequence[Points]) -> list[list[Place]]:
    """Return the bifurcations on each branch that were detected and located."""
    places = [[Place(row, k, kind) for k, kind in sign_changes(problem, row)] for row in rows]
    _locate(problem, [p for mine in places for p in mine])
    return [[p for p in mine if _is_there(problem, p)] for mine in places]


def _is_there(problem: ContinuationProblem, p: Place) -> bool:
    """Return True if the multipliers at a place are critical for its kind."""
    if p.point is None:
        return False
    near = 1e-4 if p.kind == "Neimark-Sacker" else 1e-3  # a double multiplier is accurate to sqrt(rounding)
    off = np.asarray(to_critical(critical_of(p.kind), jnp.asarray(problem.multipliers(p.point))))
    count = DOUBLE.get(p.kind, 1)
    return off.size >= count and bool(off[count - 1] < near)


def _locate(problem: ContinuationProblem, places: Sequence[Place]) -> None:
    """Set point, steps and error of each place, doubling the steps until it moves by less than the tolerance; the error
    of a branch point, where the curve's equations are singular, is computed from the steps that find it."""
    counts, chooses = problem.counts, problem.counts.chooses
    most = MOST_OF_A_POINT if chooses else int(counts.last)
    for p in places:
        p.steps = int(p.row.steps[p.after : p.after + 2].max()) if chooses else int(counts.first)
        p.moved = BESIDE / 2 * float(np.linalg.norm(p.row.u[p.after + 1] - p.row.u[p.after]))
    settled = lambda p: p.point is not None and p.error <= POINT * max(abs(p.point.u[-1]), 1.0) * chooses
    waiting = list(places)
    while waiting:
        for p, point in zip(waiting, _found_at(problem, waiting), strict=True):
            before = p.point
            if point is not None:
                p.point = point
            if point is not None and before is not None:
                p.error = abs(point.u[-1] - before.u[-1])
                p.moved = max(float(np.linalg.norm(point.u - before.u)), LOCATED)
                p.within = max(PART * p.moved, LOCATED)
            elif point is not None or p.kind != "branch-point":
                p.error = float("inf") if most > 1 else float("nan")
        waiting = [p for p in waiting if not settled(p) and p.steps < most]
        for p in waiting:
            p.steps = min(2 * p.steps, most)
    there = [p for p in places if chooses and p.point is not None]
    for p in there:
        p.steps = other_steps(p.steps)
    for p, point in zip(there, _found_at(problem, there), strict=True):
        if point is not None and p.point is not None:
            least = LOCATED if p.kind == "branch-point" else 0.0
            p.error = max(p.error, BY_OTHERS * abs(point.u[-1] - p.point.u[-1]), least)
        elif p.kind != "branch-point":
            p.error = float("inf")


def _found_at(problem: ContinuationProblem, places: Sequence[Place]) -> list[Points | None]:
    """Locate places with their present steps, in brackets about their last location and then wider ones."""
    found: dict[int, Points | None] = dict.fromkeys(range(len(places)))
    for beyond in (None, *WIDER):
        ends = {i: e for i, p in enumerate(places) if found[i] is None and (e := p.ends(beyond)) is not None}
        if ends:
            wanted = [(places[i], places[i].within if beyond is None else LOCATED, e) for i, e in ends.items()]
            found.update(zip(ends, _zeros(problem, wanted), strict=True))
    return list(found.values())


def _zeros(problem: ContinuationProblem, wanted: Sequence[tuple[Place, float, Points]]) -> list[Points | None]:
    """Return zeros of test functions, each between two orbits, which are solved for again with the place's steps.

    **Arguments:** place, accuracy, and orbits on both sides.

    **Returns:** None where the function does not change sign, or the curve was lost.
    """
    both = jax.tree.map(lambda *x: np.concatenate(x), *(e for *_, e in wanted))
    steps = np.repeat([place.steps for place, *_ in wanted], 2)
    other = np.flatnonzero(both.steps != steps)
    if other.size:
        both = both.put(other, correct(problem, both.u[other], both.tangent[other], steps[other]))
    falsi = [
        _RegulaFalsi(problem, place.kind, within, both.take([2 * i, 2 * i + 1]))
        for i, (place, within, _) in enumerate(wanted)
    ]
    for _ in range(MOST_ITERATIONS):
        active = [(i, f) for i, f in enumerate(falsi) if f.active]
        if not active:
            break
        at = np.stack([f.aim() for _, f in active])
        got = correct(problem, at, np.stack([f.normal for _, f in active]), steps[[2 * i for i, _ in active]])
        for k, (_, f) in enumerate(active):
            f.update(got.take(k))
    return [f.best for f in falsi]


class _RegulaFalsi:
    """Regula falsi (Illinois variant) for one test function between two points of a branch."""

    def __init__(self, problem: ContinuationProblem, kind: str, within: float, ends: Points):
        self.signal = lambda points: _signal(problem, points, kind)
        self.within, self.sides = within, [ends.take(0), ends.take(1)]
        self.chord = ends.u[1] - ends.u[0]
        self.begin, self.length = ends.u[0], float(np.linalg.norm(self.chord))
        self.values = [float(x) for x in self.signal(ends)] if np.all(ends.converged) else [np.nan, np.nan]
        self.shares, self.aimed, self.share, self.last, self.aside = [0.0, 1.0], 0.0, 0.0, 0.0, 0.0
        self.best: Points | None = None
        self.active = self.values[0] * self.values[1] < 0
        self.normal = self.chord / self.length if self.active else self.chord

    def aim(self) -> np.ndarray:
        """Return the next point of evaluation: the cubic through the two sides, where it passes the plane."""
        (low, high), (f0, f1) = self.shares, self.values
        margin = 1e-3 * (high - low)
        self.aimed = min(max((low * f1 - high * f0) / (f1 - f0), low + margin), high - margin)
        self.share = min(max(self.aimed + self.aside, low), high)
        at, normal, (first, second) = self.begin + self.share * self.chord, self.normal, self.sides
        chord = second.u - first.u
        across = np.dot(chord, normal)
        if not across > 0:
            return at
        share, length = np.dot(at - first.u, normal) / across, np.linalg.norm(chord)
        out, back = length * first.tangent - chord, chord - length * second.tangent
        found = first.u + share * chord + share * (1 - share) * ((1 - share) * out + share * back)
        return found + np.dot(at - found, normal) * normal

    def update(self, got: Points) -> None:
        """Replace one end of the bracket by a new point."""
        low, high = self.shares
        if not got.converged:  # near a branch point: try on both sides, and interpolate at last
            near = (high - low) * self.length < 4 * BRACKETED
            self.best = _mixed(self.sides, (self.aimed - low) / (high - low)) if near else None
            self.active = not near and self.aside == 0.0
            self.aside = BRACKETED / self.length
            return
        before, self.best = self.best, got
        f = float(self.signal(got))
        end = int(f * self.values[1] >= 0)
        if self.aside != 0.0:
            self.aside = -self.aside if self.aside > 0 else 0.0
        if f * self.last > 0:  # one end was kept twice
            self.values[1 - end] /= 2
        self.sides[end], self.shares[end], self.values[end], self.last = got, self.share, f, f
        moved = np.inf if before is None else np.linalg.norm(got.u - before.u)
        wide = (self.shares[1] - self.shares[0]) * self.length > self.within
        self.active = self.aside != 0.0 or (f != 0.0 and bool(moved > self.within) and wide)


def _mixed(sides: list[Points], share: float) -> Points:
    """Interpolate linearly between two points."""
    mix = lambda x, y: (1 - share) * x + share * y if np.issubdtype(np.asarray(x).dtype, np.floating) else x
    return jax.tree.map(mix, *sides)
