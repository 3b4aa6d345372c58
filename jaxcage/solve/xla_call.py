"""Machine code that JAX's compiled programs call, by XLA's typed interface for functions of others.

The interface hands over one struct. Where its fields are is read from the header that jaxlib ships, so that a version
of JAX that moves them is met as it is, and one that changes them beyond recognition is found out.
"""

import ctypes
import functools
import pathlib
import re
import threading

import jax

from .object_code import function


FRAME, ARGUMENTS, RESULTS, BUFFER = (f"XLA_FFI_{name}" for name in ("CallFrame", "Args", "Rets", "Buffer"))
EXTENSION, METADATA, VERSION = (f"XLA_FFI_{name}" for name in ("Metadata_Extension", "Metadata", "Api_Version"))
POINTER = 8


class UnknownInterface(Exception):
    """The interface of this version of jaxlib is not the one that is known here."""


class Header:
    """Structs of a header in C, as far as they are made of pointers, integers, enumerations and structs before them."""

    def __init__(self, text: str):
        text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)
        self._text, self._sizes = text, {"size_t": POINTER, "int64_t": 8, "uint64_t": 8}
        self._offsets: dict[str, dict[str, tuple[int, str]]] = {}
        for name, body in re.findall(r"struct (\w+) \{([^{}]*)\}", text):
            self._offsets[name], at, widest = {}, 0, 1
            for kind, field in re.findall(r"([\w\s]+[\s*]+)(\w+);", body):
                kind = kind.strip()
                size = POINTER if kind.endswith("*") else self._sizes.get(kind, 4)
                aligned = min(size, POINTER)
                at, widest = -(-at // aligned) * aligned, max(widest, aligned)
                self._offsets[name][field] = at, kind
                at += size
            self._sizes[name] = -(-at // widest) * widest

    def at(self, struct: str, *fields: str) -> int:
        """Offset of a field of a struct, or of a field of that."""
        try:
            offset, kind = self._offsets[struct][fields[0]]
            return offset + (self.at(kind, *fields[1:]) if len(fields) > 1 else 0)
        except KeyError as error:
            raise UnknownInterface(f"{struct}.{'.'.join(fields)}") from error

    def number(self, pattern: str) -> int:
        """The number behind a pattern."""
        found = re.search(pattern + r"\s*=?\s*(\d+)", self._text)
        if found is None:
            raise UnknownInterface(pattern)
        return int(found[1])


@functools.cache
def header() -> Header:
    """The header of this jaxlib."""
    return Header((pathlib.Path(jax.ffi.include_dir()) / "xla/ffi/api/c_api.h").read_text())


HANDLER = """define ptr @handler(ptr %frame) {{
  %extension_at = getelementptr i8, ptr %frame, i64 {extension}
  %extension = load ptr, ptr %extension_at
  %plain = icmp eq ptr %extension, null
  br i1 %plain, label %execute, label %extended
extended:
  %kind_at = getelementptr i8, ptr %extension, i64 {kind}
  %kind = load i32, ptr %kind_at
  %asks = icmp eq i32 %kind, {asks}
  br i1 %asks, label %answer, label %execute
answer:
  %about_at = getelementptr i8, ptr %extension, i64 {about}
  %about = load ptr, ptr %about_at
  %major = getelementptr i8, ptr %about, i64 {major_at}
  store i32 {major}, ptr %major
  %minor = getelementptr i8, ptr %about, i64 {minor_at}
  store i32 {minor}, ptr %minor
  %traits = getelementptr i8, ptr %about, i64 {traits}
  store i32 0, ptr %traits
  ret ptr null
execute:
  %arguments_at = getelementptr i8, ptr %frame, i64 {arguments}
  %arguments = load ptr, ptr %arguments_at
  %results_at = getelementptr i8, ptr %frame, i64 {results}
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
  %data_at = getelementptr i8, ptr %buffer, i64 {data}
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
"""XLA's function: it answers what XLA asks of it once, and calls `march(inputs, outputs)`."""


def handler_ir(inputs: int, outputs: int) -> str:
    """The function that XLA calls with so many inputs and outputs, for a module that holds `march`.

    **Raises:** `UnknownInterface`.
    """
    h = header()
    return HANDLER.format(
        extension=h.at(FRAME, "extension_start"),
        kind=h.at(EXTENSION, "extension_base", "type"),
        asks=h.number("XLA_FFI_Extension_Metadata"),
        about=h.at(EXTENSION, "metadata"),
        major_at=h.at(METADATA, "api_version", "major_version"),
        minor_at=h.at(METADATA, "api_version", "minor_version"),
        major=h.number("XLA_FFI_API_MAJOR"),
        minor=h.number("XLA_FFI_API_MINOR"),
        traits=h.at(METADATA, "traits"),
        arguments=h.at(FRAME, "args", "args"),
        results=h.at(FRAME, "rets", "rets"),
        data=h.at(BUFFER, "data"),
        inputs=inputs,
        outputs=outputs,
    )


_registered: dict[str, int] = {}
_registering = threading.Lock()


def registered(ir: str, name: str) -> int:
    """Have XLA know the `handler` of a module by a name; the code stays as long as the process."""
    address = function(ir, "handler")
    with _registering:  # threads may trace the same function at the same time
        if name not in _registered:
            jax.ffi.register_ffi_target(name, jax.ffi.pycapsule(ctypes.c_void_p(address)), platform="cpu")
            _registered[name] = address
    return address
