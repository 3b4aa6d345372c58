"""Traced programs kept on disk beside the compiled ones: a later process neither traces nor lowers them again.

JAX keeps what XLA compiles, but only finds it by tracing and lowering the program first: a second or two for a march
with tangents. What is kept here is the lowered program (`jax.export`), under a name that holds all that it follows
from: the package's own sources, the versions of what traces it, the function, the shapes of its arrays, and everything
else in its arguments. Where something in them could be told from another one by no name, as a function made within a
function, nothing is kept.
"""

import dataclasses
import enum
import functools
import hashlib
import importlib.metadata
import json
import os
import pathlib
import sys
import tempfile
import threading
import types
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax import export

from .. import _cache
from .._recent import ARRAYS, Form, program_of, programs, shapes, split


TRACERS = ("jax", "jaxlib", "equinox", "diffrax", "numpy")
"""Packages whose versions decide what a program is."""
OURS = ("jaxcage", "jax", "jaxlib", "equinox", "diffrax", "numpy", "optimistix", "lineax", "builtins")
"""Packages whose functions and classes are known by their names."""


class Unnamed(Exception):
    """Something that has no name by which another process would know it."""


@functools.cache
def sources() -> str:
    """All that the package is made of and traced by, as a digest."""
    digest = hashlib.sha256()
    root = pathlib.Path(__file__).parents[1]
    files = list(root.rglob("*.py")) or list(root.rglob("*.pyc"))  # installed without sources there is bytecode alone
    for path in sorted(files):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    digest.update(repr([importlib.metadata.version(name) for name in TRACERS]).encode())
    return digest.hexdigest()


def named(x: Any, within: bool = True) -> str:
    """What an argument is but for the numbers in its arrays; of what is not `within` the tree, with them.

    **Raises:** `Unnamed`.
    """
    if isinstance(x, ARRAYS):
        numbers = "" if within else hashlib.sha256(np.asarray(x).tobytes()).hexdigest()
        return f"array {np.shape(x)} {x.dtype} {getattr(x, 'weak_type', False)} {numbers}"
    if x is None or isinstance(x, bool | int | float | complex | str | bytes):
        return f"{type(x).__name__} {x!r}"
    if isinstance(x, enum.Enum | np.dtype):
        return f"{type(x).__qualname__} {x}"
    if isinstance(x, type | types.FunctionType | types.BuiltinFunctionType):
        return _known(x)
    if isinstance(x, dict):
        return f"{{{', '.join(f'{named(k, False)}: {named(v, within)}' for k, v in x.items())}}}"
    if isinstance(x, tuple | list):
        return f"{_known(type(x))}({', '.join(named(v, within) for v in x)})"
    if isinstance(x, functools.partial):
        return f"partial({', '.join(named(v, False) for v in (x.func, x.args, x.keywords))})"
    if dataclasses.is_dataclass(x):
        tree = within and isinstance(x, eqx.Module)
        fields = [(f, getattr(x, f.name)) for f in dataclasses.fields(x) if hasattr(x, f.name)]
        row = (f"{f.name}={named(value, tree and not f.metadata.get('static', False))}" for f, value in fields)
        return f"{_known(type(x))}({', '.join(row)})"
    raise Unnamed


def _known(x: Any) -> str:
    """The name of a function or class that is found under it."""
    module, name = getattr(x, "__module__", None) or "", getattr(x, "__qualname__", "<>")
    if module.partition(".")[0] not in OURS or "<" in name:
        raise Unnamed
    return f"{module}.{name}"


def name_of(f: Any) -> str | None:
    """The name of a function of a module of ours; None for another one."""
    try:
        return _known(f) if isinstance(f, types.FunctionType) else None
    except Unnamed:
        return None


