"""Sweeps of the whole bearing over shaft speeds, from several starts and for several designs."""

import concurrent.futures
import functools
import threading
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from ..analysis import BearingRecord, BearingSweep, summed_up
from ..integrate import (
    FOLLOWED,
    INTEGRATED,
    LONGEST_BLOCK,
    OUTCOMES,
    SAMPLES,
    SPACING,
    WITH_TANGENT,
    BearingLanes,
    bearing_states,
    begin_lanes,
    comparable,
    lanes_apart,
    run_block,
    slowness,
)
from ..models import BearingModel, BearingState, rolling_start
from ..models.whole import CAGE_STARTS, BearingAtSpeed, CagePlace, state_scale
from ._engine import Progress, alike, cores, workers
from ._speed import checked_speeds, require_lengths, versions


CHUNKS = (8, 16, 32, 48, 64, 80, 96)
"""Lanes per call: few sizes, as each is compiled."""
CALL = 12
"""What a call costs beside its lanes, in lanes."""
PER_HOUR = 1e9 * 3600
"""mm^3 an hour in 1 m^3 a second."""
LEAD = 10
"""Revolutions in which a tangent vector turns to the direction of fastest growth, before its growth counts."""
EXPONENT = 80
"""Revolutions over which the exponent is followed, if there are as many: the others take half the time."""
COARSER = 16.0
"""A tolerance so many times larger makes steps of fourth order about twice as long."""
Starts = int | Sequence[BearingState] | Sequence[CagePlace]
"""How many of the model's own, or states, or places of the cage such as `CAGE_STARTS`."""


def sweep_bearing(
    model: BearingModel,
    speeds: float | Float[Array, " speeds"] | Float[np.ndarray, " speeds"],
    *,
    starts: Starts = 3,
    discard: int = 100,
    revolutions: int = 200,
    blocks: int = 20,
    exponents: int = 1,
    exponent_revolutions: int = EXPONENT,
    tolerance: float = 1e-4,
    allowed: float = 5e-2,
    progress: Progress | None = None,
) -> BearingSweep:
    """Run the whole bearing over shaft speeds from several starts: slips, forces, losses, whirl, largest exponent.

    **Arguments:**

    - `model`: bearing, with an inner ring that is `dynamic`.
    - `speeds`: ascending shaft speeds [rad/s].
    - `starts`: how many of the model's own starts (`rolling_start`), positions of the cage as it takes them, or states
        with which every speed begins.
    - `discard`, `revolutions`: revolutions of the cage left out at the beginning, and observed after that.
    - `blocks`: of the observed revolutions, from whose scatter standard errors come.
    - `exponents`: 1 for the largest Lyapunov exponent, 0 for none.
    - `exponent_revolutions`: it is followed over the last of the observed revolutions, over at least so many if there
        are, in whole blocks (two or more).
    - `tolerance`: largest estimated error of a step, in units of `jaxcage.models.whole.state_scale`.
    - `allowed`: largest measured error. Once in each block a stretch of 1/16 of a revolution, of slow shafts a shorter
        one, is run a second time with about half the steps; a lane in which that moves the state by more is
        `inaccurate`. Slow is a shaft with which that stretch would be more than 50 periods of a loaded roller's
        vibration on its raceway (NU2310 below 4000 rpm): it is 10 of them then, as neighbouring motions diverge over
        time, not over revolutions.
    - `progress`: called with lanes done and lanes in all.

    **Returns:** `BearingSweep`. A lane that fails is NaN with an outcome, and its neighbours go on: `outside` if the
    cage comes nearly to rest (below 5 % of the speed of pure rolling) or leaves its land, `max_steps_reached` if it
    needs more than 20,000 steps a revolution (of slow shafts as many times more as more periods go to one).

    **Raises:** `ValueError` for speeds that are empty, not positive or not ascending, impossible counts or a
    quasi-static ring; `RuntimeError` without double precision.
    """
    options: dict[str, Any] = dict(
        starts=starts,
        discard=discard,
        revolutions=revolutions,
        blocks=blocks,
        exponents=exponents,
        exponent_revolutions=exponent_revolutions,
    )
    return sweep_bearings([model], speeds, **options, tolerance=tolerance, allowed=allowed, progress=progress)[0]


