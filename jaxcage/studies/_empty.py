"""The empty store of a study: what describes it follows from the study alone, byte for byte."""

import json
import os
import shutil
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from .._glossary import component_names, quantity
from .._parameters import parameter_info
from ..integrate import OUTCOMES
from ..io import put_bytes, sync
from ..models import CageModel
from ._manifest import ABOUT, FOLDER, FORMAT, describing, is_as_marked, make_way, mark, write_entry
from ._plan import SAMPLE
from ._study import LABELS, OIL, PENDING, SPEED, Study


def create(path: Path, study: Study) -> None:
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


def mend(path: Path, study: Study) -> None:
    """Write again what describes a store, where it is not what it was."""
    with tempfile.TemporaryDirectory() as scratch:
        new = Path(scratch) / "store"
        _write(new, study)
        for name in [*describing(new), ABOUT]:
            there, wanted = path / name, (new / name).read_bytes()
            if not is_as_marked(there, mark(wanted)):
                make_way(path, there)
                put_bytes(there, wanted)


def _write(path: Path, study: Study) -> None:
    import xarray as xr
    import zarr

    from ._zarr import compressors

    plan, shape = study.plan, _shapes(study)
    coordinates = _coordinates(study, shape)
    dataset = xr.Dataset(coords=coordinates, attrs=_attributes(study))
    checked = {name: {"compressors": compressors()} for name in coordinates}
    dataset.to_zarr(path, mode="w", consolidated=False, encoding=checked)
    group = zarr.open_group(path, mode="r+", zarr_format=3, use_consolidated=False)
    for name, (dims, kind) in shape.items():
        extra = [_extents(study)[d] for d in dims[len(plan.shape) :]]
        group.create_array(
            name,
            shape=(*plan.shape, *extra),
            chunks=(*plan.block, *extra),
            dtype=kind,
            fill_value=np.nan if kind == "float64" else PENDING,
            compressors=compressors(),
            dimension_names=dims,
            attributes=_words(name),
        )
    group.create_group(FOLDER, attributes={"long_name": "digests of what is finished, by jaxcage.studies.check_study"})
    with warnings.catch_warnings():  # zarr warns that the specification does not have this yet; xarray warns without it
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(path)
    about = {
        "format": FORMAT,
        "fingerprint": study.fingerprint,
        "blocks": list(plan.blocks),
        "variables": {name: len(dims) - len(plan.shape) for name, (dims, _) in shape.items()},
        "files": describing(path),
    }
    write_entry(path / ABOUT, about)


def _extents(study: Study) -> dict[str, int]:
    """Lengths of the axes within a lane."""
    return {"exponent": study.exponents, "revolution": study.strobe, "component": study.system.dimension}


def _shapes(study: Study) -> dict[str, tuple[tuple[str, ...], str]]:
    """Dimensions and kind of number of every variable."""
    lanes = tuple(study.plan.axes)
    one = {name: (lanes, "float64") for name in ("largest_exponent", "standard_error", "peak", "error")}
    one |= {name: (lanes, "int8") for name in ("period", "label", "outcome")}
    if study.exponents > 1:
        one |= {name: ((*lanes, "exponent"), "float64") for name in ("exponents", "standard_errors")}
    if study.strobe:
        one["strobe"] = ((*lanes, "revolution", "component"), "float64")
    return one


def _words(name: str) -> dict[str, Any]:
    known = quantity({"exponents": "exponent", "standard_errors": "standard_error"}.get(name, name))
    words: dict[str, Any] = {"long_name": known.text, "units": known.unit}
    meanings = {"label": LABELS, "outcome": OUTCOMES}.get(name)
    if meanings is None:
        return words
    codes = [PENDING, *range(len(meanings))]
    return words | {"flag_values": codes, "flag_meanings": " ".join(["pending", *meanings])}


def _coordinates(study: Study, shapes: dict[str, tuple[tuple[str, ...], str]]) -> dict[str, Any]:
    plan = study.plan
    info = parameter_info(study.system)

    def words(name: str) -> dict[str, str]:
        if name == OIL:
            return {"long_name": "ISO VG grade of the oil", "units": "mm^2/s"}
        known = quantity(name) if name == SPEED or name not in info else None
        return {
            "long_name": known.text if known else info[name].text,
            "units": known.unit if known else info[name].unit,
        }

    found: dict[str, Any] = {name: (name, np.asarray(x), words(name)) for name, x in plan.grid.items()}
    found |= {name: (SAMPLE, x, words(name)) for name, x in plan.cloud.items()}
    if SPEED in plan.names:
        dims, speed, _ = found[SPEED]
        known = quantity("speed_rpm")
        found["speed_rpm"] = (dims, speed * 30 / np.pi, {"long_name": known.text, "units": known.unit})
    if "strobe" in shapes:
        last = study.discard + study.revolutions
        found["revolution"] = np.arange(last - study.strobe + 1, last + 1)
        names = component_names(study.system.dimension, isinstance(study.system, CageModel))
        found["component"] = np.array(names, dtype=object)
    return found


def _attributes(study: Study) -> dict[str, Any]:
    described = study.describe()
    system, configured = study.system, {}
    if isinstance(system, CageModel) and not system.extra:  # a configuration cannot hold forces of one's own
        configured = {"configuration": json.dumps(described["system"])}
    return {
        "title": "jaxcage study",
        "store_format": FORMAT,
        "fingerprint": study.fingerprint,
        "study": json.dumps(described),
        "discard": study.discard,
        "revolutions": study.revolutions,
        "seed": study.plan.seed,
        **configured,
        **{name: text for name, text in described.items() if name.startswith("version_")},
    }
