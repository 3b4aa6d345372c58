"""Types checked by beartype, by code that is made when a function is first called: most functions of the package are
not called by the files that one process tests, and making that code for all of them takes longer than importing JAX."""

import functools
from collections.abc import Callable
from typing import Any

import beartype


def checked(f: Callable[..., Any]) -> Callable[..., Any]:
    """`f`, decorated by `beartype` when it is called."""
    made = functools.cache(lambda: beartype.beartype(f))

    @functools.wraps(f)
    def run(*args: Any, **kwargs: Any) -> Any:
        __tracebackhide__ = True
        return made()(*args, **kwargs)

    return run
