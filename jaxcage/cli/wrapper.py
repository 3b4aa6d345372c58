"""Entry point of all commands: it reads the options, runs a command, and turns errors into one sentence."""

import contextlib
import dataclasses
import functools
import gc
import inspect
import io
import itertools
import logging
import os
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from .. import __version__
from .._cache import keep_compiled_programs
from .._errors import ArgumentError, InputError, NoResult
from . import (
    case_commands as case,
    design_commands as design,
    orbit_commands as orbit,
    speed_commands as speed,
)
from .answer import Answer, complete, print_answer
from .options import ShowOptions, flag
from .progress import (
    end_at_once_when_interrupted,
    end_interrupted,
    ends,
    interrupted,
    progress,
    say,
    shorten_warnings,
)
from .subject import check_speeds, described, read_case


if TYPE_CHECKING:
    from ..files import Description

OK, FAILED, BAD_INPUT = 0, 1, 2
"""Exit statuses."""
FUNCTIONS: tuple[Callable[..., Answer], ...] = (
    *(case.init, case.check, speed.simulate, speed.sweep, orbit.zones, orbit.bifurcations, orbit.gradient),
    *(speed.compare, speed.runup, orbit.map_, speed.study, design.design, design.sensitivity, design.identify),
    *(speed.poincare, case.statics, case.report),
)
COMMANDS = {function.__name__.rstrip("_"): function for function in FUNCTIONS}
CALLED = {"directions": "by", "samples": "sample", "settle": "discard", "confirm": "no_confirm"}
CALLED |= {"method": "solver", "centrifugal_force": "speed", "blocks": "revolutions", "store": "out"}
CALLED |= {"x": "points", "y": "points", "film": "least_film", "balance": "grade", "prices": "price"}
"""Option that sets an argument of the library, where it has another name."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with `arguments`, by default those of the process.

    **Returns:** exit status: 0, 1 for no result, 2 for bad input, 130 when interrupted, 143 when terminated.
    """
    if arguments is None:  # the process is ours, not a notebook's
        for name in ("stdout", "stderr"):  # a process without them writes to the null device
            if getattr(sys, name) is None:
                setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
        end_at_once_when_interrupted()
        gc.set_threshold(200_000, 50, 100)  # garbage collection takes a tenth of the time otherwise
    try:
        call = _parse(sys.argv[1:] if arguments is None else list(arguments))
        if call is not None:
            _run(call)
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
    except (KeyboardInterrupt, Exception) as error:
        if isinstance(error, KeyboardInterrupt) or ends():
            return end_interrupted()
        raise


def _run(call: functools.partial[Answer]) -> None:
    """Read the case, run a command on it, write its files, and print its answer. A wrong file is refused before JAX is
    loaded, which takes seconds."""
    show: ShowOptions | None = call.keywords.get("show")
    if show is None:
        return print_answer(call(), call.keywords["json"])
    speeds = {"speed": call.keywords.get("speed")}
    over = call.keywords.get("over")
    if over is not None and over != inspect.signature(call.func).parameters["over"].default:
        speeds |= {"first": over.first, "last": None if over.count == 1 else over.last}
    operating = call.keywords.get("operating") or getattr(call.keywords.get("calm"), "operating", None)
    if operating is not None:
        speeds["operating"] = operating[1]
    found = described(call.keywords["subject"])
    check_speeds(found, speeds)
    _check_kind(call, found, described(call.keywords["other"]) if "other" in call.keywords else found)
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it tells where it stores fonts if there is no home folder
    import jax

    jax.config.update("jax_enable_x64", True)
    if show.no_cache:
        os.environ["JAXCAGE_CACHE"] = "off"
    else:
        shorten_warnings()
        keep_compiled_programs()
    try:
        answer = _of_a_case(call, show)
    except ArgumentError as error:
        raise _about_options(error, call) from error
    except jax.errors.JaxRuntimeError as error:
        if "RESOURCE_EXHAUSTED" in str(error):
            raise MemoryError from error
        raise
    print_answer(answer, show.json, show.details)
    if interrupted():
        raise KeyboardInterrupt
    if answer.failure:
        raise NoResult(answer.failure)


def _of_a_case(call: functools.partial[Answer], show: ShowOptions) -> Answer:
    """Answer of a command about a case, with its files; whether they can be written is checked first."""
    from ..files import check_writable

    began, command, given = time.perf_counter(), call.func.__name__.rstrip("_"), call.keywords
    cases = {name: read_case(given[name]) for name in ("subject", "other") if name in given}
    cases["subject"] = cases["subject"].under(_load(call))
    check_writable(show.out)
    with progress(f"{command} {cases['subject'].name}"):
        answer = call(**cases)
    if interrupted():
        said, document = f"Partial, since it was interrupted: {answer.sentence}", {**answer.document, "partial": True}
        answer = dataclasses.replace(answer, sentence=said, document=document, part=f"{answer.part}_partial")
    answer = complete(answer, command, cases["subject"], show.out, time.perf_counter() - began)
    if answer.kept and not interrupted():
        shutil.rmtree(answer.kept)
    return answer


