"""`BearingSweep` -> labelled data set -> zarr, with the configuration and versions that made it."""

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis import BearingSweep
from ..models import BearingModel
from ._files import replacing
from ._write_config import configuration


if TYPE_CHECKING:
    import xarray as xr

LANES = ("speed", "start")
_CODES = ("state", "outcome")
_LAST: dict[str, tuple[str, ...]] = {
    "last_rollers": (*LANES, "of_roller", "roller"),
    "last_bodies": (*LANES, "of_bodies"),
}


def bearing_dataset(sweep: BearingSweep, model: BearingModel | None = None) -> "xr.Dataset":
    """A sweep of the whole bearing as a labelled data set.

    **Arguments:** the sweep; the model it was made with, whose every parameter then goes along.

    **Returns:** variables over `speed` and `start`, block means as `NAME_blocks` over `block` too, parts of the power
    over `part`; states and outcomes as codes with their names; units and words from the sweep.
    """
    variables: dict[str, Any] = {}
    for field in dataclasses.fields(sweep):
        value, known = getattr(sweep, field.name), dict(field.metadata)
        about = {"units": known.get("unit", ""), "long_name": known.get("text", "")}
        if field.name in _CODES:
            names, codes = np.unique(np.asarray(value, dtype=str), return_inverse=True)
            flags = {"flag_values": list(range(len(names))), "flag_meanings": " ".join(names.tolist())}
            variables[field.name] = (LANES, codes.reshape(np.shape(value)).astype(np.int32), about | flags)
        elif field.name == "power_parts_W":
            parts = np.stack([np.broadcast_to(x, sweep.cage_slip.shape) for x in value.values()], axis=-1)
            variables[field.name] = ((*LANES, "part"), parts, about)
        elif field.name == "block_means":
            of = lambda name: "exponent_block" if name == "exponent" else "block"
            variables |= {f"{name}_blocks": ((*LANES, of(name)), x, about) for name, x in value.items()}
        elif isinstance(value, np.ndarray) and field.name != "speed":
            variables[field.name] = (_LAST.get(field.name, LANES), value, about)
    configured = {} if model is None else {"configuration": json.dumps(configuration(model))}
    import xarray as xr

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
            **configured,
        },
    )


def save_bearing_sweep(path: str | Path, sweep: BearingSweep, model: BearingModel | None = None) -> Path:
    """Write a sweep to the zarr folder `path`, whole or not at all; `jaxcage.io.open_sweep` reads it."""
    dataset = bearing_dataset(sweep, model)
    with replacing(path) as temporary:
        dataset.to_zarr(temporary, mode="w", consolidated=False)
    return Path(path)
