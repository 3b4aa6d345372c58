"""`Sweep` or `BearingSweep` -> labelled data set -> zarr, with the configuration and versions that made it; a `Sweep`
back from it."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._glossary import component_names, quantity
from ..analysis import BearingSweep, Confirmation, Sweep
from ..files import configuration, replacing
from ..integrate import OUTCOMES
from ..models import BearingModel, CageModel


if TYPE_CHECKING:
    import xarray as xr

_DIMENSIONS: dict[str, tuple[str, ...]] = {
    "strobe": ("speed", "start", "revolution", "component"),
    "last": ("speed", "start", "component"),
    "block_growth": ("speed", "start", "block", "exponent"),
    "peak": ("speed", "start"),
    "outcome": ("speed", "start"),
    "error": ("speed", "start"),
    "doubt": ("speed", "start", "exponent"),
    "scale": ("speed", "component"),
}
"""Labelled dimensions of everything that a sweep consists of."""

_DERIVED: dict[str, tuple[str, ...]] = {
    "exponents": ("speed", "start", "exponent"),
    "standard_error": ("speed", "start", "exponent"),
    "chaotic_share": ("speed",),
}
_LANES = ("speed", "start")
_LAST: dict[str, tuple[str, ...]] = {
    "last_rollers": (*_LANES, "of_roller", "roller"),
    "last_bodies": (*_LANES, "of_bodies"),
}
"""Labelled dimensions of what a sweep of the whole bearing has beside numbers of its lanes."""


def to_dataset(sweep: Sweep, model: CageModel | None = None) -> "xr.Dataset":
    """A sweep as a labelled data set.

    **Arguments:** the sweep; the model it was made with, whose every parameter then goes along (none with forces of
    one's own: leave it out).

    **Returns:** variables over `speed`, `start`, `revolution`, `component`, `block`, `exponent`
    with units and words; configuration, method and versions in the attributes.
    """
    import xarray as xr

    stored = {name: (dims, getattr(sweep, name)) for name, dims in _DIMENSIONS.items()}
    if sweep.escape is not None:
        stored["escape"] = ("speed", "start"), sweep.escape
    derived = {name: (dims, getattr(sweep, name)) for name, dims in _DERIVED.items()}
    codes, flags = _coded(sweep.label)
    dataset = xr.Dataset(
        {**stored, **derived, "label": (_LANES, codes)},
        coords=_coordinates(sweep, cage=model is not None),
        attrs=_attributes(sweep, model),
    )
    for name in dataset.variables:
        known = quantity("exponent" if name == "exponents" else str(name))
        dataset[name].attrs |= {"long_name": known.text, "units": known.unit}
    dataset["outcome"].attrs |= _flags(OUTCOMES)
    dataset["label"].attrs |= flags
    return dataset


def _coordinates(sweep: Sweep, cage: bool) -> dict[str, Any]:
    keep, dimension = sweep.strobe.shape[2:]
    last = sweep.discard + sweep.revolutions
    return {
        "speed": sweep.speed,
        "speed_rpm": ("speed", sweep.rpm),
        "revolution": np.arange(last - keep + 1, last + 1),
        # Python strings: fixed-width ones have no place in the zarr 3 specification yet.
        "component": np.array(component_names(dimension, cage), dtype=object),
    }


def _attributes(sweep: Sweep, model: CageModel | None) -> dict[str, Any]:
    return {
        "title": "jaxcage sweep over speed",
        "discard": sweep.discard,
        "revolutions": sweep.revolutions,
        "horizon": sweep.horizon,
        "confirmed": json.dumps(sweep.confirmed),
        "resolution_rpm": sweep.resolution_rpm if np.isfinite(sweep.resolution_rpm) else "none",
        "settings": json.dumps(sweep.settings),
        **_configured(model),
    }


def bearing_dataset(sweep: BearingSweep, model: BearingModel | None = None) -> "xr.Dataset":
    """A sweep of the whole bearing as a labelled data set.

    **Arguments:** the sweep; the model it was made with, whose every parameter then goes along.

    **Returns:** variables over `speed` and `start`, block means as `NAME_blocks` over `block` too, parts of the power
    over `part`; states and outcomes as codes with their names; units and words from the sweep.
    """
    import xarray as xr

    variables: dict[str, Any] = {}
    for field in dataclasses.fields(sweep):
        value, known = getattr(sweep, field.name), dict(field.metadata)
        about = {"units": known.get("unit", ""), "long_name": known.get("text", "")}
        if field.name in ("state", "outcome"):
            codes, flags = _coded(np.asarray(value, dtype=str))
            variables[field.name] = (_LANES, codes, about | flags)
        elif field.name == "power_parts_W":
            parts = np.stack([np.broadcast_to(x, sweep.cage_slip.shape) for x in value.values()], axis=-1)
            variables[field.name] = ((*_LANES, "part"), parts, about)
        elif field.name == "block_means":
            of = lambda name: "exponent_block" if name == "exponent" else "block"
            variables |= {f"{name}_blocks": ((*_LANES, of(name)), x, about) for name, x in value.items()}
        elif isinstance(value, np.ndarray) and field.name != "speed":
            variables[field.name] = (_LAST.get(field.name, _LANES), value, about)
    return xr.Dataset(
        variables,
        coords={
            "speed": ("speed", sweep.speed, {"units": "rad/s", "long_name": "shaft speed"}),
            "speed_rpm": ("speed", sweep.rpm, {"units": "rpm", "long_name": "shaft speed"}),
            "part": np.array(list(sweep.power_parts_W), dtype=object),
        },
        attrs={
            "title": "jaxcage sweep of a whole bearing over shaft speed",
            "discard": sweep.discard,
            "revolutions": sweep.revolutions,
            "settings": json.dumps(sweep.settings),
            **_configured(model),
        },
    )


def _configured(model: CageModel | BearingModel | None) -> dict[str, str]:
    return {} if model is None else {"configuration": json.dumps(configuration(model))}


def _coded(names: np.ndarray) -> tuple[np.ndarray, dict[str, Any]]:
    """Names as integer codes, and what these mean."""
    known, codes = np.unique(names, return_inverse=True)
    return codes.reshape(names.shape).astype(np.int32), _flags(known.tolist())


def _flags(names: list[str] | tuple[str, ...]) -> dict[str, Any]:
    """Meanings of integer codes, in the way of the CF conventions."""
    return {"flag_values": list(range(len(names))), "flag_meanings": " ".join(names)}


def from_dataset(dataset: "xr.Dataset") -> Sweep:
    """The sweep in a data set made by `to_dataset`."""
    stored = {name: np.asarray(dataset[name].values) for name in _DIMENSIONS}
    return Sweep(
        speed=np.asarray(dataset["speed"].values),
        discard=int(dataset.attrs["discard"]),
        revolutions=int(dataset.attrs["revolutions"]),
        escape=np.asarray(dataset["escape"].values) if "escape" in dataset else None,
        horizon=int(dataset.attrs.get("horizon", 0)),
        confirmed=tuple(Confirmation(*each) for each in json.loads(dataset.attrs.get("confirmed", "[]"))),
        settings=json.loads(dataset.attrs["settings"]),
        **stored,
    )


def stored_configuration(dataset: "xr.Dataset") -> Mapping[str, Any] | None:
    """The configuration of the model that made a data set, for `jaxcage.io.model_from`; None if
    there was none.
    """
    text = dataset.attrs.get("configuration")
    return None if text is None else json.loads(text)


def save_sweep(path: str | Path, sweep: Sweep, model: CageModel | None = None) -> Path:
    """Write a sweep to the zarr folder `path`, whole or not at all; an earlier result stays until
    then.
    """
    return _write(path, to_dataset(sweep, model))


def save_bearing_sweep(path: str | Path, sweep: BearingSweep, model: BearingModel | None = None) -> Path:
    """Write a sweep to the zarr folder `path`, whole or not at all; `jaxcage.io.open_sweep` reads it."""
    return _write(path, bearing_dataset(sweep, model))


def _write(path: str | Path, dataset: "xr.Dataset") -> Path:
    with replacing(path) as temporary:
        dataset.to_zarr(temporary, mode="w", consolidated=False)
    return Path(path)


def open_sweep(path: str | Path) -> "xr.Dataset":
    """The data set that `save_sweep` wrote, in memory.

    **Raises:** `FileNotFoundError`.
    """
    import xarray as xr

    if not Path(path).is_dir():
        raise FileNotFoundError(f"There is no stored sweep at '{path}'.")
    # Nothing but version 3, which we write: version 2 has a codec that unpickles, and so runs what a file says.
    with xr.open_dataset(path, engine="zarr", zarr_format=3, consolidated=False, chunks=None) as dataset:
        return dataset.load()


def load_sweep(path: str | Path) -> Sweep:
    """The sweep that `save_sweep` wrote. **Raises:** `FileNotFoundError`."""
    return from_dataset(open_sweep(path))
