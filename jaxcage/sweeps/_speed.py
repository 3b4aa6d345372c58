"""Sweeps over speed from several starts."""

import dataclasses
import functools
import math
import reprlib
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any, overload

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least, wrong
from .._checks import require_x64
from .._errors import ArgumentError
from .._form import compiled
from .._types import State
from ..analysis import LONGEST_PERIOD, Confirmation, Observation, Plan, Sweep, closing_period
from ..models import INSTEAD, AbstractForcedSystem, require_known, require_speeds
from ..solve import AbstractMethod, Lanes, native
from ._confirm import Labelled, confirm as confirm_lanes, doubtful
from ._lanes import Progress, run_lanes
from ._lasting import follow


@overload
def rpm(first: float | int) -> float: ...
@overload
def rpm(first: float | int, last: float | int, count: int = 2) -> Float[np.ndarray, " count"]: ...
def rpm(first: float | int, last: float | int | None = None, count: int = 2) -> float | Float[np.ndarray, " count"]:
    """Speeds given in revolutions per minute, in rad/s: one number, or an array of `count` from `first` to `last`.

    **Raises:** `ValueError` for anything but finite numbers, and for a count below 1.
    """
    for name, value in {"first": first, **({} if last is None else {"last": last})}.items():
        if wrong(float, value) or not math.isfinite(value):
            raise ArgumentError(name, said=f"must be a finite number, but {reprlib.repr(value)} was given.")
    if said := wrong(int, count):
        raise ArgumentError("count", said=f"must be {said}, but {count!r} was given.")
    require_at_least(1, count=count)
    if last is None:
        return float(first) * math.pi / 30
    return np.linspace(first, last, count) * math.pi / 30


def checked_speeds(speeds: float | Float[Array, " speeds"] | Float[np.ndarray, " speeds"]) -> np.ndarray:
    speed = np.atleast_1d(np.asarray(speeds, dtype=float))
    if speed.size == 0:
        raise ArgumentError("speeds", said="must hold at least one speed, but it is empty.")
    if not np.all(np.isfinite(speed)) or np.any(speed <= 0):
        bad = speed[~(np.isfinite(speed) & (speed > 0))][0]
        raise ArgumentError("speeds", said=f"must be positive and finite, but it holds {bad} rad/s.")
    if np.any(np.diff(speed) <= 0):
        raise ArgumentError("speeds", said="must be in ascending order without repetition, but it is not.")
    return speed


