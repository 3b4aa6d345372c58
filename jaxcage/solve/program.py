"""Traced scalar functions: a step as a sequence of elementary operations."""

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.extend as jex
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer, eval_jaxpr


Numbers = tuple[Any, ...]
Step = Callable[[Any, Numbers, Numbers, Numbers], tuple[Sequence[Any], Sequence[Any]]]
"""Function (step number, moved, watched, fixed) -> (moved, watched) of scalars.

Watched numbers (a maximum, an error estimate) have no derivative. A step that equals an earlier one, such as a
dataclass with equal fields, is not traced again."""

CONTROL_FLOW = {"while", "scan", "cond"}
STAYS_CALL = "evaluated_often"
"""Name of a function under `jax.jit` that a program calls several times, and that is differentiated only once."""

variables = lambda atoms: {v for v in atoms if not isinstance(v, jex.core.Literal)}
_read = lambda equation: variables(equation.invars)
_identity = lambda x: id(x) if isinstance(x, Tracer) else (np.asarray(x).dtype.str, np.asarray(x).tobytes())
"""Key that is equal for equal numbers."""


class Sizes(NamedTuple):
    """Counts of the moved, watched and fixed numbers of a step."""

    moved: int
    watched: int
    fixed: int

    def split(self, numbers: Sequence[Any]) -> tuple[Numbers, Numbers, Numbers]:
        a, b = self.moved, self.moved + self.watched
        return tuple(numbers[:a]), tuple(numbers[a:b]), tuple(numbers[b:])


class Program(NamedTuple):
    """A traced scalar function."""

    jaxpr: Any
    consts: Any

    @property
    def needed(self) -> list[int]:
        """Indices of the arguments that are used."""
        read = variables(self.jaxpr.outvars).union(*map(_read, self.jaxpr.eqns))
        return [i for i, v in enumerate(self.jaxpr.invars) if v in read]

    def __call__(self, *x: Any) -> list[Any]:
        return eval_jaxpr(self.jaxpr, self.consts, *x)


def _arguments(sizes: Sizes) -> list[Any]:
    return [jax.ShapeDtypeStruct((), float)] * (1 + sum(sizes))


@functools.lru_cache(maxsize=128)
def _traced(step: Step, sizes: Sizes) -> Any:
    """Trace a step as a function of one row of scalars."""

    def flat(i: Any, *x: Any) -> tuple[Any, ...]:
        moved, watched = step(i, *sizes.split(x))
        return tuple(jnp.asarray(c, dtype=float) for c in (*moved, *watched))

    return jax.make_jaxpr(flat)(*_arguments(sizes))


@functools.lru_cache(maxsize=128)
def program_of(step: Step, sizes: Sizes, rules: bool = False) -> Program:
    """Program of a step; with `rules`, functions with a custom derivative and those that are evaluated often remain
    calls, so that the program can be differentiated, which is much faster than tracing the original code again."""
    traced = _traced(step, sizes)
    once = functools.partial(_inlined, traced.jaxpr, traced.consts, seen={}, rules=rules)
    traced = jax.make_jaxpr(once)(*_arguments(sizes))
    jaxpr = traced.jaxpr
    return Program(jaxpr.replace(eqns=needed(jaxpr.eqns, jaxpr.outvars)), traced.consts)


def _inlined(jaxpr: Any, consts: Sequence[Any], *args: Any, seen: dict[Any, Any], rules: bool) -> list[Any]:
    """Inline the functions that a function calls, and eliminate common subexpressions."""
    known = dict(zip([*jaxpr.constvars, *jaxpr.invars], [*consts, *args], strict=True))
    read = lambda v: v.val if isinstance(v, jex.core.Literal) else known[v]
    for e in jaxpr.eqns:
        x = [read(v) for v in e.invars]
        called = next((e.params[k] for k in ("jaxpr", "call_jaxpr") if k in e.params), None)
        if rules and (e.primitive.name == "custom_jvp_call" or e.params.get("name") == STAYS_CALL):
            alone = jaxpr.replace(constvars=[], invars=list(_read(e)), eqns=[e], outvars=e.outvars)
            out = eval_jaxpr(alone, [], *map(read, alone.invars))
        elif called is None or e.primitive.name in CONTROL_FLOW:
            same = (e.primitive, str(e.params), *map(_identity, x))
            if same not in seen:
                out = e.primitive.bind(*x, **e.params)
                seen[same] = out if e.primitive.multiple_results else [out]
            out = seen[same]
        else:
            out = _inlined(called.jaxpr, called.consts, *x, seen=seen, rules=rules)
        known.update(zip(e.outvars, out, strict=True))
    return [read(v) for v in jaxpr.outvars]


def following(equations: Sequence[Any], given: Sequence[Any]) -> set[Any]:
    """The given variables and all that depend on any of them."""
    found = set(given)
    for e in equations:
        if found & variables(e.invars):
            found.update(e.outvars)
    return found


def depends(f: Callable[[Any], Any], x: Any) -> list[bool]:
    """True for each array of f(x) that depends on x."""
    jaxpr = jax.make_jaxpr(f)(x).jaxpr
    reached = following(jaxpr.eqns, jaxpr.invars)
    return [bool(reached & variables([v])) for v in jaxpr.outvars]


def needed(equations: Sequence[Any], wanted: Sequence[Any]) -> list[Any]:
    """Equations on which the wanted variables depend, in their order."""
    reached = variables(wanted)
    kept = []
    for e in reversed(equations):
        if reached.intersection(e.outvars):
            kept.append(e)
            reached |= variables(e.invars)
    return kept[::-1]
