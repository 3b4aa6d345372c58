"""Programs of a model for the integration loop, traced in JAX: rates, excursion and steps, and their numbers."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._pytrees import Form, split
from ..forces import cos_sin
from ..models import (
    BESIDE,
    MOVING,
    OF_BODIES,
    OF_ROLLER,
    WATCHED,
    AbstractForcedSystem,
    Bodies,
    Passed,
    Rollers,
    ScaledField,
    multiply,
)
from .ir import Code, Function, UnknownOperation, Value, number
from .kernel import rosenbrock_step
from .layout import Field, Layout, fixed_numbers, rates_arguments
from .program import Program, Sizes, depends, following, needed, program_of, variables


PASSED, NORMAL = len(Passed._fields), Passed._fields.index("normal")


def _traced(f: Callable[[Any, Any, Any], Any], moved: int, fixed: int) -> Program:
    """Program of a function of (phase, integrated numbers, fixed numbers)."""
    return program_of(lambda phase, moved, _, fixed: (f(phase, moved, fixed), ()), Sizes(moved, 0, fixed))


def _floats(numbers: Any) -> tuple[Any, ...]:
    return tuple(jnp.asarray(x, dtype=float) for x in numbers)


def _with_tangents(go: Callable[[Any], Any], numbers: Any, size: int, tangents: int) -> tuple[Any, ...]:
    """Values of `go`, their tangents along the vectors after the first `size` numbers, and its auxiliary results."""
    y, out = tuple(numbers[:size]), []
    values, seen = go(y)
    for k in range(1, 1 + tangents):
        along = tuple(numbers[k * size : (k + 1) * size])
        out += jax.jvp(lambda y: go(y)[0], (y,), (along,))[1]
    return (*values, *out, *seen)


def _hoisted(program: Program, moving: int) -> tuple[Program, Program]:
    """Split a program into one of the fixed numbers alone, and one with that one's results as further arguments."""
    jaxpr = program.jaxpr
    moved = following(jaxpr.eqns, jaxpr.invars[: 1 + moving])
    # Masks and integers are computed again.
    early = lambda e: e.outvars[0] not in moved and e.outvars[0].aval.dtype == np.dtype(float)
    late = needed([e for e in jaxpr.eqns if not early(e)], jaxpr.outvars)
    wanted = variables(jaxpr.outvars).union(*(variables(e.invars) for e in late))
    made = [e.outvars[0] for e in jaxpr.eqns if early(e) and e.outvars[0] in wanted]
    prelude = jaxpr.replace(invars=jaxpr.invars[1 + moving :], eqns=needed(jaxpr.eqns, made), outvars=made)
    rest = jaxpr.replace(invars=[*jaxpr.invars, *made], eqns=late)
    return Program(prelude, program.consts), Program(rest, program.consts)


def _pieces(system: AbstractForcedSystem, speed: Any) -> tuple[Form, list[Any]]:
    """Field, system and scale at a speed, and their numbers; for a whole bearing no system, and the scale of only one
    roller and the bodies."""
    field, scale = system.at_speed(speed), system.scale(speed)
    if system.beside:
        short = tuple(scale[i] for i in (*range(OF_ROLLER), *range(-OF_BODIES, 0)))
        return split((field, None, short), eqx.is_inexact_array)
    return split((field, system, scale), eqx.is_inexact_array)


def numbers_at(system: AbstractForcedSystem, speed: Any) -> tuple[list[Any], Any]:
    """Numbers of the field at a speed, and the factor on the number of steps (`AbstractForcedSystem.slowness`)."""
    return _pieces(system, speed)[1], system.slowness(speed)


def shape_of_numbers(system: AbstractForcedSystem, several: bool) -> tuple[Form, tuple[bool, ...]]:
    """Form of field, system and scale, and True for those of their numbers that differ from lane to lane: those that
    depend on the speed, or all for `several` designs.

    **Raises:** `UnknownOperation` for arrays of numbers.
    """
    form, numbers = _pieces(system, jnp.asarray(1.0))
    if any(map(jnp.ndim, numbers)):
        raise UnknownOperation("array")
    moved = depends(lambda speed: _floats(_pieces(system, speed)[1]), 1.0)
    return form, tuple(several or each for each in moved)


