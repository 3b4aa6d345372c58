"""The data set of a run: lanes over the axes of their plan, with units, texts and provenance; stored by zarr.

Variables, over the axes of the plan (`speed` and `initial_state` for a sweep) and the dimensions in brackets:

| variable | contents |
|---|---|
| `label`, `outcome` | kind of motion, and how the integration ended; words, on disk codes with their meanings |
| `exponents`, `standard_error` (exponent) | Lyapunov exponents per revolution |
| `block_growth` (growth_block, exponent), `doubt` (exponent) | exponents of each block, error that they do not show |
| `peak`, `error`, `steps` | largest excursion, largest error of a revolution [scale], steps per revolution |
| `last`, `scale` (component) | final state, characteristic magnitude of each component |
| `strobe` (revolution, component) | last strobe states, for models whose revolutions repeat |
| `escape` | revolutions after which a lane is calm, if lanes were followed to a horizon |
| quantities of the model, and `NAME_blocks` (block) | means and largest values, also of each block |
"""

import functools
import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float, Shaped

from .._errors import InputError
from .._parameters import parameter_info
from ..analysis import LABELS, scatter
from ..files import configuration, replacing
from ..models import AbstractForcedSystem
from ..quantities import averaged, quantity
from ..solve import OUTCOMES, AbstractMethod
from .grid import OIL
from .observe import Observation
from .plan import SPEED, Coordinate, Plan
from .settings import Run


CODES: dict[str, tuple[str, ...]] = {"label": LABELS, "outcome": OUTCOMES}
"""Variables that hold words, and the words in the order of their codes on disk; code -1 is a pending lane."""
PENDING = "pending"


def exponent_error(seen: Observation) -> Float[np.ndarray, "lanes exponents"]:
    """Standard error of the exponents: scatter of the blocks combined with the error that it does not show."""
    return np.hypot(scatter(seen.growth, axis=1), seen.doubt)


def dataset(
    plan: Plan,
    run: Run,
    seen: Observation,
    scale: Float[np.ndarray, "lanes dim"],
    label: Shaped[np.ndarray, " lanes"],
    confirmed: Sequence[tuple[int, int, int]] = (),
    escape: Float[np.ndarray, " lanes"] | None = None,
    horizon: int = 0,
) -> xr.Dataset:
    """Data set of the lanes of a plan from their observation, labels, confirmations and escape times."""
    model, last = plan.model, run.discard + run.revolutions
    if escape is not None:
        label = np.where((label == "chaotic") & np.isfinite(escape), "transient", label)
    values: dict[str, tuple[tuple[str, ...], np.ndarray]] = {
        "label": ((), label),
        "outcome": ((), np.array(OUTCOMES)[seen.outcome]),
        "exponents": (("exponent",), seen.growth.mean(axis=1)),
        "standard_error": (("exponent",), exponent_error(seen)),
        "block_growth": (("growth_block", "exponent"), seen.growth),
        "doubt": (("exponent",), seen.doubt),
        "peak": ((), seen.peak),
        "error": ((), seen.error),
        "steps": ((), seen.steps),
        "last": (("component",), seen.last),
        "scale": (("component",), scale),
    }
    if not model.beside:
        values["strobe"] = ("revolution", "component"), seen.strobe
    if escape is not None:
        values["escape"] = (), escape
    about = {name: quantity("exponent" if name == "exponents" else name) for name in values}
    given = model.beside, model.watched[1:], seen.integrals, seen.largest
    numbers = plan.lanes.each(type(model).reference, np.arange(len(scale))) if model.quantities else {}
    for each, whole, blocks in averaged(model.quantities, *given, numbers, float(run.block)):
        values[each.name], about[each.name] = ((), whole), each
        values[f"{each.name}_blocks"], about[f"{each.name}_blocks"] = (("block",), blocks), each
    shaped = lambda x: x.reshape(*plan.shape, *x.shape[1:])
    words = lambda name: {"long_name": about[name].text, "units": about[name].unit}
    variables = {name: ((*plan.axes, *dims), shaped(x), words(name)) for name, (dims, x) in values.items()}
    coordinates: dict[str, Any] = {"component": np.array(model.components, dtype=object)}
    coordinates |= coordinates_of(model, plan.coordinates) | _other_speed(plan)
    if not model.beside:
        coordinates["revolution"] = np.arange(last - run.keep + 1, last + 1)
    attributes = {
        "title": "jaxcage run",
        "model": type(model).__name__,
        "discard": run.discard,
        "revolutions": run.revolutions,
        "horizon": horizon,
        "confirmed": json.dumps(confirmed),
        "settings": json.dumps(settings_of(run.method)),
    }
    return xr.Dataset(variables, coordinates, attributes | ({} if plan.lanes.several else configuration_of(model)))


