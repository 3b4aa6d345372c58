"""Standard error: progress on a terminal, warnings, and one sentence when something is wrong."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from types import FrameType

from ._errors import INTERRUPTED


_computing = False
_SHOW_CURSOR_AND_CLEAR_LINE = "\x1b[?25h\r\x1b[2K"


def say(text: str) -> None:
    """One line on standard error."""
    print(" ".join(text.split()), file=sys.stderr)


def leave_at_once_when_interrupted() -> None:
    """Ctrl-C during a computation ends the process then and there.

    The threads of a sweep cannot be stopped, and Python would wait for them. Outside a computation,
    when files are written, an interruption is raised as ever, so that things are tidied up.
    """
    signal.signal(signal.SIGINT, _on_interruption)


def _on_interruption(number: int, frame: FrameType | None) -> None:
    del number, frame
    if not _computing:
        raise KeyboardInterrupt
    if sys.stderr.isatty():
        sys.stderr.write(_SHOW_CURSOR_AND_CLEAR_LINE)
    say("Interrupted.")
    sys.stderr.flush()
    os._exit(INTERRUPTED)


@contextlib.contextmanager
def progress(text: str) -> Iterator[Callable[[int, int], None] | None]:
    """Around a computation: a bar that is called with lanes done and lanes in all; None where
    standard error is not a terminal.
    """
    with progress_in_stages(text) as bar:
        yield None if bar is None else lambda done, total: bar("", done, total)


@contextlib.contextmanager
def progress_in_stages(text: str) -> Iterator[Callable[[str, int, int], None] | None]:
    """As `progress`, but the bar is first told what the computation is at."""
    global _computing
    _computing = True
    try:
        with _bar(text) as bar:
            yield bar
    finally:
        _computing = False


@contextlib.contextmanager
def _bar(text: str) -> Iterator[Callable[[str, int, int], None] | None]:
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    text_column = TextColumn("{task.description}")
    columns = (text_column, BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(text, total=None)
        at = lambda what: f"{text}, {what}" if what else text
        yield lambda what, done, total: bar.update(task, description=at(what), completed=done, total=total)
