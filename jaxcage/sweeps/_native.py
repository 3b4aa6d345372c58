"""Lanes of a sweep in machine code: settled, observed, and their error measured."""

import functools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._form import split
from ..analysis import Observation, Plan, start_tangents
from ..integrate import OUTCOMES, NativeSteps
from ..models import AbstractForcedSystem
from ..solve import FINISHED, FIRST_STEP, NOT_FINITE, OUTSIDE, Engine, March, UnknownOperation, say_once


CHECKED = 8
"""Revolutions of each lane, the last ones whose strobe states are kept, that are run again to measure their error."""
FURTHER = 4
"""Revolutions beyond the end of a run by which the error of its exponents is measured."""
SHARPER = 1e-2
"""Tolerance of the run that measures errors, as a fraction of the tolerance."""
SURE = 3.0
"""The stated error, as a multiple of the difference of the two runs."""
RETRIES = 3
"""How often a lane whose error is too large is run again with tolerances 16 times smaller."""
CHUNK = 4096
"""Lanes that are run at a time; their growth in every revolution is kept until it is averaged."""
Report = Callable[[int], None]
_engines: dict[Any, Engine | None] = {}


def engine_of(system: AbstractForcedSystem, tangents: int, several: bool, pair: str) -> Engine | None:
    """The compiled code of a system, None for a law that cannot be translated; a warning names the operation once."""
    key = (split(system, eqx.is_inexact_array)[0], tangents, several, pair)
    if key not in _engines:
        try:
            _engines[key] = Engine(system, tangents, several, pair)
        except UnknownOperation as operation:
            say_once(str(operation))
            _engines[key] = None
    return _engines[key]


class Lanes:
    """Lanes by number: which design and which speed each has."""

    def __init__(
        self,
        designs: AbstractForcedSystem,
        count: int,
        which: Int[np.ndarray, " lanes"],
        speed: Float[np.ndarray, " lanes"],
        threads: int,
    ):
        """`designs` is a system, or `count` of them with their arrays stacked."""
        number = lambda x: jnp.asarray(x, dtype=float) if eqx.is_inexact_array_like(x) else x
        self.form, rows = split(jax.tree.map(number, designs), eqx.is_inexact_array)
        self.several, self.which, self.speed, self.threads = count > 1, which, speed, threads
        self._rows = [np.asarray(x) for x in rows]

    @property
    def system(self) -> AbstractForcedSystem:
        """One of the designs."""
        return self.form.filled([jnp.asarray(x[0] if self.several else x) for x in self._rows])

    def rows(self, lanes: Int[np.ndarray, " some"]) -> list[Any]:
        """Numbers of the designs of some lanes, or those that all have."""
        return [x[self.which[lanes]] for x in self._rows] if self.several else self._rows

    def engine(self, tangents: int, pair: str) -> Engine | None:
        """The compiled code with so many tangent vectors."""
        return engine_of(self.system, tangents, self.several, pair)


@functools.lru_cache(maxsize=32)
def _scales(form: Any, several: bool) -> Any:
    """Scales and excursions of lanes, by speed, numbers of the system and state."""

    def of(speed: Any, row: Any, y: Any) -> tuple[Any, Any]:
        system = form.filled(row)
        return jnp.stack([jnp.asarray(s, float) for s in system.scale(speed)]), jnp.asarray(system.excursion(tuple(y)))

    return jax.jit(jax.vmap(of, in_axes=(0, 0 if several else None, 0)))


def _begin(
    lanes: Lanes, some: Int[np.ndarray, " some"], y: Float[np.ndarray, "some dim"]
) -> tuple[Float[np.ndarray, "some dim"], Float[np.ndarray, " some"]]:
    """Scale of each lane, and excursion of its state."""
    count = some.size
    room = 1 << max(3, (count - 1).bit_length())
    filled = np.concatenate([some, np.broadcast_to(some[-1:], room - count)])
    states = np.concatenate([y, np.broadcast_to(y[-1:], (room - count, y.shape[1]))])
    scale, excursion = _scales(lanes.form, lanes.several)(lanes.speed[filled], lanes.rows(filled), states)
    return np.asarray(scale)[:count], np.asarray(excursion)[:count]


