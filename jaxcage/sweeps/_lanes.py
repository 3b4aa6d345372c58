"""Lanes of a sweep: settled, observed, and their error measured.

Every lane runs by itself: what it does depends neither on its neighbours nor on the number of threads. The engine is
machine code (`solve`); a method of another kind, and a law that has no machine code, run inside JAX.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ..analysis import Observation, Plan, start_tangents
from ..models import ESCAPE
from ..solve import (
    IMPLICIT,
    OUTCOMES,
    RETRIES,
    STUCK,
    SURE,
    TOO_MANY,
    AbstractMethod,
    Engine,
    JaxEngine,
    Lanes,
    March,
    NativeSteps,
    codes_of,
    cores,
)


CHECKED = 8
"""Revolutions of each lane, the last ones whose strobe states are kept, that are run again to measure their error."""
FURTHER = 4
"""Revolutions beyond the end of a run by which the error of its exponents is measured."""
CHUNK = 4096
"""Lanes that are run at a time; their growth in every revolution is kept until it is averaged."""
Progress = Callable[[int, int], None]
"""Called with lanes done and lanes in all."""
Report = Callable[[int], None]


def run_lanes(
    lanes: Lanes,
    method: AbstractMethod,
    plan: Plan,
    y0: Float[np.ndarray, "lanes dim"],
    progress: Progress | None = None,
    onward: bool = False,
) -> Observation:
    """Observe lanes from their initial states.

    Lanes that go `onward`, from where another run left them, may be as far out as lanes come on their way.

    **Returns:** `Observation` of NumPy arrays with the lanes last.
    """
    plan, count = Plan(*map(int, plan)), lanes.speed.size
    each, done = plan.discard + plan.block * plan.blocks, 0.0

    def report(revolutions: int) -> None:
        nonlocal done
        done += revolutions / max(each, 1)
        if progress is not None:
            progress(min(int(done + 1e-9), count), count)

    limit = ESCAPE if onward else 1.0
    parts = [
        _observe(lanes, method, plan, np.arange(i, min(i + CHUNK, count)), y0[i : i + CHUNK], limit, report)
        for i in range(0, count, CHUNK)
    ]
    return Observation(*(np.concatenate(x, axis=-1) for x in zip(*parts, strict=True)))


def _observe(
    lanes: Lanes,
    method: AbstractMethod,
    plan: Plan,
    some: Int[np.ndarray, " some"],
    y0: Float[np.ndarray, "some dim"],
    limit: float,
    report: Report,
) -> Observation:
    """Observe some lanes; those with too large an error again with smaller tolerances, and those that take too many or
    too short steps again by an implicit method."""
    seen, stuck = _once(lanes, method, plan, some, y0, limit, report)

    def again(chosen: AbstractMethod, todo: Int[np.ndarray, " few"]) -> None:
        found, lost = _once(lanes, chosen, plan, some[todo], y0[todo], limit, report)
        for x, late in zip(seen, found, strict=True):
            x[..., todo] = late  # pyright: ignore
        stuck[todo] = lost

    # Compared with the error that was asked for, not with the smaller one of a finer run.
    large = lambda: (np.asarray(seen.error) > method.allowed) & (np.asarray(seen.outcome) == 0)
    for chosen in [method, *([method.implicit] if isinstance(method, NativeSteps) and method.pair != IMPLICIT else [])]:
        if chosen is not method:
            todo = np.flatnonzero(stuck | large())
            if todo.size:
                again(chosen, todo)
        for retry in range(1, RETRIES + 1):
            todo = np.flatnonzero(large() & ~stuck)
            if not todo.size:
                break
            again(chosen.finer(retry), todo)
    np.asarray(seen.outcome)[large()] = OUTCOMES.index("inaccurate")
    lost = np.asarray(seen.outcome) != 0
    seen.strobe[..., lost] = seen.growth[..., lost] = seen.last[..., lost] = np.nan  # pyright: ignore
    return seen


def _once(
    lanes: Lanes,
    method: AbstractMethod,
    plan: Plan,
    some: Int[np.ndarray, " some"],
    y0: Float[np.ndarray, "some dim"],
    limit: float,
    report: Report,
) -> tuple[Observation, Bool[np.ndarray, " some"]]:
    """Observe some lanes by one method. **Returns:** what was seen; lanes that took too many or too short steps."""
    scale, excursion = lanes.begin(some, y0)
    finite = np.all(np.isfinite(y0), axis=1)
    admitted = finite & (excursion <= limit)
    outcome = np.where(finite, np.where(admitted, 0, OUTCOMES.index("outside")), OUTCOMES.index("not_finite"))
    stuck = np.zeros(some.size, dtype=bool)
    dim, revolutions = y0.shape[1], plan.block * plan.blocks
    settling, aligned = plan.discard - plan.align, plan.align + revolutions
    keep, m = plan.keep, plan.exponents
    plain, pushed = lanes.engine(0, method), lanes.engine(m, method)
    numbers = lanes.numbers(pushed, some)
    state, step, peak = y0 / scale, np.full(some.size, np.nan), np.full(some.size, np.nan)
    alive = np.flatnonzero(admitted)

    def follow(engine: Engine | JaxEngine, count: int, **more: Any) -> March:
        nonlocal alive
        done = 0

        def tell(lanes_done: int) -> None:
            nonlocal done
            report((lanes_done - done) * count)
            done = lanes_done

        ran = engine(
            engine.picked(numbers, alive), state[alive], count, method=method, step=step[alive], threads=cores(),
            report=tell, **more,
        )  # fmt: skip
        state[alive], step[alive] = ran.state, ran.step
        outcome[alive] = codes_of(ran.mark)
        stuck[alive] = np.isin(ran.mark, (STUCK, TOO_MANY))
        return ran

    error = np.zeros(some.size)
    if alive.size:
        error[alive] = _error(plain, plain.picked(numbers, alive), state[alive], None, method)
    if settling > 0 and alive.size:
        follow(plain, settling, keep=1)
        alive = alive[outcome[alive] == 0]
    strobe = np.full((some.size, keep, dim), np.nan)
    growth, doubt = np.full((some.size, plan.blocks, m), np.nan), np.zeros((m, some.size))
    if alive.size:
        tangents = np.broadcast_to(start_tangents(dim, m), (alive.size, m, dim))
        held = max(keep, min(CHECKED + 1, aligned))
        who, (_, begun) = alive, lanes.begin(some[alive], state[alive] * scale[alive])
        ran = follow(pushed, aligned, keep=held, tangents=tangents)
        strobe[who] = ran.strobe[:, held - keep :]
        growth[who] = ran.growth[:, plan.align :].reshape(who.size, plan.blocks, plan.block, m).mean(axis=2)
        peak[who] = np.maximum(ran.peak, begun)
        doubt[:, who] = _doubt(pushed, pushed.picked(numbers, who), ran, method)
        error[who] = np.maximum(error[who], _error(plain, plain.picked(numbers, who), None, ran.strobe, method))
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
    engine: Engine | JaxEngine, numbers: Any, ran: March, method: AbstractMethod
) -> Float[np.ndarray, "exponents some"]:
    """Error of the exponents per revolution that comes from the steps: three times the change of the mean growth over
    a few further revolutions by the method's reference."""
    if not ran.tangents.shape[1]:
        return np.zeros((0, len(ran.state)))
    options: dict[str, Any] = dict(tangents=ran.tangents, step=ran.step, threads=cores())
    further = lambda chosen: engine(numbers, ran.state, FURTHER, 1, chosen, **options).growth.mean(axis=1)
    return SURE * np.abs(further(method) - further(method.reference)).T