def _load(call: functools.partial[Answer]) -> float | None:
    """Load of a bearing with its rollers, if it is given; the one of `statics` is that of a cage, too."""
    given = call.keywords
    return None if call.func is case.statics else given["means"].load if "means" in given else given.get("load")


def _check_kind(call: functools.partial[Answer], found: "Description", other: "Description") -> None:
    """Check that a command and its options are for such a case, and two cases of one kind. **Raises:** `InputError`."""
    command, name, is_cage = call.func.__name__, call.keywords["subject"], found.subject == "cage"
    if not is_cage and call.func in (orbit.bifurcations, speed.poincare):  # the revolutions of a bearing do not repeat
        raise InputError(f"Command {command} takes a cage, but {name} is a bearing with its rollers.")
    if is_cage and _load(call) is not None:  # from which the forces on a cage do not follow
        raise InputError(f"Option --load goes with a bearing with its rollers, but {name} is a cage.")
    if found.subject != other.subject:
        kind, second = "a cage" if is_cage else "a bearing with its rollers", call.keywords["other"]
        raise InputError(f"Case '{second}' must be {kind}, as the first one is: two of a kind are compared.")
    if call.func is design.identify and not found.ranges:
        example = 'such as stiffness = "1e4 .. 1e6 N/m"'
        raise InputError(f"Case {name} must be a TOML file with ranges, {example}, but has none.")


def _about_options(error: ArgumentError, call: functools.partial[Answer]) -> Exception:
    """Error about options, from one about arguments of the library; a `RuntimeError`, for a bug, if no option sets
    them."""
    options = {*call.keywords}
    for group in filter(dataclasses.is_dataclass, call.keywords.values()):
        options |= {field.name for field in dataclasses.fields(group)}  # pyright: ignore[reportArgumentType]
    names = [name if name in options else CALLED.get(name, name) for name in error.names]
    if not options.issuperset(names):
        return RuntimeError(str(error))
    return InputError(ArgumentError(*dict.fromkeys(names), said=error.said).about("Option", flag))


def _later(command: Callable[..., Answer]) -> Callable[..., functools.partial[Answer]]:
    """Command with its options bound, to be run after all have been read."""

    @functools.wraps(command)
    def bind(*args: Any, **kwargs: Any) -> functools.partial[Answer]:
        bound = inspect.signature(command).bind(*args, **kwargs)
        bound.apply_defaults()
        return functools.partial(command, **bound.arguments)

    return bind


def _parse(arguments: list[str]) -> functools.partial[Answer] | None:
    """Command with its options, or None after help or the version was printed. **Raises:** `InputError`."""
    import tyro

    if arguments == ["--version"]:
        print(f"jaxcage {__version__}")
        return None
    box = io.StringIO()
    try:
        with contextlib.redirect_stderr(box):
            return tyro.extras.subcommand_cli_from_dict(
                {name: _later(command) for name, command in COMMANDS.items()},
                prog="jaxcage",
                description="Dynamics of rolling-bearing cages: where they move chaotically.",
                args=arguments,
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes),
            )
    except SystemExit as stop:
        if stop.code in (0, None):
            return None
        command = ["jaxcage", *(name for name in arguments[:1] if name in COMMANDS)]
        raise InputError(_sentence(box.getvalue(), " ".join(command))) from stop


def _sentence(box: str, command: str) -> str:
    """Text of an error box of tyro as one sentence; it ends with the help of `command`.

    Parts are separated by rules; the title is in the upper border, or above a rule where there is no line drawing.
    """
    lines = [line.strip(" │") for line in box.splitlines()]
    is_rule = lambda line: not line.strip("─-╭╮╰╯") or line[0] == "╭"
    parts = [" ".join(" ".join(part).split()) for rule, part in itertools.groupby(lines, is_rule) if not rule]
    said, *more = parts if box.startswith("╭") else parts[1:]
    ours, found, why = said.removeprefix("Error parsing ").partition(": ")
    if found and why.startswith("must "):
        return f"Option {ours} {why}"
    useful = [said, *(part for part in more[:1] if part.startswith("Available"))]
    return "; ".join(part.rstrip(".") for part in useful) + f" (see {command} --help)."
