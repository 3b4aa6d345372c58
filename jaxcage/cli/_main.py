"""The `jaxcage` command: read the options, carry the command out, show its report."""

import contextlib
import gc
import importlib
import io
import os
import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from .. import __version__
from .._cache import keep_compiled_programs
from ._console import FILES_ARE_WHOLE, leave_at_once_when_interrupted, say
from ._errors import BAD_INPUT, FAILED, INTERRUPTED, OK, ComputationError, UsageError
from ._options import Command, CommonOptions, InitOptions


if TYPE_CHECKING:
    from ._report import Report

COMPLETION, SHELLS = ("--tyro-print-completion", "--tyro-write-completion"), ("bash", "zsh", "tcsh", "fish")
"""Options that tyro takes by itself, and what it asserts of them."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with `arguments`, by default those of the process.

    **Returns:** exit status: 0, 1 for a computation without a result, 2 for bad input, 130 when
    interrupted.
    """
    if arguments is None:  # the process is ours, not a notebook's
        leave_at_once_when_interrupted()
        gc.set_threshold(200_000, 50, 100)  # looking for dead objects takes a tenth of the time otherwise
    try:
        options = _parse(sys.argv[1:] if arguments is None else list(arguments))
        if options is not None:
            _carry_out(options)
        return OK
    except UsageError as error:
        say(str(error))
        return BAD_INPUT
    except (ComputationError, OSError) as error:
        say(str(error))
        return FAILED
    except MemoryError:
        say("There is not enough memory for this: ask for fewer speeds, lanes or revolutions.")
        return FAILED
    except KeyboardInterrupt:
        say(f"Interrupted{FILES_ARE_WHOLE}.")
        return INTERRUPTED


def _carry_out(options: CommonOptions | InitOptions) -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    if not options.no_cache:
        keep_compiled_programs()
    implementation = importlib.import_module(f".{options.implementation}", __package__)
    from ._inputs import figures_in  # with the figures: after the options were understood

    with figures_in(options.style):
        report = implementation.run(options)
    _print(report, options.json)
    if report.failure:
        raise ComputationError(report.failure)


def _print(report: "Report", as_json: bool) -> None:
    """Show a report; a standard output that takes nothing is said, as a file that cannot be written is."""
    from ._report import show

    if isinstance(sys.stdout, io.TextIOWrapper):  # names of files need not be text
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        show(report, as_json)
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # or Python tries again at its end, and complains
        raise OSError(
            f"Standard output could not be written ({error.strerror or error}): the files of this run are whole, make "
            "room and run it again for what it prints."
        ) from error


def _parse(arguments: list[str]) -> CommonOptions | InitOptions | None:
    """Options, or None if help or the version was asked for and given.

    **Raises:** `UsageError`: the boxes in which tyro reports errors are boiled down to one
    sentence.
    """
    import tyro

    if arguments == ["--version"]:
        print(f"jaxcage {__version__}")
        return None
    if len(arguments) > 1 and arguments[0].replace("_", "-") in COMPLETION and arguments[1] not in SHELLS:
        raise UsageError(
            f"Option {arguments[0]} must be followed by {', '.join(SHELLS)}, but '{arguments[1]}' was given."
        )
    box = io.StringIO()
    config = (tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes)
    try:
        with contextlib.redirect_stderr(box):
            return tyro.cli(
                Command,  # pyright: ignore[reportArgumentType]
                prog="jaxcage",
                description="Dynamics of rolling-bearing cages: where they move chaotically.",
                args=arguments,
                config=config,
            )
    except SystemExit as stop:
        if stop.code in (0, None):
            return None
        raise UsageError(_sentence(box.getvalue())) from stop


def _sentence(box: str) -> str:
    """What a box says first, as one sentence.

    The title stands in the upper border, or above a rule where the terminal has no line drawing.
    """
    framed = box.lstrip().startswith("╭")
    lines = [line.strip(" │") for line in box.splitlines() if not line.startswith(("╭", "╰"))]
    parts = [" ".join(part.split()) for part in re.split(r"\s[─-]{3,}\s", " ".join(lines))]
    said = [part.rstrip(".") for part in parts if part][0 if framed else 1 :][:2]
    kept = [part for i, part in enumerate(said) if i == 0 or part.startswith("Available")]
    sentence = "; ".join(kept) or "The command line was not understood"
    ours = re.sub(r"^Error parsing (--[\w-]+): (?=must )", r"Option \1 ", sentence)
    return f"{ours} (see jaxcage --help)."
