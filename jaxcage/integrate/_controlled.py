"""As many steps as a revolution needs, and how sure its end is.

The error of a revolution is how far its end moves when it is run with half as many steps: an honest number for every
solver, stiff or not, with contacts that switch on the way or without. A solver of order p is nearer to the truth than
that by a factor of 2^p - 1 where the motion is smooth. Two runs may agree by accident, and a third one with a quarter
of the steps shows it. The leading tangent vector is compared too: an L-stable method damps away what it does not
resolve, which leaves the state of a lane right and its exponent wrong.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from .._errors import ArgumentError
from .._types import Scalar, State
from ..models import AbstractField, AbstractForcedSystem
from ._kernel import Pieces
from ._method import AbstractMethod, AdaptiveSteps, FixedSteps, Moved, Stretch, make_fixed, moved_by, run_steps
from ._results import INACCURATE, result_of


DEFAULT_ERROR = 3e-3
"""Largest error of a revolution, in units of the system's scale (for a cage: clearances)."""
DEFAULT_LADDER = (*(("rk4", 16 << i) for i in range(10)), *(("rodas4", 512 << i) for i in range(6)))
TURN = 0.5
"""Largest difference that half as many steps may make to the leading tangent vector, relative to its length, at the
default error."""
FALL = 16.0
"""What the difference of two levels is never below, however well they agree: so many times less than that of the two
before them. By fourth order it is 16; where it falls faster two levels agree by accident: both may miss a contact."""
CHANCE = 32.0
"""Two levels that agree so many times better than the two before them do so by chance: no order is assumed of them."""
SLOW = 4.0
"""Where the difference of two levels is not so many times below that of the two before them, the law jumps on the way
(the film's at its centre), and the error is that of first order: so many times the difference."""
SURE = 3.0
"""So many times the difference is stated: where contacts and the ends of the film's arc move between the steps of two
levels, the finer one may be a little further from the truth than from the coarser."""
EASY = 8
"""A lane whose error is so many times below the tolerance begins the next revolution one level lower: in vain that
costs an eighth of the steps of the level that is taken."""

Levels = FixedSteps | AdaptiveSteps
Attempt = Callable[[Levels, Int[Array, ""], Bool[Array, "*lanes"]], Moved]
"""The revolution of those lanes that are marked by the i-th level of a solver."""


class ControlledSteps(AbstractMethod):
    """The first level of a ladder at which the error of a revolution is within the tolerance.

    A level is a solver with a number of steps, about twice that of the level before, with which it is compared. A cage
    that stays off the rib for a revolution needs far fewer steps than one in contact, and neither is stiff as a rule:
    explicit levels come first, L-stable ones last. A revolution whose error is too large on the last level too is
    `inaccurate`. The price of control is that the strobe map is smooth only between the states at which the level
    changes: it is for sweeps, not for Newton's method. One program serves all tolerances and step counts.
    """

    ladder: tuple[Levels, ...]
    """One after the other: a solver with an array of step counts, or one with tolerances of its own. At least two
    levels in all."""
    tolerance: Float[Array, ""]
    """Infinite where the last level is to be taken whatever its error, which is stated all the same."""
    turn: Float[Array, ""]
    """Largest difference that the level before may make to the leading tangent vector, relative to its length."""

    def advance(
        self,
        field: AbstractField,
        system: AbstractForcedSystem,
        scale: State,
        y: State,
        phase: Scalar,
        parts: Int[Array, ""] | int,
    ) -> Stretch:
        """One part, by the first level whose error is within the part's share of the tolerance, else by the last."""
        pieces = (field, system, scale)
        attempt = lambda levels, i, _: moved_by(run_level(self, levels, i, pieces, phase, parts), y, ())
        moved = climb(self, jnp.zeros((), jnp.int32), nowhere(y, ()), scale, attempt, system.harmonics, parts)
        return Stretch(moved.y, moved.peak, result_of(moved.outcome), moved.error)

    @property
    def sizes(self) -> list[int]:
        """Levels of each solver."""
        return [r.steps.size if isinstance(r, FixedSteps) else 1 for r in self.ladder]  # pyright: ignore

    @property
    def floors(self) -> list[int]:
        """For each level, the lowest one of its own solver whose error can be measured by that solver too."""
        firsts = [0, *itertools.accumulate(self.sizes)]
        return [first + min(self.before, n - 1) for first, n in zip(firsts, self.sizes, strict=False) for _ in range(n)]

    @property
    def before(self) -> int:
        """Levels below the one that is taken, by which its error is measured: two, unless there are but two in all."""
        return min(2, sum(self.sizes) - 1)

    def lowest(self, harmonics: int) -> Int[Array, ""]:
        """The first level of two steps at least to a period of the forcing's highest harmonic: two levels with fewer
        would agree on a slower forcing that is not there."""
        coarse = [
            jnp.sum(r.steps < 2 * harmonics, dtype=jnp.int32) for r in self.ladder[:1] if isinstance(r, FixedSteps)
        ]
        return jnp.minimum(sum(coarse, jnp.zeros((), jnp.int32)), sum(self.sizes) - 1 - self.before)

    def __str__(self) -> str:
        of = lambda r: f"{type(r.solver).__name__} {', '.join(map(str, r.steps.tolist()))}"  # pyright: ignore
        levels = [of(r) if isinstance(r, FixedSteps) else str(r) for r in self.ladder]
        return f"steps per revolution for an error of {float(self.tolerance):g}: {'; '.join(levels)}"


