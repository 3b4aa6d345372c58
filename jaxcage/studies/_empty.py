"""The empty store of a study: what describes it follows from the study alone, byte for byte."""

import json
import os
import shutil
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from .._glossary import quantity
from .._parameters import parameter_info
from ..io import sync
from ._plan import SAMPLE
from ._stored import PENDING, SPEED, AbstractStudy, Variable
from ._study import OIL


FORMAT = 3
"""Of stores."""


def create(path: Path, study: AbstractStudy) -> None:
    """Make an empty store beside its place and move it there in one step; whoever comes second leaves it alone."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{path.name}.", suffix=".partial", dir=path.parent))
    try:
        _write(aside / path.name, study)
        sync(aside / path.name)
        os.rename(aside / path.name, path)
    except OSError:
        if not path.exists():
            raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _write(path: Path, study: AbstractStudy) -> None:
    import xarray as xr
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    plan, compressors = study.plan, (ZstdCodec(), Crc32cCodec())  # any reader of zarr compares the checksums
    coordinates = _coordinates(study)
    dataset = xr.Dataset(coords=coordinates, attrs=_attributes(study))
    checked = {name: {"compressors": compressors} for name in coordinates}
    dataset.to_zarr(path, mode="w", consolidated=False, encoding=checked)
    group = zarr.open_group(path, mode="r+", zarr_format=3, use_consolidated=False)
    for name, variable in study.variables.items():
        extra = [study.extents[d] for d in variable.within]
        group.create_array(
            name,
            shape=(*plan.shape, *extra),
            chunks=(*plan.block, *extra),
            dtype=variable.kind,
            fill_value=np.nan if variable.kind == "float64" else PENDING,
            compressors=compressors,
            dimension_names=(*plan.axes, *variable.within),
            attributes=_words(variable),
        )
    with warnings.catch_warnings():  # zarr warns that the specification does not have this yet; xarray warns without it
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(path)


def _words(variable: Variable) -> dict[str, Any]:
    words: dict[str, Any] = {"long_name": variable.text, "units": variable.unit}
    if not variable.names:
        return words
    codes = [PENDING, *range(len(variable.names))]
    return words | {"flag_values": codes, "flag_meanings": " ".join(["pending", *variable.names])}


def _coordinates(study: AbstractStudy) -> dict[str, Any]:
    plan, info = study.plan, parameter_info(study.system)

    def words(name: str) -> dict[str, str]:
        if name == OIL:
            return {"long_name": "ISO VG grade of the oil", "units": "mm^2/s"}
        if name == SPEED:
            return {"long_name": study.speed_text, "units": "rad/s"}
        known = info.get(name) or quantity(name)
        return {"long_name": known.text, "units": known.unit}

    found: dict[str, Any] = {name: (name, np.asarray(x), words(name)) for name, x in plan.grid.items()}
    found |= {name: (SAMPLE, x, words(name)) for name, x in plan.cloud.items()}
    if SPEED in plan.names:
        dims, speed, _ = found[SPEED]
        found["speed_rpm"] = (dims, speed * 30 / np.pi, {"long_name": study.speed_text, "units": "rpm"})
    return found | study.labels_within


def _attributes(study: AbstractStudy) -> dict[str, Any]:
    described, configured = study.describe(), study.configuration
    return {
        "title": "jaxcage study",
        "store_format": FORMAT,
        "study": study.description,
        "discard": study.discard,
        "revolutions": study.revolutions,
        "seed": study.plan.seed,
        **({} if configured is None else {"configuration": json.dumps(configured)}),
        **{name: text for name, text in described.items() if name.startswith("version_")},
    }
