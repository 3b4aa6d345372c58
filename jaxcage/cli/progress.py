"""Standard error: progress in a terminal and in a log, warnings, and what happens at a signal."""

import contextlib
import math
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, TypeAlias

from .._errors import Stop, visible


SECONDS_BETWEEN_LINES = 10.0
SECONDS_TO_ESTIMATE = 3.0
ENDS = (signal.SIGINT, signal.SIGTERM)
"""Signals by which a command is told to end."""
LISTENS = 5.0
"""Time since the last report of lanes within which they are taken to run [s]."""
_SHOW_CURSOR_AND_CLEAR_LINE = "\x1b[?25h\r\x1b[2K"

Report: TypeAlias = Callable[[str, int, int], None]
"""Takes what is being done, how much of it is done, and of how much."""
_number: int = signal.SIGINT
_computes = _stops = _stopped = _ends = False
"""True during a computation, after it was asked to stop, after its lanes were stopped, and once the process ends."""
_heard = -math.inf
"""Time of the last report of lanes."""
_report: Report = lambda stage, done, total: None


def report(stage: str, done: int, total: int) -> None:
    """Report progress of the command that runs: what is being done, how much of it is done, and of how much."""
    _report(stage, done, total)


def report_lanes(stage: str, done: int, total: int) -> None:
    """Report progress of lanes. **Raises:** `Stop` after an interruption, for an answer from the finished ones."""
    global _heard, _stopped
    if _stops:
        _stopped = True
        raise Stop
    _heard = time.monotonic()
    report(stage, done, total)


def interrupted() -> bool:
    """True if the answer is that of the lanes that were finished when the user interrupted."""
    return _stopped


def ends() -> bool:
    """True once an interruption has been raised, which a library may turn into another exception."""
    return _ends


def say(text: str) -> None:
    """Print one line on standard error."""
    print(visible(" ".join(text.split())), file=sys.stderr)


def shorten_warnings() -> None:
    """Say each warning in one line, and only once; what JAX says of each compiled program in one sentence for all."""
    told = set()

    def show(message: Warning | str, *where: Any, **more: Any) -> None:
        text = f"Warning: {message}"
        if "persistent compilation cache" in text:
            text = "Warning: a stored compiled program cannot be used, or not be stored: it is compiled anew."
        if text not in told:
            say(text)
        told.add(text)

    warnings.showwarning = show


def end_at_once_when_interrupted() -> None:
    """End the process at once at Ctrl-C, or when it is told to end, during a computation.

    While lanes run, the first Ctrl-C only asks them to stop. Outside a computation, while files are written, the first
    interruption is raised as usual, so that temporary files are removed. Another one ends the process.
    """
    for each in ENDS:
        signal.signal(each, _on_interruption)


def end_interrupted() -> int:
    """Say that the command was interrupted. Further interruptions are ignored while the process ends.

    **Returns:** exit status: 128 and the number of the signal.
    """
    for each in ENDS:
        if signal.getsignal(each) is _on_interruption:  # which Python would reset to the default while it ends
            signal.signal(each, signal.SIG_IGN)
    say("Interrupted: files are whole, and the same command starts over or goes on from what is stored.")
    return 128 + _number


def _on_interruption(number: int, frame: FrameType | None) -> None:
    global _number, _stops, _ends
    if _ends:
        os._exit(128 + _number)
    _number = number
    if number == signal.SIGINT and _computes and not _stops and time.monotonic() - _heard < LISTENS:
        _stops = True
        say("Interrupted: the answer from what is finished follows; interrupt again to end at once.")
        return
    _ends = True
    if not _computes:
        raise KeyboardInterrupt
    if sys.stderr.isatty():
        sys.stderr.write(_SHOW_CURSOR_AND_CLEAR_LINE)
    status = end_interrupted()
    sys.stderr.flush()
    os._exit(status)


@contextlib.contextmanager
def progress(text: str) -> Iterator[None]:
    """Around a computation: a bar in a terminal, elsewhere a line every ten seconds."""
    global _computes, _stops, _stopped, _report
    _computes, _stops, _stopped = True, False, False
    try:
        with _bar(text) if sys.stderr.isatty() else contextlib.nullcontext(None) as bar:
            _report = _timed(text, bar)
            yield
    finally:
        _computes, _report = False, lambda stage, done, total: None


def _timed(text: str, bar: Report | None) -> Report:
    """Report that moves the bar or, without one, prints lines with what is done and the time that the rest takes, from
    the rate since the stage began. The first line of a stage of more than a minute comes early."""
    stage, first, began, said, told = "", 0, math.nan, time.monotonic(), False

    def report(what: str, done: int, total: int) -> None:
        nonlocal stage, first, began, said, told
        now = time.monotonic()
        if what != stage:
            stage, first, began, told = what, done, now, False
        left = (total - done) * (now - began) / (done - first) / 60 if done > first else math.nan
        early = not told and left > 1 and now - began >= SECONDS_TO_ESTIMATE
        if bar is not None:
            bar(what, done, total)
        elif early or now - said >= SECONDS_BETWEEN_LINES:
            said, told = now, True
            say(f"{text}, {what}: {done} of {total}{'' if math.isnan(left) else f', {left:.1f} min left'}")

    return report


@contextlib.contextmanager
def _bar(text: str) -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()]
    with Progress(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=120) as bar:
        task = bar.add_task(text, total=None)
        yield lambda what, done, total: bar.update(task, description=f"{text}, {what}", completed=done, total=total)
