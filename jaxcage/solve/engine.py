"""The engine: integration of many lanes, each a design at a speed, from strobe state to strobe state.

`engine_of` makes the engine of a model: `Engine` in machine code or, for methods and laws without machine code,
`JaxEngine`, a loop inside JAX. Both take and return the same arrays.
"""

import concurrent.futures
import copy
import ctypes
import functools
import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._errors import ArgumentError
from .._pytrees import Form, compiled, split
from ..models import AbstractForcedSystem, divide, multiply
from .fields import numbers_at, shape_of_numbers, traced_field
from .ir import UnknownOperation, say_once
from .layout import REVOLUTION, Tableau, layout_of
from .loop import march_ir
from .method import IMPLICIT, AbstractMethod, FixedSteps, NativeSteps
from .object_code import function
from .outcomes import FINISHED, March
from .strobe_map import StrobeMap


WIDTH = 8
"""Number of lanes per vector."""
MOST_AT = 1e-6
"""Smallest tolerance for which a model's maximum number of steps holds; smaller tolerances are allowed more steps."""
LARGEST_WRITTEN_OUT = 64
"""Largest dimension for which implicit steps, with an unrolled linear solve, are compiled to machine code."""
WAKES = 0.1
"""Interval between checks of running threads [s]."""
SURE = 3.0
"""Safety factor: the stated error over the difference of two runs."""
RETRIES = 3
"""Maximum number of times that a lane with too large an error is run again, each with a 16 times smaller tolerance."""
TOGETHER = 64
"""Maximum number of lanes per call of the engine inside JAX."""
CHUNK = 4096
"""Number of strobe states of a revolution, of all lanes together, that are computed at a time."""


class LaneNumbers(NamedTuple):
    """The numbers of a field in each lane."""

    wide: Float[np.ndarray, "wide lanes"]
    """Numbers that differ from lane to lane."""
    shared: Float[np.ndarray, " shared"]
    slow: Float[np.ndarray, " lanes"]
    """Factor on the maximum number of steps (`AbstractForcedSystem.slowness`)."""


