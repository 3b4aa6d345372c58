"""The results of a study on disk: a zarr folder that plain xarray opens, filled chunk by chunk.

A chunk of lanes is one file per variable, with a checksum at its end (zarr's codec `crc32c`), each written atomically
and `outcome` last. A chunk is finished if all of its files exist and agree with their checksums; any other one is
pending, and is computed again with identical bits. Several processes may therefore write to one store without a lock.
Nothing in the folder depends on when, where or in which order it was written.
"""

import contextlib
import dataclasses
import json
import os
import shutil
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np
import xarray as xr

from .._errors import ArgumentError, InputError
from ..analysis import scatter
from ..files import sync
from ..models import AbstractForcedSystem
from .dataset import CODES, coded, configuration_of, coordinates_of, dataset, decoded, flags, settings_of
from .grid import Grid
from .observe import Observation
from .settings import Run


FORMAT = 4
"""Version of the layout of stores."""
Results = dict[str, np.ndarray]
"""Results of the lanes of a chunk by name."""


KNOWN = "jaxcage jax jaxlib numpy diffrax equinox lineax optimistix builtins".split()
"""Packages whose code is identified by their versions."""
OUTCOME = "outcome"
"""Variable that is written last: a chunk without it has never been finished."""


@dataclasses.dataclass(frozen=True, eq=False)
class Study:
    """A model, the grid over which it is run, and the settings of the runs."""

    model: AbstractForcedSystem
    grid: Grid
    run: Run
    name: str = ""
    version: str = ""
    """Version of the user's own code `name`, which a store cannot recognise without these two."""
    observations: bool = False
    """True to store the observations of lanes, from which a sweep makes its data set, in place of their results."""

    def __post_init__(self):
        self.grid.require_known(self.model)

    @property
    def description(self) -> str:
        """JSON by which a store recognises its study."""
        run = {f.name: getattr(self.run, f.name) for f in dataclasses.fields(self.run) if f.name != "method"}
        configured = configuration_of(self.model)
        system = json.loads(configured["configuration"]) if configured else numbers_of(self.model)
        about = {"name": self.name, "version": self.version, "system": system}
        about |= {"observations": True} if self.observations else {}
        method = {"method_numbers": numbers_of(self.run.method), **settings_of(self.run.method)}
        return json.dumps({**about, "plan": self.grid.describe(), **run, **method}, sort_keys=True)

    def blank(self) -> xr.Dataset:
        """Variables that are stored, for one lane that has not been run."""
        seen = Observation.pending(self.model, self.run, 1)
        if not self.observations:
            plan = self.grid.plan(self.model, np.zeros(1, dtype=int))
            return stored(dataset(plan, self.run, seen, plan.scale, np.array(["failed"])), self.model)
        dims = lambda name, x: ("lane", *(f"{name}_{i}" for i in range(x.ndim - 1)))
        words = lambda name: {"long_name": name, "units": "", **flags(CODES.get(name, ()))}
        return xr.Dataset({n: (dims(n, x), x, words(n)) for n, x in seen._asdict().items() if x.size})


def stored(found: xr.Dataset, model: AbstractForcedSystem) -> xr.Dataset:
    """Variables of a run that a study stores, with standard errors in place of the values of each block."""
    names = ["peak", "error", "steps", *(("exponents", "standard_error") if found.sizes["exponent"] else ())]
    for each in model.quantities:
        error = found[f"{each.name}_blocks"].reduce(scatter, "block")
        error.attrs = {"long_name": f"standard error, {each.text}", "units": each.unit}
        found = found.assign({f"{each.name}_standard_error": error})
        names += [each.name, f"{each.name}_standard_error"]
    return coded(found[[*names, *CODES]])


