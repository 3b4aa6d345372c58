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
from ..io import put_bytes, sync
from ._manifest import ABOUT, FOLDER, FORMAT, describing, is_as_marked, make_way, mark, write_entry
from ._plan import SAMPLE
from ._stored import PENDING, SPEED, AbstractStudy, Variable
from ._study import OIL


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


def mend(path: Path, study: AbstractStudy) -> None:
    """Write again what describes a store, where it is not what it was."""
    with tempfile.TemporaryDirectory() as scratch:
        new = Path(scratch) / "store"
        _write(new, study)
        for name in [*describing(new), ABOUT]:
            there, wanted = path / name, (new / name).read_bytes()
            if not is_as_marked(there, mark(wanted)):
                make_way(path, there)
                put_bytes(there, wanted)


def _write(path: Path, study: AbstractStudy) -> None:
    import xarray as xr
    import zarr

    from ._zarr import compressors

    plan, variables = study.plan, study.variables
    coordinates = _coordinates(study)
    dataset = xr.Dataset(coords=coordinates, attrs=_attributes(study))
    checked = {name: {"compressors": compressors()} for name in coordinates}
    dataset.to_zarr(path, mode="w", consolidated=False, encoding=checked)
    group = zarr.open_group(path, mode="r+", zarr_format=3, use_consolidated=False)
    for name, variable in variables.items():
        extra = [study.extents[d] for d in variable.within]
        group.create_array(
            name,
            shape=(*plan.shape, *extra),
            chunks=(*plan.block, *extra),
            dtype=variable.kind,
            fill_value=np.nan if variable.kind == "float64" else PENDING,
            compressors=compressors(),
            dimension_names=(*plan.axes, *variable.within),
            attributes=_words(variable),
        )
    group.create_group(FOLDER, attributes={"long_name": "digests of what is finished, by jaxcage.studies.check_study"})
    with warnings.catch_warnings():  # zarr warns that the specification does not have this yet; xarray warns without it
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(path)
    about = {
        "format": FORMAT,
        "fingerprint": study.fingerprint,
        "blocks": list(plan.blocks),
        "variables": {name: len(variable.within) for name, variable in variables.items()},
        "files": describing(path),
    }
    write_entry(path / ABOUT, about)


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
        "fingerprint": study.fingerprint,
        "study": json.dumps(described),
        "discard": study.discard,
        "revolutions": study.revolutions,
        "seed": study.plan.seed,
        **({} if configured is None else {"configuration": json.dumps(configured)}),
        **{name: text for name, text in described.items() if name.startswith("version_")},
    }
