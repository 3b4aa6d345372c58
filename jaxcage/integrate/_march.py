"""Many steps of one scalar function as a JAX primitive: plain code in, one compiled loop over lanes out.

A step is written for a single lane, on scalars. What surrounds it decides what becomes of it:
- `jax.vmap` makes lanes of it, and numbers that are the same in every lane stay scalars;
- `jax.jvp` and `jax.jacfwd` put tangent vectors into the step, to any order; several directions share its values;
- on a CPU each step is one loop along the lanes; another backend runs the step's own operations (`is_elementary`).

XLA's CPU backend cuts a step of an integrator into a hundred loops over the lanes and computes shared terms again in
each of them. What is inside a reduction it leaves in one piece. A step is therefore a reduction over windows of one
element, `f(init, x)` in every lane, with the numbers that all lanes share as `init`: LLVM gets one loop whose body is
the whole of `f`, computes each term once, takes what depends on shared numbers alone out of the loop and runs along the
lanes. Rodas4 on the cage is compiled in a third of the time and runs four times as fast as by fusions.

A step that is too large for XLA is several kernels. Derivatives of second and higher order go by the parts that a step
is made of, the stages of an explicit method: a quarter of a Runge-Kutta step is compiled in a fraction of the time, and
by XLA's own options, within `jit` and `grad`. With fewer derivatives a loop over whole steps is four times as fast.

Reverse mode is had by columns: a Jacobian matrix in forward mode, transposed (`orbits._implicit.by_columns`).
"""

import contextvars
import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
import jax.extend as jex
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer, eval_jaxpr
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, Int

from .._recent import jitted
from ._program import CONTROL_FLOW, Numbers, Sizes, Step, pieces, program_of, undisturbed


LARGEST = {False: 2800, True: 12000}
"""Operations of a kernel, at most: where XLA's own options hold, and where those of `compiled` do. The newer of XLA's
two emitters for CPUs, its default, cuts larger kernels into functions that compute shared terms again and again,
without end. A larger step is several kernels."""
SHARED = 16000
"""Operations of a step with several directions, at most; else each direction is a lane with values of its own."""
WHOLE = 2800
"""Operations of a step differentiated more than once, at most; else it is differentiated as the parts it is made of."""
TOGETHER = 4500
"""As many operations are put into one kernel, of several steps, since between kernels all numbers are copied. With
tangents two steps in one kernel measure slower than one."""
COMPILER_OPTIONS = {"xla_cpu_prefer_vector_width": 512, "xla_cpu_use_fusion_emitters": False}
"""Eight lanes to an instruction where the processor can (XLA's default is four); and the older of XLA's two emitters.
Both say nothing to a GPU."""
DIRECTIONS = 8
"""Directions that share the values of a step; more are lanes of their own."""


_ours = contextvars.ContextVar("ours", default=False)
"""Whether the program that is being made is compiled with `COMPILER_OPTIONS`."""


def compiled(f: Callable[..., Any]) -> Callable[..., Any]:
    """`jitted` for programs that march: the largest kernels are for these alone.

    Options are for programs that are called with numbers: within another compiled function it is the function itself,
    and where it is differentiated or mapped from outside it is compiled with XLA's own.
    """
    with_options, within_others = jitted(f, COMPILER_OPTIONS), jitted(f)

    @functools.wraps(f)
    @undisturbed
    def run(*args: Any, **kwargs: Any) -> Any:
        if jex.core.unsafe_am_i_under_a_jit_DO_NOT_USE():  # pyright: ignore[reportPrivateImportUsage]
            return f(*args, **kwargs)
        if any(isinstance(x, Tracer) for x in jax.tree.leaves((args, kwargs))):
            return within_others(*args, **kwargs)
        token = _ours.set(True)
        try:
            return with_options(*args, **kwargs)
        finally:
            _ours.reset(token)

    return run


class How(NamedTuple):
    """What a march is of."""

    step: Any
    sizes: Sizes
    multiple: int


