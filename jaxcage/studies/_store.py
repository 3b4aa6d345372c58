"""The results of a study on disk: a zarr folder that plain xarray opens, whole at any time, filled chunk by chunk.

A chunk of lanes is one file of each variable, written aside and put in place in one step, and then an entry in the
manifest with the digests of all of them: a chunk is finished if each of its files is what its entry says. What is
missing, torn or wrong is pending, and computed again with the same bits. So two processes may write to one store
without a lock: both write the same files. Nothing in the folder depends on when, where or in which order it was
written.
"""

import contextlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._errors import ArgumentError
from ._check import DamagedStore, OldStore, about_store, attributes_of
from ._empty import create, mend
from ._manifest import damage, damaged_metadata, entry_of, make_way, read_entry, write_entry
from ._stored import AbstractStudy, Results
from ._study import LABELS


if TYPE_CHECKING:
    import xarray as xr


class OtherStudy(ArgumentError):
    """A store that belongs to another study; the message says in what they differ."""


class Store:
    """The store of a study, made if there is none."""

    def __init__(self, path: str | Path, study: AbstractStudy):
        """**Raises:** `OtherStudy` for a folder that holds anything else than results of this very study, or for a
        study of which that cannot be told.
        """
        import zarr

        from ._zarr import Marking

        self.path, self.study = Path(path), study
        there = os.path.lexists(self.path)
        if there and study.unknown:
            said = f"must be a new folder, since nobody can tell whether '{path}' is of this study: {study.unknown}."
            raise OtherStudy("store", said=said)
        with _going_on(self.path):
            if not there:
                create(self.path, study)
            self.about = _same(self.path, study)
        self._files = Marking(self.path, self.about)
        group = zarr.open_group(self._files, mode="r+", zarr_format=3, use_consolidated=False)
        self._arrays: dict[str, Any] = {name: group[name] for name in self.about["variables"]}
        self._finished: set[int] = set()

    def pending(self, among: Iterable[int] | None = None) -> list[int]:
        """Chunks that are not finished, or are not what they were, by every byte that is stored of them."""
        chunks = range(self.study.plan.chunks) if among is None else among
        for chunk in chunks:
            if chunk not in self._finished and damage(self.path, self.about, chunk) is None:
                self._finished.add(chunk)
        return [chunk for chunk in chunks if chunk not in self._finished]

    def write(self, chunk: int, results: Results) -> None:
        """Put the results of a chunk in place.

        **Raises:** `OSError`, one sentence with the reason and how to go on.
        """
        region = self.study.plan.region(chunk)
        with _going_on(self.path), self._files.chunk(chunk) as files:
            for name in sorted(results, key=lambda name: name == "outcome"):
                self._arrays[name][region] = results[name]
            entry = {"chunk": chunk, "fingerprint": self.about["fingerprint"], "files": files}
            make_way(self.path, entry_of(self.path, chunk))
            write_entry(entry_of(self.path, chunk), entry)
        self._finished.add(chunk)

    def tidy(self) -> None:
        """Remove what kills left behind; for a store that nobody writes to any more."""
        for left in self.path.rglob("*.partial"):
            with contextlib.suppress(OSError):
                left.unlink()
        for left in self.path.parent.glob(f".{self.path.name}.*.partial"):
            shutil.rmtree(left, ignore_errors=True)


def open_study(path: str | Path) -> "xr.Dataset":
    """The results of a study so far, read from disk when they are used; each chunk is compared with what was written.

    Lanes that have not been run are NaN with the label and outcome -1; so are those of chunks that are damaged.

    **Raises:** `FileNotFoundError`; `DamagedStore`, a `ValueError`, where what describes the store is damaged.
    """
    import xarray as xr

    from ._zarr import Checked

    # Version 3 only, and not what consolidated metadata say: version 2 has a codec that runs what a file says.
    options: dict[str, Any] = dict(engine="zarr", zarr_format=3, consolidated=False, chunks=None)
    try:
        about = about_store(Path(path))
    except OldStore:
        return xr.open_dataset(path, **options)
    if wrong := damaged_metadata(Path(path), about):
        raise DamagedStore(path, wrong[0])
    return xr.open_dataset(Checked(Path(path), about), **options)  # pyright: ignore[reportArgumentType]


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


def _same(path: Path, study: AbstractStudy) -> Mapping[str, Any]:
    """What the manifest says of the store of this study, after what describes the store has been mended if need be.

    **Raises:** `OtherStudy`.
    """
    refused = "must be a new folder or the store of this study, but"
    try:
        about = about_store(path)
        theirs = about["fingerprint"]
    except OldStore as error:
        raise OtherStudy("store", said=f"{refused} {error}") from error
    except (FileNotFoundError, DamagedStore) as error:
        about, theirs = None, _claimed(path)
        if theirs is None:
            raise OtherStudy("store", said=f"{refused} '{path}' is neither.") from error
    if theirs != study.fingerprint:
        described = json.loads(json.dumps(study.describe()))
        different = _differences((attributes_of(path) or {}).get("study"), described)
        several = [name for name in different if name not in ("model", "integration")] or different
        what = ", ".join(several) or "its lanes"
        other = f"'{path}' holds another study, which differs in {what}: choose another folder."
        raise OtherStudy("store", said=f"{refused} {other}")
    if about is None or damaged_metadata(path, about):
        mend(path, study)
        about = about_store(path)
    return about


def _claimed(path: Path) -> str | None:
    """Whose study a store without a manifest is, by its attributes or any chunk that is left."""
    found = (attributes_of(path) or {}).get("fingerprint")
    chunks = (path / "manifest" / "chunks").glob("*")
    entries = (read_entry(each) for each in chunks)
    return found or next((e["fingerprint"] for e in entries if e and "fingerprint" in e), None)


def _differences(theirs: Any, ours: Any, name: str = "") -> list[str]:
    """Names of what differs between two nested mappings."""
    if not (isinstance(theirs, dict) and isinstance(ours, dict)):
        return [] if theirs == ours else [name]
    keys = [key for key in {**ours, **theirs} if theirs.get(key) != ours.get(key)]
    dotted = lambda key: key if name in ("", "system", "plan", "code") else f"{name}.{key}"
    return [found for key in keys for found in _differences(theirs.get(key), ours.get(key), dotted(key))]
