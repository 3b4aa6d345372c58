"""Writing that never leaves a half-written result and never spoils an earlier one."""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .._errors import InputError


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary place beside `path` to write a file or a folder to; it takes the place of `path`
    at the end.

    If the body raises, or the process dies in it, `path` is what it was. A folder cannot be
    replaced in one step: the earlier one moves aside for an instant and comes back if the new one
    cannot move in.

    **Raises:** `OSError`, one sentence with the reason and how to go on, if the disk is full, the
    folder read-only or the like.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        workplace = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".partial", dir=target.parent))
        try:
            yield workplace / target.name
            _move_in(workplace / target.name, target, workplace / "earlier")
        finally:
            if target.exists() or not (workplace / "earlier").exists():
                shutil.rmtree(workplace, ignore_errors=True)
    except OSError as error:
        raise OSError(
            f"'{target}' could not be written ({reason(error)}), and what was there before stays as it was: "
            "make room or choose another folder, and run this again."
        ) from error


def reason(error: OSError) -> str:
    """Why the system refused, in its words."""
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
    """Make `folder` and make sure that files can be written in it.

    **Raises:** `ValueError` with the reason, so that nobody computes for minutes to lose the
    result.
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
