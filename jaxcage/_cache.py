"""Compiled programs kept on disk, so that the second run of a command starts at once."""

import hashlib
import os
import pathlib
import platform

import platformdirs


traced: pathlib.Path | None = None
"""Where lowered programs are kept too; None before `keep_compiled_programs` was called."""


def keep_compiled_programs(folder: str | os.PathLike[str] | None = None) -> pathlib.Path | None:
    """Keep what is traced and compiled in a folder and use it again, in this process and later ones.

    The `jaxcage` command calls this by default; a script or notebook may. It changes JAX's configuration of the whole
    process. Programs are made for the processor they were compiled on: each kind of processor has its own sub-folder.

    **Arguments:** where to keep them, by default the user's cache folder. The environment variable `JAXCAGE_CACHE`
    names another one, or switches this off if it is `off`.

    **Returns:** the folder, None if switched off.
    """
    wanted = os.environ.get("JAXCAGE_CACHE", "") or folder or platformdirs.user_cache_path("jaxcage") / "programs"
    if str(wanted) == "off":
        return None
    import jax

    place = pathlib.Path(wanted).expanduser() / _processor()
    jax.config.update("jax_compilation_cache_dir", str(place))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)
    global traced
    traced = place / "traced"
    return place


def _processor() -> str:
    """A short name of this kind of processor: what a program compiled for it may use."""
    about = [platform.machine(), platform.processor()]
    info = pathlib.Path("/proc/cpuinfo")
    if info.exists():
        about += sorted(
            {line for line in info.read_text().splitlines() if line.startswith(("flags", "Features", "model name"))}
        )
    return hashlib.sha256("\n".join(about).encode()).hexdigest()[:12]