class Store:
    """The store of a study, created if there is none.

    **Raises:** `ValueError` for a folder that holds anything but results of this study, and for a study of the user's
    own code without a name and a version.
    """

    def __init__(self, path: str | Path, study: Study):
        self.path, self.study = Path(path), study
        if (own := _own_code([study.model, study.run.method])) and not (study.name and study.version):
            why = f"since a store cannot tell by itself whether your own {own} is still the same"
            if study.observations:  # a sweep, which has no name or version
                raise ArgumentError("store", said=f"must be left out, {why}: `study` takes a name and a version.")
            raise ArgumentError("name", "version", said=f"must be given, {why}.")
        with _going_on(self.path):
            if not os.path.lexists(self.path):
                _create(self.path, study)
            self._arrays = _same(self.path, study)
        self._finished: set[int] = set()

    def pending(self, among: Iterable[int] | None = None) -> list[int]:
        """Chunks that are not finished, or that disagree with their checksums."""
        chunks = range(len(self.study.grid.chunks)) if among is None else among
        unknown = [chunk for chunk in chunks if chunk not in self._finished]
        self._finished |= {chunk for chunk in unknown if _is_finished(self.path, self._arrays, chunk)}
        return [chunk for chunk in unknown if chunk not in self._finished]

    def write(self, chunk: int, results: Results) -> None:
        """Write the results of a chunk. **Raises:** `OSError`, with the reason and the remedy."""
        with _going_on(self.path):
            try:
                self._put(chunk, results)
            except FileNotFoundError:  # another process has just removed the temporary files
                self._put(chunk, results)
        self._finished.add(chunk)

    def _put(self, chunk: int, results: Results) -> None:
        region = self.study.grid.chunks[chunk]
        shape = tuple(part.stop - part.start for part in region)
        for name in sorted(results, key=lambda name: name == OUTCOME):
            self._arrays[name][region] = results[name].reshape(*shape, *results[name].shape[1:])

    def read(self, chunk: int) -> Results:
        """Results of a finished chunk."""
        region, axes = self.study.grid.chunks[chunk], len(self.study.grid.axes)
        whole = {name: x[region] for name, x in self._arrays.items() if x.ndim >= axes}  # without coordinates
        return {name: x.reshape(-1, *x.shape[axes:]) for name, x in whole.items()}

    def tidy(self) -> None:
        """Remove temporary files of killed processes from a store to which nobody writes any more."""
        for left in self.path.rglob("*.partial"):
            with contextlib.suppress(OSError):
                left.unlink()
        for left in self.path.parent.glob(f".{self.path.name}.*.partial"):
            shutil.rmtree(left, ignore_errors=True)


def lanes_of_chunks(path: str | Path, otherwise: int) -> int:
    """Maximum number of lanes per chunk of the store at `path`; `otherwise` if there is none."""
    try:
        return json.loads(_opened(Path(path), "r")[0]["study"])["plan"]["lanes"]
    except (FileNotFoundError, ValueError, KeyError, TypeError):  # `Store` says what is wrong with it
        return otherwise


def open_study(path: str | Path) -> xr.Dataset:
    """Open the results so far of the study in the folder `path`.

    **Returns:** a data set as of `study`, read from disk when it is used. Lanes that have not been run are NaN with the
    label and outcome `pending`. Reading a chunk that disagrees with its checksum raises zarr's `ValueError`; running
    the study again computes it again.

    **Raises:** `FileNotFoundError`; `ValueError` if it cannot be opened.
    """
    _opened(Path(path), "r")
    # Only version 3, without consolidated metadata: version 2 has a codec that may execute code from a file.
    options: dict[str, Any] = dict(engine="zarr", zarr_format=3, consolidated=False, chunks=None)
    try:
        return decoded(xr.open_dataset(path, **options))
    except ValueError as error:
        raise _damaged(path, error) from error


def _is_finished(path: Path, arrays: Mapping[str, Any], chunk: int) -> bool:
    """True if all files of a chunk exist and agree with their checksums."""
    counts = arrays[OUTCOME].cdata_shape
    place = tuple(map(int, np.unravel_index(chunk, counts)))
    for name in sorted(arrays, key=lambda name: name != OUTCOME):
        array = arrays[name]
        if array.ndim < len(counts):  # a coordinate
            continue
        block = place + (0,) * (array.ndim - len(counts))
        if not (path / name / array.metadata.encode_chunk_key(block)).is_file():
            return False
        try:
            array.get_block_selection(block)
        except (ValueError, OSError):
            return False
    return True


