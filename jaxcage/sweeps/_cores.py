"""The processor's cores: how many there are, and what an idle one may do.

A program is compiled by one core while the others wait. What is sure to be needed next is therefore compiled beside
it, by being called early, on arguments that are quick to run.
"""

import concurrent.futures
import os
from collections.abc import Callable
from typing import Any

import jax

from .._recent import shapes, split


def cores() -> int:
    """Processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def workers() -> int:
    """Chunks that run at a time."""
    return cores() if jax.default_backend() == "cpu" else 1


_beside = concurrent.futures.ThreadPoolExecutor(1, "compile")
_called: set[int] = set()


def compile_beside(run: Callable[..., Any], *args: Any) -> None:
    """Call `run` once for arguments of this form, in a thread of its own, and forget what it returns or raises: it is
    raised again where the result is wanted."""
    if workers() < 2:
        return
    form, arrays = split(args)
    key = hash((run, form, shapes(arrays)))
    if key not in _called:
        _called.add(key)
        _beside.submit(run, *args)