class Kept:
    """A function of pytrees as programs of arrays, one for each form of its arguments, on disk where that can be.

    **Arguments:** the function; its name, None where it has none; options for XLA.
    """

    def __init__(self, f: Callable[..., Any], name: str | None, options: dict[str, Any]):
        self.f, self.name, self.options = f, name, options
        self.lock = threading.Lock()

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """What the function makes of its arguments."""
        form, arrays = split((args, kwargs))
        on_disk = self.name is not None and not kwargs and jax.default_backend() == "cpu"
        folder = _cache.traced if on_disk else None
        with self.lock:  # tracing takes long, and is not done twice
            make = lambda: self._kept(folder, form, arrays) or program_of(self.f, form, self.options)
            program = programs.get((self, folder, form, shapes(arrays)), make)
        return program(arrays)

    def _kept(
        self, folder: pathlib.Path | None, form: Form, arrays: list[Any]
    ) -> Callable[[Sequence[Any]], Any] | None:
        """The program that is in the folder, put there if need be; None where that cannot be."""
        if folder is None:
            return None
        try:
            args, _ = form.filled(arrays)
            about = f"{sources()} {self.name} {jax.dtypes.canonicalize_dtype(float)} {named(args)}"
            path = folder / hashlib.sha256(about.encode()).hexdigest()[:32]
            program, result = _program_at(path) or (None, None)
            if program is None:
                made = self._lowered(form, arrays)
                _write(path, made)
                program, result = export.deserialize(bytearray(made[0])), made[1]
        except (Unnamed, NotImplementedError, TypeError, ValueError):
            return None  # what is wrong with it, if anything, is said where it is called without being kept
        run = jax.jit(program.call, compiler_options=self.options)
        return lambda arrays: _filled(result, run(*arrays))

    def _lowered(self, form: Form, arrays: list[Any]) -> tuple[bytes, Any]:
        """The program, and the form of its result."""
        result = []

        def flat(*x: Any) -> list[Any]:
            args, _ = form.filled(x)
            out, shape = jax.tree.flatten(self.f(*args))
            if not all(isinstance(y, ARRAYS) for y in out):
                raise Unnamed
            result.append(_form(jax.tree.unflatten(shape, range(len(out)))))
            return out

        lowered = export.export(jax.jit(flat))(*arrays)
        return bytes(lowered.serialize()), result[-1]


def _form(tree: Any) -> Any:
    """A result with numbers in the place of arrays, as lists and names that JSON can hold.

    **Raises:** `Unnamed` for what is neither a tuple, named or not, nor a list, a dictionary or nothing.
    """
    if tree is None or isinstance(tree, int):
        return tree
    if isinstance(tree, dict):
        return {str(k): _form(v) for k, v in tree.items()}
    if type(tree) not in (tuple, list) and not (isinstance(tree, tuple) and hasattr(tree, "_fields")):
        raise Unnamed
    return [_known(type(tree)), *map(_form, tree)]


def _filled(form: Any, arrays: list[Any]) -> Any:
    """The result of this form. Its classes are named tuples of modules that are there: nothing is imported or run."""
    if form is None:
        return None
    if isinstance(form, int):
        return arrays[form]
    if isinstance(form, dict):
        return {k: _filled(v, arrays) for k, v in form.items()}
    kind, *parts = form
    parts = [_filled(x, arrays) for x in parts]
    if kind in ("builtins.tuple", "builtins.list"):
        return tuple(parts) if kind == "builtins.tuple" else parts
    module, _, name = kind.rpartition(".")
    return getattr(sys.modules[module], name)._make(parts)


def _program_at(path: pathlib.Path) -> tuple[Any, Any] | None:
    """The program that was kept there and the form of its result; None where there is none that can be used."""
    try:
        if not path.is_file():  # a pipe would be waited for
            return None
        digest, whole = path.read_bytes().split(b"\n", 1)
        if digest != _digest(whole):
            return None
        form, serialized = whole.split(b"\n", 1)
        program, form = export.deserialize(bytearray(serialized)), json.loads(form)
        _filled(form, list(range(len(program.out_avals))))
    except Exception:  # what reads the bytes of a stranger may raise anything
        return None
    return program, form


def _digest(whole: bytes) -> bytes:
    return hashlib.sha256(whole).hexdigest().encode()


def _write(path: pathlib.Path, made: tuple[bytes, Any]) -> None:
    """Keep it in one step, so that nobody reads half of it; where that cannot be, it is not kept."""
    whole = json.dumps(made[1]).encode() + b"\n" + made[0]
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(_digest(whole) + b"\n" + whole)
        os.replace(file.name, path)
    except OSError:
        pass
