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


HANDLER = """%Version = type {{ i64, ptr, i32, i32 }}
%Metadata = type {{ i64, %Version, i32 }}
%Extension = type {{ i64, i32, ptr, ptr }}
%Buffers = type {{ i64, ptr, i64, ptr, ptr }}
%Buffer = type {{ i64, ptr, i32, ptr }}
%Frame = type {{ i64, ptr, ptr, ptr, i32, %Buffers, %Buffers }}

define ptr @handler(ptr %frame) {{
  %extension_at = getelementptr %Frame, ptr %frame, i32 0, i32 1
  %extension = load ptr, ptr %extension_at
  %plain = icmp eq ptr %extension, null
  br i1 %plain, label %execute, label %extended
extended:
  %kind_at = getelementptr %Extension, ptr %extension, i32 0, i32 1
  %kind = load i32, ptr %kind_at
  %asks = icmp eq i32 %kind, 1
  br i1 %asks, label %answer, label %execute
answer:
  %about_at = getelementptr %Extension, ptr %extension, i32 0, i32 3
  %about = load ptr, ptr %about_at
  %major = getelementptr %Metadata, ptr %about, i32 0, i32 1, i32 2
  store i32 {major}, ptr %major
  %minor = getelementptr %Metadata, ptr %about, i32 0, i32 1, i32 3
  store i32 {minor}, ptr %minor
  %traits = getelementptr %Metadata, ptr %about, i32 0, i32 2
  store i32 0, ptr %traits
  ret ptr null
execute:
  %arguments_at = getelementptr %Frame, ptr %frame, i32 0, i32 5, i32 4
  %arguments = load ptr, ptr %arguments_at
  %results_at = getelementptr %Frame, ptr %frame, i32 0, i32 6, i32 4
  %results = load ptr, ptr %results_at
  %in = alloca ptr, i64 {inputs}
  %out = alloca ptr, i64 {outputs}
  call void @pointers(ptr %arguments, ptr %in, i64 {inputs})
  call void @pointers(ptr %results, ptr %out, i64 {outputs})
  call void @march(ptr %in, ptr %out)
  ret ptr null
}}
define internal void @pointers(ptr %buffers, ptr %to, i64 %count) noinline {{
entry:
  br label %next
next:
  %k = phi i64 [ 0, %entry ], [ %k_next, %next ]
  %buffer_at = getelementptr ptr, ptr %buffers, i64 %k
  %buffer = load ptr, ptr %buffer_at
  %data_at = getelementptr %Buffer, ptr %buffer, i32 0, i32 3
  %data = load ptr, ptr %data_at
  %place = getelementptr ptr, ptr %to, i64 %k
  store ptr %data, ptr %place
  %k_next = add i64 %k, 1
  %more = icmp slt i64 %k_next, %count
  br i1 %more, label %next, label %done
done:
  ret void
}}
"""
"""Function that XLA calls: it answers a query of its version (extension 1), and calls `march(inputs, outputs)`."""


def handler_ir(inputs: int, outputs: int) -> str:
    """Function that XLA calls with these numbers of inputs and outputs, for a module that holds `march`. **Raises:**
    `UnknownInterface`."""
    header = (pathlib.Path(jax.ffi.include_dir()) / "xla/ffi/api/c_api.h").read_text()
    found = re.search(r"XLA_FFI_API_MAJOR (\d+).*XLA_FFI_API_MINOR (\d+)", header, re.DOTALL)
    if found is None or int(found[1]) != MAJOR:
        raise UnknownInterface("XLA's interface")
    return HANDLER.format(major=MAJOR, minor=found[2], inputs=inputs, outputs=outputs)


_registered: dict[str, int] = {}
_registering = threading.Lock()


def registered(ir: str, name: str) -> None:
    """Register the `handler` of a module with XLA under a name; its code remains until the process ends."""
    address = function(ir, "handler")
    with _registering:  # several threads may trace the same function at the same time
        if name not in _registered:
            jax.ffi.register_ffi_target(name, jax.ffi.pycapsule(ctypes.c_void_p(address)), platform="cpu")
            _registered[name] = address
