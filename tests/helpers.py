"""Ready-made objects and tools for the tests."""

import dataclasses
import functools
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pint
import pytest
import xarray as xr

import jaxcage as jc
from jaxcage.analysis import label_lanes, scatter
from jaxcage.cli import main
from jaxcage.quantities import component_names
from jaxcage.solve import OUTCOMES


raw_sweep = functools.partial(jc.sweep, confirm=False, horizon=0)
"""Lanes as they run, none confirmed or followed further."""


def preliminary(name: str = "1a") -> jc.CageModel:
    """Case with other constants, from a blind search of an independent code whose film was some twenty times too weak,
    on the sign of the largest exponent in the published zones."""
    model = jc.case(name)
    changes = dict(
        cage_mass=0.212227,
        stiffness_x=37402.4,
        stiffness_y=37402.4,
        cubic_stiffness=1.0732e13,
        damping=3.3136,
        cross_stiffness=-36.654,
        land_width=4.2679e-3,
        amplitude=109.9051,
        exponent=1.5091,
        restitution=1.0,
        unbalance="physical",
    )
    return jc.replace(model, **changes, stiffness=68992.2 / float(model.guidance_gap) ** (10 / 9))


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


def edge_speed(system: Any, point: jc.Point, method: Any = None) -> float:
    """Speed [rad/s] of the edge near a point, by Newton's method; NaN if it is not found."""
    return jc.sensitivity(system, point, method=method).value_rpm * np.pi / 30


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


def unforced(model: jc.CageModel) -> jc.CageModel:
    """Film, contact and weight only: no support, no impact, no unbalance."""
    zero = "stiffness_x stiffness_y support.damping cubic_stiffness cross_stiffness amplitude eccentricity".split()
    names = jc.parameters(model)
    return jc.replace(model, **{n if n in names else n.split(".")[-1]: jnp.zeros(()) for n in zero})


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


def document(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """The JSON document that a command prints, the only thing on standard output."""
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The sentence with which a command refuses `arguments`."""
    assert main(list(arguments)) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("Warning:")]
    assert out == "" and len(lines) == 1 and lines[0].endswith((".", ".)")), err
    return lines[0]


def is_png(path: str) -> bool:
    """True for a file that begins as a PNG figure does."""
    return Path(path).read_bytes().startswith(b"\x89PNG\r\n")


CRITICAL = {"period-doubling": -1.0, "Neimark-Sacker": np.exp(2.5j), "fold": 1.0}
"""Multipliers that cross the unit circle."""


def point(kind: str, rpm: float, index: int = 0, edge: bool = True, state: tuple[float, ...] = (1e-5, 2e-5, 0.1, 0.2)):
    """A bifurcation made by hand, on a branch next to the orbit with an index."""
    y, second = np.array(state), np.conj(CRITICAL[kind]) if kind == "Neimark-Sacker" else 0.5
    mu = np.array([CRITICAL[kind], second, 0.2, 0.1], dtype=complex)[: y.size]
    known = dict(multipliers=mu, index=index, edge=edge, steps=1024, error=1e-4 * np.pi / 30, outcome=0)
    return jc.Point(kind, rpm * np.pi / 30, y, **known)


def made_sweep(
    rpm: Any, strobe: np.ndarray, growth: np.ndarray, outcome: Any = None, scale: Any = None, **attrs: Any
) -> xr.Dataset:
    """A sweep made by hand: strobe states (speeds, initial states, revolutions, components) and growth in blocks."""
    lanes, dim = strobe.shape[:2], strobe.shape[-1]
    outcome = np.zeros(lanes, dtype=np.int32) if outcome is None else outcome
    scale = np.broadcast_to(np.ones(dim) if scale is None else np.asarray(scale)[:, None, :], (*lanes, dim))
    exponents, error = growth.mean(axis=2), scatter(growth, axis=2)
    label = label_lanes(outcome, strobe, scale, exponents[..., 0], error[..., 0])
    at, lost = ("speed", "initial_state"), outcome != 0
    speed, keep = np.asarray(rpm) * np.pi / 30, strobe.shape[2]
    return xr.Dataset(
        {
            "label": (at, label),
            "outcome": (at, np.array(OUTCOMES)[outcome]),
            "exponents": ((*at, "exponent"), exponents),
            "standard_error": ((*at, "exponent"), error),
            "block_growth": ((*at, "growth_block", "exponent"), growth),
            "doubt": ((*at, "exponent"), np.zeros(exponents.shape)),
            "peak": (at, np.where(lost, np.nan, 0.5)),
            "error": (at, np.full(lanes, 1e-4)),
            "steps": (at, np.full(lanes, 100.0)),
            "last": ((*at, "component"), strobe[:, :, -1]),
            "scale": ((*at, "component"), scale),
            "strobe": ((*at, "revolution", "component"), strobe),
        },
        coords={
            "speed": ("speed", speed, {"units": "rad/s", "long_name": "cage speed"}),
            "rpm": ("speed", speed * 30 / np.pi, {"units": "rpm", "long_name": "cage speed"}),
            "shaft_rpm": ("speed", speed * 30 / np.pi / attrs.pop("cage_speed_ratio", 0.4)),
            "component": np.array(component_names(dim), dtype=object),
            "revolution": np.arange(110 - keep + 1, 111),
        },
        attrs={"discard": 10, "revolutions": 100, "horizon": 0, "confirmed": "[]", "settings": "{}"} | attrs,
    )


def followed(sweep: xr.Dataset, escape: np.ndarray, horizon: int) -> xr.Dataset:
    """The sweep with times after which its lanes are calm, as if they had been followed to a horizon."""
    label = sweep["label"].values.copy()
    label[(label == "chaotic") & np.isfinite(escape)] = "transient"
    later = {"escape": (("speed", "initial_state"), escape), "label": (("speed", "initial_state"), label)}
    return sweep.assign(later).assign_attrs(horizon=horizon)


def cage_sweep() -> xr.Dataset:
    """Five speeds, three initial states: the second speed chaotic, the others periodic, the last lane of the fourth
    failed."""
    rng = np.random.default_rng(0)
    strobe = np.repeat(rng.normal(size=(5, 3, 1, 4)), 16, axis=2) * 1e-4
    strobe[1] += rng.normal(size=(3, 16, 4)) * 1e-4
    growth = rng.normal(-0.2, 0.01, size=(5, 3, 10, 1))
    growth[1] += 0.5
    outcome = np.zeros((5, 3), dtype=np.int32)
    outcome[3, 2], strobe[3, 2], growth[3, 2] = 1, np.nan, np.nan
    scale = np.tile([4.5e-4, 4.5e-4, 0.4, 0.4], (5, 1))
    return made_sweep(np.linspace(8000.0, 8400.0, 5), strobe, growth, outcome, scale=scale)


def read_columns(path: str | Path) -> dict[str, np.ndarray]:
    """The columns of a CSV file by their heads."""
    head, *rows = Path(path).read_text().splitlines()
    return dict(zip(head.split(","), np.loadtxt(rows, delimiter=",", ndmin=2).T, strict=True))