def run_level(
    method: ControlledSteps, levels: Levels, i: Int[Array, ""], pieces: Pieces, phase: Any = 0.0, parts: Any = 1
) -> Callable[[State], Stretch]:
    """One part by the i-th of `levels`, with as many times the steps of the ladder's first level as in a revolution."""
    if isinstance(levels, AdaptiveSteps):
        return lambda y: levels.advance(*pieces, y, phase, parts)
    steps = jnp.asarray(levels.steps)[i]
    if not (isinstance(parts, int) and parts == 1):
        unit = jnp.asarray(method.ladder[0].steps)[0] if isinstance(method.ladder[0], FixedSteps) else 1
        steps = -(-(-(-unit // parts) * steps) // unit) * parts
    return lambda y: run_steps(levels.solver, steps, pieces, y, phase, parts)


def nowhere(y: Any, tangents: Any) -> Moved:
    """Lanes that have not been moved yet."""
    zero = jnp.zeros_like(y[0])
    none = jnp.zeros(zero.shape, jnp.int32)
    return Moved(y, tangents, zero, none, none, zero + jnp.inf, tangents)


def climb(
    method: ControlledSteps,
    level: Int[Array, "*lanes"],
    start: Moved,
    scale: tuple[Any, ...],
    attempt: Attempt,
    harmonics: int = 1,
    parts: Any = 1,
) -> Moved:
    """Lanes, or one without an axis, by the first level whose error is small enough, beginning two below `level`.

    One whose level is negative stays where it is.
    """
    lowest = method.lowest(harmonics)
    begin = jnp.maximum(level - method.before, lowest)
    carry = (begin, start, level < 0, start.error)
    first = 0
    for levels, size in zip(method.ladder, method.sizes, strict=True):

        def asked(carry: tuple, end: int = first + size) -> Any:
            at, _, done, _ = carry
            return jnp.any(~done & (at < end))

        def once(carry: tuple, levels: Levels = levels, first: int = first) -> tuple:
            at, before, done, gap = carry
            lowest = jnp.min(jnp.where(done, sum(method.sizes), at))
            mine = ~done & (at == lowest)
            tried = attempt(levels, lowest - first, mine)
            height = at - begin
            apart = jnp.where(height == 0, jnp.inf, _apart(tried.y, before.y, scale))
            error = apart if method.before == 1 else _error(apart, gap)
            fine = (tried.outcome == 0) & (error <= method.tolerance / parts) & (height >= method.before)
            if tried.tangents:
                fine &= _turned(tried.tangents[0], before.tangents[0], scale) <= method.turn
            tried = tried._replace(error=error, half=before.tangents, level=at)
            now = jax.tree.map(lambda a, b: jnp.where(mine, a, b), tried, before)
            gap = jnp.where(mine, apart, gap)
            return jnp.where(mine & ~fine, at + 1, at), now, done | (mine & fine), gap

        carry = jax.lax.while_loop(asked, once, carry)
        first += size
    _, moved, done, _ = carry
    bad = ~done & jnp.isfinite(method.tolerance) & ((parts == 1) | (moved.error > method.tolerance))
    floor = jnp.maximum(jnp.asarray(method.floors, jnp.int32)[moved.level], lowest + method.before)
    easy = (moved.error * EASY <= method.tolerance) & (moved.level > floor)
    return moved._replace(
        outcome=jnp.where(bad & (moved.outcome == 0), INACCURATE, moved.outcome),
        level=jnp.where(easy, moved.level - 1, moved.level),
    )


def _error(apart: Any, gap: Any) -> Any:
    """Of a level, from its difference to the one before it, and the difference of that to the one before."""
    least = gap / jnp.where(gap > CHANCE * apart, SLOW, FALL)
    return SURE * jnp.maximum(jnp.where(SLOW * apart > gap, SLOW * apart, apart), least)


def _apart(y: tuple[Any, ...], other: tuple[Any, ...], scale: tuple[Any, ...]) -> Any:
    """Largest difference of two states in units of the scale; infinite where one is undefined."""
    each = [jnp.abs(jax.lax.stop_gradient((a - b) / s)) for a, b, s in zip(y, other, scale, strict=True)]
    largest = jnp.max(jnp.stack(each), axis=0)
    return jnp.where(jnp.isnan(largest), jnp.inf, largest)


def _turned(tangent: tuple[Any, ...], other: tuple[Any, ...], scale: tuple[Any, ...]) -> Any:
    """Distance of two tangent vectors relative to the first one's length."""
    norm = lambda v: jnp.sqrt(sum((a / s) ** 2 for a, s in zip(v, scale, strict=True)))
    return norm([a - b for a, b in zip(tangent, other, strict=True)]) / norm(tangent)


def stated(method: AbstractMethod) -> ControlledSteps:
    """`method` with its error measured: a number of steps beside half as many, a tolerance beside a larger one."""
    method = method.in_jax
    if isinstance(method, ControlledSteps):
        return method
    if isinstance(method, FixedSteps):
        return _ladder([(method.solver, [-(-method.steps // 2), method.steps])], math.inf)
    assert isinstance(method, AdaptiveSteps)
    unbounded, ladder = jnp.asarray(math.inf), (_with_tolerances(method, 16.0), method)
    return ControlledSteps(ladder, unbounded, unbounded)


def _ladder(levels: Sequence[tuple[Any, Sequence[Any]]], tolerance: float) -> ControlledSteps:
    """Of solvers with their step counts."""
    fixed = tuple(FixedSteps(solver, jnp.asarray(each, jnp.int32)) for solver, each in levels)
    turn = TURN if math.isfinite(tolerance) else math.inf
    return ControlledSteps(fixed, jnp.asarray(float(tolerance)), jnp.asarray(turn))


def _with_tolerances(method: AdaptiveSteps, times: float) -> AdaptiveSteps:
    """The same with tolerances `times` as large."""
    rtol, atol = (min(times * x, 0.5) for x in (method.rtol, method.atol))
    return AdaptiveSteps(method.solver, rtol, atol, method.max_steps)


def finer(method: AbstractMethod, times: int = 1) -> ControlledSteps:
    """`method` with steps at most half as long, `times` over, for what it is to be confirmed by.

    Of a controlled method the tolerance is 16 times as small, which a solver of fourth order reaches with twice the
    steps, that of its tangent vectors 4 times, and the ladder begins and ends with twice as many.
    """
    rough = stated(method)
    steps, error = 1 << times, 16.0**-times
    each = lambda r: FixedSteps(r.solver, steps * r.steps) if isinstance(r, FixedSteps) else _with_tolerances(r, error)
    turn = math.sqrt(error) * rough.turn
    return ControlledSteps(tuple(map(each, rough.ladder)), error * rough.tolerance, turn)


def controlled(error: float = DEFAULT_ERROR, ladder: Sequence[tuple[str, int]] = DEFAULT_LADDER) -> ControlledSteps:
    """The default method: each revolution is run with more and more steps until its error is at most `error`.

    **Arguments:**

    - `error`: how far the end of a revolution may move when it is run with the steps that were tried before, in units
        of the system's own scale (for a cage: clearances).
    - `ladder`: solvers by name with their steps per revolution, in the order in which they are tried.

    **Raises:** `ValueError` for an error that is not positive, fewer than two entries, or an unknown solver.
    """
    if len(ladder) < 2 or any(int(steps) < 1 for _, steps in ladder):
        raise ArgumentError("ladder", said=f"must have two or more pairs of a solver and its steps, but is {ladder}.")
    if not error > 0:
        raise ArgumentError("error", said=f"must be positive, but {error} was given.")
    groups = itertools.groupby(ladder, key=lambda pair: pair[0])
    return _ladder([(make_fixed(name, 1).solver, [int(n) for _, n in levels]) for name, levels in groups], error)
