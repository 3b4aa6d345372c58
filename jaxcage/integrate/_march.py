"""Many steps of one scalar function as a JAX primitive: plain code in, one compiled loop over lanes out.

A step is written for a single lane, on scalars. What surrounds it decides what becomes of it:
- `jax.vmap` makes lanes of it, and numbers that are the same in every lane stay scalars;
- `jax.jvp` and `jax.jacfwd` put tangent vectors into the step, to any order; several directions share its values;
- on a CPU each step is one loop along the lanes, on a GPU the whole march is one kernel (`_device`).

XLA's CPU backend cuts a step of an integrator into a hundred loops over the lanes and computes shared terms again in
each of them. What is inside a reduction it leaves in one piece. A step is therefore a reduction over windows of one
element, `f(init, x)` in every lane, with the numbers that all lanes share as `init`: LLVM gets one loop whose body is
the whole of `f`, computes each term once, takes what depends on shared numbers alone out of the loop and runs along the
lanes. Rodas4 on the cage is compiled in a third of the time and runs four times as fast as by fusions.

Reverse mode is had by columns: a Jacobian matrix in forward mode, transposed (`orbits._implicit.by_columns`).
"""

import contextvars
import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.extend as jex
import jax.numpy as jnp
from jax.core import Tracer
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, Int

from ._program import CONTROL_FLOW, Numbers, Sizes, Step, program_of


LARGEST = {False: 2800, True: 12000}
"""Operations of a kernel, at most: where XLA's own options hold, and where those of `compiled` do. The newer of XLA's
two emitters for CPUs, its default, cuts larger kernels into functions that compute shared terms again and again,
without end. A larger step is left to XLA's fusions, which is slower, but ends."""
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
    """`equinox.filter_jit` for programs that march: the largest kernels are for these alone.

    Options are for programs that are called with numbers: within another compiled function it is the function itself,
    and where it is differentiated or mapped from outside it is compiled with XLA's own.
    """
    jitted = eqx.filter_jit(f, compiler_options=COMPILER_OPTIONS)  # pyright: ignore[reportCallIssue]
    traced = eqx.filter_jit(f)

    @functools.wraps(f)
    def run(*args: Any, **kwargs: Any) -> Any:
        if jex.core.unsafe_am_i_under_a_jit_DO_NOT_USE():  # pyright: ignore[reportPrivateImportUsage]
            return f(*args, **kwargs)
        if any(isinstance(x, Tracer) for x in jax.tree.leaves((args, kwargs))):
            return traced(*args, **kwargs)
        token = _ours.set(True)
        try:
            return jitted(*args, **kwargs)
        finally:
            _ours.reset(token)

    return run


class How(NamedTuple):
    """What a march is of."""

    step: Any
    loose: Any
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
    loose: Step | None = None,
) -> tuple[Numbers, Numbers]:
    """`count` steps one after the other.

    **Arguments:** the step; how many (an array: one program serves all counts); what is moved; what is watched; what
    stays the same. `multiple` is a number that `count` is known to be a multiple of. `whole` is whether the step is
    made of elementary operations on scalars alone (`is_elementary`): else the loop is left to XLA, as it is where the
    step is too large for a kernel. `loose` is the step as it should then be, by default the same.

    **Returns:** what was moved and what was watched.
    """
    if not whole:
        return _plain(loose or step, count, tuple(moved), tuple(watched), tuple(fixed))
    numbers = [jnp.asarray(x, dtype=float) for x in (*moved, *watched, *fixed)]
    sizes = Sizes(len(moved), len(watched), len(fixed))
    how = How(step, loose or step, sizes, multiple)
    out = march_p.bind(jnp.asarray(count, jnp.int32), *numbers, how=how)
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
    loose: Step | None = None,
) -> tuple[Numbers, Numbers, tuple[Numbers, ...]]:
    """`march`, and what it does to tangent vectors.

    **Arguments:** as for `march`; tangent vectors of what is moved; for each of them those of the fixed numbers, None
    where there is none, by default none at all.

    **Returns:** what was moved, what was watched, the tangent vectors of what was moved.
    """
    if not tangents:
        return *march(step, count, moved, watched, fixed, multiple, whole, loose), ()
    sizes = Sizes(len(moved), len(watched), len(fixed))
    along = list(fixed_tangents) or [(None,) * len(fixed)] * len(tangents)
    known = tuple(tuple(x is not None for x in row) for row in along)
    several = Tangent(step, sizes, known, loose or step)
    if whole and _share(several):
        pushed, drifts = [x for t in tangents for x in t], [x for row in along for x in row if x is not None]
        y, seen = march(several, count, (*moved, *pushed), watched, (*fixed, *drifts), multiple, loose=several.loose)
        return y[: sizes.moved], seen, tuple(_rows(y[sizes.moved :], sizes.moved))

    def one(tangent: Numbers, row: Numbers) -> Any:
        go = lambda y, x: march(step, count, y, watched, x, multiple, whole, loose)
        return jax.jvp(go, (tuple(moved), tuple(fixed)), (tangent, row))

    filled = [tuple(jnp.zeros_like(x) if d is None else d for x, d in zip(fixed, row, strict=True)) for row in along]
    if len(tangents) == 1:  # without the extra axis the compiled loops are nearly twice as fast
        (y, seen), (after, _) = one(tuple(tangents[0]), filled[0])
        return y, seen, (after,)
    stacked = [tuple(map(jnp.stack, zip(*rows, strict=True))) for rows in (tangents, filled)]
    (y, seen), (after, _) = jax.vmap(one, out_axes=((None, None), 0))(*stacked)
    return y, seen, tuple(tuple(x[i] for x in after) for i in range(len(tangents)))