def sweep_bearings(
    models: Sequence[BearingModel],
    speeds: float | Float[Array, " speeds"] | Float[np.ndarray, " speeds"],
    *,
    starts: Starts = 3,
    discard: int = 100,
    revolutions: int = 200,
    blocks: int = 20,
    exponents: int = 1,
    exponent_revolutions: int = EXPONENT,
    tolerance: float = 1e-4,
    allowed: float = 5e-2,
    progress: Progress | None = None,
) -> list[BearingSweep]:
    """`sweep_bearing` for several designs at once, all lanes in one batch.

    **Arguments:** bearings that differ in their numbers only; the rest as for `sweep_bearing`.

    **Returns:** a `BearingSweep` for each.
    """
    require_x64()
    speed = checked_speeds(speeds)
    models = list(models)
    require_bearings(models, starts, discard, revolutions, blocks, exponents)
    table = _Table(models, speed, starts)
    lanes, block = table.which.size, revolutions // blocks
    size = min(CHUNKS, key=lambda size: (-(-lanes // (size * cores())) * (size + CALL), size))
    chunks = np.split(np.argsort(table.lane_speed, kind="stable"), range(size, lanes, size))
    counted = _counted(progress, lanes, discard + revolutions)
    require_at_least(1, exponent_revolutions=exponent_revolutions)
    followed = min(blocks, max(2, -(-exponent_revolutions // block))) if exponents else 0

    def run(chunk: np.ndarray) -> dict[str, Any]:
        padded = np.concatenate([chunk, np.repeat(chunk[-1:], size - chunk.size)])
        done = functools.partial(counted, chunk.size)
        found = _followed(*table.taken(padded), discard, [block] * blocks, followed, tolerance, done)
        return jax.tree.map(lambda x: x[: chunk.size], found)

    with concurrent.futures.ThreadPoolExecutor(workers()) as pool:
        parts = list(pool.map(run, chunks))  # an exception cancels what has not begun
    back = np.argsort(np.concatenate(chunks))
    found = jax.tree.map(lambda *x: np.concatenate(x)[back], *parts)
    found["outcome"] = np.where(
        (found["outcome"] == 0) & ~(found["error"] <= allowed), OUTCOMES.index("inaccurate"), found["outcome"]
    )
    settings = {"tolerance": str(tolerance), "allowed": str(allowed), **versions()}
    each = lanes // len(models)
    sweeps = []
    for i, model in enumerate(models):
        mine = jax.tree.map(lambda x: x[i * each : (i + 1) * each], found)
        sweeps.append(
            summed_up(
                speed,
                table.rolling[i * each : (i + 1) * each],
                float(PER_HOUR * model.wear.volume(1.0)),
                BearingRecord(**mine),
                block=block,
                samples=SAMPLES,
                exponents=followed > 0,
                discard=discard,
                settings=settings,
            )
        )
    return sweeps


def require_bearings(
    models: list[BearingModel], starts: Any, discard: int, revolutions: int, blocks: int, exponents: int
) -> None:
    """**Raises:** `ValueError` for what `sweep_bearings` cannot run."""
    if not models:
        raise ArgumentError("models", said="must hold at least one bearing, but it is empty.")
    for model in models:
        if model.ring.ring_motion != "dynamic":
            raise ArgumentError("model", said="must have a dynamic inner ring, but its `ring_motion` is quasi_static.")
    require_lengths(discard, revolutions, blocks)
    if exponents not in (0, 1):
        raise ArgumentError("exponents", said=f"must be 0 or 1, but {exponents} was given.")
    if isinstance(starts, int):
        if not 1 <= starts <= len(CAGE_STARTS):
            raise ArgumentError(
                "starts", said=f"must be 1 to {len(CAGE_STARTS)}, as many as a bearing has, but {starts} was given."
            )
        return
    n = models[0].bearing.n_rollers
    if not starts:
        raise ArgumentError("starts", said="must hold at least one place or state, but it is empty.")
    for start in starts:
        if isinstance(start, BearingState):
            if np.shape(start.rollers) != (5, n) or np.shape(start.bodies) != (9,):
                raise ArgumentError("starts", said=f"must hold states of a bearing with {n} rollers.")
        elif np.shape(start) != (4,) or not np.all(np.isfinite(start)) or not np.hypot(*start[:2]) < 1:
            raise ArgumentError(
                "starts", said=f"must hold places of the cage within its clearance, four numbers each, but has {start}."
            )


def _counted(progress: Progress | None, lanes: int, revolutions: int) -> Callable[[int, int], None]:
    """To be called with how many of the lanes have gone on by how many samples; it tells them as lanes done."""
    whole, done, lock = lanes * revolutions * SAMPLES, 0, threading.Lock()

    def add(some: int, samples: int) -> None:
        nonlocal done
        with lock:
            done += some * samples
            if progress is not None:
                progress(lanes * done // whole, lanes)

    return add


@eqx.filter_jit
def _laws(model: BearingModel, speeds: Float[Array, " speeds"]) -> tuple[BearingAtSpeed, BearingState]:
    def scale(speed: Array) -> BearingState:
        whole = state_scale(model, speed)
        return whole._replace(rollers=whole.rollers[:, 0])

    return jax.vmap(model.at_speed)(speeds), jax.vmap(scale)(speeds)


@eqx.filter_jit
def _starts(model: BearingModel, speeds: Float[Array, " speeds"], place: Float[Array, " 4"]) -> BearingState:
    return jax.vmap(lambda speed: rolling_start(model, speed, place=place))(speeds)


class _Table:
    """Laws, magnitudes and initial states of all lanes: designs, then speeds, then starts."""

    def __init__(self, models: list[BearingModel], speed: np.ndarray, starts: Starts):
        """**Raises:** `ValueError` for designs that differ in more than their numbers."""
        models = alike(models, "models", "bearings")
        begun = CAGE_STARTS[:starts] if isinstance(starts, int) else starts
        self.which = np.repeat(np.arange(len(models)), speed.size * len(begun))
        self.at_speed = np.tile(np.repeat(np.arange(speed.size), len(begun)), len(models))
        self.lane_speed = speed[self.at_speed]
        several = jnp.asarray(np.append(speed, 1.1 * speed[0]))  # the last one shows what depends on speed
        laws = [_laws(model, several) for model in models]
        self.at, self.scale = jax.tree.map(lambda *x: np.stack(x), *laws)  # designs, then speeds
        self.own = [len(models) > 1 or bool(x[0, 0] != x[0, -1]) for x in jax.tree.leaves(self.at)]
        self.rolling = self.at.rolling_cage_speed[self.which, self.at_speed]
        at_all = lambda x: np.broadcast_to(np.asarray(x), (speed.size, *np.shape(x)))

        def begin_with(model: BearingModel, start: BearingState | CagePlace) -> BearingState:
            if isinstance(start, BearingState):
                return jax.tree.map(at_all, start)
            return _starts(model, jnp.asarray(speed), jnp.asarray(start, dtype=float))

        rows = lambda *x: np.stack(x, axis=1).reshape(-1, *x[0].shape[1:])  # speeds, then starts
        states = [jax.tree.map(rows, *(begin_with(model, start) for start in begun)) for model in models]
        self.begin = jax.tree.map(lambda *x: np.concatenate(x), *states)

    def taken(self, lanes: np.ndarray) -> tuple[BearingAtSpeed, BearingState, BearingState]:
        """Of some lanes, lanes last."""
        which, at_speed = self.which[lanes], self.at_speed[lanes]
        leaves, tree = jax.tree.flatten(self.at)
        leaves = [x[which, at_speed] if mine else x[0, 0] for x, mine in zip(leaves, self.own, strict=True)]
        last = lambda x: jnp.asarray(np.moveaxis(x, 0, -1))
        scale = jax.tree.map(lambda x: last(x[which, at_speed]), self.scale)
        begin = jax.tree.map(lambda x: last(x[lanes]), self.begin)
        return jax.tree.unflatten(tree, [jnp.asarray(x, dtype=float) for x in leaves]), scale, begin


def _direction(begin: BearingState) -> BearingState:
    """A tangent vector in no special direction, the same in every lane."""
    numbers = np.random.default_rng(0)
    each = lambda x: jnp.asarray(np.broadcast_to(numbers.normal(size=x.shape[:-1])[..., None], x.shape).copy())
    return jax.tree.map(each, begin)


def _in_parts(revolutions: int, longest: int) -> list[int]:
    """Stretches of so many samples and a rest."""
    whole, rest = divmod(revolutions * SAMPLES, longest)
    return [longest] * whole + [rest] * (rest > 0)


def _followed(
    at: BearingAtSpeed,
    scale: BearingState,
    begin: BearingState,
    discard: int,
    blocks: list[int],
    followed: int,
    tolerance: float,
    done: Callable[[int], None],
) -> dict[str, Any]:
    """Lanes from their beginning to the end, as the fields of a `BearingRecord` with lanes first.

    Tangent vectors are followed over so many of the last blocks, and for `LEAD` revolutions before.
    """
    tight, loose = jnp.asarray(tolerance), jnp.asarray(COARSER * tolerance)
    first = len(blocks) - followed
    early = max(0, first - -(-LEAD // blocks[0])) if followed else len(blocks)
    direction = _direction(begin) if followed else None
    lead = min(discard, LEAD) if early == 0 else 0
    spacing = jnp.full((begin.bodies.shape[-1],), SPACING)
    compared, slow = comparable(at, scale), float(jnp.max(slowness(at, scale)))
    freely, tangent = LONGEST_BLOCK * SAMPLES, max(1, int(WITH_TANGENT * SAMPLES / slow**2))
    go = lambda lanes, samples, spacing=spacing: run_block(at, scale, lanes, jnp.asarray(samples), tight, spacing)
    at_once = early == 0 and lead == discard
    lanes = begin_lanes(at, scale, begin, direction if at_once else None)
    for count in _in_parts(discard - lead, freely):
        lanes, _ = go(lanes, count)
        done(count)
    if early == 0 and not at_once:
        lanes = _with_direction(at, scale, lanes, direction)
    for count in _in_parts(lead, tangent):
        lanes, _ = go(lanes, count)
        done(count)

    integrals, growths, places, errors, peaks, steps = [], [], [], [], [], []
    for i, block in enumerate(blocks):
        if 0 < early == i:
            lanes = _with_direction(at, scale, lanes, direction)
        trial, _ = run_block(at, scale, lanes, jnp.asarray(1), loose, compared)
        lanes, found = go(lanes, 1, compared)
        errors.append(np.asarray(lanes_apart(scale, trial.point, lanes.point)))
        gathered = [jax.tree.map(np.asarray, found)]
        if slow > 1:  # on to the first sample
            lanes, found = go(lanes, 1, spacing - compared)
            gathered.append(jax.tree.map(np.asarray, found))
        places.append(gathered[-1].place[:1])
        *counts, last = _in_parts(block, tangent if i >= early else freely)
        for count in (*counts, last - 1) if last > 1 else counts:
            lanes, found = go(lanes, count)
            gathered.append(jax.tree.map(np.asarray, found))
            places.append(gathered[-1].place[:count])
        integrals.append(sum(part.integrals for part in gathered))
        if i >= first:
            growths.append(sum(part.growth for part in gathered))
        peaks.append(np.max([part.peaks for part in gathered], axis=0))
        steps.append(sum(part.steps for part in gathered))
        done(block * SAMPLES)
    rollers, bodies = bearing_states(lanes)
    total = np.stack(integrals, axis=-1)  # quantities, lanes, blocks
    return {
        "integrals": dict(zip(("time", *INTEGRATED), total, strict=True)),
        "peaks": dict(zip(FOLLOWED, np.stack(peaks, axis=-1), strict=True)),
        "growth": np.stack(growths, axis=-1) if growths else np.zeros((lanes.angle.size, 1)),
        "place": np.moveaxis(np.concatenate(places), -1, 0),
        "error": np.max(errors, axis=0),
        "steps": np.sum(steps, axis=0) / sum(blocks),
        "outcome": np.asarray(lanes.outcome),
        "rollers": rollers,
        "bodies": bodies,
        "angle": np.asarray(lanes.angle),
    }


def _with_direction(
    at: BearingAtSpeed, scale: BearingState, lanes: BearingLanes, direction: BearingState | None
) -> BearingLanes:
    """The same lanes with tangent vectors."""
    rollers, bodies = bearing_states(lanes)
    last = lambda x: jnp.asarray(np.moveaxis(x, 0, -1))
    clock = jnp.stack([lanes.angle, jnp.zeros_like(lanes.angle)])
    again = begin_lanes(at, scale, BearingState(last(rollers), last(bodies), clock), direction)
    return again._replace(step=lanes.step, outcome=lanes.outcome)
