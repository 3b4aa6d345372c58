"""Machine code of a system: traced in JAX, written as LLVM IR, compiled, and called with lanes.

The code runs whole revolutions of many lanes (`loop`).
"""

import ctypes
import dataclasses
import threading
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._form import Form, split
from ..models import AbstractForcedSystem, ScaledField, multiply
from .ir import UnknownOperation, is_variable
from .loop import REVOLUTION, Field, Layout, Tableau, layout_of, march_ir
from .object_code import function
from .program import Program, Sizes, program_of
from .rosenbrock import RODAS4, rosenbrock_step


FEWEST_STEPS, MOST_STEPS, MOST_AT = 4, 20_000.0, 1e-6
"""Limits of the number of steps of a revolution; the period of the forcing's highest harmonic has two at least. The
second is for tolerances from the third on; smaller ones take more steps."""
SMALLEST_STEP = 1e-10
"""Step below which a lane is given up [rad]."""
FIRST_STEP = 0.05
"""Step that is tried first [rad]."""
WIDTH = 8
"""Lanes of a vector."""
WAKES = 0.1
"""Seconds between looks at threads that run."""


@dataclasses.dataclass(frozen=True)
class _Rates:
    """Rates of a state and of tangent vectors, in units of the scale."""

    form: Form
    dimension: int
    tangents: int
    skip: int
    """Fixed numbers that are not the law's."""

    def __call__(self, phase: Any, moved: Any, watched: Any, fixed: Any) -> Any:
        field, _, scale = self.form.filled(fixed[self.skip :])
        n = self.dimension
        go = lambda y: tuple(jnp.asarray(c, float) for c in ScaledField(field, scale)(phase, y))
        if not self.tangents:
            return go(moved), ()
        pushed = [jax.jvp(go, (moved[:n],), (moved[i : i + n],)) for i in range(n, len(moved), n)]
        return (*pushed[0][0], *(c for _, each in pushed for c in each)), ()


@dataclasses.dataclass(frozen=True)
class _Step:
    """A step of the Rosenbrock method and its estimated error, in units of the scale: moved are its length, the state
    and tangent vectors."""

    form: Form
    dimension: int
    tangents: int
    skip: int

    def __call__(self, phase: Any, moved: Any, watched: Any, fixed: Any) -> Any:
        field, _, scale = self.form.filled(fixed[self.skip :])
        n, (h, *rest) = self.dimension, moved

        def go(y: Any) -> Any:
            y1, error, *_ = rosenbrock_step(RODAS4, ScaledField(field, scale), phase, lambda _: h, y)
            return tuple(jnp.asarray(c, float) for c in (*y1, *error))

        y = tuple(rest[:n])
        values = go(y)
        pushed = [jax.jvp(go, (y,), (tuple(rest[i : i + n]),))[1] for i in range(n, len(rest), n)]
        ends = (*values[:n], *(c for each in pushed for c in each[:n]))
        return (*ends, *values[n:], *(c for each in pushed for c in each[n:])), ()


@dataclasses.dataclass(frozen=True)
class _Excursion:
    """How far a state, in units of the scale, is towards the edge of what the model holds for."""

    form: Form
    skip: int

    def __call__(self, phase: Any, moved: Any, watched: Any, fixed: Any) -> Any:
        _, system, scale = self.form.filled(fixed[self.skip :])
        return (system.excursion(multiply(moved, scale)),), ()


@dataclasses.dataclass(frozen=True)
class _Abrupt:
    """Distance of a state from an abrupt change of the law, and the speed with which it comes there."""

    form: Form
    skip: int

    def __call__(self, phase: Any, moved: Any, watched: Any, fixed: Any) -> Any:
        _, system, scale = self.form.filled(fixed[self.skip :])
        n = len(moved) // 2
        return system.abrupt(multiply(moved[:n], scale), multiply(moved[n:], scale)), ()


