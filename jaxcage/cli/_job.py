"""What a command has to work with: its options, the model and methods they ask for, and a folder to write to."""

import contextlib
import dataclasses
import functools
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._errors import InputError
from ..bearing import PUBLISHED_CASES, PublishedCase, design_rule_violations
from ..io import (
    BearingFile,
    Unknown,
    Whose,
    cage_rpm,
    check_writable,
    read_bearing,
    read_whole_bearing,
    replacing,
    subject_of,
    write_columns,
)
from ..models import FASTEST, WHOLE_BEARINGS, BearingModel, CageModel, case, fastest_speed, whole_bearing
from ..plotting import Style, add_shaft_axes, new_figure, restyle
from ..report import chosen
from ..solve import AbstractMethod, FixedSteps, method, native
from ._console import Say, progress, say
from ._options import WHOLE_COMMANDS, AnyOptions, CommonOptions, IntegrationOptions, Options
from ._readers import flag


Given = TypeVar("Given", bound=AnyOptions, covariant=True)


class Job(Generic[Given]):
    """A command that is being carried out."""

    def __init__(self, command: str, options: Given):
        """**Raises:** `InputError` for a model or method that cannot be had."""
        self.command, self.options, self.began = command, options, time.perf_counter()
        self.name = ""
        """Name of the case, or of the TOML file without its ending and with `_` for what no figure can show."""
        self.files: dict[str, str | None] = {}
        """What was written, by the key under which it is listed; None for what was asked for and could not be made."""
        self.asked: AbstractMethod | None = None
        """Integration method, if any option says how to integrate."""
        if isinstance(options, IntegrationOptions):
            self.asked = _method(options)
        if isinstance(options, Options):
            whole = _is_whole(options.case)
            if whole:
                self.name, self.whole, self.file = _whole_subject(options.case, command)
            else:
                self.name, self.model, self.published, self.file = read_subject(options.case)
            self.options = filled = _filled(options, whole)
            if not whole:
                self.options = self._of_the_cage(filled)

    whole: BearingModel | None = None
    """The whole bearing, if the case is one; there is no `model` then."""
    model: CageModel
    published: PublishedCase | None
    file: BearingFile | None = None
    """What the TOML file says, None for a published case."""

    @property
    def speeds(self) -> Whose:
        """Whose speeds bare numbers are."""
        if self.file is not None:
            return self.file.speeds
        return "cage" if self.whole is None else "shaft"

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """What the file knows within ranges only."""
        return () if self.file is None else self.file.unknowns

    @property
    def ratio(self) -> float:
        """Cage speed over shaft speed."""
        return float(self.model.bearing.cage_speed_ratio)

    @property
    def at_speed(self) -> str:
        """The one speed that a command is about, in words."""
        cage = self.options.speed  # pyright: ignore[reportAttributeAccessIssue]
        return f"{cage:g} rpm (shaft {cage / self.ratio:.0f} rpm)"

    def _of_the_cage(self, options: Any) -> Any:
        """Options with their speeds as cage speeds [rpm]: whatever comes after knows no others."""
        given = {n: getattr(options, n) for n in ("first", "last", "speed") if getattr(options, n, None) is not None}
        if not given:
            return options
        found = dataclasses.replace(options, **{n: cage_rpm(v, self.speeds, self.ratio) for n, v in given.items()})
        found.check()
        limit = fastest_speed(self.model) * 30 / math.pi
        for name in given:
            if (speed := getattr(found, name)) > limit:
                raise InputError(
                    f"Option {flag(name)} must be a cage speed of at most {limit:.0f} rpm, which is {FASTEST:g} m/s at "
                    f'its land, but {speed:g} rpm was given: is that the shaft\'s (write "{speed:g} rpm shaft")?'
                )
        return found

    @property
    def method(self) -> AbstractMethod:
        """Integration method of sweeps, whose steps are controlled unless the options ask for something else."""
        return native() if self.asked is None else self.asked

    @functools.cached_property
    def folder(self) -> Path:
        """The folder to write to, tried out."""
        assert isinstance(self.options, CommonOptions)
        return check_writable(self.options.out)

    @contextlib.contextmanager
    def computing(self, what: str = "", unit: str = "", advice: str = "") -> Iterator[Say]:
        """Around a computation: nothing is computed for minutes that cannot be written. Yields what is to be told of
        the progress; `unit` and `advice` are as in `progress`.
        """
        _ = self.folder
        at = f"{what} of {self.name}" if what else f"{self.command} {self.name}".rstrip()
        with progress(at, unit, advice) as bar:
            yield bar

    @property
    def seconds(self) -> float:
        """Since the command began."""
        return time.perf_counter() - self.began

    def saved(self, figure: Figure, path: Path) -> Path:
        """Write a figure in the style that is asked for."""
        assert isinstance(self.options, CommonOptions)
        return save_figure(figure, path, self.options.style)

    def given(self, names: str) -> dict[str, Any]:
        """Options that go to the library under their own names, but for those that are left out: it knows what then."""
        return {name: value for name, value in chosen(self.options, names).items() if value is not None}

    def path(self, ending: str) -> Path:
        """Where a file goes: named after the command and the case."""
        return self.folder / f"{self.command}_{self.name}{ending}"

    def figure(self, figure: Figure, key: str = "figure", detail: str = "") -> None:
        """Write a figure, of a cage with shaft speeds under its cage speeds, and list it under `key`."""
        if self.whole is None:
            add_shaft_axes(figure, self.ratio)
        self.listed(key, self.saved(figure, self.path(f"{detail}.png")))

    def draw(
        self,
        draw: Callable[[Axes], Any],
        size: tuple[float, float],
        title: str,
        key: str = "figure",
        detail: str = "",
    ) -> None:
        """Write a figure of one diagram, and list it under `key`."""
        figure = new_figure(*size)
        draw(figure.subplots())
        figure.suptitle(title, fontsize=11)
        self.figure(figure, key, detail)

    def columns(self, columns: Mapping[str, np.ndarray], key: str = "data", detail: str = "") -> None:
        """Write a table of numbers, and list it under `key`."""
        self.listed(key, write_columns(self.path(f"{detail}.csv"), columns))

    def text(self, text: str, path: Path, key: str) -> None:
        """Write a page, and list it under `key`."""
        with self.written(key, path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    @contextlib.contextmanager
    def written(self, key: str, path: Path) -> Iterator[Path]:
        """A temporary place to write a file to; it becomes `path` at the end, and is listed under `key`."""
        with replacing(path) as temporary:
            yield temporary
        self.listed(key, path)

    def listed(self, key: str, path: Path) -> None:
        """Show a file at the end."""
        self.files[key] = str(path)


def _filled(options: Any, whole: bool) -> Any:
    """Options with what those that were left out usually are.

    **Raises:** `InputError` for one that says nothing of such a case.
    """
    for name in (options.of_cage if whole else options.of_whole).split():
        field = type(options).__dataclass_fields__[name]
        if getattr(options, name) != field.default:
            about = "does not go with a whole bearing" if whole else "goes with a whole bearing, such as nu2310"
            raise InputError(f"Option {flag(name)} {about}.")
    usual = {name: pair[whole] for name, pair in options.usual.items() if getattr(options, name) in (None, ())}
    return dataclasses.replace(options, **usual)


def save_figure(figure: Figure, path: Path, style: Style = "light") -> Path:
    """Write a figure, whole or not at all."""
    with replacing(path) as temporary:
        restyle(figure, style).savefig(temporary, dpi=figure.dpi)
    return path


def _is_whole(given: str) -> bool:
    """Whether a case is a whole bearing, by its name or by what its file says."""
    return subject_of(given) == "bearing" if _is_file(given) else given.lower() in WHOLE_BEARINGS


def _is_file(given: str) -> bool:
    return given not in PUBLISHED_CASES and (Path(given).suffix.lower() == ".toml" or os.path.exists(given))


def _whole_subject(given: str, command: str) -> tuple[str, BearingModel, BearingFile | None]:
    """Name and model of a whole bearing by its name or from its file.

    **Raises:** `InputError` for a command that takes none yet.
    """
    if command not in WHOLE_COMMANDS:
        raise InputError(
            f"Case '{given}' is a whole bearing, but `jaxcage {command}` takes a cage: whole bearings go with "
            f"{', '.join(WHOLE_COMMANDS)}."
        )
    if not _is_file(given):
        return given.lower(), whole_bearing(given), None
    file = read_whole_bearing(given)
    _say_doubts(file.model)
    return _shown_name(given), file.model, file


def whole_subject(given: str) -> tuple[str, BearingModel]:
    """Name and model of another whole bearing.

    **Raises:** `InputError` for a cage.
    """
    if not _is_whole(given):
        raise InputError(f"Case '{given}' must be a whole bearing, as the first one is: two of a kind are compared.")
    name, model, _ = _whole_subject(given, "compare")
    return name, model


class Subject(NamedTuple):
    """A case or a TOML file."""

    name: str
    model: CageModel
    published: PublishedCase | None
    file: BearingFile | None


def read_subject(given: str) -> Subject:
    """A case or TOML file by its name; a broken design rule and an oil too thin are said on standard error.

    **Raises:** `InputError`.
    """
    file = None
    if given in PUBLISHED_CASES:
        name, model, published = given, case(given), PUBLISHED_CASES[given]
    elif _is_file(given):
        name, file = _shown_name(given), read_bearing(given)
        model, published = file.model, None
    else:
        known = ", ".join(PUBLISHED_CASES)
        raise InputError(f"Case '{given}' is unknown: it must be one of {known}, or the path of a TOML file.")
    _say_doubts(model)
    return Subject(name, model, published, file)


def _shown_name(path: str) -> str:
    """Name of a file without its ending, as matplotlib shows it."""
    return "".join(c if c.isprintable() and c != "$" else "_" for c in Path(path).stem)


def _say_doubts(model: CageModel | BearingModel) -> None:
    if broken := design_rule_violations(model.bearing, model.guidance_gap):
        say("Warning: the design rule T > C_r > G_r is broken: " + " ".join(broken))
    for doubt in model.lubricant.doubts():
        say(f"Warning: {doubt}")


def _method(options: IntegrationOptions) -> AbstractMethod | None:
    if options.solver is None and options.steps is None and options.tolerance is None:
        return None
    named = {} if options.solver is None else {"solver": options.solver}
    return method(**named, steps=options.steps, tolerance=options.tolerance)


def samples_per_revolution(chosen: AbstractMethod, most: int = 64) -> int:
    """Samples that a method can give: of equal steps, they must divide the number."""
    if not isinstance(chosen, FixedSteps):
        return most
    return max(n for n in range(1, min(most, chosen.steps) + 1) if chosen.steps % n == 0)


def blocks_of(revolutions: int) -> int:
    """Blocks for error bars, into which a multiple of 10 can be cut."""
    return 10 if revolutions % 20 else 20
