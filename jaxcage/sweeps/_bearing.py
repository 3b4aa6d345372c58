"""Sweeps of the whole bearing over shaft speeds, from several starts and for several designs."""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from ..analysis import BearingRecord, BearingSweep, summed_up
from ..integrate import (
    OUTCOMES,
    SAMPLES,
    SPACING,
    STALLED,
    alike,
    codes_of,
    comparable,
    cores,
    limits_of,
    slowness,
)
from ..models import BearingModel, BearingState, rolling_start
from ..models.whole import CAGE_STARTS, BearingAtSpeed, CagePlace, state_scale
from ..solve import INTEGRATED, WATCHED, Bearings, March
from ._lanes import Progress
from ._speed import checked_speeds, require_lengths, versions


CHUNK = 512
"""Lanes that are run at a time: their states at every sample of a block are kept until it is over."""
PER_HOUR = 1e9 * 3600
"""mm^3 an hour in 1 m^3 a second."""
LEAD = 10
"""Revolutions in which a tangent vector turns to the direction of fastest growth, before its growth counts."""
EXPONENT = 80
"""Revolutions over which the exponent is followed, if there are as many: the others take half the time."""
FINER = 1 / 32
"""A tolerance so many times as large makes steps of fifth order about half as long."""
SURE = 3.0
"""The stated error, as a multiple of the difference to the run by shorter steps."""
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
        one, is run a second time with about twice the steps; a lane that three times the difference says is off by
        more is `inaccurate`. Slow is a shaft with which that stretch would be more than 50 periods of a loaded roller's
        vibration on its raceway (NU2310 below 4000 rpm): it is 10 of them then, as neighbouring motions diverge over
        time, not over revolutions.
    - `progress`: called with lanes done and lanes in all.

    **Returns:** `BearingSweep`. A lane that fails is NaN with an outcome, and its neighbours go on: `outside` if the
    cage comes nearly to rest (below 5 % of the speed of pure rolling) or leaves its land, `max_steps_reached` if it
    needs more than 5,000 steps from sample to sample (of slow shafts as many times more as more periods go to one),
    `dt_min_reached` if its steps become too short.

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
    done = _counted(progress, lanes, discard + revolutions)
    require_at_least(1, exponent_revolutions=exponent_revolutions)
    followed = min(blocks, max(2, -(-exponent_revolutions // block))) if exponents else 0
    parts = [
        _followed(
            *table.taken(np.arange(i, min(i + CHUNK, lanes))), discard, [block] * blocks, followed, tolerance, done
        )
        for i in range(0, lanes, CHUNK)
    ]
    found = jax.tree.map(lambda *x: np.concatenate(x), *parts)
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


def _counted(progress: Progress | None, lanes: int, revolutions: int) -> Callable[[int], None]:
    """To be called with how many samples lanes have gone on by, all together; it tells them as lanes done."""
    whole, done = lanes * revolutions * SAMPLES, 0

    def add(samples: int) -> None:
        nonlocal done
        done += samples
        if progress is not None:
            progress(min(lanes * done // whole, lanes), lanes)

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
        """Laws and magnitudes of some lanes, lanes last; states, lanes first."""
        which, at_speed = self.which[lanes], self.at_speed[lanes]
        leaves, tree = jax.tree.flatten(self.at)
        leaves = [x[which, at_speed] if mine else x[0, 0] for x, mine in zip(leaves, self.own, strict=True)]
        scale = jax.tree.map(lambda x: np.moveaxis(x[which, at_speed], 0, -1), self.scale)
        begin = jax.tree.map(lambda x: np.asarray(x[lanes]), self.begin)
        return jax.tree.unflatten(tree, [np.asarray(x, dtype=float) for x in leaves]), scale, begin


class _Course:
    """Lanes on their way: their states in units of the scale, and how those ended that could not go on."""

    def __init__(self, at: BearingAtSpeed, scale: BearingState, begin: BearingState, tolerance: float):
        count = begin.bodies.shape[0]
        every = np.arange(count)
        rolling = np.broadcast_to(np.asarray(at.rolling_cage_speed, dtype=float), count)
        self.slow = np.broadcast_to(np.asarray(slowness(at, scale)), count)
        self.bearings = Bearings(at, scale, STALLED * np.abs(rolling), over_angle=True, threads=cores())
        self.state, self.limits = self.bearings.packed(every, begin), limits_of(self.slow)
        self.tolerance, self.step = tolerance, np.full(count, self.limits.first)
        self.outcome, self.tangents = np.zeros(count, dtype=np.int32), None
        self.numbers = self.bearings.units.shape[1]

    def aim(self) -> None:
        """Give every lane a tangent vector in no special direction, the same in all of them."""
        direction = np.random.default_rng(0).normal(size=self.numbers)
        self.tangents = np.tile(direction, (len(self.state), 1))

    @property
    def alive(self) -> Int[np.ndarray, " some"]:
        """Lanes that go on."""
        return np.flatnonzero(self.outcome == 0)

    def go(self, strobes: int, keep: int, done: Callable[[int], None]) -> March | None:
        """All lanes that can over so many samples; None where there are none."""
        some, count = self.alive, 0
        if not some.size:
            return None

        def tell(lanes: int) -> None:
            nonlocal count
            done((lanes - count) * strobes)
            count = lanes

        given = None if self.tangents is None else self.tangents[some]
        ran = self.bearings.run(
            some, self.state[some], SPACING, strobes, keep, self.tolerance, self.limits,
            step=self.step[some], tangents=given, report=tell,
        )  # fmt: skip
        self.state[some], self.step[some] = ran.state, ran.step
        if self.tangents is not None:
            self.tangents[some] = ran.tangents[:, 0]
        self.outcome[some] = codes_of(ran.mark)
        return ran

    def apart(self) -> Float[np.ndarray, " lanes"]:
        """Error of a stretch from here, from the same by shorter steps, in units of the scale; 0 of lost lanes."""
        some, error = self.alive, np.zeros(len(self.state))
        if some.size:
            stretch = comparable(self.slow)[some]
            once = lambda tolerance: self.bearings.run(
                some, self.state[some], stretch, 1, 1, tolerance, self.limits, step=self.step[some]
            ).state[:, : self.numbers]
            error[some] = SURE * np.max(np.abs(once(self.tolerance) - once(FINER * self.tolerance)), axis=1)
        return error


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
    course = _Course(at, scale, begin, tolerance)
    lanes, dim = len(course.state), course.numbers
    first = len(blocks) - followed
    early = max(0, first - -(-LEAD // blocks[0])) if followed else len(blocks)
    lead = min(discard, LEAD) if early == 0 else 0
    if discard > lead:
        course.go((discard - lead) * SAMPLES, 1, done)
    if early == 0:
        course.aim()
    if lead:
        course.go(lead * SAMPLES, 1, done)
    per_clearance = np.broadcast_to(np.asarray(at.guide.land.per_clearance, dtype=float), lanes)
    integrals, growths, places, errors, peaks, steps = [], [], [], [], [], []
    for i, block in enumerate(blocks):
        if 0 < early == i:
            course.aim()
        errors.append(course.apart())
        some, before, samples = course.alive, course.state[:, dim + 1 :].copy(), block * SAMPLES
        ran = course.go(samples, samples, done)
        place, peak = np.full((lanes, samples, 2), np.nan), np.full((lanes, len(WATCHED)), np.nan)
        growth, tried = np.full(lanes, np.nan), np.full(lanes, np.nan)
        if ran is not None:
            _, bodies, *_ = course.bearings.unpacked(some, ran.strobe[..., : -len(WATCHED)])
            centre = bodies[..., :2] - bodies[..., 5:7] if at.inner_guided else bodies[..., :2]
            place[some] = centre * per_clearance[some, None, None]
            peak[some] = np.max(ran.strobe[..., -len(WATCHED) :], axis=1)
            growth[some] = ran.growth.sum(axis=(1, 2)) if course.tangents is not None else 0.0
            tried[some] = ran.steps
        integrals.append((course.state[:, dim + 1 :] - before).T)
        if i >= first:
            growths.append(growth)
        places.append(place)
        peaks.append(peak[:, 1:].T)
        steps.append(tried)
    rollers, bodies, clock, _ = course.bearings.unpacked(np.arange(lanes), course.state)
    total = np.stack(integrals, axis=-1)  # quantities, lanes, blocks
    return {
        "integrals": dict(zip(("time", *INTEGRATED), total, strict=True)),
        "peaks": dict(zip(WATCHED[1:], np.stack(peaks, axis=-1), strict=True)),
        "growth": np.stack(growths, axis=-1) if growths else np.zeros((lanes, 1)),
        "place": np.concatenate(places, axis=1),
        "error": np.max(errors, axis=0),
        "steps": np.sum(steps, axis=0) / sum(blocks),
        "outcome": course.outcome,
        "rollers": rollers,
        "bodies": bodies,
        "angle": clock[:, 0],
    }
