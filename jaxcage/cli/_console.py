"""Standard error: progress on a terminal, warnings, and one sentence when something is wrong."""

import contextlib
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, TypeAlias


OK, FAILED, BAD_INPUT = 0, 1, 2
"""Exit statuses."""
FILES_ARE_WHOLE = "files of earlier runs are as they were, and the same command starts over"
SECONDS_BETWEEN_LINES = 60.0
_SHOW_CURSOR_AND_CLEAR_LINE = "\x1b[?25h\r\x1b[2K"
ENDS = (signal.SIGINT, signal.SIGTERM)
"""Signals by which a command is told to end."""
_number: int = signal.SIGINT
"""The one that it was told by."""
_advice: str | None = None
"""What is said to whoever interrupts the computation; None outside of one."""

Say: TypeAlias = Callable[[str, int, int], None]
"""Told what is done, how much of it, of how much."""


def say(text: str) -> None:
    """One line on standard error; names and texts of others cannot move the cursor."""
    print(visible(" ".join(text.split())), file=sys.stderr)


def visible(text: str) -> str:
    """A text in which nothing moves the cursor or turns the direction of writing: such characters are spelt out."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def tell_of_kept_programs() -> None:
    """Make one sentence of all that Python and JAX warn of compiled programs that cannot be kept or used."""
    shown, told = warnings.showwarning, []

    def show(message: Warning | str, *where: Any, **more: Any) -> None:
        text = str(message)
        if text.startswith("Compiled programs are not kept"):
            say(f"Warning: {text}")
        elif "persistent compilation cache" in text:
            if not told:
                say("Warning: a compiled program that was kept cannot be used, or not be kept: it is compiled anew.")
            told.append(text)
        else:
            shown(message, *where, **more)

    if getattr(shown, "__name__", "") != show.__name__:
        warnings.showwarning = show


def warn_of_short(lanes: int, cure: str = ": choose more --revolutions") -> None:
    """Warn of lanes that have no certain label, if there are any."""
    if lanes:
        say(f"Warning: {lanes} lanes have no certain label{cure}.")


def leave_at_once_when_interrupted() -> None:
    """Ctrl-C, or being told to end, during a computation ends the process then and there.

    The threads of a sweep cannot be stopped, and Python would wait for them. Outside a computation,
    when files are written, an interruption is raised as ever, so that things are tidied up; a second one ends that too.
    """
    for each in ENDS:
        signal.signal(each, _on_interruption)


def interrupted_status() -> int:
    """Exit status after an interruption: 128 and the number of the signal."""
    return 128 + _number


def _on_interruption(number: int, frame: FrameType | None) -> None:
    del frame
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
def progress(text: str, unit: str = "", advice: str = "") -> Iterator[Say]:
    """Around a computation: a bar that is told what it is at, and does nothing where standard error is not a terminal.
    One of many minutes counts a `unit`: it gets rate and time left, and without a terminal a line every minute.
    """
    global _advice
    _advice = advice or FILES_ARE_WHOLE
    try:
        if sys.stderr.isatty():
            with _bar(text, unit) as bar:
                yield bar
        else:
            yield _line_a_minute(text, unit) if unit else lambda what, done, total: None
    finally:
        _advice = None


def _line_a_minute(text: str, unit: str) -> Say:
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
def _bar(text: str, unit: str) -> Iterator[Say]:
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

    columns = [TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()]
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
