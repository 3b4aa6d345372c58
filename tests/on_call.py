"""Types checked by jaxtyping and beartype, in the first calls of each function in each test.

Code that checks a function is made when it is first called: most functions of the package are not called by the files
that one process tests, and making that code for all of them takes longer than importing JAX. And tracing calls small
functions many thousand times, with the same types: checking them all takes a tenth of the tests' time.
"""

import collections
import functools
import types
from collections.abc import Callable
from typing import Any

import beartype
import jaxtyping


CHECKED = 8
"""Calls of a function in a test that are checked."""
_NUMBERS = beartype.BeartypeConf(is_pep484_tower=True)
"""An integer is given where `float` is asked, as Python's own type rules allow."""
_every = jaxtyping.jaxtyped
_calls: collections.Counter[types.CodeType] = collections.Counter()


def checked(f: Callable[..., Any]) -> Callable[..., Any]:
    """`f`, decorated by `beartype` when it is called."""
    made = functools.cache(lambda: beartype.beartype(conf=_NUMBERS)(f))

    @functools.wraps(f)
    def run(*args: Any, **kwargs: Any) -> Any:
        __tracebackhide__ = True
        return made()(*args, **kwargs)

    return run


def check_first_calls() -> None:
    """Have jaxtyping's import hook, which decorates each function by `jaxtyping.jaxtyped`, check no more than these."""
    jaxtyping.jaxtyped = _first_calls


def begin_test() -> None:
    """Check all functions again."""
    _calls.clear()


def _first_calls(f: Any = None, **options: Any) -> Any:
    if f is None:
        return functools.partial(_first_calls, **options)
    if isinstance(f, type) and hasattr(f.__init__, "checks_types"):  # it is written out, and checked as a function
        return f
    if not isinstance(f, types.FunctionType):
        return _every(f, **options)
    code = f.__code__
    made = functools.cache(lambda: _every(f, **options))

    @functools.wraps(f)
    def run(*args: Any, **kwargs: Any) -> Any:
        __tracebackhide__ = True
        if _calls[code] >= CHECKED:
            return f(*args, **kwargs)
        _calls[code] += 1
        return made()(*args, **kwargs)

    run.__dict__["checks_types"] = True
    return run
