"""Validation of the arguments of public functions against their annotations.

An annotation may ask for whole numbers, numbers, real arrays, literals or models. Traced arguments pass, since they
have no value yet. Bounds of numbers are checked by the functions themselves.
"""

import functools
import inspect
import math
import sys
import types
import typing
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import numpy as np
from jax.core import Tracer

from ._errors import ArgumentError, shown as shown


MOST = 10_000_000
"""Largest count that is accepted; larger ones exceed memory or never finish."""
WHOLE = "a whole number"
_REAL = "biuf"
_ARRAYS = (jax.Array, np.ndarray, np.generic)


def check_layer(layer: dict[str, Any], names: str) -> None:
    """Make the named functions of a layer check their arguments; called at the end of its `__init__`."""
    for name in names.split():
        f = layer[name]
        layer[name] = checked(f)
        setattr(sys.modules[f.__module__], f.__name__, layer[name])  # where pickle looks for it


def checked(f: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(f)
    def run(*args: Any, **kwargs: Any) -> Any:
        check_call(f, *args, **kwargs)
        return f(*args, **kwargs)

    return run


_signature = functools.lru_cache(maxsize=1024)(inspect.signature)


def check_call(f: Callable[..., Any], *args: Any, **kwargs: Any) -> None:
    """Check arguments against the annotations of `f`; some may be missing. **Raises:** `ArgumentError` for the first
    mismatch."""
    signature = _signature(f)
    try:
        given = signature.bind_partial(*args, **kwargs).arguments
    except TypeError:
        return  # Python reports it when `f` is called
    for name, value in given.items():
        parameter = signature.parameters[name]
        several = parameter.kind in (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
        if several or parameter.annotation is inspect.Parameter.empty:  # the latter is `self`
            continue
        if said := wrong(parameter.annotation, value):
            raise ArgumentError(name, said=f"must be {said}, but {shown(value)} was given.")


def is_concrete(*values: object) -> bool:
    """True if none of `values` is traced by JAX, so that Python may compare them."""
    return not any(isinstance(value, Tracer) for value in values)


def require_at_least(least: int, **numbers: Any) -> None:
    """Require numbers of at least `least`; traced ones pass. **Raises:** `ArgumentError` for the first that is less."""
    for name, value in numbers.items():
        if not isinstance(value, Tracer) and not value >= least:
            raise ArgumentError(name, said=f"must be at least {least}, but {shown(value)} was given.")


def options(annotation: Any) -> tuple[Any, ...]:
    """Members of a union, or else the annotation itself."""
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return tuple(one for member in typing.get_args(annotation) for one in options(member))
    return (annotation,)


def wrong(annotation: Any, value: Any, in_row: bool = False) -> str:
    """Description of what an argument must be; empty if it matches its annotation."""
    members = options(annotation)
    if _is_traced(value) or (value is None and types.NoneType in members):
        return ""
    if isinstance(value, _ARRAYS) and not _is_real(value, any("Complex" in str(m) for m in members)):
        return "of real numbers, without a mask"
    may_miss = in_row or any(map(is_array_type, members))  # NaN is allowed in quantities and states
    said = [_wrong_one(member, value, may_miss) for member in members if member is not types.NoneType]
    if not all(said):
        return ""
    return " or ".join(words for words in dict.fromkeys(said) if float not in members or words != WHOLE)


def _wrong_one(kind: Any, value: Any, may_miss: bool) -> str:
    origin, inside = typing.get_origin(kind), typing.get_args(kind)
    single = is_array_type(kind) and kind.dim_str == ""
    if kind is float or (single and "Int" not in str(kind)):
        return _wrong_number(value, may_miss)
    if kind is int or single:
        return "" if _is_count(value) else f"{WHOLE} of at most {MOST}" if type(value) is int else WHOLE
    if kind is bool:
        return "" if isinstance(value, bool | np.bool_) else "True or False"
    if is_array_type(kind):
        return "" if _is_real(value, "Complex" in str(kind)) else "an array of numbers"
    if is_plain_class(kind):
        return "" if isinstance(value, kind) else f"of kind {kind.__name__}"
    if origin is typing.Literal:
        return (
            "" if isinstance(value, str | int | None) and value in inside else f"one of {', '.join(map(str, inside))}"
        )
    if origin is Callable:
        return "" if callable(value) else "something that can be called"
    if not inspect.isclass(origin) or not issubclass(origin, Mapping | Sequence):
        return ""
    if issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            return "a mapping"
        said = [wrong(inside[1], each) for each in value.values()]
        return f"a mapping to what is {next(filter(None, said))}" if any(said) else ""
    of_things = is_plain_class(inside[0]) and inside[0] not in (int, float, str)
    if isinstance(value, str | bytes) or not isinstance(value, Sequence | np.ndarray | jax.Array):
        return "a row of things"
    if isinstance(value, _ARRAYS) and (of_things or np.ndim(value) == 0):
        return "a row of things"
    each = inside[:1] * len(value) if not issubclass(origin, tuple) or inside[-1] is ... else inside
    if len(each) != len(value):
        return f"a row of {len(each)}"
    said = [wrong(kind, x, in_row=True) for kind, x in zip(each, value, strict=True)]
    return f"a row of things, each {next(filter(None, said))}" if any(said) else ""


def _wrong_number(value: Any, may_miss: bool) -> str:
    single = isinstance(value, int | float | np.number) or (isinstance(value, _ARRAYS) and np.ndim(value) == 0)
    missing = isinstance(value, float) and math.isnan(value) and not may_miss
    if not single or missing or isinstance(value, bool | np.bool_):
        return "a number"
    whole = type(value) is int and not -(2**63) <= value < 2**63
    return "a number, of 64 bits if it is whole" if whole else ""


def _is_traced(value: Any) -> bool:
    """True if a value, or an element of a tuple or list, is traced."""
    return any(isinstance(x, Tracer) for x in (value if isinstance(value, tuple | list) else (value,)))


def is_array_type(kind: Any) -> bool:
    """True for a jaxtyping annotation."""
    return getattr(kind, "dim_str", None) is not None


def is_plain_class(kind: Any) -> bool:
    """True for a class that `isinstance` can check."""
    simple = inspect.isclass(kind) and not is_array_type(kind) and typing.get_origin(kind) is None
    return simple and kind is not typing.Any and not getattr(kind, "_is_protocol", False)


def _is_real(value: Any, with_imaginary: bool) -> bool:
    """True if an array is numeric, complex only if allowed, and not masked."""
    if isinstance(value, np.ma.MaskedArray):
        return False
    try:
        kind = value.dtype.kind if isinstance(value, _ARRAYS) else np.asarray(value).dtype.kind
    except (ValueError, TypeError):
        return False
    return kind in _REAL or (with_imaginary and kind == "c") or (kind == "V" and isinstance(value, jax.Array))


def _is_count(value: Any) -> bool:
    if isinstance(value, bool | np.bool_):
        return False
    if isinstance(value, _ARRAYS) and np.ndim(value) == 0 and value.dtype.kind in "iu":
        value = int(value)
    return isinstance(value, int) and abs(value) <= MOST


# Double precision, and versions of JAX that are known to give wrong results.

BAD_JAX = {
    "0.10.2": "https://github.com/jax-ml/jax/issues/39103",
    "0.11.0": "https://github.com/jax-ml/jax/issues/39257",
}


def _wrong_results() -> str:
    """Message about a version of JAX that gives wrong results; empty for all others."""
    issue = BAD_JAX.get(jax.__version__)
    return f"JAX {jax.__version__} gives wrong results ({issue}): install jax==0.10.1." if issue else ""


if jax.__version__ in BAD_JAX:
    warnings.warn(_wrong_results(), RuntimeWarning, stacklevel=2)


def enable_x64() -> None:
    """Make JAX compute in double precision in the whole process; call it right after `import jaxcage`."""
    jax.config.update("jax_enable_x64", True)


def require_x64() -> None:
    """Require double precision. **Raises:** `RuntimeError` without it, or with a version of JAX that gives wrong
    results."""
    if said := _wrong_results():
        raise RuntimeError(said)
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise RuntimeError("jaxcage needs double precision: call `jaxcage.enable_x64()` before using it.")