def _rows(numbers: Sequence[Any], size: int) -> Iterator[Numbers]:
    return (tuple(numbers[i : i + size]) for i in range(0, len(numbers), size))


@dataclasses.dataclass(frozen=True)
class Tangent:
    """A step with tangent vectors: moved (y, T_1, T_2, ...), fixed (x, the known tangents of x in each direction)."""

    step: Step
    sizes: Sizes
    known: tuple[tuple[bool, ...], ...]
    """For each direction, which of the fixed numbers have a tangent."""
    loose: Step
    """The step itself as it should be where it is left to XLA."""

    @property
    def whole(self) -> Sizes:
        """Sizes with the tangents counted in."""
        moved, watched, fixed = self.sizes
        return Sizes(moved * (1 + len(self.known)), watched, fixed + sum(map(sum, self.known)))

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        y, *tangents = _rows(moved, self.sizes.moved)
        x, drifts = fixed[: self.sizes.fixed], iter(fixed[self.sizes.fixed :])

        @functools.cache
        def linear(known: tuple[bool, ...]) -> Any:
            """Value, linear map and what is watched, with derivatives by y and the known ones of x."""

            def go(y: Numbers, some: Numbers) -> tuple[Numbers, Numbers]:
                given = iter(some)
                new, seen = self.step(i, y, watched, tuple(next(given) if k else c for c, k in zip(x, known)))
                return tuple(new), tuple(seen)

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

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        count, *rest = fixed
        new, seen = self.step(i, moved, watched, tuple(rest))
        keep = lambda a, b: tuple(jnp.where(i < count, x, y) for x, y in zip(a, b, strict=True))
        return keep(new, moved), keep(seen, watched)


def _limited(step: Any) -> Any:
    """The step that stops after a count of its own, tangents outside."""
    if not isinstance(step, Tangent):
        return Limited(step)
    known = tuple((False, *row) for row in step.known)
    return Tangent(_limited(step.step), _one_more(step.sizes), known, Limited(step.loose))


def _one_more(sizes: Sizes) -> Sizes:
    return sizes._replace(fixed=sizes.fixed + 1)


# --- what fits into a kernel ---------------------------------------------------------------------------------------


def _operations(step: Step, sizes: Sizes) -> int:
    return len(program_of(step, sizes).jaxpr.eqns)


def _share(tangent: Tangent) -> bool:
    """Whether all directions of a step go into one kernel."""
    return len(tangent.known) <= DIRECTIONS and _operations(tangent, tangent.whole) <= LARGEST[_ours.get()]


def is_elementary(step: Step, sizes: Sizes) -> bool:
    """Whether `step` is made of elementary operations on scalars alone."""
    if isinstance(step, Tangent):
        return is_elementary(step.step, step.sizes)
    program = program_of(step, sizes)
    caught = any(isinstance(c, Tracer) for c in program.consts)
    scalar = lambda e: not any(v.aval.shape for v in (*e.invars, *e.outvars))
    plain = all(e.primitive.name not in CONTROL_FLOW and scalar(e) for e in program.jaxpr.eqns)
    return not caught and plain and _in_order()


