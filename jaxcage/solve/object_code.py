"""Object code of LLVM IR, compiled with llvmlite, stored on disk and loaded, and called from JAX's compiled programs.

It is stored in the user's cache folder, under a key made of the IR, the processor and the version of LLVM; damaged
entries are compiled again. JAX's programs call it by XLA's foreign-function interface: XLA passes one struct, in the
layout of major version 0 of the interface (`xla/ffi/api/c_api.h` in the folder `jax.ffi.include_dir()`); minor versions
do not move the fields that are read here.
"""

import ctypes
import functools
import hashlib
import os
import pathlib
import re
import threading
from typing import Any

import jax
import llvmlite.binding as llvm
import platformdirs
from llvmlite.binding import orcjit

from .._cache import unfit
from .ir import Code, Function, Value, number


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


# --- calls from JAX's programs ----------------------------------------------------------------------------------------


MAJOR = 0
"""Supported major version of the interface."""


class UnknownInterface(Exception):
    """Error for a version of jaxlib with an unsupported interface."""


QUERY = 1
"""Kind of the extension with which XLA asks for the version of the interface."""


def word(w: Code, base: str | Value, k: int) -> Value:
    """Pointer in word k, of 8 bytes and counted from 0, of one of XLA's structs."""
    return w.load(w.element(base, k, "ptr"), "ptr")


def handler() -> Function:
    """Function that XLA calls: it answers a query of its version, or calls `march(inputs, outputs)` with arrays of
    pointers to buffers.

    Of a call frame word 1 is a pointer to an extension or null, words 9 and 14 are the arrays of inputs and outputs. Of
    an extension word 1 is its kind, and word 3 a pointer to metadata, where the 32-bit numbers 6 to 8 are the major and
    minor version and traits. **Raises:** `UnknownInterface`.
    """
    header = (pathlib.Path(jax.ffi.include_dir()) / "xla/ffi/api/c_api.h").read_text()
    found = re.search(r"XLA_FFI_API_MAJOR (\d+).*XLA_FFI_API_MINOR (\d+)", header, re.DOTALL)
    if found is None or int(found[1]) != MAJOR:
        raise UnknownInterface("XLA's interface")
    w, whole = Code(1), lambda x: Value(str(x), "i32")
    extension = word(w, "%frame", 1)
    kind = lambda: [w.compare("eq", w.load(w.element(extension, 2, "i32"), "i32"), whole(QUERY))]
    (asked,) = w.when(w.compare("ne", extension, Value("null", "ptr")), kind, otherwise=[number(False)])

    def answer() -> None:
        about = word(w, extension, 3)
        for k, x in enumerate((MAJOR, found[2], 0)):
            w.store(whole(x), w.element(about, 6 + k, "i32"))

    run = lambda: w.line(f"call void @march(ptr {word(w, '%frame', 9)}, ptr {word(w, '%frame', 14)})")
    w.when(asked, answer)
    w.when(w.negated(asked), run)
    return w.function("handler", "ptr %frame", Value("null", "ptr"), linkage="")


_registered: dict[str, int] = {}
_registering = threading.Lock()


def registered(ir: str, name: str) -> None:
    """Register the `handler` of a module with XLA under a name; its code remains until the process ends."""
    address = function(ir, "handler")
    with _registering:  # several threads may trace the same function at the same time
        if name not in _registered:
            jax.ffi.register_ffi_target(name, jax.ffi.pycapsule(ctypes.c_void_p(address)), platform="cpu")
            _registered[name] = address
