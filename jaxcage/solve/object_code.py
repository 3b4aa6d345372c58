"""Object code of LLVM IR, compiled with llvmlite, stored on disk and loaded.

It is stored in the user's cache folder, under a key made of the IR, the processor and the version of LLVM; damaged
entries are compiled again.
"""

import functools
import hashlib
import os
import pathlib
import threading
from typing import Any

import llvmlite.binding as llvm
import platformdirs
from llvmlite.binding import orcjit

from .._cache import unfit


@functools.cache
def _machine() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features, target = llvm.get_host_cpu_features().flatten(), llvm.Target.from_default_triple()
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=features, opt=3, reloc="pic", codemodel="small", jit=True
    )


def _compiled(ir: str) -> bytes:
    module = llvm.parse_assembly(ir)
    module.verify()
    tuning = llvm.create_pipeline_tuning_options(speed_level=2)
    tuning.loop_vectorization = tuning.slp_vectorization = tuning.loop_interleaving = tuning.loop_unrolling = False
    builder = llvm.create_pass_builder(_machine(), tuning)
    builder.getModulePassManager().run(module, builder)
    return _machine().emit_object(module)


def cache_folder() -> pathlib.Path | None:
    """Folder of object code; None with `JAXCAGE_CACHE=off`, and for a folder that others may write to."""
    given = os.environ.get("JAXCAGE_CACHE", "")
    if given == "off":
        return None
    try:
        folder = pathlib.Path(given or platformdirs.user_cache_path("jaxcage")).expanduser() / "native"
        return None if unfit(folder) else folder
    except (OSError, RuntimeError):  # no home folder, or one that cannot be written
        return None


def object_code(ir: str) -> bytes:
    """Object code of a module for this processor, from the cache if it has an undamaged entry."""
    processor = f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()} {_machine().triple}"
    about = f"{ir} {llvm.llvm_version_info} {processor}"
    folder = cache_folder()
    path = folder and folder / hashlib.sha256(about.encode()).hexdigest()[:40]
    digest = lambda code: hashlib.sha256(code).digest()
    if path is not None:
        try:
            kept = path.read_bytes()
            if digest(kept[32:]) == kept[:32]:
                return kept[32:]
        except OSError:
            pass
    code = _compiled(ir)
    if path is not None:
        try:
            new = path.with_name(f"{path.name}.{os.getpid()}.{threading.get_ident()}")
            new.write_bytes(digest(code) + code)
            new.replace(path)
        except OSError:
            pass  # without a writable folder the code is compiled again next time
    return code


@functools.cache
def _linker() -> Any:
    # LLVM's older linker may place parts of a module more than 2 GB apart, which crashes the process.
    return orcjit.create_lljit_compiler(_machine(), use_jit_link=True)


_libraries: dict[tuple[str, str], Any] = {}
_linking = threading.Lock()


def function(ir: str, name: str) -> int:
    """Address of a function of a module; code is never freed, since that would crash programs that still use it."""
    if (ir, name) not in _libraries:
        code = object_code(ir)
        with _linking:  # several threads may request the same module, but the linker accepts each name only once
            if (ir, name) not in _libraries:
                builder = orcjit.JITLibraryBuilder().add_object_img(code).add_current_process()
                named = name + hashlib.sha256(ir.encode()).hexdigest()[:24]
                _libraries[ir, name] = builder.export_symbol(name).link(_linker(), named)
    return _libraries[ir, name][name]