@functools.cache
def _in_order() -> bool:
    """Whether the backend reduces a window of one element as body(init, element): a reduction leaves the order free."""
    with jax.ensure_compile_time_eval():
        first, second = jnp.asarray([5.0, 7.0]), jnp.asarray([1.0, 2.0])
        got = _lanewise(lambda s, x: (s[0] - 3 * x[0], s[0] * x[1]), (jnp.asarray(2.0),), (first, second))
        return bool(jnp.all(got[0] == 2 - 3 * first) & jnp.all(got[1] == 2 * second))


# --- loops ---------------------------------------------------------------------------------------------------------


def _plain(step: Step, count: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
    """The same loop, left to XLA."""

    def body(i: Array, carry: tuple[Numbers, Numbers]) -> tuple[Numbers, Numbers]:
        moved, watched = step(i.astype(float), *carry, fixed)
        return tuple(moved), tuple(jax.lax.stop_gradient(x) for x in watched)

    return jax.lax.fori_loop(0, count, body, (moved, tuple(jax.lax.stop_gradient(x) for x in watched)))


def _loose(how: How, count: Any, *numbers: Any) -> list[Any]:
    """The march left to XLA, in every lane."""
    step, sizes = how.step, how.sizes
    if isinstance(step, Tangent):
        return _loose_tangents(step, count, *sizes.split(numbers))

    def run(*x: Any) -> list[Any]:
        moved, watched = _plain(how.loose, count, *sizes.split(x))
        return [*moved, *watched]

    shape = max((jnp.shape(x) for x in numbers), key=len)
    if not shape:
        return run(*numbers)
    flat = [x.reshape(-1) if jnp.shape(x) else x for x in numbers]
    out = jax.vmap(run, in_axes=tuple(0 if jnp.ndim(x) else None for x in numbers), out_axes=0)(*flat)
    return [x.reshape(shape) for x in out]


def _loose_tangents(step: Tangent, count: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> list[Any]:
    """The same with tangent vectors, their directions an axis of arrays: written out they would be too much."""
    inner, size = How(step.step, step.loose, step.sizes, 1), step.sizes.moved
    y, *tangents = _rows(moved, size)
    x, rest = fixed[: step.sizes.fixed], iter(fixed[step.sizes.fixed :])
    drifts = [[next(rest) if k else jnp.zeros_like(c) for c, k in zip(x, row, strict=True)] for row in step.known]

    def go(y: list[Any], x: list[Any]) -> tuple[list[Any], list[Any]]:
        out = _loose(inner, count, *y, *watched, *x)
        return out[:size], out[size:]

    along = lambda t, d: jax.jvp(go, (list(y), list(x)), (t, d), has_aux=True)
    stacked = [[jnp.stack(c) for c in zip(*rows, strict=True)] for rows in (tangents, drifts)]
    values, slopes, seen = jax.vmap(along, out_axes=(None, 0, None))(*stacked)
    return [*values, *(c[k] for k in range(len(tangents)) for c in slopes), *seen]


def _lanewise(
    f: Callable[[Numbers, Numbers], Sequence[Any]], shared: Sequence[Array], lanes: Sequence[Array]
) -> tuple[Array, ...]:
    """f(shared, lane) in every lane by one reduction: shared scalars, arrays of one axis."""
    results = len(jax.eval_shape(f, tuple(shared), tuple(x[0] for x in lanes)))
    width = max(len(shared), len(lanes), results)  # as many results as operands
    operands = [*lanes, *[lanes[0]] * (width - len(lanes))]
    inits = [*shared, *[jnp.zeros(())] * (width - len(shared))]

    def body(first: tuple[Array, ...], second: tuple[Array, ...]) -> tuple[Array, ...]:
        out = f(tuple(first[: len(shared)]), tuple(second[: len(lanes)]))
        return (*out, *second[results:])

    return tuple(jax.lax.reduce_window(tuple(operands), tuple(inits), body, (1,), (1,), "VALID")[:results])


def _loops(count: Array, *numbers: Array, how: How) -> tuple[Array, ...]:
    """The march on a CPU: a loop over kernels, each a loop along the lanes."""
    step, _, sizes, multiple = how
    if _operations(step, sizes) > LARGEST[_ours.get()]:
        return tuple(_loose(how, count, *numbers))
    shape = max((x.shape for x in numbers), key=len)
    lanes = math.prod(shape)
    moving = sizes.moved + sizes.watched
    row = tuple(jnp.broadcast_to(x, shape).reshape(lanes) for x in numbers[:moving])
    fixed = [x.reshape(lanes) if x.shape else x for x in numbers[moving:]]
    operations = _operations(step, sizes)
    most = 1 if isinstance(step, Tangent) else min(TOGETHER, LARGEST[_ours.get()]) // operations
    together = max(d for d in range(1, multiple + 1) if multiple % d == 0 and (d == 1 or d <= most))
    program = program_of(Several(step, together) if together > 1 else step, sizes)
    used = [i - 1 - moving for i in program.needed if i > moving]
    alike, own = [i for i in used if not fixed[i].shape], [i for i in used if fixed[i].shape]

    def kernel(shared: Numbers, lane: Numbers) -> Sequence[Any]:
        known = dict(zip((*alike, *own), (*shared[1:], *lane[moving:]), strict=True))
        return program(shared[0], *lane[:moving], *(known.get(i, 0.0) for i in range(len(fixed))))

    shared, varying = [fixed[i] for i in alike], [fixed[i] for i in own]

    def body(i: Array, row: tuple[Array, ...]) -> tuple[Array, ...]:
        return _lanewise(kernel, [(i * together).astype(float), *shared], (*row, *varying))

    row = jax.lax.fori_loop(0, count // together, body, row)
    return tuple(x.reshape(shape) for x in row)


def _kernel_on_gpu(count: Array, *numbers: Array, how: How) -> tuple[Array, ...]:
    from ._device import march_on_device

    program, moved = program_of(how.step, how.sizes), how.sizes.moved + how.sizes.watched
    return march_on_device(program, moved, [i - 1 for i in program.needed if i > moved], count, numbers)


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
        how = How(_limited(how.step), Limited(how.loose), _one_more(how.sizes), how.multiple)
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
        values = march_p.bind(count, *y, *watched, *x, how=How(step.step, step.loose, inner, how.multiple))
        out = _lanes(args, mapped, size, how)
        out = [*values[: inner.moved], *out[inner.moved : sizes.moved], *values[inner.moved :]]
    else:
        slices = lambda k, row, flags: [v[k] if m else v for v, m in zip(row, flags, strict=True)]
        tangents = [v for k in range(size) for v in slices(k, moved[inner.moved :], moved_mapped[inner.moved :])]
        drifts = [v for k in range(size) for v in slices(k, fixed[inner.fixed :], fixed_mapped[inner.fixed :])]
        shared = How(several, several.loose, several.whole, how.multiple)
        got = march_p.bind(count, *y, *tangents, *watched, *x, *drifts, how=shared)
        width = inner.moved * old
        each = [got[inner.moved + k * width : inner.moved + (k + 1) * width] for k in range(size)]
        stacked = [jnp.stack(c) for c in zip(*each, strict=True)]
        out = [*got[: inner.moved], *stacked, *got[several.whole.moved :]]
    axes = [batching.not_mapped] * inner.moved + [0] * (sizes.moved - inner.moved)
    return out, [*axes, *[batching.not_mapped] * sizes.watched]


def _jvp(primals: Sequence[Any], tangents: Sequence[Any], *, how: How) -> Any:
    count, *numbers = primals
    sizes = how.sizes
    moved, watched, fixed = sizes.split(numbers)
    moved_dot, _, fixed_dot = sizes.split(tangents[1:])
    known = tuple(not isinstance(d, ad.Zero) for d in fixed_dot)
    pushed = [ad.instantiate_zeros(d) for d in moved_dot]
    along = Tangent(how.step, sizes, (known,), how.loose)
    if _operations(along, along.whole) > LARGEST[_ours.get()]:
        rest = [ad.instantiate_zeros(d) for d in tangents[1 + sizes.moved :]]
        values, slopes = jax.jvp(functools.partial(_loose, how, count), numbers, [*pushed, *rest])
        return values, slopes
    drifts = [d for d, k in zip(fixed_dot, known, strict=True) if k]
    shared = How(along, along.loose, along.whole, how.multiple)
    out = march_p.bind(count, *moved, *pushed, *watched, *fixed, *drifts, how=shared)
    values, slopes, seen = out[: sizes.moved], out[sizes.moved : 2 * sizes.moved], out[2 * sizes.moved :]
    none = [ad.Zero(jax.typeof(x).to_tangent_aval()) for x in seen]
    return [*values, *seen], [*slopes, *none]


march_p.def_impl(lambda *args, how: _compiled(how)(*args))
march_p.def_abstract_eval(_abstract)
batching.primitive_batchers[march_p] = _batch
ad.primitive_jvps[march_p] = _jvp
mlir.register_lowering(march_p, mlir.lower_fun(_loops, multiple_results=True))
mlir.register_lowering(march_p, mlir.lower_fun(_kernel_on_gpu, multiple_results=True), platform="gpu")
