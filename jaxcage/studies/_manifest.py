"""What a store is made of, with digests: its metadata, and the chunks that are finished. Written last, read first.

`manifest/metadata` has the digest of every file that describes the store; `manifest/chunks/N` has size and digest of
each file of chunk N, and is written once they have reached the disk. A chunk is finished if all of it is as its entry
says.
"""

import hashlib
import json
import math
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..io import put_bytes, read_bytes


FOLDER, ABOUT = "manifest", "manifest/metadata"
FORMAT = 2
"""Of stores; the first had no manifest."""
ENTRY = 100_000
"""Bytes of an entry, at most."""

Files = dict[str, list[Any] | None]
"""Name within the store -> size and digest; None for a file that is not there, as every number in it is missing."""


def digest(data: bytes) -> str:
    """A digest that two different files do not share."""
    return hashlib.sha256(data).hexdigest()


def mark(data: bytes) -> list[Any]:
    """Size and digest."""
    return [len(data), digest(data)]


def _text(entry: Mapping[str, Any]) -> bytes:
    return json.dumps(entry, sort_keys=True, indent=1).encode()


def read_entry(path: Path) -> dict[str, Any] | None:
    """An entry, None if it is missing or is not what was written."""
    try:
        entry = json.loads(read_bytes(path, ENTRY))
        right = entry.pop("digest") == digest(_text(entry))
    except (OSError, ValueError, KeyError, AttributeError, TypeError, RecursionError):
        return None
    return entry if right else None


def make_way(root: Path, path: Path) -> None:
    """Remove what is in the way of a file of a store: a folder in its place, or something else in place of a folder."""
    for above in reversed(path.relative_to(root).parents):
        if os.path.lexists(root / above) and not (root / above).is_dir():
            (root / above).unlink()
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)


def write_entry(path: Path, entry: Mapping[str, Any]) -> None:
    """Write an entry with its own digest, in one step."""
    put_bytes(path, _text({**entry, "digest": digest(_text(entry))}))


def entry_of(path: Path, chunk: int) -> Path:
    """Where the entry of a chunk is."""
    return path / FOLDER / "chunks" / str(chunk)


def is_as_marked(path: Path, marked: list[Any] | None) -> bool:
    """Whether a file is what it was when it was written."""
    try:
        if marked is None:
            return not os.path.lexists(path)
        return os.stat(path).st_size == marked[0] and mark(read_bytes(path, marked[0])) == marked
    except (OSError, TypeError):
        return False


def describing(path: Path) -> Files:
    """The files that describe a store in which nothing is finished yet, marked."""
    files = [p for p in sorted(path.rglob("*")) if p.is_file() and p != path / ABOUT]
    return {p.relative_to(path).as_posix(): mark(p.read_bytes()) for p in files}


def damaged_metadata(path: Path, about: Mapping[str, Any]) -> list[str]:
    """Files that describe a store and are not what they were."""
    return [name for name, marked in about["files"].items() if not is_as_marked(path / name, marked)]


def damage(path: Path, about: Mapping[str, Any], chunk: int) -> str | None:
    """Why a chunk is not finished: an empty text if it has never been, None if it is."""
    place = entry_of(path, chunk)
    if not os.path.lexists(place):
        return ""
    entry = read_entry(place)
    if entry is None or entry.get("chunk") != chunk or entry.get("fingerprint") != about["fingerprint"]:
        return f"{place.relative_to(path).as_posix()} is not what was written"
    wrong = [name for name, marked in entry["files"].items() if not is_as_marked(path / name, marked)]
    return f"{wrong[0]} is {'missing' if not (path / wrong[0]).exists() else 'not what was written'}" if wrong else None


def chunk_of(about: Mapping[str, Any], key: str) -> int | None:
    """The chunk that a file of a store belongs to; None if it is none of a variable of lanes."""
    name, _, place = key.partition("/c/")
    if name not in about["variables"] or not place:
        return None
    blocks = about["blocks"]
    try:
        index = tuple(map(int, place.split("/")))[: len(blocks)]
        return int(np.ravel_multi_index(index, blocks))
    except ValueError:
        return None


def keys_of(about: Mapping[str, Any], chunk: int) -> list[str]:
    """The files of a chunk."""
    place = "/".join(str(int(i)) for i in np.unravel_index(chunk, about["blocks"]))
    return [f"{name}/c/{place}{'/0' * more}" for name, more in about["variables"].items()]


def chunks_of(about: Mapping[str, Any]) -> int:
    """Number of chunks."""
    return math.prod(about["blocks"])
