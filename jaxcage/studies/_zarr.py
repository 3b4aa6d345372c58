"""The folder of a store as zarr sees it: what is read is compared with the manifest, what is written is marked."""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from zarr.abc.store import ByteRequest
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.core.buffer import Buffer, BufferPrototype
from zarr.storage import LocalStore, WrapperStore

from ..io import put_bytes
from ._manifest import Files, chunk_of, damage, keys_of, make_way, mark


def compressors() -> tuple[Any, ...]:
    """What chunks go through: compressed, then with a checksum that any reader of zarr compares."""
    return ZstdCodec(), Crc32cCodec()


class Checked(WrapperStore[LocalStore]):
    """A store to read from: chunks that are not finished, or not what they were, are not there."""

    def __init__(self, path: Path, about: Mapping[str, Any]):
        super().__init__(LocalStore(path, read_only=True))
        self.path, self.about = path, about
        self.finished: set[int] = set()

    def _with_store(self, store: LocalStore) -> "Checked":
        del store
        return Checked(self.path, self.about)

    def __getstate__(self) -> Any:
        return self.path, self.about

    def __setstate__(self, state: Any) -> None:
        self.__init__(*state)

    async def get(self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None) -> Buffer | None:
        chunk = chunk_of(self.about, key)
        if chunk is not None and chunk not in self.finished:
            if damage(self.path, self.about, chunk) is not None:
                return None
            self.finished.add(chunk)
        return await super().get(key, prototype, byte_range)


class Marking(WrapperStore[LocalStore]):
    """A store to write chunks to: each file reaches the disk before it gets its name, and is marked."""

    def __init__(self, path: Path, about: Mapping[str, Any]):
        super().__init__(LocalStore(path))
        self.path, self.about = path, about
        self.marked: Files = {}

    def _with_store(self, store: LocalStore) -> "Marking":
        del store
        return self

    async def get(self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None) -> Buffer | None:
        if chunk_of(self.about, key) is not None:
            return None  # whole chunks are written, whatever was there
        return await super().get(key, prototype, byte_range)

    async def set(self, key: str, value: Buffer) -> None:
        data = value.to_bytes()
        make_way(self.path, self.path / key)
        put_bytes(self.path / key, data)
        self.marked[key] = mark(data)

    async def delete(self, key: str) -> None:
        make_way(self.path, self.path / key)
        (self.path / key).unlink(missing_ok=True)

    @contextlib.contextmanager
    def chunk(self, number: int) -> Iterator[Files]:
        """Around writing a chunk: its files as they will have been written."""
        self.marked = dict.fromkeys(keys_of(self.about, number))
        yield self.marked