def march(
    step: Step,
    count: Int[Array, ""] | int,
    moved: Sequence[Any],
    watched: Sequence[Any] = (),
    fixed: Sequence[Any] = (),
    multiple: int = 1,
    whole: bool = True,
) -> tuple[Numbers, Numbers]:
    """`count` steps one after the other.

    **Arguments:** the step; how many (an array: one program serves all counts); what is moved; what is watched; what
    stays the same. `multiple` is a number that `count` is known to be a multiple of. `whole` is whether the step is
    made of elementary operations on scalars alone (`is_elementary`): else the loop is left to XLA.

    **Returns:** what was moved and what was watched.
    """
    if not whole:
        return _plain(step, count, tuple(moved), tuple(watched), tuple(fixed))
    numbers = [jnp.asarray(x, dtype=float) for x in (*moved, *watched, *fixed)]
    sizes = Sizes(len(moved), len(watched), len(fixed))
    out = march_p.bind(jnp.asarray(count, jnp.int32), *numbers, how=How(step, sizes, multiple))
    return sizes._replace(fixed=0).split(out)[:2]


def march_with_tangents(
    step: Step,
    count: Int[Array, ""] | int,
    moved: Sequence[Any],
    watched: Sequence[Any],
    fixed: Sequence[Any],
    tangents: Sequence[Sequence[Any]],
    fixed_tangents: Sequence[Sequence[Any]] = (),
    multiple: int = 1,
    whole: bool = True,
) -> tuple[Numbers, Numbers, tuple[Numbers, ...]]:
    """`march`, and what it does to tangent vectors.

    **Arguments:** as for `march`; tangent vectors of what is moved; for each of them those of the fixed numbers, None
    where there is none, by default none at all.

    **Returns:** what was moved, what was watched, the tangent vectors of what was moved.
    """
    if not tangents:
        return *march(step, count, moved, watched, fixed, multiple, whole), ()
    sizes = Sizes(len(moved), len(watched), len(fixed))
    along = list(fixed_tangents) or [(None,) * len(fixed)] * len(tangents)
    known = tuple(tuple(x is not None for x in row) for row in along)
    several = Tangent(step, sizes, known)
    if whole and _share(several):
        pushed, drifts = [x for t in tangents for x in t], [x for row in along for x in row if x is not None]
        y, seen = march(several, count, (*moved, *pushed), watched, (*fixed, *drifts), multiple)
        return y[: sizes.moved], seen, tuple(_rows(y[sizes.moved :], sizes.moved))

    filled = [tuple(jnp.zeros_like(x) if d is None else d for x, d in zip(fixed, row, strict=True)) for row in along]
    go = lambda start: march(step, count, start[0], watched, start[1], multiple, whole)
    pushed = list(zip(map(tuple, tangents), filled, strict=True))
    y, after, seen = with_tangents(go, (tuple(moved), tuple(fixed)), pushed)
    return y, seen, after


def with_tangents(move: Callable[[Any], Any], start: Any, tangents: Sequence[Any]) -> tuple[Any, tuple[Any, ...], Any]:
    """`move(start)`, which is where that leads and what is seen on the way, differentiated along each of the tangents.

    **Returns:** where it leads, the tangents there, what is seen.
    """
    if not tangents:
        end, seen = move(start)
        return end, (), seen
    along = lambda tangent: jax.jvp(move, (start,), (tangent,), has_aux=True)
    if len(tangents) == 1:  # without the extra axis the compiled loops are nearly twice as fast
        end, after, seen = along(tangents[0])
        return end, (after,), seen
    stacked = jax.tree.map(lambda *x: jnp.stack(x), *tangents)
    end, after, seen = jax.vmap(along, out_axes=(None, 0, None))(stacked)
    return end, tuple(jax.tree.map(lambda x: x[i], after) for i in range(len(tangents))), seen


def _rows(numbers: Sequence[Any], size: int) -> Iterator[Numbers]:
    return (tuple(numbers[i : i + size]) for i in range(0, len(numbers), size))