def observe_native(
    lanes: Lanes,
    method: NativeSteps,
    plan: Plan,
    y0: Float[np.ndarray, "lanes dim"],
    limit: float,
    report: Report,
    otherwise: Callable[[Int[np.ndarray, " some"]], Observation],
) -> Observation | None:
    """Observe lanes in machine code.

    **Arguments:** lanes; method; plan; states to begin from, with an excursion of at most `limit`;
    `report(revolutions)` is called with what has been run; `otherwise(lanes)` observes lanes that need another method.

    **Returns:** an `Observation` with the lanes last, None where the law cannot be translated.
    """
    count = lanes.speed.size
    if any(lanes.engine(k, method.pair) is None for k in {0, plan.exponents}):
        return None
    parts = [
        _observe(lanes, method, plan, np.arange(i, min(i + CHUNK, count)), y0, limit, report)
        for i in range(0, count, CHUNK)
    ]
    seen = Observation(*(np.concatenate(x, axis=-1) for x in zip(*(p for p, _ in parts), strict=True)))
    again = np.flatnonzero(np.concatenate([stuck for _, stuck in parts]))
    if again.size:
        for x, late in zip(seen, otherwise(again), strict=True):
            x[..., again] = late  # pyright: ignore
    return seen


def _observe(
    lanes: Lanes,
    method: NativeSteps,
    plan: Plan,
    some: Int[np.ndarray, " some"],
    y0: Float[np.ndarray, "lanes dim"],
    limit: float,
    report: Report,
) -> tuple[Observation, Bool[np.ndarray, " some"]]:
    """Observe some lanes, and those with too large an error again with smaller tolerances.

    **Returns:** the observation, and the lanes that need another method, because their steps became too short or too
    many, or because their error stays too large.
    """
    seen = stuck = None
    todo = np.arange(some.size)
    for retry in range(RETRIES + 1):
        found, lost = _once(lanes, method.finer(retry), plan, some[todo], y0[some[todo]], limit, report)
        if seen is None or stuck is None:
            seen, stuck = found, lost
        else:
            for x, late in zip(seen, found, strict=True):
                x[..., todo] = late  # pyright: ignore
            stuck[todo] = lost
        # Compared with the error that was asked for, not with the smaller one of a finer run.
        large = (np.asarray(seen.error) > method.error) & (np.asarray(seen.outcome) == 0)
        todo = np.flatnonzero(large & ~stuck)
        if not todo.size:
            break
    assert seen is not None and stuck is not None
    stuck[todo] = True
    return seen, stuck