def coordinates_of(model: AbstractForcedSystem, given: Mapping[str, Coordinate]) -> dict[str, Any]:
    """Coordinates with texts and units, and the speed also in rpm."""
    info, (dims, speed) = parameter_info(model), given[SPEED]
    known = {name: info.get(name) or quantity(name) for name in given}
    about = {name: (each.text, each.unit) for name, each in known.items()}
    about |= {SPEED: (model.speed_text, "rad/s"), "rpm": (model.speed_text, "rpm")}
    about |= {OIL: ("ISO VG grade of the oil", "mm^2/s")}
    values = {**given, "rpm": (dims, speed * 30 / np.pi)}
    return {name: (*x, dict(zip(("long_name", "units"), about[name], strict=True))) for name, x in values.items()}


def _other_speed(plan: Plan) -> dict[str, Any]:
    """Coordinate with the other speed of a single model (of the shaft or of the cage) in rpm; empty without one."""
    dims, speed = plan.coordinates[SPEED]
    single = dims == (SPEED,) and not plan.lanes.several
    others = [other for w in speed if single and (other := plan.model.other_speed(w)) is not None]
    if not others:
        return {}
    rpm, text = np.array([float(other) for _, other in others]) * 30 / np.pi, others[0][0]
    return {f"{text.split()[0]}_rpm": (dims, rpm, {"long_name": text, "units": "rpm"})}


def configuration_of(model: AbstractForcedSystem) -> dict[str, str]:
    """Attribute with the configuration of a model, as in TOML, in JSON; empty if no file can represent the model."""
    try:
        return {"configuration": json.dumps(configuration(model))}
    except InputError:
        return {}


@functools.cache
def _versions() -> dict[str, str]:
    return {f"version_{p}": version(p) for p in ("jaxcage", "jax", "diffrax", "equinox", "numpy")}


def settings_of(method: AbstractMethod) -> dict[str, str]:
    """Method and versions of the packages, for reproducing a result."""
    return {"method": str(method).replace("\n", " "), **_versions()}


def flags(words: Sequence[str]) -> dict[str, Any]:
    """Attributes of a variable of codes with their meanings, by the CF conventions; empty without words."""
    if not words:
        return {}
    return {"flag_values": [-1, *range(len(words))], "flag_meanings": " ".join([PENDING, *words])}


def coded(found: xr.Dataset) -> xr.Dataset:
    """Replace words by codes."""
    for name in CODES.keys() & found.data_vars.keys():
        codes = np.full(found[name].shape, -1, dtype=np.int8)
        for code, word in enumerate(CODES[name]):
            codes[found[name].values == word] = code
        found = found.assign({name: found[name].copy(data=codes).assign_attrs(flags(CODES[name]))})
    return found


def decoded(found: xr.Dataset) -> xr.Dataset:
    """Replace codes by words."""
    for name in CODES.keys() & found.data_vars.keys():
        attributes = dict(found[name].attrs)
        if words := attributes.pop("flag_meanings", ""):
            codes = np.searchsorted(attributes.pop("flag_values"), found[name].values)
            found = found.assign({name: (found[name].dims, np.array(words.split())[codes], attributes)})
    return found


def save(path: str | Path, found: xr.Dataset) -> Path:
    """Write a data set to the zarr folder `path` atomically; an earlier one is kept if this fails."""
    with replacing(path) as temporary:
        coded(found).to_zarr(temporary, mode="w", consolidated=False)
    return Path(path)


def load(path: str | Path) -> xr.Dataset:
    """Read a data set written by `save` into memory. **Raises:** `FileNotFoundError`."""
    if not Path(path).is_dir():
        raise FileNotFoundError(f"There is no stored run at '{path}'.")
    # Only version 3, which `save` writes: version 2 has a codec that unpickles, and so may execute code from a file.
    with xr.open_dataset(path, engine="zarr", zarr_format=3, consolidated=False, chunks=None) as stored:
        return decoded(stored.load())


def stored_configuration(found: xr.Dataset) -> Mapping[str, Any] | None:
    """Configuration of the model of a data set; None if it has none."""
    text = found.attrs.get("configuration")
    return None if text is None else json.loads(text)