def traced_field(
    system: AbstractForcedSystem,
    form: Form,
    wide: tuple[bool, ...],
    tangents: int,
    sampled: bool = False,
    implicit: bool = False,
) -> Field:
    """Programs of a system, with one strobe state per revolution or, if `sampled`, several."""
    if system.beside:
        return bearing_field(form, wide, system.dimension, tangents)
    n, moving = system.dimension, system.dimension * (1 + tangents)

    def rates(phase: Any, moved: Any, fixed: Any) -> Any:
        """Rates of a state and of tangent vectors, in units of the scale."""
        field, _, scale = form.filled(fixed)
        go = lambda y: _floats(ScaledField(field, scale)(phase, y))
        if not tangents:
            return go(moved)
        pushed = [jax.jvp(go, (moved[:n],), (moved[i : i + n],)) for i in range(n, moving, n)]
        return (*pushed[0][0], *(c for _, each in pushed for c in each))

    def step(phase: Any, moved: Any, fixed: Any) -> Any:
        """Rosenbrock step in units of the scale: from its length, state and tangent vectors to state and tangent
        vectors at its end, and their estimated errors."""
        (field, _, scale), (h, *y) = form.filled(fixed), moved

        def go(y: Any) -> Any:
            y1, error, _ = rosenbrock_step(ScaledField(field, scale), phase, lambda _: h, y)
            return _floats((*y1, *error)), ()

        found = _with_tangents(go, y, n, tangents)
        halves = [found[i : i + n] for i in range(0, 2 * moving, n)]
        return [c for half in (*halves[::2], *halves[1::2]) for c in half]

    def excursion(_: Any, moved: Any, fixed: Any) -> Any:
        _, system, scale = form.filled(fixed)
        return (system.excursion(multiply(moved, scale)),)

    def abrupt(_: Any, moved: Any, fixed: Any) -> Any:
        _, system, scale = form.filled(fixed)
        return system.abrupt(multiply(moved[:n], scale), multiply(moved[n:], scale))

    trace = lambda f, moved: _traced(f, moved, len(wide))
    prelude, late = _hoisted(trace(rates, moving), moving)
    ones = tuple(jnp.ones(()) for _ in range(n))
    near = None if system.abrupt(ones, ones) is None else trace(abrupt, 2 * n)
    own_step = trace(step, 1 + moving) if implicit else None
    programs = prelude, late, trace(excursion, n), near
    return Field(*programs, n, tangents, wide, own_step, phased=sampled)


class RollersCode(NamedTuple):
    """Programs of a bearing, and the code of its rates as a loop over the rollers."""

    rollers: int
    roller: Program
    bodies: Program
    angle: Program
    """Program for the cosine and sine of the cage's angle."""

    def code(self, field: Field, rows: Layout, width: int) -> Function:
        """Code of `rates`, from state, tangents and additional integrands at `place` to their rates at `out`."""
        w = Code(width)
        z, size, tangents = self.rollers, field.dimension, field.tangents
        load = lambda first, count: [w.get(first + k, base="%place") for k in range(count)]
        own = [load(z * OF_ROLLER + size * t, OF_BODIES) for t in range(1 + tangents)]
        phase = w.get(size * (1 + tangents), base="%place")
        cos, sin = w.program(self.angle, [number(0.0), phase])
        places = 2 * np.pi / z * np.arange(z)
        table = ", ".join(f"double {number(x)}" for pair in zip(np.cos(places), np.sin(places)) for x in pair)
        # MOVING sums for the values and for each tangent, then the other sums, then the largest force and slip.
        moving, others = MOVING * (1 + tangents), PASSED - MOVING

        def roller(at: Any, sums: list[Value]) -> list[Value]:
            j = at(0)
            cos_at = w.element("@places", w.mul(j, number(2)))
            place = [w.load(cos_at), w.load(w.element(cos_at, 1))]
            first = w.mul(j, number(OF_ROLLER))
            row = lambda k: w.add(first, number(k))
            numbers: list[Value] = []
            for t in range(1 + tangents):
                numbers += [w.get(row(size * t + k), base="%place") for k in range(OF_ROLLER)] + own[t]
            arguments = [number(0.0), *place, cos, sin, *numbers]
            fixed = fixed_numbers(w, field, rows, self.roller, len(arguments))
            results, passed = w.program(self.roller, [*arguments, *fixed]), []
            for t in range(1 + tangents):
                part = results[t * (OF_ROLLER + MOVING) : (t + 1) * (OF_ROLLER + MOVING)]
                for k, x in enumerate(part[:OF_ROLLER]):
                    w.put(row(size * t + k), x, base="%out")
                passed += part[OF_ROLLER:]
            *rest, slip = results[(1 + tangents) * (OF_ROLLER + MOVING) :]
            added = [w.add(s, w.widened(x)) for s, x in zip(sums, [*passed, *rest], strict=False)]
            largest = zip(sums[-2:], (rest[NORMAL - MOVING], slip), strict=True)
            return added + [w.larger(w.widened(x), s) for s, x in largest]

        begin = [number(0.0)] * (moving + others) + [number(-np.inf)] * 2
        new = w.over(z, begin, roller, written_out=0)
        numbers: list[Value] = []
        for t in range(1 + tangents):
            numbers += own[t] + new[t * MOVING : (t + 1) * MOVING]
        arguments = [number(0.0), cos, sin, *numbers, *new[moving:]]
        fixed = fixed_numbers(w, field, rows, self.bodies, len(arguments))
        results = w.program(self.bodies, [*arguments, *fixed])
        for t in range(1 + tangents):
            for k in range(OF_BODIES):
                w.put(size * t + z * OF_ROLLER + k, results[t * OF_BODIES + k], base="%out")
        for k, x in enumerate(results[(1 + tangents) * OF_BODIES :]):
            w.put(size * (1 + tangents) + k, x, base="%out")
        text, declarations = w.function("rates", rates_arguments(w))
        return f"@places = internal constant [{2 * z} x double] [{table}]\n{text}", declarations


