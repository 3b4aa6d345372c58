"""Machine code called from JAX's compiled programs, by XLA's foreign-function interface.

XLA passes one struct, in the layout of major version 0 of the interface (`xla/ffi/api/c_api.h` in the folder
`jax.ffi.include_dir()`); minor versions do not move the fields that are read here.
"""

import ctypes
import pathlib
import re
import threading

import jax

from .object_code import function


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
