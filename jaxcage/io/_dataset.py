"""`Sweep` <-> labelled data set <-> zarr, with the configuration and versions that made it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._glossary import component_names, quantity
from ..analysis import Confirmation, Sweep
from ..integrate import OUTCOMES
from ..models import CageModel
from ._files import replacing
from ._write_config import configuration


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
    labels, codes = np.unique(sweep.label, return_inverse=True)
    codes = codes.reshape(sweep.label.shape).astype(np.int32)
    dataset = xr.Dataset(
        {**stored, **derived, "label": (("speed", "start"), codes)},
        coords=_coordinates(sweep, cage=model is not None),
        attrs=_attributes(sweep, model),
    )
    for name in dataset.variables:
        known = quantity("exponent" if name == "exponents" else str(name))
        dataset[name].attrs |= {"long_name": known.text, "units": known.unit}
    dataset["outcome"].attrs |= _flags(OUTCOMES)
    dataset["label"].attrs |= _flags(labels.tolist())
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
    configured = {} if model is None else {"configuration": json.dumps(configuration(model))}
    return {
        "title": "jaxcage sweep over speed",
        "discard": sweep.discard,
        "revolutions": sweep.revolutions,
        "horizon": sweep.horizon,
        "confirmed": json.dumps(sweep.confirmed),
        "resolution_rpm": sweep.resolution_rpm if np.isfinite(sweep.resolution_rpm) else "none",
        "settings": json.dumps(sweep.settings),
        **configured,
    }


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
    dataset = to_dataset(sweep, model)
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
