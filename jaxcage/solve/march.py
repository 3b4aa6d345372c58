"""Many steps of one scalar function as a JAX primitive, compiled to one loop of machine code over lanes.

A step is written for a single lane, on scalars:
- `jax.vmap` adds lanes; numbers common to all lanes remain scalars;
- `jax.jvp` and `jax.jacfwd` add tangent vectors to the step, to any order; several directions share its values;
- on a CPU JAX's program calls machine code (`ir`, `object_code`), in a few microseconds and without compilation by XLA;
  elsewhere, and for a step with an operation that has no translation, the loop runs inside JAX.

Reverse mode goes through columns: a Jacobian matrix in forward mode, transposed (`orbits.newton.by_columns`).
"""

import dataclasses
import functools
import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
import jax.extend as jex
import jax.numpy as jnp
from jax.core import Tracer
from jax.interpreters import ad, batching, mlir, partial_eval
from jaxtyping import Array, Int

from .._errors import InputError
from .ir import Code, Function, UnknownOperation, Value, module, number, say_once
from .object_code import UnknownInterface, handler, registered, word
from .program import CONTROL_FLOW, Numbers, Sizes, Step, program_of


WIDTH = 8
"""Maximum number of lanes per vector."""
DIRECTIONS = 8
"""Maximum number of directions that share the values of a step; more become separate lanes."""


class How(NamedTuple):
    """Static arguments of the integration loop."""

    step: Any
    sizes: Sizes


def march(
    step: Step,
    count: Int[Array, ""] | int,
    moved: Sequence[Any],
    watched: Sequence[Any] = (),
    fixed: Sequence[Any] = (),
) -> tuple[Numbers, Numbers]:
    """Take `count` steps.

    **Arguments:** step; number of steps (an array, so that one program serves all); moved, watched and fixed numbers.

    **Returns:** final moved and watched numbers.
    """
    sizes = Sizes(len(moved), len(watched), len(fixed))
    if not is_elementary(step, sizes, fixed):
        return _plain(step, count, tuple(moved), tuple(watched), tuple(fixed))
    numbers = [jnp.asarray(x, dtype=float) for x in (*moved, *watched, *fixed)]
    out = march_p.bind(jnp.asarray(count, jnp.int32), *numbers, how=How(step, sizes))
    return sizes._replace(fixed=0).split(out)[:2]


def march_with_tangents(
    step: Step,
    count: Int[Array, ""] | int,
    moved: Sequence[Any],
    watched: Sequence[Any],
    fixed: Sequence[Any],
    tangents: Sequence[Sequence[Any]],
    fixed_tangents: Sequence[Sequence[Any]] = (),
) -> tuple[Numbers, Numbers, tuple[Numbers, ...]]:
    """Take `count` steps and transport tangent vectors.

    **Arguments:** as for `march`; tangent vectors of the moved numbers; for each of them those of the fixed numbers,
    None for zero (the default).

    **Returns:** final moved and watched numbers, and tangent vectors of the moved numbers.
    """
    if not tangents:
        return *march(step, count, moved, watched, fixed), ()
    sizes = Sizes(len(moved), len(watched), len(fixed))
    along = list(fixed_tangents) or [(None,) * len(fixed)] * len(tangents)
    known = tuple(tuple(x is not None for x in row) for row in along)
    several = Tangent(step, sizes, known)
    if _share(several) and is_elementary(step, sizes, fixed):
        pushed, drifts = [x for t in tangents for x in t], [x for row in along for x in row if x is not None]
        y, seen = march(several, count, (*moved, *pushed), watched, (*fixed, *drifts))
        return y[: sizes.moved], seen, tuple(_rows(y[sizes.moved :], sizes.moved))

    filled = [tuple(jnp.zeros_like(x) if d is None else d for x, d in zip(fixed, row, strict=True)) for row in along]
    go = lambda start: march(step, count, start[0], watched, start[1])
    pushed = list(zip(map(tuple, tangents), filled, strict=True))
    y, after, seen = with_tangents(go, (tuple(moved), tuple(fixed)), pushed)
    return y, seen, after


def with_tangents(move: Callable[[Any], Any], start: Any, tangents: Sequence[Any]) -> tuple[Any, tuple[Any, ...], Any]:
    """Evaluate `move(start)`, a pair (result, auxiliary values), and differentiate it along each tangent; return the
    result, its tangents, and the auxiliary values."""
    if not tangents:
        end, seen = move(start)
        return end, (), seen
    along = lambda tangent: jax.jvp(move, (start,), (tangent,), has_aux=True)
    if len(tangents) == 1:
        end, after, seen = along(tangents[0])
        return end, (after,), seen
    stacked = jax.tree.map(lambda *x: jnp.stack(x), *tangents)
    end, after, seen = jax.vmap(along, out_axes=(None, 0, None))(stacked)
    return end, tuple(jax.tree.map(lambda x: x[i], after) for i in range(len(tangents))), seen


