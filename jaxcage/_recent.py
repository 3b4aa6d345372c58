"""Compiled programs by the form of their arguments; those that have not been used for long are dropped.

A program holds memory and some of the 65 530 memory maps that Linux gives a process; every law of a user's own takes a
few dozen programs. JAX keeps what it has compiled as long as its function exists, and `equinox` keeps functions for
good. Here each form of arguments has a function of its own, which goes with its program. JAX's caches of what it has
traced, some 4 MB of a user's law, are cleared whenever as many programs have gone as are kept.
"""

import collections
import functools
import threading
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np


PROGRAMS = 128
"""Programs that a process keeps, at most."""
ARRAYS = (jax.Array, np.ndarray, np.generic)


class Recent:
    """Things by their keys, so many at most: when there are more, the one that was not asked for longest goes."""

    def __init__(self, most: int):
        self._most, self._things, self._lock = most, collections.OrderedDict[Hashable, Any](), threading.Lock()
        self._gone = 0

    def __len__(self) -> int:
        return len(self._things)

    def get(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """The thing of this key, made if there is none."""
        with self._lock:
            if key in self._things:
                self._things.move_to_end(key)
                return self._things[key]
        made = make()
        with self._lock:
            thing = self._things.setdefault(key, made)  # of two threads that make it the first
            self._things.move_to_end(key)
            old = [self._things.popitem(last=False) for _ in range(len(self._things) - self._most)]
            self._gone += len(old)
            many = self._gone >= self._most
            self._gone = 0 if many else self._gone
        del old  # without the lock: it takes a while
        if many:
            jax.clear_caches()
        return thing


programs = Recent(PROGRAMS)
"""Of this process."""


class Form(NamedTuple):
    """A pytree but for its arrays."""

    tree: Any
    rest: tuple[Any, ...]
    """What is no array, with its kind: 1 is not True."""

    def filled(self, arrays: Sequence[Any]) -> Any:
        """The tree with these arrays."""
        each = iter(arrays)
        return jax.tree.unflatten(self.tree, [next(each) if x is None else x[1] for x in self.rest])


def split(tree: Any, taken: Callable[[Any], bool] = lambda x: isinstance(x, ARRAYS)) -> tuple[Form, list[Any]]:
    """The form of a pytree, and its arrays, or those of its leaves that are `taken`."""
    leaves, shape = jax.tree.flatten(tree)
    rest = tuple(None if taken(x) else (type(x), x) for x in leaves)
    return Form(shape, rest), [x for x in leaves if taken(x)]


def shapes(arrays: Sequence[Any]) -> Hashable:
    """What a program must know of arrays."""
    return tuple((np.shape(x), x.dtype, getattr(x, "weak_type", False)) for x in arrays)


def program_of(f: Callable[..., Any], form: Form, options: dict[str, Any]) -> Callable[[Sequence[Any]], Any]:
    """`f` of arguments and keywords of this form, compiled with these options as a function of their arrays."""
    result: list[Form] = []

    def alone(*arrays: Any) -> list[Any]:
        args, kwargs = form.filled(arrays)
        about, out = split(f(*args, **kwargs))
        result[:] = [about]
        return out

    alone.__name__ = getattr(f, "__name__", "alone")
    program = jax.jit(alone, compiler_options=options)

    def run(arrays: Sequence[Any]) -> Any:
        out = program(*arrays)
        return result[0].filled(out)

    return run


def jitted(f: Callable[..., Any], options: dict[str, Any] | None = None) -> Callable[..., Any]:
    """`equinox.filter_jit`, of which old programs are dropped; with options for XLA."""

    @functools.wraps(f)
    def run(*args: Any, **kwargs: Any) -> Any:
        form, arrays = split((args, kwargs))
        return programs.get((run, form, shapes(arrays)), lambda: program_of(f, form, options or {}))(arrays)

    return run
