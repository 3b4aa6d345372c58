"""Physical parameters as fields of modules: each carries its unit, the range it makes sense in, and words.

What is declared here once is used by the configuration reader (units, ranges, unknown keys), by `replace` and
`parameters` (access by name), and by every table that lists parameters.
"""

import dataclasses
from collections.abc import Iterator
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree


M = TypeVar("M", bound=eqx.Module)


@dataclasses.dataclass(frozen=True)
class ParameterInfo:
    """What is known of a parameter beside its value: SI unit, closed range of sensible values, description."""

    unit: str
    lower: float
    upper: float
    text: str


def _as_leaf(x: Any) -> Any:
    """Python numbers become float64 leaves; arrays, tracers and the placeholders of tree surgery pass."""
    return jnp.asarray(x, dtype=float) if isinstance(x, int | float) else x


def parameter(unit: str, lower: float, upper: float, text: str, **kwargs: Any) -> Any:
    """A differentiable leaf of a module, with `unit` (SI) and the closed range `[lower, upper]` users may give."""
    info = ParameterInfo(unit, lower, upper, text)
    return eqx.field(converter=_as_leaf, metadata={"parameter": info}, **kwargs)


def choice(*options: str, text: str, **kwargs: Any) -> Any:
    """A static field that takes one of `options`."""
    return eqx.field(static=True, metadata={"choice": options, "text": text}, **kwargs)


def count(lower: int, upper: int, text: str, **kwargs: Any) -> Any:
    """A static whole number, e.g. of rollers."""
    return eqx.field(static=True, metadata={"count": (lower, upper), "text": text}, **kwargs)


def walk(module: eqx.Module, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], dataclasses.Field]]:
    """Every declared field below `module` with its path of attribute names, depth first."""
    for field in dataclasses.fields(module):
        value = getattr(module, field.name)
        if isinstance(value, eqx.Module):
            yield from walk(value, (*path, field.name))
        elif {"parameter", "choice", "count"} & set(field.metadata):
            yield (*path, field.name), field


def get(module: Any, path: tuple[str, ...]) -> Any:
    """The attribute of `module` at `path`."""
    for name in path:
        module = getattr(module, name)
    return module


def parameter_paths(module: eqx.Module) -> dict[str, tuple[str, ...]]:
    """Name -> path of every differentiable parameter; the name is dotted where the last word alone is ambiguous."""
    paths = [path for path, field in walk(module) if "parameter" in field.metadata]
    last = [path[-1] for path in paths]
    return {(p[-1] if last.count(p[-1]) == 1 else ".".join(p)): p for p in paths}


def parameters(module: eqx.Module) -> dict[str, Array]:
    """All differentiable parameters of `module` by name, in SI units."""
    return {name: get(module, path) for name, path in parameter_paths(module).items()}


def parameter_info(module: eqx.Module) -> dict[str, ParameterInfo]:
    """Unit, range and description of every differentiable parameter of `module`, by name."""
    infos = {path: field.metadata["parameter"] for path, field in walk(module) if "parameter" in field.metadata}
    return {name: infos[path] for name, path in parameter_paths(module).items()}


def replace(module: M, **values: PyTree) -> M:
    """A copy of `module` with the named parameters replaced (SI units).

    **Arguments:** parameters by name, e.g. `replace(model, guidance_gap=0.5e-3)`; dotted names through a dictionary:
    `replace(model, **{"rib.mass": 1.0})`.

    **Raises:** `ValueError` for a name the module does not have.
    """
    paths = parameter_paths(module)
    for name in values:
        if name not in paths:
            raise ValueError(f"Argument `{name}` must be a parameter of the model, one of: {', '.join(paths)}.")
    where = lambda m: [get(m, paths[name]) for name in values]
    leaves = [jax.tree.map(_as_leaf, v) for v in values.values()]
    return eqx.tree_at(where, module, leaves)