class Engine:
    """The compiled integration loop of a model, with a number of tangent vectors."""

    def __init__(
        self,
        system: AbstractForcedSystem,
        tangents: int = 0,
        several: bool = False,
        pair: str = "tsit5",
        samples: int = 1,
    ):
        """Compile the loop.

        **Arguments:** model; number of tangent vectors; `several`, True if lanes have different designs; method, by its
        name in `PAIRS`; strobe states per revolution.

        **Raises:** `UnknownOperation` for a law with an operation that has no translation, or arrays of numbers.
        """
        tableau = Tableau.named(pair)
        self._samples, self._pair, self._order = samples, pair, tableau.order
        form, self._wide = shape_of_numbers(system, several)
        self.field = traced_field(system, form, self._wide, tangents, samples > 1, tableau.implicit)
        self._rows = layout_of(self.field, len(tableau.phase))
        longest = min(system.steps.longest, REVOLUTION / (2 * system.harmonics))
        self._limits, self._compiled = system.steps._replace(longest=longest), functools.cache(self._march_of)
        self._compiled(WIDTH)

    def _march_of(self, width: int) -> Any:
        """The compiled loop for vectors of `width` lanes."""
        whole, place = ctypes.c_int64, ctypes.c_void_p
        kind = ctypes.CFUNCTYPE(None, place, whole, whole, whole, *[place] * 6)
        return kind(function(march_ir(self.field, self._pair, width), "march"))

    def numbers(self, lanes: "Lanes") -> LaneNumbers:
        found, slow = lanes.each(numbers_at, np.arange(lanes.speed.size))
        wide = np.array([x for x, w in zip(found, self._wide, strict=True) if w])
        shared = np.array([x[0] for x, w in zip(found, self._wide, strict=True) if not w], dtype=float)
        return LaneNumbers(wide.reshape(-1, lanes.speed.size), shared, slow)

    def __call__(
        self,
        lanes: "Lanes",
        state: Float[np.ndarray, "lanes numbers"],
        strobes: int,
        keep: int,
        method: Any,
        *,
        begin: Any = 0,
        turn: Any = None,
        tangents: Float[np.ndarray, "lanes tangents dim"] | None = None,
        step: Float[np.ndarray, " lanes"] | float | None = None,
        threads: int = 1,
        report: Callable[[float], None] = lambda done: None,
    ) -> March:
        """Run lanes from states in units of their scales, followed by the values of additional integrands.

        **Arguments:** lanes; states; number of strobe states to run, and to keep; a method with a
        tolerance; `begin`, index of the first state among the samples of a revolution; `turn`, phase from strobe to
        strobe if it is not a revolution over its samples; tangent vectors in units of the scale; first step, NaN for
        the default; number of threads; function called with the work done, in lanes. `begin`, `turn` and `step`
        hold for all lanes or are arrays over lanes.
        """
        numbers, count, field, rows = lanes.numbers(self), len(state), self.field, self._rows
        n, moving = field.dimension, field.moving
        limits, more = self._limits, max(1.0, MOST_AT / method.tolerance) ** (1 / self._order)
        loaded = np.zeros((rows["first_step"].stop, count))
        loaded[:n], loaded[moving - field.beside : moving] = state[:, :n].T, state[:, n:].T
        if field.tangents:
            assert tangents is not None
            loaded[n : moving - field.beside] = tangents.reshape(count, -1).T
        given = np.broadcast_to(np.nan if step is None else step, count)
        loaded[rows["step"][0]] = np.where(np.isnan(given), limits.first, given)
        loaded[rows["most"][0]] = limits.most * numbers.slow * more
        loaded[rows["peak"]] = 0.0 if field.excursion is not None else -np.inf
        loaded[rows["turn"][0]], loaded[rows["begin"][0]] = REVOLUTION / self._samples if turn is None else turn, begin
        loaded[rows["fixed"].start : rows["fixed"].stop] = numbers.wide
        stored = np.zeros((rows["mark"].stop, count))
        strobe = np.full((count, keep, field.recorded), np.nan)
        growth = np.full((count, strobes, field.tangents), np.nan)
        queue = np.zeros(3, dtype=np.int64)
        settings = np.array([method.tolerance, limits.longest, limits.shortest])
        arrays = (queue, settings, np.append(numbers.shared, 0.0), loaded, stored, strobe, growth)
        at = [x.ctypes.data for x in arrays]
        # For a large law a vector of one lane is faster than a vector of eight with a single lane in it.
        width = 1 if field.excursion is None and count == 1 else WIDTH
        march = self._compiled(width)
        run = lambda: march(at[0], count, strobes, keep, *at[1:])
        if count == 1 and strobes <= self._samples:  # shorter than the start of a thread
            run()
        else:
            _run_threads(run, min(threads, -(-count // width)), queue, lambda: report(int(queue[2]) / strobes))
        part = lambda name: stored[rows[name][0]]
        turned = np.roll(strobe, -strobes % keep, axis=1)  # the latest last
        numbers_of, peaks = n + field.beside, part("peak")[:, None, None]
        if field.recorded > numbers_of:
            peaks = turned[..., numbers_of:]
        with np.errstate(divide="ignore"):
            grown = 0.5 * np.log(growth)
        end = np.concatenate([stored[:n], stored[moving - field.beside : moving]])
        return March(
            state=end.T.copy(),
            tangents=stored[n : moving - field.beside].T.reshape(count, field.tangents, n),
            step=part("step"),
            peaks=peaks,
            steps=part("steps"),
            outcome=part("mark").astype(int) - 1,
            strobe=turned[..., :numbers_of],
            growth=grown,
        )


def _run_threads(run: Callable[[], None], count: int, queue: np.ndarray, report: Callable[[], None]) -> None:
    """Run `run` in `count` threads; an exception, also one of `report`, sets the flag in `queue`, which stops them."""
    with concurrent.futures.ThreadPoolExecutor(count) as pool:
        try:
            left = {pool.submit(run) for _ in range(count)}
            while left:
                left = concurrent.futures.wait(left, WAKES).not_done
                report()
        except BaseException:
            queue[1] = 1
            raise


class _Advance(eqx.Module):
    """Advance of a lane from the i-th to the next strobe state of a revolution, in units of its scale."""

    method: AbstractMethod
    samples: int

    def __call__(self, system: AbstractForcedSystem, speed: Array, y: Array, tangents: Array, i: Array) -> Any:
        scale = system.scale(speed)
        state, row = lambda z: multiply(tuple(z), scale), lambda z: jnp.stack(divide(z, scale))
        strobe = StrobeMap(system.at_speed(speed), system, scale, self.method)
        moved = strobe.part(state(y), i, self.samples, [(state(t), None) for t in tangents])
        after = jnp.stack([row(t) for t in moved.tangents]) if moved.tangents else tangents
        return row(moved.y), after, moved.peak, moved.outcome


def _orthonormalised(
    tangents: Float[np.ndarray, "lanes tangents dim"],
) -> tuple[Float[np.ndarray, "lanes tangents dim"], Float[np.ndarray, "lanes tangents"]]:
    """Orthonormal tangent vectors, and the logarithms of the lengths that remain after each is projected.

    Gram-Schmidt with two projections: where a vector has nearly turned into those before it, its remaining length is
    several times more accurate than by Householder reflections. A length of zero is replaced by the rounding error.
    """
    done, lengths = np.zeros_like(tangents), np.zeros(tangents.shape[:2])
    for i in range(tangents.shape[1]):
        u = tangents[:, i]
        least = np.finfo(float).eps * np.linalg.norm(u, axis=1) + np.finfo(float).tiny
        for j in [*range(i)] * 2:
            u = u - np.sum(u * done[:, j], axis=1, keepdims=True) * done[:, j]
        lengths[:, i] = np.linalg.norm(u, axis=1)
        lost = lengths[:, i] == 0
        u, lengths[lost, i] = np.where(lost[:, None], least[:, None], u), least[lost]
        done[:, i] = u / np.linalg.norm(u, axis=1, keepdims=True)
    return done, np.log(lengths)


class JaxEngine:
    """Integration loop inside JAX, called like `Engine`.

    **Arguments:** number of tangent vectors; strobe states per revolution.
    """

    def __init__(self, tangents: int, samples: int):
        self._tangents, self._samples = tangents, samples

    def __call__(
        self,
        lanes: "Lanes",
        state: Float[np.ndarray, "lanes numbers"],
        strobes: int,
        keep: int,
        method: AbstractMethod,
        *,
        begin: Any = 0,
        tangents: Float[np.ndarray, "lanes tangents dim"] | None = None,
        step: Any = None,
        threads: int = 1,
        report: Callable[[float], None] = lambda done: None,
    ) -> March:
        """Run lanes like `Engine`, but with the first step chosen by the solver."""
        (count, dim), y, m = state.shape, state.copy(), self._tangents
        t = np.zeros((count, 0, dim)) if tangents is None else tangents.copy()
        strobe, growth = np.full((count, keep, dim), np.nan), np.full((count, strobes, m), np.nan)
        outcome, peaks = np.full(count, FINISHED), np.zeros(count)
        first, advance = np.broadcast_to(begin, count), _Advance(method.in_jax, self._samples)
        with concurrent.futures.ThreadPoolExecutor(threads) as pool:
            for k in range(strobes):
                alive = np.flatnonzero(outcome == FINISHED)
                if not alive.size:
                    break
                i = (first + k) % self._samples
                chunk = lambda some, i=i: lanes.each(advance, some, y[some], t[some], i[some])
                found = pool.map(chunk, np.split(alive, range(TOGETHER, alive.size, TOGETHER)))
                y1, t1, peak, outcome[alive] = (np.concatenate(x) for x in zip(*found, strict=True))
                peaks[alive] = np.maximum(peaks[alive], peak)
                well = outcome[alive] == FINISHED
                alive, y1, t1 = alive[well], y1[well], t1[well]
                y[alive], strobe[alive, k % keep] = y1, y1
                if m and alive.size:
                    t[alive], growth[alive, k] = _orthonormalised(t1)
                report(count * (k + 1) / strobes)
        latest_last, none = np.roll(strobe, -strobes % keep, axis=1), np.zeros(count)
        return March(y, t, none, peaks[:, None, None], none, outcome, latest_last, growth)


_engines: dict[Any, Engine | JaxEngine] = {}


def engine_of(
    system: AbstractForcedSystem, tangents: int, several: bool, method: AbstractMethod, samples: int = 1
) -> Engine | JaxEngine:
    """Cached engine of a model and a method, with arguments as for `Engine`; it warns of an operation without machine
    code."""
    pair = method.pair if isinstance(method, NativeSteps) else None
    if pair == IMPLICIT and not has_implicit(system):
        pair = None
    if system.beside and pair is None:
        raise ArgumentError("method", said="must be `native`, with an explicit pair, for this model.")
    key = (split(system, eqx.is_inexact_array)[0], tangents, several, pair, samples)
    if key not in _engines and pair is not None:
        try:
            _engines[key] = Engine(system, tangents, several, pair, samples)
        except UnknownOperation as operation:
            say_once(str(operation))
    return _engines.setdefault(key, JaxEngine(tangents, samples))


def has_implicit(system: AbstractForcedSystem) -> bool:
    """True if implicit steps of a model can be compiled to machine code."""
    return system.dimension <= LARGEST_WRITTEN_OUT and not system.beside


def cores() -> int:
    """Number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def _in_arrays(design: Any) -> Any:
    """Design with all numbers as arrays, since one may be a Python number in one design and an array in another."""
    return jax.tree.map(lambda x: jnp.asarray(x, dtype=float) if eqx.is_inexact_array_like(x) else x, design)


class Lanes:
    """Lanes (trajectories), each a design at a speed, from a system or `count` of them with stacked arrays, and the
    index `which` and speed [rad/s] of each lane."""

    def __init__(
        self,
        designs: AbstractForcedSystem,
        count: int,
        which: Int[np.ndarray, " lanes"],
        speed: Float[np.ndarray, " lanes"],
    ):
        self.form, rows = split(_in_arrays(designs), eqx.is_inexact_array)
        self.several, self.which, self.speed = count > 1, which, speed
        self._rows = [np.asarray(x) for x in rows]
        self._all, self._place = self, np.arange(speed.size)
        self._numbers: LaneNumbers | None = None

    @classmethod
    def of(
        cls,
        systems: Sequence[AbstractForcedSystem],
        speed: Float[np.ndarray, " lanes"],
        which: Int[np.ndarray, " lanes"] | None = None,
    ) -> "Lanes":
        """Lanes of several systems. **Raises:** `ValueError` if these differ in more than their numbers."""
        which = np.zeros(speed.size, int) if which is None else which
        if len(systems) == 1:
            return cls(systems[0], 1, which, speed)
        found = [_in_arrays(system) for system in systems]
        rests = [eqx.filter(system, eqx.is_array, inverse=True) for system in found]
        if any(not eqx.tree_equal(rest, rests[0]) for rest in rests):
            raise ArgumentError("model", said="must hold designs that differ in their numbers only.")
        stacked = lambda *x: jnp.stack(x) if eqx.is_array(x[0]) else x[0]
        return cls(jax.tree.map(stacked, *found), len(systems), which, speed)

    def at(self, some: Int[np.ndarray, " some"]) -> "Lanes":
        few = copy.copy(self)
        few.which, few.speed, few._place = self.which[some], self.speed[some], self._place[some]
        return few

    @functools.cached_property
    def system(self) -> AbstractForcedSystem:
        """One of the designs."""
        return self.form.filled([jnp.asarray(x[0] if self.several else x) for x in self._rows])

    def rows(self, lanes: Int[np.ndarray, " some"]) -> list[Any]:
        """Numbers of the designs of some lanes, or those common to all."""
        return [x[self.which[lanes]] for x in self._rows] if self.several else self._rows

    def numbers(self, engine: Engine) -> LaneNumbers:
        """Numbers of the field in these lanes, computed once for all lanes of which they are a part."""
        found = self._all._numbers = self._all._numbers or engine.numbers(self._all)
        return found._replace(wide=found.wide[:, self._place], slow=found.slow[self._place])

    def engine(self, tangents: int, method: AbstractMethod, samples: int = 1) -> Engine | JaxEngine:
        return engine_of(self.system, tangents, self.several, method, samples)

    def completed(self, y: Float[np.ndarray, "some dim"]) -> Float[np.ndarray, "some numbers"]:
        """States followed by the initial values of additional integrands."""
        beside = np.array(self.system.beside_start, dtype=float)
        return np.concatenate([y, np.broadcast_to(beside, (len(y), beside.size))], axis=1)

    def begin(
        self, some: Int[np.ndarray, " some"], y: Float[np.ndarray, "some numbers"]
    ) -> tuple[Float[np.ndarray, "some numbers"], Float[np.ndarray, " some"]]:
        """Scale of each of some lanes, 1 for additional integrands, and excursion of its state."""
        dim = self.system.dimension
        scale, excursion = self.each(_scale_and_excursion, some, y[:, :dim])
        return np.concatenate([scale, np.ones((some.size, y.shape[1] - dim))], axis=1), excursion

    def each(self, f: Callable[..., Any], some: Int[np.ndarray, " some"], *arrays: np.ndarray) -> Any:
        """Evaluate a module-level `f(model, speed, ...)` for some lanes, compiled for few sizes (the powers of 8)."""
        room = 8 ** max(1, -(-(some.size - 1).bit_length() // 3))
        filled = lambda x: np.concatenate([x, np.broadcast_to(x[-1:], (room - some.size, *x.shape[1:]))])
        rows = [jnp.asarray(x) for x in self.rows(filled(some))]
        given = [jnp.asarray(filled(x)) for x in (self.speed[some], *arrays)]
        found = _mapped(f, self.form, self.several, rows, *given)
        return jax.tree.map(lambda x: np.asarray(x)[: some.size], found)


@compiled
def _mapped(f: Callable[..., Any], form: Form, several: bool, rows: Any, speed: Array, *arrays: Array) -> Any:
    def lane(row: Any, speed: Array, *arrays: Array) -> Any:
        return jax.tree.map(lambda x: jnp.asarray(x, float), f(form.filled(row), speed, *arrays))

    return jax.vmap(lane, in_axes=(0 if several else None, 0, *(0 for _ in arrays)))(rows, speed, *arrays)


def _scale_and_excursion(system: AbstractForcedSystem, speed: Array, y: Array) -> tuple[Array, Any]:
    scale, state = system.scale(speed), y if system.beside else tuple(y)
    row = scale if system.beside else jnp.stack([jnp.asarray(s, float) for s in scale])
    return row, system.excursion(state)


def histories(
    lanes: Lanes, y0: Float[np.ndarray, "lanes dim"], samples: int, revolutions: int, method: AbstractMethod
) -> tuple[Float[np.ndarray, "lanes samples dim"], Float[np.ndarray, " lanes"]]:
    """States of lanes [SI] at `samples` phases of each of `revolutions`, and the largest error of a revolution [scale].

    The first state is the initial one. Lanes that fail, or have a NaN in it, are NaN. Those with a larger error than
    the method allows are run again with smaller steps. Equal steps are shortened to a whole number between samples.
    """
    if isinstance(method, FixedSteps):
        method = FixedSteps(method.solver, -(-method.steps // samples) * samples)
    total, size = samples * revolutions, CHUNK // samples + 1
    seen, error = np.full((lanes.speed.size, total, y0.shape[1]), np.nan), np.full(lanes.speed.size, np.nan)
    todo = np.flatnonzero(np.all(np.isfinite(y0), axis=1))
    for retry in range(1 + RETRIES):
        chosen = method.finer(retry)
        for some in np.split(todo, range(size, todo.size, size)) if todo.size else ():
            scale, _ = lanes.begin(some, y0[some])
            engine = lanes.engine(0, chosen, samples)
            few = lanes.at(some)
            ran = engine(few, y0[some] / scale, total, total, chosen, threads=cores())
            states = np.concatenate([(y0[some] / scale)[:, None], ran.strobe], axis=1)
            begin = np.tile(np.arange(total) % samples, some.size)
            apart = errors_of_parts(engine, few, states, chosen, begin=begin)
            error[some] = errors_of_stretches(apart, samples, chosen).max(axis=1)
            seen[some] = states[:, :-1] * scale[:, None, :]
        todo = np.flatnonzero(error > method.allowed)
    return seen, error


def errors_of_parts(
    engine: Engine | JaxEngine,
    lanes: Lanes,
    states: Float[np.ndarray, "lanes states numbers"],
    method: AbstractMethod,
    **more: Any,
) -> Float[np.ndarray, "lanes parts"]:
    """Error of each part of a run between `states` [scale]: three times the distance of its end from that by the
    method's reference, infinite where that fails; `more` are arguments of the engine for each part."""
    count, parts = states.shape[0], states.shape[1] - 1
    begins, each = states[:, :-1].reshape(count * parts, -1), lanes.at(np.repeat(np.arange(count), parts))
    dimension = lanes.system.dimension
    sharper = engine(each, begins, 1, 1, method.reference, threads=cores(), **more).state
    apart = np.max(np.abs(sharper.reshape(count, parts, -1) - states[:, 1:])[..., :dimension], axis=2)
    ran = np.all(np.isfinite(states[..., :dimension]), axis=2)
    return SURE * np.where(ran[:, :-1] & ran[:, 1:] & np.isnan(apart), np.inf, apart)


def errors_of_stretches(
    apart: Float[np.ndarray, "*lanes parts"], stretch: int, method: AbstractMethod
) -> Float[np.ndarray, "*lanes stretches"]:
    """Error of each group of `stretch` parts: the sum of theirs, and at least the tolerance."""
    padded = np.pad(apart, [(0, 0)] * (apart.ndim - 1) + [(0, -apart.shape[-1] % stretch)])
    summed = padded.reshape(*apart.shape[:-1], -1, stretch).sum(axis=-1)
    return np.maximum(summed, getattr(method, "tolerance", 0.0))