def make_plan(discard: int, revolutions: int, blocks: int, keep: int, exponents: int, dimension: int) -> Plan:
    require_at_least(1, keep=keep)
    require_lengths(discard, revolutions, blocks)
    if not 0 <= exponents <= dimension:
        allowed = f"at most {dimension}" if exponents > 0 else "at least 0"
        raise ArgumentError("exponents", said=f"must be {allowed}, but {exponents} was given.")
    return Plan(discard, revolutions // blocks, blocks, min(keep, revolutions), exponents)


def require_lengths(discard: int, revolutions: int, blocks: int) -> None:
    """**Raises:** `ValueError` for what no sweep can have."""
    require_at_least(0, discard=discard)
    require_at_least(1, revolutions=revolutions, blocks=blocks)
    if revolutions % blocks:
        raise ArgumentError("blocks", said=f"must divide the {revolutions} revolutions, but it is {blocks}.")


def require_persist(persist: int, discard: int, exponents: int, blocks: int) -> None:
    """**Raises:** `ValueError`, also where no lane could be called chaotic for want of an exponent or its error."""
    require_at_least(0, persist=persist)
    if persist and persist <= discard:
        raise ArgumentError(
            "persist", said=f"must be 0 or above the {discard} revolutions discarded, but is {persist}."
        )
    if persist and (exponents < 1 or blocks < 2):
        raise ArgumentError(
            "persist",
            said="needs an exponent and its error, from at least 1 of `exponents` and 2 `blocks`, "
            f"but they are {exponents} and {blocks}.",
        )


def sweep(
    system: AbstractForcedSystem,
    speeds: float | Float[Array, " speeds"] | Float[np.ndarray, " speeds"],
    *,
    starts: int | Sequence[State] | Float[np.ndarray, "speeds starts dim"] | None = None,
    discard: int = 300,
    revolutions: int = 300,
    confirm: bool = True,
    horizon: int = 3000,
    exponents: int = 1,
    blocks: int = 20,
    keep: int = 64,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Run a forced system over speed from several starts: strobe states, Lyapunov exponents, labels.

    **Arguments:**

    - `system`: any `AbstractForcedSystem`.
    - `speeds`: ascending speeds [rad/s]; `jaxcage.rpm` makes them from revolutions per minute.
    - `starts`: initial states, each a tuple of numbers, or an array with its own states for each speed; or how many of
        the system's own; by default all of these.
    - `discard`, `revolutions`: revolutions left out at the beginning, and observed after that.
    - `confirm`: run what is not periodic, its neighbours in speed and a tenth of the rest again with steps at most half
        as long, and what changes with finer ones still (`Sweep.confirmed`).
    - `horizon`: revolutions of the whole run to which lanes that have not settled are followed, to tell how long their
        chaos lasts (`Sweep.survival`); 0 turns this off.
    - `exponents`: number of Lyapunov exponents, 0 to the dimension of the state.
    - `blocks`: blocks of revolutions from whose scatter the standard error comes.
    - `keep`: number of strobe states kept, the last ones; a period k is only seen with at least 2 k of them, all up to
        8 with 16.
    - `method`: integration method, by default `jaxcage.native()`.
    - `progress`: called with lanes done and lanes in all.

    **Returns:** `Sweep`. Lanes that fail are NaN with an outcome and leave their neighbours untouched.

    **Raises:** `ValueError` for speeds that are empty, not positive or not ascending, and for impossible counts;
    `RuntimeError` without double precision.
    """
    options: dict[str, Any] = dict(
        discard=discard,
        revolutions=revolutions,
        confirm=confirm,
        horizon=horizon,
        exponents=exponents,
        blocks=blocks,
        keep=keep,
    )
    return sweep_designs([system], speeds, starts=starts, method=method, progress=progress, **options)[0]


def sweep_designs(
    systems: Sequence[AbstractForcedSystem],
    speeds: float | Float[Array, " speeds"] | Float[np.ndarray, " speeds"] | Float[np.ndarray, "systems speeds"],
    *,
    starts: int | Sequence[State] | Float[np.ndarray, "speeds starts dim"] | None = None,
    discard: int = 300,
    revolutions: int = 300,
    confirm: bool = True,
    horizon: int = 3000,
    exponents: int = 1,
    blocks: int = 20,
    keep: int = 64,
    settled: int = 0,
    method: AbstractMethod | None = None,
    progress: Progress | None = None,
) -> list[Sweep]:
    """`sweep` for several designs or cases at once, all lanes in one batch: one program, full chunks.

    **Arguments:** systems that differ in their numbers only; speeds of all of them, or a row for each; `settled`,
    revolutions after which a lane whose kept strobe states repeat is stopped as periodic, its exponents NaN (0 runs all
    lanes to the end); the rest as for `sweep`.

    **Returns:** a `Sweep` for each system, the same as one by one to rounding (which chaos makes large).
    """
    require_x64()
    require_known("sweep", INSTEAD, systems, speeds)
    if not systems:
        raise ArgumentError("systems", said="must hold at least one system, but it is empty.")
    speed = _speeds_of_each(speeds, len(systems))
    require_speeds(systems[0], speed, "speeds")
    chosen = native() if method is None else method
    dim = systems[0].dimension
    plan = make_plan(discard, revolutions, blocks, keep, exponents, dim)
    require_at_least(0, horizon=horizon)
    _require_settled(settled, discard, confirm, horizon)
    y0 = np.stack([initial_states(*each, starts) for each in zip(systems, speed, strict=True)])  # ..., starts, dim
    shape = y0.shape[1:3]
    each = shape[0] * shape[1]
    which = np.repeat(np.arange(len(systems)), each)
    lanes = Lanes.of(systems, np.repeat(speed.ravel(), shape[1]), which)
    lane_start, how = y0.reshape(-1, dim), settings_of(chosen)

    def run(plan: Plan, lane: np.ndarray, method: AbstractMethod = chosen, y: np.ndarray | None = None) -> Observation:
        begin = lane_start[lane] if y is None else y
        return run_lanes(lanes.at(lane), method, plan, begin, progress, onward=y is not None)

    def each_system(seen: Observation) -> list[Sweep]:
        parts = [Observation(*(x[..., i * each : (i + 1) * each] for x in seen)) for i in range(len(systems))]
        return [assemble(s, v, how, plan, part, shape) for s, v, part in zip(systems, speed, parts, strict=True)]

    if settled:
        scale = np.concatenate([np.asarray(_scales(s, jnp.asarray(v))) for s, v in zip(systems, speed, strict=True)])
        seen = run_unsettled(run, plan, settled, np.repeat(scale, shape[1], axis=0))
    else:
        seen = run(plan, np.arange(which.size))
    found = each_system(seen)
    if exponents < 1 or blocks < 2:  # without an error of the exponent nothing is called chaotic
        return found
    rounds: tuple[Confirmation, ...] = ()
    if confirm:
        labelled = _labelled(found)

        def again(lanes: np.ndarray, times: int) -> Labelled:
            _put(seen, lanes, run(plan, lanes, chosen.finer(times)))
            return _labelled(each_system(seen)).at(lanes)

        wanted = doubtful(labelled.label.reshape(len(systems), *shape))
        rounds = confirm_lanes(wanted, labelled, again)
        found = each_system(seen)
    if horizon <= discard + revolutions:
        return [dataclasses.replace(s, confirmed=rounds) for s in found]
    label = _labelled(found).label
    scale = np.concatenate([np.repeat(s.scale, shape[1], axis=0) for s in found])
    escape, end = follow(label, seen, plan, scale, horizon, lambda plan, lanes, y: run(plan, lanes, chosen, y))
    return [
        dataclasses.replace(s, escape=e.reshape(shape), horizon=end, confirmed=rounds)
        for s, e in zip(each_system(seen), np.split(escape, len(systems)), strict=True)
    ]


def _require_settled(settled: int, discard: int, confirm: bool, horizon: int) -> None:
    """**Raises:** `ValueError`."""
    if settled and not 2 * LONGEST_PERIOD <= settled <= discard:
        allowed = f"{2 * LONGEST_PERIOD} to the {discard} revolutions discarded"
        raise ArgumentError("settled", said=f"must be 0, or {allowed}, but is {settled}.")
    if settled and (confirm or horizon):
        raise ArgumentError("settled", said="goes with `confirm=False` and `horizon=0`, but one of them was given.")


def run_unsettled(
    run: Callable[..., Observation], plan: Plan, settled: int, scale: Float[np.ndarray, "lanes dim"]
) -> Observation:
    """What lanes do, of which those that are periodic after `settled` revolutions, or after all that are discarded, are
    not run any further, nor with tangent vectors."""
    lanes, seen, done = np.arange(len(scale)), None, 0
    for until in sorted({settled, plan.discard}):
        short = min(plan.keep, until - done)
        new = run(Plan(until - done - short, short, 1, short, 0), lanes, y=None if seen is None else _last(seen)[lanes])
        strobe = np.full((plan.keep, *new.strobe.shape[1:]), np.nan)
        strobe[plan.keep - short :] = new.strobe
        growth = np.full((plan.blocks, plan.exponents, lanes.size), np.nan)
        new = new._replace(strobe=strobe, growth=growth, doubt=growth[0].copy())
        seen = new if seen is None else _after(seen, lanes, new)
        closed = closing_period(np.moveaxis(strobe[plan.keep - short :], -1, 0), scale[lanes]) > 0
        lanes, done = lanes[~closed & (np.asarray(new.outcome) == 0)], until
    assert seen is not None
    if lanes.size:
        seen = _after(seen, lanes, run(plan._replace(discard=plan.align), lanes, y=_last(seen)[lanes]))
    return seen


def _last(seen: Observation) -> np.ndarray:
    return np.asarray(seen.last).T


def _after(seen: Observation, lanes: np.ndarray, new: Observation) -> Observation:
    """What was seen of all, and of some of them later."""
    error = np.array(seen.error)
    error[lanes] = np.fmax(error[lanes], new.error)
    _put(seen, lanes, new)
    return seen._replace(error=error)


def _speeds_of_each(speeds: Any, systems: int) -> Float[np.ndarray, "systems speeds"]:
    """The speeds of each system: its own, or those of all."""
    if np.ndim(speeds) != 2:
        return np.broadcast_to(speed := checked_speeds(speeds), (systems, speed.size))
    if len(speeds) != systems:
        raise ArgumentError("speeds", said=f"must have a row for each of {systems} systems, but has {len(speeds)}.")
    return np.stack([checked_speeds(row) for row in speeds])


def _labelled(found: Sequence[Sweep]) -> Labelled:
    """What the lanes of several sweeps are called, in a row."""
    rows = [(s.observed_label, s.exponents[..., 0], s.standard_error[..., 0]) for s in found]
    return Labelled(*(np.concatenate([x.ravel() for x in column]) for column in zip(*rows, strict=True)))


def _put(seen: Observation, lanes: np.ndarray, new: Observation) -> None:
    """`new` in place of what was seen of `lanes`."""
    for x, late in zip(seen, new, strict=True):
        x[..., lanes] = late  # pyright: ignore


def assemble(
    system: AbstractForcedSystem,
    speed: Float[np.ndarray, " speeds"],
    settings: dict[str, str],
    plan: Plan,
    seen: tuple[Any, ...],
    shape: tuple[int, ...],
) -> Sweep:
    """A `Sweep` from the fields of an `Observation` whose lanes are laid out as `shape` = (speeds, starts)."""
    strobe, growth, last, peak, outcome, error, doubt = (np.moveaxis(np.array(x), -1, 0) for x in seen)
    return Sweep(
        speed=speed,
        strobe=strobe.reshape(*shape, plan.keep, system.dimension),
        last=last.reshape(*shape, system.dimension),
        block_growth=growth.reshape(*shape, plan.blocks, plan.exponents),
        peak=peak.reshape(shape),
        outcome=outcome.reshape(shape),
        error=error.reshape(shape),
        doubt=doubt.reshape(*shape, plan.exponents),
        scale=np.asarray(_scales(system, jnp.asarray(speed))),
        discard=plan.discard,
        revolutions=plan.block * plan.blocks,
        settings=settings,
    )


def initial_states(
    system: AbstractForcedSystem,
    speed: np.ndarray,
    starts: int | Sequence[State] | Float[np.ndarray, "speeds starts dim"] | None,
) -> Float[np.ndarray, "speeds starts dim"]:
    """A state for each speed and start: the system's own, some of them, the same ones at every speed, or as given."""
    if starts is None or isinstance(starts, int):
        own = np.asarray(_own_starts(system, jnp.asarray(speed)))
        if starts is not None and not 1 <= starts <= own.shape[1]:
            raise ArgumentError(
                "starts", said=f"must be 1 to {own.shape[1]}, as many as the system has, but {starts} was given."
            )
        return own[:, :starts]
    wanted = f"states of {system.dimension} numbers"
    if isinstance(starts, np.ndarray):
        if starts.ndim != 3 or starts.shape[::2] != (speed.size, system.dimension):
            raise ArgumentError(
                "starts", said=f"must hold {wanted} for each of {speed.size} speeds, but has shape {starts.shape}."
            )
        return starts
    rows = [np.array([float(c) for c in y]) for y in starts]
    if not rows or any(row.shape != (system.dimension,) for row in rows):
        raise ArgumentError("starts", said=f"must hold {wanted}, but holds {starts}.")
    return np.broadcast_to(np.stack(rows), (speed.size, len(rows), system.dimension)).copy()


@compiled
def _scales(system: AbstractForcedSystem, speed: Float[Array, " speeds"]) -> Float[Array, "speeds dim"]:
    return jax.vmap(lambda s: jnp.stack([jnp.asarray(c) for c in system.scale(s)]))(speed)


@compiled
def _own_starts(system: AbstractForcedSystem, speed: Float[Array, " speeds"]) -> Float[Array, "speeds starts dim"]:
    row = lambda y: jnp.stack([jnp.asarray(c) for c in y])
    return jax.vmap(lambda s: jnp.stack([row(y) for y in system.starts(s)]))(speed)


@functools.cache
def versions() -> dict[str, str]:
    """Of what a sweep is computed with."""
    return {f"version_{p}": version(p) for p in ("jaxcage", "jax", "diffrax", "equinox", "numpy")}


def settings_of(method: AbstractMethod) -> dict[str, str]:
    """How a sweep was computed: method and versions."""
    return {"method": str(method).replace("\n", " "), **versions()}