def bearing_field(form: Form, wide: tuple[bool, ...], dimension: int, tangents: int) -> Field:
    """Programs of a whole bearing: the forces on a roller are traced once, as a function of that roller, cage and ring;
    the code evaluates it for each roller and adds up the contributions to the bodies."""

    def roller(_: Any, moved: Any, fixed: Any) -> Any:
        """Rates of a roller, and its contributions to the bodies.

        `moved` holds cosine and sine of the pocket's angle in the cage, those of the cage's angle, the numbers of the
        roller and the bodies, and the tangents of both. Results are rates and the first `MOVING` of `Passed`, the
        tangents of these, the rest of `Passed`, and the slip.
        """
        (cos_j, sin_j, cos, sin), numbers = moved[:4], moved[4:]
        at, _, units = form.filled(fixed)
        pocket = cos * cos_j - sin * sin_j, sin * cos_j + cos * sin_j

        def go(y: Any) -> tuple[Any, Any]:
            y = [a * u for a, u in zip(y, units, strict=True)]
            rollers, cage = Rollers(*y[:OF_ROLLER]), Bodies(*y[OF_ROLLER:])
            rates, passed = at.roller_rates(rollers, cage, at.on_roller(rollers, cage, *pocket))
            pace = at.pace(cage.cage_speed)
            rates = [pace * x / u for x, u in zip(rates, units, strict=False)]
            return _floats((*rates, *passed[:MOVING])), _floats((*passed[MOVING:], at.slip(rollers.spin)))

        return _with_tangents(go, numbers, OF_ROLLER + OF_BODIES, tangents)

    def bodies(_: Any, moved: Any, fixed: Any) -> Any:
        """Rates of cage, ring and additional integrands, and the watched quantities.

        `moved` holds cosine and sine of the cage's angle, the numbers of the bodies and the sums over all rollers that
        move them, the tangents of both, the other sums, and the largest pocket force and slip.
        """
        (cos, sin), numbers, largest = moved[:2], moved[2:-2], moved[-2:]
        at, _, scale = form.filled(fixed)
        units, size = scale[OF_ROLLER:], OF_BODIES + MOVING
        rest = numbers[size * (1 + tangents) :]

        def go(y: Any) -> tuple[Any, Any]:
            cage = Bodies(*(a * u for a, u in zip(y, units, strict=False)))
            sums, pace = Passed(*y[OF_BODIES:], *rest), at.pace(cage.cage_speed)
            rates, beside, watched = at.body_rates(cage, (cos, sin), sums, largest)
            rates = [pace * x / u for x, u in zip(rates, units, strict=True)]
            return _floats(rates), (*(pace * x for x in beside), *watched)

        return _with_tangents(go, numbers, size, tangents)

    at, *_ = form.filled([1.0] * len(wide))
    trace = lambda f, moved: _traced(f, moved, len(wide))
    code = RollersCode(
        at.n_rollers,
        trace(roller, 4 + (OF_ROLLER + OF_BODIES) * (1 + tangents)),
        trace(bodies, 2 + (OF_BODIES + MOVING) * (1 + tangents) + PASSED - MOVING + 2),
        _traced(lambda _, moved, fixed: cos_sin(moved[0]), 1, 0),
    )
    more = {"beside": len(BESIDE), "watched": len(WATCHED), "relative": False}
    return Field(None, code, None, None, dimension, tangents, wide, **more)
