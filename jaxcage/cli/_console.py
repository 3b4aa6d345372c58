"""Standard error: progress on a terminal, warnings, and one sentence when something is wrong."""

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from types import FrameType

from ._errors import INTERRUPTED


_computing = False
FILES_ARE_WHOLE = ": files of earlier runs are as they were, and the same command starts over"
_advice = FILES_ARE_WHOLE
SECONDS_BETWEEN_LINES = 60.0
_SHOW_CURSOR_AND_CLEAR_LINE = "\x1b[?25h\r\x1b[2K"


def say(text: str) -> None:
    """One line on standard error; names and texts of others cannot move the cursor."""
    line = " ".join(text.split())
    print("".join(c if c.isprintable() else repr(c)[1:-1] for c in line), file=sys.stderr)


def warn_of_short(labels: int) -> None:
    """Say how many labels rest on too few revolutions, if any."""
    if labels:
        say(f"Warning: {labels} labels rest on too few revolutions: choose more --revolutions.")


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
    say(f"Interrupted{_advice}.")
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
def progress_in_stages(text: str, advice: str = "") -> Iterator[Callable[[str, int, int], None] | None]:
    """As `progress`, but the bar is first told what the computation is at. `advice` is what is said to whoever
    interrupts it.
    """
    global _computing, _advice
    _computing, _advice = True, f": {advice}" if advice else FILES_ARE_WHOLE
    try:
        with _bar(text) as bar:
            yield bar
    finally:
        _computing, _advice = False, FILES_ARE_WHOLE


@contextlib.contextmanager
def progress_with_rate(text: str, unit: str, advice: str) -> Iterator[Callable[[str, int, int], None]]:
    """Around a computation of many minutes: a bar with rate and time left; a line every minute where standard error is
    not a terminal. `advice` is what is said to whoever interrupts it.
    """
    global _computing, _advice
    _computing, _advice = True, f": {advice}"
    try:
        with _bar(text, unit) as bar:
            yield bar or _line_a_minute(text, unit)
    finally:
        _computing, _advice = False, FILES_ARE_WHOLE


def _line_a_minute(text: str, unit: str) -> Callable[[str, int, int], None]:
    stage, began, first, said = "", 0.0, 0, 0.0

    def report(what: str, done: int, total: int) -> None:
        nonlocal stage, began, first, said
        now = time.monotonic()
        if what != stage or not began or done < first:
            stage, began, first, said = what, now, done, said or now
        if now - said < SECONDS_BETWEEN_LINES or done == first:
            return
        said, rate = now, (done - first) / (now - began)
        left = (total - done) / rate / 60
        at = f"{text}, {what}" if what else text
        say(f"{at}: {done} of {total} {unit}, {rate:.3g} a second, {left:.1f} min left")

    return report


@contextlib.contextmanager
def _bar(text: str, unit: str = "") -> Iterator[Callable[[str, int, int], None] | None]:
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        Task,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    text_column = TextColumn("{task.description}")
    columns = [text_column, BarColumn(), TaskProgressColumn(), TimeRemainingColumn()]
    if unit:

        class Rate(TextColumn):
            def render(self, task: Task) -> Text:
                speed = f", {task.speed:.3g} a second" if task.speed else ""
                return Text(f"{task.completed:.0f} of {task.total or 0:.0f} {unit}{speed}")

        columns.insert(-1, Rate(""))
    with Progress(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=120) as bar:
        task = bar.add_task(text, total=None)
        at = lambda what: f"{text}, {what}" if what else text
        yield lambda what, done, total: bar.update(task, description=at(what), completed=done, total=total)
