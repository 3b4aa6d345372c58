"""Reading of regular files, and writing that never leaves a partial result and never damages an earlier one."""

import contextlib
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .._errors import InputError


LARGEST = 10_000_000
"""Largest size of a description [bytes]: a hundred times that of one written by hand."""


def read_bytes(path: str | Path) -> bytes:
    """The bytes of a regular file; a pipe or a device, which may never end, is refused.

    **Raises:** `OSError` with the reason in its `strerror`.
    """
    with open(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)), "rb") as file:
        about = os.fstat(file.fileno())
        if stat.S_ISDIR(about.st_mode):
            raise IsADirectoryError(None, "Is a directory")
        if not stat.S_ISREG(about.st_mode):
            raise OSError(None, "it is no regular file, but a pipe, a device or the like")
        if about.st_size > LARGEST:
            raise OSError(None, f"it has {about.st_size} bytes, more than the {LARGEST} that are read")
        return file.read(LARGEST)


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary path beside `path` to write a file or a folder to; it replaces `path` at the end.

    If the body raises, or the process dies in it, `path` stays as it was. A folder cannot be replaced in one step: the
    earlier one is moved aside for an instant and moved back if the new one cannot take its place.

    **Raises:** `OSError`, one sentence with the reason and the remedy, if the disk is full, the folder read-only or the
    like.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        workplace = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".partial", dir=target.parent))
        try:
            yield workplace / target.name
            sync(workplace / target.name)
            _move_in(workplace / target.name, target, workplace / "earlier")
        finally:
            if target.exists() or not (workplace / "earlier").exists():
                shutil.rmtree(workplace, ignore_errors=True)
    except OSError as error:
        raise OSError(
            f"'{target}' could not be written ({reason(error)}), and what was there before stays as it was: "
            "make room or choose another folder, and run this again."
        ) from error


def sync(path: Path) -> None:
    """Flush a file, or all files of a folder, to the disk."""
    files = [p for p in path.rglob("*") if p.is_file()] if path.is_dir() else [path] if path.exists() else []
    for each in files:
        with open(each, "rb") as file:
            os.fsync(file.fileno())
    for folder in {p.parent for p in files}:
        with contextlib.suppress(OSError):  # not every system can flush the names in a folder
            handle = os.open(folder, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


def reason(error: OSError) -> str:
    """Reason of a refusal in the words of the system."""
    return error.strerror or str(error) or type(error).__name__


def _move_in(new: Path, target: Path, aside: Path) -> None:
    if not (target.is_dir() and not target.is_symlink()):
        os.replace(new, target)
        return
    try:
        os.rename(target, aside)
        os.rename(new, target)
    except BaseException:  # an interruption may come between the two
        if aside.exists() and not target.exists():
            os.rename(aside, target)
        raise


def check_writable(folder: str | Path) -> Path:
    """Make `folder` and check, before a long computation, that files can be written in it.

    **Raises:** `ValueError` with the reason.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        why = reason(error)
        raise InputError(f"Output folder '{folder}' must be a folder that can be written to, but: {why}.") from error
    return path
