"""What the code of a function refers to outside of itself, read off its bytecode; and whose code it is."""

import dis
import importlib
import importlib.metadata
import sys
import types
from collections.abc import Iterator
from typing import Any


KNOWN = frozenset("jaxcage jax jaxlib numpy scipy equinox diffrax lineax optimistix optax jaxtyping beartype".split())
"""Packages whose code is known by name and version; with Python's own. All other code is looked into."""
CHANGING = ("time", "random", "secrets", "uuid", "os", "posix", "nt", "subprocess", "socket", "io", "numpy.random")
"""Modules whose functions may give something else every time, or read what lies outside the process."""
OUTSIDE = frozenset("open input eval exec compile globals locals __import__ id hash".split())
"""Built-in functions of which the same is true."""
MISSING = object()
_LOADS = {"LOAD_GLOBAL", "LOAD_NAME", "LOAD_DEREF", "LOAD_CLASSDEREF", "LOAD_FROM_DICT_OR_GLOBALS"}
_ATTRIBUTES = {"LOAD_ATTR", "LOAD_METHOD"}


class Unknown(Exception):
    """What cannot be told from another thing of its kind, in half a sentence that says why."""


def owner(module: str) -> str | None:
    """The known package, or `python`, that a module is of; None for one of somebody else.

    **Raises:** `Unknown` for one whose results may change from one time to the next.
    """
    for name in CHANGING:
        if module in (name, f"_{name}") or module.startswith(f"{name}."):
            raise Unknown(f"{module} may give something else every time")
    top = module.partition(".")[0]
    if top == "builtins" or (top in sys.stdlib_module_names and top != "__main__"):
        return "python"
    return top if top in KNOWN else None


def release(package: str) -> str:
    """The version of a known package; of Python that of its bytecode."""
    if package == "python":
        return f"{sys.implementation.name} {sys.version_info.major}.{sys.version_info.minor}"
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return str(getattr(sys.modules.get(package), "__version__", "?"))


def codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """The code and all that is written within it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from codes(constant)


def references(f: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Every global that a function, or one written within it, reads: its dotted name and what it is; through modules
    to what is taken from them. The closure is not among them, but what is taken from a module in it is.

    **Raises:** `Unknown` for a module of somebody else that is not just looked into.
    """
    inside = dict(zip(f.__code__.co_freevars, f.__closure__ or (), strict=True))
    builtins = f.__globals__.get("__builtins__", {})
    builtins = vars(builtins) if isinstance(builtins, types.ModuleType) else builtins
    for code in codes(f.__code__):
        row = list(dis.get_instructions(code))
        for i, instruction in enumerate(row):
            name = instruction.argval
            if instruction.opname in ("IMPORT_NAME", "IMPORT_FROM"):
                yield from _imported(f, row, i)
            elif instruction.opname in _LOADS:
                if name in inside:
                    value = inside[name].cell_contents if _filled(inside[name]) else MISSING
                    if not isinstance(value, types.ModuleType):
                        continue
                elif instruction.opname in ("LOAD_DEREF", "LOAD_CLASSDEREF"):
                    continue  # of a function around it, within the same code
                else:
                    value = f.__globals__.get(name, builtins.get(name, MISSING))
                yield _taken(name, value, row[i + 1 :])


def _filled(cell: types.CellType) -> bool:
    try:
        return cell.cell_contents is not MISSING
    except ValueError:
        return False


def _taken(name: str, value: Any, after: list[dis.Instruction]) -> tuple[str, Any]:
    """What is taken from a module by the instructions after it was loaded."""
    for instruction in after:
        if not isinstance(value, types.ModuleType) or instruction.opname not in _ATTRIBUTES:
            break
        name = f"{name}.{instruction.argval}"
        value = getattr(value, instruction.argval, MISSING)
    if isinstance(value, types.ModuleType) and owner(value.__name__) is None:
        raise Unknown(f"the module {name} is used as a whole")
    return name, value


def _imported(f: types.FunctionType, row: list[dis.Instruction], i: int) -> Iterator[tuple[str, Any]]:
    """What an import within a function gets."""
    start = next(k for k in range(i, -1, -1) if row[k].opname == "IMPORT_NAME")
    name, level = row[start].argval, row[start - 2].argval
    package = f.__globals__.get("__package__") or ""
    module = importlib.import_module("." * level + name if level else name, package)
    if i != start:
        yield f"{name}.{row[i].argval}", getattr(module, row[i].argval, MISSING)
    elif row[i + 1].opname == "IMPORT_FROM" or owner(module.__name__) is not None:
        yield name, MISSING
    else:
        raise Unknown(f"the module {name} is imported by a function")