@dataclasses.dataclass(frozen=True)
class Tangent:
    """A step with tangent vectors: moved (y, T_1, T_2, ...), fixed (x, the known tangents of x in each direction)."""

    step: Step
    sizes: Sizes
    known: tuple[tuple[bool, ...], ...]
    """For each direction, which of the fixed numbers have a tangent."""

    @property
    def late(self) -> tuple[bool, ...]:
        """Which of the numbers, in a row, are tangents."""
        moved, _, fixed = self.sizes
        of_step = getattr(self.step, "late", (False,) * sum(self.sizes))
        y, seen, x = self.sizes.split(of_step)
        whole = self.whole
        return (*y, *(True,) * (whole.moved - moved), *seen, *x, *(True,) * (whole.fixed - fixed))

    @property
    def whole(self) -> Sizes:
        """Sizes with the tangents counted in."""
        moved, watched, fixed = self.sizes
        return Sizes(moved * (1 + len(self.known)), watched, fixed + sum(map(sum, self.known)))

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        y, *tangents = _rows(moved, self.sizes.moved)
        x, drifts = fixed[: self.sizes.fixed], iter(fixed[self.sizes.fixed :])
        step = program_of(self.step, self.sizes, rules=True)

        @functools.cache
        def linear(known: tuple[bool, ...]) -> Any:
            """Value, linear map and what is watched, with derivatives by y and the known ones of x."""

            def go(y: Numbers, some: Numbers) -> tuple[Numbers, Numbers]:
                given = iter(some)
                new = step(i, *y, *watched, *(next(given) if k else c for c, k in zip(x, known, strict=True)))
                return tuple(new[: len(y)]), tuple(new[len(y) :])

            return jax.linearize(go, y, tuple(c for c, k in zip(x, known) if k), has_aux=True)

        out: list[Any] = []
        for tangent, known in zip(tangents, self.known, strict=True):
            out += linear(known)[1](tangent, tuple(next(drifts) for k in known if k))
        value, _, seen = linear(self.known[0])
        return (*value, *out), seen


@dataclasses.dataclass(frozen=True)
class Several:
    """`count` steps one after the other as one."""

    step: Step
    count: int

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        sizes = Sizes(len(moved), len(watched), len(fixed))
        row = (*moved, *watched)
        for k in range(self.count):
            row = tuple(program_of(self.step, sizes)(i + k, *row, *fixed))
        return row[: len(moved)], row[len(moved) :]


@dataclasses.dataclass(frozen=True)
class Limited:
    """A step of lanes that stop after their own counts, the first fixed number."""

    step: Step
    parts: int = 1
    """How many of these steps are one of those that are counted."""

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        count, *rest = fixed
        new, seen = self.step(i, moved, watched, tuple(rest))
        keep = lambda a, b: tuple(jnp.where(i < count * self.parts, x, y) for x, y in zip(a, b, strict=True))
        return keep(new, moved), keep(seen, watched)


def _limited(step: Any) -> Any:
    """The step that stops after a count of its own, tangents outside."""
    if not isinstance(step, Tangent):
        return Limited(step)
    known = tuple((False, *row) for row in step.known)
    return Tangent(_limited(step.step), _one_more(step.sizes), known)


class Parts(NamedTuple):
    """A step as a number of parts, each a step that moves `copies` times the numbers, `size` of them at a time."""

    number: int
    copies: int
    size: int

    def begun(self, moved: Sequence[Any]) -> list[Any]:
        """What the first part is given."""
        return [x for row in _rows(moved, self.size) for x in row * self.copies]

    def ended(self, moved: Sequence[Any]) -> list[Any]:
        """What the last part leaves."""
        return [x for row in _rows(moved, self.size * self.copies) for x in row[: self.size]]


def _in_parts(how: How) -> tuple[How, Parts]:
    """What is to be differentiated: the march, or, where that is large and has a derivative in it already, that of the
    parts of its steps. Compiled in a fraction of the time; with fewer derivatives whole steps run faster."""
    parts = _parts(how.step, how.sizes) if isinstance(how.step, Tangent) else None
    if parts is None or 2 * _about(how.step, how.sizes) < WHOLE:
        return how, Parts(1, 1, how.sizes.moved)
    step, sizes, parts = parts
    return How(step, sizes, how.multiple), parts


