"""What commands start from: a case or TOML file, an integration method, a folder to write to."""

import contextlib
import contextvars
import dataclasses
import math
import os
from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure

from ..bearing import PUBLISHED_CASES, PublishedCase, design_rule_violations
from ..integrate import AbstractMethod, FixedSteps, controlled, method
from ..io import check_writable, load_model, replacing
from ..models import CageModel, case
from ..plotting import Style, restyle
from ._console import say
from ._errors import UsageError, refusing, require_at_least
from ._options import CommonOptions, IntegrationOptions, Options


@dataclasses.dataclass(frozen=True)
class Subject:
    """The model that a command is about."""

    name: str
    """Name of the case, or of the TOML file without its ending and with `_` for what no figure can show."""
    model: CageModel
    published: PublishedCase | None


def subject(options: Options) -> Subject:
    """The case or the model in the TOML file that the options name; a broken design rule is said on
    standard error.
    """
    given = options.case
    if given in PUBLISHED_CASES:
        found = Subject(given, case(given), PUBLISHED_CASES[given])
    elif Path(given).suffix.lower() == ".toml" or os.path.exists(given):
        with refusing():
            found = Subject(_title(Path(given).stem), load_model(given), None)
    else:
        known = ", ".join(PUBLISHED_CASES)
        raise UsageError(f"Case '{given}' is unknown: it must be one of {known}, or the path of a TOML file.")
    broken = design_rule_violations(found.model.bearing, found.model.guidance_gap)
    if broken:
        say("Warning: the design rule T > C_r > G_r is broken: " + " ".join(broken))
    return found


def _title(name: str) -> str:
    """A name that matplotlib shows as it is: no bytes that are no text, no mathematics."""
    return "".join(c if c.isprintable() and c != "$" else "_" for c in name)


def angular_speed(rpm: float) -> float:
    """Speed [rad/s] from revolutions per minute, the unit of the command line."""
    return rpm * math.pi / 30


def integration(options: IntegrationOptions) -> AbstractMethod:
    """The integration method that the options ask for."""
    if options.steps is not None:
        require_at_least("--steps", options.steps, 1)
    try:
        if options.solver is None:
            return method(steps=options.steps, tolerance=options.tolerance)
        return method(options.solver, options.steps, options.tolerance)
    except ValueError as error:
        raise UsageError(_as_options(str(error))) from error


def orbit_integration(options: IntegrationOptions) -> AbstractMethod | None:
    """The same for orbits, which take as many steps as they need (None) unless the options ask for something else."""
    return integration(options) if asks_for_a_method(options) else None


def sweep_integration(options: IntegrationOptions) -> AbstractMethod:
    """The same for sweeps, whose steps are controlled unless the options ask for something else."""
    return integration(options) if asks_for_a_method(options) else controlled()


def asks_for_a_method(options: IntegrationOptions) -> bool:
    """Whether any option says how to integrate."""
    return not (options.solver is None and options.steps is None and options.tolerance is None)


def _as_options(sentence: str) -> str:
    """A library's sentence about arguments, said of the options with the same names."""
    for name in ("solver", "steps", "tolerance"):
        sentence = sentence.replace(f"`{name}`", f"--{name}")
    return sentence.replace("Argument", "Option", 1)


def samples_per_revolution(chosen: AbstractMethod, most: int = 64) -> int:
    """Samples that a method can give: of equal steps, they must divide the number."""
    if not isinstance(chosen, FixedSteps):
        return most
    return max(n for n in range(1, min(most, chosen.steps) + 1) if chosen.steps % n == 0)


def output_folder(options: CommonOptions) -> Path:
    """The folder to write to, tried out before anything is computed."""
    if not options.out:
        raise UsageError('Option --out must name a folder, but is "".')
    with refusing():
        return check_writable(options.out)


_style: contextvars.ContextVar[Style] = contextvars.ContextVar("style", default="light")


@contextlib.contextmanager
def figures_in(style: Style) -> Iterator[None]:
    """Around a command: figures are saved in this style."""
    token = _style.set(style)
    try:
        yield
    finally:
        _style.reset(token)


def save_figure(figure: Figure, path: Path) -> str:
    """Write a figure, whole or not at all, in the style of the command. **Returns:** its path as text."""
    with replacing(path) as temporary:
        restyle(figure, _style.get()).savefig(temporary, dpi=figure.dpi)
    return str(path)
