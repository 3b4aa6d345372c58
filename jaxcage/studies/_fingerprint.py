"""What the numbers of a study follow from, as digests: code, closures, globals, classes, arrays, versions, platform.

Code of one's own is followed from the law to whatever it refers to, by content and not by name; packages that are known
count by their versions. What cannot be followed has no fingerprint, and says why.
"""

import dataclasses
import enum
import functools
import hashlib
import os
import pathlib
import platform
import types
import weakref
from collections.abc import Iterable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from ._references import MISSING, OUTSIDE, Unknown, owner, references, release


ARRAYS = (jax.Array, np.ndarray, np.generic)
VALUES = (*ARRAYS, int, float, complex, str, tuple, list, dict, set, frozenset)
LAYERS = ("bearing", "forces", "models", "integrate", "analysis", "sweeps", "studies")
"""Of this package, what the numbers of a study are computed by."""
_NOT_OF_A_CLASS = frozenset(
    "__dict__ __weakref__ __doc__ __module__ __qualname__ __abstractmethods__ __abstractvars__ __abstractclassvars__ "
    "_abc_impl __slotnames__ __annotations__ __annotations_cache__ __annotate__ __annotate_func__ __dataclass_fields__ "
    "__dataclass_params__ __match_args__ __parameters__ __orig_bases__ __firstlineno__ __static_attributes__".split()
)
_NOT_OF_A_THING = frozenset("__name__ __qualname__ __doc__ __module__ __annotations__ __type_params__".split())
_DESCRIPTORS = (types.MethodDescriptorType, types.WrapperDescriptorType, types.MethodWrapperType)
_DESCRIPTORS += (types.GetSetDescriptorType, types.MemberDescriptorType, types.ClassMethodDescriptorType)


@functools.cache
def package_digest() -> str:
    """All that this package computes the lanes of a study by."""
    digest, root = hashlib.sha256(), pathlib.Path(__file__).parents[1]
    files = lambda ending: [*root.glob(ending), *(p for layer in LAYERS for p in (root / layer).glob(ending))]
    for path in sorted(files("*.py") or files("*.pyc")):  # installed without sources there is bytecode alone
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def platform_traits() -> dict[str, str]:
    """What of this machine and its settings changes the last bits: the processor's arithmetic, devices, options."""
    info = pathlib.Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    flags = {word for line in lines if line.startswith(("flags", "Features")) for word in line.split()}
    arithmetic = sorted(f for f in flags if f.startswith(("avx", "fma", "sse4", "f16c", "asimd", "sve", "amx")))
    return {
        "machine": platform.machine(),
        "arithmetic": " ".join(arithmetic) or platform.processor(),
        "device": jax.devices()[0].device_kind,
        "XLA_FLAGS": os.environ.get("XLA_FLAGS", ""),
        "matmul": str(jax.config.jax_default_matmul_precision),  # pyright: ignore[reportAttributeAccessIssue]
    }


def fingerprint(**things: Any) -> dict[str, str]:
    """What each of the `things` is: part by part, by names that a message can show, each with its digest.

    **Raises:** `Unknown`, with the reason, for what holds something that cannot be followed.
    """
    walk = _Walk()
    for name, thing in things.items():
        walk.parts[name] = walk.of(thing, name)
    versions = {f"version_{package}": release(package) for package in sorted(walk.packages)}
    return dict(sorted(walk.parts.items())) | versions


def _short(name: str) -> str:
    return name.replace("<locals>.", "").replace("<lambda>", "lambda")


def _digest(kind: str, parts: Iterable[str]) -> str:
    return hashlib.sha256("\0".join((kind, *parts)).encode()).hexdigest()[:16]


