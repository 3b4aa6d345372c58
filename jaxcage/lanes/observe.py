"""Integration of lanes with observations: strobe states, growth of tangents (Lyapunov exponents), integrals, errors.

The results of a lane depend neither on the other lanes nor on the number of threads. Lanes are the first axis of all
arrays.
"""

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..analysis import scatter
from ..models import ESCAPE, AbstractForcedSystem
from ..solve import (
    IMPLICIT,
    INACCURATE,
    NOT_FINITE,
    OUTSIDE,
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
    cores,
    errors_of_parts,
)
from .settings import Run


CHECKED = 8
"""Number of revolutions at the end of each lane that are run again to measure their error."""
FURTHER = 4
"""Number of revolutions beyond the end of a run for measuring the error of its exponents."""
CHUNK = 4096
"""Number of lanes run at a time; an eighth for models with several samples per revolution."""
LEAD = 10
"""Number of revolutions in which tangent vectors align, if exponents are followed for a part of the run."""
Progress = Callable[[int, int], None]
"""Function called with the numbers of finished lanes and of all lanes."""


class Observation(NamedTuple):
    """Results of lanes; those of a lane that failed are NaN, with an outcome."""

    outcome: Int[np.ndarray, " lanes"]
    """Index into `OUTCOMES` of how each lane ended."""
    last: Float[np.ndarray, "lanes dim"]
    """State at the end of the run [SI]."""
    strobe: Float[np.ndarray, "lanes keep dim"]
    """The last strobe states [SI]."""
    growth: Float[np.ndarray, "lanes followed exponents"]
    """Mean logarithmic growth of tangent vectors per revolution in each block."""
    peak: Float[np.ndarray, " lanes"]
    """Largest excursion while observed, or while tangent vectors align before; for a cage the eccentricity ratio."""
    error: Float[np.ndarray, " lanes"]
    """Largest error of a revolution, in units of the scale."""
    doubt: Float[np.ndarray, "lanes exponents"]
    """Error of the exponents per revolution that blocks do not show: of the integration, of oscillations in a block."""
    steps: Float[np.ndarray, " lanes"]
    """Mean number of steps in an observed revolution."""
    integrals: Float[np.ndarray, "lanes blocks beside"]
    """Integrals over each block of the model's additional integrands."""
    largest: Float[np.ndarray, "lanes blocks watched"]
    """Maximum in each block of the quantities that the model watches, without the excursion."""
    place: Float[np.ndarray, "lanes samples 2"]
    """Position of the cage centre relative to its land, over the clearance, at each sample; only for models with
    averages."""

    @classmethod
    def pending(cls, model: AbstractForcedSystem, run: Run, count: int) -> "Observation":
        """Results of lanes that have not been run: NaN, with the outcome of a failure."""
        dim, beside = model.dimension, len(model.beside)
        shapes: dict[str, tuple[int, ...]] = {"last": (dim,), "strobe": (run.keep, dim), "doubt": (run.exponents,)}
        shapes |= {"growth": (run.followed, run.exponents), "integrals": (run.blocks, beside)}
        shapes |= {"largest": (run.blocks, len(model.watched) - 1)}
        shapes |= {"place": (run.revolutions * model.samples if beside else 0, 2)}
        numbers = (np.full((count, *shapes.get(name, ())), np.nan) for name in cls._fields[1:])
        return cls(np.full(count, NOT_FINITE, dtype=np.int32), *numbers)

    def put(self, lanes: Int[np.ndarray, " some"], new: "Observation") -> None:
        """Replace the results of some lanes."""
        for mine, theirs in zip(self, new, strict=True):
            mine[lanes] = theirs

    def at(self, lanes: Any) -> "Observation":
        return Observation(*(x[lanes] for x in self))


