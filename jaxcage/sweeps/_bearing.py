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
from ..models import (
    CAGE_STARTS,
    INTEGRATED,
    OF_BODIES,
    WATCHED,
    BearingModel,
    BearingState,
    CagePlace,
    bodies_of,
    rollers_of,
    rolling_start,
)
from ..solve import OUTCOMES, Lanes, March, alike, codes_of, cores, native
from ._lanes import Progress
from ._speed import checked_speeds, require_lengths, versions


SAMPLES = 16
"""Strobe states of a revolution."""
CHUNK = 512
"""Lanes that are run at a time: their states at every sample of a block are kept until it is over."""
PER_HOUR = 1e9 * 3600
"""mm^3 an hour in 1 m^3 a second."""
LEAD = 10
"""Revolutions in which a tangent vector turns to the direction of fastest growth, before its growth counts."""
EXPONENT = 80
"""Revolutions over which the exponent is followed, if there are as many: the others take half the time."""
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
    - `tolerance`: largest estimated error of a step, in units of `jaxcage.models.state_scale`.
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
    begin = _initial_states(alike(models, "models", "bearings"), speed, starts)
    lanes, block = len(begin), revolutions // blocks
    each = lanes // len(models)
    lane_speed = np.tile(np.repeat(speed, each // speed.size), len(models))
    table = Lanes.of(models, lane_speed, np.repeat(np.arange(len(models)), each))
    done = _counted(progress, lanes, discard + revolutions)
    require_at_least(1, exponent_revolutions=exponent_revolutions)
    followed = min(blocks, max(2, -(-exponent_revolutions // block))) if exponents else 0
    parts = []
    for i in range(0, lanes, CHUNK):
        some = np.arange(i, min(i + CHUNK, lanes))
        parts.append(_followed(table.at(some), begin[some], discard, [block] * blocks, followed, tolerance, done))
    found = jax.tree.map(lambda *x: np.concatenate(x), *parts)
    found["outcome"] = np.where(
        (found["outcome"] == 0) & ~(found["error"] <= allowed), OUTCOMES.index("inaccurate"), found["outcome"]
    )
    settings = {"tolerance": str(tolerance), "allowed": str(allowed), **versions()}
    sweeps = []
    for i, model in enumerate(models):
        mine = jax.tree.map(lambda x: x[i * each : (i + 1) * each], found)
        sweeps.append(
            summed_up(
                speed,
                np.repeat([float(model.rolling_cage_speed(v)) for v in speed.tolist()], each // speed.size),
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


def _initial_states(
    models: list[BearingModel], speed: np.ndarray, starts: Starts
) -> Float[np.ndarray, "lanes numbers"]:
    """States of all lanes with the quantities beside them: designs, then speeds, then starts."""
    begun = CAGE_STARTS[:starts] if isinstance(starts, int) else starts
    rest = np.array(models[0].beside_start)

    def begin_with(model: BearingModel, start: BearingState | CagePlace) -> np.ndarray:
        beside = np.tile(rest, (speed.size, 1))
        if isinstance(start, BearingState):
            beside[:, :2] = np.asarray(start.clock)
            rows = np.tile(np.asarray(start.row), (speed.size, 1))
        else:
            rows = np.asarray(_starts(model, jnp.asarray(speed), jnp.asarray(start, dtype=float)))
        return np.concatenate([rows, beside], axis=1)

    states = [np.stack([begin_with(model, start) for start in begun], axis=1) for model in models]
    return np.stack(states).reshape(-1, states[0].shape[-1])


@eqx.filter_jit
def _starts(model: BearingModel, speeds: Float[Array, " speeds"], place: Float[Array, " 4"]) -> Array:
    return jax.vmap(lambda speed: rolling_start(model, speed, place=place).row)(speeds)


class _Course:
    """Lanes in units of the scale, and how those ended that failed."""

    def __init__(self, lanes: Lanes, begin: Float[np.ndarray, "lanes numbers"], tolerance: float):
        count, self.every = len(begin), np.arange(len(begin))
        self.lanes, self.method = lanes, native(tolerance)
        self.scale, _ = lanes.begin(self.every, begin)
        self.state, self.step = begin / self.scale, np.full(count, np.nan)
        model, speeds = lanes.system, np.unique(lanes.speed)
        each = np.array([model.comparable(speed) for speed in speeds])
        self.comparable = each[np.searchsorted(speeds, lanes.speed)]
        self.outcome, self.tangents = np.zeros(count, dtype=np.int32), None
        self.numbers = model.dimension

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

        given = None if self.tangents is None else self.tangents[some, None]
        engine = self.lanes.engine(0 if given is None else 1, self.method, SAMPLES)
        ran = engine(
            self.lanes.numbers(engine, some), self.state[some], strobes, keep, self.method,
            step=self.step[some], tangents=given, threads=cores(), report=tell,
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
            engine = self.lanes.engine(0, self.method, SAMPLES)
            given = self.lanes.numbers(engine, some), self.state[some], 1, 1
            options: Any = dict(turn=self.comparable[some], step=self.step[some], threads=cores())
            once = lambda method: engine(*given, method, **options).state[:, : self.numbers]
            error[some] = SURE * np.max(np.abs(once(self.method) - once(self.method.reference)), axis=1)
        return error


def _followed(
    lanes_of: Lanes,
    begin: Float[np.ndarray, "lanes numbers"],
    discard: int,
    blocks: list[int],
    followed: int,
    tolerance: float,
    done: Callable[[int], None],
) -> dict[str, Any]:
    """Lanes from their beginning to the end, as the fields of a `BearingRecord` with lanes first.

    Tangent vectors are followed over so many of the last blocks, and for `LEAD` revolutions before.
    """
    course = _Course(lanes_of, begin, tolerance)
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
            bodies = bodies_of(ran.strobe[..., :dim] * course.scale[some, None, :dim])
            clearance = course.scale[some, None, dim - OF_BODIES, None]
            centre = bodies[..., :2] - bodies[..., 5:7] if lanes_of.system.guidance == "inner" else bodies[..., :2]
            place[some] = centre / clearance
            peak[some] = np.max(ran.peaks, axis=1)
            growth[some] = ran.growth.sum(axis=(1, 2)) if course.tangents is not None else 0.0
            tried[some] = ran.steps
        integrals.append((course.state[:, dim + 1 :] - before).T)
        if i >= first:
            growths.append(growth)
        places.append(place)
        peaks.append(peak[:, 1:].T)
        steps.append(tried)
    last = course.state * course.scale
    total = np.stack(integrals, axis=-1)  # quantities, lanes, blocks
    return {
        "integrals": dict(zip(("time", *INTEGRATED), total, strict=True)),
        "peaks": dict(zip(WATCHED[1:], np.stack(peaks, axis=-1), strict=True)),
        "growth": np.stack(growths, axis=-1) if growths else np.zeros((lanes, 1)),
        "place": np.concatenate(places, axis=1),
        "error": np.max(errors, axis=0),
        "steps": np.sum(steps, axis=0) / sum(blocks),
        "outcome": course.outcome,
        "rollers": rollers_of(last[:, :dim]),
        "bodies": bodies_of(last[:, :dim]),
        "angle": last[:, dim],
    }
