"""Ready-made objects and tools for the tests."""

import dataclasses
import functools
from collections.abc import Iterable, Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import pint
import pytest

import jaxcage as jc
from jaxcage.forces import parameter


raw_sweep = functools.partial(jc.sweep, confirm=False, horizon=0)
"""Lanes as they run, none confirmed or followed further."""
raw_sweeps = functools.partial(jc.sweep_designs, confirm=False, horizon=0)


@functools.cache
def units() -> pint.UnitRegistry:
    """Made when it is first asked for: that takes a second."""
    return pint.UnitRegistry()


def unit_exponents(unit: str) -> dict[str, float]:
    """Exponents of mass, length and time in a parameter's unit."""
    dims = units().parse_units("dimensionless" if unit == "1" else unit).dimensionality
    return {name: float(dims.get(f"[{name}]", 0)) for name in ("mass", "length", "time")}


def in_other_units(model: jc.CageModel, base: str, factor: float) -> jc.CageModel:
    """The same model with the unit of `base` (mass, length or time) made `factor` times smaller."""
    info, values = jc.parameter_info(model), jc.parameters(model)
    scaled = {id(value): value * factor ** unit_exponents(info[name].unit)[base] for name, value in values.items()}
    return jax.tree.map(lambda x: scaled.get(id(x), x), model)  # `replace` would ask for SI


def beyond_range(model: Any, **values: Any) -> Any:
    """The model with values that `replace` may refuse, as limits of what a formula says."""
    now = jc.parameters(model)
    new = {id(now[name]): jnp.asarray(value, dtype=float) for name, value in values.items()}
    return jax.tree.map(lambda x: new.get(id(x), x), model)


def elastic(model: jc.CageModel, mass: float = 1.0, stiffness: float = 5e7, damping: float = 500.0) -> jc.CageModel:
    """The model with an elastic rib."""
    return jc.replace(
        model, rib=jc.forces.ElasticRib(mass=mass, stiffness=stiffness, damping=damping, cubic_stiffness=1e14)
    )


def roller_pass(model: jc.CageModel) -> jc.CageModel:
    """The model with impacts roller by roller."""
    return jc.replace(model, impact=jc.forces.RollerPassImpact(jc.forces.PocketImpact()))


class EvenSteps(jc.CageModel):
    """A cage whose steps are as long near the land as elsewhere."""

    def abrupt(self, y, rate):  # pyright: ignore[reportIncompatibleMethodOverride]
        return None


def even(model: jc.CageModel) -> jc.CageModel:
    """The model by steps of one length."""
    return EvenSteps(**{field.name: getattr(model, field.name) for field in dataclasses.fields(model)})


def unforced(model: jc.CageModel) -> jc.CageModel:
    """Film, contact and weight only: no support, no impact, no unbalance."""
    zero = (
        "stiffness_x",
        "stiffness_y",
        "support.damping",
        "cubic_stiffness",
        "cross_stiffness",
        "amplitude",
        "eccentricity",
    )
    names = jc.parameters(model)
    chosen = [n if n in names else n.split(".")[-1] for n in zero]
    return jc.replace(model, **{n: jnp.zeros(()) for n in chosen})


class DoubleWell(eqx.Module):
    """m x'' + d x' - k x + b x^3 = g cos(w t), whose small orbit ends in a fold and in a period doubling."""

    mass: float = parameter("kg", 0.0, 1e3, "m")
    damping: float = parameter("N s/m", 0.0, 1e3, "d")
    stiffness: float = parameter("N/m", 0.0, 1e3, "k")
    cubic: float = parameter("N/m^3", 0.0, 1e3, "b")
    forcing: float = parameter("N", 0.0, 1e3, "g")

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        push = self.forcing * jnp.cos(tau)
        return ((push - self.damping * u + self.stiffness * x - self.cubic * x**3) / self.mass,)


WELL = {"mass": 1.0, "damping": 0.3, "stiffness": 1.0, "cubic": 1.0}


def double_well() -> jc.ForcedOscillator:
    """The oscillator with `WELL` and a forcing of 0.262 N."""
    return jc.ForcedOscillator(DoubleWell(**WELL, forcing=0.262), coordinates=1)


def wide_but(values: Iterable[Any], *quick: Any) -> list[Any]:
    """`values` as parameters of a test, all but `quick` marked `wide`: further examples of what `quick` shows."""
    return _marked(values, quick, pytest.mark.wide)


def slow_but(values: Iterable[Any], *quick: Any) -> list[Any]:
    """`values` as parameters of a test, all but `quick` marked `slow`: nobody waits for them unless asked."""
    return _marked(values, quick, pytest.mark.slow)


def _marked(values: Iterable[Any], quick: tuple[Any, ...], mark: pytest.MarkDecorator) -> list[Any]:
    values = list(values)
    assert all(q in values for q in quick), f"{quick} must be of {values}"
    marked = [pytest.param(*(v if isinstance(v, tuple) else (v,)), marks=mark) for v in values]
    return [v if v in quick else m for v, m in zip(values, marked, strict=True)]


def declared(module: eqx.Module, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], dataclasses.Field]]:
    """Every parameter, choice and count of a module with its path of attribute names."""
    for field in dataclasses.fields(module):
        value, here = getattr(module, field.name), (*path, field.name)
        if isinstance(value, eqx.Module):
            yield from declared(value, here)
        elif field.name == "forces":
            for law in value:
                yield from declared(law, (*path, law.law_name))
        elif {"parameter", "choice", "count"} & set(field.metadata):
            yield here, field
