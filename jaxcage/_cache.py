"""Cache of compiled programs on disk, so that later runs of a command start at once."""

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
    """Cache compiled programs in a folder, and reuse them in this process and later ones.

    The `jaxcage` command does this by default; scripts and notebooks may call it. It changes JAX's configuration of the
    whole process. Each kind of processor has its own sub-folder, since programs are compiled for one.

    **Arguments:** folder, by default the user's cache folder. The environment variable `JAXCAGE_CACHE` overrides it, or
    disables the cache if it is `off`.

    Cached programs run without verification: the folder is created for this user alone, and one that another user owns
    or may write to, or that is not writable, is not used, with a warning.

    **Returns:** the folder; None if the cache is disabled or the folder is not used.
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
    """Create a folder for this user alone, and return why it cannot be used; empty if it can."""
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
    """Short hash of the features of this processor that a compiled program may use."""
    about = [platform.machine(), platform.processor()]
    info = pathlib.Path("/proc/cpuinfo")
    if info.exists():
        about += sorted(
            {line for line in info.read_text().splitlines() if line.startswith(("flags", "Features", "model name"))}
        )
    return hashlib.sha256("\n".join(about).encode()).hexdigest()[:12]
