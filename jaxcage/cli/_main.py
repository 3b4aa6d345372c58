"""The `jaxcage` command: read the options, carry the command out, show its report."""

import contextlib
import importlib
import io
import re
import sys
from collections.abc import Sequence

from .._cache import keep_compiled_programs
from ._console import leave_at_once_when_interrupted, say
from ._errors import BAD_INPUT, FAILED, INTERRUPTED, OK, ComputationError, UsageError
from ._options import Command, CommonOptions
from ._report import show


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with `arguments`, by default those of the process.

    **Returns:** exit status: 0, 1 for a computation without a result, 2 for bad input, 130 when
    interrupted.
    """
    if arguments is None:  # the process is ours, not a notebook's
        leave_at_once_when_interrupted()
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
    except KeyboardInterrupt:
        say("Interrupted.")
        return INTERRUPTED


def _carry_out(options: CommonOptions) -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    if not options.no_cache:
        keep_compiled_programs()
    implementation = importlib.import_module(f".{options.implementation}", __package__)
    show(implementation.run(options), options.json)


def _parse(arguments: list[str]) -> CommonOptions | None:
    """Options, or None if help was asked for and given.

    **Raises:** `UsageError`: the boxes in which tyro reports errors are boiled down to one
    sentence.
    """
    import tyro

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
    return f"{'; '.join(kept) or 'The command line was not understood'} (see jaxcage --help)."