def observe(
    lanes: Lanes,
    run: Run,
    states: Float[np.ndarray, "lanes dim"],
    progress: Progress | None = None,
    *,
    method: AbstractMethod | None = None,
    onward: bool = False,
) -> Observation:
    """Run lanes from given states.

    **Arguments:** lanes; settings; states [SI]; function that reports progress; method, by default that of the
    settings; `onward`, True if the states are those at the end of another run, which may be farther out than initial
    states.
    """
    count, each = lanes.speed.size, max(run.discard + run.revolutions, 1)
    chosen, limit = run.method if method is None else method, ESCAPE if onward else 1.0
    size = max(1, CHUNK // (1 if lanes.system.samples == 1 else 8))
    parts = []
    for some in np.split(np.arange(count), range(size, count, size)):

        def report(revolutions: float, first: int = int(some[0]), last: int = int(some[-1]) + 1) -> None:
            if progress is not None:
                progress(min(first + int(revolutions / each + 1e-9), last), count)

        parts.append(_allowed(_Observer(lanes.at(some), run, states[some], limit, report), chosen))
    return Observation(*map(np.concatenate, zip(*parts, strict=True)))


def _allowed(observer: "_Observer", method: AbstractMethod) -> Observation:
    """Observe lanes; repeat those with too large an error with smaller tolerances, and those with too many or too short
    steps by an implicit method."""
    seen = observer.once(method, np.arange(observer.lanes.speed.size))
    large = lambda: (seen.error > method.allowed) & (seen.outcome == 0)  # `allowed` of the method requested

    def again(chosen: AbstractMethod, lanes: np.ndarray) -> None:
        if np.any(lanes):
            seen.put(np.flatnonzero(lanes), observer.once(chosen, np.flatnonzero(lanes)))

    if not observer.averages:
        implicit = [method.implicit] if isinstance(method, NativeSteps) and method.pair != IMPLICIT else []
        for chosen in [method, *implicit]:
            if chosen is not method:
                again(chosen, np.isin(seen.outcome, (STUCK, TOO_MANY)) | large())
            for retry in range(1, RETRIES + 1):
                again(chosen.finer(retry), large())
    seen.outcome[large()] = INACCURATE
    lost = seen.outcome != 0
    if observer.averages:  # the means of inaccurate lanes are reported, with their error
        lost &= seen.outcome != INACCURATE
    for values in (seen.strobe, seen.growth, seen.last, seen.integrals, seen.largest, seen.place):
        values[lost] = np.nan
    return seen


@dataclasses.dataclass
class _Observer:
    """Lanes with their settings and initial states."""

    lanes: Lanes
    run: Run
    states: Float[np.ndarray, "lanes dim"]
    limit: float
    """Largest excursion of an initial state."""
    report: Callable[[float], None]
    done: int = 0
    """Number of revolutions done, summed over lanes."""

    def __post_init__(self):
        self.model = self.lanes.system
        self.averages = len(self.model.beside) > 0

    def _segments(self) -> list[tuple[int, int, bool]]:
        """First and last revolution of each part of the run, and True if tangent vectors are followed in it."""
        run, end = self.run, self.run.discard + self.run.revolutions
        pushed = end
        if run.exponents:
            pushed = max(end - run.followed * run.block - (LEAD if self.averages else run.block), 0)
            pushed -= (pushed - run.discard) % run.block if self.averages and pushed > run.discard else 0
        cuts = {0, end, pushed if run.exponents else run.discard}
        if self.averages:
            cuts |= {run.discard, *range(run.discard, end, run.block)}
        elif pushed > run.discard:
            cuts |= {run.discard}
        return [(a, b, a >= pushed) for a, b in itertools.pairwise(sorted(cuts))]

    def once(self, method: AbstractMethod, some: Int[np.ndarray, " some"]) -> Observation:
        """Observe some lanes by one method."""
        run, model, y0 = self.run, self.model, self.states[some]
        count, dim, samples, end = some.size, model.dimension, model.samples, run.discard + run.revolutions
        state = self.lanes.completed(y0)
        units, excursion = self.lanes.begin(some, state)
        scale, state = units[:, :dim], state / units
        found = Observation.pending(model, run, count)
        outcome, error, steps, peak = found.outcome, found.error, found.steps, found.peak
        outcome[:] = np.where(excursion <= self.limit, 0, OUTSIDE)
        outcome[~np.all(np.isfinite(y0), axis=1)] = NOT_FINITE
        error[:] = steps[:] = found.doubt[:] = 0.0
        step, growth = np.full(count, np.nan), np.full((count, run.followed * run.block, run.exponents), np.nan)
        tangents = np.tile(start_tangents(dim, run.exponents), (count, 1, 1))
        alive = np.flatnonzero(outcome == 0)
        for begin, stop, pushed in self._segments():
            alive = alive[outcome[alive] == 0]
            if not alive.size:
                break
            plain = self.lanes.engine(0, method, samples)
            engine = self.lanes.engine(run.exponents, method, samples) if pushed else plain
            lanes = self.lanes.at(some[alive])
            seen = stop == end or begin >= run.discard
            if begin == 0 or (self.averages and seen):
                error[alive] = np.maximum(error[alive], self._error(plain, some[alive], state[alive, None], method))
            strobes = (stop - begin) * samples
            held = strobes if self.averages else max(run.keep, min(CHECKED + 1, strobes))
            before, (_, begun) = state[alive], self.lanes.begin(some[alive], (state * units)[alive])
            report = lambda lanes, length=stop - begin: self.report(self.done + lanes * length)
            more = {"tangents": tangents[alive]} if pushed and run.exponents else {}
            more |= {"step": step[alive], "threads": cores(), "report": report}
            ran = engine(lanes, before, strobes, held if seen else 1, method, **more)
            self.done += alive.size * (stop - begin)
            state[alive], step[alive], outcome[alive] = ran.state, ran.step, ran.outcome
            if pushed and run.exponents:
                tangents[alive] = ran.tangents
                each = ran.growth.reshape(alive.size, stop - begin, samples, run.exponents).sum(axis=2)
                first = end - run.followed * run.block
                if stop > first:
                    growth[alive, max(begin - first, 0) : stop - first] = each[:, max(first - begin, 0) :]
            if not seen:
                continue
            steps[alive] += ran.steps / (stop - begin) * (stop - max(begin, run.discard)) / run.revolutions
            if self.averages:
                block = (begin - run.discard) // run.block
                found.integrals[alive, block] = ran.state[:, dim:] - before[:, dim:]
                found.largest[alive, block] = ran.peaks[..., 1:].max(axis=1)
                peak[alive] = np.fmax(peak[alive], ran.peaks[..., -1].max(axis=1))
                recorded = ran.strobe[..., :dim] * scale[alive, None, :]
                part = slice(block * strobes, (block + 1) * strobes)
                found.place[alive, part] = self.lanes.each(_centres, some[alive], recorded)
                continue
            latest = ran.strobe[:, -min(run.keep, strobes) :] * scale[alive, None, :]
            found.strobe[alive] = np.concatenate([found.strobe[alive], latest], axis=1)[:, -run.keep :]
            peak[alive] = np.fmax(peak[alive], np.maximum(ran.peak, begun))
            if pushed and run.exponents:
                found.doubt[alive] = self._doubt(engine, lanes, ran, method)
            if held > 1:
                last_ones = ran.strobe[:, -(CHECKED + 1) :]
                error[alive] = np.maximum(error[alive], self._error(plain, some[alive], last_ones, method))
        growth = growth.reshape(count, run.followed, run.block, run.exponents)
        found.growth[:] = growth.mean(axis=2)
        # Half the range of an oscillation is left in the mean, also where all blocks hold equally many of its periods.
        summed = np.cumsum(growth - found.growth.mean(axis=1)[:, None, None], axis=2)
        left = np.ptp(summed, axis=2).mean(axis=1) / (2 * run.followed * run.block)
        found.doubt[:] = np.hypot(found.doubt, np.where(left > scatter(found.growth, axis=1), left, 0.0))
        found.last[outcome == 0] = (state[:, :dim] * scale)[outcome == 0]
        return found

    @staticmethod
    def _doubt(
        engine: Engine | JaxEngine, lanes: Lanes, ran: March, method: AbstractMethod
    ) -> Float[np.ndarray, "some exponents"]:
        """Integration error of the exponents per revolution: three times the difference of the mean growth over a few
        further revolutions from that by the method's reference."""
        options: dict[str, Any] = dict(tangents=ran.tangents, step=ran.step, threads=cores())
        further = lambda chosen: engine(lanes, ran.state, FURTHER, 1, chosen, **options).growth.mean(axis=1)
        return SURE * np.abs(further(method) - further(method.reference))

    def _error(
        self,
        engine: Engine | JaxEngine,
        some: Int[np.ndarray, " some"],
        states: Float[np.ndarray, "some held numbers"],
        method: AbstractMethod,
    ) -> Float[np.ndarray, " some"]:
        """Largest error of the stretches between states: three times the distance of their ends from those by the
        method's reference, and at least the tolerance, which protects against accidental agreement.

        A stretch is a revolution, or as much of one as two runs can be compared over; for a single state it is the
        stretch that follows.
        """
        lanes, more = self.lanes.at(some), {}
        if self.averages:
            more["turn"] = np.array([self.model.comparable(speed) for speed in self.lanes.speed[some].tolist()])
        if states.shape[1] == 1:
            ends = engine(lanes, states[:, 0], 1, 1, method, threads=cores(), **more).state
            states = np.stack([states[:, 0], ends], axis=1)
        apart = errors_of_parts(engine, lanes, states, method, **more)
        return np.maximum(np.max(np.nan_to_num(apart, posinf=np.inf), axis=1), getattr(method, "tolerance", 0.0))


def centres_of(
    model: AbstractForcedSystem, speed: Float[np.ndarray, " n"], states: Float[np.ndarray, "n dim"]
) -> Float[np.ndarray, "n 2"]:
    """Position of the cage centre relative to its land, over the clearance, at states of a model."""
    return Lanes.of([model], speed).each(_centres, np.arange(speed.size), states[:, None])[:, 0]


def _centres(model: Any, speed: Array, states: Array) -> Array:
    return jax.vmap(lambda y: jnp.stack(model.centre(y if model.beside else tuple(y))))(states)


def start_tangents(dimension: int, exponents: int) -> Float[np.ndarray, "exponents dim"]:
    """Orthonormal initial tangent vectors without zero components, so that none is orthogonal to a coordinate axis."""
    i, d = np.arange(exponents)[:, None], np.arange(dimension)
    return np.linalg.qr(np.cos((i + 1.0) * (d + 1) * 1.234 + d).T)[0].T
