"""The results of a study on disk: a zarr folder that plain xarray opens, filled chunk by chunk.

A chunk of lanes is one file of each variable, with a checksum at its end (zarr's codec `crc32c`), put in place in one
step, `outcome` last. A chunk is finished if all of its files are there and agree with their checksums; any other one is
pending, and is computed again with the same bits. So two processes may write to one store without a lock: both write
the same files. Nothing in the folder depends on when, where or in which order it was written.
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
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from .._errors import ArgumentError, InputError
from .._parameters import parameter_info
from ..files import sync
from ..quantities import quantity
from .dataset import configuration_of, decoded
from .grid import OIL, SAMPLE
from .plan import SPEED


if TYPE_CHECKING:
    from .study import Study

FORMAT = 4
"""Version of the layout of stores."""
PENDING = -1
"""Code of a lane that has not been run yet."""
Results = dict[str, np.ndarray]
"""Output by name; the lanes are the first axis."""


@dataclasses.dataclass(frozen=True)
class Variable:
    """A variable that is stored of every lane."""

    text: str
    unit: str
    kind: str = "float64"
    names: tuple[str, ...] = ()
    """Meanings of the codes 0, 1, ...; none for numbers that are no codes."""
    within: tuple[str, ...] = ()
    """Axes within a lane."""


OUTCOME = "outcome"
"""The variable that is written last: a chunk without it has never been finished."""


class OtherStudy(ArgumentError):
    """A store that belongs to another study; the message says in what they differ."""


class DamagedStore(InputError):
    """A store of which what describes it cannot be read."""


class Store:
    """The store of a study, made if there is none."""

    def __init__(self, path: str | Path, study: "Study"):
        """**Raises:** `OtherStudy` for a folder that holds anything else than results of this very study; `ValueError`
        for a study of the user's own code without a name and a version.
        """
        self.path, self.study = Path(path), study
        if (own := study.own_code) and not (study.name and study.version):
            said = f"must be given, since a store cannot tell by itself whether your own {own} is still the same."
            raise ArgumentError("name", "version", said=said)
        with _going_on(self.path):
            if not os.path.lexists(self.path):
                _create(self.path, study)
            about, arrays = _same(self.path, study)
        self._chunks = _Chunks(self.path, arrays)
        self._finished: set[int] = set()

    def pending(self, among: Iterable[int] | None = None) -> list[int]:
        """Chunks that are not finished, or are not what was written."""
        chunks = range(self.study.grid.chunks) if among is None else among
        self._finished |= {c for c in chunks if c not in self._finished and self._chunks.damage(c) is None}
        return [chunk for chunk in chunks if chunk not in self._finished]

    def write(self, chunk: int, results: Results) -> None:
        """Put the results of a chunk in place.

        **Raises:** `OSError`, one sentence with the reason and how to go on.
        """
        with _going_on(self.path):
            try:
                self._put(chunk, results)
            except FileNotFoundError:  # another process has just tidied up what is written aside
                self._put(chunk, results)
        self._finished.add(chunk)

    def _put(self, chunk: int, results: Results) -> None:
        region = self.study.grid.region(chunk)
        for name in sorted(results, key=lambda name: name == OUTCOME):
            self._chunks.arrays[name][region] = results[name]

    def tidy(self) -> None:
        """Remove what kills left behind; for a store that nobody writes to any more."""
        for left in self.path.rglob("*.partial"):
            with contextlib.suppress(OSError):
                left.unlink()
        for left in self.path.parent.glob(f".{self.path.name}.*.partial"):
            shutil.rmtree(left, ignore_errors=True)


@dataclasses.dataclass(frozen=True)
class StoreState:
    """What of a store is finished, and what of it is damaged."""

    chunks: int
    """Chunks in all."""
    finished: int
    """Chunks of which all files agree with their checksums."""
    damaged: dict[int, str]
    """Chunk -> what is wrong with it. It is computed again when the study is run again."""

    def __str__(self) -> str:
        left = self.chunks - self.finished - len(self.damaged)
        counts = f"{self.finished} of {self.chunks} chunks are as they were written, {len(self.damaged)} are damaged"
        wrong = [f"  chunk {chunk}: {what}" for chunk, what in self.damaged.items()]
        return "\n".join([f"{counts}, {left} are not computed yet", *wrong])


def check_study(path: str | Path) -> StoreState:
    """Read every chunk of a store, and compare it with its checksum.

    **Returns:** `StoreState`.

    **Raises:** `FileNotFoundError` if there is no store; `DamagedStore`, a `ValueError`, if it cannot be opened.
    """
    about, arrays = _opened(Path(path), "r")
    _require_format(Path(path), about)
    chunks = _Chunks(Path(path), arrays)
    wrong = {chunk: chunks.damage(chunk) for chunk in range(chunks.number)}
    damaged = {chunk: what for chunk, what in wrong.items() if what}
    return StoreState(len(wrong), sum(what is None for what in wrong.values()), damaged)


def open_study(path: str | Path) -> xr.Dataset:
    """The results of a study so far, read from disk when they are used.

    Lanes that have not been run are NaN with the label and outcome `pending`. Reading a chunk that does not agree with
    its checksum is a `ValueError` of zarr's; running the study again computes it again.

    **Raises:** `FileNotFoundError`; `DamagedStore`, a `ValueError`, if it cannot be opened.
    """
    _opened(Path(path), "r")
    # Version 3 only, and not what consolidated metadata say: version 2 has a codec that runs what a file says.
    options: dict[str, Any] = dict(engine="zarr", zarr_format=3, consolidated=False, chunks=None)
    try:
        return decoded(xr.open_dataset(path, **options))
    except ValueError as error:
        raise _damaged(path, error) from error


@dataclasses.dataclass(frozen=True)
class _Chunks:
    """The chunks of all variables of a store, whose axes begin with those of `outcome`."""

    path: Path
    arrays: Mapping[str, Any]

    @property
    def number(self) -> int:
        """Chunks in all."""
        return int(np.prod(self.arrays[OUTCOME].cdata_shape))

    def damage(self, chunk: int) -> str | None:
        """Why a chunk is not finished: an empty text if it has never been, None if it is."""
        last = self.arrays[OUTCOME]
        place = tuple(map(int, np.unravel_index(chunk, last.cdata_shape)))
        variables = {name: array for name, array in self.arrays.items() if array.ndim >= last.ndim}
        for name in sorted(variables, key=lambda name: name != OUTCOME):
            array = variables[name]
            block = place + (0,) * (array.ndim - last.ndim)
            file = f"{name}/{array.metadata.encode_chunk_key(block)}"
            if not (self.path / file).is_file():
                return "" if name == OUTCOME else f"{file} is missing"
            try:
                array.get_block_selection(block)
            except (ValueError, OSError):
                return f"{file} is not what was written"
        return None


def _opened(path: Path, mode: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Attributes and arrays of a store.

    **Raises:** `FileNotFoundError`; `DamagedStore`.
    """
    import zarr

    missing = FileNotFoundError(f"There is no study at '{path}'.")
    if not (path / "zarr.json").is_file():
        raise missing
    every_file: Any = {"array.write_empty_chunks": True}  # so that one that is not there has never been written
    try:
        with zarr.config.set(every_file):
            group = zarr.open_group(path, mode=mode, zarr_format=3, use_consolidated=False)  # pyright: ignore
            about, arrays = dict(group.attrs), dict(group.arrays())
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise _damaged(path, error) from error
    if "study" not in about:
        raise missing
    return about, arrays


