"""The results of a study on disk: a zarr folder that plain xarray opens, whole at any time, filled chunk by chunk.

A chunk of lanes is one file of each variable, written aside and put in place in one step, `outcome` last: a chunk is
done if its outcomes are no longer pending. What was written before a kill without its outcomes is written again, with
the same bits. Nothing in the folder depends on when, where or in which order it was written.
"""

import contextlib
import json
import os
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._errors import ArgumentError
from .._glossary import component_names, quantity
from .._parameters import parameter_info
from ..integrate import OUTCOMES
from ..models import CageModel
from ._plan import SAMPLE
from ._study import LABELS, OIL, PENDING, SPEED, Results, Study


if TYPE_CHECKING:
    import xarray as xr


class OtherStudy(ArgumentError):
    """A store that belongs to another study; the message says in what they differ."""


class Store:
    """The store of a study, made if there is none."""

    def __init__(self, path: str | Path, study: Study):
        """**Raises:** `OtherStudy` for a folder that holds anything else than results of this very study."""
        self.path, self.study = Path(path), study
        if not self.path.exists():
            with _going_on(self.path):
                _create(self.path, study)
        _check_same(self.path, study)
        self._arrays = {name: array for name, array in _group(self.path, "r+").arrays()}

    def pending(self) -> list[int]:
        """Chunks that are not done, read from the store."""
        outcome = np.asarray(self._arrays["outcome"][...])
        plan = self.study.plan
        return [i for i in range(plan.chunks) if np.any(outcome[plan.region(i)] == PENDING)]

    def write(self, chunk: int, results: Results) -> None:
        """Put the results of a chunk in place.

        **Raises:** `OSError`, one sentence with the reason and how to go on.
        """
        region = self.study.plan.region(chunk)
        with _going_on(self.path):
            for name in sorted(results, key=lambda name: name == "outcome"):
                self._arrays[name][region] = results[name]

    def tidy(self) -> None:
        """Remove what kills left behind; for a store that nobody writes to any more."""
        for left in self.path.rglob("*.partial"):
            left.unlink(missing_ok=True)
        for left in self.path.parent.glob(f".{self.path.name}.*.partial"):
            shutil.rmtree(left, ignore_errors=True)


def open_study(path: str | Path) -> "xr.Dataset":
    """The results of a study so far, read from disk when they are used.

    Lanes that have not been run are NaN with the label and outcome -1.

    **Raises:** `FileNotFoundError`.
    """
    import xarray as xr

    if not (Path(path) / "zarr.json").is_file():
        raise FileNotFoundError(f"There is no study at '{path}'.")
    # Version 3 only, and not what consolidated metadata say: version 2 has a codec that runs what a file says.
    return xr.open_dataset(path, engine="zarr", zarr_format=3, consolidated=False, chunks=None)


def label_names(dataset: "xr.Dataset") -> "xr.DataArray":
    """What each lane of a study does, in words; `pending` where it has not been run."""
    names = np.array([*LABELS, "pending"])  # -1 is the last
    label = dataset["label"]
    return label.copy(data=names[np.asarray(label.values, int)])


@contextlib.contextmanager
def _going_on(path: Path) -> Iterator[None]:
    """Around writing: what the system refuses becomes one sentence."""
    try:
        yield
    except OSError as error:
        raise OSError(
            f"The store '{path}' could not be written to ({error.strerror or error}): what is stored stays, and once "
            "there is room the same call goes on from there."
        ) from error


def _group(path: Path, mode: Any) -> Any:
    import zarr

    return zarr.open_group(path, mode=mode, zarr_format=3, use_consolidated=False)


def _check_same(path: Path, study: Study) -> None:
    if not (path / "zarr.json").is_file():
        raise OtherStudy("store", said=f"must be a new folder or the store of this study, but '{path}' is neither.")
    attributes = _group(path, "r").attrs
    if attributes.get("fingerprint") == study.fingerprint:
        return
    theirs, ours = json.loads(str(attributes.get("study", "{}"))), json.loads(json.dumps(study.describe()))
    different = ", ".join(_differences(theirs, ours)) or "its lanes"
    other = f"'{path}' holds another study, which differs in {different}: choose another folder."
    raise OtherStudy("store", said=f"must be a new folder or the store of this study, but {other}")


def _differences(theirs: Any, ours: Any, name: str = "") -> list[str]:
    """Names of what differs between two nested mappings."""
    if not (isinstance(theirs, dict) and isinstance(ours, dict)):
        return [] if theirs == ours else [name]
    keys = [key for key in {**ours, **theirs} if theirs.get(key) != ours.get(key)]
    dotted = lambda key: key if name in ("", "system", "plan") else f"{name}.{key}"
    return [found for key in keys for found in _differences(theirs.get(key), ours.get(key), dotted(key))]


def _create(path: Path, study: Study) -> None:
    """Make an empty store beside its place and move it there in one step; whoever comes second leaves it alone."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{path.name}.", suffix=".partial", dir=path.parent))
    try:
        _write_template(aside / path.name, study)
        os.rename(aside / path.name, path)
    except OSError:
        if not path.exists():
            raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _write_template(path: Path, study: Study) -> None:
    import xarray as xr
    import zarr

    plan, shape = study.plan, _shapes(study)
    dataset = xr.Dataset(coords=_coordinates(study, shape), attrs=_attributes(study))
    dataset.to_zarr(path, mode="w", consolidated=False)
    group = _group(path, "r+")
    for name, (dims, kind) in shape.items():
        extra = [_extents(study)[d] for d in dims[len(plan.shape) :]]
        group.create_array(
            name,
            shape=(*plan.shape, *extra),
            chunks=(*plan.block, *extra),
            dtype=kind,
            fill_value=np.nan if kind == "float64" else PENDING,
            dimension_names=dims,
            attributes=_words(name),
        )
    with warnings.catch_warnings():  # zarr warns that the specification does not have this yet; xarray warns without it
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(path)


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
        "fingerprint": study.fingerprint,
        "study": json.dumps(described),
        "discard": study.discard,
        "revolutions": study.revolutions,
        "seed": study.plan.seed,
        **configured,
        **{name: text for name, text in described.items() if name.startswith("version_")},
    }