def _hoisted(program: Program, moving: int) -> tuple[Program, Program]:
    """A program as one of the fixed numbers alone, and one that takes that one's results behind the fixed numbers."""
    jaxpr = program.jaxpr
    known, early = {*jaxpr.invars[1 + moving :], *jaxpr.constvars}, []
    for e in jaxpr.eqns:
        if all(v in known for v in e.invars if is_variable(v)):
            early.append(e)
            known.update(e.outvars)
    placed = set(map(id, early))
    late = [e for e in jaxpr.eqns if id(e) not in placed]
    wanted = {v for e in late for v in e.invars if is_variable(v)} | {v for v in jaxpr.outvars if is_variable(v)}
    numbers = []
    for e in reversed(early):
        if e.outvars[0] in wanted and e.outvars[0].aval.dtype != np.dtype(float):  # masks and integers are made again
            late = [e, *late]
            wanted |= {v for v in e.invars if is_variable(v)}
        else:
            numbers.append(e)
    made = [v for e in reversed(numbers) for v in e.outvars if v in wanted]
    needed, first = set(made), []
    for e in numbers:
        if needed & set(e.outvars):
            first.append(e)
            needed |= {v for v in e.invars if is_variable(v)}
    prelude = jaxpr.replace(invars=jaxpr.invars[1 + moving :], eqns=first[::-1], outvars=made)
    rest = jaxpr.replace(invars=[*jaxpr.invars, *made], eqns=late)
    return Program(prelude, program.consts, []), Program(rest, program.consts, [])


def _pieces(system: AbstractForcedSystem, speed: Any) -> tuple[Form, list[Any]]:
    """What is integrated at a speed, and its numbers."""
    return split((system.at_speed(speed), system, system.scale(speed)), eqx.is_inexact_array)