def _damaged(path: str | Path, error: Exception) -> DamagedStore:
    why = str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
    return DamagedStore(f"The store '{path}' is damaged ({why}): choose another folder, or delete this one.")


def _require_format(path: Path, about: Mapping[str, Any]) -> None:
    if (theirs := about.get("store_format", 1)) != FORMAT:
        said = f"and this version of jaxcage writes format {FORMAT}: it can be read, but not be added to or checked"
        raise InputError(f"The store '{path}' is of format {theirs}, {said}.")


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


def _same(path: Path, study: "Study") -> tuple[dict[str, Any], dict[str, Any]]:
    """Attributes and arrays of the store of this study.

    **Raises:** `OtherStudy`.
    """
    refused = "must be a new folder or the store of this study, but"
    try:
        about, arrays = _opened(path, "r+")
    except FileNotFoundError as error:
        raise OtherStudy("store", said=f"{refused} '{path}' is neither.") from error
    _require_format(path, about)
    if about["study"] != study.description:
        different = _differences(json.loads(about["study"]), json.loads(study.description))
        what = ", ".join(different) or "its lanes"
        other = f"'{path}' holds another study, which differs in {what}: choose another folder."
        raise OtherStudy("store", said=f"{refused} {other}")
    return about, arrays


def _differences(theirs: Any, ours: Any, name: str = "") -> list[str]:
    """Names of what differs between two nested mappings."""
    if not (isinstance(theirs, dict) and isinstance(ours, dict)):
        return [] if theirs == ours else [name]
    keys = [key for key in {**ours, **theirs} if theirs.get(key) != ours.get(key)]
    dotted = lambda key: key if name in ("", "system", "plan") else f"{name}.{key}"
    return [found for key in keys for found in _differences(theirs.get(key), ours.get(key), dotted(key))]


# The empty store: what describes it follows from the study alone, byte for byte.


def _create(path: Path, study: "Study") -> None:
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


def _write(path: Path, study: "Study") -> None:
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    plan, compressors = study.grid, (ZstdCodec(), Crc32cCodec())  # any reader of zarr compares the checksums
    coordinates = _coordinates(study)
    dataset = xr.Dataset(coords=coordinates, attrs=_attributes(study))
    checked = {name: {"compressors": compressors} for name in coordinates}
    dataset.to_zarr(path, mode="w", consolidated=False, encoding=checked)
    group = zarr.open_group(path, mode="r+", zarr_format=3, use_consolidated=False)
    for name, variable in study.variables.items():
        extra = [study.within[d].size for d in variable.within]
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


def _coordinates(study: "Study") -> dict[str, Any]:
    grid, info = study.grid, parameter_info(study.model)

    def words(name: str) -> dict[str, str]:
        if name == OIL:
            return {"long_name": "ISO VG grade of the oil", "units": "mm^2/s"}
        if name == SPEED:
            return {"long_name": study.model.speed_text, "units": "rad/s"}
        known = info.get(name) or quantity(name)
        return {"long_name": known.text, "units": known.unit}

    found: dict[str, Any] = {name: (name, np.asarray(x), words(name)) for name, x in grid.values.items()}
    found |= {name: (SAMPLE, x, words(name)) for name, x in grid.cloud.items()}
    dims, speed, about = found[SPEED]
    return found | {"rpm": (dims, speed * 30 / np.pi, about | {"units": "rpm"})} | study.within


def _attributes(study: "Study") -> dict[str, Any]:
    described = json.loads(study.description)
    configured = configuration_of(study.model)
    return {
        "title": "jaxcage study",
        "store_format": FORMAT,
        "study": study.description,
        "discard": study.run.discard,
        "revolutions": study.run.revolutions,
        "seed": study.grid.seed,
        **({} if configured is None else {"configuration": json.dumps(configured)}),
        **{name: text for name, text in described.items() if name.startswith("version_")},
    }