def _parts(step: Any, sizes: Sizes) -> tuple[Any, Sizes, Parts] | None:
    """A part of the step, its sizes, and how the step is made of it; None where it is not."""
    if isinstance(step, Tangent | Limited):
        inner = step.sizes if isinstance(step, Tangent) else sizes._replace(fixed=sizes.fixed - 1)
        found = _parts(step.step, inner)
        if found is None:
            return None
        part, inner, parts = found
        if isinstance(step, Limited):
            return Limited(part, parts.number), _one_more(inner), parts
        part = Tangent(part, inner, step.known)
        return part, part.whole, parts
    stage = getattr(step, "stage", None)
    if stage is None:
        return None
    return stage, sizes._replace(moved=sizes.moved * stage.copies), Parts(stage.count, stage.copies, sizes.moved)


def _one_more(sizes: Sizes) -> Sizes:
    return sizes._replace(fixed=sizes.fixed + 1)


# --- what fits into a kernel ---------------------------------------------------------------------------------------


def _operations(step: Step, sizes: Sizes) -> int:
    return len(program_of(step, sizes).jaxpr.eqns)


def _about(step: Any, sizes: Sizes) -> int:
    """The same, at most, without tracing derivatives: a direction is no more work than the value."""
    if isinstance(step, Tangent):
        return _about(step.step, step.sizes) * (1 + len(step.known))
    part, sizes, parts = _parts(step, sizes) or (step, sizes, Parts(1, 1, 1))
    return _operations(part, sizes) * parts.number


def _share(tangent: Tangent) -> bool:
    """Whether all directions of a step are computed together."""
    first = not isinstance(tangent.step, Tangent)  # of higher derivatives a single direction is enough for a kernel
    return first and len(tangent.known) <= DIRECTIONS and _about(tangent, tangent.whole) <= SHARED


def is_elementary(step: Step, sizes: Sizes) -> bool:
    """Whether `step` is made of elementary operations on scalars alone, and the backend is a CPU."""
    if isinstance(step, Tangent):
        return is_elementary(step.step, step.sizes)
    program = program_of(step, sizes)
    caught = any(isinstance(c, Tracer) for c in program.consts)
    scalar = lambda e: not any(v.aval.shape for v in (*e.invars, *e.outvars))
    plain = all(e.primitive.name not in CONTROL_FLOW and scalar(e) for e in program.jaxpr.eqns)
    return not caught and plain and jax.default_backend() == "cpu" and _in_order()


@functools.cache
def _in_order() -> bool:
    """Whether the backend reduces a window of one element as body(init, element): a reduction leaves the order free."""
    with jax.ensure_compile_time_eval():
        first, second = np.array([5.0, 7.0]), np.array([1.0, 2.0])
        program = jax.jit(lambda s, *x: lanewise(lambda s, x: (s[0] - 3 * x[0], s[0] * x[1]), 2, (s,), x))
        got = [np.asarray(x) for x in program(np.array(2.0), first, second)]
        return bool(np.all(got[0] == 2 - 3 * first) and np.all(got[1] == 2 * second))


# --- loops ---------------------------------------------------------------------------------------------------------