def _once(
    lanes: Lanes,
    method: NativeSteps,
    plan: Plan,
    some: Int[np.ndarray, " some"],
    y0: Float[np.ndarray, "some dim"],
    limit: float,
    report: Report,
) -> tuple[Observation, Bool[np.ndarray, " some"]]:
    """Observe some lanes by one tolerance."""
    scale, excursion = _begin(lanes, some, y0)
    finite = np.all(np.isfinite(y0), axis=1)
    admitted = finite & (excursion <= limit)
    outcome = np.where(finite, np.where(admitted, 0, OUTCOMES.index("outside")), OUTCOMES.index("not_finite"))
    stuck = np.zeros(some.size, dtype=bool)
    dim, revolutions = y0.shape[1], plan.block * plan.blocks
    settling, aligned = plan.discard - plan.align, plan.align + revolutions
    keep, m = plan.keep, plan.exponents
    plain, pushed = lanes.engine(0, method.pair), lanes.engine(m, method.pair)
    assert plain is not None and pushed is not None
    numbers = pushed.numbers(lanes.speed[some], lanes.rows(some))
    pick = lambda x, who: (x[0][:, who], x[1])
    state, step, peak = y0 / scale, np.full(some.size, FIRST_STEP), np.maximum(excursion, 0.0)
    alive = np.flatnonzero(admitted)

    def follow(engine: Engine, count: int, **more: Any) -> March:
        nonlocal alive
        done = 0

        def tell(lanes_done: int) -> None:
            nonlocal done
            report((lanes_done - done) * count)
            done = lanes_done

        ran = engine(
            pick(numbers, alive), state[alive], count, tolerance=method.tolerance, step=step[alive],
            threads=lanes.threads, report=tell, **more,
        )  # fmt: skip
        state[alive], step[alive] = ran.state, ran.step
        codes = {OUTSIDE: "outside", NOT_FINITE: "not_finite"}
        for mark, name in codes.items():
            outcome[alive[ran.mark == mark]] = OUTCOMES.index(name)
        stuck[alive] |= ~np.isin(ran.mark, (FINISHED, *codes))
        return ran

    error = np.zeros(some.size)
    if alive.size:
        error[alive] = _error(plain, pick(numbers, alive), state[alive], None, method, lanes.threads)
    if settling > 0 and alive.size:
        follow(plain, settling, keep=1)
        alive = alive[(outcome[alive] == 0) & ~stuck[alive]]
    strobe = np.full((some.size, keep, dim), np.nan)
    growth, doubt = np.full((some.size, plan.blocks, m), np.nan), np.zeros((m, some.size))
    if alive.size:
        tangents = np.broadcast_to(np.array(start_tangents(dim, m), dtype=float).reshape(m, dim), (alive.size, m, dim))
        held = max(keep, min(CHECKED + 1, aligned))
        who = alive
        ran = follow(pushed, aligned, keep=held, tangents=tangents)
        strobe[who] = ran.strobe[:, held - keep :]
        growth[who] = ran.growth[:, plan.align :].reshape(who.size, plan.blocks, plan.block, m).mean(axis=2)
        peak[who] = ran.peak
        doubt[:, who] = _doubt(pushed, pick(numbers, who), ran, method, lanes.threads)
        error[who] = np.maximum(error[who], _error(plain, pick(numbers, who), None, ran.strobe, method, lanes.threads))
    lost = outcome != 0
    strobe[lost], growth[lost], state[lost] = np.nan, np.nan, np.nan
    return Observation(
        np.moveaxis(strobe * scale[:, None, :], 0, -1),
        np.moveaxis(growth, 0, -1),
        (state * scale).T,
        peak,
        outcome.astype(np.int32),
        error,
        doubt,
    ), stuck


def _doubt(
    engine: Engine, numbers: Any, ran: March, method: NativeSteps, threads: int
) -> Float[np.ndarray, "exponents some"]:
    """Error of the exponents per revolution that comes from the steps: three times the change of the mean growth over
    a few further revolutions by a hundredth of the tolerance."""
    further = lambda tolerance: engine(
        numbers, ran.state, FURTHER, 1, tolerance, tangents=ran.tangents, step=ran.step, threads=threads
    ).growth.mean(axis=1)
    return SURE * np.abs(further(method.tolerance) - further(SHARPER * method.tolerance)).T


def _error(
    engine: Engine,
    numbers: Any,
    start: Float[np.ndarray, "some dim"] | None,
    strobe: Float[np.ndarray, "some held dim"] | None,
    method: NativeSteps,
    threads: int,
) -> Float[np.ndarray, " some"]:
    """Error of a revolution: three times the distance of its end from that by a hundredth of the tolerance.

    It is at least the tolerance, which protects against accidental agreement of the two. Measured from `start`, by a
    run of its own, or between the last of the strobe states.
    """
    once = lambda y, tolerance, numbers: engine(numbers, y, 1, 1, tolerance, threads=threads).state
    sharp = SHARPER * method.tolerance
    if start is not None:
        ends, sharper = once(start, method.tolerance, numbers), once(start, sharp, numbers)
        return np.maximum(SURE * np.max(np.abs(ends - sharper), axis=1), method.tolerance)
    assert strobe is not None
    pairs = strobe[:, -(CHECKED + 1) :]
    count = pairs.shape[1] - 1
    if count < 1:
        return np.zeros(len(strobe))
    repeated = np.repeat(numbers[0], count, axis=1), numbers[1]
    sharper = once(pairs[:, :-1].reshape(-1, pairs.shape[2]), sharp, repeated)
    apart = np.max(np.abs(sharper - pairs[:, 1:].reshape(sharper.shape)), axis=1)
    return np.maximum(SURE * np.max(np.nan_to_num(apart.reshape(-1, count)), axis=1), method.tolerance)