def room_for(lanes: int) -> int:
    """A number of lanes at least as large, one of few, as each is compiled: 8, 64, 512, ..."""
    return 8 ** max(1, -(-(lanes - 1).bit_length() // 3))


class Numbers:
    """The numbers of a field, as they follow from a system's and a speed."""

    def __init__(self, system: AbstractForcedSystem, several: bool):
        self._form, row = split(system, eqx.is_inexact_array)
        self.several = several
        self.form = _pieces(system, jnp.asarray(1.0))[0]

        def of(speed: Any, row: Sequence[Any]) -> list[Any]:
            return [jnp.asarray(x, float) for x in _pieces(self._form.filled(row), speed)[1]]

        traced = jax.make_jaxpr(lambda speed: of(speed, row))(1.0).jaxpr
        if any(v.aval.shape for v in traced.outvars):
            raise UnknownOperation("array")
        moved = set(traced.invars)
        for e in traced.eqns:
            if any(is_variable(v) and v in moved for v in e.invars):
                moved.update(e.outvars)
        self.wide = tuple(several or (is_variable(v) and v in moved) for v in traced.outvars)
        self._over = jax.jit(lambda speeds, rows: jax.vmap(of, in_axes=(0, 0 if several else None))(speeds, rows))

    def __call__(
        self, speeds: Float[np.ndarray, " lanes"], rows: Sequence[Any]
    ) -> tuple[Float[np.ndarray, "wide lanes"], Float[np.ndarray, " shared"]]:
        """The numbers that differ from lane to lane, and those that all lanes share."""
        count = len(speeds)
        room = room_for(count)
        pad = lambda x: np.concatenate([x, np.broadcast_to(x[-1:], (room - count, *x.shape[1:]))])
        filled = [pad(np.asarray(x)) for x in rows] if self.several else list(rows)
        found = [np.asarray(x) for x in self._over(pad(speeds), filled)]
        wide = [x[:count] for x, w in zip(found, self.wide, strict=True) if w]
        shared = [x[0] for x, w in zip(found, self.wide, strict=True) if not w]
        return np.array(wide).reshape(len(wide), count), np.array(shared, dtype=float)


SAMPLED = 2
"""Fixed numbers of a field with several strobe states to a revolution: the angle between two, and which is the first.
"""


def traced_field(
    system: AbstractForcedSystem,
    form: Form,
    wide: tuple[bool, ...],
    tangents: int,
    sampled: bool = False,
    implicit: bool = False,
) -> Field:
    """The programs of a system, with a strobe state for each revolution or, if it is `sampled`, several."""
    n, skip = system.dimension, SAMPLED * sampled
    wide = (True,) * skip + wide
    trace = lambda step, moving: program_of(step, Sizes(moving, 0, len(wide)))
    prelude, rates = _hoisted(trace(_Rates(form, n, tangents, skip), n * (1 + tangents)), n * (1 + tangents))
    ones = tuple(jnp.ones(()) for _ in range(n))
    abrupt = None if system.abrupt(ones, ones) is None else trace(_Abrupt(form, skip), 2 * n)
    step = trace(_Step(form, n, tangents, skip), 1 + n * (1 + tangents)) if implicit else None
    return Field(
        prelude, rates, trace(_Excursion(form, skip), n), abrupt, n, tangents, wide, step=step, own_turn=sampled,
        phased=sampled,
    )  # fmt: skip


class March(NamedTuple):
    """Results of a run of lanes."""

    state: Float[np.ndarray, "lanes dim"]
    """At the end, in units of the scale."""
    tangents: Float[np.ndarray, "lanes tangents dim"]
    step: Float[np.ndarray, " lanes"]
    """Step size to go on with [rad]."""
    peak: Float[np.ndarray, " lanes"]
    """Largest excursion."""
    steps: Float[np.ndarray, " lanes"]
    """Number of steps tried."""
    mark: Float[np.ndarray, " lanes"]
    """How each lane ended, as in `loop`; 0 if it was not run."""
    strobe: Float[np.ndarray, "lanes keep dim"]
    """The last strobe states, the latest last; in units of the scale."""
    growth: Float[np.ndarray, "lanes revolutions tangents"]
    """Logarithm of the growth of each tangent vector in each revolution."""


class Runner:
    """The compiled loop of a field, called with lanes."""

    def __init__(self, field: Field, pair: str, width: int = WIDTH):
        self.field, self._width = field, width
        self.rows: Layout = layout_of(field, len(Tableau.named(pair).phase))
        whole, place = ctypes.c_int64, ctypes.c_void_p
        kind = ctypes.CFUNCTYPE(None, place, whole, whole, whole, *[place] * 6)
        self._march = kind(function(march_ir(field, pair, width), "march"))

    def __call__(
        self,
        numbers: tuple[Float[np.ndarray, "wide lanes"], Float[np.ndarray, " shared"]],
        state: Float[np.ndarray, "lanes numbers"],
        strobes: int,
        keep: int,
        settings: Float[np.ndarray, " 4"],
        tangents: Float[np.ndarray, "lanes tangents dim"] | None = None,
        step: Float[np.ndarray, " lanes"] | float = FIRST_STEP,
        threads: int = 1,
        report: Callable[[int], None] = lambda done: None,
    ) -> March:
        """Run lanes from states in units of their scales, with what is integrated beside them behind.

        `settings` are tolerance, longest and shortest step, and most steps from strobe to strobe.
        """
        lanes, field, rows = len(state), self.field, self.rows
        n, moving = field.dimension, field.moving
        loaded = np.zeros((rows.end("fixed"), lanes))
        loaded[:n], loaded[moving - field.beside : moving] = state[:, :n].T, state[:, n:].T
        if field.tangents:
            assert tangents is not None
            loaded[n : moving - field.beside] = tangents.reshape(lanes, -1).T
        loaded[rows["step"][0]] = step
        loaded[rows["peak"]] = 0.0 if field.excursion is not None else -np.inf
        wide, shared = numbers
        loaded[rows.end("mark") :] = wide
        stored = np.zeros((rows.end("mark"), lanes))
        strobe = np.full((lanes, keep, field.recorded), np.nan)
        growth = np.full((lanes, strobes, field.tangents), np.nan)
        queue = np.zeros(2, dtype=np.int64)
        arrays = (queue, np.asarray(settings, dtype=float), np.append(shared, 0.0), loaded, stored, strobe, growth)
        at = [x.ctypes.data for x in arrays]
        run = lambda: self._march(at[0], lanes, strobes, keep, *at[1:])
        _run_threads(run, min(threads, -(-lanes // self._width)), queue, lambda: report(min(int(queue[0]), lanes)))
        part = lambda name: stored[rows[name][0]]
        turned = np.roll(strobe, -strobes % keep, axis=1)  # the latest last
        with np.errstate(divide="ignore"):
            grown = 0.5 * np.log(growth)
        end = np.concatenate([stored[:n], stored[moving - field.beside : moving]])
        return March(
            state=end.T.copy(),
            tangents=stored[n : moving - field.beside].T.reshape(lanes, field.tangents, n),
            step=part("step"),
            peak=part("peak"),
            steps=part("steps"),
            mark=part("mark"),
            strobe=turned,
            growth=grown,
        )


class Engine:
    """The compiled revolutions of a system, with so many tangent vectors."""

    def __init__(
        self,
        system: AbstractForcedSystem,
        tangents: int = 0,
        several: bool = False,
        pair: str = "tsit5",
        samples: int = 1,
    ):
        """`samples` is the number of strobe states of a revolution.

        **Raises:** `UnknownOperation` for a law with an operation that has no translation, or arrays of numbers.
        """
        self.numbers, self._samples = Numbers(system, several), samples
        implicit, self._order = Tableau.named(pair).implicit, Tableau.named(pair).order
        self.field = traced_field(system, self.numbers.form, self.numbers.wide, tangents, samples > 1, implicit)
        self._largest = REVOLUTION / max(FEWEST_STEPS, 2 * system.harmonics)
        self._run = Runner(self.field, pair)

    @staticmethod
    def picked(numbers: Any, lanes: Any) -> Any:
        """The numbers of some lanes."""
        return numbers[0][:, lanes], numbers[1]

    def __call__(
        self,
        numbers: tuple[Float[np.ndarray, "wide lanes"], Float[np.ndarray, " shared"]],
        state: Float[np.ndarray, "lanes dim"],
        strobes: int,
        keep: int,
        method: Any,
        begin: Any = 0,
        **more: Any,
    ) -> March:
        """Run lanes from states in units of their scales.

        **Arguments:** numbers of the lanes; states; strobe states to run to, and to keep; a method with a tolerance;
        which sample of a revolution the first state is, of all lanes or of each; the rest as for `Runner`.
        """
        most = MOST_STEPS * max(1.0, MOST_AT / method.tolerance) ** (1 / self._order)
        settings = np.array([method.tolerance, self._largest, SMALLEST_STEP, most])
        if self._samples > 1:
            own = np.empty((SAMPLED, len(state)))
            own[0], own[1] = REVOLUTION / self._samples, begin
            numbers = np.concatenate([own, numbers[0]]), numbers[1]
        return self._run(numbers, state, strobes, keep, settings, **more)


def _run_threads(run: Callable[[], None], count: int, queue: np.ndarray, report: Callable[[], None]) -> None:
    """`run` in threads of its own, interrupted by Ctrl-C within a moment: the flag in `queue` empties it."""
    pool = [threading.Thread(target=run, daemon=True) for _ in range(count)]
    try:
        for each in pool:
            each.start()
        for each in pool:
            while each.is_alive():
                each.join(WAKES)
                report()
    except BaseException:
        queue[1] = 1
        for each in pool:
            each.join()
        raise