def _error(
    engine: Engine | JaxEngine,
    numbers: Any,
    start: Float[np.ndarray, "some dim"] | None,
    strobe: Float[np.ndarray, "some held dim"] | None,
    method: AbstractMethod,
) -> Float[np.ndarray, " some"]:
    """Error of a revolution: three times the distance of its end from that by the method's reference.

    It is at least the tolerance, which protects against accidental agreement of the two. Measured from `start`, by a
    run of its own, or between the last of the strobe states.
    """
    once = lambda y, chosen, numbers: engine(numbers, y, 1, 1, chosen, threads=cores()).state
    least = getattr(method, "tolerance", 0.0)
    if start is not None:
        ends, sharper = once(start, method, numbers), once(start, method.reference, numbers)
        return np.maximum(SURE * np.nan_to_num(np.max(np.abs(ends - sharper), axis=1)), least)
    assert strobe is not None
    pairs = strobe[:, -(CHECKED + 1) :]
    count = pairs.shape[1] - 1
    if count < 1:
        return np.zeros(len(strobe))
    repeated = engine.picked(numbers, np.repeat(np.arange(len(strobe)), count))
    sharper = once(pairs[:, :-1].reshape(-1, pairs.shape[2]), method.reference, repeated)
    apart = np.max(np.abs(sharper - pairs[:, 1:].reshape(sharper.shape)), axis=1)
    return np.maximum(SURE * np.max(np.nan_to_num(apart.reshape(-1, count)), axis=1), least)