def _rows(numbers: Sequence[Any], size: int) -> Iterator[Numbers]:
    return (tuple(numbers[i : i + size]) for i in range(0, len(numbers), size))


@dataclasses.dataclass(frozen=True)
class Tangent:
    """A step with tangent vectors: moved (y, T_1, T_2, ...), fixed (x, the nonzero tangents of x in each direction)."""

    step: Step
    sizes: Sizes
    known: tuple[tuple[bool, ...], ...]
    """True, in each direction, for every fixed number that has a tangent."""

    @property
    def whole(self) -> Sizes:
        """Sizes including the tangents."""
        moved, watched, fixed = self.sizes
        return Sizes(moved * (1 + len(self.known)), watched, fixed + sum(map(sum, self.known)))

    def __call__(self, i: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:
        y, *tangents = _rows(moved, self.sizes.moved)
        x, drifts = fixed[: self.sizes.fixed], iter(fixed[self.sizes.fixed :])
        step = program_of(self.step, self.sizes, rules=True)

        @functools.cache
        def linear(known: tuple[bool, ...]) -> Any:
            """Value, linear map by y and the known x, and watched numbers."""

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


def _share(tangent: Tangent) -> bool:
    """True if all directions of a step are computed together, which is not done for higher derivatives."""
    return not isinstance(tangent.step, Tangent) and len(tangent.known) <= DIRECTIONS


def is_elementary(step: Step, sizes: Sizes, fixed: Sequence[Any]) -> bool:
    """True if `step` consists of elementary operations on scalars."""
    if any(jnp.ndim(x) for x in fixed):
        return False
    if isinstance(step, Tangent):
        return is_elementary(step.step, step.sizes, ())
    program = program_of(step, sizes)
    caught = any(isinstance(c, Tracer) for c in program.consts)
    scalar = lambda e: not any(v.aval.shape for v in (*e.invars, *e.outvars))
    return not caught and all(e.primitive.name not in CONTROL_FLOW and scalar(e) for e in program.jaxpr.eqns)


# --- loops ---------------------------------------------------------------------------------------------------------


def _plain(step: Step, count: Any, moved: Numbers, watched: Numbers, fixed: Numbers) -> tuple[Numbers, Numbers]:

    def body(i: Array, carry: tuple[Numbers, Numbers]) -> tuple[Numbers, Numbers]:
        moved, watched = step(i.astype(float), *carry, fixed)
        return tuple(moved), tuple(jax.lax.stop_gradient(x) for x in watched)

    return jax.lax.fori_loop(0, count, body, (moved, tuple(jax.lax.stop_gradient(x) for x in watched)))


def _shape_of(*numbers: Any) -> tuple[int, ...]:
    """Shape of the lanes, which numbers that are common to all of them do not have."""
    return max((x.shape for x in numbers), key=len)


def _inside_jax(count: Array, *numbers: Array, how: How) -> list[Array]:
    """Loop in JAX without machine code; numbers common to all lanes are scalars."""

    def lane(count: Array, *numbers: Array) -> list[Array]:
        out = _plain(how.step, count, *how.sizes.split(numbers))
        return [*out[0], *out[1]]

    for _ in _shape_of(count, *numbers):
        lane = jax.vmap(lane, in_axes=tuple(0 if x.shape else None for x in (count, *numbers)))
    return lane(count, *numbers)


def _on_cpu(count: Array, *numbers: Array, how: How) -> list[Array]:
    """Call of machine code: a loop over vectors of lanes around one over steps."""
    shape = _shape_of(count, *numbers)
    lanes, moving = math.prod(shape), how.sizes.moved + how.sizes.watched
    wide = tuple(bool(x.shape) for x in numbers[moving:])
    width = min(WIDTH, 1 << lanes.bit_length() >> 1)
    found = code_of(how.step, how.sizes, wide, width, bool(count.shape)) if lanes else None
    if found is None:
        return _inside_jax(count, *numbers, how=how)
    name, read = found
    each = lambda x: jnp.broadcast_to(x, shape).reshape(lanes)
    row, limit = [each(x) for x in numbers[:moving]], [each(count.astype(float))] if count.shape else []
    given = [numbers[moving + k].reshape((lanes,) if wide[k] else ()) for k in read]
    call = jax.ffi.ffi_call(name, [jax.ShapeDtypeStruct((lanes,), float)] * moving)
    counts = jnp.stack([jnp.max(count, initial=0), jnp.int32(lanes)])
    return [x.reshape(shape) for x in call(counts, *row, *given, *limit)]


@functools.lru_cache(maxsize=256)
def code_of(
    step: Any, sizes: Sizes, wide: tuple[bool, ...], width: int, limited: bool
) -> tuple[str, tuple[int, ...]] | None:
    """XLA's name for the machine code of a step, and the indices of the fixed numbers it reads; None, after a warning,
    if the step cannot be translated."""
    moving = sizes.moved + sizes.watched
    program = program_of(step, sizes)
    read = tuple(i - 1 - moving for i in program.needed if i > moving)
    try:
        ir = module(loop_ir(program, moving, [(k, wide[k]) for k in read], width, limited), handler())
    except (UnknownOperation, UnknownInterface) as unknown:
        say_once(str(unknown))
        return None
    name = "jaxcage_" + hashlib.sha256(ir.encode()).hexdigest()[:24]
    registered(ir, name)
    return name, read


def loop_ir(program: Any, moving: int, read: Sequence[tuple[int, bool]], width: int, limited: bool) -> Function:
    """Code of `march(inputs, outputs)`: the loop over steps of a program (step number, numbers) -> the first `moving`.

    Inputs are XLA's buffers of the counts of steps and of lanes, the moving numbers, and those that are `read`, given
    by their indices after these, with True if they differ from lane to lane; if `limited`, also the count of each lane.
    There must be at least `width` lanes: the last vector overlaps the one before it.
    """
    w = Code(width)
    buffer = lambda base, k: word(w, word(w, base, k), 3)  # word 3 of a buffer is the pointer to its data
    counts = buffer("%in", 0)
    steps, lanes = (w.convert("sext", w.load(w.element(counts, k, "i32"), "i32"), "i64") for k in (0, 1))
    inputs = [buffer("%in", 1 + k) for k in range(moving + len(read) + limited)]
    outputs = [buffer("%out", k) for k in range(moving)]
    given = list(zip(read, inputs[moving:], strict=False))
    shared = {k: w.load(x) for (k, wide), x in given if not wide}
    last = w.sub(lanes, number(width))

    def vector(start: Value, _: Any) -> None:
        start = w.call("smin", start, last)
        load = lambda x: w.load(w.element(x, start), wide=True, how=", align 8")
        known = {**shared, **{k: load(x) for (k, wide), x in given if wide}}
        fixed = [known.get(k, number(0.0)) for k in range(len(program.jaxpr.invars) - 1 - moving)]

        limit = load(inputs[-1]) if limited else None
        end = w.convert("fptosi", w.largest(limit), "i64") if limit else steps

        def step(i: Value, state: list[Value]) -> list[Value]:
            number_of = w.convert("sitofp", i, "double")
            new = [w.widened(x) for x in w.program(program, [number_of, *state, *fixed])]
            if limit is None:
                return new
            goes_on = w.compare("lt", number_of, limit)
            return [w.select(goes_on, a, b) for a, b in zip(new, state, strict=True)]

        begun = [load(x) for x in inputs[:moving]]
        ends = w.when(w.compare("gt", end, number(0)), lambda: w.loop(end, begun, step), otherwise=begun)
        for x, value in zip(outputs, ends, strict=True):
            w.store(value, w.element(x, start), ", align 8")

    w.loop(lanes, [], vector, width)
    return w.function("march", "ptr %in, ptr %out")


# --- the primitive -------------------------------------------------------------------------------------------------

march_p = jex.core.Primitive("march")
march_p.multiple_results = True


def _abstract(count: Any, *numbers: Any, how: How) -> list[Any]:
    return [numbers[0].update(shape=_shape_of(count, *numbers))] * (how.sizes.moved + how.sizes.watched)


def _batch(args: Sequence[Any], dims: Sequence[Any], *, how: How) -> Any:
    mapped = [d is not None for d in dims]
    size = next(x.shape[d] for x, d, m in zip(args, dims, mapped, strict=True) if m)
    args = [jnp.moveaxis(x, d, 0) if m else x for x, d, m in zip(args, dims, mapped, strict=True)]
    if isinstance(how.step, Tangent):
        moved, watched, fixed = how.sizes.split(mapped[1:])
        inner = how.step.sizes
        if not any((mapped[0], *moved[: inner.moved], *watched, *fixed[: inner.fixed])):
            return _directions(args, mapped, size, how)
    return _lanes(args, mapped, size, how), [0] * (how.sizes.moved + how.sizes.watched)


def _lanes(args: Sequence[Any], mapped: Sequence[bool], size: int, how: How) -> Any:
    """Batch all numbers, with the new axis first; numbers common to all lanes remain scalars."""
    shape = max((x.shape[m:] for x, m in zip(args, mapped, strict=True)), key=len)

    def spread(x: Any, m: bool) -> Any:
        if not m and not x.shape:
            return x
        x = x if m else x[None]
        return jnp.broadcast_to(x.reshape(x.shape + (1,) * (1 + len(shape) - x.ndim)), (size, *shape))

    return march_p.bind(*map(spread, args, mapped), how=how)


def _directions(args: Sequence[Any], mapped: Sequence[bool], size: int, how: How) -> Any:
    """Batch the tangents alone, so that values are computed once."""
    count, *numbers = args
    step, sizes = how.step, how.sizes
    inner, old = step.sizes, len(step.known)
    moved, watched, fixed = sizes.split(numbers)
    moved_mapped, _, fixed_mapped = sizes.split(mapped[1:])
    y, x = moved[: inner.moved], fixed[: inner.fixed]
    several = dataclasses.replace(step, known=step.known * size)
    if not _share(several):
        out = _lanes(args, mapped, size, how)
        once = lambda row: [x[0] for x in row]  # values are equal in all lanes
        out = [*once(out[: inner.moved]), *out[inner.moved : sizes.moved], *once(out[sizes.moved :])]
    else:
        slices = lambda k, row, flags: [v[k] if m else v for v, m in zip(row, flags, strict=True)]
        tangents = [v for k in range(size) for v in slices(k, moved[inner.moved :], moved_mapped[inner.moved :])]
        drifts = [v for k in range(size) for v in slices(k, fixed[inner.fixed :], fixed_mapped[inner.fixed :])]
        shared = How(several, several.whole)
        got = march_p.bind(count, *y, *tangents, *watched, *x, *drifts, how=shared)
        width = inner.moved * old
        each = [got[inner.moved + k * width : inner.moved + (k + 1) * width] for k in range(size)]
        stacked = [jnp.stack(c) for c in zip(*each, strict=True)]
        out = [*got[: inner.moved], *stacked, *got[several.whole.moved :]]
    axes = [None] * inner.moved + [0] * (sizes.moved - inner.moved)
    return out, [*axes, *[None] * sizes.watched]


def _jvp(primals: Sequence[Any], tangents: Sequence[Any], *, how: How) -> Any:
    count, *numbers = primals
    step, sizes = how
    moved, watched, fixed = sizes.split(numbers)
    moved_dot, _, fixed_dot = sizes.split(tangents[1:])
    known = tuple(not isinstance(d, ad.Zero) for d in fixed_dot)
    pushed = [ad.instantiate_zeros(d) for d in moved_dot]
    along = Tangent(step, sizes, (known,))
    drifts = [d for d, k in zip(fixed_dot, known, strict=True) if k]
    out = march_p.bind(count, *moved, *pushed, *watched, *fixed, *drifts, how=How(along, along.whole))
    values, slopes, seen = out[: sizes.moved], out[sizes.moved : 2 * sizes.moved], out[2 * sizes.moved :]
    none = [ad.Zero(jax.typeof(x).to_tangent_aval()) for x in seen]
    return [*values, *seen], [*slopes, *none]


def _partial(_: Any, *tracers: Any, how: How) -> Any:
    """Evaluate with known numbers; values and tangents come from one loop, so that reverse mode cannot part them."""
    if all(x.pval.is_known() for x in tracers):
        return march_p.bind(*(x.pval.get_known() for x in tracers), how=how)
    allowed = "must be differentiated in forward mode (`jax.jvp`, `jax.jacfwd`)"
    raise InputError(f"A trajectory {allowed}, but reverse mode (`jax.grad`, `jax.vjp`, `jax.linearize`) was used.")


march_p.def_impl(jax.jit(march_p.bind, static_argnames="how"))
march_p.def_abstract_eval(_abstract)
batching.primitive_batchers[march_p] = _batch
ad.primitive_jvps[march_p] = _jvp
partial_eval.custom_partial_eval_rules[march_p] = _partial
mlir.register_lowering(march_p, mlir.lower_fun(_inside_jax, multiple_results=True))
mlir.register_lowering(march_p, mlir.lower_fun(_on_cpu, multiple_results=True), platform="cpu")
