"""Whether a store is what was written: its metadata and every chunk, by the digests in its manifest."""

import dataclasses
import json
from pathlib import Path
from typing import Any

from .._errors import InputError
from ..io import read_bytes
from ._manifest import ABOUT, FORMAT, chunks_of, damage, damaged_metadata, read_entry


class DamagedStore(InputError):
    """A store whose description is not what was written."""

    def __init__(self, path: str | Path, file: str):
        super().__init__(
            f"The store '{path}' is damaged in what describes it ('{file}'): run the study again with the same store, "
            "which mends that and keeps what is whole."
        )


class OldStore(InputError):
    """A store of before there were manifests."""

    def __init__(self, path: str | Path):
        super().__init__(
            f"'{path}' is a store of format 1, without checksums: `open_study` reads it as it is, but nothing is added "
            "to it, choose another folder."
        )


def about_store(path: Path) -> dict[str, Any]:
    """What the manifest of a store says of it.

    **Raises:** `FileNotFoundError` if there is no store; `OldStore`; `DamagedStore` without a manifest.
    """
    about = read_entry(path / ABOUT)
    if about is not None:
        if about.get("format") != FORMAT:
            raise InputError(
                f"The store '{path}' is of format {about.get('format')}, and this version of jaxcage reads {FORMAT}."
            )
        return about
    attributes = attributes_of(path)
    if attributes is not None and "fingerprint" in attributes and "store_format" not in attributes:
        raise OldStore(path)
    if (path / ABOUT).parent.is_dir() if attributes is None else "store_format" in attributes:
        raise DamagedStore(path, ABOUT)
    raise FileNotFoundError(f"There is no study at '{path}'.")


def attributes_of(path: Path) -> dict[str, Any] | None:
    """Attributes of a store; None if they cannot be read."""
    try:
        attributes = dict(json.loads(read_bytes(path / "zarr.json"))["attributes"])
        return attributes | {"study": json.loads(attributes.get("study", "{}"))}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


@dataclasses.dataclass(frozen=True)
class StoreState:
    """What of a store is finished, and what of it is damaged."""

    chunks: int
    """Chunks in all."""
    finished: int
    """Chunks of which every byte is what was written."""
    damaged: dict[int, str]
    """Chunk -> what is wrong with it. It is computed again when the study is run again."""
    metadata: list[str]
    """Files that describe the store and are not what they were. They are written again when the study is run again."""

    @property
    def whole(self) -> bool:
        """Whether nothing is damaged; what has not been computed yet is no damage."""
        return not self.damaged and not self.metadata

    def __str__(self) -> str:
        left = self.chunks - self.finished - len(self.damaged)
        counts = f"{self.finished} of {self.chunks} chunks are as they were written, {len(self.damaged)} are damaged"
        return "\n".join(
            [
                f"{counts}, {left} are not computed yet",
                *(f"  chunk {chunk}: {what}" for chunk, what in self.damaged.items()),
                *(f"  {name}: not what was written" for name in self.metadata),
            ]
        )


def check_study(path: str | Path) -> StoreState:
    """Compare every byte of a store with the digests of what was written.

    **Returns:** `StoreState`.

    **Raises:** `FileNotFoundError` if there is no store; `OldStore`, a `ValueError`, for one without digests.
    """
    try:
        about = about_store(Path(path))
    except DamagedStore:
        return StoreState(0, 0, {}, [ABOUT])
    wrong = {chunk: damage(Path(path), about, chunk) for chunk in range(chunks_of(about))}
    damaged = {chunk: what for chunk, what in wrong.items() if what}
    finished = sum(what is None for what in wrong.values())
    return StoreState(len(wrong), finished, damaged, damaged_metadata(Path(path), about))