def _plain(step: Step, count: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
    """The same loop, left to XLA."""

    def body(i: Array, carry: tuple[Numbers, Numbers]) -> tuple[Numbers, Numbers]:
        moved, watched = step(i.astype(float), *carry, fixed)
        return tuple(moved), tuple(jax.lax.stop_gradient(x) for x in watched)

    return jax.lax.fori_loop(0, count, body, (moved, tuple(jax.lax.stop_gradient(x) for x in watched)))


def lanewise(
    f: Callable[[Numbers, Numbers], Sequence[Any]], results: int, shared: Sequence[Array], lanes: Sequence[Array]
) -> tuple[Array, ...]:
    """The results of f(shared, lane) in every lane by one reduction: shared scalars, arrays of one axis."""
    width = max(len(shared), len(lanes), results)  # as many results as operands
    operands = [*lanes, *[lanes[0]] * (width - len(lanes))]
    inits = [*shared, *[jnp.zeros(())] * (width - len(shared))]

    def body(first: tuple[Array, ...], second: tuple[Array, ...]) -> tuple[Array, ...]:
        out = f(tuple(first[: len(shared)]), tuple(second[: len(lanes)]))
        return (*out, *second[results:])

    return tuple(jax.lax.reduce_window(tuple(operands), tuple(inits), body, (1,), (1,), "VALID")[:results])


def _loops(count: Array, *numbers: Array, how: How) -> tuple[Array, ...]:
    """The march on a CPU: a loop over kernels, each a loop along the lanes."""
    step, sizes, multiple = how
    shape = max((x.shape for x in numbers), key=len)
    lanes = math.prod(shape)
    moving = sizes.moved + sizes.watched
    row = tuple(jnp.broadcast_to(x, shape).reshape(lanes) for x in numbers[:moving])
    fixed = [x.reshape(lanes) if x.shape else x for x in numbers[moving:]]
    largest = LARGEST[_ours.get()]
    most = 1 if isinstance(step, Tangent) else min(TOGETHER, largest) // _operations(step, sizes)
    together = max(d for d in range(1, multiple + 1) if multiple % d == 0 and (d == 1 or d <= most))
    program = program_of(Several(step, together) if together > 1 else step, sizes)
    parts = pieces(program, largest, getattr(step, "late", ()))

    def body(i: Array, row: tuple[Array, ...]) -> tuple[Array, ...]:
        known = dict(zip(program.jaxpr.invars, ((i * together).astype(float), *row, *fixed), strict=True))
        for part in parts:
            got = _piece(part, program.consts, [known[v] for v in part.invars], row[0])
            known.update(zip(part.outvars, got, strict=True))
        read = lambda v: jnp.asarray(v.val if isinstance(v, jex.core.Literal) else known[v])
        return tuple(jnp.broadcast_to(read(v), lanes) for v in program.jaxpr.outvars)

    row = jax.lax.fori_loop(0, count // together, body, row)
    return tuple(x.reshape(shape) for x in row)


def _piece(part: Any, consts: Sequence[Any], given: Sequence[Array], like: Array) -> tuple[Array, ...]:
    """A part of a program as a kernel; between kernels all numbers are floating."""
    own = [i for i, x in enumerate(given) if x.shape]
    alike = [i for i, x in enumerate(given) if not x.shape]

    def kernel(shared: Numbers, lane: Numbers) -> Sequence[Any]:
        known = dict(zip((*alike, *own), (*shared, *lane), strict=False))
        x = [known[i].astype(v.aval.dtype) for i, v in enumerate(part.invars)]
        return [y.astype(float) for y in eval_jaxpr(part, consts, *x)]

    return lanewise(kernel, len(part.outvars), [given[i] for i in alike], [given[i] for i in own] or [like])


# --- the primitive -------------------------------------------------------------------------------------------------

march_p = jex.core.Primitive("march")
march_p.multiple_results = True


@functools.lru_cache(maxsize=128)
def _compiled(how: How) -> Callable[..., Any]:
    return jax.jit(functools.partial(march_p.bind, how=how))


def _abstract(count: Any, *numbers: Any, how: How) -> list[Any]:
    del count
    like = max(numbers, key=lambda x: len(x.shape))
    return [like] * (how.sizes.moved + how.sizes.watched)


def _batch(args: Sequence[Any], dims: Sequence[Any], *, how: How) -> Any:
    mapped = [d is not batching.not_mapped for d in dims]
    size = next(x.shape[d] for x, d, m in zip(args, dims, mapped, strict=True) if m)
    args = [jnp.moveaxis(x, d, 0) if m else x for x, d, m in zip(args, dims, mapped, strict=True)]
    results = how.sizes.moved + how.sizes.watched
    if mapped[0]:  # lanes with counts of their own
        count, *numbers = args
        args = [jnp.max(count), *numbers[:results], count.astype(float), *numbers[results:]]
        mapped = [False, *mapped[1 : 1 + results], True, *mapped[1 + results :]]
        how = How(_limited(how.step), _one_more(how.sizes), how.multiple)
    if isinstance(how.step, Tangent):
        moved, watched, fixed = how.sizes.split(mapped[1:])
        inner = how.step.sizes
        if not any((*moved[: inner.moved], *watched, *fixed[: inner.fixed])):
            return _directions(args, mapped, size, how)
    return _lanes(args, mapped, size, how), [0] * results


def _lanes(args: Sequence[Any], mapped: Sequence[bool], size: int, how: How) -> Any:
    """All numbers that are mapped, moved or in lanes already as lanes of one shape, the new axis first."""
    count, *numbers = args
    shape = max((x.shape[m:] for x, m in zip(numbers, mapped[1:], strict=True)), key=len)

    def spread(x: Any, m: bool) -> Any:
        if not m and not x.shape:
            return x
        x = x if m else x[None]
        return jnp.broadcast_to(x.reshape(x.shape + (1,) * (1 + len(shape) - x.ndim)), (size, *shape))

    return march_p.bind(count, *(spread(x, m) for x, m in zip(numbers, mapped[1:], strict=True)), how=how)


def _directions(args: Sequence[Any], mapped: Sequence[bool], size: int, how: How) -> Any:
    """Tangents alone are mapped: values are computed once, and stay as they are."""
    count, *numbers = args
    step, sizes = how.step, how.sizes
    inner, old = step.sizes, len(step.known)
    moved, watched, fixed = sizes.split(numbers)
    moved_mapped, _, fixed_mapped = sizes.split(mapped[1:])
    y, x = moved[: inner.moved], fixed[: inner.fixed]
    several = dataclasses.replace(step, known=step.known * size)
    if not _share(several):
        out = _lanes(args, mapped, size, how)
        once = lambda row: [x[0] for x in row]  # values are the same in every lane
        out = [*once(out[: inner.moved]), *out[inner.moved : sizes.moved], *once(out[sizes.moved :])]
    else:
        slices = lambda k, row, flags: [v[k] if m else v for v, m in zip(row, flags, strict=True)]
        tangents = [v for k in range(size) for v in slices(k, moved[inner.moved :], moved_mapped[inner.moved :])]
        drifts = [v for k in range(size) for v in slices(k, fixed[inner.fixed :], fixed_mapped[inner.fixed :])]
        shared = How(several, several.whole, how.multiple)
        got = march_p.bind(count, *y, *tangents, *watched, *x, *drifts, how=shared)
        width = inner.moved * old
        each = [got[inner.moved + k * width : inner.moved + (k + 1) * width] for k in range(size)]
        stacked = [jnp.stack(c) for c in zip(*each, strict=True)]
        out = [*got[: inner.moved], *stacked, *got[several.whole.moved :]]
    axes = [batching.not_mapped] * inner.moved + [0] * (sizes.moved - inner.moved)
    return out, [*axes, *[batching.not_mapped] * sizes.watched]


def _jvp(primals: Sequence[Any], tangents: Sequence[Any], *, how: How) -> Any:
    count, *numbers = primals
    (step, sizes, multiple), parts = _in_parts(how)
    moved, watched, fixed = how.sizes.split(numbers)
    moved_dot, _, fixed_dot = how.sizes.split(tangents[1:])
    known = tuple(not isinstance(d, ad.Zero) for d in fixed_dot)
    pushed = [ad.instantiate_zeros(d) for d in moved_dot]
    along = Tangent(step, sizes, (known,))
    drifts = [d for d, k in zip(fixed_dot, known, strict=True) if k]
    begun = [*parts.begun(moved), *parts.begun(pushed)]
    shared = How(along, along.whole, multiple * parts.number)
    out = march_p.bind(count * parts.number, *begun, *watched, *fixed, *drifts, how=shared)
    values, slopes, seen = out[: sizes.moved], out[sizes.moved : 2 * sizes.moved], out[2 * sizes.moved :]
    none = [ad.Zero(jax.typeof(x).to_tangent_aval()) for x in seen]
    return [*parts.ended(values), *seen], [*parts.ended(slopes), *none]


march_p.def_impl(lambda *args, how: _compiled(how)(*args))
march_p.def_abstract_eval(_abstract)
batching.primitive_batchers[march_p] = _batch
ad.primitive_jvps[march_p] = _jvp
mlir.register_lowering(march_p, mlir.lower_fun(_loops, multiple_results=True), platform="cpu")
