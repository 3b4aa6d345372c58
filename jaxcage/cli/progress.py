"""Standard error: progress in a terminal and in a log, warnings, and what happens at a signal."""

import contextlib
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, TypeAlias


FILES_ARE_WHOLE = "files of earlier runs are as they were, and the same command starts over"
SECONDS_BETWEEN_LINES = 10.0
ENDS = (signal.SIGINT, signal.SIGTERM)
"""Signals by which a command is told to end."""
_SHOW_CURSOR_AND_CLEAR_LINE = "\x1b[?25h\r\x1b[2K"

Report: TypeAlias = Callable[[str, int, int], None]
"""Takes what is being done, how much of it is done, and of how much."""
_number: int = signal.SIGINT
_advice: str | None = None
"""Words for a user who interrupts the computation; None outside of one."""
_report: Report = lambda stage, done, total: None


def report(stage: str, done: int, total: int) -> None:
    """Report progress of the command that runs: what is being done, how much of it is done, and of how much."""
    _report(stage, done, total)


def advise(text: str) -> None:
    """Say something else than `FILES_ARE_WHOLE` to a user who interrupts this computation."""
    global _advice
    _advice = text


def say(text: str) -> None:
    """Print one line on standard error."""
    print(visible(" ".join(text.split())), file=sys.stderr)


def visible(text: str) -> str:
    """The text with characters spelt out that move the cursor or turn the direction of writing."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


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

    The threads of a sweep cannot be stopped, and Python would wait for them. Outside a computation, while files are
    written, the first interruption is raised as usual, so that temporary files are removed.
    """
    for each in ENDS:
        signal.signal(each, _on_interruption)


def interrupted_status() -> int:
    """Exit status after an interruption: 128 and the number of the signal."""
    return 128 + _number


def _on_interruption(number: int, frame: FrameType | None) -> None:
    global _number
    _number = number
    for each in ENDS:
        signal.signal(each, signal.SIG_DFL)
    if _advice is None:
        raise KeyboardInterrupt
    if sys.stderr.isatty():
        sys.stderr.write(_SHOW_CURSOR_AND_CLEAR_LINE)
    say(f"Interrupted: {_advice}.")
    sys.stderr.flush()
    os._exit(interrupted_status())


@contextlib.contextmanager
def progress(text: str) -> Iterator[None]:
    """Around a computation: a bar in a terminal, and a line every ten seconds elsewhere."""
    global _advice, _report
    advise(FILES_ARE_WHOLE)
    try:
        with _bar(text) if sys.stderr.isatty() else contextlib.nullcontext(_line_now_and_then(text)) as _report:
            yield
    finally:
        _advice, _report = None, lambda stage, done, total: None


def _line_now_and_then(text: str) -> Report:
    stage, began, first, said = "", time.monotonic(), 0, time.monotonic()

    def report(what: str, done: int, total: int) -> None:
        nonlocal stage, began, first, said
        now = time.monotonic()
        if what != stage or done < first:
            stage, began, first = what, now, done
        if now - said < SECONDS_BETWEEN_LINES:
            return
        said = now
        left = f", {(total - done) * (now - began) / (done - first) / 60:.1f} min left" if done > first else ""
        say(f"{text}, {what}: {done} of {total}{left}")

    return report


@contextlib.contextmanager
def _bar(text: str) -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()]
    with Progress(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=120) as bar:
        task = bar.add_task(text, total=None)
        yield lambda what, done, total: bar.update(task, description=f"{text}, {what}", completed=done, total=total)
