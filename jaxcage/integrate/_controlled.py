"""As many equal steps as a revolution needs, and how sure its end is.

The error of a revolution is how far its end moves when it is run with half as many steps: an honest number for every
solver, stiff or not, with contacts that switch on the way or without. A solver of order p is nearer to the truth than
that by a factor of 2^p - 1 where the motion is smooth. The leading tangent vector is compared too: an L-stable method
damps away what it does not resolve, which leaves the state of a lane right and its exponent wrong.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int

from .._types import Scalar, State
from ..models import AbstractField, AbstractForcedSystem
from ._method import AbstractMethod, AdaptiveSteps, FixedSteps, Stretch, make_fixed, run_steps
from ._moved import Moved, moved_by
from ._results import INACCURATE, result_of


DEFAULT_ERROR = 1e-3
"""Largest error of a revolution, in units of the system's scale (for a cage: clearances)."""
DEFAULT_LADDER = (*(("rk4", 64 << i) for i in range(8)), *(("rodas4", 512 << i) for i in range(6)))
TURN = 0.5
"""Largest difference that half as many steps may make to the leading tangent vector, relative to its length."""
EASY = 512
"""A lane whose error is so many times below the tolerance begins the next revolution one rung lower."""

Rung = FixedSteps | AdaptiveSteps
Attempt = Callable[[tuple[Rung, ...], Int[Array, ""], Bool[Array, "*lanes"]], Moved]
"""The revolution of those lanes that are marked by the i-th rung of a group."""


class ControlledSteps(AbstractMethod):
    """The first rung of a ladder at which the error of a revolution is within the tolerance.

    Each rung has about twice the steps of the one before it, with which it is compared. A cage that stays off the rib
    for a revolution needs far fewer steps than a contact asks for, and neither is stiff as a rule: explicit rungs come
    first, L-stable ones last. A revolution whose error is too large on the last rung too is `inaccurate`. The price of
    control is that the strobe map is smooth only between the states at which the rung changes: for sweeps, not for
    Newton's method.
    """

    ladder: tuple[Rung, ...]
    """At least two."""
    tolerance: float = eqx.field(static=True)
    """Infinite where the last rung is to be taken whatever its error, which is stated all the same."""

    def advance(
        self,
        field: AbstractField,
        system: AbstractForcedSystem,
        scale: State,
        y: State,
        phase: Scalar,
        parts: Int[Array, ""] | int,
    ) -> Stretch:
        """One part, by the first rung whose error is within the part's share of the tolerance, else by the last."""
        moved = climb(
            self,
            jnp.zeros((), jnp.int32),
            nowhere(y, ()),
            scale,
            lambda rungs, i, _: moved_by(run_rung(self, rungs, i, (field, system, scale), phase, parts), y, ()),
            parts,
        )
        return Stretch(moved.y, moved.peak, result_of(moved.outcome), moved.error)

    def resolving(self, harmonics: int) -> "ControlledSteps":
        """Without the rungs of fewer than two steps to a period of the forcing's highest harmonic, which would agree on
        a slower forcing that is not there."""
        enough = [not isinstance(r, FixedSteps) or r.steps >= 2 * harmonics for r in self.ladder[:-2]]
        kept = tuple(rung for rung, good in zip(self.ladder, [*enough, True, True], strict=True) if good)
        return eqx.tree_at(lambda m: m.ladder, self, kept)

    @property
    def groups(self) -> list[tuple[Rung, ...]]:
        """Neighbouring rungs of one solver, which one program serves; each adaptive one by itself."""
        kind = lambda pair: pair[1].solver if isinstance(pair[1], FixedSteps) else pair[0]
        return [tuple(r for _, r in group) for _, group in itertools.groupby(enumerate(self.ladder), key=kind)]

    @property
    def floors(self) -> list[int]:
        """For each rung, the lowest one of its own solver that can be compared with one of that solver too."""
        firsts = [0, *itertools.accumulate(map(len, self.groups))]
        return [first + min(1, len(g) - 1) for first, g in zip(firsts, self.groups, strict=False) for _ in g]


