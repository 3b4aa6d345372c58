"""Compiled programs kept on disk, so that the second run of a command starts at once."""

import hashlib
import os
import pathlib
import platform
import stat
import tempfile
import warnings

import platformdirs

from ._errors import ArgumentError


def keep_compiled_programs(folder: str | os.PathLike[str] | None = None) -> pathlib.Path | None:
    """Keep what is compiled in a folder and use it again, in this process and later ones.

    The `jaxcage` command calls this by default; a script or notebook may. It changes JAX's configuration of the whole
    process. Programs are made for the processor they were compiled on: each kind of processor has its own sub-folder.

    **Arguments:** where to keep them, by default the user's cache folder. The environment variable `JAXCAGE_CACHE`
    names another one, or switches this off if it is `off`.

    What is kept there is run without being looked at: the folder is made for its user alone, and one that belongs to
    another user, that others may write to, or that cannot be written to is left alone, with a warning.

    **Returns:** the folder, None if switched off or left alone.
    """
    if not isinstance(folder, str | os.PathLike | None):
        raise ArgumentError("folder", said=f"must be a path, but {folder!r} was given.")
    wanted = os.environ.get("JAXCAGE_CACHE", "") or folder or platformdirs.user_cache_path("jaxcage") / "programs"
    if str(wanted) == "off":
        return None
    import jax

    try:
        place = pathlib.Path(wanted).expanduser() / _processor()
        reason = unfit(place)
    except (OSError, RuntimeError) as error:  # no home folder
        reason = f"{getattr(error, 'strerror', None) or error}"
        place = pathlib.Path(wanted)
    if reason:
        said = f"Compiled programs are not kept in '{place}' ({reason}): everything is compiled anew."
        warnings.warn(said, RuntimeWarning, stacklevel=2)
        return None
    jax.config.update("jax_compilation_cache_dir", str(place))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    return place


def unfit(place: pathlib.Path) -> str:
    """Make a folder for this user alone. **Returns:** why it cannot be used, empty if it can."""
    place.mkdir(parents=True, exist_ok=True, mode=0o700)
    about = place.stat()
    if os.name == "posix":
        if about.st_uid != os.getuid():
            return "it belongs to another user"
        if about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return "others may write to it: delete it, or take that away by chmod go-w"
    with tempfile.TemporaryFile(dir=place):
        return ""


def _processor() -> str:
    """A short name of this kind of processor: what a program compiled for it may use."""
    about = [platform.machine(), platform.processor()]
    info = pathlib.Path("/proc/cpuinfo")
    if info.exists():
        about += sorted(
            {line for line in info.read_text().splitlines() if line.startswith(("flags", "Features", "model name"))}
        )
    return hashlib.sha256("\n".join(about).encode()).hexdigest()[:12]