def _opened(path: Path, mode: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Attributes and arrays of a store. **Raises:** `FileNotFoundError`; `InputError` if it is damaged."""
    import zarr

    missing = FileNotFoundError(f"There is no study at '{path}'.")
    if not (path / "zarr.json").is_file():
        raise missing
    every_file: Any = {"array.write_empty_chunks": True}  # so that a missing file has never been written
    try:
        with zarr.config.set(every_file):
            group = zarr.open_group(path, mode=mode, zarr_format=3, use_consolidated=False)  # pyright: ignore
            about, arrays = dict(group.attrs), dict(group.arrays())
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise _damaged(path, error) from error
    if "study" not in about:
        raise missing
    return about, arrays


def _damaged(path: str | Path, error: Exception) -> InputError:
    why = str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
    return InputError(f"The store '{path}' is damaged ({why}): choose another folder, or delete this one.")


@contextlib.contextmanager
def _going_on(path: Path) -> Iterator[None]:
    """Add the store and the remedy to the message of an `OSError` while writing."""
    try:
        yield
    except OSError as error:
        raise OSError(
            f"The store '{path}' could not be written to ({error.strerror or error}): what is stored stays, and once "
            "there is room the same call goes on from there."
        ) from error


def _same(path: Path, study: Study) -> dict[str, Any]:
    """Arrays of the store of this study. **Raises:** `ArgumentError` for another one; `InputError` for its format."""
    refused = "must be a new folder or the store of this study, but"
    try:
        about, arrays = _opened(path, "r+")
    except FileNotFoundError as error:
        raise ArgumentError("store", said=f"{refused} '{path}' is neither.") from error
    if (theirs := about.get("store_format", 1)) != FORMAT:
        said = f"and this version of jaxcage writes format {FORMAT}: it can be read, but not be added to"
        raise InputError(f"The store '{path}' is of format {theirs}, {said}.")
    if about["study"] != study.description:
        different = _differences(json.loads(about["study"]), json.loads(study.description))
        what = ", ".join(different) or "its lanes"
        other = f"'{path}' holds another study, which differs in {what}: choose another folder."
        raise ArgumentError("store", said=f"{refused} {other}")
    return arrays


def _differences(theirs: Any, ours: Any, name: str = "") -> list[str]:
    """Names of the entries that differ between two nested mappings."""
    if not (isinstance(theirs, dict) and isinstance(ours, dict)):
        return [] if theirs == ours else [name]
    keys = [key for key in {**ours, **theirs} if theirs.get(key) != ours.get(key)]
    dotted = lambda key: key if name in ("", "system", "plan") else f"{name}.{key}"
    return [found for key in keys for found in _differences(theirs.get(key), ours.get(key), dotted(key))]


def _own_code(x: Any) -> str | None:
    """First class or function in a tree that belongs neither to this package nor to its dependencies."""
    if isinstance(x, tuple | list | dict):
        parts = list(x.values() if isinstance(x, dict) else x)
    else:
        module = getattr(x, "__module__", None) or type(x).__module__
        if module.partition(".")[0] not in KNOWN:
            return getattr(x, "__name__", type(x).__name__)
        parts = [getattr(x, f.name, None) for f in dataclasses.fields(x)] if dataclasses.is_dataclass(x) else []
    return next(filter(None, map(_own_code, parts)), None)


# The empty store: its metadata depend on the study alone, byte for byte.


def _create(path: Path, study: Study) -> None:
    """Create an empty store in a temporary folder and rename it; if another process is faster, its store is kept."""
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


def _write(path: Path, study: Study) -> None:
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    grid, compressors = study.grid, (ZstdCodec(), Crc32cCodec())  # any reader of zarr verifies the checksums
    axes = coordinates_of(study.model, grid.coordinates) | {"exponent": np.arange(1, study.run.exponents + 1)}
    checked = {name: {"compressors": compressors} for name in axes}
    xr.Dataset(coords=axes, attrs=_attributes(study)).to_zarr(path, mode="w", consolidated=False, encoding=checked)
    group = zarr.open_group(path, mode="r+", zarr_format=3, use_consolidated=False)
    for name, variable in study.blank().items():
        codes, extra = "flag_values" in variable.attrs, variable.shape[1:]
        group.create_array(
            str(name),
            shape=(*grid.shape, *extra),
            chunks=(*grid.block, *extra),
            dtype="int8" if codes else "float64",
            fill_value=-1 if codes else np.nan,
            compressors=compressors,
            dimension_names=(*grid.axes, *map(str, variable.dims[1:])),
            attributes=variable.attrs,
        )
    with warnings.catch_warnings():  # zarr warns that this is not in the specification yet; xarray warns without it
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(path)


def _attributes(study: Study) -> dict[str, Any]:
    return {
        "title": "jaxcage study",
        "store_format": FORMAT,
        "study": study.description,
        "discard": study.run.discard,
        "revolutions": study.run.revolutions,
        "seed": study.grid.seed,
        **configuration_of(study.model),
        **{name: text for name, text in settings_of(study.run.method).items() if name.startswith("version_")},
    }


def numbers_of(module: eqx.Module) -> dict[str, Any]:
    """Numbers of a module by their paths."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(module)
    named = lambda path: jax.tree_util.keystr(path).lstrip(".")
    return {named(path): np.asarray(x).tolist() for path, x in leaves if eqx.is_array_like(x)}