class _Walk:
    """From an object to all that it refers to."""

    def __init__(self):
        self.parts: dict[str, str] = {}
        self.packages: set[str] = set()
        self._seen: dict[int, str] = {}
        self._alive: list[Any] = []  # so that no number of an object is given to another one

    def of(self, x: Any, name: str) -> str:
        """The digest of `x`, called `name` where it is part of something else."""
        if x is None or x is Ellipsis or x is NotImplemented or isinstance(x, bool | int | str | bytes):
            if type(x).__module__ == "builtins":
                return f"{type(x).__name__} {x!r}"
        if type(x) in (float, complex):
            return f"{type(x).__name__} {x!r}"
        if isinstance(x, ARRAYS):
            return self._array(x, name)
        if isinstance(x, types.ModuleType):
            return self._named(x.__name__, "module", name)
        if id(x) not in self._seen:
            self._alive.append(x)
            self._seen[id(x)] = f"the {len(self._seen)}th"  # where something holds itself
            self._seen[id(x)] = self._compound(x, name)
        return self._seen[id(x)]

    def _array(self, x: Any, name: str) -> str:
        if isinstance(x, np.ma.MaskedArray):
            return _digest("masked", [self._array(np.asarray(x.data), name), self._array(np.ma.getmaskarray(x), name)])
        if isinstance(x, Tracer):
            raise Unknown(f"{name} is a number that is being traced")
        if jnp.issubdtype(x.dtype, jax.dtypes.prng_key):
            x = jax.random.key_data(x)
        values = np.asarray(x)
        if values.dtype.hasobject:
            return _digest("objects", [str(values.shape), *(self.of(y, name) for y in values.ravel().tolist())])
        bits = hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()
        return f"array {values.shape} {values.dtype.str} {getattr(x, 'weak_type', False)} {bits[:16]}"

    def _named(self, module: str, what: str, name: str) -> str:
        """Something of a known package.

        **Raises:** `Unknown` for something else.
        """
        package = owner(module)
        if package is None:
            raise Unknown(f"{name} is {what}, which nothing is known of")
        self.packages.add(package)
        return f"{module} {what}"

    def _compound(self, x: Any, name: str) -> str:
        if isinstance(x, types.FunctionType):
            return self._function(x, name)
        if isinstance(x, type):
            return self._class(x, name)
        if isinstance(x, types.CodeType):
            return self._code(x, name)
        if isinstance(x, types.MethodType) and not isinstance(x.__func__, types.FunctionType):
            own = self._named(type(x.__self__).__module__, getattr(x, "__name__", "?"), name)
            return _digest("method", [own, self.of(x.__self__, name)])
        if isinstance(x, types.MethodType):
            return _digest("method", [self.of(x.__func__, name), self.of(x.__self__, name)])
        if isinstance(x, types.BuiltinFunctionType) and not isinstance(x.__self__, types.ModuleType | None):
            return _digest("method", [x.__name__, self.of(x.__self__, name)])
        if isinstance(x, types.BuiltinFunctionType):
            if x.__module__ == "builtins" and x.__name__ in OUTSIDE:
                raise Unknown(f"{x.__name__}() reads what lies outside of the law")
            return self._named(x.__module__ or "?", x.__qualname__, name)
        if isinstance(x, _DESCRIPTORS):
            return _digest("descriptor", [self.of(x.__objclass__, name), x.__name__])
        if isinstance(x, property):
            return _digest("property", [self.of(f, name) for f in (x.fget, x.fset, x.fdel)])
        if isinstance(x, staticmethod | classmethod):
            return _digest(type(x).__name__, [self.of(x.__func__, name)])
        if isinstance(x, np.ufunc) and getattr(np, x.__name__, None) is x:
            return self._named("numpy", x.__name__, name)
        if isinstance(x, enum.Enum | np.dtype):
            return _digest("constant", [self.of(type(x), name), str(x)])
        if isinstance(x, weakref.ref | types.GeneratorType | types.CoroutineType):
            raise Unknown(f"{name} is a {type(x).__name__}")
        return self._instance(x, name)

    def _instance(self, x: Any, name: str) -> str:
        """Anything else: its class and all that it holds."""
        parts = [self.of(type(x), name)]
        if isinstance(x, dict | types.MappingProxyType):
            parts += [part for k, v in x.items() for part in (self.of(k, name), self.of(v, f"{name}[{k!r}]"))]
        elif isinstance(x, set | frozenset):
            parts += sorted(self.of(v, name) for v in x)
        elif isinstance(x, tuple | list):
            parts += [self.of(v, name) for v in x]
        elif isinstance(x, int | float | complex | str | bytes):
            parts.append(repr(x))
        slots = {s for kind in type(x).__mro__ for s in _names(vars(kind).get("__slots__", ()))}
        own = {s: getattr(x, s) for s in slots - {"__dict__", "__weakref__"} if hasattr(x, s)} | getattr(
            x, "__dict__", {}
        )
        if dataclasses.is_dataclass(x):
            own |= {f.name: getattr(x, f.name) for f in dataclasses.fields(x) if hasattr(x, f.name)}
        parts += [f"{k}={self.of(v, f'{name}.{k}')}" for k, v in sorted(own.items()) if k not in _NOT_OF_A_THING]
        if wrapped := getattr(x, "__wrapped__", None):
            parts.append(self.of(wrapped, name))
        if len(parts) == 1 and not isinstance(x, _EMPTY):
            parts.append(self._reduced(x, name))
        return _digest("thing", parts)

    def _reduced(self, x: Any, name: str) -> str:
        """What pickle would keep of something that is not made in Python."""
        try:
            made, arguments, *state = x.__reduce_ex__(4)
        except (TypeError, ValueError):
            raise Unknown(f"{name} is a {type(x).__name__}, which cannot be looked into") from None
        return _digest("made", [self.of(made, name), self.of(arguments, name), self.of(state[:1], name)])

    def _code(self, code: types.CodeType, name: str) -> str:
        """Instructions, constants and names; not where it stands, nor what it is called."""
        constants = [self.of(c, name) for c in code.co_consts]
        about = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
        return _digest("code", [code.co_code.hex(), str(about), str(names), code.co_exceptiontable.hex(), *constants])

    def _function(self, f: types.FunctionType, name: str) -> str:
        known = owner(f.__module__ or "?")
        if known is not None:
            self.packages.add(known)
        simple = "<" not in f.__qualname__ and f.__closure__ is None
        if known is not None and simple and not f.__code__.co_filename.startswith("<"):
            return f"{f.__module__} {f.__qualname__}"
        called, parts = _short(f.__qualname__), [self._code(f.__code__, name)]
        if known is None:
            self._note(called, parts[0])
        for cell_name, cell in zip(f.__code__.co_freevars, f.__closure__ or (), strict=True):
            inside = f"closure value {cell_name} of {called}"
            try:
                value = cell.cell_contents
            except ValueError:
                continue  # a name that has not got its value yet
            parts.append(f"{cell_name}={'module' if isinstance(value, types.ModuleType) else self.of(value, inside)}")
            if known is None:
                self._note(inside, parts[-1])
        parts += [self.of(f.__defaults__, f"defaults of {called}"), self.of(f.__kwdefaults__, f"defaults of {called}")]
        own = {k: v for k, v in vars(f).items() if k not in _NOT_OF_A_THING}
        parts.append(self.of(own, called))
        if known is None:
            for path, value in dict(references(f)).items():
                parts.append(f"{path} {'' if value is MISSING else self.of(value, f'global {path}')}")
                if isinstance(value, VALUES):
                    self._note(f"global {path}", parts[-1])
        return _digest("function", parts)

    def _class(self, kind: type, name: str) -> str:
        if not isinstance(kind.__module__, str):
            raise Unknown(f"{name} is a {kind.__name__}, which cannot be looked into")
        known = owner(kind.__module__)
        if known is not None:
            self.packages.add(known)
            return f"{kind.__module__} {kind.__qualname__}"
        parts = [self.of(base, name) for base in (*kind.__bases__, type(kind))]
        for key, value in sorted(vars(kind).items()):
            if key not in _NOT_OF_A_CLASS and not isinstance(value, types.MemberDescriptorType):
                called = f"{_short(kind.__qualname__)}.{key}"
                parts.append(f"{key}={self.of(value, called)}")
                if isinstance(value, VALUES):
                    self._note(called, parts[-1])
        return _digest("class", parts)

    def _note(self, name: str, digest: str) -> None:
        """Keep a part under its name, and a second one of that name under another."""
        others = [k for k in self.parts if k == name or k.startswith(f"{name} (")]
        if not any(self.parts[k] == digest for k in others):
            self.parts[f"{name} ({len(others) + 1})" if others else name] = digest


_EMPTY = (tuple, list, dict, set, frozenset)


def _names(slots: Any) -> tuple[str, ...]:
    return (slots,) if isinstance(slots, str) else tuple(slots)
