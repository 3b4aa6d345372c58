"""What the command says when it cannot go on: one sentence and an exit status."""

import contextlib
import math
from collections.abc import Iterator


OK, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
MOST = 10_000_000
"""Of anything that is counted: more ends in no memory, or in no lifetime."""


class UsageError(Exception):
    """Bad input, in one sentence that names what was given and what is allowed."""


class ComputationError(Exception):
    """A computation without a result, in one sentence that says why."""


@contextlib.contextmanager
def refusing(option: str = "") -> Iterator[None]:
    """Around code that checks what the user gave: its `ValueError` is the user's error, of this option."""
    try:
        yield
    except ValueError as error:
        raise UsageError(f"Option {option}: {error}" if option else str(error)) from error


def require_speed(option: str, rpm: float) -> float:
    """A speed above zero."""
    if not (math.isfinite(rpm) and rpm > 0):
        raise UsageError(f"Option {option} must be a speed above 0 rpm, but {rpm:g} was given.")
    return rpm


def require_range(first: float, last: float) -> tuple[float, float]:
    """Two speeds [rpm], the second above the first."""
    require_speed("--first", first)
    require_speed("--last", last)
    if last <= first:
        raise UsageError(f"Option --last must be above --first, but the range is {first:g} to {last:g} rpm.")
    return first, last


def require_at_least(option: str, value: int, least: int) -> int:
    """A count that is not too small, nor beyond all use."""
    if value < least:
        raise UsageError(f"Option {option} must be at least {least}, but {value} was given.")
    if value > MOST:
        raise UsageError(f"Option {option} must be at most {MOST}, but {value} was given.")
    return value


def require_blocks(option: str, revolutions: int) -> int:
    """Revolutions that can be cut into equal blocks. **Returns:** the number of blocks."""
    if revolutions < 10 or revolutions % 10:
        raise UsageError(f"Option {option} must be a multiple of 10 above 0, but {revolutions} was given.")
    require_at_least(option, revolutions, 10)
    return 10 if revolutions % 20 else 20


def require_persist(persist: int, discard: int) -> None:
    """Revolutions that chaos must outlast: none, or more than are discarded anyway."""
    if persist and persist <= discard:
        raise UsageError(f"Option --persist must be 0 or above the {discard} of --discard, but {persist} was given.")
    require_at_least("--persist", persist, 0)
