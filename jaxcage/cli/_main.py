"""The `jaxcage` command: read the options, carry the command out, show what it found."""

import contextlib
import dataclasses
import gc
import importlib
import io
import itertools
import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .. import __version__
from .._cache import keep_compiled_programs
from .._errors import ArgumentError, InputError, NoResult
from ._console import (
    BAD_INPUT,
    FAILED,
    FILES_ARE_WHOLE,
    OK,
    interrupted_status,
    leave_at_once_when_interrupted,
    say,
    tell_of_kept_programs,
    visible,
)
from ._options import COMMANDS, WHOLE_COMMANDS, AnyOptions, Command, CommonOptions
from ._readers import flag


if TYPE_CHECKING:
    from ._job import Job
    from ._show import Report

COMPLETION, SHELLS = ("--tyro-print-completion", "--tyro-write-completion"), ("bash", "zsh", "tcsh", "fish")
"""Options that tyro takes by itself, and what it asserts of them."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with `arguments`, by default those of the process.

    **Returns:** exit status: 0, 1 for a computation without a result, 2 for bad input, 130 when
    interrupted, 143 when told to end.
    """
    if arguments is None:  # the process is ours, not a notebook's
        _open_what_is_closed()
        leave_at_once_when_interrupted()
        gc.set_threshold(200_000, 50, 100)  # looking for dead objects takes a tenth of the time otherwise
    try:
        options = _parse(sys.argv[1:] if arguments is None else list(arguments))
        if options is not None:
            _carry_out(options)
        return OK
    except InputError as error:
        say(str(error))
        return BAD_INPUT
    except (NoResult, OSError) as error:
        say(str(error))
        return FAILED
    except MemoryError:
        say("There is not enough memory for this: ask for fewer speeds, lanes or revolutions.")
        return FAILED
    except KeyboardInterrupt:
        say(f"Interrupted: {FILES_ARE_WHOLE}.")
        return interrupted_status()


def _open_what_is_closed() -> None:
    """A process that was started without standard output or error has somewhere to write to all the same."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))


def _carry_out(options: AnyOptions) -> None:
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # XLA writes pages about each program that it finds compiled
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it tells where it keeps fonts if there is no home folder
    import jax

    jax.config.update("jax_enable_x64", True)
    if isinstance(options, CommonOptions) and options.no_cache:
        os.environ["JAXCAGE_CACHE"] = "off"
    elif isinstance(options, CommonOptions):
        tell_of_kept_programs()
        keep_compiled_programs()
    command, place = next((name, place) for name, (kind, place) in COMMANDS.items() if kind is type(options))
    from ._job import Job

    try:
        job = Job(command, options)
        if job.whole is None:
            report = _function(place)(job)
        else:
            report = _function(WHOLE_COMMANDS[command])(job, job.whole)
        report = _complete(job, report)
    except ArgumentError as error:
        raise _of_options(error, options) from error
    except jax.errors.JaxRuntimeError as error:
        if "RESOURCE_EXHAUSTED" in str(error):
            raise MemoryError from error
        raise
    _print(report, options.json)
    if report.failure:
        raise NoResult(report.failure)


def _function(place: str) -> Callable[..., "Report"]:
    """The function of this package that is at `place`, as `_options` has it."""
    module, name = place.split(".")
    return getattr(importlib.import_module(f".{module}", __package__), name)


def _of_options(error: ArgumentError, options: AnyOptions) -> Exception:
    """What the library says of its arguments, said of the options they come from; of others it is our mistake."""
    option = lambda name: options.called.get(name, name)
    known = all(option(name) in vars(options) for name in error.names)
    return InputError(error.about("Option", lambda name: flag(option(name)))) if known else RuntimeError(str(error))


def _complete(job: "Job[Any]", report: "Report") -> "Report":
    """What every command says: the case, how long it took, what was written, and shaft speeds in its tables."""
    from ..report import with_shaft

    case = {"case": job.name} if job.name else {}
    read, named = _readings(job, report.document)
    time = {"seconds": round(job.seconds, 2)} if job.options.timed else {}
    said = [f"Time: {seconds:.1f} s" for seconds in time.values()]
    tables = [with_shaft(table, job.ratio) if job.name and job.whole is None else table for table in report.tables]
    files = [
        f"{key.replace('_', ' ').capitalize()}: {visible(path)}" for key, path in job.files.items() if path is not None
    ]
    document = {**case, **report.document, **read, **time, **job.files}
    return dataclasses.replace(report, document=document, tables=tables, notes=[*report.notes, *named, *said, *files])


def _readings(job: "Job[Any]", found: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """How the model reads what the paper leaves open, and its speeds, for programs and for people."""
    if not job.name:
        return {}, []
    document: dict[str, Any] = {}
    notes: list[str] = []
    if job.whole is None:
        from ..report import readings_document, readings_words

        document = {"readings": readings_document(job.model), "cage_speed_ratio": job.ratio}
        notes = [f"Readings: {readings_words(job.model)}"]
    if job.file is not None:
        document["left_as_in_template"] = job.file.left
    if job.file is not None and job.file.left:
        notes.append(f"As the template has them, of another bearing: {', '.join(job.file.left)}")
    if job.unknowns and "chance_of_chaos" not in found:
        document["best_guesses"] = [u.label for u in job.unknowns]
        notes.append(f"Best guesses of what is known within ranges only: {', '.join(document['best_guesses'])}")
    return document, notes


def _print(report: "Report", as_json: bool) -> None:
    """Show a report; a standard output that takes nothing is said, as a file that cannot be written is."""
    from ._show import show

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


def _parse(arguments: list[str]) -> Any:
    """Options, or None if help or the version was asked for and given.

    **Raises:** `InputError`.
    """
    import tyro

    if arguments == ["--version"]:
        print(f"jaxcage {__version__}")
        return None
    if len(arguments) > 1 and arguments[0].replace("_", "-") in COMPLETION and arguments[1] not in SHELLS:
        raise InputError(
            f"Option {arguments[0]} must be followed by {', '.join(SHELLS)}, but '{arguments[1]}' was given."
        )
    box = io.StringIO()
    config = (tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes)
    description = "Dynamics of rolling-bearing cages: where they move chaotically."
    try:
        with contextlib.redirect_stderr(box):
            options = tyro.cli(Command, prog="jaxcage", description=description, args=arguments, config=config)
    except SystemExit as stop:
        if stop.code in (0, None):
            return None
        raise InputError(_sentence(box.getvalue())) from stop
    options.check()
    return options


def _sentence(box: str) -> str:
    """What a box of tyro's says, as one sentence: its parts stand between rules, and the title in the upper border, or
    above a rule where the terminal has no line drawing.
    """
    lines = [line.strip(" │") for line in box.splitlines()]
    is_rule = lambda line: not line.strip("─-╭╮╰╯") or line[0] == "╭"
    parts = [" ".join(" ".join(part).split()) for rule, part in itertools.groupby(lines, is_rule) if not rule]
    said, *more = parts if box.startswith("╭") else parts[1:]
    ours, found, why = said.removeprefix("Error parsing ").partition(": ")
    if found and why.startswith("must "):
        return f"Option {ours} {why}"
    kept = [said, *(part for part in more[:1] if part.startswith("Available"))]
    return "; ".join(part.rstrip(".") for part in kept) + " (see jaxcage --help)."