def run_rung(
    method: ControlledSteps, rungs: Sequence[Rung], i: Int[Array, ""], pieces: tuple, phase: Any = 0.0, parts: Any = 1
) -> Callable[[State], Stretch]:
    """One part by the i-th of `rungs`, with as many times the steps of the ladder's first rung as in a revolution."""
    rung, first = rungs[0], method.ladder[0]
    if isinstance(rung, AdaptiveSteps):
        return lambda y: rung.advance(*pieces, y, phase, parts)
    unit = first.steps if isinstance(first, FixedSteps) else 1
    counts = [-(-(-(-unit // parts) * r.steps) // unit) for r in rungs if isinstance(r, FixedSteps)]
    steps = jnp.asarray(counts)[i] * parts
    return lambda y: run_steps(rung.solver, steps, *pieces, y, phase, parts, multiple=math.gcd(*counts, 4))


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
    parts: Any = 1,
) -> Moved:
    """Lanes, or one without an axis, by the first rung whose error is small enough, beginning just below `level`."""
    begin = jnp.maximum(level, 1) - 1
    carry = (begin, start, jnp.zeros(begin.shape, bool))
    first = 0
    for rungs in method.groups:

        def asked(carry: tuple, end: int = first + len(rungs)) -> Any:
            rung, _, done = carry
            return jnp.any(~done & (rung < end))

        def once(carry: tuple, rungs: tuple[Rung, ...] = rungs, first: int = first) -> tuple:
            rung, before, done = carry
            lowest = jnp.min(jnp.where(done, len(method.ladder), rung))
            mine = ~done & (rung == lowest)
            tried = attempt(rungs, lowest - first, mine)
            alone = rung == begin
            error = jnp.where(alone, jnp.inf, _apart(tried.y, before.y, scale))
            fine = (tried.outcome == 0) & (error <= method.tolerance / parts) & ~alone
            if tried.tangents and math.isfinite(method.tolerance):
                fine &= _turned(tried.tangents[0], before.tangents[0], scale) <= TURN
            tried = tried._replace(error=error, half=before.tangents, level=rung)
            now = jax.tree.map(lambda a, b: jnp.where(mine, a, b), tried, before)
            return jnp.where(mine & ~fine, rung + 1, rung), now, done | (mine & fine)

        carry = jax.lax.while_loop(asked, once, carry)
        first += len(rungs)
    _, moved, done = carry
    bad = ~done & math.isfinite(method.tolerance) & ((parts == 1) | (moved.error > method.tolerance))
    easy = (moved.error * EASY <= method.tolerance) & (moved.level > jnp.asarray(method.floors)[moved.level])
    return moved._replace(
        outcome=jnp.where(bad & (moved.outcome == 0), INACCURATE, moved.outcome),
        level=jnp.where(easy, moved.level - 1, moved.level),
    )


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
    """`method` with its error measured: a fixed number of steps beside half as many, a tolerance beside a larger one."""
    if isinstance(method, ControlledSteps):
        return method
    if isinstance(method, FixedSteps):
        return ControlledSteps((FixedSteps(method.solver, -(-method.steps // 2)), method), math.inf)
    assert isinstance(method, AdaptiveSteps)
    return ControlledSteps((_with_tolerances(method, 16.0), method), math.inf)


def _with_tolerances(method: AdaptiveSteps, times: float) -> AdaptiveSteps:
    """The same with tolerances `times` as large."""
    rtol, atol = (min(times * x, 0.5) for x in (method.rtol, method.atol))
    return AdaptiveSteps(method.solver, rtol, atol, method.max_steps)


def finer(method: AbstractMethod, times: int = 1) -> ControlledSteps:
    """`method` with steps at most half as long, `times` over, for what it is to be confirmed by.

    A controlled method has an error 32 times as small, which a solver of fourth order reaches with 2.4 times the steps.
    """
    rough = stated(method)
    steps, error = 1 << times, 32.0**-times
    each = lambda r: FixedSteps(r.solver, steps * r.steps) if isinstance(r, FixedSteps) else _with_tolerances(r, error)
    return ControlledSteps(tuple(map(each, rough.ladder)), error * rough.tolerance)


def controlled(error: float = DEFAULT_ERROR, ladder: Sequence[tuple[str, int]] = DEFAULT_LADDER) -> ControlledSteps:
    """The method of everything by default: in each revolution the first rung of `ladder` whose error is at most `error`.

    **Arguments:** how far the end of a revolution may move if it is run with the rung before, in units of the system's
    own scale (for a cage: clearances); solvers by name with their steps per revolution, in the order in which they are
    tried.

    **Raises:** `ValueError` for an error that is not positive, a ladder of fewer than two rungs, or an unknown solver.
    """
    if len(ladder) < 2 or any(int(steps) < 1 for _, steps in ladder):
        raise ValueError(
            f"Argument `ladder` must have two or more pairs of a solver and its steps, but it is {ladder}."
        )
    if not error > 0:
        raise ValueError(f"Argument `error` must be positive, but {error} was given.")
    return ControlledSteps(tuple(make_fixed(name, int(steps)) for name, steps in ladder), float(error))
